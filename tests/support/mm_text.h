/* mm_text.h: Matrix Market text with the shortest digits that read back bit for bit. */
#ifndef MM_TEXT_H
#define MM_TEXT_H

#include "uzawa.h"

#include <inttypes.h>
#include <stdio.h>

static inline void mm_put_number(FILE *out, double x)
{
    char text[UZ_DOUBLE_ROOM];
    text[uz_format_double(text, x)] = 0;
    fprintf(out, "%s\n", text);
}

/* Coordinate text; of a symmetric matrix A is the lower triangle. */
static inline void mm_put_matrix(FILE *out, const uz_csc *A, uz_mm_symmetry symmetry)
{
    fprintf(out, "%%%%MatrixMarket matrix coordinate real %s\n%" PRId64 " %" PRId64 " %" PRId64 "\n",
            symmetry == UZ_MM_SYMMETRIC ? "symmetric" : "general", A->rows, A->cols, A->ptr[A->cols]);
    for (int64_t j = 0; j < A->cols; j++)
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            fprintf(out, "%" PRId64 " %" PRId64 " ", (int64_t)A->idx[k] + 1, j + 1);
            mm_put_number(out, A->val[k]);
        }
}

/* Array text, n x 1. */
static inline void mm_put_vector(FILE *out, const double *x, int64_t n)
{
    fprintf(out, "%%%%MatrixMarket matrix array real general\n%" PRId64 " 1\n", n);
    for (int64_t i = 0; i < n; i++)
        mm_put_number(out, x[i]);
}

#endif
