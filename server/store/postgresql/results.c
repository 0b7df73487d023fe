/* results.c: the blobs of results in rows, in the transaction that ends the job: the pieces of several, as many as a
 * call holds, are one row with their bytes; those in an object store a row each, with the place where they are. Bytes
 * of a vector that another job has too are kept once (uzawa.common). */
#include "store/postgresql/objects.h"

#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bytes of a vector's piece that are looked for among those of other jobs. Two of 5.4 KB
 * each cost a small job 5 to 15 % of its processor time, though the database had them. */
#define COMMON_LEAST 16384

#define HISTORY "/" /* no vector has this name (result_blobs.h) */

/* The lines of uzawa.bundle's list. */
static void print_list(FILE *out, const result_place *place)
{
    enum { NAMES = 1, LAST = 5, DIGESTS = 8, LISTS };
    bool any = false;
    for (size_t i = 0; i < place->n; i++)
        any = any || place->kept[i].digest[0];
    for (int k = 0; k < LISTS - !any; k++) {
        int64_t at = 0;
        for (size_t i = 0; i < place->n; i++) {
            const kept_piece *p = &place->kept[i];
            const int64_t integers[LISTS] = {p->number, 0, p->part, p->encoding, p->header, 0, p->size, at, 0};
            fputc(i > 0 ? ',' : '{', out);
            if (k == NAMES || k == DIGESTS) /* names are words of the solver's */
                fprintf(out, "\"%s\"", k == NAMES ? p->name : p->digest);
            else if (k == LAST)
                fprintf(out, "%.17g", p->last);
            else
                fprintf(out, "%lld", (long long)integers[k]);
            at += p->digest[0] ? 0 : p->size;
        }
        fputs(k + 1 < LISTS - !any ? "}\n" : "}", out);
    }
}

store_status postgresql_send_pieces(result_place *place)
{
    char *list = NULL;
    size_t len = 0;
    /* An end that is sent again finds its own. */
    call c = {.sql = "INSERT INTO uzawa.bundle(job, token, n, list, data, sum) VALUES ($1::text, $2, $3::integer,"
                     " $4::text, $5::bytea, uzawa.bundle_sum($1::text, $3::integer, $4::text, $5::bytea))"
                     " ON CONFLICT DO NOTHING"};
    if (place->n == 0 || place->link->status != STORE_OK)
        return place->link->status;
    FILE *out = open_memstream(&list, &len);
    if (out)
        print_list(out, place);
    if (out && fclose(out) == 0) {
        call_text(&c, place->job);
        call_integer(&c, (int64_t)place->token);
        call_integer(&c, place->bundles++);
        call_text(&c, list);
        call_bytes(&c, place->bytes, place->len);
        link_send(place->link, &c);
    } else {
        place->link->status = STORE_ERROR;
        strcpy(place->link->message, "no memory for a result");
    }
    free(list);
    place->n = place->len = 0;
    return place->link->status;
}

static store_status give_up(result_place *place, const char *cause)
{
    place->link->status = STORE_ERROR;
    strcpy(place->link->message, cause);
    return STORE_ERROR;
}

/* One that all jobs which have it share, by its digest; whether the database has it shows there. */
static store_status send_common(result_place *place, const result_piece *piece, char hex[65])
{
    unsigned char digest[32];
    call c = {.sql = "SELECT uzawa.use_common($1, $2, $3, $4)"};
    if (gnutls_hash_fast(GNUTLS_DIG_SHA256, piece->data, (size_t)piece->size, digest) != 0)
        return give_up(place, "the digest of a result failed");
    for (size_t i = 0; i < sizeof digest; i++)
        sprintf(hex + 2 * i, "%02x", digest[i]);
    call_bytes(&c, digest, sizeof digest);
    call_bytes(&c, piece->data, (size_t)piece->size);
    call_text(&c, place->job);
    call_integer(&c, (int64_t)place->token);
    link_send(place->link, &c);
    return place->link->status;
}

/* Kept until there is a call's worth of them. Failures of the database show at the end of the transaction. */
static store_status put(void *transaction, const result_key *key, const result_piece *piece)
{
    result_place *place = transaction;
    const bool common = key->name && piece->size >= COMMON_LEAST;
    const size_t own = common ? 0 : (size_t)piece->size; /* bytes */
    if (place->n == PIECES_AT_ONCE || place->len + own > PLACE_ROOM) {
        const store_status status = postgresql_send_pieces(place);
        if (status != STORE_OK)
            return status;
    }
    if (!place->bytes)
        place->bytes = malloc(PLACE_ROOM);
    if (!place->bytes)
        return give_up(place, "no memory for a result");
    kept_piece *p = &place->kept[place->n++];
    *p = (kept_piece){.number = key->number,
                      .part = piece->part,
                      .encoding = piece->encoding,
                      .header = piece->header,
                      .size = piece->size,
                      .last = piece->last};
    snprintf(p->name, sizeof p->name, "%s", key->name ? key->name : HISTORY);
    if (own > 0)
        memcpy(place->bytes + place->len, piece->data, own);
    place->len += own;
    return common ? send_common(place, piece, p->digest) : STORE_OK;
}

typedef struct {
    bool (*take)(void *ctx, const result_piece *piece);
    void *ctx;
    bool any, full; /* full: there was no memory */
    placed_row *placed;
    size_t n_placed, room;
} taker;

/* Its bytes are got when all rows are there: meanwhile nobody else needs the connection. */
static bool keep_placed(taker *t, const result_piece *piece, const PGresult *r)
{
    if (t->n_placed == t->room) {
        const size_t room = t->room ? 2 * t->room : 16;
        placed_row *grown = realloc(t->placed, room * sizeof *grown);
        if (!grown) {
            t->full = true;
            return false;
        }
        t->placed = grown;
        t->room = room;
    }
    placed_row *row = &t->placed[t->n_placed++];
    *row = (placed_row){.piece = *piece, .at = cell_integer(r, 0, 7)};
    row->piece.size = cell_integer(r, 0, 8);
    row->piece.good = piece->good && cell_write(row->object, sizeof row->object, r, 0, 6) &&
                      PQgetlength(r, 0, 4) == sizeof row->digest;
    if (row->piece.good)
        memcpy(row->digest, PQgetvalue(r, 0, 4), sizeof row->digest);
    return true;
}

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
    return PQgetisnull(r, 0, 6) ? t->take(t->ctx, &piece) : keep_placed(t, &piece, r);
}

/* Not tried again where the connection is lost: `take` has had some of it. */
static store_status get(store *base, const result_key *key, int64_t after,
                        bool (*take)(void *ctx, const result_piece *piece), void *ctx)
{
    postgresql_store *s = postgresql_of(base);
    taker t = {take, ctx, .any = false};
    call c = {.sql = "SELECT part, encoding, header, last, CASE WHEN name <> '" HISTORY "' OR last > $4::float8"
                     " THEN data ELSE '' END, good, NULL, NULL::bigint, NULL::bigint"
                     " FROM uzawa.pieces WHERE job = $1 AND number = $2::bigint AND name = $3"
                     " UNION ALL SELECT part, encoding, header, last, digest,"
                     " sum = uzawa.sum_of(uzawa.placed_keys(placed), digest), object, at, size"
                     " FROM uzawa.placed WHERE job = $1 AND number = $2::bigint AND name = $3 ORDER BY part"};
    call_text(&c, key->job);
    call_integer(&c, key->number);
    call_text(&c, key->name ? key->name : HISTORY);
    call_real(&c, (double)after);
    link_to *l = postgresql_take(s);
    store_status status = link_stream(l, &c, take_row, &t);
    if (status == STORE_OK && !t.any)
        status = STORE_NOT_FOUND;
    if (t.full) {
        status = STORE_ERROR;
        strcpy(l->message, "no memory for a result");
    }
    status = postgresql_give(s, l, status);
    if (status == STORE_OK && t.n_placed > 0)
        status = postgresql_get_placed(s, t.placed, t.n_placed, after, !key->name, take, ctx);
    free(t.placed);
    return status;
}

static store_status read_total(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    *(int64_t *)ctx = cell_integer(r, 0, 0);
    return STORE_OK;
}

static store_status count(store *base, const char *id, const char *name, int64_t *total)
{
    call c = {.sql = "SELECT coalesce(sum(header), 0)::bigint FROM"
                     " (SELECT header FROM uzawa.pieces WHERE job = $1 AND name = $2 AND part = 0"
                     " UNION ALL SELECT header FROM uzawa.placed WHERE job = $1 AND name = $2 AND part = 0) AS each"};
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
