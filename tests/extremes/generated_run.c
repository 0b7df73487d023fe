/* generated_run.c: the full run of the property tests. */
#include "extremes.h"

#include "generated.h"

enum { PROBLEMS = 3000 };

static void report(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j)
{
    char name[64];
    add_row(ctx, "generated",
            name_of(name, sizeof name, "seed %d, d = %d, m = %d", (int)seed, (int)qp->K.cols, (int)qp->N.rows),
            uz_method_name(s->method), uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), j, false);
}

void run_generated_problems(suite *all)
{
    generated_tally t = {0};
    if (!wants_family(all, "generated"))
        return;
    for (uint64_t seed = 0; seed < PROBLEMS; seed++)
        run_generated(&t, seed, report, all);
    all->passed += (int)(t.problems - t.wrong - t.uncertain) /* the others were added as rows */;
    all->generated.problems = PROBLEMS;
    all->generated.solves = (int)t.problems;
    all->generated.converged = (int)t.outcome[UZ_CONVERGED];
    all->generated.wrong = (int)t.wrong;
    all->generated.asked = (int)t.asked;
    all->generated.answered = (int)t.answered;
    all->generated.ratio_median = tally_median(&t);
    all->generated.ratio_least = t.least_ratio;
    printf("generated: %d problems, %d solves: %d converged, %d precision_limit, %d iteration_limit, %d infeasible, %d "
           "refused; as a user asks: %d of %d answered\n",
           PROBLEMS, (int)t.problems, (int)t.outcome[UZ_CONVERGED], (int)t.outcome[UZ_PRECISION_LIMIT],
           (int)t.outcome[UZ_ITERATION_LIMIT], (int)t.outcome[UZ_INFEASIBLE], (int)t.refused, (int)t.answered,
           (int)t.asked);
    printf("generated: bound / true error of the converged: median %.3g, least %.6g\n", all->generated.ratio_median,
           t.least_ratio);
    free(t.ratio);
}
