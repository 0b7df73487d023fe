#include "show/checks.h"
#include "local/files.h"
#include "show/report.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- the list */

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
    bool ok = check.group && check.name && check.text;
    if (ok && to->count == to->capacity) {
        const size_t capacity = to->capacity ? 2 * to->capacity : 16;
        client_check *grown = realloc(to->item, capacity * sizeof *grown);
        ok = grown != NULL;
        if (grown) {
            to->item = grown;
            to->capacity = capacity;
        }
    }
    if (ok)
        to->item[to->count++] = check;
    else {
        clear_check(&check);
        to->failed = true;
    }
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
    char bound[32], quantities[4 * CLIENT_QUANTITY] = "";
    client_format_error(bound, client_json_at(job, "summary"));
    const json_t *one;
    size_t i, used = 0;
    json_array_foreach(client_json_at(job, "summary.quantities"), i, one)
    {
        char text[CLIENT_QUANTITY];
        if (used < sizeof quantities)
            used += (size_t)snprintf(quantities + used, sizeof quantities - used, "; %s",
                                     client_format_quantity(text, one));
    }
    if (!client_job_ended(job))
        client_checks_add(to, CLIENT_NO_ANSWER, "", NAME, "the job has not ended");
    else if (!*outcome)
        client_checks_add(to, CLIENT_NO_ANSWER, "", NAME, "%s",
                          *detail  ? detail
                          : *title ? title
                                   : "the job left no answer and no reason");
    else if (strcmp(outcome, "converged") == 0 || strcmp(outcome, "verified") == 0)
        client_checks_add(to, CLIENT_PASS, "", NAME, "%s: whole relative error %s%s", outcome, bound, quantities);
    else
        client_checks_add(to, CLIENT_FAIL, "", NAME, "%s%s%s", outcome, *message ? ": " : "", message);
}

/* ---- assertions */

/* "the exact one within ...", or of a quantity's interval how that is known. */
static const char *how_known(const json_t *summary, const json_t *line)
{
    const char *name = client_json_text(line, "quantity");
    const json_t *quantity;
    size_t i;
    if (strncmp(name, "contact.", 8) == 0)
        return "by estimate";
    if (strncmp(name, "quantities.", 11) != 0)
        return "the exact one";
    json_array_foreach(json_object_get(summary, "quantities"), i,
                       quantity) if (strcmp(client_json_text(quantity, "name"), name + 11) == 0 &&
                                     strcmp(client_json_text(quantity, "kind"), "guaranteed") == 0) return "guaranteed";
    return "by estimate";
}

void client_checks_assertions(client_checks *to, const json_t *summary, const char *group)
{
    static const char *const LIMITS[][2] = {{"min", "at least"}, {"max", "at most"}, {"near", "near"}};
    const json_t *lines = json_object_get(summary, "assertions"), *line;
    char name[400], text[400], bound[32];
    size_t i;
    json_array_foreach((json_t *)lines, i, line)
    {
        const char *result = client_json_text(line, "result"), *own = client_json_text(line, "name");
        const client_verdict verdict = strcmp(result, "pass") == 0        ? CLIENT_PASS
                                       : strcmp(result, "uncertain") == 0 ? CLIENT_UNCERTAIN
                                                                          : CLIENT_FAIL;
        /* The user's own name, or what is asserted: "energy at least 1 at most 3"; "gap near 5". */
        snprintf(name, sizeof name, "%s", *own ? own : client_json_text(line, "quantity"));
        for (size_t k = 0; !*own && k < sizeof LIMITS / sizeof LIMITS[0]; k++) {
            double value = client_json_number(line, LIMITS[k][0]);
            size_t end = strlen(name);
            if (isfinite(value))
                snprintf(name + end, sizeof name - end, " %s %.9g", LIMITS[k][1], value);
        }
        /* What was found: the value, how exact it is, and of how many cases that is true. */
        const double found = client_json_number(line, "value"), error = client_json_number(line, "error");
        const double failed = client_json_number(line, "cases.fail");
        const double open = client_json_number(line, "cases.uncertain");
        const char *reason = client_json_text(line, "reason"), *of = client_json_text(line, "case");
        int used = snprintf(text, sizeof text, "%s", reason);
        if (!*reason && error > 0)
            used = snprintf(text, sizeof text, "%.9g, %s within %s", found, how_known(summary, line),
                            client_format_bound(bound, error));
        else if (!*reason)
            used = snprintf(text, sizeof text, "%.9g", found);
        if (*of && used > 0 && (size_t)used < sizeof text)
            used += snprintf(text + used, sizeof text - (size_t)used, " (case %s", of);
        if (*of && used > 0 && (size_t)used < sizeof text)
            snprintf(text + used, sizeof text - (size_t)used, failed + open > 1 ? "; %.0f cases in all)" : ")",
                     failed + open);
        client_checks_add(to, verdict, group, name, "%s", text);
    }
}

/* ---- print */

void client_checks_print(FILE *to, const client_checks *checks, size_t from, const char *heading)
{
    static const char *const WORDS[] = {"pass", "uncertain", "FAIL", "FAIL"};
    size_t passed = 0;
    if (from >= checks->count)
        return;
    for (size_t i = from; i < checks->count; i++)
        passed += checks->item[i].verdict == CLIENT_PASS;
    fprintf(to, "%-12s%zu of %zu pass\n", heading, passed, checks->count - from);
    for (size_t i = from; i < checks->count; i++) {
        const client_check *check = &checks->item[i];
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
}
