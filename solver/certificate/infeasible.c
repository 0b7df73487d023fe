#include "certificate/infeasible.h"

#include "certificate/twofold.h"

#include <math.h>
#include <string.h>

/* h'y is positive beyond the rounding of its own sum. */
#define RAY_NOISE 1e-12

double uz_ray_radius(const double *y, const uz_csc *N, const double *h)
{
    twofold work = {0};
    double size = 0.0, residual = 0.0;
    for (int64_t i = 0; i < N->rows; i++) {
        if (!(y[i] <= 0.0))
            return 0.0;
        twofold_add_product(&work.hi, &work.lo, h[i], y[i], 0);
        size += fabs(h[i] * y[i]);
    }
    for (int64_t j = 0; j < N->cols; j++) {
        twofold sum = {0};
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            twofold_add_product(&sum.hi, &sum.lo, N->val[k], y[N->idx[k]], 0);
        residual += fabs(sum.hi + sum.lo);
    }
    double proven = work.hi + work.lo;
    if (!(proven > RAY_NOISE * size))
        return 0.0;
    return residual > 0.0 ? proven / residual : INFINITY;
}

double uz_gap_length(const uz_csc *N, const double *h, const double *g, double *row_room)
{
    double length = 0.0;
    memset(row_room, 0, (size_t)N->rows * sizeof *row_room);
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        row_room[N->idx[k]] = fmax(row_room[N->idx[k]], fabs(N->val[k]));
    for (int64_t i = 0; i < N->rows; i++)
        if (row_room[i] > 0.0)
            length = fmax(length, (fabs(h[i]) + fabs(g[i])) / row_room[i]);
    return length;
}
