/* factored.c: the dual operator by one sparse solve per application, the form of Kanno's algorithm. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

/* Lanczos makes loads without K: they are never corrected. */
static uz_status weigh(uz_dual_load *load, uz_error *err)
{
    int64_t d = load->dual->info.d;
    load->correction_weight = uz_alloc(d, sizeof(double));
    if (!load->correction_weight)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld dofs", (long long)d);
    for (int64_t j = 0; load->K && j < d; j++) /* sorted lower triangle: the diagonal comes first */
        load->correction_weight[j] = 1.0 / load->K->val[load->K->ptr[j]];
    return UZ_OK;
}

/* x = K^-1 x, through load->work2. MATRIX_FREE never comes here. */
static uz_status solve(uz_dual_load *load, double *x, uz_error *err)
{
    const uz_factor *factor = load->dual->factor;
    uz_factor_permute(factor, load->work2, x);
    uz_status status = uz_factor_forward(factor, load->ws, load->work2, 1, err);
    if (status == UZ_OK)
        status = uz_factor_backward(factor, load->ws, load->work2, 1, err);
    uz_factor_unpermute(factor, x, load->work2);
    return status;
}

uz_status uz_factored_load(uz_dual_load *load, const double *p, uz_error *err)
{
    int64_t d = load->dual->info.d, m = load->dual->info.m;
    uz_status status = weigh(load, err);
    if (status == UZ_OK && load->dual->krylov) {
        status = uz_inexact_create(load, p, err);
    } else if (status == UZ_OK) {
        memcpy(load->base, p, (size_t)d * sizeof *p);
        status = solve(load, load->base, err);
    }
    if (status != UZ_OK)
        return status;
    load->psi0 = 0.0;
    for (int64_t j = 0; j < d; j++)
        load->psi0 -= 0.5 * p[j] * load->base[j];
    memcpy(load->g0, load->h, (size_t)m * sizeof *load->g0);
    uz_csc_gaxpy(load->g0, &load->dual->N, -1.0, load->base);
    return load->dual->bounds.dof ? uz_bounded_create(load, p, err) : UZ_OK;
}

static bool all_zero(const double *x, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            return false;
    return true;
}

uz_status uz_factored_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    const uz_dual *dual = load->dual;
    if (load->inexact)
        return uz_inexact_apply(load, Dr, r, err);
    memset(load->response, 0, (size_t)dual->info.d * sizeof(double));
    memset(Dr, 0, (size_t)dual->info.m * sizeof *Dr);
    if (all_zero(r, dual->info.m))
        return UZ_OK;
    uz_csc_gaxpy_t(load->response, &dual->N, 1.0, r);
    uz_status status = solve(load, load->response, err);
    if (status == UZ_OK)
        uz_csc_gaxpy(Dr, &dual->N, 1.0, load->response);
    return status;
}

uz_status uz_factored_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close)
{
    const uz_dual *dual = load->dual;
    double *c = load->correction, *Nc = load->work, *Kc = load->work2, square = 0.0, complementarity = 0.0;
    if (!uz_correct_by_sweeps(c, Nc, &dual->Nt, load->correction_weight, g, close))
        return UZ_OK;
    for (int64_t i = 0; i < dual->info.m; i++)
        complementarity -= r[i] * fmax(0.0, g[i] - Nc[i]);
    memset(Kc, 0, (size_t)dual->info.d * sizeof *Kc);
    uz_csc_symv(Kc, load->K, 1.0, c);
    for (int64_t j = 0; j < dual->info.d; j++)
        square += c[j] * Kc[j];
    double distance = sqrt(fmax(0.0, square)) + (load->inexact ? load->inexact->slack : 0.0);
    *bound2 = distance * distance + 2.0 * complementarity;
    return UZ_OK;
}

uz_status uz_factored_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    int64_t d = load->dual->info.d;
    uz_status status = UZ_OK;
    if (!uz_bounded_recover(load, u, r)) {
        status = uz_factored_apply(load, load->work, r, err);
        for (int64_t j = 0; j < d; j++)
            u[j] = load->base[j] + load->response[j];
    }
    for (int64_t j = 0; corrected && j < d; j++)
        u[j] += load->kept[j];
    return status;
}
