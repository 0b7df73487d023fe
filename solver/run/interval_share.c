/* interval_share.c: the share of the narrowest interval, from few that were tried.
 *
 * Half an interval is m H + |d|^2 / 4m, or |d| sqrt(H) where m is less than |d| / 2 sqrt(H), the one that suits |d|. A
 * pair for a share is one for larger ones, so that |d| gets smaller with a larger one, by leaps where what the answer
 * presses with has to be in balance with much else. From |d| of those that were tried, and what is expected between
 * them, follows where half is least. */
#include "run/interval_share.h"

#include <math.h>
#include <stdbool.h>

/* Shares are looked for by steps of this factor, to one that suits the last by no more than FAR, not beside those that
 * were tried by less than BESIDE, and as long as an interval is expected that is narrower than WORTH of the narrowest
 * so far. By what is more than LEVEL |d| falls no more. */
#define STEP   2.5
#define FAR    1000.0
#define BESIDE 1.15
#define WORTH  0.97
#define LEVEL  0.98

void uz_attempts_add(uz_attempts *a, double share, double apart, double half)
{
    int at = a->n++;
    for (; at > 0 && a->share[at - 1] > share; at--) {
        a->share[at] = a->share[at - 1];
        a->apart[at] = a->apart[at - 1];
        a->half[at] = a->half[at - 1];
    }
    a->share[at] = share;
    a->apart[at] = apart;
    a->half[at] = half;
}

/* |d| of a share: between those that were tried it falls, and beyond as beside them, as a power; or by a leap, in the
 * middle, before shares where it falls no more. */
static double expect_apart(const uz_attempts *a, double share)
{
    int k = 1;
    while (k < a->n - 1 && a->share[k] < share)
        k++;
    const double *A = a->apart + k, *m = a->share + k;
    if (k < a->n - 1 && A[1] > LEVEL * A[0] && share < m[0])
        return share * share >= m[-1] * m[0] ? A[0] : A[-1];
    return A[-1] * exp(fmin(0, log(A[0] / A[-1])) * log(share / m[-1]) / log(m[0] / m[-1]));
}

double uz_attempts_next(const uz_attempts *a, double last, double ball)
{
    enum { STEPS = 48 };
    double best, least = INFINITY, next = 0;
    int at = 0;
    for (int k = 1; k < a->n; k++)
        at = a->half[k] < a->half[at] ? k : at;
    best = a->half[at];
    if (a->n == UZ_MOST_SHARES || !(ball > 0) || !(a->apart[0] > 0) || !(a->apart[a->n - 1] > 0))
        return 0;
    if (a->n == 1) {
        const double suits = fmin(FAR * last, fmax(last / FAR, a->apart[0] / (2 * ball)));
        return fabs(suits - last) > 0.2 * last ? suits : STEP * last;
    }
    if (!isfinite(best))
        return a->share[0] / STEP;
    const double *first = a->share, *end = a->share + a->n - 1;
    const double low = fmin(*first / STEP, fmax(*first / FAR, a->apart[0] / (2 * ball))),
                 high = fmax(*end * STEP, fmin(*end * FAR, a->apart[a->n - 1] / (2 * ball)));
    if (at == a->n - 1 && high > *end * STEP) /* what it suits is no wider by it, and may be narrower */
        return high;
    if (a->n == 2 && at == 0 && last >= STEP * *first && a->apart[1] > LEVEL * a->apart[0]) /* |d| is not the least */
        return *first / STEP;
    for (int i = 0; i <= STEPS; i++) {
        const double m = low * pow(high / low, (double)i / STEPS), A = expect_apart(a, m);
        const double half = 2 * m * ball <= A ? A * ball : m * ball * ball + A * A / (4 * m);
        bool fresh = half < least;
        for (int k = 0; k < a->n && fresh; k++) /* what is no pair is not gone beyond */
            fresh = fmax(m, a->share[k]) > BESIDE * fmin(m, a->share[k]) &&
                    (isfinite(a->half[k]) || (m > a->share[k]) == (a->share[at] > a->share[k]));
        least = fresh ? half : least;
        next = fresh ? m : next;
    }
    return least < WORTH * best ? next : 0;
}
