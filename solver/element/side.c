/* side.c: integrals over one side of an element. */
#include "element/element.h"
#include "element/reference.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

/* The triangle's rule of degree 5, seven points (Radon 1948): the centre with weight 9/40 and two rings of three at
 * (6 -+ sqrt(15)) / 21 with (155 -+ sqrt(15)) / 1200, weights of a triangle of area 1. */
#define RING_A   0.10128650732345633880
#define RING_B   0.47014206410511508977
#define WEIGHT_A 0.12593918054482715260
#define WEIGHT_B 0.13239415278850618074

const uz_element_type *uz_face_type(int nodes)
{
    return uz_element_type_of(nodes == 3 ? UZ_TRI3 : nodes == 4 ? UZ_QUAD4 : nodes == 6 ? UZ_TRI6 : UZ_QUAD8);
}

const double (*uz_side_local_nodes(const uz_side *side))[3]
{
    static const double EDGE[3][3] = {{-1}, {1}, {0}};
    return side->dim == 2 ? EDGE : uz_face_type(side->nodes)->local;
}

/* ---------------------------------------------------------- shape functions */

void uz_side_gradients(double *N, double slope[][3], const uz_side *side, const double point[2])
{
    const double s = point[0];
    if (side->dim == 3) {
        const double at[3] = {point[0], point[1]};
        const uz_element_type *type = uz_face_type(side->nodes);
        type->shape(type, N, slope, at);
    } else if (side->nodes == 2) {
        N[0] = 0.5 * (1 - s);
        N[1] = 0.5 * (1 + s);
        slope[0][0] = -0.5;
        slope[1][0] = 0.5;
    } else {
        N[0] = -0.5 * s * (1 - s);
        N[1] = 0.5 * s * (1 + s);
        N[2] = (1 - s) * (1 + s);
        slope[0][0] = s - 0.5;
        slope[1][0] = s + 0.5;
        slope[2][0] = -2 * s;
    }
}

void uz_side_shape(double *N, const uz_side *side, const double point[2])
{
    double slope[UZ_SIDE_NODES][3];
    uz_side_gradients(N, slope, side, point);
}

/* ------------------------------------------------------------- Gauss rules */

int uz_side_gauss_count(const uz_side *side)
{
    if (side->dim == 2)
        return side->nodes;
    return side->nodes == 3 ? 3 : side->nodes == 6 ? 7 : uz_face_type(side->nodes)->rule.count;
}

double uz_side_gauss(double point[2], const uz_side *side, int g)
{
    if (side->dim == 2) {
        point[0] = side->nodes == 2 ? (g == 0 ? -UZ_GAUSS2 : UZ_GAUSS2) : (g - 1) * UZ_GAUSS3;
        point[1] = 0;
        return side->nodes == 2 ? 1 : g == 1 ? 8. / 9 : 5. / 9;
    }
    if (side->nodes % 3 == 0) {
        /* Three points for tri3 (degree 2), seven for tri6. */
        const int nodes = side->nodes;
        const bool centre = nodes == 6 && g == 6, outer = nodes == 3 || g < 3;
        const double each = centre ? 1. / 3 : nodes == 3 ? 1. / 6 : outer ? RING_A : RING_B;
        point[0] = g % 3 == 1 && !centre ? 1 - 2 * each : each;
        point[1] = g % 3 == 2 && !centre ? 1 - 2 * each : each;
        return 0.5 * (centre ? 9. / 40 : nodes == 3 ? 1. / 3 : outer ? WEIGHT_A : WEIGHT_B);
    }
    const uz_gauss_point *inside = &uz_face_type(side->nodes)->rule.point[g];
    memcpy(point, inside->at, 2 * sizeof *point);
    return inside->weight;
}

/* ------------------------------------------------------------------- areas */

/* The values of the shape functions come along. */
static void area_vector(double *area, double *N, const uz_side *side, const double point[2])
{
    double slope[UZ_SIDE_NODES][3], T[2][3];
    uz_side_gradients(N, slope, side, point);
    /* Tangents along the reference coordinates, from differences to the first node. */
    memset(T, 0, 6 * sizeof T[0][0]);
    for (int a = 1; a < side->nodes; a++)
        for (int i = 0; i < side->dim - 1; i++)
            for (int j = 0; j < side->dim; j++)
                T[i][j] += slope[a][i] * (side->xyz[a * side->dim + j] - side->xyz[j]);
    const double *s = T[0], *t = T[1];
    if (side->dim == 2) { /* the element on the left: outward is the tangent turned clockwise */
        double radius = 0;
        for (int a = 0; a < side->nodes; a++)
            radius += N[a] * side->xyz[2 * a];
        const double depth = side->model == UZ_AXISYMMETRIC ? 2 * PI * radius : side->thickness;
        area[0] = depth * s[1];
        area[1] = -depth * s[0];
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

void uz_side_positive_weights(double *w, const uz_side *side)
{
    uz_side_weights(w, side);
    for (int j = 0; j < 4 && side->nodes == 8; j++) {
        const double share = UZ_MIDDLE_SHARE * w[4 + j];
        w[j] += share;
        w[(j + 1) % 4] += share;
        w[4 + j] -= 2 * share;
    }
}

void uz_side_add_traction(double *f, const uz_side *side, const double *t)
{
    double w[UZ_SIDE_NODES];
    uz_side_weights(w, side);
    for (int a = 0; a < side->nodes; a++)
        for (int c = 0; c < side->dim; c++)
            f[a * side->dim + c] += w[a] * t[c];
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
