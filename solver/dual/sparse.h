/* sparse.h: what the forms without a dense operator share: loads that keep displacements, and rows that bound a single
 * dof each, as in obstacle problems. */
#ifndef UZ_DUAL_SPARSE_H
#define UZ_DUAL_SPARSE_H

#include "dual/form.h"

/* Row i is scale_i u_dof. NULL where some row of N has more or fewer than one nonzero entry. */
typedef struct {
    int64_t *dof;  /* m */
    double *scale; /* m */
} uz_bounds;

/* The same problem as minimize 1/2 u'Ku - p'u, bottom <= u <= top, of one load. Bounds are listed of the dofs that rows
 * are on. */
typedef struct {
    const uz_bounds *bounds;
    const double *p;        /* d: that of the load */
    int64_t n, *dof;        /* n: the dof of each, ascending */
    double *top, *bottom;   /* n: +-INFINITY where there is none */
    int64_t *upper, *lower; /* n: the row that says so, the tightest; -1: none */
    bool contradictory;     /* some bottom lies above its top */
    int64_t *holder;        /* n: the row that holds the dof in the current guess, -1: free */
    bool *fixed;            /* d: holder >= 0 */
    double *u, *r;          /* d, m */
    double *force;          /* d, work2 of the load: a residual of equilibrium */
    bool balanced;          /* force = K u - p */
    double *size;           /* d: what its rounding is in proportion to; NULL: K has no entries */
    double largest;         /* of |u|, >= 0: size was told by it, roughly; -1: by the terms of the sums */
    double *point;          /* d: where the sweeps ended; NULL before the first: then its energy is INFINITY */
    double point_energy;
    double *most, *least; /* d, behind point: top and bottom of each dof, for sweeps */
    size_t swept_bytes;   /* what the dofs that were swept last took, until the sweeps ended */
} uz_bounded;

typedef struct {
    uz_dual dual;
    uz_csc touched; /* N without columns of zeros: its entries */
    uz_bounds bounds;
} uz_sparse;

/* Corrections are c (d). */
typedef struct {
    uz_dual_load load;
    double *p;            /* d: of rows that bound dofs, or where the form wants it; else NULL */
    double *base;         /* d: u0 = K^-1 p */
    double *response;     /* d: K^-1 N'r of the last apply */
    double *work, *work2; /* max(d, m) each */
    double slack;         /* how far u(r) is from what the last apply or solve_active left, in the energy norm */
    uz_bounded *box;      /* with bounds, else NULL */
    const double *known_u, *known_r; /* d, m: the displacement and reactions of the last guess of the active rows; NULL:
                                      * it has no answer */
    uz_multigrid_room *room;         /* the form's, who frees it; NULL: it has none */
} uz_sparse_load;

/* Operations, or most of them: create, clear; load: with a base of zeros, and then from the base. */
uz_status uz_sparse_create(uz_dual *dual, const uz_stop *stop, uz_error *err);
void uz_sparse_clear(uz_dual *dual);
uz_status uz_sparse_load_begin(uz_sparse_load *x, uz_error *err);
/* Keeps p in x->p; solved: the base is not 0. */
uz_status uz_sparse_load_end(uz_sparse_load *x, const double *p, bool solved, uz_error *err);
void uz_sparse_unload(uz_sparse_load *x);
uz_status uz_sparse_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close);
uz_status uz_sparse_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);
bool uz_sparse_guess_active(uz_dual_load *load, bool *active);

/* x->box, once p, base, h and g0 are there. */
uz_status uz_bounded_create(uz_sparse_load *x, const uz_bounds *bounds, uz_error *err);

/* Does load->K have its entries, or its diagonal only? */
static inline bool uz_sparse_has_entries(const uz_dual *dual)
{
    return !dual->amg || !dual->amg->mg->knows_K;
}
/* 1 / K_jj: the metric in which penetrating rows are lifted. In a sorted lower triangle the diagonal comes first. */
static inline double uz_sparse_weight(const uz_csc *K, int64_t j)
{
    return 1.0 / K->val[K->ptr[j]];
}
/* y (d) = K x, by whatever the operator has of K. */
void uz_sparse_multiply(const uz_dual_load *load, double *y, const double *x);

/* Steps of solve_active: holds the dofs of the active rows at their bounds, the others at 0 or where they were (keep);
 * false: the bounds contradict each other. force = K u - p and, of held dofs, size = |K| |u| + |p|, what its rounding
 * is in proportion to, roughly: an estimate of it, for less; r from what holds the dofs, `active` the rows that do; the
 * gaps. */
bool uz_bounded_hold(uz_sparse_load *x, const bool *active, bool keep);
void uz_bounded_balance(const uz_sparse_load *x, bool roughly);
void uz_bounded_react(const uz_sparse_load *x, double *g, bool *active);
/* After an answer of `active`, a guess with far too many rows: the next one. False: it is no such guess, or memory is
 * short; active stays. */
bool uz_bounded_shrink(const uz_sparse_load *x, bool *active);
/* y (m): the ray of two bounds on one dof that cross; false, y untouched: none do. */
bool uz_bounded_crossed(const uz_sparse_load *x, double *y);

#endif
