/* surface.c: what is behind a surface of triangles: what a closed one encloses, or all but that.
 *
 * Behind an open surface the obstacle reaches as far as the surface is closest; beyond its rim there is none: from
 * there a gap is the distance to the rim, on either side. Points that are as far from several triangles take the one of
 * least number. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "obstacle/check.h"
#include "obstacle/pieces.h"
#include "obstacle/triangulation.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uz_status check(const uz_obstacle_subject *s)
{
    const uz_contact *c = s->contact;
    if (c->n_x < 3 || c->n_x % 3 != 0)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "", -1), "a surface has triangles");
    if (!c->x || !c->y || !c->z)
        return uz_fail(s->err, UZ_ERR_ARGUMENT, UZ_OBSTACLE_PLACE(s, "", -1), "the obstacle's numbers are missing");
    if (c->n_x > INT32_MAX)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "", -1), "too many triangles");
    uz_status status = uz_obstacle_check_finite(s, "", c->x, c->n_x);
    if (status == UZ_OK)
        status = uz_obstacle_check_finite(s, "", c->y, c->n_x);
    return status == UZ_OK ? uz_obstacle_check_finite(s, "", c->z, c->n_x) : status;
}

static uz_status init(uz_obstacle *o, const uz_contact *c, uz_error *err)
{
    const uz_obstacle_subject s = {.shape = o->shape, .contact = c, .index = o->index, .dim = o->dim};
    o->own = uz_alloc_zero(1, sizeof(uz_triangulation));
    if (!o->own)
        return uz_no_memory(err, "an obstacle");
    return uz_triangulation_init(o->own, c->n_x / 3, c->x, c->y, c->z, o->scale, c->inside,
                                 UZ_OBSTACLE_PLACE(&s, "", -1), err);
}

static void clear(uz_obstacle *o)
{
    if (o->own)
        uz_triangulation_clear(o->own);
    free(o->own);
}

/* What surrounds a place of the surface. */
typedef struct {
    double normal[3]; /* unit; the mean of those that meet there */
    bool flat;        /* there is one plane there */
    bool rim;         /* or the fold of a sheet onto itself, which has no side either */
    bool hollow;      /* the triangles around rise above the plane of `normal` */
} surroundings;

static surroundings look_around(const uz_triangulation *t, const uz_triangle_place *at)
{
    surroundings s = {.flat = at->edge < 0 && at->corner < 0};
    const double *n = t->normal + 3 * at->triangle;
    double rises = 0;
    bool bare = false; /* beyond a triangle without area: what is behind that is not known */
    memcpy(s.normal, n, sizeof s.normal);
    if (s.flat)
        return s;
    if (at->edge >= 0) {
        const int64_t there = t->beside[3 * at->triangle + at->edge];
        s.rim = there < 0;
        for (int c = 0; c < 3 && !s.rim; c++)
            s.normal[c] += t->normal[3 * there + c];
        if (uz_dot3(s.normal, s.normal) < UZ_SAME_DIRECTION * UZ_SAME_DIRECTION) {
            memcpy(s.normal, n, sizeof s.normal);
            s.rim = true;
        }
        bare = !s.rim && uz_dot3(t->normal + 3 * there, t->normal + 3 * there) == 0;
        for (int k = 0; k < 3 && !s.rim; k++)
            for (int c = 0; c < 3; c++)
                rises += n[c] * (t->point[3 * t->corner[3 * there + k] + c] - at->foot[c]);
    } else {
        const double *mean = t->point_normal + 3 * t->corner[3 * at->triangle + at->corner];
        s.rim = mean[0] == 0 && mean[1] == 0 && mean[2] == 0;
        if (!s.rim)
            memcpy(s.normal, mean, sizeof s.normal);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                rises += s.normal[c] * (t->point[3 * t->corner[3 * at->triangle + k] + c] - at->foot[c]);
    }
    uz_unit3(s.normal);
    s.flat = !s.rim && !bare && uz_distance2(s.normal, n, 3) < UZ_SAME_DIRECTION * UZ_SAME_DIRECTION;
    s.hollow = rises > 0;
    return s;
}

static uz_status gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    const uz_triangulation *t = o->own;
    uz_triangle_place at;
    double off[3], size = 0;
    (void)err;
    if (!uz_triangulation_nearest(&at, t, x)) {
        out->gap = (double)NAN;
        return UZ_OK;
    }
    const surroundings s = look_around(t, &at);
    for (int c = 0; c < 3; c++) {
        off[c] = x[c] - at.foot[c];
        size += fabs(x[c]);
    }
    const double distance = sqrt(uz_dot3(off, off)), along = uz_dot3(off, s.normal);
    const bool on = distance <= 8 * DBL_EPSILON * size;
    const double sign = along < 0 && !s.rim ? -1 : 1;
    memcpy(out->foot, at.foot, sizeof out->foot);
    out->facets = t->sagitta[at.triangle];
    out->gap = s.flat ? along : on ? 0 : sign * distance;
    for (int c = 0; c < 3; c++)
        out->normal[c] = s.flat || on ? s.normal[c] : sign * off[c] / distance;
    if (!s.flat)
        out->curvature = !on ? sign / distance : s.hollow ? -INFINITY : INFINITY;
    return UZ_OK;
}

static void lists(int64_t n[3], const uz_contact *contact)
{
    n[0] = n[1] = n[2] = contact->n_x;
}

uz_status uz_triangles_check(const uz_triangles *triangles, bool inside, uz_error *err)
{
    const uz_contact contact = {.kind = UZ_OBSTACLE_SURFACE,
                                .n_x = 3 * triangles->n,
                                .x = triangles->x,
                                .y = triangles->y,
                                .z = triangles->z,
                                .inside = inside};
    uz_obstacle *obstacle = NULL;
    uz_error_reset(err);
    const uz_status status = uz_obstacle_new(&obstacle, &contact, 0, UZ_SOLID, err);
    uz_obstacle_free(obstacle);
    return status;
}

const uz_obstacle_shape uz_shape_surface = {
    .name = {"surface", "surface"},
    .refused = {"a surface of triangles is an obstacle of solid models; in the plane use a polyline, or a table of "
                "heights"},
    .has_edges = true,
    .check = check,
    .init = init,
    .clear = clear,
    .gap = gap,
    .lists = lists};
