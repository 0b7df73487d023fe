/* precise.h: a small problem in numbers of hundreds of bits.
 *
 * Where rows nearly contradict each other D = N K^-1 N' has entries that differ by less than doubles hold, and the
 * answer, if there is one, may be far away. This is what decides then: K = L L', B = L^-1 N', D = B'B and the dual
 * active set method of Goldfarb and Idnani (Math. Programming 27 (1983)) on D as principal pivots of a full tableau
 * (Keller, Math. Programming 5 (1973)), without regard to speed. What it says is a candidate: the certificate and the
 * proof of infeasibility, which start from the data, decide. */
#ifndef UZ_PRECISE_H
#define UZ_PRECISE_H

#include "core/hooks.h"
#include "uzawa.h"

#include <gmp.h>

typedef enum {
    UZ_PRECISE_SOLVED,
    UZ_PRECISE_RAY, /* r is a direction y <= 0 with N'y = 0 and h'y > 0 as far as three fifths of the bits can tell */
    UZ_PRECISE_LEFT /* told to stop, K not positive definite, or too many steps: nothing is known */
} uz_precise_end;

/* The bits that are used: few at first; more where loads are so much larger than the forces of strain, or so much
 * smaller than what holds the body, that few show nothing. */
enum { UZ_PRECISE_BITS = 512, UZ_PRECISE_MORE_BITS = 4096 };

/* Does it take no more than about so many seconds? d dofs, m rows. */
bool uz_precise_is_small(int64_t d, int64_t m, int bits, double seconds);

/* u (d), r (m) of mpf_t: out, or left alone; uz_precise_numbers made them with as many bits. K (d x d, lower triangle),
 * N (m x d), p, h: finite. stop may be NULL. Errors: UZ_ERR_MEMORY. */
uz_status uz_precise_solve(uz_precise_end *end, mpf_t *u, mpf_t *r, const uz_csc *K, const uz_csc *N, const double *p,
                           const double *h, int bits, const uz_stop *stop, uz_error *err);

/* n numbers, 0; NULL: no memory. x NULL is legal. */
mpf_t *uz_precise_numbers(int64_t n, int bits);
void uz_precise_free(mpf_t *x, int64_t n);
/* x to the nearest double, or nearly so. */
double uz_precise_round(const mpf_t x);

#endif
