/* results.c: what a job leaves behind: /v1/jobs/{id}/result, and which of its cases is meant. */
#include "codec/codec.h"
#include "codec/text.h"
#include "http/api.h"
#include "http/fields.h"
#include "http/jobs.h"
#include "http/results.h"
#include "options/options.h"
#include "text/edit_distance.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ------------------------------------------------------------------ result */

#define BY_DEFAULT ((unsigned)(UZ_FIELD_REACTIONS | UZ_FIELD_GAPS))
#define BY_ROW     ((unsigned)(UZ_FIELD_REACTIONS | UZ_FIELD_GAPS | UZ_FIELD_PRESSURE | UZ_FIELD_CONTACT_STATUS))
#define BY_NODE                                                                                                        \
    ((unsigned)(UZ_FIELD_DISPLACEMENTS | UZ_FIELD_STRESS | UZ_FIELD_PRINCIPAL | UZ_FIELD_VON_MISES | UZ_FIELD_STRAIN))

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
        problem_fill(&problem, 409, "job_failed", TITLE, "the job failed: %s", known ? error.detail : "see its error");
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

/* Vectors of the store and the fields that need them: what each case has of its own, then what the job has once. */
enum { REACTIONS, GAPS, RAY, PRESSURE, DISPLACEMENTS, OWN_NODES, DIM, CONTACT_NODES, NODES, VECTORS };
static const struct {
    const char *name;
    unsigned fields; /* 0: all */
} VECTOR[VECTORS] = {{"reactions", UZ_FIELD_REACTIONS},
                     {"gaps", UZ_FIELD_GAPS},
                     {"ray", UZ_FIELD_REACTIONS},
                     {"pressure", UZ_FIELD_PRESSURE},
                     {"displacements", UZ_FIELD_DISPLACEMENTS},
                     {"contact_nodes", BY_ROW}, /* of a case with rows of its own */
                     {"dim", 0},
                     {"contact_nodes", BY_ROW},
                     {"nodes", BY_NODE}};
typedef struct {
    double *x[VECTORS];
    int64_t n[VECTORS];
} vectors;

static void vectors_free(vectors *v)
{
    for (int i = 0; i < VECTORS; i++)
        free(v->x[i]);
}

/* A job, and which of its cases: number 0 is the job itself. */
typedef struct {
    const job *j;
    int64_t number;
    const char *name, *summary;
} place;

/* The vectors first .. last that the fields need; one that the result does not have stays NULL. */
static store_status fetch(api *context, const place *at, const field_list *fields, vectors *v, int first, int last)
{
    store_status status = STORE_OK;
    for (int i = first; i <= last && status == STORE_OK; i++) {
        if (VECTOR[i].fields && !(fields->which & VECTOR[i].fields) && !(i == NODES && fields->nodes))
            continue;
        status =
            store_get_vector(context->store, at->j->id, i < DIM ? at->number : 0, VECTOR[i].name, &v->x[i], &v->n[i]);
        if (status == STORE_NOT_FOUND)
            status = STORE_OK;
    }
    return status;
}

/* Leaves entries from .. from + count - 1 of *x, each of `size` numbers; *n numbers before and after. */
static void cut(const double **x, int64_t *n, int64_t size, const field_list *fields)
{
    int64_t entries = *n / size, lo = fields->from < entries ? fields->from : entries;
    int64_t left = fields->count < entries - lo ? fields->count : entries - lo;
    if (*x)
        *x += lo * size;
    *n = left * size;
}

/* The same of what was computed: a view that owns nothing. Gauss points are told whole. */
static uz_fields cut_computed(const uz_fields *computed, const field_list *fields)
{
    uz_fields view = *computed;
    const int64_t k = view.components, m = view.m, nodes = view.n_nodes;
    const struct {
        double **x;
        int64_t *left, entries, size;
    } LIST[] = {{&view.pressure, &view.m, m, 1},
                {&view.contact_status, &view.m, m, 1},
                {&view.stress, &view.n_nodes, nodes, k},
                {&view.principal, &view.n_nodes, nodes, 3},
                {&view.von_mises, &view.n_nodes, nodes, 1},
                {&view.strain, &view.n_nodes, nodes, k}};
    for (size_t i = 0; fields->part && i < sizeof LIST / sizeof LIST[0]; i++) {
        const double *x = *LIST[i].x;
        int64_t n = LIST[i].entries * LIST[i].size;
        if (!x) /* not asked for; without any of them a stress has no components either */
            continue;
        cut(&x, &n, LIST[i].size, fields);
        *LIST[i].x = (double *)x;
        *LIST[i].left = n / LIST[i].size;
    }
    return view;
}

/* computed: may be NULL. */
static codec_result as_encoded(const place *at, const vectors *own, const vectors *shared, const uz_fields *computed,
                               const field_list *fields)
{
    codec_result r = {.job_id = at->j->id,
                      .summary = at->summary,
                      .case_name = at->name,
                      .dim = shared->x[DIM] && shared->n[DIM] == 1 ? (int)shared->x[DIM][0] : 0,
                      .m = own->x[REACTIONS]   ? own->n[REACTIONS]
                           : own->x[GAPS]      ? own->n[GAPS]
                           : own->x[PRESSURE]  ? own->n[PRESSURE]
                           : own->x[OWN_NODES] ? own->n[OWN_NODES]
                                               : shared->n[CONTACT_NODES],
                      .n_u = own->n[DISPLACEMENTS],
                      .n_nodes = shared->n[NODES],
                      .reactions = own->x[REACTIONS],
                      .gaps = own->x[GAPS],
                      .pressure = own->x[PRESSURE],
                      .ray = own->x[RAY],
                      .fields = computed,
                      .displacements = own->x[DISPLACEMENTS],
                      .nodes = shared->x[NODES],
                      .contact_nodes = own->x[OWN_NODES] ? own->x[OWN_NODES] : shared->x[CONTACT_NODES],
                      .own_rows = own->x[OWN_NODES] != NULL};
    if (r.m != (own->x[OWN_NODES] ? own->n[OWN_NODES] : shared->n[CONTACT_NODES]))
        r.contact_nodes = NULL;
    if (fields->part) {
        const double **rows[] = {&r.gaps, &r.pressure, &r.ray, &r.contact_nodes, &r.reactions};
        int64_t size = r.dim > 0 ? r.dim : 1, m = r.m;
        for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
            r.m = m;
            cut(rows[i], &r.m, 1, fields);
        }
        cut(&r.displacements, &r.n_u, size, fields);
        cut(&r.nodes, &r.n_nodes, size, fields);
        r.part = true;
        r.from = fields->from;
    }
    return r;
}

/* A form of the answer of one case. */
typedef struct {
    const char *type;
    char *(*encode)(const codec_result *result, size_t *len);
} form;
static const form AS_JSON = {"application/json", codec_encode_result},
                  AS_ARRAYS = {"application/zip", codec_encode_result_npz};

/* rq may be NULL where nothing is to be computed. */
static void reply_one(api *context, const http_request *rq, const place *at, const field_list *fields, const form *as,
                      http_reply *reply)
{
    const unsigned which = fields->which & COMPUTED;
    uz_fields computed = {.dim = 0};
    field_reader reader;
    vectors own = {.n = {0}}, shared = {.n = {0}};
    size_t len = 0;
    if (which) {
        const bool done = fields_open(&reader, context, rq, at->j, reply) &&
                          fields_compute(&computed, fields_of_case, &reader, at->number, which, reply);
        fields_close(&reader);
        if (!done) {
            uz_fields_clear(&computed);
            return;
        }
    }
    store_status status = fetch(context, at, fields, &shared, DIM, NODES);
    if (status == STORE_OK)
        status = fetch(context, at, fields, &own, REACTIONS, OWN_NODES);
    if (status == STORE_OK) {
        const uz_fields part = cut_computed(&computed, fields);
        codec_result result = as_encoded(at, &own, &shared, which ? &part : NULL, fields);
        char *body = as->encode(&result, &len);
        reply_text(reply, 200, as->type, body, len);
    } else {
        reply_store_failure(context, status, reply);
    }
    vectors_free(&own);
    vectors_free(&shared);
    uz_fields_clear(&computed);
}

/* ------------------------------------------------------- many cases in one */

/* Numbers of all cases in one reply, about 20 bytes each: one reply must not fill the machine. openapi.json says so. */
#define MOST_NUMBERS 4000000

/* False with a 413, or a failure of the store. Numbers that are computed are counted with the first case of which they
 * are: `more`. */
static bool check_room(api *context, const job *j, size_t cases, const field_list *fields, int64_t more,
                       http_reply *reply)
{
    int64_t total = more;
    for (unsigned bit = 1; bit <= STORED; bit <<= 1) {
        int64_t count = 0;
        store_status status = fields->which & STORED & bit
                                  ? store_count_vectors(context->store, j->id, uz_field_name((uz_field)bit), &count)
                                  : STORE_OK;
        if (status != STORE_OK) {
            reply_store_failure(context, status, reply);
            return false;
        }
        /* an entry has at most 3 numbers */
        int64_t most = fields->part && fields->count < MOST_NUMBERS ? 3 * (int64_t)cases * fields->count : count;
        total += most < count ? most : count;
    }
    if (total > MOST_NUMBERS)
        reply_refuse(reply, 413, "result_too_large", "The result is too large for one reply",
                     "all cases together have %lld numbers, a reply has at most %d: ask for one case with ?case=NAME, "
                     "or for fewer fields",
                     (long long)total, MOST_NUMBERS);
    return total <= MOST_NUMBERS;
}

/* All cases of a job in one reply. */
static void reply_cases(api *context, const http_request *rq, const job *j, const store_case *cases, size_t count,
                        const field_list *fields, http_reply *reply)
{
    const place whole = {.j = j, .summary = j->summary};
    const unsigned which = fields->which & COMPUTED;
    vectors shared = {.n = {0}};
    field_reader reader = {.j = NULL}; /* where something is computed */
    text t = {0};
    size_t len = 0;
    store_status status = fetch(context, &whole, fields, &shared, DIM, NODES);
    if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    bool done = status == STORE_OK && (!which || fields_open(&reader, context, rq, j, reply));
    text_open(&t, NULL, '{');
    text_string(&t, "job", j->id);
    text_raw(&t, "summary", j->summary);
    text_open(&t, "cases", '[');
    for (size_t i = 0; done && !t.failed && i < count; i++) {
        const place at = {j, cases[i].number, cases[i].name, cases[i].summary};
        vectors own = {.n = {0}};
        uz_fields computed = {.dim = 0};
        done = !which || fields_compute(&computed, fields_of_case, &reader, at.number, which, reply);
        if (done && which && i == 0) {
            const uz_fields *f = &computed;
            const int64_t k = f->components;
            const int64_t of_node =
                (f->stress ? k : 0) + (f->strain ? k : 0) + (f->principal ? 3 : 0) + (f->von_mises ? 1 : 0);
            const int64_t numbers =
                (f->contact_status ? f->m : 0) + f->n_nodes * of_node + f->n_points * (1 + f->dim + k);
            done = check_room(context, j, count, fields, (int64_t)count * numbers, reply);
        }
        status = done ? fetch(context, &at, fields, &own, REACTIONS, OWN_NODES) : STORE_OK;
        if (status != STORE_OK) {
            reply_store_failure(context, status, reply);
            done = false;
        }
        const uz_fields part = cut_computed(&computed, fields);
        codec_result one = as_encoded(&at, &own, &shared, &part, fields);
        if (done)
            codec_put_case(&t, &one);
        vectors_free(&own);
        uz_fields_clear(&computed);
    }
    if (done) {
        const codec_result rest = as_encoded(&whole, &(vectors){.n = {0}}, &shared, NULL, fields);
        text_close(&t, ']');
        codec_put_places(&t, &rest);
        text_close(&t, '}');
        char *body = text_finish(&t, &len);
        reply_text(reply, 200, "application/json", body, len);
    }
    free(t.data); /* NULL after the end */
    if (which)
        fields_close(&reader);
    vectors_free(&shared);
}

/* ------------------------------------------------------------ which of them */

/* The cases of the job, or the one of this name; *count 0: the job has none and none is named. The caller frees them.
 * False with a 404, or a failure of the store. */
static bool find_cases(api *context, const job *j, const char *name, store_case **cases, size_t *count,
                       http_reply *reply)
{
    store_status status = store_get_cases(context->store, j->id, name, cases, count);
    if (status == STORE_OK && (!name || *count > 0))
        return true;
    problem_details problem;
    if (status == STORE_OK)
        status = store_get_cases(context->store, j->id, NULL, cases, count);
    if (status == STORE_OK) {
        problem_fill(&problem, 404, "case_not_found", "Not found", "the job has no case \"%.63s\".", name);
        cases_list(&problem, name, *cases, *count);
        reply_problem(reply, &problem);
    } else {
        reply_store_failure(context, status, reply);
    }
    store_cases_free(*cases, *count);
    *cases = NULL;
    *count = 0;
    return false;
}

bool results_one(results_place *out, api *context, const job *j, const char *name, const char *what, http_reply *reply)
{
    *out = (results_place){.summary = j->summary};
    if (!find_cases(context, j, name, &out->cases, &out->count, reply))
        return false;
    if (out->count == 0)
        return true;
    if (!name) {
        char title[96];
        problem_details problem;
        snprintf(title, sizeof title, "Each load case has %s of its own", what);
        problem_fill(&problem, 400, "case_needed", title, "say which one with ?case=NAME.");
        cases_list(&problem, NULL, out->cases, out->count);
        reply_problem(reply, &problem);
        return false;
    }
    out->number = out->cases[0].number;
    out->name = out->cases[0].name;
    out->summary = out->cases[0].summary;
    return true;
}

bool results_known(const http_request *rq, const job *j, http_reply *reply)
{
    char finished[32];
    snprintf(finished, sizeof finished, "%.6f", j->finished);
    const char *const parts[] = {UZAWAD_VERSION, j->id, finished, rq->raw_target};
    const size_t lens[] = {strlen(parts[0]), strlen(parts[1]), strlen(parts[2]), strlen(parts[3])};
    tag_make(reply->tag, parts, lens, 4);
    reply->takes_ranges = true;
    return reply_unchanged(rq, reply);
}

/* Fields and the part of them that the query asks for. */
static bool read_query(field_list *out, const http_request *rq, http_reply *reply)
{
    problem_details problem;
    const bool good = fields_parse(out, target_value(&rq->target, "fields"), BY_DEFAULT, STORED | COMPUTED, &problem);
    out->from = 0;
    out->count = INT64_MAX;
    out->part = target_value(&rq->target, "from") || target_value(&rq->target, "count");
    if (good && request_integer(rq, "from", 0, INT64_MAX, &out->from, &problem) &&
        request_integer(rq, "count", 0, INT64_MAX, &out->count, &problem))
        return true;
    reply_problem(reply, &problem);
    return false;
}

void results_get(api *context, http_request *rq, http_reply *reply)
{
    field_list fields;
    job j = {0};
    store_case *cases = NULL;
    size_t count = 0;
    const char *name = target_value(&rq->target, "case");
    if (!read_query(&fields, rq, reply))
        return;
    if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !results_known(rq, &j, reply) &&
        find_cases(context, &j, name, &cases, &count, reply)) {
        if (count == 0)
            reply_one(context, rq, &(place){.j = &j, .summary = j.summary}, &fields, &AS_JSON, reply);
        else if (name)
            reply_one(context, rq, &(place){&j, cases[0].number, cases[0].name, cases[0].summary}, &fields, &AS_JSON,
                      reply);
        else if (check_room(context, &j, count, &fields, 0, reply))
            reply_cases(context, rq, &j, cases, count, &fields, reply);
        store_cases_free(cases, count);
    }
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}

void results_get_arrays(api *context, http_request *rq, http_reply *reply)
{
    field_list fields;
    job j = {0};
    results_place at = {.cases = NULL};
    if (!read_query(&fields, rq, reply))
        return;
    if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !results_known(rq, &j, reply) &&
        results_one(&at, context, &j, target_value(&rq->target, "case"), "a file", reply))
        reply_one(context, rq, &(place){&j, at.number, at.name, at.summary}, &fields, &AS_ARRAYS, reply);
    store_cases_free(at.cases, at.count);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}

void results_reply(api *context, const job *j, http_reply *reply)
{
    const field_list fields = {.which = BY_DEFAULT};
    reply_one(context, NULL, &(place){.j = j, .summary = j->summary}, &fields, &AS_JSON, reply);
    jobs_check_still_there(context, j, reply);
}

/* ---- names of load cases in what a client is told */

enum { NAMES_SHOWN = 10 };

/* A detail is ASCII (problem.c), so that cutting it short never cuts a character. */
static void append(problem_details *problem, const char *before, const char *name, const char *after)
{
    size_t used = strlen(problem->detail);
    snprintf(problem->detail + used, sizeof problem->detail - used, "%s%s%s", before, name, after);
    for (char *at = problem->detail + used; *at; at++)
        if ((unsigned char)*at < 0x20 || (unsigned char)*at > 0x7e)
            *at = '?';
}

void cases_list(problem_details *problem, const char *wrong, const store_case *cases, size_t count)
{
    char number[48];
    const char **names = wrong ? malloc((count + 1) * sizeof *names) : NULL;
    for (size_t i = 0; names && i < count; i++)
        names[i] = cases[i].name;
    const int closest = wrong && names ? uz_closest(wrong, strlen(wrong), names, count) : -1;
    if (closest >= 0)
        append(problem, " Did you mean \"", names[closest], "\"?");
    free(names);
    if (count == 0) {
        append(problem, " It has no cases.", "", "");
        return;
    }
    append(problem, " Its cases: ", "", "");
    for (size_t i = 0; i < count && i < NAMES_SHOWN; i++)
        append(problem, i ? ", \"" : "\"", cases[i].name, "\"");
    snprintf(number, sizeof number, ", ... (%zu in all)", count);
    append(problem, count > NAMES_SHOWN ? number : "", ".", "");
}
