/* query.c: jobs read in rows. */
#include "store/sqlite/internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

char *sqlite_copy_text(statement *st, int at, bool *ok)
{
    if (sqlite3_column_type(st->stmt, at) == SQLITE_NULL)
        return NULL;
    const char *text = (const char *)sqlite3_column_text(st->stmt, at);
    char *copy = text ? strdup(text) : NULL;
    *ok = *ok && copy;
    return copy;
}

store_status sqlite_read_job(statement *st, job *out)
{
    sqlite3_stmt *row = st->stmt;
    job_clear(out);
    const char *id = (const char *)sqlite3_column_text(row, 0);
    bool ok = id && strlen(id) < sizeof out->id;
    if (ok)
        strcpy(out->id, id);
    out->status = (job_status)sqlite3_column_int(row, 1);
    out->progress = sqlite3_column_int(row, 2);
    out->attempts = sqlite3_column_int(row, 3);
    out->created = sqlite3_column_double(row, 4);
    out->started = sqlite3_column_double(row, 5);
    out->finished = out->status == JOB_RUNNING ? 0.0 : sqlite3_column_double(row, 6);
    out->tags = sqlite_copy_text(st, 7, &ok);
    out->summary = sqlite_copy_text(st, 8, &ok);
    out->error = sqlite_copy_text(st, 9, &ok);
    out->priority = sqlite3_column_int(row, 11);
    const char *client = (const char *)sqlite3_column_text(row, 13);
    ok = ok && client && strlen(client) < sizeof out->client;
    if (ok)
        strcpy(out->client, client);
    const char *refines = (const char *)sqlite3_column_text(row, 10);
    if (refines && strlen(refines) < sizeof out->refines)
        strcpy(out->refines, refines);
    out->damaged = ok && !sqlite3_column_int(row, 12);
    if (out->damaged) {
        free(out->summary);
        out->summary = NULL;
    }
    if (ok)
        return STORE_OK;
    job_clear(out);
    strcpy(st->c->message, "a job's row is damaged, or there is no memory for it");
    return STORE_ERROR;
}

/* Reads up to limit + 1 rows: one more says whether there are older ones. */
store_status sqlite_list(store *base, const store_query *q, job *jobs, size_t *count)
{
    static const query_id QUERIES[2][2][2] = {
        {{QUERY_LIST, QUERY_LIST_STATUS}, {QUERY_LIST_TAG, QUERY_LIST_TAG_STATUS}},
        {{QUERY_OLDEST, QUERY_OLDEST_STATUS}, {QUERY_OLDEST_TAG, QUERY_OLDEST_TAG_STATUS}}};
    sqlite_store *s = sqlite_of(base);
    store_status status = STORE_OK;
    connection *c = sqlite_take_reader(s);
    const bool by_client = q->client && q->client[0] && !q->tag; /* a tag has fewer jobs than most clients */
    statement st = statement_begin(c, by_client ? (q->ascending ? QUERY_OLDEST_CLIENT : QUERY_LIST_CLIENT)
                                                : QUERIES[q->ascending][q->tag != NULL][q->by_status]);
    bind_text(&st, 1, q->before ? q->before : q->ascending ? "" : "~"); /* after every hex digit */
    bind_integer(&st, 2, q->limit + 1);
    if (q->by_status)
        bind_integer(&st, 3, q->status);
    if (q->tag)
        bind_text(&st, 4, q->tag);
    bind_real(&st, 5, q->since);
    bind_real(&st, 6, q->until > 0.0 ? q->until : 1e18);
    for (int i = 0; i < STORE_MORE_TAGS; i++)
        bind_text(&st, 7 + i, q->more[i]);
    /* Ids begin with the milliseconds of their creation, taken a moment before `created` and never going back. */
    char least[16];
    double ms = (q->since - 1.0) * 1e3;
    snprintf(least, sizeof least, "%012llx", ms > 0.0 ? (unsigned long long)fmin(ms, 281474976710655.0) : 0ULL);
    bind_text(&st, 10, least);
    bind_text(&st, 11, q->client);
    while (status == STORE_OK && *count <= (size_t)q->limit && statement_row(&st)) {
        status = sqlite_read_job(&st, &jobs[*count]);
        *count += status == STORE_OK;
    }
    status = sqlite_give_reader(s, c, statement_end(&st, status));
    return status == STORE_OK ? sqlite_settle_jobs(s, jobs, *count) : status;
}

store_status sqlite_get_cases(store *base, const char *id, const char *name, store_case **cases, size_t *count)
{
    sqlite_store *s = sqlite_of(base);
    store_status status = STORE_OK;
    size_t capacity = 0;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_ANSWERS);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    while (status == STORE_OK && statement_row(&st)) {
        bool ok = true;
        if (*count == capacity) {
            capacity = capacity ? 2 * capacity : 16;
            store_case *grown = realloc(*cases, capacity * sizeof *grown);
            *cases = grown ? grown : *cases;
            ok = grown != NULL;
        }
        if (ok) { /* counted as soon as it has something to be freed */
            store_case *one = &(*cases)[(*count)++];
            *one = (store_case){.number = sqlite3_column_int64(st.stmt, 0)};
            one->name = sqlite_copy_text(&st, 1, &ok);
            one->summary = sqlite_copy_text(&st, 2, &ok);
        }
        if (!ok) {
            strcpy(c->message, "no memory for the cases of a job");
            status = STORE_ERROR;
        } else if (!sqlite3_column_int(st.stmt, 3)) {
            snprintf(c->message, sizeof c->message, "a summary of job %.32s is not what was written", id);
            status = STORE_DAMAGED;
        }
    }
    return sqlite_give_reader(s, c, statement_end(&st, status));
}

store_status sqlite_counts(store *base, int64_t counts[STORE_COUNTS])
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_COUNTS);
    while (statement_row(&st)) {
        int status = sqlite3_column_int(st.stmt, 0);
        if (status >= 0 && status < STORE_COUNTS)
            counts[status] = sqlite3_column_int64(st.stmt, 1);
    }
    return sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
}
