/* Compressed columns against the same operations on dense arrays. */
#include "harness.h"
#include "linalg/linalg.h"
#include "uzawa.h"

#include <string.h>

enum { MOST = 12 };

static uint64_t state = 2463534242u;

static int64_t random_below(int64_t n)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (int64_t)((state >> 33) % (uint64_t)n);
}

/* Small whole numbers: sums and products are exact, so comparisons are too. */
static double random_whole(void)
{
    return (double)(random_below(19) - 9);
}

static void check_valid(const uz_csc *A)
{
    CHECK_INT(A->ptr[0], 0);
    for (int64_t j = 0; j < A->cols; j++) {
        CHECK(A->ptr[j] <= A->ptr[j + 1]);
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            CHECK(A->idx[k] >= 0 && A->idx[k] < A->rows);
            CHECK(k == A->ptr[j] || A->idx[k] > A->idx[k - 1]);
        }
    }
}

static void to_dense(double *dense, const uz_csc *A)
{
    memset(dense, 0, sizeof(double) * (size_t)(A->rows * A->cols));
    for (int64_t j = 0; j < A->cols; j++) {
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++)
            dense[A->idx[k] + j * A->rows] += A->val[k];
    }
}

/* Random triplets with repetitions; dense receives their sum. */
static uz_csc random_matrix(int64_t rows, int64_t cols, int64_t count, double *dense)
{
    int64_t row[3 * MOST * MOST], col[3 * MOST * MOST];
    double val[3 * MOST * MOST];
    uz_csc A;
    memset(dense, 0, sizeof(double) * (size_t)(rows * cols));
    for (int64_t k = 0; k < count; k++) {
        row[k] = random_below(rows);
        col[k] = random_below(cols);
        val[k] = random_whole();
        dense[row[k] + col[k] * rows] += val[k];
    }
    CHECK_INT(uz_csc_from_triplets(&A, rows, cols, count, row, col, val, NULL), UZ_OK);
    return A;
}

TEST(triplets_are_sorted_and_summed)
{
    for (int trial = 0; trial < 500; trial++) {
        double want[MOST * MOST], got[MOST * MOST];
        int64_t rows = 1 + random_below(MOST), cols = 1 + random_below(MOST);
        uz_csc A = random_matrix(rows, cols, random_below(3 * rows * cols), want);
        check_valid(&A);
        to_dense(got, &A);
        CHECK(memcmp(got, want, sizeof(double) * (size_t)(rows * cols)) == 0);
        uz_csc_clear(&A);
    }
}

TEST(repeated_triplets_add_up_in_the_order_given)
{
    const int64_t zero[3] = {0, 0, 0};
    const double forward[3] = {1.0, 1e16, -1e16}, backward[3] = {1e16, -1e16, 1.0};
    uz_csc A, B;
    CHECK_INT(uz_csc_from_triplets(&A, 1, 1, 3, zero, zero, forward, NULL), UZ_OK);
    CHECK_INT(uz_csc_from_triplets(&B, 1, 1, 3, zero, zero, backward, NULL), UZ_OK);
    CHECK(A.val[0] == 0.0 && B.val[0] == 1.0);
    uz_csc_clear(&A);
    uz_csc_clear(&B);
}

TEST(triplets_outside_are_refused)
{
    const int64_t bad[][2] = {{-1, 0}, {2, 0}, {0, -1}, {0, 3}};
    double one = 1.0;
    for (int k = 0; k < 4; k++) {
        uz_csc A;
        uz_error err;
        CHECK_INT(uz_csc_from_triplets(&A, 2, 3, 1, &bad[k][0], &bad[k][1], &one, &err), UZ_ERR_ARGUMENT);
        CHECK(A.ptr == NULL && err.status == UZ_ERR_ARGUMENT && err.message[0]);
    }
}

TEST(sizes_that_cannot_be_are_refused)
{
    uz_csc A;
    uz_error err;
    CHECK_INT(uz_csc_init(&A, -1, 1, 0, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_csc_init(&A, 1, INT64_MAX, 0, &err), UZ_ERR_MEMORY);
    CHECK_INT(uz_csc_init(&A, 1, 1, INT64_MAX, &err), UZ_ERR_MEMORY);
    CHECK_INT(uz_csc_init(&A, (int64_t)INT32_MAX + 1, 1, 0, &err), UZ_ERR_LIMIT);
    CHECK(strstr(err.message, "a matrix of 2147483648 rows"));
    CHECK_INT(uz_csc_init(&A, INT32_MAX, 1, 0, &err), UZ_OK);
    uz_csc_clear(&A);
    CHECK(A.ptr == NULL && A.idx == NULL && A.val == NULL);
    CHECK_INT(uz_csc_from_triplets(&A, 2, 2, -1, NULL, NULL, NULL, &err), UZ_ERR_ARGUMENT);
}

TEST(empty_matrices_are_matrices)
{
    uz_csc A, B, zero = {0};
    CHECK_INT(uz_csc_from_triplets(&A, 3, 0, 0, NULL, NULL, NULL, NULL), UZ_OK);
    CHECK_INT(uz_csc_transpose(&B, &A, NULL), UZ_OK);
    CHECK(B.rows == 0 && B.cols == 3 && B.ptr[3] == 0);
    uz_csc_clear(&A);
    uz_csc_clear(&B);
    CHECK_INT(uz_csc_copy(&A, &zero, NULL), UZ_OK);
    CHECK_INT(uz_csc_transpose(&B, &zero, NULL), UZ_OK);
    uz_csc_clear(&A);
    uz_csc_clear(&B);
    uz_csc_clear(NULL);
}

TEST(transpose_and_copy)
{
    for (int trial = 0; trial < 300; trial++) {
        double a[MOST * MOST], t[MOST * MOST];
        int64_t rows = 1 + random_below(MOST), cols = 1 + random_below(MOST);
        uz_csc A = random_matrix(rows, cols, random_below(2 * rows * cols), a), T, C;
        CHECK_INT(uz_csc_transpose(&T, &A, NULL), UZ_OK);
        CHECK_INT(uz_csc_copy(&C, &A, NULL), UZ_OK);
        check_valid(&T);
        to_dense(t, &T);
        for (int64_t i = 0; i < rows; i++) {
            for (int64_t j = 0; j < cols; j++)
                CHECK(t[j + i * cols] == a[i + j * rows]);
        }
        to_dense(t, &C);
        CHECK(memcmp(t, a, sizeof(double) * (size_t)(rows * cols)) == 0);
        uz_csc_clear(&A);
        uz_csc_clear(&T);
        uz_csc_clear(&C);
    }
}

TEST(products)
{
    for (int trial = 0; trial < 300; trial++) {
        double a[MOST * MOST], x[MOST], y[MOST], want[MOST], z[MOST], want_t[MOST];
        int64_t rows = 1 + random_below(MOST), cols = 1 + random_below(MOST);
        uz_csc A = random_matrix(rows, cols, random_below(2 * rows * cols), a);
        for (int64_t k = 0; k < MOST; k++) {
            x[k] = random_whole();
            y[k] = want[k] = z[k] = want_t[k] = random_whole();
        }
        for (int64_t i = 0; i < rows; i++) {
            for (int64_t j = 0; j < cols; j++) {
                want[i] += -2.0 * a[i + j * rows] * x[j];
                want_t[j] += 3.0 * a[i + j * rows] * x[i];
            }
        }
        uz_csc_gaxpy(y, &A, -2.0, x);
        uz_csc_gaxpy_t(z, &A, 3.0, x);
        CHECK(memcmp(y, want, sizeof y) == 0);
        CHECK(memcmp(z, want_t, sizeof z) == 0);
        uz_csc_clear(&A);
    }
}

/* A general matrix of the given size with a = a', and its dense form. */
static uz_csc random_symmetric(int64_t n, double *dense)
{
    double half[MOST * MOST], twice[MOST * MOST];
    int64_t row[MOST * MOST], col[MOST * MOST], count = 0;
    uz_csc A = random_matrix(n, n, random_below(n * n), half);
    uz_csc_clear(&A);
    memset(dense, 0, sizeof twice);
    for (int64_t j = 0; j < n; j++) {
        for (int64_t i = 0; i < n; i++) {
            double value = i == j ? 20.0 + half[i + i * n] : half[i + j * n] + half[j + i * n];
            if (value == 0.0)
                continue;
            dense[i + j * n] = twice[count] = value;
            row[count] = i;
            col[count++] = j;
        }
    }
    CHECK_INT(uz_csc_from_triplets(&A, n, n, count, row, col, twice, NULL), UZ_OK);
    return A;
}

TEST(symmetric_lower_and_its_product)
{
    for (int trial = 0; trial < 300; trial++) {
        double a[MOST * MOST], x[MOST], y[MOST] = {0}, want[MOST] = {0};
        int64_t n = 1 + random_below(MOST);
        uz_csc K = random_symmetric(n, a);
        CHECK_INT(uz_symmetric_lower(&K, NULL), UZ_OK);
        check_valid(&K);
        for (int64_t j = 0; j < n; j++) {
            x[j] = random_whole();
            for (int64_t k = K.ptr[j]; k < K.ptr[j + 1]; k++)
                CHECK(K.idx[k] >= j && K.val[k] == a[K.idx[k] + j * n]);
        }
        for (int64_t i = 0; i < n; i++) {
            for (int64_t j = 0; j < n; j++)
                want[i] += 2.0 * a[i + j * n] * x[j];
        }
        uz_csc_symv(y, &K, 2.0, x);
        CHECK(memcmp(y, want, sizeof y) == 0);
        double first[MOST] = {0}, second[MOST] = {0};
        const int64_t middle = random_below(n + 1);
        uz_csc_symv_columns(first, &K, 2.0, x, 0, middle);
        uz_csc_symv_columns(second, &K, 2.0, x, middle, n);
        for (int64_t i = 0; i < n; i++)
            CHECK(first[i] + second[i] == want[i] && (i >= middle || second[i] == 0));
        uz_csc_clear(&K);
    }
}

static uz_csc two_by_two(double a, double b, double c, double d)
{
    const int64_t row[4] = {0, 0, 1, 1}, col[4] = {0, 1, 0, 1};
    const double val[4] = {a, b, c, d};
    uz_csc A;
    CHECK_INT(uz_csc_from_triplets(&A, 2, 2, 4, row, col, val, NULL), UZ_OK);
    return A;
}

TEST(halves_within_rounding_are_averaged)
{
    uz_csc K = two_by_two(100.0, 1.0, 1.0 + 9e-11, 1.0);
    CHECK_INT(uz_symmetric_lower(&K, NULL), UZ_OK);
    CHECK_INT(K.ptr[2], 3);
    CHECK_REL(K.val[1], 1.0 + 4.5e-11, 1e-15);
    uz_csc_clear(&K);
}

TEST(the_worst_pair_is_named)
{
    uz_error err;
    uz_csc K = two_by_two(100.0, 1.0, 1.0 + 2e-10, 1.0);
    CHECK_INT(uz_symmetric_lower(&K, &err), UZ_ERR_NOT_SYMMETRIC);
    CHECK_STR(err.where, "K");
    CHECK(strstr(err.message, "(2, 1)") != NULL && strstr(err.message, "(1, 2)") != NULL);
    CHECK_INT(K.ptr[2], 4); /* a refused matrix is left as it was */
    uz_csc_clear(&K);
    K = two_by_two(0.0, 1.0, 2.0, 0.0);
    CHECK_INT(uz_symmetric_lower(&K, &err), UZ_ERR_NOT_SYMMETRIC);
    uz_csc_clear(&K);
    K = two_by_two(1.0, NAN, NAN, 1.0);
    CHECK_INT(uz_symmetric_lower(&K, &err), UZ_ERR_NOT_FINITE);
    uz_csc_clear(&K);
    CHECK_INT(uz_csc_init(&K, 2, 3, 0, NULL), UZ_OK);
    CHECK_INT(uz_symmetric_lower(&K, &err), UZ_ERR_SIZE);
    uz_csc_clear(&K);
}

/* K = [2 .; 1 2] lower, N = [0 1], p, h of ones. */
static uz_qp small_problem(void)
{
    const int64_t k_row[3] = {0, 1, 1}, k_col[3] = {0, 0, 1}, n_row[1] = {0}, n_col[1] = {1};
    const double k_val[3] = {2, 1, 2}, n_val[1] = {1};
    uz_qp qp = {0};
    CHECK_INT(uz_csc_from_triplets(&qp.K, 2, 2, 3, k_row, k_col, k_val, NULL), UZ_OK);
    CHECK_INT(uz_csc_from_triplets(&qp.N, 1, 2, 1, n_row, n_col, n_val, NULL), UZ_OK);
    qp.p = calloc(2, sizeof *qp.p);
    qp.h = calloc(1, sizeof *qp.h);
    return qp;
}

static void check_refused(uz_qp *qp, uz_status status, const char *where)
{
    uz_error err;
    CHECK_INT(uz_qp_check(qp, &err), status);
    CHECK_INT(err.status, status);
    CHECK_STR(err.where, where);
    uz_qp_clear(qp);
}

TEST(a_problem_is_checked)
{
    uz_qp qp = small_problem();
    CHECK_INT(uz_qp_check(&qp, NULL), UZ_OK);
    qp.p[1] = INFINITY;
    check_refused(&qp, UZ_ERR_NOT_FINITE, "p");
    qp = small_problem();
    qp.h[0] = NAN;
    check_refused(&qp, UZ_ERR_NOT_FINITE, "h");
    qp = small_problem();
    qp.K.val[2] = -INFINITY;
    check_refused(&qp, UZ_ERR_NOT_FINITE, "K");
    qp = small_problem();
    qp.N.val[0] = NAN;
    check_refused(&qp, UZ_ERR_NOT_FINITE, "N");
    qp = small_problem();
    qp.N.cols = 1;
    check_refused(&qp, UZ_ERR_SIZE, "N");
    qp = small_problem();
    qp.K.rows = 3;
    check_refused(&qp, UZ_ERR_SIZE, "K");
    qp = small_problem();
    qp.K.idx[2] = 0; /* above the diagonal */
    check_refused(&qp, UZ_ERR_ARGUMENT, "K");
    qp = small_problem();
    free(qp.p);
    qp.p = NULL;
    check_refused(&qp, UZ_ERR_SIZE, "p");
    qp = (uz_qp){0};
    check_refused(&qp, UZ_ERR_SIZE, "K");
}

TEST(a_problem_without_contacts_is_legal)
{
    uz_qp qp = small_problem();
    uz_csc_clear(&qp.N);
    CHECK_INT(uz_qp_check(&qp, NULL), UZ_OK);
    CHECK_INT(uz_csc_init(&qp.N, 0, 2, 0, NULL), UZ_OK);
    CHECK_INT(uz_qp_check(&qp, NULL), UZ_OK);
    uz_qp_clear(&qp);
    uz_qp_clear(NULL);
}
