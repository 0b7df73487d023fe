/* store_place.h: for tests, a store in a temporary folder of its own, and the file behind it. */
#ifndef TESTS_STORE_PLACE_H
#define TESTS_STORE_PLACE_H

#include "harness.h"
#include "store/engines/engines.h"

#include <sqlite3.h>
#include <unistd.h>

/* ---- a store in a folder of its own */

typedef struct {
    char folder[64], path[96];
    store *s;
} place;

static inline bool place_open(place *p)
{
    char message[400] = "";
    p->s = store_open(p->path, message, sizeof message);
    CHECK_MSG(p->s, "%s", message);
    return p->s != NULL;
}

static inline bool place_begin(place *p)
{
    strcpy(p->folder, "/tmp/test-store-XXXXXX");
    CHECK(mkdtemp(p->folder));
    snprintf(p->path, sizeof p->path, "%s/jobs.db", p->folder);
    return place_open(p);
}

static inline bool place_reopen(place *p)
{
    store_close(p->s);
    return place_open(p);
}

static inline void place_end(place *p)
{
    char name[128];
    const char *const suffixes[] = {"", "-wal", "-shm", "-journal"};
    store_close(p->s);
    p->s = NULL;
    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++) {
        snprintf(name, sizeof name, "%s%s", p->path, suffixes[i]);
        unlink(name);
    }
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
    store_status status = store_claim(s, owner, 30.0, &leases_held[leases_given % 64], &j, &body, &len);
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
    snprintf(made.job, sizeof made.job, "%s", id);
    snprintf(made.owner, sizeof made.owner, "%s", owner);
    return made;
}

static inline store_status finish_as(store *s, const char *id, const char *owner, const store_outcome *outcome)
{
    const store_lease lease = lease_of(id, owner);
    return store_finish(s, &lease, outcome);
}

static inline store_status renew_as(store *s, const char *id, const char *owner, double lease_s, int progress)
{
    const store_lease lease = lease_of(id, owner);
    return store_renew(s, &lease, lease_s, progress);
}

static inline store_status release_as(store *s, const char *id, const char *owner)
{
    const store_lease lease = lease_of(id, owner);
    return store_release(s, &lease);
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

static inline int64_t rows_in(const char *path, const char *table)
{
    char sql[256];
    sqlite3 *db = NULL;
    sqlite3_stmt *stmt = NULL;
    int64_t count = -1;
    snprintf(sql, sizeof sql, "SELECT count(*) FROM %s", table);
    if (sqlite3_open_v2(path, &db, SQLITE_OPEN_READONLY, NULL) == SQLITE_OK &&
        sqlite3_prepare_v2(db, sql, -1, &stmt, NULL) == SQLITE_OK && sqlite3_step(stmt) == SQLITE_ROW)
        count = sqlite3_column_int64(stmt, 0);
    sqlite3_finalize(stmt);
    sqlite3_close(db);
    return count;
}

static inline void change_file(const char *path, const char *sql)
{
    sqlite3 *db = NULL;
    CHECK_INT(sqlite3_open(path, &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10000); /* a worker may be writing */
    CHECK_INT(sqlite3_exec(db, sql, NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
}

#endif
