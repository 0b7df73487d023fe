/* frames.c: directions of the dofs of contact nodes.
 *
 * A rigid obstacle bounds one displacement of a node, that along its normal. Where this is not an axis, the node's free
 * dofs are turned into the normal and tangents, so that the row of N has one entry and the contact one dof per node.
 * With n the normal on the node's free directions, of unit length there, k its largest component and s the sign of n_k,
 *     H = I - w w' / (1 + |n_k|),   w = n + s e_k,   H e_k = -s n
 * (Householder; Golub and Van Loan, Matrix Computations, 5.1) has n as its k-th row up to the sign, and for others the
 * unit vectors of supported directions, where w is zero, and tangents near the remaining axes. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GLOBAL = -1 }; /* frame_of of a node whose first contact leaves its dofs along the axes */

const double *uz_node_frame(const uz_body_model *model, int64_t node)
{
    const int dim = model->mesh.dim;
    const int64_t frame = model->frame_of ? model->frame_of[node] : 0;
    return frame > 0 ? model->info.frame + (frame - 1) * dim * dim : NULL;
}

void uz_to_frame(double out[3], const uz_body_model *model, int64_t node, const double v[3])
{
    const int dim = model->mesh.dim;
    const double *Q = uz_node_frame(model, node);
    for (int i = 0; i < dim; i++) {
        double sum = 0;
        for (int j = 0; Q && j < dim; j++)
            sum += Q[i * dim + j] * v[j];
        out[i] = Q ? sum : v[i];
    }
}

/* ke = T ke or ke T' on the entries that stand `step` apart, for the block of one node: lines of the other index. */
static void turn_lines(double *ke, int lines, int line, int step, const double *Q, int dim)
{
    for (int l = 0; l < lines; l++, ke += line) {
        double turned[3] = {0};
        for (int i = 0; i < dim; i++)
            for (int j = 0; j < dim; j++)
                turned[i] += Q[i * dim + j] * ke[j * step];
        for (int i = 0; i < dim; i++)
            ke[i * step] = turned[i];
    }
}

bool uz_is_turned_element(const uz_body_model *model, int64_t element)
{
    int corners;
    const int64_t *corner = uz_mesh_element(&model->mesh, element, &corners);
    bool turned = false;
    for (int a = 0; model->frame_of && a < corners; a++)
        turned = turned || model->frame_of[corner[a]] > 0;
    return turned;
}

void uz_turn_element(double *ke, const uz_body_model *model, int64_t element)
{
    int corners;
    const int64_t *corner = uz_mesh_element(&model->mesh, element, &corners);
    const int dim = model->mesh.dim, n = dim * corners;
    for (int a = 0; a < corners; a++) {
        const double *Q = uz_node_frame(model, corner[a]);
        if (!Q)
            continue;
        turn_lines(ke + a * dim * n, n, 1, n, Q, dim);
        turn_lines(ke + a * dim, n, n, 1, Q, dim);
    }
}

/* The normal on the free directions of a node, of unit length. Returns how many axes it has a share in. */
static int free_normal(double out[3], const uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double length = 0;
    int axes = 0;
    for (int c = 0; c < dim; c++) {
        out[c] = model->dof[node * dim + c] >= 0 ? normal[c] : 0;
        length = hypot(length, out[c]);
        axes += out[c] != 0;
    }
    for (int c = 0; c < dim && axes > 0; c++)
        out[c] /= length;
    return axes;
}

static void fill_frame(double *Q, const double n[3], int dim)
{
    int k = 0;
    for (int c = 1; c < dim; c++)
        k = fabs(n[c]) > fabs(n[k]) ? c : k;
    double w[3] = {n[0], n[1], n[2]};
    w[k] += copysign(1, n[k]);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            Q[i * dim + j] = i == k ? n[j] : (i == j) - w[i] * w[j] / fabs(w[k]);
}

static void choose_frame(uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    double n[3] = {0};
    if (model->frame_of[node] != 0 || !uz_is_contact_row(model, node, normal))
        return;
    model->frame_of[node] = GLOBAL;
    if (free_normal(n, model, node, normal) < 2)
        return;
    fill_frame(info->frame + info->n_turned * dim * dim, n, dim);
    info->turned_node[info->n_turned] = node;
    model->frame_of[node] = ++info->n_turned;
}

/* Most nodes that can be turned: 0 where every normal is an axis. */
static uz_status count_candidates(int64_t *most, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int dim = model->mesh.dim;
    bool oblique = false;
    *most = 0;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        double normal[3];
        int axes = 0;
        const uz_group *group = uz_mesh_group(&model->mesh, scene->contacts[k].on, "/contacts", err);
        if (!group)
            return UZ_ERR_SCENE;
        uz_unit_normal(normal, scene->contacts[k].normal, dim);
        for (int c = 0; c < dim; c++)
            axes += normal[c] != 0;
        oblique = oblique || axes > 1;
        *most += uz_group_node_count(&model->mesh, group);
    }
    *most = !oblique ? 0 : *most < model->mesh.n_nodes ? *most : model->mesh.n_nodes;
    return UZ_OK;
}

uz_status uz_choose_frames(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int dim = model->mesh.dim;
    int64_t most;
    uz_status status = count_candidates(&most, model, scene, err);
    if (status != UZ_OK || most == 0)
        return status;
    model->frame_of = uz_alloc_zero(model->mesh.n_nodes, sizeof *model->frame_of);
    model->info.turned_node = uz_alloc(most, sizeof *model->info.turned_node);
    model->info.frame = uz_alloc(most * dim * dim, sizeof *model->info.frame);
    if (!model->frame_of || !model->info.turned_node || !model->info.frame)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the directions of %lld contact nodes", (long long)most);
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        double normal[3];
        const uz_group *group = uz_mesh_group(&model->mesh, scene->contacts[k].on, "/contacts", err);
        uz_unit_normal(normal, scene->contacts[k].normal, dim);
        for (int64_t i = 0; i < uz_group_node_count(&model->mesh, group); i++)
            choose_frame(model, uz_group_node_at(group, i), normal);
    }
    return UZ_OK;
}
