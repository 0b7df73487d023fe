#include "run/transfer.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/box.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Weights below this are rounding. */
#define NO_WEIGHT 1e-9

/* What is known at the nodes of the coarse mesh, and of one that is refined from it also at its new ones. Grids of a
 * box: the coarse one's lattice. */
typedef struct {
    const uz_box *box;   /* NULL: ... */
    const uz_mesh *fine; /* ... refined by bisection */
    uz_box_lattice lattice;
    int step; /* in the lattice, between points of the lines */
    double *line[3];
    double *pressure; /* of one contact, at nodes of the coarse mesh, or the fine one */
} field;

/* Of a box's grid, with points at every node along its edges, or at corners of cells alone. False: no memory. */
static bool lay_lines(field *f, int points)
{
    bool room = true;
    f->lattice = uz_box_lattice_of(f->box);
    f->step = f->lattice.order / points;
    for (int axis = 0; axis < f->box->dim; axis++)
        room = (f->line[axis] = uz_box_lines(f->box, axis, points)) && room;
    return room;
}

static void clear_lines(field *f)
{
    for (int axis = 0; axis < 3; axis++)
        free(f->line[axis]);
}

/* Linear along each axis between the points of the lines. value: of node i at [stride * i]. */
static double value_at(const field *f, const double *x, const double *value, int stride)
{
    const int dim = f->box->dim;
    int64_t low[3] = {0};
    double share[3] = {0}, sum = 0.0;
    for (int axis = 0; axis < dim; axis++) { /* the lines' cell that x lies in, and where in it, 0 to 1 */
        const double *line = f->line[axis];
        int64_t high = f->lattice.order / f->step * f->box->cells[axis];
        while (high - low[axis] > 1) {
            const int64_t middle = low[axis] + (high - low[axis]) / 2;
            if (line[middle] <= x[axis])
                low[axis] = middle;
            else
                high = middle;
        }
        const double *from = line + low[axis];
        share[axis] = fmin(1.0, fmax(0.0, (x[axis] - from[0]) / (from[1] - from[0])));
    }
    for (int corner = 0; corner < 1 << dim; corner++) {
        int64_t at[3] = {0};
        double weight = 1.0;
        for (int axis = 0; axis < dim; axis++) {
            const int up = corner >> axis & 1;
            at[axis] = f->step * (low[axis] + up);
            weight *= up ? share[axis] : 1.0 - share[axis];
        }
        const int64_t node = weight > NO_WEIGHT ? uz_box_node(&f->lattice, at) : -1;
        if (node >= 0)
            sum += weight * value[stride * node];
    }
    return sum;
}

/* Puts the pressure of one contact at the nodes, or takes it away again. */
static void spread(field *f, const uz_result *result, int64_t contact, bool put)
{
    for (int64_t i = 0; i < result->m; i++)
        if (result->mesh.contact_of[i] == contact)
            f->pressure[result->mesh.contact_node[i]] = put ? result->pressure[i] : 0.0;
    for (int64_t i = result->n_nodes; f->fine && i < f->fine->n_nodes; i++)
        f->pressure[i] = uz_mesh_value_amid(f->fine, i, f->pressure, 1);
}

uz_status uz_transfer_start(uz_state **out, const uz_result *result, const uz_box *coarse, const uz_body_model *fine,
                            uz_error *err)
{
    const uz_mesh_info *rows = &fine->info;
    const int64_t m = fine->m;
    *out = NULL;
    bool known = result->pressure && result->mesh.contact_of;
    for (int64_t i = 0; known && i < result->m; i++)
        known = isfinite(result->pressure[i]); /* else infeasible */
    if (!known)
        return UZ_OK;
    field f = {.box = coarse, .fine = coarse ? NULL : &fine->mesh};
    uz_state *state = uz_alloc_zero(1, sizeof *state);
    f.pressure = uz_alloc_zero(coarse ? result->n_nodes : rows->n_nodes, sizeof *f.pressure);
    bool room = state && f.pressure && (state->r = uz_alloc(m, sizeof *state->r));
    room = (!coarse || lay_lines(&f, uz_box_lattice_of(coarse).order)) && room;
    int64_t contact = -1;
    for (int64_t i = 0; room && i < m; i++) { /* rows come contact by contact */
        if (rows->contact_of[i] != contact) {
            spread(&f, result, contact, false);
            contact = rows->contact_of[i];
            spread(&f, result, contact, true);
        }
        const int64_t node = rows->contact_node[i];
        const double pressure = coarse ? value_at(&f, rows->xyz + node * rows->dim, f.pressure, 1) : f.pressure[node];
        state->r[i] = -pressure * rows->contact_area[i];
    }
    clear_lines(&f);
    free(f.pressure);
    if (!room) {
        uz_state_free(state);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from the coarser grid");
    }
    state->m = m;
    *out = state;
    return UZ_OK;
}

/* What a state that is stored has besides its reactions: they are the best there are, and of D r nothing is known. */
static bool complete(uz_state *state, int64_t m)
{
    double **others[] = {&state->rho, &state->best_r, &state->anchor, &state->Dr, &state->Drho};
    for (int k = 0; k < 5; k++) {
        if (!(*others[k] = uz_alloc_zero(m, sizeof(double))))
            return false;
        if (k < 3)
            memcpy(*others[k], state->r, (size_t)m * sizeof *state->r);
    }
    return true;
}

uz_status uz_carry_start(uz_state **out, const uz_result *result, const uz_mesh_info *there, int64_t m, bool whole,
                         uz_error *err)
{
    const uz_mesh_info *here = &result->mesh;
    const bool places = here->contact_of != NULL;
    bool known = places || result->m == m;
    *out = NULL;
    for (int64_t i = 0; known && i < result->m; i++)
        known = isfinite(result->r[i]);
    if (!known)
        return UZ_OK;
    uz_state *state = uz_alloc_zero(1, sizeof *state);
    int64_t *row_at = uz_alloc_zero(here->n_nodes, sizeof *row_at); /* 1 + the first row at a node that is not taken */
    int64_t *next = uz_alloc(result->m, sizeof *next);
    bool room = state && row_at && next && (state->r = uz_alloc(m, sizeof *state->r));
    if (room && !places)
        memcpy(state->r, result->r, (size_t)m * sizeof *state->r);
    for (int64_t i = 0, first = 0, end; i < m && room && places; first = end) { /* rows come contact by contact */
        const int64_t contact = there->contact_of[i];
        while (first < result->m && here->contact_of[first] < contact)
            first++;
        for (end = first; end < result->m && here->contact_of[end] == contact; end++)
            continue;
        for (int64_t k = end - 1; k >= first; k--) {
            next[k] = row_at[here->contact_node[k]];
            row_at[here->contact_node[k]] = k + 1;
        }
        for (; i < m && there->contact_of[i] == contact; i++) {
            int64_t *at = &row_at[there->contact_node[i]];
            state->r[i] = *at > 0 ? result->r[*at - 1] : 0.0;
            *at = *at > 0 ? next[*at - 1] : 0;
        }
        for (int64_t k = first; k < end; k++)
            row_at[here->contact_node[k]] = 0;
    }
    uz_free_all(row_at, next);
    if (!room || (whole && !complete(state, m))) {
        uz_state_free(state);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from an answer with %lld contacts",
                       (long long)result->m);
    }
    state->m = m;
    state->tau = 1;
    state->step_norm = NAN;
    state->best_bound = state->best_relative = INFINITY;
    state->method = state->made_by = UZ_METHOD_AUTO;
    *out = state;
    return UZ_OK;
}

double *uz_carry_nodal(const uz_mesh *finer, const double *value, int64_t n_nodes, int stride)
{
    double *out = uz_alloc(finer->n_nodes * stride, sizeof *out);
    if (out)
        memcpy(out, value, (size_t)(n_nodes * stride) * sizeof *out);
    for (int64_t i = n_nodes; out && i < finer->n_nodes; i++)
        for (int c = 0; c < stride; c++)
            out[i * stride + c] = uz_mesh_value_amid(finer, i, out + c, stride);
    return out;
}

double *uz_carry_box(const uz_mesh *to, const uz_box *from, const double *u)
{
    field f = {.box = from};
    const int dim = to->dim;
    double *out = lay_lines(&f, 1) ? uz_alloc(to->n_nodes * dim, sizeof *out) : NULL;
    for (int64_t i = 0; i < to->n_nodes * dim && out; i++)
        out[i] = value_at(&f, to->xyz + i / dim * dim, u + i % dim, dim);
    clear_lines(&f);
    return out;
}
