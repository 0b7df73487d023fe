/* Meshes of elements against exact solutions and published ones: orders of convergence, bending, locking. */
#include "element_mesh.h"
#include "harness.h"

/* ------------------------------------------------- orders of convergence
 * A smooth displacement is chosen, u_c = sin(k_c . x + c), the body force that it needs follows by differentiating, and
 * the boundary moves with it. The error in the energy norm must fall with the size of the elements to the power of
 * their degree (Strang and Fix, "An Analysis of the Finite Element Method", theorem 3.7). */

static const double WAVE[3][3] = {{1.1, 0.7, 0.4}, {0.5, -1.2, 0.6}, {-0.3, 0.8, 1.0}};

static double phase(int c, const double *x, int dim)
{
    double sum = c;
    for (int j = 0; j < dim; j++)
        sum += WAVE[c][j] * x[j];
    return sum;
}

/* H[c][j] = du_c / dx_j. */
static void exact_gradient(double H[3][3], const double *x, int dim)
{
    memset(H, 0, 9 * sizeof H[0][0]);
    for (int c = 0; c < dim; c++)
        for (int j = 0; j < dim; j++)
            H[c][j] = WAVE[c][j] * cos(phase(c, x, dim));
}

static void exact_strain(double *strain, const uz_element *element, const double *x)
{
    double H[3][3];
    const int dim = uz_element_dim(element->kind);
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
static void exact_force(double *b, const uz_element *element, const double *x)
{
    const int dim = uz_element_dim(element->kind);
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
static void place(double x[3], const uz_element *element, const double at[3])
{
    double N[UZ_ELEMENT_NODES];
    const int dim = uz_element_dim(element->kind), nodes = uz_element_node_count(element->kind);
    uz_element_shape(N, element->kind, at);
    for (int c = 0; c < dim; c++) {
        x[c] = 0;
        for (int a = 0; a < nodes; a++)
            x[c] += N[a] * element->xyz[a * dim + c];
    }
}

static double energy(const uz_element *element, const double *strain)
{
    double stress[6], sum = 0;
    uz_elastic_stress(stress, element->model, element->lame, strain);
    for (int s = 0; s < uz_stress_count(element->model); s++)
        sum += stress[s] * strain[s];
    return sum;
}

/* Adds an element's mean of the error's energy, and of the solution's. Taken half way from the centre to each node,
 * where nothing is more exact than elsewhere, as it is at Gauss points. */
static void add_error(double *error2, double *energy2, const uz_element *element, const double *ue)
{
    const int nodes = uz_element_node_count(element->kind);
    const double(*local)[3] = uz_element_local_nodes(element->kind);
    uz_element_motion motion;
    uz_element_move(&motion, element, ue);
    for (int a = 0; a < nodes; a++) {
        double at[3], x[3], grad[UZ_ELEMENT_NODES][3], got[6], want[6];
        for (int c = 0; c < 3; c++) {
            at[c] = 0.5 * local[a][c];
            for (int b = 0; b < nodes; b++)
                at[c] += 0.5 * local[b][c] / nodes;
        }
        const double volume = uz_element_measure(element, at, uz_element_gradients(grad, element, at));
        place(x, element, at);
        uz_element_strain(got, &motion, at);
        exact_strain(want, element, x);
        for (int s = 0; s < uz_stress_count(element->model); s++)
            got[s] -= want[s];
        *error2 += volume * energy(element, got);
        *energy2 += volume * energy(element, want);
    }
}

static double energy_error(const small_mesh *mesh, const double *u)
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
static void add_exact_force(double *f, const small_mesh *mesh)
{
    for (int e = 0; e < mesh->n_elements; e++) {
        double xe[UZ_ELEMENT_DOFS], N[UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], b[3], at[3], x[3];
        const uz_element element = take_element(xe, NULL, mesh, NULL, e);
        for (int g = 0; g < uz_element_gauss_count(element.kind, element.model); g++) {
            double weight = uz_element_gauss(at, element.kind, element.model, g);
            weight *= uz_element_measure(&element, at, uz_element_gradients(grad, &element, at));
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
static double manufactured(const uz_element *element, int cells)
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

TEST(errors_fall_with_the_degree)
{
    uz_element element;
    for (int i = 0; each_element(&element, i, 0.3); i++) {
        const bool quadratic = uz_element_node_count(element.kind) > corner_count(element.kind);
        const bool solid = element.model == UZ_SOLID;
        const int coarse = solid ? (quadratic ? 2 : 4) : (quadratic ? 4 : 8), fine = 2 * coarse;
        const double first = manufactured(&element, coarse), second = manufactured(&element, fine);
        const double order = log2(first / second), want = quadratic ? 2 : 1;
        CHECK_MSG(fabs(order - want) < 0.1, "%s: errors %g, %g, order %.2f, want %g", element_words(&element), first,
                  second, order, want);
    }
}
