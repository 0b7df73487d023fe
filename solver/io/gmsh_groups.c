/* gmsh_groups.c: physical groups of a Gmsh file as groups of a mesh.
 *
 * A physical group of the body's dimension is one of elements, of one dimension less one of faces, of still less one of
 * nodes. Its name is the file's; without one "physical_7", or "physical_7_dim1" for those of lower dimension where
 * several dimensions have a nameless 7. */
#include "io/gmsh.h"

#include "core/alloc.h"
#include "scene/given.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A physical group, and how much of the mesh it has. */
typedef struct {
    int dim;
    int64_t tag;
    int64_t items, nodes; /* elements or faces, and the nodes of faces */
} physical_group;

typedef struct {
    gmsh_file *file;
    uz_given_mesh *out;
    const int64_t *new_element;
    int dim;
    physical_group *group; /* sorted by dimension and tag */
    int64_t n_groups;
} grouping;

static int compare_groups(const void *a, const void *b)
{
    const physical_group *x = a, *y = b;
    return gmsh_compare_keys(x->dim, x->tag, y->dim, y->tag);
}

/* ---- parts */

/* In version 2.2 elements name their physical group themselves: each is a part of one group. */
static uz_status parts_of_tags(gmsh_file *file)
{
    for (int64_t e = 0; e < file->n_elements; e++) {
        const gmsh_part part = {.dim = gmsh_type_of(file->type[e]).dim, .tag = file->part_tag[e]};
        if (part.tag == 0 || (file->n_parts > 0 && gmsh_compare_parts(&part, &file->parts[file->n_parts - 1]) == 0))
            continue;
        if (!gmsh_grow((void **)&file->parts, file->n_parts, &file->part_room, sizeof *file->parts))
            return gmsh_no_memory(file);
        file->parts[file->n_parts++] = part;
    }
    int64_t kept = 0;
    if (file->n_parts > 1)
        qsort(file->parts, (size_t)file->n_parts, sizeof *file->parts, gmsh_compare_parts);
    for (int64_t i = 0; i < file->n_parts; i++)
        if (i == 0 || gmsh_compare_parts(&file->parts[i], &file->parts[kept - 1]) != 0)
            file->parts[kept++] = file->parts[i];
    file->n_parts = kept;
    free(file->physical);
    file->physical = uz_alloc(file->n_parts, sizeof *file->physical);
    if (!file->physical)
        return gmsh_no_memory(file);
    for (int64_t i = 0; i < file->n_parts; i++) {
        file->physical[i] = file->parts[i].tag;
        file->parts[i].first = i;
        file->parts[i].count = 1;
    }
    return UZ_OK;
}

/* The part that an element belongs to, NULL: none. *last is where the one before was. */
static gmsh_part *part_of(const gmsh_file *file, int64_t e, gmsh_part **last)
{
    const gmsh_part key = {.dim = gmsh_type_of(file->type[e]).dim, .tag = file->part_tag[e]};
    if (*last && gmsh_compare_parts(&key, *last) == 0)
        return *last;
    if (file->n_parts == 0)
        return NULL;
    gmsh_part *found = bsearch(&key, file->parts, (size_t)file->n_parts, sizeof key, gmsh_compare_parts);
    *last = found ? found : *last;
    return found;
}

/* ---- groups */

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
            if (!gmsh_grow((void **)&g->group, g->n_groups, &room, sizeof *g->group))
                return gmsh_no_memory(file);
            g->group[g->n_groups++] =
                (physical_group){file->parts[i].dim, file->physical[file->parts[i].first + k], 0, 0};
        }
    if (g->n_groups > 1)
        qsort(g->group, (size_t)g->n_groups, sizeof *g->group, compare_groups);
    for (int64_t i = 0; i < g->n_groups; i++)
        if (i == 0 || compare_groups(&g->group[i], &g->group[kept - 1]) != 0)
            g->group[kept++] = g->group[i];
    g->n_groups = kept;
    if (kept > UZ_MESH_MAX_GROUPS)
        return gmsh_fail_at(&file->text, &file->elements_at, UZ_ERR_UNSUPPORTED,
                            "there are more than 4096 physical groups");
    return UZ_OK;
}

/* Goes through the members of all groups: counts them, or adds them. */
static void walk_members(grouping *g, bool add)
{
    gmsh_part *last = NULL;
    for (int64_t e = 0; e < g->file->n_elements; e++) {
        const gmsh_part *part = part_of(g->file, e, &last);
        const int64_t *node = g->file->node + g->file->first[e], n = g->file->first[e + 1] - g->file->first[e];
        for (int64_t k = 0; part && k < part->count; k++) {
            const physical_group key = {part->dim, g->file->physical[part->first + k], 0, 0};
            physical_group *found = bsearch(&key, g->group, (size_t)g->n_groups, sizeof key, compare_groups);
            uz_given_group *to = &g->out->groups[found - g->group];
            if (!add) {
                found->items++;
                found->nodes += n;
            } else if (part->dim == g->dim) {
                to->element[to->n_elements++] = g->new_element[e];
            } else if (part->dim == g->dim - 1) {
                memcpy(to->face_node + to->face_first[to->n_faces], node, (size_t)n * sizeof *node);
                to->n_faces++;
                to->face_first[to->n_faces] = to->face_first[to->n_faces - 1] + n;
            } else {
                memcpy(to->node + to->n_nodes, node, (size_t)n * sizeof *node);
                to->n_nodes += n;
            }
        }
    }
}

/* ---- names */

/* Names by dimension and tag, for many groups. */
static int compare_names(const void *a, const void *b)
{
    const gmsh_name *x = a, *y = b;
    return gmsh_compare_keys(x->dim, x->tag, y->dim, y->tag);
}

static const gmsh_name *find_name(const gmsh_file *file, int dim, int64_t tag)
{
    const gmsh_name key = {dim, tag, ""};
    if (file->n_names == 0)
        return NULL;
    return bsearch(&key, file->names, (size_t)file->n_names, sizeof key, compare_names);
}

static uz_status make_group(const grouping *g, int64_t i)
{
    const physical_group *from = &g->group[i];
    uz_given_group *to = &g->out->groups[i];
    const gmsh_name *found = find_name(g->file, from->dim, from->tag);
    bool good, shared = false; /* has a nameless group of higher dimension the same tag? */
    for (int dim = from->dim + 1; dim <= 3 && !found; dim++) {
        const physical_group key = {dim, from->tag, 0, 0};
        shared = shared || (!find_name(g->file, dim, key.tag) &&
                            bsearch(&key, g->group, (size_t)g->n_groups, sizeof key, compare_groups));
    }
    if (found)
        memcpy(to->name, found->name, sizeof found->name);
    else if (shared)
        snprintf(to->name, 64, "physical_%lld_dim%d", (long long)from->tag, from->dim);
    else
        snprintf(to->name, 64, "physical_%lld", (long long)from->tag);
    if (from->dim == g->dim) {
        good = (to->element = uz_alloc(from->items, sizeof *to->element)) != NULL;
    } else if (from->dim == g->dim - 1) {
        to->face_first = uz_alloc(from->items + 1, sizeof *to->face_first);
        to->face_node = uz_alloc(from->nodes, sizeof *to->face_node);
        good = to->face_first && to->face_node;
        if (good)
            to->face_first[0] = 0;
    } else {
        good = (to->node = uz_alloc(from->nodes, sizeof *to->node)) != NULL;
    }
    return good ? UZ_OK : gmsh_no_memory(g->file);
}

uz_status gmsh_make_groups(uz_given_mesh *out, gmsh_file *file, int dim, const int64_t *new_element)
{
    grouping g = {.file = file, .out = out, .new_element = new_element, .dim = dim};
    uz_status status = file->version == 22 ? parts_of_tags(file) : UZ_OK;
    if (status == UZ_OK)
        status = list_groups(&g);
    if (status == UZ_OK && !(out->groups = uz_alloc_zero(g.n_groups, sizeof *out->groups)))
        status = gmsh_no_memory(file);
    if (status == UZ_OK) {
        out->n_groups = g.n_groups;
        walk_members(&g, false);
        if (file->n_names > 1)
            qsort(file->names, (size_t)file->n_names, sizeof *file->names, compare_names);
    }
    for (int64_t i = 0; i < g.n_groups && status == UZ_OK; i++)
        status = make_group(&g, i);
    if (status == UZ_OK)
        walk_members(&g, true);
    free(g.group);
    return status;
}
