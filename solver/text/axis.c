#include "text/axis.h"

#include <math.h>

bool uz_axis_has(double x, bool log)
{
    return isfinite(x) && (!log || x > 0.0);
}

void uz_range_take(uz_range *range, double x, bool log)
{
    if (!uz_axis_has(x, log))
        return;
    range->low = fmin(range->low, x);
    range->high = fmax(range->high, x);
}

uz_range uz_range_decades(uz_range range)
{
    uz_range out = {floor(log10(range.low)), ceil(log10(range.high))};
    if (!(out.high > out.low))
        out.high = out.low + 1.0;
    return out;
}

double uz_round_step(double x)
{
    const double power = pow(10.0, floor(log10(x)));
    for (int k = 0; k < 3; k++)
        if (x <= (k == 0 ? 1.0 : k == 1 ? 2.0 : 5.0) * power * (1.0 + 1e-9))
            return (k == 0 ? 1.0 : k == 1 ? 2.0 : 5.0) * power;
    return 10.0 * power;
}
