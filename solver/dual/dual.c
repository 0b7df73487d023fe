/* dual.c: the one door to all forms of the operator. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/lock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_dual_contact_dofs(int64_t **dofs, int64_t *count, const uz_csc *N, uz_error *err)
{
    *dofs = uz_alloc(N->cols, sizeof **dofs);
    *count = 0;
    if (!*dofs)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld dofs", (long long)N->cols);
    for (int64_t j = 0; j < N->cols; j++)
        if (N->ptr[j + 1] > N->ptr[j])
            (*dofs)[(*count)++] = j;
    return UZ_OK;
}

bool uz_dual_bounds_dofs(const uz_csc *N)
{
    int64_t nnz = N->ptr[N->cols];
    bool *seen = nnz == N->rows ? uz_alloc_zero(N->rows, sizeof *seen) : NULL, single = seen != NULL;
    for (int64_t k = 0; single && k < nnz; k++) {
        single = !seen[N->idx[k]];
        seen[N->idx[k]] = true;
    }
    free(seen);
    return single;
}

enum { SMALL = 1024, SMALL_BOUNDS = 128 };

/* Dense work of the condensed form is about 2 n^3 flops once, at a rate some 30 times that of sparse substitutions;
 * the factored form pays a sparse solve of about 60 d flops for each of some 300 iterations. In between the choice
 * matters little. Where rows bound single dofs, a few sparse factorizations take the place of the iterations, at about
 * the same price; they get cheaper the more dofs are held. Measured, bounds on both sides of all of 900 dofs: 1.5 ms
 * and 320 ms; on one side of 450 of them: 11 and 12 ms. */
uz_operator uz_dual_choose(const uz_csc *N, int64_t n_b, uz_operator asked)
{
    int64_t rows = N->rows;
    double n = (double)rows, d = (double)N->cols;
    if (asked != UZ_OPERATOR_AUTO)
        return asked;
    bool bounds = rows > SMALL_BOUNDS && uz_dual_bounds_dofs(N), dense = 2.0 * n * n * n / 30.0 <= 300.0 * 60.0 * d;
    if (bounds)
        return dense && 2 * n_b <= N->cols ? UZ_OPERATOR_CONDENSED : UZ_OPERATOR_FACTORED;
    return rows <= SMALL || dense ? UZ_OPERATOR_CONDENSED : UZ_OPERATOR_FACTORED;
}

static uz_dual_lazy *lazy_new(void)
{
    uz_dual_lazy *lazy = uz_alloc_zero(1, sizeof *lazy);
    if (lazy) {
        pthread_mutex_init(&lazy->making, NULL);
        pthread_mutex_init(&lazy->known, NULL);
        lazy->lambda_max = NAN;
    }
    return lazy;
}

static void lazy_free(uz_dual_lazy *lazy)
{
    if (!lazy)
        return;
    pthread_mutex_destroy(&lazy->making);
    pthread_mutex_destroy(&lazy->known);
    free(lazy->D);
    free(lazy->D_inverse);
    free(lazy);
}

/* 2^-k with 2^k nearest to the norm of the row (in the ratio's sense); 1 for a row of zeros. */
static double nearest_scale(double norm)
{
    int exponent;
    if (!(norm > 0.0))
        return 1.0;
    if (frexp(norm, &exponent) < M_SQRT1_2)
        exponent--;
    return ldexp(1.0, -exponent);
}

static uz_status scale_rows(uz_dual *dual, uz_error *err)
{
    uz_csc *N = &dual->N;
    dual->row_scale = uz_alloc_zero(N->rows, sizeof(double));
    if (!dual->row_scale)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)N->rows);
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        dual->row_scale[N->idx[k]] = hypot(dual->row_scale[N->idx[k]], N->val[k]);
    for (int64_t i = 0; i < N->rows; i++)
        dual->row_scale[i] = nearest_scale(dual->row_scale[i]);
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        N->val[k] *= dual->row_scale[N->idx[k]];
    return UZ_OK;
}

static uz_status create(uz_dual **out, const uz_csc *N, const uz_factor *factor, const uz_krylov *krylov,
                        uz_operator op, const uz_hooks *hooks, uz_error *err)
{
    *out = NULL;
    uz_dual *dual = uz_alloc_zero(1, sizeof *dual);
    if (!dual)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the dual operator");
    uz_stop stop = {hooks, INFINITY};
    dual->info.op = op;
    dual->info.d = N->cols;
    dual->info.m = N->rows;
    dual->factor = factor;
    dual->krylov = krylov;
    dual->lazy = lazy_new();
    uz_status status = UZ_OK;
    if (!dual->lazy)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the dual operator");
    if (status == UZ_OK)
        status = uz_csc_copy(&dual->N, N, err);
    if (status == UZ_OK)
        status = scale_rows(dual, err);
    if (status == UZ_OK)
        status = uz_csc_transpose(&dual->Nt, &dual->N, err);
    dual->info.bytes = 48 * (size_t)N->ptr[N->cols];
    if (status == UZ_OK && op == UZ_OPERATOR_CONDENSED)
        status = uz_condensed_create(dual, &stop, err);
    if (status == UZ_OK && op != UZ_OPERATOR_CONDENSED)
        status = uz_bounds_create(dual, err);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    if (status == UZ_OK)
        *out = dual;
    else
        uz_dual_free(dual);
    return status;
}

uz_status uz_dual_create(uz_dual **out, const uz_csc *N, const uz_factor *factor, uz_operator op, const uz_hooks *hooks,
                         uz_error *err)
{
    return create(out, N, factor, NULL, op, hooks, err);
}

uz_status uz_dual_create_free(uz_dual **out, const uz_csc *N, const uz_krylov *krylov, const uz_hooks *hooks,
                              uz_error *err)
{
    return create(out, N, NULL, krylov, UZ_OPERATOR_MATRIX_FREE, hooks, err);
}

void uz_dual_free(uz_dual *dual)
{
    if (!dual)
        return;
    uz_csc_clear(&dual->N);
    free(dual->row_scale);
    uz_csc_clear(&dual->Nt);
    uz_condensed_clear(&dual->dense);
    uz_bounds_clear(&dual->bounds);
    lazy_free(dual->lazy);
    free(dual);
}

uz_dual_info uz_dual_describe(const uz_dual *dual)
{
    return dual->info;
}

/* The other forms begin iterations there. */
static double *vector_of(int64_t n, bool condensed)
{
    return condensed ? uz_alloc(n, sizeof(double)) : uz_alloc_zero(n, sizeof(double));
}

/* What a load in a block does without, it takes from the block. */
static bool allocate_vectors(uz_dual_load *load, bool whole)
{
    bool condensed = load->dual->info.op == UZ_OPERATOR_CONDENSED;
    int64_t d = load->dual->info.d, m = load->dual->info.m, n_b = condensed ? load->dual->dense.n_b : 0;
    int64_t contact = m > n_b ? m : n_b, room = whole && d > contact ? d : contact;
    load->ws = uz_factor_workspace_new();
    load->base = whole ? vector_of(d, condensed) : NULL;
    load->h = uz_alloc_zero(m, sizeof(double));
    load->g0 = uz_alloc_zero(m, sizeof(double));
    load->response = uz_alloc_zero(condensed ? 0 : d, sizeof(double));
    load->apply_room = uz_alloc_zero(n_b, sizeof(double));
    load->work = vector_of(condensed ? contact : room, condensed);
    load->work2 = vector_of(room, condensed);
    load->correction = uz_alloc_zero(condensed ? contact : d, sizeof(double));
    load->kept = uz_alloc_zero(condensed ? contact : d, sizeof(double));
    return load->ws && load->apply_room && load->h && (load->base || !whole) && load->g0 && load->response &&
           load->work && load->work2 && load->correction && load->kept;
}

uz_status uz_dual_load_allocate(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *h, bool whole,
                                uz_error *err)
{
    *out = NULL;
    uz_dual_load *load = uz_alloc_zero(1, sizeof *load);
    if (!load)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load");
    load->dual = dual;
    load->K = K;
    load->stop.deadline = INFINITY;
    if (!allocate_vectors(load, whole)) {
        uz_dual_load_free(load);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)dual->info.d);
    }
    for (int64_t i = 0; i < dual->info.m; i++)
        load->h[i] = dual->row_scale[i] * h[i];
    *out = load;
    return UZ_OK;
}

uz_status uz_dual_load_create(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p,
                              const double *h, uz_error *err)
{
    *out = NULL;
    uz_dual_load *load = NULL;
    uz_status status = uz_dual_load_allocate(&load, dual, K, h, true, err);
    if (status == UZ_OK)
        status =
            dual->info.op == UZ_OPERATOR_CONDENSED ? uz_condensed_load(load, p, err) : uz_factored_load(load, p, err);
    if (status == UZ_OK)
        *out = load;
    else
        uz_dual_load_free(load);
    return status;
}

void uz_dual_load_free(uz_dual_load *load)
{
    if (!load)
        return;
    uz_factor_workspace_free(load->ws);
    free(load->base);
    free(load->h);
    free(load->g0);
    free(load->response);
    free(load->apply_room);
    free(load->work);
    free(load->work2);
    free(load->correction_weight);
    uz_bounded_free(load->box);
    uz_inexact_free(load->inexact);
    free(load->correction);
    free(load->kept);
    free(load);
}

void uz_dual_load_set_stop(uz_dual_load *load, const uz_stop *stop)
{
    load->stop = *stop;
}

size_t uz_dual_load_bytes(const uz_dual_load *load)
{
    const uz_dual_info *info = &load->dual->info;
    size_t d = (size_t)info->d, m = (size_t)info->m, vectors = info->op == UZ_OPERATOR_CONDENSED ? 5 : 7;
    size_t bytes = 8 * (vectors * d + 2 * m);
    if (load->box)
        bytes += 8 * (10 * d + m);
    return bytes + (load->inexact ? 8 * 8 * d : 0);
}

const double *uz_dual_load_g0(const uz_dual_load *load)
{
    return load->g0;
}

const double *uz_dual_load_row_scale(const uz_dual_load *load)
{
    return load->dual->row_scale;
}

const double *uz_dual_load_h(const uz_dual_load *load)
{
    return load->h;
}

const uz_csc *uz_dual_load_N(const uz_dual_load *load)
{
    return &load->dual->N;
}

bool uz_dual_load_steps_are_small(const uz_dual_load *load)
{
    return load->dual->info.op == UZ_OPERATOR_CONDENSED;
}

bool uz_dual_load_is_inexact(const uz_dual_load *load)
{
    return load->inexact != NULL;
}

bool uz_dual_load_rows_may_depend(const uz_dual_load *load)
{
    if (load->dual->info.op == UZ_OPERATOR_CONDENSED)
        return !load->dual->dense.scaled;
    return !load->box && !load->inexact; /* each row that joins would cost an inexact solve */
}

bool uz_dual_load_guess_active(uz_dual_load *load, bool *active)
{
    return load->box && uz_bounded_guess(load, active);
}

bool uz_dual_load_crossed_bounds(const uz_dual_load *load, double *y)
{
    return load->box && uz_bounded_crossed(load, y);
}

double uz_dual_known_lambda_max(const uz_dual *dual)
{
    pthread_mutex_lock(&dual->lazy->known);
    double value = dual->lazy->lambda_max;
    pthread_mutex_unlock(&dual->lazy->known);
    return value;
}

static uz_status apply_for_lanczos(void *ctx, double *y, const double *x, uz_error *err)
{
    const uz_dual_load *load = ctx;
    if (uz_stop_is_due(&load->stop))
        return UZ_ERR_CANCELLED;
    return uz_dual_load_apply(ctx, y, x, err);
}

/* alpha = 1 / lambda_max must not be too long a step; 1e-4 too short costs nothing. */
#define LAMBDA_TOLERANCE 1e-4

/* Kept for the body's other runs, unless applications may have been cut short: then 0. Under `making`. */
static uz_status find_lambda_max(uz_dual_load *load, double *lambda_max, uz_error *err)
{
    uz_dual_lazy *lazy = load->dual->lazy;
    uz_inexact_probe(load, true, 0.1 * LAMBDA_TOLERANCE);
    uz_status status = uz_lanczos_max(lambda_max, load->dual->info.m, apply_for_lanczos, load, LAMBDA_TOLERANCE, err);
    uz_inexact_probe(load, false, 0.0);
    if (status != UZ_OK || uz_stop_is_due(&load->stop)) {
        *lambda_max = 0.0;
        return status;
    }
    pthread_mutex_lock(&lazy->known);
    lazy->lambda_max = *lambda_max;
    pthread_mutex_unlock(&lazy->known);
    return UZ_OK;
}

uz_status uz_dual_load_prepare_iterations(uz_dual_load *load, double *lambda_max, uz_error *err)
{
    uz_dual_lazy *lazy = load->dual->lazy;
    uz_status status = UZ_OK;
    if (lambda_max)
        *lambda_max = 0.0;
    if (load->dual->info.op == UZ_OPERATOR_CONDENSED)
        status = uz_condensed_need_operator(load, err);
    if (status != UZ_OK || !lambda_max)
        return status;
    if (!uz_lock_while(&lazy->making, &load->stop))
        return UZ_OK;
    if (isnan(lazy->lambda_max))
        status = find_lambda_max(load, lambda_max, err);
    else
        *lambda_max = lazy->lambda_max;
    pthread_mutex_unlock(&lazy->making);
    return status == UZ_ERR_CANCELLED ? UZ_OK : status;
}

double uz_dual_load_force_norm(uz_dual_load *load, const double *x)
{
    bool condensed = load->dual->info.op == UZ_OPERATOR_CONDENSED;
    const uz_csc *N = condensed ? &load->dual->dense.N_b : &load->dual->N;
    double sum = 0.0;
    for (int64_t j = 0; j < N->cols; j++) {
        double force = 0.0;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            force += N->val[k] * x[N->idx[k]];
        sum += force * force;
    }
    return sqrt(sum);
}

/* psi(r) = psi0 + r'g0 - 1/2 r'Dr, and psi(r) = -1/2 ||u(r)||_K^2 + r'h. */
void uz_dual_load_energies(const uz_dual_load *load, double *psi, double *norm2, const double *r, const double *Dr)
{
    double linear = 0.0, quadratic = 0.0, work = 0.0;
    for (int64_t i = 0; i < load->dual->info.m; i++) {
        linear += r[i] * load->g0[i];
        quadratic += r[i] * Dr[i];
        work += r[i] * load->h[i];
    }
    *psi = load->psi0 + linear - 0.5 * quadratic;
    *norm2 = fmax(0.0, 2.0 * (work - *psi));
}

uz_status uz_dual_load_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    load->applications++;
    if (load->dual->info.op != UZ_OPERATOR_CONDENSED)
        return uz_factored_apply(load, Dr, r, err);
    uz_condensed_apply(load, Dr, r);
    return UZ_OK;
}

int64_t uz_dual_load_applications(const uz_dual_load *load)
{
    return load->applications;
}

uz_status uz_dual_load_column(uz_dual_load *load, double *column, int64_t i, uz_error *err)
{
    int64_t m = load->dual->info.m;
    if (!load->D) {
        double *unit = uz_alloc_zero(m, sizeof *unit);
        if (!unit)
            return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a column of %lld contacts", (long long)m);
        unit[i] = 1.0;
        uz_status status = uz_dual_load_apply(load, column, unit, err);
        free(unit);
        return status;
    }
    for (int64_t k = 0; k < i; k++)
        column[k] = load->D[i + k * m];
    memcpy(column + i, load->D + i + i * m, (size_t)(m - i) * sizeof *column);
    return UZ_OK;
}

uz_status uz_dual_load_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close,
                               uz_error *err)
{
    (void)err;
    *bound2 = INFINITY;
    return load->dual->info.op == UZ_OPERATOR_CONDENSED ? uz_condensed_correct(load, bound2, r, g, close)
                                                        : uz_factored_correct(load, bound2, r, g, close);
}

void uz_dual_load_keep_correction(uz_dual_load *load)
{
    double *swap = load->kept;
    load->kept = load->correction;
    load->correction = swap;
    load->has_kept = true;
}

uz_status uz_dual_load_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active, uz_error *err)
{
    *solved = false;
    if (load->dual->info.op == UZ_OPERATOR_CONDENSED)
        return uz_condensed_solve_active(load, r, g, solved, active, err);
    return load->box ? uz_bounded_solve_active(load, r, g, solved, active, err) : UZ_OK;
}

uz_status uz_dual_load_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    bool with = corrected && load->has_kept;
    return load->dual->info.op == UZ_OPERATOR_CONDENSED ? uz_condensed_recover(load, u, r, with, err)
                                                        : uz_factored_recover(load, u, r, with, err);
}
