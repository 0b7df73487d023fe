/* Supports that move a body: errors are relative to what deforms it, not to how far it is carried. */
#include "body_fixture.h"

/* The plate of the paper, its left side held and carried along the plane that it is pressed on: displacements but for
 * the ride, reactions and contacts are those of the plate that stays (sum r = -10.51371700, 22 contacts). */
static uz_scene carried_plate(double ride)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){60, 20, 0}, (int64_t[3]){30, 10, 0});
    s.thickness = 5;
    body_hold(&s, "left", ride, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.05, 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", 0.5, 0, 0);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    return s;
}

static const double REACTION_SUM = -10.513717, STRAIN_ENERGY = 3.9608186040e-3;

/* An error of the norm of `relative` changes the sum of the reactions by a few times that part of it. */
static void check_answer(const uz_result *x, double ride, double relative)
{
    const uz_summary *s = &x->summary;
    CHECK_INT(s->outcome, UZ_CONVERGED);
    CHECK_MSG(fabs(s->reaction_sum - REACTION_SUM) <= (20 * relative + 1e-6) * fabs(REACTION_SUM),
              "carried by %g, asked for %g: the reactions sum to %.9g", ride, relative, s->reaction_sum);
    CHECK_REL(s->certificate.energy_norm, sqrt(2 * STRAIN_ENERGY), 2 * relative + 1e-6);
}

TEST(an_answer_is_as_good_when_the_body_is_carried_far)
{
    static const double rides[] = {0, 0.01, 1, 1000}, errors[] = {1e-2, 1e-4, 1e-6};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_ACTIVE_SET};
    for (int k = 0; k < 4 * 3 * 3; k++) {
        const double ride = rides[k / 9];
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(ride)};
        uz_settings settings = uz_settings_default();
        uz_result *x = NULL;
        uz_error err = {0};
        settings.relative_error = errors[k / 3 % 3];
        settings.method = methods[k % 3];
        CHECK_MSG(uz_solve(&x, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        check_answer(x, ride, settings.relative_error);
        uz_result_free(x);
        uz_scene_clear(&problem.scene);
    }
}

TEST(a_tenth_of_the_mesh_error_is_of_the_deformation)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(1)};
    uz_settings settings = uz_settings_default();
    uz_result *x = NULL;
    settings.balanced = true;
    CHECK(uz_solve(&x, &problem, &settings, NULL, NULL, NULL) == UZ_OK);
    check_answer(x, 1, x->summary.requested_error);
    uz_result_free(x);
    uz_scene_clear(&problem.scene);
}

/* In lanes, certified by a bound on K^-1. */
static void check_cases(double ride, double relative)
{
    uz_scene s = carried_plate(ride);
    enum { CASES = 5 };
    uz_load_case *cases = body_room(CASES, sizeof *cases);
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .cases = cases, .n_cases = CASES};
    uz_settings settings = uz_settings_default();
    uz_result **x = NULL;
    uz_error err = {0};
    for (int k = 0; k < CASES; k++) {
        snprintf(cases[k].name, sizeof cases[k].name, "%d", k);
        cases[k].loads = body_room(s.n_loads, sizeof *cases[k].loads);
        memcpy(cases[k].loads, s.loads, (size_t)s.n_loads * sizeof *s.loads);
        cases[k].n_loads = s.n_loads;
    }
    settings.relative_error = relative;
    CHECK_MSG(uz_solve_cases(&x, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    for (int k = 0; x && k < CASES; k++)
        check_answer(x[k], ride, relative);
    uz_results_free(x, CASES);
    uz_problem_clear(&problem);
}

TEST(load_cases_of_a_carried_body)
{
    check_cases(1, 1e-4);
    check_cases(1000, 1e-6);
}

/* The answer without any contact: 5 % of the strain energy is missing however far the body rides. */
TEST(verify_is_not_impressed_by_the_ride)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(1000)};
    uz_scene *s = &problem.scene;
    uz_settings settings = uz_settings_default();
    uz_result *x = NULL;
    s->n_contacts = 0;
    uz_result *loose = body_solve(s, 1e-6);
    s->n_contacts = 1;
    double *r = body_room(31, sizeof *r);
    settings.relative_error = 1e-2;
    CHECK(uz_verify(&x, &problem, loose->u, r, &settings, NULL, NULL, NULL) == UZ_OK);
    CHECK_INT(x->summary.outcome, UZ_NOT_VERIFIED);
    free(r);
    uz_result_free(loose);
    uz_result_free(x);
    uz_scene_clear(s);
}

/* Nothing is deformed: the ride itself is what there is to measure by. */
TEST(a_body_that_is_only_carried_converges)
{
    for (int k = 0; k < 3; k++) {
        uz_scene s = carried_plate(k == 0 ? 1e-6 : k == 1 ? 1 : 1e6);
        s.n_loads = 0;
        s.contacts[0].point[1] = -1;
        uz_result *x = body_solve(&s, 1e-8);
        CHECK_INT(x->summary.active, 0);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* Nor has the mesh an error: the strains are what rounding leaves of the ride. */
TEST(a_body_that_is_only_carried_has_no_mesh_error)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){5.345, 0.681, 1.301}, (int64_t[3]){4, 1, 1});
    s.materials[0].poisson = 0.499;
    body_hold(&s, "top", NAN, 0.000308, NAN);
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "back", NAN, NAN, 0);
    uz_result *x = body_solve(&s, 1e-8);
    CHECK(x->summary.discretization_error <= 0);
    CHECK_INT(x->evaluation ? x->evaluation->n_warnings : -1, 0);
    uz_result_free(x);
    uz_scene_clear(&s);
}

/* The strains are there, though they are small beside the ride: what rounding leaves of them is not what was asked for.
 */
TEST(a_loaded_body_that_is_carried_out_of_sight)
{
    static const double rides[] = {1e8, 1e10, 1e12};
    for (int k = 0; k < 3; k++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(rides[k])};
        uz_settings settings = uz_settings_default();
        uz_result *x = NULL;
        uz_error err = {0};
        CHECK_MSG(uz_solve(&x, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        const uz_summary *s = &x->summary;
        const double off = fabs(s->reaction_sum / REACTION_SUM - 1);
        CHECK_MSG(s->outcome == UZ_PRECISION_LIMIT && s->certificate.relative_error > off * 1e-2,
                  "carried by %g: outcome %d, certified %g, the reactions are off by %g", rides[k], s->outcome,
                  s->certificate.relative_error, off);
        uz_result_free(x);
        uz_scene_clear(&problem.scene);
    }
}

/* Only the plane holds it up; the ride is what a support without vertical hold makes. */
TEST(a_carried_body_that_the_obstacle_holds)
{
    static const double rides[] = {0, 1, 100};
    double sum[3];
    for (int k = 0; k < 3; k++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(rides[k])};
        uz_settings settings = uz_settings_default();
        uz_result *x = NULL;
        uz_error err = {0};
        problem.scene.supports[0].u[1] = NAN;
        settings.relative_error = 1e-3;
        CHECK_MSG(uz_solve(&x, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(x->summary.outcome, UZ_CONVERGED);
        CHECK_REL(x->summary.reaction_sum, -15.0, 1e-6);
        sum[k] = x->summary.certificate.energy_norm;
        CHECK_REL(sum[k], sum[0], 2e-3);
        uz_result_free(x);
        uz_scene_clear(&problem.scene);
    }
}

/* A uniform strain, which the mesh has exactly: a tenth of its error is nothing that doubles could meet. */
TEST(balanced_asks_for_no_more_than_exact)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
    uz_scene *s = &problem.scene;
    *s = body_scene(UZ_SOLID, "tet4", (double[3]){1, 1, 1}, (int64_t[3]){2, 2, 2});
    body_hold(s, "bottom", NAN, 0, NAN);
    body_hold(s, "left", 0, NAN, NAN);
    body_hold(s, "back", NAN, NAN, 0);
    body_hold(s, "top", NAN, -0.001, NAN);
    uz_settings settings = uz_settings_default();
    uz_result *x = NULL;
    settings.balanced = true;
    CHECK(uz_solve(&x, &problem, &settings, NULL, NULL, NULL) == UZ_OK);
    CHECK_INT(x->summary.outcome, UZ_CONVERGED);
    CHECK(x->summary.requested_error >= 1e-12);
    uz_result_free(x);
    uz_scene_clear(s);
}

/* Certificates that could not bound a relative error asked for all the digits there are: 20,000 iterations for 70. */
TEST(the_ride_costs_few_iterations)
{
    static const uz_method methods[] = {UZ_METHOD_UZAWA, UZ_METHOD_ACCELERATED, UZ_METHOD_ACCELERATED_RESTART};
    static const double rides[] = {0, 1, 1000};
    for (int k = 0; k < 3; k++) {
        int64_t iterations[3];
        for (int i = 0; i < 3; i++) {
            uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(rides[i])};
            uz_settings settings = uz_settings_default();
            uz_result *x = NULL;
            problem.scene.n_loads = 1; /* the bound of the first answer is larger than its norm */
            settings.relative_error = 1e-2;
            settings.method = methods[k];
            CHECK(uz_solve(&x, &problem, &settings, NULL, NULL, NULL) == UZ_OK);
            CHECK_INT(x->summary.outcome, UZ_CONVERGED);
            iterations[i] = x->summary.iterations;
            CHECK_MSG(iterations[i] <= 3 * iterations[0], "%s, carried by %g: %d iterations instead of %d",
                      uz_method_name(methods[k]), rides[i], (int)iterations[i], (int)iterations[0]);
            uz_result_free(x);
            uz_scene_clear(&problem.scene);
        }
    }
}

/* The deformation is 3e-11 of the ride, of which doubles hold five digits: an answer that iterations left half wrong is
 * not one of rounding. */
TEST(what_is_small_beside_the_ride_is_still_asked_for)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = carried_plate(1e6)};
    uz_settings settings = uz_settings_default();
    uz_result *x = NULL;
    settings.relative_error = 1e-2;
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    CHECK(uz_solve(&x, &problem, &settings, NULL, NULL, NULL) == UZ_OK);
    CHECK_INT(x->summary.outcome, UZ_CONVERGED);
    CHECK_REL(x->summary.reaction_sum, REACTION_SUM, 0.05);
    uz_result_free(x);
    uz_scene_clear(&problem.scene);
}

/* Where a body that only the obstacle holds ends, after a fall of many times its size, is no part of its strain. */
TEST(a_fall_is_no_deformation)
{
    static const double falls[] = {0, 1, 100};
    for (int k = 0; k < 3; k++) {
        uz_scene s = carried_plate(0);
        s.supports[0].u[1] = NAN;
        s.n_loads = 1;
        s.contacts[0].point[1] = -falls[k];
        uz_result *x = body_solve(&s, 1e-5);
        CHECK_REL(x->summary.certificate.energy_norm, 0.5 * sqrt(3) * 1e-2, 1e-6); /* p^2 / 2E on its volume */
        CHECK_REL(x->evaluation->strain_energy, 0.375e-4, 1e-6);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* Turned by 1, strained by 1e-7: the rounding of the turn is not in the energy. */
TEST(energies_of_turned_bodies)
{
    static const struct {
        uz_model model;
        const char *element;
    } kinds[] = {{UZ_PLANE_STRESS, "quad4"}, {UZ_PLANE_STRAIN, "tri3"}, {UZ_PLANE_STRAIN, "quad8"},
                 {UZ_SOLID, "hex8"},         {UZ_SOLID, "tet4"},        {UZ_SOLID, "tet10"}};
    static const double axis[] = {0.3, -0.7, 1}, strain[] = {1e-7, -2e-7, 0.5e-7};
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++) {
        uz_scene s = body_scene(kinds[k].model, kinds[k].element, (double[3]){3, 1, 2}, (int64_t[3]){3, 2, 2});
        body_hold(&s, "left", 0, 0, kinds[k].model == UZ_SOLID ? 0 : NAN);
        uz_body_model model = body_model(&s);
        const int dim = model.mesh.dim;
        const int64_t n = model.mesh.n_nodes * dim;
        double *strained = body_room(n, sizeof *strained), *turned = body_room(n, sizeof *turned), still, moved;
        for (int64_t i = 0; i < n; i++) {
            const double *x = model.mesh.xyz + i / dim * dim;
            const int c = (int)(i % dim), p = (c + 1) % 3, q = (c + 2) % 3;
            strained[i] = strain[c] * x[c];
            turned[i] = strained[i] + (q < dim ? (dim == 3 || p == 2 ? axis[p] : 0) * x[q] : 0) -
                        (p < dim ? (dim == 3 || q == 2 ? axis[q] : 0) * x[p] : 0);
        }
        CHECK(uz_strain_energy(&still, &model, strained, false, NULL) == UZ_OK);
        CHECK(uz_strain_energy(&moved, &model, turned, true, NULL) == UZ_OK);
        CHECK_MSG(fabs(moved - still) < 1e-6 * still, "%s: %.9g instead of %.9g", kinds[k].element, moved, still);
        free(strained);
        free(turned);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* Bodies of so many elements are added up in two parts: equal elements, and each by itself. */
TEST(energies_of_large_bodies)
{
    static const double strain[] = {1e-4, -2e-4, 0.5e-4}, young = 200e3, poisson = 0.3;
    const double shear = young / 2 / (1 + poisson), lame = 2 * shear * poisson / (1 - 2 * poisson);
    double trace = 0, squares = 0;
    for (int c = 0; c < 3; c++) {
        trace += strain[c];
        squares += strain[c] * strain[c];
    }
    const double want = 3 * 1 * 2 * (0.5 * lame * trace * trace + shear * squares);
    for (int graded = 0; graded < 2; graded++) {
        uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){3, 1, 2}, (int64_t[3]){29, 27, 28});
        s.box.grading[0] = graded ? 1.5 : 1;
        body_hold(&s, "left", 0, 0, 0);
        uz_body_model model = body_model(&s);
        double *u = body_room(model.mesh.n_nodes * 3, sizeof *u), energy = 0;
        for (int64_t i = 0; i < model.mesh.n_nodes * 3; i++)
            u[i] = strain[i % 3] * model.mesh.xyz[i];
        CHECK(model.mesh.uniform == !graded && model.mesh.n_elements > 20000);
        CHECK(uz_strain_energy(&energy, &model, u, false, NULL) == UZ_OK);
        CHECK_REL(energy, want, 1e-12);
        free(u);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
