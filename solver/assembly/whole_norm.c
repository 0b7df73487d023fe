/* whole_norm.c: the energy norm of a body with its supported dofs. */
#include "assembly/assembly.h"

#include "core/alloc.h"
#include "core/error.h"

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

bool uz_may_press(const uz_csc *N, const double *h, const double *u)
{
    bool may = false;
    double *way = uz_alloc_zero(N->rows, sizeof *way);
    if (!way)
        return true;
    uz_csc_gaxpy(way, N, 1, u);
    for (int64_t i = 0; i < N->rows && !may; i++)
        may = h[i] - way[i] < HIDDEN * fabs(way[i]);
    free(way);
    return may;
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
