#include "element/reference.h"

#include <math.h>
#include <string.h>

/* Corners of the edge that each middle node of tri6 and tet10 lies on, in the order of the nodes. */
static const int MIDDLE[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

void uz_barycentric(double L[4], int dim, const double point[3])
{
    L[0] = 1;
    for (int i = 0; i < dim; i++) {
        L[i + 1] = point[i];
        L[0] -= point[i];
    }
}

double uz_barycentric_slope(int a, int i)
{
    return a == 0 ? -1 : a == i + 1;
}

void uz_simplex_shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3])
{
    double L[4];
    const int dim = type->dim, nodes = type->nodes, corners = type->corners;
    uz_barycentric(L, dim, point);
    for (int a = 0; a < corners; a++) {
        if (N)
            N[a] = nodes == corners ? L[a] : L[a] * (2 * L[a] - 1);
        for (int i = 0; slope && i < dim; i++)
            slope[a][i] = (nodes == corners ? 1 : 4 * L[a] - 1) * uz_barycentric_slope(a, i);
    }
    for (int m = corners; m < nodes; m++) {
        const int a = MIDDLE[m - corners][0], b = MIDDLE[m - corners][1];
        if (N)
            N[m] = 4 * L[a] * L[b];
        for (int i = 0; slope && i < dim; i++)
            slope[m][i] = 4 * (uz_barycentric_slope(a, i) * L[b] + L[a] * uz_barycentric_slope(b, i));
    }
}

/* ------------------------------------------------------------- Gauss rules */

/* Strang and Fix, "An Analysis of the Finite Element Method", section 4.3. */
const uz_gauss_point uz_gauss_triangle3[3] = {
    {{1. / 6, 1. / 6}, 1. / 2 / 3}, {{2. / 3, 1. / 6}, 1. / 2 / 3}, {{1. / 6, 2. / 3}, 1. / 2 / 3}};

/* G. Cowper, "Gaussian quadrature formulas for triangles", Int. J. Numer. Meth. Engng 7 (1973) 405-408: rings of three
 * at a = (8 - sqrt(10) +- sqrt(38 - 44 sqrt(0.4))) / 18 and 1 - 2 a, with (620 +- sqrt(213125 - 53320 sqrt(10))) / 3720
 * for a triangle of area 1. */
#define A 0.44594849091596483
#define B 0.10810301816807033
#define C 0.09157621350977073
#define D 0.8168475729804585
#define V 0.11169079483900572
#define W 0.054975871827660935
const uz_gauss_point uz_gauss_triangle6[6] = {{{A, A}, V}, {{B, A}, V}, {{A, B}, V},
                                              {{C, C}, W}, {{D, C}, W}, {{C, D}, W}};
#undef A
#undef B
#undef C
#undef D
#undef V
#undef W

/* ---------------------------------------------------------------- recovery */

int uz_recover_centre(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind)
{
    const uz_element_type *type = uz_element_type_of(kind);
    memcpy(point[0], type->centre, sizeof type->centre);
    for (int a = 0; a < type->nodes; a++)
        share[a][0] = 1;
    return 1;
}

/* dim + 1 points, each at barycentric coordinates (high, low, low[, low]): what is linear in them. */
int uz_recover_simplex(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const int dim = type->dim;
    const double low = dim == 2 ? 1.0 / 6 : (5 - sqrt(5)) / 20, high = 1 - dim * low;
    for (int k = 0; k <= dim; k++)
        for (int c = 0; c < dim; c++)
            point[k][c] = k == c + 1 ? high : low;
    for (int a = 0; a < type->nodes; a++) {
        double rest = 1;
        for (int c = 0; c < dim; c++) {
            rest -= type->local[a][c];
            share[a][c + 1] = (type->local[a][c] - low) / (high - low);
        }
        share[a][0] = (rest - low) / (high - low);
    }
    return dim + 1;
}

/* 2^dim Gauss points at +-1/sqrt(3): what is linear along each axis. */
int uz_recover_box(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind)
{
    const uz_element_type *type = uz_element_type_of(kind);
    const int dim = type->dim, points = 1 << dim;
    for (int k = 0; k < points; k++)
        for (int c = 0; c < dim; c++)
            point[k][c] = (k >> c & 1 ? 1 : -1) / sqrt(3);
    for (int a = 0; a < type->nodes; a++)
        for (int k = 0; k < points; k++) {
            double part = 1;
            for (int c = 0; c < dim; c++)
                part *= 0.5 * (1 + 3 * point[k][c] * type->local[a][c]);
            share[a][k] = part;
        }
    return points;
}
