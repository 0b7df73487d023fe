/* run.c: timed solves. */
#include "core/clock.h"
#include "figures/figures.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

static double thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

typedef struct {
    double cpu_end, wall_end;
    bool told;
} figure_clock;

/* A thread's clock costs a system call, as much as an iteration on a small body: it is asked once the wall's has run
 * out, which is never later. */
static bool past(void *ctx)
{
    figure_clock *clock = ctx;
    if (!clock->told && uz_seconds() > clock->wall_end)
        clock->told = thread_seconds() > clock->cpu_end;
    return clock->told;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static figure_spread spread_of(double *samples, int count)
{
    qsort(samples, (size_t)count, sizeof *samples, compare);
    double middle = count % 2 ? samples[count / 2] : 0.5 * (samples[count / 2 - 1] + samples[count / 2]);
    return (figure_spread){middle, samples[0], samples[count - 1]};
}

/* So that short runs are not one sample of the machine's mood, and long ones don't take all evening. */
static int runs_for(double seconds)
{
    return seconds < 5e-3 ? FIGURE_RUNS_MOST : seconds < 0.03 ? 5 : seconds < 0.25 ? 3 : 1;
}

static void solve_once(figure_run *run, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                       double limit, double *cpu, double *wall)
{
    figure_clock clock = {.cpu_end = thread_seconds() + limit, .wall_end = uz_seconds() + limit};
    const uz_hooks hooks = {.ctx = &clock, .cancelled = past};
    uz_result_free(run->result);
    figure_count_from_zero();
    const double start = uz_seconds(), begin = thread_seconds();
    run->status = uz_solve(&run->result, problem, settings, cache, &hooks, &run->err);
    *cpu = thread_seconds() - begin;
    *wall = uz_seconds() - start;
    run->work = figure_counted();
    /* by the paper's rule an answer may be called converged that the rule had not yet ended */
    const bool met = run->result && run->result->summary.outcome == UZ_CONVERGED;
    run->limited = clock.told && !(met && settings->stopping == UZ_STOP_CERTIFIED);
}

void figure_solve(figure_run *run, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                  double limit, int runs)
{
    double cpu[FIGURE_RUNS_MOST], wall[FIGURE_RUNS_MOST];
    int count = 0, wanted = runs;
    *run = (figure_run){.status = UZ_OK};
    do {
        solve_once(run, problem, settings, cache, limit, &cpu[count], &wall[count]);
        count++;
        if (wanted == 0)
            wanted = runs_for(cpu[0]);
    } while (count < wanted && count < FIGURE_RUNS_MOST && run->status == UZ_OK && !run->limited);
    run->runs = count;
    run->cpu = spread_of(cpu, count);
    run->wall = spread_of(wall, count);
}

static void write_spread(json *out, const char *name, figure_spread spread)
{
    char key[32];
    snprintf(key, sizeof key, "%s_s", name);
    json_number(out, key, spread.median);
    snprintf(key, sizeof key, "%s_min_s", name);
    json_number(out, key, spread.min);
    snprintf(key, sizeof key, "%s_max_s", name);
    json_number(out, key, spread.max);
}

void figure_write_times(json *out, const figure_run *run)
{
    json_integer(out, "runs", run->runs);
    write_spread(out, "cpu", run->cpu);
    write_spread(out, "wall", run->wall);
}
