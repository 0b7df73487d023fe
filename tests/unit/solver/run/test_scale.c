/* u and r are homogeneous of degree 1 in the load: times a power of two, nothing else may change. */
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

#include <float.h>

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

static const int exponents[] = {-1000, -900, -500, -100, 100, 500, 900};
enum { EXPONENTS = sizeof exponents / sizeof exponents[0] };

static void multiply(double *x, int64_t n, int exponent)
{
    for (int64_t i = 0; i < n; i++)
        x[i] = ldexp(x[i], exponent);
}

static bool same(const double *x, const double *y, int64_t n, int exponent)
{
    for (int64_t i = 0; i < n; i++)
        if (ldexp(y[i], exponent) != x[i])
            return false;
    return true;
}

/* Bounds that leave the range of double are rounded away from the truth, by a unit in the last place. */
static bool same_bound(double x, double y, int exponent)
{
    const double is = ldexp(y, exponent);
    return isinf(is) ? x * is > 0 && fabs(x) >= DBL_MAX : fabs(x - is) <= DBL_TRUE_MIN;
}

static void check_scaled(const uz_result *x, const uz_result *y, int k, const char *what)
{
    const uz_certificate *a = &x->summary.certificate, *b = &y->summary.certificate;
    CHECK_MSG(x->summary.outcome == y->summary.outcome && x->summary.iterations == y->summary.iterations,
              "%s 2^%d: outcome %d, %d at first: %s", what, k, x->summary.outcome, y->summary.outcome,
              x->summary.message);
    CHECK_MSG(same(x->u, y->u, y->d, k) && same(x->r, y->r, y->m, k) && same(x->g, y->g, y->m, k), "%s 2^%d", what, k);
    CHECK_MSG(a->relative_error == b->relative_error, "%s 2^%d: %g %g", what, k, a->relative_error, b->relative_error);
    CHECK(same_bound(a->absolute_error, b->absolute_error, k) && a->absolute_error > 0 && a->gap > 0);
    CHECK(a->energy_norm == ldexp(b->energy_norm, k) && same_bound(a->residual.e1, b->residual.e1, k));
    CHECK(a->energy_dual <= a->energy_primal && same_bound(a->energy_primal, b->energy_primal, 2 * k));
    /* Without a factor a bound on the way may be nothing but the rounding of its solve. */
    const bool rounded = x->summary.op == UZ_OPERATOR_MATRIX_FREE;
    CHECK_INT(x->history.count, y->history.count);
    for (int64_t i = 0; i < x->history.count && i < y->history.count; i++) {
        const uz_history_row *p = &x->history.rows[i], *q = &y->history.rows[i];
        CHECK(same_bound(p->dual_objective, q->dual_objective, 2 * k) && p->contacts == q->contacts);
        CHECK(rounded ||
              (isinf(p->error_bound) ? isinf(q->error_bound) : same_bound(p->error_bound, q->error_bound, k)));
    }
}

TEST(answers_scale_with_their_loads)
{
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACTIVE_SET, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE, UZ_METHOD_DUAL_ACTIVE_SET};
    static const uz_operator forms[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE};
    qp_random rng = {91};
    for (int n = 0; n < 60; n++) {
        const qp_kind kind = {.d = random_int(&rng, 1, 12), .m = random_int(&rng, 1, 8), .condition = 100};
        uz_problem problem = problem_of(random_qp(&rng, &kind));
        uz_settings settings = uz_settings_default();
        settings.method = methods[n % 5];
        settings.op = forms[n % 3];
        uz_result *first = solve_problem(&problem, &settings);
        for (int k = 0; first && k < EXPONENTS; k++) {
            multiply(problem.qp.p, kind.d, exponents[k]);
            multiply(problem.qp.h, kind.m, exponents[k]);
            uz_result *result = solve_problem(&problem, &settings);
            if (result)
                check_scaled(result, first, exponents[k], "solve");
            uz_result_free(result);
            multiply(problem.qp.p, kind.d, -exponents[k]);
            multiply(problem.qp.h, kind.m, -exponents[k]);
        }
        uz_result_free(first);
        uz_problem_clear(&problem);
    }
}

/* The same for a check of what was given, and for a run that goes on from a state; hooks are told in the same units. */
static double told;

static void note(void *ctx, const uz_history_row *row)
{
    (void)ctx;
    told = row->dual_objective;
}

static uz_result *solve_from(const uz_problem *problem, const uz_settings *settings, const uz_state *start)
{
    uz_result **results = NULL;
    const uz_state *starts[] = {start};
    const uz_hooks hooks = {.progress = note};
    CHECK_INT(uz_solve_cases(&results, problem, settings, start ? starts : NULL, NULL, &hooks, NULL), UZ_OK);
    uz_result *result = results ? results[0] : NULL;
    free(results);
    return result;
}

TEST(states_and_answers_that_are_given_scale_too)
{
    qp_random rng = {5};
    const qp_kind kind = {.d = 12, .m = 8, .condition = 1e3};
    uz_problem problem = problem_of(random_qp(&rng, &kind));
    uz_settings part = uz_settings_default(), rest;
    part.method = UZ_METHOD_UZAWA;
    rest = part;
    part.max_iterations = 7;
    rest.max_iterations = 5000;
    uz_result *whole = NULL, *begun = NULL, *checked = NULL;
    double objective = 0;
    for (int n = 0; n < EXPONENTS + 1; n++) {
        const int k = n == 0 ? 0 : exponents[n - 1];
        multiply(problem.qp.p, kind.d, k);
        multiply(problem.qp.h, kind.m, k);
        uz_result *stopped = solve_from(&problem, &part, NULL), *verified = NULL;
        uz_result *on = stopped ? solve_from(&problem, &rest, stopped->state) : NULL;
        CHECK(on && on->summary.origin == UZ_FROM_STATE && on->summary.outcome == UZ_CONVERGED);
        if (!on)
            break;
        CHECK_MSG(n == 0 || same_bound(told, objective, 2 * k), "2^%d: %g", k, told);
        CHECK_INT(uz_verify(&verified, &problem, on->u, on->r, &rest, NULL, NULL, NULL), UZ_OK);
        CHECK(verified && verified->summary.outcome == UZ_VERIFIED);
        if (n > 0 && verified) {
            check_scaled(stopped, begun, k, "part");
            check_scaled(on, whole, k, "rest");
            check_scaled(verified, checked, k, "verify");
            CHECK(same(on->state->Dr, whole->state->Dr, kind.m, k) && same(on->state->r, whole->state->r, kind.m, k));
        }
        multiply(problem.qp.p, kind.d, -k);
        multiply(problem.qp.h, kind.m, -k);
        uz_result_free(n > 0 ? stopped : NULL);
        uz_result_free(n > 0 ? on : NULL);
        uz_result_free(n > 0 ? verified : NULL);
        if (n == 0) {
            begun = stopped;
            whole = on;
            checked = verified;
            objective = told;
        }
    }
    uz_result_free(begun);
    uz_result_free(whole);
    uz_result_free(checked);
    uz_problem_clear(&problem);
}

/* What doubles hold of an answer among denormals is another answer, and certified as such. */
TEST(what_denormals_lose_is_in_the_bound)
{
    const double K[] = {3}, N[] = {1};
    uz_settings settings = uz_settings_default();
    for (int k = -1060; k >= -1074; k--) {
        uz_qp qp = {
            .K = csc_from_dense(K, 1, 1, true), .N = csc_from_dense(N, 1, 1, false), .p = vector(1), .h = vector(1)};
        qp.p[0] = ldexp(1, k); /* u* = 2^k / 3, with free gap */
        qp.h[0] = 1;
        uz_problem problem = problem_of(qp);
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            const uz_certificate *c = &result->summary.certificate;
            const long double error = fabsl(ldexpl(1, k) / 3 - (long double)result->u[0]) * sqrtl(3);
            CHECK_MSG((long double)c->absolute_error >= error && c->absolute_error <= 4 * DBL_TRUE_MIN,
                      "2^%d: %g, bound %g", k, (double)error, c->absolute_error);
            CHECK(result->summary.outcome == UZ_PRECISION_LIMIT);
        }
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* u* = 2^1100 / 3 is larger than any double: nothing is claimed of it. */
TEST(an_answer_beyond_doubles_is_not_certified)
{
    const double K[] = {ldexp(3, -100)}, N[] = {1};
    uz_settings settings = uz_settings_default();
    uz_qp qp = {
        .K = csc_from_dense(K, 1, 1, true), .N = csc_from_dense(N, 1, 1, false), .p = vector(1), .h = vector(1)};
    qp.p[0] = -ldexp(1, 1000);
    uz_problem problem = problem_of(qp);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_PRECISION_LIMIT);
    CHECK(result && isinf(result->summary.certificate.relative_error));
    uz_result_free(result);
    uz_problem_clear(&problem);
}
