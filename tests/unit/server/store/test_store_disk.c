/* The store and its file: crashes, restarts, foreign files, a second daemon, a full disk, many threads. */
#include "store/sqlite/sqlite.h"
#include "store_place.h"

#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

/* ---- sizes */

TEST(large_bodies)
{
    place p;
    size_t size = 64u << 20, len;
    char *body = malloc(size), *back = NULL;
    job j = {0};
    bool repeated = false;
    if (place_begin(&p)) {
        memset(body, 'x', size);
        body[size / 2] = '\0'; /* a body is bytes, not a text */
        CHECK_INT(store_submit(p.s,
                               &(store_request){.body = body, .body_len = size, .tags = "[]", .idempotency_key = "k"},
                               &j, &repeated),
                  STORE_OK);
        job_clear(&j);
        CHECK_INT(store_submit(p.s,
                               &(store_request){.body = body, .body_len = size, .tags = "[]", .idempotency_key = "k"},
                               &j, &repeated),
                  STORE_OK);
        CHECK(repeated);
        job_clear(&j);
        body[size - 1] = 'y';
        CHECK_INT(store_submit(p.s,
                               &(store_request){.body = body, .body_len = size, .tags = "[]", .idempotency_key = "k"},
                               &j, &repeated),
                  STORE_CONFLICT);
        body[size - 1] = 'x';
        CHECK_INT(store_claim(p.s, "a", 1, &(store_lease){.token = 0}, &j, &back, &len), STORE_OK);
        CHECK(len == size && memcmp(back, body, size) == 0 && back[len] == '\0');
        job_clear(&j);
        free(back);
        place_end(&p);
    }
    free(body);
}

/* ---- crashes and restarts */

TEST(a_submitted_job_survives_a_kill)
{
    place p;
    char id[33] = "", claimed[33] = "";
    int pipe_ends[2];
    if (!place_begin(&p))
        return;
    store_close(p.s);
    p.s = NULL;
    CHECK_INT(pipe(pipe_ends), 0);
    pid_t child = fork();
    if (child == 0) {
        char message[200];
        store *s = store_open(p.path, message, sizeof message);
        bool ok = s && submit_text(s, "{}", "[]", NULL, id) == STORE_OK && claim_id(s, "gone", claimed) == STORE_OK &&
                  submit_text(s, "{}", "[]", NULL, id) == STORE_OK;
        ok = ok && write(pipe_ends[1], claimed, 33) == 33 && write(pipe_ends[1], id, 33) == 33;
        kill(getpid(), SIGKILL);
        _exit(ok);
    }
    close(pipe_ends[1]);
    CHECK_INT(read(pipe_ends[0], claimed, 33), 33);
    CHECK_INT(read(pipe_ends[0], id, 33), 33);
    close(pipe_ends[0]);
    waitpid(child, NULL, 0);
    if (!place_open(&p))
        return;
    CHECK_INT(status_of(p.s, id), JOB_ACCEPTED);
    CHECK_INT(status_of(p.s, claimed), JOB_RUNNING);
    int64_t requeued = -1, failed = -1;
    CHECK_INT(store_recover(p.s, 3, "{}", &requeued, &failed), STORE_OK);
    CHECK(requeued == 1 && failed == 0);
    CHECK_INT(status_of(p.s, claimed), JOB_ACCEPTED);
    place_end(&p);
}

TEST(recover_ends_a_job_that_was_dismissed_while_it_ran)
{
    place p;
    char ids[3][33], claimed[33];
    int64_t requeued, failed;
    job_status was;
    job j = {0};
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 3; i++) {
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, ids[i]), STORE_OK);
        CHECK_INT(claim_id(p.s, "a", claimed), STORE_OK);
    }
    CHECK_INT(store_dismiss(p.s, ids[0], &was), STORE_OK);
    CHECK_INT(was, JOB_RUNNING);
    CHECK_INT(store_dismiss(p.s, ids[1], &was), STORE_OK);
    CHECK_INT(finish_as(p.s, ids[1], "a", &(store_outcome){.status = JOB_SUCCESSFUL}), STORE_OK); /* was sooner */
    if (!place_reopen(&p))
        return;
    CHECK_INT(store_recover(p.s, 1, "{}", &requeued, &failed), STORE_OK); /* before attempts count */
    CHECK(requeued == 0 && failed == 1);
    CHECK_INT(store_get(p.s, ids[0], &j), STORE_OK);
    CHECK(j.status == JOB_DISMISSED && j.finished > 0 && !j.error);
    job_clear(&j);
    CHECK_INT(status_of(p.s, ids[1]), JOB_SUCCESSFUL);
    CHECK_INT(status_of(p.s, ids[2]), JOB_FAILED);
    place_end(&p);
}

TEST(recover_fails_a_job_that_used_up_its_attempts)
{
    place p;
    char id[33], again[33];
    int64_t requeued, failed;
    job j = {0};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    for (int attempt = 1; attempt <= 3; attempt++) {
        CHECK_INT(claim_id(p.s, "a", again), STORE_OK);
        if (!place_reopen(&p))
            return;
        CHECK_INT(store_recover(p.s, 3, "{\"code\": \"gave_up\"}", &requeued, &failed), STORE_OK);
        CHECK_INT(requeued, attempt < 3);
        CHECK_INT(failed, attempt == 3);
    }
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_FAILED && j.attempts == 3 && j.finished > 0);
    CHECK_STR(j.error ? j.error : "", "{\"code\": \"gave_up\"}");
    job_clear(&j);
    CHECK_INT(store_recover(p.s, 3, "{}", NULL, NULL), STORE_OK);
    place_end(&p);
}

/* ---- what is refused at opening */

static void check_refused(const char *path, const char *part_of_message)
{
    char message[400] = "";
    store *s = store_open(path, message, sizeof message);
    CHECK(!s);
    CHECK_MSG(strstr(message, part_of_message), "\"%s\" does not say \"%s\"", message, part_of_message);
    CHECK(strstr(message, path));
    store_close(s);
}

TEST(refuses_what_is_not_its_own)
{
    place p;
    if (!place_begin(&p))
        return;
    store_close(p.s);
    p.s = NULL;
    change_file(p.path, "PRAGMA user_version = 99");
    check_refused(p.path, "newer");
    change_file(p.path, "PRAGMA user_version = 1; PRAGMA application_id = 7");
    check_refused(p.path, "another program");
    unlink(p.path);
    change_file(p.path, "CREATE TABLE other(x)");
    check_refused(p.path, "another program");
    CHECK_INT(rows_in(p.path, "other"), 0); /* and it is left as it was */
    unlink(p.path);
    FILE *file = fopen(p.path, "w");
    for (int i = 0; i < 200; i++)
        fputs("This is not a database.\n", file);
    fclose(file);
    check_refused(p.path, "not an SQLite database");
    check_refused(p.folder, "open the file");
    check_refused("/dev/null", "not a regular file");
    check_refused("/nowhere/at/all.db", "open the file");
    place_end(&p);
}

TEST(an_empty_file_is_taken)
{
    place p;
    if (!place_begin(&p))
        return;
    store_close(p.s);
    CHECK_INT(truncate(p.path, 0), 0);
    CHECK(place_open(&p));
    place_end(&p);
}

TEST(a_second_daemon_is_refused)
{
    place p;
    if (!place_begin(&p))
        return;
    pid_t child = fork();
    if (child == 0) {
        char message[300] = "", link[128];
        snprintf(link, sizeof link, "%s/link.db", p.folder);
        bool ok = symlink("jobs.db", link) == 0 && !store_open(p.path, message, sizeof message) &&
                  strstr(message, "another daemon") && !store_open(link, message, sizeof message) &&
                  strstr(message, "another daemon");
        unlink(link);
        _exit(ok ? 0 : 1);
    }
    int status = -1;
    waitpid(child, &status, 0);
    CHECK(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    CHECK(place_reopen(&p)); /* free again after it is closed */
    place_end(&p);
}

/* ---- a full disk */

TEST(a_full_database_is_reported_and_changes_nothing)
{
    place p;
    char id[33], running[33], message[256];
    job_status was;
    static const char body[1u << 20];
    static const double x[131072];
    int64_t counts[5];
    job j = {0};
    bool repeated = false;
    int accepted = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", running), STORE_OK);
    CHECK_INT(sqlite_limit_bytes(p.s, 4 << 20), STORE_OK);
    store_status status = STORE_OK;
    while (status == STORE_OK && accepted < 10) {
        status =
            store_submit(p.s, &(store_request){.body = body, .body_len = sizeof body, .tags = "[]"}, &j, &repeated);
        if (status == STORE_OK)
            strcpy(id, j.id);
        accepted += status == STORE_OK;
        job_clear(&j);
    }
    CHECK_INT(status, STORE_FULL);
    CHECK_INT(accepted, 3);
    store_message(p.s, message, sizeof message);
    CHECK(strstr(message, "full"));
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_ACCEPTED], 3);
    /* A result that does not fit is reported as such, the job still runs, and space that is freed is used again. */
    store_vector v = {"reactions", 131072, x};
    store_outcome outcome = {
        .status = JOB_SUCCESSFUL, .whole.summary = "{}", .whole.vectors = &v, .whole.n_vectors = 1};
    CHECK_INT(finish_as(p.s, running, "a", &outcome), STORE_FULL);
    CHECK_INT(status_of(p.s, running), JOB_RUNNING);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(finish_as(p.s, running, "a", &outcome), STORE_OK);
    CHECK_INT(sqlite_limit_bytes(p.s, 0), STORE_OK);
    CHECK_INT(store_submit(p.s, &(store_request){.body = body, .body_len = sizeof body, .tags = "[]"}, &j, &repeated),
              STORE_OK);
    job_clear(&j);
    place_end(&p);
}

/* The write itself fails, as on a full disk: no file of the child may grow beyond the limit. */
TEST(a_failing_write_is_reported_as_full)
{
    place p;
    if (!place_begin(&p))
        return;
    store_close(p.s);
    p.s = NULL;
    pid_t child = fork();
    if (child == 0) {
        struct rlimit limit = {1u << 20, 1u << 20};
        char message[300], id[33];
        char *body = calloc(1, 4u << 20);
        job j = {0};
        bool repeated = false;
        signal(SIGXFSZ, SIG_IGN);
        setrlimit(RLIMIT_FSIZE, &limit);
        store *s = store_open(p.path, message, sizeof message);
        if (!s || submit_text(s, "{}", "[]", NULL, id) != STORE_OK)
            _exit(1);
        if (store_submit(s, &(store_request){.body = body, .body_len = 4u << 20, .tags = "[]"}, &j, &repeated) !=
            STORE_FULL)
            _exit(2);
        if (submit_text(s, "{}", "[]", NULL, id) != STORE_OK) /* it goes on with what fits */
            _exit(3);
        store_close(s);
        free(body);
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    CHECK(WIFEXITED(status));
    CHECK_INT(WEXITSTATUS(status), 0);
    if (place_open(&p)) {
        int64_t counts[5];
        CHECK_INT(store_counts(p.s, counts), STORE_OK);
        CHECK_INT(counts[JOB_ACCEPTED], 2);
    }
    place_end(&p);
}

/* Another program is in the middle of a change, as with the sqlite3 shell. */
TEST(a_file_that_another_program_holds)
{
    place p;
    char id[33];
    sqlite3 *other = NULL;
    if (!place_begin(&p))
        return;
    CHECK_INT(sqlite3_open(p.path, &other), SQLITE_OK);
    CHECK_INT(sqlite3_exec(other, "BEGIN IMMEDIATE", NULL, NULL, NULL), SQLITE_OK);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_LOCKED);
    CHECK_INT(sqlite3_exec(other, "ROLLBACK", NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(other);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    place_end(&p);
}

/* What says whether submissions are possible finds that they are not, and changes nothing. */
TEST(a_write_is_tried)
{
    place p;
    char id[33];
    int64_t counts[5];
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(store_try_write(p.s), STORE_OK);
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_ACCEPTED], 1);
    store_close(p.s);
    p.s = NULL;
    pid_t child = fork();
    if (child == 0) {
        struct rlimit none = {1, RLIM_INFINITY}, all = {RLIM_INFINITY, RLIM_INFINITY};
        char message[300];
        signal(SIGXFSZ, SIG_IGN);
        store *s = store_open(p.path, message, sizeof message);
        if (!s || setrlimit(RLIMIT_FSIZE, &none) != 0)
            _exit(1);
        if (store_try_write(s) != STORE_FULL || store_counts(s, counts) != STORE_OK || counts[JOB_ACCEPTED] != 1)
            _exit(2);
        if (setrlimit(RLIMIT_FSIZE, &all) != 0 || store_try_write(s) != STORE_OK)
            _exit(3);
        store_close(s);
        _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    CHECK(WIFEXITED(status));
    CHECK_INT(WEXITSTATUS(status), 0);
    CHECK(place_open(&p));
    place_end(&p);
}

/* ---- the journal stays small and only the writer's settings are in force */

TEST(journal_is_wal_and_is_cut)
{
    place p;
    char wal[128], id[33];
    struct stat st;
    size_t size = 40u << 20;
    char *body = calloc(1, size);
    job j = {0};
    bool repeated = false;
    if (place_begin(&p)) {
        snprintf(wal, sizeof wal, "%s-wal", p.path);
        CHECK_INT(store_submit(p.s, &(store_request){.body = body, .body_len = size, .tags = "[]"}, &j, &repeated),
                  STORE_OK);
        job_clear(&j);
        for (int i = 0; i < 3; i++)
            CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_INT(stat(wal, &st), 0);
        CHECK_MSG(st.st_size <= 17 << 20, "the journal has %lld bytes", (long long)st.st_size);
        store_close(p.s);
        p.s = NULL;
        CHECK(stat(wal, &st) != 0); /* moved into the database at the end */
        place_end(&p);
    }
    free(body);
}

/* ---- threads */

#define RACE_JOBS 200

typedef struct {
    store *s;
    const char *owner;
    char ids[RACE_JOBS][33];
    int count, problems;
} racer;

static void *race(void *arg)
{
    racer *r = arg;
    for (;;) {
        store_status status = claim_id(r->s, r->owner, r->ids[r->count]);
        if (status != STORE_OK) {
            r->problems += status != STORE_NOT_FOUND;
            return NULL;
        }
        job j = {0};
        r->problems += store_get(r->s, r->ids[r->count], &j) != STORE_OK || j.status != JOB_RUNNING;
        job_clear(&j);
        r->problems += renew_as(r->s, r->ids[r->count], r->owner, 30, 50) != STORE_OK;
        r->problems += finish_as(r->s, r->ids[r->count], r->owner, &PLAIN_SUCCESS) != STORE_OK;
        r->count++;
    }
}

static int compare_ids(const void *a, const void *b)
{
    return strcmp(a, b);
}

TEST(each_job_is_claimed_once)
{
    static const char *const OWNERS[] = {"a", "b", "c", "d"};
    static racer racers[4];
    static char all[RACE_JOBS][33];
    pthread_t threads[4];
    place p;
    int total = 0;
    if (!place_begin(&p))
        return;
    for (int i = 0; i < RACE_JOBS; i++)
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, all[i]), STORE_OK);
    for (int i = 0; i < 4; i++) {
        racers[i] = (racer){.s = p.s, .owner = OWNERS[i]};
        CHECK_INT(pthread_create(&threads[i], NULL, race, &racers[i]), 0);
    }
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], NULL);
        CHECK_INT(racers[i].problems, 0);
        for (int k = 0; k < racers[i].count && total < RACE_JOBS; k++)
            strcpy(all[total++], racers[i].ids[k]);
    }
    CHECK_INT(total, RACE_JOBS);
    qsort(all, RACE_JOBS, sizeof all[0], compare_ids);
    for (int i = 1; i < RACE_JOBS; i++)
        CHECK(strcmp(all[i - 1], all[i]) != 0);
    int64_t counts[5];
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_SUCCESSFUL], RACE_JOBS);
    place_end(&p);
}

typedef struct {
    store *s;
    int problems;
} repeater;

static void *repeat_key(void *arg)
{
    repeater *r = arg;
    char key[16], id[33];
    for (int i = 0; i < 25; i++) {
        snprintf(key, sizeof key, "key-%d", i);
        r->problems += submit_text(r->s, "{}", "[]", key, id) != STORE_OK;
    }
    return NULL;
}

TEST(concurrent_repeats_make_one_job_each)
{
    place p;
    pthread_t threads[6];
    repeater repeaters[6];
    int64_t counts[5];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 6; i++) {
        repeaters[i] = (repeater){p.s, 0};
        CHECK_INT(pthread_create(&threads[i], NULL, repeat_key, &repeaters[i]), 0);
    }
    for (int i = 0; i < 6; i++) {
        pthread_join(threads[i], NULL);
        CHECK_INT(repeaters[i].problems, 0);
    }
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_ACCEPTED], 25);
    place_end(&p);
}
