/* run.h: the state of the solve of one load, shared by run.c (what happens), report.c (what is told of it),
 * cases.c (several loads on one body) and verify.c. */
#ifndef UZ_RUN_H
#define UZ_RUN_H

#include "run/setup.h"
#include "certificate/certificate.h"
#include "methods/decades.h"
#include "methods/iterate.h"
#include "run/problem.h"
#include "run/results.h"
#include "run/settings.h"
#include "uzawa.h"

/* What may become the result. */
typedef struct {
    double *u, *r, *g; /* d, m, m */
    uz_certificate certificate;
} uz_answer;
uz_status uz_answer_allocate(uz_answer *answer, int64_t d, int64_t m, uz_error *err);
void uz_answer_clear(uz_answer *answer);

typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_hooks *hooks;
    const uz_load_case *load_case; /* NULL: the problem's own load */
    int64_t index;                 /* of the case */
    const uz_state *start;         /* NULL: from r = 0 */
    bool hit;                      /* the body came from the cache */
    bool serves_many;              /* it serves more than this case: what makes certificates cheaper pays */
    uz_setup *setup;               /* borrowed */
    int64_t d, m;        /* m: rows that the body is solved with; once the run is `wide` all of the problem's */
    int64_t all;         /* rows of the problem */
    bool wide;           /* answer and certificate are about all rows */
    const double *p, *h; /* d, rows that the body is solved with */
    const double *h_all; /* all */
    double *owned;       /* scenes: room of p, h_all, prescribed and h */
    double *prescribed;  /* scenes: n_fixed */
    bool moved;          /* some of them are not zero */
    uz_dual_load *load;
    uz_iterate it;
    uz_decades decades;
    uz_factor_workspace *ws;
    uz_answer answer;
    double *work;             /* d */
    double started, deadline; /* uz_seconds() */
    double requested;         /* relative error that the certificate must meet */
    double target;            /* relative error at which the method returns */
    bool in_block;            /* other cases began before this one ended */
    bool again;               /* the method's target was met, the certificate was not */
    uz_end end;
    uz_candidates wants; /* rows that the case has to be solved with, as others were left out wrongly; in NULL: none */
    uz_result *result;
} uz_run;

/* Makes an empty result. *run is zeroed first: uz_run_end may follow a failure. */
uz_status uz_run_begin(uz_run *run, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                       uz_error *err);
/* Sizes and timings from the body. */
void uz_run_take_setup(uz_run *run, uz_reuse reused);
/* p, h and prescribed values of the case. */
uz_status uz_run_make_load(uz_run *run, uz_error *err);
/* What a certificate of u (d) starts from; needs the load. */
uz_status uz_run_certify_input(uz_certify_input *input, uz_run *run, const double *u, uz_error *err);
/* What a certificate of u says relative errors are relative to, where supports move the body; else 0. */
uz_status uz_run_whole_norm(double *norm, const uz_run *run, const double *u, uz_error *err);
/* Scenes, `balanced`: the request from the estimated discretization error of answer.u. */
void uz_run_balance_request(uz_run *run);
/* From p and h to a certified answer; ends in uz_run_report. It is make_load, the creation of run->load, and these: */
uz_status uz_run_solve(uz_run *run, uz_error *err);
uz_status uz_run_start(uz_run *run, uz_error *err);   /* vectors, the given start, the hook */
uz_status uz_run_iterate(uz_run *run, uz_error *err); /* until the method's own estimate is met, or it ends */
uz_status uz_run_certify(uz_run *run, uz_error *err); /* the best answer */
uz_status uz_run_finish(uz_run *run, uz_error *err);  /* further rounds where the certificate asks for them */
/* The answer and its certificate become those of all rows, where the body left some out (all_rows.c); run->wants. */
uz_status uz_run_widen(uz_run *run, uz_error *err);
/* From here on certificates are about all rows, of which the answer has room. */
void uz_run_take_all_rows(uz_run *run);
/* Fills answer->certificate and answer->g from answer->u and answer->r (caller's rows), from the original data. */
uz_status uz_run_certify_answer(uz_run *run, uz_answer *answer, uz_error *err);
/* Iterative refinement of run->answer while its certificate misses the request and gets better. */
uz_status uz_run_refine(uz_run *run, uz_error *err);
/* Fills the summary and the result's u. */
uz_status uz_run_report(uz_run *run, uz_error *err);
/* The part of it that is about the answer, whoever made it: u, r and g go to the result. The outcome stands. */
uz_status uz_run_publish(uz_run *run, uz_error *err);
/* Seconds of the run until now. In a block the others' time is not this case's. */
double uz_run_time(const uz_run *run);
void uz_run_end(uz_run *run);

/* uz_solve_cases on a mesh that is given, and on one whose cells are chosen (run/grid_sequence.c). */
uz_status uz_solve_on_mesh(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                           const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);

/* uz_solve for a K that is positive definite; others are refused. */
uz_status uz_solve_regular(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                           const uz_hooks *hooks, uz_error *err);

#endif
