/* plot: pictures from the service, as SVG or, by way of rsvg-convert, as PNG. */
#include "commands/fetch.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* ------------------------------------------------------------------- PNG */

/* rsvg-convert between two pipes. Returns its pid, -1: no process. */
static pid_t start_converter(int *to, int *from)
{
    int in[2], out[2];
    if (pipe(in) != 0)
        return -1;
    if (pipe(out) != 0) {
        close(in[0]);
        close(in[1]);
        return -1;
    }
    pid_t pid = fork();
    if (pid == 0) {
        dup2(in[0], STDIN_FILENO);
        dup2(out[1], STDOUT_FILENO);
        close(in[1]);
        close(out[0]);
        execlp("rsvg-convert", "rsvg-convert", "--format=png", "--zoom=2", (char *)NULL);
        _exit(127);
    }
    close(in[0]);
    close(out[1]);
    *to = in[1];
    *from = out[0];
    return pid;
}

client_exit client_picture_to_png(client_session *s, const client_buffer *svg, client_buffer *png)
{
    int to, from, status = 0;
    struct sigaction ignore = {.sa_handler = SIG_IGN}, before;
    if (!svg->len)
        return client_complain(s, CLIENT_SERVER_ERROR, "the reply is empty");
    sigaction(SIGPIPE, &ignore, &before);
    pid_t pid = start_converter(&to, &from);
    if (pid >= 0) {
        /* Feeds and drinks at once, so that neither side waits for the other for ever. */
        size_t at = 0;
        for (bool more = true; more;) {
            struct pollfd ready[2] = {{.fd = from, .events = POLLIN}, {.fd = to, .events = POLLOUT}};
            if (poll(ready, 2, -1) < 0 && errno != EINTR)
                break;
            if (to >= 0 && ready[1].revents) {
                /* What the pipe takes, until all is written or nobody reads. */
                const ssize_t n = write(to, svg->data + at, svg->len - at < 4096 ? svg->len - at : 4096);
                at += n > 0 ? (size_t)n : 0;
                if ((n < 0 && errno != EINTR) || at == svg->len) {
                    close(to);
                    to = -1;
                }
            }
            if (ready[0].revents) {
                /* False: the end, or no memory. */
                char block[1 << 14];
                ssize_t n = read(from, block, sizeof block);
                more = n > 0 ? client_buffer_append(png, block, (size_t)n) : n < 0 && errno == EINTR;
            }
        }
        if (to >= 0)
            close(to);
        close(from);
    }
    sigaction(SIGPIPE, &before, NULL);
    while (pid >= 0 && waitpid(pid, &status, 0) < 0 && errno == EINTR)
        continue;
    if (pid >= 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0 && png->len)
        return CLIENT_OK;
    if (pid >= 0 && WIFEXITED(status) && WEXITSTATUS(status) == 127)
        return client_complain(
            s, CLIENT_LOCAL,
            "a PNG wants the program rsvg-convert (Debian: librsvg2-bin); a FILE that ends in .svg needs nothing");
    return client_complain(s, CLIENT_LOCAL, "rsvg-convert could not make a PNG of the picture");
}

/* ------------------------------------------------------------ the commands */

/* The picture at `path`, which it frees, as SVG, or as PNG where the file that it goes to is called so. */
static client_exit fetch_picture(client_session *s, char *path)
{
    const char *output = s->options->output;
    const bool as_png = output && strlen(output) > 4 && strcmp(output + strlen(output) - 4, ".png") == 0;
    client_reply reply;
    client_buffer png = {0};
    client_exit code = client_get(s, &reply, path, NULL);
    if (code == CLIENT_OK && as_png)
        code = client_picture_to_png(s, &reply.body, &png);
    const client_buffer *picture = as_png ? &png : &reply.body;
    if (code == CLIENT_OK)
        code = client_deliver(s, picture->data, picture->len);
    free(png.data);
    client_reply_clear(&reply);
    return code;
}

client_exit client_picture(client_session *s)
{
    const client_options *o = s->options;
    char width[24];
    snprintf(width, sizeof width, "%d", o->width);
    const client_query query[] = {{"case", o->case_name},
                                  {"colour", o->colour},
                                  {"factor", o->factor},
                                  {"view", o->view},
                                  {"up", o->up},
                                  {"width", o->width < 0 ? NULL : width},
                                  {NULL, NULL}};
    return fetch_picture(s, client_path_with_query(s, o->operand, "/deformed.svg", query));
}

static client_exit plot_trade(client_session *s)
{
    json_t *trade;
    const client_query query[] = {{"case", s->options->case_name}, {NULL, NULL}};
    client_exit code =
        client_get_json(s, &trade, client_path_with_query(s, s->options->operand, "/work-precision", query));
    if (code == CLIENT_OK && !json_is_array(json_object_get(trade, "decades")))
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply has no decades; is this the right server?");
    else if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, trade);
    else if (code == CLIENT_OK)
        client_draw_trade(s, trade);
    json_decref(trade);
    return code;
}

static client_exit plot_path(client_session *s)
{
    json_t *result;
    const client_query query[] = {{"fields", "summary"}, {NULL, NULL}};
    client_exit code = client_get_json(s, &result, client_path_with_query(s, s->options->operand, "/result", query));
    if (code == CLIENT_OK)
        code = client_draw_path(s, result);
    json_decref(result);
    return code;
}

client_exit client_plot(client_session *s)
{
    const client_options *o = s->options;
    char width[24];
    client_buffer with = {0};
    if (o->trade)
        return plot_trade(s);
    if (o->along_path)
        return plot_path(s);
    if (o->deformed)
        return client_picture(s);
    snprintf(width, sizeof width, "%d", o->width);
    if (!client_append_words(&with, &o->with)) {
        free(with.data);
        return client_complain(s, CLIENT_LOCAL, "no memory");
    }
    const client_query curves[] = {
        {"case", o->case_name}, {"x", o->axis}, {"with", with.len ? with.data : NULL}, {NULL, NULL}};
    const client_query errors[] = {{"case", o->case_name}, {"width", o->width < 0 ? NULL : width}, {NULL, NULL}};
    char *path = o->whole_error ? client_path_with_query(s, s->options->operand, "/whole-error.svg", errors)
                                : client_path_with_query(s, s->options->operand, "/convergence.svg", curves);
    free(with.data);
    return fetch_picture(s, path);
}
