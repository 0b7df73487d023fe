/* Meshes that are refined under large deformation: the error that is asked for against that of a much finer mesh, what
 * is inherited from grid to grid, hanging nodes, where it ends, and what is no answer. */
#include "finite/finite_body.h"
#include "linalg/linalg.h"
#include "run/transfer.h"
#include "scene/scene.h"
#include "two_boxes.h"

#include <stdint.h>

static uz_scene block(uz_model model, const char *element, const double size[3], const int64_t cells[3])
{
    uz_scene s = body_scene(model, element, size, cells);
    s.materials[0].young = 1;
    s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    s.kinematics = UZ_KINEMATICS_FINITE;
    s.refine = true;
    return s;
}

static uz_result *solve(const uz_scene *s, double error)
{
    return body_solve_to(s, error);
}

static void give_back(uz_result *result, uz_scene *s)
{
    uz_result_free(result);
    uz_scene_clear(s);
}

static uz_contact *round_under(uz_scene *s, const char *on, double x, double y, double radius)
{
    uz_contact *c = body_plane(s, on, (double[3]){x, y, 0}, (double[3]){0, 1, 0});
    c->kind = UZ_OBSTACLE_ROUND;
    c->radius = radius;
    return c;
}

static void bend(double x[3])
{
    const double r = x[0], angle = x[1];
    x[0] = r * cos(angle);
    x[1] = r * sin(angle);
}

/* ---- scenes on few elements, of displacements that are prescribed */

static uz_scene ring(void)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "quad8", (double[3]){1, acos(0)}, (int64_t[3]){1, 6});
    s.box.origin[0] = 9.5;
    body_give_mesh(&s, bend);
    body_hold(&s, "bottom", NAN, 3, NAN);
    body_hold(&s, "top", 0, NAN, NAN);
    body_plane(&s, "right", (double[3]){0, 10.5, 0}, (double[3]){0, -1, 0});
    return s;
}

static uz_scene roller(void)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "quad4", (double[3]){4, 1}, (int64_t[3]){8, 2});
    body_hold(&s, "top", -0.5, -0.2, NAN);
    round_under(&s, "bottom", 1, -2, 2);
    return s;
}

static uz_scene cantilever(void)
{
    uz_scene s = block(UZ_PLANE_STRESS, "tri6", (double[3]){8, 1}, (int64_t[3]){8, 1});
    body_hold(&s, "left", 0, 0, NAN);
    body_hold(&s, "right", NAN, -4, NAN);
    return s;
}

static uz_scene tube(void)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "quad8", (double[3]){1, acos(0)}, (int64_t[3]){1, 3});
    s.materials[0].law = UZ_ELASTIC_NEO_HOOKE_ISOCHORIC;
    s.box.origin[0] = 1;
    body_give_mesh(&s, bend);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold(&s, "top", 0, NAN, NAN);
    round_under(&s, "left", 0, 0, 1.5);
    return s;
}

/* Infinite stress at the corners of the top, which is bonded. */
static uz_scene bonded(double by)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "tri3", (double[3]){1, 1}, (int64_t[3]){3, 3});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "top", 0, -by, NAN);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    return s;
}

static uz_scene pair(void)
{
    const box_part a = {{0, 0}, {4, 1}, {8, 2}, "tri6"}, b = {{0.5, 1}, {1.5, 0.8}, {3, 2}, "tri6"};
    uz_scene s = two(UZ_PLANE_STRAIN, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
    body_hold(&s, "abottom", 0, 0, NAN);
    body_hold(&s, "btop", 1, -0.15, NAN);
    touch(&s, "bbottom", "atop");
    s.refine = true;
    return s;
}

static uz_scene cylinder(void)
{
    uz_scene s = block(UZ_AXISYMMETRIC, "quad4", (double[3]){2, 1}, (int64_t[3]){8, 4});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", 0, 0, NAN);
    round_under(&s, "top", 0, 1.75, 1);
    return s;
}

/* Hanging nodes on the side that touches, too. */
static uz_scene cube(void)
{
    uz_scene s = block(UZ_SOLID, "hex8", (double[3]){1, 1, 1}, (int64_t[3]){3, 3, 3});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "back", NAN, NAN, 0);
    body_hold(&s, "top", 0, -0.2, 0);
    round_under(&s, "bottom", 0, -3, 3);
    return s;
}

/* ---- the error */

/* Appends rounds that divide all elements of the mesh of the result to its list: the mesh becomes one that is finer by
 * so much everywhere. */
static void refine_all(uz_scene *s, const uz_result *result, int rounds)
{
    int64_t n = result->grids->n_bisected, *list = body_room(n + 1, sizeof *list);
    memcpy(list, result->grids->bisected, (size_t)n * sizeof *list);
    for (int k = 0; k < rounds; k++) {
        uz_mesh mesh;
        s->bisected = list;
        s->n_bisected = n;
        CHECK_INT(uz_mesh_from_scene(&mesh, s, NULL), UZ_OK);
        list = realloc(list, (size_t)(n + 1 + mesh.n_elements) * sizeof *list);
        list[n++] = mesh.n_elements;
        for (int64_t e = 0; e < mesh.n_elements; e++)
            list[n++] = e;
        uz_mesh_clear(&mesh);
    }
    s->bisected = list;
    s->n_bisected = n;
    s->refine = false;
}

/* In the energy norm of the tangent at the finer answer, relative to the root of twice its energy. */
static double true_error(const uz_scene *s, const uz_result *coarse, const uz_result *fine)
{
    uz_finite_measure measure;
    uz_body_model tangent, model = body_model(s);
    CHECK_INT(uz_finite_tangent_of(&tangent, &model, NULL), UZ_OK);
    uz_finite_body(&measure, NULL, &tangent, &model, NULL, fine->u, NULL);
    double *off = uz_carry_nodal(&model.mesh, coarse->u, coarse->n_nodes, model.mesh.dim), sum = 0;
    double *e = body_room(model.d, sizeof *e), *Ke = body_room(model.d, sizeof *Ke);
    for (int64_t i = 0; i < model.mesh.n_nodes * model.mesh.dim; i++)
        off[i] -= fine->u[i];
    uz_restrict_nodal(e, &model, off);
    uz_csc_symv(Ke, &tangent.K, 1, e);
    for (int64_t j = 0; j < model.d; j++)
        sum += e[j] * Ke[j];
    free(off);
    free(e);
    free(Ke);
    uz_finite_tangent_clear(&tangent);
    uz_body_model_clear(&model);
    return sqrt(sum / (2 * measure.energy));
}

static void check_error(const char *name, uz_scene s, double asked, int rounds)
{
    uz_result *coarse = solve(&s, asked);
    const uz_summary *t = &coarse->summary;
    CHECK_MSG(t->outcome == UZ_CONVERGED, "%s: %s", name, t->message);
    CHECK(t->finite.load == 1 && t->finite.definite && t->finite.least_det > 0);
    CHECK(coarse->grids && coarse->grids->refined && coarse->grids->count > 1);
    CHECK(uz_total_error(NULL, t) <= asked);
    refine_all(&s, coarse, rounds);
    uz_result *fine = solve(&s, 1e-8);
    CHECK_MSG(fine->summary.outcome == UZ_CONVERGED, "%s: %s", name, fine->summary.message);
    const double off = true_error(&s, coarse, fine), told = t->discretization_error;
    printf("# %-10s told %.4f, true %.4f: %.2f; %lld unknowns of %lld, %d grids, %lld problems on the last\n", name,
           told, off, told / off, (long long)coarse->d, (long long)fine->d, coarse->grids->count,
           (long long)t->finite.qps);
    CHECK_MSG(off <= asked, "%s: %g", name, off);
    CHECK_MSG(told > 0.95 * off && told < 2.5 * off, "%s: told %g, true %g", name, told, off);
    free((void *)(uintptr_t)s.bisected);
    s.bisected = NULL;
    uz_result_free(coarse);
    give_back(fine, &s);
}

/* By estimate: 0.79 of it between bodies and 0.9 at corners, in triangles, where it is 0.86 and 0.9 of these scenes
 * under small strain. */
TEST(the_error_is_what_was_asked_for)
{
    check_error("ring", ring(), 0.05, 2);
    check_error("roller", roller(), 0.05, 2);
    check_error("cantilever", cantilever(), 0.05, 2);
    check_error("tube", tube(), 0.05, 2);
    check_error("bonded", bonded(0.1), 0.05, 2);
    check_error("pair", pair(), 0.05, 2);
    check_error("cylinder", cylinder(), 0.05, 2);
    check_error("cube", cube(), 0.15, 1);
}

/* ---- from grid to grid */

/* Each grid begins at the displacement of the one before, and takes the whole load at once from there. */
TEST(a_grid_begins_where_the_one_before_ended)
{
    uz_scene scenes[] = {ring(), roller(), pair()};
    for (int k = 0; k < 3; k++) {
        uz_result *result = solve(&scenes[k], 0.1);
        const uz_finite *f = &result->summary.finite;
        CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
        CHECK_MSG(f->steps == 1 && f->failed == 0 && f->qps <= (k == 2 ? 8 : 3), "%d: %lld problems", k,
                  (long long)f->qps);
        give_back(result, &scenes[k]);
    }
}

/* Nodes that hang are where those that they lie amid have them, and the answer is that of the mesh as it is given. */
TEST(hanging_nodes_follow)
{
    uz_scene s = roller();
    uz_result *result = solve(&s, 0.1);
    s.refine = false;
    s.bisected = result->grids->bisected;
    s.n_bisected = result->grids->n_bisected;
    uz_body_model model = body_model(&s);
    int64_t hanging = 0;
    CHECK_INT(model.mesh.n_nodes, result->n_nodes);
    for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
        if (uz_mesh_hangs(&model.mesh, i / 2)) {
            hanging++;
            CHECK(fabs(result->u[i] - uz_mesh_value_amid(&model.mesh, i / 2, result->u + i % 2, 2)) < 1e-14);
        }
    CHECK(hanging > 0);
    uz_result *again = solve(&s, 1e-8);
    CHECK(again->summary.outcome == UZ_CONVERGED && !again->grids);
    for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
        CHECK(fabs(result->u[i] - again->u[i]) < 1e-3);
    CHECK_REL(again->evaluation->strain_energy, result->evaluation->strain_energy, 1e-3);
    uz_body_model_clear(&model);
    uz_result_free(again);
    give_back(result, &s);
}

/* Both points of a path on one mesh, fine enough for either. */
TEST(a_path_is_refined_as_a_whole)
{
    uz_scene s = bonded(0.1);
    uz_load_case cases[] = {{.name = "a", .part = 0.4, .has_part = true},
                            {.name = "b", .part = 1, .has_part = true, .after = "a"}};
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .cases = cases, .n_cases = 2};
    uz_settings settings = uz_settings_default();
    uz_result **results = NULL;
    uz_error err = {0};
    settings.relative_error = 0.15;
    CHECK_MSG(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    for (int k = 0; k < 2; k++) {
        CHECK_MSG(results[k]->summary.outcome == UZ_CONVERGED, "%s", results[k]->summary.message);
        CHECK(uz_total_error(NULL, &results[k]->summary) <= 0.15 && results[k]->grids->count > 1);
        CHECK_INT(results[k]->n_nodes, results[0]->n_nodes);
    }
    CHECK(results[1]->summary.force[1] > 2 * results[0]->summary.force[1]);
    uz_results_free(results, 2);
    uz_scene_clear(&s);
}

/* A pressure that follows the body leaves no energy that two grids could be compared by. */
TEST(a_tube_under_pressure)
{
    uz_scene s = tube();
    s.n_contacts = 0;
    body_load(&s, UZ_LOAD_PRESSURE, "left", 0.1, 0, 0);
    uz_result *coarse = solve(&s, 0.03), *fine = solve(&s, 0.003);
    CHECK_MSG(coarse->summary.outcome == UZ_CONVERGED, "%s", coarse->summary.message);
    CHECK_MSG(fine->summary.outcome == UZ_CONVERGED, "%s", fine->summary.message);
    CHECK(isnan(coarse->evaluation->potential_energy) && coarse->mesh.n_elements >= 12);
    CHECK_REL(coarse->evaluation->strain_energy, fine->evaluation->strain_energy, 0.01);
    uz_result_free(coarse);
    give_back(fine, &s);
}

/* ---- where there is no answer */

static void check_ended(uz_scene s, uz_outcome outcome, double least, double most)
{
    uz_result *result = solve(&s, 0.02);
    const uz_summary *t = &result->summary;
    CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, t->outcome), uz_choice_name(UZ_CHOICE_OUTCOME, outcome));
    CHECK_MSG(t->finite.load > least && t->finite.load < most, "%.6g", t->finite.load);
    CHECK_MSG(strlen(t->message) > 20 && result->grids && result->grids->count < 8, "%d grids: %s",
              result->grids->count, t->message);
    give_back(result, &s);
}

/* However small the error of the part that is borne. */
TEST(what_is_not_borne_is_no_answer)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "quad8", (double[3]){1, 1}, (int64_t[3]){1, 1});
    s.materials[0].law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF;
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.25, 0);
    check_ended(s, UZ_UNSTABLE, 0.5, 0.8);
}

TEST(what_turns_inside_out_on_finer_grids_too_is_no_answer)
{
    uz_scene s = block(UZ_PLANE_STRAIN, "quad4", (double[3]){1, 1}, (int64_t[3]){2, 2});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "right", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold(&s, "top", NAN, -1.2, NAN);
    check_ended(s, UZ_INVERTED, 0.7, 1 / 1.2);
}

/* The free corner of a bonded block that is squeezed by a quarter folds on finer grids, whose estimates then grow
 * without limit, and the answer of the coarser ones, which do not, is off by what theirs is away at least. */
TEST(grids_of_another_equilibrium_are_told)
{
    uz_scene s = bonded(0.25);
    uz_result *result = solve(&s, 0.05);
    const uz_summary *t = &result->summary;
    CHECK(t->outcome == UZ_MESH_LIMIT && t->finite.load == 1);
    CHECK_MSG(strstr(t->message, "another equilibrium") && result->grids->count < 13, "%d grids: %s",
              result->grids->count, t->message);
    CHECK_MSG(t->discretization_error > 0.06 && t->discretization_error < 0.1, "%g", t->discretization_error);
    give_back(result, &s);
}

/* Small deformation does not do, which is seen on the mesh that is refined for it: the answer is that of the other one.
 */
TEST(auto_refines_for_the_model_that_it_takes)
{
    uz_scene scenes[] = {roller(), bonded(0.1)};
    for (int k = 0; k < 2; k++) {
        uz_result *own = solve(&scenes[k], 0.15);
        scenes[k].kinematics = UZ_KINEMATICS_AUTO;
        uz_result *result = solve(&scenes[k], 0.15);
        const uz_summary *s = &result->summary;
        CHECK(s->small.compared && s->small.error > 0.05 && !own->summary.small.compared);
        CHECK_INT(s->geometry.kind, UZ_KINEMATICS_FINITE);
        CHECK(result->n_nodes == own->n_nodes && result->grids->count > 1);
        CHECK(s->evaluation->strain_energy == own->summary.evaluation->strain_energy);
        CHECK(s->timings.total > 0);
        uz_result_free(own);
        give_back(result, &scenes[k]);
    }
}
