/* gmsh.c: a whole Gmsh file, and the mesh that it is. */
#include "io/gmsh.h"
#include "core/alloc.h"
#include "core/error.h"
#include "io/mesh_reader.h"
#include "scene/given.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- physical groups of the file as groups of the mesh
 *
 * A physical group of the body's dimension is one of elements, of one dimension less one of faces, of still less one of
 * nodes. Its name is the file's; without one "physical_7", or "physical_7_dim1" for those of lower dimension where
 * several dimensions have a nameless 7. */

typedef struct {
    gmsh_key key;
    uz_given_members members;
} physical_group;

typedef struct {
    gmsh_file *file;
    uz_given_mesh *out;
    const int64_t *new_element;
    int dim;
    physical_group *group; /* sorted by dimension and tag */
    int64_t n_groups;
} grouping;

/* In version 2.2 elements name their physical group themselves: each is a part of one group. */
static uz_status parts_of_tags(gmsh_file *file)
{
    for (int64_t e = 0; e < file->n_elements; e++) {
        const gmsh_part part = {.key = {gmsh_type_of(file->type[e]).dim, file->part_tag[e]}};
        if (part.key.tag == 0 || (file->n_parts > 0 && gmsh_compare(&part, &file->parts[file->n_parts - 1]) == 0))
            continue;
        if (!uz_grow(&file->parts, file->n_parts, 1, &file->part_room, sizeof *file->parts))
            return gmsh_no_memory(file);
        file->parts[file->n_parts++] = part;
    }
    int64_t kept = 0;
    if (file->n_parts > 1)
        qsort(file->parts, (size_t)file->n_parts, sizeof *file->parts, gmsh_compare);
    for (int64_t i = 0; i < file->n_parts; i++)
        if (i == 0 || gmsh_compare(&file->parts[i], &file->parts[kept - 1]) != 0)
            file->parts[kept++] = file->parts[i];
    file->n_parts = kept;
    free(file->physical);
    file->physical = uz_alloc(file->n_parts, sizeof *file->physical);
    if (!file->physical)
        return gmsh_no_memory(file);
    for (int64_t i = 0; i < file->n_parts; i++) {
        file->physical[i] = file->parts[i].key.tag;
        file->parts[i].first = i;
        file->parts[i].count = 1;
    }
    return UZ_OK;
}

/* The part that an element belongs to, NULL: none. *last is where the one before was. */
static gmsh_part *part_of(const gmsh_file *file, int64_t e, gmsh_part **last)
{
    const gmsh_key key = {gmsh_type_of(file->type[e]).dim, file->part_tag[e]};
    if (*last && gmsh_compare(&key, *last) == 0)
        return *last;
    if (file->n_parts == 0)
        return NULL;
    gmsh_part *found = bsearch(&key, file->parts, (size_t)file->n_parts, sizeof *file->parts, gmsh_compare);
    *last = found ? found : *last;
    return found;
}

/* All groups of parts that elements belong to. */
static uz_status list_groups(grouping *g)
{
    gmsh_file *file = g->file;
    gmsh_part *last = NULL;
    int64_t room = 0, kept = 0;
    for (int64_t e = 0; e < file->n_elements; e++) {
        gmsh_part *part = part_of(file, e, &last);
        if (part)
            part->used = true;
    }
    for (int64_t i = 0; i < file->n_parts; i++)
        for (int64_t k = 0; file->parts[i].used && k < file->parts[i].count; k++) {
            if (!uz_grow(&g->group, g->n_groups, 1, &room, sizeof *g->group))
                return gmsh_no_memory(file);
            g->group[g->n_groups++] =
                (physical_group){.key = {file->parts[i].key.dim, file->physical[file->parts[i].first + k]}};
        }
    if (g->n_groups > 1)
        qsort(g->group, (size_t)g->n_groups, sizeof *g->group, gmsh_compare);
    for (int64_t i = 0; i < g->n_groups; i++)
        if (i == 0 || gmsh_compare(&g->group[i], &g->group[kept - 1]) != 0)
            g->group[kept++] = g->group[i];
    g->n_groups = kept;
    if (kept > UZ_MESH_MAX_GROUPS)
        return gmsh_fail_at(&file->text, &file->elements_at, UZ_ERR_UNSUPPORTED,
                            "there are more than 4096 physical groups");
    return UZ_OK;
}

/* The members of all groups. */
static uz_status add_members(grouping *g)
{
    gmsh_part *last = NULL;
    for (int64_t e = 0; e < g->file->n_elements; e++) {
        const gmsh_part *part = part_of(g->file, e, &last);
        const int64_t *node = g->file->node + g->file->first[e], n = g->file->first[e + 1] - g->file->first[e];
        for (int64_t k = 0; part && k < part->count; k++) {
            const gmsh_key key = {part->key.dim, g->file->physical[part->first + k]};
            physical_group *found = bsearch(&key, g->group, (size_t)g->n_groups, sizeof *g->group, gmsh_compare);
            const uz_given_way way = part->key.dim == g->dim       ? UZ_GIVEN_ELEMENT
                                     : part->key.dim == g->dim - 1 ? UZ_GIVEN_SIDE
                                                                   : UZ_GIVEN_NODES;
            found->members.to = &g->out->groups[found - g->group];
            if (!uz_given_add(&found->members, way, g->new_element[e], node, n))
                return gmsh_no_memory(g->file);
        }
    }
    return UZ_OK;
}

static const gmsh_name *find_name(const gmsh_file *file, gmsh_key key)
{
    if (file->n_names == 0)
        return NULL;
    return bsearch(&key, file->names, (size_t)file->n_names, sizeof *file->names, gmsh_compare);
}

static void name_group(const grouping *g, int64_t i)
{
    const physical_group *from = &g->group[i];
    uz_given_group *to = &g->out->groups[i];
    const gmsh_name *found = find_name(g->file, from->key);
    bool shared = false; /* has a nameless group of higher dimension the same tag? */
    for (int dim = from->key.dim + 1; dim <= 3 && !found; dim++) {
        const gmsh_key key = {dim, from->key.tag};
        shared = shared || (!find_name(g->file, key) &&
                            bsearch(&key, g->group, (size_t)g->n_groups, sizeof *g->group, gmsh_compare));
    }
    if (found)
        memcpy(to->name, found->name, sizeof found->name);
    else if (shared)
        snprintf(to->name, 64, "physical_%lld_dim%d", (long long)from->key.tag, from->key.dim);
    else
        snprintf(to->name, 64, "physical_%lld", (long long)from->key.tag);
}

/* new_element: the number of each element of the file in the mesh, -1: it is none of its elements. */
static uz_status make_groups(uz_given_mesh *out, gmsh_file *file, int dim, const int64_t *new_element)
{
    grouping g = {.file = file, .out = out, .new_element = new_element, .dim = dim};
    uz_status status = file->version == 22 ? parts_of_tags(file) : UZ_OK;
    if (status == UZ_OK)
        status = list_groups(&g);
    if (status == UZ_OK && !(out->groups = uz_alloc_zero(g.n_groups, sizeof *out->groups)))
        status = gmsh_no_memory(file);
    if (status == UZ_OK) {
        out->n_groups = g.n_groups;
        if (file->n_names > 1)
            qsort(file->names, (size_t)file->n_names, sizeof *file->names, gmsh_compare);
        for (int64_t i = 0; i < g.n_groups; i++)
            name_group(&g, i);
        status = add_members(&g);
    }
    free(g.group);
    return status;
}

/* ---- the body */

static uz_status choose_dim(int *dim, const gmsh_file *file)
{
    *dim = 0;
    for (int64_t e = 0; e < file->n_elements; e++) {
        const int its_dim = gmsh_type_of(file->type[e]).dim;
        *dim = its_dim > *dim ? its_dim : *dim;
    }
    if (*dim < 2)
        return gmsh_fail_at(&file->text, &file->elements_at, UZ_ERR_UNSUPPORTED,
                            "there are only %s; mesh the surface of a plane body, or the volume of a solid",
                            *dim == 1 ? "lines" : "points");
    return UZ_OK;
}

/* The body's elements where all of the file stand, which is read no more. */
static uz_status move_elements(uz_given_mesh *out, gmsh_file *file, int64_t places, const int64_t *new_element)
{
    int64_t at = 0, node[UZ_ELEMENT_NODES];
    for (int64_t e = 0, done = 0; e < file->n_elements; e++) {
        if (new_element[e] < done)
            continue; /* no element of the body, or repeated */
        const uz_element_kind kind = (uz_element_kind)gmsh_kind_of(file->type[e]);
        const uz_element_type *type = uz_element_type_of(kind);
        for (int i = 0; i < type->nodes; i++)
            node[i] = file->node[file->first[e] + (type->gmsh_node ? type->gmsh_node[i] : i)];
        memcpy(file->node + at, node, (size_t)type->nodes * sizeof *node);
        at += type->nodes;
        out->kind[done++] = (unsigned char)kind;
        out->first[done] = at;
    }
    int64_t *own = uz_realloc(file->node, places, sizeof *own);
    if (!own)
        return gmsh_no_memory(file);
    file->node = NULL;
    free(out->node);
    out->node = own;
    return UZ_OK;
}

static uz_status to_given(uz_given_mesh *out, gmsh_file *file)
{
    int dim = 0;
    int64_t places = 0, *new_element = NULL;
    uz_status status = choose_dim(&dim, file);
    if (status != UZ_OK)
        return status;
    new_element = uz_alloc(file->n_elements, sizeof *new_element);
    if (!new_element)
        return gmsh_no_memory(file);
    /* The numbers of the elements of the body. Version 2.2 repeats an element for each of its physical groups. */
    for (int64_t e = 0, last = -1; e < file->n_elements; e++) {
        const int64_t count = file->first[e + 1] - file->first[e];
        new_element[e] = -1;
        if (gmsh_type_of(file->type[e]).dim != dim)
            continue;
        if (file->version == 22 && last >= 0 && file->type[last] == file->type[e] &&
            memcmp(file->node + file->first[last], file->node + file->first[e], (size_t)count * sizeof(int64_t)) == 0) {
            new_element[e] = out->n_elements - 1;
            continue;
        }
        new_element[e] = out->n_elements++;
        places += count;
        last = e;
    }
    out->dim = dim;
    out->n_nodes = file->n_nodes;
    out->from_file = "/mesh/gmsh";
    status = make_groups(out, file, dim, new_element);
    if (status == UZ_OK && !uz_given_room(out, &file->xyz, 0))
        status = gmsh_no_memory(file);
    if (status == UZ_OK)
        status = move_elements(out, file, places, new_element);
    free(new_element);
    if (status == UZ_OK && dim == 2 && !uz_given_is_flat(out, file->xyz))
        status = gmsh_fail_at(&file->text, &file->elements_at, UZ_ERR_UNSUPPORTED,
                              "there are only surfaces, and they do not lie in a plane z = constant; shells are not "
                              "modelled: mesh the volume (and save it: as a physical volume, or with Mesh.SaveAll), or "
                              "turn a plane body into the plane of x and y");
    return status;
}

/* ---- the file */

/* version file-type data-size, in a binary file followed by the integer 1 in the byte order of the file. */
static uz_status read_header(gmsh_file *file)
{
    gmsh_text *text = &file->text;
    char name[GMSH_NAME];
    double version = 0;
    int64_t binary = 0, size = 0, one = 1;
    uz_status status = gmsh_section(text, name);
    if (status == UZ_OK && strcmp(name, "MeshFormat") != 0)
        status = gmsh_fail(text, UZ_ERR_FORMAT, "a Gmsh file begins with $MeshFormat%s",
                           strcmp(name, "NOD") == 0 ? "; this is version 1, save as version 4.1" : "");
    if (status == UZ_OK)
        status = gmsh_real_text(text, &version);
    if (status == UZ_OK)
        status = gmsh_int_text(text, &binary, "the file type");
    if (status == UZ_OK)
        status = gmsh_int_text(text, &size, "the data size");
    if (status == UZ_OK && version != 2.2 && version != 4.0 && version != 4.1)
        status = gmsh_fail(
            text, UZ_ERR_UNSUPPORTED,
            "version %g of the format is not read; save as version 2.2, 4.0 or 4.1 (Mesh.MshFileVersion)", version);
    if (status == UZ_OK && binary != 0 && binary != 1)
        status =
            gmsh_fail(text, UZ_ERR_FORMAT, "the file type is %lld; it is 0 (ASCII) or 1 (binary)", (long long)binary);
    if (status == UZ_OK && size != 8)
        status =
            gmsh_fail(text, UZ_ERR_UNSUPPORTED, "numbers of %lld bytes are not read; only those of 8", (long long)size);
    file->version = version == 2.2 ? 22 : version == 4.0 ? 40 : 41;
    if (status == UZ_OK)
        status = gmsh_end_line(text);
    if (status != UZ_OK)
        return status;
    text->binary = binary == 1;
    if (text->binary)
        status = gmsh_int(text, &one, "the number 1");
    if (status == UZ_OK && one != 1)
        return gmsh_fail(text, UZ_ERR_UNSUPPORTED, "the bytes of numbers are in the other order; save as ASCII");
    return status == UZ_OK ? gmsh_section_end(text, "MeshFormat") : status;
}

uz_status uz_gmsh_read(uz_given_mesh *out, const char *text, size_t len, size_t max_bytes, uz_error *err)
{
    gmsh_file file = {.text = {text, text, text + len, 1, false, err}, .max_bytes = max_bytes};
    char name[GMSH_NAME];
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status = read_header(&file);
    while (status == UZ_OK) {
        status = gmsh_section(&file.text, name);
        if (status != UZ_OK || !name[0])
            break;
        if (strcmp(name, "PhysicalNames") == 0)
            status = gmsh_read_names(&file);
        else if (strcmp(name, "Nodes") == 0)
            status = gmsh_read_nodes(&file);
        else if (strcmp(name, "Elements") == 0)
            status = gmsh_read_elements(&file);
        else if (file.version >= 40 && strcmp(name, "Entities") == 0)
            status = gmsh_read_entities(&file, false);
        else if (file.version == 40 && strcmp(name, "PartitionedEntities") == 0)
            status = gmsh_fail(&file.text, UZ_ERR_UNSUPPORTED,
                               "partitions of version 4.0 are not read: save as version 4.1");
        else if (file.version == 41 && strcmp(name, "PartitionedEntities") == 0)
            status = gmsh_read_entities(&file, true);
        else {
            status = gmsh_skip_section(&file.text, name);
            continue;
        }
        if (status == UZ_OK)
            status = gmsh_section_end(&file.text, name);
    }
    if (status == UZ_OK && !file.tag)
        status = gmsh_fail(&file.text, UZ_ERR_FORMAT, "the file has no $Nodes");
    if (status == UZ_OK && file.n_elements == 0)
        status = gmsh_fail(&file.text, UZ_ERR_FORMAT, "the file has no elements; mesh it in Gmsh before saving it");
    if (status == UZ_OK)
        status = to_given(out, &file);
    if (status != UZ_OK)
        uz_given_mesh_clear(out);
    uz_free_all(file.xyz, file.tag, file.by_tag, file.type, file.part_tag, file.first, file.node, file.parts,
                file.physical, file.names);
    return status;
}
