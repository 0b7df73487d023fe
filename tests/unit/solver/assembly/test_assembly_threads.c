/* K that threads share is that of one thread, to the last bit, and so is what is said of a bad element. */
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
