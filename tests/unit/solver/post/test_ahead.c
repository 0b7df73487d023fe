/* What an answer's evaluation takes from a second thread is what it would have computed. */
#include "post/ahead.h"
#include "body_fixture.h"
#include "core/aside.h"

#include <sched.h>

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
    CHECK_INT(uz_aside_begin(2), 2);
    for (int tries = 0; tries < 10000 && !taken; tries++) { /* a task may be taken back before it is begun */
        for (int64_t i = 0; i < model.d; i++)
            u[i] = sin(1e-3 * (double)i);
        uz_recover_nodal(nodal, &model, u, prescribed);
        uz_aside_allow(1);
        CHECK(uz_ahead_start(&model, &s, u, prescribed) == NULL);
        uz_aside_allow(2);
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
    uz_aside_allow(1);
    free(prescribed);
    free(nodal);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}
