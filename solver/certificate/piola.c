/* piola.c: with G = F^-T of all of F and t = G : dF, so that dJ = J t and dG = -G dF' G:
 *
 *     St. Venant, Kirchhoff   P = F S, S = lambda tr E I + 2 mu E       dP = dF S + F dS
 *     neo-Hooke               P = mu F + (lambda ln J - mu) G           dP = mu dF + lambda t G + (lambda ln J - mu) dG
 *     isochoric               P = a F + b G, a = mu J^-2/3, b = K (J - 1) J - a I1 / 3, and by the product rule
 */
#include "certificate/piola.h"

#include <math.h>

typedef long double real;

static void multiply(real out[4], const real *A, bool transposed, const real *B)
{
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            out[2 * i + j] = transposed ? A[i] * B[j] + A[2 + i] * B[2 + j] : A[2 * i] * B[j] + A[2 * i + 1] * B[2 + j];
}

static void kirchhoff(uz_piola *out, real lambda, real mu, const real F[5])
{
    real C[4], E[4], S[4];
    multiply(C, F, true, F);
    for (int i = 0; i < 4; i++)
        E[i] = (C[i] - (i % 3 == 0)) / 2;
    const real z = F[4], Ez = (z * z - 1) / 2, trace = E[0] + E[3] + Ez, Sz = 2 * mu * Ez + lambda * trace;
    for (int i = 0; i < 4; i++)
        S[i] = 2 * mu * E[i] + (i % 3 == 0 ? lambda * trace : 0);
    out->W = lambda * trace * trace / 2 + mu * (E[0] * E[0] + E[1] * E[1] + E[2] * E[2] + E[3] * E[3] + Ez * Ez);
    multiply(out->P, F, false, S);
    out->P[4] = z * Sz;
    out->A[4][4] = Sz + z * z * (lambda + 2 * mu);
    for (int i = 0; i < 4; i++)
        out->A[i][4] = out->A[4][i] = lambda * z * F[i];
    for (int k = 0; k < 4; k++) {
        real dF[4] = {0}, half[4], dE[4], dS[4], first[4], second[4];
        dF[k] = 1;
        multiply(half, F, true, dF);
        for (int i = 0; i < 4; i++)
            dE[i] = (half[i] + half[2 * (i % 2) + i / 2]) / 2;
        for (int i = 0; i < 4; i++)
            dS[i] = 2 * mu * dE[i] + (i % 3 == 0 ? lambda * (dE[0] + dE[3]) : 0);
        multiply(first, dF, false, S);
        multiply(second, F, false, dS);
        for (int i = 0; i < 4; i++)
            out->A[i][k] = first[i] + second[i];
    }
}

void uz_piola_at(uz_piola *out, uz_elasticity law, real lambda, real mu, const real F[5])
{
    if (law == UZ_ELASTIC_ST_VENANT_KIRCHHOFF) {
        kirchhoff(out, lambda, mu, F);
        return;
    }
    const real plane = F[0] * F[3] - F[1] * F[2], J = plane * F[4];
    const real G[5] = {F[3] / plane, -F[2] / plane, -F[1] / plane, F[0] / plane, 1 / F[4]};
    const real I1 = F[0] * F[0] + F[1] * F[1] + F[2] * F[2] + F[3] * F[3] + F[4] * F[4], log_J = logl(J);
    const real K = lambda + 2 * mu / 3;
    const bool plain = law == UZ_ELASTIC_NEO_HOOKE;
    const real a = plain ? mu : mu * powl(J, (real)-2 / 3);
    const real b = plain ? lambda * log_J - mu : K * (J - 1) * J - a * I1 / 3;
    out->W = plain ? mu * (I1 - 3) / 2 - mu * log_J + lambda * log_J * log_J / 2
                   : (a * I1 - 3 * mu) / 2 + K * (J - 1) * (J - 1) / 2;
    for (int i = 0; i < 5; i++)
        out->P[i] = a * F[i] + b * G[i];
    for (int k = 0; k < 5; k++) {
        const real t = G[k], da = plain ? 0 : -2 * a * t / 3;
        const real db = plain ? lambda * t : K * (2 * J - 1) * J * t - (da * I1 + a * 2 * F[k]) / 3;
        for (int i = 0; i < 5; i++) { /* (G dF' G)_ij with dF_kl = 1 is G_il G_kj */
            const real twice = i < 4 && k < 4 ? G[2 * (i / 2) + k % 2] * G[2 * (k / 2) + i % 2]
                               : i == k       ? G[4] * G[4]
                                              : 0;
            out->A[i][k] = (i == k ? a : 0) + da * F[i] + db * G[i] - b * twice;
        }
    }
}
