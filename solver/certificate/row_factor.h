/* row_factor.h: N_A W N_A' = L L' for a set A of rows of N that grows and shrinks at its end.
 *
 * Row by row (up-looking: T. A. Davis, Direct Methods for Sparse Linear Systems, SIAM 2006, chapter 4), so that a row
 * that joins costs one sparse triangular solve, and one that depends on A is found before it joins. The columns of L
 * are lists that grow. Work to factor A: that of any sparse Cholesky factorization in the order in which rows join.
 *
 * The pivot of a row is the square of its distance from the span of A. Where little is left of it, it is computed from
 * the vector n_q - N_A'w itself with w corrected by its residual (corrected seminormal equations: A. Bjoerck, Linear
 * Algebra Appl. 88/89 (1987)): a difference of squares would lose half of the digits. */
#ifndef UZ_ROW_FACTOR_H
#define UZ_ROW_FACTOR_H

#include "uzawa.h"

typedef struct {
    int64_t row;
    double value;
} uz_row_entry;

typedef struct {
    uz_row_entry *below; /* the entries of L under the diagonal, downwards */
    int64_t count, room;
    double diagonal;
} uz_row_column;

typedef struct {
    const uz_csc *Nt;      /* d x m: column i is row i of N */
    const double *weight;  /* d: diagonal of W */
    uz_csc N;              /* m x d */
    int64_t count;         /* rows in A */
    int64_t *row;          /* m: these, in the order of L */
    int64_t *place;        /* m: of a row in L, -1: it is not in A */
    uz_row_column *column; /* m */
    double *size;          /* m: of all rows, n_i'W n_i */
    double work;           /* multiplications so far */
    /* The row pressed last: */
    double compliance; /* its pivot */
    bool dependent;    /* it has none beyond rounding */
    double *w;         /* m: (N_A W N_A')^-1 N_A W n_q, if asked for */
    double *left;      /* d: n_q - N_A'w, if asked for; 0 elsewhere */
    int64_t n_l, *l_place;
    double *l;           /* m: its row of L at the places l_place */
    double *x;           /* m, work: 0 */
    int64_t *stack;      /* m, work */
    bool *seen;          /* m, work: false */
    int64_t n_left, *at; /* d: where left is not 0 */
    bool *marked;        /* d: these */
} uz_row_factor;

/* Nt and weight are borrowed. false: no memory; uz_row_factor_clear may follow. */
bool uz_row_factor_init(uz_row_factor *f, const uz_csc *Nt, const double *weight);
void uz_row_factor_clear(uz_row_factor *f);

/* Sorts rows (n) so that they fill L little when they join in this order (CAMD). Without memory, or where the rows
 * share so many dofs that no order helps, they stay. */
void uz_row_factor_order(uz_row_factor *f, int64_t *rows, int64_t n);

/* What row q, not in A, has left of its compliance when A is held; in full: w and left too. */
void uz_row_factor_press(uz_row_factor *f, int64_t q, bool in_full);
/* The row pressed last joins A. false: no memory. */
bool uz_row_factor_join(uz_row_factor *f, int64_t q);
/* Of A the first `count` rows stay. */
void uz_row_factor_keep(uz_row_factor *f, int64_t count);
/* x (count) := (N_A W N_A')^-1 x */
void uz_row_factor_solve(uz_row_factor *f, double *x);

#endif
