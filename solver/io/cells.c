/* cells.c: from the cells of a file to a body with its groups. */
#include "io/cells.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "scene/given.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int dim_of(int shape)
{
    if (shape < UZ_ELEMENT_KINDS)
        return uz_element_type_of((uz_element_kind)shape)->dim;
    return shape == CELLS_POINT ? 0 : 1;
}

int cells_nodes(int shape)
{
    if (shape < UZ_ELEMENT_KINDS)
        return uz_element_type_of((uz_element_kind)shape)->nodes;
    return 1 + shape - CELLS_POINT;
}

/* ---- what is added */

static uz_status check_size(const cells *mesh, int64_t line)
{
    const uint64_t bytes = 8 * (uint64_t)(4 * mesh->n_nodes + 3 * mesh->n_cells + 2 * mesh->n_members +
                                          (mesh->n_cells > 0 ? mesh->first[mesh->n_cells] : 0));
    return mesh->max_bytes == 0 || bytes <= mesh->max_bytes
               ? UZ_OK
               : uz_fail_line(mesh->err, UZ_ERR_LIMIT, line, "the mesh needs more memory than is allowed");
}

uz_status cells_add_node(cells *mesh, const double x[3], int64_t line)
{
    if (!uz_grow(&mesh->xyz, 3 * mesh->n_nodes, 3, &mesh->xyz_room, sizeof *mesh->xyz))
        return uz_no_memory(mesh->err, "the mesh");
    memcpy(mesh->xyz + 3 * mesh->n_nodes++, x, 3 * sizeof *x);
    return check_size(mesh, line);
}

uz_status cells_add(cells *mesh, int shape, const int64_t *node, int64_t line)
{
    const int64_t n = mesh->n_cells, from = n > 0 ? mesh->first[n] : 0;
    const int nodes = cells_nodes(shape);
    if (!uz_grow(&mesh->shape, n, 1, &mesh->shape_room, sizeof *mesh->shape) ||
        !uz_grow(&mesh->line, n, 1, &mesh->line_room, sizeof *mesh->line) ||
        !uz_grow(&mesh->first, n, 2, &mesh->first_room, sizeof *mesh->first) ||
        !uz_grow(&mesh->node, from, nodes, &mesh->node_room, sizeof *mesh->node))
        return uz_no_memory(mesh->err, "the mesh");
    mesh->shape[n] = (unsigned char)shape;
    mesh->line[n] = line;
    mesh->first[n] = from;
    mesh->first[n + 1] = from + nodes;
    memcpy(mesh->node + from, node, (size_t)nodes * sizeof *node);
    mesh->n_cells++;
    return check_size(mesh, line);
}

uz_status cells_add_set(int64_t *set, cells *mesh, const char *name, bool nodes, int64_t line)
{
    if (mesh->n_sets >= UZ_MESH_MAX_GROUPS)
        return uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, line, "there are more than %d groups", UZ_MESH_MAX_GROUPS);
    if (!uz_grow(&mesh->sets, mesh->n_sets, 1, &mesh->sets_room, sizeof *mesh->sets))
        return uz_no_memory(mesh->err, "the mesh");
    cells_set *to = &mesh->sets[ *set = mesh->n_sets];
    *to = (cells_set){.nodes = nodes, .line = line};
    if (snprintf(to->name, sizeof to->name, "%s", name) >= (int)sizeof to->name)
        return uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, line, "the name of a group has more than 63 bytes");
    for (int64_t i = 0; i < mesh->n_sets; i++)
        if (mesh->sets[i].nodes == nodes && strcmp(mesh->sets[i].name, name) == 0)
            return uz_fail_line(mesh->err, UZ_ERR_FORMAT, line, "there is a second group \"%s\"", name);
    mesh->n_sets++;
    return UZ_OK;
}

uz_status cells_add_member(cells *mesh, int64_t set, int64_t index, int64_t line)
{
    cells_set *to = &mesh->sets[set];
    if (!uz_grow(&to->index, to->count, 1, &to->room, sizeof *to->index))
        return uz_no_memory(mesh->err, "the mesh");
    to->index[to->count++] = index;
    mesh->n_members++;
    return check_size(mesh, line);
}

uz_status cells_add_values(cells *mesh, const char *name, const int64_t *value, bool nodes, int64_t most, int64_t line)
{
    const int64_t n = nodes ? mesh->n_nodes : mesh->n_cells;
    int64_t begin = 0, values = 0, set = -1;
    int64_t *order = uz_order_of(value, n);
    uz_status status = order ? UZ_OK : uz_no_memory(mesh->err, "the mesh");
    while (order && begin < n && value[order[begin]] == CELLS_NO_VALUE)
        begin++;
    for (int64_t i = begin; order && i < n; i++)
        values += i == begin || value[order[i]] != value[order[i - 1]];
    for (int64_t i = begin; i < n && status == UZ_OK && (most <= 0 || values <= most); i++) {
        char full[160];
        snprintf(full, sizeof full, "%.120s_%lld", name, (long long)value[order[i]]);
        if (i == begin || value[order[i]] != value[order[i - 1]])
            status = cells_add_set(&set, mesh, full, nodes, line);
        if (status == UZ_OK)
            status = cells_add_member(mesh, set, order[i], line);
    }
    free(order);
    return status;
}

/* ---- the body */

/* The highest dimension, and the line of the first cell that has it. */
static uz_status choose_dim(int *dim, int64_t *line, const cells *mesh, const char *advice)
{
    int64_t at = 0;
    *dim = 0;
    for (int64_t e = 0; e < mesh->n_cells; e++) {
        at = dim_of(mesh->shape[e]) > *dim ? e : at;
        *dim = dim_of(mesh->shape[at]);
    }
    *line = mesh->n_cells > 0 ? mesh->line[at] : 1;
    if (*dim < 2)
        return uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, *line, "there are no elements of a body; %s", advice);
    return UZ_OK;
}

/* new_cell: the number of each cell among the elements, -1: it is none. */
static uz_status add_body(uz_given_mesh *out, cells *mesh, int64_t *new_cell)
{
    int64_t places = 0;
    for (int64_t e = 0; e < mesh->n_cells; e++) {
        const bool body = dim_of(mesh->shape[e]) == out->dim;
        new_cell[e] = body ? out->n_elements++ : -1;
        places += body ? mesh->first[e + 1] - mesh->first[e] : 0;
    }
    out->n_nodes = mesh->n_nodes;
    if (!uz_given_room(out, &mesh->xyz, places))
        return uz_no_memory(mesh->err, "the mesh");
    for (int64_t e = 0; e < mesh->n_cells; e++) {
        const int64_t to = new_cell[e], count = mesh->first[e + 1] - mesh->first[e];
        if (to < 0)
            continue;
        out->kind[to] = mesh->shape[e];
        out->first[to + 1] = out->first[to] + count;
        memcpy(out->node + out->first[to], mesh->node + mesh->first[e], (size_t)count * sizeof *out->node);
    }
    return UZ_OK;
}

/* ---- groups */

/* How a member of a set belongs to a group. */
static uz_given_way way_of(const cells *mesh, const cells_set *set, int64_t i, int dim)
{
    const int its_dim = set->nodes ? 0 : dim_of(mesh->shape[set->index[i]]);
    return set->nodes || its_dim < dim - 1 ? UZ_GIVEN_NODES : its_dim == dim ? UZ_GIVEN_ELEMENT : UZ_GIVEN_SIDE;
}

static uz_status add_group(uz_given_mesh *out, const cells *mesh, const cells_set *set, const int64_t *new_cell,
                           uz_given_way way)
{
    uz_given_members members = {.to = &out->groups[out->n_groups]};
    bool any = false;
    for (int64_t i = 0; i < set->count; i++) {
        const int64_t index = set->index[i], *node = set->nodes ? &index : mesh->node + mesh->first[index];
        if (way_of(mesh, set, i, out->dim) != way)
            continue;
        out->n_groups += !any;
        any = true;
        if (!uz_given_add(&members, way, set->nodes ? -1 : new_cell[index], node,
                          set->nodes ? 1 : mesh->first[index + 1] - mesh->first[index]))
            return uz_no_memory(mesh->err, "the mesh");
    }
    return UZ_OK;
}

static bool is_taken(const uz_given_mesh *out, const char *name)
{
    for (int64_t i = 0; i < out->n_groups; i++)
        if (strcmp(out->groups[i].name, name) == 0)
            return true;
    return false;
}

static uz_status add_groups(uz_given_mesh *out, const cells *mesh, const int64_t *new_cell)
{
    static const char *const SUFFIX[UZ_GIVEN_WAYS] = {".elements", ".sides", ".nodes"};
    if (!(out->groups = uz_alloc_zero(UZ_GIVEN_WAYS * mesh->n_sets, sizeof *out->groups)))
        return uz_no_memory(mesh->err, "the mesh");
    for (int64_t s = 0; s < mesh->n_sets; s++)
        for (uz_given_way way = 0; way < UZ_GIVEN_WAYS; way++) {
            char name[80];
            const int64_t before = out->n_groups;
            const uz_status status = add_group(out, mesh, &mesh->sets[s], new_cell, way);
            if (status != UZ_OK)
                return status;
            if (out->n_groups == before)
                continue;
            snprintf(name, sizeof name, "%s", mesh->sets[s].name);
            if (is_taken(out, name))
                snprintf(name, sizeof name, "%s%s", mesh->sets[s].name, SUFFIX[way]);
            if (is_taken(out, name) || strlen(name) >= sizeof out->groups->name)
                return uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, mesh->sets[s].line,
                                    "\"%s\" is the name of two groups, or too long for another one", name);
            memcpy(out->groups[before].name, name, strlen(name) + 1);
        }
    return UZ_OK;
}

uz_status cells_to_given(uz_given_mesh *out, cells *mesh, const char *from_file, const char *advice)
{
    int64_t *new_cell = uz_alloc(mesh->n_cells, sizeof *new_cell), line = 1;
    memset(out, 0, sizeof *out);
    uz_status status = new_cell ? choose_dim(&out->dim, &line, mesh, advice) : uz_no_memory(mesh->err, "the mesh");
    if (status == UZ_OK)
        status = add_body(out, mesh, new_cell);
    if (status == UZ_OK && out->dim == 2 && !uz_given_is_flat(out, mesh->xyz))
        status = uz_fail_line(mesh->err, UZ_ERR_UNSUPPORTED, line,
                              "there are only surfaces, and they do not lie in a plane z = constant; shells are not "
                              "modelled: %s, or turn a plane body into the plane of x and y",
                              advice);
    if (status == UZ_OK)
        status = add_groups(out, mesh, new_cell);
    free(new_cell);
    out->from_file = from_file;
    if (status != UZ_OK)
        uz_given_mesh_clear(out);
    return status;
}

void cells_clear(cells *mesh)
{
    for (int64_t i = 0; i < mesh->n_sets; i++)
        free(mesh->sets[i].index);
    uz_free_all(mesh->sets, mesh->xyz, mesh->shape, mesh->line, mesh->first, mesh->node);
}
