#include "work/live.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PROGRESS_CLAIMED = 1, PROGRESS_READ = 5, PROGRESS_FIRST_ROW = 10, PROGRESS_LAST_ROW = 95 };

/* Where a solve to rounding level, or to a share of a mesh error that nobody knows beforehand, is taken to end. */
#define TARGET_ROUNDING 1e-14
#define TARGET_BALANCED 1e-3

#define TRIES 1000 /* of a reader; a change takes nanoseconds, thinning out the rows some ten microseconds */

_Static_assert(sizeof(live_state) == 8 * LIVE_WORDS && sizeof(double) == 8, "a state is words");

/* ---- the writer */

/* Each store is a release, so that none is seen before those that precede it. */
static void publish(live *l, const live_state *state)
{
    uint64_t words[LIVE_WORDS];
    const uint64_t turn = atomic_load_explicit(&l->turn, memory_order_relaxed) | 1; /* who wrote may have been killed */
    memcpy(words, state, sizeof words);
    atomic_store_explicit(&l->turn, turn, memory_order_relaxed);
    for (int i = 0; i < LIVE_WORDS; i++)
        atomic_store_explicit(&l->words[i], words[i], memory_order_release);
    atomic_store_explicit(&l->turn, turn + 1, memory_order_release);
}

void live_begin(live_writer *w, live *shared, const uz_settings *settings, const uz_problem *problem)
{
    *w = (live_writer){.shared = shared, .paper = settings->stopping == UZ_STOP_PAPER};
    w->state = (live_state){.read = 1, .stride = 1, .max_iterations = settings->max_iterations};
    w->state.n_cases = problem ? problem->n_cases : 0;
    if (w->paper)
        w->state.target = settings->epsilon;
    else if (settings->balanced)
        w->state.target = TARGET_BALANCED;
    else
        w->state.target = settings->relative_error > TARGET_ROUNDING ? settings->relative_error : TARGET_ROUNDING;
    publish(shared, &w->state);
}

void live_restart(live_writer *w, int64_t current, double from, double to)
{
    live_state *s = &w->state;
    s->thinned += 2; /* rows that a reader has copied are of something else now */
    s->count = 0;
    s->stride = 1;
    s->any = 0;
    s->first = 0.0;
    s->current = current;
    s->from = from;
    s->to = to;
    publish(w->shared, s);
}

void live_grid(live_writer *w, const uz_grid_start *grid, double now)
{
    live_state *s = &w->state;
    s->grid = grid->number;
    s->unknowns = grid->unknowns;
    s->grid_error = grid->error;
    s->grid_asked = grid->asked;
    s->ends = now + grid->seconds_left;
    live_restart(w, 0, grid->from, grid->to);
}

void live_add(live_writer *w, const uz_history_row *row)
{
    live *l = w->shared;
    live_state *s = &w->state;
    /* ||u||_K is near sqrt(2 |psi|): equal where every gap that closes was 0. */
    const double scale = sqrt(2.0 * fabs(row->dual_objective));
    s->value = w->paper ? row->step_norm : scale > 0.0 ? row->error_bound / scale : INFINITY;
    if (s->first == 0.0)
        s->first = isfinite(s->value) && s->value > 0.0 ? s->value : 0.0;
    codec_history_row(s->latest, row);
    s->any = 1;
    if (row->iteration % s->stride == 0) {
        if (s->count == LIVE_ROWS) { /* every other row goes */
            s->thinned++;
            publish(l, s);
            s->count = 0;
            s->stride *= 2;
            for (int64_t i = 0; i < LIVE_ROWS; i += 2, s->count++)
                for (int k = 0; k < CODEC_HISTORY_COLUMNS; k++)
                    atomic_store_explicit(&l->rows[s->count][k],
                                          atomic_load_explicit(&l->rows[i][k], memory_order_relaxed),
                                          memory_order_release);
            s->thinned++;
        }
        for (int k = 0; k < CODEC_HISTORY_COLUMNS; k++) {
            uint64_t bits;
            memcpy(&bits, &s->latest[k], 8);
            atomic_store_explicit(&l->rows[s->count][k], bits, memory_order_release);
        }
        s->count++;
    }
    publish(l, s);
}

/* ---- readers */

void live_reset(live *l)
{
    publish(l, &(live_state){.stride = 1});
}

live_state live_read(const live *l)
{
    uint64_t words[LIVE_WORDS];
    live_state state;
    for (int tries = 0; tries < TRIES; tries++) {
        const uint64_t before = atomic_load_explicit(&l->turn, memory_order_acquire);
        for (int i = 0; i < LIVE_WORDS; i++)
            words[i] = atomic_load_explicit(&l->words[i], memory_order_acquire);
        if (before % 2 == 0 && atomic_load_explicit(&l->turn, memory_order_relaxed) == before)
            break;
    }
    memcpy(&state, words, sizeof state);
    if (state.count < 0 || state.count > LIVE_ROWS) /* nothing that comes from there is trusted to be an index */
        state.count = 0;
    return state;
}

int live_progress(const live *l, int before)
{
    const live_state s = live_read(l);
    const bool whole = !(s.to > 0.0);
    int now = s.read ? PROGRESS_READ : PROGRESS_CLAIMED;
    if (s.any || s.current > 0 || !whole) {
        double done = 0.0; /* share of this case's iterations, by their number and by the error, whichever is more */
        if (s.any) {
            const double by_count = s.max_iterations > 0 ? s.latest[0] / (double)s.max_iterations : 0;
            double by_error = 0.0;
            if (s.first > 0.0 && s.value > 0.0 && isfinite(s.value) && s.target > 0.0 && s.first > s.target)
                by_error = log(s.first / s.value) / log(s.first / s.target);
            done = fmin(1.0, fmax(0.0, fmax(by_count, by_error)));
        }
        double share = ((double)s.current + done) / (s.n_cases > 0 ? (double)s.n_cases : 1.0);
        share = fmin(1.0, fmax(0.0, share));
        if (!whole)
            share = fmin(1.0, fmax(0.0, s.from + (s.to - s.from) * share));
        now = PROGRESS_FIRST_ROW + (int)((PROGRESS_LAST_ROW - PROGRESS_FIRST_ROW) * share);
    }
    return now > before ? now : before;
}

job_grid live_job_grid(const live *l, double now)
{
    const live_state s = live_read(l);
    const double left = s.ends - now;
    /* what has taken longer than was expected has told that the expectation was wrong */
    return (job_grid){s.grid > 0 ? s.grid : 0, s.unknowns, s.grid_error, s.grid_asked, left > 0.0 ? left : (double)NAN};
}

bool live_rows(const live *l, int64_t after, double **rows, int64_t *count)
{
    double(*out)[CODEC_HISTORY_COLUMNS] = malloc((LIVE_ROWS + 1) * sizeof *out);
    live_state s = live_read(l);
    int64_t n = 0, first = 0;
    *rows = NULL;
    *count = 0;
    if (!out)
        return false;
    for (int tries = 0; tries < TRIES; tries++) {
        const live_state now = s;
        for (int64_t i = 0; i < now.count; i++)
            for (int k = 0; k < CODEC_HISTORY_COLUMNS; k++) {
                const uint64_t bits = atomic_load_explicit(&l->rows[i][k], memory_order_acquire);
                memcpy(&out[i][k], &bits, 8);
            }
        n = now.count;
        s = live_read(l); /* rows that came in meanwhile do not matter, that others moved does */
        if (now.thinned % 2 == 0 && s.thinned == now.thinned) {
            s = now;
            break;
        }
    }
    while (first < n && !(out[first][0] > (double)after))
        first++;
    n -= first;
    memmove(out, out[first], (size_t)n * sizeof *out);
    const bool is_kept = n > 0 && out[n - 1][0] >= s.latest[0];
    if (s.any && !is_kept && s.latest[0] > (double)after)
        memcpy(out[n++], s.latest, sizeof *out);
    *rows = &out[0][0];
    *count = n;
    return true;
}
