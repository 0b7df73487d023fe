/* piola.c: with G = F^-T and t = G : dF, so that dJ = J t, dI1 = 2 F : dF and dG = -G dF' G:
 *
 *     St. Venant, Kirchhoff   P = F S, S = lambda tr E I + 2 mu E       dP = dF S + F dS
 *     neo-Hooke               P = mu F + (lambda ln J - mu) G           dP = mu dF + lambda t G + (lambda ln J - mu) dG
 *     isochoric               P = a F + b G, a = mu J^-2/3, b = K (J - 1) J - a I1 / 3, so that da = -2 a t / 3, and
 *                             dP = a dF + b dG - 2/3 a (t F + (F : dF) G) + (K (2 J - 1) J + 2/9 a I1) t G
 */
#include "certificate/piola.h"

#include <math.h>

typedef long double real;

/* Entries of F that may be other than 0. */
static const int PLANE[] = {0, 1, 3, 4, 8}, ALL[] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
/* Where they stand. */
static const int ROW[] = {0, 0, 0, 1, 1, 1, 2, 2, 2}, COLUMN[] = {0, 1, 2, 0, 1, 2, 0, 1, 2};

typedef struct {
    const int *at;
    int n;
} entries;

/* With b = F F': dP_iJ / dF_kL = d_ik S_JL + lambda F_iJ F_kL + mu (b_ik d_JL + F_iL F_kJ). */
static void kirchhoff(uz_piola *out, real lambda, real mu, const real F[9], entries of)
{
    real E[9], S[9], trace = 0;
    double f[9], s[9], b[9];
    for (int i = 0; i < 9; i++)
        f[i] = (double)F[i];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            b[3 * i + j] = f[3 * i] * f[3 * j] + f[3 * i + 1] * f[3 * j + 1] + f[3 * i + 2] * f[3 * j + 2];
            E[3 * i + j] = (F[i] * F[j] + F[3 + i] * F[3 + j] + F[6 + i] * F[6 + j] - (i == j)) / 2;
            trace += i == j ? E[3 * i + j] : 0;
        }
    out->W = lambda * trace * trace / 2;
    for (int i = 0; i < 9; i++) {
        S[i] = 2 * mu * E[i] + (i % 4 == 0 ? lambda * trace : 0);
        s[i] = (double)S[i];
        out->W += mu * E[i] * E[i];
    }
    const double first = (double)lambda, second = (double)mu;
    for (int p = 0; p < of.n; p++) {
        const int i = ROW[of.at[p]], J = COLUMN[of.at[p]];
        out->P[of.at[p]] = F[3 * i] * S[J] + F[3 * i + 1] * S[3 + J] + F[3 * i + 2] * S[6 + J];
        for (int q = 0; q <= p; q++) {
            const int k = ROW[of.at[q]], L = COLUMN[of.at[q]];
            out->A[of.at[p]][of.at[q]] = out->A[of.at[q]][of.at[p]] =
                (i == k ? s[3 * J + L] : 0) + first * f[3 * i + J] * f[3 * k + L] +
                second * ((J == L ? b[3 * i + k] : 0) + f[3 * i + L] * f[3 * k + J]);
        }
    }
}

/* The cofactors of F, whose quotient by the determinant is G, where they may be other than 0. Returns the determinant.
 */
static real cofactors(real G[9], const real F[9], entries of)
{
    for (int p = 0; p < of.n; p++) {
        static const int NEXT[] = {1, 2, 0}, LAST[] = {2, 0, 1};
        const int i = ROW[of.at[p]], j = COLUMN[of.at[p]];
        const int a = 3 * NEXT[i], b = 3 * LAST[i], c = NEXT[j], d = LAST[j];
        G[of.at[p]] = F[a + c] * F[b + d] - F[a + d] * F[b + c];
    }
    return F[0] * G[0] + F[1] * G[1] + F[2] * G[2];
}

void uz_piola_at(uz_piola *out, uz_elasticity law, real lambda, real mu, const real F[9], bool plane)
{
    const entries of = plane ? (entries){PLANE, 5} : (entries){ALL, 9};
    if (law == UZ_ELASTIC_ST_VENANT_KIRCHHOFF) {
        kirchhoff(out, lambda, mu, F, of);
        return;
    }
    real G[9] = {0}, I1 = 0;
    double f[9], g[9] = {0};
    const real J = cofactors(G, F, of), K = lambda + 2 * mu / 3;
    for (int i = 0; i < 9; i++) {
        I1 += F[i] * F[i];
        f[i] = (double)F[i];
    }
    for (int p = 0; p < of.n; p++) {
        G[of.at[p]] /= J;
        g[of.at[p]] = (double)G[of.at[p]];
    }
    const bool plain = law == UZ_ELASTIC_NEO_HOOKE;
    const real log_J = plain ? logl(J) : 0, root = plain ? 1 : cbrtl(J), a = mu / (root * root);
    const real b = plain ? lambda * log_J - mu : K * (J - 1) * J - a * I1 / 3;
    out->W = plain ? mu * (I1 - 3) / 2 - mu * log_J + lambda * log_J * log_J / 2
                   : (a * I1 - 3 * mu) / 2 + K * (J - 1) * (J - 1) / 2;
    const double own = (double)a, turned = (double)b, mixed = plain ? 0 : (double)(-2 * a / 3),
                 twice = (double)(plain ? lambda : K * (2 * J - 1) * J + 2 * a * I1 / 9);
    for (int p = 0; p < of.n; p++) {
        const int i = of.at[p];
        out->P[i] = a * F[i] + b * G[i];
        for (int q = 0; q <= p; q++) { /* (G dF' G)_ij with dF_kl = 1 is G_il G_kj */
            const int k = of.at[q];
            const double crossed = g[3 * ROW[i] + COLUMN[k]] * g[3 * ROW[k] + COLUMN[i]];
            out->A[i][k] = out->A[k][i] =
                (i == k ? own : 0) + mixed * (f[i] * g[k] + g[i] * f[k]) + twice * g[i] * g[k] - turned * crossed;
        }
    }
}
