/* decode.c: a request: the text, its schema, its parts, and what only the whole of it tells. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/text.h"
#include "core/alloc.h"
#include "run/problem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Set by codec_init before threads start, only read until codec_end. */
static schemas *loaded;
/* The same for what a request may ask for at most. */
static codec_limits limits;

static const codec_limits NO_LIMITS = {JSON_MAX_DEPTH, INT64_MAX, INT64_MAX, INT64_MAX};

bool codec_init(const codec_limits *given, char *message, size_t size)
{
    codec_end();
    limits = NO_LIMITS; /* the schemas are no request */
    loaded = schemas_load(NULL, 0, message, size);
    limits = given ? *given : NO_LIMITS;
    return loaded != NULL;
}

void codec_end(void)
{
    schemas_free(loaded);
    loaded = NULL;
}

int json_depth_limit(void)
{
    return limits.json_depth > 0 ? limits.json_depth : JSON_MAX_DEPTH;
}

const schemas *decode_schemas(void)
{
    return loaded;
}

void codec_problem_from_error(problem_details *out, const uz_error *err, uz_problem_kind kind)
{
    static const char *const MATRICES[] = {"K", "N", "p", "h"}, *const BESIDE[] = {"/cases", "/solver", "/answer",
                                                                                   "/quantities"};
    static const struct {
        const char *where, *syntax, *unsupported;
    } FILES[] = {{"/numpy", "numpy_syntax", "numpy_unsupported"},
                 {"/mesh/gmsh", "gmsh_syntax", "gmsh_unsupported"},
                 {"/mesh/abaqus", "abaqus_syntax", "abaqus_unsupported"},
                 {"/mesh/nastran", "nastran_syntax", "nastran_unsupported"},
                 {"/mesh/vtk", "vtk_syntax", "vtk_unsupported"},
                 {"/surface/stl", "stl_syntax", "stl_unsupported"},
                 {"/surface/obj", "obj_syntax", "obj_unsupported"}};
    const uz_status status = err->status;
    const char *where = err->where, *code = uz_status_name(status), *within = "/problem";
    /* The library reads several formats and has one status for all. */
    for (size_t i = 0; i < sizeof FILES / sizeof FILES[0]; i++)
        if (strcmp(where, FILES[i].where) == 0)
            code = status == UZ_ERR_FORMAT        ? FILES[i].syntax
                   : status == UZ_ERR_UNSUPPORTED ? FILES[i].unsupported
                                                  : code;
    if (strncmp(where, "/cases/", 7) == 0) {
        /* A load case has these; an error about anything else of it is one of the body that all cases share. */
        static const char *const OWN[] = {"/p", "/h", "/part", "/after", "/steps"};
        const char *rest = where + 7 + strspn(where + 7, "0123456789");
        bool own = !*rest || strncmp(rest, "/loads", 6) == 0;
        for (size_t i = 0; i < sizeof OWN / sizeof OWN[0]; i++)
            own = own || strcmp(rest, OWN[i]) == 0;
        where = own ? where : rest;
    }
    /* The library names the matrices that it makes of a scene, and no request of a scene has them. Too large they are
     * because of the mesh. */
    for (size_t i = 0; kind == UZ_PROBLEM_SCENE && i < sizeof MATRICES / sizeof MATRICES[0]; i++)
        if (strcmp(where + (where[0] == '/'), MATRICES[i]) == 0)
            where = status == UZ_ERR_LIMIT ? "/mesh" : "";
    for (size_t i = 0; i < sizeof BESIDE / sizeof BESIDE[0]; i++) {
        const size_t len = strlen(BESIDE[i]);
        if (strncmp(where, BESIDE[i], len) == 0 && (where[len] == '/' || where[len] == '\0'))
            within = "";
    }
    const int http = status == UZ_ERR_MEMORY ? 503 : status == UZ_ERR_INTERNAL || status == UZ_ERR_ARGUMENT ? 500 : 422;
    problem_set(out, http, code, NULL, "%s", err->message);
    snprintf(out->pointer, sizeof out->pointer, "%s%s%s", within, where[0] && where[0] != '/' ? "/" : "", where);
    out->line = err->line;
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

static bool check_limits(const codec_request *request, problem_details *problem)
{
    const uz_qp *qp = &request->problem.qp;
    const uz_box *box = &request->problem.scene.box;
    const bool scene = request->problem.kind == UZ_PROBLEM_SCENE;
    double dofs = box->dim; /* without making the mesh, which is what a limit shall spare */
    for (int i = 0; scene && i < box->dim; i++)
        dofs *= (double)box->cells[i] + 1.0;
    const struct {
        int64_t have, most;
        const char *what, *option;
    } LIST[] = {{!scene        ? qp->K.rows
                 : dofs < 9e18 ? (int64_t)dofs
                               : INT64_MAX,
                 limits.dofs, "degrees of freedom", "max-dofs"},
                {scene ? 0 : qp->N.rows, limits.rows, "contact rows", "max-rows"},
                {scene ? 0 : qp->K.ptr[qp->K.cols], limits.nonzeros, "entries of K", "max-nonzeros"},
                {scene ? 0 : qp->N.ptr[qp->N.cols], limits.nonzeros, "entries of N", "max-nonzeros"}};
    for (size_t i = 0; i < sizeof LIST / sizeof LIST[0]; i++)
        if (LIST[i].have > LIST[i].most) {
            problem_set(problem, 413, "problem_too_large", NULL,
                        "The problem has %lld %s; this service takes at most %lld (the daemon's option --%s).",
                        (long long)LIST[i].have, LIST[i].what, (long long)LIST[i].most, LIST[i].option);
            return false;
        }
    return true;
}

bool codec_request_is_light(const codec_request *request)
{
    enum { MOST_NODES = 100000, USUAL_PARTS = 10 };
    const uz_scene *scene = &request->problem.scene;
    const uz_box *box = &scene->box;
    const bool is_box = scene->source == UZ_MESH_BOX;
    const int64_t parts = scene->n_selections + scene->n_supports + scene->n_loads + scene->n_ties + scene->n_contacts;
    double nodes = is_box ? 1 : (double)scene->given.n_nodes;
    for (int i = 0; is_box && i < box->dim; i++)
        nodes *= (double)box->cells[i] + 1.0;
    return request->problem.kind != UZ_PROBLEM_SCENE || nodes * fmax(1.0, (double)parts / USUAL_PARTS) <= MOST_NODES;
}

/* What the solver would refuse a scene for, as far as that takes milliseconds: mesh, materials, supports, loads and
 * contacts, and motions that neither supports nor obstacles stop, but nothing of K. Whether loads press the body on
 * what would hold it is left to the run, and so are large meshes and the loads of cases but the first. */
static bool check_scene(const codec_request *request, problem_details *problem)
{
    const uz_problem *p = &request->problem;
    if (p->kind != UZ_PROBLEM_SCENE || p->scene.refine || !codec_request_is_light(request))
        return true;
    uz_error err = {.status = UZ_OK};
    const uz_scene first = uz_scene_of_case(p, 0);
    const uz_status status = uz_scene_check(&first, &err);
    const bool free_to_move = status == UZ_ERR_FREE_BODY && strcmp(err.where, "/supports") == 0;
    if (status != UZ_ERR_SCENE && status != UZ_ERR_NOT_FINITE && !free_to_move)
        return true;
    if (p->n_cases > 0 && strncmp(err.where, "/loads", 6) == 0)
        uz_error_name_case(&err, p, 0);
    codec_problem_from_error(problem, &err, p->kind);
    return false;
}

/* Vectors that came with the request, as long as the problem wants them. Of a large scene that is looked at where it is
 * read for its run. */
static bool check_sizes(const codec_request *request, bool stored, problem_details *problem)
{
    const codec_answer *answer = &request->answer;
    const codec_start *start = &request->start;
    const bool scene = request->problem.kind == UZ_PROBLEM_SCENE;
    const int dim = uz_scene_dim(&request->problem.scene);
    int64_t m, n_u;
    if ((!answer->u && !start->reactions) || !(stored || codec_request_is_light(request)))
        return true;
    if (!codec_request_sizes(request, &m, &n_u, problem))
        return false;
    /* a point of another size than the scene's would pass as numbers of other nodes */
    if (!start->reactions && answer->columns != 0 && !(scene && answer->columns == dim)) {
        problem_set(problem, 422, "size_mismatch", NULL, "/answer/displacements has points of %d numbers; %s.",
                    answer->columns,
                    !scene     ? "a problem in matrices has single numbers"
                    : dim == 2 ? "this scene has 2 directions"
                               : "this scene has 3 directions");
        snprintf(problem->pointer, sizeof problem->pointer, "/answer/displacements");
        return false;
    }
    const struct {
        const char *pointer, *what;
        int64_t have, want;
    } LIST[] = {{"/solver/warm_start/reactions", "contact rows", start->reactions ? start->n_reactions : m, m},
                {"/answer/displacements", "displacements", start->reactions ? n_u : answer->n_u, n_u},
                {"/answer/reactions", "contact rows", start->reactions ? m : answer->n_r, m}};
    for (size_t i = 0; i < sizeof LIST / sizeof LIST[0]; i++)
        if (LIST[i].have != LIST[i].want) {
            problem_set(problem, 422, "size_mismatch", NULL, "%s has %lld numbers, but the problem has %lld %s.",
                        LIST[i].pointer, (long long)LIST[i].have, (long long)LIST[i].want, LIST[i].what);
            snprintf(problem->pointer, sizeof problem->pointer, "%s", LIST[i].pointer);
            return false;
        }
    return true;
}

/* A box whose cells are to be chosen, or a mesh that is to be refined, is none yet that a vector could belong to, and
 * has no other rule than the error that it could be chosen by. */
static bool decode_automatic(codec_request *out, decoding *d, const json_value *root)
{
    const json_value *solver = json_get(root, "solver"), *start = json_get(solver, "warm_start");
    const json_value *mesh = json_get(json_get(root, "problem"), "mesh"), *refine = json_get(mesh, "refine");
    const uz_problem *p = &out->problem;
    if (p->kind != UZ_PROBLEM_SCENE || !(p->scene.box.automatic || p->scene.refine))
        return true;
    const json_value *accuracy = json_get(solver, "accuracy");
    const double total = out->settings.total_error;
    if (!accuracy || (json_get(accuracy, "guaranteed") && !(total > 0) && !json_get(accuracy, "relative_error")))
        out->settings.balanced = true;
    if (total > 0) /* what the cells are chosen by */
        out->settings.relative_error = total;
    if (json_get(root, "answer") && refine)
        problem_set(d->problem, 422, "not_allowed", refine,
                    "An answer belongs to a mesh, and this one is still to be refined: leave out \"refine\".");
    else if (json_get(root, "answer"))
        problem_set(d->problem, 422, "not_allowed", json_get(json_get(mesh, "box"), "cells"),
                    "An answer belongs to a mesh: give the numbers of its cells in place of \"auto\".");
    else if (out->settings.stopping == UZ_STOP_PAPER)
        problem_set(d->problem, 422, "not_allowed", json_get(solver, "stopping"),
                    "The paper's rule bounds no error that the mesh could be chosen by.");
    else if (start)
        problem_set(
            d->problem, 422, "not_allowed", start,
            "Reactions belong to a mesh, and this one is still to be chosen: each grid starts from the one before it.");
    else
        return true;
    return false;
}

/* The parts of a checked tree, each where the next may need it. */
static bool decode_parts(codec_request *out, decoding *d, const json_value *root)
{
    const json_value *solver = json_get(root, "solver"), *start = json_get(solver, "warm_start");
    const json_value *of = json_get(start, "case"), *reactions = json_get(start, "reactions");
    const json_value *problem = json_get(root, "problem"), *answer = json_get(root, "answer");
    const json_value *tags = json_get(root, "tags"), *name = json_get(root, "name");
    const char *webhook = json_text(json_get(json_get(root, "webhook"), "url")),
               *from = json_text(json_get(start, "job"));
    char word[64];
    text t = {0};
    decode_settings(&out->settings, solver);
    out->priority = (int)json_number(json_get(root, "priority"), 0);
    out->queue_limit_s = json_number(json_get(root, "queue_limit_s"), 0);
    out->webhook = webhook ? strdup(webhook) : NULL;
    if (webhook && !out->webhook)
        return problem_no_memory(d->problem);

    /* Tags are compared as C strings by the store, and shown in terminals. */
    text_open(&t, NULL, '[');
    if (name) {
        char as_tag[sizeof CODEC_NAME_TAG + 64];
        if (!decode_label(word, d, name, name->text, name->count, "The name of a job")) {
            free(t.data);
            return false;
        }
        snprintf(as_tag, sizeof as_tag, "%s%s", CODEC_NAME_TAG, word);
        text_string(&t, NULL, as_tag);
    }
    for (size_t i = 0; i < json_size(tags); i++) {
        const json_value *tag = &tags->items[i];
        if (decode_unsafe(tag->text, tag->count)) {
            free(t.data);
            return decode_refuse(d, "not_allowed", tag,
                                 "has a character that controls a terminal or the order of others; tags are words.");
        }
        text_string(&t, NULL, tag->text);
    }
    text_close(&t, ']');
    out->tags = text_finish(&t, NULL);
    if (!out->tags)
        return problem_no_memory(d->problem);

    out->problem.kind = json_text_is(json_get(problem, "kind"), "scene") ? UZ_PROBLEM_SCENE : UZ_PROBLEM_MATRICES;
    const bool good = out->problem.kind == UZ_PROBLEM_SCENE ? decode_scene(&out->problem.scene, d, problem)
                                                            : decode_matrices(&out->problem.qp, d, problem);
    if (!good || !decode_automatic(out, d, root) || !decode_cases(&out->problem, d, json_get(root, "cases")) ||
        !decode_quantities(&out->problem, &out->settings, d, json_get(root, "quantities"),
                           json_get(solver, "accuracy")))
        return false;
    snprintf(out->start.job, sizeof out->start.job, "%s", from ? from : "");
    out->start.continued = json_truth(json_get(start, "continue"));
    return (!of || decode_label(out->start.case_name, d, of, of->text, of->count, "A name of a case")) &&
           (!reactions || decode_vector(&out->start.reactions, &out->start.n_reactions, d, reactions)) &&
           decode_assertions(out, d, json_get(root, "assert")) &&
           (!answer || (decode_points(&out->answer.u, &out->answer.n_u, &out->answer.columns, d,
                                      json_get(answer, "displacements")) &&
                        decode_vector(&out->answer.r, &out->answer.n_r, d, json_get(answer, "reactions"))));
}

bool codec_decode(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                  problem_details *problem)
{
    return codec_decode_kept(out, kind, body, len, uploads, NULL, problem);
}

bool codec_decode_kept(codec_request *out, codec_kind kind, const char *body, size_t len, store *uploads,
                       uz_cache *meshes, problem_details *problem)
{
    json_tree tree;
    codec_request request = {.tags = NULL};
    /* A matrix that can be solved has an entry of at least six bytes of text for each unknown, so no honest request
     * comes near this; a size line alone must not fill the machine. */
    decoding d = {.store = uploads, .meshes = meshes, .bound = ((size_t)64 << 20) + 32 * len, .problem = problem};
    *out = request;
    if (!json_scan(&tree, body, len, problem))
        return false;
    const bool verify = kind == CODEC_VERIFY || (kind == CODEC_STORED && json_get(tree.root, "answer"));
    bool good = schemas_check(loaded, verify ? "verify.json" : "request.json", tree.root, problem) &&
                decode_parts(&request, &d, tree.root);
    request.uploads = d.uploads;
    request.n_uploads = d.n_uploads;
    json_clear(&tree);
    good = good && (kind == CODEC_STORED || (check_limits(&request, problem) && check_scene(&request, problem))) &&
           check_sizes(&request, kind == CODEC_STORED, problem);
    if (good)
        *out = request;
    else
        codec_request_clear(&request);
    return good;
}

char *codec_mistakes(const char *body, size_t len)
{
    enum { MOST = 20 };
    json_tree tree;
    problem_details list[MOST];
    schema_mistakes all = {.list = list, .most = MOST};
    if (!json_scan(&tree, body, len, &list[0]))
        return NULL;
    schemas_check_all(loaded, "request.json", tree.root, &all);
    json_clear(&tree);
    return all.count > 1 ? codec_encode_mistakes(list, all.count) : NULL;
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
    uz_free_all(request->start.reactions, request->answer.u, request->answer.r, request->assertions, request->tags,
                request->uploads, request->webhook);
    memset(request, 0, sizeof *request);
}
