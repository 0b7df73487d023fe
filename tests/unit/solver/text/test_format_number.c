/* Doubles as text, held against printf and strtod: nothing shorter reads back, nothing as short is nearer. */
#include "harness.h"
#include "uzawa.h"

#include <float.h>
#include <locale.h>

/* The significant digits of a text without zeros around them, and the decimal exponent of the first. */
static int significant(char digits[40], int *exponent, const char *text)
{
    int count = 0, before = 0, skipped = 0;
    bool point = false;
    *exponent = 0;
    for (; *text && *text != 'e'; text++) {
        if (*text == '.')
            point = true;
        if (*text < '0' || *text > '9')
            continue;
        before += !point;
        if (count > 0 || *text != '0')
            digits[count++] = *text;
        else
            skipped++;
    }
    if (*text)
        *exponent = (int)strtol(text + 1, NULL, 10);
    *exponent += before - skipped - 1;
    while (count > 0 && digits[count - 1] == '0')
        count--;
    digits[count] = '\0';
    return count;
}

/* Does some number of `count` digits next to x read back as x? Both neighbours are tried: below a power of two doubles
 * lie closer, and the nearer one may miss. */
static bool reads_back_with(int count, double x)
{
    char text[64], near[64];
    snprintf(text, sizeof text, "%.*e", count - 1, x);
    if (strtod(text, NULL) == x)
        return true;
    uint64_t digits = 0;
    for (const char *c = text; *c != 'e'; c++)
        if (*c != '.')
            digits = 10 * digits + (uint64_t)(*c - '0');
    const int exponent = (int)strtol(strchr(text, 'e') + 1, NULL, 10) - (count - 1);
    for (int step = -1; step <= 1; step += 2) {
        snprintf(near, sizeof near, "%llde%d", (long long)digits + step, exponent);
        if (strtod(near, NULL) == x)
            return true;
    }
    return false;
}

/* x > 0 */
static bool is_best(double x)
{
    char text[UZ_DOUBLE_ROOM + 1], digits[40], nearest[64], want[40];
    int exponent, want_exponent;
    double back;
    const size_t length = uz_format_double(text, x);
    text[length] = '\0';
    if (length > 24 || strtod(text, NULL) != x || uz_parse_double(&back, text, length) != length || back != x)
        return false;
    const int count = significant(digits, &exponent, text);
    if (count > 17 || (count > 1 && reads_back_with(count - 1, x)))
        return false;
    snprintf(nearest, sizeof nearest, "%.*e", count - 1, x);
    significant(want, &want_exponent, nearest);
    return strtod(nearest, NULL) != x || (strcmp(digits, want) == 0 && exponent == want_exponent);
}

static void check_best(double x)
{
    if (isfinite(x) && x > 0)
        CHECK_MSG(is_best(x), "%a is not written at its best", x);
}

TEST(random_bits)
{
    uint64_t state = 88172645463325252u;
    for (int k = 0; k < 150000; k++) {
        double x;
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        const uint64_t bits = state >> 1;
        memcpy(&x, &bits, sizeof x);
        check_best(x);
        check_best((double)(state >> 11) * 0x1p-53);
    }
}

/* Where the doubles' spacing changes, and the denormals. */
TEST(around_powers_of_two)
{
    for (int e = 0; e < 2047; e++)
        for (int64_t step = -3; step <= 3; step++) {
            double x;
            const int64_t bits = ((int64_t)e << 52) + step;
            memcpy(&x, &bits, sizeof x);
            if (bits > 0)
                check_best(x);
        }
    for (int k = 1; k < 3000; k++)
        check_best(ldexp(k, -1074));
}

static void check_with_neighbours(double x)
{
    check_best(x);
    check_best(nextafter(x, 0));
    check_best(nextafter(x, INFINITY));
}

/* Numbers that have few digits, exact halves of the spacing among them: 9007199254740993, 5^k 2^e. */
TEST(short_decimals_and_exact_ties)
{
    char text[32];
    for (int e = -325; e <= 308; e++)
        for (int m = 1; m < 60; m++) {
            snprintf(text, sizeof text, "%de%d", m, e);
            check_with_neighbours(strtod(text, NULL));
        }
    double five = 1;
    for (int k = 0; k < 23; k++, five *= 5)
        for (int e = -120; e < 120; e += 3)
            check_with_neighbours(ldexp(five, e));
    for (int k = 1; k < 5000; k++) {
        check_best(k / 8.0);
        check_best(k * 0.001);
        check_best(k * 1e19);
        check_best(9007199254740992.0 + 2.0 * k);
        check_best(1e15 + k / 8.0);
    }
}

static void check_text(double x, const char *want)
{
    char text[UZ_DOUBLE_ROOM + 1];
    text[uz_format_double(text, x)] = '\0';
    CHECK_STR(text, want);
}

static void check_style(void)
{
    check_text(0.0, "0");
    check_text(-0.0, "-0");
    check_text(1.0, "1");
    check_text(-17.25, "-17.25");
    check_text(0.1, "0.1");
    check_text(0.1 + 0.2, "0.30000000000000004");
    check_text(0.0001, "0.0001");
    check_text(0.00012345, "0.00012345");
    check_text(0.00001, "1e-05");
    check_text(-1.5e-300, "-1.5e-300");
    check_text(999999999999999.0, "999999999999999");
    check_text(1e15, "1e+15");
    check_text(1234567890123456.0, "1234567890123456");
    check_text(1e22, "1e+22"); /* an interval that the table does not decide */
    check_text(1e23, "1e+23");
    check_text(5e-324, "5e-324");
    check_text(DBL_MAX, "1.7976931348623157e+308");
    check_text(DBL_MIN, "2.2250738585072014e-308");
    check_text(9007199254740993.0, "9007199254740992");
}

TEST(style_is_that_of_printf)
{
    check_style();
}

TEST(style_does_not_depend_on_the_locale)
{
    if (!setlocale(LC_NUMERIC, "de_DE.UTF-8") && !setlocale(LC_NUMERIC, "fr_FR.UTF-8")) {
        test_skip("no locale with a decimal comma is installed");
        return;
    }
    check_style();
    setlocale(LC_NUMERIC, "C");
}

TEST(integers)
{
    static const uint64_t values[] = {0, 1, 9, 10, 99, 100, 101, 12345, 1000000007, UINT64_MAX};
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        char text[UZ_DOUBLE_ROOM + 1], want[32];
        snprintf(want, sizeof want, "%llu", (unsigned long long)values[k]);
        text[uz_format_integer(text, values[k])] = '\0';
        CHECK_STR(text, want);
    }
}
