/* vector3.h: vectors in space, and in the plane. */
#ifndef UZ_CORE_VECTOR3_H
#define UZ_CORE_VECTOR3_H

#include <math.h>

/* In the plane. */
static inline double uz_dot2(const double a[2], const double b[2])
{
    return a[0] * b[0] + a[1] * b[1];
}

static inline double uz_cross2(const double a[2], const double b[2])
{
    return a[0] * b[1] - a[1] * b[0];
}

static inline double uz_dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void uz_cross3(double out[3], const double a[3], const double b[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

/* v becomes a unit vector, unless it is zero; returns the length that it had. */
static inline double uz_unit3(double v[3])
{
    const double length = sqrt(uz_dot3(v, v));
    for (int c = 0; c < 3 && length > 0; c++)
        v[c] /= length;
    return length;
}

/* The squared distance of two points of dim coordinates. */
static inline double uz_distance2(const double *x, const double *y, int dim)
{
    double sum = 0;
    for (int c = 0; c < dim; c++)
        sum += (x[c] - y[c]) * (x[c] - y[c]);
    return sum;
}

#endif
