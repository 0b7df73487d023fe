/* exact.h: the certificate of a small answer in rational numbers.
 *
 * Doubles hold r to 53 bits. Where the load is far larger than the forces of strain, p + N'r loses all of them by
 * cancellation, and where rows leave a gap far narrower than the rounding of u, no vector of doubles is feasible. Here
 * the feasible v and the reactions s of
 *
 *     pi(v) - psi(s) = 1/2 ||v - u_s||_K^2 - s'g(v)
 *
 * (certificate.h) are numbers of any length, gaps and K v - p - N's are exact, and so is ||u - v||_K: what rounding may
 * hide is that of ||v - u_s||_K alone, for which K is factored in as many bits. */
#ifndef UZ_EXACT_H
#define UZ_EXACT_H

#include "certificate/certificate.h"

#include <gmp.h>

/* Where they are better, the bounds and energies of *out (that of u, by uz_certify) become those which v (d) and s (m)
 * prove of u: absolute_error then bounds ||u - u*||_K and ||u_s - u*||_K. s is cut at 0, v need only be feasible
 * nearly. Of the input K, N, p, h and what is said of supports that move are read. Costs about nnz(K) products of
 * rational numbers and d^3 / 6 of v's length: for small problems. Errors: UZ_ERR_MEMORY. */
uz_status uz_certify_exact(uz_certificate *out, const double *u, const mpf_t *v, const mpf_t *s,
                           const uz_certify_input *input, uz_error *err);

#endif
