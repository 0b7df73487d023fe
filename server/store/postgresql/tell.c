/* tell.c: what the daemons of one database tell each other, by LISTEN and NOTIFY, from a thread with a connection of
 * its own. Changes are told after their commit, several at once: a NOTIFY within a transaction would make all commits
 * of all daemons wait for each other's disk. So one may be lost with its daemon, and whoever waits looks by himself now
 * and then. While nothing can be heard everybody is told to look, each second.
 *
 * A message is the name of the node that sends it and lines: a letter (tell_what), a job's id, and the client whose it
 * was. "*": more changed than was kept. */
#include "store/postgresql/internal.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define LOOK_S  1.0
#define BEAT_S  10.0
#define DEAF_S  3.0  /* an ear that works is put up each second */
#define PAUSE_S 0.01 /* between messages: what changes meanwhile is one */
#define MESSAGE 7900 /* bytes; PostgreSQL takes less than 8000 */
#define KEPT    (16 * MESSAGE)
#define NODE    32

struct told {
    pthread_t thread;
    int wake;
    pthread_mutex_t lock; /* what follows */
    bool stop;
    double hears_at; /* when it last was about to hear, on CLOCK_MONOTONIC */
    size_t len;
    char text[KEPT]; /* lines that are to be sent */
};

void postgresql_tell(postgresql_store *s, const char *id, tell_what what, const char *client, bool here)
{
    told *t = s->told;
    char line[STORE_CLIENT + 40];
    if (here)
        store_tell(&s->base, id, what == TELL_WAITS, what == TELL_GONE ? client : NULL);
    if (!t)
        return;
    const int len = snprintf(line, sizeof line, "%c%s%s\n", what, id, what == TELL_GONE && client ? client : "");
    pthread_mutex_lock(&t->lock);
    const bool first = t->len == 0;
    if (t->len + (size_t)len < KEPT) {
        memcpy(t->text + t->len, line, (size_t)len);
        t->len += (size_t)len;
    } else if (t->len < KEPT) { /* nobody took them for long: what is left is to look */
        strcpy(t->text, "*\n");
        t->len = 2;
    }
    pthread_mutex_unlock(&t->lock);
    if (first)
        eventfd_write(t->wake, 1);
}

/* Of another node. */
static void hear_line(postgresql_store *s, const char *line, size_t len)
{
    char id[33], client[STORE_CLIENT];
    if (len < 33 || len - 33 >= sizeof client) {
        store_tell(&s->base, NULL, false, NULL);
        return;
    }
    memcpy(id, line + 1, 32);
    id[32] = '\0';
    memcpy(client, line + 33, len - 33);
    client[len - 33] = '\0';
    store_tell(&s->base, id, line[0] == TELL_WAITS, line[0] == TELL_GONE ? client : NULL);
}

/* What has come. True: also of our own, so that messages do come; through a pooler that is luck, for once. */
static bool hear(postgresql_store *s, link_to *l)
{
    bool own = false;
    for (PGnotify *n; (n = PQnotifies(l->pg)); PQfreemem(n)) {
        if (strncmp(n->extra, s->node, NODE) == 0) {
            own = l->direct;
            continue;
        }
        for (const char *at = n->extra + strnlen(n->extra, NODE); *at;) {
            const size_t len = strcspn(at, "\n");
            hear_line(s, at, len);
            at += len + (at[len] == '\n');
        }
    }
    return own;
}

/* As many lines as a message holds. */
static bool send_message(postgresql_store *s, link_to *l)
{
    told *t = s->told;
    char message[MESSAGE + 1];
    call c = {.sql = "SELECT pg_notify('uzawa', $1)"};
    pthread_mutex_lock(&t->lock);
    size_t len = t->len < MESSAGE - NODE ? t->len : MESSAGE - NODE;
    while (len > 0 && t->text[len - 1] != '\n')
        len--;
    snprintf(message, sizeof message, "%s%.*s", s->node, (int)len, t->text);
    t->len -= len;
    memmove(t->text, t->text + len, t->len);
    pthread_mutex_unlock(&t->lock);
    call_text(&c, message);
    link_begin(l, LINK_LAZY);
    link_send(l, &c);
    return link_end(l) == STORE_OK;
}

/* Ends the transactions of daemons that fell silent in their midst: one that is stopped, or whose machine has gone.
 * What they have locked nobody else could end, run again or write. PostgreSQL's own limit for idle transactions does
 * not count while it waits for the next call of a pipeline. A transaction without a number has written and locked no
 * row: its one large call may be on a slow way, unless it has the lock of the queue. Sees those of the same role only;
 * a daemon that was merely slow tries again. */
#define END_SILENT                                                                                                     \
    "SELECT pg_terminate_backend(pid) FROM pg_stat_activity AS a WHERE datname = current_database()"                   \
    " AND usename = current_user AND application_name = current_setting('application_name') AND state = 'active'"      \
    " AND wait_event = 'ClientRead' AND query_start < clock_timestamp() - interval '20 s' AND (backend_xid IS NOT"     \
    " NULL OR EXISTS (SELECT 1 FROM pg_locks AS l WHERE l.pid = a.pid AND locktype = 'advisory'))"

/* Says that this node lives, and forgets those that have not for a day, and clients that have asked nothing for an
 * hour. */
static bool beat(postgresql_store *s, link_to *l)
{
    call c = {.sql = "INSERT INTO uzawa.node(id, host, pid, begun, seen) VALUES ($1, '', 0, uzawa.moment(),"
                     " uzawa.moment()) ON CONFLICT (id) DO UPDATE SET seen = excluded.seen"};
    call_text(&c, s->node);
    link_begin(l, LINK_LAZY);
    link_send(l, &c);
    link_send(l, &(call){.sql = "DELETE FROM uzawa.node WHERE seen < uzawa.moment() - 86400"});
    link_send(l, &(call){.sql = "DELETE FROM uzawa.rate WHERE at < uzawa.moment() - 3600"});
    if (link_end(l) != STORE_OK)
        return false;
    link_begin(l, LINK_LAZY); /* by itself: a server may refuse this call, which is no reason not to live */
    link_send(l, &(call){.sql = END_SILENT});
    link_end(l);
    return !l->lost;
}

void postgresql_look_if_deaf(postgresql_store *s)
{
    told *t = s->told;
    const double now = clock_seconds(CLOCK_MONOTONIC);
    if (!t)
        return;
    pthread_mutex_lock(&t->lock);
    const bool deaf = t->hears_at < now - DEAF_S;
    if (deaf)
        t->hears_at = now - DEAF_S + LOOK_S; /* not again before */
    pthread_mutex_unlock(&t->lock);
    if (deaf)
        store_tell(&s->base, NULL, false, NULL);
}

static void note_hearing(told *t)
{
    pthread_mutex_lock(&t->lock);
    t->hears_at = clock_seconds(CLOCK_MONOTONIC);
    pthread_mutex_unlock(&t->lock);
}

static bool has_more(told *t, bool *stop)
{
    pthread_mutex_lock(&t->lock);
    const bool more = t->len > 0;
    *stop = t->stop;
    pthread_mutex_unlock(&t->lock);
    return more;
}

static void *tell_loop(void *ctx)
{
    postgresql_store *s = ctx;
    told *t = s->told;
    link_to l = {.pg = NULL};
    bool heard = false, stop = false;
    double next_look = 0.0, next_beat = 0.0, next_send = 0.0;
    while (has_more(t, &stop), !stop) {
        const double now = clock_seconds(CLOCK_MONOTONIC);
        if (!l.pg && link_open(&l, s->address, LINK_READ)) {
            heard = false;
            if (link_script(&l, "LISTEN uzawa") != STORE_OK || !send_message(s, &l))
                link_close(&l);
        }
        if (!heard && now >= next_look) {
            store_tell(&s->base, NULL, false, NULL);
            next_look = now + LOOK_S;
        }
        bool good = l.pg != NULL;
        if (good && now >= next_beat) {
            good = beat(s, &l);
            next_beat = now + BEAT_S;
        }
        while (good && now >= next_send && has_more(t, &stop) && !stop)
            good = send_message(s, &l);
        if (now >= next_send)
            next_send = now + PAUSE_S;
        if (l.pg && hear(s, &l) && !heard) {
            heard = true;
            store_tell(&s->base, NULL, false, NULL); /* what changed before it was heard */
        }
        if (l.pg && !good)
            link_close(&l);
        if (l.pg)
            note_hearing(t);
        struct pollfd p[2] = {{.fd = t->wake, .events = POLLIN}, {.fd = l.pg ? PQsocket(l.pg) : -1, .events = POLLIN}};
        poll(p, 2, l.pg && has_more(t, &stop) ? (int)(1e3 * PAUSE_S) : 1000);
        eventfd_t unused;
        if (p[0].revents)
            eventfd_read(t->wake, &unused);
        if (l.pg && p[1].revents && (!PQconsumeInput(l.pg) || PQstatus(l.pg) != CONNECTION_OK))
            link_close(&l);
        if (l.pg && hear(s, &l) && !heard) {
            heard = true;
            store_tell(&s->base, NULL, false, NULL);
        }
    }
    link_close(&l);
    return NULL;
}

bool postgresql_tell_begin(postgresql_store *s)
{
    told *t = calloc(1, sizeof *t);
    if (!t)
        return false;
    pthread_mutex_init(&t->lock, NULL);
    t->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    t->hears_at = clock_seconds(CLOCK_MONOTONIC);
    s->told = t;
    if (t->wake >= 0 && pthread_create(&t->thread, NULL, tell_loop, s) == 0)
        return true;
    if (t->wake >= 0)
        close(t->wake);
    pthread_mutex_destroy(&t->lock);
    free(t);
    s->told = NULL;
    return false;
}

void postgresql_tell_end(postgresql_store *s)
{
    told *t = s->told;
    if (!t)
        return;
    pthread_mutex_lock(&t->lock);
    t->stop = true;
    pthread_mutex_unlock(&t->lock);
    eventfd_write(t->wake, 1);
    pthread_join(t->thread, NULL);
    close(t->wake);
    pthread_mutex_destroy(&t->lock);
    free(t);
    s->told = NULL;
}
