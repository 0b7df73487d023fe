/* point_lanes.h: an element's shape and gradients at all points of its rule, four points at a time, inlined into each
 * version: with the flags of its file and for its kind of processor. dim is a constant there, so that short loops
 * unroll. */
#ifndef UZ_FINITE_POINT_LANES_H
#define UZ_FINITE_POINT_LANES_H

#include "core/cpu.h"
#include "element/lane_shape.h"
#include "finite/finite_rule.h"

#include <math.h>

typedef double uz_four __attribute__((vector_size(8 * UZ_FINITE_LANES), aligned(8), may_alias));

/* Four numbers in a row. */
UZ_INLINE const uz_four *uz_four_from(const double *x)
{
    return (const uz_four *)x;
}

UZ_INLINE uz_four *uz_four_at(double *x)
{
    return (uz_four *)x;
}

/* Before anything moves: derivatives of local coordinates by places [local][x], what a Gauss point stands for, and of
 * rings 1 / r, which is 0 on the axis. */
typedef struct {
    double inverse[3][3][UZ_FINITE_POINTS], volume[UZ_FINITE_POINTS], per_radius[UZ_FINITE_POINTS];
} uz_rest;

/* H[c][j]: the derivative of u_c by x_j; of rings [2][2] is u_r / r, in the plane else the others with a 2 are 0. */
typedef double uz_gradients[3][3][UZ_FINITE_POINTS];

/* Of values (nodes x dim) what they are more than those of the first node: a translation leaves no rounding. */
UZ_INLINE void uz_from_first(double way[UZ_ELEMENT_DOFS], const uz_finite_rule *rule, const double *value, int dim)
{
    for (int a = 0; a < rule->nodes; a++)
        for (int c = 0; c < dim; c++)
            way[dim * a + c] = value[dim * a + c] - value[c];
}

/* D[c][i]: derivatives of these by local coordinates at four points from `first` on. */
UZ_INLINE void uz_differentiate(uz_four D[3][3], const uz_finite_rule *rule, const double *way, int first, int dim)
{
    for (int c = 0; c < dim; c++)
        for (int i = 0; i < dim; i++)
            D[c][i] = (uz_four){0};
    for (int a = 1; a < rule->nodes; a++)
        for (int i = 0; i < dim; i++) {
            const uz_four slope = *uz_four_from(&rule->at_points[a][i][first]);
            for (int c = 0; c < dim; c++)
                D[c][i] += slope * way[dim * a + c];
        }
}

/* Of rings: volumes by the way around, and 1 / r. */
UZ_INLINE void uz_find_radii(uz_rest *out, const uz_finite_rule *rule, const double *xyz)
{
    double largest = 0;
    for (int a = 0; a < rule->nodes; a++)
        largest = fmax(largest, fabs(xyz[2 * a]));
    for (int p = 0; p < rule->points; p++) {
        double radius = 0;
        for (int a = 0; a < rule->nodes; a++)
            radius += rule->at_nodes[p][3][a] * xyz[2 * a];
        out->per_radius[p] = radius > UZ_AXIS * largest ? 1 / radius : 0;
        out->volume[p] *= (2 * M_PI) * radius;
    }
}

UZ_INLINE void uz_rest_of(uz_rest *out, const uz_finite_rule *rule, const uz_element *element, int dim, bool ring)
{
    double way[UZ_ELEMENT_DOFS];
    uz_from_first(way, rule, element->xyz, dim);
    for (int p = 0; p < rule->points; p += UZ_FINITE_LANES) {
        uz_four X[3][3], inverse[3][3], det;
        uz_differentiate(X, rule, way, p, dim);
        uz_lane_invert(inverse, &det, X, dim);
        for (int i = 0; i < dim; i++)
            for (int j = 0; j < dim; j++)
                *uz_four_at(&out->inverse[i][j][p]) = inverse[j][i];
        const double thick = dim == 2 && !ring ? element->thickness : 1;
        *uz_four_at(&out->volume[p]) = *uz_four_from(&rule->weight[p]) * det * thick;
    }
    if (ring)
        uz_find_radii(out, rule, element->xyz);
}

UZ_INLINE void uz_find_gradients(uz_gradients H, const uz_finite_rule *rule, const uz_rest *at, const double *u,
                                 int dim, bool ring)
{
    double way[UZ_ELEMENT_DOFS];
    uz_from_first(way, rule, u, dim);
    for (int p = 0; p < rule->points; p += UZ_FINITE_LANES) {
        uz_four D[3][3];
        uz_differentiate(D, rule, way, p, dim);
        for (int c = 0; c < dim; c++)
            for (int j = 0; j < dim; j++) {
                uz_four sum = D[c][0] * *uz_four_from(&at->inverse[0][j][p]);
                for (int i = 1; i < dim; i++)
                    sum += D[c][i] * *uz_four_from(&at->inverse[i][j][p]);
                *uz_four_at(&H[c][j][p]) = sum;
            }
    }
    for (int p = 0; p < rule->points && ring; p++) {
        double moved = 0;
        for (int a = 0; a < rule->nodes; a++)
            moved += rule->at_nodes[p][3][a] * u[2 * a];
        if (p % UZ_FINITE_LANES == 0)
            *uz_four_at(&H[2][2][p]) = (uz_four){0};
        H[2][2][p] = at->per_radius[p] > 0 ? moved * at->per_radius[p] : H[0][0][p];
    }
}

/* force[axis][node] += what stresses do at four points from p on: P[axis][x] a volume, by local coordinates, times the
 * slopes of nodes by these; around: of rings P[theta] volume / r, along the radius. */
UZ_INLINE void uz_add_to_nodes(uz_four (*force)[UZ_ELEMENT_NODES / UZ_FINITE_LANES], uz_four P[3][3], uz_four volume,
                               uz_four around, const uz_finite_rule *rule, const uz_rest *at, int p, int dim, bool ring)
{
    const int wide = (rule->nodes + UZ_FINITE_LANES - 1) / UZ_FINITE_LANES;
    uz_four Q[3][3];
    for (int i = 0; i < dim; i++)
        for (int l = 0; l < dim; l++) {
            Q[i][l] = P[i][0] * *uz_four_from(&at->inverse[l][0][p]);
            for (int J = 1; J < dim; J++)
                Q[i][l] += P[i][J] * *uz_four_from(&at->inverse[l][J][p]);
            Q[i][l] *= volume;
        }
    for (int g = p; g < p + UZ_FINITE_LANES && g < rule->gauss; g++)
        for (int w = 0; w < wide; w++) {
            const int from = UZ_FINITE_LANES * w;
            for (int i = 0; i < dim; i++)
                for (int l = 0; l < dim; l++)
                    force[i][w] += Q[i][l][g - p] * *uz_four_from(&rule->at_nodes[g][l][from]);
            if (ring)
                force[0][w] += around[g - p] * *uz_four_from(&rule->at_nodes[g][3][from]);
        }
}

#endif
