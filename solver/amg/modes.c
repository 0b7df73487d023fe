/* modes.c: which dofs belong together, and the displacements that K hardly resists. */
#include "amg/amg.h"

#include "core/alloc.h"
#include "core/error.h"
#include "factor/factor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Square elements reach all their neighbours at this, and cubes and tetrahedra at a smaller one: aggregates of 26 nodes
 * instead of 10 on tet4, whose next level else has more numbers than K. Where elements are stretched a larger one is
 * needed (amg.h). */
#define STRONG       0.08
#define STRONG_SOLID 0.02

void uz_modes_clear(uz_modes *modes)
{
    free(modes->node);
    free(modes->value);
    memset(modes, 0, sizeof *modes);
}

static uz_status allocate(uz_modes *modes, int64_t n, int count, uz_error *err)
{
    modes->count = count;
    modes->strong = count == UZ_MODES_MOST ? STRONG_SOLID : STRONG;
    modes->node = uz_alloc(n, sizeof *modes->node);
    modes->value = uz_alloc_zero(n * count, sizeof *modes->value);
    if (modes->node && modes->value)
        return UZ_OK;
    uz_modes_clear(modes);
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for the modes of %lld dofs", (long long)n);
}

uz_status uz_modes_of_matrix(uz_modes *out, const uz_csc *K, uz_error *err)
{
    int64_t n = K->cols, most = 0, *head = uz_alloc(n, sizeof *head), *place = uz_alloc(n, sizeof *place);
    int32_t *node = uz_alloc(n, sizeof *node);
    uz_status status = UZ_ERR_MEMORY;
    memset(out, 0, sizeof *out);
    if (head && place && node && uz_group_dofs(head, K, NULL, 0)) {
        /* node[i]: the number of i's group; place[i]: how many of its group come before i, and while it counts, of the
         * first of a group the next place; most: the largest group. */
        int64_t groups = 0;
        for (int64_t i = 0; i < n; i++) {
            const bool first = head[i] == i;
            node[i] = first ? (int32_t)groups++ : node[head[i]];
            place[i] = first ? 1 : place[head[i]]++;
        }
        for (int64_t i = 0; i < n; i++) {
            place[i] = head[i] == i ? 0 : place[i];
            most = place[i] + 1 > most ? place[i] + 1 : most;
        }
        int count = most <= 3 ? (int)most : 1; /* larger groups are dense blocks, not nodes */
        status = allocate(out, n, count, err);
        out->n_nodes = groups;
        for (int64_t i = 0; status == UZ_OK && i < n; i++) {
            out->node[i] = count == most ? node[i] : (int32_t)i;
            out->value[i * count + (count == most ? place[i] : 0)] = 1.0F;
        }
        if (count != most)
            out->n_nodes = n;
    }
    uz_free_all(head, place, node);
    return status == UZ_ERR_MEMORY ? uz_fail(err, status, "K", "no memory for %lld dofs", (long long)n) : status;
}

uz_status uz_modes_of_body(uz_modes *out, const double *xyz, const int64_t *dof, int64_t n_nodes, int dim, int64_t n,
                           uz_error *err)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0.0;
    int count = dim == 2 ? 3 : 6;
    memset(out, 0, sizeof *out);
    uz_status status = allocate(out, n, count, err);
    if (status != UZ_OK)
        return status;
    out->n_nodes = n_nodes;
    out->xyz = xyz;
    out->dim = dim;
    for (int64_t i = 0; i < n_nodes * dim; i++) {
        low[i % dim] = fmin(low[i % dim], xyz[i]);
        high[i % dim] = fmax(high[i % dim], xyz[i]);
    }
    for (int axis = 0; axis < dim; axis++)
        size = fmax(size, high[axis] - low[axis]);
    for (int64_t i = 0; i < n_nodes * dim; i++) {
        double x[3] = {0};
        if (dof[i] < 0)
            continue;
        for (int axis = 0; axis < dim; axis++)
            x[axis] = (xyz[i / dim * dim + axis] - 0.5 * (low[axis] + high[axis])) / (size > 0.0 ? size : 1.0);
        out->node[dof[i]] = (int32_t)(i / dim);
        /* The displacement along this axis of a node at x in each rigid-body mode. */
        const int axis = (int)(i % dim);
        float *value = out->value + dof[i] * count;
        value[axis] = 1.0F;
        if (dim == 2)
            value[2] = (float)(axis == 0 ? -x[1] : x[0]);
        for (int turn = 0; turn < 3 && dim == 3; turn++) { /* e_turn x x */
            const int a = (turn + 1) % 3, b = (turn + 2) % 3;
            value[3 + turn] = (float)(axis == a ? -x[b] : axis == b ? x[a] : 0.0);
        }
    }
    return UZ_OK;
}
