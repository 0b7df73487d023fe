/* springs.c: elastic ground. The stiffness of a group is its total, spread over its faces by area. Forces
 * are spread likewise, over elements by volume, and over the nodes that were given equally: a finer mesh has the same.
 */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* w: what each node has of a side's area (positive: of springs), or of an element's volume; returns how many nodes
 * there are. */
static int weigh(double *w, int64_t *node, const uz_body_model *model, const uz_group *group, int64_t i, bool positive)
{
    double xyz[3 * UZ_ELEMENT_NODES], f[UZ_ELEMENT_DOFS] = {0};
    const double one[3] = {1, 0, 0};
    uz_element element;
    uz_side side;
    int count;
    if (group->kind == UZ_GROUP_FACES) {
        uz_body_side(&side, xyz, node, model, group->face[i]);
        if (positive)
            uz_side_positive_weights(w, &side);
        else
            uz_side_weights(w, &side);
        return side.nodes;
    }
    const int64_t e = uz_group_element_at(group, i), *all = uz_mesh_element(&model->mesh, e, &count);
    uz_body_element(&element, xyz, model, e);
    uz_element_add_body_force(f, &element, one);
    for (int a = 0; a < count; a++) { /* corners of quadratic elements have less than nothing */
        node[a] = all[a];
        w[a] = f[a * model->mesh.dim];
    }
    return count;
}

uz_status uz_spread_over_group(double *share, const uz_body_model *model, const uz_group *group, bool positive,
                               const char *where, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const bool nodes = group->kind == UZ_GROUP_NODES;
    const int64_t most = mesh->from_first ? mesh->n_given : mesh->n_nodes,
                  items = nodes                           ? group->n_nodes
                          : group->kind == UZ_GROUP_FACES ? group->n_faces
                                                          : uz_group_element_count(mesh, group);
    double total = 0, w[UZ_ELEMENT_NODES] = {1};
    int64_t node[UZ_ELEMENT_NODES];
    for (int pass = 0; pass < 2; pass++) /* the whole first, then its shares */
        for (int64_t i = 0; i < items; i++) {
            int count = 1;
            if (!nodes)
                count = weigh(w, node, model, group, i, positive);
            else if (group->node[i] < most) /* nodes that a refined mesh has more are no part of what was asked for */
                node[0] = group->node[i];
            else
                break;
            for (int a = 0; a < count; a++) {
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
