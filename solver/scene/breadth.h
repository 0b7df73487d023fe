/* breadth.h: how broad a body is, for what a factor of its matrix takes. */
#ifndef UZ_BREADTH_H
#define UZ_BREADTH_H

#include "scene/mesh.h"

/* Nodes of a layer across the longest side of a solid's bounding box, on an average, of the largest piece that the
 * layer falls into: what has to be taken out to part the body, if it is no broader one way than the other. 0: the mesh
 * is plane, or there is no memory. Less than a pass over the elements of an assembly. */
double uz_mesh_breadth(const uz_mesh *mesh);

#endif
