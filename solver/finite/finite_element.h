/* finite_element.h: one element under finite deformation, total Lagrangian: pure functions. */
#ifndef UZ_FINITE_ELEMENT_H
#define UZ_FINITE_ELEMENT_H

#include "element/element.h"
#include "finite/finite_rule.h"

typedef struct {
    double energy;                 /* W over the element's volume */
    double least_det;              /* of F, at quadrature points and corners */
    double force[UZ_ELEMENT_DOFS]; /* internal forces: the gradient of the energy */
} uz_finite_forces;

/* Of an element in the plane, of a ring or a solid, whose shape is good, displaced by u (nodes x dim).
 * Without incompatible modes. rule: uz_finite_rule_of its kind and model. ke (NULL: not
 * wanted): the tangent, the energy's second derivatives, full and symmetric, as uz_element_stiffness has it, which it
 * is at u = 0. forces: are they wanted? False: det F <= 0 somewhere, or
 * in plane stress no stretch across the plane is without stress; least_det alone is then filled. step  nodes x
 * dim, the last change of u: in ke alone, what the stress does to turning parts is that of the strains that this change
 * was linear for. NULL: none */
bool uz_finite_element(uz_finite_forces *out, double *ke, bool forces, const uz_finite_rule *rule,
                       const uz_element *element, uz_elasticity law, const double *u, const double *step);

/* What expands freely by a part `free_strain` of its size in all directions is, without stress, so much larger: F of
 * the law is what is left of it, F / (1 + free_strain). The element and its u become those of that larger body at rest:
 * energy, forces and tangent are then of the law's F. xyz: the places that element->xyz is, which change. */
void uz_finite_warm(uz_element *element, double *xyz, double *u, double free_strain);

/* Energy, second Piola-Kirchhoff stress and tangent at C, with the components of hyperelastic.h: in plane stress C_zz
 * becomes that without stress across the plane, and the tangent is condensed. False: no such C_zz, or det C <= 0. */
bool uz_finite_law(double *W, double S[6], double D[6][6], double C[6], const uz_element *element, uz_elasticity law);

/* At a local point: det F, and Cauchy's stress and the Green-Lagrange strain with the components xx, yy, zz, xy, yz,
 * zx, of mean dilatation those of F with the mean of det F. */
typedef struct {
    double det, stress[6], strain[6];
} uz_finite_state;
void uz_finite_state_at(uz_finite_state *out, const uz_element *element, uz_elasticity law, const double *u,
                        const double point[3]);

#endif
