/* move.c: rows as they stand, for who moves them into another store. */
#include "store/move.h"
#include "store/sqlite/internal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Statements that no daemon needs are not kept. */
static statement prepare(connection *c, const char *sql, const char *argument)
{
    statement st = {.c = c};
    st.rc = sqlite3_prepare_v2(c->db, sql, -1, &st.stmt, NULL);
    if (st.rc == SQLITE_OK)
        st.rc = sqlite3_bind_text(st.stmt, 1, argument, -1, SQLITE_STATIC);
    return st;
}

static store_status finish(statement *st, store_status status)
{
    const bool good = st->rc == SQLITE_OK || st->rc == SQLITE_ROW || st->rc == SQLITE_DONE;
    if (!good)
        snprintf(st->c->message, sizeof st->c->message, "%.200s", sqlite3_errmsg(st->c->db));
    sqlite3_finalize(st->stmt);
    return good ? status : STORE_ERROR;
}

static bool row(statement *st)
{
    if (st->rc == SQLITE_OK || st->rc == SQLITE_ROW)
        st->rc = sqlite3_step(st->stmt);
    return st->rc == SQLITE_ROW;
}

static store_status read_row(connection *c, const char *id, moved_job *out)
{
    bool ok = true;
    statement st = prepare(
        c,
        "SELECT finished, idempotency_key, queue_until, share, small, bytes, contents,"
        " (SELECT group_concat(upload || char(10), '') FROM (SELECT upload FROM upload_use WHERE job = ?1 ORDER BY 1)),"
        " url, state, webhook.attempts, next FROM job LEFT JOIN webhook ON webhook.job = id WHERE id = ?1",
        id);
    store_status status = STORE_NOT_FOUND;
    if (row(&st)) {
        out->finished = sqlite3_column_double(st.stmt, 0);
        out->key = sqlite_copy_text(&st, 1, &ok);
        out->queue_until = sqlite3_column_double(st.stmt, 2);
        out->share = sqlite_copy_text(&st, 3, &ok);
        out->small = sqlite3_column_int(st.stmt, 4) != 0;
        out->bytes = sqlite3_column_int64(st.stmt, 5);
        out->contents = sqlite_copy_text(&st, 6, &ok);
        out->uploads = sqlite_copy_text(&st, 7, &ok);
        out->url = sqlite_copy_text(&st, 8, &ok);
        out->webhook_state = sqlite3_column_int64(st.stmt, 9);
        out->webhook_attempts = sqlite3_column_int64(st.stmt, 10);
        out->webhook_next = sqlite3_column_double(st.stmt, 11);
        status = ok ? STORE_OK : STORE_ERROR;
    }
    if (status == STORE_ERROR)
        strcpy(c->message, "no memory for a job");
    return finish(&st, status);
}

static store_status read_blobs(connection *c, const char *id, moved_job *out)
{
    statement st = prepare(c,
                           "SELECT DISTINCT answer, name FROM vector WHERE job = ?1"
                           " UNION SELECT DISTINCT answer, '' FROM history WHERE job = ?1 ORDER BY 1, 2",
                           id);
    store_status status = STORE_OK;
    while (status == STORE_OK && row(&st)) {
        moved_blob *grown = realloc(out->blobs, (out->n_blobs + 1) * sizeof *grown);
        if (!grown) {
            strcpy(c->message, "no memory for a job");
            status = STORE_ERROR;
            break;
        }
        out->blobs = grown;
        moved_blob *one = &out->blobs[out->n_blobs++];
        one->number = sqlite3_column_int64(st.stmt, 0);
        snprintf(one->name, sizeof one->name, "%s", (const char *)sqlite3_column_text(st.stmt, 1));
    }
    return finish(&st, status);
}

static store_status read_job(store *base, const char *id, moved_job *out)
{
    sqlite_store *s = sqlite_of(base);
    store_status status = sqlite_get(base, id, &out->job);
    if (status != STORE_OK)
        return status;
    connection *c = sqlite_take_reader(s);
    status = read_row(c, id, out);
    if (status == STORE_OK)
        status = read_blobs(c, id, out);
    return sqlite_give_reader(s, c, status);
}

static store_status read_upload(store *base, const char *from, moved_upload *out)
{
    sqlite_store *s = sqlite_of(base);
    bool ok = true;
    connection *c = sqlite_take_reader(s);
    statement st = prepare(c,
                           "SELECT id, bytes, created, used, coalesce((SELECT group_concat(client || char(10), '') FROM"
                           " (SELECT client FROM upload_client WHERE upload = id ORDER BY 1)), '') FROM upload"
                           " WHERE id >= ?1 ORDER BY id LIMIT 1",
                           from);
    store_status status = STORE_NOT_FOUND;
    if (row(&st)) {
        snprintf(out->info.id, sizeof out->info.id, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        out->info.bytes = sqlite3_column_int64(st.stmt, 1);
        out->info.created = sqlite3_column_double(st.stmt, 2);
        out->info.used = sqlite3_column_double(st.stmt, 3);
        out->clients = sqlite_copy_text(&st, 4, &ok);
        status = ok ? STORE_OK : STORE_ERROR;
    }
    return sqlite_give_reader(s, c, finish(&st, status));
}

static store_status read_client(store *base, const char *from, moved_client *out)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = prepare(c, "SELECT name, day, seconds FROM client WHERE name >= ?1 ORDER BY name LIMIT 1", from);
    store_status status = STORE_NOT_FOUND;
    if (row(&st)) {
        snprintf(out->name, sizeof out->name, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        out->day = sqlite3_column_int64(st.stmt, 1);
        out->seconds = sqlite3_column_double(st.stmt, 2);
        status = STORE_OK;
    }
    return sqlite_give_reader(s, c, finish(&st, status));
}

const store_moves SQLITE_MOVES = {.read_job = read_job, .read_upload = read_upload, .read_client = read_client};
