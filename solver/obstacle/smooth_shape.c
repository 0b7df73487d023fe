/* smooth_shape.c: spheres, cylinders and cones through the nodes of a surface. */
#include "obstacle/smooth_shape.h"

#include "core/vector3.h"

#include <math.h>
#include <string.h>

/* Points are on a shape when they are no farther from it than this part of its radius. */
#define ON_SHAPE 1e-6

/* A radius of more than so many times the size of the surface is a plane. */
#define FLAT 1e4

enum { MOST_PARAMETERS = 6 };

/* ---- distances */

/* Along and across the axis; radial: unit, away from it. */
static void about_axis(double *along, double *across, double radial[3], const uz_smooth_shape *s, const double x[3])
{
    for (int c = 0; c < 3; c++)
        radial[c] = x[c] - s->point[c];
    *along = uz_dot3(radial, s->axis);
    for (int c = 0; c < 3 && s->kind != UZ_SMOOTH_SPHERE; c++)
        radial[c] -= *along * s->axis[c];
    *across = uz_unit3(radial);
}

void uz_smooth_nearest(double offset[3], double normal[3], const uz_smooth_shape *shape, const double x[3])
{
    double along, across, radial[3];
    memset(offset, 0, 3 * sizeof *offset);
    if (shape->kind == UZ_SMOOTH_NONE)
        return;
    about_axis(&along, &across, radial, shape, x);
    const double k = shape->kind == UZ_SMOOTH_CONE ? shape->slope : 0;
    const double out = (shape->radius + k * along - across) / (1 + k * k); /* of a cone across its side */
    for (int c = 0; c < 3; c++) {
        offset[c] = out * (radial[c] - k * shape->axis[c]);
        if (normal)
            normal[c] = (radial[c] - k * shape->axis[c]) / sqrt(1 + k * k);
    }
}

static double farthest(const uz_smooth_shape *shape, const double *xyz, int64_t n)
{
    double most = 0;
    for (int64_t i = 0; i < n; i++) {
        double offset[3];
        uz_smooth_nearest(offset, NULL, shape, xyz + 3 * i);
        most = fmax(most, sqrt(uz_dot3(offset, offset)));
    }
    return most;
}

/* ---- Gauss and Newton's method */

/* Solves the p x p system A x = b, A positive semidefinite, b becomes x; columns that are nothing new get 0. */
static void solve(double A[MOST_PARAMETERS][MOST_PARAMETERS], double *b, int p)
{
    double scale[MOST_PARAMETERS];
    for (int j = 0; j < p; j++)
        scale[j] = A[j][j];
    for (int j = 0; j < p; j++) {
        if (!(A[j][j] > 1e-13 * scale[j])) {
            for (int i = 0; i < p; i++)
                A[j][i] = A[i][j] = 0;
            A[j][j] = 1;
            b[j] = 0;
        }
        for (int i = j + 1; i < p; i++) {
            const double f = A[i][j] / A[j][j];
            for (int k = j; k < p; k++)
                A[i][k] -= f * A[j][k];
            b[i] -= f * b[j];
        }
    }
    for (int j = p - 1; j >= 0; j--) {
        for (int k = j + 1; k < p; k++)
            b[j] -= A[j][k] * b[k];
        b[j] /= A[j][j];
    }
}

/* One step towards the least squares of the distances across the axis (from the centre). Parameters: two or three of
 * the point, two of the axis, radius, slope. */
static void step_towards(uz_smooth_shape *s, const double *xyz, int64_t n)
{
    const bool sphere = s->kind == UZ_SMOOTH_SPHERE;
    const int p = sphere ? 4 : s->kind == UZ_SMOOTH_CYLINDER ? 5 : 6;
    double A[MOST_PARAMETERS][MOST_PARAMETERS] = {{0}}, b[MOST_PARAMETERS] = {0};
    double e[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    if (!sphere) { /* two directions across the axis */
        const int least = fabs(s->axis[0]) < 0.6 ? 0 : 1;
        uz_cross3(e[1], s->axis, e[least]);
        uz_unit3(e[1]);
        uz_cross3(e[0], e[1], s->axis);
    }
    for (int64_t i = 0; i < n; i++) {
        double along, across, radial[3], J[MOST_PARAMETERS];
        about_axis(&along, &across, radial, s, xyz + 3 * i);
        const double k = s->kind == UZ_SMOOTH_CONE ? s->slope : 0, off = across - s->radius - k * along;
        if (!(across > 0) || sphere) {
            for (int c = 0; c < 3; c++)
                J[c] = -radial[c];
            J[3] = -1;
        } else {
            for (int c = 0; c < 2; c++) {
                J[c] = -uz_dot3(radial, e[c]);
                J[2 + c] = -(along + k * across) * uz_dot3(radial, e[c]);
            }
            J[4] = -1;
            J[5] = -along;
        }
        for (int j = 0; j < p; j++) {
            for (int q = 0; q < p; q++)
                A[j][q] += J[j] * J[q];
            b[j] -= J[j] * off;
        }
    }
    solve(A, b, p);
    for (int c = 0; c < 3; c++)
        s->point[c] += sphere ? b[c] : b[0] * e[0][c] + b[1] * e[1][c];
    for (int c = 0; c < 3 && !sphere; c++)
        s->axis[c] += b[2] * e[0][c] + b[3] * e[1][c];
    uz_unit3(s->axis);
    s->radius += b[sphere ? 3 : 4];
    s->slope += s->kind == UZ_SMOOTH_CONE ? b[5] : 0;
}

/* Do all points lie on the shape that steps lead to from here? size: of the surface. */
static bool fits(uz_smooth_shape *s, const double *xyz, int64_t n, double size)
{
    for (int k = 0; k < 30; k++)
        step_towards(s, xyz, n);
    const double off = farthest(s, xyz, n), largest = fabs(s->radius) + fabs(s->slope) * size;
    return isfinite(off) && isfinite(s->radius) && off <= ON_SHAPE * fmin(largest, size) && largest < FLAT * size;
}

uz_smooth_shape uz_smooth_shape_of(const double *xyz, const double *normal, int64_t n)
{
    uz_smooth_shape s = {.kind = UZ_SMOOTH_NONE};
    double size = 0, turn = 0, best = 0, mean[3] = {0}, axis[2][3] = {{0}};
    int64_t far = 0;
    for (int64_t i = 0; i < n; i++) {
        double d[3], t[3];
        for (int c = 0; c < 3; c++) {
            mean[c] += xyz[3 * i + c] / (double)n;
            d[c] = xyz[3 * i + c] - xyz[c];
            t[c] = normal[3 * i + c] - normal[c];
        }
        size = fmax(size, sqrt(uz_dot3(d, d)));
        if (sqrt(uz_dot3(t, t)) > turn) {
            turn = sqrt(uz_dot3(t, t));
            far = i;
        }
    }
    if (n < 6 || turn < 1e-3)
        return s;
    /* A sphere: normals differ as points do. */
    double d[3], t[3];
    for (int c = 0; c < 3; c++) {
        d[c] = xyz[3 * far + c] - xyz[c];
        t[c] = normal[3 * far + c] - normal[c];
    }
    const double radius = uz_dot3(d, t) / uz_dot3(t, t);
    uz_smooth_shape sphere = {.kind = UZ_SMOOTH_SPHERE, .radius = fabs(radius)};
    for (int c = 0; c < 3; c++)
        sphere.point[c] = xyz[c] - radius * normal[c];
    if (fits(&sphere, xyz, n, size))
        return sphere;
    /* The axis is across all normals of a cylinder, and across the differences of those of a cone. */
    for (int k = 0; k < 2; k++) {
        best = 0;
        for (int64_t i = 0; i < n; i++) {
            double other[3], at[3];
            for (int c = 0; c < 3; c++)
                other[c] = k == 0 ? normal[3 * i + c] : normal[3 * i + c] - normal[c];
            uz_cross3(at, k == 0 ? normal : t, other);
            const double length = sqrt(uz_dot3(at, at));
            if (length > best) {
                best = length;
                memcpy(axis[k], at, sizeof at);
            }
        }
        uz_smooth_shape round = {.kind = k == 0 ? UZ_SMOOTH_CYLINDER : UZ_SMOOTH_CONE, .radius = fabs(radius)};
        if (!(uz_unit3(axis[k]) > 0))
            continue;
        memcpy(round.axis, axis[k], sizeof round.axis);
        for (int c = 0; c < 3; c++) /* opposite the normal, at the height of the points' mean */
            round.point[c] = xyz[c] - radius * normal[c];
        double up = 0;
        for (int c = 0; c < 3; c++)
            up += (mean[c] - round.point[c]) * round.axis[c];
        for (int c = 0; c < 3; c++)
            round.point[c] += up * round.axis[c];
        if (fits(&round, xyz, n, size))
            return round;
    }
    return s;
}
