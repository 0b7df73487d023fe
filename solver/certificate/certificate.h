/* certificate.h: how far can an answer be from the exact one?
 *
 * Shares nothing with the methods and starts again from the original K, N, h, p. For any r <= 0 and any feasible v,
 * with K u_r = p + N'r:
 *
 *     pi(v) - psi(r) = 1/2 ||v - u_r||_K^2 - r'g(v)  >=  1/2 ||v - u*||_K^2 + 1/2 ||u_r - u*||_K^2
 *
 * Both terms on the left are >= 0, so nothing cancels, and v - u_r = K^-1 e with e = K v - p - N'r: the residual of the
 * linear solve and the distance between v and u_r enter as one quantity, ||e|| in the norm of K^-1.
 *
 * The u to certify is a vector of doubles: its gaps can't all be exactly zero or positive, and a gap of one rounding
 * error, times a reaction, under the root would limit every certificate to the root of the machine precision. So v is
 * u + c with a correction c of its own, as small as rounding where u is good, that lifts every negative gap and closes
 * the gaps of the rows in contact; u itself is then at most ||c||_K further away. Residuals and gaps are computed in
 * double-double precision: their rounding is far below that of u. */
#ifndef UZ_CERTIFICATE_H
#define UZ_CERTIFICATE_H

#include "brick/cells.h"
#include "certificate/bound.h"
#include "uzawa.h"

/* *value = e'K^-1 e for e (d, may be overwritten), within the accuracy of a factorization of K; any bound on it that is
 * not above `enough` serves as well. */
typedef uz_status (*uz_inverse_norm)(void *ctx, double *value, double *e, double enough, uz_error *err);

/* *doubt: how much the factorization's rounding may falsify that, relative (uz_distrust). */
typedef uz_status (*uz_measure_doubt)(void *ctx, double *doubt, uz_error *err);

/* From a factor of so many entries on it is worth sparing: one that no cache of a processor holds, so that reading it
 * takes longer than all the rest of a certificate. Plane bodies of 16,000 dofs have one, solids of 5,000. */
enum { UZ_CERTIFY_SPARES = 1500000 };

typedef struct {
    const uz_csc *K, *N;   /* lower triangle; m x d */
    const uz_brick *brick; /* what K is, of which only the diagonal is there then; NULL: K has its entries */
    const double *p, *h;
    uz_inverse_norm inverse_norm;
    uz_measure_doubt measure_doubt; /* asked where inverse_bound says that it may matter to what is sharp; NULL: there
                                       is no factor */
    void *ctx;                      /* of both */
    int64_t terms;                  /* uz_most_terms of K and N, or more; none positive: it is counted */
    double rcond;         /* without a factor: an estimate of the least eigenvalue of K, scaled by its diagonal */
    double inverse_bound; /* with one: what inverse_norm gives is at most so many times the sum of e_j^2 / K_jj */
    bool spares;          /* that takes the place of inverse_norm where it is sharp enough: */
    double sharp;         /* an error of ||e|| in the norm of K^-1, relative to the energy norm, that does no harm: half
                             of what is asked for. Where that is too much after all, nothing is spared */
    bool moved;           /* supports move the body; relative errors are then beside */
    uz_acting acting;     /* what else acts on it then */
    double whole_norm;    /* ||u||_K with the supported dofs */
} uz_certify_input;

/* u (d): the answer to certify. r (m): <= 0, else its positive part counts as e3 and r is cut at 0; where rows depend
 * on each other, reactions of rows that stay open go to rows that are closed. g (m): out, the gaps of u. absolute_error
 * bounds both ||u - u*||_K and ||u_r - u*||_K. When no feasible v was found near u the errors are INFINITY. */
uz_status uz_certify(uz_certificate *out, double *r, double *g, const double *u, const uz_certify_input *input,
                     uz_error *err);

/* *square >= e'K^-1 e = ||v - u_r||_K^2, with all that the rounding of the factor and of e may hide; INFINITY: none is
 * known. *spared: it was bounded by the inverse's norm, and e (d) stands; else that is lost. weighted: e'W e; energy:
 * u'Ku; sums: those that uz_bound_enlarge reads. */
uz_status uz_certify_distance(double *square, bool *spared, const uz_certify_input *input, double *e, int64_t d,
                              double weighted, double energy, const uz_energy_sums *sums, uz_error *err);

#endif
