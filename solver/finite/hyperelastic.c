/* hyperelastic.c: energies, stresses and tangents of the laws.
 *
 * With B = C^-1 and I_B the tensor (B_ik B_jl + B_il B_jk) / 2, 2 dB/dC = -2 I_B and 2 dJ/dC = J B. Every law but St.
 * Venant and Kirchhoff's has
 *     S = a I + b B,     dS/dE = c (I x B + B x I) + e B x B + f I_B
 * with numbers that depend on C by its invariants alone. */
#include "finite/hyperelastic.h"

#include <math.h>

typedef struct {
    double W, a, b, c, e, f;
} coefficients;

static coefficients neo_hooke(double lambda, double mu, double J, double trace)
{
    const double log_J = log(J), pressed = lambda * log_J - mu;
    return (coefficients){.W = 0.5 * mu * (trace - 3) - mu * log_J + 0.5 * lambda * log_J * log_J,
                          .a = mu,
                          .b = pressed,
                          .e = lambda,
                          .f = -2 * pressed};
}

static coefficients neo_hooke_isochoric(double lambda, double mu, double J, double trace)
{
    const double K = lambda + 2.0 / 3 * mu, a = mu * pow(J, -2.0 / 3), p = K * (J - 1) * J, b = p - a * trace / 3;
    return (coefficients){.W = 0.5 * (a * trace - 3 * mu) + 0.5 * K * (J - 1) * (J - 1),
                          .a = a,
                          .b = b,
                          .c = -2.0 / 3 * a,
                          .e = K * (2 * J - 1) * J + 2.0 / 9 * a * trace,
                          .f = -2 * b};
}

static coefficients of_law(uz_elasticity law, double lambda, double mu, double J, double trace)
{
    return law == UZ_ELASTIC_NEO_HOOKE ? neo_hooke(lambda, mu, J, trace) : neo_hooke_isochoric(lambda, mu, J, trace);
}

bool uz_hyperelastic(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS],
                     uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS])
{
    static const double I[UZ_FINITE_STRAINS] = {1, 1, 1, 0};
    static const int AXIS[UZ_FINITE_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}};
    const double det = C[0] * C[1] - C[3] * C[3]; /* in the plane */
    if (!(det > 0 && C[2] > 0))
        return false;
    if (law == UZ_ELASTIC_ST_VENANT_KIRCHHOFF) {
        const double E[UZ_FINITE_STRAINS] = {0.5 * (C[0] - 1), 0.5 * (C[1] - 1), 0.5 * (C[2] - 1), 0.5 * C[3]};
        const double sum = E[0] + E[1] + E[2];
        *W = 0.5 * lambda * sum * sum + mu * (E[0] * E[0] + E[1] * E[1] + E[2] * E[2] + 2 * E[3] * E[3]);
        for (int i = 0; i < UZ_FINITE_STRAINS; i++) {
            S[i] = lambda * sum * I[i] + 2 * mu * E[i];
            for (int j = 0; j < UZ_FINITE_STRAINS; j++)
                D[i][j] = lambda * I[i] * I[j] + (i != j ? 0 : i == 3 ? mu : 2 * mu);
        }
        return true;
    }
    const double B[UZ_FINITE_STRAINS] = {C[1] / det, C[0] / det, 1 / C[2], -C[3] / det};
    const double full[3][3] = {{B[0], B[3], 0}, {B[3], B[1], 0}, {0, 0, B[2]}};
    const coefficients k = of_law(law, lambda, mu, sqrt(det * C[2]), C[0] + C[1] + C[2]);
    *W = k.W;
    for (int i = 0; i < UZ_FINITE_STRAINS; i++) {
        S[i] = k.a * I[i] + k.b * B[i];
        for (int j = 0; j < UZ_FINITE_STRAINS; j++) {
            const int *p = AXIS[i], *q = AXIS[j];
            const double mixed = 0.5 * (full[p[0]][q[0]] * full[p[1]][q[1]] + full[p[0]][q[1]] * full[p[1]][q[0]]);
            D[i][j] = k.c * (I[i] * B[j] + B[i] * I[j]) + k.e * B[i] * B[j] + k.f * mixed;
        }
    }
    return true;
}
