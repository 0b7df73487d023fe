/* Workers with real problems: how a job ends, cancelling, stopping, taking up what was left. */
#include "codec/codec.h"
#include "sqlite_file.h"
#include "store_place.h"
#include "work/work.h"

#include <dirent.h>
#include <pthread.h>
#include <signal.h>
#include <time.h>

/* u = (1, 1/2), r = (-1, 0), g = (0, 1/2). */
#define MATRICES                                                                                                       \
    "{\"problem\": {\"kind\": \"matrices\","                                                                           \
    " \"K\": \"%%MatrixMarket matrix coordinate real symmetric\\n2 2 2\\n1 1 2\\n2 2 2\\n\","                          \
    " \"N\": \"%%MatrixMarket matrix coordinate real general\\n2 2 2\\n1 1 1\\n2 2 1\\n\","                            \
    " \"h\": [1, 1], \"p\": [3, 1]}"

static const char *const SMALL = MATRICES "}";
/* So small a step that it does not end by itself. */
static const char *const ENDLESS = MATRICES ", \"solver\": {\"method\": \"uzawa\", \"stopping\": \"paper\","
                                            " \"epsilon\": 1e-300, \"alpha\": 1e-9, \"max_iterations\": 1000000000}}";
static const char *const NOT_SPD =
    "{\"problem\": {\"kind\": \"matrices\","
    " \"K\": \"%%MatrixMarket matrix coordinate real symmetric\\n2 2 3\\n1 1 1\\n2 1 2\\n2 2 1\\n\","
    " \"N\": \"%%MatrixMarket matrix coordinate real general\\n1 2 1\\n1 1 1\\n\", \"h\": [1], \"p\": [3, 1]}}";
#define SCENE_OF(cells)                                                                                                \
    "{\"problem\": {\"kind\": \"scene\", \"model\": \"plane_stress\", \"thickness\": 5,"                               \
    " \"mesh\": {\"box\": {\"size\": [60, 20], \"cells\": [" cells "], \"element\": \"quad4\"}},"                      \
    " \"materials\": [{\"on\": \"all\", \"young\": 200e3, \"poisson\": 0.3}],"                                         \
    " \"supports\": [{\"on\": \"left\", \"ux\": 0, \"uy\": 0}],"                                                       \
    " \"loads\": [{\"on\": \"top\", \"traction\": [0, -0.05]}, {\"on\": \"right\", \"traction\": [0.5, 0]}],"          \
    " \"contacts\": [{\"on\": \"bottom\", \"obstacle\": {\"plane\": {\"point\": [0, 0], \"normal\": [0, 1]}}}]}}"
static const char *const SCENE = SCENE_OF("30, 10"), *const LARGE = SCENE_OF("120, 40");

/* ---- a store with workers */

typedef struct {
    place place;
    FILE *log_file;
    server_log log;
    work *w;
} service;

static const work_options TWO_WORKERS = {.workers = 2, .max_attempts = 3, .cache_bytes = 1 << 24, .lease_s = 30.0};

/* The daemon, which stands in the folder above this program's. */
static const char *daemon_program(char path[4096])
{
    const ssize_t len = readlink("/proc/self/exe", path, 4000);
    path[len > 0 ? len : 0] = '\0';
    for (int i = 0; i < 2 && strrchr(path, '/'); i++)
        *strrchr(path, '/') = '\0';
    return strcat(path, "/uzawad");
}

static bool service_start(service *v, const work_options *options)
{
    char message[400] = "";
    static char path[4096]; /* as long as the workers */
    work_options with = *options;
    with.program = daemon_program(path);
    v->w = work_start(v->place.s, &with, &v->log, message, sizeof message);
    CHECK_MSG(v->w, "%s", message);
    return v->w != NULL;
}

/* The store and the log, without workers yet. */
static bool service_begin(service *v)
{
    static bool ready;
    char message[400] = "";
    memset(v, 0, sizeof *v);
    if (!ready) {
        uz_process_init(2);
        ready = codec_init(NULL, message, sizeof message);
        CHECK_MSG(ready, "%s", message);
    }
    v->log_file = tmpfile();
    v->log = (server_log){.lock = PTHREAD_MUTEX_INITIALIZER, .stream = v->log_file, .least = LOG_DEBUG};
    return ready && place_begin(&v->place);
}

static void service_end(service *v)
{
    work_free(v->w);
    place_end(&v->place);
    fclose(v->log_file);
}

static int count_in_log(service *v, const char *event)
{
    char line[4096];
    int count = 0;
    rewind(v->log_file);
    while (fgets(line, sizeof line, v->log_file))
        count += strstr(line, event) != NULL;
    fseek(v->log_file, 0, SEEK_END);
    return count;
}

static void submit(service *v, const char *body, char id[33])
{
    CHECK_INT(submit_text(v->place.s, body, "[]", NULL, id), STORE_OK);
}

static void check_part(const char *text, const char *part)
{
    CHECK_MSG(text && strstr(text, part), "\"%s\" is not in %s", part, text ? text : "NULL");
}

static void short_sleep(void)
{
    nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
}

/* Until the job iterates. */
static void wait_for_rows(service *v, const char *id)
{
    for (int i = 0; i < 4000; i++) {
        work_history live;
        bool lives = work_live(v->w, id, NULL, NULL, -1, &live);
        free(live.rows);
        if (lives && live.count > 2)
            return;
        short_sleep();
    }
    CHECK_MSG(false, "the job does not iterate");
}

/* ---- how jobs end */

TEST(solves_matrices)
{
    service v;
    char id[33];
    job j;
    double *x = NULL;
    int64_t count = 0, columns = 0;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, SMALL, id);
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    /* The end is stored a moment before its worker lets go of the job. */
    for (int i = 0; i < 4000 && work_live(v.w, id, NULL, NULL, -1, NULL); i++)
        short_sleep();
    CHECK(!work_live(v.w, id, NULL, NULL, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "successful");
    CHECK(j.progress == 100 && j.attempts == 1 && !j.error);
    check_part(j.summary, "\"converged\"");
    check_part(j.summary, "\"parse\"");
    job_clear(&j);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "reactions", &x, &count), STORE_OK);
    CHECK_INT(count, 2);
    if (count == 2)
        CHECK(fabs(x[0] + 1.0) < 1e-7 && fabs(x[1]) < 1e-7);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "displacements", &x, &count), STORE_OK);
    CHECK_INT(count, 2);
    if (count == 2)
        CHECK(fabs(x[0] - 1.0) < 1e-7 && fabs(x[1] - 0.5) < 1e-7);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "dim", &x, &count), STORE_OK);
    CHECK(count == 1 && x[0] == 0.0);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "nodes", &x, &count), STORE_NOT_FOUND);
    CHECK_INT(store_get_history(v.place.s, id, 0, -1, &x, &count, &columns), STORE_OK);
    CHECK(count >= 1 && columns == CODEC_HISTORY_COLUMNS && x[0] == 0.0);
    free(x);
    service_end(&v);
}

TEST(solves_a_scene_and_keeps_its_nodes)
{
    service v;
    char id[33];
    double *x = NULL, sum = 0.0;
    int64_t count = 0;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, SCENE, id);
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(status_of(v.place.s, id), JOB_SUCCESSFUL);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "dim", &x, &count), STORE_OK);
    CHECK(count == 1 && x[0] == 2.0);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "nodes", &x, &count), STORE_OK);
    CHECK_INT(count, 31 * 11 * 2);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "displacements", &x, &count), STORE_OK);
    CHECK_INT(count, 31 * 11 * 2);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "contact_nodes", &x, &count), STORE_OK);
    CHECK_INT(count, 30);
    free(x);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "reactions", &x, &count), STORE_OK);
    CHECK_INT(count, 30);
    for (int64_t i = 0; i < count; i++)
        sum += x[i];
    CHECK_REL(sum, -10.51371700, 1e-6);
    free(x);
    service_end(&v);
}

TEST(what_cannot_be_solved_fails_with_its_reason)
{
    service v;
    char id[33];
    job j;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, NOT_SPD, id);
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "failed");
    CHECK(!j.summary);
    check_part(j.error, "not_positive_definite");
    job_clear(&j);
    submit(&v, "{\"problem\": ", id); /* as an older program may have left it */
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "failed");
    check_part(j.error, "json_syntax");
    job_clear(&j);
    service_end(&v);
}

TEST(every_job_of_many_ends)
{
    enum { JOBS = 60 };
    service v;
    char id[JOBS][33];
    work_options four = TWO_WORKERS;
    int64_t counts[STORE_COUNTS];
    four.workers = 4;
    if (!service_begin(&v) || !service_start(&v, &four))
        return;
    for (int i = 0; i < JOBS; i++)
        submit(&v, SMALL, id[i]);
    for (int i = 0; i < JOBS; i++)
        CHECK(work_wait(v.w, id[i], 30.0, -1, NULL));
    CHECK_INT(work_settings(v.w)->workers, 4);
    CHECK_INT(work_settings(v.w)->cache_bytes, 1 << 24);
    CHECK_INT(store_counts(v.place.s, counts), STORE_OK);
    CHECK_INT(counts[JOB_SUCCESSFUL], JOBS);
    service_end(&v);
}

/* ---- cancelling */

TEST(a_running_job_shows_its_rows_and_can_be_cancelled)
{
    service v;
    char id[33];
    job j;
    double *rows = NULL;
    int64_t count = 0, columns = 0;
    int progress = -1;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, ENDLESS, id);
    wait_for_rows(&v, id);
    work_history live;
    CHECK(work_live(v.w, id, &progress, NULL, 1, &live));
    CHECK(progress >= 10 && progress <= 95 && live.count >= 1 && live.rows && live.rows[0] > 1.0);
    free(live.rows);
    CHECK(!work_wait(v.w, id, 0.05, -1, NULL)); /* it runs */
    CHECK(work_cancel(v.w, id));
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "dismissed");
    check_part(j.summary, "\"dismissed\"");
    check_part(j.summary, "\"certificate\""); /* the best answer so far */
    job_clear(&j);
    CHECK_INT(store_get_vector(v.place.s, id, 0, "reactions", &rows, &count), STORE_OK);
    free(rows);
    CHECK_INT(store_get_history(v.place.s, id, 0, -1, &rows, &count, &columns), STORE_OK);
    free(rows);
    CHECK(!work_cancel(v.w, id));
    CHECK(!work_cancel(v.w, ""));
    service_end(&v);
}

typedef struct {
    work *w;
    const char *id;
    bool ended;
} waiting;

static void *wait_in_thread(void *arg)
{
    waiting *a = arg;
    a->ended = work_wait(a->w, a->id, 30.0, -1, NULL);
    return NULL;
}

TEST(those_who_wait_learn_of_dismissal_and_of_the_end)
{
    service v;
    char running[33], queued[33];
    pthread_t threads[2];
    job_status was;
    work_options one = TWO_WORKERS;
    one.workers = 1;
    if (!service_begin(&v) || !service_start(&v, &one))
        return;
    submit(&v, ENDLESS, running);
    wait_for_rows(&v, running);
    submit(&v, SMALL, queued);
    waiting a[2] = {{v.w, running, true}, {v.w, queued, false}};
    for (int i = 0; i < 2; i++)
        CHECK_INT(pthread_create(&threads[i], NULL, wait_in_thread, &a[i]), 0);
    short_sleep();
    CHECK_INT(store_dismiss(v.place.s, queued, &was), STORE_OK);
    CHECK_INT(was, JOB_ACCEPTED);
    CHECK(!work_cancel(v.w, queued));
    pthread_join(threads[1], NULL);
    CHECK(a[1].ended);
    work_stop(v.w, 0.0);
    pthread_join(threads[0], NULL);
    CHECK(!a[0].ended);                                                       /* it will run again */
    CHECK(work_wait(v.w, "00000000000000000000000000000000", 0.0, -1, NULL)); /* there is none */
    service_end(&v);
}

/* ---- stopping and starting again */

TEST(stopping_releases_what_runs)
{
    service v;
    char id[33];
    job j;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, ENDLESS, id);
    wait_for_rows(&v, id);
    work_stop(v.w, 0.05);
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_ACCEPTED && j.attempts == 0 && !j.summary);
    job_clear(&j);
    CHECK(!work_wait(v.w, id, 10.0, -1, NULL)); /* at once: the service has stopped */
    submit(&v, SMALL, id);
    CHECK_INT(status_of(v.place.s, id), JOB_ACCEPTED); /* no more claims */
    work_stop(v.w, 0.0);                               /* again is fine */
    service_end(&v);
}

TEST(draining_lets_jobs_end)
{
    service v;
    char id[33];
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, SCENE, id);
    for (int i = 0; i < 1000 && status_of(v.place.s, id) == JOB_ACCEPTED; i++)
        short_sleep();
    work_stop(v.w, 20.0);
    CHECK_INT(status_of(v.place.s, id), JOB_SUCCESSFUL);
    service_end(&v);
}

static void *stop_now(void *arg)
{
    work_stop(arg, 0.0);
    return NULL;
}

TEST(a_second_stop_shortens_the_first)
{
    service v;
    char id[33];
    pthread_t thread;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    submit(&v, ENDLESS, id);
    wait_for_rows(&v, id);
    time_t start = time(NULL);
    CHECK_INT(pthread_create(&thread, NULL, stop_now, v.w), 0);
    work_stop(v.w, 60.0);
    pthread_join(thread, NULL);
    CHECK(time(NULL) - start < 30);
    CHECK_INT(status_of(v.place.s, id), JOB_ACCEPTED);
    service_end(&v);
}

TEST(jobs_left_running_are_taken_up)
{
    service v;
    char left[33], spent[33], other[33];
    job j;
    if (!service_begin(&v))
        return;
    submit(&v, SMALL, spent);
    for (int i = 0; i < 29; i++) { /* ten times as often as a process that solves may die */
        CHECK_INT(claim_id(v.place.s, "gone", other), STORE_OK);
        CHECK_INT(store_recover(v.place.s, 99, "{}", NULL, NULL), STORE_OK);
    }
    CHECK_INT(claim_id(v.place.s, "gone", other), STORE_OK);
    submit(&v, SMALL, left);
    CHECK_INT(claim_id(v.place.s, "gone", other), STORE_OK);
    if (!service_start(&v, &TWO_WORKERS))
        return;
    CHECK(work_wait(v.w, left, 20.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, left, &j), STORE_OK);
    CHECK(j.status == JOB_SUCCESSFUL && j.attempts == 2);
    job_clear(&j);
    CHECK_INT(store_get(v.place.s, spent, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "failed");
    check_part(j.error, "attempts_exhausted");
    job_clear(&j);
    service_end(&v);
}

TEST(a_result_that_cannot_be_stored_is_reported_and_run_again)
{
    service v;
    char id[33];
    job j;
    if (!service_begin(&v))
        return;
    submit(&v, SCENE, id);
    limit_bytes(v.place.s, 1); /* the file may not grow: the result has no room */
    if (!service_start(&v, &TWO_WORKERS))
        return;
    for (int i = 0; i < 1000 && count_in_log(&v, "store_failed") == 0; i++)
        short_sleep();
    work_stop(v.w, 0.0);
    CHECK_INT(count_in_log(&v, "result_lost"), 1);
    CHECK_INT(status_of(v.place.s, id), JOB_RUNNING);
    work_free(v.w);
    limit_bytes(v.place.s, 0);
    if (!service_start(&v, &TWO_WORKERS))
        return;
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_SUCCESSFUL && j.attempts == 2);
    job_clear(&j);
    service_end(&v);
}

/* A result for which there never is room: its job ends all the same, and says why. */
TEST(a_result_without_room_is_given_up)
{
    static char body[64 << 10];
    service v;
    char id[33], padding[33];
    job j;
    job_status was;
    work_options options = TWO_WORKERS;
    if (!service_begin(&v))
        return;
    memset(body, ' ', sizeof body - 1);
    memcpy(body, "{}", 2);
    submit(&v, body, padding); /* leaves pages that are free, for what is small */
    CHECK(store_dismiss(v.place.s, padding, &was) == STORE_OK && store_dismiss(v.place.s, padding, &was) == STORE_OK);
    submit(&v, LARGE, id);
    limit_bytes(v.place.s, 1);
    options.room_wait_s = 0.1;
    if (!service_start(&v, &options))
        return;
    CHECK(work_wait(v.w, id, 60.0, -1, NULL));
    CHECK_INT(store_get(v.place.s, id, &j), STORE_OK);
    CHECK_STR(job_status_name(j.status), "failed");
    check_part(j.error, "\"storage_full\"");
    CHECK(!j.summary);
    job_clear(&j);
    CHECK_INT(count_in_log(&v, "result_given_up"), 1);
    limit_bytes(v.place.s, 0);
    submit(&v, SMALL, id);
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(status_of(v.place.s, id), JOB_SUCCESSFUL);
    service_end(&v);
}

/* As with a store that other processes use too, and whose connection was lost for a while. */
TEST(what_may_have_been_missed_is_looked_for)
{
    service v;
    char id[33];
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    for (int i = 0; i < 20; i++) /* both workers have looked and wait by now */
        short_sleep();
    store_listener *told = v.place.s->listener;
    void *ctx = v.place.s->listener_ctx;
    store_listen(v.place.s, NULL, NULL);
    submit(&v, SMALL, id);
    store_listen(v.place.s, told, ctx);
    store_tell(v.place.s, NULL, false, NULL);
    CHECK(work_wait(v.w, id, 20.0, -1, NULL));
    CHECK_INT(status_of(v.place.s, id), JOB_SUCCESSFUL);
    service_end(&v);
}

TEST(a_job_that_another_owner_took_is_dropped)
{
    service v;
    char id[33];
    work_options hasty = TWO_WORKERS;
    hasty.lease_s = 0.15;
    if (!service_begin(&v) || !service_start(&v, &hasty))
        return;
    submit(&v, ENDLESS, id);
    wait_for_rows(&v, id);
    change_file(v.place.path, "UPDATE job SET owner = 'another'");
    for (int i = 0; i < 2000 && work_live(v.w, id, NULL, NULL, -1, NULL); i++)
        short_sleep();
    CHECK(!work_live(v.w, id, NULL, NULL, -1, NULL));
    CHECK_INT(status_of(v.place.s, id), JOB_RUNNING); /* the other's */
    service_end(&v);
}

/* ---- threads of this process */

/* The signals that a thread blocks, as the kernel tells. */
static unsigned long long blocked_signals(const char *task)
{
    char path[300], line[256];
    unsigned long long set = 0;
    snprintf(path, sizeof path, "/proc/self/task/%s/status", task);
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file))
        if (strncmp(line, "SigBlk:", 7) == 0)
            set = strtoull(line + 7, NULL, 16);
    if (file)
        fclose(file);
    return set;
}

TEST(workers_take_no_signals)
{
    service v;
    int blocking = 0;
    if (!service_begin(&v) || !service_start(&v, &TWO_WORKERS))
        return;
    DIR *dir = opendir("/proc/self/task");
    for (struct dirent *entry; dir && (entry = readdir(dir));) {
        unsigned long long want = 1ull << (SIGTERM - 1) | 1ull << (SIGABRT - 1) | 1ull << (SIGINT - 1);
        if (entry->d_name[0] != '.')
            blocking += (blocked_signals(entry->d_name) & want) == want;
    }
    if (dir)
        closedir(dir);
    else
        test_skip("no /proc");
    CHECK(!dir || blocking >= 3); /* two workers and the keeper */
    service_end(&v);
}
