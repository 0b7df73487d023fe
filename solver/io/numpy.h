/* numpy.h: NumPy's files while numbers are read from them. Private to uz_matrix_read and uz_vector_read.
 *
 * Sources: "NPY format" of NumPy's documentation (numpy.lib.format), versions 1.0 to 3.0; PKWARE's APPNOTE.TXT 6.3
 * (sections 4.3 and 4.4) for the archive, of which NumPy and SciPy write the stored and the deflated kind. */
#ifndef UZ_IO_NUMPY_H
#define UZ_IO_NUMPY_H

#include "uzawa.h"

enum { NUMPY_RANK = 2 };

/* An array where it stands in a file. Beyond its rank, the shape is 1. */
typedef struct {
    const char *name; /* for messages */
    char kind;        /* of NumPy's: 'f' real, 'i' and 'u' whole, 'S' bytes, 'U' characters of 4 bytes */
    int size;         /* bytes of a number */
    bool reversed;    /* in the other order than this machine's */
    bool by_columns;  /* the first index varies fastest */
    int rank;
    int64_t shape[NUMPY_RANK];
    int64_t count;
    const unsigned char *data; /* count * size bytes */
} npy_array;

bool npy_recognises(const char *data, size_t len);
/* All that is no number, no text, or has more than two dimensions is refused, whatever is done with it. */
uz_status npy_open(npy_array *out, const char *name, const void *data, size_t len, uz_error *err);
/* Number i as it stands in the file. Real numbers of all kinds but text; NOT_FINITE says which one. */
uz_status npy_real(double *out, const npy_array *array, int64_t i, uz_error *err);
/* Of an array of whole numbers ('i', 'u'), which npy_open does not see to. */
uz_status npy_whole(int64_t *out, const npy_array *array, int64_t i, uz_error *err);
/* Where the number of a row and a column stands. */
static inline int64_t npy_place(const npy_array *array, int64_t row, int64_t column)
{
    return array->by_columns ? column * array->shape[0] + row : row * array->shape[1] + column;
}

/* ---- archives of arrays (npz.c) */

enum { NPZ_MEMBERS = 32, NPZ_NAME = 40 };

typedef struct {
    char name[NPZ_NAME]; /* cut off where it is longer */
    size_t at;           /* where its header stands in the file */
    size_t packed, size;
    uint32_t checksum;
    unsigned char *unpacked; /* once it was taken, of a packed one; npz_close frees it */
    bool is_packed;
} npz_member;

typedef struct {
    const unsigned char *data;
    size_t end;  /* of what members may fill: where the directory begins */
    size_t left; /* bytes that members may still take once unpacked */
    int count;
    npz_member member[NPZ_MEMBERS];
} npz_file;

bool npz_recognises(const char *data, size_t len);
/* Reads the directory. npz_close in every case. */
uz_status npz_open(npz_file *out, const char *data, size_t len, size_t max_bytes, uz_error *err);
void npz_close(npz_file *file);
/* NULL: there is none of this name. */
npz_member *npz_find(npz_file *file, const char *name);
/* The array of a member, which lives as long as the file is open. */
uz_status npz_take(npy_array *out, npz_file *file, npz_member *member, uz_error *err);

#endif
