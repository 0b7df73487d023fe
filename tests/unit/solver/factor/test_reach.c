/* Solves that begin and end at a few dofs, against whole substitutions and dense algebra. */
#include "factor_fixture.h"
#include "harness.h"
#include "hex8.h"
#include "qp_fixture.h"

/* A body in three dimensions, or a random matrix: one connected graph, or several. */
static uz_csc matrix_of(uint64_t seed, qp_random *rng)
{
    uz_csc K;
    uz_error err = {0};
    if (seed % 3 == 0) {
        CHECK(hex8_stiffness(&K, random_int(rng, 2, 6), &err) == UZ_OK);
        return K;
    }
    int64_t n = random_int(rng, 1, 120);
    double *dense = vector(n * n);
    for (int64_t i = 0; i < n; i++) {
        dense[i * n + i] += 1.0 + random_unit(rng);
        for (int64_t e = random_int(rng, 0, 3); e > 0; e--) {
            int64_t j = random_int(rng, 0, n);
            if (j == i)
                continue;
            dense[i * n + j] -= 1.0;
            dense[j * n + i] = dense[i * n + j];
            dense[i * n + i] += 1.0;
            dense[j * n + j] += 1.0;
        }
    }
    K = csc_from_dense(dense, n, n, true);
    free(dense);
    return K;
}

/* m rows with one to four entries, some rows empty or equal. */
static uz_csc rows_of(qp_random *rng, int64_t m, int64_t n)
{
    double *dense = vector(m * n);
    for (int64_t i = 0; i < m; i++)
        for (int64_t e = random_int(rng, 0, 5); e > 0; e--)
            dense[i * n + random_int(rng, 0, n)] = random_signed(rng);
    for (int64_t j = 0; m > 1 && j < n; j++)
        dense[j] = dense[n + j];
    uz_csc N = csc_from_dense(dense, m, n, false);
    free(dense);
    return N;
}

/* x = L^-1 P N'e_i in full. */
static void forward_row(double *x, const uz_factor *factor, uz_factor_workspace *ws, const uz_csc *N, int64_t i)
{
    uz_error err;
    double *b = vector(N->cols), *e = vector(N->rows);
    e[i] = 1;
    uz_csc_gaxpy_t(b, N, 1, e);
    uz_factor_permute(factor, x, b);
    CHECK(uz_factor_solve_one(factor, ws, x, true, &err) == UZ_OK);
    free(b);
    free(e);
}

static double largest(const double *x, int64_t n)
{
    double value = 0;
    for (int64_t i = 0; i < n; i++)
        value = fmax(value, fabs(x[i]));
    return value;
}

static void check_gram(const uz_reach *reach, const uz_factor *factor, uz_factor_workspace *ws, const uz_csc *N)
{
    int64_t m = N->rows, n = N->cols;
    double *D = vector(m * m), *Z = vector(n * m);
    uz_error err;
    CHECK(uz_reach_gram(D, reach, N, &err) == UZ_OK);
    for (int64_t i = 0; i < m; i++)
        forward_row(Z + i * n, factor, ws, N, i);
    double scale = largest(D, m * m);
    for (int64_t j = 0; j < m; j++)
        for (int64_t i = 0; i < m; i++) {
            double sum = 0;
            for (int64_t k = 0; k < n; k++)
                sum += Z[k + i * n] * Z[k + j * n];
            CHECK(fabs(D[i + j * m] - (i >= j ? sum : 0)) <= 1e-13 * scale);
        }
    free(D);
    free(Z);
}

static void check_substitutions(const uz_reach *reach, const uz_factor *factor, uz_factor_workspace *ws,
                                const uz_csc *N, const int64_t *dofs, int64_t count)
{
    int64_t n = N->cols;
    double *x = vector(n), *b = vector(n), *full = vector(n);
    uz_error err;
    for (int64_t k = 0; k < count; k++)
        b[dofs[k]] = 1.0 + (double)k;
    uz_factor_permute(factor, x, b);
    memcpy(full, x, (size_t)n * sizeof *x);
    CHECK(uz_reach_forward(reach, ws, x, &err) == UZ_OK);
    CHECK(uz_factor_solve_one(factor, ws, full, true, &err) == UZ_OK);
    for (int64_t k = 0; k < n; k++)
        CHECK(fabs(x[k] - full[k]) <= 1e-13 * largest(full, n));
    for (int64_t k = 0; k < n; k++) /* any vector may be asked about at the dofs */
        x[k] = full[k] = sin((double)k);
    CHECK(uz_reach_backward(reach, ws, x, &err) == UZ_OK);
    CHECK(uz_factor_solve_one(factor, ws, full, false, &err) == UZ_OK);
    for (int64_t k = 0; k < count; k++) {
        int64_t at = uz_factor_describe(factor).position[dofs[k]];
        CHECK(fabs(x[at] - full[at]) <= 1e-12 * largest(full, n));
    }
    free(x);
    free(b);
    free(full);
}

TEST(reach_does_what_whole_substitutions_do)
{
    static const uz_ordering orderings[] = {UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};
    uz_thread_init();
    for (uint64_t seed = 0; seed < 60; seed++) {
        qp_random rng = {seed};
        uz_csc K = matrix_of(seed, &rng), N = rows_of(&rng, random_int(&rng, 0, 25), K.cols);
        int64_t *dofs = calloc((size_t)K.cols, sizeof *dofs), count = dofs_touched(dofs, &N);
        uz_factor *factor;
        uz_reach *reach = NULL;
        uz_factor_workspace *ws = uz_factor_workspace_new();
        uz_error err;
        CHECK(factor_by(&factor, &K, dofs, seed % 2 ? count : 0, orderings[seed / 2 % 3], 0, &err) == UZ_OK);
        CHECK(uz_reach_create(&reach, factor, dofs, count, &err) == UZ_OK);
        check_gram(reach, factor, ws, &N);
        check_substitutions(reach, factor, ws, &N, dofs, count);
        uz_factor_info own, seven;
        CHECK(uz_factor_describe_for(&own, factor, dofs, count, 0, &err) == UZ_OK);
        CHECK(uz_factor_ends_with(factor, dofs, count) ? own.condensing == 0 : own.condensing > 0);
        CHECK(uz_factor_describe_for(&seven, factor, dofs, count, 7, &err) == UZ_OK);
        if (seed % 2 && count > 0)
            CHECK_REL(seven.condensing, 7.0 * (double)(count * (7 + count)), 1e-15);
        uz_reach_free(reach);
        uz_factor_free(factor);
        uz_factor_workspace_free(ws);
        uz_csc_clear(&K);
        uz_csc_clear(&N);
        free(dofs);
    }
}
