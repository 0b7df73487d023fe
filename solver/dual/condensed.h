/* condensed.h: what the files of the condensed form share. */
#ifndef UZ_DUAL_CONDENSED_H
#define UZ_DUAL_CONDENSED_H

#include "dual/form.h"

/* Dense matrices are column-major; symmetric ones and factors use the lower triangle. */

/* Below this, relative to the largest, a pivot of D is noise. */
#define UZ_PIVOT_LEAST 1e-11

/* m x m each, made when first needed, under lazy->making. */
typedef struct {
    double *D;
    double *D_inverse; /* where `scaled` */
} uz_condensed_made;

typedef struct {
    uz_dual dual;
    int64_t n_b;       /* the last dofs of the factor, those that N touches among them, in its order */
    int64_t *position; /* n_b: their places in the factor's order */
    uz_csc N_b;        /* m x n_b: those columns of N */
    double *L_bb;      /* n_b x n_b: Cholesky factor of the Schur complement S; NULL where the contact is not last */
    uz_reach *reach;   /* of the contact dofs, where they are not last in the factor; else NULL */
    double *D_chol;    /* m x m: Cholesky factor of D; NULL when D is singular to working precision or `scaled` */
    bool scaled;       /* N_b has one entry in each row and column: D = N_b S^-1 N_b', D^-1 = N_b^-T S N_b^-1 */
    int64_t *row_of;   /* scaled: row_of[k] is the row of column k's entry, n_b */
    double *scale;     /* scaled: that entry, n_b */
    uz_condensed_made *made;
} uz_condensed;

/* Corrections are L_bb'c (n_b), with a reach w (m), c = K^-1 N'w. */
typedef struct {
    uz_dual_load load;
    const uz_condensed *dense;
    uz_factor_workspace *ws;
    double *base;                /* d: y = L^-1 P p in the factor's order; NULL in a block */
    const double *lane;          /* in a block: in place of base, with a stride of UZ_LANES */
    const double *D, *D_inverse; /* m x m, NULL until needed here */
    double *apply_room;          /* n_b */
    double *work, *work2;        /* max(m, n_b), max(d, m, n_b); in a block max(m, n_b) each */
} uz_condensed_load;

/* z (n_b) = L_bb^-1 N_b'w; contact last. */
void uz_condensed_response(double *z, const uz_condensed *dense, const double *w);

/* D r through the factor of the Schur complement; contact last. */
void uz_condensed_apply_factor(double *Dr, const uz_condensed_load *x, const double *r);

/* Operations; applying never fails. */
uz_status uz_condensed_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
uz_status uz_condensed_prepare(uz_dual_load *load, uz_error *err);
uz_status uz_condensed_inverse_column(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err);
uz_status uz_condensed_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close);
uz_status uz_condensed_solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active,
                                    uz_error *err);

#endif
