#include "show/report.h"
#include "local/files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const json_t *client_json_at(const json_t *object, const char *path)
{
    while (object) {
        size_t len = strcspn(path, ".");
        char key[64];
        if (len >= sizeof key)
            return NULL;
        memcpy(key, path, len);
        key[len] = '\0';
        object = json_object_get(object, key);
        if (!path[len])
            break;
        path += len + 1;
    }
    return object;
}

double client_json_number(const json_t *object, const char *path)
{
    const json_t *value = client_json_at(object, path);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

const char *client_json_text(const json_t *object, const char *path)
{
    const char *text = json_string_value(client_json_at(object, path));
    return text ? text : "";
}

bool client_job_ended(const json_t *job)
{
    const char *status = client_json_text(job, "status");
    return strcmp(status, "successful") == 0 || strcmp(status, "failed") == 0 || strcmp(status, "dismissed") == 0;
}

client_exit client_job_exit(const json_t *job)
{
    const char *status = client_json_text(job, "status"), *outcome = client_json_text(job, "summary.outcome");
    const json_t *line;
    size_t i;
    if (strcmp(outcome, "infeasible") == 0)
        return CLIENT_INFEASIBLE;
    if (strcmp(status, "dismissed") == 0 || strcmp(outcome, "dismissed") == 0)
        return CLIENT_DISMISSED;
    if (strcmp(status, "failed") == 0)
        return CLIENT_JOB_FAILED;
    json_array_foreach(client_json_at(job, "summary.assertions"), i, line)
    {
        if (strcmp(client_json_text(line, "result"), "fail") == 0)
            return CLIENT_ASSERTION_FAILED; /* surely, whatever a finer answer would be */
    }
    if (strcmp(outcome, "converged") != 0 && strcmp(outcome, "verified") != 0)
        return CLIENT_NOT_CONVERGED;
    return json_is_false(client_json_at(job, "summary.assertions_passed")) ? CLIENT_ASSERTION_FAILED : CLIENT_OK;
}

const char *client_format_seconds(char *buffer, size_t size, double seconds)
{
    if (seconds >= 1)
        snprintf(buffer, size, "%.3g s", seconds);
    else if (seconds >= 1e-3)
        snprintf(buffer, size, "%.3g ms", seconds * 1e3);
    else
        snprintf(buffer, size, "%.3g us", seconds * 1e6);
    return buffer;
}

const char *client_format_bound(char buffer[32], double bound)
{
    snprintf(buffer, 32, "%.1e", bound);
    double shown = strtod(buffer, NULL);
    if (bound > 0 && isfinite(bound) && shown < bound)
        shown += pow(10, floor(log10(shown)) - 1);
    snprintf(buffer, 32, "%.2g", shown);
    return buffer;
}

const char *client_format_error(char buffer[32], const json_t *summary)
{
    const double total = client_json_number(summary, "error.total");
    const bool estimated = strcmp(client_json_text(summary, "error.kind"), "estimated") == 0;
    if (!isfinite(total))
        strcpy(buffer, "unknown");
    else if (estimated)
        snprintf(buffer, 32, "about %.2g", total);
    else
        client_format_bound(buffer, total);
    return buffer;
}

const char *client_format_quantity(char buffer[CLIENT_QUANTITY], const json_t *quantity)
{
    const char *name = client_json_text(quantity, "name"), *why = client_json_text(quantity, "why");
    const double value = client_json_number(quantity, "value"), low = client_json_number(quantity, "low"),
                 high = client_json_number(quantity, "high"), half = 0.5 * (high - low);
    const bool proved = strcmp(client_json_text(quantity, "kind"), "guaranteed") == 0;
    char within[32], relative[32] = "";
    if (isfinite(half) && value != 0)
        snprintf(relative, sizeof relative, " (%.2g %%)", 100 * half / fabs(value));
    if (isfinite(half))
        snprintf(buffer, CLIENT_QUANTITY, "%s %.6g within %s%s, %s%s%s%s; %.6g on this mesh", name, value,
                 client_format_bound(within, half), relative, proved ? "guaranteed" : "by estimate", *why ? " (" : "",
                 why, *why ? ")" : "", client_json_number(quantity, "on_this_mesh"));
    else
        snprintf(buffer, CLIENT_QUANTITY, "%s %.6g on this mesh, without an interval%s%s", name, value,
                 *why ? ": " : "", why);
    return buffer;
}

void client_print_tags(FILE *to, const json_t *job, const char *separator)
{
    const json_t *tags = json_object_get(job, "tags");
    for (size_t i = 0; i < json_array_size(tags); i++) {
        const json_t *tag = json_array_get(tags, i);
        fputs(i ? separator : "", to);
        client_print_safe(to, json_is_string(tag) ? json_string_value(tag) : "?");
    }
}

void client_print_cell(FILE *to, const char *text, int width)
{
    char shown[256];
    size_t used = 0;
    int characters = 0;
    for (; text[used] && used + 4 < sizeof shown; used++) {
        const bool begins = ((unsigned char)text[used] & 0xc0) != 0x80; /* of a character in UTF-8 */
        if (begins && characters == width)
            break;
        characters += begins;
        shown[used] = text[used];
    }
    shown[used] = '\0';
    client_print_safe(to, shown);
    fprintf(to, "%*s", width - characters + 2, "");
}

void client_print_job(FILE *to, const json_t *job)
{
    static const char *const TIMES[] = {"created", "started", "finished"};
    double progress = client_json_number(job, "progress");
    fputs("job         ", to);
    client_print_safe(to, client_json_text(job, "id"));
    if (*client_json_text(job, "name")) {
        fputs("\nname        ", to);
        client_print_safe(to, client_json_text(job, "name"));
    }
    fputs("\nstatus      ", to);
    client_print_safe(to, client_json_text(job, "status"));
    if (!client_job_ended(job) && isfinite(progress))
        fprintf(to, ", %.0f %%", progress);
    fputc('\n', to);
    if (json_array_size(json_object_get(job, "tags"))) {
        fputs("tags        ", to);
        client_print_tags(to, job, " ");
        fputc('\n', to);
    }
    for (size_t i = 0; i < sizeof TIMES / sizeof *TIMES; i++) {
        const char *text = client_json_text(job, TIMES[i]);
        if (!*text)
            continue;
        fprintf(to, "%-12s", TIMES[i]);
        client_print_safe(to, text);
        fputc('\n', to);
    }
}

void client_print_quoted(FILE *to, const char *text)
{
    fputc('"', to);
    for (const char *c = text; *c; c++)
        fprintf(to, *c == '"' ? "\"\"" : "%c", *c);
    fputc('"', to);
}

/* Where in a request something is; nothing where it is in none. */
static void print_place(FILE *to, const json_t *problem)
{
    const char *pointer = client_json_text(problem, "pointer");
    const double line = client_json_number(problem, "line");
    if (!*pointer && !(line > 0))
        return;
    fputs("  at ", to);
    client_print_safe(to, pointer);
    if (line > 0)
        fprintf(to, "%sline %.0f", *pointer ? ", " : "", line);
    fputc('\n', to);
}

void client_print_problem(FILE *to, long http_status, const json_t *problem)
{
    const char *code = client_json_text(problem, "code");
    const char *detail = client_json_text(problem, "detail"), *title = client_json_text(problem, "title");
    const char *otherwise = http_status >= 500   ? "the server failed"
                            : http_status >= 400 ? "the server refused the request"
                                                 : "this is no reply of a contact solver service";
    const json_t *mistakes = json_object_get(problem, "mistakes");
    fputs("uzawa: ", to);
    client_print_safe(to, *detail ? detail : *title ? title : otherwise);
    fputc('\n', to);
    if (strcmp(code, "case_needed") == 0)
        fputs("  here: --case NAME\n", to);
    print_place(to, problem);
    for (size_t i = 1; i < json_array_size(mistakes); i++) { /* the first is what the problem itself says */
        fputs("uzawa: ", to);
        client_print_safe(to, client_json_text(json_array_get(mistakes, i), "detail"));
        fputc('\n', to);
        print_place(to, json_array_get(mistakes, i));
    }
    if (http_status > 0)
        fprintf(to, "  HTTP status %ld%s", http_status, *code ? ", code " : "");
    else if (*code)
        fputs("  code ", to);
    client_print_safe(to, code);
    if (http_status > 0 || *code)
        fputc('\n', to);
}

void client_print_valid(FILE *to, const char *label, const json_t *valid)
{
    const json_t *predicted = json_object_get(valid, "predicted");
    const double bytes = client_json_number(predicted, "bytes"), seconds = client_json_number(predicted, "seconds");
    char text[32];
    if (*label) {
        client_print_safe(to, label);
        fputs(": ", to);
    }
    if (!json_is_object(predicted)) {
        fputs("valid; what it will take is not known\n", to);
        return;
    }
    fprintf(to, "valid: %.0f unknowns, %.0f contact conditions", client_json_number(predicted, "d"),
            client_json_number(predicted, "m"));
    if (isfinite(seconds) && isfinite(bytes))
        fprintf(to, "; about %s and %.3g MB by the %s operator, after the assembly",
                client_format_seconds(text, sizeof text, seconds), bytes / 1e6,
                client_json_text(predicted, "operator"));
    fprintf(to, "%s\n",
            json_is_false(json_object_get(predicted, "fits")) ? "; that is more memory than it may take: it would be "
                                                                "refused"
                                                              : "");
}
