/* stress_lanes.h: what the error estimate does with the stresses of a few elements of one kind at once. */
#ifndef UZ_ASSEMBLY_STRESS_LANES_H
#define UZ_ASSEMBLY_STRESS_LANES_H

#include "assembly/assembly.h"
#include "element/strain_lanes.h"

/* One element in each lane; those from count on repeat the first, and what they give is dropped. */
typedef struct {
    bool begun;  /* rule is made */
    bool shaped; /* shape is that of all elements of the mesh */
    int count;
    int64_t element[UZ_STRAIN_LANES];
    const int64_t *node[UZ_STRAIN_LANES]; /* of each element */
    uz_strain_rule rule;
    uz_lane_shape shape;
    uz_lane_material material;
    uz_lanes thermal; /* in each direct strain */
    uz_lanes x[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS];
    uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES];
} uz_stress_group;

/* What the elements of a group are taken from. */
typedef struct {
    const uz_body_model *model;
    const double *nodal;       /* n_nodes x dim */
    const double *free_strain; /* n_elements; NULL: no temperature */
} uz_stress_source;

/* From element[0..count) and the rule to the strains. */
void uz_stress_group_load(uz_stress_group *group, const uz_stress_source *from);

/* Rows of sums, one for each place: the components of stress, each times volume, then the volume, then what fills the
 * row up. */
int uz_stress_row_size(uz_model model);
/* place[lane][node]: the row of each node of each element. */
void uz_stress_group_add(double *rows, const uz_stress_group *group, const int64_t *const place[UZ_STRAIN_LANES]);
/* rows: divided by their volumes. Adds the integral of (s* - s)' C^-1 (s* - s) and of strain' C strain. */
void uz_stress_group_compare(double *eta2, double *energy2, const double *rows, const uz_stress_group *group,
                             const int64_t *const place[UZ_STRAIN_LANES]);

#endif
