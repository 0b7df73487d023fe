/* starts.h: where a run begins: what an earlier job left in the store, or what the request says. */
#ifndef SERVER_WORK_STARTS_H
#define SERVER_WORK_STARTS_H

#include "codec/codec.h"
#include "store/store.h"
#include "uzawa.h"

/* For n = max(1, cases) runs. A start that is not there any more is NULL: from zero. */
typedef struct {
    int64_t n;
    uz_state **states;  /* n; NULL: all from zero */
    double **histories; /* n, the rows of the runs that are continued; NULL: none */
    int64_t *rows;      /* n */
    uz_trade *trades;   /* n: of the same runs; NULL: none */
} starts;

/* What the store gives of what the request asks for; STORE_OK unless it fails. The caller clears *out. */
store_status starts_load(starts *out, store *s, const codec_request *request);
void starts_clear(starts *s);

/* The reactions that a job, or one case of it, ended with: *count of them, freed by the caller. STORE_OK and *r NULL:
 * the problem was infeasible, so that they are no numbers. */
store_status starts_reactions(store *s, const char *id, int64_t number, double **r, int64_t *count);

#endif
