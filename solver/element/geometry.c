/* geometry.c: from reference coordinates to the element as it lies: Jacobians, derivatives, volumes, and whether its
 * shape is one that can be integrated. */
#include "element/element_private.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

void uz_element_shape(double *N, uz_element_kind kind, const double point[3])
{
    const uz_element_type *type = uz_element_type_of(kind);
    type->shape(type, N, NULL, point);
}

const uz_gauss_rule *uz_element_rule(uz_element_kind kind, uz_model model)
{
    const uz_element_type *type = uz_element_type_of(kind);
    return model == UZ_AXISYMMETRIC && type->ring.count > 0 ? &type->ring : &type->rule;
}

/* Positions are taken from the first node, so that an element far from the origin keeps its digits. Inlined for each
 * dim, whose loops the compiler then unrolls. */
static inline void add_nodes(double J[3][3], const double *xyz, double local[UZ_ELEMENT_NODES][3], int nodes, int dim)
{
    for (int a = 1; a < nodes; a++)
        for (int j = 0; j < dim; j++) {
            const double from_first = xyz[a * dim + j] - xyz[j];
            for (int i = 0; i < dim; i++)
                J[i][j] += local[a][i] * from_first;
        }
}

void uz_jacobian(double J[3][3], const uz_element *element, double local[UZ_ELEMENT_NODES][3])
{
    double sum[3][3] = {{0}};
    const int nodes = uz_element_node_count(element->kind);
    if (uz_element_type_of(element->kind)->dim == 2)
        add_nodes(sum, element->xyz, local, nodes, 2);
    else
        add_nodes(sum, element->xyz, local, nodes, 3);
    memcpy(J, sum, sizeof sum);
}

static double determinant(double J[3][3], int dim)
{
    if (dim == 2)
        return J[0][0] * J[1][1] - J[0][1] * J[1][0];
    return J[0][0] * (J[1][1] * J[2][2] - J[1][2] * J[2][1]) + J[0][1] * (J[1][2] * J[2][0] - J[1][0] * J[2][2]) +
           J[0][2] * (J[1][0] * J[2][1] - J[1][1] * J[2][0]);
}

double uz_invert_small(double inverse[3][3], double J[3][3], int dim)
{
    const double det = determinant(J, dim), scale = 1 / det;
    if (dim == 2) {
        inverse[0][0] = J[1][1] * scale;
        inverse[0][1] = -J[0][1] * scale;
        inverse[1][0] = -J[1][0] * scale;
        inverse[1][1] = J[0][0] * scale;
        return det;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int p = (i + 1) % 3, q = (i + 2) % 3, s = (j + 1) % 3, t = (j + 2) % 3;
            inverse[j][i] = (J[p][s] * J[q][t] - J[p][t] * J[q][s]) * scale;
        }
    return det;
}

/* As add_nodes. Returns det J. */
static inline double find_gradients(double grad[UZ_ELEMENT_NODES][3], const double *xyz,
                                    double local[UZ_ELEMENT_NODES][3], int nodes, int dim)
{
    double J[3][3] = {{0}}, inverse[3][3];
    add_nodes(J, xyz, local, nodes, dim);
    const double det = uz_invert_small(inverse, J, dim);
    for (int a = 0; a < nodes; a++)
        for (int j = 0; j < dim; j++) {
            double sum = 0;
            for (int i = 0; i < dim; i++)
                sum += inverse[j][i] * local[a][i];
            grad[a][j] = sum;
        }
    return det;
}

double uz_element_gradients(double grad[UZ_ELEMENT_NODES][3], const uz_element *element, const double point[3])
{
    double local[UZ_ELEMENT_NODES][3];
    const uz_element_type *type = uz_element_type_of(element->kind);
    type->shape(type, NULL, local, point);
    return type->dim == 2 ? find_gradients(grad, element->xyz, local, type->nodes, 2)
                          : find_gradients(grad, element->xyz, local, type->nodes, 3);
}

double uz_ring_radius(double *largest, const uz_element *element, const double *N)
{
    double radius = 0;
    const int nodes = uz_element_node_count(element->kind);
    *largest = 0;
    for (int a = 0; a < nodes; a++) {
        radius += N[a] * element->xyz[2 * a];
        *largest = fmax(*largest, fabs(element->xyz[2 * a]));
    }
    return radius;
}

double uz_element_around(double around[UZ_ELEMENT_NODES], const uz_element *element, double grad[UZ_ELEMENT_NODES][3],
                         const double point[3])
{
    const int nodes = uz_element_node_count(element->kind);
    double N[UZ_ELEMENT_NODES], largest;
    memset(around, 0, (size_t)nodes * sizeof *around);
    if (element->model != UZ_AXISYMMETRIC)
        return element->model == UZ_SOLID ? 1 : element->thickness;
    uz_element_shape(N, element->kind, point);
    const double radius = uz_ring_radius(&largest, element, N);
    for (int a = 0; a < nodes; a++)
        around[a] = radius > UZ_AXIS * largest ? N[a] / radius : grad[a][0];
    return 2 * PI * radius;
}

void uz_gauss_state_at(uz_gauss_state *state, const uz_element *element, int g)
{
    double largest;
    const uz_gauss_point *at = &uz_element_rule(element->kind, element->model)->point[g];
    memcpy(state->point, at->at, sizeof at->at);
    state->det = uz_element_gradients(state->grad, element, state->point);
    state->volume = at->weight * state->det;
    if (element->model == UZ_AXISYMMETRIC) {
        uz_element_shape(state->N, element->kind, state->point);
        state->radius = uz_ring_radius(&largest, element, state->N);
        state->volume *= 2 * PI * state->radius;
    } else if (element->model != UZ_SOLID) {
        state->volume *= element->thickness;
    }
}

/* What a Gauss point stands for, as uz_gauss_state_at has it, without derivatives by x; N gets the shape functions. */
static double volume_at(double N[UZ_ELEMENT_NODES], const uz_element *element, int g)
{
    double local[UZ_ELEMENT_NODES][3], J[3][3], largest;
    const uz_element_type *type = uz_element_type_of(element->kind);
    const uz_gauss_point *at = &uz_element_rule(element->kind, element->model)->point[g];
    type->shape(type, N, local, at->at);
    uz_jacobian(J, element, local);
    const double volume = at->weight * determinant(J, type->dim);
    if (element->model == UZ_SOLID)
        return volume;
    return volume *
           (element->model == UZ_AXISYMMETRIC ? 2 * PI * uz_ring_radius(&largest, element, N) : element->thickness);
}

double uz_element_volume(const uz_element *element)
{
    double volume = 0, N[UZ_ELEMENT_NODES];
    const int count = uz_element_rule(element->kind, element->model)->count;
    for (int g = 0; g < count; g++)
        volume += volume_at(N, element, g);
    return volume;
}

double uz_mean_gradients(double mean[UZ_ELEMENT_NODES][3], const uz_element *element)
{
    double volume = 0;
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const int count = uz_element_rule(element->kind, element->model)->count;
    for (int a = 0; a < nodes; a++)
        mean[a][0] = mean[a][1] = mean[a][2] = 0;
    for (int g = 0; g < count; g++) {
        uz_gauss_state state;
        uz_gauss_state_at(&state, element, g);
        volume += state.volume;
        for (int a = 0; a < nodes; a++) {
            for (int j = 0; j < dim; j++)
                mean[a][j] += state.volume * state.grad[a][j];
            if (element->model == UZ_AXISYMMETRIC)
                mean[a][0] += state.volume * state.N[a] / state.radius;
        }
    }
    for (int a = 0; a < nodes; a++)
        for (int j = 0; j < dim; j++)
            mean[a][j] /= volume;
    return volume;
}

double uz_centre_jacobian(double inverse[3][3], const uz_element *element)
{
    static const double CENTRE[3] = {0, 0, 0};
    double local[UZ_ELEMENT_NODES][3], J[3][3];
    const uz_element_type *type = uz_element_type_of(element->kind);
    type->shape(type, NULL, local, CENTRE);
    uz_jacobian(J, element, local);
    return uz_invert_small(inverse, J, uz_element_type_of(element->kind)->dim);
}

void uz_mode_gradients(double grad[3][3], double centre[3][3], double centre_det, int dim, const double point[3],
                       double det)
{
    for (int m = 0; m < dim; m++)
        for (int j = 0; j < dim; j++)
            grad[m][j] = centre_det / det * -2 * point[m] * centre[j][m];
}

/* ------------------------------------------------------------------- loads */

void uz_element_add_body_force(double *f, const uz_element *element, const double *b)
{
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const int count = uz_element_rule(element->kind, element->model)->count;
    for (int g = 0; g < count; g++) {
        double N[UZ_ELEMENT_NODES];
        const double volume = volume_at(N, element, g);
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < dim; c++)
                f[a * dim + c] += volume * N[a] * b[c];
    }
}

/* A constant stress does the same work on the mean dilatation as on the strain itself, and none on incompatible modes:
 * so the plain B serves every formulation. */
void uz_element_add_thermal_load(double *f, const uz_element *element, const double *thermal_strain)
{
    double s[UZ_ELEMENT_STRESSES];
    const int dim = uz_element_type_of(element->kind)->dim, nodes = uz_element_node_count(element->kind);
    const int count = uz_element_rule(element->kind, element->model)->count;
    uz_elastic_stress(s, element->model, element->lame, thermal_strain);
    const bool ring = element->model == UZ_AXISYMMETRIC;
    const double shear = ring ? s[3] : s[2];
    for (int g = 0; g < count; g++) {
        uz_gauss_state state;
        uz_gauss_state_at(&state, element, g);
        for (int a = 0; a < nodes; a++) { /* what the node feels of it: its forces per volume, B_a' stress */
            const double *d = state.grad[a];
            double force[3] = {d[0] * s[0] + d[1] * shear, d[1] * s[1] + d[0] * shear};
            if (ring)
                force[0] += state.N[a] / state.radius * s[2];
            if (dim == 3) {
                force[0] = d[0] * s[0] + d[1] * s[3] + d[2] * s[5];
                force[1] = d[1] * s[1] + d[0] * s[3] + d[2] * s[4];
                force[2] = d[2] * s[2] + d[1] * s[4] + d[0] * s[5];
            }
            for (int c = 0; c < dim; c++)
                f[a * dim + c] += state.volume * force[c];
        }
    }
}

/* ------------------------------------------------------------------- check */

/* The worst fault of the Jacobian at nodes and Gauss points: det against the product of the rows' lengths is a sine,
 * whatever units and aspect ratio. Where it is constant one node tells, where it is linear all corners do. */
static uz_shape_fault check_jacobian(const uz_element *element)
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    const int dim = type->dim, nodes = type->jacobian == UZ_JACOBIAN_CONSTANT ? 1 : type->nodes;
    const int points = type->jacobian == UZ_JACOBIAN_CONSTANT || type->jacobian == UZ_JACOBIAN_LINEAR
                           ? nodes
                           : nodes + uz_element_rule(element->kind, element->model)->count;
    uz_shape_fault fault = UZ_SHAPE_GOOD;
    for (int k = 0; k < points; k++) {
        double local[UZ_ELEMENT_NODES][3], J[3][3], point[3], lengths = 1;
        if (k < nodes)
            memcpy(point, type->local[k], sizeof point);
        else
            memcpy(point, uz_element_rule(element->kind, element->model)->point[k - nodes].at, sizeof point);
        type->shape(type, NULL, local, point);
        uz_jacobian(J, element, local);
        for (int i = 0; i < dim; i++)
            lengths *= sqrt(J[i][0] * J[i][0] + J[i][1] * J[i][1] + (dim == 3 ? J[i][2] * J[i][2] : 0));
        const double det = determinant(J, dim);
        if (det < -UZ_FLAT * lengths)
            fault = UZ_SHAPE_INVERTED;
        else if (!(det > UZ_FLAT * lengths) && fault == UZ_SHAPE_GOOD)
            fault = UZ_SHAPE_DEGENERATE;
    }
    return fault;
}

uz_shape_fault uz_element_check(const uz_element *element)
{
    const uz_element_kind kind = element->kind;
    const uz_element_type *type = uz_element_type_of(kind);
    const uz_shape_fault fault = check_jacobian(element);
    uz_element corners = *element;
    corners.kind = type->linear;
    if (fault != UZ_SHAPE_GOOD)
        return corners.kind != kind && check_jacobian(&corners) == UZ_SHAPE_GOOD ? UZ_SHAPE_MIDDLES : fault;
    if (element->model != UZ_AXISYMMETRIC)
        return UZ_SHAPE_GOOD;
    /* A node on the axis may have a rounding error of a mesh's generator for a radius. Between good nodes the quadratic
     * radius of a curved side may still be negative. */
    const int points = type->nodes + uz_element_rule(kind, element->model)->count;
    for (int k = 0; k < points; k++) {
        double N[UZ_ELEMENT_NODES], point[3], largest;
        if (k < type->nodes)
            memcpy(point, type->local[k], sizeof point);
        else
            memcpy(point, uz_element_rule(kind, element->model)->point[k - type->nodes].at, sizeof point);
        uz_element_shape(N, kind, point);
        const double radius = uz_ring_radius(&largest, element, N);
        if (k < type->nodes ? radius < -UZ_AXIS * largest : radius <= 0)
            return UZ_SHAPE_NEGATIVE_RADIUS;
    }
    return UZ_SHAPE_GOOD;
}

const char *uz_shape_fault_text(uz_shape_fault fault)
{
    switch (fault) {
    case UZ_SHAPE_GOOD:
        return "has a good shape";
    case UZ_SHAPE_INVERTED:
        return "is inverted or not convex";
    case UZ_SHAPE_DEGENERATE:
        return "has no area or volume, or an angle of 0 or 180 degrees";
    case UZ_SHAPE_MIDDLES:
        return "has a node between two corners that is too far from their middle";
    case UZ_SHAPE_NEGATIVE_RADIUS:
        return "reaches across the axis: x is the radius and must not be negative";
    }
    return "has an unknown fault";
}
