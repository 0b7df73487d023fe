/* Groups by where they are: on boxes of every element, on a round body in numbers, on refined meshes. */
#include "harness.h"
#include "scene/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uz_selection selection(const char *name, unsigned by)
{
    uz_selection s = {.by = by, .low = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, .high = {HUGE_VAL, HUGE_VAL, HUGE_VAL}};
    snprintf(s.name, sizeof s.name, "%s", name);
    snprintf(s.place, sizeof s.place, "/groups/0/where");
    return s;
}

static uz_selection at(const char *name, int axis, double value)
{
    uz_selection s = selection(name, UZ_SELECT_RANGE);
    s.low[axis] = s.high[axis] = value;
    return s;
}

static uz_selection facing(const char *name, double x, double y, double z, double within)
{
    uz_selection s = selection(name, UZ_SELECT_FACING);
    s.facing[0] = x;
    s.facing[1] = y;
    s.facing[2] = z;
    s.within = within;
    return s;
}

static uz_scene box_scene(const char *element, int dim, uz_selection *selections, int64_t count)
{
    uz_scene scene = {.model = dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN, .selections = selections, .n_selections = count};
    scene.box = (uz_box){.origin = {1, -2, 3}, .size = {6, 4, 2}, .cells = {3, 2, 4}, .dim = dim};
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    return scene;
}

static uz_mesh mesh_of(const uz_scene *scene)
{
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_scene(&mesh, scene, &err) == UZ_OK, "%s: %s", err.where, err.message);
    return mesh;
}

static void refuse(const uz_scene *scene, const char *says)
{
    uz_mesh mesh;
    uz_error err = {0};
    CHECK(uz_mesh_from_scene(&mesh, scene, &err) == UZ_ERR_SCENE);
    CHECK_STR(err.where, "/groups/0/where");
    CHECK_MSG(strstr(err.message, says) != NULL, "\"%s\" lacks \"%s\"", err.message, says);
}

/* The group has exactly the nodes and the sides of another, whatever the order of the sides. */
static void check_same(const uz_mesh *mesh, const char *name, const char *other)
{
    const uz_group *a = uz_mesh_group(mesh, name, "", NULL), *b = uz_mesh_group(mesh, other, "", NULL);
    CHECK_MSG(a && b, "%s or %s is not there", name, other);
    CHECK_INT(a->kind, b->kind);
    CHECK_MSG(a->n_nodes == b->n_nodes && a->n_faces == b->n_faces, "%s: %lld nodes, %lld sides, %s has %lld, %lld",
              name, (long long)a->n_nodes, (long long)a->n_faces, other, (long long)b->n_nodes, (long long)b->n_faces);
    CHECK(memcmp(a->node, b->node, (size_t)a->n_nodes * sizeof *a->node) == 0);
    uz_face *faces = malloc((size_t)(b->n_faces + 1) * sizeof *faces);
    memcpy(faces, b->face, (size_t)b->n_faces * sizeof *faces);
    qsort(faces, (size_t)b->n_faces, sizeof *faces, uz_face_order);
    for (int64_t i = 0; i < a->n_faces; i++)
        CHECK(uz_face_order(&a->face[i], &faces[i]) == 0);
    free(faces);
}

/* Each side of a box by its coordinate, by its plane, and by where it looks. */
TEST(sides_of_boxes)
{
    static const char *const NAMES[] = {"left", "right", "bottom", "top", "back", "front"};
    static const double PLACE[] = {1, 7, -2, 2, 3, 5};
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        const int dim = uz_element_type_of((uz_element_kind)kind)->dim;
        uz_selection s[18];
        int64_t count = 0;
        for (int side = 0; side < 2 * dim; side++) {
            char name[3][16];
            double n[3] = {0}, *point;
            for (int k = 0; k < 3; k++)
                snprintf(name[k], sizeof name[k], "%s %d", NAMES[side], k);
            n[side / 2] = side % 2 ? 1 : -1;
            s[count++] = at(name[0], side / 2, PLACE[side]);
            s[count++] = facing(name[1], 3 * n[0], 3 * n[1], 3 * n[2], 20);
            s[count] = selection(name[2], UZ_SELECT_PLANE);
            point = s[count].plane_point;
            point[side / 2] = PLACE[side];
            memcpy(s[count++].plane_normal, n, sizeof n);
        }
        const uz_scene scene = box_scene(uz_element_name((uz_element_kind)kind), dim, s, count);
        uz_mesh mesh = mesh_of(&scene);
        for (int64_t i = 0; i < count; i++)
            check_same(&mesh, s[i].name, NAMES[i / 3]);
        uz_mesh_clear(&mesh);
    }
}

/* Conditions hold together; a part of a side, an edge of nodes, the nearest node, elements by their middles. */
TEST(parts_of_a_box)
{
    uz_selection s[6] = {at("half", 2, 5),  at("edge", 0, 1),  selection("corner", UZ_SELECT_NEAREST | UZ_SELECT_RANGE),
                         at("nodes", 2, 5), at("inner", 0, 3), selection("first", UZ_SELECT_RANGE)};
    s[0].high[0] = 3 + 1e-7; /* the end of a cell, but for the tolerance */
    s[1].low[1] = s[1].high[1] = -2;
    memcpy(s[2].nearest, (double[]){-9, 0.4, 4}, sizeof s[2].nearest);
    s[2].low[0] = 3;
    s[3].kind = UZ_SELECT_NODES;
    s[5].kind = UZ_SELECT_ELEMENTS;
    s[5].high[0] = 2.1;
    const uz_scene scene = box_scene("hex8", 3, s, 6);
    uz_mesh mesh = mesh_of(&scene);
    const uz_group *half = uz_mesh_group(&mesh, "half", "", NULL), *edge = uz_mesh_group(&mesh, "edge", "", NULL),
                   *corner = uz_mesh_group(&mesh, "corner", "", NULL), *nodes = uz_mesh_group(&mesh, "nodes", "", NULL),
                   *inner = uz_mesh_group(&mesh, "inner", "", NULL), *first = uz_mesh_group(&mesh, "first", "", NULL);
    CHECK(half->kind == UZ_GROUP_FACES && half->n_faces == 2 && half->n_nodes == 6);
    CHECK(edge->kind == UZ_GROUP_NODES && edge->n_nodes == 5);
    CHECK(corner->kind == UZ_GROUP_NODES && corner->n_nodes == 1);
    const double *x = mesh.xyz + 3 * corner->node[0];
    CHECK(x[0] == 3 && x[1] == 0 && x[2] == 4);
    CHECK(nodes->kind == UZ_GROUP_NODES && nodes->n_nodes == 12 && nodes->n_faces == 0);
    CHECK(inner->kind == UZ_GROUP_NODES && inner->n_nodes == 15); /* no outer side lies amid the body */
    CHECK(first->kind == UZ_GROUP_ELEMENTS && first->n_elements == 8 && first->n_nodes == 30);
    uz_mesh_clear(&mesh);
}

/* A ring of quad8 whose middle nodes lie on the chords, so not on the circles. */
TEST(round_sides)
{
    enum { N = 8 };
    double xyz[2 * 5 * N];
    unsigned char kind[N];
    int64_t first[N + 1] = {0}, node[8 * N];
    const double turn = 2 * acos(-1.0) / N;
    for (int i = 0; i < N; i++) { /* corners within, without; middles within, without, between */
        for (int k = 0; k < 5; k++) {
            const double angle = turn * (i + (k == 2 || k == 3 ? 0.5 : 0)), chord = cos(turn / 2);
            const double radius[5] = {1, 2, chord, 2 * chord, 1.5};
            xyz[2 * (5 * i + k)] = 10 + radius[k] * cos(angle);
            xyz[2 * (5 * i + k) + 1] = radius[k] * sin(angle);
        }
        const int64_t a = 5 * i, b = 5 * ((i + 1) % N), place[8] = {a, a + 1, b + 1, b, a + 4, a + 3, b + 4, a + 2};
        memcpy(node + 8 * i, place, sizeof place);
        kind[i] = UZ_QUAD8;
        first[i + 1] = first[i] + 8;
    }
    uz_selection s[3] = {selection("bore", UZ_SELECT_ROUND), selection("rim", UZ_SELECT_ROUND),
                         facing("upward", 0, 1, 0, 50)};
    s[0].centre[0] = s[1].centre[0] = 10;
    s[0].radius = 1;
    s[1].radius = 2;
    uz_scene scene = {.model = UZ_PLANE_STRAIN, .source = UZ_MESH_GIVEN, .selections = s, .n_selections = 3};
    scene.given = (uz_given_mesh){
        .dim = 2, .n_nodes = 5 * N, .xyz = xyz, .n_elements = N, .kind = kind, .first = first, .node = node};
    uz_mesh mesh = mesh_of(&scene);
    const uz_group *bore = uz_mesh_group(&mesh, "bore", "", NULL), *rim = uz_mesh_group(&mesh, "rim", "", NULL),
                   *upward = uz_mesh_group(&mesh, "upward", "", NULL);
    CHECK(bore->kind == UZ_GROUP_FACES && bore->n_faces == N && bore->n_nodes == 2 * N);
    CHECK(rim->kind == UZ_GROUP_FACES && rim->n_faces == N && rim->n_nodes == 2 * N);
    CHECK(bore->node[0] != rim->node[0]);
    CHECK(upward->kind == UZ_GROUP_FACES &&
          upward->n_faces == 4); /* two of the rim, and two of the bore's lower half */
    uz_mesh_clear(&mesh);
    s[0].radius = 1.1;
    refuse(&scene, "no node lies there: the nearest node");
    s[0].radius = 1;
    s[0].kind = UZ_SELECT_SIDES;
    s[0].by |= UZ_SELECT_RANGE;
    s[0].low[0] = 10.9;
    refuse(&scene, "no outer edge lies there whole, though nodes do");
}

/* On a cylinder along any axis, and on a sphere: the corners of a cube are on both. */
TEST(cylinders_and_spheres)
{
    uz_selection s[2] = {selection("mantle", UZ_SELECT_CYLINDER), selection("ball", UZ_SELECT_ROUND)};
    uz_scene scene = box_scene("tet4", 3, s, 2);
    scene.box = (uz_box){.origin = {-1, -1, -1}, .size = {2, 2, 2}, .cells = {1, 1, 1}, .element = "tet4", .dim = 3};
    memcpy(s[0].axis, (double[]){0, 7, 0}, sizeof s[0].axis);
    memcpy(s[0].axis_point, (double[]){0, 55, 0}, sizeof s[0].axis_point);
    s[0].axis_radius = sqrt(2);
    s[1].radius = sqrt(3);
    uz_mesh mesh = mesh_of(&scene);
    CHECK_INT(uz_mesh_group(&mesh, "mantle", "", NULL)->n_nodes, 8);
    CHECK_INT(uz_mesh_group(&mesh, "ball", "", NULL)->n_faces, 12);
    uz_mesh_clear(&mesh);
}

/* A refined mesh has the group of its coarse one, with the sides and nodes that are new on it. */
TEST(refined)
{
    static const int64_t MARKED[] = {2, 0, 7, 1, 12};
    uz_selection s = at("roof", 2, 5);
    uz_scene scene = box_scene("tet10", 3, &s, 1);
    scene.refine = true;
    scene.bisected = MARKED;
    scene.n_bisected = 5;
    uz_mesh mesh = mesh_of(&scene);
    check_same(&mesh, "roof", "front");
    uz_mesh_clear(&mesh);
}

TEST(refusals)
{
    uz_selection s[2] = {at("left", 0, 1), at("b", 0, 1)};
    const uz_scene scene = box_scene("quad4", 2, s, 2);
    refuse(&scene, "has a group \"left\" already");
    s[0] = at("a", 0, 9);
    refuse(&scene,
           "no node lies there: the nearest node, 3 at (7, -2), is 2 away (the tolerance is 7.21e-06); the body "
           "reaches from (1, -2) to (7, 2)");
    s[0] = facing("a", 0, 1, 0, 5);
    s[0].by |= UZ_SELECT_RANGE;
    s[0].low[1] = s[0].high[1] = -2;
    refuse(&scene, "no outer edge lies there and looks that way");
    s[0] = facing("a", 0, 0, 0, 5);
    refuse(&scene, "must be a direction");
    s[0] = at("a", 0, 1.7);
    s[0].kind = UZ_SELECT_ELEMENTS;
    s[0].high[0] = 1.8;
    refuse(&scene, "no middle of an element lies there");
}
