#include "session/watch.h"

#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

static bool woken(void *ctx)
{
    client_watch *watch = ctx;
    struct signalfd_siginfo info;
    while (read(watch->http.fd, &info, sizeof info) == (ssize_t)sizeof info)
        watch->interrupted = watch->interrupted || info.ssi_signo == SIGINT;
    return watch->interrupted;
}

static void tick(void *ctx)
{
    const client_watch *watch = ctx;
    client_progress_redraw(watch->progress);
}

void client_watch_begin(client_watch *watch, client_http *http, client_progress *progress)
{
    struct sigaction now;
    sigset_t wanted;
    *watch = (client_watch){.http = {.fd = -1, .woken = woken, .tick = tick, .ctx = watch}, .progress = progress};
    sigemptyset(&wanted);
    sigaddset(&wanted, SIGWINCH);
    if (sigaction(SIGINT, NULL, &now) == 0 && now.sa_handler != SIG_IGN)
        sigaddset(&wanted, SIGINT);
    sigprocmask(SIG_BLOCK, &wanted, &watch->before);
    watch->http.fd = signalfd(-1, &wanted, SFD_NONBLOCK | SFD_CLOEXEC);
    if (watch->http.fd < 0) /* then the signals do what they always do */
        sigprocmask(SIG_SETMASK, &watch->before, NULL);
    client_http_set_watch(http, &watch->http);
}

void client_watch_end(client_watch *watch, client_http *http)
{
    client_http_set_watch(http, NULL);
    if (watch->http.fd < 0)
        return;
    close(watch->http.fd);
    watch->http.fd = -1;
    sigprocmask(SIG_SETMASK, &watch->before, NULL);
}
