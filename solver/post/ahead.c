#include "post/ahead.h"

#include "core/alloc.h"
#include "core/aside.h"

#include <math.h>
#include <string.h>

enum { LEAST = 20000 }; /* elements; of fewer the estimate takes less than a millisecond */

struct uz_ahead {
    uz_aside_task task;
    const uz_body_model *model;
    uz_scene scene;
    double *nodal;
    double error;
    uz_mesh_look look;
};

static void estimate(void *ctx)
{
    uz_ahead *ahead = ctx;
    ahead->error = uz_estimate_mesh_error(NULL, &ahead->look, ahead->model, &ahead->scene, ahead->nodal);
}

uz_ahead *uz_ahead_start(const uz_body_model *model, const uz_scene *scene, const double *u, const double *prescribed)
{
    const uz_mesh *mesh = &model->mesh;
    const bool worth = mesh->n_elements >= LEAST && uz_aside_is_idle();
    uz_ahead *ahead = worth ? uz_alloc_zero(1, sizeof *ahead) : NULL;
    if (!ahead)
        return NULL;
    ahead->model = model;
    ahead->scene = *scene;
    ahead->nodal = uz_alloc(mesh->n_nodes * mesh->dim, sizeof *ahead->nodal);
    ahead->task = (uz_aside_task){.run = estimate, .ctx = ahead};
    if (ahead->nodal) {
        uz_recover_nodal(ahead->nodal, model, u, prescribed);
        if (uz_aside_start(&ahead->task))
            return ahead;
    }
    uz_ahead_free(ahead);
    return NULL;
}

bool uz_ahead_take(uz_ahead *ahead, double *error, uz_mesh_look *look, const double *nodal)
{
    if (!ahead || !uz_aside_finish(&ahead->task) || isnan(ahead->error))
        return false;
    const uz_mesh *mesh = &ahead->model->mesh;
    if (memcmp(ahead->nodal, nodal, (size_t)(mesh->n_nodes * mesh->dim) * sizeof *nodal) != 0)
        return false;
    *error = ahead->error;
    *look = ahead->look;
    return true;
}

void uz_ahead_free(uz_ahead *ahead)
{
    if (!ahead)
        return;
    uz_aside_finish(&ahead->task);
    uz_free_all(ahead->nodal, ahead);
}
