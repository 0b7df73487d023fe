/* What an answer's evaluation has from further threads is what one would have computed. */
#include "post/ahead.h"
#include "body_fixture.h"
#include "core/aside.h"
#include "post/evaluate.h"

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
    double error = NAN;
    uz_mesh_look look = {NAN, NAN, NAN}, expected_look;
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
        taken = uz_ahead_take(ahead, &error, &look, nodal);
        nodal[n / 2] += 1;
        CHECK(!uz_ahead_take(ahead, &error, &look, nodal)); /* of another answer */
        nodal[n / 2] -= 1;
        uz_ahead_free(ahead);
    }
    const double expected = uz_estimate_mesh_error(NULL, &expected_look, &model, &s, nodal);
    CHECK(taken && error == expected && look.share == expected_look.share && expected > 0);
    CHECK(look.steep2 == expected_look.steep2 && look.steep2 > 0);
    uz_aside_allow(1);
    free(prescribed);
    free(nodal);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}

/* 1156 rows, and 99 elements that touch what is held. */
TEST(an_evaluation_by_threads_is_that_of_one)
{
    enum { THREADS = 3 };
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){33, 3, 33}, (int64_t[3]){33, 3, 33});
    body_hold(&s, "left", 0, 0, 0);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -1, 0);
    body_plane(&s, "bottom", (double[3]){0, -1e-3, 0}, (double[3]){0, 1, 0});
    uz_result *answer = body_solve(&s, 1e-8), of[THREADS];
    uz_body_model model = body_model(&s);
    uz_error err = {0};
    CHECK(answer->m >= 1000);
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int k = 0; k < THREADS; k++) {
        of[k] = (uz_result){.m = answer->m,
                            .n_nodes = answer->n_nodes,
                            .u = answer->u,
                            .r = answer->r,
                            .g = answer->g,
                            .mesh = answer->mesh};
        uz_aside_allow(k + 1);
        CHECK_INT(uz_evaluate(&of[k], &model, &s, NULL, &err), UZ_OK);
        const uz_evaluation *one = of[0].evaluation, *e = of[k].evaluation;
        CHECK(e->supports[0].force[1] == one->supports[0].force[1] && one->supports[0].force[1] > 0);
        CHECK(e->supports[0].moment[2] == one->supports[0].moment[2] && e->imbalance == one->imbalance);
        CHECK(e->overlap[0].depth == one->overlap[0].depth && e->overlap[0].motion == one->overlap[0].motion);
        CHECK(e->overlap[0].motion > 0 && e->strain_energy == one->strain_energy);
        CHECK_INT(e->n_warnings, one->n_warnings);
        CHECK(memcmp(e->warnings, one->warnings, sizeof e->warnings) == 0);
    }
    for (int k = 0; k < THREADS; k++) {
        free(of[k].pressure);
        uz_evaluation_free(of[k].evaluation);
    }
    uz_aside_allow(1);
    uz_result_free(answer);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}
