/* NumPy's files: what is written is read back, what other programs have written is read, what is no matrix refused. The
 * long list of refusals is in tests/api/test_numpy.py, where NumPy itself writes them. */
#include "harness.h"
#include "numpy_files.h"
#include "uzawa.h"

#include <stdlib.h>

static uz_status read_matrix(uz_csc *out, const char *file, size_t len, uz_error *err)
{
    uz_mm_symmetry symmetry = UZ_MM_SYMMETRIC;
    const uz_status status = uz_matrix_read(out, &symmetry, file, len, 0, err);
    CHECK(symmetry == UZ_MM_GENERAL);
    return status;
}

TEST(what_other_programs_have_written)
{
    uz_csc A;
    double *x;
    int64_t n;
    CHECK(read_matrix(&A, NUMPY_SPARSE, sizeof NUMPY_SPARSE - 1, NULL) == UZ_OK);
    CHECK(A.rows == 2 && A.cols == 2 && A.ptr[1] == 2 && A.ptr[2] == 2);
    CHECK(A.idx[0] == 0 && A.idx[1] == 1 && A.val[0] == 2 && A.val[1] == -1);
    uz_csc_clear(&A);
    CHECK(read_matrix(&A, NUMPY_DENSE, sizeof NUMPY_DENSE - 1, NULL) == UZ_OK);
    CHECK(A.rows == 2 && A.cols == 2 && A.ptr[1] == 1 && A.ptr[2] == 3); /* the zero is no entry */
    CHECK(A.val[0] == 1 && A.val[1] == 2 && A.val[2] == -4);
    uz_csc_clear(&A);
    CHECK(uz_vector_read(&x, &n, NULL, NUMPY_PACKED, sizeof NUMPY_PACKED - 1, 0, NULL) == UZ_OK);
    CHECK(n == 2 && x[0] == 1 && x[1] == 2);
    free(x);
}

TEST(text_is_read_as_before)
{
    static const char TEXT[] = "%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n2 1 3\n";
    uz_csc A;
    uz_mm_symmetry symmetry;
    uz_error err;
    CHECK(uz_matrix_read(&A, &symmetry, TEXT, sizeof TEXT - 1, 0, NULL) == UZ_OK && symmetry == UZ_MM_SYMMETRIC);
    CHECK(A.ptr[2] == 1 && A.val[0] == 3);
    uz_csc_clear(&A);
    CHECK(uz_matrix_read(&A, &symmetry, "", 0, 0, &err) == UZ_ERR_FORMAT && err.line == 1);
}

/* A single array of an archive is the matrix or the vector. */
TEST(what_is_written_is_read_back)
{
    const double x[6] = {1, -2.5, 0, 4, 5, 1e-300};
    char *file;
    size_t len;
    double *back;
    int64_t n;
    int columns = -1;
    uz_csc A;
    for (int whole = 0; whole < 2; whole++) {
        const uz_npz_array list[] = {{.name = "missing"},
                                     {.name = "x", .x = x, .rows = 3, .columns = 2, .whole = whole}};
        CHECK(uz_npz_write(&file, &len, list, 2, NULL) == UZ_OK);
        CHECK(read_matrix(&A, file, len, NULL) == UZ_OK && A.rows == 3 && A.cols == 2);
        CHECK_INT(A.ptr[1], 2);
        CHECK_INT(A.ptr[2], whole ? 4 : 5);
        CHECK(A.val[1] == 5 && A.val[2] == (whole ? -2 : -2.5));
        uz_csc_clear(&A);
        CHECK(uz_vector_read(&back, &n, &columns, file, len, 0, NULL) == UZ_OK && n == 6 && columns == 2);
        for (int i = 0; i < 6; i++)
            CHECK(back[i] == (whole ? (double)(int64_t)x[i] : x[i]));
        free(back);
        CHECK(uz_vector_read(&back, &n, NULL, file, len, 0, NULL) == UZ_ERR_SIZE && !back && n == 0);
        free(file);
    }
    const uz_npz_array one[] = {{.name = "x", .x = x, .rows = 6}};
    CHECK(uz_npz_write(&file, &len, one, 1, NULL) == UZ_OK);
    CHECK(uz_vector_read(&back, &n, &columns, file, len, 0, NULL) == UZ_OK && n == 6 && columns == 0);
    CHECK(memcmp(back, x, sizeof x) == 0);
    free(back);
    free(file);
}

/* Every beginning of a file is refused, and every byte that is changed is refused or changes no more than a number. */
TEST(damaged_files)
{
    static const struct {
        const char *file;
        size_t len;
    } FILES[] = {{NUMPY_SPARSE, sizeof NUMPY_SPARSE - 1}, {NUMPY_DENSE, sizeof NUMPY_DENSE - 1}};
    for (size_t f = 0; f < 2; f++)
        for (size_t i = 0; i < FILES[f].len; i++) {
            char *copy = malloc(FILES[f].len);
            uz_csc A;
            uz_error err;
            memcpy(copy, FILES[f].file, FILES[f].len);
            CHECK_MSG(read_matrix(&A, copy, i > 6 ? i : 7, &err) != UZ_OK && err.message[0], "%zu bytes", i);
            copy[i] ^= 0x15;
            if (i > 6 && read_matrix(&A, copy, FILES[f].len, &err) == UZ_OK)
                CHECK(A.rows <= 2 && A.cols <= 2 && A.ptr[A.cols] <= 4);
            uz_csc_clear(&A);
            free(copy);
        }
}
