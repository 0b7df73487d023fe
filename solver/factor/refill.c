/* refill.c: the numbers of a factor, also of one made again for K with other values.
 *
 * Factors of bodies in the plane, and of slender ones, consist of supernodes of a few columns: CHOLMOD spends most of
 * its time there between calls of dense kernels, each of which also opens a parallel region. Here supernodes are made
 * one after the other, in two shares at a time (shares.c), each from the columns of K and what those before it take
 * from it (left-looking, Ng and Peyton, SIAM J. Sci. Comput. 14 (1993)), by products of small blocks in registers; only
 * large ones are left to BLAS. Large supernodes that come after the shares are made by two threads, each of which has a
 * band of their rows. Compiled with contraction to fused multiply-add allowed (see the Makefile): here it only saves
 * roundings. */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <suitesparse/SuiteSparse_config.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

enum { TILE = 4 };

/* Multiplications of a product of blocks from which on BLAS is worth its calls. */
enum { MANY = 1 << 15 };

/* Entries of a product at a time: 8 MB. */
enum { ROOM = 1 << 20 };

/* Columns of a large supernode that are made at a time. */
enum { PANEL = 192 };

struct uz_refill {
    cholmod_sparse *K; /* the last one, in the factor's order, lower triangle */
    int64_t *place;    /* of its entries there; NULL: for once */
    int64_t *owner;    /* n: the supernode of each column */
    int64_t *next;     /* nsuper: the one after it in the list that it is in */
    int64_t *from;     /* nsuper: its first row that has not taken its part yet */
    struct {
        int64_t *local;  /* n: a row's place in the current supernode; the rest's is that of share 0, and its room */
        int64_t *head;   /* nsuper: the first one of this share that it takes from next; -1: none */
        double *room;    /* for the largest product, or parts of it */
        int64_t refused; /* the first column whose pivot is not positive; n: none so far */
    } of[UZ_SHARES];
    int64_t room; /* entries of it */
    cholmod_factor *L;
    const unsigned char *share; /* of each supernode */
};

void uz_refill_free(uz_refill *x)
{
    cholmod_common common;
    if (!x)
        return;
    if (x->K && uz_cholmod_start(&common)) {
        cholmod_l_free_sparse(&x->K, &common);
        cholmod_l_finish(&common);
    }
    uz_free_all(x->place, x->owner, x->next, x->from);
    for (int k = 0; k < UZ_SHARES; k++) {
        free(x->of[k].head);
        if (k != UZ_REST)
            uz_free_all(x->of[k].local, x->of[k].room);
    }
    free(x);
}

/* uz_block_outer by small tiles. Up to three entries behind A's columns are read, and rows of C up to a multiple of
 * TILE written. */
UZ_INLINE void multiply_tile(const uz_outer *p, int64_t i, int64_t c, int columns)
{
    four sum[TILE] = {{0}};
    for (int64_t q = 0; q < p->k; q++) {
        const four a = *(const four *)(p->A + i + q * p->ld);
        const double *b = p->A - p->skip + c + q * p->ld;
        for (int k = 0; k < columns; k++)
            sum[k] += a * b[k];
    }
    for (int k = 0; k < columns; k++)
        *(four *)(p->C + i + (c + k) * p->ldc) = sum[k];
}

/* Two tiles, one below the other: sums enough that none waits for the last one's. */
UZ_INLINE void multiply_two(const uz_outer *p, int64_t i, int64_t c)
{
    four low[TILE] = {{0}}, high[TILE] = {{0}};
    for (int64_t q = 0; q < p->k; q++) {
        const four a = *(const four *)(p->A + i + q * p->ld), e = *(const four *)(p->A + i + TILE + q * p->ld);
        const double *b = p->A - p->skip + c + q * p->ld;
        for (int k = 0; k < TILE; k++) {
            low[k] += a * b[k];
            high[k] += e * b[k];
        }
    }
    for (int k = 0; k < TILE; k++) {
        *(four *)(p->C + i + (c + k) * p->ldc) = low[k];
        *(four *)(p->C + i + TILE + (c + k) * p->ldc) = high[k];
    }
}

static inline int64_t first_row(const uz_outer *p, int64_t column)
{
    return column > p->skip ? (column - p->skip) / TILE * TILE : 0;
}

UZ_INLINE void multiply(const uz_outer *p)
{
    int64_t c = 0;
    for (; c + TILE <= p->n; c += TILE) {
        int64_t i = first_row(p, c);
        for (; i + TILE < p->rows; i += 2 * TILE)
            multiply_two(p, i, c);
        if (i < p->rows)
            multiply_tile(p, i, c, TILE);
    }
    for (; c < p->n; c++)
        for (int64_t i = first_row(p, c); i < p->rows; i += TILE)
            multiply_tile(p, i, c, 1);
}

UZ_AVX2_FMA static void multiply_fused(const uz_outer *p)
{
    multiply(p);
}

static void multiply_plain(const uz_outer *p)
{
    multiply(p);
}

/* The kernels that the processor has. */
typedef struct {
    void (*multiply)(const uz_outer *p);
    int64_t (*factor)(double *block, int64_t columns, int64_t rows); /* as uz_block_factor */
} kernels;

static int64_t pitch_of(int64_t rows)
{
    return (rows + TILE - 1) / TILE * TILE;
}

/* sum_k = row i.. of the first j columns of the block times their row j + k. */
UZ_INLINE void add_left(four sum[TILE], const double *block, int64_t rows, int64_t i, int64_t j, int width)
{
    for (int64_t q = 0; q < j; q++) {
        const four a = *(const four *)(block + i + q * rows);
        const double *b = block + j + q * rows;
        for (int k = 0; k < width; k++)
            sum[k] += a * b[k];
    }
}

/* Columns j .. j + width - 1 of a block whose columns before them are done. Returns how many of them have pivots that
 * are positive. */
UZ_INLINE int factor_strip(double *block, int64_t rows, int64_t j, int width)
{
    double L[TILE][TILE] = {{0}}, inverse[TILE] = {0}; /* of their own rows */
    four own[TILE] = {{0}};
    add_left(own, block, rows, j, j, width);
    for (int c = 0; c < width; c++) {
        double *column = block + j + (j + c) * rows;
        for (int r = c; r < width; r++) {
            double value = column[r] - own[c][r];
            for (int k = 0; k < c; k++)
                value -= L[r][k] * L[c][k];
            L[r][c] = r == c ? sqrt(value) : value * inverse[c];
            if (r == c && !(value > 0.0 && value < INFINITY))
                return c;
            inverse[c] = r == c ? 1.0 / L[c][c] : inverse[c];
            column[r] = L[r][c];
        }
    }
    for (int64_t i = j + width; i < rows; i += TILE) {
        const int64_t left = rows - i;
        four sum[TILE] = {{0}};
        add_left(sum, block, rows, i, j, width);
        for (int c = 0; c < width; c++) {
            double *column = block + i + (j + c) * rows;
            four value = *(const four *)column - sum[c];
            for (int k = 0; k < c; k++)
                value -= sum[k] * L[c][k];
            sum[c] = value * inverse[c];
            if (left >= TILE)
                *(four *)column = sum[c];
            for (int r = 0; left < TILE && r < left; r++)
                column[r] = sum[c][r];
        }
    }
    return width;
}

/* The first `columns` columns of a block become those of its Cholesky factor, some at a time. */
UZ_INLINE int64_t factor_columns(double *block, int64_t columns, int64_t rows)
{
    int64_t j = 0;
    while (j < columns) {
        const int width = j + TILE <= columns ? TILE : 1;
        const int good = width == TILE ? factor_strip(block, rows, j, TILE) : factor_strip(block, rows, j, 1);
        j += good;
        if (good < width)
            break;
    }
    return j;
}

UZ_AVX2_FMA static int64_t factor_fused(double *block, int64_t columns, int64_t rows)
{
    return factor_columns(block, columns, rows);
}

static int64_t factor_plain(double *block, int64_t columns, int64_t rows)
{
    return factor_columns(block, columns, rows);
}

static kernels kernels_here(void)
{
    return uz_cpu_has_avx2_fma() ? (kernels){multiply_fused, factor_fused} : (kernels){multiply_plain, factor_plain};
}

/* A part of supernode s: its rows from `low` to `high`, both numbers in it, by a thread that has room. */
typedef struct {
    uz_refill *x;
    const kernels *by;
    int64_t s, low, high;
    const int64_t *local;
    double *room;
} band;

/* What the band takes from supernode d, in pieces of columns that fit in the room. */
UZ_INLINE void take(const band *of, int64_t d)
{
    const uz_refill *x = of->x;
    const cholmod_factor *L = x->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *px = L->px, *row = (const SuiteSparse_long *)L->s + pi[d];
    const int64_t s = of->s, height = pi[s + 1] - pi[s], ld = pi[d + 1] - pi[d], depth = super[d + 1] - super[d];
    int64_t first = x->from[d], last = ld, end = first;
    while (end < ld && row[end] < super[s + 1])
        end++;
    while (of->low > 0 && first < last && of->local[row[first]] < of->low)
        first++;
    while (of->high < height && last > first && of->local[row[last - 1]] >= of->high)
        last--;
    end = first == last ? x->from[d] : end < last ? end : last;
    const double *numbers = (const double *)L->x + px[d];
    for (int64_t begin = x->from[d], after; begin < end; begin = after) {
        const int64_t top = first > begin ? first : begin, rest = last - top;
        const int64_t fits = x->room / pitch_of(rest);
        after = end - begin > fits ? begin + fits : end;
        const bool many = rest * (after - begin) * depth > MANY;
        const uz_outer p = {.skip = top - begin,
                            .rows = rest,
                            .n = after - begin,
                            .k = depth,
                            .A = numbers + top,
                            .ld = ld,
                            .C = of->room,
                            .ldc = many ? rest : pitch_of(rest)};
        if (many)
            uz_block_outer(&p);
        else
            of->by->multiply(&p);
        for (int64_t c = begin; c < after; c++) {
            double *to = (double *)L->x + px[s] + of->local[row[c]] * height;
            const double *of_c = of->room + (c - begin) * p.ldc;
            for (int64_t i = c > top ? c - top : 0; i < rest; i++)
                to[of->local[row[top + i]]] -= of_c[i];
        }
    }
}

/* Supernode d has given to s, and goes on to the next one that takes something. */
static void pass_on(uz_refill *x, int share, int64_t s, int64_t d)
{
    const cholmod_factor *L = x->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *row = (const SuiteSparse_long *)L->s + pi[d];
    const int64_t ld = pi[d + 1] - pi[d];
    int64_t end = x->from[d];
    while (end < ld && row[end] < super[s + 1])
        end++;
    x->from[d] = end;
    if (end < ld) {
        const int64_t to = x->owner[row[end]];
        x->next[d] = x->of[share].head[to];
        x->of[share].head[to] = d;
    }
}

uz_status uz_refill_new(uz_refill **out, const uz_factor *factor, const uz_csc *K, bool once, uz_error *err)
{
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *row = L->s;
    const int64_t n = factor->n, count = (int64_t)L->nsuper;
    cholmod_common common;
    int64_t longest = 0; /* column of a product */
    uz_refill *x = uz_alloc_zero(1, sizeof *x);
    *out = NULL;
    if (x) {
        x->place = once ? NULL : uz_alloc(K->ptr[K->cols], sizeof *x->place);
        x->owner = uz_alloc(n, sizeof *x->owner);
        x->next = uz_alloc(count, sizeof *x->next);
        x->from = uz_alloc(count, sizeof *x->from);
    }
    bool ok = x && (once || x->place) && x->owner && x->next && x->from && uz_cholmod_start(&common);
    if (ok) {
        x->K = uz_permute(K, factor->analysis->position, x->place, &common);
        cholmod_l_finish(&common);
    }
    for (int64_t s = 0; ok && s < count; s++)
        for (int64_t j = super[s]; j < super[s + 1]; j++)
            x->owner[j] = s;
    for (int64_t d = 0; ok && d < count; d++) {
        const int64_t last = pi[d + 1];
        for (int64_t at = pi[d] + super[d + 1] - super[d], end; at < last; at = end) {
            for (end = at + 1; end < last && x->owner[row[end]] == x->owner[row[at]];)
                end++;
            const int64_t column = pitch_of(last - at), size = column * (end - at);
            x->room = size > x->room ? size : x->room;
            longest = column > longest ? column : longest;
        }
    }
    if (ok && x->room > ROOM)
        x->room = longest > ROOM ? longest : ROOM;
    ok = ok && x->K;
    for (int k = 0; ok && k < UZ_SHARES; k++) {
        x->of[k].head = uz_alloc(count, sizeof *x->of[k].head);
        x->of[k].local = k == UZ_REST ? x->of[0].local : uz_alloc(n, sizeof *x->of[k].local);
        x->of[k].room = k == UZ_REST ? x->of[0].room : uz_alloc(x->room, sizeof *x->of[k].room);
        ok = x->of[k].head && x->of[k].local && x->of[k].room;
    }
    if (ok) {
        *out = x;
        return UZ_OK;
    }
    uz_refill_free(x);
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %lld dofs", (long long)n);
}

/* ---- supernodes that two threads make together */

/* A supernode's rows in two bands: what they take, or of a panel of its columns what they take from those before it, or
 * what they are once its diagonal block is. */
typedef struct {
    uz_refill *x;
    int64_t s, rows, middle; /* middle: the second band's first row */
    int64_t begin, end;      /* of the panel */
    double *block;
} pair;

static void take_band(void *ctx, int half)
{
    const pair *p = ctx;
    uz_refill *x = p->x;
    const kernels by = kernels_here();
    const band of = {.x = x,
                     .by = &by,
                     .s = p->s,
                     .low = half == 0 ? 0 : p->middle,
                     .high = half == 0 ? p->middle : p->rows,
                     .local = x->of[UZ_REST].local,
                     .room = x->of[half].room};
    for (int k = 0; k < UZ_SHARES; k++)
        for (int64_t d = x->of[k].head[p->s]; d >= 0; d = x->next[d])
            take(&of, d);
}

static void update_band(void *ctx, int half)
{
    const pair *p = ctx;
    const int64_t low = half == 0 ? p->begin : p->middle, high = half == 0 ? p->middle : p->rows;
    const uz_outer of = {.skip = low - p->begin,
                         .rows = high - low,
                         .n = p->end - p->begin,
                         .k = p->begin,
                         .A = p->block + low,
                         .ld = p->rows,
                         .C = p->block + low + p->begin * p->rows,
                         .ldc = p->rows,
                         .subtract = true};
    uz_block_outer(&of);
}

static void divide_band(void *ctx, int half)
{
    const pair *p = ctx;
    const int64_t low = half == 0 ? p->end : p->middle, high = half == 0 ? p->middle : p->rows;
    uz_block_divide(p->end - p->begin, high - low, p->block + p->begin * (p->rows + 1),
                    p->block + low + p->begin * p->rows, p->rows);
}

/* From what a supernode has of K to its columns of the factor, as uz_block_factor. */
UZ_INLINE int64_t make_together(pair *p, int64_t columns)
{
    const double c = (double)columns, r = (double)p->rows, half = (c * r - c * c / 2) / 2;
    p->middle = half > c * c / 2 ? (int64_t)(half / c + c / 2) : (int64_t)sqrt(2 * half); /* of its entries */
    uz_aside_share(take_band, p, UZ_REST);
    for (p->begin = 0; p->begin < columns; p->begin = p->end) {
        p->end = columns - p->begin > PANEL ? p->begin + PANEL : columns;
        p->middle = p->end > (p->begin + p->rows) / 2 ? p->end : (p->begin + p->rows) / 2;
        if (p->begin > 0)
            uz_aside_share(update_band, p, UZ_REST);
        const int64_t width = p->end - p->begin,
                      good = uz_block_factor(width, 0, p->block + p->begin * (p->rows + 1), p->rows);
        if (good < width)
            return p->begin + good;
        p->middle = (p->end + p->rows) / 2;
        uz_aside_share(divide_band, p, UZ_REST);
    }
    return columns;
}

/* ---- all of them */

/* A supernode of a share, from x->K. */
UZ_INLINE void make(uz_refill *x, int share, int64_t s, const kernels *by)
{
    const cholmod_factor *L = x->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi, *row = L->s, *ptr = x->K->p, *index = x->K->i;
    const double *value = x->K->x;
    const int64_t columns = super[s + 1] - super[s], rows = pi[s + 1] - pi[s];
    const bool together = share == UZ_REST && uz_is_large(columns, rows);
    int64_t *const local = x->of[share].local;
    double *block = (double *)L->x + ((const SuiteSparse_long *)L->px)[s];
    const band whole = {.x = x, .by = by, .s = s, .high = rows, .local = local, .room = x->of[share].room};
    pair halves = {.x = x, .s = s, .rows = rows, .block = block};
    int64_t good = columns;
    memset(block, 0, (size_t)(columns * rows) * sizeof *block);
    for (int64_t i = 0; i < rows; i++)
        local[row[pi[s] + i]] = i;
    for (int64_t c = 0; c < columns; c++)
        for (int64_t e = ptr[super[s] + c]; e < ptr[super[s] + c + 1]; e++)
            block[local[index[e]] + c * rows] = value[e];
    if (together)
        good = make_together(&halves, columns);
    for (int k = share == UZ_REST ? 0 : share; k <= share; k++) /* the rest takes from all */
        for (int64_t d = x->of[k].head[s], after; d >= 0; d = after) {
            after = x->next[d];
            if (!together)
                take(&whole, d);
            pass_on(x, share, s, d);
        }
    if (!together)
        good = columns * columns * rows > MANY ? uz_block_factor(columns, rows - columns, block, rows)
                                               : by->factor(block, columns, rows);
    if (good < columns)
        x->of[share].refused = super[s] + good;
    x->from[s] = columns;
    if (rows > columns) {
        const int64_t to = x->owner[row[pi[s] + columns]];
        x->next[s] = x->of[share].head[to];
        x->of[share].head[to] = s;
    }
}

/* The supernodes of a share: until a pivot is not positive. */
UZ_INLINE void make_all(uz_refill *x, int share)
{
    const kernels by = kernels_here();
    const int64_t count = (int64_t)x->L->nsuper;
    x->of[share].refused = (int64_t)x->L->n;
    for (int64_t s = 0; s < count; s++)
        x->of[share].head[s] = -1;
    for (int64_t s = 0; s < count && x->of[share].refused == (int64_t)x->L->n; s++)
        if (x->share[s] == share)
            make(x, share, s, &by);
}

static void fill_share(void *ctx, int share)
{
    make_all(ctx, share);
}

/* The memory of the factor's numbers: some entries behind the last column are read with it. */
static uz_status make_room(cholmod_factor *L, uz_error *err)
{
    if (!L->x)
        L->x = SuiteSparse_malloc(L->xsize + TILE, sizeof(double));
    if (!L->x)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a factor of %.3g bytes", 8.0 * (double)L->xsize);
    L->xtype = CHOLMOD_REAL;
    L->minor = L->n;
    return UZ_OK;
}

uz_status uz_refill_run(int64_t *refused, uz_refill *x, uz_factor *factor, uz_error *err)
{
    uz_status status = make_room(&factor->L, err);
    *refused = 0;
    if (status != UZ_OK)
        return status;
    x->L = &factor->L;
    x->share = factor->analysis->share;
    uz_run_shares(factor->analysis, fill_share, x);
    *refused = x->of[0].refused < x->of[1].refused ? x->of[0].refused : x->of[1].refused;
    if (*refused == factor->n) {
        make_all(x, UZ_REST);
        *refused = x->of[UZ_REST].refused;
    }
    return UZ_OK;
}

void uz_refill_renew(uz_refill *x, const uz_csc *K)
{
    double *value = x->K->x;
    for (int64_t k = 0; k < K->ptr[K->cols]; k++)
        value[x->place[k]] = K->val[k];
}

uz_status uz_factor_again(uz_factor *factor, const uz_csc *K, uz_error *err)
{
    const int64_t count = K->ptr[K->cols];
    if (K->cols != factor->n || count != factor->analysis->nnz)
        return uz_fail(err, UZ_ERR_ARGUMENT, "K", "K is not of the pattern that was analysed");
    if (!factor->refill) {
        uz_status status = uz_refill_new(&factor->refill, factor, K, false, err);
        if (status != UZ_OK)
            return status;
    } else {
        uz_refill_renew(factor->refill, K);
    }
    int64_t refused;
    uz_status status = uz_refill_run(&refused, factor->refill, factor, err);
    if (status != UZ_OK || refused == factor->n)
        return status;
    return uz_fail(err, UZ_ERR_NOT_SPD, "K", "K is not positive definite to working precision");
}
