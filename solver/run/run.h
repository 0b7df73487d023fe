/* run.h: the solve of one load on a setup: what was asked, what is worked on, what is answered.
 *
 * rounds.c (one load after another), block.c (several together) and verify.c (an answer from elsewhere) call its steps:
 *
 *     begin -> load -> start -> iterate -> certify -> finish -> end */
#ifndef UZ_RUN_H
#define UZ_RUN_H

#include "certificate/certificate.h"
#include "methods/milestones.h"
#include "methods/iterate.h"
#include "post/ahead.h"
#include "run/setup.h"
#include "uzawa.h"

/* What was asked: nothing changes it while the run lives. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_hooks *hooks;
    int64_t index;            /* of the load case */
    const uz_state *start;    /* NULL: from r = 0 */
    bool guessed;             /* start: of another problem, near to this one */
    uz_setup *setup;          /* borrowed; only its mutex and what that guards change */
    uz_reuse reused;          /* what of it was there before */
    bool in_block;            /* other loads begin before this one ends */
    double started, deadline; /* uz_seconds() */
} uz_request;

/* The load in vectors: made by uz_run_load, then only read. */
typedef struct {
    const double *p, *h; /* d; rows of the setup */
    const double *h_all; /* all rows */
    double *prescribed;  /* scenes: n_fixed */
    bool moved, loaded;  /* some of them are not zero; a load is not (scenes) */
    int exponent;        /* all of these, and the answer, are times 2^exponent (scale.c) */
    double *owned;       /* n_owned: room of all of these; matrices: NULL where they are the caller's */
    int64_t n_owned;
} uz_load_vectors;

/* What is worked on. */
typedef struct {
    uz_dual_load *dual;
    uz_iterate it;
    uz_milestones milestones;
    uz_factor_workspace *ws; /* this and d numbers for linear solves, made when the first is needed */
    double *scratch;
    uz_ahead *ahead;  /* what is computed of the answer while it is certified; NULL: nothing */
    int exponent;     /* of iterates and history */
    double requested; /* relative error that the certificate must meet */
    double target;    /* relative error at which the method returns */
    bool again;       /* the method's target was met, the certificate was not */
    double *far;      /* m, or NULL: a ray that is no proof, and how large every feasible u is by it */
    double reach;
    uz_end end;
} uz_work;

/* What may become the result. */
typedef struct {
    int64_t m;         /* rows of the setup; after uz_run_certify_all_rows all of the problem's */
    double *u, *r, *g; /* d, m, m */
    uz_certificate certificate;
} uz_answer;
uz_status uz_answer_allocate(uz_answer *answer, int64_t d, int64_t m, uz_error *err);
void uz_answer_clear(uz_answer *answer);

typedef struct {
    const uz_request *asked;
    int64_t d, m, all; /* dofs, rows of the setup, rows of the problem */
    uz_load_vectors load;
    double *near; /* d + m: a displacement near the answer, and reactions (scaled rows), until it has begun; or NULL */
    uz_work work;
    uz_answer answer;
    uz_candidates wants; /* rows that the load has to be solved with, as others were left out wrongly; in NULL: none */
    uz_result *result;
} uz_run;

/* ---- the steps (run.c) */

/* Makes an empty result with what the setup says. *run is zeroed first: uz_run_end may follow a failure. */
uz_status uz_run_begin(uz_run *run, const uz_request *asked, uz_error *err);
/* p, h and prescribed values of the load case. */
uz_status uz_run_load(uz_run *run, uz_error *err);
/* Vectors, the given start, the hook; needs work.dual: block.c makes those of its lanes. */
uz_status uz_run_start(uz_run *run, uz_error *err);
/* Iterates until the method's own estimate is met, or it ends. */
uz_status uz_run_iterate(uz_run *run, uz_error *err);
/* The best answer and its certificate. */
uz_status uz_run_certify(uz_run *run, uz_error *err);
/* Further rounds while the certificate asks for them, refinement, all rows; then the report. */
uz_status uz_run_finish(uz_run *run, uz_error *err);
/* Instead of both, for uz_settings.step: the last answer as it is, if the iterations have *solved for it exactly. */
uz_status uz_run_hand_over(uz_run *run, bool *solved, uz_error *err);
void uz_run_end(uz_run *run);

/* ---- units in which squares neither over- nor underflow (scale.c) */

/* Multiplies the load by a power of two where it is not of a usual size. Exact. */
uz_status uz_run_scale_load(uz_run *run, uz_error *err);
/* The same for an answer that was given, or the load back to its own units. */
void uz_run_scale_given(uz_run *run);
/* Makes the answer what doubles hold of it in the caller's units, and certifies that where it is another. */
uz_status uz_run_round_to_units(uz_run *run, uz_error *err);
/* Load, answer, its certificate and the radius in the caller's units; bounds stay bounds, none becomes 0. */
void uz_run_restore_units(uz_run *run);
/* History and state of the result as well. */
uz_status uz_run_unscale_history(uz_run *run, uz_error *err);
/* The state in units 2^-exponent as large; of rows (NULL: of all) with those alone that are in (gather), or back: the
 * others have zeros. The caller frees *out. Error: UZ_ERR_MEMORY. */
uz_status uz_state_copy(uz_state **out, const uz_state *from, const uz_candidates *rows, bool gather, int exponent,
                        uz_error *err);
/* The caller's hooks, told in the caller's units; room lives as long as they. */
typedef struct {
    const uz_hooks *outer;
    int exponent;
    uz_hooks hooks;
} uz_scaled_hooks;
const uz_hooks *uz_run_hooks(uz_scaled_hooks *room, const uz_run *run);

/* ---- certificates (certify.c) */

/* What acts on the body beside its supports, at an answer u (d) to rows N, h. */
uz_acting uz_run_acting(const uz_run *run, const uz_csc *N, const double *h, const double *u);
/* What a certificate of the answer's u and rows starts from; needs the load. */
uz_status uz_run_certify_input(uz_certify_input *input, uz_run *run, const uz_answer *answer, uz_error *err);
/* Fills answer->certificate and answer->g from answer->u and answer->r (caller's rows), from the original data. */
uz_status uz_run_certify_answer(uz_run *run, uz_answer *answer, uz_error *err);
/* The answer that r (m, scaled rows) gives, with the feasible correction that was kept or without: its u and r. */
uz_status uz_run_recover(uz_run *run, uz_answer *answer, const double *r, bool with_correction, uz_error *err);
/* UZ_END_RAY: the rows that seem to contradict each other along it->ray, checked on the original data. */
uz_status uz_run_check_ray(uz_run *run, uz_error *err);
/* What y (m, <= 0, caller's rows) proves: result->ray where no u is feasible, else work.far where it reaches further
 * than what stands there. y is overwritten. */
uz_status uz_run_take_ray(uz_run *run, double *y, uz_error *err);

/* ---- what may follow a certificate */

/* Iterative refinement of the answer while its certificate misses the request and gets better (refine.c). */
uz_status uz_run_refine(uz_run *run, uz_error *err);
/* A small problem whose rows may contradict each other, as far as doubles can tell: solved again in more bits. */
uz_status uz_run_decide(uz_run *run, uz_error *err);
/* The answer and its certificate become those of all rows, where the setup left some out; run->wants (all_rows.c). */
uz_status uz_run_certify_all_rows(uz_run *run, uz_error *err);

/* ---- what is told of it (report.c) */

/* Sizes, timings and sources of the setup. */
void uz_report_setup(uz_run *run);
/* The iterations and the answer: fills the summary and moves u, r and g to the result. The outcome stands. */
uz_status uz_report_run(uz_run *run, uz_error *err);
/* The part of it that is about the answer, whoever made it. */
uz_status uz_report_answer(uz_run *run, uz_error *err);
/* Seconds of the run until now. In a block the others' time is not this load's. */
double uz_run_time(const uz_run *run);

#endif
