/* table.c: the gap to a table of heights, bilinear in each cell of its grid. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/root.h"
#include "obstacle/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* z = z0 + a (x - x0) + b (y - y0) + c (x - x0)(y - y0) within low <= (x, y) <= high. An endless cell has its (x0, y0)
 * at its finite side and no slope towards infinity. */
typedef struct {
    double low[2], high[2], x0, y0, z0, a, b, c;
} cell;

static int64_t within(int64_t i, int64_t n)
{
    return i < 0 ? 0 : i < n ? i : n - 1;
}

static cell cell_of(const uz_table *t, int64_t item)
{
    const int64_t i = item % (t->n_x + 1) - 1, j = item / (t->n_x + 1) - 1;
    const int64_t i0 = within(i, t->n_x), i1 = within(i + 1, t->n_x), j0 = within(j, t->n_y),
                  j1 = within(j + 1, t->n_y);
    const double dx = i0 < i1 ? t->x[i1] - t->x[i0] : 1, dy = j0 < j1 ? t->y[j1] - t->y[j0] : 1;
    const double z00 = t->z[j0 * t->n_x + i0], z10 = t->z[j0 * t->n_x + i1];
    const double z01 = t->z[j1 * t->n_x + i0], z11 = t->z[j1 * t->n_x + i1];
    return (cell){.low = {i < 0 ? -INFINITY : t->x[i], j < 0 ? -INFINITY : t->y[j]},
                  .high = {i + 1 < t->n_x ? t->x[i + 1] : INFINITY, j + 1 < t->n_y ? t->y[j + 1] : INFINITY},
                  .x0 = t->x[i0],
                  .y0 = t->y[j0],
                  .z0 = z00,
                  .a = (z10 - z00) / dx,
                  .b = (z01 - z00) / dy,
                  .c = ((z11 - z01) - (z10 - z00)) / dx / dy};
}

static double height(const cell *s, double x, double y)
{
    return s->z0 + s->a * (x - s->x0) + (s->b + s->c * (x - s->x0)) * (y - s->y0);
}

/* The point of the cell closest to q among those of this x: there the surface is a straight line. */
static double best_y(const cell *s, const double q[3], double x)
{
    const double slope = s->b + s->c * (x - s->x0), base = s->z0 + s->a * (x - s->x0);
    const double along = (q[1] - s->y0 + slope * (q[2] - base)) / (1 + slope * slope);
    return fmin(fmax(s->y0 + along, s->low[1]), s->high[1]);
}

typedef struct {
    const cell *s;
    const double *q;
} cell_point;

/* Half the derivative along x of the squared distance at best_y: what y does to it is zero there, or y is held. */
static double slope_at(const void *ctx, double x)
{
    const cell_point *at = ctx;
    const cell *s = at->s;
    const double y = best_y(s, at->q, x);
    return x - at->q[0] + (height(s, x, y) - at->q[2]) * (s->a + s->c * (y - s->y0));
}

/* The closest (x, y) of a cell, and its squared distance. A bilinear cell may have two minima: the best of a few
 * samples along x shows in which stretch to look, and its neighbours are looked at too. */
static double closest(double at[2], const cell *s, const double q[3])
{
    enum { STRETCHES = 6 };
    double best = INFINITY;
    const bool flat = s->c == 0 && s->a == 0; /* along x, and so in endless cells */
    const int stretches = flat ? 0 : s->c == 0 ? 1 : STRETCHES;
    for (int k = -1; k < stretches; k++) { /* first straight above or below q */
        const double width = s->high[0] - s->low[0];
        const double low = s->low[0] + width * k / stretches;
        const double high = k + 1 < stretches ? s->low[0] + width * (k + 1) / stretches : s->high[0];
        const double x = k < 0 ? fmin(fmax(q[0], s->low[0]), s->high[0])
                               : uz_root_between(slope_at, &(cell_point){s, q}, low, high, 0);
        const double y = best_y(s, q, x), z = height(s, x, y);
        const double distance = (x - q[0]) * (x - q[0]) + (y - q[1]) * (y - q[1]) + (z - q[2]) * (z - q[2]);
        if (k < 0 || distance < best) {
            best = distance;
            at[0] = x;
            at[1] = y;
        }
    }
    return best;
}

static void box_of(double box[6], const cell *s)
{
    box[2] = INFINITY;
    box[5] = -INFINITY;
    for (int c = 0; c < 2; c++) {
        box[c] = s->low[c];
        box[3 + c] = s->high[c];
    }
    for (int k = 0; k < 4; k++) { /* a bilinear surface lies between the heights of its corners */
        const double x = k % 2 ? s->high[0] : s->low[0], y = k / 2 ? s->high[1] : s->low[1];
        const double z = height(s, isfinite(x) ? x : s->x0, isfinite(y) ? y : s->y0);
        box[2] = fmin(box[2], z);
        box[5] = fmax(box[5], z);
    }
}

static double distance_to(const void *ctx, int64_t item, const double *x, double best)
{
    const cell s = cell_of(ctx, item);
    double at[2], box[6];
    box_of(box, &s);
    return uz_box_distance(box, 3, x) > best ? INFINITY : closest(at, &s, x);
}

static void normal_at(double normal[3], const cell *s, double x, double y)
{
    const double zx = s->a + s->c * (y - s->y0), zy = s->b + s->c * (x - s->x0);
    const double length = sqrt(1 + zx * zx + zy * zy);
    normal[0] = -zx / length;
    normal[1] = -zy / length;
    normal[2] = 1 / length;
}

/* The mean of the normals that meet on a crease; INFINITY with the sign of its bulge, 0 where it is no crease: normals
 * turn apart over a ridge, towards each other over a groove. */
static double crease(double mean[3], const uz_table *t, const int64_t *around, int count, const double at[2])
{
    double normal[4][3], middle[4][2], apart = 0, least = 1, sum[3] = {0};
    for (int k = 0; k < count; k++) {
        const cell s = cell_of(t, around[k]);
        normal_at(normal[k], &s, at[0], at[1]);
        for (int c = 0; c < 3; c++)
            sum[c] += normal[k][c];
        for (int c = 0; c < 2; c++) /* one step from the point into the cell */
            middle[k][c] = at[c] == s.low[c] ? 1 : at[c] == s.high[c] ? -1 : 0;
    }
    for (int k = 1; k < count; k++) {
        double across = 0;
        for (int c = 0; c < 3; c++)
            across += (normal[k][c] - normal[0][c]) * (normal[k][c] - normal[0][c]);
        least = fmin(least, 1 - sqrt(across));
        for (int c = 0; c < 2; c++)
            apart += (normal[k][c] - normal[0][c]) * (middle[k][c] - middle[0][c]);
    }
    const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    for (int c = 0; c < 3; c++)
        mean[c] = sum[c] / length;
    return least >= 1 - UZ_SAME_DIRECTION ? 0 : apart < 0 ? -INFINITY : INFINITY;
}

static void gap_inside(uz_gap *out, const cell *s, const double q[3])
{
    out->gap = 0;
    normal_at(out->normal, s, out->foot[0], out->foot[1]);
    for (int c = 0; c < 3; c++)
        out->gap += (q[c] - out->foot[c]) * out->normal[c];
    /* the larger in size of the curvatures k / (1 + k gap) of the surface that is `gap` away from the cell's, k its
     * principal curvatures, counted positive where it bulges upwards (do Carmo, "Differential Geometry of Curves and
     * Surfaces", section 3-3: graphs) */
    const double zx = s->a + s->c * (out->foot[1] - s->y0), zy = s->b + s->c * (out->foot[0] - s->x0);
    const double w = 1 + zx * zx + zy * zy;
    const double mean = zx * zy * s->c / (w * sqrt(w)), gauss = -(s->c / w) * (s->c / w);
    const double root = sqrt(mean * mean - gauss), k1 = mean + root, k2 = mean - root;
    const double there1 = k1 / (1 + k1 * out->gap), there2 = k2 / (1 + k2 * out->gap);
    out->curvature = fabs(there2) > fabs(there1) ? there2 : there1;
}

/* The foot is on the border of its cell: the direction from it to q, unless rounding is all that is in it. */
static void gap_on_border(uz_gap *out, const uz_table *t, int64_t item, const cell *s, const double q[3])
{
    int64_t around[4];
    double mean[3], off[3], size = 0, distance = 0;
    /* the cells that touch at a point of the border of `item`: at most 4 */
    const int64_t row = t->n_x + 1;
    const int64_t dx = out->foot[0] == s->low[0] ? -1 : out->foot[0] == s->high[0] ? 1 : 0;
    const int64_t dy = out->foot[1] == s->low[1] ? -row : out->foot[1] == s->high[1] ? row : 0;
    int count = 0;
    around[count++] = item;
    if (dx != 0)
        around[count++] = item + dx;
    if (dy != 0)
        around[count++] = item + dy;
    if (dx != 0 && dy != 0)
        around[count++] = item + dx + dy;
    const double bulge = crease(mean, t, around, count, out->foot);
    if (bulge == 0) {
        gap_inside(out, s, q);
        return;
    }
    for (int c = 0; c < 3; c++) {
        off[c] = q[c] - out->foot[c];
        distance += off[c] * off[c];
        size += fabs(q[c]);
    }
    distance = sqrt(distance);
    const double sign = off[0] * mean[0] + off[1] * mean[1] + off[2] * mean[2] < 0 ? -1 : 1;
    const bool on = distance <= 8 * DBL_EPSILON * size;
    out->gap = on ? 0 : sign * distance;
    for (int c = 0; c < 3; c++)
        out->normal[c] = on ? mean[c] : sign * off[c] / distance;
    out->curvature = on ? bulge : sign / distance;
}

void uz_table_gap(uz_gap *out, const uz_table *table, const double x[3])
{
    const int64_t item = uz_box_tree_nearest(&table->tree, x, INFINITY, distance_to, table);
    if (item < 0) {
        out->gap = NAN;
        return;
    }
    const cell s = cell_of(table, item);
    closest(out->foot, &s, x);
    out->foot[2] = height(&s, out->foot[0], out->foot[1]);
    if (out->foot[0] > s.low[0] && out->foot[0] < s.high[0] && out->foot[1] > s.low[1] && out->foot[1] < s.high[1])
        gap_inside(out, &s, x);
    else
        gap_on_border(out, table, item, &s, x);
}

static double *scaled_copy(const double *values, int64_t n, double scale)
{
    double *copy = uz_alloc(n, sizeof *copy);
    for (int64_t i = 0; copy && i < n; i++)
        copy[i] = values[i] * scale;
    return copy;
}

uz_status uz_table_init(uz_table *out, const uz_contact *contact, double scale, uz_error *err)
{
    *out = (uz_table){.n_x = contact->n_x, .n_y = contact->n_y};
    out->x = scaled_copy(contact->x, contact->n_x, scale);
    out->y = scaled_copy(contact->y, contact->n_y, scale);
    out->z = scaled_copy(contact->z, contact->n_x * contact->n_y, scale);
    const int64_t cells = (out->n_x + 1) * (out->n_y + 1);
    double *box = uz_alloc(cells, 6 * sizeof *box);
    uz_status status = UZ_OK;
    if (!box || !out->x || !out->y || !out->z)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a table of %lld heights", (long long)cells);
    for (int64_t i = 0; status == UZ_OK && i < cells; i++) {
        const cell s = cell_of(out, i);
        box_of(box + 6 * i, &s);
    }
    if (status == UZ_OK)
        status = uz_box_tree_init(&out->tree, cells, 3, box, err);
    free(box);
    if (status != UZ_OK)
        uz_table_clear(out);
    return status;
}

void uz_table_clear(uz_table *table)
{
    uz_free_all(table->x, table->y, table->z);
    uz_box_tree_clear(&table->tree);
    memset(table, 0, sizeof *table);
}
