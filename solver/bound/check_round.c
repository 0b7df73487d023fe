/* check_round.c: edges before a round obstacle, of which gap and normal turn along the edge.
 *
 * With p = x - c, t and d its parts along the edge and across, rho = |p|, e = p / rho and +1 outside of a disc, -1 in a
 * hole: the gap is +-(rho - R), the normal into the obstacle n = -+e, and what a displacement v leaves of the gap
 *
 *     s = +-(rho - R + e . v).
 *
 * All are analytic about the edge as far as it is long, as the centre is no closer: Gauss's rule of 16 points leaves
 * less than 5^-32 of integrals over it.
 *
 * Tractions are polynomials sum_a T_a phi_a (Bernstein), the pressure is r = sum_a r_a phi_a n_a . n with r_a >= 0 and
 * the normals n_a at a / degree: it is >= 0 as they turn by less than a right angle. sum_a r_a phi_a n_a - r n is along
 * the edge of the disc, small and missing of equilibrium. Its moments join those of the residual; what is left, delta,
 * is orthogonal to polynomials of the degree on the edge, to rigid motions therefore. On a triangle P with this edge, A
 * the map from the one with corners (0, 0), (1, 0), (1/2, 1/2),
 *
 *     |int delta . w| <= |delta| inf |w - rigid| <= |delta| TRACE |A^-1| |A|^2 sqrt(L / det A) |eps(w)|_P
 *
 * since A'w has the strain A' eps(w) A, and 2 mu |eps|^2 is no more than sigma : eps. */
#include "bound/check.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Of the corners named above: the largest |w|^2 on the first side, less its best rigid motion, over int |eps(w)|^2. It
 * is 3.30 by polynomials of degree 6, 8 and 10 (3.23, 3.28, 3.30), and four times that is taken. */
#define TRACE2 13.2

enum { POINTS = 16, PIECES = 32, MOMENTS = UZ_BOUND_MOMENTS };

static double value(const double b[3], double q)
{
    return b[0] * (1 - q) * (1 - q) + 2 * b[1] * q * (1 - q) + b[2] * q * q;
}

/* The triangle of the edge's element at the edge: its corners, the edge's ends first. Returns twice its area. */
static double triangle(double corner[3][2], const examination *x, const uz_bound_edge *edge)
{
    uz_bound_centre(corner[2], x->body, edge->element[0]);
    for (int k = 0; k < 2; k++)
        memcpy(corner[k], x->mesh->xyz + 2 * edge->node[k], sizeof corner[k]);
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

void uz_count_turning(examination *x, const uz_bound_edge *edge, double left)
{
    double corner[3][2];
    const double area2 = triangle(corner, x, edge);
    const double length = hypot(corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]);
    x->turning += x->body->model->thickness * left * TRACE2 * shape_factor(corner, area2, length) /
                  (2 * uz_element_material(x->body->model, edge->element[0])->lame.mu);
}

void uz_examine_round(double turned[MOMENTS][2], examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const int moments = x->moments;
    const double thickness = x->body->model->thickness;
    double at[POINTS], weight[POINTS], own[MOMENTS][2], r[MOMENTS], off[POINTS][2], along[2][3];
    double integral[MOMENTS][2] = {{0}}, coefficient[MOMENTS][2] = {{0}}, gap = 0, left = 0;
    const double *from = x->mesh->xyz + 2 * edge->node[0], *to = x->mesh->xyz + 2 * edge->node[1];
    const double length = hypot(to[0] - from[0], to[1] - from[1]);
    uz_gauss(at, weight, POINTS);
    for (int c = 0; c < 2; c++)
        uz_along_edge(along[c], u, edge->node, (const double[2]){c == 0, c == 1});
    for (int a = 0; a < moments; a++) {
        const double *acts = x->resultant + (i * moments + a) * 2;
        uz_bound_gap(own[a], x->body, i, (double)a / x->body->degree);
        x->pressure[i * moments + a] =
            uz_admit_pressure(x, i * moments + a, -(acts[0] * own[a][0] + acts[1] * own[a][1]));
        r[a] = x->pressure[i * moments + a] * moments / (length * thickness);
    }
    for (int g = 0; g < POINTS; g++) {
        double phi[MOMENTS], n[2], sum[2] = {0};
        const double q = (at[g] + 1) / 2, w = weight[g] / 2, h = uz_bound_gap(n, x->body, i, q);
        uz_bound_bernstein(phi, moments, q);
        for (int a = 0; a < moments; a++)
            for (int c = 0; c < 2; c++)
                sum[c] += r[a] * phi[a] * own[a][c];
        const double pressure = sum[0] * n[0] + sum[1] * n[1], force = w * length * thickness * pressure;
        const double moved = n[0] * value(along[0], q) + n[1] * value(along[1], q);
        gap += force * (h - moved);
        x->out->dual -= force * h;
        x->scale += force * (fabs(h) + fabs(moved));
        for (int c = 0; c < 2; c++) {
            off[g][c] = sum[c] - pressure * n[c];
            for (int a = 0; a < moments; a++)
                integral[a][c] += w * phi[a] * off[g][c];
        }
    }
    x->out->gap += gap;
    for (int a = 0; a < moments; a++)
        for (int c = 0; c < 2; c++) {
            for (int k = 0; k < moments; k++)
                coefficient[a][c] += uz_bound_product_inverse[moments - 2][a][k] * integral[k][c];
            turned[a][c] = coefficient[a][c] * length * thickness / moments;
        }
    for (int g = 0; g < POINTS; g++) {
        double phi[MOMENTS];
        uz_bound_bernstein(phi, moments, (at[g] + 1) / 2);
        for (int c = 0; c < 2; c++) {
            double delta = off[g][c];
            for (int a = 0; a < moments; a++)
                delta -= phi[a] * coefficient[a][c];
            left += weight[g] / 2 * length * delta * delta;
        }
    }
    uz_count_turning(x, edge, left);
    for (int a = 0; a < (edge->node[2] < 0 ? 2 : 3); a++) {
        double n[2];
        const double q = a == 2 ? 0.5 : a, h = uz_bound_gap(n, x->body, i, q);
        double more[3] = {0};
        uz_add_given(more, x, edge, n);
        const double s = h - n[0] * value(along[0], q) - n[1] * value(along[1], q) - value(more, q);
        uz_lift_node(x, edge->node[a], n, fmax(0, -s));
    }
}

/* ---- what is still in the obstacle */

/* s along the edge for a displacement: its values at the ends of PIECES equal pieces, and in each a bound on its second
 * derivative by the place, from above and not below zero. */
static void gap_left(double s[PIECES + 1], double bend[PIECES], const examination *x, const double *v, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const double *from = x->mesh->xyz + 2 * edge->node[0], *to = x->mesh->xyz + 2 * edge->node[1];
    const double length = hypot(to[0] - from[0], to[1] - from[1]), piece = length / PIECES;
    const double way[2] = {(to[0] - from[0]) / length, (to[1] - from[1]) / length}, across[2] = {-way[1], way[0]};
    const double p[2] = {from[0] - edge->centre[0], from[1] - edge->centre[1]};
    const double start = p[0] * way[0] + p[1] * way[1], d = p[0] * across[0] + p[1] * across[1];
    const double sign = edge->inside ? -1 : 1;
    double part[2][3], most = 0, slope = 0, curve = 0;
    uz_along_edge(part[0], v, edge->node, way);
    uz_along_edge(part[1], v, edge->node, across);
    for (int k = 0; k < 2; k++) {
        most += fmax(fabs(part[k][0]), fmax(fabs(part[k][1]), fabs(part[k][2])));
        slope += 2 / length * fmax(fabs(part[k][1] - part[k][0]), fabs(part[k][2] - part[k][1]));
        curve += 2 / (length * length) * fabs(part[k][0] - 2 * part[k][1] + part[k][2]);
    }
    const double nearest = hypot(d, start > 0 ? start : start + length < 0 ? start + length : 0);
    const double third = 1.2 / (nearest * nearest) + 15 * most / (nearest * nearest * nearest) +
                         6 * slope / (nearest * nearest) + 3 * curve / nearest;
    for (int j = 0; j <= 2 * PIECES; j++) {
        const double q = j / (2. * PIECES), t = start + q * length, rho = hypot(t, d), rho3 = rho * rho * rho;
        double n[2];
        const double v0 = value(part[0], q), v1 = value(part[1], q);
        if (j % 2 == 0) {
            s[j / 2] = uz_bound_gap(n, x->body, i, q) + sign * (t * v0 + d * v1) / rho;
            continue;
        }
        double first[2], second[2];
        for (int k = 0; k < 2; k++) {
            first[k] = 2 / length * ((1 - q) * (part[k][1] - part[k][0]) + q * (part[k][2] - part[k][1]));
            second[k] = 2 / (length * length) * (part[k][0] - 2 * part[k][1] + part[k][2]);
        }
        const double bent = d * d / rho3 + (-3 * d * d * t / (rho3 * rho * rho)) * v0 + 2 * d * d / rho3 * first[0] +
                            t / rho * second[0] + d / rho3 * (3 * t * t / (rho * rho) - 1) * v1 -
                            2 * d * t / rho3 * first[1] + d / rho * second[1];
        bend[j / 2] = fmax(0, sign * bent + third * piece / 2);
    }
}

/* 2 times the strain energy of 4 l0 l1 d on a triangle, with l0 and l1 its coordinates that are 1 at the edge's ends.
 */
static double bulge_energy(double corner[3][2], double area2, uz_lame lame, double thickness, const double d[2])
{
    static const double MIDDLE[3][2] = {{0.5, 0.5}, {0, 0.5}, {0.5, 0}};
    double slope[2][2], sum = 0;
    for (int k = 0; k < 2; k++) {
        const double *p = corner[(k + 1) % 3], *q = corner[(k + 2) % 3];
        slope[k][0] = (p[1] - q[1]) / area2;
        slope[k][1] = (q[0] - p[0]) / area2;
    }
    for (int g = 0; g < 3; g++) { /* exact for what is of degree 2 */
        double grad[2];
        for (int c = 0; c < 2; c++)
            grad[c] = 4 * (MIDDLE[g][0] * slope[1][c] + MIDDLE[g][1] * slope[0][c]);
        const double xx = grad[0] * d[0], yy = grad[1] * d[1], xy = grad[1] * d[0] + grad[0] * d[1];
        sum += area2 / 6 * thickness *
               ((lame.lambda + lame.mu) * (xx + yy) * (xx + yy) + lame.mu * ((xx - yy) * (xx - yy) + xy * xy));
    }
    return sum;
}

/* The least of a line from a to b over a piece, less bend (x - x_j)(x_j+1 - x) / 2. */
static double least_of(double a, double b, double bend, double piece)
{
    const double sag = bend * piece * piece / 2; /* its slope at the ends, times the piece */
    return !(fabs(b - a) < sag) ? fmin(a, b) : (a + b) / 2 - sag / 4 - (b - a) * (b - a) / (4 * sag);
}

/* The B with s + 4 B q (1 - q) >= 0 in the j-th piece. There s is above the line between its ends by no less than
 * -bend (x - x_j)(x_j+1 - x) / 2; in those at the edge's ends, where the bulge goes to zero and s may not be negative,
 * what s has too little is taken in parts of the way from there. */
static double bulge_needed(const double s[PIECES + 1], const double bend[PIECES], double piece, int j)
{
    const double q0 = (double)j / PIECES, q1 = (j + 1.) / PIECES, least = least_of(s[j], s[j + 1], bend[j], piece);
    if (least >= 0)
        return 0;
    if (j == 0 || j == PIECES - 1)
        return s[j == 0 ? 0 : PIECES] < 0
                   ? (double)INFINITY
                   : fmax(0, piece * piece / 2 * bend[j] - (j == 0 ? s[1] : s[j])) * PIECES / (4 * (1 - 1. / PIECES));
    return -least / (4 * fmin(q0 - q0 * q0, q1 - q1 * q1));
}

/* A bulge b = -B 4 q (1 - q) n(1/2) on the triangle at the edge leaves s + 4 B q (1 - q) n(1/2) . n >= 0. */
void uz_look_at_round(examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const uz_body_model *model = x->body->model;
    const uz_lame lame = uz_element_material(model, edge->element[0])->lame;
    double s[PIECES + 1], bend[PIECES], corner[3][2], n[3][2], by = 0, m[MOMENTS], along[2][3];
    double *v = x->moved;
    const double area2 = triangle(corner, x, edge);
    const double length = hypot(corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]), piece = length / PIECES;
    for (int a = 0; a < 3; a++)
        for (int c = 0; c < 2 && edge->node[a] >= 0; c++)
            v[2 * edge->node[a] + c] = u[2 * edge->node[a] + c] + x->lift[2 * edge->node[a] + c];
    gap_left(s, bend, x, v, i);
    for (int a = 0; a < 3; a++)
        uz_bound_gap(n[a], x->body, i, a == 0 ? 0 : a == 1 ? 0.5 : 1);
    const double cosine = fmin(n[0][0] * n[1][0] + n[0][1] * n[1][1], n[2][0] * n[1][0] + n[2][1] * n[1][1]);
    double tolerance = uz_place_rounding(x);
    for (int j = 0; j <= PIECES; j++)
        tolerance = fmax(tolerance, 1e-12 * fabs(s[j]));
    for (int j = 0; j <= PIECES; j++)
        s[j] += tolerance;
    if (!*x->out->fault && !(s[0] >= 0 && s[PIECES] >= 0 && cosine > 0.5))
        snprintf(x->out->fault, sizeof x->out->fault, "the answer is in the obstacle where supports keep it there");
    for (int j = 0; j < PIECES; j++)
        by = fmax(by, bulge_needed(s, bend, piece, j) / cosine);
    /* what the pressure does on nodes and bulge, which the gap has to make up for */
    double at[POINTS], weight[POINTS], work = 0;
    uz_gauss(at, weight, POINTS);
    for (int c = 0; c < 2; c++)
        uz_along_edge(along[c], x->lift, edge->node, (const double[2]){c == 0, c == 1});
    for (int g = 0; g < POINTS; g++) {
        double phi[MOMENTS], here[2], pressure = 0;
        const double q = (at[g] + 1) / 2;
        uz_bound_gap(here, x->body, i, q);
        uz_bound_bernstein(phi, x->moments, q);
        for (int a = 0; a < x->moments; a++) {
            double own[2];
            uz_bound_gap(own, x->body, i, (double)a / x->body->degree);
            pressure += x->pressure[i * x->moments + a] * x->moments * phi[a] * (own[0] * here[0] + own[1] * here[1]);
        }
        work += weight[g] / 2 * pressure *
                (4 * by * q * (1 - q) * (n[1][0] * here[0] + n[1][1] * here[1]) - here[0] * value(along[0], q) -
                 here[1] * value(along[1], q));
    }
    x->out->gap += work;
    if (!(by > 0))
        return;
    const double b[3] = {0, 2 * by, 0}, d[2] = {-by * n[1][0], -by * n[1][1]};
    x->bulge += bulge_energy(corner, area2, lame, model->thickness, d);
    x->bulged += x->gap[edge->element[0]];
    uz_edge_means(m, b, x->moments);
    for (int a = 0; a < x->moments; a++)
        for (int c = 0; c < 2; c++)
            x->bulge_work -= x->resultant[(i * x->moments + a) * 2 + c] * n[1][c] * m[a];
}

/* Along an edge, and s its bends in pieces: k u . n and a constant, what is left of k gaps; gaps and all else of about
 * one size. */
static void combine(double s[PIECES + 1], double bend[PIECES], examination *x, double k, const double *u, double sign,
                    const double *w, double constant, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    for (int a = 0; a < 6; a++)
        if (edge->node[a / 2] >= 0) {
            const int64_t at = 2 * edge->node[a / 2] + a % 2;
            x->moved[at] = (u ? u[at] : 0) - sign / k * w[at];
        }
    gap_left(s, bend, x, x->moved, i);
    for (int j = 0; j <= PIECES; j++)
        s[j] = k * s[j] + constant;
    for (int j = 0; j < PIECES; j++)
        bend[j] *= k;
}

void uz_bulge_excess(examination *x, const double *u, const double *w, double om, double m, const double *pressure,
                     int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const uz_lame lame = uz_element_material(x->body->model, edge->element[0])->lame;
    double corner[3][2], n[3][2], s[2][PIECES + 1], bend[2][PIECES], by = 0, size = fabs(om), widest = edge->radius;
    const double area2 = triangle(corner, x, edge);
    const double piece = hypot(corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]) / PIECES;
    for (int a = 0; a < 6; a++)
        size = edge->node[a / 2] < 0 ? size : fmax(size, fabs(w[2 * edge->node[a / 2] + a % 2]));
    for (int a = 0; a < 3; a++)
        widest = fmax(widest, fabs(uz_bound_gap(n[a], x->body, i, a == 0 ? 0 : a == 1 ? 0.5 : 1)));
    const double cosine = fmin(n[0][0] * n[1][0] + n[0][1] * n[1][1], n[2][0] * n[1][0] + n[2][1] * n[1][1]);
    for (int sign = 1; sign >= -1 && size > 0; sign -= 2) {
        combine(s[0], bend[0], x, m, u, sign, w, -sign * om, i);
        combine(s[1], bend[1], x, 1e-13 * size / widest, NULL, sign, w, -sign * om, i); /* gaps are rounding there */
        for (int j = 0; j <= PIECES; j++) {
            s[0][j] += 1e-12 * (size + m * x->farthest);
            s[1][j] += 1e-12 * size;
        }
        for (int j = 0; j < PIECES; j++)
            by = fmax(by, fmin(bulge_needed(s[0], bend[0], piece, j), bulge_needed(s[1], bend[1], piece, j)));
        for (int k = 0; k < PIECES + 1; k += PIECES)
            if (!*x->out->fault && !(fmax(s[0][k], s[1][k]) >= 0 && cosine > 0.5))
                snprintf(x->out->fault, sizeof x->out->fault,
                         "the contact meets supports, where what presses has no bound");
    }
    by /= cosine;
    if (!(by > 0))
        return;
    const double b[3] = {0, 2 * by, 0}, d[2] = {by * n[1][0], by * n[1][1]};
    double mean[MOMENTS];
    uz_edge_means(mean, b, x->moments);
    x->bulge += bulge_energy(corner, area2, lame, x->body->model->thickness, d);
    for (int a = 0; a < x->moments; a++)
        x->bulge_work += pressure[i * x->moments + a] * mean[a];
}
