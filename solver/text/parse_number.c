/* Decimal text to the nearest double, ties to even, independent of the locale.
 *
 * Three ways, cheapest first:
 *   1. at most 53 bits of digits and |exponent| <= 22: one exact product or quotient (Clinger, PLDI 1990);
 *   2. digits times a 128-bit lower bound of the power of five. The bound's error is known, so either every number in
 *      the interval rounds the same way, which decides it, or the text lies very near halfway between two doubles;
 *   3. strtod on at most 800 significant digits, written without a decimal point so that no locale can matter. */
#include "text/powers_of_five.h"
#include "uzawa.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* Adds the digits at text[at..len) to *w (mod 2^64) and returns where they end. */
static size_t take_digits(uint64_t *w, const char *text, size_t at, size_t len)
{
    uint64_t value = *w;
    while (at < len && is_digit(text[at]))
        value = 10 * value + (uint64_t)(text[at++] - '0');
    *w = value;
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
        s->digits = 10 * s->digits + (uint64_t)(text[at] - '0');
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
    s->mantissa_end = s->used = at;
    /* e or E, a sign, digits. Without digits there is no exponent and nothing is used. */
    if (at < len && (text[at] | 0x20) == 'e') {
        at++;
        const bool negative = at < len && text[at] == '-';
        if (at < len && (text[at] == '-' || text[at] == '+'))
            at++;
        if (at < len && is_digit(text[at])) {
            int64_t value = 0;
            for (; at < len && is_digit(text[at]); at++)
                value = value < EXPONENT_CEILING / 10 ? 10 * value + (text[at] - '0') : EXPONENT_CEILING;
            s->written_exponent = negative ? -value : value;
            s->used = at;
        }
    }
    s->exponent = s->written_exponent - (int64_t)point_digits;
    if (digits > WORD_DIGITS)
        keep_leading_digits(s, text);
    return true;
}

static const double POWERS_OF_TEN[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                       1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* Rounds digits * 10^q, -345 < q < 310, digits > 0, to *bits of a double. False: too near halfway to be decided. */
static bool interval_product(uint64_t *bits, uint64_t digits, int q)
{
    /* W P' lies in [W P, W P + 4 W): less than 5 above the truncated upper half, less than 10 after the shift. */
    const uz_u128 uncertainty = 10;
    int exponent, leading = __builtin_clzll(digits);
    uz_u128 power = uz_power_of_five(q, &exponent);
    exponent += q + 64 - leading; /* of the leading bit, if the product has its highest bit set */
    uz_u128 product = uz_shift_up(uz_upper_product(power, digits << leading), &exponent);
    if (exponent > 1023) {
        *bits = UINT64_C(0x7ff) << 52;
        return true;
    }
    int drop = exponent < -1022 ? 75 - 1022 - exponent : 75;
    if (drop > 126)
        return false;
    uz_u128 half = (uz_u128)1 << (drop - 1), rest = product & ((half << 1) - 1);
    if (rest <= half && rest + uncertainty >= half)
        return false;
    uint64_t biased = exponent < -1022 ? 0 : (uint64_t)(exponent + 1022); /* the mantissa's top bit adds the 1 */
    *bits = (biased << 52) + (uint64_t)(product >> drop) + (rest > half);
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

size_t uz_parse_double(double *value, const char *text, size_t len)
{
    scan s;
    uint64_t bits, above;
    double size = 0.0;
    *value = 0.0;
    if (!scan_number(&s, text, len))
        return 0;
    if (s.digits == 0) {
        *value = s.negative ? -0.0 : 0.0;
        return s.used;
    }
    if (!s.truncated && s.digits <= (UINT64_C(1) << 53) && s.exponent >= -22 && s.exponent <= 22) {
        size = s.exponent < 0 ? (double)s.digits / POWERS_OF_TEN[-s.exponent]
                              : (double)s.digits * POWERS_OF_TEN[s.exponent];
    } else if (s.exponent >= LARGEST_EXPONENT) {
        size = INFINITY;
    } else if (s.exponent > SMALLEST_EXPONENT && interval_product(&bits, s.digits, (int)s.exponent) &&
               (!s.truncated || (interval_product(&above, s.digits + 1, (int)s.exponent) && above == bits))) {
        memcpy(&size, &bits, sizeof size);
    } else if (s.exponent > SMALLEST_EXPONENT - WORD_DIGITS) {
        size = fallback_value(&s, text);
    }
    *value = s.negative ? -size : size;
    return s.used;
}
