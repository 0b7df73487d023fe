/* room.h: overflow-checked memory for the codec. NULL always means failure: no room is asked for as one byte. */
#ifndef SERVER_CODEC_ROOM_H
#define SERVER_CODEC_ROOM_H

#include <stdint.h>
#include <stdlib.h>

/* Uninitialised room for `count` items of `size` bytes, size > 0; free with free(). */
static inline void *room_for(size_t count, size_t size)
{
    return count <= PTRDIFF_MAX / size ? malloc(count > 0 ? count * size : 1) : NULL;
}

/* Makes a block larger; on failure NULL and the old block stays. */
static inline void *room_grow(void *block, size_t count, size_t size)
{
    return count <= PTRDIFF_MAX / size ? realloc(block, count * size) : NULL;
}

#endif
