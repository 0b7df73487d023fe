/* answers.h: the results of a run as the store keeps them. */
#ifndef SERVER_WORK_ANSWERS_H
#define SERVER_WORK_ANSWERS_H

#include "codec/codec.h"
#include "store/store.h"
#include "uzawa.h"
#include "work/starts.h"
#include "work/trade.h"

#define ANSWER_VECTORS 13

/* What one case, or the job, leaves; owns everything but the vectors that are the result's own. */
typedef struct {
    char *summary;
    double *history, *state, *contact_nodes; /* the last: of a case with rows of its own */
    double trade[TRADE_NUMBERS];
    store_vector vectors[ANSWER_VECTORS];
    size_t n_vectors;
    int64_t history_rows;
} answer_parts;

typedef struct {
    int64_t n;               /* results: max(1, cases) */
    answer_parts *parts;     /* n */
    answer_parts shared;     /* with cases: the job's own summary, and what all cases have in common */
    store_answer *cases;     /* n_cases */
    codec_finding *findings; /* of the request's assertions, over all cases */
    double dim, cells[3], *bisected;
} answers;

/* Fills outcome->whole and outcome->cases from the results, which must outlive them. False: no memory. The caller
 * clears *out in every case. */
bool answers_build(answers *out, store_outcome *outcome, uz_result *const *results, const codec_request *request,
                   const starts *from, double queue_s, double parse_s);
void answers_clear(answers *a);

#endif
