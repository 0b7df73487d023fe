/* What a scene means and what it is refused for: groups, supports, contacts, rigid-body modes, the body's key. */
#include "assembly/parts.h"
#include "harness.h"
#include "scene_fixture.h"

/* ---------------------------------------------------------------- refusals */

/* Both entry points must refuse alike; "" where nothing may be refused. */
static void expect(uz_scene *scene, uz_status status, const char *where, const char *fragment)
{
    uz_error err, again;
    uz_qp qp;
    uz_mesh_info info;
    const uz_status got = uz_scene_to_qp(&qp, &info, scene, &err);
    CHECK_MSG(got == status, "%s: got %s (%s)", where, uz_status_name(got), got ? err.message : "");
    CHECK_INT(uz_scene_check(scene, &again), got);
    if (got != UZ_OK) {
        CHECK_STR(err.where, where);
        CHECK_STR(again.where, where);
        CHECK_STR(again.message, err.message);
        CHECK_MSG(strstr(err.message, fragment) != NULL, "\"%s\" lacks \"%s\"", err.message, fragment);
        CHECK(!qp.K.ptr && !qp.N.ptr && !qp.p && !qp.h && !info.xyz);
    }
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(scene);
}

/* A refusal after one change of a good scene. */
#define REFUSED(change, status, where, fragment)                                                                       \
    do {                                                                                                               \
        uz_scene s = paper_scene(4, 2);                                                                                \
        change;                                                                                                        \
        expect(&s, status, where, fragment);                                                                           \
    } while (0)

static void rename_to(char name[64], const char *other)
{
    snprintf(name, 64, "%s", other);
}

TEST(good_scene_passes)
{
    uz_scene scene = paper_scene(4, 2);
    expect(&scene, UZ_OK, "", "");
}

TEST(box_is_checked)
{
    REFUSED(s.box.cells[0] = 0, UZ_ERR_SCENE, "/mesh/box/cells/0", "at least one cell");
    REFUSED(s.box.cells[1] = -7, UZ_ERR_SCENE, "/mesh/box/cells/1", "at least one cell");
    REFUSED(s.box.cells[1] = INT64_MAX, UZ_ERR_SCENE, "/mesh/box/cells/1", "too many");
    REFUSED((s.box.cells[0] = 4000, s.box.cells[1] = 2500), UZ_ERR_SCENE, "/mesh/box/cells", "20000000");
    REFUSED(s.box.size[0] = 0, UZ_ERR_SCENE, "/mesh/box/size/0", "positive");
    REFUSED(s.box.size[1] = -20, UZ_ERR_SCENE, "/mesh/box/size/1", "positive");
    REFUSED(s.box.size[1] = (double)NAN, UZ_ERR_NOT_FINITE, "/mesh/box/size/1", "finite");
    REFUSED(s.box.origin[0] = (double)-INFINITY, UZ_ERR_NOT_FINITE, "/mesh/box/origin/0", "finite");
    REFUSED((s.box.size[0] = 1.7e308, s.box.origin[0] = 1.7e308), UZ_ERR_NOT_FINITE, "/mesh/box/size/0", "largest");
    REFUSED(s.box.origin[1] = 1e18, UZ_ERR_SCENE, "/mesh/box/origin/1", "told apart");
    REFUSED(memcpy(s.box.element, "hex8", 5), UZ_ERR_SCENE, "/mesh/box/element", "quad4");
    REFUSED(s.box.dim = 3, UZ_ERR_SCENE, "/mesh/box/element", "hex8, hex20, tet4, tet10, wedge6 or wedge15");
    REFUSED(s.box.dim = 4, UZ_ERR_SCENE, "/mesh/box/size", "dimensions");
    REFUSED(s.box.grading[1] = -1, UZ_ERR_SCENE, "/mesh/box/grading/1", "positive");
    REFUSED(s.box.grading[0] = (double)INFINITY, UZ_ERR_NOT_FINITE, "/mesh/box/grading/0", "finite");
    REFUSED(s.box.grading[0] = 1e300, UZ_ERR_SCENE, "/mesh/box/grading/0", "too small");
    REFUSED(s.box.grading[0] = 1e-300, UZ_ERR_SCENE, "/mesh/box/grading/0", "too small");
    REFUSED(s.model = UZ_SOLID, UZ_ERR_SCENE, "/model", "plane_stress");
}

TEST(material_is_checked)
{
    REFUSED(s.n_materials = 0, UZ_ERR_SCENE, "/materials", "no material");
    REFUSED(rename_to(s.materials[0].on, "left"), UZ_ERR_SCENE, "/materials/0/on", "all");
    REFUSED(rename_to(s.materials[0].on, "core"), UZ_ERR_SCENE, "/materials/0/on", "left, right, bottom, top, all");
    REFUSED((s.materials[1] = s.materials[0], s.n_materials = 2), UZ_ERR_SCENE, "/materials/1/on", "already");
    REFUSED(s.materials[0].young = 0, UZ_ERR_SCENE, "/materials/0/young", "positive");
    REFUSED(s.materials[0].young = (double)INFINITY, UZ_ERR_NOT_FINITE, "/materials/0/young", "finite");
    REFUSED(s.materials[0].young = 1e308, UZ_ERR_NOT_FINITE, "/materials", "overflows");
    REFUSED(s.materials[0].young = 1e-308, UZ_ERR_SCENE, "/materials", "underflows");
    REFUSED(s.materials[0].poisson = -1, UZ_ERR_SCENE, "/materials/0/poisson", "between");
    REFUSED(s.materials[0].poisson = 0.51, UZ_ERR_SCENE, "/materials/0/poisson", "between");
    REFUSED(s.materials[0].poisson = (double)NAN, UZ_ERR_NOT_FINITE, "/materials/0/poisson", "finite");
    REFUSED((s.materials[0].poisson = 0.5, s.model = UZ_PLANE_STRAIN), UZ_ERR_SCENE, "/materials/0/poisson",
            "plane strain");
    REFUSED(s.thickness = 0, UZ_ERR_SCENE, "/thickness", "positive");
    REFUSED(s.thickness = (double)NAN, UZ_ERR_NOT_FINITE, "/thickness", "finite");
    REFUSED(s.model = (uz_model)7, UZ_ERR_SCENE, "/model", "plane_stress");
    uz_scene incompressible = paper_scene(4, 2);
    incompressible.materials[0].poisson = 0.5;
    expect(&incompressible, UZ_OK, "", "");
}

TEST(supports_are_checked)
{
    REFUSED(rename_to(s.supports[0].on, "wall"), UZ_ERR_SCENE, "/supports/0/on", "no group \"wall\"");
    REFUSED(add_support(&s, "top", (double)NAN, (double)NAN), UZ_ERR_SCENE, "/supports/1", "no direction");
    REFUSED(add_support(&s, "top", (double)NAN, (double)INFINITY), UZ_ERR_NOT_FINITE, "/supports/1/uy", "finite");
    REFUSED(add_support(&s, "top", 0.5, (double)NAN), UZ_ERR_SCENE, "/supports/1/ux", "node 10, where \"top\" meets");
    REFUSED(add_support(&s, "all", 0, 0), UZ_ERR_SCENE, "/supports", "every node");
    REFUSED(s.n_supports = 5000, UZ_ERR_SCENE, "/supports", "at most");
    uz_scene agree = paper_scene(4, 2);
    add_support(&agree, "top", -0.0, (double)NAN);
    expect(&agree, UZ_OK, "", "");
}

TEST(loads_are_checked)
{
    REFUSED(rename_to(s.loads[1].on, "core"), UZ_ERR_SCENE, "/loads/1/on", "left, right, bottom, top, all");
    REFUSED(rename_to(s.loads[1].on, "all"), UZ_ERR_SCENE, "/loads/1/on", "name the sides");
    REFUSED(s.loads[1].v[1] = (double)NAN, UZ_ERR_NOT_FINITE, "/loads/1/traction/1", "finite");
    REFUSED(s.loads[0].v[0] = (double)INFINITY, UZ_ERR_NOT_FINITE, "/loads/0/traction/0", "finite");
    REFUSED(s.loads[1].v[0] = 1.7e308, UZ_ERR_NOT_FINITE, "/loads", "overflow");
}

TEST(contacts_are_checked)
{
    REFUSED(rename_to(s.contacts[0].on, "floor"), UZ_ERR_SCENE, "/contacts/0/on", "no group");
    REFUSED(rename_to(s.contacts[0].on, "all"), UZ_ERR_SCENE, "/contacts/0/on", "the side that can touch");
    REFUSED(s.contacts[0].normal[1] = 0, UZ_ERR_SCENE, "/contacts/0/obstacle/plane/normal", "zero");
    REFUSED(s.contacts[0].normal[0] = (double)NAN, UZ_ERR_NOT_FINITE, "/contacts/0/obstacle/plane/normal/0", "finite");
    REFUSED(s.contacts[0].point[1] = (double)NAN, UZ_ERR_NOT_FINITE, "/contacts/0/obstacle/plane/point/1", "finite");
    REFUSED(s.contacts[0].point[1] = 0.1, UZ_ERR_SCENE, "/contacts/0", "node 0 at (0, 0) is held");
}

/* -------------------------------------------------------------- free bodies */

static void expect_free(uz_scene scene, const char *modes)
{
    expect(&scene, UZ_ERR_FREE_BODY, "/supports", modes);
}

static uz_scene held(const char *on, double ux, double uy)
{
    uz_scene scene = box_scene(60, 20, 6, 2);
    add_support(&scene, on, ux, uy);
    return scene;
}

TEST(free_rigid_modes_are_named)
{
    expect_free(box_scene(60, 20, 6, 2),
                "leave translation along x, translation along y, rotation about (30, 10) free");
    expect_free(held("left", 0, (double)NAN), "leave translation along y free");
    expect_free(held("left", (double)NAN, 0), "leave translation along x, rotation about (0, 10) free");
    expect_free(held("bottom", 0, (double)NAN), "leave translation along y, rotation about (30, 0) free");
    expect_free(held("all", (double)NAN, 0), "leave translation along x free");
    uz_scene rolls = held("left", 0, (double)NAN);
    add_support(&rolls, "right", 0, (double)NAN);
    expect_free(rolls, "leave translation along y free");
    uz_scene fixed = held("left", 0, (double)NAN);
    add_support(&fixed, "right", (double)NAN, 0);
    expect(&fixed, UZ_OK, "", "");
}

TEST(free_modes_do_not_depend_on_units)
{
    const double factor[3] = {1e-9, 1, 1e9};
    for (int k = 0; k < 3; k++) {
        uz_scene scene = held("bottom", 0, (double)NAN);
        scene.box.size[0] *= factor[k], scene.box.size[1] *= factor[k];
        expect_free(scene, "leave translation along y, rotation about (3");
        scene = held("left", 0, 0);
        scene.box.size[0] *= factor[k], scene.box.size[1] *= factor[k];
        expect(&scene, UZ_OK, "", "");
    }
}

/* Two squares side by side that share no node, given by hand. */
static uz_body_model two_squares(void)
{
    static double xyz[16] = {0, 0, 1, 0, 1, 1, 0, 1, 5, 0, 6, 0, 6, 1, 5, 1};
    static int64_t element[8] = {0, 1, 2, 3, 4, 5, 6, 7}, first[3] = {0, 4, 8};
    uz_body_model model = {0};
    model.mesh = (uz_mesh){.dim = 2, .n_nodes = 8, .n_elements = 2};
    model.mesh.xyz = xyz;
    model.mesh.first = first;
    model.mesh.node = element;
    return model;
}

static void check_held(const uz_body_model *model, const char *message)
{
    uz_error err = {0};
    const uz_status status = uz_check_rigid_modes(model, &err);
    CHECK_INT(status, message[0] ? UZ_ERR_FREE_BODY : UZ_OK);
    CHECK_MSG(strstr(err.message, message) != NULL, "\"%s\" lacks \"%s\"", err.message, message);
}

TEST(each_connected_part_is_held_by_its_own_supports)
{
    int64_t dof[16] = {0};
    uz_body_model model = two_squares();
    model.dof = dof;
    dof[0] = dof[1] = dof[2] = dof[3] = -1; /* nodes 0 and 1 */
    check_held(&model,
               "leave translation along x, translation along y, rotation about (5.5, 0.5) of the part with node 4");
    dof[8] = dof[9] = -1; /* node 4 pinned */
    check_held(&model, "leave rotation about (5, 0) of the part with node 4");
    dof[12] = -1; /* ux of node 6 */
    check_held(&model, "");
    dof[12] = 0, dof[11] = -1; /* instead uy of node 5 */
    check_held(&model, "");
    dof[11] = 0, dof[10] = -1; /* instead ux of node 5: on one line with node 4, holds nothing new */
    check_held(&model, "leave rotation about (5, 0) of the part with node 4");
    dof[0] = dof[1] = dof[2] = dof[3] = 0;
    check_held(&model, "of the part with node 0");
}

/* ----------------------------------------------------------- mesh and groups */

TEST(box_numbers_nodes_row_by_row)
{
    uz_box box = {.origin = {1, 2}, .size = {6, 4}, .cells = {3, 2}, .element = "quad4", .dim = 2};
    const int64_t nodes[4][4] = {{0, 4, 8}, {3, 7, 11}, {0, 1, 2, 3}, {8, 9, 10, 11}};
    const int64_t first_edge[4][2] = {{4, 0}, {3, 7}, {0, 1}, {9, 8}};
    const char *names[5] = {"left", "right", "bottom", "top", "all"};
    uz_mesh mesh;
    CHECK(uz_mesh_from_box(&mesh, &box, NULL) == UZ_OK);
    CHECK(mesh.n_nodes == 12 && mesh.n_elements == 6 && mesh.n_groups == 5);
    CHECK(mesh.xyz[0] == 1 && mesh.xyz[1] == 2 && mesh.xyz[22] == 7 && mesh.xyz[23] == 6);
    CHECK(mesh.xyz[2] == 3 && mesh.xyz[3] == 2);
    CHECK(mesh.node[4] == 1 && mesh.node[5] == 2 && mesh.node[6] == 6 && mesh.node[7] == 5);
    for (int g = 0; g < 4; g++) {
        const uz_group *group = uz_mesh_group(&mesh, names[g], "", NULL);
        CHECK_INT(group->n_nodes, g < 2 ? 3 : 4);
        CHECK(memcmp(group->node, nodes[g], (size_t)group->n_nodes * sizeof *group->node) == 0);
        int64_t ends[UZ_FACE_NODES];
        CHECK_INT(uz_mesh_face(ends, &mesh, group->face[0]), 2);
        CHECK(memcmp(ends, first_edge[g], sizeof first_edge[g]) == 0);
        CHECK_INT(group->n_faces, group->n_nodes - 1);
    }
    const uz_group *all = uz_mesh_group(&mesh, names[4], "", NULL);
    CHECK_INT(uz_group_node_count(&mesh, all), 12);
    CHECK_INT(uz_group_node_at(all, 7), 7);
    uz_mesh_clear(&mesh);
}

/* ------------------------------------------------------------------ contacts */

/* Rows of N as dense m x d. */
static double *dense_rows(const uz_csc *N)
{
    double *full = zeros(N->rows * N->cols);
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            full[N->idx[q] * N->cols + j] += N->val[q];
    return full;
}

/* A plane through (1, -3) with normal (-3, 4) of any length, a body whose left side is moved by (0.25, -0.5). */
TEST(oblique_plane_has_its_gaps)
{
    uz_scene scene = box_scene(4, 2, 2, 1);
    uz_qp qp;
    uz_mesh_info info;
    add_support(&scene, "left", 0.25, -0.5);
    add_plane(&scene, "bottom", 1, -3, -3e-200, 4e-200);
    CHECK(uz_scene_to_qp(&qp, &info, &scene, NULL) == UZ_OK);
    CHECK_INT(qp.N.rows, 2); /* node 0 is held */
    CHECK_INT(qp.K.cols, 8);
    for (int64_t i = 0; i < 2; i++) {
        const double x = info.xyz[2 * info.contact_node[i]];
        CHECK_INT(info.contact_node[i], i + 1);
        CHECK(fabs(qp.h[i] - ((x - 1) * -0.6 + 3 * 0.8)) < 1e-14);
        CHECK_REL(info.contact_normal[2 * i], -0.6, 1e-15);
        CHECK_REL(info.contact_normal[2 * i + 1], 0.8, 1e-15);
        CHECK_REL(info.contact_area[i], i == 0 ? 10.0 : 5.0, 1e-15);
    }
    double *N = dense_rows(&qp.N); /* the second dof of both nodes is turned into the normal */
    CHECK_REL(N[1], -1.0, 1e-15);
    CHECK_REL(N[8 + 3], -1.0, 1e-15);
    CHECK_INT(qp.N.ptr[8], 2);
    CHECK_INT(info.n_rotated, 2);
    CHECK_INT(info.rotated_node[1], 2);
    CHECK_REL(info.frame[4 + 2], -0.6, 1e-15);
    CHECK_REL(info.frame[4 + 3], 0.8, 1e-15);
    CHECK(fabs(info.frame[4] * -0.6 + info.frame[5] * 0.8) < 1e-15);
    free(N);
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
}

/* A half-held node keeps its row; what is prescribed of it moves into the gap. */
TEST(prescribed_part_of_a_contact_node_enters_the_gap)
{
    uz_scene scene = box_scene(4, 2, 2, 1);
    uz_qp qp;
    uz_mesh_info info;
    add_support(&scene, "left", 0.25, NAN);
    add_support(&scene, "top", NAN, 0);
    add_plane(&scene, "bottom", 0, -1, -3, 4);
    CHECK(uz_scene_to_qp(&qp, &info, &scene, NULL) == UZ_OK);
    CHECK_INT(qp.N.rows, 3);
    CHECK_INT(info.contact_node[0], 0);
    CHECK(fabs(qp.h[0] - (0.8 - 0.6 * 0.25)) < 1e-15);
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
}

/* Rolling along the obstacle: held along the normal, the node is no candidate. */
TEST(node_held_along_the_normal_has_no_row)
{
    uz_scene scene = box_scene(4, 2, 2, 1);
    uz_qp qp;
    uz_mesh_info info;
    add_support(&scene, "left", NAN, 0);
    add_support(&scene, "right", 0, NAN);
    add_plane(&scene, "bottom", 0, 0, 0, 2);
    add_plane(&scene, "left", -0.5, 0, 1, 1.2246467991473532e-16); /* a normal from cos and sin of 0 and pi */
    CHECK(uz_scene_to_qp(&qp, &info, &scene, NULL) == UZ_OK);
    CHECK_INT(qp.N.rows, 4);
    const int64_t nodes[4] = {1, 2, 0, 3}; /* contact by contact */
    const double gaps[4] = {0, 0, 0.5, 0.5};
    for (int i = 0; i < 4; i++) {
        CHECK_INT(info.contact_node[i], nodes[i]);
        CHECK(qp.h[i] == gaps[i]);
    }
    CHECK_INT(qp.N.ptr[qp.N.cols], 4); /* the rounding of the second normal made no entry */
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
}

TEST(initial_overlap_of_free_nodes_is_allowed)
{
    uz_scene scene = paper_scene(4, 2);
    uz_qp qp;
    scene.contacts[0].point[1] = 0.5;
    scene.supports[0].u[1] = 0.5; /* the held corner is lifted out of the obstacle */
    CHECK(uz_scene_to_qp(&qp, NULL, &scene, NULL) == UZ_OK);
    CHECK(qp.h[0] == -0.5);
    uz_qp_clear(&qp);
    uz_scene_clear(&scene);
}

TEST(counts_of_the_paper_body)
{
    const int64_t sizes[3][2] = {{30, 10}, {60, 20}, {7, 1}};
    for (int k = 0; k < 3; k++) {
        const int64_t nx = sizes[k][0], ny = sizes[k][1];
        uz_scene scene = paper_scene(nx, ny);
        uz_qp qp;
        CHECK(uz_scene_to_qp(&qp, NULL, &scene, NULL) == UZ_OK);
        CHECK_INT(qp.K.cols, 2 * nx * (ny + 1));
        CHECK_INT(qp.N.rows, nx);
        CHECK_INT(qp.N.ptr[qp.N.cols], nx);
        CHECK(uz_qp_check(&qp, NULL) == UZ_OK);
        uz_qp_clear(&qp);
        uz_scene_clear(&scene);
    }
}

TEST(scene_without_contacts_is_a_linear_problem)
{
    uz_scene scene = paper_scene(4, 2);
    uz_qp qp;
    uz_mesh_info info;
    scene.n_contacts = 0;
    CHECK(uz_scene_to_qp(&qp, &info, &scene, NULL) == UZ_OK);
    CHECK_INT(qp.N.rows, 0);
    CHECK_INT(qp.N.cols, qp.K.cols);
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
}
