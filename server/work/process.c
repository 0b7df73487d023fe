#include "work/process.h"
#include "base/clock.h"
#include "work/solver_process.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define END_S 1.0 /* a process that is idle gets so long to end by itself */

#define ABOVE 32 /* descriptors that are handed over come from above all numbers that the process gives them */

bool process_make(process *p, const char *program, size_t cache_bytes, size_t solve_bytes, server_log *log)
{
    *p = (process){.program = program ? program : "/proc/self/exe",
                   .cache_bytes = cache_bytes,
                   .solve_bytes = solve_bytes,
                   .log = log,
                   .socket = -1};
    if (!segment_make(&p->board_memory, sizeof *p->board) || !segment_make(&p->inbox, 0) ||
        !segment_make(&p->outbox, 0))
        return false;
    p->board = (board *)(void *)p->board_memory.at;
    live_reset(&p->board->live);
    return true;
}

static void forget(process *p)
{
    if (p->socket >= 0)
        close(p->socket);
    p->socket = -1;
    p->ready = false;
}

void process_free(process *p)
{
    bool out_of_memory;
    if (p->pid > 0) { /* it may end by itself, where it is idle */
        const double until = clock_seconds(CLOCK_MONOTONIC) + END_S;
        siginfo_t info = {.si_pid = 0};
        forget(p); /* it sees that */
        while (clock_seconds(CLOCK_MONOTONIC) < until &&
               waitid(P_PID, (id_t)p->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0)
            nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
        if (info.si_pid == 0)
            kill(p->pid, SIGKILL);
        process_reap(p, &out_of_memory);
    }
    group_process_end(&p->group);
    group_process_reap(&p->group);
    segment_close(&p->board_memory);
    segment_close(&p->inbox);
    segment_close(&p->outbox);
    free(p->entries);
    p->entries = NULL;
}

/* How often a process was killed on this machine because memory had ended; 0 where nobody says. */
static int64_t count_oom_kills(void)
{
    char line[128];
    long long count = 0;
    FILE *file = fopen("/proc/vmstat", "re");
    while (file && fgets(line, sizeof line, file) && sscanf(line, "oom_kill %lld", &count) != 1)
        ;
    if (file)
        fclose(file);
    return count;
}

/* ---- beginning */

/* The program again, with standard error and what is shared, and nothing else that is open here. */
static int spawn(process *p, int socket)
{
    extern char **environ;
    char daemon[32], cache[32], solve[32], name[] = "uzawad", role[] = SOLVER_ROLE;
    char *const argv[SOLVER_ARGUMENTS + 1] = {name, role, daemon, cache, solve, NULL};
    const int given[] = {socket, p->board_memory.fd, p->inbox.fd, p->outbox.fd};
    enum { N = sizeof given / sizeof given[0] };
    int high[N], error = 0;
    posix_spawn_file_actions_t actions;
    snprintf(daemon, sizeof daemon, "%ld", (long)getpid());
    snprintf(cache, sizeof cache, "%zu", p->cache_bytes);
    snprintf(solve, sizeof solve, "%zu", p->solve_bytes);
    if ((error = posix_spawn_file_actions_init(&actions)) != 0)
        return error;
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDWR, 0);
    posix_spawn_file_actions_adddup2(&actions, 0, 1);
    for (int i = 0; i < N; i++) {
        high[i] = fcntl(given[i], F_DUPFD_CLOEXEC, ABOVE);
        if (high[i] < 0)
            error = errno;
        else
            error = error ? error : posix_spawn_file_actions_adddup2(&actions, high[i], SOLVER_SOCKET + i);
    }
    if (!error)
        error = posix_spawn_file_actions_addclosefrom_np(&actions, SOLVER_SOCKET + N);
    if (!error) /* signals are blocked there as in this thread: its caller */
        error = posix_spawn(&p->pid, p->program, &actions, NULL, argv, environ);
    for (int i = 0; i < N; i++)
        if (high[i] >= 0)
            close(high[i]);
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

bool process_begin(process *p)
{
    int ends[2], error = 0;
    bool out_of_memory;
    /* One that ended while nobody looked is found by its end of the socket. */
    struct pollfd peer = {.fd = p->socket, .events = POLLRDHUP};
    if (p->pid != 0 && p->socket >= 0 && poll(&peer, 1, 0) >= 0 && !(peer.revents & (POLLRDHUP | POLLHUP | POLLERR)))
        return true;
    if (p->pid > 0)
        process_reap(p, &out_of_memory);
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        error = errno;
    } else {
        p->oom_kills = count_oom_kills();
        atomic_store(&p->board->starved, false);
        error = spawn(p, ends[1]);
        close(ends[1]);
        p->socket = ends[0];
    }
    if (!error)
        return true;
    p->pid = 0;
    forget(p);
    log_write(p->log, LOG_ERROR, "process_not_started", (log_field[]){LOG_S("cause", strerror(error)), {0}});
    return false;
}

/* ---- end */

void process_kill(process *p)
{
    if (p->pid > 0)
        kill(p->pid, SIGKILL);
    forget(p);
    group_process_end(&p->group);
}

int process_reap(process *p, bool *out_of_memory)
{
    int status = 0;
    *out_of_memory = false;
    if (p->pid > 0) {
        while (waitpid(p->pid, &status, 0) < 0 && errno == EINTR)
            ;
        const int killer = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
        *out_of_memory = (killer == SIGKILL && count_oom_kills() > p->oom_kills) ||
                         (killer == SIGSEGV && atomic_load(&p->board->starved));
    }
    p->pid = 0;
    forget(p);
    segment_rest(&p->outbox, SEGMENT_KEPT, true);
    return status;
}

/* ---- which process has a body */

uint64_t process_body(const char *text, size_t len)
{
    static const char *const OTHER[] = {"loads", "p", "h", "N", "contacts", "candidates", "kinematics", "units"};
    uint64_t hash = 0xcbf29ce484222325u, before = hash; /* FNV-1a, and before the last string began */
    size_t begin = 0, end = 0;                          /* of the last string */
    int depth = 0;
    bool within = false, quoted = false, passed = false;
    for (size_t i = 0; i < len; i++) {
        const char c = text[i];
        if (quoted) {
            i += c == '\\';
            quoted = c != '"';
            end = i;
        } else if (c == '"') {
            quoted = true;
            begin = i + 1;
            before = hash;
        } else if (c == '{' || c == '[') {
            depth++;
        } else if (c == '}' || c == ']') {
            depth--;
        } else if (c == ',' && depth <= 2) {
            passed = false;
            within = within && depth > 1;
            continue; /* between members: whether one of OTHER is there at all makes no difference */
        } else if (c == ':' && depth == 1) {
            within = end - begin == 7 && memcmp(text + begin, "problem", 7) == 0;
        } else if (c == ':' && depth == 2 && within) {
            for (size_t k = 0; k < sizeof OTHER / sizeof OTHER[0]; k++)
                passed =
                    passed || (end - begin == strlen(OTHER[k]) && memcmp(text + begin, OTHER[k], end - begin) == 0);
            hash = passed ? before : hash;
        } else if (c == ' ' || c == '\n' || c == '\t' || c == '\r') {
            continue;
        }
        if (within && !passed && depth > 1)
            hash = (hash ^ (unsigned char)c) * 0x100000001b3u;
    }
    return hash ? hash : 1;
}
