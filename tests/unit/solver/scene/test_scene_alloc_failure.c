/* Each allocation on the way from a scene to matrices fails once: the call must say so, publish nothing and keep
 * nothing. Linked with malloc, calloc, realloc and free wrapped. */
#include "assembly/assembly.h"
#include "body_fixture.h"
#include "failing_heap.h"
#include "harness.h"
#include "scene_fixture.h"

typedef uz_status (*attempt)(const uz_scene *scene, uz_error *err);

/* Runs with the 1st, 2nd, ... allocation failing until it succeeds. Returns how many could fail. */
static long fail_each(attempt run, const uz_scene *scene)
{
    for (long n = 0; n < 1000; n++) {
        uz_error err = {0};
        heap_watch(n);
        const uz_status status = run(scene, &err);
        heap.watching = false;
        CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
        CHECK_INT(err.status, status);
        CHECK(!heap.failed || err.message[0] != '\0');
        CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
        if (!heap.failed)
            return n;
    }
    return -1;
}

static uz_status to_qp(const uz_scene *scene, uz_error *err)
{
    uz_qp qp;
    uz_mesh_info info;
    const uz_status status = uz_scene_to_qp(&qp, &info, scene, err);
    CHECK((qp.K.ptr != NULL) == (status == UZ_OK) && (info.xyz != NULL) == (status == UZ_OK));
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    return status;
}

static uz_status key(const uz_scene *scene, uz_error *err)
{
    unsigned char *bytes;
    size_t len;
    const uz_status status = uz_scene_body_key(&bytes, &len, scene, err);
    CHECK((bytes != NULL) == (status == UZ_OK));
    free(bytes);
    return status;
}

static uz_status copy_info(const uz_scene *scene, uz_error *err)
{
    static double xyz[8];
    static int64_t node[2];
    uz_mesh_info copy, info = {.dim = 2, .n_nodes = 4, .xyz = xyz, .contact_node = node};
    info.contact_area = info.contact_normal = xyz;
    info.contact_of = info.contact_face = node;
    (void)scene;
    const uz_status status = uz_mesh_info_copy(&copy, &info, 1, err);
    CHECK((copy.xyz != NULL) == (status == UZ_OK));
    uz_mesh_info_clear(&copy);
    return status;
}

static uz_status estimate(const uz_scene *scene, uz_error *err)
{
    const long asked = heap.until_failure;
    heap.until_failure = -1;
    uz_body_model model = build_body(scene);
    double *u = zeros(3 * model.mesh.n_nodes), *f = zeros(3 * model.mesh.n_nodes);
    u[5] = 1;
    heap.until_failure = asked;
    uz_status status = isnan(uz_estimate_mesh_error(NULL, NULL, &model, scene, u)) ? UZ_ERR_MEMORY : UZ_OK;
    if (status != UZ_OK)
        snprintf(err->message, sizeof err->message, "no estimate");
    err->status = status;
    if (status == UZ_OK)
        status = uz_nodal_loads(f, &model, scene, err);
    free(u);
    free(f);
    uz_body_model_clear(&model);
    return status;
}

TEST(every_allocation_may_fail)
{
    uz_scene scene = paper_scene(4, 2);
    CHECK(fail_each(to_qp, &scene) > 20);
    CHECK(fail_each(uz_scene_check, &scene) > 20);
    scene.contacts[0].normal[0] = 1; /* turned dofs */
    CHECK(fail_each(to_qp, &scene) > 23);
    CHECK(fail_each(uz_scene_check, &scene) > 23);
    CHECK(fail_each(key, &scene) >= 2);
    CHECK_INT(fail_each(copy_info, &scene), 6);
    uz_scene_clear(&scene);
}

/* Springs, inclined supports, two materials, a mesh in numbers and every kind of load. */
static uz_scene rich_scene(void)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 1}, (int64_t[3]){2, 1, 1});
    s.n_materials = 0;
    for (int k = 0; k < 2; k++) {
        uz_material *material = &s.materials[s.n_materials++];
        *material = (uz_material){.on = "a", .young = 1e3, .poisson = 0.45, .density = 1, .expansion = 1e-5};
        material->on[0] = (char)('a' + k);
    }
    body_give_mesh(&s, NULL);
    for (int k = 0; k < 2; k++) {
        uz_given_group *group = &s.given.groups[s.given.n_groups++];
        group->name[0] = (char)('a' + k);
        group->n_elements = 1;
        group->element = body_room(1, sizeof *group->element);
        group->element[0] = k;
    }
    body_hold_normal(&s, "left", (double[3]){1, 1, 0}, 1e-3);
    body_spring(&s, "right", 3, 4, 5);
    body_load(&s, UZ_LOAD_TEMPERATURE, "a", 20, 0, 0);
    body_load(&s, UZ_LOAD_FORCE, "top", 1, -2, 3);
    body_load(&s, UZ_LOAD_GRAVITY, "b", 1, -2, 3);
    body_plane(&s, "bottom", (double[3]){0, -1, 0}, (double[3]){0.1, 1, 0});
    return s;
}

TEST(every_allocation_for_supports_and_materials_may_fail)
{
    uz_scene s = rich_scene();
    CHECK(fail_each(to_qp, &s) > 30);
    CHECK(fail_each(uz_scene_check, &s) > 30);
    CHECK(fail_each(key, &s) >= 3);
    CHECK(fail_each(estimate, &s) >= 6);
    uz_scene_clear(&s);
}

/* A round obstacle, and a second part of the mesh on the first: elements of the same nodes twice over. */
TEST(every_allocation_for_obstacles_may_fail)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){1, 1, 0}, (int64_t[3]){1, 1, 0});
    double y[2] = {0, 0}, x[2] = {-5, 5};
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "top", NAN, 0, NAN);
    uz_contact *contact = body_plane(&s, "bottom", (double[3]){0, -9, 0}, (double[3]){0, 1, 0});
    contact->kind = UZ_OBSTACLE_POLYLINE;
    contact->n_x = 2;
    contact->x = x;
    contact->y = y;
    CHECK(fail_each(to_qp, &s) > 25);
    CHECK(fail_each(uz_scene_check, &s) > 25);
    contact->x = contact->y = NULL;
    /* A circle between the two nodes: a row inside the side; and where the body has moved down on it. */
    const double down[8] = {0, -0.02, 0, -0.02, 0, -0.02, 0, -0.02};
    contact->kind = UZ_OBSTACLE_ROUND;
    contact->point[0] = 0.5;
    contact->point[1] = -0.1;
    contact->radius = 0.11;
    for (int k = 0; k < 2; k++) {
        uz_body_model model = build_body(&s);
        const uz_inner_place *inner = uz_row_inner(&model, model.m - 1);
        CHECK(model.m == 3 && inner && !uz_row_inner(&model, 0));
        CHECK_REL(inner->share[0] + inner->share[1], 1.0, 1e-15);
        CHECK_REL(inner->share[0], 0.5, 1e-9);
        CHECK_REL(inner->gap, k == 0 ? -0.01 : -0.03, 1e-9);
        CHECK_REL(model.info.contact_area[2], model.info.contact_area[0] + model.info.contact_area[1], 1e-12);
        uz_body_model_clear(&model);
        CHECK(fail_each(to_qp, &s) > 25);
        s.place = down;
    }
    s.place = NULL;
    uz_scene_clear(&s);
}

TEST(every_allocation_for_a_second_part_may_fail)
{
    static double xyz[16] = {0, 0, 1, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 2, 0, 2};
    static int64_t first[3] = {0, 4, 8}, node[8] = {0, 1, 2, 3, 4, 5, 6, 7}, ends[2] = {0, 2};
    static int64_t low[2] = {0, 1}, high[2] = {6, 7}, lower[2] = {2, 3}, upper[2] = {4, 5}, side[4] = {0, 3, 4, 7};
    static unsigned char kind[2] = {UZ_QUAD4, UZ_QUAD4};
    uz_given_group groups[] = {{.name = "low", .n_faces = 1, .face_first = ends, .face_node = low},
                               {.name = "high", .n_faces = 1, .face_first = ends, .face_node = high},
                               {.name = "lower", .n_faces = 1, .face_first = ends, .face_node = lower},
                               {.name = "upper", .n_faces = 1, .face_first = ends, .face_node = upper},
                               {.name = "side", .n_nodes = 4, .node = side}};
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){1, 1, 0}, (int64_t[3]){1, 1, 0});
    s.source = UZ_MESH_GIVEN;
    s.given = (uz_given_mesh){.dim = 2,
                              .n_nodes = 8,
                              .xyz = xyz,
                              .n_elements = 2,
                              .kind = kind,
                              .first = first,
                              .node = node,
                              .groups = groups,
                              .n_groups = 5};
    body_hold(&s, "side", 0, NAN, NAN);
    body_hold(&s, "low", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "high", 5, 0, 0);
    uz_contact *contact = body_plane(&s, "upper", (double[3]){0}, (double[3]){0});
    contact->kind = UZ_OBSTACLE_BODY;
    snprintf(contact->with, sizeof contact->with, "lower");
    CHECK(fail_each(uz_scene_check, &s) > 40);
    body_hold(&s, "high", NAN, 0, NAN);
    CHECK(fail_each(to_qp, &s) > 40);
    contact->between = UZ_CONTACT_SURFACES;
    CHECK(fail_each(to_qp, &s) > 50);
    s.given = (uz_given_mesh){0};
    uz_scene_clear(&s);
}

/* A strip bent to most of a ring: its inside faces itself. */
static void bend(double x[3])
{
    const double turn = 1.7 * x[0] * acos(-1), r = 2 - x[1];
    x[0] = r * sin(turn);
    x[1] = -r * cos(turn);
}

TEST(every_allocation_for_contact_with_itself_may_fail)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){1, 1, 0}, (int64_t[3]){8, 1, 0});
    body_give_mesh(&s, bend);
    body_hold(&s, "left", 0, 0, NAN);
    uz_contact *contact = body_plane(&s, "top", (double[3]){0}, (double[3]){0});
    contact->kind = UZ_OBSTACLE_BODY;
    contact->faceted = true;
    snprintf(contact->with, sizeof contact->with, "top");
    for (int k = 0; k < 2; k++) {
        contact->between = k == 0 ? UZ_CONTACT_SURFACES : UZ_CONTACT_NODES;
        CHECK(fail_each(to_qp, &s) > 70);
    }
    uz_scene_clear(&s);
}

TEST(error_estimate_without_memory_is_nan)
{
    uz_scene scene = paper_scene(4, 2);
    uz_body_model model = build_body(&scene);
    double *u = solve_linear(&model, &scene);
    for (long n = 0; n < 2; n++) {
        heap_watch(n);
        CHECK(isnan(uz_estimate_mesh_error(NULL, NULL, &model, NULL, u)));
        heap.watching = false;
    }
    CHECK(uz_estimate_mesh_error(NULL, NULL, &model, NULL, u) > 0);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}
