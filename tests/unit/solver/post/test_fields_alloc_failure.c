/* Each allocation on the way from an answer to its fields fails once: the call must say so, publish nothing and keep
 * nothing. zlib's own count too. */
#include "failing_heap.h"
/* first: the heap's names */
#include "assembly/assembly.h"
#include "body_fixture.h"
#include "post/evaluate.h"

static const unsigned EVERYTHING = (1u << 11) - 1;

typedef uz_status (*attempt)(const uz_scene *scene, const uz_field_source *answer, uz_error *err);

static uz_status fields(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    uz_fields out;
    uz_status status = uz_fields_compute(&out, scene, answer, EVERYTHING, NULL, err);
    CHECK((out.stress != NULL) == (status == UZ_OK) && (out.pressure != NULL) == (status == UZ_OK));
    uz_fields_clear(&out);
    return status;
}

static uz_status vtu(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    char *text;
    size_t len;
    uz_status status = uz_vtu_write(&text, &len, scene, answer, EVERYTHING, NULL, err);
    CHECK((text != NULL) == (status == UZ_OK) && (len > 0) == (status == UZ_OK));
    free(text);
    return status;
}

/* A history of five rows, all of whose columns are one. */
static uz_status convergence(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    static const double rows[5] = {1, 2, 4, 0, 8};
    const uz_curve curve = {"a", rows, rows, rows, rows, rows, rows, rows, 5, 1, NAN};
    const uz_plot how = {.title = "title"};
    char *svg;
    size_t len;
    (void)scene;
    (void)answer;
    uz_status status = uz_picture_convergence(&svg, &len, &curve, 1, &how, err);
    CHECK((svg != NULL) == (status == UZ_OK) && (len > 0) == (status == UZ_OK));
    free(svg);
    return status;
}

static uz_status surface(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    uz_surface out;
    uz_status status = uz_surface_compute(&out, scene, answer, EVERYTHING, 0, NULL, err);
    CHECK((out.position != NULL) == (status == UZ_OK) && (out.arc.x != NULL) == (status == UZ_OK));
    uz_surface_clear(&out);
    return status;
}

static const uz_plane MIDDLE = {{1, 1.1, 2}, {0.1, 1, 0}};

static uz_status section(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    uz_surface out;
    uz_status status = uz_section_compute(&out, scene, answer, &MIDDLE, EVERYTHING, 0, NULL, err);
    CHECK((out.position != NULL) == (status == UZ_OK) && (out.von_mises.x != NULL) == (status == UZ_OK));
    uz_surface_clear(&out);
    return status;
}

static uz_status picture(const uz_scene *scene, const uz_field_source *answer, uz_error *err)
{
    char *svg;
    size_t len;
    const uz_picture how = {.colour = UZ_FIELD_DISPLACEMENTS, .width = 200};
    uz_status status = uz_picture_deformed(&svg, &len, scene, answer, &how, NULL, err);
    CHECK((svg != NULL) == (status == UZ_OK) && (len > 0) == (status == UZ_OK));
    free(svg);
    return status;
}

static bool fail_at(attempt run, const uz_scene *scene, const uz_field_source *answer, long n)
{
    uz_error err = {0};
    heap_watch(n);
    const uz_status status = run(scene, answer, &err);
    heap.watching = false;
    CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "allocation %ld: %s", n, err.message);
    CHECK_INT(err.status, status);
    CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    return heap.failed;
}

static long fail_each(attempt run, const uz_scene *scene, const uz_field_source *answer)
{
    long n = 0;
    while (n < 2000 && fail_at(run, scene, answer, n))
        n++;
    return n;
}

/* Evaluates a solved scene once more. */
static bool evaluate_at(const uz_scene *scene, const uz_body_model *model, const uz_result *answer, long n)
{
    uz_error err = {0};
    uz_result again = {.m = answer->m,
                       .n_nodes = answer->n_nodes,
                       .u = answer->u,
                       .r = answer->r,
                       .g = answer->g,
                       .mesh = answer->mesh};
    heap_watch(n);
    const uz_status status = uz_evaluate(&again, model, scene, NULL, &err);
    free(again.pressure);
    uz_evaluation_free(again.evaluation);
    heap.watching = false;
    CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "allocation %ld: %s", n, err.message);
    CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    return heap.failed;
}

static uz_scene warm_scene(const char *element)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){2, 1, 0}, (int64_t[3]){4, 2, 0});
    s.materials[0].expansion = 1e-5;
    body_hold(&s, "left", 0, NAN, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "top", 1, 0, 0);
    body_load(&s, UZ_LOAD_TEMPERATURE, "all", 20, 0, 0);
    body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 1, 0});
    return s;
}

static void check_element(const char *element)
{
    uz_scene s = warm_scene(element);
    uz_result *result = body_solve(&s, 1e-8);
    const uz_field_source answer = {result->u, result->r, result->g, 2 * result->n_nodes, result->m};
    uz_body_model model = body_model(&s);
    CHECK(fail_each(fields, &s, &answer) > 30);
    CHECK(fail_each(vtu, &s, &answer) > 40);
    CHECK(fail_each(convergence, &s, &answer) > 3);
    CHECK(fail_each(surface, &s, &answer) > 40);
    CHECK(fail_each(picture, &s, &answer) > 30);
    long n = 0;
    while (n < 1000 && evaluate_at(&s, &model, result, n))
        n++;
    CHECK(n >= 10);
    uz_body_model_clear(&model);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(every_allocation_may_fail)
{
    check_element("quad4");
    check_element("quad8");
}

/* Solids have obstacles and inner nodes to draw, or not. Nothing is solved: any answer will do. */
TEST(every_allocation_of_a_solid_may_fail)
{
    static double u[3 * 60], r[20], g[20];
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){3, 2, 4}, (int64_t[3]){3, 2, 4});
    body_hold(&s, "top", 0, 0, 0);
    s.contacts[s.n_contacts++] =
        (uz_contact){.on = "bottom", .kind = UZ_OBSTACLE_ROUND, .point = {1, -9, 2}, .radius = 9};
    const uz_field_source answer = {u, r, g, 3 * 60, 20};
    for (int i = 0; i < 20; i++)
        r[i] = -i;
    CHECK(fail_each(picture, &s, &answer) > 20);
    CHECK(fail_each(section, &s, &answer) > 10);
    uz_surface out;
    uz_error err = {0};
    for (long n = 0;; n++) {
        heap_watch(n);
        const uz_status status = uz_surface_compute(&out, &s, &answer, EVERYTHING, 0, NULL, &err);
        uz_surface_clear(&out);
        heap.watching = false;
        CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK) && heap.live == 0, "allocation %ld: %s", n,
                  err.message);
        if (!heap.failed)
            break;
    }
    uz_scene_clear(&s);
}

static bool at_once(void *ctx)
{
    (void)ctx;
    return true;
}

TEST(fields_can_be_cancelled)
{
    uz_scene s = warm_scene("quad4");
    uz_result *result = body_solve(&s, 1e-8);
    const uz_field_source answer = {result->u, result->r, result->g, 2 * result->n_nodes, result->m};
    const uz_hooks hooks = {.cancelled = at_once};
    uz_fields out;
    char *text;
    size_t len;
    CHECK_INT(uz_fields_compute(&out, &s, &answer, UZ_FIELD_STRESS, &hooks, NULL), UZ_ERR_CANCELLED);
    CHECK(!out.stress);
    CHECK_INT(uz_fields_compute(&out, &s, &answer, UZ_FIELD_STRESS_GAUSS, &hooks, NULL), UZ_ERR_CANCELLED);
    CHECK_INT(uz_vtu_write(&text, &len, &s, &answer, UZ_FIELD_DISPLACEMENTS, &hooks, NULL), UZ_ERR_CANCELLED);
    CHECK(!text && len == 0);
    uz_surface drawn;
    CHECK_INT(uz_surface_compute(&drawn, &s, &answer, UZ_FIELD_VON_MISES, 0, &hooks, NULL), UZ_ERR_CANCELLED);
    CHECK(!drawn.position && !drawn.triangle);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(answers_of_another_scene_are_refused)
{
    uz_scene s = warm_scene("quad4");
    uz_result *result = body_solve(&s, 1e-8);
    const int64_t n_u = 2 * result->n_nodes;
    const uz_field_source shorter = {result->u, result->r, result->g, n_u - 2, result->m},
                          fewer = {result->u, result->r, result->g, n_u, result->m - 1}, none = {.n_u = n_u};
    uz_fields out;
    uz_error err;
    CHECK_INT(uz_fields_compute(&out, &s, &shorter, UZ_FIELD_STRAIN, NULL, &err), UZ_ERR_SIZE);
    CHECK_STR(err.where, "u");
    CHECK_INT(uz_fields_compute(&out, &s, &shorter, UZ_FIELD_PRESSURE, NULL, NULL), UZ_OK);
    uz_fields_clear(&out);
    CHECK_INT(uz_fields_compute(&out, &s, &fewer, UZ_FIELD_PRESSURE, NULL, &err), UZ_ERR_SIZE);
    CHECK_STR(err.where, "r");
    CHECK_INT(uz_fields_compute(&out, &s, &none, UZ_FIELD_VON_MISES, NULL, NULL), UZ_ERR_SIZE);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(fields_have_names)
{
    uz_field field;
    for (unsigned bit = 1; bit <= UZ_FIELD_MATERIALS; bit <<= 1) {
        const char *name = uz_field_name((uz_field)bit);
        CHECK(uz_field_parse(&field, name, strlen(name)) && field == (uz_field)bit);
    }
    CHECK_STR(uz_field_name((uz_field)3), "unknown");
    CHECK(!uz_field_parse(&field, "stress", 5) && !uz_field_parse(&field, "unknown", 7));
}
