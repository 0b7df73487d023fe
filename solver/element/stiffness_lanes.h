/* stiffness_lanes.h: the stiffness of several elements of one kind at once, one element in each lane of a vector
 * register: to the bit what uz_element_stiffness gives for each, whatever else is in the other lanes. */
#ifndef UZ_ELEMENT_STIFFNESS_LANES_H
#define UZ_ELEMENT_STIFFNESS_LANES_H

#include "element/strain_lanes.h"

/* What all elements of a kind share: derivatives of the shape functions, slope[point][node][local axis]. */
typedef struct {
    uz_element_kind kind;
    uz_model model;
    int dim, nodes, points;
    int corners;      /* where the sign of the Jacobian tells about the shape; ... */
    bool checks_rule; /* ... and at the points of the rule, too */
    double weight[UZ_ELEMENT_GAUSS], slope[UZ_ELEMENT_GAUSS][UZ_ELEMENT_NODES][3];
    double corner_slope[UZ_ELEMENT_NODES][UZ_ELEMENT_NODES][3];
} uz_stiffness_rule;
void uz_stiffness_rule_of(uz_stiffness_rule *rule, uz_element_kind kind, uz_model model);

/* Can an element be in a lane? Not in a body of revolution, with incompatible modes or a material with directions. */
bool uz_is_for_lanes(const uz_element *element);

/* ke[lane], n x n with n = nodes x dim, as of uz_element_stiffness; those of lanes that are one array get one of them.
 * x: coordinates, nodes x dim; thickness: of plane models. false: the shape of one may not be good, or an entry of its
 * stiffness does not stay between DBL_MIN * 1024 (on the diagonal) and DBL_MAX / 1024. */
bool uz_lane_stiffness(double *const ke[UZ_STRAIN_LANES], const uz_stiffness_rule *rule, uz_formulation formulation,
                       const uz_lanes *x, const uz_lane_material *material, double thickness);

#endif
