/* cells.c: bodies whose K need not be assembled: boxes of equal hexahedra or, in the plane, quadrilaterals. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <stdlib.h>
#include <string.h>

/* A box of equal hex8 or, in the plane, quad4 of one isotropic material, its dofs along the axes, held by supports
 * alone. */
static bool has_equal_cells(const uz_body_model *model, const uz_scene *scene)
{
    const uz_mesh *mesh = &model->mesh;
    const int64_t *cells = scene->box.cells;
    const bool solid = model->kind == UZ_SOLID;
    return scene->source == UZ_MESH_BOX && model->kind != UZ_AXISYMMETRIC && mesh->uniform && !mesh->hangs &&
           mesh->kind[0] == (solid ? UZ_HEX8 : UZ_QUAD4) && !model->materials[0].lame.general &&
           mesh->n_elements == cells[0] * cells[1] * (solid ? cells[2] : 1) && !model->material_of && !model->spring &&
           model->info.n_rotated == 0 && !model->place && model->n_rigid == 0;
}

uz_status uz_build_cells(bool *made, uz_body_model *model, const uz_scene *scene, bool diagonal, uz_error *err)
{
    *made = false;
    if (!has_equal_cells(model, scene) || !uz_csc_is_single(&model->N))
        return UZ_OK;
    uz_brick *brick = uz_alloc_zero(1, sizeof *brick);
    if (!brick)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a body");
    double xyz[3 * UZ_ELEMENT_NODES];
    brick->axes = model->mesh.dim;
    for (int c = 0; c < brick->axes; c++) {
        const int axis = uz_brick_axis_of(brick->axes, c);
        brick->cells[axis] = scene->box.cells[c];
        brick->cell[axis] = model->mesh.cell[c];
    }
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
