/* The cache of bodies: one creator per key, a bound in bytes, and keys that tell bodies apart. */
#include "run/setup_cache.h"
#include "cache/parts.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

#include <pthread.h>
#include <stdatomic.h>

enum { THREADS = 8 };

/* A string of d springs; `stiffness` makes bodies of one size differ. */
static uz_problem spring_body(int64_t d, double stiffness)
{
    qp_random rng = {2};
    uz_problem problem = problem_of(random_obstacle(&rng, d, 1));
    problem.qp.K.val[0] += stiffness;
    return problem;
}

static uz_setup *acquire(uz_cache *cache, const uz_problem *problem, bool *hit)
{
    uz_settings settings = uz_settings_default();
    uz_setup *setup = NULL;
    uz_reuse reused;
    uz_error err = {0};
    CHECK_MSG(uz_setup_acquire(&setup, &reused, cache, problem, NULL, &settings, NULL, &err) == UZ_OK, "%s",
              err.message);
    *hit = reused.op;
    return setup;
}

/* Makes the body known and lets go of it; whether it was known before. */
static bool touch(uz_cache *cache, const uz_problem *problem)
{
    bool hit = false;
    uz_setup_release(cache, acquire(cache, problem, &hit));
    return hit;
}

static size_t list(uz_cache *cache, uz_cache_entry **entries)
{
    size_t count = 77;
    uz_error err = {0};
    CHECK(uz_cache_list(cache, entries, &count, &err) == UZ_OK);
    return count;
}

static size_t count_entries(uz_cache *cache)
{
    uz_cache_entry *entries;
    size_t count = list(cache, &entries);
    free(entries);
    return count;
}

TEST(hits_are_counted_and_listed)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_problem a = spring_body(10, 1), b = spring_body(20, 1);
    uz_cache_entry *entries;
    CHECK_INT(list(cache, &entries), 0);
    free(entries);
    CHECK(!touch(cache, &a));
    CHECK(!touch(cache, &b));
    for (int k = 0; k < 5; k++)
        CHECK(touch(cache, &a));
    CHECK(touch(cache, &b));
    CHECK_INT(list(cache, &entries), 2);
    CHECK_INT(entries[0].d, 20); /* most recently used first */
    CHECK_INT(entries[0].m, 20);
    CHECK_INT(entries[0].hits, 1);
    CHECK_INT(entries[1].d, 10);
    CHECK_INT(entries[1].hits, 5);
    for (int k = 0; k < 2; k++) {
        CHECK_INT(strlen(entries[k].digest), 64);
        CHECK_INT(strspn(entries[k].digest, "0123456789abcdef"), 64);
        CHECK(entries[k].nnz >= entries[k].d && entries[k].bytes > 1000);
    }
    CHECK(strcmp(entries[0].digest, entries[1].digest) != 0);
    free(entries);
    uz_cache_free(cache);
    uz_problem_clear(&a);
    uz_problem_clear(&b);
}

/* A table that has a name for a matrix does not read it: two with one name are taken for one, and after another name,
 * or without one, each has its own digest. */
TEST(a_named_matrix_is_not_read)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_problem a = spring_body(10, 1), b = spring_body(20, 1);
    const uz_matrix_key one = {"pattern", "1"}, two = {"pattern", "2"};
    uz_matrix_key key, read;
    uz_error err;
    CHECK_INT(uz_matrix_digest(&read, cache, &a.qp.K, &err), UZ_OK);
    CHECK_INT(strlen(read.values), 64);
    uz_table_name(cache, &a.qp.K, &one);
    CHECK_INT(uz_matrix_digest(&key, cache, &a.qp.K, &err), UZ_OK);
    CHECK(strcmp(key.pattern, "pattern") == 0 && strcmp(key.values, "1") == 0);
    CHECK_INT(uz_matrix_digest(&key, NULL, &a.qp.K, &err), UZ_OK);
    CHECK(strcmp(key.pattern, read.pattern) == 0 && strcmp(key.values, read.values) == 0);
    CHECK_INT(uz_matrix_digest(&key, cache, &b.qp.K, &err), UZ_OK);
    CHECK_INT(strlen(key.values), 64);
    CHECK(!touch(cache, &a));
    a.qp.K.val[0] += 1; /* against the contract */
    CHECK(touch(cache, &a));
    uz_table_name(cache, &a.qp.K, &two);
    CHECK(!touch(cache, &a));
    uz_cache_free(cache);
    uz_problem_clear(&a);
    uz_problem_clear(&b);
}

TEST(without_a_cache)
{
    uz_problem problem = spring_body(10, 1);
    bool hit = true;
    uz_setup *setup = acquire(NULL, &problem, &hit);
    CHECK(setup && !hit);
    uz_setup_release(NULL, setup);
    uz_cache_free(NULL);
    uz_problem_clear(&problem);
}

TEST(least_recently_used_goes_first)
{
    uz_problem bodies[4];
    uz_cache *measure = uz_cache_new(SIZE_MAX);
    for (int k = 0; k < 4; k++)
        bodies[k] = spring_body(30, k);
    touch(measure, &bodies[0]);
    uz_cache_entry *entries;
    list(measure, &entries);
    size_t one = entries[0].bytes;
    free(entries);
    uz_cache_free(measure);

    uz_cache *cache = uz_cache_new(3 * one + one / 2);
    for (int k = 0; k < 3; k++)
        CHECK(!touch(cache, &bodies[k]));
    CHECK(touch(cache, &bodies[0]));
    CHECK(!touch(cache, &bodies[3])); /* in place of 1, the oldest */
    CHECK_INT(count_entries(cache), 3);
    CHECK(touch(cache, &bodies[0]));
    CHECK(touch(cache, &bodies[2]));
    CHECK(touch(cache, &bodies[3]));
    CHECK(!touch(cache, &bodies[1]));
    uz_cache_free(cache);
    for (int k = 0; k < 4; k++)
        uz_problem_clear(&bodies[k]);
}

static void destroy_flag(void *object)
{
    *(bool *)object = true;
}

/* What an object will take is made room for before it is made, and given back when it is not. */
TEST(room_is_made_before_the_object)
{
    static const char first[65] = "1", second[65] = "2";
    uz_cache *cache = uz_cache_new(100);
    uz_item *item;
    uz_error err = {0};
    bool create, gone = false, other = false;
    CHECK(uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, first, NULL, &err) == UZ_OK && create);
    uz_table_publish(cache, item, &gone, 60, destroy_flag);
    uz_table_release(cache, item);
    CHECK(uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, second, NULL, &err) == UZ_OK && create);
    uz_table_expect(cache, item, 40);
    CHECK(!gone);
    uz_table_expect(cache, item, 41);
    CHECK(gone);
    uz_table_abandon(cache, item);
    gone = false;
    CHECK(uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, first, NULL, &err) == UZ_OK && create);
    uz_table_publish(cache, item, &gone, 60, destroy_flag);
    uz_table_release(cache, item);
    CHECK(uz_table_acquire(&item, &create, cache, UZ_ITEM_FACTOR, second, NULL, &err) == UZ_OK && create);
    uz_table_expect(cache, item, 10);
    uz_table_publish(cache, item, &other, 40, destroy_flag); /* as large as it became: both fit */
    uz_table_release(cache, item);
    CHECK(!gone && !other);
    uz_cache_free(cache);
    CHECK(gone && other);
}

TEST(bodies_in_use_survive)
{
    uz_cache *cache = uz_cache_new(0);
    uz_problem a = spring_body(30, 1), b = spring_body(30, 2);
    bool hit;
    uz_setup *first = acquire(cache, &a, &hit), *again = acquire(cache, &a, &hit);
    CHECK(hit && first == again);
    uz_setup *other = acquire(cache, &b, &hit);
    CHECK_INT(count_entries(cache), 2);
    uz_setup_release(cache, again);
    CHECK_INT(count_entries(cache), 2);
    CHECK_INT(first->dual->d, 30); /* still there */
    uz_setup_release(cache, first);
    CHECK_INT(count_entries(cache), 1);
    uz_setup_release(cache, other);
    CHECK_INT(count_entries(cache), 0);
    uz_setup_release(cache, NULL);
    uz_cache_free(cache);
    uz_problem_clear(&a);
    uz_problem_clear(&b);
}

/* Threads that all want the same body at once. */
typedef struct {
    uz_cache *cache;
    const uz_problem *problem;
    pthread_barrier_t *start;
    atomic_int *created, *failed;
    const uz_hooks *hooks;
    uz_setup *setup;
} user;

static void *use(void *ctx)
{
    user *u = ctx;
    uz_settings settings = uz_settings_default();
    uz_error err = {0};
    uz_reuse reused = {0};
    uz_thread_init();
    pthread_barrier_wait(u->start);
    uz_status status = uz_setup_acquire(&u->setup, &reused, u->cache, u->problem, NULL, &settings, u->hooks, &err);
    atomic_fetch_add(u->created, status == UZ_OK && !reused.op);
    atomic_fetch_add(u->failed, status != UZ_OK);
    return NULL;
}

static void use_from_threads(uz_cache *cache, const uz_problem *problem, const uz_hooks *hooks, uz_setup **setups,
                             int *created, int *failed)
{
    pthread_t threads[THREADS];
    pthread_barrier_t start;
    user users[THREADS];
    atomic_int made = 0, missed = 0;
    pthread_barrier_init(&start, NULL, THREADS);
    for (int t = 0; t < THREADS; t++) {
        users[t] = (user){cache, problem, &start, &made, &missed, hooks, NULL};
        CHECK(pthread_create(&threads[t], NULL, use, &users[t]) == 0);
    }
    for (int t = 0; t < THREADS; t++) {
        pthread_join(threads[t], NULL);
        setups[t] = users[t].setup;
    }
    pthread_barrier_destroy(&start);
    *created = made;
    *failed = missed;
}

TEST(one_creator_for_many_threads)
{
    for (int round = 0; round < 10; round++) {
        uz_cache *cache = uz_cache_new(1 << 30);
        uz_problem problem = spring_body(150, round);
        uz_setup *setups[THREADS];
        int created, failed;
        use_from_threads(cache, &problem, NULL, setups, &created, &failed);
        CHECK_INT(created, 1);
        CHECK_INT(failed, 0);
        uz_cache_entry *entries;
        CHECK_INT(list(cache, &entries), 1);
        CHECK_INT(entries[0].hits, THREADS - 1);
        free(entries);
        for (int t = 0; t < THREADS; t++) {
            CHECK(setups[t] == setups[0]);
            uz_setup_release(cache, setups[t]);
        }
        uz_cache_free(cache);
        uz_problem_clear(&problem);
    }
}

/* A body that can't be made: everybody is told, and nothing is left behind. */
TEST(failing_creators_let_the_next_try)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_problem problem = spring_body(50, -100);
    uz_setup *setups[THREADS];
    int created, failed;
    use_from_threads(cache, &problem, NULL, setups, &created, &failed);
    CHECK_INT(created, 0);
    CHECK_INT(failed, THREADS);
    CHECK_INT(count_entries(cache), 0);
    uz_cache_free(cache);
    uz_problem_clear(&problem);
}

/* Says cancelled to the first that asks: the creator, or a waiter if it is slow. */
static bool refuse_once(void *ctx)
{
    return atomic_exchange((atomic_int *)ctx, 0) == 1;
}

TEST(cancelled_creator_leaves_the_work_to_a_waiter)
{
    for (int round = 0; round < 10; round++) {
        uz_cache *cache = uz_cache_new(1 << 30);
        uz_problem problem = spring_body(100, round);
        atomic_int refuse = 1;
        uz_hooks hooks = {.ctx = &refuse, .cancelled = refuse_once};
        uz_setup *setups[THREADS];
        int created, failed;
        use_from_threads(cache, &problem, &hooks, setups, &created, &failed);
        CHECK_INT(created, 1);
        CHECK_INT(failed, 1);
        for (int t = 0; t < THREADS; t++)
            uz_setup_release(cache, setups[t]);
        CHECK_INT(count_entries(cache), 1);
        uz_cache_free(cache);
        uz_problem_clear(&problem);
    }
}

/* Different bodies from many threads through a cache that holds few of them. */
static void *churn(void *ctx)
{
    user *u = ctx;
    uz_thread_init();
    pthread_barrier_wait(u->start);
    for (int k = 0; k < 60; k++) {
        uz_problem problem = spring_body(20, k % 7);
        uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        if (uz_solve(&result, &problem, &settings, u->cache, NULL, &err) != UZ_OK ||
            result->summary.outcome != UZ_CONVERGED)
            atomic_fetch_add(u->failed, 1);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
    return NULL;
}

TEST(solves_from_many_threads)
{
    uz_process_init(THREADS);
    uz_cache *cache = uz_cache_new(40000);
    pthread_t threads[THREADS];
    pthread_barrier_t start;
    atomic_int failed = 0;
    user u = {cache, NULL, &start, NULL, &failed, NULL, NULL};
    pthread_barrier_init(&start, NULL, THREADS);
    for (int t = 0; t < THREADS; t++)
        CHECK(pthread_create(&threads[t], NULL, churn, &u) == 0);
    for (int t = 0; t < THREADS; t++)
        pthread_join(threads[t], NULL);
    pthread_barrier_destroy(&start);
    CHECK_INT(failed, 0);
    uz_cache_entry *entries;
    size_t count = list(cache, &entries), bytes = 0;
    for (size_t k = 0; k < count; k++)
        bytes += entries[k].bytes;
    CHECK_MSG(bytes <= 40000, "%zu bytes in %zu bodies", bytes, count);
    free(entries);
    uz_cache_free(cache);
}

static void digest_of(char digest[65], const uz_problem *problem, const uz_settings *settings)
{
    uz_setup_key key;
    uz_error err = {0};
    CHECK(uz_setup_digest(&key, problem, NULL, settings, NULL, &err) == UZ_OK);
    memcpy(digest, key.digest, 65);
    CHECK_INT(strlen(digest), 64);
}

/* Whether a change to the problem or settings changes the digest. Takes the problem over. */
static bool differs(uz_problem changed, const uz_settings *settings, const uz_problem *original)
{
    char a[65], b[65];
    uz_settings defaults = uz_settings_default();
    digest_of(a, original, &defaults);
    digest_of(b, &changed, settings ? settings : &defaults);
    uz_problem_clear(&changed);
    return strcmp(a, b) != 0;
}

TEST(digest_of_matrices)
{
    uz_problem original = spring_body(12, 1), same = spring_body(12, 1), other;
    CHECK(!differs(same, NULL, &original));
    CHECK(differs(spring_body(12, 1.000000001), NULL, &original));
    CHECK(differs(spring_body(13, 1), NULL, &original));
    other = spring_body(12, 1);
    other.qp.N.val[3] = -1;
    CHECK(differs(other, NULL, &original));
    other = spring_body(12, 1);
    other.qp.N.idx[0] = 1;
    other.qp.N.idx[1] = 0;
    CHECK(differs(other, NULL, &original));
    other = spring_body(12, 1);
    other.qp.K.idx[1] = 2;
    CHECK(differs(other, NULL, &original));
    other = spring_body(12, 1);
    other.qp.p[4] = 100;
    other.qp.h[4] = 100;
    CHECK(!differs(other, NULL, &original));
    uz_problem_clear(&original);
}

TEST(digest_and_settings)
{
    uz_problem original = spring_body(12, 1);
    uz_settings s = uz_settings_default();
    s.op = UZ_OPERATOR_FACTORED;
    CHECK(differs(spring_body(12, 1), &s, &original));
    s = uz_settings_default();
    s.ordering = UZ_ORDERING_METIS;
    CHECK(differs(spring_body(12, 1), &s, &original));
    s = uz_settings_default();
    s.method = UZ_METHOD_UZAWA;
    s.stopping = UZ_STOP_PAPER;
    s.relative_error = 1e-3;
    s.alpha = 3;
    s.max_iterations = 7;
    s.time_limit_s = 1;
    CHECK(!differs(spring_body(12, 1), &s, &original));
    uz_problem_clear(&original);
}

static uz_problem scene_problem(void)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(6, 2)};
}

typedef void (*change)(uz_scene *scene);

static void young(uz_scene *s)
{
    s->materials[0].young *= 1.5;
}
static void poisson(uz_scene *s)
{
    s->materials[0].poisson = 0.2;
}
static void thickness(uz_scene *s)
{
    s->thickness = 4;
}
static void model(uz_scene *s)
{
    s->model = UZ_PLANE_STRAIN;
}
static void size(uz_scene *s)
{
    s->box.size[1] = 21;
}
static void cells(uz_scene *s)
{
    s->box.cells[0] = 7;
}
static void origin(uz_scene *s)
{
    s->box.origin[0] = 1;
}
static void release(uz_scene *s)
{
    s->supports[0].u[1] = NAN;
}
static void support(uz_scene *s)
{
    add_support(s, "right", NAN, 0);
}
static void tilt(uz_scene *s)
{
    s->contacts[0].normal[0] = 0.1;
}
static void side(uz_scene *s)
{
    strcpy(s->contacts[0].on, "top");
}
static void traction(uz_scene *s)
{
    s->loads[0].v[0] = 9;
}
static void no_load(uz_scene *s)
{
    s->n_loads = 0;
}
static void prescribed(uz_scene *s)
{
    s->supports[0].u[0] = 0.5;
}
static void obstacle(uz_scene *s)
{
    s->contacts[0].point[1] = -0.25;
}
static void longer_normal(uz_scene *s)
{
    s->contacts[0].normal[1] = 8;
}

TEST(digest_of_scenes)
{
    static const change different[] = {young,  poisson, thickness, model, size, cells,
                                       origin, release, support,   tilt,  side};
    static const change equal[] = {traction, no_load, prescribed, obstacle, longer_normal};
    uz_problem original = scene_problem();
    for (size_t k = 0; k < sizeof different / sizeof different[0]; k++) {
        uz_problem other = scene_problem();
        different[k](&other.scene);
        CHECK_MSG(differs(other, NULL, &original), "change %zu is not seen", k);
    }
    for (size_t k = 0; k < sizeof equal / sizeof equal[0]; k++) {
        uz_problem other = scene_problem();
        equal[k](&other.scene);
        CHECK_MSG(!differs(other, NULL, &original), "change %zu of a load makes another body", k);
    }
    uz_problem_clear(&original);
}

/* The second answer uses the first one's factor, and is the answer of its own load. */
TEST(answers_from_a_cached_body)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_settings settings = uz_settings_default();
    settings.relative_error = 1e-12;
    for (size_t k = 0; k < 4; k++) {
        static const change loads[] = {traction, prescribed, obstacle, no_load};
        uz_problem problem = scene_problem();
        uz_result *cached = NULL, *fresh;
        uz_error err = {0};
        loads[k](&problem.scene);
        CHECK(uz_solve(&cached, &problem, &settings, cache, NULL, &err) == UZ_OK);
        fresh = solve_problem(&problem, &settings);
        if (cached && fresh) {
            CHECK_INT(cached->summary.factor_cached, k > 0);
            CHECK(!fresh->summary.factor_cached);
            CHECK_INT(cached->summary.outcome, fresh->summary.outcome);
            CHECK_INT(cached->summary.active, fresh->summary.active);
            for (int64_t i = 0; i < fresh->n_nodes * 2; i++)
                CHECK(fabs(cached->u[i] - fresh->u[i]) <= 1e-10 * (1 + fabs(fresh->u[i])));
        }
        uz_result_free(cached);
        uz_result_free(fresh);
        uz_problem_clear(&problem);
    }
    uz_cache_free(cache);
}
