/* dual.h: the dual operator D = N K^-1 N' of one body, and the dual problem of one load on it.
 *
 *     psi(r) = psi0 + r'g0 - 1/2 r'D r,   gap g(u(r)) = g0 - D r,   K u(r) = p + N'r
 *
 * The operator has several forms (form.h); nobody asks which one stands behind it, but what it can do: `can`.
 * Rows of N are scaled to a norm of about 1 by powers of two, so that how a caller wrote a condition changes nothing
 * but exponents; unit normals stay as they are. All m-vectors of this interface are those of the scaled rows.
 *
 * A uz_dual is immutable once created and shared by threads; a uz_dual_load belongs to one thread. The members of both
 * are there to be read: only the functions of this folder write them. */
#ifndef UZ_DUAL_H
#define UZ_DUAL_H

#include "amg/amg.h"
#include "core/hooks.h"
#include "dual/choice.h"
#include "factor/factor.h"
#include "uzawa.h"

/* A row whose compliance D_ii falls to this part of itself when others are held depends on them: what is left is the
 * rounding of D. */
#define UZ_DEPENDENT_ROW 1e-13

/* Rows smaller than this part of the largest have weights that their squares can hold. */
#define UZ_LEAST_WEIGHT 0x1p-500

typedef struct {
    const uz_dual_form *form;
    const uz_dual_abilities *can; /* the form's */
    int64_t d, m;
    size_t bytes;          /* beside K, N and the factor, with what is made on demand */
    bool rows_may_depend;  /* solve_active may fail because rows depend on each other; false where it can't, or where
                            * rows that join one by one would cost an inexact solve each */
    uz_csc N, Nt;          /* m x d, its rows scaled, and d x m */
    bool shares_pattern;   /* ptr and idx of N are the caller's */
    const uz_csc *touched; /* N, or N without columns of zeros, its columns in another order: for ||N'x|| */
    double *row_scale;     /* m: the powers of two by which rows of N and h were multiplied: a gap here is scale x the
                            * caller's, a caller's reaction is scale x the one here */
    double row_unit;       /* the least of them: that of the caller's largest row */
    double *row_weight;    /* m: row_unit / row_scale, at least UZ_LEAST_WEIGHT: (W D W) row_unit^-2 is the operator of
                            * the caller's rows. NULL: all 1, as the rows are scaled alike */
    const uz_factor *factor; /* the caller's, or NULL */
    const uz_amg *amg;       /* the caller's, or NULL */
    struct uz_dual_lazy *lazy;
} uz_dual;

/* One load p (d), h (m) on the body. */
typedef struct {
    const uz_dual *dual;
    const uz_csc *K; /* d x d lower triangle: the caller's */
    double *h, *g0;  /* m: right-hand sides of the rows, scaled; gaps of the body without reactions */
    double psi0;
    int64_t applications; /* of D by uz_dual_load_apply, those for lambda_max included */
    double left;  /* the last apply's error of K^-1 N'r, a bound in the energy norm: (s'(Dr - D r))^2 <= left^2 s'D s */
    size_t bytes; /* what it holds, */
    size_t most;  /* and the most that solves with given rows as equations have taken beside it */
    uz_stop stop; /* of uz_dual_load_aim */
    double *inside; /* m: reactions of uz_dual_load_interior, NULL: not asked. Rows that depend on each other share
                     * theirs near these, which all press */
    double *correction, *kept; /* feasible corrections, as the form writes them: the last, and the kept one */
    bool has_kept;
    bool begins;    /* the caller's: of D r at r = 0 no answer is made, as guesses of the active rows follow */
    bool carried;   /* the caller's: what an application leaves goes on with its answer, and should be less */
    bool equations; /* the caller's: rows of solve_active are to hold whatever they bear, and are no guess that may be
                     * seen to be wrong on the way */
    bool asked_lambda_max;         /* by uz_dual_load_lambda_max: others on the same body may have, too */
    const double *near_u, *near_r; /* of uz_dual_load_near, while it is made; NULL: nothing is known */
} uz_dual_load;

/* What an operator is made from. */
typedef struct {
    uz_operator op;  /* not AUTO */
    const uz_csc *N; /* m x d; copied, but for its pattern where it outlives the operator: */
    bool lasts;
    const uz_factor *factor; /* of K, where the form needs one: must outlive the operator. Where `can.contact_last`,
                              * any: best with the dofs of uz_dual_contact_dofs last */
    const uz_amg *amg;       /* of K, for the other forms; likewise */
} uz_dual_source;

uz_status uz_dual_create(uz_dual **out, const uz_dual_source *source, const uz_hooks *hooks, uz_error *err);
void uz_dual_free(uz_dual *dual);
/* What uz_dual_load_lambda_max found, for the caller's rows; NaN where nobody asked for it, or where it is out of
 * range. */
double uz_dual_lambda_max_as_given(const uz_dual *dual);

/* K (lower triangle) is borrowed for the life of the load, p and h are only read. p NULL: all but what follows from
 * it. */
uz_status uz_dual_load_create(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p,
                              const double *h, uz_error *err);
/* The same where its answer is expected near u (d), with reactions r (m, scaled rows); both are only read. Where the
 * form can.begin_near, the first guess of the active rows and its displacement are these. */
uz_status uz_dual_load_near(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p, const double *h,
                            const double *u, const double *r, uz_error *err);
void uz_dual_load_free(uz_dual_load *load);

/* What the answers will be needed for, and how long that may take. Called before the methods run, and again when the
 * aim gets smaller.
 *   relative_error  in the energy norm: forms that are not exact solve no better than that (before the first call psi0
 *                   and g0 are rough, and D r is solved as for 1e-10). 0: no worse than rounding, so that
 *                   iterations are those of the exact D. NaN: as before
 *   stop            asked inside long work; NULL or no call: never. Where it came, solve_active comes back unsolved,
 *                   uz_dual_load_prepare leaves D to be applied by its factors, and lambda_max is 0: nothing is wrong,
 *                   and whoever asks next finds that it came */
uz_status uz_dual_load_aim(uz_dual_load *load, double relative_error, const uz_stop *stop, uz_error *err);

/* Makes what only many applications of D pay for, once per body: a dense D. */
uz_status uz_dual_load_prepare(uz_dual_load *load, uz_error *err);
/* The largest eigenvalue of D, or, weighted, of W D W with the row_weight: Lanczos value plus its residual bound,
 * within 1e-4; 0 when m = 0 or D = 0. Found once per body. Overwrites what the last apply left. */
uz_status uz_dual_load_lambda_max(uz_dual_load *load, double *lambda_max, bool weighted, uz_error *err);

/* Dr = D r (m). */
uz_status uz_dual_load_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
/* Column i of D (m): row i's own reaction as every row feels it. Overwrites what the last apply left. */
uz_status uz_dual_load_column(uz_dual_load *load, double *column, int64_t i, uz_error *err);
/* Column i of D^-1 (m): the reactions that move the body by 1 at row i, along its normal, and not at the others. *can
 * false, nothing written: the rows may depend on each other, the form has none, or it had to stop. Overwrites what the
 * last apply left. */
uz_status uz_dual_load_inverse_column(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err);
/* About how many entries of matrices are passed for a column of either, or an application. */
double uz_dual_load_column_work(const uz_dual_load *load);
/* psi(r) and ||u(r)||_K^2 from r and D r. */
void uz_dual_load_energies(const uz_dual_load *load, double *psi, double *norm2, const double *r, const double *Dr);

/* A feasible displacement near u(r), and what it proves: builds a displacement correction c that closes the gap of the
 * rows that `close` names and lifts every penetrating row.
 *   bound  ||u(r) - u*||_K and ||v - u*||_K are both at most this, v = u(r) + c: sqrt(||c||_K^2 - 2 r'g(v)) (design:
 *          the gap formula); INFINITY when no feasible v was found
 *   best   the bound of the correction that is kept, INFINITY for none: one with *bound < best takes its place
 *   r      <= 0: that of the last apply;  g = g0 - D r */
uz_status uz_dual_load_correct(uz_dual_load *load, double *bound, double best, const double *r, const double *g,
                               const bool *close, uz_error *err);
/* u (d) = u(r), and where `corrected` the kept correction, if there is one, added. */
uz_status uz_dual_load_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);

typedef enum {
    UZ_ACTIVE_UNSOLVED, /* the form can't, the rows depend on each other to working precision, or it had to stop */
    UZ_ACTIVE_SOLVED,
    UZ_ACTIVE_RAY /* two bounds on one dof cross: r is a ray with N'r = 0, h'r > 0 */
} uz_active_end;

/* r (m) with D_AA r_A = g0_A on the active rows and 0 elsewhere: the contact problem with these rows as equations; g
 * (m) its gaps, 0 on the active rows. A reaction above 0 or a gap below 0 is a row guessed wrong: signs that rounding
 * alone could have made come back as 0. Rows that others make redundant are taken out of `active` (two bounds on one
 * dof). */
uz_status uz_dual_load_solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active,
                                    uz_error *err);
/* A guess of the active rows (m) that is better than the signs of the last solve_active (of g0 before the first), for
 * much less than its cost. Successive guesses converge by themselves. false, `active` untouched: there is none. */
bool uz_dual_load_guess_active(uz_dual_load *load, bool *active);

#endif
