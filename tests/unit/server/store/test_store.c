/* What the store keeps and who may change it: jobs, claims, idempotency keys, results, lists. */
#include "store/engine_base.h"
#include "store_place.h"

/* ---- submit, claim, finish */

TEST(status_names)
{
    CHECK_STR(job_status_name(JOB_DISMISSED), "dismissed");
    CHECK_STR(job_status_name((job_status)77), "unknown");
}

STORE_TEST(submit_claim_finish)
{
    place p;
    job j = {0};
    bool repeated = true;
    store_lease lease;
    char *body = NULL;
    size_t len = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(
        store_submit(p.s, &(store_request){.body = "{\"a\": 1}", .body_len = 8, .tags = "[\"demo\"]"}, &j, &repeated),
        STORE_OK);
    CHECK(!repeated && strlen(j.id) == 32 && j.status == JOB_ACCEPTED && j.attempts == 0 && j.created > 1e9);
    CHECK(j.started == 0 && j.finished == 0 && !j.summary && !j.error);
    CHECK_STR(j.tags, "[\"demo\"]");
    job_clear(&j);
    CHECK_INT(store_claim(p.s, "me", 30.0, false, &lease, &j, &body, &len), STORE_OK);
    CHECK_STR(lease.job, j.id);
    CHECK_STR(lease.owner, "me");
    CHECK(j.status == JOB_RUNNING && j.attempts == 1 && j.started >= j.created);
    CHECK(len == 8 && body && strcmp(body, "{\"a\": 1}") == 0);
    free(body);
    CHECK_INT(store_renew(p.s, &lease, 42, NULL), STORE_OK);
    CHECK_INT(store_finish(p.s, &lease, &PLAIN_SUCCESS, NULL), STORE_OK);
    char id[33];
    strcpy(id, j.id);
    job_clear(&j);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_SUCCESSFUL && j.progress == 100 && j.finished >= j.started && !j.error);
    CHECK_STR(j.summary, PLAIN_SUCCESS.whole.summary);
    job_clear(&j);
    CHECK_INT(store_claim(p.s, "me", 30.0, false, &lease, &j, &body, &len), STORE_NOT_FOUND);
    CHECK(!lease.job[0] && !body && len == 0 && !j.tags);
    place_end(&p);
}

STORE_TEST(only_the_owner_of_a_running_job_may_change_it)
{
    place p;
    char id[33], other[33];
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "a", &PLAIN_SUCCESS), STORE_CONFLICT); /* not running yet */
    CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
    CHECK_STR(other, id);
    CHECK_INT(renew_as(p.s, id, "b", 1), STORE_CONFLICT);
    CHECK_INT(release_as(p.s, id, "b"), STORE_CONFLICT);
    CHECK_INT(finish_as(p.s, id, "b", &PLAIN_SUCCESS), STORE_CONFLICT);
    CHECK_INT(status_of(p.s, id), JOB_RUNNING);
    store_outcome no_end = {.status = JOB_RUNNING};
    CHECK_INT(finish_as(p.s, id, "a", &no_end), STORE_ERROR);
    double x = 1.0;
    store_vector v = {"reactions", 1, &x};
    store_outcome late = {.status = JOB_FAILED, .error = "{}", .whole.vectors = &v, .whole.n_vectors = 1};
    CHECK_INT(finish_as(p.s, id, "a", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "a", &late), STORE_CONFLICT); /* one result for each job */
    double *data;
    int64_t count;
    CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &data, &count), STORE_NOT_FOUND);
    CHECK_INT(status_of(p.s, id), JOB_SUCCESSFUL);
    const char *nobody = "ffffffffffffffffffffffffffffffff";
    CHECK_INT(finish_as(p.s, nobody, "a", &PLAIN_SUCCESS), STORE_NOT_FOUND);
    CHECK_INT(renew_as(p.s, nobody, "a", 1), STORE_NOT_FOUND);
    CHECK_INT(release_as(p.s, nobody, "a"), STORE_NOT_FOUND);
    place_end(&p);
}

/* The same owner claims the job a second time: what it does with the first lease comes too late. */
STORE_TEST(an_earlier_lease_is_fenced_off)
{
    place p;
    char id[33];
    store_lease first, second;
    job j = {0};
    char *body = NULL;
    size_t len = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(store_claim(p.s, "a", 0.0, false, &first, &j, &body, &len), STORE_OK);
    job_clear(&j);
    free(body);
    CHECK_INT(store_renew(p.s, &first, 10, NULL), STORE_OK); /* it has run out, but nobody else has the job */
    CHECK_INT(store_release(p.s, &first, false), STORE_OK);
    CHECK_INT(store_renew(p.s, &first, 20, NULL), STORE_CONFLICT);
    CHECK_INT(store_claim(p.s, "a", 30.0, false, &second, &j, &body, &len), STORE_OK);
    job_clear(&j);
    free(body);
    CHECK_STR(second.job, first.job);
    CHECK(second.token != first.token);
    CHECK_INT(store_renew(p.s, &first, 30, NULL), STORE_CONFLICT);
    CHECK_INT(store_finish(p.s, &first, &PLAIN_SUCCESS, NULL), STORE_CONFLICT);
    CHECK_INT(store_release(p.s, &first, false), STORE_CONFLICT);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_RUNNING && j.progress == 0);
    job_clear(&j);
    CHECK_INT(store_finish(p.s, &second, &PLAIN_SUCCESS, NULL), STORE_OK);
    place_end(&p);
}

/* The process that had the lease is gone, and its successor goes by the same name. */
STORE_TEST(a_lease_ends_with_its_process)
{
    place p;
    char id[33];
    store_lease leases[2];
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    for (int i = 0; i < 2; i++) {
        job j = {0};
        char *body = NULL;
        size_t len = 0;
        CHECK_INT(store_claim(p.s, "a", 30.0, false, &leases[i], &j, &body, &len), STORE_OK);
        CHECK_STR(leases[i].job, id);
        job_clear(&j);
        free(body);
        if (i == 0 && !place_reopen(&p))
            return;
        if (i == 0)
            CHECK_INT(store_recover(p.s, 3, "{}", NULL, NULL), STORE_OK);
    }
    CHECK_INT(store_renew(p.s, &leases[0], 50, NULL), STORE_CONFLICT);
    CHECK_INT(store_finish(p.s, &leases[0], &PLAIN_SUCCESS, NULL), STORE_CONFLICT);
    CHECK_INT(store_finish(p.s, &leases[1], &PLAIN_SUCCESS, NULL), STORE_OK);
    place_end(&p);
}

STORE_TEST(release_does_not_count_the_attempt)
{
    place p;
    char id[33], again[33];
    job j = {0};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", again), STORE_OK);
    CHECK_INT(release_as(p.s, id, "a"), STORE_OK);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_ACCEPTED && j.attempts == 0 && j.started == 0 && j.progress == 0);
    job_clear(&j);
    CHECK_INT(claim_id(p.s, "b", again), STORE_OK);
    CHECK_STR(again, id);
    place_end(&p);
}

STORE_TEST(ids_sort_by_creation_and_go_on_after_a_restart)
{
    place p;
    char last[33] = "", id[33];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 60; i++) {
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_MSG(strcmp(id, last) > 0, "%s after %s", id, last);
        CHECK_INT(strspn(id, "0123456789abcdef"), 32);
        strcpy(last, id);
        if (i % 20 == 19 && !place_reopen(&p))
            return;
    }
    for (int i = 0; i < 60; i++) { /* oldest first */
        CHECK_INT(claim_id(p.s, "a", id), STORE_OK);
        CHECK(i == 0 || strcmp(id, last) > 0);
        strcpy(last, id);
    }
    place_end(&p);
}

/* ---- idempotency */

STORE_TEST(idempotency_key)
{
    place p;
    job first = {0}, second = {0};
    bool repeated = false;
    char id[33];
    job_status was;
    if (!place_begin(&p))
        return;
    CHECK_INT(store_submit(
                  p.s, &(store_request){.body = "{\"a\": 1}", .body_len = 8, .tags = "[]", .idempotency_key = "key-1"},
                  &first, &repeated),
              STORE_OK);
    CHECK(!repeated);
    CHECK_INT(store_submit(
                  p.s, &(store_request){.body = "{\"a\": 1}", .body_len = 8, .tags = "[]", .idempotency_key = "key-1"},
                  &second, &repeated),
              STORE_OK);
    CHECK(repeated);
    CHECK_STR(second.id, first.id);
    job_clear(&second);
    CHECK_INT(store_submit(
                  p.s, &(store_request){.body = "{\"a\": 2}", .body_len = 8, .tags = "[]", .idempotency_key = "key-1"},
                  &second, &repeated),
              STORE_CONFLICT);
    CHECK(!repeated && !second.tags && !second.id[0]);
    CHECK_INT(submit_text(p.s, "{\"a\": 1} ", "[]", "key-1", id), STORE_CONFLICT); /* a longer body */
    store_request request = {.body = "{\"a\": 1}", .body_len = 8, .idempotency_key = "key-1"};
    CHECK_INT(store_find_repeat(p.s, &request, &second), STORE_OK);
    CHECK_STR(second.id, first.id);
    job_clear(&second);
    request.body_len = 7;
    CHECK_INT(store_find_repeat(p.s, &request, &second), STORE_CONFLICT);
    CHECK(!second.tags && !second.id[0]);
    request.idempotency_key = "key-0";
    CHECK_INT(store_find_repeat(p.s, &request, &second), STORE_NOT_FOUND);
    CHECK_INT(submit_text(p.s, "{\"a\": 2}", "[]", "key-2", id), STORE_OK); /* another key */
    CHECK(place_reopen(&p));
    CHECK_INT(submit_text(p.s, "{\"a\": 1}", "[]", "key-1", id), STORE_OK);
    CHECK_STR(id, first.id);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(submit_text(p.s, "{\"a\": 3}", "[]", "key-1", id), STORE_OK); /* the key went with the job */
    CHECK(strcmp(id, first.id) != 0);
    job_clear(&first);
    place_end(&p);
}

/* ---- results and histories */

static double *ramp(int64_t count)
{
    double *x = malloc((size_t)count * sizeof *x);
    for (int64_t i = 0; i < count; i++)
        x[i] = 0.1 * (double)i - 3.0;
    return x;
}

static void check_vector(store *s, const char *id, const char *name, const double *want, int64_t want_count)
{
    double *data = NULL;
    int64_t count = -1;
    CHECK_INT(store_get_vector(s, id, 0, name, &data, &count), STORE_OK);
    CHECK_INT(count, want_count);
    CHECK(data && (want_count == 0 || memcmp(data, want, (size_t)want_count * sizeof *want) == 0));
    free(data);
}

STORE_TEST(vectors_come_back_bit_for_bit)
{
    place p;
    char id[33], other[33];
    int64_t large = 300001; /* more than two parts */
    double *x = ramp(large);
    double odd[] = {0.0, -0.0, 5e-324, 1.7976931348623157e308, INFINITY, -INFINITY, NAN};
    store_vector v[] = {{"displacements", large, x}, {"odd", 7, odd}, {"empty", 0, NULL}, {"part", 131072, x}};
    store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole.summary = "{}", .whole.vectors = v, .whole.n_vectors = 4};
    if (place_begin(&p)) {
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
        CHECK_INT(finish_as(p.s, id, "a", &outcome), STORE_OK);
        CHECK(place_reopen(&p));
        check_vector(p.s, id, "displacements", x, large);
        check_vector(p.s, id, "odd", odd, 7);
        check_vector(p.s, id, "empty", NULL, 0);
        check_vector(p.s, id, "part", x, 131072);
        double *data;
        int64_t count, columns;
        CHECK_INT(store_get_vector(p.s, id, 0, "gaps", &data, &count), STORE_NOT_FOUND);
        CHECK(!data && count == 0);
        CHECK_INT(store_get_history(p.s, id, 0, -1, &data, &count, &columns), STORE_NOT_FOUND);
        place_end(&p);
    }
    free(x);
}

static void check_history(store *s, const char *id, int64_t after, int64_t want_count)
{
    double *rows = NULL;
    int64_t count = -1, columns = -1;
    CHECK_INT(store_get_history(s, id, 0, after, &rows, &count, &columns), STORE_OK);
    CHECK_INT(count, want_count);
    CHECK_INT(columns, 12);
    if (count > 0)
        CHECK(rows[0] == (double)(after + 1) && rows[(count - 1) * 12 + 11] == (double)(after + count) + 0.5);
    free(rows);
}

STORE_TEST(history_after_an_iteration)
{
    place p;
    char id[33], other[33];
    int64_t n = 25000; /* three parts */
    double *rows = calloc((size_t)n * 12, sizeof *rows);
    for (int64_t i = 0; i < n; i++) {
        rows[i * 12] = (double)i;
        rows[i * 12 + 11] = (double)i + 0.5;
    }
    store_outcome outcome = {
        .status = JOB_DISMISSED, .whole.history = rows, .whole.history_rows = n, .whole.history_columns = 12};
    if (place_begin(&p)) {
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
        CHECK_INT(finish_as(p.s, id, "a", &outcome), STORE_OK);
        check_history(p.s, id, -1, n);
        check_history(p.s, id, 0, n - 1);
        check_history(p.s, id, 10921, n - 10922); /* the end of a part */
        check_history(p.s, id, 10922, n - 10923);
        check_history(p.s, id, n - 2, 1);
        check_history(p.s, id, n - 1, 0);
        check_history(p.s, id, INT64_MAX, 0);
        place_end(&p);
    }
    free(rows);
}

/* ---- dismiss */

STORE_TEST(dismiss_by_state)
{
    place p;
    char id[33], other[33];
    job_status was = JOB_FAILED;
    job j = {0};
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(was, JOB_ACCEPTED);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_DISMISSED && j.finished > 0);
    job_clear(&j);
    CHECK_INT(claim_id(p.s, "a", other), STORE_NOT_FOUND); /* a dismissed job is not run */
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "a", other), STORE_OK);
    CHECK_INT(store_dismiss(p.s, id, &was), STORE_OK);
    CHECK_INT(was, JOB_RUNNING);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK(j.status == JOB_RUNNING && j.finished == 0); /* it ends when its run does */
    job_clear(&j);
    CHECK_INT(release_as(p.s, id, "a"), STORE_OK);
    CHECK_INT(status_of(p.s, id), JOB_DISMISSED); /* nobody runs it again */
    CHECK_INT(claim_id(p.s, "a", other), STORE_NOT_FOUND);
    place_end(&p);
}

/* ---- lists */

static size_t list_ids(store *s, store_query q, char ids[][33], bool *more)
{
    job *jobs = NULL;
    size_t count = 0;
    CHECK_INT(store_list(s, &q, &jobs, &count, more), STORE_OK);
    for (size_t i = 0; i < count; i++) {
        strcpy(ids[i], jobs[i].id);
        job_clear(&jobs[i]);
    }
    free(jobs);
    return count;
}

STORE_TEST(list_with_cursor_status_and_tag)
{
    place p;
    char id[10][33], got[10][33], claimed[33];
    bool more;
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 10; i++) {
        const char *tags = i % 3 == 0 ? "[\"red\", \"red\", \"a'b\"]" : "[\"blue\"]";
        CHECK_INT(submit_text(p.s, "{}", tags, NULL, id[i]), STORE_OK);
    }
    CHECK_INT(claim_id(p.s, "a", claimed), STORE_OK); /* id[0], red */
    CHECK_INT(list_ids(p.s, (store_query){.limit = 4}, got, &more), 4);
    CHECK(more);
    CHECK_STR(got[0], id[9]);
    CHECK_STR(got[3], id[6]);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 6, .before = got[3]}, got, &more), 6);
    CHECK(!more);
    CHECK_STR(got[5], id[0]);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 10, .tag = "red"}, got, &more), 4);
    CHECK_STR(got[0], id[9]);
    CHECK_STR(got[3], id[0]);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 2, .tag = "a'b", .before = id[9]}, got, &more), 2);
    CHECK(more);
    CHECK_STR(got[1], id[3]);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 10, .by_status = true, .status = JOB_RUNNING}, got, &more), 1);
    CHECK_STR(got[0], id[0]);
    store_query both = {.limit = 10, .by_status = true, .status = JOB_ACCEPTED, .tag = "red"};
    CHECK_INT(list_ids(p.s, both, got, &more), 3);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 10, .tag = "re"}, got, &more), 0);
    CHECK_INT(list_ids(p.s, (store_query){.limit = 0}, got, &more), 1); /* limits are clamped */
    int64_t counts[STORE_COUNTS];
    CHECK_INT(store_counts(p.s, counts), STORE_OK);
    CHECK(counts[JOB_ACCEPTED] == 9 && counts[JOB_RUNNING] == 1 && counts[JOB_SUCCESSFUL] == 0);
    place_end(&p);
}
