/* pattern.c: where K and K_fixed have entries: node by node, from the elements around it. Neither a list of triplets
 * nor a sort of one is needed. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Elements around each node, and a scratch list of the nodes around one node. */
typedef struct {
    const uz_body_model *model;
    uz_mesh tied;          /* the mesh, but for hanging nodes: elements have those in their place that these lie amid */
    int64_t *first, *node; /* its own of these; NULL: there are no hanging nodes */
    int64_t *start;        /* n_nodes + 1, into around */
    int64_t *around;       /* as many as the elements have of these */
    int64_t *seen;         /* n_nodes: 1 + the last node whose neighbours it was counted among */
    int64_t *near;         /* neighbours of the node at hand, itself included, ascending; most_near of them */
    int64_t n_near;
    int64_t most_nodes; /* of an element, or in the place of its nodes */
} neighbours;

/* Free dofs >= first among the neighbours; written to out unless it is NULL. Returns how many. */
static int64_t free_rows(int64_t *out, const neighbours *n, int64_t first)
{
    const int dim = n->model->mesh.dim;
    int64_t count = 0;
    for (int64_t i = 0; i < n->n_near; i++)
        for (int c = 0; c < dim; c++) {
            const int64_t row = n->model->dof[n->near[i] * dim + c];
            if (row < first || row < 0)
                continue;
            if (out)
                out[count] = row;
            count++;
        }
    return count;
}

/* One column of K (rows from the diagonal on) or of K_fixed (all free rows) per dof: how many entries it has, counted
 * at ptr[column + 1]; where the matrices have room, which (ptr NULL). */
static void walk_columns(uz_body_model *model, neighbours *n, int64_t *ptr, int64_t *ptr_fixed)
{
    const uz_csc *K = &model->K, *K_fixed = &model->K_fixed;
    const int dim = model->mesh.dim;
    memset(n->seen, 0, (size_t)model->mesh.n_nodes * sizeof *n->seen);
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        const uz_mesh *mesh = &n->tied;
        n->n_near = 0;
        for (int64_t i = n->start[a]; i < n->start[a + 1]; i++)
            for (int64_t k = mesh->first[n->around[i]]; k < mesh->first[n->around[i] + 1]; k++) {
                const int64_t other = mesh->node[k];
                if (n->seen[other] == a + 1)
                    continue;
                n->seen[other] = a + 1;
                int64_t at = n->n_near++;
                for (; at > 0 && n->near[at - 1] > other; at--) /* the list is short, and mostly comes in order */
                    n->near[at] = n->near[at - 1];
                n->near[at] = other;
            }
        for (int c = 0; c < dim; c++) {
            const int64_t column = model->dof[a * dim + c], fixed = -1 - column;
            if (column == UZ_NO_DOF)
                continue;
            if (ptr)
                *(column >= 0 ? &ptr[column + 1] : &ptr_fixed[fixed + 1]) = free_rows(NULL, n, column);
            else
                free_rows(column >= 0 ? K->idx + K->ptr[column] : K_fixed->idx + K_fixed->ptr[fixed], n, column);
        }
    }
}

/* ptr: of each column one place on, how many entries it has. */
static uz_status init_matrix(uz_csc *A, int64_t rows, int64_t cols, int64_t *ptr, uz_error *err)
{
    for (int64_t j = 0; j < cols; j++)
        ptr[j + 1] += ptr[j];
    uz_status status = uz_csc_init(A, rows, cols, ptr[cols], err);
    if (status == UZ_OK)
        memcpy(A->ptr, ptr, (size_t)(cols + 1) * sizeof *ptr);
    return status;
}

/* The same where nodes follow others, any number of them. */
static bool carry(neighbours *n)
{
    const uz_mesh *mesh = &n->model->mesh;
    const int64_t *from;
    const double *share;
    int64_t room = 0, at = 0;
    for (int64_t k = 0; k < mesh->first[mesh->n_elements]; k++) {
        const int64_t carriers = uz_carriers(&from, &share, n->model, mesh->node[k]);
        room += carriers > 0 ? carriers : 1;
    }
    n->first = uz_alloc_zero(mesh->n_elements + 1, sizeof *n->first);
    n->node = uz_alloc(room, sizeof *n->node);
    if (!n->first || !n->node)
        return false;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        for (int64_t k = mesh->first[e]; k < mesh->first[e + 1]; k++) {
            const int64_t carriers = uz_carriers(&from, &share, n->model, mesh->node[k]);
            for (int64_t i = 0; i < (carriers > 0 ? carriers : 1); i++) {
                const int64_t node = carriers > 0 ? from[i] : mesh->node[k];
                int64_t earlier = n->first[e];
                while (earlier < at && n->node[earlier] != node)
                    earlier++;
                n->node[at] = node;
                at += earlier == at;
            }
        }
        n->first[e + 1] = at;
        n->most_nodes = at - n->first[e] > n->most_nodes ? at - n->first[e] : n->most_nodes;
    }
    n->tied.first = n->first;
    n->tied.node = n->node;
    return true;
}

/* n->tied. False: no memory. */
static bool tie(neighbours *n)
{
    const uz_mesh *mesh = &n->model->mesh;
    uz_ties ties;
    n->tied = *mesh;
    n->most_nodes = UZ_ELEMENT_NODES;
    if (n->model->follow.first)
        return carry(n);
    if (!mesh->hangs)
        return true;
    n->first = uz_alloc_zero(mesh->n_elements + 1, sizeof *n->first);
    n->node = uz_alloc(mesh->n_elements * UZ_ELEMENT_NODES, sizeof *n->node);
    if (!n->first || !n->node)
        return false;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        uz_tie_nodes(&ties, mesh, node, count);
        memcpy(n->node + n->first[e], ties.node, (size_t)ties.count * sizeof *n->node);
        n->first[e + 1] = n->first[e] + ties.count;
    }
    n->tied.first = n->first;
    n->tied.node = n->node;
    return true;
}

uz_status uz_build_pattern(uz_body_model *model, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    neighbours n = {.model = model,
                    .start = uz_alloc(mesh->n_nodes + 1, sizeof *n.start),
                    .seen = uz_alloc_zero(mesh->n_nodes, sizeof *n.seen)};
    uz_status status = UZ_ERR_MEMORY;
    int64_t *ptr = uz_alloc_zero(model->d + 1, sizeof *ptr), most = 0;
    int64_t *ptr_fixed = uz_alloc_zero(model->n_fixed + 1, sizeof *ptr_fixed);
    if (tie(&n))
        n.around = uz_alloc(n.tied.first[mesh->n_elements], sizeof *n.around);
    if (n.start && n.around && n.seen) {
        uz_mesh_list_around(n.start, n.around, &n.tied);
        for (int64_t a = 0; a < mesh->n_nodes; a++)
            most = n.start[a + 1] - n.start[a] > most ? n.start[a + 1] - n.start[a] : most;
        n.near = uz_alloc(most * n.most_nodes + 1, sizeof *n.near); /* each counted for every element it shares */
    }
    if (!n.near || !ptr || !ptr_fixed) {
        uz_fail(err, status, "", "no memory for the pattern of %lld unknowns", (long long)model->d);
        goto done;
    }
    walk_columns(model, &n, ptr, ptr_fixed);
    status = init_matrix(&model->K, model->d, model->d, ptr, err);
    if (status == UZ_OK)
        status = init_matrix(&model->K_fixed, model->d, model->n_fixed, ptr_fixed, err);
    if (status == UZ_OK)
        walk_columns(model, &n, NULL, NULL);
done:
    free(ptr);
    free(ptr_fixed);
    free(n.first);
    free(n.node);
    free(n.start);
    free(n.around);
    free(n.seen);
    free(n.near);
    return status;
}
