/* trail.h: a file beside the database that says what was committed, so that the loss of commits does not pass in
 * silence: a write-ahead log that somebody truncates, or deletes, is to SQLite one that ends there.
 *
 * Commits are numbered, and the number of the last one stands in the database (tally, status -1). The trail,
 * "FILE-trail", has lines "NUMBER WHAT ID" of commits that are on disk: they are written after the sync, and not synced
 * themselves, so that the trail is never ahead of the database but where the database has lost something. Its first
 * line names the database (tally, status -2), since another one may stand in its place. It is bounded: old lines go.
 * What fails here is silent: the trail tells of losses, and nothing depends on it. */
#ifndef SERVER_STORE_SQLITE_TRAIL_H
#define SERVER_STORE_SQLITE_TRAIL_H

#include <sqlite3.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Lines; what finds no room is left out. */
typedef struct {
    size_t len;
    char data[32768];
} trail_text;

typedef struct {
    int fd; /* -1: there is none */
    char *path, first[48];
    int64_t size;
    uint64_t number;    /* of the last commit; the writer's, as `noted` */
    trail_text noted;   /* of the transaction under way */
    trail_text waiting; /* of commits that are not on disk yet; under sync_lock */
    trail_text taken;   /* the syncer's */
} trail;

/* What the trail of the file has and the database has not: malloc'ed words for a person, NULL: nothing. *last is the
 * last number of both. */
char *trail_missing(sqlite3 *db, const char *file, uint64_t *last);

/* Opens the trail of the file to append. The caller closes fd and frees path. */
void trail_open(trail *t, sqlite3 *db, const char *file);

/* A transaction begins with noted.len 0: what was noted of one that was rolled back goes. */
void trail_note(trail *t, const char *what, const char *id);
/* What was noted belongs to the commit `number` now. */
void trail_committed(trail *t, uint64_t number);
/* What was taken is on disk and is appended, or it is forgotten. */
void trail_append(trail *t, bool on_disk);

#endif
