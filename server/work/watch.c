/* watch.c: while a job runs in a process. A process that is told to stop has a moment to do so, in which it gives its
 * best answer; then it is killed, whatever it does. */
#include "work/watch.h"
#include "core/sanitized.h"
#include "work/relay.h"

#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { PATIENCE = SANITIZED ? 10 : 1 };

#define TELL_S    0.25             /* progress is told so often */
#define CANCEL_S  (0.2 * PATIENCE) /* from the word to the kill: somebody waits for that */
#define RELEASE_S (0.5 * PATIENCE) /* the service stops, or another owner has the job */
#define HEARD_S   (1.0 * PATIENCE) /* more, where the process has an answer, or has seen it and makes one */
#define START_S   (20.0 * PATIENCE)
#define ASK_S     1.0               /* what the store could not give is asked for again */
#define GROUP_S   (60.0 * PATIENCE) /* a queue of a cluster that takes longer is none for the jobs of a service */
#define LANE_S    (1.0 * PATIENCE)  /* a job that takes longer is no small one: another worker begins it again */

/* Beyond its time limit. Once it iterates there is an answer, whose certificate may take a while. */
#define LIMIT_S     (0.7 * PATIENCE)
#define LIMIT_SHARE 0.1

typedef struct {
    worker *me;
    process *p;
    const job *job;
    relay_rights rights;
    size_t body_len;
    double told_at, stop_at, due_at, grown_at; /* on CLOCK_MONOTONIC */
    double limit_s, ask_at;                    /* ask_at: infinite where nothing is to be asked for again */
    packet asked;
    int told; /* percent */
    bool stopping;
    bool read;       /* the process has read the text */
    bool again;      /* it is not the first process that has it */
    double group_by; /* a group of processes was asked for, and has to call until then; 0: none is waited for */
} watch;

/* The process waits for what it has asked for, also while the store is away: until it is back or the job is to end.
 * False: the process is gone. */
static bool answer(watch *w, const packet *question, double now)
{
    packet reply;
    int fd;
    relay_answer(&reply, &fd, w->me->w->store, &w->rights, question, &w->p->inbox, (w->body_len + 7) / 8 * 8);
    const bool away = reply.status == STORE_AWAY;
    const bool sent = away || message_send(w->p->socket, &reply, fd);
    if (fd >= 0)
        close(fd);
    w->asked = *question;
    w->ask_at = away ? now + ASK_S : (double)INFINITY;
    return sent;
}

/* stream: the group's, closed here; -1: there is none. */
static bool answer_group(watch *w, store_status status, int stream)
{
    const packet reply = {.kind = MESSAGE_ANSWER, .status = (int32_t)status};
    w->group_by = 0.0;
    const bool sent = message_send(w->p->socket, &reply, stream);
    if (stream >= 0)
        close(stream);
    return sent;
}

/* A process asks for a group. False: it may not, or is gone. */
static bool begin_group(watch *w, double now)
{
    const char *command = w->me->w->options.group_command;
    const bool is_known = command && *command;
    if (w->group_by > 0.0)
        return false;
    if (!is_known || !group_process_begin(&w->p->group, command, w->me->w->log))
        return answer_group(w, is_known ? STORE_ERROR : STORE_NOT_FOUND, -1);
    w->group_by = now + GROUP_S;
    return true;
}

/* A group that was started calls, or does not. False: the process is gone. */
static bool look_for_group(watch *w, bool calls, double now)
{
    group_process *group = &w->p->group;
    int status = 0;
    const int stream = calls ? group_process_accept(group) : -1;
    if (stream >= 0)
        return answer_group(w, STORE_OK, stream);
    const bool ended = group_process_ended(group, &status);
    if (!ended && now < w->group_by)
        return true;
    log_write(w->me->w->log, LOG_ERROR, "group_not_started",
              (log_field[]){LOG_S("job", w->job->id),
                            LOG_S("cause", ended ? "the command has ended" : "nobody has called"),
                            LOG_I("status", WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)),
                            {0}});
    group_process_end(group);
    return answer_group(w, STORE_ERROR, -1);
}

/* False: it is no message that may come now, and who says such things is not trusted with a job. */
static bool hear(watch *w, const packet *m, double now)
{
    worker *me = w->me;
    if (m->kind == MESSAGE_READY) {
        w->p->ready = true;
        w->due_at = w->limit_s > 0.0 ? now + w->limit_s + LIMIT_S : (double)INFINITY;
        w->grown_at = me->lane ? now + LANE_S : (double)INFINITY;
        if (!m->u.ready.confined && !SANITIZED)
            log_write(me->w->log, LOG_WARN, "process_not_confined", (log_field[]){{0}});
        return true;
    }
    if (m->kind == MESSAGE_ASK)
        return m->u.ask.what == ASK_GROUP ? begin_group(w, now) : answer(w, m, now);
    if (m->kind != MESSAGE_READ)
        return false;
    w->read = true;
    w->limit_s = m->u.read.time_limit_s;
    w->due_at = w->limit_s > 0.0 ? now + w->limit_s + LIMIT_S : (double)INFINITY;
    pthread_mutex_lock(&me->lock);
    me->n_cases = m->u.read.n_cases;
    pthread_mutex_unlock(&me->lock);
    return true;
}

/* Until it is done, dead or killed. */
static watch_end follow(watch *w, watch_report *out)
{
    struct pollfd fds[] = {
        {.fd = w->p->socket, .events = POLLIN}, {.fd = w->me->wake, .events = POLLIN}, {.fd = -1, .events = POLLIN}};
    for (;;) {
        double now = clock_seconds(CLOCK_MONOTONIC);
        const bool cancelled = atomic_load(&w->me->cancel), stops = atomic_load(&w->me->w->interrupt);
        if (!w->stopping && (cancelled || stops || now >= w->grown_at || atomic_load(&w->me->lost))) {
            atomic_store(&w->p->board->stop, true); /* the word is passed on, once */
            w->stopping = true;
            w->stop_at = now + (cancelled ? CANCEL_S : RELEASE_S);
        }
        const bool heard = w->stopping && (atomic_load(&w->p->board->heard) || live_read(&w->p->board->live).any);
        if (w->stopping && now >= w->stop_at + (heard ? HEARD_S : 0.0))
            return WATCH_STOPPED;
        if (now >= w->due_at + LIMIT_SHARE * w->limit_s || (now >= w->due_at && !live_read(&w->p->board->live).any)) {
            out->done = out->kept;
            return out->kept.kind == MESSAGE_KEPT ? WATCH_KEPT : w->p->ready ? WATCH_OVERDUE : WATCH_NOT_STARTED;
        }
        /* To all who follow this job; to those who follow all jobs only where the percentage is another one. */
        if (w->job->id[0] && now - w->told_at >= TELL_S && live_read(&w->p->board->live).any) {
            w->told_at = now;
            pthread_mutex_lock(&w->me->lock);
            const int progress = w->me->progress = live_progress(&w->p->board->live, w->me->progress);
            pthread_mutex_unlock(&w->me->lock);
            if (progress != w->told)
                feed_goes_on(w->me->w->feed, w->me->id); /* only this thread changes its id */
            else
                feed_moved(w->me->w->feed, w->me->id);
            w->told = progress;
        }
        if (now >= w->ask_at && !answer(w, &w->asked, now))
            return WATCH_DIED;
        double wait = fmin(TELL_S, fmax(0.0, w->ask_at - now));
        wait = w->stopping ? fmin(wait, fmax(0.0, w->stop_at - now)) : wait;
        wait = heard && now >= w->stop_at ? fmin(TELL_S, w->stop_at + HEARD_S - now) : wait;
        wait = w->due_at > now ? fmin(wait, w->due_at - now) : wait;
        wait = w->grown_at > now ? fmin(wait, w->grown_at - now) : wait;
        fds[2].fd = w->group_by > 0.0 ? w->p->group.listener : -1;
        const int events = poll(fds, 3, (int)(1e3 * wait) + 1);
        if (w->group_by > 0.0 && !look_for_group(w, events > 0 && fds[2].revents, clock_seconds(CLOCK_MONOTONIC)))
            return WATCH_DIED;
        if (events <= 0)
            continue;
        if (fds[1].revents) {
            uint64_t count;
            (void)!read(w->me->wake, &count, sizeof count);
        }
        if (!fds[0].revents)
            continue;
        if (!message_receive(w->p->socket, &out->done, NULL))
            /* One that was about to go when it was given the job is no fault of the job's. */
            return w->p->ready && (w->read || w->again) ? WATCH_DIED : WATCH_NOT_STARTED;
        if (out->done.kind == MESSAGE_DONE)
            return WATCH_DONE;
        if (out->done.kind == MESSAGE_KEPT && w->read)
            out->kept = out->done;
        else if (!hear(w, &out->done, clock_seconds(CLOCK_MONOTONIC)))
            return WATCH_DIED;
    }
}

watch_end watch_job(worker *me, const job *claimed, char *body, size_t body_len, double queue_s, watch_report *out)
{
    work *all = me->w;
    process *p = me->process;
    const work_options *o = &all->options;
    watch w = {.me = me,
               .p = p,
               .job = claimed,
               .rights = {.job = claimed->id},
               .body_len = body_len,
               .told = -1,
               .ask_at = (double)INFINITY,
               .limit_s = o->max_solve_s};
    if (body) /* before it is where the process writes, too */
        relay_find_start(w.rights.start, body, body_len);
    *out = (watch_report){.status = 0};
    packet m = {.kind = MESSAGE_JOB,
                .u.job = {.damaged = !body,
                          .size = body_len,
                          .queue_s = queue_s,
                          .max_solve_s = o->max_solve_s,
                          .memory = o->solve_bytes}};
    memcpy(m.u.job.id, claimed->id, sizeof m.u.job.id);
    pace_now(all->pace, m.u.job.pace);
    const bool room = segment_reach(&p->inbox, body_len, true);
    if (room && body_len > 0 && body)
        memcpy(p->inbox.at, body, body_len);
    free(body);
    if (!room)
        return WATCH_NO_ROOM;
    atomic_store(&p->board->stop, false);
    atomic_store(&p->board->heard, false);
    live_reset(&p->board->live);
    watch_end end = WATCH_NOT_STARTED;
    for (int tries = 0; tries < 2 && end == WATCH_NOT_STARTED && !atomic_load(&all->interrupt); tries++) {
        const double now = clock_seconds(CLOCK_MONOTONIC);
        if (!process_begin(p))
            continue;
        w.due_at = !p->ready ? now + START_S : w.limit_s > 0.0 ? now + w.limit_s + LIMIT_S : (double)INFINITY;
        w.grown_at = me->lane && p->ready ? now + LANE_S : (double)INFINITY;
        w.again = tries > 0;
        end = message_send(p->socket, &m, -1) ? follow(&w, out) : WATCH_NOT_STARTED;
        if (end == WATCH_DONE)
            break;
        out->began = live_read(&p->board->live).any;
        out->time_limit_s = w.limit_s;
        if (end != WATCH_DIED)
            process_kill(p);
        /* One that was killed may take a while to give back its memory: the job does not wait for that. */
        if (end == WATCH_DIED || end == WATCH_NOT_STARTED) {
            process_kill(p); /* also where it only spoke nonsense */
            out->status = process_reap(p, &out->out_of_memory);
        }
    }
    if (end == WATCH_DIED || end == WATCH_NOT_STARTED) /* not before: the next try reads the body there */
        segment_rest(&p->inbox, SEGMENT_KEPT, true);
    return end;
}
