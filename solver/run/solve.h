/* solve.h: the layers between a call of the library and the solve of one load. Each calls only those below it:
 *
 *     uz_solve, uz_solve_cases    solve.c          which of the two that follow
 *     uz_solve_grid_sequence      grid_sequence.c  grid after grid, where the mesh is chosen
 *     uz_solve_on_mesh            cases.c          all load cases; those that only the obstacle holds by themselves
 *     uz_judge_whole_error        guarantee.c      a bound on one answer, by problems that the layers below solve
 *     uz_solve_semicoercive       semicoercive.c   one of these, by problems that the next layer solves
 *     uz_solve_rounds             rounds.c         all load cases on one setup, in rounds of contact rows
 *     uz_block_solve              block.c          several loads at once
 *     uz_run_*                    run.c            one load */
#ifndef UZ_SOLVE_H
#define UZ_SOLVE_H

#include "uzawa.h"

/* Grid sequence and mesh have the contract of uz_solve_cases. */
typedef uz_status uz_solver(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                            const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
uz_solver uz_solve_grid_sequence; /* for meshes that are made finer until the total error is what was asked for */
uz_solver uz_solve_on_mesh;

/* Where settings ask for it, a guaranteed bound on the whole error of an answer, or why there is none (uz_guarantee);
 * and an answer that converged becomes UZ_MESH_LIMIT where the whole error is not settings->total_error. */
void uz_judge_whole_error(uz_result *result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started);

/* Solves all load cases on setups from the cache. K that is not positive definite is refused.
 *   results  n = max(1, n_cases), NULL at entry; those that are there stay on failure, and the caller frees them
 *   starts   n or NULL, as in uz_solve_cases
 *   near     one case, no starts: an answer to the same scene at another place, whose reactions it starts from, or NULL
 * Errors are those of uz_solve_cases, but for what only the obstacle holds: UZ_ERR_FREE_BODY, UZ_ERR_NOT_SPD. */
uz_status uz_solve_rounds(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, const uz_result *near, uz_cache *cache, const uz_hooks *hooks,
                          uz_error *err);

#endif
