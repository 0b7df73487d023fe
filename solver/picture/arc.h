/* arc.h: how far along a contact's sides each of its rows is. */
#ifndef UZ_PICTURE_ARC_H
#define UZ_PICTURE_ARC_H

#include "assembly/assembly.h"

/* Plane models: arc (m) is the length of the undeformed sides of the contact's group from an end of theirs to the row's
 * node, with the body on the left; it goes on from one connected piece of them to the next, part (m) counts these. A
 * ring of sides begins where the group does. Nodes that no side leads to are put at the end. UZ_ERR_MEMORY. */
uz_status uz_contact_arc(double *arc, unsigned *part, const uz_body_model *model, const uz_scene *scene, uz_error *err);

#endif
