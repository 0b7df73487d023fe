/* Contact candidates left out by trial and check: the answer of the rest is that of all, and says so. */
#include "harness.h"
#include "obstacle/candidates.h"
#include "qp_fixture.h"

/* A string of d nodes under a load, over an obstacle that is nearest at its middle: h = low + rise (2 s - 1)^2. */
static uz_qp string_over_bowl(int64_t d, double load, double low, double rise)
{
    uz_qp qp = {.p = vector(d), .h = vector(d)};
    double *K = vector(d * d), *N = vector(d * d);
    for (int64_t i = 0; i < d; i++) {
        const double s = 2 * (double)(i + 1) / (double)(d + 1) - 1;
        K[i * d + i] = 2 * (double)(d + 1);
        if (i > 0)
            K[i * d + i - 1] = K[(i - 1) * d + i] = -(double)(d + 1);
        N[i * d + i] = -1;
        qp.p[i] = -load / (double)(d + 1);
        qp.h[i] = low + rise * s * s;
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, d, d, false);
    free(K);
    free(N);
    return qp;
}

/* The problem of the rows that are in. */
static uz_problem reduced(const uz_qp *full, const uz_candidates *c)
{
    uz_qp qp = {.p = vector(full->K.cols), .h = vector(c->count)};
    uz_error err = {0};
    CHECK_INT(uz_csc_copy(&qp.K, &full->K, &err), UZ_OK);
    CHECK_INT(uz_candidates_reduce(&qp.N, &full->N, c, &err), UZ_OK);
    memcpy(qp.p, full->p, (size_t)full->K.cols * sizeof *qp.p);
    uz_candidates_gather(qp.h, full->h, c);
    return problem_of(qp);
}

/* g = h - N u of all rows, and the terms that it is made of. */
static void gaps(double *g, double *size, const uz_qp *qp, const double *u)
{
    for (int64_t i = 0; i < qp->N.rows; i++) {
        g[i] = qp->h[i];
        size[i] = fabs(qp->h[i]);
    }
    uz_csc_gaxpy(g, &qp->N, -1, u);
    for (int64_t j = 0; j < qp->N.cols; j++)
        for (int64_t q = qp->N.ptr[j]; q < qp->N.ptr[j + 1]; q++)
            size[qp->N.idx[q]] += fabs(qp->N.val[q] * u[j]);
}

typedef struct {
    int rounds;
    int64_t rows;
} course;

/* Solves by trial and check from this reach on, and has the full problem's certificate confirm it. */
static course trial_and_check(const uz_problem *full, double reach, const uz_result *want)
{
    const uz_qp *qp = &full->qp;
    const int64_t m = qp->N.rows;
    const uz_settings settings = uz_settings_default();
    double *g = vector(m), *size = vector(m), *r = vector(m);
    course c = {0};
    uz_candidates in;
    uz_result *got = NULL, *verified = NULL;
    uz_error err = {0};
    CHECK_INT(uz_candidates_first(&in, qp->h, m, reach, &err), UZ_OK);
    do {
        uz_problem part = reduced(qp, &in);
        uz_result_free(got);
        got = solve_problem(&part, &settings);
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        gaps(g, size, qp, got->u);
        uz_candidates_scatter(r, got->r, &in);
        uz_problem_clear(&part);
        c.rows = in.count;
    } while (++c.rounds < 50 && uz_candidates_extend(&in, &uz_law_frictionless, g, size, 1e-12) > 0);
    CHECK_INT(uz_verify(&verified, full, got->u, r, &settings, NULL, NULL, &err), UZ_OK);
    CHECK_INT(verified->summary.outcome, UZ_VERIFIED);
    CHECK(verified->summary.certificate.relative_error <= settings.relative_error);
    for (int64_t i = 0; i < m; i++)
        CHECK_MSG(fabs(r[i] - want->r[i]) <= 1e-6 * fabs(want->summary.reaction_sum), "row %d: %g instead of %g",
                  (int)i, r[i], want->r[i]);
    uz_result_free(got);
    uz_result_free(verified);
    uz_candidates_clear(&in);
    free(g);
    free(size);
    free(r);
    return c;
}

TEST(answer_of_a_part_is_that_of_all)
{
    const uz_settings settings = uz_settings_default();
    uz_problem full = problem_of(string_over_bowl(101, 1, 0.02, 0.5));
    uz_result *want = solve_problem(&full, &settings);
    CHECK_INT(want->summary.outcome, UZ_CONVERGED);
    CHECK(want->summary.active > 5 && want->summary.active < 90);
    const course all = trial_and_check(&full, INFINITY, want), generous = trial_and_check(&full, 0.2, want);
    const course least = trial_and_check(&full, 0, want);
    CHECK_INT(all.rounds, 1);
    CHECK_INT(all.rows, 101);
    CHECK_INT(generous.rounds, 1);
    CHECK(generous.rows >= want->summary.active && generous.rows < 101);
    CHECK(least.rounds > 1 && least.rounds < 12);
    CHECK(least.rows >= want->summary.active && least.rows < 101);
    uz_result_free(want);
    uz_problem_clear(&full);
}

/* An answer of a part that is not that of all: rows left out are penetrated, and the certificate of all says so. */
TEST(certificate_of_all_sees_rows_left_out)
{
    const uz_settings settings = uz_settings_default();
    uz_problem full = problem_of(string_over_bowl(101, 1, 0.02, 0.5));
    double *r = vector(101);
    uz_candidates in;
    uz_result *verified = NULL;
    uz_error err = {0};
    CHECK_INT(uz_candidates_first(&in, full.qp.h, 101, 0, &err), UZ_OK);
    CHECK_INT(in.count, 1);
    uz_problem part = reduced(&full.qp, &in);
    uz_result *got = solve_problem(&part, &settings);
    CHECK_INT(got->summary.outcome, UZ_CONVERGED);
    uz_candidates_scatter(r, got->r, &in);
    CHECK_INT(uz_verify(&verified, &full, got->u, r, &settings, NULL, NULL, &err), UZ_OK);
    CHECK_INT(verified->summary.outcome, UZ_NOT_VERIFIED);
    CHECK(verified->summary.certificate.relative_error > 1e-3);
    uz_result_free(got);
    uz_result_free(verified);
    uz_problem_clear(&part);
    uz_problem_clear(&full);
    uz_candidates_clear(&in);
    free(r);
}

TEST(first_choice_follows_the_gaps)
{
    const double h[] = {3, 1, 1.5, 2.0001, 2}, overlap[] = {-4, 0.5, 1.5, -1, 1};
    uz_candidates c;
    uz_error err = {0};
    CHECK_INT(uz_candidates_first(&c, h, 5, 1, &err), UZ_OK);
    CHECK(c.count == 3 && c.in[1] && c.in[2] && c.in[4]);
    uz_candidates_clear(&c);
    CHECK_INT(uz_candidates_first(&c, overlap, 5, 1, &err), UZ_OK); /* one deep overlap hides no other row */
    CHECK(c.count == 4 && !c.in[2]);
    uz_candidates_clear(&c);
    CHECK_INT(uz_candidates_first(&c, NULL, 0, 1, &err), UZ_OK);
    CHECK_INT(c.count, 0);
    uz_candidates_clear(&c);
}

TEST(extension_takes_what_is_violated_and_what_is_next)
{
    const double h[] = {0, 9, 9, 9, 9, 9}, size[] = {1, 1, 1, 1, 1, 1};
    const double fine[] = {-5, 1, 2, 0, 4, -1e-14}, g[] = {-5, 0.5, 0.8, -0.6, 4, -0.1}, lost[] = {0, 1, 1, 1, NAN, 1};
    uz_candidates c;
    uz_error err = {0};
    CHECK_INT(uz_candidates_first(&c, h, 6, 1, &err), UZ_OK);
    CHECK_INT(uz_candidates_extend(&c, &uz_law_frictionless, fine, size, 1e-12),
              0); /* rows that are in are the solver's business */
    CHECK_INT(uz_candidates_extend(&c, &uz_law_frictionless, g, size, 1e-12), 3);
    CHECK(c.in[1] && !c.in[2] && c.in[3] && !c.in[4] && c.in[5]);
    CHECK_INT(uz_candidates_extend(&c, &uz_law_frictionless, lost, size, 1e-12), 2);
    CHECK_INT(c.count, 6);
    uz_candidates_clear(&c);
}
