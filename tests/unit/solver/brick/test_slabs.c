/* What threads compute of a box in slabs is what one computes, to the last bit: the products, a cycle, a start on
 * coarser grids, conjugate gradients, and what a certificate has of it. */
#include "brick/brick.h"
#include "certificate/brick_product.h"
#include "core/aside.h"
#include "harness.h"
#include "sanitized.h"
#include "scene_fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

TEST(threads_give_the_same_bits)
{
    enum { VECTORS = 6, THREADS = 3 };
    uz_scene scene = box_scene(60, 20, 41, 30);
    scene.model = UZ_SOLID;
    scene.box.dim = 3;
    scene.box.size[2] = 30;
    scene.box.cells[2] = 37;
    snprintf(scene.box.element, sizeof scene.box.element, "hex8");
    add_support(&scene, "left", 0, 0);
    scene.supports[0].u[2] = 0;
    uz_body_model cells;
    const uz_stop never = {.hooks = NULL, .deadline = INFINITY};
    uz_error err = {0};
    uz_csc K = {0};
    CHECK_INT(uz_body_model_build(&cells, &scene, UZ_BODY_CELLS, &err), UZ_OK);
    CHECK(cells.brick != NULL);
    const int64_t d = cells.d;
    double *x = calloc((size_t)d, sizeof(double)), *one[VECTORS] = {0}, *many[VECTORS] = {0},
           *bottom = calloc((size_t)d, sizeof(double)), *top = calloc((size_t)d, sizeof(double));
    bool *held = calloc((size_t)d, sizeof *held);
    CHECK(x && bottom && top && held);
    for (int64_t j = 0; j < d; j++) {
        x[j] = (double)(j * 7919 % 1000 - 500);
        bottom[j] = -INFINITY;
        top[j] = j % 7 == 0 ? 1e-3 : INFINITY;
    }
    for (int k = 0; k < VECTORS; k++) {
        one[k] = calloc((size_t)d, sizeof(double));
        many[k] = calloc((size_t)d, sizeof(double));
        CHECK(one[k] && many[k]);
    }
    const uz_limits limits = {.n = d, .bottom = bottom, .top = top};
    CHECK_INT(uz_brick_diagonal(&K, cells.brick, &err), UZ_OK);
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int threads = 1; threads <= THREADS; threads = more_threads(threads, THREADS)) {
        double **y = threads == 1 ? one : many;
        uz_multigrid *mg;
        uz_cg cg;
        uz_cg_info info;
        bool found;
        for (int k = 0; k < VECTORS; k++)
            memset(y[k], 0, (size_t)d * sizeof *y[k]);
        uz_aside_allow(threads);
        (void)uz_aside_used();
        CHECK_INT(uz_brick_multigrid(&mg, cells.brick, 0, &err), UZ_OK);
        CHECK_INT(uz_cg_init(&cg, mg, &err), UZ_OK);
        mg->kind->multiply(mg, &K, cg.room, y[0], x);
        CHECK_INT(uz_multigrid_apply(mg, &K, cg.room, y[1], x, &err), UZ_OK);
        CHECK_INT(mg->kind->start(mg, cg.room, &found, y[2], held, x, &limits, &never, &err), UZ_OK);
        CHECK(found);
        CHECK_INT(uz_brick_precise_product(y[3], y[4], y[5], cells.brick, x, x, &err), UZ_OK);
        const uz_cg_stop stop = {.relative = SANITIZED ? 1e-2 : 1e-6, .max_iterations = 50, .deadline = INFINITY};
        CHECK_INT(uz_cg_solve(&info, y[5], &cg, &K, x, &stop, &err), UZ_OK);
        CHECK(info.met);
        uz_cg_clear(&cg);
        uz_multigrid_free(mg);
        CHECK_INT(uz_aside_used(), threads);
        for (int k = 0; threads > 1 && k < VECTORS; k++)
            CHECK_MSG(memcmp(one[k], many[k], (size_t)d * sizeof(double)) == 0, "vector %d by %d threads", k, threads);
    }
    uz_aside_allow(1);
    for (int k = 0; k < VECTORS; k++) {
        free(one[k]);
        free(many[k]);
    }
    free(x);
    free(bottom);
    free(top);
    free(held);
    uz_csc_clear(&K);
    uz_body_model_clear(&cells);
    uz_scene_clear(&scene);
}
