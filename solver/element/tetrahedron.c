/* tetrahedron.c: tet4 and tet10.
 *
 * A cell of a box is six of them, those of the Kuhn (Freudenthal) triangulation: one for each order of the axes, all
 * sharing the diagonal from the first to the last corner, so that neighbours cut their common face alike (Freudenthal,
 * "Simplizialzerlegungen von beschraenkter Flachheit", 1942). */
#include "element/reference.h"

static const double LOCAL[10][3] = {{0, 0, 0},     {1, 0, 0},   {0, 1, 0},   {0, 0, 1},     {0.5, 0, 0},
                                    {0.5, 0.5, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0, 0.5}, {0, 0.5, 0.5}};
static const int EDGE[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
static const int NEXT[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
static const int PART[6][UZ_ELEMENT_CORNERS] = {{0, 1, 2, 6}, {0, 5, 1, 6}, {0, 3, 7, 6},
                                                {0, 2, 3, 6}, {0, 4, 5, 6}, {0, 7, 4, 6}};
static const int GMSH10[10] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};

static const uz_gauss_point CENTRE[1] = {{{1. / 4, 1. / 4, 1. / 4}, 1. / 6}};
/* Degree 2: Keast, Comput. Methods Appl. Mech. Engrg 55 (1986). */
#define A 0.13819660112501051518 /* (5 - sqrt(5)) / 20 */
#define B 0.58541019662496845446 /* (5 + 3 sqrt(5)) / 20 */
static const uz_gauss_point FOUR[4] = {
    {{A, A, A}, 1. / 6 / 4}, {{B, A, A}, 1. / 6 / 4}, {{A, B, A}, 1. / 6 / 4}, {{A, A, B}, 1. / 6 / 4}};
#undef A
#undef B

const uz_element_type uz_type_tet4 = {
    .name = "tet4",
    .dim = 3,
    .nodes = 4,
    .corners = 4,
    .sides = 4,
    .side = {{3, 3, {0, 2, 1}}, {3, 3, {0, 1, 3}}, {3, 3, {1, 2, 3}}, {3, 3, {0, 3, 2}}},
    .linear = UZ_TET4,
    .local = LOCAL,
    .centre = {0.25, 0.25, 0.25},
    .shape = uz_simplex_shape,
    .rule = {1, CENTRE},
    .energy = {4, FOUR},
    .jacobian = UZ_JACOBIAN_CONSTANT,
    .recover = uz_recover_centre,
    .next = NEXT,
    .mirrored = "its first three nodes must run counterclockwise seen from the fourth: swap two corners, and the "
                "middles of edges with them",
    .parts = 6,
    .part = PART,
    .vtk = 10,
    .gmsh = 4,
    .abaqus = {NULL, NULL, NULL, "C3D4"},
};

const uz_element_type uz_type_tet10 = {
    .name = "tet10",
    .dim = 3,
    .nodes = 10,
    .corners = 4,
    .sides = 4,
    .side = {{6, 3, {0, 2, 1, 6, 5, 4}},
             {6, 3, {0, 1, 3, 4, 8, 7}},
             {6, 3, {1, 2, 3, 5, 9, 8}},
             {6, 3, {0, 3, 2, 7, 9, 6}}},
    .edge = EDGE,
    .linear = UZ_TET4,
    .local = LOCAL,
    .centre = {0.25, 0.25, 0.25},
    .shape = uz_simplex_shape,
    .rule = {4, FOUR},
    .recover = uz_recover_simplex,
    .vtk = 24,
    .gmsh = 11,
    .gmsh_node = GMSH10,
    .abaqus = {NULL, NULL, NULL, "C3D10"},
};
