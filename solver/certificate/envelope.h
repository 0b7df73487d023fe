/* envelope.h: a Cholesky factor within the envelope of a matrix: short, and nobody else's. */
#ifndef UZ_CERTIFICATE_ENVELOPE_H
#define UZ_CERTIFICATE_ENVELOPE_H

#include "core/hooks.h"
#include "uzawa.h"

/* Columns of a block, of which all have room from its first row to the last one that the envelope has in any. */
enum { UZ_ENVELOPE_BLOCK = 32 };

typedef struct {
    int64_t n, blocks;
    int64_t *place, *end, *start; /* n: where each dof stands; of each block the row after its last, and where it is */
    double *L;
} uz_envelope;

/* A = L L' of a symmetric matrix given by its lower triangle, in the order of Cuthill and McKee reversed. *definite:
 * each pivot was more than `least` times its entry of `size` (n, positive), or there is no factor. Memory grows as n
 * times the bandwidth, time as n times its square, of a cube of n dofs in bricks as n^(7/3): 1e10 multiplications for
 * 14,000. Source: George and Liu, "Computer Solution of Large Sparse Positive Definite Systems", ch. 4. stop (NULL:
 * never) is asked before each block; where it is due there is no factor either. UZ_ERR_MEMORY. The caller clears *out
 * in every case. */
uz_status uz_envelope_factor(uz_envelope *out, bool *definite, const uz_csc *A, const double *size, double least,
                             const uz_stop *stop, uz_error *err);
/* x (n) becomes L^-1 x, in the order of the factor: x'x is then x' A^-1 x. */
void uz_envelope_forward(double *x, const uz_envelope *factor, double *room);
void uz_envelope_clear(uz_envelope *factor);
/* What it takes, with what finds its order: of a factor, or of that which A would have; 0: no memory to tell. */
double uz_envelope_bytes(const uz_envelope *factor);
double uz_envelope_predict(const uz_csc *A);

#endif
