/* wedge6.c: the linear wedge: a triangle times a line. Local coordinates: the unit triangle, then [-1, 1].
 *
 * In VTK's order the triangle of nodes 0, 1, 2 has its normal away from 3, 4, 5 (VTK, vtkWedge; Gmsh and CalculiX have
 * it towards them), so that node 1 is at (0, 1) and node 2 at (1, 0). Three points of the triangle times two of the
 * line: the one in its middle, which CalculiX takes for C3D6, leaves torsion about the line without stiffness. */
#include "element/reference.h"

static const double LOCAL[6][3] = {{0, 0, -1}, {0, 1, -1}, {1, 0, -1}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}};
/* The barycentric coordinate that is 1 at a node. */
static const int CORNER[6] = {0, 2, 1, 0, 2, 1};
static const int NEXT[6][3] = {{2, 1, 3}, {0, 2, 4}, {1, 0, 5}, {4, 5, 0}, {5, 3, 1}, {3, 4, 2}};
static const int PART[2][UZ_ELEMENT_CORNERS] = {{0, 2, 1, 4, 6, 5}, {0, 3, 2, 4, 7, 6}};
static const int GMSH[6] = {0, 2, 1, 3, 5, 4};

static const uz_gauss_point GAUSS[6] = {
    {{1. / 6, 1. / 6, -UZ_GAUSS2}, 1. / 2 / 3}, {{2. / 3, 1. / 6, -UZ_GAUSS2}, 1. / 2 / 3},
    {{1. / 6, 2. / 3, -UZ_GAUSS2}, 1. / 2 / 3}, {{1. / 6, 1. / 6, UZ_GAUSS2}, 1. / 2 / 3},
    {{2. / 3, 1. / 6, UZ_GAUSS2}, 1. / 2 / 3},  {{1. / 6, 2. / 3, UZ_GAUSS2}, 1. / 2 / 3}};

static void shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    double L[4];
    uz_barycentric(L, 2, point);
    for (int a = 0; a < 6; a++) {
        const double along = 0.5 * (1 + LOCAL[a][2] * point[2]);
        if (N)
            N[a] = L[CORNER[a]] * along;
        if (slope) {
            slope[a][0] = uz_barycentric_slope(CORNER[a], 0) * along;
            slope[a][1] = uz_barycentric_slope(CORNER[a], 1) * along;
            slope[a][2] = 0.5 * LOCAL[a][2] * L[CORNER[a]];
        }
    }
}

const uz_element_type uz_type_wedge6 = {
    .name = "wedge6",
    .dim = 3,
    .nodes = 6,
    .corners = 6,
    .sides = 5,
    .side = {{3, 3, {0, 1, 2}}, {3, 3, {3, 5, 4}}, {4, 4, {0, 3, 4, 1}}, {4, 4, {1, 4, 5, 2}}, {4, 4, {2, 5, 3, 0}}},
    .linear = UZ_WEDGE6,
    .local = LOCAL,
    .centre = {1.0 / 3, 1.0 / 3, 0},
    .shape = shape,
    .rule = {6, GAUSS},
    .recover = uz_recover_centre,
    .next = NEXT,
    .mirrored = "its first three nodes must run clockwise seen from the side of the other three: swap the threes",
    .parts = 2,
    .part = PART,
    .vtk = 13,
    .gmsh = 6,
    .gmsh_node = GMSH,
    .abaqus = {NULL, NULL, NULL, "C3D6"},
    .abaqus_node = GMSH,
};
