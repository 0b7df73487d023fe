/* The split that the factor cache needs: a body built once, loads put on it, the key that says when they fit. */
#include "assembly/assembly.h"
#include "core/alloc.h"
#include "harness.h"
#include "scene_fixture.h"

/* Loads another scene on a model built before and compares with building it anew. */
TEST(load_on_a_kept_body_equals_a_new_body)
{
    uz_scene first = paper_scene(5, 3), second = paper_scene(5, 3);
    uz_body_model model;
    uz_error err = {0};
    uz_qp qp;
    second.supports[0].u[0] = 0.01;
    second.loads[0].v[0] = 3;
    second.n_loads = 1;
    second.contacts[0].point[1] = -0.25;
    CHECK(uz_body_model_build(&model, &first, UZ_BODY_SUPPORTED, &err) == UZ_OK);
    CHECK(uz_scene_to_qp(&qp, NULL, &second, NULL) == UZ_OK);
    double *p = zeros(model.d), *h = zeros(model.m), *fixed = zeros(model.n_fixed);
    CHECK(uz_body_model_load(p, h, fixed, &model, &second, &err) == UZ_OK);
    CHECK(memcmp(p, qp.p, (size_t)model.d * sizeof *p) == 0);
    CHECK(memcmp(h, qp.h, (size_t)model.m * sizeof *h) == 0);
    CHECK(h[0] == 0.25 && fixed[0] == 0.01 && fixed[1] == 0);
    double *nodal = zeros(2 * model.mesh.n_nodes);
    uz_recover_nodal(nodal, &model, p, fixed);
    CHECK(nodal[0] == 0.01 && nodal[1] == 0 && nodal[2] == p[0] && nodal[12] == 0.01 && nodal[14] == p[10]);
    uz_recover_nodal(nodal, &model, p, NULL);
    CHECK(nodal[0] == 0);
    uz_free_all(p, h, fixed, nodal);
    uz_qp_clear(&qp);
    uz_body_model_clear(&model);
    uz_scene_clear(&first);
    uz_scene_clear(&second);
}

TEST(load_of_another_body_is_refused)
{
    uz_scene scene = paper_scene(5, 3);
    uz_body_model model;
    uz_error err = {0};
    double p[64], h[64];
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_SUPPORTED, &err) == UZ_OK);
    add_support(&scene, "right", 0, NAN);
    CHECK(uz_body_model_load(p, h, NULL, &model, &scene, &err) == UZ_ERR_ARGUMENT);
    scene.n_supports--;
    memset(&err, 0, sizeof err);
    add_plane(&scene, "top", 0, 50, 0, -1);
    CHECK(uz_body_model_load(p, h, NULL, &model, &scene, &err) == UZ_ERR_ARGUMENT);
    scene.n_contacts = 0;
    memset(&err, 0, sizeof err);
    CHECK(uz_body_model_load(p, h, NULL, &model, &scene, &err) == UZ_ERR_ARGUMENT);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* An equal key does not excuse from checking what is not in it. */
TEST(load_on_a_kept_body_is_checked)
{
    uz_scene scene = paper_scene(5, 3);
    uz_body_model model = build_body(&scene);
    uz_error err = {0};
    double p[64], h[64];
    scene.supports[0].u[0] = (double)INFINITY;
    CHECK(uz_body_model_load(p, h, NULL, &model, &scene, &err) == UZ_ERR_NOT_FINITE);
    CHECK_STR(err.where, "/supports/0/ux");
    scene.supports[0].u[0] = 0;
    add_support(&scene, "left", NAN, 1);
    memset(&err, 0, sizeof err);
    CHECK(uz_body_model_load(p, h, NULL, &model, &scene, &err) == UZ_ERR_SCENE);
    CHECK_STR(err.where, "/supports/1/uy");
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(copy_of_mesh_info_is_whole)
{
    uz_scene scene = paper_scene(5, 3);
    uz_body_model model;
    uz_mesh_info copy;
    uz_error err = {0};
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_SUPPORTED, &err) == UZ_OK);
    CHECK(uz_mesh_info_copy(&copy, &model.info, model.m, &err) == UZ_OK);
    CHECK(copy.xyz != model.info.xyz && copy.contact_node != model.info.contact_node);
    CHECK(memcmp(copy.xyz, model.mesh.xyz, (size_t)copy.n_nodes * 2 * sizeof *copy.xyz) == 0);
    CHECK_INT(copy.contact_node[4], 5);
    uz_mesh_info_clear(&copy);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* Does this change of the paper's body change its key? */
static bool key_differs(const uz_scene *changed)
{
    uz_scene base = paper_scene(4, 2);
    unsigned char *a, *b;
    size_t na, nb;
    CHECK(uz_scene_body_key(&a, &na, &base, NULL) == UZ_OK);
    CHECK(uz_scene_body_key(&b, &nb, changed, NULL) == UZ_OK);
    const bool differs = na != nb || memcmp(a, b, na) != 0;
    free(a);
    free(b);
    uz_scene_clear(&base);
    return differs;
}

#define KEY(change, differs)                                                                                           \
    do {                                                                                                               \
        uz_scene s = paper_scene(4, 2);                                                                                \
        change;                                                                                                        \
        CHECK_MSG(key_differs(&s) == (differs), "%s", #change);                                                        \
        uz_scene_clear(&s);                                                                                            \
    } while (0)

TEST(key_holds_what_the_body_depends_on)
{
    KEY(s.model = UZ_PLANE_STRAIN, true);
    KEY(s.thickness = 6, true);
    KEY(s.box.size[0] = 61, true);
    KEY(s.box.origin[1] = 1, true);
    KEY(s.box.cells[0] = 5, true);
    KEY(s.materials[0].young = 1, true);
    KEY(s.materials[0].poisson = 0.2, true);
    KEY(s.supports[0].u[0] = (double)NAN, true);
    KEY(memcpy(s.supports[0].on, "right", 6), true);
    KEY(add_support(&s, "top", 0, (double)NAN), true);
    KEY(s.contacts[0].normal[0] = 0.1, true);
    KEY(memcpy(s.contacts[0].on, "right", 6), true);
    KEY(add_plane(&s, "top", 0, 0, 0, -1), true);
    KEY(s.n_contacts = 0, true);
}

static void hold_along(uz_scene *s, double nx, double ny)
{
    add_support(s, "right", (double)NAN, (double)NAN);
    uz_support *support = &s->supports[s->n_supports - 1];
    support->kind = UZ_SUPPORT_NORMAL;
    support->normal[0] = nx;
    support->normal[1] = ny;
}

static void make_round(uz_scene *s, double radius)
{
    s->contacts[0].kind = UZ_OBSTACLE_ROUND;
    s->contacts[0].point[1] = -radius;
    s->contacts[0].radius = radius;
}

TEST(key_holds_supports_obstacles_and_meshes_of_all_kinds)
{
    KEY(s.formulation = UZ_FORMULATION_INCOMPATIBLE, true);
    KEY(s.box.grading[0] = 2, true);
    KEY(s.box.grading[0] = 1, false);
    KEY(s.materials[0].density = 1, true);
    KEY(s.materials[0].expansion = 1, true);
    KEY(hold_along(&s, 1, 1), true);
    KEY(hold_along(&s, 1, 0), true);
    KEY((s.supports[0].kind = UZ_SUPPORT_SPRING, s.supports[0].spring[0] = 3), true);
    KEY(make_round(&s, 1), true);
    KEY(s.contacts[0].faceted = true, true); /* of a plane, too: refinement asks */
    KEY(s.contacts[0].feature_angle = 20, true);
    KEY((s.contacts[0].kind = UZ_OBSTACLE_BODY, memcpy(s.contacts[0].with, "top", 4)), true);
    KEY((s.contacts[0].kind = UZ_OBSTACLE_BODY, s.contacts[0].between = UZ_CONTACT_SURFACES), true);
    KEY((s.contacts[0].kind = UZ_OBSTACLE_BODY, s.contacts[0].faceted = true), true);
    KEY((s.contacts[0].kind = UZ_OBSTACLE_BODY, s.contacts[0].feature_angle = 20), true);
    KEY(s.source = UZ_MESH_GIVEN, true);
    KEY(s.all_candidates = true, true);
}

static bool same_key(const uz_scene *a, const uz_scene *b)
{
    unsigned char *x, *y;
    size_t n, m;
    CHECK(uz_scene_body_key(&x, &n, a, NULL) == UZ_OK);
    CHECK(uz_scene_body_key(&y, &m, b, NULL) == UZ_OK);
    const bool same = n == m && memcmp(x, y, n) == 0;
    free(x);
    free(y);
    return same;
}

TEST(keys_of_obstacles_and_meshes_differ_in_each_number)
{
    double x[3] = {0, 1, 2}, y[3] = {0, 1, 0}, xyz[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    int64_t first[2] = {0, 4}, node[4] = {0, 1, 2, 3}, of_group[1] = {2};
    unsigned char kind[1] = {UZ_QUAD4};
    uz_given_group group = {.name = "corner", .n_nodes = 1, .node = of_group};
    uz_scene a = paper_scene(4, 2), b;
    make_round(&a, 1);
    b = a;
    uz_contact contact = a.contacts[0], *owned = a.contacts;
    b.contacts = &contact;
    CHECK(same_key(&a, &b));
    contact.radius = 2;
    CHECK(!same_key(&a, &b));
    contact = a.contacts[0];
    contact.point[0] = 1;
    CHECK(!same_key(&a, &b));
    contact = a.contacts[0];
    contact.inside = true;
    CHECK(!same_key(&a, &b));
    contact = (uz_contact){.kind = UZ_OBSTACLE_POLYLINE, .on = "bottom", .n_x = 3, .x = x, .y = y};
    uz_contact other = contact;
    double moved[3] = {0, 1, 0.1};
    a.contacts = &other;
    CHECK(same_key(&a, &b));
    other.y = moved;
    CHECK(!same_key(&a, &b));
    other = contact;
    uz_given_mesh mesh = {.dim = 2,
                          .n_nodes = 4,
                          .xyz = xyz,
                          .n_elements = 1,
                          .kind = kind,
                          .first = first,
                          .node = node,
                          .groups = &group,
                          .n_groups = 1};
    a.source = b.source = UZ_MESH_GIVEN;
    a.given = b.given = mesh;
    CHECK(same_key(&a, &b));
    double bent[8] = {0, 0, 1, 0, 1, 1.5, 0, 1};
    b.given.xyz = bent;
    CHECK(!same_key(&a, &b));
    b.given.xyz = xyz;
    int64_t of_other[1] = {3};
    uz_given_group corner = group;
    corner.node = of_other;
    b.given.groups = &corner;
    CHECK(!same_key(&a, &b));
    a.contacts = owned;
    a.given = (uz_given_mesh){0};
    uz_scene_clear(&a);
}

/* A body knows the support of a rigid group by its place in the list. */
TEST(key_holds_the_place_of_a_rigid_group)
{
    uz_scene a = paper_scene(4, 2), b = paper_scene(4, 2);
    add_support(&a, "right", (double)NAN, (double)NAN);
    add_support(&b, "right", (double)NAN, (double)NAN);
    a.supports[1].kind = b.supports[1].kind = UZ_SUPPORT_RIGID;
    CHECK(same_key(&a, &b));
    const uz_support first = b.supports[0];
    b.supports[0] = b.supports[1];
    b.supports[1] = first;
    CHECK(!same_key(&a, &b));
    uz_scene_clear(&a);
    uz_scene_clear(&b);
}

TEST(key_leaves_out_what_the_body_does_not_depend_on)
{
    KEY(s.supports[0].u[0] = 0.5, false);
    KEY(s.n_loads = 0, false);
    KEY(s.loads[0].v[0] = 9, false);
    KEY(s.contacts[0].point[1] = -1, false);
    KEY(s.contacts[0].normal[1] = 7, false);
    KEY(s.contacts[0].normal[0] = -0.0, false);
    KEY(s.box.origin[0] = -0.0, false);
    KEY(s.box.size[2] = 5, false);
    KEY((s.supports[0].u[1] = (double)NAN, add_support(&s, "left", (double)NAN, 0)), false);
}

TEST(clears_take_null_and_zero)
{
    uz_scene scene = {0};
    uz_mesh_info info = {0};
    uz_body_model model = {0};
    uz_scene_clear(&scene);
    uz_scene_clear(NULL);
    uz_mesh_info_clear(&info);
    uz_mesh_info_clear(NULL);
    uz_body_model_clear(&model);
    uz_body_model_clear(NULL);
    uz_mesh_clear(NULL);
    CHECK(!scene.supports);
}
