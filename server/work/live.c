#include "work/live.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PROGRESS_CLAIMED = 1, PROGRESS_READ = 5, PROGRESS_FIRST_ROW = 10, PROGRESS_LAST_ROW = 95 };

/* Where a solve to rounding level, or to a share of a mesh error that nobody knows beforehand, is taken to end. */
#define TARGET_ROUNDING 1e-14
#define TARGET_BALANCED 1e-3

void live_reset(live *l)
{
    double(*rows)[CODEC_HISTORY_COLUMNS] = l->rows;
    *l = (live){.rows = rows, .stride = 1, .progress = PROGRESS_CLAIMED};
}

void live_clear(live *l)
{
    free(l->rows);
    *l = (live){0};
}

void live_begin(live *l, const uz_settings *settings, const uz_problem *problem)
{
    l->problem = problem;
    l->paper = settings->stopping == UZ_STOP_PAPER;
    l->max_iterations = settings->max_iterations;
    if (l->paper)
        l->target = settings->epsilon;
    else if (settings->balanced)
        l->target = TARGET_BALANCED;
    else
        l->target = settings->relative_error > TARGET_ROUNDING ? settings->relative_error : TARGET_ROUNDING;
    l->progress = PROGRESS_READ;
}

void live_case(live *l, int64_t i)
{
    l->count = 0;
    l->stride = 1;
    l->any = false;
    l->first = 0.0;
    l->current = i;
}

void live_part(live *l, double from, double to)
{
    live_case(l, 0);
    l->from = from;
    l->to = to;
}

/* ||u||_K is near sqrt(2 |psi|): equal where every gap that closes was 0. */
static double measure(const live *l, const uz_history_row *row)
{
    double scale = sqrt(2.0 * fabs(row->dual_objective));
    return l->paper ? row->step_norm : scale > 0.0 ? row->error_bound / scale : INFINITY;
}

void live_add(live *l, const uz_history_row *row)
{
    l->latest = *row;
    l->any = true;
    if (l->first == 0.0) {
        double value = measure(l, row);
        l->first = isfinite(value) && value > 0.0 ? value : 0.0;
    }
    if (!l->rows)
        l->rows = malloc(LIVE_ROWS * sizeof l->rows[0]);
    if (!l->rows || row->iteration % l->stride != 0) /* without room only the latest row is shown */
        return;
    if (l->count == LIVE_ROWS) { /* every other row goes */
        l->count = 0;
        l->stride *= 2;
        for (int64_t i = 0; i < LIVE_ROWS; i += 2)
            memmove(l->rows[l->count++], l->rows[i], sizeof l->rows[i]);
    }
    codec_history_row(l->rows[l->count++], row);
}

int live_progress(live *l)
{
    const bool whole = !(l->to > 0.0);
    if (l->any || l->current > 0 || !whole) {
        double done = 0.0; /* share of this case's iterations, by their number and by the error, whichever is more */
        if (l->any) {
            const double by_count = l->max_iterations > 0 ? (double)l->latest.iteration / (double)l->max_iterations : 0;
            const double value = measure(l, &l->latest);
            double by_error = 0.0;
            if (l->first > 0.0 && value > 0.0 && isfinite(value) && l->target > 0.0 && l->first > l->target)
                by_error = log(l->first / value) / log(l->first / l->target);
            done = fmin(1.0, fmax(0.0, fmax(by_count, by_error)));
        }
        const double n = l->problem && l->problem->n_cases > 0 ? (double)l->problem->n_cases : 1.0;
        double share = fmin(1.0, ((double)l->current + done) / n);
        if (!whole)
            share = l->from + (l->to - l->from) * share;
        int now = PROGRESS_FIRST_ROW + (int)((PROGRESS_LAST_ROW - PROGRESS_FIRST_ROW) * share);
        l->progress = now > l->progress ? now : l->progress;
    }
    return l->progress;
}

bool live_rows(const live *l, int64_t after, double **rows, int64_t *count)
{
    int64_t first = 0;
    *rows = NULL;
    *count = 0;
    while (first < l->count && !(l->rows[first][0] > (double)after))
        first++;
    double(*out)[CODEC_HISTORY_COLUMNS] = malloc((size_t)(l->count - first + 1) * sizeof *out);
    if (!out)
        return false;
    int64_t n = l->count - first;
    if (n > 0)
        memcpy(out, l->rows[first], (size_t)n * sizeof *out);
    bool is_kept = l->count > 0 && l->rows[l->count - 1][0] >= (double)l->latest.iteration;
    if (l->any && !is_kept && l->latest.iteration > after)
        codec_history_row(out[n++], &l->latest);
    *rows = &out[0][0];
    *count = n;
    return true;
}
