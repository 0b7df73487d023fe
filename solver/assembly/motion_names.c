/* motion_names.c: rigid motions in words. */
#include "assembly/body_parts.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* What is zero but for rounding reads as zero. */
static double tidy(double value, double scale)
{
    return fabs(value) > 1e-9 * scale ? value : 0;
}

/* "(1, 2)", "(1, 2, 3)". */
static void name_vector(char *text, size_t size, const double v[3], int dim)
{
    if (dim == 2)
        snprintf(text, size, "(%.6g, %.6g)", v[0], v[1]);
    else
        snprintf(text, size, "(%.6g, %.6g, %.6g)", v[0], v[1], v[2]);
}

/* "x", "+x", or its components where it is not along an axis. */
static void name_axis(char *text, size_t size, const double v[3], int dim, bool directed)
{
    const double length = hypot(hypot(v[0], v[1]), v[2]);
    double unit[3];
    int shares = 0, axis = 0;
    for (int c = 0; c < 3; c++) {
        unit[c] = tidy(v[c] / length, 1);
        shares += unit[c] != 0;
        axis = unit[c] != 0 ? c : axis;
    }
    if (shares == 1)
        snprintf(text, size, "%s%c", !directed ? "" : unit[axis] < 0 ? "-" : "+", "xyz"[axis]);
    else
        name_vector(text, size, unit, dim);
}

void uz_name_part_motion(char *text, size_t size, const uz_parts *parts, const uz_part *p, const double q[UZ_MOTIONS],
                         bool directed)
{
    const double shift = hypot(hypot(q[0], q[1]), q[2]), turn = hypot(hypot(q[3], q[4]), q[5]);
    char point[96], axis[96];
    double x[3];
    if (turn <= 1e-7 * shift) {
        name_axis(axis, sizeof axis, q, parts->dim, directed);
        snprintf(text, size, "translation along %s", axis);
        return;
    }
    /* The point nearest to the centre that a rotation leaves in its place, or a screw motion moves least. */
    const double *t = q, *w = q + 3, L = uz_part_size(p);
    const double square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    for (int c = 0; c < 3; c++) {
        const double offset = w[(c + 1) % 3] * t[(c + 2) % 3] - w[(c + 2) % 3] * t[(c + 1) % 3];
        const double centre = 0.5 * p->low[c] + 0.5 * p->high[c];
        x[c] = tidy(centre + tidy(offset / square, 1) * L, L);
    }
    name_vector(point, sizeof point, x, parts->dim);
    if (parts->dim == 2) {
        snprintf(text, size, "rotation about %s%s", point,
                 !directed  ? ""
                 : q[5] < 0 ? ", clockwise"
                            : ", counterclockwise");
        return;
    }
    const double along = fabs(q[0] * q[3] + q[1] * q[4] + q[2] * q[5]);
    name_axis(axis, sizeof axis, q + 3, 3, directed);
    snprintf(text, size, "%s about the axis through %s along %s",
             along > 1e-7 * turn * fmax(shift, turn) ? "screw motion" : "rotation", point, axis);
}
