#include "finite/turning.h"

#include "assembly/parts.h"
#include "core/cpu.h"
#include "element/element.h"

#include <math.h>
#include <string.h>

/* H[c][i] (dim x dim): the derivative of u_c by x_i. */
UZ_INLINE void gradient(double H[3][3], const uz_gauss_state *at, const double *u, int nodes, int dim)
{
    for (int c = 0; c < dim; c++)
        for (int i = 0; i < dim; i++) {
            H[c][i] = 0;
            for (int a = 1; a < nodes; a++)
                H[c][i] += (u[dim * a + c] - u[c]) * at->grad[a][i];
        }
}

UZ_INLINE void multiply(double out[3][3], double A[3][3], double B[3][3], int dim)
{
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) {
            out[i][j] = 0;
            for (int k = 0; k < dim; k++)
                out[i][j] += A[i][k] * B[k][j];
        }
}

/* R of a skew w (both dim x dim): (I + w) V^-1 with V^2 = I - w^2. Returns |w|^2. */
UZ_INLINE double rotation(double R[3][3], double w[3][3], int dim)
{
    double square = 0, ww[3][3];
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < i; j++)
            square += w[i][j] * w[i][j];
    const double root = sqrt(1 + square);
    multiply(ww, w, w, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            R[i][j] = (i == j) + w[i][j] / root + ww[i][j] / (root * (root + 1));
    return square;
}

/* H, of where a step begins, becomes what a turned step changes it by; h is the step's. out: the integrands. */
UZ_INLINE void turn(uz_turning *out, double H[3][3], double h[3][3], int dim)
{
    double F[3][3], inverse[3][3], g[3][3], w[3][3], stretch[3][3], R[3][3], to[3][3];
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            F[i][j] = (i == j) + H[i][j];
    uz_invert_small(inverse, F, dim);
    multiply(g, h, inverse, dim);
    out->strain = 0;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) {
            const double strain = 0.5 * (g[i][j] + g[j][i]);
            out->strain += strain * strain;
            stretch[i][j] = (i == j) + strain;
            w[i][j] = 0.5 * (g[i][j] - g[j][i]);
        }
    const double square = rotation(R, w, dim);
    out->turning = 0.5 * square * square; /* w'w is |w|^2 along both directions that turn */
    multiply(to, stretch, F, dim);
    multiply(H, R, to, dim);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            H[i][j] -= F[i][j];
}

UZ_INLINE void add_turning(uz_turning *out, double *force, const uz_element *element, const int64_t *node,
                           const double *u, const double *step, int dim)
{
    const int count = uz_element_node_count(element->kind);
    for (int g = 0; g < uz_element_rule(element->kind, element->model)->count; g++) {
        uz_gauss_state at;
        uz_turning own;
        double H[3][3], h[3][3], around = 0;
        uz_gauss_state_at(&at, element, g);
        const bool ring = element->model == UZ_AXISYMMETRIC;
        const double weight = element->lame.mu * at.volume;
        gradient(H, &at, u, count, dim);
        gradient(h, &at, step, count, dim);
        turn(&own, H, h, dim);
        out->turning += weight * own.turning;
        out->strain += weight * own.strain;
        for (int a = 0; a < count && ring; a++)
            around += at.N[a] / at.radius * step[dim * a];
        for (int a = 0; a < count; a++) {
            double *to = force + dim * node[a];
            for (int c = 0; c < dim; c++)
                for (int i = 0; i < dim; i++)
                    to[c] += weight * H[c][i] * at.grad[a][i];
            to[0] += ring ? weight * around * at.N[a] / at.radius : 0;
        }
    }
}

void uz_turning_of(uz_turning *out, double *force, const uz_body_model *model, const double *from, const double *to)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    *out = (uz_turning){.turning = 0};
    memset(force, 0, (size_t)(dim * mesh->n_nodes) * sizeof *force);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], step[UZ_ELEMENT_DOFS];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        uz_body_element(&element, xyz, model, e);
        for (int i = 0; i < dim * count; i++) {
            u[i] = from[dim * node[i / dim] + i % dim];
            step[i] = to[dim * node[i / dim] + i % dim] - u[i];
        }
        if (dim == 2)
            add_turning(out, force, &element, node, u, step, 2);
        else
            add_turning(out, force, &element, node, u, step, 3);
    }
}

/* The lower triangle of blocks, and with it the upper one. */
UZ_INLINE void add_metric(double *ke, const uz_element *element, int dim)
{
    const int count = uz_element_node_count(element->kind), n = dim * count;
    for (int g = 0; g < uz_element_rule(element->kind, element->model)->count; g++) {
        uz_gauss_state at;
        uz_gauss_state_at(&at, element, g);
        const double weight = element->lame.mu * at.volume;
        const double around = element->model == UZ_AXISYMMETRIC ? 1 / at.radius : 0;
        for (int a = 0; a < count; a++)
            for (int b = 0; b <= a; b++) {
                double *of = ke + dim * (n * a + b);
                double sum = 0;
                for (int i = 0; i < dim; i++)
                    sum += at.grad[a][i] * at.grad[b][i];
                for (int c = 0; c < dim; c++)
                    of[(n + 1) * c] += weight * sum;
                of[0] += around > 0 ? weight * around * around * at.N[a] * at.N[b] : 0;
            }
    }
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++)
            ke[n * k + i] = ke[n * i + k];
}

void uz_turning_metric(uz_body_model *metric, const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    memset(metric->K.val, 0, (size_t)metric->K.ptr[metric->K.cols] * sizeof *metric->K.val);
    memset(metric->K_fixed.val, 0, (size_t)metric->K_fixed.ptr[metric->K_fixed.cols] * sizeof *metric->K_fixed.val);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], xyz[3 * UZ_ELEMENT_NODES];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const size_t n = (size_t)(mesh->dim * count);
        memset(ke, 0, n * n * sizeof *ke);
        uz_body_element(&element, xyz, model, e);
        if (mesh->dim == 2)
            add_metric(ke, &element, 2);
        else
            add_metric(ke, &element, 3);
        uz_add_stiffness(metric, ke, node, count);
    }
}
