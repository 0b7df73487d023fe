/* test_trend.c: what grids tell of a number: laws that are known, and grids that follow none. */
#include "harness.h"
#include "post/trend.h"

#include <math.h>
#include <string.h>

enum { MOST = 8 };

/* q0 + c h^p on grids whose elements get smaller by this factor. */
static uz_trend of_law(double q0, double c, double p, double factor, int count)
{
    uz_trend_point point[MOST];
    uz_trend out;
    for (int k = 0; k < count; k++) {
        const double h = pow(factor, k);
        point[k] = (uz_trend_point){0.01 * h, q0 + c * pow(h, p)};
    }
    uz_trend_fit(&out, point, count, point[count - 1].value, 0.0);
    return out;
}

TEST(laws_are_found_with_their_orders)
{
    static const double ORDERS[] = {0.5, 1.0, 1.5, 2.0, 3.0};
    for (size_t i = 0; i < sizeof ORDERS / sizeof *ORDERS; i++)
        for (int count = 3; count <= MOST; count++) {
            const uz_trend t = of_law(7.0, -2.0, ORDERS[i], 0.6, count);
            CHECK_MSG(fabs(t.order - ORDERS[i]) <= 0.03 && !t.why[0], "order %g of %d grids: %g %s", ORDERS[i], count,
                      t.order, t.why);
            CHECK_MSG(t.low <= 7.0 && 7.0 <= t.high, "order %g of %d grids: %.9g to %.9g", ORDERS[i], count, t.low,
                      t.high);
            const double left = 2.0 * pow(pow(0.6, count - 1), ORDERS[i]);
            CHECK_MSG(t.high - t.low < 3.5 * left, "order %g of %d grids: %g wide, %g off", ORDERS[i], count,
                      t.high - t.low, left);
            CHECK_INT(t.grids, count < 5 ? count : 5);
        }
}

TEST(what_a_grid_does_not_see_and_like_sizes_leave_no_trace)
{
    const uz_trend_point up[] = {{1, 3}, {0.5, 2.5}, {0.25, 2.25}, {0.125, 2.125}};
    const uz_trend_point mixed[] = {{2, NAN},     {1, 3},          {0.5, 9},      {0.5, 2.5}, {0.25, 2.25},
                                    {0.125, 2.0}, {0.1251, 2.125}, {0.0625, NAN}, {0, 7}};
    uz_trend a, b;
    uz_trend_fit(&a, up, 4, 2.125, 0.0);
    uz_trend_fit(&b, mixed, 9, 2.125, 0.0);
    CHECK_INT(b.grids, 4);
    CHECK_REL(a.value, 2.0, 1e-2);
    CHECK_REL(b.value, a.value, 1e-2);
}

TEST(fewer_than_three_grids_tell_nothing)
{
    uz_trend t;
    uz_trend_fit(&t, &(uz_trend_point){1, 5}, 1, 5, 0.5);
    CHECK(isnan(t.low) && isnan(t.high) && isnan(t.order) && t.grids == 1 && strstr(t.why, "one grid"));
    CHECK_REL(t.value, 5.0, 0);
    const uz_trend_point unseen[] = {{1, NAN}, {0.5, NAN}}, two[] = {{1, 5}, {0.5, 5.001}};
    uz_trend_fit(&t, unseen, 2, 0, 0);
    CHECK(isnan(t.high) && t.grids == 0);
    uz_trend_fit(&t, two, 2, 0, 0);
    CHECK(isnan(t.high) && t.grids == 2 && strstr(t.why, "two sizes"));
}

/* A pressure at a corner grows as h^-0.3: there is no limit, and none must be told. */
TEST(what_does_not_settle_has_no_order)
{
    const uz_trend t = of_law(0.0, 1.0, -0.3, 0.5, 6);
    CHECK_MSG(isnan(t.order) && isinf(t.high) && t.low < 2.83 && strstr(t.why, "no limit"), "order %g to %g", t.order,
              t.high);
    /* Triangles halved once are of another shape, and see another part of it. */
    const uz_trend_point halved[] = {{0.0156, 2.05},  {0.0078, 2.53},  {0.0039, 3.11},
                                     {0.00276, 3.01}, {0.00195, 3.82}, {0.00138, 3.7}};
    uz_trend h;
    uz_trend_fit(&h, halved, 6, 3.7, 0);
    CHECK_MSG(isnan(h.order) && isinf(h.high) && h.low <= 3.7 && strstr(h.why, "no limit"), "%g to %g: %s", h.low,
              h.high, h.why);
    const uz_trend_point jumps[] = {{1, 5}, {0.5, 9}, {0.25, 4}, {0.125, 8}};
    uz_trend j;
    uz_trend_fit(&j, jumps, 4, 8, 0);
    CHECK(isnan(j.order) && j.low <= 0.0 && j.high >= 20.0 && isfinite(j.high));
    const uz_trend same = of_law(3.0, 0.0, 1.0, 0.5, 4);
    CHECK(isnan(same.order) && same.high <= 3.0 && same.low >= 3.0 && strstr(same.why, "the same"));
}
