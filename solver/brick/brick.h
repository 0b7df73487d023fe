/* brick.h: a body that is a box of equal hexahedra, or in the plane of equal quadrilaterals, and its K as what each
 * cell does: no entry of K but its diagonal is ever stored.
 *
 *     K = sum over the cells of T_e' ke T_e,   ke one and the same for all cells
 *
 * with T_e the free dofs of the cell's nodes. A reflection of the cell in one of its three middle planes leaves ke as
 * it is. So in the sums and differences of corner displacements that are even or odd along each axis, ke is eight
 * blocks of 3 x 3, and a product takes 57 multiplications a cell where the matrix would take 576; in the plane four of
 * 2 x 2, and 10 for 64. */
#ifndef UZ_BRICK_H
#define UZ_BRICK_H

#include "amg/amg.h"
#include "brick/cells.h"

/* Corners of a cell in the order of ke, in cells, by component of the displacement; in the plane the first four. */
extern const int uz_brick_corner[UZ_BRICK_NODES][3];

/* Fills ke of a brick whose other members are there. false: ke is not symmetric to the reflections, to rounding, or its
 * numbers are out of range, which whoever assembles K will tell. */
bool uz_brick_init(uz_brick *brick);
/* The diagonal of K, as a matrix of d x d. */
uz_status uz_brick_diagonal(uz_csc *out, const uz_brick *brick, uz_error *err);
/* p (d) -= what cells do to free dofs where supported ones are moved by `value` (by support, as uz_body_model numbers
 * them: dof -1 - k is moved by value[k]). */
uz_status uz_brick_subtract_moved(double *p, const uz_brick *brick, const double *value, uz_error *err);
/* *twice = u'Ku over all dofs of the displacement u by node (nodal, n_nodes x axes), supported or not. UZ_ERR_MEMORY.
 */
uz_status uz_brick_energy(double *twice, const uz_brick *brick, const double *nodal, uz_error *err);

/* Geometric multigrid on a brick, which has to outlive it: a V-cycle in single precision, with cells twice as long on
 * each next grid, along the axes along which cells are short (Trottenberg, Oosterlee and Schueller, "Multigrid", 5.1),
 * and Chebyshev polynomials of degree 2 to 4 on the diagonal before and after (Adams, Brezina, Hu and Tuminaro, J.
 * Comput. Phys. 188 (2003)); the last grid by its factor. As a uz_multigrid its K is that of the brick: the K that it
 * is handed is not read. UZ_ERR_MEMORY, LIMIT, NOT_SPD. */
uz_status uz_brick_multigrid(uz_multigrid **out, const uz_brick *brick, size_t memory_limit, uz_error *err);
/* What it takes, and its room. */
double uz_brick_predict_bytes(const uz_brick *brick);
/* Seconds that a step of its smoother takes on this machine for each dof in so many axes: the least of several, in
 * about four milliseconds. */
double uz_brick_rate(int axes);

#endif
