/* encode.c: replies about jobs and about the service. */
#include "codec/codec.h"
#include "codec/json.h"
#include "codec/text.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ------------------------------------------------------------- problems */

/* All but the bracket that closes it. */
static void put_problem(text *t, const problem_details *problem)
{
    text_open(t, NULL, '{');
    text_key(t, "type");
    text_format(t, "\"/schemas/problem-details.json#%s\"", problem->code);
    text_string(t, "title", problem->title);
    text_integer(t, "status", problem->status);
    text_string(t, "code", problem->code);
    text_string(t, "detail", problem->detail);
    if (problem->pointer[0] || problem->status == 422)
        text_string(t, "pointer", problem->pointer);
    if (problem->line > 0)
        text_integer(t, "line", problem->line);
}

char *codec_encode_problem(const problem_details *problem)
{
    text t = {0};
    put_problem(&t, problem);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_mistakes(const problem_details *list, size_t count)
{
    text t = {0};
    put_problem(&t, &list[0]);
    text_open(&t, "mistakes", '[');
    for (size_t i = 0; i < count; i++) {
        text_open(&t, NULL, '{');
        text_string(&t, "code", list[i].code);
        text_string(&t, "detail", list[i].detail);
        text_string(&t, "pointer", list[i].pointer);
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

void codec_problem_damaged(problem_details *out, const char *id)
{
    *out = (problem_details){.status = 500, .code = "stored_data_damaged", .title = "Stored data are damaged"};
    snprintf(out->detail, sizeof out->detail,
             "What is stored of job %.32s is not what was written, by its checksum: it is not shown. Delete the job "
             "and submit it again; uzawad --check-db finds what else is damaged.",
             id);
}

/* ----------------------------------------------------------------- jobs */

/* RFC 3339, UTC, milliseconds; null for 0. */
static void put_time(text *t, const char *key, double unix_s)
{
    char date[32];
    struct tm tm;
    long long ms = (long long)floor(unix_s * 1000 + 0.5);
    time_t seconds = (time_t)(ms / 1000);
    text_key(t, key);
    if (!(unix_s > 0) || !gmtime_r(&seconds, &tm) || strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &tm) == 0)
        text_put(t, "null");
    else
        text_format(t, "\"%s.%03dZ\"", date, (int)(ms % 1000));
}

static void put_link(text *t, const char *rel, const char *all, const char *id, const char *tail)
{
    text_open(t, NULL, '{');
    text_string(t, "rel", rel);
    text_key(t, "href");
    text_format(t, "\"/v1/%s%s%s%s\"", all, *id ? "/" : "", id, tail);
    text_close(t, '}');
}

/* The grid that is solved, of a job that looks for one; else nothing. */
static void put_grid(text *t, const job_grid *grid)
{
    if (grid->number == 0)
        return;
    text_open(t, "grid", '{');
    text_integer(t, "number", grid->number);
    text_number(t, "unknowns", grid->unknowns);
    text_number(t, "error", grid->error);
    text_number(t, "asked", grid->asked);
    text_number(t, "seconds_left", grid->seconds_left);
    text_close(t, '}');
}

/* The tags, of which the first may be the name (CODEC_NAME_TAG): JSON as codec_decode has written it. */
static void put_labels(text *t, const char *tags)
{
    static const char NAMED[] = "[\"\\u001f"; /* CODEC_NAME_TAG in JSON */
    if (strncmp(tags, NAMED, sizeof NAMED - 1) != 0) {
        text_raw(t, "tags", tags);
        return;
    }
    const char *name = tags + sizeof NAMED - 1, *end = name;
    while (*end && *end != '"')
        end += *end == '\\' && end[1] ? 2 : 1;
    text_key(t, "name");
    text_bytes(t, "\"", 1);
    text_bytes(t, name, (size_t)(end - name) + (*end == '"'));
    text_key(t, "tags");
    text_bytes(t, "[", 1);
    end += *end == '"';
    text_put(t, end + (*end == ','));
}

static void put_job(text *t, const job *j)
{
    size_t len; /* each case has a history of its own, under its name */
    const bool has_cases = j->summary && json_member_text(j->summary, strlen(j->summary), "cases", &len);
    text_open(t, NULL, '{');
    text_string(t, "id", j->id);
    text_string(t, "status", job_status_name(j->status));
    text_integer(t, "progress", j->progress);
    put_grid(t, &j->grid);
    put_time(t, "created", j->created);
    put_time(t, "started", j->started);
    put_time(t, "finished", j->finished);
    text_integer(t, "attempts", j->attempts);
    text_integer(t, "priority", j->priority);
    if (j->client[0])
        text_string(t, "owner", j->client);
    put_labels(t, j->tags ? j->tags : "[]");
    text_raw(t, "summary", j->summary);
    if (j->damaged) {
        problem_details problem;
        codec_problem_damaged(&problem, j->id);
        char *error = codec_encode_problem(&problem);
        t->failed = t->failed || !error;
        text_raw(t, "error", error);
        free(error);
    } else {
        text_raw(t, "error", j->error);
    }
    text_open(t, "links", '[');
    put_link(t, "self", "jobs", j->id, "");
    /* A job that was dismissed while it ran may have left its best answer so far. */
    const bool has_answer = !j->damaged && (j->status == JOB_SUCCESSFUL || (j->status == JOB_DISMISSED && j->summary));
    if (has_answer)
        put_link(t, "result", "jobs", j->id, "/result");
    if (has_answer && !has_cases) {
        put_link(t, "history", "jobs", j->id, "/history");
        put_link(t, "history_csv", "jobs", j->id, "/history.csv");
    }
    if (j->status == JOB_ACCEPTED || j->status == JOB_RUNNING)
        put_link(t, "events", "jobs", j->id, "/events");
    if (j->refines[0])
        put_link(t, "refines", "jobs", j->refines, "");
    text_close(t, ']');
    text_close(t, '}');
}

char *codec_encode_job(const job *j)
{
    text t = {0};
    put_job(&t, j);
    return text_finish(&t, NULL);
}

char *codec_encode_jobs(const job *jobs, size_t count, bool more)
{
    text t = {0};
    text_open(&t, NULL, '{');
    text_open(&t, "jobs", '[');
    for (size_t i = 0; i < count; i++)
        put_job(&t, &jobs[i]);
    text_close(&t, ']');
    text_string(&t, "next", more && count > 0 ? jobs[count - 1].id : NULL);
    text_open(&t, "links", '[');
    put_link(&t, "self", "jobs", "", "");
    text_close(&t, ']');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

/* -------------------------------------------------------------- service */

char *codec_encode_factors(const uz_cache_entry *entries, size_t count, size_t max_bytes)
{
    text t = {0};
    size_t bytes = 0;
    text_open(&t, NULL, '{');
    text_open(&t, "factors", '[');
    for (size_t i = 0; i < count; i++) {
        const uz_cache_entry *e = &entries[i];
        bytes += e->bytes;
        text_open(&t, NULL, '{');
        text_string(&t, "digest", e->digest);
        text_integer(&t, "d", e->d);
        text_integer(&t, "m", e->m);
        text_integer(&t, "nnz", e->nnz);
        text_integer(&t, "bytes", (int64_t)e->bytes);
        text_integer(&t, "hits", e->hits);
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_integer(&t, "bytes", (int64_t)bytes);
    text_integer(&t, "max_bytes", (int64_t)max_bytes);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_nodes(const store_node *nodes, size_t count)
{
    text t = {0};
    char body[17];
    text_open(&t, NULL, '{');
    text_open(&t, "nodes", '[');
    for (size_t i = 0; i < count; i++) {
        const store_node *n = &nodes[i];
        text_open(&t, NULL, '{');
        text_string(&t, "name", n->name);
        text_string(&t, "state", !n->alive ? "silent" : n->draining ? "draining" : "active");
        text_string(&t, "host", n->host);
        text_integer(&t, "pid", n->pid);
        text_string(&t, "version", n->version);
        put_time(&t, "started", n->begun);
        put_time(&t, "seen", n->seen);
        text_integer(&t, "workers", n->workers);
        text_integer(&t, "busy", n->busy);
        text_integer(&t, "running", n->running);
        text_open(&t, "cache", '{');
        text_integer(&t, "factors", n->factors);
        text_integer(&t, "bytes", n->bytes);
        text_integer(&t, "max_bytes", n->max_bytes);
        text_close(&t, '}');
        text_open(&t, "bodies", '[');
        for (size_t k = 0; k < n->n_bodies; k++) {
            snprintf(body, sizeof body, "%016" PRIx64, n->bodies[k]);
            text_string(&t, NULL, body);
        }
        text_close(&t, ']');
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_valid(const uz_prediction *predicted)
{
    text t = {0};
    text_open(&t, NULL, '{');
    text_bool(&t, "valid", true);
    text_key(&t, "predicted");
    if (!predicted) {
        text_raw(&t, NULL, NULL);
    } else {
        text_open(&t, NULL, '{');
        text_integer(&t, "d", predicted->d);
        text_integer(&t, "m", predicted->m);
        text_string(&t, "operator", uz_choice_name(UZ_CHOICE_OPERATOR, predicted->op));
        text_integer(&t, "factor_nnz", predicted->factor_nnz);
        text_number(&t, "bytes", predicted->bytes);
        text_number(&t, "seconds", predicted->seconds);
        if (predicted->compared_bytes > 0)
            text_number(&t, "compared_bytes", predicted->compared_bytes);
        text_bool(&t, "fits", predicted->fits);
        text_close(&t, '}');
    }
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_progress(int progress, const job_grid *grid, const double *row)
{
    static const int SHOWN[] = {0, 2, 3, 9, 10}; /* columns of the history */
    text t = {0};
    text_open(&t, NULL, '{');
    text_integer(&t, "progress", progress);
    put_grid(&t, grid);
    for (size_t i = 0; row && i < sizeof SHOWN / sizeof SHOWN[0]; i++)
        text_number(&t, CODEC_HISTORY_NAMES[SHOWN[i]], row[SHOWN[i]]);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_upload(const upload_info *info)
{
    text t = {0};
    text_open(&t, NULL, '{');
    text_string(&t, "id", info->id);
    text_integer(&t, "bytes", info->bytes);
    put_time(&t, "created", info->created);
    put_time(&t, "used", info->used);
    text_integer(&t, "used_by", info->jobs);
    text_open(&t, "links", '[');
    put_link(&t, "self", "uploads", info->id, "");
    text_close(&t, ']');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_health(const char *status, const int64_t counts[5], int workers)
{
    text t = {0};
    text_open(&t, NULL, '{');
    text_string(&t, "status", status);
    text_integer(&t, "workers", workers);
    text_open(&t, "jobs", '{');
    for (int i = JOB_ACCEPTED; i <= JOB_DISMISSED; i++)
        text_integer(&t, job_status_name((job_status)i), counts[i]);
    text_close(&t, '}');
    text_close(&t, '}');
    return text_finish(&t, NULL);
}
