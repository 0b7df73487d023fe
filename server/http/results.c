/* results.c: what a job leaves behind: /v1/jobs/{id}/result. */
#include "codec/codec.h"
#include "http/jobs.h"
#include "http/negotiate.h"
#include "options.h"
#include "http/problem.h"
#include "http/request.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------------ result */

typedef struct {
    bool reactions, gaps, displacements, pressure;
    bool part;           /* only entries from .. from + count - 1 of each */
    int64_t from, count; /* an entry is a contact row, or a node (of matrices: a dof) */
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

/* A part of every field: from, and how many. */
static bool read_part(const http_request *rq, wanted *out, problem_details *problem)
{
    out->from = 0;
    out->count = INT64_MAX;
    out->part = target_value(&rq->target, "from") || target_value(&rq->target, "count");
    return request_integer(rq, "from", 0, INT64_MAX, &out->from, problem) &&
           request_integer(rq, "count", 0, INT64_MAX, &out->count, problem);
}

bool results_exist(const job *j, http_reply *reply)
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

/* A job, and which of its cases: number 0 is the job itself. */
typedef struct {
    const job *j;
    int64_t number;
    const char *name, *summary;
} place;

/* A vector that the result does not have stays NULL. */
static store_status fetch(api *context, const place *at, const char *name, double **data, int64_t *count)
{
    store_status status = store_get_vector(context->store, at->j->id, at->number, name, data, count);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* What each case has of its own. */
static store_status fetch_own(api *context, const place *at, const wanted *fields, vectors *v)
{
    store_status status = STORE_OK;
    if (fields->reactions)
        status = fetch(context, at, "reactions", &v->reactions, &v->n_reactions);
    if (status == STORE_OK && fields->gaps)
        status = fetch(context, at, "gaps", &v->gaps, &v->n_gaps);
    if (status == STORE_OK && fields->reactions)
        status = fetch(context, at, "ray", &v->ray, &v->n_ray);
    if (status == STORE_OK && fields->pressure)
        status = fetch(context, at, "pressure", &v->pressure, &v->n_pressure);
    if (status == STORE_OK && fields->displacements)
        status = fetch(context, at, "displacements", &v->displacements, &v->n_u);
    return status;
}

/* What the job has once, for all its cases. */
static store_status fetch_shared(api *context, const job *j, const wanted *fields, vectors *v)
{
    const place whole = {.j = j};
    store_status status = fetch(context, &whole, "dim", &v->dim, &v->n_dim);
    if (status == STORE_OK && (fields->reactions || fields->gaps || fields->pressure))
        status = fetch(context, &whole, "contact_nodes", &v->contact_nodes, &v->n_contact_nodes);
    if (status == STORE_OK && fields->displacements)
        status = fetch(context, &whole, "nodes", &v->nodes, &v->n_nodes);
    return status;
}

/* Leaves entries lo .. lo + *n - 1 of *x, each of `size` numbers; *n numbers before and after. */
static void cut(const double **x, int64_t *n, int64_t size, const wanted *fields)
{
    int64_t entries = *n / size, lo = fields->from < entries ? fields->from : entries;
    int64_t left = fields->count < entries - lo ? fields->count : entries - lo;
    if (*x)
        *x += lo * size;
    *n = left * size;
}

static void cut_all(codec_result *r, const wanted *fields)
{
    const double **rows[] = {&r->gaps, &r->pressure, &r->ray, &r->contact_nodes, &r->reactions};
    int64_t size = r->dim > 0 ? r->dim : 1, m = r->m;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        r->m = m;
        cut(rows[i], &r->m, 1, fields);
    }
    cut(&r->displacements, &r->n_u, size, fields);
    cut(&r->nodes, &r->n_nodes, size, fields);
    r->part = true;
    r->from = fields->from;
}

static codec_result as_encoded(const place *at, const vectors *own, const vectors *shared, const wanted *fields)
{
    codec_result r = {.job_id = at->j->id,
                      .summary = at->summary,
                      .case_name = at->name,
                      .dim = shared->dim && shared->n_dim == 1 ? (int)shared->dim[0] : 0,
                      .m = own->reactions  ? own->n_reactions
                           : own->gaps     ? own->n_gaps
                           : own->pressure ? own->n_pressure
                                           : shared->n_contact_nodes,
                      .n_u = own->n_u,
                      .n_nodes = shared->n_nodes,
                      .reactions = own->reactions,
                      .gaps = own->gaps,
                      .pressure = own->pressure,
                      .ray = own->ray,
                      .displacements = own->displacements,
                      .nodes = shared->nodes,
                      .contact_nodes = shared->contact_nodes};
    if (fields->part)
        cut_all(&r, fields);
    return r;
}

static void reply_one(api *context, const place *at, const wanted *fields, http_reply *reply)
{
    vectors own = {0}, shared = {0};
    size_t len = 0;
    store_status status = fetch_shared(context, at->j, fields, &shared);
    if (status == STORE_OK)
        status = fetch_own(context, at, fields, &own);
    if (status == STORE_OK) {
        codec_result result = as_encoded(at, &own, &shared, fields);
        char *text = codec_encode_result(&result, &len);
        reply_text(reply, 200, "application/json", text, len);
    } else {
        reply_store_failure(context, status, reply);
    }
    vectors_free(&own);
    vectors_free(&shared);
}

/* ------------------------------------------------------- many cases in one */

/* Numbers of all cases in one reply, about 20 bytes each: one reply must not fill the machine. openapi.json says so. */
#define MOST_NUMBERS 4000000

/* False with a 413, or a failure of the store. */
static bool check_room(api *context, const job *j, size_t cases, const wanted *fields, http_reply *reply)
{
    const struct {
        bool wanted;
        const char *name;
    } LIST[] = {{fields->reactions, "reactions"},
                {fields->gaps, "gaps"},
                {fields->pressure, "pressure"},
                {fields->displacements, "displacements"}};
    int64_t total = 0;
    for (size_t i = 0; i < sizeof LIST / sizeof LIST[0]; i++) {
        int64_t count = 0;
        store_status status =
            LIST[i].wanted ? store_count_vectors(context->store, j->id, LIST[i].name, &count) : STORE_OK;
        if (status != STORE_OK) {
            reply_store_failure(context, status, reply);
            return false;
        }
        /* an entry has at most 3 numbers */
        int64_t most = fields->part && fields->count < MOST_NUMBERS ? 3 * (int64_t)cases * fields->count : count;
        total += most < count ? most : count;
    }
    if (total > MOST_NUMBERS)
        reply_refuse(
            reply, 413, "result_too_large", "The result is too large for one reply",
            "all cases together have %lld numbers, a reply has at most %d: ask for one case with ?case=NAME, or "
            "for fewer fields",
            (long long)total, MOST_NUMBERS);
    return total <= MOST_NUMBERS;
}

static store_status add_case(api *context, codec_results *all, const place *at, const wanted *fields,
                             const vectors *shared)
{
    vectors own = {0};
    store_status status = fetch_own(context, at, fields, &own);
    codec_result one = as_encoded(at, &own, shared, fields);
    if (status == STORE_OK)
        codec_results_add(all, &one);
    vectors_free(&own);
    return status;
}

static void reply_cases(api *context, const job *j, const store_case *cases, size_t count, const wanted *fields,
                        http_reply *reply)
{
    vectors shared = {0};
    size_t len = 0;
    const place whole = {.j = j, .summary = j->summary};
    codec_results *all = codec_results_begin(j->id, j->summary);
    store_status status = fetch_shared(context, j, fields, &shared);
    for (size_t i = 0; all && status == STORE_OK && i < count; i++)
        status = add_case(context, all, &(place){j, cases[i].number, cases[i].name, cases[i].summary}, fields, &shared);
    if (status != STORE_OK) {
        codec_results_drop(all);
        reply_store_failure(context, status, reply);
    } else {
        codec_result rest = as_encoded(&whole, &(vectors){0}, &shared, fields);
        char *text = all ? codec_results_end(all, &rest, &len) : NULL;
        reply_text(reply, 200, "application/json", text, len);
    }
    vectors_free(&shared);
}

/* ------------------------------------------------------------ which of them */

/* The cases of the job, or the one that the query names; *count 0: the job has none and none is named. The caller frees
 * them. False with a 404, or a failure of the store. */
static bool load_cases(api *context, const http_request *rq, const job *j, store_case **cases, size_t *count,
                       http_reply *reply)
{
    const char *name = target_value(&rq->target, "case");
    store_status status = store_get_cases(context->store, j->id, name, cases, count);
    if (status == STORE_OK && (!name || *count > 0))
        return true;
    problem_details problem;
    if (status == STORE_OK)
        status = store_get_cases(context->store, j->id, NULL, cases, count);
    if (status == STORE_OK) {
        http_problem(&problem, 404, "case_not_found", "Not found", "the job has no case \"%.63s\".", name);
        cases_suggest(&problem, name, *cases, *count);
        cases_list(&problem, *cases, *count);
        reply_problem(reply, &problem);
    } else {
        reply_store_failure(context, status, reply);
    }
    store_cases_free(*cases, *count);
    *cases = NULL;
    *count = 0;
    return false;
}

static void reply_result(api *context, const http_request *rq, const job *j, const wanted *fields, http_reply *reply)
{
    store_case *cases = NULL;
    size_t count = 0;
    if (!load_cases(context, rq, j, &cases, &count, reply))
        return;
    if (count == 0)
        reply_one(context, &(place){.j = j, .summary = j->summary}, fields, reply);
    else if (target_value(&rq->target, "case"))
        reply_one(context, &(place){j, cases[0].number, cases[0].name, cases[0].summary}, fields, reply);
    else if (check_room(context, j, count, fields, reply))
        reply_cases(context, j, cases, count, fields, reply);
    store_cases_free(cases, count);
}

/* The answer of an ended job never changes: its name follows from which one it is and what is asked of it. */
static bool is_known(const http_request *rq, const job *j, http_reply *reply)
{
    char finished[32];
    snprintf(finished, sizeof finished, "%.6f", j->finished);
    const char *const parts[] = {UZAWAD_VERSION, j->id, finished, rq->raw_target};
    const size_t lens[] = {strlen(parts[0]), strlen(parts[1]), strlen(parts[2]), strlen(parts[3])};
    tag_make(reply->tag, parts, lens, 4);
    reply->takes_ranges = true;
    return reply_unchanged(rq, reply);
}

void results_get(api *context, http_request *rq, http_reply *reply)
{
    wanted fields;
    problem_details problem;
    job j = {0};
    if (!read_fields(rq, &fields, &problem) || !read_part(rq, &fields, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !is_known(rq, &j, reply))
        reply_result(context, rq, &j, &fields, reply);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}

void results_reply(api *context, const job *j, http_reply *reply)
{
    const wanted fields = {.reactions = true, .gaps = true};
    reply_one(context, &(place){.j = j, .summary = j->summary}, &fields, reply);
    jobs_check_still_there(context, j, reply);
}
