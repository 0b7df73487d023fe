/* contradictions.c: the full run of problems whose rows contradict each other or nearly do. */
#include "extremes.h"

#include "contradictions.h"

enum { PROBLEMS = 20000 };

void run_contradictions(suite *all)
{
    contradiction_tally t = {0};
    if (!wants_family(all, "contradictions"))
        return;
    for (uint64_t seed = 0; seed < PROBLEMS; seed++) {
        const int64_t before = contradiction_faults(&t);
        run_contradiction(&t, seed);
        char name[64];
        if (contradiction_faults(&t) > before)
            add_row(all, "contradictions", name_of(name, sizeof name, "seed %d", (int)seed), "default", "",
                    &(judgement){.verdict = JUDGED_WRONG, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN},
                    false);
        else
            all->passed++;
    }
    printf("contradictions: %d problems, %d refused; %d feasible: %d converged, %d out_of_reach, %d other, %d answers "
           "without a reference; %d infeasible: %d proved, %d undecided; by a margin above 1e-14: %d of %d proved\n",
           PROBLEMS, (int)t.refused, (int)t.feasible, (int)t.solved, (int)t.reached, (int)t.limited, (int)t.unchecked,
           (int)t.infeasible, (int)t.proved, (int)t.undecided, (int)t.proved_above, (int)t.above);
    printf(
        "contradictions: false: %d infeasible, %d answers, %d bounds, %d radii, %d without rows; largest entry of an "
        "answer %.3g\n",
        (int)t.false_infeasible, (int)t.false_answer, (int)t.false_bound, (int)t.false_radius, (int)t.no_rows,
        t.largest);
}
