/* obstacle.c: the kinds of obstacles, and what they share: scaling, and refusing what overflows. */
#include "obstacle/check.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A way out that is longer than this many depths leads along the obstacle. */
#define MOST_BACK 4

static const uz_obstacle_shape *const shapes[] = {[UZ_OBSTACLE_PLANE] = &uz_shape_plane,
                                                  [UZ_OBSTACLE_ROUND] = &uz_shape_round,
                                                  [UZ_OBSTACLE_CYLINDER] = &uz_shape_cylinder,
                                                  [UZ_OBSTACLE_POLYLINE] = &uz_shape_polyline,
                                                  [UZ_OBSTACLE_HEIGHT] = &uz_shape_height};

const uz_obstacle_shape *uz_obstacle_shape_of(uz_obstacle_kind kind)
{
    return (size_t)kind < sizeof shapes / sizeof shapes[0] ? shapes[kind] : NULL;
}

double uz_obstacle_largest(double most, const double *v, int64_t n)
{
    for (int64_t i = 0; v && i < n; i++)
        most = fmax(most, fabs(v[i]));
    return most;
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
    o->shape = uz_obstacle_shape_of(contact->kind);
    o->dim = model == UZ_SOLID ? 3 : 2;
    o->index = index;
    o->inside = contact->inside;
    /* The power of two that brings numbers up to `most` to 1/2..1. */
    double most = o->shape->largest(contact, o->dim);
    int exponent;
    frexp(most > 0 ? most : 1, &exponent);
    o->scale = ldexp(1, exponent < -1000 ? 1000 : exponent > 1000 ? -1000 : -exponent);
    o->radius = contact->radius * o->scale;
    for (int c = 0; c < o->dim; c++)
        o->point[c] = contact->point[c] * o->scale;
    if (o->shape->has_direction)
        uz_unit_normal(o->direction, contact->normal, o->dim);
    if (o->shape->init)
        status = o->shape->init(o, contact, err);
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
    if (obstacle->shape->clear)
        obstacle->shape->clear(obstacle);
    free(obstacle);
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
    memset(out, 0, sizeof *out);
    for (int c = 0; c < o->dim; c++) {
        at[c] = x[c] * o->scale;
        if (!isfinite(at[c]))
            return refuse_overflow(o, err);
    }
    const uz_status status = o->shape->gap(&scaled, o, at, err);
    return status == UZ_OK ? unscale(out, o, &scaled, err) : status;
}

uz_status uz_obstacle_row_gap(uz_gap *out, const uz_obstacle *obstacle, const double *x, const double *outward,
                              double clear, uz_error *err)
{
    enum { STEPS = 40 };
    const int dim = obstacle->dim;
    uz_gap there;
    double back = 0;
    const uz_status status = uz_obstacle_gap(out, obstacle, x, err);
    if (status != UZ_OK || !obstacle->shape->has_edges || out->gap >= clear)
        return status;
    const double enough = fmax(clear, -out->gap), most = 1.01 * enough + MOST_BACK * fmax(0, -out->gap);
    there = *out;
    /* a distance grows by no more than the way: no step leads past where it is enough */
    for (int k = 0; k < STEPS && there.gap < 0.999 * enough && back <= most; k++) {
        double at[3] = {0};
        back += enough - there.gap;
        for (int c = 0; c < dim; c++)
            at[c] = x[c] - back * outward[c];
        if (uz_obstacle_gap(&there, obstacle, at, NULL) != UZ_OK)
            return UZ_OK;
    }
    if (there.gap < 0.999 * enough || back > most)
        return UZ_OK;
    *out = there;
    for (int c = 0; c < dim; c++)
        out->gap += back * outward[c] * there.normal[c];
    return UZ_OK;
}
