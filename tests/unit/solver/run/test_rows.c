/* Scenes that are solved with a part of their contact rows: what they say holds for all of them. */
#include "body_fixture.h"
#include "quad_exact.h"
#include "run/rows.h"
#include "run/run.h"

#include <string.h>

enum { FINE = 300, COARSE = 260, SIDE = FINE + 1 };

/* A slender column that stands on its foot, as numbers that run across it keep exact factors small. Its left side comes
 * near a wall at the top, its right side is `apart` from another. */
static uz_scene column(int64_t cells, double apart)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[]){2, 60, 0}, (int64_t[]){2, cells, 0});
    body_hold(&s, "bottom", 0, 0, NAN);
    s.contacts[0] = (uz_contact){.on = "left", .point = {-0.01, 60, 0}, .normal = {1, -0.1, 0}};
    s.contacts[1] = (uz_contact){.on = "right", .point = {2 + apart, 0, 0}, .normal = {-1, 0, 0}};
    s.n_contacts = 2;
    return s;
}

/* A force on the top: its end would move by 0.54 for each unit of it (F L^3 / 3 E I). */
static void push(uz_scene *s, double force)
{
    body_load(s, UZ_LOAD_FORCE, "top", force, 0, 0);
}

static uz_problem scene_problem(uz_scene scene)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = scene};
}

static uz_result *solve_cached(const uz_problem *problem, const uz_state *start, uz_cache *cache)
{
    const uz_settings settings = uz_settings_default();
    const uz_state *starts[] = {start};
    uz_result **results = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_solve_cases(&results, problem, &settings, starts, cache, NULL, &err) == UZ_OK, "%s %s", err.where,
              err.message);
    uz_result *result = results ? results[0] : NULL;
    free(results);
    if (!result)
        exit(1);
    return result;
}

static uz_result *solve(const uz_problem *problem)
{
    return solve_cached(problem, NULL, NULL);
}

/* A scene with all of its rows, and its solution in quadruple precision: that of the rows which touch, if no other one
 * is penetrated by it. */
typedef struct {
    uz_qp all, few;
    uz_body_model model;
    uz_candidates touching;
    quad_exact best;
} exact;

/* No row pulls, and none of all is penetrated. */
static void check_optimal(const exact *x)
{
    const uz_csc *N = &x->all.N;
    quad *gap = quad_zeros(N->rows);
    for (int64_t i = 0; i < N->rows; i++)
        gap[i] = x->all.h[i];
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            gap[N->idx[k]] -= (quad)N->val[k] * x->best.u[j];
    for (int64_t i = 0; i < N->rows; i++)
        CHECK_MSG(gap[i] > -1e-22, "the reference penetrates row %d: %g", (int)i, (double)gap[i]);
    for (int64_t k = 0; k < x->best.m; k++)
        CHECK(x->best.r[k] <= 0);
    free(gap);
}

static exact solve_exactly(const uz_problem *problem, const uz_result *answer)
{
    exact x = {.all = {.p = NULL}};
    uz_error err = {0};
    CHECK_INT(uz_scene_to_qp(&x.all, NULL, &problem->scene, &err), UZ_OK);
    CHECK_INT(uz_body_model_build(&x.model, &problem->scene, UZ_BODY_SUPPORTED, &err), UZ_OK);
    CHECK_INT(answer->m, x.all.N.rows);
    x.touching = (uz_candidates){.m = answer->m, .in = body_room(answer->m, 1)};
    for (int64_t i = 0; i < answer->m; i++) {
        x.touching.in[i] = answer->r[i] < 0;
        x.touching.count += answer->r[i] < 0;
    }
    CHECK_INT(uz_csc_copy(&x.few.K, &x.all.K, &err), UZ_OK);
    CHECK_INT(uz_candidates_reduce(&x.few.N, &x.all.N, &x.touching, &err), UZ_OK);
    x.few.p = body_room(x.model.d, sizeof(double));
    x.few.h = body_room(x.touching.count, sizeof(double));
    memcpy(x.few.p, x.all.p, (size_t)x.model.d * sizeof(double));
    uz_candidates_gather(x.few.h, x.all.h, &x.touching);
    bool *all = body_room(x.touching.count, sizeof *all);
    memset(all, 1, (size_t)x.touching.count * sizeof *all);
    CHECK(quad_exact_solve(&x.best, &x.few, all));
    free(all);
    check_optimal(&x);
    return x;
}

static void exact_clear(exact *x)
{
    quad_exact_free(&x->best);
    uz_candidates_clear(&x->touching);
    uz_body_model_clear(&x->model);
    uz_qp_clear(&x->all);
    uz_qp_clear(&x->few);
}

static void judge_result(const exact *x, const uz_result *got, const char *what)
{
    const uz_certificate *c = &got->summary.certificate;
    double *u = body_room(x->model.d, sizeof *u), *r = body_room(got->m, sizeof *r);
    uz_restrict_nodal(u, &x->model, got->u);
    const double error = quad_error(&x->best, u), norm = (double)quad_sqrt(x->best.norm2);
    CHECK_MSG(error <= c->absolute_error, "%s: error %g above the bound %g", what, error, c->absolute_error);
    CHECK_MSG(error <= c->relative_error * norm, "%s: %g of %g, certified %g", what, error, norm, c->relative_error);
    CHECK(got->summary.outcome != UZ_CONVERGED || error <= got->summary.requested_error * norm);
    uz_candidates_gather(r, got->r, &x->touching);
    for (int64_t k = 0; k < x->touching.count && got->summary.outcome == UZ_CONVERGED; k++)
        CHECK_MSG(fabs(r[k] - (double)x->best.r[k]) <= 1e-4 * fabs(got->summary.reaction_sum),
                  "%s: row %d: %g instead of %g", what, (int)k, r[k], (double)x->best.r[k]);
    free(u);
    free(r);
}

static void judge_all_rows(const uz_problem *problem, const uz_result *got, const char *what)
{
    exact x = solve_exactly(problem, got);
    judge_result(&x, got, what);
    exact_clear(&x);
}

/* The distance of two answers in the energy norm is at most the sum of their bounds. */
static void check_apart(const uz_problem *problem, const uz_result *a, const uz_result *b)
{
    uz_body_model model;
    uz_error err = {0};
    CHECK_INT(uz_body_model_build(&model, &problem->scene, UZ_BODY_SUPPORTED, &err), UZ_OK);
    double *u = body_room(model.d, sizeof *u), *v = body_room(model.d, sizeof *v), square = 0;
    uz_restrict_nodal(u, &model, a->u);
    uz_restrict_nodal(v, &model, b->u);
    for (int64_t j = 0; j < model.d; j++)
        u[j] -= v[j];
    memset(v, 0, (size_t)model.d * sizeof *v);
    uz_csc_symv(v, &model.K, 1, u);
    for (int64_t j = 0; j < model.d; j++)
        square += u[j] * v[j];
    const double bound = a->summary.certificate.absolute_error + b->summary.certificate.absolute_error;
    CHECK_MSG(sqrt(fmax(square, 0)) <= 1.001 * bound, "%g apart, %g allowed", sqrt(fmax(square, 0)), bound);
    free(u);
    free(v);
    uz_body_model_clear(&model);
}

static void check_same(const uz_problem *problem, const uz_result *a, const uz_result *b)
{
    check_apart(problem, a, b);
    CHECK_INT(a->summary.active, b->summary.active);
}

TEST(rows_far_from_obstacles_are_left_out)
{
    uz_problem problem = scene_problem(column(FINE, 10));
    push(&problem.scene, -8);
    uz_result *part = solve(&problem);
    problem.scene.all_candidates = true;
    uz_result *all = solve(&problem);
    const uz_summary *s = &part->summary;
    CHECK_INT(s->outcome, UZ_CONVERGED);
    CHECK_INT(s->m, 2 * FINE);
    CHECK_MSG(s->kept > s->active && s->kept < FINE / 2 && s->active > 0, "%d kept, %d active", (int)s->kept,
              (int)s->active);
    CHECK(s->rounds == 1 && s->added == 0);
    CHECK(all->summary.kept == 2 * FINE && all->summary.rounds == 1 && all->summary.added == 0);
    CHECK_INT(all->summary.outcome, UZ_CONVERGED);
    check_same(&problem, part, all);
    judge_all_rows(&problem, part, "far rows");
    for (int64_t i = 0; i < part->m; i++)
        CHECK(fabs(part->g[i] - all->g[i]) <= 1e-5 && part->mesh.contact_node[i] == all->mesh.contact_node[i]);
    uz_result_free(part);
    uz_result_free(all);
    uz_problem_clear(&problem);
}

/* The column bends away from the near wall and reaches the far one, whose rows were left out. */
TEST(rows_left_out_wrongly_are_added)
{
    uz_problem problem = scene_problem(column(FINE, 3));
    push(&problem.scene, 10);
    uz_result *part = solve(&problem);
    problem.scene.all_candidates = true;
    uz_result *all = solve(&problem);
    const uz_summary *s = &part->summary;
    int64_t right = 0;
    CHECK_INT(s->outcome, UZ_CONVERGED);
    CHECK(s->rounds >= 2 && s->rounds < 6 && s->added > 0 && s->kept > s->added && s->kept < s->m);
    CHECK(s->max_penetration <= 1e-6);
    for (int64_t i = 0; i < part->m; i++)
        right += part->r[i] < 0 && part->mesh.contact_of[i] == 1;
    CHECK(right > 0);
    check_same(&problem, part, all);
    judge_all_rows(&problem, part, "added rows");
    uz_result_free(part);
    uz_result_free(all);
    uz_problem_clear(&problem);
}

/* Every way of solving says the same. */
TEST(methods_and_operators_agree_on_rows_that_were_added)
{
    static const uz_operator ops[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE};
    uz_problem problem = scene_problem(column(COARSE, 3));
    push(&problem.scene, 10);
    uz_result *want = solve(&problem);
    for (size_t k = 0; k < sizeof ops / sizeof ops[0]; k++) {
        uz_settings settings = uz_settings_default();
        uz_result *got = NULL;
        uz_error err = {0};
        settings.op = ops[k];
        settings.relative_error = 1e-6;
        CHECK_MSG(uz_solve(&got, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        CHECK_INT(got->summary.op, ops[k]);
        CHECK(got->summary.rounds >= 2);
        check_same(&problem, got, want);
        uz_result_free(got);
    }
    uz_result_free(want);
    uz_problem_clear(&problem);
}

/* Cases that need more rows and cases that don't, through one cache. */
TEST(load_cases_have_the_rows_that_they_need)
{
    static const double force[] = {-8, 10, 0.5, 12, -1, 9, 1, 2, -2, 11};
    enum { CASES = sizeof force / sizeof force[0] };
    const uz_settings settings = uz_settings_default();
    uz_problem problem = scene_problem(column(FINE, 3));
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_result **results = NULL;
    uz_error err = {0};
    problem.cases = body_room(CASES, sizeof *problem.cases);
    problem.n_cases = CASES;
    for (int i = 0; i < CASES; i++) {
        snprintf(problem.cases[i].name, sizeof problem.cases[i].name, "%d", i);
        problem.cases[i].loads = body_room(1, sizeof(uz_load));
        problem.cases[i].loads[0] = (uz_load){.kind = UZ_LOAD_FORCE, .on = "top", .v = {force[i], 0, 0}};
        problem.cases[i].n_loads = 1;
    }
    CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, cache, NULL, &err) == UZ_OK, "%s", err.message);
    for (int i = 0; i < CASES; i++) {
        uz_problem one = problem;
        one.cases = NULL;
        one.n_cases = 0;
        one.scene.loads = problem.cases[i].loads;
        one.scene.n_loads = 1;
        CHECK_INT(results[i]->summary.outcome, UZ_CONVERGED);
        CHECK((results[i]->summary.rounds > 1) == (force[i] > 8));
        uz_result *alone = solve(&one);
        check_same(&one, results[i], alone);
        if (i < 2)
            judge_all_rows(&one, results[i], "case");
        uz_result_free(alone);
    }
    uz_results_free(results, CASES);
    uz_cache_free(cache);
    uz_problem_clear(&problem);
}

/* An answer is a start that takes no iterations, also where it needs rows that a cold solve leaves out first. */
TEST(an_answer_is_a_start)
{
    static const double force[] = {-8, 10};
    for (int k = 0; k < 2; k++) {
        uz_problem problem = scene_problem(column(FINE, 3));
        uz_cache *cache = uz_cache_new(1 << 30);
        push(&problem.scene, force[k]);
        uz_result *first = solve_cached(&problem, NULL, cache);
        uz_state warm = {.m = first->m, .r = first->r}, wrong = {.m = first->summary.kept, .r = first->r};
        uz_result *again = solve_cached(&problem, &warm, cache), *on = solve_cached(&problem, first->state, cache);
        CHECK_INT(first->state->m, first->m);
        CHECK(again->summary.iterations == 0 && again->summary.rounds == 1);
        CHECK(again->summary.origin == UZ_FROM_REACTIONS && again->summary.outcome == UZ_CONVERGED);
        CHECK(on->summary.origin == UZ_FROM_STATE && on->summary.outcome == UZ_CONVERGED);
        CHECK(on->summary.iterations == first->summary.iterations && on->summary.rounds == 1);
        check_same(&problem, first, again);
        check_same(&problem, first, on);
        const uz_settings settings = uz_settings_default();
        const uz_state *starts[] = {&wrong};
        uz_result **results = NULL;
        uz_error err = {0};
        CHECK_INT(uz_solve_cases(&results, &problem, &settings, starts, cache, NULL, &err), UZ_ERR_SIZE);
        CHECK(!results);
        uz_result_free(first);
        uz_result_free(again);
        uz_result_free(on);
        uz_cache_free(cache);
        uz_problem_clear(&problem);
    }
}

/* The rows follow from where obstacles are, which the key of the model leaves out. */
TEST(obstacles_that_move_have_rows_of_their_own)
{
    static const double apart[] = {10, 0.2, 10, 3, 0.2};
    uz_cache *cache = uz_cache_new(1 << 30);
    for (int k = 0; k < 5; k++) {
        uz_problem problem = scene_problem(column(FINE, apart[k]));
        push(&problem.scene, 10);
        uz_result *got = solve_cached(&problem, NULL, cache), *cold = solve(&problem);
        CHECK_INT(got->summary.outcome, UZ_CONVERGED);
        CHECK_INT(got->summary.kept, cold->summary.kept);
        CHECK_INT(got->summary.rounds, cold->summary.rounds);
        CHECK((got->summary.rounds > 1) == (apart[k] == 3));
        CHECK(got->summary.factor_cached == (k == 2 || k == 4));
        check_same(&problem, got, cold);
        uz_result_free(got);
        uz_result_free(cold);
        uz_problem_clear(&problem);
    }
    uz_cache_free(cache);
}

TEST(answers_of_a_part_are_verified_with_all_rows)
{
    const uz_settings settings = uz_settings_default();
    uz_problem problem = scene_problem(column(FINE, 3));
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_result *verified = NULL;
    uz_error err = {0};
    push(&problem.scene, 10);
    uz_result *x = solve_cached(&problem, NULL, cache);
    CHECK_INT(uz_verify(&verified, &problem, x->u, x->r, &settings, cache, NULL, &err), UZ_OK);
    CHECK_INT(verified->summary.outcome, UZ_VERIFIED);
    CHECK_INT(verified->m, x->m);
    uz_result_free(verified);
    problem.scene.contacts[1].point[0] -= 0.5; /* now the end is in the other wall */
    CHECK_INT(uz_verify(&verified, &problem, x->u, x->r, &settings, cache, NULL, &err), UZ_OK);
    CHECK_INT(verified->summary.outcome, UZ_NOT_VERIFIED);
    CHECK(verified->summary.max_penetration > 0.1);
    uz_result *moved = solve_cached(&problem, NULL, cache);
    check_apart(&problem, verified, moved);
    uz_result_free(moved);
    uz_result_free(verified);
    uz_result_free(x);
    uz_cache_free(cache);
    uz_problem_clear(&problem);
}

/* Two walls that cross: what contradicts is told in the numbers of all rows. */
TEST(contradictions_are_told_in_all_rows)
{
    uz_problem problem = scene_problem(column(FINE, 10));
    uz_qp qp = {.p = NULL};
    uz_error err = {0};
    problem.scene.contacts[2] = problem.scene.contacts[0];
    problem.scene.contacts[0] = problem.scene.contacts[1]; /* rows left out come first */
    problem.scene.contacts[1] = (uz_contact){.on = "top", .point = {0, 60.1, 0}, .normal = {0, 1, 0}};
    problem.scene.contacts[2] = (uz_contact){.on = "top", .point = {0, 60.05, 0}, .normal = {0, -1, 0}};
    problem.scene.n_contacts = 3;
    snprintf(problem.scene.contacts[3].on, sizeof problem.scene.contacts[3].on, "left");
    problem.scene.contacts[3].point[0] = -5;
    problem.scene.contacts[3].normal[0] = 1;
    problem.scene.n_contacts = 4;
    push(&problem.scene, 1);
    uz_result *x = solve(&problem);
    CHECK_INT(x->summary.outcome, UZ_INFEASIBLE);
    CHECK(x->summary.kept < x->summary.m);
    CHECK_INT(uz_scene_to_qp(&qp, NULL, &problem.scene, &err), UZ_OK);
    if (x->ray) {
        double *force = body_room(qp.N.cols, sizeof *force), size = 0, work = 0;
        uz_csc_gaxpy_t(force, &qp.N, 1, x->ray);
        for (int64_t j = 0; j < qp.N.cols; j++)
            size = fmax(size, fabs(force[j]));
        for (int64_t i = 0; i < x->m; i++) {
            CHECK(x->ray[i] <= 0);
            work += qp.h[i] * x->ray[i];
        }
        CHECK(size <= 1e-12 && work > 0);
        free(force);
    }
    uz_qp_clear(&qp);
    uz_result_free(x);
    uz_problem_clear(&problem);
}

/* ---- told to stop */

typedef struct {
    long asked, allowed;
} patience;

static bool is_out(void *ctx)
{
    patience *p = ctx;
    return ++p->asked > p->allowed;
}

/* Whenever a solve is ended there is no answer, or one whose bound holds for all rows. */
TEST(solves_that_are_ended_claim_no_more_than_they_know)
{
    uz_problem problem = scene_problem(column(FINE, 3));
    const uz_settings settings = uz_settings_default();
    int outcomes[2] = {0};
    push(&problem.scene, 10);
    patience all = {0, INT32_MAX};
    uz_hooks hooks = {.ctx = &all, .cancelled = is_out};
    uz_result *x = NULL;
    uz_error err = {0};
    CHECK_INT(uz_solve(&x, &problem, &settings, NULL, &hooks, &err), UZ_OK);
    exact reference = solve_exactly(&problem, x);
    uz_result_free(x);
    for (int k = 1; k <= 12; k++) {
        patience some = {0, all.asked * k / 13};
        hooks.ctx = &some;
        const uz_status status = uz_solve(&x, &problem, &settings, NULL, &hooks, &err);
        if (status != UZ_OK) {
            CHECK(status == UZ_ERR_CANCELLED && !x);
            continue;
        }
        CHECK(x->summary.outcome == UZ_DISMISSED || x->summary.outcome == UZ_CONVERGED);
        outcomes[x->summary.outcome == UZ_CONVERGED]++;
        judge_result(&reference, x, "ended early");
        uz_result_free(x);
    }
    CHECK(outcomes[0] > 0);
    exact_clear(&reference);
    uz_problem_clear(&problem);
}

/* ---- what is left as it is */

TEST(few_rows_are_all_kept)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[]){60, 20, 0}, (int64_t[]){60, 20, 0});
    uz_problem problem = scene_problem(s);
    body_hold(&problem.scene, "left", 0, 0, NAN);
    body_load(&problem.scene, UZ_LOAD_FORCE, "right", 0, -1, 0);
    problem.scene.contacts[0] = (uz_contact){.on = "bottom", .point = {0, -1, 0}, .normal = {0, 1, 0}};
    problem.scene.n_contacts = 1;
    CHECK(!uz_may_omit_rows(&problem));
    uz_result *x = solve(&problem);
    CHECK(x->summary.kept == 60 && x->summary.m == 60 && x->summary.rounds == 1);
    uz_result_free(x);
    problem.scene.box.cells[0] = 600;
    CHECK(uz_may_omit_rows(&problem));
    problem.scene.box.cells[0] = 300;
    CHECK(!uz_may_omit_rows(&problem));
    snprintf(problem.scene.box.element, sizeof problem.scene.box.element, "quad8");
    CHECK(uz_may_omit_rows(&problem));
    problem.scene.all_candidates = true;
    CHECK(!uz_may_omit_rows(&problem));
    uz_problem_clear(&problem);
}

/* Whatever was asked for: there is nothing to iterate on. */
TEST(a_body_without_contact_is_a_linear_solve)
{
    uz_problem problem = scene_problem(column(10, 3));
    push(&problem.scene, 1);
    problem.scene.n_contacts = 0;
    for (int method = 0; method < UZ_METHOD_GIVEN; method++) {
        uz_settings settings = uz_settings_default();
        uz_result *x = NULL;
        settings.method = (uz_method)method;
        CHECK_INT(uz_solve(&x, &problem, &settings, NULL, NULL, NULL), UZ_OK);
        CHECK_INT(x->summary.outcome, UZ_CONVERGED);
        CHECK_STR(uz_method_name(x->summary.method), "linear");
        CHECK(x->summary.iterations == 0 && x->summary.kept == 0 && x->summary.m == 0);
        uz_result_free(x);
    }
    uz_settings settings = uz_settings_default();
    uz_result *x = NULL;
    uz_method parsed;
    settings.method = UZ_METHOD_LINEAR;
    CHECK_INT(uz_solve(&x, &problem, &settings, NULL, NULL, NULL), UZ_ERR_ARGUMENT);
    CHECK(!x && !uz_method_parse(&parsed, "linear"));
    uz_problem_clear(&problem);
}

TEST(sets_of_rows)
{
    double r[] = {0, -1, 0, 0}, rho[] = {0, 0, -2, 0}, none[] = {0, 0, 0, 0};
    const uz_state state = {.m = 4, .r = r, .rho = rho, .Dr = none, .Drho = none, .best_r = none, .anchor = none};
    uz_candidates set = {0}, other = {0};
    uz_state *part = NULL, *back = NULL;
    uz_error err = {0};
    CHECK_INT(uz_candidates_add_start(&set, &state, &err), UZ_OK);
    CHECK(set.count == 2 && set.m == 4 && !set.in[0] && set.in[1] && set.in[2] && !set.in[3]);
    CHECK_INT(uz_candidates_add(&other, &set, &err), UZ_OK);
    CHECK(other.count == 2 && uz_candidates_has(&other, &set) && uz_candidates_has(&set, &other));
    set.in[3] = 1;
    set.count = 3;
    CHECK(uz_candidates_has(&set, &other) && !uz_candidates_has(&other, &set));
    CHECK_INT(uz_state_copy(&part, &state, &set, true, 0, &err), UZ_OK);
    CHECK(part->m == 3 && part->r[0] == -1 && part->rho[1] == -2 && part->r[2] == 0);
    CHECK_INT(uz_state_copy(&back, part, &set, false, 0, &err), UZ_OK);
    CHECK(back->m == 4 && memcmp(back->r, r, sizeof r) == 0 && memcmp(back->rho, rho, sizeof rho) == 0);
    uz_state_free(part);
    uz_state_free(back);
    uz_candidates_clear(&set);
    uz_candidates_clear(&other);
}
