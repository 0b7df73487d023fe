/* method.h: the iterations on the dual problem maximize psi(r) over the r that the contact law allows (law/law.h). They
 * see the body through dual/dual.h only. */
#ifndef UZ_METHOD_H
#define UZ_METHOD_H

#include "dual/dual.h"
#include "law/law.h"
#include "uzawa.h"

/* Why a method returned. */
typedef enum {
    UZ_END_TARGET,
    UZ_END_ITERATIONS,
    UZ_END_TIME,
    UZ_END_STALLED,
    UZ_END_SOLVED, /* every sign is right, whatever the target: only rounding is left, the certificate tells how much */
    UZ_END_BLURRED,  /* the same, but rows contradict each other by less than rounding can tell from touching */
    UZ_END_UNSOLVED, /* the active set can't: too many rows of several entries for the factored operator */
    UZ_END_PAPER,
    UZ_END_CANCELLED,
    UZ_END_RAY /* the reactions grow along a ray that seems to prove the rows contradictory */
} uz_end;

/* The best answer so far, put aside. */
typedef struct {
    bool kept;
    double bound, relative;
    int64_t iteration;
    uz_method made_by;
    double *r; /* m */
} uz_best;

/* The iterate, kept between calls so that a run can be continued. Vectors of m. */
typedef struct {
    const uz_law *law;
    int64_t m, iteration, restarts, next_check;
    double alpha, tau;
    double *r, *Dr; /* r(k), which the law allows, and D r(k) */
    double *r_next, *Dr_next;
    double *rho, *Drho;   /* extrapolated point; of `conjugate` see conjugate.h */
    double *gamma;        /* gap at rho, or at r while a bound is computed */
    bool *close;          /* rows whose gap the corrected answer closes */
    double *anchor;       /* r at the last power of two, where a ray is looked for */
    double *ray;          /* UZ_END_RAY: y <= 0, N'y = 0, h'y > 0; before, a candidate */
    double *best_r;       /* the r whose bound is best; its correction is kept in the uz_dual_load */
    double best_bound;    /* on the energy-norm error; INFINITY before the first */
    double best_relative; /* the same over the energy norm of the answer */
    int64_t best_iteration;
    double started;    /* uz_seconds() of the first iteration */
    uz_method made_by; /* the method that made the best answer */
    double step_norm;  /* of the last gradient step; NaN: none */
    bool warm;         /* r is a caller's */
    uz_origin origin;  /* what was taken of the caller's start */
    bool begun;        /* there is a row 0, in this run's history or in that of the run it continues */
    bool fresh;        /* D r and rho are those of r as they stand: nothing is to be made again before the next step */
    bool along_ray;    /* the last conjugate step: psi rises along `ray`, no bound ends it, and D hardly curves it */
    bool resumed;      /* another run's state, with the correction of its best answer made before D was prepared */
    int32_t phase;     /* of auto */
    int64_t phase_end;
    struct uz_decades *decades; /* where bounds are noted; NULL: nowhere */
    uz_best before;             /* what was best before the last answer of a run that ended was bounded out of turn */
} uz_iterate;

/* law: borrowed. alpha 0: chosen when the first gradient step needs it. */
uz_status uz_iterate_init(uz_iterate *it, const uz_law *law, int64_t m, double alpha, uz_error *err);
void uz_iterate_clear(uz_iterate *it);

/* Takes over where a run stood, or the reactions of a warm start, before the first call of uz_method_run. What the
 * state says is checked against this problem: where D r or the bound of its best answer differ, it is that of another
 * one, and only its reactions are taken. Errors: UZ_ERR_SIZE (another m), _NOT_FINITE, _ARGUMENT. */
uz_status uz_iterate_start(uz_iterate *it, uz_dual_load *load, const uz_state *start, uz_error *err);
/* Can it be the state of a run on m contacts? Errors as above. */
uz_status uz_state_check(const uz_state *s, int64_t m, uz_error *err);
/* Where the iterate stands, for the caller of the library. */
uz_status uz_iterate_state(uz_state **out, const uz_iterate *it, const uz_dual_load *load, uz_method method,
                           uz_error *err);

typedef struct {
    uz_method method;
    uz_stopping stopping;
    double target;  /* relative error at which to return */
    double epsilon; /* UZ_STOP_PAPER */
    int64_t max_iterations;
    double deadline; /* uz_seconds() */
    bool again;      /* the last call met its target, which was not enough */
    const uz_hooks *hooks;
} uz_method_options;

/* Iterates until an end is reached; appends a row per iteration to history (row 0 is the start; a run that continues
 * another one goes on with the row after that one's last). */
uz_status uz_method_run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                        uz_history *history, uz_error *err);

/* The engines behind it: steps on the dual with one application of D each (uzawa, accelerated, accelerated_restart,
 * conjugate) and the active set. */
uz_status uz_gradient_run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                          uz_history *history, uz_error *err);
uz_status uz_active_set_run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                            uz_history *history, uz_error *err);

/* Appends a row; grows by doubling. Beyond UZ_HISTORY_ROWS rows every second one is dropped, again and again: a run of
 * millions of iterations keeps its course in bounded memory. Row 0 and the last row are always there; iterations tell
 * which rows are left. */
enum { UZ_HISTORY_ROWS = 131072 };
uz_status uz_history_append(uz_history *history, const uz_history_row *row, uz_error *err);

#endif
