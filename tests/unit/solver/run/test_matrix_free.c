/* Whole solves without a factor: the answers of the other forms, bounds that hold at every accuracy, and the memory
 * rule that chooses this form. */
#include "run/cost.h"
#include "run/setup.h"
#include "run/setup_cache.h"
#include "linalg/pieces.h"
#include "harness.h"
#include "membrane.h"
#include "qp_fixture.h"
#include "sanitized.h"
#include "scene_fixture.h"
#include "two_boxes.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

static uz_settings settings_for(uz_operator op, uz_method method, double relative_error)
{
    uz_settings s = uz_settings_default();
    s.op = op;
    s.method = method;
    s.relative_error = relative_error;
    return s;
}

static uz_problem scene_problem(int64_t nx, int64_t ny)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(nx, ny)};
}

/* The same of cells that are not all equal, which has a matrix. */
static uz_problem graded_problem(int64_t nx, int64_t ny)
{
    uz_problem problem = scene_problem(nx, ny);
    problem.scene.box.grading[0] = 1.01;
    return problem;
}

/* The scene as matrices: nothing is known of its mesh. */
static uz_problem matrix_problem(int64_t nx, int64_t ny)
{
    uz_scene scene = paper_scene(nx, ny);
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_mesh_info info = {0};
    uz_error err = {0};
    CHECK(uz_scene_to_qp(&problem.qp, &info, &scene, &err) == UZ_OK);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
    return problem;
}

static double distance(const uz_csc *K, const double *u, const double *v)
{
    double *e = vector(K->cols), *Ke = vector(K->cols), sum = 0.0;
    for (int64_t j = 0; j < K->cols; j++)
        e[j] = u[j] - v[j];
    uz_csc_symv(Ke, K, 1.0, e);
    for (int64_t j = 0; j < K->cols; j++)
        sum += e[j] * Ke[j];
    free(e);
    free(Ke);
    return sqrt(fmax(0.0, sum));
}

/* Solves matrices both ways; the bound of the answer without a factor must cover its distance from the exact one. */
static void check_against_factor(const uz_problem *problem, uz_method method, double relative_error)
{
    uz_settings exactly = settings_for(UZ_OPERATOR_AUTO, UZ_METHOD_AUTO, 1e-11);
    uz_settings freely = settings_for(UZ_OPERATOR_MATRIX_FREE, method, relative_error);
    uz_result *exact = solve_problem(problem, &exactly), *got = solve_problem(problem, &freely);
    if (!exact || !got)
        return;
    const uz_certificate *c = &got->summary.certificate;
    double slack = exact->summary.certificate.absolute_error, error = distance(&problem->qp.K, got->u, exact->u);
    CHECK_INT(got->summary.outcome, UZ_CONVERGED);
    CHECK_INT(got->summary.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK_INT(got->summary.factor_nnz, 0);
    CHECK(c->relative_error <= relative_error);
    CHECK_MSG(error <= c->absolute_error + slack, "%g: error %g, certified %g", relative_error, error,
              c->absolute_error);
    /* Within its own share of rounding the bound is not far off either. It is in the norm of the body that nothing
     * touches, which yields more to what is left than one that rows hold. */
    CHECK_MSG(c->absolute_error <= 60.0 * (error + slack) + 1e-11 * c->energy_norm, "certified %g for an error of %g",
              c->absolute_error, error);
    CHECK(c->energy_dual <= exact->summary.certificate.energy_primal + 1e-12 * fabs(c->energy_primal));
    CHECK(c->energy_primal >= exact->summary.certificate.energy_dual - 1e-12 * fabs(c->energy_primal));
    uz_result_free(exact);
    uz_result_free(got);
}

TEST(every_accuracy_is_certified)
{
    uz_problem problem = matrix_problem(60, 20);
    const double asked[] = {1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10};
    for (size_t k = 0; k < sizeof asked / sizeof asked[0]; k++)
        check_against_factor(&problem, UZ_METHOD_AUTO, asked[k]);
    uz_problem_clear(&problem);
}

TEST(iterations_with_inner_iterations)
{
    uz_problem problem = matrix_problem(30, 10);
    check_against_factor(&problem, UZ_METHOD_ACCELERATED_RESTART, 1e-3);
    check_against_factor(&problem, UZ_METHOD_ACCELERATED_RESTART, 1e-7);
    check_against_factor(&problem, UZ_METHOD_CONJUGATE, 1e-3);
    check_against_factor(&problem, UZ_METHOD_CONJUGATE, 1e-7);
    uz_problem_clear(&problem);
}

/* Conjugate steps carry D r along, with all that inner iterations leave: were each step to make more of that, no
 * direction would be one, and steps would seem too long. */
TEST(conjugate_steps_keep_what_inner_iterations_leave_small)
{
    for (int64_t nx = 60; nx <= 120; nx += 30)
        for (int graded = 0; graded < 2; graded++) {
            uz_problem problem = graded ? graded_problem(nx, nx / 3) : scene_problem(nx, nx / 3);
            uz_settings exactly = settings_for(UZ_OPERATOR_CONDENSED, UZ_METHOD_CONJUGATE, 1e-6),
                        freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_CONJUGATE, 1e-6);
            uz_result *want = solve_problem(&problem, &exactly), *got = solve_problem(&problem, &freely);
            CHECK_INT(got->summary.outcome, UZ_CONVERGED);
            CHECK_REL(got->summary.alpha, want->summary.alpha, 1e-3);
            CHECK_MSG(got->summary.iterations <= 4 * want->summary.iterations, "%lld steps for %lld at %lld",
                      (long long)got->summary.iterations, (long long)want->summary.iterations, (long long)nx);
            uz_result_free(want);
            uz_result_free(got);
            uz_problem_clear(&problem);
        }
}

/* Where lambda_max is known of the body, a method that begins at no reactions asks for their gaps first: those of the
 * body without its rows, which an active set by coarser grids does without. */
TEST(iterations_on_a_body_that_is_known_begin_at_its_gaps)
{
    static const uz_method methods[] = {UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_ACCELERATED, UZ_METHOD_CONJUGATE};
    uz_problem problem = scene_problem(30, 10);
    uz_cache *cache = uz_cache_new((size_t)1 << 30);
    for (int k = 0; k < 3; k++)
        for (int again = 0; again < 2; again++) {
            uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, methods[k], 1e-6);
            uz_result *result = NULL;
            uz_error err = {0};
            CHECK_INT(uz_solve(&result, &problem, &s, cache, NULL, &err), UZ_OK);
            CHECK_INT(result->summary.outcome, UZ_CONVERGED);
            CHECK_INT(result->summary.active, 22);
            uz_result_free(result);
        }
    uz_cache_free(cache);
    uz_problem_clear(&problem);
}

/* The least eigenvalue of the preconditioned matrix, with the obstacle's normal along (tilt, 1). */
static double conditioning(double tilt)
{
    uz_problem problem = graded_problem(60, 20);
    uz_settings freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    uz_setup *setup = NULL;
    uz_reuse reused;
    uz_error err = {0};
    problem.scene.contacts[0].normal[0] = tilt;
    CHECK_MSG(uz_setup_acquire(&setup, &reused, NULL, &problem, NULL, &freely, NULL, &err) == UZ_OK, "%s", err.message);
    double lambda = setup->amg->info.lambda;
    CHECK_INT(setup->model.info.n_rotated > 0, tilt != 0);
    uz_setup_release(NULL, setup);
    uz_problem_clear(&problem);
    return lambda;
}

/* Dofs of contact nodes that are turned into normal and tangents take their rigid-body modes with them. */
TEST(oblique_planes_are_preconditioned_as_well)
{
    double straight = conditioning(0), oblique = conditioning(1);
    CHECK_MSG(oblique > 0.7 * straight, "lambda %g beside %g", oblique, straight);
}

/* By the paper's rule the counts are those of the exact operator: no restart where the method has none, no step that
 * what inner iterations leave makes look too long, and the same reactions. */
TEST(the_paper_s_rule_takes_the_iterations_of_the_exact_operator)
{
    static const struct {
        int64_t nx, ny;
        uz_method method;
        int64_t iterations, restarts;
    } runs[] = {{30, 10, UZ_METHOD_ACCELERATED_RESTART, 283, 2},
                {30, 10, UZ_METHOD_ACCELERATED, 684, 0},
                {30, 10, UZ_METHOD_UZAWA, 2872, 0},
                {60, 20, UZ_METHOD_ACCELERATED_RESTART, 263, 2},
                {120, 40, UZ_METHOD_ACCELERATED_RESTART, 361, 1}};
    for (size_t k = 0; k < sizeof runs / sizeof runs[0] - SANITIZED; k++) {
        uz_problem problem = scene_problem(runs[k].nx, runs[k].ny);
        uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, runs[k].method, 1e-2);
        s.stopping = UZ_STOP_PAPER;
        s.epsilon = 1e-6;
        uz_result *freely = solve_problem(&problem, &s);
        s.op = UZ_OPERATOR_CONDENSED;
        uz_result *exact = solve_problem(&problem, &s);
        double most = 0, difference = 0;
        for (int64_t i = 0; freely && exact && i < exact->m; i++) {
            most = fmax(most, fabs(exact->r[i]));
            difference = fmax(difference, fabs(exact->r[i] - freely->r[i]));
        }
        CHECK(freely && exact && difference <= 1e-7 * most);
        if (freely && exact) {
            CHECK_INT(freely->summary.iterations, exact->summary.iterations);
            CHECK_INT(freely->summary.restarts, runs[k].restarts);
            CHECK_REL((double)exact->summary.iterations, (double)runs[k].iterations, 0.02);
        }
        uz_result_free(freely);
        uz_result_free(exact);
        uz_problem_clear(&problem);
    }
}

/* Inner solves within the rule hardly show: the bound is met at the same check of it as with a factor, or the next. */
TEST(inner_tolerances_cost_no_outer_iterations)
{
    uz_problem problem = scene_problem(60, 20);
    uz_settings freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_ACCELERATED_RESTART, 1e-6);
    uz_settings factored = settings_for(UZ_OPERATOR_FACTORED, UZ_METHOD_ACCELERATED_RESTART, 1e-6);
    uz_result *a = solve_problem(&problem, &freely), *b = solve_problem(&problem, &factored);
    CHECK_INT(a->summary.outcome, UZ_CONVERGED);
    CHECK_MSG(a->summary.iterations <= b->summary.iterations + b->summary.iterations / 4, "%lld, factored %lld",
              (long long)a->summary.iterations, (long long)b->summary.iterations);
    CHECK_REL(a->summary.reaction_sum, b->summary.reaction_sum, 1e-4);
    uz_result_free(a);
    uz_result_free(b);
    uz_problem_clear(&problem);
}

TEST(reference_values_of_the_paper)
{
    uz_problem problem = scene_problem(60, 20);
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-10);
    uz_result *result = solve_problem(&problem, &s);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK_INT(result->summary.active, 44);
    CHECK_REL(result->summary.certificate.energy_primal, -3.9620174378e-3, 1e-9);
    CHECK_REL(result->summary.reaction_sum, -10.53866779, 1e-8);
    CHECK(result->summary.iterations < 12);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(obstacles)
{
    qp_random rng = {11};
    for (int k = 0; k < 3; k++) {
        uz_problem problem = problem_of(random_obstacle(&rng, 1600, 1 + k));
        check_against_factor(&problem, UZ_METHOD_AUTO, 1e-8);
        uz_problem_clear(&problem);
    }
}

TEST(general_rows)
{
    qp_random rng = {12};
    for (int k = 0; k < 4; k++) {
        qp_kind kind = {.d = 30, .m = 12, .condition = 1e3, .dependent = false};
        uz_problem problem = problem_of(random_qp(&rng, &kind));
        check_against_factor(&problem, UZ_METHOD_AUTO, 1e-8);
        uz_problem_clear(&problem);
    }
}

TEST(no_contact_and_no_load)
{
    uz_problem problem = matrix_problem(60, 20);
    uz_csc none = {0};
    uz_csc_clear(&problem.qp.N);
    free(problem.qp.h);
    problem.qp.h = NULL;
    problem.qp.N = none;
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-8);
    check_against_factor(&problem, UZ_METHOD_AUTO, 1e-8);
    memset(problem.qp.p, 0, (size_t)problem.qp.K.cols * sizeof *problem.qp.p);
    uz_result *result = solve_problem(&problem, &s);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    for (int64_t j = 0; j < result->d; j++)
        CHECK(result->u[j] == 0.0);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Two planes that a body cannot be between. */
TEST(contradictions_are_proved)
{
    uz_problem problem = matrix_problem(40, 16);
    uz_qp *qp = &problem.qp;
    int64_t m = qp->N.rows, d = qp->N.cols, nnz = qp->N.ptr[d];
    int64_t *row = calloc((size_t)(2 * nnz), sizeof *row), *column = calloc((size_t)(2 * nnz), sizeof *column), at = 0;
    double *value = calloc((size_t)(2 * nnz), sizeof *value), *h = calloc((size_t)(2 * m), sizeof *h);
    uz_csc both = {0};
    uz_error err = {0};
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            for (int side = 0; side < 2; side++) {
                row[at] = qp->N.idx[k] + side * m;
                column[at] = j;
                value[at++] = side ? -qp->N.val[k] : qp->N.val[k];
            }
    for (int64_t i = 0; i < m; i++)
        h[m + i] = -qp->h[i] - 1.0; /* at least 1 beyond what the first allows */
    CHECK(uz_csc_from_triplets(&both, 2 * m, d, at, row, column, value, &err) == UZ_OK);
    uz_csc_clear(&qp->N);
    qp->N = both;
    free(qp->h);
    qp->h = h;
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    s.max_iterations = 3000;
    uz_result *result = solve_problem(&problem, &s);
    CHECK_INT(result->summary.outcome, UZ_INFEASIBLE);
    CHECK(result->ray != NULL);
    uz_result_free(result);
    free(row);
    free(column);
    free(value);
    uz_problem_clear(&problem);
}

TEST(a_cached_body_serves_other_matrices_of_the_same_numbers)
{
    uz_cache *cache = uz_cache_new((size_t)1 << 30);
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-8);
    double first = 0.0;
    for (int k = 0; k < 2; k++) {
        uz_problem problem = matrix_problem(60, 20); /* freed between the solves */
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK_MSG(uz_solve(&result, &problem, &s, cache, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(result->summary.factor_cached, k == 1);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        first = k == 0 ? result->summary.reaction_sum : first;
        CHECK(result->summary.reaction_sum == first);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
    uz_cache_free(cache);
}

/* ------------------------------------------------------------------ limits */

static bool cancelled_at_third(void *ctx)
{
    return ++*(int *)ctx >= 3;
}

TEST(inner_iterations_end_when_told_to)
{
    uz_problem problem = scene_problem(30, 10);
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_ACCELERATED_RESTART, 1e-8);
    uz_result *result = NULL;
    uz_error err = {0};
    int asked = 0;
    uz_hooks hooks = {.ctx = &asked, .cancelled = cancelled_at_third};
    CHECK_INT(uz_solve(&result, &problem, &s, NULL, &hooks, &err), UZ_ERR_CANCELLED);
    CHECK(result == NULL);
    s.max_iterations = 3;
    result = solve_problem(&problem, &s);
    CHECK_INT(result->summary.outcome, UZ_ITERATION_LIMIT);
    CHECK(result->summary.certificate.relative_error > 1e-8);
    uz_result_free(result);
    s.max_iterations = 100000;
    s.time_limit_s = 0.0;
    result = solve_problem(&problem, &s);
    CHECK_INT(result->summary.outcome, UZ_TIME_LIMIT);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

static const uz_cost_option *considered(const uz_summary *s, uz_operator op)
{
    for (int k = 0; k < s->cost.n_considered; k++)
        if (s->cost.considered[k].op == op)
            return &s->cost.considered[k];
    return NULL;
}

/* Rates are measured once, so that the predictions of one program compare. */
static void check_gradient_steps(uz_problem problem)
{
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-8);
    uz_prediction free, steps;
    uz_error err = {0};
    CHECK_INT(uz_predict(&free, &problem, &s, NULL, &err), UZ_OK);
    s.method = UZ_METHOD_ACCELERATED_RESTART;
    CHECK_INT(uz_predict(&steps, &problem, &s, NULL, &err), UZ_OK);
    CHECK(steps.seconds > 4.0 * free.seconds);
    s.method = UZ_METHOD_AUTO;
    s.stopping = UZ_STOP_PAPER;
    CHECK_INT(uz_predict(&free, &problem, &s, NULL, &err), UZ_OK);
    CHECK_REL(free.seconds, steps.seconds, 1e-12);
    uz_problem_clear(&problem);
}

TEST(gradient_steps_without_a_factor_are_known_to_be_many)
{
    check_gradient_steps(graded_problem(30, 10));
    check_gradient_steps(scene_problem(30, 10)); /* by its cells */
}

TEST(what_does_not_fit_goes_on_without_a_factor)
{
    uz_problem problem = graded_problem(90, 30);
    uz_settings s = settings_for(UZ_OPERATOR_AUTO, UZ_METHOD_AUTO, 1e-8);
    uz_result *direct = solve_problem(&problem, &s);
    const uz_cost_option *with = considered(&direct->summary, UZ_OPERATOR_CONDENSED);
    const uz_cost_option *without = considered(&direct->summary, UZ_OPERATOR_MATRIX_FREE);
    CHECK_INT(direct->summary.op, UZ_OPERATOR_CONDENSED);
    CHECK(with && without && with->fits && without->fits && without->bytes < with->bytes);
    s.memory_limit = (size_t)(0.5 * (with->bytes + without->bytes));
    uz_result *freely = solve_problem(&problem, &s);
    CHECK_INT(freely->summary.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK_INT(freely->summary.outcome, UZ_CONVERGED);
    CHECK_REL(freely->summary.reaction_sum, direct->summary.reaction_sum, 1e-6);
    CHECK(!considered(&freely->summary, UZ_OPERATOR_CONDENSED)->fits);
    CHECK(freely->summary.cost.actual_bytes <= (double)s.memory_limit);
    uz_result_free(freely);
    uz_result_free(direct);
    uz_problem_clear(&problem);
}

static void check_refused(const uz_problem *problem, uz_operator op, size_t limit)
{
    uz_settings s = settings_for(op, UZ_METHOD_AUTO, 1e-8);
    uz_result *result = NULL;
    uz_error err = {0};
    s.memory_limit = limit;
    CHECK_INT(uz_solve(&result, problem, &s, NULL, NULL, &err), UZ_ERR_LIMIT);
    CHECK(result == NULL);
    CHECK_MSG(strstr(err.message, "bytes") != NULL, "%s", err.message);
    uz_result_free(result);
}

TEST(what_fits_in_no_form_is_refused)
{
    uz_problem problem = graded_problem(90, 30);
    uz_settings s = settings_for(UZ_OPERATOR_AUTO, UZ_METHOD_AUTO, 1e-8);
    uz_result *result = solve_problem(&problem, &s);
    double with = considered(&result->summary, UZ_OPERATOR_CONDENSED)->bytes;
    double without = considered(&result->summary, UZ_OPERATOR_MATRIX_FREE)->bytes;
    check_refused(&problem, UZ_OPERATOR_AUTO, (size_t)(0.95 * without));
    check_refused(&problem, UZ_OPERATOR_MATRIX_FREE, (size_t)(0.95 * without));
    check_refused(&problem, UZ_OPERATOR_CONDENSED, (size_t)(0.5 * (with + without)));
    check_refused(&problem, UZ_OPERATOR_FACTORED, (size_t)(0.5 * (with + without)));
    check_refused(&problem, UZ_OPERATOR_AUTO, 100000); /* less than the mesh */
    check_refused(&problem, UZ_OPERATOR_AUTO, 1);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Bytes are counted, so the prediction must cover them and not by far. */
TEST(predicted_bytes_cover_what_is_used)
{
    for (int64_t nx = 60; nx <= 120; nx += 30)
        for (int k = 0; k < 4; k++) {
            const uz_operator forms[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE,
                                         UZ_OPERATOR_MATRIX_FREE};
            uz_problem problem = k == 2 ? graded_problem(nx, nx / 3) : scene_problem(nx, nx / 3);
            uz_settings s = settings_for(forms[k], UZ_METHOD_AUTO, 1e-6);
            uz_result *result = solve_problem(&problem, &s);
            const uz_cost *cost = &result->summary.cost;
            CHECK_MSG(cost->bytes >= cost->actual_bytes && cost->bytes <= 2.5 * cost->actual_bytes,
                      "%s at %lld: %g predicted, %g counted", uz_choice_name(UZ_CHOICE_OPERATOR, forms[k]),
                      (long long)nx, cost->bytes, cost->actual_bytes);
            CHECK(cost->seconds > 0.0 && cost->flops > 0.0 && cost->actual_seconds > 0.0);
            CHECK_INT(cost->n_considered, forms[k] == UZ_OPERATOR_MATRIX_FREE ? 1 : 3);
            uz_result_free(result);
            uz_problem_clear(&problem);
        }
}

/* A plate that is pressed on a plane and lifted at its end: a dozen guesses, none of which takes sweeps over the region
 * around the contact, with their copy of K. */
TEST(many_guesses_of_few_rows_take_no_more_room)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(30, 3, 30, 3)};
    uz_scene *scene = &problem.scene;
    uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    scene->model = UZ_SOLID;
    scene->kinematics = UZ_KINEMATICS_FIXED;
    scene->box.dim = 3;
    scene->box.size[2] = 30;
    scene->box.cells[2] = 30;
    snprintf(scene->box.element, sizeof scene->box.element, "tet4");
    scene->materials[0].young = 1000;
    scene->materials[0].poisson = 0.3;
    add_support(scene, "left", 0, 0);
    scene->supports[0].u[2] = 0;
    add_load(scene, "top", 0, -0.02);
    add_load(scene, "right", 0.2, 0.05);
    add_plane(scene, "bottom", 0, -0.02, 0, 1);
    uz_result *result = solve_problem(&problem, &s);
    if (result) {
        const uz_cost *cost = &result->summary.cost;
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_MSG(result->summary.iterations > 9, "%lld iterations", (long long)result->summary.iterations);
        CHECK_MSG(cost->actual_bytes <= cost->bytes, "%g predicted, %g counted", cost->bytes, cost->actual_bytes);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Solids of a hundred thousand dofs with factors of more and more flops: the factor is made while it costs less than
 * two seconds or than twice what the multigrid does, and not beyond; for many load cases while it costs less. */
static void check_dear_factors(int64_t cases)
{
    const uz_cost_size size = {.d = 100000,
                               .m = 1000,
                               .n_b = 1000,
                               .k_entries = 4000000,
                               .n_entries = 1000,
                               .modes = 6,
                               .bounds = true,
                               .entry_s = 1e-9, /* of no machine: sanitizers slow these and not the dense kernel */
                               .cycle_s = 6e-10,
                               .cases = cases};
    int made = 0, spared = 0;
    for (double flops = 1e9; flops < 1e15; flops *= 1.3) {
        const uz_factor_info factor = {.flops = flops, .nnz = 100000000, .bytes = 800000000};
        uz_cost_plan plan;
        uz_cost_decide(&plan, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
        double condensed = 0.0, matrix_free = 0.0;
        for (int k = 0; k < plan.count; k++) {
            const uz_cost_estimate *form = &plan.form[k];
            condensed = form->op == UZ_OPERATOR_CONDENSED ? uz_cost_seconds(form, cases) : condensed;
            matrix_free = form->op == UZ_OPERATOR_MATRIX_FREE ? uz_cost_seconds(form, cases) : matrix_free;
        }
        const bool by_factor = plan.form[plan.chosen].op == UZ_OPERATOR_CONDENSED;
        CHECK_MSG(by_factor == (condensed < fmax(2.0, (cases > 1 ? 1.0 : 2.0) * matrix_free)), "%g flops: %g s, %g s",
                  flops, condensed, matrix_free);
        made += by_factor;
        spared += !by_factor;
    }
    CHECK(made > 0 && spared > 0);
}

TEST(a_factor_that_costs_twice_a_multigrid_is_not_made)
{
    check_dear_factors(1);
    check_dear_factors(50);
}

/* Threads leave what they do not share, which in the plane is more; of forms with a factor, all that loads take. */
TEST(threads_divide_what_they_share)
{
    for (int threads = 1; threads <= 4; threads++) {
        const uz_brick solid = {.axes = 3}, flat = {.axes = 2};
        const double box = uz_cost_shared(1, 1, UZ_OPERATOR_MATRIX_FREE, &solid, threads),
                     plane = uz_cost_shared(1, 1, UZ_OPERATOR_MATRIX_FREE, &flat, threads),
                     mesh = uz_cost_shared(1, 1, UZ_OPERATOR_MATRIX_FREE, NULL, threads),
                     factor = uz_cost_shared(2, 0, UZ_OPERATOR_CONDENSED, NULL, threads);
        CHECK(threads == 1 ? box == 2 && plane == 2 && mesh == 2
                           : 2.0 / threads < box && box <= mesh && mesh < plane && plane < 2);
        CHECK(threads == 1 ? factor == 2 : 2.0 / threads < factor && factor < 2);
        CHECK(uz_cost_shared(0, 2, UZ_OPERATOR_CONDENSED, NULL, threads) == 2);
        CHECK(uz_cost_shared(1, 1, UZ_OPERATOR_DISTRIBUTED, NULL, threads) == 2);
    }
}

/* The same membrane in other units: stiffer, or with larger displacements, and begun with reactions. Nothing but
 * exponents may change. */
TEST(units_do_not_decide)
{
    static const double stiffer[] = {1, 1e13, 1e100, 1e-100}, larger[] = {1, 1e5, 1e-30};
    membrane kind = {8, 28, true, false, false};
    for (int k = 0; k < 4; k++)
        for (int l = 0; l < 3; l++) {
            uz_settings settings = uz_settings_default();
            uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
            uz_error err = {0};
            CHECK(membrane_qp(&problem.qp, &kind, &err) == UZ_OK);
            for (int64_t e = 0; e < problem.qp.K.ptr[problem.qp.K.cols]; e++)
                problem.qp.K.val[e] *= stiffer[k];
            for (int64_t j = 0; j < problem.qp.K.cols; j++)
                problem.qp.p[j] *= stiffer[k] * larger[l];
            for (int64_t i = 0; i < problem.qp.N.rows; i++)
                problem.qp.h[i] *= larger[l];
            settings.op = UZ_OPERATOR_MATRIX_FREE;
            settings.method = UZ_METHOD_ACCELERATED_RESTART;
            settings.max_iterations = 3000;
            uz_result *result = solve_problem(&problem, &settings);
            CHECK_MSG(result && result->summary.outcome == UZ_CONVERGED, "K times %g, u times %g: %s", stiffer[k],
                      larger[l], result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "refused");
            if (result)
                CHECK_REL(result->summary.lambda_max * stiffer[k], 6.4352550088, 1e-4);
            uz_result_free(result);
            uz_problem_clear(&problem);
        }
}

/* psi(r) along the way is that of the problem, from the first row on. */
TEST(the_dual_objective_of_the_history_is_that_of_the_other_forms)
{
    membrane kind = {8, 28, true, false, false};
    uz_settings settings = uz_settings_default();
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_result *results[2] = {NULL, NULL};
    static const uz_operator forms[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_MATRIX_FREE};
    uz_error err = {0};
    CHECK(membrane_qp(&problem.qp, &kind, &err) == UZ_OK);
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    for (int k = 0; k < 2; k++) {
        settings.op = forms[k];
        results[k] = solve_problem(&problem, &settings);
    }
    if (results[0] && results[1]) {
        const uz_history *dense = &results[0]->history, *history = &results[1]->history;
        CHECK_REL(history->rows[0].dual_objective, dense->rows[0].dual_objective, 1e-9);
        CHECK_REL(history->rows[history->count - 1].dual_objective, results[1]->summary.certificate.energy_dual, 1e-7);
    }
    uz_result_free(results[0]);
    uz_result_free(results[1]);
    uz_problem_clear(&problem);
}

/* One block on another, whose top is turned: rows between two meshes, of which some touch. clamped: the lower one is
 * held on the left, too, where rows at the corner have few free dofs. */
static uz_problem pair_problem(bool clamped, double turn)
{
    const box_part a = {{0, 0}, {40, 20}, {40, 20}, "quad4"}, b = {{10, 20}, {20, 20}, {27, 27}, "quad4"};
    uz_scene s = two(UZ_PLANE_STRAIN, UZ_ELASTIC_LINEAR, &a, &b, NULL);
    s.kinematics = UZ_KINEMATICS_FIXED;
    touch(&s, "bbottom", "atop");
    body_hold(&s, "abottom", 0, 0, NAN);
    if (clamped)
        body_hold(&s, "aleft", 0, 0, NAN);
    uz_support *top = body_hold(&s, "btop", 0, -0.02, NAN);
    top->about[0] = 20;
    top->about[1] = 40;
    top->turn[2] = turn;
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = s};
}

/* Which rows touch is guessed between two bodies as on an obstacle: a few solves, each with the rows as equations. */
TEST(rows_between_two_bodies_have_an_active_set)
{
    for (int k = 0; k < 3; k++) {
        const double asked[] = {1e-3, 1e-6, 1e-9};
        uz_problem problem = pair_problem(k == 1, 0.004);
        uz_settings exactly = settings_for(UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 1e-11),
                    freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, asked[k]);
        uz_result *exact = solve_problem(&problem, &exactly), *got = solve_problem(&problem, &freely);
        if (exact && got) {
            const uz_certificate *c = &got->summary.certificate;
            CHECK_INT(got->summary.outcome, UZ_CONVERGED);
            CHECK_INT(got->summary.method, UZ_METHOD_ACTIVE_SET);
            CHECK_MSG(got->summary.iterations <= 12, "%lld guesses", (long long)got->summary.iterations);
            CHECK(c->relative_error <= asked[k]);
            CHECK(exact->summary.active > 3 && exact->summary.active < exact->summary.m);
            CHECK_REL(got->summary.reaction_sum, exact->summary.reaction_sum, 10 * asked[k]);
            CHECK(c->energy_dual <= exact->summary.certificate.energy_primal + 1e-12 * fabs(c->energy_primal));
            CHECK(c->energy_primal >= exact->summary.certificate.energy_dual - 1e-12 * fabs(c->energy_primal));
        }
        uz_result_free(exact);
        uz_result_free(got);
        uz_problem_clear(&problem);
    }
}

/* The matrices of a pair with every second row once more, but for rounding, and closer or farther by so much. */
static uz_problem repeated_pair(double closer)
{
    uz_problem pair = pair_problem(false, 0.004), problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_mesh_info info = {0};
    uz_error err = {0};
    uz_qp *qp = &problem.qp;
    CHECK(uz_scene_to_qp(qp, &info, &pair.scene, &err) == UZ_OK);
    const int64_t m = qp->N.rows, d = qp->N.cols, rows = m + (m + 1) / 2;
    double *N = vector(rows * d), *h = vector(rows);
    memcpy(h, qp->h, (size_t)m * sizeof *h);
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            N[qp->N.idx[k] * d + j] = qp->N.val[k];
    for (int64_t i = 0; i < m; i += 2) {
        for (int64_t j = 0; j < d; j++)
            N[(m + i / 2) * d + j] = (1.0 + 1e-10 * (double)(j % 3)) * N[i * d + j];
        h[m + i / 2] = h[i] + (i % 4 ? closer : -closer);
    }
    uz_csc_clear(&qp->N);
    free(qp->h);
    qp->N = csc_from_dense(N, rows, d, false);
    qp->h = h;
    free(N);
    uz_mesh_info_clear(&info);
    uz_problem_clear(&pair);
    return problem;
}

/* Rows that are the same but for rounding, as of two sides that an obstacle touches beside their common edge, whether
 * they agree or one of them is in the other's way: guesses, too, not tens of thousands of steps. */
TEST(rows_that_depend_on_each_other_have_an_active_set)
{
    static const double closer[] = {0.0, 1e-9, 1e-5};
    for (int k = 0; k < 3; k++) {
        uz_problem problem = repeated_pair(closer[k]);
        uz_settings exactly = settings_for(UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 1e-11),
                    freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, k == 1 ? 1e-10 : 1e-6);
        uz_result *exact = solve_problem(&problem, &exactly), *got = solve_problem(&problem, &freely);
        if (exact && got) {
            CHECK_INT(got->summary.outcome, UZ_CONVERGED);
            CHECK_INT(got->summary.method, UZ_METHOD_ACTIVE_SET);
            CHECK_MSG(got->summary.iterations <= 16, "closer by %g: %lld guesses", closer[k],
                      (long long)got->summary.iterations);
            const double error = distance(&problem.qp.K, got->u, exact->u);
            CHECK_MSG(error <= got->summary.certificate.absolute_error + exact->summary.certificate.absolute_error,
                      "error %g, certified %g", error, got->summary.certificate.absolute_error);
        }
        uz_result_free(exact);
        uz_result_free(got);
        uz_problem_clear(&problem);
    }
}

/* Rows on a random K of which many depend on others. */
typedef enum { COMBINED, WALLS, THROUGH_ZERO, DEPENDENCES } dependence;

static uz_problem dependent_rows(dependence kind, uint64_t seed)
{
    qp_random rng = {7919 * seed + 104729 * (uint64_t)kind + 5};
    const int64_t d = 8 + (int64_t)(seed % 25), m = 2 * (3 + (int64_t)(seed % 7));
    const qp_kind combined = {
        .d = d, .m = m, .condition = pow(10.0, (double)(seed % 5)), .dependent = true, .badly_scaled = seed % 2 > 0};
    if (kind == COMBINED)
        return problem_of(random_qp(&rng, &combined));
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    double *K = random_spd(&rng, d, pow(10.0, (double)(seed % 4)), 10), *N = vector(m * d), *within = vector(d);
    for (int64_t j = 0; j < d; j++) {
        within[j] = random_signed(&rng);
        qp.p[j] = (kind == THROUGH_ZERO ? 1e-12 : 1.0) * 10 * random_signed(&rng);
    }
    for (int64_t i = 0; i < m; i++) {
        double *row = N + i * d;
        for (int64_t j = 0; j < d; j++)
            row[j] = random_unit(&rng) < 0.4 ? random_signed(&rng) : 0;
        row[random_int(&rng, 0, d)] = 1;
        for (int64_t j = 0; i % 2 > 0 && j < d; j++)
            row[j] = (kind == WALLS ? -1.0 : 0.3) * row[j - d];
        for (int64_t j = 0; kind == WALLS && j < d; j++) /* where both walls of a pair leave no room */
            qp.h[i] += row[j] * within[j];
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    free(K);
    free(N);
    free(within);
    return problem_of(qp);
}

/* Guesses come to their end, as far as rounding tells rows from others that they depend on. */
TEST(guesses_of_dependent_rows_end)
{
    static const double asked[] = {1e-6, 1e-9, 1e-12};
    for (dependence kind = COMBINED; kind < DEPENDENCES; kind++)
        for (uint64_t seed = 0; seed < 60; seed++) {
            uz_problem problem = dependent_rows(kind, seed);
            uz_settings freely =
                settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, asked[seed % (sizeof asked / sizeof *asked)]);
            uz_result *got = solve_problem(&problem, &freely);
            if (got) {
                CHECK_INT(got->summary.outcome, UZ_CONVERGED);
                CHECK_MSG(got->summary.iterations < 40, "kind %d, seed %d: %lld iterations", (int)kind, (int)seed,
                          (long long)got->summary.iterations);
            }
            uz_result_free(got);
            uz_problem_clear(&problem);
        }
}

/* A solid of so many cells along a side that is clamped on its left and pulled down to a plane. */
static uz_problem pressed_solid(const char *element, double length, int64_t cells)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(length, 40, cells, cells)};
    uz_scene *scene = &problem.scene;
    scene->model = UZ_SOLID;
    scene->box.dim = 3;
    scene->box.size[2] = 40;
    scene->box.cells[2] = cells;
    snprintf(scene->box.element, sizeof scene->box.element, "%s", element);
    add_support(scene, "left", 0, 0);
    scene->supports[0].u[2] = 0;
    add_load(scene, "top", 0, -0.05);
    add_load(scene, "right", 0.5, 0);
    add_plane(scene, "bottom", 0, 0, 0, 1);
    return problem;
}

/* What is left on such a bar, while it is held, moves it much where it is not: its right guess was solved to a third
 * of what was certified. */
TEST(bars_of_tetrahedra_are_solved_as_well_as_they_are_certified)
{
    uz_problem problem = pressed_solid("tet4", 400, 16);
    uz_settings freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    uz_result *got = solve_problem(&problem, &freely);
    if (got) {
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        CHECK(got->summary.certificate.relative_error <= 1e-6);
    }
    uz_result_free(got);
    uz_problem_clear(&problem);
}

/* Rows on eight-node faces have several entries. On a plane that the nodes begin on, those that touch are closed to
 * nothing, or to what is nothing beside the body: no bound was found there. */
TEST(eight_node_faces_on_a_plane_are_bounded)
{
    uz_problem problem = pressed_solid("hex20", 40, 10);
    uz_settings exactly = settings_for(UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 1e-9),
                freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    uz_result *exact = solve_problem(&problem, &exactly), *got = solve_problem(&problem, &freely);
    if (exact && got) {
        const uz_certificate *c = &got->summary.certificate;
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        CHECK(c->relative_error <= 1e-6);
        CHECK(c->energy_dual <= exact->summary.certificate.energy_primal + 1e-12 * fabs(c->energy_primal));
        CHECK(c->energy_primal >= exact->summary.certificate.energy_dual - 1e-12 * fabs(c->energy_primal));
    }
    uz_result_free(exact);
    uz_result_free(got);
    uz_problem_clear(&problem);
}

/* Long bodies that lie on a plane: what is left on the free dofs is small as the rows hold them, and far from it in the
 * norm of the whole body, which bends. What is missing is found with the same rows as equations. */
TEST(long_bodies_on_a_plane_are_as_good_as_asked)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri6"};
    for (int k = 0; k < 3; k++) {
        uz_problem problem = {
            .kind = UZ_PROBLEM_SCENE,
            .scene = body_scene(UZ_PLANE_STRAIN, ELEMENTS[k], (double[3]){50, 1, 0}, (int64_t[3]){200, 4, 0})};
        uz_scene *s = &problem.scene;
        s->kinematics = UZ_KINEMATICS_FIXED;
        body_hold(s, "left", 0, 0, NAN);
        body_load(s, UZ_LOAD_BODY_FORCE, "all", 0, -0.01, 0);
        body_plane(s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
        uz_settings exactly = settings_for(UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 1e-11),
                    freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-8);
        uz_result *exact = solve_problem(&problem, &exactly), *got = solve_problem(&problem, &freely);
        if (exact && got) {
            const uz_certificate *c = &got->summary.certificate;
            CHECK_MSG(got->summary.outcome == UZ_CONVERGED && c->relative_error <= 1e-8, "%s: %d, %g", ELEMENTS[k],
                      (int)got->summary.outcome, c->relative_error);
            CHECK_INT(got->summary.active, exact->summary.active);
            CHECK_REL(got->summary.reaction_sum, exact->summary.reaction_sum, 1e-7);
            CHECK_REL(c->energy_dual, exact->summary.certificate.energy_dual, 1e-12);
        }
        uz_result_free(exact);
        uz_result_free(got);
        uz_problem_clear(&problem);
    }
}

/* A bar that little but a weak spring holds, on a plane: what is left of it as it is held counts for more than was
 * wanted of the body that is not, so that its guess is solved for again; a guess that is wrong is not, nor does one
 * make more of the digits that another was solved to. */
TEST(guesses_of_weakly_held_bodies_are_solved_as_far_as_it_takes)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE,
                          .scene = body_scene(UZ_SOLID, "tet4", (double[3]){10, 1, 1}, (int64_t[3]){60, 6, 6})};
    uz_scene *s = &problem.scene;
    s->kinematics = UZ_KINEMATICS_FIXED;
    s->materials[0].young = 1;
    body_spring(s, "top", 1e-6, 1e-6, 1e-6);
    body_load(s, UZ_LOAD_TRACTION, "top", 0, -1e-3, 0);
    body_plane(s, "bottom", (double[3]){0, -1e-3, 0}, (double[3]){0, 1, 0});
    uz_settings freely = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    uz_result *got = solve_problem(&problem, &freely);
    if (got) {
        const double error = got->summary.certificate.relative_error;
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        CHECK_INT(got->summary.method, UZ_METHOD_ACTIVE_SET);
        CHECK_MSG(error <= 1e-6 && error > 1e-9, "%g", error);
    }
    uz_result_free(got);
    uz_problem_clear(&problem);
}

/* Of few cells across a factor is a narrow band, which later loads hardly take time on. */
TEST(narrow_plane_boxes_have_a_factor)
{
    const struct {
        int64_t nx, ny, cases;
        uz_body_extent extent;
    } of[] = {{400, 80, 0, UZ_BODY_CELLS},
              {400, 80, 10, UZ_BODY_CELLS},
              {1000, 20, 0, UZ_BODY_CELLS},
              {1000, 20, 10, UZ_BODY_SUPPORTED},
              {8000, 5, 0, UZ_BODY_SUPPORTED}};
    const uz_settings s = uz_settings_default();
    for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
        uz_problem problem = scene_problem(of[k].nx, of[k].ny);
        problem.n_cases = of[k].cases;
        CHECK_INT(uz_setup_extent(&problem, &s), of[k].extent);
        problem.n_cases = 0;
        uz_problem_clear(&problem);
    }
}

/* A certificate's correction between two solves for the same rows leaves the forces alone that the second begins with.
 */
TEST(the_same_rows_have_the_same_answer_after_a_correction)
{
    uz_problem problem = scene_problem(200, 66);
    const uz_settings s = settings_for(UZ_OPERATOR_MATRIX_FREE, UZ_METHOD_AUTO, 1e-6);
    const uz_stop stop = {.deadline = INFINITY};
    uz_setup *setup = NULL;
    uz_dual_load *load = NULL;
    uz_reuse reused;
    uz_error err = {0};
    CHECK_INT(uz_setup_acquire(&setup, &reused, NULL, &problem, NULL, &s, NULL, &err), UZ_OK);
    const int64_t m = setup->dual->m, d = setup->dual->d;
    double *p = vector(d), *h = vector(m), *r = vector(m), *none = vector(m), *u[] = {vector(d), vector(d)};
    double bound, most = 0.0;
    bool *held = malloc((size_t)m * sizeof *held);
    for (int64_t j = 0; j < d; j++)
        p[j] = sin(0.1 * (double)j);
    CHECK(uz_dual_load_create(&load, setup->dual, uz_setup_K(setup, &problem), p, h, &err) == UZ_OK);
    load->equations = true;
    CHECK(uz_dual_load_aim(load, 1e-6, &stop, &err) == UZ_OK);
    for (int k = 0; k < 2; k++) {
        uz_active_end end;
        double *g = vector(m);
        memset(held, true, (size_t)m * sizeof *held);
        CHECK(uz_dual_load_solve_active(load, &end, r, g, held, &err) == UZ_OK);
        CHECK_INT(end, UZ_ACTIVE_SOLVED);
        CHECK(uz_dual_load_recover(load, u[k], r, false, &err) == UZ_OK);
        /* of the body without reactions, whose gaps are all to be closed */
        CHECK(uz_dual_load_apply(load, g, none, &err) == UZ_OK);
        memset(held, true, (size_t)m * sizeof *held);
        CHECK(uz_dual_load_correct(load, &bound, INFINITY, none, load->g0, held, &err) == UZ_OK);
        CHECK(isfinite(bound));
        free(g);
    }
    for (int64_t j = 0; j < d; j++)
        most = fmax(most, fabs(u[0][j] - u[1][j]));
    CHECK_MSG(most <= 1e-4 * uz_long_max(d, u[0]), "%g of %g", most, uz_long_max(d, u[0]));
    free(p);
    free(h);
    free(r);
    free(none);
    free(u[0]);
    free(u[1]);
    free(held);
    uz_dual_load_free(load);
    uz_setup_release(NULL, setup);
    uz_problem_clear(&problem);
}
