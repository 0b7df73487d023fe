/* solve.h: the state of one solve, shared by pipeline.c (what happens) and report.c (what is told of it). */
#ifndef UZ_SOLVE_H
#define UZ_SOLVE_H

#include "body.h"
#include "methods/method.h"
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
    bool hit;      /* the body came from the cache */
    uz_body *body; /* borrowed from the cache */
    int64_t d, m;
    const double *p, *h; /* d, m */
    double *owned;       /* scenes: room of p, h and prescribed */
    double *prescribed;  /* scenes: n_fixed */
    uz_case *load;
    uz_iterate it;
    uz_factor_workspace *ws;
    uz_answer answer;
    double *work;             /* d */
    double started, deadline; /* uz_seconds() */
    double requested;         /* relative error that the certificate must meet */
    double target;            /* relative error at which the method returns */
    uz_end end;
    uz_result *result;
} uz_run;

/* Checks the settings and makes an empty result. *run is zeroed first: uz_run_end may follow a failure. */
uz_status uz_run_begin(uz_run *run, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                       uz_error *err);
/* Sizes and timings from the body. */
void uz_run_take_body(uz_run *run, uz_reuse reused);
/* Vectors of the solve and of the result. */
uz_status uz_run_allocate(uz_run *run, uz_error *err);
/* Fills the summary and the result's u. */
uz_status uz_run_report(uz_run *run, uz_error *err);
void uz_run_end(uz_run *run, uz_cache *cache);

#endif
