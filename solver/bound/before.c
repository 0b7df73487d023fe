/* before.c: what of an obstacle is before an edge. Gap and normal are those of each of the edge's points where nothing
 * has moved: of the closest point of the obstacle. */
#include "bound/bound.h"

#include "core/vector3.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Relative to the body's extent: how far a point may be from an obstacle that it touches: displacements may be small,
 * too. */
#define TOUCHING (16 * DBL_EPSILON)
/* Where normals along an edge are farther apart (rad) nothing presses on it in the dual problem: what of that is not
 * along the normal would cost more, on ridges from 0.2 to 0.6 on. */
#define MOST_TURN 0.3
/* Rows of nodes in an obstacle are along the way out of the body, which is that of the closest point but for angles
 * (rad) up to this. */
#define OTHER_WAY 0.1

static void refuse(uz_bound_body *body, const char *why, const char *on)
{
    if (!*body->why)
        snprintf(body->why, sizeof body->why, why, on);
}

double uz_bound_piece_gap(double normal[2], const uz_bound_body *body, int64_t edge, int64_t piece, double part)
{
    const uz_obstacle_piece *p = &body->before.at[piece];
    const double *from = body->model->mesh.xyz + 2 * body->edge[edge].node[0],
                 *to = body->model->mesh.xyz + 2 * body->edge[edge].node[1];
    double off[2];
    memcpy(normal, p->normal, sizeof p->normal);
    if (!p->round)
        return p->gap[0] + part * (p->gap[1] - p->gap[0]);
    for (int c = 0; c < 2; c++)
        off[c] = from[c] - p->centre[c] + part * (to[c] - from[c]);
    const double distance = hypot(off[0], off[1]), sign = p->inside ? 1 : -1;
    for (int c = 0; c < 2; c++)
        normal[c] = sign * off[c] / distance;
    return sign * (p->radius - distance);
}

double uz_bound_gap(double normal[2], const uz_bound_body *body, int64_t edge, double part)
{
    int64_t low = body->edge[edge].before, high = low + body->edge[edge].pieces - 1;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (body->before.at[middle].end < part)
            low = middle + 1;
        else
            high = middle;
    }
    if (body->edge[edge].contact >= 0)
        return uz_bound_piece_gap(normal, body, edge, low, part);
    normal[0] = normal[1] = 0;
    return 0;
}

void uz_bound_normal(double normal[2], const uz_bound_body *body, int64_t edge, int a)
{
    if (body->edge[edge].facing != UZ_BOUND_ALONE)
        memcpy(normal, body->edge[edge].normal, sizeof body->edge[edge].normal);
    else if (body->edge[edge].turns)
        memcpy(normal, body->edge[edge].along[a], sizeof body->edge[edge].along[a]);
    else
        uz_bound_gap(normal, body, edge, 0);
}

void uz_bound_axes(double axis[2][2], const uz_bound_body *body, int64_t edge, int a)
{
    const uz_bound_edge *at = &body->edge[edge];
    memcpy(axis, at->axis, sizeof at->axis);
    if (!at->turns || !at->presses)
        return;
    axis[0][0] = axis[1][1] = at->along[a][0];
    axis[0][1] = at->along[a][1];
    axis[1][0] = -at->along[a][1];
}

/* ---- an edge */

/* The directions of the moments: of an arc its normals at a / degree of the way, else the coefficients of the
 * polynomial that is next to the normals in the mean. */
static void direct(uz_bound_body *body, int64_t i)
{
    enum { STEPS = 8 };
    uz_bound_edge *edge = &body->edge[i];
    const int moments = body->degree + 1;
    double sum[UZ_BOUND_MOMENTS][2] = {{0}}, from = 0;
    for (int64_t k = edge->before; k < edge->before + edge->pieces; k++) {
        const double end = body->before.at[k].end;
        for (int j = 0; j <= STEPS; j++) { /* by Simpson's rule */
            const double q = from + (end - from) * j / STEPS, p = 1 - q;
            const double w = (end - from) / (3 * STEPS) * (j % STEPS == 0 ? 1 : j % 2 == 1 ? 4 : 2);
            const double phi[2][UZ_BOUND_MOMENTS] = {{p, q, 0}, {p * p, 2 * p * q, q * q}};
            double n[2];
            uz_bound_piece_gap(n, body, i, k, q);
            for (int a = 0; a < 2 * moments; a++)
                sum[a / 2][a % 2] += w * phi[moments - 2][a / 2] * n[a % 2];
        }
        from = end;
    }
    for (int a = 0; a < moments; a++) {
        double n[2] = {0};
        for (int b = 0; b < 2 * moments; b++)
            n[b % 2] += uz_bound_product_inverse[moments - 2][a][b / 2] * sum[b / 2][b % 2];
        const double size = hypot(n[0], n[1]);
        if (!(size > 0))
            uz_bound_gap(n, body, i, (double)a / body->degree);
        for (int c = 0; c < 2; c++)
            edge->along[a][c] = !(size > 0) ? n[c] : n[c] / size;
    }
}

/* Do normals and directions turn by no more than MOST_TURN along the edge, and the latter nowhere against the former?
 */
static bool may_press(const uz_bound_body *body, int64_t i)
{
    const uz_bound_edge *edge = &body->edge[i];
    double first[2], n[2], least = 0, most = 0, from = 0;
    bool may = !edge->held[0];
    uz_bound_piece_gap(first, body, i, edge->before, 0);
    for (int64_t k = edge->before; k < edge->before + edge->pieces; k++) {
        const double end = body->before.at[k].end;
        for (int j = 0; j < 2; j++) {
            uz_bound_piece_gap(n, body, i, k, j == 0 ? from : end);
            const double turn = atan2(uz_cross2(first, n), uz_dot2(first, n));
            least = fmin(least, turn);
            most = fmax(most, turn);
            for (int a = 0; a <= body->degree; a++)
                may = may && uz_dot2(edge->along[a], n) > 0.1;
        }
        from = end;
    }
    return may && most - least <= MOST_TURN;
}

/* Rows of nodes that stand in an obstacle with corners are taken where the body's own normal leads out of it. Is that
 * elsewhere than the closest point? */
static bool leads_elsewhere(const uz_bound_body *body, int64_t i, const uz_obstacle *obstacle)
{
    const uz_bound_edge *edge = &body->edge[i];
    const double *from = body->model->mesh.xyz + 2 * edge->node[0], *to = body->model->mesh.xyz + 2 * edge->node[1];
    const double way[2] = {to[0] - from[0], to[1] - from[1]}, length = hypot(way[0], way[1]);
    const double outward[2] = {way[1] / length, -way[0] / length};
    double start = 0;
    bool elsewhere = false;
    for (int64_t k = edge->before; k < edge->before + edge->pieces; k++) {
        for (int j = 0; j <= 2; j++) {
            const double q = start + (body->before.at[k].end - start) * j / 2;
            const double x[2] = {from[0] + q * way[0], from[1] + q * way[1]};
            double n[2];
            uz_gap there;
            if (uz_bound_piece_gap(n, body, i, k, q) >= -1e-9 * length ||
                uz_obstacle_row_gap(&there, NULL, obstacle, x, outward, 0, 1e-6 * length, NULL) != UZ_OK)
                continue;
            elsewhere = elsewhere || hypot(n[0] + there.normal[0], n[1] + there.normal[1]) > OTHER_WAY;
        }
        start = body->before.at[k].end;
    }
    return elsewhere;
}

uz_status uz_bound_take_obstacle(uz_bound_body *body, int64_t i, const uz_obstacle *obstacle, const char *on,
                                 uz_error *err)
{
    const uz_mesh *mesh = &body->model->mesh;
    uz_bound_edge *edge = &body->edge[i];
    double n[2];
    edge->before = body->before.n;
    const uz_status status =
        uz_obstacle_along(&body->before, obstacle, mesh->xyz + 2 * edge->node[0], mesh->xyz + 2 * edge->node[1], err);
    edge->pieces = body->before.n - edge->before;
    if (status != UZ_OK)
        return status;
    if (body->before.why || edge->pieces == 0) {
        char why[160];
        snprintf(why, sizeof why, "an edge of \"%%s\" %s",
                 body->before.why ? body->before.why : "has nothing before it");
        refuse(body, why, on);
        return UZ_OK;
    }
    for (int64_t k = edge->before; k < body->before.n; k++)
        for (int c = 0; c < 2; c++) {
            double *gap = &body->before.at[k].gap[c];
            *gap = fabs(*gap) < TOUCHING * mesh->extent ? 0 : *gap;
        }
    edge->turns = edge->pieces > 1 || body->before.at[edge->before].round;
    edge->presses = true;
    body->corners = body->corners || uz_obstacle_has_edges(obstacle);
    if (uz_obstacle_has_edges(obstacle) && leads_elsewhere(body, i, obstacle))
        refuse(body, "\"%s\" stands in a corner of its obstacle, from where the closest point is no way out", on);
    if (edge->turns && edge->held[0])
        refuse(body, "supports hold edges of \"%s\" before an obstacle whose normal turns", on);
    if (edge->turns) {
        direct(body, i);
        edge->presses = may_press(body, i);
    }
    uz_bound_gap(n, body, i, 0.5);
    if (!edge->held[0] && edge->presses) { /* one unknown along the normal makes a row of one entry */
        edge->axis[0][0] = edge->axis[1][1] = n[0];
        edge->axis[0][1] = n[1];
        edge->axis[1][0] = -n[1];
    }
    return UZ_OK;
}

/* ---- what presses */

void uz_bound_push(double *push, double *open, const uz_bound_body *body, const double *pressure, const double *u)
{
    static const double AT[3] = {0.11270166537925831, 0.5, 0.88729833462074169},
                        WEIGHT[3] = {5. / 18, 8. / 18, 5. / 18};
    const int moments = body->degree + 1;
    const int64_t n_nodes = body->model->mesh.n_nodes;
    memset(push, 0, (size_t)(2 * n_nodes) * sizeof *push);
    for (int64_t i = 0; i < n_nodes; i++)
        open[i] = INFINITY;
    for (int64_t i = 0; i < body->n_edges; i++) {
        const uz_bound_edge *edge = &body->edge[i];
        const int nodes = edge->node[2] < 0 ? 2 : 3;
        if (edge->contact < 0)
            continue;
        for (int k = 0; k < nodes; k++) {
            double n[2];
            const double gap = uz_bound_gap(n, body, i, k == 2 ? 0.5 : k);
            open[edge->node[k]] = fmin(open[edge->node[k]], gap - uz_dot2(n, u + 2 * edge->node[k]));
        }
        for (int g = 0; g < 3; g++) {
            const double q = AT[g], p = 1 - q;
            const double shape[3] = {nodes == 2 ? p : p * (1 - 2 * q), nodes == 2 ? q : q * (2 * q - 1), 4 * p * q};
            double phi[UZ_BOUND_MOMENTS], n[2];
            uz_bound_bernstein(phi, moments, q);
            for (int a = 0; a < moments; a++) {
                uz_bound_normal(n, body, i, a);
                for (int k = 0; k < 2 * nodes; k++)
                    push[2 * edge->node[k / 2] + k % 2] -=
                        WEIGHT[g] * shape[k / 2] * moments * phi[a] * pressure[i * moments + a] * n[k % 2];
            }
        }
    }
}
