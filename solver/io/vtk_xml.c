/* vtk_xml.c: VTK's XML file of an unstructured grid (.vtu): text, base64, or appended bytes, also packed by zlib.
 *
 * expat finds the arrays; what they contain is read where it stands in the file, as base64 has no entities. Appended
 * bytes are no XML: the parser is stopped before them. An array of bytes begins with its length (UInt32 or UInt64); a
 * packed one with the number of blocks, the size of each but the last, that of the last (0: the same), and the packed
 * size of each. Base64 ends with its padding where header and content were coded one by one. */
#include "core/alloc.h"
#include "core/error.h"
#include "io/vtk.h"

#include <expat.h>
#include <libdeflate.h>
#include <stdlib.h>
#include <string.h>

typedef enum { NOWHERE, POINTS, CELLS, POINT_DATA, CELL_DATA } section;
typedef enum { ASCII, INLINE, APPENDED } coding;

/* An array, and where its content stands: for appended ones, behind the underscore. */
typedef struct {
    section in;
    char name[64], type[16];
    int64_t components, offset, line, from, to;
    coding format;
} array;

typedef struct {
    cells *mesh;
    const char *text;
    size_t len;
    XML_Parser parser;
    uz_status status;
    section in;
    array *list;
    int64_t n, room, open; /* open: the array whose end comes next, -1: none */
    int64_t n_points, n_cells, pieces, appended;
    bool begun, reversed, packed, long_header, raw;
} xml;

/* ---- the elements of the file */

#define REFUSE(x, kind, ...)                                                                                           \
    refuse_here(x, uz_fail_line((x)->mesh->err, kind, (int64_t)XML_GetCurrentLineNumber((x)->parser), __VA_ARGS__))

static void refuse_here(xml *x, uz_status status)
{
    x->status = status;
    XML_StopParser(x->parser, XML_FALSE);
}

static const char *attribute(const char **list, const char *name)
{
    for (; *list; list += 2)
        if (strcmp(*list, name) == 0)
            return list[1];
    return "";
}

/* A count of an attribute; -1: it is none. */
static int64_t count_of(const char *word, int64_t absent)
{
    char *end;
    if (!*word)
        return absent;
    const long long value = strtoll(word, &end, 10);
    return *end == '\0' && value >= 0 && value < (int64_t)1 << 48 ? value : -1;
}

static void begin_file(xml *x, const char *name, const char **attributes)
{
    const char *type = attribute(attributes, "type"), *packer = attribute(attributes, "compressor");
    const char *header = attribute(attributes, "header_type");
    x->begun = true;
    x->reversed = strcmp(attribute(attributes, "byte_order"), "BigEndian") == 0;
    x->packed = packer[0] != '\0';
    x->long_header = strcmp(header, "UInt64") == 0;
    if (strcmp(name, "VTKFile") != 0)
        REFUSE(x, UZ_ERR_FORMAT, "<%.40s> where a VTK file has <VTKFile>", name);
    else if (strcmp(type, "UnstructuredGrid") != 0)
        REFUSE(x, UZ_ERR_UNSUPPORTED, "the file is of type \"%.40s\"; save an unstructured grid (.vtu)", type);
    else if (x->packed && strcmp(packer, "vtkZLibDataCompressor") != 0)
        REFUSE(x, UZ_ERR_UNSUPPORTED, "%.60s is not read; save with zlib or without compression", packer);
    else if (header[0] && !x->long_header && strcmp(header, "UInt32") != 0)
        REFUSE(x, UZ_ERR_FORMAT, "header_type \"%.20s\"; it is UInt32 or UInt64", header);
}

static void begin_piece(xml *x, const char **attributes)
{
    x->n_points = count_of(attribute(attributes, "NumberOfPoints"), -1);
    x->n_cells = count_of(attribute(attributes, "NumberOfCells"), -1);
    if (++x->pieces > 1)
        REFUSE(x, UZ_ERR_UNSUPPORTED, "a second <Piece>; merge the pieces into one grid (in ParaView: Clean to Grid)");
    else if (x->n_points < 0 || x->n_cells < 0)
        REFUSE(x, UZ_ERR_FORMAT, "<Piece> has no NumberOfPoints and NumberOfCells");
}

static void begin_array(xml *x, const char **attributes)
{
    const char *format = attribute(attributes, "format");
    array *to;
    if (!uz_grow(&x->list, x->n, 1, &x->room, sizeof *x->list)) {
        refuse_here(x, uz_no_memory(x->mesh->err, "the mesh"));
        return;
    }
    to = &x->list[x->n];
    *to = (array){.in = x->in, .line = (int64_t)XML_GetCurrentLineNumber(x->parser)};
    strncpy(to->name, attribute(attributes, "Name"), sizeof to->name - 1);
    strncpy(to->type, attribute(attributes, "type"), sizeof to->type - 1);
    to->components = count_of(attribute(attributes, "NumberOfComponents"), 1);
    to->offset = count_of(attribute(attributes, "offset"), 0);
    to->format = strcmp(format, "binary") == 0 ? INLINE : strcmp(format, "appended") == 0 ? APPENDED : ASCII;
    to->from = to->to = (int64_t)XML_GetCurrentByteIndex(x->parser) + XML_GetCurrentByteCount(x->parser);
    if (to->components < 0 || to->offset < 0 || strlen(attribute(attributes, "Name")) >= sizeof to->name)
        REFUSE(x, UZ_ERR_FORMAT, "an array has a wrong NumberOfComponents or offset, or too long a name");
    x->open = x->n++;
}

static void XMLCALL on_begin(void *data, const char *name, const char **attributes)
{
    static const char *const SECTIONS[] = {"", "Points", "Cells", "PointData", "CellData"};
    xml *x = data;
    if (x->status != UZ_OK)
        return;
    if (!x->begun) {
        begin_file(x, name, attributes);
    } else if (strcmp(name, "Piece") == 0) {
        begin_piece(x, attributes);
    } else if (strcmp(name, "DataArray") == 0) {
        if (x->in != NOWHERE)
            begin_array(x, attributes);
    } else if (strcmp(name, "AppendedData") == 0) {
        x->raw = strcmp(attribute(attributes, "encoding"), "raw") == 0;
        x->appended = (int64_t)XML_GetCurrentByteIndex(x->parser) + XML_GetCurrentByteCount(x->parser);
        XML_StopParser(x->parser, XML_FALSE);
    }
    for (int k = POINTS; k <= CELL_DATA; k++)
        if (strcmp(name, SECTIONS[k]) == 0)
            x->in = (section)k;
}

static void XMLCALL on_end(void *data, const char *name)
{
    xml *x = data;
    if (strcmp(name, "DataArray") == 0 && x->open >= 0) {
        const int64_t end = (int64_t)XML_GetCurrentByteIndex(x->parser);
        array *of = &x->list[x->open];
        of->to = end > of->from ? end : of->from;
        x->open = -1;
    } else if (strcmp(name, "DataArray") != 0) {
        x->in = NOWHERE;
    }
}

static void XMLCALL on_doctype(void *data, const char *name, const char *system, const char *public, int subset)
{
    xml *x = data;
    (void)name, (void)system, (void)public, (void)subset;
    REFUSE(x, UZ_ERR_UNSUPPORTED, "a document type is not read; a VTK file has none");
}

static void *more_memory(size_t bytes)
{
    return bytes < INT64_MAX ? uz_alloc((int64_t)bytes, 1) : NULL;
}

static void *other_memory(void *block, size_t bytes)
{
    return bytes < INT64_MAX ? uz_realloc(block, (int64_t)bytes, 1) : NULL;
}

static uz_status find_arrays(xml *x)
{
    static const XML_Memory_Handling_Suite MEMORY = {more_memory, other_memory, free};
    uz_error *err = x->mesh->err;
    enum XML_Status good = XML_STATUS_OK;
    if (!(x->parser = XML_ParserCreate_MM(NULL, &MEMORY, NULL)))
        return uz_no_memory(err, "the mesh");
    XML_SetUserData(x->parser, x);
    XML_SetElementHandler(x->parser, on_begin, on_end);
    XML_SetStartDoctypeDeclHandler(x->parser, on_doctype);
    for (size_t at = 0; at < x->len && good == XML_STATUS_OK;) {
        const size_t part = x->len - at < (size_t)1 << 30 ? x->len - at : (size_t)1 << 30;
        good = XML_Parse(x->parser, x->text + at, (int)part, at + part == x->len);
        at += part;
    }
    const enum XML_Error code = XML_GetErrorCode(x->parser);
    if (x->status == UZ_OK && code == XML_ERROR_NO_MEMORY)
        x->status = uz_no_memory(err, "the mesh");
    else if (x->status == UZ_OK && good != XML_STATUS_OK && code != XML_ERROR_ABORTED)
        x->status = uz_fail_line(err, UZ_ERR_FORMAT, (int64_t)XML_GetCurrentLineNumber(x->parser), "no good XML: %s",
                                 XML_ErrorString(code));
    XML_ParserFree(x->parser);
    return x->status;
}

/* ---- bytes of an array */

typedef struct {
    const char *at, *end;
    bool base64;
    unsigned char ready[3];
    int n_ready, taken;
} bytes;

static int digit_of(char c)
{
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+'             ? 62
           : c == '/'             ? 63
                                  : -1;
}

/* Decodes the next four digits, of which padding takes bytes away. */
static bool decode(bytes *from)
{
    unsigned bits = 0;
    int digits = 0, padding = 0;
    for (; digits + padding < 4 && from->at < from->end; from->at++) {
        const char c = *from->at;
        if (c == ' ' || c == '\n' || c == '\r' || c == '\t')
            continue;
        if (c != '=' && (padding > 0 || digit_of(c) < 0))
            return false;
        padding += c == '=';
        digits += c != '=';
        bits = bits << 6 | (c == '=' ? 0u : (unsigned)digit_of(c));
    }
    if (digits < 2 || digits + padding < 4)
        return false;
    for (int i = 0; i < 3; i++)
        from->ready[i] = (unsigned char)(bits >> (16 - 8 * i));
    from->n_ready = digits - 1;
    from->taken = 0;
    return true;
}

/* The next n bytes; false: there are fewer, or no base64. */
static bool take(unsigned char *out, bytes *from, size_t n)
{
    if (!from->base64) {
        if ((size_t)(from->end - from->at) < n)
            return false;
        memcpy(out, from->at, n);
        from->at += n;
        return true;
    }
    for (size_t i = 0; i < n; i++) {
        if (from->taken == from->n_ready && !decode(from))
            return false;
        out[i] = from->ready[from->taken++];
    }
    return true;
}

static bool take_header(uint64_t *value, const xml *x, bytes *from)
{
    unsigned char raw[8];
    const int size = x->long_header ? 8 : 4;
    *value = 0;
    if (!take(raw, from, (size_t)size))
        return false;
    for (int k = 0; k < size; k++)
        *value = *value << 8 | raw[x->reversed ? k : size - 1 - k];
    return true;
}

static uz_status fail_in(const xml *x, const array *from, uz_status status, const char *what)
{
    return uz_fail_line(x->mesh->err, status, from->line, "the array \"%s\" %s", from->name, what);
}

/* Unpacks all blocks to `size` bytes. */
static uz_status unpack(unsigned char *out, uint64_t size, const xml *x, const array *of, bytes *from)
{
    uint64_t blocks = 0, block = 0, last = 0, done = 0, *packed = NULL;
    unsigned char *input = NULL;
    struct libdeflate_decompressor *tool = NULL;
    const uint64_t left = (uint64_t)(from->end - from->at);
    bool good = take_header(&blocks, x, from) && take_header(&block, x, from) && take_header(&last, x, from);
    last = last == 0 ? block : last;
    if (blocks <= 1)
        good = good && size == (blocks == 0 ? 0 : last);
    else
        good = good && blocks <= left && block > 0 && last <= block && last <= size && (size - last) % block == 0 &&
               (size - last) / block == blocks - 1;
    if (!good)
        return fail_in(x, of, UZ_ERR_FORMAT, "has another length than its points or cells need, or is cut off");
    packed = uz_alloc((int64_t)blocks, sizeof *packed);
    input = uz_alloc((int64_t)left + 1, 1);
    tool = libdeflate_alloc_decompressor();
    uz_status status = packed && input && tool ? UZ_OK : uz_no_memory(x->mesh->err, "the mesh");
    for (uint64_t b = 0; b < blocks && good; b++)
        good = status == UZ_OK && take_header(&packed[b], x, from);
    for (uint64_t b = 0; b < blocks && good; b++) {
        const uint64_t length = b + 1 < blocks ? block : last;
        good = packed[b] <= left && take(input, from, packed[b]) &&
               libdeflate_zlib_decompress(tool, input, packed[b], out + done, length, NULL) == LIBDEFLATE_SUCCESS;
        done += length;
    }
    if (tool)
        libdeflate_free_decompressor(tool);
    uz_free_all(packed, input);
    return status == UZ_OK && !good ? fail_in(x, of, UZ_ERR_FORMAT, "is not packed by zlib as it says, or cut off")
                                    : status;
}

/* ---- arrays */

static uz_status read_words(vtk_numbers *out, const xml *x, const array *from)
{
    const char *at = x->text + from->from, *end = x->text + from->to;
    int64_t i = 0;
    for (;; i++) {
        while (at < end && strchr(" \t\r\n", *at) && *at)
            at++;
        const char *word = at;
        while (at < end && !(strchr(" \t\r\n", *at) && *at))
            at++;
        if (word == at)
            break;
        if (i == out->n || !vtk_numbers_read(out, i, word, (size_t)(at - word)))
            return uz_fail_line(x->mesh->err, UZ_ERR_FORMAT, vtk_line(x->text, word),
                                "the array \"%s\" has more numbers than %lld, or something else", from->name,
                                (long long)out->n);
    }
    return i == out->n ? UZ_OK : fail_in(x, from, UZ_ERR_FORMAT, "has fewer numbers than its points or cells need");
}

static uz_status read_bytes(vtk_numbers *out, const xml *x, const array *from, const vtk_type *type)
{
    bytes source = {.at = x->text + from->from, .end = x->text + from->to, .base64 = true};
    const uint64_t size = (uint64_t)out->n * (uint64_t)type->size;
    uint64_t length = 0;
    if (from->format == APPENDED) {
        const char *end = x->text + x->len, *start = x->appended > 0 ? x->text + x->appended : end;
        while (start < end && *start != '_')
            start++;
        if (end - start <= from->offset)
            return fail_in(x, from, UZ_ERR_FORMAT, "is to be in appended data that are not there");
        source = (bytes){.at = start + 1 + from->offset, .end = end, .base64 = !x->raw};
    }
    unsigned char *raw = uz_alloc((int64_t)size, 1);
    uz_status status = raw ? UZ_OK : uz_no_memory(x->mesh->err, "the mesh");
    if (status == UZ_OK && x->packed)
        status = unpack(raw, size, x, from, &source);
    else if (status == UZ_OK && (!take_header(&length, x, &source) || length != size || !take(raw, &source, size)))
        status = fail_in(x, from, UZ_ERR_FORMAT, "has another length than its points or cells need, or is cut off");
    for (int64_t i = 0; i < out->n && status == UZ_OK; i++)
        vtk_numbers_put(out, i, raw + i * type->size, type, x->reversed);
    free(raw);
    return status;
}

static const vtk_type *type_of(const array *of)
{
    for (int k = 0; k < VTK_TYPE_COUNT; k++)
        if (VTK_TYPES[k].xml[0] && strcmp(VTK_TYPES[k].xml, of->type) == 0)
            return &VTK_TYPES[k];
    return NULL;
}

/* n numbers; what a file of this length can't have is refused before there is room for it. */
static uz_status read_array(vtk_numbers *out, const xml *x, const array *from, int64_t n, bool whole)
{
    const vtk_type *type = type_of(from);
    const size_t most = x->mesh->max_bytes > 0 ? x->mesh->max_bytes : SIZE_MAX;
    if (!type || (whole && !type->whole))
        return fail_in(x, from, UZ_ERR_FORMAT, whole ? "is not of integers" : "has a type that is not known");
    if ((uint64_t)n > 1100 * (uint64_t)x->len) /* zlib makes at most 1032 bytes of one */
        return fail_in(x, from, UZ_ERR_FORMAT, "is to be longer than the file can hold");
    if ((uint64_t)n > most / 8)
        return fail_in(x, from, UZ_ERR_LIMIT, "needs more memory than is allowed");
    const uz_status status = vtk_numbers_make(out, n, type->whole, x->mesh->err);
    if (status != UZ_OK)
        return status;
    return from->format == ASCII ? read_words(out, x, from) : read_bytes(out, x, from, type);
}

/* The array of a section; name NULL: its only one. */
static const array *find(const xml *x, section in, const char *name)
{
    for (int64_t i = 0; i < x->n; i++)
        if (x->list[i].in == in && (!name || strcmp(x->list[i].name, name) == 0))
            return &x->list[i];
    return NULL;
}

static uz_status read_grid(vtk_grid *out, const xml *x)
{
    const array *points = find(x, POINTS, NULL), *types = find(x, CELLS, "types"), *ends = find(x, CELLS, "offsets");
    const array *connectivity = find(x, CELLS, "connectivity");
    if (x->pieces == 0 || !points || !types || !ends || !connectivity)
        return uz_fail_line(x->mesh->err, UZ_ERR_FORMAT, 1,
                            "there is no <Piece> with points and cells (connectivity, offsets, types)");
    if (points->components != 3)
        return fail_in(x, points, UZ_ERR_FORMAT, "is of points, which have 3 components");
    out->line = types->line;
    uz_status status = read_array(&out->points, x, points, 3 * x->n_points, false);
    if (status == UZ_OK)
        status = read_array(&out->types, x, types, x->n_cells, true);
    if (status == UZ_OK)
        status = read_array(&out->ends, x, ends, x->n_cells, true);
    const int64_t n = status == UZ_OK && x->n_cells > 0 ? out->ends.integer[x->n_cells - 1] : 0;
    if (status == UZ_OK && n < 0)
        status = fail_in(x, ends, UZ_ERR_FORMAT, "has a negative end");
    return status == UZ_OK ? read_array(&out->connectivity, x, connectivity, n, true) : status;
}

uz_status vtk_read_xml(cells *mesh, const char *text, size_t len)
{
    xml x = {.mesh = mesh, .text = text, .len = len, .open = -1};
    vtk_grid grid = {.line = 1};
    uz_status status = find_arrays(&x);
    if (status == UZ_OK)
        status = read_grid(&grid, &x);
    if (status == UZ_OK)
        status = vtk_add_grid(mesh, &grid);
    for (int64_t i = 0; i < x.n && status == UZ_OK; i++) {
        const array *from = &x.list[i];
        const vtk_type *type = type_of(from);
        const bool nodes = from->in == POINT_DATA;
        vtk_numbers data = {.n = 0};
        if ((!nodes && from->in != CELL_DATA) || from->components != 1 || !type || !type->whole)
            continue; /* results, not parts */
        status = read_array(&data, &x, from, nodes ? x.n_points : x.n_cells, true);
        if (status == UZ_OK)
            status = vtk_add_data(mesh, from->name, &data, nodes, from->line);
        vtk_numbers_clear(&data);
    }
    vtk_grid_clear(&grid);
    free(x.list);
    return status;
}
