/* objects.c: requests to an object store, by libcurl. */
#include "store/objects/objects.h"
#include "base/clock.h"
#include "base/given_file.h"
#include "core/alloc.h"

#include <curl/curl.h>
#include <errno.h>
#include <fcntl.h>
#include <gnutls/crypto.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#define TRIES           3
#define FIRST_DELAY_S   0.1
#define LONGEST_DELAY_S 5.0
#define CONNECT_S       5L
#define STILL_S         30L  /* with less than a byte a second */
#define KEPT            8    /* connections that are kept */
#define SAID            1024 /* bytes of an error's answer that are looked at */

struct objects {
    char *url, *region, *user, *secret;
    int64_t least;
    metrics *metrics;
    bool curl_ready;
    pthread_mutex_t lock; /* what follows */
    CURL *idle[KEPT];
    int n_idle;
    double after, delay; /* not before this (CLOCK_MONOTONIC), after what failed */
    char why[OBJECT_CAUSE];
};

/* One request. The answer's bytes go to `data`, of a failure to `said`. */
typedef struct {
    CURL *curl;
    const char *method, *name, *sha256;
    const char *send; /* PUT */
    size_t send_size, sent;
    int64_t at; /* GET: the range */
    char *data;
    size_t size, len, said_len;
    bool more; /* than was asked for */
    char said[SAID];
} exchange;

static long status_of(CURL *curl)
{
    long status = 0;
    curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
    return status;
}

static size_t take(char *data, size_t one, size_t count, void *ctx)
{
    exchange *e = ctx;
    const size_t n = one * count;
    if (status_of(e->curl) >= 300) {
        const size_t room = SAID - 1 - e->said_len, some = n < room ? n : room;
        memcpy(e->said + e->said_len, data, some);
        e->said_len += some;
        return n;
    }
    e->more = e->more || n > e->size - e->len;
    if (e->more) /* ends the exchange */
        return 0;
    if (n > 0)
        memcpy(e->data + e->len, data, n);
    e->len += n;
    return n;
}

static size_t give(char *data, size_t one, size_t count, void *ctx)
{
    exchange *e = ctx;
    const size_t left = e->send_size - e->sent, room = one * count, n = left < room ? left : room;
    memcpy(data, e->send + e->sent, n);
    e->sent += n;
    return n;
}

/* libcurl sends again what it had sent on a connection that turned out to be closed. */
static int rewind_to(void *ctx, curl_off_t offset, int origin)
{
    exchange *e = ctx;
    if (origin != SEEK_SET || offset < 0 || (size_t)offset > e->send_size)
        return CURL_SEEKFUNC_FAIL;
    e->sent = (size_t)offset;
    return CURL_SEEKFUNC_OK;
}

static CURL *take_handle(objects *o)
{
    pthread_mutex_lock(&o->lock);
    CURL *curl = o->n_idle > 0 ? o->idle[--o->n_idle] : NULL;
    pthread_mutex_unlock(&o->lock);
    if (curl)
        curl_easy_reset(curl); /* its connections stay */
    return curl ? curl : curl_easy_init();
}

static void give_handle(objects *o, CURL *curl)
{
    pthread_mutex_lock(&o->lock);
    if (curl && o->n_idle < KEPT) {
        o->idle[o->n_idle++] = curl;
        curl = NULL;
    }
    pthread_mutex_unlock(&o->lock);
    curl_easy_cleanup(curl);
}

static void prepare(const objects *o, exchange *e, const char *url, const char *signing, const char *range,
                    const struct curl_slist *headers)
{
    CURL *curl = e->curl;
    curl_easy_setopt(curl, CURLOPT_URL, url);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(curl, CURLOPT_PROXY, "");
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "uzawad");
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, CONNECT_S);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, STILL_S);
    curl_easy_setopt(curl, CURLOPT_AWS_SIGV4, signing);
    curl_easy_setopt(curl, CURLOPT_USERNAME, o->user);
    curl_easy_setopt(curl, CURLOPT_PASSWORD, o->secret);
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, take);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, e);
    if (e->send) {
        curl_easy_setopt(curl, CURLOPT_UPLOAD, 1L);
        curl_easy_setopt(curl, CURLOPT_INFILESIZE_LARGE, (curl_off_t)e->send_size);
        curl_easy_setopt(curl, CURLOPT_READFUNCTION, give);
        curl_easy_setopt(curl, CURLOPT_READDATA, e);
        curl_easy_setopt(curl, CURLOPT_SEEKFUNCTION, rewind_to);
        curl_easy_setopt(curl, CURLOPT_SEEKDATA, e);
    } else if (e->data) {
        curl_easy_setopt(curl, CURLOPT_RANGE, range);
    } else {
        curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, e->method);
    }
}

/* The status, 0: there was no answer, or not all of it; why in cause. */
static long attempt(objects *o, exchange *e, char cause[OBJECT_CAUSE])
{
    static const char NOTHING[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"; /* of no bytes */
    char header[128], range[64], signing[160], url[1024];
    struct curl_slist *headers = NULL;
    long status = 0;
    e->curl = take_handle(o);
    e->sent = e->len = e->said_len = 0;
    e->more = false;
    snprintf(header, sizeof header, "x-amz-content-sha256: %s", e->sha256 ? e->sha256 : NOTHING);
    snprintf(range, sizeof range, "%lld-%lld", (long long)e->at, (long long)e->at + (long long)e->size - 1);
    snprintf(signing, sizeof signing, "aws:amz:%s:s3", o->region);
    snprintf(url, sizeof url, "%s/%s", o->url, e->name);
    snprintf(cause, OBJECT_CAUSE, "no memory");
    if (e->curl && (headers = curl_slist_append(NULL, header))) {
        prepare(o, e, url, signing, range, headers);
        const CURLcode rc = curl_easy_perform(e->curl);
        if (rc == CURLE_OK || e->more)
            status = status_of(e->curl);
        else
            snprintf(cause, OBJECT_CAUSE, "%s", curl_easy_strerror(rc));
    }
    e->said[e->said_len] = '\0';
    curl_slist_free_all(headers);
    give_handle(o, e->curl);
    return status;
}

/* "403 SignatureDoesNotMatch": the status and the code of the answer's XML. */
static void say_refusal(const exchange *e, long status, char cause[OBJECT_CAUSE])
{
    const char *code = strstr(e->said, "<Code>");
    const size_t len = code ? strcspn(code + 6, "<") : 0;
    snprintf(cause, OBJECT_CAUSE, "it answers %ld%s%.*s to %s", status, len ? " " : "", (int)(len < 64 ? len : 64),
             len ? code + 6 : "", e->method);
}

/* False: nobody asks now, and why. */
static bool may_ask(objects *o, char cause[OBJECT_CAUSE])
{
    pthread_mutex_lock(&o->lock);
    const bool may = clock_seconds(CLOCK_MONOTONIC) >= o->after;
    if (!may)
        memcpy(cause, o->why, OBJECT_CAUSE);
    pthread_mutex_unlock(&o->lock);
    return may;
}

static void note_end(objects *o, bool good, const char cause[OBJECT_CAUSE])
{
    pthread_mutex_lock(&o->lock);
    o->delay = good ? 0.0 : fmin(fmax(2.0 * o->delay, FIRST_DELAY_S), LONGEST_DELAY_S);
    o->after = good ? 0.0 : clock_seconds(CLOCK_MONOTONIC) + o->delay;
    if (!good)
        memcpy(o->why, cause, OBJECT_CAUSE);
    pthread_mutex_unlock(&o->lock);
    if (!good)
        metrics_add(o->metrics, METRIC_OBJECT_FAILED, 1);
}

/* The status of the answer, 0 where there is none after all tries, or one that says no more than that. */
static long ask(objects *o, exchange *e, char cause[OBJECT_CAUSE])
{
    char why[OBJECT_CAUSE];
    long status = 0;
    if (!may_ask(o, cause))
        return 0;
    for (int tries = 1; tries <= TRIES; tries++) {
        const double begun = clock_seconds(CLOCK_MONOTONIC);
        status = attempt(o, e, why);
        metrics_seconds(o->metrics, METRIC_OBJECT, clock_seconds(CLOCK_MONOTONIC) - begun);
        if (status > 0 && status < 500 && status != 408 && status != 429)
            break;
        if (status > 0)
            say_refusal(e, status, why);
        status = 0;
        if (tries < TRIES)
            nanosleep(&(struct timespec){.tv_nsec = 50000000L << (2 * (tries - 1))}, NULL);
    }
    const bool good = (status >= 200 && status < 300) || status == 404 || status == 416;
    if (status > 0 && !(status >= 200 && status < 300))
        say_refusal(e, status, why);
    if (!good || status >= 300)
        snprintf(cause, OBJECT_CAUSE, "the object store: %.200s", why);
    note_end(o, good, cause);
    return status;
}

static bool is_success(long status)
{
    return status >= 200 && status < 300;
}

store_status objects_put(objects *o, const char *name, const void *data, size_t size, const char *sha256,
                         char cause[OBJECT_CAUSE])
{
    exchange e = {.method = "PUT", .name = name, .sha256 = sha256, .send = data, .send_size = size};
    const bool good = is_success(ask(o, &e, cause));
    if (good)
        metrics_add(o->metrics, METRIC_OBJECT_WRITTEN, (int64_t)size);
    return good ? STORE_OK : STORE_AWAY;
}

store_status objects_get(objects *o, const char *name, int64_t at, void *data, size_t size, char cause[OBJECT_CAUSE])
{
    exchange e = {.method = "GET", .name = name, .at = at, .data = data, .size = size};
    const long status = ask(o, &e, cause);
    const bool whole = status == 206 || (status == 200 && at == 0); /* 200: all of it, whatever was asked for */
    if (whole && e.len == size && !e.more) {
        metrics_add(o->metrics, METRIC_OBJECT_READ, (int64_t)size);
        return STORE_OK;
    }
    if (is_success(status) && !whole)
        snprintf(cause, OBJECT_CAUSE, "the object store answers a request for a range with %ld", status);
    else if (whole)
        snprintf(cause, OBJECT_CAUSE, "the object %.95s has not the bytes that were put", name);
    else if (status == 404 || status == 416)
        snprintf(cause, OBJECT_CAUSE, "the object %.95s is %s", name, status == 404 ? "gone" : "cut short");
    return whole || status == 404 || status == 416 ? STORE_DAMAGED : STORE_AWAY;
}

store_status objects_remove(objects *o, const char *name, char cause[OBJECT_CAUSE])
{
    exchange e = {.method = "DELETE", .name = name};
    const long status = ask(o, &e, cause);
    return is_success(status) || status == 404 ? STORE_OK : STORE_AWAY;
}

int64_t objects_least(const objects *o)
{
    return o->least;
}

/* ---- opening */

/* A scheme, a host and a bucket, of letters that need no other spelling when they are signed. */
static bool check_url(const char *text, char *message, size_t size)
{
    static const char LETTERS[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:/[]";
    const char *host = strncmp(text, "https://", 8) == 0  ? text + 8
                       : strncmp(text, "http://", 7) == 0 ? text + 7
                                                          : NULL;
    const char *bucket = host ? strchr(host, '/') : NULL;
    const size_t len = strlen(text);
    const bool good = bucket && bucket > host && bucket[1] && text[len - 1] != '/' && len < 800 &&
                      strspn(text, LETTERS) == len && !strstr(host, "//");
    if (!good)
        snprintf(message, size,
                 "the object store's address must be http[s]://HOST[:PORT]/BUCKET or .../BUCKET/PREFIX, of letters, "
                 "digits and .-_ without anything behind it");
    return good;
}

static bool read_keys(objects *o, const char *path, char *message, size_t size)
{
    char line[512] = "", user[256] = "", secret[256] = "", more = 0;
    struct stat info;
    if (!path[0]) {
        const char *id = getenv("AWS_ACCESS_KEY_ID"), *key = getenv("AWS_SECRET_ACCESS_KEY");
        snprintf(user, sizeof user, "%s", id ? id : "");
        snprintf(secret, sizeof secret, "%s", key ? key : "");
        if (!user[0] || !secret[0])
            snprintf(message, size,
                     "the object store needs keys: give --object-key-file, or AWS_ACCESS_KEY_ID and "
                     "AWS_SECRET_ACCESS_KEY in the environment");
    } else {
        FILE *file = given_file_open(path);
        const bool read = file && fgets(line, sizeof line, file) && fstat(fileno(file), &info) == 0;
        const int cause = errno;
        if (file)
            fclose(file);
        if (!read)
            snprintf(message, size, "cannot read the keys of the object store in %s: %s", path,
                     file ? "it is empty" : strerror(cause));
        else if (info.st_mode & S_IROTH)
            snprintf(message, size, "%s has keys of the object store and everybody may read it: chmod 600", path);
        else if (sscanf(line, "%255s %255s %c", user, secret, &more) != 2)
            snprintf(message, size, "%s must have one line: ACCESS_KEY_ID SECRET_ACCESS_KEY", path);
        else
            message[0] = '\0';
        if (message[0])
            user[0] = secret[0] = '\0';
    }
    o->user = strdup(user);
    o->secret = strdup(secret);
    explicit_bzero(line, sizeof line);
    explicit_bzero(secret, sizeof secret);
    return o->user && o->secret && o->user[0] && o->secret[0];
}

/* What a daemon will have to do there. */
static bool probe(objects *o, char *message, size_t size)
{
    static const char BYTES[] = "uzawad was here";
    unsigned char digest[32];
    char cause[OBJECT_CAUSE] = "", name[64], sum[65], read[4];
    uint64_t random = 0;
    const size_t len = sizeof BYTES - 1;
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random ||
        gnutls_hash_fast(GNUTLS_DIG_SHA256, BYTES, len, digest) != 0) {
        snprintf(message, size, "no random number or digest for the object store");
        return false;
    }
    for (int i = 0; i < 32; i++)
        snprintf(sum + 2 * i, 3, "%02x", digest[i]);
    snprintf(name, sizeof name, "probe-%016llx", (unsigned long long)random);
    const char *what = "put";
    store_status status = objects_put(o, name, BYTES, len, sum, cause);
    if (status == STORE_OK) {
        what = "read";
        status = objects_get(o, name, 11, read, sizeof read, cause);
        if (status == STORE_OK && memcmp(read, BYTES + 11, sizeof read) != 0) {
            snprintf(cause, sizeof cause, "it has other bytes than were put");
            status = STORE_DAMAGED;
        }
        const store_status removed = objects_remove(o, name, cause);
        if (status == STORE_OK && removed != STORE_OK) {
            what = "remove";
            status = removed;
        }
    }
    if (status != STORE_OK)
        snprintf(message, size,
                 "cannot %s an object at %s: %.200s. Look at the address, the bucket, --object-region %s, the keys and "
                 "their rights to put, get and delete objects",
                 what, o->url, cause, o->region);
    return status == STORE_OK;
}

objects *objects_open(const objects_options *options, char *message, size_t size)
{
    objects *o = calloc(1, sizeof *o);
    snprintf(message, size, "no memory");
    if (!o)
        return NULL;
    pthread_mutex_init(&o->lock, NULL);
    o->least = options->least > 0 ? options->least : 1;
    o->metrics = options->metrics;
    o->url = strdup(options->url);
    o->region = strdup(options->region);
    o->curl_ready = curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK;
    if (o->url && o->region && o->curl_ready) {
        message[0] = '\0';
        if (check_url(o->url, message, size) && read_keys(o, options->key_file, message, size) &&
            probe(o, message, size))
            return o;
    }
    objects_close(o);
    return NULL;
}

void objects_close(objects *o)
{
    if (!o)
        return;
    while (o->n_idle > 0)
        curl_easy_cleanup(o->idle[--o->n_idle]);
    if (o->curl_ready)
        curl_global_cleanup();
    if (o->secret)
        explicit_bzero(o->secret, strlen(o->secret));
    uz_free_all(o->url, o->region, o->user, o->secret);
    pthread_mutex_destroy(&o->lock);
    free(o);
}
