/* polyline.c: an obstacle on the right of a line. */
#include "obstacle/check.h"
#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/pieces.h"
#include "scene/check.h"

#include <math.h>
#include <stdio.h>

static uz_status check(const uz_obstacle_subject *s)
{
    const uz_contact *c = s->contact;
    const uz_status status = uz_obstacle_check_lists(s, "points", "a polyline needs two points at least");
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < c->n_x; i++) {
        if (!isfinite(c->x[i]) || !isfinite(c->y[i]))
            return uz_obstacle_not_finite(s, "points", i);
        if (i == 0)
            continue;
        const double size = fmax(fmax(fabs(c->x[i]), fabs(c->x[i - 1])), fmax(fabs(c->y[i]), fabs(c->y[i - 1])));
        if (hypot(c->x[i] - c->x[i - 1], c->y[i] - c->y[i - 1]) <= UZ_TOLD_APART * size)
            return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "points", i),
                           "point %lld repeats the one before it, (%g, %g); leave it out", (long long)i, c->x[i],
                           c->y[i]);
    }
    if (c->n_x == 3 && c->x[0] == c->x[2] && c->y[0] == c->y[2])
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, "points", 2),
                       "a closed line needs three different points at least");
    return UZ_OK;
}

static uz_status init(uz_obstacle *o, const uz_contact *c, uz_error *err)
{
    char of[2][64];
    int64_t pair[2];
    uz_line *line = o->own = uz_alloc_zero(1, sizeof *line);
    if (!line)
        return uz_no_memory(err, "an obstacle");
    const uz_status status = uz_line_init(line, c->n_x, c->x, c->y, NULL, o->scale, err);
    if (status != UZ_OK || !uz_line_crosses(pair, line))
        return status;
    for (int k = 0; k < 2; k++)
        if (pair[k] == 0 || pair[k] == line->n)
            snprintf(of[k], sizeof of[k], "the half line beyond point %lld",
                     (long long)(pair[k] == 0 ? 0 : line->n - 1));
        else
            snprintf(of[k], sizeof of[k], "the segment from point %lld", (long long)pair[k] - 1);
    return uz_fail(
        err, UZ_ERR_SCENE, UZ_PLACE("contacts", o->index, "obstacle/polyline/points"),
        "the line meets itself: %s and %s; it must have the obstacle on its right everywhere. Move its points, "
        "or end it where it began to close it",
        of[0], of[1]);
}

static void lists(int64_t n[3], const uz_contact *contact)
{
    n[0] = n[1] = n[2] = contact->n_x;
}

const uz_obstacle_shape uz_shape_polyline = {
    .name = {"polyline", "polyline"},
    .refused = {NULL, "a polyline is an obstacle of plane models; use height for a solid"},
    .has_edges = true,
    .check = check,
    .init = init,
    .clear = uz_pieces_clear,
    .gap = uz_line_gap,
    .along = uz_line_along,
    .lists = lists,
    .outline = uz_line_outline};
