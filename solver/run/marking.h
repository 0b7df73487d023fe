/* marking.h: which elements to bisect next. */
#ifndef UZ_RUN_MARKING_H
#define UZ_RUN_MARKING_H

#include "assembly/assembly.h"

/* Appends one round to a list for uz_mesh_bisect, or uz_mesh_subdivide if it is `subdivided`: the fewest elements of
 * the body, on which the cases' results are, that have half of the square of the largest error (W. Dörfler, SIAM J.
 * Numer. Anal. 33 (1996) 1106-1124, theta = 0.5); fewer where those are expected to leave no more than the part `left`
 * of the error. Of triangles each is halved once, from which `left` of it is more than half (of a quantity, whose error
 * is a product of two, a quarter), else along each direction. None where there is no error to be seen. All of them
 * along each direction where it is small enough already (left >= 1), to see whether that is so. Where an obstacle
 * stands in the body under large deformation (UZ_MESH_LIMIT), those at sides that it is nearer to than they are long.
 * list, n  NULL and 0, or what this function left; the caller frees *list. UZ_ERR_MEMORY: the list is as it was. */
uz_status uz_mark_elements(int64_t **list, int64_t *n, const uz_body_model *body, const uz_problem *problem,
                           uz_result *const *results, double left, bool subdivided, uz_error *err);

#endif
