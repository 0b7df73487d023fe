/* multigrid.c: levels by smoothed aggregation (Vanek, Mandel, Brezina 1996).
 *
 * Every coarse matrix is P'A P with the very P that is used, summed in double precision: rigid-body modes of large
 * aggregates have energies that single precision could not tell from 0. Sweeps and prolongation are in single. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "linalg/blas.h"
#include "linalg/pieces.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/random.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Alone: a matrix that is factored as it is. Coarsest: reading the factor of this many dofs takes a tenth of a cycle
 * where there are a hundred thousand. */
enum { ALONE = 1200, COARSEST = 500, POWER_STEPS = 8 };

/* A level that keeps more than this share of the dofs is not worth having. */
#define LEAST_GAIN 0.7

static uz_status fail_memory(int64_t dofs, uz_error *err)
{
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a multigrid on %lld dofs", (long long)dofs);
}

static uz_status fail_soft(uz_error *err)
{
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is not positive definite to working precision: on smooth displacements it resists too little. "
                   "Support the body so that it can't move freely, or check the signs of K.");
}

typedef struct {
    float *to;
    const double *from;
} rounding;

static void round_numbers(void *ctx, int64_t begin, int64_t end)
{
    const rounding *x = ctx;
    for (int64_t e = begin; e < end; e++)
        x->to[e] = (float)x->from[e];
}

uz_status uz_level_round(uz_level *level, uz_error *err)
{
    const uz_blocks *A = &level->A;
    const int b = A->b;
    const int64_t size = (int64_t)b * b, count = A->ptr[A->nodes] * size;
    level->off = uz_alloc(count + 8, sizeof *level->off);
    level->diag = uz_alloc(A->nodes * size + 8, sizeof *level->diag);
    level->inverse = uz_alloc(A->nodes * b, sizeof *level->inverse);
    if (!level->off || !level->diag || !level->inverse)
        return fail_memory(A->nodes * b, err);
    uz_by_pieces(round_numbers, &(rounding){level->off, A->off}, count);
    uz_by_pieces(round_numbers, &(rounding){level->diag, A->diag}, A->nodes * size);
    memset(level->off + count, 0, 8 * sizeof *level->off);
    memset(level->diag + A->nodes * size, 0, 8 * sizeof *level->diag);
    for (int64_t i = 0; i < A->nodes * b; i++) {
        const double value = A->diag[i / b * size + i % b * b + i % b];
        if (!(value >= 0.0))
            return fail_soft(err);
        level->inverse[i] = value > 0.0 ? (float)(1.0 / value) : 0.0F;
    }
    return UZ_OK;
}

/* What nodes from `first` to `end` know of y = A x, after those that they have blocks with: b numbers for each node, of
 * the rounded numbers. */
static inline __attribute__((always_inline)) void multiply_rows(double *y, const uz_level *level, const double *x,
                                                                int b, int64_t first, int64_t end)
{
    const uz_blocks *A = &level->A;
    for (int64_t i = first; i < end; i++) {
        const double *mine = x + i * b;
        double sum[UZ_MODES_MOST] = {0.0};
        for (int r = 0; r < b; r++)
            for (int c = 0; c < b; c++)
                sum[r] += (double)level->diag[(i * b + r) * b + c] * mine[c];
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
            const double *other = x + (int64_t)A->idx[e] * b;
            double *to = y + (int64_t)A->idx[e] * b, back[UZ_MODES_MOST] = {0.0};
            for (int r = 0; r < b; r++)
                for (int c = 0; c < b; c++) {
                    const double value = (double)level->off[(e * b + r) * b + c];
                    sum[r] += value * other[c];
                    back[c] += value * mine[r];
                }
            for (int c = 0; c < b; c++)
                to[c] += back[c];
        }
        for (int r = 0; r < b; r++)
            y[i * b + r] = sum[r];
    }
}

UZ_AVX2_FMA static void multiply_six_fused(double *y, const uz_level *level, const double *x, int64_t first,
                                           int64_t end)
{
    multiply_rows(y, level, x, 6, first, end);
}

typedef struct {
    double *y;
    const uz_level *level;
    const double *x;
    const int64_t *first; /* of each part, and the end of the last */
    int b;
} rounded_product;

static void multiply_part(void *ctx, int part)
{
    const rounded_product *p = ctx;
    if (p->b == 6 && uz_cpu_has_avx2_fma())
        multiply_six_fused(p->y, p->level, p->x, p->first[part], p->first[part + 1]);
    else
        multiply_rows(p->y, p->level, p->x, p->b, p->first[part], p->first[part + 1]);
}

static void multiply_rounded(double *y, const uz_level *level, const double *x, int b)
{
    const uz_blocks *A = &level->A;
    const int64_t rest[] = {A->parts > 0 ? A->part[A->parts] : 0, A->nodes};
    rounded_product p = {y, level, x, A->part, b};
    uz_aside_share(multiply_part, &p, A->parts);
    p.first = A->seams > 0 ? A->seam : rest;
    uz_aside_share(multiply_part, &p, A->seams > 0 ? A->seams : 1);
}

/* y = A x roughly, vectors with `width` numbers for each node, the surplus ones 0: four where uz_blocks_multiply takes
 * them. */
static void multiply(double *y, const uz_level *level, const double *x, int width)
{
    const uz_blocks *A = &level->A;
    if (width == 4 && A->off)
        uz_blocks_multiply(y, A, x, 1);
    else if (width == 4)
        uz_level_multiply_parts(y, level, x, 1);
    else
        multiply_rounded(y, level, x, width);
}

/* Vectors of `width` numbers for each node, of which the first b are dofs. */
typedef struct {
    double *x, *y;
    const float *inverse;
    int b, width;
    double length;
} power;

static void precondition(void *ctx, int64_t begin, int64_t end)
{
    const power *p = ctx;
    for (int64_t i = begin; i < end; i++)
        for (int r = 0; r < p->width; r++)
            p->y[i * p->width + r] *= r < p->b ? (double)p->inverse[i * p->b + r] : 0.0;
}

static void normalize(void *ctx, int64_t begin, int64_t end)
{
    const power *p = ctx;
    for (int64_t i = begin * p->width; i < end * p->width; i++)
        p->x[i] = p->y[i] / p->length;
}

uz_status uz_level_range(double *range, const uz_level *level, uz_error *err)
{
    const uz_blocks *A = &level->A;
    const int b = A->b, width = b <= 3 ? 4 : b;
    const int64_t n = A->nodes * width;
    double *x = uz_alloc_zero(n, sizeof *x), *y = uz_alloc(n, sizeof *y);
    uint64_t state = 1;
    *range = 1.0;
    for (int64_t i = 0; x && i < A->nodes * b; i++)
        x[i / b * width + i % b] = level->inverse[i] > 0.0F ? uz_uniform(&state) - 0.5 : 0.0;
    for (int step = 0; x && y && step < POWER_STEPS; step++) {
        multiply(y, level, x, width);
        power p = {x, y, level->inverse, b, width, 1.0};
        uz_by_pieces(precondition, &p, A->nodes);
        const double before = sqrt(uz_long_dot(n, x, x)), after = sqrt(uz_long_dot(n, y, y));
        *range = before > 0.0 && after > 0.0 ? 1.1 * (after / before) : 1.0;
        if (!(before > 0.0) || !(after > 0.0))
            break;
        p.length = after;
        uz_by_pieces(normalize, &p, A->nodes);
    }
    const bool ok = x && y;
    free(x);
    free(y);
    return ok ? UZ_OK : fail_memory(n, err);
}

/* From a level whose prolongation is there. */
static uz_status make_next(uz_level *level, const uz_below *below, int k, const uz_team *team, const uz_stop *stop,
                           uz_error *err)
{
    uz_status status = uz_galerkin(&level[1].A, level, below, k, team, stop, err);
    return status == UZ_OK ? uz_level_round(level + 1, err) : status;
}

/* To the corners of elements with middles: the next level is what elements without them would be, with a quarter to an
 * eighth of the nodes and fewer blocks for each. Aggregates of all nodes take more steps there and more time to make.
 */
static uz_status coarsen_to_corners(uz_level *level, float **modes, const int32_t *ends, int dim, int k,
                                    const uz_team *team, const uz_stop *stop, uz_error *err)
{
    uz_below below;
    uz_status status = uz_below_init(&below, &level->A) ? UZ_OK : fail_memory(level->A.nodes * level->A.b, err);
    if (status == UZ_OK)
        status = uz_prolong_linear(level, modes, ends, dim, k, err);
    if (status == UZ_OK)
        status = make_next(level, &below, level->A.b, team, stop, err);
    uz_below_clear(&below);
    return status;
}

/* The prolongation of the level, the next matrix, and *modes, which become its own. *done: it can't be coarsened. */
static uz_status coarsen(uz_level *level, bool *done, float **modes, double threshold, int k, const uz_team *team,
                         const uz_stop *stop, uz_error *err)
{
    const uz_blocks *A = &level->A;
    const int64_t n = A->nodes * A->b;
    int32_t *aggregate = uz_alloc(A->nodes, sizeof *aggregate);
    float *basis = uz_alloc(n * k, sizeof *basis), *coarse = NULL;
    uz_below below;
    uz_blocks parts = {.parts = 0};
    double range = 1.0;
    uz_status status = uz_below_init(&below, A) && aggregate && basis ? UZ_OK : fail_memory(n, err);
    if (status == UZ_OK)
        status = uz_aggregate(aggregate, &level->aggregates, level, &below, threshold, err);
    *done = status == UZ_OK && (level->aggregates == 0 || (double)(level->aggregates * k) > LEAST_GAIN * (double)n);
    if (status == UZ_OK && !*done) {
        const bool parted = uz_part_aggregates(&parts, aggregate, level->aggregates, level, &below);
        coarse = uz_alloc(level->aggregates * k * k, sizeof *coarse);
        status = uz_stop_is_due(stop) ? uz_fail_stopped(err) : parted && coarse ? UZ_OK : fail_memory(n, err);
        if (status == UZ_OK)
            status = uz_tentative(basis, coarse, *modes, aggregate, A->nodes, A->b, level->aggregates, k, err);
        if (status == UZ_OK)
            status = uz_level_range(&range, level, err);
        if (status == UZ_OK)
            status = uz_prolong_smoothed(level, &below, basis, aggregate, 4.0 / 3.0 / range, k, stop, err);
        if (status == UZ_OK)
            status = make_next(level, &below, k, team, stop, err);
        if (status == UZ_OK && !uz_blocks_take_parts(&level[1].A, &parts))
            status = fail_memory(n, err);
        free(*modes);
        *modes = coarse;
    }
    uz_below_clear(&below);
    free(aggregate);
    free(basis);
    return status;
}

/* All so far; what the limit is compared with on the way. */
static size_t count_bytes(const uz_aggregates *mg)
{
    size_t bytes = sizeof *mg + (mg->slot ? 16 * (size_t)mg->base.n : 0);
    for (int l = 0; mg->slot && l < mg->base.levels; l++) {
        const uz_level *level = &mg->level[l];
        const size_t nodes = (size_t)level->A.nodes, b = (size_t)level->A.b, blocks = (size_t)level->A.ptr[nodes];
        bytes += nodes * (8 + 4 * b + 4 * b * b) + blocks * (4 + 4 * b * b);
        if (level->A.off || level->off_rest.value)
            bytes += (level->A.off ? 8 : 4) * b * b * (nodes + blocks);
        if (level->ptr)
            bytes += 8 * nodes + (size_t)level->ptr[nodes] * (4 + 4 * b * (size_t)level[1].A.b);
    }
    return bytes + (mg->coarsest ? uz_factor_describe(mg->coarsest).bytes : 0);
}

/* Sums of rows of D^-1/2 K D^-1/2 but for its diagonal, as the threads that share the columns see them; D^-1/2. */
typedef struct {
    const uz_csc *K;
    double *row, *scale;
} row_sums;

static void add_columns(void *ctx, int64_t begin, int64_t end)
{
    const row_sums *x = ctx;
    const uz_csc *K = x->K;
    const double *scale = x->scale;
    for (int64_t j = begin; j < end; j++) {
        double own = 0.0;
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            const int64_t i = K->idx[k];
            const double scaled = fabs(K->val[k]) * scale[j] * scale[i];
            own += scaled;
            x->row[i] += scaled;
        }
        x->row[j] += own;
    }
}

/* M <= (D + L) D^-1 (D + L') for a cycle that smooths so, and for K itself; the norm of D^-1/2 L D^-1/2 is at most the
 * root of its largest row sum times its largest column sum. In any order of the dofs: all of K's entries count. */
static uz_status bound_by_diagonal(double *bound, const uz_csc *K, uz_error *err)
{
    row_sums x = {K, uz_alloc_zero(K->cols, sizeof *x.row), uz_alloc(K->cols, sizeof *x.scale)};
    const bool ok = x.row && x.scale;
    for (int64_t j = 0; ok && j < K->cols; j++)
        x.scale[j] = 1.0 / sqrt(K->val[K->ptr[j]]);
    if (ok)
        uz_by_columns(add_columns, &x, K);
    const double most = ok ? uz_long_max(K->cols, x.row) : 0.0;
    *bound = (1.0 + most) * (1.0 + most);
    free(x.row);
    free(x.scale);
    return ok ? UZ_OK : fail_memory(K->cols, err);
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

static uz_status factor_last(uz_aggregates *mg, const uz_csc *K, size_t memory_limit, const uz_stop *stop,
                             uz_error *err)
{
    const uz_hooks *hooks = stop ? stop->hooks : NULL;
    const int last = mg->base.levels - 1;
    if (last == 0)
        return uz_factor_coarsest(&mg->coarsest, K, memory_limit, hooks, err);
    uz_csc A = {0};
    uz_error inner = {0};
    uz_status status = uz_blocks_to_columns(&A, &mg->level[last].A, mg->level[last].inverse, err);
    if (status == UZ_OK) {
        status = uz_factor_coarsest(&mg->coarsest, &A, memory_limit, hooks, &inner);
        if (status == UZ_ERR_NOT_SPD)
            fail_soft(err);
        else if (status != UZ_OK)
            uz_fail(err, status, inner.where, "%s", inner.message);
    }
    uz_csc_clear(&A);
    return status;
}

/* The modes of level 0: those of S K S are S^-1 times K's, here times the least of S, so that none overflows. */
static float *scale_modes(const uz_aggregates *mg, const uz_modes *modes)
{
    const int k = modes->count;
    float *scaled = uz_alloc_zero(mg->level[0].A.nodes * mg->level[0].A.b * k, sizeof *scaled);
    double least = INFINITY;
    for (int64_t j = 0; j < mg->base.n; j++)
        least = fmin(least, mg->scale[j]);
    for (int64_t j = 0; scaled && j < mg->base.n; j++)
        for (int c = 0; c < k; c++)
            scaled[uz_slot_number(mg, mg->slot[j]) * k + c] =
                (float)(least / mg->scale[j] * (double)modes->value[j * k + c]);
    return scaled;
}

/* Ends by nodes of level 0, where that has much fewer corners than nodes; NULL: it has not, or *failed for memory. */
static int32_t *find_ends(const uz_blocks *A, const int32_t *node_of_group, const uz_modes *modes, bool *failed)
{
    if (!modes->ends)
        return NULL;
    int32_t *ends = uz_alloc(2 * A->nodes, sizeof *ends);
    int64_t middles = 0;
    *failed = !ends;
    for (int64_t i = 0; ends && i < 2 * A->nodes; i++)
        ends[i] = -1;
    for (int64_t g = 0; ends && g < modes->n_nodes; g++) {
        const int32_t *of = modes->ends + 2 * g, node = node_of_group[g];
        if (node < 0 || of[0] < 0)
            continue;
        /* an end without dofs does not move; a middle without such ends is a corner */
        for (int side = 0; side < 2; side++)
            ends[2 * node + side] = node_of_group[of[side]];
        middles += ends[2 * node] >= 0 || ends[2 * node + 1] >= 0;
    }
    if (ends && (double)(A->nodes - middles) <= LEAST_GAIN * (double)A->nodes)
        return ends;
    free(ends);
    return NULL;
}

/* All that follows from level 0. ends: of its nodes, or NULL: it is coarsened by aggregates at once. */
static uz_status make_levels(uz_aggregates *mg, const int32_t *ends, const uz_modes *modes, const uz_team *team,
                             size_t memory_limit, const uz_stop *stop, uz_error *err)
{
    const int first = ends ? 1 : 0; /* level with aggregates */
    float *of_level = NULL;
    bool done = false;
    uz_status status = uz_level_round(&mg->level[0], err);
    if (status == UZ_OK) /* what is left of K: for the next level, and for products afterwards */
        uz_level_part(&mg->level[0]);
    if (status == UZ_OK && !(of_level = scale_modes(mg, modes)))
        status = fail_memory(mg->base.n, err);
    while (status == UZ_OK && !done) {
        const int l = mg->base.levels - 1;
        uz_level *level = &mg->level[l];
        done = l + 1 == UZ_LEVELS_MOST || (l > 0 && level->A.nodes * level->A.b <= COARSEST);
        if (done)
            break;
        if (uz_stop_is_due(stop))
            status = uz_fail_stopped(err);
        else if (l < first)
            status = coarsen_to_corners(level, &of_level, ends, modes->dim, modes->count, team, stop, err);
        else
            status =
                coarsen(level, &done, &of_level, modes->strong * ldexp(1.0, first - l), modes->count, team, stop, err);
        mg->base.levels += level[1].A.ptr != NULL && level[1].inverse != NULL;
        if (status == UZ_OK && memory_limit > 0 && count_bytes(mg) > memory_limit)
            status = uz_fail(err, UZ_ERR_LIMIT, "K", "the levels of the multigrid take more than the %zu bytes allowed",
                             memory_limit);
    }
    free(of_level);
    return status;
}

static uz_status build(uz_aggregates *mg, const uz_csc *K, const uz_modes *modes, const uz_team *team,
                       size_t memory_limit, const uz_stop *stop, uz_error *err)
{
    int32_t *node_of_group = uz_alloc(modes->n_nodes, sizeof *node_of_group);
    uz_status status =
        node_of_group ? uz_blocks_of_matrix(mg, node_of_group, K, modes, team == NULL, err) : fail_memory(K->cols, err);
    bool no_memory = false;
    int32_t *ends = status == UZ_OK ? find_ends(&mg->level[0].A, node_of_group, modes, &no_memory) : NULL;
    free(node_of_group);
    if (no_memory)
        status = fail_memory(K->cols, err);
    if (status == UZ_OK)
        status = make_levels(mg, ends, modes, team, memory_limit, stop, err);
    free(ends);
    return status;
}

/* Without a level; NULL: no memory. */
static uz_aggregates *make_empty(int64_t n)
{
    uz_aggregates *mg = uz_alloc_zero(1, sizeof *mg);
    if (mg)
        mg->base = (uz_multigrid){.kind = &uz_aggregates_kind, .n = n, .levels = 1};
    return mg;
}

/* Only the last level needs its matrix again. */
static void drop_matrices(uz_aggregates *mg)
{
    for (int l = 1; l + 1 < mg->base.levels; l++) {
        free(mg->level[l].A.off);
        free(mg->level[l].A.diag);
        mg->level[l].A.off = mg->level[l].A.diag = NULL;
    }
}

uz_status uz_multigrid_create(uz_multigrid **out, const uz_csc *K, const uz_modes *modes, const uz_team *team,
                              size_t memory_limit, const uz_stop *stop, uz_error *err)
{
    const int64_t n = K->cols;
    *out = NULL;
    if (n >= INT32_MAX)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "K", "matrix_free holds up to 2^31 - 2 dofs, these are %lld",
                       (long long)n);
    uz_aggregates *mg = make_empty(n);
    if (!mg)
        return fail_memory(n, err);
    uz_status status = n > ALONE ? build(mg, K, modes, team, memory_limit, stop, err) : UZ_OK;
    if (status == UZ_OK)
        status = factor_last(mg, K, memory_limit, stop, err);
    drop_matrices(mg);
    if (status == UZ_OK)
        status = bound_by_diagonal(&mg->base.most, K, err);
    if (status == UZ_OK) {
        /* Half of FLT_EPSILON of K's absolute values is rounded off, twice that with what is on the way; the norm of
         * D^-1/2 |K| D^-1/2 is at most the largest row sum. */
        mg->base.rough = FLT_EPSILON * sqrt(mg->base.most);
        mg->base.bytes = count_bytes(mg);
        *out = &mg->base;
    } else {
        uz_aggregates_kind.free(&mg->base);
    }
    return status;
}

uz_status uz_multigrid_of_blocks(uz_multigrid **out, uz_blocks *A, const float *there, const uz_modes *modes,
                                 const uz_team *team, uz_error *err)
{
    const int64_t n = A->nodes * A->b;
    *out = NULL;
    if (n <= ALONE)
        return UZ_OK;
    uz_aggregates *mg = make_empty(n);
    if (!mg)
        return fail_memory(n, err);
    uz_status status = uz_blocks_take(mg, A, there, err);
    if (status == UZ_OK)
        status = make_levels(mg, NULL, modes, team, 0, NULL, err);
    const bool alone = status == UZ_OK && mg->base.levels == 1;
    if (alone)
        status = uz_blocks_give_back(A, mg, err);
    else if (status == UZ_OK)
        status = factor_last(mg, NULL, 0, NULL, err);
    if (status == UZ_OK && !alone) {
        uz_free_all(mg->level[0].off_rest.value, mg->level[0].diag_rest.value);
        mg->level[0].off_rest.value = mg->level[0].diag_rest.value = NULL;
        drop_matrices(mg);
        mg->base.bytes = count_bytes(mg);
        *out = &mg->base;
    } else {
        uz_aggregates_kind.free(&mg->base);
    }
    return status;
}

void uz_multigrid_free(uz_multigrid *mg)
{
    if (mg)
        mg->kind->free(mg);
}
