/* side.c: integrals over one side of an element. */
#include "element/element.h"

#include <math.h>
#include <string.h>

#define PI     3.14159265358979323846
#define GAUSS2 0.57735026918962576451 /* 1 / sqrt(3) */
#define GAUSS3 0.77459666924148337704 /* sqrt(3 / 5) */

/* The triangle's rule of degree 5, seven points (Radon 1948): the centre with weight 9/40 and two rings of three at
 * (6 -+ sqrt(15)) / 21 with (155 -+ sqrt(15)) / 1200, weights of a triangle of area 1. */
#define RING_A   0.10128650732345633880
#define RING_B   0.47014206410511508977
#define WEIGHT_A 0.12593918054482715260
#define WEIGHT_B 0.13239415278850618074

static const double EDGE_NODES[3][2] = {{-1}, {1}, {0}};
static const double QUAD_NODES[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
static const double TRI_NODES[6][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};

const double (*uz_side_local_nodes(const uz_side *side))[2]
{
    return side->dim == 2 ? EDGE_NODES : side->nodes == 4 ? QUAD_NODES : TRI_NODES;
}

/* ---------------------------------------------------------- shape functions */

/* Values, and derivatives by the one reference coordinate. */
static void edge_shape(double *N, double slope[][2], int nodes, double s)
{
    N[0] = nodes == 2 ? 0.5 * (1 - s) : -0.5 * s * (1 - s);
    N[1] = nodes == 2 ? 0.5 * (1 + s) : 0.5 * s * (1 + s);
    slope[0][0] = nodes == 2 ? -0.5 : s - 0.5;
    slope[1][0] = nodes == 2 ? 0.5 : s + 0.5;
    if (nodes == 3) {
        N[2] = (1 - s) * (1 + s);
        slope[2][0] = -2 * s;
    }
}

static void quad_shape(double *N, double slope[][2], double s, double t)
{
    for (int a = 0; a < 4; a++) {
        const double p = QUAD_NODES[a][0], q = QUAD_NODES[a][1];
        N[a] = 0.25 * (1 + p * s) * (1 + q * t);
        slope[a][0] = 0.25 * p * (1 + q * t);
        slope[a][1] = 0.25 * q * (1 + p * s);
    }
}

static void triangle_shape(double *N, double slope[][2], int nodes, double s, double t)
{
    static const double along[3][2] = {{-1, -1}, {1, 0}, {0, 1}};
    const double L[3] = {1 - s - t, s, t};
    for (int a = 0; a < 3; a++) {
        N[a] = nodes == 3 ? L[a] : L[a] * (2 * L[a] - 1);
        for (int i = 0; i < 2; i++)
            slope[a][i] = (nodes == 3 ? 1 : 4 * L[a] - 1) * along[a][i];
    }
    for (int a = 0; a < 3 && nodes == 6; a++) {
        const int b = (a + 1) % 3;
        N[3 + a] = 4 * L[a] * L[b];
        for (int i = 0; i < 2; i++)
            slope[3 + a][i] = 4 * (along[a][i] * L[b] + L[a] * along[b][i]);
    }
}

static void shape(double *N, double slope[][2], const uz_side *side, const double point[2])
{
    if (side->dim == 2)
        edge_shape(N, slope, side->nodes, point[0]);
    else if (side->nodes == 4)
        quad_shape(N, slope, point[0], point[1]);
    else
        triangle_shape(N, slope, side->nodes, point[0], point[1]);
}

void uz_side_shape(double *N, const uz_side *side, const double point[2])
{
    double slope[UZ_SIDE_NODES][2];
    shape(N, slope, side, point);
}

/* ------------------------------------------------------------- Gauss rules */

int uz_side_gauss_count(const uz_side *side)
{
    return side->dim == 2 || side->nodes < 6 ? (side->nodes == 2 ? 2 : side->nodes == 4 ? 4 : 3) : 7;
}

static double edge_gauss(double point[2], int nodes, int g)
{
    point[0] = nodes == 2 ? (g == 0 ? -GAUSS2 : GAUSS2) : (g - 1) * GAUSS3;
    point[1] = 0;
    return nodes == 2 ? 1 : g == 1 ? 8. / 9 : 5. / 9;
}

/* Three points for tri3 (degree 2), seven for tri6. */
static double triangle_gauss(double point[2], int nodes, int g)
{
    const bool centre = nodes == 6 && g == 6, outer = nodes == 3 || g < 3;
    const double each = centre ? 1. / 3 : nodes == 3 ? 1. / 6 : outer ? RING_A : RING_B;
    point[0] = g % 3 == 1 && !centre ? 1 - 2 * each : each;
    point[1] = g % 3 == 2 && !centre ? 1 - 2 * each : each;
    return 0.5 * (centre ? 9. / 40 : nodes == 3 ? 1. / 3 : outer ? WEIGHT_A : WEIGHT_B);
}

double uz_side_gauss(double point[2], const uz_side *side, int g)
{
    if (side->dim == 2)
        return edge_gauss(point, side->nodes, g);
    if (side->nodes != 4)
        return triangle_gauss(point, side->nodes, g);
    for (int i = 0; i < 2; i++)
        point[i] = GAUSS2 * QUAD_NODES[g][i];
    return 1;
}

/* ------------------------------------------------------------------- areas */

/* Tangents along the reference coordinates, from differences to the first node. */
static void tangents(double T[2][3], const uz_side *side, double slope[][2])
{
    memset(T, 0, 6 * sizeof T[0][0]);
    for (int a = 1; a < side->nodes; a++)
        for (int i = 0; i < side->dim - 1; i++)
            for (int j = 0; j < side->dim; j++)
                T[i][j] += slope[a][i] * (side->xyz[a * side->dim + j] - side->xyz[j]);
}

/* Thickness, 2 pi r, or 1. */
static double depth(const uz_side *side, const double *N)
{
    double radius = 0;
    if (side->model == UZ_SOLID)
        return 1;
    if (side->model != UZ_AXISYMMETRIC)
        return side->thickness;
    for (int a = 0; a < side->nodes; a++)
        radius += N[a] * side->xyz[2 * a];
    return 2 * PI * radius;
}

/* The values of the shape functions come along. */
static void area_vector(double *area, double *N, const uz_side *side, const double point[2])
{
    double slope[UZ_SIDE_NODES][2], T[2][3];
    shape(N, slope, side, point);
    tangents(T, side, slope);
    const double *s = T[0], *t = T[1], times = depth(side, N);
    if (side->dim == 2) { /* the element on the left: outward is the tangent turned clockwise */
        area[0] = times * s[1];
        area[1] = -times * s[0];
        return;
    }
    for (int i = 0; i < 3; i++)
        area[i] = s[(i + 1) % 3] * t[(i + 2) % 3] - s[(i + 2) % 3] * t[(i + 1) % 3];
}

void uz_side_area_vector(double *area, const uz_side *side, const double point[2])
{
    double N[UZ_SIDE_NODES];
    area_vector(area, N, side, point);
}

/* One Gauss point: shape functions, the area vector and the area that the point stands for. */
typedef struct {
    double N[UZ_SIDE_NODES], vector[3], area;
} side_point;

static void side_point_at(side_point *at, const uz_side *side, int g)
{
    double point[2];
    const double weight = uz_side_gauss(point, side, g);
    area_vector(at->vector, at->N, side, point);
    for (int i = 0; i < side->dim; i++)
        at->vector[i] *= weight;
    at->area = hypot(at->vector[0], at->vector[1]);
    if (side->dim == 3)
        at->area = hypot(at->area, at->vector[2]);
}

/* --------------------------------------------------------------- integrals */

double uz_side_area(const uz_side *side)
{
    double area = 0;
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        side_point at;
        side_point_at(&at, side, g);
        area += at.area;
    }
    return area;
}

void uz_side_weights(double *w, const uz_side *side)
{
    memset(w, 0, (size_t)side->nodes * sizeof *w);
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        side_point at;
        side_point_at(&at, side, g);
        for (int a = 0; a < side->nodes; a++)
            w[a] += at.area * at.N[a];
    }
}

void uz_side_mass(double *M, const uz_side *side)
{
    const int n = side->nodes;
    memset(M, 0, (size_t)(n * n) * sizeof *M);
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        side_point at;
        side_point_at(&at, side, g);
        for (int a = 0; a < n; a++)
            for (int b = 0; b <= a; b++)
                M[n * a + b] += at.area * at.N[a] * at.N[b];
    }
    for (int a = 0; a < n; a++)
        for (int b = 0; b < a; b++)
            M[n * b + a] = M[n * a + b];
}

void uz_side_add_traction(double *f, const uz_side *side, const double *t)
{
    double w[UZ_SIDE_NODES];
    uz_side_weights(w, side);
    for (int a = 0; a < side->nodes; a++)
        for (int c = 0; c < side->dim; c++)
            f[a * side->dim + c] += w[a] * t[c];
}

void uz_side_add_nodal_traction(double *f, const uz_side *side, const double *t)
{
    double M[UZ_SIDE_NODES * UZ_SIDE_NODES];
    uz_side_mass(M, side);
    for (int a = 0; a < side->nodes; a++)
        for (int b = 0; b < side->nodes; b++)
            for (int c = 0; c < side->dim; c++)
                f[a * side->dim + c] += M[side->nodes * a + b] * t[b * side->dim + c];
}

void uz_side_add_pressure(double *f, const uz_side *side, const double *pressure)
{
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        side_point at;
        double here = 0;
        side_point_at(&at, side, g);
        for (int a = 0; a < side->nodes; a++)
            here += at.N[a] * pressure[a];
        for (int a = 0; a < side->nodes; a++)
            for (int c = 0; c < side->dim; c++)
                f[a * side->dim + c] -= here * at.N[a] * at.vector[c];
    }
}
