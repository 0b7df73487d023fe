/* degenerate_run.c: 20,000 problems whose rows depend on each other, meet in one point or form chains. */
#include "extremes.h"

#include "degenerate.h"

enum { PROBLEMS = 20000 };

static void report(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j)
{
    char name[64];
    add_row(ctx, "degenerate",
            name_of(name, sizeof name, "seed %d, %s, d = %d, m = %d", (int)seed,
                    DEGENERATE_NAMES[seed % DEGENERATE_KINDS], (int)qp->K.cols, (int)qp->N.rows),
            "default", uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), j, false);
}

void run_degenerate_problems(suite *all)
{
    degenerate_tally t = {.least_ratio = INFINITY};
    int64_t certified = 0;
    if (!wants_family(all, "degenerate"))
        return;
    for (uint64_t seed = 0; seed < PROBLEMS; seed++)
        run_degenerate(&t, seed, report, all);
    for (int kind = 0; kind < DEGENERATE_KINDS; kind++) {
        certified += t.certified[kind];
        printf("degenerate, %s: %d of %d certified\n", DEGENERATE_NAMES[kind], (int)t.certified[kind],
               (int)t.problems[kind]);
    }
    all->passed += (int)(certified - t.wrong); /* the others were added as rows */
    printf("degenerate: %d problems: %d certified to 1e-8, %d false, %d uncertain; bound / true error at least %.6g\n",
           PROBLEMS, (int)certified, (int)t.wrong, (int)t.uncertain, t.least_ratio);
}
