/* mortar.h: what the surface to surface discretization is made of, for mortar.c and the geometry of surfaces.
 *
 * Two surfaces are integrated over together: at each point of a quadrature of the slave's there are the shape functions
 * of a slave side and of the master side across, a weight (area) and the gap between the two. mortar_plane.c finds such
 * points for edges, mortar_space.c for faces; mortar.c makes rows of them, whatever they come from. */
#ifndef UZ_ASSEMBLY_MORTAR_H
#define UZ_ASSEMBLY_MORTAR_H

#include "assembly/discretization.h"
#include "obstacle/box_tree.h"
#include "obstacle/smooth_shape.h"
#include "scene/mesh_parts.h"

/* An edge or a face of a surface. A place is a node of the slave with a normal of its own: where the surface turns by
 * more than the feature angle, a node has one for each side. */
typedef struct {
    uz_face face;
    int nodes;
    int64_t node[UZ_FACE_NODES], place[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    double area;           /* true area, with thickness or 2 pi r */
    double tangent[2][2];  /* of an edge, at its ends: unit, of the smooth curve that the edges stand for */
    bool joined[2];        /* does that curve go on into a neighbour? */
    uz_smooth_shape shape; /* of a face: what its nodes and those of the faces that it goes on into lie on */
    bool fitted;           /* of a face: its places have patches */
} uz_mortar_side;

typedef struct uz_mortar_surface {
    int64_t n, n_places;
    uz_mortar_side *side;
    uz_box_tree tree;                     /* of the sides */
    int64_t *node;                        /* n_places, ascending */
    double *normal;                       /* n_places x dim: out of the body */
    uz_smooth_patch *patch;               /* n_places, of faces that lie on no known shape; NULL: there are none */
    const struct uz_mortar_surface *rest; /* the same sides before anything moves; NULL: they have not moved */
} uz_mortar_surface;
/* A side of it before anything moves. */
const uz_mortar_side *uz_mortar_rest(const uz_mortar_surface *surface, const uz_mortar_side *side);

typedef struct {
    int64_t master; /* side */
    double weight, gap;
    double N[UZ_FACE_NODES], M[UZ_FACE_NODES];
    double local[2]; /* of a face: where it is on the master side */
} uz_mortar_point;

typedef struct {
    int64_t n, room;
    uz_mortar_point *point;
} uz_mortar_points;
/* False: no memory. */
bool uz_mortar_add_point(uz_mortar_points *points, const uz_mortar_point *p);

/* The side as solver/element takes it, in a body of this kind. */
uz_side uz_mortar_side_of(const uz_mortar_side *side, const uz_body_model *model);

/* Which surface a side is of: bits. */
enum { UZ_OF_ON = 1, UZ_OF_WITH = 2 };

/* Both surfaces of a contact as one, and room for what is looked for on one side after the other. */
typedef struct {
    const uz_contact_input *in;
    uz_group group;                  /* its sides */
    unsigned char *of;               /* of each side: UZ_OF_... */
    uz_mortar_surface surface, rest; /* where it is, and before anything moved; surface.rest is &rest, or NULL */
    uz_own_body *own;                /* NULL: no part of the body may touch itself */
    uz_mortar_points points;         /* of the side that was looked at last */
    int64_t n_near, *near;           /* the sides that it may touch, ascending */
    bool rough;                      /* fewer points in each piece: to see what faces what */
    bool layered;                    /* several of them may be above each other: only the nearest counts */
    double *ball;                    /* of each side: the middle of its nodes, and how far they are from it at most */
    int64_t *way;                    /* of each side: uz_way + 3 * (1 + i), to it from side i; 0: nobody asked */
} uz_mortar_pair;

/* The caller clears *pair in every case; `in` is kept. Errors: UZ_ERR_SCENE (a side without area), UZ_ERR_MEMORY. */
uz_status uz_mortar_pair_make(uz_mortar_pair *pair, const uz_contact_input *in, uz_error *err);
void uz_mortar_pair_clear(uz_mortar_pair *pair);

/* pair->points: those of side i against whatever it faces. False: no memory. */
bool uz_mortar_find_points(uz_mortar_pair *pair, int64_t i);
/* Those of them alone that side i is the slave of. */
bool uz_mortar_find_slave_points(uz_mortar_pair *pair, const uz_contact_sites *sites, int64_t i);
/* share (nodes of the side x points->n): what each of pair->points has in the integrals of the dual functions of slave
 * side i; D: integrals of its shape functions. False: too little of it is covered. */
bool uz_mortar_shares(double *share, double D[UZ_FACE_NODES], const uz_mortar_pair *pair, int64_t i);
/* What leads from x on side i to y behind it, on side j. */
uz_way uz_mortar_way(uz_mortar_pair *pair, int64_t i, int64_t j, const double *x, const double *y);

/* sites->zone, ->rank: what uz_mortar_is_slave answers from; what was chosen before anything moved stays. Errors:
 * UZ_ERR_MEMORY. */
uz_status uz_mortar_choose_slaves(uz_contact_sites *sites, uz_mortar_pair *pair, uz_error *err);
/* Of two sides that face each other, is i the slave? */
bool uz_mortar_is_slave(const uz_contact_sites *sites, int64_t i, int64_t j);

/* The geometry of surfaces of one dimension. False: no memory.
 *   places  tangents, places, node and normal of a surface whose sides are there
 *   points  adds to pair->points those of side i against the sides pair->near
 *   offset  from the point of a side at `local`, which is x before anything moves, to the smooth surface that the side
 *           stands for; zero where it stands for none */
typedef struct {
    bool (*places)(uz_mortar_surface *surface, const uz_contact_input *in);
    bool (*points)(uz_mortar_pair *pair, int64_t i);
    void (*offset)(double offset[3], const uz_mortar_surface *surface, const uz_mortar_side *side, const double *local,
                   const double x[3]);
} uz_mortar_geometry;
extern const uz_mortar_geometry uz_mortar_plane, uz_mortar_space;
const uz_mortar_geometry *uz_mortar_geometry_of(int dim);

/* The sides of a group, in its order, with places and without a tree; the caller clears *out in every case. Errors:
 * UZ_ERR_SCENE (a side without area), UZ_ERR_MEMORY. */
uz_status uz_mortar_surface_make(uz_mortar_surface *out, const uz_contact_input *in, const uz_group *group,
                                 uz_error *err);
void uz_mortar_surface_clear(uz_mortar_surface *surface);

/* part (n_places): the same number for all places that sides join, one of theirs. */
void uz_mortar_find_parts(int64_t *part, const uz_mortar_surface *surface);

/* What a surface is taken for, but for `contact` and `slave`. False: no memory. */
bool uz_mortar_describe(uz_contact_surface *out, const uz_mortar_surface *surface, const uz_contact_input *in,
                        const uz_group *group);

/* Cosine of the feature angle: sides that turn by more make a corner. */
double uz_mortar_least_cosine(const uz_contact_input *in);

#define UZ_OF_SURFACES "contact between two surfaces" /* what there may be no memory for */

#endif
