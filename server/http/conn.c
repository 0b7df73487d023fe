#include "http/conn.h"
#include "http/negotiate.h"
#include "http/problem.h"
#include "http/uploads.h"

#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

/* Lingering after an early reply: long enough for the reply to cross the network. */
static const double LINGER_S = 2.0;

conn *conn_new(http_server *server, int fd, const struct sockaddr *address)
{
    conn *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->server = server;
    c->fd = fd;
    c->address_len = rate_address(address, c->address);
    atomic_fetch_add(&server->context.connections, 1);
    c->deadline = deadlines_add(server->deadlines, fd, deadlines_now() + server->options.request_deadline_s);
    if (!c->deadline) {
        atomic_fetch_sub(&server->context.connections, 1);
        free(c);
        return NULL;
    }
    return c;
}

static void request_free(conn *c)
{
    http_request *rq = c->request;
    c->request = NULL;
    if (!rq)
        return;
    atomic_fetch_sub(&c->server->context.body_bytes, rq->body_capacity);
    reply_clear(&rq->reply);
    store_upload_abort(rq->upload);
    target_clear(&rq->target);
    free(rq->raw_target);
    free(rq->body);
    free(rq);
}

void conn_free(conn *c)
{
    if (!c)
        return;
    deadline_remove(c->deadline);
    request_free(c);
    atomic_fetch_sub(&c->server->context.connections, 1);
    free(c);
}

void conn_begin_request(conn *c, const char *raw_target)
{
    request_free(c);
    http_request *rq = calloc(1, sizeof *rq);
    if (!rq)
        return;
    rq->raw_target = strdup(raw_target);
    if (!rq->raw_target) {
        free(rq);
        return;
    }
    rq->fd = c->fd;
    rq->started = deadlines_now();
    c->request = rq;
    c->layout = (framing_layout){.target = raw_target, .target_len = strlen(raw_target)};
    deadline_set(c->deadline, rq->started + c->server->options.request_deadline_s, !c->server->tls);
}

/* ------------------------------------------------------------------ reply */

/* Reads and drops what the client still sends, until it closes: closing a socket with unread bytes resets the
 * connection, and the reset can overtake the reply. */
static void linger(const conn *c)
{
    char dropped[16384];
    double end = deadlines_now() + LINGER_S;
    shutdown(c->fd, SHUT_WR);
    for (double left = LINGER_S; left > 0; left = end - deadlines_now()) {
        struct pollfd p = {.fd = c->fd, .events = POLLIN};
        if (poll(&p, 1, (int)(left * 1e3) + 1) <= 0 || recv(c->fd, dropped, sizeof dropped, MSG_DONTWAIT) <= 0)
            return;
    }
}

static void note_reply(http_request *rq, http_reply *reply)
{
    rq->status = reply->status;
    rq->reply_len = strcmp(rq->method, "HEAD") == 0 ? 0 : reply->len;
    memcpy(reply->request_id, rq->id, sizeof reply->request_id);
}

static bool send_reply(conn *c, struct MHD_Connection *mhd)
{
    http_reply *reply = &c->request->reply;
    note_reply(c->request, reply);
    double allowed = c->server->options.request_deadline_s + (double)reply->len / SLOWEST_RATE;
    deadline_set(c->deadline, reply->source.read ? INFINITY : deadlines_now() + allowed, false);
    return reply_send(mhd, reply);
}

/* Where libmicrohttpd takes no reply: writes it and closes the connection's sending side. */
static void send_directly(conn *c, const problem_details *problem)
{
    http_reply reply = {.close = true, .cors = c->request->reply.cors, .cors_origin = c->request->reply.cors_origin};
    reply_problem(&reply, problem);
    note_reply(c->request, &reply);
    char *message = c->server->tls ? NULL : reply_message(&reply); /* TLS: the close must say it */
    if (message && send(c->fd, message, strlen(message), MSG_NOSIGNAL | MSG_DONTWAIT) > 0)
        linger(c);
    free(message);
    reply_clear(&reply);
}

void conn_refuse(conn *c, int status)
{
    http_request *rq = c->request;
    problem_details problem;
    if (!rq || rq->status)
        return;
    if (status == 413 || status == 414 || status == 431)
        http_problem(&problem, status, "header_too_large", "The header is too large",
                     "request line and header fields together may have about %d bytes", CONNECTION_MEMORY / 2);
    else if (status >= 500)
        http_problem(&problem, status, "http_error", "The request could not be served", "try again later");
    else
        http_problem(&problem, status, "bad_request_framing", "The request is malformed or ambiguous",
                     "the header fields, the body's length or its chunks are malformed, or Host is missing");
    send_directly(c, &problem);
}

/* ----------------------------------------------------------------- headers */

static enum MHD_Result collect_header(void *ctx, enum MHD_ValueKind kind, const char *name, size_t name_len,
                                      const char *value, size_t value_len)
{
    header_list *list = ctx;
    (void)kind;
    if (list->count == HEADERS_MAX) {
        list->overflow = true;
        return MHD_NO;
    }
    list->fields[list->count++] = (header_field){name, value ? value : "", name_len, value ? value_len : 0};
    return MHD_YES;
}

static bool layout_is_sound(conn *c, struct MHD_Connection *mhd, const char *method, const char *version)
{
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    if (!c->server->check_layout)
        return true;
    c->layout.method = method;
    c->layout.version = version;
    c->layout.block_len = info ? info->header_size : 0;
    return framing_tiles(&c->layout, &c->request->headers);
}

/* The client's X-Request-Id where it is a word that a log can hold, else one of our own. */
static void name_request(http_server *server, http_request *rq)
{
    static const char ALLOWED[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:/+=@";
    const header_field *field = header_find(&rq->headers, "X-Request-Id", NULL);
    if (field && field->value_len > 0 && field->value_len < sizeof rq->id &&
        strspn(field->value, ALLOWED) >= field->value_len) {
        memcpy(rq->id, field->value, field->value_len);
        rq->id[field->value_len] = '\0';
        return;
    }
    unsigned long long number = (unsigned long long)atomic_fetch_add(&server->id, 1);
    snprintf(rq->id, sizeof rq->id, "%s%08llx", server->id_prefix, number);
}

/* False with rq->refused: the bytes can't be trusted, so nothing after them on this connection can. */
static bool read_framing(conn *c, struct MHD_Connection *mhd, const char *method, const char *version)
{
    http_request *rq = c->request;
    snprintf(rq->method, sizeof rq->method, "%s", method);
    MHD_get_connection_values_n(mhd, MHD_HEADER_KIND, collect_header, &rq->headers);
    name_request(c->server, rq);
    if (!framing_read(&rq->framing, version, &rq->headers, &rq->refused))
        return false;
    if (!layout_is_sound(c, mhd, method, version))
        return http_problem(&rq->refused, 400, "bad_request_framing", "The request is malformed or ambiguous",
                            "lines must end in CR LF, must not be folded, and must not contain NUL");
    return true;
}

static bool has_body(const http_request *rq)
{
    return rq->framing.chunked || rq->framing.length > 0;
}

bool conn_headers(conn *c, struct MHD_Connection *mhd, const char *method, const char *version)
{
    http_request *rq = c->request;
    rq->begun = true;
    bool framed = read_framing(c, mhd, method, version);
    cors_find(c->server, rq);
    if (framed && admit(c) && (!rq->route->streamed || uploads_begin(&c->server->context, rq))) {
        deadline_set(c->deadline,
                     rq->started + c->server->options.request_deadline_s + (double)rq->framing.length / SLOWEST_RATE,
                     !c->server->tls);
        return true;
    }
    if (framed && !has_body(rq))
        return true; /* answered in conn_answer, so that the connection can stay open */
    rq->unread_body = true;
    rq->reply.close = true;
    reply_problem(&rq->reply, &rq->refused);
    return send_reply(c, mhd);
}

/* -------------------------------------------------------------------- body */

/* Room for `more` bytes and a NUL, within the server's budget for all bodies. */
static bool reserve(conn *c, size_t more)
{
    http_request *rq = c->request;
    size_t need = rq->body_len + more + 1;
    if (need <= rq->body_capacity)
        return true;
    size_t capacity = need < 4096 ? 4096 : need + need / 2;
    size_t added = capacity - rq->body_capacity;
    if (atomic_fetch_add(&c->server->context.body_bytes, added) + added > c->server->body_budget) {
        atomic_fetch_sub(&c->server->context.body_bytes, added);
        return http_problem(&rq->refused, 503, "too_busy", "Too many large requests at once", "try again in a moment");
    }
    char *grown = realloc(rq->body, capacity);
    if (!grown) {
        atomic_fetch_sub(&c->server->context.body_bytes, added);
        return http_problem(&rq->refused, 503, "no_memory", "Out of memory", "try again later");
    }
    rq->body = grown;
    rq->body_capacity = capacity;
    return true;
}

static bool keep(conn *c, const char *data, size_t size)
{
    http_request *rq = c->request;
    if (!reserve(c, size))
        return false;
    memcpy(rq->body + rq->body_len, data, size);
    rq->body_len += size;
    rq->body[rq->body_len] = '\0';
    return true;
}

static bool pass_on(conn *c, const char *data, size_t size)
{
    http_request *rq = c->request;
    rq->body_len += size;
    return uploads_take(&c->server->context, rq, data, size);
}

bool conn_body(conn *c, const char *data, size_t size)
{
    http_request *rq = c->request;
    bool streamed = rq->route->streamed;
    size_t limit = streamed ? c->server->options.max_upload : c->server->options.max_body;
    if (size > limit - rq->body_len)
        http_problem(&rq->refused, 413, "body_too_large", "The request body is too large",
                     "the body has more than %zu bytes, the limit of this server", limit);
    else if (streamed ? pass_on(c, data, size) : keep(c, data, size)) {
        if (rq->framing.chunked) /* the length is not known before: the allowance grows with what has come */
            deadline_set(c->deadline,
                         rq->started + c->server->options.request_deadline_s + (double)rq->body_len / SLOWEST_RATE,
                         !c->server->tls);
        return true;
    }
    store_upload_abort(rq->upload);
    rq->upload = NULL;
    send_directly(c, &rq->refused);
    return false;
}

/* ------------------------------------------------------------------ answer */

bool conn_answer(conn *c, struct MHD_Connection *mhd)
{
    http_request *rq = c->request;
    deadline_set(c->deadline, INFINITY, false); /* the client has done its part */
    rq->reply.job = rq->job_id;
    if (rq->refused.status)
        reply_problem(&rq->reply, &rq->refused);
    else
        rq->route->handler(&c->server->context, rq, &rq->reply);
    negotiate(rq, &rq->reply);
    return send_reply(c, mhd);
}

static void log_request(conn *c, bool completed)
{
    const http_request *rq = c->request;
    char path[256];
    if (!c->server->options.access_log && rq->status < 500)
        return;
    snprintf(path, sizeof path, "%.*s", (int)strcspn(rq->raw_target, "?"), rq->raw_target);
    for (char *at = path; *at; at++)
        if ((unsigned char)*at < 0x20 || (unsigned char)*at > 0x7e)
            *at = '?';
    log_field fields[] = {LOG_S("method", rq->method),
                          LOG_S("path", path),
                          LOG_S("request", rq->id),
                          LOG_I("status", rq->status),
                          LOG_I("bytes", rq->reply_len),
                          LOG_N("seconds", deadlines_now() - rq->started),
                          LOG_S("job", rq->job_id),
                          LOG_S("token", rq->token),
                          LOG_S("end", completed                       ? "complete"
                                       : deadline_expired(c->deadline) ? "deadline"
                                                                       : "aborted"),
                          {0}};
    log_write(c->server->context.log, LOG_INFO, "request", fields);
}

void conn_end_request(conn *c, unsigned status, bool completed)
{
    if (!c->request)
        return;
    if (c->request->status == 0)
        c->request->status = (int)status;
    if (c->request->unread_body && completed)
        linger(c);
    log_request(c, completed);
    const route *found = c->request->route;
    metrics_request(c->server->context.metrics, found ? found->method : NULL, found ? found->pattern : NULL,
                    c->request->status, deadlines_now() - c->request->started);
    request_free(c);
    deadline_set(c->deadline, deadlines_now() + c->server->options.request_deadline_s, false);
}
