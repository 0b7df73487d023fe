/* decode_mesh.c: a mesh of a scene in numbers, or as a Gmsh file. Whether it is a good one, the solver says. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A table of numbers of nodes, or a list (*columns 0). The caller frees *out also on failure. */
static bool read_indices(int64_t **out, int64_t *n, int *columns, decoding *d, const json_value *value)
{
    double *numbers = NULL;
    *n = 0;
    *columns = 0;
    *out = NULL;
    bool good = json_size(value) == 0 || decode_points(&numbers, n, columns, d, value);
    if (good && !(*out = room_for((size_t)*n, sizeof **out))) {
        problem_no_memory(d->problem);
        good = false;
    }
    for (int64_t i = 0; good && i < *n; i++) /* whole and not negative; what no mesh can have as the largest */
        (*out)[i] = numbers[i] < 1e15 ? (int64_t)numbers[i] : INT64_MAX;
    free(numbers);
    return good;
}

/* The tables of all kinds, then all of them in one. */
static bool read_elements(uz_given_mesh *to, decoding *d, const json_value *elements)
{
    int64_t *node[UZ_ELEMENT_KINDS] = {NULL}, n[UZ_ELEMENT_KINDS] = {0}, places = 0, e = 0;
    bool good = true;
    for (int k = 0; k < UZ_ELEMENT_KINDS && good; k++) {
        const json_value *table = json_get(elements, uz_element_name((uz_element_kind)k));
        const int count = uz_element_node_count((uz_element_kind)k);
        int columns = 0;
        good = !table || read_indices(&node[k], &n[k], &columns, d, table);
        if (good && n[k] > 0 && columns != count)
            good = decode_refuse(d, "size_mismatch", table, "has elements of %d nodes; they have %d.", columns, count);
        places += n[k];
        to->n_elements += n[k] / count;
    }
    if (good) {
        to->kind = room_for((size_t)to->n_elements, sizeof *to->kind);
        to->first = room_for((size_t)to->n_elements + 1, sizeof *to->first);
        to->node = room_for((size_t)places, sizeof *to->node);
        good = (to->kind && to->first && to->node) || problem_no_memory(d->problem);
    }
    if (good)
        to->first[0] = 0;
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const int count = uz_element_node_count((uz_element_kind)k);
        if (good && n[k] > 0)
            memcpy(to->node + to->first[e], node[k], (size_t)n[k] * sizeof *to->node);
        for (int64_t i = 0; good && i < n[k] / count; i++, e++) {
            to->kind[e] = (unsigned char)k;
            to->first[e + 1] = to->first[e] + count;
        }
        free(node[k]);
    }
    return good;
}

/* ---- groups */

static bool take_group_name(uz_given_group *to, decoding *d, const json_value *group)
{
    const size_t len = group->place;
    bool fits = len > 0 && len < sizeof to->name;
    for (size_t i = 0; fits && i < len; i++)
        fits = (unsigned char)group->key[i] >= 0x20 && group->key[i] != 0x7f;
    if (fits) {
        memcpy(to->name, group->key, len + 1);
        return true;
    }
    problem_set(d->problem, 422, "out_of_range", group->parent,
                "A name of a group has 1 to 63 bytes and no control characters; this one %s.",
                len == 0                ? "is empty"
                : len < sizeof to->name ? "has one"
                                        : "is longer");
    return false;
}

/* A list of numbers of nodes or elements. */
static bool read_list(int64_t **out, int64_t *n, decoding *d, const json_value *value)
{
    int columns;
    return !value || (read_indices(out, n, &columns, d, value) &&
                      (columns == 0 || decode_refuse(d, "wrong_type", value, "must be a list of numbers.")));
}

/* Faces of several sizes, as the triangles and quadrilaterals of wedges: a value each. */
static bool read_mixed_faces(uz_given_group *to, decoding *d, const json_value *value)
{
    int64_t nodes = 0;
    for (size_t i = 0; i < value->count; i++) {
        if (!json_is(&value->items[i], JSON_IS_NUMBERS) || value->items[i].columns > 0)
            return decode_refuse(d, "wrong_type", &value->items[i], "must be a list of node numbers.");
        nodes += (int64_t)value->items[i].count;
    }
    to->face_first = room_for(value->count + 1, sizeof *to->face_first);
    to->face_node = room_for((size_t)nodes, sizeof *to->face_node);
    if (!to->face_first || !to->face_node)
        return problem_no_memory(d->problem);
    bool good = true;
    nodes = 0;
    for (size_t i = 0; good && i < value->count; i++) {
        int64_t *node, count;
        int columns;
        to->face_first[i] = nodes;
        good = read_indices(&node, &count, &columns, d, &value->items[i]);
        if (good)
            memcpy(to->face_node + nodes, node, (size_t)count * sizeof *node);
        nodes += count;
        free(node);
    }
    if (good) {
        to->face_first[value->count] = nodes;
        to->n_faces = (int64_t)value->count;
    }
    return good;
}

/* Edges, all of the same size, or faces. */
static bool read_faces(uz_given_group *to, decoding *d, const json_value *value, int dim)
{
    int columns;
    int64_t n = 0;
    if (!value)
        return true;
    if (dim == 3 && json_is(value, JSON_IS_ARRAY) && value->count > 0)
        return read_mixed_faces(to, d, value);
    if (!read_indices(&to->face_node, &n, &columns, d, value))
        return false;
    if (n > 0 && columns == 0)
        return decode_refuse(d, "wrong_type", value, "must be a list of lists of node numbers.");
    to->n_faces = n > 0 ? n / columns : 0;
    to->face_first = room_for((size_t)to->n_faces + 1, sizeof *to->face_first);
    for (int64_t i = 0; to->face_first && i <= to->n_faces; i++)
        to->face_first[i] = i * columns;
    return to->face_first || problem_no_memory(d->problem);
}

static bool read_groups(uz_given_mesh *to, decoding *d, const json_value *groups, int dim)
{
    const char *key = dim == 2 ? "edges" : "faces", *other = dim == 2 ? "faces" : "edges";
    int64_t count;
    to->groups = decode_room(d, groups, sizeof *to->groups, &count);
    for (int64_t i = 0; i < count; i++) {
        const json_value *item = &groups->items[i], *wrong = json_get(item, other);
        uz_given_group *group = &to->groups[to->n_groups++];
        if (!take_group_name(group, d, item))
            return false;
        if (wrong)
            return decode_refuse(d, "not_allowed", wrong,
                                 dim == 2 ? "is for solids; sides of plane meshes are edges."
                                          : "is for plane meshes; sides of solids are faces.");
        if (!read_list(&group->node, &group->n_nodes, d, json_get(item, "nodes")) ||
            !read_faces(group, d, json_get(item, key), dim) ||
            !read_list(&group->element, &group->n_elements, d, json_get(item, "elements")))
            return false;
    }
    return to->groups != NULL;
}

bool decode_mesh(uz_scene *out, decoding *d, const json_value *mesh)
{
    const json_value *gmsh = json_get(mesh, "gmsh"), *nodes = json_get(mesh, "nodes");
    const int dim = uz_scene_dim(out);
    uz_given_mesh *to = &out->given;
    out->source = UZ_MESH_GIVEN;
    if (gmsh) {
        /* The bytes of a Gmsh file, in the request or uploaded before. A binary one can only be uploaded: JSON has no
         * bytes. */
        uz_error err = {.status = UZ_OK};
        decode_source file;
        if (!decode_source_open(&file, d, gmsh))
            return false;
        const bool good = uz_mesh_read(to, "gmsh", file.data, file.len, d->bound + 32 * file.len, &err) == UZ_OK;
        decode_source_close(&file);
        snprintf(err.where, sizeof err.where, "/mesh/gmsh");
        return good || decode_refuse_text(d, gmsh, &err, UZ_PROBLEM_SCENE);
    }
    int64_t n = 0;
    int columns = 0;
    if (!decode_points(&to->xyz, &n, &columns, d, nodes))
        return false;
    to->dim = dim;
    to->n_nodes = n / dim;
    if (columns != dim) {
        problem_set(d->problem, 422, "size_mismatch", nodes, "Nodes have %d coordinates here, not %d: the model is %s.",
                    dim, columns, dim == 3 ? "solid" : "one in the plane");
        return false;
    }
    return read_elements(to, d, json_get(mesh, "elements")) && read_groups(to, d, json_get(mesh, "groups"), dim);
}
