#include "methods/milestones.h"

#include "core/clock.h"

#include <math.h>

/* Of a partial run (milestones.h): the solution on the rows kept is within c of that on all rows, for half the square
 * of their distance is at most the gap. So with b <= KEPT t and c <= ALL t the error is at most b (1 + c) + c <= t for
 * every t <= 1. */
#define KEPT 0.85
#define ALL  0.05

double uz_trade_error(int step)
{
    return pow(10.0, -(step + 1) / (double)UZ_TRADE_PER_DECADE);
}

void uz_trade_clear(uz_trade *trade)
{
    for (int k = 0; k < UZ_TRADE_STEPS; k++)
        trade->step[k] = (uz_trade_step){.seconds = NAN};
    trade->iterated_s = trade->total_s = 0.0;
}

void uz_milestones_init(uz_milestones *d, bool partial)
{
    *d = (uz_milestones){.partial = partial, .since = uz_seconds()};
    uz_trade_clear(&d->trade);
}

void uz_milestones_resume(uz_milestones *d, double spent_s)
{
    d->base = spent_s;
    d->since = uz_seconds();
}

static double seconds_now(const uz_milestones *d)
{
    return d->base + (uz_seconds() - d->since);
}

void uz_milestones_pause(uz_milestones *d)
{
    d->trade.iterated_s = seconds_now(d);
}

void uz_milestones_drop(uz_milestones *d, double bound)
{
    while (d->reached > 0 && !(bound <= uz_trade_error(d->reached - 1)))
        d->trade.step[--d->reached] = (uz_trade_step){.seconds = NAN};
}

void uz_milestones_note(uz_milestones *d, uz_milestone_of of, double bound, int64_t iterations, int64_t applications)
{
    if (!d)
        return;
    if (of != UZ_MILESTONE_OF_ITERATION)
        uz_milestones_drop(d, of == UZ_MILESTONE_OF_ALL_ROWS ? bound / ALL : bound);
    if (of == UZ_MILESTONE_OF_ALL_ROWS)
        d->partial = false;
    const double sure = d->partial ? bound / KEPT : bound;
    if (d->reached >= UZ_TRADE_STEPS || !(sure <= uz_trade_error(d->reached)))
        return; /* the clock is read only where something is reached for the first time */
    const uz_trade_step step = {.iterations = iterations,
                                .applications = applications,
                                .seconds = seconds_now(d),
                                .by_certificate = of != UZ_MILESTONE_OF_ITERATION && !d->partial};
    while (d->reached < UZ_TRADE_STEPS && sure <= uz_trade_error(d->reached))
        d->trade.step[d->reached++] = step;
}

void uz_trade_shift(uz_trade *trade, double seconds)
{
    for (int k = 0; k < UZ_TRADE_STEPS; k++)
        trade->step[k].seconds += seconds;
    trade->iterated_s += seconds;
    trade->total_s += seconds;
}

const uz_trade_step *uz_trade_reach(const uz_trade *trade, double relative_error)
{
    int k = 0;
    while (k < UZ_TRADE_STEPS && !(uz_trade_error(k) <= relative_error))
        k++;
    return k < UZ_TRADE_STEPS && !isnan(trade->step[k].seconds) ? &trade->step[k] : NULL;
}

double uz_trade_cost(const uz_trade *trade, const uz_trade_step *step)
{
    return step->by_certificate ? trade->total_s
                                : fmin(trade->total_s, step->seconds + (trade->total_s - trade->iterated_s));
}
