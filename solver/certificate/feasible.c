/* feasible.c: a displacement without penetration, near a given one. */
#include "certificate/feasible.h"

#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/row_exact.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAST_ROUNDS = 2, MAX_ROUNDS = 8 };

/* Double-double arithmetic carries about 100 bits: a violation of the constraints by 2^-80 of their size is rounding.
 */
#define NEGLIGIBLE 0x1p-80

/* Words multiplied before rows are moved apart instead: 50 ms. */
#define LITTLE_WORK 1e6
/* Of the size of a row: a gap that double-double arithmetic surely tells from a penetration, too small for a bound. */
#define APART 0x1p-90

/* Corrections up to this many times as large, squared, as the moves of single rows are taken. */
#define STRETCH 64.0

uz_status uz_touched_dofs(uz_csc *Nt, int64_t **dof, const uz_csc *N, uz_error *err)
{
    uz_csc touched = *N; /* without its empty columns */
    memset(Nt, 0, sizeof *Nt);
    int64_t count = 0;
    for (int64_t j = 0; N->ptr && j < N->cols; j++)
        count += N->ptr[j + 1] > N->ptr[j];
    touched.cols = 0;
    touched.ptr = uz_alloc(count + 1, sizeof *touched.ptr);
    *dof = uz_alloc(count, sizeof **dof);
    uz_status status = UZ_OK;
    if (touched.ptr && *dof) {
        touched.ptr[0] = 0;
        for (int64_t j = 0; N->ptr && j < N->cols; j++) {
            if (N->ptr[j + 1] == N->ptr[j])
                continue;
            (*dof)[touched.cols++] = j;
            touched.ptr[touched.cols] = N->ptr[j + 1];
        }
        status = uz_csc_transpose(Nt, &touched, err);
    } else {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)N->cols);
    }
    free(touched.ptr);
    if (status != UZ_OK) {
        free(*dof);
        *dof = NULL;
    }
    return status;
}

bool uz_feasible_init(uz_feasible *c, const uz_csc *Nt, const double *weight)
{
    memset(c, 0, sizeof *c);
    c->Nt = Nt;
    c->weight = weight;
    c->d = Nt->rows;
    c->m = Nt->cols;
    c->size = uz_alloc_zero(c->m, sizeof(double));
    c->correction = uz_alloc_zero(c->d, sizeof(double));
    c->push = uz_alloc_zero(c->m, sizeof(double));
    c->gap = uz_alloc_zero(c->m, sizeof(double));
    return uz_row_move_init(&c->move, c->d, c->m) && c->size && c->correction && c->push && c->gap;
}

void uz_feasible_clear(uz_feasible *c)
{
    uz_free_all(c->size, c->correction, c->push, c->gap);
    uz_row_move_clear(&c->move);
}

double uz_feasible_complementarity(const uz_feasible *c, const double *r, bool settled)
{
    const bool moved = settled && c->exact.length > 0.0;
    double sum = 0.0;
    for (int64_t i = 0; i < c->m; i++) {
        const double gap = moved ? c->gap[i] : fabs(uz_gap_of_row(c->Nt, i, c->h, c->u, c->correction)),
                     product = -r[i] * gap;
        sum += r[i] != 0.0 && gap > 0.0 ? fmax(product, DBL_MIN) : product; /* never 0 by underflow */
    }
    return sum;
}

/* The rows to move in this round and by how much: target_i is the gap to take away and a little more, so that the
 * correction's own rounding leaves the gap open; 0 for rows left alone. apart: gaps to be left, in sizes of their rows.
 * Returns the worst violation, relative to the size of its row. */
static double choose_rows(const uz_feasible *c, const double *r, double apart)
{
    double worst = 0.0;
    for (int64_t i = 0; i < c->m; i++) {
        const double gap = uz_gap_of_row(c->Nt, i, c->h, c->u, c->correction);
        /* closing a gap of g costs about g^2 / compliance in the bound, leaving it open costs -2 r g */
        const bool close = uz_row_presses(r[i]) && fabs(gap) <= -2.0 * r[i] * uz_row_compliance(c->Nt, i, c->weight);
        double moved = 0.0; /* what the rounding of the correction, a vector of doubles, may do is relative to this */
        c->move.in[i] = close || uz_row_penetrates(gap - apart * c->size[i]);
        for (int64_t k = c->Nt->ptr[i]; c->move.in[i] && k < c->Nt->ptr[i + 1]; k++)
            moved += fabs(c->Nt->val[k] * c->correction[c->Nt->idx[k]]);
        /* a row that is as open as it should be stays: moves of nothing but rounding, equation by equation, would not
         * end where other rows, on dofs that hardly move, are far smaller than that */
        const double open = apart * c->size[i] + 4.0 * DBL_EPSILON * moved, near = 3.0 * DBL_EPSILON * moved;
        const bool moves = c->move.in[i] && !(fabs(gap - open) <= near);
        c->move.target[i] = moves ? gap - open : 0.0;
        worst = isnan(gap) ? INFINITY : uz_row_penetrates(gap) ? fmax(worst, -gap / c->size[i]) : worst;
    }
    return worst;
}

/* Rounds of equations. Each starts from gaps in double-double precision, so what rounding left is moved by the next.
 * True when no gap of u + c is negative by more than the rounding of double-double arithmetic. */
static bool move_rows(uz_feasible *c, const double *r)
{
    for (int round = 0; round < MAX_ROUNDS; round++) {
        double worst = choose_rows(c, r, 0.0);
        if (round >= LEAST_ROUNDS && worst <= NEGLIGIBLE)
            return true;
        if (!uz_row_move_solve(&c->move, c->correction, c->Nt, c->weight) && round < LEAST_ROUNDS)
            return false;
    }
    return choose_rows(c, r, 0.0) <= NEGLIGIBLE;
}

/* Does u + c, but for a delta that it bounds, have no penetration at all? work: as in row_settle.h. */
static bool settle(uz_feasible *c, double work)
{
    c->exact = (uz_row_settle){
        .Nt = c->Nt, .weight = c->weight, .h = c->h, .u = c->u, .c = c->correction, .gap = c->gap, .work = work};
    return uz_row_settle_solve(&c->exact);
}

/* Rows that depend on each other, or nearly so, can't all be closed as equations, or only by a correction far larger
 * than the gaps; and in long chains of rows conjugate gradients take a step for each. Then an active set chooses. */
bool uz_make_feasible(uz_feasible *c, const double *r)
{
    const uz_row_exact exact = {c->Nt, c->weight, r, c->h, c->u, c->size, NEGLIGIBLE, c->correction, c->push};
    double expected = 0.0, size = 0.0; /* squared in the norm of W^-1 */
    c->pushed = false;
    /* What the rounding of a gap is relative to: the terms that it is the difference of. Row by row: a wide gap, or a
     * row of large coefficients, must not excuse the penetration of another row. */
    for (int64_t i = 0; i < c->m; i++) {
        c->size[i] = fabs(c->h[i]);
        for (int64_t k = c->Nt->ptr[i]; k < c->Nt->ptr[i + 1]; k++)
            c->size[i] += fabs(c->Nt->val[k] * c->u[c->Nt->idx[k]]);
    }
    memset(c->correction, 0, (size_t)c->d * sizeof *c->correction);
    choose_rows(c, r, 0.0);
    for (int64_t i = 0; i < c->m; i++) /* the moves that would close the chosen rows one by one, added up */
        if (c->move.in[i] && c->move.target[i] != 0.0)
            expected += c->move.target[i] / uz_row_compliance(c->Nt, i, c->weight) * c->move.target[i];
    bool feasible = move_rows(c, r);
    for (int64_t j = 0; j < c->d; j++)
        size += c->correction[j] / c->weight[j] * c->correction[j];
    if (feasible && size <= STRETCH * expected) {
        if (settle(c, LITTLE_WORK))
            return true;
        /* Rows that hang together take long in rational numbers, as each that is moved moves its neighbours. Moved
         * apart a little more, they need none. */
        for (int round = 0; round < MAX_ROUNDS && choose_rows(c, r, APART) > 0.0; round++)
            uz_row_move_solve(&c->move, c->correction, c->Nt, c->weight);
        if (choose_rows(c, r, APART) == 0.0 && settle(c, 0))
            return true;
    }
    c->pushed = uz_row_exact_solve(&exact) && settle(c, 0);
    if (c->pushed)
        return true;
    memset(c->correction, 0, (size_t)c->d * sizeof *c->correction);
    return feasible && move_rows(c, r) && settle(c, 0);
}
