/* interpenetration.h: a deformed body that passes through itself, or through another one, where no contact says that it
 * must not. */
#ifndef UZ_POST_INTERPENETRATION_H
#define UZ_POST_INTERPENETRATION_H

#include "assembly/assembly.h"
#include "uzawa.h"

typedef struct {
    double depth; /* from a point of the boundary to the side that it has passed, a length; 0: nothing is passed */
    double part;  /* the same over the length of the side that the point is on, */
    double at[3]; /* and where it is, on the deformed body */
} uz_interpenetration;

/* The deepest that any point of the boundary of the body, displaced by u (n_nodes x dim), is inside of the body, beyond
 * what it was at rest. All outer sides (outer: uz_outer_sides) are looked at, whatever the contacts name; what contacts
 * and ties leave of the surfaces that they join is none. O(n log n) for n elements. Error: UZ_ERR_MEMORY. */
uz_status uz_find_interpenetration(uz_interpenetration *out, const uz_body_model *model, const uz_scene *scene,
                                   const uz_group *outer, const double *u, uz_error *err);

#endif
