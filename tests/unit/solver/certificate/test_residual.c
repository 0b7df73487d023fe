/* Residuals of certificates against sums in quadruple precision, on patterns that lanes fit and on others. */
#include "certificate/residual.h"
#include "harness.h"
#include "qp_fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { D = 41, M = 3 };

/* What is not zero below the diagonal. */
typedef bool (*pattern)(int64_t i, int64_t j, qp_random *rng);

static bool everything(int64_t i, int64_t j, qp_random *rng)
{
    (void)i, (void)j, (void)rng;
    return true;
}

/* Nodes of `dofs` dofs in a grid seven wide. */
static bool nodes_couple(int64_t i, int64_t j, int64_t dofs)
{
    const int64_t a = i / dofs, b = j / dofs;
    return llabs(a % 7 - b % 7) <= 1 && llabs(a / 7 - b / 7) <= 1;
}

static bool two_dofs(int64_t i, int64_t j, qp_random *rng)
{
    (void)rng;
    return nodes_couple(i, j, 2);
}

static bool three_dofs(int64_t i, int64_t j, qp_random *rng)
{
    (void)rng;
    return nodes_couple(i, j, 3);
}

/* Pairs of columns that agree for a while, and not to the end. */
static bool torn(int64_t i, int64_t j, qp_random *rng)
{
    return nodes_couple(i, j, 2) && random_signed(rng) < 0.8;
}

static bool scattered(int64_t i, int64_t j, qp_random *rng)
{
    (void)i, (void)j;
    return random_signed(rng) < -0.4;
}

static bool nothing(int64_t i, int64_t j, qp_random *rng)
{
    (void)i, (void)j, (void)rng;
    return false;
}

/* Numbers of very different sizes, so that what cancels is seen. */
static double wide(qp_random *rng)
{
    return ldexp(random_signed(rng), (int)(40 * random_signed(rng)));
}

static void fill(double *K, double *N, pattern some, bool diagonal, qp_random *rng)
{
    for (int64_t j = 0; j < D; j++)
        for (int64_t i = j; i < D; i++) {
            const bool in = i == j ? diagonal || i % 3 : some(i, j, rng);
            K[i * D + j] = K[j * D + i] = in ? wide(rng) : 0.0;
        }
    for (int64_t k = 0; k < M * D; k++)
        N[k] = k % 11 == 0 ? random_signed(rng) : 0.0;
}

static int64_t count_terms(const double *K, const double *N)
{
    int64_t most = 0;
    for (int64_t i = 0; i < D + M; i++) {
        int64_t count = i < D ? 2 : 1;
        for (int64_t j = 0; j < D; j++)
            count += i < D ? K[i * D + j] != 0 : 2 * (N[(i - D) * D + j] != 0);
        for (int64_t k = 0; i < D && k < M; k++)
            count += N[k * D + i] != 0;
        most = count > most ? count : most;
    }
    return most;
}

/* Differences from sums in quadruple precision, relative to the sums of magnitudes, against what docs/theory.md proves
 * of n terms. */
static void check_rows(const uz_residuals *got, const double *K, const double *N, const double *p, const double *u,
                       const double *c, const double *r, int64_t n)
{
    const double hidden = 0x1p-104 * (double)((n + 2) * (n + 2));
    CHECK_INT(n, count_terms(K, N));
    for (int64_t i = 0; i < D; i++) {
        __float128 Ku = 0, size = p[i] < 0 ? -p[i] : p[i], forces = p[i];
        double Kc = 0, size_c = 0;
        for (int64_t j = 0; j < D; j++) {
            Ku += (__float128)K[i * D + j] * u[j];
            size += fabs(K[i * D + j] * u[j]);
            Kc += K[i * D + j] * c[j];
            size_c += fabs(K[i * D + j] * c[j]);
        }
        for (int64_t k = 0; k < M; k++) {
            forces += (__float128)N[k * D + i] * r[k];
            size += fabs(N[k * D + i] * r[k]);
        }
        const __float128 e_u = Ku - forces;
        const double slack = (double)size * hidden;
        CHECK(fabs(got->Ku[i] - (double)Ku) <= slack + 0x1p-52 * fabs((double)Ku));
        CHECK(fabs(got->e_u[i] - (double)e_u) <= slack + 0x1p-52 * fabs((double)e_u));
        CHECK(fabs(got->Kc[i] - Kc) <= 0x1p-48 * size_c);
        CHECK(fabs(got->e[i] - (double)(e_u + got->Kc[i])) <=
              slack + hidden * size_c + 0x1p-52 * fabs((double)(e_u + got->Kc[i])));
        CHECK(got->weight[i] == (K[i * D + i] > 0 ? 1 / K[i * D + i] : 1));
    }
}

static void check_pattern(pattern some, bool diagonal, uint64_t seed)
{
    qp_random rng = {seed};
    double *K = vector(D * D), *N = vector(M * D), *p = vector(D), *u = vector(D), *c = vector(D), r[M];
    uz_residuals got = {vector(D), vector(D), vector(D), vector(D), vector(D), NULL};
    uz_error err;
    fill(K, N, some, diagonal, &rng);
    for (int64_t i = 0; i < D; i++) {
        p[i] = wide(&rng);
        u[i] = wide(&rng);
        c[i] = seed % 3 && (i * (int64_t)seed) % 13 == 5 ? 1e-9 * wide(&rng) : 0.0;
    }
    for (int64_t k = 0; k < M; k++)
        r[k] = -fabs(wide(&rng));
    uz_csc lower = csc_from_dense(K, D, D, true), rows = csc_from_dense(N, M, D, false);
    CHECK_INT(uz_equilibrium_residual(&got, &lower, &rows, p, u, c, r, &err), UZ_OK);
    check_rows(&got, K, N, p, u, c, r, uz_most_terms(&lower, NULL, &rows));
    double *room[] = {K, N, p, u, c, got.e, got.e_u, got.Ku, got.Kc, got.weight};
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        free(room[k]);
    uz_csc_clear(&lower);
    uz_csc_clear(&rows);
}

TEST(every_pattern_has_twice_the_digits)
{
    static const pattern patterns[] = {everything, two_dofs, three_dofs, torn, scattered, nothing};
    for (size_t k = 0; k < sizeof patterns / sizeof patterns[0]; k++)
        for (uint64_t seed = 1; seed <= 20; seed++) {
            check_pattern(patterns[k], true, seed);
            check_pattern(patterns[k], false, seed);
        }
}
