#include "show/junit.h"
#include "local/files.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- suites */

static void clear_suite(client_suite *suite)
{
    free(suite->name);
    free(suite->id);
    free(suite->created);
    free(suite->outcome);
    client_checks_clear(&suite->checks);
}

bool client_suites_add(client_suites *to, const char *name, const json_t *job, client_checks *checks)
{
    const char *outcome = client_json_text(job, "summary.outcome"), *id = client_json_text(job, "id");
    client_suite suite = {.name = strdup(name),
                          .id = strdup(id),
                          .created = strdup(client_json_text(job, "created")),
                          .outcome = strdup(*outcome ? outcome : client_json_text(job, "status")),
                          .seconds = client_json_number(job, "summary.timings_s.total")};
    client_suite *grown = realloc(to->item, (to->count + 1) * sizeof *grown);
    if (grown)
        to->item = grown;
    if (!grown || !suite.name || !suite.id || !suite.created || !suite.outcome || checks->failed) {
        clear_suite(&suite);
        return false;
    }
    suite.checks = *checks;
    *checks = (client_checks){.item = NULL};
    to->item[to->count++] = suite;
    return true;
}

void client_suites_clear(client_suites *suites)
{
    for (size_t i = 0; i < suites->count; i++)
        clear_suite(&suites->item[i]);
    free(suites->item);
    *suites = (client_suites){.item = NULL};
}

/* ---- XML */

/* Text between tags or in an attribute: what XML gives a meaning is escaped, what it forbids becomes '?'. */
static void put_text(FILE *to, const char *text)
{
    for (const char *at = text; *at; at++) {
        /* Three bytes of UTF-8 that no XML 1.0 text may have: U+FFFE and U+FFFF. */
        const bool no_character =
            (unsigned char)at[0] == 0xef && (unsigned char)at[1] == 0xbf && (unsigned char)at[2] >= 0xbe;
        const char *entity = strchr("<>&\"'\n\t", *at) ? at : NULL;
        if (entity)
            fprintf(to, "&#%d;", *at);
        else if ((unsigned char)*at < 0x20)
            fputc('?', to);
        else if (no_character) {
            fputc('?', to);
            at += 2;
        } else
            fputc(*at, to);
    }
}

static void put_attribute(FILE *to, const char *name, const char *value)
{
    fprintf(to, " %s=\"", name);
    put_text(to, value);
    fputc('"', to);
}

static const char *const TAGS[] = {
    [CLIENT_PASS] = NULL, [CLIENT_UNCERTAIN] = "failure", [CLIENT_FAIL] = "failure", [CLIENT_NO_ANSWER] = "error"};

/* The class is the suite, and the load case behind a dot. The first one has the time of all. */
static void put_check(FILE *to, const client_suite *suite, size_t i)
{
    static const char *const TYPES[] = {"", "uncertain", "fail", "no_answer"};
    const client_checks *checks = &suite->checks;
    const client_check *check = &checks->item[i];
    const char *tag = TAGS[check->verdict];
    fputs("    <testcase classname=\"", to);
    put_text(to, suite->name);
    fputs(*check->group ? "." : "", to);
    put_text(to, check->group);
    fputs(checks->compared > 0 && i >= checks->compared ? "\" name=\"baseline: " : "\" name=\"", to);
    put_text(to, check->name);
    fputc('"', to);
    fprintf(to, " time=\"%.6f\"", i == 0 && isfinite(suite->seconds) ? suite->seconds : 0.0);
    if (tag) {
        fprintf(to, ">\n      <%s", tag);
        put_attribute(to, "type", TYPES[check->verdict]);
        put_attribute(to, "message", check->text);
        fputs("/>\n    </testcase>\n", to);
    } else {
        fputs(">\n      <system-out>", to);
        put_text(to, check->text);
        fputs("</system-out>\n    </testcase>\n", to);
    }
}

/* Of these suites together. Seconds have a point whatever the locale: the client never sets LC_NUMERIC. */
static void put_counts(FILE *to, const client_suite *suites, size_t n)
{
    size_t tests = 0, failures = 0, errors = 0;
    double seconds = 0.0;
    for (size_t i = 0; i < n; i++) {
        const client_checks *checks = &suites[i].checks;
        tests += checks->count;
        for (size_t k = 0; k < checks->count; k++) {
            const char *tag = TAGS[checks->item[k].verdict];
            failures += tag && strcmp(tag, "failure") == 0;
            errors += tag && strcmp(tag, "error") == 0;
        }
        seconds += isfinite(suites[i].seconds) ? suites[i].seconds : 0.0;
    }
    fprintf(to, " tests=\"%zu\" failures=\"%zu\" errors=\"%zu\" skipped=\"0\"", tests, failures, errors);
    fprintf(to, " time=\"%.6f\"", seconds);
}

bool client_junit_write(const client_suites *suites, const char *path, char *message, size_t size)
{
    char *text = NULL;
    size_t len = 0;
    FILE *report = open_memstream(&text, &len);
    if (report) {
        fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"uzawa\"", report);
        put_counts(report, suites->item, suites->count);
        fputs(">\n", report);
        for (size_t i = 0; i < suites->count; i++) {
            const client_suite *suite = &suites->item[i];
            const client_checks *checks = &suite->checks;
            const char *const properties[][2] = {{"job", suite->id}, {"outcome", suite->outcome}};
            char created[20]; /* the common shape has whole seconds without a zone */
            snprintf(created, sizeof created, "%.19s", suite->created);
            fputs("  <testsuite", report);
            put_attribute(report, "name", suite->name);
            put_counts(report, suite, 1);
            put_attribute(report, "timestamp", created);
            fputs(">\n    <properties>\n", report);
            for (size_t k = 0; k < sizeof properties / sizeof *properties; k++) {
                fprintf(report, "      <property name=\"%s\"", properties[k][0]);
                put_attribute(report, "value", properties[k][1]);
                fputs("/>\n", report);
            }
            fputs("    </properties>\n", report);
            for (size_t k = 0; k < checks->count; k++)
                put_check(report, suite, k);
            fputs("  </testsuite>\n", report);
        }
        fputs("</testsuites>\n", report);
    }
    bool ok = report && fflush(report) == 0 && !ferror(report);
    ok = report && fclose(report) == 0 && ok;
    if (!ok)
        snprintf(message, size, "no memory for the report");
    else
        ok = client_file_write(path, text, len, message, size);
    free(text);
    return ok;
}
