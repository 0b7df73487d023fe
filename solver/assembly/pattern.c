/* pattern.c: where K and K_fixed have entries: node by node, from the elements around it. Neither a list of triplets
 * nor a sort of one is needed. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Elements around each node. */
typedef struct {
    uz_body_model *model;
    uz_mesh tied;          /* the mesh, but for hanging nodes: elements have those in their place that these lie amid */
    int64_t *first, *node; /* its own of these; NULL: there are no hanging nodes */
    int64_t *start;        /* n_nodes + 1, into around */
    int64_t *around;       /* as many as the elements have of these */
    int64_t most_nodes;    /* of an element, or in the place of its nodes */
    int64_t *ptr, *ptr_fixed; /* of each column, one place on: how many entries it has; later where they begin */
} neighbours;

/* Nodes whose columns somebody makes, and his lists. */
typedef struct {
    const neighbours *of;
    int64_t from, to;
    int32_t *seen; /* n_nodes: 1 + the last node whose neighbours it was counted among */
    int64_t *near; /* neighbours of the node at hand, itself included */
    int64_t n_near;
    int32_t *rows; /* their free dofs */
} walk;

static void find_near(walk *w, int64_t a, bool ascending)
{
    const uz_mesh *mesh = &w->of->tied;
    w->n_near = 0;
    for (int64_t i = w->of->start[a]; i < w->of->start[a + 1]; i++)
        for (int64_t k = mesh->first[w->of->around[i]]; k < mesh->first[w->of->around[i] + 1]; k++) {
            const int64_t other = mesh->node[k];
            if (w->seen[other] == a + 1)
                continue;
            w->seen[other] = (int32_t)(a + 1);
            int64_t at = w->n_near++;
            for (; ascending && at > 0 && w->near[at - 1] > other; at--) /* it is short, and mostly comes in order */
                w->near[at] = w->near[at - 1];
            w->near[at] = other;
        }
}

/* Of K rows from the diagonal on, of K_fixed all free ones. */
static void count_entries(const walk *w, int64_t a)
{
    const neighbours *n = w->of;
    const int dim = n->model->mesh.dim;
    const int64_t *own = n->model->dof + a * dim;
    int64_t all = 0, later = 0; /* dofs have the order of their nodes */
    for (int64_t i = 0; i < w->n_near; i++)
        for (int c = 0; c < dim; c++) {
            const int64_t row = n->model->dof[w->near[i] * dim + c];
            all += row >= 0;
            later += row >= 0 && w->near[i] >= a;
        }
    for (int c = 0; c < dim; c++)
        if (own[c] >= 0)
            n->ptr[own[c] + 1] = later--;
        else if (own[c] != UZ_NO_DOF)
            n->ptr_fixed[-own[c]] = all;
}

/* The rows of a column: the last of these. */
static void fill_column(uz_csc *A, int64_t column, const int32_t *rows, int64_t count)
{
    const int64_t end = A->ptr[column + 1];
    for (int64_t k = A->ptr[column]; k < end; k++) /* too short for a call of memcpy */
        A->idx[k] = rows[count - end + k];
}

/* A part's share of all values. */
static void clear_values(uz_csc *A, const walk *w)
{
    const int64_t entries = A->ptr[A->cols], nodes = w->of->tied.n_nodes;
    const int64_t begin = entries * w->from / nodes, end = entries * w->to / nodes;
    memset(A->val + begin, 0, (size_t)(end - begin) * sizeof *A->val);
}

static void fill_columns(const walk *w, int64_t a)
{
    uz_body_model *model = w->of->model;
    const int dim = model->mesh.dim;
    const int64_t *own = model->dof + a * dim;
    int64_t count = 0;
    for (int64_t i = 0; i < w->n_near; i++)
        for (int c = 0; c < dim; c++) {
            const int64_t row = model->dof[w->near[i] * dim + c];
            w->rows[count] = (int32_t)row;
            count += row >= 0;
        }
    for (int c = 0; c < dim; c++)
        if (own[c] >= 0)
            fill_column(&model->K, own[c], w->rows, count);
        else if (own[c] != UZ_NO_DOF)
            fill_column(&model->K_fixed, -1 - own[c], w->rows, count);
}

static void count_part(void *ctx, int part)
{
    walk *w = (walk *)ctx + part;
    for (int64_t a = w->from; a < w->to; a++) {
        find_near(w, a, false);
        count_entries(w, a);
    }
    memset(w->seen, 0, (size_t)w->of->tied.n_nodes * sizeof *w->seen);
}

static void fill_part(void *ctx, int part)
{
    walk *w = (walk *)ctx + part;
    clear_values(&w->of->model->K, w);
    clear_values(&w->of->model->K_fixed, w);
    for (int64_t a = w->from; a < w->to; a++) {
        find_near(w, a, true);
        fill_columns(w, a);
    }
}

/* Room for its entries; ptr, as of neighbours, is its own then. */
static uz_status init_matrix(uz_csc *A, int64_t rows, int64_t cols, int64_t **ptr, uz_error *err)
{
    for (int64_t j = 0; j < cols; j++)
        (*ptr)[j + 1] += (*ptr)[j];
    const int64_t entries = (*ptr)[cols];
    *A = (uz_csc){.rows = rows,
                  .cols = cols,
                  .ptr = *ptr,
                  .idx = uz_alloc(entries, sizeof *A->idx),
                  .val = uz_alloc(entries, sizeof *A->val)};
    *ptr = NULL;
    if (A->idx && A->val)
        return UZ_OK;
    uz_csc_clear(A);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a matrix of %lld columns and %lld entries", (long long)cols,
                   (long long)entries);
}

/* Nodes; and parts for each thread: pages that are touched here first cost some threads several times what they cost
 * others. */
enum { WORTH_SHARING = 20000, PARTS_EACH = 4, PARTS_MOST = 2 * UZ_ASIDE_MOST };

static int count_parts(int64_t nodes)
{
    const int threads = nodes < WORTH_SHARING ? 1 : uz_aside_threads(), parts = PARTS_EACH * threads;
    return threads == 1 ? 1 : parts < PARTS_MOST ? parts : PARTS_MOST;
}

/* The columns of parts of the nodes. most: neighbours of a node. */
static uz_status walk_columns(uz_body_model *model, neighbours *n, int64_t most, uz_error *err)
{
    const int64_t nodes = model->mesh.n_nodes;
    const int parts = count_parts(nodes);
    walk walks[PARTS_MOST] = {{0}};
    uz_status status = UZ_OK;
    for (int p = 0; p < parts; p++) {
        walk *w = &walks[p];
        *w = (walk){.of = n,
                    .from = nodes * p / parts,
                    .to = nodes * (p + 1) / parts,
                    .seen = uz_alloc_zero(nodes, sizeof *w->seen),
                    .near = uz_alloc(most, sizeof *w->near),
                    .rows = uz_alloc(most * model->mesh.dim + 1, sizeof *w->rows)};
        if (!w->seen || !w->near || !w->rows)
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the neighbours of %lld nodes", (long long)nodes);
    }
    if (status == UZ_OK) {
        uz_aside_share(count_part, walks, parts);
        status = init_matrix(&model->K, model->d, model->d, &n->ptr, err);
    }
    if (status == UZ_OK)
        status = init_matrix(&model->K_fixed, model->d, model->n_fixed, &n->ptr_fixed, err);
    if (status == UZ_OK)
        uz_aside_share(fill_part, walks, parts);
    for (int p = 0; p < parts; p++) {
        uz_free_all(walks[p].seen, walks[p].near, walks[p].rows);
    }
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

/* The nodes that carry a group's: into list, if there is one. Returns how many. */
static int64_t list_carriers(int64_t *list, const uz_body_model *model, const uz_group *group)
{
    const uz_mesh *mesh = &model->mesh;
    int64_t n = 0;
    for (int64_t i = 0; i < uz_group_node_count(mesh, group); i++) {
        const int64_t own = uz_group_node_at(group, i), *from;
        const double *share;
        int64_t count = uz_carriers(&from, &share, model, own);
        if (count == 0 && uz_mesh_hangs(mesh, own))
            count = uz_mesh_amid(&from, &share, mesh, own);
        for (int64_t k = 0; k < (count > 0 ? count : 1); k++) {
            const int64_t node = count > 0 ? from[k] : own;
            int64_t earlier = 0;
            while (list && earlier < n && list[earlier] != node)
                earlier++;
            if (list)
                list[earlier] = node;
            n += !list || earlier == n;
        }
    }
    return n;
}

/* Under a force at a point of large deformation the group that it is spread over has a stiffness as if it were an
 * element (finite/point_load.h). */
static bool couple(neighbours *n, const uz_scene *scene)
{
    const uz_mesh *mesh = &n->model->mesh;
    int64_t elements = mesh->n_elements, room = n->tied.first[mesh->n_elements];
    for (int64_t i = 0; i < scene->n_loads && scene->kinematics == UZ_KINEMATICS_FINITE; i++) {
        const uz_group *group = scene->loads[i].has_point ? uz_mesh_group(mesh, scene->loads[i].on, "", NULL) : NULL;
        room += group ? list_carriers(NULL, n->model, group) : 0;
        elements += group != NULL;
    }
    if (elements == mesh->n_elements)
        return true;
    int64_t *first = uz_alloc(elements + 1, sizeof *first), *node = uz_alloc(room, sizeof *node);
    const bool done = first && node;
    if (done) {
        memcpy(first, n->tied.first, (size_t)(mesh->n_elements + 1) * sizeof *first);
        memcpy(node, n->tied.node, (size_t)first[mesh->n_elements] * sizeof *node);
    }
    for (int64_t i = 0, e = mesh->n_elements; done && e < elements; i++) {
        const uz_group *group = scene->loads[i].has_point ? uz_mesh_group(mesh, scene->loads[i].on, "", NULL) : NULL;
        if (!group)
            continue;
        const int64_t count = list_carriers(node + first[e], n->model, group);
        n->most_nodes = count > n->most_nodes ? count : n->most_nodes;
        first[e + 1] = first[e] + count;
        e++;
    }
    free(n->first);
    free(n->node);
    n->tied.first = n->first = first;
    n->tied.node = n->node = node;
    n->tied.n_elements = elements;
    return done;
}

uz_status uz_build_pattern(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    neighbours n = {.model = model,
                    .start = uz_alloc(mesh->n_nodes + 1, sizeof *n.start),
                    .ptr = uz_alloc_zero(model->d + 1, sizeof *n.ptr),
                    .ptr_fixed = uz_alloc_zero(model->n_fixed + 1, sizeof *n.ptr_fixed)};
    uz_status status = UZ_ERR_MEMORY;
    int64_t most = 0;
    if (tie(&n) && (!scene || couple(&n, scene)))
        n.around = uz_alloc(n.tied.first[n.tied.n_elements], sizeof *n.around);
    if (n.start && n.around && n.ptr && n.ptr_fixed) {
        uz_mesh_list_around(n.start, n.around, &n.tied);
        for (int64_t a = 0; a < mesh->n_nodes; a++)
            most = n.start[a + 1] - n.start[a] > most ? n.start[a + 1] - n.start[a] : most;
        status = walk_columns(model, &n, most * n.most_nodes, err); /* each counted for every element it shares */
    } else {
        uz_fail(err, status, "", "no memory for the pattern of %lld unknowns", (long long)model->d);
    }
    uz_free_all(n.ptr, n.ptr_fixed, n.first, n.node, n.start, n.around);
    return status;
}
