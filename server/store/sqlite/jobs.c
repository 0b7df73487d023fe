/* jobs.c: the life of a job, each step one transaction. */
#include "store/sqlite/internal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- submit */

typedef struct {
    const store_request *request;
    job *out;
    bool repeated;
} submit_args;

/* The job that came with this key before: STORE_NOT_FOUND, STORE_CONFLICT if its body was another one. Bodies are
 * compared byte by byte: nothing has to be stored or computed for the many requests that are never repeated. */
static store_status find_key(connection *c, submit_args *a)
{
    store_status status = STORE_NOT_FOUND;
    const kept_key key = store_kept_key(a->request);
    statement st = statement_begin(c, QUERY_FIND_KEY);
    bind_text(&st, 1, key.text);
    bind_integer(&st, 2, (int64_t)a->request->body_len);
    bind_blob(&st, 3, a->request->body, a->request->body_len);
    if (statement_row(&st))
        status = sqlite3_column_int(st.stmt, 14) ? sqlite_read_job(&st, a->out) : STORE_CONFLICT;
    return statement_end(&st, status);
}

/* The job and all that refers to it. STORE_NOT_FOUND where an upload is not there. */
static store_status insert_job(connection *c, const store_request *r, const char *id)
{
    const char *tags = r->tags ? r->tags : "[]";
    const char *client = r->client ? r->client : "";
    const double now = clock_seconds(CLOCK_REALTIME);
    const kept_key key = store_kept_key(r);
    statement st = statement_begin(c, QUERY_INSERT_JOB);
    bind_text(&st, 1, id);
    bind_real(&st, 2, now);
    bind_text(&st, 3, tags);
    bind_text(&st, 4, r->idempotency_key ? key.text : NULL);
    bind_text(&st, 5, r->refines);
    bind_integer(&st, 6, r->priority);
    bind_real(&st, 7, r->queue_limit_s > 0 ? now + r->queue_limit_s : 0);
    bind_integer(&st, 8, (int64_t)r->body_len);
    bind_text(&st, 9, client);
    bind_text(&st, 10, r->share ? r->share : "");
    bind_integer(&st, 11, r->small);
    store_status status = statement_run(&st);
    if (status != STORE_OK)
        return status;
    st = statement_begin(c, QUERY_INSERT_REQUEST);
    bind_text(&st, 1, id);
    bind_blob(&st, 2, r->body, r->body_len);
    status = statement_run(&st);
    if (status != STORE_OK)
        return status;
    st = statement_begin(c, QUERY_INSERT_TAGS);
    bind_text(&st, 1, id);
    bind_text(&st, 2, tags);
    status = statement_run(&st);
    for (size_t i = 0; i < r->n_uploads && status == STORE_OK; i++) {
        st = statement_begin(c, QUERY_TOUCH_UPLOAD);
        bind_text(&st, 1, r->uploads[i]);
        bind_real(&st, 2, now);
        bind_text(&st, 3, r->any_upload ? NULL : client);
        status = statement_run(&st);
        if (status != STORE_OK)
            return status;
        if (sqlite3_changes64(c->db) == 0)
            return STORE_NOT_FOUND;
        st = statement_begin(c, QUERY_USE_UPLOAD);
        bind_text(&st, 1, r->uploads[i]);
        bind_text(&st, 2, id);
        status = statement_run(&st);
    }
    if (status == STORE_OK && r->webhook) {
        st = statement_begin(c, QUERY_INSERT_WEBHOOK);
        bind_text(&st, 1, id);
        bind_text(&st, 2, r->webhook);
        status = statement_run(&st);
    }
    return status;
}

static store_status read_by_id(connection *c, const char *id, job *out)
{
    store_status status = STORE_NOT_FOUND;
    statement st = statement_begin(c, QUERY_JOB);
    bind_text(&st, 1, id);
    if (statement_row(&st))
        status = sqlite_read_job(&st, out);
    return statement_end(&st, status);
}

store_status sqlite_check_quota(const sqlite_store *s, connection *c, const char *client, int64_t more, bool submits)
{
    const client_quotas *most = &s->base.settings.quotas;
    bool over[3] = {false};
    if (!client || !client[0] || (most->waiting <= 0 && most->bytes <= 0 && most->seconds <= 0.0))
        return STORE_OK;
    statement st = statement_begin(c, QUERY_CLIENT);
    bind_text(&st, 1, client);
    bind_integer(&st, 2, (int64_t)(clock_seconds(CLOCK_REALTIME) / 86400.0));
    if (statement_row(&st)) {
        over[QUOTA_WAITING] = submits && most->waiting > 0 && sqlite3_column_int64(st.stmt, 0) >= most->waiting;
        over[QUOTA_BYTES] = most->bytes > 0 && sqlite3_column_int64(st.stmt, 1) + more > most->bytes;
        over[QUOTA_SECONDS] = submits && most->seconds > 0.0 && sqlite3_column_double(st.stmt, 2) >= most->seconds;
    }
    const store_status status = statement_end(&st, over[0] || over[1] || over[2] ? STORE_QUOTA : STORE_OK);
    if (status == STORE_QUOTA)
        store_say_quota(c->message, sizeof c->message, client,
                        over[QUOTA_WAITING] ? QUOTA_WAITING
                        : over[QUOTA_BYTES] ? QUOTA_BYTES
                                            : QUOTA_SECONDS);
    return status;
}

static store_status submit(sqlite_store *s, connection *c, void *args)
{
    submit_args *a = args;
    char id[33];
    job_clear(a->out);
    a->repeated = false;
    if (a->request->idempotency_key) {
        store_status status = find_key(c, a);
        a->repeated = status == STORE_OK;
        if (status != STORE_NOT_FOUND)
            return status;
    }
    store_status status = sqlite_check_place(s, c);
    if (status == STORE_OK && s->base.settings.max_queue > 0) {
        int64_t waiting = 0;
        statement st = statement_begin(c, QUERY_WAITING);
        if (statement_row(&st))
            waiting = sqlite3_column_int64(st.stmt, 0);
        status = statement_end(&st, waiting < s->base.settings.max_queue ? STORE_OK : STORE_BUSY);
    }
    if (status == STORE_OK)
        status = sqlite_check_quota(s, c, a->request->client, (int64_t)a->request->body_len, true);
    if (status != STORE_OK)
        return status;
    store_next_id(&s->last_ms, &s->sequence, id);
    status = insert_job(c, a->request, id);
    if (status == STORE_OK)
        trail_note(&s->trail, "submitted", id);
    return status == STORE_OK ? read_by_id(c, id, a->out) : status;
}

store_status sqlite_submit(store *base, const store_request *request, job *out, bool *repeated)
{
    submit_args a = {request, out, false};
    sqlite_store *s = sqlite_of(base);
    uint64_t number;
    store_status status = sqlite_change(&number, s, false, submit, &a);
    *repeated = a.repeated;
    if (status != STORE_OK)
        return status;
    sqlite_sync(s, number, false);
    if (!a.repeated) /* a worker may begin while the disk turns: what it comes to is read once all is there */
        store_tell(base, out->id, true, NULL);
    return sqlite_sync(s, number, true);
}

store_status sqlite_find_repeat(store *base, const store_request *request, job *out)
{
    sqlite_store *s = sqlite_of(base);
    submit_args a = {request, out, false};
    connection *c = sqlite_take_reader(s);
    store_status status = sqlite_give_reader(s, c, find_key(c, &a));
    return status == STORE_OK ? sqlite_settle(s) : status; /* it may have been committed a moment ago */
}

/* ---- the request as submitted */

/* *body stays NULL where this fails. */
static store_status read_body(connection *c, const char *id, char **body, size_t *len)
{
    statement st = statement_begin(c, QUERY_BODY);
    bind_text(&st, 1, id);
    bool found = statement_row(&st), good = found && sqlite3_column_int(st.stmt, 1);
    if (good) {
        const size_t size = (size_t)sqlite3_column_bytes(st.stmt, 0);
        const void *data = sqlite3_column_blob(st.stmt, 0);
        *body = data || size == 0 ? malloc(size + 1) : NULL;
        if (*body && size > 0)
            memcpy(*body, data, size);
        if (*body)
            (*body)[size] = '\0';
        *len = *body ? size : 0;
    }
    store_status ended = statement_end(&st, STORE_OK);
    if (ended != STORE_OK || *body)
        return ended;
    if (found && !good) {
        snprintf(c->message, sizeof c->message, "the request of job %.32s is not what was written", id);
        return STORE_DAMAGED;
    }
    strcpy(c->message, "the request of a job is missing, or there is no memory for it");
    return found ? STORE_ERROR : STORE_NOT_FOUND;
}

store_status sqlite_get_body(store *base, const char *id, char **body, size_t *len)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    return sqlite_give_reader(s, c, read_body(c, id, body, len));
}

/* ---- claim */

/* An owner as the column has it: with the token, since the table has no column for that. */
typedef struct {
    char text[160];
} holder;

static holder holder_of(const store_lease *lease)
{
    holder h;
    snprintf(h.text, sizeof h.text, "%s#%llu", lease->owner, (unsigned long long)lease->token);
    return h;
}

typedef struct {
    store_lease *lease;
    double lease_s;
    bool small;
    job *out;
    char *body;
    size_t body_len;
} claim_args;

static store_status claim(sqlite_store *s, connection *c, void *args)
{
    claim_args *a = args;
    a->lease->token = ++s->claims;
    a->lease->seconds = a->lease_s;
    const holder owner = holder_of(a->lease);
    job_clear(a->out);
    free(a->body);
    a->body = NULL;
    store_status status = STORE_NOT_FOUND;
    statement st = statement_begin(c, a->small ? QUERY_CLAIM_SMALL : QUERY_CLAIM);
    bind_real(&st, 1, clock_seconds(CLOCK_REALTIME));
    bind_text(&st, 2, owner.text);
    bind_real(&st, 3, a->lease_s);
    if (statement_row(&st))
        status = sqlite_read_job(&st, a->out);
    status = statement_end(&st, status);
    if (status != STORE_OK)
        return status;
    status = read_body(c, a->out->id, &a->body, &a->body_len);
    if (status == STORE_DAMAGED) /* it is to end, not to stand before all others for ever */
        return STORE_OK;
    return status == STORE_NOT_FOUND ? STORE_ERROR : status; /* a job without its request is a damaged file */
}

store_status sqlite_claim(store *base, store_lease *lease, double lease_s, bool small, job *out, char **body,
                          size_t *len)
{
    claim_args a = {lease, lease_s, small, out, NULL, 0};
    store_status status = sqlite_write(sqlite_of(base), WRITE_LAZY, claim, &a);
    *body = a.body;
    *len = a.body_len;
    return status;
}

/* ---- while it runs and when it ends */

/* Of the running jobs those that were told to end, or the one of them with this id and owner: no run comes any more
 * that could end them. */
static store_status end_dismissed(connection *c, const char *id, const char *owner, int64_t *count)
{
    statement st = statement_begin(c, QUERY_END_DISMISSED);
    bind_text(&st, 1, id);
    bind_text(&st, 2, owner);
    store_status status = statement_run(&st);
    *count = status == STORE_OK ? sqlite3_changes64(c->db) : 0;
    return status;
}

typedef struct {
    const store_lease *lease;
    const lease_use *use;
} owner_args;

static store_status change_own(sqlite_store *s, connection *c, void *args)
{
    static const query_id QUERIES[] = {
        [LEASE_RENEW] = QUERY_RENEW, [LEASE_FINISH] = QUERY_FINISH, [LEASE_RELEASE] = QUERY_RELEASE};
    const owner_args *a = args;
    const lease_use *use = a->use;
    const char *id = a->lease->job;
    const holder owner = holder_of(a->lease);
    const double now = clock_seconds(CLOCK_REALTIME);
    int64_t dismissed = 0;
    statement st = statement_begin(c, QUERY_CHARGE);
    bind_text(&st, 1, id);
    bind_text(&st, 2, owner.text);
    bind_real(&st, 3, now);
    bind_real(&st, 4, a->lease->seconds);
    store_status status = statement_run(&st);
    if (status == STORE_OK && use->what == LEASE_RELEASE)
        status = end_dismissed(c, id, owner.text, &dismissed);
    if (status != STORE_OK || dismissed > 0)
        return status;
    st = statement_begin(c, QUERIES[use->what]);
    bind_text(&st, 1, id);
    bind_text(&st, 2, owner.text);
    if (use->what == LEASE_RENEW) {
        bind_real(&st, 3, now + a->lease->seconds);
        bind_integer(&st, 4, use->progress);
    } else if (use->what == LEASE_RELEASE) {
        bind_integer(&st, 3, use->counted ? 0 : 1);
    } else if (use->what == LEASE_FINISH) {
        bind_integer(&st, 3, use->outcome->status);
        bind_real(&st, 4, now);
        bind_text(&st, 5, use->outcome->whole.summary);
        bind_text(&st, 6, use->outcome->error);
    }
    status = statement_run(&st);
    if (status == STORE_OK && sqlite3_changes64(c->db) == 0) {
        st = statement_begin(c, QUERY_JOB);
        bind_text(&st, 1, id);
        const bool exists = statement_row(&st);
        return statement_end(&st, exists ? STORE_CONFLICT : STORE_NOT_FOUND);
    }
    if (status != STORE_OK || use->what != LEASE_FINISH)
        return status;
    for (size_t i = 0; i < use->outcome->n_cases && status == STORE_OK; i++) { /* the job's own is in its row */
        st = statement_begin(c, QUERY_INSERT_ANSWER);
        bind_text(&st, 1, id);
        bind_integer(&st, 2, (int64_t)i + 1);
        bind_text(&st, 3, use->outcome->cases[i].name);
        bind_text(&st, 4, use->outcome->cases[i].summary);
        status = statement_run(&st);
    }
    int64_t bytes = 0;
    char *contents = NULL;
    if (status == STORE_OK)
        status = result_blobs_put(&SQLITE_RESULTS, c, id, use->outcome, &bytes, &contents, c->message);
    if (status != STORE_OK)
        return status;
    st = statement_begin(c, QUERY_ADD_CONTENTS);
    bind_text(&st, 1, id);
    bind_integer(&st, 2, bytes);
    bind_text(&st, 3, contents);
    status = statement_run(&st);
    free(contents);
    trail_note(&s->trail, "ended", id);
    return status;
}

store_status sqlite_use_lease(store *base, const store_lease *lease, const lease_use *use)
{
    owner_args a = {lease, use};
    return sqlite_write(sqlite_of(base), use->what == LEASE_RENEW ? WRITE_LAZY : WRITE_SOON, change_own, &a);
}

/* ---- recover */

typedef struct {
    int max_attempts;
    const char *error_json;
    int64_t requeued, failed;
} recover_args;

static store_status recover(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    recover_args *a = args;
    int64_t dismissed;
    store_status status = end_dismissed(c, NULL, NULL, &dismissed);
    if (status != STORE_OK)
        return status;
    statement st = statement_begin(c, QUERY_RECOVER_FAIL);
    bind_integer(&st, 1, a->max_attempts);
    bind_real(&st, 2, clock_seconds(CLOCK_REALTIME));
    bind_text(&st, 3, a->error_json);
    status = statement_run(&st);
    if (status != STORE_OK)
        return status;
    a->failed = sqlite3_changes64(c->db);
    st = statement_begin(c, QUERY_RECOVER_REQUEUE);
    status = statement_run(&st);
    a->requeued = sqlite3_changes64(c->db);
    return status;
}

/* The lock on the file proves that no owner of a running job is alive, whatever its lease says. */
store_status sqlite_recover(store *base, int max_attempts, const char *error_json, int64_t *requeued, int64_t *failed)
{
    recover_args a = {max_attempts, error_json, 0, 0};
    store_status status = sqlite_write(sqlite_of(base), WRITE_DURABLE, recover, &a);
    *requeued = a.requeued;
    *failed = a.failed;
    return status;
}

/* ---- dismiss */

typedef struct {
    const char *id;
    job_status was;
    char client[STORE_CLIENT];
} dismiss_args;

static store_status dismiss(sqlite_store *s, connection *c, void *args)
{
    dismiss_args *a = args;
    job j = {0};
    store_status status = read_by_id(c, a->id, &j);
    if (status != STORE_OK)
        return status;
    a->was = j.status;
    memcpy(a->client, j.client, sizeof a->client);
    job_clear(&j);
    statement st = statement_begin(c, a->was == JOB_ACCEPTED  ? QUERY_DISMISS
                                      : a->was == JOB_RUNNING ? QUERY_DISMISS_RUNNING
                                                              : QUERY_DELETE);
    bind_text(&st, 1, a->id);
    if (a->was == JOB_ACCEPTED || a->was == JOB_RUNNING)
        bind_real(&st, 2, clock_seconds(CLOCK_REALTIME));
    trail_note(&s->trail, a->was == JOB_ACCEPTED || a->was == JOB_RUNNING ? "dismissed" : "deleted", a->id);
    return statement_run(&st);
}

store_status sqlite_dismiss(store *base, const char *id, job_status *was)
{
    dismiss_args a = {.id = id, .was = JOB_ACCEPTED};
    store_status status = sqlite_write(sqlite_of(base), WRITE_FREES, dismiss, &a);
    *was = a.was;
    if (status == STORE_OK && a.was != JOB_RUNNING)
        store_tell(base, id, false, a.was == JOB_ACCEPTED ? NULL : a.client);
    return status;
}

/* ---- one job */

/* What has just ended is told once it is on disk. After this long it is, even if nobody asked for it. */
static const double UNSETTLED_S = 60.0;

store_status sqlite_settle_jobs(sqlite_store *s, const job *jobs, size_t count)
{
    bool fresh = false;
    for (size_t i = 0; i < count; i++)
        fresh = fresh || (jobs[i].status != JOB_ACCEPTED && jobs[i].status != JOB_RUNNING &&
                          fabs(clock_seconds(CLOCK_REALTIME) - jobs[i].finished) < UNSETTLED_S);
    return fresh ? sqlite_settle(s) : STORE_OK;
}

store_status sqlite_get(store *base, const char *id, job *out)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    store_status status = sqlite_give_reader(s, c, read_by_id(c, id, out));
    return status == STORE_OK ? sqlite_settle_jobs(s, out, 1) : status;
}
