/* Pieces that hang on a node, each allocation on the way failing once. Linked with malloc, calloc, realloc and free
 * wrapped. */
#include "failing_heap.h"

#include "assembly/assembly.h"
#include "body_fixture.h"

static void *copy(const void *from, size_t bytes)
{
    void *to = body_room(1, bytes);
    memcpy(to, from, bytes);
    return to;
}

/* Two squares that have a corner or a side in common. */
static uz_scene two_squares(bool side)
{
    static const double XYZ[] = {0, 0, 1, 0, 1, 1, 0, 1, 2, 1, 2, 2, 1, 2}, ASIDE[] = {2, 0, 2, 1};
    static const int64_t CORNER[] = {0, 1, 2, 3, 2, 4, 5, 6}, SIDE[] = {0, 1, 2, 3, 1, 4, 5, 2}, FIRST[] = {0, 4, 8};
    static const unsigned char KIND[] = {UZ_QUAD4, UZ_QUAD4};
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){1, 1, 0}, (int64_t[3]){1, 1, 0});
    body_give_mesh(&s, NULL);
    uz_given_mesh *g = &s.given; /* the first square is the box, whose nodes have other numbers */
    free(g->xyz);
    free(g->kind);
    free(g->first);
    free(g->node);
    g->n_nodes = side ? 6 : 7;
    g->n_elements = 2;
    g->xyz = copy(XYZ, sizeof XYZ);
    if (side)
        memcpy(g->xyz + 8, ASIDE, sizeof ASIDE);
    g->kind = copy(KIND, sizeof KIND);
    g->first = copy(FIRST, sizeof FIRST);
    g->node = copy(side ? SIDE : CORNER, sizeof CORNER);
    for (int64_t i = 0; i < g->n_groups; i++) {
        if (strcmp(g->groups[i].name, "all") == 0)
            snprintf(g->groups[i].name, sizeof g->groups[i].name, "first");
        for (int64_t k = 0; k < 2 * g->groups[i].n_faces; k++)
            g->groups[i].face_node[k] ^= g->groups[i].face_node[k] > 1; /* 2 and 3 change places */
    }
    body_hold(&s, "bottom", 0, 0, NAN);
    return s;
}

TEST(failures_are_told_and_leave_nothing)
{
    for (int side = 0; side < 2; side++) {
        uz_scene s = two_squares(side);
        uz_body_model model = body_model(&s);
        uz_status status = UZ_ERR_MEMORY;
        long count = 0;
        for (; status == UZ_ERR_MEMORY && count < 100; count++) {
            uz_error err = {0};
            heap_watch(count);
            status = uz_check_hinges(&model, &err);
            heap.watching = false;
            CHECK_MSG(heap.live == 0, "%ld: %d blocks are left", count, heap.live);
            CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : side ? UZ_OK : UZ_ERR_FREE_BODY);
            CHECK(side || heap.failed || strstr(err.message, "node 2 at (1, 1) alone"));
        }
        CHECK_MSG(count > 5, "%ld allocations", count);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
