/* element_accuracy.h: how exact elements are on small meshes: the patch test, and orders of convergence. */
#ifndef TESTS_ELEMENT_ACCURACY_H
#define TESTS_ELEMENT_ACCURACY_H

#include "element_mesh.h"

/* ------------------------------------------------- the patch test
 * (Irons; Zienkiewicz and Taylor, vol. 1): a distorted mesh whose boundary moves by a linear field has that field
 * inside, to rounding, whatever the element and its formulation. */

/* The linear field, of a kind that is in equilibrium without body forces: a ring's has equal radial and hoop strain. */
static inline double field(const small_mesh *mesh, int a, int c)
{
    static const double H[3][3] = {{0.3, -0.7, 0.2}, {0.4, 0.5, 0.9}, {-0.6, 0.1, -0.8}};
    double value = 0;
    for (int j = 0; j < mesh->dim; j++)
        if (mesh->element.model != UZ_AXISYMMETRIC || c == j)
            value += H[c][j] * mesh->xyz[a * mesh->dim + j];
    return value;
}

/* The largest error in the nodes of a distorted mesh, over its size `scale`. */
static inline double patch_error(const uz_element *element, double scale)
{
    small_mesh mesh = small_grid(*element, 3, 3, 3);
    const int n = mesh.n_nodes * mesh.dim;
    double *u = zeros((size_t)n, sizeof *u), worst = 0;
    bool *fixed = zeros((size_t)n, sizeof *fixed);
    for (int i = 0; i < n; i++)
        fixed[i] = on_boundary(&mesh, i / mesh.dim);
    distort(&mesh, 0.1, 5);
    stretch(&mesh, (const double[3]){0.5 * scale, 0, 0}, (const double[3]){scale, 0.8 * scale, 1.1 * scale});
    for (int i = 0; i < n; i++)
        u[i] = fixed[i] ? field(&mesh, i / mesh.dim, i % mesh.dim) : 0;
    solve_small(u, &mesh, NULL, fixed);
    for (int i = 0; i < n; i++)
        worst = fmax(worst, fabs(u[i] - field(&mesh, i / mesh.dim, i % mesh.dim)));
    free(u);
    free(fixed);
    small_mesh_free(&mesh);
    return worst / scale;
}

/* ------------------------------------------------- orders of convergence
 * A smooth displacement is chosen, u_c = sin(k_c . x + c), the body force that it needs follows by differentiating, and
 * the boundary moves with it. The error in the energy norm must fall with the size of the elements to the power of
 * their degree (Strang and Fix, "An Analysis of the Finite Element Method", theorem 3.7). */

static const double WAVE[3][3] = {{1.1, 0.7, 0.4}, {0.5, -1.2, 0.6}, {-0.3, 0.8, 1.0}};

static inline double phase(int c, const double *x, int dim)
{
    double sum = c;
    for (int j = 0; j < dim; j++)
        sum += WAVE[c][j] * x[j];
    return sum;
}

/* H[c][j] = du_c / dx_j. */
static inline void exact_gradient(double H[3][3], const double *x, int dim)
{
    memset(H, 0, 9 * sizeof H[0][0]);
    for (int c = 0; c < dim; c++)
        for (int j = 0; j < dim; j++)
            H[c][j] = WAVE[c][j] * cos(phase(c, x, dim));
}

static inline void exact_strain(double *strain, const uz_element *element, const double *x)
{
    double H[3][3];
    const int dim = uz_element_type_of(element->kind)->dim;
    exact_gradient(H, x, dim);
    strain[0] = H[0][0];
    strain[1] = H[1][1];
    strain[2] = dim == 3 ? H[2][2] : H[0][1] + H[1][0];
    strain[3] = H[0][1] + H[1][0];
    if (element->model == UZ_AXISYMMETRIC)
        strain[2] = sin(phase(0, x, 2)) / x[0];
    strain[4] = H[1][2] + H[2][1];
    strain[5] = H[2][0] + H[0][2];
}

/* - div stress: second derivatives are - k_i k_j u_c. */
static inline void exact_force(double *b, const uz_element *element, const double *x)
{
    const int dim = uz_element_type_of(element->kind)->dim;
    const double lambda = element->lame.lambda, mu = element->lame.mu;
    double value[3];
    for (int c = 0; c < dim; c++) {
        value[c] = sin(phase(c, x, dim));
        b[c] = 0;
    }
    for (int c = 0; c < dim; c++)
        for (int j = 0; j < dim; j++) {
            b[c] += (lambda + mu) * WAVE[j][c] * WAVE[j][j] * value[j];
            b[c] += mu * WAVE[c][j] * WAVE[c][j] * value[c];
        }
    if (element->model == UZ_AXISYMMETRIC) { /* what u_r / r and the growing circumference add */
        double H[3][3];
        const double r = x[0];
        exact_gradient(H, x, 2);
        b[0] -= (lambda + 2 * mu) * (H[0][0] / r - value[0] / (r * r));
        b[1] -= lambda * H[0][1] / r + mu * (H[0][1] + H[1][0]) / r;
    }
}

/* Where a local point lies. */
static inline void place(double x[3], const uz_element *element, const double at[3])
{
    double N[UZ_ELEMENT_NODES];
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    uz_element_shape(N, element->kind, at);
    for (int c = 0; c < dim; c++) {
        x[c] = 0;
        for (int a = 0; a < nodes; a++)
            x[c] += N[a] * element->xyz[a * dim + c];
    }
}

static inline double energy(const uz_element *element, const double *strain)
{
    double stress[6], sum = 0;
    uz_elastic_stress(stress, element->model, element->lame, strain);
    for (int s = 0; s < uz_stress_count(element->model); s++)
        sum += stress[s] * strain[s];
    return sum;
}

/* Adds an element's mean of the error's energy, and of the solution's. Taken half way from the centre to each node,
 * where nothing is more exact than elsewhere, as it is at Gauss points. */
static inline void add_error(double *error2, double *energy2, const uz_element *element, const double *ue)
{
    const int nodes = uz_element_node_count(element->kind);
    const double(*local)[3] = uz_element_type_of(element->kind)->local;
    uz_element_motion motion;
    uz_element_move(&motion, element, ue);
    for (int a = 0; a < nodes; a++) {
        double at[3], x[3], grad[UZ_ELEMENT_NODES][3], got[6], want[6];
        for (int c = 0; c < 3; c++) {
            at[c] = 0.5 * local[a][c];
            for (int b = 0; b < nodes; b++)
                at[c] += 0.5 * local[b][c] / nodes;
        }
        const double volume = element_measure(element, at, uz_element_gradients(grad, element, at));
        place(x, element, at);
        uz_element_strain(got, &motion, at);
        exact_strain(want, element, x);
        for (int s = 0; s < uz_stress_count(element->model); s++)
            got[s] -= want[s];
        *error2 += volume * energy(element, got);
        *energy2 += volume * energy(element, want);
    }
}

static inline double energy_error(const small_mesh *mesh, const double *u)
{
    double error2 = 0, energy2 = 0;
    for (int e = 0; e < mesh->n_elements; e++) {
        double xe[UZ_ELEMENT_DOFS], ue[UZ_ELEMENT_DOFS];
        const uz_element element = take_element(xe, ue, mesh, u, e);
        add_error(&error2, &energy2, &element, ue);
    }
    return sqrt(error2 / energy2);
}

/* By the element's own rule, which is good enough for a smooth force. */
static inline void add_exact_force(double *f, const small_mesh *mesh)
{
    for (int e = 0; e < mesh->n_elements; e++) {
        double xe[UZ_ELEMENT_DOFS], N[UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], b[3], x[3];
        const uz_element element = take_element(xe, NULL, mesh, NULL, e);
        const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
        for (int g = 0; g < rule->count; g++) {
            const double *at = rule->point[g].at;
            double weight = rule->point[g].weight;
            weight *= element_measure(&element, at, uz_element_gradients(grad, &element, at));
            place(x, &element, at);
            exact_force(b, &element, x);
            uz_element_shape(N, element.kind, at);
            for (int i = 0; i < mesh->per * mesh->dim; i++)
                f[mesh->node[e * mesh->per + i / mesh->dim] * mesh->dim + i % mesh->dim] +=
                    weight * N[i / mesh->dim] * b[i % mesh->dim];
        }
    }
}

/* The relative error in the energy norm on n x n [x n] cells, distorted in proportion to their size. */
static inline double manufactured(const uz_element *element, int cells)
{
    small_mesh mesh = small_grid(*element, cells, cells, cells);
    const int n = mesh.n_nodes * mesh.dim;
    double *u = zeros((size_t)n, sizeof *u), *f = zeros((size_t)n, sizeof *f);
    bool *fixed = zeros((size_t)n, sizeof *fixed);
    for (int i = 0; i < n; i++)
        fixed[i] = on_boundary(&mesh, i / mesh.dim);
    distort(&mesh, 0.1 / cells, 9);
    stretch(&mesh, (const double[3]){element->model == UZ_AXISYMMETRIC, 0, 0}, (const double[3]){1, 1, 1});
    for (int i = 0; i < n; i++)
        u[i] = sin(phase(i % mesh.dim, mesh.xyz + i / mesh.dim * mesh.dim, mesh.dim));
    add_exact_force(f, &mesh);
    solve_small(u, &mesh, f, fixed);
    const double error = energy_error(&mesh, u);
    free(u);
    free(f);
    free(fixed);
    small_mesh_free(&mesh);
    return error;
}

/* The power of the element size that the error falls with, and the errors of the coarser and the finer mesh. */
static inline double convergence_order(double errors[2], const uz_element *element)
{
    const bool quadratic = uz_element_node_count(element->kind) > corner_count(element->kind);
    const int coarse = element->model == UZ_SOLID ? (quadratic ? 2 : 4) : (quadratic ? 4 : 8);
    errors[0] = manufactured(element, coarse);
    errors[1] = manufactured(element, 2 * coarse);
    return log2(errors[0] / errors[1]);
}

static inline int element_degree(const uz_element *element)
{
    return uz_element_node_count(element->kind) > corner_count(element->kind) ? 2 : 1;
}

#endif
