/* shape.c: shape functions on the reference elements, and their Gauss rules. */
#include "element/element_private.h"

#include "element/element_kind.h"

#include <string.h>

static const double LOCAL[UZ_ELEMENT_KINDS][UZ_ELEMENT_NODES][3] = {
    [UZ_TRI3] = {{0, 0}, {1, 0}, {0, 1}},
    [UZ_QUAD4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}},
    [UZ_TRI6] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}},
    [UZ_QUAD8] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}},
    [UZ_TET4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
    [UZ_HEX8] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}},
    [UZ_TET10] = {{0, 0, 0},
                  {1, 0, 0},
                  {0, 1, 0},
                  {0, 0, 1},
                  {0.5, 0, 0},
                  {0.5, 0.5, 0},
                  {0, 0.5, 0},
                  {0, 0, 0.5},
                  {0.5, 0, 0.5},
                  {0, 0.5, 0.5}},
};

const double (*uz_element_local_nodes(uz_element_kind kind))[3]
{
    return LOCAL[kind];
}

/* Corners of the edge that each middle node of tri6 and tet10 lies on, in the order of the nodes. */
static const int MIDDLE[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

static void barycentric(double L[4], int dim, const double point[3])
{
    L[0] = 1;
    for (int i = 0; i < dim; i++) {
        L[i + 1] = point[i];
        L[0] -= point[i];
    }
}

/* tri3, tet4: L_a. tri6, tet10: L_a (2 L_a - 1) at corners, 4 L_a L_b on edges. */
static void simplex_shape(double *N, int dim, int nodes, const double point[3])
{
    double L[4];
    const int corners = dim + 1;
    barycentric(L, dim, point);
    for (int a = 0; a < corners; a++)
        N[a] = nodes == corners ? L[a] : L[a] * (2 * L[a] - 1);
    for (int a = corners; a < nodes; a++)
        N[a] = 4 * L[MIDDLE[a - corners][0]] * L[MIDDLE[a - corners][1]];
}

/* The derivative of L_a along axis i. */
static double slope(int a, int i)
{
    return a == 0 ? -1 : a == i + 1;
}

static void simplex_gradients(double local[][3], int dim, int nodes, const double point[3])
{
    double L[4];
    const int corners = dim + 1;
    barycentric(L, dim, point);
    for (int a = 0; a < corners; a++)
        for (int i = 0; i < dim; i++)
            local[a][i] = (nodes == corners ? 1 : 4 * L[a] - 1) * slope(a, i);
    for (int m = corners; m < nodes; m++) {
        const int a = MIDDLE[m - corners][0], b = MIDDLE[m - corners][1];
        for (int i = 0; i < dim; i++)
            local[m][i] = 4 * (slope(a, i) * L[b] + L[a] * slope(b, i));
    }
}

/* quad4: products of (1 +- x) / 2. */
static void quad4_gradients(double local[][3], const double point[3])
{
    const double x = point[0], y = point[1];
    for (int a = 0; a < 4; a++) {
        const double *at = LOCAL[UZ_QUAD4][a];
        local[a][0] = 0.25 * at[0] * (1 + at[1] * y);
        local[a][1] = 0.25 * at[1] * (1 + at[0] * x);
    }
}

static void hex8_gradients(double local[][3], const double point[3])
{
    for (int a = 0; a < 8; a++) {
        const double *at = LOCAL[UZ_HEX8][a];
        const double x = 1 + at[0] * point[0], y = 1 + at[1] * point[1], z = 1 + at[2] * point[2];
        local[a][0] = 0.125 * at[0] * y * z;
        local[a][1] = 0.125 * at[1] * x * z;
        local[a][2] = 0.125 * at[2] * x * y;
    }
}

/* The eight-node serendipity quadrilateral. */
static double quad8_shape(const double at[3], double x, double y)
{
    if (at[0] == 0)
        return 0.5 * (1 - x * x) * (1 + at[1] * y);
    if (at[1] == 0)
        return 0.5 * (1 - y * y) * (1 + at[0] * x);
    return 0.25 * (1 + at[0] * x) * (1 + at[1] * y) * (at[0] * x + at[1] * y - 1);
}

static void quad8_gradients(double local[][3], const double point[3])
{
    const double x = point[0], y = point[1];
    for (int a = 0; a < 8; a++) {
        const double p = LOCAL[UZ_QUAD8][a][0], q = LOCAL[UZ_QUAD8][a][1];
        if (p == 0) {
            local[a][0] = -x * (1 + q * y);
            local[a][1] = 0.5 * q * (1 - x * x);
        } else if (q == 0) {
            local[a][0] = 0.5 * p * (1 - y * y);
            local[a][1] = -y * (1 + p * x);
        } else {
            local[a][0] = 0.25 * p * (1 + q * y) * (2 * p * x + q * y);
            local[a][1] = 0.25 * q * (1 + p * x) * (2 * q * y + p * x);
        }
    }
}

void uz_element_shape(double *N, uz_element_kind kind, const double point[3])
{
    const int nodes = uz_element_node_count(kind);
    if (kind == UZ_HEX8 || kind == UZ_QUAD4) {
        const int dim = uz_element_dim(kind);
        for (int a = 0; a < nodes; a++) {
            N[a] = 1;
            for (int i = 0; i < dim; i++)
                N[a] *= 0.5 * (1 + LOCAL[kind][a][i] * point[i]);
        }
    } else if (kind == UZ_QUAD8) {
        for (int a = 0; a < nodes; a++)
            N[a] = quad8_shape(LOCAL[kind][a], point[0], point[1]);
    } else {
        simplex_shape(N, uz_element_dim(kind), nodes, point);
    }
}

void uz_local_gradients(double local[UZ_ELEMENT_NODES][3], uz_element_kind kind, const double point[3])
{
    if (kind == UZ_HEX8)
        hex8_gradients(local, point);
    else if (kind == UZ_QUAD4)
        quad4_gradients(local, point);
    else if (kind == UZ_QUAD8)
        quad8_gradients(local, point);
    else
        simplex_gradients(local, uz_element_dim(kind), uz_element_node_count(kind), point);
}

/* ------------------------------------------------------------- Gauss rules */

#define GAUSS2 0.57735026918962576451 /* 1 / sqrt(3): two points, weights 1 */
#define GAUSS3 0.77459666924148337704 /* sqrt(3 / 5): three points, weights 5/9, 8/9, 5/9 */
#define TET_A  0.13819660112501051518 /* (5 - sqrt(5)) / 20 */
#define TET_B  0.58541019662496845446 /* (5 + 3 sqrt(5)) / 20 */

/* Interior rules of degree 1 and 2 on simplices: Strang and Fix, "An Analysis of the Finite Element Method", section
 * 4.3; Keast, Comput. Methods Appl. Mech. Engrg 55 (1986). */
static const double TRI_RULE[3][3] = {{1. / 6, 1. / 6}, {2. / 3, 1. / 6}, {1. / 6, 2. / 3}};
static const double TET_RULE[4][3] = {
    {TET_A, TET_A, TET_A}, {TET_B, TET_A, TET_A}, {TET_A, TET_B, TET_A}, {TET_A, TET_A, TET_B}};

int uz_element_gauss_count(uz_element_kind kind, uz_model model)
{
    static const int COUNT[UZ_ELEMENT_KINDS] = {
        [UZ_TRI3] = 1, [UZ_QUAD4] = 4, [UZ_TRI6] = 3, [UZ_QUAD8] = 9, [UZ_TET4] = 1, [UZ_HEX8] = 8, [UZ_TET10] = 4};
    return kind == UZ_TRI3 && model == UZ_AXISYMMETRIC ? 3 : COUNT[kind];
}

static double three_by_three(double point[3], int g)
{
    static const double AT[3] = {-GAUSS3, 0, GAUSS3}, WEIGHT[3] = {5. / 9, 8. / 9, 5. / 9};
    point[0] = AT[g % 3];
    point[1] = AT[g / 3];
    return WEIGHT[g % 3] * WEIGHT[g / 3];
}

/* The one point of degree 1, or the dim + 1 of degree 2, all of one weight; the simplex has volume 1 / dim!. */
static double simplex_gauss(double point[3], int dim, int count, int g)
{
    if (count == 1)
        point[0] = point[1] = point[2] = 1. / (dim + 1);
    else
        memcpy(point, dim == 2 ? TRI_RULE[g] : TET_RULE[g], 3 * sizeof *point);
    return (dim == 2 ? 1. / 2 : 1. / 6) / count;
}

double uz_element_gauss(double point[3], uz_element_kind kind, uz_model model, int g)
{
    point[2] = 0;
    if (kind == UZ_QUAD8)
        return three_by_three(point, g);
    if (kind == UZ_QUAD4 || kind == UZ_HEX8) {
        for (int i = 0; i < 3; i++)
            point[i] = GAUSS2 * LOCAL[kind][g][i];
        return 1;
    }
    return simplex_gauss(point, uz_element_dim(kind), uz_element_gauss_count(kind, model), g);
}
