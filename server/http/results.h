/* results.h: what a job leaves behind: what handlers about answers and histories share. */
#ifndef SERVER_HTTP_RESULTS_H
#define SERVER_HTTP_RESULTS_H

#include "http/api.h"

/* What the store has, and what is computed from it. */
#define STORED ((unsigned)(UZ_FIELD_REACTIONS | UZ_FIELD_GAPS | UZ_FIELD_DISPLACEMENTS | UZ_FIELD_PRESSURE))
#define COMPUTED                                                                                                       \
    ((unsigned)(UZ_FIELD_CONTACT_STATUS | UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL | UZ_FIELD_VON_MISES |                  \
                UZ_FIELD_STRAIN | UZ_FIELD_STRESS_GAUSS))

/* False with a 409 that says why there is no answer. */
bool results_exist(const job *j, http_reply *reply);
/* Answers with the default fields of the result, as GET /v1/jobs/{id}/result does. */
void results_reply(api *context, const job *j, http_reply *reply);

/* The answer of an ended job never changes: its tag follows from which one it is and what is asked of it. True: the
 * client has it, and the reply says so. */
bool results_known(const http_request *rq, const job *j, http_reply *reply);

/* A job, or one of its cases. */
typedef struct {
    int64_t number;      /* 0: the job has no cases */
    const char *name;    /* NULL with it */
    const char *summary; /* JSON text */
    store_case *cases;   /* what the texts live in */
    size_t count;
} results_place;
/* name NULL: none is asked for. False with a reply, also where the job has cases and none is named; `what` each of them
 * has of its own. The caller frees its cases in every case. */
bool results_one(results_place *out, api *context, const job *j, const char *name, const char *what, http_reply *reply);

/* Appends up to some names of cases to the detail, quoted: `Its cases: "a", "b", ... (5 in all).` Before them `Did you
 * mean "x"?` if a case has a name close to the wrong one; NULL: none was given. */
void cases_list(problem_details *problem, const char *wrong, const store_case *cases, size_t count);

/* ---- histories (history.c) */

/* The rows of one case, or of a job without cases; the caller frees `rows`. */
typedef struct {
    char case_name[64]; /* "": none */
    double *rows;       /* count x CODEC_HISTORY_COLUMNS */
    int64_t count;
} found_rows;

/* Rows after iteration `after` of the case that is named (NULL: of the job, or of the case that runs). An accepted job
 * has none. False with a reply. */
bool history_rows(api *context, const job *j, const char *name, int64_t after, found_rows *out, http_reply *reply);
/* Width, theme and x of a diagram; false: *problem, a 400. */
bool plot_read(uz_plot *out, const http_request *rq, problem_details *problem);

#endif
