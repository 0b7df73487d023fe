/* cycle.c: one V-cycle. */
#include "amg/multigrid_private.h"

#include <string.h>

/* Downwards: one sweep from 0, x = (D + L)^-1 b, then the residual to the next level, coarse = P'(b - A x). All of the
 * residual but -L'x is 0. A dof whose inverse is 0 stays at 0. t: room. */
static void descend(double *x, double *coarse, double *t, const uz_level *level, const uz_csc *A, const double *b,
                    int k)
{
    const double *inverse = level->inverse;
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
        for (int64_t e = level->ptr[i]; e < level->ptr[i + 1]; e++) {
            double *to = coarse + (int64_t)level->block[e] * k;
            const float *value = level->value + e * k;
            for (int c = 0; c < k; c++)
                to[c] += t[i] * (double)value[c];
        }
}

/* Upwards: x += P coarse, then a sweep backwards, x = (D + L')^-1 (b - L x). t: room. */
static void ascend(double *x, const double *coarse, double *t, const uz_level *level, const uz_csc *A, const double *b,
                   int k)
{
    for (int64_t i = 0; i < level->n; i++) {
        double sum = 0.0;
        for (int64_t e = level->ptr[i]; e < level->ptr[i + 1]; e++) {
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
        x[j] = level->inverse[j] * sum;
    }
}

uz_status uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                             const double *r, uz_error *err)
{
    int last = mg->levels - 1;
    for (int l = 0; l < last; l++) {
        const uz_level *level = &mg->level[l];
        const uz_csc *A = l == 0 ? K : &level->A;
        double *x = l == 0 ? z : room->x[l];
        descend(x, room->b[l + 1], room->t[l], level, A, l == 0 ? r : room->b[l], mg->k);
    }
    double *coarse = room->t[last];
    uz_factor_permute(mg->coarsest, coarse, last == 0 ? r : room->b[last]);
    uz_status status = uz_factor_solve_one(mg->coarsest, room->ws, coarse, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(mg->coarsest, room->ws, coarse, false, err);
    uz_factor_unpermute(mg->coarsest, last == 0 ? z : room->x[last], coarse);
    if (last == 0) {
        /* Where K itself is the coarsest matrix: held dofs are rows of the unit matrix there. */
        const uz_level *level = &mg->level[0];
        for (int64_t j = 0; j < level->n; j++)
            z[j] = level->inverse[j] > 0.0 ? z[j] : 0.0;
    }
    for (int l = last - 1; l >= 0; l--) {
        const uz_level *level = &mg->level[l];
        double *x = l == 0 ? z : room->x[l];
        ascend(x, room->x[l + 1], room->t[l], level, l == 0 ? K : &level->A, l == 0 ? r : room->b[l], mg->k);
    }
    return status;
}
