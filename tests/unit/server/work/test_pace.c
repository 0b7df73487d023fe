/* What solves take here for what was predicted. */
#include "harness.h"
#include "work/pace.h"
#include "work/solve.h"

#include <math.h>

static double factor_of(pace *p, uz_operator op)
{
    double factor[PACE_FORMS];
    pace_now(p, factor);
    return factor[op];
}

TEST(a_few_solves_tell_and_one_that_is_odd_does_not)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 2; k++)
        pace_add(p, UZ_OPERATOR_CONDENSED, 1.0, 1.5);
    CHECK(factor_of(p, UZ_OPERATOR_CONDENSED) == 1.0);
    pace_add(p, UZ_OPERATOR_CONDENSED, 1.0, 100.0);
    CHECK_REL(factor_of(p, UZ_OPERATOR_CONDENSED), 1.5, 1e-15);
    pace_add(p, UZ_OPERATOR_CONDENSED, 2.0, 3.2);
    CHECK_REL(factor_of(p, UZ_OPERATOR_CONDENSED), 1.55, 1e-15);
    CHECK(factor_of(p, UZ_OPERATOR_MATRIX_FREE) == 1.0);
    pace_free(p);
}

TEST(the_last_ones_count)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 100; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 0.5);
    for (int k = 0; k < 8; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 2.0);
    CHECK_REL(factor_of(p, UZ_OPERATOR_MATRIX_FREE), 2.0, 1e-15);
    for (int k = 0; k < 100; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 1e6);
    CHECK_REL(factor_of(p, UZ_OPERATOR_MATRIX_FREE), 4.0, 1e-15);
    pace_free(p);
}

TEST(what_tells_nothing_is_left_out)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 9; k++) {
        pace_add(p, UZ_OPERATOR_FACTORED, 1e-5, 1e-3); /* short */
        pace_add(p, UZ_OPERATOR_FACTORED, 0.0, 1.0);
        pace_add(p, UZ_OPERATOR_FACTORED, NAN, 1.0);
        pace_add(p, UZ_OPERATOR_FACTORED, 1.0, NAN);
        pace_add(p, UZ_OPERATOR_FACTORED, 1e-300, 1e300);
        pace_add(p, (uz_operator)PACE_FORMS, 1.0, 2.0);
    }
    for (int k = 0; k < PACE_FORMS; k++)
        CHECK(factor_of(p, (uz_operator)k) == 1.0);
    CHECK(factor_of(NULL, UZ_OPERATOR_FACTORED) == 1.0);
    pace_add(NULL, UZ_OPERATOR_FACTORED, 1.0, 2.0);
    pace_free(p);
    pace_free(NULL);
}

static uz_operator told_by(const uz_summary *summary, int64_t n)
{
    uz_result result[2] = {{.summary = summary[0]}, {.summary = summary[n - 1]}},
              *results[2] = {&result[0], &result[1]};
    solve_figures figures = {0};
    solve_count(&figures, results, n);
    CHECK_REL(figures.said_s, 2.0 * (double)n, 1e-15);
    CHECK_REL(figures.took_s, 3.0 * (double)n, 1e-15);
    return figures.op;
}

/* What a job took is what its price stands for where it made all of its setup, or nothing of it, and solved once. */
TEST(jobs_that_were_not_priced_as_they_went_tell_nothing)
{
    const uz_summary whole = {.op = UZ_OPERATOR_CONDENSED,
                              .geometry.kind = UZ_KINEMATICS_FIXED,
                              .outcome = UZ_CONVERGED,
                              .rounds = 1,
                              .cost = {.seconds = 2.0, .actual_seconds = 3.0}};
    uz_grid_sequence grids = {0};
    uz_summary cached = whole, factor = whole, order = whole, unmet = whole, again = whole, meshes = whole,
               loose = whole, moved = whole;
    CHECK_INT(told_by(&whole, 1), UZ_OPERATOR_CONDENSED);
    cached.reused = (uz_reuse){.assembly = true, .ordering = true, .factor = true, .op = true};
    CHECK_INT(told_by(&cached, 1), UZ_OPERATOR_CONDENSED);
    factor.reused = (uz_reuse){.assembly = true, .ordering = true, .factor = true};
    order.reused.ordering = true;
    unmet.outcome = UZ_ITERATION_LIMIT;
    again.rounds = 2;
    meshes.grids = &grids;
    loose.semicoercive.rounds = 1;
    moved.geometry.kind = UZ_KINEMATICS_MOVING;
    const uz_summary *others[] = {&factor, &order, &unmet, &again, &meshes, &loose, &moved};
    for (size_t k = 0; k < sizeof others / sizeof others[0]; k++) {
        const uz_summary cases[2] = {whole, *others[k]};
        CHECK_INT(told_by(others[k], 1), UZ_OPERATOR_AUTO);
        CHECK_INT(told_by(cases, 2), UZ_OPERATOR_AUTO);
    }
}
