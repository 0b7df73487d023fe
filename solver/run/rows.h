/* rows.h: which contact rows take part in a solve, and the way back to all of them.
 *
 * m rows cost m^2 numbers and m^3 operations where D is dense, and a factorization that has them last or goes round
 * them otherwise; where whole surfaces are candidates most of them stay far from any obstacle. Scenes with many rows
 * are solved with those that start near (obstacle/candidates.h: which, and why that is exact). Every answer is then
 * certified on the full problem; where that fails rows are added, and the case is solved again. */
#ifndef UZ_ROWS_H
#define UZ_ROWS_H

#include "obstacle/candidates.h"
#include "uzawa.h"

/* False, without looking at the mesh: the problem is solved with all of its rows, as they are few, or it is one in
 * matrices, or asks for all. Of others the choice depends on the places of supports and planes too. */
bool uz_may_omit_rows(const uz_problem *problem);

/* The rows to begin with, and those that `wanted` (of m rows, or it is not looked at; NULL: none) has; rows->in stays
 * NULL where leaving out the rest would save little. h (m): initial gaps. Error: UZ_ERR_MEMORY. */
uz_status uz_choose_rows(uz_candidates *rows, const double *h, int64_t m, const uz_mesh_info *info,
                         const uz_scene *scene, const uz_candidates *wanted, uz_error *err);

/* Adds the rows of another set of as many to a set, which is made where it is empty. Error: UZ_ERR_MEMORY. */
uz_status uz_candidates_add(uz_candidates *to, const uz_candidates *from, uz_error *err);
/* The same for the rows whose reactions a start (of rows->m) knows. */
uz_status uz_candidates_add_start(uz_candidates *to, const uz_state *start, uz_error *err);
/* Is each row of b in a? */
bool uz_candidates_has(const uz_candidates *a, const uz_candidates *b);

#endif
