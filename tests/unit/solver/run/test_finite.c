/* Finite kinematics: closed forms, elastica, path independence, limit loads, and what is refused. Reference values are
 * those of closed forms, or of finer meshes by an independent program. */
#include "body_fixture.h"
#include "core/vector3.h"
#include "energy_slope.h"
#include "finite/hyperelastic.h"
#include "qp_fixture.h"

static uz_scene block(const char *element, double length, double height, int64_t nx, int64_t ny, uz_elasticity law)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){length, height, 0}, (int64_t[3]){nx, ny, 0});
    s.materials[0].young = 1;
    s.materials[0].law = law;
    s.kinematics = UZ_KINEMATICS_FINITE;
    return s;
}

static uz_result *solve(const uz_scene *s)
{
    return body_solve_to(s, 1e-8);
}

static void give_back(uz_result *result, uz_scene *s)
{
    uz_result_free(result);
    uz_scene_clear(s);
}

/* Of the node at x, y before anything moves. */
static const double *moved_by(const uz_result *r, double x, double y)
{
    for (int64_t i = 0; i < r->n_nodes; i++)
        if (hypot(r->mesh.xyz[2 * i] - x, r->mesh.xyz[2 * i + 1] - y) < 1e-9)
            return r->u + 2 * i;
    CHECK_MSG(false, "no node at %g, %g", x, y);
    exit(1);
}

static void check_converged(const uz_result *r, int64_t steps, int64_t qps)
{
    const uz_finite *f = &r->summary.finite;
    CHECK_MSG(r->summary.outcome == UZ_CONVERGED, "%s", r->summary.message);
    CHECK_MSG(f->steps <= steps && f->qps <= qps && f->failed == 0, "%lld steps, %lld contact problems",
              (long long)f->steps, (long long)f->qps);
    CHECK(f->load == 1 && f->definite && f->residual <= r->summary.requested_error && f->least_det > 0);
    CHECK_INT(r->summary.geometry.kind, UZ_KINEMATICS_FINITE);
    const double mesh = r->summary.discretization_error;
    CHECK(isnan(r->summary.certificate.relative_error));
    if (isnan(mesh)) /* nothing strains it */
        CHECK(isinf(uz_total_error(NULL, &r->summary)) && r->evaluation->strain_energy < 1e-12);
    else
        CHECK(mesh >= 0 && mesh < 1 && fabs(uz_total_error(NULL, &r->summary) - hypot(f->residual, mesh)) < 1e-15);
}

static void check_ended(const uz_result *r, uz_outcome outcome, double least, double most)
{
    const uz_finite *f = &r->summary.finite;
    CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, r->summary.outcome), uz_choice_name(UZ_CHOICE_OUTCOME, outcome));
    CHECK_MSG(f->load > least && f->load < most, "%.6g", f->load);
    CHECK(f->failed > 0 && f->definite && f->least_det > 0 && f->residual <= r->summary.requested_error);
    CHECK(strlen(r->summary.message) > 20);
}

static uz_scene squeezed(const char *element, int64_t cells, uz_elasticity law, double stretch)
{
    uz_scene s = block(element, 1, 1, cells, cells, law);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "top", NAN, stretch - 1, NAN);
    return s;
}

/* A homogeneous state, which every element has exactly. The stretch aside has no stress along it; the force is that of
 * closed forms. */
TEST(a_squeezed_block_has_its_closed_form)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    static const double FORCE[] = {0.19615385, 0.45842392, 0.47813424};
    for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++)
        for (int k = 0; k < 4; k++) {
            uz_scene s = squeezed(ELEMENTS[k], 2, (uz_elasticity)law, 0.7);
            uz_result *result = solve(&s);
            check_converged(result, 1, 3);
            CHECK_MSG(fabs(result->summary.force[1] - FORCE[law - 1]) < 1e-8, "%.9g", result->summary.force[1]);
            CHECK(fabs(result->evaluation->supports[1].force[1] + FORCE[law - 1]) < 1e-8);
            CHECK(result->evaluation->imbalance < 1e-9 && result->evaluation->n_warnings == 0);
            give_back(result, &s);
        }
}

/* St. Venant and Kirchhoff's law bears a stretch of 0.63643 of this block, where its free side begins to fold, and
 * under forces, of one element, which can do nothing else, 0.21148 at a stretch of 1 / sqrt 3. */
TEST(what_is_not_stable_is_no_answer)
{
    uz_scene s = squeezed("quad8", 4, UZ_ELASTIC_ST_VENANT_KIRCHHOFF, 0.61);
    uz_result *result = solve(&s);
    check_ended(result, UZ_UNSTABLE, (1 - 0.63643) / 0.39 - 0.004, (1 - 0.63643) / 0.39 + 0.004);
    give_back(result, &s);
    s = block("quad4", 1, 1, 1, 1, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.25, 0);
    result = solve(&s);
    check_ended(result, UZ_UNSTABLE, (0.21148362 - 0.0003) / 0.25, 0.21148362 / 0.25);
    CHECK(result->place && result->summary.timings.total > 0);
    give_back(result, &s);
    s = block("quad4", 1, 1, 1, 1, UZ_ELASTIC_ST_VENANT_KIRCHHOFF); /* of many times the load: to 0.1 % of the limit */
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -40, 0);
    result = solve(&s);
    check_ended(result, UZ_UNSTABLE, 0.999 * 0.21148362 / 40, 0.21148362 / 40);
    give_back(result, &s);
}

/* A top that is free to tilt does so before the limit load of a flat one: where the least eigenvalue of the tangent of
 * the homogeneous state is 0, by another program (quad8, 3 x 3 points). Finer meshes can do more, and bear less. */
TEST(a_block_under_a_force_gives_way_where_its_tangent_says)
{
    static const double LOAD[] = {0.19538884, 0.18229828, 0.17452686};
    for (int k = 0; k < 3; k++) {
        uz_scene s = block("quad8", 1, 1, 1 << k, 1 << k, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
        body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.25, 0);
        uz_result *result = solve(&s);
        check_ended(result, UZ_UNSTABLE, (LOAD[k] - 0.0003) / 0.25, LOAD[k] / 0.25 + 1e-6);
        give_back(result, &s);
    }
}

TEST(what_turns_inside_out_is_no_answer)
{
    uz_scene s = squeezed("quad4", 2, UZ_ELASTIC_NEO_HOOKE, -0.2);
    body_hold(&s, "right", 0, NAN, NAN);
    uz_result *result = solve(&s);
    check_ended(result, UZ_INVERTED, 0.7, 1 / 1.2);
    give_back(result, &s);
}

/* The elastica under a force P L^2 / EI = 10 that keeps its direction: 0.810609 and 0.554996; with the stretch and the
 * shear of this beam 0.811192 and 0.555479. */
TEST(a_cantilever_bends_as_the_elastica)
{
    uz_scene s = block("quad8", 10, 0.2, 32, 1, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
    s.materials[0].young = 1.2e6;
    s.materials[0].poisson = 0;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, 80, 0);
    uz_result *result = solve(&s);
    check_converged(result, 1, 6);
    const double *u = moved_by(result, 10, 0.1);
    CHECK_MSG(fabs(u[1] / 10 - 0.811192) < 0.002 * 0.811192, "%.6f", u[1] / 10);
    CHECK_MSG(fabs(u[0] / 10 + 0.555479) < 0.002 * 0.555479, "%.6f", u[0] / 10);
    CHECK(fabs(result->evaluation->supports[0].force[1] + 80) < 1e-5);
    CHECK(fabs(result->evaluation->supports[0].moment[2] + 80 * (10 + u[0])) < 0.02 * 800); /* about where it is */
    give_back(result, &s);
}

static uz_scene over_roller(const char *element, int64_t cells, double aside)
{
    uz_scene s = block(element, 4, 1, 4 * cells, cells, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "top", aside, -0.2, NAN);
    uz_contact *roller = body_plane(&s, "bottom", (double[3]){1, -2, 0}, (double[3]){0, 1, 0});
    roller->kind = UZ_OBSTACLE_ROUND;
    roller->radius = 2;
    return s;
}

/* The block is moved over the roller to the mirror image of where it began: what it has slid over does not matter. */
TEST(a_block_over_a_roller_is_mirrored)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "quad8"};
    static const double FACE[] = {0.01, 0.003, 0.002};
    for (int k = 0; k < 3; k++) {
        uz_scene s[3];
        uz_result *r[3];
        for (int i = 0; i < 3; i++) {
            s[i] = over_roller(ELEMENTS[k], k == 1 ? 4 : 8, -i);
            r[i] = solve(&s[i]);
            check_converged(r[i], 1, 5); /* carried to where it is pressed */
        }
        CHECK_MSG(fabs(r[0]->summary.force[1] - 0.34405) < FACE[k] * 0.34405, "%.7g", r[0]->summary.force[1]);
        CHECK_MSG(fabs(r[1]->summary.force[1] - 0.36159) < FACE[k] * 0.36159, "%.7g", r[1]->summary.force[1]);
        CHECK(fabs(r[1]->summary.force[0]) < 1e-9);
        CHECK_MSG(fabs(r[0]->summary.force[0] + r[2]->summary.force[0]) < 1e-9, "%.12g", r[2]->summary.force[0]);
        CHECK_MSG(fabs(r[0]->summary.force[1] - r[2]->summary.force[1]) < 1e-9, "%.12g", r[2]->summary.force[1]);
        for (int i = 0; i < 3; i++)
            give_back(r[i], &s[i]);
    }
}

static void bend(double x[3])
{
    const double r = x[0], angle = x[1];
    x[0] = r * cos(angle);
    x[1] = r * sin(angle);
}

/* A quarter of a ring between plates: its crown stays, and its foot comes up. Values of a much finer mesh. */
TEST(a_ring_between_plates)
{
    static const double UP[] = {0.525, 1.05, 5.25, 5.25}, FORCE[] = {5.9166e-4, 1.11042e-3, 5.7399e-3, 5.7399e-3};
    for (int k = 0; k < 4; k++) {
        uz_scene s = block("quad8", 1, acos(0), 2, k < 3 ? 16 : 48, UZ_ELASTIC_NEO_HOOKE);
        s.box.origin[0] = 9.5;
        body_give_mesh(&s, bend);
        body_hold(&s, "bottom", NAN, UP[k], NAN);
        body_hold(&s, "top", 0, NAN, NAN);
        body_plane(&s, "right", (double[3]){0, 10.5, 0}, (double[3]){0, -1, 0});
        uz_result *result = solve(&s);
        check_converged(result, 1, 4);
        CHECK_INT(result->summary.iterations, 1); /* begins with the rows that the problem before left; else up to 29 */
        CHECK_MSG(fabs(-2 * result->summary.force[1] - FORCE[k]) < (k < 3 ? 0.004 : 0.002) * FORCE[k], "%.7g",
                  -2 * result->summary.force[1]);
        if (k >= 2) { /* its middle has lifted off the plate */
            const double *crown = moved_by(result, 10.5 * cos(acos(0)), 10.5);
            CHECK_MSG(fabs(moved_by(result, 10.5, 0)[0] - 3.23773) < 0.002, "%.6g", moved_by(result, 10.5, 0)[0]);
            CHECK_MSG(crown[1] < -1e-5, "%.6g", crown[1]);
        }
        give_back(result, &s);
    }
}

/* Thin ones, and of rubber, which are nowhere near where the first tangent leads to: in one part all the same. */
TEST(a_ring_that_turns_far)
{
    static const double WIDE[] = {0.3, 1, 1}, UP[] = {5.25, 2.1, 3.15}, POISSON[] = {0.3, 0.499, 0.499};
    for (int k = 0; k < 3; k++) {
        const uz_elasticity law = k == 0 ? UZ_ELASTIC_NEO_HOOKE : UZ_ELASTIC_NEO_HOOKE_ISOCHORIC;
        uz_scene s = block("quad8", WIDE[k], acos(0), 2, k == 0 ? 24 : 48, law);
        s.box.origin[0] = 9.5;
        s.materials[0].poisson = POISSON[k];
        body_give_mesh(&s, bend);
        body_hold(&s, "bottom", NAN, UP[k], NAN);
        body_hold(&s, "top", 0, NAN, NAN);
        body_plane(&s, "right", (double[3]){0, 9.5 + WIDE[k], 0}, (double[3]){0, -1, 0});
        uz_result *result = solve(&s);
        check_converged(result, 1, 15); /* 24 in two parts, 45 in four and 55 in eight where steps are straight */
        give_back(result, &s);
    }
}

/* Pressure and outer radius by quadrature of the equilibrium of a thick tube. */
TEST(a_tube_over_a_rod)
{
    static const double RADIUS[] = {1.1, 1.5}, PRESSURE[] = {0.04624617, 0.15335612},
                        OUTER[] = {2.06485078, 2.34524417};
    for (int k = 0; k < 2; k++) {
        uz_scene s = block("quad8", 1, acos(0), 4, 8, UZ_ELASTIC_NEO_HOOKE);
        s.box.origin[0] = 1;
        body_give_mesh(&s, bend);
        body_hold(&s, "bottom", NAN, 0, NAN);
        body_hold(&s, "top", 0, NAN, NAN);
        uz_contact *rod = body_plane(&s, "left", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
        rod->kind = UZ_OBSTACLE_ROUND;
        rod->radius = RADIUS[k];
        uz_result *result = solve(&s);
        check_converged(result, 1, 4);
        CHECK_MSG(fabs(result->summary.max_pressure - PRESSURE[k]) < 5e-4 * PRESSURE[k], "%.8g",
                  result->summary.max_pressure);
        CHECK_MSG(fabs(2 + moved_by(result, 2, 0)[0] - OUTER[k]) < 5e-6, "%.8g", 2 + moved_by(result, 2, 0)[0]);
        CHECK(fabs(result->evaluation->contact_area - RADIUS[k] * acos(0)) < 1e-3);
        give_back(result, &s);
    }
}

static uz_scene ring(const char *element, double inner, double width, double height, int64_t nx, int64_t ny,
                     uz_elasticity law)
{
    uz_scene s = block(element, width, height, nx, ny, law);
    s.model = UZ_AXISYMMETRIC;
    s.box.origin[0] = inner;
    return s;
}

/* The same tube as a body of revolution, on a wall that is the rod. */
TEST(a_tube_over_a_rod_as_a_ring)
{
    static const double RADIUS[] = {1.1, 1.5}, PRESSURE[] = {0.04624617, 0.15335612},
                        OUTER[] = {2.06485078, 2.34524417};
    for (int k = 0; k < 2; k++) {
        uz_scene s = ring("quad8", 1, 1, 0.25, 8, 1, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&s, "bottom", NAN, 0, NAN);
        body_hold(&s, "top", NAN, 0, NAN);
        body_plane(&s, "left", (double[3]){RADIUS[k], 0, 0}, (double[3]){1, 0, 0});
        uz_result *result = solve(&s);
        const double area = 2 * acos(-1) * RADIUS[k] * 0.25;
        check_converged(result, 1, 6);
        CHECK_MSG(fabs(result->summary.max_pressure - PRESSURE[k]) < 1e-4 * PRESSURE[k], "%.8g",
                  result->summary.max_pressure);
        CHECK_MSG(fabs(2 + moved_by(result, 2, 0)[0] - OUTER[k]) < 2e-6, "%.8g", 2 + moved_by(result, 2, 0)[0]);
        CHECK(fabs(result->evaluation->contact_area - area) < 1e-9 * area);
        CHECK(fabs(result->evaluation->totals[0].normal_force - PRESSURE[k] * area) < 1e-4 * PRESSURE[k] * area);
        CHECK(fabs(result->evaluation->totals[0].center[0] - RADIUS[k]) < 1e-9);
        give_back(result, &s);
    }
}

/* A cylinder with its axis, squeezed on a plane and free to spread: stretched by l along the radius and around, where
 * the law has no stress then. */
TEST(a_squeezed_cylinder_has_its_closed_form)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++)
        for (int k = 0; k < 4; k++) {
            const double height = 0.8, lambda = 0.3 / (1.3 * 0.4), mu = 0.5 / 1.3;
            double low = 1, high = 2, W, S[6], D[6][6];
            for (int i = 0; i < 60; i++) {
                const double l = 0.5 * (low + high), C[6] = {l * l, height * height, l * l};
                CHECK(uz_hyperelastic(&W, S, D, 4, (uz_elasticity)law, lambda, mu, C));
                *(S[0] > 0 ? &high : &low) = l;
            }
            const double force = -acos(-1) * height * S[1];
            uz_scene s = ring(ELEMENTS[k], 0, 1, 1, 2, 2, (uz_elasticity)law);
            body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
            body_hold(&s, "left", 0, NAN, NAN);
            body_hold(&s, "top", NAN, height - 1, NAN);
            uz_result *result = solve(&s);
            check_converged(result, 1, 5);
            CHECK_MSG(fabs(result->summary.force[1] - force) < 1e-8, "%.9g, wanted %.9g", result->summary.force[1],
                      force);
            CHECK(fabs(1 + moved_by(result, 1, 0)[0] - low) < 1e-8 && result->evaluation->imbalance < 1e-9);
            CHECK(fabs(result->evaluation->contact_area - acos(-1) * low * low) < 1e-7);
            give_back(result, &s);
        }
}

/* ---- plane stress */

/* A block squeezed on a plane becomes wider and thicker by the same stretch l, where the law has no stress. */
TEST(a_squeezed_plate_has_its_closed_form)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    static const double HEIGHT[] = {0.8, 1.5};
    for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++)
        for (int k = 0; k < 8; k++) {
            const bool pulled = k >= 4;
            const double height = HEIGHT[pulled], lambda = 0.3 / (1.3 * 0.4), mu = 0.5 / 1.3, thickness = 0.5;
            double low = 0.3, high = 2, W, S[6], D[6][6];
            for (int i = 0; i < 60; i++) {
                const double l = 0.5 * (low + high), C[6] = {l * l, height * height, l * l};
                CHECK(uz_hyperelastic(&W, S, D, 4, (uz_elasticity)law, lambda, mu, C));
                *(S[0] > 0 ? &high : &low) = l;
            }
            const double force = -thickness * height * S[1];
            uz_scene s = block(ELEMENTS[k % 4], 1, 1, 2, 2, (uz_elasticity)law);
            s.model = UZ_PLANE_STRESS;
            s.thickness = thickness;
            body_hold(&s, "left", 0, NAN, NAN);
            body_hold(&s, "top", NAN, height - 1, NAN);
            if (pulled)
                body_hold(&s, "bottom", NAN, 0, NAN);
            else
                body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
            uz_result *result = solve(&s);
            check_converged(result, 1, 6);
            CHECK_MSG(fabs(result->evaluation->supports[1].force[1] + force) < 1e-8, "%.9g, wanted %.9g",
                      result->evaluation->supports[1].force[1], force);
            CHECK_MSG(fabs(1 + moved_by(result, 1, 0)[0] - low) < 1e-8, "%.9g", moved_by(result, 1, 0)[0]);
            CHECK_MSG(result->evaluation->imbalance < 1e-7, "%.3g", result->evaluation->imbalance);
            CHECK_MSG(fabs(result->summary.finite.least_det - low * low * height) < 1e-8, "%.9g, wanted %.9g",
                      result->summary.finite.least_det, low * low * height);
            CHECK(fabs(result->evaluation->strain_energy - thickness * W) < 1e-8);
            give_back(result, &s);
        }
}

/* The beam of the elastica: without a Poisson's ratio thin or wide is the same. */
TEST(a_plate_bends_as_the_elastica)
{
    uz_scene s = block("quad8", 10, 0.2, 32, 1, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
    s.model = UZ_PLANE_STRESS;
    s.materials[0].young = 1.2e6;
    s.materials[0].poisson = 0;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, 80, 0);
    uz_result *result = solve(&s);
    check_converged(result, 1, 6);
    const double *u = moved_by(result, 10, 0.1);
    CHECK_MSG(fabs(u[1] / 10 - 0.811192) < 0.002 * 0.811192, "%.6f", u[1] / 10);
    CHECK_MSG(fabs(u[0] / 10 + 0.555479) < 0.002 * 0.555479, "%.6f", u[0] / 10);
    give_back(result, &s);
}

/* ---- solids */

static uz_scene solid(const char *element, const double size[3], const int64_t cells[3], uz_elasticity law)
{
    uz_scene s = body_scene(UZ_SOLID, element, size, cells);
    s.materials[0].young = 1;
    s.materials[0].law = law;
    s.kinematics = UZ_KINEMATICS_FINITE;
    return s;
}

static void put_round(uz_scene *s, uz_obstacle_kind kind, const double at[3], double radius)
{
    uz_contact *c = body_plane(s, "bottom", at, (double[3]){0, 0, 1}); /* the axis of a cylinder */
    c->kind = kind;
    c->radius = radius;
}

/* Squeezed on a plane and free to spread along both other axes. */
TEST(a_squeezed_cube_has_its_closed_form)
{
    static const char *const ELEMENTS[] = {"hex8", "tet4", "hex20", "tet10"};
    for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++)
        for (int k = 0; k < 4; k++) {
            const double height = 0.75, lambda = 0.3 / (1.3 * 0.4), mu = 0.5 / 1.3;
            double low = 1, high = 2, W, S[6], D[6][6];
            for (int i = 0; i < 60; i++) {
                const double l = 0.5 * (low + high), C[6] = {l * l, height * height, l * l};
                CHECK(uz_hyperelastic(&W, S, D, 6, (uz_elasticity)law, lambda, mu, C));
                *(S[0] > 0 ? &high : &low) = l;
            }
            const double force = -height * S[1];
            const int64_t cells = k < 2 ? 2 : 1;
            uz_scene s =
                solid(ELEMENTS[k], (double[3]){1, 1, 1}, (int64_t[3]){cells, cells, cells}, (uz_elasticity)law);
            body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
            body_hold(&s, "left", 0, NAN, NAN);
            body_hold(&s, "back", NAN, NAN, 0);
            body_hold(&s, "top", NAN, height - 1, NAN);
            uz_result *result = solve(&s);
            check_converged(result, 1, 5);
            CHECK_MSG(fabs(result->summary.force[1] - force) < 1e-8, "%s: %.9g, wanted %.9g", ELEMENTS[k],
                      result->summary.force[1], force);
            CHECK(fabs(result->evaluation->supports[2].force[1] + force) < 1e-8 &&
                  result->evaluation->imbalance < 1e-9 && fabs(result->summary.finite.least_gap) < 1e-12);
            CHECK(fabs(result->evaluation->contact_area - low * low) < 1e-7);
            give_back(result, &s);
        }
}

/* Bricks one deep between frictionless walls are quadrilaterals in plane strain, and a cylinder is a circle. */
TEST(a_slab_over_a_cylinder_is_a_block_over_a_circle)
{
    for (int aside = 0; aside <= 1; aside++) {
        uz_scene plane = over_roller("quad4", 4, -aside);
        uz_scene slab = solid("hex8", (double[3]){4, 1, 0.5}, (int64_t[3]){16, 4, 1}, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&slab, "top", -aside, -0.2, 0);
        body_hold(&slab, "back", NAN, NAN, 0);
        body_hold(&slab, "front", NAN, NAN, 0);
        put_round(&slab, UZ_OBSTACLE_CYLINDER, (double[3]){1, -2, 7}, 2);
        uz_result *two = solve(&plane), *three = solve(&slab);
        check_converged(two, 1, 9);
        check_converged(three, 1, 9);
        CHECK_INT(three->summary.finite.qps, two->summary.finite.qps);
        for (int c = 0; c < 2; c++)
            CHECK_MSG(fabs(two->summary.force[c] - 2 * three->summary.force[c]) < 1e-9, "%.12g, not %.12g",
                      2 * three->summary.force[c], two->summary.force[c]);
        give_back(two, &plane);
        give_back(three, &slab);
    }
}

/* Of finer meshes of all of these elements: 0.0616. */
TEST(a_cube_on_a_ball)
{
    static const char *const ELEMENTS[] = {"hex8", "hex20", "tet10"};
    static const int64_t CELLS[] = {8, 4, 4};
    for (int k = 0; k < 3; k++) {
        uz_scene s =
            solid(ELEMENTS[k], (double[3]){1, 1, 1}, (int64_t[3]){CELLS[k], CELLS[k], CELLS[k]}, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&s, "left", 0, NAN, NAN);
        body_hold(&s, "back", NAN, NAN, 0);
        body_hold(&s, "top", NAN, -0.2, NAN);
        put_round(&s, UZ_OBSTACLE_ROUND, (double[3]){0, -1.5, 0}, 1.5);
        uz_result *result = solve(&s);
        check_converged(result, 1, 6);
        CHECK_MSG(fabs(result->summary.force[1] - 0.0616) < 0.01 * 0.0616, "%s: %.7g", ELEMENTS[k],
                  result->summary.force[1]);
        give_back(result, &s);
    }
}

/* Slid over a ball to the mirror image of where it began. */
TEST(a_slab_over_a_ball_is_mirrored)
{
    uz_scene s[2];
    uz_result *r[2];
    for (int i = 0; i < 2; i++) {
        s[i] = solid("hex8", (double[3]){3, 1, 1}, (int64_t[3]){12, 3, 4}, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&s[i], "top", -i, -0.15, 0);
        put_round(&s[i], UZ_OBSTACLE_ROUND, (double[3]){1, -2, 0.3}, 2);
        r[i] = solve(&s[i]);
        check_converged(r[i], 1, 12);
    }
    CHECK_MSG(fabs(r[0]->summary.force[0] + r[1]->summary.force[0]) < 1e-9, "%.12g", r[1]->summary.force[0]);
    for (int c = 1; c < 3; c++)
        CHECK_MSG(fabs(r[0]->summary.force[c] - r[1]->summary.force[c]) < 1e-9, "%.12g", r[1]->summary.force[c]);
    CHECK_MSG(fabs(r[0]->summary.force[0]) > 1e-5, "%.6g", r[0]->summary.force[0]);
    for (int i = 0; i < 2; i++)
        give_back(r[i], &s[i]);
}

/* The beam of the elastica as a solid, about an axis that is not that of the plane. */
TEST(a_solid_beam_bends_as_the_elastica)
{
    uz_scene s = solid("hex20", (double[3]){10, 1, 0.2}, (int64_t[3]){24, 1, 1}, UZ_ELASTIC_ST_VENANT_KIRCHHOFF);
    s.materials[0].young = 1.2e6;
    s.materials[0].poisson = 0;
    body_hold(&s, "left", 0, 0, 0);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, 0, 80);
    uz_result *result = solve(&s);
    check_converged(result, 1, 9);
    for (int64_t i = 0; i < result->n_nodes; i++)
        if (uz_distance2(result->mesh.xyz + 3 * i, (double[3]){10, 0, 0.1}, 3) < 1e-12) {
            const double *u = result->u + 3 * i;
            CHECK_MSG(fabs(u[2] / 10 - 0.811192) < 0.002 * 0.811192, "%.6f", u[2] / 10);
            CHECK_MSG(fabs(u[0] / 10 + 0.555479) < 0.002 * 0.555479, "%.6f", u[0] / 10);
        }
    CHECK(fabs(result->evaluation->supports[0].force[2] + 80) < 1e-5);
    give_back(result, &s);
}

/* Pressed on a roller that stands in it, by rows that stay where they are inside of sides: the force is that of a finer
 * mesh within the error of this one. */
TEST(a_roller_that_stands_in_a_block)
{
    static const double DEPTH[] = {0.2, 0.6}, FORCE[] = {0.36124, 2.4789};
    for (int k = 0; k < 4; k++) {
        uz_scene s = block(k < 2 ? "quad8" : "quad4", 4, 1, 16, 4, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&s, "top", 0, 0, NAN);
        uz_contact *roller = body_plane(&s, "bottom", (double[3]){2, DEPTH[k % 2] - 2, 0}, (double[3]){0, 1, 0});
        roller->kind = UZ_OBSTACLE_ROUND;
        roller->radius = 2;
        uz_result *result = solve(&s);
        check_converged(result, 1, 6);
        CHECK_MSG(fabs(result->summary.force[1] / FORCE[k % 2] - 1) < (k < 2 ? 1e-3 : 0.04), "%.8g",
                  result->summary.force[1]);
        give_back(result, &s);
    }
}

/* A rod of two and a half and six times the bore: what it overlaps is put on in parts. Pressure and outer radius by
 * quadrature. */
TEST(a_rod_much_thicker_than_the_bore)
{
    static const double RADIUS[] = {2.5, 6}, PRESSURE[] = {0.23487387, 0.26450414}, OUTER[] = {3.143535, 6.3436366};
    for (int k = 0; k < 2; k++) {
        uz_scene s = block("quad8", 1, acos(0), 4, 8, UZ_ELASTIC_NEO_HOOKE);
        s.box.origin[0] = 1;
        body_give_mesh(&s, bend);
        body_hold(&s, "bottom", NAN, 0, NAN);
        body_hold(&s, "top", 0, NAN, NAN);
        uz_contact *rod = body_plane(&s, "left", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
        rod->kind = UZ_OBSTACLE_ROUND;
        rod->radius = RADIUS[k];
        uz_result *result = solve(&s);
        const uz_finite *f = &result->summary.finite;
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK(f->load == 1 && f->steps > 1 && f->failed > 0 && f->qps < 40 && fabs(f->least_gap) < 2e-2);
        CHECK_MSG(fabs(result->summary.max_pressure / PRESSURE[k] - 1) < 2e-3, "%.8g", result->summary.max_pressure);
        CHECK_MSG(fabs((2 + moved_by(result, 2, 0)[0]) / OUTER[k] - 1) < 1e-4, "%.8g", 2 + moved_by(result, 2, 0)[0]);
        give_back(result, &s);
    }
}

static void bend_arch(double x[3])
{
    const double r = x[0], angle = x[1];
    x[0] = -r * sin(angle);
    x[1] = r * cos(angle) - 24;
}

/* Half an arch of span 20 and rise 2, whose limit load is 0.5730 (make arch): below it bears, above it has gone through
 * and lies on the plane. Both are minima. */
TEST(an_arch_bears_or_has_gone_through)
{
    static const double LOAD[] = {0.56, 1.0};
    for (int k = 0; k < 2; k++) {
        uz_scene s = block("quad8", 0.5, asin(10.0 / 26), 1, 16, UZ_ELASTIC_NEO_HOOKE);
        s.materials[0].young = 1000;
        s.box.origin[0] = 25.75;
        body_give_mesh(&s, bend_arch);
        body_hold(&s, "top", 0, 0, NAN);
        body_hold(&s, "bottom", 0, NAN, NAN);
        body_plane(&s, "left", (double[3]){0, -0.75, 0}, (double[3]){0, 1, 0});
        body_load(&s, UZ_LOAD_FORCE, "bottom", 0, -LOAD[k] / 2, 0);
        uz_result *result = solve(&s);
        check_converged(result, 2, 25);
        CHECK_MSG(k == 0 ? result->summary.force[1] == 0 : result->summary.force[1] > 0.1, "%.6g",
                  result->summary.force[1]);
        give_back(result, &s);
    }
}

/* ---- paths: cases that begin where another one has come to */

enum { POINTS = 4 };

/* parts: of cases a, b, ..., each after the one before it. */
static uz_result **walk(const uz_scene *s, const double *parts, int n)
{
    uz_load_case cases[POINTS] = {{.p = NULL}};
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *s, .cases = cases, .n_cases = n};
    const uz_settings settings = uz_settings_default();
    uz_result **r = NULL;
    uz_error err = {0};
    for (int i = 0; i < n; i++) {
        cases[i].name[0] = (char)('a' + i);
        cases[i].after[0] = i > 0 ? (char)('a' + i - 1) : '\0';
        cases[i].has_part = true;
        cases[i].part = parts[i];
    }
    CHECK_MSG(uz_solve_cases(&r, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s: %s", err.where,
              err.message);
    if (!r)
        exit(1);
    return r;
}

/* The block over the roller, which stands in it from the first. */
TEST(a_path_over_a_roller_does_not_matter)
{
    static const double PARTS[] = {0, 0.5, 1};
    uz_scene s = block("quad8", 4, 1, 16, 4, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "top", -2, 0, NAN);
    uz_contact *roller = body_plane(&s, "bottom", (double[3]){1, -1.8, 0}, (double[3]){0, 1, 0});
    roller->kind = UZ_OBSTACLE_ROUND;
    roller->radius = 2;
    uz_result **r = walk(&s, PARTS, 3);
    for (int i = 0; i < 3; i++) {
        CHECK_MSG(r[i]->summary.outcome == UZ_CONVERGED, "%s", r[i]->summary.message);
        CHECK(r[i]->summary.finite.load == 1 && r[i]->summary.finite.part == PARTS[i]);
        CHECK(r[i]->summary.finite.qps <= 20 && fabs(moved_by(r[i], 4, 1)[0] + 2 * PARTS[i]) < 1e-12);
    }
    CHECK_MSG(fabs(r[0]->summary.force[1] - 0.34405) < 0.003 * 0.34405, "%.7g", r[0]->summary.force[1]);
    CHECK_MSG(fabs(r[1]->summary.force[1] - 0.36159) < 0.003 * 0.36159, "%.7g", r[1]->summary.force[1]);
    CHECK_MSG(fabs(r[0]->summary.force[0] + r[2]->summary.force[0]) < 1e-8, "%.12g", r[2]->summary.force[0]);
    CHECK_MSG(fabs(r[0]->summary.force[1] - r[2]->summary.force[1]) < 1e-8, "%.12g", r[2]->summary.force[1]);
    uz_results_free(r, 3);
    uz_scene_clear(&s);
}

/* The arch along a path: up to its limit load, 0.5742 on this mesh and 0.5730 on fine ones, and no further. */
TEST(an_arch_ends_at_its_limit_load)
{
    static const double PARTS[] = {0.4, 0.56, 0.65, 0.7};
    uz_scene s = block("quad8", 0.5, asin(10.0 / 26), 2, 16, UZ_ELASTIC_NEO_HOOKE);
    s.materials[0].young = 1000;
    s.box.origin[0] = 25.75;
    body_give_mesh(&s, bend_arch);
    body_hold(&s, "top", 0, 0, NAN);
    body_hold(&s, "bottom", 0, NAN, NAN);
    body_plane(&s, "left", (double[3]){0, -0.75, 0}, (double[3]){0, 1, 0});
    body_load(&s, UZ_LOAD_FORCE, "bottom", 0, -0.5, 0);
    uz_result **r = walk(&s, PARTS, 4);
    for (int i = 0; i < 4; i++) {
        const uz_summary *sum = &r[i]->summary;
        CHECK_INT(sum->outcome, i < 2 ? UZ_CONVERGED : UZ_UNSTABLE);
        CHECK_MSG(i < 2 ? sum->finite.part == PARTS[i] : fabs(sum->finite.part - 0.5742) < 0.0003, "%.6g",
                  sum->finite.part);
        CHECK(sum->force[1] == 0 && sum->finite.definite && sum->finite.residual <= sum->requested_error);
        CHECK(fabs(r[i]->evaluation->supports[0].force[1] - 0.5 * sum->finite.part) < 1e-6);
    }
    CHECK(r[3]->summary.finite.load == 0 && strstr(r[3]->summary.message, "where it ended"));
    uz_results_free(r, 4);
    uz_scene_clear(&s);
}

TEST(a_path_that_leads_nowhere_is_refused)
{
    for (int k = 0; k < 3; k++) {
        static const char *const WHERE[] = {"/cases/1/after", "/cases/1/part", "/cases/1/after"};
        uz_scene s = squeezed("quad4", 1, UZ_ELASTIC_NEO_HOOKE, 0.9);
        uz_load_case cases[2] = {{.name = "a"},
                                 {.name = "b", .after = "b", .has_part = true, .part = k == 1 ? NAN : 1}};
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s, .cases = cases, .n_cases = 2};
        const uz_settings settings = uz_settings_default();
        uz_result **r = NULL;
        uz_error err = {0};
        if (k == 2) {
            cases[1].after[0] = 'a';
            problem.scene.kinematics = UZ_KINEMATICS_AUTO;
        }
        CHECK(uz_solve_cases(&r, &problem, &settings, NULL, NULL, NULL, &err) != UZ_OK);
        CHECK_STR(err.where, WHERE[k]);
        CHECK(!r);
        uz_scene_clear(&s);
    }
}

/* Nothing is strained: no norm to compare with. */
TEST(a_body_that_is_carried_along)
{
    uz_scene s = block("quad8", 2, 1, 2, 1, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "left", 100, -3, NAN);
    uz_result *result = solve(&s);
    check_converged(result, 1, 3);
    CHECK(fabs(moved_by(result, 2, 1)[0] - 100) < 1e-9 && fabs(moved_by(result, 2, 1)[1] + 3) < 1e-9);
    give_back(result, &s);
}

/* What stands in the way of supports stops a body as they move, also where it would fit beyond: down on a roller by
 * less and more than that is thick, and aside past one. */
TEST(nothing_is_carried_through_an_obstacle)
{
    static const struct {
        const char *held;
        double way[2], at[2], radius;
    } CASES[] = {{"top", {0, -0.5}, {0.5, -0.5}, 0.5},
                 {"top", {0, -0.8}, {0.5, -0.5}, 0.5},
                 {"top", {0, -2}, {0.5, -0.5}, 0.5},
                 {"top", {3, -0.1}, {1.5, -0.05}, 0.3}};
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        uz_scene s = block("quad4", 1, 1, 4, 4, UZ_ELASTIC_NEO_HOOKE);
        body_hold(&s, CASES[k].held, CASES[k].way[0], CASES[k].way[1], NAN);
        uz_contact *roller =
            body_plane(&s, "bottom", (double[3]){CASES[k].at[0], CASES[k].at[1], 0}, (double[3]){0, 1, 0});
        roller->kind = UZ_OBSTACLE_ROUND;
        roller->radius = CASES[k].radius;
        uz_result *result = solve(&s);
        const double *force = result->summary.force;
        CHECK_MSG(result->summary.outcome != UZ_CONVERGED, "%zu: %s, load %g", k,
                  uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), result->summary.finite.load);
        CHECK_MSG(k == 3 || force[1] > 0, "%zu: %g", k, force[1]);
        give_back(result, &s);
    }
}

/* Pulled so little that rounding shows. */
/* A circle smaller than the sides, which stands in the way of one: it was put behind it, within the body, and called
 * converged without a force. */
TEST(no_side_goes_through_an_obstacle_that_is_smaller)
{
    uz_scene s = block("quad4", 3, 1, 3, 1, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "top", 0, -1.5, NAN);
    uz_contact *c = body_plane(&s, "bottom", (double[3]){1.3, -0.5, 0}, (double[3]){0, 1, 0});
    c->kind = UZ_OBSTACLE_ROUND;
    c->radius = 0.2;
    uz_result *r = solve(&s);
    CHECK_INT(r->summary.outcome, UZ_MESH_LIMIT);
    CHECK_MSG(r->summary.finite.load > 0.3 && r->summary.finite.load < 0.6, "%.6g", r->summary.finite.load);
    CHECK(r->summary.active > 0 && r->evaluation->contacts[0].force[1] > 0);
    give_back(r, &s);
}

/* Whatever the steps were: blocks that are pushed over an obstacle of a fiftieth to a third of their sides, by many
 * times its size. What has gone past it has it inside, which no gap of a side tells. */
TEST(no_obstacle_is_inside_of_a_converged_body)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri6", "hex8", "tet10"};
    int refused = 0;
    for (int k = 0; k < 20; k++) {
        qp_random rng = {(uint64_t)k + 900};
        const bool solid = k % 5 > 2;
        const int cells = 1 + (int)(3 * random_unit(&rng));
        const double radius = (0.02 + 0.3 * random_unit(&rng)) / cells, gap = 0.05 + 0.3 * random_unit(&rng),
                     at = 0.2 + 0.6 * random_unit(&rng), by = (1.5 + random_unit(&rng)) * (2 * radius + gap);
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, ELEMENTS[k % 5], (double[3]){1, 1, 1},
                                (int64_t[3]){cells, 1 + k % 2, 1});
        s.kinematics = UZ_KINEMATICS_FINITE;
        s.materials[0].young = 1;
        s.materials[0].poisson = 0.3;
        s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
        body_hold(&s, "top", 0, -by, solid ? 0 : NAN);
        uz_contact *c = body_plane(&s, "bottom", (double[3]){at, -gap - radius, 0.5}, (double[3]){0, 0, 1});
        c->kind = k % 2 && solid ? UZ_OBSTACLE_CYLINDER : UZ_OBSTACLE_ROUND;
        c->radius = radius;
        uz_result *r = solve(&s);
        refused += r->summary.outcome != UZ_CONVERGED;
        /* what is pushed over it so far feels it */
        CHECK_MSG(r->summary.outcome != UZ_CONVERGED || r->evaluation->contacts[0].force[1] > 1e-6, "scene %d", k);
        CHECK(r->summary.outcome != UZ_MESH_LIMIT || strstr(r->summary.message, "finer mesh"));
        give_back(r, &s);
    }
    CHECK(refused > 5);
}

/* Balls of a thirtieth of a side: wholly in it, or beyond their middle and pulling; on the face between two elements.
 */
TEST(small_balls_are_inside_of_a_body_at_any_depth)
{
    for (int k = 0; k < 3; k++) {
        uz_scene s = body_scene(UZ_SOLID, k < 2 ? "tet10" : "hex8", (double[3]){3, 3, 1.5}, (int64_t[3]){2, 2, 1});
        s.kinematics = UZ_KINEMATICS_FINITE;
        s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
        body_hold(&s, "front", 0, 0, -0.1);
        const double radius = k == 0 ? 0.02 : 0.05, x = k < 2 ? 1.7 : 1.5, y = k < 2 ? 1.63 : 0.7;
        uz_contact *ball = &s.contacts[s.n_contacts++];
        *ball =
            (uz_contact){.kind = UZ_OBSTACLE_ROUND, .on = "back", .point = {x, y, -0.02 - radius}, .radius = radius};
        uz_result *r = solve(&s);
        CHECK_MSG(r->summary.outcome == UZ_MESH_LIMIT && strstr(r->summary.message, "finer mesh") &&
                      r->summary.finite.load > 0.2 && !(r->evaluation->contacts[0].force[2] < 0),
                  "%d: %d, %g", k, r->summary.outcome, r->evaluation->contacts[0].force[2]);
        give_back(r, &s);
    }
}

/* Of strains of 5e-9 as of others. */
TEST(small_strains_have_their_part_of_the_mesh)
{
    double error[2];
    for (int k = 0; k < 2; k++) {
        uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){60, 20, 1}, (int64_t[3]){12, 4, 1});
        s.kinematics = UZ_KINEMATICS_FINITE;
        s.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
        body_hold(&s, "left", 0, 0, NAN);
        body_load(&s, UZ_LOAD_TRACTION, "right", 0, k == 0 ? -1 : -1e-5, 0);
        uz_result *r = solve(&s);
        error[k] = r->summary.discretization_error;
        give_back(r, &s);
    }
    CHECK_MSG(error[0] > 0.2 && fabs(error[1] - error[0]) < 0.01 * error[0], "%g and %g", error[0], error[1]);
}

TEST(what_rounding_leaves_is_told)
{
    uz_scene s = block("quad4", 1, 1, 1, 1, UZ_ELASTIC_NEO_HOOKE);
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "right", 1e-11, 0, 0);
    uz_result *result = solve(&s);
    CHECK_INT(result->summary.outcome, UZ_PRECISION_LIMIT);
    CHECK(result->summary.finite.load == 1 && result->summary.finite.residual < 0.1);
    CHECK(strlen(result->summary.message) > 20);
    give_back(result, &s);
}

static bool stop_now(void *ctx)
{
    int *left = ctx;
    return (*left)-- <= 0;
}

TEST(a_solve_that_is_stopped_says_what_it_has)
{
    int stopped = 0;
    for (int questions = 0; questions < 400; questions += 40) {
        uz_scene s = over_roller("quad4", 4, -2);
        int left = questions;
        const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
        const uz_settings settings = uz_settings_default();
        const uz_hooks hooks = {.ctx = &left, .cancelled = stop_now};
        uz_result *result = NULL;
        uz_error err = {0};
        const uz_status status = uz_solve(&result, &problem, &settings, NULL, &hooks, &err);
        CHECK(status == UZ_OK || status == UZ_ERR_CANCELLED);
        CHECK(!result || result->summary.outcome == UZ_CONVERGED || result->summary.outcome == UZ_DISMISSED);
        stopped += !result || result->summary.outcome == UZ_DISMISSED;
        give_back(result, &s);
    }
    CHECK(stopped > 0);
}

TEST(what_there_is_no_model_for_is_refused)
{
    for (int k = 0; k < 6; k++) {
        uz_scene s = squeezed("quad4", 1, UZ_ELASTIC_NEO_HOOKE, 0.9);
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
        uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        static const char *const WHERE[] = {"/materials/0/law",
                                            "/solver/stopping",
                                            "/solver/accuracy",
                                            "/materials/0/poisson",
                                            "/contacts/0/obstacle/height",
                                            "/mesh"};
        if (k == 0)
            problem.scene.materials[0].law = UZ_ELASTIC_LINEAR;
        if (k == 3) {
            problem.scene.model = UZ_PLANE_STRESS;
            problem.scene.materials[0].poisson = 0.5;
        }
        if (k > 3) { /* tables bend between their values; a factor that would be too large */
            uz_scene_clear(&s);
            s = solid("hex8", (double[3]){1, 1, 1}, (int64_t[3]){20, 20, k == 5 ? 20 : 1}, UZ_ELASTIC_NEO_HOOKE);
            body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
            body_hold(&s, "top", 0, -0.1, 0);
            problem.scene = s;
            problem.scene.contacts[0].kind = k == 4 ? UZ_OBSTACLE_HEIGHT : UZ_OBSTACLE_PLANE;
        }
        settings.stopping = k == 1 ? UZ_STOP_PAPER : UZ_STOP_CERTIFIED;
        settings.guaranteed = k == 2;
        CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
        CHECK_STR(err.where, WHERE[k]);
        CHECK(!result);
        uz_scene_clear(&s);
    }
}

/* ---- generated scenes: whatever is called converged is an equilibrium by differences of the energy */

enum { LINE = 4 };

static void put_obstacle(uz_scene *s, qp_random *rng, double length)
{
    uz_contact *c = body_plane(s, "bottom", (double[3]){0, 0, 0}, (double[3]){0.4 * random_signed(rng), 1, 0});
    const double kind = random_unit(rng);
    if (kind < 0.25)
        return;
    const double radius = length * (0.2 + random_unit(rng)), at = length * random_unit(rng);
    c->point[0] = at;
    c->point[1] = -radius;
    c->radius = radius;
    c->kind = UZ_OBSTACLE_ROUND;
    if (kind < 0.7)
        return;
    c->kind = UZ_OBSTACLE_POLYLINE;
    c->n_x = LINE;
    c->x = body_room(LINE, sizeof *c->x);
    c->y = body_room(LINE, sizeof *c->y);
    for (int k = 0; k < LINE; k++) {
        c->x[k] = length * (k - 0.5) / 2;
        c->y[k] = k == 0 || k == 3 ? -0.3 : -0.05 * random_unit(rng);
    }
}

static uz_scene random_finite(qp_random *rng)
{
    static const char *const ELEMENTS[] = {"quad4", "quad8", "tri3", "tri6"};
    const double length = 1 + 3 * random_unit(rng);
    const int64_t cells = 2 + (int64_t)(3 * random_unit(rng));
    uz_scene s = block(ELEMENTS[(int)(4 * random_unit(rng))], length, 1, (int64_t)((double)cells * length), cells,
                       (uz_elasticity)(1 + (int)(3 * random_unit(rng))));
    s.materials[0].poisson = 0.4 * random_unit(rng);
    put_obstacle(&s, rng, length);
    if (random_unit(rng) < 0.6) {
        body_hold(&s, "top", 2 * random_signed(rng), -0.6 * random_unit(rng), NAN);
    } else {
        body_hold(&s, "left", 0, 0.2 * random_signed(rng), NAN);
        body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.15 * random_unit(rng), 0);
    }
    return s;
}

static uz_scene random_solid(qp_random *rng)
{
    static const char *const ELEMENTS[] = {"hex8", "tet4", "hex20", "tet10"};
    const double length = 1 + random_unit(rng), kind = random_unit(rng);
    const int element = (int)(4 * random_unit(rng));
    const int64_t cells = element < 2 ? 3 : 2;
    uz_scene s = solid(ELEMENTS[element], (double[3]){length, 1, 1}, (int64_t[3]){cells, cells, cells},
                       (uz_elasticity)(1 + (int)(3 * random_unit(rng))));
    s.materials[0].poisson = 0.4 * random_unit(rng);
    const double radius = 1 + 2 * random_unit(rng), at[3] = {length * random_unit(rng), -radius, random_unit(rng)};
    put_round(&s, kind < 0.6 ? UZ_OBSTACLE_ROUND : UZ_OBSTACLE_CYLINDER, at, radius);
    s.contacts[0].normal[0] = random_signed(rng); /* axes and planes are oblique */
    if (kind > 0.8) {
        s.contacts[0].kind = UZ_OBSTACLE_PLANE;
        s.contacts[0].point[1] = 0;
        s.contacts[0].normal[1] = 3;
    }
    if (random_unit(rng) < 0.6) {
        body_hold(&s, "top", random_signed(rng), -0.4 * random_unit(rng), 0.5 * random_signed(rng));
    } else {
        body_hold(&s, "left", 0, 0.1 * random_signed(rng), 0);
        body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.1 * random_unit(rng), 0.02 * random_signed(rng));
    }
    return s;
}

TEST(what_converges_is_an_equilibrium)
{
    enum { SCENES = 50 };
    int converged = 0;
    int64_t most = 0;
    for (int k = 0; k < SCENES; k++) {
        qp_random rng = {(uint64_t)k + 1};
        const bool space = k % 5 == 4;
        uz_scene s = space ? random_solid(&rng) : random_finite(&rng);
        if (k % 4 == 3 && !space) {
            s.model = UZ_AXISYMMETRIC;
            s.box.origin[0] = 1;
        }
        if (k % 4 == 1 && !space)
            s.model = UZ_PLANE_STRESS;
        const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
        const uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        const uz_status status = uz_solve(&result, &problem, &settings, NULL, NULL, &err);
        CHECK_MSG(status == UZ_OK || (status == UZ_ERR_SCENE && strstr(err.message, "is held by a support")), "%s: %s",
                  err.where, err.message);
        if (status != UZ_OK) {
            uz_scene_clear(&s);
            continue;
        }
        const uz_summary *sum = &result->summary;
        if (sum->outcome == UZ_CONVERGED) {
            converged++;
            most = sum->finite.qps > most ? sum->finite.qps : most;
            bool *stays = body_room(result->n_nodes, sizeof *stays);
            for (int64_t i = 0; i < result->n_nodes; i++)
                stays[i] = result->mesh.xyz[result->mesh.dim * i + 1] < 1e-9;
            const double slope = energy_slope(result, &s, stays, &rng);
            free(stays);
            /* the residual is relative to an energy of about 1, of rings of ten; flat elements are stiffer */
            CHECK_MSG(slope < (k % 4 == 3 ? 1e-7 : 1e-8) / sum->finite.least_det, "scene %d: %.3g", k, slope);
            CHECK(sum->finite.definite && sum->finite.least_det > 0 && sum->max_penetration < 1e-8);
        }
        give_back(result, &s);
    }
    printf("# %d of %d converged, in at most %lld contact problems\n", converged, SCENES, (long long)most);
    CHECK(2 * converged > SCENES);
}
