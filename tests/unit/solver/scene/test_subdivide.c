/* Subdivision of quadrilaterals, hexahedra and wedges: what hangs is interpolated, functions stay continuous, levels
 * are balanced, groups are inherited. */
#include "element/element.h"
#include "harness.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { X, Y, Z, MANY = 4, ALL = 6 };
/* The first of which may be divided one by one. */
static const char *const KINDS[ALL] = {"quad4", "quad8", "hex8", "hex20", "wedge6", "wedge15"};

static uz_mesh mesh_of(const char *element, int64_t cells)
{
    uz_box box = {.size = {3, 2, 1.5}, .cells = {cells, cells, cells}, .grading = {1, 1, 1}};
    snprintf(box.element, sizeof box.element, "%s", element);
    box.dim = element[0] == 'q' || element[0] == 't' ? 2 : 3;
    uz_mesh mesh;
    CHECK_INT(uz_mesh_from_box(&mesh, &box, NULL), UZ_OK);
    return mesh;
}

/* Three quadrilaterals around one corner, or with `layers` three hexahedra around each edge of a column. */
static uz_mesh three_around(int layers)
{
    static const double PLANE[7][2] = {{0, 0}, {2, 0}, {2, 1.5}, {-0.5, 1.8}, {-2, 0.8}, {-1.7, -1.2}, {0.5, -2}};
    static const int CORNER[3][4] = {{0, 1, 2, 3}, {0, 3, 4, 5}, {0, 5, 6, 1}};
    const int dim = layers > 0 ? 3 : 2, across = layers > 0 ? layers + 1 : 1, count = 3 * (layers > 0 ? layers : 1);
    double xyz[3 * 7 * 4];
    int64_t node[8 * 9], first[10];
    unsigned char kind[9];
    for (int l = 0; l < across; l++)
        for (int i = 0; i < 7; i++) {
            double *at = xyz + dim * (7 * l + i);
            memcpy(at, PLANE[i], sizeof PLANE[i]);
            if (dim == 3)
                at[Z] = l + 0.1 * PLANE[i][0];
        }
    for (int e = 0; e <= count; e++)
        first[e] = (dim == 3 ? 8 : 4) * e;
    for (int e = 0; e < count; e++) {
        kind[e] = dim == 3 ? UZ_HEX8 : UZ_QUAD4;
        for (int k = 0; k < (dim == 3 ? 8 : 4); k++)
            node[first[e] + k] = CORNER[e % 3][k % 4] + 7 * (e / 3 + k / 4);
    }
    const uz_given_mesh given = {
        .dim = dim, .n_nodes = 7 * across, .xyz = xyz, .n_elements = count, .kind = kind, .first = first, .node = node};
    uz_mesh mesh;
    CHECK_INT(uz_mesh_from_given(&mesh, &given, dim, NULL), UZ_OK);
    return mesh;
}

/* Nodes as shape functions at a point of an element give them. */
static void place(double x[3], const uz_mesh *mesh, int64_t e, const double point[3], const double *value, int width)
{
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    double N[UZ_ELEMENT_NODES];
    uz_element_shape(N, (uz_element_kind)mesh->kind[e], point);
    for (int c = 0; c < width; c++) {
        x[c] = 0;
        for (int a = 0; a < count; a++)
            x[c] += N[a] * value[node[a] * width + c];
    }
}

static double volume_of(const uz_mesh *mesh, int64_t e)
{
    double xyz[3 * UZ_ELEMENT_NODES];
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    for (int i = 0; i < count * mesh->dim; i++)
        xyz[i] = mesh->xyz[node[i / mesh->dim] * mesh->dim + i % mesh->dim];
    const uz_element element = {.kind = (uz_element_kind)mesh->kind[e],
                                .model = mesh->dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN,
                                .thickness = 1,
                                .xyz = xyz};
    CHECK_INT(uz_element_check(&element), UZ_SHAPE_GOOD);
    return uz_element_volume(&element);
}

static double area_of(const uz_mesh *mesh, uz_face face)
{
    double xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    const int count = uz_mesh_face(node, mesh, face);
    for (int i = 0; i < count * mesh->dim; i++)
        xyz[i] = mesh->xyz[node[i / mesh->dim] * mesh->dim + i % mesh->dim];
    const uz_side side = {mesh->dim, count, mesh->dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN, 1, xyz};
    return uz_side_area(&side);
}

static double whole(const uz_mesh *mesh)
{
    double sum = 0;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        sum += volume_of(mesh, e);
    return sum;
}

typedef struct {
    int64_t value[20000], count;
} list;

static list *new_list(void)
{
    list *to = calloc(1, sizeof *to);
    to->value[to->count++] = UZ_SUBDIVIDED;
    return to;
}

/* Some elements of a mesh that is refined by the list, in a sequence that is the same each time. */
static void add_some(list *to, const uz_mesh *mesh, uint64_t *seed, int64_t n)
{
    to->value[to->count++] = n;
    for (int64_t k = 0; k < n; k++) {
        *seed = *seed * 6364136223846793005u + 1442695040888963407u;
        to->value[to->count++] = (int64_t)(*seed >> 33) % mesh->n_elements;
    }
}

static double size_along(const uz_mesh *mesh, int64_t e, int axis, double end[2])
{
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    end[0] = INFINITY;
    end[1] = -INFINITY;
    for (int a = 0; a < count; a++) {
        end[0] = fmin(end[0], mesh->xyz[node[a] * mesh->dim + axis]);
        end[1] = fmax(end[1], mesh->xyz[node[a] * mesh->dim + axis]);
    }
    return end[1] - end[0];
}

/* Of a box: elements that have more than a corner in common differ by one level at most, and random values at the nodes
 * that do not hang are a continuous function once hanging ones follow. Returns how many pairs were compared. */
static int64_t check_neighbours(const uz_mesh *mesh, uint64_t *seed)
{
    const int dim = mesh->dim;
    double *value = calloc((size_t)mesh->n_nodes, sizeof *value);
    int64_t pairs = 0;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        *seed = *seed * 6364136223846793005u + 1442695040888963407u;
        value[i] = (double)(*seed >> 33) / 4e9;
    }
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        if (uz_mesh_hangs(mesh, i))
            value[i] = uz_mesh_value_amid(mesh, i, value, 1);
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t f = 0; f < e; f++) {
            double low[3] = {0}, high[3] = {0}, own[3][2], other[3][2];
            bool meet = true, alike = true;
            int wide = 0;
            for (int c = 0; c < dim; c++) {
                const double ratio = size_along(mesh, e, c, own[c]) / size_along(mesh, f, c, other[c]);
                low[c] = fmax(own[c][0], other[c][0]);
                high[c] = fmin(own[c][1], other[c][1]);
                meet = meet && high[c] > low[c] - 1e-9;
                wide += high[c] > low[c] + 1e-9;
                alike = alike && ratio > 0.49 && ratio < 2.1;
            }
            if (!meet || wide == 0)
                continue;
            CHECK(alike && wide < dim);
            pairs++;
            for (int k = 0; k < 4; k++) { /* points of what they have in common */
                double at[2][3] = {{0}}, found[2][3];
                for (int c = 0; c < dim; c++) {
                    const double x = low[c] + (0.13 + 0.24 * k) * (high[c] - low[c]) * (c == 1 ? 0.7 : 1);
                    at[0][c] = 2 * (x - own[c][0]) / (own[c][1] - own[c][0]) - 1;
                    at[1][c] = 2 * (x - other[c][0]) / (other[c][1] - other[c][0]) - 1;
                }
                place(found[0], mesh, e, at[0], value, 1);
                place(found[1], mesh, f, at[1], value, 1);
                CHECK_MSG(fabs(found[0][0] - found[1][0]) < 1e-12, "%g and %g", found[0][0], found[1][0]);
            }
        }
    free(value);
    return pairs;
}

/* What hangs lies where the shape functions say, and amid nodes that do not. */
static int64_t check_hanging(const uz_mesh *mesh)
{
    int64_t hanging = 0;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        const int64_t *from;
        const double *share;
        double sum = 0;
        if (i < mesh->n_given) {
            CHECK(!uz_mesh_hangs(mesh, i));
            continue;
        }
        const int count = uz_mesh_amid(&from, &share, mesh, i);
        for (int k = 0; k < count; k++) {
            CHECK(from[k] < i && !(uz_mesh_hangs(mesh, i) && uz_mesh_hangs(mesh, from[k])));
            sum += share[k];
        }
        CHECK(count >= 2 && sum == 1);
        for (int c = 0; c < mesh->dim; c++)
            CHECK(fabs(uz_mesh_value_amid(mesh, i, mesh->xyz + c, mesh->dim) - mesh->xyz[i * mesh->dim + c]) < 1e-14);
        hanging += uz_mesh_hangs(mesh, i);
    }
    return hanging;
}

TEST(functions_are_continuous_and_levels_balanced)
{
    for (size_t k = 0; k < MANY; k++) {
        list *marked = new_list();
        uint64_t seed = 7 + k;
        uz_mesh given = mesh_of(KINDS[k], 2);
        int64_t elements = given.n_elements, hanging = 0, pairs = 0;
        for (int round = 0; round < 5; round++) {
            uz_mesh fine = mesh_of(KINDS[k], 2);
            CHECK_INT(uz_mesh_subdivide(&fine, marked->value, marked->count, NULL), UZ_OK);
            CHECK(round == 0 || fine.n_elements > elements);
            CHECK_REL(whole(&fine), whole(&given), 1e-12);
            CHECK(memcmp(fine.xyz, given.xyz, (size_t)(given.n_nodes * given.dim) * sizeof *fine.xyz) == 0);
            hanging += check_hanging(&fine);
            pairs += check_neighbours(&fine, &seed);
            elements = fine.n_elements;
            add_some(marked, &fine, &seed, round < 2 ? 1 : fine.dim == 2 ? 8 : 3);
            uz_mesh_clear(&fine);
        }
        CHECK(hanging > 20 && pairs > 100);
        free(marked);
        uz_mesh_clear(&given);
    }
}

/* Around a corner deep in the mesh, and where three or six elements meet in an edge. */
TEST(nothing_hangs_on_what_hangs)
{
    for (int layers = 0; layers <= 3; layers++) {
        list *marked = new_list();
        uint64_t seed = 11 + (uint64_t)layers;
        int64_t hanging = 0;
        for (int round = 0; round < 8; round++) {
            uz_mesh fine = three_around(layers), given = three_around(layers);
            CHECK_INT(uz_mesh_subdivide(&fine, marked->value, marked->count, NULL), UZ_OK);
            CHECK_REL(whole(&fine), whole(&given), 1e-12);
            hanging += check_hanging(&fine);
            if (round % 2 == 0) {
                add_some(marked, &fine, &seed, 2);
            } else { /* all at the first corner */
                int64_t *count = &marked->value[marked->count++];
                for (int64_t e = 0; e < fine.n_elements; e++)
                    for (int64_t q = fine.first[e]; q < fine.first[e + 1]; q++)
                        if (fine.node[q] == 0) {
                            marked->value[marked->count++] = e;
                            (*count)++;
                        }
            }
            uz_mesh_clear(&given);
            uz_mesh_clear(&fine);
        }
        CHECK(hanging > 50);
        free(marked);
    }
}

/* Twice; elements and sides have the sizes of those, and sides of the box as many nodes. */
TEST(all_elements_of_a_box_become_those_of_a_finer_one)
{
    static const char *const NAMES[] = {"left", "right", "bottom", "top", "back", "front"};
    for (size_t k = 0; k < ALL; k++) {
        uz_mesh fine = mesh_of(KINDS[k], 1), finer = mesh_of(KINDS[k], 4);
        const int parts = 1 << fine.dim;
        list *all = new_list();
        for (int64_t n = fine.n_elements, round = 0; round < 2; round++, n *= parts) {
            all->value[all->count++] = n;
            for (int64_t e = 0; e < n; e++)
                all->value[all->count++] = e;
        }
        CHECK(uz_mesh_can_subdivide_all(&fine));
        CHECK_INT(uz_mesh_subdivide(&fine, all->value, all->count, NULL), UZ_OK);
        CHECK(fine.n_elements == finer.n_elements && fine.n_nodes == finer.n_nodes && !fine.hangs);
        for (int64_t e = 0; e < fine.n_elements; e++)
            CHECK_REL(volume_of(&fine, e), volume_of(&finer, 0), 1e-12);
        for (int s = 0; s < 2 * fine.dim; s++) {
            const uz_group *mine = uz_mesh_group(&fine, NAMES[s], "", NULL),
                           *other = uz_mesh_group(&finer, NAMES[s], "", NULL);
            CHECK(mine->n_faces == other->n_faces && mine->n_nodes == other->n_nodes);
            for (int64_t i = 0; i < mine->n_faces; i++)
                CHECK_REL(area_of(&fine, mine->face[i]), area_of(&finer, other->face[0]), 1e-12);
        }
        uz_mesh_clear(&fine);
        uz_mesh_clear(&finer);
        free(all);
    }
}

/* The same list gives the same mesh, and a longer one a refinement of it: nodes keep their numbers and places. */
TEST(lists_make_the_same_mesh_again)
{
    for (size_t k = 0; k < MANY; k++) {
        list *marked = new_list();
        uint64_t seed = 5;
        uz_mesh fine[3];
        for (int i = 0; i < 3; i++) {
            fine[i] = mesh_of(KINDS[k], 2);
            if (i == 2)
                add_some(marked, &fine[1], &seed, 2);
            if (i == 0)
                add_some(marked, &fine[0], &seed, 2);
            CHECK_INT(uz_mesh_subdivide(&fine[i], marked->value, marked->count, NULL), UZ_OK);
        }
        const size_t size = (size_t)(fine[0].n_nodes * fine[0].dim) * sizeof(double);
        CHECK(fine[1].n_nodes == fine[0].n_nodes && memcmp(fine[1].xyz, fine[0].xyz, size) == 0);
        CHECK(fine[2].n_nodes > fine[0].n_nodes && memcmp(fine[2].xyz, fine[0].xyz, size) == 0);
        for (int i = 0; i < 3; i++)
            uz_mesh_clear(&fine[i]);
        free(marked);
    }
}

static const uz_group *group_of(const uz_mesh *mesh, const char *name)
{
    const uz_group *group = uz_mesh_group(mesh, name, "", NULL);
    CHECK(group != NULL);
    return group;
}

/* Sides keep their areas; sides within the body, fine ones beside a coarse one too, are none of the boundary. */
TEST(groups_have_the_parts_of_their_sides)
{
    static const char *const NAMES[] = {"left", "right", "bottom", "top", "back", "front"};
    for (size_t k = 0; k < MANY; k++) {
        list *marked = new_list();
        uint64_t seed = 3;
        uz_mesh given = mesh_of(KINDS[k], 3), fine = mesh_of(KINDS[k], 3);
        for (int round = 0; round < 3; round++)
            add_some(marked, &given, &seed, 6);
        CHECK_INT(uz_mesh_subdivide(&fine, marked->value, marked->count, NULL), UZ_OK);
        double outside = 0, wanted = 0, sides = 0;
        int64_t node[UZ_FACE_NODES];
        for (int s = 0; s < 2 * fine.dim; s++) {
            const uz_group *group = group_of(&fine, NAMES[s]), *before = group_of(&given, NAMES[s]);
            const int axis = s / 2;
            const double at = s % 2 ? (double[]){3, 2, 1.5}[axis] : 0;
            double sum = 0;
            int64_t nodes = 0;
            for (int64_t i = 0; i < group->n_faces; i++) {
                for (int a = uz_mesh_face(node, &fine, group->face[i]) - 1; a >= 0; a--)
                    CHECK(fabs(fine.xyz[node[a] * fine.dim + axis] - at) < 1e-12);
                sum += area_of(&fine, group->face[i]);
            }
            wanted = 0;
            for (int64_t i = 0; i < before->n_faces; i++)
                wanted += area_of(&given, before->face[i]);
            CHECK_REL(sum, wanted, 1e-12);
            for (int64_t i = 0; i < fine.n_nodes; i++)
                nodes += fabs(fine.xyz[i * fine.dim + axis] - at) < 1e-12;
            CHECK_INT(group->n_nodes, nodes);
            CHECK(group->n_faces > before->n_faces && group->n_inner == 0);
            sides += wanted;
        }
        CHECK(fine.hangs && fine.inside);
        for (int64_t e = 0; e < fine.n_elements && fine.inside; e++)
            for (int s = 0; s < uz_element_type_of((uz_element_kind)fine.kind[e])->sides; s++)
                outside += fine.inside[e] >> s & 1 ? 0 : area_of(&fine, (uz_face){e, s});
        CHECK_REL(outside, sides, 1e-12);
        free(marked);
        uz_mesh_clear(&fine);
        uz_mesh_clear(&given);
    }
}

/* A face between two elements is one of two parts, of which only one side is divided. */
TEST(groups_of_nodes_elements_and_inner_sides)
{
    double xyz[] = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
    int64_t first[] = {0, 4, 8}, node[] = {0, 1, 4, 3, 1, 2, 5, 4}, between[] = {1, 4}, low[] = {0, 1, 2},
            face_first[] = {0, 2}, right[] = {1};
    const int64_t marked[] = {UZ_SUBDIVIDED, 1, 0};
    unsigned char kind[] = {UZ_QUAD4, UZ_QUAD4};
    uz_given_group groups[] = {
        {.name = "inner", .n_faces = 1, .face_first = face_first, .face_node = between},
        {.name = "low", .n_nodes = 3, .node = low},
        {.name = "half", .n_elements = 1, .element = right},
    };
    const uz_given_mesh given = {.dim = 2,
                                 .n_nodes = 6,
                                 .xyz = xyz,
                                 .n_elements = 2,
                                 .kind = kind,
                                 .first = first,
                                 .node = node,
                                 .groups = groups,
                                 .n_groups = 3};
    uz_mesh mesh;
    CHECK_INT(uz_mesh_from_given(&mesh, &given, 2, NULL), UZ_OK);
    CHECK_INT(uz_mesh_subdivide(&mesh, marked, 3, NULL), UZ_OK);
    CHECK(mesh.n_elements == 5 && mesh.n_nodes == 11);
    const uz_group *inner = group_of(&mesh, "inner"), *half = group_of(&mesh, "half");
    CHECK(inner->n_faces == 2 && inner->n_inner == 2 && inner->n_nodes == 3);
    CHECK_INT(group_of(&mesh, "low")->n_nodes, 4);
    CHECK(half->n_elements == 1 && half->n_nodes == 4);
    CHECK(group_of(&mesh, "boundary")->n_faces == 9 && group_of(&mesh, "boundary")->n_inner == 0);
    int64_t hanging = 0;
    for (int64_t i = 0; i < mesh.n_nodes; i++)
        hanging += uz_mesh_hangs(&mesh, i);
    CHECK_INT(hanging, 1);
    uz_mesh_clear(&mesh);
}

TEST(lists_that_are_none_are_refused)
{
    static const int64_t LISTS[][3] = {
        {UZ_SUBDIVIDED, 1, 16}, {UZ_SUBDIVIDED, 5, 0}, {UZ_SUBDIVIDED, -1, 0}, {0, 0, 0}};
    for (size_t k = 0; k < sizeof LISTS / sizeof LISTS[0]; k++) {
        uz_mesh mesh = mesh_of("quad4", 2);
        uz_error err = {0};
        CHECK_INT(uz_mesh_subdivide(&mesh, LISTS[k], 3, &err), UZ_ERR_ARGUMENT);
        uz_mesh_clear(&mesh);
    }
    uz_mesh mesh = mesh_of("tri3", 2), wedges = mesh_of("wedge6", 1);
    uz_error err = {0};
    CHECK_INT(uz_mesh_subdivide(&mesh, LISTS[0], 3, &err), UZ_ERR_SCENE);
    CHECK_INT(uz_mesh_subdivide(&wedges, (int64_t[]){UZ_SUBDIVIDED, 1, 0}, 3, &err), UZ_ERR_ARGUMENT); /* all or none */
    CHECK(!uz_mesh_can_subdivide(&wedges));
    uz_mesh_clear(&mesh);
    uz_mesh_clear(&wedges);
}
