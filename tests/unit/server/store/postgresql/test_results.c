/* Results in rows: many pieces in one, what is damaged there, and what daemons of the version before find and leave. */
#include "store_place.h"

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

/* The statements of version 4, word by word but for what they select. */
#define READ_4                                                                                                         \
    "SELECT count(*) FROM (SELECT part, encoding, header, last, CASE WHEN name <> '/' OR last > -1::float8 THEN data"  \
    " ELSE '' END, sum = uzawa.sum_of(uzawa.piece_keys(piece), data) AS good FROM uzawa.piece WHERE name ="            \
    " 'reactions') AS each WHERE good"
#define PUT_4                                                                                                          \
    "INSERT INTO uzawa.piece(job, token, number, name, part, encoding, header, last, data, sum)"                       \
    " SELECT job, 7, number, name, part, encoding, header, last, data,"                                                \
    " uzawa.sum_of(concat_ws(E'\\x1f', job, number, name, part, encoding, header, last), data)"                        \
    " FROM (SELECT id AS job, 0::bigint AS number, 'reactions' AS name, 0::bigint AS part, 1::bigint AS encoding,"     \
    " 1::bigint AS header, 1::float8 AS last, '\\x000000000000f03f'::bytea AS data FROM uzawa.job) AS each"            \
    " ON CONFLICT DO NOTHING"

TEST(daemons_of_the_version_before_read_and_write_results)
{
    place p;
    char id[33], other[33];
    double *x = NULL;
    int64_t n = 0;
    job_status was;
    if (!begin(&p))
        return;
    finish_cases(&p, id, 2);
    CHECK_INT((int)ask(&p, READ_4), 2); /* what a newer one has left */
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.bundle"), 0);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", other), STORE_OK);
    run_sql(&p, PUT_4);
    run_sql(&p, PUT_4); /* sent again */
    CHECK_INT((int)ask(&p, READ_4), 1);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.piece_row"), 1);
    CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), STORE_OK);
    CHECK(x && n == 1 && x[0] == 1.0);
    free(x);
    CHECK_INT(finish_as(p.s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT((int)ask(&p, "SELECT count(*) FROM uzawa.piece"), 0);
    end(&p);
}
