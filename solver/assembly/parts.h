/* parts.h: the steps of uz_body_model_build and uz_body_model_load, each filling its own fields of the model. */
#ifndef UZ_ASSEMBLY_PARTS_H
#define UZ_ASSEMBLY_PARTS_H

#include "assembly/assembly.h"
#include "brick/brick.h"
#include "linalg/linalg.h"

/* Unit vectors that differ less from the span of others add nothing to it. */
#define UZ_DEPENDENT 1e-9

/* Moves the nodes of a refined mesh that bisection has put on sides of contacts between surfaces, which are not
 * told to be faceted, to the smooth surfaces that the sides stood for as they were given; but where an element would
 * lose most of its size. */
uz_status uz_smooth_refined(uz_mesh *mesh, const uz_scene *scene, uz_error *err);

/* ---- rigid groups (rigid.c) */

/* mesh, dof as the other supports have it -> rigid, rigid_of, and places of dofs: -1 for prescribed motions, UZ_NO_DOF
 * for what follows them. UZ_ERR_SCENE: nodes of two groups, or too few to be turned. */
uz_status uz_number_rigid(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* value (n_fixed): those of the prescribed motions. */
void uz_rigid_values(double *value, const uz_body_model *model, const uz_scene *scene);
/* mesh, rigid -> tied. UZ_ERR_SCENE: surfaces that are not near each other, nodes that would follow and be followed. */
uz_status uz_find_tied(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* tied, dof as the supports have it, rigid_of -> UZ_NO_DOF for what follows masters. */
uz_status uz_number_tied(uz_body_model *model, uz_error *err);
/* rigid, tied, frames -> follow. u (n_nodes x dim): of a step from there; NULL: from rest. */
uz_status uz_find_followers(uz_body_model *model, const double *u, uz_error *err);
void uz_followers_clear(uz_followers *follow);
/* share (dim x dim): what a rotation times the group's size does at the end of an arm in parts of it. */
void uz_rigid_arms(double *share, const double arm[3], int dim);
/* Does one of these nodes follow others? */
bool uz_have_carriers(const uz_body_model *model, const int64_t *node, int count);
/* uz_add_stiffness for nodes of which one does. */
void uz_add_carried(uz_body_model *model, const double *ke, const int64_t *node, int count);
/* The derivative B (dim x dim, by rows) of a force on node i by displacements of node j, as one by dofs of forces on
 * dofs; that of a number by displacements of node j, as one by dofs in a row. false: no memory. */
void uz_add_carried_block(uz_entries *to, const uz_body_model *model, int64_t i, int64_t j, const double B[9]);
void uz_add_carried_row(uz_entries *to, int64_t row, const uz_body_model *model, int64_t j, const double slope[3]);
/* u along the axes of a node that follows others, from the free dofs and the prescribed values (NULL: zero). */
void uz_carried(double u[3], const uz_body_model *model, int64_t a, const double *free, const double *prescribed);
/* The free dofs u (d) of a group get a motion: t at its point, w in radians. */
void uz_set_motion(double *u, const uz_body_model *model, const uz_rigid_group *group, const double t[3],
                   const double w[3]);
/* What a component of a rigid node's displacement may have of rounding. */
double uz_carried_error(const uz_body_model *model, int64_t a, const double *nodal);

/* Scene -> kind, formulation, thickness, materials, material_of. UZ_ERR_SCENE names an element without material. */
uz_status uz_take_materials(uz_body_model *model, const uz_scene *scene, uz_error *err);

/* mesh -> dof, d, n_fixed, and the frames that inclined supports ask for. UZ_ERR_SCENE where nothing is left to move.
 */
uz_status uz_number_dofs(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* What a support gives along the axes, NaN where nothing; of a support along a normal that is an axis, too. */
void uz_support_values(double u[3], const uz_support *support, int dim);
/* Is it along a normal that is no axis? n becomes the unit normal. */
bool uz_support_is_inclined(double n[3], const uz_support *support, int dim);
/* n_fixed values; two supports that contradict each other: UZ_ERR_SCENE. */
uz_status uz_prescribed_values(double *value, const uz_body_model *model, const uz_scene *scene, uz_error *err);

/* mesh -> spring. */
uz_status uz_spread_springs(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* share (n_nodes) += what each node of the group has of a total of 1: by area of faces, by volume of elements, of nodes
 * equally those that were given (uz_mesh.n_given). */
uz_status uz_spread_over_group(double *share, const uz_body_model *model, const uz_group *group, bool positive,
                               const char *where, uz_error *err);

/* mesh, dof: does every connected part stay in place under its supports alone? UZ_ERR_FREE_BODY names the rigid-body
 * modes that are left. */
uz_status uz_check_rigid_modes(const uz_body_model *model, uz_error *err);
/* mesh, dof, spring, N, m, info.contact_* -> *modes: d x *count, one after the other, orthonormal for each part: the
 * motions that supports leave free but for obstacles. UZ_ERR_FREE_BODY names those that no obstacle stands in the way
 * of. The caller frees *modes, NULL when there are none. */
uz_status uz_rigid_modes(double **modes, int64_t *count, const uz_body_model *model, uz_error *err);

/* Room for `more` rotated nodes. */
uz_status uz_reserve_frames(uz_body_model *model, int64_t more, uz_error *err);
/* Which dof of the node is along n? Its free dofs are rotated where none is; -1: held dofs span n already. */
int uz_hold_direction(uz_body_model *model, int64_t node, const double n[3]);
/* mesh, dof -> frame_of, info.rotated_node, info.frame: directions of the dofs of contact nodes. */
uz_status uz_choose_frames(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* The dim x dim matrix of a node whose dofs are rotated, its rows their directions; NULL: they are along the axes. */
const double *uz_node_frame(const uz_body_model *model, int64_t node);
/* A vector at a node (dim) along the directions of the node's dofs, and back in place. */
void uz_to_frame(double out[3], const uz_body_model *model, int64_t node, const double v[3]);
void uz_from_frame(double v[3], const uz_body_model *model, int64_t node);
/* A unit vector along the free dofs of a node: 0 for held ones, and where a rotated dof has a share by rounding only.
 */
void uz_free_shares(double share[3], const uz_body_model *model, int64_t node, const double n[3]);
/* Is one of these nodes rotated? A stiffness ke (full, square) of their displacements then becomes T ke T'. */
bool uz_are_rotated(const uz_body_model *model, const int64_t *node, int count);
void uz_turn_stiffness(double *ke, const uz_body_model *model, const int64_t *node, int count);

/* The nodes whose displacements make those of some nodes: themselves, but in the place of hanging ones those that they
 * lie amid, each once. */
typedef struct {
    bool hangs; /* is one of them hanging? */
    int own, count;
    int64_t node[UZ_ELEMENT_NODES];
    double share[UZ_ELEMENT_NODES][UZ_ELEMENT_NODES]; /* [own][count]; not filled where none hangs */
} uz_ties;
/* Of an element, which has no more of them than nodes (subdivide.h). */
void uz_tie_nodes(uz_ties *ties, const uz_mesh *mesh, const int64_t *node, int count);
/* out (count x dim, square) = the stiffness ke (own x dim) as one of theirs: S' ke S. */
void uz_tie_stiffness(double *out, const uz_ties *ties, const double *ke, int dim);

/* mesh -> sites, by each contact's discretization (discretization.h). rest: not NULL for those at model->place: the
 * same body with its sites before anything moves. */
uz_status uz_find_sites(uz_body_model *model, const uz_body_model *rest, const uz_scene *scene, uz_error *err);
/* mesh, dof, frames, sites -> N, m, n_pair_rows, info.contact_*. */
uz_status uz_build_contact_rows(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* Does `node` get a row from an obstacle with this unit normal? Only where some free dof of it has a share in the
 * normal that is more than rounding. */
bool uz_is_contact_row(const uz_body_model *model, int64_t node, const double normal[3]);
/* h; a supported node inside an obstacle: UZ_ERR_SCENE. */
uz_status uz_initial_gaps(double *h, const double *prescribed, const uz_body_model *model, const uz_scene *scene,
                          uz_error *err);

/* mesh, dof -> K, K_fixed with their patterns, all values zero. scene: has room for what its forces at points do under
 * large deformation; NULL: no such. */
uz_status uz_build_pattern(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* mesh, dof, frames, materials, spring -> K, K_fixed. scene: as of uz_build_pattern. */
uz_status uz_build_stiffness(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* Adds a stiffness ke (full, square) of displacements along the axes at `count` nodes to K and K_fixed. */
void uz_add_stiffness(uz_body_model *model, const double *ke, const int64_t *node, int count);
/* `brick` and, if it is wanted, K's diagonal, where the body is one whose rows bound a dof each (*made); else nothing.
 */
uz_status uz_build_cells(bool *made, uz_body_model *model, const uz_scene *scene, bool diagonal, uz_error *err);
/* Refuses what uz_build_stiffness would refuse. */
uz_status uz_check_elements(const uz_body_model *model, uz_error *err);
/* Twice the strain energy of the elements from begin to end - 1, without springs, by their strains. nodal: n_nodes x
 * dim; carried: as of uz_strain_energy. UZ_ERR_MEMORY. */
uz_status uz_strain_energy_of_groups(double *twice, const uz_body_model *model, const double *nodal, bool carried,
                                     int64_t begin, int64_t end, uz_error *err);

#endif
