/* not under ThreadSanitizer: one thread, and long
 * What accuracy took: that what a run records is what its own certificates say, and what follows from it. */
#include "methods/milestones.h"
#include "scene_fixture.h"
#include "work/trade.h"

static uz_result *solve(uz_problem *problem, const uz_settings *settings)
{
    uz_result *result = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_solve(&result, problem, settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    return result;
}

static uz_settings with_method(uz_method method, uz_operator op, double relative_error)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.op = op;
    settings.relative_error = relative_error;
    return settings;
}

static bool is_reached(const uz_trade_step *step)
{
    return !isnan(step->seconds);
}

/* What holds of every record: what the certificate met was reached, in order, and nothing else was. */
static void check_record(const uz_result *result)
{
    const uz_trade *trade = &result->trade;
    const double certified = result->summary.certificate.relative_error;
    for (int k = 0; k < UZ_TRADE_STEPS; k++) {
        const uz_trade_step *step = &trade->step[k];
        CHECK_MSG(is_reached(step) == (certified <= uz_trade_error(k)), "%.3g of %.3g", uz_trade_error(k), certified);
        if (!is_reached(step))
            continue;
        CHECK(step->seconds >= 0.0 && step->seconds <= trade->total_s);
        CHECK(step->iterations >= 0 && step->iterations <= result->summary.iterations);
        CHECK(uz_trade_cost(trade, step) <= trade->total_s);
        if (k > 0)
            CHECK(step->seconds >= step[-1].seconds && step->iterations >= step[-1].iterations &&
                  step->applications >= step[-1].applications);
    }
    CHECK(trade->iterated_s <= trade->total_s);
    CHECK_REL(trade->total_s, result->summary.timings.total, 0.05);
}

TEST(steps_are_quarters_of_decades)
{
    uz_trade trade;
    uz_trade_clear(&trade);
    CHECK(uz_trade_error(3) == 0.1 && uz_trade_error(7) == 0.01 && uz_trade_error(39) == 1e-10);
    CHECK_REL(uz_trade_error(0), 0.5623413251903491, 1e-15);
    CHECK(!uz_trade_reach(&trade, 1.0));
    for (int k = 0; k < 9; k++)
        trade.step[k].seconds = k;
    CHECK(uz_trade_reach(&trade, 0.1) == &trade.step[3]);
    CHECK(uz_trade_reach(&trade, 0.099) == &trade.step[4]);
    CHECK(uz_trade_reach(&trade, 0.01) == &trade.step[7]);
    CHECK(!uz_trade_reach(&trade, 1e-3) && !uz_trade_reach(&trade, 0.0) && !uz_trade_reach(&trade, NAN));
}

/* A run that is cut at the iteration that is recorded for a bound has that bound by its certificate. */
static void check_cut_runs(uz_method method, uz_operator op)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    uz_settings settings = with_method(method, op, 1e-8);
    uz_result *whole = solve(&problem, &settings);
    check_record(whole);
    for (int k = 3; k < 32; k += 4) {
        const uz_trade_step *step = &whole->trade.step[k];
        CHECK(is_reached(step));
        settings.max_iterations = step->iterations;
        uz_result *cut = solve(&problem, &settings);
        CHECK_MSG(cut->summary.certificate.relative_error <= uz_trade_error(k) * (1 + 1e-6), "%s, %lld iterations: %g",
                  uz_method_name(method), (long long)step->iterations, cut->summary.certificate.relative_error);
        uz_result_free(cut);
    }
    uz_result_free(whole);
    uz_problem_clear(&problem);
}

TEST(runs_cut_where_a_bound_is_recorded_have_it)
{
    check_cut_runs(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED);
    check_cut_runs(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_MATRIX_FREE);
    check_cut_runs(UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED);
    check_cut_runs(UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_CONDENSED);
    check_cut_runs(UZ_METHOD_AUTO, UZ_OPERATOR_FACTORED);
}

/* The history has the absolute bound of each row: the recorded iteration is the first whose row has it. */
TEST(the_recorded_iteration_is_the_first)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    const uz_settings settings = with_method(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED, 1e-8);
    uz_result *result = solve(&problem, &settings);
    const uz_history *history = &result->history;
    const double norm = result->summary.certificate.energy_norm;
    for (int k = 7; k < 32; k++) { /* from 1e-2 on the norm of an iterate is that of the answer, nearly */
        int64_t i = 0;
        while (i < history->count && !(history->rows[i].error_bound <= 0.97 * uz_trade_error(k) * norm))
            i++;
        CHECK_MSG(result->trade.step[k].iterations <= history->rows[i].iteration, "%g", uz_trade_error(k));
        i = 0;
        while (i < history->count && !(history->rows[i].error_bound <= 1.03 * uz_trade_error(k) * norm))
            i++;
        CHECK_MSG(result->trade.step[k].iterations >= history->rows[i].iteration, "%g", uz_trade_error(k));
        CHECK(!result->trade.step[k].by_certificate);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(every_way_of_solving_keeps_a_record)
{
    static const struct {
        uz_method method;
        uz_operator op;
        double error;
    } ways[] = {{UZ_METHOD_UZAWA, UZ_OPERATOR_CONDENSED, 1e-3},
                {UZ_METHOD_ACCELERATED, UZ_OPERATOR_AUTO, 1e-5},
                {UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, 0.0},
                {UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE, 1e-8},
                {UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_FACTORED, 1e-10},
                {UZ_METHOD_AUTO, UZ_OPERATOR_CONDENSED, 1.0}};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        const uz_settings settings = with_method(ways[i].method, ways[i].op, ways[i].error);
        uz_result *result = solve(&problem, &settings);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        check_record(result);
        uz_result_free(result);
    }
    uz_settings paper = uz_settings_default();
    paper.method = UZ_METHOD_ACCELERATED_RESTART;
    paper.stopping = UZ_STOP_PAPER;
    paper.epsilon = 1e-6;
    uz_result *result = solve(&problem, &paper);
    check_record(result);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Without contact there is one linear solve, and it has all digits at once. */
TEST(linear_bodies_reach_everything_at_once)
{
    uz_scene scene = paper_scene(6, 2);
    scene.n_contacts = 0;
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    const uz_settings settings = uz_settings_default();
    uz_result *result = solve(&problem, &settings);
    CHECK_INT(result->summary.method, UZ_METHOD_LINEAR);
    check_record(result);
    CHECK(is_reached(&result->trade.step[39]) && result->trade.step[39].iterations <= 1);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* The loads of a block take turns: each one's record is of its own time. */
TEST(load_cases_keep_records_of_their_own)
{
    enum { CASES = 10 };
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10), .n_cases = CASES};
    const uz_settings settings = with_method(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_AUTO, 1e-6);
    uz_result **results = NULL;
    uz_error err = {0};
    problem.cases = calloc(CASES, sizeof *problem.cases);
    for (int i = 0; i < CASES; i++) {
        snprintf(problem.cases[i].name, sizeof problem.cases[i].name, "%d", i);
        problem.cases[i].loads = calloc(1, sizeof *problem.cases[i].loads);
        problem.cases[i].n_loads = 1;
        problem.cases[i].loads[0] = problem.scene.loads[1];
        problem.cases[i].loads[0].v[0] = 0.1 + 0.1 * i;
    }
    CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    for (int i = 0; results && i < CASES; i++)
        check_record(results[i]);
    uz_results_free(results, results ? CASES : 0);
    uz_problem_clear(&problem);
}

/* The whole surface may touch: most rows are left out, and a bound counts for all of them only where there is room. */
TEST(rows_that_are_left_out_are_allowed_for)
{
    uz_scene scene = paper_scene(240, 80);
    scene.n_contacts = 0;
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    add_plane(&scene, "right", 66, 0, -1, 0);
    add_plane(&scene, "top", 0, 26, 0, -1);
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    const uz_settings settings = with_method(UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_AUTO, 1e-8);
    uz_result *result = solve(&problem, &settings);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK(result->summary.kept < result->summary.m);
    check_record(result);
    const double c = result->summary.certificate.relative_error;
    for (int k = 0; k < UZ_TRADE_STEPS; k++)
        if (is_reached(&result->trade.step[k]))
            CHECK_MSG(result->trade.step[k].by_certificate == (uz_trade_error(k) < 20 * c), "%g of %g",
                      uz_trade_error(k), c);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* A body that only the obstacle holds, and somebody's answer: the certificate alone tells. */
TEST(a_given_answer_is_known_from_its_certificate)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
    const uz_settings settings = uz_settings_default();
    uz_result *result = solve(&problem, &settings), *verified = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_verify(&verified, &problem, result->u, result->r, &settings, NULL, NULL, &err) == UZ_OK, "%s",
              err.message);
    check_record(verified);
    for (int k = 0; k < 32; k++)
        CHECK(verified->trade.step[k].by_certificate && verified->trade.step[k].iterations == 0);
    uz_result_free(result);
    uz_result_free(verified);
    uz_problem_clear(&problem);
}

/* ---- the recorder by itself */

TEST(a_certificate_takes_back_what_it_does_not_confirm)
{
    uz_milestones d;
    uz_milestones_init(&d, false);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 5e-3, 10, 11);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 2e-2, 12, 13); /* nothing new */
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 1e-10, 20, 21);
    uz_milestones_note(&d, UZ_MILESTONE_OF_CERTIFICATE, 3e-7, 20, 21);
    CHECK(d.trade.step[7].iterations == 10 && d.trade.step[8].iterations == 10 && d.trade.step[9].iterations == 20);
    CHECK(is_reached(&d.trade.step[25]) && !is_reached(&d.trade.step[26]));
    uz_milestones_note(&d, UZ_MILESTONE_OF_CERTIFICATE, 1e-9, 25, 30);
    CHECK(d.trade.step[26].iterations == 25 && d.trade.step[26].by_certificate && !d.trade.step[25].by_certificate);
    CHECK(is_reached(&d.trade.step[35]) && !is_reached(&d.trade.step[36]));
    uz_milestones_drop(&d, NAN);
    CHECK(d.reached == 0 && !is_reached(&d.trade.step[0]));
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, INFINITY, 1, 1);
    uz_milestones_note(NULL, UZ_MILESTONE_OF_ITERATION, 1e-3, 1, 1);
    CHECK(d.reached == 0);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 0.0, 1, 1);
    CHECK_INT(d.reached, UZ_TRADE_STEPS);
}

TEST(a_partial_run_has_to_have_room)
{
    uz_milestones d;
    uz_milestones_init(&d, true);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 0.09, 1, 1); /* 0.09 / 0.85 > 0.1 */
    CHECK_INT(d.reached, 3);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ITERATION, 8e-9, 5, 5);
    uz_milestones_note(&d, UZ_MILESTONE_OF_CERTIFICATE, 8e-9, 5, 5);
    CHECK(d.reached == 32 && !d.trade.step[31].by_certificate);
    uz_milestones_note(&d, UZ_MILESTONE_OF_ALL_ROWS, 1e-8, 5, 5);
    CHECK(d.trade.step[31].by_certificate && d.reached == 32);
    CHECK(d.trade.step[26].by_certificate && !d.trade.step[25].by_certificate); /* 1.8e-7 < 20e-8 <= 3.2e-7 */
}

/* ---- in the store */

static uz_trade random_trade(unsigned seed, int reached)
{
    uz_trade trade;
    uz_trade_clear(&trade);
    srand(seed);
    double seconds = 0.0;
    int64_t iterations = 0;
    for (int k = 0; k < reached; k++) {
        if (rand() % 3 == 0 || k == 0) {
            seconds += 1e-6 * (rand() % 1000);
            iterations += 1 + rand() % 100;
        }
        trade.step[k] = (uz_trade_step){seconds, iterations, iterations + 2, k > 40};
    }
    trade.iterated_s = seconds;
    trade.total_s = seconds + 1e-3;
    return trade;
}

static bool same(const uz_trade *a, const uz_trade *b)
{
    bool equal = a->iterated_s == b->iterated_s && a->total_s == b->total_s;
    for (int k = 0; k < UZ_TRADE_STEPS; k++) {
        const uz_trade_step *x = &a->step[k], *y = &b->step[k];
        equal = equal && is_reached(x) == is_reached(y) &&
                (!is_reached(x) || (x->seconds == y->seconds && x->iterations == y->iterations &&
                                    x->applications == y->applications && x->by_certificate == y->by_certificate));
    }
    return equal;
}

TEST(records_survive_packing)
{
    double x[TRADE_NUMBERS];
    for (unsigned seed = 0; seed < 200; seed++) {
        uz_trade trade = random_trade(seed, (int)seed % (UZ_TRADE_STEPS + 1)), back;
        const int64_t n = trade_pack(x, &trade);
        CHECK(n <= TRADE_NUMBERS && trade_unpack(&back, x, n) && same(&trade, &back));
    }
}

/* Any number of a record changed to something else: refused, or a record that is one. */
TEST(damaged_records_are_refused)
{
    static const double WRONG[] = {NAN, INFINITY, -1.0, 0.5, 1e300, 47.0, 48.0, 49.0, 2.0};
    double x[TRADE_NUMBERS + 8] = {0};
    uz_trade trade = random_trade(7, 44), back;
    const int64_t n = trade_pack(x, &trade);
    CHECK(n < TRADE_NUMBERS);
    CHECK(!trade_unpack(&back, NULL, 0) && !is_reached(&back.step[0]));
    for (int64_t cut = 0; cut < n; cut++)
        CHECK_MSG(!trade_unpack(&back, x, cut) || (cut - TRADE_HEAD) % TRADE_COLUMNS == 0, "%lld", (long long)cut);
    CHECK(!trade_unpack(&back, x, n + 1) && !trade_unpack(&back, x, TRADE_NUMBERS + TRADE_COLUMNS));
    for (int64_t i = 0; i < n; i++)
        for (size_t w = 0; w < sizeof WRONG / sizeof WRONG[0]; w++) {
            const double kept = x[i];
            x[i] = WRONG[w];
            const bool taken = trade_unpack(&back, x, n);
            CHECK(taken || (!is_reached(&back.step[0]) && back.total_s == 0.0));
            for (int k = 0; taken && k < UZ_TRADE_STEPS; k++)
                CHECK(!is_reached(&back.step[k]) || (back.step[k].seconds >= 0.0 && back.step[k].iterations >= 0));
            x[i] = kept;
        }
    x[0] = 2.0;
    CHECK(!trade_unpack(&back, x, n));
}

TEST(a_continued_run_keeps_what_was_reached)
{
    uz_trade earlier = random_trade(1, 20), later = random_trade(2, 40);
    const uz_trade before = later;
    trade_join(&later, &earlier);
    CHECK(later.total_s == before.total_s + earlier.total_s);
    CHECK(later.step[19].seconds == earlier.step[19].seconds);
    CHECK(later.step[20].seconds == before.step[20].seconds + earlier.total_s);
    CHECK(later.step[20].applications == before.step[20].applications + earlier.step[19].applications);
    CHECK(!is_reached(&later.step[40]));
}
