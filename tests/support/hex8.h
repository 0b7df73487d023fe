/* hex8.h: an elastic cube on a curved foundation: n x n x n bricks of eight nodes, E = 1, nu = 0.3, side 1.
 *
 * The faces x = 0 and x = 1 are held, the top is pressed down, and the bottom meets the foundation after small gaps:
 * d = 3 (n - 1)(n + 1)^2, m = (n - 1)(n + 1), one row for each free node of the bottom. Three dimensions are what
 * orderings are tested by: the factor grows as d^(4/3) and its flops as d^2 (George, SIAM J. Numer. Anal. 10 (1973)).
 */
#ifndef TESTS_HEX8_H
#define TESTS_HEX8_H

#include "core/alloc.h"
#include "uzawa.h"

#include <math.h>
#include <stdlib.h>

#define HEX8_POISSON  0.3
#define HEX8_PRESSURE 0.01

/* Corner a at (+-1, +-1, +-1): bits 0, 1, 2 of a are x, y, z. */
static inline double hex8_corner(int a, int axis)
{
    return (a >> axis) & 1 ? 1.0 : -1.0;
}

/* C of isotropic elasticity, E = 1, strains as xx, yy, zz, 2 yz, 2 zx, 2 xy. */
static inline double hex8_elasticity(int i, int j)
{
    double nu = HEX8_POISSON, lame = nu / ((1 + nu) * (1 - 2 * nu)), shear = 0.5 / (1 + nu);
    if (i < 3 && j < 3)
        return lame + (i == j ? 2 * shear : 0.0);
    return i == j ? shear : 0.0;
}

/* B (6 x 24) at a point of the reference cube, side h: strains from displacements, node by node. */
static inline void hex8_strains(double B[6][24], const double at[3], double h)
{
    for (int a = 0; a < 8; a++) {
        double grad[3];
        for (int axis = 0; axis < 3; axis++) {
            grad[axis] = 0.25 / h * hex8_corner(a, axis);
            for (int k = 0; k < 3; k++)
                grad[axis] *= k == axis ? 1.0 : 1.0 + hex8_corner(a, k) * at[k];
        }
        for (int axis = 0; axis < 3; axis++) {
            int next = (axis + 1) % 3, after = (axis + 2) % 3;
            for (int row = 0; row < 6; row++)
                B[row][3 * a + axis] = 0.0;
            B[axis][3 * a + axis] = grad[axis];
            B[3 + next][3 * a + axis] = grad[after]; /* shear 3 + k is between the two axes other than k */
            B[3 + after][3 * a + axis] = grad[next];
        }
    }
}

/* Stiffness of a brick of side h by 2 x 2 x 2 Gauss points, exact for it (Zienkiewicz and Taylor, vol. 1). */
static inline void hex8_element(double ke[24][24], double h)
{
    double B[6][24], CB[6][24];
    for (int i = 0; i < 24; i++)
        for (int j = 0; j < 24; j++)
            ke[i][j] = 0.0;
    for (int g = 0; g < 8; g++) {
        double at[3] = {hex8_corner(g, 0) / sqrt(3.0), hex8_corner(g, 1) / sqrt(3.0), hex8_corner(g, 2) / sqrt(3.0)};
        hex8_strains(B, at, h);
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 24; j++) {
                CB[i][j] = 0.0;
                for (int k = 0; k < 6; k++)
                    CB[i][j] += hex8_elasticity(i, k) * B[k][j];
            }
        for (int i = 0; i < 24; i++)
            for (int j = 0; j < 24; j++)
                for (int k = 0; k < 6; k++)
                    ke[i][j] += h * h * h / 8.0 * B[k][i] * CB[k][j];
    }
}

/* Node (x, y, z): its first dof, -1 where it is held. */
static inline int64_t hex8_dof(int64_t n, int64_t x, int64_t y, int64_t z)
{
    return x == 0 || x == n ? -1 : 3 * ((z * (n + 1) + y) * (n - 1) + x - 1);
}

typedef struct {
    int64_t count, *row, *col;
    double *value;
} hex8_triplets;

static inline void hex8_add_cell(hex8_triplets *t, double ke[24][24], int64_t n, int64_t x, int64_t y, int64_t z)
{
    int64_t dof[24];
    for (int i = 0; i < 24; i++) {
        int a = i / 3;
        int64_t first = hex8_dof(n, x + (a & 1), y + (a >> 1 & 1), z + (a >> 2 & 1));
        dof[i] = first < 0 ? -1 : first + i % 3;
    }
    for (int i = 0; i < 24; i++)
        for (int j = 0; j < 24; j++) {
            if (dof[j] < 0 || dof[i] < dof[j])
                continue;
            t->row[t->count] = dof[i];
            t->col[t->count] = dof[j];
            t->value[t->count++] = ke[i][j];
        }
}

/* Lower triangle. */
static inline uz_status hex8_stiffness(uz_csc *K, int64_t n, uz_error *err)
{
    int64_t most = 300 * n * n * n, d = 3 * (n - 1) * (n + 1) * (n + 1);
    hex8_triplets t = {0, calloc((size_t)most, sizeof(int64_t)), calloc((size_t)most, sizeof(int64_t)),
                       calloc((size_t)most, sizeof(double))};
    double ke[24][24];
    if (!t.row || !t.col || !t.value)
        abort();
    hex8_element(ke, 1.0 / (double)n);
    for (int64_t c = 0; c < n * n * n; c++)
        hex8_add_cell(&t, ke, n, c % n, c / n % n, c / (n * n));
    uz_status status = uz_csc_from_triplets(K, d, d, t.count, t.row, t.col, t.value, err);
    uz_free_all(t.row, t.col, t.value);
    return status;
}

/* The whole problem; the caller clears it. */
static inline uz_status hex8_qp(uz_qp *qp, int64_t n, uz_error *err)
{
    int64_t d = 3 * (n - 1) * (n + 1) * (n + 1), m = (n - 1) * (n + 1), *row = calloc((size_t)m, sizeof *row),
            *col = calloc((size_t)m, sizeof *col);
    double *value = calloc((size_t)m, sizeof *value), h = 1.0 / (double)n;
    *qp = (uz_qp){.p = calloc((size_t)d, sizeof(double)), .h = calloc((size_t)m, sizeof(double))};
    if (!row || !col || !value || !qp->p || !qp->h)
        abort();
    for (int64_t i = 0; i < m; i++) {
        int64_t x = i % (n - 1) + 1, y = i / (n - 1);
        double s = (double)x * h - 0.5, t = (double)y * h - 0.5;
        row[i] = i;
        col[i] = hex8_dof(n, x, y, 0) + 2;
        value[i] = -1.0; /* the outward normal of the bottom is -z */
        qp->h[i] = 1e-3 + 0.02 * (s * s + t * t);
        qp->p[hex8_dof(n, x, y, n) + 2] = -HEX8_PRESSURE * h * h * (y == 0 || y == n ? 0.5 : 1.0);
    }
    uz_status status = uz_csc_from_triplets(&qp->N, m, d, m, row, col, value, err);
    if (status == UZ_OK)
        status = hex8_stiffness(&qp->K, n, err);
    uz_free_all(row, col, value);
    return status;
}

/* The same rows with normals that lean in both directions: each touches three dofs. */
static inline uz_status hex8_lean(uz_qp *qp, uz_error *err)
{
    int64_t m = qp->N.rows, count = 0, *row = calloc((size_t)(3 * m), sizeof *row),
            *col = calloc((size_t)(3 * m), sizeof *col);
    double *value = calloc((size_t)(3 * m), sizeof *value);
    uz_csc N;
    if (!row || !col || !value)
        abort();
    for (int64_t j = 0; j < qp->N.cols; j++)
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            for (int64_t axis = 0; axis < 3; axis++, count++) {
                row[count] = qp->N.idx[k];
                col[count] = j - 2 + axis;
                value[count] = axis == 2 ? -0.9 : 0.3 * sin((double)(qp->N.idx[k] + axis));
            }
    uz_status status = uz_csc_from_triplets(&N, m, qp->K.cols, count, row, col, value, err);
    if (status == UZ_OK) {
        uz_csc_clear(&qp->N);
        qp->N = N;
    }
    uz_free_all(row, col, value);
    return status;
}

#endif
