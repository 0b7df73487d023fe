#include "request/build.h"
#include "request/paths.h"
#include "request/tags.h"

#include <stdlib.h>
#include <string.h>

#define INLINE_MOST (64u << 10) /* larger files are uploaded: they are sent once, however many jobs name them */

void client_bodies_clear(client_bodies *bodies)
{
    for (size_t i = 0; i < bodies->count; i++)
        free(bodies->item[i].body.data);
    free(bodies->item);
    *bodies = (client_bodies){0};
}

/* ------------------------------------------------------------------ files */

static bool ends_in_gz(const char *path)
{
    size_t len = strlen(path);
    return len > 3 && strcmp(path + len - 3, ".gz") == 0;
}

/* The file as the text of a JSON string or as an upload. */
static client_exit file_value(client_session *s, json_t **out, const char *path)
{
    char message[512], id[65];
    client_buffer file;
    *out = NULL;
    if (!client_file_read(&file, path, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    client_exit code = CLIENT_OK;
    if (file.len <= INLINE_MOST && !ends_in_gz(path) && !memchr(file.data, '\0', file.len))
        *out = json_stringn(file.data, file.len); /* NULL: not UTF-8, a binary file */
    if (!*out)
        code = client_upload_once(s, id, path, &file);
    if (!*out && code == CLIENT_OK)
        *out = json_pack("{s:s}", "upload", id);
    free(file.data);
    return code;
}

/* The request's problem, made if need be. NULL: it is none of this kind, or no memory. */
static json_t *problem_of(client_session *s, json_t *request, const char *kind)
{
    json_t *problem = json_object_get(request, "problem");
    if (!problem && json_object_set_new(request, "problem", json_pack("{s:s}", "kind", kind)) == 0)
        problem = json_object_get(request, "problem");
    const char *have = json_string_value(json_object_get(problem, "kind"));
    if (have && strcmp(have, kind) == 0)
        return problem;
    client_complain(s, CLIENT_USAGE,
                    strcmp(kind, "scene") == 0
                        ? "--mesh is of a scene, and the problem of FILE is none"
                        : "--K, --N, --h and --p are of matrices, and the problem of FILE is none");
    return NULL;
}

static client_exit put_file(client_session *s, json_t *to, const char *key, const char *path)
{
    json_t *value = NULL;
    if (!path)
        return CLIENT_OK;
    client_exit code = file_value(s, &value, path);
    if (code == CLIENT_OK && json_object_set_new(to, key, value) != 0)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    return code;
}

client_exit client_build_files(client_session *s, json_t *request)
{
    const client_options *o = s->options;
    const struct {
        const char *key, *path;
    } matrices[] = {{"K", o->K}, {"N", o->N}, {"h", o->h}, {"p", o->p}};
    client_exit code = CLIENT_OK;
    if (o->mesh) {
        json_t *problem = problem_of(s, request, "scene"), *mesh = json_object();
        code = problem && mesh ? put_file(s, mesh, "gmsh", o->mesh) : CLIENT_USAGE;
        if (problem)
            json_object_set(problem, "mesh", mesh);
        json_decref(mesh);
        return code;
    }
    if (!o->K && !o->N && !o->h && !o->p)
        return CLIENT_OK;
    json_t *problem = problem_of(s, request, "matrices");
    code = problem ? CLIENT_OK : CLIENT_USAGE;
    for (size_t i = 0; code == CLIENT_OK && i < sizeof matrices / sizeof *matrices; i++)
        code = put_file(s, problem, matrices[i].key, matrices[i].path);
    return code;
}

/* ------------------------------------------------------------------ values */

static client_exit set_one(client_session *s, json_t *request, const char *word)
{
    char message[1024], why[900];
    client_path path;
    const char *equals = strchr(word, '=');
    if (!equals) {
        snprintf(message, sizeof message, "--set wants PATH=VALUE, not \"%.200s\"", word);
        return client_complain(s, CLIENT_USAGE, message);
    }
    json_t *value = client_value_read(equals + 1, strlen(equals + 1));
    if (!value)
        return client_complain(s, CLIENT_USAGE, "a value of --set is not UTF-8");
    bool ok = client_path_read(&path, request, word, (size_t)(equals - word), why, sizeof why);
    if (!ok)
        json_decref(value);
    if (ok && client_path_set(&path, request, value, why, sizeof why))
        return CLIENT_OK;
    snprintf(message, sizeof message, "--set %.*s: %s", (int)(equals - word), word, why);
    return client_complain(s, CLIENT_USAGE, message);
}

client_exit client_build_values(client_session *s, json_t *request)
{
    const uz_words *set = &s->options->set;
    client_exit code = CLIENT_OK;
    for (int i = 0; code == CLIENT_OK && i < set->count; i++)
        code = set_one(s, request, set->item[i]);
    return code;
}

/* ------------------------------------------------------------------ bodies */

static client_exit add_body(client_session *s, client_bodies *out, const client_buffer *text, const char *label,
                            const uz_words *tags)
{
    client_job_body *body = &out->item[out->count];
    snprintf(body->label, sizeof body->label, "%s", label);
    if (!client_tags_add(&body->body, text, tags->item, tags->count))
        return client_complain(s, CLIENT_LOCAL, "cannot add the tags: one is not UTF-8, or no memory");
    out->count++;
    return CLIENT_OK;
}

static client_exit add_request(client_session *s, client_bodies *out, const json_t *request, const char *label,
                               const char *common)
{
    uz_words tags = s->options->tags;
    char *text = json_dumps(request, JSON_COMPACT);
    if (!text)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    if (*common)
        tags.item[tags.count++] = common;
    if (*label && strlen(label) <= 64 && tags.count < CLIENT_MAX_TAGS)
        tags.item[tags.count++] = label;
    client_buffer body = {.data = text, .len = strlen(text)};
    client_exit code = add_body(s, out, &body, label, &tags);
    free(text);
    return code;
}

/* A name for jobs that belong together and have none. */
static void common_tag(client_session *s, char out[32], size_t jobs)
{
    out[0] = '\0';
    if (jobs < 2 || s->options->tags.count > 0)
        return;
    /* of the key, so that a repeat is the same request */
    snprintf(out, 32, "vary-%.16s", s->options->key ? s->options->key : s->key);
    if (!s->options->json)
        fprintf(s->err, "uzawa: %zu jobs with the tag %s\n", jobs, out);
}

/* FILE as an object to be changed; without FILE an empty one. */
static client_exit parse_file(client_session *s, json_t **out, const client_buffer *file)
{
    char message[320];
    json_error_t error = {0};
    *out = s->options->operand ? json_loadb(file->data, file->len, JSON_REJECT_DUPLICATES, &error) : json_object();
    if (json_is_object(*out))
        return CLIENT_OK;
    snprintf(message, sizeof message, "%.100s is no request in JSON: %s, line %d",
             s->options->operand ? s->options->operand : "", *out ? "it is no object" : error.text,
             *out ? 1 : error.line);
    return client_complain(s, CLIENT_LOCAL, message);
}

static client_exit build_edited(client_session *s, client_bodies *out, const client_buffer *file)
{
    json_t *request = NULL;
    client_exit code = parse_file(s, &request, file);
    if (code == CLIENT_OK)
        code = client_build_files(s, request);
    if (code == CLIENT_OK)
        code = client_build_values(s, request);
    if (code == CLIENT_OK) {
        char common[32];
        json_t *requests = NULL, *labels = NULL;
        code = client_build_variants(s, &requests, &labels, request);
        size_t count = json_array_size(requests);
        out->item = code == CLIENT_OK ? calloc(count ? count : 1, sizeof *out->item) : NULL;
        if (code == CLIENT_OK && !out->item)
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        if (code == CLIENT_OK)
            common_tag(s, common, count);
        for (size_t i = 0; code == CLIENT_OK && i < count; i++)
            code =
                add_request(s, out, json_array_get(requests, i), json_string_value(json_array_get(labels, i)), common);
        json_decref(requests);
        json_decref(labels);
    }
    json_decref(request);
    return code;
}

client_exit client_build(client_session *s, client_bodies *out)
{
    char message[512];
    const client_options *o = s->options;
    client_buffer file = {0};
    client_exit code;
    *out = (client_bodies){0};
    if (o->operand && !client_file_read(&file, o->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    if (o->K || o->N || o->h || o->p || o->mesh || o->set.count || o->vary.count) {
        code = build_edited(s, out, &file);
    } else {
        out->item = calloc(1, sizeof *out->item);
        code = out->item ? add_body(s, out, &file, "", &o->tags) : client_complain(s, CLIENT_LOCAL, "no memory");
    }
    free(file.data);
    return code;
}
