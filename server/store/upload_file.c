#include "store/upload_file.h"

#include <errno.h>
#include <fcntl.h>
#include <gnutls/crypto.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#define PIECE 65536 /* bytes inflated at once */

struct upload_file {
    int fd;
    char *path; /* of the unfinished file; NULL once it has its name */
    int64_t bytes;
    upload_room room;
    void *room_ctx;
    gnutls_hash_hd_t hash;
    bool gzip, hashing, inflating;
    bool between; /* gzip: at the start of a member */
    z_stream z;
    unsigned char piece[PIECE];
};

static upload_status fail(char *message, size_t size, const char *what)
{
    int cause = errno;
    snprintf(message, size, "cannot %s an upload: %s", what, strerror(cause));
    return cause == ENOSPC || cause == EDQUOT || cause == EFBIG ? UPLOAD_DISK_FULL : UPLOAD_FAILED;
}

/* Makes the folder's entries durable. */
static bool sync_folder(const char *folder)
{
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = fd >= 0 && fsync(fd) == 0;
    if (fd >= 0)
        close(fd);
    return ok;
}

/* The folder; a new one is in its own folder durably before anything is put into it. */
static bool make_folder(const char *folder)
{
    if (mkdir(folder, 0700) != 0)
        return errno == EEXIST;
    const char *slash = strrchr(folder, '/');
    char *parent = strndup(slash ? folder : ".", slash ? (size_t)(slash - folder) + 1 : 1);
    bool ok = parent && sync_folder(parent);
    int cause = errno;
    free(parent);
    if (!ok)
        rmdir(folder); /* the next one tries again */
    errno = cause;
    return ok;
}

static bool open_unfinished(upload_file *f, const char *folder)
{
    if (!make_folder(folder))
        return false;
    if (asprintf(&f->path, "%s/" UPLOAD_INCOMING "XXXXXX", folder) < 0) {
        f->path = NULL;
        errno = ENOMEM;
        return false;
    }
    f->fd = mkostemp(f->path, O_CLOEXEC);
    if (f->fd >= 0)
        return true;
    free(f->path);
    f->path = NULL;
    return false;
}

static bool start_coding(upload_file *f)
{
    f->hashing = gnutls_hash_init(&f->hash, GNUTLS_DIG_SHA256) == 0;
    f->inflating = f->hashing && f->gzip && inflateInit2(&f->z, 15 + 16) == Z_OK; /* 16: gzip, not zlib (zlib.h) */
    f->between = true;
    errno = ENOMEM;
    return f->hashing && f->inflating == f->gzip;
}

upload_file *upload_file_new(const char *folder, bool gzip, upload_room room, void *ctx, upload_status *status,
                             char *message, size_t size)
{
    upload_file *f = calloc(1, sizeof *f);
    errno = ENOMEM;
    if (f)
        f->fd = -1;
    if (f) {
        f->gzip = gzip;
        f->room = room;
        f->room_ctx = ctx;
    }
    if (f && start_coding(f) && open_unfinished(f, folder)) {
        *status = UPLOAD_OK;
        return f;
    }
    *status = fail(message, size, "begin");
    upload_file_free(f);
    return NULL;
}

bool upload_write_all(int fd, const void *data, size_t size)
{
    const unsigned char *at = data;
    while (size > 0) {
        ssize_t n = write(fd, at, size);
        if (n < 0 && errno != EINTR)
            return false;
        at += n > 0 ? n : 0;
        size -= n > 0 ? (size_t)n : 0;
    }
    return true;
}

static upload_status put(upload_file *f, const unsigned char *data, size_t size, char *message, size_t message_size)
{
    upload_status status = size > 0 ? f->room(f->room_ctx, (int64_t)size) : UPLOAD_OK;
    if (status != UPLOAD_OK || size == 0)
        return status;
    errno = EIO;
    if (gnutls_hash(f->hash, data, size) != 0 || !upload_write_all(f->fd, data, size))
        return fail(message, message_size, "write");
    f->bytes += (int64_t)size;
    return UPLOAD_OK;
}

/* Inflates what z.next_in has. A stream may have several members, one after another (RFC 1952, section 2.2). */
static upload_status put_inflated(upload_file *f, char *message, size_t size)
{
    upload_status status = UPLOAD_OK;
    do {
        if (f->between && f->z.avail_in > 0 && f->z.total_in > 0 && inflateReset(&f->z) != Z_OK)
            return UPLOAD_BAD_GZIP;
        f->between = f->between && f->z.avail_in == 0;
        if (f->between)
            break;
        f->z.next_out = f->piece;
        f->z.avail_out = PIECE;
        int rc = inflate(&f->z, Z_NO_FLUSH);
        if (rc != Z_OK && rc != Z_STREAM_END && rc != Z_BUF_ERROR)
            return UPLOAD_BAD_GZIP;
        f->between = rc == Z_STREAM_END;
        status = put(f, f->piece, PIECE - f->z.avail_out, message, size);
    } while (status == UPLOAD_OK && (f->z.avail_in > 0 || f->z.avail_out == 0));
    return status;
}

upload_status upload_file_write(upload_file *f, const void *data, size_t size, char *message, size_t message_size)
{
    if (!f->gzip)
        return put(f, data, size, message, message_size);
    f->z.next_in = (unsigned char *)(uintptr_t)data; /* zlib only reads there */
    f->z.avail_in = (unsigned)size;
    return put_inflated(f, message, message_size);
}

static void write_id(char id[UPLOAD_ID_LEN + 1], gnutls_hash_hd_t hash)
{
    unsigned char digest[32];
    gnutls_hash_output(hash, digest);
    for (int i = 0; i < 32; i++)
        snprintf(id + 2 * i, 3, "%02x", digest[i]);
}

store_status upload_file_check(int fd, const char *id)
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

upload_status upload_file_finish(upload_file *f, char id[UPLOAD_ID_LEN + 1], char *message, size_t size)
{
    if (f->gzip && (!f->between || f->z.total_in == 0))
        return UPLOAD_BAD_GZIP;
    if (fsync(f->fd) != 0)
        return fail(message, size, "sync");
    write_id(id, f->hash);
    return UPLOAD_OK;
}

upload_status upload_file_publish(upload_file *f, const char *folder, const char *id, char *message, size_t size)
{
    char *name = NULL;
    errno = ENOMEM;
    if (asprintf(&name, "%s/%s", folder, id) < 0)
        return fail(message, size, "name");
    bool ok = rename(f->path, name) == 0;
    if (ok) {
        free(f->path);
        f->path = NULL;
        ok = sync_folder(folder);
    }
    upload_status status = ok ? UPLOAD_OK : fail(message, size, "name");
    free(name);
    return status;
}

int64_t upload_file_bytes(const upload_file *f)
{
    return f->bytes;
}

void upload_file_free(upload_file *f)
{
    if (!f)
        return;
    if (f->path)
        unlink(f->path);
    free(f->path);
    if (f->fd >= 0)
        close(f->fd);
    if (f->inflating)
        inflateEnd(&f->z);
    if (f->hashing)
        gnutls_hash_deinit(f->hash, NULL);
    free(f);
}
