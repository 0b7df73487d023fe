/* conditioned_run.c: 20,000 ill-conditioned problems, and as many of all sizes, against solutions in 100 digits. */
#include "extremes.h"

#include "conditioned.h"

enum { PROBLEMS = 20000 };

static void report(void *ctx, uint64_t seed, const big_truth *exact, const uz_result *result, const char *why)
{
    char name[64];
    judgement j = {.verdict = JUDGED_WRONG, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN};
    if (result)
        j.certified = result->summary.certificate.relative_error;
    if (result && exact->definite)
        j.error = big_error(exact, result->u) / exact->norm;
    j.ratio = j.certified / j.error;
    snprintf(j.why, sizeof j.why, "%s", why);
    add_row(ctx, "100 digits",
            name_of(name, sizeof name, "seed %d, d = %d, 1e%.1f", (int)seed, (int)exact->d, log10(exact->condition)),
            result ? uz_method_name(result->summary.method) : "",
            result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "error", &j, false);
}

static void run_many(suite *all, const char *name, bool ranged)
{
    conditioned_tally t = {.least_ratio = INFINITY};
    if (!wants_family(all, name))
        return;
    for (uint64_t seed = 0; t.problems < PROBLEMS; seed++)
        run_conditioned(&t, seed, ranged, report, all);
    all->passed += (int)(t.solves - t.wrong); /* the others were added as rows */
    printf("%s: %d problems, %d of them not definite, %d without a reference; %d solves: %d converged, %d "
           "certified, %d refused, %d false; bound / true error at least %.6g\n",
           name, (int)t.problems, (int)t.indefinite, (int)t.unsolved, (int)t.solves, (int)t.converged, (int)t.certified,
           (int)t.refused, (int)t.wrong, t.least_ratio);
    for (int k = 0; k < 24; k++)
        if (t.by_decade[k][0] > 0)
            printf("%s: %s1e%d: %d solves, %d certified to 1 %%\n", name, k == 20 ? "not definite, as " : "", k,
                   (int)t.by_decade[k][0], (int)t.by_decade[k][1]);
}

void run_conditioned_problems(suite *all)
{
    run_many(all, "conditioned", false);
    run_many(all, "sizes", true);
}
