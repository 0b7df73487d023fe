/* decode_matrices.c: a problem given by its matrices. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>

/* The library's error about one of the matrices, or about what it names itself. */
static bool refuse_call(decoding *d, uz_error *err, const char *name)
{
    if (!err->where[0])
        snprintf(err->where, sizeof err->where, "%s", name);
    codec_problem_from_error(d->problem, err, UZ_PROBLEM_MATRICES);
    return false;
}

static bool read_matrix(uz_csc *out, uz_mm_symmetry *symmetry, decoding *d, const json_value *value)
{
    uz_error err = {.status = UZ_OK};
    decode_source source;
    if (!decode_source_open(&source, d, value))
        return false;
    const size_t bound = d->bound + 32 * source.len;
    const bool good = uz_matrix_read(out, symmetry, source.data, source.len, bound, &err) == UZ_OK;
    decode_source_close(&source);
    return good || decode_refuse_file(d, &err, value);
}

/* A symmetric file gave its lower triangle; N is general, so the mirror image of each entry off the diagonal is added.
 */
static bool add_upper_half(decoding *d, uz_csc *A)
{
    const size_t nnz = (size_t)A->ptr[A->cols];
    uz_csc full = {0};
    uz_error err = {.status = UZ_OK};
    int64_t *row = room_for(nnz, 2 * sizeof *row), *col = room_for(nnz, 2 * sizeof *col);
    double *val = room_for(nnz, 2 * sizeof *val);
    const bool room = row && col && val;
    bool good = false;
    if (room) {
        int64_t count = 0;
        for (int64_t j = 0; j < A->cols; j++)
            for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
                const int copies = A->idx[k] == j ? 1 : 2;
                for (int mirror = 0; mirror < copies; mirror++, count++) {
                    row[count] = mirror ? j : A->idx[k];
                    col[count] = mirror ? A->idx[k] : j;
                    val[count] = A->val[k];
                }
            }
        good = uz_csc_from_triplets(&full, A->rows, A->cols, count, row, col, val, &err) == UZ_OK;
    }
    if (good) {
        uz_csc_clear(A);
        *A = full;
    }
    free(row);
    free(col);
    free(val);
    if (!room)
        return problem_no_memory(d->problem);
    return good || refuse_call(d, &err, "N");
}

bool decode_matrices(uz_qp *out, decoding *d, const json_value *object)
{
    uz_mm_symmetry symmetry;
    uz_error err = {.status = UZ_OK};
    const json_value *of_K = json_get(object, "K"), *of_N = json_get(object, "N");
    const json_value *p = json_get(object, "p"), *h = json_get(object, "h");
    uz_csc *K = &out->K, *N = &out->N;
    int64_t n = 0, m = 0;
    if (!read_matrix(K, &symmetry, d, of_K))
        return false;
    if (K->rows != K->cols || K->rows == 0)
        return decode_refuse(d, "size_mismatch", of_K,
                             "is %lld x %lld, but a stiffness matrix is square and not empty.", (long long)K->rows,
                             (long long)K->cols);
    if (symmetry != UZ_MM_SYMMETRIC && uz_symmetric_lower(K, &err) != UZ_OK)
        return refuse_call(d, &err, "K");
    if (!decode_vector(&out->p, &n, d, p))
        return false;
    if (n != K->rows)
        return decode_refuse(d, "size_mismatch", p, "is %lld x 1, but K is %lld x %lld; p needs a number for each row.",
                             (long long)n, (long long)K->rows, (long long)K->cols);

    /* without N there are no contacts */
    if (!of_N && uz_csc_init(N, 0, K->cols, 0, &err) != UZ_OK)
        return refuse_call(d, &err, "N");
    if (of_N && !read_matrix(N, &symmetry, d, of_N))
        return false;
    if (N->cols != K->cols)
        return decode_refuse(d, "size_mismatch", of_N,
                             "is %lld x %lld, but K is %lld x %lld; they must have as many columns.",
                             (long long)N->rows, (long long)N->cols, (long long)K->rows, (long long)K->cols);
    if (of_N && symmetry != UZ_MM_GENERAL && !add_upper_half(d, N))
        return false;
    if (h ? !decode_vector(&out->h, &m, d, h) : !(out->h = room_for(0, sizeof(double))))
        return h ? false : problem_no_memory(d->problem);
    if (h && m != N->rows)
        return decode_refuse(d, "size_mismatch", h, "has %lld numbers, but N has %lld rows.", (long long)m,
                             (long long)N->rows);
    return uz_qp_check(out, &err) == UZ_OK || refuse_call(d, &err, "");
}
