/* bisect.h: finer elements where they are asked for. */
#ifndef UZ_SCENE_BISECT_H
#define UZ_SCENE_BISECT_H

#include "scene/mesh.h"

/* Can each element be bisected? UZ_ERR_SCENE at "/mesh/refine" names the first kind that can't, and what to use. */
uz_status uz_mesh_check_bisection(const uz_mesh *mesh, uz_error *err);

/* Before a round of a list for uz_mesh_bisect: its elements are bisected once. */
enum { UZ_HALVED_ONCE = -2 };

/* Halves the edges of elements, round after round: marked[0..n) has for each round how many elements, then which, by
 * their numbers after the rounds before. Each of these is bisected as often as the body has dimensions, once where
 * UZ_HALVED_ONCE stands before how many they are, and others as far as two elements have to meet in whole sides.
 * Quadrilaterals among them become triangles first. Nodes, elements and the shape of the body stay: one half of an
 * element keeps its number, other elements and nodes follow those that were there, so that the same list gives the same
 * mesh, and a longer one that begins with it a refinement of that. Curved edges and sides stay the curves that they
 * are. Groups have the halves of their sides and elements, and of their nodes' edges and sides the new nodes that lie
 * between nodes of the group only; groups of nodes that have whole sides of the boundary only nodes of the boundary
 * between those of it. Errors: UZ_ERR_SCENE as above, _ARGUMENT where the list is none, _LIMIT beyond
 * UZ_SCENE_MAX_DOFS, _MEMORY. *mesh, which is none that was refined already, can then only be cleared. */
uz_status uz_mesh_bisect(uz_mesh *mesh, const int64_t *marked, int64_t n, uz_error *err);

#endif
