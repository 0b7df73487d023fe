/* subdivide.h: finer quadrilaterals and hexahedra where they are asked for, with hanging nodes; wedges everywhere. */
#ifndef UZ_SCENE_SUBDIVIDE_H
#define UZ_SCENE_SUBDIVIDE_H

#include "scene/mesh.h"

/* What a list for uz_mesh_subdivide begins with; one for uz_mesh_bisect begins with how many. */
enum { UZ_SUBDIVIDED = -1 };

/* Are all elements quadrilaterals, or all hexahedra, and of one type? */
bool uz_mesh_can_subdivide(const uz_mesh *mesh);

/* Likewise, or are all elements wedges of one type? Those are only divided all at once. */
bool uz_mesh_can_subdivide_all(const uz_mesh *mesh);

/* Divides elements of such a mesh into 4 or 8 of their type, round after round: after UZ_SUBDIVIDED marked[1..n) has
 * for each round how many, then which, by their numbers after the rounds before; and with them as many coarser ones as
 * it takes that no edge or face of an element has more than its half, or quarter, beside it. Nodes amid a whole edge or
 * face of an element then hang (uz_mesh.hangs). Nodes, elements and the shape of the body stay: one part of an element
 * keeps its number, and others follow those that were there, so that the same list gives the same mesh, and a longer
 * one that begins with it a refinement of that. Groups are inherited as by uz_mesh_bisect. Errors: UZ_ERR_SCENE (other
 * elements), _ARGUMENT where the list is none, _LIMIT beyond UZ_SCENE_MAX_DOFS, _MEMORY. *mesh, which is none that was
 * refined already, can then only be cleared. */
uz_status uz_mesh_subdivide(uz_mesh *mesh, const int64_t *marked, int64_t n, uz_error *err);

#endif
