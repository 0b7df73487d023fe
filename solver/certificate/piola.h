/* piola.h: the laws of finite strain as the certificate states them: first Piola-Kirchhoff stress as a function of F.
 */
#ifndef UZ_CERTIFICATE_PIOLA_H
#define UZ_CERTIFICATE_PIOLA_H

#include "uzawa.h"

/* Of plane strain and of rings, F in the plane by rows with a positive determinant, then the stretch across it (F[4] >
 * 0; 1 in plane strain): W, P = dW/dF, and A[i][k] = dP_i / dF_k. Source: Ogden, "Non-linear Elastic Deformations", ch.
 * 4 and 6. */
typedef struct {
    long double W, P[5], A[5][5];
} uz_piola;
void uz_piola_at(uz_piola *out, uz_elasticity law, long double lambda, long double mu, const long double F[5]);

#endif
