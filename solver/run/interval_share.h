/* interval_share.h: which shares of the answer's gap and pressure are tried for an interval (bound/interval.h). */
#ifndef UZ_INTERVAL_SHARE_H
#define UZ_INTERVAL_SHARE_H

enum { UZ_MOST_SHARES = 7 };

/* Shares that were tried, ascending: |d| of their pairs, and half the intervals, INFINITY where there is none. */
typedef struct {
    int n;
    double share[UZ_MOST_SHARES], apart[UZ_MOST_SHARES], half[UZ_MOST_SHARES];
} uz_attempts;

/* To fewer than UZ_MOST_SHARES. */
void uz_attempts_add(uz_attempts *a, double share, double apart, double half);

/* The share to try next, 0: none that is expected to be worth it. last: the latest, of one at least; ball: sqrt(H). */
double uz_attempts_next(const uz_attempts *a, double last, double ball);

#endif
