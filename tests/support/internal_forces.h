/* internal_forces.h: what the nodes of a deformed body need to stay where they are. */
#ifndef INTERNAL_FORCES_H
#define INTERNAL_FORCES_H

#include "assembly/assembly.h"

#include <string.h>

/* f (n_nodes x dim) = the elements' stiffness times the displacements, element by element. Less the loads and the
 * springs' -k u it is what supports and obstacles do. False: an element has no stiffness. */
static inline bool internal_forces(double *f, const uz_body_model *model, const double *nodal)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    memset(f, 0, (size_t)(mesh->n_nodes * dim) * sizeof *f);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const int n = count * dim;
        uz_body_element(&element, xyz, model, e);
        if (uz_element_stiffness(ke, &element) != UZ_SHAPE_GOOD)
            return false;
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                f[node[i / dim] * dim + i % dim] += ke[i * n + j] * nodal[node[j / dim] * dim + j % dim];
    }
    return true;
}

#endif
