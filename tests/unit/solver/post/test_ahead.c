/* What is computed on a second thread: tasks run once or never, and what an answer's evaluation takes from it is what
 * it would have computed. */
#include "post/ahead.h"
#include "body_fixture.h"
#include "core/aside.h"

#include <pthread.h>

typedef struct {
    pthread_t by;
    int count;
    pthread_mutex_t *gate; /* NULL: none */
} note;

static void take_note(void *ctx)
{
    note *n = ctx;
    if (n->gate) {
        pthread_mutex_lock(n->gate);
        pthread_mutex_unlock(n->gate);
    }
    n->by = pthread_self();
    n->count++;
}

TEST(a_task_runs_once_on_the_other_thread_or_never)
{
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
    note first = {.gate = &gate}, second = {.count = 0};
    uz_aside_task a = {.run = take_note, .ctx = &first}, b = {.run = take_note, .ctx = &second};
    CHECK(!uz_aside_start(&a) && !uz_aside_finish(&a)); /* there is no such thread */
    CHECK(uz_aside_begin() && uz_aside_begin());
    CHECK(!uz_aside_start(&a) && !uz_aside_finish(&a)); /* it is not allowed */
    uz_aside_allow(true);
    pthread_mutex_lock(&gate);
    CHECK(uz_aside_is_idle() && uz_aside_start(&a));
    CHECK(!uz_aside_is_idle() && !uz_aside_start(&b) && !uz_aside_finish(&b));
    pthread_mutex_unlock(&gate);
    const bool ran = uz_aside_finish(&a);
    CHECK(first.count == ran && second.count == 0 && uz_aside_finish(&a) == ran);
    CHECK(!ran || !pthread_equal(first.by, pthread_self()));
    int runs = 0;
    for (int k = 0; k < 2000; k++) { /* some are taken back before they are begun */
        CHECK(uz_aside_start(&b));
        runs += uz_aside_finish(&b);
        CHECK(second.count == runs);
    }
    uz_aside_allow(false);
    CHECK(!uz_aside_is_idle() && !uz_aside_start(&b));
}

/* A body of 20,200 elements that are strained somehow. */
TEST(the_estimate_ahead_is_the_estimate)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){202, 100, 0});
    body_hold(&s, "left", 0, 0, NAN);
    uz_body_model model = body_model(&s);
    const int64_t n = model.mesh.n_nodes * 2;
    double *u = body_room(model.d, sizeof *u), *nodal = body_room(n, sizeof *nodal);
    double *prescribed = body_room(model.n_fixed, sizeof *prescribed);
    double error = NAN, share = NAN, expected_share = NAN;
    bool taken = false;
    CHECK(uz_aside_begin());
    for (int tries = 0; tries < 10000 && !taken; tries++) { /* a task may be taken back before it is begun */
        for (int64_t i = 0; i < model.d; i++)
            u[i] = sin(1e-3 * (double)i);
        uz_recover_nodal(nodal, &model, u, prescribed);
        uz_aside_allow(false);
        CHECK(uz_ahead_start(&model, &s, u, prescribed) == NULL);
        uz_aside_allow(true);
        uz_ahead *ahead = uz_ahead_start(&model, &s, u, prescribed);
        CHECK(ahead);
        memset(u, 0, (size_t)model.d * sizeof *u); /* it has a copy */
        sched_yield();
        taken = uz_ahead_take(ahead, &error, &share, nodal);
        nodal[n / 2] += 1;
        CHECK(!uz_ahead_take(ahead, &error, &share, nodal)); /* of another answer */
        nodal[n / 2] -= 1;
        uz_ahead_free(ahead);
    }
    const double expected = uz_estimate_mesh_error(NULL, &expected_share, &model, &s, nodal);
    CHECK(taken && error == expected && share == expected_share && expected > 0);
    uz_aside_allow(false);
    free(prescribed);
    free(nodal);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}
