/* hyperelastic.c: energies, stresses and tangents of the laws.
 *
 * With B = C^-1 and I_B the tensor (B_ik B_jl + B_il B_jk) / 2, 2 dB/dC = -2 I_B and 2 dJ/dC = J B. Every law but St.
 * Venant and Kirchhoff's has
 *     S = a I + b B,     dS/dE = c (I x B + B x I) + e B x B + f I_B
 * with numbers that depend on C by its invariants alone. */
#include "finite/hyperelastic.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

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

/* x^(-1/3) of a positive normal number, to a few roundings in a third of the time that cbrt and a division take: from
 * the exponent's third, by the constant of Moroz and others, "Fast calculation of cube and inverse cube roots using a
 * magic constant" (Energies 14 (2021) 1058), and three steps of third order on 1 - x y^3. */
static double inverse_root(double x)
{
    uint64_t bits;
    double y;
    memcpy(&bits, &x, sizeof bits);
    bits = 0x553ef0ff289dd796u - bits / 3;
    memcpy(&y, &bits, sizeof y);
    for (int k = 0; k < 3; k++) {
        const double left = 1 - x * y * y * y;
        y += y * left * (1.0 / 3 + 2.0 / 9 * left);
    }
    return y;
}

static coefficients neo_hooke_isochoric(double lambda, double mu, double J, double trace)
{
    const double K = lambda + 2.0 / 3 * mu, root = inverse_root(J), a = mu * root * root, p = K * (J - 1) * J,
                 b = p - a * trace / 3;
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

/* B = C^-1; false: C is not positive definite. */
static bool inverse(double B[3][3], double *det, const double C[UZ_FINITE_STRAINS])
{
    const double plane = C[0] * C[1] - C[3] * C[3];
    B[0][0] = C[1] * C[2] - C[4] * C[4];
    B[1][1] = C[0] * C[2] - C[5] * C[5];
    B[2][2] = plane;
    B[0][1] = C[4] * C[5] - C[3] * C[2];
    B[1][2] = C[3] * C[5] - C[0] * C[4];
    B[0][2] = C[3] * C[4] - C[1] * C[5];
    *det = C[0] * B[0][0] + C[3] * B[0][1] + C[5] * B[0][2];
    if (!(plane > 0 && *det >= DBL_MIN)) /* below, 1 / det is no number */
        return false;
    const double scale = 1 / *det;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            B[i][j] = B[j][i] = B[i][j] * scale;
    return true;
}

static void kirchhoff(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS], int n,
                      double lambda, double mu, const double C[UZ_FINITE_STRAINS])
{
    const double sum = 0.5 * (C[0] - 1) + 0.5 * (C[1] - 1) + 0.5 * (C[2] - 1);
    *W = 0.5 * lambda * sum * sum;
    for (int i = 0; i < n; i++) {
        const double E = 0.5 * (C[i] - (i < 3)), direct = i < 3 ? lambda : 0;
        *W += (i < 3 ? 1 : 2) * mu * E * E;
        S[i] = direct * sum + 2 * mu * E;
        for (int j = 0; j < n && D; j++)
            D[i][j] = (j < 3 ? direct : 0) + (i != j ? 0 : i < 3 ? 2 * mu : mu);
    }
}

/* Inlined for each n, whose loops the compiler then unrolls. */
static inline __attribute__((always_inline)) void of_coefficients(double S[UZ_FINITE_STRAINS],
                                                                  double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS],
                                                                  coefficients k, double B[3][3], int n)
{
    static const int AXIS[UZ_FINITE_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    for (int i = 0; i < n; i++) {
        const int *p = AXIS[i];
        const double own = B[p[0]][p[1]];
        S[i] = k.a * (i < 3) + k.b * own;
        for (int j = 0; j <= i && D; j++) {
            const int *q = AXIS[j];
            const double other = B[q[0]][q[1]];
            const double mixed = 0.5 * (B[p[0]][q[0]] * B[p[1]][q[1]] + B[p[0]][q[1]] * B[p[1]][q[0]]);
            D[i][j] = D[j][i] = k.c * ((i < 3) * other + own * (j < 3)) + k.e * own * other + k.f * mixed;
        }
    }
}

bool uz_hyperelastic(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS], int n,
                     uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS])
{
    double B[3][3], det;
    if (!inverse(B, &det, C))
        return false;
    if (law == UZ_ELASTIC_ST_VENANT_KIRCHHOFF) {
        kirchhoff(W, S, D, n, lambda, mu, C);
        return true;
    }
    const coefficients k = of_law(law, lambda, mu, sqrt(det), C[0] + C[1] + C[2]);
    *W = k.W;
    if (!D)
        of_coefficients(S, NULL, k, B, n);
    else if (n == UZ_FINITE_PLANE_STRAINS)
        of_coefficients(S, D, k, B, UZ_FINITE_PLANE_STRAINS);
    else
        of_coefficients(S, D, k, B, UZ_FINITE_STRAINS);
    return true;
}
