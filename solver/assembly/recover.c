/* recover.c: between the unknowns and displacements by node. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Displacements by node as the threads that share them see them. */
typedef struct {
    double *nodal;
    const int64_t *of;
    const double *u, *prescribed;
} recovering;

static void take_dofs(void *ctx, int64_t begin, int64_t end)
{
    const recovering *x = ctx;
    for (int64_t i = begin; i < end; i++) {
        const int64_t dof = x->of[i];
        if (dof >= 0)
            x->nodal[i] = x->u[dof];
        else
            x->nodal[i] = x->prescribed && dof != UZ_NO_DOF ? x->prescribed[-1 - dof] : 0;
    }
}

void uz_recover_nodal(double *nodal, const uz_body_model *model, const double *u, const double *prescribed)
{
    const int dim = model->mesh.dim;
    const int64_t total = model->mesh.n_nodes * dim;
    uz_by_pieces(take_dofs, &(recovering){nodal, model->dof, u, prescribed}, total);
    for (int64_t i = 0; i < model->info.n_rotated; i++)
        uz_from_frame(nodal + model->info.rotated_node[i] * dim, model, model->info.rotated_node[i]);
    for (int64_t a = 0; a < model->mesh.n_nodes && model->follow.first; a++) {
        double carried[3];
        if (uz_have_carriers(model, &a, 1)) {
            uz_carried(carried, model, a, u, prescribed);
            memcpy(nodal + a * dim, carried, (size_t)dim * sizeof *nodal);
        }
    }
    for (int64_t i = model->mesh.n_given * dim; i < total && model->mesh.hangs && !model->follow.first; i++)
        if (model->dof[i] == UZ_NO_DOF)
            nodal[i] = uz_mesh_value_amid(&model->mesh, i / dim, nodal + i % dim, dim);
}

typedef struct {
    double *u;
    const int64_t *of;
    const double *nodal;
} restricting;

static void give_dofs(void *ctx, int64_t begin, int64_t end)
{
    const restricting *x = ctx;
    for (int64_t i = begin; i < end; i++)
        if (x->of[i] >= 0)
            x->u[x->of[i]] = x->nodal[i];
}

/* What is along each free dof of a node; in the places of rigid motions it means nothing. */
static void restrict_by_node(double *u, const uz_body_model *model, const double *nodal)
{
    const int dim = model->mesh.dim;
    const int64_t total = model->mesh.n_nodes * dim;
    if (!model->frame_of) /* each dof is of one node */
        uz_by_pieces(give_dofs, &(restricting){u, model->dof, nodal}, total);
    for (int64_t a = 0; model->frame_of && a < model->mesh.n_nodes; a++) {
        double local[3];
        uz_to_frame(local, model, a, nodal + a * dim);
        for (int c = 0; c < dim; c++)
            if (model->dof[a * dim + c] >= 0)
                u[model->dof[a * dim + c]] = local[c];
    }
}

void uz_restrict_nodal(double *u, const uz_body_model *model, const double *nodal)
{
    restrict_by_node(u, model, nodal);
    for (int64_t g = 0; g < model->n_rigid; g++) {
        double t[3], w[3];
        uz_rigid_motion(t, w, model, &model->rigid[g], NULL, nodal);
        uz_set_motion(u, model, &model->rigid[g], t, w);
    }
}

/* Forces of nodes that follow others, on what these follow. */
static void gather_carried(double *p, const uz_body_model *model, const double *f)
{
    static const double NOTHING[3] = {0};
    const int dim = model->mesh.dim;
    for (int64_t g = 0; g < model->n_rigid; g++)
        uz_set_motion(p, model, &model->rigid[g], NOTHING, NOTHING);
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        const int64_t *node;
        const double *share;
        const int64_t count = uz_carriers(&node, &share, model, a);
        for (int64_t k = 0; k < count; k++)
            for (int c = 0; c < dim; c++)
                for (int i = 0; i < dim && model->dof[node[k] * dim + c] >= 0; i++)
                    p[model->dof[node[k] * dim + c]] += share[(k * dim + i) * dim + c] * f[a * dim + i];
    }
}

void uz_gather_nodal(double *p, const uz_body_model *model, const double *f)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    restrict_by_node(p, model, f);
    if (model->follow.first) {
        gather_carried(p, model, f);
        return;
    }
    for (int64_t i = mesh->n_given; i < mesh->n_nodes && mesh->hangs; i++) {
        const int64_t *from;
        const double *share;
        const int count = mesh->hangs[i] ? uz_mesh_amid(&from, &share, mesh, i) : 0;
        for (int k = 0; k < count; k++) {
            double local[3];
            uz_to_frame(local, model, from[k], f + i * dim);
            for (int c = 0; c < dim; c++)
                if (model->dof[from[k] * dim + c] >= 0)
                    p[model->dof[from[k] * dim + c]] += share[k] * local[c];
        }
    }
}

double uz_along_dof(const uz_body_model *model, int64_t node, int c, const double *v)
{
    double local[3];
    uz_to_frame(local, model, node, v);
    return local[c];
}

const char *uz_dof_name(const uz_body_model *model, int64_t node, int c)
{
    static const char *const axes[] = {"x", "y", "z"};
    const double *Q = uz_node_frame(model, node);
    /* a held axis stays an axis when its node is turned */
    return !Q || Q[c * model->mesh.dim + c] == 1 ? axes[c] : "the normal of its support";
}

double uz_turning_error(const uz_body_model *model, int64_t node, const double *nodal)
{
    const int dim = model->mesh.dim;
    const bool hangs = uz_mesh_hangs(&model->mesh, node);
    const int64_t *from = &node;
    const double whole = 1, *share = &whole;
    if (uz_is_rigid(model, node) && !hangs)
        return uz_carried_error(model, node, nodal);
    const int count = hangs ? uz_mesh_amid(&from, &share, &model->mesh, node) : 1;
    double size = 0;
    for (int c = 0; c < dim && uz_is_tied(model, node); c++)
        size += fabs(uz_tied_value(model, node, nodal + c, dim));
    for (int k = 0; k < count; k++)
        for (int c = 0; c < dim && (hangs || uz_node_frame(model, node)); c++)
            size += fabs(share[k] * nodal[from[k] * dim + c]);
    return (hangs ? 4 + count : uz_is_tied(model, node) ? 32 : 4) * DBL_EPSILON * size;
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
    out->n_rotated = 0;
    out->rotated_node = NULL;
    out->frame = NULL;
    out->xyz = duplicate(info->xyz, info->n_nodes * info->dim, sizeof *info->xyz);
    out->contact_node = duplicate(info->contact_node, m, sizeof *info->contact_node);
    out->contact_area = duplicate(info->contact_area, m, sizeof *info->contact_area);
    out->contact_normal = duplicate(info->contact_normal, m * info->dim, sizeof *info->contact_normal);
    out->contact_of = duplicate(info->contact_of, m, sizeof *info->contact_of);
    out->contact_face = duplicate(info->contact_face, 2 * m, sizeof *info->contact_face);
    if (out->xyz && out->contact_node && out->contact_area && out->contact_normal && out->contact_of &&
        out->contact_face)
        return UZ_OK;
    uz_mesh_info_clear(out);
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the coordinates of %lld nodes", (long long)info->n_nodes);
}
