/* fields_fixture.h: scenes of one body whose answer is known, for the tests of fields. */
#ifndef TESTS_FIELDS_FIXTURE_H
#define TESTS_FIELDS_FIXTURE_H

#include "scene_fixture.h"

/* u = G x + c at every node of a mesh, dim x dim row by row. */
static inline double *linear_motion(const uz_mesh *mesh, const double *G, const double *c)
{
    const int dim = mesh->dim;
    double *u = zeros(mesh->n_nodes * dim);
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        for (int i = 0; i < dim; i++) {
            u[a * dim + i] = c ? c[i] : 0;
            for (int j = 0; j < dim; j++)
                u[a * dim + i] += G[i * dim + j] * mesh->xyz[a * dim + j];
        }
    return u;
}

#endif
