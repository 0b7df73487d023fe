/* cholmod_copy.h: a lower triangle as CHOLMOD reads it, for what calls CHOLMOD beside the library. */
#ifndef TESTS_CHOLMOD_COPY_H
#define TESTS_CHOLMOD_COPY_H

#include "uzawa.h"

#include <string.h>
#include <suitesparse/cholmod.h>

/* To be freed by cholmod_l_free_sparse; NULL: no memory. */
static inline cholmod_sparse *cholmod_copy_of(const uz_csc *K, cholmod_common *common)
{
    const size_t d = (size_t)K->cols, nnz = (size_t)K->ptr[K->cols];
    cholmod_sparse *A = cholmod_l_allocate_sparse(d, d, nnz, 1, 1, -1, CHOLMOD_REAL, common);
    if (!A)
        return NULL;
    SuiteSparse_long *rows = A->i;
    memcpy(A->p, K->ptr, (d + 1) * sizeof *K->ptr);
    memcpy(A->x, K->val, nnz * sizeof *K->val);
    for (size_t k = 0; k < nnz; k++)
        rows[k] = K->idx[k];
    return A;
}

#endif
