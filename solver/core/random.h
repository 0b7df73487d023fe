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

/* The state after so many more numbers, by the squares of what leads to the next one (F. Brown, Trans. Am. Nucl. Soc.
 * 71 (1994)). */
static inline uint64_t uz_random_after(uint64_t state, uint64_t numbers)
{
    uint64_t factor = 6364136223846793005u, term = 1442695040888963407u;
    for (; numbers > 0; numbers >>= 1) {
        state = numbers & 1 ? state * factor + term : state;
        term *= factor + 1;
        factor *= factor;
    }
    return state;
}

/* Standard normal, of two numbers: Box and Muller 1958. */
static inline double uz_normal(uint64_t *state)
{
    double radius = sqrt(-2.0 * log(uz_uniform(state)));
    return radius * cos(6.283185307179586 * uz_uniform(state));
}

#endif
