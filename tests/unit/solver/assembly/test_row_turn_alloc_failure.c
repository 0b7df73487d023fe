/* How rows between bodies turn, each allocation on the way failing once. Linked with malloc, calloc, realloc and free
 * wrapped. */
#include "failing_heap.h"

#include "assembly/row_turn.h"
#include "linalg/linalg.h"
#include "sanitized.h"
#include "two_boxes.h"

static void fail_each(bool solid)
{
    const char *element = solid ? "hex8" : "quad4";
    const box_part a = {{0, 0, 0}, {2, 1, 1}, {2, 1, 1}, element}, b = {{0.3, 1, 0.1}, {1, 1, 0.7}, {1, 1, 1}, element};
    uz_scene s = two(solid ? UZ_SOLID : UZ_PLANE_STRAIN, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL);
    body_hold(&s, "abottom", 0, 0, solid ? 0 : NAN);
    body_hold(&s, "btop", 0, 0, solid ? 0 : NAN);
    touch(&s, "bbottom", "atop");
    uz_body_model base = body_model(&s), at;
    double *u = body_room(base.mesh.dim * base.mesh.n_nodes, sizeof *u), *v = body_room(2 * base.d, sizeof *v), r[8],
           gap[8] = {0};
    uz_error first = {0};
    s.place = u;
    CHECK_INT(uz_body_model_move(&at, &base, &s, &first), UZ_OK);
    s.place = NULL;
    for (int i = 0; i < 8; i++)
        r[i] = -1;
    CHECK(at.m > 0 && at.m <= 8);
    v[0] = 1;
    uz_status status = UZ_ERR_MEMORY;
    long count = 0;
    for (; status != UZ_OK && count < 20000; count = next_allocation(count)) {
        uz_row_turn turn;
        uz_csc wide = {0};
        bool known = false;
        uz_error err = {0};
        heap_watch(count);
        status = uz_row_turn_find(&turn, &base, &at, &s, r, 0, NULL, &err);
        if (status == UZ_OK)
            status = uz_widen_by_rows(&wide, &base.K, &at.N, r, 0, &turn, &err);
        if (status == UZ_OK)
            status = uz_row_turn_along(&known, v + base.d, gap, &base, &at, &s, r, v, &err);
        CHECK(known == (status == UZ_OK));
        uz_row_turn_clear(&turn);
        uz_csc_clear(&wide);
        heap.watching = false;
        CHECK_MSG(status == UZ_OK || status == UZ_ERR_MEMORY, "%ld: %s", count, err.message);
        CHECK_MSG(heap.live == 0, "%ld: %d blocks are left", count, heap.live);
        if (heap.live > 0)
            break;
    }
    CHECK_MSG(count > (solid ? 30 : 100) && status == UZ_OK && !heap.failed, "%ld allocations", count);
    uz_body_model_clear(&at);
    uz_body_model_clear(&base);
    uz_scene_clear(&s);
    free(u);
    free(v);
}

TEST(failures_are_told_and_leave_nothing)
{
    fail_each(false);
    fail_each(true);
}
