/* test_interval_share.c: how few shares it takes to the narrowest interval, where |d| by shares is known. */
#include "run/interval_share.h"

#include "harness.h"

#include <math.h>

typedef double (*apart_of)(double share);

static double smooth(double share)
{
    return 20 * pow(share, -0.4);
}

static double leaping(double share)
{
    return share < 3 ? 300 : 10;
}

static double vanishing(double share)
{
    return share < 900 ? 1e3 / (1 + share) : 1e-9;
}

static double half_of(apart_of apart, double share, double ball)
{
    const double A = apart(share);
    return 2 * share * ball <= A ? A * ball : share * ball * ball + A * A / (4 * share);
}

/* From a share; from which on to which there are intervals. Returns the narrowest half. */
static double narrowest(int *tries, apart_of apart, double share, double ball, double from, double to)
{
    uz_attempts tried = {.n = 0};
    double best = INFINITY;
    for (*tries = 0; share > 0 && *tries < UZ_MOST_SHARES; (*tries)++) {
        const double half = share >= from && share <= to ? half_of(apart, share, ball) : (double)INFINITY;
        best = fmin(best, half);
        uz_attempts_add(&tried, share, apart(share), half);
        share = uz_attempts_next(&tried, share, ball);
    }
    CHECK(!(share > 0));
    return best;
}

TEST(the_narrowest_interval_takes_few_shares)
{
    static const apart_of ALL[] = {smooth, leaping, vanishing};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 11; i++) {
            int tries;
            const double share = 0.02 * pow(3, i);
            double least = INFINITY;
            for (int j = 0; j < 2100; j++)
                least = fmin(least, half_of(ALL[k], 1e-4 * pow(1.01, j), 1));
            const double found = narrowest(&tries, ALL[k], share, 1, 0, INFINITY);
            CHECK_MSG(found < 1.5 * least && (k > 0 || found < 1.05 * least), "kind %d from %g: %g, not %g", k, share,
                      found, least);
            CHECK_MSG(k > 0 || tries <= 5, "%d tries from %g", tries, share);
        }
}

/* Where none is found at first, smaller ones are tried; and none beyond one that failed. */
TEST(shares_without_an_interval_are_left)
{
    int tries;
    CHECK(isfinite(narrowest(&tries, smooth, 100, 1, 0, 2)));
    CHECK(isfinite(narrowest(&tries, smooth, 100, 1, 30, INFINITY)));
    CHECK(!isfinite(narrowest(&tries, smooth, 100, 1, INFINITY, INFINITY)));
}
