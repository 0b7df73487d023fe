/* nodes.c: the daemons that share the database (nodes.h): what each says of itself, which bodies it has, which is to
 * claim nothing, and what clients have asked of all of them. */
#include "store/nodes.h"
#include "store/postgresql/internal.h"

#include <stdlib.h>
#include <string.h>

/* One that was silent for so long is not counted on; it says something every 10 s at least (tell.c). */
#define ALIVE "seen > uzawa.moment() - 30"

static store_status read_draining(link_to *l, const PGresult *r, void *draining)
{
    (void)l;
    *(bool *)draining = PQntuples(r) > 0 && cell_integer(r, 0, 0);
    return STORE_OK;
}

static store_status report(store *base, const store_node *now, bool *draining)
{
    postgresql_store *s = postgresql_of(base);
    call c = {.sql = "INSERT INTO uzawa.node(id, host, pid, begun, seen, name, version, workers, busy, factors, bytes,"
                     " max_bytes) VALUES ($1, $2, $3, uzawa.moment(), uzawa.moment(), $4, $5, $6, $7, $8, $9, $10)"
                     " ON CONFLICT (id) DO UPDATE SET host = excluded.host, pid = excluded.pid, seen = excluded.seen,"
                     " name = excluded.name, version = excluded.version, workers = excluded.workers,"
                     " busy = excluded.busy, factors = excluded.factors, bytes = excluded.bytes,"
                     " max_bytes = excluded.max_bytes RETURNING draining"};
    call_text(&c, s->node);
    call_text(&c, now->host);
    call_integer(&c, now->pid);
    call_text(&c, now->name);
    call_text(&c, now->version);
    call_integer(&c, now->workers);
    call_integer(&c, now->busy);
    call_integer(&c, now->factors);
    call_integer(&c, now->bytes);
    call_integer(&c, now->max_bytes);
    return postgresql_do(s, LINK_LAZY, true, &c, read_draining, draining);
}

/* ---- the list */

/* The words of a text of numbers in hexadecimal. */
static bool read_bodies(store_node *n, const char *text)
{
    const size_t most = strlen(text) / 2 + 1;
    n->bodies = malloc(most * sizeof *n->bodies);
    if (!n->bodies)
        return false;
    for (char *end; *text; text = end) {
        const uint64_t body = strtoull(text, &end, 16);
        if (end == text)
            break;
        n->bodies[n->n_bodies++] = body;
    }
    return true;
}

typedef struct {
    store_node **nodes;
    size_t *count;
} list_args;

static store_status read_nodes(link_to *l, const PGresult *r, void *ctx)
{
    list_args *a = ctx;
    const int n = PQntuples(r);
    store_nodes_free(*a->nodes, *a->count);
    *a->count = 0;
    *a->nodes = calloc((size_t)n + 1, sizeof **a->nodes);
    bool ok = *a->nodes != NULL;
    for (int i = 0; i < n && ok; i++) {
        store_node *one = &(*a->nodes)[(*a->count)++];
        cell_write(one->name, sizeof one->name, r, i, 0);
        cell_write(one->host, sizeof one->host, r, i, 1);
        cell_write(one->version, sizeof one->version, r, i, 2);
        one->pid = (int)cell_integer(r, i, 3);
        one->begun = cell_real(r, i, 4);
        one->seen = cell_real(r, i, 5);
        one->alive = cell_integer(r, i, 6);
        one->draining = cell_integer(r, i, 7);
        one->workers = (int)cell_integer(r, i, 8);
        one->busy = (int)cell_integer(r, i, 9);
        one->running = cell_integer(r, i, 10);
        one->factors = cell_integer(r, i, 11);
        one->bytes = cell_integer(r, i, 12);
        one->max_bytes = cell_integer(r, i, 13);
        ok = read_bodies(one, PQgetvalue(r, i, 14));
    }
    if (!ok)
        strcpy(l->message, "no memory for the nodes");
    return ok ? STORE_OK : STORE_ERROR;
}

/* A daemon of version 1 does not say its name. */
static store_status list(store *base, store_node **nodes, size_t *count)
{
    list_args a = {nodes, count};
    const call c = {
        .sql = "SELECT coalesce(nullif(name, ''), host || ':' || pid), host, version, pid, begun, seen, " ALIVE
               ", draining, workers, busy, (SELECT count(*) FROM uzawa.job WHERE status = 1 AND node = node.id),"
               " factors, bytes, max_bytes, coalesce((SELECT string_agg(hex, ' ' ORDER BY hex) FROM (SELECT"
               " lpad(to_hex(body), 16, '0') AS hex FROM uzawa.holding WHERE holding.node = node.id) AS each), '')"
               " FROM uzawa.node ORDER BY 1, begun"};
    const store_status status = postgresql_do(postgresql_of(base), LINK_GLANCE, true, &c, read_nodes, &a);
    if (status != STORE_OK) {
        store_nodes_free(*nodes, *count);
        *nodes = NULL;
        *count = 0;
    }
    return status;
}

/* ---- changes */

static store_status any_row(link_to *l, const PGresult *r, void *ctx)
{
    (void)l;
    (void)ctx;
    return PQntuples(r) > 0 ? STORE_OK : STORE_NOT_FOUND;
}

static store_status drain(store *base, const char *name, bool on)
{
    postgresql_store *s = postgresql_of(base);
    call c = {.sql = "UPDATE uzawa.node SET draining = $2 WHERE name = $1 AND " ALIVE " RETURNING id"};
    call_text(&c, name);
    call_bool(&c, on);
    const store_status status = postgresql_do(s, LINK_DURABLE, true, &c, any_row, NULL);
    if (status == STORE_OK)
        postgresql_tell(s, "", TELL_CHANGED, NULL, false); /* everybody looks again */
    if (status == STORE_OK && !on)
        store_tell(base, NULL, false, NULL);
    return status;
}

/* Text of an array of numbers; NULL: no memory. */
static char *array_of(const int64_t *x, size_t n)
{
    char *text = malloc(n * 21 + 3), *at = text;
    if (!text)
        return NULL;
    *at++ = '{';
    for (size_t i = 0; i < n; i++)
        at += sprintf(at, "%s%lld", i > 0 ? "," : "", (long long)x[i]);
    strcpy(at, "}");
    return text;
}

static store_status no_memory(store *base)
{
    store_set_message(base, "no memory for a list of numbers");
    return STORE_ERROR;
}

static store_status forget(store *base, const uint64_t *bodies, size_t n)
{
    postgresql_store *s = postgresql_of(base);
    int64_t *keys = malloc(n * sizeof *keys);
    for (size_t i = 0; keys && i < n; i++)
        keys[i] = (int64_t)bodies[i];
    char *array = keys ? array_of(keys, n) : NULL;
    free(keys);
    if (!array)
        return no_memory(base);
    call c = {.sql = "DELETE FROM uzawa.holding WHERE node = $1 AND body = ANY($2::bigint[])"};
    call_text(&c, s->node);
    call_text(&c, array);
    const store_status status = postgresql_do(s, LINK_LAZY, true, &c, NULL, NULL);
    free(array);
    return status;
}

/* ---- rates */

typedef struct {
    store_rate *rates;
    size_t n;
} rates_args;

static store_status read_rates(link_to *l, const PGresult *r, void *ctx)
{
    rates_args *a = ctx;
    (void)l;
    for (int row = 0; row < PQntuples(r); row++)
        for (size_t i = 0; i < a->n; i++)
            if (strcmp(PQgetvalue(r, row, 0), a->rates[i].client) == 0)
                a->rates[i].total = cell_integer(r, row, 1);
    return STORE_OK;
}

/* Not carried out twice: it would count twice. */
static store_status exchange(store *base, store_rate *rates, size_t n)
{
    rates_args a = {rates, n};
    const char **names = malloc(n * sizeof *names);
    int64_t *used = malloc(n * sizeof *used);
    for (size_t i = 0; names && used && i < n; i++) {
        names[i] = rates[i].client;
        used[i] = rates[i].used;
    }
    char *name_array = names && used ? postgresql_quoted_array(names, n) : NULL;
    char *used_array = name_array ? array_of(used, n) : NULL;
    free(names);
    free(used);
    store_status status = STORE_OK;
    if (used_array) {
        call c = {.sql = "SELECT client, total FROM uzawa.exchange_rates($1::text[], $2::bigint[])"};
        call_text(&c, name_array);
        call_text(&c, used_array);
        status = postgresql_do(postgresql_of(base), LINK_LAZY, false, &c, read_rates, &a);
    } else {
        status = no_memory(base);
    }
    free(name_array);
    free(used_array);
    return status;
}

const store_engine_nodes POSTGRESQL_NODES = {
    .report = report, .list = list, .drain = drain, .forget = forget, .rates = exchange};
