#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One problem on its way from JSON to matrices. */
typedef struct {
    uz_qp *out;
    json_doc *doc;
    const json_t *object; /* the request's "problem" */
    size_t bound;         /* bytes that one matrix or vector may take */
    problem_details *problem;
} reading;

/* ------------------------------------------------------------- failures */

static bool refuse_call(const reading *r, uz_error *err, const char *name)
{
    if (!err->where[0])
        snprintf(err->where, sizeof err->where, "%s", name);
    codec_problem_from_error(r->problem, err, UZ_PROBLEM_MATRICES);
    return false;
}

static bool refuse_memory(const reading *r)
{
    problem_set(r->problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return false;
}

static bool refuse_size(const reading *r, const char *name, int64_t rows, int64_t cols, const char *should)
{
    json_path top = {NULL, "problem", 7, 0}, path = {&top, name, strlen(name), 0};
    problem_set(r->problem, 422, "size_mismatch", &path, "/problem/%s is %lld x %lld, but K is %lld x %lld%s.", name,
                (long long)rows, (long long)cols, (long long)r->out->K.rows, (long long)r->out->K.cols, should);
    return false;
}

static bool refuse_shape(const reading *r)
{
    json_path top = {NULL, "problem", 7, 0}, path = {&top, "K", 1, 0};
    problem_set(r->problem, 422, "size_mismatch", &path,
                "/problem/K is %lld x %lld, but a stiffness matrix is square and not empty.", (long long)r->out->K.rows,
                (long long)r->out->K.cols);
    return false;
}

/* ------------------------------------------------------------- reading */

static bool read_matrix(const reading *r, uz_csc *out, uz_mm_info *info, const char *name)
{
    uz_error err = {.status = UZ_OK};
    const json_t *value = json_object_get(r->object, name);
    decode_source text;
    if (!decode_source_open(&text, r->doc, value, name, r->problem))
        return false;
    bool good = uz_mm_read(out, info, text.data, text.len, r->bound + 32 * text.len, &err) == UZ_OK;
    decode_source_close(&text, r->doc, value);
    return good || refuse_call(r, &err, name);
}

static bool read_vector(const reading *r, double **out, int64_t *n, const char *name)
{
    return decode_vector(out, n, r->doc, json_object_get(r->object, name), r->bound, name, r->problem);
}

/* ------------------------------------------------------------ matrices */

static bool read_stiffness(const reading *r)
{
    uz_mm_info info;
    uz_error err = {.status = UZ_OK};
    uz_csc *K = &r->out->K;
    if (!read_matrix(r, K, &info, "K"))
        return false;
    if (K->rows != K->cols || K->rows == 0)
        return refuse_shape(r);
    return info.symmetry == UZ_MM_SYMMETRIC || uz_symmetric_lower(K, &err) == UZ_OK || refuse_call(r, &err, "K");
}

/* Each stored entry, and its mirror image where it lies off the diagonal; returns how many. */
static int64_t list_both_halves(const uz_csc *A, int64_t *row, int64_t *col, double *val)
{
    int64_t count = 0;
    for (int64_t j = 0; j < A->cols; j++)
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            int copies = A->idx[k] == j ? 1 : 2;
            for (int mirror = 0; mirror < copies; mirror++, count++) {
                row[count] = mirror ? j : A->idx[k];
                col[count] = mirror ? A->idx[k] : j;
                val[count] = A->val[k];
            }
        }
    return count;
}

/* A symmetric file gave its lower triangle; N is general, so the other half is added. */
static bool add_upper_half(const reading *r, uz_csc *A)
{
    size_t nnz = (size_t)A->ptr[A->cols];
    uz_csc full = {0};
    uz_error err = {.status = UZ_OK};
    int64_t *row = room_for(nnz, 2 * sizeof *row), *col = room_for(nnz, 2 * sizeof *col);
    double *val = room_for(nnz, 2 * sizeof *val);
    bool room = row && col && val, good = false;
    if (room) {
        int64_t count = list_both_halves(A, row, col, val);
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
        return refuse_memory(r);
    return good || refuse_call(r, &err, "N");
}

static bool no_contacts(const reading *r)
{
    uz_error err = {.status = UZ_OK};
    return uz_csc_init(&r->out->N, 0, r->out->K.cols, 0, &err) == UZ_OK || refuse_call(r, &err, "N");
}

static bool read_normals(const reading *r)
{
    uz_mm_info info;
    uz_csc *N = &r->out->N;
    if (!json_object_get(r->object, "N"))
        return no_contacts(r);
    if (!read_matrix(r, N, &info, "N"))
        return false;
    if (N->cols != r->out->K.cols)
        return refuse_size(r, "N", N->rows, N->cols, "; they must have as many columns");
    return info.symmetry == UZ_MM_GENERAL || add_upper_half(r, N);
}

static bool read_load(const reading *r)
{
    int64_t n = 0;
    if (!read_vector(r, &r->out->p, &n, "p"))
        return false;
    return n == r->out->K.rows || refuse_size(r, "p", n, 1, "; p needs a number for each row");
}

static bool read_gaps(const reading *r)
{
    int64_t n = 0, m = r->out->N.rows;
    json_path top = {NULL, "problem", 7, 0}, path = {&top, "h", 1, 0};
    if (!json_object_get(r->object, "h"))
        return (r->out->h = room_for(0, sizeof(double))) || refuse_memory(r);
    if (!read_vector(r, &r->out->h, &n, "h"))
        return false;
    if (n != m)
        problem_set(r->problem, 422, "size_mismatch", &path, "/problem/h has %lld numbers, but N has %lld rows.",
                    (long long)n, (long long)m);
    return n == m;
}

bool decode_matrices(uz_qp *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem)
{
    uz_error err = {.status = UZ_OK};
    reading r = {out, doc, object, decode_memory_bound(body_len), problem};
    return read_stiffness(&r) && read_load(&r) && read_normals(&r) && read_gaps(&r) &&
           (uz_qp_check(out, &err) == UZ_OK || refuse_call(&r, &err, ""));
}
