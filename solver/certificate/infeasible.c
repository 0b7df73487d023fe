#include "certificate/infeasible.h"

#include "certificate/one_sided.h"
#include "certificate/double_double.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* h'y is positive beyond what the rounding of each h_i may do to it. Its own sum is exact to far less. */
#define RAY_NOISE (8.0 * DBL_EPSILON)

/* The radius, and whether N'y is no more than the rounding of y in each dof. */
static double measure_ray(bool *rounded, const double *y, const uz_csc *N, const double *h)
{
    double_double work = {0};
    double size = 0.0, residual = 0.0;
    *rounded = true;
    if (!uz_is_ray_direction(y, N->rows))
        return 0.0;
    for (int64_t i = 0; i < N->rows; i++) {
        dd_add_product(&work.hi, &work.lo, h[i], y[i], 0);
        size += fabs(h[i] * y[i]);
    }
    for (int64_t j = 0; j < N->cols; j++) {
        double_double sum = {0};
        double terms = 0.0;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            dd_add_product(&sum.hi, &sum.lo, N->val[k], y[N->idx[k]], 0);
            terms += fabs(N->val[k] * y[N->idx[k]]);
        }
        residual += fabs(sum.hi + sum.lo);
        *rounded = *rounded && fabs(sum.hi + sum.lo) <= 4.0 * DBL_EPSILON * terms;
    }
    double proven = work.hi + work.lo;
    if (!(proven > RAY_NOISE * size))
        return 0.0;
    return residual > 0.0 ? proven / residual : INFINITY;
}

bool uz_ray_proves(double *radius, const double *y, const uz_csc *N, const double *h, double length)
{
    bool rounded;
    *radius = measure_ray(&rounded, y, N, h);
    return *radius > (rounded ? UZ_RAY_ROUNDED : UZ_RAY_FACTOR) * length;
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
