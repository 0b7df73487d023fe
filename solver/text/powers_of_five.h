/* powers_of_five.h: powers of five in 128 bits, from a small table, with a known error: what reading and writing
 * decimal numbers share. */
#ifndef UZ_LINALG_POWERS_OF_FIVE_H
#define UZ_LINALG_POWERS_OF_FIVE_H

#include <stdint.h>

__extension__ typedef unsigned __int128 uz_u128;

enum { UZ_FIVE_STEP = 27, UZ_FIVE_FIRST = -13 };
extern const uint64_t UZ_FIVE_STEPS[][2];
extern const uint64_t UZ_FIVES[UZ_FIVE_STEP];

/* The upper 128 of the 192 bits of a * b, rounded down. */
static inline uz_u128 uz_upper_product(uz_u128 a, uint64_t b)
{
    return (uz_u128)(uint64_t)(a >> 64) * b + (((uz_u128)(uint64_t)a * b) >> 64);
}

static inline uz_u128 uz_shift_up(uz_u128 x, int *exponent)
{
    int missing = (uint64_t)(x >> 127) == 0;
    *exponent -= missing;
    return x << missing;
}

/* A lower bound P of 5^q scaled to [2^127, 2^128): 5^q = P' 2^(exponent - 127) with P <= P' < P + 4.
 * The table is low by less than 1; the product with an exact factor below 2^64 and its truncation make that less than
 * 2, and the shift by at most one doubles it. */
static inline uz_u128 uz_power_of_five(int q, int *exponent)
{
    int step = (q - UZ_FIVE_STEP * UZ_FIVE_FIRST) / UZ_FIVE_STEP,
        rest = (q - UZ_FIVE_STEP * UZ_FIVE_FIRST) % UZ_FIVE_STEP;
    int step_power = UZ_FIVE_STEP * (step + UZ_FIVE_FIRST);
    int leading = __builtin_clzll(UZ_FIVES[rest]);
    /* floor(log2 5^n) = (1217359 n) >> 19 for |n| < 400 */
    *exponent = ((step_power * 1217359) >> 19) + (63 - leading) + 1;
    uz_u128 bound =
        uz_upper_product((uz_u128)UZ_FIVE_STEPS[step][0] << 64 | UZ_FIVE_STEPS[step][1], UZ_FIVES[rest] << leading);
    return uz_shift_up(bound, exponent);
}

#endif
