#include "assembly/assembly.h"

#include "core/alloc.h"
#include "core/error.h"

#include <string.h>

void uz_recover_nodal(double *nodal, const uz_body_model *model, const double *u, const double *prescribed)
{
    const int64_t total = model->mesh.n_nodes * model->mesh.dim;
    for (int64_t i = 0; i < total; i++) {
        const int64_t dof = model->dof[i];
        if (dof >= 0)
            nodal[i] = u[dof];
        else
            nodal[i] = prescribed ? prescribed[-1 - dof] : 0;
    }
}

static void *duplicate(const void *from, int64_t count, size_t size)
{
    void *copy = uz_alloc(count, size);
    if (copy && count > 0)
        memcpy(copy, from, (size_t)count * size);
    return copy;
}

uz_status uz_mesh_info_copy(uz_mesh_info *out, const uz_mesh_info *info, int64_t m, uz_error *err)
{
    *out = *info;
    out->xyz = duplicate(info->xyz, info->n_nodes * info->dim, sizeof *info->xyz);
    out->contact_node = duplicate(info->contact_node, m, sizeof *info->contact_node);
    out->contact_area = duplicate(info->contact_area, m, sizeof *info->contact_area);
    out->contact_normal = duplicate(info->contact_normal, m * info->dim, sizeof *info->contact_normal);
    if (out->xyz && out->contact_node && out->contact_area && out->contact_normal)
        return UZ_OK;
    uz_mesh_info_clear(out);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the coordinates of %lld nodes", (long long)info->n_nodes);
}
