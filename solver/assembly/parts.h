/* parts.h: the steps of uz_body_model_build and uz_body_model_load, each filling its own fields of the model. */
#ifndef UZ_ASSEMBLY_PARTS_H
#define UZ_ASSEMBLY_PARTS_H

#include "assembly/assembly.h"

/* mesh -> dof, d, n_fixed. UZ_ERR_SCENE where nothing is left to move. */
uz_status uz_number_dofs(uz_body_model *model, const uz_scene *scene, uz_error *err);

/* mesh, dof: does every connected part stay in place under its supports alone? UZ_ERR_FREE_BODY names the rigid-body
 * modes that are left. */
uz_status uz_check_rigid_modes(const uz_body_model *model, uz_error *err);
/* mesh, dof, m, info.contact_* -> *modes: d x *count, one after the other, orthonormal for each part: the motions that
 * supports leave free but for obstacles. UZ_ERR_FREE_BODY names those that no obstacle stands in the way of. The caller
 * frees *modes, NULL when there are none. */
uz_status uz_rigid_modes(double **modes, int64_t *count, const uz_body_model *model, uz_error *err);

/* mesh, dof -> frame_of, info.turned_node, info.frame: directions of the dofs of contact nodes. */
uz_status uz_choose_frames(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* The dim x dim matrix of a node whose dofs are turned, its rows their directions; NULL: they are along the axes. */
const double *uz_node_frame(const uz_body_model *model, int64_t node);
/* A vector at a node (dim) along the directions of the node's dofs. */
void uz_to_frame(double out[3], const uz_body_model *model, int64_t node, const double v[3]);
/* Has the element a node with turned dofs? Its stiffness ke (full, square) then becomes T ke T'. */
bool uz_is_turned_element(const uz_body_model *model, int64_t element);
void uz_turn_element(double *ke, const uz_body_model *model, int64_t element);

/* mesh, dof, frames -> N, m, info.contact_*. */
uz_status uz_build_contact_rows(uz_body_model *model, const uz_scene *scene, uz_error *err);
/* Does `node` get a row from an obstacle with this unit normal? Only where the normal moves some free dof of it. */
bool uz_is_contact_row(const uz_body_model *model, int64_t node, const double normal[3]);

/* mesh, dof, frames, elasticity -> K, K_fixed. */
uz_status uz_build_stiffness(uz_body_model *model, uz_error *err);
/* Refuses what uz_build_stiffness would refuse. */
uz_status uz_check_elements(const uz_body_model *model, uz_error *err);
/* Corner coordinates of an element, relative to its first corner. */
void uz_element_corners(double xy[8], const uz_mesh *mesh, int64_t element);

/* n_fixed values; two supports that contradict each other: UZ_ERR_SCENE. */
uz_status uz_prescribed_values(double *value, const uz_body_model *model, const uz_scene *scene, uz_error *err);
/* Area of the boundary that an edge stands for: length x thickness. */
double uz_edge_area(const uz_body_model *model, const int64_t ends[2]);
/* p += the scene's tractions. */
void uz_add_tractions(double *p, const uz_body_model *model, const uz_scene *scene);
/* h; a supported node inside an obstacle: UZ_ERR_SCENE. */
uz_status uz_initial_gaps(double *h, const double *prescribed, const uz_body_model *model, const uz_scene *scene,
                          uz_error *err);

#endif
