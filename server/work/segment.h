/* segment.h: memory that this process shares with another one: a file without a name, mapped by both.
 *
 * It only grows, and neither side can make it shorter (F_SEAL_SHRINK), so that no access to what is mapped can fail
 * because of what the other side does. What a large job wrote stays in memory for the next one, since pages that are
 * asked for anew cost as much as all else that is done with an answer; segment_rest gives back what is more than that,
 * and all of it once no job follows. Its room stays. */
#ifndef SERVER_WORK_SEGMENT_H
#define SERVER_WORK_SEGMENT_H

#include <stdbool.h>
#include <stddef.h>

#define SEGMENT_KEPT ((size_t)1 << 20)  /* bytes that are always there, and always mapped */
#define SEGMENT_WARM ((size_t)32 << 20) /* at most so many stay while jobs follow each other */

typedef struct {
    int fd;
    char *at;
    size_t mapped;
} segment;

/* Of at least `bytes`; false: errno. segment_close is fine after a failure, and for one that is all zero. */
bool segment_make(segment *s, size_t bytes);
/* The other side's view of one that it was given, whose descriptor it then owns. */
bool segment_attach(segment *s, int fd);
void segment_close(segment *s);
/* Makes s->at good for so many bytes, which may move it. False: no memory, or, where it may not grow, there are fewer.
 */
bool segment_reach(segment *s, size_t bytes, bool grow);
/* Keeps no more than `most` mapped, SEGMENT_KEPT or more; give_back: nor in memory, for both sides. */
void segment_rest(segment *s, size_t most, bool give_back);

#endif
