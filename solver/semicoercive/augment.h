/* augment.h: a problem with a singular K as one with a regular K.
 *
 * For a diagonal R >= 0 (weights of rows) and a target t of the rows, the augmented problem is
 *
 *     minimize 1/2 u'Ku - p'u + 1/2 (N u - t)'R (N u - t)   subject to   N u <= h,
 *
 * that is K_R = K + N'R N and p_R = p + N'R t with the same rows. Its minimizer u solves the problem itself where
 * R (N u - t) = 0. With t = N u of the step before it is the proximal point method (Rockafellar, SIAM J. Control Optim.
 * 14 (1976)); with t = h on rows that are in contact, the exact augmentation. */
#ifndef UZ_AUGMENT_H
#define UZ_AUGMENT_H

#include "uzawa.h"

/* The problem itself. All borrowed: K lower triangle, d x d; N m x d; p d; h m. */
typedef struct {
    const uz_csc *K, *N;
    const double *p, *h;
} uz_singular;

/* stiffness (m): that of the rows of N (d x m: Nt), 1 / (n_i'W n_i) with W the inverse diagonal of K, cut to a power of
 * two; 0 for a row of zeros. inverse (d): W, where a diagonal entry that is zero counts as the largest. */
void uz_row_stiffness(double *stiffness, double *inverse, const uz_csc *K, const uz_csc *Nt);

/* *out = the augmented problem, in matrices: its K and p are its own, N and h those of `of`. weight, target: m.
 * Freed with uz_augmented_clear. */
uz_status uz_augment(uz_problem *out, const uz_singular *of, const uz_csc *Nt, const double *weight,
                     const double *target, uz_error *err);
void uz_augmented_clear(uz_problem *augmented);

/* noise (d): a bound on the force on each dof by which K_R u - p_R of `augmented` may differ from the exact one,
 * because K_R and p_R are rounded. */
void uz_augmented_noise(double *noise, const uz_problem *augmented, const uz_csc *Nt, const double *weight,
                        const double *target, const double *u);

#endif
