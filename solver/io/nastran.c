/* nastran.c: the mesh of a NASTRAN bulk data file: GRID, elements, SET3.
 *
 * An entry is a line of fields, in free form (commas), in small ones (10 of 8 columns) or large ones (8 columns, 4 of
 * 16, 8), and the lines that continue it, which have to follow. Properties, materials, loads and constraints are passed
 * over, as scenes say that themselves; elements that are none of a mesh are refused.
 * Source: MSC Nastran Quick Reference Guide, "Format of Bulk Data Entries", GRID, CHEXA, CPENTA, CTETRA, CQUAD8,
 * CTRIA6, SET3. */
#include "core/alloc.h"
#include "core/error.h"
#include "io/abaqus.h"
#include "io/cells.h"
#include "io/mesh_reader.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 256, FIELD = 24, KEPT = 64 /* fields, more than an element has */ };

/* The type of an element by its name. Those with middles of edges have all of them or none. */
typedef struct {
    const char *name;
    int nodes_at;          /* its first node among the fields */
    int linear, quadratic; /* shapes of cells.h; -1: there is none */
    bool with_property;
    bool more; /* behind the nodes are other fields */
} element_name;
static const element_name ELEMENTS[] = {
    {"CTRIA3", 2, UZ_TRI3, -1, true, true},        {"CTRIAR", 2, UZ_TRI3, -1, true, true},
    {"CTRIA6", 2, UZ_TRI3, UZ_TRI6, true, true},   {"CQUAD4", 2, UZ_QUAD4, -1, true, true},
    {"CQUADR", 2, UZ_QUAD4, -1, true, true},       {"CQUAD8", 2, UZ_QUAD4, UZ_QUAD8, true, true},
    {"CTETRA", 2, UZ_TET4, UZ_TET10, true, false}, {"CPENTA", 2, UZ_WEDGE6, UZ_WEDGE15, true, false},
    {"CHEXA", 2, UZ_HEX8, UZ_HEX20, true, false},  {"CROD", 2, CELLS_LINE2, -1, true, true},
    {"CBAR", 2, CELLS_LINE2, -1, true, true},      {"CBEAM", 2, CELLS_LINE2, -1, true, true},
    {"PLOTEL", 1, CELLS_LINE2, -1, false, false},
};
enum { N_ELEMENTS = sizeof ELEMENTS / sizeof ELEMENTS[0] };

/* SET3: what its numbers are of. */
typedef enum { OF_NODES, OF_ELEMENTS, OF_PROPERTIES } set_of;
typedef struct {
    set_of of;
    int64_t line, number, first, last;
} set_part;

typedef struct {
    const char *at, *end; /* behind the current line */
    int64_t number;       /* of the current line, from 1 */
    char line[LINE];      /* without comment, tabs, blanks at its end; in capitals */
    size_t length;        /* 0: there is no further line */
    bool too_long;        /* the line was cut */

    int64_t entry_line; /* of the entry */
    char name[FIELD], label[FIELD];
    char (*field)[FIELD]; /* n_fields: those behind the name */
    int64_t n_fields, field_room;

    cells mesh; /* its nodes by their numbers in the file */
    abaqus_tags grids, elements;
    int64_t *property; /* cells: CELLS_NO_VALUE: none */
    int64_t property_room;
    set_part *part;
    int64_t n_parts, part_room;
    uz_error *err;
} nastran;

#define FAIL(n, status, ...) uz_fail_line((n)->err, status, (n)->entry_line > 0 ? (n)->entry_line : 1, __VA_ARGS__)

static uz_status no_memory(const nastran *n)
{
    return uz_no_memory(n->err, "the mesh");
}

/* ---- lines */

/* Moves to the next line that says something. */
static void next_line(nastran *n)
{
    n->length = 0;
    while (n->length == 0 && n->at < n->end) {
        const char *newline = memchr(n->at, '\n', (size_t)(n->end - n->at)), *to = newline ? newline : n->end;
        const char *from = n->at;
        n->at = newline ? newline + 1 : n->end;
        n->number++;
        n->too_long = false;
        for (; from < to && *from != '$'; from++) {
            const size_t stop = *from == '\t' ? (n->length / 8 + 1) * 8 : n->length + 1;
            for (; n->length < stop && n->length + 1 < LINE; n->length++)
                n->line[n->length] = (char)(*from == '\t' || *from == '\r' ? ' ' : toupper((unsigned char)*from));
            n->too_long = n->too_long || n->length < stop;
        }
        while (n->length > 0 && n->line[n->length - 1] == ' ')
            n->length--;
        n->line[n->length] = '\0';
    }
}

/* A field without the blanks around it. */
static void take(char out[FIELD], const char *from, size_t length)
{
    while (length > 0 && *from == ' ') {
        from++;
        length--;
    }
    while (length > 0 && from[length - 1] == ' ')
        length--;
    if (length >= FIELD) /* no number is as long: what is cut off is refused as none */
        length = FIELD - 1;
    for (size_t i = 0; i < length; i++)
        out[i] = from[i] >= ' ' && from[i] <= '~' ? from[i] : '?';
    out[length] = '\0';
}

static bool is_free(const nastran *n)
{
    return memchr(n->line, ',', n->length) != NULL;
}

/* The first field of the line. */
static void first_field(char out[FIELD], const nastran *n)
{
    const char *comma = memchr(n->line, ',', n->length);
    take(out, n->line, comma ? (size_t)(comma - n->line) : n->length < 8 ? n->length : 8);
}

static bool add_field(nastran *n, const char *from, size_t length)
{
    if (!uz_grow(&n->field, n->n_fields, 1, &n->field_room, sizeof *n->field))
        return false;
    take(n->field[n->n_fields++], from, length);
    return true;
}

/* Appends the fields of the line, those that are not there as empty ones, and keeps its last field as the label. */
static uz_status add_line(nastran *n, const char *first)
{
    const bool large = strchr(first, '*') != NULL, comma = is_free(n);
    const size_t width = large ? 16 : 8, fields = large ? 4 : 8;
    const char *at = n->line, *end = n->line + n->length;
    n->label[0] = '\0';
    if (n->too_long && comma)
        return FAIL(n, UZ_ERR_FORMAT, "line %lld is longer than %d bytes", (long long)n->number, LINE - 1);
    if (comma)
        at = (const char *)memchr(at, ',', n->length) + 1;
    else
        at = n->length < 8 ? end : at + 8;
    for (size_t i = 0; i < fields; i++) {
        const char *stop = comma ? memchr(at, ',', (size_t)(end - at)) : NULL;
        const size_t left = (size_t)(end - at), length = stop                    ? (size_t)(stop - at)
                                                         : comma || left < width ? left
                                                                                 : width;
        if (!add_field(n, at, length))
            return no_memory(n);
        at += length + (stop ? 1 : 0);
    }
    take(n->label, at, comma || end - at < 8 ? (size_t)(end - at) : 8);
    if (strchr(n->label, ','))
        return FAIL(n, UZ_ERR_FORMAT, "line %lld has more than %zu fields", (long long)n->number, fields + 2);
    return UZ_OK;
}

/* The next entry: n->name, without "*", and its fields. n->name "": there is none. */
static uz_status next_entry(nastran *n)
{
    char first[FIELD], label[FIELD];
    n->name[0] = '\0';
    n->n_fields = 0;
    if (n->length == 0)
        return UZ_OK;
    n->entry_line = n->number;
    first_field(first, n);
    if (first[0] == '\0' || first[0] == '+' || first[0] == '*')
        return FAIL(n, UZ_ERR_FORMAT, "a continuation of no entry: continuations have to follow what they continue");
    uz_status status = add_line(n, first);
    memcpy(n->name, first, sizeof first);
    n->name[strcspn(n->name, "*_")] = '\0'; /* meshio writes CHEXA_ for those with middles of edges */
    while (status == UZ_OK) {
        memcpy(label, n->label, sizeof label);
        next_line(n);
        if (n->length == 0)
            break;
        first_field(first, n);
        if (first[0] != '\0' && first[0] != '+' && first[0] != '*')
            break;
        if (label[0] && first[0] && first[1] && strcmp(label + (label[0] == '+' || label[0] == '*'), first + 1) != 0) {
            n->entry_line = n->number;
            return FAIL(n, UZ_ERR_UNSUPPORTED,
                        "a continuation \"%s\" where \"%s\" is to follow; sort the file, so that continuations follow "
                        "what they continue",
                        first, label);
        }
        if (n->n_fields > KEPT && strcmp(n->name, "SET3") != 0)
            n->n_fields = KEPT;
        status = add_line(n, first);
        if (status == UZ_OK && n->mesh.max_bytes > 0 && (uint64_t)n->n_fields > n->mesh.max_bytes / FIELD)
            status = FAIL(n, UZ_ERR_LIMIT, "the mesh needs more memory than is allowed");
    }
    return status;
}

/* ---- fields as numbers */

static const char *field_at(const nastran *n, int64_t i)
{
    return i < n->n_fields ? n->field[i] : "";
}

static uz_status read_int(int64_t *value, const nastran *n, int64_t i, const char *what)
{
    const char *field = field_at(n, i);
    const size_t length = strlen(field);
    *value = 0;
    for (size_t k = 0; k < length; k++) {
        if (field[k] < '0' || field[k] > '9' || length > 18)
            return FAIL(n, UZ_ERR_FORMAT, "%s: %s was expected, found \"%s\"", n->name, what, field);
        *value = 10 * *value + (field[k] - '0');
    }
    return *value > 0 ? UZ_OK : FAIL(n, UZ_ERR_FORMAT, "%s: %s was expected, found \"%s\"", n->name, what, field);
}

/* 1.5, 1.5E3, 1.5D3, 1.5+3; an empty field is 0. */
static uz_status read_real(double *value, const nastran *n, int64_t i)
{
    char word[FIELD + 1];
    const char *field = field_at(n, i);
    size_t length = 0;
    for (const char *c = field; *c; c++) {
        if (c > field && (*c == '+' || *c == '-') && !strchr("ED", c[-1]))
            word[length++] = 'e';
        if (length + 1 < sizeof word && !(c == field && *c == '+'))
            word[length++] = *c == 'D' ? 'e' : *c;
        if (length + 1 >= sizeof word)
            break;
    }
    *value = 0;
    if (field[0] && (length == 0 || uz_parse_double(value, word, length) != length))
        return FAIL(n, UZ_ERR_FORMAT, "%s: a coordinate was expected, found \"%s\"", n->name, field);
    return isfinite(*value) ? UZ_OK : FAIL(n, UZ_ERR_NOT_FINITE, "%s: a coordinate is not a finite number", n->name);
}

/* ---- entries */

static uz_status check_systems(const nastran *n)
{
    const char *system[] = {field_at(n, 1), field_at(n, 5)};
    for (int i = 0; i < 2; i++)
        if (system[i][strspn(system[i], "0")] && strcmp(system[i], "-1") != 0)
            return FAIL(n, UZ_ERR_UNSUPPORTED,
                        "%s: the coordinate system %s (%s) is not read; give nodes in the basic system (0)", n->name,
                        system[i], i == 0 ? "CP" : "CD");
    return UZ_OK;
}

static uz_status add_tag(const nastran *n, abaqus_tags *tags, int64_t tag)
{
    if (!uz_grow(&tags->tag, tags->count, 1, &tags->room, sizeof *tags->tag))
        return no_memory(n);
    tags->tag[tags->count++] = tag;
    return UZ_OK;
}

/* GRID ID CP X1 X2 X3 CD */
static uz_status read_grid(nastran *n)
{
    double x[3] = {0};
    int64_t tag;
    uz_status status = read_int(&tag, n, 0, "the number of a node");
    if (status == UZ_OK)
        status = check_systems(n);
    for (int i = 0; i < 3 && status == UZ_OK; i++)
        status = read_real(&x[i], n, 2 + i);
    if (status == UZ_OK)
        status = add_tag(n, &n->grids, tag);
    return status == UZ_OK ? cells_add_node(&n->mesh, x, n->entry_line) : status;
}

/* The shape of the entry's element: with all middles of edges, or with none. */
static uz_status choose_shape(int *shape, const nastran *n, const element_name *name)
{
    const int corners = cells_nodes(name->linear), all = name->quadratic < 0 ? corners : cells_nodes(name->quadratic);
    int there = 0;
    for (int i = 0; i < all; i++)
        there += field_at(n, name->nodes_at + i)[0] && strcmp(field_at(n, name->nodes_at + i), "0") != 0;
    for (int64_t i = name->nodes_at + all; i < n->n_fields && !name->more; i++)
        if (n->field[i][0])
            return FAIL(n, UZ_ERR_FORMAT, "%s: there is more than its %d nodes", n->name, all);
    if (there != corners && there != all)
        return FAIL(n, there > corners ? UZ_ERR_UNSUPPORTED : UZ_ERR_FORMAT,
                    "%s: there are %d nodes; there have to be %d, or %d with those amid all edges", n->name, there,
                    corners, all);
    *shape = there == corners ? name->linear : name->quadratic;
    return UZ_OK;
}

/* The place in the file of VTK's node i. Orders are those of Abaqus (element_type.h), but that the middles of the edges
 * between the two ends of wedges and hexahedra come before those of the second end. */
static int place_of(int shape, int i)
{
    const uz_element_type *type = shape < UZ_ELEMENT_KINDS ? uz_element_type_of((uz_element_kind)shape) : NULL;
    const int a = type && type->abaqus_node ? type->abaqus_node[i] : i, end = type ? type->corners / 2 : 0;
    if (shape != UZ_HEX20 && shape != UZ_WEDGE15)
        return a;
    return a < 3 * end ? a : a < 4 * end ? a + end : a - end;
}

/* CHEXA EID PID G1 ... */
static uz_status read_element(nastran *n, const element_name *name)
{
    int64_t tag, node[UZ_ELEMENT_NODES], property = CELLS_NO_VALUE;
    int shape = -1;
    uz_status status = read_int(&tag, n, 0, "the number of an element");
    if (status == UZ_OK && name->with_property && field_at(n, 1)[0])
        status = read_int(&property, n, 1, "the number of a property");
    if (status == UZ_OK)
        status = choose_shape(&shape, n, name);
    for (int i = 0; status == UZ_OK && i < cells_nodes(shape); i++)
        status = read_int(&node[i], n, name->nodes_at + place_of(shape, i), "the number of a node");
    if (status == UZ_OK && !uz_grow(&n->property, n->mesh.n_cells, 1, &n->property_room, sizeof *n->property))
        status = no_memory(n);
    if (status == UZ_OK)
        status = add_tag(n, &n->elements, tag);
    if (status != UZ_OK)
        return status;
    n->property[n->mesh.n_cells] = property;
    return cells_add(&n->mesh, shape, node, n->entry_line);
}

/* SET3 SID DES ID1 ID2 "THRU" ID3 ... */
static uz_status read_set(nastran *n)
{
    static const char *const OF[] = {"GRID", "ELEM", "PROP"};
    const char *of = field_at(n, 1);
    int k = 0;
    while (k < 3 && strncmp(of, OF[k], 4) != 0)
        k++;
    set_part part = {.of = (set_of)k, .line = n->entry_line};
    uz_status status = read_int(&part.number, n, 0, "the number of a set");
    for (int64_t i = 2; i < n->n_fields && status == UZ_OK && k < 3; i++) {
        if (!n->field[i][0])
            continue;
        status = read_int(&part.first, n, i, "a number of its members");
        part.last = part.first;
        if (status == UZ_OK && strcmp(field_at(n, i + 1), "THRU") == 0) {
            status = read_int(&part.last, n, i + 2, "a number of its members");
            i += 2;
        }
        if (status == UZ_OK && part.last < part.first)
            status = FAIL(n, UZ_ERR_FORMAT, "SET3: from %lld THRU %lld is nothing", (long long)part.first,
                          (long long)part.last);
        if (status == UZ_OK && !uz_grow(&n->part, n->n_parts, 1, &n->part_room, sizeof *n->part))
            status = no_memory(n);
        if (status == UZ_OK)
            n->part[n->n_parts++] = part;
    }
    return status;
}

/* What begins with C and is no element. */
static bool is_harmless(const char *name)
{
    static const char *const BEGINS[] = {"CORD", "CAERO", "CREEP", "CSET", "CY", "CEND"};
    if (name[0] != 'C')
        return true;
    for (size_t i = 0; i < sizeof BEGINS / sizeof BEGINS[0]; i++)
        if (strncmp(name, BEGINS[i], strlen(BEGINS[i])) == 0)
            return true;
    return false;
}

static uz_status read_entry(nastran *n)
{
    if (strcmp(n->name, "GRID") == 0)
        return read_grid(n);
    if (strcmp(n->name, "GRDSET") == 0)
        return check_systems(n);
    if (strcmp(n->name, "SET3") == 0)
        return read_set(n);
    for (int i = 0; i < N_ELEMENTS; i++)
        if (strcmp(n->name, ELEMENTS[i].name) == 0)
            return read_element(n, &ELEMENTS[i]);
    if (strncmp(n->name, "INCLUDE", 7) == 0)
        return FAIL(n, UZ_ERR_UNSUPPORTED, "INCLUDE is not read; put the lines of that file here");
    if (!is_harmless(n->name))
        return FAIL(n, UZ_ERR_UNSUPPORTED,
                    "%s is not read; mesh with CTRIA3, CTRIA6, CQUAD4, CQUAD8 in the plane of x and y, or CTETRA, "
                    "CPENTA, CHEXA, and leave other elements out",
                    n->name);
    return isalpha((unsigned char)n->name[0]) ? UZ_OK
                                              : FAIL(n, UZ_ERR_FORMAT, "\"%s\" is no entry of bulk data", n->name);
}

/* ---- from entries to cells */

/* Nodes of cells as indices. */
static uz_status find_nodes(nastran *n)
{
    for (int64_t e = 0; e < n->mesh.n_cells; e++)
        for (int64_t q = n->mesh.first[e]; q < n->mesh.first[e + 1]; q++) {
            const int64_t index = abaqus_tags_find(&n->grids, n->mesh.node[q]);
            if (index < 0)
                return uz_fail_line(n->err, UZ_ERR_FORMAT, n->mesh.line[e],
                                    "element %lld has node %lld, which is not there", (long long)n->elements.tag[e],
                                    (long long)n->mesh.node[q]);
            n->mesh.node[q] = index;
        }
    return UZ_OK;
}

/* Adds what a part of a set names; a range may have gaps. */
static uz_status add_part(nastran *n, int64_t set, const set_part *part)
{
    const abaqus_tags *tags = part->of == OF_NODES ? &n->grids : &n->elements;
    int64_t found = 0;
    uz_status status = UZ_OK;
    for (int64_t e = 0; part->of == OF_PROPERTIES && e < n->mesh.n_cells && status == UZ_OK; e++)
        if (n->property[e] >= part->first && n->property[e] <= part->last) {
            status = cells_add_member(&n->mesh, set, e, part->line);
            found++;
        }
    int64_t place = part->of == OF_PROPERTIES ? tags->count : abaqus_tags_at(tags, part->first);
    for (; place < tags->count && status == UZ_OK; place++) {
        const int64_t index = abaqus_tags_index(tags, place);
        if (tags->tag[index] > part->last)
            break;
        status = cells_add_member(&n->mesh, set, index, part->line);
        found++;
    }
    if (status == UZ_OK && found == 0)
        return uz_fail_line(n->err, UZ_ERR_FORMAT, part->line, "SET3 %lld has %lld, which is not there",
                            (long long)part->number, (long long)part->first);
    return status;
}

static uz_status add_sets(nastran *n)
{
    int64_t set = -1;
    uz_status status = cells_add_values(&n->mesh, "property", n->property, false, 0, 1);
    for (int64_t i = 0; i < n->n_parts && status == UZ_OK; i++) {
        const set_part *part = &n->part[i];
        char name[40];
        snprintf(name, sizeof name, "set_%lld", (long long)part->number);
        if (i == 0 || part->line != part[-1].line)
            status = cells_add_set(&set, &n->mesh, name, part->of == OF_NODES, part->line);
        if (status == UZ_OK)
            status = add_part(n, set, part);
    }
    return status;
}

/* ---- the file */

/* The line of BEGIN BULK, where there is one: before it are sections that say how to solve. 0: there is none. */
static int64_t bulk_line(const char *text, size_t len, const char **behind)
{
    nastran n = {.at = text, .end = text + len};
    for (next_line(&n); n.length > 0; next_line(&n)) {
        const char *word = n.line + strspn(n.line, " ");
        *behind = n.at;
        if (strncmp(word, "BEGIN", 5) == 0 && strncmp(word + 5 + strspn(word + 5, " "), "BULK", 4) == 0)
            return n.number;
    }
    *behind = text;
    return 0;
}

uz_status uz_nastran_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    nastran n = {.end = text + len, .err = err, .mesh = {.max_bytes = max_bytes, .err = err}};
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    n.number = bulk_line(text, len, &n.at);
    next_line(&n);
    uz_status status = next_entry(&n);
    while (status == UZ_OK && n.name[0] && strcmp(n.name, "ENDDATA") != 0) {
        status = read_entry(&n);
        if (status == UZ_OK)
            status = next_entry(&n);
    }
    const abaqus_text place = {.number = n.number, .err = err};
    if (status == UZ_OK && n.mesh.n_cells == 0)
        status = uz_fail_line(err, UZ_ERR_FORMAT, n.number > 0 ? n.number : 1,
                              "there is no element; a NASTRAN file has GRID and CTRIA3, CTETRA, CHEXA, ...");
    if (status == UZ_OK)
        status = abaqus_tags_sort(&n.grids, "nodes", &place);
    if (status == UZ_OK)
        status = abaqus_tags_sort(&n.elements, "elements", &place);
    if (status == UZ_OK)
        status = find_nodes(&n);
    if (status == UZ_OK)
        status = add_sets(&n);
    if (status == UZ_OK)
        status = cells_to_given(out, &n.mesh, "/mesh/nastran", "mesh a solid with CTETRA, CPENTA, CHEXA");
    cells_clear(&n.mesh);
    uz_free_all(n.field, n.grids.tag, n.grids.by_tag, n.elements.tag, n.elements.by_tag, n.property, n.part);
    return status;
}
