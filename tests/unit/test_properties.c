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
                  (int)qp->K.cols, (int)qp->N.rows, uz_outcome_name(s->outcome), uz_method_name(s->method), j->why,
                  j->certified, j->error);
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
    CHECK(all.uncertain < all.problems / 100);
    CHECK(all.outcome[UZ_CONVERGED] > all.problems / 2);
    CHECK(tally_median(&all) < 10);
    free(all.ratio);
}
