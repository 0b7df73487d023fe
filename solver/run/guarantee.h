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
    double *pressing;     /* n_edges x moments: what the answer presses by, of bodies that only obstacles hold */
    double *at;           /* ... the displacement there, along the normal, of the stress on soft springs; NULL: none */
    double *lift, *cheap; /* n_nodes x 2: both take the answer out of obstacles, one by itself with the least norm, the
                           * other to the least energy; NULL: it is out of them, or no way out was found */
    double *carried[2];   /* the same of the answer's own mesh, on one that is refined from it */
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

/* An answer before obstacles, on the mesh of `g`: its own, or one that is refined from it (closer.c). */
typedef struct {
    const double *u;           /* n_nodes x 2 */
    const double *r, *gap;     /* by its rows; NULL: it has no rows there, but ... */
    const double *push, *open; /* n_nodes x 2, n_nodes: as uz_bound_push */
    bool stands_off; /* ... so far from obstacles that press in the stress that less of it is looked for, too */
} uz_standing;

/* intervals.c: what takes an answer out of obstacles that it stands in between its nodes: g->lift, g->cheap. Nothing is
 * proved of them. UZ_ERR_MEMORY, _CANCELLED. */
uz_status uz_lift_out(uz_guaranteed *g, const uz_standing *answer, uz_error *err);

/* How deep a displacement stands in an obstacle along an edge, at most of some points of each piece before it; below
 * zero: it is out of it. */
double uz_depth_along(const uz_bound_body *body, int64_t edge, const double *u);

/* closer.c: the mesh of an answer, and the answer on it, refined where it presses on obstacles. */
typedef struct {
    uz_problem problem; /* of the same case, with another list of elements to be bisected */
    int64_t *bisected;
    uz_body_model model;
    double *u;      /* n_nodes x 2: the answer's at the nodes; between them it is the answer on all sides of its mesh */
    bool triangles; /* ... and within its elements: they are triangles */
} uz_closer;

/* *any false: nothing presses, or the mesh cannot be refined within the straight sides that it has. g: of the answer's
 * own mesh. Errors as those of meshes, and UZ_ERR_MEMORY, _CANCELLED. The caller clears *out. */
uz_status uz_closer_make(uz_closer *out, bool *any, const uz_guaranteed *g, const uz_result *result, uz_error *err);
void uz_closer_clear(uz_closer *closer);

/* ... guaranteed intervals for the quantities, once the whole error is proved; what has none keeps its
 * estimate, and says why. UZ_ERR_MEMORY, _CANCELLED and what problems in matrices fail with. */
uz_status uz_prove_quantities(uz_result *result, const uz_guaranteed *g, uz_error *err);

/* Adds what elements have of something, n of them, to what evaluation->share says, as parts of the sum. */
void uz_add_share(uz_evaluation *evaluation, int64_t n, const double *of);

#endif
