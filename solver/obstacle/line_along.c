/* line_along.c: what of a polyline is before a straight way.
 *
 * The closest point of the line is on one of its pieces or corners, and changes where two are as close. A distance
 * grows by no more than the way: along a part of the way of length l with the middle m only what is no farther from m
 * than the closest piece and l can be closest. Where these are few their distances are compared, else the part is
 * halved. Between the roots of all differences of squared distances, which are quadratic polynomials, one of them is
 * the least. */
#include "core/order.h"
#include "core/vector3.h"
#include "obstacle/pieces.h"
#include "obstacle/shape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* So many pieces are few, and most that are compared; a way is halved so often. */
enum { FEW = 6, MOST = 24, HALVINGS = 30 };

/* In sizes of coordinates: distances that are the same but for rounding; in parts of the way: parts that are nothing,
 * and such as are something. */
#define SAME    1e-13
#define NOTHING 1e-13
#define AS_FAR  1e-7
/* In sizes of coordinates and in distances from the way: points of the obstacle that are apart. Closer ones on a curve
 * of many pieces are as far away but for rounding. */
#define ELSEWHERE 1e-5

/* What may be closest: a piece between its ends, or a corner. Along the way at q. */
typedef struct {
    bool corner;
    int64_t number;
    double low, high; /* a piece's part of the way */
    double off[2];    /* from the corner, or the piece's origin, at q = 0 */
    uz_line_piece piece;
} feature;

typedef struct {
    const uz_line *line;
    const double *from;
    double way[2], length, size;
    uz_obstacle_pieces *out;
    feature last; /* of the piece that was found last */
    bool any;
    double middle[2], reach; /* what is collected: pieces so close */
    int64_t n, piece[MOST];
} walk;

static double distance_at(const walk *w, const feature *f, double q)
{
    const double x[2] = {f->off[0] + q * w->way[0], f->off[1] + q * w->way[1]};
    return f->corner ? hypot(x[0], x[1]) : fabs(uz_cross2(f->piece.tangent, x));
}

/* ... of a piece from its ends, where it ended before. */
static double distance_from(const walk *w, const feature *f, double q)
{
    const double x[2] = {f->off[0] + q * w->way[0], f->off[1] + q * w->way[1]};
    const double along = f->corner ? 0 : uz_dot2(f->piece.tangent, x);
    return f->corner
               ? hypot(x[0], x[1])
               : hypot(uz_cross2(f->piece.tangent, x), fmax(0, fmax(f->piece.first - along, along - f->piece.last)));
}

static bool same(const feature *a, const feature *b)
{
    return a->corner == b->corner && a->number == b->number;
}

static uz_status emit(walk *w, const feature *f, double from, double end, uz_error *err)
{
    const uz_line *line = w->line;
    uz_obstacle_piece piece = {.end = end};
    int64_t meet[2];
    if (w->any && same(&w->last, f)) {
        w->out->at[w->out->n - 1].end = end;
        return UZ_OK;
    }
    w->any = true;
    w->last = *f;
    uz_line_meet(meet, line, f->number);
    const double *a = line->tangent + 2 * meet[0], *b = line->tangent + 2 * meet[1];
    if (f->corner && fabs(uz_cross2(a, b)) > UZ_SAME_DIRECTION) {
        const double q = (from + end) / 2, mean[2] = {-a[1] - b[1], a[0] + b[0]};
        const double off[2] = {f->off[0] + q * w->way[0], f->off[1] + q * w->way[1]};
        piece.round = true;
        piece.inside = uz_dot2(off, mean) < 0;
        memcpy(piece.centre, line->point + 2 * f->number, sizeof piece.centre);
        return uz_obstacle_piece_add(w->out, &piece, err);
    }
    const uz_line_piece of = uz_line_piece_of(line, f->corner ? meet[0] : f->number);
    piece.normal[0] = of.tangent[1];
    piece.normal[1] = -of.tangent[0];
    for (int c = 0; c < 2; c++) {
        const double off[2] = {w->from[0] + c * w->way[0] - of.origin[0], w->from[1] + c * w->way[1] - of.origin[1]};
        piece.gap[c] = -uz_dot2(off, piece.normal);
    }
    return uz_obstacle_piece_add(w->out, &piece, err);
}

/* ---- a part of the way */

static bool collect(void *ctx, int64_t item)
{
    walk *w = ctx;
    if (sqrt(uz_line_distance(w->line, item, w->middle, INFINITY)) > w->reach)
        return false;
    if (w->n < MOST)
        w->piece[w->n] = item + w->line->closed;
    return ++w->n > MOST;
}

/* The pieces that were collected, and their ends; returns how many. */
static int list(feature f[3 * MOST], const walk *w)
{
    int n = 0;
    for (int64_t k = 0; k < w->n; k++) {
        const uz_line_piece p = uz_line_piece_of(w->line, w->piece[k]);
        feature own = {.number = w->piece[k], .piece = p, .low = -INFINITY, .high = INFINITY};
        for (int c = 0; c < 2; c++)
            own.off[c] = w->from[c] - p.origin[c];
        const double slope = uz_dot2(w->way, p.tangent), start = uz_dot2(own.off, p.tangent);
        const double ends[2] = {(p.first - start) / slope, (p.last - start) / slope};
        if (fabs(slope) > 0) {
            own.low = fmin(ends[0], ends[1]);
            own.high = fmax(ends[0], ends[1]);
        }
        if (fabs(slope) > 0 || (start >= p.first && start <= p.last))
            f[n++] = own;
    }
    for (int64_t k = 0; k < 2 * w->n; k++) {
        const int64_t i = w->piece[k / 2] - 1 + k % 2;
        const int64_t number = w->line->closed && i == w->line->n - 1 ? 0 : i;
        feature own = {.corner = true, .number = number};
        bool known = i < 0 || i >= w->line->n;
        for (int j = 0; j < n && !known; j++)
            known = same(&f[j], &own);
        for (int c = 0; c < 2 && !known; c++)
            own.off[c] = w->from[c] - w->line->point[2 * number + c];
        if (!known)
            f[n++] = own;
    }
    return n;
}

/* A piece before its corners, which are as close where it ends. */
static int closest(const walk *w, const feature *f, int n, double q)
{
    int best = -1;
    double least = INFINITY;
    for (int k = 0; k < n; k++) {
        const double distance = distance_at(w, &f[k], q);
        if ((f[k].corner || (q >= f[k].low && q <= f[k].high)) && distance < least - (best < 0 ? 0 : SAME * w->size)) {
            least = distance;
            best = k;
        }
    }
    return best;
}

/* Is another one as close there, with its closest point elsewhere? */
static bool is_torn(const walk *w, const feature *f, int n, int best, double q)
{
    const double least = distance_at(w, &f[best], q);
    double foot[2][2];
    for (int k = 0; k < n; k++) {
        if (!(distance_at(w, &f[k], q) <= least + SAME * w->size) || (!f[k].corner && (q < f[k].low || q > f[k].high)))
            continue;
        for (int j = 0; j < 2; j++) {
            const feature *of = &f[j == 0 ? best : k];
            const double x[2] = {of->off[0] + q * w->way[0], of->off[1] + q * w->way[1]};
            const double height = of->corner ? 0 : uz_cross2(of->piece.tangent, x);
            for (int c = 0; c < 2; c++)
                foot[j][c] = of->corner ? x[c]
                             : c == 0   ? -height * of->piece.tangent[1]
                                        : height * of->piece.tangent[0];
        }
        const double apart = hypot(foot[1][0] - foot[0][0], foot[1][1] - foot[0][1]);
        if (apart > ELSEWHERE * w->size && apart > ELSEWHERE * least)
            return true;
    }
    return false;
}

/* Places between `low` and `high`, beyond *n of them, where a and b are as close. */
static void add_roots(double *at, int *n, const walk *w, const feature *a, const feature *b, double low, double high)
{
    double p[3] = {0}; /* of squares, in q from the middle of the part, where they are of one size */
    const double m = (low + high) / 2;
    for (int k = 0; k < 2; k++) {
        const feature *f = k == 0 ? a : b;
        const double x[2] = {f->off[0] + m * w->way[0], f->off[1] + m * w->way[1]}, sign = k == 0 ? 1 : -1;
        const double h = f->corner ? 0 : uz_cross2(f->piece.tangent, x),
                     s = f->corner ? 0 : uz_cross2(f->piece.tangent, w->way);
        p[0] += sign * (f->corner ? uz_dot2(x, x) : h * h);
        p[1] += sign * 2 * (f->corner ? uz_dot2(x, w->way) : h * s);
        p[2] += sign * (f->corner ? uz_dot2(w->way, w->way) : s * s);
    }
    const double half = -p[1] / 2, root = sqrt(fmax(0, half * half - p[0] * p[2]));
    const double larger = half + (half < 0 ? -root : root);
    const double roots[2] = {larger / p[2], p[0] / larger};
    for (int k = 0; k < 2; k++)
        if (roots[k] > low - m && roots[k] < high - m)
            at[(*n)++] = m + roots[k];
}

/* From where a is the closest, at `low`, to where b is. */
static double boundary(const walk *w, const feature *a, const feature *b, double low, double high)
{
    for (int k = 0; k < 2; k++) { /* a corner takes over where a piece ends */
        const feature *piece = k == 0 ? a : b, *corner = k == 0 ? b : a;
        const double at = k == 0 ? piece->high : piece->low;
        if (!piece->corner && corner->corner && at >= low && at <= high)
            return at;
    }
    for (int k = 0; k < 60; k++) {
        const double q = (low + high) / 2;
        if (distance_from(w, a, q) <= distance_from(w, b, q))
            low = q;
        else
            high = q;
    }
    return (low + high) / 2;
}

static uz_status compare(walk *w, double low, double high, uz_error *err)
{
    feature f[3 * MOST + 1];
    double at[3 * MOST * (3 * MOST + 1) + 2];
    int m = 0, before = -1;
    double began = low, seen = low;
    const int n = list(f, w);
    uz_status status = UZ_OK;
    at[m++] = low;
    for (int k = 0; k < n; k++) {
        const double ends[2] = {f[k].low, f[k].high};
        for (int i = 0; i < 2 && !f[k].corner; i++)
            if (ends[i] > low && ends[i] < high)
                at[m++] = ends[i];
        for (int j = 0; j < k; j++)
            add_roots(at, &m, w, &f[j], &f[k], low, high);
    }
    at[m++] = high;
    qsort(at, (size_t)m, sizeof *at, uz_ascending_real);
    for (int k = 1; k < m && status == UZ_OK; k++) {
        const double q = (at[k] + at[k - 1]) / 2;
        if (!(at[k] - at[k - 1] > NOTHING))
            continue;
        const int best = closest(w, f, n, q);
        if (at[k] - at[k - 1] > AS_FAR && is_torn(w, f, n, best, q))
            w->out->why = "is as far from two parts of the obstacle";
        if (before >= 0 && best != before) {
            const double end = boundary(w, &f[before], &f[best], seen, q);
            status = emit(w, &f[before], began, end, err);
            began = end;
        }
        before = best;
        seen = q;
    }
    return status == UZ_OK && before >= 0 ? emit(w, &f[before], began, high, err) : status;
}

static uz_status walk_part(walk *w, double low, double high, int halvings, uz_error *err)
{
    const double l = (high - low) * w->length, q = (low + high) / 2;
    for (int c = 0; c < 2; c++)
        w->middle[c] = w->from[c] + q * w->way[c];
    const int64_t nearest = uz_box_tree_nearest(&w->line->tree, w->middle, INFINITY, uz_line_distance, w->line);
    if (nearest < 0)
        w->out->why = "is too far from the obstacle";
    if (w->out->why)
        return UZ_OK;
    w->reach = sqrt(uz_line_distance(w->line, nearest, w->middle, INFINITY)) + l + 1e-9 * w->size;
    const double box[4] = {w->middle[0] - w->reach, w->middle[1] - w->reach, w->middle[0] + w->reach,
                           w->middle[1] + w->reach};
    w->n = 0;
    uz_box_tree_meet(&w->line->tree, box, collect, w);
    if (w->n > FEW && halvings > 0 && (w->n > MOST || halvings > HALVINGS / 2)) {
        const uz_status status = walk_part(w, low, q, halvings - 1, err);
        return status == UZ_OK ? walk_part(w, q, high, halvings - 1, err) : status;
    }
    if (w->n > MOST) {
        w->out->why = "is as far from many parts of the obstacle";
        return UZ_OK;
    }
    return compare(w, low, high, err);
}

uz_status uz_line_along(uz_obstacle_pieces *out, const uz_obstacle *o, const double a[2], const double b[2],
                        uz_error *err)
{
    walk w = {.line = o->own, .from = a, .way = {b[0] - a[0], b[1] - a[1]}, .out = out};
    w.length = hypot(w.way[0], w.way[1]);
    for (int c = 0; c < 2; c++)
        w.size = fmax(w.size, fmax(fabs(a[c]), fabs(b[c])));
    return walk_part(&w, 0, 1, HALVINGS, err);
}
