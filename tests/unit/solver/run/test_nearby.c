/* Where load cases begin: sums of answers to others, and what whole solves make of them. */
#include "run/nearby.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

enum { D = 40, M = 7 };

/* Load number k of a plane: a(k) x + b(k) y, with h of its own that all share. */
static void make_load(double p[D], double h[M], double a, double b)
{
    for (int j = 0; j < D; j++)
        p[j] = 1e6 * (a * sin(j + 1.0) + b * cos(3.0 * j));
    for (int i = 0; i < M; i++)
        h[i] = 1e-6 * (i + 1);
}

TEST(shares_sum_up_to_the_load)
{
    uz_nearby *nearby = uz_nearby_new(30, D, M);
    double p[D], h[M];
    uz_nearby_sum sum;
    qp_random rng = {5};
    double a[30], b[30];
    for (int k = 0; k < 30; k++) {
        make_load(p, h, a[k] = 1 + 0.05 * random_signed(&rng), b[k] = 2 + 0.05 * random_signed(&rng));
        uz_nearby_place(nearby, k, p, h);
        const bool found = uz_nearby_find(&sum, nearby, k, 0.1);
        CHECK_INT(found, k > 0);
        double whole = 0, of_a = 0, of_b = 0;
        for (int q = 0; found && q < sum.count; q++) {
            CHECK(sum.of[q] < k);
            whole += sum.share[q];
            of_a += sum.share[q] * a[sum.of[q]];
            of_b += sum.share[q] * b[sum.of[q]];
        }
        CHECK_INT(sum.count, k < UZ_NEARBY_MOST ? k : UZ_NEARBY_MOST);
        if (k >= 3) { /* three numbers tell a load: a, b, and h */
            CHECK_REL(whole, 1.0, 1e-6);
            CHECK_REL(of_a, a[k], 1e-6);
            CHECK_REL(of_b, b[k], 1e-6);
        }
        uz_nearby_answered(nearby, k);
    }
    uz_nearby_free(nearby);
}

/* Loads that have nothing in common, that are far apart, that are no numbers, or none: there is nothing near. */
TEST(what_is_far_is_no_start)
{
    uz_nearby *nearby = uz_nearby_new(6, D, M);
    double p[D], h[M];
    uz_nearby_sum sum;
    for (int k = 0; k < 6; k++) {
        make_load(p, h, k == 0 || k == 3 ? 1 : 0, k == 1 ? 1 : k == 2 ? 100 : 0);
        for (int j = 0; j < D && k == 4; j++)
            p[j] = NAN;
        for (int i = 0; i < M && k == 5; i++)
            p[i] = h[i] = 0;
        uz_nearby_place(nearby, k, p, h);
        CHECK_INT(uz_nearby_find(&sum, nearby, k, 0.1), k == 3);
        uz_nearby_answered(nearby, k);
    }
    uz_nearby_free(nearby);
}

/* Five times a load has five times its answer, whichever rows press. */
TEST(directions_tell_what_is_near)
{
    uz_nearby *nearby = uz_nearby_new(3, D, M);
    double p[D], h[M];
    uz_nearby_sum sum;
    for (int k = 0; k < 3; k++) {
        make_load(p, h, k < 2 ? 5 : 1, k < 2 ? 10 * (1 - k) : 2);
        for (int i = 0; i < M && k == 2; i++)
            h[i] /= 5;
        uz_nearby_place(nearby, k, p, h);
        if (k == 2) {
            CHECK(uz_nearby_find(&sum, nearby, k, 1e-4));
            for (int q = 0; q < sum.count; q++)
                CHECK(fabs(sum.share[q] - (sum.of[q] == 0 ? 0.2 : 0.0)) < 1e-5);
        }
        uz_nearby_answered(nearby, k);
    }
    uz_nearby_free(nearby);
}

/* A cube on a plane, pulled aside and pressed, of which K is not assembled, or is. */
static uz_problem cube(const char *element, int64_t cells, double depth, int cases)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(40, 40, cells, cells)};
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
    add_plane(scene, "bottom", 0, -depth, 0, 1);
    problem.cases = calloc((size_t)cases, sizeof *problem.cases);
    problem.n_cases = cases;
    for (int i = 0; i < cases; i++) {
        uz_load_case *c = &problem.cases[i];
        c->n_loads = 2;
        c->loads = malloc(2 * sizeof *c->loads);
        memcpy(c->loads, scene->loads, 2 * sizeof *c->loads);
        snprintf(c->name, sizeof c->name, "%d", i);
    }
    return problem;
}

static uz_result **solve_all(const uz_problem *problem, uz_operator op, double relative_error)
{
    uz_settings settings = uz_settings_default();
    uz_result **results = NULL;
    uz_error err = {0};
    settings.op = op;
    settings.relative_error = relative_error;
    CHECK_MSG(uz_solve_cases(&results, problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    return results;
}

/* The same load again is answered by its answer: one guess of the rows, which is right. Where rows change on the way
 * from case to case each answer is within its bound of that of a factor; turning: pull becomes push in every other one,
 * so that the rows of those before are of no use. */
static void check_cases(const char *element, double depth, bool turning)
{
    enum { CASES = 9 };
    uz_problem problem = cube(element, 8, depth, CASES);
    for (int i = 0; i < CASES; i++) { /* the last one is that before it */
        problem.cases[i].loads[0].v[1] *= 1 + 0.5 * sin(0.3 * (i < CASES - 1 ? i : i - 1));
        problem.cases[i].loads[1].v[0] *= 1 + 0.5 * cos(0.2 * (i < CASES - 1 ? i : i - 1));
        if (turning && (i < CASES - 1 ? i : i - 1) % 2 == 0)
            problem.cases[i].loads[1].v[0] *= -1;
    }
    uz_result **exact = solve_all(&problem, UZ_OPERATOR_CONDENSED, 1e-10),
              **got = solve_all(&problem, UZ_OPERATOR_MATRIX_FREE, 1e-6);
    int64_t guesses = 0;
    for (int i = 0; exact && got && i < CASES; i++) {
        const uz_certificate *c = &got[i]->summary.certificate, *sure = &exact[i]->summary.certificate;
        CHECK_INT(got[i]->summary.outcome, UZ_CONVERGED);
        CHECK_INT(got[i]->summary.op, UZ_OPERATOR_MATRIX_FREE);
        CHECK(c->relative_error <= 1e-6);
        CHECK(c->energy_dual <= sure->energy_primal + 1e-12 * fabs(c->energy_primal));
        CHECK(c->energy_primal >= sure->energy_dual - 1e-12 * fabs(c->energy_primal));
        CHECK(fabs(c->energy_norm - sure->energy_norm) <= c->absolute_error + sure->absolute_error);
        CHECK_INT(got[i]->summary.active, exact[i]->summary.active);
        guesses += got[i]->summary.iterations;
    }
    if (exact && got)
        CHECK_MSG(got[CASES - 1]->summary.iterations == 1, "%s: %d guesses of an answer that is known", element,
                  (int)got[CASES - 1]->summary.iterations);
    CHECK(depth > 0 || guesses > CASES); /* rows change on the way */
    uz_results_free(exact, CASES);
    uz_results_free(got, CASES);
    uz_problem_clear(&problem);
}

TEST(a_case_begins_where_others_ended)
{
    check_cases("hex8", 0, false);
    check_cases("tet4", 0, false);
    check_cases("tet4", 1e-4, false);
    check_cases("tet4", 0, true);
}

/* Cases without a load, whose answer is 0, are not begun at what is left of others by rounding. */
TEST(without_a_load_the_answer_is_none)
{
    enum { CASES = 4 };
    uz_problem problem = cube("tet4", 6, 0.002, CASES);
    for (int i = 1; i < CASES; i++)
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++)
                problem.cases[i].loads[k].v[c] = 0;
    uz_result **got = solve_all(&problem, UZ_OPERATOR_MATRIX_FREE, 1e-6);
    for (int i = 0; got && i < CASES; i++) {
        CHECK_INT(got[i]->summary.outcome, UZ_CONVERGED);
        CHECK_MSG(i == 0 || fabs(got[i]->summary.certificate.energy_primal) < 1e-300, "%g, %lld steps",
                  got[i]->summary.certificate.energy_primal, (long long)got[i]->summary.iterations);
    }
    uz_results_free(got, CASES);
    uz_problem_clear(&problem);
}
