/* check.c: what is no obstacle. */
#include "core/error.h"
#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

enum { POINTER = 96 };

/* A table steeper than this is a step: its normal would be rounding. */
#define STEEPEST 1e6

/* Coordinates that differ by less than this part of their size have no direction between them. */
#define TOLD_APART (64 * DBL_EPSILON)

typedef struct {
    const uz_contact *contact;
    int64_t index;
    int dim;
    uz_error *err;
} subject;

static const char *kind_name(const subject *s)
{
    switch (s->contact->kind) {
    case UZ_OBSTACLE_PLANE:
        return "plane";
    case UZ_OBSTACLE_ROUND:
        return s->dim == 2 ? "circle" : "sphere";
    case UZ_OBSTACLE_CYLINDER:
        return "cylinder";
    case UZ_OBSTACLE_POLYLINE:
        return "polyline";
    default:
        return "height";
    }
}

/* "/contacts/0/obstacle/circle/radius"; i >= 0: "/contacts/0/obstacle/polyline/points/7". */
static const char *pointer_to(char where[POINTER], const subject *s, const char *key, int64_t i)
{
    const int n = snprintf(where, POINTER, "/contacts/%lld/obstacle/%s%s%s", (long long)s->index, kind_name(s),
                           *key ? "/" : "", key);
    if (i >= 0 && n > 0 && n < POINTER)
        snprintf(where + n, POINTER - (size_t)n, "/%lld", (long long)i);
    return where;
}

static uz_status refuse_not_finite(const subject *s, const char *key, int64_t i)
{
    char where[POINTER];
    return uz_fail(s->err, UZ_ERR_NOT_FINITE, pointer_to(where, s, key, i), "not a finite number");
}

static uz_status check_finite(const subject *s, const char *key, const double *v, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (!isfinite(v[i]))
            return refuse_not_finite(s, key, i);
    return UZ_OK;
}

static uz_status check_direction(const subject *s, const char *key, const char *remedy)
{
    char where[POINTER];
    double unit[3];
    const uz_status status = check_finite(s, key, s->contact->normal, s->dim);
    if (status == UZ_OK && !uz_unit_normal(unit, s->contact->normal, s->dim))
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, key, -1), "%s", remedy);
    return status;
}

static uz_status check_plane(const subject *s)
{
    const uz_status status =
        check_direction(s, "normal", "the normal is zero; it must point out of the obstacle, towards the body");
    return status == UZ_OK ? check_finite(s, "point", s->contact->point, s->dim) : status;
}

static uz_status check_radius(const subject *s)
{
    char where[POINTER];
    const double radius = s->contact->radius;
    if (!isfinite(radius))
        return refuse_not_finite(s, "radius", -1);
    if (radius <= 0)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "radius", -1),
                       "the radius must be positive; it is %g", radius);
    return UZ_OK;
}

static uz_status check_round(const subject *s)
{
    const uz_status status = check_radius(s);
    return status == UZ_OK ? check_finite(s, "center", s->contact->point, s->dim) : status;
}

static uz_status check_cylinder(const subject *s)
{
    uz_status status = check_radius(s);
    if (status == UZ_OK)
        status = check_direction(s, "axis", "the axis has no direction: it is zero");
    return status == UZ_OK ? check_finite(s, "point", s->contact->point, 3) : status;
}

static uz_status check_lists(const subject *s, int64_t least, const char *key, const char *what)
{
    char where[POINTER];
    const uz_contact *c = s->contact;
    const bool two = c->kind == UZ_OBSTACLE_HEIGHT && s->dim == 3;
    if (c->n_x < least || (two && c->n_y < least))
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, key, -1), "%s", what);
    if (!c->x || ((two || c->kind == UZ_OBSTACLE_POLYLINE) && !c->y) || (c->kind == UZ_OBSTACLE_HEIGHT && !c->z))
        return uz_fail(s->err, UZ_ERR_ARGUMENT, pointer_to(where, s, "", -1), "the obstacle's numbers are missing");
    if (c->n_x > INT32_MAX || c->n_y > INT32_MAX)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, key, -1), "too many numbers");
    return UZ_OK;
}

static uz_status check_polyline(const subject *s)
{
    char where[POINTER];
    const uz_contact *c = s->contact;
    const uz_status status = check_lists(s, 2, "points", "a polyline needs two points at least");
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < c->n_x; i++) {
        if (!isfinite(c->x[i]) || !isfinite(c->y[i]))
            return refuse_not_finite(s, "points", i);
        if (i == 0)
            continue;
        const double size = fmax(fmax(fabs(c->x[i]), fabs(c->x[i - 1])), fmax(fabs(c->y[i]), fabs(c->y[i - 1])));
        if (hypot(c->x[i] - c->x[i - 1], c->y[i] - c->y[i - 1]) <= TOLD_APART * size)
            return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "points", i),
                           "point %lld repeats the one before it, (%g, %g); leave it out", (long long)i, c->x[i],
                           c->y[i]);
    }
    if (c->n_x == 3 && c->x[0] == c->x[2] && c->y[0] == c->y[2])
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "points", 2),
                       "a closed line needs three different points at least");
    return UZ_OK;
}

static uz_status check_ascending(const subject *s, const char *key, const double *v, int64_t n)
{
    char where[POINTER];
    const uz_status status = check_finite(s, key, v, n);
    for (int64_t i = 1; i < n && status == UZ_OK; i++)
        if (!(v[i] - v[i - 1] > TOLD_APART * fmax(fabs(v[i]), fabs(v[i - 1]))))
            return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, key, i),
                           "the table must ascend: %g follows %g; a step has no slope: use a polyline", v[i], v[i - 1]);
    return status;
}

/* n heights, `stride` apart, over the places v; `first` is the number of the first in the table. */
static uz_status check_slopes(const subject *s, const double *v, int64_t n, int64_t first, int64_t stride)
{
    char where[POINTER], row[32];
    const uz_contact *c = s->contact;
    for (int64_t i = 1; i < n; i++) {
        const int64_t at = first + i * stride, line = at / c->n_x;
        if (fabs(c->z[at] - c->z[at - stride]) <= STEEPEST * (v[i] - v[i - 1]))
            continue;
        snprintf(row, sizeof row, s->dim == 3 ? "z/%lld" : "z", (long long)line);
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, row, at % c->n_x),
                       "the table rises from %g to %g within %g, as good as a step; the steepest slope is %g%s",
                       c->z[at - stride], c->z[at], v[i] - v[i - 1], STEEPEST,
                       s->dim == 2 ? "; a polyline may be vertical" : "");
    }
    return UZ_OK;
}

static uz_status check_steepness(const subject *s)
{
    const uz_contact *c = s->contact;
    uz_status status = UZ_OK;
    for (int64_t j = 0; j < (s->dim == 3 ? c->n_y : 1) && status == UZ_OK; j++)
        status = check_slopes(s, c->x, c->n_x, j * c->n_x, 1);
    for (int64_t i = 0; i < c->n_x && s->dim == 3 && status == UZ_OK; i++)
        status = check_slopes(s, c->y, c->n_y, i, c->n_x);
    return status;
}

static uz_status check_height(const subject *s)
{
    char where[POINTER], row[32];
    const uz_contact *c = s->contact;
    uz_status status;
    if (s->dim == 2 && c->n_y != 0)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "y", -1),
                       "a plane model takes heights over x alone; leave y out");
    if (s->dim == 3 && c->n_y == 0)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "", -1), "heights of a solid model need y, too");
    status = check_lists(s, 2, s->dim == 2 || c->n_x < 2 ? "x" : "y", "a table needs two places at least");
    if (status == UZ_OK)
        status = check_ascending(s, "x", c->x, c->n_x);
    if (status == UZ_OK && s->dim == 3)
        status = check_ascending(s, "y", c->y, c->n_y);
    for (int64_t j = 0; j < (s->dim == 3 ? c->n_y : 1) && status == UZ_OK; j++) {
        snprintf(row, sizeof row, s->dim == 3 ? "z/%lld" : "z", (long long)j);
        status = check_finite(s, row, c->z + j * c->n_x, c->n_x);
    }
    return status == UZ_OK ? check_steepness(s) : status;
}

static uz_status check_dimension(const subject *s)
{
    char where[POINTER];
    if (s->contact->kind == UZ_OBSTACLE_CYLINDER && s->dim == 2)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "", -1),
                       "a cylinder is an obstacle of solid models; in a plane use a circle, or a plane");
    if (s->contact->kind == UZ_OBSTACLE_POLYLINE && s->dim == 3)
        return uz_fail(s->err, UZ_ERR_SCENE, pointer_to(where, s, "", -1),
                       "a polyline is an obstacle of plane models; use height for a solid");
    return UZ_OK;
}

uz_status uz_obstacle_check(const uz_contact *contact, int64_t index, uz_model model, uz_error *err)
{
    const subject s = {contact, index, model == UZ_SOLID ? 3 : 2, err};
    char where[POINTER];
    const uz_status status = check_dimension(&s);
    if (status != UZ_OK)
        return status;
    switch (contact->kind) {
    case UZ_OBSTACLE_PLANE:
        return check_plane(&s);
    case UZ_OBSTACLE_ROUND:
        return check_round(&s);
    case UZ_OBSTACLE_CYLINDER:
        return check_cylinder(&s);
    case UZ_OBSTACLE_POLYLINE:
        return check_polyline(&s);
    case UZ_OBSTACLE_HEIGHT:
        return check_height(&s);
    case UZ_OBSTACLE_BODY:
        return UZ_OK;
    }
    snprintf(where, sizeof where, "/contacts/%lld/obstacle", (long long)index);
    return uz_fail(err, UZ_ERR_ARGUMENT, where, "unknown kind of obstacle");
}
