/* start_check.c: "warm_start": {"job": ...} against the store, before the request becomes a job. The other job may
 * still be deleted before this one runs; the run then begins at zero. */
#include "http/jobs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* 422 at a member of warm_start. */
static bool refuse(problem_details *problem, const char *member, const char *code, const char *detail)
{
    problem_fill(problem, 422, code, "The start cannot be used", "%s", detail);
    snprintf(problem->pointer, sizeof problem->pointer, "/solver/warm_start/%s", member);
    return false;
}

static bool refuse_store(api *context, const codec_start *start, store_status status, problem_details *problem)
{
    char cause[256];
    if (status == STORE_DAMAGED) {
        codec_problem_damaged(problem, start->job);
        return false;
    }
    store_message(context->store, cause, sizeof cause);
    log_write(context->log, LOG_ERROR, "store_error", (log_field[]){LOG_S("cause", cause), {0}});
    return problem_fill(problem, 500, "store_error", "The store failed", "the server's log has the cause");
}

/* The job must have ended with an answer. */
static bool check_job(api *context, const codec_start *start, problem_details *problem)
{
    job other = {0};
    store_status status = store_get(context->store, start->job, &other);
    bool ended = status == STORE_OK && jobs_ended(&other), good = ended && other.summary;
    status = status == STORE_OK && other.damaged ? STORE_DAMAGED : status;
    job_clear(&other);
    if (good)
        return true;
    if (status == STORE_NOT_FOUND)
        return refuse(problem, "job", "not_allowed", "/solver/warm_start/job: there is no job with this id");
    if (status != STORE_OK)
        return refuse_store(context, start, status, problem);
    return refuse(problem, "job", "not_allowed",
                  ended ? "/solver/warm_start/job: this job ended without an answer"
                        : "/solver/warm_start/job: this job has not ended");
}

/* Its case, if it has some, must have as many reactions as the problem has rows. */
static bool check_reactions(api *context, const codec_request *request, problem_details *problem)
{
    const codec_start *start = &request->start;
    store_case *cases = NULL;
    size_t n_cases = 0, i = 0;
    store_status status = store_get_cases(context->store, start->job, NULL, &cases, &n_cases);
    if (status != STORE_OK)
        return refuse_store(context, start, status, problem);
    while (i < n_cases && strcmp(cases[i].name, start->case_name) != 0)
        i++;
    const bool good = i < n_cases || (n_cases == 0 && !start->case_name[0]);
    const int64_t number = i < n_cases ? cases[i].number : 0; /* 0: the job has no cases */
    if (!good && start->case_name[0])
        refuse(problem, "case", "not_allowed", "/solver/warm_start/case: that job has no case of this name.");
    else if (!good)
        refuse(problem, "job", "missing_key",
               "/solver/warm_start/job: that job has load cases: say which one in \"case\".");
    if (!good)
        cases_list(problem, start->case_name, cases, n_cases);
    store_cases_free(cases, n_cases);
    if (!good)
        return false;

    double *r = NULL;
    int64_t count = 0, m, n_u;
    char text[160];
    status = store_get_vector(context->store, start->job, number, "reactions", &r, &count);
    bool finite = status == STORE_OK;
    for (int64_t k = 0; finite && k < count; k++)
        finite = isfinite(r[k]);
    free(r);
    if (status != STORE_OK && status != STORE_NOT_FOUND)
        return refuse_store(context, start, status, problem);
    if (!finite)
        return refuse(problem, "job", "not_allowed", "/solver/warm_start/job: this job ended without reactions");
    if (!codec_request_sizes(request, &m, &n_u, problem))
        return false;
    if (count == m)
        return true;
    snprintf(text, sizeof text,
             "/solver/warm_start/job: that job has %lld contact rows, this problem has %lld: they must be as many",
             (long long)count, (long long)m);
    return refuse(problem, "job", "size_mismatch", text);
}

bool start_check(api *context, const codec_request *request, const http_request *rq, problem_details *problem)
{
    const codec_start *start = &request->start;
    char *body = NULL;
    size_t len = 0;
    if (!start->job[0])
        return true;
    if (!check_job(context, start, problem))
        return false;
    if (!start->continued)
        return check_reactions(context, request, problem);
    /* A run that goes on with another problem would be another run. */
    if (start->case_name[0])
        return refuse(problem, "case", "not_allowed",
                      "/solver/warm_start/case: a run is continued with all its cases; leave this out");
    store_status status = store_get_body(context->store, start->job, &body, &len);
    bool same = status == STORE_OK && codec_same_problem(rq->body, rq->body_len, body, len);
    free(body);
    if (same)
        return true;
    if (status != STORE_OK && status != STORE_NOT_FOUND)
        return refuse_store(context, start, status, problem);
    return refuse(problem, "continue", "not_allowed",
                  "/solver/warm_start/continue: problem and cases are not, byte by byte, those of that job; leave this "
                  "out to start from its reactions");
}
