/* room.h: overflow-checked memory for the codec. NULL always means failure: no room is asked for as one byte. */
#ifndef SERVER_CODEC_ROOM_H
#define SERVER_CODEC_ROOM_H

#include <stdint.h>
#include <stdlib.h>

/* Uninitialised room for `count` items of `size` bytes; free with free(). */
static inline void *room_for(size_t count, size_t size)
{
    return count > 0 ? reallocarray(NULL, count, size) : malloc(1);
}

#endif
