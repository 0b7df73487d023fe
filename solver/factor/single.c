/* single.c: substitutions for one right-hand side.
 *
 * Each entry of L is used once, so the time is that of reading L. One panel of columns at a time is taken from a
 * supernode, its entries above the diagonal are left out, and while the processor works on a panel the next one, which
 * lies next to it in memory, is on its way. In narrow supernodes, of which most of a sparse factor consists, that
 * spares the calls of dense kernels too (compare Davis, "Direct Methods for Sparse Linear Systems", 2006, chapter 3,
 * and CHOLMOD's super_lsolve, which makes two calls a supernode). Compiled with contraction to fused multiply-add
 * allowed (see the Makefile): here it only saves roundings. */
#include "factor/factor_private.h"

#include "core/error.h"

#include <string.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

enum { PANEL = 4 }; /* columns of L at a time */

/* One supernode: rows x cols values, column-major; its rows of the vector are gathered in b. */
typedef struct {
    const double *L;
    int64_t rows, cols;
    double *b; /* rows */
} panel_of;

typedef void (*panel_step)(const panel_of *s);

/* Four entries from x on; a function that returned them would have another ABI without AVX. */
#define AT(x) (*(const four *)(x))

/* `width` columns of L from the one at row j on, with a hint of where the next are: `ahead` entries away. */
typedef struct {
    const double *column[PANEL];
    int64_t rows, j, ahead;
    int width;
} strip;

static inline __attribute__((always_inline)) strip strip_at(const panel_of *s, int64_t j, int width, int direction)
{
    const double *L = s->L + j * s->rows;
    strip t = {{L, L, L, L}, s->rows, j, direction * PANEL * s->rows, width};
    for (int k = 1; k < width; k++)
        t.column[k] = L + k * s->rows;
    return t;
}

/* The columns of a strip are neighbours in memory, so the next strip's lines are found from this one's. */
static inline __attribute__((always_inline)) void fetch(const double *entry, int64_t ahead)
{
    __builtin_prefetch((const void *)((uintptr_t)entry + (uintptr_t)(ahead * (int64_t)sizeof(double))), 0, 3);
}

/* b_j.. = L_jj^-1 b_j.. on the strip's own rows, and b -= L b_j.. below them. */
static inline __attribute__((always_inline)) void eliminate_strip(double *b, const strip t)
{
    double x[PANEL] = {0};
    int64_t i = t.j + t.width;
    for (int k = 0; k < t.width; k++) {
        double sum = b[t.j + k];
        for (int l = 0; l < k; l++)
            sum -= t.column[l][t.j + k] * x[l];
        b[t.j + k] = x[k] = sum / t.column[k][t.j + k];
    }
    for (; i + 8 <= t.rows; i += 8) {
        four low = AT(b + i), high = AT(b + i + 4);
        for (int k = 0; k < t.width; k++) {
            fetch(t.column[k] + i, t.ahead);
            low -= AT(t.column[k] + i) * x[k];
            high -= AT(t.column[k] + i + 4) * x[k];
        }
        *(four *)(b + i) = low;
        *(four *)(b + i + 4) = high;
    }
    for (; i < t.rows; i++)
        for (int k = 0; k < t.width; k++)
            b[i] -= t.column[k][i] * x[k];
}

/* b_j.. = L_jj'^-1 (b_j.. - L'b), the rows below being known. */
static inline __attribute__((always_inline)) void substitute_strip(double *b, const strip t)
{
    four low[PANEL] = {{0}}, high[PANEL] = {{0}};
    double sum[PANEL] = {0};
    int64_t i = t.j + t.width;
    for (; i + 8 <= t.rows; i += 8)
        for (int k = 0; k < t.width; k++) {
            fetch(t.column[k] + i, t.ahead);
            low[k] += AT(t.column[k] + i) * AT(b + i);
            high[k] += AT(t.column[k] + i + 4) * AT(b + i + 4);
        }
    for (; i < t.rows; i++)
        for (int k = 0; k < t.width; k++)
            sum[k] += t.column[k][i] * b[i];
    for (int k = t.width - 1; k >= 0; k--) {
        four all = low[k] + high[k];
        double rest = b[t.j + k] - (sum[k] + ((all[0] + all[1]) + (all[2] + all[3])));
        for (int l = k + 1; l < t.width; l++)
            rest -= t.column[k][t.j + l] * b[t.j + l];
        b[t.j + k] = rest / t.column[k][t.j + k];
    }
}

static inline __attribute__((always_inline)) void eliminate(const panel_of *s)
{
    int64_t j = 0;
    for (; j + PANEL <= s->cols; j += PANEL)
        eliminate_strip(s->b, strip_at(s, j, PANEL, 1));
    switch (s->cols - j) {
    case 3:
        eliminate_strip(s->b, strip_at(s, j, 3, 1));
        break;
    case 2:
        eliminate_strip(s->b, strip_at(s, j, 2, 1));
        break;
    case 1:
        eliminate_strip(s->b, strip_at(s, j, 1, 1));
        break;
    default:
        break;
    }
}

static inline __attribute__((always_inline)) void substitute_back(const panel_of *s)
{
    int64_t j = s->cols - s->cols % PANEL;
    switch (s->cols - j) {
    case 3:
        substitute_strip(s->b, strip_at(s, j, 3, -1));
        break;
    case 2:
        substitute_strip(s->b, strip_at(s, j, 2, -1));
        break;
    case 1:
        substitute_strip(s->b, strip_at(s, j, 1, -1));
        break;
    default:
        break;
    }
    for (j -= PANEL; j >= 0; j -= PANEL)
        substitute_strip(s->b, strip_at(s, j, PANEL, -1));
}

#ifdef __x86_64__
__attribute__((target("avx2,fma"))) static void eliminate_fused(const panel_of *s)
{
    eliminate(s);
}

__attribute__((target("avx2,fma"))) static void substitute_back_fused(const panel_of *s)
{
    substitute_back(s);
}
#endif

static void eliminate_any(const panel_of *s)
{
    eliminate(s);
}

static void substitute_back_any(const panel_of *s)
{
    substitute_back(s);
}

static panel_step best_step(bool forward)
{
#ifdef __x86_64__
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return forward ? eliminate_fused : substitute_back_fused;
#endif
    return forward ? eliminate_any : substitute_back_any;
}

/* Room for the rows of any supernode. */
static uz_status need_room(const cholmod_factor *L, uz_factor_workspace *ws, uz_error *err)
{
    const SuiteSparse_long *pi = L->pi;
    int64_t most = 1;
    for (size_t k = 0; k < L->nsuper; k++)
        most = pi[k + 1] - pi[k] > most ? pi[k + 1] - pi[k] : most;
    return uz_need_panel(ws, (size_t)most, err);
}

/* Loads act on few dofs: what is eliminated before any of them has nothing to pass on (Gilbert and Peierls, SIAM J. Sci.
 * Stat. Comput. 9 (1988) 862: L^-1 b is nonzero on the reach of b only). */
static bool all_zero(const double *x, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (x[i] != 0.0)
            return false;
    return true;
}

uz_status uz_single_substitute(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward, uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *s = L->s;
    int64_t count = (int64_t)L->nsuper;
    panel_step step = best_step(forward);
    uz_status status = need_room(L, ws, err);
    for (int64_t at = 0; status == UZ_OK && at < count; at++) {
        int64_t k = forward ? at : count - 1 - at;
        const SuiteSparse_long *row = s + pi[k];
        panel_of panel = {(const double *)L->x + px[k], pi[k + 1] - pi[k], super[k + 1] - super[k], ws->panel};
        double *own = x + super[k]; /* the first rows of a supernode are its columns */
        if (forward && all_zero(own, panel.cols))
            continue;
        memcpy(panel.b, own, (size_t)panel.cols * sizeof *own);
        for (int64_t i = panel.cols; i < panel.rows; i++)
            panel.b[i] = x[row[i]];
        step(&panel);
        memcpy(own, panel.b, (size_t)panel.cols * sizeof *own);
        for (int64_t i = panel.cols; forward && i < panel.rows; i++)
            x[row[i]] = panel.b[i];
    }
    return status;
}
