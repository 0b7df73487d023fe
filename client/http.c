#include "http.h"

#include <curl/curl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#define CONNECT_LIMIT_MS 10000L

struct client_http {
    CURL *curl;
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

void client_sleep(double seconds)
{
    if (!(seconds > 0))
        return;
    struct timespec pause = {.tv_sec = (time_t)seconds};
    pause.tv_nsec = (long)((seconds - floor(seconds)) * 1e9);
    nanosleep(&pause, NULL);
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

static bool is_loopback(const char *host)
{
    return strcasecmp(host, "localhost") == 0 || strncmp(host, "127.", 4) == 0 || strcmp(host, "[::1]") == 0;
}

/* Checks the URL and tells whether a proxy from the environment must be left out: nobody means one for this machine. */
static bool inspect_url(const char *server, bool *direct, char *message, size_t size)
{
    char *scheme = NULL, *host = NULL;
    CURLU *url = curl_url();
    bool ok = url && curl_url_set(url, CURLUPART_URL, server, 0) == CURLUE_OK &&
              curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) == CURLUE_OK &&
              curl_url_get(url, CURLUPART_HOST, &host, 0) == CURLUE_OK &&
              (strcmp(scheme, "http") == 0 || strcmp(scheme, "https") == 0) && !strpbrk(server, "?#");
    if (ok)
        *direct = is_loopback(host);
    else
        snprintf(message, size, "the server must be a URL like http://host:8080, not \"%s\"", server);
    curl_free(scheme);
    curl_free(host);
    curl_url_cleanup(url);
    return ok;
}

client_http *client_http_open(const char *server, char *message, size_t size)
{
    bool direct = false;
    if (!inspect_url(server, &direct, message, size))
        return NULL;
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
    http->base = strdup(server);
    if (!http->curl || !http->base) {
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
    free(http->base);
    free(http);
    curl_global_cleanup();
}

static size_t take_body(char *bytes, size_t size, size_t count, void *ctx)
{
    client_reply *reply = ctx;
    return client_buffer_append(&reply->body, bytes, size * count) ? size * count : 0;
}

/* Wants Retry-After in seconds; the form with a date is taken as absent. */
static size_t take_header(char *bytes, size_t size, size_t count, void *ctx)
{
    static const char NAME[] = "Retry-After:";
    client_reply *reply = ctx;
    size_t len = size * count;
    char value[24] = "";
    if (len > sizeof NAME - 1 && strncasecmp(bytes, NAME, sizeof NAME - 1) == 0) {
        size_t rest = len - (sizeof NAME - 1);
        memcpy(value, bytes + sizeof NAME - 1, rest < sizeof value ? rest : sizeof value - 1);
        double seconds = strtod(value, NULL);
        reply->retry_after_s = seconds > 0 && isfinite(seconds) ? seconds : 0;
    }
    return len;
}

/* NULL: no memory. "Expect:" keeps curl from holding back a large body for a second. */
static struct curl_slist *header_list(const client_request *request)
{
    struct curl_slist *list = curl_slist_append(NULL, "Expect:");
    bool ok = list != NULL;
    const char *of_body = request->body_type ? request->body_type : "Content-Type: application/json";
    const char *type = request->body ? of_body : NULL;
    for (int i = -1; ok && i < CLIENT_HTTP_MAX_HEADERS; i++) {
        const char *header = i < 0 ? type : request->headers[i];
        struct curl_slist *longer = header ? curl_slist_append(list, header) : list;
        ok = longer != NULL;
        list = ok ? longer : list;
    }
    if (!ok) {
        curl_slist_free_all(list);
        list = NULL;
    }
    return list;
}

void client_http_trust(client_http *http, const char *token, const char *ca_file)
{
    http->token = token && *token ? token : NULL;
    http->ca_file = ca_file && *ca_file ? ca_file : NULL;
}

static void set_limits(CURL *curl, const client_request *request)
{
    double left_ms = (request->deadline - client_clock()) * 1000;
    long limit_ms = left_ms >= 1e9 ? 0 : left_ms < 1 ? 1 : (long)ceil(left_ms); /* 0: none */
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, CONNECT_LIMIT_MS);
    curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, limit_ms);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)ceil(request->silence_s));
}

static void set_request(client_http *http, client_reply *reply, const client_request *request)
{
    CURL *curl = http->curl;
    curl_easy_setopt(curl, CURLOPT_HTTPGET, 1L);
    if (request->body) {
        curl_easy_setopt(curl, CURLOPT_POST, 1L);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, request->body);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->body_len);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, request->method);
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
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, reply);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, take_header);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, reply);
    set_limits(curl, request);
}

static CURLcode send_once(client_http *http, client_reply *reply, const client_request *request)
{
    char *url = NULL;
    CURLcode code = CURLE_OUT_OF_MEMORY;
    struct curl_slist *headers = header_list(request);
    client_reply_clear(reply);
    http->curl_says[0] = '\0';
    if (headers && asprintf(&url, "%s%s", http->base, request->path) >= 0) {
        set_request(http, reply, request);
        curl_easy_setopt(http->curl, CURLOPT_URL, url);
        curl_easy_setopt(http->curl, CURLOPT_HTTPHEADER, headers);
        code = curl_easy_perform(http->curl);
        curl_easy_getinfo(http->curl, CURLINFO_RESPONSE_CODE, &reply->status);
        free(url);
    }
    curl_slist_free_all(headers);
    return code;
}

/* Nothing of the request can have reached the server. */
static bool never_arrived(CURLcode code)
{
    return code == CURLE_COULDNT_CONNECT || code == CURLE_COULDNT_RESOLVE_HOST || code == CURLE_COULDNT_RESOLVE_PROXY;
}

/* A local cause, or one that another attempt will meet again. */
static bool hopeless(CURLcode code)
{
    return code == CURLE_OUT_OF_MEMORY || code == CURLE_WRITE_ERROR || code == CURLE_UNSUPPORTED_PROTOCOL ||
           code == CURLE_URL_MALFORMAT || code == CURLE_PEER_FAILED_VERIFICATION || code == CURLE_SSL_CONNECT_ERROR;
}

static bool is_passing(long status)
{
    return status == 429 || status == 502 || status == 503 || status == 504;
}

static bool worth_another(CURLcode code, const client_reply *reply, const client_request *request)
{
    if (code == CURLE_OK)
        return request->repeatable && is_passing(reply->status);
    return never_arrived(code) || (request->repeatable && !hopeless(code));
}

/* 0.1 s, doubling up to 2 s, up to a quarter shorter by chance so that many clients don't return at once. */
static double pause_before(int attempt, const client_reply *reply)
{
    double pause = attempt < 5 ? 0.1 * (double)(1 << attempt) : 2;
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    pause *= 1 - 0.25 * (double)(now.tv_nsec % 1000) / 1000;
    return fmax(pause, reply->retry_after_s);
}

static client_http_end end_of(client_http *http, client_reply *reply, CURLcode code, const client_request *request)
{
    if (code == CURLE_OK)
        return CLIENT_HTTP_ANSWERED;
    const char *why = http->curl_says[0] ? http->curl_says : curl_easy_strerror(code);
    snprintf(reply->message, sizeof reply->message, "no answer from %.60s: %.220s", http->base, why);
    if (code == CURLE_OUT_OF_MEMORY || code == CURLE_WRITE_ERROR)
        return CLIENT_HTTP_MEMORY;
    return client_clock() >= request->deadline ? CLIENT_HTTP_DEADLINE : CLIENT_HTTP_UNREACHABLE;
}

client_http_end client_http_send(client_http *http, client_reply *reply, const client_request *request)
{
    double start = client_clock();
    *reply = (client_reply){0};
    for (int attempt = 0;; attempt++) {
        CURLcode code = send_once(http, reply, request);
        double pause = pause_before(attempt, reply), then = client_clock() + pause;
        bool again =
            worth_another(code, reply, request) && then <= start + request->patience_s && then < request->deadline;
        if (!again)
            return end_of(http, reply, code, request);
        client_sleep(pause);
    }
}
