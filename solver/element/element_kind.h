/* element_kind.h: what a mesh has to know of its elements: their sides and corners. Names and node counts are in the
 * public header. */
#ifndef UZ_ELEMENT_ELEMENT_KIND_H
#define UZ_ELEMENT_ELEMENT_KIND_H

#include "uzawa.h"

/* Sides of an element; the local nodes of one of them, corners first: [2] or [3] in 2D, [3], [4] or [6] in 3D. */
int uz_element_side_count(uz_element_kind kind);
int uz_element_side(const int **local, uz_element_kind kind, int side);
/* How many nodes of an element, and of each side of it, are corners. They come first. */
int uz_element_corner_count(uz_element_kind kind);
int uz_face_corner_count(uz_element_kind kind);
/* Has it nodes in the middles of its edges? */
bool uz_element_is_quadratic(uz_element_kind kind);

#endif
