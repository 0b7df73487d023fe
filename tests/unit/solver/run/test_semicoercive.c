/* Scenes that only the obstacle holds: solved where the loads press them on, refused by name where they do not. The
 * references are analytic, or every active set there is. */
#include "semicoercive_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_thread_init();
}

/* A block on the floor at y = -gap, its left side on rollers: nothing else holds it from moving up or down. */
static uz_scene rolled_block(int64_t nx, int64_t ny, double gap, double push)
{
    uz_scene scene = box_scene(60, 20, nx, ny);
    add_support(&scene, "left", 0, (double)NAN);
    add_load(&scene, "top", 0, push);
    add_plane(&scene, "bottom", 0, -gap, 0, 1);
    return scene;
}

static uz_problem problem_in(uz_scene scene)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = scene};
}

/* -------------------------------------------------------------------- scenes */

/* Uniform stress -q in y: the reactions are the shares of the nodes, the energy q^2 V / 2E. */
static void check_uniform(double gap, uz_operator op)
{
    const double q = 0.05, young = 200e3;
    uz_problem problem = problem_in(rolled_block(30, 10, gap, -q));
    uz_settings settings = uz_settings_default();
    settings.op = op;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        const uz_summary *s = &result->summary;
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), "converged");
        CHECK(s->certificate.relative_error <= 1e-8);
        CHECK_REL(s->certificate.energy_norm * s->certificate.energy_norm, q * q * 6000 / young, 1e-7);
        CHECK_REL(s->certificate.energy_primal, -0.5 * q * q * 6000 / young - 15 * gap, 1e-7);
        CHECK(s->semicoercive.free_modes == 1 && s->semicoercive.held == 31 && s->semicoercive.rounds >= 2);
        CHECK_INT(s->active, 31);
        CHECK_REL(s->force[1], 15.0, 1e-7);
        CHECK_REL(s->max_pressure, q, 1e-7);
        for (int64_t i = 0; i < 31; i++)
            CHECK_REL(result->r[i], i == 0 || i == 30 ? -0.25 : -0.5, 1e-6);
        for (int64_t a = 0; a < result->n_nodes; a++)
            CHECK(fabs(result->u[2 * a + 1] + gap + q / young * result->mesh.xyz[2 * a + 1]) < 1e-12);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(pressed_block_rests_on_the_floor)
{
    check_uniform(0, UZ_OPERATOR_AUTO);
    check_uniform(0, UZ_OPERATOR_FACTORED);
    check_uniform(1e-3, UZ_OPERATOR_CONDENSED);
}

/* Between floor and ceiling with room for both, and nothing that moves it either way: no answer is the only one. */
TEST(loose_block_is_said_to_be_loose)
{
    uz_problem problem = problem_in(rolled_block(6, 2, 0.1, 0));
    uz_settings settings = uz_settings_default();
    add_plane(&problem.scene, "top", 0, 20.1, 0, -1);
    uz_result *result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_LOOSE);
    CHECK(result && strstr(result->summary.message, "may lie anywhere"));
    uz_result_free(result);
    problem.scene.loads[0].v[1] = -0.05;
    result = solve_problem(&problem, &settings);
    CHECK(result && result->summary.outcome == UZ_CONVERGED);
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* No support at all: two walls and a floor. */
TEST(corner_holds_a_block_without_supports)
{
    uz_scene scene = box_scene(60, 20, 12, 4);
    add_load(&scene, "top", 0, -0.05);
    add_load(&scene, "right", -0.1, 0);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    add_plane(&scene, "left", 0, 0, 1, 0);
    uz_problem problem = problem_in(scene);
    uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK_INT(result->summary.semicoercive.free_modes, 3);
        CHECK_REL(result->summary.force[0], 10.0, 1e-7);
        CHECK_REL(result->summary.force[1], 15.0, 1e-7);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* The paper's body with its left side on rollers, a shear on the right that tilts it up: some rows open. Every active
 * set of a coarse grid is tried. */
TEST(tilted_body_is_that_of_the_exhaustive_search)
{
    uz_scene scene = rolled_block(6, 2, 0, -0.05);
    add_load(&scene, "right", 0.5, 0.11);
    uz_problem problem = problem_in(scene);
    uz_settings settings = uz_settings_default();
    uz_body_model model;
    uz_error err = {0};
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_HELD, &err) == UZ_OK);
    uz_qp qp = {.K = model.K, .N = model.N, .p = vector(model.d), .h = vector(model.m)};
    CHECK(uz_body_model_load(qp.p, qp.h, NULL, &model, &scene, &err) == UZ_OK);
    exhaustive exact = search_all_above(&qp, 1e-6); /* K's entries are of 1e6 and rounded */
    CHECK(exact.exists && exact.strict && exact.set != 0x7f);
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        const uz_certificate *c = &result->summary.certificate;
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK_INT(result->summary.active, __builtin_popcount(exact.set));
        double *u = vector(model.d);
        for (int64_t k = 0; k < 2 * result->n_nodes; k++)
            if (model.dof[k] >= 0)
                u[model.dof[k]] = result->u[k];
        CHECK_MSG(error_of(&exact, u) <= c->absolute_error, "error %g, bound %g", error_of(&exact, u),
                  c->absolute_error);
        CHECK_REL(c->energy_primal, energy_of(&exact, &qp), 1e-10);
        free(u);
    }
    uz_result_free(result);
    exhaustive_free(&exact);
    free(qp.p);
    free(qp.h);
    uz_body_model_clear(&model);
    uz_problem_clear(&problem);
}

TEST(balanced_accuracy_is_a_share_of_the_mesh_error)
{
    uz_scene scene = rolled_block(18, 6, 0, -0.05);
    add_load(&scene, "right", 0.5, 0.1);
    uz_problem problem = problem_in(scene);
    uz_settings settings = uz_settings_default();
    settings.balanced = true;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK(result->summary.discretization_error > 0.01);
        CHECK_REL(result->summary.requested_error, 0.1 * result->summary.discretization_error, 1e-3);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

static void expect_scene_refused(uz_scene scene, const char *where, const char *says)
{
    uz_problem problem = problem_in(scene);
    uz_error err = {0};
    CHECK_INT(uz_scene_check(&scene, &err), UZ_ERR_FREE_BODY);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, says) != NULL, "\"%s\" lacks \"%s\"", err.message, says);
    expect_refusal(&problem, UZ_ERR_FREE_BODY, where, says);
    uz_problem_clear(&problem);
}

TEST(scene_that_leaves_its_obstacle_is_refused_with_the_motion)
{
    expect_scene_refused(rolled_block(6, 2, 0, 0.05), "/loads", "push the body away: translation along +y");
    expect_scene_refused(rolled_block(6, 2, 0, 0), "/loads", "translation along +y costs nothing");
    uz_scene slides = box_scene(60, 20, 6, 2);
    add_load(&slides, "top", 0, -0.05);
    add_plane(&slides, "bottom", 0, 0, 0, 1);
    expect_scene_refused(slides, "/supports", "supports and obstacles leave translation along x free");
    /* On the floor and against the wall, but the top is pulled off the wall harder than the bottom is pressed on. */
    uz_scene tips = box_scene(20, 60, 2, 6);
    add_load(&tips, "right", 0.5, 0);
    add_load(&tips, "top", 0, -0.05);
    add_plane(&tips, "bottom", 0, 0, 0, 1);
    add_plane(&tips, "left", 0, 0, 1, 0);
    expect_scene_refused(tips, "/loads", "push the body away");
    /* Nothing touches sideways: the obstacle holds one of three motions only. */
    uz_scene alone = box_scene(60, 20, 6, 2);
    add_load(&alone, "top", 0, -0.05);
    expect_scene_refused(alone, "/supports", "translation along x, translation along y, rotation");
}

/* A plane at 45 degrees and the wall hold what the floor alone does not. */
TEST(oblique_plane_holds)
{
    uz_scene scene = box_scene(20, 20, 4, 4);
    add_load(&scene, "top", 0, -1);
    add_load(&scene, "right", -0.5, 0);
    add_plane(&scene, "bottom", 0, 0, 2e-4, 1);
    add_plane(&scene, "left", 0, 0, 1, 1e-4);
    uz_problem problem = problem_in(scene);
    uz_settings settings = uz_settings_default();
    settings.relative_error = 1e-6;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK_REL(result->summary.force[0], 50.0, 1e-5);
        CHECK_REL(result->summary.force[1], 100.0, 1e-5);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(no_time_and_no_iterations_are_outcomes)
{
    uz_problem problem = problem_in(rolled_block(6, 2, 0, -0.05));
    uz_settings settings = uz_settings_default();
    settings.time_limit_s = 0;
    uz_result *result = solve_problem(&problem, &settings);
    CHECK_STR(result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "", "time_limit");
    CHECK(result && result->n_nodes == 21 && isinf(result->summary.certificate.relative_error));
    uz_result_free(result);
    settings = uz_settings_default();
    settings.max_iterations = 0;
    result = solve_problem(&problem, &settings);
    CHECK_STR(result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "", "iteration_limit");
    uz_result_free(result);
    uz_problem_clear(&problem);
}

TEST(every_method_gives_the_certified_answer)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_CONJUGATE, UZ_METHOD_ACTIVE_SET};
    for (size_t k = 0; k < 5; k++) {
        uz_scene scene = rolled_block(6, 2, 0, -0.05);
        add_load(&scene, "right", 0.5, 0.11);
        uz_problem problem = problem_in(scene);
        uz_settings settings = uz_settings_default();
        settings.method = methods[k];
        settings.relative_error = 1e-6;
        uz_result *result = solve_problem(&problem, &settings);
        CHECK_STR(result ? uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome) : "", "converged");
        CHECK_INT(result ? result->summary.method : 0, methods[k]);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* -------------------------------------------------------------------- load cases */

static uz_load_case pushing(const char *name, double push)
{
    uz_load_case one = {.n_loads = 1};
    snprintf(one.name, sizeof one.name, "%s", name);
    one.loads = calloc(1, sizeof *one.loads);
    if (!one.loads)
        abort();
    snprintf(one.loads->on, sizeof one.loads->on, "top");
    one.loads->v[1] = push;
    return one;
}

/* Each load is solved by itself: one that does not press the body on leaves the others their answers, and where none
 * does the first is named. */
TEST(load_cases_of_a_floating_block)
{
    uz_problem problem = problem_in(rolled_block(12, 4, 0, -1));
    uz_settings settings = uz_settings_default();
    uz_result **results = NULL;
    uz_error err = {0};
    problem.n_cases = 3;
    problem.cases = calloc(3, sizeof *problem.cases);
    if (!problem.cases)
        abort();
    for (int k = 0; k < 3; k++)
        problem.cases[k] = pushing(k == 0 ? "a" : k == 1 ? "b" : "c", -1.0 - k);
    CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    for (int64_t k = 0; results && k < 3; k++) {
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, results[k]->summary.outcome), "converged");
        CHECK_REL(results[k]->summary.force[1], 300.0 * (double)(k + 1), 1e-7);
    }
    uz_results_free(results, 3);
    problem.cases[1].loads->v[1] = 1;
    CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    for (int64_t k = 0; results && k < 3; k++) {
        const uz_summary *told = &results[k]->summary;
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, told->outcome), k == 1 ? "unheld" : "converged");
        CHECK(k == 1 ? strstr(told->message, "translation along +y") != NULL && isnan(results[k]->u[0])
                     : fabs(told->force[1] - 300.0 * (double)(k + 1)) < 1e-5);
    }
    uz_results_free(results, 3);
    for (int64_t k = 0; k < 3; k++)
        problem.cases[k].loads->v[1] = 1;
    CHECK_INT(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err), UZ_ERR_FREE_BODY);
    CHECK(results == NULL);
    CHECK_STR(err.where, "/cases/0/loads");
    CHECK(strstr(err.message, "translation along +y"));
    uz_problem_clear(&problem);
}
