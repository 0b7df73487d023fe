/* feasible.h: the feasible v = u + c of a certificate. */
#ifndef UZ_FEASIBLE_H
#define UZ_FEASIBLE_H

#include "certificate/row_move.h"
#include "certificate/row_settle.h"
#include "uzawa.h"

typedef struct {
    const uz_csc *Nt;     /* d x m: column i is row i of N */
    const double *weight; /* d: W = diag(K)^-1 */
    const double *h;      /* m */
    const double *u;      /* d: the answer; it and h are set before each use */
    double *size;         /* m: what the rounding of a gap is relative to */
    double *correction;   /* d: c */
    double *push;         /* m: see below */
    double *gap;          /* m: of `exact` */
    bool pushed;          /* an active set chose the rows */
    uz_row_settle exact;  /* what is left to be moved until no row penetrates, exactly */
    uz_row_move move;     /* m each */
    int64_t d, m;
} uz_feasible;

/* N' (n_b x m) of the rows of N on the n_b dofs that they touch, `dof` (n_b, ascending): all that a correction moves.
 */
uz_status uz_touched_dofs(uz_csc *Nt, int64_t **dof, const uz_csc *N, uz_error *err);

/* Nt and weight are borrowed. false: no memory; uz_feasible_clear may follow. */
bool uz_feasible_init(uz_feasible *f, const uz_csc *Nt, const double *weight);
void uz_feasible_clear(uz_feasible *f);

/* Fills the correction: it lifts the negative gaps of u and closes those of the rows where r (m) makes that worth
 * while. true: no gap of u + c + delta is negative, with a delta bounded in `exact`. Where an active set
 * chose the rows, r - push (<= 0) presses on closed rows only: -r'g is then nothing, where rows that r presses on can't
 * all be closed, and N'(r - push) differs from N'r by W^-1 c. */
bool uz_make_feasible(uz_feasible *f, const double *r);
/* -r'g, what the pair adds to the duality gap: at u + c, where a gap below 0 by rounding counts as one above, or at
 * u + c + delta. */
double uz_feasible_complementarity(const uz_feasible *f, const double *r, bool settled);

#endif
