/* cholmod_view.h: a lower triangle as CHOLMOD sees it, for what calls CHOLMOD beside the library. */
#ifndef TESTS_CHOLMOD_VIEW_H
#define TESTS_CHOLMOD_VIEW_H

#include "uzawa.h"

#include <string.h>
#include <suitesparse/cholmod.h>

/* Borrows the arrays of K. */
static inline cholmod_sparse cholmod_view(const uz_csc *K)
{
    cholmod_sparse A;
    memset(&A, 0, sizeof A);
    A.nrow = A.ncol = (size_t)K->cols;
    A.nzmax = (size_t)K->ptr[K->cols];
    A.p = K->ptr;
    A.i = K->idx;
    A.x = K->val;
    A.stype = -1;
    A.itype = CHOLMOD_LONG;
    A.xtype = CHOLMOD_REAL;
    A.sorted = A.packed = 1;
    return A;
}

#endif
