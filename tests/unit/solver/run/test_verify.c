/* Answers that somebody else made: right ones are verified, wrong ones never, and the bound holds for both. */
#include "harness.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

static uz_result *verify(const uz_problem *problem, const double *u, const double *r, double relative_error)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = relative_error;
    uz_status status = uz_verify(&result, problem, u, r, &settings, NULL, NULL, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s %s", uz_status_name(status), err.where, err.message);
    if (!result)
        exit(1);
    return result;
}

/* The bound against the truth, and the outcome against the bound and the truth. Returns the outcome. */
static uz_outcome check_against(const quad_exact *exact, const uz_problem *problem, const double *u, const double *r,
                                double relative_error, const char *what)
{
    uz_result *x = verify(problem, u, r, relative_error);
    const uz_certificate *c = &x->summary.certificate;
    double error = quad_error(exact, u), norm = (double)quad_sqrt(exact->norm2);
    uz_outcome outcome = x->summary.outcome;
    CHECK_MSG(c->absolute_error >= error, "%s: off by %.17g, bound %.17g", what, error, c->absolute_error);
    CHECK(c->relative_error * norm >= error);
    CHECK_INT(outcome, c->relative_error <= relative_error ? UZ_VERIFIED : UZ_NOT_VERIFIED);
    CHECK_MSG(outcome != UZ_VERIFIED || error <= relative_error * norm, "%s: verified, but off by %g", what, error);
    CHECK_INT(x->summary.method, UZ_METHOD_GIVEN);
    CHECK_INT(x->history.count, 0);
    CHECK(x->state == NULL);
    CHECK(memcmp(x->u, u, (size_t)x->d * sizeof *u) == 0);
    CHECK(x->m == 0 || memcmp(x->r, r, (size_t)x->m * sizeof *r) == 0);
    CHECK((x->summary.message[0] != '\0') == (outcome == UZ_NOT_VERIFIED));
    uz_result_free(x);
    return outcome;
}

typedef struct {
    uz_problem problem;
    quad_exact exact;
    double *u, *r; /* the exact solution, rounded */
    double norm;
} known;

static bool make_known(known *k, uint64_t seed)
{
    qp_random rng = {seed};
    qp_kind kind = {
        .d = random_int(&rng, 2, 30), .m = random_int(&rng, 1, 12), .condition = pow(10, (double)(seed % 7))};
    kind.badly_scaled = seed % 3 == 0;
    k->problem = problem_of(random_qp(&rng, &kind));
    k->u = vector(kind.d);
    k->r = vector(kind.m);
    bool ok = quad_exact_solve(&k->exact, &k->problem.qp, NULL);
    for (int64_t j = 0; ok && j < kind.d; j++)
        k->u[j] = (double)k->exact.u[j];
    for (int64_t i = 0; ok && i < kind.m; i++)
        k->r[i] = (double)k->exact.r[i];
    k->norm = ok ? (double)quad_sqrt(k->exact.norm2) : 0;
    return ok && k->norm > 0;
}

static void free_known(known *k)
{
    quad_exact_free(&k->exact);
    uz_problem_clear(&k->problem);
    free(k->u);
    free(k->r);
}

TEST(the_rounded_solution_is_verified)
{
    int64_t verified = 0, count = 0;
    for (uint64_t seed = 0; seed < 100; seed++) {
        known k;
        if (make_known(&k, seed)) {
            count++;
            verified += check_against(&k.exact, &k.problem, k.u, k.r, 1e-8, "solution") == UZ_VERIFIED;
        }
        free_known(&k);
    }
    CHECK_MSG(verified >= count - 2 && count > 80, "%lld of %lld", (long long)verified, (long long)count);
}

/* Perturbed by every power of ten, in u and in r: far ones are never verified at 1e-8. */
TEST(perturbed_answers)
{
    int64_t verified = 0, refused = 0;
    for (uint64_t seed = 0; seed < 60; seed++) {
        known k;
        qp_random rng = {seed + 4000};
        bool ok = make_known(&k, seed);
        for (int power = -14; ok && power <= 3; power++) {
            double *u = vector(k.exact.d), *r = vector(k.exact.m), size = pow(10, power);
            memcpy(u, k.u, (size_t)k.exact.d * sizeof *u);
            memcpy(r, k.r, (size_t)k.exact.m * sizeof *r);
            if (power % 2)
                u[random_int(&rng, 0, k.exact.d)] += size * random_signed(&rng);
            else
                r[random_int(&rng, 0, k.exact.m)] += size * random_signed(&rng);
            uz_outcome outcome = check_against(&k.exact, &k.problem, u, r, 1e-8, "perturbed");
            verified += outcome == UZ_VERIFIED;
            refused += outcome == UZ_NOT_VERIFIED;
            free(u);
            free(r);
        }
        free_known(&k);
    }
    CHECK_MSG(verified > 50 && refused > 50, "%lld verified, %lld not", (long long)verified, (long long)refused);
}

static void swap(double *x, int64_t a, int64_t b)
{
    double t = x[a];
    x[a] = x[b];
    x[b] = t;
}

/* Entries in the wrong order, nothing at all, a body pushed into the obstacle, a pulling contact. */
TEST(wrong_answers_are_not_verified)
{
    for (uint64_t seed = 0; seed < 60; seed++) {
        known k;
        bool ok = make_known(&k, seed);
        int64_t d = ok ? k.exact.d : 0, m = ok ? k.exact.m : 0;
        double *u = vector(d), *r = vector(m);
        for (int wrong = 0; ok && wrong < 6; wrong++) {
            memcpy(u, k.u, (size_t)d * sizeof *u);
            memcpy(r, k.r, (size_t)m * sizeof *r);
            if (wrong == 0)
                swap(u, 0, d - 1);
            if (wrong == 1)
                swap(r, 0, m - 1);
            if (wrong == 2)
                memset(u, 0, (size_t)d * sizeof *u);
            if (wrong == 3)
                for (int64_t j = 0; j < d; j++)
                    u[j] *= -1;
            if (wrong == 4)
                for (int64_t j = 0; j < d; j++)
                    u[j] *= 1 + 1e-6;
            if (wrong == 5)
                for (int64_t i = 0; i < m; i++)
                    r[i] = fabs(r[i]);
            bool off = wrong != 1 && wrong != 5 && quad_error(&k.exact, u) > 1e-8 * k.norm;
            uz_outcome outcome = check_against(&k.exact, &k.problem, u, r, 1e-8, "wrong");
            CHECK_MSG(!off || outcome == UZ_NOT_VERIFIED, "answer %d", wrong);
        }
        free(u);
        free(r);
        free_known(&k);
    }
}

TEST(pulling_reactions_are_counted)
{
    known k;
    for (uint64_t seed = 1; !make_known(&k, seed); seed++)
        free_known(&k);
    for (int64_t i = 0; i < k.exact.m; i++)
        k.r[i] = 2.0;
    uz_result *x = verify(&k.problem, k.u, k.r, 1e-8);
    CHECK_REL(x->summary.certificate.residual.e3, 2.0 * sqrt((double)k.exact.m), 1e-12);
    CHECK(x->r[0] == 2.0);
    CHECK_INT(x->summary.active, 0);
    uz_result_free(x);
    free_known(&k);
}

/* Energies and residuals shown, to twice the working precision before they are rounded. */
TEST(energies_are_exact_to_rounding)
{
    for (uint64_t seed = 0; seed < 60; seed++) {
        known k;
        bool ok = make_known(&k, seed);
        if (ok) {
            const uz_csc *K = &k.problem.qp.K;
            quad stiffness = 0, load = 0;
            for (int64_t j = 0; j < K->cols; j++) {
                load += (quad)k.u[j] * k.problem.qp.p[j];
                for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
                    stiffness += (K->idx[q] == j ? 1 : 2) * (quad)K->val[q] * k.u[K->idx[q]] * k.u[j];
            }
            uz_result *x = verify(&k.problem, k.u, k.r, 1e-8);
            const uz_certificate *c = &x->summary.certificate;
            CHECK_REL(c->energy_norm * c->energy_norm, (double)stiffness, 1e-15);
            quad room = (quad)1e-14 * (quad_abs(stiffness) + quad_abs(load));
            CHECK((double)quad_abs(c->energy_primal - (stiffness / 2 - load)) <=
                  (double)room + 10 * c->absolute_error * (k.norm + c->absolute_error));
            uz_result_free(x);
        }
        free_known(&k);
    }
}

static void check_refused(const uz_problem *problem, const double *u, const double *r, uz_status expected,
                          const char *where)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = (uz_result *)&settings;
    uz_error err;
    memset(&err, 0x5a, sizeof err);
    CHECK_INT(uz_verify(&result, problem, u, r, &settings, NULL, NULL, &err), expected);
    CHECK(result == NULL);
    CHECK_STR(err.where, where);
}

TEST(numbers_that_are_not_finite_are_refused)
{
    known k;
    for (uint64_t seed = 1; !make_known(&k, seed); seed++)
        free_known(&k);
    double kept = k.u[1];
    k.u[1] = NAN;
    check_refused(&k.problem, k.u, k.r, UZ_ERR_NOT_FINITE, "u");
    k.u[1] = INFINITY;
    check_refused(&k.problem, k.u, k.r, UZ_ERR_NOT_FINITE, "u");
    k.u[1] = kept;
    k.r[0] = -INFINITY;
    check_refused(&k.problem, k.u, k.r, UZ_ERR_NOT_FINITE, "r");
    check_refused(&k.problem, NULL, k.r, UZ_ERR_ARGUMENT, "u");
    check_refused(&k.problem, k.u, NULL, UZ_ERR_ARGUMENT, "r");
    free_known(&k);
}

TEST(answers_of_scenes)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(30, 10)};
    uz_settings settings = uz_settings_default();
    problem.scene.supports[0].u[0] = 1e-4; /* a value to meet */
    settings.relative_error = 1e-10;
    uz_result *answer = solve_problem(&problem, &settings);
    CHECK_INT(answer->summary.outcome, UZ_CONVERGED);
    uz_result *x = verify(&problem, answer->u, answer->r, 1e-8);
    CHECK_INT(x->summary.outcome, UZ_VERIFIED);
    CHECK_REL(x->summary.certificate.energy_primal, answer->summary.certificate.energy_primal, 1e-9);
    CHECK_REL(x->summary.max_pressure, answer->summary.max_pressure, 1e-12);
    CHECK(memcmp(x->u, answer->u, (size_t)(x->n_nodes * 2) * sizeof *x->u) == 0);
    uz_result_free(x);

    settings.balanced = true;
    uz_error err = {0};
    CHECK_INT(uz_verify(&x, &problem, answer->u, answer->r, &settings, NULL, NULL, &err), UZ_OK);
    CHECK_INT(x->summary.outcome, UZ_VERIFIED);
    CHECK_REL(x->summary.requested_error, 0.1 * x->summary.discretization_error, 1e-12);
    uz_result_free(x);

    int64_t last = 2 * answer->n_nodes - 1;
    answer->u[last] *= 1.001;
    x = verify(&problem, answer->u, answer->r, 1e-8);
    CHECK_INT(x->summary.outcome, UZ_NOT_VERIFIED);
    uz_result_free(x);
    answer->u[0] = 0; /* node 0 is held at 1e-4 */
    check_refused(&problem, answer->u, answer->r, UZ_ERR_SCENE, "u");
    uz_result_free(answer);
    uz_problem_clear(&problem);
}

TEST(a_body_at_rest_is_verified_at_rest)
{
    qp_random rng = {3};
    qp_kind kind = {.d = 5, .m = 0, .condition = 10};
    uz_problem problem = problem_of(random_qp(&rng, &kind));
    double zero[5] = {0};
    memset(problem.qp.p, 0, 5 * sizeof(double));
    uz_result *x = verify(&problem, zero, NULL, 1e-8);
    CHECK_INT(x->summary.outcome, UZ_VERIFIED);
    CHECK(x->summary.certificate.absolute_error == 0);
    uz_result_free(x);
    zero[2] = 1e-300; /* off, and where squares underflow */
    x = verify(&problem, zero, NULL, 1e-8);
    CHECK_INT(x->summary.outcome, UZ_NOT_VERIFIED);
    uz_result_free(x);
    uz_problem_clear(&problem);
}

TEST(load_cases_are_not_for_verification)
{
    qp_random rng = {3};
    qp_kind kind = {.d = 5, .m = 2, .condition = 10};
    uz_problem problem = problem_of(random_qp(&rng, &kind));
    problem.cases = calloc(1, sizeof *problem.cases);
    problem.n_cases = 1;
    check_refused(&problem, problem.qp.p, problem.qp.h, UZ_ERR_ARGUMENT, "/cases");
    uz_problem_clear(&problem);
}

/* The energy of the answer is beyond the largest double, that of its error is not: infinity over infinity is no bound.
 */
TEST(an_energy_beyond_double_bounds_nothing)
{
    uz_settings settings = uz_settings_default();
    settings.relative_error = 1e-2;
    for (int k = 0; k < 2; k++) {
        double stiff = 1e200, u = k ? 1.9e54 : 2e54, r = 0; /* exact: 2e54 */
        uz_qp qp = {.p = vector(1), .h = vector(1)};
        uz_result *result = NULL;
        uz_error err = {0};
        double one = 1;
        qp.K = csc_from_dense(&stiff, 1, 1, true);
        qp.N = csc_from_dense(&one, 1, 1, false);
        qp.p[0] = 2e254;
        qp.h[0] = 3e54;
        uz_problem problem = problem_of(qp);
        CHECK_INT(uz_verify(&result, &problem, &u, &r, &settings, NULL, NULL, &err), UZ_OK);
        if (result && k) {
            CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "not_verified");
            CHECK(result->summary.certificate.relative_error > 1e-2);
        }
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* Everything touches, and h = 0: gaps and N u are nothing but rounding, which is small beside the displacements. */
TEST(relative_residuals_of_a_body_that_touches_everywhere)
{
    double K[9] = {4, -1, -1.3, -1, 3, -0.7, -1.3, -0.7, 5}, N[6] = {0.6, 0.3, 0, 0, 0.7, 0.1};
    uz_qp qp = {.p = vector(3), .h = vector(2)};
    uz_settings settings = uz_settings_default();
    qp.K = csc_from_dense(K, 3, 3, true);
    qp.N = csc_from_dense(N, 2, 3, false);
    qp.p[0] = 5;
    qp.p[1] = 7;
    qp.p[2] = 11;
    settings.relative_error = 0;
    uz_problem problem = problem_of(qp);
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK_INT(result->summary.active, 2);
        CHECK_MSG(result->summary.certificate.relative_residual.total < 1e-12, "relative residual %g",
                  result->summary.certificate.relative_residual.total);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}
