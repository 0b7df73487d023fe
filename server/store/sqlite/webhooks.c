/* webhooks.c: whom to tell of the end of which job (store.h). */
#include "store/sqlite/internal.h"

#include <stdio.h>

store_status sqlite_webhook_next(store *base, webhook_due *out)
{
    sqlite_store *s = sqlite_of(base);
    bool ok = true;
    store_status status = STORE_NOT_FOUND;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_WEBHOOK_NEXT);
    bind_real(&st, 1, store_now());
    if (statement_row(&st)) {
        snprintf(out->job, sizeof out->job, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        out->url = sqlite_copy_text(&st, 1, &ok);
        out->attempts = sqlite3_column_int(st.stmt, 2);
        status = ok ? STORE_OK : STORE_ERROR;
    }
    store_status ended = statement_end(&st);
    return sqlite_give_reader(s, c, ended == STORE_OK ? status : ended);
}

store_status sqlite_webhooks_open(store *base, bool *any)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_WEBHOOKS_OPEN);
    *any = statement_row(&st);
    return sqlite_give_reader(s, c, statement_end(&st));
}

typedef struct {
    const char *job; /* or the address */
    webhook_end end;
    double next;
} attempted_args;

static store_status attempted(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    const attempted_args *a = args;
    statement st = statement_begin(c, QUERY_WEBHOOK_ATTEMPTED);
    bind_text(&st, 1, a->job);
    bind_integer(&st, 2, a->end);
    bind_real(&st, 3, a->next);
    return statement_run(&st);
}

static store_status postpone(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    const attempted_args *a = args;
    statement st = statement_begin(c, QUERY_WEBHOOK_POSTPONE);
    bind_text(&st, 1, a->job);
    bind_real(&st, 2, a->next);
    return statement_run(&st);
}

store_status sqlite_webhook_postpone(store *base, const char *url, double delay_s)
{
    sqlite_store *s = sqlite_of(base);
    attempted_args a = {.job = url, .next = store_now() + delay_s};
    return sqlite_write(s, postpone, &a);
}

store_status sqlite_webhook_attempted(store *base, const char *id, webhook_end end, double delay_s)
{
    sqlite_store *s = sqlite_of(base);
    attempted_args a = {id, end, store_now() + delay_s};
    return sqlite_write(s, attempted, &a);
}
