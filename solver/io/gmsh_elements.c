/* gmsh_elements.c: the elements of a Gmsh file, of all dimensions. */
#include "io/gmsh.h"

#include "core/alloc.h"

#define LOWER       "set Mesh.ElementOrder = 1 or 2"
#define SERENDIPITY "set Mesh.SecondOrderIncomplete = 1 for quadrilaterals of 8 nodes, or Mesh.ElementOrder = 1 for 4"
#define INCOMPLETE                                                                                                     \
    "set Mesh.SecondOrderIncomplete = 1 for hexahedra of 20 nodes and wedges of 15, or Mesh.ElementOrder = 1"
#define NO_PYRAMIDS "mesh the body with tetrahedra, hexahedra or wedges"

/* Indexed by Gmsh's numbers of its types. */
static const gmsh_type TYPES[] = {
    [1] = {1, 2, "2-node line", NULL},
    [2] = {2, 3, "3-node triangle", NULL},
    [3] = {2, 4, "4-node quadrilateral", NULL},
    [4] = {3, 4, "4-node tetrahedron", NULL},
    [5] = {3, 8, "8-node hexahedron", NULL},
    [6] = {3, 6, "6-node prism", NULL},
    [7] = {3, 5, "5-node pyramid", NO_PYRAMIDS},
    [8] = {1, 3, "3-node line", NULL},
    [9] = {2, 6, "6-node triangle", NULL},
    [10] = {2, 9, "9-node quadrilateral", SERENDIPITY},
    [11] = {3, 10, "10-node tetrahedron", NULL},
    [12] = {3, 27, "27-node hexahedron", INCOMPLETE},
    [13] = {3, 18, "18-node prism", INCOMPLETE},
    [14] = {3, 14, "14-node pyramid", NO_PYRAMIDS},
    [15] = {0, 1, "point", NULL},
    [16] = {2, 8, "8-node quadrilateral", NULL},
    [17] = {3, 20, "20-node hexahedron", NULL},
    [18] = {3, 15, "15-node prism", NULL},
    [19] = {3, 13, "13-node pyramid", NO_PYRAMIDS},
    [20] = {2, 9, "9-node triangle", LOWER},
    [21] = {2, 10, "10-node triangle", LOWER},
    [22] = {2, 12, "12-node triangle", LOWER},
    [23] = {2, 15, "15-node triangle", LOWER},
    [24] = {2, 15, "15-node triangle", LOWER},
    [25] = {2, 21, "21-node triangle", LOWER},
    [26] = {1, 4, "4-node line", LOWER},
    [27] = {1, 5, "5-node line", LOWER},
    [28] = {1, 6, "6-node line", LOWER},
    [29] = {3, 20, "20-node tetrahedron", LOWER},
    [30] = {3, 35, "35-node tetrahedron", LOWER},
    [31] = {3, 56, "56-node tetrahedron", LOWER},
};

gmsh_type gmsh_type_of(int64_t type)
{
    const int64_t count = sizeof TYPES / sizeof TYPES[0];
    return type > 0 && type < count ? TYPES[type] : (gmsh_type){0, 0, NULL, NULL};
}

int gmsh_kind_of(int64_t type)
{
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        if (uz_element_types[k]->gmsh == type)
            return k;
    return -1;
}

static uz_status check_type(const gmsh_file *file, int64_t number)
{
    const gmsh_type type = gmsh_type_of(number);
    if (type.nodes == 0)
        return gmsh_fail(&file->text, UZ_ERR_UNSUPPORTED,
                         "elements of Gmsh's type %lld are not read; use triangles, quadrilaterals, tetrahedra, "
                         "hexahedra or wedges of order 1 or 2",
                         (long long)number);
    if (type.remedy && gmsh_kind_of(number) < 0)
        return gmsh_fail(&file->text, UZ_ERR_UNSUPPORTED, "a %s (Gmsh's type %lld) is not read; %s", type.name,
                         (long long)number, type.remedy);
    return UZ_OK;
}

/* Makes room for so many elements, and for `places` more nodes of elements. */
static uz_status make_room(gmsh_file *file, int64_t elements, int64_t places)
{
    const int64_t have = file->n_elements > 0 ? file->first[file->n_elements] : 0;
    if (file->n_elements + elements > file->element_room) {
        const int64_t room = file->n_elements + elements;
        unsigned char *type = uz_realloc(file->type, room, sizeof *type);
        file->type = type ? type : file->type;
        int64_t *part = uz_realloc(file->part_tag, room, sizeof *part);
        file->part_tag = part ? part : file->part_tag;
        int64_t *first = uz_realloc(file->first, room + 1, sizeof *first);
        file->first = first ? first : file->first;
        if (!type || !part || !first)
            return gmsh_no_memory(file);
        file->first[0] = 0;
        file->element_room = room;
    }
    if (have + places > file->place_room) {
        const int64_t room = 2 * file->place_room + places + 64;
        int64_t *node = uz_realloc(file->node, room, sizeof *node);
        if (!node)
            return gmsh_no_memory(file);
        file->node = node;
        file->place_room = room;
    }
    const uint64_t bytes = (uint64_t)file->element_room * 17 + (uint64_t)file->place_room * 8;
    if (file->max_bytes > 0 && bytes > file->max_bytes)
        return gmsh_fail(&file->text, UZ_ERR_LIMIT, "the mesh needs more memory than is allowed");
    return UZ_OK;
}

/* The nodes of one element, for which there is room. */
static uz_status read_element_nodes(gmsh_file *file, int64_t type, int64_t part_tag)
{
    gmsh_text *text = &file->text;
    const int count = gmsh_type_of(type).nodes;
    int64_t *node = file->node + file->first[file->n_elements], tag = 0;
    for (int i = 0; i < count; i++) {
        const gmsh_text before = *text;
        const uz_status status = file->version != 41 ? gmsh_int(text, &tag, "the number of a node")
                                                     : gmsh_size(text, &tag, "the number of a node");
        if (status != UZ_OK)
            return status;
        node[i] = gmsh_find_node(file, tag);
        if (node[i] < 0)
            return gmsh_fail_at(text, &before, UZ_ERR_FORMAT, "an element has node %lld, which $Nodes has not",
                                (long long)tag);
    }
    file->type[file->n_elements] = (unsigned char)type;
    file->part_tag[file->n_elements] = part_tag;
    file->first[file->n_elements + 1] = file->first[file->n_elements] + count;
    file->n_elements++;
    return UZ_OK;
}

/* A line: number type numTags tags... nodes... In binary files a block: type numElements numTags, then for each of them
 * number tags... nodes... The physical tag is the first of the tags. */
static uz_status read_block_2(gmsh_file *file, int64_t count)
{
    gmsh_text *text = &file->text;
    int64_t number = 0, type = 0, n = 1, tags = 0;
    uz_status status = UZ_OK;
    if (!text->binary)
        status = gmsh_int(text, &number, "the number of an element");
    if (status == UZ_OK)
        status = gmsh_int(text, &type, text->binary ? "the type of a block of elements" : "the type of an element");
    if (status == UZ_OK)
        status = check_type(file, type);
    if (status == UZ_OK && text->binary)
        status = gmsh_int(text, &n, "the number of elements of a block");
    if (status == UZ_OK)
        status = gmsh_int(text, &tags, "the number of tags of an element");
    if (status == UZ_OK && (n < 1 || n > count - file->n_elements))
        status = gmsh_fail(text, UZ_ERR_FORMAT, "a block has %lld elements, but %lld are missing", (long long)n,
                           (long long)(count - file->n_elements));
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        int64_t physical = 0, tag = 0;
        if (text->binary)
            status = gmsh_int(text, &number, "the number of an element");
        for (int64_t k = 0; k < tags && status == UZ_OK; k++) {
            status = gmsh_int(text, &tag, "a tag of an element");
            if (k == 0)
                physical = tag < 0 ? -tag : tag;
        }
        if (status == UZ_OK)
            status = make_room(file, 0, gmsh_type_of(type).nodes);
        if (status == UZ_OK)
            status = read_element_nodes(file, type, physical);
    }
    return status;
}

/* entityDim entityTag (in 4.0 the other way round) type numElements, then for each of them: number nodes... */
static uz_status read_block_4(gmsh_file *file, int64_t count)
{
    gmsh_text *text = &file->text;
    int64_t dim = 0, entity = 0, type = 0, n = 0, number = 0;
    const bool early = file->version == 40;
    uz_status status = gmsh_int(text, early ? &entity : &dim, "the head of a block of elements");
    if (status == UZ_OK)
        status = gmsh_int(text, early ? &dim : &entity, "the head of a block of elements");
    if (status == UZ_OK)
        status = gmsh_int(text, &type, "the type of a block of elements");
    if (status == UZ_OK)
        status = gmsh_size(text, &n, "the number of elements of a block");
    if (status == UZ_OK && n > 0)
        status = check_type(file, type);
    if (status == UZ_OK && n > 0 && dim != gmsh_type_of(type).dim)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "a block of a %s says that its dimension is %lld",
                           gmsh_type_of(type).name, (long long)dim);
    if (status == UZ_OK && n > count - file->n_elements)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "more elements than are announced");
    if (status == UZ_OK && n > 0)
        status =
            gmsh_count(text, n, (size_t)gmsh_type_of(type).nodes * (text->binary ? (early ? 4 : 8) : 2), "elements");
    if (status == UZ_OK && n > 0)
        status = make_room(file, 0, n * gmsh_type_of(type).nodes);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        status = early ? gmsh_int(text, &number, "the number of an element")
                       : gmsh_size(text, &number, "the number of an element");
        if (status == UZ_OK)
            status = read_element_nodes(file, type, entity);
    }
    return status;
}

uz_status gmsh_read_elements(gmsh_file *file)
{
    static const char *const WHAT[] = {"the number of blocks of elements", "the number of elements",
                                       "the number of an element"};
    gmsh_text *text = &file->text;
    int64_t blocks = 0, count = 0;
    if (!file->tag)
        return gmsh_fail(text, UZ_ERR_FORMAT, "$Elements before $Nodes");
    if (file->first)
        return gmsh_fail(text, UZ_ERR_FORMAT, "a second $Elements");
    file->elements_at = *text;
    const bool old = file->version == 22;
    uz_status status =
        old ? gmsh_int_text(text, &count, WHAT[1]) : gmsh_head_4(text, file->version, &blocks, &count, WHAT);
    if (status == UZ_OK && old)
        status = gmsh_end_line(text);
    if (status == UZ_OK) /* at least "1 15 0 1"; a number and a node; 1 1 */
        status = gmsh_count(text, count, old ? 8 : text->binary ? (file->version == 40 ? 8 : 16) : 3, "elements");
    if (status == UZ_OK)
        status = make_room(file, count, 0);
    while (old && file->n_elements < count && status == UZ_OK)
        status = read_block_2(file, count);
    for (int64_t b = 0; b < blocks && status == UZ_OK; b++)
        status = read_block_4(file, count);
    if (status == UZ_OK && file->n_elements < count)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "%lld elements are announced, but there are %lld", (long long)count,
                           (long long)file->n_elements);
    return status;
}
