/* hyperelastic_lanes.h: energies, stresses and tangents of the laws, at four points at a time.
 *
 * With B = C^-1 and I_B the tensor (B_ik B_jl + B_il B_jk) / 2, 2 dB/dC = -2 I_B and 2 dJ/dC = J B. Every law but St.
 * Venant and Kirchhoff's has
 *     S = a I + b B,     dS/dE = c (I x B + B x I) + e B x B + f I_B
 * with numbers that depend on C by its invariants alone. Inlined into each version, with the flags of its file and for
 * its kind of processor. */
#ifndef UZ_FINITE_HYPERELASTIC_LANES_H
#define UZ_FINITE_HYPERELASTIC_LANES_H

#include "core/cpu.h"
#include "element/strain_lanes.h"
#include "finite/hyperelastic.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { UZ_LAW_LANES = UZ_STRAIN_LANES };

typedef struct {
    uz_lanes W, a, b, c, e, f;
} uz_law_coefficients;

UZ_INLINE void uz_law_neo_hooke(uz_law_coefficients *k, double lambda, double mu, const uz_lanes *J,
                                const uz_lanes *trace)
{
    uz_lanes log_J = {0};
    for (int l = 0; l < UZ_LAW_LANES; l++)
        log_J[l] = log((*J)[l]);
    const uz_lanes pressed = lambda * log_J - mu;
    k->W = 0.5 * mu * (*trace - 3) - mu * log_J + 0.5 * lambda * log_J * log_J;
    k->a = (uz_lanes){0} + mu;
    k->b = pressed;
    k->c = (uz_lanes){0};
    k->e = (uz_lanes){0} + lambda;
    k->f = -2 * pressed;
}

/* x^(-1/3) of positive normal numbers, to a few roundings in a third of the time that cbrt and a division take: from
 * the exponent's third, by the constant of Moroz and others, "Fast calculation of cube and inverse cube roots using a
 * magic constant" (Energies 14 (2021) 1058), and three steps of third order on 1 - x y^3. */
UZ_INLINE void uz_law_inverse_root(uz_lanes *out, const uz_lanes *x)
{
    uz_lanes y = {0};
    for (int l = 0; l < UZ_LAW_LANES; l++) {
        uint64_t bits;
        double guess = (*x)[l];
        memcpy(&bits, &guess, sizeof bits);
        bits = 0x553ef0ff289dd796u - bits / 3;
        memcpy(&guess, &bits, sizeof guess);
        y[l] = guess;
    }
    for (int k = 0; k < 3; k++) {
        const uz_lanes left = 1 - *x * y * y * y;
        y += y * left * (1.0 / 3 + 2.0 / 9 * left);
    }
    *out = y;
}

UZ_INLINE void uz_law_neo_hooke_isochoric(uz_law_coefficients *k, double lambda, double mu, const uz_lanes *J,
                                          const uz_lanes *trace)
{
    const double K = lambda + 2.0 / 3 * mu;
    uz_lanes root;
    uz_law_inverse_root(&root, J);
    const uz_lanes a = mu * root * root, p = K * (*J - 1) * *J, b = p - a * *trace / 3;
    k->W = 0.5 * (a * *trace - 3 * mu) + 0.5 * K * (*J - 1) * (*J - 1);
    k->a = a;
    k->b = b;
    k->c = -2.0 / 3 * a;
    k->e = K * (2 * *J - 1) * *J + 2.0 / 9 * a * *trace;
    k->f = -2 * b;
}

/* B = C^-1, with det C and its minor of the plane; where det C is below DBL_MIN, 1 / det C is no number. */
UZ_INLINE void uz_law_invert(uz_lanes B[3][3], uz_lanes *det, uz_lanes *plane, const uz_lanes *C)
{
    *plane = C[0] * C[1] - C[3] * C[3];
    B[0][0] = C[1] * C[2] - C[4] * C[4];
    B[1][1] = C[0] * C[2] - C[5] * C[5];
    B[2][2] = *plane;
    B[0][1] = C[4] * C[5] - C[3] * C[2];
    B[1][2] = C[3] * C[5] - C[0] * C[4];
    B[0][2] = C[3] * C[4] - C[1] * C[5];
    *det = C[0] * B[0][0] + C[3] * B[0][1] + C[5] * B[0][2];
    const uz_lanes scale = 1 / *det;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            B[i][j] = B[j][i] = B[i][j] * scale;
}

UZ_INLINE void uz_law_kirchhoff(uz_lanes *W, uz_lanes *S, uz_lanes (*D)[UZ_FINITE_STRAINS], int n, double lambda,
                                double mu, const uz_lanes *C)
{
    const uz_lanes sum = 0.5 * (C[0] - 1) + 0.5 * (C[1] - 1) + 0.5 * (C[2] - 1);
    *W = 0.5 * lambda * sum * sum;
    for (int i = 0; i < n; i++) {
        const uz_lanes E = i < 3 ? 0.5 * (C[i] - 1) : 0.5 * C[i];
        *W += (i < 3 ? 1 : 2) * mu * E * E;
        S[i] = i < 3 ? lambda * sum + 2 * mu * E : 2 * mu * E;
        for (int j = 0; j < n && D; j++)
            D[i][j] = (uz_lanes){0} + ((i < 3 && j < 3 ? lambda : 0) + (i != j ? 0 : i < 3 ? 2 * mu : mu));
    }
}

UZ_INLINE void uz_law_of_coefficients(uz_lanes *S, uz_lanes (*D)[UZ_FINITE_STRAINS], const uz_law_coefficients *k,
                                      uz_lanes B[3][3], int n)
{
    static const int AXIS[UZ_FINITE_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    for (int i = 0; i < n; i++) {
        const int *p = AXIS[i];
        const uz_lanes own = B[p[0]][p[1]];
        S[i] = i < 3 ? k->a + k->b * own : k->b * own;
        for (int j = 0; j <= i && D; j++) {
            const int *q = AXIS[j];
            const uz_lanes other = B[q[0]][q[1]];
            const uz_lanes mixed = 0.5 * (B[p[0]][q[0]] * B[p[1]][q[1]] + B[p[0]][q[1]] * B[p[1]][q[0]]);
            uz_lanes sum = k->e * own * other + k->f * mixed;
            if (j < 3)
                sum += k->c * (i < 3 ? other + own : own);
            D[i][j] = D[j][i] = sum;
        }
    }
}

/* uz_hyperelastic of each lane, n a constant. *good: of all of the first `count` lanes; else nothing is made. D: as
 * there. */
UZ_INLINE void uz_law_in_lanes(bool *good, uz_lanes *W, uz_lanes S[UZ_FINITE_STRAINS], uz_lanes (*D)[UZ_FINITE_STRAINS],
                               int n, int count, uz_elasticity law, double lambda, double mu,
                               const uz_lanes C[UZ_FINITE_STRAINS])
{
    uz_lanes B[3][3], det, plane;
    uz_law_invert(B, &det, &plane, C);
    *good = true;
    for (int l = 0; l < count; l++)
        *good = *good && plane[l] > 0 && det[l] >= DBL_MIN;
    if (!*good)
        return;
    if (law == UZ_ELASTIC_ST_VENANT_KIRCHHOFF) {
        uz_law_kirchhoff(W, S, D, n, lambda, mu, C);
        return;
    }
    uz_law_coefficients k;
    uz_lanes J = {0};
    const uz_lanes trace = C[0] + C[1] + C[2];
    for (int l = 0; l < UZ_LAW_LANES; l++)
        J[l] = sqrt(det[l]);
    if (law == UZ_ELASTIC_NEO_HOOKE)
        uz_law_neo_hooke(&k, lambda, mu, &J, &trace);
    else
        uz_law_neo_hooke_isochoric(&k, lambda, mu, &J, &trace);
    *W = k.W;
    uz_law_of_coefficients(S, D, &k, B, n);
}

#endif
