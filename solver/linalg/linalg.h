/* linalg.h: what several parts of the solver ask of vectors and matrices. */
#ifndef UZ_LINALG_H
#define UZ_LINALG_H

#include "uzawa.h"

/* x (n, or NULL: nothing to check) called `name`: UZ_ERR_NOT_FINITE names its first entry that is no finite number. */
uz_status uz_check_finite(const double *x, int64_t n, const char *name, uz_error *err);

/* What the arrays of A take; 0 for a zeroed struct. */
size_t uz_csc_bytes(const uz_csc *A);

/* Where in A->idx and A->val the first entry of `column` in this row or below is, by bisection: rows ascend in a
 * column. */
int64_t uz_csc_seek(const uz_csc *A, int64_t row, int64_t column);
/* Where the entry of `row` in `column` is; -1: A has none. */
int64_t uz_csc_find(const uz_csc *A, int64_t row, int64_t column);

/* Whether each row has one entry, so that a contact row bounds a dof. False also where there is no memory to tell. */
bool uz_csc_is_single(const uz_csc *A);

/* What columns begin to end - 1 of uz_csc_symv's A add to y: nothing above row `begin`. */
void uz_csc_symv_columns(double *y, const uz_csc *A, double alpha, const double *x, int64_t begin, int64_t end);

/* Triplets that come one by one; zeroed at first. */
typedef struct {
    int64_t n, room, *row, *col;
    double *val;
    bool failed; /* there was no memory for one: no further one is added */
} uz_entries;
/* False: they have failed, and all that is there stays. */
bool uz_entries_add(uz_entries *to, int64_t row, int64_t col, double value);
/* uz_csc_from_triplets of them, after which they are clear. UZ_ERR_MEMORY, also where they have failed. */
uz_status uz_csc_from_entries(uz_csc *out, int64_t rows, int64_t cols, uz_entries *from, uz_error *err);
/* Frees what they have, and makes them zero. */
void uz_entries_clear(uz_entries *entries);

#endif
