/* element_type.h: what the program knows of a type of element: one descriptor, in a file of its own, and one row of the
 * table in element_type.c. No other file asks which type an element is of. To add one:
 * docs/architecture/element-type.md.
 *
 * Local coordinates ("local points"): triangles and tetrahedra the unit simplex with node 0 at the origin and node 1,
 * 2, 3 at the unit point of axis 0, 1, 2; quadrilaterals and hexahedra [-1, 1]^dim. A local point is an array of 3;
 * what dim does not need is not read. */
#ifndef UZ_ELEMENT_ELEMENT_TYPE_H
#define UZ_ELEMENT_ELEMENT_TYPE_H

#include "element/sizes.h"
#include "uzawa.h"

typedef struct {
    int nodes, corners, node[UZ_SIDE_NODES]; /* local nodes: corners, then middles; see uz_side for the sense */
} uz_element_side;

typedef struct {
    double at[3], weight;
} uz_gauss_point;
typedef struct {
    int count;
    const uz_gauss_point *point;
} uz_gauss_rule;

typedef struct uz_element_type {
    const char *name;        /* in requests and messages: "hex20" */
    int dim, nodes, corners; /* nodes in VTK's order: corners come first */
    int sides;
    uz_element_side side[UZ_ELEMENT_SIDES];
    const int (*edge)[2];   /* nodes - corners: the corners that each middle node lies between */
    uz_element_kind linear; /* the element of the corners alone; itself where there are no middles */

    const double (*local)[3]; /* nodes: local coordinates */
    double centre[3];
    /* Shape functions at a point: N[node] their values, slope[node][axis] their derivatives; each may be NULL. */
    void (*shape)(const struct uz_element_type *type, double *N, double (*slope)[3], const double point[3]);
    uz_gauss_rule rule, ring; /* of the stiffness: the fewest points that leave no deformation without stiffness; `ring`
                               * is that of axisymmetric bodies, count 0: the same */
    uz_gauss_rule energy;     /* of the error estimate, which squares what is linear (quadratic types: quadratic) in an
                               * element; count 0: the rule of the stiffness can do that */
    enum {
        UZ_JACOBIAN_GENERAL,
        UZ_JACOBIAN_CONSTANT,
        UZ_JACOBIAN_LINEAR
    } jacobian;              /* where its sign must be checked */
    bool bbar, incompatible; /* formulations that it has beside the standard one */

    /* Where its strain is most accurate, and what each of these points gives to each node; returns how many points. */
    int (*recover)(double point[UZ_ELEMENT_SAMPLES][3], double share[UZ_ELEMENT_NODES][UZ_ELEMENT_SAMPLES],
                   uz_element_kind kind);

    /* Of linear types; quadratic ones have those of `linear`. */
    const int (*next)[3];                  /* corners: the other ends of its edges, whose tangents are right-handed */
    const char *mirrored;                  /* advice where the nodes are those of the mirror image */
    int parts;                             /* elements that a cell of a box is made of */
    const int (*part)[UZ_ELEMENT_CORNERS]; /* parts: their corners, as corners of the cell in the order of hex8 */

    int vtk, gmsh;          /* numbers of the type in VTK and Gmsh; 0: Gmsh has none */
    const int *gmsh_node;   /* nodes: the place of each in Gmsh's order; NULL: the same order */
    const char *abaqus[4];  /* by uz_model: names in Abaqus and CalculiX; NULL: none */
    const int *abaqus_node; /* nodes: likewise */
} uz_element_type;

/* The table, in the order of uz_element_kind. */
extern const uz_element_type *const uz_element_types[UZ_ELEMENT_KINDS];

static inline const uz_element_type *uz_element_type_of(uz_element_kind kind)
{
    return uz_element_types[kind];
}
#endif
