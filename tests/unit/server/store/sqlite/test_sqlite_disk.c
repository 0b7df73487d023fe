/* The database file and its disk: kills, foreign files, a second daemon, a full disk, other programs. */
#include "sqlite_file.h"
#include "store/engine_base.h"
#include "store_place.h"

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

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
    int64_t counts[STORE_COUNTS];
    job j = {0};
    bool repeated = false;
    int accepted = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", running), STORE_OK);
    limit_bytes(p.s, 4 << 20);
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
    limit_bytes(p.s, 0);
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
        int64_t counts[STORE_COUNTS];
        CHECK_INT(store_counts(p.s, counts), STORE_OK);
        CHECK_INT(counts[JOB_ACCEPTED], 2);
    }
    place_end(&p);
}

/* ---- a disk of its own that another file fills up */

static int delete_on_a_full_disk(const char *folder)
{
    char path[128], filler[128], message[300] = "", ids[40][33];
    static const char body[100000];
    job_status was;
    job j = {0};
    bool repeated;
    int n = 0;
    snprintf(path, sizeof path, "%s/jobs.db", folder);
    snprintf(filler, sizeof filler, "%s/filler", folder);
    if (mount("none", folder, "tmpfs", 0, "size=16m") != 0)
        return 100;
    store *s = store_open(path, message, sizeof message);
    while (s && n < 20 &&
           store_submit(s, &(store_request){.body = body, .body_len = sizeof body}, &j, &repeated) == STORE_OK) {
        strcpy(ids[n++], j.id);
        job_clear(&j);
    }
    if (n < 20)
        return 1;
    const int fd = open(filler, O_WRONLY | O_CREAT, 0600);
    for (size_t size = sizeof body; size > 0;)
        if (write(fd, body, size) <= 0)
            size /= 2;
    if (store_submit(s, &(store_request){.body = body, .body_len = sizeof body}, &j, &repeated) != STORE_FULL)
        return 2;
    for (int i = 0; i < 2 * n; i++) { /* dismissed, then deleted; nobody makes room in between */
        while (write(fd, body, 4096) > 0)
            ;
        if (store_dismiss(s, ids[i % n], &was) != STORE_OK)
            return 10 + i;
    }
    int64_t counts[STORE_COUNTS];
    if (store_counts(s, counts) != STORE_OK || counts[JOB_ACCEPTED] + counts[JOB_DISMISSED] != 0)
        return 3;
    store_close(s);
    close(fd);
    return 0;
}

TEST(a_full_disk_refuses_no_deletion)
{
    char folder[] = "/tmp/test-full-XXXXXX";
    CHECK(mkdtemp(folder));
    pid_t child = fork();
    if (child == 0)
        _exit(unshare(CLONE_NEWNS) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0
                  ? (mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL), delete_on_a_full_disk(folder))
                  : 100);
    int status = -1;
    waitpid(child, &status, 0);
    rmdir(folder);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 100) {
        test_skip("no file system can be mounted here");
        return;
    }
    CHECK(WIFEXITED(status));
    CHECK_INT(WEXITSTATUS(status), 0);
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
    int64_t counts[STORE_COUNTS];
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

/* ---- who waits for the journal to be moved into the file */

TEST(journal_is_moved_while_nobody_waits)
{
    enum { SIZE = 20 << 20 }; /* of a body, some 5000 pages: long, but not too long */
    place p;
    char id[33];
    struct stat st;
    char *body = calloc(1, SIZE);
    job j = {0};
    bool repeated = false;
    CHECK(body);
    if (body && place_begin(&p)) {
        CHECK_INT(store_submit(p.s, &(store_request){.body = body, .body_len = SIZE, .tags = "[]"}, &j, &repeated),
                  STORE_OK);
        for (int i = 0; i < 3; i++)
            CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_INT(stat(p.path, &st), 0);
        CHECK_MSG(st.st_size < SIZE / 2, "a change has moved %lld bytes", (long long)st.st_size);
        CHECK_INT(store_tidy(p.s), STORE_OK);
        CHECK_INT(stat(p.path, &st), 0);
        CHECK_MSG(st.st_size > SIZE, "the file has %lld bytes", (long long)st.st_size);
        job_clear(&j);
        place_end(&p);
    }
    free(body);
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
