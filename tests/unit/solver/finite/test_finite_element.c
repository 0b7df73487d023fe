/* Laws and elements of finite strain: derivatives by differences, the linear law where strains are small, rotations. */
#include "body_fixture.h"
#include "certificate/piola.h"
#include "finite/finite_element.h"
#include "finite/hyperelastic.h"
#include "qp_fixture.h"

enum { MOST = UZ_ELEMENT_DOFS };
static const double LAMBDA = 1.3, MU = 0.7;

static double any(qp_random *rng, double size)
{
    return size * (2 * random_unit(rng) - 1);
}

/* F by rows. */
static void strains_of(double C[6], const double F[9])
{
    static const int AXIS[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    for (int c = 0; c < 6; c++) {
        const int i = AXIS[c][0], j = AXIS[c][1];
        C[c] = F[i] * F[j] + F[3 + i] * F[3 + j] + F[6 + i] * F[6 + j];
    }
}

/* In the plane and across it, or all of it. */
static void any_gradient(double F[9], qp_random *rng, bool plane)
{
    for (int i = 0; i < 9; i++)
        F[i] = (i % 4 == 0) + (plane && (i == 2 || i == 5 || i == 6 || i == 7) ? 0 : any(rng, plane ? 0.4 : 0.25));
}

/* S = dW/dE and D = dS/dE, E = (C - I) / 2. */
TEST(stress_and_tangent_of_laws_are_derivatives)
{
    qp_random rng = {7};
    for (int k = 0; k < 120; k++)
        for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++) {
            const int n = k < 60 ? 4 : 6;
            const double h = 1e-6;
            double F[9], C[6], W, S[6], D[6][6];
            any_gradient(F, &rng, n == 4);
            strains_of(C, F);
            CHECK(uz_hyperelastic(&W, S, D, n, (uz_elasticity)law, LAMBDA, MU, C));
            for (int j = 0; j < n; j++) {
                double moved[6], energy[2], stress[2][6], unused[6][6];
                for (int side = 0; side < 2; side++) {
                    memcpy(moved, C, sizeof C);
                    moved[j] += (side ? h : -h) * (j >= 3 ? 1 : 2); /* 2 E_xy = C_xy */
                    CHECK(
                        uz_hyperelastic(&energy[side], stress[side], unused, n, (uz_elasticity)law, LAMBDA, MU, moved));
                }
                CHECK_MSG(fabs((energy[1] - energy[0]) / (2 * h) - S[j]) < 1e-8, "law %d", law);
                for (int i = 0; i < n; i++)
                    CHECK_MSG(fabs((stress[1][i] - stress[0][i]) / (2 * h) - D[i][j]) < 1e-6, "law %d", law);
            }
        }
    double W, S[6], D[6][6];
    CHECK(!uz_hyperelastic(&W, S, D, 4, UZ_ELASTIC_NEO_HOOKE, LAMBDA, MU, (double[6]){1, 1, 1, 1}));
    CHECK(!uz_hyperelastic(&W, S, D, 4, UZ_ELASTIC_NEO_HOOKE, LAMBDA, MU, (double[6]){1, 1}));
    CHECK(!uz_hyperelastic(&W, S, D, 6, UZ_ELASTIC_NEO_HOOKE, LAMBDA, MU, (double[6]){1, 1, 1, 0, 1, 0}));
}

/* The certificate's own statement of the laws, P = F S, and its derivative by differences. */
TEST(the_certificate_states_the_same_laws)
{
    static const int ROW[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    qp_random rng = {8};
    for (int k = 0; k < 120; k++)
        for (int law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF; law < UZ_ELASTICITIES; law++) {
            const bool plane = k < 60;
            const long double h = 1e-7L;
            long double at[9];
            double F[9], C[6], W, S[6] = {0}, D[6][6];
            uz_piola own, side[2];
            any_gradient(F, &rng, plane);
            for (int i = 0; i < 9; i++)
                at[i] = F[i];
            strains_of(C, F);
            CHECK(uz_hyperelastic(&W, S, D, plane ? 4 : 6, (uz_elasticity)law, LAMBDA, MU, C));
            uz_piola_at(&own, (uz_elasticity)law, LAMBDA, MU, at, plane);
            CHECK(fabs((double)own.W - W) < 1e-14);
            for (int j = 0; j < 9; j++) {
                const bool none = plane && (j == 2 || j == 5 || j == 6 || j == 7);
                double P = 0;
                for (int l = 0; l < 3; l++)
                    P += F[j / 3 * 3 + l] * S[ROW[l][j % 3]];
                if (none)
                    continue;
                CHECK_MSG(fabs((double)own.P[j] - P) < 1e-13, "law %d", law);
                for (int s = 0; s < 2; s++) {
                    long double moved[9];
                    memcpy(moved, at, sizeof at);
                    moved[j] += s ? h : -h;
                    uz_piola_at(&side[s], (uz_elasticity)law, LAMBDA, MU, moved, plane);
                }
                for (int i = 0; i < 9; i++)
                    CHECK_MSG((plane && (i == 2 || i == 5 || i == 6 || i == 7)) ||
                                  fabsl((side[1].P[i] - side[0].P[i]) / (2 * h) - own.A[i][j]) < 1e-10L,
                              "law %d", law);
            }
        }
}

static uz_element bent_element(double *xyz, uz_element_kind kind, qp_random *rng)
{
    const uz_element_type *type = uz_element_type_of(kind);
    for (int a = 0; a < type->nodes; a++)
        for (int c = 0; c < type->dim; c++)
            xyz[type->dim * a + c] = type->local[a][c] + any(rng, type->dim == 2 ? 0.08 : 0.04);
    return (uz_element){.kind = kind,
                        .model = type->dim == 2 ? UZ_PLANE_STRAIN : UZ_SOLID,
                        .formulation = UZ_FORMULATION_STANDARD,
                        .lame = {LAMBDA, MU, NULL},
                        .thickness = 1.5,
                        .xyz = xyz};
}

static bool evaluate(uz_finite_forces *out, double *ke, const uz_element *element, uz_elasticity law, const double *u,
                     const double *step)
{
    uz_finite_rule rule;
    uz_finite_rule_of(&rule, element->kind, element->model);
    return uz_finite_element(out, ke, true, &rule, element, law, u, step);
}

/* The n forces are derivatives of the energy, and ke those of the forces, within these. */
static void check_derivatives(const uz_finite_forces *at, const double *ke, const uz_element *element,
                              uz_elasticity law, double *u, int n, double of_force, double of_ke)
{
    for (int j = 0; j < n; j++) {
        const double h = 1e-6, before = u[j];
        uz_finite_forces side[2];
        for (int s = 0; s < 2; s++) {
            u[j] = before + (s ? h : -h);
            CHECK(evaluate(&side[s], NULL, element, law, u, NULL));
        }
        u[j] = before;
        CHECK_MSG(fabs((side[1].energy - side[0].energy) / (2 * h) - at->force[j]) < of_force, "%s: %g",
                  uz_element_name(element->kind), at->force[j]);
        for (int i = 0; i < n; i++)
            CHECK_MSG(fabs((side[1].force[i] - side[0].force[i]) / (2 * h) - ke[i * n + j]) < of_ke, "%s: %g",
                      uz_element_name(element->kind), ke[i * n + j]);
    }
}

static const uz_element_kind KINDS[] = {UZ_TRI3, UZ_QUAD4, UZ_TRI6,  UZ_QUAD8,  UZ_TET4,
                                        UZ_HEX8, UZ_TET10, UZ_HEX20, UZ_WEDGE6, UZ_WEDGE15};

TEST(forces_and_tangents_of_elements_are_derivatives)
{
    qp_random rng = {9};
    int compared = 0;
    for (int k = 0; k < 116; k++) {
        double xyz[MOST], u[MOST], ke[MOST * MOST], other[MOST * MOST];
        uz_element element = bent_element(xyz, KINDS[k < 80 ? k % 4 : 4 + k % 6], &rng);
        const uz_elasticity law = (uz_elasticity)(1 + k / (k < 80 ? 4 : 6) % 3);
        const int n = (k < 80 ? 2 : 3) * uz_element_node_count(element.kind);
        const bool ring = k >= 40 && k < 80;
        if (k % 8 >= 4 && k < 40) {
            element.model = UZ_PLANE_STRESS;
            element.lame.lambda = 0.4;
        }
        uz_finite_forces at;
        if (ring) { /* a ring; its inner side on the axis where it is straight */
            element.model = UZ_AXISYMMETRIC;
            for (int a = 0; a < n / 2; a++)
                xyz[2 * a] = k % 3 ? xyz[2 * a] + 2 : fmax(0, xyz[2 * a] + 1);
        }
        for (int i = 0; i < n; i++)
            u[i] = any(&rng, k < 80 ? 0.15 : 0.06);
        if (!evaluate(&at, ke, &element, law, u, NULL))
            continue;
        compared++;
        check_derivatives(&at, ke, &element, law, u, n, ring ? 1e-6 : 1e-7, ring ? 1e-4 : 1e-6);
        /* undeformed: the stiffness of small strain */
        memset(u, 0, sizeof u);
        CHECK(evaluate(&at, ke, &element, law, u, NULL) && fabs(at.energy) < 1e-15);
        CHECK_INT(uz_element_stiffness(other, &element), UZ_SHAPE_GOOD);
        for (int i = 0; i < n * n; i++)
            CHECK(fabs(ke[i] - other[i]) < 1e-12);
    }
    CHECK_MSG(compared > 100, "%d", compared);
}

/* Of mean dilatation: the same; at rest it is that of small strain, where n is 2 in plane strain, too. */
TEST(mean_dilatation_has_an_energy)
{
    qp_random rng = {14};
    int compared = 0;
    for (int k = 0; k < 36; k++) {
        double xyz[MOST], u[MOST], ke[MOST * MOST], other[MOST * MOST];
        const bool solid = k % 3 == 0, ring = k % 3 == 1;
        uz_element element = bent_element(xyz, solid ? UZ_HEX8 : UZ_QUAD4, &rng);
        const uz_elasticity law = (uz_elasticity)(1 + k / 3 % 3);
        const int n = solid ? 24 : 8;
        uz_finite_forces at;
        element.formulation = UZ_FORMULATION_BBAR;
        element.lame.lambda = 20;
        for (int a = 0; a < 4 && ring; a++)
            xyz[2 * a] = k % 2 ? xyz[2 * a] + 2 : fmax(0, xyz[2 * a] + 1);
        if (ring)
            element.model = UZ_AXISYMMETRIC;
        for (int i = 0; i < n; i++)
            u[i] = any(&rng, solid ? 0.06 : 0.15);
        if (k >= 27) /* warm */
            uz_finite_warm(&element, xyz, u, 0.05);
        if (!evaluate(&at, ke, &element, law, u, NULL))
            continue;
        compared++;
        check_derivatives(&at, ke, &element, law, u, n, 1e-6, ring ? 1e-4 : 1e-5);
        if (k >= 27)
            continue;
        memset(u, 0, sizeof u);
        CHECK(evaluate(&at, ke, &element, law, u, NULL) && fabs(at.energy) < 1e-13);
        CHECK_INT(uz_element_stiffness(other, &element), UZ_SHAPE_GOOD);
        for (int i = 0; i < n * n; i++)
            CHECK(fabs(ke[i] - other[i]) < 1e-11 * (ring ? 20 : 1));
    }
    CHECK_MSG(compared > 30, "%d", compared);
}

/* Of mean dilatation Cauchy's stress has one pressure in the element, K (theta - 1) of the isochoric law; where F is
 * the same everywhere all is as without. */
TEST(mean_dilatation_has_one_pressure)
{
    static const double POINT[2][3] = {{0.3, -0.6, 0.2}, {-0.7, 0.5, -0.4}};
    qp_random rng = {15};
    for (int k = 0; k < 12; k++) {
        double xyz[MOST], u[MOST];
        uz_element element = bent_element(xyz, k % 2 ? UZ_HEX8 : UZ_QUAD4, &rng);
        const int dim = k % 2 ? 3 : 2, n = dim * uz_element_node_count(element.kind);
        const bool even = k >= 6;
        double H[3][3], pressure[2];
        uz_finite_state state[2];
        for (int i = 0; i < 9; i++)
            H[i / 3][i % 3] = any(&rng, 0.1);
        for (int i = 0; i < n; i++) {
            u[i] = even ? 0 : any(&rng, 0.05);
            for (int j = 0; j < dim; j++)
                u[i] += H[i % dim][j] * xyz[i / dim * dim + j];
        }
        for (int s = 0; s < 2; s++) {
            element.formulation = even && s ? UZ_FORMULATION_STANDARD : UZ_FORMULATION_BBAR;
            uz_finite_state_at(&state[s], &element, UZ_ELASTIC_NEO_HOOKE_ISOCHORIC, u, POINT[even ? 0 : s]);
            pressure[s] = (state[s].stress[0] + state[s].stress[1] + state[s].stress[2]) / 3;
        }
        CHECK_MSG(fabs(pressure[0] - pressure[1]) < 1e-13, "%d: %g, %g", k, pressure[0], pressure[1]);
        for (int c = 0; c < 6 && even; c++)
            CHECK(fabs(state[0].stress[c] - state[1].stress[c]) < 1e-13 &&
                  fabs(state[0].strain[c] - state[1].strain[c]) < 1e-13);
        CHECK(even || fabs(state[0].stress[0] - state[1].stress[0]) > 1e-5);
    }
}

/* Turned and carried off, an element has its energy, and its forces turn along; Cauchy's stress does, too. */
TEST(rotations_strain_nothing)
{
    qp_random rng = {10};
    for (int k = 0; k < 24; k++) {
        double xyz[MOST], u[MOST], turned[MOST];
        const uz_element element = bent_element(xyz, KINDS[k % 4], &rng);
        const uz_elasticity law = (uz_elasticity)(1 + k / 4 % 3);
        const int n = uz_element_node_count(element.kind);
        const double angle = any(&rng, 3), c = cos(angle), s = sin(angle);
        uz_finite_forces before, after;
        uz_finite_state state[2];
        for (int i = 0; i < 2 * n; i++)
            u[i] = any(&rng, 0.05);
        for (int a = 0; a < n; a++) {
            const double x = xyz[2 * a] + u[2 * a], y = xyz[2 * a + 1] + u[2 * a + 1];
            turned[2 * a] = c * x - s * y + 5 - xyz[2 * a];
            turned[2 * a + 1] = s * x + c * y - 2 - xyz[2 * a + 1];
        }
        CHECK(evaluate(&before, NULL, &element, law, u, NULL));
        CHECK(evaluate(&after, NULL, &element, law, turned, NULL));
        CHECK(fabs(before.energy - after.energy) < 1e-12 && fabs(before.least_det - after.least_det) < 1e-12);
        for (int a = 0; a < n; a++)
            CHECK(fabs(c * before.force[2 * a] - s * before.force[2 * a + 1] - after.force[2 * a]) < 1e-12);
        const double *centre = uz_element_type_of(element.kind)->centre;
        uz_finite_state_at(&state[0], &element, law, u, centre);
        uz_finite_state_at(&state[1], &element, law, turned, centre);
        const double *a = state[0].stress, *b = state[1].stress;
        CHECK(fabs(a[0] + a[1] - b[0] - b[1]) < 1e-12 && fabs(a[2] - b[2]) < 1e-12);
        CHECK(fabs(c * c * a[0] + s * s * a[1] - 2 * c * s * a[3] - b[0]) < 1e-12);
        CHECK(fabs(state[0].strain[3] - state[1].strain[3]) < 1e-12);
    }
}

/* The same in space, about an axis of no direction in particular. */
TEST(rotations_of_solids_strain_nothing)
{
    static const double AXIS[3] = {2. / 3, -1. / 3, 2. / 3};
    qp_random rng = {13};
    for (int k = 0; k < 24; k++) {
        double xyz[MOST], u[MOST], turned[MOST], Q[9];
        const uz_element element = bent_element(xyz, KINDS[4 + k % 6], &rng);
        const uz_elasticity law = (uz_elasticity)(1 + k / 6 % 3);
        const int n = uz_element_node_count(element.kind);
        const double angle = any(&rng, 3), c = cos(angle), s = sin(angle);
        uz_finite_forces before, after;
        uz_finite_state state[2];
        for (int i = 0; i < 9; i++) /* Rodrigues */
            Q[i] = (i % 4 == 0 ? c : 0) + (1 - c) * AXIS[i / 3] * AXIS[i % 3];
        for (int i = 0; i < 3; i++) {
            Q[3 * i + (i + 1) % 3] -= s * AXIS[(i + 2) % 3];
            Q[3 * i + (i + 2) % 3] += s * AXIS[(i + 1) % 3];
        }
        for (int i = 0; i < 3 * n; i++)
            u[i] = any(&rng, 0.04);
        for (int i = 0; i < 3 * n; i++) {
            turned[i] = 5 - xyz[i];
            for (int j = 0; j < 3; j++)
                turned[i] += Q[3 * (i % 3) + j] * (xyz[i / 3 * 3 + j] + u[i / 3 * 3 + j]);
        }
        CHECK(evaluate(&before, NULL, &element, law, u, NULL) && before.energy > 1e-4);
        CHECK(evaluate(&after, NULL, &element, law, turned, NULL));
        CHECK(fabs(before.energy - after.energy) < 1e-12 && fabs(before.least_det - after.least_det) < 1e-12);
        for (int i = 0; i < 3 * n; i++) {
            const double *f = before.force + i / 3 * 3;
            const double expected = Q[3 * (i % 3)] * f[0] + Q[3 * (i % 3) + 1] * f[1] + Q[3 * (i % 3) + 2] * f[2];
            CHECK(fabs(expected - after.force[i]) < 1e-12);
        }
        const double *centre = uz_element_type_of(element.kind)->centre;
        uz_finite_state_at(&state[0], &element, law, u, centre);
        uz_finite_state_at(&state[1], &element, law, turned, centre);
        const double *a = state[0].stress, *b = state[1].stress;
        const double full[9] = {a[0], a[3], a[5], a[3], a[1], a[4], a[5], a[4], a[2]};
        double xx = 0, xy = 0;
        for (int i = 0; i < 9; i++) {
            xx += Q[i / 3] * full[i] * Q[i % 3];
            xy += Q[i / 3] * full[i] * Q[3 + i % 3];
        }
        CHECK(fabs(xx - b[0]) < 1e-12 && fabs(xy - b[3]) < 1e-12);
        CHECK(fabs(state[0].strain[4] - state[1].strain[4]) < 1e-12);
    }
}

/* Stepped along the tangent of a turn, w (-y, x), an element is stretched by w^2 / 2 in all directions, with the stress
 * (lambda + mu) w^2; the step was made for no strain at all. Along a uniform stretch aside the difference of the two
 * tangents is this stress by the area. */
TEST(a_step_along_a_turn_leaves_no_stress_in_the_tangent)
{
    qp_random rng = {12};
    for (int k = 0; k < 5; k++) { /* the last with mean dilatation */
        double xyz[MOST], u[MOST], plain[MOST * MOST], stepped[MOST * MOST], sum = 0;
        uz_element element = bent_element(xyz, k < 4 ? KINDS[k] : UZ_QUAD4, &rng);
        element.formulation = k < 4 ? UZ_FORMULATION_STANDARD : UZ_FORMULATION_BBAR;
        const int n = 2 * uz_element_node_count(element.kind);
        const double w = 0.3, stress = (element.lame.lambda + element.lame.mu) * w * w;
        uz_finite_forces at;
        for (int a = 0; a < n; a += 2) {
            u[a] = -w * xyz[a + 1];
            u[a + 1] = w * xyz[a];
        }
        CHECK(evaluate(&at, plain, &element, UZ_ELASTIC_ST_VENANT_KIRCHHOFF, u, NULL));
        CHECK(evaluate(&at, stepped, &element, UZ_ELASTIC_ST_VENANT_KIRCHHOFF, u, u));
        for (int i = 0; i < n; i += 2)
            for (int j = 0; j < n; j += 2)
                sum += xyz[i] * (plain[i * n + j] - stepped[i * n + j]) * xyz[j];
        const double expected = stress * uz_element_volume(&element);
        CHECK_MSG(fabs(sum - expected) < 1e-12 * expected, "%.15g, not %.15g", sum, expected);
    }
}

TEST(what_is_inside_out_is_told)
{
    qp_random rng = {11};
    double xyz[MOST], u[MOST] = {0};
    const uz_element element = bent_element(xyz, UZ_QUAD4, &rng);
    uz_finite_forces at;
    u[4] = u[5] = -2.5; /* a corner beyond the opposite one: no quadrature point need see it */
    CHECK(!evaluate(&at, NULL, &element, UZ_ELASTIC_NEO_HOOKE, u, NULL) && at.least_det < 0);
}
