/* history.c: the rows of a history: of an ended job from the store, of one that runs from its worker. */
#include "http/history.h"
#include "http/jobs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool refuse_case(http_reply *reply, int status, const char *name, const store_case *cases, size_t count)
{
    problem_details problem;
    if (name)
        problem_fill(&problem, status, "case_not_found", "Not found", "the job has no case \"%.63s\".", name);
    else
        problem_fill(&problem, status, "case_needed", "Each load case has a history of its own",
                     "say which one with ?case=NAME.");
    if (name)
        cases_suggest(&problem, name, cases, count);
    cases_list(&problem, cases, count);
    reply_problem(reply, &problem);
    return false;
}

/* The case that the query names in an ended job. False with a reply. */
static bool find_case(api *context, const job *j, const char *name, int64_t *number, http_reply *reply)
{
    store_case *cases = NULL;
    size_t count = 0, i = 0;
    store_status status = store_get_cases(context->store, j->id, NULL, &cases, &count);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return false;
    }
    while (name && i < count && strcmp(cases[i].name, name) != 0)
        i++;
    bool good = name ? i < count : count == 0;
    *number = good && name ? cases[i].number : 0;
    if (!good)
        refuse_case(reply, name ? 404 : 400, name, cases, count);
    store_cases_free(cases, count);
    return good;
}

/* The rows of a running job are with its worker, those of an ended one in the store; a job may end in between, and one
 * that waits has none. While a job with cases runs, the rows are those of the case that runs; another of its cases has
 * none to show. False with a reply. */
bool history_rows(api *context, const job *j, const char *name, int64_t after, found_rows *out, http_reply *reply)
{
    work_history live;
    if (j->status == JOB_ACCEPTED)
        return true;
    if (j->status != JOB_RUNNING || !work_live_history(context->work, j->id, name, after, &live)) {
        /* Of an ended job, from the store. */
        int64_t columns = 0, number;
        if (!find_case(context, j, name, &number, reply))
            return false;
        snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : "");
        store_status status =
            store_get_history(context->store, j->id, number, after, &out->rows, &out->count, &columns);
        if (status == STORE_OK && out->count > 0 && columns != CODEC_HISTORY_COLUMNS)
            status = STORE_ERROR;
        if (status == STORE_OK || status == STORE_NOT_FOUND)
            return true;
        reply_store_failure(context, status, reply);
        return false;
    }
    out->rows = live.rows;
    out->count = live.count;
    snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : live.case_name);
    return !name || live.is_case || refuse_case(reply, 404, name, NULL, 0);
}
