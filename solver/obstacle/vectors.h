/* vectors.h: vectors in space for the patches of obstacles, and the frame of a patch. */
#ifndef UZ_OBSTACLE_VECTORS_H
#define UZ_OBSTACLE_VECTORS_H

#include "core/vector3.h"
#include "obstacle/shape.h"

#include <math.h>

static inline void uz_add3(double out[3], double times, const double x[3])
{
    for (int c = 0; c < 3; c++)
        out[c] += times * x[c];
}

/* Length 1; what has none becomes `otherwise`. */
static inline void uz_make_unit3(double x[3], const double otherwise[3])
{
    const double length = hypot(hypot(x[0], x[1]), x[2]);
    for (int c = 0; c < 3; c++)
        x[c] = length > 0 ? x[c] / length : otherwise[c];
}

/* a across n, b across both. */
static inline void uz_patch_frame(uz_obstacle_patch *p)
{
    const double start[2][3] = {{0, 1, 0}, {1, 0, 0}};
    uz_cross3(p->a, start[fabs(p->n[1]) < 0.9 ? 0 : 1], p->n);
    uz_make_unit3(p->a, start[1]);
    uz_cross3(p->b, p->n, p->a);
}

#endif
