/* What a ray proves of rows that contradict each other, or just do not: by the last bit of their bounds. */
#include "certificate/infeasible.h"
#include "harness.h"
#include "qp_fixture.h"

#include <math.h>

/* The radius that y proves of h - N u >= 0, N (m x d) by rows. */
static double radius_of(double *y, const double *N, const double *h, int64_t m, int64_t d)
{
    double radius = -1;
    uz_error err = {0};
    uz_csc matrix = csc_from_dense(N, m, d, false);
    CHECK_MSG(uz_prove_ray(&radius, y, &matrix, h, &err) == UZ_OK, "%s", err.message);
    uz_csc_clear(&matrix);
    return radius;
}

/* a u <= a and -b u <= -b leave u = 1 alone; with one bound by its last bit closer they leave nothing. */
TEST(the_last_bit_of_a_bound_decides)
{
    static const double PAIRS[][2] = {{1, 1}, {0.1, 0.3}, {1e-8, 3e7}, {0.7, 0.7}};
    for (size_t k = 0; k < sizeof PAIRS / sizeof *PAIRS; k++) {
        const double a = PAIRS[k][0], b = PAIRS[k][1], N[] = {a, -b};
        for (int turn = -2; turn <= 2; turn++) {
            double y[] = {-b / a, -1}; /* up to rounding, and off by a last bit */
            y[0] = turn == -2 ? nextafter(y[0], 0) : turn == 2 ? nextafter(y[0], -INFINITY) : y[0];
            const double h[] = {a, turn == -1 ? nextafter(-b, -INFINITY) : turn == 1 ? nextafter(-b, 0) : -b};
            const double radius = radius_of(y, N, h, 2, 1);
            if (turn == -1)
                CHECK_MSG(radius == INFINITY && y[0] < 0 && y[1] < 0, "%g %g: %g", a, b, radius);
            else /* 1 is feasible */
                CHECK_MSG(radius <= 1, "%g %g, %d: %g", a, b, turn, radius);
        }
    }
}

/* A part that contradicts itself is proved whatever stands beside it; one that does not proves nothing for another. */
TEST(each_part_stands_for_itself)
{
    const double N[] = {1, 0, -1, 0, 0, 1, 0, -1};
    for (int bad = 0; bad < 4; bad++) {
        const double more = nextafter(1, 2), h[] = {1, bad & 1 ? -more : -1, 3, bad & 2 ? -4 : -3};
        double y[] = {-1, -1, -1, -1};
        const double radius = radius_of(y, N, h, 4, 2);
        CHECK_MSG(bad ? radius == INFINITY : radius == 0, "%d: %g", bad, radius);
        for (int i = 0; bad && i < 4; i++)
            CHECK((y[i] < 0) == ((bad >> i / 2 & 1) == 1));
    }
}

/* What has to pull is no ray: u_2 = -1000 meets all of these, and the claim is no more than that it is as far away. */
TEST(a_row_that_would_pull_proves_nothing)
{
    const double N[] = {1, 0, -1, 1e-3, 0, 1}, h[] = {1, -2, 1};
    double y[] = {-1, -1, -1e-18};
    const double radius = radius_of(y, N, h, 3, 2);
    CHECK_MSG(radius > 999 && radius <= 1000, "%g", radius);
}
