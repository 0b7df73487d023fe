/* Rows that depend on each other, meet in one point or form long chains: such answers have bounds, and true ones.
 * `make extremes` runs many more. */
#include "degenerate.h"
#include "harness.h"

enum { PROBLEMS = 400 };

static void tell(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j)
{
    (void)ctx;
    printf("# seed %d (%s), d %d, m %d, %s: certified %.3g, true %.3g %s\n", (int)seed,
           DEGENERATE_NAMES[seed % DEGENERATE_KINDS], (int)qp->K.cols, (int)qp->N.rows, uz_outcome_name(s->outcome),
           s->certificate.relative_error, j->error, j->why);
    CHECK(j->verdict != JUDGED_WRONG);
}

TEST(degenerate_problems_are_certified)
{
    degenerate_tally all = {.least_ratio = INFINITY};
    for (uint64_t seed = 0; seed < PROBLEMS; seed++)
        run_degenerate(&all, seed, tell, NULL);
    CHECK_INT(all.wrong, 0);
    CHECK(all.least_ratio >= 1);
    for (int kind = 0; kind < DEGENERATE_KINDS; kind++)
        CHECK_MSG(all.certified[kind] == all.problems[kind], "%s: %d of %d certified", DEGENERATE_NAMES[kind],
                  (int)all.certified[kind], (int)all.problems[kind]);
}
