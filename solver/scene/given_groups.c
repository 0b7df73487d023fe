/* given_groups.c: named parts of a given mesh, and the two that every mesh has: "all" and "boundary". */
#include "scene/given.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "scene/corner_table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Numbers from 0 on, each of which is in it or not: a group of elements names the nodes of all of them, each many
 * times. */
typedef struct {
    uint64_t *word;
    int64_t first, end, count; /* words that may have some; numbers that are in it */
} number_set;

/* What the groups are made from. */
typedef struct {
    uz_mesh *mesh;
    const uz_given_mesh *given;
    const int64_t *new_node;
    uz_corner_table sides;
    number_set nodes, elements; /* of the name at hand; empty between names */
    uz_error *err;
} group_work;

/* A growing list of numbers. */
typedef struct {
    int64_t *value, count, room;
} number_list;

#define GROUPS "the groups of a mesh"

static bool append(number_list *list, int64_t value)
{
    if (!uz_grow(&list->value, list->count, 1, &list->room, sizeof *list->value))
        return false;
    list->value[list->count++] = value;
    return true;
}

static void put_in(number_set *set, int64_t number)
{
    const int64_t at = number / 64;
    const uint64_t bit = (uint64_t)1 << number % 64;
    if (set->count == 0)
        set->first = set->end = at;
    set->count += (set->word[at] & bit) == 0;
    set->word[at] |= bit;
    set->first = at < set->first ? at : set->first;
    set->end = at >= set->end ? at + 1 : set->end;
}

/* Empties it. The numbers, ascending; NULL: no memory. */
static int64_t *take_out(number_set *set, int64_t *count)
{
    int64_t *number = uz_alloc(set->count, sizeof *number), found = 0;
    for (int64_t at = set->first; at < set->end; at++) {
        for (uint64_t left = number ? set->word[at] : 0; left; left &= left - 1)
            number[found++] = 64 * at + __builtin_ctzll(left);
        set->word[at] = 0;
    }
    *count = found;
    set->first = set->end = set->count = 0;
    return number;
}

/* The sides that are given under one name; nodes and elements are in sets. */
typedef struct {
    number_list faces; /* element * UZ_SIDE_STEP + side */
    int64_t n_inner;
} named_parts;

enum { UZ_SIDE_STEP = 8 };

/* ---- where a group is in the request */

/* "/mesh/groups/NAME/key/i", the name escaped as RFC 6901 asks. */
static void group_place(char where[UZ_POINTER], const uz_given_mesh *given, const uz_given_group *group,
                        const char *key, int64_t i)
{
    enum { LONGEST = 44 };
    char name[2 * sizeof group->name] = "";
    size_t used = 0;
    for (size_t k = 0; k < sizeof group->name && group->name[k]; k++) {
        const char c = group->name[k];
        used += (size_t)snprintf(name + used, sizeof name - used, c == '~' ? "~0" : c == '/' ? "~1" : "%c", c);
    }
    for (used = used > LONGEST ? LONGEST : used; used > 0 && ((unsigned char)name[used] & 0xc0) == 0x80; used--)
        ; /* a character is not cut in two */
    name[used] = '\0';
    if (given->from_file)
        snprintf(where, UZ_POINTER, "%s", given->from_file);
    else
        snprintf(where, UZ_POINTER, "/mesh/groups/%.*s/%.10s/%lld", LONGEST, name, key, (long long)i);
}

/* ---- faces */

static bool append_face(named_parts *parts, group_work *work, uz_face face)
{
    int64_t node[UZ_FACE_NODES];
    const int count = uz_mesh_face(node, work->mesh, face);
    for (int k = 0; k < count; k++)
        put_in(&work->nodes, node[k]);
    return append(&parts->faces, face.element * UZ_SIDE_STEP + face.side);
}

static uz_status refuse_face(const group_work *work, const uz_given_group *group, int64_t i, const char *what)
{
    char where[UZ_POINTER], nodes[UZ_ELEMENT_TEXT] = "";
    int used = 0;
    for (int64_t q = group->face_first[i]; q < group->face_first[i + 1] && used < UZ_ELEMENT_TEXT; q++)
        used += snprintf(nodes + used, (size_t)(UZ_ELEMENT_TEXT - used), "%s%lld", used ? ", " : "",
                         (long long)group->face_node[q]);
    group_place(where, work->given, group, work->mesh->dim == 2 ? "edges" : "faces", i);
    return uz_fail(work->err, UZ_ERR_SCENE, where, "the %s with nodes %s of the group \"%s\" %s",
                   work->mesh->dim == 2 ? "edge" : "face", nodes, group->name, what);
}

/* Adds the side of an element that a given face is, and its nodes. */
static uz_status collect_face(named_parts *parts, group_work *work, const uz_given_group *group, int64_t i)
{
    static const int CORNERS[2][UZ_FACE_NODES + 1] = {{0, 0, 2, 2}, {0, 0, 0, 3, 4, 0, 3, 0, 4}}; /* among so many */
    int64_t node[UZ_FACE_NODES], there[UZ_FACE_NODES];
    const int64_t count = group->face_first[i + 1] - group->face_first[i];
    const int dim = work->mesh->dim, corners = count > 0 && count <= UZ_FACE_NODES ? CORNERS[dim - 2][count] : 0;
    if (corners == 0)
        return refuse_face(work, group, i,
                           dim == 2 ? "has not 2 nodes, nor 3 with the one in its middle"
                                    : "has not 3 or 4 corners, alone or with the middles of its edges");
    for (int64_t k = 0; k < count; k++) {
        const int64_t given = group->face_node[group->face_first[i] + k];
        if (given < 0 || given >= work->given->n_nodes)
            return refuse_face(work, group, i, "has a node that is not there; nodes are numbered from 0");
        node[k] = work->new_node[given];
        if (node[k] < 0)
            return refuse_face(work, group, i, "belongs to no element; a group holds sides of elements");
    }
    const int64_t place = uz_corner_table_find(&work->sides, work->mesh, node, corners);
    if (place < 0)
        return refuse_face(work, group, i, "belongs to no element; a group holds sides of elements");
    const int has = uz_mesh_face(there, work->mesh, uz_corner_table_item(&work->sides, place));
    for (int64_t k = 0; k < count; k++) {
        bool found = false;
        for (int l = 0; l < has; l++)
            found = found || there[l] == node[k];
        if (!found)
            return refuse_face(work, group, i, "has other nodes in the middle of its edges than the element there");
    }
    parts->n_inner += work->sides.same[place + 1];
    return append_face(parts, work, uz_corner_table_item(&work->sides, place)) ? UZ_OK
                                                                               : uz_no_memory(work->err, GROUPS);
}

/* Of a face that occurs again, which happens where groups of one name overlap, the first one stays. code: a number
 * of each face. */
static bool drop_repeated(uz_group *group, const number_list *code)
{
    number_list sorted = {uz_alloc(code->count, sizeof *code->value), code->count, code->count};
    int64_t kept = 0;
    if (!sorted.value)
        return false;
    memcpy(sorted.value, code->value, (size_t)code->count * sizeof *code->value);
    sorted.count = uz_sort_unique(sorted.value, sorted.count);
    unsigned char *seen = uz_alloc_zero(sorted.count, sizeof *seen);
    for (int64_t i = 0; seen && sorted.count < code->count && i < code->count; i++) {
        const int64_t *at =
            bsearch(&code->value[i], sorted.value, (size_t)sorted.count, sizeof *sorted.value, uz_ascending);
        if (!seen[at - sorted.value]++)
            group->face[kept++] = group->face[i];
    }
    if (seen && sorted.count < code->count)
        group->n_faces = kept;
    const bool done = seen != NULL;
    uz_free_all(seen, sorted.value);
    return done;
}

/* ---- one name */

/* Adds what one group has. */
static uz_status collect(named_parts *parts, group_work *work, const uz_given_group *group)
{
    char where[UZ_POINTER];
    const int64_t n_nodes = work->given->n_nodes, n_elements = work->mesh->n_elements;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < group->n_nodes; i++) {
        const int64_t given = group->node[i];
        if (given < 0 || given >= n_nodes) {
            group_place(where, work->given, group, "nodes", i);
            return uz_fail(work->err, UZ_ERR_SCENE, where,
                           "the group \"%s\" asks for node %lld, but there are only 0 to %lld", group->name,
                           (long long)given, (long long)n_nodes - 1);
        }
        if (work->new_node[given] >= 0)
            put_in(&work->nodes, work->new_node[given]);
    }
    for (int64_t i = 0; i < group->n_faces && status == UZ_OK; i++)
        status = collect_face(parts, work, group, i);
    for (int64_t i = 0; i < group->n_elements && status == UZ_OK; i++) {
        const int64_t e = group->element[i];
        int count;
        if (e < 0 || e >= n_elements) {
            group_place(where, work->given, group, "elements", i);
            return uz_fail(work->err, UZ_ERR_SCENE, where,
                           "the group \"%s\" asks for element %lld, but there are only 0 to %lld", group->name,
                           (long long)e, (long long)n_elements - 1);
        }
        const int64_t *node = uz_mesh_element(work->mesh, e, &count);
        put_in(&work->elements, e);
        for (int k = 0; k < count; k++)
            put_in(&work->nodes, node[k]);
    }
    return status;
}

/* A new group of what was collected, with this status; frees what it does not take. */
static uz_status finish_group(group_work *work, const char *name, named_parts *parts, uz_status status)
{
    if (status == UZ_OK) {
        uz_group *out = &work->mesh->groups[work->mesh->n_groups++];
        snprintf(out->name, sizeof out->name, "%s", name);
        out->kind = work->elements.count ? UZ_GROUP_ELEMENTS : parts->faces.count ? UZ_GROUP_FACES : UZ_GROUP_NODES;
        out->node = take_out(&work->nodes, &out->n_nodes);
        if (!out->node)
            status = uz_no_memory(work->err, GROUPS);
        if (out->kind == UZ_GROUP_ELEMENTS) {
            out->element = take_out(&work->elements, &out->n_elements);
            if (!out->element)
                status = uz_no_memory(work->err, GROUPS);
        } else if (out->kind == UZ_GROUP_FACES) {
            out->n_inner = parts->n_inner;
            out->face = uz_alloc(parts->faces.count, sizeof *out->face);
            for (int64_t i = 0; out->face && i < parts->faces.count; i++)
                out->face[out->n_faces++] =
                    (uz_face){parts->faces.value[i] / UZ_SIDE_STEP, (int)(parts->faces.value[i] % UZ_SIDE_STEP)};
            if (!out->face || !drop_repeated(out, &parts->faces))
                status = uz_no_memory(work->err, GROUPS);
        }
    }
    free(parts->faces.value);
    return status;
}

uz_status uz_given_groups(uz_mesh *mesh, const uz_given_mesh *given, const int64_t *new_node, uz_error *err)
{
    group_work work = {.mesh = mesh, .given = given, .new_node = new_node, .err = err};
    if (given->n_groups > UZ_MESH_MAX_GROUPS)
        return uz_fail(err, UZ_ERR_SCENE, given->from_file ? given->from_file : "/mesh/groups",
                       "%lld groups; at most %d are allowed", (long long)given->n_groups, UZ_MESH_MAX_GROUPS);
    for (int64_t i = 0; i < given->n_groups; i++) {
        const size_t length = strnlen(given->groups[i].name, sizeof given->groups[i].name);
        if (length == 0 || length == sizeof given->groups[i].name)
            return uz_fail(err, UZ_ERR_SCENE, given->from_file ? given->from_file : "/mesh/groups",
                           "the name of a group has 1 to %zu bytes", sizeof given->groups[i].name - 1);
    }
    mesh->groups = uz_alloc_zero(given->n_groups + 2, sizeof *mesh->groups);
    if (!mesh->groups)
        return uz_no_memory(work.err, GROUPS);
    work.nodes.word = uz_alloc_zero(mesh->n_nodes / 64 + 1, sizeof *work.nodes.word);
    work.elements.word = uz_alloc_zero(mesh->n_elements / 64 + 1, sizeof *work.elements.word);
    uz_status status = work.nodes.word && work.elements.word ? uz_corner_table_build(&work.sides, mesh, true, err)
                                                             : uz_no_memory(err, GROUPS);
    for (int64_t i = 0; i < given->n_groups && status == UZ_OK;
         i++) { /* all of its name, unless an earlier one has it */
        const char *name = given->groups[i].name;
        named_parts parts = {0};
        if (uz_mesh_group(mesh, name, "", NULL))
            continue;
        for (int64_t k = i; k < given->n_groups && status == UZ_OK; k++)
            if (strcmp(given->groups[k].name, name) == 0)
                status = collect(&parts, &work, &given->groups[k]);
        status = finish_group(&work, name, &parts, status);
    }
    if (status == UZ_OK && !uz_mesh_group(mesh, "boundary", "", NULL)) { /* faces of one element only, by element */
        named_parts parts = {0};
        for (int64_t i = 0; i < work.sides.count && status == UZ_OK; i++)
            if (!work.sides.same[i] && !work.sides.same[i + 1] &&
                !append_face(&parts, &work, uz_corner_table_item(&work.sides, i)))
                status = uz_no_memory(work.err, GROUPS);
        parts.faces.count = uz_sort_unique(parts.faces.value, parts.faces.count);
        status = finish_group(&work, "boundary", &parts, status);
    }
    const uz_group *named = uz_mesh_group(mesh, "all", "", NULL);
    uz_group *all = named ? &mesh->groups[named - mesh->groups] : NULL;
    if (status == UZ_OK && all && all->n_elements < mesh->n_elements)
        status = uz_fail(err, UZ_ERR_SCENE, given->from_file ? given->from_file : "/mesh/groups/all",
                         "a group called \"all\" is not all elements of the mesh; give it another name");
    if (status == UZ_OK) {
        all = all ? all : &mesh->groups[mesh->n_groups++];
        uz_free_all(all->node, all->face, all->element);
        *all = (uz_group){.name = "all", .kind = UZ_GROUP_ELEMENTS, .everything = true};
    }
    uz_corner_table_clear(&work.sides);
    uz_free_all(work.nodes.word, work.elements.word);
    return status;
}
