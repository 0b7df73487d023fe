/* move.c: jobs, uploads and owners of another store as rows of this one. */
#include "store/move.h"
#include "store/postgresql/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- reading */

static store_status read_moved(link_to *l, const PGresult *r, void *ctx)
{
    moved_job *out = ctx;
    bool ok = true;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    moved_job_clear(out);
    store_status status = postgresql_read_job(l, r, 0, &out->job);
    out->finished = cell_real(r, 0, 6);
    out->key = cell_copy(r, 0, 14, &ok);
    out->queue_until = cell_real(r, 0, 15);
    out->share = cell_copy(r, 0, 16, &ok);
    out->small = cell_integer(r, 0, 17) != 0;
    out->bytes = cell_integer(r, 0, 18);
    out->contents = cell_copy(r, 0, 19, &ok);
    out->uploads = cell_copy(r, 0, 20, &ok);
    out->url = cell_copy(r, 0, 21, &ok);
    out->webhook_state = cell_integer(r, 0, 22);
    out->webhook_attempts = cell_integer(r, 0, 23);
    out->webhook_next = cell_real(r, 0, 24);
    if (status == STORE_OK && !ok) {
        strcpy(l->message, "no memory for a job");
        status = STORE_ERROR;
    }
    return status;
}

static store_status read_blobs(link_to *l, const PGresult *r, void *ctx)
{
    moved_job *out = ctx;
    const size_t n = (size_t)PQntuples(r);
    free(out->blobs);
    out->n_blobs = 0;
    out->blobs = n > 0 ? calloc(n, sizeof *out->blobs) : NULL;
    if (n > 0 && !out->blobs) {
        strcpy(l->message, "no memory for a job");
        return STORE_ERROR;
    }
    for (; out->n_blobs < n; out->n_blobs++) {
        moved_blob *one = &out->blobs[out->n_blobs];
        one->number = cell_integer(r, (int)out->n_blobs, 0);
        if (!cell_write(one->name, sizeof one->name, r, (int)out->n_blobs, 1))
            return STORE_DAMAGED;
    }
    return STORE_OK;
}

static store_status read_job(store *base, const char *id, moved_job *out)
{
    call c = {.sql = "SELECT " JOB_COLUMNS ", job.key, job.queue_until, job.share, job.small, job.bytes, job.contents,"
                     " (SELECT string_agg(upload || E'\\n', '' ORDER BY upload) FROM uzawa.upload_use"
                     " WHERE upload_use.job = job.id), webhook.url, webhook.state, webhook.attempts, webhook.next"
                     " FROM uzawa.job LEFT JOIN uzawa.webhook ON webhook.job = job.id WHERE job.id = $1"};
    call names = {.sql = "SELECT number, CASE name WHEN '/' THEN '' ELSE name END FROM"
                         " (SELECT number, name FROM uzawa.pieces WHERE job = $1 UNION SELECT number, name"
                         " FROM uzawa.placed WHERE job = $1) AS each ORDER BY 1, 2"};
    call_text(&c, id);
    call_text(&names, id);
    const store_status status = postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_moved, out);
    return status == STORE_OK ? postgresql_do(postgresql_of(base), LINK_READ, true, &names, read_blobs, out) : status;
}

static store_status read_upload_row(link_to *l, const PGresult *r, void *ctx)
{
    moved_upload *out = ctx;
    bool ok = true;
    (void)l;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    free(out->clients);
    ok = cell_write(out->info.id, sizeof out->info.id, r, 0, 0);
    out->info.bytes = cell_integer(r, 0, 1);
    out->info.created = cell_real(r, 0, 2);
    out->info.used = cell_real(r, 0, 3);
    out->clients = cell_copy(r, 0, 4, &ok);
    return ok ? STORE_OK : STORE_ERROR;
}

static store_status read_upload(store *base, const char *from, moved_upload *out)
{
    call c = {.sql =
                  "SELECT id, bytes, created, used, coalesce((SELECT string_agg(client || E'\\n', '' ORDER BY client)"
                  " FROM uzawa.upload_client WHERE upload = id), '') FROM uzawa.upload WHERE id >= $1 ORDER BY id"
                  " LIMIT 1"};
    call_text(&c, from);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_upload_row, out);
}

static store_status read_client_row(link_to *l, const PGresult *r, void *ctx)
{
    moved_client *out = ctx;
    (void)l;
    if (PQntuples(r) == 0 || !cell_write(out->name, sizeof out->name, r, 0, 0))
        return STORE_NOT_FOUND;
    out->day = cell_integer(r, 0, 1);
    out->seconds = cell_real(r, 0, 2);
    return STORE_OK;
}

static store_status read_client(store *base, const char *from, moved_client *out)
{
    call c = {.sql = "SELECT name, day, seconds FROM uzawa.client WHERE name >= $1 ORDER BY name LIMIT 1"};
    call_text(&c, from);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_client_row, out);
}

/* ---- writing */

static void send_job(link_to *l, const moved_job *m, int64_t token)
{
    call c = {.sql = "INSERT INTO uzawa.job(id, status, progress, attempts, created, started, finished, token, tags,"
                     " summary, error, key, refines, priority, queue_until, bytes, client, share, small, contents,"
                     " summary_sum, contents_sum) VALUES ($1::text, $2::smallint, $3, $4, $5, $6, $7, $8, $9,"
                     " $10::text, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20::text,"
                     " uzawa.sum_of(uzawa.keys_of($1::text, ($2::smallint)::text), $10::text),"
                     " uzawa.sum_of($1::text, $20::text))"};
    call_text(&c, m->job.id);
    call_integer(&c, m->job.status);
    call_integer(&c, m->job.progress);
    call_integer(&c, m->job.attempts);
    call_real(&c, m->job.created);
    call_real(&c, m->job.started);
    call_real(&c, m->finished);
    call_integer(&c, token);
    call_text(&c, m->job.tags);
    call_text(&c, m->job.summary);
    call_text(&c, m->job.error);
    call_text(&c, m->key);
    call_text(&c, m->job.refines[0] ? m->job.refines : NULL);
    call_integer(&c, m->job.priority);
    call_real(&c, m->queue_until);
    call_integer(&c, m->bytes);
    call_text(&c, m->job.client);
    call_text(&c, m->share);
    call_bool(&c, m->small);
    call_text(&c, m->contents);
    link_send(l, &c);
}

static void send_beside(link_to *l, const moved_job *m, const char *body, size_t len)
{
    call request = {.sql = "INSERT INTO uzawa.request(job, body, digest) VALUES ($1, $2::bytea, sha256($2::bytea))"};
    call tags = {.sql = "INSERT INTO uzawa.tag(tag, job) SELECT DISTINCT value #>> '{}', $1 FROM"
                        " jsonb_array_elements($2::jsonb) AS value WHERE jsonb_typeof(value) = 'string'"};
    call uploads = {.sql = "INSERT INTO uzawa.upload_use(upload, job) SELECT each, $1 FROM"
                           " regexp_split_to_table($2, E'\\n') AS each WHERE each <> ''"};
    call webhook = {.sql = "INSERT INTO uzawa.webhook(job, url, state, attempts, next) VALUES ($1, $2, $3, $4, $5)"};
    call_text(&request, m->job.id);
    call_bytes(&request, body, len);
    link_send(l, &request);
    call_text(&tags, m->job.id);
    call_text(&tags, m->job.tags);
    link_send(l, &tags);
    call_text(&uploads, m->job.id);
    call_text(&uploads, m->uploads);
    if (m->uploads)
        link_send(l, &uploads);
    call_text(&webhook, m->job.id);
    call_text(&webhook, m->url);
    call_integer(&webhook, m->webhook_state);
    call_integer(&webhook, m->webhook_attempts);
    call_real(&webhook, m->webhook_next);
    if (m->url)
        link_send(l, &webhook);
}

static void send_cases(link_to *l, const char *id, int64_t token, const store_case *cases, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        call c = {.sql = "INSERT INTO uzawa.answer(job, token, number, name, summary, sum) VALUES ($1::text,"
                         " $2::bigint, $3::bigint, $4::text, $5::text,"
                         " uzawa.sum_of(concat_ws(E'\\x1f', $1::text, $3::bigint, $4::text), $5::text))"};
        call_text(&c, id);
        call_integer(&c, token);
        call_integer(&c, cases[i].number);
        call_text(&c, cases[i].name);
        call_text(&c, cases[i].summary);
        link_send(l, &c);
    }
}

typedef struct {
    result_place *place;
    const result_key *key;
    store_status status;
} passing_on;

static bool pass_on(void *ctx, const result_piece *piece)
{
    passing_on *p = ctx;
    p->status = piece->good ? POSTGRESQL_RESULTS.put(p->place, p->key, piece) : STORE_DAMAGED;
    return p->status == STORE_OK;
}

static store_status send_blobs(link_to *l, store *from, const moved_job *m, int64_t token)
{
    result_place place = {.link = l, .job = m->job.id, .token = (uint64_t)token};
    store_status status = STORE_OK;
    for (size_t i = 0; i < m->n_blobs && status == STORE_OK; i++) {
        const result_key key = {m->job.id, m->blobs[i].number, m->blobs[i].name[0] ? m->blobs[i].name : NULL};
        passing_on p = {&place, &key, STORE_OK};
        status = from->engine->results->get(from, &key, -1, pass_on, &p);
        status = status == STORE_OK ? p.status : status;
    }
    if (status == STORE_OK)
        status = postgresql_send_pieces(&place);
    free(place.bytes);
    return status;
}

typedef struct {
    int64_t token;
    bool there;
} place_of_job;

static store_status read_place(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    *(place_of_job *)ctx = (place_of_job){cell_integer(r, 0, 0), cell_integer(r, 0, 1) != 0};
    return STORE_OK;
}

static store_status put_job(store *base, store *from, const moved_job *m)
{
    postgresql_store *s = postgresql_of(base);
    place_of_job place = {.token = 0};
    char *body = NULL;
    size_t len = 0, n_cases = 0;
    store_case *cases = NULL;
    call look = {.sql = "SELECT nextval('uzawa.token'), EXISTS (SELECT 1 FROM uzawa.job WHERE id = $1)"};
    call_text(&look, m->job.id);
    store_status status = postgresql_do(s, LINK_DURABLE, true, &look, read_place, &place);
    if (status == STORE_OK && place.there)
        return STORE_CONFLICT;
    if (status == STORE_OK)
        status = store_get_body(from, m->job.id, &body, &len);
    if (status == STORE_OK)
        status = store_get_cases(from, m->job.id, NULL, &cases, &n_cases);
    if (status == STORE_OK) {
        link_to *l = postgresql_take(s);
        link_begin(l, LINK_DURABLE);
        send_job(l, m, place.token);
        send_beside(l, m, body, len);
        send_cases(l, m->job.id, place.token, cases, n_cases);
        status = send_blobs(l, from, m, place.token);
        if (status == STORE_OK)
            status = link_end(l);
        else if (l->status == STORE_OK)
            snprintf(l->message, sizeof l->message, "its result can't be read");
        l->lost = l->lost || status != STORE_OK; /* what was sent is taken back with the connection */
        postgresql_give(s, l, status == STORE_CONFLICT || status == STORE_NOT_FOUND ? STORE_ERROR : status);
    }
    free(body);
    store_cases_free(cases, n_cases);
    return status == STORE_CONFLICT ? STORE_ERROR : status;
}

static store_status put_upload(store *base, const moved_upload *u)
{
    call c = {.sql =
                  "WITH dated AS (UPDATE uzawa.upload SET created = $2, used = $3"
                  " WHERE id = $1 RETURNING id) INSERT INTO uzawa.upload_client(upload, client) SELECT dated.id, each"
                  " FROM dated, regexp_split_to_table($4, E'\\n') WITH ORDINALITY AS list(each, n)"
                  " WHERE n <= (length($4) - length(replace($4, E'\\n', ''))) ON CONFLICT DO NOTHING"};
    call_text(&c, u->info.id);
    call_real(&c, u->info.created);
    call_real(&c, u->info.used);
    call_text(&c, u->clients);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, true, &c, NULL, NULL);
}

static store_status put_client(store *base, const moved_client *m)
{
    call c = {.sql = "INSERT INTO uzawa.client(name, day, seconds) VALUES ($1, $2, $3) ON CONFLICT (name) DO UPDATE SET"
                     " day = greatest(client.day, excluded.day), seconds = CASE WHEN client.day > excluded.day THEN"
                     " client.seconds WHEN client.day < excluded.day THEN excluded.seconds"
                     " ELSE greatest(client.seconds, excluded.seconds) END"};
    call_text(&c, m->name);
    call_integer(&c, m->day);
    call_real(&c, m->seconds);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, true, &c, NULL, NULL);
}

const store_moves POSTGRESQL_MOVES = {.read_job = read_job,
                                      .read_upload = read_upload,
                                      .read_client = read_client,
                                      .put_job = put_job,
                                      .put_upload = put_upload,
                                      .put_client = put_client};
