/* blocked.c: substitutions for UZ_LANES right-hand sides at once.
 *
 * Each vector of the block is a lane: entry k of lane l stands at X[k * UZ_LANES + l], so that a row of the block is
 * one cache line and every entry of L is read once for all lanes. The lanes go through the same operations in the same
 * order whatever the others hold: the answer to a right-hand side depends neither on its neighbours nor on its place.
 * Compiled with contraction to fused multiply-add allowed (see the Makefile): here it only saves roundings. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/cpu.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Four lanes are what a register holds; a row of the block is two of them. */
typedef double lanes __attribute__((vector_size(32), aligned(8)));
enum { HALVES = UZ_LANES / 4 };
_Static_assert(HALVES == 2, "the loops below are written for two registers a row");

enum { PANEL = 4 }; /* columns of L at a time: their lanes stay in registers */

/* One supernode: rows x cols values, column-major; its rows of the block are gathered in b. */
typedef struct {
    const double *L;
    int64_t rows, cols;
    lanes *b; /* rows x HALVES */
} panel_of;

/* b = L^-1 b on the columns, and what that takes from the rows below. */
UZ_INLINE void eliminate(const panel_of *s)
{
    lanes *b = s->b;
    for (int64_t j = 0; j < s->cols; j += PANEL) {
        int64_t width = s->cols - j < PANEL ? s->cols - j : PANEL;
        const double *L = s->L + j * s->rows;
        for (int64_t k = 0; k < width; k++) {
            const double *of_k = L + k * s->rows;
            b[2 * (j + k)] /= of_k[j + k];
            b[2 * (j + k) + 1] /= of_k[j + k];
            const int64_t end = width == PANEL ? j + width : s->rows;
            for (int64_t i = j + k + 1; i < end; i++) {
                b[2 * i] -= of_k[i] * b[2 * (j + k)];
                b[2 * i + 1] -= of_k[i] * b[2 * (j + k) + 1];
            }
        }
        if (width < PANEL)
            break;
        const double *L0 = L, *L1 = L0 + s->rows, *L2 = L1 + s->rows, *L3 = L2 + s->rows;
        const lanes x0 = b[2 * j], x1 = b[2 * j + 2], x2 = b[2 * j + 4], x3 = b[2 * j + 6];
        const lanes y0 = b[2 * j + 1], y1 = b[2 * j + 3], y2 = b[2 * j + 5], y3 = b[2 * j + 7];
        for (int64_t i = j + PANEL; i < s->rows; i++) { /* the same for PANEL columns at once */
            const double l0 = L0[i], l1 = L1[i], l2 = L2[i], l3 = L3[i];
            b[2 * i] = b[2 * i] - l0 * x0 - l1 * x1 - l2 * x2 - l3 * x3;
            b[2 * i + 1] = b[2 * i + 1] - l0 * y0 - l1 * y1 - l2 * y2 - l3 * y3;
        }
    }
}

/* b_j -= L_ij b_i summed over the rows below PANEL columns from j on. */
UZ_INLINE void gather_panel(lanes *b, const double *L, int64_t rows, int64_t j)
{
    const double *L0 = L, *L1 = L0 + rows, *L2 = L1 + rows, *L3 = L2 + rows;
    lanes x0 = b[2 * j], x1 = b[2 * j + 2], x2 = b[2 * j + 4], x3 = b[2 * j + 6];
    lanes y0 = b[2 * j + 1], y1 = b[2 * j + 3], y2 = b[2 * j + 5], y3 = b[2 * j + 7];
    for (int64_t i = j + PANEL; i < rows; i++) {
        const lanes x = b[2 * i], y = b[2 * i + 1];
        x0 -= L0[i] * x;
        x1 -= L1[i] * x;
        x2 -= L2[i] * x;
        x3 -= L3[i] * x;
        y0 -= L0[i] * y;
        y1 -= L1[i] * y;
        y2 -= L2[i] * y;
        y3 -= L3[i] * y;
    }
    b += 2 * j;
    b[0] = x0;
    b[1] = y0;
    b[2] = x1;
    b[3] = y1;
    b[4] = x2;
    b[5] = y2;
    b[6] = x3;
    b[7] = y3;
}

/* b = L'^-1 b on the columns, the rows below being known. */
UZ_INLINE void substitute_back(const panel_of *s)
{
    lanes *b = s->b;
    int64_t rest = s->cols % PANEL, width = rest > 0 ? rest : PANEL;
    for (int64_t j = s->cols - width; j >= 0; j -= PANEL, width = PANEL) {
        const double *L = s->L + j * s->rows;
        if (width == PANEL)
            gather_panel(b, L, s->rows, j);
        for (int64_t k = width - 1; k >= 0; k--) {
            const double *of_k = L + k * s->rows;
            const int64_t end = width == PANEL ? j + width : s->rows;
            lanes x = b[2 * (j + k)], y = b[2 * (j + k) + 1];
            for (int64_t i = j + k + 1; i < end; i++) {
                x -= of_k[i] * b[2 * i];
                y -= of_k[i] * b[2 * i + 1];
            }
            b[2 * (j + k)] = x / of_k[j + k];
            b[2 * (j + k) + 1] = y / of_k[j + k];
        }
    }
}

UZ_AVX2_FMA static void eliminate_fused(const panel_of *s)
{
    eliminate(s);
}

UZ_AVX2_FMA static void substitute_back_fused(const panel_of *s)
{
    substitute_back(s);
}

typedef void (*panel_step)(const panel_of *s);

/* Rows of the block to and from room. */
static void gather_rows(double *to, const double *from, const SuiteSparse_long *rows, int64_t count)
{
    for (int64_t i = 0; i < count; i++)
        memcpy(to + i * UZ_LANES, from + rows[i] * UZ_LANES, UZ_LANES * sizeof *to);
}

static void scatter_rows(double *to, const double *from, const SuiteSparse_long *rows, int64_t count)
{
    for (int64_t i = 0; i < count; i++)
        memcpy(to + rows[i] * UZ_LANES, from + i * UZ_LANES, UZ_LANES * sizeof *to);
}

/* A substitution under way. */
typedef struct {
    const uz_factor *factor;
    bool forward;
    int64_t blocks;
    double *X[UZ_SHARES], *room[UZ_SHARES]; /* of each share; X: blocks x n x UZ_LANES */
} substitution;

/* The largest number of rows of a supernode, whose lanes room has to hold. */
static int64_t most_rows(const cholmod_factor *L)
{
    const SuiteSparse_long *pi = L->pi;
    int64_t most = 0;
    for (size_t k = 0; k < L->nsuper; k++)
        most = pi[k + 1] - pi[k] > most ? pi[k + 1] - pi[k] : most;
    return most;
}

/* By the supernodes of a share, `all`: by all of them. */
static void substitute(const substitution *x, int share, bool all)
{
    const cholmod_factor *L = &x->factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *s = L->s;
    const int64_t count = (int64_t)L->nsuper;
    const bool fused = uz_cpu_has_avx2_fma();
    const panel_step step =
        x->forward ? (fused ? eliminate_fused : eliminate) : (fused ? substitute_back_fused : substitute_back);
    double *const room = x->room[share];
    for (int64_t at = 0; at < count; at++) {
        const int64_t k = x->forward ? at : count - 1 - at;
        if (!all && x->factor->analysis->share[k] != share)
            continue;
        const SuiteSparse_long *rows = s + pi[k];
        panel_of panel = {(const double *)L->x + px[k], pi[k + 1] - pi[k], super[k + 1] - super[k], (lanes *)room};
        for (int64_t block = 0; block < x->blocks; block++) { /* while this part of L is in the processor's cache */
            double *X = x->X[share] + block * x->factor->n * UZ_LANES;
            gather_rows(room, X, rows, panel.rows);
            step(&panel);
            scatter_rows(X, room, rows, x->forward ? panel.rows : panel.cols);
        }
    }
}

static void substitute_share(void *ctx, int share)
{
    substitute(ctx, share, false);
}

uz_status uz_factor_solve_lanes(const uz_factor *factor, double *X, int64_t blocks, bool forward, uz_error *err)
{
    double *room = uz_alloc(most_rows(&factor->L), UZ_LANES * sizeof *room);
    if (!room)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a substitution with %d columns", UZ_LANES);
    const substitution x = {factor, forward, blocks, {X}, {room}};
    substitute(&x, 0, true);
    free(room);
    return UZ_OK;
}

/* Between the columns of share 1, of which Y has copies, and X, which the other share works at: before it (begin) Y
 * gets them and has 0 elsewhere; after it X gets them back, and the rest what both took from it. */
static void trade_columns(const uz_factor *factor, double *X, double *Y, bool begin)
{
    const SuiteSparse_long *super = factor->L.super;
    const unsigned char *share = factor->analysis->share;
    if (begin)
        memset(Y, 0, (size_t)factor->n * UZ_LANES * sizeof *Y);
    for (size_t k = 0; k < factor->L.nsuper; k++) {
        const int64_t from = super[k] * UZ_LANES, count = (super[k + 1] - super[k]) * UZ_LANES;
        if (share[k] == 1)
            memcpy((begin ? Y : X) + from, (begin ? X : Y) + from, (size_t)count * sizeof *X);
        for (int64_t i = from; share[k] == UZ_REST && !begin && i < from + count; i++)
            X[i] += Y[i];
    }
}

uz_status uz_factor_solve_shares(const uz_factor *factor, double *X, double *Y, bool forward, uz_error *err)
{
    const int64_t most = most_rows(&factor->L) * UZ_LANES;
    double *room = uz_alloc(2 * most, sizeof *room);
    if (!room)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a substitution with %d columns", UZ_LANES);
    substitution x = {factor, forward, 1, {X, forward ? Y : X, X}, {room, room + most, room}};
    if (!forward)
        substitute(&x, UZ_REST, false);
    else if (factor->analysis->is_shared)
        trade_columns(factor, X, Y, true);
    uz_run_shares(factor->analysis, substitute_share, &x);
    if (forward && factor->analysis->is_shared)
        trade_columns(factor, X, Y, false);
    if (forward)
        substitute(&x, UZ_REST, false);
    free(room);
    return UZ_OK;
}

void uz_factor_permute_lanes(const uz_factor *factor, double *permuted, const double *X)
{
    gather_rows(permuted, X, factor->L.Perm, factor->n);
}

void uz_factor_unpermute_lanes(const uz_factor *factor, double *X, const double *permuted)
{
    scatter_rows(X, permuted, factor->L.Perm, factor->n);
}
