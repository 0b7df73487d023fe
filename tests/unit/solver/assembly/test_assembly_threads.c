/* K and loads that threads share are those of one thread, to the last bit, and so is what is said of a bad element. */
#include "assembly/parts.h"
#include "body_fixture.h"
#include "core/aside.h"
#include "sanitized.h"
#include "scene/subdivide.h"

enum { THREADS = 3, N = 28 };

static void bend(double x[3])
{
    const double r = 1 + x[2], t = 1.2 * x[0];
    x[0] = r * sin(t);
    x[2] = r * cos(t);
}

/* A bent cube on springs, a side of it held along an inclined normal. */
static uz_scene bent_cube(const int64_t *subdivided, int64_t n)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){1, 1, 1}, (int64_t[3]){N, N, N});
    body_give_mesh(&s, bend);
    body_hold(&s, "left", 0, 0, 0);
    body_hold_normal(&s, "right", (double[3]){1, 0.3, 0}, 0.1);
    body_spring(&s, "bottom", 1, 2, 3);
    s.bisected = subdivided;
    s.n_bisected = n;
    return s;
}

static void check_equal(const uz_csc *A, const uz_csc *B)
{
    CHECK_INT(A->cols, B->cols);
    CHECK_INT(A->ptr[A->cols], B->ptr[B->cols]);
    const size_t entries = (size_t)A->ptr[A->cols];
    CHECK(memcmp(A->ptr, B->ptr, (size_t)(A->cols + 1) * sizeof *A->ptr) == 0);
    CHECK(memcmp(A->idx, B->idx, entries * sizeof *A->idx) == 0);
    CHECK(memcmp(A->val, B->val, entries * sizeof *A->val) == 0);
}

static void check_threads(const uz_scene *scene)
{
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    uz_aside_allow(1);
    uz_body_model one = body_model(scene);
    for (int threads = more_threads(1, THREADS); threads <= THREADS; threads++) {
        uz_aside_allow(threads);
        (void)uz_aside_used();
        uz_body_model more = body_model(scene);
        CHECK_INT(uz_aside_used(), threads);
        check_equal(&one.K, &more.K);
        check_equal(&one.K_fixed, &more.K_fixed);
        uz_body_model_clear(&more);
    }
    uz_aside_allow(1);
    uz_body_model_clear(&one);
}

TEST(threads_assemble_the_same_bits)
{
    uz_scene s = bent_cube(NULL, 0);
    check_threads(&s);
    uz_scene_clear(&s);
}

/* An element whose hanging nodes lie amid nodes that are far from it by their numbers. */
TEST(threads_assemble_hanging_nodes)
{
    static const int64_t SUBDIVIDED[] = {UZ_SUBDIVIDED, 3, 5, N * N * N / 2, N * N * N - 1};
    uz_scene s = bent_cube(SUBDIVIDED, sizeof SUBDIVIDED / sizeof *SUBDIVIDED);
    check_threads(&s);
    uz_scene_clear(&s);
}

TEST(the_first_bad_element_is_named)
{
    uz_scene s = bent_cube(NULL, 0);
    uz_body_model body = body_model(&s);
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    const int64_t node = (N + 1) * (N + 1) * (N - 2) + (N + 1) * 5 + 5;
    body.mesh.xyz[3 * node] += 1; /* elements of the last thread */
    body.mesh.xyz[3 * (node / 2)] += 1;
    char said[sizeof((uz_error *)0)->message] = "";
    for (int threads = 1; threads <= THREADS; threads = more_threads(threads, THREADS)) {
        uz_error err = {0};
        uz_csc_clear(&body.K);
        uz_csc_clear(&body.K_fixed);
        uz_aside_allow(threads);
        CHECK_INT(uz_build_stiffness(&body, NULL, &err), UZ_ERR_SCENE);
        CHECK_STR(err.where, "/mesh/elements");
        if (threads == 1)
            strcpy(said, err.message);
        CHECK_STR(err.message, said);
    }
    uz_aside_allow(1);
    uz_body_model_clear(&body);
    uz_scene_clear(&s);
}

/* What a pressure or traction does, side by side in their order. */
static void add_sides(double *f, const uz_body_model *body, const uz_load *load)
{
    uz_error err = {0};
    const uz_group *group = uz_mesh_group(&body->mesh, load->on, "", &err);
    for (int64_t i = 0; i < group->n_faces; i++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES], pressure[UZ_FACE_NODES], own[3 * UZ_FACE_NODES] = {0};
        uz_body_side(&side, xyz, node, body, group->face[i]);
        for (int a = 0; a < side.nodes; a++)
            pressure[a] = load->value;
        if (load->kind == UZ_LOAD_PRESSURE)
            uz_side_add_pressure(own, &side, pressure);
        else
            uz_side_add_traction(own, &side, load->v);
        for (int k = 0; k < 3 * side.nodes; k++)
            f[3 * node[k / 3] + k % 3] += own[k];
    }
}

TEST(threads_load_the_same_bits)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){1, 1, 1}, (int64_t[3]){N, N, N});
    uz_error err = {0};
    body_give_mesh(&s, bend);
    body_hold(&s, "left", 0, 0, 0);
    body_load(&s, UZ_LOAD_PRESSURE, "top", 2, 0, 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", 1, -2, 0.5);
    uz_body_model body = body_model(&s);
    const int64_t n = 3 * body.mesh.n_nodes;
    double *f = calloc((size_t)n, sizeof *f), *p = calloc((size_t)body.d, sizeof *p);
    double *own = malloc((size_t)n * sizeof *own), *q = malloc((size_t)body.d * sizeof *q);
    for (int64_t k = 0; k < s.n_loads; k++)
        add_sides(f, &body, &s.loads[k]);
    for (int64_t i = 0; i < n; i++)
        if (body.dof[i] >= 0)
            p[body.dof[i]] = f[i];
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int threads = 1; threads <= THREADS; threads = more_threads(threads, THREADS)) {
        uz_aside_allow(threads);
        (void)uz_aside_used();
        CHECK_INT(uz_nodal_loads(own, &body, &s, &err), UZ_OK);
        CHECK_INT(uz_aside_used(), threads);
        CHECK(memcmp(own, f, (size_t)n * sizeof *f) == 0);
        memset(q, 0xff, (size_t)body.d * sizeof *q);
        uz_gather_nodal(q, &body, own);
        CHECK_INT(uz_aside_used(), threads);
        CHECK(memcmp(q, p, (size_t)body.d * sizeof *p) == 0);
    }
    uz_aside_allow(1);
    free(f);
    free(p);
    free(own);
    free(q);
    uz_body_model_clear(&body);
    uz_scene_clear(&s);
}
