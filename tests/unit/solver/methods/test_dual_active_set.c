/* Exchanges with an updated factor, by reactions and by gaps: exact answers, long beams and wide plates, on which all
 * wrong rows can't change places at once, and what `auto` does there. */
#include "chen_harker.h"
#include "harness.h"
#include "judge.h"
#include "qp_fixture.h"
#include "sanitized.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

static const uz_operator both_operators[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED};

/* Small random problems, each second one with rows that repeat others or pass through one point. */
TEST(answers_are_exact)
{
    qp_random rng = {41};
    for (int k = 0; k < 40; k++) {
        const int64_t m = 4 + k % 9, d = 6 + k % 5;
        uz_qp qp = random_qp(&rng, &(qp_kind){.d = d, .m = m, .condition = 1e2});
        for (int64_t j = 0; k % 2 && j < d; j++) /* the last row becomes the first one */
            for (int64_t e = qp.N.ptr[j]; e < qp.N.ptr[j + 1]; e++)
                if (qp.N.idx[e] == m - 1 && e > qp.N.ptr[j] && qp.N.idx[qp.N.ptr[j]] == 0)
                    qp.N.val[e] = qp.N.val[qp.N.ptr[j]];
        qp.h[m - 1] = k % 2 ? qp.h[0] : qp.h[m - 1];
        uz_problem problem = problem_of(qp);
        truth t = find_truth(&problem.qp, NULL);
        for (size_t op = 0; op < 2; op++) {
            uz_settings settings = uz_settings_default();
            settings.method = UZ_METHOD_DUAL_ACTIVE_SET;
            settings.op = both_operators[op];
            uz_result *result = solve_problem(&problem, &settings);
            if (!result)
                continue;
            judgement j = judge(&t, &problem.qp, result, result->u);
            CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "problem %d: %s", k, result->summary.message);
            CHECK_MSG(j.verdict != JUDGED_WRONG, "problem %d: %s", k, j.why);
            uz_result_free(result);
        }
        truth_clear(&t);
        uz_problem_clear(&problem);
    }
}

/* A beam of height 1, clamped at its left end, pressed on a plane. */
typedef struct {
    const char *element;
    double length, load, gap;
    int64_t cells, layers;
    bool both_sides;
} beam;

static uz_problem beam_problem(const beam *b)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(b->length, 1, b->cells, b->layers)};
    uz_scene *scene = &problem.scene;
    scene->model = UZ_PLANE_STRAIN;
    scene->thickness = 1;
    snprintf(scene->box.element, sizeof scene->box.element, "%s", b->element);
    add_support(scene, "left", 0, 0);
    add_load(scene, "top", 0, -b->load);
    add_plane(scene, "bottom", 0, -b->gap, 0, 1);
    if (b->both_sides) {
        add_plane(scene, "top", 0, 1 + b->gap, 0, -1);
        add_load(scene, "right", 0, 200 * b->load);
    }
    return problem;
}

/* By number k: lengths of 100 to 2,000, 25 to 200 cells, loads under which hardly any rows touch, or nearly all. */
static beam generated_beam(qp_random *rng, int k)
{
    static const char *const elements[] = {"quad4", "quad8", "tri6"};
    const double length = 100.0 * pow(20.0, 0.5 * (1.0 + random_signed(rng))), slender = length / 100.0;
    const double load = 1e-2 / (slender * slender * slender) * pow(10.0, 1.0 + random_signed(rng));
    return (beam){elements[k % 3], length, load, 0.05 * slender, random_int(rng, 25, 200), 1 + k % 2, k % 4 == 3};
}

/* The answer of `auto` and of the method by name, on both forms. */
TEST(generated_beams_are_solved)
{
    qp_random rng = {42};
    for (int k = 0; k < 12; k += step_of_cases()) {
        const beam b = generated_beam(&rng, k);
        uz_problem problem = beam_problem(&b);
        double energy = NAN;
        for (int way = 0; way < 3; way++) {
            uz_settings settings = uz_settings_default();
            settings.method = way == 0 ? UZ_METHOD_AUTO : UZ_METHOD_DUAL_ACTIVE_SET;
            settings.op = way == 0 ? UZ_OPERATOR_AUTO : both_operators[way - 1];
            uz_result *result = solve_problem(&problem, &settings);
            if (!result)
                continue;
            const uz_summary *s = &result->summary;
            CHECK_MSG(s->outcome == UZ_CONVERGED, "%s %g x 1, %lld cells, load %g, way %d: %s", b.element, b.length,
                      (long long)b.cells, b.load, way, s->message);
            CHECK_MSG(s->iterations < 1000, "%s %g x 1, way %d: %lld iterations", b.element, b.length, way,
                      (long long)s->iterations);
            if (way > 0) /* relative errors of 1e-8 are of 1e-16 in energy, but for the factor's own */
                CHECK_REL(s->certificate.energy_primal, energy, 1e-9);
            energy = s->certificate.energy_primal;
            uz_result_free(result);
        }
        uz_problem_clear(&problem);
    }
}

/* Rows of slender bodies that come to touch or come off one by one are found by an interior point, at once: held at one
 * end, and between two planes. Guesses that come back to one that was wrong are not solved again (eight steps). */
TEST(long_beams_take_few_steps)
{
    static const beam beams[] = {{"quad4", 1000, 1e-3, 0.01, 800, 2, false},
                                 {"quad8", 1000, 1e-4, 0.5, 300, 1, false},
                                 {"quad8", 1000, 1e-4, 0.5, 200, 1, true}};
    for (size_t k = 0; k < sizeof beams / sizeof beams[0]; k++) {
        uz_problem problem = beam_problem(&beams[k]);
        uz_settings settings = uz_settings_default();
        settings.relative_error = 1e-8;
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            const uz_summary *s = &result->summary;
            CHECK_MSG(s->outcome == UZ_CONVERGED, "beam %d: %s", (int)k, s->message);
            CHECK_MSG(s->iterations <= 6, "beam %d took %lld steps", (int)k, (long long)s->iterations);
        }
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
}

/* Without a factor each step is a linear solve: the number of wrong rows goes up and down for more steps than patience
 * lasts, and one row at a time took 439 of them. */
TEST(slender_solids_take_few_solves)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(350, 2, 350, 2)};
    uz_scene *scene = &problem.scene;
    uz_settings settings = uz_settings_default();
    scene->model = UZ_SOLID;
    scene->box.dim = 3;
    scene->box.size[2] = 2;
    scene->box.cells[2] = 2;
    snprintf(scene->box.element, sizeof scene->box.element, "hex8");
    scene->materials[0].young = 1000;
    scene->materials[0].poisson = 0.3;
    add_support(scene, "left", 0, 0);
    scene->supports[0].u[2] = 0;
    add_load(scene, "right", 0.01, 0.001);
    add_load(scene, "top", 0, -0.0005);
    add_plane(scene, "bottom", 0, -0.0001, 0, 1);
    settings.op = UZ_OPERATOR_MATRIX_FREE;
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
        CHECK_MSG(result->summary.iterations < 30, "%lld iterations", (long long)result->summary.iterations);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* Guesses that are seen to be wrong, or whose rows pull, are not bounded while others come: where none may come any
 * more, the last one is, by each step nearer. */
TEST(a_limit_ends_with_the_last_guess)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(40, 3, 40, 3)};
    uz_scene *scene = &problem.scene;
    uz_settings settings = uz_settings_default();
    scene->model = UZ_SOLID;
    scene->box.dim = 3;
    scene->box.size[2] = 6;
    scene->box.cells[2] = 6;
    snprintf(scene->box.element, sizeof scene->box.element, "hex8");
    scene->materials[0].young = 1000;
    scene->materials[0].poisson = 0.3;
    add_support(scene, "left", 0, 0);
    scene->supports[0].u[2] = 0;
    add_load(scene, "top", 0, -0.02);
    add_load(scene, "right", 0.1, 0.01);
    add_plane(scene, "bottom", 0, 0, 0, 1);
    settings.op = UZ_OPERATOR_MATRIX_FREE;
    for (int64_t limit = 1; limit <= 2; limit++) {
        settings.max_iterations = limit;
        uz_result *result = solve_problem(&problem, &settings);
        if (result) {
            const uz_summary *s = &result->summary;
            CHECK_INT(s->outcome, UZ_ITERATION_LIMIT);
            CHECK_MSG(s->certificate.relative_error < 2 * pow(0.1, (double)limit - 1), "%lld: %g", (long long)limit,
                      s->certificate.relative_error);
        }
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}

/* Nearly all rows touch: they come off one by one. Few do: they come to touch one by one. */
TEST(steps_are_those_of_the_shorter_way)
{
    static const beam pressed = {"quad4", 1000, 1e-3, 0.01, 400, 2, false},
                      lifted = {"quad4", 1000, 1e-6, 0.5, 300, 4, false};
    for (int k = 0; k < 2; k++) {
        uz_problem problem = beam_problem(k == 0 ? &pressed : &lifted);
        for (size_t op = 0; op < 2; op++) {
            uz_settings settings = uz_settings_default();
            settings.method = UZ_METHOD_DUAL_ACTIVE_SET;
            settings.op = both_operators[op];
            uz_result *result = solve_problem(&problem, &settings);
            if (!result)
                continue;
            const uz_summary *s = &result->summary;
            const int64_t open = result->m - s->active, least = open < s->active ? open : s->active;
            CHECK_MSG(s->outcome == UZ_CONVERGED, "%s", s->message);
            CHECK_MSG(5 * least < result->m, "%lld of %lld rows", (long long)s->active, (long long)result->m);
            CHECK_MSG(s->iterations <= 2 * least + 10, "%lld of %lld rows took %lld steps", (long long)s->active,
                      (long long)result->m, (long long)s->iterations);
            uz_result_free(result);
        }
        uz_problem_clear(&problem);
    }
}

/* Signs of weakly active rows are rounding on CHENHARK, so that no guess is ever without wrong rows: the last one is
 * certified all the same, before anything else is tried. */
TEST(a_last_guess_that_is_right_is_certified)
{
    uz_qp qp;
    uz_error err;
    CHECK_INT(chen_harker_qp(&qp, 1000, 500, 200, &err), UZ_OK);
    uz_problem problem = problem_of(qp);
    const uz_settings settings = uz_settings_default();
    uz_result *result = solve_problem(&problem, &settings);
    if (result) {
        double worst = 0;
        for (int64_t j = 0; j < 1000; j++)
            worst = fmax(worst, fabs(result->u[j] - (j < 500 ? 1 : 0)));
        CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
        CHECK_MSG(result->summary.iterations < 60, "%lld iterations", (long long)result->summary.iterations);
        CHECK_MSG(worst < 1e-6, "off by %g", worst);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

/* More rows with several entries than the exchange of the active set takes on, many of them in contact, and iterations
 * that bound nothing: |u_j - u_j+1| <= h on soft springs. The form stays, the method is found while it runs. */
TEST(many_dependent_rows_are_exchanged_in_the_end)
{
    enum { D = 560 };
    uz_qp qp = {.p = vector(D), .h = vector(2 * (D - 1))};
    uz_error err;
    CHECK_INT(uz_csc_init(&qp.K, D, D, D, &err), UZ_OK);
    CHECK_INT(uz_csc_init(&qp.N, 2 * (D - 1), D, 4 * (D - 1), &err), UZ_OK);
    for (int64_t j = 0, at = 0; j < D; j++) {
        qp.K.idx[j] = (int32_t)j;
        qp.K.val[j] = 1;
        qp.K.ptr[j + 1] = j + 1;
        for (int64_t i = j - 1; i <= j; i++)
            for (int64_t side = 0; i >= 0 && i < D - 1 && side < 2; side++, at++) {
                qp.N.idx[at] = (int32_t)(2 * i + side);
                qp.N.val[at] = (i == j) == (side == 0) ? 1 : -1;
            }
        qp.N.ptr[j + 1] = at;
        qp.p[j] = sin(0.02 * (double)j) + (j % 7 == 0 ? 0.5 : 0);
    }
    for (int64_t i = 0; i < 2 * (D - 1); i++)
        qp.h[i] = 0.004;
    uz_problem problem = problem_of(qp);
    for (size_t op = 0; op < 2; op++) {
        uz_settings settings = uz_settings_default();
        settings.op = both_operators[op];
        uz_result *result = solve_problem(&problem, &settings);
        CHECK_MSG(result && result->summary.outcome == UZ_CONVERGED, "%s",
                  result ? result->summary.message : "no result");
        uz_result_free(result);
    }
    uz_problem_clear(&problem);
}
