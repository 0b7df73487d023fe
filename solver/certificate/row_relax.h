/* row_relax.h: a small displacement that makes u feasible, one row after the other. */
#ifndef UZ_ROW_RELAX_H
#define UZ_ROW_RELAX_H

#include "uzawa.h"

/* u + c: n_i'(u + c) <= h_i is wanted for each row i, and equality as far as r_i < 0 is worth it. */
typedef struct {
    const uz_csc *Nt;     /* d x m: column i is row i of N */
    const double *weight; /* d: W > 0, diagonal, taken for K^-1 */
    const double *r;      /* m: <= 0 */
    const double *h;      /* m */
    const double *u;      /* d */
    double *push;         /* m, work: what row i pushes, >= r_i */
    double *c;            /* d: in and out; other dofs than those of rows are left alone */
} uz_row_relax;

/* From c = 0: approaches the least of 1/2 c'W^-1 c - r'g(u + c) over the feasible u + c, by relaxation of its dual
 * (Hildreth, Naval Res. Logist. Quart. 4 (1957)), then lifts what is left penetrating. Bears rows that depend on each
 * other or nearly so, which equations do not; slower than equations where many rows share dofs. The caller checks the
 * gaps. */
void uz_row_relax_solve(uz_row_relax *x);

#endif
