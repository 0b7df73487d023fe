/* npy.c: one array of NumPy's: its header, which is a dictionary as Python writes one, and its numbers. */
#include "core/error.h"
#include "io/numpy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const unsigned char MAGIC[6] = {0x93, 'N', 'U', 'M', 'P', 'Y'};

bool npy_recognises(const char *data, size_t len)
{
    return len >= sizeof MAGIC && memcmp(data, MAGIC, sizeof MAGIC) == 0;
}

/* ---- the header */

typedef struct {
    const char *at, *end;
} header;

static void skip_blanks(header *h)
{
    while (h->at < h->end && (*h->at == ' ' || *h->at == '\n' || *h->at == '\t' || *h->at == '\r'))
        h->at++;
}

static bool take(header *h, char c)
{
    skip_blanks(h);
    const bool there = h->at < h->end && *h->at == c;
    h->at += there;
    return there;
}

/* A text in quotes without escapes, which no header has. */
static bool take_text(header *h, char *out, size_t room)
{
    const char quote = take(h, '\'') ? '\'' : '"';
    if (quote == '"' && !take(h, '"'))
        return false;
    const char *end = h->at < h->end ? memchr(h->at, quote, (size_t)(h->end - h->at)) : NULL;
    if (!end || (size_t)(end - h->at) >= room)
        return false;
    const size_t len = (size_t)(end - h->at);
    memcpy(out, h->at, len);
    out[len] = '\0';
    h->at = end + 1;
    return strlen(out) == len;
}

static bool take_truth(header *h, bool *out)
{
    static const char *const WORDS[] = {"False", "True"};
    skip_blanks(h);
    for (int i = 0; i < 2; i++) {
        const size_t len = strlen(WORDS[i]);
        if ((size_t)(h->end - h->at) >= len && memcmp(h->at, WORDS[i], len) == 0) {
            h->at += len;
            *out = i == 1;
            return true;
        }
    }
    return false;
}

/* "(3, 4)", "(3,)" or "()"; of a rank above NUMPY_RANK the sizes behind it are not kept. */
static bool take_shape(header *h, npy_array *a)
{
    a->rank = 0;
    if (!take(h, '('))
        return false;
    while (!take(h, ')')) {
        int64_t size = 0;
        skip_blanks(h);
        const char *first = h->at;
        for (; h->at < h->end && *h->at >= '0' && *h->at <= '9'; h->at++)
            if (__builtin_mul_overflow(size, 10, &size) || __builtin_add_overflow(size, *h->at - '0', &size))
                return false;
        if (h->at == first || a->rank == 64)
            return false;
        if (a->rank < NUMPY_RANK)
            a->shape[a->rank] = size;
        a->rank++;
        take(h, 'L'); /* a long integer of Python 2 */
        skip_blanks(h);
        if (!take(h, ',') && (h->at == h->end || *h->at != ')'))
            return false;
    }
    return true;
}

/* The three entries, each once. type "": it is no simple one. */
static bool read_entries(npy_array *a, char type[16], header *h)
{
    enum { DESCR = 1, ORDER = 2, SHAPE = 4 };
    int seen = 0;
    bool good = take(h, '{');
    while (good && !take(h, '}')) {
        char key[16];
        good = take_text(h, key, sizeof key) && take(h, ':');
        const int which = !good                               ? 0
                          : strcmp(key, "descr") == 0         ? DESCR
                          : strcmp(key, "fortran_order") == 0 ? ORDER
                          : strcmp(key, "shape") == 0         ? SHAPE
                                                              : 0;
        skip_blanks(h);
        if (which == DESCR && h->at < h->end && *h->at == '[') { /* a record: the rest of the header tells nothing */
            type[0] = '\0';
            return true;
        }
        good = which && !(seen & which) &&
               (which == DESCR   ? take_text(h, type, 16)
                : which == ORDER ? take_truth(h, &a->by_columns)
                                 : take_shape(h, a));
        seen |= which;
        skip_blanks(h);
        good = good && (take(h, ',') || (h->at < h->end && *h->at == '}'));
    }
    skip_blanks(h);
    return good && seen == (DESCR | ORDER | SHAPE) && h->at == h->end;
}

/* "<f8": the order of bytes, the kind, and the size of an item. False: it is none that is read. */
static bool read_type(npy_array *a, const char *type)
{
    const bool little = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
    if (!type[0] || !strchr("<>|=", type[0]) || !type[1] || !strchr("fiuSU", type[1]) || strlen(type) > 8)
        return false;
    char *end;
    const long size = strtol(type + 2, &end, 10);
    a->kind = type[1];
    a->reversed = type[0] == '>' ? little : type[0] == '<' && !little;
    const long width = a->kind == 'U' ? 4 * size : size;
    a->size = (int)width;
    if (*end || end == type + 2 || type[2] == '-' || type[2] == '+')
        return false;
    if (a->kind == 'S' || a->kind == 'U')
        return width > 0 && width <= 64;
    return size == 8 || size == 4 || (a->kind != 'f' && (size == 1 || size == 2));
}

uz_status npy_open(npy_array *out, const char *name, const void *data, size_t len, uz_error *err)
{
    const unsigned char *bytes = data;
    char type[16] = "";
    *out = (npy_array){.name = name, .shape = {1, 1}};
    const int version = npy_recognises(data, len) && len > 8 ? bytes[6] : 0;
    if (version < 1 || version > 3)
        return uz_fail(err, version > 3 ? UZ_ERR_UNSUPPORTED : UZ_ERR_FORMAT, "/numpy",
                       version > 3 ? "%s is of a version of NumPy's format that is not read: 1, 2 and 3 are"
                                   : "%s is no array of NumPy's: save it by numpy.save",
                       name);
    /* the length of the header: 2 bytes, later 4, the lowest first */
    const size_t begin = version == 1 ? 10 : 12;
    size_t head = 0;
    for (size_t i = begin; i > 8 && len >= begin; i--)
        head = 256 * head + bytes[i - 1];
    if (len < begin || head > len - begin)
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy", "%s ends within its header: send the whole file", name);
    header h = {(const char *)bytes + begin, (const char *)bytes + begin + head};
    if (!read_entries(out, type, &h))
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                       "the header of %s is none of NumPy's, which has descr, fortran_order and shape", name);
    if (!read_type(out, type))
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy",
                       "the items of %s are of the type \"%s\", which is not read: save it as 64-bit numbers, by "
                       "array.astype(float)",
                       name, type[0] ? type : "record");
    if (out->rank > NUMPY_RANK)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "/numpy", "%s has %d dimensions: matrices have two, vectors one", name,
                       out->rank);
    int64_t wanted;
    const int64_t there = (int64_t)(len - begin - head);
    if (__builtin_mul_overflow(out->shape[0], out->shape[1], &out->count) ||
        __builtin_mul_overflow(out->count, out->size, &wanted) || wanted != there)
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy",
                       "%s has %lld bytes behind its header, and %lld x %lld items of %d bytes have others: send the "
                       "whole file",
                       name, (long long)there, (long long)out->shape[0], (long long)out->shape[1], out->size);
    out->data = bytes + begin + head;
    return UZ_OK;
}

/* ---- numbers */

/* The bytes of number i in this machine's order. */
static void take_bytes(unsigned char out[8], const npy_array *a, int64_t i)
{
    const unsigned char *from = a->data + i * a->size;
    for (int k = 0; k < a->size; k++)
        out[a->reversed ? a->size - 1 - k : k] = from[k];
}

/* A whole number: *low is its value modulo 2^64, negative where it is below zero. */
static uint64_t take_whole(bool *negative, const npy_array *a, int64_t i)
{
    unsigned char bytes[8];
    take_bytes(bytes, a, i);
    int64_t value = 0;
    uint64_t high = 0;
    switch (a->size) {
    case 1:
        value = a->kind == 'i' ? (signed char)bytes[0] : bytes[0];
        break;
    case 2: {
        uint16_t x;
        memcpy(&x, bytes, sizeof x);
        value = a->kind == 'i' ? (int16_t)x : x;
        break;
    }
    case 4: {
        uint32_t x;
        memcpy(&x, bytes, sizeof x);
        value = a->kind == 'i' ? (int32_t)x : (int64_t)x;
        break;
    }
    default:
        memcpy(&high, bytes, sizeof high);
        *negative = a->kind == 'i' && high >> 63;
        return high;
    }
    *negative = value < 0;
    return (uint64_t)value;
}

uz_status npy_real(double *out, const npy_array *array, int64_t i, uz_error *err)
{
    if (array->kind == 'f') {
        unsigned char bytes[8];
        float single = 0;
        take_bytes(bytes, array, i);
        memcpy(&single, bytes, sizeof single);
        memcpy(out, bytes, sizeof *out);
        *out = array->size == 4 ? (double)single : *out;
        return isfinite(*out) ? UZ_OK
                              : uz_fail(err, UZ_ERR_NOT_FINITE, "/numpy",
                                        "number %lld of %s, from 0 in the order of the file, is not finite",
                                        (long long)i, array->name);
    }
    if (array->kind == 'S' || array->kind == 'U')
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy", "%s has texts where numbers are needed", array->name);
    bool negative;
    const uint64_t value = take_whole(&negative, array, i);
    *out = negative ? -(double)(0 - value) : (double)value;
    return UZ_OK;
}

uz_status npy_whole(int64_t *out, const npy_array *array, int64_t i, uz_error *err)
{
    bool negative = false;
    const uint64_t value = array->kind == 'i' || array->kind == 'u' ? take_whole(&negative, array, i) : UINT64_MAX;
    if (!negative && value > INT64_MAX)
        return uz_fail(err, UZ_ERR_FORMAT, "/numpy", "%s has to be of whole numbers of at most 63 bits", array->name);
    *out = negative ? -(int64_t)(~value) - 1 : (int64_t)value;
    return UZ_OK;
}
