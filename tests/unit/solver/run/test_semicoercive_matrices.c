/* Matrices whose K is singular: solved where the load presses the body on, refused by name where it does not. */
#include "semicoercive_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

/* ------------------------------------------------------------------ matrices */

TEST(two_floating_blocks_are_solved_when_both_are_pressed)
{
    uz_problem problem = problem_of(two_blocks((double[]){1, 0.01}));
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        const uz_summary *s = &result->summary;
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), "converged");
        CHECK_INT(s->semicoercive.free_modes, 6);
        /* uniform pressure on both: q^2 (1 - nu) / E times the volume, twice */
        CHECK_REL(s->certificate.energy_norm * s->certificate.energy_norm, 30 * (1 + 1e-4) * 2 * 0.7 / 200e3, 1e-7);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(two_floating_blocks_are_refused_when_one_is_not_pressed)
{
    uz_problem loose = problem_of(two_blocks((double[]){1, 0})), pushed = problem_of(two_blocks((double[]){1, -1}));
    expect_refusal(&loose, UZ_ERR_FREE_BODY, "K", "costs nothing; it moves most: dof");
    expect_refusal(&pushed, UZ_ERR_FREE_BODY, "p", "pushes a part of the body away");
    uz_problem_clear(&loose);
    uz_problem_clear(&pushed);
}

/* Free-free chains of springs, rows that bound dofs from above or below or the distance of two, loads that press more
 * often than not. */
static uz_qp random_chains(qp_random *rng)
{
    int64_t chains = random_int(rng, 1, 4), lengths[3], d = 0, m = random_int(rng, 2, 8);
    for (int64_t c = 0; c < chains; c++)
        d += lengths[c] = random_int(rng, 1, 4);
    double *K = vector(d * d), *N = vector(m * d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t c = 0, at = 0; c < chains; at += lengths[c++])
        for (int64_t j = at; j + 1 < at + lengths[c]; j++) {
            double spring = ldexp(1 + (double)random_int(rng, 0, 8), (int)random_int(rng, -3, 3)); /* exact sums */
            K[j * d + j] += spring;
            K[(j + 1) * d + j + 1] += spring;
            K[(j + 1) * d + j] = K[j * d + j + 1] = -spring;
        }
    for (int64_t i = 0; i < m; i++) {
        N[i * d + random_int(rng, 0, d)] = random_unit(rng) < 0.8 ? 1 : -0.5;
        if (random_unit(rng) < 0.25)
            N[i * d + random_int(rng, 0, d)] = -1;
        qp.h[i] = 2 * random_unit(rng);
    }
    for (int64_t j = 0; j < d; j++)
        qp.p[j] = 2 * random_unit(rng) - 0.3;
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    return qp;
}

/* Holds what the product says against every active set. Returns whether it converged. */
static bool check_against_all(const uz_problem *problem, uint64_t seed, bool *existed)
{
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    uz_result *result = NULL;
    uz_error err;
    exhaustive exact = search_all(&problem->qp);
    uz_status status = attempt(&result, problem, &settings, &err);
    bool converged = result && result->summary.outcome == UZ_CONVERGED;
    *existed = exact.strict;
    if (status == UZ_ERR_FREE_BODY || status == UZ_ERR_NOT_SPD || (result && result->summary.outcome == UZ_INFEASIBLE))
        CHECK_MSG(!exact.exists, "seed %d: refused, but there is a solution: %s", (int)seed, err.message);
    else
        CHECK_MSG(status == UZ_OK, "seed %d: %s", (int)seed, err.message);
    bool stiff = exact.exists && energy_norm_of(&exact) < 1e-12; /* no strain: there is no relative error of nothing */
    if (exact.strict && stiff)
        CHECK_MSG(result && result->summary.certificate.absolute_error < 1e-10, "seed %d: no bound", (int)seed);
    if (exact.strict && !stiff)
        CHECK_MSG(converged, "seed %d: %s %s", (int)seed,
                  result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "error", err.message);
    if (converged) {
        CHECK_MSG(exact.exists, "seed %d: converged where there is no solution", (int)seed);
        double error = exact.exists ? error_of(&exact, result->u) : 0,
               bound = result->summary.certificate.absolute_error;
        CHECK_MSG(error <= bound * (1 + 1e-12), "seed %d: error %g, bound %g", (int)seed, error, bound);
    }
    uz_result_free(result);
    exhaustive_free(&exact);
    return converged;
}

TEST(chains_against_every_active_set)
{
    int converged = 0, existed = 0, all = 400;
    for (uint64_t seed = 1; seed <= (uint64_t)all; seed++) {
        qp_random rng = {seed};
        bool exists;
        uz_problem problem = problem_of(random_chains(&rng));
        converged += check_against_all(&problem, seed, &exists);
        existed += exists;
        uz_problem_clear(&problem);
    }
    printf("# %d problems, %d with a solution, %d converged\n", all, existed, converged);
    CHECK_MSG(existed >= all / 10 && existed < all, "%d of %d have a solution: the generator is no test", existed, all);
}

/* K = 0: a rigid point between nothing and a bound. */
TEST(stiffness_of_zeros_is_held_by_its_row)
{
    uz_problem problem = problem_of((uz_qp){.p = vector(1), .h = vector(1)});
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    problem.qp.K = csc_from_dense((double[]){0}, 1, 1, true);
    problem.qp.N = csc_from_dense((double[]){1}, 1, 1, false);
    problem.qp.p[0] = 1;
    problem.qp.h[0] = 1;
    uz_result *result = NULL;
    uz_error err;
    if (attempt(&result, &problem, &settings, &err) == UZ_OK) {
        CHECK(fabs(result->u[0] - 1) < 1e-9 && fabs(result->r[0] + 1) < 1e-9);
    } else {
        CHECK_MSG(false, "%s", err.message);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

static uz_problem dense_problem(const double *K, const double *N, int64_t d, int64_t m, double p, double h)
{
    uz_problem problem = problem_of((uz_qp){.p = vector(d), .h = vector(m)});
    problem.qp.K = csc_from_dense(K, d, d, true);
    problem.qp.N = csc_from_dense(N, m, d, false);
    for (int64_t j = 0; j < d; j++)
        problem.qp.p[j] = p;
    for (int64_t i = 0; i < m; i++)
        problem.qp.h[i] = h;
    return problem;
}

/* Rows that could hide a negative eigenvalue: K + N'R N is positive definite, K is not. */
TEST(indefinite_stiffness_is_refused_however_it_is_held)
{
    static const double N[4] = {1, 0, 0, 1};
    static const double K[4][4] = {{2, 0, 0, -1e-3}, {1, 2, 2, 1}, {0, 1, 1, 0}, {1, 1, 1, 1 - 1e-9}};
    for (int k = 0; k < 4; k++) {
        uz_problem problem = dense_problem(K[k], N, 2, 2, 1, 1);
        expect_refusal(&problem, UZ_ERR_NOT_SPD, "K", "K is ");
        uz_problem_clear(&problem);
    }
}

TEST(singular_stiffness_that_no_row_reaches_is_refused)
{
    static const double K[4] = {1, -1, -1, 1}, apart[2] = {1, -1};
    uz_problem none = dense_problem(K, NULL, 2, 0, 1, 1), unreached = dense_problem(K, apart, 2, 1, 1, 1);
    expect_refusal(&none, UZ_ERR_NOT_SPD, "K", "K is ");
    expect_refusal(&unreached, UZ_ERR_NOT_SPD, "K", "K is ");
    uz_problem_clear(&none);
    uz_problem_clear(&unreached);
}

TEST(contradicting_rows_of_a_floating_body_are_infeasible)
{
    static const double K[4] = {1, -1, -1, 1}, N[4] = {1, 0, -1, 0};
    uz_problem problem = dense_problem(K, N, 2, 2, 0.1, -1);
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "infeasible");
        CHECK(result->ray && isnan(result->u[0]) && isnan(result->r[0]));
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* The resultant of the load goes through the last row: the body may turn about it at no cost. No answer is unique. */
TEST(body_on_the_edge_of_its_contact_is_not_called_solved)
{
    static const double K[9] = {1, -2, 1, -2, 4, -2, 1, -2, 1}; /* a beam of two cells: its rigid motions are free */
    static const double N[6] = {1, 0, 0, 0, 1, 0};
    uz_problem problem = dense_problem(K, N, 3, 2, 0, 0);
    problem.qp.p[1] = 1;
    expect_refusal(&problem, UZ_ERR_FREE_BODY, "K", "Support it there");
    problem.qp.p[2] = 0.5; /* beyond the edge */
    expect_refusal(&problem, UZ_ERR_FREE_BODY, "p", "Support it there");
    uz_problem_clear(&problem);
}

/* --------------------------------------------------------- limits and reuse */

static bool cancel_at(void *ctx)
{
    return --*(int *)ctx < 0;
}

/* Cancelled at every point there is: dismissed, or refused as cancelled, or solved before. */
TEST(cancel_is_honoured_in_every_phase)
{
    uz_problem problem = problem_of(two_blocks((double[]){1, 0.5}));
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    int dismissed = 0, refused = 0, calls = 0, left;
    do {
        uz_result *result = NULL;
        uz_error err = {0};
        uz_hooks hooks = {.ctx = &left, .cancelled = cancel_at};
        left = calls++;
        uz_status status = uz_solve(&result, &problem, &settings, NULL, &hooks, &err);
        refused += status == UZ_ERR_CANCELLED;
        CHECK(status == UZ_OK || status == UZ_ERR_CANCELLED);
        if (result && result->summary.outcome == UZ_DISMISSED) {
            dismissed++;
            CHECK(result->summary.certificate.relative_error > settings.relative_error);
        } else if (result) {
            CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        }
        uz_result_free(result);
    } while (left < 0 && calls < 1000);
    CHECK(dismissed > 0 && refused > 0 && calls < 1000);
    uz_problem_clear(&problem);
}

TEST(factors_of_the_regular_problems_are_cached)
{
    uz_problem problem = problem_of(two_blocks((double[]){1, 0.5}));
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    uz_cache *cache = uz_cache_new(1 << 28);
    double energy[2] = {0, 0};
    for (int k = 0; k < 2; k++) {
        uz_result *result = NULL;
        CHECK(uz_solve(&result, &problem, &settings, cache, NULL, NULL) == UZ_OK);
        CHECK(result && result->summary.outcome == UZ_CONVERGED && result->summary.factor_cached == (k == 1));
        energy[k] = result ? result->summary.certificate.energy_primal : NAN;
        uz_result_free(result);
    }
    CHECK(energy[0] == energy[1]);
    uz_cache_free(cache);
    uz_problem_clear(&problem);
}

/* Powers of two in the units of force and length change nothing but exponents. */
TEST(units_change_exponents_only)
{
    uz_result *results[2] = {NULL, NULL};
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    for (int k = 0; k < 2; k++) {
        uz_qp qp = two_blocks((double[]){1, 0.5});
        for (int64_t q = 0; k == 1 && q < qp.K.ptr[qp.K.cols]; q++)
            qp.K.val[q] *= 0x1p30;
        for (int64_t j = 0; k == 1 && j < qp.K.cols; j++)
            qp.p[j] *= 0x1p20;
        uz_problem problem = problem_of(qp);
        results[k] = solve_problem(&problem, &settings);
        uz_problem_clear(&problem);
    }
    if (results[0] && results[1]) {
        CHECK(results[0]->summary.semicoercive.rounds == results[1]->summary.semicoercive.rounds);
        CHECK_REL(results[1]->summary.certificate.energy_primal, 0x1p10 * results[0]->summary.certificate.energy_primal,
                  1e-12);
    }
    uz_result_free(results[0]);
    uz_result_free(results[1]);
}
