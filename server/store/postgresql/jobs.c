/* jobs.c: the life of a job, each step one transaction. Submissions and ends that come while others are on their way
 * are one transaction together: they wait for the same disk. */
#include "store/postgresql/former.h"
#include "store/postgresql/objects.h"

#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A change with more than this has a transaction, and a connection, of its own: nobody waits for its bytes. */
#define SHARED_MOST ((int64_t)256 << 10)

/* A submission (request) or an end (lease). */
typedef struct {
    batch_change base;
    const store_request *request;
    char id[33];
    double created;
    kept_key key;
    unsigned char digest[32];
    const char *body_objects; /* the names of those that have the body; NULL: it goes with the transaction */
    job *out;
    bool repeated;
    const store_lease *lease;
    const store_outcome *outcome;
    const placed_result *placed; /* its result is in objects; NULL: it goes with the transaction */
    bool again;                  /* a submission that may have been carried out before */
    double finished;             /* of an end: when it was */
    store_status status;
    size_t answer; /* where the call's that decides is */
    char message[LINK_CAUSE];
} change;

/* ---- submit */

static bool digest_of(const store_request *r, unsigned char digest[32])
{
    return gnutls_hash_fast(GNUTLS_DIG_SHA256, r->body_len > 0 ? r->body : "", r->body_len, digest) == 0;
}

/* "{id,id}", an array of texts that need no quotes; NULL: no memory. */
static char *array_of(const char (*ids)[65], size_t n)
{
    char *text = malloc(n * 65 + 3), *at = text;
    if (!text)
        return NULL;
    *at++ = '{';
    for (size_t i = 0; i < n; i++)
        at += sprintf(at, "%s%.64s", i > 0 ? "," : "", ids[i]);
    strcpy(at, "}");
    return text;
}

static void send_submission(postgresql_store *s, link_to *l, change *c)
{
    const store_request *r = c->request;
    const client_quotas *most = &s->base.settings.quotas;
    char *uploads = r->n_uploads > 0 ? array_of(r->uploads, r->n_uploads) : NULL;
    call q = {.sql =
                  "SELECT verdict, job FROM uzawa.submit_3($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14,"
                  " $15, $16, $17, $18, $19, $20, $21, $22, $23)"};
    call_text(&q, c->id);
    call_real(&q, c->created);
    if (c->body_objects)
        call_text(&q, NULL);
    else
        call_bytes(&q, r->body, r->body_len);
    call_bytes(&q, c->digest, sizeof c->digest);
    call_text(&q, r->tags ? r->tags : "[]");
    call_text(&q, r->client ? r->client : "");
    call_text(&q, r->share ? r->share : "");
    call_text(&q, r->idempotency_key ? c->key.text : NULL);
    call_text(&q, r->refines);
    call_text(&q, uploads);
    call_bool(&q, r->any_upload);
    call_integer(&q, r->priority);
    call_bool(&q, r->small);
    call_text(&q, r->webhook);
    call_real(&q, r->queue_limit_s > 0 ? r->queue_limit_s : 0.0);
    call_integer(&q, s->base.settings.max_queue);
    call_integer(&q, most->waiting);
    call_integer(&q, most->bytes);
    call_real(&q, most->seconds);
    if (r->held_body)
        call_integer(&q, (int64_t)r->held_body);
    else
        call_text(&q, NULL);
    call_bool(&q, c->again);
    call_integer(&q, (int64_t)r->body_len);
    call_text(&q, c->body_objects);
    c->answer = l->sent;
    if (r->n_uploads > 0 && !uploads) { /* never one that names none */
        l->status = STORE_ERROR;
        strcpy(l->message, "no memory for a submission");
    } else {
        link_send(l, &q);
    }
    free(uploads);
}

/* The job as it was made. */
static store_status fill_job(link_to *l, const change *c)
{
    const store_request *r = c->request;
    job *j = c->out;
    job_clear(j);
    memcpy(j->id, c->id, sizeof j->id);
    j->created = c->created;
    j->priority = r->priority;
    j->tags = strdup(r->tags ? r->tags : "[]");
    snprintf(j->refines, sizeof j->refines, "%s", r->refines ? r->refines : "");
    snprintf(j->client, sizeof j->client, "%s", r->client ? r->client : "");
    if (j->tags)
        return STORE_OK;
    strcpy(l->message, "no memory for a submission");
    return STORE_ERROR;
}

store_status postgresql_over_quota(link_to *l, const char *client, const char *what)
{
    store_say_quota(l->message, sizeof l->message, client,
                    strcmp(what, "waiting") == 0 ? QUOTA_WAITING
                    : strcmp(what, "bytes") == 0 ? QUOTA_BYTES
                                                 : QUOTA_SECONDS);
    return STORE_QUOTA;
}

/* What the call that decides has answered. */
static store_status read_verdict(link_to *l, change *c)
{
    const PGresult *r = l->answers[c->answer];
    if (!c->request) {
        c->finished = cell_real(r, 0, 0);
        return STORE_OK;
    }
    const char *verdict = PQgetvalue(r, 0, 0);
    c->repeated = strcmp(verdict, "repeat") == 0;
    if (strcmp(verdict, "new") == 0 || strcmp(verdict, "again") == 0)
        return fill_job(l, c);
    if (c->repeated)
        return cell_write(c->out->id, sizeof c->out->id, r, 0, 1) ? STORE_OK : STORE_ERROR;
    return strcmp(verdict, "differs") == 0  ? STORE_CONFLICT
           : strcmp(verdict, "busy") == 0   ? STORE_BUSY
           : strcmp(verdict, "upload") == 0 ? STORE_NOT_FOUND
                                            : postgresql_over_quota(l, c->request->client, verdict);
}

/* ---- finish */

/* The result in rows; *bytes and *contents as result_blobs_put has them. */
static void send_result(link_to *l, const change *c, int64_t *bytes, char **contents)
{
    result_place place = {.link = l, .job = c->lease->job, .token = c->lease->token};
    char cause[256] = "";
    store_status put = result_blobs_put(&POSTGRESQL_RESULTS, &place, c->lease->job, c->outcome, bytes, contents, cause);
    if (put == STORE_OK)
        put = postgresql_send_pieces(&place);
    free(place.bytes);
    if (put != STORE_OK && l->status == STORE_OK) {
        l->status = put;
        snprintf(l->message, sizeof l->message, "%.200s", cause);
    }
}

/* What decides comes last: until then nobody waits for this transaction, whatever becomes of the process. */
static void send_end(link_to *l, change *c)
{
    const store_outcome *o = c->outcome;
    int64_t bytes = c->placed ? c->placed->bytes : 0;
    char *contents = NULL;
    for (size_t i = 0; i < o->n_cases; i++) { /* the job's own is in its row */
        call q = {.sql = "INSERT INTO uzawa.answer(job, token, number, name, summary, sum) VALUES ($1::text,"
                         " $2::bigint, $3::bigint, $4::text, $5::text,"
                         " uzawa.sum_of(concat_ws(E'\\x1f', $1::text, $3::bigint, $4::text), $5::text))"
                         " ON CONFLICT (job, number, token) DO NOTHING"}; /* an end that is sent again */
        call_text(&q, c->lease->job);
        call_integer(&q, (int64_t)c->lease->token);
        call_integer(&q, (int64_t)i + 1);
        call_text(&q, o->cases[i].name);
        call_text(&q, o->cases[i].summary);
        link_send(l, &q);
    }
    if (c->placed)
        postgresql_send_placed(l, c->lease->job, c->lease->token, c->placed);
    else
        send_result(l, c, &bytes, &contents);
    call q = {.sql = "SELECT uzawa.finish_3($1, $2, $3, $4, $5, $6, $7, $8)"};
    call_text(&q, c->lease->job);
    call_text(&q, c->lease->owner);
    call_integer(&q, (int64_t)c->lease->token);
    call_integer(&q, o->status);
    call_text(&q, o->whole.summary);
    call_text(&q, o->error);
    call_integer(&q, bytes);
    call_text(&q, c->placed ? c->placed->contents : contents);
    c->answer = l->sent;
    if (l->status == STORE_OK)
        link_send(l, &q);
    free(contents);
}

/* ---- both */

static void send_change(postgresql_store *s, link_to *l, change *c)
{
    if (c->request)
        send_submission(s, l, c);
    else
        send_end(l, c);
}

/* A transaction whose calls could not all be made ends in a failure. */
static store_status end_transaction(link_to *l)
{
    if (l->status == STORE_OK || l->lost)
        return link_end(l);
    l->lost = true; /* whatever was sent is taken back with the connection */
    return l->status;
}

static void run_alone(postgresql_store *s, change *c)
{
    for (int tries = 1;; tries++) {
        link_to *l = postgresql_take(s);
        link_begin(l, LINK_DURABLE);
        send_change(s, l, c);
        c->status = end_transaction(l);
        const bool again = tries < 4 && l->pg && (l->lost ? c->status == STORE_AWAY && !l->silent : l->passing);
        if (c->status == STORE_OK)
            c->status = read_verdict(l, c);
        memcpy(c->message, l->message, sizeof c->message);
        c->again = c->again || l->lost;
        postgresql_give(s, l, c->status);
        if (!again)
            return;
    }
}

static change *next_of(const change *c)
{
    return (change *)c->base.next;
}

/* One order of keys and of jobs for all transactions, so that no two wait for each other. */
static int compare(const void *left, const void *right)
{
    const change *a = *(change *const *)left, *b = *(change *const *)right;
    if (!a->request != !b->request)
        return a->request ? -1 : 1;
    return a->request ? strcmp(a->key.text, b->key.text) : strcmp(a->lease->job, b->lease->job);
}

/* False: nothing of it may be taken for done, and each is to be tried alone. */
static bool run_together(postgresql_store *s, change *list)
{
    change *all[BATCH_MOST] = {list};
    size_t n = 1;
    for (change *c = next_of(list); c; c = next_of(c))
        all[n++] = c;
    qsort(all, n, sizeof *all, compare);
    link_to *l = postgresql_take(s);
    link_begin(l, LINK_DURABLE);
    for (size_t i = 0; i < n; i++)
        send_change(s, l, all[i]);
    store_status status = end_transaction(l);
    for (size_t i = 0; i < n; i++) {
        all[i]->again = l->lost;
        all[i]->status = status;
        if (status == STORE_OK)
            all[i]->status = read_verdict(l, all[i]);
        memcpy(all[i]->message, l->message, sizeof all[i]->message);
    }
    postgresql_give(s, l, status);
    return status == STORE_OK;
}

void postgresql_run_batch(void *ctx, batch_change *first)
{
    postgresql_store *s = ctx;
    change *list = (change *)first;
    const double begun = clock_seconds(CLOCK_MONOTONIC);
    int count = 0;
    if (!next_of(list) || !run_together(s, list))
        for (change *c = list; c; c = next_of(c))
            run_alone(s, c);
    for (change *c = list; c; c = next_of(c))
        count += c->status == STORE_OK;
    metrics_add(s->base.settings.metrics, METRIC_CHANGES, count);
    metrics_seconds(s->base.settings.metrics, METRIC_COMMIT, clock_seconds(CLOCK_MONOTONIC) - begun);
}

static store_status carry_out(postgresql_store *s, change *c, bool alone)
{
    if (alone)
        run_alone(s, c);
    else
        batch_do(&s->changes, &c->base);
    if (c->status != STORE_OK && c->status != STORE_NOT_FOUND && c->status != STORE_CONFLICT && c->status != STORE_BUSY)
        store_set_message(&s->base, c->message);
    return c->status;
}

store_status postgresql_submit(store *base, const store_request *request, job *out, bool *repeated)
{
    postgresql_store *s = postgresql_of(base);
    change c = {.request = request, .out = out, .created = clock_seconds(CLOCK_REALTIME)};
    if (request->idempotency_key)
        c.key = store_kept_key(request);
    if (!digest_of(request, c.digest)) {
        store_set_message(base, "the digest of a request failed");
        return STORE_ERROR;
    }
    pthread_mutex_lock(&s->state_lock);
    store_next_id(&s->last_ms, &s->sequence, c.id);
    pthread_mutex_unlock(&s->state_lock);
    char *placed = postgresql_place_request(s, request->body, request->body_len);
    c.body_objects = placed;
    store_status status =
        carry_out(s, &c, request->n_uploads > 0 || (!placed && (int64_t)request->body_len > SHARED_MOST));
    free(placed);
    *repeated = c.repeated;
    if (status != STORE_OK || c.repeated) {
        char id[33];
        memcpy(id, out->id, sizeof id);
        return status == STORE_OK ? postgresql_get(base, id, out) : status;
    }
    postgresql_tell(s, out->id, TELL_WAITS, NULL, true);
    return STORE_OK;
}

static store_status read_repeat(link_to *l, const PGresult *r, void *out)
{
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    return cell_integer(r, 0, 14) ? postgresql_read_job(l, r, 0, out) : STORE_CONFLICT;
}

store_status postgresql_find_repeat(store *base, const store_request *request, job *out)
{
    unsigned char digest[32];
    const kept_key key = store_kept_key(request);
    call c = {.sql = "SELECT " JOB_COLUMNS ", uzawa.request_digest(job.id) = $2 FROM uzawa.job WHERE job.key = $1"};
    if (!digest_of(request, digest)) {
        store_set_message(base, "the digest of a request failed");
        return STORE_ERROR;
    }
    call_text(&c, key.text);
    call_bytes(&c, digest, sizeof digest);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_repeat, out);
}

/* ---- claim */

typedef struct {
    postgresql_store *s;
    const store_lease *asked;
    kept_claim got[1 + CLAIMS_MOST];
    size_t n;
    double later_s;
} claim_args;

static bool read_claimed(kept_claim *k, const PGresult *r, int row)
{
    unsigned char digest[32];
    job *j = &k->job;
    bool ok = cell_write(j->id, sizeof j->id, r, row, 0);
    j->status = JOB_RUNNING;
    j->attempts = (int)cell_integer(r, row, 1);
    j->created = cell_real(r, row, 2);
    j->started = cell_real(r, row, 3);
    j->tags = cell_copy(r, row, 4, &ok);
    j->priority = (int)cell_integer(r, row, 6);
    ok = cell_write(j->refines, sizeof j->refines, r, row, 5) && ok;
    ok = cell_write(j->client, sizeof j->client, r, row, 7) && ok;
    memcpy(k->lease.job, j->id, sizeof k->lease.job);
    k->lease.token = (uint64_t)cell_integer(r, row, 8);
    k->lease.held_body = (uint64_t)cell_integer(r, row, 11);
    k->lease.fit = cell_integer(r, row, 12) == 1 ? FIT_HELD : cell_integer(r, row, 12) == 2 ? FIT_OTHERS : FIT_NEW;
    k->since = clock_seconds(CLOCK_MONOTONIC);
    const size_t len = (size_t)PQgetlength(r, row, 9);
    if (!PQgetisnull(r, row, 9) && gnutls_hash_fast(GNUTLS_DIG_SHA256, PQgetvalue(r, row, 9), len, digest) == 0 &&
        PQgetlength(r, row, 10) == sizeof digest && memcmp(digest, PQgetvalue(r, row, 10), sizeof digest) == 0)
        k->body = malloc(len + 1);
    if (k->body) { /* else it is asked for, which also tells what is wrong with it */
        memcpy(k->body, PQgetvalue(r, row, 9), len);
        k->body[len] = '\0';
        k->len = len;
    }
    return ok;
}

static void kept_claim_clear(kept_claim *k)
{
    job_clear(&k->job);
    free(k->body);
    k->body = NULL;
}

static store_status read_claim(link_to *l, const PGresult *r, void *ctx)
{
    claim_args *a = ctx;
    bool ok = true;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    if (PQgetisnull(r, 0, 0)) {
        a->later_s = cell_real(r, 0, 13);
        return STORE_NOT_FOUND;
    }
    for (a->n = 0; ok && (int)a->n < PQntuples(r) && a->n < 1 + CLAIMS_MOST; a->n += ok) {
        kept_claim *k = &a->got[a->n];
        *k = (kept_claim){.lease = *a->asked};
        ok = read_claimed(k, r, (int)a->n);
        if (!ok)
            kept_claim_clear(k);
    }
    if (a->n > 0) /* what can't be read of others is taken back when the lease is over */
        return STORE_OK;
    strcpy(l->message, "a job's row is damaged, or there is no memory for it");
    return STORE_ERROR;
}

/* The oldest of what was claimed ahead, if it is fresh. */
static bool take_ahead(postgresql_store *s, kept_claim *out)
{
    const double after = clock_seconds(CLOCK_MONOTONIC) - s->base.settings.ahead_s;
    pthread_mutex_lock(&s->state_lock);
    const bool any = s->n_ahead > 0 && s->ahead[0].since > after;
    if (any) {
        *out = s->ahead[0];
        memmove(s->ahead, s->ahead + 1, --s->n_ahead * sizeof *s->ahead);
    }
    pthread_mutex_unlock(&s->state_lock);
    return any;
}

void postgresql_put_back(postgresql_store *s, bool all)
{
    const double before = clock_seconds(CLOCK_MONOTONIC) - s->base.settings.ahead_s;
    kept_claim old[CLAIMS_MOST];
    size_t n = 0, left = 0;
    pthread_mutex_lock(&s->state_lock);
    for (size_t i = 0; i < s->n_ahead; i++)
        if (all || s->ahead[i].since <= before)
            old[n++] = s->ahead[i];
        else
            s->ahead[left++] = s->ahead[i];
    s->n_ahead = left;
    pthread_mutex_unlock(&s->state_lock);
    for (size_t i = 0; i < n; i++) {
        call c = {.sql = "SELECT uzawa.unclaim($1, $2)"};
        call_text(&c, old[i].lease.job);
        call_integer(&c, (int64_t)old[i].lease.token);
        /* where it fails the job is taken back when its lease is over */
        if (postgresql_do(s, LINK_DURABLE, true, &c, NULL, NULL) == STORE_OK)
            postgresql_tell(s, old[i].lease.job, TELL_WAITS, NULL, true);
        kept_claim_clear(&old[i]);
    }
}

/* What came beside the first one is for the next claims. */
static store_status claim_from_database(postgresql_store *s, claim_args *a, double lease_s, bool small)
{
    int more = s->base.settings.claims_ahead < CLAIMS_MOST ? s->base.settings.claims_ahead : CLAIMS_MOST;
    call c = {.sql = "SELECT * FROM uzawa.claim_3($1, $2, $3, $4, $5, $6)"};
    pthread_mutex_lock(&s->state_lock);
    more = s->n_ahead > 0 ? 0 : more;
    pthread_mutex_unlock(&s->state_lock);
    call_text(&c, s->node);
    call_text(&c, a->asked->owner);
    call_real(&c, lease_s);
    call_bool(&c, small);
    call_real(&c, s->base.settings.affinity_s);
    call_integer(&c, more);
    const store_status status = postgresql_do(s, LINK_LAZY, true, &c, read_claim, a);
    for (size_t i = 0; status == STORE_OK && i < a->n; i++)
        postgresql_tell(s, a->got[i].job.id, TELL_CHANGED, NULL, false);
    pthread_mutex_lock(&s->state_lock);
    size_t taken = 1;
    for (; taken < a->n && s->n_ahead < CLAIMS_MOST; taken++)
        s->ahead[s->n_ahead++] = a->got[taken];
    pthread_mutex_unlock(&s->state_lock);
    for (; taken < a->n; taken++) /* two claimed at once */
        kept_claim_clear(&a->got[taken]);
    return status;
}

store_status postgresql_claim(store *base, store_lease *lease, double lease_s, bool small, job *out, char **body,
                              size_t *len)
{
    postgresql_store *s = postgresql_of(base);
    claim_args a = {.s = s, .asked = lease};
    lease->seconds = lease_s;
    store_status status = take_ahead(s, &a.got[0]) ? STORE_OK : claim_from_database(s, &a, lease_s, small);
    lease->later_s = a.later_s;
    if (status != STORE_OK)
        return status;
    *out = a.got[0].job;
    *lease = a.got[0].lease;
    *body = a.got[0].body;
    *len = a.got[0].len;
    if (*body)
        return STORE_OK;
    status = postgresql_get_body(base, out->id, body, len);
    if (status == STORE_OK || status == STORE_DAMAGED) /* it is to end, not to stand before all others for ever */
        return STORE_OK;
    /* somebody runs it when the database is back */
    postgresql_use_lease(base, lease, &(lease_use){.what = LEASE_RELEASE});
    return status == STORE_NOT_FOUND ? STORE_ERROR : status;
}

/* ---- while it runs and when it ends */

static store_status read_renewal(link_to *l, const PGresult *r, void *end)
{
    (void)l;
    *(bool *)end = cell_integer(r, 0, 0) != 0;
    return STORE_OK;
}

static int64_t bytes_of(const store_answer *a)
{
    int64_t bytes = 8 * a->history_rows * a->history_columns + (a->summary ? (int64_t)strlen(a->summary) : 0);
    for (size_t i = 0; i < a->n_vectors; i++)
        bytes += 8 * a->vectors[i].count;
    return bytes;
}

static store_status finish(postgresql_store *s, const store_lease *lease, const store_outcome *outcome,
                           double *finished)
{
    change c = {.lease = lease, .outcome = outcome};
    int64_t bytes = bytes_of(&outcome->whole);
    for (size_t i = 0; i < outcome->n_cases; i++)
        bytes += bytes_of(&outcome->cases[i]);
    store_status status;
    placed_result *placed = postgresql_place_result(s, lease->job, outcome, &status);
    c.placed = placed;
    if (status == STORE_OK)
        status = carry_out(s, &c, !placed && bytes > SHARED_MOST);
    postgresql_placed_free(placed);
    *finished = c.finished;
    return status;
}

store_status postgresql_use_lease(store *base, const store_lease *lease, const lease_use *use)
{
    postgresql_store *s = postgresql_of(base);
    call c = {.sql = use->what == LEASE_RENEW ? "SELECT uzawa.renew($1, $2, $3, $4)"
                                              : "SELECT uzawa.release($1, $2, $3, $4)"};
    call_text(&c, lease->job);
    call_text(&c, lease->owner);
    call_integer(&c, (int64_t)lease->token);
    if (use->what == LEASE_RENEW) {
        call_integer(&c, use->progress);
        return postgresql_do(s, LINK_LAZY, true, &c, read_renewal, use->end);
    }
    call_bool(&c, use->counted);
    const store_status status = use->what == LEASE_FINISH ? finish(s, lease, use->outcome, use->finished)
                                                          : postgresql_do(s, LINK_DURABLE, false, &c, NULL, NULL);
    if (status == STORE_OK)
        postgresql_tell(s, lease->job, use->what == LEASE_RELEASE ? TELL_WAITS : TELL_CHANGED, NULL, false);
    return status;
}

/* ---- what becomes of jobs without their owners */

typedef struct {
    postgresql_store *s;
    int64_t requeued, failed, waited;
} taken_back;

/* Rows of uzawa.expire, or of take_back, which has no third column. */
static store_status read_taken(link_to *l, const PGresult *r, void *ctx)
{
    taken_back *t = ctx;
    (void)l;
    for (int i = 0; i < PQntuples(r); i++) {
        const job_status becomes = (job_status)cell_integer(r, i, 1);
        const bool waited = PQnfields(r) > 2 && cell_integer(r, i, 2);
        t->waited += waited;
        t->requeued += becomes == JOB_ACCEPTED;
        t->failed += becomes == JOB_FAILED && !waited;
        postgresql_tell(t->s, PQgetvalue(r, i, 0), becomes == JOB_ACCEPTED ? TELL_WAITS : TELL_CHANGED, NULL, true);
    }
    return STORE_OK;
}

/* The names of nodes of which it is known that their daemons are no more, as an array. */
static store_status read_gone(link_to *l, const PGresult *r, void *ctx)
{
    char **array = ctx;
    size_t len = 0;
    free(*array);
    *array = NULL;
    FILE *out = open_memstream(array, &len);
    bool any = false;
    for (int i = 0; out && i < PQntuples(r); i++) {
        const char *process = PQgetvalue(r, i, 1);
        const bool near = former_is_near(process);
        if (near ? former_is_gone(process) : cell_integer(r, i, 2) != 0) {
            fprintf(out, "%c%s", any ? ',' : '{', PQgetvalue(r, i, 0));
            any = true;
        }
    }
    if (out && any)
        fputc('}', out);
    if (out && fclose(out) == 0)
        return any ? STORE_OK : STORE_NOT_FOUND;
    strcpy(l->message, "no memory for the names of nodes");
    return STORE_ERROR;
}

/* A daemon that was killed leaves its node, and leases that are good for long. The next one on the same machine sees
 * that its process is no more; one that has its name, elsewhere or after a boot, has its place. What belongs to no node
 * is nobody's. */
static store_status forget_gone(postgresql_store *s)
{
    char *array = NULL;
    call look = {.sql = "SELECT n.id, n.process, n.name <> '' AND n.name = me.name AND n.host = me.host"
                        " FROM uzawa.node AS n, uzawa.node AS me WHERE me.id = $1 AND n.id <> me.id"};
    call forget = {.sql = "DELETE FROM uzawa.node WHERE id = ANY($1::text[])"};
    call_text(&look, s->node);
    store_status status = postgresql_do(s, LINK_DURABLE, true, &look, read_gone, &array);
    if (status == STORE_OK) {
        call_text(&forget, array);
        status = postgresql_do(s, LINK_DURABLE, true, &forget, NULL, NULL);
    }
    free(array);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* At the start, and from then on by expire: a daemon that is gone for good leaves its jobs to the others. */
store_status postgresql_recover(store *base, int max_attempts, const char *error_json, int64_t *requeued,
                                int64_t *failed)
{
    postgresql_store *s = postgresql_of(base);
    taken_back t = {.s = s};
    call c = {.sql = "SELECT job, becomes FROM uzawa.take_back($1, $2)"};
    char *copy = strdup(error_json);
    call_integer(&c, max_attempts);
    call_text(&c, error_json);
    pthread_mutex_lock(&s->state_lock);
    free(s->lost_json);
    s->lost_json = copy;
    s->most_attempts = copy ? max_attempts : 0;
    pthread_mutex_unlock(&s->state_lock);
    store_status status = forget_gone(s);
    if (status == STORE_OK)
        status = postgresql_do(s, LINK_DURABLE, true, &c, read_taken, &t);
    *requeued = t.requeued;
    *failed = t.failed;
    return status;
}

store_status postgresql_expire(store *base, const char *error_json, int64_t *count)
{
    postgresql_store *s = postgresql_of(base);
    taken_back t = {.s = s};
    call c = {.sql = "SELECT job, becomes, waited FROM uzawa.expire($1, $2, $3)"};
    postgresql_put_back(s, false);
    pthread_mutex_lock(&s->state_lock);
    char *lost = s->lost_json ? strdup(s->lost_json) : NULL;
    const int most = lost ? s->most_attempts : 0;
    pthread_mutex_unlock(&s->state_lock);
    call_text(&c, error_json);
    call_integer(&c, most);
    call_text(&c, lost);
    const store_status status = postgresql_do(s, LINK_DURABLE, true, &c, read_taken, &t);
    free(lost);
    *count = status == STORE_OK ? t.waited : 0;
    if (status == STORE_OK)
        postgresql_look_if_deaf(s);
    return status;
}

static store_status read_deleted(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    for (int i = 0; i < PQntuples(r); i++)
        postgresql_tell(ctx, PQgetvalue(r, i, 0), TELL_GONE, PQgetvalue(r, i, 1), true);
    return STORE_OK;
}

static store_status count_deleted(link_to *l, const PGresult *r, void *ctx)
{
    void **args = ctx;
    *(int64_t *)args[1] = PQntuples(r);
    return read_deleted(l, r, args[0]);
}

store_status postgresql_retain(store *base, const store_retention *limits, double now, int64_t *count)
{
    void *args[] = {postgresql_of(base), count};
    call c = {.sql = "SELECT job, client FROM uzawa.retain(least($1, uzawa.moment()), $2, $3, $4)"};
    call_real(&c, now);
    call_real(&c, limits->keep_s);
    call_integer(&c, limits->keep_jobs);
    call_integer(&c, limits->keep_bytes);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, true, &c, count_deleted, args);
}

/* ---- dismiss */

typedef struct {
    job_status was;
    char client[STORE_CLIENT];
} dismissal;

static store_status read_dismissal(link_to *l, const PGresult *r, void *ctx)
{
    dismissal *d = ctx;
    (void)l;
    if (PQntuples(r) == 0 || PQgetisnull(r, 0, 0))
        return STORE_NOT_FOUND;
    d->was = (job_status)cell_integer(r, 0, 0);
    cell_write(d->client, sizeof d->client, r, 0, 1);
    return STORE_OK;
}

/* Not carried out twice: the second time would delete what the first has ended. */
store_status postgresql_dismiss(store *base, const char *id, job_status *was)
{
    postgresql_store *s = postgresql_of(base);
    dismissal d = {.was = JOB_ACCEPTED};
    call c = {.sql = "SELECT was, client FROM uzawa.dismiss($1)"};
    call_text(&c, id);
    const store_status status = postgresql_do(s, LINK_DURABLE, false, &c, read_dismissal, &d);
    *was = d.was;
    if (status == STORE_OK) /* of a running one the caller tells the worker, if it is here */
        postgresql_tell(s, id, d.was > JOB_RUNNING ? TELL_GONE : TELL_CHANGED, d.client, d.was != JOB_RUNNING);
    return status;
}
