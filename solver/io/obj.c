/* obj.c: surfaces in Wavefront's OBJ files.
 *
 * Source: Wavefront Technologies, "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual. Vertices and
 * faces are read. Names, groups, materials, texture and normals are passed over: which way a face looks follows from
 * the order of its corners, counterclockwise from outside. */
#include "io/triangles.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    triangles_in *in;
    triangles_text text;
    int64_t n, room;
    double *xyz; /* n x 3 */
} obj_file;

static uz_status read_vertex(obj_file *file)
{
    if (!uz_grow(&file->xyz, 3 * file->n, 3, &file->room, sizeof *file->xyz))
        return uz_no_memory(file->in->err, "the vertices of a surface");
    if (file->in->max_bytes > 0 && sizeof *file->xyz * 3 * (size_t)(file->n + 1) > file->in->max_bytes)
        return uz_fail_line(file->in->err, UZ_ERR_LIMIT, file->text.number,
                            "the surface takes more memory than allowed");
    const uz_status status = triangles_reals(file->xyz + 3 * file->n, &file->text, "a vertex", file->in->err);
    file->n += status == UZ_OK;
    return status;
}

/* "7", "7/1/3" or "-2": a vertex from 1, or back from the last. */
static uz_status read_corner(double corner[3], const obj_file *file, const char *word, size_t len)
{
    const bool back = len > 0 && *word == '-';
    int64_t number = 0;
    size_t i = back;
    for (; i < len && word[i] >= '0' && word[i] <= '9' && number <= file->n; i++)
        number = 10 * number + (word[i] - '0');
    if (i == (size_t)back || (i < len && word[i] != '/'))
        return uz_fail_line(file->in->err, UZ_ERR_FORMAT, file->text.number,
                            number > file->n ? "a face names a vertex beyond the %lld that are there"
                                             : "a face has a corner that is no number of a vertex; of %lld vertices",
                            (long long)file->n);
    if (number < 1 || number > file->n)
        return uz_fail_line(file->in->err, UZ_ERR_FORMAT, file->text.number,
                            "a face names vertex %s%lld; those before it are 1 to %lld", back ? "-" : "",
                            (long long)number, (long long)file->n);
    const int64_t vertex = back ? file->n - number : number - 1;
    memcpy(corner, file->xyz + 3 * vertex, 3 * sizeof *corner);
    return UZ_OK;
}

static uz_status read_face(obj_file *file)
{
    const char *word;
    size_t len;
    double corner[3][3];
    int corners = 0;
    uz_status status = UZ_OK;
    while (status == UZ_OK && triangles_word(&word, &len, &file->text)) {
        if (corners >= 3)
            memcpy(corner[1], corner[2], sizeof corner[1]);
        status = read_corner(corner[corners < 2 ? corners : 2], file, word, len);
        if (++corners >= 3 && status == UZ_OK)
            status = triangles_add(file->in, (const double(*)[3])corner, file->text.number);
    }
    if (status == UZ_OK && corners < 3)
        return uz_fail_line(file->in->err, UZ_ERR_FORMAT, file->text.number,
                            "a face has three corners at least, not %d", corners);
    return status;
}

/* Free-form geometry, which would be missing. */
static bool is_refused(const char *word, size_t len)
{
    static const char *const WORDS[] = {"vp", "curv", "curv2", "surf", "cstype", "parm"};
    bool found = false;
    for (size_t i = 0; i < sizeof WORDS / sizeof WORDS[0]; i++)
        found = found || triangles_is(word, len, WORDS[i]);
    return found;
}

uz_status triangles_obj_read(triangles_in *in, const char *text, size_t len)
{
    obj_file file = {.in = in, .text = {.next = text, .end = text + len}};
    uz_status status = UZ_OK;
    while (status == UZ_OK && triangles_next_line(&file.text)) {
        const char *word;
        size_t length;
        triangles_word(&word, &length, &file.text);
        const char last = file.text.line_end[-1] == '\r' && file.text.line_end - word > 1 ? file.text.line_end[-2]
                                                                                          : file.text.line_end[-1];
        if (*word == '#')
            continue;
        if (last == '\\')
            status = uz_fail_line(in->err, UZ_ERR_UNSUPPORTED, file.text.number,
                                  "a line that goes on in the next one is not read: write it in one");
        else if (memchr(word, '\0', length))
            status = uz_fail_line(in->err, UZ_ERR_FORMAT, file.text.number, "the file is no text");
        else if (triangles_is(word, length, "v"))
            status = read_vertex(&file);
        else if (triangles_is(word, length, "f"))
            status = read_face(&file);
        else if (is_refused(word, length))
            status = uz_fail_line(in->err, UZ_ERR_UNSUPPORTED, file.text.number,
                                  "curves and free-form surfaces are not read: export the surface as a mesh");
    }
    free(file.xyz);
    return status;
}
