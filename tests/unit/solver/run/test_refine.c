/* Meshes that are refined where the error is: what that saves, what is inherited, where it ends. */
#include "assembly/assembly.h"
#include "ladder_fixture.h"
#include "run/marking.h"
#include "run/transfer.h"
#include "scene/bisect.h"

enum { X, Y, Z };

/* The paper's body in three by one cells of triangles. */
static uz_scene paper_body(const char *element)
{
    uz_scene s = paper(1);
    snprintf(s.box.element, sizeof s.box.element, "%s", element);
    s.box.automatic = false;
    s.box.cells[X] = 6;
    s.box.cells[Y] = 2;
    s.refine = true;
    return s;
}

/* Three unit squares around the origin, of two triangles each: the corner that is left out is the re-entrant one.
 * Pulled down at its upper end and held below, on a floor that it stands on with its right leg. */
static uz_scene l_shape(void)
{
    static const double XYZ[] = {-1, -1, 0, -1, 1, -1, -1, 0, 0, 0, 1, 0, -1, 1, 0, 1};
    static const int64_t NODE[] = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 3, 4, 7, 3, 7, 6};
    static const int64_t TOP[] = {7, 6}, BOTTOM[] = {0, 1}, RIGHT[] = {2, 5};
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "tri3", (double[3]){1, 1}, (int64_t[3]){1, 1});
    uz_given_mesh *mesh = &s.given;
    s.source = UZ_MESH_GIVEN;
    *mesh = (uz_given_mesh){.dim = 2, .n_nodes = 8, .n_elements = 6, .n_groups = 3};
    mesh->xyz = body_room(16, sizeof *mesh->xyz);
    mesh->node = body_room(18, sizeof *mesh->node);
    mesh->first = body_room(7, sizeof *mesh->first);
    mesh->kind = body_room(6, 1);
    mesh->groups = body_room(3, sizeof *mesh->groups);
    memcpy(mesh->xyz, XYZ, sizeof XYZ);
    memcpy(mesh->node, NODE, sizeof NODE);
    for (int64_t e = 0; e <= 6; e++)
        mesh->first[e] = 3 * e;
    for (int k = 0; k < 3; k++) {
        uz_given_group *group = &mesh->groups[k];
        strcpy(group->name, k == 0 ? "top" : k == 1 ? "bottom" : "right");
        group->n_faces = 1;
        group->face_first = body_room(2, sizeof *group->face_first);
        group->face_node = body_room(2, sizeof *group->face_node);
        group->face_first[1] = 2;
        memcpy(group->face_node, k == 0 ? TOP : k == 1 ? BOTTOM : RIGHT, sizeof TOP);
    }
    body_hold(&s, "bottom", 0, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -1, 0);
    body_plane(&s, "right", (double[3]){1 + 1e-9, 0, 0}, (double[3]){-1, 0, 0});
    s.refine = true;
    return s;
}

/* Unknowns of the first of ever finer meshes, all elements bisected each time, whose error is at most `error`. */
static double uniform_unknowns(const uz_scene *scene, double error)
{
    int64_t *list = NULL, n = 0, d = 0;
    double found = INFINITY;
    for (int level = 0; level < 8 && found > error; level++) {
        uz_scene s = *scene;
        s.refine = false;
        s.bisected = list;
        s.n_bisected = n;
        uz_result *result = body_solve(&s, 0.1 * error);
        const int64_t count = result->mesh.n_elements;
        found = result->summary.discretization_error;
        d = result->summary.d;
        uz_result_free(result);
        list = realloc(list, (size_t)(n + 1 + count) * sizeof *list);
        list[n++] = count;
        for (int64_t e = 0; e < count; e++)
            list[n++] = e;
    }
    free(list);
    CHECK(found <= error);
    return (double)d;
}

/* Order in unknowns over the later half of the grids, and what it took at last. */
static void check_order(const uz_scene *scene, double error, double least, double share, const char *what)
{
    const uz_settings settings = asking(error);
    uz_result *result = solve(scene, &settings);
    const uz_grid_sequence *grids = result->grids;
    const uz_grid_level *last = &grids->level[grids->count - 1], *first = &grids->level[grids->count / 2];
    CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s: %s", what, result->summary.message);
    CHECK(uz_total_error(NULL, &result->summary) <= error && grids->refined && grids->count > 4);
    const double order =
        log(first->discretization_error / last->discretization_error) / log((double)last->d / (double)first->d);
    CHECK_MSG(order >= least, "%s: order %g in unknowns", what, order);
    const double uniform = uniform_unknowns(scene, error);
    CHECK_MSG((double)result->d <= share * uniform, "%s: %lld unknowns, uniform %g", what, (long long)result->d,
              uniform);
    printf("# %s at %g: order %.3f, %lld unknowns in %d grids, uniform %g\n", what, error, order, (long long)result->d,
           grids->count, uniform);
    uz_result_free(result);
}

TEST(a_quarter_of_the_unknowns)
{
    uz_scene s = paper_body("tri3"), l = l_shape();
    check_order(&s, 0.02, 0.45, 0.25, "paper's body, tri3");
    check_order(&l, 0.03, 0.45, 0.25, "L-shape, tri3");
    uz_scene_clear(&l);
    snprintf(s.box.element, sizeof s.box.element, "tri6");
    check_order(&s, 0.006, 0.9, 0.25, "paper's body, tri6");
    uz_scene_clear(&s);
}

/* Half a block pressed against a cylinder by so much: the pressure of Hertz over a small part of its upper side. */
static uz_scene hertz_block(const char *element, int64_t cells, double depth)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){20, 40}, (int64_t[3]){cells, 2 * cells});
    s.materials[0].young = 1000;
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold(&s, "left", 0, NAN, NAN);
    uz_contact *contact = body_plane(&s, "top", (double[3]){0, 70 - depth, 0}, (double[3]){0});
    contact->kind = UZ_OBSTACLE_ROUND;
    contact->radius = 30;
    return s;
}

/* A force within so much, from meshes that see next to nothing of the contact: fewer unknowns than with whole elements
 * divided on every grid, or where the answer is off in place of where the force's interval is wide. */
TEST(forces_take_few_unknowns)
{
    static const struct {
        const char *element;
        double within;
        int64_t most;
    } CASES[] = {{"tri6", 0.02, 300}, {"tri6", 0.005, 520}, {"quad8", 0.005, 370}};
    for (int k = 0; k < 3; k++) {
        uz_scene s = hertz_block(CASES[k].element, 4, 0.25);
        s.refine = true;
        s.box.cells[Y] = 4;
        const uz_quantity force = {.name = "force", .kind = UZ_QUANTITY_CONTACT_FORCE, .on = "top"};
        const uz_problem problem = {
            .kind = UZ_PROBLEM_SCENE, .scene = s, .quantities = (uz_quantity *)&force, .n_quantities = 1};
        uz_settings settings = uz_settings_default();
        settings.quantity_error = CASES[k].within;
        uz_result *result = NULL;
        CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, NULL), UZ_OK);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        const uz_quantity_found *found = result->evaluation->quantities;
        printf("# %s: force in %g .. %g on %lld unknowns, %d grids\n", CASES[k].element, found->low, found->high,
               (long long)result->d, result->grids->count);
        CHECK_MSG(found->low <= 53.7 && found->high >= 53.69, "%g .. %g", found->low, found->high);
        CHECK_MSG(result->d <= CASES[k].most, "%lld", (long long)result->d);
        double sum = 0;
        for (int64_t e = 0; e < result->grids->n_elements; e++)
            sum += result->evaluation->share[e];
        CHECK_REL(sum, 1.0, 1e-12);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

/* From a mesh that sees next to nothing of the contact. */
TEST(hertz_is_met_on_few_unknowns)
{
    uz_scene s = hertz_block("tri3", 4, 0.25);
    s.refine = true;
    const uz_settings settings = asking(0.05);
    uz_result *result = solve(&s, &settings);
    CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
    const uz_grid_sequence *grids = result->grids;
    printf("# Hertz: %lld unknowns, %d grids, force %g\n", (long long)result->d, grids->count,
           result->summary.force[Y]);
    int64_t iterations = 0;
    for (int i = 1; i < grids->count; i++)
        iterations += grids->level[i].iterations;
    CHECK_MSG(result->d < 6000, "%lld", (long long)result->d);
    CHECK_MSG(iterations <= 8 * grids->count, "%lld iterations on %d grids", (long long)iterations, grids->count);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* Of a contact that is smaller than a cell, whose error hardly falls from 4 to 8 to 24 cells, the ladder of boxes sees
 * enough on the grids after these. */
TEST(ladders_climb_to_what_the_first_grids_do_not_see)
{
    uz_scene s = hertz_block("quad4", 4, 0.1);
    s.box.size[X] = 40;
    const uz_settings settings = asking(0.05);
    s.box.automatic = true;
    uz_result *uniform = solve(&s, &settings);
    CHECK_MSG(uniform->summary.outcome == UZ_CONVERGED, "%s", uniform->summary.message);
    s.box.automatic = false;
    s.box.cells[X] = s.box.cells[Y] = 8;
    s.refine = true;
    uz_result *refined = solve(&s, &settings);
    CHECK_MSG(refined->summary.outcome == UZ_CONVERGED, "%s", refined->summary.message);
    CHECK(4 * refined->d < uniform->d);
    printf("# small contact: %lld unknowns, %d grids; ladder %lld, %lld x %lld\n", (long long)refined->d,
           refined->grids->count, (long long)uniform->d, (long long)uniform->grids->cells[X],
           (long long)uniform->grids->cells[Y]);
    uz_result_free(refined);
    uz_result_free(uniform);
    uz_scene_clear(&s);
}

/* Its own list, given with the scene, makes the mesh that the answer is on. What coarser grids add to the error that is
 * told, by half of it at most, is not known there. */
TEST(the_list_makes_the_mesh_again)
{
    static const char *const ELEMENTS[] = {"tri3", "tri6"};
    for (int k = 0; k < 2; k++) {
        uz_scene s = paper_body(ELEMENTS[k]);
        const uz_settings settings = asking(k == 0 ? 0.05 : 0.004); /* of a few it were another error */
        uz_result *result = solve(&s, &settings);
        s.refine = false;
        s.bisected = result->grids->bisected;
        s.n_bisected = result->grids->n_bisected;
        uz_result *again = body_solve(&s, 1e-9);
        CHECK_INT(again->n_nodes, result->n_nodes);
        CHECK(memcmp(again->mesh.xyz, result->mesh.xyz, (size_t)(2 * result->n_nodes) * sizeof(double)) == 0);
        const double told = result->summary.discretization_error / again->summary.discretization_error;
        CHECK_MSG(told > 0.999 && told < 1.501, "%g of the error on the mesh alone", told);
        CHECK_REL(again->summary.certificate.energy_primal, result->summary.certificate.energy_primal, 1e-6);
        CHECK_INT(result->grids->n_elements, again->mesh.n_elements);
        uz_result_free(again);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

/* Of the elements' shares the fewest that have half of the square. */
TEST(marks_have_half_of_the_error)
{
    uz_scene s = l_shape();
    s.refine = false;
    uz_result *result = body_solve(&s, 1e-8);
    const uz_problem problem = problem_of_scene(&s);
    uz_body_model body;
    int64_t *list = NULL, n = 0;
    CHECK_INT(uz_body_model_build(&body, &s, UZ_BODY_OUTLINE, NULL), UZ_OK);
    double eta2[6], sum = 0, marked = 0, least = INFINITY;
    CHECK(uz_estimate_mesh_error(eta2, NULL, &body, &s, result->u) < result->summary.discretization_error); /* of six */
    for (int e = 0; e < 6; e++)
        sum += eta2[e];
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 1e-9, false, NULL), UZ_OK);
    CHECK(n > 1 && list[0] == n - 1);
    for (int64_t i = 1; i < n; i++) {
        marked += eta2[list[i]];
        least = fmin(least, eta2[list[i]]);
    }
    CHECK_MSG(marked >= 0.5 * sum && marked - least < 0.5 * sum, "%g of %g", marked, sum);
    const int64_t before = n;
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 0.97, false, NULL), UZ_OK);
    CHECK(list[before] == UZ_HALVED_ONCE && list[before + 1] == n - before - 2);
    CHECK(list[before + 1] > 0 && list[before + 1] < list[0]); /* not much is missing */
    free(list);
    uz_body_model_clear(&body);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* What is known of elements is what they are marked by; those that are halved once, as little is missing, are told. */
TEST(marked_by_what_is_asked_for)
{
    uz_scene s = l_shape();
    s.refine = false;
    uz_result *result = body_solve(&s, 1e-8);
    const uz_problem problem = problem_of_scene(&s);
    uz_body_model body;
    int64_t *list = NULL, n = 0;
    CHECK_INT(uz_body_model_build(&body, &s, UZ_BODY_OUTLINE, NULL), UZ_OK);
    double share[6] = {0.1, 0, 0, 0.2, 0.7, 0};
    uz_evaluation *e = result->evaluation;
    e->share = share;
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 1e-9, false, NULL), UZ_OK);
    CHECK(n == 2 && list[0] == 1 && list[1] == 4);
    e->asked = 0.1; /* of second order: a quarter of it is half of each factor's */
    n = 0;
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 0.2, false, NULL), UZ_OK);
    CHECK(n == 2 && list[0] == 1 && list[1] == 4);
    n = 0;
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 0.3, false, NULL), UZ_OK);
    CHECK(n == 3 && list[0] == UZ_HALVED_ONCE && list[1] == 1 && list[2] == 4);
    n = 0; /* what one halving leaves is more than a whole division does: 0.3 left needs more of the sum */
    share[4] = 0.35;
    share[5] = 0.35;
    CHECK_INT(uz_mark_elements(&list, &n, &body, &problem, &result, 0.3, false, NULL), UZ_OK);
    CHECK(n == 4 && list[1] == 2);
    e->share = NULL;
    free(list);
    uz_body_model_clear(&body);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* The pressure of a coarse mesh at the rows of one that is refined from it. */
TEST(starts_are_interpolated)
{
    uz_scene s = hertz_block("tri6", 8, 0.25);
    uz_result *coarse = body_solve(&s, 1e-8);
    const uz_problem problem = problem_of_scene(&s);
    uz_body_model outline;
    uz_state *start = NULL;
    int64_t *list = NULL, n = 0;
    CHECK_INT(uz_body_model_build(&outline, &s, UZ_BODY_OUTLINE, NULL), UZ_OK);
    CHECK_INT(uz_mark_elements(&list, &n, &outline, &problem, &coarse, 1e-3, false, NULL), UZ_OK);
    uz_body_model_clear(&outline);
    s.bisected = list;
    s.n_bisected = n;
    CHECK_INT(uz_body_model_build(&outline, &s, UZ_BODY_OUTLINE, NULL), UZ_OK);
    CHECK_INT(uz_transfer_start(&start, coarse, NULL, &outline, NULL), UZ_OK);
    CHECK(start && start->m == outline.m && outline.m > coarse->m);
    double before = 0, after = 0;
    for (int64_t i = 0; i < coarse->m; i++)
        before += coarse->r[i];
    for (int64_t i = 0; start && i < start->m; i++)
        after += start->r[i];
    CHECK_REL(after, before, 0.2);
    uz_state_free(start);
    uz_body_model_clear(&outline);
    uz_result_free(coarse);
    free(list);
    uz_scene_clear(&s);
}

TEST(bodies_in_space_and_rings)
{
    static const struct {
        uz_model model;
        const char *element;
        double error;
    } KINDS[] = {{UZ_SOLID, "tet4", 0.12}, {UZ_SOLID, "tet10", 0.055}, {UZ_AXISYMMETRIC, "tri3", 0.012}};
    for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++) {
        uz_scene s = body_scene(KINDS[k].model, KINDS[k].element, (double[3]){2, 2, 2}, (int64_t[3]){2, 2, 2});
        const bool solid = KINDS[k].model == UZ_SOLID;
        s.box.origin[X] = solid ? 0 : 1;
        body_hold(&s, "left", 0, solid ? 0 : NAN, solid ? 0 : NAN);
        body_load(&s, UZ_LOAD_TRACTION, "top", 0, -10, 0);
        body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
        s.refine = true;
        const uz_settings settings = asking(KINDS[k].error);
        uz_result *result = solve(&s, &settings);
        const double uniform = uniform_unknowns(&s, KINDS[k].error);
        CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s: %s", KINDS[k].element, result->summary.message);
        CHECK(uz_total_error(NULL, &result->summary) <= KINDS[k].error);
        CHECK_MSG((double)result->d < 0.7 * uniform, "%s: %lld, uniform %g", KINDS[k].element, (long long)result->d,
                  uniform);
        printf("# %s: %lld unknowns in %d grids, uniform %g\n", KINDS[k].element, (long long)result->d,
               result->grids->count, uniform);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

TEST(cases_share_a_mesh)
{
    uz_scene s = paper_body("tri3");
    uz_problem problem = problem_of_scene(&s);
    uz_load light[2] = {s.loads[0], s.loads[1]};
    uz_load_case cases[2] = {{.name = "own"}, {.name = "pulled", .loads = light, .n_loads = 2}};
    light[0].v[Y] = -0.2;
    problem.cases = cases;
    problem.n_cases = 2;
    const uz_settings settings = asking(0.04);
    uz_result **results = NULL;
    CHECK_INT(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, NULL), UZ_OK);
    for (int i = 0; results && i < 2; i++) {
        CHECK_INT(results[i]->summary.outcome, UZ_CONVERGED);
        CHECK(uz_total_error(NULL, &results[i]->summary) <= 0.04 && results[i]->grids->bisected);
        CHECK_INT(results[i]->n_nodes, results[0]->n_nodes);
    }
    uz_results_free(results, 2);
    uz_scene_clear(&s);
}

TEST(limits_end_it_with_the_best_answer)
{
    uz_scene s = paper_body("tri3");
    uz_settings settings = asking(1e-3);
    settings.time_limit_s = 0.05;
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_TIME_LIMIT);
    CHECK(result->grids->count >= 1 && strstr(result->summary.message, "time_limit_s"));
    uz_result_free(result);
    settings = asking(1e-3);
    settings.memory_limit = 3000000;
    result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_MESH_LIMIT);
    CHECK_MSG(result->grids->count > 4 && strstr(result->summary.message, "bytes"), "%s", result->summary.message);
    CHECK_INT(result->grids->level[result->grids->count - 1].n_elements, result->grids->n_elements);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* A prism of two triangles on each other; and hexahedra, whose surfaces with hanging nodes no mortar rows know. */
TEST(other_elements_are_refused_with_a_remedy)
{
    uz_scene prism = body_scene(UZ_SOLID, "wedge6", (double[3]){1, 1, 1}, (int64_t[3]){1, 1, 1});
    uz_scene pair = body_scene(UZ_SOLID, "hex8", (double[3]){1, 1, 1}, (int64_t[3]){1, 1, 1});
    uz_contact *contact = body_plane(&pair, "top", (double[3]){0}, (double[3]){0});
    contact->kind = UZ_OBSTACLE_BODY;
    strcpy(contact->with, "bottom");
    const uz_settings settings = asking(0.05);
    for (int k = 0; k < 2; k++) {
        uz_scene *s = k == 0 ? &prism : &pair;
        s->refine = true;
        const uz_problem problem = problem_of_scene(s);
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK_INT(uz_scene_check(s, &err), UZ_ERR_SCENE);
        CHECK(strcmp(err.where, "/mesh/refine") == 0 && strstr(err.message, "tet4"));
        CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
        uz_scene_clear(s);
    }
}
