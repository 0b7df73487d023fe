/* stiffness.c: the element matrices added up straight into compressed columns: first the pattern, node by node from the
 * elements around it, then the values, element by element. Neither a list of triplets nor a sort is needed. */
#include "assembly/parts.h"

#include "assembly/quad4.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { DIM = 2, CORNERS = 4, DOFS = 8 };

/* Elements around each node, and a scratch list of the nodes around one node. */
typedef struct {
    const uz_body_model *model;
    int64_t *start;  /* n_nodes + 1, into around */
    int64_t *around; /* n_elements x CORNERS */
    int64_t *seen;   /* n_nodes: 1 + the last node whose neighbours it was counted among */
    int64_t *near;   /* neighbours of the node at hand, itself included, ascending; most_near of them */
    int64_t n_near;
} neighbours;

static void neighbours_clear(neighbours *n)
{
    free(n->start);
    free(n->around);
    free(n->seen);
    free(n->near);
}

static int64_t fill_incidence(neighbours *n)
{
    const uz_mesh *mesh = &n->model->mesh;
    const int64_t corners = mesh->n_elements * CORNERS;
    int64_t most = 0;
    for (int64_t i = 0; i < corners; i++)
        n->start[mesh->node[i] + 1]++;
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        most = n->start[a + 1] > most ? n->start[a + 1] : most;
        n->start[a + 1] += n->start[a];
    }
    /* Filling from the back leaves start[a + 1] at the beginning of node a, one place too far: shifted back below. */
    for (int64_t i = corners - 1; i >= 0; i--)
        n->around[--n->start[mesh->node[i] + 1]] = i / CORNERS;
    memmove(n->start, n->start + 1, (size_t)mesh->n_nodes * sizeof *n->start);
    n->start[mesh->n_nodes] = corners;
    return most;
}

static bool neighbours_init(neighbours *n, const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    memset(n, 0, sizeof *n);
    n->model = model;
    n->start = uz_alloc_zero(mesh->n_nodes + 1, sizeof *n->start);
    n->around = uz_alloc(mesh->n_elements * CORNERS, sizeof *n->around);
    n->seen = uz_alloc_zero(mesh->n_nodes, sizeof *n->seen);
    if (!n->start || !n->around || !n->seen)
        return false;
    n->near = uz_alloc(fill_incidence(n) * CORNERS + 1, sizeof *n->near);
    return n->near != NULL;
}

/* Keeps the list ascending: it is short, and mostly comes in order. */
static void insert_near(neighbours *n, int64_t node)
{
    int64_t i = n->n_near++;
    for (; i > 0 && n->near[i - 1] > node; i--)
        n->near[i] = n->near[i - 1];
    n->near[i] = node;
}

static void gather(neighbours *n, int64_t node)
{
    const uz_mesh *mesh = &n->model->mesh;
    n->n_near = 0;
    for (int64_t i = n->start[node]; i < n->start[node + 1]; i++) {
        const int64_t *corner = mesh->node + n->around[i] * CORNERS;
        for (int k = 0; k < CORNERS; k++)
            if (n->seen[corner[k]] != node + 1) {
                n->seen[corner[k]] = node + 1;
                insert_near(n, corner[k]);
            }
    }
}

/* Free dofs >= first among the neighbours; written to out unless it is NULL. Returns how many. */
static int64_t free_rows(int64_t *out, const neighbours *n, int64_t first)
{
    const int64_t *dof = n->model->dof;
    int64_t count = 0;
    for (int64_t i = 0; i < n->n_near; i++)
        for (int c = 0; c < DIM; c++) {
            const int64_t row = dof[n->near[i] * DIM + c];
            if (row < first || row < 0)
                continue;
            if (out)
                out[count] = row;
            count++;
        }
    return count;
}

/* One column of K (rows from the diagonal on) or of K_fixed (all free rows) per dof: first how many entries it has ...
 */
static void count_columns(neighbours *n, int64_t *ptr, int64_t *ptr_fixed)
{
    for (int64_t a = 0; a < n->model->mesh.n_nodes; a++) {
        gather(n, a);
        for (int c = 0; c < DIM; c++) {
            const int64_t column = n->model->dof[a * DIM + c];
            *(column >= 0 ? &ptr[column + 1] : &ptr_fixed[-column]) = free_rows(NULL, n, column);
        }
    }
}

/* ... then which. */
static void fill_columns(uz_body_model *model, neighbours *n)
{
    const uz_csc *K = &model->K, *K_fixed = &model->K_fixed;
    memset(n->seen, 0, (size_t)model->mesh.n_nodes * sizeof *n->seen);
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        gather(n, a);
        for (int c = 0; c < DIM; c++) {
            const int64_t column = model->dof[a * DIM + c];
            free_rows(column >= 0 ? K->idx + K->ptr[column] : K_fixed->idx + K_fixed->ptr[-1 - column], n, column);
        }
    }
}

static void accumulate(int64_t *ptr, int64_t columns)
{
    for (int64_t j = 0; j < columns; j++)
        ptr[j + 1] += ptr[j];
}

static uz_status init_matrix(uz_csc *A, int64_t rows, int64_t cols, const int64_t *ptr, uz_error *err)
{
    uz_status status = uz_csc_init(A, rows, cols, ptr[cols], err);
    if (status == UZ_OK)
        memcpy(A->ptr, ptr, (size_t)(cols + 1) * sizeof *ptr);
    return status;
}

/* K and K_fixed with their patterns and all values zero. */
static uz_status build_pattern(uz_body_model *model, uz_error *err)
{
    neighbours n;
    uz_status status = UZ_ERR_MEMORY;
    int64_t *ptr = uz_alloc_zero(model->d + 1, sizeof *ptr);
    int64_t *ptr_fixed = uz_alloc_zero(model->n_fixed + 1, sizeof *ptr_fixed);
    if (!neighbours_init(&n, model) || !ptr || !ptr_fixed) {
        uz_fail(err, status, "", "no memory for the pattern of %lld unknowns", (long long)model->d);
        goto done;
    }
    count_columns(&n, ptr, ptr_fixed);
    accumulate(ptr, model->d);
    accumulate(ptr_fixed, model->n_fixed);
    status = init_matrix(&model->K, model->d, model->d, ptr, err);
    if (status == UZ_OK)
        status = init_matrix(&model->K_fixed, model->d, model->n_fixed, ptr_fixed, err);
    if (status == UZ_OK)
        fill_columns(model, &n);
done:
    free(ptr);
    free(ptr_fixed);
    neighbours_clear(&n);
    return status;
}

void uz_element_corners(double xy[8], const uz_mesh *mesh, int64_t element)
{
    const double w = mesh->cell[0], h = mesh->cell[1], rectangle[8] = {0, 0, w, 0, w, h, 0, h};
    const int64_t *corner = mesh->node + element * CORNERS;
    if (mesh->uniform) {
        memcpy(xy, rectangle, sizeof rectangle);
        return;
    }
    for (int a = 0; a < CORNERS; a++)
        for (int c = 0; c < DIM; c++)
            xy[DIM * a + c] = mesh->xyz[corner[a] * DIM + c] - mesh->xyz[corner[0] * DIM + c];
}

/* A sum of a few entries must not overflow either, and a stiffness must not vanish by underflow. */
static uz_status check_range(const double ke[64], int64_t element, uz_error *err)
{
    for (int i = 0; i < 64; i++)
        if (!(fabs(ke[i]) < DBL_MAX / 1024))
            return uz_fail(err, UZ_ERR_NOT_FINITE, "/materials",
                           "the stiffness of element %lld overflows; use other units", (long long)element);
    for (int i = 0; i < DOFS; i++)
        if (!(ke[9 * i] > DBL_MIN * 1024))
            return uz_fail(err, UZ_ERR_SCENE, "/materials",
                           "the stiffness of element %lld underflows to zero; use other units", (long long)element);
    return UZ_OK;
}

static uz_status element_stiffness(double ke[64], const uz_body_model *model, int64_t element, uz_error *err)
{
    double xy[8];
    const int64_t *corner = model->mesh.node + element * CORNERS;
    uz_element_corners(xy, &model->mesh, element);
    if (!uz_quad4_stiffness(ke, xy, model->elasticity, model->thickness))
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/elements",
                       "element %lld (nodes %lld, %lld, %lld, %lld) is inverted, not convex or without area; "
                       "give its nodes counter-clockwise",
                       (long long)element, (long long)corner[0], (long long)corner[1], (long long)corner[2],
                       (long long)corner[3]);
    return check_range(ke, element, err);
}

uz_status uz_check_elements(const uz_body_model *model, uz_error *err)
{
    double ke[64];
    uz_status status = UZ_OK;
    const int64_t kinds = model->mesh.uniform ? 1 : model->mesh.n_elements;
    for (int64_t e = 0; e < kinds && status == UZ_OK; e++)
        status = element_stiffness(ke, model, e, err);
    return status;
}

/* Adds to entry (row, column); the pattern has it. */
static void add_entry(uz_csc *A, int64_t row, int64_t column, double value)
{
    int64_t q = A->ptr[column];
    while (A->idx[q] != row)
        q++;
    A->val[q] += value;
}

static void add_element(uz_body_model *model, const double ke[64], int64_t element)
{
    double turned[64];
    if (uz_is_turned_element(model, element)) {
        memcpy(turned, ke, sizeof turned);
        uz_turn_element(turned, model, element);
        ke = turned;
    }
    const int64_t *corner = model->mesh.node + element * CORNERS;
    int64_t dof[DOFS];
    for (int a = 0; a < CORNERS; a++)
        for (int c = 0; c < DIM; c++)
            dof[DIM * a + c] = model->dof[corner[a] * DIM + c];
    for (int j = 0; j < DOFS; j++)
        for (int i = 0; i < DOFS; i++) {
            if (dof[i] < 0 || dof[i] < dof[j])
                continue;
            if (dof[j] >= 0)
                add_entry(&model->K, dof[i], dof[j], ke[DOFS * i + j]);
            else
                add_entry(&model->K_fixed, dof[i], -1 - dof[j], ke[DOFS * i + j]);
        }
}

uz_status uz_build_stiffness(uz_body_model *model, uz_error *err)
{
    double ke[64];
    uz_status status = build_pattern(model, err);
    for (int64_t e = 0; e < model->mesh.n_elements && status == UZ_OK; e++) {
        if (e == 0 || !model->mesh.uniform)
            status = element_stiffness(ke, model, e, err);
        if (status == UZ_OK)
            add_element(model, ke, e);
    }
    return status;
}
