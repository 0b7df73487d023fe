#include "core/root.h"

#include <float.h>
#include <math.h>
#include <stdbool.h>

double uz_root_between(double (*f)(const void *ctx, double x), const void *ctx, double low, double high, double width)
{
    double at_low = f(ctx, low), x = low;
    int kept = 0; /* the end that the last step kept: -1 the low one, 1 the high one */
    if (at_low >= 0)
        return low;
    double at_high = f(ctx, high);
    if (at_high <= 0)
        return high;
    for (int k = 0; k < 200 && high - low > fmax(width, DBL_EPSILON * fmax(fabs(low), fabs(high))); k++) {
        const bool halve = k % 4 == 3;
        x = halve ? 0.5 * (low + high) : fmin(fmax(high - at_high * (high - low) / (at_high - at_low), low), high);
        const double at = f(ctx, x);
        if (at == 0)
            return x;
        if (at < 0) {
            low = x;
            at_low = at;
            at_high *= kept == 1 ? 0.5 : 1;
            kept = 1;
        } else {
            high = x;
            at_high = at;
            at_low *= kept == -1 ? 0.5 : 1;
            kept = -1;
        }
    }
    return x;
}
