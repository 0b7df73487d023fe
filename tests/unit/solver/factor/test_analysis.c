/* One analysis for many factors of one pattern: the same bits as an analysis of their own, in any number of threads. */
#include "core/alloc.h"
#include "factor_fixture.h"
#include "floor.h"
#include "harness.h"
#include "hex8.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

#include <pthread.h>

static const uz_ordering orderings[] = {UZ_ORDERING_AUTO, UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS};

/* x = K^-1 b by the factor's own substitutions. */
static void solve(double *x, const uz_factor *factor, const double *b, int64_t n)
{
    uz_factor_workspace *ws = uz_factor_workspace_new();
    uz_error err;
    double *y = vector(n);
    uz_factor_permute(factor, y, b);
    CHECK(uz_factor_solve_one(factor, ws, y, true, &err) == UZ_OK);
    CHECK(uz_factor_solve_one(factor, ws, y, false, &err) == UZ_OK);
    uz_factor_unpermute(factor, x, y);
    uz_factor_workspace_free(ws);
    free(y);
}

TEST(shared_analysis_gives_the_same_bits)
{
    uz_thread_init();
    for (size_t k = 0; k < sizeof orderings / sizeof orderings[0]; k++) {
        uz_qp first = paper_qp(24, 200e3), second = paper_qp(24, 3.0);
        int64_t n = second.K.cols, *dofs = calloc((size_t)n, sizeof *dofs), n_last = dofs_touched(dofs, &second.N);
        double *x = vector(n), *y = vector(n);
        uz_analysis *shared;
        uz_factor *early, *reused, *fresh;
        uz_error err;
        CHECK_INT(uz_analysis_create(&shared, &first.K, dofs, n_last, 0, orderings[k], NULL, &err), UZ_OK);
        CHECK(uz_analysis_bytes(shared) > 8 * (size_t)n);
        CHECK_INT(uz_factor_create(&early, &first.K, shared, 0, NULL, &err), UZ_OK);
        CHECK_INT(uz_factor_create(&reused, &second.K, shared, 0, NULL, &err), UZ_OK);
        CHECK_INT(factor_by(&fresh, &second.K, dofs, n_last, orderings[k], 0, &err), UZ_OK);
        uz_factor_free(early);
        uz_analysis_free(shared); /* the factor lives on */
        solve(x, reused, second.p, n);
        solve(y, fresh, second.p, n);
        CHECK(memcmp(x, y, (size_t)n * sizeof *x) == 0);
        CHECK(uz_factor_describe(reused).rcond == uz_factor_describe(fresh).rcond);
        CHECK(uz_factor_describe(reused).flops > (double)n);
        uz_factor_free(reused);
        uz_factor_free(fresh);
        uz_qp_clear(&first);
        uz_qp_clear(&second);
        uz_free_all(dofs, x, y);
    }
}

/* A plate that is stiffer here and there has supernodes of every width; those of bricks are large enough for BLAS. */
TEST(numbers_made_again_are_those_of_a_new_factor)
{
    uz_thread_init();
    for (int body = 0; body < 3; body++) {
        uz_qp qp = {0};
        uz_analysis *analysis;
        uz_factor *again, *fresh;
        uz_error err;
        CHECK((body == 2 ? hex8_qp(&qp, 8, &err) : floor_qp(&qp, 30, body == 1, 2.0, 0.3, &err)) == UZ_OK);
        const int64_t n = qp.K.cols;
        double *x = vector(n), *y = vector(n), size = 0, off = 0;
        CHECK_INT(uz_analysis_create(&analysis, &qp.K, NULL, 0, 0, UZ_ORDERING_AUTO, NULL, &err), UZ_OK);
        CHECK_INT(uz_factor_new(&again, analysis, &err), UZ_OK);
        for (int k = 0; k < 4; k++) {
            const bool singular = k == 2;
            qp.K.val[qp.K.ptr[n / 2]] *= singular ? -1 : k == 3 ? -3 : 2;
            for (int64_t j = 0; j < n; j += 7)
                qp.K.val[qp.K.ptr[j]] *= 1.5;
            CHECK_INT(uz_factor_again(again, &qp.K, &err), singular ? UZ_ERR_NOT_SPD : UZ_OK);
            if (singular)
                continue;
            CHECK_INT(uz_factor_create(&fresh, &qp.K, analysis, 0, NULL, &err), UZ_OK);
            solve(x, again, qp.p, n);
            solve(y, fresh, qp.p, n);
            for (int64_t i = 0; i < n; i++) {
                size = fmax(size, fabs(y[i]));
                off = fmax(off, fabs(x[i] - y[i]));
            }
            CHECK_MSG(off <= 1e-11 * size, "body %d, %d: %g of %g", body, k, off, size);
            uz_factor_free(fresh);
        }
        qp.K.ptr[n]--; /* an entry less */
        CHECK_INT(uz_factor_again(again, &qp.K, &err), UZ_ERR_ARGUMENT);
        qp.K.ptr[n]++;
        uz_factor_free(again);
        uz_analysis_free(analysis);
        uz_qp_clear(&qp);
        free(x);
        free(y);
    }
}

/* What was tried is told, the used one among it. */
TEST(choices_are_told)
{
    uz_qp qp = paper_qp(24, 1.0);
    int64_t *dofs = calloc((size_t)qp.K.cols, sizeof *dofs), n_last = dofs_touched(dofs, &qp.N);
    uz_thread_init();
    for (size_t k = 0; k < 8; k++) {
        uz_factor *factor;
        uz_error err;
        uz_status status = factor_by(&factor, &qp.K, dofs, k < 4 ? n_last : 0, orderings[k % 4], 0, &err);
        CHECK_INT(status, UZ_OK);
        uz_factor_info info = uz_factor_describe(factor);
        CHECK_INT(info.contact_last, k < 4);
        CHECK_INT(info.n_considered, 1);
        CHECK_INT(info.considered[0].ordering, info.ordering);
        CHECK_INT(info.considered[0].nnz, info.nnz);
        CHECK(info.considered[0].flops == info.flops && info.flops > (double)info.nnz);
        uz_ordering own = k < 4 ? UZ_ORDERING_CAMD : UZ_ORDERING_AMD, want = k % 4 == 0 ? own : orderings[k % 4];
        CHECK_INT(info.ordering, want);
        uz_factor_free(factor);
    }
    uz_qp_clear(&qp);
    free(dofs);
}

/* Entries outside the analysed pattern would be lost without a word. */
TEST(another_pattern_is_refused)
{
    uz_qp one = paper_qp(6, 1.0), other = paper_qp(9, 1.0);
    uz_analysis *analysis;
    uz_factor *factor = (uz_factor *)&one;
    uz_error err = {0};
    uz_thread_init();
    CHECK_INT(uz_analysis_create(&analysis, &one.K, NULL, 0, 0, UZ_ORDERING_AUTO, NULL, &err), UZ_OK);
    CHECK_INT(uz_factor_create(&factor, &other.K, analysis, 0, NULL, &err), UZ_ERR_ARGUMENT);
    CHECK(factor == NULL);
    uz_analysis_free(analysis);
    uz_analysis_free(NULL);
    uz_qp_clear(&one);
    uz_qp_clear(&other);
}

typedef struct {
    const uz_analysis *analysis;
    const uz_qp *qp;
    const double *want;
} shared_work;

static void *factor_and_compare(void *ctx)
{
    const shared_work *work = ctx;
    int64_t n = work->qp->K.cols;
    uz_thread_init();
    for (int k = 0; k < 5; k++) {
        uz_factor *factor;
        uz_error err;
        double *x = vector(n);
        CHECK(uz_factor_create(&factor, &work->qp->K, work->analysis, 0, NULL, &err) == UZ_OK);
        solve(x, factor, work->qp->p, n);
        CHECK(memcmp(x, work->want, (size_t)n * sizeof *x) == 0);
        uz_factor_free(factor);
        free(x);
    }
    return NULL;
}

TEST(factors_of_one_analysis_in_threads)
{
    enum { THREADS = 4 };
    pthread_t threads[THREADS];
    uz_qp qp = paper_qp(24, 7.0);
    uz_analysis *analysis;
    uz_factor *factor;
    uz_error err;
    double *want = vector(qp.K.cols);
    uz_process_init(2);
    uz_thread_init();
    CHECK_INT(uz_analysis_create(&analysis, &qp.K, NULL, 0, 0, UZ_ORDERING_AUTO, NULL, &err), UZ_OK);
    CHECK_INT(uz_factor_create(&factor, &qp.K, analysis, 0, NULL, &err), UZ_OK);
    solve(want, factor, qp.p, qp.K.cols);
    uz_factor_free(factor);
    shared_work work = {analysis, &qp, want};
    for (int t = 0; t < THREADS; t++)
        CHECK(pthread_create(&threads[t], NULL, factor_and_compare, &work) == 0);
    for (int t = 0; t < THREADS; t++)
        pthread_join(threads[t], NULL);
    uz_analysis_free(analysis);
    uz_qp_clear(&qp);
    free(want);
}

/* P K P' as a lower triangle: dof i becomes to[i]. */
static uz_csc renumber(const uz_csc *K, const int64_t *to)
{
    int64_t n = K->cols, nnz = K->ptr[n];
    uz_csc A, T, B;
    uz_error err = {0};
    CHECK(uz_csc_init(&A, n, n, nnz, &err) == UZ_OK);
    for (int64_t j = 0; j < n; j++) /* counts, then places */
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            int64_t a = to[j], b = to[K->idx[k]];
            A.ptr[(a < b ? a : b) + 1]++;
        }
    for (int64_t j = 0; j < n; j++)
        A.ptr[j + 1] += A.ptr[j];
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            int64_t a = to[j], b = to[K->idx[k]], at = A.ptr[a < b ? a : b]++;
            A.idx[at] = (int32_t)(a < b ? b : a);
            A.val[at] = K->val[k];
        }
    memmove(A.ptr + 1, A.ptr, (size_t)n * sizeof *A.ptr);
    A.ptr[0] = 0;
    CHECK(uz_csc_transpose(&T, &A, &err) == UZ_OK); /* twice: sorts the columns */
    CHECK(uz_csc_transpose(&B, &T, &err) == UZ_OK);
    uz_csc_clear(&A);
    uz_csc_clear(&T);
    return B;
}

/* A body whose dofs come by direction, or in any order, is the same body: dofs of a node that stand far apart in the
 * numbering are found all the same. */
TEST(numbering_of_dofs)
{
    uz_thread_init();
    for (int way = 0; way < 2; way++) {
        uz_qp qp = paper_qp(24, 200e3);
        int64_t n = qp.K.cols, *to = calloc((size_t)n, sizeof *to);
        double *b = vector(n), *x = vector(n), *y = vector(n);
        uz_factor *own, *other;
        uz_error err;
        qp_random rng = {7};
        for (int64_t i = 0; i < n; i++)
            to[i] = way == 0 ? i / 2 + (i % 2) * ((n + 1) / 2) : i;
        for (int64_t i = n - 1; way == 1 && i > 0; i--) {
            int64_t k = random_int(&rng, 0, i + 1), swap = to[i];
            to[i] = to[k];
            to[k] = swap;
        }
        uz_csc A = renumber(&qp.K, to);
        for (int64_t i = 0; i < n; i++)
            b[to[i]] = qp.p[i];
        CHECK_INT(factor_by(&own, &qp.K, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
        CHECK_INT(factor_by(&other, &A, NULL, 0, UZ_ORDERING_AMD, 0, &err), UZ_OK);
        CHECK_REL((double)uz_factor_describe(other).nnz, (double)uz_factor_describe(own).nnz, 0.15);
        solve(x, own, qp.p, n);
        solve(y, other, b, n);
        for (int64_t i = 0; i < n; i++)
            CHECK(fabs(y[to[i]] - x[i]) <= 1e-9 * fabs(x[n - 1]));
        uz_factor_free(own);
        uz_factor_free(other);
        uz_csc_clear(&A);
        uz_qp_clear(&qp);
        uz_free_all(to, b, x, y);
    }
}
