#include "obstacle/obstacle.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/shapes.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A plane's normal and a cylinder's axis are of unit length here. `scale` is a power of two, and everything below is
 * the caller's times it. */
struct uz_obstacle {
    uz_obstacle_kind kind;
    int dim;
    int64_t index;
    bool inside;
    double scale, point[3], direction[3], radius;
    uz_line line;
    uz_table table;
    bool is_line; /* a polyline, or heights over x */
};

static double largest_of(double most, const double *v, int64_t n)
{
    for (int64_t i = 0; v && i < n; i++)
        most = fmax(most, fabs(v[i]));
    return most;
}

/* The power of two that brings the obstacle's numbers to 1/2..1. */
static double scale_of(const uz_contact *c, int dim)
{
    const bool over_area = c->kind == UZ_OBSTACLE_HEIGHT && dim == 3;
    double most = 0;
    int exponent;
    if (c->kind == UZ_OBSTACLE_POLYLINE || c->kind == UZ_OBSTACLE_HEIGHT) {
        most = largest_of(most, c->x, c->n_x);
        most = largest_of(most, c->kind == UZ_OBSTACLE_POLYLINE ? c->y : c->z, over_area ? c->n_x * c->n_y : c->n_x);
        most = over_area ? largest_of(most, c->y, c->n_y) : most;
    } else {
        most = fmax(largest_of(most, c->point, dim), c->kind == UZ_OBSTACLE_PLANE ? 0 : c->radius);
    }
    frexp(most > 0 ? most : 1, &exponent);
    return ldexp(1, exponent < -1000 ? 1000 : exponent > 1000 ? -1000 : -exponent);
}

static uz_status refuse_crossing(const uz_obstacle *o, const int64_t pair[2], uz_error *err)
{
    char where[96], of[2][64];
    for (int k = 0; k < 2; k++)
        if (pair[k] == 0 || pair[k] == o->line.n)
            snprintf(of[k], sizeof of[k], "the half line beyond point %lld",
                     (long long)(pair[k] == 0 ? 0 : o->line.n - 1));
        else
            snprintf(of[k], sizeof of[k], "the segment from point %lld", (long long)pair[k] - 1);
    snprintf(where, sizeof where, "/contacts/%lld/obstacle/polyline/points", (long long)o->index);
    return uz_fail(
        err, UZ_ERR_SCENE, where,
        "the line meets itself: %s and %s; it must have the obstacle on its right everywhere. Move its points, "
        "or end it where it began to close it",
        of[0], of[1]);
}

static uz_status init_line(uz_obstacle *o, const uz_contact *c, uz_error *err)
{
    static const double FLAT[4] = {1, 0, 1, 0};
    const bool table = c->kind == UZ_OBSTACLE_HEIGHT;
    int64_t pair[2];
    const uz_status status =
        uz_line_init(&o->line, c->n_x, c->x, table ? c->z : c->y, table ? FLAT : NULL, o->scale, err);
    o->is_line = true;
    if (status == UZ_OK && !table && uz_line_crosses(pair, &o->line))
        return refuse_crossing(o, pair, err);
    return status;
}

uz_status uz_obstacle_new(uz_obstacle **out, const uz_contact *contact, int64_t index, uz_model model, uz_error *err)
{
    *out = NULL;
    uz_status status = uz_obstacle_check(contact, index, model, err);
    if (status != UZ_OK)
        return status;
    if (contact->kind == UZ_OBSTACLE_BODY)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a body of the mesh is no rigid obstacle");
    uz_obstacle *o = uz_alloc_zero(1, sizeof *o);
    if (!o)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for an obstacle");
    o->kind = contact->kind;
    o->dim = model == UZ_SOLID ? 3 : 2;
    o->index = index;
    o->inside = contact->inside;
    o->scale = scale_of(contact, o->dim);
    o->radius = contact->radius * o->scale;
    for (int c = 0; c < o->dim; c++)
        o->point[c] = contact->point[c] * o->scale;
    if (o->kind == UZ_OBSTACLE_PLANE || o->kind == UZ_OBSTACLE_CYLINDER)
        uz_unit_normal(o->direction, contact->normal, o->dim);
    if (o->kind == UZ_OBSTACLE_POLYLINE || (o->kind == UZ_OBSTACLE_HEIGHT && o->dim == 2))
        status = init_line(o, contact, err);
    else if (o->kind == UZ_OBSTACLE_HEIGHT)
        status = uz_table_init(&o->table, contact, o->scale, err);
    if (status == UZ_OK)
        *out = o;
    else
        uz_obstacle_free(o);
    return status;
}

void uz_obstacle_free(uz_obstacle *obstacle)
{
    if (!obstacle)
        return;
    uz_line_clear(&obstacle->line);
    uz_table_clear(&obstacle->table);
    free(obstacle);
}

static void plane_gap(uz_gap *out, const uz_obstacle *o, const double x[3])
{
    out->gap = 0;
    for (int c = 0; c < o->dim; c++)
        out->gap += (x[c] - o->point[c]) * o->direction[c];
    for (int c = 0; c < 3; c++) {
        out->normal[c] = o->direction[c];
        out->foot[c] = c < o->dim ? x[c] - out->gap * o->direction[c] : 0;
    }
    out->curvature = 0;
}

static uz_status refuse_centre(const uz_obstacle *o, const double x[3], uz_error *err)
{
    char where[96];
    const bool cylinder = o->kind == UZ_OBSTACLE_CYLINDER;
    snprintf(where, sizeof where, "/contacts/%lld/obstacle/%s", (long long)o->index,
             cylinder      ? "cylinder/point"
             : o->dim == 2 ? "circle/center"
                           : "sphere/center");
    return uz_fail(
        err, UZ_ERR_SCENE, where,
        "a node that can touch, (%g, %g, %g), lies %s: there the obstacle has no normal; move the obstacle, or "
        "leave the node out of the group",
        x[0] / o->scale, x[1] / o->scale, x[2] / o->scale, cylinder ? "on the axis" : "at the centre");
}

/* The vector from the centre, or from the axis at right angles to it, as a length and a unit vector. */
static double radial(double unit[3], const uz_obstacle *o, const double x[3])
{
    double off[3] = {0}, along = 0, most = 0;
    for (int c = 0; c < o->dim; c++) {
        off[c] = x[c] - o->point[c];
        along += off[c] * o->direction[c];
    }
    for (int c = 0; c < o->dim; c++) {
        off[c] -= along * o->direction[c];
        most = fmax(most, fabs(off[c]));
    }
    const double scale = most > 0 ? most : 1;
    const double length = scale * sqrt((off[0] / scale) * (off[0] / scale) + (off[1] / scale) * (off[1] / scale) +
                                       (off[2] / scale) * (off[2] / scale));
    for (int c = 0; c < 3; c++)
        unit[c] = length > 0 ? off[c] / length : 0;
    return length;
}

/* What rounding can leave of the vector from the centre to the point itself. */
static bool is_centre(const uz_obstacle *o, const double x[3], double distance)
{
    double size = 0;
    for (int c = 0; c < o->dim; c++)
        size += fabs(x[c]) + fabs(o->point[c]);
    return distance <= 4 * DBL_EPSILON * size;
}

static uz_status round_gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    double unit[3];
    const double distance = radial(unit, o, x), sign = o->inside ? -1 : 1;
    if (is_centre(o, x, distance))
        return refuse_centre(o, x, err);
    out->gap = sign * (distance - o->radius);
    out->curvature = sign / distance;
    for (int c = 0; c < 3; c++) {
        out->normal[c] = sign * unit[c];
        out->foot[c] = c < o->dim ? x[c] - (distance - o->radius) * unit[c] : 0;
    }
    return UZ_OK;
}

static uz_status refuse_overflow(const uz_obstacle *o, uz_error *err)
{
    char where[96];
    snprintf(where, sizeof where, "/contacts/%lld/obstacle", (long long)o->index);
    return uz_fail(err, UZ_ERR_NOT_FINITE, where, "the gap to this obstacle overflows");
}

/* Back to the caller's units. */
static uz_status unscale(uz_gap *out, const uz_obstacle *o, const uz_gap *scaled, uz_error *err)
{
    uz_gap gap = *scaled;
    gap.gap /= o->scale;
    gap.curvature *= o->scale;
    for (int c = 0; c < 3; c++)
        gap.foot[c] /= o->scale;
    const double sum = gap.gap + gap.normal[0] + gap.normal[1] + gap.normal[2];
    if (!isfinite(sum) || isnan(gap.curvature))
        return refuse_overflow(o, err);
    *out = gap;
    return UZ_OK;
}

uz_status uz_obstacle_gap(uz_gap *out, const uz_obstacle *obstacle, const double *x, uz_error *err)
{
    const uz_obstacle *o = obstacle;
    double at[3] = {0};
    uz_gap scaled = {0};
    uz_status status = UZ_OK;
    memset(out, 0, sizeof *out);
    for (int c = 0; c < o->dim; c++) {
        at[c] = x[c] * o->scale;
        if (!isfinite(at[c]))
            return refuse_overflow(o, err);
    }
    if (o->is_line)
        uz_line_gap(&scaled, &o->line, at);
    else if (o->kind == UZ_OBSTACLE_HEIGHT)
        uz_table_gap(&scaled, &o->table, at);
    else if (o->kind == UZ_OBSTACLE_PLANE)
        plane_gap(&scaled, o, at);
    else
        status = round_gap(&scaled, o, at, err);
    return status == UZ_OK ? unscale(out, o, &scaled, err) : status;
}
