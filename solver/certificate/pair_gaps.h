/* pair_gaps.h: how far two deformed surfaces are apart. */
#ifndef UZ_CERTIFICATE_PAIR_GAPS_H
#define UZ_CERTIFICATE_PAIR_GAPS_H

#include "assembly/assembly.h"
#include "certificate/own_elements.h"

/* Lowers *least to the least gap between points of the sides of contact k, displaced by u, and the other of its two
 * surfaces, and *part to the least of these over the length of the longer one of both sides; < 0: the bodies overlap.
 * Each side is looked at in `steps` equal steps along it, a face along both of its directions. What faces no part of
 * the other surface has no gap. Errors: UZ_ERR_SCENE (no such groups), UZ_ERR_MEMORY. */
uz_status uz_pair_gaps(double *least, double *part, const uz_body_model *model, const uz_scene *scene, int64_t k,
                       const double *u, int steps, uz_error *err);
/* The same of two groups of faces in space. own: without xyz, or the two have sides of one part. */
uz_status uz_pair_gaps_space(double *least, double *part, const uz_body_model *model, const uz_group *const group[2],
                             const double *u, int steps, uz_own_elements *own, uz_error *err);

#endif
