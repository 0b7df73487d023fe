/* residual.h: residuals of the original data in double-double precision. */
#ifndef UZ_RESIDUAL_H
#define UZ_RESIDUAL_H

#include "brick/cells.h"
#include "uzawa.h"

/* One pass over K (rows ascending in each column) for v = u + c: e (d) = K v - p - N'r and e_u (d) = K u - p - N'r; Ku
 * and Kc (d) in passing. K is the lower triangle; c is small beside u and enters in double precision. */
typedef struct {
    double *e, *e_u, *Ku, *Kc;
    double *weight;        /* d: uz_dof_weight of each, in passing; NULL: not wanted */
    const uz_brick *brick; /* what K is, of which only the diagonal is there then; NULL: K has its entries */
} uz_residuals;
uz_status uz_equilibrium_residual(uz_residuals *out, const uz_csc *K, const uz_csc *N, const double *p, const double *u,
                                  const double *c, const double *r, uz_error *err);

/* The most terms that an entry of e, or a gap of u + c, is the sum of; -1: no memory. K: lower triangle; brick: as
 * above, or NULL. */
int64_t uz_most_terms(const uz_csc *K, const uz_brick *brick, const uz_csc *N);

/* 1 / K_jj; 1 where that is not positive. */
static inline double uz_dof_weight(const uz_csc *K, int64_t j)
{
    const int64_t first = K->ptr[j];
    const bool diagonal = first < K->ptr[j + 1] && K->idx[first] == j && K->val[first] > 0.0;
    return diagonal ? 1.0 / K->val[first] : 1.0;
}

/* h_i - n_i'(u + c) for row i of N, given as column i of N'; c NULL: zero. One double-double sum from the original
 * data: a gap rounded before c is taken away would hide contradictions as large as its rounding. */
double uz_gap_of_row(const uz_csc *Nt, int64_t i, const double *h, const double *u, const double *c);

#endif
