/* rounds.c: all loads of a call on one setup, in rounds of contact rows.
 *
 *     rows -> setup -> loads in blocks, or one by one -> rows that the next round has to have as well
 *
 * Where contact rows are left out, an answer may turn out to need more of them; such loads go on together on a setup
 * with the rows that any of them wants. */
#include "run/solve.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "linalg/blas.h"
#include "run/block.h"
#include "run/nearby.h"
#include "run/problem.h"
#include "run/results.h"
#include "run/rows.h"
#include "run/run.h"
#include "run/settings.h"
#include "run/setup_cache.h"
#include "run/transfer.h"

#include <stdlib.h>
#include <string.h>

/* What all loads of a call share. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_state *const *starts; /* n, or NULL */
    uz_cache *cache;
    const uz_hooks *hooks;
    int64_t n;
    int64_t blocks; /* of UZ_LANES that go through the factor at a time: two, where there are so many cases */
    double started;
    uz_result **results; /* n */
    uz_setup *setup;     /* of this round; borrowed from the cache */
    uz_reuse reused;
    double round_started;
    int64_t round;         /* from 1 */
    int64_t *todo, *again; /* n: the cases of this round and of the next, in order */
    int64_t n_todo, n_again;
    int64_t kept;         /* rows of the first round */
    uz_candidates wanted; /* rows of the next round, or in NULL */
    uz_state *carried;    /* the start of the one case; NULL: those of `starts` */
    uz_nearby *nearby;    /* which cases have loads near to each other; NULL: it does not matter */
} batch;

static uz_status reacquire_for_starts(batch *b, uz_error *err);
static uz_status check_memory(const batch *b, uz_error *err);
static uz_status solve_in_blocks(batch *b, uz_error *err);
static uz_request request_of(const batch *b, int64_t place, bool in_block);
static void begin_near(uz_run *run, const batch *b);
static uz_status close_case(uz_run *run, batch *b, uz_status status, uz_error *err);
static void prepare_round(batch *b);

uz_status uz_solve_rounds(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, const uz_result *near, uz_cache *cache, const uz_hooks *hooks,
                          uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    batch b = {problem, settings, starts, cache, hooks, n, .blocks = n > UZ_LANES ? 2 : 1};
    b.started = uz_seconds();
    b.results = results;
    b.round = 1;
    const uz_stop stop = {hooks, b.started + settings->time_limit_s};
    uz_error own = {0};
    b.round_started = b.started;
    uz_status status = uz_check_settings(settings, &own);
    if (status == UZ_OK)
        status = uz_check_problem(problem, &own);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(&own, UZ_ERR_CANCELLED, "", "cancelled before it began");
    if (status == UZ_OK && !((b.todo = uz_alloc(n, sizeof *b.todo)) && (b.again = uz_alloc(n, sizeof *b.again))))
        status = uz_fail(&own, UZ_ERR_MEMORY, "", "no memory for %lld cases", (long long)n);
    for (; status == UZ_OK && b.n_todo < n; b.n_todo++)
        b.todo[b.n_todo] = b.n_todo;
    while (status == UZ_OK && b.n_todo > 0) {
        status = uz_setup_acquire(&b.setup, &b.reused, cache, problem, &b.wanted, settings, hooks, &own);
        if (status == UZ_OK && b.round == 1 && b.setup->rows.in)
            status = reacquire_for_starts(&b, &own);
        if (status == UZ_OK && b.round == 1 && near)
            status = uz_carry_start(&b.carried, near, &b.setup->model.info,
                                    b.setup->rows.in ? b.setup->rows.m : b.setup->dual->m, false, &own);
        if (status == UZ_OK)
            status = check_memory(&b, &own);
        if (status == UZ_OK && b.round == 1)
            b.kept = b.setup->dual->m;
        const bool block = status == UZ_OK && b.n_todo > 1 && b.setup->dual->can->lanes;
        if (block)
            status = solve_in_blocks(&b, &own);
        else if (status == UZ_OK && n > 1 && !b.nearby && b.setup->dual->can->begin_near)
            b.nearby = uz_nearby_new(n, b.setup->dual->d, uz_setup_all_rows(b.setup, problem)->rows);
        for (int64_t place = 0; status == UZ_OK && !block && place < b.n_todo; place++) {
            const uz_request asked = request_of(&b, place, false);
            uz_run run;
            status = uz_run_begin(&run, &asked, &own);
            if (status == UZ_OK)
                status = uz_run_load(&run, &own);
            if (status == UZ_OK)
                begin_near(&run, &b);
            if (status == UZ_OK)
                status = uz_run_start(&run, &own);
            if (status == UZ_OK)
                status = uz_run_iterate(&run, &own);
            bool solved = false;
            if (status == UZ_OK && settings->step)
                status = uz_run_hand_over(&run, &solved, &own);
            if (status == UZ_OK && !solved)
                status = uz_run_certify(&run, &own);
            if (status == UZ_OK && !solved)
                status = uz_run_finish(&run, &own);
            status = close_case(&run, &b, status, &own);
            uz_run_end(&run);
        }
        uz_setup_release(cache, b.setup);
        b.setup = NULL;
        if (status == UZ_OK)
            prepare_round(&b);
        const bool next = status == UZ_OK && b.n_todo > 0;
        if (b.round > 1 && (status == UZ_ERR_CANCELLED || (next && uz_stop_is_due(&stop)))) {
            status = UZ_OK; /* there are answers with bounds: whoever ends the solve now gets these */
            for (; b.n_todo > 0; b.n_todo--) {
                uz_result *result = results[b.todo[b.n_todo - 1]];
                if (result->summary.rounds == b.round)
                    continue; /* it had its turn */
                result->summary.outcome = uz_cancelled(hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT;
                uz_explain_outcome(result, UZ_END_TARGET);
            }
        }
    }
    if (status != UZ_OK && err)
        *err = own;
    uz_free_all(b.todo, b.again);
    uz_candidates_clear(&b.wanted);
    uz_nearby_free(b.nearby);
    uz_state_free(b.carried);
    return status;
}

/* The rows whose reactions the starts know have to be in, so that an answer is a start that takes no iterations. */
static uz_status reacquire_for_starts(batch *b, uz_error *err)
{
    uz_status status = UZ_OK;
    const int64_t m = b->setup->rows.m;
    for (int64_t i = 0; b->starts && i < b->n && status == UZ_OK; i++)
        if (b->starts[i] && uz_state_check(b->starts[i], m, NULL) == UZ_OK)
            status = uz_candidates_add_start(&b->wanted, b->starts[i], err);
    if (status != UZ_OK || uz_candidates_has(&b->setup->rows, &b->wanted))
        return status;
    uz_setup_release(b->cache, b->setup);
    b->setup = NULL;
    return uz_setup_acquire(&b->setup, &b->reused, b->cache, b->problem, &b->wanted, b->settings, b->hooks, err);
}

/* What the results take that this call returns, and while it works the vectors of a block. */
static uz_status check_memory(const batch *b, uz_error *err)
{
    const uz_setup *setup = b->setup;
    const uz_dual *dual = setup->dual;
    const uz_mesh *mesh = &setup->model.mesh;
    double nodal = setup->is_scene ? (double)(mesh->n_nodes * mesh->dim) : (double)dual->d;
    double lanes = 7.0 * (double)(b->blocks * UZ_LANES) * (double)dual->d;
    double each = (setup->is_scene ? 2.0 : 1.0) * nodal + 8.0 * (double)dual->m;
    double bytes = (double)setup->bytes + 8.0 * ((double)b->n * each + lanes);
    if (b->n == 1 || b->settings->memory_limit == 0 || bytes <= (double)b->settings->memory_limit)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_LIMIT, "/cases",
                   "the body and the results of %lld load cases take %.0f bytes, %zu are allowed: send fewer cases at "
                   "a time",
                   (long long)b->n, bytes, b->settings->memory_limit);
}

/* The first case of a round carries the cost of the setup; for the others it is there. place: in the round. */
static uz_request request_of(const batch *b, int64_t place, bool in_block)
{
    static const uz_reuse everything = {true, true, true, true};
    const int64_t i = b->todo[place];
    const uz_reuse reused = place > 0 ? everything : b->reused;
    return (uz_request){
        .problem = b->problem,
        .settings = b->settings,
        .hooks = b->hooks,
        .index = i,
        .start = b->starts ? b->starts[i] : b->carried,
        .guessed = b->carried != NULL,
        .setup = b->setup,
        .reused = reused,
        .in_block = in_block,
        .started = place == 0 ? b->round_started : uz_seconds(),
        .deadline = b->started + b->settings->time_limit_s,
    };
}

static uz_status solve_in_blocks(batch *b, uz_error *err)
{
    uz_block *block = NULL;
    uz_run *runs = NULL;
    const int64_t width = b->blocks * UZ_LANES;
    uz_request *asked = uz_alloc_zero(width, sizeof *asked);
    uz_status status = asked ? UZ_OK : uz_no_memory(err, "a block of loads");
    if (status == UZ_OK)
        status = uz_block_create(&block, &runs, b->setup, b->problem, b->blocks, err);
    for (int64_t first = 0; status == UZ_OK && first < b->n_todo; first += width) {
        const int64_t count = b->n_todo - first < width ? b->n_todo - first : width;
        int64_t failed = 0;
        for (int64_t k = 0; k < count; k++)
            asked[k] = request_of(b, first + k, true);
        status = uz_block_solve(block, asked, count, &failed, err);
        if (status != UZ_OK && b->problem->n_cases > 0)
            uz_error_name_case(err, b->problem, asked[failed].index);
        for (int64_t k = 0; k < count; k++) {
            if (status == UZ_OK)
                status = close_case(&runs[k], b, status, err);
            uz_run_end(&runs[k]);
        }
    }
    uz_block_free(block);
    free(asked);
    return status;
}

/* What a start may be off by, of the load. Elsewhere there is nothing but the body without its rows; a box has coarser
 * grids, whose answer is off by a tenth in the body and by a node in what touches: of 50 loads on a cube a limit of 0.1
 * takes 8 % more cycles than no such start, and 0.01 6 % less with what it spares on these grids. */
#define NEAR          0.1
#define NEAR_ON_GRIDS 0.01

/* run->near, from answers to cases whose loads are near; without memory, or where there are none, it is left NULL. */
static void begin_near(uz_run *run, const batch *b)
{
    const uz_setup *setup = run->asked->setup;
    const uz_candidates *rows = &setup->rows;
    uz_nearby_sum sum;
    if (!b->nearby || run->load.exponent != 0)
        return;
    uz_nearby_place(b->nearby, run->asked->index, run->load.p, run->load.h_all);
    const double near = setup->model.brick ? NEAR_ON_GRIDS : NEAR;
    /* without forces the answer may be 0, which no sum comes near enough to be told from */
    if (run->asked->start || uz_norm(run->d, run->load.p) == 0.0 ||
        !uz_nearby_find(&sum, b->nearby, run->asked->index, near))
        return;
    double *u = uz_alloc_zero(run->d + run->m, sizeof *u), *one = uz_alloc(run->d + run->m, sizeof *one);
    for (int k = 0; u && one && k < sum.count; k++) {
        const uz_result *result = b->results[sum.of[k]];
        if (!result->u) /* a later round has found a ray */
            continue;
        if (setup->is_scene)
            uz_restrict_nodal(one, &setup->model, result->u);
        else
            memcpy(one, result->u, (size_t)run->d * sizeof *one);
        if (rows->in)
            uz_candidates_gather(one + run->d, result->r, rows);
        else if (run->m > 0)
            memcpy(one + run->d, result->r, (size_t)run->m * sizeof *one);
        uz_axpy(run->d + run->m, sum.share[k], one, u);
    }
    for (int64_t i = 0; u && i < run->m; i++)
        u[run->d + i] /= setup->dual->row_scale[i];
    if (one)
        run->near = u;
    else
        free(u);
    free(one);
}

/* The result goes to its place and the case's rows to those of the next round, or the error is named. */
static uz_status close_case(uz_run *run, batch *b, uz_status status, uz_error *err)
{
    const int64_t i = run->asked->index;
    if (status == UZ_OK && run->wants.in) {
        b->again[b->n_again++] = i;
        status = uz_candidates_add(&b->wanted, &run->wants, err);
    }
    if (status == UZ_OK) {
        uz_result *before = b->results[i], *result = run->result;
        result->summary.rounds = b->round;
        result->summary.added = result->summary.kept - b->kept;
        if (before) { /* what the rounds before took of the case's time counts */
            uz_timings_add(&result->summary.timings, &before->summary.timings);
            uz_trade_shift(&result->trade, before->summary.timings.total);
        }
        uz_result_free(before);
        b->results[i] = result;
        run->result = NULL;
        if (b->nearby && run->load.exponent == 0 && result->summary.outcome == UZ_CONVERGED)
            uz_nearby_answered(b->nearby, i);
    } else if (b->problem->n_cases > 0) {
        uz_error_name_case(err, b->problem, i);
    }
    return status;
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
    b->round_started = uz_seconds();
    if (b->round < MAX_ROUNDS || b->n_todo == 0)
        return;
    memset(b->wanted.in, 1, (size_t)b->wanted.m);
    b->wanted.count = b->wanted.m;
}
