/* triangle.c: tri3 and tri6. */
#include "element/reference.h"

static const double LOCAL[6][3] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
static const int EDGE[3][2] = {{0, 1}, {1, 2}, {2, 0}};
static const int NEXT[3][3] = {{1, 2}, {2, 0}, {0, 1}};
static const int PART[2][UZ_ELEMENT_CORNERS] = {{0, 1, 2}, {0, 2, 3}};

static const uz_gauss_point CENTRE[1] = {{{1. / 3, 1. / 3}, 1. / 2}};

/* A ring needs three points where a plane needs one: N / r is not constant. */
const uz_element_type uz_type_tri3 = {
    .name = "tri3",
    .dim = 2,
    .nodes = 3,
    .corners = 3,
    .sides = 3,
    .side = {{2, 2, {0, 1}}, {2, 2, {1, 2}}, {2, 2, {2, 0}}},
    .linear = UZ_TRI3,
    .local = LOCAL,
    .centre = {1.0 / 3, 1.0 / 3},
    .shape = uz_simplex_shape,
    .rule = {1, CENTRE},
    .ring = {3, uz_gauss_triangle3},
    .energy = {3, uz_gauss_triangle3},
    .jacobian = UZ_JACOBIAN_CONSTANT,
    .recover = uz_recover_centre,
    .next = NEXT,
    .mirrored = UZ_ADVICE_PLANE,
    .parts = 2,
    .part = PART,
    .vtk = 5,
    .gmsh = 2,
    .abaqus = {"CPS3", "CPE3", "CAX3"},
};

const uz_element_type uz_type_tri6 = {
    .name = "tri6",
    .dim = 2,
    .nodes = 6,
    .corners = 3,
    .sides = 3,
    .side = {{3, 2, {0, 1, 3}}, {3, 2, {1, 2, 4}}, {3, 2, {2, 0, 5}}},
    .edge = EDGE,
    .linear = UZ_TRI3,
    .local = LOCAL,
    .centre = {1.0 / 3, 1.0 / 3},
    .shape = uz_simplex_shape,
    .rule = {3, uz_gauss_triangle3},
    .ring = {6, uz_gauss_triangle6}, /* with curved edges a constant stress does work of degree 4, as r has 2 */
    .energy = {6, uz_gauss_triangle6},
    .recover = uz_recover_simplex,
    .vtk = 22,
    .gmsh = 9,
    .abaqus = {"CPS6", "CPE6", "CAX6"},
};
