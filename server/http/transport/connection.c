/* connection.c: a connection's requests, from the first line to the end of the reply. */
#include "http/transport/connection.h"
#include "http/transport/message.h"
#include "http/transport/reading.h"

#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

/* Lingering after an early reply: long enough for the reply to cross the network. */
static const double LINGER_S = 2.0;
/* Time for a TLS handshake and the first line of a request. */
static const double HANDSHAKE_S = 5.0;
#define LOOK_MS 50 /* so soon it sees that the service ends */

static void drop_body(transport *server, http_request *rq)
{
    atomic_fetch_sub(&server->body_bytes, rq->body_capacity);
    free(rq->body);
    rq->body = NULL;
    rq->body_capacity = 0;
}

static void request_free(transport *server, http_request **place)
{
    http_request *rq = *place;
    if (!rq)
        return;
    drop_body(server, rq);
    reply_clear(&rq->reply);
    server->handlers.drop(server->handlers.ctx, rq);
    target_clear(&rq->target);
    free(rq->kept_fields);
    free(rq->raw_target);
    free(rq);
    *place = NULL;
}

connection *connection_of(struct MHD_Connection *mhd)
{
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return info ? info->socket_context : NULL;
}

void connection_notify(void *ctx, struct MHD_Connection *mhd, void **socket_context,
                       enum MHD_ConnectionNotificationCode code)
{
    transport *server = ctx;
    const bool begins = code == MHD_CONNECTION_NOTIFY_STARTED;
    /* each answer is read before the next question: in libmicrohttpd 1.0 all of them lie at the same place */
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
    const MHD_socket fd = info ? info->connect_fd : MHD_INVALID_SOCKET;
    connection *c = !begins ? *socket_context : info ? calloc(1, sizeof *c) : NULL;
    bool good = begins && c;
    if (good) {
        const union MHD_ConnectionInfo *from = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
        const double most_s = server->options.request_deadline_s,
                     patience_s = server->tls ? fmin(HANDSHAKE_S, most_s) : most_s;
        c->server = server;
        c->fd = fd;
        c->spare = server->next_is_spare;
        c->place = peer_begin(&server->peers, from ? from->client_addr : NULL);
        c->deadline = deadlines_add(server->deadlines, c->fd, clock_seconds(CLOCK_MONOTONIC) + patience_s, c, c->spare);
        atomic_fetch_add(&server->connections, 1);
        good = c->deadline && c->place;
    }
    if (c && !good) { /* it ends, or there is no memory for it: its requests are then refused */
        deadline_remove(c->deadline);
        request_free(server, &c->request);
        peer_end(c->place);
        atomic_fetch_sub(&server->refusing, c->refusing);
        atomic_fetch_sub(&server->connections, 1);
        free(c);
    }
    *socket_context = good ? c : NULL;
    const union MHD_ConnectionInfo *session =
        begins ? MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_GNUTLS_SESSION) : NULL;
    if (server->tls && session) { /* instead of those that libmicrohttpd keeps for all its life */
        pthread_mutex_lock(&server->tls_lock);
        gnutls_credentials_set(session->tls_session, GNUTLS_CRD_CERTIFICATE,
                               server->credentials[server->n_credentials - 1]);
        pthread_mutex_unlock(&server->tls_lock);
    }
}

void connection_begin_request(connection *c, const char *raw_target)
{
    request_free(c->server, &c->request);
    http_request *rq = calloc(1, sizeof *rq);
    if (!rq)
        return;
    rq->raw_target = strdup(raw_target);
    if (!rq->raw_target) {
        free(rq);
        return;
    }
    rq->server = c->server;
    rq->fd = c->fd;
    rq->address_len = c->place->len;
    memcpy(rq->address, c->place->address, c->place->len);
    rq->spare = c->spare;
    rq->reply.secure = c->server->tls;
    rq->started = clock_seconds(CLOCK_MONOTONIC);
    c->request = rq;
    c->layout = (framing_layout){.target = raw_target, .target_len = strlen(raw_target)};
    deadline_set(c->deadline, rq->started + c->server->options.request_deadline_s, DEADLINE_HEAD, !c->server->tls);
}

/* ------------------------------------------------------------------ reply */

/* Reads and drops what the client still sends, until it closes: closing a socket with unread bytes resets the
 * connection, and the reset can overtake the reply. */
static void linger(const connection *c)
{
    char dropped[16384];
    double end = clock_seconds(CLOCK_MONOTONIC) + LINGER_S;
    shutdown(c->fd, SHUT_WR);
    while (clock_seconds(CLOCK_MONOTONIC) < end && !atomic_load(&c->server->stopping)) {
        struct pollfd p = {.fd = c->fd, .events = POLLIN};
        int ready = poll(&p, 1, LOOK_MS);
        if (ready < 0 || (ready > 0 && recv(c->fd, dropped, sizeof dropped, MSG_DONTWAIT) <= 0))
            return;
    }
}

static bool send_reply(connection *c, struct MHD_Connection *mhd)
{
    http_reply *reply = &c->request->reply;
    request_note_reply(c->request);
    double allowed = c->server->options.request_deadline_s + (double)reply->len / SLOWEST_RATE;
    deadline_set(c->deadline, reply->source.read ? INFINITY : clock_seconds(CLOCK_MONOTONIC) + allowed, DEADLINE_SERVED,
                 false);
    return reply_send(mhd, reply);
}

/* Where libmicrohttpd takes no reply: writes it and closes the connection's sending side. */
static void send_directly(connection *c, const problem_details *problem)
{
    http_reply *reply = &c->request->reply, plain = {.cors = reply->cors, .cors_origin = reply->cors_origin};
    size_t len;
    plain.retry_after_s = reply->retry_after_s;
    reply_clear(reply);
    *reply = plain;
    reply->close = true;
    reply_problem(reply, problem);
    request_note_reply(c->request);
    char *message = c->server->tls ? NULL : reply_message(reply, false, &len); /* TLS: the close must say it */
    if (message && send(c->fd, message, len, MSG_NOSIGNAL | MSG_DONTWAIT) > 0)
        linger(c);
    free(message);
    reply_clear(reply);
}

static bool refuse_header(problem_details *problem, int status)
{
    return problem_fill(problem, status, "header_too_large", "The header is too large",
                        "request line and header fields together may have %d bytes", HEADER_BYTES);
}

void connection_refuse(connection *c, int status)
{
    problem_details problem;
    if (!c->request) /* its first line was not understood */
        connection_begin_request(c, "");
    http_request *rq = c->request;
    if (!rq || rq->status)
        return;
    if (!c->refusing)
        atomic_fetch_add(&c->server->refusing, 1);
    c->refusing = true;
    if (status == 413 && rq->begun)
        problem_fill(&problem, status, "body_too_large", "The request body is too large",
                     "a chunk of it says that it is larger than any body may be");
    else if (status == 413 || status == 414 || status == 431)
        refuse_header(&problem, status);
    else if (status >= 500 && rq->chunked)
        problem_fill(&problem, 400, "bad_request_framing", "The request is malformed or ambiguous",
                     "the line before a chunk is too long");
    else if (status >= 500)
        problem_fill(&problem, status, "http_error", "The request could not be served", "try again later");
    else
        problem_fill(&problem, status, "bad_request_framing", "The request is malformed or ambiguous",
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

static size_t header_size(struct MHD_Connection *mhd)
{
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    return info ? info->header_size : 0;
}

/* Sees the rest of a chunked body before libmicrohttpd does. */
static bool take_chunks(void *ctx, const char *data, size_t size)
{
    connection *c = ctx;
    if (chunks_follow(&c->chunks, data, size))
        return true;
    reading_watch(NULL, NULL);
    connection_refuse(c, 400);
    return false;
}

/* False with rq->refused: the bytes can't be trusted, so nothing after them on this connection can. */
static bool read_framing(connection *c, struct MHD_Connection *mhd, const char *method, const char *version)
{
    static const char ALLOWED[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:/+=@";
    http_request *rq = c->request;
    framing read;
    snprintf(rq->method, sizeof rq->method, "%s", method);
    MHD_get_connection_values_n(mhd, MHD_HEADER_KIND, collect_header, &rq->headers);
    /* the request's name: the client's X-Request-Id where it is a word that a log can hold, else one of our own */
    const header_field *name = header_find(&rq->headers, "X-Request-Id", NULL);
    if (name && name->value_len > 0 && name->value_len < sizeof rq->id &&
        strspn(name->value, ALLOWED) >= name->value_len)
        snprintf(rq->id, sizeof rq->id, "%.*s", (int)name->value_len, name->value);
    else
        snprintf(rq->id, sizeof rq->id, "%s%08llx", c->server->id_prefix,
                 (unsigned long long)atomic_fetch_add(&c->server->id, 1));
    const bool framed = framing_read(&read, version, &rq->headers, &rq->refused);
    rq->chunked = read.chunked;
    rq->length = read.length;
    if (!framed || !c->server->check_layout)
        return framed;
    c->layout.method = method;
    c->layout.version = version;
    c->layout.block_len = header_size(mhd);
    if (!framing_tiles(&c->layout, &rq->headers))
        return problem_fill(&rq->refused, 400, "bad_request_framing", "The request is malformed or ambiguous",
                            "lines must end in CR LF, must not be folded, and must not contain NUL");
    /* What was read last ends where libmicrohttpd's buffer does, unless all of this header block was read with the
     * request before: then the buffer has moved, and what was left there counts. */
    const reading_place last = reading_last();
    const char *body = method + c->layout.block_len;
    const bool fresh = last.total != c->read;
    const uint64_t rest = c->ahead > c->layout.block_len ? c->ahead - c->layout.block_len : 0;
    c->ahead = fresh ? (uint64_t)(last.end - body) : rest;
    c->read = last.total;
    c->chunks = (chunk_follower){.digits = 0};
    if (!rq->chunked)
        return true;
    reading_watch(take_chunks, c);
    return chunks_follow(&c->chunks, body, (size_t)c->ahead) ||
           problem_fill(&rq->refused, 400, "bad_request_framing", "The request is malformed or ambiguous",
                        "the chunks of the body are malformed: each line of theirs must end in CR LF");
}

bool connection_headers(connection *c, struct MHD_Connection *mhd, const char *method, const char *version)
{
    http_request *rq = c->request;
    const transport_options *options = &c->server->options;
    rq->begun = true;
    rq->can_be_held = c->server->holder && strcmp(version, "HTTP/1.1") == 0 && strcmp(method, "HEAD") != 0;
    bool framed = read_framing(c, mhd, method, version);
    /* what the reply says to pages of other origins */
    const header_field *origin = header_find(&rq->headers, "Origin", NULL);
    rq->reply.cors = options->n_cors > 0;
    for (size_t i = 0; origin && i < options->n_cors && !rq->reply.cors_origin; i++) {
        const char *one = options->cors[i];
        if (strcmp(one, "*") == 0 ||
            (strlen(one) == origin->value_len && memcmp(one, origin->value, origin->value_len) == 0))
            rq->reply.cors_origin = one;
    }
    if (header_size(mhd) > HEADER_BYTES) {
        framed = refuse_header(&rq->refused, 431);
        if (!c->server->tls) { /* libmicrohttpd may have no room for a reply */
            send_directly(c, &rq->refused);
            return false;
        }
    }
    if (framed && c->server->handlers.admit(c->server->handlers.ctx, rq)) {
        deadline_set(c->deadline, rq->started + options->request_deadline_s + (double)rq->length / SLOWEST_RATE,
                     DEADLINE_BODY, !c->server->tls);
        return true;
    }
    if (framed && !(rq->chunked || rq->length > 0))
        return true; /* answered in connection_answer, so that the connection can stay open */
    rq->unread_body = true;
    rq->reply.close = true;
    reply_problem(&rq->reply, &rq->refused);
    return send_reply(c, mhd);
}

/* -------------------------------------------------------------------- body */

bool connection_body(connection *c, const char *data, size_t size)
{
    http_request *rq = c->request;
    const transport_handlers *handlers = &c->server->handlers;
    const size_t need = rq->body_len + size + 1;
    bool taken = false;
    if (size > rq->body_limit - rq->body_len) {
        problem_fill(&rq->refused, 413, "body_too_large", "The request body is too large",
                     "the body has more than %zu bytes, the limit of this server", rq->body_limit);
    } else if (rq->streamed) {
        rq->body_len += size;
        taken = handlers->take(handlers->ctx, rq, data, size);
    } else if (need > rq->body_capacity) { /* more room, within the server's budget for all bodies */
        const size_t capacity = need < 4096 ? 4096 : need + need / 2, added = capacity - rq->body_capacity;
        const bool fits = atomic_fetch_add(&c->server->body_bytes, added) + added <= c->server->options.body_budget;
        char *grown = fits ? realloc(rq->body, capacity) : NULL;
        taken = grown != NULL;
        if (taken) {
            rq->body = grown;
            rq->body_capacity = capacity;
        } else {
            atomic_fetch_sub(&c->server->body_bytes, added);
            rq->reply.retry_after_s = fits ? rq->reply.retry_after_s : 5;
            problem_fill(&rq->refused, 503, fits ? "no_memory" : "too_busy",
                         fits ? "Out of memory" : "Too many large requests at once",
                         fits ? "try again later" : "try again in a moment");
        }
    } else {
        taken = true;
    }
    if (taken && !rq->streamed) { /* with a NUL behind it */
        memcpy(rq->body + rq->body_len, data, size);
        rq->body_len += size;
        rq->body[rq->body_len] = '\0';
    }
    if (taken) {
        if (rq->chunked) /* the length is not known before: the allowance grows with what has come */
            deadline_set(c->deadline,
                         rq->started + c->server->options.request_deadline_s + (double)rq->body_len / SLOWEST_RATE,
                         DEADLINE_BODY, !c->server->tls);
        return true;
    }
    handlers->drop(handlers->ctx, rq);
    send_directly(c, &rq->refused);
    return false;
}

/* ------------------------------------------------------------------ answer */

bool connection_answer(connection *c, struct MHD_Connection *mhd)
{
    http_request *rq = c->request;
    deadline_set(c->deadline, INFINITY, DEADLINE_SERVED, false); /* the client has done its part */
    rq->reply.job = rq->job_id;
    if (rq->refused.status)
        reply_problem(&rq->reply, &rq->refused);
    else
        c->server->handlers.answer(c->server->handlers.ctx, rq);
    const reply_source source = rq->reply.source;
    if (source.read)
        drop_body(c->server, rq); /* what takes long is not beside it */
    if (source.read && source.held && rq->can_be_held && request_keep_fields(rq)) {
        /* The reply goes on without libmicrohttpd, whose connection then ends; or nothing has happened. */
        char *head = NULL;
        size_t len;
        if (!source.is_message) {
            request_note_reply(rq);
            rq->reply.close = true;
            head = reply_message(&rq->reply, true, &len);
        }
        rq->reply.source.read = NULL;
        rq->place = c->place;
        if ((source.is_message || head) &&
            holder_take(c->server->holder, c->fd, rq, head, !source.is_message, &source)) {
            c->place = NULL;
            c->request = NULL;
            return false;
        }
        rq->reply.source = source;
        rq->reply.close = false;
        rq->place = NULL;
        free(head);
    }
    if (source.read && source.is_message) {
        /* the thread stays: the reply that was to come as a message is waited for here */
        rq->reply.source.read = NULL;
        source.answer(source.ctx);
        source.free(source.ctx);
    }
    negotiate(rq, &rq->reply);
    return send_reply(c, mhd);
}

void connection_end_held(void *ctx, http_request *rq, bool completed)
{
    transport *server = ctx;
    server->handlers.account(server->handlers.ctx, rq, completed, false);
    peer_end(rq->place);
    request_free(server, &rq);
}

void connection_completed(void *ctx, struct MHD_Connection *mhd, void **request_context,
                          enum MHD_RequestTerminationCode code)
{
    const bool completed = code == MHD_REQUEST_TERMINATED_COMPLETED_OK;
    connection *c = connection_of(mhd);
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_HTTP_STATUS);
    (void)ctx;
    (void)request_context;
    if (!c || !c->request)
        return;
    if (c->request->status == 0 && info) /* of the reply that libmicrohttpd made by itself */
        c->request->status = (int)info->http_status;
    if (c->request->unread_body && completed)
        linger(c);
    c->server->handlers.account(c->server->handlers.ctx, c->request, completed, deadline_expired(c->deadline));
    const uint64_t total = reading_last().total, came = c->ahead + (total - c->read);
    const uint64_t rest = c->request->chunked ? c->chunks.beyond : came - c->request->length;
    c->ahead = rest <= came ? rest : 0;
    c->read = total;
    reading_watch(NULL, NULL);
    request_free(c->server, &c->request);
    deadline_set(c->deadline, clock_seconds(CLOCK_MONOTONIC) + c->server->options.request_deadline_s, DEADLINE_IDLE,
                 false);
}
