/* semicoercive_private.h: the state of one semicoercive solve, shared by semicoercive.c (what happens) and
 * semicoercive_outcome.c (what is told). */
#ifndef UZ_SEMI_H
#define UZ_SEMI_H

#include "assembly/assembly.h"
#include "semicoercive/augment.h"

typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_hooks *hooks;
    uz_settings with_factor;     /* the settings, but for an operator without a factor */
    uz_cache *cache, *own_cache; /* own: for the rounds, where the caller has none */
    bool is_scene;
    uz_body_model model;       /* scenes */
    double *load, *prescribed; /* scenes: d + m, and n_fixed */
    uz_singular of;
    int64_t d, m;
    uz_csc Nt;
    double *inverse;    /* d: uz_row_stiffness */
    double *stiffness;  /* m: the same; weights of phase 2 */
    double *soft;       /* m: weights of phase 1 */
    double *weight;     /* m: weights of the last solve */
    double *target;     /* m */
    bool *active;       /* m: rows that pressed in the last round */
    bool *provable;     /* m: rows of which nobody knows that they can't be proved to be in contact */
    double *null_space; /* matrices: d x k */
    const double *Z;    /* d x k; NULL: there are too many null vectors */
    int64_t k;
    uz_result *last; /* of the last augmented problem */
    double absolute; /* bound on ||u - u*||_K where `proved` */
    bool proved;
    int64_t rounds;
    double started, deadline; /* uz_seconds() */
    double assemble_s;
    double requested;
} uz_semi;

/* Of the last answer: what an error of it is relative to, and its norm in the last augmented problem. */
uz_status uz_semi_norms(double *norm, double *augmented, const uz_semi *s, double error, uz_error *err);

/* Makes s->last the result of the problem itself: its certificate from the original data, names, sums. `ended`: how the
 * last augmented problem did. */
uz_status uz_semi_conclude(uz_semi *s, uz_error *err);

/* *out: in place of an answer, why there is none. */
uz_status uz_semi_refuse(uz_result **out, const uz_semi *s, const uz_error *why, uz_error *err);

/* UZ_ERR_FREE_BODY, if the load does not press the body on. strict: also where a motion only costs nothing. */
uz_status uz_semi_check_pressed(const uz_semi *s, bool strict, uz_error *err);

#endif
