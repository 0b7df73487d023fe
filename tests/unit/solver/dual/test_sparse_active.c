/* The active set on the factored operator: rows that bound single dofs. */
#include "factor_fixture.h"
#include "floor.h"
#include "harness.h"
#include "obstacle.h"
#include "qp_fixture.h"
#include "quad_exact.h"

#define COUNT(list) (sizeof(list) / sizeof((list)[0]))

static uz_settings settings_for(uz_method method)
{
    uz_settings settings = uz_settings_default();
    settings.method = method;
    settings.op = UZ_OPERATOR_FACTORED;
    return settings;
}

/* n x n dofs, links of random stiffness, the border held by springs: an M-matrix. foundation: a spring under each. */
static double *random_membrane(qp_random *rng, int64_t n, double border, double foundation)
{
    int64_t d = n * n;
    double *K = vector(d * d);
    for (int64_t k = 0; k < d; k++) {
        int64_t x = k % n, y = k / n, next[2] = {x + 1 < n ? k + 1 : -1, y + 1 < n ? k + n : -1};
        bool edge = x == 0 || y == 0 || x == n - 1 || y == n - 1;
        K[k * d + k] += foundation + (edge ? border : 0);
        for (int side = 0; side < 2; side++) {
            double stiffness = 0.5 + random_unit(rng);
            if (next[side] < 0)
                continue;
            K[k * d + k] += stiffness;
            K[next[side] * d + next[side]] += stiffness;
            K[k * d + next[side]] = K[next[side] * d + k] = -stiffness;
        }
    }
    return K;
}

/* Bounds on each dof of a stiffness matrix, which it takes over: rows 0..d-1 from above, d..2d-1 from below, with the
 * entries given in turn. */
static uz_qp boxed(qp_random *rng, double *K, int64_t d, const double *entries, size_t n_entries)
{
    double *N = vector(2 * d * d);
    uz_qp qp = {.p = vector(d), .h = vector(2 * d)};
    for (int64_t j = 0; j < d; j++) {
        double above = fabs(entries[(size_t)j % n_entries]), below = -fabs(entries[(size_t)(j + 1) % n_entries]);
        qp.p[j] = 2 * random_signed(rng);
        N[j * d + j] = above;
        qp.h[j] = above * 0.4 * random_unit(rng);
        N[(d + j) * d + j] = below;
        qp.h[d + j] = -below * 0.4 * random_unit(rng);
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, 2 * d, d, false);
    free(K);
    free(N);
    return qp;
}

static const double plain[] = {1}, scaled[] = {3.7, 2, 1e8, 1, 1e-5};

/* minimize 1/2 u'Ku - p'u, lower <= u <= upper by projected Gauss and Seidel sweeps, until nothing moves. */
static void projected_sweeps(double *u, const double *K, const uz_qp *qp, int64_t d)
{
    uz_csc Nt;
    uz_error err = {0};
    CHECK(uz_csc_transpose(&Nt, &qp->N, &err) == UZ_OK);
    double *top = vector(d), *bottom = vector(d), moved = 1;
    for (int64_t i = 0; i < qp->N.rows; i++)
        *(Nt.val[Nt.ptr[i]] > 0 ? top + Nt.idx[Nt.ptr[i]] : bottom + Nt.idx[Nt.ptr[i]]) = qp->h[i] / Nt.val[Nt.ptr[i]];
    for (int sweep = 0; sweep < 100000 && moved > 1e-16; sweep++) {
        moved = 0;
        for (int64_t j = 0; j < d; j++) {
            double force = qp->p[j], before = u[j];
            for (int64_t k = 0; k < d; k++)
                force -= K[j * d + k] * u[k];
            u[j] = fmin(top[j], fmax(bottom[j], u[j] + force / K[j * d + j]));
            moved = fmax(moved, fabs(u[j] - before));
        }
    }
    free(top);
    free(bottom);
    uz_csc_clear(&Nt);
}

TEST(membrane_like_projected_sweeps)
{
    for (uint64_t seed = 1; seed <= 20; seed++) {
        qp_random rng = {seed};
        int64_t n = random_int(&rng, 1, 11), d = n * n;
        double *K = random_membrane(&rng, n, 1, 0), *copy = vector(d * d), *u = vector(d);
        memcpy(copy, K, (size_t)(d * d) * sizeof *K);
        uz_problem problem = problem_of(boxed(&rng, K, d, seed % 2 ? plain : scaled, seed % 2 ? 1 : COUNT(scaled)));
        projected_sweeps(u, copy, &problem.qp, d);
        for (int k = 0; k < 2; k++) {
            uz_settings settings = settings_for(k ? UZ_METHOD_ACTIVE_SET : UZ_METHOD_AUTO);
            uz_result *result = solve_problem(&problem, &settings);
            CHECK(result && result->summary.outcome == UZ_CONVERGED);
            for (int64_t j = 0; result && j < d; j++)
                CHECK_MSG(fabs(result->u[j] - u[j]) <= 1e-12, "seed %d, dof %lld: %.17g, not %.17g", (int)seed,
                          (long long)j, result->u[j], u[j]);
            CHECK(result && result->summary.iterations <= 6);
            uz_result_free(result);
        }
        free(copy);
        free(u);
        uz_problem_clear(&problem);
    }
}

/* Against the exact solution: u, r, and that no bound lies. */
static void check_exact(const uz_problem *problem, const quad_exact *exact, uz_method method, int64_t most_steps,
                        const char *what)
{
    uz_settings settings = settings_for(method);
    uz_result *result = solve_problem(problem, &settings);
    if (!result)
        return;
    const uz_summary *s = &result->summary;
    double error = fmax(quad_error(exact, result->u), quad_error_of_reactions(exact, result->r));
    CHECK_MSG(s->outcome == UZ_CONVERGED, "%s, %s: %s, %g", what, uz_method_name(method),
              uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), s->certificate.relative_error);
    CHECK_MSG(s->certificate.absolute_error >= error - 1e-25 * s->certificate.energy_norm, "%s: bound %g, error %g",
              what, s->certificate.absolute_error, error);
    CHECK_MSG(s->iterations <= most_steps, "%s, %s: %lld steps", what, uz_method_name(method),
              (long long)s->iterations);
    uz_result_free(result);
}

/* By name and by default. Takes the problem over. */
static void check_both(uz_qp qp, int64_t most_steps, const char *what)
{
    uz_problem problem = problem_of(qp);
    quad_exact exact;
    CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
    check_exact(&problem, &exact, UZ_METHOD_ACTIVE_SET, most_steps, what);
    check_exact(&problem, &exact, UZ_METHOD_AUTO, most_steps, what);
    quad_exact_free(&exact);
    uz_problem_clear(&problem);
}

/* Two methods that share nothing but the operator. */
TEST(agrees_with_the_iterations)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        qp_random rng = {seed};
        uz_problem problem = problem_of(boxed(&rng, random_membrane(&rng, 7, 1, 0), 49, plain, 1));
        uz_settings settings = settings_for(UZ_METHOD_ACTIVE_SET),
                    iterations = settings_for(UZ_METHOD_ACCELERATED_RESTART);
        uz_result *a = solve_problem(&problem, &settings), *b = solve_problem(&problem, &iterations);
        CHECK(a && b && a->summary.outcome == UZ_CONVERGED && b->summary.outcome == UZ_CONVERGED);
        CHECK(a && b && b->summary.iterations > 3 * a->summary.iterations);
        for (int64_t j = 0; a && b && j < 49; j++)
            CHECK(fabs(a->u[j] - b->u[j]) < 1e-7);
        for (int64_t i = 0; a && b && i < 98; i++)
            CHECK(fabs(a->r[i] - b->r[i]) < 1e-5);
        uz_result_free(a);
        uz_result_free(b);
        uz_problem_clear(&problem);
    }
}

TEST(any_stiffness)
{
    static const double conditions[] = {1, 10, 1e3, 1e6};
    for (uint64_t seed = 1; seed <= 24; seed++) {
        qp_random rng = {seed};
        int64_t d = random_int(&rng, 1, 40);
        double *K = random_spd(&rng, d, conditions[seed % COUNT(conditions)], 5);
        check_both(boxed(&rng, K, d, plain, 1), 20, "random stiffness");
    }
}

TEST(rows_of_any_scale)
{
    for (uint64_t seed = 1; seed <= 8; seed++) {
        qp_random rng = {seed};
        check_both(boxed(&rng, random_membrane(&rng, 6, 1, 0), 36, scaled, COUNT(scaled)), 6, "scaled rows");
    }
}

/* u_0 <= 1 three times in a row, at different heights and scales, and the lowest again. */
TEST(several_bounds_on_one_dof)
{
    double K[] = {2, -1, -1, 2}, N[] = {1, 0, 2, 0, 0.5, 0, 1, 0, 0, -1, 0, -3};
    uz_qp qp = {.p = vector(2), .h = vector(6)};
    double h[] = {1, 1.5, 2, 0.75, 4, 3};
    memcpy(qp.h, h, sizeof h);
    qp.p[0] = 5;
    qp.K = csc_from_dense(K, 2, 2, true);
    qp.N = csc_from_dense(N, 6, 2, false);
    check_both(qp, 4, "several bounds");
}

/* The loosest row alone is what a first guess by gaps names; the tightest must be the one that pushes. */
TEST(the_tightest_row_carries_the_reaction)
{
    double K[] = {1}, N[] = {1, 1};
    uz_qp qp = {.p = vector(1), .h = vector(2)};
    qp.p[0] = 3;
    qp.h[0] = 2;
    qp.h[1] = 1;
    qp.K = csc_from_dense(K, 1, 1, true);
    qp.N = csc_from_dense(N, 2, 1, false);
    uz_problem problem = problem_of(qp);
    uz_settings settings = settings_for(UZ_METHOD_AUTO);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->u[0] == 1 && result->r[0] == 0 && result->r[1] == -2);
    CHECK(result && result->g[0] == 1 && result->g[1] == 0);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Bounds that meet hold a dof from the side that it leans on. */
TEST(bounds_that_meet)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        qp_random rng = {seed};
        uz_qp qp = boxed(&rng, random_membrane(&rng, 5, 1, 0), 25, plain, 1);
        for (int64_t j = 0; j < 25; j += 3)
            qp.h[25 + j] = -qp.h[j];
        check_both(qp, 6, "bounds that meet");
    }
}

TEST(bounds_that_contradict)
{
    qp_random rng = {1};
    uz_qp qp = boxed(&rng, random_membrane(&rng, 5, 1, 0), 25, plain, 1);
    qp.h[25 + 7] = -qp.h[7] - 0.1;
    uz_problem problem = problem_of(qp);
    uz_settings settings = settings_for(UZ_METHOD_AUTO);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_INFEASIBLE && result->ray);
    CHECK(result && result->ray && result->ray[7] < 0 && result->ray[25 + 7] < 0);
    uz_result_free(result);
    settings = settings_for(UZ_METHOD_ACTIVE_SET);
    result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_INFEASIBLE && isinf(result->summary.infeasible_radius));
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Without its bounds the body would fly off by ten powers of ten: nothing of that may be left in the answer. */
TEST(body_that_only_its_bounds_hold)
{
    for (int power = 4; power <= 12; power += 2) {
        qp_random rng = {(uint64_t)power};
        uz_qp qp = boxed(&rng, random_membrane(&rng, 5, 0, pow(10, -power)), 25, plain, 1);
        for (int64_t j = 0; j < 25; j++)
            qp.p[j] = 1 + random_unit(&rng);
        uz_problem problem = problem_of(qp);
        quad_exact exact;
        CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
        check_exact(&problem, &exact, UZ_METHOD_AUTO, 6, "held by bounds");
        quad_exact_free(&exact);
        uz_problem_clear(&problem);
    }
}

/* p = K u with u at its bounds, exactly: every reaction there is 0 but for rounding. */
TEST(contact_without_force)
{
    for (uint64_t seed = 1; seed <= 8; seed++) {
        qp_random rng = {seed};
        double *K = random_membrane(&rng, 6, 1, 0), *u = vector(36);
        uz_qp qp = boxed(&rng, K, 36, plain, 1);
        for (int64_t j = 0; j < 36; j++)
            u[j] = j % 2 ? qp.h[j] : 0;
        memset(qp.p, 0, 36 * sizeof *qp.p);
        uz_csc_symv(qp.p, &qp.K, 1, u);
        free(u);
        check_both(qp, 6, "contact without force");
    }
}

/* No row is near: one linear solve, and no step at all. */
TEST(no_contact)
{
    qp_random rng = {1};
    uz_qp qp = boxed(&rng, random_membrane(&rng, 6, 1, 0), 36, plain, 1);
    for (int64_t i = 0; i < 72; i++)
        qp.h[i] = 1e3;
    check_both(qp, 0, "no contact");
}

TEST(few_rows_with_several_entries_are_exchanged)
{
    qp_random rng = {1};
    uz_qp qp = random_qp(&rng, &(qp_kind){.d = 30, .m = 20, .condition = 100});
    uz_problem problem = problem_of(qp);
    uz_settings settings = settings_for(UZ_METHOD_AUTO);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_CONVERGED);
    uz_result_free(result);
    settings = settings_for(UZ_METHOD_ACTIVE_SET);
    result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_CONVERGED);
    CHECK(result && result->summary.iterations <= 2 * 20);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* A row with a stored zero beside its entry is a bound all the same. */
TEST(stored_zeros_do_not_count)
{
    double K[] = {2, -1, -1, 2};
    uz_error err = {0};
    uz_qp qp = {.p = vector(2), .h = vector(1)};
    qp.p[0] = 5;
    qp.h[0] = 1;
    qp.K = csc_from_dense(K, 2, 2, true);
    CHECK(uz_csc_from_triplets(&qp.N, 1, 2, 2, (int64_t[]){0, 0}, (int64_t[]){0, 1}, (double[]){1, 0}, &err) == UZ_OK);
    CHECK_INT(qp.N.ptr[2], 2);
    uz_problem problem = problem_of(qp);
    uz_settings settings = settings_for(UZ_METHOD_ACTIVE_SET);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_CONVERGED && result->u[0] == 1 && result->r[0] == -3.5);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* K_FF x_F = b_F for every third dof fixed, all and none. */
TEST(principal_submatrices)
{
    for (int every = 0; every <= 3; every++) {
        uz_qp qp;
        uz_error err = {0};
        uz_factor *factor = NULL;
        uz_principal *part = NULL;
        CHECK(obstacle_qp(&qp, 30, &err) == UZ_OK);
        int64_t d = qp.K.rows;
        CHECK(factor_by(&factor, &qp.K, NULL, 0, UZ_ORDERING_AUTO, 0, &err) == UZ_OK);
        uz_factor_workspace *ws = uz_factor_workspace_new();
        bool *fixed = calloc((size_t)d, sizeof *fixed);
        double *x = vector(d), *b = vector(d);
        for (int64_t j = 0; j < d; j++) {
            fixed[j] = every > 0 && j % every == 0;
            x[j] = b[j] = sin((double)j);
        }
        CHECK(ws && uz_principal_create(&part, &qp.K, fixed, factor, ws, NULL, &err) == UZ_OK && part);
        CHECK(part && uz_principal_solve(x, part, &err) == UZ_OK);
        for (int64_t j = 0; j < d; j++) {
            CHECK(!fixed[j] || x[j] == b[j]);
            x[j] = fixed[j] ? 0 : x[j];
        }
        uz_csc_symv(b, &qp.K, -1, x);
        for (int64_t j = 0; j < d; j++)
            CHECK(fixed[j] || fabs(b[j]) < 1e-11);
        uz_principal_free(part);
        uz_factor_workspace_free(ws);
        uz_factor_free(factor);
        free(fixed);
        free(x);
        free(b);
        uz_qp_clear(&qp);
    }
}

/* The last dof of the order is on every path: with a diagonal entry that is not the factored matrix's it shows what is
 * reported. */
TEST(principal_submatrix_that_is_not_positive_definite)
{
    uz_qp qp;
    uz_error err = {0};
    uz_factor *factor = NULL;
    uz_principal *part = NULL;
    bool fixed[25] = {false}, positive = false;
    int64_t last = 0;
    CHECK(obstacle_qp(&qp, 5, &err) == UZ_OK);
    CHECK(factor_by(&factor, &qp.K, NULL, 0, UZ_ORDERING_AUTO, 0, &err) == UZ_OK);
    uz_factor_workspace *ws = uz_factor_workspace_new();
    for (int64_t i = 0; i < 25; i++)
        last = uz_factor_describe(factor).position[i] == 24 ? i : last;
    qp.K.val[qp.K.ptr[last]] = -1;
    fixed[(last + 1) % 25] = true;
    CHECK(ws && uz_principal_create(&part, &qp.K, fixed, factor, ws, NULL, &err) == UZ_OK && !part);
    fixed[last] = true;
    CHECK(ws && uz_principal_create(&part, &qp.K, fixed, factor, ws, NULL, &err) == UZ_OK && part);
    fixed[last] = false;
    CHECK(part && uz_principal_hold(&positive, part, &qp.K, fixed, NULL, &err) == UZ_OK && !positive);
    fixed[last] = true;
    CHECK(part && uz_principal_hold(&positive, part, &qp.K, fixed, NULL, &err) == UZ_OK && positive);
    uz_principal_free(part);
    uz_factor_workspace_free(ws);
    uz_factor_free(factor);
    uz_qp_clear(&qp);
}

static void check_obstacle(const uz_problem *problem, double objective, int64_t active, int64_t most_steps)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(problem, &settings);
    if (!result)
        return;
    const uz_summary *s = &result->summary;
    CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), "converged");
    CHECK_STR(uz_choice_name(UZ_CHOICE_OPERATOR, s->op), "factored");
    CHECK_REL(s->certificate.energy_primal, objective, 1e-10);
    CHECK_INT(s->active, active);
    CHECK_MSG(s->iterations <= most_steps, "%lld steps", (long long)s->iterations);
    CHECK(s->certificate.relative_error < 1e-11);
    uz_result_free(result);
}

TEST(obstacle_of_the_collection)
{
    uz_error err = {0};
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    CHECK(obstacle_qp(&problem.qp, 98, &err) == UZ_OK);
    check_obstacle(&problem, OBSTACLE_98_OBJECTIVE, OBSTACLE_98_ACTIVE, 5);
    uz_problem_clear(&problem);
}

/* The steps must not grow with the mesh as those of the plain active set do: one row of dofs a step. */
TEST(steps_hardly_grow_with_the_mesh)
{
    uz_error err = {0};
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_settings settings = uz_settings_default();
    CHECK(obstacle_qp(&problem.qp, 200, &err) == UZ_OK);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_CONVERGED && result->summary.iterations <= 7);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(reference_cases)
{
    static const char *const names[] = {"CUTE_OBSTCLAE", "CUTE_TORSIONA", "SEMI_bcsstk16"};
    const char *cases = test_cases_dir();
    if (!cases) {
        test_skip("no shared cases");
        return;
    }
    for (size_t k = 0; k < COUNT(names); k++) {
        char folder[256];
        uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
        snprintf(folder, sizeof folder, "%s/qp/%s", cases, names[k]);
        double *u = read_case_vector(folder, "ref_u"), largest = 0;
        if (read_case(&problem.qp, folder) && u) {
            uz_settings settings = uz_settings_default();
            uz_result *result = solve_problem(&problem, &settings);
            check_obstacle(&problem, case_number(folder, "objective"), (int64_t)case_number(folder, "n_active"), 5);
            for (int64_t j = 0; j < problem.qp.K.rows; j++)
                largest = fmax(largest, fabs(u[j]));
            for (int64_t j = 0; result && j < problem.qp.K.rows; j++)
                CHECK_MSG(fabs(result->u[j] - u[j]) <= 1e-9 * largest, "%s, dof %lld", names[k], (long long)j);
            uz_result_free(result);
        }
        free(u);
        uz_problem_clear(&problem);
    }
}

static uz_result *solve_floor(int64_t n, bool plate, double sink, double bumps, uz_operator op)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_settings settings = uz_settings_default();
    uz_error err = {0};
    CHECK_INT(floor_qp(&problem.qp, n, plate, sink, bumps, &err), UZ_OK);
    settings.op = op;
    uz_result *result = solve_problem(&problem, &settings);
    uz_problem_clear(&problem);
    return result;
}

/* The stiffness of a plate is no M-matrix: exact steps on all wrong rows, and the exchange of single ones after them,
 * took 220 and 285 factorizations here. */
TEST(plates_over_a_floor_take_few_steps)
{
    static const double sinks[] = {1.5, 5.0};
    for (int k = 0; k < 2; k++) {
        uz_result *got = solve_floor(100, true, sinks[k], 0, UZ_OPERATOR_FACTORED);
        CHECK(got && got->summary.outcome == UZ_CONVERGED);
        if (got)
            CHECK_MSG(got->summary.iterations <= 25, "%g times its depth: %lld steps", sinks[k],
                      (long long)got->summary.iterations);
        uz_result_free(got);
    }
}

/* Membranes and plates, pressed so that few dofs touch, or many: what the other forms and methods come to. */
TEST(floors_by_every_form)
{
    static const double sinks[] = {0.9, 1.01, 1.5, 5.0, 100.0};
    static const uz_operator ops[] = {UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE};
    for (int k = 0; k < 20; k++) {
        const bool plate = k % 2;
        const double sink = sinks[k / 4], bumps = k % 4 / 2 ? 0.5 : 0.0;
        uz_result *exact = solve_floor(24, plate, sink, bumps, UZ_OPERATOR_CONDENSED);
        for (int o = 0; o < 2; o++) {
            uz_result *got = solve_floor(24, plate, sink, bumps, ops[o]);
            CHECK(exact && got && got->summary.outcome == UZ_CONVERGED && exact->summary.outcome == UZ_CONVERGED);
            if (exact && got) {
                const uz_certificate *a = &got->summary.certificate, *b = &exact->summary.certificate;
                CHECK_INT(got->summary.active, exact->summary.active);
                CHECK_MSG(fabs(a->energy_primal - b->energy_primal) <= 1e-9 * fabs(b->energy_primal),
                          "%s %g by %s: %.12g, condensed %.12g", plate ? "plate" : "membrane", sink,
                          uz_choice_name(UZ_CHOICE_OPERATOR, ops[o]), a->energy_primal, b->energy_primal);
            }
            uz_result_free(got);
        }
        uz_result_free(exact);
    }
}
