/* webhooks.c: whom to tell of the end of which job (store.h). */
#include "store/sqlite/internal.h"

#include <stdio.h>

store_status sqlite_webhook_next(store *base, const char *const *except, size_t n, webhook_due *out)
{
    sqlite_store *s = sqlite_of(base);
    bool ok = true;
    store_status status = STORE_NOT_FOUND;
    connection *c = sqlite_take_reader(s);
    statement st = statement_begin(c, QUERY_WEBHOOK_NEXT);
    bind_real(&st, 1, clock_seconds(CLOCK_REALTIME));
    for (size_t i = 0; i < STORE_WEBHOOKS_EXCEPT; i++)
        bind_text(&st, 2 + (int)i, i < n ? except[i] : NULL);
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
    const webhook_due *due;
    webhook_end end;
    double delay_s, silent_s;
} attempt;

static store_status note_attempt(sqlite_store *s, connection *c, void *args)
{
    (void)s;
    const attempt *a = args;
    const double now = clock_seconds(CLOCK_REALTIME);
    store_status status = STORE_OK;
    if (a->silent_s > 0) {
        statement st = statement_begin(c, QUERY_WEBHOOK_POSTPONE);
        bind_text(&st, 1, a->due->url);
        bind_real(&st, 2, now + a->silent_s);
        bind_integer(&st, 3, WEBHOOK_AGAIN);
        status = statement_run(&st);
    }
    if (status != STORE_OK)
        return status;
    statement st = statement_begin(c, QUERY_WEBHOOK_ATTEMPTED);
    bind_text(&st, 1, a->due->job);
    bind_real(&st, 2, now + a->delay_s);
    bind_integer(&st, 3, a->end);
    return statement_run(&st);
}

store_status sqlite_webhook_attempted(store *base, const webhook_due *due, webhook_end end, double delay_s,
                                      double silent_s)
{
    attempt a = {due, end, delay_s, silent_s};
    return sqlite_write(sqlite_of(base), WRITE_DURABLE, note_attempt, &a);
}
