/* gmsh_read.c: the sections of a Gmsh file. */
#include "io/gmsh.h"

#include "core/alloc.h"
#include "core/order.h"

#include <stdlib.h>
#include <string.h>

uz_status gmsh_no_memory(const gmsh_file *file)
{
    return gmsh_fail(&file->text, UZ_ERR_MEMORY, "no memory for the mesh");
}

/* ---- names of physical groups: text also in binary files */

uz_status gmsh_read_names(gmsh_file *file)
{
    int64_t count = 0, dim = 0;
    uz_status status = gmsh_int_text(&file->text, &count, "the number of physical names");
    if (status == UZ_OK && file->names)
        status = gmsh_fail(&file->text, UZ_ERR_FORMAT, "a second $PhysicalNames");
    if (status == UZ_OK)
        status = gmsh_count(&file->text, count, 7, "physical names"); /* 0 1 "a" */
    if (status != UZ_OK)
        return status;
    file->names = uz_alloc_zero(count, sizeof *file->names);
    if (!file->names)
        return gmsh_no_memory(file);
    for (int64_t i = 0; i < count && status == UZ_OK; i++) {
        gmsh_name *name = &file->names[i];
        status = gmsh_int_text(&file->text, &dim, "the dimension of a physical group");
        if (status == UZ_OK && (dim < 0 || dim > 3))
            status = gmsh_fail(&file->text, UZ_ERR_FORMAT, "a physical group has no dimension %lld", (long long)dim);
        name->key.dim = (int)dim;
        if (status == UZ_OK)
            status = gmsh_int_text(&file->text, &name->key.tag, "the number of a physical group");
        if (status == UZ_OK)
            status = gmsh_quoted(&file->text, name->name);
    }
    file->n_names = status == UZ_OK ? count : 0;
    return status;
}

/* ---- entities (4.0, 4.1) */

static uz_status skip_ints(gmsh_text *text, int64_t count)
{
    int64_t value;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < count && status == UZ_OK; i++)
        status = gmsh_int(text, &value, "a number");
    return status;
}

/* tag [partition] box (in 4.1 a point for points) physical groups [bounding entities], a partition being
 * parentDim parentTag numPartitions partitionTag... */
static uz_status read_entity(gmsh_file *file, int dim, bool partitioned)
{
    gmsh_text *text = &file->text;
    gmsh_part part = {.key = {.dim = dim}};
    int64_t count = 0, partitions = 0, groups = 0, tag = 0;
    uz_status status = gmsh_int(text, &part.key.tag, "the number of an entity");
    if (status == UZ_OK && partitioned)
        status = skip_ints(text, 2);
    if (status == UZ_OK && partitioned)
        status = gmsh_size(text, &partitions, "the number of partitions of an entity");
    if (status == UZ_OK)
        status = skip_ints(text, partitions);
    if (status == UZ_OK)
        status = gmsh_reals(text, dim == 0 && file->version == 41 ? 3 : 6, NULL);
    if (status == UZ_OK)
        status = gmsh_size(text, &groups, "the number of physical groups of an entity");
    if (status == UZ_OK)
        status = gmsh_count(text, groups, text->binary ? 4 : 2, "physical groups");
    part.first = file->n_physical;
    for (; part.count < groups && status == UZ_OK; part.count += status == UZ_OK) {
        status = gmsh_int(text, &tag, "the number of a physical group");
        if (status == UZ_OK &&
            !uz_grow(&file->physical, file->n_physical, 1, &file->physical_room, sizeof *file->physical))
            status = gmsh_no_memory(file);
        if (status == UZ_OK) /* a negative one asks for the opposite sense, which groups have not */
            file->physical[file->n_physical++] = tag < 0 ? -tag : tag;
    }
    if (status == UZ_OK && dim > 0)
        status = gmsh_size(text, &count, "the number of bounding entities");
    if (status == UZ_OK)
        status = skip_ints(text, count);
    if (status != UZ_OK)
        return status;
    if (!uz_grow(&file->parts, file->n_parts, 1, &file->part_room, sizeof *file->parts))
        return gmsh_no_memory(file);
    file->parts[file->n_parts++] = part;
    return UZ_OK;
}

int gmsh_compare(const void *a, const void *b)
{
    const gmsh_key *x = a, *y = b;
    if (x->dim != y->dim)
        return x->dim < y->dim ? -1 : 1;
    return (x->tag > y->tag) - (x->tag < y->tag);
}

/* [numPartitions numGhosts (tag partition)...] entities. Elements of a partitioned mesh name partitioned entities,
 * which have the physical groups of their parents. */
uz_status gmsh_read_entities(gmsh_file *file, bool partitioned)
{
    gmsh_text *text = &file->text;
    int64_t count[4] = {0}, partitions = 0, ghosts = 0;
    uz_status status = UZ_OK;
    if (file->n_elements > 0 || (!partitioned && file->entities_read))
        return gmsh_fail(&file->text, UZ_ERR_FORMAT, "entities a second time, or after $Elements");
    if (partitioned)
        status = gmsh_size(text, &partitions, "the number of partitions");
    if (status == UZ_OK && partitioned)
        status = gmsh_size(text, &ghosts, "the number of ghost entities");
    if (status == UZ_OK && partitioned)
        status = gmsh_count(text, ghosts, text->binary ? 8 : 4, "ghost entities");
    if (status == UZ_OK)
        status = skip_ints(text, 2 * ghosts);
    for (int dim = 0; dim < 4 && status == UZ_OK; dim++)
        status = gmsh_size(&file->text, &count[dim], "a number of entities");
    if (partitioned)
        file->n_parts = file->n_physical = 0; /* numbered anew, instead of the others */
    for (int dim = 0; dim < 4 && status == UZ_OK; dim++) {
        status = gmsh_count(&file->text, count[dim], file->text.binary ? 36 : 8, "entities");
        for (int64_t i = 0; i < count[dim] && status == UZ_OK; i++)
            status = read_entity(file, dim, partitioned);
    }
    if (status == UZ_OK && file->n_parts > 1)
        qsort(file->parts, (size_t)file->n_parts, sizeof *file->parts, gmsh_compare);
    file->entities_read = true;
    return status;
}

/* ---- nodes */

#define TWICE "$Nodes has two nodes with the number %lld"

/* Prepares gmsh_find_node. */
static uz_status list_tags(gmsh_file *file)
{
    int64_t low = INT64_MAX, high = -1;
    for (int64_t i = 0; i < file->n_nodes; i++) {
        if (file->tag[i] < 0)
            return gmsh_fail(&file->text, UZ_ERR_FORMAT, "$Nodes has a node with the number %lld",
                             (long long)file->tag[i]);
        low = file->tag[i] < low ? file->tag[i] : low;
        high = file->tag[i] > high ? file->tag[i] : high;
    }
    file->low_tag = file->n_nodes > 0 ? low : 0;
    if (file->n_nodes == 0 || high - low < 2 * file->n_nodes + 1024) {
        /* Tags with few gaps: a table over their range. */
        int64_t range = file->n_nodes > 0 ? high - low + 1 : 0;
        file->by_tag = uz_alloc(range, sizeof *file->by_tag);
        if (!file->by_tag)
            return gmsh_no_memory(file);
        file->dense = true;
        file->n_by_tag = range;
        memset(file->by_tag, 0xff, (size_t)range * sizeof *file->by_tag);
        for (int64_t i = 0; i < file->n_nodes; i++) {
            int64_t *at = &file->by_tag[file->tag[i] - file->low_tag];
            if (*at >= 0)
                return gmsh_fail(&file->text, UZ_ERR_FORMAT, TWICE, (long long)file->tag[i]);
            *at = i;
        }
        return UZ_OK;
    }
    /* Other tags: the nodes in the order of their tags. */
    file->by_tag = uz_order_of(file->tag, file->n_nodes);
    if (!file->by_tag)
        return gmsh_no_memory(file);
    for (int64_t i = 1; i < file->n_nodes; i++) {
        const int64_t tag = file->tag[file->by_tag[i]];
        if (tag == file->tag[file->by_tag[i - 1]])
            return gmsh_fail(&file->text, UZ_ERR_FORMAT, TWICE, (long long)tag);
    }
    return UZ_OK;
}

uz_status gmsh_read_nodes(gmsh_file *file)
{
    static const char *const WHAT[] = {"the number of blocks of nodes", "the number of nodes", "the number of a node"};
    gmsh_text *text = &file->text;
    const bool old = file->version == 22;
    int64_t blocks = 0, count = 0;
    uz_status status =
        old ? gmsh_int_text(text, &count, WHAT[1]) : gmsh_head_4(text, file->version, &blocks, &count, WHAT);
    if (status == UZ_OK && old)
        status = gmsh_end_line(text);
    if (status == UZ_OK && file->tag)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "a second $Nodes");
    if (status == UZ_OK)
        status = gmsh_count(text, count, text->binary ? 28 : 7, "nodes"); /* 1 0 0 0 */
    if (status == UZ_OK && file->max_bytes > 0 && (uint64_t)count > file->max_bytes / (8 * sizeof(double)))
        status = gmsh_fail(text, UZ_ERR_LIMIT, "the mesh needs more memory than is allowed");
    if (status != UZ_OK)
        return status;
    file->xyz = uz_alloc(3 * count, sizeof *file->xyz);
    file->tag = uz_alloc(count, sizeof *file->tag);
    if (!file->xyz || !file->tag)
        return gmsh_no_memory(file);
    for (; old && file->n_nodes < count && status == UZ_OK; file->n_nodes += status == UZ_OK) {
        status = gmsh_int(text, &file->tag[file->n_nodes], WHAT[2]);
        if (status == UZ_OK)
            status = gmsh_reals(text, 3, file->xyz + 3 * file->n_nodes);
    }
    for (int64_t b = 0; b < blocks && status == UZ_OK; b++) {
        /* entityDim entityTag parametric numNodes, the tags of all, the coordinates of all; in 4.0 the first two
         * the other way round, and each tag before its coordinates. */
        int64_t head[3] = {0}, n = 0;
        for (int i = 0; i < 3 && status == UZ_OK; i++)
            status = gmsh_int(text, &head[i], "the head of a block of nodes");
        if (status == UZ_OK)
            status = gmsh_size(text, &n, "the number of nodes of a block");
        if (status == UZ_OK && n > count - file->n_nodes)
            status = gmsh_fail(text, UZ_ERR_FORMAT, "more nodes than are announced");
        if (status == UZ_OK && file->version == 41 && (head[0] < 0 || head[0] > 3))
            status = gmsh_fail(text, UZ_ERR_FORMAT, "a block of nodes has no such dimension");
        if (status == UZ_OK && file->version == 40 && head[2])
            status = gmsh_fail(text, UZ_ERR_UNSUPPORTED,
                               "parametric nodes of version 4.0 are not read: save without (Mesh.SaveParametric)");
        for (int64_t i = 0; i < n && file->version == 40 && status == UZ_OK; i++) {
            status = gmsh_int(text, &file->tag[file->n_nodes + i], WHAT[2]);
            if (status == UZ_OK)
                status = gmsh_reals(text, 3, file->xyz + 3 * (file->n_nodes + i));
        }
        for (int64_t i = 0; i < n && file->version == 41 && status == UZ_OK; i++)
            status = gmsh_size(text, &file->tag[file->n_nodes + i], WHAT[2]);
        for (int64_t i = 0; i < n && file->version == 41 && status == UZ_OK; i++) {
            status = gmsh_reals(text, 3, file->xyz + 3 * (file->n_nodes + i));
            if (status == UZ_OK && head[2])
                status = gmsh_reals(text, (int)head[0], NULL);
        }
        file->n_nodes += status == UZ_OK ? n : 0;
    }
    if (status == UZ_OK && file->n_nodes < count)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "%lld nodes are announced, but there are %lld", (long long)count,
                           (long long)file->n_nodes);
    return status == UZ_OK ? list_tags(file) : status;
}

int64_t gmsh_find_node(const gmsh_file *file, int64_t tag)
{
    if (file->dense)
        return tag >= file->low_tag && tag - file->low_tag < file->n_by_tag ? file->by_tag[tag - file->low_tag] : -1;
    const int64_t place = uz_order_seek(file->tag, file->by_tag, file->n_nodes, tag);
    const int64_t index = place < file->n_nodes ? file->by_tag[place] : -1;
    return index >= 0 && file->tag[index] == tag ? index : -1;
}
