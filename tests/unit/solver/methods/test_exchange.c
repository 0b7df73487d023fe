/* Rows that depend on each other: exchanges, proofs of contradiction, and refinement by the original data. */
#include "core/alloc.h"
#include "linalg/blas.h"
#include "harness.h"
#include "judge.h"
#include "qp_fixture.h"

#include <float.h>

#define COUNT(list) (sizeof(list) / sizeof((list)[0]))

static const uz_operator both_operators[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

/* Solves by active_set on both operators and holds the claims against the exact solution. */
static void check_solved(const uz_problem *problem, const char *what, uz_outcome expected, int64_t most_iterations)
{
    truth t = find_truth(&problem->qp, NULL);
    for (size_t k = 0; k < COUNT(both_operators); k++) {
        uz_settings settings = uz_settings_default();
        settings.method = UZ_METHOD_ACTIVE_SET;
        settings.op = both_operators[k];
        uz_result *result = solve_problem(problem, &settings);
        if (!result)
            continue;
        const uz_summary *s = &result->summary;
        judgement j = judge(&t, &problem->qp, result, result->u);
        CHECK_MSG(s->outcome == expected, "%s, %s: %s, certified %g, true %g: %s", what,
                  uz_choice_name(UZ_CHOICE_OPERATOR, s->op), uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), j.certified,
                  j.error, s->message);
        CHECK_MSG(j.verdict != JUDGED_WRONG, "%s, %s: %s", what, uz_choice_name(UZ_CHOICE_OPERATOR, s->op), j.why);
        CHECK_MSG(s->iterations <= most_iterations, "%s, %s: %lld steps", what,
                  uz_choice_name(UZ_CHOICE_OPERATOR, s->op), (long long)s->iterations);
        uz_result_free(result);
    }
    truth_clear(&t);
}

/* Each row of qp `copies` times, the k-th by a factor of its own. */
static uz_qp repeat_rows(uz_qp qp, int64_t copies, const double *factors)
{
    int64_t m = qp.N.rows, d = qp.N.cols;
    double *N = vector(copies * m * d), *h = vector(copies * m);
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = qp.N.ptr[j]; k < qp.N.ptr[j + 1]; k++)
            for (int64_t c = 0; c < copies; c++)
                N[(c * m + qp.N.idx[k]) * d + j] = factors[c] * qp.N.val[k];
    for (int64_t i = 0; i < copies * m; i++)
        h[i] = factors[i / m] * qp.h[i % m];
    uz_csc_clear(&qp.N);
    free(qp.h);
    qp.N = csc_from_dense(N, copies * m, d, false);
    qp.h = h;
    free(N);
    return qp;
}

/* Powers of two keep copies exact; the others repeat a row up to rounding, which decides whose gap is the least. */
TEST(every_row_repeated)
{
    static const double exact[] = {1, 4, 0.25}, rounded[] = {1, 0.3, 1e3}, wide[] = {1e-8, 1e8, 0.7};
    static const double *const factors[] = {exact, rounded, wide};
    qp_random rng = {11};
    for (size_t k = 0; k < 4 * COUNT(factors); k++) {
        uz_qp qp = random_qp(&rng, &(qp_kind){.d = 12, .m = 8, .condition = 1e3});
        uz_problem problem = problem_of(repeat_rows(qp, 3, factors[k % COUNT(factors)]));
        check_solved(&problem, "repeated", UZ_CONVERGED, 400);
        uz_problem_clear(&problem);
    }
}

/* m random rows of d dofs through one point at which all of them touch, and many press. */
TEST(more_rows_than_dofs_through_one_point)
{
    qp_random rng = {12};
    for (int k = 0; k < 6; k++) {
        uz_qp qp = random_qp(&rng, &(qp_kind){.d = 6, .m = 24, .condition = 100});
        double u[6];
        for (int64_t j = 0; j < 6; j++)
            u[j] = ldexp((double)random_int(&rng, -64, 64), -6);
        memset(qp.h, 0, 24 * sizeof *qp.h);
        uz_csc_gaxpy(qp.h, &qp.N, 1, u);
        uz_problem problem = problem_of(qp);
        check_solved(&problem, "one point", UZ_CONVERGED, 400);
        uz_problem_clear(&problem);
    }
}

/* Weakly active: reactions and gaps that are both zero. */
TEST(rows_that_touch_without_pressing)
{
    double K[] = {2, 0, 0, 2}, N[] = {1, 0, 0, 1, 1, 1, 1, 1};
    uz_qp qp = {csc_from_dense(K, 2, 2, true), csc_from_dense(N, 4, 2, false), vector(2), vector(4)};
    qp.p[0] = 2;
    qp.p[1] = 4;
    const double h[] = {1, 2, 3, 3};
    memcpy(qp.h, h, sizeof h);
    uz_problem problem = problem_of(qp);
    check_solved(&problem, "weakly active", UZ_CONVERGED, 4);
    uz_problem_clear(&problem);
}

/* u_1 <= 1 and -u_1 <= -1 - overlap, on unit springs, among other rows. */
static uz_qp overlapping(int64_t others, double overlap, double cosine)
{
    int64_t d = others + 2, m = d;
    double *K = vector(d * d), *N = vector(m * d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t j = 0; j < d; j++) {
        K[j * d + j] = 2;
        if (j > 0)
            K[j * d + j - 1] = K[(j - 1) * d + j] = -1;
        qp.p[j] = 1;
    }
    for (int64_t i = 0; i < others; i++) {
        N[i * d + i + 2] = 1;
        qp.h[i] = 0.25 + 0.5 * (double)(i % 3);
    }
    N[others * d] = cosine;
    N[(others + 1) * d] = -cosine;
    N[others * d + 1] = sqrt(1 - cosine * cosine);
    N[(others + 1) * d + 1] = -sqrt(1 - cosine * cosine);
    qp.h[others] = 1;
    qp.h[others + 1] = -1 - overlap;
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    return qp;
}

TEST(contradictions_are_proved_down_to_1e_14)
{
    static const double overlaps[] = {1e-2, 1e-6, 1e-10, 1e-12, 1e-14};
    for (size_t k = 0; k < 2 * COUNT(overlaps); k++) {
        uz_problem problem = problem_of(overlapping(6, overlaps[k / 2], k % 2 ? 1 : 0.6));
        check_solved(&problem, "contradicting", UZ_INFEASIBLE, 400);
        uz_problem_clear(&problem);
    }
}

/* A polygon of rows through all of three dofs leaves no point: y has many entries, and N'y is not zero but rounding. */
TEST(contradictions_of_many_rows_are_proved)
{
    static const double overlaps[] = {1e-3, 1e-8, 1e-11};
    for (size_t k = 0; k < COUNT(overlaps); k++) {
        enum { M = 300 };
        double K[] = {2, -1, 0, -1, 2, -1, 0, -1, 2}, *N = vector(M * 3), u[] = {0.5, -0.25, 0.125};
        qp_random rng = {13};
        uz_qp qp = {.p = vector(3), .h = vector(M)};
        for (int64_t i = 0; i < M; i++)
            for (int64_t j = 0; j < 3; j++)
                N[i * 3 + j] = random_signed(&rng);
        qp.K = csc_from_dense(K, 3, 3, true);
        qp.N = csc_from_dense(N, M, 3, false);
        qp.p[0] = 1;
        uz_csc_gaxpy(qp.h, &qp.N, 1, u);
        for (int64_t i = 0; i < M; i++)
            qp.h[i] -= overlaps[k];
        uz_problem problem = problem_of(qp);
        check_solved(&problem, "polygon", UZ_INFEASIBLE, 4000);
        uz_problem_clear(&problem);
        free(N);
    }
}

/* A node between a floor and a ceiling at a small angle, and a wall that keeps it where they are too close. What the
 * wall adds to the two is nothing but their rounding, which the angle makes large. */
static uz_qp corner(double angle, double overlap, uint64_t seed)
{
    qp_random rng = {seed};
    const double tilt = 0.1 * random_signed(&rng), K[] = {3 + tilt, -1, 0, -1, 2, -1, 0, -1, 4};
    double N[] = {-angle, 1, 0, 0, -1, 0, 1, tilt, 0};
    uz_qp qp = {.p = vector(3), .h = vector(3)};
    qp.p[0] = random_signed(&rng);
    qp.p[1] = random_signed(&rng);
    qp.h[0] = -overlap;
    qp.h[2] = 0.1 * overlap;
    qp.K = csc_from_dense(K, 3, 3, true);
    qp.N = csc_from_dense(N, 3, 3, false);
    return qp;
}

TEST(a_corner_with_a_small_angle)
{
    static const double angles[] = {0.1, 1e-2, 4e-4, 1e-4};
    for (size_t k = 0; k < 50 * COUNT(angles); k++) {
        uz_problem no_room = problem_of(corner(angles[k / 50], 0.006, k)),
                   room = problem_of(corner(angles[k / 50], -0.006, k));
        check_solved(&no_room, "no room", UZ_INFEASIBLE, 400);
        check_solved(&room, "room", UZ_CONVERGED, 400);
        uz_problem_clear(&no_room);
        uz_problem_clear(&room);
    }
}

/* One unit in the last place of h: rounding hides it from the method, not from the proof. */
TEST(a_contradiction_of_one_unit_is_proved)
{
    uz_problem problem = problem_of(overlapping(6, DBL_EPSILON, 1));
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_INFEASIBLE);
    CHECK(result && strstr(result->summary.message, "these rows contradict: 6, 7"));
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Without refinement the error of K^-1 is that of u: about eps times the condition. */
TEST(refinement_wins_back_the_digits_that_the_condition_takes)
{
    for (int power = 9; power <= 13; power++) {
        qp_random rng = {14};
        double *K = random_spd(&rng, 20, pow(10, power), 1), *N = vector(20 * 20);
        uz_qp qp = {.p = vector(20), .h = vector(20)};
        for (int64_t i = 0; i < 20; i++) {
            N[i * 20 + i] = 1;
            qp.h[i] = 0.5;
            qp.p[i] = i % 4 == 3 ? -1 : 1;
        }
        qp.K = csc_from_dense(K, 20, 20, true);
        qp.N = csc_from_dense(N, 20, 20, false);
        free(K);
        free(N);
        uz_problem problem = problem_of(qp);
        truth t = find_truth(&problem.qp, NULL);
        uz_settings settings = uz_settings_default();
        settings.relative_error = 1e-11;
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            judgement j = judge(&t, &problem.qp, result, result->u);
            CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "condition 1e%d: %g after %lld refinements", power,
                      j.certified, (long long)result->summary.refinements);
            CHECK_MSG(j.verdict != JUDGED_WRONG, "condition 1e%d: %s", power, j.why);
            CHECK(power < 12 || result->summary.refinements > 0);
        }
        uz_result_free(result);
        truth_clear(&t);
        uz_problem_clear(&problem);
    }
}

/* ------------------------------------------------------------------ cancellation */

typedef struct {
    int64_t asked, refuse_after;
} patience;

static bool ask(void *ctx)
{
    patience *p = ctx;
    return p->asked++ >= p->refuse_after;
}

/* A diagonally dominant matrix, lower triangle. */
static double *dominant(int64_t n)
{
    qp_random rng = {15};
    double *A = vector(n * n);
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = j; i < n; i++)
            A[i + j * n] = i == j ? (double)n : random_signed(&rng);
    return A;
}

static double largest_difference(const double *A, const double *B, int64_t n)
{
    double worst = 0;
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = j; i < n; i++)
            worst = fmax(worst, fabs(A[i + j * n] - B[i + j * n]));
    return worst;
}

TEST(panels_do_what_whole_kernels_do)
{
    static const int64_t orders[] = {1, 17, 256, 257, 1000};
    for (size_t k = 0; k < COUNT(orders); k++) {
        int64_t n = orders[k];
        double *A = dominant(n), *L = dominant(n), *M = vector(n * n), *room = vector(n * n), *x = vector(n);
        CHECK(uz_potrf_lower_while(n, A, NULL));
        CHECK(uz_potrf_lower_while(n, L, NULL));
        CHECK(largest_difference(A, L, n) < 1e-12 * (double)n);
        memcpy(A, L, (size_t)(n * n) * sizeof *A); /* L's upper part is zero: dominant leaves it */
        CHECK(uz_multiply_llt_while(n, L, M, room, NULL));
        double *again = dominant(n);
        CHECK(largest_difference(M, again, n) < 1e-12 * (double)n);
        CHECK(uz_invert_llt_while(n, L, M, room, NULL));
        for (int64_t i = 0; i < n; i++)
            room[i] = (double)(i % 7) - 3;
        uz_symv_lower(n, M, room, x);
        uz_potrs_lower(n, L, n, room);
        for (int64_t i = 0; i < n; i++)
            CHECK(fabs(x[i] - room[i]) < 1e-12);
        uz_free_all(A, L, M, room, x, again);
    }
}

/* Z'Z of rank `rank`: what is found is a factor of the leading rows in pivot order, and the rank. */
TEST(pivoted_factor_finds_the_rank)
{
    static const int64_t orders[][2] = {{1, 1}, {5, 0}, {40, 40}, {150, 70}, {200, 64}, {300, 150}};
    for (size_t k = 0; k < COUNT(orders); k++) {
        int64_t n = orders[k][0], rank = orders[k][1];
        qp_random rng = {17 + k};
        double *Z = vector(n * rank), *A = vector(n * n), *L = vector(n * n);
        int64_t pivot[300];
        for (int64_t i = 0; i < n * rank; i++)
            Z[i] = random_signed(&rng);
        CHECK(uz_syrk_lower_t_while(n, rank, Z, A, NULL));
        memcpy(L, A, (size_t)(n * n) * sizeof *A);
        CHECK_INT(uz_pstrf_lower_while(n, L, pivot, 1e-11, NULL), rank);
        for (int64_t j = 0; j < rank; j++)
            for (int64_t i = j; i < n; i++) {
                int64_t row = pivot[i] > pivot[j] ? pivot[i] : pivot[j], column = pivot[i] + pivot[j] - row;
                double sum = -A[row + column * n];
                for (int64_t c = 0; c <= j; c++)
                    sum += L[i + c * n] * L[j + c * n];
                CHECK(fabs(sum) < 1e-11);
                CHECK(i == j || L[j + j * n] >= fabs(L[i + j * n]));
            }
        uz_free_all(Z, A, L);
    }
}

/* How often it asks whether to stop: at least once for 2e8 flops of n^3 / 3, and what is refused ends at once. */
TEST(dense_work_asks_between_panels)
{
    enum { N = 1600 };
    double *A = dominant(N);
    patience p = {.refuse_after = INT64_MAX};
    uz_hooks hooks = {.ctx = &p, .cancelled = ask};
    uz_stop stop = {&hooks, INFINITY};
    CHECK(uz_potrf_lower_while(N, A, &stop));
    CHECK(p.asked >= 20);
    free(A);
    A = dominant(N);
    p = (patience){.refuse_after = 2};
    CHECK(!uz_potrf_lower_while(N, A, &stop));
    CHECK_INT(p.asked, 3);
    free(A);
}

/* Refused at any moment, a solve by exchanges ends with what it has. */
TEST(exchanges_are_cancelled_between_rows)
{
    static const double factors[] = {1, 0.3, 1e3};
    qp_random rng = {16};
    uz_problem problem =
        problem_of(repeat_rows(random_qp(&rng, &(qp_kind){.d = 30, .m = 20, .condition = 1e4}), 3, factors));
    int64_t dismissed = 0;
    for (int64_t after = 0; after < 60; after++) {
        patience p = {.refuse_after = after};
        uz_hooks hooks = {.ctx = &p, .cancelled = ask};
        uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        uz_status status = uz_solve(&result, &problem, &settings, NULL, &hooks, &err);
        CHECK((status == UZ_OK) == (result != NULL));
        CHECK(status == UZ_OK || status == UZ_ERR_CANCELLED);
        CHECK_MSG(p.asked <= after + 40, "asked %lld times after %lld", (long long)p.asked, (long long)after);
        dismissed += result && result->summary.outcome == UZ_DISMISSED;
        uz_result_free(result);
    }
    CHECK(dismissed > 10);
    uz_problem_clear(&problem);
}
