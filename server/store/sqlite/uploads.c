/* uploads.c: the rows of uploads. */
#include "store/sqlite/internal.h"

#include <stdio.h>

static store_status read_info(connection *c, const char *id, const char *client, upload_info *out)
{
    store_status status = STORE_NOT_FOUND;
    statement st = statement_begin(c, QUERY_UPLOAD);
    bind_text(&st, 1, id);
    bind_text(&st, 2, client);
    *out = (upload_info){.bytes = 0};
    if (statement_row(&st)) {
        snprintf(out->id, sizeof out->id, "%s", id);
        out->bytes = sqlite3_column_int64(st.stmt, 0);
        out->created = sqlite3_column_double(st.stmt, 1);
        out->used = sqlite3_column_double(st.stmt, 2);
        out->jobs = sqlite3_column_int64(st.stmt, 3);
        status = STORE_OK;
    }
    return statement_end(&st, status);
}

store_status sqlite_upload_get(store *base, const char *id, const char *client, upload_info *out)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    return sqlite_give_reader(s, c, read_info(c, id, client, out));
}

store_status sqlite_upload_named(store *base, const char *id, const char *of_job)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_UPLOAD_NAMED);
    bind_text(&st, 1, id);
    bind_text(&st, 2, of_job);
    const bool named = statement_row(&st);
    return sqlite_give_reader(s, c, statement_end(&st, named ? STORE_OK : STORE_NOT_FOUND));
}

typedef struct {
    const char *id, *client;
    int64_t bytes;
    upload_info *out;
    bool known;
} add_args;

static store_status add_row(sqlite_store *s, connection *c, void *args)
{
    add_args *a = args;
    const double now = clock_seconds(CLOCK_REALTIME);
    statement st = statement_begin(c, QUERY_OWN_UPLOAD);
    bind_text(&st, 1, a->id);
    bind_text(&st, 2, a->client);
    store_status status = statement_run(&st);
    a->known = status == STORE_OK && sqlite3_changes64(c->db) == 0;
    if (status == STORE_OK && !a->known)
        status = sqlite_check_quota(s, c, a->client, a->bytes, false);
    if (status != STORE_OK)
        return status;
    st = statement_begin(c, QUERY_INSERT_UPLOAD);
    bind_text(&st, 1, a->id);
    bind_integer(&st, 2, a->bytes);
    bind_real(&st, 3, now);
    status = statement_run(&st);
    if (status == STORE_OK) {
        st = statement_begin(c, QUERY_TOUCH_UPLOAD);
        bind_text(&st, 1, a->id);
        bind_real(&st, 2, now);
        status = statement_run(&st);
    }
    trail_note(&s->trail, "upload", a->id);
    return status == STORE_OK ? read_info(c, a->id, a->client, a->out) : status;
}

store_status sqlite_upload_add(store *base, const char *id, const char *client, int64_t bytes, upload_info *out,
                               bool *known)
{
    add_args a = {id, client, bytes, out, false};
    store_status status = sqlite_write(sqlite_of(base), WRITE_DURABLE, add_row, &a);
    *known = a.known;
    return status;
}

typedef struct {
    const char *id, *client;
    bool gone;
} forget_args;

static store_status delete_row(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    upload_info found;
    forget_args *a = args;
    store_status status = read_info(c, a->id, a->client, &found);
    if (status != STORE_OK)
        return status;
    if (found.jobs > 0)
        return STORE_CONFLICT;
    statement st = statement_begin(c, QUERY_DISOWN_UPLOAD);
    bind_text(&st, 1, a->id);
    bind_text(&st, 2, a->client);
    status = statement_run(&st);
    if (status != STORE_OK)
        return status;
    st = statement_begin(c, QUERY_DELETE_UPLOAD);
    bind_text(&st, 1, a->id);
    status = statement_run(&st);
    a->gone = status == STORE_OK && sqlite3_changes64(c->db) > 0;
    return status;
}

store_status sqlite_upload_forget(store *base, const char *id, const char *client, bool *gone)
{
    forget_args a = {.id = id, .client = client};
    store_status status = sqlite_write(sqlite_of(base), WRITE_FREES, delete_row, &a);
    *gone = status == STORE_OK && a.gone;
    return status;
}

store_status sqlite_upload_idle(store *base, double now, double unused_s, upload_info *out)
{
    sqlite_store *s = sqlite_of(base);
    store_status status = STORE_NOT_FOUND;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_IDLE_UPLOAD);
    bind_real(&st, 1, now - unused_s);
    if (statement_row(&st)) {
        *out = (upload_info){.bytes = sqlite3_column_int64(st.stmt, 1)};
        snprintf(out->id, sizeof out->id, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        status = STORE_OK;
    }
    return sqlite_give_reader(s, c, statement_end(&st, status));
}

store_status sqlite_upload_total(store *base, int64_t *bytes)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_UPLOAD_BYTES);
    if (statement_row(&st))
        *bytes = sqlite3_column_int64(st.stmt, 0);
    return sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
}
