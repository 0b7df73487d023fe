/* numpy_read.c: matrices and vectors in any format that is read: NumPy's files, else Matrix Market text.
 *
 * Sparse matrices are archives as scipy.sparse.save_npz writes them: "format", "shape" and "data", with "indices" and
 * "indptr" (csr, csc), or "row" and "col" (coo). Entries of one place are added, as SciPy does. */
#include "core/alloc.h"
#include "core/error.h"
#include "io/numpy.h"

#include <stdlib.h>
#include <string.h>

/* Without a limit from the caller, as for Matrix Market text. */
static size_t limit_of(size_t max_bytes, size_t len)
{
    return max_bytes > 0 ? max_bytes : ((size_t)1 << 30) + 64 * len;
}

/* A matrix of so many entries, and `extra` bytes for each of them beside it. */
static uz_status check_room(int64_t rows, int64_t cols, int64_t entries, int64_t extra, size_t limit, uz_error *err)
{
    int64_t bytes, starts;
    if (!__builtin_add_overflow(rows, cols, &starts) && !__builtin_add_overflow(starts, 2, &starts) &&
        !__builtin_mul_overflow(starts, 8, &starts) && !__builtin_mul_overflow(entries, 16 + extra, &bytes) &&
        !__builtin_add_overflow(bytes, starts, &bytes) && (uint64_t)bytes <= limit)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_LIMIT, "/numpy",
                   "a %lld x %lld matrix with %lld entries takes more memory than is allowed here", (long long)rows,
                   (long long)cols, (long long)entries);
}

/* ---- one array */

/* Of an archive the only array; `file` is open until npz_close in every case. */
static uz_status open_array(npy_array *out, npz_file *file, const char *data, size_t len, size_t limit, uz_error *err)
{
    *file = (npz_file){.count = 0};
    if (npy_recognises(data, len))
        return npy_open(out, "the array", data, len, err);
    const uz_status status = npz_open(file, data, len, limit, err);
    if (status != UZ_OK)
        return status;
    if (file->count != 1)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy",
                       "the archive has %d members, and is no sparse matrix of SciPy's: send one array, by numpy.save",
                       file->count);
    return npz_take(out, file, &file->member[0], err);
}

static uz_status read_dense(uz_csc *out, const npy_array *from, size_t limit, uz_error *err)
{
    const int64_t rows = from->shape[0], cols = from->shape[1];
    int64_t entries = 0;
    double value;
    if (from->rank != 2)
        return uz_fail(err, UZ_ERR_SIZE, "/numpy", "%s has %d dimensions, and a matrix has two", from->name,
                       from->rank);
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < from->count && status == UZ_OK; i++) {
        status = npy_real(&value, from, i, err);
        entries += status == UZ_OK && value != 0;
    }
    if (status == UZ_OK)
        status = check_room(rows, cols, entries, 0, limit, err);
    if (status == UZ_OK)
        status = uz_csc_init(out, rows, cols, entries, err);
    for (int64_t j = 0, at = 0; j < cols && status == UZ_OK; j++) {
        for (int64_t i = 0; i < rows; i++) {
            npy_real(&value, from, npy_place(from, i, j), err); /* finite: all were looked at */
            if (value == 0)
                continue;
            out->idx[at] = (int32_t)i;
            out->val[at++] = value;
        }
        out->ptr[j + 1] = at;
    }
    return status;
}

static uz_status read_vector(double **out, int64_t *n, int *columns, const npy_array *from, size_t limit, uz_error *err)
{
    const bool points = columns && from->rank == 2 && from->shape[1] <= 3;
    if (!points && (from->rank < 1 || (from->shape[0] != 1 && from->shape[1] != 1)))
        return uz_fail(err, UZ_ERR_SIZE, "/numpy", "a vector was expected; %s is of %d dimensions, %lld x %lld",
                       from->name, from->rank, (long long)from->shape[0], (long long)from->shape[1]);
    if ((uint64_t)from->count > limit / sizeof **out)
        return uz_fail(err, UZ_ERR_LIMIT, "/numpy", "%s takes more memory than is allowed here", from->name);
    double *x = uz_alloc(from->count, sizeof *x);
    uz_status status = x ? UZ_OK : uz_no_memory(err, "a vector");
    for (int64_t i = 0, at = 0; i < from->shape[0] && status == UZ_OK; i++)
        for (int64_t j = 0; j < from->shape[1] && status == UZ_OK; j++)
            status = npy_real(&x[at++], from, npy_place(from, i, j), err);
    if (status != UZ_OK) {
        free(x);
        return status;
    }
    *out = x;
    *n = from->count;
    if (points && from->shape[1] > 1)
        *columns = (int)from->shape[1];
    return UZ_OK;
}

/* ---- a sparse matrix */

typedef enum { BY_ROWS, BY_COLUMNS, BY_PLACE } sparse_kind;

typedef struct {
    npy_array values, first, second; /* csr, csc: indices and indptr; coo: row and col */
    int64_t rows, cols, entries;
    sparse_kind kind;
} sparse;

static uz_status take(npy_array *out, npz_file *file, const char *name, uz_error *err)
{
    npz_member *member = npz_find(file, name);
    if (!member)
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                       "the archive of a sparse matrix has no %s: save it by scipy.sparse.save_npz", name);
    return npz_take(out, file, member, err);
}

static uz_status take_kind(sparse *out, npz_file *file, uz_error *err)
{
    static const char *const NAMES[] = {[BY_ROWS] = "csr", [BY_COLUMNS] = "csc", [BY_PLACE] = "coo"};
    npy_array format;
    char word[8] = "";
    const uz_status status = take(&format, file, "format.npy", err);
    if (status != UZ_OK)
        return status;
    const int step = format.kind == 'U' ? 4 : 1;
    for (int i = 0; format.count == 1 && (format.kind == 'U' || format.kind == 'S') && i < 7 && i < format.size / step;
         i++) {
        const unsigned char c = format.data[i * step + (format.kind == 'U' && format.reversed ? 3 : 0)];
        word[i] = (char)(c > ' ' && c <= '~' ? c : '\0');
    }
    for (int i = BY_ROWS; i <= BY_PLACE; i++)
        if (strcmp(word, NAMES[i]) == 0) {
            out->kind = (sparse_kind)i;
            return UZ_OK;
        }
    return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy",
                   "a sparse matrix of the format \"%s\" is not read: save it as csr, csc or coo, by matrix.tocsr()",
                   word);
}

static uz_status take_shape(sparse *out, npz_file *file, uz_error *err)
{
    npy_array shape;
    uz_status status = take(&shape, file, "shape.npy", err);
    if (status == UZ_OK && shape.count != 2)
        status = uz_fail(err, UZ_ERR_SIZE, "/numpy", "the shape of a matrix has two numbers, not %lld",
                         (long long)shape.count);
    if (status == UZ_OK)
        status = npy_whole(&out->rows, &shape, 0, err);
    if (status == UZ_OK)
        status = npy_whole(&out->cols, &shape, 1, err);
    return status == UZ_OK && (out->rows < 0 || out->cols < 0)
               ? uz_fail(err, UZ_ERR_FORMAT, "/numpy", "the shape of the matrix has a negative number")
               : status;
}

static uz_status take_sparse(sparse *out, npz_file *file, uz_error *err)
{
    uz_status status = take_kind(out, file, err);
    const bool coo = status == UZ_OK && out->kind == BY_PLACE;
    if (status == UZ_OK)
        status = take_shape(out, file, err);
    if (status == UZ_OK)
        status = take(&out->values, file, "data.npy", err);
    if (status == UZ_OK)
        status = take(&out->first, file, coo ? "row.npy" : "indices.npy", err);
    if (status == UZ_OK)
        status = take(&out->second, file, coo ? "col.npy" : "indptr.npy", err);
    if (status != UZ_OK)
        return status;
    const int64_t lines = out->kind == BY_ROWS ? out->rows : out->cols;
    out->entries = out->values.count;
    if (out->values.rank != 1 || out->first.rank != 1 || out->second.rank != 1 || out->first.count != out->entries ||
        (coo ? out->second.count != out->entries : out->second.count - 1 != lines))
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                       "data.npy, %s and %s of the archive do not have the lengths of a %lld x %lld matrix",
                       out->first.name, out->second.name, (long long)out->rows, (long long)out->cols);
    return UZ_OK;
}

/* Where each entry stands, from the starts of rows or columns; entries behind the last of them are none. */
static uz_status fill_lines(int64_t *line, int64_t *across, sparse *from, uz_error *err)
{
    int64_t end = 0, next;
    for (int64_t i = 0; i < from->second.count; i++) {
        uz_status status = npy_whole(&next, &from->second, i, err);
        if (status == UZ_OK && (next < end || next > from->entries || (i == 0 && next != 0)))
            status = uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                             "indptr.npy begins with 0 and does not fall, and its number %lld is %lld", (long long)i,
                             (long long)next);
        for (; end < next && status == UZ_OK; end++) {
            line[end] = i - 1;
            status = npy_whole(&across[end], &from->first, end, err);
        }
        if (status != UZ_OK)
            return status;
    }
    from->entries = end;
    return UZ_OK;
}

static uz_status fill_places(int64_t *row, int64_t *col, const sparse *from, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < from->entries && status == UZ_OK; k++) {
        status = npy_whole(&row[k], &from->first, k, err);
        if (status == UZ_OK)
            status = npy_whole(&col[k], &from->second, k, err);
    }
    return status;
}

static uz_status read_sparse(uz_csc *out, npz_file *file, size_t limit, uz_error *err)
{
    sparse from = {.entries = 0};
    uz_status status = take_sparse(&from, file, err);
    if (status == UZ_OK)
        status = check_room(from.rows, from.cols, from.entries, 40, limit, err);
    if (status != UZ_OK)
        return status;
    int64_t *row = uz_alloc(from.entries, sizeof *row), *col = uz_alloc(from.entries, sizeof *col);
    double *val = uz_alloc(from.entries, sizeof *val);
    if (!row || !col || !val)
        status = uz_no_memory(err, "a sparse matrix");
    else
        status = from.kind == BY_ROWS      ? fill_lines(row, col, &from, err)
                 : from.kind == BY_COLUMNS ? fill_lines(col, row, &from, err)
                                           : fill_places(row, col, &from, err);
    for (int64_t k = 0; k < from.entries && status == UZ_OK; k++) {
        status = npy_real(&val[k], &from.values, k, err);
        if (status == UZ_OK && (row[k] < 0 || row[k] >= from.rows || col[k] < 0 || col[k] >= from.cols))
            status =
                uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                        "entry %lld of the archive, from 0, is at row %lld and column %lld of a %lld x %lld matrix",
                        (long long)k, (long long)row[k], (long long)col[k], (long long)from.rows, (long long)from.cols);
    }
    if (status == UZ_OK)
        status = uz_csc_from_triplets(out, from.rows, from.cols, from.entries, row, col, val, err);
    uz_free_all(row, col, val);
    return status;
}

/* ---- entries */

uz_status uz_matrix_read(uz_csc *out, uz_mm_symmetry *symmetry, const char *data, size_t len, size_t max_bytes,
                         uz_error *err)
{
    uz_mm_info info = {.symmetry = UZ_MM_GENERAL};
    npz_file file = {.count = 0};
    npy_array array;
    uz_csc made = {0};
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    if (!npy_recognises(data, len) && !npz_recognises(data, len)) {
        const uz_status status = uz_mm_read(out, &info, data, len, max_bytes, err);
        *symmetry = info.symmetry;
        return status;
    }
    *symmetry = UZ_MM_GENERAL;
    const size_t limit = limit_of(max_bytes, len);
    uz_status status = npz_recognises(data, len) ? npz_open(&file, data, len, limit, err) : UZ_OK;
    if (status == UZ_OK && npz_find(&file, "format.npy")) {
        status = read_sparse(&made, &file, limit, err);
    } else if (status == UZ_OK) {
        npz_close(&file);
        status = open_array(&array, &file, data, len, limit, err);
        if (status == UZ_OK)
            status = read_dense(&made, &array, limit, err);
    }
    npz_close(&file);
    if (status == UZ_OK)
        *out = made;
    else
        uz_csc_clear(&made);
    return status;
}

uz_status uz_vector_read(double **out, int64_t *n, int *columns, const char *data, size_t len, size_t max_bytes,
                         uz_error *err)
{
    npz_file file;
    npy_array array;
    uz_error_reset(err);
    *out = NULL;
    *n = 0;
    if (columns)
        *columns = 0;
    if (!npy_recognises(data, len) && !npz_recognises(data, len))
        return uz_mm_read_vector(out, n, data, len, max_bytes, err);
    const size_t limit = limit_of(max_bytes, len);
    uz_status status = open_array(&array, &file, data, len, limit, err);
    if (status == UZ_OK)
        status = read_vector(out, n, columns, &array, limit, err);
    npz_close(&file);
    return status;
}
