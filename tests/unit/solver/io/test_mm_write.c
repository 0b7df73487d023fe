/* What is written reads back bit for bit. */
#include "harness.h"
#include "uzawa.h"

#include <float.h>
#include <locale.h>

static uint64_t state = 1181783497276652981u;

static double random_finite(void)
{
    double value;
    do {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        memcpy(&value, &state, sizeof value);
    } while (!isfinite(value));
    return value;
}

static const double SPECIAL[] = {0.0,
                                 -0.0,
                                 1.0,
                                 -1.0,
                                 0.1,
                                 1e15,
                                 1e16,
                                 999999999999999.0,
                                 5e-324,
                                 DBL_MIN,
                                 DBL_MAX,
                                 -DBL_MAX,
                                 1e22,
                                 1e23,
                                 9007199254740993.0,
                                 1.0 / 3.0,
                                 DBL_EPSILON,
                                 123456.789};
enum { SPECIALS = sizeof SPECIAL / sizeof SPECIAL[0], COUNT = 20000 };

TEST(vectors_read_back_bit_for_bit)
{
    static double x[COUNT];
    char *text;
    size_t len;
    double *back;
    int64_t n;
    for (int k = 0; k < COUNT; k++)
        x[k] = k < SPECIALS ? SPECIAL[k] : k % 2 ? random_finite() : (double)(k % 1000) / 8.0;
    CHECK_INT(uz_mm_write_vector(&text, &len, x, COUNT, NULL), UZ_OK);
    CHECK_INT(len, strlen(text));
    CHECK_INT(uz_mm_read_vector(&back, &n, text, len, 0, NULL), UZ_OK);
    CHECK_INT(n, COUNT);
    CHECK(back && memcmp(back, x, sizeof x) == 0);
    free(back);
    free(text);
}

static void check_round_trip(const uz_csc *A, uz_mm_symmetry symmetry)
{
    char *text;
    size_t len;
    uz_csc back;
    uz_mm_info info;
    uz_error err = {0};
    size_t nnz = (size_t)A->ptr[A->cols];
    CHECK_INT(uz_mm_write(&text, &len, A, symmetry, NULL), UZ_OK);
    CHECK_INT(uz_mm_read(&back, &info, text, len, 0, &err), UZ_OK);
    CHECK_STR(err.message, "");
    CHECK(info.symmetry == symmetry && info.entries == A->ptr[A->cols] && back.rows == A->rows && back.cols == A->cols);
    if (back.ptr) {
        CHECK(memcmp(back.ptr, A->ptr, sizeof(int64_t) * (size_t)(A->cols + 1)) == 0);
        CHECK(memcmp(back.idx, A->idx, sizeof(int64_t) * nnz) == 0);
        CHECK(memcmp(back.val, A->val, sizeof(double) * nnz) == 0);
    }
    uz_csc_clear(&back);
    free(text);
}

TEST(matrices_read_back_bit_for_bit)
{
    enum { N = 40 };
    int64_t row[N * N], col[N * N], count = 0;
    double val[N * N];
    uz_csc A;
    for (int64_t k = 0; k < 7 * N; k++) {
        row[count] = (k * 13 + 5) % N;
        col[count] = (k * 7) % N;
        val[count] = random_finite();
        count += row[count] >= col[count];
    }
    CHECK_INT(uz_csc_from_triplets(&A, N, N, count, row, col, val, NULL), UZ_OK);
    for (int64_t k = 0; k < A.ptr[N]; k++)
        A.val[k] = random_finite(); /* repeated triplets may have overflowed */
    check_round_trip(&A, UZ_MM_GENERAL);
    check_round_trip(&A, UZ_MM_SYMMETRIC);
    uz_csc_clear(&A);
    CHECK_INT(uz_csc_init(&A, 0, 3, 0, NULL), UZ_OK);
    check_round_trip(&A, UZ_MM_GENERAL);
    uz_csc_clear(&A);
}

static void check_written(double value, const char *want)
{
    char *text;
    size_t len;
    CHECK_INT(uz_mm_write_vector(&text, &len, &value, 1, NULL), UZ_OK);
    const char *head = "%%MatrixMarket matrix array real general\n1 1\n";
    CHECK(strncmp(text, head, strlen(head)) == 0);
    CHECK_STR(text + strlen(head), want);
    free(text);
}

TEST(numbers_are_written_short)
{
    check_written(0.1, "0.1\n");
    check_written(-3.0, "-3\n");
    check_written(-0.0, "-0\n");
    check_written(1e300, "1e+300\n");
    check_written(0.1 + 0.2, "0.30000000000000004\n");
    check_written(1234567890123456.0, "1234567890123456\n");
}

TEST(what_cannot_be_written_is_refused)
{
    double nan = NAN;
    char *text = (char *)"";
    size_t len = 1;
    uz_error err;
    uz_csc A;
    CHECK_INT(uz_mm_write_vector(&text, &len, &nan, 1, &err), UZ_ERR_NOT_FINITE);
    CHECK(text == NULL && len == 0);
    CHECK_INT(uz_mm_write_vector(&text, &len, NULL, -1, &err), UZ_ERR_ARGUMENT);
    const int64_t row = 0, col = 1;
    CHECK_INT(uz_csc_from_triplets(&A, 2, 2, 1, &row, &col, &nan, NULL), UZ_OK);
    CHECK_INT(uz_mm_write(&text, &len, &A, UZ_MM_SYMMETRIC, &err), UZ_ERR_ARGUMENT);
    CHECK_INT(uz_mm_write(&text, &len, &A, UZ_MM_GENERAL, &err), UZ_ERR_NOT_FINITE);
    uz_csc_clear(&A);
    CHECK_INT(uz_csc_init(&A, 2, 3, 0, NULL), UZ_OK);
    CHECK_INT(uz_mm_write(&text, &len, &A, UZ_MM_SYMMETRIC, &err), UZ_ERR_ARGUMENT);
    uz_csc_clear(&A);
}

TEST(the_decimal_point_does_not_depend_on_the_locale)
{
    if (!setlocale(LC_NUMERIC, "de_DE.UTF-8") && !setlocale(LC_NUMERIC, "fr_FR.UTF-8")) {
        test_skip("no locale with a decimal comma is installed");
        return;
    }
    check_written(0.1, "0.1\n");
    check_written(1.5e-300, "1.5e-300\n");
    setlocale(LC_NUMERIC, "C");
}
