/* iterate.h: the iterate of a run, which methods start from and leave behind, and what they all do with it. */
#ifndef UZ_ITERATE_H
#define UZ_ITERATE_H

#include "methods/method.h"

/* The best answer so far, put aside. */
typedef struct {
    bool kept;
    double bound, relative;
    int64_t iteration;
    uz_method made_by;
    double *r; /* m */
} uz_best;

/* The iterate, kept between calls so that a run can be continued. Vectors of m. */
struct uz_iterate {
    const uz_law *law;
    int64_t m, iteration, restarts, next_check;
    double alpha, tau;    /* alpha: of the step, written by uz_iterate_set_alpha only */
    double *step;         /* m: alpha, each row's times the square of its weight */
    const double *weight; /* m: the dual operator's row_weight, borrowed; NULL: all 1, rows of unit norm about */
    double unit;          /* alpha unit^2 is that of the rows that weights stand for */
    double *r, *Dr;       /* r(k), which the law allows, and D r(k) */
    double *r_next, *Dr_next;
    double *rho, *Drho;   /* extrapolated point; of `conjugate` see conjugate.c */
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
    bool guessed;      /* r is the answer to another problem near to this one: an exact step is worth more than it */
    uz_origin origin;  /* what was taken of the caller's start */
    bool begun;        /* there is a row 0, in this run's history or in that of the run it continues */
    bool fresh;        /* D r and rho are those of r as they stand: nothing is to be made again before the next step */
    /* Of conjugate steps where inner iterations make D r: the length of the last one, 0: there is none, and, in the
     * energy norm, what Dr as it is carried along may miss. */
    double length, missed;
    bool along_ray; /* the last conjugate step: psi rises along `ray`, no bound ends it, and D hardly curves it */
    bool resumed;   /* another run's state, with the correction of its best answer made before D was prepared */
    int32_t phase;  /* of auto */
    int64_t phase_end;
    struct uz_milestones *milestones; /* where bounds are noted; NULL: nowhere */
    uz_best before; /* what was best before the last answer of a run that ended was bounded out of turn */
};

/* law, dual: borrowed. as_given: steps are those that the caller's rows would take without scaling, else those of rows
 * scaled to a norm of about 1; the same where they are scaled alike. alpha (0: chosen when the first gradient step
 * needs it): of these rows, the caller's where all are scaled alike. */
uz_status uz_iterate_init(uz_iterate *it, const uz_law *law, const uz_dual *dual, bool as_given, double alpha,
                          uz_error *err);
void uz_iterate_set_alpha(uz_iterate *it, double alpha);
/* alpha as the caller knows it, 0: not chosen yet; cut where the square of the rows' size is out of range. */
double uz_iterate_alpha(const uz_iterate *it);
void uz_iterate_clear(uz_iterate *it);

/* Takes over where a run stood, or the reactions of a warm start, before a method first runs. What the
 * state says is checked against this problem: where D r or the bound of its best answer differ, it is that of another
 * one, and only its reactions are taken. Errors: UZ_ERR_SIZE (another m), _NOT_FINITE, _ARGUMENT. */
uz_status uz_iterate_start(uz_iterate *it, uz_dual_load *load, const uz_state *start, uz_error *err);
/* Can it be the state of a run on m contacts? Errors as above. */
uz_status uz_state_check(const uz_state *s, int64_t m, uz_error *err);
/* Where the iterate stands, for the caller of the library. */
uz_status uz_iterate_state(uz_state **out, const uz_iterate *it, const uz_dual_load *load, uz_method method,
                           uz_error *err);

/* ------------------------------------------------------------------- for methods */

/* Bounds the error of the answer that r (the one of the last apply) gives and keeps it if it is the best so far.
 * Overwrites gamma. */
uz_status uz_iterate_bound(uz_iterate *it, uz_dual_load *load, uz_method by, uz_error *err);

/* An exact answer to some rows as equations becomes the iterate, and is bounded: r (m), cut to what the law allows, and
 * its gaps g (m). Counts an iteration. */
uz_status uz_iterate_take(uz_iterate *it, const double *r, const double *g, uz_dual_load *load, uz_method by,
                          uz_error *err);

/* Row 0: applies D to the start and bounds it. */
uz_status uz_iterate_begin(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                           uz_error *err);
/* Appends the iterate's row to the history and tells the progress hook. Overwrites r_next and
 * gamma. */
uz_status uz_iterate_record(uz_iterate *it, uz_dual_load *load, const uz_method_options *options, uz_history *history,
                            double step_norm, bool restart, uz_error *err);
/* Goes back to the best answer's r, or to 0 where there is none: guesses that failed may have left r anywhere. D r is
 * not made. */
void uz_iterate_go_back(uz_iterate *it);
/* Makes the correction of the best answer (best_r) again; best_bound and the rest are then those of it. Uses r_next and
 * Dr_next. */
uz_status uz_iterate_bound_best(uz_iterate *it, uz_dual_load *load, uz_error *err);
/* After a projected step from rho to r_next: psi must curve by no more than 1/alpha along it (Beck and Teboulle 2009,
 * Lemma 2.3). true: it curves more, the step was too long. alpha is shortened to what was seen, and rho is r again. */
bool uz_iterate_shorten(uz_iterate *it, const uz_dual_load *load);
void uz_iterate_swap(double **a, double **b);
/* The limits that every method honours: cancel, iterations, time. */
bool uz_should_stop(uz_end *end, const uz_iterate *it, const uz_method_options *options);

/* Appends a row; grows by doubling. Beyond UZ_HISTORY_ROWS rows every second one is dropped, again and again: a run of
 * millions of iterations keeps its course in bounded memory. Row 0 and the last row are always there; iterations tell
 * which rows are left. */
enum { UZ_HISTORY_ROWS = 131072 };
uz_status uz_history_append(uz_history *history, const uz_history_row *row, uz_error *err);

#endif
