/* Meshes in numbers: what is refused and where, how faces find their elements, how groups come together. */
#include "harness.h"
#include "scene/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_NODES = 40, MOST_ELEMENTS = 8, MOST_PLACES = 60, MOST_GROUPS = 6, MOST_LIST = 24 };

/* A mesh that a test writes down; its arrays are its own. */
typedef struct {
    uz_given_mesh mesh;
    double xyz[3 * MOST_NODES];
    unsigned char kind[MOST_ELEMENTS];
    int64_t first[MOST_ELEMENTS + 1], node[MOST_PLACES];
    uz_given_group groups[MOST_GROUPS];
    int64_t list[MOST_GROUPS][3][MOST_LIST];
} small_mesh;

static void bind(small_mesh *m)
{
    m->mesh.xyz = m->xyz;
    m->mesh.kind = m->kind;
    m->mesh.first = m->first;
    m->mesh.node = m->node;
    m->mesh.groups = m->groups;
}

static void add_node(small_mesh *m, double x, double y, double z)
{
    double *to = m->xyz + m->mesh.n_nodes++ * m->mesh.dim;
    to[0] = x;
    to[1] = y;
    if (m->mesh.dim == 3)
        to[2] = z;
}

static void add_element(small_mesh *m, uz_element_kind kind, const int64_t *node)
{
    const int64_t e = m->mesh.n_elements++;
    const int count = uz_element_node_count(kind);
    m->kind[e] = (unsigned char)kind;
    memcpy(m->node + m->first[e], node, (size_t)count * sizeof *node);
    m->first[e + 1] = m->first[e] + count;
}

/* A group of nodes, faces of `per` nodes each, or elements. */
static void add_group(small_mesh *m, const char *name, char what, int per, int count, const int64_t *list)
{
    const int64_t g = m->mesh.n_groups++;
    uz_given_group *group = &m->groups[g];
    snprintf(group->name, sizeof group->name, "%s", name);
    memcpy(m->list[g][0], list, (size_t)(count * per) * sizeof *list);
    if (what == 'n') {
        group->node = m->list[g][0];
        group->n_nodes = count;
    } else if (what == 'e') {
        group->element = m->list[g][0];
        group->n_elements = count;
    } else {
        group->face_node = m->list[g][0];
        group->face_first = m->list[g][1];
        group->n_faces = count;
        for (int i = 0; i <= count; i++)
            group->face_first[i] = i * per;
    }
}

/* Two unit squares side by side, the right one of two triangles:
 *     3--4--5
 *     |  | /|
 *     0--1--2      quad4 0 1 4 3; tri3 1 2 5; tri3 1 5 4 */
static void two_squares(small_mesh *m)
{
    memset(m, 0, sizeof *m);
    m->mesh.dim = 2;
    bind(m);
    for (int i = 0; i < 6; i++)
        add_node(m, i % 3, i < 3 ? 0 : 1, 0);
    add_element(m, UZ_TRI3, (int64_t[]){1, 2, 5});
    add_element(m, UZ_TRI3, (int64_t[]){1, 5, 4});
    add_element(m, UZ_QUAD4, (int64_t[]){0, 1, 4, 3});
}

static void expect(const small_mesh *m, int dim, uz_status status, const char *where, const char *fragment)
{
    uz_mesh mesh;
    uz_error err = {0};
    const uz_status got = uz_mesh_from_given(&mesh, &m->mesh, dim, &err);
    CHECK_MSG(got == status, "%s: %s (%s)", where, uz_status_name(got), err.message);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, fragment) != NULL, "\"%s\" lacks \"%s\"", err.message, fragment);
    CHECK((mesh.xyz != NULL) == (got == UZ_OK) && (mesh.groups != NULL) == (got == UZ_OK));
    uz_mesh_clear(&mesh);
}

#define REFUSED(change, where, fragment)                                                                               \
    do {                                                                                                               \
        small_mesh m;                                                                                                  \
        two_squares(&m);                                                                                               \
        change;                                                                                                        \
        expect(&m, 2, UZ_ERR_SCENE, where, fragment);                                                                  \
    } while (0)

TEST(numbers_are_checked)
{
    REFUSED(m.node[4] = 6, "/mesh/elements/tri3/1", "node 6, but there are only 0 to 5");
    REFUSED(m.node[9] = -1, "/mesh/elements/quad4/0", "nodes 0, 1, 4, -1");
    REFUSED(m.node[9] = 1, "/mesh/elements/quad4/0", "one node twice");
    REFUSED(m.mesh.n_elements = 0, "/mesh/elements", "no element");
    REFUSED(add_node(&m, 5, 5, 0), "/mesh/nodes/6", "node 6 belongs to no element");
    REFUSED((add_node(&m, 5, 5, 0), add_node(&m, 6, 5, 0)), "/mesh/nodes/6", "nodes 6, 7 belong to no element");
    REFUSED(add_element(&m, UZ_TRI3, ((int64_t[]){5, 1, 2})), "/mesh/elements/tri3/2", "corners of element 0");
    REFUSED(m.kind[2] = UZ_TET4, "/mesh/elements/tet4", "3 dimensions");
    small_mesh m;
    two_squares(&m);
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/nodes", "2 dimensions; its model is plane_stress");
    m.xyz[7] = (double)NAN;
    expect(&m, 2, UZ_ERR_NOT_FINITE, "/mesh/nodes/3/1", "finite");
    m.mesh.from_file = "/mesh/gmsh";
    expect(&m, 2, UZ_ERR_NOT_FINITE, "/mesh/gmsh", "node 3");
    two_squares(&m);
    m.xyz[4] = 1.7e308;
    m.xyz[0] = -1.7e308;
    expect(&m, 2, UZ_ERR_SCENE, "/mesh/elements/tri3/0", "no area");
}

TEST(shapes_in_the_plane_are_checked)
{
    REFUSED((m.node[0] = 2, m.node[1] = 1), "/mesh/elements/tri3/0",
            "is inverted; its nodes must run counterclockwise");
    REFUSED((m.node[7] = 3, m.node[9] = 1), "/mesh/elements/quad4/0", "is inverted");
    REFUSED((m.node[8] = 3, m.node[9] = 4), "/mesh/elements/quad4/0", "twisted at its node");
    REFUSED((m.xyz[8] = 0.3, m.xyz[9] = 0.3), "/mesh/elements/quad4/0", "twisted at its node 4");
    REFUSED((m.xyz[4] = 1.5, m.xyz[5] = 0.5), "/mesh/elements/tri3/0", "no area at its node 1");
    REFUSED((m.xyz[4] = 1.5, m.xyz[5] = 0.5 + 1e-13), "/mesh/elements/tri3/0", "no area");
    REFUSED((m.mesh.from_file = "/mesh/gmsh", m.node[0] = 2, m.node[1] = 1), "/mesh/gmsh", "ReverseMesh");
}

/* The units of a mesh must not decide whether an element is degenerate. */
TEST(shapes_do_not_depend_on_units)
{
    const double unit[4] = {1e-150, 1e-9, 1e9, 1e150};
    for (int k = 0; k < 4; k++) {
        small_mesh m;
        two_squares(&m);
        for (int i = 0; i < 12; i++)
            m.xyz[i] *= unit[k];
        expect(&m, 2, UZ_OK, "", "");
        m.xyz[4] = 1.5 * unit[k];
        m.xyz[5] = 0.5 * unit[k];
        expect(&m, 2, UZ_ERR_SCENE, "/mesh/elements/tri3/0", "no area");
    }
}

/* One hexahedron, tetrahedron or quadratic tetrahedron of unit edges. */
static void solid(small_mesh *m, uz_element_kind kind)
{
    static const int CORNER[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const double TET[10][3] = {{0, 0, 0},   {1, 0, 0},   {0, 1, 0},   {0, 0, 1},   {0.5, 0, 0},
                                      {.5, .5, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {.5, 0, .5}, {0, .5, .5}};
    const int64_t node[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    memset(m, 0, sizeof *m);
    m->mesh.dim = 3;
    bind(m);
    for (int i = 0; i < uz_element_node_count(kind); i++)
        if (kind == UZ_HEX8)
            add_node(m, CORNER[i][0], CORNER[i][1], CORNER[i][2]);
        else
            add_node(m, TET[i][0], TET[i][1], TET[i][2]);
    add_element(m, kind, node);
}

static void swap(int64_t *a, int64_t *b)
{
    const int64_t was = *a;
    *a = *b;
    *b = was;
}

TEST(shapes_in_space_are_checked)
{
    small_mesh m;
    solid(&m, UZ_HEX8);
    expect(&m, 3, UZ_OK, "", "");
    for (int i = 0; i < 4; i++)
        swap(&m.node[i], &m.node[i + 4]);
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/hex8/0", "seen from the side of the other four");
    swap(&m.node[0], &m.node[4]);
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/hex8/0", "twisted");
    solid(&m, UZ_TET4);
    expect(&m, 3, UZ_OK, "", "");
    swap(&m.node[0], &m.node[1]);
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/tet4/0", "seen from the fourth");
    solid(&m, UZ_TET4);
    m.xyz[11] = 0;
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/tet4/0", "no volume");
    solid(&m, UZ_TET10);
    expect(&m, 3, UZ_OK, "", "");
    swap(&m.node[8], &m.node[9]); /* Gmsh's order */
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/tet10/0", "node");
}

/* How much of the volume of its edges a tetrahedron has at the corner where that is least. */
static double least_volume(const double *x)
{
    double least = INFINITY;
    for (int a = 0; a < 4; a++) {
        double t[3][3], product = 1;
        for (int k = 0; k < 3; k++) {
            for (int c = 0; c < 3; c++)
                t[k][c] = x[3 * ((a + k + 1) % 4) + c] - x[3 * a + c];
            product *= hypot(hypot(t[k][0], t[k][1]), t[k][2]);
        }
        const double volume = t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) -
                              t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
                              t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
        least = fmin(least, fabs(volume) / product);
    }
    return least;
}

/* Also one that is flat at a corner that is not its first: over slender ones and all of which is the first. */
TEST(flat_tetrahedra_are_refused_at_any_corner)
{
    static const int TURN[4][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 1, 0}}; /* rotations */
    int flat = 0, good = 0;
    for (int k = 0; k < 4 * 16 * 16; k++) {
        const int shorter = k / 4 % 16, lower = k / 64;
        small_mesh m;
        double x[12];
        solid(&m, UZ_TET4);
        m.xyz[3] = pow(10, -shorter);
        m.xyz[9] = m.xyz[10] = 0.3;
        m.xyz[11] = pow(10, -lower) * 0.7;
        memcpy(x, m.xyz, sizeof x);
        for (int a = 0; a < 4; a++)
            memcpy(m.xyz + 3 * a, x + 3 * TURN[k % 4][a], 3 * sizeof *x);
        const double least = least_volume(m.xyz);
        if (fabs(least - 1e-12) < 1e-14)
            continue;
        if (least > 1e-12)
            expect(&m, 3, UZ_OK, "", "");
        else
            expect(&m, 3, UZ_ERR_SCENE, "/mesh/elements/tet4/0", "no volume at its node");
        *(least > 1e-12 ? &good : &flat) += 1;
    }
    CHECK(flat > 200 && good > 200);
}

/* A node in the middle of an edge that is a quarter away from a corner makes the volume vanish there. */
TEST(middles_out_of_place_are_refused)
{
    for (int k = 0; k < 2; k++) {
        small_mesh m;
        const int64_t node[8] = {0, 1, 2, 3, 4, 5, 6, 7};
        memset(&m, 0, sizeof m);
        m.mesh.dim = 2;
        bind(&m);
        for (int i = 0; i < 4; i++)
            add_node(&m, i == 1 || i == 2 ? 4 : 0, i < 2 ? 0 : 4, 0);
        add_node(&m, k ? 1 : 1.5, 0, 0);
        add_node(&m, 4.25, 2, 0);
        add_node(&m, 2, 4, 0);
        add_node(&m, 0, 2, 0);
        add_element(&m, UZ_QUAD8, node);
        expect(&m, 2, k ? UZ_ERR_SCENE : UZ_OK, k ? "/mesh/elements/quad8/0" : "", k ? "no area at its node 0" : "");
    }
}

/* ------------------------------------------------------------------ groups */

static uz_mesh good(const small_mesh *m)
{
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_given(&mesh, &m->mesh, m->mesh.dim, &err) == UZ_OK, "%s: %s", err.where, err.message);
    return mesh;
}

static void check_nodes(const uz_group *group, int count, const int64_t *node)
{
    CHECK_INT(group->n_nodes, count);
    for (int i = 0; i < count && i < group->n_nodes; i++)
        CHECK_INT(group->node[i], node[i]);
}

TEST(faces_find_their_elements)
{
    small_mesh m;
    two_squares(&m);
    add_group(&m, "around", 'f', 2, 3, (int64_t[]){5, 4, 1, 0, 2, 5});
    add_group(&m, "between", 'f', 2, 2, (int64_t[]){4, 1, 0, 3});
    uz_mesh mesh = good(&m);
    const uz_group *around = uz_mesh_group(&mesh, "around", "", NULL);
    CHECK(around->kind == UZ_GROUP_FACES && around->n_inner == 0);
    CHECK(around->face[0].element == 1 && around->face[0].side == 1);
    CHECK(around->face[1].element == 2 && around->face[1].side == 0);
    CHECK(around->face[2].element == 0 && around->face[2].side == 1);
    check_nodes(around, 5, (int64_t[]){0, 1, 2, 4, 5});
    const uz_group *between = uz_mesh_group(&mesh, "between", "", NULL);
    CHECK_INT(between->n_inner, 1);
    CHECK(between->face[0].element == 1 && between->face[0].side == 2); /* the first of the two */
    const uz_group *boundary = uz_mesh_group(&mesh, "boundary", "", NULL);
    CHECK_INT(boundary->n_faces, 6);
    CHECK_INT(boundary->n_nodes, 6);
    for (int i = 1; i < boundary->n_faces; i++)
        CHECK(boundary->face[i - 1].element <= boundary->face[i].element);
    const uz_group *all = uz_mesh_group(&mesh, "all", "", NULL);
    CHECK(all->everything && all->kind == UZ_GROUP_ELEMENTS);
    CHECK_REL(mesh.extent, sqrt(5), 1e-15);
    CHECK(!mesh.uniform);
    uz_mesh_clear(&mesh);
}

TEST(groups_are_checked)
{
    REFUSED(add_group(&m, "a/b~c", 'f', 2, 2, ((int64_t[]){0, 1, 0, 4})), "/mesh/groups/a~1b~0c/edges/1",
            "nodes 0, 4 of the group \"a/b~c\" belongs to no element");
    REFUSED(add_group(&m, "top", 'f', 2, 1, ((int64_t[]){3, 9})), "/mesh/groups/top/edges/0", "not there");
    REFUSED(add_group(&m, "top", 'f', 4, 1, ((int64_t[]){0, 1, 4, 3})), "/mesh/groups/top/edges/0", "has not 2 nodes");
    REFUSED(add_group(&m, "top", 'n', 1, 2, ((int64_t[]){3, 6})), "/mesh/groups/top/nodes/1", "only 0 to 5");
    REFUSED(add_group(&m, "core", 'e', 1, 1, ((int64_t[]){3})), "/mesh/groups/core/elements/0", "only 0 to 2");
    REFUSED(add_group(&m, "", 'n', 1, 1, ((int64_t[]){3})), "/mesh/groups", "1 to 63 bytes");
    REFUSED(add_group(&m, "all", 'e', 1, 2, ((int64_t[]){0, 1})), "/mesh/groups/all", "another name");
    REFUSED(m.mesh.n_groups = 5000, "/mesh/groups", "at most 4096");
}

TEST(groups_of_one_name_come_together)
{
    small_mesh m;
    two_squares(&m);
    add_group(&m, "rim", 'f', 2, 2, (int64_t[]){0, 1, 1, 2});
    add_group(&m, "boundary", 'n', 1, 1, (int64_t[]){4});
    add_group(&m, "rim", 'f', 2, 2, (int64_t[]){5, 2, 2, 1});
    add_group(&m, "rim", 'n', 1, 2, (int64_t[]){3, 1});
    add_group(&m, "core", 'e', 1, 3, (int64_t[]){2, 0, 2});
    add_group(&m, "all", 'e', 1, 3, (int64_t[]){2, 0, 1});
    uz_mesh mesh = good(&m);
    CHECK_INT(mesh.n_groups, 4);
    const uz_group *rim = uz_mesh_group(&mesh, "rim", "", NULL);
    CHECK_INT(rim->n_faces, 3); /* the edge 1, 2 once */
    CHECK(rim->face[0].element == 2 && rim->face[1].element == 0 && rim->face[2].element == 0);
    CHECK_INT(rim->face[2].side, 1);
    check_nodes(rim, 5, (int64_t[]){0, 1, 2, 3, 5});
    const uz_group *core = uz_mesh_group(&mesh, "core", "", NULL);
    CHECK(core->kind == UZ_GROUP_ELEMENTS && core->n_elements == 2 && core->element[0] == 0 && core->element[1] == 2);
    check_nodes(core, 6, (int64_t[]){0, 1, 2, 3, 4, 5});
    CHECK(uz_mesh_group(&mesh, "boundary", "", NULL)->kind == UZ_GROUP_NODES);
    CHECK(uz_mesh_group(&mesh, "all", "", NULL)->everything);
    uz_mesh_clear(&mesh);
}

/* Construction points of a file go, and everything is numbered without them. */
TEST(unused_nodes_of_files_are_left_out)
{
    small_mesh m;
    memset(&m, 0, sizeof m);
    m.mesh.dim = 2;
    m.mesh.from_file = "/mesh/gmsh";
    bind(&m);
    add_node(&m, 9, 9, 0);
    add_node(&m, 0, 0, 0);
    add_node(&m, 8, 8, 0);
    add_node(&m, 1, 0, 0);
    add_node(&m, 0, 1, 0);
    add_element(&m, UZ_TRI3, (int64_t[]){1, 3, 4});
    add_group(&m, "point", 'n', 1, 2, (int64_t[]){0, 3});
    add_group(&m, "side", 'f', 2, 1, (int64_t[]){4, 3});
    uz_mesh mesh = good(&m);
    CHECK(mesh.n_unused == 2 && mesh.n_nodes == 3);
    CHECK(mesh.xyz[2] == 1 && mesh.xyz[5] == 1 && mesh.node[1] == 1);
    check_nodes(uz_mesh_group(&mesh, "point", "", NULL), 1, (int64_t[]){1});
    check_nodes(uz_mesh_group(&mesh, "side", "", NULL), 2, (int64_t[]){1, 2});
    uz_mesh_clear(&mesh);
    add_group(&m, "line", 'f', 2, 1, (int64_t[]){0, 2});
    expect(&m, 2, UZ_ERR_SCENE, "/mesh/gmsh", "\"line\" belongs to no element");
}

/* Quadratic faces may come with the middles of their edges or without, in any sense. */
TEST(middles_of_faces_are_compared)
{
    small_mesh m;
    solid(&m, UZ_TET10);
    add_group(&m, "floor", 'f', 3, 1, (int64_t[]){1, 0, 2});
    add_group(&m, "wall", 'f', 6, 1, (int64_t[]){0, 1, 3, 4, 8, 7});
    uz_mesh mesh = good(&m);
    check_nodes(uz_mesh_group(&mesh, "floor", "", NULL), 6, (int64_t[]){0, 1, 2, 4, 5, 6});
    check_nodes(uz_mesh_group(&mesh, "wall", "", NULL), 6, (int64_t[]){0, 1, 3, 4, 7, 8});
    CHECK_INT(uz_mesh_group(&mesh, "boundary", "", NULL)->n_faces, 4);
    uz_mesh_clear(&mesh);
    m.list[1][0][4] = 9;
    expect(&m, 3, UZ_ERR_SCENE, "/mesh/groups/wall/faces/0", "other nodes in the middle");
}

/* A mesh given in the numbers of a box is that box. */
TEST(box_as_given_mesh_is_the_same)
{
    uz_box box = {.size = {3, 2, 1}, .cells = {4, 3, 2}, .element = "tet10", .dim = 3};
    uz_mesh made, again;
    CHECK(uz_mesh_from_box(&made, &box, NULL) == UZ_OK);
    uz_given_mesh given = {.dim = 3, .n_nodes = made.n_nodes, .xyz = made.xyz, .n_elements = made.n_elements};
    given.kind = made.kind;
    given.first = made.first;
    given.node = made.node;
    uz_scene scene = {.model = UZ_SOLID, .source = UZ_MESH_GIVEN, .given = given};
    CHECK(uz_mesh_from_scene(&again, &scene, NULL) == UZ_OK);
    CHECK(again.n_nodes == made.n_nodes && again.n_elements == made.n_elements);
    CHECK(memcmp(again.node, made.node, (size_t)made.first[made.n_elements] * sizeof *made.node) == 0);
    CHECK_INT(uz_mesh_group(&again, "boundary", "", NULL)->n_faces, 2 * 2 * (4 * 3 + 3 * 2 + 4 * 2));
    uz_mesh_clear(&made);
    uz_mesh_clear(&again);
}
