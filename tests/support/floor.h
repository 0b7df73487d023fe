/* floor.h: a membrane or a plate over a floor, for what active sets cost: the five-point Laplacian on n x n dofs of a
 * square that is held at its edges, or its square, the thirteen-point biharmonic operator of a plate that is simply
 * supported. Each dof may sink to the floor at depth 1: N = -I, h = 1, m = d. */
#ifndef TESTS_FLOOR_H
#define TESTS_FLOOR_H

#include "uzawa.h"

#include <math.h>
#include <stdlib.h>

/* (L u)_k of the unit vector j, entry by entry: 4 on the diagonal, -1 for neighbours. */
static inline double floor_laplacian(int64_t n, int64_t k, int64_t j)
{
    int64_t dx = llabs(k % n - j % n), dy = llabs(k / n - j / n);
    return k == j ? 4.0 : dx + dy == 1 ? -1.0 : 0.0;
}

/* Lower triangle, d x d; plate: L L, where (L L)_kj sums over the dofs that neighbour both. */
static inline uz_status floor_stiffness(uz_csc *K, int64_t n, bool plate, uz_error *err)
{
    static const int64_t by[][2] = {{0, 0}, {1, 0}, {2, 0}, {-1, 1}, {0, 1}, {1, 1}, {0, 2}};
    int64_t d = n * n, nnz = 0;
    uz_status status = uz_csc_init(K, d, d, 7 * d, err);
    for (int64_t j = 0; status == UZ_OK && j < d; j++) {
        for (size_t s = 0; s < sizeof by / sizeof by[0]; s++) {
            int64_t x = j % n + by[s][0], y = j / n + by[s][1], k = x + y * n;
            double value = 0.0;
            if (x < 0 || x >= n || y >= n)
                continue;
            for (int64_t b = y - 1; plate && b <= y + 1; b++)
                for (int64_t a = x - 1; a <= x + 1; a++)
                    if (a >= 0 && a < n && b >= 0 && b < n)
                        value += floor_laplacian(n, k, a + b * n) * floor_laplacian(n, a + b * n, j);
            value = plate ? value : floor_laplacian(n, k, j);
            if (value != 0.0) {
                K->idx[nnz] = (int32_t)k;
                K->val[nnz++] = value;
            }
        }
        K->ptr[j + 1] = nnz;
    }
    return status;
}

/* Pressed down evenly, so hard that without the floor a membrane or plate of infinitely many dofs would sink to `sink`
 * times its depth in the middle; bumps: by that part more and less, in waves. */
static inline uz_status floor_qp(uz_qp *qp, int64_t n, bool plate, double sink, double bumps, uz_error *err)
{
    int64_t d = n * n;
    double step = 1.0 / (double)(n + 1), middle = plate ? 0.00406235 : 0.0736713;
    *qp = (uz_qp){.p = calloc((size_t)d, sizeof(double)), .h = calloc((size_t)d, sizeof(double))};
    if (!qp->p || !qp->h)
        abort();
    uz_status status = floor_stiffness(&qp->K, n, plate, err);
    if (status == UZ_OK)
        status = uz_csc_init(&qp->N, d, d, d, err);
    for (int64_t j = 0; status == UZ_OK && j < d; j++) {
        double x = (double)(j % n + 1) * step, y = (double)(j / n + 1) * step;
        qp->p[j] = -sink / middle * pow(step, plate ? 4.0 : 2.0) * (1.0 + bumps * sin(23.0 * x) * cos(17.0 * y));
        qp->h[j] = 1.0;
        qp->N.idx[j] = (int32_t)j;
        qp->N.val[j] = -1.0;
        qp->N.ptr[j + 1] = j + 1;
    }
    return status;
}

#endif
