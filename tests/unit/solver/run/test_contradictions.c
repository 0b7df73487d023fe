/* test_contradictions.c: rows that contradict each other, or nearly, judged in rational numbers. */
#include "contradictions.h"
#include "sanitized.h"

/* The short form of what `make extremes` runs 20,000 times. */
TEST(no_false_claim_about_contradictions)
{
    contradiction_tally t = {0};
    for (uint64_t seed = 0; seed < (uint64_t)some_of(400); seed++) {
        const int64_t before = contradiction_faults(&t);
        run_contradiction(&t, seed);
        CHECK_MSG(contradiction_faults(&t) == before, "seed %d", (int)seed);
    }
    CHECK_MSG(t.feasible > some_of(150) && t.infeasible > some_of(150), "%d feasible, %d not", (int)t.feasible,
              (int)t.infeasible);
    CHECK_MSG(t.proved_above == t.above, "%d of %d proved", (int)t.proved_above, (int)t.above);
    CHECK_MSG(t.solved >= t.feasible * 9 / 10, "%d of %d solved", (int)t.solved, (int)t.feasible);
    CHECK(t.largest > 1e10);
}
