/* vtk_legacy.c: VTK's legacy file of an unstructured grid (.vtk), versions to 5.1, ASCII or binary (high byte first).
 */
#include "core/error.h"
#include "io/vtk.h"

#include <string.h>
#include <strings.h>

enum { WORD = 80 };

typedef struct {
    cells *mesh;
    const char *text, *at, *end;
    bool binary;
    vtk_grid grid;
    int64_t n_data; /* of the section of data that is read */
    bool in_cells, in_points, added;
} legacy;

static uz_status fail(const legacy *f, uz_status status, const char *what, const char *word)
{
    return uz_fail_line(f->mesh->err, status, vtk_line(f->text, f->at), "%s%s%s%s", what, word ? " \"" : "",
                        word ? word : "", word ? "\"" : "");
}

/* ---- words and numbers */

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/* The next word, cut where it is too long; "": there is none. */
static size_t next_word(char out[WORD], legacy *f)
{
    size_t length = 0;
    while (f->at < f->end && is_blank(*f->at))
        f->at++;
    for (; f->at < f->end && !is_blank(*f->at); f->at++)
        if (length + 1 < WORD)
            out[length++] = *f->at >= ' ' && *f->at <= '~' ? *f->at : '?';
    out[length] = '\0';
    return length;
}

static void skip_line(legacy *f)
{
    const char *newline = memchr(f->at, '\n', (size_t)(f->end - f->at));
    f->at = newline ? newline + 1 : f->end;
}

static uz_status next_count(int64_t *value, legacy *f)
{
    char word[WORD];
    vtk_numbers number = {.whole = true, .n = 1, .integer = value};
    const size_t length = next_word(word, f);
    *value = 0;
    return vtk_numbers_read(&number, 0, word, length) && *value >= 0 && *value < (int64_t)1 << 48
               ? UZ_OK
               : fail(f, UZ_ERR_FORMAT, "a count was expected, found", word);
}

static uz_status next_type(const vtk_type **type, legacy *f)
{
    char word[WORD];
    next_word(word, f);
    for (int k = 0; k < VTK_TYPE_COUNT; k++)
        if (strcasecmp(VTK_TYPES[k].legacy, word) == 0) {
            *type = &VTK_TYPES[k];
            return UZ_OK;
        }
    return fail(f, UZ_ERR_UNSUPPORTED, "numbers are not read of the type", word);
}

/* n numbers behind the line of their head; out NULL: passed over. */
static uz_status read_numbers(vtk_numbers *out, legacy *f, int64_t n, const vtk_type *type)
{
    const size_t most = f->mesh->max_bytes > 0 ? f->mesh->max_bytes : SIZE_MAX;
    char word[WORD];
    uz_status status = UZ_OK;
    if (f->binary)
        skip_line(f);
    const uint64_t left = (uint64_t)(f->end - f->at), least = f->binary ? (uint64_t)type->size : 1;
    if ((uint64_t)n > left / least) /* of text: a digit at least */
        return fail(f, UZ_ERR_FORMAT, "there are fewer numbers than are announced", NULL);
    if (out && (uint64_t)n > most / 8)
        return fail(f, UZ_ERR_LIMIT, "the mesh needs more memory than is allowed", NULL);
    if (out)
        status = vtk_numbers_make(out, n, type->whole, f->mesh->err);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        if (f->binary) {
            if (out)
                vtk_numbers_put(out, i, (const unsigned char *)f->at, type, true);
            f->at += type->size;
        } else {
            const size_t length = next_word(word, f);
            if (length == 0 || (out && !vtk_numbers_read(out, i, word, length)))
                status = fail(f, UZ_ERR_FORMAT,
                              type->whole ? "an integer was expected, found" : "a number was expected, found", word);
        }
    }
    return status;
}

/* ---- the grid */

static uz_status read_points(legacy *f)
{
    const vtk_type *type;
    int64_t n;
    uz_status status = f->grid.points.n > 0 ? fail(f, UZ_ERR_FORMAT, "a second POINTS", NULL) : next_count(&n, f);
    if (status == UZ_OK)
        status = next_type(&type, f);
    return status == UZ_OK ? read_numbers(&f->grid.points, f, 3 * n, type) : status;
}

/* Version 5.1: CELLS offsets size OFFSETS type ... CONNECTIVITY type ...; offsets begin with 0. */
static uz_status read_offsets(legacy *f, int64_t offsets, int64_t size)
{
    const vtk_type *type;
    char word[WORD];
    uz_status status = next_type(&type, f);
    if (status == UZ_OK)
        status = type->whole ? read_numbers(&f->grid.ends, f, offsets, type)
                             : fail(f, UZ_ERR_FORMAT, "OFFSETS are integers", NULL);
    if (status != UZ_OK)
        return status;
    if (f->grid.ends.n > 0) {
        f->grid.ends.n--;
        memmove(f->grid.ends.integer, f->grid.ends.integer + 1, (size_t)f->grid.ends.n * sizeof(int64_t));
    }
    next_word(word, f);
    if (strcmp(word, "CONNECTIVITY") != 0)
        return fail(f, UZ_ERR_FORMAT, "CONNECTIVITY was expected, found", word);
    status = next_type(&type, f);
    if (status != UZ_OK)
        return status;
    return type->whole ? read_numbers(&f->grid.connectivity, f, size, type)
                       : fail(f, UZ_ERR_FORMAT, "CONNECTIVITY is of integers", NULL);
}

/* CELLS n size, and for each cell its number of points and those. */
static uz_status read_cells(legacy *f)
{
    static const vtk_type INT = {"Int32", "int", 4, true, true};
    char word[WORD];
    int64_t n = 0, size = 0;
    uz_status status =
        f->grid.ends.n > 0 || f->grid.ends.integer ? fail(f, UZ_ERR_FORMAT, "a second CELLS", NULL) : next_count(&n, f);
    if (status == UZ_OK)
        status = next_count(&size, f);
    if (status != UZ_OK)
        return status;
    const char *head = f->at;
    f->grid.line = vtk_line(f->text, f->at);
    next_word(word, f);
    if (strcmp(word, "OFFSETS") == 0)
        return read_offsets(f, n, size);
    f->at = head;
    if (n > size)
        return fail(f, UZ_ERR_FORMAT, "CELLS has more cells than numbers", NULL);
    status = read_numbers(&f->grid.connectivity, f, size, &INT);
    if (status == UZ_OK)
        status = vtk_numbers_make(&f->grid.ends, n, true, f->mesh->err);
    int64_t from = 0, to = 0, *node = f->grid.connectivity.integer;
    for (int64_t e = 0; e < n && status == UZ_OK; e++) {
        const int64_t count = from < size ? node[from] : -1;
        if (count < 0 || count > size - from - 1)
            return fail(f, UZ_ERR_FORMAT, "CELLS has a cell with more points than there are", NULL);
        memmove(node + to, node + from + 1, (size_t)count * sizeof *node);
        from += count + 1;
        f->grid.ends.integer[e] = to += count;
    }
    f->grid.connectivity.n = to;
    return status;
}

static uz_status read_types(legacy *f)
{
    static const vtk_type INT = {"Int32", "int", 4, true, true};
    int64_t n = 0;
    uz_status status = f->grid.types.integer ? fail(f, UZ_ERR_FORMAT, "a second CELL_TYPES", NULL) : next_count(&n, f);
    if (status == UZ_OK)
        status = read_numbers(&f->grid.types, f, n, &INT);
    if (status == UZ_OK && n != f->grid.ends.n)
        status = fail(f, UZ_ERR_FORMAT, "CELL_TYPES has not as many as CELLS", NULL);
    return status;
}

static uz_status add_grid(legacy *f)
{
    if (f->added)
        return UZ_OK;
    f->added = true;
    if (f->grid.line == 0)
        f->grid.line = vtk_line(f->text, f->at);
    if (f->grid.ends.n != f->grid.types.n || f->grid.types.n == 0)
        return fail(f, UZ_ERR_FORMAT, "there are no CELLS, or no CELL_TYPES before the data", NULL);
    return vtk_add_grid(f->mesh, &f->grid);
}

/* ---- data */

/* An array of a section: groups where it is of one integer each. */
static uz_status read_data(legacy *f, const char *name, int64_t components, int64_t n, const vtk_type *type)
{
    const bool used = components == 1 && type->whole && n == f->n_data && (f->in_cells || f->in_points);
    const int64_t line = vtk_line(f->text, f->at);
    vtk_numbers data = {.n = 0};
    if (components > 0 && n > INT64_MAX / 64 / components)
        return fail(f, UZ_ERR_FORMAT, "there are fewer numbers than are announced", NULL);
    uz_status status = read_numbers(used ? &data : NULL, f, components * n, type);
    if (status == UZ_OK && used)
        status = vtk_add_data(f->mesh, name, &data, f->in_points, line);
    vtk_numbers_clear(&data);
    return status;
}

static uz_status read_field(legacy *f)
{
    char name[WORD];
    int64_t arrays = 0, components = 0, n = 0;
    const vtk_type *type;
    next_word(name, f);
    uz_status status = next_count(&arrays, f);
    for (int64_t k = 0; k < arrays && status == UZ_OK; k++) {
        if (next_word(name, f) == 0)
            return fail(f, UZ_ERR_FORMAT, "FIELD has fewer arrays than it says", NULL);
        if (strcmp(name, "METADATA") == 0) { /* of the array before */
            for (const char *line = f->at; line < f->end; line = f->at) {
                skip_line(f);
                if (f->at < f->end && (*f->at == '\n' || *f->at == '\r'))
                    break;
            }
            k--;
            continue;
        }
        status = next_count(&components, f);
        if (status == UZ_OK)
            status = next_count(&n, f);
        if (status == UZ_OK)
            status = next_type(&type, f);
        if (status == UZ_OK)
            status = read_data(f, name, components, n, type);
    }
    return status;
}

/* SCALARS name type [components], then LOOKUP_TABLE name. */
static uz_status read_scalars(legacy *f)
{
    char name[WORD], word[WORD];
    const vtk_type *type;
    int64_t components = 1;
    next_word(name, f);
    uz_status status = next_type(&type, f);
    while (f->at < f->end && (*f->at == ' ' || *f->at == '\t' || *f->at == '\r'))
        f->at++;
    if (status == UZ_OK && f->at < f->end && *f->at != '\n')
        status = next_count(&components, f);
    const char *head = f->at;
    next_word(word, f);
    if (strcmp(word, "LOOKUP_TABLE") == 0)
        next_word(word, f);
    else
        f->at = head;
    return status == UZ_OK ? read_data(f, name, components, f->n_data, type) : status;
}

/* Arrays with a fixed number of components, and those that are none of a grid. */
static uz_status read_attribute(legacy *f, const char *keyword)
{
    static const struct {
        const char *keyword;
        int components;
    } KINDS[] = {{"VECTORS", 3},  {"NORMALS", 3},    {"TENSORS", 9},
                 {"TENSORS6", 6}, {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}};
    static const vtk_type BYTE = {"UInt8", "unsigned_char", 1, true, false};
    char name[WORD];
    const vtk_type *type = &BYTE;
    int64_t components = 0;
    uz_status status = UZ_OK;
    if (strcmp(keyword, "SCALARS") == 0)
        return read_scalars(f);
    next_word(name, f);
    for (size_t i = 0; i < sizeof KINDS / sizeof KINDS[0]; i++)
        components = strcmp(keyword, KINDS[i].keyword) == 0 ? KINDS[i].components : components;
    if (components > 0) {
        status = next_type(&type, f);
        return status == UZ_OK ? read_numbers(NULL, f, components * f->n_data, type) : status;
    }
    if (strcmp(keyword, "COLOR_SCALARS") != 0 && strcmp(keyword, "LOOKUP_TABLE") != 0 &&
        strcmp(keyword, "TEXTURE_COORDINATES") != 0)
        return fail(f, UZ_ERR_UNSUPPORTED, "a grid is not read with", keyword);
    status = next_count(&components, f);
    if (status == UZ_OK && keyword[0] == 'T')
        status = next_type(&type, f);
    const int64_t n = keyword[0] == 'L' ? 4 : f->n_data;
    if (status == UZ_OK && components > 0 && n > INT64_MAX / 64 / components)
        status = fail(f, UZ_ERR_FORMAT, "there are fewer numbers than are announced", NULL);
    return status == UZ_OK ? read_numbers(NULL, f, components * n, type) : status;
}

static uz_status begin_data(legacy *f, bool of_cells)
{
    const uz_status status = add_grid(f);
    const int64_t n = of_cells ? f->mesh->n_cells : f->mesh->n_nodes;
    f->in_cells = of_cells;
    f->in_points = !of_cells;
    if (status != UZ_OK)
        return status;
    const uz_status count = next_count(&f->n_data, f);
    return count == UZ_OK && f->n_data != n ? fail(f, UZ_ERR_FORMAT, "data of another number than the grid has", NULL)
                                            : count;
}

/* ---- the file */

static uz_status read_header(legacy *f)
{
    char word[WORD];
    if (f->end - f->at < 22 || memcmp(f->at, "# vtk DataFile Version", 22) != 0)
        return fail(f, UZ_ERR_FORMAT, "a VTK file begins with \"# vtk DataFile Version\" or XML", NULL);
    skip_line(f);
    skip_line(f);
    next_word(word, f);
    f->binary = strcasecmp(word, "BINARY") == 0;
    if (!f->binary && strcasecmp(word, "ASCII") != 0)
        return fail(f, UZ_ERR_FORMAT, "ASCII or BINARY was expected in the third line, found", word);
    next_word(word, f);
    if (strcmp(word, "DATASET") != 0)
        return fail(f, UZ_ERR_FORMAT, "DATASET was expected, found", word);
    next_word(word, f);
    return strcmp(word, "UNSTRUCTURED_GRID") == 0
               ? UZ_OK
               : fail(f, UZ_ERR_UNSUPPORTED, "save an unstructured grid; this is a data set", word);
}

static uz_status read_block(legacy *f, const char *keyword)
{
    if (strcmp(keyword, "POINTS") == 0)
        return read_points(f);
    if (strcmp(keyword, "CELLS") == 0)
        return read_cells(f);
    if (strcmp(keyword, "CELL_TYPES") == 0)
        return read_types(f);
    if (strcmp(keyword, "CELL_DATA") == 0 || strcmp(keyword, "POINT_DATA") == 0)
        return begin_data(f, keyword[0] == 'C');
    if (strcmp(keyword, "FIELD") == 0)
        return read_field(f);
    if (strcmp(keyword, "METADATA") != 0)
        return read_attribute(f, keyword);
    do /* ends with an empty line */
        skip_line(f);
    while (f->at < f->end && *f->at != '\n' && *f->at != '\r');
    return UZ_OK;
}

uz_status vtk_read_legacy(cells *mesh, const char *text, size_t len)
{
    legacy f = {.mesh = mesh, .text = text, .at = text, .end = text + len};
    char word[WORD];
    uz_status status = read_header(&f);
    while (status == UZ_OK && next_word(word, &f) > 0)
        status = read_block(&f, word);
    if (status == UZ_OK)
        status = add_grid(&f);
    vtk_grid_clear(&f.grid);
    return status;
}
