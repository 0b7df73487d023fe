/* The paper's body against numbers of an independent program: mm, N, MPa. */
#include "core/alloc.h"
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

typedef struct {
    int64_t nx, ny, contacts;
    double lambda_max, condition, energy, reaction_sum;
} body_reference;

static const body_reference bodies[] = {
    {30, 10, 22, 9.427e-4, 822, -3.9608186040e-3, -10.51371700},
    {60, 20, 44, 1.838e-3, 1603, -3.9620174378e-3, -10.53866779},
    {120, 40, 88, 3.625e-3, 3161, -3.9624809230e-3, -10.54546589},
};

static uz_problem paper_problem(int64_t nx, int64_t ny)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(nx, ny)};
}

static void check_answer(const uz_result *result, const body_reference *want, uz_outcome outcome)
{
    if (!result)
        return;
    const uz_summary *s = &result->summary;
    CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), uz_choice_name(UZ_CHOICE_OUTCOME, outcome));
    CHECK_INT(s->m, want->nx);
    CHECK_INT(s->d, 2 * want->nx * (want->ny + 1));
    CHECK_INT(s->active, want->contacts);
    CHECK_REL(s->certificate.energy_primal, want->energy, 1e-9);
    CHECK_REL(s->certificate.energy_dual, want->energy, 1e-9);
    CHECK_REL(s->reaction_sum, want->reaction_sum, 1e-8);
    CHECK_REL(s->force[1], -want->reaction_sum, 1e-8);
    CHECK(s->certificate.relative_error <= s->requested_error);
    CHECK(s->certificate.relative_error < 1e-11);
}

TEST(exact_answers)
{
    for (size_t k = 0; k < sizeof bodies / sizeof bodies[0]; k++) {
        uz_problem problem = paper_problem(bodies[k].nx, bodies[k].ny);
        uz_settings settings = uz_settings_default();
        settings.relative_error = 1e-12;
        uz_result *result = solve_problem(&problem, &settings);
        check_answer(result, &bodies[k], UZ_CONVERGED);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* One iteration count of the table; alpha 0: 1 / lambda_max(D). */
typedef struct {
    int body;
    uz_method method;
    double alpha;
    int64_t iterations, restarts;
} run_reference;

static const run_reference runs[] = {
    {0, UZ_METHOD_ACCELERATED_RESTART, 0, 283, 2},
    {0, UZ_METHOD_ACCELERATED, 0, 684, 0},
    {0, UZ_METHOD_UZAWA, 0, 2872, 0},
    {0, UZ_METHOD_ACCELERATED_RESTART, 93.51, 615, 3},
    {1, UZ_METHOD_ACCELERATED_RESTART, 0, 263, 2},
    {1, UZ_METHOD_ACCELERATED, 0, 635, 0},
    {1, UZ_METHOD_UZAWA, 0, 4054, 0},
    {1, UZ_METHOD_ACCELERATED_RESTART, 25.20, 675, 2},
    {2, UZ_METHOD_ACCELERATED_RESTART, 0, 361, 1},
};

static uz_settings paper_settings(uz_method method, double alpha)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.stopping = UZ_STOP_PAPER;
    settings.epsilon = 1e-6;
    settings.alpha = alpha;
    return settings;
}

TEST(iterations_of_the_paper)
{
    for (size_t k = 0; k < sizeof runs / sizeof runs[0]; k++) {
        const run_reference *want = &runs[k];
        const body_reference *body = &bodies[want->body];
        uz_problem problem = paper_problem(body->nx, body->ny);
        uz_settings settings = paper_settings(want->method, want->alpha);
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            const uz_summary *s = &result->summary;
            CHECK_REL((double)s->iterations, (double)want->iterations, 0.02);
            CHECK_INT(s->restarts, want->restarts);
            CHECK_INT(s->active, body->contacts);
            CHECK(s->outcome == UZ_PAPER_RULE || s->outcome == UZ_CONVERGED);
            CHECK(result->history.rows[result->history.count - 1].step_norm <= 1e-6);
            CHECK(result->history.rows[result->history.count - 2].step_norm > 1e-6);
            if (want->alpha == 0)
                CHECK_REL(s->lambda_max, body->lambda_max, 5e-4);
        }
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* K^-1 by the solver's own substitutions, N and the assembled load: enough to look at answers from outside. */
typedef struct {
    uz_qp qp;
    uz_mesh_info info;
    uz_factor *factor;
    uz_factor_workspace *ws;
} probe;

static probe make_probe(int64_t nx, int64_t ny)
{
    probe p = {.ws = uz_factor_workspace_new()};
    uz_scene scene = paper_scene(nx, ny);
    uz_error err = {0};
    CHECK(uz_scene_to_qp(&p.qp, &p.info, &scene, &err) == UZ_OK);
    CHECK(factor_by(&p.factor, &p.qp.K, NULL, 0, UZ_ORDERING_AMD, 0, &err) == UZ_OK);
    uz_scene_clear(&scene);
    return p;
}

static void free_probe(probe *p)
{
    uz_factor_free(p->factor);
    uz_factor_workspace_free(p->ws);
    uz_qp_clear(&p->qp);
    uz_mesh_info_clear(&p->info);
}

static void probe_solve(const probe *p, double *x)
{
    double *y = vector(p->qp.K.cols);
    uz_error err = {0};
    uz_factor_permute(p->factor, y, x);
    CHECK(uz_factor_solve_one(p->factor, p->ws, y, true, &err) == UZ_OK);
    CHECK(uz_factor_solve_one(p->factor, p->ws, y, false, &err) == UZ_OK);
    uz_factor_unpermute(p->factor, x, y);
    free(y);
}

static double *probe_operator(const probe *p)
{
    int64_t m = p->qp.N.rows, d = p->qp.K.cols;
    double *D = vector(m * m), *x = vector(d), *unit = vector(m);
    for (int64_t i = 0; i < m; i++) {
        memset(x, 0, (size_t)d * sizeof *x);
        unit[i] = 1;
        uz_csc_gaxpy_t(x, &p->qp.N, 1, unit);
        unit[i] = 0;
        probe_solve(p, x);
        uz_csc_gaxpy(D + i * m, &p->qp.N, 1, x);
    }
    free(x);
    free(unit);
    return D;
}

typedef struct {
    int64_t iterations, restarts;
} step_count;

/* Algorithm 2 as it is printed (tau and rho as in its box), on the rows that D and g0 belong to. */
static step_count plain_algorithm_2(const double *D, const double *g0, int64_t m, double alpha, double epsilon)
{
    double *r = vector(m), *rho = vector(m), *next = vector(m), *gap = vector(m), tau = 1, change = INFINITY;
    step_count count = {0, 0};
    for (; change > epsilon && count.iterations < 20000; count.iterations++) {
        double square = 0, ascent = 0, grown = 0.5 * (1 + sqrt(1 + 4 * tau * tau));
        for (int64_t i = 0; i < m; i++) {
            gap[i] = g0[i];
            for (int64_t j = 0; j < m; j++)
                gap[i] -= D[i + j * m] * rho[j];
            next[i] = fmin(0, rho[i] + alpha * gap[i]);
            square += (rho[i] - next[i]) * (rho[i] - next[i]);
            ascent += gap[i] * (next[i] - r[i]);
        }
        for (int64_t i = 0; i < m; i++) {
            rho[i] = next[i] + (ascent < 0 ? 0 : (tau - 1) / grown) * (next[i] - r[i]);
            r[i] = next[i];
        }
        tau = ascent < 0 ? 1 : grown;
        count.restarts += ascent < 0;
        change = sqrt(square);
    }
    uz_free_all(r, rho, next, gap);
    return count;
}

/* Rows of N and h times factor[i % 4]. */
static void scale_rows(uz_qp *qp, const double *factor)
{
    for (int64_t k = 0; k < qp->N.ptr[qp->N.cols]; k++)
        qp->N.val[k] *= factor[qp->N.idx[k] % 4];
    for (int64_t i = 0; i < qp->N.rows; i++)
        qp->h[i] *= factor[i % 4];
}

static double largest_eigenvalue(const double *D, int64_t m)
{
    double *x = vector(m), *y = vector(m), value = 0;
    for (int64_t i = 0; i < m; i++)
        x[i] = 1 + (double)i / (double)m;
    for (int step = 0; step < 3000; step++) {
        double norm = 0;
        for (int64_t i = 0; i < m; i++) {
            y[i] = 0;
            for (int64_t j = 0; j < m; j++)
                y[i] += D[i + j * m] * x[j];
            norm += y[i] * y[i];
        }
        value = sqrt(norm);
        for (int64_t i = 0; i < m; i++)
            x[i] = y[i] / value;
    }
    free(x);
    free(y);
    return value;
}

/* alpha and lambda_max belong to the rows as the caller wrote them, and so do the steps: where all are larger or
 * smaller by a factor the counts stay those of the table; where they are mixed the counts are those of the algorithm
 * itself. */
TEST(steps_are_those_of_the_rows_as_given)
{
    static const double factors[][4] = {{1, 1, 1, 1},         {4, 4, 4, 4},   {1e-3, 1e-3, 1e-3, 1e-3},
                                        {1e3, 1e3, 1e3, 1e3}, {1, 4, 0.5, 2}, {3, 1, 0.7, 1.5}};
    for (size_t k = 0; k < sizeof factors / sizeof factors[0]; k++) {
        const double *factor = factors[k], c = factor[0];
        const bool alike = factor[1] == c && factor[2] == c && factor[3] == c;
        probe p = make_probe(30, 10);
        const int64_t m = p.qp.N.rows;
        scale_rows(&p.qp, factor);
        double *D = probe_operator(&p), *u = vector(p.qp.K.cols), *g0 = vector(m), lambda = largest_eigenvalue(D, m);
        memcpy(u, p.qp.p, (size_t)p.qp.K.cols * sizeof *u);
        probe_solve(&p, u);
        memcpy(g0, p.qp.h, (size_t)m * sizeof *g0);
        uz_csc_gaxpy(g0, &p.qp.N, -1, u);
        for (int given = 0; given < 2; given++) {
            const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = p.qp};
            uz_settings settings = paper_settings(UZ_METHOD_ACCELERATED_RESTART, given ? 0.75 / lambda : 0);
            settings.epsilon = 1e-6 / c;
            uz_result *result = solve_problem(&problem, &settings);
            if (!result)
                continue;
            const uz_summary *s = &result->summary;
            const step_count plain = plain_algorithm_2(D, g0, m, s->alpha, settings.epsilon);
            CHECK_MSG(s->iterations == plain.iterations, "rows times %g, %g, ..: %lld iterations, the algorithm %lld",
                      c, factor[1], (long long)s->iterations, (long long)plain.iterations);
            CHECK_INT(s->restarts, plain.restarts);
            CHECK_INT(s->row_scaling, UZ_ROW_SCALING_NONE);
            if (!given) {
                CHECK_REL(s->lambda_max, lambda, 2e-4);
                CHECK_REL(s->alpha * s->lambda_max, 1.0, 1e-12);
            } else {
                CHECK(s->alpha == settings.alpha);
            }
            if (alike && !given) {
                CHECK_INT(s->iterations, 283);
                CHECK_REL(s->lambda_max, c * c * bodies[0].lambda_max, 5e-4);
            }
            uz_result_free(result);
        }
        uz_free_all(D, u, g0);
        free_probe(&p);
    }
}

/* What is scaled to unit rows takes the steps of unit rows, whatever powers of two they were multiplied by. */
TEST(unit_rows_take_the_same_steps_on_mixed_ones)
{
    static const double factor[4] = {1, 4, 0x1p-10, 0x1p12};
    static const uz_method methods[] = {UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_CONJUGATE};
    for (size_t k = 0; k < 2; k++) {
        probe p = make_probe(30, 10);
        const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = p.qp};
        uz_settings settings = uz_settings_default();
        settings.method = methods[k];
        uz_result *as_is = solve_problem(&problem, &settings);
        scale_rows(&p.qp, factor);
        settings.row_scaling = UZ_ROW_SCALING_UNIT;
        uz_result *mixed = solve_problem(&problem, &settings);
        if (as_is && mixed) {
            CHECK_INT(mixed->summary.row_scaling, UZ_ROW_SCALING_UNIT);
            CHECK_INT(mixed->summary.outcome, UZ_CONVERGED);
            CHECK_INT(mixed->summary.iterations, as_is->summary.iterations);
            CHECK(mixed->summary.alpha == as_is->summary.alpha && isnan(mixed->summary.lambda_max));
            for (int64_t j = 0; j < mixed->d; j++)
                CHECK(mixed->u[j] == as_is->u[j]);
        }
        uz_result_free(mixed);
        settings.row_scaling = UZ_ROW_SCALING_AUTO;
        mixed = solve_problem(&problem, &settings);
        if (mixed) /* the paper's methods by name are the paper's */
            CHECK_INT(mixed->summary.row_scaling, k == 0 ? UZ_ROW_SCALING_NONE : UZ_ROW_SCALING_UNIT);
        uz_result_free(mixed);
        uz_result_free(as_is);
        free_probe(&p);
    }
}

/* Rows whose norms have no squares: nothing is told that is not a number. */
TEST(rows_of_extreme_size_have_no_step_size_to_tell)
{
    static const double sizes[] = {1e-200, 1e200};
    for (int k = 0; k < 2; k++) {
        const double factor[4] = {sizes[k], sizes[k], sizes[k], sizes[k]};
        probe p = make_probe(30, 10);
        const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = p.qp};
        scale_rows(&p.qp, factor);
        uz_settings settings = paper_settings(UZ_METHOD_ACCELERATED_RESTART, 0);
        settings.epsilon = 1e-6 / sizes[k];
        uz_result *result = solve_problem(&problem, &settings);
        if (result)
            CHECK_MSG(isnan(result->summary.alpha) && isnan(result->summary.lambda_max), "alpha %g, lambda_max %g",
                      result->summary.alpha, result->summary.lambda_max);
        uz_result_free(result);
        free_probe(&p);
    }
}

/* 1 / the largest eigenvalue of D^-1, by power iteration with a dense factor. */
static double smallest_eigenvalue(double *D, int64_t m)
{
    double *x = vector(m), norm = 1;
    CHECK(dense_cholesky(D, m));
    for (int64_t i = 0; i < m; i++)
        x[i] = i % 2 ? 1 : -1;
    for (int step = 0; step < 2000; step++) {
        double square = 0;
        dense_solve(x, D, m);
        for (int64_t i = 0; i < m; i++)
            square += x[i] * x[i];
        norm = sqrt(square);
        for (int64_t i = 0; i < m; i++)
            x[i] /= norm;
    }
    free(x);
    return 1 / norm;
}

TEST(condition_of_the_dual_operator)
{
    for (size_t k = 0; k < sizeof bodies / sizeof bodies[0]; k++) {
        probe p = make_probe(bodies[k].nx, bodies[k].ny);
        double *D = probe_operator(&p), least = smallest_eigenvalue(D, p.qp.N.rows);
        CHECK_REL(bodies[k].lambda_max / least, bodies[k].condition, 2e-3);
        free(D);
        free_probe(&p);
    }
}

/* ||u_r - u_s||_K = ||N'(r - s)|| in the norm of K^-1. */
static double distance(const probe *p, const double *r, const double *s)
{
    int64_t m = p->qp.N.rows, d = p->qp.K.cols;
    double *difference = vector(m), *force = vector(d), *x = vector(d), sum = 0;
    for (int64_t i = 0; i < m; i++)
        difference[i] = r[i] - s[i];
    uz_csc_gaxpy_t(force, &p->qp.N, 1, difference);
    memcpy(x, force, (size_t)d * sizeof *x);
    probe_solve(p, x);
    for (int64_t j = 0; j < d; j++)
        sum += force[j] * x[j];
    uz_free_all(difference, force, x);
    return sqrt(fmax(0, sum));
}

/* Relative energy-norm error of u_r after so many iterations; `answer` is the exact result. */
static double error_after(const probe *p, const uz_problem *problem, const uz_result *answer, int64_t iterations)
{
    uz_settings settings = paper_settings(UZ_METHOD_ACCELERATED_RESTART, 0);
    settings.max_iterations = iterations;
    uz_result *result = solve_problem(problem, &settings);
    if (!result)
        return NAN;
    double error = distance(p, result->r, answer->r) / answer->summary.certificate.energy_norm;
    double bound = result->summary.certificate.absolute_error / answer->summary.certificate.energy_norm;
    CHECK_MSG(bound >= error * (1 - 1e-9), "iteration %lld: bound %g, error %g", (long long)iterations, bound, error);
    uz_result_free(result);
    return error;
}

/* "passes 2.5e-2 at iteration 10 and 1.4e-3 at 50; the paper's epsilon stops at 283 with 7.7e-6". */
TEST(accuracy_for_iterations)
{
    uz_problem problem = paper_problem(30, 10);
    uz_settings settings = uz_settings_default();
    settings.relative_error = 1e-12;
    uz_result *answer = solve_problem(&problem, &settings);
    probe p = make_probe(30, 10);
    double last = 1;
    for (int64_t k = 1; k <= 50; k++) {
        double error = error_after(&p, &problem, answer, k);
        if (k == 10 || k == 50)
            printf("# iteration %lld: relative error %.3g\n", (long long)k, error);
        if (k >= 10)
            CHECK_MSG(error < 2.6e-2, "iteration %lld: %g", (long long)k, error);
        last = error;
    }
    CHECK_MSG(last < 1.5e-3, "iteration 50: %g", last);
    CHECK_REL(error_after(&p, &problem, answer, 100000), 7.7e-6, 0.05);
    free_probe(&p);
    uz_result_free(answer);
    uz_problem_clear(&problem);
}

static void compare_rows(const uz_history_row *a, const uz_history_row *b)
{
    CHECK_INT(a->iteration, b->iteration);
    CHECK_INT(a->contacts, b->contacts);
    CHECK_INT(a->restart, b->restart);
    CHECK_REL(a->dual_objective, b->dual_objective, 1e-12);
    CHECK(fabs(a->step_norm - b->step_norm) <= 1e-9 * fabs(b->step_norm) + 1e-12);
    CHECK(fabs(a->residual.total - b->residual.total) <= 1e-9 * b->residual.total + 1e-12);
}

TEST(both_operators_take_the_same_steps)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART};
    uz_problem problem = paper_problem(30, 10);
    for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++) {
        uz_settings settings = paper_settings(methods[k], 1 / 9.43e-4);
        settings.max_iterations = 400;
        settings.op = UZ_OPERATOR_CONDENSED;
        uz_result *condensed = solve_problem(&problem, &settings);
        settings.op = UZ_OPERATOR_FACTORED;
        uz_result *factored = solve_problem(&problem, &settings);
        if (condensed && factored) {
            CHECK_INT(condensed->summary.op, UZ_OPERATOR_CONDENSED);
            CHECK_INT(factored->summary.op, UZ_OPERATOR_FACTORED);
            CHECK_INT(condensed->summary.restarts, factored->summary.restarts);
            CHECK_INT(condensed->history.count, factored->history.count);
            for (int64_t i = 0; i < condensed->history.count && i < factored->history.count; i++)
                compare_rows(&condensed->history.rows[i], &factored->history.rows[i]);
            for (int64_t i = 0; i < condensed->m; i++)
                CHECK(fabs(condensed->r[i] - factored->r[i]) <= 1e-9);
        }
        uz_result_free(condensed);
        uz_result_free(factored);
    }
    uz_problem_clear(&problem);
}

TEST(every_ordering_gives_the_same_answer)
{
    static const uz_ordering orderings[] = {UZ_ORDERING_AUTO, UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};
    static const uz_operator operators[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};
    uz_problem problem = paper_problem(30, 10);
    for (size_t k = 0; k < sizeof orderings / sizeof orderings[0]; k++)
        for (size_t o = 0; o < 2; o++) {
            uz_settings settings = uz_settings_default();
            settings.relative_error = 1e-12;
            settings.ordering = orderings[k];
            settings.op = operators[o];
            uz_result *result = solve_problem(&problem, &settings);
            check_answer(result, &bodies[0], UZ_CONVERGED);
            if (result && orderings[k] != UZ_ORDERING_AUTO)
                CHECK_INT(result->summary.ordering, orderings[k]);
            if (result)
                CHECK(result->summary.ordering != UZ_ORDERING_AUTO);
            uz_result_free(result);
        }
    uz_problem_clear(&problem);
}

/* The same body in metres and Pascal, thickness in metres: forces stay Newton, only lengths and energies scale. */
TEST(units_change_nothing_but_exponents)
{
    uz_problem mm = paper_problem(30, 10), si = paper_problem(30, 10);
    uz_scene *scene = &si.scene;
    scene->box.size[0] = 0.06;
    scene->box.size[1] = 0.02;
    scene->thickness = 0.005;
    scene->materials[0].young = 200e9;
    scene->loads[0].v[1] = -0.05e6;
    scene->loads[1].v[0] = 0.5e6;
    uz_settings settings = paper_settings(UZ_METHOD_ACCELERATED_RESTART, 0);
    uz_result *a = solve_problem(&mm, &settings), *b = solve_problem(&si, &settings);
    if (a && b) {
        CHECK_INT(a->summary.iterations, b->summary.iterations);
        CHECK_INT(a->summary.restarts, b->summary.restarts);
        CHECK_REL(b->summary.reaction_sum, a->summary.reaction_sum, 1e-9);
        CHECK_REL(1e3 * b->summary.certificate.energy_primal, a->summary.certificate.energy_primal, 1e-9);
        CHECK_REL(b->summary.certificate.relative_error, a->summary.certificate.relative_error, 1e-3);
    }
    uz_result_free(a);
    uz_result_free(b);
    uz_problem_clear(&mm);
    uz_problem_clear(&si);
}
