/* mcp: the service as tools of a language model, by the Model Context Protocol over standard input and output: JSON-RPC
 * 2.0, a message a line (its specification, "Transports: stdio" and "Tools"). Nothing else goes to standard output.
 * What a request may be is told by the service's own schema, which is that of the tool's arguments. */
#include "commands/fetch.h"
#include "show/report.h"
#include "text/buffer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Versions of the protocol in which what is said here means the same; the newest first. */
static const char *const VERSIONS[] = {"2025-06-18", "2025-03-26", "2024-11-05"};
enum { N_VERSIONS = sizeof VERSIONS / sizeof *VERSIONS };

/* Codes of JSON-RPC 2.0, section 5.1. */
enum { NOT_JSON = -32700, NOT_A_REQUEST = -32600, NO_METHOD = -32601, WRONG_PARAMS = -32602 };

#define PATIENCE_S 20.0 /* that submit_job waits for an answer */
#define LONGEST_S  600.0

/* ---- what a tool answers */

/* {"content": [item], "isError": ...}; takes the item. */
static json_t *answer_of(json_t *item, bool error)
{
    return json_pack("{s:[o], s:b}", "content", item, "isError", error);
}

static json_t *answer_text(const char *text, size_t len, bool error)
{
    json_t *item = json_pack("{s:s, s:s%}", "type", "text", "text", text, len);
    return answer_of(item ? item : json_pack("{s:s, s:s}", "type", "text", "text", "the reply is no text"),
                     error || !item);
}

static json_t *answer_error(const char *why)
{
    return answer_text(why, strlen(why), true);
}

/* Sends it. NULL: *reply is a good one; else what the tool answers. The caller clears *reply. */
static json_t *ask(client_session *s, client_reply *reply, const client_request *request)
{
    const client_http_end end = client_http_send(s->http, reply, request);
    if (end != CLIENT_HTTP_ANSWERED)
        return answer_error(reply->message);
    if (reply->status >= 200 && reply->status < 300)
        return NULL;
    return reply->body.len ? answer_text(reply->body.data, reply->body.len, true)
                           : answer_error("the service refused without a word");
}

/* The reply's JSON, as text and, of an object, as structured content. */
static json_t *ask_json(client_session *s, const client_request *request)
{
    client_reply reply;
    json_t *answer = ask(s, &reply, request);
    if (!answer) {
        json_t *value = reply.body.data ? json_loadb(reply.body.data, reply.body.len, 0, NULL) : NULL;
        answer = value ? answer_text(reply.body.data, reply.body.len, false)
                       : answer_error("the reply is no JSON; is this the right server?");
        if (json_is_object(value))
            json_object_set(answer, "structuredContent", value);
        json_decref(value);
    }
    client_reply_clear(&reply);
    return answer;
}

/* ---- the tools */

static json_t *post(client_session *s, const char *path, const json_t *request, const char *header)
{
    char *body = json_dumps(request, JSON_COMPACT);
    client_request http = client_request_new(s, "POST", path);
    http.body = body;
    http.body_len = body ? strlen(body) : 0;
    http.headers[0] = header;
    http.repeatable = false; /* the model may ask again, and sees what there is */
    http.silence_s += PATIENCE_S;
    json_t *answer = body ? ask_json(s, &http) : answer_error("no memory");
    free(body);
    return answer;
}

static json_t *submit(client_session *s, const json_t *arguments)
{
    char header[40];
    snprintf(header, sizeof header, "Prefer: wait=%.0f", PATIENCE_S);
    return post(s, "/v1/jobs", arguments, header);
}

static json_t *validate(client_session *s, const json_t *arguments)
{
    return post(s, "/v1/jobs?validate=true", arguments, NULL);
}

/* The text of an argument; NULL: it is not given. */
static const char *given(const json_t *arguments, const char *name)
{
    return json_string_value(json_object_get(arguments, name));
}

static json_t *wait_for(client_session *s, const json_t *arguments)
{
    char header[40], *path = client_job_path(s, client_json_text(arguments, "id"), "");
    const double asked = client_json_number(arguments, "timeout_s");
    const double seconds = isnan(asked) ? PATIENCE_S : fmin(fmax(asked, 0), LONGEST_S);
    if (!path)
        return NULL;
    snprintf(header, sizeof header, "Prefer: wait=%.0f", seconds);
    client_request request = client_request_new(s, "GET", path);
    request.headers[0] = header;
    request.silence_s += seconds;
    json_t *answer = ask_json(s, &request);
    free(path);
    return answer;
}

static json_t *result(client_session *s, const json_t *arguments)
{
    const client_query query[] = {
        {"fields", given(arguments, "fields")}, {"case", given(arguments, "case")}, {NULL, NULL}};
    char *path = client_path_with_query(s, client_json_text(arguments, "id"), "/result", query);
    const client_request request = client_request_new(s, "GET", path);
    json_t *answer = path ? ask_json(s, &request) : NULL;
    free(path);
    return answer;
}

/* As PNG, which models see; where that cannot be made as SVG. */
static json_t *picture(client_session *s, const json_t *arguments)
{
    const client_query query[] = {
        {"colour", given(arguments, "colour")}, {"case", given(arguments, "case")}, {NULL, NULL}};
    client_reply reply;
    client_buffer png = {0};
    char *path = client_path_with_query(s, client_json_text(arguments, "id"), "/deformed.svg", query), *text;
    size_t len;
    if (!path)
        return NULL;
    const client_request request = client_request_new(s, "GET", path);
    json_t *answer = ask(s, &reply, &request);
    if (!answer) {
        uz_buffer base64 = {0};
        const bool seen = client_picture_to_png(s, &reply.body, &png) == CLIENT_OK;
        const client_buffer *shown = seen ? &png : &reply.body;
        uz_buffer_put_base64(&base64, shown->data, shown->len);
        if (uz_buffer_finish(&text, &len, &base64, NULL) == UZ_OK) {
            answer = answer_of(json_pack("{s:s, s:s, s:s}", "type", "image", "data", text, "mimeType",
                                         seen ? "image/png" : "image/svg+xml"),
                               false);
            free(text);
        }
    }
    free(png.data);
    client_reply_clear(&reply);
    free(path);
    return answer;
}

#define OF_A_JOB "\"id\": {\"type\": \"string\", \"description\": \"The job's id.\"}"
#define OF_A_CASE                                                                                                      \
    "\"case\": {\"type\": \"string\", \"description\": \"The name of a load case; the default is the first.\"}"

static const struct {
    const char *name, *about;
    const char *schema; /* of its arguments; NULL: the service's, of a request */
    json_t *(*run)(client_session *s, const json_t *arguments);
} TOOLS[] = {
    {"submit_job",
     "Solve a frictionless contact problem of an elastic body: the arguments are the request. Answers with the job, "
     "and, "
     "if it ends within 20 s, with its summary: outcome, whole error, contact forces and pressures, quantities, "
     "assertions, "
     "warnings. Else wait_for_job tells when it has ended. Units are any that agree with each other.",
     NULL, submit},
    {"validate_request",
     "Check a request without solving it: the arguments are the same as those of submit_job. Answers with what is "
     "wrong "
     "and where, or with the sizes, seconds and bytes that the solve is expected to take.",
     "{\"type\": \"object\"}", validate},
    {"wait_for_job", "Wait until a job has ended, and get it with its summary.",
     "{\"type\": \"object\", \"required\": [\"id\"], \"properties\": {" OF_A_JOB
     ", \"timeout_s\": {\"type\": \"number\", \"minimum\": 0, \"maximum\": 600, \"default\": 20}}}",
     wait_for},
    {"get_result", "Numbers of an ended job's answer.",
     "{\"type\": \"object\", \"required\": [\"id\", \"fields\"], \"properties\": {" OF_A_JOB
     ", \"fields\": {\"type\": \"string\", \"description\": \"A list with commas between: summary, nodes, reactions, "
     "gaps, "
     "pressure, displacements, contact_status, stress, principal, von_mises, strain. All but the summary are as long "
     "as "
     "the mesh is fine.\"}, " OF_A_CASE "}}",
     result},
    {"get_picture", "The deformed body of an ended job, as an image.",
     "{\"type\": \"object\", \"required\": [\"id\"], \"properties\": {" OF_A_JOB
     ", \"colour\": {\"type\": \"string\", \"enum\": [\"von_mises\", \"displacements\", \"pressure\"]}, " OF_A_CASE
     "}}",
     picture},
};
enum { N_TOOLS = sizeof TOOLS / sizeof *TOOLS };

/* The service's schema of a request; an object of any kind where it does not answer. */
static json_t *schema_of_request(client_session *s)
{
    client_reply reply;
    const client_request request = client_request_new(s, "GET", "/schemas/request.json");
    json_t *refused = ask(s, &reply, &request);
    json_t *schema = refused ? NULL : json_loadb(reply.body.data, reply.body.len, 0, NULL);
    json_decref(refused);
    client_reply_clear(&reply);
    return schema ? schema : json_pack("{s:s}", "type", "object");
}

static json_t *list_tools(client_session *s)
{
    json_t *list = json_array();
    for (int i = 0; i < N_TOOLS; i++) {
        json_t *schema = TOOLS[i].schema ? json_loads(TOOLS[i].schema, 0, NULL) : schema_of_request(s);
        json_array_append_new(list, json_pack("{s:s, s:s, s:o}", "name", TOOLS[i].name, "description", TOOLS[i].about,
                                              "inputSchema", schema));
    }
    return json_pack("{s:o}", "tools", list);
}

/* ---- the protocol */

static json_t *error_of(int code, const char *message)
{
    return json_pack("{s:{s:i, s:s}}", "error", "code", code, "message", message);
}

static json_t *call_tool(client_session *s, const json_t *params)
{
    const char *name = client_json_text(params, "name");
    json_t *arguments = json_object_get(params, "arguments"), *none = json_object();
    json_t *answer = NULL;
    int which = 0;
    while (which < N_TOOLS && strcmp(TOOLS[which].name, name) != 0)
        which++;
    if (which == N_TOOLS || (arguments && !json_is_object(arguments))) {
        json_decref(none);
        return error_of(WRONG_PARAMS, which == N_TOOLS ? "there is no such tool" : "arguments are an object");
    }
    answer = TOOLS[which].run(s, arguments ? arguments : none);
    json_decref(none);
    return json_pack("{s:o}", "result", answer ? answer : answer_error("no memory"));
}

static json_t *initialize(const json_t *params)
{
    const char *asked = client_json_text(params, "protocolVersion"), *version = VERSIONS[0];
    for (int i = 0; i < N_VERSIONS; i++)
        version = strcmp(asked, VERSIONS[i]) == 0 ? VERSIONS[i] : version;
    return json_pack("{s:{s:s, s:{s:{}}, s:{s:s, s:s}, s:s}}", "result", "protocolVersion", version, "capabilities",
                     "tools", "serverInfo", "name", "uzawa", "version", CLIENT_VERSION_TEXT, "instructions",
                     "Contact problems of elastic bodies, solved with a certified error. Read the whole error and the "
                     "warnings of a summary before its numbers.");
}

/* {"result": ...} or {"error": ...}; NULL: nothing is to be said. */
static json_t *respond(client_session *s, const json_t *message)
{
    const char *method = json_string_value(json_object_get(message, "method"));
    const json_t *params = json_object_get(message, "params");
    if (!method)
        return json_is_object(message) && (json_object_get(message, "result") || json_object_get(message, "error"))
                   ? NULL /* an answer to what nobody asked */
                   : error_of(NOT_A_REQUEST, "a request is an object with a method");
    if (!json_object_get(message, "id")) /* a notification */
        return NULL;
    if (strcmp(method, "initialize") == 0)
        return initialize(params);
    if (strcmp(method, "ping") == 0)
        return json_pack("{s:{}}", "result");
    if (strcmp(method, "tools/list") == 0)
        return json_pack("{s:o}", "result", list_tools(s));
    if (strcmp(method, "tools/call") == 0)
        return call_tool(s, params);
    return error_of(NO_METHOD, "there is no such method");
}

client_exit client_mcp(client_session *s)
{
    char *line = NULL;
    size_t room = 0;
    client_exit code = CLIENT_OK;
    for (ssize_t len; code == CLIENT_OK && (len = getline(&line, &room, stdin)) > 0;) {
        if (strspn(line, " \t\r\n") == (size_t)len)
            continue;
        json_t *message = json_loadb(line, (size_t)len, 0, NULL);
        json_t *reply = message ? respond(s, message) : error_of(NOT_JSON, "the line is no JSON");
        if (reply) {
            json_t *id = json_object_get(message, "id");
            json_object_set_new(reply, "jsonrpc", json_string("2.0"));
            json_object_set_new(reply, "id", id ? json_incref(id) : json_null());
            if (json_dumpf(reply, s->out, JSON_COMPACT) != 0 || fputc('\n', s->out) == EOF || fflush(s->out) != 0)
                code = CLIENT_LOCAL;
        }
        json_decref(reply);
        json_decref(message);
    }
    free(line);
    return code;
}
