/* uploads.c: the rows of uploads. */
#include "store/postgresql/internal.h"

#include <stdio.h>
#include <string.h>

static store_status read_info(link_to *l, const PGresult *r, void *ctx)
{
    upload_info *out = ctx;
    (void)l;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    out->bytes = cell_integer(r, 0, 0);
    out->created = cell_real(r, 0, 1);
    out->used = cell_real(r, 0, 2);
    out->jobs = cell_integer(r, 0, 3);
    return STORE_OK;
}

store_status postgresql_upload_get(store *base, const char *id, const char *client, upload_info *out)
{
    call c = {.sql = "SELECT bytes, created, used, jobs FROM uzawa.upload_row($1, $2)"};
    *out = (upload_info){.bytes = 0};
    snprintf(out->id, sizeof out->id, "%s", id);
    call_text(&c, id);
    call_text(&c, client);
    const store_status status = postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_info, out);
    if (status != STORE_OK)
        *out = (upload_info){.bytes = 0};
    return status;
}

static store_status read_any(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    (void)ctx;
    return PQntuples(r) > 0 ? STORE_OK : STORE_NOT_FOUND;
}

store_status postgresql_upload_named(store *base, const char *id, const char *of_job)
{
    call c = {.sql = "SELECT 1 FROM uzawa.upload_use WHERE upload = $1 AND job = $2"};
    call_text(&c, id);
    call_text(&c, of_job);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_any, NULL);
}

typedef struct {
    const char *client;
    bool *known;
} add_args;

static store_status read_added(link_to *l, const PGresult *r, void *ctx)
{
    add_args *a = ctx;
    *a->known = cell_integer(r, 0, 0) != 0;
    return cell_integer(r, 0, 1) ? postgresql_over_quota(l, a->client, "bytes") : STORE_OK;
}

store_status postgresql_upload_add(store *base, const char *id, const char *client, int64_t bytes, upload_info *out,
                                   bool *known)
{
    add_args a = {client, known};
    call c = {.sql = "SELECT known, excess FROM uzawa.upload_add($1, $2, $3, $4)"};
    call_text(&c, id);
    call_text(&c, client);
    call_integer(&c, bytes);
    call_integer(&c, base->settings.quotas.bytes);
    const store_status status = postgresql_do(postgresql_of(base), LINK_DURABLE, false, &c, read_added, &a);
    return status == STORE_OK ? postgresql_upload_get(base, id, client, out) : status;
}

static store_status read_forgotten(link_to *l, const PGresult *r, void *gone)
{
    const char *verdict = PQgetvalue(r, 0, 0);
    (void)l;
    *(bool *)gone = strcmp(verdict, "gone") == 0;
    return strcmp(verdict, "none") == 0 ? STORE_NOT_FOUND : strcmp(verdict, "used") == 0 ? STORE_CONFLICT : STORE_OK;
}

store_status postgresql_upload_forget(store *base, const char *id, const char *client, bool *gone)
{
    call c = {.sql = "SELECT uzawa.upload_forget($1, $2)"};
    *gone = false;
    call_text(&c, id);
    call_text(&c, client);
    return postgresql_do(postgresql_of(base), LINK_DURABLE, false, &c, read_forgotten, gone);
}

static store_status read_idle(link_to *l, const PGresult *r, void *ctx)
{
    upload_info *out = ctx;
    (void)l;
    if (PQntuples(r) == 0)
        return STORE_NOT_FOUND;
    *out = (upload_info){.bytes = cell_integer(r, 0, 1)};
    return cell_write(out->id, sizeof out->id, r, 0, 0) ? STORE_OK : STORE_ERROR;
}

store_status postgresql_upload_idle(store *base, double now, double unused_s, upload_info *out)
{
    call c = {.sql = "SELECT id, bytes FROM uzawa.upload WHERE used < least($1::float8, uzawa.moment()) - $2::float8"
                     " AND NOT EXISTS (SELECT 1 FROM uzawa.upload_use WHERE upload = id) ORDER BY used LIMIT 1"};
    call_real(&c, now);
    call_real(&c, unused_s);
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_idle, out);
}

static store_status read_total(link_to *l, const PGresult *r, void *bytes)
{
    (void)l;
    *(int64_t *)bytes = cell_integer(r, 0, 0);
    return STORE_OK;
}

store_status postgresql_upload_total(store *base, int64_t *bytes)
{
    const call c = {.sql = "SELECT coalesce(sum(bytes), 0)::bigint FROM uzawa.upload"};
    return postgresql_do(postgresql_of(base), LINK_READ, true, &c, read_total, bytes);
}
