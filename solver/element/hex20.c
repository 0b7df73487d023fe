/* hex20.c: the hexahedron of 20 nodes of the serendipity family.
 *
 * Shape functions: Zienkiewicz and Taylor, "The Finite Element Method", vol. 1, section on serendipity elements. Its
 * stiffness is integrated by 3 x 3 x 3 points: 2 x 2 x 2 leave six motions beside the rigid ones without stiffness
 * (CalculiX has that rule as C3D20R). */
#include "element/reference.h"

static const double LOCAL[20][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1},
                                    {1, -1, 1},   {1, 1, 1},   {-1, 1, 1}, {0, -1, -1}, {1, 0, -1},
                                    {0, 1, -1},   {-1, 0, -1}, {0, -1, 1}, {1, 0, 1},   {0, 1, 1},
                                    {-1, 0, 1},   {-1, -1, 0}, {1, -1, 0}, {1, 1, 0},   {-1, 1, 0}};
static const int EDGE[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
static const int GMSH[20] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15};

static const uz_gauss_point GAUSS[27] = {{{-UZ_GAUSS3, -UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{0, -UZ_GAUSS3, -UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, -UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{-UZ_GAUSS3, 0, -UZ_GAUSS3}, UZ_OUTER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{0, 0, -UZ_GAUSS3}, UZ_INNER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, 0, -UZ_GAUSS3}, UZ_OUTER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{-UZ_GAUSS3, UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{0, UZ_GAUSS3, -UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, UZ_GAUSS3, -UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{-UZ_GAUSS3, -UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{0, -UZ_GAUSS3, 0}, UZ_INNER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{UZ_GAUSS3, -UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{-UZ_GAUSS3, 0, 0}, UZ_OUTER3 *UZ_INNER3 *UZ_INNER3},
                                         {{0, 0, 0}, UZ_INNER3 *UZ_INNER3 *UZ_INNER3},
                                         {{UZ_GAUSS3, 0, 0}, UZ_OUTER3 *UZ_INNER3 *UZ_INNER3},
                                         {{-UZ_GAUSS3, UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{0, UZ_GAUSS3, 0}, UZ_INNER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{UZ_GAUSS3, UZ_GAUSS3, 0}, UZ_OUTER3 *UZ_OUTER3 *UZ_INNER3},
                                         {{-UZ_GAUSS3, -UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{0, -UZ_GAUSS3, UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, -UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{-UZ_GAUSS3, 0, UZ_GAUSS3}, UZ_OUTER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{0, 0, UZ_GAUSS3}, UZ_INNER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, 0, UZ_GAUSS3}, UZ_OUTER3 *UZ_INNER3 *UZ_OUTER3},
                                         {{-UZ_GAUSS3, UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{0, UZ_GAUSS3, UZ_GAUSS3}, UZ_INNER3 *UZ_OUTER3 *UZ_OUTER3},
                                         {{UZ_GAUSS3, UZ_GAUSS3, UZ_GAUSS3}, UZ_OUTER3 *UZ_OUTER3 *UZ_OUTER3}};

/* Corners: product of (1 + p_i x_i) / 8 times (sum of p_i x_i - 2); middles: (1 - x_k^2) / 4 times that of the other
 * two axes, k being the one along which p_k = 0. */
static void shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    (void)type;
    for (int a = 0; a < 20; a++) {
        double factor[3], product = a < 8 ? 0.125 : 0.25, sum = -2;
        for (int i = 0; i < 3; i++) {
            const double p = LOCAL[a][i], x = point[i];
            factor[i] = p == 0 ? (1 - x) * (1 + x) : 1 + p * x;
            product *= factor[i];
            sum += p * x;
        }
        if (N)
            N[a] = a < 8 ? product * sum : product;
        for (int i = 0; slope && i < 3; i++) {
            const double p = LOCAL[a][i], others = factor[(i + 1) % 3] * factor[(i + 2) % 3];
            slope[a][i] = a < 8 ? 0.125 * p * others * (sum + factor[i]) : 0.25 * others * (p == 0 ? -2 * point[i] : p);
        }
    }
}

const uz_element_type uz_type_hex20 = {
    .name = "hex20",
    .dim = 3,
    .nodes = 20,
    .corners = 8,
    .sides = 6,
    .side = {{8, 4, {0, 4, 7, 3, 16, 15, 19, 11}},
             {8, 4, {1, 2, 6, 5, 9, 18, 13, 17}},
             {8, 4, {0, 1, 5, 4, 8, 17, 12, 16}},
             {8, 4, {3, 7, 6, 2, 19, 14, 18, 10}},
             {8, 4, {0, 3, 2, 1, 11, 10, 9, 8}},
             {8, 4, {4, 5, 6, 7, 12, 13, 14, 15}}},
    .edge = EDGE,
    .linear = UZ_HEX8,
    .local = LOCAL,
    .shape = shape,
    .rule = {27, GAUSS},
    .recover = uz_recover_box,
    .vtk = 25,
    .gmsh = 17,
    .gmsh_node = GMSH,
    .abaqus = {NULL, NULL, NULL, "C3D20"},
};
