/* The database file: its rows, checks, backups, damages, and files of earlier formats. */
#include "sqlite_file.h"
#include "store/engine_base.h"
#include "store_place.h"

#include <sys/stat.h>

TEST(ids_ascend_when_the_clock_went_back)
{
    place p;
    char id[33];
    const char *future = "ffffffff0000fffe0000000000000000"; /* as if written far ahead of this clock */
    sqlite3 *db = NULL;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    store_close(p.s);
    CHECK_INT(sqlite3_open(p.path, &db), SQLITE_OK);
    char sql[160];
    snprintf(sql, sizeof sql, "DELETE FROM request; UPDATE job SET id = '%s'", future);
    CHECK_INT(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
    if (!place_open(&p))
        return;
    char last[33];
    strcpy(last, future);
    for (int i = 0; i < 4; i++) { /* the counter runs over */
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_MSG(strcmp(id, last) > 0, "%s after %s", id, last);
        strcpy(last, id);
    }
    place_end(&p);
}

TEST(a_damaged_vector_is_an_error)
{
    place p;
    char id[33], other[33], message[256];
    double x[4] = {1, 2, 3, 4}, *data;
    int64_t count;
    store_vector v = {"gaps", 4, x};
    store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole.vectors = &v, .whole.n_vectors = 1};
    const char *const damage[] = {"UPDATE vector SET data = x'00'", "UPDATE vector SET data = zeroblob(24)",
                                  "UPDATE vector SET data = zeroblob(40)", "UPDATE vector SET version = 2",
                                  "UPDATE vector SET count = -1"};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "a", &outcome), STORE_OK);
    for (size_t i = 0; i < sizeof damage / sizeof damage[0]; i++) {
        sqlite3 *db = NULL;
        store_close(p.s);
        CHECK_INT(sqlite3_open(p.path, &db), SQLITE_OK);
        CHECK_INT(sqlite3_exec(db, damage[i], NULL, NULL, NULL), SQLITE_OK);
        sqlite3_close(db);
        if (!place_open(&p))
            return;
        CHECK_INT(store_get_vector(p.s, id, 0, "gaps", &data, &count), STORE_DAMAGED);
        CHECK(!data && count == 0);
        store_message(p.s, message, sizeof message);
        CHECK(strstr(message, "damaged") && strstr(message, id));
    }
    place_end(&p);
}

TEST(deleting_a_job_deletes_everything_of_it)
{
    place p;
    char id[33], other[33];
    double x[12] = {0};
    store_vector v = {"gaps", 12, x};
    store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole = {NULL, "{}", &v, 1, x, 1, 12}};
    job_status was;
    job j = {0};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[\"t\", \"u\"]", "key", id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "a", &outcome), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(was, JOB_SUCCESSFUL);
    CHECK_INT(store_get(p.s, id, &j), STORE_NOT_FOUND);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_NOT_FOUND);
    store_close(p.s);
    p.s = NULL;
    const char *const tables[] = {"job", "request", "tag", "vector", "history", "answer", "webhook", "upload_use"};
    for (size_t i = 0; i < sizeof tables / sizeof tables[0]; i++)
        CHECK_MSG(rows_in(p.path, tables[i]) == 0, "%s has rows left", tables[i]);
    place_end(&p);
}

TEST(bad_tags_are_an_error_and_leave_nothing)
{
    place p;
    char id[33];
    int64_t counts[STORE_COUNTS];
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[\"open", NULL, id), STORE_ERROR);
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_ACCEPTED], 0);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    place_end(&p);
}

TEST(deleting_a_job_deletes_its_cases)
{
    static const char *const TABLES[] = {"job", "request", "answer", "vector", "history"};
    place p;
    char id[33];
    job_status was;
    if (!place_begin(&p))
        return;
    finish_cases(&p, id, 2);
    CHECK_INT(rows_in(p.path, "answer"), 2);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    for (size_t i = 0; i < sizeof TABLES / sizeof TABLES[0]; i++)
        CHECK_INT(rows_in(p.path, TABLES[i]), 0);
    place_end(&p);
}

/* Of the closed file: "" none, else one of them has this in it. */
static void check_findings(const place *p, const char *wanted)
{
    char message[300] = "";
    store_findings found;
    CHECK_MSG(store_check_file(p->path, &found, message, sizeof message), "%s", message);
    CHECK_MSG(found.findings && (wanted[0] ? strstr(found.findings, wanted) != NULL : !found.findings[0]), "%s",
              found.findings);
    free(found.findings);
}

/* Two jobs on the same nodes. */
TEST(what_two_results_have_in_common_is_kept_once)
{
    enum { COUNT = 150000, PIECES = 2 }; /* of 1 MiB */
    place p;
    char first[33], second[33], *const id[2] = {first, second};
    double *x = malloc(2 * COUNT * sizeof *x), *found = NULL;
    int64_t n = 0;
    job_status was;
    if (!x || !place_begin(&p)) {
        free(x);
        return;
    }
    for (int i = 0; i < 2 * COUNT; i++)
        x[i] = 0.1 * i;
    for (int k = 0; k < 2; k++) {
        store_vector v[] = {{"nodes", COUNT, x}, {"displacements", COUNT, x + k * COUNT}, {"gaps", 3, x}};
        store_outcome outcome = {
            .status = JOB_SUCCESSFUL, .whole.summary = "{}", .whole.vectors = v, .whole.n_vectors = k ? 3 : 2};
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id[k]), STORE_OK);
        CHECK_INT(claim_id(p.s, "a", id[k]), STORE_OK);
        CHECK_INT(finish_as(p.s, id[k], "a", &outcome), STORE_OK);
    }
    CHECK_INT(rows_in(p.path, "piece"), 2 * PIECES); /* of eight */
    CHECK_INT(rows_in(p.path, "vector WHERE shared"), 4 * PIECES);
    store_close(p.s);
    check_findings(&p, "");
    CHECK(place_open(&p));
    CHECK_INT(store_dismiss(p.s, id[0], &was), STORE_OK);
    for (int k = 0; k < 2; k++) {
        CHECK_INT(store_get_vector(p.s, id[1], 0, k ? "displacements" : "nodes", &found, &n), STORE_OK);
        CHECK(n == COUNT && found && memcmp(found, x + k * COUNT, COUNT * sizeof *x) == 0);
        free(found);
    }
    store_close(p.s);
    change_file(p.path, "UPDATE piece SET data = zeroblob(length(data)) WHERE rowid = 1");
    check_findings(&p, "nodes of job ");
    CHECK(place_open(&p));
    CHECK_INT(store_get_vector(p.s, id[1], 0, "nodes", &found, &n), STORE_DAMAGED);
    CHECK_INT(store_get_vector(p.s, id[1], 0, "displacements", &found, &n), STORE_OK);
    free(found);
    CHECK_INT(store_dismiss(p.s, id[1], &was), STORE_OK);
    CHECK_INT(rows_in(p.path, "piece"), 0);
    CHECK_INT(rows_in(p.path, "vector"), 0);
    place_end(&p);
    free(x);
}

/* ---- format 1, as it was written before there were load cases */

static const char *const FORMAT_1 =
    "CREATE TABLE job(id TEXT PRIMARY KEY NOT NULL,"
    " status INTEGER NOT NULL CHECK(status BETWEEN 0 AND 4),"
    " progress INTEGER NOT NULL DEFAULT 0 CHECK(progress BETWEEN 0 AND 100),"
    " attempts INTEGER NOT NULL DEFAULT 0,"
    " created REAL NOT NULL, started REAL NOT NULL DEFAULT 0, finished REAL NOT NULL DEFAULT 0,"
    " owner TEXT, lease REAL NOT NULL DEFAULT 0,"
    " tags TEXT NOT NULL, summary TEXT, error TEXT, idempotency_key TEXT UNIQUE) STRICT;"
    "CREATE INDEX job_by_status ON job(status, id);"
    "CREATE TABLE request(job TEXT PRIMARY KEY NOT NULL REFERENCES job(id) ON DELETE CASCADE, body BLOB NOT NULL)"
    " STRICT;"
    "CREATE TABLE tag(tag TEXT NOT NULL, job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"
    " PRIMARY KEY(tag, job)) STRICT, WITHOUT ROWID;"
    "CREATE INDEX tag_by_job ON tag(job);"
    "CREATE TABLE vector(job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"
    " name TEXT NOT NULL, part INTEGER NOT NULL, version INTEGER NOT NULL,"
    " count INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY(job, name, part)) STRICT;"
    "CREATE TABLE history(job TEXT NOT NULL REFERENCES job(id) ON DELETE CASCADE,"
    " part INTEGER NOT NULL, version INTEGER NOT NULL,"
    " columns INTEGER NOT NULL, last REAL NOT NULL, data BLOB NOT NULL, PRIMARY KEY(job, part)) STRICT;"
    "PRAGMA application_id = 1970954615; PRAGMA user_version = 1;";

/* An ended job with two parts of a vector (0, 2 and 1, -1 as binary64) and a history of one row of three columns; one
 * that waits. */
static const char *const FORMAT_1_ROWS =
    "INSERT INTO job(id, status, progress, attempts, created, started, finished, tags, summary, idempotency_key)"
    " VALUES('00000000000000000000000000000001', 2, 100, 1, 10.5, 11.5, 12.5, '[\"old\"]', '{\"a\": 1}', 'key');"
    "INSERT INTO request VALUES('00000000000000000000000000000001', CAST('{\"b\": 2}' AS BLOB));"
    "INSERT INTO tag VALUES('old', '00000000000000000000000000000001');"
    "INSERT INTO vector VALUES('00000000000000000000000000000001', 'gaps', 0, 1, 4,"
    " x'00000000000000000000000000000040');"
    "INSERT INTO vector VALUES('00000000000000000000000000000001', 'gaps', 1, 1, 4,"
    " x'000000000000F03F000000000000F0BF');"
    "INSERT INTO history VALUES('00000000000000000000000000000001', 0, 1, 3, 0.0,"
    " x'0000000000000000000000000000F03F0000000000000040');"
    "INSERT INTO job(id, status, created, tags) VALUES('00000000000000000000000000000002', 0, 13.5, '[]');"
    "INSERT INTO request VALUES('00000000000000000000000000000002', CAST('{\"c\": 3}' AS BLOB));";

/* The place with a file of an older format instead of a new one; the store is closed. */
static bool begin_old(place *p, const char *tables, const char *rows)
{
    if (!place_begin(p))
        return false;
    store_close(p->s);
    p->s = NULL;
    unlink(p->path);
    change_file(p->path, tables);
    change_file(p->path, rows);
    return true;
}

static void check_old_job(place *p)
{
    static const char ID[] = "00000000000000000000000000000001";
    job j = {0};
    double *x = NULL;
    int64_t n = 0, columns = 0;
    CHECK_INT(store_get(p->s, ID, &j), STORE_OK);
    CHECK(j.status == JOB_SUCCESSFUL && j.created == 10.5 && j.finished == 12.5 && !j.refines[0]);
    CHECK_STR(j.summary, "{\"a\": 1}");
    CHECK_STR(j.tags, "[\"old\"]");
    job_clear(&j);
    CHECK_INT(store_get_vector(p->s, ID, 0, "gaps", &x, &n), STORE_OK);
    CHECK(n == 4 && x[0] == 0 && x[1] == 2 && x[2] == 1 && x[3] == -1);
    free(x);
    CHECK_INT(store_get_history(p->s, ID, 0, -1, &x, &n, &columns), STORE_OK);
    CHECK(n == 1 && columns == 3 && x[0] == 0 && x[1] == 1 && x[2] == 2);
    free(x);
}

TEST(a_file_of_format_1_is_taken_over)
{
    place p;
    char id[33];
    job j = {0};
    bool repeated = false;
    if (!begin_old(&p, FORMAT_1, FORMAT_1_ROWS) || !place_open(&p))
        return;
    check_old_job(&p);
    CHECK_INT(rows_in(p.path, "job WHERE bytes = 64 AND status = 2"), 1); /* 8 of the body, 4 + 3 numbers */
    CHECK_INT(rows_in(p.path, "tally WHERE (status = 0 OR status = 2) AND jobs = 1"), 2);
    CHECK_INT(rows_in(p.path, "upload"), 0);
    CHECK_INT(rows_in(p.path, "webhook"), 0);
    store_request again = {.body = "{\"b\": 2}", .body_len = 8, .idempotency_key = "key"};
    CHECK_INT(store_submit(p.s, &again, &j, &repeated), STORE_OK);
    CHECK(repeated);
    CHECK_STR(j.id, "00000000000000000000000000000001");
    job_clear(&j);
    CHECK_INT(claim_id(p.s, "me", id), STORE_OK);
    CHECK_STR(id, "00000000000000000000000000000002");
    CHECK_INT(finish_as(p.s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    finish_cases(&p, id, 2);
    if (place_reopen(&p)) /* now of the present format */
        check_old_job(&p);
    place_end(&p);
}

/* A step that fails (here: a row that the new tables refuse) leaves the file as it was, for the old program. */
TEST(a_file_that_cannot_be_taken_over_stays_as_it_was)
{
    place p;
    char message[400] = "";
    if (!begin_old(&p, FORMAT_1, FORMAT_1_ROWS))
        return;
    change_file(p.path, "CREATE TABLE answer(mine TEXT)");
    p.s = store_open(p.path, message, sizeof message);
    CHECK(!p.s && strstr(message, "present format"));
    CHECK_INT(rows_in(p.path, "vector"), 2);
    CHECK_INT(rows_in(p.path, "vector_1"), -1);
    change_file(p.path, "DROP TABLE answer");
    if (place_open(&p))
        check_old_job(&p);
    place_end(&p);
}

/* ---- formats 2 to 5 */

/* What a format added is taken away again: what is left is the format before it, as it was written then. */
static const char *const TO_FORMAT[] = {
    [10] =
        "DROP TRIGGER share_comes; DROP TRIGGER share_moves; DROP INDEX share_at_work; DROP INDEX share_idle;"
        "CREATE INDEX share_at_work ON share(used) WHERE waiting + running > 0;"
        "CREATE INDEX share_idle ON share(used) WHERE waiting + running = 0;"
        "CREATE TRIGGER share_comes AFTER INSERT ON job WHEN NEW.status = 0 BEGIN"
        " INSERT INTO share(name, ahead, waiting, small, used) VALUES(NEW.share, NEW.priority > 5, 1, NEW.small, 0.0)"
        " ON CONFLICT(name, ahead) DO UPDATE SET waiting = waiting + 1, small = small + excluded.small; END;"
        "CREATE TRIGGER share_moves AFTER UPDATE OF status ON job WHEN NEW.status <> OLD.status BEGIN"
        " UPDATE share SET waiting = waiting + (NEW.status = 0) - (OLD.status = 0),"
        " running = running + (NEW.status = 1) - (OLD.status = 1)"
        " WHERE name = NEW.share AND ahead = (NEW.priority > 5); END; PRAGMA user_version = 10;",
    [9] = "DROP TRIGGER piece_unused; DROP INDEX vector_by_piece; DROP TABLE piece;"
          "ALTER TABLE vector DROP COLUMN shared; PRAGMA user_version = 9;",
    [8] = "DROP TRIGGER share_comes; DROP TRIGGER share_moves; DROP TABLE share;"
          "DROP INDEX job_by_lane; DROP INDEX job_by_turn; ALTER TABLE job DROP COLUMN share;"
          "ALTER TABLE job DROP COLUMN small;"
          "CREATE INDEX job_by_turn ON job(priority DESC, id) WHERE status = 0; PRAGMA user_version = 8;",
    [7] = "DELETE FROM tally WHERE status < 0; PRAGMA user_version = 7;",
    [6] = "DROP TRIGGER client_insert; DROP TRIGGER client_delete; DROP TRIGGER client_update; DROP TRIGGER "
          "client_worked;"
          "DROP TRIGGER upload_delete; DROP TABLE upload_client; DROP TABLE client; DROP INDEX job_by_client;"
          "ALTER TABLE job DROP COLUMN client; PRAGMA user_version = 6;",
    [5] = "ALTER TABLE job DROP COLUMN contents; ALTER TABLE job DROP COLUMN contents_sum; PRAGMA user_version = 5;",
    [4] = "ALTER TABLE job DROP COLUMN summary_sum; ALTER TABLE request DROP COLUMN sum;"
          "ALTER TABLE answer DROP COLUMN sum; ALTER TABLE vector DROP COLUMN sum;"
          "ALTER TABLE history DROP COLUMN sum; PRAGMA user_version = 4;",
    [3] = "DROP TRIGGER tally_insert; DROP TRIGGER tally_delete; DROP TRIGGER tally_update;"
          "DROP TABLE tally; PRAGMA user_version = 3;",
    [2] = "DROP TRIGGER webhook_falls_due; DROP TABLE webhook; DROP TABLE upload_use; DROP TABLE upload;"
          "DROP INDEX job_by_turn; DROP INDEX job_by_queue_until; DROP INDEX job_by_end;"
          "ALTER TABLE job DROP COLUMN priority; ALTER TABLE job DROP COLUMN queue_until;"
          "ALTER TABLE job DROP COLUMN bytes; PRAGMA user_version = 2;"};

static const double ANSWER[3] = {1.5, -2.0, 0.0};

static store_status finish_with_answer(store *s, const char *id)
{
    store_vector gaps = {"gaps", 3, ANSWER};
    store_outcome outcome = {.status = JOB_SUCCESSFUL,
                             .whole = {.summary = "{\"a\": 1}",
                                       .vectors = &gaps,
                                       .n_vectors = 1,
                                       .history = ANSWER,
                                       .history_rows = 1,
                                       .history_columns = 3}};
    return finish_as(s, id, "me", &outcome);
}

static void check_answer_of(store *s, const char *id)
{
    job j = {0};
    double *x = NULL;
    int64_t n = 0, columns = 0;
    CHECK_INT(store_get(s, id, &j), STORE_OK);
    CHECK(!j.damaged && j.summary && strcmp(j.summary, "{\"a\": 1}") == 0);
    job_clear(&j);
    CHECK_INT(store_get_vector(s, id, 0, "gaps", &x, &n), STORE_OK);
    CHECK(n == 3 && x && memcmp(x, ANSWER, sizeof ANSWER) == 0);
    free(x);
    CHECK_INT(store_get_history(s, id, 0, -1, &x, &n, &columns), STORE_OK);
    CHECK(n == 1 && columns == 3 && x && memcmp(x, ANSWER, sizeof ANSWER) == 0);
    free(x);
}

static void check_taken_over(int version)
{
    place p;
    char id[33], ended[33];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 3; i++)
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", ended), STORE_OK);
    CHECK_INT(finish_with_answer(p.s, ended), STORE_OK);
    store_close(p.s);
    for (int at = (int)(sizeof TO_FORMAT / sizeof TO_FORMAT[0]) - 1; at >= version; at--)
        change_file(p.path, TO_FORMAT[at]);
    CHECK_INT(rows_in(p.path, "tally WHERE status >= 0"), version < 4 ? -1 : 5);
    CHECK_INT(rows_in(p.path, "request WHERE sum > 0"), -1);
    check_findings(&p, "");
    CHECK_INT(rows_in(p.path, "upload"), version < 3 ? -1 : 0);
    if (place_open(&p)) {
        CHECK_INT(rows_in(p.path, "upload"), 0);
        CHECK_INT(rows_in(p.path, "webhook"), 0);
        CHECK_INT(rows_in(p.path, "job WHERE bytes >= 2 AND status = 2"), 1);
        check_counts(p.s, 2, 0, 1, 0, 0);
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
        check_counts(p.s, 3, 0, 1, 0, 0);
        CHECK_INT(rows_in(p.path, "request WHERE sum IS NULL"), 3); /* what was there is taken as it is */
        CHECK_INT(rows_in(p.path, "request WHERE sum > 0"), 1);
        check_answer_of(p.s, ended);
        CHECK_INT(claim_id(p.s, "me", id), STORE_OK);
    }
    place_end(&p);
}

static void check_numbers(place *p, const char *id, int64_t number, const char *name, const double *x, int64_t count)
{
    double *found = NULL;
    int64_t n = -1, columns = 1;
    CHECK_INT(name ? store_get_vector(p->s, id, number, name, &found, &n)
                   : store_get_history(p->s, id, number, -1, &found, &n, &columns),
              STORE_OK);
    CHECK(n * columns == count && found && (count == 0 || memcmp(found, x, (size_t)count * 8) == 0));
    free(found);
}

/* The file was dumped from a database that another build wrote: its checksums and bytes are not this one's. */
TEST(results_in_a_file_of_format_5_are_read)
{
    static const char ID[] = "01a206072111000025598f8f840faed2";
    static const double GAPS[] = {0, 2, 1, -1}, HISTORY[] = {0, 1, 2, 1, 0.5, 0.25}, REACTION = 0.1;
    place p;
    size_t len;
    job j = {0};
    double *x;
    int64_t n, columns;
    char *dump = test_read_file("tests/data/store_format_5.sql", &len);
    CHECK(dump != NULL);
    if (!dump || !begin_old(&p, dump, ""))
        return;
    free(dump);
    check_findings(&p, "");
    if (place_open(&p)) {
        CHECK_INT(store_get(p.s, ID, &j), STORE_OK);
        CHECK(j.status == JOB_SUCCESSFUL && !j.damaged);
        CHECK_STR(j.summary, "{\"a\": 1}");
        job_clear(&j);
        check_numbers(&p, ID, 0, "gaps", GAPS, 4);
        check_numbers(&p, ID, 0, "nodes", NULL, 0);
        check_numbers(&p, ID, 1, "reactions", &REACTION, 1);
        check_numbers(&p, ID, 0, NULL, HISTORY, 6);
        check_numbers(&p, ID, 2, NULL, HISTORY, 6);
        CHECK_INT(store_get_vector(p.s, ID, 2, "reactions", &x, &n), STORE_NOT_FOUND);
        CHECK_INT(store_get_history(p.s, ID, 1, -1, &x, &n, &columns), STORE_NOT_FOUND);
        CHECK_INT(store_count_vectors(p.s, ID, "gaps", &n), STORE_OK);
        CHECK_INT(n, 4);
        /* What this build writes of the same numbers takes as many bytes. */
        char id[33];
        CHECK_INT(claim_id(p.s, "me", id), STORE_OK);
        CHECK_INT(finish_with_answer(p.s, id), STORE_OK);
        CHECK_INT(rows_in(p.path, "job WHERE bytes = 144 AND status = 2"),
                  1);                                                         /* 8 of the body, 4 + 1 + 6 + 6 numbers */
        CHECK_INT(rows_in(p.path, "job WHERE bytes = 56 AND status = 2"), 1); /* 8, and 3 + 3 */
    }
    place_end(&p);
}

TEST(a_file_of_format_4_is_taken_over)
{
    check_taken_over(4);
}

TEST(a_file_of_format_2_is_taken_over)
{
    check_taken_over(2);
}

TEST(a_file_of_format_3_is_taken_over)
{
    check_taken_over(3);
}

/* What changed within a row is found by who reads it and by the check; every other row is read as before. */
TEST(what_is_not_what_was_written_is_not_shown)
{
    static const char *const DAMAGES[][2] = {
        {"UPDATE vector SET data = x'000000000000f83f00000000000000c00000000000000001'", "gaps of job "},
        {"UPDATE vector SET job = (SELECT max(id) FROM job)", "gaps of job "}, /* another one's */
        {"UPDATE history SET data = x'000000000000f83f00000000000000c00000000000000001'", "history of job "},
        {"UPDATE history SET last = 2.5", "history of job "},
        {"UPDATE job SET summary = '{\"a\": 9}' WHERE status = 2", "summary of job "},
        {"UPDATE request SET body = CAST('{ }' AS BLOB) WHERE job = (SELECT max(id) FROM job)", "request of job "},
    };
    for (size_t i = 0; i < sizeof DAMAGES / sizeof DAMAGES[0]; i++) {
        place p;
        char id[33], other[33], claimed[33];
        job j = {0}, *jobs = NULL;
        double *x = NULL;
        char *body = NULL;
        int64_t n, columns;
        size_t len, count = 0;
        bool more;
        if (!place_begin(&p))
            return;
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, other), STORE_OK);
        CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
        CHECK_INT(finish_with_answer(p.s, claimed), STORE_OK);
        store_close(p.s);
        check_findings(&p, "");
        change_file(p.path, DAMAGES[i][0]);
        check_findings(&p, DAMAGES[i][1]);
        if (!place_open(&p))
            return;
        bool vector = i < 2, history = i == 2 || i == 3, summary = i == 4, request = i == 5;
        CHECK_INT(store_get_vector(p.s, i == 1 ? other : id, 0, "gaps", &x, &n), vector ? STORE_DAMAGED : STORE_OK);
        CHECK(!x == vector);
        free(x);
        CHECK_INT(store_get_history(p.s, id, 0, -1, &x, &n, &columns), history ? STORE_DAMAGED : STORE_OK);
        CHECK(!x == history);
        free(x);
        CHECK_INT(store_get(p.s, id, &j), STORE_OK);
        CHECK(j.damaged == summary && !j.summary == summary && j.status == JOB_SUCCESSFUL);
        job_clear(&j);
        CHECK_INT(store_list(p.s, &(store_query){.limit = 10}, &jobs, &count, &more), STORE_OK);
        CHECK(count == 2 && jobs[1].damaged == summary && !jobs[0].damaged);
        for (size_t k = 0; k < count; k++)
            job_clear(&jobs[k]);
        free(jobs);
        CHECK_INT(store_get_body(p.s, other, &body, &len), request ? STORE_DAMAGED : STORE_OK);
        CHECK(!body == request);
        free(body);
        CHECK_INT(store_claim(p.s, "me", 30.0, false, &(store_lease){.token = 0}, &j, &body, &len),
                  STORE_OK); /* to be failed */
        CHECK_STR(j.id, other);
        CHECK(!body == request);
        free(body);
        job_clear(&j);
        place_end(&p);
    }
}

/* What is not there any more, or under another name, is missed. */
TEST(a_lost_part_of_a_result_is_missed)
{
    static const char *const DAMAGES[][2] = {
        {"UPDATE vector SET name = 'gapt'", "gapt of job "},
        {"DELETE FROM vector", "a part of the result of job "},
        {"DELETE FROM history", "a part of the result of job "},
        {"DELETE FROM answer WHERE number = 2", "a part of the result of job "},
        {"UPDATE answer SET name = 'tvo' WHERE number = 2", "2 of job "},
        {"UPDATE job SET contents = '4 1' WHERE status = 2", "the list of the result of job "},
        {"UPDATE job SET contents = NULL WHERE status = 2", "the list of the result of job "},
    };
    for (size_t i = 0; i < sizeof DAMAGES / sizeof DAMAGES[0]; i++) {
        place p;
        char id[33], claimed[33];
        double *x = NULL;
        int64_t n, columns;
        store_case *cases;
        size_t count;
        store_vector gaps = {"gaps", 3, ANSWER};
        const store_answer two[] = {{.name = "one", .summary = "{}"}, {.name = "two", .summary = "{}"}};
        store_outcome outcome = {
            .status = JOB_SUCCESSFUL,
            .whole = {.vectors = &gaps, .n_vectors = 1, .history = ANSWER, .history_rows = 1, .history_columns = 3},
            .cases = two,
            .n_cases = 2};
        if (!place_begin(&p))
            return;
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
        CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
        CHECK_INT(finish_as(p.s, claimed, "me", &outcome), STORE_OK);
        CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), STORE_NOT_FOUND);
        CHECK_INT(store_get_vector(p.s, id, 1, "gaps", &x, &n), STORE_NOT_FOUND);
        CHECK_INT(store_get_cases(p.s, id, "three", &cases, &count), STORE_OK);
        CHECK(count == 0);
        store_close(p.s);
        check_findings(&p, "");
        change_file(p.path, DAMAGES[i][0]);
        check_findings(&p, DAMAGES[i][1]);
        if (!place_open(&p))
            return;
        const bool list = i >= 5, in_cases = i >= 3;
        CHECK_INT(store_get_vector(p.s, id, 0, "gaps", &x, &n), i < 2 ? STORE_DAMAGED : STORE_OK);
        free(x);
        CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), list ? STORE_DAMAGED : STORE_NOT_FOUND);
        CHECK_INT(store_get_history(p.s, id, 0, -1, &x, &n, &columns), i == 2 ? STORE_DAMAGED : STORE_OK);
        free(x);
        CHECK_INT(store_get_cases(p.s, id, NULL, &cases, &count), in_cases ? STORE_DAMAGED : STORE_OK);
        store_cases_free(cases, count);
        CHECK_INT(store_get_cases(p.s, id, "two", &cases, &count), i == 3 || i == 4 ? STORE_DAMAGED : STORE_OK);
        store_cases_free(cases, count);
        place_end(&p);
    }
}

/* The trail stays bounded, bears half a line, and is not taken for that of another database. */
TEST(a_trail_of_what_was_committed)
{
    place p;
    char id[33], path[200], *text;
    size_t len;
    if (!place_begin(&p))
        return;
    snprintf(path, sizeof path, "%s-trail", p.path);
    for (int i = 0; i < 3; i++)
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
    CHECK(!p.s->missing);
    store_close(p.s);
    text = test_read_file(path, &len);
    CHECK(text && strstr(text, id) && strstr(text, " submitted ") && strncmp(text, "uzawad trail ", 13) == 0);
    free(text);
    /* a line of a commit that the database does not have, and half a one */
    FILE *file = fopen(path, "a");
    for (int i = 0; file && i < 40000; i++)
        fprintf(file, "1 submitted %032d\n", i);
    if (file && fprintf(file, "900000 ended lostlostlostlost\n900001 submitted half"))
        fclose(file);
    check_findings(&p, "Lost: ended lostlostlostlost (900000)");
    if (!place_open(&p))
        return;
    CHECK(p.s->missing && strstr(p.s->missing, "900000 to 900000") && !strstr(p.s->missing, "half"));
    CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
    store_close(p.s);
    check_findings(&p, "");
    text = test_read_file(path, &len);
    CHECK(text && len < (1 << 20) && strstr(text, id) && strstr(text, "\n900001 submitted half\n900001 submitted "));
    free(text);
    if (!place_open(&p))
        return;
    CHECK(!p.s->missing);
    store_close(p.s);
    change_file(p.path,
                "UPDATE tally SET jobs = jobs + 1 WHERE status = -2; UPDATE tally SET jobs = 1 WHERE status = -1");
    if (!place_open(&p))
        return;
    CHECK(!p.s->missing);
    place_end(&p);
}

TEST(a_check_finds_what_is_wrong)
{
    static const struct {
        const char *sql, *finding;
    } DAMAGES[] = {
        {"DELETE FROM request WHERE rowid = 1", "has no request"},
        {"UPDATE tally SET jobs = 7 WHERE status = 0", "tally of jobs with status 0"},
        {"UPDATE share SET small = 1; INSERT INTO share(name, ahead) VALUES('idle', 0)", "counted of share  is wrong"},
        {"UPDATE share SET waiting = 2", "counted of share  is wrong"},
        {"UPDATE share SET name = 'other'", "counted of share other is wrong"},
        {"INSERT INTO tag VALUES('x', 'nobody')", "a row of tag refers to what is not there"},
    };
    for (size_t i = 0; i < sizeof DAMAGES / sizeof DAMAGES[0]; i++) {
        place p;
        char id[33], message[300] = "";
        store_findings found;
        if (!place_begin(&p))
            return;
        CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK);
        store_close(p.s);
        CHECK(store_check_file(p.path, &found, message, sizeof message));
        CHECK_STR(found.findings, "");
        free(found.findings);
        change_file(p.path, DAMAGES[i].sql);
        CHECK(store_check_file(p.path, &found, message, sizeof message));
        CHECK_MSG(strstr(found.findings, DAMAGES[i].finding), "%s", found.findings);
        free(found.findings);
        place_open(&p);
        place_end(&p);
    }
}

/* A check that SQLite has no memory for says so: it calls nothing whole that it has not seen, and nothing lost. */
TEST(a_check_without_memory_ends_early)
{
    place p;
    char id[33];
    int early = 0, whole = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    for (int room = 0; room < 400 << 10; room += 1 << 10) {
        store_findings found = {0};
        sqlite3_hard_heap_limit64(sqlite3_memory_used() + room + 1);
        const store_status status = store_check(p.s, &found);
        sqlite3_hard_heap_limit64(0);
        if (status == STORE_OK && found.findings[0])
            early += strstr(found.findings, "out of memory") || strstr(found.findings, "error code=7");
        else if (status == STORE_OK)
            whole += found.jobs == 1;
        CHECK_MSG(early + whole == room / 1024 + 1, "with %d bytes: %d, %s", room, (int)status, found.findings);
        free(found.findings);
        if (early + whole != room / 1024 + 1)
            break;
    }
    CHECK_MSG(early > 0 && whole > 0, "%d and %d", early, whole);
    place_end(&p);
}

TEST(what_is_no_database_of_ours_is_not_checked)
{
    place p;
    char message[300] = "", other[128];
    store_findings found;
    if (!place_begin(&p))
        return;
    snprintf(other, sizeof other, "%s/other", p.folder);
    CHECK(!store_check_file(other, &found, message, sizeof message) && strstr(message, other));
    CHECK(!store_backup_file(other, "/nonexistent/x", NULL, message, sizeof message));
    change_file(other, "CREATE TABLE mine(x)");
    CHECK(!store_check_file(other, &found, message, sizeof message) && strstr(message, "another program"));
    unlink(other);
    place_end(&p);
}

TEST(a_backup_is_of_one_moment_while_others_write)
{
    place p, copy;
    char id[33], message[300] = "";
    int64_t bytes = 0;
    struct stat st;
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 20; i++)
        CHECK_INT(submit_text(p.s, "{\"n\": 1}", "[\"a\"]", NULL, id), STORE_OK);
    copy = p;
    snprintf(copy.path, sizeof copy.path, "%s/copy.db", p.folder);
    CHECK_MSG(store_backup_file(p.path, copy.path, &bytes, message, sizeof message), "%s", message);
    CHECK(stat(copy.path, &st) == 0 && st.st_size == bytes && bytes > 4096);
    CHECK_INT(submit_text(p.s, "{}", NULL, NULL, id), STORE_OK); /* the store goes on */
    CHECK(!store_backup_file(p.path, copy.path, NULL, message, sizeof message) && strstr(message, "there already"));
    copy.s = NULL;
    if (place_open(&copy)) {
        check_counts(copy.s, 20, 0, 0, 0, 0);
        CHECK_INT(store_get(copy.s, id, &(job){0}), STORE_NOT_FOUND);
        store_close(copy.s);
    }
    place_remove_files(&copy);
    place_end(&p);
}
