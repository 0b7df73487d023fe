#include "core/blas.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>

/* Dense orders stay far below 2^31: they are bounded by the memory of an n x n array. */
static int narrow(int64_t n)
{
    return (int)n;
}

double uz_dot(int64_t n, const double *x, const double *y)
{
    return cblas_ddot(narrow(n), x, 1, y, 1);
}

double uz_norm(int64_t n, const double *x)
{
    return cblas_dnrm2(narrow(n), x, 1);
}

void uz_axpy(int64_t n, double alpha, const double *x, double *y)
{
    cblas_daxpy(narrow(n), alpha, x, 1, y, 1);
}

void uz_symv_lower(int64_t n, const double *A, const double *x, double *y)
{
    if (n > 0)
        cblas_dsymv(CblasColMajor, CblasLower, narrow(n), 1.0, A, narrow(n), x, 1, 0.0, y, 1);
}

void uz_trsv_lower(int64_t n, const double *L, double *x)
{
    if (n > 0)
        cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, narrow(n), L, narrow(n), x, 1);
}

void uz_trsv_lower_t(int64_t n, const double *L, double *x)
{
    if (n > 0)
        cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, narrow(n), L, narrow(n), x, 1);
}

void uz_trmv_lower_t(int64_t n, const double *L, double *x)
{
    if (n > 0)
        cblas_dtrmv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, narrow(n), L, narrow(n), x, 1);
}

void uz_trsm_lower(int64_t n, int64_t k, const double *L, double *X)
{
    if (n > 0 && k > 0)
        cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, narrow(n), narrow(k), 1.0, L,
                    narrow(n), X, narrow(n));
}

void uz_syrk_lower_t(int64_t n, int64_t k, const double *Z, double *C)
{
    if (n > 0 && k > 0)
        cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, narrow(n), narrow(k), 1.0, Z, narrow(k), 0.0, C, narrow(n));
}

bool uz_potrf_lower(int64_t n, double *A)
{
    return n == 0 || LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', narrow(n), A, narrow(n)) == 0;
}

void uz_potrs_lower(int64_t n, const double *L, double *x)
{
    uz_trsv_lower(n, L, x);
    uz_trsv_lower_t(n, L, x);
}

int64_t uz_pstrf_lower(int64_t n, double *A, int64_t *pivot, double least)
{
    double *work = malloc((size_t)n * 2 * sizeof *work + 1), largest = 0.0;
    int *order = malloc((size_t)n * sizeof *order + 1), rank = 0;
    for (int64_t i = 0; i < n; i++)
        largest = fmax(largest, A[i + i * n]);
    if (work && order && n > 0)
        LAPACKE_dpstrf_work(LAPACK_COL_MAJOR, 'L', narrow(n), A, narrow(n), order, &rank, least * largest, work);
    for (int64_t k = 0; order && k < rank; k++)
        pivot[k] = order[k] - 1;
    free(work);
    free(order);
    return rank;
}

void uz_potrs_leading(int64_t n, int64_t stride, const double *L, double *x)
{
    if (n == 0)
        return;
    cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, narrow(n), L, narrow(stride), x, 1);
    cblas_dtrsv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, narrow(n), L, narrow(stride), x, 1);
}

void uz_block_trsv(int64_t n, const double *L, int64_t ld, double *x, bool transposed)
{
    cblas_dtrsv(CblasColMajor, CblasLower, transposed ? CblasTrans : CblasNoTrans, CblasNonUnit, narrow(n), L,
                narrow(ld), x, 1);
}

void uz_block_gemv(int64_t rows, int64_t columns, const double *A, int64_t ld, const double *x, double *y,
                   bool transposed)
{
    if (rows > 0)
        cblas_dgemv(CblasColMajor, transposed ? CblasTrans : CblasNoTrans, narrow(rows), narrow(columns), -1.0, A,
                    narrow(ld), x, 1, 1.0, y, 1);
}

void uz_block_eliminate(int64_t n, int64_t rows, int64_t columns, const double *L, int64_t ld, double *X, int64_t ldx)
{
    if (columns == 0)
        return;
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, narrow(n), narrow(columns), 1.0, L,
                narrow(ld), X, narrow(ldx));
    if (rows > 0)
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, narrow(rows), narrow(columns), narrow(n), -1.0, L + n,
                    narrow(ld), X, narrow(ldx), 1.0, X + n, narrow(ldx));
}

void uz_block_syrk_t(int64_t n, int64_t k, const double *Z, int64_t ld, double *C)
{
    if (n > 0)
        cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, narrow(n), narrow(k), 1.0, Z, narrow(ld), 0.0, C, narrow(n));
}

bool uz_potri_lower(int64_t n, double *L)
{
    return n == 0 || LAPACKE_dpotri_work(LAPACK_COL_MAJOR, 'L', narrow(n), L, narrow(n)) == 0;
}

/* LAPACK multiplies L'L and UU' only: with rows and columns in reverse order L becomes an upper triangle U. */
void uz_multiply_llt(int64_t n, const double *L, double *A)
{
    int64_t last = n * n - 1;
    for (int64_t j = 0; j < n; j++)
        for (int64_t i = j; i < n; i++)
            A[last - (i + j * n)] = L[i + j * n];
    if (n > 0)
        LAPACKE_dlauum_work(LAPACK_COL_MAJOR, 'U', narrow(n), A, narrow(n));
    for (int64_t low = 0, high = last; low < high; low++, high--) {
        double swap = A[low];
        A[low] = A[high];
        A[high] = swap;
    }
}

bool uz_stev(int64_t n, double *d, double *e, double *V)
{
    return LAPACKE_dstev(LAPACK_COL_MAJOR, 'V', narrow(n), d, e, V, narrow(n)) == 0;
}
