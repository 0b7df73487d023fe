/* decode.c: a request: the text, its schema, its parts, and what only the whole of it tells. */
#include "codec/decode.h"
#include "codec/problem.h"
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

/* The array as text. Tags are compared as C strings by the store, and shown in terminals. */
static bool decode_tags(char **out, decoding *d, const json_value *tags)
{
    text t = {0};
    text_open(&t, '[');
    for (size_t i = 0; i < json_size(tags); i++) {
        const json_value *tag = &tags->items[i];
        for (size_t k = 0; k < tag->count; k++)
            if ((unsigned char)tag->text[k] < 0x20 || tag->text[k] == 0x7f) {
                free(t.data);
                return decode_refuse(d, "not_allowed", tag, "has a control character; tags are words.");
            }
        text_string(&t, tag->text);
    }
    text_close(&t, ']');
    *out = text_finish(&t, NULL);
    return *out || problem_no_memory(d->problem);
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
    if (columns == 0 || (scene && columns == dim))
        return true;
    problem_set(problem, 422, "size_mismatch", NULL, "/answer/displacements has points of %d numbers; %s.", columns,
                !scene     ? "a problem in matrices has single numbers"
                : dim == 2 ? "this scene has 2 directions"
                           : "this scene has 3 directions");
    snprintf(problem->pointer, sizeof problem->pointer, "/answer/displacements");
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

/* A box whose cells are to be chosen has no mesh yet that a vector could belong to, and no other rule than the error
 * that they could be chosen by. */
static bool decode_automatic(codec_request *out, decoding *d, const json_value *root)
{
    const json_value *solver = json_get(root, "solver"), *start = json_get(solver, "warm_start");
    const json_value *box = json_get(json_get(json_get(root, "problem"), "mesh"), "box");
    const uz_problem *p = &out->problem;
    if (p->kind != UZ_PROBLEM_SCENE || !p->scene.box.automatic)
        return true;
    if (!json_get(solver, "accuracy"))
        out->settings.balanced = true;
    if (json_get(root, "answer"))
        problem_set(d->problem, 422, "not_allowed", json_get(box, "cells"),
                    "An answer belongs to a mesh: give the numbers of its cells in place of \"auto\".");
    else if (out->settings.stopping == UZ_STOP_PAPER)
        problem_set(d->problem, 422, "not_allowed", json_get(solver, "stopping"),
                    "The paper's rule bounds no error that the cells of the box could be chosen by.");
    else if (start)
        problem_set(
            d->problem, 422, "not_allowed", start,
            "Reactions belong to a mesh, and the cells of the box are still to be chosen: each grid starts from "
            "the one before it.");
    else
        return true;
    return false;
}

/* The parts of a checked tree, each where the next may need it. */
static bool decode_parts(codec_request *out, decoding *d, const json_value *root)
{
    const json_value *solver = json_get(root, "solver"), *answer = json_get(root, "answer");
    const json_value *problem = json_get(root, "problem");
    const char *webhook = json_text_of(json_get(root, "webhook"), "url");
    decode_settings(&out->settings, solver);
    out->priority = (int)decode_number(root, "priority", 0);
    out->queue_limit_s = decode_number(root, "queue_limit_s", 0);
    out->webhook = webhook ? strdup(webhook) : NULL;
    if (webhook && !out->webhook)
        return problem_no_memory(d->problem);
    if (!decode_tags(&out->tags, d, json_get(root, "tags")))
        return false;
    out->problem.kind = json_text_is(json_get(problem, "kind"), "scene") ? UZ_PROBLEM_SCENE : UZ_PROBLEM_MATRICES;
    const bool good = out->problem.kind == UZ_PROBLEM_SCENE ? decode_scene(&out->problem.scene, d, problem)
                                                            : decode_matrices(&out->problem.qp, d, problem);
    return good && decode_automatic(out, d, root) && decode_cases(&out->problem, d, json_get(root, "cases")) &&
           decode_start(&out->start, d, json_get(solver, "warm_start")) &&
           decode_assertions(out, d, json_get(root, "assert")) && (!answer || decode_answer(&out->answer, d, answer));
}

bool codec_decode_with(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                       problem_details *problem)
{
    json_tree tree;
    codec_request request = {.tags = NULL};
    decoding d = {.store = uploads, .bound = decode_memory_bound(len), .problem = problem};
    *out = request;
    if (!json_scan(&tree, body, len, problem))
        return false;
    const bool verify = kind == CODEC_VERIFY || (kind == CODEC_STORED && json_get(tree.root, "answer"));
    bool good = schemas_check(loaded, verify ? "verify.json" : "request.json", tree.root, problem) &&
                decode_parts(&request, &d, tree.root);
    request.uploads = d.uploads;
    request.n_uploads = d.n_uploads;
    json_clear(&tree);
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
