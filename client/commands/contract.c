/* contract.c: --junit and --baseline: what a pipeline asks about a job beyond its exit status. */
#include "commands/baseline.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

#define TOLERANCE 1e-3 /* where --tolerance is not given */

/* Whether each converged, and its assertions. */
static client_exit add_cases(client_session *s, client_checks *to, const json_t *job)
{
    json_t *result = NULL, *of;
    size_t i;
    char *path = client_job_path(s, client_json_text(job, "id"), "/result?fields=summary");
    client_exit code = CLIENT_LOCAL;
    if (path) {
        client_request request = client_request_new(s, "GET", path);
        code = client_ask_json(s, &result, &request);
    }
    json_array_foreach(json_object_get(result, "cases"), i, of)
    {
        const json_t *summary = json_object_get(of, "summary");
        const char *outcome = client_json_text(summary, "outcome"), *name = client_json_text(of, "name");
        const bool met = strcmp(outcome, "converged") == 0;
        client_checks_add(to, met ? CLIENT_PASS : CLIENT_FAIL, name, "converged", "%s", outcome);
        client_checks_assertions(to, summary, name);
    }
    json_decref(result);
    free(path);
    return code;
}

/* "scene.json young=2e5": what was sent, and which of several jobs. NULL: no memory. */
static char *suite_name(const client_session *s, const json_t *job, const char *label)
{
    char *name = NULL;
    const client_options *o = s->options;
    const bool of_file = o->command == CLIENT_SUBMIT || o->command == CLIENT_VERIFY;
    const char *file = of_file && o->operand && strcmp(o->operand, "-") != 0 ? o->operand : NULL;
    const char *slash = file ? strrchr(file, '/') : NULL;
    const char *base = slash ? slash + 1 : file ? file : client_json_text(job, "id");
    return asprintf(&name, "%s%s%s", base, label ? " " : "", label ? label : "") < 0 ? NULL : name;
}

static client_exit compare(client_session *s, client_checks *checks, const json_t *job)
{
    const client_options *o = s->options;
    const size_t from = checks->compared = checks->count;
    const client_exit code =
        client_baseline_compare(s, checks, job, o->baseline, o->tolerance >= 0 ? o->tolerance : TOLERANCE);
    if (code != CLIENT_OK)
        return code;
    if (checks->failed)
        return client_complain(s, CLIENT_LOCAL, "no memory for the comparison");
    if (!o->quiet)
        client_checks_print(o->json ? s->err : s->out, checks, from, "baseline");
    return client_checks_worst(checks, from) == CLIENT_PASS ? CLIENT_OK : CLIENT_ASSERTION_FAILED;
}

/* The first thing that is wrong is told: how the job ended, what differs, what could not be written. */
client_exit client_contract(client_session *s, const json_t *job, const char *label, client_exit code)
{
    const client_options *o = s->options;
    const bool answered = *client_json_text(job, "summary.outcome") && client_job_ended(job);
    const bool cases = json_is_object(client_json_at(job, "summary.cases"));
    client_checks checks = {.item = NULL};
    client_exit more = CLIENT_OK, written = CLIENT_OK;
    if (!o->junit && !o->baseline)
        return code;
    client_checks_outcome(&checks, job);
    if (cases) {
        /* How many cases ended how is asserted of the whole job: the lines of the summary that are not a case's. */
        const json_t *summary = json_object_get(job, "summary");
        const json_t *line;
        size_t i;
        json_array_foreach(json_object_get(summary, "assertions"), i, line)
        {
            json_t *one = json_object_get(line, "cases") ? NULL : json_pack("{s:[O]}", "assertions", line);
            if (one)
                client_checks_assertions(&checks, one, "");
            json_decref(one);
        }
    } else
        client_checks_assertions(&checks, json_object_get(job, "summary"), "");
    if (cases && o->junit)
        more = add_cases(s, &checks, job);
    if (more == CLIENT_OK && o->baseline && answered)
        more = compare(s, &checks, job);
    if (o->junit) {
        char message[512] = "no memory for the report", *name = suite_name(s, job, label);
        const bool ok = name && client_suites_add(&s->suites, name, job, &checks) &&
                        client_junit_write(&s->suites, s->options->junit, message, sizeof message);
        free(name);
        written = ok ? CLIENT_OK : client_complain(s, CLIENT_LOCAL, message);
    }
    client_checks_clear(&checks);
    return code != CLIENT_OK ? code : more != CLIENT_OK ? more : written;
}
