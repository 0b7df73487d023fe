/* contact_proof.h: are rows in contact in the exact solution of an augmented problem?
 *
 * Let u be near its exact solution u0, ||u - u0|| <= error in the norm of K_R, and let z have n_i'z = 1 and n_k'z <= 0
 * for all other rows k. With the exact reactions r0 <= 0,
 *
 *     r0_i <= z'N'r0 = z'(K_R u0 - p_R) <= z'(K_R u - p_R) + ||z|| error      in the norm of K_R,
 *
 * and where that is negative, complementarity gives n_i'u0 = h_i exactly. When every augmented row is in contact, u0
 * meets the KKT conditions of the problem without the augmentation, and is its solution as K is semidefinite.
 *
 * Two kinds of rows need not care for z: rows that are surely open, as |n_k'(u - u0)| is at most error times the norm
 * of n_k in K_R^-1; and rows that say no more than row i does (parallel, with no smaller gap): their contact is its. */
#ifndef UZ_CONTACT_PROOF_H
#define UZ_CONTACT_PROOF_H

#include "semicoercive/augment.h"

typedef struct {
    const uz_singular *of;
    const uz_csc *Nt;
    const double *inverse; /* d: W of uz_row_stiffness */
    const double *weight;  /* m: R; rows with weight > 0 are the ones to prove, their target is h */
    const double *u, *r;   /* d, m: the answer */
    double error;          /* of u, in the norm of K_R */
    double inverse_bound;  /* of K_R, as in certificate.h, for W; INFINITY: unknown, no row is surely open */
} uz_contact_claim;

typedef enum {
    UZ_CONTACT_PROVED,
    UZ_CONTACT_TOO_COARSE, /* a smaller error may prove it */
    UZ_CONTACT_DENIED,     /* a row does not press */
    UZ_CONTACT_NO_WITNESS  /* a row has no z */
} uz_contact_verdict;

/* provable (m): rows found to have no z become false. */
uz_status uz_prove_contact(uz_contact_verdict *verdict, bool *provable, const uz_contact_claim *claim, uz_error *err);

#endif
