/* list, factors: what the service has. */
#include "commands/fetch.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAGE_JOBS 100L

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
    if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, jobs);
    else if (code == CLIENT_OK && o->quiet) {
        for (size_t i = 0; i < json_array_size(jobs); i++) {
            client_print_safe(s->out, client_json_text(json_array_get(jobs, i), "id"));
            fputc('\n', s->out);
        }
    } else if (code == CLIENT_OK) {
        fprintf(s->out, "%-32s  %-10s  %-15s  %-24s  %-20s  %s\n", "id", "status", "outcome", "created", "name",
                "tags");
        for (size_t i = 0; i < json_array_size(jobs); i++) {
            const json_t *job = json_array_get(jobs, i);
            client_print_cell(s->out, client_json_text(job, "id"), 32);
            client_print_cell(s->out, client_json_text(job, "status"), 10);
            client_print_cell(s->out, client_json_text(job, "summary.outcome"), 15);
            client_print_cell(s->out, client_json_text(job, "created"), 24);
            client_print_cell(s->out, client_json_text(job, "name"), 20);
            client_print_tags(s->out, job, ",");
            fputc('\n', s->out);
        }
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
