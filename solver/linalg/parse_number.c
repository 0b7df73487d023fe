/* Decimal text to the nearest double, ties to even, independent of the locale.
 *
 * Three ways, cheapest first:
 *   1. at most 53 bits of digits and |exponent| <= 22: one exact product or quotient (Clinger, PLDI 1990);
 *   2. digits times a 128-bit lower bound of the power of five. The bound's error is known, so either every number in
 *      the interval rounds the same way, which decides it, or the text lies very near halfway between two doubles;
 *   3. strtod on at most 800 significant digits, written without a decimal point so that no locale can matter. */
#include "uzawa.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__extension__ typedef unsigned __int128 u128;

enum {
    WORD_DIGITS = 19,        /* decimal digits that always fit in 64 bits */
    FALLBACK_DIGITS = 800,   /* a double's halfway points have at most 767 significant digits */
    LARGEST_EXPONENT = 310,  /* 1e310 overflows whatever follows */
    SMALLEST_EXPONENT = -345 /* 1e-344 is less than half of the smallest denormal */
};

/* Written exponents saturate here: beyond any shift that the digits of a text in memory can make up for. */
static const int64_t EXPONENT_CEILING = 1000000000000000000;

/* The number is (-1)^negative * digits * 10^exponent; more digits were dropped if `truncated`. */
typedef struct {
    uint64_t digits;
    int64_t exponent;
    bool negative, truncated;
    size_t mantissa_begin, mantissa_end; /* text that holds the digits and the point */
    int64_t written_exponent;
    size_t used;
} scan;

static bool is_digit(char c)
{
    return (unsigned char)(c - '0') <= 9;
}

static uint64_t digit_value(char c)
{
    return (uint64_t)(unsigned char)(c - '0');
}

/* Adds the digits at text[at..len) to *w (mod 2^64) and returns where they end. */
static size_t take_digits(uint64_t *w, const char *text, size_t at, size_t len)
{
    uint64_t value = *w;
    while (at < len && is_digit(text[at]))
        value = 10 * value + digit_value(text[at++]);
    *w = value;
    return at;
}

/* After the mantissa: e or E, a sign, digits. Without digits there is no exponent and nothing is used. */
static size_t take_exponent(int64_t *exponent, const char *text, size_t at, size_t len)
{
    size_t start = at;
    *exponent = 0;
    if (at >= len || (text[at] | 0x20) != 'e')
        return start;
    at++;
    bool negative = at < len && text[at] == '-';
    if (at < len && (text[at] == '-' || text[at] == '+'))
        at++;
    if (at >= len || !is_digit(text[at]))
        return start;
    int64_t value = 0;
    for (; at < len && is_digit(text[at]); at++)
        value = value < EXPONENT_CEILING / 10 ? 10 * value + (int64_t)digit_value(text[at]) : EXPONENT_CEILING;
    *exponent = negative ? -value : value;
    return at;
}

/* Reads the mantissa again where it has more than 19 digits: leading zeros do not count, the rest is dropped. */
static void keep_leading_digits(scan *s, const char *text)
{
    int kept = 0;
    bool after_point = false;
    s->digits = 0;
    s->exponent = s->written_exponent;
    for (size_t at = s->mantissa_begin; at < s->mantissa_end; at++) {
        if (text[at] == '.') {
            after_point = true;
            continue;
        }
        if (kept == WORD_DIGITS) {
            s->exponent += !after_point;
            s->truncated = s->truncated || text[at] != '0';
            continue;
        }
        s->digits = 10 * s->digits + digit_value(text[at]);
        kept += s->digits != 0;
        s->exponent -= after_point;
    }
}

/* False: no number here. */
static bool scan_number(scan *s, const char *text, size_t len)
{
    size_t at = 0, point_digits = 0;
    memset(s, 0, sizeof *s);
    if (len > 0 && (text[0] == '-' || text[0] == '+'))
        s->negative = text[at++] == '-';
    s->mantissa_begin = at;
    at = take_digits(&s->digits, text, at, len);
    size_t digits = at - s->mantissa_begin;
    if (at < len && text[at] == '.') {
        size_t after = at + 1;
        at = take_digits(&s->digits, text, after, len);
        point_digits = at - after;
        digits += point_digits;
    }
    if (digits == 0)
        return false;
    s->mantissa_end = at;
    s->used = take_exponent(&s->written_exponent, text, at, len);
    s->exponent = s->written_exponent - (int64_t)point_digits;
    if (digits > WORD_DIGITS)
        keep_leading_digits(s, text);
    return true;
}

static const double POWERS_OF_TEN[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                       1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static bool exact_product(double *value, uint64_t digits, int64_t exponent)
{
    if (digits > (UINT64_C(1) << 53) || exponent < -22 || exponent > 22)
        return false;
    *value = exponent < 0 ? (double)digits / POWERS_OF_TEN[-exponent] : (double)digits * POWERS_OF_TEN[exponent];
    return true;
}

enum { STEP = 27, FIRST_STEP = -13 };

/* 5^(27 a) for a = -13 .. 11, scaled by a power of two to [2^127, 2^128) and rounded down; high word first. */
static const uint64_t FIVE_STEPS[][2] = {
    {0x8049a4ac0c5811aeu, 0x205b896d777d6278u}, /* 5^-351 */
    {0xcf42894a5dce35eau, 0x52064cac828675b9u}, {0xa76c582338ed2621u, 0xaf2af2b80af6f24eu},
    {0x873e4f75e2224e68u, 0x5a7744a6e804a291u}, {0xda7f5bf590966848u, 0xaf39a475506a899eu},
    {0xb080392cc4349decu, 0xbd8d794d96aacfb3u}, {0x8e938662882af53eu, 0x547eb47b7282ee9cu},
    {0xe65829b3046b0afau, 0x0cb4a5a3112a5112u}, {0xba121a4650e4ddebu, 0x92f34d62616ce413u},
    {0x964e858c91ba2655u, 0x3a6a07f8d510f86fu}, {0xf2d56790ab41c2a2u, 0xfae27299423fb9c3u},
    {0xc428d05aa4751e4cu, 0xaa97e14c3c26b886u}, {0x9e74d1b791e07e48u, 0x775ea264cf55347du},
    {0x8000000000000000u, 0x0000000000000000u}, /* 5^0 */
    {0xcecb8f27f4200f3au, 0x0000000000000000u}, {0xa70c3c40a64e6c51u, 0x999090b65f67d924u},
    {0x86f0ac99b4e8dafdu, 0x69a028bb3ded71a3u}, {0xda01ee641a708de9u, 0xe80e6f4820cc9495u},
    {0xb01ae745b101e9e4u, 0x5ec05dcff72e7f8fu}, {0x8e41ade9fbebc27du, 0x14588f13be847307u},
    {0xe5d3ef282a242e81u, 0x8f1668c8a86da5fau}, {0xb9a74a0637ce2ee1u, 0x6d953e2bd7173692u},
    {0x95f83d0a1fb69cd9u, 0x4abdaf101564f98eu}, {0xf24a01a73cf2dccfu, 0xbc633b39673c8cecu},
    {0xc3b8358109e84f07u, 0x0a862f80ec4700c8u}, /* 5^297 */
};

/* 5^b for b = 0 .. 26 */
static const uint64_t FIVES[STEP] = {
    1u, /* 5^0 */

    5u,
    25u,
    125u,
    625u,
    3125u,
    15625u,
    78125u,
    390625u,
    1953125u,
    9765625u,
    48828125u,
    244140625u,
    1220703125u,
    6103515625u,
    30517578125u,
    152587890625u,
    762939453125u,
    3814697265625u,
    19073486328125u,
    95367431640625u,
    476837158203125u,
    2384185791015625u,
    11920928955078125u,
    59604644775390625u,
    298023223876953125u,
    1490116119384765625u, /* 5^26 */
};

/* The upper 128 of the 192 bits of a * b, rounded down. */
static u128 upper_product(u128 a, uint64_t b)
{
    return (u128)(uint64_t)(a >> 64) * b + (((u128)(uint64_t)a * b) >> 64);
}

static u128 shift_up(u128 x, int *exponent)
{
    int missing = (uint64_t)(x >> 127) == 0;
    *exponent -= missing;
    return x << missing;
}

/* A lower bound P of 5^q scaled to [2^127, 2^128): 5^q = P' 2^(exponent - 127) with P <= P' < P + 4.
 * The table is low by less than 1; the product with an exact factor below 2^64 and its truncation make that less than
 * 2, and the shift by at most one doubles it. */
static u128 five_to(int q, int *exponent)
{
    int step = (q - STEP * FIRST_STEP) / STEP, rest = (q - STEP * FIRST_STEP) % STEP;
    int step_power = STEP * (step + FIRST_STEP);
    int leading = __builtin_clzll(FIVES[rest]);
    /* floor(log2 5^n) = (1217359 n) >> 19 for |n| < 400 */
    *exponent = ((step_power * 1217359) >> 19) + (63 - leading) + 1;
    u128 bound = upper_product((u128)FIVE_STEPS[step][0] << 64 | FIVE_STEPS[step][1], FIVES[rest] << leading);
    return shift_up(bound, exponent);
}

/* Rounds digits * 10^q, -345 < q < 310, digits > 0, to *bits of a double. False: too near halfway to be decided. */
static bool interval_product(uint64_t *bits, uint64_t digits, int q)
{
    /* W P' lies in [W P, W P + 4 W): less than 5 above the truncated upper half, less than 10 after the shift. */
    const u128 uncertainty = 10;
    int exponent, leading = __builtin_clzll(digits);
    u128 power = five_to(q, &exponent);
    exponent += q + 64 - leading; /* of the leading bit, if the product has its highest bit set */
    u128 product = shift_up(upper_product(power, digits << leading), &exponent);
    if (exponent > 1023) {
        *bits = UINT64_C(0x7ff) << 52;
        return true;
    }
    int drop = exponent < -1022 ? 75 - 1022 - exponent : 75;
    if (drop > 126)
        return false;
    u128 half = (u128)1 << (drop - 1), rest = product & ((half << 1) - 1);
    if (rest <= half && rest + uncertainty >= half)
        return false;
    uint64_t biased = exponent < -1022 ? 0 : (uint64_t)(exponent + 1022); /* the mantissa's top bit adds the 1 */
    *bits = (biased << 52) + (uint64_t)(product >> drop) + (rest > half);
    return true;
}

static bool interval_value(double *value, const scan *s)
{
    uint64_t bits, above;
    int q = (int)s->exponent;
    if (!interval_product(&bits, s->digits, q))
        return false;
    if (s->truncated && (!interval_product(&above, s->digits + 1, q) || above != bits))
        return false;
    memcpy(value, &bits, sizeof *value);
    return true;
}

/* As many digits as can matter, then "e" and the exponent; a lone 1 stands for whatever follows them. */
static double fallback_value(const scan *s, const char *text)
{
    char copy[FALLBACK_DIGITS + 32];
    int count = 0, saved_errno = errno;
    int64_t exponent = s->written_exponent;
    bool after_point = false, more = false;
    for (size_t at = s->mantissa_begin; at < s->mantissa_end; at++) {
        if (text[at] == '.') {
            after_point = true;
        } else if (count == FALLBACK_DIGITS) {
            more = more || text[at] != '0';
            exponent += !after_point;
        } else {
            if (count > 0 || text[at] != '0')
                copy[count++] = text[at];
            exponent -= after_point;
        }
    }
    if (more) {
        copy[count++] = '1';
        exponent--;
    }
    snprintf(copy + count, sizeof copy - (size_t)count, "e%lld", (long long)exponent);
    double value = strtod(copy, NULL);
    errno = saved_errno;
    return value;
}

static double magnitude(const scan *s, const char *text)
{
    double value;
    if (s->digits == 0)
        return 0.0;
    if (!s->truncated && exact_product(&value, s->digits, s->exponent))
        return value;
    if (s->exponent >= LARGEST_EXPONENT)
        return INFINITY;
    if (s->exponent <= SMALLEST_EXPONENT - WORD_DIGITS)
        return 0.0;
    if (s->exponent > SMALLEST_EXPONENT && interval_value(&value, s))
        return value;
    return fallback_value(s, text);
}

size_t uz_parse_double(double *value, const char *text, size_t len)
{
    scan s;
    *value = 0.0;
    if (!scan_number(&s, text, len))
        return 0;
    double size = magnitude(&s, text);
    *value = s.negative ? -size : size;
    return s.used;
}
