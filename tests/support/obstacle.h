/* obstacle.h: a membrane over an obstacle, the five-point Laplacian on n x n dofs of the unit square with bounds from
 * below and above on each: m = 2 d.
 *
 * With n = 98 it is OBSTCLAE of the CUTE collection (Bongartz, Conn, Gould, Toint, ACM TOMS 21 (1995)) but for the
 * digits that its file rounds. Its objective counts every difference of two free neighbours twice and that of a free
 * dof and a fixed one once, at a quarter of the square each. */
#ifndef TESTS_OBSTACLE_H
#define TESTS_OBSTACLE_H

#include "uzawa.h"

#include <math.h>
#include <stdlib.h>

/* The solution of n = 98, from an independent program. */
#define OBSTACLE_98_OBJECTIVE 1.886461207837017
#define OBSTACLE_98_ACTIVE    4473

/* Lower triangle, d x d. */
static inline uz_status obstacle_stiffness(uz_csc *K, int64_t n, uz_error *err)
{
    int64_t d = n * n, count = 0, *row = calloc((size_t)(3 * d), sizeof *row),
            *col = calloc((size_t)(3 * d), sizeof *col);
    double *value = calloc((size_t)(3 * d), sizeof *value);
    if (!row || !col || !value)
        abort();
    for (int64_t k = 0; k < d; k++) {
        int64_t x = k % n, y = k / n, edges = (x == 0) + (x == n - 1) + (y == 0) + (y == n - 1);
        row[count] = col[count] = k;
        value[count++] = 4.0 - 0.5 * (double)edges;
        if (x + 1 < n) {
            row[count] = k + 1;
            col[count] = k;
            value[count++] = -1.0;
        }
        if (y + 1 < n) {
            row[count] = k + n;
            col[count] = k;
            value[count++] = -1.0;
        }
    }
    uz_status status = uz_csc_from_triplets(K, d, d, count, row, col, value, err);
    free(row);
    free(col);
    free(value);
    return status;
}

/* Rows 0..d-1: u <= 2000; rows d..2d-1: -u <= -obstacle. */
static inline uz_status obstacle_qp(uz_qp *qp, int64_t n, uz_error *err)
{
    int64_t d = n * n;
    double step = 1.0 / (double)(n + 1);
    *qp = (uz_qp){.p = calloc((size_t)d, sizeof(double)), .h = calloc((size_t)(2 * d), sizeof(double))};
    if (!qp->p || !qp->h)
        abort();
    uz_status status = obstacle_stiffness(&qp->K, n, err);
    if (status == UZ_OK)
        status = uz_csc_init(&qp->N, 2 * d, d, 2 * d, err);
    for (int64_t k = 0; status == UZ_OK && k < d; k++) {
        double x = step * (double)(k % n + 1), y = step * (double)(k / n + 1);
        qp->p[k] = step * step;
        qp->h[k] = 2000.0;
        qp->h[d + k] = -sin(3.2 * x) * sin(3.3 * y);
        qp->N.ptr[k + 1] = 2 * k + 2;
        qp->N.idx[2 * k] = (int32_t)k;
        qp->N.val[2 * k] = 1.0;
        qp->N.idx[2 * k + 1] = (int32_t)(d + k);
        qp->N.val[2 * k + 1] = -1.0;
    }
    return status;
}

#endif
