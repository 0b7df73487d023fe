/* line.c: the gap to a polyline, the obstacle on its right. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "obstacle/pieces.h"
#include "obstacle/shape.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_line_piece uz_line_piece_of(const uz_line *line, int64_t i)
{
    const double *p = line->point + 2 * (i > 0 ? i - 1 : 0), *t = line->tangent + 2 * i;
    if (i == 0)
        return (uz_line_piece){p, t, -INFINITY, 0};
    if (i == line->n)
        return (uz_line_piece){p, t, 0, INFINITY};
    return (uz_line_piece){p, t, 0, hypot(p[2] - p[0], p[3] - p[1])};
}

/* The closest point of a piece: the number of a point of the line, or -1 within the piece. */
static int64_t closest(double foot[2], const uz_line *line, int64_t i, const double x[2])
{
    const uz_line_piece p = uz_line_piece_of(line, i);
    const double off[2] = {x[0] - p.origin[0], x[1] - p.origin[1]}, along = uz_dot2(off, p.tangent);
    const double rounding = 4 * DBL_EPSILON * (fabs(x[0]) + fabs(x[1]));
    int64_t corner = -1;
    if (along <= p.first + rounding)
        corner = i - 1;
    else if (along >= p.last - rounding)
        corner = i;
    for (int c = 0; c < 2; c++)
        foot[c] = corner >= 0 ? line->point[2 * corner + c] : p.origin[c] + along * p.tangent[c];
    return corner;
}

double uz_line_distance(const void *ctx, int64_t item, const double *x, double best)
{
    (void)best;
    const uz_line *line = ctx;
    const int64_t i = item + line->closed;
    double foot[2];
    if (closest(foot, line, i, x) < 0) {
        const uz_line_piece p = uz_line_piece_of(line, i);
        const double off[2] = {x[0] - p.origin[0], x[1] - p.origin[1]}, height = uz_cross2(p.tangent, off);
        return height * height;
    }
    return (x[0] - foot[0]) * (x[0] - foot[0]) + (x[1] - foot[1]) * (x[1] - foot[1]);
}

void uz_line_meet(int64_t meet[2], const uz_line *line, int64_t corner)
{
    meet[0] = line->closed && corner == 0 ? line->n - 1 : corner;
    meet[1] = line->closed && corner == line->n - 1 ? 1 : corner + 1;
}

static void gap_to_piece(uz_gap *out, const uz_line *line, int64_t i, const double x[2])
{
    const uz_line_piece p = uz_line_piece_of(line, i);
    out->normal[0] = -p.tangent[1];
    out->normal[1] = p.tangent[0];
    const double off[2] = {x[0] - p.origin[0], x[1] - p.origin[1]};
    out->gap = uz_dot2(off, out->normal);
    out->curvature = 0;
}

uz_status uz_line_gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    const uz_line *line = o->own;
    (void)err;
    const int64_t item = uz_box_tree_nearest(&line->tree, x, INFINITY, uz_line_distance, line);
    const int64_t i = item + line->closed;
    if (item < 0) {
        out->gap = NAN;
        return UZ_OK;
    }
    const int64_t corner = closest(out->foot, line, i, x);
    out->foot[2] = out->normal[2] = 0;
    if (corner < 0) {
        gap_to_piece(out, line, i, x);
        return UZ_OK;
    }
    int64_t meet[2];
    uz_line_meet(meet, line, corner);
    const double *a = line->tangent + 2 * meet[0], *b = line->tangent + 2 * meet[1], turn = uz_cross2(a, b);
    if (fabs(turn) <= UZ_SAME_DIRECTION) {
        gap_to_piece(out, line, meet[0], x);
        return UZ_OK;
    }
    /* inside or outside by the sum of both normals, which is on the outer side of any corner */
    const double *at = line->point + 2 * corner;
    const double off[2] = {x[0] - at[0], x[1] - at[1]}, mean[2] = {-a[1] - b[1], a[0] + b[0]};
    const double distance = hypot(off[0], off[1]), length = hypot(mean[0], mean[1]);
    const double size = fabs(x[0]) + fabs(x[1]), sign = uz_dot2(off, mean) < 0 ? -1 : 1;
    const bool on = distance <= 4 * DBL_EPSILON * size;
    for (int c = 0; c < 2; c++)
        out->normal[c] = on ? mean[c] / length : sign * off[c] / distance;
    out->gap = on ? uz_dot2(off, out->normal) : sign * distance;
    out->curvature = on ? (turn < 0 ? INFINITY : -INFINITY) : sign / distance;
    return UZ_OK;
}

static void box_of(double box[4], const uz_line *line, int64_t i)
{
    const uz_line_piece p = uz_line_piece_of(line, i);
    for (int c = 0; c < 2; c++) {
        const double a = p.tangent[c] == 0 ? p.origin[c] : p.origin[c] + p.first * p.tangent[c];
        const double b = p.tangent[c] == 0 ? p.origin[c] : p.origin[c] + p.last * p.tangent[c];
        const double end = i > 0 && i < line->n ? p.origin[2 + c] : a;
        box[c] = fmin(fmin(a, b), end);
        box[2 + c] = fmax(fmax(a, b), end);
    }
}

uz_status uz_line_init(uz_line *out, int64_t n, const double *x, const double *y, const double *ends, double scale,
                       uz_error *err)
{
    *out = (uz_line){.n = n, .closed = !ends && x[0] == x[n - 1] && y[0] == y[n - 1]};
    const int64_t items = n < INT64_MAX ? n + 1 - (out->closed ? 2 : 0) : -1;
    double *box = uz_alloc(items, 4 * sizeof *box);
    out->point = uz_alloc(n, 2 * sizeof *out->point);
    out->tangent = uz_alloc(n < INT64_MAX ? n + 1 : -1, 2 * sizeof *out->tangent);
    if (!box || !out->point || !out->tangent) {
        free(box);
        uz_line_clear(out);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a polyline of %lld points", (long long)n);
    }
    for (int64_t i = 0; i < n; i++) {
        out->point[2 * i] = x[i] * scale;
        out->point[2 * i + 1] = y[i] * scale;
    }
    for (int64_t i = 1; i < n; i++) {
        const double *a = out->point + 2 * i - 2, *b = a + 2, length = hypot(b[0] - a[0], b[1] - a[1]);
        for (int c = 0; c < 2; c++)
            out->tangent[2 * i + c] = (b[c] - a[c]) / length;
    }
    memcpy(out->tangent, ends ? ends : out->tangent + 2, 2 * sizeof *ends);
    memcpy(out->tangent + 2 * n, ends ? ends + 2 : out->tangent + 2 * n - 2, 2 * sizeof *ends);
    for (int64_t i = 0; i < items; i++)
        box_of(box + 4 * i, out, i + out->closed);
    const uz_status status = uz_box_tree_init(&out->tree, items, 2, box, err);
    free(box);
    if (status != UZ_OK)
        uz_line_clear(out);
    return status;
}

void uz_line_clear(uz_line *line)
{
    uz_free_all(line->point, line->tangent);
    uz_box_tree_clear(&line->tree);
    memset(line, 0, sizeof *line);
}

typedef struct {
    const uz_line *line;
    int64_t i, found;
    int64_t left; /* pairs that may still be looked at */
} crossing;

static bool visit_pair(void *ctx, int64_t item)
{
    crossing *search = ctx;
    const uz_line *line = search->line;
    const int64_t i = search->i, j = item + line->closed;
    bool meet;
    if (j <= i)
        return false;
    if (search->left-- <= 0)
        return true;
    const uz_line_piece a = uz_line_piece_of(line, i), b = uz_line_piece_of(line, j);
    const double between[2] = {b.origin[0] - a.origin[0], b.origin[1] - a.origin[1]};
    const double turn = uz_cross2(a.tangent, b.tangent);
    if (j == i + 1 || (line->closed && i == 1 && j == line->n - 1)) { /* they share a point, and may only fold back */
        meet = uz_dot2(a.tangent, b.tangent) < 0 && fabs(turn) <= UZ_SAME_DIRECTION;
    } else if (fabs(turn) <= UZ_SAME_DIRECTION) { /* parallel pieces: where they lie on one another */
        const double sign = uz_dot2(a.tangent, b.tangent) < 0 ? -1 : 1, from = uz_dot2(between, a.tangent);
        const double low = from + (sign > 0 ? b.first : -b.last), high = from + (sign > 0 ? b.last : -b.first);
        meet = fabs(uz_cross2(between, a.tangent)) <= UZ_SAME_DIRECTION * hypot(between[0], between[1]) &&
               low <= a.last && high >= a.first;
    } else {
        const double s = uz_cross2(between, b.tangent) / turn, t = uz_cross2(between, a.tangent) / turn;
        meet = s >= a.first && s <= a.last && t >= b.first && t <= b.last;
    }
    search->found = meet ? j : search->found;
    return meet;
}

bool uz_line_crosses(int64_t pair[2], const uz_line *line)
{
    crossing search = {.line = line, .found = -1, .left = UZ_LINE_PAIRS * line->n};
    for (int64_t item = 0; item < line->tree.n && search.left > 0; item++) {
        double box[4];
        search.i = item + line->closed;
        box_of(box, line, search.i);
        if (uz_box_tree_meet(&line->tree, box, visit_pair, &search) && search.found >= 0) {
            pair[0] = search.i;
            pair[1] = search.found;
            return true;
        }
    }
    return false;
}

int64_t uz_line_outline(double x[2], double way[2], const uz_contact *contact, int64_t i)
{
    const bool heights = contact->kind == UZ_OBSTACLE_HEIGHT;
    const double *y = heights ? contact->z : contact->y;
    const int64_t n = contact->n_x, near = i == 0 ? 1 : n - 2;
    x[0] = contact->x[i];
    x[1] = y[i];
    way[0] = contact->x[i] - contact->x[near];
    way[1] = heights ? 0 : y[i] - y[near];
    return n;
}

void uz_pieces_clear(uz_obstacle *o)
{
    if (o->own && o->dim == 2)
        uz_line_clear(o->own);
    else if (o->own)
        uz_table_clear(o->own);
    free(o->own);
}
