/* Quantities and their intervals: closed forms, finer meshes, and what is refused. */
#include "body_fixture.h"

enum { MOST = 8 };

typedef struct {
    uz_quantity list[MOST];
    int64_t n;
} quantities;

static uz_quantity *ask(quantities *to, uz_quantity_kind kind, const char *on, double x, double y, double z)
{
    uz_quantity *q = &to->list[to->n];
    *q = (uz_quantity){.kind = kind, .direction = {x, y, z}};
    snprintf(q->on, sizeof q->on, "%s", on);
    snprintf(q->name, sizeof q->name, "q%d", (int)to->n++);
    return q;
}

static uz_result *solve(const uz_scene *scene, quantities *asked, uz_operator op, uz_cache *cache)
{
    const uz_problem problem = {
        .kind = UZ_PROBLEM_SCENE, .scene = *scene, .quantities = asked->list, .n_quantities = asked->n};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.op = op;
    CHECK_MSG(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK, "%s: %s", err.where, err.message);
    if (!result)
        exit(1);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK_INT(result->evaluation->n_quantities, asked->n);
    for (int64_t i = 0; i < asked->n; i++) {
        const uz_quantity_found *q = &result->evaluation->quantities[i];
        CHECK_STR(q->name, asked->list[i].name);
        CHECK_MSG(q->why[0] == '\0', "%s: %s", q->name, q->why);
        CHECK_MSG(q->low <= q->value && q->value <= q->high && q->mesh >= 0 && q->equations >= 0, "%s: %g %g %g",
                  q->name, q->low, q->value, q->high);
    }
    return result;
}

static void clear(uz_scene *scene, uz_result *result)
{
    uz_result_free(result);
    uz_scene_clear(scene);
}

/* A bar 3 x 1 [x 1] under a uniform pull: every element has the answer exactly, so that intervals are points. */
TEST(a_bar_under_tension_is_exact)
{
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const bool solid = uz_element_type_of((uz_element_kind)k)->dim == 3;
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRESS, uz_element_name((uz_element_kind)k),
                                (double[3]){3, 1, 1}, (int64_t[3]){3, 2, 2});
        quantities asked = {.n = 0};
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
        if (solid)
            body_hold(&s, "back", NAN, NAN, 0);
        body_load(&s, UZ_LOAD_TRACTION, "right", 10, 0, 0);
        ask(&asked, UZ_QUANTITY_DISPLACEMENT, "right", 1, 0, 0);
        ask(&asked, UZ_QUANTITY_REACTION, "left", 1, 0, 0);
        ask(&asked, UZ_QUANTITY_STRAIN_ENERGY, "", 0, 0, 0);
        uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
        const double want[] = {10 * 3 / 200e3, -10, 0.5 * 100 / 200e3 * 3};
        for (int i = 0; i < 3; i++) {
            const uz_quantity_found *q = &result->evaluation->quantities[i];
            CHECK_REL(q->found, want[i], 1e-9);
            CHECK_REL(q->value, want[i], 1e-6);
            CHECK_MSG(q->high - q->low <= 1e-5 * fabs(want[i]), "%s %d: %g", uz_element_name((uz_element_kind)k), i,
                      q->high - q->low);
        }
        CHECK_REL(result->evaluation->potential_energy, -want[2], 1e-9);
        CHECK_REL(result->evaluation->potential_energy, result->summary.certificate.energy_primal, 1e-9);
        clear(&s, result);
    }
}

/* A quarter of a block, 10 x 10, that a support presses on a cylinder. */
static uz_scene hertz(const char *element, int64_t cells)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){10, 10, 0}, (int64_t[3]){cells, cells, 0});
    const double below[3] = {0, -20, 0}, none[3] = {0};
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "top", NAN, -0.1, NAN);
    uz_contact *contact = body_plane(&s, "bottom", below, none);
    contact->kind = UZ_OBSTACLE_ROUND;
    contact->radius = 20;
    return s;
}

static void ask_hertz(quantities *asked)
{
    ask(asked, UZ_QUANTITY_CONTACT_FORCE, "bottom", 0, 0, 0);
    ask(asked, UZ_QUANTITY_REACTION, "top", 0, -1, 0);
    ask(asked, UZ_QUANTITY_DISPLACEMENT, "right", 1, 0, 0);
    uz_quantity *window = ask(asked, UZ_QUANTITY_MEAN_PRESSURE, "bottom", 0, 0, 0);
    memcpy(window->low, (double[3]){-1, -1, 0}, sizeof window->low);
    memcpy(window->high, (double[3]){5, 1, 0}, sizeof window->high);
    ask(asked, UZ_QUANTITY_STRAIN_ENERGY, "", 0, 0, 0);
}

/* The force of the whole contact is that of the support, and over the window's area the mean pressure; the true values,
 * of a mesh ten times as fine with quadratic elements, are in the intervals. */
TEST(intervals_have_the_values_of_a_fine_mesh)
{
    quantities asked = {.n = 0};
    ask_hertz(&asked);
    uz_scene fine = hertz("quad8", 96);
    uz_result *true_one = solve(&fine, &asked, UZ_OPERATOR_AUTO, NULL);
    for (int k = 0; k < 4; k++) {
        static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
        uz_scene s = hertz(ELEMENTS[k], 12);
        uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
        const uz_quantity_found *q = result->evaluation->quantities;
        CHECK_REL(q[0].found, q[1].found, 1e-3); /* the sum of normal forces, and their vertical part */
        CHECK_REL(q[0].value, q[1].value, 1e-3);
        CHECK_REL(q[3].found, q[0].found / 5, 1e-9);
        for (int i = 0; i < 5; i++) {
            const double value = true_one->evaluation->quantities[i].value;
            CHECK_MSG(q[i].low <= value && value <= q[i].high, "%s %d: %g in [%g, %g]", ELEMENTS[k], i, value, q[i].low,
                      q[i].high);
            CHECK_MSG(q[i].high - q[i].low < 0.7 * fabs(q[i].value), "%s %d: [%g, %g]", ELEMENTS[k], i, q[i].low,
                      q[i].high);
        }
        clear(&s, result);
    }
    clear(&fine, true_one);
}

/* The middle is the better value, and intervals narrow with the second order of linear elements. */
TEST(intervals_narrow_as_products_of_errors)
{
    quantities asked = {.n = 0};
    double width[3][5];
    ask_hertz(&asked);
    for (int k = 0; k < 3; k++) {
        uz_scene s = hertz("quad4", 12 << k);
        uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
        for (int i = 0; i < 5; i++)
            width[k][i] = result->evaluation->quantities[i].high - result->evaluation->quantities[i].low;
        clear(&s, result);
    }
    for (int i = 0; i < 5; i++)
        CHECK_MSG(width[2][i] < width[0][i] / 5, "%d: %g %g %g", i, width[0][i], width[1][i], width[2][i]);
}

/* Every form of the operator, with a factor that was there and without. */
TEST(forms_agree)
{
    static const uz_operator FORMS[] = {UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE,
                                        UZ_OPERATOR_CONDENSED};
    quantities asked = {.n = 0};
    double known[5];
    uz_cache *cache = uz_cache_new(1 << 28);
    ask_hertz(&asked);
    for (int k = 0; k < 4; k++) {
        uz_scene s = hertz("quad4", 16);
        uz_result *result = solve(&s, &asked, FORMS[k], cache);
        for (int i = 0; i < 5; i++) {
            const uz_quantity_found *q = &result->evaluation->quantities[i];
            if (k == 0)
                known[i] = q->value;
            CHECK_REL(q->value, known[i], 1e-4);
        }
        clear(&s, result);
    }
    uz_cache_free(cache);
}

/* The adjoint holds its rows whatever they bear: where it was solved for as a guess of rows that may be wrong is, and
 * left at two digits, intervals were up to 28 times as wide. */
TEST(intervals_without_a_factor_are_no_wider)
{
    double width[3];
    for (int k = 0; k < 2; k++) {
        quantities asked = {.n = 0};
        uz_scene s = body_scene(UZ_SOLID, "tet10", (double[3]){10, 10, 10}, (int64_t[3]){4, 4, 4});
        body_hold(&s, "front", 0, 0, -0.05);
        body_load(&s, UZ_LOAD_TRACTION, "right", 0, 1, -2);
        body_plane(&s, "back", (double[3]){0, 0, 0}, (double[3]){0, 0, 1});
        ask(&asked, UZ_QUANTITY_CONTACT_FORCE, "", 0, 0, 0);
        ask(&asked, UZ_QUANTITY_REACTION, "front", 0, 0, 1);
        ask(&asked, UZ_QUANTITY_DISPLACEMENT, "right", 1, 0, 0);
        uz_result *result = solve(&s, &asked, k ? UZ_OPERATOR_MATRIX_FREE : UZ_OPERATOR_CONDENSED, NULL);
        CHECK_INT(result->summary.op, k ? UZ_OPERATOR_MATRIX_FREE : UZ_OPERATOR_CONDENSED);
        for (int i = 0; i < 3; i++) {
            const uz_quantity_found *q = &result->evaluation->quantities[i];
            if (k == 0)
                width[i] = q->high - q->low;
            CHECK_REL(q->high - q->low, width[i], 1e-3);
        }
        clear(&s, result);
    }
}

/* Where nothing presses the adjoint of a force is 0: what rounding left of it was an energy, and no force. */
TEST(a_force_of_what_does_not_touch_has_no_width)
{
    quantities asked = {.n = 0};
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "tri3", (double[3]){4e9, 1e9, 0}, (int64_t[3]){8, 3, 0});
    s.kinematics = UZ_KINEMATICS_FINITE;
    s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    s.materials[0].young = 1;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "right", 0, 1e-3, 0);
    body_plane(&s, "bottom", (double[3]){0, -1e9, 0}, (double[3]){0, 1, 0});
    ask(&asked, UZ_QUANTITY_CONTACT_FORCE, "bottom", 0, 0, 0);
    uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
    const uz_quantity_found *q = &result->evaluation->quantities[0];
    CHECK_MSG(q->low == 0 && q->high == 0, "%g %g", q->low, q->high);
    clear(&s, result);
}

/* A body that only the obstacle holds: what it is pressed with is the force, whatever the mesh. */
TEST(a_body_without_supports)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){4, 2, 0}, (int64_t[3]){8, 4, 0});
    const double zero[3] = {0}, up[3] = {0, 1, 0};
    quantities asked = {.n = 0};
    body_hold(&s, "left", 0, NAN, NAN);
    body_plane(&s, "bottom", zero, up);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -3, 0);
    ask(&asked, UZ_QUANTITY_CONTACT_FORCE, "", 0, 0, 0);
    ask(&asked, UZ_QUANTITY_DISPLACEMENT, "top", 0, 1, 0);
    uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
    CHECK(result->summary.semicoercive.free_modes > 0);
    CHECK_REL(result->evaluation->quantities[0].value, 12.0, 1e-6);
    CHECK(result->evaluation->quantities[0].high - result->evaluation->quantities[0].low < 1e-4);
    CHECK_REL(result->evaluation->quantities[1].value, -3 * 2 * 0.91 / 200e3, 1e-6);
    clear(&s, result);
}

/* Springs, heat, a ring, an inclined support: the reaction is what balances, and the true value is in its interval. */
TEST(reactions_of_every_kind_of_support)
{
    for (int k = 0; k < 4; k++) {
        double value[2];
        for (int fine = 1; fine >= 0; fine--) {
            const int64_t n = fine ? 64 : 6;
            uz_scene s = body_scene(k == 2 ? UZ_AXISYMMETRIC : UZ_PLANE_STRAIN, fine ? "quad8" : "quad4",
                                    (double[3]){2, 1, 0}, (int64_t[3]){2 * n, n, 0});
            quantities asked = {.n = 0};
            s.materials[0].expansion = 1e-5;
            if (k == 0)
                body_spring(&s, "bottom", 3e4, 2e4, 0);
            else if (k == 3)
                body_hold_normal(&s, "right", (double[3]){1, 1, 0}, 0.01);
            if (k != 0)
                body_hold(&s, k == 2 ? "bottom" : "left", k == 2 ? NAN : 0, 0, NAN);
            if (k == 1)
                body_load(&s, UZ_LOAD_TEMPERATURE, "all", 100, 0, 0);
            body_load(&s, UZ_LOAD_TRACTION, k == 2 ? "right" : "top", 0, -20, 0);
            ask(&asked, UZ_QUANTITY_REACTION,
                k == 0   ? "bottom"
                : k == 2 ? "bottom"
                : k == 3 ? "right"
                         : "left",
                0, 1, 0);
            ask(&asked, UZ_QUANTITY_STRAIN_ENERGY, "", 0, 0, 0);
            uz_result *result = solve(&s, &asked, UZ_OPERATOR_AUTO, NULL);
            for (int i = 0; i < 2; i++) {
                const uz_quantity_found *q = &result->evaluation->quantities[i];
                if (fine)
                    value[i] = q->value;
                CHECK_MSG(q->low <= value[i] + 1e-9 * fabs(value[i]) && value[i] - 1e-9 * fabs(value[i]) <= q->high,
                          "support %d, quantity %d: %.9g in [%.9g, %.9g]", k, i, value[i], q->low, q->high);
            }
            clear(&s, result);
        }
    }
}

/* The reduced system's energy grows with the mesh where supports move the body; the body's own does not. */
TEST(the_potential_energy_is_the_body_s)
{
    double primal[2], potential[2];
    for (int k = 0; k < 2; k++) {
        uz_scene s = hertz("quad4", 40 << k);
        uz_result *result = body_solve(&s, 1e-8);
        primal[k] = result->summary.certificate.energy_primal;
        potential[k] = result->evaluation->potential_energy;
        CHECK_REL(potential[k], result->evaluation->strain_energy, 1e-9); /* there is no load */
        clear(&s, result);
    }
    CHECK_MSG(primal[1] < 1.8 * primal[0] && primal[0] < 0, "%g %g", primal[0], primal[1]);
    CHECK_REL(potential[0], potential[1], 0.02);
    CHECK(potential[1] > 0);
}

static void check_refused(uz_problem *problem, const char *where)
{
    const uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    CHECK_INT(uz_solve(&result, problem, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, where);
    CHECK(!result && err.message[0]);
}

TEST(refusals)
{
    uz_scene s = hertz("quad4", 4);
    quantities asked = {.n = 0};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .quantities = asked.list, .n_quantities = 1};
    ask(&asked, UZ_QUANTITY_CONTACT_FORCE, "top", 0, 0, 0);
    check_refused(&problem, "/quantities/0/on");
    asked.list[0].kind = UZ_QUANTITY_REACTION;
    snprintf(asked.list[0].on, sizeof asked.list[0].on, "bottom");
    check_refused(&problem, "/quantities/0/on");
    asked.list[0].kind = UZ_QUANTITY_MEAN_PRESSURE; /* an empty window */
    check_refused(&problem, "/quantities/0/window");
    asked.list[0].kind = UZ_QUANTITY_DISPLACEMENT;
    snprintf(asked.list[0].on, sizeof asked.list[0].on, "nowhere");
    asked.list[0].asked = true;
    check_refused(&problem, "/solver/accuracy/on");
    uz_scene_clear(&s);
}

/* With cells to be chosen the grid is refined until the interval is as narrow as asked for; on a mesh that is given the
 * outcome says where it is not. */
TEST(a_quantity_may_be_what_is_asked_for)
{
    uz_scene s = hertz("quad4", 8);
    quantities asked = {.n = 0};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .quantities = asked.list, .n_quantities = 1};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    ask(&asked, UZ_QUANTITY_CONTACT_FORCE, "bottom", 0, 0, 0)->asked = true;
    settings.quantity_error = 0.01;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
    CHECK_INT(result->summary.outcome, UZ_MESH_LIMIT);
    CHECK(strstr(result->summary.message, "q0"));
    uz_result_free(result);
    problem.scene.box.automatic = true;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
    const uz_quantity_found *q = &result->evaluation->quantities[0];
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK(0.5 * (q->high - q->low) <= 0.01 * q->value && result->grids->count > 1);
    uz_result_free(result);
    uz_scene_clear(&s);
}
