/* fields.c: turns of what is computed, and the computation. */
#include "http/fields.h"
#include "core/alloc.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ------------------------------------------------------------------- turns */

static const double LONGEST_WAIT_S = 30.0; /* for a turn; openapi.json says so */
static const double BETWEEN_LOOKS_S = 0.2; /* at the client and the daemon's end */

bool fields_open(field_reader *reader, api *context, const http_request *rq, const job *j, http_reply *reply)
{
    const int looks = (int)(LONGEST_WAIT_S / BETWEEN_LOOKS_S);
    char *body = NULL;
    size_t len = 0;
    problem_details problem = {0};
    *reader = (field_reader){.asker = {context, rq}, .j = j};
    for (int i = 0; i < looks && !reader->has_turn && (i == 0 || !api_is_over(&reader->asker)); i++) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += (long)(BETWEEN_LOOKS_S * 1e9);
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        int failed;
        do
            failed = sem_timedwait(&context->turns, &until);
        while (failed && errno == EINTR);
        reader->has_turn = !failed;
    }
    if (!reader->has_turn) {
        reply->retry_after_s = 5;
        reply_refuse(reply, 503, "busy", "Too many replies are being computed",
                     "no turn came within %g s: ask again later", LONGEST_WAIT_S);
        return false;
    }
    const store_status status = store_get_body(context->store, j->id, &body, &len);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return false;
    }
    reader->is_open =
        codec_decode_kept(&reader->request, CODEC_STORED, body, len, context->store, context->meshes, &problem);
    free(body);
    if (!reader->is_open) {
        reply_problem(reply, &problem);
        return false;
    }
    if (reader->request.problem.kind == UZ_PROBLEM_SCENE)
        return true;
    reply_refuse(reply, 409, "not_a_scene", "The problem has no mesh",
                 "stress, strain, contact status and .vtu need a scene; this job's problem is given by its matrices");
    return false;
}

void fields_close(field_reader *reader)
{
    if (reader->is_open)
        codec_request_clear(&reader->request);
    if (reader->has_turn)
        sem_post(&reader->asker.context->turns);
    *reader = (field_reader){.j = NULL};
}

/* ---------------------------------------------------------------- computing */

static void reply_failure(const field_reader *reader, uz_status status, const uz_error *err, http_reply *reply)
{
    problem_details problem;
    if (status == UZ_ERR_MEMORY) {
        reply_no_memory(reply);
    } else if (status == UZ_ERR_CANCELLED) {
        reply->retry_after_s = 5;
        reply_refuse(reply, 503, "draining", "The server is shutting down", "the reply was not computed to its end");
    } else if (status == UZ_ERR_NOT_FINITE) {
        reply_refuse(reply, 409, "no_result", "The answer cannot be drawn", "%s", err->message);
    } else if (status == UZ_ERR_LIMIT && !err->where[0]) {
        reply_refuse(reply, 413, "result_too_large", "The result is too large for one reply", "%s", err->message);
    } else {
        codec_problem_from_error(&problem, err, reader->request.problem.kind);
        reply_problem(reply, &problem);
    }
}

bool fields_compute(void *out, field_computation run, const field_reader *reader, int64_t number, unsigned which,
                    http_reply *reply)
{
    api *context = reader->asker.context;
    store *s = context->store;
    const char *id = reader->j->id;
    const uz_hooks hooks = {.ctx = (void *)&reader->asker, .cancelled = api_is_over};
    uz_scene scene = uz_scene_of_case(&reader->request.problem, number - 1); /* borrowed */
    uz_field_source answer = {.u = NULL};
    uz_error err = {0};
    uz_status status = UZ_ERR_ARGUMENT;
    double *u = NULL, *r = NULL, *g = NULL, *cells = NULL, *place = NULL, *bisected = NULL, *warm = NULL;
    int64_t n_gaps = 0, n_cells = 0, n_place = 0, n_warm = 0, *list = NULL;
    store_status found = store_get_vector(s, id, number, "displacements", &u, &answer.n_u);
    if (found == STORE_OK)
        found = store_get_vector(s, id, number, "reactions", &r, &answer.m);
    if (found == STORE_OK)
        found = store_get_vector(s, id, number, "gaps", &g, &n_gaps);
    if (found == STORE_OK && scene.box.automatic) { /* the cells that were chosen for a box */
        found = store_get_vector(s, id, 0, "cells", &cells, &n_cells);
        for (int i = 0; found == STORE_OK && i < 3 && i < n_cells; i++)
            scene.box.cells[i] = (int64_t)cells[i];
        scene.box.automatic = false;
    }
    if (found == STORE_OK && scene.refine) {
        found = store_get_vector(s, id, 0, "bisected", &bisected, &scene.n_bisected);
        list = found == STORE_OK ? calloc((size_t)scene.n_bisected + 1, sizeof *list) : NULL;
        for (int64_t i = 0; list && i < scene.n_bisected; i++)
            list[i] = (int64_t)bisected[i];
        scene.bisected = list;
    }
    if (found == STORE_OK) { /* where its contacts were found */
        found = store_get_vector(s, id, number, "place", &place, &n_place);
        found = found == STORE_NOT_FOUND ? STORE_OK : found;
        scene.place = n_place == answer.n_u ? place : NULL;
    }
    if (found == STORE_OK && scene.place) { /* which answers of large deformation have */
        found = store_get_vector(s, id, number, "free_strain", &warm, &n_warm);
        found = found == STORE_NOT_FOUND ? STORE_OK : found;
        scene.free_strain = warm;
        scene.n_free_strain = n_warm;
    }
    answer.u = u;
    answer.r = r;
    answer.g = n_gaps == answer.m ? g : NULL;
    if (found == STORE_OK)
        status = scene.refine && !list ? UZ_ERR_MEMORY : run(out, &scene, &answer, which, &hooks, &err);
    uz_free_all(u, r, g, cells, place, warm, bisected, list);
    if (found != STORE_OK)
        reply_store_failure(context, found, reply);
    else if (status != UZ_OK)
        reply_failure(reader, status, &err, reply);
    return found == STORE_OK && status == UZ_OK;
}

uz_status fields_of_case(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                         const uz_hooks *hooks, uz_error *err)
{
    return uz_fields_compute(out, scene, answer, which, hooks, err);
}

/* -------------------------------------------------------------------- names */

bool fields_parse(field_list *out, const char *text, unsigned otherwise, unsigned allowed, problem_details *problem)
{
    char names[300];
    *out = (field_list){.which = text ? 0 : otherwise};
    while (text) {
        const size_t len = strcspn(text, ",");
        bool known = token_equal(text, len, "summary");
        size_t used = (size_t)snprintf(names, sizeof names, "summary, nodes");
        if (token_equal(text, len, "nodes"))
            known = out->nodes = true;
        for (unsigned bit = 1; bit && bit <= allowed; bit <<= 1) {
            const char *name = allowed & bit ? uz_field_name((uz_field)bit) : NULL;
            if (name && token_equal(text, len, name)) {
                out->which |= bit;
                known = true;
            }
            if (name && used < sizeof names)
                used += (size_t)snprintf(names + used, sizeof names - used, ", %s", name);
        }
        if (!known)
            return REFUSE_PARAMETER(problem,
                                    "\"%.*s\" is no field of a result: fields is a list of %s, separated by commas",
                                    (int)(len < 60 ? len : 60), text, names);
        text = text[len] ? text + len + 1 : NULL;
    }
    return true;
}
