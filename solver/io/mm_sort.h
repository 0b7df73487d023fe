/* mm_sort.h: entries in any order become columns. Private to the Matrix Market reader. */
#ifndef UZ_LINALG_MM_SORT_H
#define UZ_LINALG_MM_SORT_H

#include "uzawa.h"

/* In: A->idx[k], A->val[k], (*col)[k] are row, value and column of entry k < count; A->ptr[1 + j] counts column j.
 * Out: *A in compressed columns with ascending rows. *repeated is the smallest k that has the place of an earlier
 * entry, -1 if there is none; both then stand in A. Frees *col and makes it NULL. O(count log(column length)), and
 * O(count + columns) where the entries came row by row; takes no room by the number of rows. */
uz_status mm_sort_columns(uz_csc *A, int64_t **col, int64_t count, int64_t *repeated, uz_error *err);

#endif
