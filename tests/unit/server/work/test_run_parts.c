/* What the workers make of results: states as vectors, what many cases come to, what is live. */
#include "harness.h"
#include "work/live.h"
#include "work/overall.h"
#include "work/state.h"

/* ---- state */

enum { M = 3 };

static uz_state full_state(double vectors[6][M])
{
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < M; i++)
            vectors[k][i] = 0.1 + 10.0 * k + i;
    return (uz_state){.m = M,
                      .r = vectors[0],
                      .rho = vectors[1],
                      .Dr = vectors[2],
                      .Drho = vectors[3],
                      .best_r = vectors[4],
                      .anchor = vectors[5],
                      .alpha = 1.0 / 3.0,
                      .as_given = true,
                      .tau = 2.5,
                      .step_norm = NAN,
                      .best_bound = INFINITY,
                      .best_relative = 1e-300,
                      .iteration = 9007199254740991,
                      .restarts = 2,
                      .next_check = 3,
                      .best_iteration = 4,
                      .phase_end = 5,
                      .phase = 1,
                      .method = UZ_METHOD_AUTO,
                      .made_by = UZ_METHOD_ACTIVE_SET};
}

TEST(states_come_back_bit_for_bit)
{
    double vectors[6][M];
    uz_state s = full_state(vectors);
    int64_t count = 0;
    double *x = state_pack(&s, &count);
    uz_state *t = state_unpack(x, count);
    CHECK(t && t->m == M);
    if (t) {
        const double *back[6] = {t->r, t->rho, t->Dr, t->Drho, t->best_r, t->anchor};
        for (int k = 0; k < 6; k++)
            CHECK(memcmp(back[k], vectors[k], sizeof vectors[k]) == 0);
        CHECK(t->alpha == s.alpha && t->as_given && t->tau == s.tau && isnan(t->step_norm) && isinf(t->best_bound) &&
              t->best_relative == s.best_relative);
        CHECK(t->iteration == s.iteration && t->restarts == 2 && t->next_check == 3 && t->best_iteration == 4);
        CHECK(t->phase == 1 && t->phase_end == 5 && t->method == s.method && t->made_by == s.made_by);
    }
    uz_state_free(t);
    free(x);
}

TEST(states_of_other_versions_are_not_read)
{
    static const struct {
        int at;
        double value;
    } DAMAGE[] = {{0, 2},   {0, 0},  {1, 2},  {1, -1},   {1, 3.5}, {1, 1e300},
                  {1, NAN}, {2, 99}, {3, -1}, {4, 1e18}, {6, -1},  {6, 0.5}};
    double vectors[6][M];
    uz_state s = full_state(vectors);
    int64_t count = 0;
    for (size_t i = 0; i < sizeof DAMAGE / sizeof DAMAGE[0]; i++) {
        double *x = state_pack(&s, &count);
        x[DAMAGE[i].at] = DAMAGE[i].value;
        CHECK_MSG(!state_unpack(x, count), "number %d is %g", DAMAGE[i].at, DAMAGE[i].value);
        free(x);
    }
    double *x = state_pack(&s, &count);
    CHECK(!state_unpack(x, count - 1) && !state_unpack(x, 3) && !state_unpack(x, 0));
    free(x);
}

/* The numbers of stored states are forever: every method of the library that iterates has one, and its own. */
TEST(every_method_can_be_stored)
{
    for (uz_method m = UZ_METHOD_AUTO; m <= UZ_METHOD_ACTIVE_SET; m++) {
        double vectors[6][M];
        uz_state s = full_state(vectors);
        int64_t count = 0;
        s.method = s.made_by = m;
        double *x = state_pack(&s, &count);
        CHECK(x[2] == (double)m); /* as they were when the first states were stored */
        uz_state *t = state_unpack(x, count);
        CHECK(t && t->method == m && t->made_by == m);
        uz_state_free(t);
        free(x);
    }
}

/* ---- overall */

typedef struct {
    uz_result results[3];
    uz_result *list[3];
    uz_load_case cases[3];
    uz_problem problem;
} three;

static void make_three(three *t, const uz_outcome outcomes[3], const double bounds[3])
{
    memset(t, 0, sizeof *t);
    for (int i = 0; i < 3; i++) {
        uz_summary *s = &t->results[i].summary;
        s->outcome = outcomes[i];
        s->certificate.relative_error = bounds[i];
        s->iterations = 10 * (i + 1);
        s->restarts = i;
        s->active = i;
        s->refinements = 2;
        s->factor_cached = i > 0;
        s->reused = (uz_reuse){.assembly = i > 0, .ordering = true, .factor = i > 0, .op = i > 0};
        s->factor_flops = i > 0 ? 0 : 7;
        s->cost.actual_seconds = 8 - i;
        s->timings = (uz_timings){.factor = i == 0 ? 4 : 0, .iterate = 1, .total = 2};
        snprintf(s->message, sizeof s->message, "message %d", i);
        t->list[i] = &t->results[i];
        snprintf(t->cases[i].name, sizeof t->cases[i].name, "case %d", i);
    }
    t->problem.cases = t->cases;
    t->problem.n_cases = 3;
}

TEST(the_worst_case_speaks_for_all)
{
    three t;
    uz_summary s;
    codec_cases counts;
    make_three(&t, (uz_outcome[]){UZ_CONVERGED, UZ_ITERATION_LIMIT, UZ_CONVERGED}, (double[]){1e-9, 1e-3, 1e-8});
    overall_summary(&s, &counts, t.list, &t.problem);
    CHECK_INT(s.outcome, UZ_ITERATION_LIMIT);
    CHECK(s.certificate.relative_error == 1e-3 && s.iterations == 60 && s.restarts == 3 && s.active == 1);
    CHECK(s.timings.factor == 4 && s.timings.iterate == 3 && s.timings.total == 6 && !s.factor_cached);
    CHECK(s.reused.ordering && !s.reused.assembly && !s.reused.factor && !s.reused.op && s.factor_flops == 7);
    CHECK(s.cost.actual_seconds == 8 && s.refinements == 6);
    CHECK_STR(counts.worst, "case 1");
    CHECK(counts.count == 3 && counts.outcomes[UZ_CONVERGED] == 2 && counts.outcomes[UZ_ITERATION_LIMIT] == 1);
    CHECK_STR(s.message, "2 of 3 cases converged. The worst is case 1: message 1");
}

TEST(all_converged_with_the_largest_bound)
{
    three t;
    uz_summary s;
    codec_cases counts;
    make_three(&t, (uz_outcome[]){UZ_CONVERGED, UZ_CONVERGED, UZ_CONVERGED}, (double[]){1e-9, 1e-10, 3e-9});
    overall_summary(&s, &counts, t.list, &t.problem);
    CHECK_INT(s.outcome, UZ_CONVERGED);
    CHECK(s.certificate.relative_error == 3e-9);
    CHECK_STR(counts.worst, "case 2");
    CHECK_STR(s.message, "");
}

/* A bound that is not known is worse than any, also where another case has the worse outcome. */
TEST(the_relative_error_is_the_largest_of_all)
{
    three t;
    uz_summary s;
    codec_cases counts;
    make_three(&t, (uz_outcome[]){UZ_TIME_LIMIT, UZ_PRECISION_LIMIT, UZ_CONVERGED}, (double[]){1e-3, 1e-2, 1e-9});
    overall_summary(&s, &counts, t.list, &t.problem);
    CHECK_INT(s.outcome, UZ_TIME_LIMIT);
    CHECK(s.certificate.relative_error == 1e-2);
    make_three(&t, (uz_outcome[]){UZ_CONVERGED, UZ_INFEASIBLE, UZ_CONVERGED}, (double[]){1e-9, NAN, 1e-9});
    overall_summary(&s, &counts, t.list, &t.problem);
    CHECK_INT(s.outcome, UZ_INFEASIBLE);
    CHECK(isinf(s.certificate.relative_error));
}

/* ---- live */

TEST(progress_of_cases)
{
    static live shared;
    live_writer l;
    uz_settings settings = uz_settings_default();
    uz_problem problem = {.n_cases = 4};
    int64_t count;
    double *rows;
    settings.max_iterations = 100;
    live_reset(&shared);
    live_begin(&l, &shared, &settings, &problem);
    int before = live_progress(&shared, 0);
    for (int64_t i = 0; i < 4; i++) {
        live_restart(&l, i, 0.0, 0.0);
        CHECK(live_rows(&shared, -1, &rows, &count) && count == 0);
        free(rows);
        for (int64_t k = 0; k <= 50; k++)
            live_add(&l, &(uz_history_row){.iteration = k, .dual_objective = -0.5, .error_bound = INFINITY});
        int now = live_progress(&shared, before);
        CHECK_MSG(now > before && now >= 10 + (int)(85 * ((double)i + 0.5) / 4) - 1 && now <= 95, "%d after %d", now,
                  before);
        before = now;
        CHECK(live_rows(&shared, 40, &rows, &count) && count == 10);
        free(rows);
    }
}
