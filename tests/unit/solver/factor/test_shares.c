/* What two threads make of a factor: shares that don't need each other, and the same bits as by one thread. */
#include "core/alloc.h"
#include "core/aside.h"
#include "factor/factor_private.h"
#include "factor_fixture.h"
#include "harness.h"
#include "hex8.h"
#include "sanitized.h"
#include "scene_fixture.h"

enum { CELLS = 90 };

static const uz_ordering orderings[] = {UZ_ORDERING_AUTO, UZ_ORDERING_AMD, UZ_ORDERING_METIS};

static double flops_of(const cholmod_factor *L, int64_t s)
{
    const SuiteSparse_long *super = L->super, *pi = L->pi;
    double flops = 0;
    for (int64_t j = 0; j < super[s + 1] - super[s]; j++)
        flops += pow((double)(pi[s + 1] - pi[s] - j), 2);
    return flops;
}

/* Nothing of a share has entries in rows of the other one, and both are large. */
TEST(shares_do_not_need_each_other)
{
    uz_thread_init();
    uz_qp qp = paper_qp(CELLS, 1.0);
    const int64_t n = qp.K.cols;
    int64_t *dofs = calloc((size_t)n, sizeof *dofs), *owner = calloc((size_t)n, sizeof *owner),
            n_last = dofs_touched(dofs, &qp.N);
    for (size_t k = 0; k < sizeof orderings / sizeof orderings[0]; k++) {
        uz_analysis *analysis;
        uz_error err;
        CHECK_INT(uz_analysis_create(&analysis, &qp.K, dofs, n_last, 0, orderings[k], NULL, &err), UZ_OK);
        const cholmod_factor *L = analysis->L;
        const SuiteSparse_long *super = L->super, *pi = L->pi, *row = L->s;
        double flops[UZ_SHARES] = {0};
        for (int64_t s = 0; s < (int64_t)L->nsuper; s++)
            for (int64_t j = super[s]; j < super[s + 1]; j++)
                owner[j] = s;
        for (int64_t s = 0; s < (int64_t)L->nsuper; s++) {
            const int share = analysis->share[s];
            CHECK(share <= UZ_REST);
            flops[share] += flops_of(L, s);
            for (int64_t i = pi[s]; i < pi[s + 1]; i++) {
                const int below = analysis->share[owner[row[i]]];
                CHECK(below == UZ_REST || below == share);
            }
        }
        const double all = flops[0] + flops[1] + flops[UZ_REST];
        CHECK_REL(all, analysis->chosen.flops, 0.2); /* CHOLMOD's count is of its columns before they are joined */
        CHECK_MSG(fmax(flops[0], flops[1]) + flops[UZ_REST] <= 0.9 * all && fmin(flops[0], flops[1]) > 0.1 * all,
                  "%s: %g and %g, rest %g", uz_choice_name(UZ_CHOICE_ORDERING, orderings[k]), flops[0], flops[1],
                  flops[UZ_REST]);
        uz_analysis_free(analysis);
    }
    uz_qp_clear(&qp);
    free(dofs);
    free(owner);
}

/* allowed: by two threads. again: by uz_factor_again. */
static uz_factor *factor_with(const uz_csc *K, const uz_analysis *analysis, bool allowed, bool again, uz_status wanted)
{
    uz_factor *factor = NULL;
    uz_error err;
    CHECK_INT(uz_aside_begin(2), 2);
    uz_aside_allow(allowed ? 2 : 1);
    if (again) {
        CHECK_INT(uz_factor_new(&factor, analysis, &err), UZ_OK);
        CHECK_INT(uz_factor_again(factor, K, &err), wanted);
    } else {
        CHECK_INT(uz_factor_create(&factor, K, analysis, 0, NULL, &err), wanted);
    }
    uz_aside_allow(1);
    return factor;
}

/* A small body is not shared out, and no thread is woken for it. */
TEST(little_is_not_shared)
{
    uz_thread_init();
    uz_qp qp = paper_qp(6, 1.0);
    uz_analysis *analysis;
    uz_error err;
    CHECK_INT(uz_analysis_create(&analysis, &qp.K, NULL, 0, 0, UZ_ORDERING_AUTO, NULL, &err), UZ_OK);
    for (size_t s = 0; s < analysis->L->nsuper; s++)
        CHECK_INT(analysis->share[s], UZ_REST);
    uz_aside_used();
    for (int again = 0; again < 2; again++)
        uz_factor_free(factor_with(&qp.K, analysis, true, again, UZ_OK));
    CHECK_INT(uz_aside_used(), 1);
    uz_analysis_free(analysis);
    uz_qp_clear(&qp);
}

/* turns: how often, made anew and made again; bad: of K that is not positive, too. */
static void check_same_bits(uz_csc *K, int turns, bool bad)
{
    uz_analysis *analysis;
    uz_error err;
    CHECK_INT(uz_analysis_create(&analysis, K, NULL, 0, 0, UZ_ORDERING_AUTO, NULL, &err), UZ_OK);
    for (int again = 0; again < 2; again++)
        for (int turn = 0; turn < turns; turn++) {
            uz_factor *one = factor_with(K, analysis, false, again, UZ_OK);
            uz_aside_used();
            uz_factor *two = factor_with(K, analysis, true, again, UZ_OK);
            CHECK_INT(uz_aside_used(), 2);
            CHECK(memcmp(one->L.x, two->L.x, one->L.xsize * sizeof(double)) == 0);
            CHECK(one->info.rcond == two->info.rcond && one->info.inverse_bound == two->info.inverse_bound);
            uz_factor_free(one);
            uz_factor_free(two);
        }
    /* K that is not positive: in one share, in the other, in what comes after both; its first column and its last */
    for (int part = 0; bad && part < 2 * UZ_SHARES; part++) {
        const SuiteSparse_long *perm = analysis->L->Perm, *super = analysis->L->super;
        size_t s = part % 2 == 0 ? 0 : analysis->L->nsuper - 1;
        while (analysis->share[s] != part / 2)
            s += part % 2 == 0 ? 1 : -(size_t)1;
        double *pivot = &K->val[K->ptr[perm[part % 2 == 0 ? super[s] : super[s + 1] - 1]]];
        *pivot = -*pivot;
        for (int again = 0; again < 2; again++)
            uz_factor_free(factor_with(K, analysis, true, again, UZ_ERR_NOT_SPD));
        *pivot = -*pivot;
    }
    uz_analysis_free(analysis);
}

TEST(two_threads_give_the_same_bits)
{
    uz_thread_init();
    uz_qp qp = paper_qp(CELLS, 1.0);
    check_same_bits(&qp.K, SANITIZED ? 1 : 3, true);
    uz_qp_clear(&qp);
}

/* Of a cube the last supernodes are large: both threads make them together, in panels. */
TEST(large_supernodes_are_made_together)
{
    uz_thread_init();
    uz_csc K;
    uz_factor *factor;
    uz_error err;
    CHECK(hex8_stiffness(&K, SANITIZED ? 9 : 13, &err) == UZ_OK);
    CHECK_INT(factor_by(&factor, &K, NULL, 0, UZ_ORDERING_METIS, 0, &err), UZ_OK);
    const cholmod_factor *L = &factor->L;
    const SuiteSparse_long *super = L->super, *pi = L->pi;
    int64_t large = 0, widest = 0;
    for (int64_t s = 0; s < (int64_t)L->nsuper; s++)
        if (factor->analysis->share[s] == UZ_REST && uz_is_large(super[s + 1] - super[s], pi[s + 1] - pi[s])) {
            large++;
            widest = super[s + 1] - super[s] > widest ? super[s + 1] - super[s] : widest;
        }
    CHECK_MSG(large > (SANITIZED ? 0 : 2) && widest > (SANITIZED ? 300 : 400),
              "%lld large ones, the widest of %lld columns", (long long)large, (long long)widest);
    /* L L' is K, in each of its entries: K x and L L' x for vectors that see one column each, and many */
    double *x = vector(K.cols), *f = vector(K.cols), *room = vector(K.cols);
    uz_factor_workspace *ws = uz_factor_workspace_new();
    qp_random rng = {7};
    for (int turn = 0; turn < 20; turn++) {
        double size = 0, off = 0;
        for (int64_t i = 0; i < K.cols; i++)
            x[i] = turn < 10 ? random_signed(&rng) : i == (K.cols - 1) * (turn - 10) / 9;
        memset(f, 0, (size_t)K.cols * sizeof *f);
        uz_csc_symv(f, &K, 1, x);
        CHECK_INT(uz_factor_solve(factor, ws, f, f, room, &err), UZ_OK);
        for (int64_t i = 0; i < K.cols; i++) {
            size = fmax(size, fabs(x[i]));
            off = fmax(off, fabs(f[i] - x[i]));
        }
        CHECK_MSG(off <= 1e-11 * size, "%d: %g", turn, off);
    }
    uz_factor_workspace_free(ws);
    uz_factor_free(factor);
    check_same_bits(&K, SANITIZED ? 1 : 3, !SANITIZED);
    uz_csc_clear(&K);
    uz_free_all(x, f, room);
}

/* By the shares as by one supernode after the other, but for the order of sums. */
TEST(substitutions_by_shares)
{
    uz_thread_init();
    uz_qp qp = paper_qp(CELLS, 1.0);
    const int64_t n = qp.K.cols;
    uz_factor *factor;
    uz_error err;
    CHECK_INT(factor_by(&factor, &qp.K, NULL, 0, UZ_ORDERING_AUTO, 0, &err), UZ_OK);
    double *X = vector(n * UZ_LANES), *Y = vector(n * UZ_LANES), *room = vector(n * UZ_LANES);
    qp_random rng = {3};
    CHECK_INT(uz_aside_begin(2), 2);
    uz_aside_allow(2);
    for (int64_t i = 0; i < n * UZ_LANES; i++)
        X[i] = Y[i] = random_signed(&rng);
    for (int back = 0; back < 2; back++) {
        double size = 0, off = 0;
        CHECK_INT(uz_factor_solve_lanes(factor, X, 1, !back, &err), UZ_OK);
        CHECK_INT(uz_factor_solve_shares(factor, Y, room, !back, &err), UZ_OK);
        for (int64_t i = 0; i < n * UZ_LANES; i++) {
            size = fmax(size, fabs(X[i]));
            off = fmax(off, fabs(X[i] - Y[i]));
        }
        CHECK_MSG(size > 0 && off <= 1e-10 * size, "%s: %g of %g", back ? "back" : "forward", off, size);
    }
    uz_aside_allow(1);
    uz_factor_free(factor);
    uz_qp_clear(&qp);
    uz_free_all(X, Y, room);
}
