/* solve.h: one job from its text to what is kept of it, whatever claims it, watches it and stores it. */
#ifndef SERVER_WORK_SOLVE_H
#define SERVER_WORK_SOLVE_H

#include "codec/codec.h"
#include "store/store.h"
#include "uzawa.h"
#include "work/answers.h"
#include "work/starts.h"

/* What a solve is done with. */
typedef struct {
    store *source;         /* has the uploads and earlier jobs that the text names; only read */
    uz_cache *cache;       /* may be NULL */
    const uz_hooks *hooks; /* as for uz_solve; may be NULL */
    size_t memory_limit;   /* bytes; 0: no limit */
    double max_solve_s;    /* whatever the text asks for; 0: no limit */
    double queue_s;        /* it has waited; part of its times */
    const double *pace;    /* PACE_FORMS: by what predicted seconds are multiplied (work/pace.h); NULL: 1 */
    /* may be NULL; hooks->ctx: the text was read. The request, with the limits above, is good until solution_clear. */
    void (*read)(void *ctx, const codec_request *request);
} solve_with;

/* What of a solve is counted and logged. */
typedef struct {
    int64_t cases, iterations;                       /* cases: results, 1 where the job has none */
    bool has_answer;                                 /* what follows is set: */
    uz_outcome outcome;                              /* of the first case, as the phases before the iterations */
    bool cached;                                     /* its factor was there */
    double parse, assemble, order, factor, condense; /* seconds; parse also without an answer */
    double iterate, certify;                         /* of all cases */
    uz_operator op;                                  /* of converged answers, else UZ_OPERATOR_AUTO: */
    double said_s, took_s; /* predicted by the model, without pace, and actual, of all cases */
} solve_figures;

typedef struct {
    store_outcome outcome; /* points into what follows */
    bool stopped;          /* the hook said so, and the outcome is what there was until then */
    bool start_lost;       /* the source failed: the run began at zero */
    solve_figures figures;
    codec_request request;
    starts starts;
    uz_result **results; /* n of them */
    int64_t n;
    answers answers;
    char *error;
} solution;

/* Fills *out, which solution_clear clears in every case. body: freed once it was read; NULL: what the store has of job
 * `id` is damaged. */
void solve_job(solution *out, const solve_with *with, const char *id, char *body, size_t body_len);
void solution_clear(solution *s);

/* What a request will take, of `with` the source, the memory limit and the hooks. False: nothing can tell, or it would
 * take too long. body: freed once it was read. */
bool solve_predict(uz_prediction *out, const solve_with *with, char *body, size_t body_len);

/* Of results that a solve has, or has so far: its first n are not NULL, or nothing is counted but n. */
void solve_count(solve_figures *f, uz_result *const *results, int64_t n);

/* Makes the outcome a failure: its error is `encoded`, which the solution then owns, or, where that is NULL, that there
 * was no memory. */
void solution_fail(solution *s, char *encoded);

#endif
