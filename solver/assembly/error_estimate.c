/* error_estimate.c: how much of the energy the mesh has missed.
 *
 * The stress of a finite element solution jumps from element to element; averaged at the nodes and interpolated, it is
 * closer to the true stress than the solution's own. The energy of the difference,
 *     eta^2 = integral of (s* - s_h)' C^-1 (s* - s_h) over the volume,
 * estimates the squared energy-norm error of u_h, and ||u||^2 is estimated by ||u_h||^2 + eta^2 (Galerkin
 * orthogonality). Stresses may jump where the material changes: there each material has its own average. */
#include "assembly/parts.h"

#include "core/alloc.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STRESSES = UZ_ELEMENT_STRESSES, NODES = UZ_ELEMENT_NODES, GAUSS = UZ_ELEMENT_GAUSS, LINEAR = 4 };

/* Stress at the Gauss points of an element; weight[g]: volume of each point. */
typedef struct {
    uz_element element;
    double xyz[3 * NODES], u[UZ_ELEMENT_DOFS];
    int nodes, points, stresses;
    double point[GAUSS][3], weight[GAUSS], stress[GAUSS][STRESSES], strain[GAUSS][STRESSES];
} element_state;

/* Averages: one place for each node and material that meet there. */
typedef struct {
    const uz_body_model *model;
    const double *nodal;
    const double *free_strain; /* n_elements: of the temperature; NULL: none */
    int64_t *place;            /* of each node of each element; NULL: the place is the node */
    int64_t count;
    double *sum, *volume; /* count x STRESSES, count */
} averaging;

static void evaluate(element_state *s, const averaging *x, int64_t e)
{
    const uz_mesh *mesh = &x->model->mesh;
    uz_element_motion motion;
    double grad[NODES][3], thermal[STRESSES] = {0}, elastic[STRESSES];
    const int64_t *node = uz_mesh_element(mesh, e, &s->nodes);
    uz_body_element(&s->element, s->xyz, x->model, e);
    if (x->free_strain)
        uz_thermal_strain(thermal, s->element.model, s->element.lame, x->free_strain[e]);
    for (int i = 0; i < s->nodes * mesh->dim; i++)
        s->u[i] = x->nodal[node[i / mesh->dim] * mesh->dim + i % mesh->dim];
    uz_element_move(&motion, &s->element, s->u);
    s->stresses = uz_stress_count(s->element.model);
    s->points = uz_element_gauss_count(s->element.kind, s->element.model);
    for (int g = 0; g < s->points; g++) {
        const double weight = uz_element_gauss(s->point[g], s->element.kind, s->element.model, g);
        const double det = uz_element_gradients(grad, &s->element, s->point[g]);
        s->weight[g] = weight * uz_element_measure(&s->element, s->point[g], det);
        uz_element_strain(s->strain[g], &motion, s->point[g]);
        for (int c = 0; c < s->stresses; c++)
            elastic[c] = s->strain[g][c] - thermal[c];
        uz_elastic_stress(s->stress[g], s->element.model, s->element.lame, elastic);
    }
}

static int64_t place_of(const averaging *x, int64_t e, int a)
{
    const int64_t i = x->model->mesh.first[e] + a;
    return x->place ? x->place[i] : x->model->mesh.node[i];
}

/* Adds the element's mean stress with its volume as weight. The mean is the stress at the centre, where that of a
 * linear element is most accurate; stresses continued to the corners would bring the solution's own error back into the
 * average and hide a third of it. */
static void add_mean(averaging *x, const element_state *s, int64_t e)
{
    for (int a = 0; a < s->nodes; a++) {
        const int64_t at = place_of(x, e, a);
        for (int g = 0; g < s->points; g++) {
            x->volume[at] += s->weight[g];
            for (int c = 0; c < s->stresses; c++)
                x->sum[at * STRESSES + c] += s->weight[g] * s->stress[g][c];
        }
    }
}

/* 1, x, y [, z] at a place, from the first node and over the element's size. */
static void linear_basis(double b[LINEAR], const element_state *s, double size, const double *x)
{
    const int dim = uz_element_dim(s->element.kind);
    b[0] = 1;
    for (int c = 0; c < dim; c++)
        b[c + 1] = (x[c] - s->xyz[c]) / size;
}

/* A X = B by elimination with pivots on the diagonal: A is a Gram matrix. A: n x n, B: n x STRESSES. */
static void solve_small(double A[LINEAR][LINEAR], double B[LINEAR][STRESSES], int n)
{
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++) {
            const double factor = i == k ? 0 : A[i][k] / A[k][k];
            for (int j = k; j < n && i != k; j++)
                A[i][j] -= factor * A[k][j];
            for (int j = 0; j < STRESSES && i != k; j++)
                B[i][j] -= factor * B[k][j];
        }
    for (int k = 0; k < n; k++)
        for (int j = 0; j < STRESSES; j++)
            B[k][j] /= A[k][k];
}

/* Adds, at each node, the linear function that fits the stresses of the Gauss points best: that of a quadratic element
 * is most accurate there. */
static void add_linear_fit(averaging *x, const element_state *s, int64_t e)
{
    const int dim = uz_element_dim(s->element.kind), n = dim + 1;
    double A[LINEAR][LINEAR] = {{0}}, B[LINEAR][STRESSES] = {{0}}, b[LINEAR], N[NODES], size = 0, volume = 0;
    for (int a = 1; a < s->nodes; a++)
        for (int c = 0; c < dim; c++)
            size = fmax(size, fabs(s->xyz[a * dim + c] - s->xyz[c]));
    for (int g = 0; g < s->points; g++) {
        double at[3] = {0};
        uz_element_shape(N, s->element.kind, s->point[g]);
        for (int i = 0; i < s->nodes * dim; i++)
            at[i % dim] += N[i / dim] * s->xyz[i];
        linear_basis(b, s, size, at);
        volume += s->weight[g];
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++)
                A[i][j] += s->weight[g] * b[i] * b[j];
            for (int c = 0; c < s->stresses; c++)
                B[i][c] += s->weight[g] * b[i] * s->stress[g][c];
        }
    }
    solve_small(A, B, n);
    for (int a = 0; a < s->nodes; a++) {
        const int64_t place = place_of(x, e, a);
        linear_basis(b, s, size, s->xyz + a * dim);
        x->volume[place] += volume;
        for (int c = 0; c < s->stresses; c++)
            for (int i = 0; i < n; i++)
                x->sum[place * STRESSES + c] += volume * b[i] * B[i][c];
    }
}

static void average_at_nodes(averaging *x)
{
    element_state s;
    for (int64_t e = 0; e < x->model->mesh.n_elements; e++) {
        evaluate(&s, x, e);
        if (uz_element_is_quadratic(s.element.kind))
            add_linear_fit(x, &s, e);
        else
            add_mean(x, &s, e);
    }
    for (int64_t a = 0; a < x->count; a++)
        for (int c = 0; c < STRESSES && x->volume[a] > 0; c++)
            x->sum[a * STRESSES + c] /= x->volume[a];
}

/* Adds one element's share of eta^2 and of ||u_h||^2. */
static void add_energies(double *eta2, double *energy2, const averaging *x, const element_state *s, int64_t e)
{
    double N[NODES], jump[STRESSES], whole[STRESSES];
    for (int g = 0; g < s->points; g++) {
        double work = 0;
        uz_element_shape(N, s->element.kind, s->point[g]);
        for (int c = 0; c < s->stresses; c++) {
            jump[c] = -s->stress[g][c];
            for (int a = 0; a < s->nodes; a++)
                jump[c] += N[a] * x->sum[place_of(x, e, a) * STRESSES + c];
        }
        uz_elastic_stress(whole, s->element.model, s->element.lame, s->strain[g]); /* ||u_h|| knows no temperature */
        for (int c = 0; c < s->stresses; c++)
            work += whole[c] * s->strain[g][c];
        *eta2 += s->weight[g] * uz_complementary(s->element.model, s->element.lame, jump);
        *energy2 += s->weight[g] * work;
    }
}

/* Numbers the pairs of node and material. next, material: of each pair; head: the first pair of a node, -1: none. */
static void number_places(averaging *x, int64_t *head, int64_t *next, int32_t *material)
{
    const uz_mesh *mesh = &x->model->mesh;
    x->count = 0;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        head[a] = -1;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e]; i < mesh->first[e + 1]; i++) {
            const int32_t own = x->model->material_of[e];
            int64_t at = head[mesh->node[i]];
            while (at >= 0 && material[at] != own)
                at = next[at];
            if (at < 0) {
                at = x->count++;
                material[at] = own;
                next[at] = head[mesh->node[i]];
                head[mesh->node[i]] = at;
            }
            x->place[i] = at;
        }
}

static bool make_places(averaging *x)
{
    const uz_mesh *mesh = &x->model->mesh;
    const int64_t most = mesh->n_elements > 0 ? mesh->first[mesh->n_elements] : 0;
    x->count = mesh->n_nodes;
    if (!x->model->material_of)
        return true;
    x->place = uz_alloc(most, sizeof *x->place);
    int64_t *head = uz_alloc(mesh->n_nodes, sizeof *head), *next = uz_alloc(most, sizeof *next);
    int32_t *material = uz_alloc(most, sizeof *material);
    const bool ok = x->place && head && next && material;
    if (ok)
        number_places(x, head, next, material);
    free(head);
    free(next);
    free(material);
    return ok;
}

static double estimate(averaging *x)
{
    element_state s;
    double eta2 = 0, energy2 = 0;
    if (make_places(x)) {
        x->sum = uz_alloc_zero(x->count * STRESSES, sizeof *x->sum);
        x->volume = uz_alloc_zero(x->count, sizeof *x->volume);
    }
    if (x->sum && x->volume) {
        average_at_nodes(x);
        for (int64_t e = 0; e < x->model->mesh.n_elements; e++) {
            evaluate(&s, x, e);
            add_energies(&eta2, &energy2, x, &s, e);
        }
    }
    free(x->sum);
    free(x->volume);
    free(x->place);
    return energy2 > 0 ? sqrt(eta2 / (energy2 + eta2)) : NAN;
}

double uz_estimate_discretization_error(const uz_body_model *model, const double *nodal)
{
    averaging x = {.model = model, .nodal = nodal};
    return estimate(&x);
}

double uz_estimate_mesh_error(const uz_body_model *model, const uz_scene *scene, const double *nodal)
{
    double *free_strain = NULL;
    if (uz_free_strains(&free_strain, model, scene, NULL) != UZ_OK)
        return NAN;
    averaging x = {.model = model, .nodal = nodal, .free_strain = free_strain};
    const double error = estimate(&x);
    free(free_strain);
    return error;
}
