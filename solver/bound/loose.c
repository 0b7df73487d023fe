/* loose.c: bodies that only obstacles hold in some motions.
 *
 * The dual problem has no least value without supports, but where a pressure is surely not zero its row may as well be
 * an equation: the edge's moment is held in the obstacle, and has the pressure that it takes. As many moments hold as
 * there are motions, those where the answer presses hardest and which tell the motions apart. Nothing depends on the
 * choice but whether these pressures come out >= 0. */
#include "bound/bound.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* A moment is taken where the answer presses by more than this part of its largest pressure. */
#define PRESSED 0.1

uz_status uz_bound_loose_motions(uz_bound_body *body, uz_error *err)
{
    const uz_body_model *model = body->model;
    const int64_t n = 2 * model->mesh.n_nodes;
    if (model->n_modes == 0 || *body->why)
        return UZ_OK;
    body->motion = uz_alloc(model->n_modes * n, sizeof *body->motion);
    if (!body->motion)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld motions", (long long)model->n_modes);
    body->n_loose = (int)model->n_modes;
    for (int k = 0; k < body->n_loose; k++)
        uz_recover_nodal(body->motion + k * n, model, model->modes + k * model->d, NULL);
    return UZ_OK;
}

double uz_bound_moved(const uz_bound_body *body, int motion, int64_t edge, int a, const double n[2])
{
    const double *q = body->motion + motion * 2 * body->model->mesh.n_nodes, part = (a + 1.) / (body->degree + 2);
    double moved = 0;
    for (int c = 0; c < 2; c++)
        moved += n[c] * ((1 - part) * q[2 * body->edge[edge].node[0] + c] + part * q[2 * body->edge[edge].node[1] + c]);
    return moved;
}

/* What the motions do at a moment, less what the moments that were chosen before say of them: in the motions' own
 * coordinates, from which the directions of `chosen` (count x n_loose, orthonormal) are taken. Returns its size. */
static double new_part(double by[UZ_BOUND_LOOSE], const uz_bound_body *body, int64_t edge, int a,
                       double chosen[][UZ_BOUND_LOOSE], int count)
{
    double size = 0;
    for (int k = 0; k < body->n_loose; k++)
        by[k] = uz_bound_moved(body, k, edge, a, uz_bound_line(body, &body->edge[edge])->normal);
    for (int i = 0; i < count; i++) {
        double along = 0;
        for (int k = 0; k < body->n_loose; k++)
            along += by[k] * chosen[i][k];
        for (int k = 0; k < body->n_loose; k++)
            by[k] -= along * chosen[i][k];
    }
    for (int k = 0; k < body->n_loose; k++)
        size += by[k] * by[k];
    return sqrt(size);
}

void uz_bound_hold(uz_bound_body *body, const double *pressure)
{
    const int moments = body->degree + 1;
    double hardest = 0, chosen[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE];
    for (int64_t a = 0; a < body->model->mesh.n_nodes; a++)
        hardest = fmax(hardest, pressure[a]);
    for (int count = 0; count < body->n_loose; count++) {
        double best = 0, by[UZ_BOUND_LOOSE];
        for (int64_t i = 0; i < body->n_edges; i++) {
            const uz_bound_edge *edge = &body->edge[i];
            const double p = fmin(pressure[edge->node[0]], pressure[edge->node[1]]);
            if (edge->contact < 0 || edge->held[0] || edge->turns || !(p > PRESSED * hardest))
                continue;
            for (int a = 0; a < moments; a++) {
                const double size = sqrt(p * uz_bound_weight(body, i, a)) * new_part(by, body, i, a, chosen, count);
                if (size > best) {
                    best = size;
                    body->pressed[count] = i * moments + a;
                }
            }
        }
        const double size = best > 0 ? new_part(by, body, body->pressed[count] / moments,
                                                (int)(body->pressed[count] % moments), chosen, count)
                                     : 0;
        if (!(size > 1e-6)) { /* motions have a largest entry of 1 */
            snprintf(body->why, sizeof body->why,
                     "only obstacles hold the body, and of straight ones it presses on too few edges");
            return;
        }
        for (int k = 0; k < body->n_loose; k++)
            chosen[count][k] = by[k] / size;
        body->n_pressed = count + 1;
    }
}

int uz_bound_pressed(const uz_bound_body *body, int64_t edge, int a)
{
    for (int i = 0; i < body->n_pressed; i++)
        if (body->pressed[i] == edge * (body->degree + 1) + a)
            return i;
    return -1;
}
