/* round.c: discs, balls and cylinders, or all but these. */
#include "obstacle/check.h"
#include "core/error.h"
#include "obstacle/vectors.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double PI = 3.14159265358979;

/* Of the length of a patch: half an arc that is as long. */
#define ARC (1.5 * UZ_PATCH_REACH)

static uz_status check(const uz_obstacle_subject *s)
{
    const bool cylinder = s->shape == &uz_shape_cylinder;
    const double radius = s->contact->radius;
    uz_status status = UZ_OK;
    if (!isfinite(radius))
        return uz_obstacle_not_finite(s, "radius", -1);
    if (radius <= 0)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "radius", -1),
                       "the radius must be positive; it is %g", radius);
    if (cylinder)
        status = uz_obstacle_check_direction(s, "axis", "the axis has no direction: it is zero");
    return status == UZ_OK ? uz_obstacle_check_finite(s, cylinder ? "point" : "center", s->contact->point, s->dim)
                           : status;
}

static uz_status gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    /* from the centre, or from the axis at right angles to it */
    double off[3] = {0}, unit[3], along = 0, most = 0, size = 0;
    for (int c = 0; c < o->dim; c++) {
        off[c] = x[c] - o->point[c];
        along += off[c] * o->direction[c];
        size += fabs(x[c]) + fabs(o->point[c]);
    }
    for (int c = 0; c < o->dim; c++) {
        off[c] -= along * o->direction[c];
        most = fmax(most, fabs(off[c]));
    }
    const double scale = most > 0 ? most : 1, sign = o->inside ? -1 : 1;
    const double distance = scale * sqrt((off[0] / scale) * (off[0] / scale) + (off[1] / scale) * (off[1] / scale) +
                                         (off[2] / scale) * (off[2] / scale));
    for (int c = 0; c < 3; c++)
        unit[c] = distance > 0 ? off[c] / distance : 0;
    if (distance <= 4 * DBL_EPSILON * size) { /* what rounding can leave of the centre itself */
        char where[96];
        const bool cylinder = o->shape == &uz_shape_cylinder;
        snprintf(where, sizeof where, "/contacts/%lld/obstacle/%s/%s", (long long)o->index, o->shape->name[o->dim - 2],
                 cylinder ? "point" : "center");
        return uz_fail(
            err, UZ_ERR_SCENE, where,
            "a node that can touch, (%g, %g, %g), lies %s: there the obstacle has no normal; move the obstacle, or "
            "leave the node out of the group",
            x[0] / o->scale, x[1] / o->scale, x[2] / o->scale, cylinder ? "on the axis" : "at the centre");
    }
    out->gap = sign * (distance - o->radius);
    out->curvature = sign / distance;
    for (int c = 0; c < 3; c++) {
        out->normal[c] = sign * unit[c];
        out->along[c] = o->direction[c];
        out->foot[c] = c < o->dim ? x[c] - (distance - o->radius) * unit[c] : 0;
    }
    return UZ_OK;
}

static uz_status along(uz_obstacle_pieces *out, const uz_obstacle *o, const double a[2], const double b[2],
                       uz_error *err)
{
    (void)a, (void)b;
    const uz_obstacle_piece piece = {
        .end = 1, .round = true, .inside = o->inside, .centre = {o->point[0], o->point[1]}, .radius = o->radius};
    return uz_obstacle_piece_add(out, &piece, err);
}

static int64_t outline_circle(double x[2], double way[2], const uz_contact *contact, int64_t i)
{
    enum { STEPS = 720 };
    /* Clockwise the disc is on the right; for a hole the other way. */
    const double angle = (contact->inside ? 2 : -2) * PI * (double)i / STEPS;
    x[0] = contact->point[0] + contact->radius * cos(angle);
    x[1] = contact->point[1] + contact->radius * sin(angle);
    way[0] = way[1] = 0;
    return STEPS + 1;
}

static void place_sphere(uz_obstacle_patch *p)
{
    memcpy(p->foot, p->contact->point, sizeof p->foot);
    for (int c = 0; c < 3; c++)
        p->n[c] = p->middle[c] - p->foot[c];
    uz_make_unit3(p->n, (const double[3]){0, -1, 0});
    uz_patch_frame(p);
    p->most = fmin(PI, ARC * p->size / p->contact->radius);
}

static void sphere_surface(double x[3], const uz_obstacle_patch *p, double s, double t)
{
    const double r = p->contact->radius, polar = 0.5 * (s + 1) * p->most;
    memcpy(x, p->foot, 3 * sizeof *x);
    uz_add3(x, r * cos(polar), p->n);
    uz_add3(x, r * sin(polar) * cos(PI * t), p->a);
    uz_add3(x, r * sin(polar) * sin(PI * t), p->b);
}

/* b is the axis. */
static void place_cylinder(uz_obstacle_patch *p)
{
    double away[3];
    memcpy(p->b, p->contact->normal, sizeof p->b);
    uz_make_unit3(p->b, (const double[3]){0, 0, 1});
    for (int c = 0; c < 3; c++)
        away[c] = p->middle[c] - p->contact->point[c];
    memcpy(p->foot, p->contact->point, sizeof p->foot);
    uz_add3(p->foot, uz_dot3(away, p->b), p->b);
    for (int c = 0; c < 3; c++)
        p->n[c] = p->middle[c] - p->foot[c];
    uz_make_unit3(p->n, (const double[3]){fabs(p->b[0]) < 0.9, fabs(p->b[0]) >= 0.9, 0});
    uz_cross3(p->a, p->b, p->n);
    uz_make_unit3(p->a, (const double[3]){0, 1, 0});
    p->most = fmin(PI, ARC * p->size / p->contact->radius);
}

static void cylinder_surface(double x[3], const uz_obstacle_patch *p, double s, double t)
{
    const double reach = UZ_PATCH_REACH * p->size, r = p->contact->radius, polar = s * p->most;
    memcpy(x, p->foot, 3 * sizeof *x);
    uz_add3(x, r * cos(polar), p->n);
    uz_add3(x, r * sin(polar), p->a);
    uz_add3(x, t * reach, p->b);
}

const uz_obstacle_shape uz_shape_round = {.name = {"circle", "sphere"},
                                          .check = check,
                                          .gap = gap,
                                          .along = along,
                                          .outline = outline_circle,
                                          .place = place_sphere,
                                          .surface = sphere_surface};

const uz_obstacle_shape uz_shape_cylinder = {
    .name = {"cylinder", "cylinder"},
    .refused = {"a cylinder is an obstacle of solid models; in a plane use a circle, or a plane"},
    .has_direction = true,
    .check = check,
    .gap = gap,
    .place = place_cylinder,
    .surface = cylinder_surface};
