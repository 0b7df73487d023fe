/* blas.h: the dense kernels in use, with sizes checked once and column-major lower storage throughout. The only file
 * that knows cblas and LAPACKE is blas.c. */
#ifndef UZ_LINALG_BLAS_H
#define UZ_LINALG_BLAS_H

#include "core/hooks.h"

#include <stdbool.h>
#include <stdint.h>

double uz_dot(int64_t n, const double *x, const double *y);
double uz_norm(int64_t n, const double *x); /* 2-norm, without overflow */
void uz_axpy(int64_t n, double alpha, const double *x, double *y);

void uz_symv_lower(int64_t n, const double *A, const double *x, double *y); /* y = A x */
/* L: the leading n x n block of an array with `ld` rows. x = L^-1 x, or L'^-1 x where transposed; x = (LL')^-1 x. */
void uz_trsv_lower(int64_t n, const double *L, int64_t ld, double *x, bool transposed);
void uz_potrs_lower(int64_t n, const double *L, int64_t ld, double *x);
void uz_trmv_lower_t(int64_t n, const double *L, double *x); /* x = L'x */
/* x (n) = 0 by pieces of a megabyte, with cancellation points between them; false: it had to stop. For rooms that
 * nobody has written to before: the kernel makes their pages at the first touch. */
bool uz_clear_while(int64_t n, double *x, const uz_stop *stop);
/* A = LL' by panels of some 5e7 flops (a few milliseconds), with cancellation points between them; false: a pivot is
 * not positive, or it had to stop. */
bool uz_potrf_lower_while(int64_t n, double *A, const uz_stop *stop);
/* Cholesky with complete pivoting of a semidefinite A, P'AP = LL', by panels; pivot[k] is the original index of row k.
 * Returns the rank: pivots below `least` times the largest count as zero (Higham 1990; Lucas, LAPACK Working Note 161
 * (2004)). Where it had to stop, as far as it came: that many rows of L are as good. -1: no memory. */
int64_t uz_pstrf_lower_while(int64_t n, double *A, int64_t *pivot, double least, const uz_stop *stop);
/* X (n x k) = L^-1 X, and C (lower, n x n) = Z'Z for Z k x n, by panels; false: it had to stop. */
bool uz_trsm_lower_while(int64_t n, int64_t k, const double *L, double *X, const uz_stop *stop);
bool uz_syrk_lower_t_while(int64_t n, int64_t k, const double *Z, double *C, const uz_stop *stop);
/* A (lower) = (LL')^-1 by panels; L's strict upper part is not read; X (n x n): room. 2/3 n^3 flops. false: a zero
 * pivot, or it had to stop. */
bool uz_invert_llt_while(int64_t n, const double *L, double *A, double *X, const uz_stop *stop);
/* A (lower) = L L' by panels, likewise. n^3/3 flops. panel: room for n x n. false: it had to stop. */
bool uz_multiply_llt_while(int64_t n, const double *L, double *A, double *panel, const uz_stop *stop);
/* Pieces of larger arrays, whose columns are `ld` entries apart: L is n x n lower, A is rows x columns. */
/* y -= A x, or y -= A'x where transposed. */
void uz_block_gemv(int64_t rows, int64_t columns, const double *A, int64_t ld, const double *x, double *y,
                   bool transposed);
/* [X; Y] (columns, ldx) = [L^-1 X; Y - A L^-1 X] with [L; A] (n + rows by n, ld). */
void uz_block_eliminate(int64_t n, int64_t rows, int64_t columns, const double *L, int64_t ld, double *X, int64_t ldx);
/* [L; B] = [chol(A); B L'^-1] in place of [A; B] (n + rows by n, ld), A symmetric, lower. Returns how many pivots are
 * positive: less than n where one is not, which ends it. */
int64_t uz_block_factor(int64_t n, int64_t rows, double *A, int64_t ld);
/* B (rows x n, ld) = B L'^-1. */
void uz_block_divide(int64_t n, int64_t rows, const double *L, double *B, int64_t ld);
/* C (rows x n, ldc) = A B', or C - A B': A rows x k (ld), B the n rows that begin `skip` >= 0 rows above A. Of column c
 * the entries from row c - skip on: those on and below the diagonal of an array with B's rows and A's. */
typedef struct {
    int64_t skip, rows, n, k;
    const double *A;
    int64_t ld;
    double *C;
    int64_t ldc;
    bool subtract;
} uz_outer;
void uz_block_outer(const uz_outer *p);
/* C (n x n) = Z'Z with Z k x n. */
void uz_block_syrk_t(int64_t n, int64_t k, const double *Z, int64_t ld, double *C);
/* Eigenvalues of the symmetric tridiagonal matrix (d, n; e, n - 1), ascending in d; with vectors in V (n x n). */
bool uz_stev(int64_t n, double *d, double *e, double *V);

#endif
