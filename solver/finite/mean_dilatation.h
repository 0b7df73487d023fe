/* mean_dilatation.h: B-bar under large deformation: the dilatation of an element is the mean over its points.
 *
 * With theta the mean of J = det F over the volume at rest, the law is taken at (theta / J)^(1/n) F, whose determinant
 * is theta: the element's energy is the sum of W(C_bar), C_bar = (theta / J)^(2/n) C, and all else its derivatives. n
 * is 3, and of neo_hooke_isochoric this is the sum of its isochoric part and K/2 (theta - 1)^2 by the volume; in plane
 * strain n is 2, and the third direction keeps its stretch. Small, it is the mean dilatation of element/stiffness.c, of
 * every law. With B = C^-1, S and D the law's at C_bar, r = (theta / J)^(2/n), t = S : C, d = D C and
 * v = (2 S + r d) / n, k = (2 t + r C : d) / n^2:
 *
 *     at fixed theta   S' = r (S - t B / n),  D' = r (r D + 2 t I_B / n - v x B - B x v + k B x B)
 *     along theta      dW/dtheta = r t / (n theta),  dS'/dtheta = r (v - k B) / theta,
 *                      d2W/dtheta2 = r (k - t / n) / theta^2
 *
 * Sources: J. Nagtegaal, D. Parks and J. Rice, Comput. Methods Appl. Mech. Engrg. 4 (1974) 153-177; J. Simo, R. Taylor
 * and K. Pister, the same 51 (1985) 177-208; as a factor of F: E. de Souza Neto, D. Peric, M. Dutko and D. Owen, Int.
 * J. Solids Struct. 33 (1996) 3277-3296, there not from an energy. */
#ifndef UZ_FINITE_MEAN_DILATATION_H
#define UZ_FINITE_MEAN_DILATATION_H

#include "finite/hyperelastic_lanes.h"

typedef struct {
    double theta;
    int n;
    /* C^-1 along the n directions; the derivatives of W by theta once and twice, and of S' */
    uz_lanes B[UZ_FINITE_STRAINS], pressure, slope, cross[UZ_FINITE_STRAINS];
} uz_mean_law;

/* I_B of the components of B = C^-1. */
UZ_INLINE void uz_mean_mixed(uz_lanes I[][UZ_FINITE_STRAINS], const uz_lanes *B, int components)
{
    static const int AXIS[UZ_FINITE_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}},
                     AT[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (int i = 0; i < components; i++)
        for (int j = 0; j <= i; j++) {
            const int *p = AXIS[i], *q = AXIS[j];
            uz_lanes first = {0}, second = {0};
            if (components > UZ_FINITE_PLANE_STRAINS || (AT[p[0]][q[0]] < 4 && AT[p[1]][q[1]] < 4))
                first = B[AT[p[0]][q[0]]] * B[AT[p[1]][q[1]]];
            if (components > UZ_FINITE_PLANE_STRAINS || (AT[p[0]][q[1]] < 4 && AT[p[1]][q[0]] < 4))
                second = B[AT[p[0]][q[1]]] * B[AT[p[1]][q[0]]];
            I[i][j] = I[j][i] = 0.5 * (first + second);
        }
}

/* d2J/dE2 over J: B x B - 2 I_B. */
UZ_INLINE void uz_mean_change(uz_lanes change[][UZ_FINITE_STRAINS], const uz_lanes *B, int components)
{
    uz_mean_mixed(change, B, components);
    for (int i = 0; i < components; i++)
        for (int j = 0; j < components; j++)
            change[i][j] = B[i] * B[j] - 2 * change[i][j];
}

/* x->theta and n are given. S and D (NULL: not wanted, nor what theta changes of S and of the pressure): of the law at
 * C_bar; they become S' and D'. */
UZ_INLINE void uz_mean_law_of(uz_mean_law *x, uz_lanes *S, uz_lanes (*D)[UZ_FINITE_STRAINS], const uz_lanes *C,
                              const uz_lanes *ratio, int components)
{
    static const int AXIS[UZ_FINITE_STRAINS][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
    uz_lanes full[3][3], det, plane, size[UZ_FINITE_STRAINS], t = {0}, sum = {0};
    const uz_lanes none = {0}, r = *ratio;
    const double part = 1.0 / x->n;
    uz_law_invert(full, &det, &plane, C);
    for (int i = 0; i < components; i++) {
        const bool kept = x->n == 2 && i == 2;
        x->B[i] = kept ? none : full[AXIS[i][0]][AXIS[i][1]];
        size[i] = kept ? none : (i < 3 ? 1 : 2) * C[i];
        t += S[i] * size[i];
    }
    x->pressure = part / x->theta * r * t;
    if (D) {
        uz_lanes v[UZ_FINITE_STRAINS], mixed[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS];
        for (int i = 0; i < components; i++) {
            uz_lanes d = {0};
            for (int j = 0; j < components; j++)
                d += D[i][j] * size[j];
            sum += size[i] * d;
            v[i] = part * (2 * S[i] + r * d);
        }
        const uz_lanes k = part * part * (2 * t + r * sum);
        uz_mean_mixed(mixed, x->B, components);
        for (int i = 0; i < components; i++) {
            x->cross[i] = r * (v[i] - k * x->B[i]) / x->theta;
            for (int j = 0; j < components; j++)
                D[i][j] = r * (r * D[i][j] + 2 * part * t * mixed[i][j] - v[i] * x->B[j] - x->B[i] * v[j] +
                               k * x->B[i] * x->B[j]);
        }
        x->slope = r * (k - part * t) / (x->theta * x->theta);
    }
    for (int i = 0; i < components; i++)
        S[i] = r * (S[i] - part * t * x->B[i]);
}

#endif
