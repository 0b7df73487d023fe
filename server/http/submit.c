/* submit.c: requests that become jobs: POST /v1/jobs, /v1/verify and /v1/jobs/{id}/refine. */
#include "http/jobs.h"
#include "http/results.h"
#include "codec/codec.h"
#include "http/api.h"
#include "work/starts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* NULL in *key: none was given; freed by the caller. False with a 400. A key is kept as sent: 1 to 255 printable ASCII
 * characters. */
static bool read_key(const http_request *rq, char **key, problem_details *problem)
{
    size_t count;
    const header_field *field = header_find(&rq->headers, "Idempotency-Key", &count);
    *key = NULL;
    if (!field)
        return true;
    bool valid = count == 1 && field->value_len >= 1 && field->value_len <= 255;
    for (size_t i = 0; valid && i < field->value_len; i++)
        valid = field->value[i] >= 0x20 && field->value[i] <= 0x7e;
    if (!valid)
        return problem_fill(problem, 400, "bad_idempotency_key", "The Idempotency-Key is malformed",
                            "give one Idempotency-Key of 1 to 255 printable ASCII characters");
    *key = strndup(field->value, field->value_len);
    if (!*key)
        return problem_fill(problem, 503, "no_memory", "Out of memory", "try again later");
    return true;
}

/* Beyond these a solve takes more than some tens of milliseconds, cold and on one core. */
#define SMALL_DOFS 10000
#define SMALL_ROWS 1000

/* What the store keeps of a decoded request, and of its body and key, which must outlive it. */
static store_request kept_request(const api *context, const http_request *rq, const codec_request *request,
                                  const char *body, size_t len, const char *key)
{
    /* Small by its size alone: a prediction proper (uz_predict) takes longer than most jobs that are small. One that
     * iterates for long all the same is found out by who runs it. */
    const uz_problem *p = &request->problem;
    const int64_t cases = p->n_cases > 0 ? p->n_cases : 1;
    problem_details ignored;
    int64_t m, n_u;
    double cells = 1.0;
    const uint64_t held = store_is_shared(context->store) ? work_body(body, len) : 0;
    for (int i = 0; p->kind == UZ_PROBLEM_SCENE && i < p->scene.box.dim; i++)
        cells *= (double)p->scene.box.cells[i];
    const bool small = cells <= SMALL_DOFS && codec_request_is_light(request) &&
                       codec_request_sizes(request, &m, &n_u, &ignored) && n_u <= SMALL_DOFS / cases && m <= SMALL_ROWS;
    return (store_request){.client = rq->client,
                           .share = rq->share,
                           .small = small,
                           .held_body = held,
                           .any_upload = rq->sees_all,
                           .body = body,
                           .body_len = len,
                           .tags = request->tags,
                           .idempotency_key = key,
                           .uploads = (const char(*)[65])request->uploads,
                           .n_uploads = request->n_uploads,
                           .priority = request->priority,
                           .queue_limit_s = request->queue_limit_s,
                           .webhook = request->webhook};
}

/* Whom it may call (url NULL: nobody), and how urgent it may be. False: a 422 or a 403. */
static bool check_allowed(api *context, const http_request *rq, const char *url, int priority, problem_details *problem)
{
    const char *why;
    if (priority > STORE_PRIORITY_SHARED && !rq->sees_all) {
        problem_fill(problem, 403, "insufficient_scope", "This token does not allow that",
                     "/priority: %d would go before what others wait for, and needs the scope admin: the token \"%s\" "
                     "may say %d at most, which orders its owner's jobs among themselves",
                     priority, rq->token, STORE_PRIORITY_SHARED);
        strcpy(problem->pointer, "/priority");
        return false;
    }
    if (!url || webhooks_allow(context->webhooks, url, &why))
        return true;
    problem_fill(problem, 422, "webhook_not_allowed", "The webhook cannot be called", "/webhook/url: %s", why);
    strcpy(problem->pointer, "/webhook/url");
    return false;
}

/* Stores a request and tells the workers. False with a failure in reply; the caller clears *out. */
static bool store_job(api *context, http_request *rq, const store_request *request, job *out, http_reply *reply)
{
    bool repeated = false;
    problem_details problem;
    if (!check_allowed(context, rq, request->webhook, request->priority, &problem)) {
        reply_problem(reply, &problem);
        return false;
    }
    store_status status = store_submit(context->store, request, out, &repeated);
    if (status == STORE_CONFLICT)
        reply_refuse(reply, 422, "idempotency_key_reused", "The Idempotency-Key was used for another request",
                     "this key came before with a different body: use a new key for a new job");
    else if (status == STORE_NOT_FOUND)
        reply_refuse(reply, 422, "unknown_upload", "An upload is not there",
                     "an upload that the request names was deleted meanwhile: send it again");
    else if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    if (status != STORE_OK)
        return false;
    memcpy(rq->job_id, out->id, sizeof rq->job_id);
    if (!repeated)
        metrics_add(context->metrics, METRIC_SUBMITTED, 1);
    return true;
}

/* True with *out if the request came before with this key (NULL: none) and this body. Then it is answered as it was,
 * also where it would be refused now: what it names may be gone since, or a limit lower. The caller clears *out. */
static bool find_repeat(api *context, http_request *rq, const char *key, job *out)
{
    store_request request = {
        .client = rq->client, .body = rq->body ? rq->body : "", .body_len = rq->body_len, .idempotency_key = key};
    memset(out, 0, sizeof *out);
    if (!key || store_find_repeat(context->store, &request, out) != STORE_OK)
        return false;
    memcpy(rq->job_id, out->id, sizeof rq->job_id);
    return true;
}

/* The uploads that it names must be the client's. */
static bool check_uploads(api *context, const http_request *rq, const codec_request *request, problem_details *problem)
{
    upload_info info;
    for (size_t i = 0; i < request->n_uploads; i++)
        if (store_upload_get(context->store, request->uploads[i], api_sees(rq), &info) == STORE_NOT_FOUND)
            return problem_fill(
                problem, 422, "unknown_upload", "An upload is not there",
                "%.64s names no upload of yours on this server: send the text to POST /v1/uploads first",
                request->uploads[i]);
    return true;
}

/* ---- "warm_start": {"job": ...} against the store, before the request becomes a job. The other job may still be
 * deleted before this one runs; the run then begins at zero. */

/* 422 at a member of warm_start. */
static bool refuse(problem_details *problem, const char *member, const char *code, const char *detail)
{
    problem_fill(problem, 422, code, "The start cannot be used", "%s", detail);
    snprintf(problem->pointer, sizeof problem->pointer, "/solver/warm_start/%s", member);
    return false;
}

static bool refuse_store(api *context, const codec_start *start, store_status status, problem_details *problem)
{
    if (status != STORE_DAMAGED)
        return api_store_failed(context, problem);
    codec_problem_damaged(problem, start->job);
    return false;
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
    status = starts_reactions(context->store, start->job, number, &r, &count);
    const bool finite = r != NULL;
    free(r);
    if (status != STORE_OK && status != STORE_NOT_FOUND)
        return refuse_store(context, start, status, problem);
    if (!finite)
        return refuse(problem, "job", "not_allowed", "/solver/warm_start/job: this job ended without reactions");
    if (!codec_request_is_light(request)) /* the run looks at it */
        return true;
    if (!codec_request_sizes(request, &m, &n_u, problem))
        return false;
    if (count == m)
        return true;
    snprintf(text, sizeof text,
             "/solver/warm_start/job: that job has %lld contact rows, this problem has %lld: they must be as many",
             (long long)count, (long long)m);
    return refuse(problem, "job", "size_mismatch", text);
}

/* What a request says of the job it starts from, against the store. False: *problem. */
static bool check_start(api *context, const codec_request *request, const http_request *rq, problem_details *problem)
{
    const codec_start *start = &request->start;
    char *body = NULL;
    size_t len = 0;
    job other = {0};
    if (!start->job[0])
        return true;
    store_status status = api_get_job(context, rq, start->job, &other);
    const bool ended = status == STORE_OK && jobs_ended(&other), answered = ended && other.summary;
    status = status == STORE_OK && other.damaged ? STORE_DAMAGED : status;
    job_clear(&other);
    if (!answered && status == STORE_NOT_FOUND)
        return refuse(problem, "job", "not_allowed", "/solver/warm_start/job: there is no job with this id");
    if (!answered && status != STORE_OK)
        return refuse_store(context, start, status, problem);
    if (!answered)
        return refuse(problem, "job", "not_allowed",
                      ended ? "/solver/warm_start/job: this job ended without an answer"
                            : "/solver/warm_start/job: this job has not ended");
    if (!start->continued)
        return check_reactions(context, request, problem);
    /* A run that goes on with another problem would be another run. */
    if (start->case_name[0])
        return refuse(problem, "case", "not_allowed",
                      "/solver/warm_start/case: a run is continued with all its cases; leave this out");
    status = store_get_body(context->store, start->job, &body, &len);
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

/* ---- POST /v1/jobs */

void jobs_submit(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    codec_request request = {0};
    job j = {0};
    char *key = NULL;
    const uint64_t since = feed_last(work_feed(context->work));
    const char *validate = target_value(&rq->target, "validate");
    const bool validate_only = validate && strcmp(validate, "true") == 0;
    bool good = !validate || validate_only || strcmp(validate, "false") == 0;
    if (!good)
        REFUSE_PARAMETER(&problem, "validate must be true or false");
    good = good && read_key(rq, &key, &problem) &&
           codec_decode_kept(&request, CODEC_SOLVE, rq->body ? rq->body : "", rq->body_len, context->store,
                             context->meshes, &problem) &&
           check_uploads(context, rq, &request, &problem) && check_start(context, &request, rq, &problem) &&
           check_allowed(context, rq, request.webhook, request.priority, &problem);
    char *mistakes = !good && validate_only ? codec_mistakes(rq->body ? rq->body : "", rq->body_len) : NULL;
    if (mistakes) {
        reply_mistakes(reply, mistakes);
    } else if (!good) {
        /* a problem, or the job that the request became when it came before */
        if (!find_repeat(context, rq, validate_only ? NULL : key, &j))
            reply_problem(reply, &problem);
        else
            jobs_wait_then(context, rq, &j, since, jobs_acknowledge, reply);
    } else if (validate_only) {
        uz_prediction predicted;
        api_asker asker = {context, rq};
        codec_request_strip(&request); /* the process decodes again, as a worker's below */
        const work_request asked = {.text = rq->body,
                                    .len = rq->body_len,
                                    .uploads = (const char(*)[65])request.uploads,
                                    .n_uploads = request.n_uploads,
                                    .is_over = api_is_over,
                                    .asker = &asker};
        const bool known = work_predict(context->work, &asked, &predicted);
        reply_json(reply, 200, codec_encode_valid(known ? &predicted : NULL));
    } else {
        codec_request_strip(&request); /* the worker decodes again: nothing decoded waits here while the client does */
        store_request stored = kept_request(context, rq, &request, rq->body, rq->body_len, key);
        if (store_job(context, rq, &stored, &j, reply))
            jobs_wait_then(context, rq, &j, since, jobs_acknowledge, reply);
    }
    job_clear(&j);
    codec_request_clear(&request);
    free(key);
}

/* ---- verify: a job like any other, whose result is the answer to the call where it comes in time */

static const double VERIFY_WAIT_S = 30.0; /* where the request does not say; openapi.json says so */

void verify_submit(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0}, error = {0};
    codec_request request = {0};
    job j = {0};
    char *key = NULL;
    bool there;
    if (!read_key(rq, &key, &problem) ||
        !codec_decode(&request, CODEC_VERIFY, rq->body ? rq->body : "", rq->body_len, context->store, &problem) ||
        !check_uploads(context, rq, &request, &problem)) {
        there = find_repeat(context, rq, key, &j);
        if (!there)
            reply_problem(reply, &problem);
    } else {
        codec_request_strip(&request);
        store_request stored = kept_request(context, rq, &request, rq->body, rq->body_len, key);
        there = store_job(context, rq, &stored, &j, reply);
    }
    if (!there || !jobs_wait(context, rq, VERIFY_WAIT_S, &j, reply))
        goto done;
    if (!jobs_ended(&j))
        jobs_acknowledge(context, &j, reply);
    else if (j.status != JOB_FAILED) {
        if (results_exist(&j, reply))
            results_reply(context, &j, reply);
    } else if (j.error && codec_decode_problem(&error, j.error) && error.status >= 400) {
        reply_problem(reply, &error); /* what kept the answer from being certified is an error in the request */
    } else {
        reply_refuse(reply, 500, "internal", "A fault of this service", "the job failed and left no reason");
    }
done:
    job_clear(&j);
    codec_request_clear(&request);
    free(key);
}

/* ---- refine: a job that goes on where another one stopped */

/* False with a 409: a job whose only answer is that there is none can't be refined. */
static bool has_reactions(api *context, const job *j, http_reply *reply)
{
    double *r = NULL;
    int64_t count = 0;
    const store_status status = starts_reactions(context->store, j->id, 0, &r, &count);
    const bool finite = status != STORE_OK || r != NULL;
    free(r);
    if (status != STORE_OK && status != STORE_NOT_FOUND) /* with cases the job itself has none */
        reply_store_failure(context, status, reply);
    else if (!finite)
        reply_refuse(reply, 409, "no_result", "The job has no result",
                     "the problem is infeasible or out of reach: no accuracy makes it feasible");
    else
        return true;
    return false;
}

/* The body of the new job and what the store keeps beside it, checked as any other; NULL in *body: refused. */
static void make_request(api *context, const http_request *rq, const job *old, const char *old_body, size_t old_len,
                         char **body, size_t *len, codec_request *request, http_reply *reply)
{
    static const char SOLVER[] = "/solver";
    const size_t skip = sizeof SOLVER - 1;
    problem_details problem = {0};
    *body = codec_refine(old_body, old_len, old->id, rq->body ? rq->body : "", rq->body_len, len, &problem);
    if (*body && codec_decode(request, CODEC_SOLVE, *body, *len, context->store, &problem) &&
        check_uploads(context, rq, request, &problem)) {
        codec_request_strip(request);
        return;
    }
    /* pointers of the made request, seen from the one that it was made from */
    if (strncmp(problem.pointer, SOLVER, skip) == 0) {
        memmove(problem.pointer, problem.pointer + skip, strlen(problem.pointer + skip) + 1);
        if (strncmp(problem.detail, SOLVER, skip) == 0)
            memmove(problem.detail, problem.detail + skip, strlen(problem.detail + skip) + 1);
    }
    reply_problem(reply, &problem);
    free(*body);
    *body = NULL;
}

static void refine_as(api *context, http_request *rq, const codec_request *made, const char *body, size_t len,
                      const char *key, const char *refines, uint64_t since, http_reply *reply)
{
    store_request request = kept_request(context, rq, made, body, len, key);
    job new = {0};
    request.refines = refines;
    if (store_job(context, rq, &request, &new, reply))
        jobs_wait_then(context, rq, &new, since, jobs_acknowledge, reply);
    job_clear(&new);
}

void jobs_refine(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    job old = {0};
    char *key = NULL;
    const uint64_t since = feed_last(work_feed(context->work));
    if (!read_key(rq, &key, &problem))
        reply_problem(reply, &problem);
    else if (jobs_load(context, rq, &old, reply) && results_exist(&old, reply) && has_reactions(context, &old, reply)) {
        char *old_body = NULL, *body = NULL;
        codec_request made = {0};
        size_t old_len = 0, len = 0;
        double *cells = NULL;
        int64_t n_cells = 0;
        store_status status = store_get_body(context->store, old.id, &old_body, &old_len);
        if (status != STORE_OK) {
            reply_store_failure(context, status, reply);
        } else if (json_member_text(old_body, old_len, "answer", &len)) {
            reply_refuse(reply, 409, "not_solved_here", "The job solved nothing",
                         "it certified an answer that was given to it, and there is no run to continue");
        } else if (store_get_vector(context->store, old.id, 0, "cells", &cells, &n_cells) == STORE_OK) {
            /* A run on a grid that nobody gave can't go on: another accuracy asks for another grid. */
            reply_refuse(
                reply, 409, "mesh_is_chosen", "The job chose its mesh",
                "its mesh was made for its accuracy: send the problem again with another accuracy, or a box with the "
                "cells of this job's summary");
        } else {
            make_request(context, rq, &old, old_body, old_len, &body, &len, &made, reply);
            free(old_body); /* as large as the new one: not kept while the client waits */
            old_body = NULL;
            if (body)
                refine_as(context, rq, &made, body, len, key, old.id, since, reply);
        }
        free(cells);
        free(old_body);
        free(body);
        codec_request_clear(&made);
    }
    job_clear(&old);
    free(key);
}
