/* swallowed.h: an obstacle that is inside of a body. */
#ifndef UZ_CERTIFICATE_SWALLOWED_H
#define UZ_CERTIFICATE_SWALLOWED_H

#include "assembly/assembly.h"

/* *inside: a part of the rigid obstacle of contact k, a circle, sphere or cylinder around which the body is not, or a
 * corner of a line or of heights in the plane, is inside of an element of a part that the contact is of, displaced by u
 * (n_nodes x dim), deeper than rows leave it. Gaps of the sides tell nothing of an obstacle that a side has gone past:
 * what a mesh is too coarse to see is then no contact at all. UZ_ERR_MEMORY. */
uz_status uz_swallows(bool *inside, const uz_body_model *model, const uz_scene *scene, int64_t k, const double *u,
                      uz_error *err);

#endif
