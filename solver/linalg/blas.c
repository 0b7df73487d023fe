/* blas.c: the dense kernels. Orders stay far below 2^31, where BLAS counts by int: they are bounded by the memory of an
 * n x n array. */
#include "linalg/blas.h"

#include "core/alloc.h"

#include <cblas.h>
#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

double uz_dot(int64_t n, const double *x, const double *y)
{
    return cblas_ddot((int)n, x, 1, y, 1);
}

double uz_norm(int64_t n, const double *x)
{
    return cblas_dnrm2((int)n, x, 1);
}

void uz_axpy(int64_t n, double alpha, const double *x, double *y)
{
    cblas_daxpy((int)n, alpha, x, 1, y, 1);
}

void uz_symv_lower(int64_t n, const double *A, const double *x, double *y)
{
    if (n > 0)
        cblas_dsymv(CblasColMajor, CblasLower, (int)n, 1.0, A, (int)n, x, 1, 0.0, y, 1);
}

void uz_trsv_lower(int64_t n, const double *L, int64_t ld, double *x, bool transposed)
{
    if (n > 0)
        cblas_dtrsv(CblasColMajor, CblasLower, transposed ? CblasTrans : CblasNoTrans, CblasNonUnit, (int)n, L, (int)ld,
                    x, 1);
}

void uz_trmv_lower_t(int64_t n, const double *L, double *x)
{
    if (n > 0)
        cblas_dtrmv(CblasColMajor, CblasLower, CblasTrans, CblasNonUnit, (int)n, L, (int)n, x, 1);
}

void uz_potrs_lower(int64_t n, const double *L, int64_t ld, double *x)
{
    uz_trsv_lower(n, L, ld, x, false);
    uz_trsv_lower(n, L, ld, x, true);
}

void uz_block_gemv(int64_t rows, int64_t columns, const double *A, int64_t ld, const double *x, double *y,
                   bool transposed)
{
    if (rows > 0)
        cblas_dgemv(CblasColMajor, transposed ? CblasTrans : CblasNoTrans, (int)rows, (int)columns, -1.0, A, (int)ld, x,
                    1, 1.0, y, 1);
}

void uz_block_eliminate(int64_t n, int64_t rows, int64_t columns, const double *L, int64_t ld, double *X, int64_t ldx)
{
    if (columns == 0)
        return;
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, (int)n, (int)columns, 1.0, L, (int)ld,
                X, (int)ldx);
    if (rows > 0)
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, (int)rows, (int)columns, (int)n, -1.0, L + n, (int)ld, X,
                    (int)ldx, 1.0, X + n, (int)ldx);
}

int64_t uz_block_factor(int64_t n, int64_t rows, double *A, int64_t ld)
{
    const int first = LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (int)n, A, (int)ld); /* from 1 */
    if (first != 0)
        return first > 0 ? first - 1 : 0;
    uz_block_divide(n, rows, A, A + n, ld);
    return n;
}

void uz_block_divide(int64_t n, int64_t rows, const double *L, double *B, int64_t ld)
{
    if (rows > 0)
        cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)rows, (int)n, 1.0, L, (int)ld,
                    B, (int)ld);
}

void uz_block_outer(const uz_outer *p)
{
    const double alpha = p->subtract ? -1.0 : 1.0, beta = p->subtract ? 1.0 : 0.0;
    const int64_t above = p->skip < p->n ? p->skip : p->n,
                  own = p->n - above; /* B's rows above A's first, and A's own */
    double *C = p->C + above * p->ldc;
    if (above > 0 && p->rows > 0)
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, (int)p->rows, (int)above, (int)p->k, alpha, p->A,
                    (int)p->ld, p->A - p->skip, (int)p->ld, beta, p->C, (int)p->ldc);
    if (own > 0)
        cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, (int)own, (int)p->k, alpha, p->A, (int)p->ld, beta, C,
                    (int)p->ldc);
    if (own > 0 && p->rows > own)
        cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, (int)(p->rows - own), (int)own, (int)p->k, alpha,
                    p->A + own, (int)p->ld, p->A, (int)p->ld, beta, C + own, (int)p->ldc);
}

void uz_block_syrk_t(int64_t n, int64_t k, const double *Z, int64_t ld, double *C)
{
    if (n > 0)
        cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, (int)n, (int)k, 1.0, Z, (int)ld, 0.0, C, (int)n);
}

/* Units of work between two questions take about PANEL_FLOPS, a few milliseconds: a panel of b columns against n b
 * entries. Wider ones would wait longer, narrower ones would read the whole matrix for little work. */
#define PANEL_FLOPS 5e7
enum { LEAST_PANEL = 16, MOST_PANEL = 128 };

static int64_t panel_width(int64_t n)
{
    double width = sqrt(PANEL_FLOPS / fmax(1.0, (double)n));
    return width < LEAST_PANEL ? LEAST_PANEL : width > MOST_PANEL ? MOST_PANEL : (int64_t)width;
}

static int64_t least_of(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Doubles cleared between two questions, a megabyte: pages of a new block are made when they are first written, which
 * took 1 to 3 ms for each 2 MB on a virtual machine. */
enum { CLEARED = 1 << 17 };

bool uz_clear_while(int64_t n, double *x, const uz_stop *stop)
{
    for (int64_t k = 0; k < n; k += CLEARED) {
        if (uz_stop_is_due(stop))
            return false;
        memset(x + k, 0, (size_t)least_of(n - k, CLEARED) * sizeof *x);
    }
    return true;
}

/* C (lower, n x n, ldc) = beta C + alpha A A' with A n x k, or alpha A'A with A k x n where transposed, by panels of
 * columns of C. */
static bool syrk_while(int64_t n, int64_t k, double alpha, const double *A, int64_t lda, bool transposed, double beta,
                       double *C, int64_t ldc, const uz_stop *stop)
{
    CBLAS_TRANSPOSE left = transposed ? CblasTrans : CblasNoTrans, right = transposed ? CblasNoTrans : CblasTrans;
    double most = PANEL_FLOPS / fmax(1.0, (double)n * (double)k);
    int64_t width = most < LEAST_PANEL ? LEAST_PANEL
                    : most < (double)n ? (int64_t)most
                                       : n,
            step = transposed ? lda : 1;
    for (int64_t j = 0; j < n; j += width) {
        int64_t b = least_of(n - j, width), below = n - j - b;
        const double *A_j = A + j * step;
        double *C_j = C + j + j * ldc;
        if (uz_stop_is_due(stop))
            return false;
        cblas_dsyrk(CblasColMajor, CblasLower, left, (int)b, (int)k, alpha, A_j, (int)lda, beta, C_j, (int)ldc);
        if (below > 0)
            cblas_dgemm(CblasColMajor, left, right, (int)below, (int)b, (int)k, alpha, A_j + b * step, (int)lda, A_j,
                        (int)lda, beta, C_j + b, (int)ldc);
    }
    return true;
}

/* X (n x columns, ldx) = L^-1 X with L n x n lower, ld, by panels of rows. */
static bool forward_while(int64_t n, int64_t columns, const double *L, int64_t ld, double *X, int64_t ldx,
                          const uz_stop *stop)
{
    int64_t width = panel_width(n);
    for (int64_t i = 0; i < n; i += width) {
        int64_t b = least_of(n - i, width);
        if (uz_stop_is_due(stop))
            return false;
        uz_block_eliminate(b, n - i - b, columns, L + i + i * ld, ld, X + i, ldx);
    }
    return true;
}

enum { PIVOTED_PANEL = 64 };

int64_t uz_pstrf_lower_while(int64_t n, double *A, int64_t *pivot, double least, const uz_stop *stop)
{
    int64_t width = least_of(panel_width(n), PIVOTED_PANEL);
    double *squares = uz_alloc(n, sizeof *squares), largest = 0.0;
    for (int64_t i = 0; i < n; i++) {
        pivot[i] = i;
        largest = fmax(largest, A[i + i * n]);
    }
    int64_t rank = squares ? 0 : -1, end = squares ? n : 0;
    for (int64_t k = 0; k < end && rank == k; k += width) {
        int64_t next = least_of(k + width, n);
        memset(squares, 0, (size_t)n * sizeof *squares);
        /* Column j of L: what is right of it has not seen the panel's columns yet, squares has those of each row added
         * up. */
        for (int64_t j = k; j < next && !uz_stop_is_due(stop); j++) {
            int64_t best = j;
            for (int64_t i = j; i < n; i++) {
                double last = j > k ? A[i + (j - 1) * n] : 0.0;
                squares[i] += last * last;
                if (A[i + i * n] - squares[i] > A[best + best * n] - squares[best])
                    best = i;
            }
            const double left = A[best + best * n] - squares[best];
            if (!(left > least * largest))
                break;
            if (best != j) { /* rows and columns change places in the lower triangle */
                const int64_t index = pivot[j];
                const double diagonal = A[j + j * n];
                A[j + j * n] = A[best + best * n];
                A[best + best * n] = diagonal;
                cblas_dswap((int)j, A + j, (int)n, A + best, (int)n);
                cblas_dswap((int)(best - j - 1), A + j + 1 + j * n, 1, A + best + (j + 1) * n, (int)n);
                cblas_dswap((int)(n - best - 1), A + best + 1 + j * n, 1, A + best + 1 + best * n, 1);
                squares[best] = squares[j];
                pivot[j] = pivot[best];
                pivot[best] = index;
            }
            A[j + j * n] = sqrt(left);
            cblas_dgemv(CblasColMajor, CblasNoTrans, (int)(n - j - 1), (int)(j - k), -1.0, A + j + 1 + k * n, (int)n,
                        A + j + k * n, (int)n, 1.0, A + j + 1 + j * n, 1);
            cblas_dscal((int)(n - j - 1), 1.0 / A[j + j * n], A + j + 1 + j * n, 1);
            rank++;
        }
        if (rank == next &&
            !syrk_while(n - next, next - k, -1.0, A + next + k * n, n, false, 1.0, A + next + next * n, n, stop))
            break;
    }
    free(squares);
    return rank;
}

bool uz_trsm_lower_while(int64_t n, int64_t k, const double *L, double *X, const uz_stop *stop)
{
    int64_t width = panel_width(n);
    for (int64_t j = 0; j < k && n > 0; j += width)
        if (!forward_while(n, least_of(k - j, width), L, n, X + j * n, n, stop))
            return false;
    return true;
}

bool uz_syrk_lower_t_while(int64_t n, int64_t k, const double *Z, double *C, const uz_stop *stop)
{
    int64_t width = panel_width(n);
    if (k == 0)
        return uz_clear_while(n * n, C, stop);
    for (int64_t j = 0; j < k && n > 0; j += width)
        if (!syrk_while(n, least_of(k - j, width), 1.0, Z + j, k, true, j > 0 ? 1.0 : 0.0, C, n, stop))
            return false;
    return true;
}

/* Right-looking (Golub and Van Loan, Matrix Computations, 4.2): factor a panel, take it away from what is right of it.
 */
bool uz_potrf_lower_while(int64_t n, double *A, const uz_stop *stop)
{
    int64_t width = panel_width(n);
    for (int64_t k = 0; k < n; k += width) {
        int64_t b = least_of(n - k, width), rest = n - k - b;
        double *top = A + k + k * n, *below = top + b, *right = below + b * n;
        if (uz_stop_is_due(stop) || LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', (int)b, top, (int)n) != 0)
            return false;
        if (rest == 0)
            break;
        cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, (int)rest, (int)b, 1.0, top,
                    (int)n, below, (int)n);
        if (!syrk_while(rest, b, -1.0, below, n, false, 1.0, right, n, stop))
            return false;
    }
    return true;
}

bool uz_multiply_llt_while(int64_t n, const double *L, double *A, double *panel, const uz_stop *stop)
{
    int64_t width = panel_width(n);
    if (!uz_clear_while(n * n, A, stop))
        return false;
    for (int64_t k = 0; k < n; k += width) {
        int64_t b = least_of(n - k, width), rows = n - k;
        for (int64_t j = 0; j < b; j++) {
            memset(panel + j * rows, 0, (size_t)j * sizeof *panel);
            memcpy(panel + j + j * rows, L + k + j + (k + j) * n, (size_t)(rows - j) * sizeof *panel);
        }
        if (!syrk_while(rows, b, 1.0, panel, rows, false, 1.0, A + k + k * n, n, stop))
            return false;
    }
    return true;
}

enum { TRIANGLE_PANEL = 24 }; /* what is narrower spares more of the other triangle's zeros */

/* X = L^-1 by panels of columns, then X'X by panels of rows of X. */
bool uz_invert_llt_while(int64_t n, const double *L, double *A, double *X, const uz_stop *stop)
{
    int64_t width = least_of(panel_width(n), TRIANGLE_PANEL);
    if (!uz_clear_while(n * n, A, stop) || !uz_clear_while(n * n, X, stop))
        return false;
    for (int64_t k = 0; k < n; k += width) {
        int64_t b = least_of(n - k, width);
        for (int64_t j = k; j < k + b; j++) {
            if (!(L[j + j * n] > 0.0))
                return false;
            X[j + j * n] = 1.0;
        }
        if (!forward_while(n - k, b, L + k + k * n, n, X + k + k * n, n, stop))
            return false;
    }
    for (int64_t k = 0; k < n; k += width) {
        int64_t b = least_of(n - k, width);
        if (!syrk_while(k + b, b, 1.0, X + k, n, true, 1.0, A, n, stop))
            return false;
    }
    return true;
}

bool uz_stev(int64_t n, double *d, double *e, double *V)
{
    return LAPACKE_dstev(LAPACK_COL_MAJOR, 'V', (int)n, d, e, V, (int)n) == 0;
}
