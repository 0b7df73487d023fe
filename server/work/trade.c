#include "work/trade.h"

#include <math.h>
#include <string.h>

/* version, iterated_s, total_s, steps reached; then a row for each moment: its first step, seconds, iterations,
 * applications, by_certificate. Steps are reached in order, so that the reached ones come first. */
#define VERSION 1.0

static int reached(const uz_trade *trade)
{
    int n = 0;
    while (n < UZ_TRADE_STEPS && !isnan(trade->step[n].seconds))
        n++;
    return n;
}

int64_t trade_pack(double out[TRADE_NUMBERS], const uz_trade *trade)
{
    const int n = reached(trade);
    double *row = out + TRADE_HEAD;
    const double head[TRADE_HEAD] = {VERSION, trade->iterated_s, trade->total_s, n};
    memcpy(out, head, sizeof head);
    for (int k = 0; k < n; k++) {
        const uz_trade_step *s = &trade->step[k];
        if (k > 0 && !(s->seconds < s[-1].seconds || s->seconds > s[-1].seconds) && s->iterations == s[-1].iterations &&
            s->applications == s[-1].applications && s->by_certificate == s[-1].by_certificate)
            continue; /* the same moment */
        const double numbers[TRADE_COLUMNS] = {k, s->seconds, (double)s->iterations, (double)s->applications,
                                               s->by_certificate};
        memcpy(row, numbers, sizeof numbers);
        row += TRADE_COLUMNS;
    }
    return row - out;
}

/* Counts in doubles, as this version writes them. */
static bool is_count(double x, double most)
{
    return x >= 0.0 && x <= most && !(x < floor(x) || x > floor(x));
}

bool trade_unpack(uz_trade *out, const double *x, int64_t count)
{
    static const double MOST = 9007199254740992.0; /* 2^53 */
    uz_trade_clear(out);
    if (!(count >= TRADE_HEAD && count <= TRADE_NUMBERS && (count - TRADE_HEAD) % TRADE_COLUMNS == 0 &&
          is_count(x[0] - VERSION, 0.0) && x[1] >= 0.0 && x[2] >= 0.0 && is_count(x[3], UZ_TRADE_STEPS)))
        return false;
    const int n = (int)x[3];
    bool good = true;
    int least = 0; /* the first step of the next row */
    for (const double *row = x + TRADE_HEAD; good && row < x + count; row += TRADE_COLUMNS) {
        good = is_count(row[0], n - 1) && (int)row[0] >= least && row[1] >= 0.0 && is_count(row[2], MOST) &&
               is_count(row[3], MOST);
        for (int k = good ? (int)row[0] : n; k < n; k++) /* until another row says otherwise */
            out->step[k] = (uz_trade_step){.seconds = row[1],
                                           .iterations = (int64_t)row[2],
                                           .applications = (int64_t)row[3],
                                           .by_certificate = row[4] > 0.0};
        least = good ? (int)row[0] + 1 : n;
    }
    good = good && reached(out) == n;
    if (!good)
        uz_trade_clear(out);
    out->iterated_s = good ? x[1] : 0.0;
    out->total_s = good ? x[2] : 0.0;
    return good;
}

void trade_join(uz_trade *later, const uz_trade *earlier)
{
    const int n = reached(earlier);
    for (int k = 0; k < UZ_TRADE_STEPS; k++) {
        later->step[k].seconds += earlier->total_s;
        later->step[k].applications += n > 0 ? earlier->step[n - 1].applications : 0;
    }
    later->iterated_s += earlier->total_s;
    later->total_s += earlier->total_s;
    memcpy(later->step, earlier->step, (size_t)n * sizeof *later->step);
}
