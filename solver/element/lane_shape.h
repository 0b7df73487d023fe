/* lane_shape.h: what versions in lanes have in common of an element's shape, inlined into each: with the flags of its
 * file and for its kind of processor. dim is a constant there, so that short loops unroll. */
#ifndef UZ_ELEMENT_LANE_SHAPE_H
#define UZ_ELEMENT_LANE_SHAPE_H

#include "core/cpu.h"
#include "element/strain_lanes.h"

/* D[c][i]: derivative of component c by local axis i, of values (nodes x dim) against those of the first node: slopes
 * of all nodes sum to 0. */
UZ_INLINE void uz_lane_differentiate(uz_lanes D[3][3], const double slope[][3], const uz_lanes *value, int nodes,
                                     int dim)
{
    uz_lanes sum[3][3] = {{{0}}};
    for (int a = 1; a < nodes; a++)
        for (int c = 0; c < dim; c++) {
            const uz_lanes from_first = value[a * dim + c] - value[c];
            for (int i = 0; i < dim; i++)
                sum[c][i] += slope[a][i] * from_first;
        }
    for (int c = 0; c < dim; c++)
        for (int i = 0; i < dim; i++)
            D[c][i] = sum[c][i];
}

UZ_INLINE void uz_lane_determinant(uz_lanes *det, uz_lanes A[3][3], int dim)
{
    if (dim == 2)
        *det = A[0][0] * A[1][1] - A[0][1] * A[1][0];
    else
        *det = A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) + A[0][1] * (A[1][2] * A[2][0] - A[1][0] * A[2][2]) +
               A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0]);
}

/* inverse[j][i] of A[i][j], transposed: out[i][j]. */
UZ_INLINE void uz_lane_invert(uz_lanes out[3][3], uz_lanes *det, uz_lanes A[3][3], int dim)
{
    uz_lane_determinant(det, A, dim);
    const uz_lanes scale = 1 / *det;
    if (dim == 2) {
        out[0][0] = A[1][1] * scale;
        out[0][1] = -A[1][0] * scale;
        out[1][0] = -A[0][1] * scale;
        out[1][1] = A[0][0] * scale;
        return;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int p = (i + 1) % 3, q = (i + 2) % 3, s = (j + 1) % 3, t = (j + 2) % 3;
            out[i][j] = (A[p][s] * A[q][t] - A[p][t] * A[q][s]) * scale;
        }
}

#endif
