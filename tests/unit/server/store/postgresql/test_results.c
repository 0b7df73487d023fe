/* Results in rows: many pieces in one, what is damaged there, and what daemons of the version before find and leave. */
#include "store/result_blobs.h"
#include "store_place.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static bool begin(place *p)
{
    if (!postgresql_there()) {
        printf("skip no server of PostgreSQL (Debian: postgresql)\n");
        return false;
    }
    place_engine = STORE_ENGINES[0];
    return place_begin(p);
}

static void end(place *p)
{
    place_end(p);
    place_engine = NULL;
}

static int64_t ask(const place *p, const char *sql)
{
    int64_t n = -1;
    CHECK_MSG(postgresql_run(p->database, sql, &n), "%s", sql);
    return n;
}

static void run_sql(const place *p, const char *sql)
{
    CHECK_MSG(postgresql_run(p->database, sql, NULL), "%s", sql);
}

static void check_found(store *s, const char *what)
{
    store_findings found;
    CHECK_INT(store_check(s, &found), STORE_OK);
    CHECK_MSG(what ? strstr(found.findings, what) != NULL : !found.findings[0], "%s", found.findings);
    free(found.findings);
}

TEST(the_pieces_of_a_result_are_one_row)
{
    place p;
    char id[33];
    double *x = NULL;
    int64_t n = 0, columns;
    if (!begin(&p))
        return;
    finish_cases(&p, id, 3);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.bundle"), 1);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.pieces WHERE good"), 7);
    CHECK_INT(store_get_vector(p.s, id, 2, "reactions", &x, &n), STORE_OK);
    CHECK(x && n == 2 && x[0] == 1.0 && x[1] == 2.0);
    free(x);
    CHECK_INT(store_get_history(p.s, id, 3, -1, &x, &n, &columns), STORE_OK);
    CHECK(x && n == 1 && columns == 12 && x[11] == 211.0);
    free(x);
    CHECK_INT(store_count_vectors(p.s, id, "reactions", &n), STORE_OK);
    CHECK_INT((int)n, 6);
    check_found(p.s, NULL);
    end(&p);
}

TEST(a_damaged_row_of_pieces_is_told)
{
    place p;
    char id[33];
    double *x = NULL;
    int64_t n = 0;
    if (!begin(&p))
        return;
    finish_cases(&p, id, 2);
    run_sql(&p, "UPDATE uzawa.bundle SET data = set_byte(data, 30, 1 + get_byte(data, 30))");
    CHECK_INT(store_get_vector(p.s, id, 1, "reactions", &x, &n), STORE_DAMAGED);
    check_found(p.s, "the reactions of job ");
    run_sql(&p, "UPDATE uzawa.bundle SET data = set_byte(data, 30, get_byte(data, 30) - 1)");
    check_found(p.s, NULL);
    /* without its list nothing can be found in it, whatever that says */
    run_sql(&p, "UPDATE uzawa.bundle SET list = overlay(list PLACING 'x' FROM 2)");
    CHECK_INT(store_get_vector(p.s, id, 1, "reactions", &x, &n), STORE_DAMAGED);
    check_found(p.s, "a part of the result of job ");
    /* nor under another job's name */
    run_sql(&p, "UPDATE uzawa.bundle SET list = overlay(list PLACING '0' FROM 2)");
    check_found(p.s, NULL);
    run_sql(&p, "UPDATE uzawa.bundle SET job = repeat('0', 32)");
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.pieces"), 0);
    CHECK_INT(store_get_vector(p.s, id, 1, "reactions", &x, &n), STORE_DAMAGED);
    end(&p);
}

/* COUNT numbers are more than a piece of a vector, so that pieces in the middle are shared, too. */
enum { COUNT = RESULT_PIECE / 8 + 2048, PIECES = 2 };

/* Ends a job with the vectors "nodes" and "displacements". */
static void end_with(store *s, char id[33], const double *nodes, const double *displacements)
{
    store_vector v[] = {{"nodes", COUNT, nodes}, {"displacements", COUNT, displacements}, {"gaps", 3, nodes}};
    const store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole = {.summary = "{}", .vectors = v, .n_vectors = 3}};
    CHECK_INT(submit_text(s, "{}", NULL, NULL, id), STORE_OK);
    CHECK_INT(claim_id(s, "a", id), STORE_OK);
    CHECK_INT(finish_as(s, id, "a", &outcome), STORE_OK);
}

static void check_vector(store *s, const char *id, const char *name, const double *x)
{
    double *found = NULL;
    int64_t n = 0;
    CHECK_INT(store_get_vector(s, id, 0, name, &found, &n), STORE_OK);
    CHECK(n == COUNT && found && memcmp(found, x, COUNT * sizeof *x) == 0);
    free(found);
}

TEST(equal_vectors_are_kept_once_and_go_with_the_last_job)
{
    place p;
    char id[3][33];
    job_status was;
    double *x = malloc(3 * COUNT * sizeof *x);
    if (!x || !begin(&p)) {
        free(x);
        return;
    }
    for (int i = 0; i < 3 * COUNT; i++)
        x[i] = 0.1 * i;
    for (int k = 0; k < 3; k++) /* the third is the second again */
        end_with(p.s, id[k], x, x + (k == 0 ? 1 : 2) * COUNT);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 3 * PIECES);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common_use"), 6 * PIECES);
    CHECK_INT((int)ask(&p, "SELECT max(length(data)) FROM uzawa.bundle"), 3 * 8);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.pieces WHERE good"), 3 * (2 * PIECES + 1));
    for (int k = 0; k < 3; k++)
        check_vector(p.s, id[k], "displacements", x + (k == 0 ? 1 : 2) * COUNT);
    check_found(p.s, NULL);
    CHECK_INT(store_dismiss(p.s, id[1], &was), STORE_OK);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 3 * PIECES);
    CHECK_INT(store_dismiss(p.s, id[0], &was), STORE_OK);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 2 * PIECES);
    check_vector(p.s, id[2], "nodes", x);
    check_vector(p.s, id[2], "displacements", x + 2 * COUNT);
    end_with(p.s, id[0], x, x + COUNT); /* and it comes again */
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 3 * PIECES);
    check_found(p.s, NULL);
    CHECK_INT((int)ask(&p, "WITH gone AS (DELETE FROM uzawa.job RETURNING 1) SELECT count(*) FROM gone"), 2);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 0);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common_use"), 0);
    end(&p);
    free(x);
}

TEST(a_damaged_piece_of_several_jobs_is_told_of_each)
{
    place p;
    char id[2][33];
    double *x = calloc(2 * COUNT, sizeof *x), *got = NULL;
    int64_t n = 0;
    if (!x || !begin(&p)) {
        free(x);
        return;
    }
    for (int i = 0; i < 2 * COUNT; i++)
        x[i] = i;
    for (int k = 0; k < 2; k++)
        end_with(p.s, id[k], x, x + COUNT);
    run_sql(&p, "UPDATE uzawa.common SET data = set_byte(data, 5, 1 + get_byte(data, 5))"
                " WHERE digest = (SELECT c.digest FROM uzawa.common AS c JOIN uzawa.pieces AS p ON p.data = c.data"
                " WHERE p.name = 'nodes' AND p.part = 1 LIMIT 1)");
    for (int k = 0; k < 2; k++) {
        CHECK_INT(store_get_vector(p.s, id[k], 0, "nodes", &got, &n), STORE_DAMAGED);
        check_vector(p.s, id[k], "displacements", x + COUNT);
        check_found(p.s, id[k]);
    }
    check_found(p.s, "the nodes of job ");
    run_sql(&p, "DELETE FROM uzawa.common WHERE sha256(data) <> digest");
    CHECK_INT(store_get_vector(p.s, id[1], 0, "nodes", &got, &n), STORE_DAMAGED);
    check_found(p.s, "the nodes of job ");
    run_sql(&p, "UPDATE uzawa.common_use SET job = repeat('0', 32)");
    check_found(p.s, "belongs to no result");
    end(&p);
    free(x);
}

/* Ends and deletes jobs that all have the same vectors. */
enum { TURNS = 25, HANDS = 4 };
typedef struct {
    pthread_t thread;
    store *s;
    const double *x;
    bool good;
} hand;

static void *end_and_delete(void *ctx)
{
    hand *h = ctx;
    static const store_outcome NONE = {.status = JOB_SUCCESSFUL, .whole.summary = "{}"};
    store_outcome outcome = NONE;
    store_vector v[] = {{"nodes", 2048, h->x}, {"displacements", 2048, h->x + 2048}};
    outcome.whole.vectors = v;
    outcome.whole.n_vectors = 2;
    h->good = true;
    for (int i = 0; i < TURNS && h->good; i++) {
        char id[33];
        job_status was;
        double *found = NULL;
        int64_t n = 0;
        h->good = submit_text(h->s, "{}", NULL, NULL, id) == STORE_OK && claim_id(h->s, "a", id) == STORE_OK &&
                  finish_as(h->s, id, "a", &outcome) == STORE_OK &&
                  store_get_vector(h->s, id, 0, "nodes", &found, &n) == STORE_OK && n == 2048 &&
                  memcmp(found, h->x, 2048 * sizeof *found) == 0 && store_dismiss(h->s, id, &was) == STORE_OK;
        free(found);
    }
    return NULL;
}

TEST(a_piece_that_goes_and_comes_at_the_same_moment_is_there)
{
    place p, q;
    hand hands[HANDS];
    double x[2 * 2048];
    if (!begin(&p))
        return;
    for (int i = 0; i < 2 * 2048; i++)
        x[i] = i;
    q = p; /* another daemon on the same database */
    CHECK(place_open(&q));
    for (int i = 0; i < HANDS; i++) {
        hands[i] = (hand){.s = i % 2 ? p.s : q.s, .x = x};
        CHECK_INT(pthread_create(&hands[i].thread, NULL, end_and_delete, &hands[i]), 0);
    }
    for (int i = 0; i < HANDS; i++) {
        pthread_join(hands[i].thread, NULL);
        CHECK(hands[i].good);
    }
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.common"), 0);
    check_found(p.s, NULL);
    store_close(q.s);
    end(&p);
}

/* What daemons of version 5 put, word by word. */
#define PUT_5                                                                                                          \
    "INSERT INTO uzawa.bundle(job, token, n, list, data, sum) SELECT id, 7, 0, l, d, uzawa.bundle_sum(id, 0, l, d)"    \
    " FROM uzawa.job, (SELECT E'{0}\\n{\"reactions\"}\\n{0}\\n{1}\\n{1}\\n{1}\\n{8}\\n{0}' AS l,"                      \
    " '\\x000000000000f03f'::bytea AS d) AS each ON CONFLICT DO NOTHING"

TEST(daemons_of_the_version_before_read_and_write_results)
{
    place p;
    char id[33], other[33];
    double *x = NULL;
    int64_t n = 0;
    job_status was;
    if (!begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", other), STORE_OK);
    run_sql(&p, PUT_5);
    run_sql(&p, PUT_5); /* sent again */
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.pieces WHERE good AND name = 'reactions'"), 1);
    CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), STORE_OK);
    CHECK(x && n == 1 && x[0] == 1.0);
    free(x);
    CHECK_INT(finish_as(p.s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.pieces"), 0);
    end(&p);
}
