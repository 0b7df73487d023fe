/* The cube of bricks that orderings are measured on: its element, its patch, and a certified contact on it. */
#include "harness.h"
#include "hex8.h"
#include "qp_fixture.h"

/* A displacement that is linear in the coordinates: u = G x. */
static void linear_field(double u[24], double G[3][3], double h)
{
    for (int a = 0; a < 8; a++)
        for (int i = 0; i < 3; i++) {
            u[3 * a + i] = 0;
            for (int j = 0; j < 3; j++)
                u[3 * a + i] += G[i][j] * 0.5 * h * hex8_corner(a, j);
        }
}

static double element_energy(double ke[24][24], const double u[24])
{
    double sum = 0;
    for (int i = 0; i < 24; i++)
        for (int j = 0; j < 24; j++)
            sum += 0.5 * u[i] * ke[i][j] * u[j];
    return sum;
}

TEST(element_holds_constant_strains)
{
    double ke[24][24], u[24], h = 0.25, volume = h * h * h;
    qp_random rng = {3};
    hex8_element(ke, h);
    for (int i = 0; i < 24; i++)
        for (int j = 0; j < i; j++)
            CHECK(fabs(ke[i][j] - ke[j][i]) < 1e-16);
    for (int k = 0; k < 20; k++) {
        double G[3][3], strain[6], exact = 0;
        for (int i = 0; i < 9; i++)
            G[i / 3][i % 3] = random_signed(&rng);
        for (int i = 0; i < 3; i++) {
            strain[i] = G[i][i];
            strain[3 + i] = G[(i + 1) % 3][(i + 2) % 3] + G[(i + 2) % 3][(i + 1) % 3];
        }
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                exact += 0.5 * volume * strain[i] * hex8_elasticity(i, j) * strain[j];
        linear_field(u, G, h);
        CHECK_REL(element_energy(ke, u), exact, 1e-13);
        for (int i = 0; i < 3; i++) /* a rotation: no energy, no force */
            for (int j = 0; j < 3; j++)
                G[i][j] = i == j ? 0 : (i < j ? 1 : -1) * (1 + i + j);
        linear_field(u, G, h);
        CHECK(fabs(element_energy(ke, u)) < 1e-15);
    }
}

/* Forces of a linear field balance at every node inside. */
TEST(patch_of_bricks)
{
    enum { N = 4 };
    uz_csc K;
    uz_error err = {0};
    CHECK(hex8_stiffness(&K, N, &err) == UZ_OK);
    double *u = vector(K.cols), *f = vector(K.cols);
    for (int64_t z = 0; z <= N; z++)
        for (int64_t y = 0; y <= N; y++)
            for (int64_t x = 1; x < N; x++)
                for (int64_t i = 0; i < 3; i++)
                    u[hex8_dof(N, x, y, z) + i] = (double)(i + 1) * (double)x - 0.5 * (double)y + (double)(i * z);
    uz_csc_symv(f, &K, 1, u);
    for (int64_t z = 1; z < N; z++)
        for (int64_t y = 1; y < N; y++)
            for (int64_t i = 0; i < 3; i++) /* x = 2: the only plane that meets no held node */
                CHECK(fabs(f[hex8_dof(N, 2, y, z) + i]) < 1e-13);
    uz_csc_clear(&K);
    free(u);
    free(f);
}

/* In three dimensions nested dissection spares most of minimum degree's flops, and is chosen by that; in two it is not
 * even tried. */
TEST(dissection_is_chosen_in_three_dimensions)
{
    uz_qp qp;
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_settings settings = uz_settings_default();
    uz_result *result;
    uz_error err = {0};
    uz_process_init(1);
    uz_thread_init();
    settings.op = UZ_OPERATOR_CONDENSED; /* on a busy machine conjugate gradients may look as cheap */
    CHECK(hex8_qp(&qp, 14, &err) == UZ_OK);
    problem.qp = qp;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK(result->summary.active > 0 && result->summary.active < result->summary.m);
    CHECK_INT(result->summary.ordering, UZ_ORDERING_METIS);
    CHECK(result->summary.contact_last);
    double chosen = result->summary.factor_flops, energy = result->summary.certificate.energy_dual;
    uz_result_free(result);
    settings.ordering = UZ_ORDERING_CAMD;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_OK);
    CHECK(chosen > 0 && chosen < 0.75 * result->summary.factor_flops);
    CHECK_REL(result->summary.certificate.energy_dual, energy, 1e-10);
    uz_result_free(result);
    uz_qp_clear(&qp);
}
