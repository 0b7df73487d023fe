/* multigrid.c: levels by smoothed aggregation, and the V-cycle on them.
 *
 * The cycle smooths by one Gauss-Seidel sweep forwards before the coarse correction and one backwards after it, so it
 * is symmetric, and positive definite because every coarse matrix is P'A P with the very P that is used. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { COARSEST = 1200, POWER_STEPS = 8 };

/* A level that keeps more than this share of the dofs is not worth having. */
#define LEAST_GAIN 0.7

static uz_status invert_diagonal(uz_level *level, const uz_csc *A, uz_error *err)
{
    level->n = A->cols;
    level->inverse = uz_alloc(level->n, sizeof *level->inverse);
    if (!level->inverse)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld dofs", (long long)level->n);
    for (int64_t j = 0; j < level->n; j++) {
        int64_t k = A->ptr[j];
        bool positive = k < A->ptr[j + 1] && A->idx[k] == j && A->val[k] > 0.0;
        if (!positive)
            return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                           "K is not positive definite: its diagonal entry of dof %lld (numbered from 0) is not "
                           "positive. Support the body so that it can't move freely, or check the signs of K.",
                           (long long)j);
        level->inverse[j] = 1.0 / A->val[k];
    }
    return UZ_OK;
}

/* What a level is made of; the modes and nodes of level 0 are the caller's. */
typedef struct {
    int32_t *node;
    int64_t n_nodes;
    float *modes;
    double strong;
} sources;

/* The prolongation of the level and the modes of the next. coarse NULL on success: the level can't be coarsened. */
static uz_status build_prolongation(uz_level *level, float **coarse, const uz_csc *A, const sources *from,
                                    double threshold, int k, const uz_stop *stop, uz_error *err)
{
    int64_t n = level->n;
    int32_t *aggregate = uz_alloc(from->n_nodes, sizeof *aggregate), *of = uz_alloc(n, sizeof *of);
    float *basis = uz_alloc(n * k, sizeof *basis);
    double *x = uz_alloc(n, sizeof *x), *y = uz_alloc(n, sizeof *y);
    double range = 1.0; /* lambda_max(D^-1 A), a little too large: powers reach it within some per cent from below */
    uz_status status = UZ_OK;
    *coarse = NULL;
    if (!aggregate || !of || !basis || !x || !y)
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
    if (status == UZ_OK)
        status =
            uz_aggregate(aggregate, &level->aggregates, A, level->inverse, from->node, from->n_nodes, threshold, err);
    bool gain = status == UZ_OK && level->aggregates > 0 && (double)(level->aggregates * k) < LEAST_GAIN * (double)n;
    if (gain) {
        *coarse = uz_alloc(level->aggregates * k * k, sizeof **coarse);
        for (int64_t i = 0; i < n; i++)
            of[i] = aggregate[from->node[i]];
        if (uz_stop_is_due(stop))
            status = uz_fail_stopped(err);
        else if (!*coarse)
            status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to coarsen %lld dofs", (long long)n);
        else
            status = uz_tentative(basis, *coarse, from->modes, of, n, level->aggregates, k, err);
        uint64_t state = 1;
        for (int64_t i = 0; status == UZ_OK && i < n; i++)
            x[i] = uz_uniform(&state) - 0.5;
        for (int step = 0; status == UZ_OK && step < POWER_STEPS; step++) {
            const double before = uz_norm(n, x);
            memset(y, 0, (size_t)n * sizeof *y);
            uz_csc_symv(y, A, 1.0, x);
            for (int64_t i = 0; i < n; i++)
                y[i] *= level->inverse[i];
            const double after = uz_norm(n, y);
            range = before > 0.0 && after > 0.0 ? 1.1 * (after / before) : 1.0;
            if (!(before > 0.0) || !(after > 0.0))
                break;
            for (int64_t i = 0; i < n; i++)
                x[i] = y[i] / after;
        }
        if (status == UZ_OK)
            status = uz_prolong_smoothed(level, A, basis, of, 4.0 / 3.0 / range, k, stop, err);
    }
    free(aggregate);
    free(of);
    free(basis);
    free(x);
    free(y);
    return status;
}

/* All so far; what the limit is compared with on the way. */
static size_t count_bytes(const uz_aggregates *mg)
{
    size_t bytes = sizeof *mg;
    for (int l = 0; l < mg->base.levels; l++) {
        const uz_level *level = &mg->level[l];
        const size_t n = (size_t)level->n;
        bytes += 8 * n;
        if (level->A.ptr)
            bytes += 8 * n + 16 * (size_t)level->A.ptr[n];
        if (level->ptr)
            bytes += 8 * n + (size_t)level->ptr[n] * (4 + 4 * (size_t)mg->k);
    }
    return bytes + (mg->coarsest ? uz_factor_describe(mg->coarsest).bytes : 0);
}

/* M <= (D + L) D^-1 (D + L') for a cycle that smooths so, and for K itself; the norm of D^-1/2 L D^-1/2 is at most the
 * root of its largest row sum times its largest column sum. */
static uz_status bound_by_diagonal(double *bound, const uz_level *level, const uz_csc *K, uz_error *err)
{
    double by_row = 0.0, by_column = 0.0, *row = uz_alloc_zero(level->n, sizeof *row);
    if (!row)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld dofs", (long long)level->n);
    for (int64_t j = 0; j < level->n; j++) {
        double sum = 0.0;
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            double scaled = fabs(K->val[k]) * sqrt(level->inverse[j]) * sqrt(level->inverse[K->idx[k]]);
            sum += scaled;
            row[K->idx[k]] += scaled;
        }
        by_column = fmax(by_column, sum);
    }
    for (int64_t j = 0; j < level->n; j++)
        by_row = fmax(by_row, row[j]);
    double norm = 1.0 + sqrt(by_row * by_column);
    *bound = norm * norm;
    free(row);
    return UZ_OK;
}

/* Level l + 1 from level l; *done: level l is the coarsest. */
static uz_status coarsen(uz_aggregates *mg, bool *done, sources *from, const uz_csc *K, size_t memory_limit,
                         const uz_stop *stop, uz_error *err)
{
    int l = mg->base.levels - 1;
    uz_level *level = &mg->level[l], *next = level + 1;
    const uz_csc *A = l == 0 ? K : &mg->level[l].A;
    float *modes = NULL;
    *done = level->n <= COARSEST || l + 1 == UZ_LEVELS_MOST;
    if (*done)
        return UZ_OK;
    uz_status status = build_prolongation(level, &modes, A, from, from->strong * ldexp(1.0, -l), mg->k, stop, err);
    *done = status == UZ_OK && !modes;
    if (status != UZ_OK || *done) {
        free(modes);
        return status;
    }
    status = uz_galerkin(&next->A, level, A, mg->k, stop, err);
    if (status == UZ_OK) {
        status = invert_diagonal(next, &next->A, err);
        mg->base.levels++;
    }
    if (status == UZ_OK && memory_limit > 0 && count_bytes(mg) > memory_limit)
        status =
            uz_fail(err, UZ_ERR_LIMIT, "K", "the coarse levels take more than the %zu bytes allowed", memory_limit);
    const int64_t count = level->aggregates * mg->k;
    free(from->node);
    free(from->modes);
    *from = (sources){uz_alloc(count, sizeof *from->node), level->aggregates, modes, from->strong};
    for (int64_t i = 0; from->node && i < count; i++)
        from->node[i] = (int32_t)(i / mg->k);
    if (status == UZ_OK && !from->node)
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld aggregates", (long long)level->aggregates);
    return status;
}

uz_status uz_factor_coarsest(uz_factor **out, const uz_csc *A, size_t memory_limit, const uz_hooks *hooks,
                             uz_error *err)
{
    uz_analysis *analysis = NULL;
    uz_status status = uz_analysis_create(&analysis, A, NULL, 0, 0, UZ_ORDERING_AMD, hooks, err);
    if (status == UZ_OK)
        status = uz_factor_create(out, A, analysis, memory_limit, hooks, err);
    uz_analysis_free(analysis);
    return status;
}

uz_status uz_multigrid_create(uz_multigrid **out, const uz_csc *K, const uz_modes *modes, size_t memory_limit,
                              const uz_stop *stop, uz_error *err)
{
    const int64_t n = K->cols, k = modes->count;
    *out = NULL;
    if (n >= INT32_MAX)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "K", "matrix_free holds up to 2^31 - 2 dofs, these are %lld",
                       (long long)n);
    uz_aggregates *mg = uz_alloc_zero(1, sizeof *mg);
    sources from = {uz_alloc(n, sizeof *from.node), modes->n_nodes, uz_alloc(n * k, sizeof *from.modes), modes->strong};
    uz_status status = UZ_OK;
    bool done = false;
    if (!mg || !from.node || !from.modes) {
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a multigrid on %lld dofs", (long long)n);
    } else {
        mg->k = modes->count;
        mg->base = (uz_multigrid){.kind = &uz_aggregates_kind, .n = n, .levels = 1};
        memcpy(from.node, modes->node, (size_t)n * sizeof *from.node);
        memcpy(from.modes, modes->value, (size_t)(n * k) * sizeof *from.modes);
        status = invert_diagonal(&mg->level[0], K, err);
    }
    while (status == UZ_OK && !done)
        status = uz_stop_is_due(stop) ? uz_fail_stopped(err) : coarsen(mg, &done, &from, K, memory_limit, stop, err);
    free(from.node);
    free(from.modes);
    if (status == UZ_OK)
        status = bound_by_diagonal(&mg->base.most, &mg->level[0], K, err);
    if (status == UZ_OK) { /* the factor of the coarsest level */
        const int last = mg->base.levels - 1;
        uz_error inner = {0};
        status = uz_factor_coarsest(&mg->coarsest, last == 0 ? K : &mg->level[last].A, memory_limit,
                                    stop ? stop->hooks : NULL, last == 0 ? err : &inner);
        if (last > 0 && status == UZ_ERR_NOT_SPD)
            uz_fail(err, status, "K",
                    "K is not positive definite to working precision: on smooth displacements it resists too little. "
                    "Support the body so that it can't move freely, or check the signs of K.");
        else if (last > 0 && status != UZ_OK)
            uz_fail(err, status, inner.where, "%s", inner.message);
    }
    if (status == UZ_OK) {
        mg->base.bytes = count_bytes(mg);
        *out = &mg->base;
    } else if (mg) {
        uz_aggregates_kind.free(&mg->base);
    }
    return status;
}

void uz_multigrid_free(uz_multigrid *mg)
{
    if (mg)
        mg->kind->free(mg);
}
