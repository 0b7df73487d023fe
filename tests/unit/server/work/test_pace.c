/* What solves take here for what was predicted. */
#include "harness.h"
#include "work/pace.h"

#include <math.h>

static double factor_of(pace *p, uz_operator op)
{
    double factor[PACE_FORMS];
    pace_now(p, factor);
    return factor[op];
}

TEST(a_few_solves_tell_and_one_that_is_odd_does_not)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 2; k++)
        pace_add(p, UZ_OPERATOR_CONDENSED, 1.0, 1.5);
    CHECK(factor_of(p, UZ_OPERATOR_CONDENSED) == 1.0);
    pace_add(p, UZ_OPERATOR_CONDENSED, 1.0, 100.0);
    CHECK_REL(factor_of(p, UZ_OPERATOR_CONDENSED), 1.5, 1e-15);
    pace_add(p, UZ_OPERATOR_CONDENSED, 2.0, 3.2);
    CHECK_REL(factor_of(p, UZ_OPERATOR_CONDENSED), 1.55, 1e-15);
    CHECK(factor_of(p, UZ_OPERATOR_MATRIX_FREE) == 1.0);
    pace_free(p);
}

TEST(the_last_ones_count)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 100; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 0.5);
    for (int k = 0; k < 8; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 2.0);
    CHECK_REL(factor_of(p, UZ_OPERATOR_MATRIX_FREE), 2.0, 1e-15);
    for (int k = 0; k < 100; k++)
        pace_add(p, UZ_OPERATOR_MATRIX_FREE, 1.0, 1e6);
    CHECK_REL(factor_of(p, UZ_OPERATOR_MATRIX_FREE), 4.0, 1e-15);
    pace_free(p);
}

TEST(what_tells_nothing_is_left_out)
{
    pace *p = pace_new();
    CHECK(p);
    for (int k = 0; k < 9; k++) {
        pace_add(p, UZ_OPERATOR_FACTORED, 1e-5, 1e-3); /* short */
        pace_add(p, UZ_OPERATOR_FACTORED, 0.0, 1.0);
        pace_add(p, UZ_OPERATOR_FACTORED, NAN, 1.0);
        pace_add(p, UZ_OPERATOR_FACTORED, 1.0, NAN);
        pace_add(p, UZ_OPERATOR_FACTORED, 1e-300, 1e300);
        pace_add(p, (uz_operator)PACE_FORMS, 1.0, 2.0);
    }
    for (int k = 0; k < PACE_FORMS; k++)
        CHECK(factor_of(p, (uz_operator)k) == 1.0);
    CHECK(factor_of(NULL, UZ_OPERATOR_FACTORED) == 1.0);
    pace_add(NULL, UZ_OPERATOR_FACTORED, 1.0, 2.0);
    pace_free(p);
    pace_free(NULL);
}
