/* predict.c: what a request will take. Assembly and ordering are those of a solve, and so is what may become of them:
 * they are done in a process of their own, and whatever becomes of that, the daemon goes on. */
#include "work/internal.h"
#include "work/relay.h"

#include <poll.h>
#include <string.h>
#include <unistd.h>

#define LOOK_S 0.1 /* who waits is looked after so often */

/* Until it has told; false: it has died, or nobody waits for it. */
static bool converse(work *w, process *p, const work_request *request, packet *m)
{
    const relay_rights rights = {.uploads = request->uploads, .n_uploads = request->n_uploads};
    struct pollfd socket = {.fd = p->socket, .events = POLLIN};
    while (!request->is_over(request->asker)) {
        if (poll(&socket, 1, (int)(1e3 * LOOK_S)) <= 0)
            continue;
        if (!message_receive(p->socket, m, NULL))
            break;
        if (m->kind == MESSAGE_PREDICTED)
            return true;
        if (m->kind != MESSAGE_ASK)
            continue;
        packet answer;
        int fd;
        relay_answer(&answer, &fd, w->store, &rights, m, &p->inbox, (request->len + 7) / 8 * 8);
        message_send(p->socket, &answer, fd);
        if (fd >= 0)
            close(fd);
    }
    return false;
}

bool work_predict(work *w, const work_request *request, uz_prediction *out)
{
    packet m = {.kind = MESSAGE_PREDICT, .u.job = {.size = request->len, .memory = w->options.solve_bytes}};
    bool over = request->is_over(request->asker), known = false, out_of_memory;
    process p;
    double factor[PACE_FORMS];
    pthread_mutex_lock(&w->pool_lock);
    while (w->predicting && !over) {
        clock_wait(&w->pool_idle, &w->pool_lock, clock_seconds(CLOCK_MONOTONIC) + LOOK_S);
        over = request->is_over(request->asker);
    }
    if (!over)
        w->predicting = true;
    pthread_mutex_unlock(&w->pool_lock);
    if (over)
        return false;

    if (process_make(&p, w->options.program, 0, w->options.solve_bytes, w->log) &&
        segment_reach(&p.inbox, request->len, true) && process_begin(&p)) {
        memcpy(p.inbox.at, request->text, request->len);
        atomic_store(&p.board->threads, work_threads(w, work_busy(w) + 1)); /* as if the job began now */
        if (message_send(p.socket, &m, -1) && converse(w, &p, request, &m)) {
            known = m.u.predicted.known;
            *out = m.u.predicted.cost;
            pace_now(w->pace, factor);
            out->seconds *= known ? factor[out->op] : 1.0;
        } else {
            process_kill(&p);
            process_reap(&p, &out_of_memory);
            if (!request->is_over(request->asker))
                log_write(w->log, LOG_WARN, "prediction_died",
                          (log_field[]){LOG_S("cause", out_of_memory ? "out of memory" : "a fault"), {0}});
        }
    }
    process_free(&p);
    pthread_mutex_lock(&w->pool_lock);
    w->predicting = false;
    pthread_cond_broadcast(&w->pool_idle);
    pthread_mutex_unlock(&w->pool_lock);
    return known;
}
