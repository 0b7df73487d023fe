/* residual.c: one pass over K, in registers of two and four lanes.
 *
 * The dofs of a node stand together, and so do those of nodes in a row of a mesh: the rows that a column meets come in
 * runs, and what is done to a run is done in lanes. Sums in lanes are double-double too, and are added up as such. */
#include "certificate/residual.h"

#include "certificate/brick_product.h"
#include "certificate/double_double.h"
#include "core/alloc.h"
#include "core/cpu.h"
#include "linalg/pieces.h"

#include <stdlib.h>
#include <string.h>

typedef double two __attribute__((vector_size(16), aligned(8), may_alias));
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

/* A function that returned lanes would have another ABI without AVX. */
#define AT(type, x)   (*(type *)(x))
#define READ(type, x) (*(const type *)(x))
#define LOW_HALF(x)   __builtin_shufflevector(x, x, 0, 1)
#define HIGH_HALF(x)  __builtin_shufflevector(x, x, 2, 3)

/* dd_add_product, lane by lane. */
UZ_INLINE void add_product4(four *hi, four *lo, const four *a, const four *b, int fused)
{
    const four product = *a * *b;
    four error = {0.0};
    for (int l = 0; l < 4; l++)
        error[l] =
            fused ? __builtin_fma((*a)[l], (*b)[l], -product[l]) : product_error_split((*a)[l], (*b)[l], product[l]);
    const four sum = *hi + product, back = sum - *hi;
    *lo += ((*hi - (sum - back)) + (product - back)) + error;
    *hi = sum;
}

UZ_INLINE void add_product2(two *hi, two *lo, const two *a, const two *b, int fused)
{
    const two product = *a * *b;
    two error = {0.0};
    for (int l = 0; l < 2; l++)
        error[l] =
            fused ? __builtin_fma((*a)[l], (*b)[l], -product[l]) : product_error_split((*a)[l], (*b)[l], product[l]);
    const two sum = *hi + product, back = sum - *hi;
    *lo += ((*hi - (sum - back)) + (product - back)) + error;
    *hi = sum;
}

/* dd_add, lane by lane. */
UZ_INLINE void add4(four *hi, four *lo, const four *x)
{
    const four sum = *hi + *x, back = sum - *hi;
    *lo += (*hi - (sum - back)) + (*x - back);
    *hi = sum;
}

UZ_INLINE void add2(two *hi, two *lo, const two *x)
{
    const two sum = *hi + *x, back = sum - *hi;
    *lo += (*hi - (sum - back)) + (*x - back);
    *hi = sum;
}

/* hi + lo += A x and y += A c for symmetric A by its lower triangle. */
typedef struct {
    const uz_csc *A;
    const double *x, *c;
    int64_t first, last; /* of c's entries that are not zero */
    double *hi, *lo, *y;
    double *weight; /* NULL: not wanted */
} product_of;

/* What column j adds to row j, in lanes. */
typedef struct {
    double hi, lo;
    two hi2, lo2;
    four hi4, lo4;
} row_sums;

/* Row j += its lanes. */
UZ_INLINE void add_lanes(const product_of *q, int64_t j, const row_sums *s)
{
    const two high = HIGH_HALF(s->hi4);
    two hi = LOW_HALF(s->hi4), lo = (LOW_HALF(s->lo4) + HIGH_HALF(s->lo4)) + s->lo2;
    add2(&hi, &lo, &high);
    add2(&hi, &lo, &s->hi2);
    double_double sum = {s->hi, s->lo + (lo[0] + lo[1])};
    dd_add(&sum, hi[0]);
    dd_add(&sum, hi[1]);
    q->hi[j] = sum.hi;
    q->lo[j] = sum.lo;
}

/* Entries k to end of column j, which lie below the diagonal: to row j goes a x_i, to row i goes a x_j. */
UZ_INLINE void take_runs(row_sums *s, const product_of *q, int64_t k, int64_t end, double x_j, int fused)
{
    const int32_t *idx = q->A->idx;
    const four x_j4 = {x_j, x_j, x_j, x_j};
    const two x_j2 = {x_j, x_j};
    while (k < end) {
        const int64_t i = idx[k];
        const double *val = q->A->val + k;
        if (k + 3 < end && idx[k + 3] == i + 3) {
            const four a = READ(four, val);
            four hi = AT(four, q->hi + i), lo = AT(four, q->lo + i);
            add_product4(&s->hi4, &s->lo4, &a, (const four *)(q->x + i), fused);
            add_product4(&hi, &lo, &a, &x_j4, fused);
            AT(four, q->hi + i) = hi;
            AT(four, q->lo + i) = lo;
            k += 4;
        } else if (k + 1 < end && idx[k + 1] == i + 1) {
            const two a = READ(two, val);
            two hi = AT(two, q->hi + i), lo = AT(two, q->lo + i);
            add_product2(&s->hi2, &s->lo2, &a, (const two *)(q->x + i), fused);
            add_product2(&hi, &lo, &a, &x_j2, fused);
            AT(two, q->hi + i) = hi;
            AT(two, q->lo + i) = lo;
            k += 2;
        } else {
            dd_add_product(&s->hi, &s->lo, *val, q->x[i], fused);
            dd_add_product(&q->hi[i], &q->lo[i], *val, x_j, fused);
            k++;
        }
    }
}

UZ_INLINE void prepare_column(const product_of *q, int64_t j)
{
    const uz_csc *A = q->A;
    int64_t k = A->ptr[j];
    const int64_t end = A->ptr[j + 1];
    if (j <= q->last && k < end && A->idx[end - 1] >= q->first) { /* c is small beside x, and zero but at the contact */
        const double c_j = q->c[j];
        double sum = 0.0;
        if (A->idx[k] == j)
            sum = A->val[k++] * c_j;
        for (; k < end; k++) {
            sum += A->val[k] * q->c[A->idx[k]];
            q->y[A->idx[k]] += A->val[k] * c_j;
        }
        q->y[j] += sum;
    }
    if (q->weight)
        q->weight[j] = uz_dof_weight(A, j);
}

UZ_INLINE void take_column(const product_of *q, int64_t j, int fused)
{
    const uz_csc *A = q->A;
    row_sums s = {.hi = q->hi[j], .lo = q->lo[j]};
    int64_t k = A->ptr[j];
    if (k < A->ptr[j + 1] && A->idx[k] == j)
        dd_add_product(&s.hi, &s.lo, A->val[k++], q->x[j], fused);
    take_runs(&s, q, k, A->ptr[j + 1], q->x[j], fused);
    add_lanes(q, j, &s);
}

/* ---- the columns of a node, two at a time
 *
 * They meet the same rows. What is left where they do not is taken by column. */

/* Columns j and j + 1: sums in lanes, of both columns in one where a name has both. */
typedef struct {
    two hi_both, lo_both;
    four hi2_both, lo2_both; /* two lanes of the first, two of the second */
    four hi4[2], lo4[2];
} pair_sums;

UZ_INLINE bool is_pair(const uz_csc *A, int64_t j, int64_t end_of_all)
{
    if (j + 1 >= end_of_all)
        return false;
    const int64_t k = A->ptr[j], l = A->ptr[j + 1], end = A->ptr[j + 2];
    return l - k == end - l + 1 && l - k >= 2 && A->idx[k] == j && A->idx[k + 1] == j + 1 && A->idx[l] == j + 1;
}

/* Rows j and j + 1 += their lanes: in fours two of the first beside two of the second. */
UZ_INLINE void add_pair_lanes(const product_of *q, int64_t j, const pair_sums *s)
{
    const four high = __builtin_shufflevector(s->hi4[0], s->hi4[1], 2, 3, 6, 7);
    four hi = __builtin_shufflevector(s->hi4[0], s->hi4[1], 0, 1, 4, 5),
         lo = __builtin_shufflevector(s->lo4[0], s->lo4[1], 0, 1, 4, 5) +
              __builtin_shufflevector(s->lo4[0], s->lo4[1], 2, 3, 6, 7) + s->lo2_both;
    add4(&hi, &lo, &high);
    add4(&hi, &lo, &s->hi2_both);
    const two even = __builtin_shufflevector(hi, hi, 0, 2), odd = __builtin_shufflevector(hi, hi, 1, 3);
    two sum = s->hi_both, rest = s->lo_both + __builtin_shufflevector(lo, lo, 0, 2);
    rest += __builtin_shufflevector(lo, lo, 1, 3);
    add2(&sum, &rest, &even);
    add2(&sum, &rest, &odd);
    AT(two, q->hi + j) = sum;
    AT(two, q->lo + j) = rest;
}

/* What is left of one column of a pair. */
UZ_INLINE void take_rest(const product_of *q, int64_t j, int64_t k, int fused)
{
    if (k == q->A->ptr[j + 1])
        return;
    row_sums s = {.hi = q->hi[j], .lo = q->lo[j]};
    take_runs(&s, q, k, q->A->ptr[j + 1], q->x[j], fused);
    add_lanes(q, j, &s);
}

UZ_INLINE void take_pair(const product_of *q, int64_t j, int fused)
{
    const uz_csc *A = q->A;
    const int32_t *idx = A->idx;
    const int64_t middle = A->ptr[j + 1];
    const two x_a = {q->x[j], q->x[j]}, x_b = {q->x[j + 1], q->x[j + 1]};
    const four x_a4 = {x_a[0], x_a[0], x_a[0], x_a[0]}, x_b4 = {x_b[0], x_b[0], x_b[0], x_b[0]};
    int64_t k = A->ptr[j], l = middle;
    const two first = READ(two, A->val + k), second = {first[1], A->val[l]}; /* the rows of their own */
    pair_sums s = {.hi_both = READ(two, q->hi + j), .lo_both = READ(two, q->lo + j)};
    add_product2(&s.hi_both, &s.lo_both, &first, &x_a, fused);
    add_product2(&s.hi_both, &s.lo_both, &second, &x_b, fused);
    k += 2;
    l++;
    while (k + 1 < middle && idx[k] == idx[l] && idx[k + 1] == idx[k] + 1 && idx[l + 1] == idx[k] + 1) {
        const int64_t i = idx[k];
        if (k + 3 < middle && idx[k + 3] == i + 3 && idx[l + 3] == i + 3) {
            const four a = READ(four, A->val + k), b = READ(four, A->val + l), x = READ(four, q->x + i);
            four hi = AT(four, q->hi + i), lo = AT(four, q->lo + i);
            add_product4(&s.hi4[0], &s.lo4[0], &a, &x, fused);
            add_product4(&s.hi4[1], &s.lo4[1], &b, &x, fused);
            add_product4(&hi, &lo, &a, &x_a4, fused);
            add_product4(&hi, &lo, &b, &x_b4, fused);
            AT(four, q->hi + i) = hi;
            AT(four, q->lo + i) = lo;
            k += 4;
            l += 4;
        } else {
            const two a = READ(two, A->val + k), b = READ(two, A->val + l), x = READ(two, q->x + i);
            const four both = __builtin_shufflevector(a, b, 0, 1, 2, 3),
                       twice = __builtin_shufflevector(x, x, 0, 1, 0, 1);
            two hi = AT(two, q->hi + i), lo = AT(two, q->lo + i);
            add_product4(&s.hi2_both, &s.lo2_both, &both, &twice, fused);
            add_product2(&hi, &lo, &a, &x_a, fused);
            add_product2(&hi, &lo, &b, &x_b, fused);
            AT(two, q->hi + i) = hi;
            AT(two, q->lo + i) = lo;
            k += 2;
            l += 2;
        }
    }
    add_pair_lanes(q, j, &s);
    take_rest(q, j, k, fused);
    take_rest(q, j + 1, l, fused);
}

/* hi + lo -= p + N'r in row j */
UZ_INLINE void finish_row(const uz_residuals *out, int64_t j, const double *lo, const uz_csc *N, const double *p,
                          const double *r)
{
    const double low = lo[j]; /* e_u may stand there */
    double_double sum = {out->Ku[j], low};
    dd_add(&sum, -p[j]);
    for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
        dd_add_product(&sum.hi, &sum.lo, -N->val[k], r[N->idx[k]], 0);
    out->e_u[j] = sum.hi + sum.lo;
    dd_add(&sum, out->Kc[j]);
    out->e[j] = sum.hi + sum.lo;
    out->Ku[j] += low;
}

/* The same in rows j to j + 3, which N does not touch. */
UZ_INLINE void finish_four(const uz_residuals *out, int64_t j, const double *lo, const double *p)
{
    const four load = -READ(four, p + j), Kc = READ(four, out->Kc + j);
    four hi = READ(four, out->Ku + j), low = READ(four, lo + j);
    const four Ku = hi + low;
    add4(&hi, &low, &load);
    AT(four, out->e_u + j) = hi + low;
    add4(&hi, &low, &Kc);
    AT(four, out->e + j) = hi + low;
    AT(four, out->Ku + j) = Ku;
}

UZ_INLINE void multiply(const product_of *q, int64_t begin, int64_t end, int fused)
{
    for (int64_t j = begin; j < end; j++) {
        prepare_column(q, j);
        if (is_pair(q->A, j, end)) {
            prepare_column(q, j + 1);
            take_pair(q, j++, fused);
        } else {
            take_column(q, j, fused);
        }
    }
}

UZ_AVX2_FMA static void multiply_fused(void *ctx, int64_t begin, int64_t end)
{
    multiply(ctx, begin, end, 1);
}

static void multiply_split(void *ctx, int64_t begin, int64_t end)
{
    multiply(ctx, begin, end, 0);
}

/* Rows as the threads that share them see that. */
typedef struct {
    const uz_residuals *out;
    const double *lo, *p, *r;
    const uz_csc *N;
} finishing;

UZ_INLINE void finish(const finishing *x, int64_t begin, int64_t end)
{
    const uz_csc *N = x->N;
    for (int64_t j = begin; j < end;)
        if (j + 4 <= end && N->ptr[j + 4] == N->ptr[j]) {
            finish_four(x->out, j, x->lo, x->p);
            j += 4;
        } else {
            finish_row(x->out, j++, x->lo, N, x->p, x->r);
        }
}

UZ_AVX2_FMA static void finish_wide(void *ctx, int64_t begin, int64_t end)
{
    finish(ctx, begin, end);
}

static void finish_narrow(void *ctx, int64_t begin, int64_t end)
{
    finish(ctx, begin, end);
}

/* What is in passing where K has its entries. */
typedef struct {
    const uz_csc *K;
    double *weight;
} weighing;

static void find_weights(void *ctx, int64_t begin, int64_t end)
{
    const weighing *x = ctx;
    for (int64_t j = begin; j < end; j++)
        x->weight[j] = uz_dof_weight(x->K, j);
}

uz_status uz_equilibrium_residual(uz_residuals *out, const uz_csc *K, const uz_csc *N, const double *p, const double *u,
                                  const double *c, const double *r, uz_error *err)
{
    int64_t d = K->rows;
    double *lo = out->e_u; /* until a row is finished */
    product_of product = {
        .A = K, .x = u, .c = c, .last = d - 1, .hi = out->Ku, .lo = lo, .y = out->Kc, .weight = out->weight};
    while (product.first < d && c[product.first] == 0.0)
        product.first++;
    while (product.last >= 0 && c[product.last] == 0.0)
        product.last--;
    uz_status status = UZ_OK;
    if (out->brick) {
        if (out->weight)
            uz_by_pieces(find_weights, &(weighing){K, out->weight}, d);
        status = uz_brick_precise_product(out->Ku, lo, out->Kc, out->brick, u, c, err);
    } else {
        memset(lo, 0, (size_t)d * sizeof *lo);
        memset(out->Ku, 0, (size_t)d * sizeof *lo);
        memset(out->Kc, 0, (size_t)d * sizeof *lo);
        uz_by_columns(uz_cpu_has_avx2_fma() ? multiply_fused : multiply_split, &product, K);
    }
    if (status == UZ_OK)
        uz_by_pieces(uz_cpu_has_avx2_fma() ? finish_wide : finish_narrow, &(finishing){out, lo, p, r, N}, d);
    return status;
}

double uz_gap_of_row(const uz_csc *Nt, int64_t i, const double *h, const double *u, const double *c)
{
    double_double sum = {h[i], 0.0};
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++) {
        dd_add_product(&sum.hi, &sum.lo, -Nt->val[k], u[Nt->idx[k]], 0);
        if (c)
            dd_add_product(&sum.hi, &sum.lo, -Nt->val[k], c[Nt->idx[k]], 0);
    }
    return sum.hi + sum.lo;
}

static int64_t terms_of_column(const uz_csc *A, int64_t j)
{
    return A->ptr ? A->ptr[j + 1] - A->ptr[j] : 0;
}

/* Sums of rows as columns of K and N count them. */
typedef struct {
    const uz_csc *K, *N;
    int64_t *count;
} counting;

static void count_terms(void *ctx, int64_t begin, int64_t end)
{
    const counting *x = ctx;
    const uz_csc *K = x->K;
    int64_t *count = x->count;
    for (int64_t j = begin; j < end; j++) {
        count[j] += terms_of_column(K, j) + terms_of_column(x->N, j);
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            count[K->idx[k]] += K->idx[k] != j;
    }
}

int64_t uz_most_terms(const uz_csc *K, const uz_brick *brick, const uz_csc *N)
{
    const int64_t rows = brick ? 0 : K->rows, room = rows > N->rows ? rows : N->rows;
    const int64_t of_cells = brick ? brick->axes << 2 * brick->axes : 0; /* of each corner all that its cell has */
    int64_t most = 1, *count = uz_alloc_zero(room, sizeof *count);
    if (!count)
        return -1;
    if (!brick)
        uz_by_columns(count_terms, &(counting){K, N, count}, K);
    for (int64_t j = 0; j < K->cols; j++) {
        const int64_t own = brick ? of_cells + terms_of_column(N, j) : count[j];
        most = own + 2 > most ? own + 2 : most; /* p and K c */
    }
    memset(count, 0, (size_t)room * sizeof *count);
    for (int64_t k = 0; N->ptr && k < N->ptr[N->cols]; k++)
        most = 2 * ++count[N->idx[k]] + 1 > most ? 2 * count[N->idx[k]] + 1 : most;
    free(count);
    return most;
}
