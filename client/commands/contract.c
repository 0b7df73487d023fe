/* contract.c: --junit and --baseline: what a pipeline asks about a job beyond its exit status. */
#include "commands/contract.h"
#include "show/report.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Numbers with the digits that a drift of this size changes. */
#define NUMBER "%.9g"

/* ---- single numbers */

/* error: how far both together may be from the exact numbers; 0 where nothing is known of that. */
static void compare_numbers(client_checks *to, const char *group, const char *name, double now, double then,
                            double error, double tolerance)
{
    const double scale = fmax(fabs(now), fabs(then)), doubt = error / scale;
    const double drift = scale > 0.0 ? fabs(now - then) / scale : 0.0; /* relative to the larger; 0 where both are */
    const double least = drift - (doubt > 0.0 ? doubt : 0.0), most = drift + (doubt > 0.0 ? doubt : 0.0);
    if (!isfinite(now) && !isfinite(then))
        return; /* matrices have no pressure */
    if (!isfinite(now) || !isfinite(then))
        client_checks_add(to, CLIENT_UNCERTAIN, group, name, "%s",
                          isfinite(now) ? "the baseline does not know it" : "this job does not know it");
    else if (most <= tolerance)
        client_checks_add(to, CLIENT_PASS, group, name, NUMBER ", was " NUMBER ": differs by %.2g", now, then, drift);
    else if (least > tolerance)
        client_checks_add(to, CLIENT_FAIL, group, name, NUMBER ", was " NUMBER ": differs by %.2g, more than %.2g", now,
                          then, drift, tolerance);
    else
        client_checks_add(to, CLIENT_UNCERTAIN, group, name,
                          NUMBER ", was " NUMBER ": the exact ones differ by %.2g to %.2g", now, then, fmax(least, 0.0),
                          most);
}

/* ---- displacements */

/* A list of numbers, or of points; how many numbers there are. */
static size_t count_numbers(const json_t *list)
{
    const json_t *first = json_array_get(list, 0);
    return json_array_size(list) * (json_is_array(first) ? json_array_size(first) : 1);
}

static double number_in(const json_t *list, size_t i)
{
    const size_t columns = json_array_size(json_array_get(list, 0));
    const json_t *value =
        columns ? json_array_get(json_array_get(list, i / columns), i % columns) : json_array_get(list, i);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

/* ||a - b|| over the larger of ||a|| and ||b||; NaN where a number is not known. */
static double distance_of(const json_t *a, const json_t *b)
{
    double size_a = 0.0, size_b = 0.0, difference = 0.0;
    const size_t n = count_numbers(a);
    for (size_t i = 0; i < n; i++) {
        const double x = number_in(a, i), y = number_in(b, i);
        size_a = hypot(size_a, x);
        size_b = hypot(size_b, y);
        difference = hypot(difference, x - y);
    }
    const double size = fmax(size_a, size_b);
    return difference > 0.0 || isnan(difference) ? difference / size : 0.0;
}

/* ---- what touches */

/* The places of a contact, each of which touches or not: nodes of a scene, rows of matrices. */
typedef struct {
    bool *now, *then; /* size each */
    size_t size;
} touching;

/* A row that a result leaves out, since it surely does not touch, is apart. */
static void mark(bool *out, size_t size, const json_t *result)
{
    const json_t *reactions = json_object_get(result, "reactions"), *nodes = json_object_get(result, "contact_nodes");
    for (size_t i = 0; i < json_array_size(reactions); i++) {
        size_t place = i;
        if (json_is_array(nodes)) {
            const double node = json_number_value(json_array_get(nodes, i)); /* written as 1e5 where that is shorter */
            place = node >= 0.0 && node < 1e15 ? (size_t)node : SIZE_MAX;
        }
        if (place < size && json_number_value(json_array_get(reactions, i)) < 0.0)
            out[place] = true;
    }
}

static size_t places_of(const json_t *result)
{
    const size_t nodes = json_array_size(json_object_get(result, "nodes"));
    return nodes ? nodes : json_array_size(json_object_get(result, "reactions"));
}

/* "; opened at 3, 4, 5, ..." with the places that touch in `was` and not in `is`. */
static void list_changes(char *out, size_t size, const char *what, const touching *t, bool opened)
{
    enum { SHOWN = 12 };
    size_t found = 0, used = strlen(out);
    for (size_t i = 0; i < t->size && used < size; i++) {
        if (t->now[i] == t->then[i] || t->now[i] == opened || found++ > SHOWN)
            continue;
        if (found > SHOWN)
            used += (size_t)snprintf(out + used, size - used, ", ...");
        else
            used += (size_t)snprintf(out + used, size - used, "%s%s%zu", found == 1 ? what : "",
                                     found == 1 ? " " : ", ", i);
    }
}

static void compare_contacts(client_checks *to, const char *group, const json_t *now, const json_t *then,
                             double tolerance)
{
    const bool nodes = json_is_array(json_object_get(now, "nodes"));
    const size_t a = places_of(now), b = places_of(then);
    touching t = {.size = a > b ? a : b};
    t.now = calloc(t.size + 1, sizeof *t.now);
    t.then = calloc(t.size + 1, sizeof *t.then);
    if (!nodes && a != b) {
        client_checks_add(to, CLIENT_FAIL, group, "contact.active set", "%zu rows can't be compared with %zu", a, b);
    } else if (t.now && t.then) {
        mark(t.now, t.size, now);
        mark(t.then, t.size, then);
        char changes[512] = "";
        size_t changed = 0, either = 0;
        for (size_t i = 0; i < t.size; i++) {
            changed += t.now[i] != t.then[i];
            either += t.now[i] || t.then[i];
        }
        list_changes(changes, sizeof changes, nodes ? "; opened at node" : "; opened at row", &t, true);
        list_changes(changes, sizeof changes, nodes ? "; closed at node" : "; closed at row", &t, false);
        const bool pass = (double)changed <= tolerance * (double)either;
        client_checks_add(to, pass ? CLIENT_PASS : CLIENT_FAIL, group, "contact.active set",
                          "%zu of %zu that touch have changed%s", changed, either, changes);
    } else {
        to->failed = true;
    }
    free(t.now);
    free(t.then);
}

void client_baseline_results(client_checks *to, const char *group, const json_t *now, const json_t *then,
                             double tolerance)
{
    static const char NAME[] = "displacements";
    const json_t *a = json_object_get(now, NAME), *b = json_object_get(then, NAME);
    const json_t *x = json_object_get(now, "nodes"), *y = json_object_get(then, "nodes");
    const char *outcome = client_json_text(then, "summary.outcome");
    /* Where the nodes are another mesh's, what stands at them can't be compared. */
    const char *other = NULL;
    if (!json_is_array(x) != !json_is_array(y))
        other = "one job is a scene and the other a problem in matrices";
    else if (count_numbers(a) != count_numbers(b) || count_numbers(x) != count_numbers(y))
        other = x ? "the meshes differ in their number of nodes" : "the problems differ in their number of unknowns";
    else if (x && distance_of(x, y) > 1e-9)
        other = "the nodes are at other places";
    if (strcmp(outcome, "converged") != 0 && strcmp(outcome, "verified") != 0)
        client_checks_add(to, CLIENT_UNCERTAIN, group, "baseline", "it ended with %s", outcome);
    /* The exact energies are within the gaps of these. */
    static const char *const NUMBERS[] = {"energy.primal", "contact.reaction_sum", "contact.max_pressure"};
    const json_t *is = json_object_get(now, "summary"), *was = json_object_get(then, "summary");
    const double gaps = client_json_number(is, "certificate.gap") + client_json_number(was, "certificate.gap");
    for (size_t i = 0; i < sizeof NUMBERS / sizeof NUMBERS[0]; i++)
        compare_numbers(to, group, NUMBERS[i], client_json_number(is, NUMBERS[i]), client_json_number(was, NUMBERS[i]),
                        i == 0 ? gaps : 0.0, tolerance);
    if (other) {
        client_checks_add(to, CLIENT_FAIL, group, "mesh",
                          "%s (%zu and %zu): displacements and contacts can't be compared", other, count_numbers(a),
                          count_numbers(b));
        return;
    }
    const double drift = distance_of(a, b);
    if (isnan(drift))
        client_checks_add(to, CLIENT_UNCERTAIN, group, NAME, "they are not known");
    else
        client_checks_add(to, drift <= tolerance ? CLIENT_PASS : CLIENT_FAIL, group, NAME,
                          drift <= tolerance ? "%zu numbers differ by %.2g in norm"
                                             : "%zu numbers differ by %.2g in norm, more than %.2g",
                          count_numbers(a), drift, tolerance);
    compare_contacts(to, group, now, then, tolerance);
}

/* ---- fetching */

static client_exit fetch_result(client_session *s, json_t **out, const char *id, const char *query, const char *name)
{
    client_buffer suffix = {0};
    client_exit code = CLIENT_LOCAL;
    *out = NULL;
    bool ok = client_buffer_append(&suffix, query, strlen(query));
    if (ok && name)
        ok = client_buffer_append(&suffix, "&case=", 6) && client_http_append_escaped(&suffix, name);
    if (ok)
        code = client_get_json(s, out, client_job_path(s, id, suffix.data));
    else
        client_complain(s, code, "no memory");
    free(suffix.data);
    return code;
}

/* name NULL: the jobs have no load cases. */
static client_exit compare_one(client_session *s, client_checks *to, const char *new_id, const char *old_id,
                               const char *name, double tolerance)
{
    static const char QUERY[] = "/result?fields=summary,reactions,displacements,nodes";
    json_t *now = NULL, *then = NULL;
    client_exit code = fetch_result(s, &now, new_id, QUERY, name);
    if (code == CLIENT_OK)
        code = fetch_result(s, &then, old_id, QUERY, name);
    if (code == CLIENT_OK)
        client_baseline_results(to, name ? name : "", now, then, tolerance);
    json_decref(now);
    json_decref(then);
    return code;
}

static bool has_case(const json_t *result, const char *name)
{
    const json_t *one;
    size_t i;
    json_array_foreach(json_object_get(result, "cases"), i, one)
    {
        if (strcmp(client_json_text(one, "name"), name) == 0)
            return true;
    }
    return false;
}

/* ---- the contract */

#define TOLERANCE 1e-3 /* where --tolerance is not given */

/* An ended job that has an answer with the baseline, case by case where they have load cases. Fetches both results, one
 * case at a time. Not CLIENT_OK: one could not be had, said on s->err, or something differs. */
static client_exit compare(client_session *s, client_checks *checks, const json_t *job)
{
    const client_options *o = s->options;
    const size_t from = checks->compared = checks->count;
    const double tolerance = o->tolerance >= 0 ? o->tolerance : TOLERANCE;
    json_t *now = NULL, *then = NULL, *one;
    size_t i;
    client_exit code = fetch_result(s, &now, client_json_text(job, "id"), "/result?fields=summary", NULL);
    if (code == CLIENT_OK)
        code = fetch_result(s, &then, o->baseline, "/result?fields=summary", NULL);
    const char *now_id = client_json_text(now, "job"), *then_id = client_json_text(then, "job");
    const json_t *cases = json_object_get(now, "cases"), *old_cases = json_object_get(then, "cases");
    if (code == CLIENT_OK && !cases != !old_cases)
        client_checks_add(checks, CLIENT_FAIL, "", "baseline", "it has %s load cases, and this job has %s",
                          old_cases ? "some" : "no", cases ? "some" : "none");
    else if (code == CLIENT_OK && !cases)
        code = compare_one(s, checks, now_id, then_id, NULL, tolerance);
    else if (code == CLIENT_OK) {
        json_array_foreach((json_t *)cases, i, one)
        {
            const char *name = client_json_text(one, "name");
            if (code != CLIENT_OK)
                break;
            if (has_case(then, name))
                code = compare_one(s, checks, now_id, then_id, name, tolerance);
            else
                client_checks_add(checks, CLIENT_FAIL, name, "baseline", "it has no load case of this name");
        }
        json_array_foreach((json_t *)old_cases, i, one)
        {
            const char *name = client_json_text(one, "name");
            if (!has_case(now, name))
                client_checks_add(checks, CLIENT_FAIL, name, "baseline", "this job has no load case of this name");
        }
    }
    json_decref(now);
    json_decref(then);
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
    if (cases && o->junit) { /* whether each converged, and its assertions */
        json_t *result = NULL, *of;
        size_t i;
        more = fetch_result(s, &result, client_json_text(job, "id"), "/result?fields=summary", NULL);
        json_array_foreach(json_object_get(result, "cases"), i, of)
        {
            const json_t *summary = json_object_get(of, "summary");
            const char *outcome = client_json_text(summary, "outcome"), *name = client_json_text(of, "name");
            const bool met = strcmp(outcome, "converged") == 0;
            client_checks_add(&checks, met ? CLIENT_PASS : CLIENT_FAIL, name, "converged", "%s", outcome);
            client_checks_assertions(&checks, summary, name);
        }
        json_decref(result);
    }
    if (more == CLIENT_OK && o->baseline && answered)
        more = compare(s, &checks, job);
    if (o->junit) {
        /* "scene.json young=2e5": what was sent, and which of several jobs. */
        char message[512] = "no memory for the report", *name = NULL;
        const bool of_file = o->command == CLIENT_SUBMIT || o->command == CLIENT_VERIFY;
        const char *file = of_file && o->operand && strcmp(o->operand, "-") != 0 ? o->operand : NULL;
        const char *slash = file ? strrchr(file, '/') : NULL;
        const char *base = slash ? slash + 1 : file ? file : client_json_text(job, "id");
        if (asprintf(&name, "%s%s%s", base, label ? " " : "", label ? label : "") < 0)
            name = NULL;
        const bool ok = name && client_suites_add(&s->suites, name, job, &checks) &&
                        client_junit_write(&s->suites, s->options->junit, message, sizeof message);
        free(name);
        written = ok ? CLIENT_OK : client_complain(s, CLIENT_LOCAL, message);
    }
    client_checks_clear(&checks);
    return code != CLIENT_OK ? code : more != CLIENT_OK ? more : written;
}
