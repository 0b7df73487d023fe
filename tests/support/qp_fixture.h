/* qp_fixture.h: problems in matrices for the tests of the numerical core: random ones, and ones read from folders. */
#ifndef TESTS_QP_FIXTURE_H
#define TESTS_QP_FIXTURE_H

#include "harness.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    uint64_t state;
} qp_random;

/* Uniform in [0, 1) (Vigna, splitmix64). */
static inline double random_unit(qp_random *rng)
{
    uint64_t z = rng->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static inline double random_signed(qp_random *rng)
{
    return 2 * random_unit(rng) - 1;
}

/* In [low, high). */
static inline int64_t random_int(qp_random *rng, int64_t low, int64_t high)
{
    return low + (int64_t)(random_unit(rng) * (double)(high - low));
}

static inline double *vector(int64_t n)
{
    double *x = calloc((size_t)n + 1, sizeof *x);
    if (!x)
        abort();
    return x;
}

/* Columns of a dense row-major matrix; exact zeros are left out, and for `lower` the strict upper part. */
static inline uz_csc csc_from_dense(const double *dense, int64_t rows, int64_t cols, bool lower)
{
    uz_csc A;
    uz_error err = {0};
    int64_t nnz = 0;
    for (int64_t i = 0; i < rows; i++)
        for (int64_t j = 0; j < cols; j++)
            nnz += dense[i * cols + j] != 0 && (!lower || i >= j);
    if (uz_csc_init(&A, rows, cols, nnz, &err) != UZ_OK)
        abort();
    int64_t at = 0;
    for (int64_t j = 0; j < cols; j++) {
        for (int64_t i = lower ? j : 0; i < rows; i++) {
            if (dense[i * cols + j] == 0)
                continue;
            A.idx[at] = (int32_t)i;
            A.val[at++] = dense[i * cols + j];
        }
        A.ptr[j + 1] = at;
    }
    return A;
}

/* x = (I - 2vv'/v'v) x for each column of the n x n matrix A. */
static inline void reflect_columns(double *A, const double *v, int64_t n)
{
    double square = 0;
    for (int64_t i = 0; i < n; i++)
        square += v[i] * v[i];
    for (int64_t j = 0; j < n; j++) {
        double dot = 0;
        for (int64_t i = 0; i < n; i++)
            dot += v[i] * A[i * n + j];
        for (int64_t i = 0; i < n; i++)
            A[i * n + j] -= 2 * dot / square * v[i];
    }
}

static inline void transpose_square(double *A, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++) {
            double t = A[i * n + j];
            A[i * n + j] = A[j * n + i];
            A[j * n + i] = t;
        }
}

/* Dense symmetric n x n with eigenvalues from scale / condition to scale, spread evenly in the logarithm, in a random
 * orthonormal basis. */
static inline double *random_spd(qp_random *rng, int64_t n, double condition, double scale)
{
    double *A = vector(n * n), *v = vector(n);
    for (int64_t i = 0; i < n; i++)
        A[i * n + i] = scale * pow(condition, n > 1 ? -(double)i / (double)(n - 1) : 0.0);
    for (int k = 0; k < 3; k++) {
        for (int64_t i = 0; i < n; i++)
            v[i] = random_signed(rng);
        reflect_columns(A, v, n);
        transpose_square(A, n);
        reflect_columns(A, v, n);
    }
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < i; j++)
            A[i * n + j] = A[j * n + i] = 0.5 * (A[i * n + j] + A[j * n + i]);
    free(v);
    return A;
}

/* What a random problem is made of. */
typedef struct {
    int64_t d, m;
    double condition;  /* of K */
    bool dependent;    /* every third row repeats the one before, at another scale */
    bool badly_scaled; /* rows are multiplied by 1e8 or 1e-8 */
    bool zero_row;     /* row 0 is zero, with h = 0 */
} qp_kind;

/* Row i of N in row-major `N`, dense to half. */
static inline void random_row(qp_random *rng, double *N, int64_t i, const qp_kind *kind)
{
    static const double factors[] = {1, 4, 0.3, 1e3};
    int64_t d = kind->d;
    double scale = kind->badly_scaled && i % 2 == 1 ? (i % 4 == 1 ? 1e8 : 1e-8) : 1;
    for (int64_t j = 0; j < d; j++)
        N[i * d + j] = random_unit(rng) < 0.5 ? scale * random_signed(rng) : 0;
    N[i * d + random_int(rng, 0, d)] = scale * (1 + random_unit(rng));
    if (kind->dependent && i % 3 == 2)
        for (int64_t j = 0; j < d; j++)
            N[i * d + j] = factors[(i / 3) % 4] * N[(i - 1) * d + j];
    if (kind->zero_row && i == 0)
        memset(N, 0, (size_t)d * sizeof *N);
}

/* A problem with a feasible displacement. About half of the rows touch at that displacement or nearly so. */
static inline uz_qp random_qp(qp_random *rng, const qp_kind *kind)
{
    int64_t d = kind->d, m = kind->m;
    double *K = random_spd(rng, d, kind->condition, 1 + 9 * random_unit(rng)), *N = vector(m * d), *inside = vector(d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t j = 0; j < d; j++) {
        inside[j] = random_signed(rng);
        qp.p[j] = 3 * random_signed(rng);
    }
    for (int64_t i = 0; i < m; i++) {
        double size = 0;
        random_row(rng, N, i, kind);
        for (int64_t j = 0; j < d; j++) {
            qp.h[i] += N[i * d + j] * inside[j];
            size += fabs(N[i * d + j]);
        }
        qp.h[i] += size * 0.3 * fmax(0, random_signed(rng));
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    free(inside);
    return qp;
}

/* The path of d springs, ends held, one bound from above on each of the dofs 0, stride, 2 stride, ...: an obstacle
 * problem whose K, and D^-1 for stride 1, are M-matrices. */
static inline uz_qp random_obstacle(qp_random *rng, int64_t d, int64_t stride)
{
    int64_t m = (d + stride - 1) / stride;
    double *K = vector(d * d), *N = vector(m * d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t j = 0; j < d; j++) {
        double spring = 0.5 + random_unit(rng);
        K[j * d + j] += spring;
        if (j + 1 < d) {
            K[(j + 1) * d + j + 1] += spring;
            K[(j + 1) * d + j] = K[j * d + j + 1] = -spring;
        }
        qp.p[j] = random_unit(rng) - 0.3;
    }
    K[0] += 1;
    for (int64_t i = 0; i < m; i++) {
        N[i * d + i * stride] = 1;
        qp.h[i] = random_unit(rng);
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    return qp;
}

/* A problem that takes the matrices over: free with uz_problem_clear. */
static inline uz_problem problem_of(uz_qp qp)
{
    return (uz_problem){.kind = UZ_PROBLEM_MATRICES, .qp = qp};
}

/* Solves, and records a failure of the running test where the call fails: NULL then. */
static inline uz_result *solve_problem(const uz_problem *problem, const uz_settings *settings)
{
    uz_result *result = NULL;
    uz_error err = {0};
    uz_status status = uz_solve(&result, problem, settings, NULL, NULL, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s %s", uz_status_name(status), err.where, err.message);
    return result;
}

static inline bool read_case_matrix(uz_csc *out, const char *folder, const char *name)
{
    char path[512];
    uz_mm_info info;
    uz_error err = {0};
    size_t len;
    snprintf(path, sizeof path, "%s/%s.mtx", folder, name);
    char *text = test_read_file(path, &len);
    bool ok = text && uz_mm_read(out, &info, text, len, 0, &err) == UZ_OK;
    if (ok && info.symmetry == UZ_MM_GENERAL && strcmp(name, "K") == 0)
        ok = uz_symmetric_lower(out, &err) == UZ_OK;
    free(text);
    CHECK_MSG(ok, "%s: %s", path, err.message);
    return ok;
}

static inline double *read_case_vector(const char *folder, const char *name)
{
    char path[512];
    double *x = NULL;
    int64_t n = 0;
    uz_error err = {0};
    size_t len;
    snprintf(path, sizeof path, "%s/%s.mtx", folder, name);
    char *text = test_read_file(path, &len);
    bool ok = text && uz_mm_read_vector(&x, &n, text, len, 0, &err) == UZ_OK;
    free(text);
    CHECK_MSG(ok, "%s: %s", path, err.message);
    return x;
}

/* K, N, h, p of a folder; false, with a failure recorded, where one can't be read. */
static inline bool read_case(uz_qp *qp, const char *folder)
{
    memset(qp, 0, sizeof *qp);
    bool ok = read_case_matrix(&qp->K, folder, "K") && read_case_matrix(&qp->N, folder, "N");
    if (ok) {
        qp->h = read_case_vector(folder, "h");
        qp->p = read_case_vector(folder, "p");
    }
    return ok && qp->h && qp->p;
}

/* The first number after "name": in the text of a case's ref.json, NaN if it is not there. */
static inline double case_number(const char *folder, const char *name)
{
    char path[512], key[64];
    double value = NAN;
    size_t len;
    snprintf(path, sizeof path, "%s/ref.json", folder);
    snprintf(key, sizeof key, "\"%s\":", name);
    char *text = test_read_file(path, &len), *at = text ? strstr(text, key) : NULL;
    if (at)
        value = strtod(at + strlen(key), NULL);
    free(text);
    return value;
}

#endif
