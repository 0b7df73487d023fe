/* What the store keeps of load cases and of jobs that refine others. */
#include "store/engine_base.h"
#include "store_place.h"

/* ---- cases */

STORE_TEST(each_case_has_its_own_answer)
{
    place p;
    char id[33];
    store_case *cases = NULL;
    double *x = NULL;
    int64_t n = 0, columns = 0;
    size_t count = 0;
    if (!place_begin(&p))
        return;
    finish_cases(&p, id, 3);
    CHECK_INT(store_get_cases(p.s, id, NULL, &cases, &count), STORE_OK);
    CHECK_INT(count, 3);
    for (size_t i = 0; i < count; i++) {
        CHECK_INT(cases[i].number, i + 1);
        CHECK(cases[i].name[0] == 'c' && cases[i].name[1] == (char)('0' + i));
        CHECK_STR(cases[i].summary, "{\"outcome\": \"converged\"}");
        CHECK_INT(store_get_vector(p.s, id, cases[i].number, "reactions", &x, &n), STORE_OK);
        CHECK(n == 2 && x[0] == (double)i && x[1] == (double)i + 1);
        free(x);
        CHECK_INT(store_get_history(p.s, id, cases[i].number, -1, &x, &n, &columns), STORE_OK);
        CHECK(n == 1 && columns == 12 && x[3] == 100.0 * (double)i + 3);
        free(x);
    }
    store_cases_free(cases, count);
    CHECK_INT(store_get_vector(p.s, id, 0, "nodes", &x, &n), STORE_OK);
    CHECK(n == 3 && x[2] == 9);
    free(x);
    CHECK_INT(store_get_vector(p.s, id, 0, "reactions", &x, &n), STORE_NOT_FOUND);
    CHECK_INT(store_get_history(p.s, id, 0, -1, &x, &n, &columns), STORE_NOT_FOUND);
    CHECK_INT(store_count_vectors(p.s, id, "reactions", &n), STORE_OK);
    CHECK_INT(n, 6);
    place_end(&p);
}

STORE_TEST(a_case_is_found_by_its_name)
{
    place p;
    char id[33], plain[33];
    store_case *cases = NULL;
    size_t count = 0;
    if (!place_begin(&p))
        return;
    finish_cases(&p, id, 3);
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, plain), STORE_OK);
    CHECK_INT(store_get_cases(p.s, id, "c1", &cases, &count), STORE_OK);
    CHECK(count == 1 && cases[0].number == 2);
    store_cases_free(cases, count);
    CHECK_INT(store_get_cases(p.s, id, "C1", &cases, &count), STORE_OK);
    CHECK(count == 0 && !cases);
    CHECK_INT(store_get_cases(p.s, plain, NULL, &cases, &count), STORE_OK);
    CHECK(count == 0 && !cases);
    place_end(&p);
}

/* Two cases of one name break the uniqueness in the middle of the transaction: nothing of it may stay. */
STORE_TEST(a_finish_that_fails_in_a_case_leaves_nothing)
{
    place p;
    char id[33], other[33];
    double x = 1.0;
    store_vector v = {"reactions", 1, &x};
    store_answer twice[2] = {{"same", "{}", &v, 1, NULL, 0, 0}, {"same", "{}", &v, 1, NULL, 0, 0}};
    store_outcome outcome = {.status = JOB_SUCCESSFUL, .whole = {.summary = "{}"}, .cases = twice, .n_cases = 2};
    store_case *cases = NULL;
    size_t count = 0;
    double *got = NULL;
    int64_t n = 0;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{}", "[]", NULL, id), STORE_OK);
    CHECK_INT(claim_id(p.s, "me", other), STORE_OK);
    CHECK_INT(finish_as(p.s, id, "me", &outcome), STORE_ERROR);
    CHECK_INT(status_of(p.s, id), JOB_RUNNING);
    CHECK_INT(store_get_cases(p.s, id, NULL, &cases, &count), STORE_OK);
    CHECK(count == 0 && !cases);
    CHECK_INT(store_get_vector(p.s, id, 1, "reactions", &got, &n), STORE_NOT_FOUND);
    CHECK_INT(finish_as(p.s, id, "me", &PLAIN_SUCCESS), STORE_OK);
    place_end(&p);
}

/* ---- refines, body */

STORE_TEST(a_refining_job_outlives_the_one_it_refines)
{
    place p;
    char old[33], id[33], *body = NULL;
    size_t len = 0;
    job j = {0};
    bool repeated = false;
    job_status was;
    if (!place_begin(&p))
        return;
    CHECK_INT(submit_text(p.s, "{\"old\": 1}", "[]", NULL, old), STORE_OK);
    store_request request = {.body = "{\"new\": 1}", .body_len = 10, .refines = old};
    CHECK_INT(store_submit(p.s, &request, &j, &repeated), STORE_OK);
    CHECK_STR(j.refines, old);
    CHECK_STR(j.tags, "[]");
    strcpy(id, j.id);
    job_clear(&j);
    CHECK_INT(store_get_body(p.s, old, &body, &len), STORE_OK);
    CHECK(len == 10 && body && memcmp(body, "{\"old\": 1}", 11) == 0);
    free(body);
    CHECK_INT(store_dismiss(p.s, old, &was), STORE_OK); /* dismissed */
    CHECK_INT(store_dismiss(p.s, old, &was), STORE_OK); /* deleted */
    CHECK_INT(store_get_body(p.s, old, &body, &len), STORE_NOT_FOUND);
    CHECK(!body && len == 0);
    CHECK_INT(store_get(p.s, id, &j), STORE_OK);
    CHECK_STR(j.refines, old);
    job_clear(&j);
    place_end(&p);
}
