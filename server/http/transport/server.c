/* server.c: libmicrohttpd's callbacks and the life of a connection.
 *
 * A connection has at most one request at a time. The request is made when its first line has come (on_target), looked
 * at when its header block has come (connection_headers), fed with its body (connection_body), answered
 * (connection_answer) and ended (connection_completed). All of this happens in the connection's own thread; a reply
 * that then only waits leaves both (held.h). */
#include "http/transport/connection.h"
#include "http/transport/message.h"
#include "http/transport/reading.h"

#include <errno.h>
#include <netdb.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

static const double WARN_EVERY_S = 10.0;

/* Says, now and then, that there are too many connections, and from where the last one was that had to go. */
static void warn_of_crowd(transport *server, const struct sockaddr *from)
{
    const double now = clock_seconds(CLOCK_MONOTONIC);
    char name[64] = "";
    if (server->warned > 0 && now < server->warned + WARN_EVERY_S)
        return;
    server->warned = now;
    const socklen_t len = from->sa_family == AF_INET6 ? sizeof(struct sockaddr_in6)
                                                      : sizeof(struct sockaddr_in); /* else a name stays "" */
    getnameinfo(from, len, name, sizeof name, NULL, 0, NI_NUMERICHOST);
    log_write(server->options.log, LOG_WARN, "too_many_connections",
              (log_field[]){LOG_S("address", name),
                            LOG_I("of_this_address", peers_count(&server->peers, from)),
                            LOG_I("connections", peers_count(&server->peers, NULL)),
                            LOG_I("max_connections", server->options.max_connections),
                            LOG_I("max_client_connections", server->options.max_client_connections),
                            LOG_I("cut", server->cut),
                            LOG_I("refused", server->refused),
                            {0}});
    server->cut = server->refused = 0;
}

/* So long the next connection waits at most until one that was cut has gone. */
static const double CUT_S = 0.2;

/* Where there are as many connections as may be, one goes that waits for a request: those of which a header block has
 * begun and not ended first, since nobody loses anything by them. libmicrohttpd's own limits know only the connections
 * that it still has. */
static enum MHD_Result on_accept(void *ctx, const struct sockaddr *address, socklen_t len)
{
    transport *server = ctx;
    const transport_options *options = &server->options;
    struct sockaddr_storage from;
    (void)len;
    size_t count = peers_count(&server->peers, NULL);
    server->next_is_spare = false;
    if (options->max_client_connections > 0 &&
        peers_count(&server->peers, address) >= options->max_client_connections) {
        server->refused++;
        warn_of_crowd(server, address);
        return MHD_NO;
    }
    if (count < options->max_connections)
        return MHD_YES;
    bool spare = true;
    const bool made = deadlines_make_room(server->deadlines, &from, &spare);
    /* One that was cut is counted until its thread has seen it, which takes a while where the processors are busy. */
    const double until = clock_seconds(CLOCK_MONOTONIC) + CUT_S;
    while (made && count >= options->max_connections + SPARE_CONNECTIONS && clock_seconds(CLOCK_MONOTONIC) < until) {
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        count = peers_count(&server->peers, NULL);
    }
    const bool room = count < options->max_connections + SPARE_CONNECTIONS;
    server->next_is_spare = spare;
    server->cut += made;
    server->refused += !room;
    warn_of_crowd(server, made ? (struct sockaddr *)&from : address);
    return room ? MHD_YES : MHD_NO;
}

/* The first line has come; `raw` is still as received. What is returned becomes *request_context below. */
static void *on_target(void *ctx, const char *raw, struct MHD_Connection *mhd)
{
    transport *server = ctx;
    connection *c = connection_of(mhd);
    if (c)
        connection_begin_request(c, raw);
    pthread_setspecific(server->current, c);
    return NULL;
}

static enum MHD_Result on_request(void *ctx, struct MHD_Connection *mhd, const char *url, const char *method,
                                  const char *version, const char *data, size_t *size, void **request_context)
{
    (void)ctx;
    (void)url;
    (void)request_context;
    connection *c = connection_of(mhd);
    if (!c || !c->request)
        return MHD_NO; /* no memory for it: libmicrohttpd closes the connection */
    bool ok;
    if (!c->request->begun) {
        ok = connection_headers(c, mhd, method, version);
    } else if (*size > 0) {
        ok = connection_body(c, data, *size);
        *size = 0;
    } else {
        ok = connection_answer(c, mhd);
    }
    return ok ? MHD_YES : MHD_NO;
}

/* libmicrohttpd's messages, from the thread they are about. What it refuses by itself (a header block without end, a
 * malformed length or chunk) it answers in HTML, in some cases with the head written twice; this message comes before
 * that answer, so ours is sent first and the connection is closed for writing. */
__attribute__((format(printf, 2, 0))) static void on_message(void *ctx, const char *format, va_list args)
{
    transport *server = ctx;
    char text[512];
    vsnprintf(text, sizeof text, format, args);
    text[strcspn(text, "\n")] = '\0';
    log_write(server->options.log, LOG_DEBUG, "http_message", (log_field[]){LOG_S("message", text), {0}});
    connection *c = pthread_getspecific(server->current);
    const char *code = strstr(text, "HTTP response code is ");
    if (!c && code) /* of the first request on a connection, before its first line is understood */
        c = deadlines_owner(server->deadlines, reading_last().fd);
    if (c && code)
        connection_refuse(c, atoi(code + strlen("HTTP response code is ")));
}

/* What a client reads whose request was not complete in time. */
static char *make_last_words(double deadline_s)
{
    http_reply reply = {.close = true};
    reply_refuse(&reply, 408, "request_timeout", "The request took too long",
                 "a request must be complete within %g s, plus the time its body needs at 100 kB/s", deadline_s);
    size_t len;
    char *text = reply_message(&reply, false, &len);
    reply_clear(&reply);
    return text;
}

/* TLS 1.3 and 1.2 with forward secrecy and authenticated encryption only (RFC 9325, section 4). */
static const char TLS_PRIORITIES[] =
    "NORMAL:-VERS-ALL:+VERS-TLS1.3:+VERS-TLS1.2:-KX-ALL:+ECDHE-ECDSA:+ECDHE-RSA:-CIPHER-ALL:+AES-256-GCM:"
    "+CHACHA20-POLY1305:+AES-128-GCM:-MAC-ALL:+AEAD:-SIGN-RSA-SHA1:-SIGN-ECDSA-SHA1:%SERVER_PRECEDENCE";

static struct MHD_Daemon *start_daemon(transport *server, int listen_fd, const transport_options *options)
{
    /* The watch over deadlines is exact; this one only backs it up, and must not end a long poll. */
    unsigned idle_s = (unsigned)(options->max_wait_s + 2 * options->request_deadline_s + 60);
    struct MHD_OptionItem items[] = {
        {MHD_OPTION_LISTEN_SOCKET, listen_fd, NULL},
        {MHD_OPTION_CONNECTION_LIMIT, (intptr_t)options->max_connections + SPARE_CONNECTIONS, NULL},
        {MHD_OPTION_CONNECTION_MEMORY_LIMIT, CONNECTION_MEMORY, NULL},
        {MHD_OPTION_CONNECTION_TIMEOUT, (intptr_t)idle_s, NULL},
        {MHD_OPTION_STRICT_FOR_CLIENT, 1, NULL},
        {MHD_OPTION_SIGPIPE_HANDLED_BY_APP, 1, NULL},
        {MHD_OPTION_NOTIFY_COMPLETED, (intptr_t)connection_completed, server},
        {MHD_OPTION_NOTIFY_CONNECTION, (intptr_t)connection_notify, server},
        {MHD_OPTION_URI_LOG_CALLBACK, (intptr_t)on_target, server},
        {server->tls ? MHD_OPTION_HTTPS_MEM_CERT : MHD_OPTION_END, 0, server->tls ? options->tls->cert : NULL},
        {MHD_OPTION_HTTPS_MEM_KEY, 0, server->tls ? options->tls->key : NULL},
        {MHD_OPTION_HTTPS_PRIORITIES, 0, server->tls ? (void *)(uintptr_t)TLS_PRIORITIES : NULL},
        {MHD_OPTION_END, 0, NULL},
    };
    unsigned tls = server->tls ? MHD_USE_TLS : 0;
    return MHD_start_daemon(MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_THREAD_PER_CONNECTION | MHD_USE_POLL |
                                MHD_USE_ITC | MHD_USE_ERROR_LOG | tls,
                            0, on_accept, server, on_request, server, MHD_OPTION_EXTERNAL_LOGGER, on_message, server,
                            MHD_OPTION_ARRAY, items, MHD_OPTION_END);
}

bool transport_use_tls(transport *server, const http_tls *tls, char *message, size_t size)
{
    gnutls_certificate_credentials_t fresh;
    if (!http_tls_load(&fresh, tls, message, size))
        return false;
    pthread_mutex_lock(&server->tls_lock);
    gnutls_certificate_credentials_t *grown = realloc(server->credentials, (server->n_credentials + 1) * sizeof *grown);
    if (grown) {
        server->credentials = grown;
        grown[server->n_credentials++] = fresh;
    }
    pthread_mutex_unlock(&server->tls_lock);
    if (grown)
        return true;
    gnutls_certificate_free_credentials(fresh);
    snprintf(message, size, "no memory for a certificate");
    return false;
}

/* When nobody adds a connection any more. */
static void free_server(transport *server)
{
    holder_free(server->holder);
    deadlines_free(server->deadlines);
    pthread_mutex_destroy(&server->peers.lock);
    for (size_t i = 0; i < server->n_credentials; i++)
        gnutls_certificate_free_credentials(server->credentials[i]);
    free(server->credentials);
    pthread_mutex_destroy(&server->tls_lock);
    free(server);
}

bool transport_start(transport **out, int listen_fd, const transport_handlers *handlers,
                     const transport_options *options, char *message, size_t size)
{
    char *words = make_last_words(options->request_deadline_s);
    transport *server = calloc(1, sizeof *server);
    bool has_key = false;
    if (!server || !words)
        goto fail;
    server->handlers = *handlers;
    server->options = *options;
    server->tls = options->tls != NULL;
    pthread_mutex_init(&server->tls_lock, NULL);
    pthread_mutex_init(&server->peers.lock, NULL);
    atomic_init(&server->id, 0);
    atomic_init(&server->connections, 0);
    atomic_init(&server->refusing, 0);
    atomic_init(&server->streams, 0);
    atomic_init(&server->body_bytes, 0);
    atomic_init(&server->draining, false);
    atomic_init(&server->stopping, false);
    uint64_t random = 0;
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random)
        random = (uint64_t)(clock_seconds(CLOCK_MONOTONIC) * 1e9);
    snprintf(server->id_prefix, sizeof server->id_prefix, "%016llx", (unsigned long long)random);
    /* The tiling of a header block is how 0.9.x parses; later versions refuse by themselves what it finds. */
    server->check_layout = strncmp(MHD_get_version(), "0.9.", 4) == 0;
    if (pthread_key_create(&server->current, NULL) != 0)
        goto fail;
    has_key = true;
    server->deadlines = deadlines_new(words);
    if (!server->deadlines)
        goto fail;
    if (server->tls && !transport_use_tls(server, options->tls, message, size))
        goto fail;
    if (!server->tls && !(server->holder = holder_new(options->request_deadline_s, connection_end_held, server)))
        goto fail;
    *out = server;
    server->daemon = start_daemon(server, listen_fd, options);
    if (!server->daemon)
        goto fail;
    free(words);
    return true;
fail:
    *out = NULL;
    snprintf(message, size, "cannot start the HTTP server: %s", errno ? strerror(errno) : "out of memory");
    if (has_key)
        pthread_key_delete(server->current);
    if (server)
        free_server(server);
    free(words);
    close(listen_fd);
    return false;
}

void transport_drain(transport *server)
{
    atomic_store(&server->draining, true);
    feed_wake_all(server->options.feed); /* those who wait there see it */
}

const atomic_bool *transport_draining(const transport *server)
{
    return &server->draining;
}

transport_counts transport_count(transport *server)
{
    return (transport_counts){.connections = (unsigned)peers_count(&server->peers, NULL),
                              .streams = atomic_load(&server->streams),
                              .body_bytes = atomic_load(&server->body_bytes)};
}

static const double REPLY_S = 0.5, REFUSE_S = 5.0;

void transport_stop(transport *server)
{
    if (!server)
        return;
    transport_drain(server); /* event streams end */
    atomic_store(&server->stopping, true);
    MHD_socket listening = MHD_quiesce_daemon(server->daemon);
    /* Nothing more is heard, and what is being said gets a moment. libmicrohttpd 0.9.75 must not be stopped while it
     * refuses a request by itself: MHD_queue_response then takes no reply but says that it did, and the reply that is
     * not there is read (transmit_error_response_len). */
    double begun = clock_seconds(CLOCK_MONOTONIC), spent = 0.0;
    deadlines_hear_no_more(server->deadlines);
    while (atomic_load(&server->connections) > 0 &&
           (spent < REPLY_S || (atomic_load(&server->refusing) > 0 && spent < REFUSE_S))) {
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
        spent = clock_seconds(CLOCK_MONOTONIC) - begun;
    }
    MHD_stop_daemon(server->daemon);
    if (listening != MHD_INVALID_SOCKET)
        close(listening);
    pthread_key_delete(server->current);
    free_server(server);
}
