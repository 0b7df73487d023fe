/* Where a function changes its sign. */
#include "core/root.h"

#include "harness.h"

#include <math.h>

typedef struct {
    double at, power;
    int *calls;
} rising;

static double curve(const void *ctx, double x)
{
    const rising *r = ctx;
    ++*r->calls;
    return r->power == 0 ? (x < r->at ? -1e-3 : 1e3) : copysign(pow(fabs(x - r->at), r->power), x - r->at);
}

TEST(roots_leaps_and_ends)
{
    int calls = 0;
    const double at[] = {0.3, -7, 1e-9}, power[] = {0, 1, 3, 0.2};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) {
            const rising r = {at[i], power[j], &calls};
            calls = 0;
            CHECK(fabs(uz_root_between(curve, &r, at[i] - 2, at[i] + 5, 1e-12) - at[i]) <
                  (power[j] == 3 ? 1e-5 : 2e-12));
            CHECK_MSG(calls < 200, "%d calls", calls);
            CHECK(uz_root_between(curve, &r, at[i] + 1, at[i] + 5, 0) == at[i] + 1);
            CHECK(uz_root_between(curve, &r, at[i] - 5, at[i] - 1, 0) == at[i] - 1);
        }
}
