/* piola.h: the laws of finite strain as the certificate states them: first Piola-Kirchhoff stress as a function of F.
 */
#ifndef UZ_CERTIFICATE_PIOLA_H
#define UZ_CERTIFICATE_PIOLA_H

#include "uzawa.h"

/* Of F by rows, with a positive determinant: W, P = dW/dF, and A[i][k] = dP_i / dF_k. In the plane F[2], F[5], F[6] and
 * F[7] are 0, F[8] > 0 is the stretch across it (1 in plane strain, of rings that around), and P and A have no values
 * there. A goes into a matrix of doubles, and is made of them. Source: Ogden, "Non-linear Elastic Deformations", ch. 4
 * and 6. */
typedef struct {
    long double W, P[9];
    double A[9][9];
} uz_piola;
void uz_piola_at(uz_piola *out, uz_elasticity law, long double lambda, long double mu, const long double F[9],
                 bool plane);

#endif
