#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/schema.h"
#include "codec/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Set by codec_init before threads start, only read until codec_end. */
static schemas *loaded;
/* The same for what a request may ask for at most. */
static codec_limits limits;

static const codec_limits NO_LIMITS = {JSON_MAX_DEPTH, INT64_MAX, INT64_MAX, INT64_MAX};

bool codec_init(char *message, size_t size)
{
    codec_end();
    json_object_seed(0);
    limits = NO_LIMITS;
    loaded = schemas_load(message, size);
    return loaded != NULL;
}

void codec_end(void)
{
    schemas_free(loaded);
    loaded = NULL;
}

void codec_set_limits(const codec_limits *given)
{
    limits = *given;
}

int json_depth_limit(void)
{
    return limits.json_depth > 0 ? limits.json_depth : JSON_MAX_DEPTH;
}

const schemas *decode_schemas(void)
{
    return loaded;
}

bool decode_check(const json_doc *doc, const char *schema, problem_details *problem)
{
    return schemas_check(loaded, schema, doc, problem);
}

static int http_status(uz_status status)
{
    return status == UZ_ERR_MEMORY ? 503 : status == UZ_ERR_INTERNAL || status == UZ_ERR_ARGUMENT ? 500 : 422;
}

/* Members of a request beside its problem. */
static bool points_beside(const char *where)
{
    static const char *const MEMBERS[] = {"/cases", "/solver", "/answer"};
    for (size_t i = 0; i < sizeof MEMBERS / sizeof MEMBERS[0]; i++) {
        size_t len = strlen(MEMBERS[i]);
        if (strncmp(where, MEMBERS[i], len) == 0 && (where[len] == '/' || where[len] == '\0'))
            return true;
    }
    return false;
}

/* A load case of a request has loads, p and h; an error about anything else of it is one of the body that all cases
 * share. Returns `where` without the case. */
static const char *leave_case(const char *where)
{
    static const char CASES[] = "/cases/";
    if (strncmp(where, CASES, sizeof CASES - 1) != 0)
        return where;
    const char *rest = where + sizeof CASES - 1;
    rest += strspn(rest, "0123456789");
    bool own = *rest == '\0' || strncmp(rest, "/loads", 6) == 0 || strcmp(rest, "/p") == 0 || strcmp(rest, "/h") == 0;
    return own ? where : rest;
}

/* The library names the matrices that it makes of a scene, and no request of a scene has them. Too large they are
 * because of the mesh. */
static const char *leave_matrix(const char *where, uz_status status)
{
    static const char *const NAMES[] = {"K", "N", "p", "h"};
    const char *name = where + (where[0] == '/');
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; i++)
        if (strcmp(name, NAMES[i]) == 0)
            return status == UZ_ERR_LIMIT ? "/mesh" : "";
    return where;
}

/* The library reads two formats of text and has one status for both. */
static const char *code_of(const uz_error *err)
{
    const bool gmsh = strcmp(err->where, "/mesh/gmsh") == 0;
    if (gmsh && err->status == UZ_ERR_FORMAT)
        return "gmsh_syntax";
    return gmsh && err->status == UZ_ERR_UNSUPPORTED ? "gmsh_unsupported" : uz_status_name(err->status);
}

void codec_problem_from_error(problem_details *out, const uz_error *err, uz_problem_kind kind)
{
    const char *where = leave_case(err->where);
    if (kind == UZ_PROBLEM_SCENE)
        where = leave_matrix(where, err->status);
    problem_set(out, http_status(err->status), code_of(err), NULL, "%s", err->message);
    snprintf(out->pointer, sizeof out->pointer, "%s%s%s", points_beside(where) ? "" : "/problem",
             where[0] && where[0] != '/' ? "/" : "", where);
    out->line = err->line;
}

/* Tags are compared as C strings by the store, and shown in terminals. */
static bool check_tags(const json_t *tags, problem_details *problem)
{
    size_t i;
    json_t *tag;
    json_array_foreach(tags, i, tag)
    {
        const char *word = json_string_value(tag);
        json_path list = {NULL, "tags", 4, 0}, path = {&list, NULL, 0, i};
        for (size_t k = 0; k < json_string_length(tag); k++)
            if ((unsigned char)word[k] < 0x20 || word[k] == 0x7f) {
                problem_set(problem, 422, "not_allowed", &path, "/tags/%zu has a control character; tags are words.",
                            i);
                return false;
            }
    }
    return true;
}

static bool decode_tags(char **out, const json_t *tags, problem_details *problem)
{
    if (!check_tags(tags, problem))
        return false;
    text none = {0};
    if (!tags)
        text_put(&none, "[]");
    *out = tags ? json_dumps(tags, JSON_COMPACT) : text_finish(&none, NULL);
    if (!*out)
        problem_set(problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return *out != NULL;
}

/* object NULL: nobody is told. */
static bool decode_webhook(char **out, const json_t *object, problem_details *problem)
{
    const char *url = json_string_value(json_object_get(object, "url"));
    if (!url)
        return true;
    *out = strdup(url);
    return *out || decode_no_memory(problem);
}

static bool decode_problem(uz_problem *out, json_doc *doc, size_t body_len, problem_details *problem)
{
    const json_t *object = json_object_get(doc->root, "problem");
    const char *kind = json_string_value(json_object_get(object, "kind"));
    bool scene = strcmp(kind, "scene") == 0;
    out->kind = scene ? UZ_PROBLEM_SCENE : UZ_PROBLEM_MATRICES;
    return scene ? decode_scene(&out->scene, doc, object, body_len, problem)
                 : decode_matrices(&out->qp, doc, object, body_len, problem);
}

/* ---- sizes that only the whole request tells */

bool codec_request_sizes(const codec_request *request, int64_t *m, int64_t *n_u, problem_details *problem)
{
    const uz_problem *p = &request->problem;
    uz_error err = {.status = UZ_OK};
    int64_t nodes = 0;
    int dim = 0;
    *m = p->qp.N.rows;
    *n_u = p->qp.K.rows;
    if (p->kind != UZ_PROBLEM_SCENE)
        return true;
    if (uz_scene_sizes(&dim, &nodes, m, &p->scene, &err) != UZ_OK) {
        codec_problem_from_error(problem, &err, p->kind);
        return false;
    }
    *n_u = nodes * dim;
    return true;
}

static bool check_count(const char *pointer, int64_t have, int64_t want, const char *what, problem_details *problem)
{
    if (have == want)
        return true;
    problem_set(problem, 422, "size_mismatch", NULL, "%s has %lld numbers, but the problem has %lld %s.", pointer,
                (long long)have, (long long)want, what);
    snprintf(problem->pointer, sizeof problem->pointer, "%s", pointer);
    return false;
}

/* A point of another size than the scene's would pass as numbers of other nodes. */
static bool check_columns(const codec_request *request, problem_details *problem)
{
    bool scene = request->problem.kind == UZ_PROBLEM_SCENE;
    int columns = request->answer.columns, dim = uz_scene_dim(&request->problem.scene);
    json_path answer = {NULL, "answer", 6, 0}, path = {&answer, "displacements", 13, 0};
    if (columns == 0 || (scene && columns == dim))
        return true;
    problem_set(problem, 422, "size_mismatch", &path, "/answer/displacements has points of %d numbers; %s.", columns,
                !scene     ? "a problem in matrices has single numbers"
                : dim == 2 ? "this scene has 2 directions"
                           : "this scene has 3 directions");
    return false;
}

static bool check_limit(int64_t have, int64_t most, const char *what, const char *option, problem_details *problem)
{
    if (have <= most)
        return true;
    problem_set(problem, 413, "problem_too_large", NULL,
                "The problem has %lld %s; this service takes at most %lld (the daemon's option --%s).", (long long)have,
                what, (long long)most, option);
    return false;
}

/* Without making the mesh, which is what a limit shall spare. */
static int64_t scene_dofs(const uz_scene *scene)
{
    double dofs = scene->box.dim;
    for (int i = 0; i < scene->box.dim; i++)
        dofs *= (double)scene->box.cells[i] + 1.0;
    return dofs < 9e18 ? (int64_t)dofs : INT64_MAX;
}

static bool check_limits(const codec_request *request, problem_details *problem)
{
    const uz_qp *qp = &request->problem.qp;
    if (request->problem.kind == UZ_PROBLEM_SCENE)
        return check_limit(scene_dofs(&request->problem.scene), limits.dofs, "degrees of freedom", "max-dofs", problem);
    return check_limit(qp->K.rows, limits.dofs, "degrees of freedom", "max-dofs", problem) &&
           check_limit(qp->N.rows, limits.rows, "contact rows", "max-rows", problem) &&
           check_limit(qp->K.ptr[qp->K.cols], limits.nonzeros, "entries of K", "max-nonzeros", problem) &&
           check_limit(qp->N.ptr[qp->N.cols], limits.nonzeros, "entries of N", "max-nonzeros", problem);
}

static bool check_sizes(const codec_request *request, problem_details *problem)
{
    const codec_answer *answer = &request->answer;
    const codec_start *start = &request->start;
    int64_t m, n_u;
    if (!answer->u && !start->reactions)
        return true;
    if (!codec_request_sizes(request, &m, &n_u, problem))
        return false;
    if (start->reactions)
        return check_count("/solver/warm_start/reactions", start->n_reactions, m, "contact rows", problem);
    return check_columns(request, problem) &&
           check_count("/answer/displacements", answer->n_u, n_u, "displacements", problem) &&
           check_count("/answer/reactions", answer->n_r, m, "contact rows", problem);
}

static const char *schema_of(codec_kind kind, const json_doc *doc)
{
    bool verify = kind == CODEC_VERIFY || (kind == CODEC_STORED && json_object_get(doc->root, "answer"));
    return verify ? "verify.json" : "request.json";
}

/* A box whose cells are to be chosen has no mesh yet that a vector could belong to, and no other rule than the error
 * that they could be chosen by. */
static bool decode_automatic(codec_request *out, const json_t *solver, bool verify, problem_details *problem)
{
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, box = {&mesh, "box", 3, 0};
    json_path cells = {&box, "cells", 5, 0}, root = {NULL, "solver", 6, 0};
    json_path stopping = {&root, "stopping", 8, 0}, start = {&root, "warm_start", 10, 0};
    const uz_problem *p = &out->problem;
    if (p->kind != UZ_PROBLEM_SCENE || !p->scene.box.automatic)
        return true;
    if (!json_object_get(solver, "accuracy"))
        out->settings.balanced = true;
    if (verify)
        problem_set(problem, 422, "not_allowed", &cells,
                    "An answer belongs to a mesh: give the numbers of its cells in place of \"auto\".");
    else if (out->settings.stopping == UZ_STOP_PAPER)
        problem_set(problem, 422, "not_allowed", &stopping,
                    "The paper's rule bounds no error that the cells of the box could be chosen by.");
    else if (json_object_get(solver, "warm_start"))
        problem_set(
            problem, 422, "not_allowed", &start,
            "Reactions belong to a mesh, and the cells of the box are still to be chosen: each grid starts from "
            "the one before it.");
    else
        return true;
    return false;
}

/* The parts of a checked document, each where the next may need it. */
static bool decode_parts(codec_request *out, json_doc *doc, size_t len, problem_details *problem)
{
    const json_t *solver = json_object_get(doc->root, "solver"), *answer = json_object_get(doc->root, "answer");
    decode_settings(&out->settings, solver);
    out->priority = (int)json_real_value(json_object_get(doc->root, "priority")); /* 0 where there is none */
    out->queue_limit_s = json_real_value(json_object_get(doc->root, "queue_limit_s"));
    return decode_webhook(&out->webhook, json_object_get(doc->root, "webhook"), problem) &&
           decode_tags(&out->tags, json_object_get(doc->root, "tags"), problem) &&
           decode_problem(&out->problem, doc, len, problem) && decode_automatic(out, solver, answer != NULL, problem) &&
           decode_cases(&out->problem, doc, json_object_get(doc->root, "cases"), len, problem) &&
           decode_start(&out->start, doc, json_object_get(solver, "warm_start"), len, problem) &&
           decode_assertions(out, json_object_get(doc->root, "assert"), problem) &&
           (!answer || decode_answer(&out->answer, doc, answer, len, problem));
}

bool codec_decode_with(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                       problem_details *problem)
{
    json_doc doc;
    codec_request request = {.tags = NULL};
    *out = request;
    if (!json_scan(&doc, body, len, problem))
        return false;
    doc.store = uploads;
    bool good = decode_check(&doc, schema_of(kind, &doc), problem) && decode_parts(&request, &doc, len, problem);
    request.uploads = doc.uploads;
    request.n_uploads = doc.n_uploads;
    doc.uploads = NULL;
    json_doc_clear(&doc);
    good = good && (kind == CODEC_STORED || check_limits(&request, problem)) && check_sizes(&request, problem);
    if (good)
        *out = request;
    else
        codec_request_clear(&request);
    return good;
}

bool codec_decode(codec_request *out, codec_kind kind, const char *body, size_t len, problem_details *problem)
{
    return codec_decode_with(out, kind, body, len, NULL, problem);
}

bool codec_decode_request(codec_request *out, const char *body, size_t len, problem_details *problem)
{
    return codec_decode(out, CODEC_SOLVE, body, len, problem);
}

void codec_request_strip(codec_request *request)
{
    codec_request kept = {.tags = request->tags,
                          .uploads = request->uploads,
                          .n_uploads = request->n_uploads,
                          .priority = request->priority,
                          .queue_limit_s = request->queue_limit_s,
                          .webhook = request->webhook};
    request->tags = NULL;
    request->uploads = NULL;
    request->webhook = NULL;
    codec_request_clear(request);
    *request = kept;
}

void codec_request_clear(codec_request *request)
{
    if (!request)
        return;
    uz_problem_clear(&request->problem);
    free(request->start.reactions);
    free(request->answer.u);
    free(request->answer.r);
    free(request->assertions);
    free(request->tags);
    free(request->uploads);
    free(request->webhook);
    memset(request, 0, sizeof *request);
}
