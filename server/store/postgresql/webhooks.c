/* webhooks.c: whom to tell of the end of which job (store.h). */
#include "store/postgresql/internal.h"

#include <stdlib.h>
#include <string.h>

char *postgresql_quoted_array(const char *const *words, size_t n)
{
    size_t len = 3;
    for (size_t i = 0; i < n; i++)
        len += 2 * strlen(words[i]) + 3;
    char *text = malloc(len), *at = text;
    if (!text)
        return NULL;
    *at++ = '{';
    for (size_t i = 0; i < n; i++) {
        if (i > 0)
            *at++ = ',';
        *at++ = '"';
        for (const char *from = words[i]; *from; *at++ = *from++)
            if (*from == '"' || *from == '\\')
                *at++ = '\\';
        *at++ = '"';
    }
    strcpy(at, "}");
    return text;
}

static store_status read_due(link_to *l, const PGresult *r, void *ctx)
{
    webhook_due *out = ctx;
    bool ok = true;
    (void)l;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    ok = cell_write(out->job, sizeof out->job, r, 0, 0);
    out->url = cell_copy(r, 0, 1, &ok);
    out->attempts = (int)cell_integer(r, 0, 2);
    return ok ? STORE_OK : STORE_ERROR;
}

store_status postgresql_webhook_next(store *base, const char *const *except, size_t n, webhook_due *out)
{
    char *places = postgresql_quoted_array(except, n);
    call c = {.sql = "SELECT job, url, attempts FROM uzawa.webhook_next($1)"};
    if (!places) {
        store_set_message(base, "no memory for the places that are told already");
        return STORE_ERROR;
    }
    call_text(&c, places);
    const store_status status = postgresql_do(postgresql_of(base), LINK_DURABLE, false, &c, read_due, out);
    free(places);
    return status;
}

static store_status read_open(link_to *l, const PGresult *r, void *any)
{
    (void)l;
    *(bool *)any = cell_integer(r, 0, 0) != 0;
    return STORE_OK;
}

store_status postgresql_webhooks_open(store *base, bool *any)
{
    const call c = {.sql = "SELECT EXISTS (SELECT 1 FROM uzawa.webhook WHERE state < 2)"};
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_open, any);
}

store_status postgresql_webhook_attempted(store *base, const webhook_due *due, webhook_end end, double delay_s,
                                          double silent_s)
{
    call c = {.sql = "SELECT uzawa.webhook_attempted($1, $2, $3, $4, $5)"};
    call_text(&c, due->job);
    call_text(&c, silent_s > 0.0 ? due->url : NULL);
    call_integer(&c, end);
    call_real(&c, delay_s);
    call_real(&c, silent_s);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, true, &c, NULL, NULL);
}
