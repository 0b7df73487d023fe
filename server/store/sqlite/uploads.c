/* uploads.c: the rows of uploads, and what becomes of their files. */
#include "store/uploads.h"
#include "store/sqlite/internal.h"
#include "store/upload_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* What was used so lately does not go to make room: a client that sent it is about to name it in a job. */
#define UPLOAD_GRACE_S 600.0

struct upload_writer {
    store *s;
    upload_file *file;
    int64_t reserved; /* bytes, part of s->uploads_pending */
    upload_status failed;
};

static void keep_cause(store *s, const char *cause)
{
    pthread_mutex_lock(&s->message_lock);
    snprintf(s->message, sizeof s->message, "%s", cause);
    pthread_mutex_unlock(&s->message_lock);
}

static bool is_id(const char *text)
{
    return strlen(text) == UPLOAD_ID_LEN && strspn(text, "0123456789abcdef") == UPLOAD_ID_LEN;
}

void store_limit_uploads(store *s, const upload_limits *limits)
{
    pthread_mutex_lock(&s->upload_lock);
    s->upload_limits = *limits;
    pthread_mutex_unlock(&s->upload_lock);
}

/* ---- rows */

static store_status read_info(connection *c, const char *id, upload_info *out)
{
    store_status status = STORE_NOT_FOUND;
    statement st = statement_begin(c, QUERY_UPLOAD);
    bind_text(&st, 1, id);
    *out = (upload_info){.bytes = 0};
    if (statement_row(&st)) {
        snprintf(out->id, sizeof out->id, "%s", id);
        out->bytes = sqlite3_column_int64(st.stmt, 0);
        out->created = sqlite3_column_double(st.stmt, 1);
        out->used = sqlite3_column_double(st.stmt, 2);
        out->jobs = sqlite3_column_int64(st.stmt, 3);
        status = STORE_OK;
    }
    store_status ended = statement_end(&st);
    return ended == STORE_OK ? status : ended;
}

store_status store_upload_get(store *s, const char *id, upload_info *out)
{
    *out = (upload_info){.bytes = 0};
    if (!is_id(id))
        return STORE_NOT_FOUND;
    connection *c = store_take_reader(s);
    return store_give_reader(s, c, read_info(c, id, out));
}

typedef struct {
    const char *id;
    int64_t bytes;
    upload_info *out;
    bool known;
} add_args;

static store_status add_row(store *s, connection *c, void *args)
{
    (void)s;
    add_args *a = args;
    statement st = statement_begin(c, QUERY_INSERT_UPLOAD);
    bind_text(&st, 1, a->id);
    bind_integer(&st, 2, a->bytes);
    bind_real(&st, 3, store_now());
    store_status status = statement_run(&st);
    a->known = status == STORE_OK && connection_changes(c) == 0;
    if (a->known) {
        st = statement_begin(c, QUERY_TOUCH_UPLOAD);
        bind_text(&st, 1, a->id);
        bind_real(&st, 2, store_now());
        status = statement_run(&st);
    }
    return status == STORE_OK ? read_info(c, a->id, a->out) : status;
}

/* The row of an upload goes unless a job refers to it. */
static store_status delete_row(store *s, connection *c, void *args)
{
    (void)s;
    upload_info found, *a = args;
    statement st = statement_begin(c, QUERY_DELETE_UPLOAD);
    bind_text(&st, 1, a->id);
    store_status status = statement_run(&st);
    if (status != STORE_OK || connection_changes(c) > 0)
        return status;
    status = read_info(c, a->id, &found);
    return status == STORE_OK ? STORE_CONFLICT : status;
}

/* Under upload_lock, so that no writer of the same bytes comes between the row and the file. */
static store_status delete_both(store *s, upload_info *info)
{
    char *path = NULL;
    store_status status = store_write(s, delete_row, info);
    if (status != STORE_OK)
        return status;
    s->uploads_bytes -= info->bytes;
    if (asprintf(&path, "%s/%s", s->uploads_folder, info->id) >= 0) {
        unlink(path); /* if this fails the next start removes it */
        free(path);
    }
    return STORE_OK;
}

store_status store_upload_delete(store *s, const char *id)
{
    upload_info info;
    pthread_mutex_lock(&s->upload_lock);
    store_status status = store_upload_get(s, id, &info);
    if (status == STORE_OK)
        status = delete_both(s, &info);
    pthread_mutex_unlock(&s->upload_lock);
    return status;
}

/* ---- collecting */

/* The one that nobody used for longest, of those that no job uses, if that was before `before`. */
static store_status find_idle(store *s, double before, upload_info *out)
{
    store_status status = STORE_NOT_FOUND;
    connection *c = store_take_reader(s);
    statement st = statement_begin(c, QUERY_IDLE_UPLOAD);
    bind_real(&st, 1, before);
    if (statement_row(&st)) {
        *out = (upload_info){.bytes = sqlite3_column_int64(st.stmt, 1)};
        snprintf(out->id, sizeof out->id, "%s", (const char *)sqlite3_column_text(st.stmt, 0));
        status = STORE_OK;
    }
    store_status ended = statement_end(&st);
    return store_give_reader(s, c, ended == STORE_OK ? status : ended);
}

/* Under upload_lock. Deletes one; false: there is none, or it can't be deleted now. */
static bool collect_one(store *s, double before)
{
    upload_info found;
    return find_idle(s, before, &found) == STORE_OK && delete_both(s, &found) == STORE_OK;
}

store_status store_collect_uploads(store *s, int64_t *count)
{
    int64_t n = 0;
    for (bool more = true; more; n += more) { /* the lock is let go between two, for those who send */
        pthread_mutex_lock(&s->upload_lock);
        more = s->upload_limits.keep_s > 0 && s->uploads_bytes > 0 &&
               collect_one(s, store_now() - s->upload_limits.keep_s);
        pthread_mutex_unlock(&s->upload_lock);
    }
    if (count)
        *count = n;
    return STORE_OK;
}

/* ---- writing */

/* Room for so many more bytes of one writer, within both limits. */
static upload_status reserve(void *ctx, int64_t more)
{
    upload_writer *w = ctx;
    store *s = w->s;
    upload_status status = UPLOAD_OK;
    pthread_mutex_lock(&s->upload_lock);
    const upload_limits *limits = &s->upload_limits;
    if (limits->one > 0 && more > limits->one - w->reserved)
        status = UPLOAD_TOO_LARGE;
    while (status == UPLOAD_OK && limits->all > 0 && s->uploads_bytes + s->uploads_pending + more > limits->all)
        if (!collect_one(s, store_now() - UPLOAD_GRACE_S))
            status = UPLOAD_NO_ROOM;
    if (status == UPLOAD_OK) {
        w->reserved += more;
        s->uploads_pending += more;
    }
    pthread_mutex_unlock(&s->upload_lock);
    return status;
}

void store_upload_abort(upload_writer *w)
{
    if (!w)
        return;
    upload_file_free(w->file);
    pthread_mutex_lock(&w->s->upload_lock);
    w->s->uploads_pending -= w->reserved;
    pthread_mutex_unlock(&w->s->upload_lock);
    free(w);
}

upload_writer *store_upload_begin(store *s, bool gzip, upload_status *status)
{
    char cause[256] = "no memory for an upload";
    upload_writer *w = calloc(1, sizeof *w);
    *status = UPLOAD_FAILED;
    if (w) {
        w->s = s;
        w->file = upload_file_new(s->uploads_folder, gzip, reserve, w, status, cause, sizeof cause);
    }
    if (w && w->file)
        return w;
    keep_cause(s, cause);
    store_upload_abort(w);
    return NULL;
}

upload_status store_upload_write(upload_writer *w, const void *data, size_t size)
{
    char cause[256] = "";
    if (w->failed == UPLOAD_OK)
        w->failed = upload_file_write(w->file, data, size, cause, sizeof cause);
    if (cause[0])
        keep_cause(w->s, cause);
    return w->failed;
}

/* Under upload_lock: the file first, then the row that makes it count. */
static upload_status publish(upload_writer *w, const char *id, upload_info *out, bool *known, char *cause, size_t size)
{
    store *s = w->s;
    add_args a = {id, upload_file_bytes(w->file), out, false};
    upload_status status = upload_file_publish(w->file, s->uploads_folder, id, cause, size);
    if (status != UPLOAD_OK)
        return status;
    store_status stored = store_write(s, add_row, &a);
    *known = a.known;
    if (stored == STORE_OK && !a.known)
        s->uploads_bytes += a.bytes;
    return stored == STORE_OK ? UPLOAD_OK : stored == STORE_FULL ? UPLOAD_DISK_FULL : UPLOAD_FAILED;
}

upload_status store_upload_end(upload_writer *w, upload_info *out, bool *known)
{
    char cause[256] = "", id[UPLOAD_ID_LEN + 1];
    upload_status status = w->failed;
    *known = false;
    if (status == UPLOAD_OK)
        status = upload_file_finish(w->file, id, cause, sizeof cause);
    if (status == UPLOAD_OK) {
        pthread_mutex_lock(&w->s->upload_lock);
        status = publish(w, id, out, known, cause, sizeof cause);
        pthread_mutex_unlock(&w->s->upload_lock);
    }
    if (cause[0])
        keep_cause(w->s, cause);
    store_upload_abort(w);
    return status;
}

/* ---- reading */

/* What the file of an upload has must be what was sent, or a matrix would silently be another one. */
static store_status check_file(int fd, const upload_info *info)
{
    struct stat st;
    if (fstat(fd, &st) != 0)
        return STORE_ERROR;
    return st.st_size == info->bytes ? upload_file_check(fd, info->id) : STORE_DAMAGED;
}

store_status store_upload_open(store *s, const char *id, int *fd, int64_t *bytes)
{
    upload_info info;
    char *path = NULL, cause[256];
    *fd = -1;
    store_status status = store_upload_get(s, id, &info);
    if (status != STORE_OK)
        return status;
    if (asprintf(&path, "%s/%s", s->uploads_folder, id) < 0)
        path = NULL;
    *fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    status = *fd >= 0 ? check_file(*fd, &info) : path && errno == ENOENT ? STORE_DAMAGED : STORE_ERROR;
    int reason = path ? errno : ENOMEM;
    free(path);
    *bytes = info.bytes;
    if (status == STORE_OK)
        return STORE_OK;
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
    if (status == STORE_DAMAGED)
        snprintf(cause, sizeof cause, "the file of upload %s is missing or not what was sent", id);
    else
        snprintf(cause, sizeof cause, "cannot read the file of upload %s: %s", id, strerror(reason));
    keep_cause(s, cause);
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
        keep_cause(s, "cannot map an upload into memory");
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

/* ---- opening: what a crash left */

static bool has_row(store *s, const char *name)
{
    upload_info info;
    return store_upload_get(s, name, &info) != STORE_NOT_FOUND;
}

/* Unfinished files, and finished ones whose row was not committed. Others are not ours to remove. */
static void sweep_files(store *s)
{
    DIR *folder = opendir(s->uploads_folder);
    struct dirent *entry;
    while (folder && (entry = readdir(folder))) {
        bool unfinished = strncmp(entry->d_name, UPLOAD_INCOMING, strlen(UPLOAD_INCOMING)) == 0;
        if (unfinished || (is_id(entry->d_name) && !has_row(s, entry->d_name)))
            unlinkat(dirfd(folder), entry->d_name, 0);
    }
    if (folder)
        closedir(folder);
}

bool store_open_uploads(store *s)
{
    statement st = statement_begin(&s->writer, QUERY_UPLOAD_BYTES);
    if (statement_row(&st))
        s->uploads_bytes = sqlite3_column_int64(st.stmt, 0);
    if (statement_end(&st) != STORE_OK)
        return false;
    sweep_files(s);
    return true;
}
