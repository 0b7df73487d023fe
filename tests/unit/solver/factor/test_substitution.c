/* Substitutions for one vector, which have kernels of their own. */
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const uz_ordering orderings[] = {UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};

/* Largest difference of the substitutions for one vector and of those for several, relative to the largest entry. */
static double single_against_several(const uz_factor *factor, uz_factor_workspace *ws, const double *b, int64_t n)
{
    uz_error err;
    double most = 0, size = 0, *x = vector(n), *y = vector(n * UZ_LANES);
    for (int64_t i = 0; i < n * UZ_LANES; i++)
        y[i] = b[i / UZ_LANES];
    memcpy(x, b, (size_t)n * sizeof *b);
    for (int half = 0; half < 2; half++) {
        CHECK_INT(uz_factor_solve_one(factor, ws, x, half == 0, &err), UZ_OK);
        CHECK_INT(uz_factor_solve_lanes(factor, y, 1, half == 0, &err), UZ_OK);
        for (int64_t i = 0; i < n; i++) {
            most = fmax(most, fabs(x[i] - y[i * UZ_LANES]));
            size = fmax(size, fabs(y[i * UZ_LANES]));
        }
    }
    free(x);
    free(y);
    return most / size;
}

/* Supernodes of all shapes: with few and many columns and rows, and numbers of them that four does not divide. Vectors
 * with one nonzero pass over what is eliminated before it. */
TEST(one_vector_is_solved_as_several_are)
{
    qp_random rng = {7};
    for (int64_t w = 1; w <= 12; w++)
        for (int64_t h = 1; h <= 12; h++) {
            const int64_t n = w * h;
            uz_csc K = grid(w, h);
            uz_factor *factor;
            uz_error err;
            uz_factor_workspace *ws = uz_factor_workspace_new();
            double *b = vector(n);
            const uz_ordering ordering = orderings[h % 3];
            CHECK_INT(factor_by(&factor, &K, NULL, 0, ordering, 0, &err), UZ_OK);
            for (int64_t i = 0; i < n; i++)
                b[i] = random_signed(&rng);
            CHECK(single_against_several(factor, ws, b, n) < 1e-15);
            for (int64_t one = 0; one < n; one += 1 + n / 5) {
                memset(b, 0, (size_t)n * sizeof *b);
                b[one] = 1;
                CHECK(single_against_several(factor, ws, b, n) < 1e-15);
            }
            uz_factor_workspace_free(ws);
            uz_factor_free(factor);
            uz_csc_clear(&K);
            free(b);
        }
}
