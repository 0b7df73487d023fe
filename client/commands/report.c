/* report: one HTML file of all that is known of an answer. Pictures are in it as they come from the service, each an
 * image of its own (data:), so that no name in one meets that in another. */
#include "commands/fetch.h"
#include "show/report.h"
#include "text/buffer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A report on its way. */
typedef struct {
    client_session *s;
    uz_buffer *to;
    const char *id, *case_name; /* case_name NULL: the job has none */
    const json_t *summary;
} report;

static const char STYLE[] =
    "body{font:15px/1.5 system-ui,sans-serif;color:#1b1f24;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "h1{font-size:1.5rem;margin:0}h2{font-size:1.1rem;margin:2rem 0 .5rem;border-bottom:1px solid #d0d7de}"
    ".verdict{padding:.75rem 1rem;border-left:.3rem solid #b35900;background:#fff6ea;margin:1rem 0}"
    ".verdict.good{border-color:#1a7f37;background:#eefbf1}.muted{color:#57606a}"
    "table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid "
    "#e5e8ec}"
    "td.n{text-align:right;font-variant-numeric:tabular-nums}pre{white-space:pre-wrap;overflow-wrap:anywhere;"
    "font-size:.8rem;background:#f6f8fa;padding:.75rem}img{max-width:100%;height:auto;display:block;margin:.5rem 0}"
    "figure{margin:1rem 0;break-inside:avoid}tr{break-inside:avoid}@media print{body{margin:0;max-width:none}}";

/* ---- pieces */

static void put(uz_buffer *to, const char *text)
{
    uz_buffer_put(to, text, strlen(text));
}

static void put_number(uz_buffer *to, const json_t *number)
{
    if (json_is_number(number))
        uz_buffer_print(to, "<td class=\"n\">%.6g</td>", json_number_value(number));
    else
        put(to, "<td class=\"n muted\">unknown</td>");
}

static void put_vector(uz_buffer *to, const json_t *vector)
{
    put(to, "<td>");
    for (size_t i = 0; i < json_array_size(vector); i++) {
        const json_t *number = json_array_get(vector, i);
        put(to, i ? ", " : "(");
        if (json_is_number(number))
            uz_buffer_print(to, "%.6g", json_number_value(number));
        else
            put(to, "unknown");
    }
    put(to, json_array_size(vector) ? ")</td>" : "</td>");
}

/* A list of the summary as a table, with a column for each of these; nothing where it is empty. */
typedef struct {
    const char *head, *key;
    const char *otherwise; /* the key of a text that stands for one that is not there */
    enum { CELL_TEXT, CELL_NUMBER, CELL_VECTOR } kind;
    const char *unit, *power; /* "length", "force" or "stress", by which problem.units calls it, NULL: none; "\u00b2" */
} column;

/* How many of the list have what a table is about; key NULL: all. */
static size_t count_having(const json_t *list, const char *key)
{
    size_t count = 0;
    for (size_t i = 0; i < json_array_size(list); i++)
        count += !key || json_object_get(json_array_get(list, i), key);
    return count;
}

/* having: only of those that have this key; NULL: of all. */
static void put_table(const report *r, const char *caption, const char *list_at, const char *having,
                      const column *columns, size_t count)
{
    const json_t *list = client_json_at(r->summary, list_at), *one;
    size_t i;
    if (count_having(list, having) == 0)
        return;
    uz_buffer_print(r->to, "<h2>%s</h2><table><tr>", caption);
    for (size_t k = 0; k < count; k++) {
        const char *key = columns[k].unit;
        const char *unit = key ? client_json_text(client_json_at(r->summary, "problem.units"), key) : "";
        uz_buffer_print(r->to, "<th>%s%s", columns[k].head, *unit ? ", " : "");
        uz_buffer_put_escaped(r->to, unit);
        uz_buffer_print(r->to, "%s</th>", *unit && columns[k].power ? columns[k].power : "");
    }
    put(r->to, "</tr>\n");
    json_array_foreach(list, i, one)
    {
        if (having && !json_object_get(one, having))
            continue;
        put(r->to, "<tr>");
        for (size_t k = 0; k < count; k++) {
            const column *c = &columns[k];
            const char *text = client_json_text(one, c->key);
            if (c->kind == CELL_TEXT) {
                put(r->to, "<td>");
                uz_buffer_put_escaped(r->to, *text || !c->otherwise ? text : client_json_text(one, c->otherwise));
                put(r->to, "</td>");
            } else {
                (c->kind == CELL_NUMBER ? put_number : put_vector)(r->to, client_json_at(one, c->key));
            }
        }
        put(r->to, "</tr>\n");
    }
    put(r->to, "</table>\n");
}

/* ---- parts */

static bool is_scene(const report *r)
{
    return strcmp(client_json_text(r->summary, "problem.kind"), "scene") == 0;
}

static void put_verdict(const report *r, const json_t *job)
{
    const json_t *asserted = client_json_at(r->summary, "assertions_passed");
    const bool good = strcmp(client_json_text(r->summary, "outcome"), "converged") == 0 && !json_is_false(asserted);
    char error[32];
    uz_buffer_print(r->to, "<p class=\"verdict%s\"><strong>", good ? " good" : "");
    uz_buffer_put_escaped(r->to, *client_json_text(r->summary, "outcome") ? client_json_text(r->summary, "outcome")
                                                                          : client_json_text(job, "status"));
    put(r->to, "</strong>");
    if (is_scene(r) && json_is_object(client_json_at(r->summary, "error"))) {
        put(r->to, "; the whole error, of mesh and equations together, is ");
        uz_buffer_put_escaped(r->to, client_format_error(error, r->summary));
        uz_buffer_print(r->to, ", relative, in the energy norm (%s)", client_json_text(r->summary, "error.kind"));
    } else if (isfinite(client_json_number(r->summary, "certificate.relative_error"))) {
        put(r->to, "; the exact solution of these equations is within ");
        uz_buffer_put_escaped(r->to,
                              client_format_bound(error, client_json_number(r->summary, "certificate.relative_error")));
        put(r->to, ", relative, in the energy norm");
    }
    if (json_is_boolean(asserted))
        put(r->to, json_is_true(asserted) ? "; every assertion passes" : "; an assertion fails");
    put(r->to, ".");
    if (*client_json_text(r->summary, "message")) {
        put(r->to, " ");
        uz_buffer_put_escaped(r->to, client_json_text(r->summary, "message"));
    }
    put(r->to, "</p>\n");
}

static void put_tables(const report *r)
{
    static const column QUANTITIES[] = {{"Name", "name", NULL, CELL_TEXT, NULL, NULL},
                                        {"Value", "value", NULL, CELL_NUMBER, NULL, NULL},
                                        {"From", "low", NULL, CELL_NUMBER, NULL, NULL},
                                        {"To", "high", NULL, CELL_NUMBER, NULL, NULL},
                                        {"On this mesh", "on_this_mesh", NULL, CELL_NUMBER, NULL, NULL},
                                        {"How sure", "kind", NULL, CELL_TEXT, NULL, NULL}},
                        CONTACTS[] = {{"On", "on", NULL, CELL_TEXT, NULL, NULL},
                                      {"Force", "force", NULL, CELL_VECTOR, "force", NULL},
                                      {"Normal force", "normal_force", NULL, CELL_NUMBER, "force", NULL},
                                      {"Mean pressure", "mean_pressure", NULL, CELL_NUMBER, "stress", NULL},
                                      {"Largest", "max_pressure", NULL, CELL_NUMBER, "stress", NULL},
                                      {"Area", "area", NULL, CELL_NUMBER, "length", "\u00b2"},
                                      {"Center of pressure", "center", NULL, CELL_VECTOR, "length", NULL}},
                        RIGID[] = {{"On", "on", NULL, CELL_TEXT, NULL, NULL},
                                   {"Point", "rigid.point", NULL, CELL_VECTOR, "length", NULL},
                                   {"Displacement", "rigid.displacement", NULL, CELL_VECTOR, "length", NULL},
                                   {"Rotation, degrees", "rigid.rotation", NULL, CELL_VECTOR, NULL, NULL},
                                   {"Force", "force", NULL, CELL_VECTOR, "force", NULL},
                                   {"Moment at the point", "rigid.moment", NULL, CELL_VECTOR, NULL, NULL}},
                        ASSERTIONS[] = {{"Result", "result", NULL, CELL_TEXT, NULL, NULL},
                                        {"Quantity", "name", "quantity", CELL_TEXT, NULL, NULL},
                                        {"Value", "value", NULL, CELL_NUMBER, NULL, NULL},
                                        {"Why", "reason", NULL, CELL_TEXT, NULL, NULL}};
    put_table(r, "Quantities", "quantities", NULL, QUANTITIES, sizeof QUANTITIES / sizeof QUANTITIES[0]);
    put_table(r, "Contacts, on this mesh", "resultants.contacts", NULL, CONTACTS, sizeof CONTACTS / sizeof CONTACTS[0]);
    put_table(r, "Rigid groups", "resultants.supports", "rigid", RIGID, sizeof RIGID / sizeof RIGID[0]);
    put_table(r, "Assertions", "assertions", NULL, ASSERTIONS, sizeof ASSERTIONS / sizeof ASSERTIONS[0]);
}

static void put_warnings(const report *r)
{
    const json_t *list = client_json_at(r->summary, "warnings"), *one;
    size_t i;
    if (json_array_size(list) == 0)
        return;
    put(r->to, "<h2>Warnings</h2><ul>");
    json_array_foreach(list, i, one)
    {
        put(r->to, "<li><strong>");
        uz_buffer_put_escaped(r->to, client_json_text(one, "code"));
        put(r->to, "</strong>: ");
        uz_buffer_put_escaped(r->to, client_json_text(one, "message"));
        put(r->to, "</li>");
    }
    put(r->to, "</ul>\n");
}

/* A picture of the service's. One that it does not have for this job, or of a body without an answer (409), is left
 * out. */
static client_exit put_picture(const report *r, const char *suffix, const char *colour, const char *caption)
{
    const client_query query[] = {{"colour", colour}, {"case", r->case_name}, {NULL, NULL}};
    char *path = client_path_with_query(r->s, r->id, suffix, query);
    client_reply reply;
    if (!path)
        return CLIENT_LOCAL;
    const client_request request = client_request_new(r->s, "GET", path);
    const client_http_end end = client_http_send(r->s->http, &reply, &request);
    client_exit code = CLIENT_OK;
    if (end == CLIENT_HTTP_ANSWERED && reply.status == 200 && reply.body.len > 0) {
        put(r->to, "<figure><img alt=\"");
        uz_buffer_put_escaped(r->to, caption);
        put(r->to, "\" src=\"data:image/svg+xml;base64,");
        uz_buffer_put_base64(r->to, reply.body.data, reply.body.len);
        put(r->to, "\"><figcaption class=\"muted\">");
        uz_buffer_put_escaped(r->to, caption);
        put(r->to, "</figcaption></figure>\n");
    } else if (end != CLIENT_HTTP_ANSWERED || reply.status != 409) {
        code = client_explain(r->s, end, &reply);
    }
    client_reply_clear(&reply);
    free(path);
    return code;
}

static client_exit put_pictures(const report *r)
{
    static const struct {
        const char *suffix, *colour, *caption;
        bool of_scenes;
    } PICTURES[] = {
        {"/deformed.svg", "pressure", "The deformed body; colour: contact pressure", true},
        {"/deformed.svg", "von_mises", "The deformed body; colour: von Mises' stress", true},
        {"/whole-error.svg", NULL, "The whole error over the time that it took", true},
        {"/convergence.svg", NULL, "How it converged: dual objective, residual, certified bound", false},
    };
    client_exit code = CLIENT_OK;
    put(r->to, "<h2>Pictures</h2>\n");
    for (size_t i = 0; i < sizeof PICTURES / sizeof PICTURES[0] && code == CLIENT_OK; i++)
        if (is_scene(r) || !PICTURES[i].of_scenes)
            code = put_picture(r, PICTURES[i].suffix, PICTURES[i].colour, PICTURES[i].caption);
    return code;
}

/* What a print function says, in a block. */
static void put_words(const report *r, const char *head, void (*print)(FILE *to, const json_t *value),
                      const json_t *value)
{
    char *words = NULL;
    size_t len = 0;
    FILE *memory = open_memstream(&words, &len);
    if (!memory)
        return;
    print(memory, value);
    if (fclose(memory) == 0) {
        uz_buffer_print(r->to, "<h2>%s</h2><pre>", head);
        uz_buffer_put_escaped(r->to, words);
        put(r->to, "</pre>\n");
    }
    free(words);
}

static client_exit put_request(const report *r)
{
    json_t *request;
    const client_exit code = client_get_json(r->s, &request, client_job_path(r->s, r->id, "/request"));
    char *text = request ? json_dumps(request, JSON_INDENT(2)) : NULL;
    if (text) {
        put(r->to, "<h2>Request</h2><details><summary>What was asked, as JSON</summary><pre>");
        uz_buffer_put_escaped(r->to, text);
        put(r->to, "</pre></details>\n");
    }
    free(text);
    json_decref(request);
    return code;
}

/* ---- the whole */

static client_exit put_report(report *r, const json_t *job, const json_t *cases)
{
    static const char *const TIMES[] = {"created", "started", "finished"};
    uz_buffer_print(r->to,
                    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Contact report %.8s</title>"
                    "<meta name=\"viewport\" content=\"width=device-width\"><style>",
                    r->id);
    put(r->to, STYLE);
    uz_buffer_print(r->to, "</style>\n<h1>Contact report</h1><p class=\"muted\">Job <code>%s</code> of ", r->id);
    uz_buffer_put_escaped(r->to, r->s->options->server);
    for (size_t i = 0; i < sizeof TIMES / sizeof TIMES[0]; i++) {
        uz_buffer_print(r->to, ", %s ", TIMES[i]);
        uz_buffer_put_escaped(r->to, client_json_text(job, TIMES[i]));
    }
    uz_buffer_print(r->to, "; written by uzawa %s", CLIENT_VERSION_TEXT);
    if (r->case_name) {
        put(r->to, ". Load case <strong>");
        uz_buffer_put_escaped(r->to, r->case_name);
        put(r->to, "</strong>");
    }
    put(r->to, ".</p>\n");
    put_verdict(r, job);
    put_warnings(r);
    put_tables(r);
    client_exit code = put_pictures(r);
    if (cases)
        put_words(r, "Load cases", client_print_cases, cases);
    put_words(r, "Summary", client_print_summary, job);
    return code == CLIENT_OK ? put_request(r) : code;
}

/* The case that is asked for, or the worst: its summary in place of the job's. */
static client_exit choose_case(report *r, const json_t *job, json_t **cases)
{
    const char *asked = r->s->options->case_name;
    const json_t *one;
    size_t i;
    if (!json_is_object(client_json_at(job, "summary.cases")))
        return asked ? client_complain(r->s, CLIENT_USAGE, "the job has no load cases") : CLIENT_OK;
    const client_exit code = client_get_json(r->s, cases, client_job_path(r->s, r->id, "/result?fields=summary"));
    r->case_name = asked ? asked : client_json_text(job, "summary.cases.worst");
    json_array_foreach(json_object_get(*cases, "cases"), i, one)
    {
        if (strcmp(client_json_text(one, "name"), r->case_name) != 0)
            continue;
        r->summary = json_object_get(one, "summary");
        return CLIENT_OK;
    }
    return code == CLIENT_OK ? client_complain(r->s, CLIENT_USAGE, "the job has no load case of that name") : code;
}

client_exit client_report(client_session *s)
{
    json_t *job, *cases = NULL;
    uz_buffer text = {.data = NULL};
    char *page = NULL;
    size_t len = 0;
    client_exit code = client_get_json(s, &job, client_job_path(s, s->options->operand, ""));
    report r = {.s = s, .to = &text, .id = client_json_text(job, "id"), .summary = json_object_get(job, "summary")};
    if (code == CLIENT_OK && !json_is_object(r.summary))
        code = client_complain(s, CLIENT_REFUSED, "the job has no answer to report on: uzawa status says what it has");
    if (code == CLIENT_OK)
        code = choose_case(&r, job, &cases);
    if (code == CLIENT_OK)
        code = put_report(&r, job, cases);
    if (code == CLIENT_OK && uz_buffer_finish(&page, &len, &text, NULL) != UZ_OK)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    uz_buffer_drop(&text);
    if (code == CLIENT_OK)
        code = client_deliver(s, page, len);
    free(page);
    json_decref(cases);
    json_decref(job);
    return code;
}
