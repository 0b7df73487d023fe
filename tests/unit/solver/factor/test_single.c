/* Substitutions for one right-hand side. */
#include "factor_fixture.h"
#include "harness.h"
#include "qp_fixture.h"

/* One right-hand side goes through another code than a block of them does: alone it has the answer of a lane, up to
 * rounding. */
static void check_single(const uz_csc *K, uz_ordering ordering, uint64_t seed)
{
    int64_t n = K->cols;
    uz_factor *factor;
    uz_error err;
    uz_factor_workspace *ws = uz_factor_workspace_new();
    double *one = vector(n), *block = vector(n * UZ_LANES);
    qp_random rng = {seed};
    uz_thread_init(); /* without it CHOLMOD starts a team of OpenMP threads */
    CHECK_INT(factor_by(&factor, K, NULL, 0, ordering, 0, &err), UZ_OK);
    for (int forward = 1; forward >= 0; forward--) {
        double size = 0, difference = 0;
        for (int64_t i = 0; i < n * UZ_LANES; i++)
            block[i] = random_signed(&rng);
        for (int64_t i = 0; i < n; i++)
            one[i] = block[i * UZ_LANES];
        CHECK_INT(uz_factor_solve_one(factor, ws, one, forward, &err), UZ_OK);
        CHECK_INT(uz_factor_solve_lanes(factor, block, 1, forward, &err), UZ_OK);
        for (int64_t i = 0; i < n; i++) {
            size = fmax(size, fabs(block[i * UZ_LANES]));
            difference = fmax(difference, fabs(one[i] - block[i * UZ_LANES]));
        }
        CHECK_MSG(difference <= 1e-14 * size, "order %d, forward %d: %g of %g", (int)n, forward, difference, size);
    }
    uz_factor_workspace_free(ws);
    uz_factor_free(factor);
    free(one);
    free(block);
}

static const uz_ordering orderings[] = {UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};

/* Full matrices are one supernode of every width, grids many of few columns. */
TEST(one_right_hand_side_is_solved_as_among_several)
{
    for (int64_t n = 1; n <= 37; n++) {
        double *K = vector(n * n);
        qp_random rng = {(uint64_t)n};
        for (int64_t i = 0; i < n; i++)
            for (int64_t j = 0; j <= i; j++)
                K[i * n + j] = K[j * n + i] = i == j ? (double)n : random_signed(&rng);
        uz_csc full = csc_from_dense(K, n, n, true);
        check_single(&full, UZ_ORDERING_AMD, (uint64_t)n);
        uz_csc_clear(&full);
        free(K);
    }
    for (int64_t w = 2; w <= 38; w += 6) {
        uz_csc K = grid(w, 41 - w);
        for (size_t k = 0; k < 3; k++)
            check_single(&K, orderings[k], (uint64_t)w);
        uz_csc_clear(&K);
    }
}
