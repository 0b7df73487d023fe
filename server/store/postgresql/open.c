/* open.c: opening and closing a store in a database, its connections, and the table of the engine. */
#include "store/blobs.h"
#include "store/postgresql/former.h"
#include "store/postgresql/internal.h"
#include "store/postgresql/postgresql.h"
#include "store/postgresql/schema.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#define FIRST_DELAY_S   0.1
#define LONGEST_DELAY_S 5.0

/* ---- connections */

/* Where the last attempt failed a moment ago nobody tries: all would wait for the same. */
static void connect_link(postgresql_store *s, link_to *l, link_kind kind)
{
    pthread_mutex_lock(&s->links_lock);
    const bool now = clock_seconds(CLOCK_MONOTONIC) >= s->connect_after;
    if (!now)
        snprintf(l->message, sizeof l->message, "%s", s->connect_cause);
    pthread_mutex_unlock(&s->links_lock);
    link_close(l);
    const bool good = now && link_open(l, s->address, kind);
    pthread_mutex_lock(&s->links_lock);
    l->direct = l->direct && !s->pooled;
    if (good) {
        s->connect_delay = 0.0;
    } else if (now) {
        s->connect_delay = fmin(fmax(2.0 * s->connect_delay, FIRST_DELAY_S), LONGEST_DELAY_S);
        s->connect_after = clock_seconds(CLOCK_MONOTONIC) + s->connect_delay;
        memcpy(s->connect_cause, l->message, sizeof s->connect_cause);
    } else {
        memcpy(l->message, s->connect_cause, sizeof l->message);
    }
    pthread_mutex_unlock(&s->links_lock);
}

/* For a transaction of this kind. NULL: none was free while one of LINK_GLANCE waits. */
static link_to *take_for(postgresql_store *s, link_kind kind)
{
    const double until = kind == LINK_GLANCE ? clock_seconds(CLOCK_MONOTONIC) + LINK_GLANCE_S : (double)INFINITY;
    pthread_mutex_lock(&s->links_lock);
    while (s->n_links_free == 0 && clock_wait(&s->link_free, &s->links_lock, until))
        ;
    link_to *l = s->n_links_free > 0 ? s->links_free[--s->n_links_free] : NULL;
    pthread_mutex_unlock(&s->links_lock);
    if (l && !link_alive(l))
        connect_link(s, l, kind);
    return l;
}

link_to *postgresql_take(postgresql_store *s)
{
    return take_for(s, LINK_READ);
}

store_status postgresql_give(postgresql_store *s, link_to *l, store_status status)
{
    if (status != STORE_OK && status != STORE_NOT_FOUND && status != STORE_CONFLICT && status != STORE_BUSY)
        store_set_message(&s->base, l->message);
    const bool misled = l->misled;
    if (l->lost)
        link_close(l);
    else if (l->pg)
        link_begin(l, LINK_READ); /* lets go of the answers */
    pthread_mutex_lock(&s->links_lock);
    s->pooled = s->pooled || misled;
    s->links_free[s->n_links_free++] = l;
    pthread_cond_signal(&s->link_free);
    pthread_mutex_unlock(&s->links_lock);
    return status;
}

store_status postgresql_do(postgresql_store *s, link_kind kind, bool repeat, const call *c, answer_reader *read,
                           void *ctx)
{
    for (int tries = 1;; tries++) {
        link_to *l = take_for(s, kind);
        if (!l) {
            store_set_message(&s->base, "no connection to the database was free");
            return STORE_AWAY;
        }
        link_begin(l, kind);
        link_send(l, c);
        store_status status = link_end(l);
        const bool again = tries < 3 && ((repeat && l->lost && !l->silent && l->pg) || l->passing);
        if (status == STORE_OK && read)
            status = read(l, l->answers[0], ctx);
        postgresql_give(s, l, status);
        if (!again)
            return status;
    }
}

/* ---- opening */

static bool read_newest(link_to *l, postgresql_store *s)
{
    unsigned long long ms = 0;
    unsigned sequence = 0;
    link_begin(l, LINK_READ);
    link_send(l, &(call){.sql = "SELECT max(id) FROM uzawa.job"});
    if (link_end(l) != STORE_OK)
        return false;
    if (sscanf(PQgetvalue(l->answers[0], 0, 0), "%12llx%4x", &ms, &sequence) == 2) { /* ids go on from there */
        s->last_ms = ms;
        s->sequence = sequence;
    }
    return true;
}

static bool enter(link_to *l, postgresql_store *s)
{
    uint64_t random[2] = {0};
    char host[65] = "", process[FORMER_TEXT] = "";
    call c = {.sql = "INSERT INTO uzawa.node(id, host, pid, begun, seen, process) VALUES ($1, $2, $3, uzawa.moment(),"
                     " uzawa.moment(), $4)"};
    if (getrandom(random, sizeof random, 0) != (ssize_t)sizeof random)
        return false;
    gethostname(host, sizeof host - 1);
    former_describe(getpid(), process); /* where the system does not tell, leases do */
    snprintf(s->node, sizeof s->node, "%016llx%016llx", (unsigned long long)random[0], (unsigned long long)random[1]);
    call_text(&c, s->node);
    call_text(&c, host);
    call_integer(&c, getpid());
    call_text(&c, process);
    link_begin(l, LINK_DURABLE);
    link_send(l, &c);
    return link_end(l) == STORE_OK;
}

store *postgresql_open(const char *address, char *message, size_t size)
{
    if (!link_address_fits(address, message, size))
        return NULL;
    postgresql_store *s = calloc(1, sizeof *s);
    if (!s) {
        snprintf(message, size, "no memory");
        return NULL;
    }
    store_base_begin(&s->base, &STORE_POSTGRESQL);
    pthread_mutex_init(&s->links_lock, NULL);
    clock_condition(&s->link_free);
    pthread_mutex_init(&s->state_lock, NULL);
    batch_begin(&s->changes, postgresql_run_batch, s);
    for (int i = 0; i < STORE_LINKS; i++)
        s->links_free[s->n_links_free++] = &s->links[STORE_LINKS - 1 - i];
    s->address = strdup(address);
    link_to *l = s->address ? postgresql_take(s) : NULL;
    bool good = l && l->pg && schema_bring(l) && read_newest(l, s) && enter(l, s);
    if (!good)
        snprintf(message, size, "%s", l ? l->message : "no memory");
    if (l)
        postgresql_give(s, l, STORE_OK);
    good = good && store_uploads_begin(&s->base, postgresql_blobs(s), message, size);
    if (good && !postgresql_tell_begin(s)) {
        snprintf(message, size, "cannot start a thread");
        good = false;
    }
    if (good)
        return &s->base;
    postgresql_close(&s->base);
    return NULL;
}

void postgresql_close(store *base)
{
    postgresql_store *s = postgresql_of(base);
    postgresql_put_back(s, true);
    postgresql_tell_end(s);
    if (s->node[0]) { /* what its jobs were is for the others */
        call c = {.sql = "DELETE FROM uzawa.node WHERE id = $1"};
        call_text(&c, s->node);
        postgresql_do(s, LINK_DURABLE, true, &c, NULL, NULL);
    }
    for (int i = 0; i < STORE_LINKS; i++)
        link_close(&s->links[i]);
    batch_end(&s->changes);
    pthread_mutex_destroy(&s->state_lock);
    pthread_cond_destroy(&s->link_free);
    pthread_mutex_destroy(&s->links_lock);
    store_base_end(base);
    free(s->lost_json);
    free(s->address);
    free(s);
}

const store_engine STORE_POSTGRESQL = {
    .scheme = "postgresql://",
    .open = postgresql_open,
    .close = postgresql_close,
    .submit = postgresql_submit,
    .find_repeat = postgresql_find_repeat,
    .claim = postgresql_claim,
    .use_lease = postgresql_use_lease,
    .recover = postgresql_recover,
    .expire = postgresql_expire,
    .retain = postgresql_retain,
    .dismiss = postgresql_dismiss,
    .get = postgresql_get,
    .list = postgresql_list,
    .get_body = postgresql_get_body,
    .get_cases = postgresql_get_cases,
    .results = &POSTGRESQL_RESULTS,
    .counts = postgresql_counts,
    .webhook_next = postgresql_webhook_next,
    .webhooks_open = postgresql_webhooks_open,
    .webhook_attempted = postgresql_webhook_attempted,
    .upload_get = postgresql_upload_get,
    .upload_named = postgresql_upload_named,
    .upload_add = postgresql_upload_add,
    .upload_forget = postgresql_upload_forget,
    .upload_idle = postgresql_upload_idle,
    .upload_total = postgresql_upload_total,
    .nodes = &POSTGRESQL_NODES,
    .collect = postgresql_collect,
    .try_write = postgresql_try_write,
    .free_bytes = postgresql_free_bytes,
    .check = postgresql_check,
    .check_file = postgresql_check_file,
    .moves = &POSTGRESQL_MOVES,
    .backup_file = postgresql_backup_file,
};
