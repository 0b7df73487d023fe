/* What is shown of a running solve: bounded rows that ascend and end with the newest, and progress that only grows. */
#include "harness.h"
#include "work/live.h"

static uz_history_row row_at(int64_t iteration, double bound)
{
    uz_history_row row = {.iteration = iteration, .dual_objective = -0.5, .error_bound = bound, .step_norm = bound};
    return row;
}

static uz_settings settings_for(double relative_error)
{
    uz_settings settings = {.stopping = UZ_STOP_CERTIFIED, .relative_error = relative_error};
    settings.max_iterations = 100000000;
    return settings;
}

static live shared;

static void begin(live_writer *w, double relative_error)
{
    uz_settings settings = settings_for(relative_error);
    live_reset(&shared);
    CHECK_INT(live_progress(&shared, 0), 1);
    live_begin(w, &shared, &settings, NULL);
    CHECK_INT(live_progress(&shared, 0), 5);
}

static void check_rows(const live *l, int64_t after, int64_t newest)
{
    double *rows = NULL;
    int64_t count = 0, bad = 0;
    CHECK(live_rows(l, after, &rows, &count));
    CHECK(count >= 1 && count <= LIVE_ROWS + 1);
    for (int64_t i = 0; i < count; i++)
        bad += !(rows[i * CODEC_HISTORY_COLUMNS] > (i ? rows[(i - 1) * CODEC_HISTORY_COLUMNS] : (double)after));
    CHECK_INT(bad, 0);
    if (count > 0)
        CHECK_INT(rows[(count - 1) * CODEC_HISTORY_COLUMNS], newest);
    free(rows);
}

TEST(a_long_history_is_thinned_evenly)
{
    live_writer w;
    double *rows = NULL;
    int64_t count = 0;
    begin(&w, 1e-8);
    for (int64_t i = 0; i <= 1000001; i++) {
        uz_history_row row = row_at(i, 1.0);
        live_add(&w, &row);
        if (i == 3 || i == LIVE_ROWS - 1 || i == LIVE_ROWS || i == LIVE_ROWS + 1 || i == 1000001)
            check_rows(&shared, -1, i);
    }
    check_rows(&shared, 600000, 1000001);
    CHECK(live_rows(&shared, -1, &rows, &count));
    CHECK(count >= LIVE_ROWS / 2 && rows[0] == 0.0);
    double step = rows[CODEC_HISTORY_COLUMNS] - rows[0];
    for (int64_t i = 1; i + 1 < count; i++)
        CHECK(rows[i * CODEC_HISTORY_COLUMNS] - rows[(i - 1) * CODEC_HISTORY_COLUMNS] == step);
    free(rows);
    CHECK(live_rows(&shared, 1000001, &rows, &count));
    CHECK_INT(count, 0);
    free(rows);
}

TEST(nothing_to_show_yet)
{
    live_writer w;
    double *rows = NULL;
    int64_t count = -1;
    begin(&w, 1e-8);
    CHECK(live_rows(&shared, -1, &rows, &count));
    CHECK_INT(count, 0);
    free(rows);
}

TEST(progress_follows_the_error_and_never_falls)
{
    live_writer w;
    int last = 0, halfway = 0;
    begin(&w, 1e-8);
    for (int64_t i = 0; i <= 80; i++) { /* ten iterations for each digit, with a setback in between */
        double bound = i % 10 == 9 ? 1.0 : pow(10.0, -0.1 * (double)i);
        uz_history_row row = row_at(i, i < 3 ? INFINITY : bound);
        live_add(&w, &row);
        int now = live_progress(&shared, last);
        CHECK(now >= last && now <= 95);
        last = now;
        halfway = i == 41 ? now : halfway;
    }
    CHECK_MSG(halfway > 45 && halfway < 60, "progress %d at half of the digits", halfway);
    CHECK_INT(last, 95);
    live_reset(&shared);
    CHECK_INT(live_progress(&shared, 0), 1);
}

TEST(progress_by_iterations_and_by_the_step)
{
    live_writer w;
    uz_settings settings = settings_for(1e-8);
    begin(&w, 1e-8);
    settings.max_iterations = 100;
    live_begin(&w, &shared, &settings, NULL);
    uz_history_row row = row_at(50, INFINITY);
    live_add(&w, &row);
    CHECK_INT(live_progress(&shared, 0), 52);
    live_reset(&shared);
    settings.stopping = UZ_STOP_PAPER;
    settings.epsilon = 1e-6;
    settings.max_iterations = 0;
    live_begin(&w, &shared, &settings, NULL);
    row = row_at(0, 0.0); /* the first step has no length */
    live_add(&w, &row);
    row = row_at(1, 1.0);
    live_add(&w, &row);
    CHECK_INT(live_progress(&shared, 0), 10);
    row = row_at(2, 1e-3);
    live_add(&w, &row);
    CHECK_INT(live_progress(&shared, 0), 52);
    row = row_at(3, NAN);
    live_add(&w, &row);
    CHECK_INT(live_progress(&shared, 52), 52);
}
