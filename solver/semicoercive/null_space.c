#include "semicoercive/null_space.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/hooks.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A shift of this many d eps: enough for the rounding of a matrix that was assembled in doubles. */
static const double SHIFTS = 16.0;

/* A direction with this share of the augmented energy from K or less is one of its null space. */
static const double NULL_SHARE = 1e-9;

enum { FIRST_BLOCK = 8, ITERATIONS = 6 };

/* K without the dofs that have no stiffness at all: rows and columns of zeros, which a semidefinite K may have. */
static uz_status without_empty(uz_csc *out, const uz_csc *K, uz_error *err)
{
    int64_t n = 0, nnz = 0, *number = uz_alloc(K->cols, sizeof *number);
    bool *used = uz_alloc_zero(K->cols, sizeof *used);
    uz_status status = UZ_OK;
    if (!number || !used) {
        status = uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld dofs", (long long)K->cols);
        goto done;
    }
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            if (K->val[q] != 0.0) {
                used[j] = used[K->idx[q]] = true;
                nnz++;
            }
    for (int64_t j = 0; j < K->cols; j++)
        number[j] = used[j] ? n++ : -1;
    status = uz_csc_init(out, n, n, nnz, err);
    for (int64_t j = 0, at = 0; status == UZ_OK && j < K->cols; j++) {
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            if (K->val[q] != 0.0) {
                out->idx[at] = (int32_t)number[K->idx[q]];
                out->val[at++] = K->val[q];
            }
        if (used[j])
            out->ptr[number[j] + 1] = at;
    }
done:
    uz_free_all(number, used);
    return status;
}

uz_status uz_check_semidefinite(const uz_csc *K, const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    uz_csc shifted = {0};
    uz_analysis *analysis = NULL;
    uz_factor *factor = NULL;
    uz_status status = without_empty(&shifted, K, err);
    const double delta = SHIFTS * DBL_EPSILON * (double)shifted.cols;
    for (int64_t j = 0; status == UZ_OK && j < shifted.cols; j++) {
        const int64_t first = shifted.ptr[j];
        if (first == shifted.ptr[j + 1] || shifted.idx[first] != j || !(shifted.val[first] > 0.0))
            status = uz_fail(err, UZ_ERR_NOT_SPD, "K", "K is not positive semidefinite: see its diagonal");
        else
            shifted.val[first] *= 1.0 + delta;
    }
    if (status == UZ_OK && shifted.cols > 0)
        status = uz_analysis_create(&analysis, &shifted, NULL, 0, 0, settings->ordering, hooks, err);
    if (status == UZ_OK && shifted.cols > 0)
        status = uz_factor_create(&factor, &shifted, analysis, settings->memory_limit, hooks, err);
    uz_analysis_free(analysis);
    uz_factor_free(factor);
    uz_csc_clear(&shifted);
    return status;
}

/* A block of b vectors, d x b. */
typedef struct {
    const uz_csc *K, *K_R, *N, *Nt;
    const double *weight;
    const uz_factor *factor;
    const uz_hooks *hooks;
    uz_factor_workspace *ws;
    int64_t d, m, b;
    double *X, *Y;     /* d x b; Y: K_R X, or K X */
    double *B;         /* b x b */
    int64_t *pivot;    /* b */
    double *row, *dof; /* m, d */
} block;

/* X = K_R^-1 N'R N X, or K_R^-1 N'R^1/2 times random numbers to begin with. */
static uz_status iterate(block *s, bool first, uz_error *err)
{
    uint64_t random = 1;
    uz_status status = UZ_OK;
    for (int64_t c = 0; c < s->b && status == UZ_OK; c++) {
        memset(s->row, 0, (size_t)s->m * sizeof *s->row);
        if (!first)
            uz_csc_gaxpy(s->row, s->N, 1.0, s->X + c * s->d);
        for (int64_t i = 0; i < s->m; i++) {
            s->row[i] *= s->weight[i];
            if (first && s->weight[i] > 0.0) {
                random = random * 6364136223846793005u + 1442695040888963407u; /* Knuth's MMIX generator */
                s->row[i] = ((double)(random >> 11) * 0x1p-53 - 0.5) * sqrt(s->weight[i]);
            }
        }
        double *x = s->X + c * s->d;
        memset(x, 0, (size_t)s->d * sizeof *x);
        uz_csc_gaxpy(x, s->Nt, 1.0, s->row);
        status = uz_cancelled(s->hooks) ? uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration")
                                        : uz_factor_solve(s->factor, s->ws, x, x, s->dof, err);
    }
    return status;
}

/* Orthonormal in the norm of K_R; Y = K_R X. Vectors that others span are dropped. */
static void orthonormalise(block *s)
{
    const int64_t d = s->d;
    int64_t kept = 0;
    for (int64_t c = 0; c < s->b; c++) {
        double *x = s->X + kept * d, *y = s->Y + kept * d, before = 0.0, norm2 = 0.0;
        memmove(x, s->X + c * d, (size_t)d * sizeof *x);
        for (int twice = 0; twice < 2; twice++) {
            memset(y, 0, (size_t)d * sizeof *y);
            uz_csc_symv(y, s->K_R, 1.0, x);
            if (twice == 0)
                before = uz_dot(d, x, y);
            for (int64_t j = 0; j < kept; j++)
                uz_axpy(d, -uz_dot(d, s->Y + j * d, x), s->X + j * d, x);
        }
        memset(y, 0, (size_t)d * sizeof *y);
        uz_csc_symv(y, s->K_R, 1.0, x);
        norm2 = uz_dot(d, x, y);
        if (!(norm2 > 1e-20 * before))
            continue;
        double scale = 1.0 / sqrt(norm2);
        for (int64_t j = 0; j < d; j++) {
            x[j] *= scale;
            y[j] *= scale;
        }
        kept++;
    }
    s->b = kept;
}

/* B = X'K X, b x b, row by row, and its Cholesky factorization with complete pivoting (Higham 2002, section 10.3), L in
 * the lower triangle. The rank: pivots below NULL_SHARE count as zero, as X is orthonormal in the norm of K_R. */
static int64_t factor_projection(block *s)
{
    const int64_t n = s->b, d = s->d;
    for (int64_t c = 0; c < n; c++) {
        memset(s->Y + c * d, 0, (size_t)d * sizeof *s->Y);
        uz_csc_symv(s->Y + c * d, s->K, 1.0, s->X + c * d);
        for (int64_t i = 0; i <= c; i++)
            s->B[i * n + c] = s->B[c * n + i] = uz_dot(d, s->X + i * d, s->Y + c * d);
        s->pivot[c] = c;
    }
    for (int64_t j = 0; j < n; j++) {
        int64_t best = j;
        for (int64_t i = j + 1; i < n; i++)
            best = s->B[i * n + i] > s->B[best * n + best] ? i : best;
        if (!(s->B[best * n + best] > NULL_SHARE))
            return j;
        const int64_t row = s->pivot[j];
        s->pivot[j] = s->pivot[best];
        s->pivot[best] = row;
        for (int64_t i = 0; i < n && best != j; i++) {
            const double t = s->B[j * n + i];
            s->B[j * n + i] = s->B[best * n + i];
            s->B[best * n + i] = t;
        }
        for (int64_t i = 0; i < n && best != j; i++) {
            const double t = s->B[i * n + j];
            s->B[i * n + j] = s->B[i * n + best];
            s->B[i * n + best] = t;
        }
        const double root = sqrt(s->B[j * n + j]);
        s->B[j * n + j] = root;
        for (int64_t i = j + 1; i < n; i++)
            s->B[i * n + j] /= root;
        for (int64_t i = j + 1; i < n; i++)
            for (int64_t c = j + 1; c < n; c++)
                s->B[i * n + c] -= s->B[i * n + j] * s->B[c * n + j];
    }
    return n;
}

/* The null vectors in a block of b; *k may be all of them. */
static uz_status search(block *s, double **Z, int64_t *k, int64_t b, uz_error *err)
{
    s->b = b;
    s->X = uz_alloc_zero(s->d * b, sizeof(double));
    s->Y = uz_alloc_zero(s->d * b, sizeof(double));
    s->B = uz_alloc_zero(b * b, sizeof(double));
    s->pivot = uz_alloc_zero(b, sizeof(int64_t));
    s->row = uz_alloc_zero(s->m, sizeof(double));
    s->dof = uz_alloc_zero(s->d, sizeof(double));
    if (!s->X || !s->Y || !s->B || !s->pivot || !s->row || !s->dof)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for the null space of %lld dofs", (long long)s->d);
    uz_status status = iterate(s, true, err);
    for (int i = 0; i < ITERATIONS && status == UZ_OK; i++) {
        orthonormalise(s);
        status = iterate(s, false, err);
    }
    if (status != UZ_OK)
        return status;
    orthonormalise(s);
    const int64_t rank = factor_projection(s), n = s->b;
    *k = n - rank;
    *Z = uz_alloc_zero(*k * s->d, sizeof **Z);
    if (!*Z)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for %lld null vectors", (long long)*k);
    for (int64_t c = rank; c < n; c++) {
        /* the combination of X that column c of the pivoted factor leaves without energy: L11'x = -L21'e, x_c = 1 */
        double *z = *Z + (c - rank) * s->d, x[2 * UZ_NULL_MOST] = {0}, largest = 0.0;
        for (int64_t i = rank - 1; i >= 0; i--) {
            double sum = -s->B[c * n + i];
            for (int64_t j = i + 1; j < rank; j++)
                sum -= s->B[j * n + i] * x[j];
            x[i] = sum / s->B[i * n + i];
        }
        x[c] = 1.0;
        memset(z, 0, (size_t)s->d * sizeof *z);
        for (int64_t i = 0; i < n; i++)
            if (x[i] != 0.0)
                uz_axpy(s->d, x[i], s->X + s->pivot[i] * s->d, z);
        for (int64_t j = 0; j < s->d; j++)
            largest = fmax(largest, fabs(z[j]));
        for (int64_t j = 0; largest > 0.0 && j < s->d; j++)
            z[j] /= largest;
    }
    return UZ_OK;
}

uz_status uz_null_space(double **Z, int64_t *k, const uz_csc *K, const uz_csc *K_R, const uz_csc *N, const uz_csc *Nt,
                        const double *weight, const uz_factor *factor, const uz_hooks *hooks, uz_error *err)
{
    block s = {.K = K,
               .K_R = K_R,
               .N = N,
               .Nt = Nt,
               .weight = weight,
               .factor = factor,
               .hooks = hooks,
               .d = K->cols,
               .m = N->rows};
    *Z = NULL;
    *k = 0;
    s.ws = uz_factor_workspace_new();
    uz_status status = s.ws ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for the null space");
    for (int64_t b = FIRST_BLOCK; status == UZ_OK; b *= 2) {
        free(*Z);
        *Z = NULL;
        b = b < s.m ? b : s.m; /* N'R N has no larger rank */
        status = search(&s, Z, k, b, err);
        uz_free_all(s.X, s.Y, s.B, s.pivot, s.row, s.dof);
        s.X = s.Y = s.B = s.row = s.dof = NULL;
        s.pivot = NULL;
        if (*k < b || b == s.m || b > UZ_NULL_MOST)
            break;
    }
    uz_factor_workspace_free(s.ws);
    if (status != UZ_OK || *k > UZ_NULL_MOST) {
        free(*Z);
        *Z = NULL;
    }
    return status;
}
