/* frames.c: directions of the dofs of nodes.
 *
 * A support along an inclined normal holds one displacement of a node, a rigid obstacle bounds one. Where this is not
 * an axis, the node's free dofs are rotated into the normal and tangents, so that the held direction is a dof, or the
 * row of N has one entry and the contact one dof per node. Supports turn first, one after the other; a contact turns
 * what they have left. With n the normal on the node's free directions, of unit length there, k its largest component
 * and s the sign of n_k, H = I - w w' / (1 + |n_k|),   w = n + s e_k,   H e_k = -s n (Householder; Golub and Van Loan,
 * Matrix Computations, 5.1) has n as its k-th row up to the sign, and for others the unit vectors of supported
 * directions, where w is zero, and tangents near the remaining axes. A node that is turned again has H times its frame.
 */
#include "assembly/discretization.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is left across a normal of a frame's own direction by the rounding of the displacement to where it is found: an
 * entry of N more for it would be a dof of the contact more, and where each row had one the analysis and the form of
 * the operator would be others. */
#define OF_PLACE 1e-13

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

void uz_from_frame(double v[3], const uz_body_model *model, int64_t node)
{
    const int dim = model->mesh.dim;
    const double *Q = uz_node_frame(model, node);
    double turned[3] = {0};
    if (!Q)
        return;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            turned[j] += Q[i * dim + j] * v[i];
    memcpy(v, turned, (size_t)dim * sizeof *v);
}

void uz_free_shares(double share[3], const uz_body_model *model, int64_t node, const double n[3])
{
    const int dim = model->mesh.dim;
    const bool turned = uz_node_frame(model, node) != NULL;
    const double rounding = model->place ? OF_PLACE : 16 * DBL_EPSILON;
    uz_to_frame(share, model, node, n);
    for (int c = 0; c < dim; c++)
        if (model->dof[node * dim + c] < 0 || (turned && fabs(share[c]) <= rounding))
            share[c] = 0;
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

bool uz_are_rotated(const uz_body_model *model, const int64_t *node, int count)
{
    bool turned = false;
    for (int a = 0; model->frame_of && a < count; a++)
        turned = turned || model->frame_of[node[a]] > 0;
    return turned;
}

void uz_turn_stiffness(double *ke, const uz_body_model *model, const int64_t *node, int count)
{
    const int dim = model->mesh.dim, n = dim * count;
    for (int a = 0; a < count; a++) {
        const double *Q = uz_node_frame(model, node[a]);
        if (!Q)
            continue;
        turn_lines(ke + a * dim * n, n, 1, n, Q, dim);
        turn_lines(ke + a * dim, n, n, 1, Q, dim);
    }
}

int uz_hold_direction(uz_body_model *model, int64_t node, const double normal[3])
{
    const int dim = model->mesh.dim;
    double n[3] = {0}, length = 0;
    int shares = 0, k = 0; /* the dof with the largest */
    uz_free_shares(n, model, node, normal);
    for (int c = 0; c < dim; c++)
        length = hypot(length, n[c]);
    if (length <= UZ_DEPENDENT)
        return -1;
    for (int c = 0; c < dim; c++) {
        n[c] /= length;
        k = fabs(n[c]) > fabs(n[k]) ? c : k;
        shares += n[c] != 0;
    }
    if (shares <= 1)
        return k;
    /* The node's free dofs are turned so that one of them is along n, by a reflection: Q = H Q. */
    uz_mesh_info *info = &model->info;
    double H[9] = {0}, Q[9] = {0}, w[3] = {n[0], n[1], n[2]};
    w[k] += copysign(1, n[k]);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            H[i * dim + j] = i == k ? n[j] : (i == j) - w[i] * w[j] / fabs(w[k]);
    if (model->frame_of[node] <= 0) {
        memcpy(info->frame + info->n_rotated * dim * dim, H, (size_t)(dim * dim) * sizeof *H);
        info->rotated_node[info->n_rotated] = node;
        model->frame_of[node] = ++info->n_rotated;
        return k;
    }
    double *frame = info->frame + (model->frame_of[node] - 1) * dim * dim;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            for (int l = 0; l < dim; l++)
                Q[i * dim + j] += H[i * dim + l] * frame[l * dim + j];
    memcpy(frame, Q, (size_t)(dim * dim) * sizeof *Q);
    return k;
}

uz_status uz_reserve_frames(uz_body_model *model, int64_t more, uz_error *err)
{
    const int dim = model->mesh.dim;
    uz_mesh_info *info = &model->info;
    const int64_t most = info->n_rotated + more < model->mesh.n_nodes ? info->n_rotated + more : model->mesh.n_nodes;
    if (!model->frame_of)
        model->frame_of = uz_alloc_zero(model->mesh.n_nodes, sizeof *model->frame_of);
    int64_t *node = model->frame_of ? uz_realloc(info->rotated_node, most, sizeof *node) : NULL;
    info->rotated_node = node ? node : info->rotated_node;
    double *frame = node ? uz_realloc(info->frame, most * dim * dim, sizeof *frame) : NULL;
    info->frame = frame ? frame : info->frame;
    if (!frame)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the directions of %lld nodes", (long long)most);
    return UZ_OK;
}

uz_status uz_choose_frames(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const int dim = model->mesh.dim;
    bool oblique = model->info.n_rotated > 0; /* else every normal is an axis, and no support has turned a node */
    int64_t most = 0;                         /* nodes that contacts can turn */
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < scene->n_contacts; k++) {
        double normal[3];
        int axes = 0;
        uz_contact_input in;
        status = uz_contact_input_of(&in, model, scene, k, err);
        if (status != UZ_OK)
            return status;
        uz_unit_normal(normal, scene->contacts[k].normal, dim);
        for (int c = 0; c < dim; c++)
            axes += normal[c] != 0;
        oblique = oblique || axes > 1 || model->sites[k].n > 0;
        most += uz_discretization_of(in.contact)->places(&in);
    }
    if (!oblique || most == 0)
        return UZ_OK;
    bool *chosen = uz_alloc_zero(model->mesh.n_nodes, sizeof *chosen);
    if (!chosen)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the directions of %lld nodes", (long long)most);
    status = uz_reserve_frames(model, most, err);
    for (int64_t k = 0; status == UZ_OK && k < scene->n_contacts; k++) {
        uz_contact_input in;
        status = uz_contact_input_of(&in, model, scene, k, err);
        for (int64_t i = 0; status == UZ_OK && i < uz_discretization_of(in.contact)->places(&in); i++) {
            uz_contact_row row;
            if (!uz_contact_row_at(&row, &in, i) || row.slaves > 1) /* a row of several nodes has none of its own */
                continue;
            if (chosen[row.node] || uz_is_rigid(model, row.node) || !uz_is_contact_row(model, row.node, row.normal))
                continue;
            chosen[row.node] = true;
            uz_hold_direction(model, row.node, row.normal);
        }
    }
    free(chosen);
    return status;
}
