/* plane_element.c: stresses in equilibrium within parts of plane macro elements, those of Airy's functions. */
#include "bound/macro.h"

int uz_airy_stresses(double S[4][UZ_MACRO_FUNCTIONS + 1], const uz_macro *m, const double at[2])
{
    const double(*g)[2] = m->local;
    double x[5] = {1}, y[5] = {1};
    int b = 0;
    for (int k = 1; k < 5; k++) {
        x[k] = x[k - 1] * (g[0][0] * (at[0] - m->centre[0]) + g[0][1] * (at[1] - m->centre[1]));
        y[k] = y[k - 1] * (g[1][0] * (at[0] - m->centre[0]) + g[1][1] * (at[1] - m->centre[1]));
    }
    for (int k = 2; k <= m->degree + 2; k++)
        for (int i = 0; i <= k; i++, b++) {
            const int j = k - i;
            const double xx = i >= 2 ? i * (i - 1) * x[i - 2] * y[j] : 0,
                         yy = j >= 2 ? j * (j - 1) * x[i] * y[j - 2] : 0;
            const double xy = i >= 1 && j >= 1 ? i * j * x[i - 1] * y[j - 1] : 0, t = m->times[b];
            S[0][b] = t * (g[0][1] * g[0][1] * xx + 2 * g[0][1] * g[1][1] * xy + g[1][1] * g[1][1] * yy);
            S[1][b] = t * (g[0][0] * g[0][0] * xx + 2 * g[0][0] * g[1][0] * xy + g[1][0] * g[1][0] * yy);
            S[2][b] =
                -t * (g[0][0] * g[0][1] * xx + (g[0][0] * g[1][1] + g[0][1] * g[1][0]) * xy + g[1][0] * g[1][1] * yy);
        }
    return b;
}

static void stresses(double S[4][UZ_MACRO_FUNCTIONS + 1], const uz_macro *m, const double at[2])
{
    const int last = uz_airy_stresses(S, m, at);
    for (int c = 0; c < 2; c++)
        S[c][last] = -m->body->force[2 * m->element + c] * (at[c] - m->centre[c]);
    S[2][last] = 0;
}

/* The deviator and the trace apart. */
static void strain(double e[4], const double s[4], uz_lame lame, double free_strain, uz_model model, double radius)
{
    double expansion[3];
    const double mean = (s[0] + s[1]) / (4 * (lame.lambda + lame.mu)), half = (s[0] - s[1]) / (4 * lame.mu);
    (void)radius;
    uz_thermal_strain(expansion, model, lame, free_strain);
    e[0] = mean + half + expansion[0];
    e[1] = mean - half + expansion[1];
    e[2] = s[2] / lame.mu;
}

const uz_macro_stresses uz_plane_stresses = {{7, 12}, 3, stresses, strain};
