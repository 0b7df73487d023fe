/* whole_norm.c: the energy norm of a body with its supported dofs. */
#include "assembly/assembly.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/mesh_parts.h"

#include <math.h>
#include <stdlib.h>

bool uz_is_moved(const uz_body_model *model, const double *prescribed)
{
    bool moved = false;
    for (int64_t i = 0; prescribed && i < model->n_fixed && !moved; i++)
        moved = prescribed[i] != 0;
    return moved;
}

bool uz_is_loaded(const uz_body_model *model, const uz_scene *scene)
{
    bool loaded = false;
    for (int64_t i = 0; i < scene->n_loads && !loaded; i++) {
        const uz_load *load = &scene->loads[i];
        loaded = load->value != 0;
        for (int c = 0; c < 3; c++)
            loaded = loaded || load->v[c] != 0 || load->moment[c] != 0;
    }
    double *f = loaded ? uz_alloc(model->mesh.n_nodes * model->mesh.dim, sizeof *f) : NULL,
           *p = f ? uz_alloc_zero(model->d, sizeof *p) : NULL;
    if (p && uz_nodal_loads(f, model, scene, NULL) == UZ_OK) {
        uz_gather_nodal(p, model, f);
        loaded = false;
        for (int64_t j = 0; j < model->d && !loaded; j++)
            loaded = p[j] != 0;
    }
    free(f);
    free(p);
    return loaded;
}

#define HIDDEN 1e-8 /* of the way of a row, by rounding and by what solves leave */

/* way (rows): what u closes of each row's gap; the caller frees it. NULL: no memory. */
static double *ways_of(const uz_csc *N, const double *u)
{
    double *way = uz_alloc_zero(N->rows, sizeof *way);
    if (way)
        uz_csc_gaxpy(way, N, 1, u);
    return way;
}

bool uz_may_press(const uz_csc *N, const double *h, const double *u)
{
    double *way = ways_of(N, u);
    bool may = !way;
    for (int64_t i = 0; i < N->rows && !may; i++)
        may = h[i] - way[i] < HIDDEN * fabs(way[i]);
    free(way);
    return may;
}

/* What sizes of parts may differ by: their roots are in energy norms. */
#define LIKE 16

/* size (count, zeroed): energy of each part, over the stiffness, if rounding of places had strained its elements.
 * Returns whether these are alike. */
static bool are_alike(double *size, const uz_body_model *model, const int64_t *part, int64_t count)
{
    double least = INFINITY, most = 0;
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES];
        int nodes;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
        if (model->mesh.dim == 3)
            uz_body_element(&element, xyz, model, e);
        size[part[node[0]]] += model->mesh.dim == 3 ? cbrt(uz_element_volume(&element)) : 1;
    }
    for (int64_t i = 0; i < count; i++) {
        least = fmin(least, size[i]);
        most = fmax(most, size[i]);
    }
    return most <= LIKE * least;
}

bool uz_is_together(const uz_body_model *model, const uz_csc *N, const double *h, const double *u)
{
    const int64_t n = model->mesh.n_nodes, dim = model->mesh.dim;
    int64_t *part = uz_alloc(n, sizeof *part), *first = uz_alloc(N->rows, sizeof *first), *root = NULL;
    double *way = ways_of(N, u), *size = NULL;
    const int64_t count = part && first && way ? uz_mesh_number_parts(part, &model->mesh) : -1;
    if (count > 1 && (root = uz_alloc(count, sizeof *root)) && (size = uz_alloc_zero(count, sizeof *size))) {
        for (int64_t i = 0; i < count; i++)
            root[i] = i;
        for (int64_t i = 0; i < N->rows; i++)
            first[i] = -1;
        for (int64_t k = 0; k < n * dim; k++)
            for (int64_t j = model->dof[k], q = j < 0 ? 0 : N->ptr[j]; j >= 0 && q < N->ptr[j + 1]; q++) {
                const int64_t i = N->idx[q];
                if (h[i] - way[i] > HIDDEN * fabs(way[i]))
                    continue;
                first[i] = first[i] < 0 ? part[k / dim] : first[i];
                uz_join(root, first[i], part[k / dim]);
            }
    }
    bool together = count == 1 || size;
    for (int64_t i = 0; i < count && root && together; i++)
        together = uz_join_root(root, i) == 0;
    together = together && (count == 1 || are_alike(size, model, part, count));
    uz_free_all(part, first, root, way, size);
    return together;
}

/* By elements: u'Ku from the blocks of free and supported dofs would cancel. */
uz_status uz_whole_norm(double *norm, const uz_body_model *model, const double *u, const double *prescribed,
                        uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double energy = 0, *nodal = uz_alloc(n, sizeof *nodal);
    *norm = 0;
    if (!nodal)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacements of %lld nodes",
                       (long long)model->mesh.n_nodes);
    uz_recover_nodal(nodal, model, u, prescribed);
    uz_status status = uz_strain_energy(&energy, model, nodal, true, err);
    free(nodal);
    if (status == UZ_OK)
        *norm = sqrt(fmax(0, 2 * energy));
    return status;
}
