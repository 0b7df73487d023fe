/* The element matrix against closed forms. */
#include "assembly/quad4.h"
#include "harness.h"
#include "scene_fixture.h"

static double quadratic_form(const double ke[64], const double u[8])
{
    double sum = 0;
    for (int i = 0; i < 8; i++)
        for (int j = 0; j < 8; j++)
            sum += u[i] * ke[8 * i + j] * u[j];
    return sum;
}

/* The matrix of a square in plane stress is known in closed form: row 1 is E t / (1 - nu^2) times
 * (1/2 - nu/6, (1 + nu)/8, -1/4 - nu/12, (3 nu - 1)/8, nu/12 - 1/4, -(1 + nu)/8, nu/6, (1 - 3 nu)/8), whatever its
 * side. */
TEST(square_element_has_its_closed_form)
{
    const double E = 200e3, nu = 0.3, t = 5, f = E * t / (1 - nu * nu);
    const double row[8] = {0.5 - nu / 6,   (1 + nu) / 8,  -0.25 - nu / 12, (3 * nu - 1) / 8,
                           nu / 12 - 0.25, -(1 + nu) / 8, nu / 6,          (1 - 3 * nu) / 8};
    const double sides[3] = {1, 1e-3, 1e6};
    double C[9], ke[64];
    uz_elasticity(C, UZ_PLANE_STRESS, E, nu);
    for (int s = 0; s < 3; s++) {
        const double a = sides[s], xy[8] = {3, 4, 3 + a, 4, 3 + a, 4 + a, 3, 4 + a};
        const double at_zero[8] = {0, 0, a, 0, a, a, 0, a};
        CHECK(uz_quad4_stiffness(ke, s == 0 ? xy : at_zero, C, t));
        for (int j = 0; j < 8; j++)
            CHECK_REL(ke[j], f * row[j], 1e-12);
    }
}

static const double DISTORTED[8] = {0.1, -0.2, 2.3, 0.1, 1.9, 1.7, -0.3, 1.2};

TEST(element_is_symmetric_of_rank_five)
{
    double C[9], ke[64], L[64];
    uz_elasticity(C, UZ_PLANE_STRAIN, 70, 0.25);
    CHECK(uz_quad4_stiffness(ke, DISTORTED, C, 2));
    double rigid[3][8];
    for (int a = 0; a < 4; a++) {
        rigid[0][2 * a] = 1, rigid[0][2 * a + 1] = 0;
        rigid[1][2 * a] = 0, rigid[1][2 * a + 1] = 1;
        rigid[2][2 * a] = -DISTORTED[2 * a + 1], rigid[2][2 * a + 1] = DISTORTED[2 * a];
    }
    for (int i = 0; i < 8; i++) {
        for (int j = 0; j < 8; j++)
            CHECK(ke[8 * i + j] == ke[8 * j + i]);
        for (int k = 0; k < 3; k++) {
            double force = 0;
            for (int j = 0; j < 8; j++)
                force += ke[8 * i + j] * rigid[k][j];
            CHECK_MSG(fabs(force) < 1e-12 * ke[0], "rigid mode %d gives force %g in dof %d", k, force, i);
        }
    }
    /* Rank 5: positive definite once the three rigid modes are given a stiffness, and not before. */
    memcpy(L, ke, sizeof L);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 8; i++)
            for (int j = 0; j < 8; j++)
                L[8 * i + j] += ke[0] * rigid[k][i] * rigid[k][j];
    CHECK(dense_cholesky(L, 8));
    CHECK(L[63] > 1e-3 * sqrt(ke[0]));
}

/* An hourglass is a real deformation: reduced integration would give it none. */
TEST(hourglass_has_energy)
{
    const double hourglass[8] = {1, 0, -1, 0, 1, 0, -1, 0};
    double C[9], ke[64];
    uz_elasticity(C, UZ_PLANE_STRESS, 1, 0);
    CHECK(uz_quad4_stiffness(ke, (const double[8]){0, 0, 2, 0, 2, 2, 0, 2}, C, 1));
    /* u = xi eta: strain (eta, 0, xi), energy integral eta^2 + xi^2 / 2 over the square of area 4 = 4/3 + 2/3. */
    CHECK_REL(quadratic_form(ke, hourglass), 2.0, 1e-13);
}

TEST(bad_elements_are_refused)
{
    double C[9], ke[64];
    uz_elasticity(C, UZ_PLANE_STRESS, 1, 0.3);
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 0, 1, 1, 1, 1, 0}, C, 1));     /* clockwise */
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 1, 1, 1, 0, 0, 1}, C, 1));     /* a bow tie */
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 2, 0, 0.2, 0.2, 0, 2}, C, 1)); /* not convex */
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 1, 0, 1, 0, 0, 1}, C, 1));     /* two nodes in one place */
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 1, 0, 2, 0, 3, 0}, C, 1));     /* no area */
    CHECK(!uz_quad4_stiffness(ke, (const double[8]){0, 0, 1, 0, (double)NAN, 1, 0, 1}, C, 1));
}

TEST(elasticity_matches_textbook)
{
    const double E = 200, nu = 0.3, strain_factor = E / ((1 + nu) * (1 - 2 * nu));
    double C[9];
    uz_elasticity(C, UZ_PLANE_STRAIN, E, nu);
    CHECK_REL(C[0], strain_factor * (1 - nu), 1e-14);
    CHECK_REL(C[1], strain_factor * nu, 1e-14);
    CHECK_REL(C[8], E / (2 * (1 + nu)), 1e-14);
    uz_elasticity(C, UZ_PLANE_STRESS, E, nu);
    CHECK_REL(C[4], E / (1 - nu * nu), 1e-14);
    CHECK_REL(C[3], nu * E / (1 - nu * nu), 1e-14);
    CHECK(C[2] == 0 && C[5] == 0 && C[6] == 0 && C[7] == 0);
}
