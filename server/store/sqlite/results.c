/* results.c: the blobs of results as rows of the database: each piece of one is a row, in the transaction that ends the
 * job. Bytes of a vector that another job has too (the nodes of its mesh; all of it, where a job is run again) are kept
 * once. docs/architecture/store.md says why not as files. */
#include "store/sqlite/checksum.h"
#include "store/sqlite/internal.h"

#include <gnutls/crypto.h>
#include <stdio.h>

/* Bytes of a vector's piece that are looked for among those of other jobs: about a page, of which the search is small.
 */
#define SHARED_LEAST 4096

static store_status put(void *transaction, const result_key *key, const result_piece *piece)
{
    unsigned char digest[SHA256_BYTES];
    const bool shared = key->name && piece->size >= SHARED_LEAST;
    if (shared) {
        if (gnutls_hash_fast(GNUTLS_DIG_SHA256, piece->data, (size_t)piece->size, digest) != 0)
            return STORE_ERROR;
        statement st = statement_begin(transaction, QUERY_INSERT_PIECE);
        bind_blob(&st, 1, digest, sizeof digest);
        bind_blob(&st, 2, piece->data, (size_t)piece->size);
        const store_status status = statement_run(&st);
        if (status != STORE_OK)
            return status;
    }
    statement st = statement_begin(transaction, key->name ? QUERY_INSERT_VECTOR : QUERY_INSERT_HISTORY);
    bind_text(&st, 1, key->job);
    if (key->name)
        bind_text(&st, 2, key->name);
    else
        bind_real(&st, 2, piece->last);
    bind_integer(&st, 3, piece->part);
    bind_integer(&st, 4, piece->encoding);
    bind_integer(&st, 5, piece->header);
    bind_blob(&st, 6, shared ? digest : piece->data, shared ? sizeof digest : (size_t)piece->size);
    bind_integer(&st, 7, key->number);
    if (key->name)
        bind_integer(&st, 8, shared);
    return statement_run(&st);
}

static store_status get(store *base, const result_key *key, int64_t after,
                        bool (*take)(void *ctx, const result_piece *piece), void *ctx)
{
    sqlite_store *s = sqlite_of(base);
    store_status status = STORE_NOT_FOUND;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, key->name ? QUERY_VECTOR : QUERY_HISTORY);
    bind_text(&st, 1, key->job);
    if (key->name)
        bind_text(&st, 2, key->name);
    else
        bind_real(&st, 2, (double)after);
    bind_integer(&st, 3, key->number);
    for (bool more = true; more && statement_row(&st); status = STORE_OK) {
        result_piece piece = {.part = sqlite3_column_int64(st.stmt, 0),
                              .encoding = sqlite3_column_int64(st.stmt, 1),
                              .header = sqlite3_column_int64(st.stmt, 2),
                              .last = sqlite3_column_double(st.stmt, 3),
                              .data = sqlite3_column_blob(st.stmt, 4),
                              .size = sqlite3_column_bytes(st.stmt, 4)};
        piece.good = sqlite3_column_int(st.stmt, 5) && (piece.data || piece.size == 0);
        more = take(ctx, &piece);
    }
    return sqlite_give_reader(s, c, statement_end(&st, status));
}

static store_status count(store *base, const char *id, const char *name, int64_t *total)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_COUNT_VECTORS);
    bind_text(&st, 1, id);
    bind_text(&st, 2, name);
    if (statement_row(&st))
        *total = sqlite3_column_int64(st.stmt, 0);
    return sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
}

static store_status contents(store *base, const char *id, char **list)
{
    sqlite_store *s = sqlite_of(base);
    store_status status = STORE_NOT_FOUND;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_CONTENTS);
    bind_text(&st, 1, id);
    *list = NULL;
    if (statement_row(&st)) {
        bool ok = true;
        const bool good = sqlite3_column_int(st.stmt, 1);
        *list = good ? sqlite_copy_text(&st, 0, &ok) : NULL;
        status = !good ? STORE_DAMAGED : ok ? STORE_OK : STORE_ERROR;
        if (status != STORE_OK)
            snprintf(c->message, sizeof c->message, "the list of the result of job %.32s can't be read", id);
    }
    return sqlite_give_reader(s, c, statement_end(&st, status));
}

const result_blobs SQLITE_RESULTS = {.put = put, .get = get, .count = count, .contents = contents};
