/* block.h: several loads on one operator with one pass over its factor, where it `can` lanes. */
#ifndef UZ_DUAL_BLOCK_H
#define UZ_DUAL_BLOCK_H

#include "dual/dual.h"

/* Of one thread. Vectors of d are blocks x d x UZ_LANES: entry j of load l of block b at ((b * d) + j) * UZ_LANES + l;
 * lane b * UZ_LANES + l (lanes, see factor.h). */
typedef struct {
    const uz_dual *dual;
    int64_t blocks;
    double *P; /* loads: filled by the caller, lanes without a load with zeros, before uz_dual_block_forward; kept */
    double *U; /* displacements, by uz_dual_block_recover */
    double *Y, *X; /* in the factor's order: L^-1 P p, and room */
    double *room;  /* d */
} uz_dual_block;

uz_status uz_dual_block_create(uz_dual_block **out, const uz_dual *dual, int64_t blocks, uz_error *err);
void uz_dual_block_free(uz_dual_block *block);
/* Makes the loads of P ready, half a linear solve each. */
uz_status uz_dual_block_forward(uz_dual_block *block, uz_error *err);
/* The load of a lane, until the next uz_dual_block_forward. K and h (m) as in uz_dual_load_create. */
uz_status uz_dual_block_open(uz_dual_load **out, const uz_dual_block *block, int64_t lane, const uz_csc *K,
                             const double *h, uz_error *err);
/* `recover` of the form for the loads of lanes 0 .. count - 1, r[lane] (m). */
uz_status uz_dual_block_recover(uz_dual_block *block, uz_dual_load *const *loads, const double *const *r,
                                const bool *corrected, int64_t count, uz_error *err);

#endif
