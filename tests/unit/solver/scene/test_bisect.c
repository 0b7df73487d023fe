/* Bisection of triangles and tetrahedra: whole sides meet, shapes stay, groups are inherited. */
#include "harness.h"
#include "scene/bisect.h"
#include "scene/corner_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { X, Y, Z };

static uz_box box_of(const char *element, int64_t cells)
{
    uz_box box = {.size = {3, 2, 1.5}, .cells = {cells, cells, cells}, .grading = {1, 1, 1}};
    snprintf(box.element, sizeof box.element, "%s", element);
    box.dim = strncmp(element, "tet", 3) == 0 ? 3 : 2;
    return box;
}

static uz_mesh mesh_of(const char *element, int64_t cells)
{
    const uz_box box = box_of(element, cells);
    uz_mesh mesh;
    CHECK_INT(uz_mesh_from_box(&mesh, &box, NULL), UZ_OK);
    return mesh;
}

/* Area or volume of the corners of an element or a side, without sign where the corners are those of a side. */
static double measure(const uz_mesh *mesh, const int64_t *node, int corners)
{
    double t[3][3] = {{0}}, cross[3];
    if (mesh->dim == 2 && corners == 4)
        return measure(mesh, node, 3) + measure(mesh, (int64_t[]){node[0], node[2], node[3]}, 3);
    for (int k = 1; k < corners; k++)
        for (int c = 0; c < mesh->dim; c++)
            t[k - 1][c] = mesh->xyz[node[k] * mesh->dim + c] - mesh->xyz[node[0] * mesh->dim + c];
    if (corners == 2)
        return hypot(t[0][X], t[0][Y]);
    cross[X] = t[0][Y] * t[1][Z] - t[0][Z] * t[1][Y];
    cross[Y] = t[0][Z] * t[1][X] - t[0][X] * t[1][Z];
    cross[Z] = t[0][X] * t[1][Y] - t[0][Y] * t[1][X];
    if (corners == 4)
        return (cross[X] * t[2][X] + cross[Y] * t[2][Y] + cross[Z] * t[2][Z]) / 6;
    return 0.5 * (mesh->dim == 2 ? cross[Z] : sqrt(cross[X] * cross[X] + cross[Y] * cross[Y] + cross[Z] * cross[Z]));
}

static int corners_of(const uz_mesh *mesh, int64_t e)
{
    return uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
}

static double whole(const uz_mesh *mesh)
{
    double sum = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        sum += measure(mesh, mesh->node + mesh->first[e], corners_of(mesh, e));
    return sum;
}

/* Of sides that no other element shares. A node amid another element's side would leave sides within the body. */
static double outside(const uz_mesh *mesh)
{
    uz_corner_table sides;
    double sum = 0;
    CHECK_INT(uz_corner_table_build(&sides, mesh, true, NULL), UZ_OK);
    for (int64_t i = 0; i < sides.count; i++)
        if (!sides.same[i] && !sides.same[i + 1]) {
            int64_t node[UZ_FACE_NODES];
            uz_mesh_face(node, mesh, uz_corner_table_item(&sides, i));
            sum += measure(mesh, node, mesh->dim);
        }
    uz_corner_table_clear(&sides);
    return sum;
}

/* The worst element: its measure over that of the cube of its longest edge. */
static double worst_shape(const uz_mesh *mesh)
{
    double worst = INFINITY;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const int64_t *node = mesh->node + mesh->first[e];
        double longest = 0;
        for (int i = 0; i < corners_of(mesh, e); i++)
            for (int j = 0; j < i; j++) {
                double length = 0;
                for (int c = 0; c < mesh->dim; c++)
                    length = hypot(length, mesh->xyz[node[i] * mesh->dim + c] - mesh->xyz[node[j] * mesh->dim + c]);
                longest = fmax(longest, length);
            }
        worst = fmin(worst, measure(mesh, node, corners_of(mesh, e)) / pow(longest, mesh->dim));
    }
    return worst;
}

typedef struct {
    int64_t value[20000], count;
} list;

static void add_round(list *to, const int64_t *element, int64_t n)
{
    to->value[to->count++] = n;
    for (int64_t i = 0; i < n; i++)
        to->value[to->count++] = element[i];
}

/* Some elements of a mesh that is refined by the list, in a sequence that is the same each time. */
static void add_some(list *to, const uz_mesh *mesh, uint64_t *seed)
{
    int64_t some[64], n = 0;
    for (; n < 8; n++) {
        *seed = *seed * 6364136223846793005u + 1442695040888963407u;
        some[n] = (int64_t)(*seed >> 33) % mesh->n_elements;
    }
    add_round(to, some, n);
}

enum { MANY = 6 };
static const char *const KINDS[MANY] = {"tri3", "tri6", "tet4", "tet10", "quad4", "quad8"};

TEST(whole_sides_meet_and_nothing_is_lost)
{
    for (size_t k = 0; k < MANY; k++) {
        uz_mesh given = mesh_of(KINDS[k], 2);
        for (int64_t i = 0; i < given.n_nodes; i++) { /* no two lengths alike */
            double *x = given.xyz + i * given.dim;
            x[X] += 0.2 * x[Y] * x[X];
            x[Y] += 0.1 * x[X];
        }
        for (int64_t e = 0; e < given.n_elements; e++) /* straight edges */
            for (int a = corners_of(&given, e); a < given.first[e + 1] - given.first[e]; a++) {
                const int *ends = uz_element_type_of((uz_element_kind)given.kind[e])->edge[a - corners_of(&given, e)];
                const int64_t *node = given.node + given.first[e];
                for (int c = 0; c < given.dim; c++)
                    given.xyz[node[a] * given.dim + c] =
                        0.5 * (given.xyz[node[ends[0]] * given.dim + c] + given.xyz[node[ends[1]] * given.dim + c]);
            }
        list *marked = calloc(1, sizeof *marked);
        uint64_t seed = 7 + k;
        int64_t elements = given.n_elements;
        for (int round = 0; round < 6; round++) {
            uz_mesh fine = mesh_of(KINDS[k], 2);
            memcpy(fine.xyz, given.xyz, (size_t)(given.n_nodes * given.dim) * sizeof *fine.xyz);
            CHECK_INT(uz_mesh_bisect(&fine, marked->value, marked->count, NULL), UZ_OK);
            CHECK_MSG(round == 0 || fine.n_elements > elements, "%s: %lld elements", KINDS[k],
                      (long long)fine.n_elements);
            CHECK_REL(whole(&fine), whole(&given), 1e-12);
            CHECK_MSG(fabs(outside(&fine) / outside(&given) - 1) < 1e-12, "%s, round %d: %.17g, not %.17g", KINDS[k],
                      round, outside(&fine), outside(&given));
            CHECK(memcmp(fine.xyz, given.xyz, (size_t)(given.n_nodes * given.dim) * sizeof *fine.xyz) == 0);
            for (int64_t e = 0; e < fine.n_elements; e++)
                CHECK(measure(&fine, fine.node + fine.first[e], corners_of(&fine, e)) > 0);
            elements = fine.n_elements;
            add_some(marked, &fine, &seed);
            uz_mesh_clear(&fine);
        }
        free(marked);
        uz_mesh_clear(&given);
    }
}

/* Marked elements are halved once along each direction: all of them, as often as they are asked for. */
TEST(all_elements_of_a_box_become_as_many_as_of_a_finer_one)
{
    for (size_t k = 0; k < MANY; k++) {
        uz_mesh fine = mesh_of(KINDS[k], 2);
        const int64_t before = fine.n_elements;
        list *all = calloc(1, sizeof *all);
        all->value[all->count++] = before;
        for (int64_t e = 0; e < before; e++)
            all->value[all->count++] = e;
        CHECK_INT(uz_mesh_bisect(&fine, all->value, all->count, NULL), UZ_OK);
        const bool quadrilaterals = KINDS[k][0] == 'q'; /* two triangles each, so that nodes are amid them too */
        CHECK_INT(fine.n_elements, before << (quadrilaterals ? 3 : fine.dim));
        uz_mesh finer = mesh_of(strchr("34", KINDS[k][strlen(KINDS[k]) - 1]) ? "quad4" : "tri6", 4);
        if (fine.dim == 2)
            CHECK_INT(fine.n_nodes, finer.n_nodes);
        uz_mesh_clear(&fine);
        uz_mesh_clear(&finer);
        free(all);
    }
}

/* Both diagonals of a rectangle are as long: rounding of places does not choose the one that it is cut along. */
TEST(rectangles_that_are_turned_are_cut_alike)
{
    for (int turn = 0; turn < 8; turn++) {
        uz_mesh fine = mesh_of("quad4", 5), turned = mesh_of("quad4", 5);
        list *all = calloc(1, sizeof *all);
        all->value[all->count++] = fine.n_elements;
        for (int64_t e = 0; e < fine.n_elements; e++)
            all->value[all->count++] = e;
        for (int64_t a = 0; a < turned.n_nodes; a++) {
            double *x = turned.xyz + 2 * a;
            const double from[2] = {x[X], x[Y]};
            x[X] = cos(turn) * from[X] - sin(turn) * from[Y];
            x[Y] = sin(turn) * from[X] + cos(turn) * from[Y];
        }
        CHECK_INT(uz_mesh_bisect(&fine, all->value, all->count, NULL), UZ_OK);
        CHECK_INT(uz_mesh_bisect(&turned, all->value, all->count, NULL), UZ_OK);
        CHECK_INT(turned.n_elements, fine.n_elements);
        CHECK(memcmp(turned.node, fine.node, (size_t)fine.first[fine.n_elements] * sizeof *fine.node) == 0);
        uz_mesh_clear(&fine);
        uz_mesh_clear(&turned);
        free(all);
    }
}

/* However deep a corner is refined, the shapes are those of the first few bisections. */
TEST(shapes_do_not_get_worse)
{
    for (size_t k = 0; k < MANY; k++) {
        list *marked = calloc(1, sizeof *marked);
        double shape[13] = {0};
        for (int round = 0; round <= 12; round++) {
            uz_mesh fine = mesh_of(KINDS[k], 1);
            int64_t corner[400], n = 0;
            CHECK_INT(uz_mesh_bisect(&fine, marked->value, marked->count, NULL), UZ_OK);
            shape[round] = worst_shape(&fine);
            for (int64_t e = 0; e < fine.n_elements && n < 400; e++)
                for (int64_t q = fine.first[e]; q < fine.first[e + 1]; q++)
                    if (fine.node[q] == 0)
                        corner[n++] = e;
            add_round(marked, corner, n);
            uz_mesh_clear(&fine);
        }
        CHECK_MSG(shape[12] > 0.3 * shape[0] && shape[12] > (1 - 1e-9) * shape[6], "%s: %g, %g, %g", KINDS[k], shape[0],
                  shape[6], shape[12]);
        free(marked);
    }
}

static const uz_group *group_of(const uz_mesh *mesh, const char *name)
{
    const uz_group *group = uz_mesh_group(mesh, name, "", NULL);
    CHECK(group != NULL);
    return group;
}

TEST(groups_have_the_halves_of_their_sides)
{
    for (size_t k = 0; k < MANY; k++) {
        list *marked = calloc(1, sizeof *marked);
        uint64_t seed = 3;
        uz_mesh given = mesh_of(KINDS[k], 3);
        for (int round = 0; round < 3; round++)
            add_some(marked, &given, &seed);
        uz_mesh fine = mesh_of(KINDS[k], 3);
        CHECK_INT(uz_mesh_bisect(&fine, marked->value, marked->count, NULL), UZ_OK);
        static const char *const NAMES[] = {"left", "right", "bottom", "top", "back", "front"};
        for (int s = 0; s < 2 * fine.dim; s++) {
            const uz_group *group = group_of(&fine, NAMES[s]), *before = group_of(&given, NAMES[s]);
            const int axis = s / 2;
            const double at = s % 2 ? (double[]){3, 2, 1.5}[axis] : 0;
            double sum = 0, wanted = 0;
            int64_t nodes = 0, node[UZ_FACE_NODES];
            for (int64_t i = 0; i < group->n_faces; i++) {
                const int count = uz_mesh_face(node, &fine, group->face[i]);
                for (int a = 0; a < count; a++)
                    CHECK(fabs(fine.xyz[node[a] * fine.dim + axis] - at) < 1e-12);
                sum += measure(&fine, node, fine.dim);
            }
            for (int64_t i = 0; i < before->n_faces; i++) {
                uz_mesh_face(node, &given, before->face[i]);
                wanted += measure(&given, node, fine.dim);
            }
            CHECK_REL(sum, wanted, 1e-12);
            for (int64_t i = 0; i < fine.n_nodes; i++)
                nodes += fabs(fine.xyz[i * fine.dim + axis] - at) < 1e-12;
            CHECK_INT(group->n_nodes, nodes);
            CHECK(group->n_faces > before->n_faces);
        }
        free(marked);
        uz_mesh_clear(&fine);
        uz_mesh_clear(&given);
    }
}

/* Two triangles of a square; groups by nodes, of one element, of a face between them. */
TEST(groups_of_nodes_elements_and_inner_sides)
{
    double xyz[] = {0, 0, 1, 0, 1, 1, 0, 1};
    int64_t first[] = {0, 3, 6}, node[] = {0, 1, 2, 0, 2, 3}, diagonal[] = {0, 2}, two[] = {0, 2}, one[] = {1};
    int64_t face_first[] = {0, 2}, corner[] = {1}, marked[] = {2, 0, 1};
    unsigned char kind[] = {UZ_TRI3, UZ_TRI3};
    uz_given_group groups[] = {
        {.name = "inner", .n_faces = 1, .face_first = face_first, .face_node = diagonal},
        {.name = "line", .n_nodes = 2, .node = two},
        {.name = "point", .n_nodes = 1, .node = corner},
        {.name = "half", .n_elements = 1, .element = one},
    };
    const uz_given_mesh given = {.dim = 2,
                                 .n_nodes = 4,
                                 .xyz = xyz,
                                 .n_elements = 2,
                                 .kind = kind,
                                 .first = first,
                                 .node = node,
                                 .groups = groups,
                                 .n_groups = 4};
    uz_mesh mesh;
    CHECK_INT(uz_mesh_from_given(&mesh, &given, 2, NULL), UZ_OK);
    CHECK_INT(uz_mesh_bisect(&mesh, marked, 3, NULL), UZ_OK);
    CHECK_INT(mesh.n_elements, 8);
    CHECK_INT(mesh.n_nodes, 9);
    const uz_group *inner = group_of(&mesh, "inner"), *half = group_of(&mesh, "half");
    CHECK(inner->n_faces == 2 && inner->n_inner == 2 && inner->n_nodes == 3);
    CHECK_INT(group_of(&mesh, "line")->n_nodes, 3);
    CHECK_INT(group_of(&mesh, "point")->n_nodes, 1);
    CHECK(half->n_elements == 4 && half->n_nodes == 6);
    CHECK(group_of(&mesh, "boundary")->n_faces == 8 && group_of(&mesh, "boundary")->n_inner == 0);
    CHECK(group_of(&mesh, "all")->everything);
    uz_mesh_clear(&mesh);
}

/* The nodes of two sides of a square that meet in a corner: the middle of the edge that leads through the body past
 * that corner is none of them, however fine the mesh is. */
TEST(groups_of_nodes_of_sides_stay_on_the_sides)
{
    static const char *const NAMES[] = {"tri3", "tri6", "quad4", "tet4"};
    for (size_t k = 0; k < sizeof NAMES / sizeof NAMES[0]; k++) {
        list *marked = calloc(1, sizeof *marked);
        uint64_t seed = 5;
        uz_mesh box = mesh_of(NAMES[k], 2), fine = mesh_of(NAMES[k], 2);
        for (int round = 0; round < 4; round++)
            add_some(marked, &box, &seed);
        /* left becomes a group of the nodes of left and top */
        uz_group *left = fine.groups;
        while (strcmp(left->name, "left") != 0)
            left++;
        left->kind = UZ_GROUP_NODES;
        left->n_faces = 0;
        left->node = realloc(left->node, (size_t)fine.n_nodes * sizeof *left->node);
        left->n_nodes = 0;
        for (int64_t i = 0; i < fine.n_nodes; i++)
            if (fine.xyz[i * fine.dim] < 1e-9 || fine.xyz[i * fine.dim + 1] > 2 - 1e-9)
                left->node[left->n_nodes++] = i;
        CHECK_INT(uz_mesh_bisect(&fine, marked->value, marked->count, NULL), UZ_OK);
        const uz_group *both = group_of(&fine, "left");
        int64_t wanted = 0, inside = 0;
        for (int64_t i = 0; i < fine.n_nodes; i++)
            wanted += fine.xyz[i * fine.dim] < 1e-9 || fine.xyz[i * fine.dim + 1] > 2 - 1e-9;
        for (int64_t i = 0; i < both->n_nodes; i++) {
            const double *x = fine.xyz + both->node[i] * fine.dim, z = fine.dim == 3 ? x[Z] : 0;
            inside += x[X] > 1e-9 && x[Y] < 2 - 1e-9 && !(fine.dim == 3 && (z < 1e-9 || z > 1.5 - 1e-9));
        }
        CHECK_MSG(inside == 0 && both->n_nodes >= wanted, "%s: %lld nodes, not %lld, and %lld inside", NAMES[k],
                  (long long)both->n_nodes, (long long)wanted, (long long)inside);
        uz_mesh_clear(&box);
        uz_mesh_clear(&fine);
        free(marked);
    }
}

/* A quadratic map of the unit square: any part of it has the same map, so that curved sides stay what they are. */
static void bend(double *x, int dim)
{
    const double a = x[X], b = x[Y];
    x[X] = a + 0.1 * b * b;
    x[Y] = b + 0.05 * a * a - 0.05 * a * b;
    if (dim == 3)
        x[Z] += 0.08 * a * b;
}

TEST(curved_sides_stay_the_curves_that_they_are)
{
    for (size_t k = 1; k < 4; k += 2) {
        list *marked = calloc(1, sizeof *marked);
        uint64_t seed = 11;
        uz_mesh flat = mesh_of(KINDS[k], 2), fine = mesh_of(KINDS[k], 2);
        for (int round = 0; round < 3; round++)
            add_some(marked, &flat, &seed);
        for (int64_t i = 0; i < fine.n_nodes; i++)
            bend(fine.xyz + i * fine.dim, fine.dim);
        CHECK_INT(uz_mesh_bisect(&flat, marked->value, marked->count, NULL), UZ_OK);
        CHECK_INT(uz_mesh_bisect(&fine, marked->value, marked->count, NULL), UZ_OK);
        for (int64_t i = 0; i < fine.n_nodes; i++) {
            double x[3] = {flat.xyz[i * fine.dim], flat.xyz[i * fine.dim + 1], flat.xyz[i * fine.dim + fine.dim - 1]};
            bend(x, fine.dim);
            for (int c = 0; c < fine.dim; c++)
                CHECK_MSG(fabs(fine.xyz[i * fine.dim + c] - x[c]) < 1e-12, "%s, node %lld: %g, not %g", KINDS[k],
                          (long long)i, fine.xyz[i * fine.dim + c], x[c]);
        }
        CHECK(2 * fine.n_nodes > 3 * fine.n_given);
        uz_mesh_clear(&flat);
        uz_mesh_clear(&fine);
        free(marked);
    }
}

/* A round of elements that are halved once, among others: two triangles of four sides with one diagonal, three nodes
 * more of quadratic ones for each side that is halved. */
TEST(rounds_of_single_bisections)
{
    uz_mesh mesh = mesh_of("tri3", 1);
    const double area = whole(&mesh);
    CHECK_INT(uz_mesh_bisect(&mesh, (int64_t[]){UZ_HALVED_ONCE, 1, 0}, 3, NULL), UZ_OK);
    CHECK_INT(mesh.n_elements, 4); /* both have the longest edge */
    CHECK_INT(mesh.n_nodes, 5);
    CHECK_REL(whole(&mesh), area, 1e-14);
    uz_mesh_clear(&mesh);
    mesh = mesh_of("tri6", 1);
    CHECK_INT(uz_mesh_bisect(&mesh, (int64_t[]){1, 0, UZ_HALVED_ONCE, 2, 0, 1}, 6, NULL), UZ_OK);
    uz_mesh twice = mesh_of("tri6", 1);
    CHECK_INT(uz_mesh_bisect(&twice, (int64_t[]){1, 0}, 2, NULL), UZ_OK);
    CHECK(mesh.n_elements >= twice.n_elements + 2 && mesh.n_elements < twice.n_elements + 6);
    CHECK_REL(outside(&mesh), outside(&twice), 1e-14);
    uz_mesh_clear(&twice);
    uz_mesh_clear(&mesh);
    mesh = mesh_of("tet4", 1);
    const int64_t before = mesh.n_elements;
    CHECK_INT(uz_mesh_bisect(&mesh, (int64_t[]){UZ_HALVED_ONCE, 1, 0}, 3, NULL), UZ_OK);
    CHECK(mesh.n_elements > before && mesh.n_elements <= 2 * before);
    uz_mesh_clear(&mesh);
}

TEST(what_can_not_be_bisected_is_refused)
{
    uz_box box = box_of("tet10", 1);
    uz_mesh mesh;
    strcpy(box.element, "hex20");
    CHECK_INT(uz_mesh_from_box(&mesh, &box, NULL), UZ_OK);
    uz_error err = {0};
    CHECK_INT(uz_mesh_check_bisection(&mesh, &err), UZ_ERR_SCENE);
    CHECK(strcmp(err.where, "/mesh/refine") == 0 && strstr(err.message, "hex20") && strstr(err.message, "tet10"));
    CHECK_INT(uz_mesh_bisect(&mesh, (int64_t[]){1, 0}, 2, NULL), UZ_ERR_SCENE);
    uz_mesh_clear(&mesh);
    static const int64_t LISTS[][3] = {
        {1, 2, 0}, {3, 0, 1}, {-1, 0, 0}, {1, -1, 0}, {UZ_HALVED_ONCE, 1, 2}, {UZ_HALVED_ONCE, UZ_HALVED_ONCE, 0}};
    for (int i = 0; i < 6; i++) {
        mesh = mesh_of("tri3", 1);
        CHECK_INT(uz_mesh_bisect(&mesh, LISTS[i], i < 4 ? 2 : 3, NULL), UZ_ERR_ARGUMENT);
        uz_mesh_clear(&mesh);
        mesh = mesh_of("tri3", 1);
        CHECK_INT(uz_mesh_bisect(&mesh, (int64_t[]){UZ_HALVED_ONCE}, 1, NULL), UZ_ERR_ARGUMENT);
        uz_mesh_clear(&mesh);
    }
}
