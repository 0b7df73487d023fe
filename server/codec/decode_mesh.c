/* decode_mesh.c: a mesh of a scene in numbers, or as a Gmsh file. Whether it is a good one, the solver says. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A mesh on its way. */
typedef struct {
    uz_given_mesh *to;
    json_doc *doc;
    int dim;
    size_t bound;
    problem_details *problem;
} mesh_reading;

/* ---- numbers of nodes and elements */

/* A whole number that is not negative; what no mesh can have as the largest. */
static int64_t to_index(double x)
{
    return x < 1e15 ? (int64_t)x : INT64_MAX;
}

/* A table of numbers of nodes, or a list (*columns 0). The caller frees *out also on failure. */
static bool read_indices(int64_t **out, int64_t *n, int *columns, const mesh_reading *r, const json_t *value,
                         const char *where)
{
    double *numbers = NULL;
    *n = 0;
    *columns = 0;
    *out = NULL;
    const json_lifted *lifted = json_doc_lifted(r->doc, value);
    bool good = true;
    if (lifted || json_array_size(value) > 0)
        good = decode_points(&numbers, n, columns, r->doc, value, r->bound, where, r->problem);
    if (good && !(*out = room_for((size_t)*n, sizeof **out)))
        good = decode_no_memory(r->problem);
    for (int64_t i = 0; good && i < *n; i++)
        (*out)[i] = to_index(numbers[i]);
    free(numbers);
    return good;
}

/* ---- nodes */

static bool read_nodes(const mesh_reading *r, const json_t *nodes)
{
    uz_given_mesh *to = r->to;
    int64_t n = 0;
    int columns = 0;
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, at = {&mesh, "nodes", 5, 0};
    if (!decode_points(&to->xyz, &n, &columns, r->doc, nodes, r->bound, "/problem/mesh/nodes", r->problem))
        return false;
    to->dim = r->dim;
    to->n_nodes = n / r->dim;
    if (columns == r->dim)
        return true;
    problem_set(r->problem, 422, "size_mismatch", &at, "Nodes have %d coordinates here, not %d: the model is %s.",
                r->dim, columns, r->dim == 3 ? "solid" : "one in the plane");
    return false;
}

/* ---- elements */

/* The tables of all kinds, before they are put together. */
typedef struct {
    int64_t *node[UZ_ELEMENT_KINDS], n[UZ_ELEMENT_KINDS];
} element_tables;

static bool read_table(element_tables *tables, const mesh_reading *r, uz_element_kind kind, const json_t *table)
{
    char where[64];
    int columns;
    snprintf(where, sizeof where, "/problem/mesh/elements/%s", uz_element_name(kind));
    if (!read_indices(&tables->node[kind], &tables->n[kind], &columns, r, table, where))
        return false;
    if (tables->n[kind] == 0 || columns == uz_element_node_count(kind))
        return true;
    problem_set(r->problem, 422, "size_mismatch", NULL, "%s has elements of %d nodes; they have %d.", where, columns,
                uz_element_node_count(kind));
    snprintf(r->problem->pointer, sizeof r->problem->pointer, "%s", where);
    return false;
}

static bool join_tables(const mesh_reading *r, const element_tables *tables)
{
    uz_given_mesh *to = r->to;
    int64_t places = 0, e = 0;
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        places += tables->n[k];
        to->n_elements += tables->n[k] / uz_element_node_count((uz_element_kind)k);
    }
    to->kind = room_for((size_t)to->n_elements, sizeof *to->kind);
    to->first = room_for((size_t)to->n_elements + 1, sizeof *to->first);
    to->node = room_for((size_t)places, sizeof *to->node);
    if (!to->kind || !to->first || !to->node)
        return decode_no_memory(r->problem);
    to->first[0] = 0;
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const int count = uz_element_node_count((uz_element_kind)k);
        if (tables->n[k] > 0)
            memcpy(to->node + to->first[e], tables->node[k], (size_t)tables->n[k] * sizeof *to->node);
        for (int64_t i = 0; i < tables->n[k] / count; i++, e++) {
            to->kind[e] = (unsigned char)k;
            to->first[e + 1] = to->first[e] + count;
        }
    }
    return true;
}

static bool read_elements(const mesh_reading *r, const json_t *elements)
{
    element_tables tables = {0};
    bool good = true;
    for (int k = 0; k < UZ_ELEMENT_KINDS && good; k++) {
        const json_t *table = json_object_get(elements, uz_element_name((uz_element_kind)k));
        good = !table || read_table(&tables, r, (uz_element_kind)k, table);
    }
    good = good && join_tables(r, &tables);
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++)
        free(tables.node[k]);
    return good;
}

/* ---- groups */

/* "/problem/mesh/groups/NAME/key", for messages. */
static const char *group_pointer(char pointer[128], const char *name, size_t len, const char *key)
{
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, groups = {&mesh, "groups", 6, 0};
    json_path group = {&groups, name, len, 0}, at = {&group, key, strlen(key), 0};
    json_path_write(pointer, 128, &at);
    return pointer;
}

static bool refuse_group(const mesh_reading *r, const char *code, const char *pointer, const char *what)
{
    problem_set(r->problem, 422, code, NULL, "%s %s.", pointer, what);
    snprintf(r->problem->pointer, sizeof r->problem->pointer, "%s", pointer);
    return false;
}

static bool take_group_name(uz_given_group *to, const mesh_reading *r, const char *name, size_t len)
{
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, at = {&mesh, "groups", 6, 0};
    bool fits = len > 0 && len < sizeof to->name;
    for (size_t i = 0; fits && i < len; i++)
        fits = (unsigned char)name[i] >= 0x20 && name[i] != 0x7f;
    if (fits) {
        memcpy(to->name, name, len);
        to->name[len] = '\0';
        return true;
    }
    problem_set(r->problem, 422, "out_of_range", &at,
                "A name of a group has 1 to 63 bytes and no control characters; this one %s.",
                len == 0                ? "is empty"
                : len < sizeof to->name ? "has one"
                                        : "is longer");
    return false;
}

/* A list of numbers of nodes or elements. */
static bool read_list(int64_t **out, int64_t *n, const mesh_reading *r, const json_t *value, const char *pointer)
{
    int columns;
    if (!value)
        return true;
    return read_indices(out, n, &columns, r, value, pointer) &&
           (columns == 0 || refuse_group(r, "wrong_type", pointer, "must be a list of numbers"));
}

/* Edges or faces: all of the same size. */
static bool read_faces(uz_given_group *to, const mesh_reading *r, const json_t *value, const char *pointer)
{
    int columns;
    int64_t n = 0;
    if (!value)
        return true;
    if (!read_indices(&to->face_node, &n, &columns, r, value, pointer))
        return false;
    if (n > 0 && columns == 0)
        return refuse_group(r, "wrong_type", pointer, "must be a list of lists of node numbers");
    to->n_faces = n > 0 ? n / columns : 0;
    to->face_first = room_for((size_t)to->n_faces + 1, sizeof *to->face_first);
    for (int64_t i = 0; to->face_first && i <= to->n_faces; i++)
        to->face_first[i] = i * columns;
    return to->face_first || decode_no_memory(r->problem);
}

static bool read_group(uz_given_group *to, const mesh_reading *r, const char *name, size_t len, const json_t *group)
{
    char pointer[128];
    const char *key = r->dim == 2 ? "edges" : "faces", *other = r->dim == 2 ? "faces" : "edges";
    if (!take_group_name(to, r, name, len))
        return false;
    if (json_object_get(group, other))
        return refuse_group(r, "not_allowed", group_pointer(pointer, name, len, other),
                            r->dim == 2 ? "is for solids; sides of plane meshes are edges"
                                        : "is for plane meshes; sides of solids are faces");
    return read_list(&to->node, &to->n_nodes, r, json_object_get(group, "nodes"),
                     group_pointer(pointer, name, len, "nodes")) &&
           read_faces(to, r, json_object_get(group, key), group_pointer(pointer, name, len, key)) &&
           read_list(&to->element, &to->n_elements, r, json_object_get(group, "elements"),
                     group_pointer(pointer, name, len, "elements"));
}

static bool read_groups(const mesh_reading *r, const json_t *groups)
{
    uz_given_mesh *to = r->to;
    void *entry = groups ? json_object_iter((json_t *)groups) : NULL;
    to->groups = calloc(json_object_size(groups) + 1, sizeof *to->groups);
    if (!to->groups)
        return decode_no_memory(r->problem);
    for (; entry; entry = json_object_iter_next((json_t *)groups, entry))
        if (!read_group(&to->groups[to->n_groups++], r, json_object_iter_key(entry), json_object_iter_key_len(entry),
                        json_object_iter_value(entry)))
            return false;
    return true;
}

/* ---- Gmsh */

/* The bytes of a Gmsh file, in the request or uploaded before. A binary one can only be uploaded: JSON has no bytes. */
static bool read_gmsh(const mesh_reading *r, const json_t *gmsh)
{
    uz_error err = {.status = UZ_OK};
    decode_source file;
    if (!decode_source_open(&file, r->doc, gmsh, "/problem/mesh/gmsh", r->problem))
        return false;
    const bool good = uz_gmsh_read(r->to, file.data, file.len, r->bound + 32 * file.len, &err) == UZ_OK;
    decode_source_close(&file, r->doc, gmsh);
    if (good)
        return true;
    snprintf(err.where, sizeof err.where, "/mesh/gmsh");
    codec_problem_from_error(r->problem, &err, UZ_PROBLEM_SCENE);
    return false;
}

bool decode_mesh(uz_scene *out, json_doc *doc, const json_t *mesh, size_t body_len, problem_details *problem)
{
    const mesh_reading r = {&out->given, doc, uz_scene_dim(out), decode_memory_bound(body_len), problem};
    const json_t *gmsh = json_object_get(mesh, "gmsh");
    out->source = UZ_MESH_GIVEN;
    if (gmsh)
        return read_gmsh(&r, gmsh);
    return read_nodes(&r, json_object_get(mesh, "nodes")) && read_elements(&r, json_object_get(mesh, "elements")) &&
           read_groups(&r, json_object_get(mesh, "groups"));
}
