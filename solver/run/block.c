/* block.c: the steps of run.c for several loads at once.
 *
 *     p -> y, g0            forward substitution of all loads, once through L
 *     r                     iterations, load by load: they live on the contact
 *     u                     backward substitution of all loads, once through L
 *     (u, r) -> bound       certificates of UZ_LANES loads with one pass over K
 *
 * A load whose bound misses the request goes on by itself, as a single one would. */
#include "run/block.h"

#include "certificate/lanes.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "dual/block.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

_Static_assert((int)UZ_LANES == (int)UZ_CERTIFY_LANES, "what comes out of the factor is certified as it lies");

struct uz_block {
    uz_setup *setup;
    const uz_csc *K, *N;
    int64_t d, width;
    uz_dual_block *loads;
    uz_lane_certifier *certifier;
    uz_run *runs;         /* width */
    uz_dual_load **cases; /* width: those of the runs */
    const double **r;     /* width: scaled reactions to recover from */
    bool *corrected;      /* width */
    double *permuted;     /* d x UZ_LANES, or NULL: no certificate takes a solve */
};

static uz_status measure_doubt(void *ctx, double *doubt, uz_error *err)
{
    uz_block *block = ctx;
    return uz_setup_doubt(block->setup, doubt, block->K, NULL, err);
}

static uz_status inverse_norms(void *ctx, double squares[UZ_LANES], double *E, uz_error *err)
{
    uz_block *block = ctx;
    uz_factor_permute_lanes(block->setup->factor, block->permuted, E);
    uz_status status = uz_factor_solve_lanes(block->setup->factor, block->permuted, 1, true, err);
    for (int64_t l = 0; l < UZ_LANES; l++)
        squares[l] = 0.0;
    for (int64_t k = 0; k < block->d * UZ_LANES; k++)
        squares[k % UZ_LANES] += block->permuted[k] * block->permuted[k];
    return status;
}

uz_status uz_block_create(uz_block **out, uz_run **runs, uz_setup *setup, const uz_problem *problem, int64_t blocks,
                          uz_error *err)
{
    *out = NULL;
    uz_block *block = uz_alloc_zero(1, sizeof *block);
    if (!block)
        return uz_no_memory(err, "a block of loads");
    block->setup = setup;
    block->K = uz_setup_K(setup, problem);
    block->N = uz_setup_N(setup, problem);
    block->d = block->K->cols;
    block->width = blocks * UZ_LANES;
    block->runs = *runs = uz_alloc_zero(block->width, sizeof *block->runs);
    block->cases = uz_alloc_zero(block->width, sizeof(uz_dual_load *));
    block->r = uz_alloc_zero(block->width, sizeof(double *));
    block->corrected = uz_alloc_zero(block->width, sizeof(bool));
    uz_status status = UZ_OK;
    if (!block->runs || !block->cases || !block->r || !block->corrected)
        status = uz_no_memory(err, "a block of loads");
    if (status == UZ_OK)
        status = uz_dual_block_create(&block->loads, setup->dual, blocks, err);
    const uz_certify_input in = {.K = block->K,
                                 .N = block->N,
                                 .measure_doubt = measure_doubt,
                                 .ctx = block,
                                 .terms = setup->terms,
                                 .inverse_bound = uz_factor_describe(setup->factor).inverse_bound,
                                 .spares = uz_factor_describe(setup->factor).nnz >= UZ_CERTIFY_SPARES};
    if (status == UZ_OK && !in.spares && !(block->permuted = uz_alloc(block->d * UZ_LANES, sizeof(double))))
        status = uz_no_memory(err, "a block of loads");
    if (status == UZ_OK)
        status = uz_lane_certifier_create(&block->certifier, &in, inverse_norms, err);
    if (status == UZ_OK)
        *out = block;
    else
        uz_block_free(block);
    return status;
}

void uz_block_free(uz_block *block)
{
    if (!block)
        return;
    uz_dual_block_free(block->loads);
    uz_lane_certifier_free(block->certifier);
    uz_free_all(block->runs, block->cases, block->r, block->corrected, block->permuted, block);
}

enum { TILE = 512 }; /* rows at a time: what is read and written by turns stays in the first cache */

/* Every load pays its share of what was done for all. */
static void share_time(uz_block *block, int64_t count, double seconds, bool certify)
{
    for (int64_t k = 0; k < count && block->runs[k].result; k++) {
        uz_timings *t = &block->runs[k].result->summary.timings;
        *(certify ? &t->certify : &t->iterate) += seconds / (double)count;
    }
}

/* The loads of all runs, and the forward substitution. */
static uz_status load_all(uz_block *block, const uz_request *asked, int64_t count, int64_t *failed, uz_error *err)
{
    uz_status status = UZ_OK;
    memset(block->runs, 0, (size_t)count * sizeof *block->runs);
    for (int64_t k = 0; status == UZ_OK && k < count; k++) {
        *failed = k;
        status = uz_run_begin(&block->runs[k], &asked[k], err);
        if (status == UZ_OK)
            status = uz_run_load(&block->runs[k], err);
    }
    if (status != UZ_OK)
        return status;
    double start = uz_seconds(), *P = block->loads->P;
    for (int64_t first = 0; first < block->width; first += UZ_LANES, P += UZ_LANES * block->d)
        for (int64_t begin = 0; begin < block->d; begin += TILE) { /* side by side; missing ones are zero */
            const int64_t end = begin + TILE < block->d ? begin + TILE : block->d;
            for (int64_t lane = 0; lane < UZ_LANES; lane++) {
                const double *p = first + lane < count ? block->runs[first + lane].load.p : NULL;
                for (int64_t j = begin; j < end; j++)
                    P[j * UZ_LANES + lane] = p ? p[j] : 0.0;
            }
        }
    status = uz_dual_block_forward(block->loads, err);
    share_time(block, count, uz_seconds() - start, false);
    return status;
}

static uz_status certify_lanes(uz_block *block, int64_t first, int64_t count, bool *certified, uz_error *err)
{
    uz_status status = UZ_OK;
    const double *P = block->loads->P + first * block->d;
    const double *U = block->loads->U + first * block->d;
    uz_lane_answer answers[UZ_LANES];
    uz_run *runs = block->runs + first;
    for (int64_t begin = 0; begin < block->d; begin += TILE) {
        const int64_t end = begin + TILE < block->d ? begin + TILE : block->d;
        for (int64_t lane = 0; lane < count; lane++)
            for (int64_t j = begin; j < end; j++)
                runs[lane].answer.u[j] = U[j * UZ_LANES + lane];
    }
    for (int64_t k = 0; status == UZ_OK && k < count; k++) {
        const double *scale = runs[k].work.dual->dual->row_scale;
        const uz_load_vectors *load = &runs[k].load;
        double whole_norm = 0.0;
        for (int64_t i = 0; i < runs[k].m; i++)
            runs[k].answer.r[i] = scale[i] * block->r[first + k][i];
        if (load->moved)
            status = uz_whole_norm(&whole_norm, &block->setup->model, runs[k].answer.u, load->prescribed, err);
        answers[k] = (uz_lane_answer){.r = runs[k].answer.r,
                                      .g = runs[k].answer.g,
                                      .h = runs[k].load.h,
                                      .sharp = 0.5 * runs[k].work.requested,
                                      .moved = load->moved,
                                      .acting = uz_run_acting(&runs[k], block->N, load->h, runs[k].answer.u),
                                      .whole_norm = whole_norm};
    }
    if (status != UZ_OK)
        return status;
    uz_certify_lanes(block->certifier, answers, (int)count, U, P);
    for (int64_t k = 0; k < count; k++) {
        certified[k] = answers[k].certified;
        runs[k].answer.certificate = answers[k].certificate;
    }
    return UZ_OK;
}

uz_status uz_block_solve(uz_block *block, const uz_request *asked, int64_t count, int64_t *failed, uz_error *err)
{
    bool *certified = uz_alloc_zero(count, sizeof *certified);
    *failed = 0;
    if (!certified)
        return uz_no_memory(err, "a block of loads");
    uz_status status = load_all(block, asked, count, failed, err);
    for (int64_t k = 0; status == UZ_OK && k < count; k++) {
        uz_run *run = &block->runs[k];
        *failed = k;
        status = uz_dual_block_open(&run->work.dual, block->loads, k, block->K, run->load.h, err);
        if (status == UZ_OK)
            status = uz_run_start(run, err);
        if (status == UZ_OK)
            status = uz_run_iterate(run, err);
        block->cases[k] = run->work.dual;
        block->r[k] = run->work.it.best_r;
        block->corrected[k] = isfinite(run->work.it.best_bound);
    }
    double start = uz_seconds();
    if (status == UZ_OK)
        status = uz_dual_block_recover(block->loads, block->cases, block->r, block->corrected, count, err);
    for (int64_t first = 0; status == UZ_OK && first < count; first += UZ_LANES)
        status =
            certify_lanes(block, first, count - first < UZ_LANES ? count - first : UZ_LANES, certified + first, err);
    share_time(block, count, uz_seconds() - start, true);
    for (int64_t k = 0; status == UZ_OK && k < count; k++) {
        *failed = k;
        if (!certified[k])
            status = uz_run_certify(&block->runs[k], err);
        if (status == UZ_OK)
            status = uz_run_finish(&block->runs[k], err);
    }
    free(certified);
    return status;
}
