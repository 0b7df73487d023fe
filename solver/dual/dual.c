/* dual.c: what all forms of the dual operator share. An operation of dual.h that is not here to the end is the form's.
 */
#include "dual/form.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A row of denormal entries would be scaled by more than doubles hold; so it is scaled by less. */
enum { MOST_SCALE = 1020 };

/* By 2^-k with 2^k nearest to the norm of the row (in the ratio's sense), 1 for a row of zeros, which weighs nothing.
 */
static uz_status scale_rows(uz_dual *dual, uz_error *err)
{
    uz_csc *N = &dual->N;
    double least = INFINITY, most = 0.0;
    dual->row_scale = uz_alloc_zero(N->rows, sizeof(double));
    dual->row_weight = uz_alloc_zero(N->rows, sizeof(double));
    if (!dual->row_scale || !dual->row_weight)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)N->rows);
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        dual->row_scale[N->idx[k]] = hypot(dual->row_scale[N->idx[k]], N->val[k]);
    for (int64_t i = 0; i < N->rows; i++) {
        int exponent;
        double share = frexp(dual->row_scale[i], &exponent);
        exponent = share < M_SQRT1_2 ? exponent - 1 : exponent;
        double scale = share > 0.0 ? ldexp(1.0, exponent < -MOST_SCALE ? MOST_SCALE : -exponent) : 1.0;
        dual->row_scale[i] = scale;
        least = share > 0.0 ? fmin(least, scale) : least;
        most = share > 0.0 ? fmax(most, scale) : most;
    }
    dual->row_unit = isinf(least) ? 1.0 : least;
    for (int64_t i = 0; i < N->rows; i++)
        dual->row_weight[i] = fmin(1.0, fmax(UZ_LEAST_WEIGHT, dual->row_unit / dual->row_scale[i]));
    if (!(least < most)) {
        free(dual->row_weight);
        dual->row_weight = NULL;
    }
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        N->val[k] *= dual->row_scale[N->idx[k]];
    return UZ_OK;
}

/* Of a large body with few rows the pattern is all that N takes: a number for each dof. */
static uz_status take_rows(uz_dual *dual, const uz_dual_source *source, uz_error *err)
{
    const uz_csc *N = source->N;
    if (!source->lasts || !N->ptr)
        return uz_csc_copy(&dual->N, N, err);
    const int64_t entries = N->ptr[N->cols];
    double *val = uz_alloc(entries, sizeof *val);
    if (!val)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)N->rows);
    if (entries > 0)
        memcpy(val, N->val, (size_t)entries * sizeof *val);
    dual->shares_pattern = true;
    dual->N = (uz_csc){.rows = N->rows, .cols = N->cols, .ptr = N->ptr, .idx = N->idx, .val = val};
    return UZ_OK;
}

uz_status uz_dual_create(uz_dual **out, const uz_dual_source *source, const uz_hooks *hooks, uz_error *err)
{
    const uz_dual_form *form = uz_dual_form_of(source->op);
    const uz_csc *N = source->N;
    const uz_stop stop = {hooks, INFINITY};
    *out = NULL;
    uz_dual *dual = uz_alloc_zero(1, form->dual_size);
    if (!dual)
        return uz_no_memory(err, "the dual operator");
    dual->form = form;
    dual->can = &form->can;
    dual->d = N->cols;
    dual->m = N->rows;
    dual->bytes = 48 * (size_t)N->ptr[N->cols];
    dual->touched = &dual->N;
    dual->factor = source->factor;
    dual->amg = source->amg;
    dual->lazy = uz_alloc_zero(1, sizeof *dual->lazy);
    uz_status status = UZ_OK;
    if (dual->lazy) {
        pthread_mutex_init(&dual->lazy->making, NULL);
        pthread_mutex_init(&dual->lazy->known, NULL);
        dual->lazy->lambda_max[0] = dual->lazy->lambda_max[1] = NAN;
    } else {
        status = uz_no_memory(err, "the dual operator");
    }
    if (status == UZ_OK)
        status = take_rows(dual, source, err);
    if (status == UZ_OK)
        status = scale_rows(dual, err);
    if (status == UZ_OK)
        status = uz_csc_transpose(&dual->Nt, &dual->N, err);
    if (status == UZ_OK)
        status = form->create(dual, &stop, err);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    if (status == UZ_OK)
        *out = dual;
    else
        uz_dual_free(dual);
    return status;
}

void uz_dual_free(uz_dual *dual)
{
    if (!dual)
        return;
    dual->form->clear(dual);
    if (dual->shares_pattern)
        free(dual->N.val);
    else
        uz_csc_clear(&dual->N);
    uz_csc_clear(&dual->Nt);
    uz_free_all(dual->row_scale, dual->row_weight);
    if (dual->lazy) {
        pthread_mutex_destroy(&dual->lazy->making);
        pthread_mutex_destroy(&dual->lazy->known);
    }
    uz_free_all(dual->lazy, dual);
}

double uz_dual_lambda_max_as_given(const uz_dual *dual)
{
    pthread_mutex_lock(&dual->lazy->known);
    const double known = dual->lazy->lambda_max[dual->row_weight != NULL];
    pthread_mutex_unlock(&dual->lazy->known);
    const double value = known / dual->row_unit / dual->row_unit;
    return value >= DBL_MIN && value <= DBL_MAX ? value : NAN;
}

uz_status uz_dual_load_create(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p,
                              const double *h, uz_error *err)
{
    return uz_dual_load_near(out, dual, K, p, h, NULL, NULL, err);
}

uz_status uz_dual_load_near(uz_dual_load **out, const uz_dual *dual, const uz_csc *K, const double *p, const double *h,
                            const double *u, const double *r, uz_error *err)
{
    *out = NULL;
    uz_status status = UZ_OK;
    uz_dual_load *load = uz_alloc_zero(1, dual->form->load_size);
    if (!load)
        return uz_no_memory(err, "a load");
    load->dual = dual;
    load->K = K;
    load->stop.deadline = INFINITY;
    load->near_u = u;
    load->near_r = r;
    load->h = uz_alloc_zero(dual->m, sizeof(double));
    load->g0 = uz_alloc_zero(dual->m, sizeof(double));
    if (!load->h || !load->g0)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)dual->d);
    for (int64_t i = 0; status == UZ_OK && i < dual->m; i++)
        load->h[i] = dual->row_scale[i] * h[i];
    if (status == UZ_OK && p)
        status = dual->form->load(load, p, err);
    load->near_u = load->near_r = NULL;
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
    load->dual->form->unload(load);
    uz_free_all(load->h, load->g0, load->inside, load->correction, load->kept, load);
}

uz_status uz_dual_load_aim(uz_dual_load *load, double relative_error, const uz_stop *stop, uz_error *err)
{
    load->stop = stop ? *stop : (uz_stop){NULL, INFINITY};
    const uz_dual_form *form = load->dual->form;
    return form->aim && !isnan(relative_error) ? form->aim(load, relative_error, err) : UZ_OK;
}

uz_status uz_dual_load_prepare(uz_dual_load *load, uz_error *err)
{
    const uz_dual_form *form = load->dual->form;
    return form->prepare ? form->prepare(load, err) : UZ_OK;
}

/* psi(r) = psi0 + r'g0 - 1/2 r'Dr, and psi(r) = -1/2 ||u(r)||_K^2 + r'h. */
void uz_dual_load_energies(const uz_dual_load *load, double *psi, double *norm2, const double *r, const double *Dr)
{
    double linear = 0.0, quadratic = 0.0, work = 0.0;
    for (int64_t i = 0; i < load->dual->m; i++) {
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
    return load->dual->form->apply(load, Dr, r, err);
}

uz_status uz_dual_load_column(uz_dual_load *load, double *column, int64_t i, uz_error *err)
{
    const uz_dual *dual = load->dual;
    if (dual->form->column && dual->form->column(load, column, i))
        return UZ_OK;
    double *unit = uz_alloc_zero(dual->m, sizeof *unit);
    if (!unit)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a column of %lld contacts", (long long)dual->m);
    unit[i] = 1.0;
    if (dual->form->probe) /* a unit is of another size than the load, which must not matter to the column */
        dual->form->probe(load, true, 0.0);
    load->applications++;
    uz_status status = dual->form->apply(load, column, unit, err);
    if (dual->form->probe)
        dual->form->probe(load, false, 0.0);
    free(unit);
    return status;
}

uz_status uz_dual_load_inverse_column(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err)
{
    const uz_dual_form *form = load->dual->form;
    *can = form->inverse_column != NULL;
    return *can ? form->inverse_column(load, can, column, i, err) : UZ_OK;
}

double uz_dual_load_column_work(const uz_dual_load *load)
{
    const uz_dual *dual = load->dual;
    const double m = (double)dual->m;
    if (dual->can->cheap_steps || !dual->factor)
        return m * m;
    return 4.0 * (double)uz_factor_describe(dual->factor).nnz + 2.0 * (double)dual->N.ptr[dual->d];
}

uz_status uz_dual_load_correct(uz_dual_load *load, double *bound, double best, const double *r, const double *g,
                               const bool *close, uz_error *err)
{
    (void)err;
    double bound2 = INFINITY;
    uz_status status = load->dual->form->correct(load, &bound2, r, g, close);
    *bound = sqrt(bound2);
    if (status != UZ_OK || !(*bound < best))
        return status;
    double *swap = load->kept;
    load->kept = load->correction;
    load->correction = swap;
    load->has_kept = true;
    return UZ_OK;
}

uz_status uz_dual_load_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    return load->dual->form->recover(load, u, r, corrected && load->has_kept, err);
}

uz_status uz_dual_load_solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active,
                                    uz_error *err)
{
    *end = UZ_ACTIVE_UNSOLVED;
    return load->dual->form->solve_active(load, end, r, g, active, err);
}

bool uz_dual_load_guess_active(uz_dual_load *load, bool *active)
{
    return load->dual->form->guess_active && load->dual->form->guess_active(load, active);
}
