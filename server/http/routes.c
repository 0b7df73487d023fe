/* routes.c: the route table. 404, 405 with Allow and unknown query keys all follow from it; HEAD is served by GET.
 * What can be had of a job has its rows in outputs.c. Another route is a row here, a handler declared in api.h and
 * defined in the file of its subject, and a path in schemas/openapi.json; tests/api/test_schemas.py compares the two.
 */
#include "http/api.h"
#include "http/output.h"

#include <stdio.h>
#include <string.h>

static const char *const NONE[] = {NULL};
static const char *const SUBMIT[] = {"validate", NULL};
static const char *const LIST[] = {"status", "limit", "cursor", "tag", "name", "since", "until", "order", NULL};

static const route ROUTES[] = {
    {"POST", "/v1/jobs", SUBMIT, jobs_submit, false},
    {"GET", "/v1/jobs", LIST, jobs_list, false},
    {"GET", "/v1/jobs/{id}", NONE, jobs_get, false},
    {"DELETE", "/v1/jobs/{id}", NONE, jobs_delete, false},
    {"GET", "/v1/jobs/{id}/request", NONE, jobs_request, false},
    {"POST", "/v1/jobs/{id}/refine", NONE, jobs_refine, false},
    {"GET", "/v1/jobs/{id}/events", NONE, events_get, false},
    {"GET", "/v1/events", NONE, events_get_all, false},
    {"POST", "/v1/verify", NONE, verify_submit, false},
    {"POST", "/v1/decks", NONE, decks_translate, false},
    {"POST", "/v1/uploads", NONE, uploads_create, true},
    {"GET", "/v1/uploads/{digest}", NONE, uploads_get, false},
    {"DELETE", "/v1/uploads/{digest}", NONE, uploads_delete, false},
    {"GET", "/v1/factors", NONE, service_factors, false},
    {"GET", "/v1/limits", NONE, service_limits, false},
    {"GET", "/v1/nodes", NONE, nodes_list, false},
    {"POST", "/v1/nodes/{name}/drain", NONE, nodes_drain, false},
    {"DELETE", "/v1/nodes/{name}/drain", NONE, nodes_drain, false},
    {"POST", "/v1/admin/check", NONE, admin_check, false},
    {"GET", "/metrics", NONE, service_metrics, false},
    {"GET", "/healthz", NONE, service_health, false},
    {"GET", "/readyz", NONE, service_ready, false},
    {"GET", "/", NONE, page_get, false},
    {"GET", "/page/{name}", NONE, page_get, false},
    {"GET", "/openapi.json", NONE, service_schema, false},
    {"GET", "/schemas/{name}", NONE, service_schema, false},
};

/* These, and those of the outputs; NULL past the end. */
static const route *route_at(size_t i)
{
    const size_t own = sizeof ROUTES / sizeof ROUTES[0];
    return i < own ? &ROUTES[i] : OUTPUTS[i - own].type ? &OUTPUTS[i - own].route : NULL;
}

/* Compares segment by segment; what stands for a placeholder is copied to name. any: whatever its form is, which is 32
 * hexadecimal digits in lower case for {id}, 64 of them for {digest}, and a file name for {name}. */
static bool path_matches(const char *pattern, const char *path, bool any, char *name, size_t size)
{
    while (*pattern == '/' && *path == '/') {
        const size_t want = strcspn(++pattern, "/"), have = strcspn(++path, "/");
        if (*pattern == '{') {
            const size_t digits = strncmp(pattern, "{id}", 4) == 0 ? 32 : strncmp(pattern, "{digest}", 8) == 0 ? 64 : 0;
            const bool fits = digits ? have == digits && strspn(path, "0123456789abcdef") >= digits
                                     : have > 0 && have < sizeof((http_request *)0)->name;
            if (any ? have == 0 : !fits)
                return false;
            snprintf(name, size, "%.*s", (int)have, path);
        } else if (want != have || memcmp(pattern, path, have) != 0) {
            return false;
        }
        pattern += want;
        path += have;
    }
    return *pattern == '\0' && *path == '\0';
}

static void allow_also(char *allow, size_t size, const char *method)
{
    size_t len = strlen(allow);
    snprintf(allow + len, size - len, "%s%s%s", len ? ", " : "", method, strcmp(method, "GET") == 0 ? ", HEAD" : "");
}

static void answer_options(api *context, http_request *rq, http_reply *reply)
{
    (void)context;
    (void)rq;
    reply->status = 204; /* the header fields say it all */
    reply->preflight = true;
}
static const route OPTIONS = {"OPTIONS", "every path", NONE, answer_options, false};

/* What a person or a supervisor may see without a token: nothing about jobs. */
static const char *const OPEN[] = {"/", "/page/{name}", "/healthz", "/readyz", "/openapi.json", "/schemas/{name}"};

auth_scope route_scope(const route *r)
{
    if (r == &OPTIONS) /* a browser asks it before it may send a token (WHATWG Fetch, CORS preflight) */
        return SCOPE_NONE;
    for (size_t i = 0; i < sizeof OPEN / sizeof OPEN[0]; i++)
        if (strcmp(r->pattern, OPEN[i]) == 0 && strcmp(r->method, "GET") == 0)
            return SCOPE_NONE;
    if (strncmp(r->pattern, "/v1/admin/", 10) == 0 || strncmp(r->pattern, "/v1/nodes/", 10) == 0)
        return SCOPE_ADMIN;
    return strcmp(r->method, "GET") == 0 ? SCOPE_READ : SCOPE_SUBMIT;
}

bool route_find(http_request *rq, char *allow, size_t size, problem_details *problem)
{
    const char *method = strcmp(rq->method, "HEAD") == 0 ? "GET" : rq->method;
    allow[0] = '\0';
    for (size_t i = 0; route_at(i); i++) {
        const route *r = route_at(i);
        if (!path_matches(r->pattern, rq->target.path, false, rq->name, sizeof rq->name))
            continue;
        if (strcmp(r->method, method) == 0) {
            rq->route = r;
            allow[0] = '\0';
            return true;
        }
        allow_also(allow, size, r->method);
    }
    if (allow[0] && rq->reply.cors && strcmp(method, "OPTIONS") == 0) {
        allow_also(allow, size, method);
        rq->route = &OPTIONS;
        return true;
    }
    if (allow[0])
        return problem_fill(problem, 405, "method_not_allowed", "The method is not allowed here",
                            "%s is not allowed on %.200s, but %s", rq->method, rq->target.path, allow);
    /* 404, and why: an id of a wrong form is told from a path that nobody serves. */
    char name[sizeof rq->name];
    for (size_t i = 0; route_at(i); i++) {
        const char *pattern = route_at(i)->pattern;
        const bool of_job = strstr(pattern, "{id}"), of_upload = strstr(pattern, "{digest}");
        if ((of_job || of_upload) && path_matches(pattern, rq->target.path, true, name, sizeof name))
            return problem_fill(problem, 404, "not_found", "Not found",
                                "\"%.100s\" is not the id of %s: those have %d digits 0 to 9 and a to f", name,
                                of_job ? "a job" : "an upload", of_job ? 32 : 64);
    }
    return problem_fill(problem, 404, "not_found", "Not found",
                        "there is nothing at %.200s: /openapi.json lists what is", rq->target.path);
}

bool route_check_parameters(const http_request *rq, problem_details *problem)
{
    for (size_t i = 0; i < rq->target.count; i++) {
        const char *const *known = rq->route->parameters, *key = rq->target.parameters[i].key;
        while (*known && strcmp(*known, key) != 0)
            known++;
        if (*known)
            continue;
        char takes[160] = "it takes none";
        size_t used = strlen("it takes ");
        for (known = rq->route->parameters; *known && used < sizeof takes; known++)
            used += (size_t)snprintf(takes + used, sizeof takes - used, "%s%s", *known, known[1] ? ", " : "");
        return problem_fill(problem, 400, "unknown_parameter", "A query parameter is unknown",
                            "\"%.100s\" is not a parameter of %s %s; %s", key, rq->route->method, rq->route->pattern,
                            takes);
    }
    return true;
}
