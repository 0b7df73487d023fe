/* guarantee.h: what is proved of an answer on a mesh, and what the intervals of its quantities are made from. */
#ifndef UZ_GUARANTEE_H
#define UZ_GUARANTEE_H

#include "bound/bound.h"
#include "run/problem.h"

typedef struct {
    const uz_problem *problem; /* of one case */
    const uz_settings *settings;
    uz_cache *cache;
    uz_hooks hooks; /* whether to go on, and nothing else: rows are of the answer */
    uz_stop stop;
    uz_bound_body body;
    uz_qp qp; /* the dual problem, and its unknowns by moments of edges */
    int64_t *dof;
    double *stress;
    double *lift, *cheap; /* n_nodes x 2: both take the answer out of obstacles, one by itself with the least norm, the
                           * other to the least energy; NULL: it is out of them, or no way out was found */
    uz_bound_check_result checked;
    double *admissible; /* n_nodes x 2: the answer of least energy, where more is proved with it; NULL: the answer */
    uz_bound_check_result out_of_it;    /* of this */
    const uz_bound_check_result *shown; /* what intervals are from: one of the two */
    double rho;                         /* norm of what the stress lacks of equilibrium, from above */
} uz_guaranteed;

/* The library's settings for problems in matrices, with what is left of the time. */
uz_settings uz_guarantee_settings(const uz_guaranteed *g, double now);
/* |residual| in the norm of the inverse of the dual problem's K, from above; INFINITY where that was not found. */
uz_status uz_measure_residual(double *norm, const uz_guaranteed *g, double *residual, uz_error *err);

/* intervals.c: what takes an answer out of obstacles that it stands in between its nodes: g->lift, g->cheap. Nothing is
 * proved of them. UZ_ERR_MEMORY, _CANCELLED. */
uz_status uz_lift_out(uz_guaranteed *g, const uz_result *result, uz_error *err);
/* ... guaranteed intervals for the quantities, once the whole error is proved; what has none keeps its
 * estimate, and says why. UZ_ERR_MEMORY, _CANCELLED and what problems in matrices fail with. */
uz_status uz_prove_quantities(uz_result *result, const uz_guaranteed *g, uz_error *err);

/* Adds what elements have of something, n of them, to what evaluation->share says, as parts of the sum. */
void uz_add_share(uz_evaluation *evaluation, int64_t n, const double *of);

#endif
