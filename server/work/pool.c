/* pool.c: which process a job goes to, and what the caches of all of them have. */
#include "store/nodes.h"
#include "work/internal.h"

#include <poll.h>
#include <stdlib.h>
#include <string.h>

#define LIST_MS 10000 /* a process that is idle gets so long to say what it has, then it is killed with its factors */

#define IDLE_S 2.0 /* then what is shared with a process goes back to the system */

#define TEXT_MOST ((size_t)8 << 20) /* a longer text is not read for this: its body takes seconds anyway */

static bool has_body(const process *p, uint64_t body)
{
    for (size_t i = 0; body && i < p->n_bodies; i++)
        if (p->bodies[i] == body)
            return true;
    return false;
}

/* The better of two for a job, or NULL for none yet: one that has its body, even if it still has to store an outcome.
 * Whoever asks for the next one as soon as a job has ended would otherwise find its process taken. */
static process *better(process *a, process *b, uint64_t body)
{
    const bool has = has_body(b, body);
    if (b->taken && !(has && b->answered))
        return a;
    return !a || (has && (!has_body(a, body) || (a->taken && !b->taken))) ? b : a;
}

uint64_t work_body(const char *text, size_t len)
{
    return len <= TEXT_MOST ? process_body(text, len) : 0;
}

process *work_take_process(work *w, bool lane, const char *text, size_t len, uint64_t *body)
{
    const int first = lane ? w->options.workers : 0, end = lane ? w->n : w->options.workers;
    process *found;
    if (!*body && text && end - first > 1)
        *body = work_body(text, len);
    pthread_mutex_lock(&w->pool_lock);
    for (;;) {
        found = NULL;
        for (int i = first; i < end; i++)
            found = better(found, &w->processes[i], *body);
        if (found && !found->taken)
            break;
        pthread_cond_wait(&w->pool_idle, &w->pool_lock);
    }
    found->taken = true;
    pthread_mutex_unlock(&w->pool_lock);
    return found;
}

void work_answered(work *w, process *p, uint64_t body)
{
    pthread_mutex_lock(&w->pool_lock);
    p->answered = true;
    size_t at = 0;
    while (at < p->n_bodies && p->bodies[at] != body)
        at++;
    if (body && at == p->n_bodies && p->n_bodies < PROCESS_BODIES)
        p->n_bodies++;
    at = at < PROCESS_BODIES ? at : PROCESS_BODIES - 1;
    for (; body && at > 0; at--)
        p->bodies[at] = p->bodies[at - 1];
    if (body)
        p->bodies[0] = body;
    pthread_mutex_unlock(&w->pool_lock);
}

static void rest_process(process *p, size_t most)
{
    if (p->inbox.mapped > most || p->outbox.mapped > most) {
        segment_rest(&p->inbox, most, true);
        segment_rest(&p->outbox, most, true);
    }
}

void work_rest_processes(work *w)
{
    const double before = clock_seconds(CLOCK_MONOTONIC) - IDLE_S;
    pthread_mutex_lock(&w->pool_lock);
    for (int i = 0; i < w->n; i++)
        if (!w->processes[i].taken && w->processes[i].given < before) {
            int status;
            rest_process(&w->processes[i], SEGMENT_KEPT);
            group_process_ended(&w->processes[i].group, &status); /* so that no zombie stays */
        }
    pthread_mutex_unlock(&w->pool_lock);
}

/* Under pool_lock. */
static bool anybody_has(const work *w, uint64_t body)
{
    for (int i = 0; i < w->n; i++)
        if (has_body(&w->processes[i], body))
            return true;
    return false;
}

void work_give_process(work *w, process *p, const packet *done, uint64_t body)
{
    uint64_t gone[PROCESS_BODIES + 1];
    size_t n = 0, left = 0;
    rest_process(p, SEGMENT_WARM);
    pthread_mutex_lock(&w->pool_lock);
    p->given = clock_seconds(CLOCK_MONOTONIC);
    const size_t had = p->n_bodies;
    if (!done) {
        p->n_bodies = p->held_entries = p->held_bytes = p->n_entries = 0;
    } else if (done->u.done.listed) {
        p->held_entries = done->u.done.cached;
        p->held_bytes = done->u.done.held;
    }
    /* The cache lets go of what was used longest ago, and a body has one entry there at least. */
    p->n_bodies = p->n_bodies < p->held_entries ? p->n_bodies : p->held_entries;
    for (size_t i = p->n_bodies; i < had; i++)
        gone[n++] = p->bodies[i];
    if (body)
        gone[n++] = body; /* where it has failed nobody knows it */
    for (size_t i = 0; i < n; i++)
        if (!anybody_has(w, gone[i]))
            gone[left++] = gone[i];
    p->taken = p->answered = false;
    pthread_cond_broadcast(&w->pool_idle); /* who waits may want another kind */
    pthread_mutex_unlock(&w->pool_lock);
    store_forget_bodies(w->store, gone, left); /* of no matter where it fails: a job comes here and finds none */
}

/* Asks a process that nobody else has; what it says replaces what it said before. */
static void list_process(process *p)
{
    packet m = {.kind = MESSAGE_LIST};
    struct pollfd socket = {.fd = p->socket, .events = POLLIN};
    if (p->pid == 0 || p->socket < 0 || !p->ready || !message_send(p->socket, &m, -1))
        return;
    if (poll(&socket, 1, LIST_MS) <= 0) { /* an answer that came later would be taken for another one */
        process_kill(p);
        return;
    }
    if (!message_receive(p->socket, &m, NULL) || m.kind != MESSAGE_LISTED ||
        m.u.listed.count > PTRDIFF_MAX / sizeof *p->entries ||
        !segment_reach(&p->outbox, m.u.listed.count * sizeof *p->entries, false))
        return;
    uz_cache_entry *copy = malloc((m.u.listed.count + 1) * sizeof *copy);
    if (!copy)
        return;
    memcpy(copy, p->outbox.at, m.u.listed.count * sizeof *copy);
    free(p->entries);
    p->entries = copy;
    p->n_entries = m.u.listed.count;
    for (size_t i = 0; i < p->n_entries; i++)
        copy[i].digest[sizeof copy[i].digest - 1] = '\0';
}

bool work_factors(work *w, uz_cache_entry **entries, size_t *count)
{
    *entries = NULL;
    *count = 0;
    for (int i = 0; i < w->n; i++) {
        process *p = &w->processes[i];
        pthread_mutex_lock(&w->pool_lock);
        const bool ours = !p->taken;
        p->taken = true;
        pthread_mutex_unlock(&w->pool_lock);
        if (ours)
            list_process(p);
        pthread_mutex_lock(&w->pool_lock);
        uz_cache_entry *grown = realloc(*entries, (*count + p->n_entries + 1) * sizeof *grown);
        *entries = grown ? grown : *entries;
        for (size_t k = 0; grown && k < p->n_entries; k++) {
            size_t at = 0;
            while (at < *count && strcmp(grown[at].digest, p->entries[k].digest) != 0)
                at++;
            if (at == *count) {
                grown[(*count)++] = p->entries[k];
            } else {
                grown[at].hits += p->entries[k].hits;
                grown[at].bytes += p->entries[k].bytes;
            }
        }
        if (ours)
            p->taken = false;
        pthread_cond_broadcast(&w->pool_idle);
        pthread_mutex_unlock(&w->pool_lock);
        if (!grown) {
            free(*entries);
            *entries = NULL;
            return false;
        }
    }
    return true;
}

void work_cached(work *w, size_t *entries, size_t *bytes)
{
    *entries = *bytes = 0;
    pthread_mutex_lock(&w->pool_lock);
    for (int i = 0; i < w->n; i++) {
        *entries += w->processes[i].held_entries;
        *bytes += w->processes[i].held_bytes;
    }
    pthread_mutex_unlock(&w->pool_lock);
}
