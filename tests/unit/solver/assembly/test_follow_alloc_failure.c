/* A body with a tie and a rigid group: its rigid motions are among its dofs and have no force, and each
 * allocation on the way fails once. Linked with malloc, calloc, realloc and free wrapped. */
#include "core/alloc.h"
#include "failing_heap.h"

#include "sanitized.h"
#include "two_boxes.h"

/* Two boxes, one on the other, with a rigid head; nothing holds them but the group's own motions, if asked. */
static uz_scene tied_boxes(bool held)
{
    const box_part a = {{0, 0}, {2, 1}, {2, 1}, "quad4"}, b = {{0, 1}, {2, 1}, {3, 1}, "quad4"};
    uz_scene s = two(UZ_PLANE_STRAIN, UZ_ELASTIC_LINEAR, &a, &b, NULL);
    uz_support *rigid = &s.supports[s.n_supports++];
    s.kinematics = UZ_KINEMATICS_FIXED;
    *rigid = (uz_support){
        .kind = UZ_SUPPORT_RIGID, .on = "btop", .about = {1, 5}, .u = {NAN, NAN, NAN}, .turn = {NAN, NAN, NAN}};
    if (held)
        rigid->u[0] = rigid->u[1] = rigid->turn[2] = 0;
    s.ties = body_room(1, sizeof *s.ties);
    s.ties[s.n_ties++] = (uz_tie){.on = "atop", .to = "bbottom"};
    return s;
}

TEST(failures_are_told_and_leave_nothing)
{
    uz_scene s = tied_boxes(true);
    uz_status status = UZ_ERR_MEMORY;
    long count = 0;
    for (; status != UZ_OK && count < 20000; count = next_allocation(count)) {
        uz_body_model model;
        uz_error err = {0};
        heap_watch(count);
        status = uz_body_model_build(&model, &s, UZ_BODY_SUPPORTED, &err);
        uz_body_model_clear(&model);
        heap.watching = false;
        CHECK_MSG(status == UZ_OK || status == UZ_ERR_MEMORY, "%ld: %s", count, err.message);
        CHECK_MSG(heap.live == 0, "%ld: %d blocks are left", count, heap.live);
        if (heap.live > 0)
            break;
    }
    CHECK_MSG(count > 30 && status == UZ_OK && !heap.failed, "%ld allocations", count);
    uz_scene_clear(&s);
}

/* Without supports a rigid motion of all, tied and rigid nodes among them, is one of the dofs, and has no force. */
TEST(rigid_motions_have_no_force)
{
    uz_scene s = tied_boxes(false);
    uz_body_model model;
    uz_error err = {0};
    CHECK_INT(uz_body_model_build(&model, &s, UZ_BODY_SUPPORTED, &err), UZ_ERR_FREE_BODY);
    CHECK_MSG(strstr(err.message, "translation along x") && strstr(err.message, "rotation"), "%s", err.message);
    uz_scene_clear(&s);
    s = tied_boxes(true);
    CHECK_INT(uz_body_model_build(&model, &s, UZ_BODY_SUPPORTED, &err), UZ_OK);
    const int64_t n = model.mesh.n_nodes;
    double *nodal = body_room(2 * n, sizeof *nodal), *back = body_room(2 * n, sizeof *back),
           *u = body_room(model.d, sizeof *u), *p = body_room(model.d, sizeof *p),
           *given = body_room(model.n_fixed, sizeof *given);
    given[0] = 0.5; /* t_x, t_y, and w times the size */
    given[1] = -0.25;
    given[2] = 0.125 * model.rigid[0].size;
    CHECK_INT(model.n_fixed, 3);
    for (int64_t a = 0; a < n; a++) {
        nodal[2 * a] = 0.5 - 0.125 * (model.mesh.xyz[2 * a + 1] - 5);
        nodal[2 * a + 1] = -0.25 + 0.125 * (model.mesh.xyz[2 * a] - 1);
    }
    uz_restrict_nodal(u, &model, nodal);
    uz_recover_nodal(back, &model, u, given);
    for (int64_t i = 0; i < 2 * n; i++)
        CHECK(fabs(back[i] - nodal[i]) < 1e-14);
    for (int64_t j = 0; j < model.d; j++) /* K u + K_fixed v */
        for (int64_t q = model.K.ptr[j]; q < model.K.ptr[j + 1]; q++) {
            p[model.K.idx[q]] += model.K.val[q] * u[j];
            if (model.K.idx[q] != j)
                p[j] += model.K.val[q] * u[model.K.idx[q]];
        }
    uz_csc_gaxpy(p, &model.K_fixed, 1, given);
    for (int64_t j = 0; j < model.d; j++)
        CHECK(fabs(p[j]) < 1e-13);
    uz_free_all(nodal, back, u, p, given);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}
