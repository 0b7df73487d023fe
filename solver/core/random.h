/* random.h: repeatable pseudo-random numbers. */
#ifndef UZ_CORE_RANDOM_H
#define UZ_CORE_RANDOM_H

#include <math.h>
#include <stdint.h>

/* In (0, 1). Knuth's MMIX multiplier. */
static inline double uz_uniform(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return ((double)(*state >> 11) + 0.5) * 0x1p-53;
}

/* Standard normal: Box and Muller 1958. */
static inline double uz_normal(uint64_t *state)
{
    double radius = sqrt(-2.0 * log(uz_uniform(state)));
    return radius * cos(6.283185307179586 * uz_uniform(state));
}

#endif
