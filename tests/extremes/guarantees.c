/* guarantees.c: guaranteed bounds on the whole error of generated bodies, on meshes of every plane element, against
 * each other and a finer one: a row for each body. `ratio` is the least of its bounds over the error by energies; where
 * answers enter the obstacle, with the finer answer's own bound added, over the difference to that.
 *
 * Medians are over two numbers that the error is between: what the finest mesh tells of it, and the same with all that
 * this mesh may be off by itself. Where stress is singular the first one is too small by far: with an order of a half a
 * mesh that is finer by two has seven tenths of the error. A bound may be below the difference to a finer answer and
 * right all the same, where that errs to the other side: before a disc by standing off where a coarse one stands in
 * (round 31: 0.97 of the difference with 16 cells, 1.07 with 32). What may not be below 1 has its bound added.
 */
#include "extremes.h"

#include "bound_shapes.h"

enum { BODIES = 300 };

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* kind -1: of bound_shapes.h */
static void run_kind(suite *all, int kind, const char *what)
{
    static const char *const KINDS[] = {"linear", "quadratic"};
    static double effect[2][8 * BODIES], less[2][8 * BODIES];
    int count[2] = {0}, unproved = 0;
    /* quadratic sides rise between nodes, too */
    const bool differences = kind > BOUND_STRAIGHT && kind != BOUND_SPRINGS;
    const int wanted = differences ? 10 : 9;
    for (uint64_t seed = 1; seed <= BODIES; seed++) {
        const bound_sweep x = kind < 0      ? sweep_meshes(shape_scene, seed, 0, 2, 8)
                              : differences ? sweep_differences(seed, (bound_kind)kind, 4, 16)
                                            : sweep_bounds(seed, (bound_kind)kind, 3, 14);
        judgement j = {.verdict = JUDGED_OK, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN};
        char name[64];
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < x.count[k]; i++) {
                less[k][count[k]] = x.less[k][i];
                effect[k][count[k]++] = x.effect[k][i];
                j.ratio = isnan(j.ratio) ? x.effect[k][i] : fmin(j.ratio, x.effect[k][i]);
            }
        j.ratio = differences ? x.least : j.ratio;
        if (x.highest > x.lowest + 1e-12 * x.size || j.ratio < 1) {
            j.verdict = JUDGED_WRONG;
            snprintf(j.why, sizeof j.why, "energies of at least %.12e and at most %.12e", x.highest, x.lowest);
        } else if (x.proved < x.answers || x.answers < wanted) {
            snprintf(j.why, sizeof j.why, "%.150s", x.why);
        }
        unproved += x.answers - x.proved;
        add_row(all, "guaranteed", name_of(name, sizeof name, "%s %d", what, (int)seed), "default",
                x.proved == wanted ? "converged" : "not proved", &j,
                kind >= 0 && x.answers < wanted); /* supports of shapes may contradict each other */
    }
    for (int k = 0; k < 2 && count[k] > 0; k++) {
        qsort(effect[k], (size_t)count[k], sizeof effect[k][0], by_size);
        qsort(less[k], (size_t)count[k], sizeof less[k][0], by_size);
        printf("guaranteed, %s: %d bounds of %s elements over the error by the finest mesh: least %.4f, median %.3f "
               "(with what that may be off by %.3f), 19 of 20 below %.3f (%.3f), most %.3f\n",
               what, count[k], KINDS[k], effect[k][0], effect[k][count[k] / 2], less[k][count[k] / 2],
               effect[k][count[k] * 19 / 20], less[k][count[k] * 19 / 20], effect[k][count[k] - 1]);
    }
    printf("guaranteed, %s: %d answers without a proof\n", what, unproved);
}

void run_guarantees(suite *all)
{
    if (!wants_family(all, "guaranteed"))
        return;
    run_kind(all, BOUND_STRAIGHT, "body");
    run_kind(all, BOUND_ROUND, "round");
    run_kind(all, BOUND_RESTING, "resting");
    run_kind(all, BOUND_PERCHED, "perched");
    run_kind(all, BOUND_SPRINGS, "springs");
    run_kind(all, BOUND_RINGS, "ring");
    run_kind(all, BOUND_LINES, "lines");
    run_kind(all, BOUND_RINGS_ROUND, "round ring");
    run_kind(all, BOUND_RINGS_LINES, "ring lines");
    run_kind(all, -1, "shape");
}
