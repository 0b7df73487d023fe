/* wedge15.c: the wedge of 15 nodes of the serendipity family. Local coordinates: the unit triangle, then [-1, 1].
 *
 * Shape functions: Zienkiewicz and Taylor, "The Finite Element Method", vol. 1, section on prisms. Order of nodes: VTK,
 * vtkQuadraticWedge (see wedge6.c). Three points of the triangle times three of the line, as CalculiX has it for C3D15.
 * Its stress is most accurate where the rules of one order less have their points: three times two. */
#include "element/reference.h"

#include <string.h>

static const double LOCAL[15][3] = {{0, 0, -1},    {0, 1, -1},   {1, 0, -1},     {0, 0, 1},    {0, 1, 1},
                                    {1, 0, 1},     {0, 0.5, -1}, {0.5, 0.5, -1}, {0.5, 0, -1}, {0, 0.5, 1},
                                    {0.5, 0.5, 1}, {0.5, 0, 1},  {0, 0, 0},      {0, 1, 0},    {1, 0, 0}};
static const int EDGE[9][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}};
/* The barycentric coordinate that is 1 at a corner. */
static const int CORNER[6] = {0, 2, 1, 0, 2, 1};
static const int GMSH[15] = {0, 2, 1, 3, 5, 4, 7, 9, 6, 13, 14, 12, 8, 11, 10};
static const int ABAQUS[15] = {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13};

static const uz_gauss_point GAUSS[9] = {
    {{1. / 6, 1. / 6, -UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3}, {{2. / 3, 1. / 6, -UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3},
    {{1. / 6, 2. / 3, -UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3}, {{1. / 6, 1. / 6, 0}, 1. / 2 / 3 * UZ_INNER3},
    {{2. / 3, 1. / 6, 0}, 1. / 2 / 3 * UZ_INNER3},          {{1. / 6, 2. / 3, 0}, 1. / 2 / 3 * UZ_INNER3},
    {{1. / 6, 1. / 6, UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3},  {{2. / 3, 1. / 6, UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3},
    {{1. / 6, 2. / 3, UZ_GAUSS3}, 1. / 2 / 3 * UZ_OUTER3}};

/* With z along the line: corners L_a ((2 L_a - 1)(1 + z_a z) - (1 - z^2)) / 2, middles of the triangles' edges
 * 2 L_a L_b (1 + z_a z), those between the triangles L_a (1 - z^2). */
static void shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    double L[4];
    const double z = point[2], bubble = (1 - z) * (1 + z);
    uz_barycentric(L, 2, point);
    for (int a = 0; a < 6; a++) {
        const double l = L[CORNER[a]], side = LOCAL[a][2];
        if (N)
            N[a] = 0.5 * l * ((2 * l - 1) * (1 + side * z) - bubble);
        for (int i = 0; slope && i < 2; i++)
            slope[a][i] = 0.5 * uz_barycentric_slope(CORNER[a], i) * ((4 * l - 1) * (1 + side * z) - bubble);
        if (slope)
            slope[a][2] = 0.5 * l * ((2 * l - 1) * side + 2 * z);
    }
    for (int a = 6; a < 12; a++) {
        const int p = CORNER[EDGE[a - 6][0]], q = CORNER[EDGE[a - 6][1]];
        const double side = LOCAL[a][2];
        if (N)
            N[a] = 2 * L[p] * L[q] * (1 + side * z);
        for (int i = 0; slope && i < 2; i++)
            slope[a][i] = 2 * (uz_barycentric_slope(p, i) * L[q] + L[p] * uz_barycentric_slope(q, i)) * (1 + side * z);
        if (slope)
            slope[a][2] = 2 * L[p] * L[q] * side;
    }
    for (int a = 12; a < 15; a++) {
        const double l = L[CORNER[a - 12]];
        if (N)
            N[a] = l * bubble;
        for (int i = 0; slope && i < 2; i++)
            slope[a][i] = uz_barycentric_slope(CORNER[a - 12], i) * bubble;
        if (slope)
            slope[a][2] = -2 * z * l;
    }
}

/* What is linear over the triangle times what is linear along the line. */
static int recover(double point[UZ_ELEMENT_SAMPLES][3], double share[UZ_ELEMENT_NODES][UZ_ELEMENT_SAMPLES],
                   uz_element_kind kind)
{
    (void)kind;
    for (int k = 0; k < 6; k++) {
        memcpy(point[k], uz_gauss_triangle3[k % 3].at, sizeof point[k]);
        point[k][2] = k < 3 ? -UZ_GAUSS2 : UZ_GAUSS2;
    }
    for (int a = 0; a < 15; a++) {
        double L[4];
        uz_barycentric(L, 2, LOCAL[a]);
        for (int k = 0; k < 6; k++) /* barycentric coordinate k % 3 is 2/3 at the point, 1/6 at the others */
            share[a][k] = 2 * (L[k % 3] - 1.0 / 6) * (0.5 * (1 + 3 * point[k][2] * LOCAL[a][2]));
    }
    return 6;
}

const uz_element_type uz_type_wedge15 = {
    .name = "wedge15",
    .dim = 3,
    .nodes = 15,
    .corners = 6,
    .sides = 5,
    .side = {{6, 3, {0, 1, 2, 6, 7, 8}},
             {6, 3, {3, 5, 4, 11, 10, 9}},
             {8, 4, {0, 3, 4, 1, 12, 9, 13, 6}},
             {8, 4, {1, 4, 5, 2, 13, 10, 14, 7}},
             {8, 4, {2, 5, 3, 0, 14, 11, 12, 8}}},
    .edge = EDGE,
    .linear = UZ_WEDGE6,
    .local = LOCAL,
    .centre = {1.0 / 3, 1.0 / 3, 0},
    .shape = shape,
    .rule = {9, GAUSS},
    .recover = recover,
    .vtk = 26,
    .gmsh = 18,
    .gmsh_node = GMSH,
    .abaqus = {NULL, NULL, NULL, "C3D15"},
    .abaqus_node = ABAQUS,
};
