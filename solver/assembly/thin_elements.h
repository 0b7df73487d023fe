/* thin_elements.h: elements with nothing but known loads on both of two opposite sides. */
#ifndef UZ_ASSEMBLY_THIN_ELEMENTS_H
#define UZ_ASSEMBLY_THIN_ELEMENTS_H

#include "assembly/strain_group.h"

/* known[e * UZ_ELEMENT_SIDES + side]: the normal stress that loads ask for at a side of element e; NaN: no load alone
 * tells it, as at sides between elements, supports and contacts. NULL: no element is thin. */
typedef struct {
    double *known;
} uz_thin_elements;

/* Elements with incompatible modes only; nothing is searched where the scene's mesh can have none. The caller clears
 * *out in every case. UZ_ERR_MEMORY. */
uz_status uz_thin_elements_find(uz_thin_elements *out, const uz_body_model *model, const uz_scene *scene,
                                uz_error *err);
void uz_thin_elements_clear(uz_thin_elements *thin);

/* Of the element in a lane: the energy, integral of d' C^-1 d, of what its mean stress differs by from that of its
 * loads between opposite sides. 0 where nothing is known of them. */
double uz_thin_difference(const uz_thin_elements *thin, const uz_body_model *model, const uz_strain_group *group,
                          int lane);

#endif
