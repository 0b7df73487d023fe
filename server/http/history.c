/* history.c: the rows of a history: of an ended job from the store, of one that runs from its worker. */
#include "http/history.h"
#include "http/jobs.h"
#include "http/results.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The rows of a running job are with its worker, those of an ended one in the store; a job may end in between, and one
 * that waits has none. While a job with cases runs, the rows are those of the case that runs; another of its cases has
 * none to show. False with a reply. */
bool history_rows(api *context, const job *j, const char *name, int64_t after, found_rows *out, http_reply *reply)
{
    work_history live;
    if (j->status == JOB_ACCEPTED)
        return true;
    if (j->status == JOB_RUNNING && work_live_history(context->work, j->id, name, after, &live)) {
        problem_details problem;
        out->rows = live.rows;
        out->count = live.count;
        snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : live.case_name);
        if (!name || live.is_case)
            return true;
        problem_fill(&problem, 404, "case_not_found", "Not found", "the job has no case \"%.63s\".", name);
        cases_list(&problem, name, NULL, 0);
        reply_problem(reply, &problem);
        return false;
    }
    results_place at;
    int64_t columns = 0;
    const bool found = results_one(&at, context, j, name, "a history", reply);
    const int64_t number = at.number;
    results_place_clear(&at);
    if (!found)
        return false;
    snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : "");
    store_status status = store_get_history(context->store, j->id, number, after, &out->rows, &out->count, &columns);
    if (status == STORE_OK && out->count > 0 && columns != CODEC_HISTORY_COLUMNS)
        status = STORE_ERROR;
    if (status == STORE_OK || status == STORE_NOT_FOUND)
        return true;
    reply_store_failure(context, status, reply);
    return false;
}
