/* Every allocation of an operation fails once: the call must say UZ_ERR_MEMORY, publish nothing and leak nothing.
 * Linked with --wrap for malloc, calloc, realloc and free, so that calls from this program's objects come through here.
 */
#include "failing_heap.h"
#include "harness.h"
#include "numpy_files.h"
#include "uzawa.h"

enum { MOST_ALLOCATIONS = 100000 };

/* Does the work, frees what it got, and returns how the call under test ended. Checks that a failure published
 * nothing. Called once per allocation. */
typedef uz_status (*operation)(uz_error *err);

static bool ends_well(const char *name, operation run, int allowed)
{
    uz_error err = {0};
    heap_watch(allowed);
    uz_status status = run(&err);
    heap.watching = false;
    CHECK_MSG(heap.live == 0, "%s: %d blocks leaked after %d allocations", name, heap.live, allowed);
    CHECK_MSG(status == (heap.failed ? UZ_ERR_MEMORY : UZ_OK), "%s: %s after %d allocations (%s)", name,
              uz_status_name(status), allowed, err.message);
    CHECK_MSG(!heap.failed || (err.status == UZ_ERR_MEMORY && err.message[0]), "%s: no message", name);
    return !heap.failed;
}

/* At least `fewest` allocations must have been seen to fail, or the test tests nothing. */
static void fail_each_allocation(const char *name, operation run, int fewest)
{
    int allowed = 0;
    while (allowed < MOST_ALLOCATIONS && !ends_well(name, run, allowed))
        allowed++;
    CHECK_MSG(allowed >= fewest && allowed < MOST_ALLOCATIONS, "%s: %d allocations", name, allowed);
}

#define FAIL_EACH_ALLOCATION(run, fewest) fail_each_allocation(#run, run, fewest)

/* ------------------------------------------------------------- matrices */

static const int64_t ROW[4] = {1, 0, 1, 1}, COL[4] = {0, 0, 1, 0};
static const double VAL[4] = {1, 4, 5, 2};

static uz_status init(uz_error *err)
{
    uz_csc A;
    uz_status status = uz_csc_init(&A, 3, 4, 5, err);
    CHECK(status == UZ_OK || (!A.ptr && !A.idx && !A.val));
    uz_csc_clear(&A);
    return status;
}

static uz_status from_triplets(uz_error *err)
{
    uz_csc A;
    uz_status status = uz_csc_from_triplets(&A, 2, 2, 4, ROW, COL, VAL, err);
    CHECK(status == UZ_OK || !A.ptr);
    uz_csc_clear(&A);
    return status;
}

static uz_status copy_and_transpose(uz_error *err)
{
    uz_csc A, B = {0}, C = {0};
    uz_status status = uz_csc_from_triplets(&A, 2, 2, 4, ROW, COL, VAL, err);
    if (status == UZ_OK)
        status = uz_csc_copy(&B, &A, err);
    if (status == UZ_OK)
        status = uz_csc_transpose(&C, &A, err);
    CHECK(status == UZ_OK || !C.ptr);
    uz_csc_clear(&A);
    uz_csc_clear(&B);
    uz_csc_clear(&C);
    return status;
}

static uz_status symmetric_lower(uz_error *err)
{
    const int64_t row[4] = {0, 1, 0, 1}, col[4] = {0, 0, 1, 1};
    const double val[4] = {4, 1, 1, 4};
    uz_csc K;
    uz_status status = uz_csc_from_triplets(&K, 2, 2, 4, row, col, val, err);
    if (status == UZ_OK) {
        status = uz_symmetric_lower(&K, err);
        CHECK_INT(K.ptr[2], status == UZ_OK ? 3 : 4);
    }
    uz_csc_clear(&K);
    return status;
}

TEST(matrices)
{
    FAIL_EACH_ALLOCATION(init, 3);
    FAIL_EACH_ALLOCATION(from_triplets, 5);
    FAIL_EACH_ALLOCATION(copy_and_transpose, 11);
    FAIL_EACH_ALLOCATION(symmetric_lower, 11);
}

/* ------------------------------------------------------------- Matrix Market */

static uz_status read_text(const char *text, uz_error *err)
{
    uz_csc A;
    uz_mm_info info;
    uz_status status = uz_mm_read(&A, &info, text, strlen(text), 0, err);
    CHECK(status == UZ_OK || (!A.ptr && !A.idx && !A.val && info.rows == 0));
    uz_csc_clear(&A);
    return status;
}

static uz_status read_ordered(uz_error *err)
{
    return read_text("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 2 1\n", err);
}

static uz_status read_row_by_row(uz_error *err)
{
    return read_text("%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1\n1 2 1\n2 1 1\n", err);
}

static uz_status read_unordered(uz_error *err)
{
    return read_text("%%MatrixMarket matrix coordinate real general\n2 2 3\n2 1 1\n2 2 1\n1 1 1\n", err);
}

static uz_status read_array(uz_error *err)
{
    return read_text("%%MatrixMarket matrix array real general\n2 1\n1\n2\n", err);
}

static uz_status read_vector_text(const char *text, uz_error *err)
{
    double *x;
    int64_t n;
    uz_status status = uz_mm_read_vector(&x, &n, text, strlen(text), 0, err);
    CHECK(status == UZ_OK || (!x && n == 0));
    free(x);
    return status;
}

static uz_status read_vector(uz_error *err)
{
    return read_vector_text("%%MatrixMarket matrix array real general\n2 1\n1\n2\n", err);
}

static uz_status read_sparse_vector(uz_error *err)
{
    return read_vector_text("%%MatrixMarket matrix coordinate real general\n3 1 2\n3 1 1\n1 1 2\n", err);
}

/* ------------------------------------------------------------------ NumPy */

static uz_status write_arrays(uz_error *err)
{
    char *file;
    size_t len;
    const double x[2] = {1, 2};
    const uz_npz_array list[] = {{.name = "a.json", .text = "{}"}, {.name = "x", .x = x, .rows = 2}};
    const uz_status status = uz_npz_write(&file, &len, list, 2, err);
    CHECK(status == UZ_OK || (!file && len == 0));
    free(file);
    return status;
}

static uz_status read_numpy_vector(uz_error *err)
{
    double *x;
    int64_t n;
    const uz_status status = uz_vector_read(&x, &n, NULL, NUMPY_PACKED, sizeof NUMPY_PACKED - 1, 0, err);
    CHECK(status == UZ_OK ? n == 2 && x[1] == 2 : !x && n == 0);
    free(x);
    return status;
}

static uz_status read_numpy_matrix(uz_error *err)
{
    uz_csc A;
    uz_mm_symmetry symmetry;
    const uz_status status = uz_matrix_read(&A, &symmetry, NUMPY_SPARSE, sizeof NUMPY_SPARSE - 1, 0, err);
    CHECK(status == UZ_OK ? A.rows == 2 && A.ptr[2] == 2 : !A.ptr);
    uz_csc_clear(&A);
    return status;
}

TEST(numpy)
{
    FAIL_EACH_ALLOCATION(write_arrays, 3);
    FAIL_EACH_ALLOCATION(read_numpy_vector, 2);
    FAIL_EACH_ALLOCATION(read_numpy_matrix, 10);
}

TEST(matrix_market)
{
    FAIL_EACH_ALLOCATION(read_ordered, 3);
    FAIL_EACH_ALLOCATION(read_row_by_row, 6);
    FAIL_EACH_ALLOCATION(read_unordered, 7);
    FAIL_EACH_ALLOCATION(read_array, 3);
    FAIL_EACH_ALLOCATION(read_vector, 3);
    FAIL_EACH_ALLOCATION(read_sparse_vector, 7);
}
