#include "dual/multipliers.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/springs.h"
#include "linalg/linalg.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Sigma times the rows' own compliances with diag(K)^-1 for K^-1: first, and by what it grows. Beyond the last there is
 * nothing left of K in S. */
#define FIRST_SIGMA 1e8
#define MORE_SIGMA  1e3
#define LAST_SIGMA  1e14

/* A pass that leaves more than this of the gaps is slow. */
#define SLOW 0.1

/* Gaps of the active rows, relative to the terms that they are the difference of: those of an answer, those of
 * equations that are solvable at all, and those whose sign is rounding. */
#define CLOSED     (4.0 * DBL_EPSILON)
#define SOLVABLE   1e-12
#define NOISE      (64.0 * DBL_EPSILON)
#define PULL_NOISE 1e-12

/* Where the terms of a gap happen to be small, the rounding of w is still that of its other entries. */
#define LEAST_SIZE 1e-3

enum { PASSES = 12 };

typedef struct {
    uz_sparse_load *x;
    const uz_dual *dual;
    const bool *active;
    double *sigma, *f, *size; /* m */
    double *w, *e, *room;     /* d: u less its base */
    double worst;             /* of the active gaps, relative to their sizes */
} multipliers;

/* e = N'r - K w, f = g0 - N w, and what the rounding of f is in proportion to. */
static void measure(multipliers *a, const double *r)
{
    const uz_csc *Nt = &a->dual->Nt;
    memset(a->e, 0, (size_t)a->dual->d * sizeof *a->e);
    uz_csc_symv(a->e, a->x->load.K, -1.0, a->w);
    uz_csc_gaxpy_t(a->e, &a->dual->N, 1.0, r);
    double largest = 0.0;
    a->worst = 0.0;
    for (int64_t i = 0; i < a->dual->m; i++) {
        a->f[i] = a->x->load.g0[i];
        a->size[i] = fabs(a->x->load.h[i]) + fabs(a->f[i]);
        for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++) {
            const double term = Nt->val[k] * a->w[Nt->idx[k]];
            a->f[i] -= term;
            a->size[i] += fabs(term);
        }
        largest = fmax(largest, a->active[i] ? a->size[i] : 0.0);
    }
    for (int64_t i = 0; largest > 0.0 && i < a->dual->m; i++)
        if (a->active[i])
            a->worst = fmax(a->worst, fabs(a->f[i]) / fmax(a->size[i], LEAST_SIZE * largest));
}

/* Passes with one Sigma. */
static uz_status iterate(multipliers *a, bool *slow, double *r, uz_springs *S, uz_factor_workspace *ws, uz_error *err)
{
    const uz_csc *Nt = &a->dual->Nt;
    uz_factor *factor = NULL;
    *slow = false;
    uz_springs_fill(S, a->sigma);
    uz_status status = uz_factor_create(&factor, &S->S, S->analysis, 0, NULL, err);
    if (status == UZ_ERR_NOT_SPD) { /* nothing is left of K in S */
        uz_error_reset(err);
        return UZ_OK;
    }
    if (status == UZ_OK) {
        const size_t bytes =
            uz_csc_bytes(&S->S) * 3 + uz_analysis_bytes(S->analysis) + uz_factor_describe(factor).bytes;
        a->x->load.most = bytes > a->x->load.most ? bytes : a->x->load.most;
    }
    for (int pass = 0; status == UZ_OK && factor && pass < PASSES && !uz_stop_is_due(&a->x->load.stop); pass++) {
        const double before = a->worst;
        for (int64_t i = 0; i < a->dual->m; i++)
            for (int64_t k = Nt->ptr[i]; a->active[i] && k < Nt->ptr[i + 1]; k++)
                a->e[Nt->idx[k]] += Nt->val[k] * a->sigma[i] * a->f[i];
        status = uz_factor_solve(factor, ws, a->e, a->e, a->room, err);
        for (int64_t i = 0; i < a->dual->m; i++) {
            double change = a->f[i];
            for (int64_t k = Nt->ptr[i]; a->active[i] && k < Nt->ptr[i + 1]; k++)
                change -= Nt->val[k] * a->e[Nt->idx[k]];
            r[i] += a->active[i] ? a->sigma[i] * change : 0.0;
        }
        for (int64_t j = 0; j < a->dual->d; j++)
            a->w[j] += a->e[j];
        measure(a, r);
        if (a->worst <= CLOSED && pass > 0)
            break;
        *slow = pass > 0 && a->worst > SLOW * before;
        if (*slow)
            break;
    }
    uz_factor_free(factor);
    return status;
}

uz_status uz_multipliers_solve(uz_sparse_load *x, uz_factor_workspace *ws, uz_active_end *end, double *r, double *g,
                               const bool *active, uz_error *err)
{
    const uz_dual *dual = x->load.dual;
    const uz_csc *Nt = &dual->Nt;
    const int64_t m = dual->m, d = dual->d;
    multipliers a = {.x = x, .dual = dual, .active = active};
    double *of_m = uz_alloc_zero(3 * m, sizeof *of_m), *of_d = uz_alloc_zero(3 * d, sizeof *of_d);
    uz_springs S = {0};
    uz_status status = UZ_OK;
    bool slow = true;
    if (!of_m || !of_d) {
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)m);
    } else {
        a.sigma = of_m;
        a.f = of_m + m;
        a.size = of_m + 2 * m;
        a.w = of_d;
        a.e = of_d + d;
        a.room = of_d + 2 * d;
        for (int64_t i = 0; i < m; i++)
            r[i] = active[i] && x->load.inside ? x->load.inside[i] : 0.0;
        measure(&a, r);
        status = uz_springs_create(&S, x->load.K, dual, active, err);
    }
    for (double sigma = FIRST_SIGMA; status == UZ_OK && S.analysis && slow && sigma <= LAST_SIGMA;
         sigma *= MORE_SIGMA) {
        for (int64_t i = 0; i < m; i++) {
            double compliance = 0.0;
            for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
                compliance += Nt->val[k] * Nt->val[k] * uz_sparse_weight(x->load.K, Nt->idx[k]);
            a.sigma[i] = compliance > 0.0 ? sigma / compliance : 0.0;
        }
        status = iterate(&a, &slow, r, &S, ws, err);
        slow = slow && a.worst > SOLVABLE;
    }
    if (status == UZ_OK && a.worst <= SOLVABLE && !uz_stop_is_due(&x->load.stop)) {
        double largest = 0.0;
        for (int64_t i = 0; i < m; i++)
            largest = fmax(largest, fabs(r[i]));
        for (int64_t i = 0; i < m; i++) {
            g[i] = active[i] || fabs(a.f[i]) <= NOISE * a.size[i] ? 0.0 : a.f[i];
            r[i] = fabs(r[i]) <= PULL_NOISE * largest ? 0.0 : r[i];
        }
        *end = UZ_ACTIVE_SOLVED;
    }
    uz_springs_clear(&S);
    uz_free_all(of_m, of_d);
    return status;
}
