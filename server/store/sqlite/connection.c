#include "store/sqlite/connection.h"
#include "store/sqlite/checksum.h"
#include "store/sqlite/file_format.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define BUSY_TIMEOUT_MS 5000
#define JOB_COLUMNS                                                                                                    \
    "id, status, progress, attempts, created, started, finished, tags, summary, error, refines, priority, "            \
    "summary IS NULL OR " SUM_IS("summary_sum", SUM_JOB) ", client"

/* The jobs of a client, or of any where that is NULL, that use an upload. */
#define USES_OF(upload, of)                                                                                            \
    "upload_use JOIN job ON job.id = upload_use.job WHERE upload_use.upload = " upload " AND (" of                     \
    " IS NULL OR job.client = " of ")"

/* Filters of every listing: time, further tags, and a bound on ids that the time implies (they begin with it). */
#define LIST_FILTER                                                                                                    \
    " AND job.id >= ?10 AND created >= ?5 AND created < ?6 AND (?11 IS NULL OR client = ?11)"                          \
    " AND (?7 IS NULL OR EXISTS (SELECT 1 FROM tag AS t WHERE t.tag = ?7 AND t.job = job.id))"                         \
    " AND (?8 IS NULL OR EXISTS (SELECT 1 FROM tag AS t WHERE t.tag = ?8 AND t.job = job.id))"                         \
    " AND (?9 IS NULL OR EXISTS (SELECT 1 FROM tag AS t WHERE t.tag = ?9 AND t.job = job.id)) "
#define LIST(status, than, order)                                                                                      \
    "SELECT " JOB_COLUMNS " FROM job WHERE id " than " ?1 " status LIST_FILTER "ORDER BY id " order " LIMIT ?2"
#define LIST_CLIENT(than, order)                                                                                       \
    "SELECT " JOB_COLUMNS " FROM job INDEXED BY job_by_client WHERE client = ?11 AND client <> '' AND id " than " ?1"  \
    " AND (?3 IS NULL OR status = ?3) " LIST_FILTER "ORDER BY id " order " LIMIT ?2"
/* Neither scheme nor host are of upper or lower case; what follows the place is no more of a host or port. */
#define NOT_AT(place)                                                                                                  \
    " AND (" place " IS NULL OR lower(substr(url, 1, length(" place "))) <> lower(" place ")"                          \
    " OR instr('/?#', substr(url, length(" place ") + 1, 1)) = 0)"

/* The job that is next: of the share whose turn it is. A share whose jobs have all waited longer than they may, which
 * nobody has said yet, is passed over. */
#define CLAIM(of_share, of_job)                                                                                        \
    "UPDATE job SET status = 1, attempts = attempts + 1, progress = 0, started = ?1, finished = 0, owner = ?2,"        \
    " lease = ?1 + ?3 WHERE id = (SELECT next FROM (SELECT (SELECT id FROM job INDEXED BY " of_job                     \
    " AND share = share.name AND (priority > " SHARED ") = share.ahead AND (queue_until = 0 OR queue_until >= ?1)"     \
    " ORDER BY priority DESC, id LIMIT 1) AS next FROM share INDEXED BY " of_share                                     \
    " AND next IS NOT NULL ORDER BY ahead DESC, running, used, name LIMIT 1)) RETURNING " JOB_COLUMNS
#define LIST_TAG(status, than, order)                                                                                  \
    "SELECT " JOB_COLUMNS " FROM tag CROSS JOIN job ON job.id = tag.job WHERE tag.tag = ?4 AND tag.job " than          \
    " ?1 " status LIST_FILTER "ORDER BY tag.job " order " LIMIT ?2"

static const char *const SQL[QUERY_COUNT] = {
    [QUERY_BEGIN] = "BEGIN IMMEDIATE",
    [QUERY_COMMIT] = "COMMIT",
    [QUERY_ROLLBACK] = "ROLLBACK",
    [QUERY_SAVEPOINT] = "SAVEPOINT change",
    [QUERY_RELEASE_SAVEPOINT] = "RELEASE change",
    [QUERY_ROLLBACK_TO] = "ROLLBACK TO change",
    [QUERY_NEWEST_ID] = "SELECT max(id) FROM job",
    [QUERY_FIND_KEY] = "SELECT " JOB_COLUMNS ", length(body) = ?2 AND body = ?3"
                       " FROM job JOIN request ON request.job = job.id WHERE idempotency_key = ?1",
    [QUERY_INSERT_JOB] = "INSERT INTO job(id, status, created, tags, idempotency_key, refines, priority, queue_until,"
                         " bytes, client, share, small) VALUES(?1, 0, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)",
    [QUERY_INSERT_REQUEST] = "INSERT INTO request(job, body, sum) VALUES(?1, ?2, " SUM_OF("?1, ?2") ")",
    [QUERY_INSERT_TAGS] = "INSERT OR IGNORE INTO tag(tag, job)"
                          " SELECT value, ?1 FROM json_each(?2) WHERE type = 'text'",
    [QUERY_CLAIM] = CLAIM("share_by_turn WHERE waiting > 0", "job_by_turn WHERE status = 0"),
    [QUERY_CLAIM_SMALL] = CLAIM("share_by_lane WHERE small > 0", "job_by_lane WHERE status = 0 AND small > 0"),
    [QUERY_BODY] = "SELECT body, " SUM_IS("sum", SUM_REQUEST) " FROM request WHERE job = ?1",
    [QUERY_RENEW] = "UPDATE job SET lease = ?3, progress = ?4 WHERE id = ?1 AND status = 1 AND owner = ?2",
    /* ?3: now. The lease was extended when its share was charged last, and by at most ?4. */
    [QUERY_CHARGE] = "UPDATE share SET used = used + (SELECT min(?4, max(0.0, ?3 + ?4 - lease)) FROM job WHERE id = ?1)"
                     " WHERE (name, ahead) = (SELECT share, priority > " SHARED " FROM job"
                     " WHERE id = ?1 AND status = 1 AND owner = ?2)",
    [QUERY_FINISH] = "UPDATE job SET status = ?3, finished = ?4, summary = ?5, error = ?6, owner = NULL, lease = 0,"
                     " summary_sum = CASE WHEN ?5 IS NOT NULL THEN " SUM_OF(
                         "?1, ?3, ?5") " END,"
                                       " progress = CASE WHEN ?3 = 2 THEN 100 ELSE progress END"
                                       " WHERE id = ?1 AND status = 1 AND owner = ?2",
    [QUERY_INSERT_ANSWER] = "INSERT INTO answer(job, number, name, summary, sum) VALUES(?1, ?2, ?3, ?4,"
                            " " SUM_OF("?1, ?2, ?3, ?4") ")",
    [QUERY_INSERT_PIECE] = "INSERT INTO piece(digest, data) SELECT ?1, ?2"
                           " WHERE NOT EXISTS (SELECT 1 FROM piece WHERE digest = ?1)",
    [QUERY_INSERT_VECTOR] = "INSERT INTO vector(job, name, part, version, count, data, answer, shared, sum)"
                            " VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, " SUM_OF("?1, ?7, ?2, ?3, ?4, ?5, ?6") ")",
    [QUERY_INSERT_HISTORY] = "INSERT INTO history(job, last, part, version, columns, data, answer, sum)"
                             " VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, " SUM_OF("?1, ?7, ?3, ?4, ?5, ?2, ?6") ")",
    [QUERY_RELEASE] = "UPDATE job SET status = 0, attempts = attempts - ?3, progress = 0, started = 0, owner = NULL,"
                      " lease = 0, queue_until = 0, small = 0 WHERE id = ?1 AND status = 1 AND owner = ?2",
    [QUERY_RECOVER_FAIL] = "UPDATE job SET status = 3, finished = ?2, error = ?3, owner = NULL, lease = 0"
                           " WHERE status = 1 AND attempts >= ?1",
    [QUERY_RECOVER_REQUEUE] = "UPDATE job SET status = 0, progress = 0, started = 0, owner = NULL, lease = 0,"
                              " queue_until = 0 WHERE status = 1",
    [QUERY_DISMISS_RUNNING] = "UPDATE job SET finished = ?2 WHERE id = ?1 AND status = 1 AND finished = 0",
    [QUERY_END_DISMISSED] = "UPDATE job SET status = 4, owner = NULL, lease = 0 WHERE status = 1 AND finished > 0"
                            " AND (?1 IS NULL OR (id = ?1 AND owner = ?2))",
    [QUERY_DISMISS] = "UPDATE job SET status = 4, finished = ?2 WHERE id = ?1 AND status = 0",
    [QUERY_DELETE] = "DELETE FROM job WHERE id = ?1",
    [QUERY_JOB] = "SELECT " JOB_COLUMNS " FROM job WHERE id = ?1",
    [QUERY_LIST] = LIST("", "<", "DESC"),
    [QUERY_LIST_STATUS] = LIST("AND status = ?3", "<", "DESC"),
    [QUERY_LIST_TAG] = LIST_TAG("", "<", "DESC"),
    [QUERY_LIST_TAG_STATUS] = LIST_TAG("AND status = ?3", "<", "DESC"),
    [QUERY_OLDEST] = LIST("", ">", "ASC"),
    [QUERY_OLDEST_STATUS] = LIST("AND status = ?3", ">", "ASC"),
    [QUERY_OLDEST_TAG] = LIST_TAG("", ">", "ASC"),
    [QUERY_OLDEST_TAG_STATUS] = LIST_TAG("AND status = ?3", ">", "ASC"),
    [QUERY_INSERT_WEBHOOK] = "INSERT INTO webhook(job, url) VALUES(?1, ?2)",
    [QUERY_WEBHOOK_NEXT] = "SELECT job, url, attempts FROM webhook WHERE state = 1 AND next <= ?1" NOT_AT("?2")
        NOT_AT("?3") NOT_AT("?4") NOT_AT("?5") NOT_AT("?6") NOT_AT("?7") NOT_AT("?8") " ORDER BY next LIMIT 1",
    [QUERY_WEBHOOKS_OPEN] = "SELECT 1 FROM webhook WHERE state < 2 LIMIT 1",
    [QUERY_WEBHOOK_POSTPONE] = "UPDATE webhook SET next = max(next, ?2) WHERE state = ?3 AND url = ?1",
    [QUERY_WEBHOOK_ATTEMPTED] = "UPDATE webhook SET state = ?3, next = ?2, attempts = attempts + 1 WHERE job = ?1",
    [QUERY_LIST_CLIENT] = LIST_CLIENT("<", "DESC"),
    [QUERY_OLDEST_CLIENT] = LIST_CLIENT(">", "ASC"),
    [QUERY_CLIENT] = "SELECT coalesce((SELECT waiting FROM client WHERE name = ?1), 0),"
                     " coalesce((SELECT bytes FROM client WHERE name = ?1), 0)"
                     " + coalesce((SELECT sum(upload.bytes) FROM upload_client JOIN upload ON id = upload"
                     " WHERE client = ?1), 0),"
                     " coalesce((SELECT seconds FROM client WHERE name = ?1 AND day = ?2), 0.0)",
    [QUERY_WAITING] = "SELECT jobs FROM tally WHERE status = 0",
    [QUERY_ANY_EXPIRED] = "SELECT 1 FROM job INDEXED BY job_by_queue_until WHERE status = 0 AND queue_until > 0 AND "
                          "queue_until < ?1 LIMIT 1",
    [QUERY_EXPIRE] = "UPDATE job SET status = 3, finished = ?1, error = ?2"
                     " WHERE status = 0 AND queue_until > 0 AND queue_until < ?1 RETURNING id",
    [QUERY_ADD_CONTENTS] =
        "UPDATE job SET bytes = bytes + ?2, contents = ?3, contents_sum = " SUM_OF("?1, ?3") " WHERE id = ?1",
    [QUERY_CONTENTS] = "SELECT contents, " SUM_IS("contents_sum", SUM_CONTENTS) " FROM job WHERE id = ?1",
    [QUERY_ENDED] = "SELECT count(*), coalesce(sum(bytes), 0) FROM job INDEXED BY job_by_end WHERE status >= 2",
    [QUERY_OLD_JOBS] = "SELECT id, finished, bytes, client FROM job INDEXED BY job_by_end WHERE status >= 2"
                       " AND NOT EXISTS (SELECT 1 FROM webhook WHERE job = id AND state = 1)"
                       " ORDER BY finished, id LIMIT ?1",
    [QUERY_VECTOR] = "SELECT part, version, count, 0, iif(shared, piece.data, vector.data), " PIECE_IS " AND " SUM_IS(
        "sum", SUM_VECTOR) " FROM " FROM_PIECES " WHERE job = ?1 AND answer = ?3 AND name = ?2 ORDER BY part",
    [QUERY_COUNT_VECTORS] = "SELECT coalesce(sum(count), 0) FROM vector WHERE job = ?1 AND name = ?2 AND part = 0",
    [QUERY_ANSWERS] = "SELECT number, name, summary, " SUM_IS(
        "sum", SUM_ANSWER) " FROM answer WHERE job = ?1 AND (?2 IS NULL OR name = ?2)"
                           " ORDER BY number",
    [QUERY_HISTORY] = "SELECT part, version, columns, last, CASE WHEN last > ?2 THEN data END, " SUM_IS(
        "sum", SUM_HISTORY) " FROM history WHERE job = ?1 AND answer = ?3 ORDER BY part",
    [QUERY_UPLOAD] = "SELECT bytes, created, used, (SELECT count(*) FROM " USES_OF(
        "?1", "?2") ") FROM upload"
                    " WHERE id = ?1 AND (?2 IS NULL OR EXISTS (SELECT 1 FROM upload_client WHERE upload = ?1"
                    " AND client = ?2))",
    [QUERY_INSERT_UPLOAD] = "INSERT OR IGNORE INTO upload(id, bytes, created, used) VALUES(?1, ?2, ?3, ?3)",
    [QUERY_TOUCH_UPLOAD] = "UPDATE upload SET used = ?2 WHERE id = ?1 AND (?3 IS NULL OR EXISTS"
                           " (SELECT 1 FROM upload_client WHERE upload = ?1 AND client = ?3))",
    [QUERY_OWN_UPLOAD] = "INSERT OR IGNORE INTO upload_client(upload, client) VALUES(?1, ?2)",
    [QUERY_DISOWN_UPLOAD] = "DELETE FROM upload_client WHERE upload = ?1 AND (?2 IS NULL OR client = ?2)"
                            " AND NOT EXISTS (SELECT 1 FROM " USES_OF("?1", "?2") ")",
    [QUERY_USE_UPLOAD] = "INSERT OR IGNORE INTO upload_use(upload, job) VALUES(?1, ?2)",
    [QUERY_UPLOAD_NAMED] = "SELECT 1 FROM upload_use WHERE upload = ?1 AND job = ?2",
    [QUERY_DELETE_UPLOAD] = "DELETE FROM upload WHERE id = ?1"
                            " AND NOT EXISTS (SELECT 1 FROM upload_use WHERE upload = ?1)"
                            " AND NOT EXISTS (SELECT 1 FROM upload_client WHERE upload = ?1)",
    [QUERY_IDLE_UPLOAD] = "SELECT id, bytes FROM upload WHERE used < ?1"
                          " AND NOT EXISTS (SELECT 1 FROM upload_use WHERE upload = id) ORDER BY used LIMIT 1",
    [QUERY_UPLOAD_BYTES] = "SELECT coalesce(sum(bytes), 0) FROM upload",
    [QUERY_COUNTS] = "SELECT status, jobs FROM tally WHERE status < 5 UNION ALL"
                     " SELECT 5, count(DISTINCT name) FROM share WHERE waiting > 0",
    [QUERY_NUMBER] = "UPDATE tally SET jobs = ?1 WHERE status = -1",
    [QUERY_COUNT_ONE_MORE] = "UPDATE tally SET jobs = jobs + 1 WHERE status = 0",
    [QUERY_COUNT_ONE_LESS] = "UPDATE tally SET jobs = jobs - 1 WHERE status = 0",
};

/* Settings of every connection. secure_delete FAST: freed pages are not rewritten only to blank them. */
static const char *const COMMON_PRAGMAS = "PRAGMA foreign_keys = ON; PRAGMA mmap_size = 0; PRAGMA temp_store = MEMORY;"
                                          "PRAGMA trusted_schema = OFF;";
/* NORMAL: a commit alone may be lost at power loss, so sync.c syncs the log before anything is acknowledged. log.c says
 * when the log is moved into the file. */
static const char *const WRITER_PRAGMAS =
    "PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 0; PRAGMA journal_size_limit = 16777216;"
    "PRAGMA secure_delete = FAST;";

bool connection_open(connection *c, const char *path, bool writer, char *message, size_t size)
{
    memset(c, 0, sizeof *c);
    int flags = SQLITE_OPEN_NOMUTEX | (writer ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY);
    if (sqlite3_open_v2(path, &c->db, flags, NULL) == SQLITE_OK &&
        sqlite3_busy_timeout(c->db, BUSY_TIMEOUT_MS) == SQLITE_OK &&
        sqlite3_exec(c->db, COMMON_PRAGMAS, NULL, NULL, NULL) == SQLITE_OK && checksum_register(c->db) &&
        (!writer || sqlite3_exec(c->db, WRITER_PRAGMAS, NULL, NULL, NULL) == SQLITE_OK))
        return true;
    snprintf(message, size, "cannot use the file: %s", file_format_why_unreadable(c->db));
    connection_close(c);
    return false;
}

void connection_close(connection *c)
{
    for (int i = 0; i < QUERY_COUNT; i++)
        sqlite3_finalize(c->statements[i]);
    sqlite3_close(c->db);
    memset(c, 0, sizeof *c);
}

statement statement_begin(connection *c, query_id q)
{
    statement st = {.c = c, .stmt = c->statements[q], .rc = SQLITE_OK};
    if (!st.stmt) {
        st.rc = sqlite3_prepare_v3(c->db, SQL[q], -1, SQLITE_PREPARE_PERSISTENT, &st.stmt, NULL);
        c->statements[q] = st.stmt;
    }
    return st;
}

void bind_integer(statement *st, int at, int64_t value)
{
    if (st->rc == SQLITE_OK)
        st->rc = sqlite3_bind_int64(st->stmt, at, value);
}

void bind_real(statement *st, int at, double value)
{
    if (st->rc == SQLITE_OK)
        st->rc = sqlite3_bind_double(st->stmt, at, value);
}

void bind_text(statement *st, int at, const char *text)
{
    if (st->rc == SQLITE_OK)
        st->rc = sqlite3_bind_text(st->stmt, at, text, -1, SQLITE_STATIC);
}

void bind_blob(statement *st, int at, const void *data, size_t size)
{
    /* A NULL pointer would bind NULL instead of an empty blob. */
    if (st->rc == SQLITE_OK)
        st->rc = sqlite3_bind_blob64(st->stmt, at, data ? data : "", data ? size : 0, SQLITE_STATIC);
}

bool statement_row(statement *st)
{
    if (st->rc != SQLITE_OK && st->rc != SQLITE_ROW)
        return false;
    errno = 0;
    st->rc = sqlite3_step(st->stmt);
    st->cause = errno;
    return st->rc == SQLITE_ROW;
}

store_status statement_end(statement *st, store_status status)
{
    if (st->rc != SQLITE_OK && st->rc != SQLITE_ROW && st->rc != SQLITE_DONE) {
        /* A full disk shows as SQLITE_FULL, or as an I/O error whose cause is the quota or the largest file allowed.
         * SQLite does not keep the cause of a COMMIT that fails: then it is what the call left in errno. */
        const int rc = st->rc & 0xff, causes[] = {st->cause, sqlite3_system_errno(st->c->db)};
        bool full = rc == SQLITE_FULL;
        for (int i = 0; i < 2 && rc == SQLITE_IOERR; i++)
            full = full || causes[i] == ENOSPC || causes[i] == EDQUOT || causes[i] == EFBIG;
        status = full ? STORE_FULL : rc == SQLITE_BUSY ? STORE_LOCKED : STORE_ERROR;
        snprintf(st->c->message, sizeof st->c->message, "%s (SQLite code %d)", sqlite3_errmsg(st->c->db),
                 sqlite3_extended_errcode(st->c->db));
    }
    if (st->stmt) {
        sqlite3_reset(st->stmt);
        sqlite3_clear_bindings(st->stmt);
    }
    return status;
}

store_status statement_run(statement *st)
{
    statement_row(st);
    return statement_end(st, STORE_OK);
}
