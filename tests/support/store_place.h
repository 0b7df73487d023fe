/* store_place.h: for tests, a store in a temporary folder of its own.
 *
 * STORE_TEST(name) { ... } is a TEST that runs once for every engine of the store (engines/engines.h): what it shows is
 * the contract that they all keep. Its places have the engine that it runs for; those of a plain TEST have the engine
 * of files. An engine whose stores are no files of a folder gets its addresses in place_begin. */
#ifndef TESTS_STORE_PLACE_H
#define TESTS_STORE_PLACE_H

#include "harness.h"
#include "postgresql_place.h"
#include "store/engines/engines.h"

#include <unistd.h>

/* ---- a store in a folder of its own */

typedef struct {
    char folder[64], path[96], address[192];
    char database[32]; /* of an engine of databases, else "" */
    store *s;
} place;

static const store_engine *place_engine; /* NULL: the engine of files */

static inline void run_on_each_engine(void (*run)(void))
{
    for (size_t i = 0; STORE_ENGINES[i]; i++) {
        static bool told;
        place_engine = STORE_ENGINES[i];
        if (place_engine->scheme[0] && !postgresql_there()) {
            if (!told)
                printf("skip %s: no server of PostgreSQL (Debian: postgresql)\n", place_engine->scheme);
            told = true;
            continue;
        }
        if (place_engine->scheme[0])
            printf("# with %s\n", place_engine->scheme);
        run();
    }
    place_engine = NULL;
}

#define STORE_TEST(id)                                                                                                 \
    static void on_engine_##id(void);                                                                                  \
    TEST(id)                                                                                                           \
    {                                                                                                                  \
        run_on_each_engine(on_engine_##id);                                                                            \
    }                                                                                                                  \
    static void on_engine_##id(void)

static inline bool place_open(place *p)
{
    char message[400] = "";
    if (p->database[0])
        postgresql_address(p->database, p->address, sizeof p->address);
    else
        snprintf(p->address, sizeof p->address, "%s", p->path);
    p->s = store_open(p->address, message, sizeof message);
    CHECK_MSG(p->s, "%s", message);
    return p->s != NULL;
}

static inline bool place_begin(place *p)
{
    strcpy(p->folder, "/tmp/test-store-XXXXXX");
    CHECK(mkdtemp(p->folder));
    snprintf(p->path, sizeof p->path, "%s/jobs.db", p->folder);
    p->database[0] = '\0';
    if (place_engine && place_engine->scheme[0])
        postgresql_database(p->database);
    return place_open(p);
}

static inline bool place_reopen(place *p)
{
    store_close(p->s);
    return place_open(p);
}

static inline void place_remove_files(const place *p)
{
    char name[128];
    const char *const suffixes[] = {"", "-wal", "-shm", "-journal", "-trail", "-spare"};
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        snprintf(name, sizeof name, "%s%s", p->path, suffixes[i]);
        unlink(name);
    }
}

static inline void place_end(place *p)
{
    store_close(p->s);
    p->s = NULL;
    place_remove_files(p);
    CHECK_INT(rmdir(p->folder), 0); /* nothing else is left behind */
}

static inline store_status submit_text(store *s, const char *body, const char *tags, const char *key, char id[33])
{
    job j = {0};
    bool repeated = false;
    store_status status =
        store_submit(s, &(store_request){.body = body, .body_len = strlen(body), .tags = tags, .idempotency_key = key},
                     &j, &repeated);
    strcpy(id, j.id);
    job_clear(&j);
    return status;
}

/* The leases that this thread was given last, so that tests can name a claim by its job and owner. */
static _Thread_local store_lease leases_held[64] __attribute__((unused));
static _Thread_local unsigned leases_given __attribute__((unused));

static inline store_status claim_id(store *s, const char *owner, char id[33])
{
    job j = {0};
    char *body;
    size_t len;
    store_status status = store_claim(s, owner, 30.0, false, &leases_held[leases_given % 64], &j, &body, &len);
    leases_given += status == STORE_OK;
    strcpy(id, j.id);
    job_clear(&j);
    free(body);
    return status;
}

/* The last one of this owner for this job; one that nobody was given where there is none. */
static inline store_lease lease_of(const char *id, const char *owner)
{
    store_lease made = {.token = 0};
    for (unsigned n = leases_given; n > 0 && leases_given - n < 64; n--)
        if (strcmp(leases_held[(n - 1) % 64].job, id) == 0 && strcmp(leases_held[(n - 1) % 64].owner, owner) == 0)
            return leases_held[(n - 1) % 64];
    snprintf(made.job, sizeof made.job, "%.32s", id);
    snprintf(made.owner, sizeof made.owner, "%s", owner);
    return made;
}

static inline store_status finish_as(store *s, const char *id, const char *owner, const store_outcome *outcome)
{
    const store_lease lease = lease_of(id, owner);
    return store_finish(s, &lease, outcome, NULL);
}

static inline store_status renew_as(store *s, const char *id, const char *owner, int progress)
{
    const store_lease lease = lease_of(id, owner);
    return store_renew(s, &lease, progress, NULL);
}

static inline store_status release_as(store *s, const char *id, const char *owner)
{
    const store_lease lease = lease_of(id, owner);
    return store_release(s, &lease, false);
}

static inline job_status status_of(store *s, const char *id)
{
    job j = {0};
    CHECK_INT(store_get(s, id, &j), STORE_OK);
    job_status status = j.status;
    job_clear(&j);
    return status;
}

static const store_outcome PLAIN_SUCCESS
    __attribute__((unused)) = {.status = JOB_SUCCESSFUL, .whole.summary = "{\"outcome\": \"converged\"}"};

/* Finishes a new job with n cases named "c0", "c1", ...: reactions {i, i + 1}, a history of one row. */
static inline void finish_cases(place *p, char id[33], size_t n)
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

static inline void check_counts(store *s, int64_t accepted, int64_t running, int64_t successful, int64_t failed,
                                int64_t dismissed)
{
    const int64_t want[5] = {accepted, running, successful, failed, dismissed};
    int64_t have[STORE_COUNTS];
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

#endif
