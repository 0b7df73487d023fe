/* blob_folder.c: blobs as files of a folder, named by their digests; unfinished ones have names that are no digest. */
#include "store/blobs.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define INCOMING "incoming-" /* how names of unfinished files begin */

typedef struct {
    blobs base;
    char *path;
} folder;

typedef struct {
    blob_writer base;
    int fd;
    char *path; /* of the unfinished file; NULL once it has its name */
} file_writer;

static store_status fail(const char *what, char cause[BLOB_CAUSE])
{
    int why = errno;
    snprintf(cause, BLOB_CAUSE, "cannot %s an upload: %s", what, strerror(why));
    return why == ENOSPC || why == EDQUOT || why == EFBIG ? STORE_FULL : STORE_ERROR;
}

bool blob_write_all(int fd, const void *data, size_t size)
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

bool blob_sync(const char *path, int flags)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | flags);
    bool ok = fd >= 0 && fsync(fd) == 0;
    if (fd >= 0)
        close(fd);
    return ok;
}

static void folder_end(blob_writer *writer)
{
    file_writer *w = (file_writer *)writer;
    if (w->path)
        unlink(w->path);
    free(w->path);
    if (w->fd >= 0)
        close(w->fd);
    free(w);
}

static store_status folder_begin(blobs *b, blob_writer **out, char cause[BLOB_CAUSE])
{
    file_writer *w = calloc(1, sizeof *w);
    errno = ENOMEM;
    if (!w)
        return fail("begin", cause);
    *w = (file_writer){.base.blobs = b, .fd = -1};
    /* A new folder is in its own folder durably before anything is put into it. */
    const char *path = ((folder *)b)->path, *slash = strrchr(path, '/');
    const bool made = mkdir(path, 0700) == 0;
    bool there = made || errno == EEXIST;
    if (made) {
        char *parent = strndup(slash ? path : ".", slash ? (size_t)(slash - path) + 1 : 1);
        there = parent && blob_sync(parent, O_DIRECTORY);
        const int cause_of = errno;
        free(parent);
        if (!there)
            rmdir(path); /* the next one tries again */
        errno = cause_of;
    }
    if (there) {
        errno = ENOMEM;
        if (asprintf(&w->path, "%s/" INCOMING "XXXXXX", path) < 0)
            w->path = NULL;
        else if ((w->fd = mkostemp(w->path, O_CLOEXEC)) < 0) {
            free(w->path);
            w->path = NULL;
        }
    }
    if (w->fd < 0) {
        store_status status = fail("begin", cause);
        folder_end(&w->base);
        return status;
    }
    *out = &w->base;
    return STORE_OK;
}

static store_status folder_write(blob_writer *w, const void *data, size_t size, char cause[BLOB_CAUSE])
{
    return blob_write_all(((file_writer *)w)->fd, data, size) ? STORE_OK : fail("write", cause);
}

static store_status folder_seal(blob_writer *w, char cause[BLOB_CAUSE])
{
    return fsync(((file_writer *)w)->fd) == 0 ? STORE_OK : fail("sync", cause);
}

static store_status folder_publish(blob_writer *writer, const char *id, char cause[BLOB_CAUSE])
{
    file_writer *w = (file_writer *)writer;
    char *name = NULL;
    errno = ENOMEM;
    if (asprintf(&name, "%s/%s", ((folder *)writer->blobs)->path, id) < 0)
        return fail("name", cause);
    bool ok = rename(w->path, name) == 0;
    if (ok) {
        free(w->path);
        w->path = NULL;
        ok = blob_sync(((folder *)writer->blobs)->path, O_DIRECTORY);
    }
    store_status status = ok ? STORE_OK : fail("name", cause);
    free(name);
    return status;
}

static int folder_open(blobs *b, const char *id)
{
    char *path = NULL;
    errno = ENOMEM;
    if (asprintf(&path, "%s/%s", ((folder *)b)->path, id) < 0)
        return -1;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK), cause = errno;
    free(path);
    errno = cause;
    return fd;
}

static void folder_remove(blobs *b, const char *id)
{
    char *path = NULL;
    if (asprintf(&path, "%s/%s", ((folder *)b)->path, id) < 0)
        return;
    unlink(path);
    free(path);
}

/* Files with other names are not ours to remove. */
static void folder_sweep(blobs *b, bool (*keep)(void *ctx, const char *id), void *ctx)
{
    DIR *dir = opendir(((folder *)b)->path);
    struct dirent *entry;
    while (dir && (entry = readdir(dir)))
        if (strncmp(entry->d_name, INCOMING, strlen(INCOMING)) == 0 ||
            (blob_is_id(entry->d_name) && !keep(ctx, entry->d_name)))
            unlinkat(dirfd(dir), entry->d_name, 0);
    if (dir)
        closedir(dir);
}

static void folder_close(blobs *b)
{
    folder *f = (folder *)b;
    free(f->path);
    free(f);
}

blobs *blobs_in_folder(const char *path)
{
    static const blob_operations FOLDER = {folder_begin, folder_write,  folder_seal,  folder_publish, folder_end,
                                           folder_open,  folder_remove, folder_sweep, folder_close};
    folder *f = calloc(1, sizeof *f);
    if (f) {
        f->base.does = &FOLDER;
        f->path = strdup(path);
    }
    if (f && f->path)
        return &f->base;
    free(f);
    return NULL;
}
