/* files.c: problems and answers in files. */
#include "peers/files.h"
#include "core/alloc.h"

#include <stdio.h>
#include <string.h>

static bool put(FILE *file, const void *from, int64_t count)
{
    return count == 0 || fwrite(from, 8, (size_t)count, file) == (size_t)count;
}

static bool get(FILE *file, void *to, int64_t count)
{
    return count == 0 || fread(to, 8, (size_t)count, file) == (size_t)count;
}

/* Takes over the file. */
static bool finish(FILE *file, bool ok, const char *path)
{
    ok = (!file || fclose(file) == 0) && ok;
    if (!ok)
        fprintf(stderr, "%s: not read or written in full\n", path);
    return ok;
}

static bool put_matrix(FILE *file, const uz_csc *A)
{
    int64_t nnz = A->ptr[A->cols];
    bool ok = put(file, A->ptr, A->cols + 1);
    for (int64_t k = 0; k < nnz && ok; k++) {
        const int64_t row = A->idx[k];
        ok = put(file, &row, 1);
    }
    return ok && put(file, A->val, nnz);
}

static bool get_matrix(FILE *file, uz_csc *A, int64_t rows, int64_t cols, int64_t nnz)
{
    bool ok = uz_csc_init(A, rows, cols, nnz, NULL) == UZ_OK && get(file, A->ptr, cols + 1);
    for (int64_t k = 0, row; k < nnz && ok; k++) {
        ok = get(file, &row, 1);
        A->idx[k] = ok ? (int32_t)row : 0;
    }
    return ok && get(file, A->val, nnz);
}

bool peers_write_problem(const char *path, const uz_qp *qp)
{
    int64_t d = qp->K.cols, m = qp->N.rows, head[] = {d, m, qp->K.ptr[d], qp->N.ptr[d]};
    FILE *file = fopen(path, "wb");
    bool ok = file && put(file, head, 4) && put_matrix(file, &qp->K) && put_matrix(file, &qp->N) &&
              put(file, qp->h, m) && put(file, qp->p, d);
    return finish(file, ok, path);
}

bool peers_read_problem(uz_qp *qp, const char *path)
{
    int64_t head[4];
    FILE *file = fopen(path, "rb");
    memset(qp, 0, sizeof *qp);
    bool ok = file && get(file, head, 4) && (qp->h = uz_alloc(head[1], sizeof *qp->h)) != NULL &&
              (qp->p = uz_alloc(head[0], sizeof *qp->p)) != NULL;
    ok = ok && get_matrix(file, &qp->K, head[0], head[0], head[2]) &&
         get_matrix(file, &qp->N, head[1], head[0], head[3]) && get(file, qp->h, head[1]) && get(file, qp->p, head[0]);
    return finish(file, ok, path);
}

bool peers_write_answer(const char *path, const uz_qp *qp, const double *u, const double *r)
{
    int64_t d = qp->K.cols, m = qp->N.rows, head[] = {d, m, u != NULL, r != NULL};
    FILE *file = fopen(path, "wb");
    return finish(file, file && put(file, head, 4) && put(file, u, u ? d : 0) && put(file, r, r ? m : 0), path);
}

static bool get_vector(FILE *file, double **x, int64_t count)
{
    *x = uz_alloc(count, sizeof **x);
    return *x && get(file, *x, count);
}

bool peers_read_answer(double **u, double **r, const char *path, const uz_qp *qp)
{
    int64_t head[4] = {0};
    FILE *file = fopen(path, "rb");
    *u = *r = NULL;
    bool ok = file && get(file, head, 4) && head[0] == qp->K.cols && head[1] == qp->N.rows;
    ok = ok && (!head[2] || get_vector(file, u, head[0])) && (!head[3] || get_vector(file, r, head[1]));
    return finish(file, ok, path);
}

bool peers_write_condensed(const char *path, int64_t m, const double *D, const double *g0)
{
    FILE *file = fopen(path, "wb");
    return finish(file, file && put(file, &m, 1) && put(file, D, m * m) && put(file, g0, m), path);
}
