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

/* The key of a mesh, by the name of its file; with another name by how it begins. What can't be told is sent as Gmsh's,
 * and the service says what is wrong with it. */
static const char *mesh_format(const char *path, const client_buffer *file)
{
    static const struct {
        const char *ending, *key;
    } NAMES[] = {{".msh", "gmsh"},    {".inp", "abaqus"},  {".bdf", "nastran"}, {".nas", "nastran"},
                 {".dat", "nastran"}, {".fem", "nastran"}, {".vtu", "vtk"},     {".vtk", "vtk"}};
    char begin[4096];
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; i++)
        if (client_ends_in(path, NAMES[i].ending, true))
            return NAMES[i].key;
    const char *text = file->data ? file->data : "";
    text += strncmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0; /* a byte order mark */
    snprintf(begin, sizeof begin, "%s", text);
    if (begin[0] == '*')
        return "abaqus";
    if (begin[0] == '<' || strncmp(begin, "# vtk", 5) == 0)
        return "vtk";
    return strcasestr(begin, "BEGIN BULK") || strstr(begin, "\nGRID") ? "nastran" : "gmsh";
}

client_exit client_put_file(client_session *s, json_t *to, const char *key, const char *path)
{
    char message[512], id[65];
    client_buffer file;
    json_t *value = NULL;
    if (!path)
        return CLIENT_OK;
    if (!client_file_read(&file, path, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    client_exit code = CLIENT_OK;
    if (file.len <= INLINE_MOST && !client_is_packed(path) && !memchr(file.data, '\0', file.len))
        value = json_stringn(file.data, file.len); /* NULL: not UTF-8, a binary file */
    if (!value)
        code = client_upload_once(s, id, path, &file);
    if (!value && code == CLIENT_OK)
        value = json_pack("{s:s}", "upload", id);
    if (code == CLIENT_OK && json_object_set_new(to, key ? key : mesh_format(path, &file), value) != 0)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    free(file.data);
    return code;
}

/* The key of a surface, by the name of its file. */
static const char *surface_format(const char *path)
{
    return client_ends_in(path, ".obj", true) ? "obj" : "stl";
}

/* The file for all obstacles that are surfaces without one. */
static client_exit put_surface(client_session *s, json_t *request, const char *path)
{
    json_t *contact, *problem = json_object_get(request, "problem"), *sent = json_object();
    const char *key = surface_format(path);
    size_t i, count = 0;
    client_exit code = sent ? client_put_file(s, sent, key, path) : client_complain(s, CLIENT_LOCAL, "no memory");
    json_array_foreach(json_object_get(problem, "contacts"), i, contact)
    {
        json_t *surface = json_object_get(json_object_get(contact, "obstacle"), "surface");
        if (code != CLIENT_OK || !json_is_object(surface) || json_object_get(surface, "stl") ||
            json_object_get(surface, "obj"))
            continue;
        if (json_object_set(surface, key, json_object_get(sent, key)) != 0)
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        count++;
    }
    json_decref(sent);
    if (code == CLIENT_OK && count == 0)
        code = client_complain(s, CLIENT_USAGE,
                               "--surface: no contact of FILE has an obstacle {\"surface\": {}} without a file");
    return code;
}

/* The file that the mesh is of, and what --size has to do with it. */
static client_exit find_mesh(client_session *s, const char **of_mesh)
{
    const client_options *o = s->options;
    const bool cad = client_is_cad(o->operand) || client_is_cad(o->mesh);
    *of_mesh = client_is_cad(o->operand) ? o->operand : o->mesh;
    if (client_is_cad(o->operand) && o->mesh)
        return client_complain(s, CLIENT_USAGE,
                               "a FILE from CAD is the mesh: leave --mesh out, or let FILE be the scene");
    if (cad && !(o->size > 0))
        return client_complain(s, CLIENT_USAGE, "a part from CAD wants --size, the length of its elements in mm");
    if (!cad && o->size > 0)
        return client_complain(s, CLIENT_USAGE, "--size is of a part from CAD, such as a STEP file");
    return CLIENT_OK;
}

static client_exit put_files(client_session *s, json_t *request)
{
    const client_options *o = s->options;
    const struct {
        const char *key, *path;
    } matrices[] = {{"K", o->K}, {"N", o->N}, {"h", o->h}, {"p", o->p}};
    const char *of_mesh;
    client_exit code = find_mesh(s, &of_mesh);
    if (code != CLIENT_OK)
        return code;
    if (of_mesh) {
        json_t *problem = problem_of(s, request, "scene"), *mesh = json_object();
        if (!problem || !mesh)
            code = CLIENT_USAGE;
        else
            code = client_is_cad(of_mesh) ? client_put_cad(s, mesh, of_mesh) : client_put_file(s, mesh, NULL, of_mesh);
        if (problem)
            json_object_set(problem, "mesh", mesh);
        json_decref(mesh);
    }
    if (o->surface && code == CLIENT_OK)
        code = put_surface(s, request, o->surface);
    if (of_mesh || o->surface)
        return code;
    if (!o->K && !o->N && !o->h && !o->p)
        return CLIENT_OK;
    json_t *problem = problem_of(s, request, "matrices");
    code = problem ? CLIENT_OK : CLIENT_USAGE;
    for (size_t i = 0; code == CLIENT_OK && i < sizeof matrices / sizeof *matrices; i++)
        code = client_put_file(s, problem, matrices[i].key, matrices[i].path);
    return code;
}

/* ------------------------------------------------------------------ values */

client_exit client_build_values(client_session *s, json_t *request)
{
    const uz_words *set = &s->options->set;
    char message[1024], why[900];
    for (int i = 0; i < set->count; i++) {
        client_path path;
        const char *word = set->item[i], *equals = strchr(word, '=');
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
        if (!ok || !client_path_set(&path, request, value, why, sizeof why)) {
            snprintf(message, sizeof message, "--set %.*s: %s", (int)(equals - word), word, why);
            return client_complain(s, CLIENT_USAGE, message);
        }
    }
    return CLIENT_OK;
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

/* FILE as an object, or without FILE an empty one, with all that is put into it. */
static client_exit build_edited(client_session *s, client_bodies *out, const client_buffer *file)
{
    const client_options *o = s->options;
    char message[320];
    json_error_t error = {0};
    json_t *request = NULL;
    client_exit code = CLIENT_OK;
    if (client_is_deck(o->operand))
        code = client_build_deck(s, &request, o->operand, false);
    else if (client_is_cad(o->operand)) /* the rest of the scene is that of --set */
        request = json_pack("{s:{s:s, s:s}}", "problem", "kind", "scene", "model", "solid");
    else
        request = o->operand ? json_loadb(file->data, file->len, JSON_REJECT_DUPLICATES, &error) : json_object();
    if (code != CLIENT_OK) {
        json_decref(request);
        return code;
    }
    if (!json_is_object(request)) {
        snprintf(message, sizeof message, "%.100s is no request in JSON: %s, line %d", o->operand ? o->operand : "",
                 request ? "it is no object" : error.text, request ? 1 : error.line);
        json_decref(request);
        return client_complain(s, CLIENT_LOCAL, message);
    }
    code = put_files(s, request);
    if (code == CLIENT_OK)
        code = client_build_values(s, request);
    if (code == CLIENT_OK && o->name && json_object_set_new(request, "name", json_string(o->name)) != 0)
        code = client_complain(s, CLIENT_USAGE, "the value of --name is not UTF-8");
    if (code == CLIENT_OK) {
        char common[32] = "";
        json_t *requests = NULL, *labels = NULL;
        code = client_build_variants(s, &requests, &labels, request);
        size_t count = json_array_size(requests);
        out->item = code == CLIENT_OK ? calloc(count ? count : 1, sizeof *out->item) : NULL;
        if (code == CLIENT_OK && !out->item)
            code = client_complain(s, CLIENT_LOCAL, "no memory");
        /* A name for jobs that belong together and have none: of the key, so that a repeat is the same request. */
        if (code == CLIENT_OK && count > 1 && !o->tags.count) {
            snprintf(common, sizeof common, "vary-%.16s", o->key ? o->key : s->key);
            if (!o->json && !o->validate)
                fprintf(s->err, "uzawa: %zu jobs with the tag %s\n", count, common);
        }
        for (size_t i = 0; code == CLIENT_OK && i < count; i++) {
            const char *label = json_string_value(json_array_get(labels, i));
            char *text = json_dumps(json_array_get(requests, i), JSON_COMPACT);
            client_buffer body = {.data = text, .len = text ? strlen(text) : 0};
            uz_words tags = o->tags;
            if (*common)
                tags.item[tags.count++] = common;
            if (*label && strlen(label) <= 64 && tags.count < CLIENT_MAX_TAGS)
                tags.item[tags.count++] = label;
            code = text ? add_body(s, out, &body, label, &tags) : client_complain(s, CLIENT_LOCAL, "no memory");
            free(text);
        }
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
    const bool made = client_is_deck(o->operand) || client_is_cad(o->operand); /* a request is made of it */
    if (o->operand && !made && !client_file_read(&file, o->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    if (o->K || o->N || o->h || o->p || o->mesh || o->surface || o->set.count || o->vary.count || o->name ||
        o->size > 0 || made) {
        code = build_edited(s, out, &file);
    } else {
        out->item = calloc(1, sizeof *out->item);
        code = out->item ? add_body(s, out, &file, "", &o->tags) : client_complain(s, CLIENT_LOCAL, "no memory");
    }
    free(file.data);
    return code;
}
