#include "work/webhook.h"
#include "base/given_file.h"
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

#define REPLY_S    2.0   /* what an answer still has to say once its status is known may take so long */
#define REPLY_MOST 65536 /* and have so many bytes */

enum { SENDERS = STORE_WEBHOOKS_EXCEPT + 1 };

/* One thread, and what it tells: nobody else is told at the same host and port meanwhile, so that one that is slow
 * holds up its own only. */
typedef struct {
    webhooks *all;
    pthread_t thread;
    char place[256]; /* "http://host:port"; "": it tells nothing now. Under all->lock */
} sender;

struct webhooks {
    store *store;
    server_log *log;
    webhook_options options;
    sender senders[SENDERS];
    int started;
    bool curl_ready;
    atomic_bool stop;
    pthread_mutex_t lock; /* what follows */
    pthread_cond_t look;  /* who looks is to look at once */
    pthread_cond_t turn;  /* nobody looks */
    bool looking;         /* one of the senders waits for what falls due */
};

/* ---- what may be called */

/* One part of an address; the caller frees it with curl_free. */
static char *part_of(CURLU *url, CURLUPart part, unsigned flags)
{
    char *text = NULL;
    return curl_url_get(url, part, &text, flags) == CURLUE_OK ? text : NULL;
}

/* One place has one name, but for the case of letters: who tells it something keeps others from doing so meanwhile, by
 * that name. libcurl also takes several slashes, 127.1 for 127.0.0.1, %6c for l, and zeros before a port. */
static bool is_plain(const char *text, const char *scheme, const char *host, const char *port)
{
    const size_t s = strlen(scheme), h = strlen(host), p = strlen(port);
    if (strncasecmp(text, scheme, s) != 0 || strncmp(text + s, "://", 3) != 0 ||
        strncasecmp(text + s + 3, host, h) != 0)
        return false;
    const char *end = text + s + 3 + h;
    if (end[0] == ':' && strncmp(end + 1, port, p) == 0)
        end += 1 + p;
    return strchr("/?#", end[0]) != NULL; /* also at the end of the text */
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
    else if (!is_plain(text, scheme, host, port))
        *why =
            "its host or port is written in an unusual way: write SCHEME://HOST/ or SCHEME://HOST:PORT/, without zeros "
            "before a number, and an address of IPv4 as four decimal numbers";
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

typedef struct {
    const webhooks *all;
    CURL *curl;
    size_t bytes;   /* of the answer's body */
    double ends_at; /* on CLOCK_MONOTONIC; 0: its status is not known yet */
} exchange;

/* Only the status counts; an answer that does not end is cut off. */
static size_t drop(char *data, size_t size, size_t count, void *ctx)
{
    exchange *e = ctx;
    (void)data;
    e->bytes += size * count;
    return e->bytes <= REPLY_MOST ? size * count : 0;
}

static long status_of(CURL *curl)
{
    long status = 0;
    curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
    return status >= 200 ? status : 0;
}

static int is_over(void *ctx, curl_off_t a, curl_off_t b, curl_off_t c, curl_off_t d)
{
    exchange *e = ctx;
    const double now = clock_seconds(CLOCK_MONOTONIC);
    (void)a, (void)b, (void)c, (void)d;
    if (e->ends_at == 0.0 && status_of(e->curl))
        e->ends_at = now + REPLY_S;
    return atomic_load(&e->all->stop) || (e->ends_at > 0.0 && now > e->ends_at);
}

/* NULL: no memory, or the signature can't be made. */
static struct curl_slist *make_headers(const webhooks *all, const webhook_due *due, const char *body, size_t len)
{
    char delivery[96], signature[160] = "X-Uzawa-Signature:"; /* without a value: none is sent */
    snprintf(delivery, sizeof delivery, "X-Uzawa-Delivery: %s.%d", due->job, due->attempts + 1);
    if (all->options.secret_len > 0) { /* "t=...,v1=...": an HMAC over the time and the body */
        const long long unix_s = (long long)time(NULL);
        gnutls_hmac_hd_t hmac;
        unsigned char digest[32];
        char time_text[32];
        int used = snprintf(time_text, sizeof time_text, "%lld.", unix_s);
        if (gnutls_hmac_init(&hmac, GNUTLS_MAC_SHA256, all->options.secret, all->options.secret_len) != 0)
            return NULL;
        const bool ok = gnutls_hmac(hmac, time_text, (size_t)used) == 0 && gnutls_hmac(hmac, body, len) == 0;
        gnutls_hmac_deinit(hmac, digest);
        if (!ok)
            return NULL;
        used = snprintf(signature, sizeof signature, "X-Uzawa-Signature: t=%lld,v1=", unix_s);
        for (int i = 0; i < 32; i++)
            used += snprintf(signature + used, sizeof signature - (size_t)used, "%02x", digest[i]);
    }
    const char *const lines[] = {"Content-Type: application/json", "Expect:", "X-Uzawa-Event: job.ended", delivery,
                                 signature};
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
    exchange e = {.all = all, .curl = curl};
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
        curl_easy_setopt(curl, CURLOPT_WRITEDATA, &e);
        curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, is_over);
        curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &e);
        curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
        const CURLcode rc = curl_easy_perform(curl);
        snprintf(cause, size, "%s", curl_easy_strerror(rc));
        if (rc == CURLE_OK || rc == CURLE_WRITE_ERROR || rc == CURLE_ABORTED_BY_CALLBACK)
            status = status_of(curl);
    }
    curl_slist_free_all(headers);
    curl_easy_cleanup(curl);
    return status;
}

/* ---- the threads */

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

/* Waits for what falls due, at none of the places where somebody is told now. One of the senders does that, and the
 * next one when it has found something. */
static void *tell_loop(void *arg)
{
    sender *me = arg;
    webhooks *all = me->all;
    webhook_due due;
    pthread_mutex_lock(&all->lock);
    for (;;) {
        bool found = false;
        while (all->looking && !atomic_load(&all->stop))
            pthread_cond_wait(&all->turn, &all->lock);
        all->looking = true;
        while (!found && !atomic_load(&all->stop)) {
            const char *except[SENDERS];
            size_t n = 0;
            for (int i = 0; i < SENDERS; i++)
                if (all->senders[i].place[0])
                    except[n++] = all->senders[i].place;
            found = store_webhook_next(all->store, except, n, &due) == STORE_OK;
            if (!found)
                clock_wait(&all->look, &all->lock, clock_seconds(CLOCK_MONOTONIC) + LOOK_S);
        }
        all->looking = false;
        pthread_cond_signal(&all->turn);
        if (!found)
            break;
        const char *host = strstr(due.url, "://");
        const size_t begin = host ? (size_t)(host - due.url) + 3 : 0;
        snprintf(me->place, sizeof me->place, "%.*s", (int)(begin + strcspn(due.url + begin, "/?#")), due.url);
        pthread_mutex_unlock(&all->lock);
        tell(all, &due);
        free(due.url);
        pthread_mutex_lock(&all->lock);
        me->place[0] = '\0';
        pthread_cond_signal(&all->look);
    }
    pthread_mutex_unlock(&all->lock);
    return NULL;
}

/* ---- start and stop */

bool webhook_read_secret(webhook_options *out, const char *path, char *message, size_t size)
{
    char text[SECRET_MAX + 2];
    FILE *file = given_file_open(path);
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
    clock_condition(&all->look);
    clock_condition(&all->turn);
    if (options->n_allow == 0) { /* what was to be told before is given up, so that its jobs need not stay for it */
        bool any = false;
        if (store_webhooks_open(s, &any) != STORE_OK || !any)
            return all;
    }
    snprintf(message, size, "cannot start the threads for webhooks");
    all->curl_ready = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
    for (bool ok = all->curl_ready; ok && all->started < SENDERS; all->started += ok) {
        sender *next = &all->senders[all->started];
        next->all = all;
        ok = pthread_create(&next->thread, NULL, tell_loop, next) == 0;
    }
    if (all->started == SENDERS)
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
    pthread_cond_broadcast(&all->look);
    pthread_cond_broadcast(&all->turn);
    pthread_mutex_unlock(&all->lock);
    for (int i = 0; i < all->started; i++)
        pthread_join(all->senders[i].thread, NULL);
    if (all->curl_ready)
        curl_global_cleanup();
    pthread_cond_destroy(&all->turn);
    pthread_cond_destroy(&all->look);
    pthread_mutex_destroy(&all->lock);
    free(all);
}
