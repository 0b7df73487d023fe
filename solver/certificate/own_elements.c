#include "certificate/own_elements.h"

#include "assembly/body_parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In local coordinates: less deep in an element a point is on its side. */
#define ON_SIDE 1e-6
/* Cosine between the normals of a point and of a side that is surely not what it has passed. */
#define ALIKE 0.5

/* *same: has a part of the body sides of both groups? */
static uz_status find_same(bool *same, const uz_body_model *model, const uz_group *const group[2], uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_parts parts = {0};
    uz_status status = uz_find_parts(&parts, model, err);
    bool *has = status == UZ_OK ? uz_alloc_zero(parts.count, sizeof *has) : NULL;
    *same = false;
    if (status == UZ_OK && !has)
        status = uz_no_memory(err, "the parts of a contact");
    for (int j = 0; j < 2; j++)
        for (int64_t i = 0; i < group[j]->n_faces && status == UZ_OK; i++) {
            bool *of = &has[parts.of[mesh->node[mesh->first[group[j]->face[i].element]]]];
            *same = *same || (j == 1 && *of);
            *of = *of || j == 0;
        }
    free(has);
    uz_parts_clear(&parts);
    return status;
}

uz_status uz_own_elements_init(uz_own_elements *out, const uz_body_model *model, const uz_group *const group[2],
                               const double *u, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    bool same;
    *out = (uz_own_elements){.model = model};
    const uz_status status = find_same(&same, model, group, err);
    if (status != UZ_OK || !same)
        return status;
    out->xyz = uz_alloc(dim * mesh->n_nodes, sizeof *out->xyz);
    out->box = uz_alloc(2 * dim * mesh->n_elements, sizeof *out->box);
    out->near = uz_alloc(mesh->n_elements, sizeof *out->near);
    if (!out->xyz || !out->box || !out->near)
        return uz_no_memory(err, "a body that touches itself");
    for (int64_t i = 0; i < dim * mesh->n_nodes; i++)
        out->xyz[i] = mesh->xyz[i] + u[i];
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        for (int c = 0; c < dim; c++) {
            double low = INFINITY, high = -INFINITY;
            for (int a = 0; a < count; a++) {
                low = fmin(low, out->xyz[dim * node[a] + c]);
                high = fmax(high, out->xyz[dim * node[a] + c]);
            }
            const double room = 0.25 * (high - low); /* curved sides leave the box of their nodes */
            out->box[2 * dim * e + c] = low - room;
            out->box[2 * dim * e + dim + c] = high + room;
        }
    }
    return UZ_OK;
}

void uz_own_elements_clear(uz_own_elements *own)
{
    uz_free_all(own->xyz, own->box, own->near);
    memset(own, 0, sizeof *own);
}

static bool meets(const double *box, int dim, const double *x, double reach)
{
    bool so = true;
    for (int c = 0; c < dim && so; c++)
        so = x[c] + reach > box[c] && x[c] - reach < box[dim + c];
    return so;
}

void uz_own_elements_near(uz_own_elements *own, const double *middle, double reach)
{
    const int dim = own->model->mesh.dim;
    own->n = 0;
    for (int64_t e = 0; e < own->model->mesh.n_elements; e++)
        if (meets(own->box + 2 * dim * e, dim, middle, reach))
            own->near[own->n++] = e;
}

bool uz_own_elements_hold(const uz_own_elements *own, const double *x)
{
    const uz_mesh *mesh = &own->model->mesh;
    const int dim = mesh->dim;
    bool held = false;
    for (int64_t k = 0; k < own->n && !held; k++) {
        const int64_t e = own->near[k];
        double xyz[3 * UZ_ELEMENT_NODES], point[3];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        if (!meets(own->box + 2 * dim * e, dim, x, 0))
            continue;
        for (int a = 0; a < count; a++)
            memcpy(xyz + dim * a, own->xyz + dim * node[a], (size_t)dim * sizeof *xyz);
        held = uz_element_find(point, type, xyz, mesh->extent, x) && uz_element_depth(type, point) > ON_SIDE;
    }
    return held;
}

bool uz_own_may_meet(const uz_own_look *point, const double normal[3])
{
    const double along = uz_dot3(point->normal, normal);
    if (!point->held)
        return along < 0;
    return along < ALIKE * sqrt(uz_dot3(point->normal, point->normal) * uz_dot3(normal, normal));
}

bool uz_own_adjoin(const int64_t *one, int n, const int64_t *other, int m)
{
    bool so = false;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < m; j++)
            so = so || one[i] == other[j];
    return so;
}
