/* report: one HTML file of all that is known of an answer. Pictures are in it as they come from the service, each an
 * image of its own (data:), so that no name in one meets that in another. */
#include "commands/fetch.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A report on its way. */
typedef struct {
    client_session *s;
    FILE *to;
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

static void put_text(FILE *to, const char *text)
{
    for (; *text; text++)
        switch (*text) {
        case '<':
            fputs("&lt;", to);
            break;
        case '>':
            fputs("&gt;", to);
            break;
        case '&':
            fputs("&amp;", to);
            break;
        case '"':
            fputs("&quot;", to);
            break;
        default:
            fputc(*text, to);
        }
}

/* Base64 (RFC 4648, section 4). */
static void put_base64(FILE *to, const unsigned char *bytes, size_t len)
{
    static const char DIGITS[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < len; i += 3) {
        const size_t left = len - i;
        const unsigned three = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
                               (left > 2 ? (unsigned)bytes[i + 2] : 0);
        fputc(DIGITS[three >> 18], to);
        fputc(DIGITS[three >> 12 & 63], to);
        fputc(left > 1 ? DIGITS[three >> 6 & 63] : '=', to);
        fputc(left > 2 ? DIGITS[three & 63] : '=', to);
    }
}

static void put_heads(FILE *to, const char *caption, const char *const *heads)
{
    fprintf(to, "<h2>%s</h2><table><tr>", caption);
    for (; *heads; heads++)
        fprintf(to, "<th>%s</th>", *heads);
    fputs("</tr>\n", to);
}

static void put_cell(FILE *to, const char *text)
{
    fputs("<td>", to);
    put_text(to, text);
    fputs("</td>", to);
}

static void put_number(FILE *to, const json_t *number)
{
    if (json_is_number(number))
        fprintf(to, "<td class=\"n\">%.6g</td>", json_number_value(number));
    else
        fputs("<td class=\"n muted\">unknown</td>", to);
}

static void put_vector(FILE *to, const json_t *vector)
{
    fputs("<td>", to);
    for (size_t i = 0; i < json_array_size(vector); i++) {
        const json_t *number = json_array_get(vector, i);
        if (json_is_number(number))
            fprintf(to, "%s%.6g", i ? ", " : "(", json_number_value(number));
        else
            fprintf(to, "%sunknown", i ? ", " : "(");
    }
    fputs(json_array_size(vector) ? ")</td>" : "</td>", to);
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
    fprintf(r->to, "<p class=\"verdict%s\"><strong>", good ? " good" : "");
    put_text(r->to, *client_json_text(r->summary, "outcome") ? client_json_text(r->summary, "outcome")
                                                             : client_json_text(job, "status"));
    fputs("</strong>", r->to);
    if (is_scene(r) && json_is_object(client_json_at(r->summary, "error"))) {
        fputs("; the whole error, of mesh and equations together, is ", r->to);
        put_text(r->to, client_format_error(error, r->summary));
        fprintf(r->to, ", relative, in the energy norm (%s)", client_json_text(r->summary, "error.kind"));
    } else if (isfinite(client_json_number(r->summary, "certificate.relative_error"))) {
        fputs("; the exact solution of these equations is within ", r->to);
        put_text(r->to, client_format_bound(error, client_json_number(r->summary, "certificate.relative_error")));
        fputs(", relative, in the energy norm", r->to);
    }
    if (json_is_boolean(asserted))
        fputs(json_is_true(asserted) ? "; every assertion passes" : "; an assertion fails", r->to);
    fputs(".", r->to);
    if (*client_json_text(r->summary, "message")) {
        fputc(' ', r->to);
        put_text(r->to, client_json_text(r->summary, "message"));
    }
    fputs("</p>\n", r->to);
}

static void put_quantities(const report *r)
{
    static const char *const HEADS[] = {"Name", "Value", "From", "To", "On this mesh", "How sure", NULL};
    const json_t *list = client_json_at(r->summary, "quantities"), *one;
    size_t i;
    if (json_array_size(list) == 0)
        return;
    put_heads(r->to, "Quantities", HEADS);
    json_array_foreach(list, i, one)
    {
        fputs("<tr>", r->to);
        put_cell(r->to, client_json_text(one, "name"));
        put_number(r->to, client_json_at(one, "value"));
        put_number(r->to, client_json_at(one, "low"));
        put_number(r->to, client_json_at(one, "high"));
        put_number(r->to, client_json_at(one, "on_this_mesh"));
        put_cell(r->to, client_json_text(one, "kind"));
        fputs("</tr>\n", r->to);
    }
    fputs("</table>\n", r->to);
}

static void put_contacts(const report *r)
{
    static const char *const HEADS[] = {"On",      "Force", "Normal force",       "Mean pressure",
                                        "Largest", "Area",  "Center of pressure", NULL};
    static const char *const NUMBERS[] = {"normal_force", "mean_pressure", "max_pressure", "area"};
    const json_t *list = client_json_at(r->summary, "resultants.contacts"), *one;
    size_t i;
    if (json_array_size(list) == 0)
        return;
    put_heads(r->to, "Contacts, on this mesh", HEADS);
    json_array_foreach(list, i, one)
    {
        fputs("<tr>", r->to);
        put_cell(r->to, client_json_text(one, "on"));
        put_vector(r->to, client_json_at(one, "force"));
        for (size_t k = 0; k < sizeof NUMBERS / sizeof NUMBERS[0]; k++)
            put_number(r->to, client_json_at(one, NUMBERS[k]));
        put_vector(r->to, client_json_at(one, "center"));
        fputs("</tr>\n", r->to);
    }
    fputs("</table>\n", r->to);
}

static void put_assertions(const report *r)
{
    static const char *const HEADS[] = {"Result", "Quantity", "Value", "Why", NULL};
    const json_t *list = client_json_at(r->summary, "assertions"), *one;
    size_t i;
    if (json_array_size(list) == 0)
        return;
    put_heads(r->to, "Assertions", HEADS);
    json_array_foreach(list, i, one)
    {
        const char *name = client_json_text(one, "name");
        fputs("<tr>", r->to);
        put_cell(r->to, client_json_text(one, "result"));
        put_cell(r->to, *name ? name : client_json_text(one, "quantity"));
        put_number(r->to, client_json_at(one, "value"));
        put_cell(r->to, client_json_text(one, "reason"));
        fputs("</tr>\n", r->to);
    }
    fputs("</table>\n", r->to);
}

static void put_warnings(const report *r)
{
    const json_t *list = client_json_at(r->summary, "warnings"), *one;
    size_t i;
    if (json_array_size(list) == 0)
        return;
    fputs("<h2>Warnings</h2><ul>", r->to);
    json_array_foreach(list, i, one)
    {
        fputs("<li><strong>", r->to);
        put_text(r->to, client_json_text(one, "code"));
        fputs("</strong>: ", r->to);
        put_text(r->to, client_json_text(one, "message"));
        fputs("</li>", r->to);
    }
    fputs("</ul>\n", r->to);
}

/* A picture of the service's. One that it does not have for this job (409) is left out. */
static client_exit put_picture(const report *r, const char *suffix, const char *colour, const char *caption)
{
    const client_query query[] = {{"colour", colour}, {"case", r->case_name}, {NULL, NULL}};
    char *path = client_path_with_query(r->s, suffix, query);
    client_reply reply;
    if (!path)
        return CLIENT_LOCAL;
    const client_request request = client_request_new(r->s, "GET", path);
    const client_http_end end = client_http_send(r->s->http, &reply, &request);
    client_exit code = CLIENT_OK;
    if (end == CLIENT_HTTP_ANSWERED && reply.status == 200 && reply.body.len > 0) {
        fputs("<figure><img alt=\"", r->to);
        put_text(r->to, caption);
        fputs("\" src=\"data:image/svg+xml;base64,", r->to);
        put_base64(r->to, (const unsigned char *)reply.body.data, reply.body.len);
        fputs("\"><figcaption class=\"muted\">", r->to);
        put_text(r->to, caption);
        fputs("</figcaption></figure>\n", r->to);
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
    fputs("<h2>Pictures</h2>\n", r->to);
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
        fprintf(r->to, "<h2>%s</h2><pre>", head);
        put_text(r->to, words);
        fputs("</pre>\n", r->to);
    }
    free(words);
}

static client_exit put_request(const report *r)
{
    json_t *request;
    const client_exit code = client_get_json(r->s, &request, client_job_path(r->s, r->id, "/request"));
    char *text = request ? json_dumps(request, JSON_INDENT(2)) : NULL;
    if (text) {
        fputs("<h2>Request</h2><details><summary>What was asked, as JSON</summary><pre>", r->to);
        put_text(r->to, text);
        fputs("</pre></details>\n", r->to);
    }
    free(text);
    json_decref(request);
    return code;
}

/* ---- the whole */

static client_exit put_report(report *r, const json_t *job, const json_t *cases)
{
    static const char *const TIMES[] = {"created", "started", "finished"};
    fprintf(r->to,
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Contact report %.8s</title>"
            "<meta name=\"viewport\" content=\"width=device-width\"><style>%s</style>\n<h1>Contact report</h1>"
            "<p class=\"muted\">Job <code>%s</code> of ",
            r->id, STYLE, r->id);
    put_text(r->to, r->s->options->server);
    for (size_t i = 0; i < sizeof TIMES / sizeof TIMES[0]; i++) {
        fprintf(r->to, ", %s ", TIMES[i]);
        put_text(r->to, client_json_text(job, TIMES[i]));
    }
    fprintf(r->to, "; written by uzawa %s", CLIENT_VERSION_TEXT);
    if (r->case_name) {
        fputs(". Load case <strong>", r->to);
        put_text(r->to, r->case_name);
        fputs("</strong>", r->to);
    }
    fputs(".</p>\n", r->to);
    put_verdict(r, job);
    put_warnings(r);
    put_quantities(r);
    put_contacts(r);
    put_assertions(r);
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
    char *page = NULL;
    size_t len = 0;
    client_exit code = client_get_json(s, &job, client_job_path(s, s->options->operand, ""));
    report r = {.s = s, .id = client_json_text(job, "id"), .summary = json_object_get(job, "summary")};
    if (code == CLIENT_OK && !json_is_object(r.summary))
        code = client_complain(s, CLIENT_REFUSED, "the job has no answer to report on: uzawa status says what it has");
    if (code == CLIENT_OK)
        code = choose_case(&r, job, &cases);
    if (code == CLIENT_OK && !(r.to = open_memstream(&page, &len)))
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    if (code == CLIENT_OK)
        code = put_report(&r, job, cases);
    if (r.to && fclose(r.to) != 0 && code == CLIENT_OK)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    if (code == CLIENT_OK)
        code = client_deliver(s, page, len);
    free(page);
    json_decref(cases);
    json_decref(job);
    return code;
}
