/* results.c: what a job leaves behind: /v1/jobs/{id}/result, /history and /history.csv. */
#include "codec/codec.h"
#include "http/problem.h"
#include "http/request.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------------ result */

typedef struct {
    bool reactions, gaps, displacements, pressure;
} wanted;

static bool want_field(wanted *out, const char *name, size_t len)
{
    if (token_equal(name, len, "reactions"))
        out->reactions = true;
    else if (token_equal(name, len, "gaps"))
        out->gaps = true;
    else if (token_equal(name, len, "displacements"))
        out->displacements = true;
    else if (token_equal(name, len, "pressure"))
        out->pressure = true;
    else
        return token_equal(name, len, "summary");
    return true;
}

static bool read_fields(const http_request *rq, wanted *out, problem_details *problem)
{
    const char *at = target_value(&rq->target, "fields");
    memset(out, 0, sizeof *out);
    if (!at) {
        out->reactions = out->gaps = true;
        return true;
    }
    for (;;) {
        size_t len = strcspn(at, ",");
        if (!want_field(out, at, len))
            return http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                                "\"%.*s\" is no field of a result: fields is a list of summary, reactions, gaps, "
                                "pressure, displacements, separated by commas",
                                (int)(len < 60 ? len : 60), at);
        if (at[len] == '\0')
            return true;
        at += len + 1;
    }
}

/* A job without an answer: 409 that says why. */
static bool has_result(const job *j, http_reply *reply)
{
    static const char TITLE[] = "The job has no result";
    problem_details error = {0};
    if (j->status == JOB_ACCEPTED || j->status == JOB_RUNNING) {
        reply->retry_after_s = 1;
        reply_refuse(reply, 409, "not_ended", "The job has not ended",
                     "the job is %s: ask again later, or wait with \"Prefer: wait=30\" on /v1/jobs/%s",
                     job_status_name(j->status), j->id);
        return false;
    }
    if (j->status == JOB_FAILED) {
        bool known = j->error && codec_decode_problem(&error, j->error);
        problem_details problem;
        http_problem(&problem, 409, "job_failed", TITLE, "the job failed: %s", known ? error.detail : "see its error");
        if (known) {
            snprintf(problem.detail, sizeof problem.detail, "the job failed: %.480s", error.detail);
            memcpy(problem.pointer, error.pointer, sizeof problem.pointer);
            problem.line = error.line;
        }
        reply_problem(reply, &problem);
        return false;
    }
    if (j->summary)
        return true;
    reply_refuse(reply, 409, "no_result", TITLE, "the job was dismissed before there was an answer");
    return false;
}

typedef struct {
    double *reactions, *gaps, *pressure, *ray, *displacements, *nodes, *contact_nodes, *dim;
    int64_t n_pressure, n_ray, n_reactions, n_gaps, n_u, n_nodes, n_contact_nodes, n_dim;
} vectors;

static void vectors_free(vectors *v)
{
    free(v->reactions);
    free(v->gaps);
    free(v->pressure);
    free(v->ray);
    free(v->displacements);
    free(v->nodes);
    free(v->contact_nodes);
    free(v->dim);
}

/* A vector that the result does not have stays NULL. */
static store_status fetch(api *context, const char *id, const char *name, double **data, int64_t *count)
{
    store_status status = store_get_vector(context->store, id, name, data, count);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static store_status fetch_wanted(api *context, const char *id, const wanted *fields, vectors *v)
{
    store_status status = fetch(context, id, "dim", &v->dim, &v->n_dim);
    if (status == STORE_OK && fields->reactions)
        status = fetch(context, id, "reactions", &v->reactions, &v->n_reactions);
    if (status == STORE_OK && fields->gaps)
        status = fetch(context, id, "gaps", &v->gaps, &v->n_gaps);
    if (status == STORE_OK && fields->reactions)
        status = fetch(context, id, "ray", &v->ray, &v->n_ray);
    if (status == STORE_OK && fields->pressure)
        status = fetch(context, id, "pressure", &v->pressure, &v->n_pressure);
    if (status == STORE_OK && (fields->reactions || fields->gaps || fields->pressure))
        status = fetch(context, id, "contact_nodes", &v->contact_nodes, &v->n_contact_nodes);
    if (status == STORE_OK && fields->displacements)
        status = fetch(context, id, "displacements", &v->displacements, &v->n_u);
    if (status == STORE_OK && fields->displacements)
        status = fetch(context, id, "nodes", &v->nodes, &v->n_nodes);
    return status;
}

static void encode_result(const job *j, const vectors *v, http_reply *reply)
{
    codec_result result = {.job_id = j->id,
                           .summary = j->summary,
                           .dim = v->dim && v->n_dim == 1 ? (int)v->dim[0] : 0,
                           .m = v->reactions ? v->n_reactions
                                : v->gaps    ? v->n_gaps
                                             : v->n_pressure,
                           .n_u = v->n_u,
                           .n_nodes = v->n_nodes,
                           .reactions = v->reactions,
                           .gaps = v->gaps,
                           .pressure = v->pressure,
                           .ray = v->ray,
                           .displacements = v->displacements,
                           .nodes = v->nodes,
                           .contact_nodes = v->contact_nodes};
    size_t len = 0;
    char *text = codec_encode_result(&result, &len);
    reply_text(reply, 200, "application/json", text, len);
}

void results_get(api *context, http_request *rq, http_reply *reply)
{
    wanted fields;
    problem_details problem;
    vectors v = {0};
    job j = {0};
    if (!read_fields(rq, &fields, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    if (jobs_load(context, rq, &j, reply) && has_result(&j, reply)) {
        store_status status = fetch_wanted(context, j.id, &fields, &v);
        if (status == STORE_OK)
            encode_result(&j, &v, reply);
        else
            reply_store_failure(context, status, reply);
    }
    vectors_free(&v);
    job_clear(&j);
}

/* ----------------------------------------------------------------- history */

/* The rows of a running job are with its worker, those of an ended one in the store; a job may end in between, and one
 * that waits has none. */
static store_status fetch_history(api *context, const job *j, int64_t after, double **rows, int64_t *count)
{
    int64_t columns = 0;
    *rows = NULL;
    *count = 0;
    if (j->status == JOB_RUNNING && work_live(context->work, j->id, after, &(int){0}, rows, count))
        return STORE_OK;
    if (j->status == JOB_ACCEPTED)
        return STORE_OK;
    store_status status = store_get_history(context->store, j->id, after, rows, count, &columns);
    if (status == STORE_OK && *count > 0 && columns != CODEC_HISTORY_COLUMNS) {
        free(*rows);
        *rows = NULL;
        *count = 0;
        return STORE_ERROR;
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

static void reply_history(api *context, http_request *rq, bool csv, http_reply *reply)
{
    int64_t after = -1, count = 0;
    double *rows = NULL;
    size_t len = 0;
    problem_details problem;
    job j = {0};
    if (!request_integer(rq, "after", -1, INT64_MAX, &after, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    if (!jobs_load(context, rq, &j, reply))
        return;
    store_status status = fetch_history(context, &j, after, &rows, &count);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
    } else if (csv) {
        char *text = codec_encode_history_csv(rows, count, &len);
        reply_text(reply, 200, "text/csv; charset=utf-8; header=present", text, len);
    } else {
        char *text = codec_encode_history(rows, count, &len);
        reply_text(reply, 200, "application/json", text, len);
    }
    free(rows);
    job_clear(&j);
}

void history_get(api *context, http_request *rq, http_reply *reply)
{
    reply_history(context, rq, request_accepts(rq, "text/csv"), reply);
}

void history_get_csv(api *context, http_request *rq, http_reply *reply)
{
    reply_history(context, rq, true, reply);
}
