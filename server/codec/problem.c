/* problem.c: what a refusal says. */
#include "codec/problem.h"
#include "text/utf8.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *code, *title;
} TITLES[] = {
    {"json_syntax", "The body is not JSON"},
    {"json_depth", "The JSON is nested too deep"},
    {"duplicate_key", "A key stands twice in one object"},
    {"number_out_of_range", "A number is beyond double precision"},
    {"problem_too_large", "The problem is larger than allowed here"},
    {"too_many_values", "The JSON has too many single values"},
    {"unknown_key", "A key is not known"},
    {"missing_key", "A key is missing"},
    {"wrong_type", "A value has the wrong type"},
    {"out_of_range", "A value is out of range"},
    {"not_allowed", "A value is not one of those allowed"},
    {"matrix_market_syntax", "A Matrix Market text is malformed"},
    {"matrix_market_unsupported", "A kind of matrix that is not solved here"},
    {"gmsh_syntax", "A Gmsh file is malformed"},
    {"gmsh_unsupported", "A kind of Gmsh file or element that is not read here"},
    {"abaqus_syntax", "An input file of Abaqus or CalculiX is malformed"},
    {"abaqus_unsupported", "Something in an input file of Abaqus or CalculiX that is not read here"},
    {"nastran_syntax", "A NASTRAN file is malformed"},
    {"nastran_unsupported", "Something in a NASTRAN file that is not read here"},
    {"vtk_syntax", "A VTK file is malformed"},
    {"vtk_unsupported", "A kind of VTK file or cell that is not read here"},
    {"stl_syntax", "An STL file is malformed"},
    {"stl_unsupported", "A kind of STL file that is not read here"},
    {"obj_syntax", "An OBJ file is malformed"},
    {"obj_unsupported", "Something in an OBJ file that is not read here"},
    {"size_mismatch", "Shapes do not agree"},
    {"not_finite", "A value is not finite"},
    {"not_symmetric", "The stiffness matrix is not symmetric"},
    {"not_positive_definite", "The stiffness matrix is not positive definite"},
    {"free_body", "The body is free to move"},
    {"bad_scene", "The scene cannot be modelled"},
    {"memory_limit", "The problem needs more memory than allowed"},
    {"out_of_memory", "Not enough memory now"},
    {"unknown_upload", "An upload is not there"},
    {"store_unavailable", "The store does not answer"},
    {"queue_time_limit", "The job waited too long"},
    {"cancelled", "The job was dismissed"},
    {"internal", "A fault of this service"},
};

/* Takes back the last character of out[0..len) if the size cut it in two. */
static void mend_utf8(char *out)
{
    size_t len = strlen(out), start = len;
    while (start > 0 && ((unsigned char)out[start - 1] & 0xc0) == 0x80)
        start--;
    if (start > 0 && (unsigned char)out[start - 1] >= 0x80)
        start--;
    if (start < len && uz_utf8_length(out + start, len - start) != len - start)
        out[start] = '\0';
}

void problem_set(problem_details *out, int status, const char *code, const json_value *at, const char *format, ...)
{
    va_list args;
    *out = (problem_details){.status = status};
    snprintf(out->code, sizeof out->code, "%s", code);
    snprintf(out->title, sizeof out->title, "The request was refused");
    for (size_t i = 0; i < sizeof TITLES / sizeof TITLES[0]; i++)
        if (strcmp(TITLES[i].code, code) == 0)
            snprintf(out->title, sizeof out->title, "%s", TITLES[i].title);
    json_pointer(out->pointer, sizeof out->pointer, at);
    va_start(args, format);
    vsnprintf(out->detail, sizeof out->detail, format, args);
    va_end(args);
    mend_utf8(out->detail);
}

bool problem_no_memory(problem_details *out)
{
    problem_set(out, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return false;
}

void problem_add(problem_details *out, const char *format, ...)
{
    va_list args;
    size_t used = strlen(out->detail);
    va_start(args, format);
    vsnprintf(out->detail + used, sizeof out->detail - used, format, args);
    va_end(args);
    mend_utf8(out->detail);
}

void problem_quote(char *out, size_t size, const char *text, size_t len)
{
    size_t used = 0, i = 0;
    out[used++] = '"';
    while (i < len) {
        size_t step = uz_utf8_length(text + i, len - i);
        bool odd = step == 0 || (unsigned char)text[i] < 0x20 || text[i] == 0x7f;
        if (used + step + sizeof "...\"" > size)
            break;
        if (odd) {
            out[used++] = '?';
            step = 1;
        } else {
            memcpy(out + used, text + i, step);
            used += step;
        }
        i += step;
    }
    snprintf(out + used, size - used, "%s\"", i < len ? "..." : "");
}
