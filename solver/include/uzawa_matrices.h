/* uzawa_matrices.h: sparse matrices, their text and a problem made of them. Part of uzawa.h. */
#ifndef UZAWA_MATRICES_H
#define UZAWA_MATRICES_H

#include "uzawa_base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------- sparse matrices */

/* Compressed sparse columns. Rows ascend within a column and no entry occurs twice.
 * A symmetric matrix is stored as its lower triangle, diagonal included; the text says where. */
typedef struct {
    int64_t rows, cols;
    int64_t *ptr; /* cols + 1 */
    int32_t *idx; /* ptr[cols], row of each entry */
    double *val;  /* ptr[cols] */
} uz_csc;

/* Allocates ptr, idx, val for `nnz` entries, all zero. A previous content of *A is not freed. Errors: UZ_ERR_ARGUMENT,
 * _LIMIT (more than 2^31 - 1 rows), _MEMORY. */
uz_status uz_csc_init(uz_csc *A, int64_t rows, int64_t cols, int64_t nnz, uz_error *err);
void uz_csc_clear(uz_csc *A); /* frees the arrays and zeroes *A */
uz_status uz_csc_copy(uz_csc *out, const uz_csc *A, uz_error *err);
uz_status uz_csc_transpose(uz_csc *out, const uz_csc *A, uz_error *err);

/* Builds a CSC matrix from `count` triplets (0-based), adding entries that occur twice in the order given. */
uz_status uz_csc_from_triplets(uz_csc *out, int64_t rows, int64_t cols, int64_t count, const int64_t *row,
                               const int64_t *col, const double *val, uz_error *err);

/* y += alpha A x and y += alpha A' x. x and y do not overlap. */
void uz_csc_gaxpy(double *y, const uz_csc *A, double alpha, const double *x);
void uz_csc_gaxpy_t(double *y, const uz_csc *A, double alpha, const double *x);
/* y += alpha A x for symmetric A given by its lower triangle. */
void uz_csc_symv(double *y, const uz_csc *A, double alpha, const double *x);

/* --------------------------------------------------------- Matrix Market */

typedef enum { UZ_MM_COORDINATE, UZ_MM_ARRAY } uz_mm_format;
typedef enum { UZ_MM_GENERAL, UZ_MM_SYMMETRIC } uz_mm_symmetry;

/* What the banner and the size line said. */
typedef struct {
    uz_mm_format format;
    uz_mm_symmetry symmetry;
    bool integer; /* field was "integer" */
    int64_t rows, cols, entries;
} uz_mm_info;

/* Reads a whole Matrix Market text of `len` bytes (NUL not needed) as a matrix. A symmetric file gives the
 * lower triangle (see info->symmetry); duplicates in a coordinate file are refused; exact zeros are kept.
 * max_bytes (0: none) bounds what the result may take. Errors: UZ_ERR_FORMAT, _UNSUPPORTED, _NOT_FINITE,
 * _LIMIT, _MEMORY, with the line. Source: Boisvert, Pozo, Remington, NISTIR 5935 (1996). */
uz_status uz_mm_read(uz_csc *out, uz_mm_info *info, const char *text, size_t len, size_t max_bytes, uz_error *err);

/* Reads a text that is a vector (n x 1 or 1 x n, array or coordinate); *out has *n numbers, the caller frees it. */
uz_status uz_mm_read_vector(double **out, int64_t *n, const char *text, size_t len, size_t max_bytes, uz_error *err);

/* ----------------------------------------------------------------- NumPy */

/* A matrix or a vector in any format that is read, told by how the bytes begin: an array as numpy.save writes it, or
 * the only one of an archive (numpy.savez); a matrix also as scipy.sparse.save_npz writes it (csr, csc or coo, entries
 * of one place added up); else Matrix Market text, as above. Real and whole numbers of 32 and 64 bits, and whole ones
 * of 8 and 16, in either order of bytes. Zeros of a dense array are left out. *symmetry (of text: what it says, else
 * general) and *n are set; columns: NULL, or an array of two dimensions is taken too, its rows one after the other, and
 * *columns is their length (0: a vector). Errors: those of uz_mm_read; of NumPy's files without a line, and where is
 * "/numpy". */
uz_status uz_matrix_read(uz_csc *out, uz_mm_symmetry *symmetry, const char *data, size_t len, size_t max_bytes,
                         uz_error *err);
uz_status uz_vector_read(double **out, int64_t *n, int *columns, const char *data, size_t len, size_t max_bytes,
                         uz_error *err);

/* A member of an archive: an array of rows (columns 0) or of rows x columns numbers, in the file as doubles, or as
 * 64-bit integers where they are whole; or a text. One without numbers and text is left out. */
typedef struct {
    const char *name; /* of an array without ".npy" */
    const double *x;
    int64_t rows;
    int columns;
    bool whole;
    const char *text;
} uz_npz_array;
enum { UZ_NPZ_ARRAYS = 32 };
/* An archive as numpy.savez writes it: numpy.load reads it. *file: malloc'ed, the caller frees it. Errors: _MEMORY,
 * _LIMIT (more than 4 GB). */
uz_status uz_npz_write(char **file, size_t *len, const uz_npz_array *list, size_t n, uz_error *err);

/* ------------------------------------------------------------- numbers as text */

/* Reads the decimal number at the start of text[0..len): digits, one '.', an exponent, a sign; no NaN, Inf or hex.
 * Returns the bytes used, 0 if there is no number; *value is correctly rounded, +-Inf on overflow. */
size_t uz_parse_double(double *value, const char *text, size_t len);

/* Writes the shortest decimal that reads back as the finite x (of several the nearest one), in %g's style whatever the
 * locale. Returns its length, at most 24; out has room for UZ_DOUBLE_ROOM and gets no NUL. */
enum { UZ_DOUBLE_ROOM = 32 };
size_t uz_format_double(char *out, double x);
/* The same for integers: at most 20 digits. */
size_t uz_format_integer(char *out, uint64_t value);

/* -------------------------------------------------------------- problems */

/* A problem in matrices. K: lower triangle. N: general. p: d. h: m. */
typedef struct {
    uz_csc K, N;
    double *p, *h;
} uz_qp;
void uz_qp_clear(uz_qp *qp);
/* Full validation: shapes, finiteness. */
uz_status uz_qp_check(const uz_qp *qp, uz_error *err);
/* Replaces a general square K by its lower triangle; UZ_ERR_NOT_SYMMETRIC names the worst pair. The tolerance is
 * relative to the larger diagonal of the pair: 1e-12; within it the two halves are averaged. */
uz_status uz_symmetric_lower(uz_csc *K, uz_error *err);

#ifdef __cplusplus
}
#endif

#endif
