/* finite_body.h: energy, internal forces and tangent of a body under finite deformation. */
#ifndef UZ_FINITE_BODY_H
#define UZ_FINITE_BODY_H

#include "assembly/assembly.h"

typedef struct {
    double energy;    /* strain energy, that of springs included */
    double least_det; /* of F over the body, at quadrature points and corners */
    int64_t at;       /* the element that has it */
} uz_finite_measure;

/* Of the body and its springs displaced by nodal (n_nodes x dim).
 *   free_strain  n_elements, of the temperature, each > -1; NULL: none
 *   force    n_nodes x dim, along the axes; NULL: not wanted
 *   tangent  a copy of `model` with K and K_fixed of its own, whose patterns are kept and whose values become those of
 *            the tangent; NULL: not wanted
 *   step     n_nodes x dim, the last change of nodal, as uz_finite_element takes it; NULL: none
 * Where least_det <= 0 the others are not to be used. */
void uz_finite_body(uz_finite_measure *out, double *force, uz_body_model *tangent, const uz_body_model *model,
                    const double *free_strain, const double *nodal, const double *step);

/* Such a copy: a borrower of everything but the values of K and K_fixed, and of their patterns. */
uz_status uz_finite_tangent_of(uz_body_model *out, const uz_body_model *model, uz_error *err);
void uz_finite_tangent_clear(uz_body_model *tangent);

#endif
