/* slender.c: beams 1000:1 that are pressed on a plane, and a chain of second differences: bodies as stiff in one way
 * and as soft in another as the solver meets, by cold certified solves in units of CHOLMOD's linear solve of the same
 * K. */
#include "bench/bench.h"
#include "chen_harker.h"
#include "core/clock.h"

#include <math.h>

enum { RUNS = 11 };

/* A beam of height 1, clamped at its left end, `gap` above the plane. */
static uz_problem beam_problem(int64_t cells, int64_t layers, const char *element, double load, double gap)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = bench_paper_scene(3)};
    uz_scene *scene = &problem.scene;
    scene->model = UZ_PLANE_STRAIN;
    scene->thickness = 1.0;
    scene->box = (uz_box){.size = {1000.0, 1.0}, .cells = {cells, layers}, .dim = 2};
    snprintf(scene->box.element, sizeof scene->box.element, "%s", element);
    scene->loads[0].v[1] = -load;
    scene->n_loads = 1; /* the one on the top */
    scene->contacts[0].point[1] = -gap;
    return problem;
}

static const struct {
    const char *name, *element; /* NULL: the chain */
    int64_t cells, layers;
    double load, gap;
} bodies[] = {{"beam_quad4_m400", "quad4", 400, 2, 1e-3, 0.01},   {"beam_quad4_m1000", "quad4", 1000, 4, 1e-3, 0.01},
              {"beam_quad4_m2000", "quad4", 2000, 4, 1e-3, 0.01}, {"beam_quad8_m400", "quad8", 200, 2, 1e-4, 0.5},
              {"beam_quad8_m2000", "quad8", 1000, 2, 1e-4, 0.5},  {"chenhark_d5000", NULL, 5000, 0, 0.0, 0.0}};

const char *bench_slender_name(int which)
{
    return which < (int)(sizeof bodies / sizeof bodies[0]) ? bodies[which].name : NULL;
}

bool bench_slender(bench_value *ratio, bench_value *milliseconds, int64_t *steps, int which)
{
    uz_settings settings = uz_settings_default();
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_qp qp = {0}; /* of the beam */
    uz_error err;
    double ratios[RUNS], own[RUNS];
    const int64_t chain = bodies[which].cells;
    settings.relative_error = 1e-8;
    if (bodies[which].element)
        problem = beam_problem(bodies[which].cells, bodies[which].layers, bodies[which].element, bodies[which].load,
                               bodies[which].gap);
    bool ok = (bodies[which].element ? uz_scene_to_qp(&qp, NULL, &problem.scene, &err)
                                     : chen_harker_qp(&problem.qp, chain, chain / 2, chain / 10, &err)) == UZ_OK;
    const uz_qp *matrices = bodies[which].element ? &qp : &problem.qp;
    const bench_ordering ordering = ok ? bench_better_ordering(&matrices->K, matrices->p) : BENCH_AMD;
    for (int k = -1; ok && k < RUNS; k++) { /* the first does not count */
        const bench_linear linear = bench_cholmod(&matrices->K, matrices->p, ordering);
        uz_result *result = NULL;
        const double start = uz_seconds();
        const uz_status status = uz_solve(&result, &problem, &settings, NULL, NULL, &err);
        const double seconds = uz_seconds() - start;
        ok = status == UZ_OK && result->summary.outcome == UZ_CONVERGED;
        *steps = ok ? result->summary.iterations : 0;
        if (k >= 0) {
            ratios[k] = seconds / (linear.analyze + linear.factorize + linear.solve);
            own[k] = 1e3 * seconds;
        }
        uz_result_free(result);
    }
    if (ok) {
        *ratio = bench_summarise(ratios, RUNS);
        *milliseconds = bench_summarise(own, RUNS);
    }
    uz_qp_clear(&qp);
    uz_problem_clear(&problem);
    return ok;
}
