/* results.c: the blobs of results as rows: each piece of one is a row, in the transaction that ends the job. */
#include "store/postgresql/internal.h"

#include <stdio.h>
#include <string.h>

#define HISTORY "/" /* no vector has this name (result_blobs.h) */

/* Failures show at the end of the transaction. */
static store_status put(void *transaction, const result_key *key, const result_piece *piece)
{
    const result_place *place = transaction;
    call c = {.sql = "INSERT INTO uzawa.piece(job, token, number, name, part, encoding, header, last, data, sum)"
                     " SELECT $1::text, $2::bigint, $3::bigint, $4::text, $5::bigint, $6::bigint, $7::bigint,"
                     " $8::float8, $9::bytea, uzawa.sum_of(uzawa.piece_keys(ROW($1::text, $2::bigint, $3::bigint,"
                     " $4::text, $5::bigint, $6::bigint, $7::bigint, $8::float8, NULL, NULL)::uzawa.piece),"
                     " $9::bytea)"};
    call_text(&c, key->job);
    call_integer(&c, (int64_t)place->token);
    call_integer(&c, key->number);
    call_text(&c, key->name ? key->name : HISTORY);
    call_integer(&c, piece->part);
    call_integer(&c, piece->encoding);
    call_integer(&c, piece->header);
    call_real(&c, piece->last);
    call_bytes(&c, piece->data, (size_t)piece->size);
    link_send(place->link, &c);
    return place->link->status;
}

typedef struct {
    bool (*take)(void *ctx, const result_piece *piece);
    void *ctx;
    bool any;
} taker;

static bool take_row(void *ctx, const PGresult *r)
{
    taker *t = ctx;
    const result_piece piece = {.part = cell_integer(r, 0, 0),
                                .encoding = cell_integer(r, 0, 1),
                                .header = cell_integer(r, 0, 2),
                                .last = cell_real(r, 0, 3),
                                .data = PQgetvalue(r, 0, 4),
                                .size = PQgetlength(r, 0, 4),
                                .good = cell_integer(r, 0, 5) != 0};
    t->any = true;
    return t->take(t->ctx, &piece);
}

/* Not tried again where the connection is lost: `take` has had some of it. */
static store_status get(store *base, const result_key *key, int64_t after,
                        bool (*take)(void *ctx, const result_piece *piece), void *ctx)
{
    postgresql_store *s = postgresql_of(base);
    taker t = {take, ctx, false};
    call c = {.sql = "SELECT part, encoding, header, last, CASE WHEN name <> '" HISTORY "' OR last > $4::float8"
                     " THEN data ELSE '' END, sum = uzawa.sum_of(uzawa.piece_keys(piece), data)"
                     " FROM uzawa.piece WHERE job = $1 AND number = $2::bigint AND name = $3 ORDER BY part"};
    call_text(&c, key->job);
    call_integer(&c, key->number);
    call_text(&c, key->name ? key->name : HISTORY);
    call_real(&c, (double)after);
    link_to *l = postgresql_take(s);
    store_status status = link_stream(l, &c, take_row, &t);
    if (status == STORE_OK && !t.any)
        status = STORE_NOT_FOUND;
    return postgresql_give(s, l, status);
}

static store_status read_total(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    *(int64_t *)ctx = cell_integer(r, 0, 0);
    return STORE_OK;
}

static store_status count(store *base, const char *id, const char *name, int64_t *total)
{
    call c = {.sql = "SELECT coalesce(sum(header), 0)::bigint FROM uzawa.piece WHERE job = $1 AND name = $2"
                     " AND part = 0"};
    call_text(&c, id);
    call_text(&c, name);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_total, total);
}

typedef struct {
    const char *id;
    char **list;
} contents_args;

static store_status read_contents(link_to *l, const PGresult *r, void *ctx)
{
    contents_args *a = ctx;
    bool ok = true;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    const bool good = cell_integer(r, 0, 1) != 0;
    *a->list = good ? cell_copy(r, 0, 0, &ok) : NULL;
    if (!good || !ok)
        snprintf(l->message, sizeof l->message, "the list of the result of job %.32s can't be read", a->id);
    return !good ? STORE_DAMAGED : ok ? STORE_OK : STORE_ERROR;
}

static store_status contents(store *base, const char *id, char **list)
{
    contents_args a = {id, list};
    call c = {.sql = "SELECT contents, contents IS NULL OR contents_sum = uzawa.sum_of(id, contents) FROM uzawa.job"
                     " WHERE id = $1"};
    *list = NULL;
    call_text(&c, id);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_contents, &a);
}

const result_blobs POSTGRESQL_RESULTS = {.put = put, .get = get, .count = count, .contents = contents};
