/* assembly.h: from a scene to matrices, split where the factor cache needs it.
 *
 *   body   what K and N depend on: mesh, materials, thickness, model, which dofs are supported, contact groups and
 *          normals. Built once, then only read, by many threads at a time.
 *   load   what one case adds: tractions, prescribed values, positions of the obstacles: p and h.
 *
 * A dof is a node and a direction. Supported dofs are eliminated; the free ones keep the order of the nodes. A contact
 * row exists for each node of a contact group of which some free dof has a share in the normal; rows come contact by
 * contact, nodes ascending. N is minus the unit normal on those dofs, so that g = h - N u = (x + u - point) . n.
 * The directions of a node's free dofs are the axes, but at a node whose first contact row has a normal with a share in
 * several of them: there one dof is along that normal, the others across, so that the row has one entry. K, N and p are
 * in these dofs; uz_recover_nodal and uz_restrict_nodal lead to x, y and back. */
#ifndef UZ_ASSEMBLY_H
#define UZ_ASSEMBLY_H

#include "scene/mesh.h"
#include "uzawa.h"

typedef struct {
    int64_t d, m, n_fixed;
    uz_csc K;       /* d x d, lower triangle */
    uz_csc N;       /* m x d */
    uz_csc K_fixed; /* d x n_fixed: what supported dofs do to free ones; p loses K_fixed times the prescribed values */
    int64_t *dof;   /* n_nodes x dim: number of a free dof, or -1 - k for supported dof k */
    int64_t *frame_of; /* n_nodes: 1 + place in info.turned_node, <= 0: along the axes. NULL: all of them are */
    uz_mesh mesh;
    uz_mesh_info info; /* as uz_scene_to_qp gives it; its xyz is the mesh's own array */
    double thickness;
    int64_t n_modes;      /* motions that only obstacles hold; 0: the supports hold the body */
    double *modes;        /* d x n_modes: displacements of the free dofs, one motion after the other */
    double elasticity[9]; /* 3 x 3, row by row: stress (xx, yy, xy) from strain (xx, yy, 2 xy) */
} uz_body_model;

/* Mesh, supports, stiffness, contact normals. Checks what it reads; loads and values are checked by _load.
 * Errors: UZ_ERR_SCENE, _FREE_BODY, _NOT_FINITE, _MEMORY. */
uz_status uz_body_model_build(uz_body_model *out, const uz_scene *scene, uz_error *err);
/* The same for a body that obstacles may hold: K is then singular and has `modes` for null space. Refuses with
 * UZ_ERR_FREE_BODY only what no obstacle stands in the way of; whether the load presses the body on is the load's
 * matter. */
uz_status uz_body_model_build_held(uz_body_model *out, const uz_scene *scene, uz_error *err);
void uz_body_model_clear(uz_body_model *model);

/* p (d), h (m) and the prescribed values of the supported dofs (n_fixed; NULL: not wanted) of a scene whose body is
 * `model` (same uz_scene_body_key). On failure the outputs are undefined. */
uz_status uz_body_model_load(double *p, double *h, double *prescribed, const uz_body_model *model,
                             const uz_scene *scene, uz_error *err);

/* The motion with these coefficients (n_modes) in words: "translation along +y". */
void uz_name_motion(char *text, size_t size, const uz_body_model *model, const double *y);

/* Does the load p (d) press a body of _build_held on its obstacles, in every mode that nothing else holds?
 * UZ_ERR_FREE_BODY at "/loads" names the motion by which the body leaves them, or could at no cost. */
uz_status uz_check_pressed(const uz_body_model *model, const double *p, uz_error *err);

/* Bytes that determine the body and nothing else: scenes with equal keys have the same model. Freed by the caller. */
uz_status uz_scene_body_key(unsigned char **out, size_t *len, const uz_scene *scene, uz_error *err);

/* nodal (n_nodes x dim) from the free dofs u (d) and the prescribed values (n_fixed; NULL: all zero). */
void uz_recover_nodal(double *nodal, const uz_body_model *model, const double *u, const double *prescribed);

/* The reverse: the free dofs u (d) of a displacement by node; what it says of supported dofs is left out. */
void uz_restrict_nodal(double *u, const uz_body_model *model, const double *nodal);

/* Copies what a result shows of the mesh: not the frames, as a result speaks of x and y only. */
uz_status uz_mesh_info_copy(uz_mesh_info *out, const uz_mesh_info *info, int64_t m, uz_error *err);

/* Estimated ||u - u_h||_E / ||u||_E of the mesh, for nodal displacements n_nodes x dim; NaN when there is no memory or
 * nothing is strained. Zienkiewicz and Zhu, "A simple error estimator and adaptive procedure for practical engineering
 * analysis", Int. J. Numer. Meth. Engng 24 (1987) 337-357: the stress is compared with its own nodal averages. */
double uz_estimate_discretization_error(const uz_body_model *model, const double *nodal);

#endif
