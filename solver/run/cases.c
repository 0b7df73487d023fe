/* cases.c: one body, one or many loads. */
#include "run/grid_sequence.h"
#include "run/block.h"
#include "run/setup_cache.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/method.h"
#include "run/rows.h"
#include "run/semicoercive.h"
#include "run/run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What all cases of a call share. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_hooks *hooks;
    const uz_state *const *starts; /* n, or NULL */
    int64_t n;
    uz_setup *setup; /* borrowed from the cache */
    uz_reuse reused;
    double started, round_started;
    uz_result **results; /* n */
    int64_t *todo;       /* n_todo: the cases of this round; NULL: all n of them */
    int64_t n_todo;
    int64_t *again; /* n: the cases of the next round, n_again of them */
    int64_t n_again, round;
    int64_t kept;         /* rows of the first round */
    uz_candidates wanted; /* rows of the next round, or in NULL */
} batch;

/* The first case of a round carries the cost of the setup; for the others it is there. place: in the round. */
static uz_status open_case(uz_run *run, const batch *b, int64_t place, uz_error *err)
{
    static const uz_reuse everything = {true, true, true, true};
    const int64_t i = b->todo ? b->todo[place] : place;
    uz_status status = uz_run_begin(run, b->problem, b->settings, b->hooks, err);
    run->index = i;
    run->load_case = b->problem->n_cases > 0 ? &b->problem->cases[i] : NULL;
    run->start = b->starts ? b->starts[i] : NULL;
    run->setup = b->setup;
    run->deadline = b->started + b->settings->time_limit_s;
    if (place == 0)
        run->started = b->round_started;
    if (status != UZ_OK)
        return status;
    uz_run_take_setup(run, place > 0 ? everything : b->reused);
    run->serves_many = run->hit || b->n > 1;
    return UZ_OK;
}

/* What the rounds before took of the case's time counts. */
static void count_rounds(const batch *b, const uz_result *before, uz_result *result)
{
    uz_summary *summary = &result->summary;
    summary->rounds = b->round;
    summary->added = summary->kept - b->kept;
    if (!before)
        return;
    uz_timings_add(&summary->timings, &before->summary.timings);
    uz_trade_shift(&result->trade, before->summary.timings.total);
}

/* The case's rows go to those of the next round. */
static uz_status take_wants(batch *b, const uz_run *run, uz_error *err)
{
    if (!run->wants.in)
        return UZ_OK;
    b->again[b->n_again++] = run->index;
    return uz_candidates_add(&b->wanted, &run->wants, err);
}

/* The result goes to its place, or the error is named. */
static uz_status close_case(uz_run *run, batch *b, uz_status status, uz_error *err)
{
    if (status == UZ_OK)
        status = take_wants(b, run, err);
    if (status == UZ_OK) {
        count_rounds(b, b->results[run->index], run->result);
        uz_result_free(b->results[run->index]);
        b->results[run->index] = run->result;
        run->result = NULL;
    } else if (b->problem->n_cases > 0) {
        uz_error_name_case(err, run->index);
    }
    return status;
}

static uz_status solve_one(batch *b, int64_t i, uz_error *err)
{
    uz_run run;
    uz_status status = open_case(&run, b, i, err);
    if (status == UZ_OK)
        status = uz_run_solve(&run, err);
    status = close_case(&run, b, status, err);
    uz_run_end(&run);
    return status;
}

/* How many lanes go through the factor at a time: twice as many as one pass over K certifies, where there are so many
 * cases. */
static int64_t blocks_for(const batch *b)
{
    return b->n > UZ_LANES ? 2 : 1;
}

static uz_status solve_block(batch *b, uz_block *block, int64_t first, int64_t count, uz_error *err)
{
    uz_run *runs = uz_block_runs(block);
    int64_t open = 0, failed = first;
    uz_status status = UZ_OK;
    for (; status == UZ_OK && open < count; open++)
        status = open_case(&runs[open], b, first + open, err);
    if (status == UZ_OK)
        status = uz_block_solve(block, count, &failed, err);
    for (int64_t k = 0; k < open; k++) {
        if (status == UZ_OK)
            status = close_case(&runs[k], b, status, err);
        else if (runs[k].index == failed && b->problem->n_cases > 0)
            uz_error_name_case(err, failed);
        uz_run_end(&runs[k]);
    }
    return status;
}

static uz_status solve_in_blocks(batch *b, int64_t n, uz_error *err)
{
    uz_block *block = NULL;
    int64_t width = blocks_for(b) * UZ_LANES;
    uz_status status = uz_block_create(&block, b->setup, b->problem, blocks_for(b), err);
    for (int64_t i = 0; status == UZ_OK && i < n; i += width)
        status = solve_block(b, block, i, n - i < width ? n - i : width, err);
    uz_block_free(block);
    return status;
}

/* What the results take that this call returns, and while it works the vectors of a block. */
static uz_status check_memory(const batch *b, uz_error *err)
{
    const uz_dual *dual = b->setup->dual;
    const uz_mesh *mesh = &b->setup->model.mesh;
    double nodal = b->setup->is_scene ? (double)(mesh->n_nodes * mesh->dim) : (double)dual->d;
    double lanes = 7.0 * (double)(blocks_for(b) * UZ_LANES) * (double)dual->d;
    double each = (b->setup->is_scene ? 2.0 : 1.0) * nodal + 8.0 * (double)dual->m;
    double bytes = (double)b->setup->bytes + 8.0 * ((double)b->n * each + lanes);
    if (b->n == 1 || b->settings->memory_limit == 0 || bytes <= (double)b->settings->memory_limit)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_LIMIT, "/cases",
                   "the body and the results of %lld load cases take %.0f bytes, %zu are allowed: send fewer cases at "
                   "a time",
                   (long long)b->n, bytes, b->settings->memory_limit);
}

/* Everything that can be refused before anything is computed. */
static uz_status check(const batch *b, uz_error *err)
{
    uz_status status = uz_check_settings(b->settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(b->problem, err);
    if (status == UZ_OK && uz_cancelled(b->hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before it began");
    return status;
}

/* The rows whose reactions the starts know have to be in, so that an answer is a start that takes no iterations. */
static uz_status add_starts(batch *b, uz_error *err)
{
    uz_status status = UZ_OK;
    const int64_t m = b->setup->rows.m;
    for (int64_t i = 0; b->starts && i < b->n && status == UZ_OK; i++)
        if (b->starts[i] && uz_state_check(b->starts[i], m, NULL) == UZ_OK)
            status = uz_candidates_add_start(&b->wanted, b->starts[i], err);
    return status;
}

static uz_status acquire(batch *b, uz_cache *cache, uz_error *err)
{
    uz_status status =
        uz_setup_acquire(&b->setup, &b->reused, cache, b->problem, &b->wanted, b->settings, b->hooks, err);
    if (status != UZ_OK || !b->setup->rows.in || b->round > 1)
        return status;
    status = add_starts(b, err);
    if (status != UZ_OK || uz_candidates_has(&b->setup->rows, &b->wanted))
        return status;
    uz_setup_release(cache, b->setup);
    b->setup = NULL;
    return uz_setup_acquire(&b->setup, &b->reused, cache, b->problem, &b->wanted, b->settings, b->hooks, err);
}

/* The cases of this round, on its rows. */
static uz_status solve_round(batch *b, uz_cache *cache, uz_error *err)
{
    const int64_t n = b->todo ? b->n_todo : b->n;
    b->round_started = b->round == 1 ? b->started : uz_seconds();
    uz_status status = acquire(b, cache, err);
    if (status == UZ_OK)
        status = check_memory(b, err);
    if (status == UZ_OK && b->round == 1)
        b->kept = b->setup->dual->m;
    bool in_blocks = status == UZ_OK && n > 1 && b->setup->dual->can->lanes;
    if (in_blocks)
        status = solve_in_blocks(b, n, err);
    for (int64_t i = 0; status == UZ_OK && !in_blocks && i < n; i++)
        status = solve_one(b, i, err);
    uz_setup_release(cache, b->setup);
    b->setup = NULL;
    return status;
}

/* There are answers with bounds: whoever ends the solve now gets these. */
static bool is_over(const batch *b)
{
    uz_stop stop = {b->hooks, b->started + b->settings->time_limit_s};
    return uz_stop_is_due(&stop);
}

static void end_before_round(batch *b)
{
    for (int64_t k = 0; k < b->n_todo; k++) {
        uz_result *result = b->results[b->todo[k]];
        if (result->summary.rounds == b->round)
            continue; /* it had its turn */
        result->summary.outcome = uz_cancelled(b->hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT;
        uz_explain_outcome(result, UZ_END_TARGET);
    }
}

enum { MAX_ROUNDS = 8 };

/* Rows are only ever added, and after some rounds all of them: the last round leaves none out. */
static void prepare_round(batch *b)
{
    int64_t *done = b->todo;
    b->todo = b->again;
    b->n_todo = b->n_again;
    b->again = done;
    b->n_again = 0;
    b->round++;
    if (b->round < MAX_ROUNDS)
        return;
    memset(b->wanted.in, 1, (size_t)b->wanted.m);
    b->wanted.count = b->wanted.m;
}

static uz_status solve_rounds(batch *b, uz_cache *cache, uz_error *err)
{
    uz_error cut = {0};
    uz_status status = solve_round(b, cache, err);
    while (status == UZ_OK && b->n_again > 0) {
        if (!b->todo && !(b->todo = uz_alloc(b->n, sizeof *b->todo)))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld cases", (long long)b->n);
        prepare_round(b);
        status = is_over(b) ? UZ_ERR_CANCELLED : solve_round(b, cache, &cut);
        if (status == UZ_ERR_CANCELLED) {
            end_before_round(b);
            return UZ_OK;
        }
        if (status != UZ_OK && err)
            *err = cut;
    }
    return status;
}

static uz_status solve_all(batch *b, uz_cache *cache, uz_error *err)
{
    b->started = uz_seconds();
    b->round = 1;
    uz_status status = check(b, err);
    if (status == UZ_OK && !(b->again = uz_alloc(b->n, sizeof *b->again)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld cases", (long long)b->n);
    if (status == UZ_OK)
        status = solve_rounds(b, cache, err);
    free(b->todo);
    free(b->again);
    uz_candidates_clear(&b->wanted);
    return status;
}

uz_status uz_solve_regular(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                           const uz_hooks *hooks, uz_error *err)
{
    uz_result *result = NULL;
    batch b = {.problem = problem, .settings = settings, .hooks = hooks, .n = 1, .results = &result};
    *out = NULL;
    uz_error_reset(err);
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "a problem with load cases is for uz_solve_cases");
    uz_status status = solve_all(&b, cache, err);
    if (status == UZ_OK)
        *out = result;
    else
        uz_result_free(result);
    return status;
}

/* Other refusals are about the body, which all cases share. */
static bool is_about_case(const uz_error *err)
{
    return strcmp(err->where, "p") == 0 || strcmp(err->where, "start") == 0 || strncmp(err->where, "/loads", 6) == 0;
}

/* A body that the ordinary way refused had no iteration to go on from a start; it is checked all the same. */
static uz_status check_start(const batch *b, int64_t i, uz_error *err)
{
    int64_t m = b->problem->qp.N.rows, n_nodes;
    int dim;
    uz_error own = {0};
    uz_status status = UZ_OK;
    if (!b->starts || !b->starts[i])
        return UZ_OK;
    if (b->problem->kind == UZ_PROBLEM_SCENE)
        status = uz_scene_sizes(&dim, &n_nodes, &m, &b->problem->scene, &own);
    if (status == UZ_OK)
        status = uz_state_check(b->starts[i], m, &own);
    if (status != UZ_OK && err)
        *err = own; /* in place of the refusal */
    return status;
}

/* Cases that the ordinary way refused or could not certify, because only the obstacle holds the body: each by itself.
 */
static uz_status solve_held_by_obstacle(batch *b, uz_cache *cache, uz_status refused, uz_error *err)
{
    uz_status status = refused;
    for (int64_t i = 0; i < b->n; i++) {
        uz_problem one = uz_problem_of_case(b->problem, i);
        if (!uz_may_be_semicoercive(refused, b->results[i], &one, b->settings))
            continue;
        if (b->hooks && b->hooks->begins)
            b->hooks->begins(b->hooks->ctx, i);
        status = check_start(b, i, err);
        if (status == UZ_OK)
            status =
                uz_solve_semicoercive(&b->results[i], &one, b->settings, cache, b->hooks, refused, b->started, err);
        if (status == UZ_OK)
            continue;
        if (b->problem->n_cases > 0 && err && is_about_case(err))
            uz_error_name_case(err, i);
        return status;
    }
    return status;
}

uz_status uz_solve_on_mesh(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                           const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    batch b = {.problem = problem, .settings = settings, .hooks = hooks, .starts = starts, .n = n};
    *out = NULL;
    uz_error_reset(err);
    b.results = uz_alloc_zero(n, sizeof(uz_result *));
    if (!b.results)
        return uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for the results of %lld cases", (long long)n);
    uz_status status = solve_all(&b, cache, err);
    status = solve_held_by_obstacle(&b, cache, status, err);
    if (status == UZ_OK)
        *out = b.results;
    else
        uz_results_free(b.results, n);
    return status;
}

uz_status uz_solve_cases(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    if (uz_cells_are_chosen(problem))
        return uz_solve_ladder(out, problem, settings, starts, cache, hooks, err);
    return uz_solve_on_mesh(out, problem, settings, starts, cache, hooks, err);
}

uz_status uz_solve(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                   const uz_hooks *hooks, uz_error *err)
{
    uz_result **results = NULL;
    *out = NULL;
    uz_error_reset(err);
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "a problem with load cases is for uz_solve_cases");
    uz_status status = uz_solve_cases(&results, problem, settings, NULL, cache, hooks, err);
    if (status == UZ_OK)
        *out = results[0];
    free(results);
    return status;
}
