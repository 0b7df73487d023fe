#include "dual/interior.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/springs.h"

#include <math.h>
#include <string.h>

enum { MOST_STEPS = 60, EXPECTED_STEPS = 20 };

/* Flops of a factorization in the time of an entry that a solve passes. */
#define FLOPS_PER_ENTRY 8.0

/* delta, in units of the row's compliance with diag(K)^-1 for K^-1. */
#define PROXIMAL 1e-10

/* Of the way to where the first product becomes zero. */
#define SHARE 0.995

/* Products and what is missing of gaps, relative to the energy and to the gaps without reactions: no row changes any
 * more whose force and gap are so far apart; and what rounding leaves of products. */
#define SOLVED   1e-8
#define CLEAR    1e3
#define ROUNDING 1e-16

/* Sums of gaps and forces are of the size of an answer down to this part of what they were: beyond, all rows touch, or
 * none. */
#define LEAST_SUM 1e-6

/* A shorter step gets nowhere. */
#define SHORT 1e-6

typedef struct {
    const uz_dual_load *load;
    const uz_dual *dual;
    int64_t m, d;
    uz_springs springs;
    uz_factor *factor; /* of S */
    uz_factor_workspace *ws;
    double *compliance, *unit; /* m, with diag(K)^-1 for K^-1, and its root, 1 for rows of zeros: the unit of gaps */
    double least_gaps, least_forces;
    double *sigma, *s, *z;         /* m */
    double *ds, *dz, *aim, *gap;   /* m: a step, the products that it aims at, and what is missing of the gaps */
    double *w, *dw, *force, *room; /* d; force: what is missing of equilibrium */
} interior;

static uz_status allocate(interior *x, uz_error *err)
{
    const uz_csc *Nt = &x->dual->Nt, *K = x->load->K;
    double **of_m[] = {&x->compliance, &x->unit, &x->sigma, &x->s, &x->z, &x->ds, &x->dz, &x->aim, &x->gap},
           **of_d[] = {&x->w, &x->dw, &x->force, &x->room};
    bool ok = true;
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        ok = (*of_m[k] = uz_alloc_zero(x->m, sizeof(double))) && ok;
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = (*of_d[k] = uz_alloc_zero(x->d, sizeof(double))) && ok;
    x->ws = uz_factor_workspace_new();
    if (!ok || !x->ws)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory to guess which of %lld rows touch", (long long)x->m);
    for (int64_t i = 0; i < x->m; i++)
        for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
            x->compliance[i] += Nt->val[k] * Nt->val[k] / K->val[K->ptr[Nt->idx[k]]];
    for (int64_t i = 0; i < x->m; i++)
        x->unit[i] = x->compliance[i] > 0.0 ? sqrt(x->compliance[i]) : 1.0;
    return UZ_OK;
}

/* In equilibrium: all rows pressed alike, in units of how stiff the body is at each alone, as hard as fits the gaps
 * best. Gaps are those that this leaves, widened alike until none is closed. */
static uz_status begin(interior *x, bool *can, uz_error *err)
{
    const double *g0 = x->load->g0;
    double along = 0.0, square = 0.0, alone = 0.0, least = 0.0, size = 0.0;
    for (int64_t i = 0; i < x->m; i++)
        x->z[i] = x->compliance[i] > 0.0 ? 1.0 / x->unit[i] : 0.0;
    uz_csc_gaxpy_t(x->dw, &x->dual->N, -1.0, x->z);
    uz_status status = uz_factor_solve(x->dual->factor, x->ws, x->dw, x->dw, x->room, err);
    uz_csc_gaxpy(x->ds, &x->dual->N, -1.0, x->dw); /* D z */
    for (int64_t i = 0; i < x->m; i++) {           /* in the metric of the compliances */
        along += x->z[i] * fabs(g0[i]) * x->z[i] * fabs(x->ds[i]);
        square += x->z[i] * x->ds[i] * x->z[i] * x->ds[i];
        alone += x->z[i] * fabs(g0[i]) / (double)x->m;
    }
    const double force = fmin(along / square, alone); /* together rows may move nothing at all: 0 / 0 */
    *can = status == UZ_OK && force > 0.0 && isfinite(force);
    for (int64_t j = 0; j < x->d; j++)
        x->w[j] = force * x->dw[j];
    for (int64_t i = 0; i < x->m; i++) {
        x->s[i] = x->z[i] * (g0[i] + force * x->ds[i]);
        least = fmin(least, x->s[i]);
        size = fmax(size, fabs(x->s[i]));
    }
    for (int64_t i = 0; i < x->m; i++) {
        x->s[i] = x->z[i] > 0.0 ? (x->s[i] - 1.5 * least + 1e-2 * size) / x->z[i] : fabs(g0[i]);
        x->z[i] *= force;
    }
    return status;
}

/* What is missing of equilibrium and gaps, the mean product, and which rows touch: where the force outweighs the gap,
 * each in units of its mean. true: of each row it is clear, or there is no more to come. */
static bool measure(interior *x, double *mu, bool *active)
{
    double products = 0.0, energy = 0.0, missing = 0.0, size = 0.0, gaps = 0.0, forces = 0.0;
    bool told = true;
    memset(x->force, 0, (size_t)x->d * sizeof *x->force);
    uz_csc_symv(x->force, x->load->K, -1.0, x->w);
    for (int64_t j = 0; j < x->d; j++)
        energy -= x->w[j] * x->force[j];
    uz_csc_gaxpy_t(x->force, &x->dual->N, -1.0, x->z);
    memcpy(x->gap, x->load->g0, (size_t)x->m * sizeof *x->gap);
    uz_csc_gaxpy(x->gap, &x->dual->N, -1.0, x->w);
    for (int64_t i = 0; i < x->m; i++) {
        x->gap[i] -= x->s[i];
        missing = fmax(missing, fabs(x->gap[i]));
        size = fmax(size, fabs(x->load->g0[i]));
        products += x->s[i] * x->z[i];
        gaps += x->s[i] / x->unit[i];
        forces += x->z[i] * x->unit[i];
    }
    x->least_gaps = fmax(x->least_gaps, LEAST_SUM * gaps);
    x->least_forces = fmax(x->least_forces, LEAST_SUM * forces);
    gaps = fmax(gaps, x->least_gaps);
    forces = fmax(forces, x->least_forces);
    for (int64_t i = 0; i < x->m; i++) {
        const double force = x->z[i] * x->unit[i] * gaps, gap = x->s[i] / x->unit[i] * forces;
        active[i] = force > gap;
        told = told && (force > CLEAR * gap || gap > CLEAR * force);
    }
    *mu = products / (double)x->m;
    return missing <= SOLVED * size && (products <= ROUNDING * energy || (told && products <= SOLVED * energy));
}

/* The Newton step to the products `aim`; *length: how far s and z allow it, at most 1. */
static uz_status step(interior *x, double *length, uz_error *err)
{
    for (int64_t i = 0; i < x->m; i++) {
        const double across = x->s[i] + PROXIMAL * x->compliance[i] * x->z[i];
        x->dz[i] = (x->aim[i] - x->z[i] * x->gap[i]) / across;
    }
    memcpy(x->dw, x->force, (size_t)x->d * sizeof *x->dw);
    uz_csc_gaxpy_t(x->dw, &x->dual->N, -1.0, x->dz);
    uz_status status = uz_factor_solve(x->factor, x->ws, x->dw, x->dw, x->room, err);
    memset(x->ds, 0, (size_t)x->m * sizeof *x->ds);
    uz_csc_gaxpy(x->ds, &x->dual->N, 1.0, x->dw);
    double most = 1.0 / SHARE;
    for (int64_t i = 0; i < x->m; i++) {
        x->dz[i] += x->sigma[i] * x->ds[i];
        x->ds[i] = x->gap[i] - x->ds[i] + PROXIMAL * x->compliance[i] * x->dz[i];
        if (x->ds[i] < 0.0)
            most = fmin(most, -x->s[i] / x->ds[i]);
        if (x->dz[i] < 0.0)
            most = fmin(most, -x->z[i] / x->dz[i]);
    }
    *length = SHARE * most;
    return status;
}

/* One step of predictor and corrector from mean products of mu. *on false: it leads nowhere. */
static uz_status advance(interior *x, bool *on, double mu, uz_error *err)
{
    double length, reached = 0.0;
    for (int64_t i = 0; i < x->m; i++) {
        x->sigma[i] = x->z[i] / (x->s[i] + PROXIMAL * x->compliance[i] * x->z[i]);
        x->aim[i] = -x->s[i] * x->z[i];
    }
    uz_springs_fill(&x->springs, x->sigma);
    uz_status status = x->factor ? UZ_OK : uz_factor_new(&x->factor, x->springs.analysis, err);
    if (status == UZ_OK)
        status = uz_factor_again(x->factor, &x->springs.S, err);
    *on = status == UZ_OK;
    if (status == UZ_ERR_NOT_SPD) { /* to working precision */
        uz_error_reset(err);
        return UZ_OK;
    }
    if (status == UZ_OK)
        status = step(x, &length, err);
    if (status != UZ_OK || !*on)
        return status;
    for (int64_t i = 0; i < x->m; i++)
        reached += (x->s[i] + length * x->ds[i]) * (x->z[i] + length * x->dz[i]);
    const double left = reached / (double)x->m / mu, centre = left * left * left * mu;
    for (int64_t i = 0; i < x->m; i++)
        x->aim[i] = centre - x->s[i] * x->z[i] - x->ds[i] * x->dz[i];
    status = step(x, &length, err);
    *on = length > SHORT; /* false for NaN */
    for (int64_t j = 0; *on && j < x->d; j++)
        x->w[j] += length * x->dw[j];
    for (int64_t i = 0; *on && i < x->m; i++) {
        x->s[i] += length * x->ds[i];
        x->z[i] += length * x->dz[i];
    }
    return status;
}

uz_status uz_dual_load_interior(uz_dual_load *load, bool *can, bool *active, double most_work, uz_error *err)
{
    const uz_dual *dual = load->dual;
    interior x = {.load = load, .dual = dual, .m = dual->m, .d = dual->d};
    *can = false;
    if (!dual->factor || dual->m == 0)
        return UZ_OK;
    uz_status status = uz_springs_create(&x.springs, load->K, dual, NULL, err);
    if (status == UZ_OK && x.springs.analysis) {
        const uz_factor_info info = uz_analysis_describe(x.springs.analysis);
        *can = EXPECTED_STEPS * (info.flops / FLOPS_PER_ENTRY + 8.0 * (double)info.nnz) <= most_work;
    }
    if (status == UZ_OK && *can)
        status = allocate(&x, err);
    if (status == UZ_OK && *can)
        status = begin(&x, can, err);
    double mu;
    bool on = status == UZ_OK && *can;
    for (int k = 0; on && !measure(&x, &mu, active) && k < MOST_STEPS && status == UZ_OK; k++) {
        if ((*can = !uz_stop_is_due(&load->stop)))
            status = advance(&x, &on, mu, err);
        on = on && *can;
    }
    if (status == UZ_OK && *can && !load->inside && !(load->inside = uz_alloc(x.m, sizeof *load->inside)))
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld reactions", (long long)x.m);
    for (int64_t i = 0; status == UZ_OK && *can && i < x.m; i++)
        load->inside[i] = active[i] ? -x.z[i] : 0.0;
    uz_free_all(x.compliance, x.unit, x.sigma, x.s, x.z, x.ds, x.dz, x.aim, x.gap, x.w, x.dw, x.force, x.room);
    uz_factor_free(x.factor);
    uz_factor_workspace_free(x.ws);
    uz_springs_clear(&x.springs);
    return status;
}
