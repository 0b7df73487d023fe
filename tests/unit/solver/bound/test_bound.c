/* The guaranteed bound on the whole error: its elements, what it proves, and what it refuses. */
#include "bound/bound.h"
#include "bound_shapes.h"
#include "core/alloc.h"
#include "linalg/blas.h"
#include "sanitized.h"
#include "scene_fixture.h"

static qp_random shuffled = {1};

/* Moves the corners within a 60 x 20 body at random, by up to a fifth of a cell of 5 x 5. */
static void shuffle(double *x)
{
    const bool inside = x[0] > 0.01 && x[0] < 59.99 && x[1] > 0.01 && x[1] < 19.99;
    for (int c = 0; c < 2 && inside; c++)
        x[c] += 2 * (random_unit(&shuffled) - 0.5);
}

static uz_result *answer(const uz_scene *scene, bool guaranteed)
{
    return bound_answer(&(uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = *scene}, guaranteed);
}

TEST(elements_leave_no_moment_without_stiffness)
{
    static const double CORNERS[][8] = {{0, 0, 4, 1, 3, 5, 0, 0},    {0, 0, 1, 0, 0, 1e-2, 0, 0},
                                        {0, 0, 1, 0, 1, 1, 0, 1},    {0, 0, 5, 0.5, 4, 3, 1, 2},
                                        {0, 0, 9, 0.1, 7, 1, 0, 2.}, {0, 0, 1, 0, 1, 1e-2, 0, 1e-2}};
    for (int shape = 0; shape < 6; shape++)
        for (int degree = 1; degree <= 2; degree++) {
            const int corners = shape < 2 ? 3 : 4;
            check_element_alone(UZ_PLANE_STRESS, CORNERS[shape], corners, degree, 2 * corners * (degree + 1), 3);
        }
}

/* A constant stress, and with quadratic elements a linear one, is in both spaces. */
TEST(nothing_is_lost_where_the_answer_is_exact)
{
    for (int k = 0; k < 8; k++) {
        const bool weight = k >= 4;
        uz_scene scene = box_scene(60, 20, 12, 4);
        snprintf(scene.box.element, sizeof scene.box.element, "%s", BOUND_ELEMENTS[weight ? 2 + k % 2 : k]);
        body_give_mesh(&scene,
                       k == 5 || k == 7 ? NULL : shuffle); /* a distorted quad8 has no polynomials of degree 2 */
        body_straighten(&scene);
        if (k % 4 == 0 || weight)
            add_support(&scene, "bottom", NAN, 0);
        else /* which give way alike */
            scene.supports[scene.n_supports++] =
                (uz_support){.kind = UZ_SUPPORT_SPRING, .on = "bottom", .spring = {0, 1e5 * k}};
        add_support(&scene, "left", weight ? 0 : 0.01, NAN);
        if (weight) {
            add_support(&scene, "right", 0, NAN);
            scene.model = UZ_PLANE_STRAIN;
            add_load(&scene, "all", 0, -1);
            scene.loads[0].kind = UZ_LOAD_BODY_FORCE;
        } else {
            add_load(&scene, "right", 3, 0);
            add_load(&scene, "top", 0, -0.5);
        }
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved && g.relative < 3e-6, "%s, %s: %g %s", scene.box.element, weight ? "weight" : "tension",
                  g.relative, g.why);
        uz_scene_clear(&scene);
    }
}

/* Two materials in a row, of which neither contracts, and one of them warm: each has its constant strain. */
TEST(each_element_has_its_material)
{
    for (int k = 0; k < 4; k++) {
        uz_scene scene = box_scene(60, 20, 6, 2);
        snprintf(scene.box.element, sizeof scene.box.element, "%s", BOUND_ELEMENTS[k]);
        body_give_mesh(&scene, NULL);
        uz_given_mesh *g = &scene.given;
        for (int half = 0; half < 2; half++) {
            uz_given_group *group = &g->groups[g->n_groups++];
            *group = (uz_given_group){.element = body_room(g->n_elements, sizeof *group->element)};
            snprintf(group->name, sizeof group->name, "%s", half ? "soft" : "stiff");
            for (int64_t e = 0; e < g->n_elements; e++) {
                double x = 0;
                for (int64_t i = g->first[e]; i < g->first[e + 1]; i++)
                    x += g->xyz[2 * g->node[i]] / (double)(g->first[e + 1] - g->first[e]);
                if ((x > 30) == (half == 1))
                    group->element[group->n_elements++] = e;
            }
        }
        snprintf(scene.materials[0].on, sizeof scene.materials[0].on, "stiff");
        scene.materials[0].poisson = 0;
        scene.materials[1] = (uz_material){.on = "soft", .young = 1e3, .expansion = 1e-5};
        scene.n_materials = 2;
        add_support(&scene, "left", 0.01, NAN);
        add_support(&scene, "bottom", NAN, 0);
        add_support(&scene, "top", NAN, 0);
        add_load(&scene, "right", 3, 0);
        add_load(&scene, "soft", 0, 0);
        scene.loads[1].kind = UZ_LOAD_TEMPERATURE;
        scene.loads[1].value = 100;
        const uz_guarantee found = bound_of(&scene);
        CHECK_MSG(found.proved && found.relative < 1e-6, "%s: %g %s", scene.box.element, found.relative, found.why);
        CHECK_MSG(found.bound >= 0 && fabs(found.primal - found.dual) < 1e-9 * fabs(found.dual), "%.12g %.12g",
                  found.primal, found.dual);
        uz_scene_clear(&scene);
    }
}

TEST(paper_body)
{
    static const struct {
        int64_t n;
        double percent, primal, dual;
    } TABLE[] = {{30, 2.54, -3.9608186e-3, -3.9632432e-3}, {60, 1.54, -3.9620174e-3, -3.9629288e-3}};
    for (int k = 0; k < 2; k++) {
        uz_scene scene = paper_scene(TABLE[k].n, TABLE[k].n / 3);
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved && fabs(100 * g.relative - TABLE[k].percent) < 0.006, "%g %s", g.relative, g.why);
        CHECK_REL(g.primal, TABLE[k].primal, 2e-8);
        CHECK_REL(g.dual, TABLE[k].dual, 2e-8);
        CHECK(g.dual <= -3.9627564e-3 && g.primal >= -3.96275666e-3);
        uz_scene_clear(&scene);
    }
}

/* Some of the bodies that `make extremes FILTER=guaranteed` goes through. */
TEST(never_below_the_truth)
{
    double least = INFINITY, sum = 0;
    int count = 0;
    for (uint64_t seed = 1; seed <= 8; seed += (uint64_t)step_of_cases()) {
        const bound_kind kind = seed <= 4 ? BOUND_STRAIGHT : seed <= 6 ? BOUND_RESTING : BOUND_SPRINGS;
        const bound_sweep x = sweep_bounds(seed, kind, 2, 8);
        CHECK_MSG(x.answers == 9 && x.proved == 9, "seed %d: %s", (int)seed, x.why);
        CHECK_MSG(x.highest <= x.lowest + 1e-12 * x.size, "seed %d: %.10e above %.10e", (int)seed, x.highest, x.lowest);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < x.count[k]; i++) {
                least = fmin(least, x.effect[k][i]);
                sum += log(x.effect[k][i]);
                count++;
            }
    }
    CHECK_MSG(least >= 1, "%g", least);
    CHECK_MSG(count > 40 / step_of_cases() && exp(sum / count) < 1.5, "%d: %g", count, exp(sum / count));
}

/* Of n bodies, by every `step`th seed from `first` on: each bound is one of the difference to a finer answer. Returns
 * the geometric mean of all over it. *most (NULL: not wanted): the largest. */
static double over_differences(double *most, bound_kind kind, uint64_t first, uint64_t step, int n, int64_t coarsest,
                               int64_t finest)
{
    double sum = 0, largest = 0;
    int count = 0;
    for (uint64_t seed = first; seed < first + step * (uint64_t)n; seed += step) {
        const bound_sweep x = sweep_differences(seed, kind, coarsest, finest);
        CHECK_MSG(x.answers == 10 && x.proved == 10, "seed %d: %s", (int)seed, x.why);
        CHECK_MSG(x.highest <= x.lowest + 1e-12 * x.size, "seed %d: %.10e above %.10e", (int)seed, x.highest, x.lowest);
        CHECK_MSG(x.least >= 1, "seed %d: %g", (int)seed, x.least);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < x.count[k]; i++, count++) {
                largest = fmax(largest, x.effect[k][i]);
                sum += log(x.effect[k][i]);
            }
    }
    CHECK_INT(count, n * 8);
    if (most)
        *most = largest;
    return exp(sum / count);
}

/* Between nodes answers enter discs: their energies are below the body's, and only differences say their error. */
TEST(never_below_the_truth_before_round_obstacles)
{
    double most;
    const double mean = over_differences(&most, BOUND_ROUND, 1, 4, 3, 3, 9);
    CHECK_MSG(most < 2.5, "%g", most);  /* 3.3 with sides no finer than the answer's */
    CHECK_MSG(mean < 1.45, "%g", mean); /* 1.64 */
}

/* Held by a disc and a wall alone: pressures that turn with the disc hold two of its three motions. What holds them is
 * where the stress itself presses: where the answer does, one of the first body's bounds and one of the second's was
 * not found. */
TEST(never_below_the_truth_where_round_obstacles_hold)
{
    double most;
    const double mean = over_differences(&most, BOUND_PERCHED, 1, 7, 2, 2, 8);
    CHECK_MSG(most < 1.7, "%g", most); /* 2.9 */
    CHECK_MSG(mean < 1.4, "%g", mean);
}

/* Linear elements touch a disc at one node, or two, where what presses in the stress is spread: their distance to the
 * obstacle there is the work of a displacement that brings them closer, which costs less. */
TEST(answers_that_stand_off_where_stress_presses_cost_little)
{
    static const double AS_IT_STANDS[4] = {0.6476, 0.5529, 2.2834e-4, 2.0057e-4};
    for (int k = 0; k < 4; k++) {
        uz_scene scene = bound_scene(k < 2 ? 3 : 16, BOUND_PERCHED, BOUND_ELEMENTS[k % 2], 4);
        scene.box.grading[0] = 1;
        scene.box.cells[0] = 4 * (int64_t)(scene.box.size[0] / scene.box.size[1] + 0.5);
        scene.formulation = UZ_FORMULATION_STANDARD;
        scene.kinematics = UZ_KINEMATICS_FIXED;
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved && g.dual < g.primal, "%s: %g %g", g.why, g.dual, g.primal);
        CHECK_MSG(g.bound < 0.9 * AS_IT_STANDS[k], "%d: %g", k, g.bound);
        uz_scene_clear(&scene);
    }
}

/* Polylines and tables, flat and not, with teeth and without. */
TEST(never_below_the_truth_before_lines)
{
    const double mean = over_differences(NULL, BOUND_LINES, 1, 1, 12, 3, 12);
    CHECK_MSG(mean < 1.35, "%g", mean); /* 1.43 */
}

/* Two parts whose nodes do not meet, of which one ends before the other: what a side that is covered in part lacks
 * between pressure and nothing was most of these bounds. */
TEST(ends_of_what_faces_another_part_cost_little)
{
    static const double WITH_WHOLE_SIDES[2][4] = {{0.0262, 0.0108, 0.0207, 0.00871}, {783, 510, 573, 374}};
    for (int k = 0; k < 8; k++) {
        uz_scene scene = shape_scene(k < 4 ? 8 : 111, 0, BOUND_ELEMENTS[k % 4], 2, false);
        scene.formulation = UZ_FORMULATION_STANDARD;
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved && g.dual < g.primal, "%s: %g %g", g.why, g.dual, g.primal);
        CHECK_MSG(g.bound < WITH_WHOLE_SIDES[k / 4][k % 4] / 3, "%d: %g", k, g.bound);
        uz_scene_clear(&scene);
    }
}

/* Outlines with corners that run inwards, bent and slender patches of materials that differ a thousandfold, in two
 * parts or one, all supports and loads: energies below and above the body's never cross. */
TEST(never_below_the_truth_of_any_outline)
{
    int answers = 0;
    for (uint64_t seed = 1; seed <= 40; seed += (uint64_t)step_of_cases()) {
        const bound_sweep x = sweep_meshes(shape_scene, seed, 0, 1, 3);
        answers += x.answers;
        CHECK_MSG(x.proved == x.answers, "seed %d: %s", (int)seed, x.why);
        CHECK_MSG(x.highest <= x.lowest + 1e-12 * x.size, "seed %d: %.10e above %.10e", (int)seed, x.highest, x.lowest);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < x.count[k]; i++)
                CHECK_MSG(x.effect[k][i] >= 1, "seed %d: %g", (int)seed, x.effect[k][i]);
    }
    CHECK_MSG(answers > 300 / step_of_cases(), "%d", answers);
}

/* A block that a support presses on what is below its bottom. */
static uz_guarantee pressed_block(const char *element, int64_t cells, const uz_contact *below)
{
    uz_scene scene = box_scene(1, 1, cells, cells);
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    scene.kinematics = UZ_KINEMATICS_FIXED;
    scene.materials[0].young = 1000;
    add_support(&scene, "left", 0, NAN);
    add_support(&scene, "top", NAN, -0.01);
    scene.contacts[0] = *below;
    scene.n_contacts = 1;
    snprintf(scene.contacts[0].on, sizeof scene.contacts[0].on, "bottom");
    const uz_guarantee g = bound_of(&scene);
    scene.contacts[0] = (uz_contact){.kind = UZ_OBSTACLE_PLANE}; /* its lists are the caller's */
    uz_scene_clear(&scene);
    return g;
}

/* A block all of whose bottom is in a hole that turns by a fifth of a right angle along it: along the tangents the rows
 * of the stress have what they should have, else sides have a strain there that does not get smaller with them. */
TEST(sides_that_turn_add_no_strain_of_their_own)
{
    static const double BY_THE_DIRECTIONS_ALONE[2][2] = {{0.0174, 0.0621}, {0.0294, 0.0902}};
    static const double LESS[2][2] = {{0.8, 0.98}, {0.7, 0.8}};
    for (int k = 0; k < 4; k++) {
        const bool ring = k >= 2;
        uz_scene scene = box_scene(1, 1, 8, 8);
        snprintf(scene.box.element, sizeof scene.box.element, "%s", k % 2 == 0 ? "quad8" : "quad4");
        scene.kinematics = UZ_KINEMATICS_FIXED;
        scene.model = ring ? UZ_AXISYMMETRIC : UZ_PLANE_STRESS;
        scene.box.origin[0] = ring ? 1 : 0;
        scene.materials[0].young = 1000;
        add_support(&scene, "top", NAN, -0.2);
        for (int side = 0; side < 2 && !ring; side++)
            add_support(&scene, side == 0 ? "left" : "right", 0, NAN);
        scene.contacts[0] = (uz_contact){
            .kind = UZ_OBSTACLE_ROUND, .on = "bottom", .point = {scene.box.origin[0], 5}, .radius = 5, .inside = true};
        scene.n_contacts = 1;
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved && g.dual < g.primal, "%s: %g %g", g.why, g.dual, g.primal);
        CHECK_MSG(g.relative < LESS[k / 2][k % 2] * BY_THE_DIRECTIONS_ALONE[k / 2][k % 2], "%d: %g", k, g.relative);
        uz_scene_clear(&scene);
    }
}

/* One segment, or flat values, however many points it has. */
TEST(a_line_of_one_direction_is_a_plane)
{
    double x[] = {-1, 0.3, 0.52, 3}, y[] = {0, 0, 0, 0};
    for (int i = 0; i < 4; i++)
        y[i] = -0.007 * x[i];
    for (int k = 0; k < 4; k++) {
        const uz_contact plane = {.kind = UZ_OBSTACLE_PLANE, .normal = {0.007, 1}};
        const uz_contact line = {.kind = UZ_OBSTACLE_POLYLINE, .n_x = 4, .x = x, .y = y};
        const uz_contact table = {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 4, .x = x, .z = y};
        const uz_guarantee of = pressed_block(BOUND_ELEMENTS[k], 6, &plane);
        const uz_guarantee by[] = {pressed_block(BOUND_ELEMENTS[k], 6, &line),
                                   pressed_block(BOUND_ELEMENTS[k], 6, &table)};
        CHECK_MSG(of.proved && by[0].proved && by[1].proved, "%s %s", by[0].why, by[1].why);
        for (int i = 0; i < 2; i++) {
            CHECK_REL(by[i].bound, of.bound, 1e-6);
            CHECK_REL(by[i].primal, of.primal, 1e-11);
            CHECK_REL(by[i].dual, of.dual, 1e-11);
        }
    }
}

/* The paper's body, held on top and pressed down on a line that bends a little: unknowns of the mesh that proves most.
 */
static uz_guarantee pressed_on_bends(int64_t cells, bool bends)
{
    static const double X[] = {-10, 12, 25, 37, 70}, Y[] = {-0.03, -0.01, 0, -0.004, -0.05};
    uz_scene scene = paper_scene(3 * cells, cells);
    double x[5], y[5];
    memcpy(x, X, sizeof x);
    memcpy(y, Y, sizeof y);
    scene.kinematics = UZ_KINEMATICS_FIXED;
    scene.n_supports = scene.n_loads = 0;
    add_support(&scene, "top", 0, -0.02);
    if (bends) {
        scene.contacts[0].kind = UZ_OBSTACLE_POLYLINE;
        scene.contacts[0].n_x = 5;
        scene.contacts[0].x = x;
        scene.contacts[0].y = y;
    }
    const uz_guarantee g = bound_of(&scene);
    scene.contacts[0] = (uz_contact){.kind = UZ_OBSTACLE_PLANE};
    uz_scene_clear(&scene);
    return g;
}

/* What little a bound has along the contact is not worth a closer mesh there; what is too coarse for its contact is. */
TEST(sides_are_closer_where_they_are_too_long_for_the_contact)
{
    for (int k = 0; k < 2; k++) {
        const int64_t cells = k == 0 ? 12 : 40;
        const uz_guarantee of = pressed_on_bends(cells, false), by = pressed_on_bends(cells, true);
        CHECK_MSG(of.proved && by.proved, "%s %s", of.why, by.why);
        CHECK_INT(by.unknowns > of.unknowns, k == 0);
        CHECK_MSG(by.bound < (k == 0 ? 1.18 : 0.347), "%g", by.bound); /* without closer sides 1.47, with them 0.341 */
    }
}

/* Tangents of a circle, or chords of a hole: the more there are the nearer is the bound to that of the circle. */
TEST(a_line_of_many_segments_is_a_circle)
{
    enum { MOST = 3001 };
    static double x[MOST], y[MOST];
    for (int k = 0; k < 8; k += step_of_cases()) {
        const bool inside = k >= 4;
        const uz_contact circle = {.kind = UZ_OBSTACLE_ROUND,
                                   .point = {0.4, inside ? sqrt(16 - 0.36) : -2},
                                   .radius = inside ? 4 : 2,
                                   .inside = inside};
        const uz_guarantee of = pressed_block(BOUND_ELEMENTS[k % 4], 8, &circle);
        double off[2];
        for (int fine = 0; fine < 2; fine++) {
            const int n = fine ? MOST : 301;
            const double r = inside ? 4 : 2 / cos(0.45 / (n - 1));
            for (int i = 0; i < n; i++) {
                const double angle = 0.9 * ((double)i / (n - 1) - 0.5);
                x[i] = circle.point[0] + r * sin(angle);
                y[i] = circle.point[1] + (inside ? -r : r) * cos(angle);
            }
            const uz_guarantee by = pressed_block(
                BOUND_ELEMENTS[k % 4], 8, &(uz_contact){.kind = UZ_OBSTACLE_POLYLINE, .n_x = n, .x = x, .y = y});
            CHECK_MSG(of.proved && by.proved, "%s %s", of.why, by.why);
            off[fine] = fabs(by.dual - of.dual) / fabs(of.dual);
            CHECK_MSG(fabs(by.bound / of.bound - 1) < 0.3, "%d %d: %g, %g", k, fine, by.bound, of.bound);
        }
        CHECK_MSG(off[0] < 0.02 && off[1] < 0.005, "%d: %g %g", k, off[0], off[1]);
    }
}

/* A disc of 10,000 lengths is a plane, and presses on nodes as that does. */
TEST(a_large_disc_is_a_plane)
{
    uz_guarantee g[2];
    for (int k = 0; k < 2; k++) {
        uz_scene scene = paper_scene(24, 8);
        if (k == 1) {
            scene.contacts[0].kind = UZ_OBSTACLE_ROUND;
            scene.contacts[0].point[0] = 30;
            scene.contacts[0].radius = 6e9;
            scene.contacts[0].point[1] = -6e9;
        }
        g[k] = bound_of(&scene);
        CHECK_MSG(g[k].proved, "%s", g[k].why);
        uz_scene_clear(&scene);
    }
    CHECK_REL(g[1].bound, g[0].bound, 1e-2);
    CHECK_REL(g[1].dual, g[0].dual, 1e-4);
}

/* ---- the check finds what is wrong with a stress, a displacement, a contact */

TEST(check_trusts_nobody)
{
    uz_scene scene = paper_scene(12, 4);
    uz_result *result = answer(&scene, false);
    uz_body_model model;
    uz_bound_body body;
    uz_bound_check_result good, bad;
    uz_qp qp;
    uz_error err = {0};
    int64_t *dof;
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_OUTLINE, &err) == UZ_OK);
    CHECK(uz_bound_body_make(&body, &model, &scene, &err) == UZ_OK);
    CHECK(uz_bound_dual_problem(&qp, &dof, &body, NULL, &err) == UZ_OK);
    const int64_t n = qp.K.cols, entries = model.mesh.n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3;
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = qp};
    uz_settings settings = uz_settings_default();
    uz_result *dual;
    double *stress = zeros(entries);
    CHECK(uz_solve(&dual, &problem, &settings, NULL, NULL, &err) == UZ_OK);
    CHECK(uz_bound_stress(stress, &body, dof, dual->u, NULL, &err) == UZ_OK);
    CHECK(uz_bound_check(&good, &body, &scene, dof, n, result->u, NULL, stress, &err) == UZ_OK);
    CHECK_STR(good.fault, "");
    CHECK(uz_bound_error(&good, 0) > 0 && isfinite(uz_bound_error(&good, 0)));
    CHECK(uz_norm(n, good.residual) < 1e-9 * uz_norm(n, qp.p));
    for (int wrong = 0; wrong < 5; wrong++) {
        double *u = zeros(2 * model.mesh.n_nodes), *s = zeros(entries);
        memcpy(u, result->u, (size_t)(2 * model.mesh.n_nodes) * sizeof *u);
        memcpy(s, stress, (size_t)entries * sizeof *s);
        if (wrong == 0) /* a part on its own */
            s[0] *= 1.001;
        if (wrong == 1) /* in equilibrium with other loads: what is missing is told */
            for (int64_t i = 0; i < entries; i++)
                s[i] *= 1.01;
        if (wrong == 2) /* in the obstacle: at a price */
            for (int64_t a = 0; a < model.mesh.n_nodes; a++)
                u[2 * a + 1] -= model.mesh.xyz[2 * a] > 30 ? 1e-5 : 0;
        if (wrong == 3) /* off its support */
            u[0] += 1e-6;
        if (wrong == 4) /* another answer */
            for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
                u[i] *= 0.9;
        CHECK(uz_bound_check(&bad, &body, &scene, dof, n, u, NULL, s, &err) == UZ_OK);
        if (wrong == 0 || wrong == 3)
            CHECK_MSG(*bad.fault && isinf(uz_bound_error(&bad, 0)), "%d", wrong);
        if (wrong == 1)
            CHECK(!*bad.fault && uz_norm(n, bad.residual) > 1e-3 * uz_norm(n, qp.p));
        if (wrong == 2)
            CHECK(!*bad.fault && bad.lift > 0);
        if (wrong == 2 || wrong == 4)
            CHECK(uz_bound_error(&bad, 0) > 1.01 * uz_bound_error(&good, 0));
        uz_bound_check_clear(&bad);
        free(u);
        free(s);
    }
    uz_bound_check_clear(&good);
    free(stress);
    free(dof);
    uz_result_free(dual);
    uz_result_free(result);
    uz_qp_clear(&qp);
    uz_bound_body_clear(&body);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* On a floor, or in a corner: lifted off, its gap is more by the work of its weight, whatever stresses lack of
 * equilibrium, as that does no work on motions. */
TEST(what_only_obstacles_hold)
{
    for (int k = 0; k < 2; k++) {
        uz_scene scene = box_scene(60, 20, 6, 2);
        snprintf(scene.box.element, sizeof scene.box.element, "%s", k == 0 ? "tri3" : "quad8");
        add_plane(&scene, "bottom", 0, 0, 0, 1);
        if (k == 0)
            add_support(&scene, "left", 0, NAN);
        else
            add_plane(&scene, "left", 0, 0, 1, 0);
        add_load(&scene, "all", k == 0 ? 0 : -0.5, -2);
        scene.loads[0].kind = UZ_LOAD_BODY_FORCE;
        uz_result *result = answer(&scene, true);
        uz_body_model model;
        uz_bound_body body;
        uz_bound_check_result good, off;
        uz_qp qp;
        uz_error err = {0};
        int64_t *dof;
        CHECK_MSG(result->summary.guarantee.proved, "%s", result->summary.guarantee.why);
        CHECK(uz_body_model_build(&model, &scene, UZ_BODY_OUTLINE, &err) == UZ_OK);
        CHECK(uz_bound_body_make(&body, &model, &scene, &err) == UZ_OK);
        CHECK_INT(body.n_loose, k == 0 ? 1 : 3);
        double *press = zeros(model.mesh.n_nodes), *u = zeros(2 * model.mesh.n_nodes);
        double *stress = zeros(model.mesh.n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3);
        double *moments = zeros(body.n_edges * UZ_BOUND_MOMENTS);
        uz_bound_hold(&body, moments);
        CHECK_MSG(strstr(body.why, "too few"), "%s", body.why);
        for (int64_t i = 0; i < result->m; i++)
            press[result->mesh.contact_node[i]] = 1;
        *body.why = 0;
        uz_bound_pressure_at_moments(moments, &body, press);
        uz_bound_hold(&body, moments);
        free(moments);
        CHECK_INT(body.n_pressed, body.n_loose);
        CHECK(uz_bound_dual_problem(&qp, &dof, &body, NULL, &err) == UZ_OK);
        uz_problem dual = {.kind = UZ_PROBLEM_MATRICES, .qp = qp};
        uz_settings settings = uz_settings_default();
        uz_result *v = NULL;
        CHECK(uz_solve(&v, &dual, &settings, NULL, NULL, &err) == UZ_OK);
        for (int wrong = 0; wrong < 2; wrong++) { /* tractions that leave jumps */
            for (int64_t i = 0; i < qp.K.cols && wrong == 1; i++)
                v->u[i] *= 1 + 0.01 * sin((double)i);
            for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
                u[i] = result->u[i] + (i % 2 == 1 ? 0.125 : 0);
            CHECK(uz_bound_stress(stress, &body, dof, v->u, NULL, &err) == UZ_OK);
            CHECK(uz_bound_check(&good, &body, &scene, dof, qp.K.cols, result->u, NULL, stress, &err) == UZ_OK);
            CHECK(uz_bound_check(&off, &body, &scene, dof, qp.K.cols, u, NULL, stress, &err) == UZ_OK);
            CHECK_STR(good.fault, "");
            CHECK((uz_norm(qp.K.cols, good.residual) > 1) == (wrong == 1));
            CHECK_REL(off.gap - good.gap, 0.125 * 2 * 60 * 20 * scene.thickness, 1e-9);
            uz_bound_check_clear(&good);
            uz_bound_check_clear(&off);
        }
        uz_free_all(press, stress, u, dof);
        uz_result_free(v);
        uz_qp_clear(&qp);
        uz_result_free(result);
        uz_bound_body_clear(&body);
        uz_body_model_clear(&model);
        uz_scene_clear(&scene);
    }
}

/* Held along a slide and stopped by an obstacle, a side has one way out of it, whatever the obstacle's normal is: here
 * a bottom that rests is moved into it at one node, and only the opposite of that is zero at the supports. */
TEST(what_leaves_the_obstacle_keeps_to_the_supports)
{
    uz_scene scene = box_scene(60, 20, 6, 2);
    snprintf(scene.box.element, sizeof scene.box.element, "quad8");
    add_support(&scene, "top", NAN, 0);
    scene.supports[scene.n_supports++] = (uz_support){.kind = UZ_SUPPORT_NORMAL, .on = "bottom", .normal = {0.8, 0.6}};
    add_load(&scene, "bottom", 1, -1);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    uz_result *result = answer(&scene, false);
    uz_body_model model;
    uz_bound_body body;
    uz_bound_check_result moved, alone;
    uz_qp qp;
    uz_error err = {0};
    int64_t *dof;
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_OUTLINE, &err) == UZ_OK);
    CHECK(uz_bound_body_make(&body, &model, &scene, &err) == UZ_OK);
    CHECK(uz_bound_dual_problem(&qp, &dof, &body, NULL, &err) == UZ_OK);
    double *stress = zeros(model.mesh.n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3);
    double *u = zeros(2 * model.mesh.n_nodes), *bump = zeros(2 * model.mesh.n_nodes);
    int64_t middle = 0;
    while (fabs(model.mesh.xyz[2 * middle] - 25) > 1e-9 || model.mesh.xyz[2 * middle + 1] > 0)
        middle++;
    bump[2 * middle] = 0.6e-3;
    bump[2 * middle + 1] = -0.8e-3;
    for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
        u[i] = result->u[i] + bump[i];
    CHECK(fabs(result->u[2 * middle]) < 1e-12 && fabs(result->u[2 * middle + 1]) < 1e-12);
    CHECK(uz_bound_check(&alone, &body, &scene, dof, qp.K.cols, bump, NULL, stress, &err) == UZ_OK);
    CHECK(uz_bound_check(&moved, &body, &scene, dof, qp.K.cols, u, NULL, stress, &err) == UZ_OK);
    CHECK_STR(moved.fault, "");
    CHECK_REL(moved.lift, alone.norm, 1e-6);
    uz_bound_check_clear(&moved);
    uz_bound_check_clear(&alone);
    uz_free_all(stress, bump, u, dof);
    uz_qp_clear(&qp);
    uz_result_free(result);
    uz_bound_body_clear(&body);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* A held corner stands as far in the obstacle as the body moves, which is next to nothing. */
TEST(small_displacements_excuse_nothing)
{
    uz_scene scene = paper_scene(6, 2);
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 2; c++)
            scene.loads[k].v[c] *= 1e-8;
    scene.contacts[0].point[1] = 1e-12;
    const uz_guarantee g = bound_of(&scene);
    CHECK_MSG(!g.proved && strstr(g.why, "keep it there"), "%g %s", g.relative, g.why);
    uz_scene_clear(&scene);
}

/* All nodes of the border, and the border: diagonals that cut off corners between them are not held. */
/* Squares of what is as small as this are 0, and so would be the bound: an error of 2e-303 was proved to be 1e-313. */
TEST(what_underflows_is_not_proved)
{
    for (int k = 0; k < 3; k++) {
        uz_scene scene = paper_scene(6, 2);
        const double times[] = {1e-100, 1e-155, 1e-300};
        for (int64_t i = 0; i < scene.n_loads; i++)
            for (int c = 0; c < 2; c++)
                scene.loads[i].v[c] *= times[k];
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved == (k == 0) && (g.proved || (isinf(g.bound) && strstr(g.why, "too small"))), "%g: %g %s",
                  times[k], g.bound, g.why);
        uz_scene_clear(&scene);
    }
}

TEST(nodes_hold_the_border_that_they_are_on)
{
    double least[2];
    for (int k = 0; k < 2; k++) {
        uz_scene scene = box_scene(60, 20, 3, 2);
        snprintf(scene.box.element, sizeof scene.box.element, "tri3");
        body_give_mesh(&scene, NULL);
        uz_given_mesh *mesh = &scene.given;
        uz_given_group *group = &mesh->groups[mesh->n_groups++];
        *group = (uz_given_group){.name = "rim", .node = calloc((size_t)mesh->n_nodes, sizeof *group->node)};
        for (int64_t a = 0; a < mesh->n_nodes; a++) {
            const double *x = mesh->xyz + 2 * a;
            if (!(x[0] > 1e-9 && x[0] < 60 - 1e-9 && x[1] > 1e-9 && x[1] < 20 - 1e-9))
                group->node[group->n_nodes++] = a;
        }
        add_support(&scene, k == 0 ? "boundary" : "rim", 0, 0);
        add_load(&scene, "all", 1, -2);
        scene.loads[0].kind = UZ_LOAD_BODY_FORCE;
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(g.proved, "%s", g.why);
        least[k] = g.dual;
        uz_scene_clear(&scene);
    }
    CHECK_REL(least[1], least[0], 1e-12);
}

TEST(what_is_not_proved_is_named)
{
    static const char *const WHY[] = {"springs hold too", "node",       "no way out",
                                      "single nodes",     "revolution", "normal turns"};
    for (int k = 0; k < 6; k++) {
        uz_scene scene = paper_scene(6, 2);
        if (k == 0)
            scene.supports[scene.n_supports++] =
                (uz_support){.kind = UZ_SUPPORT_SPRING, .on = "left", .spring = {1, 1}};
        if (k == 1)
            scene.loads[scene.n_loads++] = (uz_load){.kind = UZ_LOAD_NODE_FORCE, .node = 20, .v = {1, 0}};
        if (k == 2) {
            uz_contact *c = &scene.contacts[0];
            c->kind = UZ_OBSTACLE_HEIGHT;
            c->n_x = 3;
            c->x = calloc(3, sizeof *c->x);
            c->z = calloc(3, sizeof *c->z);
            for (int i = 0; i < 3; i++) { /* the body stands in a ridge */
                c->x[i] = 25 + 5 * i;
                c->z[i] = i == 1 ? 2 : -5;
            }
        }
        if (k == 5) {
            scene.contacts[0].kind = UZ_OBSTACLE_ROUND;
            scene.contacts[0].point[0] = 30;
            scene.contacts[0].point[1] = -9;
            scene.contacts[0].radius = 9;
            add_support(&scene, "bottom", 0, NAN);
        }
        if (k == 3) {
            int64_t *node = calloc(1, sizeof *node);
            body_give_mesh(&scene, NULL);
            *node = 6;
            scene.given.groups[scene.given.n_groups] = (uz_given_group){.name = "corner", .n_nodes = 1, .node = node};
            scene.given.n_groups++;
            add_support(&scene, "corner", 0, NAN);
        }
        if (k == 4)
            scene.model = UZ_AXISYMMETRIC;
        const uz_guarantee g = bound_of(&scene);
        CHECK_MSG(!g.proved && isinf(g.bound) && strstr(g.why, WHY[k]), "%d: \"%s\"", k, g.why);
        uz_scene_clear(&scene);
    }
}

TEST(a_whole_error_that_is_asked_for)
{
    for (int k = 0; k < 4; k++) {
        uz_scene scene = paper_scene(30, 10);
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
        uz_settings settings = uz_settings_default();
        uz_result *result;
        uz_error err = {0};
        settings.guaranteed = k % 2 == 0;
        settings.total_error = k < 2 ? 0.03 : 0.01;
        CHECK(uz_solve(&result, &problem, &settings, NULL, NULL, &err) == UZ_OK);
        CHECK_INT(result->summary.outcome, k < 2 ? UZ_CONVERGED : UZ_MESH_LIMIT);
        CHECK_INT(result->summary.guarantee.proved, k % 2 == 0);
        uz_result_free(result);
        uz_scene_clear(&scene);
    }
}
