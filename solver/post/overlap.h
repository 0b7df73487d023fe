/* overlap.h: what an answer leaves of overlap between the surfaces of its contacts. */
#ifndef UZ_POST_OVERLAP_H
#define UZ_POST_OVERLAP_H

#include "assembly/assembly.h"
#include "uzawa.h"

/* Fills out (one for each contact of the scene) from the displacements u (n_nodes x dim). scene: with the obstacles of
 * the case; model: its body, undeformed. Of two bodies points of either surface are projected on the other, of an
 * obstacle those of the body are looked at; surfaces that are taken to be smooth are measured as that, with offsets
 * from the undeformed geometry. O(n log n) for n sides that meet. Error: UZ_ERR_MEMORY. */
uz_status uz_measure_overlap(uz_overlap *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                             uz_error *err);

/* By how much bodies that store this much strain energy under contact forces of this sum approach each other: 2 U / F,
 * as of a spring, so that motion without strain is none of it; but not more than the contacts moved. 0: no force. */
double uz_contact_approach(double strain_energy, double force, const uz_overlap *overlap, int64_t n_contacts);

#endif
