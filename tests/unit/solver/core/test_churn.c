/* Threads that solve bodies of equal K and different contacts with one cache that is too small: factors are shared,
 * waited for, thrown out while others use them, and made again. Every answer is that of a solve without a cache. */
#include "harness.h"
#include "membrane.h"
#include "uzawa.h"

#include <pthread.h>

enum { BODIES = 6, THREADS = 4, ROUNDS = 12, SIDE = 14 };

typedef struct {
    uz_problem problem[BODIES];
    uz_result *expected[BODIES];
    uz_cache *cache;
} churn;

typedef struct {
    churn *shared;
    int number, failures;
    uz_error last;
} worker;

/* Bodies 0, 2, 4: rows of one entry; others of two. Each has rows that the others lack; all have the same K. */
static void make_bodies(churn *c)
{
    for (int k = 0; k < BODIES; k++) {
        membrane kind = {SIDE, 20 + 15 * k, k % 2 == 1, k == 4, false};
        uz_settings settings = uz_settings_default();
        uz_error err = {0};
        c->problem[k] = (uz_problem){.kind = UZ_PROBLEM_MATRICES};
        CHECK(membrane_qp(&c->problem[k].qp, &kind, &err) == UZ_OK);
        for (int64_t i = 0; i < c->problem[k].qp.N.rows; i++)
            c->problem[k].qp.h[i] *= 0.1;
        uz_status status = uz_solve(&c->expected[k], &c->problem[k], &settings, NULL, NULL, &err);
        CHECK_MSG(status == UZ_OK && c->expected[k]->summary.outcome == UZ_CONVERGED, "body %d: %s", k, err.message);
    }
}

static bool agrees(const uz_result *got, const uz_result *expected)
{
    double largest = 0.0, difference = 0.0;
    for (int64_t j = 0; j < got->d; j++) {
        largest = fmax(largest, fabs(expected->u[j]));
        difference = fmax(difference, fabs(got->u[j] - expected->u[j]));
    }
    return got->summary.outcome == UZ_CONVERGED && difference <= 1e-6 * largest;
}

/* Every third solve takes another operator: other entries of the table on the same factor. */
static void *work(void *argument)
{
    worker *w = argument;
    churn *c = w->shared;
    uz_thread_init();
    for (int round = 0; round < ROUNDS; round++) {
        int k = (round * (w->number + 1) + w->number) % BODIES;
        uz_settings settings = uz_settings_default();
        settings.method = round % 4 == 1 ? UZ_METHOD_ACCELERATED_RESTART : UZ_METHOD_AUTO;
        settings.op = round % 3 == 2 ? UZ_OPERATOR_FACTORED : UZ_OPERATOR_CONDENSED;
        uz_result *result = NULL;
        uz_status status = uz_solve(&result, &c->problem[k], &settings, c->cache, NULL, &w->last);
        w->failures += status != UZ_OK || !agrees(result, c->expected[k]);
        uz_result_free(result);
    }
    return NULL;
}

static void run_threads(churn *c, size_t cache_bytes)
{
    pthread_t thread[THREADS];
    worker workers[THREADS] = {{0}};
    c->cache = uz_cache_new(cache_bytes);
    for (int t = 0; t < THREADS; t++) {
        workers[t] = (worker){.shared = c, .number = t};
        CHECK(pthread_create(&thread[t], NULL, work, &workers[t]) == 0);
    }
    for (int t = 0; t < THREADS; t++) {
        pthread_join(thread[t], NULL);
        CHECK_MSG(workers[t].failures == 0, "%zu bytes, thread %d: %d of %d answers are wrong: %s", cache_bytes, t,
                  workers[t].failures, ROUNDS, workers[t].last.message);
    }
    uz_cache_entry *entries = NULL;
    size_t count = 0;
    CHECK(uz_cache_list(c->cache, &entries, &count, NULL) == UZ_OK);
    CHECK_MSG(cache_bytes > 0 || count == 0, "%zu bodies stay in a cache of no bytes", count);
    free(entries);
    uz_cache_free(c->cache);
}

TEST(bodies_of_one_stiffness_churn_through_a_small_cache)
{
    static const size_t sizes[] = {0, 60000, 300000, (size_t)1 << 30};
    churn c;
    uz_process_init(THREADS);
    uz_thread_init();
    make_bodies(&c);
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++)
        run_threads(&c, sizes[k]);
    for (int k = 0; k < BODIES; k++) {
        uz_result_free(c.expected[k]);
        uz_problem_clear(&c.problem[k]);
    }
}
