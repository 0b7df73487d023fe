/* walk.c: sums over triangles and sides, of rings with the radius below the line.
 *
 * A triangle is cut along its middle corner's radius. At each radius the integral along the chord is a polynomial g(r),
 * of degree 5 for what is asked here, along sides 6, and g(r) / r has one pole, r = 0, at which g vanishes where the
 * axis is touched. On [a, b] Gauss's rule of n points is off by g(0) times what it is for 1 / r, about 2 pi q^(2n + 1)
 * with q = 1 / (z + sqrt(z^2 - 1)), z = (b + a) / (b - a). |g(0)| is at most q^-6 / 2 times the largest g between, by
 * Chebyshev's polynomial, and that at most 16 / (b - a) times the integral of a g >= 0, by Legendre's: together less
 * than 20 q^(2n - 6) of the integral of g / r. Pieces end where the radius is twice that of their beginning. */
#include "bound/walk.h"

#include <float.h>
#include <math.h>
#include <string.h>

static void begin_piece(uz_line_walk *walk, double from)
{
    const double *r = walk->radius, across = r[1] - r[0], a = r[0] + from * across;
    walk->from = from;
    walk->to = 1;
    walk->n = 4;
    walk->i = 0;
    if (across > a && a > 0) /* to twice the radius */
        walk->to = fmin(1, 2 * from + r[0] / across);
    const double b = r[0] + walk->to * across, z = (b + a) / fmax(b - a, DBL_MIN), q = 1 / (z + sqrt(z * z - 1));
    walk->n = a > 0 ? (int)fmin(UZ_WALK_POINTS, uz_gauss_points(walk->n, 20, q, UZ_WALK_MARGIN)) : walk->n;
    uz_gauss(walk->at, walk->weight, walk->n);
}

uz_line_walk uz_line_begin(double radius, double to_radius)
{
    uz_line_walk walk = {.radius = {fmin(radius, to_radius), fmax(radius, to_radius)}};
    walk.turned = to_radius < radius;
    begin_piece(&walk, 0);
    return walk;
}

bool uz_line_next(uz_line_walk *walk, double *part, double *weight)
{
    if (walk->i == walk->n) {
        if (walk->to >= 1)
            return false;
        begin_piece(walk, walk->to);
    }
    const double half = (walk->to - walk->from) / 2, at = walk->from + half * (1 + walk->at[walk->i]);
    *part = walk->turned ? 1 - at : at;
    *weight = half * walk->weight[walk->i++];
    return true;
}

static void sort(double corner[3][2])
{
    for (int k = 0; k < 3; k++) {
        const int i = k % 2; /* 01, 12, 01 */
        double held[2];
        if (corner[i][0] > corner[i + 1][0]) {
            memcpy(held, corner[i], sizeof held);
            memcpy(corner[i], corner[i + 1], sizeof held);
            memcpy(corner[i + 1], held, sizeof held);
        }
    }
}

uz_walk uz_walk_begin(double corner[3][2], bool rings, int degree)
{
    const uz_element_type *triangle = uz_element_type_of(UZ_TRI6);
    uz_walk walk = {.rule = degree == 1 ? triangle->rule : triangle->energy, /* of degree 2 and 4 */
                    .rings = rings};
    memcpy(walk.corner, corner, sizeof walk.corner);
    if (!rings)
        return walk;
    sort(walk.corner);
    walk.half = -1;
    walk.i = walk.along = degree + 1;
    walk.line.to = 1;
    uz_gauss(walk.at, walk.share, walk.along);
    return walk;
}

/* The next radius, and the chord there; false: there is none. */
static bool next_chord(uz_walk *walk)
{
    const double(*p)[2] = walk->corner;
    double part, weight;
    while (!uz_line_next(&walk->line, &part, &weight)) {
        if (++walk->half == 2)
            return false;
        walk->line = (uz_line_walk){.to = 1};
        if (p[walk->half + 1][0] > p[walk->half][0])
            walk->line = uz_line_begin(p[walk->half][0], p[walk->half + 1][0]);
    }
    const double *from = p[walk->half], *to = p[walk->half + 1], across = to[0] - from[0];
    walk->radius = from[0] + part * across;
    walk->low = from[1] + part * (to[1] - from[1]);
    walk->high = p[0][1] + (walk->radius - p[0][0]) / (p[2][0] - p[0][0]) * (p[2][1] - p[0][1]);
    walk->weight = weight * across * fabs(walk->high - walk->low) / 2;
    walk->i = 0;
    return true;
}

bool uz_walk_next(uz_walk *walk, double at[2], double *weight)
{
    const double(*p)[2] = walk->corner;
    if (!walk->rings) {
        if (walk->i == walk->rule.count)
            return false;
        const double *point = walk->rule.point[walk->i].at;
        const double area2 = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
        for (int c = 0; c < 2; c++)
            at[c] = p[0][c] + point[0] * (p[1][c] - p[0][c]) + point[1] * (p[2][c] - p[0][c]);
        *weight = walk->rule.point[walk->i++].weight * area2;
        return true;
    }
    if (walk->i == walk->along && !next_chord(walk))
        return false;
    at[0] = walk->radius;
    at[1] = (walk->low + walk->high) / 2 + walk->at[walk->i] * (walk->high - walk->low) / 2;
    *weight = walk->weight * walk->share[walk->i++];
    return true;
}
