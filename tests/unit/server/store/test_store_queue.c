/* The queue of the store and those who work on it: order, recovery, expiry, retention, webhooks, many threads. */
#include "store/engine_base.h"
#include "sanitized.h"
#include "sqlite_file.h"
#include "store_place.h"

#include <pthread.h>
#include <time.h>

static void sleep_s(double seconds)
{
    struct timespec t = {.tv_sec = (time_t)seconds};
    t.tv_nsec = (long)(1e9 * (seconds - (double)t.tv_sec));
    nanosleep(&t, NULL);
}

static void submit_with(store *s, store_request request, char id[33])
{
    job j = {0};
    bool repeated;
    request.body = "{}";
    request.body_len = 2;
    CHECK_INT(store_submit(s, &request, &j, &repeated), STORE_OK);
    strcpy(id, j.id);
    job_clear(&j);
}

STORE_TEST(counts_follow_every_change)
{
    place p;
    char ids[5][33], claimed[33];
    job_status was;
    if (!place_begin(&p))
        return;
    check_counts(p.s, 0, 0, 0, 0, 0);
    for (int i = 0; i < 5; i++)
        CHECK_INT(submit_text(p.s, "{}", "[\"a\"]", NULL, ids[i]), STORE_OK);
    check_counts(p.s, 5, 0, 0, 0, 0);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_INT(finish_as(p.s, claimed, "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    check_counts(p.s, 3, 1, 1, 0, 0);
    CHECK_INT(release_as(p.s, claimed, "me"), STORE_OK);
    CHECK_INT(store_dismiss(p.s, ids[4], &was), STORE_OK);
    check_counts(p.s, 3, 0, 1, 0, 1);
    CHECK_INT(store_dismiss(p.s, ids[0], &was), STORE_OK); /* ended: deleted */
    check_counts(p.s, 3, 0, 0, 0, 1);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    if (place_reopen(&p)) {
        CHECK_INT(store_recover(p.s, 1, "{}", NULL, NULL), STORE_OK);
        check_counts(p.s, 2, 0, 0, 1, 1);
    }
    place_end(&p);
}

STORE_TEST(priorities_go_before_age)
{
    static const int PRIORITIES[] = {0, 10, -10, 10, 3};
    static const int ORDER[] = {1, 3, 4, 0, 2};
    place p;
    char id[5][33], claimed[33];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 5; i++)
        submit_with(p.s, (store_request){.priority = PRIORITIES[i]}, id[i]);
    for (int i = 0; i < 5; i++) {
        CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
        CHECK_STR(claimed, id[ORDER[i]]);
    }
    place_end(&p);
}

/* ---- shares */

/* Who runs next, by the name of the share; "" when nobody waits. */
static void claim_share(store *s, bool small, char (*ids)[33], char *out)
{
    job j = {0};
    char *body = NULL;
    size_t len = 0;
    store_lease lease;
    out[0] = '\0';
    if (store_claim(s, "me", 30.0, small, &lease, &j, &body, &len) == STORE_OK)
        leases_held[leases_given++ % 64] = lease;
    for (int i = 0; j.id[0] && i < 26; i++)
        if (strcmp(ids[i], j.id) == 0)
            out[0] = (char)('a' + i);
    out[1] = '\0';
    job_clear(&j);
    free(body);
}

static void check_next(store *s, bool small, char (*ids)[33], const char *who)
{
    char out[2];
    claim_share(s, small, ids, out);
    CHECK_STR(out, who);
}

/* One that comes goes before those of whom something runs, and at the next turn before those who have had more. */
STORE_TEST(who_has_had_least_goes_first)
{
    static const char *const SHARES[] = {"many", "many", "many", "many", "one", "other"};
    place p;
    char id[26][33] = {""};
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 4; i++)
        submit_with(p.s, (store_request){.share = SHARES[i]}, id[i]);
    check_next(p.s, false, id, "a");
    submit_with(p.s, (store_request){.share = SHARES[4]}, id[4]);
    check_next(p.s, false, id, "e");
    sleep_s(0.05);
    CHECK_INT(finish_as(p.s, id[0], "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(finish_as(p.s, id[4], "me", &PLAIN_SUCCESS), STORE_OK);
    if (!place_reopen(&p))
        return;
    /* "one" comes again, with less time than "many" has had, and "other" begins where the least stands. */
    submit_with(p.s, (store_request){.share = SHARES[4]}, id[5]);
    submit_with(p.s, (store_request){.share = SHARES[5]}, id[6]);
    char first[2], second[2], third[2];
    claim_share(p.s, false, id, first);
    claim_share(p.s, false, id, second);
    claim_share(p.s, false, id, third);
    CHECK_MSG((first[0] == 'f' || second[0] == 'f' || third[0] == 'f') &&
                  (first[0] == 'g' || second[0] == 'g' || third[0] == 'g') &&
                  (first[0] == 'b' || second[0] == 'b' || third[0] == 'b'),
              "each of three has one of three turns: %s%s%s", first, second, third);
    check_next(p.s, false, id, "c"); /* in their order of age */
    check_counts(p.s, 1, 4, 2, 0, 0);
    place_end(&p);
}

/* What one has used does not count for ever against it, nor what it has not used for it. */
STORE_TEST(there_is_no_credit_for_the_time_before)
{
    place p;
    char id[26][33] = {""}, who[2];
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 2; i++) { /* "old" works alone */
        submit_with(p.s, (store_request){.share = "old"}, id[i]);
        claim_share(p.s, false, id, who);
        sleep_s(0.1);
        CHECK_INT(finish_as(p.s, id[i], "me", &PLAIN_SUCCESS), STORE_OK);
    }
    for (int i = 2; i < 6; i++) /* now both at once: by turns, however long "old" worked */
        submit_with(p.s, (store_request){.share = i < 4 ? "old" : "new"}, id[i]);
    int of_old = 0;
    for (int i = 0; i < 2; i++) {
        claim_share(p.s, false, id, who);
        of_old += who[0] == 'c';
    }
    CHECK_INT(of_old, 1);
    place_end(&p);
}

/* A lane puts back what took too long, and what died runs again: that time has been had, too. "b" has both of its turns
 * in less than that; on a machine that is busy with others they may last longer, and "a" is to have had more. */
STORE_TEST(a_run_that_is_put_back_was_a_turn)
{
    bool shorter = false;
    for (double held = 0.05; !shorter && held < 10; held *= 4) {
        place p;
        char id[26][33] = {""}, who[2];
        if (!place_begin(&p))
            return;
        for (int i = 0; i < 4; i++)
            submit_with(p.s, (store_request){.share = i % 2 ? "b" : "a", .small = true}, id[i]);
        check_next(p.s, true, id, "a");
        sleep_s(held);
        CHECK_INT(release_as(p.s, id[0], "me"), STORE_OK);
        const double begun = clock_seconds(CLOCK_MONOTONIC);
        check_next(p.s, true, id, "b");
        CHECK_INT(finish_as(p.s, id[1], "me", &PLAIN_SUCCESS), STORE_OK);
        shorter = clock_seconds(CLOCK_MONOTONIC) - begun < held;
        claim_share(p.s, true, id, who);
        CHECK(!shorter || strcmp(who, "d") == 0);
        check_counts(p.s, 2, 1, 1, 0, 0);
        place_end(&p);
    }
    CHECK(shorter);
}

/* A job that runs for hours has had them before it ends: else one that comes would begin where its share stood then,
 * and have all the time of the other workers that others have had since. */
STORE_TEST(who_still_runs_has_had_that_time)
{
    place p;
    char id[26][33] = {""}, who[2];
    int of_busy = 0;
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.share = "at work"}, id[0]);
    submit_with(p.s, (store_request){.share = "busy"}, id[1]);
    claim_share(p.s, false, id, who); /* "at work" first, and it is counted last: it has had no less than "busy" */
    claim_share(p.s, false, id, who);
    sleep_s(0.1);
    CHECK_INT(finish_as(p.s, id[1], "me", &PLAIN_SUCCESS), STORE_OK);
    CHECK_INT(renew_as(p.s, id[0], "me", 50), STORE_OK);
    for (int i = 2; i < 8; i++)
        submit_with(p.s, (store_request){.share = i < 5 ? "busy" : "new"}, id[i]);
    for (int i = 0; i < 3; i++) {
        claim_share(p.s, false, id, who);
        of_busy += who[0] < 'f';
        CHECK_INT(finish_as(p.s, id[who[0] - 'a'], "me", &PLAIN_SUCCESS), STORE_OK);
    }
    CHECK_MSG(of_busy >= 1 && of_busy <= 2, "%d of 3 turns", of_busy);
    place_end(&p);
}

/* A day more or less on the clock is no day that somebody has had. */
TEST(a_clock_that_is_set_moves_no_turn)
{
    for (int back = 0; back < 2; back++) {
        place p;
        char id[26][33] = {""}, who[2];
        if (!place_begin(&p))
            return;
        submit_with(p.s, (store_request){.share = "a"}, id[0]);
        claim_share(p.s, false, id, who);
        submit_with(p.s, (store_request){.share = "b"}, id[1]);
        change_file(p.path, back ? "UPDATE job SET started = started + 86400, lease = lease + 86400 WHERE status = 1"
                                 : "UPDATE job SET started = started - 86400, lease = lease - 86400 WHERE status = 1");
        CHECK_INT(renew_as(p.s, id[0], "me", 50), STORE_OK);
        CHECK_INT(finish_as(p.s, id[0], "me", &PLAIN_SUCCESS), STORE_OK);
        CHECK_INT(rows_in(p.path, "share WHERE used BETWEEN 0 AND 31"), 2);
        place_end(&p);
    }
}

/* Those ahead of the others have the workers to themselves, and by turns. */
STORE_TEST(those_ahead_have_turns_among_themselves)
{
    place p;
    char id[26][33] = {""}, who[2];
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.share = "waits"}, id[0]);
    for (int i = 1; i < 4; i++)
        submit_with(p.s, (store_request){.share = "old", .priority = 10}, id[i]);
    claim_share(p.s, false, id, who);
    sleep_s(0.1);
    CHECK_INT(finish_as(p.s, id[1], "me", &PLAIN_SUCCESS), STORE_OK);
    for (int i = 4; i < 8; i++)
        submit_with(p.s, (store_request){.share = "young", .priority = 10}, id[i]);
    int of_old = 0;
    for (int i = 0; i < 4; i++) {
        claim_share(p.s, false, id, who);
        of_old += who[0] < 'e';
        CHECK_INT(finish_as(p.s, id[who[0] - 'a'], "me", &PLAIN_SUCCESS), STORE_OK);
    }
    CHECK_MSG(of_old >= 1 && of_old <= 3, "%d of 4 turns", of_old);
    place_end(&p);
}

STORE_TEST(what_goes_before_all_shares)
{
    place p;
    char id[26][33] = {""}, who[2];
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.share = "x", .priority = 5}, id[0]);
    submit_with(p.s, (store_request){.share = "y", .priority = -10}, id[1]);
    submit_with(p.s, (store_request){.share = "x", .priority = 6}, id[2]);
    submit_with(p.s, (store_request){.share = "x", .priority = 7}, id[3]);
    static const char *const ORDER[] = {"d", "c"};
    for (int i = 0; i < 2; i++)
        check_next(p.s, false, id, ORDER[i]);
    char other[2];
    claim_share(p.s, false, id, who);
    claim_share(p.s, false, id, other);
    CHECK((who[0] == 'a' && other[0] == 'b') || (who[0] == 'b' && other[0] == 'a'));
    place_end(&p);
}

STORE_TEST(small_jobs_by_themselves)
{
    place p;
    char id[26][33] = {""};
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.share = "x", .priority = 3}, id[0]);
    submit_with(p.s, (store_request){.share = "x", .small = true}, id[1]);
    submit_with(p.s, (store_request){.share = "x", .small = true, .priority = 1}, id[2]);
    check_next(p.s, true, id, "c");
    CHECK_INT(release_as(p.s, id[2], "me"), STORE_OK); /* it was not small */
    check_next(p.s, true, id, "b");
    check_next(p.s, true, id, "");
    check_next(p.s, false, id, "a");
    check_next(p.s, false, id, "c");
    check_counts(p.s, 0, 3, 0, 0, 0);
    place_end(&p);
}

STORE_TEST(a_share_whose_jobs_are_all_too_late_is_passed_over)
{
    place p;
    char id[26][33] = {""};
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.share = "a", .queue_limit_s = 0.01}, id[0]);
    submit_with(p.s, (store_request){.share = "b"}, id[1]);
    sleep_s(0.05);
    check_next(p.s, false, id, "b");
    check_next(p.s, false, id, "");
    place_end(&p);
}

/* However many wait: 20,000 jobs of one, and as many clients as that. */
TEST(a_claim_is_as_quick_in_a_long_queue)
{
    place p;
    char id[33];
    double seconds[2];
    if (!place_begin(&p))
        return;
    for (int round = 0; round < 2; round++) {
        CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
        if (round == 1)
            change_file(p.path, "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 20000)"
                                " INSERT INTO job(id, status, created, tags, share)"
                                " SELECT printf('%032x', i), 0, 1.0, '[]', CASE WHEN i % 2 THEN 'm' ELSE i END FROM n;"
                                "INSERT INTO request(job, body) SELECT id, x'7b7d' FROM job WHERE created = 1.0;");
        const double begun = clock_seconds(CLOCK_PROCESS_CPUTIME_ID); /* whatever else the machine does */
        for (int i = 0; i < 200; i++) {
            CHECK_INT(claim_id(p.s, "me", id), STORE_OK);
            CHECK_INT(round == 1 ? finish_as(p.s, id, "me", &PLAIN_SUCCESS) : release_as(p.s, id, "me"), STORE_OK);
        }
        seconds[round] = clock_seconds(CLOCK_PROCESS_CPUTIME_ID) - begun;
    }
    CHECK_MSG(seconds[1] < 20 * seconds[0] + 0.2, "%g s, %g s in a long queue", seconds[0], seconds[1]);
    place_end(&p);
}

STORE_TEST(a_full_queue)
{
    place p;
    char id[33], claimed[33];
    job j = {0};
    bool repeated;
    if (!place_begin(&p))
        return;
    p.s->settings = (store_settings){.max_queue = 2};
    submit_with(p.s, (store_request){.priority = 0}, id);
    submit_with(p.s, (store_request){.idempotency_key = "k"}, id);
    store_request request = {.body = "{}", .body_len = 2};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_BUSY);
    request.idempotency_key = "k";
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    CHECK(repeated);
    job_clear(&j);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    submit_with(p.s, (store_request){.priority = 0}, id);
    place_end(&p);
}

/* ---- recovery */

STORE_TEST(recover_ends_a_job_that_was_dismissed_while_it_ran)
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

STORE_TEST(recover_fails_a_job_that_used_up_its_attempts)
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

/* ---- expiry and retention */

STORE_TEST(a_job_that_ran_once_has_no_queue_limit)
{
    place p;
    char id[33], claimed[33], other[33];
    int64_t count;
    if (!place_begin(&p))
        return;
    submit_with(p.s, (store_request){.queue_limit_s = 3}, id); /* till then it is claimed, on any machine */
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_INT(release_as(p.s, claimed, "me"), STORE_OK);
    submit_with(p.s, (store_request){.queue_limit_s = 0.2}, other);
    sleep_s(3.1);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_OK);
    CHECK_STR(claimed, id);
    CHECK_INT(claim_id(p.s, "me", claimed), STORE_NOT_FOUND); /* too late, though nobody has said so yet */
    CHECK_INT(store_expire(p.s, "{\"code\": \"late\"}", &count), STORE_OK);
    CHECK_INT(count, 1);
    CHECK_INT(status_of(p.s, other), JOB_FAILED);
    CHECK_INT(store_expire(p.s, "{}", &count), STORE_OK);
    CHECK_INT(count, 0);
    place_end(&p);
}

static void end_jobs(store *s, int n, const char *webhook)
{
    char id[33];
    for (int i = 0; i < n; i++) {
        submit_with(s, (store_request){.webhook = webhook}, id);
        CHECK_INT(claim_id(s, "me", id), STORE_OK);
        CHECK_INT(finish_as(s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    }
}

STORE_TEST(retention_goes_in_small_steps)
{
    place p;
    int64_t count, total = 0;
    int rounds = 0;
    if (!place_begin(&p))
        return;
    end_jobs(p.s, 50, NULL);
    do {
        CHECK_INT(store_retain(p.s, &(store_retention){.keep_jobs = 5}, &count), STORE_OK);
        CHECK(count <= 20);
        total += count;
        rounds++;
    } while (count > 0 && rounds < 10);
    CHECK_INT(total, 45);
    CHECK_INT(rounds, 4);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_bytes = 6}, &count), STORE_OK); /* a body has 2 */
    CHECK_INT(count, 2);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1000}, &count), STORE_OK);
    CHECK_INT(count, 0);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 3);
    place_end(&p);
}

/* What only begins like a place is another one. */
STORE_TEST(whom_one_tells_nobody_else_tells)
{
    static const char *const URLS[] = {"http://10.0.0.15/a", "http://10.0.0.1:80/a", "http://10.0.0.1/a",
                                       "HTTP://10.0.0.1"};
    const char *except[] = {"http://10.0.0.1"};
    place p;
    webhook_due due;
    if (!place_begin(&p))
        return;
    for (int i = 0; i < 4; i++) {
        end_jobs(p.s, 1, URLS[i]);
        if (i >= 2)
            CHECK_INT(store_webhook_next(p.s, except, 1, &due), STORE_NOT_FOUND);
        CHECK_INT(store_webhook_next(p.s, i < 2 ? except : NULL, i < 2, &due), STORE_OK);
        CHECK_STR(due.url, URLS[i]);
        free(due.url);
        CHECK_INT(store_webhook_attempted(p.s, &due, WEBHOOK_TOLD, 0, 0), STORE_OK);
    }
    place_end(&p);
}

STORE_TEST(a_job_stays_until_somebody_was_told)
{
    place p;
    webhook_due due;
    int64_t count;
    bool any = true;
    if (!place_begin(&p))
        return;
    CHECK_INT(store_webhook_next(p.s, NULL, 0, &due), STORE_NOT_FOUND);
    end_jobs(p.s, 1, "http://x/");
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 0);
    place_reopen(&p);
    CHECK_INT(store_webhook_next(p.s, NULL, 0, &due), STORE_OK);
    CHECK_STR(due.url, "http://x/");
    CHECK_INT(due.attempts, 0);
    CHECK_INT(store_webhook_attempted(p.s, &due, WEBHOOK_AGAIN, 3, 0), STORE_OK);
    free(due.url);
    CHECK_INT(store_webhook_next(p.s, NULL, 0, &due), STORE_NOT_FOUND); /* not yet */
    sleep_s(3.1);
    CHECK_INT(store_webhook_next(p.s, NULL, 0, &due), STORE_OK);
    CHECK_INT(due.attempts, 1);
    /* nobody answers there: what else is due at that address waits too, and nothing at another one does */
    static const char *const NEXT[] = {"http://y/", "http://x/"};
    end_jobs(p.s, 1, NEXT[1]);
    end_jobs(p.s, 1, NEXT[0]);
    CHECK_INT(store_webhook_attempted(p.s, &due, WEBHOOK_AGAIN, 1000, 3), STORE_OK);
    for (int i = 0; i < 2; i++) {
        webhook_due other;
        CHECK_INT(store_webhook_next(p.s, NULL, 0, &other), STORE_OK);
        CHECK_STR(other.url, NEXT[i]);
        CHECK_INT(store_webhook_attempted(p.s, &other, WEBHOOK_TOLD, 0, 0), STORE_OK);
        free(other.url);
        CHECK_INT(store_webhook_next(p.s, NULL, 0, &other), STORE_NOT_FOUND);
        sleep_s(i == 0 ? 3.1 : 0);
    }
    CHECK_INT(store_webhook_attempted(p.s, &due, WEBHOOK_TOLD, 0, 0), STORE_OK);
    free(due.url);
    CHECK_INT(store_webhook_next(p.s, NULL, 0, &due), STORE_NOT_FOUND);
    CHECK_INT(store_retain(p.s, &(store_retention){.keep_s = 1e-9}, &count), STORE_OK);
    CHECK_INT(count, 3);
    CHECK_INT(store_webhooks_open(p.s, &any), STORE_OK);
    CHECK(!any);
    place_end(&p);
}

/* ---- sizes */

STORE_TEST(large_bodies)
{
    place p;
    size_t size = (SANITIZED ? 8u : 64u) << 20, len;
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
        CHECK_INT(store_claim(p.s, "a", 1, false, &(store_lease){.token = 0}, &j, &back, &len), STORE_OK);
        CHECK(len == size && memcmp(back, body, size) == 0 && back[len] == '\0');
        job_clear(&j);
        free(back);
        place_end(&p);
    }
    free(body);
}

/* ---- threads */

#define RACE_JOBS 200

typedef struct {
    store *s;
    const char *owner;
    char ids[RACE_JOBS + 1][33]; /* the last claim finds nothing */
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
        r->problems += renew_as(r->s, r->ids[r->count], r->owner, 50) != STORE_OK;
        r->problems += finish_as(r->s, r->ids[r->count], r->owner, &PLAIN_SUCCESS) != STORE_OK;
        r->count++;
    }
}

static int compare_ids(const void *a, const void *b)
{
    return strcmp(a, b);
}

STORE_TEST(each_job_is_claimed_once)
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
    int64_t counts[STORE_COUNTS];
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

STORE_TEST(concurrent_repeats_make_one_job_each)
{
    place p;
    pthread_t threads[6];
    repeater repeaters[6];
    int64_t counts[STORE_COUNTS];
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
