/* cycle.c: one V-cycle on smoothed aggregates, with some dofs held. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"

#include <stdlib.h>
#include <string.h>

/* Downwards: one sweep from 0, x = (D + L)^-1 b, then the residual to the next level, coarse = P'(b - A x). All of the
 * residual but -L'x is 0. A dof whose inverse is 0 stays at 0. t: room. */
static void descend(double *x, double *coarse, double *t, const uz_level *level, const double *inverse, const uz_csc *A,
                    const double *b, int k)
{
    memcpy(t, b, (size_t)A->cols * sizeof *t);
    for (int64_t j = 0; j < A->cols; j++) {
        double value = x[j] = inverse[j] * t[j];
        for (int64_t q = A->ptr[j] + 1; q < A->ptr[j + 1]; q++)
            t[A->idx[q]] -= A->val[q] * value;
    }
    for (int64_t j = 0; j < A->cols; j++) {
        double sum = 0.0;
        for (int64_t q = A->ptr[j] + 1; q < A->ptr[j + 1]; q++)
            sum += A->val[q] * x[A->idx[q]];
        t[j] = -sum;
    }
    memset(coarse, 0, (size_t)(level->aggregates * k) * sizeof *coarse);
    for (int64_t i = 0; i < level->n; i++)
        for (int64_t e = level->ptr[i]; inverse[i] > 0.0 && e < level->ptr[i + 1]; e++) {
            double *to = coarse + (int64_t)level->block[e] * k;
            const float *value = level->value + e * k;
            for (int c = 0; c < k; c++)
                to[c] += t[i] * (double)value[c];
        }
}

/* Upwards: x += P coarse, then a sweep backwards, x = (D + L')^-1 (b - L x). t: room. */
static void ascend(double *x, const double *coarse, double *t, const uz_level *level, const double *inverse,
                   const uz_csc *A, const double *b, int k)
{
    for (int64_t i = 0; i < level->n; i++) {
        double sum = 0.0;
        for (int64_t e = level->ptr[i]; inverse[i] > 0.0 && e < level->ptr[i + 1]; e++) {
            const double *from = coarse + (int64_t)level->block[e] * k;
            const float *value = level->value + e * k;
            for (int c = 0; c < k; c++)
                sum += from[c] * (double)value[c];
        }
        x[i] += sum;
    }
    memcpy(t, b, (size_t)A->cols * sizeof *t);
    for (int64_t j = 0; j < A->cols; j++) {
        double value = x[j];
        for (int64_t q = A->ptr[j] + 1; q < A->ptr[j + 1]; q++)
            t[A->idx[q]] -= A->val[q] * value;
    }
    for (int64_t j = A->cols - 1; j >= 0; j--) {
        double sum = t[j];
        for (int64_t q = A->ptr[j] + 1; q < A->ptr[j + 1]; q++)
            sum -= A->val[q] * x[A->idx[q]];
        x[j] = inverse[j] * sum;
    }
}

static uz_status apply(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const int last = base->levels - 1;
    for (int l = 0; l < last; l++) {
        const uz_level *level = &mg->level[l];
        const double *inverse = l == 0 && room->inverse ? room->inverse : level->inverse;
        double *x = l == 0 ? z : room->x[l];
        descend(x, room->b[l + 1], room->t[l], level, inverse, l == 0 ? K : &level->A, l == 0 ? r : room->b[l], mg->k);
    }
    const uz_factor *coarsest = room->coarse ? room->coarse : mg->coarsest;
    double *coarse = room->t[last];
    uz_factor_permute(coarsest, coarse, last == 0 ? r : room->b[last]);
    uz_status status = uz_factor_solve_one(coarsest, room->ws, coarse, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(coarsest, room->ws, coarse, false, err);
    uz_factor_unpermute(coarsest, last == 0 ? z : room->x[last], coarse);
    for (int64_t j = 0; last == 0 && room->inverse && j < base->n; j++)
        z[j] = room->inverse[j] > 0.0 ? z[j] : 0.0;
    for (int l = last - 1; l >= 0; l--) {
        const uz_level *level = &mg->level[l];
        const double *inverse = l == 0 && room->inverse ? room->inverse : level->inverse;
        double *x = l == 0 ? z : room->x[l];
        ascend(x, room->x[l + 1], room->t[l], level, inverse, l == 0 ? K : &level->A, l == 0 ? r : room->b[l], mg->k);
    }
    return status;
}

uz_status uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                             const double *r, uz_error *err)
{
    return mg->kind->apply(mg, K, room, z, r, err);
}

static void multiply(const uz_multigrid *mg, const uz_csc *K, double *y, const double *x)
{
    memset(y, 0, (size_t)mg->n * sizeof *y);
    uz_csc_symv(y, K, 1.0, x);
}

static void free_room(uz_multigrid_room *room)
{
    if (!room)
        return;
    uz_factor_workspace_free(room->ws);
    for (int l = 0; l < UZ_LEVELS_MOST; l++) {
        free(room->t[l]);
        free(room->x[l]);
        free(room->b[l]);
    }
    free(room->inverse);
    uz_factor_free(room->coarse);
    free(room);
}

static uz_multigrid_room *make_room(const uz_multigrid *base, size_t *bytes)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    uz_multigrid_room *room = uz_alloc_zero(1, sizeof *room);
    bool ok = room && (room->ws = uz_factor_workspace_new());
    *bytes = sizeof *room;
    for (int l = 0; ok && l < base->levels; l++) {
        const int64_t n = mg->level[l].n;
        room->t[l] = uz_alloc(n, sizeof(double));
        room->x[l] = uz_alloc(l > 0 ? n : 0, sizeof(double));
        room->b[l] = uz_alloc(l > 0 ? n : 0, sizeof(double));
        ok = room->t[l] && room->x[l] && room->b[l];
        *bytes += (l > 0 ? 24 : 8) * (size_t)n;
    }
    if (ok)
        return room;
    free_room(room);
    return NULL;
}

static uz_status hold(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, const bool *held,
                      size_t *bytes, const uz_stop *stop, uz_error *err)
{
    const uz_level *level = &((const uz_aggregates *)base)->level[0];
    free(room->inverse);
    uz_factor_free(room->coarse);
    room->inverse = NULL;
    room->coarse = NULL;
    *bytes = 0;
    if (!held)
        return UZ_OK;
    room->inverse = uz_alloc(level->n, sizeof *room->inverse);
    if (!room->inverse)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld dofs", (long long)level->n);
    *bytes = 8 * (size_t)level->n;
    for (int64_t j = 0; j < level->n; j++)
        room->inverse[j] = held[j] ? 0.0 : level->inverse[j];
    if (base->levels > 1)
        return UZ_OK;
    /* Where K itself is the coarsest matrix: held dofs become rows of the unit matrix. */
    uz_csc alone = {0};
    uz_status status = uz_csc_copy(&alone, K, err);
    for (int64_t j = 0; status == UZ_OK && j < level->n; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            if (held[j] || held[K->idx[q]])
                alone.val[q] = K->idx[q] == j ? 1.0 : 0.0;
    if (status == UZ_OK)
        status = uz_factor_coarsest(&room->coarse, &alone, 0, stop ? stop->hooks : NULL, err);
    if (status == UZ_OK)
        *bytes += uz_factor_describe(room->coarse).bytes;
    uz_csc_clear(&alone);
    return status;
}

static void free_aggregates(uz_multigrid *base)
{
    uz_aggregates *mg = (uz_aggregates *)base;
    for (int l = 0; l < UZ_LEVELS_MOST; l++) {
        uz_csc_clear(&mg->level[l].A);
        free(mg->level[l].inverse);
        free(mg->level[l].ptr);
        free(mg->level[l].block);
        free(mg->level[l].value);
    }
    uz_factor_free(mg->coarsest);
    free(mg);
}

const uz_multigrid_kind uz_aggregates_kind = {.apply = apply,
                                              .multiply = multiply,
                                              .room = make_room,
                                              .free_room = free_room,
                                              .hold = hold,
                                              .free = free_aggregates};
