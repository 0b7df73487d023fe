/* row_exact.h: the least displacement that makes u feasible, by an active set.
 *
 *     minimize  1/2 c'W^-1 c - r'g(u + c)   subject to   g(u + c) >= 0
 *
 * is the certificate's own bound with W (diagonal) for K^-1. Its c is -W N'y with pushes y >= r: a row is closed, or
 * its push is at the bound. From the rows that the reactions speak for, all wrong rows change places as long as that
 * brings their number down; then one at a time (Goldfarb and Idnani, Math. Programming 27 (1983)), which ends however
 * the rows depend on each other. Gaps are taken from the original data in double-double arithmetic after each step, so
 * that the equations are as exact as c, a vector of doubles, can be. Cost: a sparse Cholesky factorization on the rows
 * in contact, and a part of one for each row that changes places later. */
#ifndef UZ_ROW_EXACT_H
#define UZ_ROW_EXACT_H

#include "uzawa.h"

typedef struct {
    const uz_csc *Nt;     /* d x m: column i is row i of N */
    const double *weight; /* d: W > 0, diagonal */
    const double *r;      /* m: <= 0; rows of 0 are closed only where they would penetrate */
    const double *h;      /* m */
    const double *u;      /* d */
    const double *size;   /* m: what the rounding of a gap is relative to */
    double negligible;    /* a penetration of this part of the size is none */
    double *c;            /* d: out */
    double *y;            /* m: out, the pushes. r - y presses on closed rows only, and N'(r - y) = N'r + W^-1 c */
} uz_row_exact;

/* false: not found: the rows contradict each other, there is no memory, or it takes more work than a bound is worth. */
bool uz_row_exact_solve(const uz_row_exact *problem);

#endif
