/* A double as the shortest decimal that reads back, and of several such the nearest one.
 *
 * The algorithm is Giulietti's ("The Schubfach way to render doubles", 2020). v = c 2^e is what every number within
 * half a unit of c rounds to, an interval of width 2^e (three quarters of that where c is a power of two and the
 * doubles below lie closer). With 10^k the largest power of ten that is not wider, the interval holds at least one
 * multiple of 10^k, at most one of 10^(k+1), and no shorter number than that one if it is there.
 *
 * Instead of his table of 617 powers there is a small one that is low by a known amount (powers_of_five.h). It decides
 * all comparisons but those of numbers that lie within 2^-60 or so of the boundary; these are left to printf. */
#include "text/powers_of_five.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* digits * 10^exponent; 0 has digits 0 */
typedef struct {
    uint64_t digits;
    int exponent;
} decimal;

/* A real number by its floor, and whether it is that integer. */
typedef struct {
    uint64_t floor;
    bool whole;
} position;

enum { EXACT_POWERS = 54 }; /* 5^0 .. 5^54 stand in 128 bits without an error */

/* w 2^e 10^q for w < 2^56 and a result below 2^59, from power = P of uz_power_of_five(q) and the place n (124 .. 127)
 * of the binary point in w P. False: P's error could change the floor. If it could not, the true number is no integer
 * where P is not exact: for q > 54 the factor 2^(e+q) is too small for one, and for q < 0 an integer's w P ends, P
 * being low, in ones only. */
static bool place(position *out, uint64_t w, uz_u128 power, int n, bool exact)
{
    uz_u128 low = (uz_u128)(uint64_t)power * w, upper = (uz_u128)(uint64_t)(power >> 64) * w + (low >> 64);
    uint64_t ones = (UINT64_C(1) << (n - 64)) - 1, fraction = (uint64_t)upper & ones;
    out->floor = (uint64_t)(upper >> (n - 64));
    out->whole = exact && fraction == 0 && (uint64_t)low == 0;
    return exact || fraction != ones;
}

/* The three positions, in units of 10^k / 4, of the interval's ends and of v. */
typedef struct {
    position low, middle, high;
    bool closed; /* the ends round to v, too: c is even */
} interval;

static bool holds(const interval *i, uint64_t at)
{
    bool above = i->low.floor < at || (i->low.floor == at && i->low.whole && i->closed);
    bool below = at < i->high.floor || (at == i->high.floor && (!i->high.whole || i->closed));
    return above && below;
}

/* |x| > 0, finite. False: undecided. */
static bool shortest(decimal *out, double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int biased = (int)(bits >> 52 & 0x7ff), e = (biased ? biased : 1) - 1075, scale;
    uint64_t fraction = bits & ((UINT64_C(1) << 52) - 1), c = biased ? fraction | UINT64_C(1) << 52 : fraction;
    bool narrow = fraction == 0 && biased > 1;
    /* floor(log10 2^e) and floor(log10 (3/4 2^e)), right for |e| <= 1500; 400 makes what is divided positive */
    int k = (int)(((int64_t)e * 1262611 - (narrow ? 524031 : 0) + (INT64_C(400) << 22)) >> 22) - 400;
    uz_u128 power = uz_power_of_five(-k, &scale);
    int n = 127 - (e - k + scale);
    bool exact = k <= 0 && -k <= EXACT_POWERS;
    interval i = {.closed = c % 2 == 0};
    if (!(place(&i.low, 4 * c - (narrow ? 1 : 2), power, n, exact) && place(&i.middle, 4 * c, power, n, exact) &&
          place(&i.high, 4 * c + 2, power, n, exact)))
        return false;
    /* A number with fewer digits, or else the one of s and s + 1 that is nearer to v, the even one when there is a tie.
     */
    uint64_t s = i.middle.floor / 4, tens = s / 10 * 10, half = 4 * s + 2;
    bool lower = holds(&i, 4 * tens), upper = holds(&i, 4 * (tens + 10));
    out->exponent = k;
    out->digits = lower ? tens : tens + 10;
    if (lower || upper)
        return true;
    lower = holds(&i, 4 * s);
    upper = holds(&i, 4 * (s + 1));
    const bool tie = i.middle.floor == half && i.middle.whole;
    if (lower && upper)
        out->digits = tie ? s + (s & 1) : i.middle.floor >= half ? s + 1 : s;
    else
        out->digits = lower ? s : s + 1;
    return lower || upper;
}

/* printf writes the locale's decimal point, whatever bytes that is: only digits and the exponent are taken. */
static void by_printf(decimal *out, double x)
{
    for (int count = 1; count <= 17; count++) {
        char text[64], plain[64];
        double back;
        snprintf(text, sizeof text, "%.*e", count - 1, fabs(x));
        const char *e = strchr(text, 'e');
        *out = (decimal){0, (int)strtol(e + 1, NULL, 10) - (count - 1)};
        for (const char *at = text; at < e; at++)
            if (*at >= '0' && *at <= '9')
                out->digits = 10 * out->digits + (uint64_t)(*at - '0');
        int length = snprintf(plain, sizeof plain, "%llue%d", (unsigned long long)out->digits, out->exponent);
        if (uz_parse_double(&back, plain, (size_t)length) > 0 && back == fabs(x))
            return;
    }
}

static const char PAIRS[] =
    "0001020304050607080910111213141516171819202122232425262728293031323334353637383940414243444546"
    "47484950515253545556575859606162636465666768697071727374757677787980818283848586878889909192"
    "93949596979899";

/* Writes value so that it ends before `end`; returns where it begins. */
static char *digits_before(char *end, uint64_t value)
{
    for (; value >= 100; value /= 100)
        memcpy(end -= 2, PAIRS + 2 * (value % 100), 2);
    if (value >= 10)
        return memcpy(end - 2, PAIRS + 2 * value, 2);
    *--end = (char)('0' + value);
    return end;
}

/* Where %g puts the point. */
enum { PLAIN_LEAST = -4, PLAIN_DIGITS = 15 };

static char *put_decimal(char *out, const decimal *x)
{
    char room[24], *end = room + sizeof room, *digits = digits_before(end, x->digits);
    int count = (int)(end - digits), first = x->exponent + count - 1;
    if (first < PLAIN_LEAST || (first >= PLAIN_DIGITS && first >= count)) {
        *out++ = digits[0];
        if (count > 1)
            *out++ = '.';
        memcpy(out, digits + 1, (size_t)count - 1);
        out += count - 1;
        *out++ = 'e';
        *out++ = first < 0 ? '-' : '+';
        first = abs(first);
        if (first >= 100)
            *out++ = (char)('0' + first / 100);
        memcpy(out, PAIRS + 2 * (first % 100), 2);
        return out + 2;
    }
    if (first < 0) { /* 0.00ddd */
        memcpy(out, "0.000", 5);
        out += 1 - first;
        memcpy(out, digits, (size_t)count);
        return out + count;
    }
    int before = first + 1 < count ? first + 1 : count; /* digits before the point */
    memcpy(out, digits, (size_t)before);
    out += before;
    if (before < count) {
        *out++ = '.';
        memcpy(out, digits + before, (size_t)(count - before));
        return out + count - before;
    }
    memset(out, '0', (size_t)(first + 1 - count));
    return out + (first + 1 - count);
}

size_t uz_format_integer(char *out, uint64_t value)
{
    char room[24], *end = room + sizeof room, *digits = digits_before(end, value);
    memcpy(out, digits, (size_t)(end - digits));
    return (size_t)(end - digits);
}

size_t uz_format_double(char *out, double x)
{
    const double whole_limit = 1e15;
    char *at = out;
    decimal number;
    if (signbit(x))
        *at++ = '-';
    x = fabs(x);
    if (x < whole_limit && x == (double)(uint64_t)x)
        return (size_t)(at - out) + uz_format_integer(at, (uint64_t)x);
    if (!shortest(&number, x))
        by_printf(&number, x);
    while (number.digits % 10 == 0) {
        number.digits /= 10;
        number.exponent++;
    }
    return (size_t)(put_decimal(at, &number) - out);
}
