/* series.c: all cases of a job together, as of a path of loads: their numbers as CSV, a row for each, and their fields
 * as files that ParaView opens as one series (.pvd: ParaView's collection of files, by the places of its steps). */
#include "commands/fetch.h"
#include "local/files.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- numbers, a row for each case */

/* What one case or, of a job without cases, the whole of it has of its own: its summary, and the name "". */
static const json_t *summary_of(const json_t *result, const json_t *cases, size_t i)
{
    return json_object_get(cases ? json_array_get(cases, i) : result, "summary");
}

static const struct {
    const char *name, *path;
} NUMBERS[] = {{"part", "finite.part"},
               {"load", "finite.load"},
               {"displacement", "finite.displacement"},
               {"relative_error", "certificate.relative_error"},
               {"active", "contact.active"},
               {"max_pressure", "contact.max_pressure"},
               {"area", "contact.area"},
               {"strain_energy", "energy.strain"},
               {"von_mises", "stress.von_mises"}};
enum { NUMBER_COUNT = sizeof NUMBERS / sizeof *NUMBERS };

/* A cell, empty where there is no number. */
static void put_number(FILE *to, const json_t *value)
{
    fputc(',', to);
    if (json_is_number(value))
        fprintf(to, "%.17g", json_number_value(value));
}

/* The components of a vector as cells, or where `name` is given as headings. */
static void put_vector(FILE *to, const json_t *vector, size_t width, const char *name)
{
    for (size_t k = 0; k < width; k++)
        if (name)
            fprintf(to, ",%s_%c", name, "xyz"[k < 3 ? k : 2]);
        else
            put_number(to, json_array_get(vector, k));
}

/* like: the summary that says which columns there are; row: the one whose cells they get, NULL: the headings. */
static void put_columns(FILE *to, const json_t *like, const json_t *row)
{
    const json_t *supports = client_json_at(like, "resultants.supports");
    char name[40];
    for (size_t k = 0; k < NUMBER_COUNT; k++) {
        if (!client_json_at(like, NUMBERS[k].path))
            continue;
        if (row)
            put_number(to, client_json_at(row, NUMBERS[k].path));
        else
            fprintf(to, ",%s", NUMBERS[k].name);
    }
    const size_t width = json_array_size(client_json_at(like, "contact.force"));
    put_vector(to, client_json_at(row, "contact.force"), width, row ? NULL : "contact_force");
    for (size_t i = 0; i < json_array_size(supports); i++) {
        const json_t *own = json_array_get(client_json_at(row, "resultants.supports"), i);
        snprintf(name, sizeof name, "support_%zu_force", i);
        put_vector(to, json_object_get(own, "force"), width, row ? NULL : name);
    }
}

client_exit client_numbers(client_session *s, bool columns)
{
    char *text = NULL;
    size_t len = 0;
    json_t *result;
    const client_query query[] = {{"fields", "summary"}, {"case", s->options->case_name}, {NULL, NULL}};
    client_exit code = client_get_json(s, &result, client_path_with_query(s, s->options->operand, "/result", query));
    FILE *to = code == CLIENT_OK ? open_memstream(&text, &len) : NULL;
    if (to) {
        const json_t *cases = json_object_get(result, "cases"), *first = summary_of(result, cases, 0);
        fputs(cases ? "case,outcome" : "outcome", to);
        put_columns(to, first, NULL);
        fputc('\n', to);
        for (size_t i = 0; i < (cases ? json_array_size(cases) : 1); i++) {
            const json_t *summary = summary_of(result, cases, i);
            if (cases) {
                client_print_quoted(to, client_json_text(json_array_get(cases, i), "name"));
                fputc(',', to);
            }
            fputs(client_json_text(summary, "outcome"), to);
            put_columns(to, first, summary);
            fputc('\n', to);
        }
    }
    if (code == CLIENT_OK)
        code = client_stream_end(to) ? client_deliver_rows(s, text, len, columns)
                                     : client_complain(s, CLIENT_LOCAL, "no memory");
    free(text);
    json_decref(result);
    return code;
}

/* ---- a series of files */

/* The vtu of a case (NULL: the job has none) into a file. */
static client_exit save_vtu(client_session *s, const char *file, const char *case_name, const char *fields)
{
    char message[512];
    client_reply reply;
    const client_query query[] = {{"fields", fields}, {"case", case_name}, {NULL, NULL}};
    client_exit code =
        client_get(s, &reply, client_path_with_query(s, s->options->operand, "/result.vtu", query), NULL);
    if (code == CLIENT_OK && !client_file_write(file, reply.body.data, reply.body.len, message, sizeof message))
        code = client_complain(s, CLIENT_LOCAL, message);
    client_reply_clear(&reply);
    return code;
}

/* Do the parts of the load only grow along the path? Then they are the places of its steps, else their numbers are. */
static bool parts_grow(const json_t *result, const json_t *cases)
{
    for (size_t i = 0; i < json_array_size(cases); i++) {
        const double part = client_json_number(summary_of(result, cases, i), "finite.part");
        if (!isfinite(part) || (i > 0 && !(part > client_json_number(summary_of(result, cases, i - 1), "finite.part"))))
            return false;
    }
    return true;
}

client_exit client_series_of_files(client_session *s, const char *fields)
{
    const char *output = s->options->output;
    const size_t end = output ? strlen(output) : 0,
                 stem = end > 4 && strcmp(output + end - 4, ".pvd") == 0 ? end - 4 : end;
    char *text = NULL, *file = malloc(stem + 32);
    size_t len = 0;
    json_t *result = NULL;
    client_exit code = CLIENT_OK;
    if (!output || strcmp(output, "-") == 0 || s->options->case_name)
        code = client_complain(s, CLIENT_USAGE,
                               "a series is a file of its own, of all cases, with one more for each beside it: say -o "
                               "FILE.pvd, and no --case");
    if (code == CLIENT_OK)
        code = client_get_json(s, &result, client_job_path(s, s->options->operand, "/result?fields=summary"));
    FILE *to = code == CLIENT_OK && file ? open_memstream(&text, &len) : NULL;
    if (to) {
        const json_t *cases = json_object_get(result, "cases");
        const bool grow = parts_grow(result, cases);
        fputs("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n", to);
        for (size_t i = 0; i < (cases ? json_array_size(cases) : 1) && code == CLIENT_OK; i++) {
            const json_t *one = cases ? json_array_get(cases, i) : NULL;
            snprintf(file, stem + 32, "%.*s-%zu.vtu", (int)stem, output, i + 1);
            code = save_vtu(s, file, one ? client_json_text(one, "name") : NULL, fields);
            const char *slash = strrchr(file, '/'), *name = slash ? slash + 1 : file;
            const double at = grow ? client_json_number(summary_of(result, cases, i), "finite.part") : (double)i + 1;
            fprintf(to, "<DataSet timestep=\"%.15g\" file=\"", at);
            for (const char *c = name; *c; c++)
                fprintf(to, strchr("&<>\"", *c) ? "&#%d;" : "%c", *c);
            fputs("\"/>\n", to);
        }
        fputs("</Collection>\n</VTKFile>\n", to);
    }
    const bool whole = client_stream_end(to);
    if (code == CLIENT_OK)
        code = whole ? client_deliver(s, text, len) : client_complain(s, CLIENT_LOCAL, "no memory");
    free(text);
    free(file);
    json_decref(result);
    return code;
}
