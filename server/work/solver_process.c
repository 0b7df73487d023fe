/* solver_process.c: the life of a process that solves: its limits, then one job after another, with a cache that stays.
 *
 * One thread, besides those of BLAS, one that touches pages ahead and those that compute with it. It may be killed at
 * any instruction: nothing outlives it but what it has put into shared memory. */
#include "work/solver_process.h"
#include "base/clock.h"
#include "base/memory.h"
#include "core/alloc.h"
#include "core/reserve.h"
#include "core/sanitized.h"
#include "work/answers.h"
#include "work/confine.h"
#include "work/message.h"
#include "work/parcel.h"
#include "work/relay.h"
#include "work/solve.h"
#include "work/starts.h"

#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#define SETTLE_MS 300          /* without a job: then memory is made ready for the next one */
#define IDLE_MS   (300 * 1000) /* then it goes back to the system */

#define HEAP_FREE  ((size_t)16 << 20) /* may lie free where no large body was solved */
#define SMALL_PAGE 4096

#define LIMIT_ROOM ((size_t)512 << 20) /* beyond cache and twice what a solve may take: texts, answers, libraries */

typedef struct {
    int socket;
    segment board_memory, inbox, outbox;
    board *board;
    store *source;
    uz_cache *cache;
    uz_reserve *reserve;
    size_t cache_bytes;
    live_writer live;
    size_t names; /* bytes at the begin of the outbox: where the outcome goes, unless one was kept there */
    /* Of the job at hand: its request, once it was read, and what waiting and reading took. */
    const codec_request *request;
    double queue_s, parse_s, given_at;
    uz_process_group *group; /* of the job; NULL: it has none */
    bool group_asked;        /* for, and the answer has not been taken */
    bool fresh;              /* a job has ended since memory was made ready last, or none was solved yet */
} solver;

/* ---- what the solver asks and tells */

/* It asks often; other jobs may have begun or ended meanwhile. */
static bool is_stopped(void *ctx)
{
    const solver *s = ctx;
    const bool stop = atomic_load_explicit(&s->board->stop, memory_order_relaxed);
    uz_process_threads_now(atomic_load_explicit(&s->board->threads, memory_order_relaxed));
    if (stop)
        atomic_store_explicit(&s->board->heard, true, memory_order_relaxed);
    return stop;
}

static void note_progress(void *ctx, const uz_history_row *row)
{
    live_add(&((solver *)ctx)->live, row);
}

static void note_case(void *ctx, int64_t load_case)
{
    live_writer *w = &((solver *)ctx)->live;
    live_restart(w, load_case, w->state.from, w->state.to);
}

static void note_grid(void *ctx, const uz_grid_start *grid)
{
    live_grid(&((solver *)ctx)->live, grid, clock_seconds(CLOCK_MONOTONIC));
}

static void ask_for_group(solver *s)
{
    const packet question = {.kind = MESSAGE_ASK, .u.ask = {.what = ASK_GROUP}};
    if (!s->group_asked && !message_send(s->socket, &question, -1))
        _exit(1); /* the daemon is gone */
    s->group_asked = true;
}

/* The group's stream, or -1 and why there is none. */
static int hear_of_group(solver *s, int32_t *status)
{
    packet answer;
    int stream = -1;
    if (!message_receive(s->socket, &answer, &stream) || answer.kind != MESSAGE_ANSWER)
        _exit(1);
    s->group_asked = false;
    *status = answer.status;
    return stream;
}

/* The group of processes of this job. */
static uz_process_group *find_group(void *ctx, char *why, size_t size)
{
    solver *s = ctx;
    int32_t status;
    if (s->group)
        return s->group;
    ask_for_group(s);
    const int stream = hear_of_group(s, &status);
    if (status == STORE_NOT_FOUND)
        snprintf(why, size,
                 "this service has no group of processes to solve with. Its option --group-command configures one; or "
                 "ask for the operator matrix_free, or for auto");
    else
        snprintf(why, size,
                 "the group of processes could not be started, and the service's log has the cause. Ask for the "
                 "operator matrix_free, or for auto");
    return s->group = stream >= 0 ? uz_process_group_new(stream) : NULL;
}

/* It takes a while to start, while the body is assembled. What a start is loaded from is asked for meanwhile, and its
 * answers would come after the group's. */
static bool wants_group_soon(const codec_request *request)
{
    return request->settings.op == UZ_OPERATOR_DISTRIBUTED && !request->answer.u && !request->start.job[0];
}

/* Of a job that did not come to it. */
static void leave_group(solver *s)
{
    int32_t status;
    const int stream = s->group_asked ? hear_of_group(s, &status) : -1;
    if (stream >= 0)
        close(stream);
}

/* The names come before the news, and the news before the solve. */
static void note_request(void *ctx, const codec_request *request)
{
    solver *s = ctx;
    const uz_problem *problem = &request->problem;
    packet m = {.kind = MESSAGE_READ, .u.read = {.time_limit_s = request->settings.time_limit_s}};
    if (segment_reach(&s->outbox, (size_t)problem->n_cases * CASE_NAME, true)) {
        s->names = (size_t)problem->n_cases * CASE_NAME;
        m.u.read.n_cases = problem->n_cases;
        for (int64_t i = 0; i < problem->n_cases; i++)
            snprintf(s->outbox.at + i * CASE_NAME, CASE_NAME, "%s", problem->cases[i].name);
    }
    s->request = request;
    s->parse_s = clock_seconds(CLOCK_MONOTONIC) - s->given_at;
    live_begin(&s->live, &s->board->live, &request->settings, problem);
    message_send(s->socket, &m, -1);
    if (wants_group_soon(request))
        ask_for_group(s);
}

/* What there is of an answer lies in the outbox from now on, and what comes goes behind it: this process may be ended
 * at any instruction. Without memory for it there is none, as before. */
static void keep_answers(void *ctx, uz_result *const *results, int64_t n)
{
    solver *s = ctx;
    const starts from_zero = {.n = n}; /* a mesh that is chosen has no start */
    store_outcome outcome = {.status = JOB_SUCCESSFUL};
    packet kept = {.kind = MESSAGE_KEPT};
    answers built;
    if (answers_build(&built, &outcome, results, s->request, &from_zero, s->queue_s, s->parse_s)) {
        kept.u.done.at = s->names;
        kept.u.done.size = parcel_write(NULL, &outcome);
        kept.u.done.figures.parse = s->parse_s;
        solve_count(&kept.u.done.figures, results, n);
        if (segment_reach(&s->outbox, s->names + kept.u.done.size, true)) {
            parcel_write(s->outbox.at + s->names, &outcome);
            s->names += kept.u.done.size;
            message_send(s->socket, &kept, -1);
        }
    }
    answers_clear(&built);
}

/* ---- messages */

/* The text that came with a message; NULL: there is none, or no memory. */
static char *take_text(solver *s, const packet *m)
{
    const size_t size = (size_t)m->u.job.size;
    char *text = !m->u.job.damaged && segment_reach(&s->inbox, size, false) ? malloc(size + 1) : NULL;
    if (text) {
        memcpy(text, s->inbox.at, size);
        text[size] = '\0';
    }
    return text;
}

static void run_prediction(solver *s, const packet *m)
{
    const uz_hooks hooks = {.ctx = s, .cancelled = is_stopped};
    const solve_with with = {.source = s->source, .hooks = &hooks, .memory_limit = (size_t)m->u.job.memory};
    packet reply = {.kind = MESSAGE_PREDICTED};
    char *text = take_text(s, m);
    uz_process_threads(atomic_load(&s->board->threads));
    reply.u.predicted.known = text && solve_predict(&reply.u.predicted.cost, &with, text, (size_t)m->u.job.size);
    message_send(s->socket, &reply, -1);
}

static void run_job(solver *s, const packet *m)
{
    const uz_hooks hooks = {.ctx = s,
                            .cancelled = is_stopped,
                            .progress = note_progress,
                            .begins = note_case,
                            .grid = note_grid,
                            .keep = keep_answers,
                            .group = find_group};
    const solve_with with = {.source = s->source,
                             .cache = s->cache,
                             .hooks = &hooks,
                             .memory_limit = (size_t)m->u.job.memory,
                             .max_solve_s = m->u.job.max_solve_s,
                             .queue_s = m->u.job.queue_s,
                             .pace = m->u.job.pace,
                             .read = note_request};
    packet done = {.kind = MESSAGE_DONE};
    solution solved;
    char *body = take_text(s, m);
    s->names = 0;
    s->queue_s = m->u.job.queue_s;
    s->given_at = clock_seconds(CLOCK_MONOTONIC);
    uz_process_threads(atomic_load(&s->board->threads));
    if (body || m->u.job.damaged) {
        solve_job(&solved, &with, m->u.job.id, body, (size_t)m->u.job.size);
        leave_group(s);
        if (s->group && uz_process_group_is_lost(s->group))
            _exit(SOLVER_GROUP_LOST); /* the job is run again, as where this process had been lost */
        uz_process_group_free(s->group);
        s->group = NULL;
    } else {
        solved = (solution){.n = 0};
        solution_fail(&solved, NULL);
    }
    done.u.done.at = s->names;
    done.u.done.size = parcel_write(NULL, &solved.outcome);
    if (!segment_reach(&s->outbox, s->names + done.u.done.size, true)) {
        solution_fail(&solved, NULL); /* takes the place of the answer, and of what was kept */
        done.u.done.at = s->names = 0;
        done.u.done.size = parcel_write(NULL, &solved.outcome); /* that fits in any */
    }
    parcel_write(s->outbox.at + done.u.done.at, &solved.outcome);
    done.u.done.stopped = solved.stopped;
    done.u.done.start_lost = solved.start_lost;
    done.u.done.figures = solved.figures;
    if (!solved.figures.cached) {
        uz_cache_entry *entries = NULL;
        size_t count = 0;
        done.u.done.listed = uz_cache_list(s->cache, &entries, &count, NULL) == UZ_OK;
        done.u.done.cached = count;
        for (size_t i = 0; i < count; i++)
            done.u.done.held += entries[i].bytes;
        free(entries);
    }
    message_send(s->socket, &done, -1);
    solution_clear(&solved); /* while the daemon stores the answer */
    segment_rest(&s->inbox, SEGMENT_WARM, false);
    segment_rest(&s->outbox, SEGMENT_WARM, false);
    s->fresh = true;
}

/* ---- between jobs */

static size_t reserve_share(size_t cache_bytes)
{
    const size_t share = cache_bytes / RESERVE_SHARE;
    return share < RESERVE_MOST ? share : RESERVE_MOST;
}

/* What jobs need to know of the machine is measured, once, and memory for the next body touched while nobody waits for
 * it; memory is given back when no job has run for long. What is freed stays in the heap (memory_keep_heap): where
 * much lies free there, all of it goes back to the system; where little and a body may come, so much is touched now, in
 * huge pages. Returns the milliseconds until it is to be done again, -1: never. */
static int make_ready(solver *s)
{
    struct pollfd socket = {.fd = s->socket, .events = POLLIN};
    if (!s->fresh) {
        uz_reserve_empty(s->reserve);
        malloc_trim(0);
        return -1;
    }
    uz_process_measure();
    while (poll(&socket, 1, 0) == 0 && uz_reserve_fill(s->reserve))
        ;
    /* bodies are solved here, those without a factor in the heap */
    const bool large = uz_reserve_bytes(s->reserve) > 0 || uz_reserve_lent(s->reserve) > 0;
    const size_t share = reserve_share(s->cache_bytes) / 2, least = large ? share : 0;
    const struct mallinfo2 heap = mallinfo2();
    const bool known = heap.uordblks > 0; /* else it is another allocator, which tells nothing */
    void *block;
    if (known && heap.fordblks > HEAP_FREE + (large ? 4 * share : 0))
        malloc_trim(0);
    else if (known && heap.fordblks < least / 2 && (block = uz_malloc_huge(least)) != NULL) {
        for (size_t at = 0; at < least; at += SMALL_PAGE)
            ((volatile char *)block)[at] = 0;
        free(block);
    }
    s->fresh = false;
    return IDLE_MS;
}

static void serve(solver *s)
{
    struct pollfd socket = {.fd = s->socket, .events = POLLIN};
    packet m;
    for (int wait = SETTLE_MS;;) {
        if (poll(&socket, 1, wait) == 0) {
            wait = make_ready(s);
            continue;
        }
        if (!message_receive(s->socket, &m, NULL))
            return;
        if (m.kind == MESSAGE_JOB)
            run_job(s, &m);
        if (m.kind == MESSAGE_PREDICT)
            run_prediction(s, &m);
        if (m.kind == MESSAGE_LIST) {
            packet listed = {.kind = MESSAGE_LISTED};
            uz_cache_entry *entries = NULL;
            size_t count = 0;
            if (uz_cache_list(s->cache, &entries, &count, NULL) == UZ_OK && count > 0 &&
                segment_reach(&s->outbox, count * sizeof *entries, true)) {
                memcpy(s->outbox.at, entries, count * sizeof *entries);
                listed.u.listed.count = count;
            }
            free(entries);
            message_send(s->socket, &listed, -1);
        }
        wait = s->fresh ? SETTLE_MS : IDLE_MS;
    }
}

/* ---- beginning and end */

static atomic_bool *starved; /* on the board: a handler of signals has no context */

/* Not every library looks at what it was given. METIS raises SIGABRT where memory has ended, which is blocked here
 * (uz_thread_init), and goes on. */
static void note_fault(int number)
{
    const int error = errno;
    sigset_t pending;
    if (error == ENOMEM || (sigpending(&pending) == 0 && sigismember(&pending, SIGABRT)))
        atomic_store(starved, true);
    raise(number); /* once more, and now it ends the process */
}

int solver_process(int argc, char **argv)
{
    char why[128];
    solver s = {.socket = SOLVER_SOCKET, .fresh = true};
    int kind = 0;
    socklen_t len = sizeof kind;
    struct rlimit limit;
    const bool called = argc == SOLVER_ARGUMENTS && getsockopt(SOLVER_SOCKET, SOL_SOCKET, SO_TYPE, &kind, &len) == 0 &&
                        kind == SOCK_SEQPACKET;
    FILE *file = called ? fopen("/proc/self/oom_score_adj", "w") : NULL;
    if (file) { /* where memory ends, this process goes, not the daemon */
        fputs("900\n", file);
        fclose(file);
    }
    if (called && getrlimit(RLIMIT_FSIZE, &limit) == 0) { /* what it writes is memory */
        limit.rlim_cur = limit.rlim_max;
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    /* nobody is to outlive the daemon */
    if (called)
        prctl(PR_SET_NAME, "uzawad-solver", 0, 0, 0);
    if (!called || prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0) != 0 || getppid() != (pid_t)atol(argv[2])) {
        fputs("uzawad: " SOLVER_ROLE " is how uzawad starts itself\n", stderr);
        return 2;
    }
    s.cache_bytes = (size_t)strtoull(argv[3], NULL, 10);
    const size_t solve_bytes = (size_t)strtoull(argv[4], NULL, 10), reserved = reserve_share(s.cache_bytes);
    memory_keep_heap();
    uz_process_init(1);
    uz_thread_init();
    uz_process_warm();
    s.reserve = uz_reserve_new(s.cache_bytes - reserved, reserved);
    s.cache = uz_cache_new(s.cache_bytes - reserved);
    s.source = relay_open(s.socket, &s.inbox);
    const bool made = s.reserve && s.cache && s.source && codec_init(NULL, why, sizeof why) &&
                      segment_attach(&s.board_memory, SOLVER_BOARD) && s.board_memory.mapped >= sizeof *s.board &&
                      segment_attach(&s.inbox, SOLVER_INBOX) && segment_attach(&s.outbox, SOLVER_OUTBOX);
    if (made) {
        uz_process_reserve(s.reserve);
        s.board = (board *)(void *)s.board_memory.at;
        starved = &s.board->starved;
        if (!SANITIZED)
            sigaction(SIGSEGV, &(struct sigaction){.sa_handler = note_fault, .sa_flags = (int)SA_RESETHAND}, NULL);
        segment_rest(&s.inbox, SEGMENT_KEPT, false);
        segment_rest(&s.outbox, SEGMENT_KEPT, false);
        if (solve_bytes > 0 && solve_bytes < (SIZE_MAX - LIMIT_ROOM - s.cache_bytes) / 2)
            confine_memory(2 * solve_bytes + s.cache_bytes + LIMIT_ROOM);
        const packet ready = {.kind = MESSAGE_READY, .u.ready = {.confined = confine_process()}};
        if (message_send(s.socket, &ready, -1))
            serve(&s);
    }
    if (s.source)
        store_close(s.source);
    uz_cache_free(s.cache);
    uz_reserve_free(s.reserve);
    segment_close(&s.board_memory);
    segment_close(&s.inbox);
    segment_close(&s.outbox);
    codec_end();
    return made ? 0 : 1;
}
