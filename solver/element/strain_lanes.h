/* strain_lanes.h: strains of several elements of one kind at once, one element in each lane of a vector register.
 *
 * The same strains and volumes at the same Gauss points as uz_element_strain and uz_gauss_state_at give for one
 * element, up to rounding. What the elements' shape alone determines is kept apart, so that equal elements share it. */
#ifndef UZ_ELEMENT_STRAIN_LANES_H
#define UZ_ELEMENT_STRAIN_LANES_H

#include "element/element.h"

enum { UZ_STRAIN_LANES = 4 };
typedef double uz_lanes __attribute__((vector_size(8 * UZ_STRAIN_LANES), aligned(8)));

/* What all elements of a kind and formulation share: shape functions and their derivatives by the reference
 * coordinates. */
typedef struct {
    uz_element_kind kind;
    uz_model model;
    uz_formulation formulation; /* as uz_resolve_formulation gave it */
    int dim, nodes, points, stresses;
    int asked;    /* points that were asked for: the first ones */
    int averaged; /* averages over the element are over the points from this one on */
    int direct;   /* of the stresses, which come first: those that are no shear */
    bool simplex; /* linear, at one point, and no ring: all of it has the same strain */
    double point[UZ_ELEMENT_GAUSS][3], weight[UZ_ELEMENT_GAUSS];
    double N[UZ_ELEMENT_GAUSS][UZ_ELEMENT_NODES], slope[UZ_ELEMENT_GAUSS][UZ_ELEMENT_NODES][3];
    double centre[UZ_ELEMENT_NODES][3]; /* slope at the origin */
} uz_strain_rule;
/* At `count` points of these weights; NULL: equal parts of the reference volume. The Gauss points follow them where the
 * formulation averages over the element, as all but the standard one do: UZ_ELEMENT_GAUSS bounds both together. count
 * 0: at the Gauss points alone. */
void uz_strain_rule_at(uz_strain_rule *rule, uz_element_kind kind, uz_model model, uz_formulation formulation,
                       const double point[][3], const double *weight, int count);

/* Of the elements' shape. */
typedef struct {
    uz_lanes inverse[UZ_ELEMENT_GAUSS][3][3]; /* of the Jacobian: [x][local axis] */
    uz_lanes det[UZ_ELEMENT_GAUSS];
    uz_lanes volume[UZ_ELEMENT_GAUSS];     /* that each Gauss point stands for */
    uz_lanes per_radius[UZ_ELEMENT_GAUSS]; /* rings: 1 / r; 0 on the axis */
    uz_lanes centre_inverse[3][3],
        centre_det; /* UZ_FORMULATION_INCOMPATIBLE: at the origin of the reference coordinates */
} uz_lane_shape;
/* x: coordinates, nodes x dim; thickness: of plane models. */
void uz_lane_shape_of(uz_lane_shape *shape, const uz_strain_rule *rule, const uz_lanes *x, double thickness);

typedef struct {
    uz_lanes lambda, mu;
} uz_lane_material;

/* strain[point][component] of the displacements u (nodes x dim); of a material only incompatible modes want to know. */
void uz_lane_strains(uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                     const uz_lane_shape *shape, const uz_lane_material *material, const uz_lanes *u);

/* Of a rule with `simplex` both at once: the shape that uz_lane_shape_of gives, and the strain. */
void uz_lane_simplex(uz_lane_shape *shape, uz_lanes strain[UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                     const uz_lanes *x, const uz_lanes *u, double thickness);

/* Those of Green and Lagrange, (H + H' + H'H) / 2 with shears 2 E_xy, for large deformation: without incompatible
 * modes; of mean dilatation those of F whose determinant is its mean (finite/mean_dilatation.h). by_volume: with ln J,
 * J the determinant of the directions that have strains, in place of their trace, so that means of them are of one J
 * where that is one. */
void uz_lane_green_strains(uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES], const uz_strain_rule *rule,
                           const uz_lane_shape *shape, const uz_lanes *u, bool by_volume);

/* H[point][c][j]: derivative of u_c by x_j of the displacements u alone, without modes and means; of rings [2][2] is
 * the strain around, in the plane [2] and [.][2] are 0. */
void uz_lane_gradients(uz_lanes H[UZ_ELEMENT_GAUSS][3][3], const uz_strain_rule *rule, const uz_lane_shape *shape,
                       const uz_lanes *u);

#endif
