/* dual.h: the dual operator D = N K^-1 N' of one body, and the dual problem of one load on it.
 *
 *     psi(r) = psi0 + r'g0 - 1/2 r'D r,   gap g(u(r)) = g0 - D r,   K u(r) = p + N'r
 *
 * The methods see only this interface: apply, correct, recover, and the numbers of uz_dual_load. Behind it stand three
 * forms: condensed  dense D on the contact, from the trailing block of a factor with the contact dofs last; factored
 * one sparse solve per application (Kanno's form); matrix_free  the same by conjugate gradients, without a factor:
 * every answer carries a bound on what is left. Rows of N are scaled to a norm of about 1 by powers of two, so that how
 * a caller wrote a condition changes nothing but exponents; unit normals stay as they are. All m-vectors of this
 * interface are those of the scaled rows.
 *
 * A uz_dual is immutable once created and shared by threads; a uz_dual_load belongs to one thread. */
#ifndef UZ_DUAL_H
#define UZ_DUAL_H

#include "core/hooks.h"
#include "factor/factor.h"
#include "amg/krylov.h"
#include "uzawa.h"

/* A row whose compliance D_ii falls to this part of itself when others are held depends on them: what is left is the
 * rounding of D. */
#define UZ_DEPENDENT_ROW 1e-13

typedef struct uz_dual uz_dual;

typedef struct {
    uz_operator op;
    int64_t d, m;
    size_t bytes; /* beside K, N and the factor, with what is made on demand */
} uz_dual_info;

/* The form that AUTO stands for, among those with a factor, from the sizes (n_b: dofs that N touches) and whether
 * each row bounds one dof. */
uz_operator uz_dual_choose(const uz_csc *N, int64_t n_b, uz_operator asked);

/* Whether each row has one entry: it bounds a dof. False also where there is no memory to tell. */
bool uz_dual_bounds_dofs(const uz_csc *N);

/* The factor stays the caller's and must outlive *out; N (m x d) is copied, and scaled. When op is CONDENSED the
 * factor's last dofs must be the ones that N touches: uz_dual_contact_dofs lists them, ascending; the caller frees
 * *dofs. */
uz_status uz_dual_create(uz_dual **out, const uz_csc *N, const uz_factor *factor, uz_operator op, const uz_hooks *hooks,
                         uz_error *err);
/* The matrix-free form: krylov takes the factor's place. */
uz_status uz_dual_create_free(uz_dual **out, const uz_csc *N, const uz_krylov *krylov, const uz_hooks *hooks,
                              uz_error *err);
void uz_dual_free(uz_dual *dual);
uz_dual_info uz_dual_describe(const uz_dual *dual);
uz_status uz_dual_contact_dofs(int64_t **dofs, int64_t *count, const uz_csc *N, uz_error *err);

/* One load p (d), h (m) on the body. K (lower triangle) and h are borrowed for the life of the uz_dual_load, p is only
 * read. */
typedef struct uz_dual_load uz_dual_load;
uz_status uz_dual_load_create(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p,
                              const double *h, uz_error *err);
void uz_dual_load_free(uz_dual_load *load);
/* How long dense work of n^3 on this load may go on; without: for ever. Where it is over solve_active comes back not
 * solved, and preparing leaves D to be applied by its factors and lambda_max 0: nothing is wrong, and whoever asks next
 * finds that it is over. */
void uz_dual_load_set_stop(uz_dual_load *load, const uz_stop *stop);
/* What it holds now, but for a factor of the free dofs, which comes and goes. */
size_t uz_dual_load_bytes(const uz_dual_load *load);
/* What the answers will be needed for: a relative error in the energy norm, and who may end inner iterations (hooks are
 * borrowed). Called before the methods run, and again when the aim gets smaller. MATRIX_FREE solves no better than
 * that: without a call to 1e-10. The other forms solve as well as they can. */
uz_status uz_dual_load_aim(uz_dual_load *load, double relative_error, const uz_hooks *hooks, double deadline,
                           uz_error *err);
/* MATRIX_FREE: *value >= e'K^-1 e, sharp where time allows; e (d) becomes K^-1 e, about. */
uz_status uz_dual_load_inverse_norm(uz_dual_load *load, double *value, double *e, uz_error *err);
const double *uz_dual_load_g0(const uz_dual_load *load); /* m: gap of the body without reactions */
/* ||N'x|| for x (m): a force of the rows as a force on the dofs. */
double uz_dual_load_force_norm(uz_dual_load *load, const double *x);
/* psi(r) and ||u(r)||_K^2 from r and D r. */
void uz_dual_load_energies(const uz_dual_load *load, double *psi, double *norm2, const double *r, const double *Dr);

/* CONDENSED only: up to blocks * UZ_LANES loads (lanes, see factor.h) with one pass over the factor. One thread. */
typedef struct uz_dual_block uz_dual_block;
uz_status uz_dual_block_create(uz_dual_block **out, const uz_dual *dual, int64_t blocks, uz_error *err);
void uz_dual_block_free(uz_dual_block *block);
/* blocks x d x UZ_LANES: p of load l of block b, entry j, at ((b * d) + j) * UZ_LANES + l. Filled by the caller, lanes
 * without a load with zeros, before uz_dual_block_load; kept. */
double *uz_dual_block_loads(uz_dual_block *block);
uz_status uz_dual_block_load(uz_dual_block *block, uz_error *err);
/* The load of lane 0 .. blocks * UZ_LANES - 1, until the next uz_dual_block_load. h (m) as in uz_dual_load_create. */
uz_status uz_dual_load_create_in_block(uz_dual_load **out, const uz_dual_block *block, int64_t lane, const uz_csc *K,
                                       const double *h, uz_error *err);
/* uz_dual_load_recover for the loads of lanes 0 .. count - 1, r[lane] (m): displacements laid out as the loads are. */
uz_status uz_dual_block_recover(uz_dual_block *block, uz_dual_load *const *loads, const double *const *r,
                                const bool *corrected, int64_t count, uz_error *err);
const double *uz_dual_block_displacements(const uz_dual_block *block);

/* Makes what only many applications of D pay for, once per body: the dense D. lambda_max (may be NULL: not wanted): of
 * D, Lanczos value plus its residual bound; 0 when m = 0 or D = 0. Overwrites what the last apply left. */
uz_status uz_dual_load_prepare_iterations(uz_dual_load *load, double *lambda_max, uz_error *err);
/* The value if somebody asked for it, else NaN. */
double uz_dual_known_lambda_max(const uz_dual *dual);

/* Dr = D r (m). */
uz_status uz_dual_load_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
int64_t uz_dual_load_applications(const uz_dual_load *load); /* how often that was done, lambda_max included */

/* Column i of D (m): row i's own reaction as every row feels it. CONDENSED reads D, FACTORED costs a sparse solve.
 * Overwrites what the last apply left. */
uz_status uz_dual_load_column(uz_dual_load *load, double *column, int64_t i, uz_error *err);

/* A feasible displacement near u(r), and what it proves.
 * Given r <= 0, the r of the last apply, and g = g0 - D r, builds a displacement correction that closes the gap of the
 * rows that `close` names and lifts every penetrating row, and keeps it. *bound2 = ||c||_K^2 - 2 r'g(v), so that
 * ||u(r) - u*||_K and ||v - u*||_K are both at most sqrt(*bound2) (design: the gap formula); INFINITY when no feasible
 * v was found. */
uz_status uz_dual_load_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close,
                               uz_error *err);

/* Keeps what the last uz_dual_load_correct found; uz_dual_load_recover adds the kept one when it is asked to:
 * u = u(r) + c (d). */
void uz_dual_load_keep_correction(uz_dual_load *load);
uz_status uz_dual_load_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);

/* r (m) with D_AA r_A = g0_A on the active rows and 0 elsewhere: the contact problem with these rows as equations; g
 * (m) its gaps, 0 on the active rows. A reaction above 0 or a gap below 0 is a row guessed wrong: signs that rounding
 * alone could have made come back as 0. Rows that others make redundant are taken out of `active` (two bounds on one
 * dof). *solved false: this form can't (FACTORED needs rows with one nonzero entry each), or the system is singular to
 * working precision, or the rows contradict. */
uz_status uz_dual_load_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active,
                                    uz_error *err);

/* A guess of the active rows (m) that is better than the signs of the last solve_active (of g0 before the first), for
 * much less than its cost: FACTORED with one nonzero entry in each row. Successive guesses converge by themselves.
 * false, `active` untouched: there is none. */
bool uz_dual_load_guess_active(uz_dual_load *load, bool *active);

/* y (m): in, a direction in which the reactions grow; out, scaled to max |y_i| about 1, its nearest vector with N'y = 0
 * on the rows that take part, cut at 0. A candidate for uz_ray_radius. */
uz_status uz_dual_load_project_ray(const uz_dual_load *load, double *y, uz_error *err);
/* y (m): the ray of two bounds on one dof that cross; false, y untouched: none do, or rows bound more than a dof each.
 */
bool uz_dual_load_crossed_bounds(const uz_dual_load *load, double *y);
const double *uz_dual_load_h(const uz_dual_load *load);
const uz_csc *uz_dual_load_N(const uz_dual_load *load);
/* m: the powers of two by which rows of N and h were multiplied: a gap here is scale x the caller's, a caller's
 * reaction is scale x the one here. */
const double *uz_dual_load_row_scale(const uz_dual_load *load);

/* Whether D is applied by inner iterations, which are the nearer the closer r is to that of the last apply. */
bool uz_dual_load_is_inexact(const uz_dual_load *load);

/* Whether solve_active works on the contact only, so that a step costs little beside a linear solve. */
bool uz_dual_load_steps_are_small(const uz_dual_load *load);

/* Whether solve_active may fail because rows depend on each other, or can't be had: false where each bounds a dof. */
bool uz_dual_load_rows_may_depend(const uz_dual_load *load);

/* Largest eigenvalue of a symmetric positive semidefinite operator of order m by Lanczos with full
 * reorthogonalisation: Ritz value plus residual bound, relative accuracy `tolerance`. */
typedef uz_status (*uz_apply)(void *ctx, double *y, const double *x, uz_error *err);
uz_status uz_lanczos_max(double *lambda, int64_t m, uz_apply apply, void *ctx, double tolerance, uz_error *err);

#endif
