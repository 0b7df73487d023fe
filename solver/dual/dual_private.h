/* dual_private.h: what the forms of the operator share. */
#ifndef UZ_DUAL_PRIVATE_H
#define UZ_DUAL_PRIVATE_H

#include "core/hooks.h"
#include "dual/dual.h"

#include <pthread.h>

/* Dense matrices are column-major; symmetric ones and factors use the lower triangle. */
/* Below this, relative to the largest, a pivot of D is noise. */
#define UZ_PIVOT_LEAST 1e-11

typedef struct {
    int64_t n_b;       /* the last dofs of the factor, those that N touches among them, in its order */
    int64_t *position; /* n_b: their places in the factor's order */
    uz_csc N_b;        /* m x n_b: those columns of N */
    double *L_bb;      /* n_b x n_b: Cholesky factor of the Schur complement S; NULL where the contact is not last */
    uz_reach *reach;   /* of the contact dofs, where they are not last in the factor; else NULL */
    double *D_chol;    /* m x m: Cholesky factor of D; NULL when D is singular to working precision or `scaled` */
    bool scaled;       /* N_b has one entry in each row and column: D = N_b S^-1 N_b', D^-1 = N_b^-T S N_b^-1 */
    int64_t *row_of;   /* scaled: row_of[k] is the row of column k's entry, n_b */
    double *scale;     /* scaled: that entry, n_b */
} uz_condensed;

/* FACTORED, when every row of N has exactly one nonzero entry: row i is scale_i u_dof. NULL otherwise. */
typedef struct {
    int64_t *dof;  /* m */
    double *scale; /* m */
} uz_bounds;

/* The same problem as minimize 1/2 u'Ku - p'u, bottom <= u <= top, of one load. */
typedef struct {
    double *p;              /* d */
    double *top, *bottom;   /* d: +-INFINITY where there is none */
    int64_t *upper, *lower; /* d: the row that says so, the tightest; -1: none */
    bool contradictory;     /* some bottom lies above its top */
    int64_t *holder;        /* d: the row that holds the dof in the current guess, -1: free */
    bool *fixed;            /* d: holder >= 0 */
    bool has_exact;         /* u and r are those of the last guess, to rounding */
    double *u, *r;          /* d, m */
    double *force, *size;   /* d: a residual of equilibrium and what its rounding is in proportion to */
    double *point;          /* d: where the sweeps ended; energy INFINITY before the first */
    double point_energy;
} uz_bounded;

/* Share of a change of the response that an application of D may leave unsolved. */
#define UZ_CHANGE_KEPT 0.01

/* MATRIX_FREE: how well the equations of a load are solved. Slacks are bounds in the energy norm. */
typedef struct {
    uz_cg cg;   /* of the whole body */
    double *p;  /* d */
    double aim; /* relative */
    const uz_hooks *hooks;
    double deadline;
    double base_slack; /* of base = K^-1 p */
    double slack;      /* of what the last apply or solve_active left */
    double tight;      /* relative accuracy of a change of the response */
    bool probing;      /* r is a vector of any size: the answer's says nothing about how accurate D r must be */
    double coarse;     /* accuracy at which the next guess of the active rows is judged */
    double *right;     /* d: a right-hand side */
} uz_inexact;

/* What is made at the first need, by whoever needs it, under the mutex `making`; pointers are published to loads under
 * it and never change. It may be held for seconds: see uz_lock_while. lambda_max is written under both and may be read
 * under either. Order: making, known. */
typedef struct {
    pthread_mutex_t making, known;
    double *D;         /* CONDENSED: m x m */
    double *D_inverse; /* CONDENSED, scaled: m x m */
    double lambda_max; /* NaN until known */
} uz_dual_lazy;

struct uz_dual {
    uz_dual_info info;
    uz_csc N;                /* m x d, rows scaled */
    double *row_scale;       /* m: powers of two */
    const uz_factor *factor; /* NULL: MATRIX_FREE */
    const uz_krylov *krylov; /* MATRIX_FREE */
    uz_csc Nt;               /* d x m */
    uz_condensed dense;      /* CONDENSED */
    uz_bounds bounds;        /* FACTORED */
    uz_dual_lazy *lazy;
};

struct uz_dual_load {
    const uz_dual *dual;
    const uz_csc *K; /* d x d lower triangle, borrowed */
    double *h;       /* m: scaled */
    uz_factor_workspace *ws;
    const double *lane; /* CONDENSED in a block: in place of base, with a stride of UZ_LANES */
    double *base;       /* d: CONDENSED y = L^-1 P p in the factor's order; FACTORED u0 = K^-1 p */
    double *g0;         /* m */
    double psi0;
    const double *D, *D_inverse; /* CONDENSED: m x m, NULL until needed here */
    double *response;            /* FACTORED: d, K^-1 N'r of the last apply */
    double *apply_room;          /* CONDENSED: n_b */
    double *work, *work2;        /* max(d, m, n_b) each; in a block max(m, n_b) */
    double *correction_weight;   /* FACTORED: d, 1 / K_ii: the metric in which penetrating rows are lifted */
    uz_bounded *box;             /* FACTORED with bounds, else NULL */
    double *correction, *kept;   /* CONDENSED L_bb'c (n_b), with a reach w (m), c = K^-1 N'w; FACTORED c (d) */
    bool has_kept;
    int64_t applications; /* of D by uz_dual_load_apply */
    uz_inexact *inexact;  /* MATRIX_FREE, else NULL */
    uz_stop stop;         /* of the run: asked inside dense work of n^3 */
};

uz_status uz_condensed_create(uz_dual *dual, const uz_stop *stop, uz_error *err);
void uz_condensed_clear(uz_condensed *dense);
/* z (n_b) = L_bb^-1 N_b'w; contact last. */
void uz_condensed_response(double *z, const uz_condensed *dense, const double *w);
/* Lists in `rows` the rows with in == which, ascending; their number. */
int64_t uz_list_rows(int64_t *rows, const bool *in, bool which, int64_t m);
/* D_AA (count x count, lower) = rows and columns `rows` of the symmetric m x m matrix D; false: it had to stop. */
bool uz_gather_lower(double *D_AA, const double *D, const int64_t *rows, int64_t count, int64_t m, const uz_stop *stop);
uz_status uz_condensed_load(uz_dual_load *load, const double *p, uz_error *err);
/* g0 from y = L^-1 P p, whose entry k stands at y[k stride]; x (d) is room. */
uz_status uz_condensed_begin(uz_dual_load *load, const double *y, int64_t stride, double *x, uz_error *err);
/* y (d, the same) += L^-1 P N'r and, where `corrected`, the kept correction; x (d) is room. */
uz_status uz_condensed_add_reactions(double *y, int64_t stride, double *x, uz_dual_load *load, const double *r,
                                     bool corrected, uz_error *err);
/* A load with everything but p. whole: with room for vectors of d. */
uz_status uz_dual_load_allocate(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *h, bool whole,
                                uz_error *err);
void uz_condensed_apply(const uz_dual_load *load, double *Dr, const double *r);
uz_status uz_condensed_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close);
uz_status uz_condensed_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, const bool *active,
                                    uz_error *err);
uz_status uz_condensed_need_operator(uz_dual_load *load, uz_error *err);
uz_status uz_condensed_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);

uz_status uz_factored_load(uz_dual_load *load, const double *p, uz_error *err);
uz_status uz_factored_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
uz_status uz_factored_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close);
uz_status uz_factored_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);

uz_status uz_bounds_create(uz_dual *dual, uz_error *err);
void uz_bounds_clear(uz_bounds *bounds);
uz_status uz_bounded_create(uz_dual_load *load, const double *p, uz_error *err);
void uz_bounded_free(uz_bounded *box);
bool uz_bounded_crossed(const uz_dual_load *load, double *y);
bool uz_bounded_guess(uz_dual_load *load, bool *active);
/* Steps of it: holds the dofs of the active rows at their bounds, the others at 0 or where they were (keep); force = K
 * u
 * - p and size = |K| |u| + |p|, what its rounding is in proportion to; r from what holds the dofs, `active` the rows
 * that do; the gaps. */
void uz_bounded_hold(uz_bounded *box, const uz_bounds *bounds, const bool *active, bool keep, int64_t d, int64_t m);
void uz_bounded_balance(uz_bounded *box, const uz_csc *K);
void uz_bounded_react(uz_bounded *box, bool *active, const uz_bounds *bounds, int64_t d, int64_t m);
void uz_bounded_measure_gaps(double *g, const uz_dual_load *load, const bool *active);
uz_status uz_bounded_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active, uz_error *err);
/* The displacement of the last guess if r is its answer: no error of K^-1 on the whole body is in it. */
bool uz_bounded_recover(const uz_dual_load *load, double *u, const double *r);

/* Makes load->base and load->response what `factored` makes them, within the aim. */
uz_status uz_inexact_create(uz_dual_load *load, const double *p, uz_error *err);
void uz_inexact_free(uz_inexact *inexact);
/* Between begin true and false D is applied to vectors of about one size, which is not that of reactions, to this
 * relative accuracy. Overwrites the response. */
void uz_inexact_probe(uz_dual_load *load, bool begin, double accuracy);
uz_status uz_inexact_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
/* Solves for the free dofs of box->u, those held standing at their bounds: r, g, solved, active as
 * uz_dual_load_solve_active. A guess that is seen to be wrong at a looser tolerance is not solved to the end. */
uz_status uz_inexact_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active, uz_error *err);

/* Finds c with (N c)_i = g_i on rows to close and (N c)_i <= g_i on the others, by sweeps over the rows that move along
 * W n_i (Kaczmarz 1937, with inequalities as Hildreth 1957). Nt: columns are the rows of N. weight: diagonal of W > 0.
 * True when no row is left penetrating by more than rounding; c (rows of Nt) and Nc (m) are outputs. */
bool uz_correct_by_sweeps(double *c, double *Nc, const uz_csc *Nt, const double *weight, const double *g,
                          const bool *close);

#endif
