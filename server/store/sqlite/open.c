/* open.c: opening and closing a database, its connections, and the table of the engine. */
#include "store/blobs.h"
#include "store/sqlite/file_format.h"
#include "store/sqlite/internal.h"
#include "store/sqlite/sqlite.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <sys/statvfs.h>

/* ---- opening */

static const char NO_ROOM[] = "; there is no room on its disk";
enum { SPARE_FLAGS = O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK };

static bool open_connections(sqlite_store *s, const char *path, char *message, size_t size)
{
    int version = 0;
    char *folder = NULL, *spare = NULL;
    sqlite3_stmt *stmt = NULL;
    s->path = realpath(path, NULL); /* absolute: SQLite would take "file:..." for a URI */
    if (!s->path) {
        snprintf(message, size, "cannot resolve the path: %s", strerror(errno));
        return false;
    }
    if (asprintf(&spare, "%s-spare", s->path) < 0)
        spare = NULL;
    s->spare = spare ? open(spare, SPARE_FLAGS) : -1;
    sqlite_lend_spare(s);
    bool ok = connection_open(&s->writer, s->path, true, message, size) &&
              file_format_check(s->writer.db, &version, message, size);
    if (ok) { /* the journal must be WAL: readers then never wait for the writer */
        ok = sqlite3_prepare_v2(s->writer.db, "PRAGMA journal_mode = WAL", -1, &stmt, NULL) == SQLITE_OK &&
             sqlite3_step(stmt) == SQLITE_ROW && strcmp((const char *)sqlite3_column_text(stmt, 0), "wal") == 0;
        sqlite3_finalize(stmt);
        if (!ok)
            snprintf(message, size, "cannot use a write-ahead log beside the file: %s", sqlite3_errmsg(s->writer.db));
    }
    ok = ok && file_format_upgrade(s->writer.db, version, message, size);
    if (ok) { /* ids go on where the file's newest one stands */
        statement st = statement_begin(&s->writer, QUERY_NEWEST_ID);
        unsigned long long ms = 0;
        unsigned sequence = 0;
        if (statement_row(&st) && sqlite3_column_type(st.stmt, 0) == SQLITE_TEXT &&
            sscanf((const char *)sqlite3_column_text(st.stmt, 0), "%12llx%4x", &ms, &sequence) == 2) {
            s->last_ms = ms;
            s->sequence = sequence;
        }
        ok = statement_end(&st, STORE_OK) == STORE_OK;
        if (!ok)
            snprintf(message, size, "cannot read the jobs: %s", s->writer.message);
    }
    if (ok) {
        uint64_t number;
        s->base.missing = trail_missing(s->writer.db, s->path, &number);
        trail_open(&s->trail, s->writer.db, s->path);
        s->trail.number = number; /* past those that are lost, so that they are told once */
    }
    if (ok && s->spare < 0 && spare)
        s->spare = open(spare, SPARE_FLAGS | O_CREAT, 0600);
    if (ok)
        sqlite_take_spare(s);
    free(spare);
    for (int i = 0; ok && i < STORE_READERS; i++) {
        ok = connection_open(&s->readers[i], s->path, false, message, size);
        s->readers_free[s->n_readers_free] = &s->readers[i];
        s->n_readers_free += ok;
    }
    if (!ok || !sqlite_log_begin(s, message, size))
        return false;
    if (asprintf(&folder, "%s-uploads", s->path) < 0)
        folder = NULL;
    ok = store_uploads_begin(&s->base, folder ? blobs_in_folder(folder) : NULL, message, size);
    free(folder);
    return ok;
}

store_status sqlite_check_place(const sqlite_store *s, connection *c)
{
    struct stat ours, there;
    if (fstat(s->file, &ours) == 0 && stat(s->path, &there) == 0 && ours.st_dev == there.st_dev &&
        ours.st_ino == there.st_ino)
        return STORE_OK;
    snprintf(c->message, sizeof c->message,
             "the database file was deleted, moved or replaced while it is in use: put it back, or restart");
    return STORE_ERROR;
}

store *sqlite_open(const char *path, char *message, size_t size)
{
    sqlite_store *s = calloc(1, sizeof *s);
    if (!s) {
        snprintf(message, size, "no memory");
        return NULL;
    }
    store_base_begin(&s->base, &STORE_SQLITE);
    pthread_mutex_init(&s->writer_lock, NULL);
    pthread_mutex_init(&s->move_lock, NULL);
    batch_begin(&s->changes, sqlite_run_batch, s);
    pthread_mutex_init(&s->readers_lock, NULL);
    pthread_cond_init(&s->reader_free, NULL);
    pthread_mutex_init(&s->sync_lock, NULL);
    pthread_cond_init(&s->sync_asked, NULL);
    pthread_cond_init(&s->sync_ended, NULL);
    s->trail.fd = s->spare = -1;
    s->claims = (uint64_t)(clock_seconds(CLOCK_REALTIME) * 1e6);
    /* The file is locked against a second daemon by flock, not by a file beside it: that follows links, ends with the
     * process and leaves nothing behind. It does not meet SQLite's own locks, but closing any descriptor of the file
     * drops those of this process, so this one is closed after SQLite's. */
    struct stat st;
    bool ok = false;
    s->file = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0600);
    if (s->file < 0)
        snprintf(message, size, "cannot open the file: %m%s",
                 errno == ENOENT   ? "; make its folder first, or give another path"
                 : errno == EACCES ? "; give a path that this user may write"
                                   : "");
    else if (fstat(s->file, &st) != 0 || !S_ISREG(st.st_mode))
        snprintf(message, size, "it is not a regular file");
    else if (flock(s->file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        snprintf(message, size, "another daemon is using this file; stop it or give another path");
    else /* a file system without flock (ENOLCK, EOPNOTSUPP) is used unguarded */
        ok = open_connections(s, path, message, size);
    if (!ok && s->path && sqlite_is_full(s->file) && strlen(message) + sizeof NO_ROOM <= size)
        strcat(message, NO_ROOM);
    if (ok && !sqlite_sync_begin(s)) {
        snprintf(message, size, "cannot start a thread");
        ok = false;
    }
    if (ok)
        return &s->base;
    sqlite_close(&s->base);
    return NULL;
}

void sqlite_close(store *base)
{
    sqlite_store *s = sqlite_of(base);
    sqlite_sync_end(s);
    for (int i = 0; i < STORE_READERS; i++)
        connection_close(&s->readers[i]);
    connection_close(&s->mover);
    connection_close(&s->writer); /* the last one: checkpoints and removes the journal */
    if (s->file >= 0)
        close(s->file);
    if (s->spare >= 0)
        close(s->spare);
    pthread_cond_destroy(&s->sync_ended);
    pthread_cond_destroy(&s->sync_asked);
    pthread_mutex_destroy(&s->sync_lock);
    pthread_cond_destroy(&s->reader_free);
    pthread_mutex_destroy(&s->readers_lock);
    batch_end(&s->changes);
    pthread_mutex_destroy(&s->move_lock);
    pthread_mutex_destroy(&s->writer_lock);
    if (s->trail.fd >= 0)
        close(s->trail.fd);
    free(s->trail.path);
    store_base_end(base);
    free(s->path);
    free(s);
}

const store_engine STORE_SQLITE = {
    .scheme = "",
    .open = sqlite_open,
    .close = sqlite_close,
    .submit = sqlite_submit,
    .find_repeat = sqlite_find_repeat,
    .claim = sqlite_claim,
    .use_lease = sqlite_use_lease,
    .recover = sqlite_recover,
    .expire = sqlite_expire,
    .retain = sqlite_retain,
    .dismiss = sqlite_dismiss,
    .get = sqlite_get,
    .list = sqlite_list,
    .get_body = sqlite_get_body,
    .get_cases = sqlite_get_cases,
    .results = &SQLITE_RESULTS,
    .counts = sqlite_counts,
    .webhook_next = sqlite_webhook_next,
    .webhooks_open = sqlite_webhooks_open,
    .webhook_attempted = sqlite_webhook_attempted,
    .upload_get = sqlite_upload_get,
    .upload_named = sqlite_upload_named,
    .upload_add = sqlite_upload_add,
    .upload_forget = sqlite_upload_forget,
    .upload_idle = sqlite_upload_idle,
    .upload_total = sqlite_upload_total,
    .tidy = sqlite_tidy,
    .try_write = sqlite_try_write,
    .free_bytes = sqlite_free_bytes,
    .check = sqlite_check,
    .check_file = sqlite_check_file,
    .moves = &SQLITE_MOVES,
    .backup_file = sqlite_backup_file,
};

/* ---- readers */

connection *sqlite_take_reader(sqlite_store *s)
{
    pthread_mutex_lock(&s->readers_lock);
    while (s->n_readers_free == 0)
        pthread_cond_wait(&s->reader_free, &s->readers_lock);
    connection *c = s->readers_free[--s->n_readers_free];
    pthread_mutex_unlock(&s->readers_lock);
    return c;
}

store_status sqlite_give_reader(sqlite_store *s, connection *c, store_status status)
{
    if (status == STORE_ERROR || status == STORE_DAMAGED)
        store_set_message(&s->base, c->message);
    pthread_mutex_lock(&s->readers_lock);
    s->readers_free[s->n_readers_free++] = c;
    pthread_cond_signal(&s->reader_free);
    pthread_mutex_unlock(&s->readers_lock);
    return status;
}

int64_t sqlite_free_bytes(store *base)
{
    sqlite_store *s = sqlite_of(base);
    struct statvfs disk;
    /* The name is the connection's for as long as it lives: no lock. */
    const char *path = sqlite3_db_filename(s->writer.db, "main");
    if (!path || !*path || statvfs(path, &disk) != 0)
        return -1;
    return (int64_t)disk.f_bavail * (int64_t)disk.f_frsize;
}
