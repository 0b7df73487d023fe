/* Boxes of every element: conforming, positive, filling the box, with the right sides. */
#include "harness.h"
#include "scene/corner_table.h"
#include "scene/mesh.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static uz_box make_box(const char *element, int dim)
{
    uz_box box = {.origin = {1, -2, 3}, .size = {6, 4, 2}, .cells = {3, 2, 4}, .dim = dim};
    snprintf(box.element, sizeof box.element, "%s", element);
    return box;
}

static uz_mesh mesh_of(const uz_box *box)
{
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_box(&mesh, box, &err) == UZ_OK, "%s: %s", err.where, err.message);
    return mesh;
}

/* Signed volume of the simplex on corners 0, a, b (, c) of an element: area or volume. */
static double simplex(const uz_mesh *mesh, const int64_t *node, int a, int b, int c)
{
    const double *x = mesh->xyz + node[0] * mesh->dim;
    const int other[3] = {a, b, c};
    double t[3][3] = {{0}};
    for (int k = 0; k < mesh->dim; k++)
        for (int i = 0; i < mesh->dim; i++)
            t[k][i] = mesh->xyz[node[other[k]] * mesh->dim + i] - x[i];
    if (mesh->dim == 2)
        return (t[0][0] * t[1][1] - t[0][1] * t[1][0]) / 2;
    return (t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
            t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0])) /
           6;
}

/* Six tetrahedra around the diagonal fill a hexahedron. */
static double volume_of(const uz_mesh *mesh, int64_t e)
{
    static const int AROUND[6][2] = {{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}};
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
    double sum = 0;
    if (corners == 3)
        return simplex(mesh, node, 1, 2, 0);
    if (corners == 4 && mesh->dim == 2)
        return simplex(mesh, node, 1, 2, 0) + simplex(mesh, node, 2, 3, 0);
    if (corners == 4)
        return simplex(mesh, node, 1, 2, 3);
    if (corners == 6) /* from node 0 to the triangle and to the rectangle that it is not on */
        return simplex(mesh, node, 3, 5, 4) + simplex(mesh, node, 2, 1, 4) + simplex(mesh, node, 2, 4, 5);
    for (int k = 0; k < 6; k++)
        sum += simplex(mesh, node, AROUND[k][0], AROUND[k][1], 6);
    return sum;
}

static void check_volumes(const uz_mesh *mesh, double whole)
{
    double sum = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        CHECK(volume_of(mesh, e) > 0);
        sum += volume_of(mesh, e);
    }
    CHECK_REL(sum, whole, 1e-13);
}

/* Every side belongs to two elements, or to one and is then a face of exactly one side of the box. */
static void check_conforming(const uz_mesh *mesh)
{
    uz_corner_table sides;
    int64_t boundary = 0, named = 0;
    CHECK(uz_corner_table_build(&sides, mesh, true, NULL) == UZ_OK);
    for (int64_t i = 0; i < sides.count; i++) {
        boundary += !sides.same[i] && !sides.same[i + 1];
        CHECK(i < 2 || !(sides.same[i] && sides.same[i - 1]));
    }
    for (int64_t g = 0; g < mesh->n_groups; g++)
        for (int64_t f = 0; f < mesh->groups[g].n_faces; f++) {
            int64_t node[UZ_FACE_NODES], corner[UZ_MOST_CORNERS];
            const uz_face face = mesh->groups[g].face[f];
            const int corners = uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side].corners;
            uz_mesh_face(node, mesh, face);
            memcpy(corner, node, (size_t)corners * sizeof *corner);
            const int64_t place = uz_corner_table_find(&sides, mesh, corner, corners);
            CHECK(place >= 0 && !sides.same[place + 1]);
            named++;
        }
    CHECK_INT(named, boundary);
    uz_corner_table_clear(&sides);
}

/* The nodes of a side: those whose coordinate is the end of the box, ascending; and all faces have such nodes only. */
static void check_side(const uz_mesh *mesh, const char *name, int axis, double end)
{
    const uz_group *group = uz_mesh_group(mesh, name, "", NULL);
    int64_t k = 0, node[UZ_FACE_NODES];
    CHECK(group && group->kind == UZ_GROUP_FACES);
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        if (mesh->xyz[i * mesh->dim + axis] == end)
            CHECK(k < group->n_nodes && group->node[k++] == i);
    CHECK_INT(k, group->n_nodes);
    for (int64_t f = 0; f < group->n_faces; f++) {
        const int count = uz_mesh_face(node, mesh, group->face[f]);
        for (int i = 0; i < count; i++)
            CHECK(mesh->xyz[node[i] * mesh->dim + axis] == end);
    }
}

/* Nodes after the corners stand in the middle of the straight edges between the corners next to them. */
static void check_middles(const uz_mesh *mesh)
{
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int s = 0; s < uz_element_type_of((uz_element_kind)mesh->kind[e])->sides; s++) {
            int64_t node[UZ_FACE_NODES];
            const int count = uz_mesh_face(node, mesh, (uz_face){e, s});
            const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->side[s].corners;
            for (int m = corners; m < count; m++)
                for (int c = 0; c < mesh->dim; c++) {
                    const double a = mesh->xyz[node[m - corners] * mesh->dim + c];
                    const double b = mesh->xyz[node[(m - corners + 1) % corners] * mesh->dim + c];
                    CHECK(fabs(mesh->xyz[node[m] * mesh->dim + c] - (a + b) / 2) < 1e-14);
                }
        }
}

static void check_box(const char *element, int dim, int64_t nodes, int64_t elements, const double *grading)
{
    uz_box box = make_box(element, dim);
    if (grading)
        memcpy(box.grading, grading, sizeof box.grading);
    uz_mesh mesh = mesh_of(&box);
    CHECK_INT(mesh.n_nodes, nodes);
    CHECK_INT(mesh.n_elements, elements);
    CHECK(mesh.uniform == (!grading && (strcmp(element, "quad4") == 0 || strcmp(element, "hex8") == 0)));
    CHECK_REL(mesh.extent, dim == 2 ? sqrt(52) : sqrt(56), 1e-15);
    check_volumes(&mesh, dim == 2 ? 24.0 : 48.0);
    check_conforming(&mesh);
    check_middles(&mesh);
    check_side(&mesh, "left", 0, 1);
    check_side(&mesh, "right", 0, 7);
    check_side(&mesh, "bottom", 1, -2);
    check_side(&mesh, "top", 1, 2);
    if (dim == 3) {
        check_side(&mesh, "back", 2, 3);
        check_side(&mesh, "front", 2, 5);
    }
    CHECK_INT(mesh.n_groups, 2 * dim + 1);
    CHECK(uz_mesh_group(&mesh, "all", "", NULL)->everything);
    uz_mesh_clear(&mesh);
}

TEST(boxes_of_every_element)
{
    const double grading[3] = {3, 0.25, 10};
    for (int graded = 0; graded < 2; graded++) {
        const double *g = graded ? grading : NULL;
        check_box("quad4", 2, 12, 6, g);
        check_box("tri3", 2, 12, 12, g);
        check_box("quad8", 2, 7 * 5 - 6, 6, g);
        check_box("tri6", 2, 35, 12, g);
        check_box("hex8", 3, 60, 24, g);
        check_box("wedge6", 3, 60, 48, g);
        check_box("wedge15", 3, 7 * 5 * 5 + 60 / 5 * 4, 48, g);
        check_box("hex20", 3, 60 + 3 * 3 * 5 + 4 * 2 * 5 + 4 * 3 * 4, 24, g);
        check_box("tet4", 3, 60, 144, g);
        check_box("tet10", 3, 7 * 5 * 9, 144, g);
    }
}

TEST(grading_is_geometric)
{
    uz_box box = make_box("quad4", 2);
    box.cells[0] = 7;
    box.grading[0] = 64;
    uz_mesh mesh = mesh_of(&box);
    for (int i = 1; i < 7; i++) {
        const double *x = mesh.xyz + 2 * (i - 1); /* three nodes of the bottom row */
        CHECK_REL((x[4] - x[2]) / (x[2] - x[0]), 2.0, 1e-12);
    }
    CHECK(mesh.xyz[14] == 7);
    uz_mesh_clear(&mesh);
}

/* Without grading, and with 1, the grid lines are the same bits. */
TEST(grading_one_changes_nothing)
{
    const char *const elements[2] = {"quad4", "tet10"};
    for (int k = 0; k < 2; k++) {
        uz_box plain = make_box(elements[k], 2 + k), one = plain;
        one.grading[0] = one.grading[1] = one.grading[2] = 1;
        uz_mesh a = mesh_of(&plain), b = mesh_of(&one);
        CHECK(memcmp(a.xyz, b.xyz, (size_t)(a.n_nodes * a.dim) * sizeof *a.xyz) == 0);
        CHECK(a.uniform == b.uniform);
        uz_mesh_clear(&a);
        uz_mesh_clear(&b);
    }
}

/* A power of two as the unit of length changes no digit. */
TEST(boxes_do_not_depend_on_units)
{
    uz_box metres = make_box("tet10", 3);
    metres.grading[1] = 5;
    uz_box other = metres;
    for (int c = 0; c < 3; c++) {
        other.origin[c] *= 1024;
        other.size[c] *= 1024;
    }
    uz_mesh a = mesh_of(&metres), b = mesh_of(&other);
    for (int64_t i = 0; i < a.n_nodes * 3; i++)
        CHECK(a.xyz[i] * 1024 == b.xyz[i]);
    uz_mesh_clear(&a);
    uz_mesh_clear(&b);
}

static void check_refused(const char *element, int dim, int64_t cells, const char *where)
{
    uz_error err = {0};
    uz_mesh mesh;
    uz_box box = make_box(element, dim);
    box.cells[0] = box.cells[1] = box.cells[2] = cells;
    CHECK(uz_mesh_from_box(&mesh, &box, &err) == UZ_ERR_SCENE);
    CHECK_STR(err.where, where);
    CHECK(!mesh.xyz && !mesh.groups);
}

TEST(boxes_that_are_too_large_are_refused)
{
    check_refused("quad4", 2, 3200, "/mesh/box/cells");
    check_refused("quad8", 2, 1900, "/mesh/box/cells");
    check_refused("tet10", 3, 95, "/mesh/box/cells");
    check_refused("hex8", 3, 200, "/mesh/box/cells");
    check_refused("hex8", 3, 19999999, "/mesh/box/cells");
    check_refused("quad8", 2, 19999999, "/mesh/box/cells");
    check_refused("hex8", 2, 3, "/mesh/box/element");
    check_refused("tri3", 3, 3, "/mesh/box/element");
    check_refused("hex27", 3, 3, "/mesh/box/element");
}
