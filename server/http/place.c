/* place.c: the job, or the one of its load cases, that a reply is about. */
#include "http/jobs.h"
#include "http/results.h"

#include <stdio.h>

static void refuse_all(const store_case *cases, size_t count, const char *what, http_reply *reply)
{
    char title[96];
    problem_details problem;
    snprintf(title, sizeof title, "Each load case has %s of its own", what);
    http_problem(&problem, 400, "case_needed", title, "say which one with ?case=NAME.");
    cases_list(&problem, cases, count);
    reply_problem(reply, &problem);
}

bool results_one(results_place *out, api *context, const http_request *rq, const job *j, const char *what,
                 http_reply *reply)
{
    *out = (results_place){.summary = j->summary};
    if (!results_cases(context, rq, j, &out->cases, &out->count, reply))
        return false;
    if (out->count == 0)
        return true;
    if (!target_value(&rq->target, "case")) {
        refuse_all(out->cases, out->count, what, reply);
        return false;
    }
    out->number = out->cases[0].number;
    out->name = out->cases[0].name;
    out->summary = out->cases[0].summary;
    return true;
}

void results_place_clear(results_place *place)
{
    store_cases_free(place->cases, place->count);
    *place = (results_place){.number = 0};
}
