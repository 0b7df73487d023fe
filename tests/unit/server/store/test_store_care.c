/* Looking after a database: counts, checks, backups, and a file of format 2. */
#include "store_place.h"

#include <sys/stat.h>

static void check_counts(store *s, int64_t accepted, int64_t running, int64_t successful, int64_t failed,
                         int64_t dismissed)
{
    const int64_t want[5] = {accepted, running, successful, failed, dismissed};
    int64_t have[5];
    store_findings found;
    CHECK_INT(store_counts(s, have), STORE_OK);
    for (int i = 0; i < 5; i++)
        CHECK_MSG(have[i] == want[i], "%s: %lld, want %lld", job_status_name((job_status)i), (long long)have[i],
                  (long long)want[i]);
    CHECK_INT(store_check(s, &found), STORE_OK);
    CHECK_STR(found.findings, "");
    CHECK_INT(found.jobs, accepted + running + successful + failed + dismissed);
    free(found.findings);
}

TEST(counts_follow_every_change)
{
    place p;
    char ids[5][33], claimed[33];
    job_status was;
    if (!place_begin(&p))
        return;
    check_counts(p.s, 0, 0, 0, 0, 0);
    for (int i = 0; i < 5; i++)
        CHECK_INT(submit_text(p.s, "{}", "[\"a\"]", NULL, ids[i]), STORE_OK);
    check_counts(p.s, 5, 0, 0, 0, 0);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_INT(finish_as(p.s, claimed, "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    check_counts(p.s, 3, 1, 1, 0, 0);
    CHECK_INT(release_as(p.s, claimed, "me"), STORE_OK);
    CHECK_INT(store_dismiss(p.s, ids[4], &was), STORE_OK);
    check_counts(p.s, 3, 0, 1, 0, 1);
    CHECK_INT(store_dismiss(p.s, ids[0], &was), STORE_OK); /* ended: deleted */
    check_counts(p.s, 3, 0, 0, 0, 1);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    if (place_reopen(&p)) {
        CHECK_INT(store_recover(p.s, 1, "{}", NULL, NULL), STORE_OK);
        check_counts(p.s, 2, 0, 0, 1, 1);
    }
    place_end(&p);
}

/* What a format added is taken away again: what is left is the format before it, as it was written then. */
static const char *const TO_FORMAT[] = {
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
    for (int at = 4; at >= version; at--)
        change_file(p.path, TO_FORMAT[at]);
    CHECK_INT(rows_in(p.path, "tally"), version < 4 ? -1 : 5);
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
        CHECK_INT(store_claim(p.s, "me", 30.0, &(store_lease){.token = 0}, &j, &body, &len),
                  STORE_OK); /* to be failed */
        CHECK_STR(j.id, other);
        CHECK(!body == request);
        free(body);
        job_clear(&j);
        place_end(&p);
    }
}

TEST(a_check_finds_what_is_wrong)
{
    static const struct {
        const char *sql, *finding;
    } DAMAGES[] = {
        {"DELETE FROM request WHERE rowid = 1", "has no request"},
        {"UPDATE tally SET jobs = 7 WHERE status = 0", "tally of jobs with status 0"},
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
    unlink(copy.path);
    place_end(&p);
}
