#include "certificate/row_move.h"

#include "core/alloc.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_STEPS = 100 };

double uz_row_compliance(const uz_csc *Nt, int64_t i, const double *weight)
{
    double sum = 0.0;
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
        sum += Nt->val[k] * Nt->val[k] * weight[Nt->idx[k]];
    return sum;
}

bool uz_row_move_init(uz_row_move *move, int64_t d, int64_t m)
{
    memset(move, 0, sizeof *move);
    move->m = m;
    move->in = uz_alloc_zero(m, sizeof(bool));
    move->dofs = uz_alloc_zero(d, sizeof(double));
    double **room[] = {&move->target, &move->x, &move->residual, &move->direction, &move->image, &move->scale};
    bool ok = move->in && move->dofs;
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        ok = (*room[k] = uz_alloc_zero(m, sizeof(double))) && ok;
    return ok;
}

void uz_row_move_clear(uz_row_move *move)
{
    uz_free_all(move->target, move->x, move->residual, move->direction, move->image, move->scale, move->dofs);
    free(move->in);
    memset(move, 0, sizeof *move);
}

/* dofs = W N'x over the rows that take part; only dofs of those rows are touched. */
static void spread(uz_row_move *move, const double *x, const uz_csc *Nt, const double *weight)
{
    for (int64_t i = 0; i < move->m; i++)
        for (int64_t k = Nt->ptr[i]; move->in[i] && k < Nt->ptr[i + 1]; k++)
            move->dofs[Nt->idx[k]] = 0.0;
    for (int64_t i = 0; i < move->m; i++)
        for (int64_t k = Nt->ptr[i]; move->in[i] && k < Nt->ptr[i + 1]; k++)
            move->dofs[Nt->idx[k]] += weight[Nt->idx[k]] * Nt->val[k] * x[i];
}

bool uz_row_move_solve(uz_row_move *move, double *c, const uz_csc *Nt, const double *weight)
{
    double rho = 0.0; /* residual'scale residual */
    for (int64_t i = 0; i < move->m; i++) {
        const double size = uz_row_compliance(Nt, i, weight);
        move->scale[i] = move->in[i] && size > 0.0 ? 1.0 / size : 0.0; /* 0 for rows out of play */
        move->x[i] = 0.0;
        move->residual[i] = move->target[i];
        move->direction[i] = move->scale[i] * move->residual[i];
        rho += move->residual[i] * move->direction[i];
    }
    const double stop = rho * DBL_EPSILON * DBL_EPSILON;
    for (int step = 0; step < MAX_STEPS && rho > stop; step++) {
        double curvature = 0.0, next = 0.0;
        spread(move, move->direction, Nt, weight);
        for (int64_t i = 0; i < move->m; i++) { /* image = N W N'direction */
            double sum = 0.0;
            for (int64_t k = Nt->ptr[i]; move->in[i] && k < Nt->ptr[i + 1]; k++)
                sum += Nt->val[k] * move->dofs[Nt->idx[k]];
            move->image[i] = sum;
            curvature += move->direction[i] * sum;
        }
        if (!(curvature > 0.0))
            break;
        const double length = rho / curvature;
        for (int64_t i = 0; i < move->m; i++) {
            move->x[i] += length * move->direction[i];
            move->residual[i] -= length * move->image[i];
            next += move->residual[i] * move->scale[i] * move->residual[i];
        }
        for (int64_t i = 0; i < move->m; i++)
            move->direction[i] = move->scale[i] * move->residual[i] + next / rho * move->direction[i];
        rho = next;
    }
    spread(move, move->x, Nt, weight);
    for (int64_t i = 0; i < move->m; i++)
        for (int64_t k = Nt->ptr[i]; move->in[i] && k < Nt->ptr[i + 1]; k++) {
            int64_t j = Nt->idx[k];
            c[j] += move->dofs[j];
            move->dofs[j] = 0.0; /* a dof of several rows is added once */
        }
    return rho <= stop;
}
