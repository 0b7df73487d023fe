/* Claims on ill-conditioned problems, against solutions in 100 digits. `make extremes` runs 20,000 of them. */
#include "conditioned.h"
#include "harness.h"
#include "sanitized.h"

enum { PROBLEMS = 400 };

static void fail(void *ctx, uint64_t seed, const big_truth *exact, const uz_result *result, const char *why)
{
    (void)ctx;
    test_fail(__FILE__, __LINE__, "seed %d, d %d, condition %.2g: %s (certified %.17g, true %.17g)", (int)seed,
              (int)exact->d, exact->condition, why, result ? result->summary.certificate.relative_error : NAN,
              result && exact->definite ? big_error(exact, result->u) / exact->norm : NAN);
}

TEST(claims_on_ill_conditioned_problems_are_true)
{
    conditioned_tally t = {.least_ratio = INFINITY};
    int64_t solves = 0, answers = 0;
    uz_process_init(2);
    uz_thread_init();
    for (uint64_t seed = 0; t.problems < some_of(PROBLEMS); seed++)
        run_conditioned(&t, seed, false, fail, NULL);
    for (int k = 8; k < 14; k++) {
        solves += t.by_decade[k][0];
        answers += t.by_decade[k][1];
    }
    printf("# %d problems, %d not definite: %d solves, %d converged, %d refused; bound / error at least %.9g\n",
           (int)t.problems, (int)t.indefinite, (int)t.solves, (int)t.converged, (int)t.refused, t.least_ratio);
    CHECK_INT(t.wrong, 0);
    CHECK_INT(t.unsolved, 0);
    CHECK(t.indefinite > some_of(20));
    CHECK(t.least_ratio >= 1);
    CHECK_MSG(100 * answers > 98 * solves, "%d of %d certified to 1 %%", (int)answers, (int)solves);
}

/* Seeds at which a bound was once below the true error (318, 349, 420, 2533), or an answer certified although K is not
 * positive definite (101, 262, 440, 1411). */
TEST(bounds_that_were_once_too_small_hold)
{
    static const uint64_t seeds[] = {101, 262, 318, 349, 420, 440, 1411, 2533};
    conditioned_tally t = {.least_ratio = INFINITY};
    for (size_t k = 0; k < sizeof seeds / sizeof seeds[0]; k++)
        run_conditioned(&t, seeds[k], false, fail, NULL);
    CHECK_INT(t.problems, (int64_t)(sizeof seeds / sizeof seeds[0]));
    CHECK_INT(t.wrong, 0);
}

/* Loads, gaps and stiffnesses from the whole range of double: no bound is zero after underflow, none is false, and what
 * can't be calculated with is refused by name. */
TEST(claims_at_the_ends_of_the_range_are_true)
{
    conditioned_tally t = {.least_ratio = INFINITY};
    for (uint64_t seed = 0; t.problems < some_of(2 * PROBLEMS); seed++)
        run_conditioned(&t, seed, true, fail, NULL);
    printf("# %d problems: %d solves, %d converged, %d refused\n", (int)t.problems, (int)t.solves, (int)t.converged,
           (int)t.refused);
    CHECK_INT(t.wrong, 0);
    CHECK(t.converged > t.solves / 3);
}
