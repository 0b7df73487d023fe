/* mean_piola.c: with s = (theta / J)^(1/n), n = 3, in plane strain 2, G = F^-T, P and A of the law at s F, t = P : F,
 * d = A F and v = (P + s d) / n, k = (t + s F : d) / n^2, as ds = s (dtheta / theta - G : dF) / n and dG = -G dF' G:
 *
 *     dW/dF = s (P - t G / n)                dW/dtheta = s t / (n theta)
 *     d2W/dF2 = s (s A + (t / n) X - v x G - G x v + k G x G),  X_iJkL = G_iL G_kJ
 *     d2W/dF dtheta = s (v - k G) / theta    d2W/dtheta2 = s (k - t / n) / theta^2
 *
 * and of J the derivatives J G and J (G x G - X). */
#include "certificate/mean_piola.h"

#include <math.h>
#include <string.h>

typedef long double real;

/* Entries of F that may be other than 0, and that the dilatation is shared by. */
static int entries_of(const int **entry, bool space, bool ring)
{
    static const int PLANE[] = {0, 1, 3, 4, 8}, ALL[] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    *entry = space ? ALL : PLANE;
    return space ? 9 : ring ? 5 : 4;
}

/* X_iJkL of two entries. */
static double crossed(const double g[9], int i, int k)
{
    return g[3 * (i / 3) + k % 3] * g[3 * (k / 3) + i % 3];
}

void uz_mean_piola_at(uz_mean_piola *out, uz_elasticity law, real lambda, real mu, const real F[9], real det,
                      real theta, bool space, bool ring)
{
    const int *entry, count = entries_of(&entry, space, ring), n = space || ring ? 3 : 2;
    const real part = theta / det, s = n == 3 ? cbrtl(part) : sqrtl(part);
    double f[9] = {0}, g[9] = {0}, d[9] = {0}, v[9] = {0};
    real t = 0;
    memcpy(out->F, F, sizeof out->F);
    for (int i = 0; i < 9; i++) {
        out->along[i] = 0;
        out->cross[i] = 0;
    }
    for (int p = 0; p < count; p++) {
        const int i = entry[p], a = 3 * ((i / 3 + 1) % 3), b = 3 * ((i / 3 + 2) % 3), c = (i + 1) % 3, e = (i + 2) % 3;
        out->along[i] = F[a + c] * F[b + e] - F[a + e] * F[b + c];
        out->F[i] = s * F[i];
        f[i] = (double)F[i];
        g[i] = (double)(out->along[i] / det);
    }
    uz_piola_at(&out->at, law, lambda, mu, out->F, !space);
    for (int p = 0; p < count; p++)
        t += out->at.P[entry[p]] * F[entry[p]];
    const double size = (double)s, work = (double)t, per = 1.0 / n, mean = (double)theta;
    double sum = 0;
    for (int p = 0; p < count; p++) {
        const int i = entry[p];
        for (int q = 0; q < count; q++)
            d[i] += out->at.A[i][entry[q]] * f[entry[q]];
        v[i] = per * ((double)out->at.P[i] + size * d[i]);
        sum += f[i] * d[i];
    }
    const double k = per * per * (work + size * sum);
    for (int p = 0; p < count; p++) {
        const int i = entry[p];
        out->cross[i] = size * (v[i] - k * g[i]) / mean;
        out->at.P[i] = s * (out->at.P[i] - t / n * out->along[i] / det);
        for (int q = 0; q < count; q++) {
            const int j = entry[q];
            out->at.A[i][j] = size * (size * out->at.A[i][j] + per * work * crossed(g, i, j) - v[i] * g[j] -
                                      g[i] * v[j] + k * g[i] * g[j]);
        }
    }
    out->pressure = s * t / (n * theta);
    out->slope = size * (k - per * work) / (mean * mean);
}

void uz_mean_piola_press(uz_mean_piola *x, real pressure, real det, bool space, bool ring)
{
    const int *entry, count = entries_of(&entry, space, ring);
    const double held = (double)(pressure * det);
    double g[9] = {0};
    for (int p = 0; p < count; p++)
        g[entry[p]] = (double)(x->along[entry[p]] / det);
    for (int p = 0; p < count; p++) {
        const int i = entry[p];
        x->at.P[i] += pressure * x->along[i];
        for (int q = 0; q < count; q++)
            x->at.A[i][entry[q]] += held * (g[i] * g[entry[q]] - crossed(g, i, entry[q]));
    }
}
