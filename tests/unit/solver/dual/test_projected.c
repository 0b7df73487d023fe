/* Rows as equations where some of them depend on each other. */
#include "dual/projected.h"
#include "harness.h"
#include "qp_fixture.h"

/* u_0 twice with factor `again`, and u_1, on springs of 2; what closing and the force make of them. */
typedef struct {
    double u[2], g[3], r[3];
    bool agree, as_equations;
} answer;

static answer close_rows(double again, const double h[3])
{
    const double K[] = {2, 0, 0, 2}, N[] = {1, 0, again, 0, 0, 1}, force[] = {-3, -1};
    const bool active[] = {true, true, true};
    const uz_multigrid mg = {.n = 2};
    uz_csc stiffness = csc_from_dense(K, 2, 2, true);
    uz_dual dual = {.m = 3, .d = 2, .N = csc_from_dense(N, 3, 2, false)};
    uz_error err = {0};
    uz_projected *part = NULL;
    answer a = {.u = {0.7, 0.3}};
    CHECK_INT(uz_csc_transpose(&dual.Nt, &dual.N, &err), UZ_OK);
    CHECK_INT(uz_projected_create(&part, &mg, &dual, &stiffness, active, NULL, &err), UZ_OK);
    CHECK(part != NULL);
    if (part) {
        CHECK_INT(uz_projected_close(part, a.u, h, &err), UZ_OK);
        CHECK_INT(uz_projected_react(part, a.r, force, &err), UZ_OK);
        memcpy(a.g, h, sizeof a.g);
        uz_csc_gaxpy(a.g, &dual.N, -1.0, a.u);
        a.as_equations = uz_projected_release(part, NULL, h, a.u, a.g);
        a.agree = uz_projected_release(part, a.r, h, a.u, a.g);
    }
    uz_projected_free(part);
    uz_csc_clear(&stiffness);
    uz_csc_clear(&dual.N);
    uz_csc_clear(&dual.Nt);
    return a;
}

TEST(rows_that_agree_share_the_force)
{
    const answer a = close_rows(1.0, (const double[]){1, 1, 2});
    CHECK(a.agree && a.as_equations);
    CHECK_REL(a.u[0], 1.0, 1e-15);
    CHECK_REL(a.u[1], 2.0, 1e-15);
    CHECK_REL(a.r[0] + a.r[1], -3.0, 1e-14);
    CHECK_REL(a.r[1], -1.5, 1e-6);
    CHECK_REL(a.r[2], -1.0, 1e-14);
}

/* u_0 <= 1 is in the way of u_0 <= 2, whose row is left open and pulls: only where rows may be left out. */
TEST(a_row_behind_another_is_released)
{
    const answer a = close_rows(1.0, (const double[]){1, 2, 2});
    CHECK(a.agree && !a.as_equations);
    CHECK(a.g[0] < 0.0 && a.g[1] > 0.0);
    CHECK(a.r[0] < 0.0 && a.r[1] > 0.0 && a.r[2] < 0.0);
}

/* u_0 <= 1 and u_0 >= 2: none of both is open; nor if it is by little. */
TEST(rows_that_contradict_have_no_way_out)
{
    answer a = close_rows(-1.0, (const double[]){1, -2, 2});
    CHECK(!a.agree && !a.as_equations);
    a = close_rows(-1.0, (const double[]){1, -1 - 1e-10, 2});
    CHECK(!a.agree && !a.as_equations);
}

/* u_0 = 0 twice: what is left of closing is rounding of the displacement. */
TEST(rows_through_zero_agree)
{
    const answer a = close_rows(0.3, (const double[]){0, 0, 0});
    CHECK(a.agree && a.as_equations);
}
