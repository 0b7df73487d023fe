/* Outcomes in one piece of memory: they come back as they were, and what is damaged is refused without harm. */
#include "harness.h"
#include "work/parcel.h"

#include <stdlib.h>
#include <string.h>

enum { N = 5 };

static store_outcome make(store_answer cases[2], store_vector vectors[2], const double *x)
{
    vectors[0] = (store_vector){"reactions", N, x};
    vectors[1] = (store_vector){"empty", 0, x};
    cases[0] = (store_answer){"a", "{\"a\": 1}", vectors, 2, x, 1, 4};
    cases[1] = (store_answer){.name = "b", .summary = "{}"};
    return (store_outcome){.status = JOB_SUCCESSFUL,
                           .whole = {.summary = "{\"whole\": true}", .vectors = vectors, .n_vectors = 1},
                           .cases = cases,
                           .n_cases = 2};
}

TEST(outcomes_come_back)
{
    const double x[N] = {1, -2, NAN, 4, 5};
    store_answer cases[2];
    store_vector vectors[2];
    parcel p;
    const store_outcome o = make(cases, vectors, x);
    const size_t size = parcel_write(NULL, &o);
    char *at = malloc(size);
    parcel_write(at, &o);
    CHECK(parcel_read(&p, at, size));
    CHECK(p.outcome.status == JOB_SUCCESSFUL && !p.outcome.error && p.outcome.n_cases == 2);
    CHECK_STR(p.outcome.whole.summary, "{\"whole\": true}");
    CHECK(!p.outcome.whole.name && !p.outcome.whole.history && p.outcome.whole.n_vectors == 1);
    const store_answer *a = &p.outcome.cases[0];
    CHECK_STR(a->name, "a");
    CHECK_STR(a->vectors[0].name, "reactions");
    CHECK(a->n_vectors == 2 && a->vectors[0].count == N && memcmp(a->vectors[0].data, x, sizeof x) == 0);
    CHECK(a->vectors[1].count == 0 && a->history_rows == 1 && a->history_columns == 4 && a->history[1] == -2);
    CHECK_STR(p.outcome.cases[1].summary, "{}");
    parcel_clear(&p);
    const store_outcome failed = {.status = JOB_FAILED, .error = "{\"code\": \"x\"}"};
    parcel_write(at, &failed);
    CHECK(parcel_read(&p, at, parcel_write(NULL, &failed)) && p.outcome.status == JOB_FAILED);
    CHECK_STR(p.outcome.error, "{\"code\": \"x\"}");
    parcel_clear(&p);
    free(at);
}

/* Cut anywhere, and with every word replaced: it is read without touching anything outside, or refused. */
TEST(damaged_ones_do_no_harm)
{
    static const int64_t WORDS[] = {-1, 0, 1, 7, INT64_MAX, INT64_MIN, INT64_MAX / 8, 1 << 20};
    const double x[N] = {1, -2, 3, 4, 5};
    store_answer cases[2];
    store_vector vectors[2];
    parcel p;
    const store_outcome o = make(cases, vectors, x);
    const size_t size = parcel_write(NULL, &o);
    char *whole = malloc(size);
    int refused = 0;
    parcel_write(whole, &o);
    for (size_t cut = 0; cut < size; cut += 8) {
        char *part = malloc(cut + 1); /* so that a sanitizer sees what is read beyond it */
        memcpy(part, whole, cut);
        refused += !parcel_read(&p, part, cut);
        parcel_clear(&p);
        free(part);
    }
    CHECK_INT(refused, size / 8);
    for (size_t at = 0; at < size; at += 8)
        for (size_t k = 0; k < sizeof WORDS / sizeof WORDS[0]; k++) {
            char *damaged = malloc(size);
            memcpy(damaged, whole, size);
            memcpy(damaged + at, &WORDS[k], 8);
            refused += !parcel_read(&p, damaged, size);
            parcel_clear(&p);
            free(damaged);
        }
    CHECK(refused > (int)size / 8 + 20);
    free(whole);
}
