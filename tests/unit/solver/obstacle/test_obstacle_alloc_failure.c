/* Each allocation for obstacles and for contact between bodies fails once: the call must say so, publish nothing and
 * keep nothing. Linked with the heap wrapped. */
#include "failing_heap.h"
#include "harness.h"
#include "obstacle/along.h"
#include "obstacle/candidates.h"
#include "obstacle/obstacle.h"
#include "obstacle/projection.h"

static bool fails_at(long n, void (*run)(void))
{
    heap_watch(n);
    run();
    heap.watching = false;
    CHECK_MSG(heap.live == 0, "allocation %ld fails and %d blocks leak", n, heap.live);
    return heap.failed;
}

/* Returns how many allocations there are. */
static long fail_each(void (*run)(void))
{
    long n = 0;
    while (n < 100 && fails_at(n, run))
        n++;
    return n;
}

static void make(const uz_contact *contact, uz_model model)
{
    uz_obstacle *o;
    uz_error err = {0};
    const uz_status status = uz_obstacle_new(&o, contact, 0, model, &err);
    CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
    CHECK((o != NULL) == (status == UZ_OK));
    uz_obstacle_free(o);
}

static double X[] = {0, 1, 2}, Y[] = {0, 1, 0}, Z[9] = {0};

static void make_line(void)
{
    make(&(uz_contact){.kind = UZ_OBSTACLE_POLYLINE, .n_x = 3, .x = X, .y = Y}, UZ_PLANE_STRAIN);
}

/* A tetrahedron; its file. */
static void make_surface(void)
{
    static const char *const FILE_TEXT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    uz_triangles t;
    uz_error err = {0};
    const uz_status status = uz_triangles_read(&t, "obj", FILE_TEXT, strlen(FILE_TEXT), 0, &err);
    CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
    if (status == UZ_OK)
        make(&(uz_contact){.kind = UZ_OBSTACLE_SURFACE, .n_x = 3 * t.n, .x = t.x, .y = t.y, .z = t.z}, UZ_SOLID);
    uz_triangles_clear(&t);
}

/* Lines, an arc that is parted, and corners. */
static void make_along(void)
{
    const uz_contact of[] = {{.kind = UZ_OBSTACLE_POLYLINE, .n_x = 3, .x = X, .y = Y},
                             {.kind = UZ_OBSTACLE_ROUND, .point = {1, -1}, .radius = 1}};
    for (int k = 0; k < 2 && !heap.failed; k++) {
        uz_obstacle *o;
        uz_obstacle_pieces pieces = {.n = 0};
        uz_error err = {0};
        if (uz_obstacle_new(&o, &of[k], 0, UZ_PLANE_STRAIN, &err) != UZ_OK)
            return;
        const double a[2] = {-30, 1.1}, b[2] = {30, 1.2};
        const uz_status status = uz_obstacle_along(&pieces, o, a, b, &err);
        CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
        CHECK(heap.failed || pieces.n > 2);
        free(pieces.at);
        uz_obstacle_free(o);
    }
}

static void make_table(void)
{
    make(&(uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = 3, .n_y = 3, .x = X, .y = X, .z = Z}, UZ_SOLID);
}

static void make_pairs(void)
{
    static double xyz[] = {0, 0, 1, 0, 1, 1, 0, 1, 0.5, 1.5};
    static unsigned char kind[] = {UZ_QUAD4};
    static int64_t first[] = {0, 4}, node[] = {0, 1, 2, 3}, shoe[] = {4};
    static uz_face top[] = {{0, 2}};
    const uz_mesh mesh = {
        .dim = 2, .n_nodes = 5, .n_elements = 1, .xyz = xyz, .kind = kind, .first = first, .node = node, .extent = 2};
    const uz_group on = {.name = "shoe", .kind = UZ_GROUP_NODES, .n_nodes = 1, .node = shoe};
    const uz_group with = {.name = "top", .kind = UZ_GROUP_FACES, .n_faces = 1, .face = top};
    uz_contact_pair *row;
    int64_t count;
    uz_error err = {0};
    const uz_status status = uz_contact_pairs(&row, &count, &mesh, &on, &with, 0, &(uz_own_place){0}, false, &err);
    CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
    CHECK((row != NULL) == (status == UZ_OK) && count == (status == UZ_OK));
    free(row);
}

static void choose(void)
{
    static const double h[] = {0, 1, 5};
    static int64_t ptr[] = {0, 1, 3};
    static int32_t idx[] = {0, 1, 2};
    static double val[] = {1, 2, 3};
    const uz_csc N = {.rows = 3, .cols = 2, .ptr = ptr, .idx = idx, .val = val};
    uz_candidates c;
    uz_csc part = {0};
    uz_error err = {0};
    uz_status status = uz_candidates_first(&c, h, 3, 1, &err);
    if (status == UZ_OK)
        status = uz_candidates_reduce(&part, &N, &c, &err);
    CHECK_INT(status, heap.failed ? UZ_ERR_MEMORY : UZ_OK);
    CHECK((part.ptr != NULL) == (status == UZ_OK));
    CHECK(status != UZ_OK || (part.rows == 2 && part.ptr[2] == 2 && part.idx[1] == 1 && part.val[1] == 2));
    uz_csc_clear(&part);
    uz_candidates_clear(&c);
}

TEST(every_allocation_may_fail)
{
    CHECK_INT(fail_each(make_line), 8);
    CHECK_INT(fail_each(make_along), 13);
    CHECK_INT(fail_each(make_table), 9);
    CHECK(fail_each(make_surface) > 15);
    CHECK_INT(fail_each(make_pairs), 17);
    CHECK_INT(fail_each(choose), 5);
}
