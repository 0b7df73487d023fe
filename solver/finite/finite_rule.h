/* finite_rule.h: what all elements of a kind share: shape functions and their derivatives at points, as registers of
 * four points and of four nodes take them. */
#ifndef UZ_FINITE_FINITE_RULE_H
#define UZ_FINITE_FINITE_RULE_H

#include "element/element.h"

enum { UZ_FINITE_POINTS = 36, UZ_FINITE_LANES = 4 }; /* Gauss points and corners, by fours */

/* [.][0 .. dim - 1] are derivatives by local coordinates, [.][3] values. Points up to the next multiple of four repeat
 * the last one; nodes up to the next one have zeros. */
typedef struct {
    uz_element_kind kind;
    uz_model model;
    int dim, nodes;
    int gauss, points; /* first those of the stiffness' rule, then corners */
    double weight[UZ_FINITE_POINTS];
    double at_points[UZ_ELEMENT_NODES][4][UZ_FINITE_POINTS];
    double at_nodes[UZ_FINITE_POINTS][4][UZ_ELEMENT_NODES];
} uz_finite_rule;

void uz_finite_rule_of(uz_finite_rule *rule, uz_element_kind kind, uz_model model);
/* One local point alone, as a Gauss point of weight 1. */
void uz_finite_rule_at(uz_finite_rule *rule, uz_element_kind kind, uz_model model, const double point[3]);

#endif
