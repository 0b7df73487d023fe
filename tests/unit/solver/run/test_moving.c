/* Contact where the answer itself moves the surfaces to: figures of bodies that are meshed where they end, the passes,
 * the factor that is kept, and what happens where nothing settles. */
#include "body_fixture.h"
#include "run/setup_cache.h"
#include "theory.h"

/* A block of 10 x 5 from x0 on, pushed aside by D and down by `down`. */
static uz_scene block(double x0, int64_t cells, double D, double down)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){10, 5, 0}, (int64_t[3]){cells, cells / 2, 0});
    s.box.origin[0] = x0;
    s.materials[0].young = 1000;
    body_hold(&s, "top", D, -down, NAN);
    return s;
}

/* On a bump whose top is at the origin. */
static uz_scene on_bump(double x0, double D, double radius, double down)
{
    uz_scene s = block(x0, 20, D, down);
    uz_contact *bump = body_plane(&s, "bottom", (double[3]){0, -radius, 0}, (double[3]){0, 1, 0});
    bump->kind = UZ_OBSTACLE_ROUND;
    bump->radius = radius;
    return s;
}

static uz_result *solve(uz_scene *s, uz_kinematics kinematics, double accuracy, uz_cache *cache)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    s->kinematics = kinematics;
    problem.scene = *s;
    settings.relative_error = accuracy;
    CHECK_MSG(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK, "%s: %s", err.where, err.message);
    if (!result)
        exit(1);
    return result;
}

static bool is_warned(const uz_result *result)
{
    bool found = false;
    for (int i = 0; i < result->evaluation->n_warnings; i++)
        found = found || strcmp(result->evaluation->warnings[i].code, "sliding") == 0;
    return found;
}

/* Figures of an independent program, which also meshed the body at the end of its way. */
TEST(a_block_slid_along_a_bump_is_as_if_meshed_there)
{
    static const double D[3] = {1, 2, 5}, force[3][2] = {{0.0607, 84.1659}, {0.1585, 81.2185}, {1.1123, 36.7158}};
    for (int i = 0; i < 3; i++) {
        uz_scene slid = on_bump(-5, D[i], 20, 0.1), there = on_bump(-5 + D[i], 0, 20, 0.1);
        uz_result *fixed = solve(&slid, UZ_KINEMATICS_FIXED, 1e-8, NULL),
                  *moving = solve(&slid, UZ_KINEMATICS_MOVING, 1e-8, NULL),
                  *found = solve(&slid, UZ_KINEMATICS_AUTO, 1e-8, NULL),
                  *meshed = solve(&there, UZ_KINEMATICS_MOVING, 1e-8, NULL);
        const uz_summary *s = &moving->summary;
        CHECK_INT(s->outcome, UZ_CONVERGED);
        for (int c = 0; c < 2; c++) {
            CHECK_MSG(fabs(s->force[c] - force[i][c]) < 6e-5, "%.6f", s->force[c]);
            CHECK_MSG(fabs(s->force[c] - meshed->summary.force[c]) < 1e-6 * s->force[1], "%.12g", s->force[c]);
            CHECK(s->force[c] == found->summary.force[c]);
        }
        CHECK_INT(s->geometry.kind, UZ_KINEMATICS_MOVING);
        CHECK_MSG(s->geometry.passes >= 4 && s->geometry.passes <= 7, "%lld", (long long)s->geometry.passes);
        CHECK_INT(s->iterations, 1); /* the last pass goes on from the rows in contact of the one before */
        CHECK_INT(s->origin, UZ_FROM_ZERO);
        CHECK(s->geometry.left <= 1e-8 && s->geometry.change > s->geometry.left);
        CHECK(moving->place && !fixed->place && !is_warned(moving));
        CHECK(fixed->summary.force[1] > 1.3 * s->force[1] && is_warned(fixed));
        uz_result_free(fixed);
        uz_result_free(moving);
        uz_result_free(found);
        uz_result_free(meshed);
        uz_scene_clear(&slid);
        uz_scene_clear(&there);
    }
}

TEST(a_block_slid_into_a_ramp)
{
    static const double X[] = {-30, 12, 40}, Y[] = {0, 0, 28};
    uz_scene s = block(0, 20, 5, 0.05);
    for (int side = 0; side < 2; side++) {
        uz_contact *ramp = body_plane(&s, side ? "right" : "bottom", (double[3]){0}, (double[3]){0});
        ramp->kind = UZ_OBSTACLE_POLYLINE;
        ramp->n_x = 3;
        ramp->x = body_room(3, sizeof *ramp->x);
        ramp->y = body_room(3, sizeof *ramp->y);
        memcpy(ramp->x, X, sizeof X);
        memcpy(ramp->y, Y, sizeof Y);
    }
    uz_result *result = solve(&s, UZ_KINEMATICS_AUTO, 1e-8, NULL);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK_MSG(fabs(result->summary.force[0] + 756.661) < 1e-2, "%.6f", result->summary.force[0]);
    CHECK_MSG(fabs(result->summary.force[1] - 812.179) < 1e-2, "%.6f", result->summary.force[1]);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* Two blocks on each other with meshes that do not match, the upper on a bump of the lower one or on its flat top. */
static uz_scene stacked(double bump, double D)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){20, 4, 0}, (int64_t[3]){30, 6, 0});
    uz_scene upper = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){6, 3, 0}, (int64_t[3]){14, 6, 0});
    body_give_mesh(&s, NULL);
    body_give_mesh(&upper, NULL);
    for (int64_t i = 0; i < s.given.n_nodes; i++) {
        double *x = s.given.xyz + 2 * i;
        x[0] -= 10;
        x[1] += x[1] / 4 * (bump > 0 ? sqrt(bump * bump - x[0] * x[0]) - bump : 0) - 4;
    }
    for (int64_t i = 0; i < upper.given.n_nodes; i++)
        upper.given.xyz[2 * i] -= 3;
    theory_join(&s, "lower", &upper, "upper");
    snprintf(s.materials[0].on, sizeof s.materials[0].on, "all");
    body_hold(&s, "lower_bottom", 0, 0, NAN);
    body_hold(&s, "upper_top", D, -0.05, NAN);
    uz_contact *contact = body_plane(&s, "upper_bottom", (double[3]){0}, (double[3]){0, 1, 0});
    contact->kind = UZ_OBSTACLE_BODY;
    snprintf(contact->with, sizeof contact->with, "lower_top");
    return s;
}

/* Rows come and go as other nodes face each other: they are found again from the place that comes with the answer. */
TEST(a_block_slid_along_another_body)
{
    for (int nodes = 0; nodes < 2; nodes++) {
        uz_scene slid = stacked(60, 3.1), there = stacked(60, 0);
        for (int64_t i = 0; i < there.given.n_nodes; i++)
            there.given.xyz[2 * i] += there.given.n_nodes - i <= 15 * 7 ? 3.1 : 0;
        slid.contacts[0].between = there.contacts[0].between = nodes ? UZ_CONTACT_NODES : UZ_CONTACT_SURFACES;
        uz_result *moving = solve(&slid, UZ_KINEMATICS_AUTO, 1e-8, NULL),
                  *meshed = solve(&there, UZ_KINEMATICS_MOVING, 1e-8, NULL);
        CHECK_INT(moving->summary.outcome, UZ_CONVERGED);
        CHECK_INT(moving->summary.geometry.kind, UZ_KINEMATICS_MOVING);
        CHECK_MSG(moving->summary.geometry.passes < 20, "%lld", (long long)moving->summary.geometry.passes);
        for (int c = 0; c < 2; c++)
            CHECK_MSG(fabs(moving->summary.force[c] - meshed->summary.force[c]) < 1e-6 * meshed->summary.force[1],
                      "%d: %.12g %.12g", nodes, moving->summary.force[c], meshed->summary.force[c]);
        uz_fields fields;
        const uz_field_source answer = {moving->u, moving->r, moving->g, 2 * moving->n_nodes, moving->m};
        slid.place = moving->place;
        CHECK_INT(uz_fields_compute(&fields, &slid, &answer, UZ_FIELD_PRESSURE, NULL, NULL), UZ_OK);
        CHECK_INT(fields.m, moving->m);
        for (int64_t i = 0; i < fields.m; i++)
            CHECK(fields.pressure[i] == moving->pressure[i]);
        uz_fields_clear(&fields);
        uz_result_free(moving);
        uz_result_free(meshed);
        uz_scene_clear(&slid);
        uz_scene_clear(&there);
    }
}

/* On flat ground nothing changes but where the reactions act: it has a row where it had none. */
TEST(answers_that_stay_where_they_are_stay_as_they_are)
{
    uz_scene scenes[3] = {on_bump(-5, 0, 20, 0.1), stacked(60, 0.01), stacked(0, 0)};
    for (int i = 0; i < 3; i++) {
        uz_result *fixed = solve(&scenes[i], UZ_KINEMATICS_FIXED, 1e-8, NULL),
                  *found = solve(&scenes[i], UZ_KINEMATICS_AUTO, 1e-8, NULL),
                  *moving = solve(&scenes[i], UZ_KINEMATICS_MOVING, 1e-8, NULL);
        CHECK_INT(found->summary.geometry.kind, UZ_KINEMATICS_FIXED);
        CHECK_INT(found->summary.outcome, UZ_CONVERGED);
        CHECK(memcmp(fixed->u, found->u, (size_t)(2 * fixed->n_nodes) * sizeof *fixed->u) == 0);
        CHECK(memcmp(fixed->r, found->r, (size_t)fixed->m * sizeof *fixed->r) == 0);
        CHECK(!is_warned(fixed) && !is_warned(found) && !found->place);
        CHECK_REL(moving->summary.force[1], fixed->summary.force[1], 0.02);
        uz_result_free(fixed);
        uz_result_free(found);
        uz_result_free(moving);
        uz_scene_clear(&scenes[i]);
    }
}

TEST(the_factor_is_kept)
{
    uz_scene s = on_bump(-5, 2, 20, 0.1);
    uz_cache *cache = uz_cache_new(SIZE_MAX);
    uz_result *result = solve(&s, UZ_KINEMATICS_MOVING, 1e-8, cache);
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
    uz_settings settings = uz_settings_default();
    uz_setup *rest = NULL, *there = NULL;
    uz_reuse reused;
    CHECK_INT(uz_setup_acquire(&rest, &reused, cache, &problem, NULL, &settings, NULL, NULL), UZ_OK);
    CHECK(reused.op);
    problem.scene.place = result->place;
    CHECK_INT(uz_setup_acquire(&there, &reused, cache, &problem, NULL, &settings, NULL, NULL), UZ_OK);
    CHECK(reused.factor && !reused.op && there->factor == rest->factor && there->model.K.val == rest->model.K.val);
    CHECK(there->model.N.val != rest->model.N.val);
    uz_setup_release(cache, there);
    uz_setup_release(cache, rest);
    uz_cache_entry *entries;
    size_t count;
    CHECK_INT(uz_cache_list(cache, &entries, &count, NULL), UZ_OK);
    CHECK_INT(count, 1); /* places are asked for once */
    free(entries);
    uz_result_free(result);
    uz_cache_free(cache);
    uz_scene_clear(&s);
}

/* Each form of the operator, and cases: each goes its own way. */
TEST(every_operator_and_every_case)
{
    static const uz_operator forms[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE};
    for (int k = 0; k < 3; k++) {
        uz_scene s = on_bump(-5, 2, 20, 0.1);
        uz_load push = {.kind = UZ_LOAD_TRACTION, .on = "left", .v = {1, 0, 0}};
        uz_load_case cases[2] = {{.name = "free", .loads = &push, .n_loads = 0},
                                 {.name = "pushed", .loads = &push, .n_loads = 1}};
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .cases = cases, .n_cases = 2};
        uz_settings settings = uz_settings_default();
        uz_result **results = NULL;
        uz_error err = {0};
        settings.op = forms[k];
        CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        for (int i = 0; i < 2 && results; i++) {
            CHECK_INT(results[i]->summary.outcome, UZ_CONVERGED);
            CHECK_INT(results[i]->summary.op, forms[k]);
            CHECK_INT(results[i]->summary.geometry.kind, UZ_KINEMATICS_MOVING);
        }
        CHECK_MSG(results && fabs(results[0]->summary.force[1] - 81.2185) < 1e-3, "%d", k);
        uz_results_free(results, results ? 2 : 0);
        uz_scene_clear(&s);
    }
}

/* A bump as sharp as a cell is wide needs more passes than there are. */
TEST(what_does_not_settle_is_said)
{
    uz_scene s = on_bump(-5, 2, 0.4, 0.6);
    uz_result *result = solve(&s, UZ_KINEMATICS_MOVING, 1e-10, NULL);
    const uz_summary *x = &result->summary;
    CHECK_MSG(x->outcome == UZ_MOVING_GEOMETRY, "%s %g %g %lld", uz_choice_name(UZ_CHOICE_OUTCOME, x->outcome),
              x->geometry.change, x->geometry.left, (long long)x->geometry.passes);
    CHECK_INT(x->geometry.passes, 30);
    CHECK(x->geometry.left > 1e-10 && strstr(x->message, "30") && x->certificate.relative_error <= 1e-10);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(what_cannot_move_is_refused)
{
    uz_scene s = on_bump(-5, 1, 20, 0.1);
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    double u[1] = {0};
    s.kinematics = UZ_KINEMATICS_MOVING;
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
    CHECK_INT(uz_verify(&result, &problem, u, u, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/kinematics");
    problem.scene.supports[0].u[1] = NAN; /* only the bump holds it */
    body_load(&problem.scene, UZ_LOAD_PRESSURE, "top", 1, 0, 0);
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/kinematics");
    CHECK(strstr(err.message, "fixed"));
    problem.scene.kinematics = UZ_KINEMATICS_AUTO;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
    CHECK(result && is_warned(result));
    uz_result_free(result);
    uz_scene_clear(&problem.scene);
}
