/* grid_sequence.h: a box whose cells are chosen so that the total error is what was asked for. */
#ifndef UZ_GRID_SEQUENCE_H
#define UZ_GRID_SEQUENCE_H

#include "uzawa.h"

bool uz_cells_are_chosen(const uz_problem *problem);

/* uz_solve_cases for such a problem. */
uz_status uz_solve_ladder(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);

#endif
