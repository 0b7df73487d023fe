/* check_turning.c: edges along which the normal into the obstacle turns, or leaps from one piece before them to the
 * next.
 *
 * Before an arc of the centre c, with p = x - c, t and d its parts along the edge and across, rho = |p|, e = p / rho
 * and +1 outside of a disc, -1 in a hole: the gap is +-(rho - R), the normal into the obstacle n = -+e, and what a
 * displacement v leaves of the gap
 *
 *     s = +-(rho - R + e . v).
 *
 * All are analytic about a piece as far as it is long, as the centre is no closer: Gauss's rule of 16 points leaves
 * less than 5^-32 of integrals over it. Before a line all are polynomials, which 4 points integrate.
 *
 * Tractions are polynomials sum_a T_a phi_a (Bernstein), the pressure is r = sum_a r_a phi_a n_a . n with r_a >= 0 and
 * the directions n_a of uz_bound_normal: it is >= 0 as they turn by less than a right angle. sum_a r_a phi_a n_a - r n
 * is along the obstacle, small and missing of equilibrium. Its moments join those of the residual; what is left, delta,
 * is orthogonal to polynomials of the degree on the edge, to rigid motions therefore. On a triangle P with this edge, A
 * the map from the one with corners (0, 0), (1, 0), (1/2, 1/2),
 *
 *     |int delta . w| <= |delta| inf |w - rigid| <= |delta| TRACE |A^-1| |A|^2 sqrt(L / det A) |eps(w)|_P
 *
 * since A'w has the strain A' eps(w) A, and 2 mu |eps|^2 is no more than sigma : eps. Of rings r_a, the pressure and
 * delta are times the radius, and so is sigma : eps, which has that of the hoop as well: |eps|^2 in the plane times the
 * least radius of P is no more than its part. At the axis this is nothing, and nothing presses there. */
#include "bound/check.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of the corners named above: the largest |w|^2 on the first side, less the best polynomial of degree 1 and 2, over
 * int |eps(w)|^2. By polynomials w of degree 10, 12 and 14 it is 1.965, 1.971 and 1.974, and 0.945, 0.954 and 0.958,
 * and more than twice that is taken. */
static const double TRACE2[2] = {4, 2};
/* A bulge takes an edge out of a corner where it is at least so high there, of a height of 1, else its nodes do; it is
 * along normals with no less than this cosine. */
#define HIGH_ENOUGH  0.5
#define LEAST_COSINE 0.5

enum { POINTS = 16, FEW_POINTS = 4, STRETCHES = 32, MOMENTS = UZ_BOUND_MOMENTS };

static double value(const double b[3], double q)
{
    return b[0] * (1 - q) * (1 - q) + 2 * b[1] * q * (1 - q) + b[2] * q * q;
}

/* The triangle of the edge's element at the edge: its corners, the edge's ends first. Returns twice its area. */
static double triangle(double corner[3][2], const examination *x, const uz_bound_edge *edge)
{
    uz_bound_centre(corner[2], x->body, edge->element[0]);
    for (int k = 0; k < 2; k++)
        uz_bound_place(corner[k], x->body, edge->node[k]);
    return (corner[1][0] - corner[0][0]) * (corner[2][1] - corner[0][1]) -
           (corner[1][1] - corner[0][1]) * (corner[2][0] - corner[0][0]);
}

/* |A^-1|^2 |A|^4 L / det A, by Frobenius' norm, from above. */
static double shape_factor(double corner[3][2], double area2, double length)
{
    const double middle[2] = {(corner[0][0] + corner[1][0]) / 2, (corner[0][1] + corner[1][1]) / 2};
    const double a[2] = {corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]};
    const double b[2] = {2 * (corner[2][0] - middle[0]), 2 * (corner[2][1] - middle[1])};
    const double det = 2 * area2, size2 = a[0] * a[0] + a[1] * a[1] + b[0] * b[0] + b[1] * b[1];
    /* the larger singular value squared; the inverse has the smaller one's, which is det over the larger one */
    const double large2 = (size2 + sqrt(fmax(0, size2 * size2 - 4 * det * det))) / 2;
    return large2 / (det * det) * large2 * large2 * length / det;
}

/* ---- points and stretches of the pieces before an edge */

typedef struct {
    double at[2][POINTS], weight[2][POINTS]; /* of pieces that are lines, arcs */
    int64_t piece;                           /* the one at hand */
    int g;                                   /* its next point */
    double from, q, w;                       /* where the piece begins; a point, in parts of the edge, and its weight */
} points;

static points begin_points(const uz_bound_edge *edge)
{
    points p = {.piece = edge->before};
    uz_gauss(p.at[0], p.weight[0], FEW_POINTS);
    uz_gauss(p.at[1], p.weight[1], POINTS);
    return p;
}

static bool next_point(points *p, const uz_bound_body *body, const uz_bound_edge *edge)
{
    if (p->g == (body->before.at[p->piece].round ? POINTS : FEW_POINTS)) {
        p->from = body->before.at[p->piece++].end;
        p->g = 0;
    }
    if (p->piece == edge->before + edge->pieces)
        return false;
    const double part = body->before.at[p->piece].end - p->from;
    const int round = body->before.at[p->piece].round;
    p->q = p->from + part * ((p->at[round][p->g] + 1) / 2);
    p->w = part * (p->weight[round][p->g++] / 2);
    return true;
}

/* A displacement along an edge, and a stretch of one of the pieces: s at its ends, a bound on its second derivative by
 * the place, from above and not below zero, and its normals. */
typedef struct {
    const examination *x;
    const uz_bound_edge *edge;
    int64_t i;
    double length, from[2], way[2], across[2];
    double part[2][3], most, slope, curve; /* along and across, and bounds: of both, of their derivatives */
    int64_t piece;                         /* the next stretch */
    int k;
    double began; /* its piece */
    double q[2], s[2], bend, size, normal[2][2];
} course;

/* v: n_nodes x 2. */
static course begin_course(const examination *x, const double *v, int64_t i)
{
    course c = {.x = x, .edge = &x->body->edge[i], .i = i, .piece = x->body->edge[i].before};
    const double *to = x->mesh->xyz + 2 * c.edge->node[1];
    memcpy(c.from, x->mesh->xyz + 2 * c.edge->node[0], sizeof c.from);
    c.length = hypot(to[0] - c.from[0], to[1] - c.from[1]);
    for (int k = 0; k < 2; k++)
        c.way[k] = (to[k] - c.from[k]) / c.length;
    c.across[0] = -c.way[1];
    c.across[1] = c.way[0];
    uz_along_edge(c.part[0], v, c.edge->node, c.way);
    uz_along_edge(c.part[1], v, c.edge->node, c.across);
    for (int k = 0; k < 2; k++) {
        const double *b = c.part[k];
        c.most += fmax(fabs(b[0]), fmax(fabs(b[1]), fabs(b[2])));
        c.slope += 2 / c.length * fmax(fabs(b[1] - b[0]), fabs(b[2] - b[1]));
        c.curve += 2 / (c.length * c.length) * fabs(b[0] - 2 * b[1] + b[2]);
    }
    return c;
}

/* The second derivative of s, from above, on the stretch at hand, of a piece that ends at `end`. */
static double bend_of(const course *c, const uz_obstacle_piece *p, double end)
{
    const double q = (c->q[0] + c->q[1]) / 2, length = c->length;
    double first[2], second[2];
    for (int k = 0; k < 2; k++) {
        const double *b = c->part[k];
        first[k] = 2 / length * ((1 - q) * (b[1] - b[0]) + q * (b[2] - b[1]));
        second[k] = 2 / (length * length) * (b[0] - 2 * b[1] + b[2]);
    }
    if (!p->round)
        return -(c->way[0] * p->normal[0] + c->way[1] * p->normal[1]) * second[0] -
               (c->across[0] * p->normal[0] + c->across[1] * p->normal[1]) * second[1];
    const double off[2] = {c->from[0] - p->centre[0], c->from[1] - p->centre[1]}, sign = p->inside ? -1 : 1;
    const double start = off[0] * c->way[0] + off[1] * c->way[1], d = off[0] * c->across[0] + off[1] * c->across[1];
    const double low = start + c->began * length, high = start + end * length;
    const double nearest = hypot(d, low > 0 ? low : high < 0 ? high : 0);
    const double third = 1.2 / (nearest * nearest) + 15 * c->most / (nearest * nearest * nearest) +
                         6 * c->slope / (nearest * nearest) + 3 * c->curve / nearest;
    const double t = start + q * length, rho = hypot(t, d), rho3 = rho * rho * rho;
    const double v0 = value(c->part[0], q), v1 = value(c->part[1], q);
    const double bent = d * d / rho3 + (-3 * d * d * t / (rho3 * rho * rho)) * v0 + 2 * d * d / rho3 * first[0] +
                        t / rho * second[0] + d / rho3 * (3 * t * t / (rho * rho) - 1) * v1 -
                        2 * d * t / rho3 * first[1] + d / rho * second[1];
    return sign * bent + third * (c->q[1] - c->q[0]) * length / 2;
}

static bool next_stretch(course *c)
{
    const uz_bound_body *body = c->x->body;
    if (c->piece == c->edge->before + c->edge->pieces)
        return false;
    const uz_obstacle_piece *p = &body->before.at[c->piece];
    const int count = (int)fmax(1, ceil((p->end - c->began) * STRETCHES));
    for (int k = 0; k < 2; k++) {
        c->q[k] = k == 1 && c->k + 1 == count ? p->end : c->began + (p->end - c->began) * (c->k + k) / count;
        const double along = value(c->part[0], c->q[k]), aside = value(c->part[1], c->q[k]);
        double *n = c->normal[k];
        c->s[k] = uz_bound_piece_gap(n, body, c->i, c->piece, c->q[k]);
        c->size = fmax(c->size, fabs(c->s[k]));
        c->s[k] -= (n[0] * c->way[0] + n[1] * c->way[1]) * along + (n[0] * c->across[0] + n[1] * c->across[1]) * aside;
    }
    c->bend = fmax(0, bend_of(c, p, p->end));
    if (++c->k == count) {
        c->k = 0;
        c->began = p->end;
        c->piece++;
    }
    return true;
}

/* ---- where u_h leaves the nodes */

/* The traction of coefficients r at a place -> sum, off: the part that is not along the normal. Returns the pressure.
 */
static double press(double sum[2], double off[2], const uz_bound_edge *edge, const double r[MOMENTS],
                    const double phi[MOMENTS], int moments, const double n[2])
{
    sum[0] = sum[1] = 0;
    for (int a = 0; a < moments; a++)
        for (int c = 0; c < 2; c++)
            sum[c] += r[a] * phi[a] * edge->along[a][c];
    const double pressure = sum[0] * n[0] + sum[1] * n[1];
    for (int c = 0; c < 2; c++)
        off[c] = sum[c] - pressure * n[c];
    return pressure;
}

/* What presses, as coefficients r, off the normal: the polynomial that has its moments along the edge -> coefficients,
 * as r. */
static void project_turned(double coefficient[MOMENTS][2], const uz_bound_body *body, const double r[MOMENTS],
                           int64_t i)
{
    const uz_bound_edge *edge = &body->edge[i];
    const int moments = body->degree + 1;
    double integral[MOMENTS][2] = {{0}}, sum[2], off[2], phi[MOMENTS], n[2];
    for (points p = begin_points(edge); next_point(&p, body, edge);) {
        uz_bound_piece_gap(n, body, i, p.piece, p.q);
        uz_bound_bernstein(phi, moments, p.q);
        press(sum, off, edge, r, phi, moments, n);
        for (int a = 0; a < 2 * moments; a++)
            integral[a / 2][a % 2] += p.w * phi[a / 2] * off[a % 2];
    }
    for (int a = 0; a < moments; a++)
        for (int c = 0; c < 2; c++) {
            coefficient[a][c] = 0;
            for (int k = 0; k < moments; k++)
                coefficient[a][c] += uz_bound_product_inverse[moments - 2][a][k] * integral[k][c];
        }
}

/* The pressures at the moments, as the stress has them: those whose resultants along the directions are its own, with
 * what of them is not along the normal, which is small. What holds motions is less what settles them: of that what is
 * not along the normal is left, so that all else is as it was before. */
static void pressures_of(double out[MOMENTS], const examination *x, int64_t i)
{
    enum { PASSES = 3 };
    double turned[MOMENTS][2] = {{0}};
    for (int pass = 0; pass < PASSES; pass++) {
        for (int a = 0; a < x->moments; a++) {
            const double *acts = x->resultant + (i * x->moments + a) * 2, *n = x->body->edge[i].along[a];
            const double p = -((acts[0] - turned[a][0]) * n[0] + (acts[1] - turned[a][1]) * n[1]);
            out[a] = uz_bound_pressed(x->body, i, a) >= 0 ? p : uz_admit_pressure(x, i * x->moments + a, p);
        }
        if (pass + 1 < PASSES)
            project_turned(turned, x->body, out, i);
    }
    for (int a = 0; a < x->moments; a++) {
        const int held = uz_bound_pressed(x->body, i, a);
        out[a] -= held >= 0 ? x->settled[held] : 0;
    }
}

/* What presses on an edge: its work on the gap, and what of it is not along the normal. */
static void examine_pressure(double turned[MOMENTS][2], examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const int moments = x->moments;
    const double thickness = x->body->depth;
    double r[MOMENTS], sum[2], off[2], along[2][3], phi[MOMENTS], n[2];
    double coefficient[MOMENTS][2], gap = 0, left = 0;
    const double *from = x->mesh->xyz + 2 * edge->node[0], *to = x->mesh->xyz + 2 * edge->node[1];
    const double length = hypot(to[0] - from[0], to[1] - from[1]);
    const points begin = begin_points(edge);
    for (int c = 0; c < 2; c++)
        uz_along_edge(along[c], u, edge->node, (const double[2]){c == 0, c == 1});
    pressures_of(x->pressure + i * moments, x, i);
    for (int a = 0; a < moments; a++) {
        r[a] = x->pressure[i * moments + a] * moments / (length * thickness);
        if (uz_bound_pressed(x->body, i, a) >= 0)
            uz_look_at_holding(x, r[a]);
    }
    for (points p = begin; next_point(&p, x->body, edge);) {
        const double h = uz_bound_piece_gap(n, x->body, i, p.piece, p.q);
        uz_bound_bernstein(phi, moments, p.q);
        const double force = p.w * length * thickness * press(sum, off, edge, r, phi, moments, n);
        const double moved = n[0] * value(along[0], p.q) + n[1] * value(along[1], p.q);
        gap += force * (h - moved);
        x->out->dual -= force * h;
        x->scale += force * (fabs(h) + fabs(moved));
    }
    uz_add_contact_gap(x, edge, gap);
    project_turned(coefficient, x->body, r, i);
    for (int a = 0; a < 2 * moments; a++)
        turned[a / 2][a % 2] = coefficient[a / 2][a % 2] * length * thickness / moments;
    for (points p = begin; next_point(&p, x->body, edge);) {
        uz_bound_piece_gap(n, x->body, i, p.piece, p.q);
        uz_bound_bernstein(phi, moments, p.q);
        press(sum, off, edge, r, phi, moments, n);
        for (int c = 0; c < 2; c++) {
            double delta = off[c];
            for (int a = 0; a < moments; a++)
                delta -= phi[a] * coefficient[a][c];
            left += p.w * length * delta * delta;
        }
    }
    uz_count_turning(x, edge, left);
}

void uz_bound_acts(double acts[MOMENTS][2], const uz_bound_body *body, int64_t i, const double pressure[MOMENTS])
{
    double turned[MOMENTS][2] = {{0}}, normal[2];
    if (body->edge[i].turns)
        project_turned(turned, body, pressure, i);
    for (int a = 0; a <= body->degree; a++) {
        uz_bound_normal(normal, body, i, a);
        for (int c = 0; c < 2; c++)
            acts[a][c] = pressure[a] * normal[c] - turned[a][c];
    }
}

void uz_missing_before(double missing[MOMENTS][2], const examination *x, int64_t i)
{
    double pressure[MOMENTS] = {0};
    pressures_of(pressure, x, i);
    uz_bound_acts(missing, x->body, i, pressure);
    for (int a = 0; a < 2 * x->moments; a++)
        missing[a / 2][a % 2] = -missing[a / 2][a % 2] - x->resultant[2 * i * x->moments + a];
}

void uz_count_turning(examination *x, const uz_bound_edge *edge, double left)
{
    double corner[3][2];
    const double area2 = triangle(corner, x, edge);
    const double length = hypot(corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]);
    double radius = 1; /* the least */
    for (int k = 0; k < 3 && x->body->rings; k++)
        radius = fmin(k == 0 ? corner[k][0] : radius, corner[k][0]);
    x->turning += x->body->depth * left * TRACE2[x->moments - 2] * shape_factor(corner, area2, length) /
                  (2 * uz_element_material(x->body->model, edge->element[0])->lame.mu * radius);
}

void uz_examine_turning(double turned[MOMENTS][2], examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double b[3];
    if (edge->presses)
        examine_pressure(turned, x, u, i);
    for (int a = 0; a < (edge->node[2] < 0 ? 2 : 3); a++) {
        double n[2], more[3] = {0};
        const double q = a == 2 ? 0.5 : a, h = uz_bound_gap(n, x->body, i, q);
        uz_add_given(more, x, edge, n);
        uz_along_edge(b, u, edge->node, n);
        uz_lift_node(x, edge->node[a], n, fmax(0, value(b, q) + value(more, q) - h));
    }
}

/* A node, or a corner between them where no bulge would be high enough: out of it by its nodes, each by its share. */
bool uz_lift_turning(examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double *v = x->moved, size = 0;
    bool lifted = false;
    for (int a = 0; a < 6; a++)
        if (edge->node[a / 2] >= 0) {
            const int64_t at = 2 * edge->node[a / 2] + a % 2;
            v[at] = u[at] + x->lift[at];
        }
    for (course c = begin_course(x, v, i); next_stretch(&c);)
        for (int k = 0; k < 2; k++) {
            const double q = c.q[k], p = 1 - q;
            size = fmax(size, fabs(c.s[k]));
            if (!(-c.s[k] > uz_place_rounding(x)) || !(-c.s[k] > 1e-13 * size) ||
                (q > 0 && q < 1 && 4 * q * p > HIGH_ENOUGH))
                continue;
            const double by = -c.s[k] / (p * p + q * q);
            const double nodal[3] = {by * p, by * q, by / 2};
            for (int a = 0; a < 3; a++)
                lifted = uz_lift_more(x, edge->node[a], c.normal[k], nodal[a]) || lifted;
            if (lifted)
                return true;
        }
    return lifted;
}

/* ---- what is still in the obstacle */

/* 2 times the strain energy of 4 l0 l1 d on the triangle at an edge, with l0 and l1 its coordinates that are 1 at the
 * edge's ends. */
static double bulge_energy(const examination *x, const uz_bound_edge *edge, const double d[2])
{
    const uz_lame lame = uz_element_material(x->body->model, edge->element[0])->lame;
    double corner[3][2], slope[3][2], at[2], weight, sum = 0;
    triangle(corner, x, edge);
    uz_triangle_slopes(slope, corner);
    for (uz_walk walk = uz_walk_begin(corner, x->body->rings, 2); uz_walk_next(&walk, at, &weight);) {
        double l[2], grad[2], hoop = 0;
        for (int k = 0; k < 2; k++)
            l[k] = slope[k][0] * (at[0] - corner[2][0]) + slope[k][1] * (at[1] - corner[2][1]);
        for (int c = 0; c < 2; c++)
            grad[c] = 4 * (l[0] * slope[1][c] + l[1] * slope[0][c]);
        if (x->body->rings) {
            hoop = 4 * l[0] * l[1] * d[0] / at[0];
            weight *= at[0];
        }
        const double xx = grad[0] * d[0], yy = grad[1] * d[1], xy = grad[1] * d[0] + grad[0] * d[1];
        const double trace = xx + yy + hoop;
        sum += weight * x->body->depth *
               (lame.lambda * trace * trace + lame.mu * (2 * (xx * xx + yy * yy + hoop * hoop) + xy * xy));
    }
    return sum * (1 + UZ_SUM_ROUNDING);
}

/* The least of the line between its ends less bend (x - x_0)(x_1 - x) / 2, which s is above on a stretch. */
static double least_of(const course *c, double wide)
{
    const double a = c->s[0], b = c->s[1], sag = c->bend * wide * wide / 2; /* its slope at the ends, times the width */
    return !(fabs(b - a) < sag) ? fmin(a, b) : (a + b) / 2 - sag / 4 - (b - a) * (b - a) / (4 * sag);
}

/* The B with s + 4 B q (1 - q) >= 0 on a stretch. On those at the edge's ends, where the bulge goes to zero and s may
 * not be negative, what s has too little is taken in parts of the way from there. */
static double bulge_needed(const course *c)
{
    const double q0 = c->q[0], q1 = c->q[1], wide = (q1 - q0) * c->length, least = least_of(c, wide);
    if (least >= 0)
        return 0;
    if (q0 > 0 && q1 < 1)
        return -least / (4 * fmin(q0 - q0 * q0, q1 - q1 * q1));
    const double outer = q0 > 0 ? c->s[1] : c->s[0], inner = q0 > 0 ? c->s[0] : c->s[1];
    return outer < 0 ? (double)INFINITY
                     : fmax(0, wide / 2 * c->bend - inner / wide) * c->length / (4 * (q0 > 0 ? q0 : 1 - q1));
}

/* A bulge along an edge: `by` is its height, in its middle, along n. */
typedef struct {
    double by, n[2];
    double first[2], least, most; /* of the normals where it is needed: one of them, and angles from there */
    bool any;
} bulge;

/* The angles of the normals of stretches that need it. */
static void widen(bulge *b, const course *c)
{
    if (!b->any)
        memcpy(b->first, c->normal[0], sizeof b->first);
    b->any = true;
    for (int k = 0; k < 2; k++) {
        const double *n = c->normal[k],
                     turn = atan2(b->first[0] * n[1] - b->first[1] * n[0], b->first[0] * n[0] + b->first[1] * n[1]);
        b->least = fmin(b->least, turn);
        b->most = fmax(b->most, turn);
    }
    const double turn = (b->least + b->most) / 2;
    b->n[0] = cos(turn) * b->first[0] - sin(turn) * b->first[1];
    b->n[1] = sin(turn) * b->first[0] + cos(turn) * b->first[1];
}

/* Of the bulge and the normals of a stretch: the least. */
static double cosine(const bulge *b, const course *c)
{
    double least = 1;
    for (int k = 0; k < 2; k++)
        least = fmin(least, b->n[0] * c->normal[k][0] + b->n[1] * c->normal[k][1]);
    return least;
}

/* Where a bulge is against the normal it takes no more than what s has. */
static bool leaves_room(const bulge *b, const course *c)
{
    const double cos = cosine(b, c), wide = (c->q[1] - c->q[0]) * c->length;
    return cos >= 0 || fmin(c->s[0], c->s[1]) - wide * wide / 8 * c->bend + b->by * cos >= 0;
}

/* A bulge of 4 B q (1 - q) against n on the triangle at the edge leaves s + 4 B q (1 - q) n . n(q) >= 0. */
static bulge find_bulge(examination *x, const double *v, int64_t i)
{
    bulge b = {.by = 0};
    double tolerance = uz_place_rounding(x);
    bool out = true;
    for (course c = begin_course(x, v, i); next_stretch(&c);)
        tolerance = fmax(tolerance, 1e-12 * fmax(fabs(c.s[0]), fabs(c.s[1])));
    for (int pass = 0; pass < 3; pass++)
        for (course c = begin_course(x, v, i); next_stretch(&c);) {
            c.s[0] += tolerance;
            c.s[1] += tolerance;
            const double needed = bulge_needed(&c);
            if (pass == 0) /* its direction, its height, and what it does elsewhere */
                out = out && (c.q[0] > 0 || c.s[0] >= 0) && (c.q[1] < 1 || c.s[1] >= 0);
            if (pass == 0 && needed > 0)
                widen(&b, &c);
            if (pass == 1 && needed > 0) {
                out = out && cosine(&b, &c) > LEAST_COSINE;
                b.by = fmax(b.by, needed / cosine(&b, &c));
            }
            out = out && (pass < 2 || leaves_room(&b, &c));
        }
    if (!*x->out->fault && !out)
        snprintf(x->out->fault, sizeof x->out->fault, "%s",
                 x->body->corners ? "the answer is in a corner of the obstacle, from where no way out was found"
                                  : "the answer is in the obstacle where supports keep it there");
    return b;
}

void uz_look_at_turning(examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double m[MOMENTS], along[2][3], work = 0, *v = x->moved;
    for (int a = 0; a < 3; a++)
        for (int c = 0; c < 2 && edge->node[a] >= 0; c++)
            v[2 * edge->node[a] + c] = u[2 * edge->node[a] + c] + x->lift[2 * edge->node[a] + c];
    const bulge b = find_bulge(x, v, i);
    /* what the pressure does on nodes and bulge, which the gap has to make up for */
    for (int c = 0; c < 2; c++)
        uz_along_edge(along[c], x->lift, edge->node, (const double[2]){c == 0, c == 1});
    for (points p = begin_points(edge); edge->presses && next_point(&p, x->body, edge);) {
        double phi[MOMENTS], here[2], sum[2], off[2], r[MOMENTS];
        uz_bound_piece_gap(here, x->body, i, p.piece, p.q);
        uz_bound_bernstein(phi, x->moments, p.q);
        for (int a = 0; a < x->moments; a++)
            r[a] = x->pressure[i * x->moments + a] * x->moments;
        work += p.w * press(sum, off, edge, r, phi, x->moments, here) *
                (4 * b.by * p.q * (1 - p.q) * (b.n[0] * here[0] + b.n[1] * here[1]) - here[0] * value(along[0], p.q) -
                 here[1] * value(along[1], p.q));
    }
    x->out->gap += work;
    if (!(b.by > 0))
        return;
    const double shape[3] = {0, 2 * b.by, 0}, d[2] = {-b.by * b.n[0], -b.by * b.n[1]};
    const double bulged = bulge_energy(x, edge, d);
    x->bulge += bulged;
    x->bulged += x->gap[edge->element[0]];
    x->out->local[edge->element[0]] += bulged / 2;
    uz_edge_means(m, shape, x->moments);
    for (int a = 0; a < x->moments; a++)
        for (int c = 0; c < 2; c++)
            x->bulge_work -= x->resultant[(i * x->moments + a) * 2 + c] * b.n[c] * m[a];
}

/* ---- what is not as it is wanted */

/* k u . n and a constant, what is left of k gaps, along an edge; gaps and all else of about one size. */
static course combine(examination *x, double k, const double *u, double sign, const double *w, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    for (int a = 0; a < 6; a++)
        if (edge->node[a / 2] >= 0) {
            const int64_t at = 2 * edge->node[a / 2] + a % 2;
            x->moved[at] = (u ? u[at] : 0) - sign / k * w[at];
        }
    return begin_course(x, x->moved, i);
}

static bool next_combined(course *c, double k, double constant)
{
    const bool more = next_stretch(c);
    c->bend *= k;
    for (int j = 0; j < 2; j++)
        c->s[j] = k * c->s[j] + constant;
    return more;
}

void uz_bulge_excess(examination *x, const double *u, const double *w, double om, double m, const double *pressure,
                     int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double size = fabs(om), widest = 0, mean[MOMENTS];
    bulge b = {.by = 0};
    bool out = true;
    for (int a = 0; a < 6; a++)
        size = edge->node[a / 2] < 0 ? size : fmax(size, fabs(w[2 * edge->node[a / 2] + a % 2]));
    for (course c = begin_course(x, w, i); next_stretch(&c);)
        widest = fmax(widest, fmax(c.size, c.length));
    for (int pass = 0; pass < 3 && size > 0; pass++)
        for (int sign = 1; sign >= -1; sign -= 2) {
            const double none = 1e-13 * size / widest; /* with it gaps are rounding */
            course own = combine(x, m, u, sign, w, i), alone = combine(x, none, NULL, sign, w, i);
            const double slack = 1e-12 * (size + m * x->farthest);
            while (next_combined(&own, m, slack - sign * om) && next_combined(&alone, none, 1e-12 * size - sign * om)) {
                const double needed = fmin(bulge_needed(&own), bulge_needed(&alone));
                if (pass == 0)
                    out = out && (own.q[0] > 0 || fmax(own.s[0], alone.s[0]) >= 0) &&
                          (own.q[1] < 1 || fmax(own.s[1], alone.s[1]) >= 0);
                if (pass == 0 && needed > 0)
                    widen(&b, &own);
                if (pass == 1 && needed > 0) {
                    out = out && cosine(&b, &own) > LEAST_COSINE;
                    b.by = fmax(b.by, needed / cosine(&b, &own));
                }
                out = out && (pass < 2 || leaves_room(&b, &own) || leaves_room(&b, &alone));
            }
        }
    if (!*x->out->fault && !out)
        snprintf(x->out->fault, sizeof x->out->fault, "the contact meets supports%s, where what presses has no bound",
                 x->body->corners ? " or a corner" : "");
    if (!(b.by > 0))
        return;
    const double shape[3] = {0, 2 * b.by, 0}, d[2] = {b.by * b.n[0], b.by * b.n[1]};
    uz_edge_means(mean, shape, x->moments);
    x->bulge += bulge_energy(x, edge, d);
    for (int a = 0; a < x->moments; a++)
        x->bulge_work += pressure[i * x->moments + a] * mean[a];
}
