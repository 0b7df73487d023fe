/* factor_private.h: what the files of this folder share. */
#ifndef UZ_FACTOR_PRIVATE_H
#define UZ_FACTOR_PRIVATE_H

#include "factor/factor.h"

#include <stdatomic.h>
#include <suitesparse/cholmod.h>

struct uz_analysis {
    atomic_int holders; /* creator and factors: the last one frees it */
    cholmod_factor *L;  /* symbolic, supernodal */
    int64_t n, nnz;     /* of K */
    int64_t n_last;
    int64_t *last;     /* n_last dofs, ascending */
    int64_t *position; /* n: inverse of L->Perm */
    uz_ordering ordering;
    double flops, seconds;
};

/* Another holder of the same object; ends with uz_analysis_free. */
uz_analysis *uz_analysis_hold(const uz_analysis *analysis);

struct uz_factor {
    uz_analysis *analysis;
    cholmod_factor L; /* the analysis's with numbers: only x and what says so are this factor's own */
    int64_t n;
    uz_factor_info info;
};

struct uz_factor_workspace {
    cholmod_common common;
    double *panel; /* CHOLMOD's gather room, grown on demand */
    size_t panel_size;
};

/* Starts a CHOLMOD workspace that never prints, never aborts and gives LL' supernodal factors with 64-bit integers. */
bool uz_cholmod_start(cholmod_common *common);

/* K as CHOLMOD sees it. */
cholmod_sparse uz_view_lower(const uz_csc *K);

/* A dense matrix over an array, column-major. */
cholmod_dense uz_view_dense(double *x, int64_t rows, int64_t columns);

/* Fills perm (n) with a fill-reducing ordering of A that keeps `last` at the end. *ordering: what was asked for on
 * entry (not AUTO), what was used on return. */
uz_status uz_order(int64_t *perm, cholmod_sparse *A, const int64_t *last, int64_t n_last, uz_ordering *ordering,
                   cholmod_common *common, uz_error *err);

/* The graph of groups of dofs with equal neighbours (lower triangle, pattern), freed by cholmod_l_free_sparse; NULL: no
 * memory. A: lower triangle. head[i] (n): the first dof of i's group; groups are numbered in the order of their heads.
 */
cholmod_sparse *uz_compress(int64_t *head, const cholmod_sparse *A, cholmod_common *common);
/* perm (n) from an ordering of the groups: each group's dofs in a row. false: no memory. */
bool uz_expand(int64_t *perm, const int64_t *group_perm, const int64_t *head, int64_t n, int64_t groups);

#endif
