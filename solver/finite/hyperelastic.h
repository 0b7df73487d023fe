/* hyperelastic.h: laws of finite strain.
 *
 * Strains and stresses have the components xx, yy, zz, xy, yz, zx; of plane bodies and rings the first four, zz across
 * the plane (the hoop of rings). C = F'F is the right Cauchy-Green tensor, in plane strain C_zz = 1. S is the second
 * Piola-Kirchhoff stress, dW/dE of E = (C - I) / 2 with the shears 2 E_xy, ... */
#ifndef UZ_FINITE_HYPERELASTIC_H
#define UZ_FINITE_HYPERELASTIC_H

#include "uzawa.h"

enum { UZ_FINITE_STRAINS = 6, UZ_FINITE_PLANE_STRAINS = 4 };

/* W per undeformed volume, S, and the tangent dS/dE (symmetric; NULL: not wanted). False: det C <= 0, nothing is made.
 *   n           components, 4 or 6: of 4 the others of C are 0, and those of S and D are not filled
 *   lambda, mu  Lame's constants of small strain
 * Source: Bonet and Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", ch. 6. */
bool uz_hyperelastic(double *W, double S[UZ_FINITE_STRAINS], double D[UZ_FINITE_STRAINS][UZ_FINITE_STRAINS], int n,
                     uz_elasticity law, double lambda, double mu, const double C[UZ_FINITE_STRAINS]);

#endif
