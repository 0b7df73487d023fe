/* decode_mesh.c: a mesh of a scene in numbers, or as a file. Whether it is a good one, the solver says. */
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

/* A list of numbers of nodes or elements. */
static bool read_list(int64_t **out, int64_t *n, decoding *d, const json_value *value)
{
    int columns;
    return !value || (read_indices(out, n, &columns, d, value) &&
                      (columns == 0 || decode_refuse(d, "wrong_type", value, "must be a list of numbers.")));
}

/* Edges, all of the same size, or faces: of one size, or, as the triangles and quadrilaterals of wedges, a value each.
 */
static bool read_faces(uz_given_group *to, decoding *d, const json_value *value, int dim)
{
    const bool mixed = dim == 3 && json_is(value, JSON_IS_ARRAY) && value->count > 0;
    int columns = 0;
    int64_t n = 0, count = 0, *node = NULL;
    if (!value)
        return true;
    for (size_t i = 0; mixed && i < value->count; i++) {
        if (!json_is(&value->items[i], JSON_IS_NUMBERS) || value->items[i].columns > 0)
            return decode_refuse(d, "wrong_type", &value->items[i], "must be a list of node numbers.");
        n += (int64_t)value->items[i].count;
    }
    if (!mixed) {
        if (!read_indices(&to->face_node, &n, &columns, d, value))
            return false;
        if (n > 0 && columns == 0)
            return decode_refuse(d, "wrong_type", value, "must be a list of lists of node numbers.");
    } else if (!(to->face_node = room_for((size_t)n, sizeof *to->face_node))) {
        return problem_no_memory(d->problem);
    }
    const int64_t n_faces = mixed ? (int64_t)value->count : n > 0 ? n / columns : 0;
    to->face_first = room_for((size_t)n_faces + 1, sizeof *to->face_first);
    if (!to->face_first)
        return problem_no_memory(d->problem);
    to->face_first[0] = 0;
    for (int64_t i = 0; i < n_faces; i++) {
        int64_t *nodes = to->face_node + to->face_first[i];
        const bool good = !mixed || read_indices(&node, &count, &columns, d, &value->items[i]);
        if (mixed && good)
            memcpy(nodes, node, (size_t)count * sizeof *node);
        free(node);
        node = NULL;
        if (!good)
            return false;
        to->face_first[i + 1] = to->face_first[i] + (mixed ? count : columns);
    }
    to->n_faces = n_faces;
    return true;
}

/* ---- files */

/* The bytes of a file, in the request or uploaded before. A binary one can only be uploaded: JSON has no bytes. */
static bool read_file(uz_given_mesh *to, decoding *d, const char *format, const json_value *value)
{
    uz_error err = {.status = UZ_OK};
    decode_source file;
    if (!decode_source_open(&file, d, value))
        return false;
    /* Of an upload by its file alone: one that a shorter request may not read could not be kept for it. */
    const size_t bound = (file.digest ? (size_t)64 << 20 : d->bound) + 32 * file.len;
    const bool good = uz_mesh_read_kept(to, file.digest ? d->meshes : NULL, file.digest, format, file.data, file.len,
                                        bound, &err) == UZ_OK;
    decode_source_close(&file);
    snprintf(err.where, sizeof err.where, "/mesh/%s", format);
    if (!good) {
        codec_problem_from_error(d->problem, &err, UZ_PROBLEM_SCENE);
        json_pointer(d->problem->pointer, sizeof d->problem->pointer, value);
    }
    return good;
}

bool decode_mesh(uz_scene *out, decoding *d, const json_value *mesh)
{
    static const char *const FORMATS[] = {"gmsh", "abaqus", "nastran",
                                          "vtk"}; /* names of readers (solver/io/mesh_reader.h) */
    const json_value *nodes = json_get(mesh, "nodes");
    const int dim = uz_scene_dim(out);
    uz_given_mesh *to = &out->given;
    out->source = UZ_MESH_GIVEN;
    for (size_t i = 0; i < sizeof FORMATS / sizeof FORMATS[0]; i++)
        if (json_get(mesh, FORMATS[i]))
            return read_file(to, d, FORMATS[i], json_get(mesh, FORMATS[i]));
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
    if (!read_elements(to, d, json_get(mesh, "elements")))
        return false;
    const json_value *groups = json_get(mesh, "groups");
    const char *key = dim == 2 ? "edges" : "faces", *other = dim == 2 ? "faces" : "edges";
    int64_t count;
    to->groups = decode_room(d, groups, sizeof *to->groups, &count);
    for (int64_t i = 0; i < count; i++) {
        const json_value *item = &groups->items[i], *wrong = json_get(item, other);
        uz_given_group *group = &to->groups[to->n_groups++];
        if (!decode_label(group->name, d, item->parent, item->key, item->place, "A name of a group"))
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
