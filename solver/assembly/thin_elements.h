/* thin_elements.h: stacks of elements with nothing but known loads, and springs, on both of two opposite sides. */
#ifndef UZ_ASSEMBLY_THIN_ELEMENTS_H
#define UZ_ASSEMBLY_THIN_ELEMENTS_H

#include "assembly/strain_group.h"

/* *least (n_elements; NULL: nothing is known of any): what each element's stress is off by at least, as the energy
 * integral of d' C^-1 d, d what the mean stress of a thin stack differs by from that of the loads and springs at its
 * ends. Elements of incompatible modes only; nothing is searched where the scene's mesh can have no thin stack. loads:
 * the part of the scene's that is there. The caller frees it. UZ_ERR_MEMORY. */
uz_status uz_thin_elements_errors(double **least, const uz_scene *scene, const uz_strain_source *from, double loads,
                                  uz_error *err);

#endif
