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
    bind_real(&st, 1, clock_seconds(CLOCK_REALTIME));
    if (statement_row(&st)) {
        snprintf(out->job, sizeof out->job, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        out->url = sqlite_copy_text(&st, 1, &ok);
        out->attempts = sqlite3_column_int(st.stmt, 2);
        status = ok ? STORE_OK : STORE_ERROR;
    }
    return sqlite_give_reader(s, c, statement_end(&st, status));
}

store_status sqlite_webhooks_open(store *base, bool *any)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_WEBHOOKS_OPEN);
    *any = statement_row(&st);
    return sqlite_give_reader(s, c, statement_end(&st, STORE_OK));
}

typedef struct {
    query_id query;
    const char *of; /* the job, or the address */
    webhook_end end;
    double next;
} told_args;

static store_status told(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    const told_args *a = args;
    statement st = statement_begin(c, a->query);
    bind_text(&st, 1, a->of);
    bind_real(&st, 2, a->next);
    bind_integer(&st, 3, a->end);
    return statement_run(&st);
}

store_status sqlite_webhook_postpone(store *base, const char *url, double delay_s)
{
    told_args a = {QUERY_WEBHOOK_POSTPONE, url, WEBHOOK_AGAIN, clock_seconds(CLOCK_REALTIME) + delay_s};
    return sqlite_write(sqlite_of(base), WRITE_DURABLE, told, &a);
}

store_status sqlite_webhook_attempted(store *base, const char *id, webhook_end end, double delay_s)
{
    told_args a = {QUERY_WEBHOOK_ATTEMPTED, id, end, clock_seconds(CLOCK_REALTIME) + delay_s};
    return sqlite_write(sqlite_of(base), WRITE_DURABLE, told, &a);
}
