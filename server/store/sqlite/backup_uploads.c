#include "store/sqlite/backup_uploads.h"
#include "store/blobs.h"
#include "store/sqlite/file_format.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Folders as descriptors. */
typedef struct {
    int from, to;
} folders;

static int open_folder(const char *db, bool make)
{
    char path[4096];
    if ((size_t)snprintf(path, sizeof path, "%s-uploads", db) >= sizeof path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    if (make && mkdir(path, 0700) != 0 && errno != EEXIST)
        return -1;
    return open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

/* As a link, or where the file system has none as a copy. False: errno. */
static bool put_file(const folders *f, const char *id)
{
    char piece[65536];
    ssize_t n = -1;
    if (linkat(f->from, id, f->to, id, 0) == 0 || errno == EEXIST)
        return true;
    if (errno == ENOENT)
        return false;
    int in = openat(f->from, id, O_RDONLY | O_CLOEXEC);
    int out = in < 0 ? -1 : openat(f->to, id, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    bool ok = out >= 0;
    while (ok && (n = read(in, piece, sizeof piece)) != 0)
        ok = n > 0 ? blob_write_all(out, piece, (size_t)n) : errno == EINTR;
    ok = ok && fsync(out) == 0;
    int cause = errno;
    if (in >= 0)
        close(in);
    if (out >= 0)
        close(out);
    errno = cause;
    return ok;
}

/* Takes the row of an upload out of the copy, as it went from the original a moment later. False: a job of the copy
 * needs it. */
static bool forget(sqlite3 *copy, const char *id)
{
    sqlite3_stmt *stmt = NULL;
    bool done = sqlite3_prepare_v2(copy,
                                   "DELETE FROM upload WHERE id = ?1"
                                   " AND NOT EXISTS (SELECT 1 FROM upload_use WHERE upload = ?1)",
                                   -1, &stmt, NULL) == SQLITE_OK &&
                sqlite3_bind_text(stmt, 1, id, -1, SQLITE_TRANSIENT) == SQLITE_OK &&
                sqlite3_step(stmt) == SQLITE_DONE && sqlite3_changes(copy) == 1;
    sqlite3_finalize(stmt);
    return done;
}

bool backup_has_upload(sqlite3 *db, const char *id)
{
    sqlite3_stmt *stmt = NULL;
    bool found = sqlite3_prepare_v2(db, "SELECT 1 FROM upload WHERE id = ?1", -1, &stmt, NULL) == SQLITE_OK &&
                 sqlite3_bind_text(stmt, 1, id, -1, SQLITE_TRANSIENT) == SQLITE_OK && sqlite3_step(stmt) == SQLITE_ROW;
    sqlite3_finalize(stmt);
    return found;
}

bool backup_uploads(sqlite3 *db, sqlite3 *original, const char *from, const char *to, char *message, size_t size)
{
    folders f = {-1, -1};
    int64_t any = 0; /* files of formats before 3 have no such table */
    const bool read = file_format_integer(db, "SELECT count(*) FROM sqlite_schema WHERE name = 'upload'", &any) &&
                      (any == 0 || file_format_integer(db, "SELECT EXISTS (SELECT 1 FROM upload)", &any));
    bool ok = read && any == 0;
    if (!read)
        snprintf(message, size, "cannot read the uploads: %s", sqlite3_errmsg(db));
    else if (any > 0 && ((f.from = open_folder(from, false)) < 0 || (f.to = open_folder(to, true)) < 0))
        snprintf(message, size, "cannot open the folder of uploads beside %s: %s", f.from < 0 ? from : to,
                 strerror(errno));
    else if (any > 0) {
        sqlite3_stmt *stmt = NULL;
        int rc = sqlite3_prepare_v2(db, "SELECT id FROM upload", -1, &stmt, NULL);
        ok = rc == SQLITE_OK;
        while (ok && (rc = sqlite3_step(stmt)) == SQLITE_ROW) {
            const char *id = (const char *)sqlite3_column_text(stmt, 0);
            ok = id && !strchr(id, '/');
            if (ok && !put_file(&f, id)) {
                /* A file that is missing may have been deleted after its row had been read: of the original the copy's
                 * turn will tell, of the copy the original does. */
                const int cause = errno;
                ok = cause == ENOENT && (db == original || (!backup_has_upload(original, id) && forget(db, id)));
                errno = cause;
            }
            if (!ok)
                snprintf(message, size, "cannot copy upload %s: %s", id ? id : "", strerror(errno));
        }
        sqlite3_finalize(stmt);
        if (ok && rc != SQLITE_DONE) {
            snprintf(message, size, "cannot read the uploads: %s", sqlite3_errmsg(db));
            ok = false;
        }
        if (ok && fsync(f.to) != 0) {
            snprintf(message, size, "cannot sync the folder of uploads: %s", strerror(errno));
            ok = false;
        }
    }
    if (f.from >= 0)
        close(f.from);
    if (f.to >= 0)
        close(f.to);
    return ok;
}

void backup_uploads_undo(const char *to)
{
    char path[4096];
    int fd = open_folder(to, false);
    DIR *folder = fd >= 0 ? fdopendir(fd) : NULL;
    struct dirent *entry;
    while (folder && (entry = readdir(folder)))
        unlinkat(fd, entry->d_name, 0); /* "." and ".." are refused */
    if (folder)
        closedir(folder);
    else if (fd >= 0)
        close(fd);
    snprintf(path, sizeof path, "%s-uploads", to);
    rmdir(path);
}
