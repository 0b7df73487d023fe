/* list, factors: what the service has. */
#include "commands/fetch.h"
#include "show/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAGE_JOBS 100L

static client_exit list_page(client_session *s, json_t **page, long limit, const char *cursor)
{
    char start[64];
    client_buffer path = {0};
    const client_options *o = s->options;
    client_exit code = CLIENT_LOCAL;
    snprintf(start, sizeof start, "/v1/jobs?limit=%ld", limit);
    *page = NULL;
    if (client_buffer_append(&path, start, strlen(start)) && client_append_query(&path, "status", o->status) &&
        client_append_query(&path, "tag", o->tags.count ? o->tags.item[0] : NULL) &&
        client_append_query(&path, "cursor", cursor)) {
        client_request request = client_request_new(s, "GET", path.data);
        code = client_ask_json(s, page, &request);
    } else
        client_complain(s, code, "no memory");
    free(path.data);
    return code;
}

static void print_cell(FILE *to, const char *text, int width)
{
    client_print_safe(to, text);
    for (int i = (int)strlen(text); i < width; i++)
        fputc(' ', to);
    fputs("  ", to);
}

static void print_row(FILE *to, const json_t *job)
{
    const json_t *tags = json_object_get(job, "tags");
    print_cell(to, client_json_text(job, "id"), 32);
    print_cell(to, client_json_text(job, "status"), 10);
    print_cell(to, client_json_text(job, "summary.outcome"), 15);
    print_cell(to, client_json_text(job, "created"), 24);
    for (size_t i = 0; i < json_array_size(tags); i++) {
        const json_t *tag = json_array_get(tags, i);
        fputs(i ? "," : "", to);
        client_print_safe(to, json_is_string(tag) ? json_string_value(tag) : "?");
    }
    fputc('\n', to);
}

client_exit client_list(client_session *s)
{
    json_t *jobs = json_array();
    if (!jobs)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    /* Up to `limit` jobs in as many pages as that takes. */
    char cursor[256] = "";
    client_exit code = CLIENT_OK;
    while (code == CLIENT_OK && (long)json_array_size(jobs) < s->options->limit) {
        json_t *page;
        long left = s->options->limit - (long)json_array_size(jobs);
        code = list_page(s, &page, left < PAGE_JOBS ? left : PAGE_JOBS, *cursor ? cursor : NULL);
        json_t *more = json_object_get(page, "jobs");
        if (code == CLIENT_OK && (!json_is_array(more) || json_array_extend(jobs, more) != 0))
            code = client_complain(s, CLIENT_SERVER_ERROR, "the reply is no list of jobs");
        snprintf(cursor, sizeof cursor, "%s", client_json_text(page, "next"));
        bool last = !*cursor || json_array_size(more) == 0;
        json_decref(page);
        if (last)
            break;
    }
    if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, jobs);
    else if (code == CLIENT_OK && s->options->quiet) {
        for (size_t i = 0; i < json_array_size(jobs); i++) {
            client_print_safe(s->out, client_json_text(json_array_get(jobs, i), "id"));
            fputc('\n', s->out);
        }
    } else if (code == CLIENT_OK) {
        fprintf(s->out, "%-32s  %-10s  %-15s  %-24s  %s\n", "id", "status", "outcome", "created", "tags");
        for (size_t i = 0; i < json_array_size(jobs); i++)
            print_row(s->out, json_array_get(jobs, i));
    }
    json_decref(jobs);
    return code;
}

/* ---------------------------------------------------------------- factors */

static void print_factor(FILE *to, const json_t *factor)
{
    static const char *const COUNTS[] = {"d", "m", "nnz", "hits"};
    char digest[16];
    snprintf(digest, sizeof digest, "%.12s", client_json_text(factor, "digest"));
    print_cell(to, digest, 12);
    for (size_t i = 0; i < sizeof COUNTS / sizeof *COUNTS; i++)
        fprintf(to, "%12.0f  ", client_json_number(factor, COUNTS[i]));
    fprintf(to, "%9.1f MB\n", client_json_number(factor, "bytes") / 1e6);
}

client_exit client_factors(client_session *s)
{
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
        for (size_t i = 0; i < json_array_size(factors); i++)
            print_factor(s->out, json_array_get(factors, i));
        fprintf(s->out, "%.1f of %.1f MB\n", client_json_number(held, "bytes") / 1e6,
                client_json_number(held, "max_bytes") / 1e6);
    }
    json_decref(held);
    return code;
}
