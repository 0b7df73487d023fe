#include "scene/mesh.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void uz_mesh_clear(uz_mesh *mesh)
{
    if (!mesh)
        return;
    for (int64_t i = 0; mesh->groups && i < mesh->n_groups; i++) {
        uz_free_all(mesh->groups[i].node, mesh->groups[i].face, mesh->groups[i].element);
    }
    uz_free_all(mesh->groups, mesh->xyz, mesh->kind, mesh->first, mesh->node, mesh->from_first, mesh->from,
                mesh->from_share, mesh->hangs, mesh->part_of, mesh->inside);
    memset(mesh, 0, sizeof *mesh);
}

const uz_group *uz_mesh_group(const uz_mesh *mesh, const char *name, const char *where, uz_error *err)
{
    char names[256];
    size_t used = 0;
    for (int64_t i = 0; i < mesh->n_groups; i++)
        if (strncmp(mesh->groups[i].name, name, sizeof mesh->groups[i].name) == 0)
            return &mesh->groups[i];
    names[0] = '\0';
    for (int64_t i = 0; i < mesh->n_groups && used < sizeof names; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "", mesh->groups[i].name);
    uz_fail(err, UZ_ERR_SCENE, where, "there is no group \"%.63s\"; this mesh has: %s", name, names);
    return NULL;
}

int uz_groups_share_face(const uz_mesh *mesh, const uz_group *one, const uz_group *other)
{
    unsigned char *sides = uz_alloc_zero(mesh->n_elements, 1); /* bits: an element has at most six sides */
    int shared = sides ? 0 : -1;
    for (int64_t i = 0; i < one->n_faces && sides; i++)
        sides[one->face[i].element] |= (unsigned char)(1u << one->face[i].side);
    for (int64_t i = 0; i < other->n_faces && shared == 0; i++)
        shared = sides[other->face[i].element] >> other->face[i].side & 1;
    free(sides);
    return shared;
}

int64_t uz_group_node_count(const uz_mesh *mesh, const uz_group *group)
{
    return group->everything ? mesh->n_nodes : group->n_nodes;
}

int64_t uz_group_node_at(const uz_group *group, int64_t i)
{
    return group->everything ? i : group->node[i];
}

int64_t uz_group_element_count(const uz_mesh *mesh, const uz_group *group)
{
    return group->everything ? mesh->n_elements : group->n_elements;
}

int64_t uz_group_element_at(const uz_group *group, int64_t i)
{
    return group->everything ? i : group->element[i];
}

int uz_mesh_amid(const int64_t **from, const double **share, const uz_mesh *mesh, int64_t node)
{
    const int64_t *first = mesh->from_first + (node - mesh->n_given);
    *from = mesh->from + first[0];
    *share = mesh->from_share + first[0];
    return (int)(first[1] - first[0]);
}

double uz_mesh_value_amid(const uz_mesh *mesh, int64_t node, const double *value, int stride)
{
    const int64_t *from;
    const double *share;
    double sum = 0;
    for (int k = uz_mesh_amid(&from, &share, mesh, node) - 1; k >= 0; k--)
        sum += share[k] * value[from[k] * stride];
    return sum;
}

const int64_t *uz_mesh_element(const uz_mesh *mesh, int64_t element, int *count)
{
    *count = (int)(mesh->first[element + 1] - mesh->first[element]);
    return mesh->node + mesh->first[element];
}

void uz_mesh_middle(double middle[3], const uz_mesh *mesh)
{
    const double share = 1 / (double)mesh->n_nodes;
    memset(middle, 0, 3 * sizeof *middle);
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        for (int c = 0; c < mesh->dim; c++)
            middle[c] += share * mesh->xyz[i * mesh->dim + c];
}

double uz_mesh_size(const uz_mesh *mesh)
{
    double middle[3], most = 0;
    uz_mesh_middle(middle, mesh);
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        const double square = uz_distance2(mesh->xyz + i * mesh->dim, middle, mesh->dim);
        most = square > most ? square : most;
    }
    return 2 * sqrt(most);
}

void uz_mesh_list_around(int64_t *first, int64_t *around, const uz_mesh *mesh)
{
    const int64_t total = mesh->first[mesh->n_elements];
    memset(first, 0, (size_t)(mesh->n_nodes + 1) * sizeof *first);
    for (int64_t q = 0; q < total; q++)
        first[mesh->node[q]]++;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        first[a + 1] += first[a];
    for (int64_t e = mesh->n_elements - 1; e >= 0; e--) /* from the end: first[a] then is where its list begins */
        for (int64_t q = mesh->first[e]; q < mesh->first[e + 1]; q++)
            around[--first[mesh->node[q]]] = e;
}

int uz_mesh_face(int64_t node[UZ_FACE_NODES], const uz_mesh *mesh, uz_face face)
{
    const int64_t *of = mesh->node + mesh->first[face.element];
    const uz_element_side *side = &uz_element_type_of((uz_element_kind)mesh->kind[face.element])->side[face.side];
    for (int i = 0; i < side->nodes; i++)
        node[i] = of[side->node[i]];
    return side->nodes;
}
