/* The store on a disk that fails: power loss, full disk and errors at every write, damaged files. SOAK=N in the
 * environment runs N times as many, as make soak does, a build with a sanitizer a fifth.
 * not under ThreadSanitizer: it is the disk that fails; many threads on one store are in test_store_queue */
#include "faulty_vfs.h"
#include "sanitized.h"
#include "sqlite_file.h"
#include "store/engine_base.h"
#include "store_place.h"

#include <stdatomic.h>
#include <sys/stat.h>

static long scaled(long runs)
{
    const char *soak = getenv("SOAK");
    return (soak ? runs * atol(soak) : runs) / (SANITIZED ? 5 : 1);
}

/* ---- what somebody was told */

enum { MAX_TOLD = 64 };
typedef struct {
    struct {
        char id[33];
        int size;       /* of its body, which is so many times the same letter */
        bool ended;     /* its end was read */
        bool uncertain; /* something is under way that may end it or delete it */
    } jobs[MAX_TOLD];
    int count;
} told;

static store_status submit_size(store *s, int size, char id[33])
{
    char *body = malloc((size_t)size);
    job j = {0};
    bool repeated;
    if (!body)
        return STORE_ERROR;
    memset(body, 'a' + size % 26, (size_t)size);
    store_status status = store_submit(
        s, &(store_request){.body = body, .body_len = (size_t)size, .tags = "[\"t\"]", .webhook = "http://x/"}, &j,
        &repeated);
    strcpy(id, j.id);
    job_clear(&j);
    free(body);
    return status;
}

static int find_told(const told *t, const char *id)
{
    int i = 0;
    while (i < t->count && strcmp(t->jobs[i].id, id) != 0)
        i++;
    return i;
}

/* Everything that was told is there, and what is there is whole. */
static void check_told(store *s, const char *path, const told *t, const char *what, long run)
{
    store_findings found;
    CHECK_INT(store_check(s, &found), STORE_OK);
    CHECK_MSG(found.findings[0] == '\0', "%s %ld: %s", what, run, found.findings);
    free(found.findings);
    /* What belongs to a submission is there with it. */
    CHECK_MSG(rows_in(path, "job WHERE NOT EXISTS (SELECT 1 FROM tag WHERE job = id)") == 0 &&
                  rows_in(path, "job WHERE NOT EXISTS (SELECT 1 FROM webhook WHERE job = id)") == 0 &&
                  rows_in(path, "job JOIN webhook ON job = id WHERE (status >= 2) <> (state > 0)") == 0,
              "%s %ld: tags or webhooks are lost", what, run);
    for (int i = 0; i < t->count; i++) {
        char *body = NULL;
        size_t len = 0;
        job j = {0};
        store_status status = store_get_body(s, t->jobs[i].id, &body, &len);
        if (t->jobs[i].uncertain && status == STORE_NOT_FOUND)
            continue;
        CHECK_MSG(status == STORE_OK && (int)len == t->jobs[i].size, "%s %ld: job %d is lost", what, run, i);
        for (size_t k = 0; body && k < len; k++)
            if (body[k] != 'a' + t->jobs[i].size % 26) {
                CHECK_MSG(false, "%s %ld: job %d is another one", what, run, i);
                break;
            }
        free(body);
        CHECK_INT(store_get(s, t->jobs[i].id, &j), STORE_OK);
        if (t->jobs[i].ended) {
            double *gaps = NULL;
            int64_t count = 0;
            CHECK_MSG(j.status == JOB_SUCCESSFUL && j.summary, "%s %ld: the end of job %d is lost", what, run, i);
            CHECK_INT(store_get_vector(s, j.id, 0, "gaps", &gaps, &count), STORE_OK);
            CHECK(count == 3 && gaps && gaps[2] == 2.5);
            free(gaps);
        }
        job_clear(&j);
    }
}

/* ---- steps of a life; each returns how it ended */

static store_status step_submit(store *s, told *t, int size)
{
    char id[33];
    store_status status = t->count < MAX_TOLD ? submit_size(s, size, id) : STORE_OK;
    if (status == STORE_OK && t->count < MAX_TOLD) {
        strcpy(t->jobs[t->count].id, id);
        t->jobs[t->count].size = size;
        t->jobs[t->count].ended = t->jobs[t->count].uncertain = false;
        t->count++;
    }
    return status;
}

/* As store_get, but by what a list tells of it; only its status and id. */
static store_status find_in_list(store *s, const char *id, job *out)
{
    job *jobs = NULL;
    size_t count = 0;
    bool more;
    store_status status = store_list(s, &(store_query){.limit = 1000}, &jobs, &count, &more);
    for (size_t i = 0; i < count; i++) {
        if (strcmp(jobs[i].id, id) == 0)
            out->status = jobs[i].status;
        job_clear(&jobs[i]);
    }
    free(jobs);
    return status;
}

static store_status step_run(store *s, told *t)
{
    static const double GAPS[] = {0.5, 1.5, 2.5};
    const store_vector gaps = {.name = "gaps", .count = 3, .data = GAPS};
    const store_outcome outcome = {
        .status = JOB_SUCCESSFUL,
        .whole = {.summary = "{\"outcome\": \"converged\"}", .vectors = &gaps, .n_vectors = 1}};
    char id[33];
    job j = {0};
    store_status status = claim_id(s, "me", id);
    if (status != STORE_OK)
        return status == STORE_NOT_FOUND ? STORE_OK : status;
    status = finish_as(s, id, "me", &outcome);
    if (status == STORE_OK)
        status = t->count % 2 ? store_get(s, id, &j) : find_in_list(s, id, &j);
    int i = find_told(t, id);
    if (status == STORE_OK && i < t->count)
        t->jobs[i].ended = j.status == JOB_SUCCESSFUL;
    job_clear(&j);
    return status == STORE_CONFLICT ? STORE_OK : status; /* a claim that a fault took back */
}

static store_status step_delete(store *s, told *t)
{
    job_status was;
    if (t->count == 0)
        return STORE_OK;
    t->jobs[0].uncertain = true;
    store_status status = store_dismiss(s, t->jobs[0].id, &was);
    if (status == STORE_OK) {
        t->count--;
        memmove(t->jobs, t->jobs + 1, (size_t)t->count * sizeof t->jobs[0]);
    }
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

/* ---- power loss */

static struct {
    char folder[64];
    uint64_t seed;
    const told *now; /* what was told so far */
    told before;     /* the same when the power went */
    bool cut;
} power;

static void cut_power(void)
{
    faulty_cut(power.folder, &power.seed);
    power.before = *power.now;
    power.cut = true;
}

static void remove_folder(const char *folder)
{
    static const char *const NAMES[] = {"jobs.db",         "jobs.db-wal",   "jobs.db-shm",
                                        "jobs.db-journal", "jobs.db-trail", "jobs.db-spare"};
    char path[128];
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, NAMES[i]);
        unlink(path);
    }
    rmdir(folder);
}

/* Power may be cut from now on, of a store in a folder of its own. */
static void power_begin(told *t, uint64_t seed)
{
    faulty_reset();
    strcpy(power.folder, "/tmp/test-power-XXXXXX");
    CHECK(mkdtemp(power.folder));
    power.seed = seed ^ 0x5555;
    power.now = t;
    power.cut = false;
    faulty.tracks = true;
    faulty.on_cut = cut_power;
}

/* One life with a power loss at some write or sync of it. Returns false once the life is shorter than that. */
static void lose_power(long run)
{
    place p = {.s = NULL};
    told t = {.count = 0};
    char path[96], message[400] = "";
    uint64_t seed = (uint64_t)run * 7919 + 1;
    power_begin(&t, seed);
    if (!place_begin(&p)) /* the cut may come while the file is made too */
        return;
    faulty.cut_at = faulty.events + 1 + (long)(faulty_random(&seed) % 400);
    if (run % 2) { /* a write or a sync fails before */
        faulty.fail_at = faulty.events + 1 + (long)(faulty_random(&seed) % 100);
        faulty.fail_code = SQLITE_IOERR_WRITE;
    }
    for (int step = 0; step < 400 && !power.cut && p.s; step++) {
        unsigned what = faulty_random(&seed) % 16;
        if (what < 7)
            step_submit(p.s, &t, 1 + (int)(faulty_random(&seed) % 30000));
        else if (what < 12)
            step_run(p.s, &t);
        else if (what < 15)
            step_delete(p.s, &t);
        else if (faulty.fired || !faulty.fail_at)
            place_reopen(&p); /* checkpoints and starts another log */
    }
    place_end(&p);
    faulty_reset();
    if (power.cut) {
        snprintf(path, sizeof path, "%s/jobs.db", power.folder);
        store *s = store_open(path, message, sizeof message);
        CHECK_MSG(s, "run %ld: %s", run, message);
        if (s)
            check_told(s, path, &power.before, "power loss", run);
        store_close(s);
    }
    remove_folder(power.folder);
}

TEST(power_loss_takes_nothing_that_was_acknowledged)
{
    long cuts = 0;
    faulty_install();
    for (long run = 0; run < scaled(100); run++) {
        lose_power(run);
        cuts += power.cut;
    }
    printf("# %ld power losses\n", cuts);
    CHECK(2 * cuts > scaled(100));
}

/* The same while a long log is moved into the file, which another connection than the writer's does. */
TEST(power_loss_takes_nothing_while_the_log_is_moved)
{
    enum { SIZE = 17 << 20, EVENTS = 5000 }; /* some 4300 pages, which are written once more, and synced */
    long cuts = 0;
    faulty_install();
    for (long run = 0; run < scaled(16); run++) {
        place p = {.s = NULL};
        told t = {.count = 0};
        char path[96], message[400] = "";
        uint64_t seed = (uint64_t)run * 104729 + 3;
        power_begin(&t, seed);
        CHECK(place_begin(&p));
        CHECK_INT(step_submit(p.s, &t, SIZE), STORE_OK);
        const bool within = run % 2; /* or soon after, where the log begins anew */
        if (within)
            faulty.cut_at = faulty.events + 1 + (long)(faulty_random(&seed) % EVENTS);
        if (run % 4 < 2) { /* a write or a sync fails */
            faulty.fail_at = faulty.events + 1 + (long)(faulty_random(&seed) % (run % 8 < 4 ? 2 : EVENTS));
            faulty.fail_code = SQLITE_IOERR_WRITE;
        }
        for (int i = 0; i < 3 && !power.cut; i++) {
            store_tidy(p.s);
            if (i == 0 && !within)
                faulty.cut_at = faulty.events + 1 + (long)(faulty_random(&seed) % 60);
            step_submit(p.s, &t, 300);
            step_run(p.s, &t);
        }
        place_end(&p);
        faulty_reset();
        snprintf(path, sizeof path, "%s/jobs.db", power.folder);
        store *s = power.cut ? store_open(path, message, sizeof message) : NULL;
        CHECK_MSG(s || !power.cut, "run %ld: %s", run, message);
        if (s)
            check_told(s, path, &power.before, "power loss in a move", run);
        store_close(s);
        cuts += power.cut;
        remove_folder(power.folder);
    }
    CHECK(2 * cuts > scaled(16));
}

static atomic_bool is_told, was_told_first;

static void note_told(void *ctx, const char *id, bool waits, const char *gone)
{
    (void)ctx, (void)id, (void)gone;
    atomic_store(&is_told, waits);
}

static void wait_for_told(void)
{
    for (int ms = 0; ms < 3000 && !atomic_load(&is_told); ms++)
        usleep(1000);
    atomic_store(&was_told_first, atomic_load(&is_told));
}

/* Workers hear of a job while its submission gets on disk; who submits it does not until it is there. */
TEST(workers_are_told_of_a_job_that_gets_on_disk)
{
    place p = {.s = NULL};
    told t = {.count = 0};
    faulty_install();
    CHECK(place_begin(&p));
    store_listen(p.s, note_told, NULL);
    faulty.on_sync = wait_for_told;
    CHECK_INT(step_submit(p.s, &t, 300), STORE_OK);
    CHECK(atomic_load(&was_told_first));
    faulty.on_sync = NULL;
    store_listen(p.s, NULL, NULL);
    place_end(&p);
    faulty_reset();
}

/* The test itself: a store that acknowledges before the sync would be found out. */
TEST(the_simulated_disk_forgets_what_is_not_synced)
{
    char folder[] = "/tmp/test-power-XXXXXX", path[96];
    sqlite3 *db = NULL;
    faulty_install();
    faulty_reset();
    CHECK(mkdtemp(folder));
    strcpy(power.folder, "/tmp/test-power-XXXXXX");
    CHECK(mkdtemp(power.folder));
    power.seed = 9; /* draws a chance of 0 below */
    while (power.seed = power.seed * 31 + 7,
           ((power.seed * 6364136223846793005u + 1442695040888963407u) >> 33) % 9 != 0)
        ;
    faulty.tracks = true;
    snprintf(path, sizeof path, "%s/jobs.db", folder);
    CHECK_INT(sqlite3_open(path, &db), SQLITE_OK);
    CHECK_INT(sqlite3_exec(db,
                           "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; CREATE TABLE a(x);"
                           "PRAGMA wal_checkpoint(TRUNCATE); INSERT INTO a VALUES(1)",
                           NULL, NULL, NULL),
              SQLITE_OK);
    pthread_mutex_lock(&faulty.lock);
    faulty_cut(power.folder, &power.seed);
    pthread_mutex_unlock(&faulty.lock);
    sqlite3_close(db);
    faulty_reset();
    CHECK_INT(rows_in(path, "a"), 1);
    remove_folder(folder);
    snprintf(path, sizeof path, "%s/jobs.db", power.folder);
    CHECK_INT(rows_in(path, "a"), 0);
    remove_folder(power.folder);
}

/* ---- a disk that is full or fails from the n-th write on */

/* One life; *bad counts the calls that said STORE_FULL or STORE_ERROR. */
static void live_with_fault(place *p, told *t, int *bad)
{
    char message[400] = "";
    job *jobs = NULL;
    size_t count = 0;
    bool more;
    p->s = store_open(p->path, message, sizeof message);
    if (!p->s) {
        CHECK(message[0]);
        (*bad)++;
        return;
    }
    store_status all[] = {step_submit(p->s, t, 20000), step_submit(p->s, t, 300), step_run(p->s, t),
                          step_submit(p->s, t, 5000),  step_run(p->s, t),         step_delete(p->s, t)};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        CHECK_MSG(all[i] == STORE_OK || all[i] == STORE_FULL || all[i] == STORE_ERROR, "step %zu: %d", i, all[i]);
        *bad += all[i] != STORE_OK;
    }
    store_status listed = store_list(p->s, &(store_query){.limit = 10}, &jobs, &count, &more);
    CHECK(listed == STORE_OK || listed == STORE_ERROR); /* an end that can't be synced is not told */
    *bad += listed != STORE_OK;
    for (size_t i = 0; i < count; i++)
        job_clear(&jobs[i]);
    free(jobs);
    store_close(p->s);
    p->s = NULL;
}

static bool fail_once(long n, int code, bool for_ever)
{
    place p = {.s = NULL};
    told t = {.count = 0};
    int bad = 0;
    faulty_reset();
    strcpy(p.folder, "/tmp/test-store-XXXXXX");
    CHECK(mkdtemp(p.folder));
    snprintf(p.path, sizeof p.path, "%s/jobs.db", p.folder);
    faulty.fail_at = n;
    faulty.fail_code = code;
    faulty.fail_for_ever = for_ever;
    live_with_fault(&p, &t, &bad);
    bool fired = faulty.fired;
    faulty_reset();
    CHECK_MSG(fired || bad == 0, "event %ld: %d calls failed without a fault", n, bad);
    if (place_open(&p)) { /* the fault is over */
        check_told(p.s, p.path, &t, "fault at write", n);
        CHECK_INT(step_submit(p.s, &t, 100), STORE_OK);
    }
    place_end(&p);
    return fired;
}

TEST(a_fault_at_any_write_loses_nothing_that_was_acknowledged)
{
    static const int CODES[] = {SQLITE_FULL, SQLITE_IOERR_WRITE};
    faulty_install();
    for (size_t i = 0; i < sizeof CODES / sizeof CODES[0]; i++)
        for (int for_ever = 0; for_ever < 2; for_ever++) {
            /* the four together meet every n, with a sanitizer every fifth */
            long step = getenv("SOAK") ? 1 : SANITIZED ? 20 : 4, n = 1 + 2 * (long)i + for_ever;
            n = step == 1 ? 1 : n;
            while (fail_once(n, CODES[i], for_ever != 0))
                n += step;
            CHECK_MSG(n > 30, "only %ld writes", n);
        }
}

/* ---- damaged files */

static void write_content(const char *path, const unsigned char *data, int64_t size)
{
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(data, 1, (size_t)size, file) == (size_t)size && fclose(file) == 0);
}

static void damage(unsigned char *data, int64_t *size, uint64_t *seed)
{
    unsigned what = faulty_random(seed) % 8;
    if (what == 0) {
        *size = faulty_random(seed) % *size;
    } else if (what == 1) { /* a page of zeros */
        int64_t page = faulty_random(seed) % (*size / 4096);
        memset(data + 4096 * page, 0, 4096);
    } else if (what == 2) { /* two pages change places */
        int64_t a = faulty_random(seed) % (*size / 4096), b = faulty_random(seed) % (*size / 4096);
        unsigned char page[4096];
        memcpy(page, data + 4096 * a, 4096);
        memmove(data + 4096 * a, data + 4096 * b, 4096);
        memcpy(data + 4096 * b, page, 4096);
    } else {
        for (unsigned n = 1 + faulty_random(seed) % 20; n > 0; n--) {
            /* half of them where a page says what it is */
            int64_t at = faulty_random(seed) % *size;
            if (faulty_random(seed) % 2)
                at = at / 4096 * 4096 + at % 64;
            data[at] ^= (unsigned char)(1u << faulty_random(seed) % 8);
        }
    }
}

/* Everything that a service does; nothing may crash, hang, or say what a reader could not use. */
static void use(store *s)
{
    char id[33];
    job *jobs = NULL;
    size_t count = 0;
    bool more;
    int64_t counts[STORE_COUNTS];
    store_findings found = {0};
    told t = {.count = 0};
    store_counts(s, counts);
    store_recover(s, 3, "{}", NULL, NULL);
    if (store_list(s, &(store_query){.limit = 100}, &jobs, &count, &more) == STORE_OK)
        for (size_t i = 0; i < count; i++) {
            char *body = NULL;
            double *x = NULL;
            size_t len;
            int64_t n, columns;
            CHECK(strlen(jobs[i].id) <= 32 && jobs[i].tags && jobs[i].status <= JOB_DISMISSED);
            CHECK(!jobs[i].summary || strcmp(jobs[i].summary, "{\"outcome\": \"converged\"}") == 0);
            if (store_get_body(s, jobs[i].id, &body, &len) == STORE_OK)
                CHECK(body && strlen(body) <= len);
            free(body);
            if (store_get_vector(s, jobs[i].id, 0, "gaps", &x, &n) == STORE_OK)
                CHECK(n == 3 && x && x[0] == 0.5 && x[1] == 1.5 && x[2] == 2.5); /* by its checksum */
            free(x);
            x = NULL;
            store_get_history(s, jobs[i].id, 0, -1, &x, &n, &columns);
            free(x);
            job_clear(&jobs[i]);
        }
    free(jobs);
    step_submit(s, &t, 3000);
    for (int i = 0; i < 3; i++)
        claim_id(s, "me", id);
    step_delete(s, &t);
    if (store_check(s, &found) == STORE_OK)
        free(found.findings);
}

TEST(a_damaged_file_is_refused_or_read)
{
    place p;
    told t = {.count = 0};
    int64_t size;
    long opened = 0, runs = scaled(100);
    char message[400];
    faulty_install();
    faulty_reset(); /* and no sync waits for a disk */
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 12; i++) {
        step_submit(p.s, &t, 200 + 900 * i);
        if (i % 2)
            step_run(p.s, &t);
    }
    store_close(p.s);
    unsigned char *whole = faulty_content(p.path, &size), *data = malloc((size_t)size);
    for (long run = 0; run < runs && whole && data; run++) {
        uint64_t seed = (uint64_t)run * 104729 + 3;
        int64_t n = size;
        memcpy(data, whole, (size_t)size);
        damage(data, &n, &seed);
        write_content(p.path, data, n);
        message[0] = '\0';
        p.s = store_open(p.path, message, sizeof message);
        CHECK(p.s || message[0]);
        opened += p.s != NULL;
        if (p.s)
            use(p.s);
        else if (n > 0) { /* what is refused stays as it was, for whoever can save it */
            int64_t now;
            unsigned char *left = faulty_content(p.path, &now);
            CHECK_MSG(now == n && left && memcmp(left, data, (size_t)n) == 0, "run %ld: a refused file was changed",
                      run);
            free(left);
        }
        store_close(p.s);
        char log[128];
        snprintf(log, sizeof log, "%s-wal", p.path);
        unlink(log);
        snprintf(log, sizeof log, "%s-shm", p.path);
        unlink(log);
    }
    printf("# %ld damaged files, %ld opened\n", runs, opened);
    CHECK(opened < runs);
    free(data);
    free(whole);
    p.s = NULL;
    place_end(&p);
}
