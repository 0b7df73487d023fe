/* stl.c: surfaces in STL files, of text or of bytes.
 *
 * Source: 3D Systems, "StereoLithography Interface Specification" (1988). A file of bytes may begin with "solid" as one
 * of text does, but its length follows from its number of triangles; that decides. Normals are not needed, as the
 * corners of a triangle go round counterclockwise seen from outside. */
#include "io/triangles.h"

#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers of STL are little-endian");
_Static_assert(sizeof(float) == 4 && sizeof(unsigned) == 4, "numbers of STL have 4 bytes");

enum { HEAD = 80, COUNTED = 84, TRIANGLE = 50 };

static unsigned count_of(const char *text)
{
    unsigned count;
    memcpy(&count, text + HEAD, sizeof count);
    return count;
}

static bool is_bytes(const char *text, size_t len)
{
    return len >= COUNTED && len == COUNTED + (size_t)TRIANGLE * count_of(text);
}

static bool begins_solid(const char *text, size_t len)
{
    triangles_text words = {.next = text, .end = text + len};
    const char *word;
    size_t length;
    return triangles_next_line(&words) && triangles_word(&word, &length, &words) && triangles_is(word, length, "solid");
}

/* How the normals that the file states agree with the order of corners. */
typedef struct {
    int64_t agree, against, first_line;
} normals;

static void count_normal(normals *seen, const double normal[3], const double corner[3][3], int64_t line)
{
    double a[3], b[3], n[3];
    for (int c = 0; c < 3; c++) {
        a[c] = corner[1][c] - corner[0][c];
        b[c] = corner[2][c] - corner[0][c];
    }
    uz_cross3(n, a, b);
    const double along = uz_dot3(n, normal);
    if (along < 0 && seen->against++ == 0)
        seen->first_line = line;
    seen->agree += along > 0;
}

/* A mirrored file has its normals mirrored, but the corners in the order that they had: which of both is right nobody
 * can tell from here. */
static uz_status check_normals(const normals *seen, uz_error *err)
{
    static const char *const SAID =
        "%lld of %lld normals are against the order of their triangles' corners, as in files that were mirrored: the "
        "side of the obstacle is not known; write the file anew, or without normals (0 0 0)";
    const long long against = (long long)seen->against, all = against + (long long)seen->agree;
    if (2 * seen->against <= seen->against + seen->agree)
        return UZ_OK;
    return seen->first_line > 0 ? uz_fail_line(err, UZ_ERR_FORMAT, seen->first_line, SAID, against, all)
                                : uz_fail(err, UZ_ERR_FORMAT, "", SAID, against, all);
}

static uz_status read_bytes(triangles_in *in, const char *text)
{
    normals seen = {0};
    uz_status status = UZ_OK;
    const unsigned count = count_of(text);
    for (unsigned i = 0; i < count && status == UZ_OK; i++) {
        float number[12];
        double corner[3][3];
        memcpy(number, text + COUNTED + (size_t)TRIANGLE * i, sizeof number);
        const double normal[3] = {number[0], number[1], number[2]};
        for (int k = 0; k < 9; k++) {
            if (!isfinite(number[3 + k]))
                return uz_fail(in->err, UZ_ERR_NOT_FINITE, "",
                               "triangle %u of the file, counted from 1, has a coordinate that is not a finite number",
                               i + 1);
            corner[k / 3][k % 3] = (double)number[3 + k];
        }
        count_normal(&seen, normal, corner, 0);
        status = triangles_add(in, corner, 0);
    }
    return status == UZ_OK ? check_normals(&seen, in->err) : status;
}

/* The line that must come next begins with this word. */
static uz_status expect(triangles_text *text, const char *what, uz_error *err)
{
    const char *word;
    size_t len;
    if (!triangles_next_line(text))
        return uz_fail_line(err, UZ_ERR_FORMAT, text->number, "\"%s\" was expected, but the file ends", what);
    if (!triangles_word(&word, &len, text) || !triangles_is(word, len, what))
        return uz_fail_line(err, UZ_ERR_FORMAT, text->number, "\"%s\" was expected", what);
    return UZ_OK;
}

/* From behind the word "facet". */
static uz_status read_facet(triangles_in *in, normals *seen, triangles_text *text)
{
    double normal[3] = {0}, corner[3][3];
    const char *word;
    size_t len;
    const int64_t line = text->number;
    uz_status status = UZ_OK;
    if (triangles_word(&word, &len, text)) { /* some writers leave it out, others write what is no number */
        if (!triangles_is(word, len, "normal"))
            return uz_fail_line(in->err, UZ_ERR_FORMAT, line, "\"facet normal\" and three numbers were expected");
        if (triangles_reals(normal, text, "a normal", NULL) != UZ_OK)
            memset(normal, 0, sizeof normal);
    }
    status = expect(text, "outer", in->err); /* "outer loop" */
    for (int k = 0; k < 3 && status == UZ_OK; k++) {
        status = expect(text, "vertex", in->err);
        if (status == UZ_OK)
            status = triangles_reals(corner[k], text, "a vertex", in->err);
    }
    if (status == UZ_OK)
        status = expect(text, "endloop", in->err);
    if (status == UZ_OK)
        status = expect(text, "endfacet", in->err);
    if (status != UZ_OK)
        return status;
    count_normal(seen, normal, corner, line);
    return triangles_add(in, corner, line);
}

static uz_status read_text(triangles_in *in, const char *text, size_t len)
{
    triangles_text words = {.next = text, .end = text + len};
    normals seen = {0};
    uz_status status = UZ_OK;
    bool open = false;
    while (status == UZ_OK && triangles_next_line(&words)) {
        const char *word;
        size_t length;
        triangles_word(&word, &length, &words);
        if (!open && triangles_is(word, length, "solid"))
            open = true;
        else if (open && (triangles_is(word, length, "endsolid") ||
                          (triangles_is(word, length, "end") && triangles_word(&word, &length, &words))))
            open = false;
        else if (open && triangles_is(word, length, "facet"))
            status = read_facet(in, &seen, &words);
        else
            return uz_fail_line(in->err, UZ_ERR_FORMAT, words.number, "\"%s\" was expected",
                                open ? "facet\" or \"endsolid" : "solid");
    }
    if (status == UZ_OK && open)
        status = uz_fail_line(in->err, UZ_ERR_FORMAT, words.number, "\"endsolid\" was expected, but the file ends");
    return status == UZ_OK ? check_normals(&seen, in->err) : status;
}

uz_status triangles_stl_read(triangles_in *in, const char *text, size_t len)
{
    if (is_bytes(text, len))
        return read_bytes(in, text);
    if (begins_solid(text, len))
        return read_text(in, text, len);
    if (len < COUNTED)
        return uz_fail_line(in->err, UZ_ERR_FORMAT, 1, "\"solid\" was expected");
    return uz_fail(in->err, UZ_ERR_FORMAT, "",
                   "a file of %u triangles has %.0f bytes, this one has %zu: it is cut off, or no STL file",
                   count_of(text), COUNTED + (double)TRIANGLE * count_of(text), len);
}
