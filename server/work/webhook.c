#include "work/webhook.h"
#include "codec/codec.h"
#include "work/internal.h"

#include <curl/curl.h>
#include <errno.h>
#include <gnutls/crypto.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <time.h>

#define LOOK_S         0.5
#define FIRST_RETRY_S  5.0
#define LONGEST_WAIT_S 3600.0
#define MOST_ATTEMPTS  16 /* with waits of 5 s that double up to an hour: more than 6 hours */
#define CONNECT_S      5L
#define WHOLE_S        15L
#define SECRET_MAX     4096

struct webhooks {
    store *store;
    server_log *log;
    webhook_options options;
    pthread_t thread;
    bool started, curl_ready;
    atomic_bool stop;
    pthread_mutex_t lock; /* for wake */
    pthread_cond_t wake;
};

/* ---- what may be called */

/* One part of an address; the caller frees it with curl_free. */
static char *part_of(CURLU *url, CURLUPart part, unsigned flags)
{
    char *text = NULL;
    return curl_url_get(url, part, &text, flags) == CURLUE_OK ? text : NULL;
}

bool webhooks_allow(const webhooks *all, const char *text, const char **why)
{
    *why = "this service calls nobody (its option --webhook-allow)";
    if (!all || all->options.n_allow == 0)
        return false;
    CURLU *url = curl_url();
    *why = "there is no memory to look at it";
    if (!url)
        return false;
    const bool parsed = curl_url_set(url, CURLUPART_URL, text, 0) == CURLUE_OK;
    char *scheme = parsed ? part_of(url, CURLUPART_SCHEME, 0) : NULL;
    char *host = parsed ? part_of(url, CURLUPART_HOST, 0) : NULL;
    char *port = parsed ? part_of(url, CURLUPART_PORT, CURLU_DEFAULT_PORT) : NULL;
    char *user = parsed ? part_of(url, CURLUPART_USER, 0) : NULL;
    if (!scheme || !host || !port || (strcmp(scheme, "http") != 0 && strcmp(scheme, "https") != 0))
        *why = "it is no address that begins with http:// or https://";
    else if (user)
        *why = "it must not have a user or a password";
    else {
        const bool own_port = strcmp(port, strcmp(scheme, "https") == 0 ? "443" : "80") == 0;
        const size_t len = strlen(host);
        *why = "this service does not call that host and port (its option --webhook-allow)";
        for (size_t i = 0; i < all->options.n_allow; i++) {
            const char *entry = all->options.allow[i];
            if (strncasecmp(entry, host, len) == 0 &&
                ((entry[len] == '\0' && own_port) || (entry[len] == ':' && strcmp(entry + len + 1, port) == 0)))
                *why = NULL;
        }
    }
    curl_free(scheme);
    curl_free(host);
    curl_free(port);
    curl_free(user);
    curl_url_cleanup(url);
    return !*why;
}

/* ---- one attempt */

/* "t=...,v1=...": an HMAC over the time and the body; false where it can't be made. */
static bool sign(char out[128], const char *secret, size_t secret_len, long long unix_s, const char *body, size_t len)
{
    gnutls_hmac_hd_t hmac;
    unsigned char digest[32];
    char time_text[32];
    int used = snprintf(time_text, sizeof time_text, "%lld.", unix_s);
    if (gnutls_hmac_init(&hmac, GNUTLS_MAC_SHA256, secret, secret_len) != 0)
        return false;
    bool ok = gnutls_hmac(hmac, time_text, (size_t)used) == 0 && gnutls_hmac(hmac, body, len) == 0;
    gnutls_hmac_deinit(hmac, digest);
    used = snprintf(out, 128, "t=%lld,v1=", unix_s);
    for (int i = 0; i < 32; i++)
        used += snprintf(out + used, 128 - (size_t)used, "%02x", digest[i]);
    return ok;
}

static size_t drop(char *data, size_t size, size_t count, void *ctx)
{
    (void)data;
    (void)ctx;
    return size * count;
}

static int go_on(void *ctx, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    const webhooks *all = ctx;
    (void)a, (void)b, (void)c, (void)d;
    return atomic_load(&all->stop);
}

/* NULL: no memory. */
static struct curl_slist *make_headers(const webhooks *all, const webhook_due *due, const char *body, size_t len)
{
    char delivery[96], signature[160] = "X-Uzawa-Signature: ";
    snprintf(delivery, sizeof delivery, "X-Uzawa-Delivery: %s.%d", due->job, due->attempts + 1);
    const bool is_signed = all->options.secret_len > 0;
    if (is_signed && !sign(signature + strlen(signature), all->options.secret, all->options.secret_len,
                           (long long)time(NULL), body, len))
        return NULL;
    const char *const lines[] = {"Content-Type: application/json", "Expect:", "X-Uzawa-Event: job.ended", delivery,
                                 is_signed ? signature : "X-Uzawa-Signature:"}; /* without a value: none is sent */
    struct curl_slist *list = NULL;
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        struct curl_slist *longer = curl_slist_append(list, lines[i]);
        if (!longer) {
            curl_slist_free_all(list);
            return NULL;
        }
        list = longer;
    }
    return list;
}

/* The HTTP status, 0: there was no answer, and why in cause. */
static long post(webhooks *all, const webhook_due *due, const char *body, char *cause, size_t size)
{
    long status = 0;
    size_t len = strlen(body);
    CURL *curl = curl_easy_init();
    struct curl_slist *headers = curl ? make_headers(all, due, body, len) : NULL;
    snprintf(cause, size, "no memory");
    if (headers) {
        curl_easy_setopt(curl, CURLOPT_URL, due->url);
        curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
        curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L); /* it would leave the list of what may be called */
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
        curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
        curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, CONNECT_S);
        curl_easy_setopt(curl, CURLOPT_TIMEOUT, WHOLE_S);
        curl_easy_setopt(curl, CURLOPT_USERAGENT, "uzawad");
        curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)len);
        curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, drop);
        curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, go_on);
        curl_easy_setopt(curl, CURLOPT_XFERINFODATA, all);
        curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
        CURLcode rc = curl_easy_perform(curl);
        snprintf(cause, size, "%s", curl_easy_strerror(rc));
        if (rc == CURLE_OK)
            curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
    }
    curl_slist_free_all(headers);
    curl_easy_cleanup(curl);
    return status;
}

/* ---- the thread */

static double wait_after(const webhooks *all, int attempts)
{
    double first = all->options.first_retry_s > 0 ? all->options.first_retry_s : FIRST_RETRY_S;
    return fmin(LONGEST_WAIT_S, first * ldexp(1.0, attempts < 30 ? attempts : 30));
}

/* Tells of one job and notes how it went. */
static void tell(webhooks *all, const webhook_due *due)
{
    static const char *const EVENTS[] = {"", "webhook_failed", "webhook_told", "webhook_given_up"}; /* by webhook_end */
    char cause[256] = "";
    const char *why = NULL;
    job j = {0};
    long status = 0;
    webhook_end end = WEBHOOK_AGAIN;
    char *body = store_get(all->store, due->job, &j) == STORE_OK ? codec_encode_job(&j) : NULL;
    job_clear(&j);
    if (!webhooks_allow(all, due->url, &why)) { /* the list may be another one since the job came */
        end = WEBHOOK_GIVEN_UP;
        snprintf(cause, sizeof cause, "%s", why);
    } else if (body) {
        status = post(all, due, body, cause, sizeof cause);
    }
    free(body);
    if (status >= 200 && status < 300)
        end = WEBHOOK_TOLD;
    else if (status == 410 || due->attempts + 1 >= MOST_ATTEMPTS)
        end = WEBHOOK_GIVEN_UP;
    if (status == 0 && atomic_load(&all->stop))
        return; /* cut off: it stays due */
    log_write(all->log, end == WEBHOOK_TOLD ? LOG_INFO : LOG_WARN, EVENTS[end],
              (log_field[]){LOG_S("job", due->job),
                            LOG_S("url", due->url),
                            LOG_I("attempt", due->attempts + 1),
                            LOG_I("status", status),
                            LOG_S("cause", status ? NULL : cause),
                            {0}});
    metrics_add(all->options.metrics, end == WEBHOOK_TOLD ? METRIC_WEBHOOK_TOLD : METRIC_WEBHOOK_FAILED, 1);
    const bool silent = status == 0 && end == WEBHOOK_AGAIN; /* each attempt takes seconds that others wait for */
    store_webhook_attempted(all->store, due, end, wait_after(all, due->attempts), silent ? wait_after(all, 0) : 0.0);
}

static void *tell_loop(void *arg)
{
    webhooks *all = arg;
    while (!atomic_load(&all->stop)) {
        webhook_due due;
        if (store_webhook_next(all->store, &due) == STORE_OK) {
            tell(all, &due);
            free(due.url);
            continue;
        }
        pthread_mutex_lock(&all->lock);
        if (!atomic_load(&all->stop))
            clock_wait(&all->wake, &all->lock, clock_seconds(CLOCK_MONOTONIC) + LOOK_S);
        pthread_mutex_unlock(&all->lock);
    }
    return NULL;
}

/* ---- start and stop */

bool webhook_read_secret(webhook_options *out, const char *path, char *message, size_t size)
{
    char text[SECRET_MAX + 2];
    FILE *file = fopen(path, "rbe");
    size_t len = file ? fread(text, 1, sizeof text, file) : 0;
    int cause = errno;
    bool ok = file && !ferror(file);
    if (file)
        fclose(file);
    while (len > 0 && (text[len - 1] == '\n' || text[len - 1] == '\r'))
        len--;
    if (!ok)
        snprintf(message, size, "cannot read the webhook secret %s: %s", path, strerror(cause));
    else if (len == 0 || len > SECRET_MAX)
        snprintf(message, size, "the webhook secret %s must have 1 to %d bytes", path, SECRET_MAX);
    ok = ok && len > 0 && len <= SECRET_MAX;
    if (ok && !(out->secret = malloc(len))) {
        snprintf(message, size, "no memory for the webhook secret");
        ok = false;
    }
    if (ok) {
        memcpy(out->secret, text, len);
        out->secret_len = len;
    }
    explicit_bzero(text, sizeof text);
    return ok;
}

void webhook_forget_secret(webhook_options *options)
{
    if (options->secret)
        explicit_bzero(options->secret, options->secret_len);
    free(options->secret);
    options->secret = NULL;
    options->secret_len = 0;
}

webhooks *webhooks_start(store *s, const webhook_options *options, server_log *log, char *message, size_t size)
{
    webhooks *all = calloc(1, sizeof *all);
    if (!all) {
        snprintf(message, size, "no memory for webhooks");
        return NULL;
    }
    all->store = s;
    all->log = log;
    all->options = *options;
    atomic_init(&all->stop, false);
    pthread_mutex_init(&all->lock, NULL);
    clock_condition(&all->wake);
    if (options->n_allow == 0) { /* what was to be told before is given up, so that its jobs need not stay for it */
        bool any = false;
        if (store_webhooks_open(s, &any) != STORE_OK || !any)
            return all;
    }
    snprintf(message, size, "cannot start the thread for webhooks");
    all->curl_ready = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
    all->started = all->curl_ready && pthread_create(&all->thread, NULL, tell_loop, all) == 0;
    if (all->started)
        return all;
    webhooks_stop(all);
    return NULL;
}

void webhooks_stop(webhooks *all)
{
    if (!all)
        return;
    pthread_mutex_lock(&all->lock);
    atomic_store(&all->stop, true);
    pthread_cond_signal(&all->wake);
    pthread_mutex_unlock(&all->lock);
    if (all->started)
        pthread_join(all->thread, NULL);
    if (all->curl_ready)
        curl_global_cleanup();
    pthread_cond_destroy(&all->wake);
    pthread_mutex_destroy(&all->lock);
    free(all);
}
