/* table.c: fields of an answer as CSV (RFC 4180, with '\n'): a row for each node, contact, unknown or point; and CSV as
 * columns for a person. */
#include "commands/fetch.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

#define MOST_FIELDS 16

typedef enum { AT_NODES, AT_CONTACTS, AT_POINTS } field_place;

static const struct {
    const char *name;
    field_place place;
} FIELDS[] = {
    {"displacements", AT_NODES}, {"stress", AT_NODES}, {"principal", AT_NODES},     {"von_mises", AT_NODES},
    {"strain", AT_NODES},        {"nodes", AT_NODES},  {"reactions", AT_CONTACTS},  {"gaps", AT_CONTACTS},
    {"pressure", AT_CONTACTS},   {"ray", AT_CONTACTS}, {"stress_gauss", AT_POINTS}, {"contact_status", AT_CONTACTS},
};

/* What is asked for, and the parts of the reply that all cases share. */
typedef struct {
    const char *name[MOST_FIELDS];
    int count;
    field_place place;
    const json_t *nodes, *contact_nodes;
    bool cases; /* a first column with the case's name */
    FILE *to;
} table;

static client_exit refuse(client_session *s, const char *format, const char *name, int len)
{
    char message[300];
    snprintf(message, sizeof message, format, len, name);
    return client_complain(s, CLIENT_USAGE, message);
}

/* Takes the fields apart; they must be of one kind. */
static client_exit read_fields(client_session *s, table *t, const char *fields)
{
    for (const char *at = fields; *at;) {
        const size_t len = strcspn(at, ","), most = sizeof FIELDS / sizeof *FIELDS;
        const int shown = (int)(len < 60 ? len : 60);
        size_t i = 0;
        while (i < most && (strlen(FIELDS[i].name) != len || memcmp(FIELDS[i].name, at, len) != 0))
            i++;
        if (i == most)
            return refuse(s, "\"%.*s\" is no field that a table can have", at, shown);
        if (t->count && FIELDS[i].place != t->place)
            return refuse(s,
                          "a table is of nodes, of contacts or of points, and \"%.*s\" is not of the same as the "
                          "fields before it: ask for it in another",
                          at, shown);
        t->place = FIELDS[i].place;
        if (t->count == MOST_FIELDS)
            return refuse(s, "%.*s", "too many fields", 15);
        if (strcmp(FIELDS[i].name, "nodes") != 0) /* the coordinates are there anyway */
            t->name[t->count++] = FIELDS[i].name;
        at += len + (at[len] == ',');
    }
    return CLIENT_OK;
}

/* ----------------------------------------------------------------- numbers */

/* What is no number leaves its cell empty. */
static void print_value(FILE *to, const json_t *value)
{
    fputc(',', to);
    if (json_is_integer(value))
        fprintf(to, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
    else if (json_is_real(value)) {
        /* The shortest decimal that reads back as x. */
        double x = json_real_value(value);
        char text[40];
        for (int digits = 15; digits <= 17; digits++) {
            snprintf(text, sizeof text, "%.*g", digits, x);
            if (digits == 17 || !(strtod(text, NULL) < x || strtod(text, NULL) > x))
                break;
        }
        fputs(text, to);
    }
}

/* A number, or all of an array. `width`: so many cells, filled up with empty ones. */
static void print_entry(FILE *to, const json_t *entry, size_t width)
{
    if (!json_is_array(entry)) {
        print_value(to, entry);
        return;
    }
    for (size_t k = 0; k < width; k++)
        print_value(to, json_array_get(entry, k));
}

static size_t width_of(const json_t *values)
{
    const json_t *first = json_array_get(values, 0);
    return json_is_array(first) ? json_array_size(first) : 1;
}

/* ------------------------------------------------------------------ header */

static void print_header(const table *t, const json_t *answer)
{
    bool scene = json_array_size(t->nodes) > 0;
    fputs(t->cases ? "case," : "", t->to);
    if (t->place == AT_CONTACTS)
        fputs(scene ? "contact,node" : "contact", t->to);
    else
        fputs(t->place == AT_POINTS ? "element" : scene ? "node" : "dof", t->to);
    const json_t *points = t->place == AT_POINTS ? client_json_at(answer, "stress_gauss.points") : t->nodes;
    for (size_t k = 0; json_array_size(points) && k < width_of(points); k++)
        fprintf(t->to, ",%c", "xyz"[k < 3 ? k : 2]);
    for (int i = 0; i < t->count; i++) {
        const char *field = t->name[i];
        static const char *const AXES[] = {"x", "y", "z"};
        const json_t *values = json_object_get(answer, field), *components = json_object_get(answer, "components");
        if (strcmp(field, "stress_gauss") == 0) {
            field = "stress";
            values = client_json_at(answer, "stress_gauss.stress");
        }
        bool vector = json_is_array(json_array_get(values, 0));
        bool tensor = strcmp(field, "stress") == 0 || strcmp(field, "strain") == 0;
        for (size_t k = 0; k < width_of(values); k++) {
            const char *component = json_string_value(json_array_get(components, k));
            if (!vector)
                fprintf(t->to, ",%s", strcmp(field, "displacements") == 0 ? "u" : field);
            else if (strcmp(field, "displacements") == 0)
                fprintf(t->to, ",u%s", AXES[k < 3 ? k : 2]);
            else if (tensor && component)
                fprintf(t->to, ",%s_%s", field, component);
            else
                fprintf(t->to, ",%s_%zu", field, k + 1);
        }
    }
    fputc('\n', t->to);
}

/* -------------------------------------------------------------------- rows */

static void print_answer(const table *t, const json_t *answer, const char *name)
{
    const json_t *gauss = json_object_get(answer, "stress_gauss");
    const json_t *list = t->place == AT_POINTS ? json_object_get(gauss, "elements")
                         : t->count            ? json_object_get(answer, t->name[0])
                                               : t->nodes;
    for (size_t row = 0, rows = json_array_size(list); row < rows; row++) {
        const json_t *at = json_array_get(t->nodes, row);
        if (t->cases) {
            client_print_quoted(t->to, name);
            fputc(',', t->to);
        }
        if (t->place == AT_POINTS) {
            const json_t *points = json_object_get(gauss, "points");
            fprintf(t->to, "%.0f", json_number_value(json_array_get(json_object_get(gauss, "elements"), row)));
            print_entry(t->to, json_array_get(points, row), width_of(points));
            const json_t *stress = json_object_get(gauss, "stress");
            print_entry(t->to, json_array_get(stress, row), width_of(stress));
            fputc('\n', t->to);
            continue;
        }
        fprintf(t->to, "%zu", row);
        if (t->place == AT_CONTACTS && json_array_size(t->nodes)) {
            const json_t *node = json_array_get(t->contact_nodes, row);
            print_value(t->to, node);
            at = json_array_get(t->nodes, (size_t)json_integer_value(node));
        }
        if (json_array_size(t->nodes))
            print_entry(t->to, at, width_of(t->nodes));
        for (int i = 0; i < t->count; i++) {
            const json_t *values = json_object_get(answer, t->name[i]);
            print_entry(t->to, json_array_get(values, row), width_of(values));
        }
        fputc('\n', t->to);
    }
}

/* ----------------------------------------------------------------- columns */

enum { CELL = 11 }; /* "-1.2345e-06", or a longer heading and its space */

/* The cell that begins at *at, which moves behind it, and its text: of a number the five digits that a person compares.
 */
static void take_cell(char text[64], const char **at)
{
    const bool quoted = **at == '"';
    const char *c = *at + quoted;
    char *end;
    size_t used = 0;
    for (; *c && *c != '\n'; c++) {
        c += quoted && c[0] == '"' && c[1] == '"';
        if (*c == (quoted ? '"' : ',') && !(quoted && c[-1] == '"'))
            break;
        if (used < 63)
            text[used++] = *c;
    }
    text[used] = '\0';
    *at = c + (quoted && *c == '"');
    const double value = strtod(text, &end);
    if (!used || strcmp(text, "nan") == 0)
        snprintf(text, 64, "-");
    else if (*end == '\0')
        snprintf(text, 64, "%.5g", value);
}

/* Characters of UTF-8. */
static int length_of(const char *text)
{
    int count = 0;
    for (; *text; text++)
        count += ((unsigned char)*text & 0xc0) != 0x80;
    return count;
}

static void print_columns(FILE *to, const char *csv)
{
    int width[64];
    const size_t most = sizeof width / sizeof *width;
    for (bool heading = true; *csv; heading = false) {
        const char *end = csv + strcspn(csv, "\n");
        size_t column = 0;
        for (; csv <= end && column < most; column++, csv++) {
            char text[64];
            take_cell(text, &csv);
            if (heading)
                width[column] = length_of(text) > CELL ? length_of(text) : CELL;
            fprintf(to, "%*s%*s", column ? 2 : 0, "",
                    width[column] - length_of(text) > 0 ? width[column] - length_of(text) : 0, "");
            client_print_safe(to, text);
        }
        fputc('\n', to);
        csv = end + (*end == '\n');
    }
}

bool client_stream_end(FILE *to)
{
    const bool whole = to && !ferror(to);
    return to && fclose(to) == 0 && whole;
}

client_exit client_deliver_rows(client_session *s, const char *csv, size_t length, bool columns)
{
    char *text = NULL;
    size_t len = 0;
    FILE *to = columns ? open_memstream(&text, &len) : NULL;
    if (!columns)
        return client_deliver(s, csv, length);
    if (to)
        print_columns(to, csv);
    const client_exit code =
        client_stream_end(to) ? client_deliver(s, text, len) : client_complain(s, CLIENT_LOCAL, "no memory");
    free(text);
    return code;
}

/* ------------------------------------------------------------- the command */

client_exit client_table(client_session *s, const char *fields, bool columns)
{
    char *text = NULL;
    size_t len = 0;
    json_t *result;
    table t = {0};
    client_exit code = read_fields(s, &t, fields);
    if (code != CLIENT_OK)
        return code;
    char wanted[400] = "nodes";
    for (int i = 0; i < t.count; i++) {
        const size_t used = strlen(wanted);
        snprintf(wanted + used, sizeof wanted - used, ",%s", t.name[i]);
    }
    const client_query query[] = {{"fields", wanted}, {"case", s->options->case_name}, {NULL, NULL}};
    code = client_get_json(s, &result, client_path_with_query(s, s->options->operand, "/result", query));
    t.to = code == CLIENT_OK ? open_memstream(&text, &len) : NULL;
    if (t.to) {
        const json_t *cases = json_object_get(result, "cases");
        t.nodes = json_object_get(result, "nodes");
        t.contact_nodes = json_object_get(result, "contact_nodes");
        t.cases = json_is_array(cases);
        print_header(&t, t.cases ? json_array_get(cases, 0) : result);
        for (size_t i = 0; i < json_array_size(cases); i++)
            print_answer(&t, json_array_get(cases, i), client_json_text(json_array_get(cases, i), "name"));
        if (!t.cases)
            print_answer(&t, result, "");
    }
    if (code == CLIENT_OK)
        code = client_stream_end(t.to) ? client_deliver_rows(s, text, len, columns)
                                       : client_complain(s, CLIENT_LOCAL, "no memory");
    free(text);
    json_decref(result);
    return code;
}
