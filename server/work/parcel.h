/* parcel.h: an outcome in one piece of memory, as a process that solves leaves it for the daemon.
 *
 * Who reads it trusts nothing in it: every length is checked against the piece, texts are copied, so that nobody can
 * change them under who reads them. Numbers stay where they are. */
#ifndef SERVER_WORK_PARCEL_H
#define SERVER_WORK_PARCEL_H

#include "store/store.h"

#include <stdbool.h>
#include <stddef.h>

/* Returns the parcel's size; to: so many bytes at a multiple of 8, NULL: it is only counted. */
size_t parcel_write(char *to, const store_outcome *outcome);

typedef struct {
    store_outcome outcome;
    store_answer *answers; /* n: the whole, then the cases */
    size_t n;
} parcel;
/* `from` (a multiple of 8) has to outlive *out, which the caller clears in every case. False: no memory, or it is no
 * parcel. */
bool parcel_read(parcel *out, const char *from, size_t size);
void parcel_clear(parcel *p);

#endif
