/* abaqus.c: a whole input file of Abaqus or CalculiX, and the mesh that it is.
 *
 * Read are nodes, elements, sets and surfaces; materials, steps and whatever else a deck has are passed over, as scenes
 * say that themselves. What makes nodes, elements or copies of them in place of listing them is refused. */
#include "io/abaqus.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "io/mesh_reader.h"
#include "scene/given.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- types of elements */

/* What is no body by itself; meshing programs write it beside the elements, too, for the sides of a body. */
static const abaqus_family TRUSS = {"a truss", "give it its section in solid elements, or hold what it holds by a "
                                               "support of the scene with \"spring\""},
                           BEAM = {"a beam", "give it its section in solid elements (C3D20, C3D10), or its height in "
                                             "CPS or CPE"},
                           SHELL = {"a shell", "give it its thickness in solid elements (C3D20, C3D10), or take a "
                                               "section of it with CPE, CPS or CAX"},
                           MEMBRANE = {"a membrane", "give it its thickness in solid elements (C3D20, C3D10)"},
                           RIGID = {"a rigid element", "a rigid surface is an obstacle of the scene"},
                           SURFACE = {"a surface element", "take the body below it"};

static const struct {
    const char *name;
    int dim, nodes;
    const abaqus_family *family;
} SIDE_TYPES[] = {
    {"T2D2", 1, 2, &TRUSS},     {"T2D3", 1, 3, &TRUSS},     {"T3D2", 1, 2, &TRUSS},     {"T3D3", 1, 3, &TRUSS},
    {"B21", 1, 2, &BEAM},       {"B22", 1, 3, &BEAM},       {"B31", 1, 2, &BEAM},       {"B32", 1, 3, &BEAM},
    {"R2D2", 1, 2, &RIGID},     {"RAX2", 1, 2, &RIGID},     {"SAX1", 1, 2, &SHELL},     {"SAX2", 1, 3, &SHELL},
    {"S3", 2, 3, &SHELL},       {"S4", 2, 4, &SHELL},       {"S6", 2, 6, &SHELL},       {"S8", 2, 8, &SHELL},
    {"STRI3", 2, 3, &SHELL},    {"STRI65", 2, 6, &SHELL},   {"M3D3", 2, 3, &MEMBRANE},  {"M3D4", 2, 4, &MEMBRANE},
    {"M3D6", 2, 6, &MEMBRANE},  {"M3D8", 2, 8, &MEMBRANE},  {"R3D3", 2, 3, &RIGID},     {"R3D4", 2, 4, &RIGID},
    {"SFM3D3", 2, 3, &SURFACE}, {"SFM3D4", 2, 4, &SURFACE}, {"SFM3D6", 2, 6, &SURFACE}, {"SFM3D8", 2, 8, &SURFACE},
};
enum { N_SIDE_TYPES = sizeof SIDE_TYPES / sizeof SIDE_TYPES[0] };

/* The name without what tells of integration, incompatible modes and mixed forms, which the scene decides. */
static bool is_type(const char *name, const char *base)
{
    static const char *const SUFFIX[] = {"", "R", "I", "H", "RH", "IH", "M", "MH", "R5"};
    const size_t length = base ? strlen(base) : 0;
    if (!base || strncmp(name, base, length) != 0)
        return false;
    for (size_t i = 0; i < sizeof SUFFIX / sizeof SUFFIX[0]; i++)
        if (strcmp(name + length, SUFFIX[i]) == 0)
            return true;
    return false;
}

/* The number of a type by its name in capitals; -1: there is none. */
static int type_number(const char *name)
{
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        for (int m = 0; m < 4; m++)
            if (is_type(name, uz_element_type_of((uz_element_kind)k)->abaqus[m]))
                return k;
    for (int i = 0; i < N_SIDE_TYPES; i++)
        if (is_type(name, SIDE_TYPES[i].name))
            return ABAQUS_SIDES + i;
    return -1;
}

abaqus_type abaqus_type_of(int number)
{
    if (number >= ABAQUS_SIDES)
        return (abaqus_type){SIDE_TYPES[number - ABAQUS_SIDES].dim, SIDE_TYPES[number - ABAQUS_SIDES].nodes, -1,
                             SIDE_TYPES[number - ABAQUS_SIDES].family};
    const uz_element_type *type = uz_element_type_of((uz_element_kind)number);
    return (abaqus_type){type->dim, type->nodes, number, NULL};
}

uz_status abaqus_fail_no_body(const abaqus_file *file, int64_t element)
{
    const int number = file->type[element];
    const abaqus_family *family = abaqus_type_of(number).family;
    return abaqus_fail(ABAQUS_LINE(&file->text, file->line[element]), UZ_ERR_UNSUPPORTED,
                       "element %lld, of type %s, is %s, which is not modelled; %s",
                       (long long)file->elements.tag[element], SIDE_TYPES[number - ABAQUS_SIDES].name, family->what,
                       family->remedy);
}

/* ---- lists that grow, and numbers that are looked up */

uz_status abaqus_no_memory(const abaqus_text *text)
{
    return abaqus_fail(text, UZ_ERR_MEMORY, "no memory for the mesh");
}

uz_status abaqus_tags_sort(abaqus_tags *tags, const char *what, const abaqus_text *text)
{
    bool ascending = true;
    for (int64_t i = 1; i < tags->count; i++)
        ascending = ascending && tags->tag[i - 1] < tags->tag[i];
    if (ascending)
        return UZ_OK;
    tags->by_tag = uz_order_of(tags->tag, tags->count);
    if (!tags->by_tag)
        return abaqus_no_memory(text);
    for (int64_t i = 1; i < tags->count; i++) {
        const int64_t tag = tags->tag[tags->by_tag[i]];
        if (tag == tags->tag[tags->by_tag[i - 1]])
            return abaqus_fail(text, UZ_ERR_FORMAT, "two %s have the number %lld", what, (long long)tag);
    }
    return UZ_OK;
}

int64_t abaqus_tags_at(const abaqus_tags *tags, int64_t tag)
{
    return uz_order_seek(tags->tag, tags->by_tag, tags->count, tag);
}

int64_t abaqus_tags_find(const abaqus_tags *tags, int64_t tag)
{
    const int64_t place = abaqus_tags_at(tags, tag);
    const int64_t index = place < tags->count ? abaqus_tags_index(tags, place) : -1;
    return index >= 0 && tags->tag[index] == tag ? index : -1;
}

/* ---- nodes and elements */

static uz_status check_size(const abaqus_file *file)
{
    const uint64_t bytes = 8 * (uint64_t)(4 * file->nodes.count + 3 * file->elements.count +
                                          (file->first ? file->first[file->elements.count] : 0));
    return file->max_bytes == 0 || bytes <= file->max_bytes
               ? UZ_OK
               : abaqus_fail(&file->text, UZ_ERR_LIMIT, "the mesh needs more memory than is allowed");
}

/* The set that a block names for its nodes or elements; -1: none. */
static uz_status set_of_block(int64_t *set, abaqus_file *file, const abaqus_keyword *keyword, abaqus_set_kind kind)
{
    char name[ABAQUS_NAME];
    *set = -1;
    if (abaqus_parameter(keyword, "INPUT"))
        return abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED, "*%s from another file is not read; put its lines here",
                           keyword->text);
    const uz_status status = abaqus_name(name, keyword, kind == ABAQUS_NSET ? "NSET" : "ELSET", false, &file->text);
    return status == UZ_OK && name[0] ? abaqus_set_of(set, file, kind, name) : status;
}

static uz_status add_tag(abaqus_file *file, abaqus_tags *tags, int64_t set, int64_t tag)
{
    if (!uz_grow(&tags->tag, tags->count, 1, &tags->room, sizeof *tags->tag))
        return abaqus_no_memory(&file->text);
    tags->tag[tags->count] = tag;
    const abaqus_item item = {.line = file->text.number, .first = tag, .last = tag, .step = 1, .set = -1};
    return set >= 0 ? abaqus_set_add(file, set, item) : UZ_OK;
}

/* number, x, y, z: what is not there is 0 */
static uz_status read_nodes(abaqus_file *file, const abaqus_keyword *keyword)
{
    abaqus_text *text = &file->text;
    char field[ABAQUS_FIELD];
    int64_t set, tag;
    uz_status status = set_of_block(&set, file, keyword, ABAQUS_NSET);
    if (status == UZ_OK && abaqus_parameter(keyword, "SYSTEM") && abaqus_parameter(keyword, "SYSTEM")[0] != 'R')
        status = abaqus_fail(text, UZ_ERR_UNSUPPORTED, "nodes in another system than a rectangular one are not read");
    while (status == UZ_OK && abaqus_next_line(text) && !abaqus_is_keyword(text)) {
        const int64_t n = file->nodes.count;
        int count = 0;
        abaqus_field(field, text);
        status = abaqus_int(&tag, field, "the number of a node", text);
        if (status == UZ_OK && !uz_grow(&file->xyz, 3 * n, 3, &file->xyz_room, sizeof *file->xyz))
            status = abaqus_no_memory(text);
        if (status == UZ_OK)
            memset(file->xyz + 3 * n, 0, 3 * sizeof *file->xyz);
        for (; status == UZ_OK && abaqus_field(field, text); count++)
            if (count < 3) /* behind them is the direction of shells, which is not needed */
                status = abaqus_real(&file->xyz[3 * n + count], field, "a coordinate", text);
        if (status == UZ_OK && count < 2)
            status = abaqus_fail(text, UZ_ERR_FORMAT, "node %lld has no coordinates", (long long)tag);
        if (status == UZ_OK)
            status = add_tag(file, &file->nodes, set, tag);
        file->nodes.count += status == UZ_OK;
        if (status == UZ_OK)
            status = check_size(file);
    }
    return status;
}

/* number, nodes, over as many lines as it takes */
static uz_status read_element(abaqus_file *file, int type, int64_t set)
{
    abaqus_text *text = &file->text;
    const int64_t e = file->elements.count, line = text->number;
    const int nodes = abaqus_type_of(type).nodes;
    char field[ABAQUS_FIELD];
    int64_t tag, from = e > 0 ? file->first[e] : 0;
    abaqus_field(field, text);
    uz_status status = abaqus_int(&tag, field, "the number of an element", text);
    if (status == UZ_OK && (!uz_grow(&file->type, e, 1, &file->type_room, sizeof *file->type) ||
                            !uz_grow(&file->line, e, 1, &file->line_room, sizeof *file->line) ||
                            !uz_grow(&file->first, e, 2, &file->first_room, sizeof *file->first) ||
                            !uz_grow(&file->node, from, nodes, &file->place_room, sizeof *file->node)))
        status = abaqus_no_memory(text);
    if (status != UZ_OK)
        return status;
    file->first[e] = from;
    for (int i = 0; i < nodes && status == UZ_OK;) {
        if (!abaqus_field(field, text)) {
            if (!abaqus_next_line(text) || abaqus_is_keyword(text))
                return abaqus_fail(text, UZ_ERR_FORMAT, "element %lld has %d of its %d nodes", (long long)tag, i,
                                   nodes);
            continue;
        }
        status = abaqus_int(&file->node[from + i++], field, "the number of a node", text);
    }
    if (status == UZ_OK && abaqus_field(field, text))
        status = abaqus_fail(text, UZ_ERR_FORMAT, "element %lld has more than the %d nodes of its type", (long long)tag,
                             nodes);
    file->type[e] = (unsigned char)type;
    file->line[e] = line;
    file->first[e + 1] = from + nodes;
    if (status == UZ_OK)
        status = add_tag(file, &file->elements, set, tag);
    file->elements.count += status == UZ_OK;
    return status == UZ_OK ? check_size(file) : status;
}

/* What to write in place of elements of a type that is not read. */
static const char *remedy_for(const char *name)
{
    static const struct {
        const char *begin, *remedy;
    } REMEDIES[] = {
        {"SPRING", "a support of the scene with \"spring\" holds a group by springs to the ground"},
        {"DASHPOT", "they do nothing in a static step: leave them out"},
        {"GAP", "a contact pair stands for them"},
        {"MASS", "a point mass is a \"force\" of the scene \"at\" its centre"},
        {"DCOUP", "a rigid group of the scene stands for them"},
        {"U", "what they are is in a program beside the deck"},
    };
    for (size_t i = 0; i < sizeof REMEDIES / sizeof REMEDIES[0]; i++)
        if (strncmp(name, REMEDIES[i].begin, strlen(REMEDIES[i].begin)) == 0)
            return REMEDIES[i].remedy;
    return "mesh with CPS, CPE, CAX (3, 4, 6, 8 nodes) or C3D (4, 6, 8, 10, 15, 20)";
}

static uz_status read_elements(abaqus_file *file, const abaqus_keyword *keyword)
{
    char name[ABAQUS_NAME];
    int64_t set = -1;
    int type = -1;
    uz_status status = abaqus_name(name, keyword, "TYPE", true, &file->text);
    for (char *c = name; *c; c++)
        *c = (char)(*c >= 'a' && *c <= 'z' ? *c - 'a' + 'A' : *c);
    if (status == UZ_OK && (type = type_number(name)) < 0)
        status = abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED, "elements of type %s are not read; %s", name,
                             remedy_for(name));
    if (status == UZ_OK)
        status = set_of_block(&set, file, keyword, ABAQUS_ELSET);
    while (status == UZ_OK && abaqus_next_line(&file->text) && !abaqus_is_keyword(&file->text))
        status = read_element(file, type, set);
    return status;
}

/* ---- the rest of a deck */

/* Passes over the data of a keyword that is no part of a mesh. *lines: how many there were. */
static void skip_data(abaqus_text *text, int64_t *lines)
{
    *lines = 0;
    while (abaqus_next_line(text) && !abaqus_is_keyword(text))
        ++*lines;
}

static uz_status read_other(abaqus_file *file, const abaqus_keyword *keyword)
{
    static const struct {
        const char *name, *remedy;
    } REFUSED[] = {
        {"INCLUDE", "put the lines of that file here"},
        {"NGEN", "list the nodes"},
        {"NFILL", "list the nodes"},
        {"NCOPY", "list the nodes"},
        {"NMAP", "list the nodes"},
        {"SYSTEM", "list the nodes in the global system"},
        {"ELGEN", "list the elements"},
        {"ELCOPY", "list the elements"},
    };
    const abaqus_text *place = ABAQUS_LINE(&file->text, keyword->line);
    int64_t lines;
    for (size_t i = 0; i < sizeof REFUSED / sizeof REFUSED[0]; i++)
        if (abaqus_keyword_is(keyword, REFUSED[i].name))
            return abaqus_fail(place, UZ_ERR_UNSUPPORTED, "*%s is not read; %s", REFUSED[i].name, REFUSED[i].remedy);
    file->n_parts += abaqus_keyword_is(keyword, "PART");
    file->n_instances += abaqus_keyword_is(keyword, "INSTANCE");
    if (file->n_parts > 1 || file->n_instances > 1)
        return abaqus_fail(place, UZ_ERR_UNSUPPORTED,
                           "there is a second part or instance, whose numbers are its own; write the model without "
                           "parts and assemblies");
    skip_data(&file->text, &lines);
    if (abaqus_keyword_is(keyword, "INSTANCE") && lines > 0)
        return abaqus_fail(place, UZ_ERR_UNSUPPORTED,
                           "an instance that is moved is not read; write the model without parts and assemblies");
    return UZ_OK;
}

static uz_status read_block(abaqus_file *file)
{
    abaqus_keyword keyword;
    const uz_status status = abaqus_read_keyword(&keyword, &file->text);
    if (status != UZ_OK)
        return status;
    if (abaqus_keyword_is(&keyword, "NODE"))
        return read_nodes(file, &keyword);
    if (abaqus_keyword_is(&keyword, "ELEMENT"))
        return read_elements(file, &keyword);
    if (abaqus_keyword_is(&keyword, "NSET"))
        return abaqus_read_set(file, &keyword, ABAQUS_NSET);
    if (abaqus_keyword_is(&keyword, "ELSET"))
        return abaqus_read_set(file, &keyword, ABAQUS_ELSET);
    if (abaqus_keyword_is(&keyword, "SURFACE"))
        return abaqus_read_surface(file, &keyword);
    return read_other(file, &keyword);
}

/* ---- the body */

/* The dimension of the elements that are no sides; a plane body is one with z constant. */
static uz_status choose_dim(int *dim, const abaqus_file *file)
{
    double low = INFINITY, high = -INFINITY, size = 0.0;
    *dim = 0;
    for (int64_t e = 0; e < file->elements.count; e++) {
        const abaqus_type type = abaqus_type_of(file->type[e]);
        *dim = !type.family && type.dim > *dim ? type.dim : *dim;
    }
    if (*dim == 0 && file->elements.count > 0)
        return abaqus_fail_no_body(file, 0);
    if (*dim == 0)
        return abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED,
                           "there is no element of a body; mesh a plane one with CPS, CPE or CAX elements, a solid "
                           "with C3D");
    for (int64_t e = 0; *dim == 2 && e < file->elements.count; e++)
        if (abaqus_type_of(file->type[e]).family && abaqus_type_of(file->type[e]).dim == 2)
            return abaqus_fail_no_body(file, e);
    for (int64_t q = 0; *dim == 2 && q < file->first[file->elements.count]; q++) {
        const double *x = file->xyz + 3 * abaqus_tags_find(&file->nodes, file->node[q]);
        low = fmin(low, x[2]);
        high = fmax(high, x[2]);
        size = fmax(size, fmax(fabs(x[0]), fabs(x[1])));
    }
    if (*dim == 2 && !(high - low <= 1e-9 * size))
        return abaqus_fail(&file->text, UZ_ERR_UNSUPPORTED, "the plane elements do not lie in a plane z = constant");
    return UZ_OK;
}

static uz_status check_nodes(const abaqus_file *file)
{
    for (int64_t e = 0; e < file->elements.count; e++)
        for (int64_t q = file->first[e]; q < file->first[e + 1]; q++)
            if (abaqus_tags_find(&file->nodes, file->node[q]) < 0)
                return abaqus_fail(ABAQUS_LINE(&file->text, file->line[e]), UZ_ERR_FORMAT,
                                   "element %lld has node %lld, which is not there", (long long)file->elements.tag[e],
                                   (long long)file->node[q]);
    return UZ_OK;
}

/* new_element (elements): the numbers of those of the body, -1: others. */
static uz_status add_body(uz_given_mesh *out, abaqus_file *file, int64_t *new_element)
{
    int64_t places = 0;
    for (int64_t e = 0; e < file->elements.count; e++) {
        const abaqus_type type = abaqus_type_of(file->type[e]);
        const bool body = !type.family && type.dim == out->dim;
        new_element[e] = body ? out->n_elements++ : -1;
        places += body ? type.nodes : 0;
    }
    out->n_nodes = file->nodes.count;
    out->from_file = "/mesh/abaqus";
    if (!uz_given_room(out, &file->xyz, places))
        return abaqus_no_memory(&file->text);
    for (int64_t e = 0; e < file->elements.count; e++) {
        const int64_t to = new_element[e];
        if (to < 0)
            continue;
        const uz_element_type *type = uz_element_type_of((uz_element_kind)file->type[e]);
        out->kind[to] = file->type[e];
        out->first[to + 1] = out->first[to] + type->nodes;
        for (int i = 0; i < type->nodes; i++)
            out->node[out->first[to] + i] = abaqus_tags_find(
                &file->nodes, file->node[file->first[e] + (type->abaqus_node ? type->abaqus_node[i] : i)]);
    }
    return UZ_OK;
}

static uz_status to_given(uz_given_mesh *out, abaqus_file *file, int64_t **new_element)
{
    uz_status status = abaqus_tags_sort(&file->nodes, "nodes", &file->text);
    if (status == UZ_OK)
        status = abaqus_tags_sort(&file->elements, "elements", &file->text);
    if (status == UZ_OK)
        status = check_nodes(file);
    if (status == UZ_OK)
        status = choose_dim(&out->dim, file);
    if (status == UZ_OK && !(*new_element = uz_alloc(file->elements.count, sizeof **new_element)))
        status = abaqus_no_memory(&file->text);
    if (status == UZ_OK)
        status = add_body(out, file, *new_element);
    if (status == UZ_OK)
        status = abaqus_make_groups(out, file, *new_element);
    return status;
}

/* ---- the file */

void abaqus_clear(abaqus_file *file)
{
    for (int64_t i = 0; i < file->n_sets; i++) {
        uz_free_all(file->sets[i].item, file->members ? file->members[i].index : NULL,
                    file->members ? file->members[i].face : NULL);
    }
    uz_free_all(file->members, file->sets, file->nodes.tag, file->nodes.by_tag, file->elements.tag,
                file->elements.by_tag, file->xyz, file->type, file->line, file->first, file->node);
}

uz_status abaqus_read_mesh(uz_given_mesh *out, abaqus_file *file, int64_t **new_element)
{
    uz_status status = UZ_OK;
    *new_element = NULL;
    memset(out, 0, sizeof *out);
    if (!abaqus_next_line(&file->text) || !abaqus_is_keyword(&file->text))
        status = abaqus_fail(&file->text, UZ_ERR_FORMAT, "an input file of Abaqus begins with a keyword such as *NODE");
    while (status == UZ_OK && file->text.length > 0) /* each block ends before a keyword, or with the file */
        status = read_block(file);
    return status == UZ_OK ? to_given(out, file, new_element) : status;
}

uz_status uz_abaqus_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    abaqus_file file = {.text = {.at = text, .end = text + len, .err = err}, .max_bytes = max_bytes};
    int64_t *new_element;
    uz_error_reset(err);
    const uz_status status = abaqus_read_mesh(out, &file, &new_element);
    abaqus_clear(&file);
    free(new_element);
    if (status != UZ_OK)
        uz_given_mesh_clear(out);
    return status;
}
