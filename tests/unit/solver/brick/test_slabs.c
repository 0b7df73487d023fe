/* What threads compute of a box in slabs is what one computes, to the last bit: its diagonal, the products, a cycle, a
 * start on coarser grids, conjugate gradients in either precision, and what a certificate has of it. */
#include "brick/brick.h"
#include "certificate/brick_product.h"
#include "core/aside.h"
#include "harness.h"
#include "sanitized.h"
#include "scene_fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 3 };

static uz_body_model make_cells_of(uz_scene *scene, double poisson, int64_t nx, int64_t ny, int64_t nz)
{
    uz_body_model cells;
    uz_error err = {0};
    *scene = box_scene(60, 20, nx, ny);
    if (nz > 0) {
        scene->model = UZ_SOLID;
        scene->box.dim = 3;
        scene->box.size[2] = 30;
        scene->box.cells[2] = nz;
        snprintf(scene->box.element, sizeof scene->box.element, "hex8");
    } else {
        scene->model = UZ_PLANE_STRAIN;
    }
    scene->materials[0].poisson = poisson;
    add_support(scene, "left", 0, 0);
    scene->supports[0].u[2] = 0;
    CHECK_INT(uz_body_model_build(&cells, scene, UZ_BODY_CELLS, &err), UZ_OK);
    CHECK(cells.brick != NULL);
    return cells;
}

/* With slabs for all threads on two grids; under a sanitizer on one, since the second has the same loops. */
static uz_body_model make_cells(uz_scene *scene, double poisson)
{
    return SANITIZED ? make_cells_of(scene, poisson, 25, 18, 23) : make_cells_of(scene, poisson, 41, 30, 37);
}

/* The same of a plane body. */
static uz_body_model make_plane(uz_scene *scene, double poisson)
{
    return SANITIZED ? make_cells_of(scene, poisson, 170, 160, 0) : make_cells_of(scene, poisson, 330, 310, 0);
}

static double number(int64_t j)
{
    return (double)(j * 7919 % 1000 - 500);
}

/* What the first steps of conjugate gradients in single precision tell. */
enum { TOLD = 4 };
typedef struct {
    double *to;
    int count;
} told;

static bool tell(void *ctx, double along, double before, double after)
{
    told *t = ctx;
    const double all[] = {along, before, after};
    memcpy(t->to + 3 * t->count, all, sizeof all);
    return ++t->count < TOLD;
}

static void check_threads(uz_body_model (*make)(uz_scene *scene, double poisson), double poisson)
{
    enum { VECTORS = 7 };
    uz_scene scene;
    uz_body_model cells = make(&scene, poisson);
    const uz_stop never = {.hooks = NULL, .deadline = INFINITY};
    uz_error err = {0};
    uz_csc K = {0};
    const int64_t d = cells.d;
    double *x = calloc((size_t)d, sizeof(double)), *one[VECTORS] = {0}, *many[VECTORS] = {0},
           *bottom = calloc((size_t)d, sizeof(double)), *top = calloc((size_t)d, sizeof(double));
    bool *held = calloc((size_t)d, sizeof *held);
    CHECK(x && bottom && top && held);
    for (int64_t j = 0; j < d; j++) {
        x[j] = number(j);
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
        uz_csc diagonal;
        CHECK_INT(uz_brick_diagonal(&diagonal, cells.brick, &err), UZ_OK);
        CHECK(memcmp(diagonal.val, K.val, (size_t)d * sizeof(double)) == 0);
        uz_csc_clear(&diagonal);
        CHECK_INT(uz_brick_multigrid(&mg, cells.brick, 0, &err), UZ_OK);
        CHECK_INT(uz_cg_init(&cg, mg, &err), UZ_OK);
        mg->kind->multiply(mg, &K, cg.room, y[0], x);
        CHECK_INT(uz_multigrid_apply(mg, &K, cg.room, y[1], x, &err), UZ_OK);
        CHECK_INT(mg->kind->start(mg, cg.room, &found, y[2], held, x, &limits, &never, &err), UZ_OK);
        CHECK(found);
        CHECK_INT(uz_brick_precise_product(y[3], y[4], y[5], cells.brick, x, x, &err), UZ_OK);
        const uz_cg_stop stop = {.relative = SANITIZED ? 1e-2 : 1e-6, .max_iterations = 100, .deadline = INFINITY};
        CHECK_INT(uz_cg_solve(&info, y[5], &cg, &K, x, &stop, &err), UZ_OK);
        CHECK(info.met);
        told t = {.to = y[6]};
        CHECK_INT(mg->kind->step_roughly(mg, cg.room, x, tell, &t, &err), UZ_OK);
        CHECK_INT(t.count, TOLD);
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

TEST(threads_give_the_same_bits)
{
    for (int k = 0; k < 2 && !SANITIZED; k++) /* two steps of the smoother, three, */
        check_threads(make_cells, k == 0 ? 0.3 : 0.43);
    check_threads(make_cells, 0.49); /* and four */
}

TEST(threads_give_the_same_bits_of_plane_bodies)
{
    for (int k = 0; k < 2 && !SANITIZED; k++)
        check_threads(make_plane, k == 0 ? 0.3 : 0.43);
    check_threads(make_plane, 0.49);
}

/* A start on coarser grids finds limits on some dofs where it finds them among those of all, in every part of the
 * planes. */
static void check_limits(uz_body_model (*make)(uz_scene *scene, double poisson))
{
    uz_scene scene;
    uz_body_model cells = make(&scene, 0.3);
    const uz_stop never = {.hooks = NULL, .deadline = INFINITY};
    const int64_t d = cells.d;
    double *x = calloc((size_t)d, sizeof(double)), *bottom = calloc((size_t)d, sizeof(double)),
           *top = calloc((size_t)d, sizeof(double)), *some = calloc((size_t)d, sizeof(double)),
           *u[2] = {calloc((size_t)d, sizeof(double)), calloc((size_t)d, sizeof(double))};
    int64_t *dof = calloc((size_t)d, sizeof *dof), low = 0, high = 0; /* that touch, in either half */
    bool *held = calloc((size_t)d, sizeof *held), found;
    const uz_limits all = {.n = d, .bottom = bottom, .top = top};
    uz_limits listed = {.dof = dof, .bottom = bottom, .top = some};
    uz_multigrid *mg;
    uz_cg cg;
    uz_error err = {0};
    CHECK(x && bottom && top && some && u[0] && u[1] && dof && held);
    for (int64_t j = 0; j < d; j++) {
        x[j] = number(j);
        bottom[j] = -INFINITY;
        top[j] = j % 7 == 0 ? 3e-5 : INFINITY;
        if (j % 7 == 0) {
            some[listed.n] = top[j];
            dof[listed.n++] = j;
        }
    }
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    uz_aside_allow(THREADS);
    CHECK_INT(uz_brick_multigrid(&mg, cells.brick, 0, &err), UZ_OK);
    CHECK_INT(uz_cg_init(&cg, mg, &err), UZ_OK);
    CHECK_INT(mg->kind->start(mg, cg.room, &found, u[0], held, x, &all, &never, &err), UZ_OK);
    CHECK(found);
    CHECK_INT(mg->kind->start(mg, cg.room, &found, u[1], held, x, &listed, &never, &err), UZ_OK);
    CHECK(found && memcmp(u[0], u[1], (size_t)d * sizeof(double)) == 0);
    for (int64_t b = 0; b < listed.n; b++) {
        *(b < listed.n / 2 ? &low : &high) += held[b];
        CHECK(!held[b] || u[1][dof[b]] == some[b]);
    }
    CHECK_MSG(low > 2 && high > 2, "%lld, %lld", (long long)low, (long long)high);
    uz_aside_allow(1);
    uz_cg_clear(&cg);
    uz_multigrid_free(mg);
    void *room[] = {x, bottom, top, some, u[0], u[1], dof, held};
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        free(room[k]);
    uz_body_model_clear(&cells);
    uz_scene_clear(&scene);
}

TEST(limits_on_some_dofs_are_found)
{
    check_limits(make_cells);
    check_limits(make_plane);
}

/* Of what is zero at most dofs a certificate's product in double precision is that in double-double. */
static void check_few_numbers(uz_body_model (*make)(uz_scene *scene, double poisson))
{
    uz_scene scene;
    uz_body_model cells = make(&scene, 0.3);
    const int64_t d = cells.d;
    double *c = calloc((size_t)d, sizeof(double)), *hi = calloc((size_t)d, sizeof(double)),
           *lo = calloc((size_t)d, sizeof(double)), *y = calloc((size_t)d, sizeof(double)), most = 0;
    uz_error err = {0};
    CHECK(c && hi && lo && y);
    for (int64_t j = 5; j < d / 3; j += 6007)
        c[j] = number(j);
    CHECK_INT(uz_brick_precise_product(hi, lo, y, cells.brick, c, c, &err), UZ_OK);
    for (int64_t j = 0; j < d; j++)
        most = fmax(most, fabs(hi[j]));
    for (int64_t j = 0; j < d; j++)
        CHECK_MSG(fabs(y[j] - hi[j]) <= 1e-14 * most, "entry %lld", (long long)j);
    CHECK(most > 0);
    free(c);
    free(hi);
    free(lo);
    free(y);
    uz_body_model_clear(&cells);
    uz_scene_clear(&scene);
}

TEST(a_product_with_few_numbers_is_that_of_all_cells)
{
    check_few_numbers(make_cells);
    check_few_numbers(make_plane);
}

static void check_room(int64_t nx, int64_t ny, int64_t nz)
{
    uz_scene scene;
    uz_body_model cells = make_cells_of(&scene, 0.3, nx, ny, nz);
    uz_multigrid *mg;
    uz_error err = {0};
    size_t bytes = 0;
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    CHECK_INT(uz_brick_multigrid(&mg, cells.brick, 0, &err), UZ_OK);
    uz_multigrid_room *room = mg->kind->room(mg, &bytes);
    CHECK(room);
    const double all = (double)(mg->bytes + bytes), predicted = uz_brick_predict_bytes(cells.brick);
    CHECK_MSG(all <= predicted, "%g of %g bytes", all, predicted);
    mg->kind->free_room(room);
    uz_multigrid_free(mg);
    uz_body_model_clear(&cells);
    uz_scene_clear(&scene);
}

/* Of a plate, whose planes are large, where threads share a sweep in a few slabs alone; and of long plane bodies. */
TEST(rooms_of_threads_take_what_is_predicted)
{
    check_room(60, 60, 10);
    check_room(600, 200, 0);
    check_room(2000, 20, 0);
    check_room(20, 2000, 0);
}
