/* solve.h: the layers between a call of the library and the solve of one load. Each calls only those below it:
 *
 *     uz_solve, uz_solve_cases    solve.c          grids, or rounds and what settles their answers
 *     uz_solve_grid_sequence      grid_sequence.c  grid after grid, where the mesh is chosen
 *     uz_settle_cases             cases.c          what answers ask for: those that only the obstacle holds, or that
 * move uz_judge_whole_error        guarantee.c      a bound on one answer, by problems that the layers below solve
 *     uz_look_at_few_elements     few_elements.c   what few elements hide of their error
 *     uz_solve_semicoercive       semicoercive.c   one of these, by problems that the next layer solves
 *     uz_solve_rounds             rounds.c         all load cases on one setup, in rounds of contact rows
 *     uz_block_solve              block.c          several loads at once
 *     uz_run_*                    run.c            one load */
#ifndef UZ_SOLVE_H
#define UZ_SOLVE_H

#include "uzawa.h"

/* uz_solve_cases for meshes that are made finer until the total error is what was asked for. results: as those of
 * uz_solve_rounds. */
uz_status uz_solve_grid_sequence(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                                 const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);

/* The same on the mesh that is given, by the stiffness that it has there. */
uz_status uz_solve_given(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);

/* What is left to do when the rounds on a mesh are over: cases that were refused or not certified because only the
 * obstacle holds the body are solved for one by one; then contacts that move, the whole error and quantities are
 * judged. results, starts  as handed to uz_solve_rounds rounds           how those ended, with what they left in *err
 *   started          uz_seconds() */
uz_status uz_settle_cases(uz_result **results, uz_status rounds, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, double started,
                          uz_error *err);

/* Where a mesh has few elements, of which estimates may be worth nothing: what answers are told to be off by, and
 * intervals of their quantities, are no less than what the same mesh with all elements divided tells (few_elements.c).
 * Of meshes that are refined this is for those that would do. Wedges beside other elements are not divided.
 * UZ_ERR_MEMORY. */
uz_status uz_look_at_few_elements(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                                  uz_cache *cache, const uz_hooks *hooks, double started, uz_error *err);

/* Where settings ask for it, a guaranteed bound on the whole error of an answer, or why there is none (uz_guarantee);
 * and an answer that converged becomes UZ_MESH_LIMIT where the whole error is not settings->total_error. */
void uz_judge_whole_error(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started);

/* Solves all load cases on setups from the cache. K that is not positive definite is refused.
 *   results  n = max(1, n_cases), NULL at entry; those that are there stay on failure, and the caller frees them
 *   starts   n or NULL, as in uz_solve_cases
 *   near     one case, no starts: an answer to the same scene at another place, whose reactions it starts from; of
 *            matrices one with the same rows; or NULL
 * Errors are those of uz_solve_cases, but for what only the obstacle holds: UZ_ERR_FREE_BODY, UZ_ERR_NOT_SPD. */
uz_status uz_solve_rounds(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, const uz_result *near, uz_cache *cache, const uz_hooks *hooks,
                          uz_error *err);

#endif
