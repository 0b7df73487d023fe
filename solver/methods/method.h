/* method.h: a method of iteration on the dual problem: it maximizes psi(r) over the r that the contact law allows
 * (law/law.h), and sees the body through dual/dual.h only. steps.h: a method that makes steps; turns.h: which one runs
 * when. How to add one: docs/architecture/method.md. */
#ifndef UZ_METHOD_H
#define UZ_METHOD_H

#include "dual/dual.h"
#include "law/law.h"
#include "uzawa.h"

typedef struct uz_iterate uz_iterate; /* iterate.h */

/* Why a method returned. */
typedef enum {
    UZ_END_TARGET,
    UZ_END_ITERATIONS,
    UZ_END_TIME,
    UZ_END_STALLED,
    UZ_END_SOLVED, /* every sign is right, whatever the target: only rounding is left, the certificate tells how much */
    UZ_END_UNDECIDED, /* the same, but rows contradict each other by less than rounding can tell from touching */
    UZ_END_UNSOLVED,  /* the active set can't: too many rows of several entries for the factored operator */
    UZ_END_NEXT,      /* the last r is the best of a way that was given up; who is not content with it calls again */
    UZ_END_PAPER,
    UZ_END_CANCELLED,
    UZ_END_RAY /* the reactions grow along a ray that seems to prove the rows contradictory */
} uz_end;

typedef struct {
    uz_method method;
    uz_stopping stopping;
    double target;  /* relative error at which to return */
    double epsilon; /* UZ_STOP_PAPER */
    int64_t max_iterations;
    double deadline; /* uz_seconds() */
    bool again;      /* the last call met its target, which was not enough */
    bool yields;     /* another method follows: the active set ends where only single exchanges are left */
    double work;     /* entries of matrices that the dual active set may pass; 0: any number */
    const uz_hooks *hooks;
} uz_method_options;

/* Iterates until an end is reached; appends a row per iteration to history (row 0 is the start; a run that continues
 * another one goes on with the row after that one's last). */
typedef uz_status uz_method_runner(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                                   uz_history *history, uz_error *err);

typedef struct {
    uz_method method;
    const char *name;      /* as in the HTTP interface */
    bool one_sided;        /* needs a law that is (law.h); refused with another */
    bool as_given;         /* by itself it steps on the caller's rows without scaling: the published methods */
    bool exact;            /* wants D applied without inner iterations; auto looks for another method elsewhere */
    uz_method_runner *run; /* NULL: several by turns, as uz_method_next tells */
    const struct uz_steps *steps; /* steps.h: of uz_steps_run, else NULL */
} uz_method_kind;

/* NULL: there is none of that name to run. */
const uz_method_kind *uz_method_kind_of(uz_method method);

/* The kind to run with this law. UZ_ERR_ARGUMENT: there is none, or it can't with the law. */
uz_status uz_method_find(const uz_method_kind **out, uz_method method, const uz_law *law, uz_error *err);

#endif
