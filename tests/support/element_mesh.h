/* element_mesh.h: small meshes of one kind of element, with an assembly and a solver of their own, so that tests of
 * elements need nothing but elements. */
#ifndef TESTS_ELEMENT_MESH_H
#define TESTS_ELEMENT_MESH_H

#include "core/alloc.h"
#include "element/element.h"
#include "harness.h"
#include "scene/mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Volume per reference volume at a local point whose Jacobian's determinant is det: det times thickness, 2 pi r or 1.
 */
static inline double element_measure(const uz_element *element, const double point[3], double det)
{
    double N[UZ_ELEMENT_NODES], radius = 0;
    if (element->model == UZ_SOLID)
        return det;
    if (element->model != UZ_AXISYMMETRIC)
        return det * element->thickness;
    uz_element_shape(N, element->kind, point);
    for (int a = 0; a < uz_element_node_count(element->kind); a++)
        radius += N[a] * element->xyz[2 * a];
    return det * 6.28318530717958647693 * radius;
}

/* M, nodes x nodes: integral N N' over a side's area. */
static inline void side_mass(double *M, const uz_side *side)
{
    const int n = side->nodes;
    memset(M, 0, (size_t)(n * n) * sizeof *M);
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        double point[2], N[UZ_SIDE_NODES], vector[3] = {0};
        const double weight = uz_side_gauss(point, side, g);
        uz_side_shape(N, side, point);
        uz_side_area_vector(vector, side, point);
        const double area = weight * hypot(hypot(vector[0], vector[1]), vector[2]);
        for (int a = 0; a < n; a++)
            for (int b = 0; b < n; b++)
                M[n * a + b] += area * (N[a] * N[b]);
    }
}

typedef struct {
    uz_element element; /* of all elements but for xyz */
    int dim, per, n_nodes, n_elements;
    double *xyz;
    int *node;   /* n_elements x per */
    int *middle; /* n_nodes x 2: the corners that a node lies between, or -1 */
} small_mesh;

static inline void *zeros(size_t count, size_t size)
{
    void *p = calloc(count + 1, size);
    if (!p)
        abort();
    return p;
}

static inline void small_mesh_free(small_mesh *mesh)
{
    uz_free_all(mesh->xyz, mesh->node, mesh->middle);
    *mesh = (small_mesh){0};
}

/* Uniform numbers in [-1, 1], the same in every run. */
static inline double shake(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) * 0x1p-52 - 1;
}

/* Local corners of the edge of each node behind the corners. */
static inline const int (*edges_of(uz_element_kind kind))[2]
{
    return uz_element_type_of(kind)->edge;
}

static inline int corner_count(uz_element_kind kind)
{
    return uz_element_type_of(kind)->corners;
}

/* The corners of the elements that fill a cell, as bits 0, 1, 2 for x, y, z. Returns how many elements. */
static inline int cell_corners(int corner[UZ_ELEMENT_PARTS][UZ_ELEMENT_CORNERS], uz_element_kind kind)
{
    static const int BITS[UZ_ELEMENT_CORNERS] = {0, 1, 3, 2, 4, 5, 7, 6};
    const uz_element_type *linear = uz_element_type_of(uz_element_type_of(kind)->linear);
    for (int t = 0; t < linear->parts; t++)
        for (int a = 0; a < linear->corners; a++)
            corner[t][a] = BITS[linear->part[t][a]];
    return linear->parts;
}

/* Numbers a lattice point on its first use. */
static inline int lattice_node(small_mesh *mesh, int *number, const int at[3], const int n[3])
{
    int *slot = &number[(at[2] * (2 * n[1] + 1) + at[1]) * (2 * n[0] + 1) + at[0]];
    if (*slot == 0) {
        for (int c = 0; c < mesh->dim; c++)
            mesh->xyz[mesh->n_nodes * mesh->dim + c] = 0.5 * at[c] / n[c];
        mesh->middle[2 * mesh->n_nodes] = mesh->middle[2 * mesh->n_nodes + 1] = -1;
        *slot = ++mesh->n_nodes;
    }
    return *slot - 1;
}

static inline void add_small_element(small_mesh *mesh, int *number, const int *corner, const int cell[3],
                                     const int n[3])
{
    int at[UZ_ELEMENT_NODES][3], *node = mesh->node + mesh->n_elements++ * mesh->per;
    const int corners = corner_count(mesh->element.kind);
    const int(*edge)[2] = edges_of(mesh->element.kind);
    for (int a = 0; a < mesh->per; a++) {
        for (int c = 0; c < 3; c++)
            at[a][c] = a < corners ? 2 * cell[c] + 2 * (corner[a] >> c & 1)
                                   : (at[edge[a - corners][0]][c] + at[edge[a - corners][1]][c]) / 2;
        node[a] = lattice_node(mesh, number, at[a], n);
    }
    for (int a = corners; a < mesh->per; a++)
        for (int k = 0; k < 2; k++)
            mesh->middle[2 * node[a] + k] = node[edge[a - corners][k]];
}

/* The unit square or cube in n[0] x n[1] [x n[2]] cells. Elements of `element` but for xyz. */
static inline small_mesh small_grid(uz_element element, int n_x, int n_y, int n_z)
{
    small_mesh mesh = {.element = element, .dim = uz_element_type_of(element.kind)->dim};
    const int n[3] = {n_x, n_y, mesh.dim == 3 ? n_z : 1}, layers = mesh.dim == 3 ? n_z : 1;
    const size_t lattice = (size_t)((2 * n[0] + 1) * (2 * n[1] + 1) * (2 * n[2] + 1));
    int corner[UZ_ELEMENT_PARTS][UZ_ELEMENT_CORNERS], *number = zeros(lattice, sizeof *number),
                                                      cells = n[0] * n[1] * layers;
    const int in_cell = cell_corners(corner, element.kind);
    mesh.per = uz_element_node_count(element.kind);
    mesh.xyz = zeros(lattice * 3, sizeof *mesh.xyz);
    mesh.middle = zeros(lattice * 2, sizeof *mesh.middle);
    mesh.node = zeros((size_t)(cells * in_cell * mesh.per), sizeof *mesh.node);
    for (int i = 0; i < cells; i++) {
        const int cell[3] = {i / (n[1] * layers), i / layers % n[1], i % layers};
        for (int t = 0; t < in_cell; t++)
            add_small_element(&mesh, number, corner[t], cell, n);
    }
    free(number);
    return mesh;
}

/* Middle nodes back to the middles. */
static inline void straighten(small_mesh *mesh)
{
    for (int a = 0; a < mesh->n_nodes; a++)
        for (int c = 0; c < mesh->dim && mesh->middle[2 * a] >= 0; c++)
            mesh->xyz[a * mesh->dim + c] = 0.5 * (mesh->xyz[mesh->middle[2 * a] * mesh->dim + c] +
                                                  mesh->xyz[mesh->middle[2 * a + 1] * mesh->dim + c]);
}

/* Is the node on the boundary of the unit square or cube? Before any mapping of it. */
static inline bool on_boundary(const small_mesh *mesh, int a)
{
    for (int c = 0; c < mesh->dim; c++)
        if (mesh->xyz[a * mesh->dim + c] == 0 || mesh->xyz[a * mesh->dim + c] == 1)
            return true;
    return false;
}

/* Moves the inner corners by at most `far` along each axis, then the middles between. */
static inline void distort(small_mesh *mesh, double far, uint64_t seed)
{
    for (int a = 0; a < mesh->n_nodes; a++)
        if (mesh->middle[2 * a] < 0 && !on_boundary(mesh, a))
            for (int c = 0; c < mesh->dim; c++)
                mesh->xyz[a * mesh->dim + c] += far * shake(&seed);
    straighten(mesh);
}

/* x of the unit square or cube to origin + size * x. */
static inline void stretch(small_mesh *mesh, const double *origin, const double *size)
{
    for (int a = 0; a < mesh->n_nodes; a++)
        for (int c = 0; c < mesh->dim; c++)
            mesh->xyz[a * mesh->dim + c] = origin[c] + size[c] * mesh->xyz[a * mesh->dim + c];
}

/* One element with its coordinates in xe (nodes x dim), and what `nodal` has at its nodes. */
static inline uz_element take_element(double *xe, double *ue, const small_mesh *mesh, const double *nodal, int e)
{
    uz_element element = mesh->element;
    for (int a = 0; a < mesh->per; a++)
        for (int c = 0; c < mesh->dim; c++) {
            const int i = mesh->node[e * mesh->per + a] * mesh->dim + c;
            xe[a * mesh->dim + c] = mesh->xyz[i];
            if (nodal)
                ue[a * mesh->dim + c] = nodal[i];
        }
    element.xyz = xe;
    return element;
}

/* Calls `load` with each side all of whose nodes are marked, its nodes' numbers, and ctx. */
static inline void each_side(const small_mesh *mesh, const bool *marked, void *ctx,
                             void (*load)(void *ctx, const uz_side *side, const int *node))
{
    for (int e = 0; e < mesh->n_elements; e++)
        for (int s = 0; s < uz_element_type_of(mesh->element.kind)->sides; s++) {
            double xs[3 * UZ_SIDE_NODES];
            const uz_element_side *at = &uz_element_type_of(mesh->element.kind)->side[s];
            const int *local = at->node;
            int node[UZ_SIDE_NODES], on = 0;
            const uz_side side = {mesh->dim, at->nodes, mesh->element.model, mesh->element.thickness, xs};
            for (int a = 0; a < side.nodes; a++) {
                node[a] = mesh->node[e * mesh->per + local[a]];
                on += marked[node[a]];
                memcpy(xs + a * mesh->dim, mesh->xyz + node[a] * mesh->dim, (size_t)mesh->dim * sizeof *xs);
            }
            if (on == side.nodes)
                load(ctx, &side, node);
        }
}

/* A symmetric matrix by rows of its lower triangle, row i from column first[i] on at value[start[i]]. */
typedef struct {
    int n, *first;
    size_t *start;
    double *value;
} skyline;

static inline double *sky_row(const skyline *K, int i)
{
    return K->value + K->start[i] - K->first[i];
}

static inline void skyline_free(skyline *K)
{
    uz_free_all(K->first, K->start, K->value);
}

static inline skyline skyline_of(const small_mesh *mesh)
{
    skyline K = {.n = mesh->n_nodes * mesh->dim};
    K.first = zeros((size_t)K.n, sizeof *K.first);
    K.start = zeros((size_t)K.n + 1, sizeof *K.start);
    for (int i = 0; i < K.n; i++)
        K.first[i] = i;
    for (int e = 0; e < mesh->n_elements; e++) {
        const int *node = mesh->node + e * mesh->per;
        for (int a = 0; a < mesh->per; a++)
            for (int b = 0; b < mesh->per; b++)
                for (int c = 0; c < mesh->dim; c++)
                    if (node[b] * mesh->dim < K.first[node[a] * mesh->dim + c])
                        K.first[node[a] * mesh->dim + c] = node[b] * mesh->dim;
    }
    for (int i = 0; i < K.n; i++)
        K.start[i + 1] = K.start[i] + (size_t)(i - K.first[i] + 1);
    K.value = zeros(K.start[K.n], sizeof *K.value);
    return K;
}

static inline skyline assemble(const small_mesh *mesh)
{
    skyline K = skyline_of(mesh);
    double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], xe[UZ_ELEMENT_DOFS];
    const int dim = mesh->dim, dofs = mesh->per * dim;
    for (int e = 0; e < mesh->n_elements; e++) {
        const uz_element element = take_element(xe, NULL, mesh, NULL, e);
        const uz_shape_fault fault = uz_element_stiffness(ke, &element);
        CHECK_MSG(fault == UZ_SHAPE_GOOD, "element %d %s", e, uz_shape_fault_text(fault));
        for (int i = 0; i < dofs; i++)
            for (int j = 0; j < dofs; j++) {
                const int row = mesh->node[e * mesh->per + i / dim] * dim + i % dim;
                const int column = mesh->node[e * mesh->per + j / dim] * dim + j % dim;
                if (column <= row)
                    sky_row(&K, row)[column] += ke[i * dofs + j];
            }
    }
    return K;
}

/* f = K u. */
static inline void sky_times(double *f, const skyline *K, const double *u)
{
    memset(f, 0, (size_t)K->n * sizeof *f);
    for (int i = 0; i < K->n; i++)
        for (int j = K->first[i]; j <= i; j++) {
            f[i] += sky_row(K, i)[j] * u[j];
            if (j < i)
                f[j] += sky_row(K, i)[j] * u[i];
        }
}

/* Cholesky in the profile, fixed rows left out. */
static inline bool sky_factor(skyline *K, const bool *fixed)
{
    for (int i = 0; i < K->n; i++) {
        double *row = sky_row(K, i);
        for (int j = K->first[i]; j <= i && !fixed[i]; j++) {
            const double *other = sky_row(K, j);
            double sum = row[j];
            for (int k = K->first[i] > K->first[j] ? K->first[i] : K->first[j]; k < j; k++)
                sum -= row[k] * other[k];
            if (i == j && !(sum > 0))
                return false;
            row[j] = fixed[j] ? 0 : i == j ? sqrt(sum) : sum / other[j];
        }
        if (fixed[i])
            memset(row + K->first[i], 0, (size_t)(i - K->first[i] + 1) * sizeof *row);
    }
    return true;
}

/* Solves K u = f where u is not fixed; at entry u has the values of fixed dofs, elsewhere anything. */
static inline void solve_small(double *u, const small_mesh *mesh, const double *f, const bool *fixed)
{
    skyline K = assemble(mesh);
    double *given = zeros((size_t)K.n, sizeof *given), *x = zeros((size_t)K.n, sizeof *x);
    for (int i = 0; i < K.n; i++)
        given[i] = fixed[i] ? u[i] : 0;
    sky_times(x, &K, given);
    CHECK(sky_factor(&K, fixed));
    for (int i = 0; i < K.n; i++) {
        const double *row = sky_row(&K, i);
        x[i] = fixed[i] ? 0 : (f ? f[i] : 0) - x[i];
        for (int k = K.first[i]; k < i && !fixed[i]; k++)
            x[i] -= row[k] * x[k];
        x[i] = fixed[i] ? 0 : x[i] / row[i];
    }
    for (int i = K.n - 1; i >= 0; i--) {
        const double *row = sky_row(&K, i);
        if (fixed[i])
            continue;
        x[i] /= row[i];
        for (int k = K.first[i]; k < i; k++)
            x[k] -= row[k] * x[i];
    }
    for (int i = 0; i < K.n; i++)
        if (!fixed[i])
            u[i] = x[i];
    free(given);
    free(x);
    skyline_free(&K);
}

/* Every kind, model and formulation that there is: the i-th of them, false behind the last. Young's modulus 70. */
static inline bool each_element(uz_element *element, int i, double poisson)
{
    int count = 0;
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (int model = 0; model <= UZ_SOLID; model++)
            for (int way = UZ_FORMULATION_STANDARD; way < UZ_FORMULATIONS; way++) {
                const uz_element_kind k = (uz_element_kind)kind;
                const uz_model m = (uz_model)model;
                const uz_formulation f = (uz_formulation)way;
                if ((uz_element_type_of(k)->dim == 3) != (m == UZ_SOLID) || uz_resolve_formulation(f, k, m, 0) != f ||
                    count++ != i)
                    continue;
                *element = (uz_element){k, m, f, uz_lame_of(m, 70, poisson), .thickness = 0.75};
                return true;
            }
    return false;
}

/* A distorted element with straight sides, away from the axis, `scale` times as large: coordinates in xe. */
static inline uz_element bent(double *xe, uz_element element, double scale)
{
    uint64_t seed = 7;
    const int dim = uz_element_type_of(element.kind)->dim, nodes = uz_element_node_count(element.kind);
    const int corners = corner_count(element.kind);
    const int(*edge)[2] = edges_of(element.kind);
    for (int a = 0; a < nodes; a++)
        for (int c = 0; c < dim; c++) {
            const double at = uz_element_type_of(element.kind)->local[a][c] + 0.15 * shake(&seed);
            xe[a * dim + c] = a < corners
                                  ? scale * ((c == 1 ? 0.7 : 1.0) * at + (c == 0 ? 3 : 0.4))
                                  : 0.5 * (xe[edge[a - corners][0] * dim + c] + xe[edge[a - corners][1] * dim + c]);
        }
    element.xyz = xe;
    return element;
}

static inline const char *element_words(const uz_element *element)
{
    static const char *const MODEL[] = {"plane_stress", "plane_strain", "axisymmetric", "solid"};
    static const char *const WAY[] = {"auto", "standard", "bbar", "incompatible"};
    static char words[96];
    snprintf(words, sizeof words, "%s %s %s", uz_element_name(element->kind), MODEL[element->model],
             WAY[element->formulation]);
    return words;
}

#endif
