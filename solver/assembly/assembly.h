/* assembly.h: from a scene to matrices, split where the factor cache needs it.
 *
 *   body   what K and N depend on: mesh, materials, thickness, model, which dofs are supported, springs, contact groups
 *          and normals. Built once, then only read, by many threads at a time.
 *   load   what one case adds: loads, prescribed values, positions of plane obstacles: p and h.
 *
 * A dof is a node and a direction. Supported dofs are eliminated; the free ones keep the order of the nodes. In a body
 * of revolution the radial dofs on the axis are held at 0. A contact row exists for each node of a contact group of
 * which some free dof has a share in the normal; rows come contact by contact, nodes ascending. N is minus the unit
 * normal on those dofs, so that g = h - N u = gap(x) + u . n; against another part of the body u is the node's less
 * that of the point of the face that it meets, whose nodes have shares in the row too. The directions of a node's dofs
 * are the axes, but where a support holds an inclined direction, which is then a dof, and at a node whose first contact
 * row has a normal with a share in several free dofs: there one dof is along that normal, the others across, so that an
 * obstacle's row has one entry. K, N and p are in these dofs; uz_recover_nodal and uz_restrict_nodal lead to x, y, z
 * and back.
 *
 * A hanging node of a refined mesh has no dofs: u_nodal = T u, with a row of T for each displacement at a node, and for
 * those of a hanging one the shares of the nodes that it lies amid. K = T'K_nodal T, element by element; N and p
 * likewise. */
#ifndef UZ_ASSEMBLY_H
#define UZ_ASSEMBLY_H

#include "brick/cells.h"
#include "element/element.h"
#include "law/law.h"
#include "scene/mesh.h"
#include "uzawa.h"

/* A material as the elements need it. */
typedef struct {
    uz_lame lame;
    double poisson, density, expansion; /* with directions: that of uz_anisotropy, and 1 where anything expands */
    uz_elasticity law;
    uz_anisotropy general; /* what lame refers to where it has directions */
} uz_body_material;

/* A place inside a side of a group, where rows at its nodes alone would let a rigid obstacle in (node_to_obstacle.c).
 */
typedef struct {
    uz_face face;
    int nodes, corners;
    int64_t node[UZ_FACE_NODES];
    double share[UZ_FACE_NODES]; /* of each node in the place: its shape function there */
    double linear[4];            /* the same of the corners alone, as if the side had no others */
    double x[3], back;           /* it was looked for in the side set back by this: x is there, and ... */
    double curve;                /* of a hole with straight sides: how far behind them x is, too */
    double gap, normal[3];       /* ... `back` is taken off the gap; undeformed, also where there is no row */
    double size;                 /* the longest distance between nodes of the side, halved on quadratic ones */
    double part;                 /* of what rows inside the side have of its area: one over their number */
} uz_inner_place;

/* In the place of the number of a dof. */
#define UZ_NO_DOF INT64_MIN

/* A side may be of both surfaces of a contact. */
enum { UZ_SLAVE_ON = 1, UZ_SLAVE_WITH = 2, UZ_MASTER_ON = 4 };

/* Where the nodes of one contact's group stand to its obstacle, before anything moves. A plane needs none of this. */
typedef struct {
    int64_t n;      /* nodes of the group, its flanks, and places inside its sides; 0: a plane */
    double *gap;    /* n; INFINITY: the place has no row, as a node that meets no face */
    double *normal; /* n x dim: unit normals of the obstacle, towards the body */
    int64_t *first; /* another part of the body, else NULL: n + 1, into node and weight */
    int64_t *node;  /* the nodes of the face that each node meets ... */
    double *weight; /* ... and their shares in the point that it meets: each sum is 1 */
    uz_face *face;  /* n: of the group `with` */
    /* Surface to surface only: n places, which nodes they are, and the part of the surface that the reaction of each
     * acts on; NULL: the nodes of the group. */
    int64_t *at;
    double *area;
    /* A rigid obstacle: of the n places so many, after those of the nodes, are of nodes that more flanks of a groove
     * than one hold, `flank` says which; so many, the last ones, are inside sides. */
    int64_t n_flanks, *flank, n_inner;
    uz_inner_place *inner; /* n_inner */
    /* Of a rigid obstacle in space, else NULL: by node of the group, is it a middle that has its own gap for a row, as
     * the obstacle bows so much between the ends of its edge that a share of theirs would hold it afar? */
    unsigned char *bows;
    int64_t *ends; /* n x 2: of a middle of a face's edge the places of the edge's ends, as for row_ends; else -1 */
    /* The n_sides sides of both surfaces are of zones (mortar_pairs.c); rank: n_ranks pairs of a zone that is the slave
     * and one that is its master. of: n, of which surface a place's slave and most of its masters are: UZ_SLAVE_ON, ...
     */
    int64_t n_sides, *zone, n_zones, n_ranks, *rank;
    unsigned char *of;
    uz_contact_surface surface[2]; /* what `on` and `with` are taken for */
} uz_contact_sites;

/* A group that moves as a rigid body: support UZ_SUPPORT_RIGID of the scene. */
typedef struct {
    int64_t support;
    /* Nodes of it that tell its motion, -1: not needed. In the places of the first in `dof` is its translation at
     * `point`, in those of the second its rotation times `size` (plane: in the first place; rings: none). */
    int64_t anchor[3];
    double point[3], size;
} uz_rigid_group;

/* Nodes of tied surfaces: what node a has no dofs for is the sum of shares times the displacements of masters. */
typedef struct {
    uz_csc share; /* n_nodes x n_nodes: masters in the column of each slave; ptr NULL: there are none */
} uz_tied;

/* Displacements along the axes of nodes that follow others': of node a the sum of share[k] (dim x dim, by rows) times
 * the dofs of node[k], first[a] <= k < first[a + 1]; none: it has dofs of its own. */
typedef struct {
    int64_t *first; /* n_nodes + 1; NULL: nobody follows but hanging nodes (uz_mesh_amid) */
    int64_t *node;
    double *share;
} uz_followers;

typedef struct {
    int64_t d, m, n_fixed;
    uz_csc K;        /* d x d, lower triangle; of a brick only the diagonal */
    uz_brick *brick; /* what K is then; NULL: K has its entries, and K_fixed */
    uz_csc N;        /* m x d */
    uz_csc K_fixed;  /* d x n_fixed: what supported dofs do to free ones; p loses K_fixed times the prescribed values */
    int64_t *dof;    /* n_nodes x dim: number of a free dof, -1 - k for supported dof k, UZ_NO_DOF at hanging nodes, and
                      * at those of rigid groups but where their motions stand */
    int64_t n_rigid;
    uz_rigid_group *rigid;
    int32_t *rigid_of; /* n_nodes: 1 + its rigid group; NULL: there are none */
    uz_tied tied;
    uz_followers follow;
    bool turned;       /* of uz_body_turned: shares of rigid groups are those of steps from where they are */
    int64_t *frame_of; /* n_nodes: 1 + place in info.rotated_node, <= 0: along the axes. NULL: all of them are */
    uz_mesh mesh;
    uz_mesh_info info; /* as uz_scene_to_qp gives it; its xyz is the mesh's own array */
    uz_model kind;
    uz_formulation formulation; /* as the scene asks for it */
    double thickness;
    uz_body_material *materials; /* n_materials */
    int64_t n_materials;
    int32_t *material_of;    /* n_elements; NULL: all are of materials[0] */
    double *spring;          /* n_nodes x dim: stiffness of the ground along the axes; NULL: no springs */
    uz_contact_sites *sites; /* n_sites: one per contact of the scene */
    int64_t n_sites;
    double *place;       /* n_nodes x dim: the displacement at which the sites are found; NULL: before anything moves */
    bool is_place;       /* of uz_body_model_move: all but sites, rows and `place` is another model's */
    const uz_law *law;   /* of the contacts */
    int64_t n_pair_rows; /* contact rows on several nodes: against another part of the body, or inside a side */
    int64_t *row_place;  /* m: the place of each row in the sites of its contact */
    int64_t *row_ends; /* m x 2: of a row whose node is a middle of eight-node faces, the rows of the ends of its edge,
                        * else -1; NULL: there are no such rows. See contact_rows.c */
    int64_t n_modes;   /* motions that only obstacles hold; 0: the supports hold the body */
    double *modes;     /* d x n_modes: displacements of the free dofs, one motion after the other */
} uz_body_model;

/* Element e as solver/element takes it; xyz is room for its coordinates. */
void uz_body_element(uz_element *element, double xyz[3 * UZ_ELEMENT_NODES], const uz_body_model *model, int64_t e);
/* Its material. */
const uz_body_material *uz_element_material(const uz_body_model *model, int64_t e);
/* What uz_resolve_formulation says of it. */
uz_formulation uz_element_formulation(const uz_body_model *model, int64_t e);
/* A face of it; node gets its nodes. */
void uz_body_side(uz_side *side, double xyz[3 * UZ_FACE_NODES], int64_t node[UZ_FACE_NODES], const uz_body_model *model,
                  uz_face face);

typedef enum {
    UZ_BODY_SUPPORTED, /* by supports and springs alone */
    UZ_BODY_CELLS,     /* likewise; K is not assembled where it can be told by `brick` */
    UZ_BODY_COUNTED,   /* likewise, and a brick's K is not there at all: for who counts what a solve takes */
    /* by obstacles, too: K is then singular and has `modes` for null space. Refuses with UZ_ERR_FREE_BODY only what no
     * obstacle stands in the way of; whether the load presses the body on is the load's matter */
    UZ_BODY_HELD,
    UZ_BODY_OUTLINE /* the same but for the matrices: mesh, dofs and contact rows, for what follows from an answer */
} uz_body_extent;

/* Mesh, supports, stiffness, contact normals. Checks what it reads; loads and values are checked by _load.
 * Errors: UZ_ERR_SCENE, _FREE_BODY, _NOT_FINITE, _MEMORY. */
uz_status uz_body_model_build(uz_body_model *out, const uz_scene *scene, uz_body_extent extent, uz_error *err);
void uz_body_model_clear(uz_body_model *model);
/* For a body whose K is singular: UZ_ERR_FREE_BODY where a piece of it shares so few nodes with the rest, one or those
 * of a line, that it can move, with the nodes, the piece's groups and its motions. Others: UZ_OK, UZ_ERR_MEMORY. */
uz_status uz_check_hinges(const uz_body_model *model, uz_error *err);
/* K and K_fixed of a brick after all. */
uz_status uz_body_model_assemble(uz_body_model *model, uz_error *err);
/* The same body with its contacts found where it has been displaced by scene->place: gaps, normals and what faces what
 * are those there, and rows and gaps are linear about it, so that they are exact for a body that stays there. K, dofs
 * and frames are those of `model`, which has to outlive *out and must be at no place itself. Matrices of an outline
 * are not there. Errors: UZ_ERR_SCENE (the contact can't be found there), _MEMORY. */
uz_status uz_body_model_move(uz_body_model *out, const uz_body_model *model, const uz_scene *scene, uz_error *err);

/* p (d), h (m) and the prescribed values of the supported dofs (n_fixed; NULL: not wanted) of a scene whose body is
 * `model` (same uz_scene_body_key). On failure the outputs are undefined. */
uz_status uz_body_model_load(double *p, double *h, double *prescribed, const uz_body_model *model,
                             const uz_scene *scene, uz_error *err);

/* h (m) alone, without what _load checks of the loads. */
uz_status uz_body_model_gaps(double *h, const uz_body_model *model, const uz_scene *scene, uz_error *err);

/* Does the load p (d) press a body that obstacles may hold on its obstacles, in every mode that nothing else holds?
 * UZ_ERR_FREE_BODY at "/loads" names the motion by which the body leaves them, or could at no cost. */
uz_status uz_check_pressed(const uz_body_model *model, const double *p, uz_error *err);

/* Bytes that determine the body and nothing else: scenes with equal keys have the same model. Freed by the caller. */
uz_status uz_scene_body_key(unsigned char **out, size_t *len, const uz_scene *scene, uz_error *err);

/* f (m): what each row's node gets of the reactions r (m): r itself but around eight-node faces. */
void uz_row_forces(double *f, const uz_body_model *model, const double *r);

/* f (n_nodes x dim) += the derivative of the sum of force (m, uz_row_forces) times the gap of each row's node, by the
 * displacements of all nodes whose shares it has. */
void uz_push_nodes(double *f, const uz_body_model *model, const double *force);

/* gap (m) of each row's node becomes that of the row: itself but around eight-node faces. */
void uz_blend_rows(double *gap, const uz_body_model *model);

/* nodal (n_nodes x dim) from the free dofs u (d) and the prescribed values (n_fixed; NULL: all zero). */
void uz_recover_nodal(double *nodal, const uz_body_model *model, const double *u, const double *prescribed);

/* The reverse: the free dofs u (d) of a displacement by node; what it says of supported dofs and hanging nodes is left
 * out. */
void uz_restrict_nodal(double *u, const uz_body_model *model, const double *nodal);
/* p (d): what forces by node are on the free dofs, T'f; those of hanging nodes are on the nodes that these lie amid. */
void uz_gather_nodal(double *p, const uz_body_model *model, const double *f);

/* The component of a vector at a node (dim) along its dof c; "x", "y", "z" or "its normal". */
double uz_along_dof(const uz_body_model *model, int64_t node, int c, const double *v);
/* Is the node of a rigid group? Which; NULL: of none. */
bool uz_is_rigid(const uz_body_model *model, int64_t node);
const uz_rigid_group *uz_rigid_group_of(const uz_body_model *model, int64_t node);
/* Does the node follow the masters of a tie? */
bool uz_is_tied(const uz_body_model *model, int64_t node);
/* What such a node has of a value (n_nodes x stride). */
double uz_tied_value(const uz_body_model *model, int64_t a, const double *value, int64_t stride);
/* The same of a displacement by node, along dof c of node a. */
double uz_tied_along(const uz_body_model *model, int64_t a, int c, const double *nodal);
/* v (dim), along the axes: what of it is along directions in which the node follows its masters. */
void uz_tied_part(double v[3], const uz_body_model *model, int64_t a);
/* The nodes whose dofs carry node a, and their shares (uz_followers); 0: it has its own, or hangs in a body without
 * rigid groups and ties. */
int64_t uz_carriers(const int64_t **node, const double **share, const uz_body_model *model, int64_t a);
/* The motion of a group whose nodes have these displacements (n_nodes x dim): t at its point, w in radians; linear,
 * from the displacements `from` on, NULL: from rest. */
void uz_rigid_motion(double t[3], double w[3], const uz_body_model *model, const uz_rigid_group *group,
                     const double *from, const double *nodal);

/* ---- rigid groups under large rotations (rigid_place.c); model: at rest, u: n_nodes x dim */

/* R (by rows) of a rotation vector, and back, to the vector of at most half a turn. */
void uz_rotation(double R[9], const double w[3]);
void uz_rotation_vector(double w[3], const double R[9]);
/* Of a group that u has moved as a rigid body: u(x) = t + (R - I) (x - point). */
void uz_rigid_place(double t[3], double R[9], const uz_body_model *model, const uz_rigid_group *group, const double *u);
/* A borrower of all of `model` but the shares of followers, which are those of a step from u: dofs of a group are dt
 * and size times w of it. UZ_ERR_MEMORY. */
uz_status uz_body_turned(uz_body_model *out, const uz_body_model *model, const double *u, uz_error *err);
void uz_body_turned_clear(uz_body_model *turned);
/* given (n_fixed): in the places of groups' motions the step from u to what is prescribed; others stay. Groups in space
 * have all rotations held, or none, or two that are prescribed as none. */
void uz_rigid_ways(double *given, const uz_body_model *model, const double *prescribed, const double *u);
/* u, at a linear step from `from`, becomes one that moves groups as rigid bodies, and what follows them with these: by
 * exp(w), polar: where w is not prescribed by the rotation of the polar decomposition of I + w. */
void uz_rigid_step(double *u, const uz_body_model *model, const double *from, bool polar);
/* Of the displacement u of node a what it has from rigid groups, whose dofs tell a step alone. */
void uz_rigid_part(double at[3], const uz_body_model *model, int64_t a, const double *u);
/* K and K_fixed of `to` get what the forces f (n_nodes x dim) make of rotations from u. Those of nodes that follow
 * others go to these. */
void uz_rigid_turn_stiffness(uz_body_model *to, const uz_body_model *model, const double *u, double *f);
/* Are these the nodes of one rigid group, so that no element of them is strained? */
bool uz_is_unstrained(const uz_body_model *model, const int64_t *node, int count);
/* Adds a block (dim x dim) of the dofs of two nodes to K and K_fixed, whose patterns have it. */
void uz_add_dof_block(uz_body_model *model, int64_t at, int64_t other, const double block[9]);
/* Does the node stand on the axis of revolution? */
bool uz_is_on_axis(const uz_body_model *model, int64_t node);
const char *uz_dof_name(const uz_body_model *model, int64_t node, int c);

/* The place of a row that stands inside a side; NULL: it is at a node. Such a row is told by the node nearest to it in
 * shares (info.contact_node), and its reaction is a force on all nodes of the side by their shares. */
const uz_inner_place *uz_row_inner(const uz_body_model *model, int64_t row);

/* Bytes of all that the model holds. */
size_t uz_body_model_bytes(const uz_body_model *model);

/* The forces of the scene's loads on the nodes, along the axes: f, n_nodes x dim, temperature's B' C strain included.
 * Of large deformation without that, and without what follows the body: pressures and forces at points. */
uz_status uz_nodal_loads(double *f, const uz_body_model *model, const uz_scene *scene, uz_error *err);
/* 1/2 u'K u over all dofs, springs included. carried: rigid motion may be most of u; elements are then rotated back one
 * by one, so that its rounding is none of the energy. */
uz_status uz_strain_energy(double *energy, const uz_body_model *model, const double *nodal, bool carried,
                           uz_error *err);

/* Do supports move the body: is a prescribed value (n_fixed; NULL: none) not zero? Then ||u||_K over the free dofs
 * alone is not the norm of the deformation. */
bool uz_is_moved(const uz_body_model *model, const double *prescribed);
/* Do loads of the scene act on free dofs, so that a body which is carried is deformed as well? Also where there is no
 * memory to tell. */
bool uz_is_loaded(const uz_body_model *model, const uz_scene *scene);
/* Do supports hold nodes farther apart, or closer, than rounding of what they move them by may? Then a body that is
 * carried is strained as well. nodal: n_nodes x dim; large: the distances that nodes have then count, not those of
 * infinitesimal rotation. */
bool uz_is_stretched(const uz_body_model *model, const double *nodal, bool large);
/* May rows h - N u press on a body that is carried to u (d)? One closes, or nears it more than what rounding of so long
 * a way hides. Also where there is no memory to tell. */
bool uz_may_press(const uz_csc *N, const double *h, const double *u);
/* Do rows that may press, or touch, hold the parts of the body together, of which none is much larger than another?
 * Else what strains one of them may be rounding beside the way of another. Without memory they do not. */
bool uz_is_together(const uz_body_model *model, const uz_csc *N, const double *h, const double *u);
/* ||u||_K over all dofs, springs included, from the free dofs u (d) and the prescribed values. */
uz_status uz_whole_norm(double *norm, const uz_body_model *model, const double *u, const double *prescribed,
                        uz_error *err);

/* What turning displacements (nodal, n_nodes x dim) at a node from its dofs to the axes may round in each component,
 * and of a hanging node what its shares may: 0 where they are the same. */
double uz_turning_error(const uz_body_model *model, int64_t node, const double *nodal);
/* A bound on delta' K delta, over all dofs, for the errors delta that turning leaves in nodal (n_nodes x dim): the sum
 * of |delta|'|ke||delta| over the elements with rotated or hanging nodes, springs included. */
uz_status uz_turning_energy(double *energy, const uz_body_model *model, const double *nodal, uz_error *err);

/* Copies what a result shows of the mesh: not the frames, as a result speaks of x and y only. */
uz_status uz_mesh_info_copy(uz_mesh_info *out, const uz_mesh_info *info, int64_t m, uz_error *err);

/* What the estimate of the mesh's error sees of an answer on its way. */
typedef struct {
    double share; /* norm of the strain that has stress over ||u_h||_E, 1 without temperature */
    /* NaN where it did not look, or: */
    double twice;  /* u'K u without springs, as of uz_strain_energy; of linear simplices alone, NaN where there are
                      others */
    double steep2; /* the square of the largest slope of u from an element's first node to another one of its own */
} uz_mesh_look;

/* Estimated ||u - u_h||_E / ||u||_E of the mesh, for nodal displacements n_nodes x dim; NaN when there is no memory,
 * INFINITY where energies are beyond the range of double. Zienkiewicz and Zhu, "A simple error estimator and adaptive
 * procedure for practical engineering analysis", Int. J. Numer. Meth. Engng 24 (1987) 337-357: the stress is compared
 * with its own nodal averages. The strain of the temperatures among the scene's loads (scene NULL: none) has no stress,
 * and the error is relative to the norm of the strain that has: free expansion would hide it. Both norms have what
 * springs store, and the error what they do at nodes other than along sides. *look may be NULL. A body that is carried
 * along or expands freely has no error. eta2 (n_elements, NULL: not wanted): what each element has of the square of the
 * error, not relative; all 0 where the error is. With a scene, thin stacks of elements with incompatible modes from one
 * known load to another one are off by no less than the mean stress between both differs by from them
 * (thin_elements.h). */
double uz_estimate_mesh_error(double *eta2, uz_mesh_look *look, const uz_body_model *model, const uz_scene *scene,
                              const double *nodal);

/* What springs at nodes, as the mesh has them, do on u along z (n_nodes x dim each), less what those do that are spread
 * evenly over the sides of their groups. part (n_elements, NULL: not wanted): each element's is added. */
double uz_spring_excess(double *part, const uz_body_model *model, const uz_scene *scene, const double *u,
                        const double *z);
/* The square of the error, in the energy norm, that springs at nodes make at least: with a_h for a with those, the
 * error e has a(e, v) = (a_h - a)(u, v), so that |e| >= (a_h - a)(u, v) / |v| for all v that may be moved along; v is
 * the displacement u (n_nodes x dim) less the translation that the springs have in the mean, where that is free. A
 * rigid body that rocks is off by just as much. strain: twice the energy that u has in the elements; *stored: in the
 * springs. scene NULL: only that. eta2 (n_elements, NULL: not wanted): what each element has is added. NaN: no memory.
 */
double uz_spring_error(double *eta2, double *stored, const uz_body_model *model, const uz_scene *scene, const double *u,
                       double strain);

/* *energy: the same estimate of ||u - u_h||_E^2, not relative to anything, less what quadratic triangles and tetrahedra
 * are taken to hide. eta2 (n_elements, NULL: not wanted): what each element has of it. free_strain: as of
 * uz_free_strains, or NULL. It is the square of a seminorm of (nodal, free_strain), of each element, too, so that two
 * fields have an inner product by polarization. UZ_ERR_MEMORY. */
uz_status uz_mesh_error_energy(double *energy, double *eta2, const uz_body_model *model, const double *free_strain,
                               const double *nodal, uz_error *err);

/* *out: n_elements, expansion times rise of temperature by the scene's loads; NULL where there are no such loads. The
 * caller frees it. */
uz_status uz_free_strains(double **out, const uz_body_model *model, const uz_scene *scene, uz_error *err);

#endif
