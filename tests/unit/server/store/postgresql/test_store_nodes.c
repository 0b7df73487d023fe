/* Several daemons on one database: which of them gets which job, what they say of themselves, which is to claim
 * nothing, and what clients have asked of all of them. */
#include "store_place.h"
#include "store/engine_base.h"
#include "store/nodes.h"
#include "store/postgresql/former.h"
#include "store/postgresql/schema.h"

#include <signal.h>
#include <sys/wait.h>

/* Two daemons: of the place, and another one. */
typedef struct {
    place p;
    store *a, *b;
} pair;

static bool pair_begin(pair *two, double affinity_s)
{
    char message[300] = "";
    *two = (pair){.b = NULL};
    if (!postgresql_there()) {
        printf("skip no server of PostgreSQL (Debian: postgresql)\n");
        return false;
    }
    place_engine = STORE_ENGINES[0];
    CHECK(place_begin(&two->p));
    two->a = two->p.s;
    two->b = store_open(two->p.address, message, sizeof message);
    CHECK_MSG(two->a && two->b, "%s", message);
    if (two->a && two->b)
        two->a->settings.affinity_s = two->b->settings.affinity_s = affinity_s;
    return two->a && two->b;
}

static void pair_end(pair *two)
{
    store_close(two->b);
    place_end(&two->p);
    place_engine = NULL;
}

static void run_sql(const pair *two, const char *sql)
{
    CHECK_MSG(postgresql_run(two->p.database, sql, NULL), "%s", sql);
}

static void submit_body(store *s, uint64_t body, int priority, char id[33])
{
    job j = {0};
    bool repeated;
    CHECK_INT(store_submit(s, &(store_request){.body = "{}", .body_len = 2, .held_body = body, .priority = priority},
                           &j, &repeated),
              STORE_OK);
    strcpy(id, j.id);
    job_clear(&j);
}

/* The job that a claim gives, "" for none. */
static store_lease claim_next(store *s)
{
    store_lease lease;
    job j = {0};
    char *text = NULL;
    size_t len;
    const store_status status = store_claim(s, "me", 30.0, false, &lease, &j, &text, &len);
    CHECK(status == STORE_OK || status == STORE_NOT_FOUND);
    job_clear(&j);
    free(text);
    return lease;
}

static void check_claim(store *s, const char *id, int fit)
{
    const store_lease lease = claim_next(s);
    CHECK_STR(lease.job, id);
    CHECK_INT((int)lease.fit, fit);
    CHECK_INT(store_finish(s, &lease, &PLAIN_SUCCESS, NULL), STORE_OK);
}

TEST(a_job_goes_where_its_body_is)
{
    pair two;
    char id[8][33];
    if (!pair_begin(&two, 1000.0))
        return;
    submit_body(two.a, 1, 0, id[0]);
    submit_body(two.a, UINT64_MAX, 0, id[1]);
    check_claim(two.a, id[0], FIT_NEW);
    check_claim(two.b, id[1], FIT_NEW);
    /* younger ones that one has the body of go before older ones that nobody has */
    submit_body(two.a, 3, 0, id[2]);
    submit_body(two.a, 1, 0, id[3]);
    submit_body(two.a, UINT64_MAX, 0, id[4]);
    submit_body(two.a, 0, 0, id[5]);
    submit_body(two.a, 0, 5, id[6]); /* not before one of a higher priority */
    check_claim(two.b, id[6], FIT_NEW);
    check_claim(two.b, id[4], FIT_HELD);
    check_claim(two.a, id[3], FIT_HELD);
    check_claim(two.a, id[2], FIT_NEW);
    check_claim(two.a, id[5], FIT_NEW);
    /* what one has no more is anybody's */
    submit_body(two.a, 3, 0, id[0]);
    CHECK_INT(store_forget_bodies(two.a, &(uint64_t){3}, 1), STORE_OK);
    check_claim(two.b, id[0], FIT_NEW);
    pair_end(&two);
}

static void submit_small(store *s, const char *share, char id[33])
{
    job j = {0};
    bool repeated;
    const store_request r = {.body = "{}", .body_len = 2, .small = true, .share = share};
    CHECK_INT(store_submit(s, &r, &j, &repeated), STORE_OK);
    strcpy(id, j.id);
    job_clear(&j);
}

static int64_t count_of(const pair *two, const char *where)
{
    char sql[200];
    int64_t n = -1;
    snprintf(sql, sizeof sql, "SELECT count(*) FROM uzawa.job WHERE %s", where);
    CHECK(postgresql_run(two->p.database, sql, &n));
    return n;
}

/* In the order in which they came, each with a lease of its own, and only where many wait and all are one share's. */
TEST(small_jobs_are_claimed_ahead)
{
    enum { JOBS = 20 };
    pair two;
    char id[JOBS][33], other[33];
    store_lease lease;
    int64_t count;
    if (!pair_begin(&two, 1000.0))
        return;
    two.a->settings.claims_ahead = 3;
    two.a->settings.ahead_s = 1000.0;
    for (int i = 0; i < JOBS; i++)
        submit_small(two.a, "one", id[i]);
    for (int i = 0; i < 5; i++) {
        lease = claim_next(two.a);
        CHECK_STR(lease.job, id[i]);
        CHECK_INT(store_finish(two.a, &lease, &PLAIN_SUCCESS, NULL), STORE_OK);
        CHECK_INT(count_of(&two, "status = 1"), 3 - i % 4);
    }
    CHECK_STR(claim_next(two.b).job, id[8]); /* another daemon has none of them */
    CHECK_INT(count_of(&two, "status = 1"), 4);
    /* what nobody has begun for long waits again, as it did before */
    CHECK_INT(store_expire(two.a, "{}", &count), STORE_OK);
    CHECK_INT(count_of(&two, "status = 1"), 4);
    two.a->settings.ahead_s = 0.0;
    CHECK_INT(store_expire(two.a, "{}", &count), STORE_OK);
    CHECK_INT(count_of(&two, "status = 1"), 1);
    CHECK_INT(count_of(&two, "status = 0 AND small AND attempts = 0 AND node IS NULL"), JOBS - 6);
    two.a->settings.ahead_s = 1000.0;
    /* nobody else's turn is passed over */
    submit_small(two.b, "two", other);
    lease = claim_next(two.a);
    CHECK_STR(lease.job, other);
    CHECK_INT(count_of(&two, "status = 1"), 2);
    CHECK_STR(claim_next(two.b).job, id[5]);
    /* a daemon that ends leaves none */
    CHECK_STR(claim_next(two.a).job, id[6]);
    CHECK_INT(count_of(&two, "status = 1"), 7);
    store_close(two.a);
    two.a = two.p.s = NULL;
    CHECK_INT(count_of(&two, "status = 1"), 4);
    check_counts(two.b, JOBS + 1 - 9, 4, 5, 0, 0);
    pair_end(&two);
}

/* The answer of a commit is lost and the end is sent again: it is there, and nothing is said against it. */
TEST(an_end_that_is_sent_again_is_the_same)
{
    static const double FORCES[] = {-1.0, -2.0};
    const store_vector vector = {.name = "reactions", .count = 2, .data = FORCES};
    const store_answer one = {.name = "one", .summary = "{}", .vectors = &vector, .n_vectors = 1};
    const store_outcome with_result = {.status = JOB_SUCCESSFUL,
                                       .whole = {.summary = "{\"a\": 1}", .vectors = &vector, .n_vectors = 1},
                                       .cases = &one,
                                       .n_cases = 1};
    store_outcome other = with_result;
    pair two;
    char id[33];
    int64_t rows = 0;
    double *got = NULL;
    if (!pair_begin(&two, 1000.0))
        return;
    other.whole.summary = "{\"a\": 2}";
    submit_body(two.a, 1, 0, id);
    store_lease lease = claim_next(two.a);
    CHECK_INT(store_finish(two.a, &lease, &with_result, NULL), STORE_OK);
    CHECK_INT(store_finish(two.a, &lease, &with_result, NULL), STORE_OK);
    CHECK_INT(store_finish(two.a, &lease, &other, NULL), STORE_CONFLICT);
    CHECK(postgresql_run(two.p.database, "SELECT count(*) FROM uzawa.pieces", &rows) && rows == 2);
    CHECK(postgresql_run(two.p.database, "SELECT count(*) FROM uzawa.answer", &rows) && rows == 1);
    CHECK_INT(store_get_vector(two.b, id, 1, "reactions", &got, &rows), STORE_OK);
    CHECK(got && rows == 2 && got[1] == -2.0);
    free(got);
    /* and with another lease it is another's */
    lease.token++;
    CHECK_INT(store_finish(two.a, &lease, &with_result, NULL), STORE_CONFLICT);
    CHECK(postgresql_run(two.p.database, "SELECT count(*) FROM uzawa.pieces", &rows) && rows == 2);
    /* what belongs to a job goes with it */
    job_status was;
    CHECK_INT(store_dismiss(two.b, id, &was), STORE_OK);
    CHECK(postgresql_run(two.p.database, "SELECT count(*) FROM uzawa.pieces", &rows) && rows == 0);
    pair_end(&two);
}

/* The jobs of a daemon that was killed, at the start of the next one on its machine, or of that with its name. */
/* Ends are told by the database's clock: what one daemon's shows makes nothing older. */
TEST(a_daemon_whose_clock_is_wrong_deletes_nothing_for_it)
{
    const double year = 366.0 * 86400.0, now = clock_seconds(CLOCK_REALTIME);
    pair two;
    int64_t count = -1;
    char id[33];
    job j = {0};
    upload_info upload;
    if (!pair_begin(&two, 0.0))
        return;
    submit_body(two.a, 0, 0, id);
    CHECK_INT(store_dismiss(two.a, id, &j.status), STORE_OK);
    CHECK_INT(two.b->engine->retain(two.b, &(store_retention){.keep_s = 1000.0}, now + year, &count), STORE_OK);
    CHECK_INT(count, 0);
    CHECK_INT(store_get(two.a, id, &j), STORE_OK);
    job_clear(&j);
    run_sql(&two, "UPDATE uzawa.job SET finished = finished - 2000");
    CHECK_INT(two.b->engine->retain(two.b, &(store_retention){.keep_s = 1000.0}, now + year, &count), STORE_OK);
    CHECK_INT(count, 1);
    run_sql(&two, "INSERT INTO uzawa.blob VALUES ('x', 0, true)");
    run_sql(&two, "INSERT INTO uzawa.upload SELECT 'x', 1, uzawa.moment(), uzawa.moment()");
    CHECK_INT(two.b->engine->upload_idle(two.b, now + year, 1000.0, &upload), STORE_NOT_FOUND);
    run_sql(&two, "UPDATE uzawa.upload SET used = used - 2000");
    CHECK_INT(two.b->engine->upload_idle(two.b, now + year, 1000.0, &upload), STORE_OK);
    pair_end(&two);
}

TEST(jobs_of_a_process_that_is_no_more_are_taken_up)
{
    pair two;
    char id[33], text[FORMER_TEXT], sql[400];
    int64_t requeued, failed;
    if (!pair_begin(&two, 1000.0))
        return;
    submit_body(two.a, 1, 0, id);
    const store_lease lease = claim_next(two.b);
    CHECK_STR(lease.job, id);
    CHECK_INT(store_recover(two.a, 9, "{}", &requeued, &failed), STORE_OK); /* it lives */
    CHECK_INT((int)requeued, 0);
    const pid_t child = fork();
    if (child == 0) {
        pause();
        _exit(0);
    }
    CHECK(former_describe(child, text));
    snprintf(sql, sizeof sql, "UPDATE uzawa.node SET process = '%s' WHERE id = (SELECT node FROM uzawa.job)", text);
    run_sql(&two, sql);
    CHECK_INT(store_recover(two.a, 9, "{}", &requeued, &failed), STORE_OK);
    CHECK_INT((int)requeued, 0);
    kill(child, SIGKILL);
    CHECK(waitpid(child, NULL, 0) == child);
    CHECK_INT(store_recover(two.a, 9, "{}", &requeued, &failed), STORE_OK);
    CHECK_INT((int)requeued, 1);
    CHECK_INT(store_finish(two.b, &lease, &PLAIN_SUCCESS, NULL), STORE_CONFLICT); /* whatever it was */
    /* of another machine only the name tells */
    run_sql(&two, "INSERT INTO uzawa.node(id, host, pid, begun, seen, name, process) SELECT 'far', host, 1, seen, seen,"
                  " 'one', '0-0 pid:[1] 1 1' FROM uzawa.node LIMIT 1");
    CHECK_STR(claim_next(two.a).job, id);
    run_sql(&two, "UPDATE uzawa.job SET node = 'far'");
    CHECK_INT(store_recover(two.a, 9, "{}", &requeued, &failed), STORE_OK);
    CHECK_INT((int)requeued, 0);
    run_sql(&two, "UPDATE uzawa.node SET name = 'one'");
    CHECK_INT(store_recover(two.a, 9, "{}", &requeued, &failed), STORE_OK);
    CHECK_INT((int)requeued, 1);
    pair_end(&two);
}

TEST(none_waits_for_long_for_who_has_its_body)
{
    pair two;
    char id[4][33];
    if (!pair_begin(&two, 1000.0))
        return;
    submit_body(two.a, 1, 0, id[0]);
    check_claim(two.a, id[0], FIT_NEW);
    run_sql(&two, "UPDATE uzawa.holding SET seconds = 100");
    submit_body(two.a, 1, 0, id[1]);
    /* left to who has it, for as long as the factor would take */
    store_lease none = claim_next(two.b);
    CHECK_STR(none.job, "");
    CHECK(none.later_s > 90.0 && none.later_s <= 100.0);
    run_sql(&two, "UPDATE uzawa.job SET passed = passed - 100 WHERE status = 0");
    check_claim(two.b, id[1], FIT_OTHERS);
    /* of one that lives no more nobody expects anything; nor of one that drains */
    submit_body(two.a, 5, 0, id[2]);
    check_claim(two.a, id[2], FIT_NEW);
    submit_body(two.a, 5, 0, id[3]);
    CHECK_STR(claim_next(two.b).job, "");
    run_sql(&two, "UPDATE uzawa.node SET seen = 0 WHERE id IN (SELECT node FROM uzawa.holding WHERE body = 5)");
    check_claim(two.b, id[3], FIT_NEW);
    pair_end(&two);
}

TEST(others_go_before_one_for_a_while_only)
{
    pair two;
    char id[4][33];
    if (!pair_begin(&two, 1000.0))
        return;
    submit_body(two.a, 1, 0, id[0]);
    check_claim(two.a, id[0], FIT_NEW);
    submit_body(two.a, 2, 0, id[1]);
    submit_body(two.a, 1, 0, id[2]);
    submit_body(two.a, 1, 0, id[3]);
    check_claim(two.a, id[2], FIT_HELD);
    run_sql(&two, "UPDATE uzawa.job SET passed = passed - 1000 WHERE passed > 0 AND status = 0");
    check_claim(two.a, id[1], FIT_NEW);
    check_claim(two.a, id[3], FIT_HELD);
    pair_end(&two);
    /* without it: in their order, whoever has what */
    if (!pair_begin(&two, 0.0))
        return;
    submit_body(two.a, 1, 0, id[0]);
    check_claim(two.a, id[0], FIT_NEW);
    submit_body(two.a, 2, 0, id[1]);
    submit_body(two.a, 1, 0, id[2]);
    check_claim(two.a, id[1], FIT_NEW);
    CHECK_STR(claim_next(two.b).job, id[2]);
    pair_end(&two);
}

TEST(nodes_and_the_drain_of_one)
{
    pair two;
    char id[33];
    bool draining = true;
    store_node *nodes,
        now = {.name = "a", .host = "here", .pid = 7, .workers = 3, .busy = 2, .factors = 5, .bytes = 99};
    size_t n;
    if (!pair_begin(&two, 5.0))
        return;
    CHECK_INT(store_report(two.a, &now, &draining), STORE_OK);
    CHECK(!draining);
    strcpy(now.name, "b");
    CHECK_INT(store_report(two.b, &now, &draining), STORE_OK);
    submit_body(two.a, 0xfedcba9876543210u, 0, id);
    CHECK_STR(claim_next(two.a).job, id);
    CHECK_INT(store_nodes(two.b, &nodes, &n), STORE_OK);
    CHECK_INT((int)n, 2);
    CHECK(n == 2 && strcmp(nodes[0].name, "a") == 0 && nodes[0].alive && nodes[0].running == 1 && nodes[0].pid == 7 &&
          nodes[0].workers == 3 && nodes[0].factors == 5 && nodes[0].n_bodies == 1 &&
          nodes[0].bodies[0] == 0xfedcba9876543210u && nodes[1].running == 0 && nodes[1].n_bodies == 0);
    store_nodes_free(nodes, n);
    /* told by the other one */
    CHECK_INT(store_drain(two.b, "a", true), STORE_OK);
    CHECK_INT(store_drain(two.b, "c", true), STORE_NOT_FOUND);
    submit_body(two.a, 0xfedcba9876543210u, 0, id);
    CHECK_STR(claim_next(two.a).job, "");
    strcpy(now.name, "a");
    CHECK_INT(store_report(two.a, &now, &draining), STORE_OK);
    CHECK(draining);
    CHECK_STR(claim_next(two.b).job, id); /* at once: it is not left to one that claims nothing */
    CHECK_INT(store_drain(two.b, "a", false), STORE_OK);
    submit_body(two.a, 9, 0, id);
    CHECK_STR(claim_next(two.a).job, id);
    pair_end(&two);
}

TEST(what_clients_ask_of_all)
{
    pair two;
    store_rate a[2] = {{.client = "x \"y\\", .used = 3}, {.client = "z", .used = 1}},
               b[1] = {{.client = "x \"y\\", .used = 4}};
    if (!pair_begin(&two, 5.0))
        return;
    CHECK_INT(store_exchange_rates(two.a, a, 2), STORE_OK);
    CHECK_INT(store_exchange_rates(two.b, b, 1), STORE_OK);
    CHECK_INT((int)a[0].total, 3);
    CHECK_INT((int)a[1].total, 1);
    CHECK_INT((int)b[0].total, 7);
    pair_end(&two);
}

/* The first one of a version comes while others go on with the one before (schema.h). */
TEST(a_database_of_version_1_is_brought_to_the_next)
{
    char message[300] = "", sql[200];
    size_t len = 0;
    char *script = test_read_file("server/store/postgresql/schema_1.sql", &len);
    pair two;
    int64_t number = 0;
    if (!pair_begin(&two, 5.0)) {
        free(script);
        return;
    }
    store_close(two.b);
    run_sql(&two, "DROP SCHEMA uzawa CASCADE; CREATE ROLE old_daemon");
    run_sql(&two, script);
    run_sql(&two, "GRANT USAGE ON SCHEMA uzawa TO old_daemon;"
                  "GRANT SELECT, INSERT, UPDATE, DELETE ON ALL TABLES IN SCHEMA uzawa TO old_daemon");
    static const char OLD[] = "SELECT verdict FROM uzawa.submit(lpad('%d', 32, '0'), 1, 'a', 'd', '[]', '', 's', NULL,"
                              "NULL, NULL, true, 0, false, NULL, 0, 0, 0, 0, 0)";
    snprintf(sql, sizeof sql, OLD, 1);
    run_sql(&two, sql);
    two.b = store_open(two.p.address, message, sizeof message);
    CHECK_MSG(two.b, "%s", message);
    CHECK(postgresql_run(two.p.database, "SELECT version FROM uzawa.format", &number));
    CHECK_INT((int)number, SCHEMA_VERSION);
    snprintf(sql, sizeof sql, OLD, 2); /* one of version 1 goes on */
    run_sql(&two, sql);
    CHECK(postgresql_run(two.p.database, "SELECT right(id, 1)::int FROM uzawa.claim('old', 'o', 30, false)", &number));
    CHECK_INT((int)number, 1);
    CHECK(two.b && claim_next(two.b).job[31] == '2');
    /* its role may use what is new, as far as functions that it calls do */
    CHECK(postgresql_run(two.p.database, "SELECT has_table_privilege('old_daemon', 'uzawa.holding', 'UPDATE')::int",
                         &number));
    CHECK_INT((int)number, 1);
    run_sql(&two, "DROP OWNED BY old_daemon; DROP ROLE old_daemon");
    free(script);
    pair_end(&two);
}
