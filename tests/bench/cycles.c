/* cycles.c: conjugate gradients on boxes, preconditioned by their multigrid: how their number grows with the grid and
 * with the shape of the cells. */
#include "bench/bench.h"

#include "amg/amg.h"
#include "assembly/assembly.h"
#include "brick/brick.h"
#include "core/random.h"

#include <math.h>
#include <stdlib.h>

/* Cells along each side of a body whose length along x is `aspect` times its others. */
static const struct {
    int64_t cells;
    double aspect;
} BOXES[] = {{16, 1.0},  {32, 1.0},  {64, 1.0}, {96, 1.0}, {16, 10.0},
             {32, 10.0}, {64, 10.0}, {16, 0.1}, {32, 0.1}, {64, 0.1}};
enum { COUNT = sizeof BOXES / sizeof BOXES[0] };

/* From 0, for a load of random numbers, until r'M^-1 r is 1e-16 of what it was; -1: not solved. */
static int64_t count_steps(const uz_body_model *model)
{
    const uz_cg_stop stop = {.relative = 1e-8, .max_iterations = 500, .deadline = INFINITY};
    uz_multigrid *mg = NULL;
    uz_cg cg = {0};
    uz_cg_info info = {0};
    uint64_t state = 1;
    double *x = calloc((size_t)model->d, sizeof *x), *b = malloc((size_t)model->d * sizeof *b);
    bool ok = x && b && uz_brick_multigrid(&mg, model->brick, 0, NULL) == UZ_OK && uz_cg_init(&cg, mg, NULL) == UZ_OK;
    for (int64_t j = 0; ok && j < model->d; j++)
        b[j] = uz_normal(&state);
    ok = ok && uz_cg_solve(&info, x, &cg, &model->K, b, &stop, NULL) == UZ_OK && info.met;
    uz_cg_clear(&cg);
    uz_multigrid_free(mg);
    free(x);
    free(b);
    return ok ? info.iterations : -1;
}

bool bench_cycles(FILE *json)
{
    bool ok = true;
    fprintf(json, "\"boxes\": [\n");
    for (int k = 0; k < COUNT; k++) {
        const int64_t n = BOXES[k].cells;
        uz_material material = {.on = "all", .young = 1000, .poisson = 0.3};
        uz_support support = {.on = "left"};
        const uz_scene scene = {
            .model = UZ_SOLID,
            .box = {.size = {40 * BOXES[k].aspect, 40, 40}, .cells = {n, n, n}, .dim = 3, .element = "hex8"},
            .materials = &material,
            .n_materials = 1,
            .supports = &support,
            .n_supports = 1};
        uz_body_model model;
        if (uz_body_model_build(&model, &scene, UZ_BODY_CELLS, NULL) != UZ_OK)
            return false;
        const int64_t steps = model.brick ? count_steps(&model) : -1;
        fprintf(json, "%s{\"cells\": %lld, \"aspect\": %g, \"unknowns\": %lld, \"iterations\": %lld}",
                k > 0 ? ",\n" : "", (long long)n, BOXES[k].aspect, (long long)model.d, (long long)steps);
        printf("%6lld %6g %8lld\n", (long long)n, BOXES[k].aspect, (long long)steps);
        ok = ok && steps > 0;
        uz_body_model_clear(&model);
    }
    fprintf(json, "\n]");
    return ok;
}
