/* What the store keeps of load cases and of jobs that refine others, and files of earlier formats. */
#include "store_place.h"

#include <math.h>

/* ---- cases */

/* Finishes a new job with n cases named "c0", "c1", ...: reactions {i, i + 1}, a history of one row. */
static void finish_cases(place *p, char id[33], size_t n)
{
    char other[33], names[4][24];
    double r[4][2], rows[4][12], nodes[3] = {7, 8, 9};
    store_vector reactions[4], shared = {"nodes", 3, nodes};
    store_answer cases[4];
    CHECK(n <= 4);
    for (size_t i = 0; i < n; i++) {
        snprintf(names[i], sizeof names[i], "c%zu", i);
        r[i][0] = (double)i;
        r[i][1] = (double)i + 1;
        for (int j = 0; j < 12; j++)
            rows[i][j] = 100.0 * (double)i + j;
        reactions[i] = (store_vector){"reactions", 2, r[i]};
        cases[i] = (store_answer){names[i], "{\"outcome\": \"converged\"}", &reactions[i], 1, rows[i], 1, 12};
    }
    store_outcome outcome = {.status = JOB_SUCCESSFUL,
                             .whole = {.summary = "{\"all\": true}", .vectors = &shared, .n_vectors = 1},
                             .cases = cases,
                             .n_cases = n};
    CHECK_INT(submit_text(p->s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p->s, "me", other), STORE_OK);
    CHECK_INT(finish_as(p->s, id, "me", &outcome), STORE_OK);
}

TEST(each_case_has_its_own_answer)
{
    place p;
    char id[33];
    store_case *cases = NULL;
    double *x = NULL;
    int64_t n = 0, columns = 0;
    size_t count = 0;
    if (!place_begin(&p))
        return;
    finish_cases(&p, id, 3);
    CHECK_INT(store_get_cases(p.s, id, NULL, &cases, &count), STORE_OK);
    CHECK_INT(count, 3);
    for (size_t i = 0; i < count; i++) {
        CHECK_INT(cases[i].number, i + 1);
        CHECK(cases[i].name[0] == 'c' && cases[i].name[1] == (char)('0' + i));
        CHECK_STR(cases[i].summary, "{\"outcome\": \"converged\"}");
        CHECK_INT(store_get_vector(p.s, id, cases[i].number, "reactions", &x, &n), STORE_OK);
        CHECK(n == 2 && x[0] == (double)i && x[1] == (double)i + 1);
        free(x);
        CHECK_INT(store_get_history(p.s, id, cases[i].number, -1, &x, &n, &columns), STORE_OK);
        CHECK(n == 1 && columns == 12 && x[3] == 100.0 * (double)i + 3);
        free(x);
    }
    store_cases_free(cases, count);
    CHECK_INT(store_get_vector(p.s, id, 0, "nodes", &x, &n), STORE_OK);
    CHECK(n == 3 && x[2] == 9);
    free(x);
    CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), STORE_NOT_FOUND);
    CHECK_INT(store_get_history(p.s, id, 0, -1, &x, &n, &columns), STORE_NOT_FOUND);
    CHECK_INT(store_count_vectors(p.s, id, "reactions", &n), STORE_OK);
    CHECK_INT(n, 6);
    place_end(&p);
}

TEST(a_case_is_found_by_its_name)
{
    place p;
    char id[33], plain[33];
    store_case *cases = NULL;
    size_t count = 0;
    if (!place_begin(&p))
        return;
    finish_cases(&p, id, 3);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, plain), STORE_OK);
    CHECK_INT(store_get_cases(p.s, id, "c1", &cases, &count), STORE_OK);
    CHECK(count == 1 && cases[0].number == 2);
    store_cases_free(cases, count);
    CHECK_INT(store_get_cases(p.s, id, "C1", &cases, &count), STORE_OK);
    CHECK(count == 0 && !cases);
    CHECK_INT(store_get_cases(p.s, plain, NULL, &cases, &count), STORE_OK);
    CHECK(count == 0 && !cases);
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

/* Two cases of one name break the uniqueness in the middle of the transaction: nothing of it may stay. */
TEST(a_finish_that_fails_in_a_case_leaves_nothing)
{
    place p;
    char id[33], other[33];
    double x = 1.0;
    store_vector v = {"reactions", 1, &x};
    store_answer twice[2] = {{"same", "{}", &v, 1, NULL, 0, 0}, {"same", "{}", &v, 1, NULL, 0, 0}};
    store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole = {.summary = "{}"}, .cases = twice, .n_cases = 2};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", other), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "me", &outcome), STORE_ERROR);
    CHECK_INT(status_of(p.s, id), JOB_RUNNING);
    CHECK_INT(rows_in(p.path, "answer"), 0);
    CHECK_INT(rows_in(p.path, "vector"), 0);
    CHECK_INT(finish_as(p.s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    place_end(&p);
}

/* ---- refines, body */

TEST(a_refining_job_outlives_the_one_it_refines)
{
    place p;
    char old[33], id[33], *body = NULL;
    size_t len = 0;
    job j = {0};
    bool repeated = false;
    job_status was;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{\"old\": 1}", "[]", NULL, old), STORE_OK);
    store_request request = {.body = "{\"new\": 1}", .body_len = 10, .refines = old};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    CHECK_STR(j.refines, old);
    CHECK_STR(j.tags, "[]");
    strcpy(id, j.id);
    job_clear(&j);
    CHECK_INT(store_get_body(p.s, old, &body, &len), STORE_OK);
    CHECK(len == 10 && body && memcmp(body, "{\"old\": 1}", 11) == 0);
    free(body);
    CHECK_INT(store_dismiss(p.s, old, &was), STORE_OK); /* dismissed */
    CHECK_INT(store_dismiss(p.s, old, &was), STORE_OK); /* deleted */
    CHECK_INT(store_get_body(p.s, old, &body, &len), STORE_NOT_FOUND);
    CHECK(!body && len == 0);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK_STR(j.refines, old);
    job_clear(&j);
    place_end(&p);
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

/* The place with a file of format 1 instead of a new one; the store is closed. */
static bool begin_old(place *p, const char *rows)
{
    if (!place_begin(p))
        return false;
    store_close(p->s);
    p->s = NULL;
    unlink(p->path);
    change_file(p->path, FORMAT_1);
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
    if (!begin_old(&p, FORMAT_1_ROWS) || !place_open(&p))
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
    if (!begin_old(&p, FORMAT_1_ROWS))
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
