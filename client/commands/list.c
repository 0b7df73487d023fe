/* list, factors: what the service has. */
#include "commands/fetch.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

#define PAGE_JOBS 100L

static const struct {
    const char *name, *path;
    int width;
} COLUMNS[] = {{"id", "id", 32},
               {"status", "status", 10},
               {"outcome", "summary.outcome", 15},
               {"created", "created", 24},
               {"name", "name", 20}};

static void print_tags(FILE *to, const json_t *job, bool csv)
{
    char *text = NULL;
    size_t len = 0;
    FILE *tags = csv ? open_memstream(&text, &len) : NULL;
    client_print_tags(tags ? tags : to, job, ",");
    if (tags && fclose(tags) == 0)
        client_print_quoted(to, text);
    free(text);
}

/* As a table for a reader, or as CSV for a program: whole cells, a comma between them. */
static void print_jobs(FILE *to, const json_t *jobs, bool csv)
{
    const size_t columns = sizeof COLUMNS / sizeof *COLUMNS;
    for (size_t k = 0; k < columns; k++)
        fprintf(to, csv ? "%.*s," : "%-*s  ", COLUMNS[k].width, COLUMNS[k].name);
    fputs("tags\n", to);
    for (size_t i = 0; i < json_array_size(jobs); i++) {
        const json_t *job = json_array_get(jobs, i);
        for (size_t k = 0; k < columns; k++) {
            const char *text = client_json_text(job, COLUMNS[k].path);
            if (csv) {
                client_print_quoted(to, text);
                fputc(',', to);
            } else {
                client_print_cell(to, text, COLUMNS[k].width);
            }
        }
        print_tags(to, job, csv);
        fputc('\n', to);
    }
}

client_exit client_list(client_session *s)
{
    const client_options *o = s->options;
    json_t *jobs = json_array();
    if (!jobs)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    /* Up to `limit` jobs in as many pages as that takes. */
    char cursor[256] = "";
    client_exit code = CLIENT_OK;
    bool last = false;
    while (code == CLIENT_OK && !last && (long)json_array_size(jobs) < o->limit) {
        json_t *page = NULL;
        char start[64];
        client_buffer path = {0};
        const long left = o->limit - (long)json_array_size(jobs);
        snprintf(start, sizeof start, "/v1/jobs?limit=%ld", left < PAGE_JOBS ? left : PAGE_JOBS);
        if (client_buffer_append(&path, start, strlen(start)) && client_append_query(&path, "status", o->status) &&
            client_append_query(&path, "tag", o->tags.count ? o->tags.item[0] : NULL) &&
            client_append_query(&path, "name", o->name) &&
            client_append_query(&path, "cursor", *cursor ? cursor : NULL)) {
            code = client_get_json(s, &page, path.data);
        } else {
            code = client_complain(s, CLIENT_LOCAL, "no memory");
            free(path.data);
        }
        json_t *more = json_object_get(page, "jobs");
        if (code == CLIENT_OK && (!json_is_array(more) || json_array_extend(jobs, more) != 0))
            code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no list of jobs");
        snprintf(cursor, sizeof cursor, "%s", client_json_text(page, "next"));
        last = !*cursor || json_array_size(more) == 0;
        json_decref(page);
    }
    const char *format = o->json ? "json" : o->format ? o->format : "table";
    if (code == CLIENT_OK && strcmp(format, "json") == 0)
        code = client_print_json(s, jobs);
    else if (code == CLIENT_OK && o->quiet) {
        for (size_t i = 0; i < json_array_size(jobs); i++) {
            client_print_safe(s->out, client_json_text(json_array_get(jobs, i), "id"));
            fputc('\n', s->out);
        }
    } else if (code == CLIENT_OK) {
        print_jobs(s->out, jobs, strcmp(format, "csv") == 0);
        if (!last)
            fprintf(s->err, "the newest %d: --limit shows more\n", o->limit);
    }
    json_decref(jobs);
    return code;
}

/* ---------------------------------------------------------------- factors */

client_exit client_factors(client_session *s)
{
    static const char *const COUNTS[] = {"d", "m", "nnz", "hits"};
    json_t *held = NULL;
    client_request request = client_request_new(s, "GET", "/v1/factors");
    client_exit code = client_ask_json(s, &held, &request);
    const json_t *factors = json_object_get(held, "factors");
    if (code == CLIENT_OK && !json_is_array(factors))
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no list of factors");
    else if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, held);
    else if (code == CLIENT_OK) {
        fprintf(s->out, "%-12s  %12s  %12s  %12s  %12s  %12s\n", "digest", "d", "m", "nnz", "hits", "size");
        for (size_t i = 0; i < json_array_size(factors); i++) {
            const json_t *factor = json_array_get(factors, i);
            char digest[16];
            snprintf(digest, sizeof digest, "%.12s", client_json_text(factor, "digest"));
            client_print_cell(s->out, digest, 12);
            for (size_t k = 0; k < sizeof COUNTS / sizeof *COUNTS; k++)
                fprintf(s->out, "%12.0f  ", client_json_number(factor, COUNTS[k]));
            fprintf(s->out, "%9.1f MB\n", client_json_number(factor, "bytes") / 1e6);
        }
        fprintf(s->out, "%.1f of %.1f MB\n", client_json_number(held, "bytes") / 1e6,
                client_json_number(held, "max_bytes") / 1e6);
    }
    json_decref(held);
    return code;
}

/* ---------------------------------------------------------------- nodes */

client_exit client_nodes(client_session *s)
{
    json_t *held = NULL;
    client_request request = client_request_new(s, "GET", "/v1/nodes");
    client_exit code = client_ask_json(s, &held, &request);
    const json_t *nodes = json_object_get(held, "nodes");
    if (code == CLIENT_OK && !json_is_array(nodes))
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no list of nodes");
    else if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, held);
    else if (code == CLIENT_OK) {
        fprintf(s->out, "%-24s  %-8s  %-10s  %8s  %8s  %8s  %8s\n", "name", "state", "version", "workers", "running",
                "factors", "bodies");
        for (size_t i = 0; i < json_array_size(nodes); i++) {
            const json_t *node = json_array_get(nodes, i);
            client_print_cell(s->out, client_json_text(node, "name"), 24);
            client_print_cell(s->out, client_json_text(node, "state"), 8);
            client_print_cell(s->out, client_json_text(node, "version"), 10);
            fprintf(s->out, "%8.0f  %8.0f  %8.0f  %8zu\n", client_json_number(node, "workers"),
                    client_json_number(node, "running"), client_json_number(node, "cache.factors"),
                    json_array_size(json_object_get(node, "bodies")));
        }
    }
    json_decref(held);
    return code;
}
