/* stream.h: what the first process of a group has in its hands: the stream to the one that asks. */
#ifndef UZ_GROUP_STREAM_H
#define UZ_GROUP_STREAM_H

#include <stdbool.h>
#include <stddef.h>

/* where: "@name", an abstract socket of this machine, or the number of a descriptor that is open. Negative: there is
 * none. */
int stream_open(const char *where);
/* False: the other side is gone. */
bool stream_read(int fd, void *to, size_t size);
bool stream_write(int fd, const void *from, size_t size);

#endif
