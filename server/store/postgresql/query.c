/* query.c: what only reads. */
#include "store/postgresql/objects.h"

#include <gnutls/crypto.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

store_status postgresql_read_job(link_to *l, const PGresult *r, int row, job *out)
{
    bool ok = true;
    job_clear(out);
    ok = cell_write(out->id, sizeof out->id, r, row, 0);
    out->status = (job_status)cell_integer(r, row, 1);
    out->progress = (int)cell_integer(r, row, 2);
    out->attempts = (int)cell_integer(r, row, 3);
    out->created = cell_real(r, row, 4);
    out->started = cell_real(r, row, 5);
    out->finished = out->status == JOB_RUNNING ? 0.0 : cell_real(r, row, 6);
    out->tags = cell_copy(r, row, 7, &ok);
    out->summary = cell_copy(r, row, 8, &ok);
    out->error = cell_copy(r, row, 9, &ok);
    out->priority = (int)cell_integer(r, row, 11);
    ok = ok && out->tags && cell_write(out->refines, sizeof out->refines, r, row, 10) &&
         cell_write(out->client, sizeof out->client, r, row, 12);
    out->damaged = ok && !cell_integer(r, row, 13);
    if (out->damaged) {
        free(out->summary);
        out->summary = NULL;
    }
    if (ok)
        return STORE_OK;
    job_clear(out);
    strcpy(l->message, "a job's row is damaged, or there is no memory for it");
    return STORE_ERROR;
}

static store_status read_one(link_to *l, const PGresult *r, void *out)
{
    return PQntuples(r) > 0 ? postgresql_read_job(l, r, 0, out) : STORE_NOT_FOUND;
}

store_status postgresql_get(store *base, const char *id, job *out)
{
    call c = {.sql = "SELECT " JOB_COLUMNS " FROM uzawa.job WHERE id = $1"};
    call_text(&c, id);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_one, out);
}

/* ---- lists */

/* What an argument that is NULL asks for falls away before the statement is planned. $10: ids begin with the
 * milliseconds of their creation. */
#define LIST(than, order)                                                                                              \
    "SELECT " JOB_COLUMNS " FROM uzawa.job WHERE job.id " than " $1 AND ($3::int IS NULL OR job.status = $3::int)"     \
    " AND ($4::text IS NULL OR job.id IN (SELECT job FROM uzawa.tag WHERE tag = $4))"                                  \
    " AND ($5::text IS NULL OR job.id IN (SELECT job FROM uzawa.tag WHERE tag = $5))"                                  \
    " AND ($6::text IS NULL OR job.id IN (SELECT job FROM uzawa.tag WHERE tag = $6))"                                  \
    " AND ($7::text IS NULL OR job.id IN (SELECT job FROM uzawa.tag WHERE tag = $7))"                                  \
    " AND job.created >= $8::float8 AND job.created < $9::float8 AND job.id >= $10"                                    \
    " AND ($11::text IS NULL OR job.client = $11) ORDER BY job.id " order " LIMIT $2::bigint"

typedef struct {
    job *jobs;
    size_t most, *count;
} list_args;

static store_status read_list(link_to *l, const PGresult *r, void *ctx)
{
    list_args *a = ctx;
    store_status status = STORE_OK;
    for (*a->count = 0; status == STORE_OK && *a->count < a->most && (int)*a->count < PQntuples(r);) {
        status = postgresql_read_job(l, r, (int)*a->count, &a->jobs[*a->count]);
        *a->count += status == STORE_OK;
    }
    return status;
}

store_status postgresql_list(store *base, const store_query *q, job *jobs, size_t *count)
{
    list_args a = {jobs, (size_t)q->limit + 1, count};
    char least[16];
    const double ms = (q->since - 1.0) * 1e3;
    call c = {.sql = q->ascending ? LIST(">", "ASC") : LIST("<", "DESC"), .once = true};
    snprintf(least, sizeof least, "%012llx", ms > 0.0 ? (unsigned long long)fmin(ms, 281474976710655.0) : 0ULL);
    call_text(&c, q->before ? q->before : q->ascending ? "" : "~"); /* after every hex digit */
    call_integer(&c, q->limit + 1);
    if (q->by_status)
        call_integer(&c, q->status);
    else
        call_text(&c, NULL);
    call_text(&c, q->tag);
    for (int i = 0; i < STORE_MORE_TAGS; i++)
        call_text(&c, q->more[i]);
    call_real(&c, q->since);
    call_real(&c, q->until > 0.0 ? q->until : 1e18);
    call_text(&c, least);
    call_text(&c, q->client);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_list, &a);
}
_Static_assert(STORE_MORE_TAGS == 3, "LIST has as many");

/* ---- the request */

typedef struct {
    char *body, *objects; /* objects: the names of those that have it */
    size_t len;
    unsigned char digest[32];
} body_args;

static void body_clear(body_args *a)
{
    free(a->body);
    free(a->objects);
    a->body = a->objects = NULL;
}

static store_status read_body(link_to *l, const PGresult *r, void *ctx)
{
    body_args *a = ctx;
    bool ok = true;
    body_clear(a);
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    const bool placed = !PQgetisnull(r, 0, 2);
    a->len = placed ? (size_t)cell_integer(r, 0, 3) : (size_t)PQgetlength(r, 0, 0);
    if (PQgetlength(r, 0, 1) != sizeof a->digest)
        return STORE_DAMAGED;
    memcpy(a->digest, PQgetvalue(r, 0, 1), sizeof a->digest);
    a->body = malloc(a->len + 1);
    a->objects = placed ? cell_copy(r, 0, 2, &ok) : NULL;
    if (!a->body || !ok) {
        strcpy(l->message, "no memory for the request of a job");
        return STORE_ERROR;
    }
    if (!placed)
        memcpy(a->body, PQgetvalue(r, 0, 0), a->len);
    return STORE_OK;
}

store_status postgresql_get_body(store *base, const char *id, char **body, size_t *len)
{
    body_args a = {.len = 0};
    unsigned char digest[32];
    char cause[96];
    call c = {.sql = "SELECT body, digest, NULL, NULL::bigint FROM uzawa.request WHERE job = $1 UNION ALL"
                     " SELECT NULL, digest, objects::text, size FROM uzawa.request_placed WHERE job = $1"};
    call_text(&c, id);
    store_status status = postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_body, &a);
    if (status == STORE_OK && a.objects)
        status = postgresql_get_request(postgresql_of(base), a.objects, a.body, a.len);
    if (status == STORE_OK && (gnutls_hash_fast(GNUTLS_DIG_SHA256, a.body, a.len, digest) != 0 ||
                               memcmp(digest, a.digest, sizeof digest) != 0))
        status = STORE_DAMAGED;
    if (status == STORE_DAMAGED) {
        snprintf(cause, sizeof cause, "the request of job %.32s is not what was written", id);
        store_set_message(base, cause);
    }
    if (status != STORE_OK) {
        body_clear(&a);
        a.len = 0;
    }
    if (a.body)
        a.body[a.len] = '\0';
    free(a.objects);
    *body = a.body;
    *len = a.len;
    return status;
}

/* ---- cases */

typedef struct {
    const char *id;
    store_case **cases;
    size_t *count;
} cases_args;

static store_status read_cases(link_to *l, const PGresult *r, void *ctx)
{
    cases_args *a = ctx;
    const int n = PQntuples(r);
    bool ok = true, good = true;
    store_cases_free(*a->cases, *a->count);
    *a->count = 0;
    *a->cases = n > 0 ? calloc((size_t)n, sizeof **a->cases) : NULL;
    for (int i = 0; i < n && *a->cases && ok && good; i++) {
        store_case *one = &(*a->cases)[(*a->count)++];
        one->number = cell_integer(r, i, 0);
        one->name = cell_copy(r, i, 1, &ok);
        one->summary = cell_copy(r, i, 2, &ok);
        good = cell_integer(r, i, 3) != 0;
    }
    if (!good)
        snprintf(l->message, sizeof l->message, "a summary of job %.32s is not what was written", a->id);
    else if (!ok || (n > 0 && !*a->cases))
        strcpy(l->message, "no memory for the cases of a job");
    return !good ? STORE_DAMAGED : ok && (n == 0 || *a->cases) ? STORE_OK : STORE_ERROR;
}

store_status postgresql_get_cases(store *base, const char *id, const char *name, store_case **cases, size_t *count)
{
    cases_args a = {id, cases, count};
    call c = {.sql = "SELECT number, name, summary, sum = uzawa.sum_of(concat_ws(E'\\x1f', job, number, name), summary)"
                     " FROM uzawa.answer WHERE job = $1 AND ($2::text IS NULL OR name = $2) ORDER BY number"};
    call_text(&c, id);
    call_text(&c, name);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_cases, &a);
}

/* ---- counts */

static store_status read_counts(link_to *l, const PGresult *r, void *ctx)
{
    int64_t *counts = ctx;
    (void)l;
    for (int i = 0; i < PQntuples(r); i++) {
        const int64_t status = cell_integer(r, i, 0);
        if (status >= 0 && status < STORE_COUNTS)
            counts[status] = cell_integer(r, i, 1);
    }
    return STORE_OK;
}

store_status postgresql_counts(store *base, int64_t counts[STORE_COUNTS])
{
    const call c = {.sql = "SELECT status, jobs FROM uzawa.counted UNION ALL SELECT 5, count(DISTINCT name) FROM"
                           " (SELECT name FROM (SELECT name, waiting FROM uzawa.share WHERE waiting > 0 UNION ALL"
                           " SELECT share, (coalesce(becomes, 9) = 0)::int - (coalesce(was, 9) = 0)::int"
                           " FROM uzawa.ledger) AS late GROUP BY name HAVING sum(waiting) > 0) AS shares"};
    return postgresql_do(postgresql_of(base), LINK_GLANCE, true, &c, read_counts, counts);
}
