/* discretization.h: what turns a contact of a scene, a surface and what it may touch, into rows of N and h.
 *
 * A contact has places, of which each may become a row: a condition on the displacements of some nodes of the surface
 * (slaves) and of the surface that it meets (masters; none on an obstacle),
 *
 *     g(u) = gap + n . (offset + sum_j D_j u_j - sum_k M_k u_k) >= 0,
 *
 * with one D_j = 1 for a node against a face or an obstacle; rows of a mortar method couple several. Only nodes and
 * vectors in space are spoken of here: contact_rows.c puts in which dofs are free and how they are rotated, and makes N
 * and h. How to add one: docs/architecture/contact-discretization.md. */
#ifndef UZ_DISCRETIZATION_H
#define UZ_DISCRETIZATION_H

#include "assembly/assembly.h"

typedef struct {
    const uz_body_model *model; /* mesh, kind and thickness are there, dofs and frames too */
    const uz_contact *contact;
    int64_t index;        /* its number in the scene, for pointers such as "/contacts/2/with" */
    const uz_group *on;   /* the surface that has the rows: once sites are found that of the slave */
    const uz_group *with; /* that of another body; NULL: an obstacle */
    bool later;           /* a surface that may come to touch itself where large deformation leads it */
    bool tie;             /* a tie's: nodes of rigid groups cannot be its slaves */
    double *room;         /* n_nodes, zero, and left zero */
    /* Contact at a displaced place, where `model` has the nodes and nothing may touch: the body at rest with its sites,
     * where what is chosen once is (the slave, what smooth surfaces are off their facets). NULL: `model` is it. */
    const uz_body_model *rest;
} uz_contact_input;

typedef struct {
    int64_t node;              /* where the row stands: what it is told by in fields and messages */
    double normal[3];          /* n, unit, towards the surface; the third is 0 in 2D */
    uz_face face;              /* of the other body, where masters > 0 */
    double gap;                /* before anything moves, but for n . offset, which waits for the load */
    double offset[3], from[3]; /* offset is the node's place less `from`; both 0 where the gap is known */
    int slaves, masters;
    const int64_t *slave, *master; /* live as long as the sites, or are the row's own `node`: rows are not copied */
    const double *slave_share, *master_share; /* D_j and M_k */
    const double *place; /* n_nodes x dim: the displacement at which the gap is taken, along the axes; NULL: none */
} uz_contact_row;

typedef struct {
    const char *name;
    int64_t (*places)(const uz_contact_input *in);
    /* Once per body and place: fills the sites (zeroed), from which rows follow. On failure the caller clears them. */
    uz_status (*find)(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err);
    /* The row of a place, for the contact of this load; false: there is none, as at a hanging node. */
    bool (*row)(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place);
    /* area (places): the part of the surface that the reaction of each place acts on. False: no memory. */
    bool (*areas)(double *area, const uz_contact_input *in);
} uz_contact_discretization;

/* The one that a contact asks for. */
const uz_contact_discretization *uz_discretization_of(const uz_contact *contact);

/* Frees what they have, and makes them zero. */
void uz_contact_sites_clear(uz_contact_sites *sites);

/* Its input but for `room`. UZ_ERR_SCENE: the groups are not there. */
uz_status uz_contact_input_of(uz_contact_input *in, const uz_body_model *model, const uz_scene *scene, int64_t index,
                              uz_error *err);
/* uz_contact_discretization.row of the contact's own discretization, of a model whose sites are found. A hanging node
 * has none: it goes where those go that it lies amid, and so do gap and reaction. */
bool uz_contact_row_at(uz_contact_row *row, const uz_contact_input *in, int64_t place);

extern const uz_contact_discretization uz_node_to_obstacle, uz_node_to_face, uz_surface_to_surface;

/* Of rows against another body: the row that the sites have at a place, one slave node and its masters. */
bool uz_row_of_sites(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place);

/* For rows at nodes: the sites of the nodes of a group, n gaps that are INFINITY and n normals; the normal of one, in
 * which what is zero but for rounding becomes zero; areas that a constant pressure gives nodes. */
uz_status uz_sites_of_nodes(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err);
void uz_put_normal(uz_contact_sites *sites, int64_t i, const double normal[3], int dim);
int64_t uz_places_of_nodes(const uz_contact_input *in);
bool uz_areas_of_nodes(double *area, const uz_contact_input *in);
/* What hanging nodes have of a value (n_nodes), as of an area, goes to those that they lie amid. */
void uz_leave_hanging(double *value, const uz_mesh *mesh);

#endif
