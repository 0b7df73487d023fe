#include "store/sqlite/file_format.h"

#include "store/sqlite/connection.h"

#include <stdint.h>
#include <stdio.h>

/* The rule for changing this format:
 *   - A released version never changes. A change adds 1 to FILE_FORMAT_VERSION and brings a step that turns version n
 *     into n + 1 in one transaction, which also sets user_version; opening then applies the missing steps in order.
 *   - A newer file is refused by an older program, so a column never changes its meaning silently.
 *   - Numbers that stand in rows keep their meaning: job.status is the value of job_status, 0 accepted, 1 running,
 *     2 successful, 3 failed, 4 dismissed. New values are added at the end.
 *   - Rows of doubles carry their own version, RESULT_ENCODING (store/result_blobs.h): the reader keeps every number it
 *     ever wrote.
 *
 * job      what a listing needs, in small rows. Times are Unix seconds, 0: not yet. lease is when the owner's claim
 * ends. finished of a running job: when it was told to end. refines is the job whose run this one continues, which may
 * be gone. priority: larger ones run first. queue_until: it fails if it has not begun by then, 0: never. bytes: of its
 * request and its results once it has ended.
 * request  the body as it was sent; in its own table, so that a listing never reads past it.
 * tag      one row for each tag of a job, so that a filter by tag is a range of an index.
 * answer   one row for each load case of an ended job, numbered from 1 in the order of the request.
 * vector   a named vector of a result, in parts of bounded size; every part repeats the count of the whole vector.
 *          answer is the number of its load case; 0: of the job, or of all its cases.
 * piece    what vectors of several jobs have in common, once: a row of vector with `shared` has the SHA-256 of its
 *          bytes in `data`, and they are here until the last such row is deleted.
 * history  rows of a convergence history, in parts, by answer like vector; last is the iteration of the part's last
 *          row, so that a reader who has seen some rows skips whole parts.
 * upload   texts in files beside this one (uploads.h), by the digest of their bytes.
 * upload_use which jobs name which uploads in their requests.
 * webhook  whom to tell of the end of a job. state 0: it has not ended, 1: to be told at `next`, 2: told, 3: given up.
 *          A trigger makes it due, whatever ends the job.
 * client   what each client with a name has: jobs that wait, bytes of its jobs, and seconds of workers on `day` (days
 *          since 1970, UTC). Kept by triggers.
 * tally    how many jobs have each status; -1: the number of commits, -2: a random name of this file (trail.h).
 * upload_client who has sent which upload.
 * job.client: whose it is, "" where there are no tokens. Idempotency keys of others begin with the name and \x1f.
 * share    of the workers: each owner or address that has jobs which wait or run, once for those with a priority above
 *          STORE_PRIORITY_SHARED (ahead) and once for the others: how many wait, how many of these are small, how many
 *          run, and what time of workers it has had. One that comes begins where the least of the others stands, and
 *          goes when it has none and that one has passed it: there is no credit for the time before. This is start-time
 *          fair queueing (Goyal, Vin and Cheng, 1997) with the time as it was instead of one that was foretold.
 * contents of an ended job: which rows its result has (result_blobs.h).
 * sum, summary_sum, contents_sum: checksums of what answers are made of (checksum.h); NULL in rows that an older format
 * wrote. Deleting a job deletes its rows in every other table. */
#define RESULT_TABLES                                                                                                  \
    "CREATE TABLE answer("                                                                                             \
    "  job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"                                                        \
    "  number INTEGER NOT NULL, name TEXT NOT NULL, summary TEXT NOT NULL,"                                            \
    "  PRIMARY KEY(job, number), UNIQUE(job, name)"                                                                    \
    ") STRICT;"                                                                                                        \
    "CREATE TABLE vector("                                                                                             \
    "  job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"                                                        \
    "  answer INTEGER NOT NULL, name TEXT NOT NULL, part INTEGER NOT NULL, version INTEGER NOT NULL,"                  \
    "  count INTEGER NOT NULL, data BLOB NOT NULL,"                                                                    \
    "  PRIMARY KEY(job, answer, name, part)"                                                                           \
    ") STRICT;"                                                                                                        \
    "CREATE TABLE history("                                                                                            \
    "  job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"                                                        \
    "  answer INTEGER NOT NULL, part INTEGER NOT NULL, version INTEGER NOT NULL,"                                      \
    "  columns INTEGER NOT NULL, last REAL NOT NULL, data BLOB NOT NULL,"                                              \
    "  PRIMARY KEY(job, answer, part)"                                                                                 \
    ") STRICT;"
/* Version 3. Jobs that wait are few among those that have ended, so their indexes hold no others. */
#define JOB_INDEXES_3                                                                                                  \
    "CREATE INDEX job_by_turn ON job(priority DESC, id) WHERE status = 0;"                                             \
    "CREATE INDEX job_by_queue_until ON job(queue_until) WHERE status = 0 AND queue_until > 0;"                        \
    "CREATE INDEX job_by_end ON job(finished, id, bytes, status) WHERE status >= 2;"
#define TABLES_3                                                                                                       \
    "CREATE TABLE upload("                                                                                             \
    "  id TEXT PRIMARY KEY NOT NULL, bytes INTEGER NOT NULL, created REAL NOT NULL, used REAL NOT NULL"                \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "CREATE INDEX upload_by_use ON upload(used);"                                                                      \
    "CREATE TABLE upload_use("                                                                                         \
    "  upload TEXT NOT NULL REFERENCES upload(id), job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"            \
    "  PRIMARY KEY(upload, job)"                                                                                       \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "CREATE INDEX upload_use_by_job ON upload_use(job);"                                                               \
    "CREATE TABLE webhook("                                                                                            \
    "  job TEXT PRIMARY KEY NOT NULL REFERENCES job(id) ON DELETE CASCADE, url TEXT NOT NULL,"                         \
    "  state INTEGER NOT NULL DEFAULT 0 CHECK(state BETWEEN 0 AND 3), attempts INTEGER NOT NULL DEFAULT 0,"            \
    "  next REAL NOT NULL DEFAULT 0"                                                                                   \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "CREATE INDEX webhook_due ON webhook(next) WHERE state = 1;"                                                       \
    "CREATE TRIGGER webhook_falls_due AFTER UPDATE OF status ON job WHEN new.status >= 2 AND old.status < 2 BEGIN"     \
    "  UPDATE webhook SET state = 1, next = new.finished WHERE job = new.id; END;"
/* Version 4. How many jobs are in each status, kept by triggers: counting a million rows takes as long as 50
 * submissions. */
#define TABLES_4                                                                                                       \
    "CREATE TABLE tally(status INTEGER PRIMARY KEY NOT NULL, jobs INTEGER NOT NULL) STRICT;"                           \
    "INSERT INTO tally(status, jobs)"                                                                                  \
    " SELECT column1, (SELECT count(*) FROM job WHERE status = column1) FROM (VALUES (0), (1), (2), (3), (4));"        \
    "CREATE TRIGGER tally_insert AFTER INSERT ON job BEGIN"                                                            \
    " UPDATE tally SET jobs = jobs + 1 WHERE status = NEW.status; END;"                                                \
    "CREATE TRIGGER tally_delete AFTER DELETE ON job BEGIN"                                                            \
    " UPDATE tally SET jobs = jobs - 1 WHERE status = OLD.status; END;"                                                \
    "CREATE TRIGGER tally_update AFTER UPDATE OF status ON job WHEN OLD.status <> NEW.status BEGIN"                    \
    " UPDATE tally SET jobs = jobs - 1 WHERE status = OLD.status;"                                                     \
    " UPDATE tally SET jobs = jobs + 1 WHERE status = NEW.status; END;"
/* Version 5. Rows that are there already stay without: to sum them up would write a large file once more. */
#define COLUMNS_5                                                                                                      \
    "ALTER TABLE job ADD COLUMN summary_sum INTEGER; ALTER TABLE request ADD COLUMN sum INTEGER;"                      \
    "ALTER TABLE answer ADD COLUMN sum INTEGER; ALTER TABLE vector ADD COLUMN sum INTEGER;"                            \
    "ALTER TABLE history ADD COLUMN sum INTEGER;"

/* Version 6. */
#define COLUMNS_6 "ALTER TABLE job ADD COLUMN contents TEXT; ALTER TABLE job ADD COLUMN contents_sum INTEGER;"

/* Version 7. Without tokens all clients are "", and nothing is kept or counted beside their jobs. */
#define TABLES_7                                                                                                       \
    "ALTER TABLE job ADD COLUMN client TEXT NOT NULL DEFAULT '';"                                                      \
    "CREATE INDEX job_by_client ON job(client, id) WHERE client <> '';"                                                \
    "CREATE TABLE client("                                                                                             \
    "  name TEXT PRIMARY KEY NOT NULL, waiting INTEGER NOT NULL DEFAULT 0, bytes INTEGER NOT NULL DEFAULT 0,"          \
    "  day INTEGER NOT NULL DEFAULT 0, seconds REAL NOT NULL DEFAULT 0"                                                \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "CREATE TRIGGER client_insert AFTER INSERT ON job WHEN NEW.client <> '' BEGIN"                                     \
    " INSERT INTO client(name, waiting, bytes) VALUES(NEW.client, NEW.status = 0, NEW.bytes)"                          \
    " ON CONFLICT(name) DO UPDATE SET waiting = waiting + excluded.waiting, bytes = bytes + excluded.bytes; END;"      \
    "CREATE TRIGGER client_delete AFTER DELETE ON job WHEN OLD.client <> '' BEGIN"                                     \
    " UPDATE client SET waiting = waiting - (OLD.status = 0), bytes = bytes - OLD.bytes WHERE name = OLD.client; END;" \
    "CREATE TRIGGER client_update AFTER UPDATE OF status, bytes ON job WHEN NEW.client <> ''"                          \
    " AND (OLD.status <> NEW.status OR OLD.bytes <> NEW.bytes) BEGIN"                                                  \
    " UPDATE client SET waiting = waiting + (NEW.status = 0) - (OLD.status = 0),"                                      \
    " bytes = bytes + NEW.bytes - OLD.bytes WHERE name = NEW.client; END;"                                             \
    "CREATE TRIGGER client_worked AFTER UPDATE OF status ON job WHEN NEW.client <> '' AND OLD.status = 1"              \
    " AND NEW.status >= 2 BEGIN"                                                                                       \
    " UPDATE client SET seconds = max(0.0, NEW.finished - NEW.started)"                                                \
    " + CASE WHEN day = CAST(NEW.finished / 86400 AS INTEGER) THEN seconds ELSE 0.0 END,"                              \
    " day = CAST(NEW.finished / 86400 AS INTEGER) WHERE name = NEW.client; END;"                                       \
    "CREATE TABLE upload_client("                                                                                      \
    "  upload TEXT NOT NULL, client TEXT NOT NULL, PRIMARY KEY(upload, client)"                                        \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "CREATE INDEX upload_client_by_client ON upload_client(client, upload);"                                           \
    "INSERT INTO upload_client(upload, client) SELECT id, '' FROM upload;"                                             \
    "CREATE TRIGGER upload_delete AFTER DELETE ON upload BEGIN"                                                        \
    " DELETE FROM upload_client WHERE upload = OLD.id; END;"

/* Version 8. In a table that most commits change anyhow. */
#define ROWS_8 "INSERT INTO tally(status, jobs) VALUES(-1, 0), (-2, random());"

/* Version 9. A job that takes no time, by a clock that was set back too, still has had its turn. */
#define TURN_LEAST "0.001"
#define LEAST_USED "(SELECT min(used) FROM share WHERE waiting + running > 0)"
#define TABLES_9                                                                                                       \
    "ALTER TABLE job ADD COLUMN share TEXT NOT NULL DEFAULT '';"                                                       \
    "ALTER TABLE job ADD COLUMN small INTEGER NOT NULL DEFAULT 0;"                                                     \
    "DROP INDEX job_by_turn;"                                                                                          \
    "CREATE INDEX job_by_turn ON job(share, priority DESC, id) WHERE status = 0;"                                      \
    "CREATE INDEX job_by_lane ON job(share, priority DESC, id) WHERE status = 0 AND small > 0;"                        \
    "UPDATE job SET share = client WHERE status < 2 AND client <> '';"                                                 \
    "CREATE TABLE share("                                                                                              \
    "  name TEXT NOT NULL, ahead INTEGER NOT NULL, waiting INTEGER NOT NULL DEFAULT 0,"                                \
    "  small INTEGER NOT NULL DEFAULT 0, running INTEGER NOT NULL DEFAULT 0, used REAL NOT NULL DEFAULT 0,"            \
    "  PRIMARY KEY(name, ahead)"                                                                                       \
    ") STRICT, WITHOUT ROWID;"                                                                                         \
    "INSERT INTO share(name, ahead, waiting, running)"                                                                 \
    " SELECT share, priority > " SHARED ", sum(status = 0), sum(status = 1) FROM job WHERE status < 2 GROUP BY 1, 2;"  \
    "CREATE INDEX share_by_turn ON share(ahead DESC, running, used, name) WHERE waiting > 0;"                          \
    "CREATE INDEX share_by_lane ON share(ahead DESC, running, used, name) WHERE small > 0;"                            \
    "CREATE INDEX share_at_work ON share(used) WHERE waiting + running > 0;"                                           \
    "CREATE INDEX share_idle ON share(used) WHERE waiting + running = 0;"                                              \
    "CREATE TRIGGER share_comes AFTER INSERT ON job WHEN NEW.status = 0 BEGIN"                                         \
    " INSERT INTO share(name, ahead, waiting, small, used)"                                                            \
    " VALUES(NEW.share, NEW.priority > " SHARED ", 1, NEW.small, coalesce(" LEAST_USED ", 0.0))"                       \
    " ON CONFLICT(name, ahead) DO UPDATE SET waiting = waiting + 1, small = small + excluded.small,"                   \
    " used = CASE WHEN waiting + running > 0 THEN used ELSE max(used, excluded.used) END; END;"                        \
    "CREATE TRIGGER share_moves AFTER UPDATE OF status ON job WHEN NEW.status <> OLD.status BEGIN"                     \
    " UPDATE share SET waiting = waiting + (NEW.status = 0) - (OLD.status = 0),"                                       \
    " small = small + (NEW.status = 0) * NEW.small - (OLD.status = 0) * OLD.small,"                                    \
    " running = running + (NEW.status = 1) - (OLD.status = 1),"                                                        \
    " used = used + CASE WHEN OLD.status = 1 AND NEW.status >= 2"                                                      \
    " THEN max(" TURN_LEAST ", NEW.finished - OLD.started) ELSE 0.0 END"                                               \
    " WHERE name = NEW.share AND ahead = (NEW.priority > " SHARED ");"                                                 \
    " DELETE FROM share WHERE waiting + running = 0 AND used <= coalesce(" LEAST_USED ", 9e999); END;"

/* Version 10. Vectors that are there already keep their bytes. */
#define TABLES_10                                                                                                      \
    "ALTER TABLE vector ADD COLUMN shared INTEGER NOT NULL DEFAULT 0;"                                                 \
    "CREATE TABLE piece(digest BLOB NOT NULL UNIQUE, data BLOB NOT NULL) STRICT;"                                      \
    "CREATE INDEX vector_by_piece ON vector(data) WHERE shared;"                                                       \
    "CREATE TRIGGER piece_unused AFTER DELETE ON vector WHEN OLD.shared"                                               \
    " AND NOT EXISTS (SELECT 1 FROM vector INDEXED BY vector_by_piece WHERE shared AND data = OLD.data) BEGIN"         \
    " DELETE FROM piece WHERE digest = OLD.data; END;"

/* Version 11. The time of a job is counted while it runs (QUERY_CHARGE), not at its end by two readings of a clock that
 * may have been set. A run that takes no time, or comes to no end, still was a turn. Those ahead of the others have a
 * time of their own: while they work, that of the others stands still. */
#define LEAST_OF_11 "(SELECT min(used) FROM share WHERE waiting + running > 0 AND ahead = (NEW.priority > " SHARED "))"
#define TRIGGERS_11                                                                                                    \
    "DROP TRIGGER share_comes; DROP TRIGGER share_moves; DROP INDEX share_at_work; DROP INDEX share_idle;"             \
    "CREATE INDEX share_at_work ON share(ahead, used) WHERE waiting + running > 0;"                                    \
    "CREATE INDEX share_idle ON share(ahead, used) WHERE waiting + running = 0;"                                       \
    "CREATE TRIGGER share_comes AFTER INSERT ON job WHEN NEW.status = 0 BEGIN"                                         \
    " INSERT INTO share(name, ahead, waiting, small, used)"                                                            \
    " VALUES(NEW.share, NEW.priority > " SHARED ", 1, NEW.small, coalesce(" LEAST_OF_11 ", 0.0))"                      \
    " ON CONFLICT(name, ahead) DO UPDATE SET waiting = waiting + 1, small = small + excluded.small,"                   \
    " used = CASE WHEN waiting + running > 0 THEN used ELSE max(used, excluded.used) END; END;"                        \
    "CREATE TRIGGER share_moves AFTER UPDATE OF status ON job WHEN NEW.status <> OLD.status BEGIN"                     \
    " UPDATE share SET waiting = waiting + (NEW.status = 0) - (OLD.status = 0),"                                       \
    " small = small + (NEW.status = 0) * NEW.small - (OLD.status = 0) * OLD.small,"                                    \
    " running = running + (NEW.status = 1) - (OLD.status = 1), used = used + 0.001 * (OLD.status = 1)"                 \
    " WHERE name = NEW.share AND ahead = (NEW.priority > " SHARED ");"                                                 \
    " DELETE FROM share WHERE waiting + running = 0 AND ahead = (NEW.priority > " SHARED ")"                           \
    " AND used <= coalesce(" LEAST_OF_11 ", 9e999); END;"

static const char *const SCHEMA =
    "CREATE TABLE job("
    "  id TEXT PRIMARY KEY NOT NULL,"
    "  status INTEGER NOT NULL CHECK(status BETWEEN 0 AND 4),"
    "  progress INTEGER NOT NULL DEFAULT 0 CHECK(progress BETWEEN 0 AND 100),"
    "  attempts INTEGER NOT NULL DEFAULT 0,"
    "  created REAL NOT NULL, started REAL NOT NULL DEFAULT 0, finished REAL NOT NULL DEFAULT 0,"
    "  owner TEXT, lease REAL NOT NULL DEFAULT 0,"
    "  tags TEXT NOT NULL, summary TEXT, error TEXT,"
    "  idempotency_key TEXT UNIQUE,"
    "  refines TEXT,"
    "  priority INTEGER NOT NULL DEFAULT 0, queue_until REAL NOT NULL DEFAULT 0, bytes INTEGER NOT NULL DEFAULT 0"
    ") STRICT;"
    "CREATE INDEX job_by_status ON job(status, id);"
    "CREATE TABLE request("
    "  job TEXT PRIMARY KEY NOT NULL REFERENCES job(id) ON DELETE CASCADE,"
    "  body BLOB NOT NULL"
    ") STRICT;"
    "CREATE TABLE tag("
    "  tag TEXT NOT NULL, job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"
    "  PRIMARY KEY(tag, job)"
    ") STRICT, WITHOUT ROWID;"
    "CREATE INDEX tag_by_job ON tag(job);" RESULT_TABLES TABLES_3 JOB_INDEXES_3 TABLES_4 COLUMNS_5 COLUMNS_6 TABLES_7
        ROWS_8 TABLES_9 TABLES_10 TRIGGERS_11;

_Static_assert(JOB_ACCEPTED == 0 && JOB_RUNNING == 1 && JOB_SUCCESSFUL == 2 && JOB_FAILED == 3 && JOB_DISMISSED == 4,
               "these numbers stand in stored rows");

const char *file_format_why_unreadable(sqlite3 *db)
{
    if (db && sqlite3_errcode(db) == SQLITE_NOTADB)
        return "the file is not an SQLite database; give the path of a new file instead";
    if (db && sqlite3_errcode(db) == SQLITE_CORRUPT)
        return "the file is damaged; it is left as it is: put a backup in its place, or save what is readable into a "
               "new "
               "file with sqlite3's .recover";
    return db ? sqlite3_errmsg(db) : "no memory";
}

/* STEPS[n] turns version n into n + 1. Version 2: load cases, and jobs that refine others. The primary keys of the
 * result tables grew by a column, which SQLite can only do by copying the rows. Version 3: uploads, webhooks, the turn
 * and the size of jobs. Version 4: the tally. Version 5: checksums. Version 6: what belongs
 * to a result. Version 7: clients. Version 8: the
 * number of commits. Version 9: shares. Version 10: what vectors have in common.
 * Version 11: the time of shares. */
static const char *const STEPS[FILE_FORMAT_VERSION] = {
    [0] = NULL,
    [1] = "ALTER TABLE job ADD COLUMN refines TEXT;"
          "ALTER TABLE vector RENAME TO vector_1; ALTER TABLE history RENAME TO history_1;" RESULT_TABLES
          "INSERT INTO vector(job, answer, name, part, version, count, data)"
          " SELECT job, 0, name, part, version, count, data FROM vector_1;"
          "INSERT INTO history(job, answer, part, version, columns, last, data)"
          " SELECT job, 0, part, version, columns, last, data FROM history_1;"
          "DROP TABLE vector_1; DROP TABLE history_1;",
    [2] = "ALTER TABLE job ADD COLUMN priority INTEGER NOT NULL DEFAULT 0;"
          "ALTER TABLE job ADD COLUMN queue_until REAL NOT NULL DEFAULT 0;"
          "ALTER TABLE job ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0;" TABLES_3 JOB_INDEXES_3
          "UPDATE job SET bytes = coalesce((SELECT length(body) FROM request WHERE job = id), 0)"
          " + coalesce((SELECT sum(length(data)) FROM vector WHERE job = id), 0)"
          " + coalesce((SELECT sum(length(data)) FROM history WHERE job = id), 0) WHERE status >= 2;",
    [3] = TABLES_4,
    [4] = COLUMNS_5,
    [5] = COLUMNS_6,
    [6] = TABLES_7,
    [7] = ROWS_8,
    [8] = TABLES_9,
    [9] = TABLES_10,
    [10] = TRIGGERS_11,
};

bool file_format_integer(sqlite3 *db, const char *sql, int64_t *value)
{
    sqlite3_stmt *stmt = NULL;
    bool ok = sqlite3_prepare_v2(db, sql, -1, &stmt, NULL) == SQLITE_OK && sqlite3_step(stmt) == SQLITE_ROW;
    if (ok)
        *value = sqlite3_column_int64(stmt, 0);
    sqlite3_finalize(stmt);
    return ok;
}

bool file_format_check(sqlite3 *db, int *version, char *message, size_t size)
{
    int64_t application = 0, found = 0, objects = 0;
    *version = 0;
    if (!file_format_integer(db, "SELECT count(*) FROM sqlite_schema", &objects) ||
        !file_format_integer(db, "PRAGMA application_id", &application) ||
        !file_format_integer(db, "PRAGMA user_version", &found)) {
        snprintf(message, size, "%s", file_format_why_unreadable(db));
        return false;
    }
    if (objects == 0 && application == 0 && found == 0)
        return true;
    if (application != FILE_FORMAT_APPLICATION_ID) {
        snprintf(message, size, "the file is the SQLite database of another program; give the path of a new file");
        return false;
    }
    if (found < 1 || found > FILE_FORMAT_VERSION) {
        snprintf(message, size, "the file has format version %lld and this program reads versions 1 to %d%s",
                 (long long)found, FILE_FORMAT_VERSION,
                 found > FILE_FORMAT_VERSION ? ": it was written by a newer program" : "");
        return false;
    }
    *version = (int)found;
    return true;
}

/* Runs `sql` and sets the version in one transaction. */
static bool run_step(sqlite3 *db, const char *sql, int version, const char *what, char *message, size_t size)
{
    char pragmas[128];
    snprintf(pragmas, sizeof pragmas, "PRAGMA application_id = %d; PRAGMA user_version = %d; COMMIT;",
             FILE_FORMAT_APPLICATION_ID, version);
    if (sqlite3_exec(db, "BEGIN IMMEDIATE", NULL, NULL, NULL) == SQLITE_OK &&
        sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK &&
        sqlite3_exec(db, pragmas, NULL, NULL, NULL) == SQLITE_OK)
        return true;
    snprintf(message, size, "cannot %s: %s", what, sqlite3_errmsg(db));
    if (!sqlite3_get_autocommit(db))
        sqlite3_exec(db, "ROLLBACK", NULL, NULL, NULL);
    return false;
}

bool file_format_upgrade(sqlite3 *db, int version, char *message, size_t size)
{
    if (version == 0)
        return run_step(db, SCHEMA, FILE_FORMAT_VERSION, "create the tables", message, size);
    for (; version < FILE_FORMAT_VERSION; version++)
        if (!run_step(db, STEPS[version], version + 1, "bring the file to the present format", message, size))
            return false;
    return true;
}
