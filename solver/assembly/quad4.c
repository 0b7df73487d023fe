/* quad4.c: Zienkiewicz and Taylor, "The Finite Element Method", vol. 1, chapters on isoparametric elements. */
#include "assembly/quad4.h"

#include <string.h>

#define GAUSS 0.57735026918962576451 /* 1 / sqrt(3) */

static const double CORNER[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
const double UZ_QUAD4_GAUSS[4][2] = {{-GAUSS, -GAUSS}, {GAUSS, -GAUSS}, {GAUSS, GAUSS}, {-GAUSS, GAUSS}};

void uz_elasticity(double C[9], uz_model model, double young, double poisson)
{
    /* Plane strain is plane stress with E / (1 - nu^2) and nu / (1 - nu). */
    const bool strain = model == UZ_PLANE_STRAIN;
    const double E = strain ? young / ((1 - poisson) * (1 + poisson)) : young;
    const double nu = strain ? poisson / (1 - poisson) : poisson;
    const double direct = E / ((1 - nu) * (1 + nu));
    const double full[9] = {direct, nu * direct, 0, nu * direct, direct, 0, 0, 0, E / (2 * (1 + nu))};
    memcpy(C, full, sizeof full);
}

double uz_quad4_gradients(double grad[4][2], const double xy[8], double xi, double eta)
{
    double local[4][2], J[2][2] = {{0, 0}, {0, 0}};
    for (int a = 0; a < 4; a++) {
        local[a][0] = 0.25 * CORNER[a][0] * (1 + CORNER[a][1] * eta);
        local[a][1] = 0.25 * CORNER[a][1] * (1 + CORNER[a][0] * xi);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++)
                J[i][j] += local[a][i] * xy[2 * a + j];
    }
    const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    for (int a = 0; a < 4; a++) {
        grad[a][0] = (J[1][1] * local[a][0] - J[0][1] * local[a][1]) / det;
        grad[a][1] = (J[0][0] * local[a][1] - J[1][0] * local[a][0]) / det;
    }
    return det;
}

void uz_quad4_strain(double strain[3], const double grad[4][2], const double u[8])
{
    strain[0] = strain[1] = strain[2] = 0;
    for (int a = 0; a < 4; a++) {
        strain[0] += grad[a][0] * u[2 * a];
        strain[1] += grad[a][1] * u[2 * a + 1];
        strain[2] += grad[a][1] * u[2 * a] + grad[a][0] * u[2 * a + 1];
    }
}

void uz_stress(double stress[3], const double C[9], const double strain[3])
{
    for (int i = 0; i < 3; i++)
        stress[i] = C[3 * i] * strain[0] + C[3 * i + 1] * strain[1] + C[3 * i + 2] * strain[2];
}

/* ke += weight B' C B at one point, where column 2a + c of B is the strain of a unit displacement of node a along c.
 * Only the lower triangle. */
static void add_point(double ke[64], const double grad[4][2], const double C[9], double weight)
{
    double B[8][3], CB[8][3];
    for (int a = 0; a < 4; a++) {
        const double along_x[3] = {grad[a][0], 0, grad[a][1]}, along_y[3] = {0, grad[a][1], grad[a][0]};
        memcpy(B[2 * a], along_x, sizeof along_x);
        memcpy(B[2 * a + 1], along_y, sizeof along_y);
    }
    for (int j = 0; j < 8; j++)
        uz_stress(CB[j], C, B[j]);
    for (int i = 0; i < 8; i++)
        for (int j = 0; j <= i; j++)
            ke[8 * i + j] += weight * (B[i][0] * CB[j][0] + B[i][1] * CB[j][1] + B[i][2] * CB[j][2]);
}

/* The determinant is bilinear, so its least value is at a corner. */
static bool is_convex(const double xy[8])
{
    double grad[4][2];
    for (int a = 0; a < 4; a++)
        if (!(uz_quad4_gradients(grad, xy, CORNER[a][0], CORNER[a][1]) > 0))
            return false;
    return true;
}

bool uz_quad4_stiffness(double ke[64], const double xy[8], const double C[9], double thickness)
{
    double grad[4][2];
    memset(ke, 0, 64 * sizeof *ke);
    if (!is_convex(xy))
        return false;
    for (int g = 0; g < 4; g++) {
        double det = uz_quad4_gradients(grad, xy, UZ_QUAD4_GAUSS[g][0], UZ_QUAD4_GAUSS[g][1]);
        add_point(ke, grad, C, det * thickness);
    }
    for (int i = 0; i < 8; i++)
        for (int j = i + 1; j < 8; j++)
            ke[8 * i + j] = ke[8 * j + i];
    return true;
}
