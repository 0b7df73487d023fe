/* maintenance.c: checks and copies of a database file, also while a daemon uses it. */
#include "store/sqlite/backup_uploads.h"
#include "store/sqlite/checksum.h"
#include "store/sqlite/file_format.h"
#include "store/sqlite/internal.h"
#include "store/blobs.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* ------------------------------------------------------------------- check */

/* Appends what each row of `sql` says; returns SQLite's result. */
static int collect(sqlite3 *db, const char *sql, const char *finding, FILE *out)
{
    sqlite3_stmt *stmt = NULL;
    int rc = sqlite3_prepare_v2(db, sql, -1, &stmt, NULL);
    while (rc == SQLITE_OK && (rc = sqlite3_step(stmt)) == SQLITE_ROW) {
        const char *text = (const char *)sqlite3_column_text(stmt, 0);
        if (text && strcmp(text, "ok") != 0)
            fprintf(out, finding, text);
        rc = SQLITE_OK;
    }
    sqlite3_finalize(stmt);
    return rc == SQLITE_DONE ? SQLITE_OK : rc;
}

/* Queries whose rows are findings, and the format that they need. What has a checksum is read whole. */
static const struct {
    int version;
    const char *sql, *finding;
} CHECKS[] = {
    {0, "PRAGMA integrity_check(20)", "%s\n"},
    {0, "PRAGMA foreign_key_check", "a row of %s refers to what is not there\n"},
    {0, "SELECT id FROM job WHERE NOT EXISTS (SELECT 1 FROM request WHERE request.job = job.id) LIMIT 20",
     "job %s has no request\n"},
    {4,
     "SELECT status FROM tally WHERE status >= 0 AND jobs <> (SELECT count(*) FROM job WHERE job.status = "
     "tally.status)",
     "the tally of jobs with status %s is wrong\n"},
    {5, "SELECT id FROM job WHERE summary IS NOT NULL AND NOT " SUM_IS("summary_sum", SUM_JOB),
     "the summary of job %s is not what was written\n"},
    {6, "SELECT id FROM job WHERE NOT " SUM_IS("contents_sum", SUM_CONTENTS),
     "the list of the result of job %s is not what was written\n"},
    {6,
     "SELECT id FROM job WHERE contents IS NOT NULL AND CAST(contents AS INTEGER) <>"
     " (SELECT count(*) FROM answer WHERE answer.job = id)"
     " + (SELECT count(*) FROM vector WHERE vector.job = id AND part = 0)"
     " + (SELECT count(*) FROM history WHERE history.job = id AND part = 0)",
     "a part of the result of job %s is missing\n"},
    {7,
     "SELECT name FROM client WHERE waiting <> (SELECT count(*) FROM job WHERE client = name AND status = 0)"
     " OR bytes <> (SELECT coalesce(sum(bytes), 0) FROM job WHERE client = name)",
     "what is counted of client %s is wrong\n"},
    {9,
     "WITH counted AS (SELECT share, priority > " SHARED ", sum(status = 0), sum(small * (status = 0)), sum(status = 1)"
     " FROM job WHERE status < 2 GROUP BY 1, 2), kept AS (SELECT name, ahead, waiting, small, running FROM share"
     " WHERE waiting <> 0 OR small <> 0 OR running <> 0) SELECT DISTINCT share FROM (SELECT * FROM"
     " (SELECT * FROM counted EXCEPT SELECT * FROM kept) UNION ALL SELECT * FROM"
     " (SELECT * FROM kept EXCEPT SELECT * FROM counted))",
     "what is counted of share %s is wrong\n"},
    {5, "SELECT job FROM request WHERE NOT " SUM_IS("sum", SUM_REQUEST),
     "the request of job %s is not what was written\n"},
    {5, "SELECT number || ' of job ' || job FROM answer WHERE NOT " SUM_IS("sum", SUM_ANSWER),
     "the summary of case %s is not what was written\n"},
    {5, "SELECT name || ' of job ' || job FROM vector WHERE NOT " SUM_IS("sum", SUM_VECTOR),
     "the %s is not what was written\n"},
    {10, "SELECT name || ' of job ' || job FROM " FROM_PIECES " WHERE NOT " PIECE_IS,
     "the %s is not what was written\n"},
    {10, "SELECT hex(digest) FROM piece WHERE NOT EXISTS (SELECT 1 FROM vector WHERE shared AND vector.data = digest)",
     "piece %s belongs to no result\n"},
    {5, "SELECT job FROM history WHERE NOT " SUM_IS("sum", SUM_HISTORY),
     "the history of job %s is not what was written\n"},
};

/* A damaged page may end a check early: that is a finding, not a failure of the check. file: the name of the
 * database. */
static bool check(sqlite3 *db, const char *file, store_findings *out)
{
    size_t len = 0;
    *out = (store_findings){0};
    double begun = clock_seconds(CLOCK_MONOTONIC);
    FILE *text = open_memstream(&out->findings, &len);
    if (!text)
        return false;
    int64_t version = 0;
    char why[200] = ""; /* kept at once: what is asked next has an error of its own */
    int rc = file_format_integer(db, "PRAGMA user_version", &version) ? SQLITE_OK : SQLITE_ERROR;
    for (size_t i = 0; i < sizeof CHECKS / sizeof CHECKS[0] && rc == SQLITE_OK; i++)
        if (version >= CHECKS[i].version)
            rc = collect(db, CHECKS[i].sql, CHECKS[i].finding, text);
    if (rc != SQLITE_OK)
        snprintf(why, sizeof why, "%s", sqlite3_errmsg(db));
    uint64_t numbered;
    char *lost = version >= 8 ? trail_missing(db, file, &numbered) : NULL;
    if (lost)
        fprintf(text, "%s\n", lost);
    free(lost);
    if (rc == SQLITE_OK && version >= 3) {
        /* Ids first, a page of them at a time: no read transaction stays open while files are read. */
        char folder[4096];
        enum { PAGE = 100 };
        char ids[PAGE][UPLOAD_ID_LEN + 1], last[UPLOAD_ID_LEN + 1] = "";
        rc = SQLITE_OK;
        snprintf(folder, sizeof folder, "%s-uploads", file);
        for (int n = PAGE; n == PAGE && rc == SQLITE_OK;) {
            sqlite3_stmt *stmt = NULL;
            n = 0;
            rc = sqlite3_prepare_v2(db, "SELECT id FROM upload WHERE id > ?1 ORDER BY id LIMIT 100", -1, &stmt, NULL);
            if (rc == SQLITE_OK)
                rc = sqlite3_bind_text(stmt, 1, last, -1, SQLITE_STATIC);
            while (rc == SQLITE_OK && n < PAGE && sqlite3_step(stmt) == SQLITE_ROW)
                snprintf(ids[n++], sizeof ids[0], "%s", (const char *)sqlite3_column_text(stmt, 0));
            int ended = sqlite3_finalize(stmt);
            rc = rc == SQLITE_OK ? ended : rc;
            for (int i = 0; i < n; i++) {
                char path[sizeof folder + UPLOAD_ID_LEN + 2];
                snprintf(path, sizeof path, "%s/%.64s", folder, ids[i]);
                int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
                const store_status status = fd >= 0 ? blob_check(fd, ids[i]) : STORE_ERROR;
                const int cause = errno;
                if (fd >= 0)
                    close(fd);
                if (status == STORE_DAMAGED)
                    fprintf(text, "the file of upload %s is not what was sent\n", ids[i]);
                else if (status != STORE_OK && backup_has_upload(db, ids[i])) /* else it was deleted meanwhile */
                    fprintf(text, "the file of upload %s cannot be read: %s\n", ids[i], strerror(cause));
            }
            if (n > 0)
                memcpy(last, ids[n - 1], sizeof last);
        }
    }
    if ((!file_format_integer(db, "SELECT count(*) FROM job", &out->jobs) || rc != SQLITE_OK) && !why[0])
        snprintf(why, sizeof why, "%s", sqlite3_errmsg(db));
    if (why[0])
        fprintf(text, "the check ended early: %s\n", why);
    out->seconds = clock_seconds(CLOCK_MONOTONIC) - begun;
    if (fclose(text) == 0)
        return true;
    free(out->findings);
    out->findings = NULL;
    return false;
}

store_status sqlite_check(store *base, store_findings *out)
{
    sqlite_store *s = sqlite_of(base);
    connection *c = sqlite_take_reader(s);
    bool ok = check(c->db, s->path, out);
    if (!ok)
        snprintf(c->message, sizeof c->message, "no memory for the findings");
    return sqlite_give_reader(s, c, ok ? STORE_OK : STORE_ERROR);
}

/* A connection that only reads, on a file of ours. NULL with the reason. */
static sqlite3 *open_file(const char *path, char *message, size_t size)
{
    sqlite3 *db = NULL;
    int version = 0;
    char why[300] = "";
    struct stat st;
    char *absolute = realpath(path, NULL); /* SQLite would take "file:..." for a URI */
    if (!absolute || stat(absolute, &st) != 0)
        snprintf(why, sizeof why, "cannot open the file: %s", strerror(errno));
    else if (!S_ISREG(st.st_mode)) /* it would wait for somebody to write to a pipe */
        snprintf(why, sizeof why, "it is not a regular file");
    else if (sqlite3_open_v2(absolute, &db, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, NULL) != SQLITE_OK)
        snprintf(why, sizeof why, "cannot open the file: %s", file_format_why_unreadable(db));
    else if (sqlite3_busy_timeout(db, 5000) == SQLITE_OK && checksum_register(db) &&
             file_format_check(db, &version, why, sizeof why) && version == 0)
        snprintf(why, sizeof why, "the file is empty: there is no job in it");
    free(absolute);
    if (!why[0])
        return db;
    sqlite3_close(db);
    snprintf(message, size, "%s: %s", path, why);
    return NULL;
}

bool sqlite_check_file(const char *path, store_findings *out, char *message, size_t size)
{
    *out = (store_findings){0};
    sqlite3 *db = open_file(path, message, size);
    if (!db)
        return false;
    char *absolute = realpath(path, NULL);
    bool ok = check(db, absolute ? absolute : path, out);
    free(absolute);
    if (!ok)
        snprintf(message, size, "no memory for the findings");
    sqlite3_close(db);
    return ok;
}

/* ------------------------------------------------------------------ backup */

/* path: of the database that is copied; to: what the copy at `part` will be called. The files of uploads are taken
 * before the pages, so that those are there that are deleted meanwhile, and after them, for those that came meanwhile.
 * What no row of the copy names goes when the copy is opened. */
static bool copy_to(const char *part, const char *to, sqlite3 *from, const char *path, char *message, size_t size)
{
    sqlite3 *copy = NULL;
    char *absolute = realpath(path, NULL);
    bool ok = absolute && sqlite3_open_v2(part, &copy, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX, NULL) == SQLITE_OK;
    if (!ok)
        snprintf(message, size, "cannot write %s: %s", part, copy ? sqlite3_errmsg(copy) : "no memory");
    ok = ok && backup_uploads(from, from, absolute, to, message, size);
    if (ok) { /* one step copies all within one read transaction: it is of one moment, and a writer goes on beside it */
        sqlite3_backup *backup = sqlite3_backup_init(copy, "main", from, "main");
        const int rc = backup ? sqlite3_backup_step(backup, -1) : SQLITE_ERROR;
        if (backup)
            sqlite3_backup_finish(backup);
        ok = rc == SQLITE_DONE;
        if (!ok)
            snprintf(message, size, "cannot copy the database: %s", backup ? sqlite3_errstr(rc) : sqlite3_errmsg(copy));
    }
    ok = ok && backup_uploads(copy, from, absolute, to, message, size);
    free(absolute);
    if (sqlite3_close(copy) != SQLITE_OK && ok) {
        snprintf(message, size, "cannot finish %s", part);
        ok = false;
    }
    return ok;
}

bool sqlite_backup_file(const char *path, const char *to, int64_t *bytes, char *message, size_t size)
{
    char part[4096], folder[4096];
    struct stat st;
    if ((size_t)snprintf(part, sizeof part, "%s.part", to) >= sizeof part ||
        (size_t)snprintf(folder, sizeof folder, "%s-uploads", to) >= sizeof folder || stat(to, &st) == 0 ||
        lstat(folder, &st) == 0) {
        snprintf(message, size,
                 "%s or its uploads are there already, or its name is too long: give the name of a new file", to);
        return false;
    }
    sqlite3 *from = open_file(path, message, size);
    if (!from)
        return false;
    int fd = open(part, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    bool ok = fd >= 0;
    if (!ok)
        snprintf(message, size, "cannot make %s: %s", part, strerror(errno));
    else
        close(fd);
    ok = ok && copy_to(part, to, from, path, message, size);
    if (ok) { /* gets its name, for good: never over a file that is there, and on disk before this returns */
        snprintf(folder, sizeof folder, "%s", to);
        char *slash = strrchr(folder, '/');
        if (slash)
            slash[slash == folder] = '\0';
        else
            strcpy(folder, ".");
        ok = blob_sync(part, 0) && link(part, to) == 0 && unlink(part) == 0 && blob_sync(folder, O_DIRECTORY);
        if (!ok)
            snprintf(message, size, "cannot put the copy at %s: %s", to, strerror(errno));
    }
    if (!ok && fd >= 0) {
        unlink(part);
        backup_uploads_undo(to);
    }
    sqlite3_close(from);
    if (ok)
        *bytes = stat(to, &st) == 0 ? (int64_t)st.st_size : 0;
    return ok;
}
