#include "assembly/pressed.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Non-negative least squares: x >= 0 of least ||b - A'x||, by Lawson and Hanson, "Solving least squares problems"
 * (1974), chapter 23. Its residual y has A y <= 0 and y'b = ||y||^2: zero, or a motion that leaves the obstacles. */
typedef struct {
    int64_t m, k;
    double *A;         /* m x k, row by row: rows of N Z, of length 1 or 0 */
    double *b;         /* k */
    double *y;         /* k: residual */
    double *Q, *R;     /* k x k: orthonormal rows of the passive set, and their triangle */
    double *x, *trial; /* k: of the passive set */
    double *scratch;   /* k */
    int64_t *passive;  /* k: rows with x > 0 */
    bool *barred;      /* m: rows that the passive set spans, or would enter only to leave at once */
    int64_t n;
} nnls;

static const double SPANNED = 1e-11, ROUNDING = 1e-14;

static double dot(const double *a, const double *b, int64_t n)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Row i of the passive set (Gram-Schmidt, twice). False: the rows before span it. */
static bool orthogonalise(nnls *s, int64_t i)
{
    const int64_t k = s->k;
    double *q = s->Q + i * k;
    memcpy(q, s->A + s->passive[i] * k, (size_t)k * sizeof *q);
    for (int64_t j = 0; j <= i; j++)
        s->R[j * k + i] = 0.0;
    for (int twice = 0; twice < 2; twice++)
        for (int64_t j = 0; j < i; j++) {
            double share = dot(s->Q + j * k, q, k);
            s->R[j * k + i] += share;
            for (int64_t c = 0; c < k; c++)
                q[c] -= share * s->Q[j * k + c];
        }
    double length = sqrt(dot(q, q, k));
    s->R[i * k + i] = length;
    for (int64_t c = 0; c < k && length > 0.0; c++)
        q[c] /= length;
    return length > SPANNED;
}

/* trial = the least squares solution on the passive set; y = its residual. */
static void least_squares(nnls *s)
{
    const int64_t k = s->k;
    memcpy(s->y, s->b, (size_t)k * sizeof *s->y);
    for (int64_t i = 0; i < s->n; i++) {
        s->scratch[i] = dot(s->Q + i * k, s->y, k);
        for (int64_t c = 0; c < k; c++)
            s->y[c] -= s->scratch[i] * s->Q[i * k + c];
    }
    for (int64_t i = s->n - 1; i >= 0; i--) {
        double sum = s->scratch[i];
        for (int64_t j = i + 1; j < s->n; j++)
            sum -= s->R[i * k + j] * s->trial[j];
        s->trial[i] = sum / s->R[i * k + i];
    }
}

/* Towards trial as far as x stays non-negative; what reaches zero leaves. True when trial was reached. */
static bool step_to_trial(nnls *s)
{
    double alpha = 1.0;
    int64_t kept = 0;
    for (int64_t i = 0; i < s->n; i++)
        if (s->trial[i] <= 0.0)
            alpha = fmin(alpha, s->x[i] / (s->x[i] - s->trial[i]));
    bool whole = true;
    for (int64_t i = 0; i < s->n; i++) {
        double x = s->x[i] + alpha * (s->trial[i] - s->x[i]);
        bool leaves = s->trial[i] <= 0.0 && !(x > ROUNDING * fabs(s->trial[i]));
        whole = whole && s->trial[i] > 0.0;
        if (leaves) {
            s->barred[s->passive[i]] = true;
            continue;
        }
        s->passive[kept] = s->passive[i];
        s->x[kept++] = x;
    }
    bool stuck = kept == s->n && !whole;
    s->n = kept;
    for (int64_t i = 0; i < kept; i++)
        orthogonalise(s, i);
    return whole || stuck;
}

/* Fills y for the b that stands in s. */
static void solve(nnls *s, double scale)
{
    s->n = 0;
    memset(s->barred, 0, (size_t)s->m * sizeof *s->barred);
    least_squares(s);
    for (int64_t step = 0; step < 10 * (s->m + s->k) && s->n <= s->k; step++) {
        int64_t row = -1; /* that y violates most */
        double most = ROUNDING * scale;
        for (int64_t i = 0; i < s->m; i++) {
            const double w = dot(s->A + i * s->k, s->y, s->k);
            if (!s->barred[i] && w > most) {
                row = i;
                most = w;
            }
        }
        if (row < 0)
            break;
        if (s->n < s->k) {
            s->passive[s->n] = row;
            s->x[s->n] = 0.0;
        }
        if (s->n == s->k || !orthogonalise(s, s->n)) {
            s->barred[row] = true;
            continue;
        }
        double before = dot(s->y, s->y, s->k);
        s->n++;
        for (least_squares(s); !step_to_trial(s);)
            least_squares(s);
        least_squares(s);
        if (dot(s->y, s->y, s->k) < before * (1.0 - ROUNDING)) /* progress: rows that left may come again */
            memset(s->barred, 0, (size_t)s->m * sizeof *s->barred);
        else
            s->barred[row] = true;
    }
}

/* A = N Z with rows of length 1; those that are zero but for rounding become zero. */
static uz_status fill_rows(nnls *s, const double *Z, const uz_csc *N, uz_error *err)
{
    double *size = uz_alloc_zero(s->m, sizeof *size);
    if (!size)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)s->m);
    for (int64_t c = 0; c < s->k; c++)
        for (int64_t j = 0; j < N->cols; j++)
            for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
                double share = N->val[q] * Z[c * N->cols + j];
                s->A[N->idx[q] * s->k + c] += share;
                size[N->idx[q]] += fabs(share);
            }
    for (int64_t i = 0; i < s->m; i++) {
        double *row = s->A + i * s->k, length = sqrt(dot(row, row, s->k));
        for (int64_t c = 0; c < s->k; c++)
            row[c] = length > 1e-10 * size[i] ? row[c] / length : 0.0;
    }
    free(size);
    return UZ_OK;
}

/* Is the load inside of the cone of the contact forces, not on its border? It is, when moving it a little in every
 * direction does not lead out. */
static bool is_inside(nnls *s, const double *load, const double *size, double scale, double tolerance)
{
    for (int64_t c = 0; c < s->k; c++)
        for (int sign = -1; sign <= 1; sign += 2) {
            double shift = 100.0 * tolerance * size[c];
            memcpy(s->b, load, (size_t)s->k * sizeof *s->b);
            s->b[c] += sign * shift;
            solve(s, scale);
            if (sqrt(dot(s->y, s->y, s->k)) > 1e-2 * shift)
                return false;
        }
    return true;
}

uz_status uz_load_on_modes(uz_pressing *how, double *y, const double *Z, int64_t k, const uz_csc *N, const double *p,
                           double tolerance, bool strict, uz_error *err)
{
    const int64_t m = N->rows;
    nnls s = {.m = m, .k = k};
    double *load = uz_alloc_zero(2 * k, sizeof *load), *terms = load + k, largest = 0.0;
    double **room[] = {&s.A, &s.Q, &s.R, &s.b, &s.y, &s.x, &s.trial, &s.scratch};
    const int64_t size[] = {m * k, k * k, k * k, k, k, k, k, k};
    bool ok =
        load && (s.barred = uz_alloc_zero(m, sizeof *s.barred)) && (s.passive = uz_alloc_zero(k, sizeof *s.passive));
    for (size_t i = 0; i < sizeof room / sizeof room[0]; i++)
        ok = ok && (*room[i] = uz_alloc_zero(size[i], sizeof(double)));
    *how = UZ_PRESSED_ON;
    uz_status status = ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld modes", (long long)k);
    if (status == UZ_OK)
        status = fill_rows(&s, Z, N, err);
    if (status == UZ_OK && k > 0) {
        for (int64_t c = 0; c < k; c++) {
            for (int64_t j = 0; j < N->cols; j++) {
                load[c] += Z[c * N->cols + j] * p[j];
                terms[c] += fabs(Z[c * N->cols + j] * p[j]);
            }
            largest = fmax(largest, terms[c]);
        }
        const double scale = largest > 0.0 ? largest : 1.0;
        for (int64_t c = 0; c < k; c++) /* what no load works on, but by rounding, counts with the largest */
            terms[c] = terms[c] > ROUNDING * scale ? terms[c] : scale;
        memcpy(s.b, load, (size_t)k * sizeof *s.b);
        solve(&s, scale);
        if (sqrt(dot(s.y, s.y, k)) > tolerance * scale)
            *how = UZ_PUSHED_AWAY;
        else if (strict && !is_inside(&s, load, terms, scale, tolerance))
            *how = UZ_COSTS_NOTHING;
        memcpy(y, s.y, (size_t)k * sizeof *y);
    }
    for (size_t i = 0; i < sizeof room / sizeof room[0]; i++)
        free(*room[i]);
    uz_free_all(load, s.barred, s.passive);
    return status;
}
