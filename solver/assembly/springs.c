/* springs.c: elastic ground. The stiffness of a group is its total, spread over its faces by area, over nodes equally.
 */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_spread_over_group(double *share, const uz_body_model *model, const uz_group *group, bool positive,
                               const char *where, uz_error *err)
{
    const int64_t count = uz_group_node_count(&model->mesh, group);
    double total = 0, w[UZ_FACE_NODES];
    if (group->kind != UZ_GROUP_FACES) {
        for (int64_t i = 0; i < count; i++)
            share[uz_group_node_at(group, i)] += 1 / (double)count;
        return UZ_OK;
    }
    for (int pass = 0; pass < 2; pass++) /* the area first, then its shares */
        for (int64_t i = 0; i < group->n_faces; i++) {
            uz_side side;
            double xyz[3 * UZ_FACE_NODES];
            int64_t node[UZ_FACE_NODES];
            uz_body_side(&side, xyz, node, model, group->face[i]);
            if (positive)
                uz_side_positive_weights(w, &side);
            else
                uz_side_weights(w, &side);
            for (int a = 0; a < side.nodes; a++) {
                if (pass == 0)
                    total += w[a];
                else if (total > 0)
                    share[node[a]] += w[a] / total;
            }
        }
    if (!(total > 0 && isfinite(total)))
        return uz_fail(err, UZ_ERR_SCENE, where, "\"%s\" has no area to spread this over", group->name);
    return UZ_OK;
}

uz_status uz_spread_springs(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    int64_t springs = 0;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < scene->n_supports; i++)
        springs += scene->supports[i].kind == UZ_SUPPORT_SPRING;
    if (springs == 0)
        return UZ_OK;
    double *share = uz_alloc(model->mesh.n_nodes, sizeof *share);
    model->spring = uz_alloc_zero(model->mesh.n_nodes * model->mesh.dim, sizeof *model->spring);
    if (!share || !model->spring)
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the springs of %lld nodes", (long long)model->mesh.n_nodes);
    for (int64_t i = 0; i < scene->n_supports && status == UZ_OK; i++) {
        const uz_support *support = &scene->supports[i];
        if (support->kind != UZ_SUPPORT_SPRING)
            continue;
        const uz_group *group = uz_mesh_group(&model->mesh, support->on, "/supports", err);
        memset(share, 0, (size_t)model->mesh.n_nodes * sizeof *share);
        status = group ? uz_spread_over_group(share, model, group, true, "/supports", err) : UZ_ERR_SCENE;
        for (int64_t a = 0; a < model->mesh.n_nodes && status == UZ_OK; a++)
            for (int c = 0; c < model->mesh.dim; c++)
                if (support->spring[c] > 0) /* the corners of a tri6 face have less than nothing by rounding */
                    model->spring[a * model->mesh.dim + c] += fmax(0, share[a]) * support->spring[c];
    }
    free(share);
    return status;
}
