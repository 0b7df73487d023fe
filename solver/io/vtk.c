/* vtk.c: the mesh of a VTK file, XML (.vtu) or legacy (.vtk). */
#include "io/vtk.h"

#include "core/alloc.h"
#include "core/error.h"
#include "io/mesh_reader.h"

#include <math.h>
#include <string.h>

const vtk_type VTK_TYPES[] = {
    {"Int8", "char", 1, true, true},       {"UInt8", "unsigned_char", 1, true, false},
    {"Int16", "short", 2, true, true},     {"UInt16", "unsigned_short", 2, true, false},
    {"Int32", "int", 4, true, true},       {"UInt32", "unsigned_int", 4, true, false},
    {"Int64", "long", 8, true, true},      {"UInt64", "unsigned_long", 8, true, false},
    {"Float32", "float", 4, false, true},  {"Float64", "double", 8, false, true},
    {"", "vtkIdType", 4, true, true},      {"", "vtktypeint64", 8, true, true},
    {"", "vtktypeuint64", 8, true, false}, {"", "vtktypeint32", 4, true, true},
    {"", "vtktypeuint32", 4, true, false}, {"", "vtktypeint16", 2, true, true},
    {"", "vtktypeuint16", 2, true, false}, {"", "vtktypeint8", 1, true, true},
    {"", "vtktypeuint8", 1, true, false},
};
const int VTK_TYPE_COUNT = sizeof VTK_TYPES / sizeof VTK_TYPES[0];

enum { MOST_VALUES = 256 }; /* more values than these are numbers of cells or points, no parts */

uz_status vtk_numbers_make(vtk_numbers *out, int64_t n, bool whole, uz_error *err)
{
    *out = (vtk_numbers){.whole = whole, .n = n};
    if (whole)
        out->integer = uz_alloc_zero(n, sizeof *out->integer);
    else
        out->real = uz_alloc_zero(n, sizeof *out->real);
    return out->integer || out->real ? UZ_OK : uz_no_memory(err, "the mesh");
}

void vtk_numbers_clear(vtk_numbers *numbers)
{
    uz_free_all(numbers->integer, numbers->real);
    *numbers = (vtk_numbers){.n = 0};
}

void vtk_numbers_put(vtk_numbers *to, int64_t i, const unsigned char *bytes, const vtk_type *type, bool reversed)
{
    unsigned char own[8] = {0};
    uint64_t bits = 0;
    for (int k = 0; k < type->size; k++)
        own[k] = bytes[reversed ? type->size - 1 - k : k];
    for (int k = type->size - 1; k >= 0; k--) /* this machine's order is the little one */
        bits = bits << 8 | own[k];
    if (type->whole) {
        if (type->is_signed && type->size < 8 && bits >> (8 * type->size - 1))
            bits |= UINT64_MAX << (8 * type->size);
        to->integer[i] = (int64_t)bits; /* beyond 2^63: negative, in no range that is asked for */
    } else if (type->size == 4) {
        float value;
        memcpy(&value, own, sizeof value);
        to->real[i] = value;
    } else {
        memcpy(&to->real[i], own, sizeof to->real[i]);
    }
}

bool vtk_numbers_read(vtk_numbers *to, int64_t i, const char *word, size_t len)
{
    double value;
    const bool good = len > 0 && uz_parse_double(&value, word, len) == len;
    if (good && !to->whole)
        to->real[i] = value;
    if (good && to->whole) {
        if (!(fabs(value) < 9e15) || value != floor(value))
            return false;
        to->integer[i] = (int64_t)value;
    }
    return good;
}

void vtk_grid_clear(vtk_grid *grid)
{
    vtk_numbers_clear(&grid->points);
    vtk_numbers_clear(&grid->types);
    vtk_numbers_clear(&grid->ends);
    vtk_numbers_clear(&grid->connectivity);
}

int64_t vtk_line(const char *text, const char *at)
{
    int64_t line = 1;
    for (; (text = memchr(text, '\n', (size_t)(at - text))) != NULL; text++)
        line++;
    return line;
}

/* ---- cells */

/* Pixels and voxels, which are along the axes: as quad4 and hex8 with the last two nodes of each side the other way. */
enum { VTK_PIXEL = 8, VTK_VOXEL = 11 };

static int shape_of(int64_t type)
{
    if (type == VTK_PIXEL || type == VTK_VOXEL)
        return type == VTK_PIXEL ? UZ_QUAD4 : UZ_HEX8;
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        if (uz_element_type_of((uz_element_kind)k)->vtk == type)
            return k;
    return type == 1 ? CELLS_POINT : type == 3 ? CELLS_LINE2 : type == 21 ? CELLS_LINE3 : -1;
}

/* The base of a wedge looks outwards as VTK documents it, inwards as most programs write it: either is taken, by the
 * sign of the volume. */
static void turn_wedge(int64_t *node, int shape, const double *xyz)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)shape);
    double edge[3][3];
    int64_t given[UZ_ELEMENT_NODES];
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < 3; c++)
            edge[i][c] = xyz[3 * node[i + 1] + c] - xyz[3 * node[0] + c];
    const double volume = edge[2][0] * (edge[0][1] * edge[1][2] - edge[0][2] * edge[1][1]) +
                          edge[2][1] * (edge[0][2] * edge[1][0] - edge[0][0] * edge[1][2]) +
                          edge[2][2] * (edge[0][0] * edge[1][1] - edge[0][1] * edge[1][0]);
    if (!(volume > 0) || !type->abaqus_node)
        return;
    memcpy(given, node, (size_t)type->nodes * sizeof *node);
    for (int i = 0; i < type->nodes; i++)
        node[i] = given[type->abaqus_node[i]];
}

static void turn_sides(int64_t *node, int nodes)
{
    for (int i = 2; i < nodes; i += 4) {
        const int64_t third = node[i];
        node[i] = node[i + 1];
        node[i + 1] = third;
    }
}

uz_status vtk_add_grid(cells *mesh, const vtk_grid *grid)
{
    const int64_t n_points = grid->points.n / 3, n_cells = grid->types.n;
    uz_status status = UZ_OK;
    for (int64_t i = 0, from = 0; i < n_points && status == UZ_OK; i++, from += 3) {
        double x[3];
        for (int c = 0; c < 3; c++)
            x[c] = grid->points.whole ? (double)grid->points.integer[from + c] : grid->points.real[from + c];
        status = isfinite(x[0]) && isfinite(x[1]) && isfinite(x[2])
                     ? cells_add_node(mesh, x, grid->line)
                     : uz_fail_line(mesh->err, UZ_ERR_NOT_FINITE, grid->line, "point %lld is not finite", (long long)i);
    }
    for (int64_t e = 0, from = 0; e < n_cells && status == UZ_OK; e++) {
        const int64_t type = grid->types.integer[e];
        const int shape = shape_of(type);
        const int64_t to = grid->ends.integer[e];
        int64_t node[UZ_ELEMENT_NODES];
        if (shape < 0)
            return uz_fail_line(
                mesh->err, UZ_ERR_UNSUPPORTED, grid->line,
                "cell %lld is of type %lld, which is not read; save triangles, quadrilaterals, "
                "tetrahedra, wedges or hexahedra of order 1 or 2, or pixels or voxels (types 5, 8 to 13, 22 "
                "to 26)",
                (long long)e, (long long)type);
        if (to < from || to > grid->connectivity.n || to - from != cells_nodes(shape))
            return uz_fail_line(mesh->err, UZ_ERR_FORMAT, grid->line, "cell %lld has not the %d nodes of its type",
                                (long long)e, cells_nodes(shape));
        for (int i = 0; i < cells_nodes(shape); i++) {
            node[i] = grid->connectivity.integer[from + i];
            if (node[i] < 0 || node[i] >= n_points)
                return uz_fail_line(mesh->err, UZ_ERR_FORMAT, grid->line,
                                    "cell %lld has point %lld; there are %lld, from 0 on", (long long)e,
                                    (long long)node[i], (long long)n_points);
        }
        if (shape == UZ_WEDGE6 || shape == UZ_WEDGE15)
            turn_wedge(node, shape, mesh->xyz);
        if (type == VTK_PIXEL || type == VTK_VOXEL)
            turn_sides(node, cells_nodes(shape));
        status = cells_add(mesh, shape, node, grid->line);
        from = to;
    }
    return status;
}

uz_status vtk_add_data(cells *mesh, const char *name, const vtk_numbers *data, bool nodes, int64_t line)
{
    for (int64_t i = 0; strcmp(name, "vtkGhostType") == 0 && i < data->n; i++)
        if (data->integer[i] != 0)
            return uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, line,
                                "there are ghost cells or points; save the whole grid as one piece without them");
    if (strcmp(name, "vtkGhostType") == 0)
        return UZ_OK;
    return cells_add_values(mesh, name, data->integer, nodes, MOST_VALUES, line);
}

/* ---- the file */

static const char *skip_blanks(const char *text, const char *end)
{
    if (end - text >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0)
        text += 3;
    while (text < end && (*text == ' ' || *text == '\t' || *text == '\r' || *text == '\n'))
        text++;
    return text;
}

uz_status uz_vtk_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    cells mesh = {.max_bytes = max_bytes, .err = err};
    const char *at = skip_blanks(text, text + len);
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status =
        at < text + len && *at == '<' ? vtk_read_xml(&mesh, text, len) : vtk_read_legacy(&mesh, text, len);
    if (status == UZ_OK)
        status = cells_to_given(out, &mesh, "/mesh/vtk", "save the cells of the volume");
    cells_clear(&mesh);
    return status;
}
