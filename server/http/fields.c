#include "http/fields.h"

#include <errno.h>
#include <semaphore.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ------------------------------------------------------------------- turns */

struct field_slots {
    sem_t free;
};

static const double LONGEST_WAIT_S = 30.0; /* for a turn; openapi.json says so */
static const double BETWEEN_LOOKS_S = 0.2; /* at the client and the daemon's end */

field_slots *field_slots_new(int count)
{
    field_slots *slots = calloc(1, sizeof *slots);
    if (slots && sem_init(&slots->free, 0, (unsigned)count) != 0) {
        free(slots);
        slots = NULL;
    }
    return slots;
}

void field_slots_free(field_slots *slots)
{
    if (slots)
        sem_destroy(&slots->free);
    free(slots);
}

/* Nobody would read the reply, or the daemon wants to end. */
static bool is_over(void *ctx)
{
    const field_reader *reader = ctx;
    return api_draining(reader->context) || request_client_gone(reader->rq);
}

static bool take_slot(field_reader *reader, http_reply *reply)
{
    const int looks = (int)(LONGEST_WAIT_S / BETWEEN_LOOKS_S);
    for (int i = 0; i < looks && !reader->has_slot && (i == 0 || !is_over(reader)); i++) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += (long)(BETWEEN_LOOKS_S * 1e9);
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        int failed;
        do
            failed = sem_timedwait(&reader->context->fields->free, &until);
        while (failed && errno == EINTR);
        reader->has_slot = !failed;
    }
    if (!reader->has_slot) {
        reply->retry_after_s = 5;
        reply_refuse(reply, 503, "busy", "Too many replies are being computed",
                     "no turn came within %g s: ask again later", LONGEST_WAIT_S);
    }
    return reader->has_slot;
}

/* ------------------------------------------------------------------ reading */

static bool read_request(field_reader *reader, http_reply *reply)
{
    char *body = NULL;
    size_t len = 0;
    problem_details problem = {0};
    store_status status = store_get_body(reader->context->store, reader->j->id, &body, &len);
    if (status != STORE_OK) {
        reply_store_failure(reader->context, status, reply);
        return false;
    }
    reader->is_open = codec_decode(&reader->request, CODEC_STORED, body, len, reader->context->store, &problem);
    free(body);
    if (!reader->is_open)
        reply_problem(reply, &problem);
    return reader->is_open;
}

bool fields_open(field_reader *reader, api *context, const http_request *rq, const job *j, http_reply *reply)
{
    *reader = (field_reader){.context = context, .rq = rq, .j = j};
    if (!take_slot(reader, reply) || !read_request(reader, reply))
        return false;
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
    if (reader->has_slot)
        sem_post(&reader->context->fields->free);
    *reader = (field_reader){.context = NULL};
}

/* ---------------------------------------------------------------- computing */

/* The scene with the loads of the case, and the cells that were chosen for a box; borrowed. */
static store_status read_scene(uz_scene *out, const field_reader *reader, int64_t number)
{
    double *cells = NULL;
    int64_t count = 0;
    *out = uz_scene_of_case(&reader->request.problem, number - 1);
    if (!out->box.automatic)
        return STORE_OK;
    store_status status = store_get_vector(reader->context->store, reader->j->id, 0, "cells", &cells, &count);
    for (int i = 0; status == STORE_OK && i < 3 && i < count; i++)
        out->box.cells[i] = (int64_t)cells[i];
    out->box.automatic = status != STORE_OK;
    free(cells);
    return status;
}

typedef struct {
    double *u, *r, *g;
    uz_field_source source;
} stored_answer;

static store_status read_answer(stored_answer *out, const field_reader *reader, int64_t number)
{
    store *s = reader->context->store;
    const char *id = reader->j->id;
    int64_t m = 0;
    *out = (stored_answer){.u = NULL};
    store_status status = store_get_vector(s, id, number, "displacements", &out->u, &out->source.n_u);
    if (status == STORE_OK)
        status = store_get_vector(s, id, number, "reactions", &out->r, &out->source.m);
    if (status == STORE_OK)
        status = store_get_vector(s, id, number, "gaps", &out->g, &m);
    out->source.u = out->u;
    out->source.r = out->r;
    out->source.g = m == out->source.m ? out->g : NULL;
    return status;
}

static void reply_failure(const field_reader *reader, uz_status status, const uz_error *err, http_reply *reply)
{
    problem_details problem;
    if (status == UZ_ERR_MEMORY) {
        reply_no_memory(reply);
    } else if (status == UZ_ERR_CANCELLED) {
        reply->retry_after_s = 5;
        reply_refuse(reply, 503, "draining", "The server is shutting down", "the reply was not computed to its end");
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
    const uz_hooks hooks = {.ctx = (void *)reader, .cancelled = is_over};
    uz_scene scene;
    stored_answer answer;
    uz_error err = {0};
    uz_status status = UZ_ERR_ARGUMENT;
    store_status found = read_answer(&answer, reader, number);
    if (found == STORE_OK)
        found = read_scene(&scene, reader, number);
    if (found == STORE_OK)
        status = run(out, &scene, &answer.source, which, &hooks, &err);
    free(answer.u);
    free(answer.r);
    free(answer.g);
    if (found != STORE_OK)
        reply_store_failure(reader->context, found, reply);
    else if (status != UZ_OK)
        reply_failure(reader, status, &err, reply);
    return found == STORE_OK && status == UZ_OK;
}

static uz_status run_fields(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                            const uz_hooks *hooks, uz_error *err)
{
    return uz_fields_compute(out, scene, answer, which, hooks, err);
}

bool fields_of_case(uz_fields *out, const field_reader *reader, int64_t number, unsigned which, http_reply *reply)
{
    *out = (uz_fields){.dim = 0};
    return fields_compute(out, run_fields, reader, number, which, reply);
}

static uz_status run_mesh_error(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                                const uz_hooks *hooks, uz_error *err)
{
    (void)which;
    return uz_mesh_error(out, scene, answer, hooks, err);
}

bool fields_mesh_error(double *error, const field_reader *reader, int64_t number, http_reply *reply)
{
    return fields_compute(error, run_mesh_error, reader, number, 0, reply);
}

/* -------------------------------------------------------------------- names */

static void list_names(char *text, size_t size, unsigned allowed)
{
    size_t used = (size_t)snprintf(text, size, "summary, nodes");
    for (unsigned bit = 1; bit && bit <= allowed; bit <<= 1)
        if (allowed & bit && used < size)
            used += (size_t)snprintf(text + used, size - used, ", %s", uz_field_name((uz_field)bit));
}

static bool add_name(field_list *out, const char *name, size_t len, unsigned allowed)
{
    if (token_equal(name, len, "nodes"))
        return out->nodes = true;
    for (unsigned bit = 1; bit && bit <= allowed; bit <<= 1)
        if (allowed & bit && token_equal(name, len, uz_field_name((uz_field)bit))) {
            out->which |= bit;
            return true;
        }
    return token_equal(name, len, "summary");
}

bool fields_parse(field_list *out, const char *text, unsigned allowed, problem_details *problem)
{
    char names[300];
    *out = (field_list){.which = 0};
    for (;;) {
        const size_t len = strcspn(text, ",");
        if (!add_name(out, text, len, allowed)) {
            list_names(names, sizeof names, allowed);
            return problem_fill(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                                "\"%.*s\" is no field of a result: fields is a list of %s, separated by commas",
                                (int)(len < 60 ? len : 60), text, names);
        }
        if (text[len] == '\0')
            return true;
        text += len + 1;
    }
}
