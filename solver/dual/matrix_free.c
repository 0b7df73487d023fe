/* matrix_free.c: the dual operator by conjugate gradients: no factor of K.
 *
 * Every solve stops at a tolerance, and what it leaves is bounded: with the residual s of K u = p + N'r and lambda from
 * uz_krylov_describe, ||u - u(r)||_K^2 = s'K^-1 s <= s'M^-1 s / lambda. That slack is part of the bound on the answer,
 * so that a tolerance decides about time and never about what is certified.
 *
 * Rule for the tolerance of D r: an error in u(r) of delta in the energy norm changes the dual gradient by N delta, and
 * (N delta)'(r - r*) <= ||delta||_K ||u(r) - u*||_K, so the iteration comes as near as delta, and no step of it should
 * be falsified by more than a share of its own size (Schmidt, Le Roux, Bach, NIPS 2011, for proximal gradients with
 * decreasing errors). Each solve starts at the last response and reduces the residual, which is the size of the change,
 * by UZ_CHANGE_KEPT, unless a FLOOR of the aim is reached before. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FLOOR 1e-3
/* The base may be far larger than the answer: a body without its obstacle sags much further. */
#define BASE_FLOOR 1e-5
#define FIRST_AIM  1e-10
enum { STEPS_MOST = 5000 };

static uz_cg_stop stop_at(const uz_inexact *x, double relative, double absolute)
{
    uz_cg_stop stop = {.relative = relative,
                       .absolute = absolute,
                       .max_iterations = STEPS_MOST,
                       .hooks = x->hooks,
                       .deadline = x->deadline};
    return stop;
}

static double root_of_lambda(const uz_dual_load *load)
{
    return sqrt(uz_krylov_describe(load->dual->krylov).lambda);
}

/* base = K^-1 p to the aim, from where it stands; psi0 and g0 with it. */
static uz_status solve_base(uz_dual_load *load, double aim, uz_error *err)
{
    uz_inexact *x = load->inexact;
    int64_t d = load->dual->info.d;
    uz_cg_info info;
    double root = root_of_lambda(load), norm = uz_root(uz_dot(d, x->p, load->base));
    /* From 0 the first residual has the size of the solution. */
    uz_cg_stop stop = stop_at(x, norm > 0.0 ? 0.0 : aim * root, aim * norm * root);
    uz_status status = uz_cg_solve(&info, load->base, &x->cg, load->K, x->p, &stop, err);
    if (status != UZ_OK)
        return status;
    x->base_slack = info.last / root;
    x->slack = x->base_slack;
    load->psi0 = -0.5 * uz_dot(d, x->p, load->base);
    memcpy(load->g0, load->h, (size_t)load->dual->info.m * sizeof *load->g0);
    uz_csc_gaxpy(load->g0, &load->dual->N, -1.0, load->base);
    return UZ_OK;
}

uz_status uz_inexact_create(uz_dual_load *load, const double *p, uz_error *err)
{
    int64_t d = load->dual->info.d;
    uz_inexact *x = load->inexact = uz_alloc_zero(1, sizeof *x);
    if (!x)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load");
    x->aim = FIRST_AIM;
    x->deadline = INFINITY;
    x->tight = UZ_CHANGE_KEPT;
    x->p = uz_alloc(d, sizeof *x->p);
    x->right = uz_alloc(d, sizeof *x->right);
    uz_status status = x->p && x->right
                           ? uz_cg_init(&x->cg, uz_krylov_multigrid(load->dual->krylov), NULL, d, err)
                           : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)d);
    if (status != UZ_OK)
        return status;
    memcpy(x->p, p, (size_t)d * sizeof *p);
    return solve_base(load, BASE_FLOOR * x->aim, err);
}

void uz_inexact_free(uz_inexact *inexact)
{
    if (!inexact)
        return;
    uz_cg_clear(&inexact->cg);
    free(inexact->p);
    free(inexact->right);
    free(inexact);
}

uz_status uz_dual_load_aim(uz_dual_load *load, double relative_error, const uz_hooks *hooks, double deadline,
                           uz_error *err)
{
    uz_inexact *x = load->inexact;
    if (!x)
        return UZ_OK;
    bool finer = relative_error < x->aim;
    x->aim = relative_error;
    x->hooks = hooks;
    x->deadline = deadline;
    return finer ? solve_base(load, BASE_FLOOR * relative_error, err) : UZ_OK;
}

/* ||u(r)||_K about, with the response as it stands; Dr is room. */
static double expected_norm(const uz_dual_load *load, const double *r, double *Dr)
{
    double base = uz_root(-2.0 * load->psi0), psi, norm2;
    memset(Dr, 0, (size_t)load->dual->info.m * sizeof *Dr);
    uz_csc_gaxpy(Dr, &load->dual->N, 1.0, load->response);
    uz_dual_load_energies(load, &psi, &norm2, r, Dr);
    return fmax(1e-3 * base, fmin(base, sqrt(norm2)));
}

void uz_inexact_probe(uz_dual_load *load, bool begin, double accuracy)
{
    uz_inexact *x = load->inexact;
    if (!x)
        return;
    x->probing = begin;
    x->tight = begin ? accuracy : UZ_CHANGE_KEPT;
    /* Of another size than what comes: no start for it. */
    memset(load->response, 0, (size_t)load->dual->info.d * sizeof *load->response);
}

uz_status uz_inexact_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    const uz_dual *dual = load->dual;
    uz_inexact *x = load->inexact;
    double root = root_of_lambda(load), norm = expected_norm(load, r, Dr);
    uz_cg_stop stop = stop_at(x, x->tight, x->probing ? 0.0 : FLOOR * x->aim * norm * root);
    uz_cg_info info;
    memset(x->right, 0, (size_t)dual->info.d * sizeof *x->right);
    uz_csc_gaxpy_t(x->right, &dual->N, 1.0, r);
    uz_status status = uz_cg_solve(&info, load->response, &x->cg, load->K, x->right, &stop, err);
    memset(Dr, 0, (size_t)dual->info.m * sizeof *Dr);
    if (status != UZ_OK)
        return status;
    uz_csc_gaxpy(Dr, &dual->N, 1.0, load->response);
    x->slack = x->base_slack + info.last / root;
    return UZ_OK;
}

uz_status uz_dual_load_inverse_norm(uz_dual_load *load, double *value, double *e, uz_error *err)
{
    uz_inexact *x = load->inexact;
    return uz_krylov_inverse_norm(value, e, load->dual->krylov, &x->cg, load->K, x->hooks, x->deadline, err);
}
