/* uploads.c: what is sent becomes a blob and a row of the engine; the limits of both. */
#include "store/uploads.h"
#include "store/blobs.h"
#include "store/engine_base.h"

#include <errno.h>
#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

/* What was used so lately does not go to make room: a client that sent it is about to name it in a job. */
#define UPLOAD_GRACE_S 600.0
#define PIECE          65536 /* bytes inflated at once */

/* The lock is taken before any of the engine's. It holds a blob and its row together: no writer of the same bytes comes
 * between the two when they are published or removed. */
struct store_uploads {
    blobs *blobs;
    pthread_mutex_t lock; /* bytes, pending */
    int64_t bytes;        /* of all that have rows */
    int64_t pending;      /* of those that are being written */
};

struct upload_writer {
    store *s;
    char client[STORE_CLIENT];
    blob_writer *blob;
    int64_t bytes, reserved; /* reserved: part of pending */
    upload_status failed;
    gnutls_hash_hd_t hash;
    bool gzip, hashing, inflating;
    bool between; /* gzip: at the start of a member */
    z_stream z;
    unsigned char piece[PIECE];
};

/* ---- opening: what a crash left goes */

static bool has_row(void *ctx, const char *id)
{
    upload_info info;
    return store_upload_get(ctx, id, NULL, &info) != STORE_NOT_FOUND;
}

bool store_uploads_begin(store *s, blobs *place, char *message, size_t size)
{
    store_uploads *u = place ? calloc(1, sizeof *u) : NULL;
    if (!u) {
        snprintf(message, size, "no memory");
        if (place && place->does->close)
            place->does->close(place);
        return false;
    }
    u->blobs = place;
    pthread_mutex_init(&u->lock, NULL);
    s->uploads = u;
    if (!s->engine->upload_total || s->engine->upload_total(s, &u->bytes) == STORE_OK) {
        if (place->does->sweep)
            place->does->sweep(place, has_row, s);
        return true;
    }
    snprintf(message, size, "cannot read the uploads: %s", s->message);
    return false;
}

void store_uploads_end(store *s)
{
    if (!s->uploads)
        return;
    if (s->uploads->blobs->does->close)
        s->uploads->blobs->does->close(s->uploads->blobs);
    pthread_mutex_destroy(&s->uploads->lock);
    free(s->uploads);
    s->uploads = NULL;
}

/* ---- rows */

bool blob_is_id(const char *text)
{
    return strlen(text) == UPLOAD_ID_LEN && strspn(text, "0123456789abcdef") == UPLOAD_ID_LEN;
}

store_status store_upload_get(store *s, const char *id, const char *client, upload_info *out)
{
    *out = (upload_info){.bytes = 0};
    return blob_is_id(id) ? s->engine->upload_get(s, id, client, out) : STORE_NOT_FOUND;
}

/* Under the lock. The blob goes with its row. */
static store_status forget(store *s, const upload_info *info, const char *client)
{
    bool gone = false;
    store_status status = s->engine->upload_forget(s, info->id, client, &gone);
    if (status != STORE_OK || !gone)
        return status;
    s->uploads->bytes -= info->bytes;
    s->uploads->blobs->does->remove(s->uploads->blobs, info->id);
    return STORE_OK;
}

store_status store_upload_delete(store *s, const char *id, const char *client)
{
    upload_info info;
    pthread_mutex_lock(&s->uploads->lock);
    store_status status = store_upload_get(s, id, client, &info);
    if (status == STORE_OK)
        status = forget(s, &info, client);
    pthread_mutex_unlock(&s->uploads->lock);
    return status;
}

/* ---- collecting */

/* Under the lock. Deletes the one that was last used longest ago, unused_s or more; false: there is none, or it can't
 * be deleted now. */
static bool collect_one(store *s, double now, double unused_s)
{
    upload_info found = {.bytes = 0};
    return s->engine->upload_idle(s, now, unused_s, &found) == STORE_OK && forget(s, &found, NULL) == STORE_OK;
}

store_status store_collect_uploads(store *s, int64_t *count)
{
    const double keep_s = s->settings.uploads.keep_s;
    int64_t n = 0;
    bool held;
    const double now = store_age_time(s, &held);
    for (bool more = true; more; n += more) { /* the lock is let go between two, for those who send */
        pthread_mutex_lock(&s->uploads->lock);
        more = keep_s > 0 && s->uploads->bytes > 0 && collect_one(s, now, keep_s);
        pthread_mutex_unlock(&s->uploads->lock);
    }
    if (count)
        *count = n;
    return STORE_OK;
}

/* ---- writing */

static upload_status status_of(store_status status)
{
    return status == STORE_OK      ? UPLOAD_OK
           : status == STORE_FULL  ? UPLOAD_DISK_FULL
           : status == STORE_QUOTA ? UPLOAD_QUOTA
           : status == STORE_AWAY  ? UPLOAD_AWAY
                                   : UPLOAD_FAILED;
}

void store_upload_abort(upload_writer *w)
{
    if (!w)
        return;
    if (w->blob)
        w->blob->blobs->does->end(w->blob);
    if (w->inflating)
        inflateEnd(&w->z);
    if (w->hashing)
        gnutls_hash_deinit(w->hash, NULL);
    pthread_mutex_lock(&w->s->uploads->lock);
    w->s->uploads->pending -= w->reserved;
    pthread_mutex_unlock(&w->s->uploads->lock);
    free(w);
}

upload_writer *store_upload_begin(store *s, const char *client, bool gzip, upload_status *status)
{
    char cause[BLOB_CAUSE] = "no memory for an upload";
    upload_writer *w = calloc(1, sizeof *w);
    *status = UPLOAD_FAILED;
    if (w) {
        w->s = s;
        snprintf(w->client, sizeof w->client, "%s", client ? client : "");
        w->gzip = w->between = gzip;
        w->hashing = gnutls_hash_init(&w->hash, GNUTLS_DIG_SHA256) == 0;
        w->inflating = w->hashing && gzip && inflateInit2(&w->z, 15 + 16) == Z_OK; /* 16: gzip, not zlib (zlib.h) */
    }
    if (w && w->hashing && w->inflating == gzip)
        *status = status_of(s->uploads->blobs->does->begin(s->uploads->blobs, &w->blob, cause));
    if (*status == UPLOAD_OK)
        return w;
    store_set_message(s, cause);
    store_upload_abort(w);
    return NULL;
}

/* Adds bytes as they are to be kept, where there is room for them within both limits. */
static upload_status put(upload_writer *w, const unsigned char *data, size_t size, char cause[BLOB_CAUSE])
{
    store_uploads *u = w->s->uploads;
    const upload_limits *limits = &w->s->settings.uploads;
    const int64_t more = (int64_t)size;
    upload_status status = UPLOAD_OK;
    if (size == 0)
        return UPLOAD_OK;
    pthread_mutex_lock(&u->lock);
    if (limits->one > 0 && more > limits->one - w->reserved)
        status = UPLOAD_TOO_LARGE;
    while (status == UPLOAD_OK && limits->all > 0 && u->bytes + u->pending + more > limits->all)
        if (!collect_one(w->s, clock_seconds(CLOCK_REALTIME), UPLOAD_GRACE_S))
            status = UPLOAD_NO_ROOM;
    if (status == UPLOAD_OK) {
        w->reserved += more;
        u->pending += more;
    }
    pthread_mutex_unlock(&u->lock);
    if (status != UPLOAD_OK)
        return status;
    if (gnutls_hash(w->hash, data, size) != 0) {
        snprintf(cause, BLOB_CAUSE, "cannot write an upload: its digest failed");
        return UPLOAD_FAILED;
    }
    w->bytes += more;
    return status_of(w->blob->blobs->does->write(w->blob, data, size, cause));
}

upload_status store_upload_write(upload_writer *w, const void *data, size_t size)
{
    char cause[BLOB_CAUSE] = "";
    w->z.next_in = (unsigned char *)(uintptr_t)data; /* zlib only reads there */
    w->z.avail_in = w->gzip ? (unsigned)size : 0;
    if (w->failed == UPLOAD_OK && !w->gzip)
        w->failed = put(w, data, size, cause);
    for (bool more = w->gzip; more && w->failed == UPLOAD_OK; more = w->z.avail_in > 0 || w->z.avail_out == 0) {
        /* A stream may have several members, one after another (RFC 1952, section 2.2). */
        if (w->between && w->z.avail_in == 0)
            break;
        if (w->between && w->z.total_in > 0 && inflateReset(&w->z) != Z_OK) {
            w->failed = UPLOAD_BAD_GZIP;
            break;
        }
        w->z.next_out = w->piece;
        w->z.avail_out = PIECE;
        const int rc = inflate(&w->z, Z_NO_FLUSH);
        w->between = rc == Z_STREAM_END;
        w->failed = rc == Z_OK || rc == Z_STREAM_END || rc == Z_BUF_ERROR
                        ? put(w, w->piece, PIECE - w->z.avail_out, cause)
                        : UPLOAD_BAD_GZIP;
    }
    if (cause[0])
        store_set_message(w->s, cause);
    return w->failed;
}

/* The digest so far as an id; ends the hash. */
static void write_id(char id[UPLOAD_ID_LEN + 1], gnutls_hash_hd_t hash)
{
    unsigned char digest[32];
    gnutls_hash_output(hash, digest);
    for (int i = 0; i < 32; i++)
        snprintf(id + 2 * i, 3, "%02x", digest[i]);
}

upload_status store_upload_end(upload_writer *w, upload_info *out, bool *known)
{
    char cause[BLOB_CAUSE] = "", id[UPLOAD_ID_LEN + 1];
    upload_status status = w->failed;
    *known = false;
    if (status == UPLOAD_OK && w->gzip && (!w->between || w->z.total_in == 0))
        status = UPLOAD_BAD_GZIP;
    if (status == UPLOAD_OK)
        status = status_of(w->blob->blobs->does->seal(w->blob, cause));
    if (status == UPLOAD_OK) {
        write_id(id, w->hash);
        pthread_mutex_lock(&w->s->uploads->lock); /* the blob first, then the row that makes it count */
        status = status_of(w->blob->blobs->does->publish(w->blob, id, cause));
        if (status == UPLOAD_OK)
            status = status_of(w->s->engine->upload_add(w->s, id, w->client, w->bytes, out, known));
        if (status == UPLOAD_OK) /* others may have had it; where this fails the next one mends it */
            w->s->engine->upload_total(w->s, &w->s->uploads->bytes);
        else if (store_upload_get(w->s, id, NULL, &(upload_info){.bytes = 0}) == STORE_NOT_FOUND)
            w->s->uploads->blobs->does->remove(w->s->uploads->blobs, id);
        pthread_mutex_unlock(&w->s->uploads->lock);
    }
    if (cause[0])
        store_set_message(w->s, cause);
    store_upload_abort(w);
    return status;
}

/* ---- reading */

store_status blob_check(int fd, const char *id)
{
    char found[UPLOAD_ID_LEN + 1];
    gnutls_hash_hd_t hash;
    unsigned char piece[16384];
    ssize_t n;
    off_t at = 0;
    if (gnutls_hash_init(&hash, GNUTLS_DIG_SHA256) != 0)
        return STORE_ERROR;
    while ((n = pread(fd, piece, sizeof piece, at)) > 0 || (n < 0 && errno == EINTR))
        if (n > 0) {
            gnutls_hash(hash, piece, (size_t)n);
            at += n;
        }
    write_id(found, hash);
    gnutls_hash_deinit(hash, NULL);
    return n < 0 ? STORE_ERROR : strcmp(found, id) == 0 ? STORE_OK : STORE_DAMAGED;
}

store_status store_upload_descriptor(store *s, const char *id, const char *of_job, int *fd, int64_t *bytes)
{
    upload_info info;
    char cause[256];
    *fd = -1;
    store_status status = store_upload_get(s, id, NULL, &info);
    if (status == STORE_OK && of_job)
        status = s->engine->upload_named(s, id, of_job);
    if (status != STORE_OK)
        return status;
    *bytes = info.bytes;
    *fd = s->uploads->blobs->does->open(s->uploads->blobs, id);
    if (*fd >= 0)
        return STORE_OK;
    status = errno == ENOENT ? STORE_DAMAGED : errno == EHOSTUNREACH ? STORE_AWAY : STORE_ERROR;
    if (status == STORE_AWAY) /* the engine has said more */
        return status;
    snprintf(cause, sizeof cause, "cannot read the file of upload %s: %s", id, strerror(errno));
    store_set_message(s, cause);
    return status;
}

store_status store_upload_open(store *s, const char *id, int *fd, int64_t *bytes)
{
    char cause[256];
    store_status status = store_upload_descriptor(s, id, NULL, fd, bytes);
    if (status != STORE_OK)
        return status;
    /* What it has must be what was sent, or a matrix would silently be another one. */
    const off_t size = lseek(*fd, 0, SEEK_END);
    status = size < 0 ? STORE_ERROR : size == *bytes ? blob_check(*fd, id) : STORE_DAMAGED;
    if (status == STORE_OK)
        return STORE_OK;
    const int reason = errno;
    close(*fd);
    *fd = -1;
    if (status == STORE_DAMAGED)
        snprintf(cause, sizeof cause, "the file of upload %s is missing or not what was sent", id);
    else
        snprintf(cause, sizeof cause, "cannot read the file of upload %s: %s", id, strerror(reason));
    store_set_message(s, cause);
    return status;
}

store_status store_upload_text(store *s, const char *id, upload_text *out)
{
    int fd;
    int64_t bytes;
    *out = (upload_text){NULL, 0};
    store_status status = store_upload_open(s, id, &fd, &bytes);
    if (status != STORE_OK)
        return status;
    void *data = bytes > 0 ? mmap(NULL, (size_t)bytes, PROT_READ, MAP_PRIVATE, fd, 0) : NULL;
    close(fd);
    if (data == MAP_FAILED) {
        store_set_message(s, "cannot map an upload into memory");
        return STORE_ERROR;
    }
    if (data)
        madvise(data, (size_t)bytes, MADV_SEQUENTIAL);
    *out = (upload_text){data ? data : "", (size_t)bytes};
    return STORE_OK;
}

void store_upload_text_done(upload_text *text)
{
    if (text->len > 0)
        munmap((void *)(uintptr_t)text->data, text->len);
    *text = (upload_text){NULL, 0};
}
