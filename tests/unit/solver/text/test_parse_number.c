/* Decimal text to double: against strtod of the C library, and against values that are known by construction. */
#include "harness.h"
#include "uzawa.h"

#include <float.h>
#include <locale.h>

static uint64_t state = 88172645463325252u;

static uint64_t next_random(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static double from_bits(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint64_t to_bits(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static double random_finite(void)
{
    double value = from_bits(next_random());
    return isfinite(value) ? value : 1.5;
}

static void check_text(const char *text, double want)
{
    double got;
    size_t used = uz_parse_double(&got, text, strlen(text));
    CHECK_MSG(used == strlen(text) && to_bits(got) == to_bits(want), "\"%.60s\": used %zu, got %a, want %a", text, used,
              got, want);
}

static void check_against_strtod(const char *text)
{
    check_text(text, strtod(text, NULL));
}

TEST(printed_doubles_of_every_magnitude)
{
    static const char *const formats[] = {"%.17g", "%.16e", "%.15g", "%.19e", "%.25e", "%g", "%.9e"};
    char text[64];
    for (int k = 0; k < 700000; k++) {
        snprintf(text, sizeof text, formats[k % 7], random_finite());
        check_against_strtod(text);
    }
}

TEST(moderate_numbers_in_fixed_notation)
{
    char text[128];
    for (int k = 0; k < 300000; k++) {
        double value = (double)(int64_t)next_random() * pow(10.0, (double)(next_random() % 30) - 30.0);
        snprintf(text, sizeof text, "%.*f", (int)(next_random() % 25), value);
        check_against_strtod(text);
    }
}

/* A sign, 1 to 40 digits with a point anywhere, and an exponent that may overflow or underflow. */
TEST(random_digit_strings)
{
    for (int k = 0; k < 1000000; k++) {
        char text[64], *at = text;
        int digits = 1 + (int)(next_random() % 40), point = (int)(next_random() % 48);
        if (next_random() % 3 == 0)
            *at++ = next_random() % 2 ? '-' : '+';
        for (int d = 0; d < digits; d++) {
            if (d == point)
                *at++ = '.';
            *at++ = next_random() % 4 == 0 ? '0' : (char)('0' + next_random() % 10);
        }
        snprintf(at, 12, "%c%d", next_random() % 2 ? 'e' : 'E', (int)(next_random() % 760) - 400);
        check_against_strtod(text);
    }
}

TEST(integers_at_the_edge_of_53_and_64_bits)
{
    char text[32];
    for (int shift = 50; shift < 64; shift++) {
        for (int64_t offset = -40; offset <= 40; offset++) {
            snprintf(text, sizeof text, "%llu", (unsigned long long)((UINT64_C(1) << shift) + (uint64_t)offset));
            check_against_strtod(text);
        }
    }
}

/* Halfway between two neighbours: to even; a digit more or less far behind decides otherwise. */
static void check_halfway(double low)
{
    double high = nextafter(low, INFINITY), even = to_bits(low) % 2 == 0 ? low : high;
    char text[1400];
    long double middle = (long double)low + ((long double)high - (long double)low) / 2;
    if (!isfinite(high) || low <= 0.0)
        return;
    snprintf(text, sizeof text, "%.800Le", middle);
    check_text(text, even);
    char *exponent = strchr(text, 'e'), tail[32];
    snprintf(tail, sizeof tail, "%s", exponent);
    snprintf(exponent, 600, "%0*d%s", 300, 1, tail);
    check_text(text, high);
    char *last = exponent;
    while (last[-1] == '0')
        last--;
    if (last[-1] == '.')
        return;
    last[-1]--; /* the last digit that is not 0: just below the middle */
    snprintf(last, 700, "%s%s", "999999999999999999999999", tail);
    check_text(text, low);
}

TEST(halfway_between_neighbours)
{
    if (LDBL_MANT_DIG < 64) {
        test_skip("long double is no wider than double here");
        return;
    }
    static const double special[] = {5e-324, 1e-323, 2.2250738585072009e-308, DBL_MIN, 1.0, 0.1, 9007199254740992.0,
                                     1e22,   1e23,   1.7976931348623155e308};
    for (size_t k = 0; k < sizeof special / sizeof special[0]; k++)
        check_halfway(special[k]);
    for (int k = 0; k < 4000; k++)
        check_halfway(fabs(random_finite()));
    for (int k = 0; k < 4000; k++)
        check_halfway(ldexp(1.0 + (double)(next_random() % 1000000) / 1048576.0, (int)(next_random() % 120) - 60));
}

TEST(edges_of_the_range)
{
    check_text("1.7976931348623157e308", DBL_MAX);
    check_text("1.7976931348623158e308", DBL_MAX);
    check_text("1.7976931348623159e308", INFINITY);
    check_text("-1e309", -INFINITY);
    check_text("1e999999999999999999999999", INFINITY);
    check_text("1e-999999999999999999999999", 0.0);
    check_text("0e999999999999999999999999", 0.0);
    check_text("-0", -0.0);
    check_text("-0.0e5", -0.0);
    check_text("4.9406564584124654e-324", 5e-324);
    check_text("2.4703282292062328e-324", 5e-324);
    check_text("2.4703282292062327e-324", 0.0);
    check_text("2.2250738585072011e-308", 2.225073858507201e-308);
    check_text("2.2250738585072014e-308", DBL_MIN);
}

TEST(many_zeros_do_not_count_as_digits)
{
    char text[3000];
    snprintf(text, sizeof text, "0.%01000d5e1001", 0);
    check_text(text, 5.0);
    snprintf(text, sizeof text, "%01000d5", 0);
    check_text(text, 5.0);
    snprintf(text, sizeof text, "5%01000de-1000", 0);
    check_text(text, 5.0);
    snprintf(text, sizeof text, "9007199254740993.%01500d1", 0);
    check_text(text, 9007199254740994.0);
    snprintf(text, sizeof text, "9007199254740993.%01500d", 0);
    check_text(text, 9007199254740992.0);
    snprintf(text, sizeof text, "9007199254740993%01500d1e-1501", 0);
    check_text(text, 9007199254740994.0);
}

static void check_prefix(const char *text, size_t used, double value)
{
    double got;
    size_t n = uz_parse_double(&got, text, strlen(text));
    CHECK_MSG(n == used && got == value, "\"%s\": used %zu, got %g; want %zu, %g", text, n, got, used, value);
}

TEST(takes_the_number_and_nothing_more)
{
    check_prefix("1 2", 1, 1.0);
    check_prefix("1.5.5", 3, 1.5);
    check_prefix("5.", 2, 5.0);
    check_prefix("+.5x", 3, 0.5);
    check_prefix("1e", 1, 1.0);
    check_prefix("1e+", 1, 1.0);
    check_prefix("1e+5e", 4, 1e5);
    check_prefix("1d5", 1, 1.0);
    check_prefix("0x10", 1, 0.0);
    check_prefix("1,5", 1, 1.0);
    static const char *const none[] = {"",   " 1",  ".",   "-",    "+",        "-.", ".e5",
                                       "e5", "nan", "inf", "-inf", "infinity", "--1"};
    for (size_t k = 0; k < sizeof none / sizeof none[0]; k++)
        check_prefix(none[k], 0, 0.0);
}

/* The text has no NUL behind it; reading further would be seen by the address sanitizer. */
TEST(stops_at_the_given_length)
{
    const char *text = "-12.75e+2";
    static const double want[] = {0, 0, -1, -12, -12, -12.7, -12.75, -12.75, -12.75, -1275};
    static const size_t used[] = {0, 0, 2, 3, 4, 5, 6, 6, 6, 9};
    for (size_t len = 0; len <= strlen(text); len++) {
        double got;
        char *exact = malloc(len + (len == 0));
        if (!exact)
            return;
        memcpy(exact, text, len);
        CHECK_INT(uz_parse_double(&got, exact, len), used[len]);
        CHECK(got == want[len]);
        free(exact);
    }
}

TEST(does_not_depend_on_the_locale)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "fr_FR.UTF-8"};
    bool set = false;
    for (size_t k = 0; !set && k < sizeof names / sizeof names[0]; k++)
        set = setlocale(LC_NUMERIC, names[k]) != NULL;
    if (!set) {
        test_skip("no locale with a decimal comma is installed");
        return;
    }
    check_text("9007199254740993.0000000000000000000000000000000000", 9007199254740992.0);
    check_text("1.5", 1.5);
    setlocale(LC_NUMERIC, "C");
}
