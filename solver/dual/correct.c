/* correct.c: a small displacement that closes or opens gaps, row by row. */
#include "dual/dual_private.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { MAX_SWEEPS = 60 };

static double column_dot(const uz_csc *Nt, int64_t i, const double *x)
{
    double sum = 0.0;
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
        sum += Nt->val[k] * x[Nt->idx[k]];
    return sum;
}

/* n_i'W n_i */
static double row_weight(const uz_csc *Nt, int64_t i, const double *weight)
{
    double sum = 0.0;
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
        sum += Nt->val[k] * Nt->val[k] * weight[Nt->idx[k]];
    return sum;
}

/* One pass; returns the largest move relative to the largest target. */
static double sweep(double *c, const uz_csc *Nt, const double *weight, const double *g, const bool *close,
                    bool only_lift)
{
    double moved = 0.0;
    for (int64_t i = 0; i < Nt->cols; i++) {
        bool closing = close[i] && !only_lift;
        double miss = g[i] - column_dot(Nt, i, c);
        double weighted = row_weight(Nt, i, weight);
        if (weighted <= 0.0 || (!closing && miss >= 0.0))
            continue;
        for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
            c[Nt->idx[k]] += miss / weighted * weight[Nt->idx[k]] * Nt->val[k];
        moved = fmax(moved, fabs(miss));
    }
    return moved;
}

bool uz_correct_by_sweeps(double *c, double *Nc, const uz_csc *Nt, const double *weight, const double *g,
                          const bool *close)
{
    double scale = 0.0;
    memset(c, 0, (size_t)Nt->rows * sizeof *c);
    for (int64_t i = 0; i < Nt->cols; i++)
        if (close[i] || g[i] < 0.0)
            scale = fmax(scale, fabs(g[i]));
    double small = 8.0 * DBL_EPSILON * scale, moved = scale;
    for (int k = 0; k < MAX_SWEEPS && moved > small; k++)
        moved = sweep(c, Nt, weight, g, close, k >= MAX_SWEEPS / 2);
    bool feasible = true;
    for (int64_t i = 0; i < Nt->cols; i++) {
        Nc[i] = column_dot(Nt, i, c);
        if (g[i] - Nc[i] < -4.0 * small)
            feasible = false;
    }
    return feasible;
}
