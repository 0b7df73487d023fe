#include "finite/finite_body.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "finite/finite_element.h"

#include <math.h>
#include <string.h>

/* Elastic ground: along the axes, whatever turns; its forces are linear in displacements. */
static void add_springs(uz_finite_measure *out, double *force, uz_body_model *tangent, const uz_body_model *model,
                        const double *nodal)
{
    const int dim = model->mesh.dim;
    for (int64_t a = 0; a < model->mesh.n_nodes && model->spring; a++) {
        double ke[9] = {0};
        bool any = false;
        for (int c = 0; c < dim; c++) {
            const double k = model->spring[dim * a + c], u = nodal[dim * a + c];
            out->energy += 0.5 * k * u * u;
            if (force)
                force[dim * a + c] += k * u;
            ke[(dim + 1) * c] = k;
            any = any || k > 0;
        }
        if (tangent && any)
            uz_add_stiffness(tangent, ke, &a, 1);
    }
}

void uz_finite_body(uz_finite_measure *out, double *force, uz_body_model *tangent, const uz_body_model *model,
                    const double *free_strain, const double *nodal, const double *step)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    double ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS], xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], d[UZ_ELEMENT_DOFS];
    uz_finite_rule rule = {.nodes = 0};
    *out = (uz_finite_measure){.least_det = INFINITY, .at = -1};
    if (force)
        memset(force, 0, (size_t)(dim * mesh->n_nodes) * sizeof *force);
    if (tangent) {
        memset(tangent->K.val, 0, (size_t)tangent->K.ptr[tangent->K.cols] * sizeof *ke);
        memset(tangent->K_fixed.val, 0, (size_t)tangent->K_fixed.ptr[tangent->K_fixed.cols] * sizeof *ke);
    }
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        uz_finite_forces own;
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        uz_body_element(&element, xyz, model, e);
        if (rule.nodes == 0 || rule.kind != element.kind)
            uz_finite_rule_of(&rule, element.kind, element.model);
        for (int i = 0; i < dim * count; i++)
            u[i] = nodal[dim * node[i / dim] + i % dim];
        for (int i = 0; i < dim * count && step; i++)
            d[i] = step[dim * node[i / dim] + i % dim];
        uz_finite_warm(&element, xyz, u, free_strain ? free_strain[e] : 0);
        uz_finite_element(&own, tangent ? ke : NULL, force, &rule, &element, uz_element_material(model, e)->law, u,
                          step ? d : NULL);
        if (!(own.least_det >= out->least_det)) { /* not a number, too */
            out->least_det = own.least_det;
            out->at = e;
        }
        if (!(own.least_det > 0) || uz_is_unstrained(model, node, count))
            continue;
        out->energy += own.energy;
        for (int i = 0; i < dim * count && force; i++)
            force[dim * node[i / dim] + i % dim] += own.force[i];
        if (tangent)
            uz_add_stiffness(tangent, ke, node, count);
    }
    add_springs(out, force, tangent, model, nodal);
}

uz_status uz_finite_tangent_of(uz_body_model *out, const uz_body_model *model, uz_error *err)
{
    const int64_t own = model->K.ptr[model->K.cols], fixed = model->K_fixed.ptr[model->K_fixed.cols];
    *out = *model;
    out->K.val = uz_alloc_zero(own, sizeof(double));
    out->K_fixed.val = uz_alloc_zero(fixed, sizeof(double));
    if (out->K.val && out->K_fixed.val)
        return UZ_OK;
    uz_finite_tangent_clear(out);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a tangent of %lld entries", (long long)own);
}

void uz_finite_tangent_clear(uz_body_model *tangent)
{
    uz_free_all(tangent->K.val, tangent->K_fixed.val);
    memset(tangent, 0, sizeof *tangent);
}
