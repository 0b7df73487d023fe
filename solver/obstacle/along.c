/* along.c: what is before a way, in the caller's coordinates. */
#include "obstacle/along.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/shape.h"

#include <math.h>
#include <stdlib.h>

/* In lengths of the way: so close to it a centre is on it. */
#define ON_IT 1e-12

uz_status uz_obstacle_piece_add(uz_obstacle_pieces *out, const uz_obstacle_piece *piece, uz_error *err)
{
    if (!uz_grow(&out->at, out->n, 1, &out->room, sizeof *out->at))
        return uz_no_memory(err, "what is before a side");
    out->at[out->n++] = *piece;
    return UZ_OK;
}

/* Seen from a centre on the way all is along it: the plane whose gap grows, or shrinks, from there. */
static uz_status add_lines(uz_obstacle_pieces *out, uz_obstacle_piece arc, double from, double start, double length,
                           const double way[2], uz_error *err)
{
    uz_status status = UZ_OK;
    const double at = fmin(fmax(-start / length, from), arc.end), end = arc.end, sign = arc.inside ? -1 : 1;
    arc.round = false;
    for (int side = -1; side <= 1 && status == UZ_OK; side += 2) {
        arc.end = side < 0 ? at : end;
        for (int c = 0; c < 2; c++) {
            arc.normal[c] = -sign * side * way[c];
            arc.gap[c] = sign * (side * (start + c * length) - arc.radius);
        }
        if (side < 0 ? at > from : end > at)
            status = uz_obstacle_piece_add(out, &arc, err);
    }
    return status;
}

uz_status uz_obstacle_along(uz_obstacle_pieces *out, const uz_obstacle *o, const double *a, const double *b,
                            uz_error *err)
{
    uz_obstacle_pieces found = {.n = 0};
    const double from[2] = {a[0] * o->scale, a[1] * o->scale}, to[2] = {b[0] * o->scale, b[1] * o->scale};
    const double length = hypot(b[0] - a[0], b[1] - a[1]), way[2] = {(b[0] - a[0]) / length, (b[1] - a[1]) / length};
    if (!o->shape->along) {
        out->why = "is before an obstacle that is not of lines and arcs";
        return UZ_OK;
    }
    uz_status status = o->shape->along(&found, o, from, to, err);
    out->why = found.why ? found.why : out->why;
    double end = 0;
    for (int64_t i = 0; i < found.n && status == UZ_OK; i++) {
        uz_obstacle_piece piece = found.at[i];
        const double before = end;
        end = piece.end;
        for (int c = 0; c < 2; c++) { /* back to the caller's units */
            piece.gap[c] /= o->scale;
            piece.centre[c] /= o->scale;
        }
        piece.radius /= o->scale;
        const double off[2] = {a[0] - piece.centre[0], a[1] - piece.centre[1]};
        const double start = off[0] * way[0] + off[1] * way[1], aside = fabs(off[0] * way[1] - off[1] * way[0]);
        if (piece.round && aside <= ON_IT * length) {
            status = add_lines(out, piece, before, start, length, way, err);
            continue;
        }
        const double last = start + end * length;
        for (double t = start + before * length; piece.round && status == UZ_OK;) {
            if (last - t <= hypot(t > 0 ? t : last < 0 ? last : 0, aside))
                break;
            t = t < -aside ? t / 2 : t + fmax(aside, t); /* to the centre's foot, across it, or from there */
            piece.end = (t - start) / length;
            status = uz_obstacle_piece_add(out, &piece, err);
        }
        piece.end = end;
        if (status == UZ_OK)
            status = uz_obstacle_piece_add(out, &piece, err);
    }
    free(found.at);
    return status;
}
