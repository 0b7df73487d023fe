/* oblique.c: what a plane costs that is not along an axis: a cold solve beside that of the same body on a plane that
 * is. The planes differ by so little that nothing but the way they enter the equations does. */
#include "bench/bench.h"
#include "core/clock.h"

#include <math.h>

enum { RUNS = 9 };

static double seconds_of_solve(const uz_qp *qp)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    double start = uz_seconds();
    uz_status status = uz_solve(&result, &problem, &settings, NULL, NULL, NULL);
    double seconds = uz_seconds() - start;
    bool ok = status == UZ_OK && result->summary.outcome == UZ_CONVERGED;
    uz_result_free(result);
    return ok ? seconds : NAN;
}

bool bench_oblique(bench_value *ratio, int64_t cells)
{
    uz_qp oblique = {0}, along = {0};
    double ratios[RUNS];
    uz_scene scene = bench_paper_scene(cells);
    bool ok = uz_scene_to_qp(&along, NULL, &scene, NULL) == UZ_OK;
    scene.contacts[0].normal[0] = 1e-7;
    ok = ok && uz_scene_to_qp(&oblique, NULL, &scene, NULL) == UZ_OK;
    for (int k = 0; ok && k < RUNS; k++) {
        ratios[k] = seconds_of_solve(&oblique) / seconds_of_solve(&along);
        ok = !isnan(ratios[k]);
    }
    if (ok)
        *ratio = bench_summarise(ratios, RUNS);
    uz_qp_clear(&oblique);
    uz_qp_clear(&along);
    uz_scene_clear(&scene);
    return ok;
}
