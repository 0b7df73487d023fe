/* loose.c: bodies that only obstacles hold in some motions.
 *
 * The dual problem has no least value without supports, but where a pressure is surely not zero its row may as well be
 * an equation: the edge's moment is held in the obstacle, and has the pressure that it takes. As many moments hold as
 * there are motions, those where the answer or a stress presses hardest and which tell the motions apart: before round
 * obstacles along the directions of what presses there (uz_bound_normal). Nothing depends on the choice but whether
 * these pressures come out >= 0. */
#include "bound/bound.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdio.h>

/* A moment is taken where the answer presses by more than this part of its largest pressure on both sides of it; where
 * it does so on one alone, as of a body that a wall holds at a corner, its pressure counts less. */
#define PRESSED  0.1
#define ONE_SIDE 0.1
/* Motions have a largest entry of 1: what a moment tells of one is no less. */
#define TOLD 0.02

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

double uz_bound_work_on(const uz_bound_body *body, int motion, int64_t edge, double at[UZ_BOUND_MOMENTS][2])
{
    static const double AXIS[2][2] = {{1, 0}, {0, 1}};
    double work = 0;
    for (int a = 0; a <= body->degree; a++)
        for (int c = 0; c < 2; c++)
            work += at[a][c] * uz_bound_moved(body, motion, edge, a, AXIS[c]);
    return work;
}

/* What presses at a moment does on the motions, less what the moments that were chosen before say of them: in the
 * motions' own coordinates, from which the directions of `chosen` (count x n_loose, orthonormal) are taken. Returns its
 * size. */
static double new_part(double by[UZ_BOUND_LOOSE], const uz_bound_body *body, int64_t edge, int a,
                       double chosen[][UZ_BOUND_LOOSE], int count)
{
    double size = 0, one[UZ_BOUND_MOMENTS] = {0}, acts[UZ_BOUND_MOMENTS][2];
    one[a] = 1;
    uz_bound_acts(acts, body, edge, one);
    for (int k = 0; k < body->n_loose; k++)
        by[k] = uz_bound_work_on(body, k, edge, acts);
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

void uz_bound_pressure_at_moments(double *out, const uz_bound_body *body, const double *pressure)
{
    const int moments = body->degree + 1;
    double hardest = 0;
    for (int64_t i = 0; i < body->model->mesh.n_nodes; i++)
        hardest = fmax(hardest, pressure[i]);
    for (int64_t k = 0; k < body->n_edges * moments; k++) {
        const int64_t *node = body->edge[k / moments].node;
        const double part = ((int)(k % moments) + 1.) / (moments + 1);
        double ends[2] = {pressure[node[0]], pressure[node[1]]}, between = part;
        if (node[2] >= 0) { /* the half that it is in */
            ends[part < 0.5 ? 1 : 0] = pressure[node[2]];
            between = part < 0.5 ? 2 * part : 2 * part - 1;
        }
        const bool surely = (between > 0 ? fmin(ends[0], ends[1]) : ends[0]) > PRESSED * hardest;
        out[k] = (surely ? 1 : ONE_SIDE) * ((1 - between) * ends[0] + between * ends[1]);
    }
}

void uz_bound_hold(uz_bound_body *body, const double *pressure)
{
    const int moments = body->degree + 1;
    double chosen[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE];
    body->n_pressed = 0;
    for (int count = 0; count < body->n_loose; count++) {
        double best = 0, told = 0, by[UZ_BOUND_LOOSE];
        for (int64_t k = 0; k < body->n_edges * moments; k++) {
            const int64_t i = k / moments;
            const int a = (int)(k % moments);
            const uz_bound_edge *edge = &body->edge[i];
            const double p = pressure[k] * uz_bound_weight(body, i, a);
            if (edge->contact < 0 || !edge->presses || edge->held[0] || !(p > 0))
                continue;
            const double size = new_part(by, body, i, a, chosen, count);
            if (sqrt(p) * size > best) {
                best = sqrt(p) * size;
                told = size;
                body->pressed[count] = k;
            }
        }
        if (!(told > TOLD)) {
            snprintf(body->why, sizeof body->why,
                     "only obstacles hold the body, and it presses on too few edges of them");
            return;
        }
        new_part(chosen[count], body, body->pressed[count] / moments, (int)(body->pressed[count] % moments), chosen,
                 count);
        for (int k = 0; k < body->n_loose; k++)
            chosen[count][k] /= told;
        body->pressed_at[count] = NAN;
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
