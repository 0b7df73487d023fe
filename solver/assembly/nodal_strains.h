/* nodal_strains.h: strains at nodes, recovered from the elements around them. */
#ifndef UZ_ASSEMBLY_NODAL_STRAINS_H
#define UZ_ASSEMBLY_NODAL_STRAINS_H

#include "assembly/strain_group.h"

/* How far the strain that an element's samples tell is continued to its nodes (nodal_strains.c says why). */
typedef enum {
    UZ_CONTINUE_WHOLE, /* the polynomial through them: for fields */
    UZ_CONTINUE_LINEAR /* what is linear in it, and of linear elements the strain in the middle: for the estimate */
} uz_continuation;

/* One place for each node and material that meet there, as strains may jump from one material to the next. */
typedef struct {
    int64_t count;
    int64_t *of; /* place of each node of each element, as mesh->node; NULL: the place is the node, and there is ... */
    int64_t *node;     /* ... one material; else count: whose node, ... */
    int32_t *material; /* ... and which material */
    int size, strains; /* of a row; the first so many of it are strains, then: */
    double *rows;      /* count x size: means; volume; free strain where size > strains + 1. 0 where no element is */
} uz_nodal_strains;

/* Means over the elements around, by their volumes. UZ_ERR_CANCELLED, _MEMORY; the caller clears *out in every case. */
uz_status uz_nodal_strains_recover(uz_nodal_strains *out, const uz_strain_source *from, uz_continuation how,
                                   const uz_hooks *hooks, uz_error *err);
void uz_nodal_strains_clear(uz_nodal_strains *strains);

/* place[lane]: the places of the nodes of the group's elements. */
void uz_nodal_places(const int64_t *place[UZ_STRAIN_LANES], const uz_nodal_strains *strains,
                     const uz_strain_group *group, const uz_mesh *mesh);

/* Of estimates of the mesh's error (error_estimate.c): the rule by which strains are compared with their means at
 * nodes, exact of the standard formulation. */
void uz_energy_rule(uz_strain_rule *rule, uz_element_kind kind, uz_model model, uz_formulation formulation);

#endif
