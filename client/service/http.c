#include "service/http.h"

#include <curl/curl.h>
#include <math.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#define CONNECT_LIMIT_MS 10000L
#define TICK_MS          250

struct client_http {
    CURL *curl;
    CURLM *multi; /* so that a request can be left when something else happens */
    const client_http_watch *watch;
    char *base; /* server URL without a trailing '/' */
    const char *token, *ca_file;
    char curl_says[CURL_ERROR_SIZE];
};

double client_clock(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

bool client_http_append_escaped(client_buffer *to, const char *text)
{
    static const char HEX[] = "0123456789ABCDEF";
    static const char PLAIN[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~";
    bool ok = true;
    for (; ok && *text; text++) {
        unsigned char byte = (unsigned char)*text;
        char escaped[3] = {'%', HEX[byte >> 4], HEX[byte & 15]};
        ok = strchr(PLAIN, byte) ? client_buffer_append(to, text, 1) : client_buffer_append(to, escaped, 3);
    }
    return ok;
}

void client_reply_clear(client_reply *reply)
{
    free(reply->body.data);
    *reply = (client_reply){0};
}

client_http *client_http_open(const char *server, const char *token, const char *ca_file, char *message, size_t size)
{
    char *scheme = NULL, *host = NULL;
    CURLU *url = curl_url();
    bool ok = url && curl_url_set(url, CURLUPART_URL, server, 0) == CURLUE_OK &&
              curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) == CURLUE_OK &&
              curl_url_get(url, CURLUPART_HOST, &host, 0) == CURLUE_OK &&
              (strcmp(scheme, "http") == 0 || strcmp(scheme, "https") == 0) && !strpbrk(server, "?#");
    /* A proxy from the environment is left out: nobody means one for this machine. */
    const bool direct =
        ok && (strcasecmp(host, "localhost") == 0 || strncmp(host, "127.", 4) == 0 || strcmp(host, "[::1]") == 0);
    curl_free(scheme);
    curl_free(host);
    curl_url_cleanup(url);
    if (!ok) {
        snprintf(message, size, "the server must be a URL like http://host:8080, not \"%s\"", server);
        return NULL;
    }
    client_http *http = calloc(1, sizeof *http);
    if (http && curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) {
        free(http);
        http = NULL;
    }
    if (!http) {
        snprintf(message, size, "no memory");
        return NULL;
    }
    http->curl = curl_easy_init();
    http->multi = curl_multi_init();
    http->base = strdup(server);
    http->token = token && *token ? token : NULL;
    http->ca_file = ca_file && *ca_file ? ca_file : NULL;
    if (!http->curl || !http->multi || !http->base) {
        client_http_close(http);
        snprintf(message, size, "no memory");
        return NULL;
    }
    size_t len = strlen(http->base);
    while (len > 0 && http->base[len - 1] == '/')
        http->base[--len] = '\0';
    if (direct)
        curl_easy_setopt(http->curl, CURLOPT_PROXY, "");
    return http;
}

void client_http_close(client_http *http)
{
    if (!http)
        return;
    curl_easy_cleanup(http->curl);
    curl_multi_cleanup(http->multi);
    free(http->base);
    free(http);
    curl_global_cleanup();
}

/* Where a reply goes. header_whole: the empty line after its header has come. Without it a connection that breaks off
 * before Content-Length looks to curl like a reply that ends with the connection. */
typedef struct {
    client_http *http;
    client_reply *reply;
    const client_request *request;
    bool enough, header_whole;
} body_sink;

static size_t take_body(char *bytes, size_t size, size_t count, void *ctx)
{
    body_sink *sink = ctx;
    long status = 0;
    curl_easy_getinfo(sink->http->curl, CURLINFO_RESPONSE_CODE, &status);
    if (!sink->request->take || status < 200 || status >= 300)
        return client_buffer_append(&sink->reply->body, bytes, size * count) ? size * count : 0;
    sink->enough = !sink->request->take(sink->request->take_ctx, bytes, size * count);
    return sink->enough ? 0 : size * count;
}

/* The value of a header line of that name, cut to `size`, in value; false: it is another header. */
static bool header_value(char *value, size_t size, const char *line, size_t len, const char *name)
{
    size_t name_len = strlen(name);
    if (len <= name_len || strncasecmp(line, name, name_len) != 0)
        return false;
    snprintf(value, size, "%.*s", (int)(len - name_len), line + name_len);
    value[strcspn(value, "\r\n")] = '\0';
    return true;
}

static size_t take_header(char *bytes, size_t size, size_t count, void *ctx)
{
    body_sink *sink = ctx;
    client_reply *reply = sink->reply;
    char value[64];
    if (size * count > 0 && (bytes[0] == '\r' || bytes[0] == '\n'))
        sink->header_whole = true;
    else if (header_value(value, sizeof value, bytes, size * count, "HTTP/")) /* after a 1xx another one begins */
        sink->header_whole = false;
    else if (header_value(value, sizeof value, bytes, size * count, "Retry-After:")) {
        /* Seconds from now, for both forms of Retry-After (RFC 9110, 10.2.3): a number or a date. */
        char *end;
        double seconds = strtod(value, &end);
        if (end == value) {
            time_t then = curl_getdate(value, NULL);
            seconds = then < 0 ? 0 : difftime(then, time(NULL));
        }
        reply->retry_after_s = seconds > 0 && isfinite(seconds) ? seconds : 0;
    } else if (header_value(value, sizeof value, bytes, size * count, "Date:"))
        reply->date = curl_getdate(value, NULL);
    return size * count;
}

void client_http_set_watch(client_http *http, const client_http_watch *watch)
{
    http->watch = watch;
}

static void set_request(client_http *http, body_sink *sink, const client_request *request)
{
    CURL *curl = http->curl;
    curl_easy_setopt(curl, CURLOPT_HTTPGET, 1L);
    if (request->body) {
        curl_easy_setopt(curl, CURLOPT_POST, 1L);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, request->body);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->body_len);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, request->method);
    /* On a connection that was used before, curl itself sends a request again when the reply is lost. */
    curl_easy_setopt(curl, CURLOPT_FRESH_CONNECT, strcmp(request->method, "DELETE") == 0 ? 1L : 0L);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    if (http->token) {
        curl_easy_setopt(curl, CURLOPT_HTTPAUTH, (long)CURLAUTH_BEARER);
        curl_easy_setopt(curl, CURLOPT_XOAUTH2_BEARER, http->token);
    }
    if (http->ca_file)
        curl_easy_setopt(curl, CURLOPT_CAINFO, http->ca_file);
    curl_easy_setopt(curl, CURLOPT_PATH_AS_IS, 1L); /* a job called ".." is the server's to refuse */
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "uzawa");
    curl_easy_setopt(curl, CURLOPT_ACCEPT_ENCODING, "");
    curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, http->curl_says);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take_body);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, sink);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, take_header);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, sink);
    curl_easy_setopt(curl, CURLOPT_CERTINFO, request->certificate ? 1L : 0L);
    double left_ms = (request->deadline - client_clock()) * 1000;
    long limit_ms = left_ms >= 1e9 ? 0 : left_ms < 1 ? 1 : (long)ceil(left_ms); /* 0: none */
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, CONNECT_LIMIT_MS);
    curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, limit_ms);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)ceil(request->silence_s));
}

/* False: the watch wants to give up. *seconds of pause, or until something of the request happens if busy. */
static bool look_around(client_http *http, int ms)
{
    const client_http_watch *watch = http->watch;
    struct curl_waitfd extra = {.fd = watch ? watch->fd : -1, .events = CURL_WAIT_POLLIN};
    bool has_fd = watch && watch->fd >= 0;
    curl_multi_poll(http->multi, has_fd ? &extra : NULL, has_fd ? 1 : 0, ms, NULL);
    struct pollfd ready = {.fd = extra.fd, .events = POLLIN};
    if (has_fd && poll(&ready, 1, 0) > 0 && watch->woken(watch->ctx))
        return false;
    if (watch && watch->tick)
        watch->tick(watch->ctx);
    return true;
}

/* The server's own certificate is the first of the chain. */
static void note_certificate(client_http *http, client_reply *reply)
{
    struct curl_certinfo *chain = NULL;
    char value[128];
    if (curl_easy_getinfo(http->curl, CURLINFO_CERTINFO, &chain) != CURLE_OK || !chain || chain->num_of_certs < 1)
        return;
    for (struct curl_slist *line = chain->certinfo[0]; line; line = line->next) {
        size_t len = strlen(line->data);
        if (header_value(value, sizeof value, line->data, len, "Expire date:")) {
            /* "2026-11-26 16:58:04 GMT" of GnuTLS, or what curl_getdate knows; -1: neither. */
            struct tm parts = {0};
            reply->cert_until =
                strptime(value, "%Y-%m-%d %H:%M:%S", &parts) ? timegm(&parts) : curl_getdate(value, NULL);
        } else if (header_value(value, sizeof value, line->data, len, "Subject:"))
            snprintf(reply->cert_subject, sizeof reply->cert_subject, "%s", value);
    }
}

static CURLcode send_once(client_http *http, client_reply *reply, const client_request *request)
{
    char *url = NULL, *address = NULL;
    CURLcode code = CURLE_OUT_OF_MEMORY;
    /* "Expect:" keeps curl from holding back a large body for a second. */
    struct curl_slist *headers = curl_slist_append(NULL, "Expect:");
    const char *of_body = request->body_type ? request->body_type : "Content-Type: application/json";
    bool ok = headers != NULL;
    for (int i = -1; ok && i < CLIENT_HTTP_MAX_HEADERS; i++) {
        const char *header = i >= 0 ? request->headers[i] : request->body ? of_body : NULL;
        struct curl_slist *longer = header ? curl_slist_append(headers, header) : headers;
        ok = longer != NULL;
        headers = ok ? longer : headers;
    }
    body_sink sink = {.http = http, .reply = reply, .request = request};
    int attempts = reply->attempts + 1;
    client_reply_clear(reply);
    reply->attempts = attempts;
    reply->date = -1;
    http->curl_says[0] = '\0';
    if (ok && asprintf(&url, "%s%s", http->base, request->path) >= 0) {
        set_request(http, &sink, request);
        curl_easy_setopt(http->curl, CURLOPT_URL, url);
        curl_easy_setopt(http->curl, CURLOPT_HTTPHEADER, headers);
        /* What curl_easy_perform does, but for the watch: CURLE_ABORTED_BY_CALLBACK. */
        int running = 1, left = 0;
        ok = curl_multi_add_handle(http->multi, http->curl) == CURLM_OK;
        bool goes_on = ok;
        while (goes_on && running) {
            ok = curl_multi_perform(http->multi, &running) == CURLM_OK;
            goes_on = ok && (!running || look_around(http, TICK_MS));
        }
        CURLMsg *message = ok ? curl_multi_info_read(http->multi, &left) : NULL;
        if (ok)
            code =
                !running && message && message->msg == CURLMSG_DONE ? message->data.result : CURLE_ABORTED_BY_CALLBACK;
        curl_multi_remove_handle(http->multi, http->curl);
        if (code == CURLE_OK && !sink.header_whole)
            code = CURLE_PARTIAL_FILE;
        code = sink.enough ? CURLE_OK : code;
        curl_easy_getinfo(http->curl, CURLINFO_RESPONSE_CODE, &reply->status);
        if (curl_easy_getinfo(http->curl, CURLINFO_PRIMARY_IP, &address) == CURLE_OK && address)
            snprintf(reply->address, sizeof reply->address, "%s", address);
        if (request->certificate)
            note_certificate(http, reply);
        free(url);
    }
    curl_slist_free_all(headers);
    return code;
}

static bool worth_another(CURLcode code, const client_reply *reply, const client_request *request)
{
    switch (code) {
    case CURLE_OK:
        return request->repeatable &&
               (reply->status == 429 || reply->status == 502 || reply->status == 503 || reply->status == 504);
    case CURLE_COULDNT_CONNECT: /* nothing of the request can have reached the server */
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_SSL_CONNECT_ERROR: /* the connection ended in its handshake, or there is no TLS, which looks the same */
        return true;
    case CURLE_ABORTED_BY_CALLBACK: /* a local cause, or one that another attempt will meet again */
    case CURLE_OUT_OF_MEMORY:
    case CURLE_WRITE_ERROR:
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_URL_MALFORMAT:
    case CURLE_PEER_FAILED_VERIFICATION:
        return false;
    default:
        return request->repeatable;
    }
}

static client_http_end end_of(client_http *http, client_reply *reply, CURLcode code, const client_request *request)
{
    if (code == CURLE_OK)
        return CLIENT_HTTP_ANSWERED;
    const char *why = http->curl_says[0] ? http->curl_says : curl_easy_strerror(code);
    snprintf(reply->message, sizeof reply->message, "no answer from %.60s: %.220s", http->base, why);
    switch (code) {
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
        reply->cause = CLIENT_CAUSE_NAME;
        break;
    case CURLE_COULDNT_CONNECT:
        reply->cause = CLIENT_CAUSE_CONNECTION;
        break;
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
        reply->cause = CLIENT_CAUSE_CERTIFICATE;
        break;
    case CURLE_SSL_CONNECT_ERROR:
        reply->cause = CLIENT_CAUSE_TLS;
        break;
    case CURLE_OPERATION_TIMEDOUT:
        reply->cause = CLIENT_CAUSE_SILENCE;
        break;
    default:
        reply->cause = CLIENT_CAUSE_OTHER;
    }
    if (code == CURLE_ABORTED_BY_CALLBACK)
        return CLIENT_HTTP_INTERRUPTED;
    if (code == CURLE_OUT_OF_MEMORY || code == CURLE_WRITE_ERROR)
        return CLIENT_HTTP_MEMORY;
    return client_clock() >= request->deadline ? CLIENT_HTTP_DEADLINE : CLIENT_HTTP_UNREACHABLE;
}

bool client_http_pause(client_http *http, double seconds)
{
    double end = client_clock() + seconds, left;
    while ((left = end - client_clock()) > 0)
        if (!look_around(http, (int)fmin(ceil(left * 1000), TICK_MS)))
            return false;
    return true;
}

client_http_end client_http_send(client_http *http, client_reply *reply, const client_request *request)
{
    double start = client_clock();
    *reply = (client_reply){0};
    for (int attempt = 0;; attempt++) {
        CURLcode code = send_once(http, reply, request);
        /* 0.1 s, doubling up to 2 s, up to a quarter shorter by chance so that many clients don't return at once. */
        struct timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        double pause = attempt < 5 ? 0.1 * (double)(1 << attempt) : 2;
        pause = fmax(pause * (1 - 0.25 * (double)(now.tv_nsec % 1000) / 1000), reply->retry_after_s);
        const double then = client_clock() + pause;
        bool again =
            worth_another(code, reply, request) && then <= start + request->patience_s && then < request->deadline;
        if (!again)
            return end_of(http, reply, code, request);
        if (!client_http_pause(http, pause))
            return end_of(http, reply, CURLE_ABORTED_BY_CALLBACK, request);
    }
}
