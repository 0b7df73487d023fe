/* What the summary of a scene says of its answer: resultants and their balance, energy, pressure, doubts. */
#include "theory.h"
#include "core/random.h"

enum { N_ELEMENTS = UZ_ELEMENT_KINDS };

static bool is_solid(int element)
{
    return uz_element_type_of((uz_element_kind)element)->dim == 3;
}

static void clear(uz_scene *scene, uz_result *result)
{
    uz_result_free(result);
    uz_scene_clear(scene);
}

/* Sum of what acts: forces, and moments about the origin. */
static void add_up(double force[3], double moment[3], const uz_evaluation *e)
{
    for (int c = 0; c < 3; c++) {
        force[c] = e->loads.force[c];
        moment[c] = e->loads.moment[c];
        for (int64_t i = 0; i < e->n_contacts; i++) {
            force[c] += e->contacts[i].force[c];
            moment[c] += e->contacts[i].moment[c];
        }
        for (int64_t i = 0; i < e->n_supports; i++) {
            force[c] += e->supports[i].force[c];
            moment[c] += e->supports[i].moment[c];
        }
    }
}

/* A block 2 x 1 [x 1], pressed on a plane by a uniform pressure q, free to spread. */
static uz_scene pressed(uz_model model, const char *element, double q)
{
    const double size[3] = {2, 1, 1}, zero[3] = {0}, up[3] = {0, 1, 0};
    uz_scene s = body_scene(model, element, size, (int64_t[3]){4, 2, 2});
    s.thickness = 0.5;
    body_plane(&s, "bottom", zero, up);
    body_load(&s, UZ_LOAD_PRESSURE, "top", q, 0, 0);
    if (model != UZ_AXISYMMETRIC)
        body_hold(&s, "left", 0, NAN, NAN);
    if (model == UZ_SOLID)
        body_hold(&s, "back", NAN, NAN, 0);
    return s;
}

static void check_pressed(uz_model model, const char *element)
{
    uz_scene s = pressed(model, element, 7);
    uz_result *result = body_solve(&s, 0);
    const uz_evaluation *e = result->evaluation;
    const double area = model == UZ_AXISYMMETRIC ? 4 * M_PI : model == UZ_SOLID ? 2 : 1;
    for (int64_t i = 0; i < result->m; i++)
        CHECK_MSG(fabs(result->pressure[i] - 7) <= 1e-6, "%s %d: pressure %g", element, model, result->pressure[i]);
    CHECK(fabs(result->summary.max_pressure - 7) <= 1e-6);
    CHECK(e->peak_node >= 0 && e->peak_at[1] == 0);
    CHECK(fabs(e->contacts[0].force[1] - 7 * area) <= 1e-7 * area);
    CHECK(fabs(e->loads.force[1] + 7 * area) <= 1e-11 * area);
    const uz_contact_total *total = &e->totals[0];
    const double center[3] = {model == UZ_AXISYMMETRIC ? 4.0 / 3 : 1, 0, model == UZ_SOLID ? 0.5 : 0};
    CHECK_REL(total->normal_force, 7 * area, 1e-7);
    CHECK_REL(total->area, area, 1e-12);
    CHECK(fabs(total->mean_pressure - 7) <= 1e-6 && total->max_pressure == result->summary.max_pressure);
    for (int c = 0; c < (model == UZ_SOLID ? 3 : 2); c++)
        CHECK_MSG(fabs(total->center[c] - center[c]) <= 1e-6, "%s %d: center[%d] is %g", element, model, c,
                  total->center[c]);
    CHECK(e->n_supports == 0 || fabs(e->supports[0].force[0]) <= 1e-6);
    CHECK_MSG(e->imbalance <= 1e-8, "%s %d: %g", element, model, e->imbalance);
    CHECK_INT(e->n_warnings, 0);
    /* 1/2 stress strain volume: in plane strain and in a slice held in z with 1 - nu^2 for the held direction */
    const double held = model == UZ_PLANE_STRAIN ? 1 - 0.09 : 1;
    CHECK_REL(e->strain_energy, 0.5 * 49 / 200e3 * area * held, 1e-7);
    clear(&s, result);
}

TEST(a_uniform_pressure_is_found_on_every_side)
{
    for (int i = 0; i < N_ELEMENTS; i++) {
        const char *name = uz_element_name((uz_element_kind)i);
        if (is_solid(i)) {
            check_pressed(UZ_SOLID, name);
            continue;
        }
        check_pressed(UZ_PLANE_STRESS, name);
        check_pressed(UZ_PLANE_STRAIN, name);
        check_pressed(UZ_AXISYMMETRIC, name);
    }
}

static double between(uint64_t *random, double low, double high)
{
    return low + (high - low) * uz_uniform(random);
}

/* Loads of all kinds, supports of all kinds, an oblique obstacle. */
static uz_scene mixed(uint64_t *random, int element)
{
    const bool solid = is_solid(element);
    const char *name = uz_element_name((uz_element_kind)element);
    const double size[3] = {3, 2, 1.5};
    uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, name, size, (int64_t[3]){3, 2, 2});
    for (int c = 0; c < 3; c++)
        s.box.origin[c] = between(random, -50, 50);
    s.materials[0].young = 2e3;
    s.materials[0].density = 2;
    s.materials[0].expansion = 1e-5;
    const double n[3] = {between(random, 0.2, 1), between(random, 0.2, 1), solid ? between(random, 0.2, 1) : 0};
    body_hold_normal(&s, "left", n, between(random, -1e-3, 1e-3));
    body_hold(&s, "left", NAN, 0, NAN);
    if (solid)
        body_hold(&s, "left", NAN, NAN, 1e-4);
    body_hold(&s, "right", between(random, -1e-4, 1e-4), NAN, NAN);
    body_spring(&s, "right", 1e4, 3e4, solid ? 2e4 : 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", between(random, -9, 9), between(random, -9, 9), solid ? 3 : 0);
    body_load(&s, UZ_LOAD_PRESSURE, "top", between(random, 5, 30), 0, 0);
    body_load(&s, UZ_LOAD_FORCE, "bottom", between(random, -9, 9), between(random, -9, 9), solid ? 4 : 0);
    body_load(&s, UZ_LOAD_GRAVITY, "all", 0, -9.81, 0);
    body_load(&s, UZ_LOAD_BODY_FORCE, "all", 1, 2, solid ? 3 : 0);
    body_load(&s, UZ_LOAD_TEMPERATURE, "all", between(random, -50, 50), 0, 0);
    body_load(&s, UZ_LOAD_NODE_FORCE, "", 5, -4, 0)->node = 7;
    const double point[3] = {s.box.origin[0], s.box.origin[1] - 0.002, s.box.origin[2]},
                 oblique[3] = {5e-4, 1, solid ? 2e-4 : 0};
    body_plane(&s, "bottom", point, oblique);
    return s;
}

TEST(forces_and_moments_balance)
{
    uint64_t random = 3;
    int touching = 0;
    for (int i = 0; i < 4 * N_ELEMENTS; i++) {
        uz_scene s = mixed(&random, i % N_ELEMENTS);
        uz_result *result = body_solve(&s, 1e-10);
        const uz_evaluation *e = result->evaluation;
        double force[3], moment[3], size = 0, lever = 0;
        touching += result->summary.active > 0;
        add_up(force, moment, e);
        for (int64_t k = 0; k < e->n_supports; k++) {
            size += body_most(e->supports[k].force, 3);
            lever += body_most(e->supports[k].moment, 3);
        }
        CHECK_MSG(e->imbalance <= 1e-8, "%s: %g", s.box.element, e->imbalance);
        CHECK_MSG(body_most(force, 3) <= 1e-7 * size, "%s: force %g of %g", s.box.element, body_most(force, 3), size);
        CHECK_MSG(body_most(moment, 3) <= 1e-7 * (lever + 100 * size), "%s: moment %g of %g", s.box.element,
                  body_most(moment, 3), lever);
        clear(&s, result);
    }
    CHECK_MSG(touching > N_ELEMENTS, "%d touch", touching);
}

/* A support acts along its own directions alone. */
TEST(each_support_has_its_own_share)
{
    const double size[3] = {2, 1, 0}, oblique[3] = {3, 4, 0};
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", size, (int64_t[3]){4, 2, 0});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold_normal(&s, "right", oblique, 0);
    body_load(&s, UZ_LOAD_TRACTION, "top", 5, -20, 0);
    uz_result *result = body_solve(&s, 0);
    const uz_evaluation *e = result->evaluation;
    CHECK(e->supports[0].force[0] != 0 && e->supports[0].force[1] == 0);
    CHECK(e->supports[1].force[1] != 0 && e->supports[1].force[0] == 0);
    CHECK_REL(e->supports[2].force[1], e->supports[2].force[0] * 4 / 3, 1e-12);
    CHECK(fabs(e->supports[2].force[0]) > 1e-3);
    CHECK(e->imbalance < 1e-10);
    clear(&s, result);
}

TEST(a_body_on_springs)
{
    const double size[3] = {2, 1, 0};
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", size, (int64_t[3]){4, 2, 0});
    body_hold(&s, "left", 0, NAN, NAN);
    body_spring(&s, "bottom", 0, 50, 0);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -3, 0);
    uz_result *result = body_solve(&s, 1e-10);
    const uz_evaluation *e = result->evaluation;
    CHECK_REL(e->supports[1].force[1], 6.0, 1e-9);
    CHECK_REL(e->supports[1].moment[2], 6.0, 1e-9);
    CHECK(e->imbalance < 1e-10);
    CHECK(e->strain_energy > 0.5 * 6 * 6 / 50); /* the springs' and a little of the body's */
    CHECK_REL(e->strain_energy, 0.5 * 6 * 6 / 50, 1e-3);
    clear(&s, result);
}

/* Free growth stores nothing; held warmth stores 1/2 stress strain. */
/* Forces that balance to a hundredth only work along with the whole body; its strain does not. */
TEST(energy_of_a_rough_answer_on_a_moved_support)
{
    for (int k = 0; k < 2; k++) {
        uz_scene s = pressed(UZ_PLANE_STRAIN, "quad4", 7);
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
        uz_settings settings = uz_settings_default();
        uz_result *rough = NULL;
        uz_error err = {0};
        body_hold(&s, "top", NAN, k == 0 ? -1e-5 : -0.1, NAN);
        s.contacts[0].point[1] = k == 0 ? 0 : 1e-5 - 0.1; /* both are pressed by the same */
        uz_result *exact = body_solve(&s, 1e-10);
        problem.scene = s;
        settings.relative_error = 0.3;
        settings.method = UZ_METHOD_UZAWA;
        CHECK_MSG(uz_solve(&rough, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_REL(rough->evaluation->strain_energy, exact->evaluation->strain_energy, 0.5);
        uz_result_free(rough);
        clear(&s, exact);
    }
}

TEST(energy_of_warmth)
{
    for (int held = 0; held < 2; held++) {
        const double size[3] = {2, 1, 0};
        uz_scene s = body_scene(UZ_PLANE_STRESS, "quad8", size, (int64_t[3]){3, 2, 0});
        s.materials[0].expansion = 1e-5;
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
        if (held)
            body_hold(&s, "right", 0, NAN, NAN);
        body_load(&s, UZ_LOAD_TEMPERATURE, "all", 100, 0, 0);
        uz_result *result = body_solve(&s, 0);
        const double whole = 0.5 * 200e3 * 1e-3 * 1e-3 * 2;
        CHECK_MSG(fabs(result->evaluation->strain_energy - held * whole) <= 1e-9 * whole, "%g",
                  result->evaluation->strain_energy);
        CHECK(result->evaluation->imbalance < 1e-12);
        clear(&s, result);
    }
}

static const uz_warning *warning(const uz_result *result, const char *code)
{
    for (int i = 0; i < result->evaluation->n_warnings; i++)
        if (strcmp(result->evaluation->warnings[i].code, code) == 0)
            return &result->evaluation->warnings[i];
    return NULL;
}

/* A cantilever bent to a slope at its end, and a strip pulled to a strain. */
TEST(large_deformation_is_doubted)
{
    const double size[3] = {10, 0.5, 0};
    for (int i = 0; i < 2; i++) {
        uz_scene s = body_scene(UZ_PLANE_STRESS, "quad8", size, (int64_t[3]){20, 2, 0});
        const double slope = i == 0 ? 0.05 : 0.2, inertia = 0.5 * 0.5 * 0.5 / 12;
        body_hold(&s, "left", 0, 0, NAN);
        body_load(&s, UZ_LOAD_FORCE, "right", 0, -slope * 2 * 200e3 * inertia / 100, 0);
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "large_rotation");
        CHECK_INT(w != NULL, i);
        if (w) {
            CHECK_REL(w->value, slope, 0.02);
            CHECK(strstr(w->message, "rad") != NULL);
        }
        CHECK(!warning(result, "large_strain"));
        clear(&s, result);
    }
    for (int k = 0; k < 4; k++) {
        const int i = k % 2;
        uz_scene s = body_scene(UZ_PLANE_STRESS, k < 2 ? "tri3" : "quad4", size, (int64_t[3]){20, 2, 0});
        const double strain = i == 0 ? 0.04 : 0.06;
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
        body_load(&s, UZ_LOAD_TRACTION, "right", strain * 200e3, 0, 0);
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "large_strain");
        CHECK_INT(w != NULL, i);
        if (w)
            CHECK_REL(w->value, strain, 1e-6);
        CHECK(!warning(result, "large_rotation"));
        clear(&s, result);
    }
}

/* A strip on a bowl of radius 1, pushed aside: the normal turns with the place. */
TEST(sliding_on_a_curved_obstacle_is_doubted)
{
    for (int i = 0; i < 2; i++) {
        const double aside = i == 0 ? 0.002 : 0.2;
        uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){0.2, 0.2, 0}, (int64_t[3]){4, 4, 0});
        s.box.origin[0] = -0.1;
        s.kinematics = UZ_KINEMATICS_FIXED;
        body_hold(&s, "top", aside, -0.02, NAN);
        uz_contact *bowl = body_plane(&s, "bottom", (double[3]){0, 1, 0}, (double[3]){0, 1, 0});
        bowl->kind = UZ_OBSTACLE_ROUND;
        bowl->radius = 1;
        bowl->inside = true;
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "sliding");
        CHECK_INT(w != NULL, i);
        if (w) /* the gap closes by 0.2^2 / 2, and as much again by what the surface rises towards the side */
            CHECK_MSG(w->value > 0.7 && w->value < 2.5, "%g", w->value);
        CHECK(w == NULL || w->value == result->summary.geometry.sliding);
        CHECK(result->evaluation->imbalance < 1e-8);
        clear(&s, result);
    }
}

/* Two blocks, one on the other. */
static uz_scene stacked(double aside)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){4, 2, 0});
    uz_scene upper = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){1.6, 1, 0}, (int64_t[3]){4, 2, 0});
    body_give_mesh(&s, NULL);
    body_give_mesh(&upper, NULL);
    for (int64_t i = 0; i < upper.given.n_nodes; i++) {
        upper.given.xyz[2 * i] += 0.2;
        upper.given.xyz[2 * i + 1] += 1;
    }
    theory_join(&s, "lower", &upper, "upper");
    snprintf(s.materials[0].on, sizeof s.materials[0].on, "lower_all");
    s.materials[s.n_materials] = s.materials[0];
    snprintf(s.materials[s.n_materials++].on, sizeof s.materials[0].on, "upper_all");
    body_hold(&s, "lower_bottom", 0, 0, NAN);
    body_hold(&s, "upper_top", aside, NAN, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "upper_top", 3, 0, 0);
    body_load(&s, UZ_LOAD_GRAVITY, "lower_all", 0, -1, 0);
    s.materials[0].density = 0.5;
    uz_contact *contact = body_plane(&s, "upper_bottom", (double[3]){0}, (double[3]){0, 1, 0});
    contact->kind = UZ_OBSTACLE_BODY;
    snprintf(contact->with, sizeof contact->with, "lower_top");
    return s;
}

TEST(two_bodies_balance)
{
    uz_scene s = stacked(0);
    uz_result *result = body_solve(&s, 1e-8);
    const uz_evaluation *e = result->evaluation;
    CHECK_REL(e->contacts[0].force[1], 3 * 1.6, 1e-6);
    CHECK_REL(e->supports[0].force[1], 3 * 1.6 + 0.5 * 2, 1e-6);
    CHECK_MSG(e->imbalance < 1e-6, "%g", e->imbalance);
    CHECK_REL(e->contact_area, 1.6, 1e-12);
    CHECK_INT(e->n_warnings, 2); /* of the mesh, which is coarse, and of the pressure at the upper one's corners */
    CHECK_STR(e->warnings[0].code, "coarse_mesh");
    CHECK_STR(e->warnings[1].code, "pressure_peak");
    clear(&s, result);
}

TEST(sliding_on_a_flat_body_is_doubted)
{
    for (int i = 0; i < 2; i++) {
        uz_scene s = stacked(i == 0 ? 0.05 : 0.3); /* 1.6 long */
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "sliding");
        CHECK_INT(w != NULL, i);
        if (w)
            CHECK_REL(w->value, 0.3 / 1.6, 0.02);
        clear(&s, result);
    }
}

TEST(a_deep_overlap_is_doubted)
{
    for (int i = 0; i < 2; i++) {
        uz_scene s = stacked(0);
        for (int64_t a = 3 * 5; a < s.given.n_nodes; a++) /* of the upper block; faces are 0.5 long */
            s.given.xyz[2 * a + 1] -= i == 0 ? 0.4 : 0.6;
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "deep_overlap");
        CHECK_INT(w != NULL, i);
        if (w)
            CHECK_REL(w->value, 1.2, 1e-9);
        clear(&s, result);
    }
}

/* It has no row, and nothing to be doubted. */
TEST(a_contact_that_supports_hold_all_of)
{
    for (int more = 0; more < 2; more++) {
        uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){4, 2}, (int64_t[3]){4, 2});
        body_hold(&s, "bottom", 0, 0, NAN);
        body_load(&s, UZ_LOAD_TRACTION, "right", 0, -1, 0);
        body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 1});
        if (more)
            body_plane(&s, "left", (double[3]){0}, (double[3]){1, 0});
        uz_result *result = body_solve(&s, 1e-8);
        CHECK_INT(result->m, more ? 2 : 0);
        CHECK(!warning(result, "coarse_contact"));
        clear(&s, result);
    }
}

/* A plane, a circle and a ball below a block, whose bottom is to meet them, and above it. */
TEST(an_obstacle_on_the_wrong_side_is_doubted)
{
    for (int i = 0; i < 8; i++) {
        const bool solid = i >= 4, round = i / 2 % 2, above = i % 2;
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRESS,
                                solid   ? "tet4"
                                : round ? "tri6"
                                        : "quad4",
                                (double[3]){2, 1, 2}, (int64_t[3]){2, 2, 2});
        body_hold(&s, "top", 0, 0, solid ? 0 : NAN);
        uz_contact *x =
            body_plane(&s, "bottom", (double[3]){0, above ? 3 : -0.1, 0}, (double[3]){0, above ? -2 : 2, 0});
        if (round) {
            memcpy(x->point, (double[3]){1, above ? 3 : -1.1, solid ? 1 : 0}, sizeof x->point);
            x->kind = UZ_OBSTACLE_ROUND;
            x->radius = 1;
        }
        body_load(&s, UZ_LOAD_TRACTION, "right", 0, -1, 0);
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "obstacle_behind");
        CHECK_MSG((w != NULL) == above, "scene %d: %s", i, w ? w->message : "no warning");
        CHECK_INT(result->summary.active, 0);
        clear(&s, result);
    }
}

TEST(linear_elements_that_lock_are_doubted)
{
    static const struct {
        const char *element;
        uz_model model;
        uz_formulation formulation;
        double poisson;
        bool locks;
    } rows[] = {{"tri3", UZ_PLANE_STRAIN, UZ_FORMULATION_AUTO, 0.45, true},
                {"tri3", UZ_AXISYMMETRIC, UZ_FORMULATION_AUTO, 0.4999, true},
                {"tet4", UZ_SOLID, UZ_FORMULATION_AUTO, 0.49, true},
                {"quad4", UZ_PLANE_STRAIN, UZ_FORMULATION_STANDARD, 0.49, true},
                {"quad4", UZ_PLANE_STRAIN, UZ_FORMULATION_AUTO, 0.49, false},
                {"quad4", UZ_PLANE_STRAIN, UZ_FORMULATION_INCOMPATIBLE, 0.49, false},
                {"tri3", UZ_PLANE_STRESS, UZ_FORMULATION_AUTO, 0.49, false},
                {"tri3", UZ_PLANE_STRAIN, UZ_FORMULATION_AUTO, 0.44, false},
                {"tri6", UZ_PLANE_STRAIN, UZ_FORMULATION_AUTO, 0.49, false},
                {"hex8", UZ_SOLID, UZ_FORMULATION_AUTO, 0.49, false}};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++) {
        uz_scene s = pressed(rows[k].model, rows[k].element, 7);
        s.formulation = rows[k].formulation;
        s.materials[0].poisson = rows[k].poisson;
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "locking");
        CHECK_MSG((w != NULL) == rows[k].locks, "%s, row %d", rows[k].element, (int)k);
        if (w) {
            CHECK(w->value == rows[k].poisson && strstr(w->message, rows[k].element) != NULL);
            CHECK(strlen(w->message) < sizeof w->message - 1);
        }
        clear(&s, result);
    }
}

/* Numbers are then not those of the file, so that a force at a number would be at another node than was meant. */
TEST(nodes_of_a_file_that_are_left_out_are_told)
{
    for (int i = 0; i < 2; i++) {
        uz_scene s = stacked(0);
        uz_error err = {0};
        s.given.from_file = "/mesh/gmsh";
        if (i == 1) {
            double *more = body_room((s.given.n_nodes + 2) * 2, sizeof *more);
            memcpy(more, s.given.xyz, (size_t)s.given.n_nodes * 2 * sizeof *more);
            free(s.given.xyz);
            s.given.xyz = more;
            s.given.n_nodes += 2;
        }
        uz_result *result = body_solve(&s, 1e-8);
        const uz_warning *w = warning(result, "unused_nodes");
        CHECK_INT(w != NULL, i);
        CHECK(!w || w->value == 2);
        body_load(&s, UZ_LOAD_NODE_FORCE, "", 0, -1, 0)->node = 20;
        CHECK_INT(uz_scene_check(&s, &err), i == 0 ? UZ_OK : UZ_ERR_SCENE);
        CHECK_STR(err.where, i == 0 ? "" : "/loads/2/node");
        clear(&s, result);
    }
}

TEST(units_leave_the_digits)
{
    uint64_t random = 11, again = 11;
    uz_scene mm = mixed(&random, 1), m = mixed(&again, 1);
    const double k = 0.0009765625; /* a power of two near 1/1000: the digits stay the same */
    for (int c = 0; c < 3; c++) {
        m.box.origin[c] *= k;
        m.box.size[c] *= k;
        m.contacts[0].point[c] *= k;
    }
    m.thickness *= k;
    m.materials[0].young /= k * k;
    m.materials[0].density /= k * k * k;
    for (int64_t i = 0; i < m.n_supports; i++)
        for (int c = 0; c < 3; c++) {
            m.supports[i].u[c] *= k;
            m.supports[i].spring[c] /= k;
        }
    m.supports[0].value *= k;
    for (int64_t i = 0; i < m.n_loads; i++) {
        const double stress = 1 / (k * k), volume = stress / k;
        const double factor = m.loads[i].kind == UZ_LOAD_TRACTION || m.loads[i].kind == UZ_LOAD_PRESSURE ? stress
                              : m.loads[i].kind == UZ_LOAD_BODY_FORCE                                    ? volume
                                                                                                         : 1;
        for (int c = 0; c < 3; c++)
            m.loads[i].v[c] *= factor;
        if (m.loads[i].kind == UZ_LOAD_PRESSURE)
            m.loads[i].value *= factor;
    }
    uz_result *a = body_solve(&mm, 1e-10), *b = body_solve(&m, 1e-10);
    CHECK_REL(b->evaluation->strain_energy, a->evaluation->strain_energy * k, 1e-13);
    for (int64_t i = 0; i < a->evaluation->n_supports; i++)
        for (int c = 0; c < 2; c++) {
            const double x = a->evaluation->supports[i].force[c], y = b->evaluation->supports[i].force[c];
            CHECK_MSG(fabs(x - y) <= 1e-10 * fabs(x), "support %d: %.17g %.17g", (int)i, x, y);
        }
    clear(&mm, a);
    clear(&m, b);
}

/* A block 10 x 10 that a support presses on a cylinder: the reduced system's energy grows with the mesh, the body's own
 * does not. Without moved supports they are the same. */
TEST(the_potential_energy_is_that_of_the_body)
{
    double primal[2], potential[2];
    for (int k = 0; k < 4; k++) {
        const bool moved = k < 2;
        const int64_t cells = 30 << (k % 2);
        uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){10, 10, 0}, (int64_t[3]){cells, cells, 0});
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "top", NAN, moved ? -0.1 : 0, NAN);
        uz_contact *contact = body_plane(&s, "bottom", (double[3]){0, moved ? -20 : -20.01, 0}, (double[3]){0});
        contact->kind = UZ_OBSTACLE_ROUND;
        contact->radius = 20;
        if (!moved)
            body_load(&s, UZ_LOAD_BODY_FORCE, "all", 10, -500, 0);
        uz_result *result = body_solve(&s, 1e-8);
        const uz_evaluation *e = result->evaluation;
        CHECK(e->contacts[0].force[1] > 0);
        primal[k % 2] = result->summary.certificate.energy_primal;
        potential[k % 2] = e->potential_energy;
        if (moved)
            CHECK_REL(e->potential_energy, e->strain_energy, 1e-12); /* there is no load */
        else
            CHECK_REL(e->potential_energy, primal[k % 2], 1e-9);
        clear(&s, result);
        if (k == 1)
            CHECK_MSG(primal[1] < 1.8 * primal[0] && primal[0] < 0, "%g %g", primal[0], primal[1]);
        if (k % 2 == 1)
            CHECK_REL(potential[1], potential[0], 0.01);
    }
}
