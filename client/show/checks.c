#include "show/checks.h"
#include "local/files.h"
#include "show/report.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- the list */

static bool grow(client_checks *to)
{
    if (to->count < to->capacity)
        return true;
    size_t capacity = to->capacity ? 2 * to->capacity : 16;
    client_check *grown = realloc(to->item, capacity * sizeof *grown);
    if (!grown)
        return false;
    to->item = grown;
    to->capacity = capacity;
    return true;
}

static void clear_check(client_check *check)
{
    free(check->group);
    free(check->name);
    free(check->text);
}

void client_checks_add(client_checks *to, client_verdict verdict, const char *group, const char *name,
                       const char *format, ...)
{
    va_list args;
    client_check check = {.verdict = verdict, .group = strdup(group), .name = strdup(name)};
    va_start(args, format);
    if (vasprintf(&check.text, format, args) < 0)
        check.text = NULL;
    va_end(args);
    if (check.group && check.name && check.text && grow(to)) {
        to->item[to->count++] = check;
        return;
    }
    clear_check(&check);
    to->failed = true;
}

void client_checks_clear(client_checks *checks)
{
    for (size_t i = 0; i < checks->count; i++)
        clear_check(&checks->item[i]);
    free(checks->item);
    *checks = (client_checks){.item = NULL};
}

client_verdict client_checks_worst(const client_checks *checks, size_t from)
{
    client_verdict worst = CLIENT_PASS;
    for (size_t i = from; i < checks->count; i++)
        worst = checks->item[i].verdict > worst ? checks->item[i].verdict : worst;
    return worst;
}

/* ---- outcome */

void client_checks_outcome(client_checks *to, const json_t *job)
{
    static const char NAME[] = "converged";
    const char *outcome = client_json_text(job, "summary.outcome"), *message = client_json_text(job, "summary.message");
    const char *detail = client_json_text(job, "error.detail"), *title = client_json_text(job, "error.title");
    char bound[32];
    client_format_bound(bound, client_json_number(job, "summary.certificate.relative_error"));
    if (!client_job_ended(job))
        client_checks_add(to, CLIENT_NO_ANSWER, "", NAME, "the job has not ended");
    else if (!*outcome)
        client_checks_add(to, CLIENT_NO_ANSWER, "", NAME, "%s",
                          *detail  ? detail
                          : *title ? title
                                   : "the job left no answer and no reason");
    else if (strcmp(outcome, "converged") == 0 || strcmp(outcome, "verified") == 0)
        client_checks_add(to, CLIENT_PASS, "", NAME, "%s: certified relative error %s", outcome, bound);
    else
        client_checks_add(to, CLIENT_FAIL, "", NAME, "%s%s%s", outcome, *message ? ": " : "", message);
}

/* ---- assertions */

static client_verdict verdict_of(const json_t *line)
{
    const char *result = client_json_text(line, "result");
    return strcmp(result, "pass") == 0        ? CLIENT_PASS
           : strcmp(result, "uncertain") == 0 ? CLIENT_UNCERTAIN
                                              : CLIENT_FAIL;
}

/* The user's own name, or what is asserted. */
static void name_line(char *out, size_t size, const json_t *line)
{
    const char *name = client_json_text(line, "name");
    snprintf(out, size, "%s", *name ? name : client_json_text(line, "quantity"));
    if (!*name) {
        /* " at least 1 at most 3"; " near 5". */
        static const char *const LIMITS[][2] = {{"min", "at least"}, {"max", "at most"}, {"near", "near"}};
        for (size_t i = 0; i < sizeof LIMITS / sizeof LIMITS[0]; i++) {
            double value = client_json_number(line, LIMITS[i][0]);
            size_t used = strlen(out);
            if (isfinite(value))
                snprintf(out + used, size - used, " %s %.9g", LIMITS[i][1], value);
        }
    }
}

static void find_text(char *out, size_t size, const json_t *line)
{
    const double value = client_json_number(line, "value"), error = client_json_number(line, "error");
    const double failed = client_json_number(line, "cases.fail"), open = client_json_number(line, "cases.uncertain");
    const char *reason = client_json_text(line, "reason"), *of = client_json_text(line, "case");
    char bound[32];
    int used = snprintf(out, size, "%s", reason);
    if (!*reason && error > 0)
        used = snprintf(out, size, "%.9g, the exact one within %s", value, client_format_bound(bound, error));
    else if (!*reason)
        used = snprintf(out, size, "%.9g", value);
    if (*of && used > 0 && (size_t)used < size)
        used += snprintf(out + used, size - (size_t)used, " (case %s", of);
    if (*of && used > 0 && (size_t)used < size)
        snprintf(out + used, size - (size_t)used, failed + open > 1 ? "; %.0f cases in all)" : ")", failed + open);
}

void client_checks_assertions(client_checks *to, const json_t *summary, const char *group)
{
    const json_t *lines = json_object_get(summary, "assertions"), *line;
    char name[400], text[400];
    size_t i;
    json_array_foreach((json_t *)lines, i, line)
    {
        name_line(name, sizeof name, line);
        find_text(text, sizeof text, line);
        client_checks_add(to, verdict_of(line), group, name, "%s", text);
    }
}

/* ---- print */

static void print_check(FILE *to, const client_check *check)
{
    static const char *const WORDS[] = {"pass", "uncertain", "FAIL", "FAIL"};
    fprintf(to, "%12s%-11s", "", WORDS[check->verdict]);
    if (*check->group) {
        client_print_safe(to, check->group);
        fputs(": ", to);
    }
    client_print_safe(to, check->name);
    fputs(": ", to);
    client_print_safe(to, check->text);
    fputc('\n', to);
}

void client_checks_print(FILE *to, const client_checks *checks, size_t from, const char *heading)
{
    size_t passed = 0;
    if (from >= checks->count)
        return;
    for (size_t i = from; i < checks->count; i++)
        passed += checks->item[i].verdict == CLIENT_PASS;
    fprintf(to, "%-12s%zu of %zu pass\n", heading, passed, checks->count - from);
    for (size_t i = from; i < checks->count; i++)
        print_check(to, &checks->item[i]);
}
