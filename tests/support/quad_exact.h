/* quad_exact.h: exact solutions of small contact problems, in quadruple precision.
 *
 * The dual of the problem is solved by the active set method of Goldfarb and Idnani (Math. Program. 27 (1983)), which
 * bears dependent rows; then the optimality conditions are checked, so how the solution was found need not be trusted:
 * they are sufficient. About 33 digits are carried: the answer is exact for tests of double precision as long as K is
 * not conditioned worse than about 1e14. */
#ifndef TESTS_QUAD_EXACT_H
#define TESTS_QUAD_EXACT_H

#include "core/alloc.h"
#include "uzawa.h"

#include <stdlib.h>
#include <string.h>

typedef __float128 quad;

/* Rows that differ by less than the root of this from the span of others, in the norm of K^-1, depend on them. */
#define QUAD_DEPENDENT ((quad)1e-28)

/* A penetration below this, relative to the terms that it is the difference of, is rounding. */
#define QUAD_ROUNDING ((quad)1e-31)

static inline quad quad_abs(quad x)
{
    return x < 0 ? -x : x;
}

static inline quad quad_sqrt(quad x)
{
    quad unit = 1;
    if (!(x > 0))
        return 0;
    for (; x > 0x1p400; x *= 0x1p-400) /* into the range of double, for the start */
        unit *= 0x1p200;
    for (; x < 0x1p-400; x *= 0x1p400)
        unit *= 0x1p-200;
    quad root = __builtin_sqrt((double)x);
    for (int k = 0; k < 3; k++)
        root = (root + x / root) / 2;
    return unit * root;
}

static inline quad *quad_zeros(int64_t n)
{
    quad *x = calloc((size_t)n + 1, sizeof *x);
    if (!x)
        abort();
    return x;
}

/* A = L L' in place, row-major lower triangle with rows that begin at column first[i]. False: a pivot is not above
 * `least` times its diagonal entry; *stop is then its row. */
static inline bool quad_cholesky(quad *A, int64_t n, const int64_t *first, quad least, int64_t *stop)
{
    for (int64_t i = 0; i < n; i++) {
        int64_t first_i = first ? first[i] : 0;
        quad diagonal = A[i * n + i];
        for (int64_t j = first_i; j < i; j++) {
            int64_t from = first && first[j] > first_i ? first[j] : first_i;
            quad sum = A[i * n + j];
            for (int64_t k = from; k < j; k++)
                sum -= A[i * n + k] * A[j * n + k];
            A[i * n + j] = sum / A[j * n + j];
        }
        quad sum = diagonal;
        for (int64_t k = first_i; k < i; k++)
            sum -= A[i * n + k] * A[i * n + k];
        if (!(sum > least * diagonal)) {
            *stop = i;
            return false;
        }
        A[i * n + i] = quad_sqrt(sum);
    }
    return true;
}

/* x = L^-1 x and x = L'^-1 x. */
static inline void quad_forward(quad *x, const quad *L, int64_t n, const int64_t *first)
{
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = first ? first[i] : 0; k < i; k++)
            x[i] -= L[i * n + k] * x[k];
        x[i] /= L[i * n + i];
    }
}

static inline void quad_backward(quad *x, const quad *L, int64_t n, const int64_t *first)
{
    for (int64_t i = n - 1; i >= 0; i--) {
        x[i] /= L[i * n + i];
        for (int64_t k = first ? first[i] : 0; k < i; k++)
            x[k] -= L[i * n + k] * x[i];
    }
}

/* A problem, its dual operator and its solution. */
typedef struct {
    const uz_qp *qp;
    int64_t d, m;
    int64_t *first;     /* d: envelope of L */
    quad *L;            /* d x d: K = L L' */
    quad *Z;            /* m x d: row i is (L^-1 n_i)' */
    quad *D, *g0;       /* m x m, m */
    quad *u, *r, *g;    /* the solution: d, m, m */
    bool *active;       /* m: rows that the solution holds as equations, linearly independent */
    int64_t n_active;   /* how many */
    quad violation;     /* of the optimality conditions, each relative to its row's own scale */
    quad energy, norm2; /* pi(u*), ||u*||_K^2 */
} quad_exact;

static inline void quad_exact_free(quad_exact *x)
{
    uz_free_all(x->first, x->L, x->Z, x->D, x->g0, x->u, x->r, x->g, x->active);
    memset(x, 0, sizeof *x);
}

static inline void quad_factor_stiffness(quad_exact *x)
{
    const uz_csc *K = &x->qp->K;
    int64_t d = x->d, stop;
    for (int64_t j = 0; j < d; j++)
        x->first[j] = j;
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            x->L[K->idx[k] * d + j] = K->val[k];
            if (j < x->first[K->idx[k]])
                x->first[K->idx[k]] = j;
        }
    if (!quad_cholesky(x->L, d, x->first, 0, &stop))
        abort();
}

static inline void quad_make_dual(quad_exact *x)
{
    const uz_csc *N = &x->qp->N;
    int64_t d = x->d, m = x->m;
    quad *y = quad_zeros(d);
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            x->Z[N->idx[k] * d + j] = N->val[k];
    for (int64_t j = 0; j < d; j++)
        y[j] = x->qp->p[j];
    quad_forward(y, x->L, d, x->first);
    for (int64_t i = 0; i < m; i++) {
        quad_forward(x->Z + i * d, x->L, d, x->first);
        x->g0[i] = x->qp->h[i];
        for (int64_t j = 0; j < d; j++)
            x->g0[i] -= x->Z[i * d + j] * y[j];
        for (int64_t k = 0; k <= i; k++) {
            quad sum = 0;
            for (int64_t j = 0; j < d; j++)
                sum += x->Z[i * d + j] * x->Z[k * d + j];
            x->D[i * m + k] = x->D[k * m + i] = sum;
        }
    }
    free(y);
}

/* Rows `rows` of D factored; shrinks the list by the rows that depend on earlier ones. */
static inline quad *quad_factor_rows(const quad_exact *x, int64_t *rows, int64_t *count)
{
    for (;;) {
        int64_t n = *count, stop = 0;
        quad *A = quad_zeros(n * n);
        for (int64_t i = 0; i < n; i++)
            for (int64_t j = 0; j < n; j++)
                A[i * n + j] = x->D[rows[i] * x->m + rows[j]];
        if (quad_cholesky(A, n, NULL, QUAD_DEPENDENT, &stop))
            return A;
        free(A);
        memmove(rows + stop, rows + stop + 1, (size_t)(n - stop - 1) * sizeof *rows);
        (*count)--;
    }
}

/* r with D_AA r_A = g0_A, zero elsewhere, and g = g0 - D r. */
static inline void quad_solve_rows(quad_exact *x, int64_t *rows, int64_t *count)
{
    quad *L = quad_factor_rows(x, rows, count), *y = quad_zeros(*count);
    for (int64_t k = 0; k < *count; k++)
        y[k] = x->g0[rows[k]];
    quad_forward(y, L, *count, NULL);
    quad_backward(y, L, *count, NULL);
    for (int64_t i = 0; i < x->m; i++)
        x->r[i] = 0;
    for (int64_t k = 0; k < *count; k++)
        x->r[rows[k]] = y[k];
    for (int64_t i = 0; i < x->m; i++) {
        x->g[i] = x->g0[i];
        for (int64_t k = 0; k < *count; k++)
            x->g[i] -= x->D[i * x->m + rows[k]] * y[k];
    }
    free(L);
    free(y);
}

/* A start of the method: the rows listed, without those that pull. */
static inline void quad_drop_pulling(quad_exact *x, int64_t *rows, int64_t *count)
{
    for (bool again = true; again;) {
        int64_t kept = 0, before = *count;
        quad_solve_rows(x, rows, count);
        before = *count;
        for (int64_t k = 0; k < before; k++)
            if (x->r[rows[k]] <= 0)
                rows[kept++] = rows[k];
        again = kept < before;
        *count = kept;
    }
}

/* One penetrating row q comes into contact; rows that would pull on the way leave. False: no feasible displacement. */
static inline bool quad_add_row(quad_exact *x, int64_t *rows, int64_t *count, int64_t q)
{
    int64_t m = x->m;
    quad pushed = 0; /* -r_q */
    for (;;) {
        int64_t n = *count, blocking = -1;
        quad *L = quad_factor_rows(x, rows, count), *w = quad_zeros(n), curvature = x->D[q * m + q], gap = x->g0[q];
        for (int64_t k = 0; k < n; k++)
            w[k] = x->D[rows[k] * m + q];
        quad_forward(w, L, n, NULL);
        quad_backward(w, L, n, NULL);
        for (int64_t k = 0; k < n; k++) {
            curvature -= x->D[q * m + rows[k]] * w[k];
            gap -= x->D[q * m + rows[k]] * x->r[rows[k]];
        }
        gap += x->D[q * m + q] * pushed;
        quad size = quad_sqrt(x->D[q * m + q]); /* what the curvature is the difference of, squared */
        for (int64_t k = 0; k < n; k++)
            size += quad_abs(w[k]) * quad_sqrt(x->D[rows[k] * m + rows[k]]);
        bool free_to_move = curvature > QUAD_DEPENDENT * x->D[q * m + q] && curvature > QUAD_ROUNDING * size * size;
        quad step = free_to_move ? -gap / curvature : -1;
        for (int64_t k = 0; k < n; k++)
            if (w[k] > 0 && (step < 0 || -x->r[rows[k]] < step * w[k])) {
                step = -x->r[rows[k]] / w[k];
                blocking = k;
            }
        for (int64_t k = 0; step >= 0 && k < n; k++)
            x->r[rows[k]] += step * w[k];
        free(L);
        free(w);
        if (step < 0)
            return false;
        pushed += step;
        if (blocking < 0) {
            rows[(*count)++] = q;
            return true;
        }
        x->r[rows[blocking]] = 0;
        memmove(rows + blocking, rows + blocking + 1, (size_t)(n - blocking - 1) * sizeof *rows);
        (*count)--;
    }
}

/* The row that penetrates most relative to sqrt(D_ii), -1 where none penetrates beyond the rounding of its own terms:
 * a row with a wide gap must not hide the penetration of another. *worst: relative to those terms. */
static inline int64_t quad_worst_row(const quad_exact *x, quad *worst)
{
    quad reach = 0, deepest = 0;
    int64_t row = -1;
    *worst = 0;
    for (int64_t i = 0; i < x->m; i++)
        reach += quad_sqrt(x->D[i * x->m + i]) * quad_abs(x->r[i]);
    for (int64_t i = 0; i < x->m; i++) {
        quad size = quad_sqrt(x->D[i * x->m + i]);
        if (!(size > 0) || x->g[i] >= 0)
            continue;
        quad miss = -x->g[i] / (quad_abs(x->g0[i]) + size * reach);
        *worst = miss > *worst ? miss : *worst;
        if (miss > QUAD_ROUNDING && -x->g[i] / size > deepest) {
            deepest = -x->g[i] / size;
            row = i;
        }
    }
    return row;
}

/* Reactions of the wrong sign enter the violation, relative to the largest. */
static inline void quad_measure_pull(quad_exact *x)
{
    quad largest = 0, pull = 0;
    for (int64_t i = 0; i < x->m; i++) {
        quad size = x->r[i] * quad_sqrt(x->D[i * x->m + i]);
        largest = quad_abs(size) > largest ? quad_abs(size) : largest;
        pull = size > pull ? size : pull;
    }
    if (pull > x->violation * largest)
        x->violation = pull / largest;
}

static inline void quad_recover(quad_exact *x)
{
    int64_t d = x->d;
    const uz_qp *qp = x->qp;
    for (int64_t j = 0; j < d; j++)
        x->u[j] = qp->p[j];
    for (int64_t j = 0; j < qp->N.cols; j++)
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            x->u[j] += qp->N.val[k] * x->r[qp->N.idx[k]];
    quad_forward(x->u, x->L, d, x->first);
    for (int64_t j = 0; j < d; j++)
        x->norm2 += x->u[j] * x->u[j];
    quad_backward(x->u, x->L, d, x->first);
    x->energy = x->norm2 / 2;
    for (int64_t j = 0; j < d; j++)
        x->energy -= qp->p[j] * x->u[j];
}

/* Solves. start (m, may be NULL): rows that are likely to touch. False: no feasible displacement. Check `violation`. */
static inline bool quad_exact_solve(quad_exact *x, const uz_qp *qp, const bool *start)
{
    int64_t d = qp->K.cols, m = qp->N.rows, count = 0, row;
    *x = (quad_exact){.qp = qp, .d = d, .m = m};
    x->first = calloc((size_t)d + 1, sizeof *x->first);
    x->active = calloc((size_t)m + 1, sizeof *x->active);
    x->L = quad_zeros(d * d);
    x->Z = quad_zeros(m * d);
    x->D = quad_zeros(m * m);
    x->g0 = quad_zeros(m);
    x->u = quad_zeros(d);
    x->r = quad_zeros(m);
    x->g = quad_zeros(m);
    quad_factor_stiffness(x);
    quad_make_dual(x);
    int64_t *rows = calloc((size_t)m + 1, sizeof *rows);
    bool ok = true;
    for (int64_t i = 0; start && i < m; i++)
        if (start[i] && x->D[i * m + i] > 0)
            rows[count++] = i;
    quad_drop_pulling(x, rows, &count);
    for (int64_t step = 0; ok && step <= 20 * (m + 5) && (row = quad_worst_row(x, &x->violation)) >= 0; step++) {
        ok = quad_add_row(x, rows, &count, row);
        quad_solve_rows(x, rows, &count);
    }
    for (int64_t k = 0; k < count; k++)
        x->active[rows[k]] = true;
    x->n_active = count;
    quad_measure_pull(x);
    free(rows);
    if (ok)
        quad_recover(x);
    return ok;
}

/* ||u - u*||_K */
static inline double quad_error(const quad_exact *x, const double *u)
{
    quad *e = quad_zeros(x->d), sum = 0;
    for (int64_t j = 0; j < x->d; j++)
        e[j] = (quad)u[j] - x->u[j];
    for (int64_t j = 0; j < x->d; j++) { /* L'e */
        quad y = 0;
        for (int64_t i = j; i < x->d; i++)
            y += x->L[i * x->d + j] * e[i];
        sum += y * y;
    }
    free(e);
    return (double)quad_sqrt(sum);
}

/* ||u_r - u*||_K for u_r = K^-1 (p + N'r) */
static inline double quad_error_of_reactions(const quad_exact *x, const double *r)
{
    quad sum = 0, *y = quad_zeros(x->d);
    for (int64_t i = 0; i < x->m; i++)
        for (int64_t j = 0; r[i] != x->r[i] && j < x->d; j++)
            y[j] += x->Z[i * x->d + j] * ((quad)r[i] - x->r[i]);
    for (int64_t j = 0; j < x->d; j++)
        sum += y[j] * y[j];
    free(y);
    return (double)quad_sqrt(sum);
}

/* psi(r) - psi(r*) = (r - r*)'g* - 1/2 ||u_r - u*||_K^2, and psi(r*) = pi(u*). */
static inline double quad_dual_objective(const quad_exact *x, const double *r)
{
    double error = quad_error_of_reactions(x, r);
    quad value = x->energy - (quad)error * error / 2;
    for (int64_t i = 0; i < x->m; i++)
        value += ((quad)r[i] - x->r[i]) * x->g[i];
    return (double)value;
}

#endif
