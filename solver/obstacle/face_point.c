#include "obstacle/face_point.h"

#include "core/vector3.h"
#include "element/element.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A foot closer to the border than this part of the face's size is on it. */
#define SNAP 1e-9

/* ------------------------------------------------------------------ edges */

/* x(s) = a + b s + c s^2, -1 <= s <= 1: two ends and perhaps a middle. */
typedef struct {
    double a[3], b[3], c[3];
} curve;

static curve curve_of(const double *p, const double *q, const double *middle, int dim)
{
    curve k = {{0}, {0}, {0}};
    for (int i = 0; i < dim; i++) {
        const double mean = 0.5 * (p[i] + q[i]);
        k.a[i] = middle ? middle[i] : mean;
        k.b[i] = 0.5 * (q[i] - p[i]);
        k.c[i] = mean - k.a[i];
    }
    return k;
}

static void curve_at(double x[3], const curve *k, double s)
{
    for (int i = 0; i < 3; i++)
        x[i] = k->a[i] + s * (k->b[i] + s * k->c[i]);
}

/* Half the derivative of the squared distance, and half the second one. */
static double curve_slope(double *second, const curve *k, double s)
{
    double x[3], t[3];
    curve_at(x, k, s);
    for (int i = 0; i < 3; i++)
        t[i] = k->b[i] + 2 * s * k->c[i];
    *second = uz_dot3(t, t) + 2 * uz_dot3(x, k->c);
    return uz_dot3(x, t);
}

static double closest_on_curve(const curve *k)
{
    enum { SAMPLES = 8 };
    double second, best = INFINITY, at = 0;
    if (uz_dot3(k->c, k->c) <= DBL_EPSILON * DBL_EPSILON * uz_dot3(k->b, k->b))
        return fmin(fmax(-uz_dot3(k->a, k->b) / uz_dot3(k->b, k->b), -1), 1);
    for (int i = 0; i <= SAMPLES; i++) {
        const double s = 2.0 * i / SAMPLES - 1;
        double x[3];
        curve_at(x, k, s);
        if (uz_dot3(x, x) < best) {
            best = uz_dot3(x, x);
            at = s;
        }
    }
    double low = fmax(at - 2.0 / SAMPLES, -1), high = fmin(at + 2.0 / SAMPLES, 1);
    if (curve_slope(&second, k, low) >= 0)
        return low;
    if (curve_slope(&second, k, high) <= 0)
        return high;
    /* Newton within a bracket, halved where a step leaves it. */
    double s = 0.5 * (low + high);
    for (int step = 0; step < 60 && high - low > DBL_EPSILON; step++) {
        const double slope = curve_slope(&second, k, s);
        if (slope < 0)
            low = s;
        else
            high = s;
        const double next = s - slope / second;
        if (next == s || slope == 0)
            return s;
        s = next > low && next < high ? next : 0.5 * (low + high);
    }
    return s;
}

/* --------------------------------------------------------------- surfaces */

typedef struct {
    const uz_element_type *type;
    double x[UZ_FACE_NODES][3];
} surface;

/* The point at these coordinates, its shape functions and tangents; N and T may be NULL. */
static void surface_at(double x[3], double *N, double T[2][3], const surface *f, const double at[2])
{
    double values[UZ_FACE_NODES], slope[UZ_FACE_NODES][3];
    const double point[3] = {at[0], at[1], 0};
    N = N ? N : values;
    f->type->shape(f->type, N, T ? slope : NULL, point);
    for (int c = 0; c < 3; c++) {
        x[c] = 0;
        for (int i = 0; i < f->type->nodes; i++)
            x[c] += N[i] * f->x[i][c];
        for (int k = 0; k < 2 && T; k++) {
            T[k][c] = 0;
            for (int i = 0; i < f->type->nodes; i++)
                T[k][c] += slope[i][k] * f->x[i][c];
        }
    }
}

/* How far outside the face's own coordinates; < 0 within. */
static double outside(const surface *f, const double at[2])
{
    if (f->type->corners == 4)
        return fmax(fabs(at[0]), fabs(at[1])) - 1;
    return fmax(fmax(-at[0], -at[1]), at[0] + at[1] - 1);
}

/* The Newton step of half the squared distance; Gauss-Newton's where the former would not go down. */
static void newton_step(double step[2], const surface *f, const double at[2])
{
    double x[3], T[2][3], aa[3], ab[3], bb[3];
    const double *ta = T[0], *tb = T[1];
    surface_at(x, NULL, T, f, at);
    /* second derivatives of the position: the same everywhere on a face of at most six nodes. Where p, q are the own
     * coordinates of one of eight nodes, those of (1 + p a) (1 + q b) (p a + q b - 1) / 4 at corners and of
     * (1 - a^2) (1 + q b) / 2 or (1 - b^2) (1 + p a) / 2 between them */
    const int nodes = f->type->nodes;
    for (int c = 0; c < 3; c++) {
        const double y[6] = {f->x[0][c], f->x[1][c], f->x[2][c], f->x[3][c], f->x[4][c], f->x[5][c]};
        aa[c] = nodes == 6 ? 4 * (y[0] + y[1] - 2 * y[3]) : 0;
        bb[c] = nodes == 6 ? 4 * (y[0] + y[2] - 2 * y[5]) : 0;
        ab[c] = nodes == 6 ? 4 * (y[0] - y[3] + y[4] - y[5]) : nodes == 4 ? 0.25 * (y[0] - y[1] + y[2] - y[3]) : 0;
    }
    for (int i = 0; i < nodes && nodes == 8; i++) {
        const double p = f->type->local[i][0], q = f->type->local[i][1], a = at[0], b = at[1];
        const double along_a = p == 0 ? -(1 + q * b) : q == 0 ? 0 : 0.5 * (1 + q * b);
        const double along_b = q == 0 ? -(1 + p * a) : p == 0 ? 0 : 0.5 * (1 + p * a);
        const double mixed = p == 0 ? -a * q : q == 0 ? -b * p : 0.25 * p * q * (1 + 2 * p * a + 2 * q * b);
        for (int c = 0; c < 3; c++) {
            aa[c] += along_a * f->x[i][c];
            ab[c] += mixed * f->x[i][c];
            bb[c] += along_b * f->x[i][c];
        }
    }
    const double ga = uz_dot3(x, ta), gb = uz_dot3(x, tb);
    double haa = uz_dot3(ta, ta) + uz_dot3(x, aa), hab = uz_dot3(ta, tb) + uz_dot3(x, ab),
           hbb = uz_dot3(tb, tb) + uz_dot3(x, bb);
    if (!(haa > 0 && haa * hbb - hab * hab > 1e-6 * haa * hbb)) {
        haa = uz_dot3(ta, ta);
        hab = uz_dot3(ta, tb);
        hbb = uz_dot3(tb, tb);
    }
    const double determinant = haa * hbb - hab * hab;
    step[0] = -(hbb * ga - hab * gb) / determinant;
    step[1] = -(haa * gb - hab * ga) / determinant;
}

/* From the best of a few samples down to a minimum of the distance. False: the way leads out of the face. */
static bool descend(double at[2], const surface *f)
{
    enum { STEPS = 50, HALVINGS = 30 };
    static const double SMALL = 1e-5; /* the distance is too flat there to tell whether such a step goes down */
    static const double TRIANGLE[7][2] = {{1. / 3, 1. / 3}, {0.1, 0.1},   {0.8, 0.1}, {0.1, 0.8},
                                          {0.45, 0.1},      {0.45, 0.45}, {0.1, 0.45}};
    const int starts = f->type->nodes == 3 ? 1 : f->type->nodes == 6 ? 7 : 9;
    double x[3], distance = INFINITY;
    for (int i = 0; i < starts; i++) {
        const int column = i % 3, line = i / 3;
        const double grid[2] = {0.7 * (column - 1), 0.7 * (line - 1)};
        const double *start = f->type->corners == 4 ? grid : TRIANGLE[i];
        surface_at(x, NULL, NULL, f, start);
        if (uz_dot3(x, x) < distance) {
            distance = uz_dot3(x, x);
            memcpy(at, start, sizeof grid);
        }
    }
    for (int k = 0; k < STEPS; k++) {
        double step[2], next[2], there = INFINITY, part = 1;
        newton_step(step, f, at);
        if (!isfinite(step[0]) || !isfinite(step[1]))
            return false;
        for (int halving = 0; halving < HALVINGS; halving++, part *= 0.5) {
            next[0] = at[0] + part * step[0];
            next[1] = at[1] + part * step[1];
            surface_at(x, NULL, NULL, f, next);
            there = uz_dot3(x, x);
            if (there <= distance || fabs(step[0]) + fabs(step[1]) < SMALL)
                break;
        }
        if (!isfinite(there))
            return false;
        memcpy(at, next, sizeof next);
        distance = there;
        if (outside(f, at) > 0.5)
            return false;
        if (part * (fabs(step[0]) + fabs(step[1])) <= 2 * DBL_EPSILON)
            break;
    }
    return outside(f, at) < 0;
}

/* ---------------------------------------------------------------- both */

int uz_face_corners(int dim, int count)
{
    return dim == 2 ? 2 : count % 4 == 0 ? 4 : 3;
}

/* The closest point of the border; its squared distance is returned, its place in *out. */
static double closest_on_border(uz_foot *out, const surface *f, double x[3])
{
    const int corners = f->type->corners;
    double best = INFINITY;
    for (int edge = 0; edge < corners; edge++) {
        const int next = (edge + 1) % corners;
        const curve k = curve_of(f->x[edge], f->x[next], f->type->nodes > corners ? f->x[corners + edge] : NULL, 3);
        double s = closest_on_curve(&k);
        s = s >= 1 - SNAP ? 1 : s <= -1 + SNAP ? -1 : s;
        double there[3];
        curve_at(there, &k, s);
        if (!(uz_dot3(there, there) < best))
            continue;
        best = uz_dot3(there, there);
        memcpy(x, there, sizeof there);
        const double *from = f->type->local[edge], *to = f->type->local[next];
        for (int c = 0; c < 2; c++)
            out->local[c] = s == -1 ? from[c] : s == 1 ? to[c] : 0.5 * ((1 - s) * from[c] + (1 + s) * to[c]);
        out->place = fabs(s) == 1 ? UZ_FACE_CORNER : UZ_FACE_EDGE;
        out->which = s == 1 ? next : edge;
    }
    return best;
}

void uz_face_closest(uz_foot *out, int dim, int count, const double *xyz)
{
    double normal[3] = {0};
    memset(out, 0, sizeof *out);
    if (dim == 2) {
        const curve k = curve_of(xyz, xyz + 2, count == 3 ? xyz + 4 : NULL, 2);
        double s = closest_on_curve(&k);
        s = s >= 1 - SNAP ? 1 : s <= -1 + SNAP ? -1 : s;
        out->local[0] = s;
        out->place = fabs(s) == 1 ? UZ_FACE_CORNER : UZ_FACE_WITHIN;
        out->which = s == 1;
        const double bubble = count == 3 ? 1 - s * s : 0;
        out->weight[0] = 0.5 * (1 - s) - 0.5 * bubble;
        out->weight[1] = 0.5 * (1 + s) - 0.5 * bubble;
        out->weight[2] = bubble;
        curve_at(out->point, &k, s);
        normal[0] = k.b[1] + 2 * s * k.c[1];
        normal[1] = -(k.b[0] + 2 * s * k.c[0]);
    } else {
        surface f = {.type = uz_face_type(count), .x = {{0}}};
        double at[2] = {0}, border[3], T[2][3];
        memcpy(f.x, xyz, (size_t)count * sizeof f.x[0]);
        const double distance = closest_on_border(out, &f, border);
        if (descend(at, &f)) {
            double x[3], off[3], size = 0;
            surface_at(x, NULL, NULL, &f, at);
            for (int c = 0; c < 3; c++) {
                off[c] = x[c] - border[c];
                size = fmax(size, fabs(f.x[1][c] - f.x[0][c]));
            }
            /* nearer than the point of the border by more than rounding */
            if (uz_dot3(x, x) < distance && uz_dot3(off, off) > SNAP * SNAP * size * size) {
                out->place = UZ_FACE_WITHIN;
                out->which = 0;
                memcpy(out->local, at, sizeof at);
            }
        }
        surface_at(out->point, out->weight, T, &f, out->local);
        uz_cross3(normal, T[0], T[1]);
    }
    const double length = sqrt(uz_dot3(normal, normal));
    for (int c = 0; c < 3; c++)
        out->normal[c] = normal[c] / length;
    out->distance2 = uz_dot3(out->point, out->point);
}
