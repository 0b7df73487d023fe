/* quad4.h: the isoparametric four-node quadrilateral and its linear elastic material. */
#ifndef UZ_ASSEMBLY_QUAD4_H
#define UZ_ASSEMBLY_QUAD4_H

#include "uzawa.h"

/* Points +-1/sqrt(3) of the 2 x 2 Gauss rule, in the order of the corners; every weight is 1. */
extern const double UZ_QUAD4_GAUSS[4][2];

/* 3 x 3, row by row: stress (xx, yy, xy) = C strain (xx, yy, 2 xy). Isotropic. */
void uz_elasticity(double C[9], uz_model model, double young, double poisson);

/* Derivatives of the four shape functions by x and y at (xi, eta) in [-1, 1]^2; corner coordinates x0 y0 x1 y1 ...
 * Returns the Jacobian's determinant; grad is undefined where that is not positive. */
double uz_quad4_gradients(double grad[4][2], const double xy[8], double xi, double eta);

/* strain (xx, yy, 2 xy) of nodal displacements ux0 uy0 ux1 uy1 ... */
void uz_quad4_strain(double strain[3], const double grad[4][2], const double u[8]);

/* stress = C strain. */
void uz_stress(double stress[3], const double C[9], const double strain[3]);

/* Stiffness ke, 8 x 8, dofs in the order of u above. False where the element is inverted or degenerate (the Jacobian is
 * not positive at some corner), so that not a positive definite ke is ever returned. */
bool uz_quad4_stiffness(double ke[64], const double xy[8], const double C[9], double thickness);

#endif
