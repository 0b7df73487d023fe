#include "certificate/row_relax.h"

#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/row_move.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { CLOSING_SWEEPS = 200, LIFTING_SWEEPS = 400 };

/* What the rounding of c may do to the gap of row i. */
static double gap_rounding(const uz_row_relax *x, int64_t i)
{
    double sum = 0.0;
    for (int64_t k = x->Nt->ptr[i]; k < x->Nt->ptr[i + 1]; k++)
        sum += 4.0 * DBL_EPSILON * fabs(x->Nt->val[k] * x->c[x->Nt->idx[k]]);
    return sum;
}

/* One pass over the rows. closing: a row may pull as much as r_i; otherwise rows only push more. Returns the largest
 * change of c, squared, in the norm of W^-1. */
static double sweep(uz_row_relax *x, bool closing)
{
    double largest = 0.0;
    for (int64_t i = 0; i < x->Nt->cols; i++) {
        double compliance = uz_row_compliance(x->Nt, i, x->weight), rounding = gap_rounding(x, i),
               gap = uz_gap_of_row(x->Nt, i, x->h, x->u, x->c);
        if (!(compliance > 0.0) || (uz_row_is_open(gap) && !closing))
            continue;
        double change = (uz_row_penetrates(gap) ? rounding - gap : -gap) / compliance;
        if (closing)
            change = fmax(change, x->r[i] - x->push[i]);
        x->push[i] += change;
        for (int64_t k = x->Nt->ptr[i]; k < x->Nt->ptr[i + 1]; k++)
            x->c[x->Nt->idx[k]] -= change * x->weight[x->Nt->idx[k]] * x->Nt->val[k];
        largest = fmax(largest, change * change * compliance);
    }
    return largest;
}

void uz_row_relax_solve(uz_row_relax *x)
{
    double first = 0.0, change = INFINITY;
    memset(x->push, 0, (size_t)x->Nt->cols * sizeof *x->push);
    memset(x->c, 0, (size_t)x->Nt->rows * sizeof *x->c);
    for (int k = 0; k < CLOSING_SWEEPS && change > first * 0x1p-60; k++) {
        change = sweep(x, true);
        first = fmax(first, change);
    }
    for (int k = 0; k < LIFTING_SWEEPS && change > 0.0; k++)
        change = sweep(x, false);
}
