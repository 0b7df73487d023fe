/* cells.c: bodies whose K need not be assembled: boxes of equal hexahedra. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Does each row bound one dof? Rows with several entries are left to K. */
static bool has_bounds_only(const uz_body_model *model)
{
    const uz_csc *N = &model->N;
    bool *seen = N->ptr[N->cols] == model->m ? uz_alloc_zero(model->m, sizeof *seen) : NULL, single = seen != NULL;
    for (int64_t k = 0; single && k < model->m; k++) {
        single = !seen[N->idx[k]];
        seen[N->idx[k]] = true;
    }
    free(seen);
    return single;
}

/* A box of equal hex8 of one isotropic material, its dofs along the axes, held by supports alone. */
static bool has_equal_cells(const uz_body_model *model, const uz_scene *scene)
{
    const uz_mesh *mesh = &model->mesh;
    const int64_t *cells = scene->box.cells;
    return scene->source == UZ_MESH_BOX && model->kind == UZ_SOLID && mesh->uniform && !mesh->hangs &&
           mesh->kind[0] == UZ_HEX8 && !model->materials[0].lame.general &&
           mesh->n_elements == cells[0] * cells[1] * cells[2] && !model->material_of && !model->spring &&
           model->info.n_rotated == 0 && !model->place && model->n_rigid == 0;
}

uz_status uz_build_cells(bool *made, uz_body_model *model, const uz_scene *scene, bool diagonal, uz_error *err)
{
    *made = false;
    if (!has_equal_cells(model, scene) || !has_bounds_only(model))
        return UZ_OK;
    uz_brick *brick = uz_alloc_zero(1, sizeof *brick);
    if (!brick)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a body");
    double xyz[3 * UZ_ELEMENT_NODES];
    memcpy(brick->cells, scene->box.cells, sizeof brick->cells);
    memcpy(brick->cell, model->mesh.cell, sizeof brick->cell);
    brick->n_nodes = model->mesh.n_nodes;
    brick->d = model->d;
    brick->dof = model->dof;
    uz_body_element(&brick->element, xyz, model, 0);
    brick->element.xyz = NULL;
    if (!uz_brick_init(brick)) {
        free(brick);
        return UZ_OK;
    }
    const uz_status status = diagonal ? uz_brick_diagonal(&model->K, brick, err) : UZ_OK;
    if (status != UZ_OK) {
        free(brick);
        return status;
    }
    model->brick = brick;
    *made = true;
    return UZ_OK;
}
