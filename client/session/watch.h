/* watch.h: SIGINT and SIGWINCH as something to read, so that a wait ends or its line is drawn anew without a handler.
 */
#ifndef CLIENT_WATCH_H
#define CLIENT_WATCH_H

#include "service/http.h"
#include "show/progress.h"

#include <signal.h>

typedef struct {
    client_http_watch http;
    client_progress *progress;
    sigset_t before;
    bool interrupted;
} client_watch;

/* From here to client_watch_end the signals are blocked and requests of `http` look after them; `watch` and `progress`
 * must stay where they are. A SIGINT that was ignored (a shell's background job) stays so. */
void client_watch_begin(client_watch *watch, client_http *http, client_progress *progress);
void client_watch_end(client_watch *watch, client_http *http);

#endif
