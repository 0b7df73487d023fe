/* strain_group.h: the strains of a few elements of a mesh at once: those of one kind and formulation, one in each lane.
 */
#ifndef UZ_ASSEMBLY_STRAIN_GROUP_H
#define UZ_ASSEMBLY_STRAIN_GROUP_H

#include "assembly/assembly.h"
#include "element/strain_lanes.h"

/* One element in each lane; those from count on repeat the first, and what they give is dropped. */
typedef struct {
    bool begun;  /* rule is made: of one formulation, as materials may differ in it */
    bool shaped; /* shape is that of all elements of the mesh */
    bool alike;  /* and so is their material */
    int count;
    int64_t element[UZ_STRAIN_LANES];
    const int64_t *node[UZ_STRAIN_LANES]; /* of each element */
    uz_strain_rule rule;
    uz_lane_shape shape;
    uz_lane_material material;     /* NaN in lanes of a material with directions */
    uz_lanes free_strain, thermal; /* expansion times rise of temperature; what it is in each direct strain */
    const uz_lame *lame[UZ_STRAIN_LANES];
    bool general; /* one of them has directions: `thermal` and `material` are not for any */
    uz_lanes x[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS];
    uz_lanes strain[UZ_ELEMENT_GAUSS][UZ_ELEMENT_STRESSES];
} uz_strain_group;

/* What the elements of a group are taken from. */
typedef struct {
    const uz_body_model *model;
    const double *nodal;       /* n_nodes x dim */
    const double *free_strain; /* n_elements; NULL: no temperature */
    bool apart;                /* displacements against those of each element's first node: a translation strains
                                * nothing, and what it would leave by rounding grows with it. Not along the radius */
    bool unrotated;            /* and less the rotation that fits them best, for the same reason. Not of rings */
    bool large;                /* strains are those of Green and Lagrange, of elements without incompatible modes */
    bool by_volume;            /* and these have ln J for their trace, see uz_lane_green_strains */
    int64_t begin, end;        /* of uz_strain_groups: the elements from begin to end - 1; end 0: all */
} uz_strain_source;

/* From element[0..count) and the rule to the strains. */
void uz_strain_group_load(uz_strain_group *group, const uz_strain_source *from);

/* What is done with all elements of a mesh, a few at a time. */
typedef struct {
    /* Makes the rule of the elements of a kind and formulation that are taken from now on. */
    void (*rule)(void *ctx, uz_strain_rule *rule, uz_element_kind kind, uz_formulation formulation);
    void (*take)(void *ctx, const uz_strain_group *group);
    void *ctx;
} uz_strain_work;
/* Calls take with each of these elements in some group; those of one kind come together, in whatever order that gives.
 * UZ_ERR_CANCELLED, _MEMORY. */
uz_status uz_strain_groups(const uz_strain_work *work, const uz_strain_source *from, const uz_hooks *hooks,
                           uz_error *err);

#endif
