/* brick.h: an elastic block of eight-node bricks, its face x = 0 held: K with coordinates, for solvers in three
 * dimensions. */
#ifndef TESTS_BRICK_H
#define TESTS_BRICK_H

#include "uzawa.h"

#include <math.h>
#include <stdlib.h>

typedef struct {
    int64_t n_nodes, d;
    double *xyz;  /* n_nodes x 3 */
    int64_t *dof; /* n_nodes x 3, -1: held */
    uz_csc K;     /* lower triangle */
} brick;

/* Corner a at (+-1, +-1, +-1): bits 0, 1, 2 of a are x, y, z. */
static inline double brick_sign(int a, int axis)
{
    return (a >> axis) & 1 ? 1.0 : -1.0;
}

/* ke (24 x 24) of a box with sides h: the integral over 2 x 2 x 2 Gauss points of lambda div div + mu (grad : grad +
 * grad : grad'), E = 1. */
static inline void brick_element(double ke[24][24], const double h[3], double poisson)
{
    double lambda = poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = 0.5 / (1 + poisson);
    double weight = h[0] * h[1] * h[2] / 8;
    for (int i = 0; i < 24 * 24; i++)
        ke[i / 24][i % 24] = 0.0;
    for (int q = 0; q < 8; q++) {
        double grad[8][3];
        for (int a = 0; a < 8; a++)
            for (int axis = 0; axis < 3; axis++) {
                grad[a][axis] = 0.25 / h[axis] * brick_sign(a, axis);
                for (int other = 0; other < 3; other++)
                    if (other != axis)
                        grad[a][axis] *= 1 + brick_sign(a, other) * brick_sign(q, other) / sqrt(3.0);
            }
        for (int i = 0; i < 24; i++)
            for (int j = 0; j < 24; j++) {
                const double *a = grad[i / 3], *b = grad[j / 3];
                double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                ke[i][j] += weight * (lambda * a[i % 3] * b[j % 3] + mu * a[j % 3] * b[i % 3] +
                                      (i % 3 == j % 3 ? mu * dot : 0.0));
            }
    }
}

/* cells[axis] bricks along each axis of a block with sides size[axis]; held false: no node is. */
static inline brick brick_make(const int64_t cells[3], const double size[3], double poisson, bool held)
{
    int64_t nx = cells[0] + 1, ny = cells[1] + 1, nz = cells[2] + 1, n_e = cells[0] * cells[1] * cells[2], at = 0;
    brick b = {.n_nodes = nx * ny * nz};
    double ke[24][24], h[3] = {size[0] / (double)cells[0], size[1] / (double)cells[1], size[2] / (double)cells[2]};
    uz_error err = {0};
    b.xyz = calloc((size_t)b.n_nodes * 3, sizeof *b.xyz);
    b.dof = calloc((size_t)b.n_nodes * 3, sizeof *b.dof);
    int64_t *row = malloc((size_t)n_e * 300 * sizeof *row), *column = malloc((size_t)n_e * 300 * sizeof *column);
    double *value = malloc((size_t)n_e * 300 * sizeof *value);
    if (!b.xyz || !b.dof || !row || !column || !value)
        abort();
    for (int64_t i = 0; i < b.n_nodes; i++) {
        int64_t place[3] = {i % nx, i / nx % ny, i / nx / ny};
        for (int axis = 0; axis < 3; axis++) {
            b.xyz[i * 3 + axis] = h[axis] * (double)place[axis];
            b.dof[i * 3 + axis] = held && place[0] == 0 ? -1 : b.d++;
        }
    }
    brick_element(ke, h, poisson);
    for (int64_t e = 0; e < n_e; e++) {
        int64_t x = e % cells[0], y = e / cells[0] % cells[1], z = e / cells[0] / cells[1];
        int64_t first = x + nx * (y + ny * z);
        for (int i = 0; i < 24; i++)
            for (int j = 0; j < 24; j++) {
                int a = i / 3, c = j / 3;
                int64_t I = b.dof[(first + (a & 1) + nx * ((a >> 1 & 1) + ny * (a >> 2 & 1))) * 3 + i % 3];
                int64_t J = b.dof[(first + (c & 1) + nx * ((c >> 1 & 1) + ny * (c >> 2 & 1))) * 3 + j % 3];
                if (I < 0 || J < 0 || I < J)
                    continue;
                row[at] = I;
                column[at] = J;
                value[at++] = ke[i][j];
            }
    }
    if (uz_csc_from_triplets(&b.K, b.d, b.d, at, row, column, value, &err) != UZ_OK)
        abort();
    free(row);
    free(column);
    free(value);
    return b;
}

static inline void brick_free(brick *b)
{
    free(b->xyz);
    free(b->dof);
    uz_csc_clear(&b->K);
}

#endif
