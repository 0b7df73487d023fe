/* row_move.h: the least displacement that changes given gaps by given amounts. */
#ifndef UZ_ROW_MOVE_H
#define UZ_ROW_MOVE_H

#include "uzawa.h"

/* n_i'W n_i, the compliance of row i when W (diagonal, weight) is taken for K^-1. Nt: columns are the rows of N. */
double uz_row_compliance(const uz_csc *Nt, int64_t i, const double *weight);

typedef struct {
    int64_t m;
    bool *in;                                         /* m: rows that take part */
    double *target;                                   /* m: n_i'c asked for */
    double *x, *residual, *direction, *image, *scale; /* m: conjugate gradients */
    double *dofs;                                     /* d */
} uz_row_move;

bool uz_row_move_init(uz_row_move *move, int64_t d, int64_t m); /* false: no memory */
void uz_row_move_clear(uz_row_move *move);

/* c += the vector of least W^-1 norm with n_i'c = target_i on the rows that take part: c = W N'x with
 * (N W N') x = target, by conjugate gradients with diagonal scaling (Hestenes and Stiefel 1952), which bears dependent
 * rows. Nt: columns are the rows of N. weight: diagonal of W. false: these steps have not ended. */
bool uz_row_move_solve(uz_row_move *move, double *c, const uz_csc *Nt, const double *weight);

#endif
