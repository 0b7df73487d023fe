/* height.c: everything below a table of heights, over x or over x and y. */
#include "obstacle/check.h"
#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/pieces.h"

#include <math.h>
#include <stdio.h>

/* A table steeper than this is a step: its normal would be rounding. */
#define STEEPEST 1e6

static uz_status check_ascending(const uz_obstacle_subject *s, const char *key, const double *v, int64_t n)
{
    const uz_status status = uz_obstacle_check_finite(s, key, v, n);
    for (int64_t i = 1; i < n && status == UZ_OK; i++)
        if (!(v[i] - v[i - 1] > UZ_TOLD_APART * fmax(fabs(v[i]), fabs(v[i - 1]))))
            return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, key, i),
                           "the table must ascend: %g follows %g; a step has no slope: use a polyline", v[i], v[i - 1]);
    return status;
}

/* n heights, `stride` apart, over the places v; `first` is the number of the first in the table. */
static uz_status check_slopes(const uz_obstacle_subject *s, const double *v, int64_t n, int64_t first, int64_t stride)
{
    char row[32];
    const uz_contact *c = s->contact;
    for (int64_t i = 1; i < n; i++) {
        const int64_t at = first + i * stride, line = at / c->n_x;
        if (fabs(c->z[at] - c->z[at - stride]) <= STEEPEST * (v[i] - v[i - 1]))
            continue;
        snprintf(row, sizeof row, s->dim == 3 ? "z/%lld" : "z", (long long)line);
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, row, at % c->n_x),
                       "the table rises from %g to %g within %g, as good as a step; the steepest slope is %g%s",
                       c->z[at - stride], c->z[at], v[i] - v[i - 1], STEEPEST,
                       s->dim == 2 ? "; a polyline may be vertical" : "");
    }
    return UZ_OK;
}

static uz_status check(const uz_obstacle_subject *s)
{
    char row[32];
    const uz_contact *c = s->contact;
    uz_status status;
    if (s->dim == 2 && c->n_y != 0)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "y", -1),
                       "a plane model takes heights over x alone; leave y out");
    if (s->dim == 3 && c->n_y == 0)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "", -1), "heights of a solid model need y, too");
    status = uz_obstacle_check_lists(s, s->dim == 2 || c->n_x < 2 ? "x" : "y", "a table needs two places at least");
    if (status == UZ_OK)
        status = check_ascending(s, "x", c->x, c->n_x);
    if (status == UZ_OK && s->dim == 3)
        status = check_ascending(s, "y", c->y, c->n_y);
    for (int64_t j = 0; j < (s->dim == 3 ? c->n_y : 1) && status == UZ_OK; j++) {
        snprintf(row, sizeof row, s->dim == 3 ? "z/%lld" : "z", (long long)j);
        status = uz_obstacle_check_finite(s, row, c->z + j * c->n_x, c->n_x);
    }
    for (int64_t j = 0; j < (s->dim == 3 ? c->n_y : 1) && status == UZ_OK; j++)
        status = check_slopes(s, c->x, c->n_x, j * c->n_x, 1);
    for (int64_t i = 0; i < c->n_x && s->dim == 3 && status == UZ_OK; i++)
        status = check_slopes(s, c->y, c->n_y, i, c->n_x);
    return status;
}

/* own is a uz_line in the plane, flat beyond its ends, and a uz_table in space. */
static uz_status init(uz_obstacle *o, const uz_contact *c, uz_error *err)
{
    static const double FLAT[4] = {1, 0, 1, 0};
    o->own = uz_alloc_zero(1, o->dim == 2 ? sizeof(uz_line) : sizeof(uz_table));
    if (!o->own)
        return uz_no_memory(err, "an obstacle");
    return o->dim == 2 ? uz_line_init(o->own, c->n_x, c->x, c->z, FLAT, o->scale, err)
                       : uz_table_init(o->own, c, o->scale, err);
}

static uz_status gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    if (o->dim == 2)
        return uz_line_gap(out, o, x, err);
    uz_table_gap(out, o->own, x);
    return UZ_OK;
}

static void lists(int64_t n[3], const uz_contact *contact)
{
    n[0] = contact->n_x;
    n[1] = contact->n_y;
    n[2] = contact->n_x * (contact->n_y > 0 ? contact->n_y : 1);
}

/* Where a value lies in an ascending list, which goes on flat: between i and i + 1, at *t of the way. */
static int64_t find_place(double *t, const double *list, int64_t n, double value)
{
    int64_t low = 0, high = n - 1;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (list[middle] <= value)
            low = middle;
        else
            high = middle;
    }
    *t = fmin(fmax((value - list[low]) / (list[low + 1] - list[low]), 0), 1);
    return low;
}

static void surface(double x[3], const uz_obstacle_patch *p, double s, double t)
{
    const double reach = UZ_PATCH_REACH * p->size;
    x[0] = p->middle[0] + s * reach;
    x[1] = p->middle[1] + t * reach;
    const uz_contact *c = p->contact;
    const int64_t i = find_place(&s, c->x, c->n_x, x[0]), j = find_place(&t, c->y, c->n_y, x[1]);
    const double *z = c->z + j * c->n_x + i;
    x[2] = (1 - t) * ((1 - s) * z[0] + s * z[1]) + t * ((1 - s) * z[c->n_x] + s * z[c->n_x + 1]);
}

const uz_obstacle_shape uz_shape_height = {.name = {"height", "height"},
                                           .has_edges = true,
                                           .check = check,
                                           .init = init,
                                           .clear = uz_pieces_clear,
                                           .gap = gap,
                                           .along = uz_line_along,
                                           .lists = lists,
                                           .outline = uz_line_outline,
                                           .surface = surface};
