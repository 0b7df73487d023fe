/* candidates.h: contact rows that cannot matter are left out by trial and check.
 *
 * A part S of the m rows is chosen by the initial gaps, the problem of these rows alone is solved, and the gaps of the
 * rows left out are looked at in its answer. Where one is negative, rows are added and the problem is solved again.
 *
 * Why that is exact. Let u, r_S solve the reduced problem, and r be r_S with zeros for the rows left out. Of the
 * conditions of Karush, Kuhn and Tucker of the full problem
 *     K u = p + N'r,   r <= 0,   h - N u >= 0,   r'(h - N u) = 0
 * the first, second and last hold, as rows with r_i = 0 add nothing to them, and the third holds on S. So if no gap
 * left out is negative at u, all of them hold, and u is the answer of the full problem; K is positive definite, hence
 * the only one. Rows are only ever added, so the loop ends: at the latest with all rows.
 *
 * What the certificate says. An answer has errors, so the loop's own check proves nothing; the certificate does. Its
 * bound pi(v) - psi(r) (certificate/certificate.h) holds for any r <= 0 and any v that is feasible. Zeros appended to
 * r_S change neither psi(r) = -1/2 ||u_r||_K^2 + r'h with K u_r = p + N'r, nor r'g(v); so the bound of the reduced
 * problem is one for the full problem if, and only if, the v that was built for it is feasible for the rows left out,
 * too. The certificate therefore is asked on the full K, N, h and p, with u and the full r (it needs neither D nor rows
 * of the factor: O(nnz(N)) more): v then lifts every row, and what it says is of the full problem whatever was left
 * out. A row that was left out wrongly makes the bound worse, never wrong; uz_candidates_extend then adds it.
 *
 * What a further round costs. K does not change, its factor is used again. B, the dofs of the rows, becomes larger: the
 * condensed operator, whose trailing block of L belongs to B, must be made anew, or the round iterates with the
 * factored operator, which takes any N with the same factor. To make further rounds rare the first choice is generous
 * (UZ_CANDIDATES_REACH), and each extension takes more than the rows found violated. */
#ifndef UZ_OBSTACLE_CANDIDATES_H
#define UZ_OBSTACLE_CANDIDATES_H

#include "law/law.h"
#include "uzawa.h"

#include <float.h>

/* The part of a body's extent by which its points are first expected to come closer to an obstacle. What
 * strains and rotations of one part in a hundred make of it together: beyond that they are not small any more. */
#define UZ_CANDIDATES_REACH 0.02

/* Which of m rows are in the reduced problem. */
typedef struct {
    int64_t m, count;  /* count of them are */
    unsigned char *in; /* m: 1 or 0 */
} uz_candidates;

/* The rows whose gap h (m) is at most that of the closest row, or 0 if that is negative, plus `reach`, a length;
 * INFINITY takes all. Error: UZ_ERR_MEMORY. */
uz_status uz_candidates_first(uz_candidates *out, const double *h, int64_t m, double reach, uz_error *err);
void uz_candidates_clear(uz_candidates *candidates);

/* Gaps left out may be negative by this part of what they are the difference of, h - N u: size (m) = |h| + |N| |u|. */
#define UZ_GAP_ROUNDING (64 * DBL_EPSILON)
void uz_gap_sizes(double *size, const double *h, const uz_csc *N, const double *u);

/* Takes in every row whose gap g (m, all rows, at the reduced problem's answer) is negative by more than `rounding`
 * times size_i, size_i >= the terms that g_i is the difference of; a gap that is no number counts as negative. With
 * them come the rows whose gap is not wider than the deepest penetration: they would be next. Returns how many rows
 * were added: 0 ends the loop. */
int64_t uz_candidates_extend(uz_candidates *candidates, const uz_law *law, const double *g, const double *size,
                             double rounding);

/* N (m x d) without the rows left out: count x d. */
uz_status uz_candidates_reduce(uz_csc *out, const uz_csc *N, const uz_candidates *candidates, uz_error *err);
/* out (count) from all (m), and all (m) from part (count): zero where left out. */
void uz_candidates_gather(double *out, const double *all, const uz_candidates *candidates);
void uz_candidates_scatter(double *all, const double *part, const uz_candidates *candidates);

#endif
