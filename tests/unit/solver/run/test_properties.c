/* Claims on problems built backwards from their solution: no bound is below the true error, and nothing that misses the
 * request is called converged. `make extremes` runs ten times as many. */
#include "generated.h"
#include "harness.h"

enum { PROBLEMS = 300 };

static void fail(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j)
{
    (void)ctx;
    if (j->verdict == JUDGED_WRONG)
        test_fail(__FILE__, __LINE__, "seed %d, d %d, m %d, %s by %s: %s (certified %.17g, true %.17g)", (int)seed,
                  (int)qp->K.cols, (int)qp->N.rows, uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome),
                  uz_method_name(s->method), j->why, j->certified, j->error);
}

TEST(claims_on_generated_problems_are_true)
{
    generated_tally all = {0};
    uz_process_init(2);
    uz_thread_init();
    for (uint64_t seed = 0; seed < PROBLEMS; seed++)
        run_generated(&all, seed, fail, NULL);
    printf("# %d solves: %d converged, %d refused, bound / error: median %.3g, least %.3g\n", (int)all.problems,
           (int)all.outcome[UZ_CONVERGED], (int)all.refused, tally_median(&all), all.least_ratio);
    CHECK_INT(all.wrong, 0);
    CHECK(all.uncertain < all.problems / 25); /* bounds near the noise of the quadruple reference, or none there */
    CHECK(all.outcome[UZ_CONVERGED] > all.problems * 3 / 4);
    CHECK(100 * all.answered > 90 * all.asked);
    CHECK(tally_median(&all) < 10);
    free(all.ratio);
}

/* Seeds at which a bound was once below the true error, or an answer certified that does not exist: a stiffness worse
 * conditioned than the pivots of its factor show (2107, 2428), rows that contradict by less than the rounding of others
 * (1464, 2353), rows that nearly depend on each other (31, 153). */
TEST(claims_that_were_once_false_are_true)
{
    static const uint64_t seeds[] = {31, 153, 1464, 2107, 2353, 2428};
    generated_tally all = {0};
    for (size_t k = 0; k < sizeof seeds / sizeof seeds[0]; k++)
        run_generated(&all, seeds[k], fail, NULL);
    CHECK_INT(all.wrong, 0);
    free(all.ratio);
}

/* Rows that repeat others up to rounding can't be closed as equations, but there is a feasible displacement near by. */
TEST(nearly_dependent_rows_are_bounded)
{
    static const uint64_t seeds[] = {48, 52, 122, 260, 280};
    for (size_t k = 0; k < sizeof seeds / sizeof seeds[0]; k++) {
        bool active[GENERATED_MOST];
        uz_problem problem = problem_of(generated_qp(seeds[k], active));
        uz_settings settings = generated_settings(seeds[k]);
        uz_result *result = solve_problem(&problem, &settings);
        CHECK_MSG(result && result->summary.certificate.relative_error < 1e-5, "seed %d: bound %g", (int)seeds[k],
                  result ? result->summary.certificate.relative_error : NAN);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* A problem whose energies leave the range of double gets no bound; zero would be the natural answer, and false. */
TEST(underflow_is_not_taken_for_accuracy)
{
    static const double units[] = {1e-150, 1e-160, 1e-300};
    for (size_t k = 0; k < sizeof units / sizeof units[0]; k++) {
        bool active[GENERATED_MOST];
        uz_problem problem = problem_of(generated_qp(10, active)); /* any will do */
        uz_settings settings = uz_settings_default();
        uz_qp *qp = &problem.qp;
        for (int64_t j = 0; j < qp->K.cols; j++)
            qp->p[j] *= units[k];
        for (int64_t i = 0; i < qp->N.rows; i++)
            qp->h[i] *= units[k];
        truth t = find_truth(qp, active);
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            judgement j = judge(&t, qp, result, result->u);
            CHECK_MSG(j.verdict != JUDGED_WRONG, "units of %g: %s", units[k], j.why);
        }
        uz_result_free(result);
        truth_clear(&t);
        uz_problem_clear(&problem);
    }
}
