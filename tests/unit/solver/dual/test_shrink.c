/* Guesses of the active rows that hold far too many: circles on a grid of rows, with the pressure under a sphere that
 * is held to a circle of another radius than it touches (Johnson, Contact Mechanics, 1985, ch. 4). */
#include "dual/sparse.h"
#include "harness.h"
#include "linalg/linalg.h"

#include <math.h>

enum { SIDE = 41, MIDDLE = SIDE / 2, N = SIDE * SIDE };

/* Each node of a grid is coupled with the eight around it. */
static void make_grid(uz_csc *K)
{
    uz_error err = {0};
    CHECK(uz_csc_init(K, N, N, 5 * N, &err) == UZ_OK);
    int64_t at = 0;
    for (int j = 0; j < N; j++) {
        const int x = j % SIDE, y = j / SIDE;
        const int to[5][2] = {{0, 0}, {1, 0}, {-1, 1}, {0, 1}, {1, 1}};
        for (int k = 0; k < 5; k++)
            if (x + to[k][0] >= 0 && x + to[k][0] < SIDE && y + to[k][1] < SIDE) {
                K->idx[at] = j + to[k][0] + SIDE * to[k][1];
                K->val[at++] = k == 0 ? 8.0 : -1.0;
            }
        K->ptr[j + 1] = at;
    }
}

typedef struct {
    uz_sparse_load load;
    uz_bounded box;
    uz_bounds bounds;
    int64_t dof[N], upper[N], lower[N], holder[N];
    double scale[N], top[N], bottom[N], u[N], r[N], force[N];
    bool active[N];
} guess;

/* From the middle of the grid. */
static int across(int j)
{
    return j % SIDE - MIDDLE;
}

static int along(int j)
{
    return j / SIDE - MIDDLE;
}

static double radius_of(int j)
{
    return hypot(across(j), along(j));
}

/* The force on a node, as the mean over its cell, of 2 (a^2 - r^2) - (a^2 - a0^2) over the root of a^2 - r^2. */
static double force_at(int j, double a, double a0)
{
    enum { POINTS = 20 };
    double sum = 0.0;
    for (int row = 0; row < POINTS; row++)
        for (int column = 0; column < POINTS; column++) {
            const double x = across(j) + (column + 0.5) / POINTS - 0.5, y = along(j) + (row + 0.5) / POINTS - 0.5,
                         left = a * a - x * x - y * y;
            if (left > 0.0)
                sum += (2.0 * left - (a * a - a0 * a0)) / sqrt(left);
        }
    return sum / (POINTS * POINTS);
}

/* Rows within the radius a are held, those within a0 are right. */
static void hold(guess *g, const uz_csc *K, double a, double a0)
{
    g->bounds = (uz_bounds){g->dof, g->scale};
    g->box = (uz_bounded){.bounds = &g->bounds,
                          .n = N,
                          .dof = g->dof,
                          .top = g->top,
                          .bottom = g->bottom,
                          .upper = g->upper,
                          .lower = g->lower,
                          .holder = g->holder,
                          .u = g->u,
                          .r = g->r,
                          .force = g->force};
    g->load = (uz_sparse_load){.load.K = K, .box = &g->box};
    for (int j = 0; j < N; j++) {
        const bool held = radius_of(j) < a;
        g->dof[j] = g->upper[j] = j;
        g->lower[j] = -1;
        g->holder[j] = held ? j : -1;
        g->active[j] = held;
        g->scale[j] = 1.0;
        g->top[j] = 0.0;
        g->bottom[j] = -INFINITY;
        g->u[j] = held ? 0.0 : -1.0;
        g->r[j] = held ? -force_at(j, a, a0) : 0.0; /* what presses is negative */
        g->force[j] = g->r[j];
    }
}

static int64_t count(const guess *g)
{
    int64_t n = 0;
    for (int j = 0; j < N; j++)
        n += g->active[j];
    return n;
}

TEST(a_circle_that_is_too_large_becomes_the_one_that_touches)
{
    static guess g;
    uz_csc K = {0};
    make_grid(&K);
    for (int k = 0; k <= 10; k++) {
        const double a0 = 10.3, a = a0 + 1.5 + 0.25 * k;
        hold(&g, &K, a, a0);
        CHECK(uz_bounded_shrink(&g.load, g.active));
        const double radius = sqrt((double)count(&g) / M_PI);
        CHECK_MSG(fabs(radius - a0) < 1.0 && fabs(radius - a0) < 0.55 * (a - a0), "%g of %g: %g", a, a0, radius);
        for (int j = 0; j < N; j++) /* and what pulls is gone */
            CHECK(!(g.active[j] && g.r[j] > 0.0));
    }
    uz_csc_clear(&K);
}

TEST(guesses_that_are_nearly_right_are_left_alone)
{
    static guess g;
    uz_csc K = {0};
    make_grid(&K);
    hold(&g, &K, 10.3, 10.3); /* nothing pulls */
    const int64_t all = count(&g);
    CHECK(!uz_bounded_shrink(&g.load, g.active));
    for (int k = 1; k <= 6; k++) { /* what goes is no more than a row beyond the border */
        hold(&g, &K, 10.3 + 0.2 * k, 10.3);
        (void)uz_bounded_shrink(&g.load, g.active);
        const double radius = sqrt((double)count(&g) / M_PI);
        CHECK_MSG(radius > 9.3, "%g", radius);
    }
    hold(&g, &K, 13.0, 10.3);
    g.u[0] = 1.0; /* a row is missing elsewhere */
    const int64_t held = count(&g);
    CHECK(!uz_bounded_shrink(&g.load, g.active));
    CHECK_INT(count(&g), held);
    CHECK(held > all);
    uz_csc_clear(&K);
}

/* A square of which a corner lifts: a band as wide as that all around it would be most of what presses. */
TEST(a_corner_that_lifts_takes_nothing_along)
{
    enum { WIDE = 20, CORNER = 7 };
    static guess g;
    uz_csc K = {0};
    make_grid(&K);
    hold(&g, &K, 1.0, 1.0);
    for (int j = 0; j < N; j++) {
        const int x = j % SIDE - SIDE / 4, y = j / SIDE - SIDE / 4;
        g.active[j] = x >= 0 && x < WIDE && y >= 0 && y < WIDE;
        g.holder[j] = g.active[j] ? j : -1;
        g.u[j] = g.active[j] ? 0.0 : -1.0;
        g.r[j] = g.force[j] = !g.active[j] ? 0.0 : x < CORNER && y < CORNER ? 1.0 : -1.0;
    }
    CHECK(!uz_bounded_shrink(&g.load, g.active));
    CHECK_INT(count(&g), WIDE * WIDE);
    uz_csc_clear(&K);
}
