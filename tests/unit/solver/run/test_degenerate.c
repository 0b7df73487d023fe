/* Rows that depend on each other, meet in one point or form long chains: such answers have bounds, and true ones.
 * `make extremes` runs many more. */
#include "core/alloc.h"
#include "degenerate.h"
#include "harness.h"

enum { PROBLEMS = 400 };

static void tell(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j)
{
    (void)ctx;
    printf("# seed %d (%s), d %d, m %d, %s: certified %.3g, true %.3g %s\n", (int)seed,
           DEGENERATE_NAMES[seed % DEGENERATE_KINDS], (int)qp->K.cols, (int)qp->N.rows,
           uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), s->certificate.relative_error, j->error, j->why);
    CHECK(j->verdict != JUDGED_WRONG);
}

TEST(degenerate_problems_are_certified)
{
    degenerate_tally all = {.least_ratio = INFINITY};
    for (uint64_t seed = 0; seed < PROBLEMS; seed++)
        run_degenerate(&all, seed, tell, NULL);
    CHECK_INT(all.wrong, 0);
    CHECK(all.least_ratio >= 1);
    for (int kind = 0; kind < DEGENERATE_KINDS; kind++)
        CHECK_MSG(all.certified[kind] == all.problems[kind], "%s: %d of %d certified", DEGENERATE_NAMES[kind],
                  (int)all.certified[kind], (int)all.problems[kind]);
}

/* Isotonic regression by pool adjacent violators: blocks whose means ascend. Loads are multiples of 2^-20, so that the
 * sums are exact. u and start (n each): work. */
static void pool_violators(quad *u, int64_t *start, const double *p, int64_t n)
{
    quad *sum = quad_zeros(n);
    int64_t blocks = 0;
    for (int64_t i = 0; i < n; i++) {
        start[blocks] = i;
        sum[blocks++] = p[i];
        for (; blocks > 1; blocks--) {
            const quad after = (quad)(i + 1 - start[blocks - 1]),
                       before = (quad)(start[blocks - 1] - start[blocks - 2]);
            if (sum[blocks - 2] * after <= sum[blocks - 1] * before)
                break;
            sum[blocks - 2] += sum[blocks - 1];
        }
    }
    for (int64_t b = 0; b < blocks; b++) {
        const int64_t end = b + 1 < blocks ? start[b + 1] : n;
        for (int64_t i = start[b]; i < end; i++)
            u[i] = sum[b] / (quad)(end - start[b]);
    }
    free(sum);
}

TEST(a_long_chain_is_certified)
{
    enum { N = 3000 };
    qp_random rng = {11};
    quad *exact = quad_zeros(N);
    int64_t *row = calloc(2 * N, sizeof *row), *column = calloc(2 * N, sizeof *column);
    double *value = vector(2 * N);
    uz_qp qp = {.p = vector(N), .h = vector(N - 1)};
    if (!row || !column)
        abort();
    for (int64_t i = 0; i < N; i++) {
        row[i] = column[i] = i;
        value[i] = 1;
        qp.p[i] = floor(0x1p20 * (3.0 * (double)i / N + random_signed(&rng))) * 0x1p-20;
    }
    CHECK_INT(uz_csc_from_triplets(&qp.K, N, N, N, row, column, value, NULL), UZ_OK);
    for (int64_t i = 0; i + 1 < N; i++)
        for (int k = 0; k < 2; k++) {
            row[2 * i + k] = i;
            column[2 * i + k] = i + k;
            value[2 * i + k] = k ? -1 : 1;
        }
    CHECK_INT(uz_csc_from_triplets(&qp.N, N - 1, N, 2 * (N - 1), row, column, value, NULL), UZ_OK);
    pool_violators(exact, row, qp.p, N);
    uz_problem problem = problem_of(qp);
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        quad error = 0, norm = 0;
        for (int64_t i = 0; i < N; i++) {
            error += (result->u[i] - exact[i]) * (result->u[i] - exact[i]);
            norm += exact[i] * exact[i];
        }
        error = quad_sqrt(error / norm);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_MSG(result->summary.iterations <= 40, "%d iterations", (int)result->summary.iterations);
        CHECK_MSG(error <= result->summary.certificate.relative_error, "off by %g, certified %g", (double)error,
                  result->summary.certificate.relative_error);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
    uz_free_all(exact, row, column, value);
}

/* u_i - u_(i+1) <= h_i around a circle, with h that add up to nothing: each row holds as an equation, and u, whose mean
 * is zero, is made of halves. Of n rows at once some dozens penetrate by rounding (POWELL20 of the CUTE collection). */
static void solve_cycle(int64_t n)
{
    int64_t *row = calloc(2 * (size_t)n, sizeof *row), *column = calloc(2 * (size_t)n, sizeof *column);
    double *value = vector(2 * n), *exact = vector(n), mean = 0;
    uz_qp qp = {.p = vector(n), .h = vector(n)};
    if (!row || !column)
        abort();
    for (int64_t i = 0; i < n; i++) {
        row[i] = column[i] = i;
        value[i] = 1;
    }
    CHECK_INT(uz_csc_from_triplets(&qp.K, n, n, n, row, column, value, NULL), UZ_OK);
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = 0; k < 2; k++) {
            row[2 * i + k] = i;
            column[2 * i + k] = (i + k) % n;
            value[2 * i + k] = k ? -1 : 1;
        }
        qp.h[i] = i + 1 == n ? 0.5 - (double)n : 0.5 - (i % 2 ? 1.0 : -1.0) * (double)(i + 1);
        if (i + 1 < n)
            exact[i + 1] = exact[i] - qp.h[i];
        mean += exact[i] / (double)n;
    }
    CHECK_INT(uz_csc_from_triplets(&qp.N, n, n, 2 * n, row, column, value, NULL), UZ_OK);
    uz_problem problem = problem_of(qp);
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        double error = 0;
        for (int64_t i = 0; i < n; i++)
            error = fmax(error, fabs(result->u[i] - (exact[i] - mean)));
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_MSG(error <= 1e-12 * (double)n, "%d rows: off by %g", (int)n, error);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
    uz_free_all(row, column, value, exact);
}

/* Dense on the contact, and with a sparse factor of all that touch. */
TEST(a_cycle_without_room_is_certified)
{
    solve_cycle(100);
    solve_cycle(500); /* the last row penetrates by what looks like a contradiction */
    solve_cycle(1200);
}

/* Of 1,200 second differences that may not be negative nearly all are zero, and each that is let go moves all others:
 * neither single exchanges nor steps of the first order come far. */
TEST(convex_regression_takes_few_steps)
{
    enum { N = 1200 };
    qp_random rng = {12};
    int64_t *row = calloc(3 * N, sizeof *row), *column = calloc(3 * N, sizeof *column);
    double *value = vector(3 * N);
    uz_qp qp = {.p = vector(N), .h = vector(N - 2)};
    if (!row || !column)
        abort();
    for (int64_t i = 0; i < N; i++) {
        const double x = 2.0 * (double)i / N - 1.0;
        row[i] = column[i] = i;
        value[i] = 1;
        qp.p[i] = x * x + 0.3 * random_signed(&rng);
    }
    CHECK_INT(uz_csc_from_triplets(&qp.K, N, N, N, row, column, value, NULL), UZ_OK);
    for (int64_t i = 0; i + 2 < N; i++)
        for (int64_t k = 0; k < 3; k++) {
            row[3 * i + k] = i;
            column[3 * i + k] = i + k;
            value[3 * i + k] = k == 1 ? 2 : -1;
        }
    CHECK_INT(uz_csc_from_triplets(&qp.N, N - 2, N, 3 * (N - 2), row, column, value, NULL), UZ_OK);
    uz_problem problem = problem_of(qp);
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK(result->summary.certificate.relative_error <= 1e-8);
        CHECK_MSG(result->summary.iterations <= 40, "%d iterations", (int)result->summary.iterations);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
    uz_free_all(row, column, value);
}
