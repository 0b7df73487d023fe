/* piola.h: the laws of finite strain as the certificate states them: first Piola-Kirchhoff stress as a function of F.
 */
#ifndef UZ_CERTIFICATE_PIOLA_H
#define UZ_CERTIFICATE_PIOLA_H

#include "uzawa.h"

/* In plane strain, F of size 2 with determinant J > 0: W, P = dW/dF, and A[iJ][kL] = dP_iJ / dF_kL, with iJ = 2 i + J.
 * Source: Ogden, "Non-linear Elastic Deformations", ch. 4 and 6. */
typedef struct {
    long double W, P[4], A[4][4];
} uz_piola;
void uz_piola_at(uz_piola *out, uz_elasticity law, long double lambda, long double mu, const long double F[4]);

#endif
