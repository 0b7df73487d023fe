/* single.c: substitutions for one right-hand side.
 *
 * Each entry of L is used once, so the time is that of reading L. One panel of columns at a time is taken from a
 * supernode, its entries above the diagonal are left out, and while the processor works on a panel the next one, which
 * lies next to it in memory, is on its way. In narrow supernodes, of which most of a sparse factor consists, that
 * spares the calls of dense kernels too (compare Davis, "Direct Methods for Sparse Linear Systems", 2006, chapter 3,
 * and CHOLMOD's super_lsolve, which makes two calls a supernode). Compiled with contraction to fused multiply-add
 * allowed (see the Makefile): here it only saves roundings. */
#include "factor/factor_private.h"

#include "core/cpu.h"

#include <string.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t lanes __attribute__((vector_size(32)));

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

/* out = the last `count` of four entries from x on, zero for the others. */
UZ_INLINE void keep_last(four *out, const double *x, int count)
{
    const lanes place = {0, 1, 2, 3}, kept = place >= 4 - count;
    *out = (four)((lanes)AT(x) & kept);
}

/* The columns of a strip are neighbours in memory, so the next strip's lines are found from this one's. They come into
 * the second cache only: a processor has few lines on their way to the first one, more to the second. */
UZ_INLINE void fetch(const double *entry, int64_t ahead)
{
    __builtin_prefetch((const void *)((uintptr_t)entry + (uintptr_t)(ahead * (int64_t)sizeof(double))), 0, 2);
}

/* The rows below `columns` of a supernode's columns, which take part in all of their strips: `edge` of them are in the
 * group of four that ends at row `whole` and holds rows of strips too; from there on groups are whole. */
typedef struct {
    int64_t columns, whole;
    int edge;
} layout;

UZ_INLINE layout layout_of(const panel_of *s, int64_t columns)
{
    const int edge = (int)((s->rows - columns) % 4);
    return (layout){columns, columns + edge, edge};
}

/* The group at the edge would begin before the supernode: only where it has less than four columns. */
UZ_INLINE bool is_tiny(layout at)
{
    return at.edge > 0 && at.whole < 4;
}

/* b_i.. -= L x on the groups of rows from `from` to before `to`, for `width` columns L. */
UZ_INLINE void eliminate_rows(const panel_of *s, const double *L, int width, const double x[PANEL], int64_t from,
                              int64_t to)
{
    const int64_t rows = s->rows;
    int64_t i = from;
    for (; i + 8 <= to; i += 8) {
        four low = AT(s->b + i), high = AT(s->b + i + 4);
        for (int k = 0; k < width; k++) {
            fetch(L + k * rows + i, PANEL * rows);
            low -= AT(L + k * rows + i) * x[k];
            high -= AT(L + k * rows + i + 4) * x[k];
        }
        *(four *)(s->b + i) = low;
        *(four *)(s->b + i + 4) = high;
    }
    if (i < to) {
        four sum = AT(s->b + i);
        for (int k = 0; k < width; k++) {
            fetch(L + k * rows + i, PANEL * rows);
            sum -= AT(L + k * rows + i) * x[k];
        }
        *(four *)(s->b + i) = sum;
    }
}

/* b_j.. = L_jj^-1 b_j.. on the strip's own rows, and b -= L b_j.. below them. What a strip leaves is what the next
 * begins with, so where supernodes are small the steps between count: no group of rows is loaded that was stored in
 * parts. (Products with reciprocals would not wait for divisions, but their second rounding costs answers: of matrices
 * conditioned as 1e13 some can't be certified then.) */
UZ_INLINE void eliminate_strip(four *edge, const panel_of *s, int64_t j, int width, layout at)
{
    const double *L = s->L + j * s->rows;
    double x[PANEL] = {0};
    for (int k = 0; k < width; k++) {
        double sum = s->b[j + k];
        for (int l = 0; l < k; l++)
            sum -= L[l * s->rows + j + k] * x[l];
        x[k] = sum / L[k * s->rows + j + k];
        s->b[j + k] = x[k];
    }
    eliminate_rows(s, L, width, x, j + width, at.columns);
    for (int k = 0; k < width && at.edge; k++) {
        four part;
        keep_last(&part, L + k * s->rows + at.whole - 4, at.edge);
        *edge -= part * x[k];
    }
    eliminate_rows(s, L, width, x, at.whole, s->rows);
}

/* sum += L'b over the groups of rows from `from` to before `to`, the last ones first. */
UZ_INLINE void add_rows(four sum[PANEL], const panel_of *s, const double *L, int width, int64_t from, int64_t to)
{
    const int64_t rows = s->rows;
    four other[PANEL] = {{0}}; /* two sums, that an addition need not wait for the one before */
    int64_t i = to - 8;
    for (; i >= from; i -= 8)
        for (int k = 0; k < width; k++) {
            fetch(L + k * rows + i, -PANEL * rows);
            sum[k] += AT(L + k * rows + i) * AT(s->b + i);
            other[k] += AT(L + k * rows + i + 4) * AT(s->b + i + 4);
        }
    if (i + 4 >= from)
        for (int k = 0; k < width; k++) {
            fetch(L + k * rows + i + 4, -PANEL * rows);
            other[k] += AT(L + k * rows + i + 4) * AT(s->b + i + 4);
        }
    for (int k = 0; k < width; k++)
        sum[k] += other[k];
}

/* The sum of the lanes of each. */
UZ_INLINE void add_lanes(double total[PANEL], const four sum[PANEL])
{
    const four a = __builtin_shufflevector(sum[0], sum[1], 0, 4, 2, 6) +
                   __builtin_shufflevector(sum[0], sum[1], 1, 5, 3, 7),
               b = __builtin_shufflevector(sum[2], sum[3], 0, 4, 2, 6) +
                   __builtin_shufflevector(sum[2], sum[3], 1, 5, 3, 7);
    *(four *)total = __builtin_shufflevector(a, b, 0, 1, 4, 5) + __builtin_shufflevector(a, b, 2, 3, 6, 7);
}

/* b_j.. = L_jj'^-1 (b_j.. - L'b), the rows below being known. Those next to the strip were known last. */
UZ_INLINE void substitute_strip(const four *edge, const panel_of *s, int64_t j, int width, layout at)
{
    const double *L = s->L + j * s->rows;
    double total[PANEL], x[PANEL] = {0};
    four sum[PANEL] = {{0}};
    for (int k = 0; k < width && at.edge; k++) {
        keep_last(&sum[k], L + k * s->rows + at.whole - 4, at.edge);
        sum[k] *= *edge;
    }
    add_rows(sum, s, L, width, at.whole, s->rows);
    add_rows(sum, s, L, width, j + width, at.columns);
    add_lanes(total, sum);
    for (int k = width - 1; k >= 0; k--) {
        double rest = s->b[j + k] - total[k];
        for (int l = k + 1; l < width; l++)
            rest -= L[k * s->rows + j + l] * x[l];
        x[k] = rest / L[k * s->rows + j + k];
    }
    if (width == PANEL)
        *(four *)(s->b + j) = (four){x[0], x[1], x[2], x[3]};
    else
        memcpy(s->b + j, x, (size_t)width * sizeof *x);
}

/* Up to three columns are left over by the strips of four. */
UZ_INLINE void eliminate_rest(const panel_of *s, int64_t j)
{
    const layout at = layout_of(s, s->cols);
    four edge = at.edge ? AT(s->b + at.whole - 4) : (four){0};
    switch (s->cols - j) {
    case 3:
        eliminate_strip(&edge, s, j, 3, at);
        break;
    case 2:
        eliminate_strip(&edge, s, j, 2, at);
        break;
    default:
        eliminate_strip(&edge, s, j, 1, at);
        break;
    }
    for (int k = 4 - at.edge; k < 4; k++)
        s->b[at.whole - 4 + k] = edge[k];
}

UZ_INLINE void substitute_rest(const panel_of *s, int64_t j)
{
    const layout at = layout_of(s, s->cols);
    four edge = {0};
    if (at.edge)
        keep_last(&edge, s->b + at.whole - 4, at.edge);
    switch (s->cols - j) {
    case 3:
        substitute_strip(&edge, s, j, 3, at);
        break;
    case 2:
        substitute_strip(&edge, s, j, 2, at);
        break;
    default:
        substitute_strip(&edge, s, j, 1, at);
        break;
    }
}

static void eliminate_tiny(const panel_of *s)
{
    for (int64_t j = 0; j < s->cols; j++) {
        s->b[j] /= s->L[j * s->rows + j];
        for (int64_t i = j + 1; i < s->rows; i++)
            s->b[i] -= s->L[j * s->rows + i] * s->b[j];
    }
}

static void substitute_tiny(const panel_of *s)
{
    for (int64_t j = s->cols - 1; j >= 0; j--) {
        for (int64_t i = j + 1; i < s->rows; i++)
            s->b[j] -= s->L[j * s->rows + i] * s->b[i];
        s->b[j] /= s->L[j * s->rows + j];
    }
}

UZ_INLINE void eliminate(const panel_of *s)
{
    const layout at = layout_of(s, s->cols - s->cols % PANEL);
    if (is_tiny(layout_of(s, s->cols))) {
        eliminate_tiny(s);
        return;
    }
    four edge = at.edge && at.columns ? AT(s->b + at.whole - 4) : (four){0};
    for (int64_t j = 0; j < at.columns; j += PANEL)
        eliminate_strip(&edge, s, j, PANEL, at);
    for (int k = 4 - at.edge; k < 4 && at.columns; k++)
        s->b[at.whole - 4 + k] = edge[k];
    if (at.columns < s->cols)
        eliminate_rest(s, at.columns);
}

UZ_INLINE void substitute_back(const panel_of *s)
{
    const layout at = layout_of(s, s->cols - s->cols % PANEL);
    if (is_tiny(layout_of(s, s->cols))) {
        substitute_tiny(s);
        return;
    }
    if (at.columns < s->cols)
        substitute_rest(s, at.columns);
    four edge = {0};
    if (at.edge && at.columns)
        keep_last(&edge, s->b + at.whole - 4, at.edge);
    for (int64_t j = at.columns - PANEL; j >= 0; j -= PANEL)
        substitute_strip(&edge, s, j, PANEL, at);
}

UZ_AVX2_FMA static void eliminate_fused(const panel_of *s)
{
    eliminate(s);
}

UZ_AVX2_FMA static void substitute_back_fused(const panel_of *s)
{
    substitute_back(s);
}

uz_status uz_factor_solve_one(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward, uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const uz_overlay *overlay = ws->overlay;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *s = L->s;
    int64_t count = (int64_t)L->nsuper;
    const bool fused = uz_cpu_has_avx2_fma();
    const panel_step step =
        forward ? (fused ? eliminate_fused : eliminate) : (fused ? substitute_back_fused : substitute_back);
    int64_t most = 1; /* rows of any supernode */
    for (int64_t k = 0; k < count; k++)
        most = pi[k + 1] - pi[k] > most ? pi[k + 1] - pi[k] : most;
    uz_status status = uz_need_panel(ws, (size_t)most, err);
    for (int64_t at = 0; status == UZ_OK && at < count; at++) {
        int64_t k = forward ? at : count - 1 - at;
        const SuiteSparse_long *row = s + pi[k];
        panel_of panel = {(const double *)L->x + px[k], pi[k + 1] - pi[k], super[k + 1] - super[k], ws->panel};
        double *own = x + super[k]; /* the first rows of a supernode are its columns */
        /* Loads act on few dofs: what is eliminated before any of them has nothing to pass on (Gilbert and Peierls,
         * SIAM J. Sci. Stat. Comput. 9 (1988) 862: L^-1 b is nonzero on the reach of b only). */
        bool idle = forward;
        for (int64_t i = 0; idle && !overlay && i < panel.cols; i++)
            idle = own[i] == 0.0;
        for (int64_t i = 0; overlay && i < panel.cols; i++) {
            const bool held = overlay->held[super[k] + i];
            own[i] = held ? 0.0 : own[i];
            idle = (i == 0 || idle) && (held || (forward && own[i] == 0.0));
        }
        if (idle)
            continue;
        if (overlay && overlay->block[k])
            panel.L = overlay->block[k];
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
