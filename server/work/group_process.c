#include "work/group_process.h"
#include "base/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <spawn.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define PATIENT_S 2.0 /* mpirun ends its processes in less */

#define PROGRAM "uzawa-group"

enum { NAME = 48, COMMAND = 8192 };

/* An abstract socket with a name that nobody guesses. Who calls is asked for its user all the same. */
static int listen_at(char name[NAME])
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    uint64_t number[2];
    if (getrandom(number, sizeof number, 0) != sizeof number)
        return -1;
    snprintf(name, NAME, "@uzawa-%016llx%016llx", (unsigned long long)number[0], (unsigned long long)number[1]);
    memcpy(address.sun_path + 1, name + 1, strlen(name) - 1);
    const socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(name));
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd >= 0 && bind(fd, (const struct sockaddr *)&address, size) == 0 && listen(fd, 4) == 0)
        return fd;
    if (fd >= 0)
        close(fd);
    return -1;
}

/* The command with each {program} replaced: the one beside this program where there is one, else that of the path.
 * False: it is too long, or the folder's name is none that a shell takes as it stands. */
static bool fill_in(char out[COMMAND], const char *command, const char *name)
{
    static const char MARK[] = "{program}";
    char program[PATH_MAX + sizeof PROGRAM];
    const ssize_t length = readlink("/proc/self/exe", program, PATH_MAX);
    program[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(program, '/');
    strcpy(slash ? slash + 1 : program, PROGRAM);
    if (access(program, X_OK) != 0)
        strcpy(program, PROGRAM);
    if (strchr(program, '\''))
        return false;
    size_t used = 0;
    for (const char *at = command; *at && used < COMMAND;) {
        const bool marked = strncmp(at, MARK, sizeof MARK - 1) == 0;
        const int put = marked ? snprintf(out + used, COMMAND - used, "'%s' %s", program, name)
                               : snprintf(out + used, COMMAND - used, "%c", *at);
        used += (size_t)put;
        at += marked ? sizeof MARK - 1 : 1;
    }
    return used < COMMAND;
}

static int spawn(pid_t *pid, char *command)
{
    extern char **environ;
    char shell[] = "sh", flag[] = "-c";
    char *const argv[] = {shell, flag, command, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    int error = posix_spawn_file_actions_init(&actions);
    if (error)
        return error;
    error = posix_spawnattr_init(&attributes);
    if (!error) {
        posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDWR, 0);
        posix_spawn_file_actions_adddup2(&actions, 2, 1);
        posix_spawn_file_actions_addclosefrom_np(&actions, 3);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setsigdefault(&attributes, &all);
        error = posix_spawn(pid, "/bin/sh", &actions, &attributes, argv, environ);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

bool group_process_begin(group_process *g, const char *command, server_log *log)
{
    char name[NAME], filled[COMMAND];
    int error = 0;
    group_process_reap(g);
    const int fd = listen_at(name);
    if (fd < 0)
        error = errno;
    else if (!fill_in(filled, command, name))
        error = ENAMETOOLONG;
    else
        error = spawn(&g->pid, filled);
    if (!error) {
        g->listener = fd;
        return true;
    }
    g->pid = 0;
    if (fd >= 0)
        close(fd);
    log_write(log, LOG_ERROR, "group_not_started", (log_field[]){LOG_S("cause", strerror(error)), {0}});
    return false;
}

static void stop_listening(group_process *g)
{
    if (g->listener > 0)
        close(g->listener);
    g->listener = 0;
}

int group_process_accept(group_process *g)
{
    struct ucred who;
    socklen_t size = sizeof who;
    const int fd = accept4(g->listener, NULL, NULL, SOCK_CLOEXEC);
    if (fd >= 0 && getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size) == 0 && who.uid == geteuid()) {
        stop_listening(g);
        return fd;
    }
    if (fd >= 0)
        close(fd);
    return -1;
}

bool group_process_ended(group_process *g, int *status)
{
    if (g->pid <= 0 || waitpid(g->pid, status, WNOHANG) != g->pid)
        return false;
    kill(-g->pid, SIGKILL); /* what the command has left */
    g->pid = 0;
    stop_listening(g);
    return true;
}

void group_process_end(group_process *g)
{
    stop_listening(g);
    if (g->pid > 0)
        kill(-g->pid, SIGTERM);
}

void group_process_reap(group_process *g)
{
    const double until = clock_seconds(CLOCK_MONOTONIC) + PATIENT_S;
    int status;
    stop_listening(g);
    while (g->pid > 0 && !group_process_ended(g, &status) && clock_seconds(CLOCK_MONOTONIC) < until)
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
    if (g->pid <= 0 || group_process_ended(g, &status))
        return;
    kill(-g->pid, SIGKILL);
    while (waitpid(g->pid, &status, 0) < 0 && errno == EINTR)
        ;
    g->pid = 0;
}
