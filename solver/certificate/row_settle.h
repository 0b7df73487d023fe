/* row_settle.h: is there a displacement without any penetration near a given one? In rational numbers.
 *
 * Gaps in double-double arithmetic are known to about 2^-100 of the terms that they are the difference of. Where these
 * are far larger than what the rows ask for, a penetration below that may be all that a contradiction amounts to, or
 * what the answer hangs on: no tolerance is small enough. So gaps that double-double arithmetic can't tell from a
 * penetration are computed exactly; rows that do penetrate are moved, each by the exact method of Goldfarb and Idnani
 * (Math. Programming 27 (1983)) with W for K^-1 on the rows around it. */
#ifndef UZ_ROW_SETTLE_H
#define UZ_ROW_SETTLE_H

#include "uzawa.h"

#include <gmp.h>

typedef struct {
    const uz_csc *Nt;     /* d x m: column i is row i of N */
    const double *weight; /* d: W > 0, diagonal */
    const double *h;      /* m */
    const double *u, *c;  /* d: rows are to be open at u + c + delta */
    mpq_t *at;            /* d, or NULL: in place of u + c, and delta is added to it */
    double work;          /* at most so many words multiplied; 0: as many as a bound is worth, about a second */
    /* out, without `at`: */
    double length; /* a bound on ||delta||_K for every K with the diagonal W^-1; 0: u + c needs none */
    double *gap;   /* m: where length is not 0: at least the gaps of u + c + delta */
} uz_row_settle;

/* false: rows contradict each other, numbers are not finite, there is no memory, or it takes more work than a bound is
 * worth. */
bool uz_row_settle_solve(uz_row_settle *problem);

#endif
