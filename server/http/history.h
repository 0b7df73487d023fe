/* history.h: the rows of a job's convergence history, stored or live. */
#ifndef SERVER_HTTP_HISTORY_H
#define SERVER_HTTP_HISTORY_H

#include "http/api.h"

/* The rows of one case, or of a job without cases; the caller frees `rows`. */
typedef struct {
    char case_name[64]; /* "": none */
    double *rows;       /* count x CODEC_HISTORY_COLUMNS */
    int64_t count;
} found_rows;

/* Rows after iteration `after` of the case that is named (NULL: of the job, or of the case that runs). An accepted job
 * has none. False with a reply. */
bool history_rows(api *context, const job *j, const char *name, int64_t after, found_rows *out, http_reply *reply);

#endif
