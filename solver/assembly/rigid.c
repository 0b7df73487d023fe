/* rigid.c: groups that move as a rigid body, and displacements that follow dofs of other nodes.
 *
 * The motion of a rigid group about its point P is a translation t and a rotation w, u(x) = t + w x (x - P), linear in
 * both. They are dofs like others: t stands in the places of one node of the group, w times the group's size, so that
 * it is a length, in those of another one, and no node of the group has dofs of its own. With u = S v, v the dofs of
 * these two nodes, an element's stiffness becomes S' ke S, and so all that is made of K, N and p knows no more of it
 * (master-slave elimination; Cook, Malkus, Plesha and Witt, Concepts and Applications of Finite Element Analysis,
 * 13.2). In a ring only t along the axis is left. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Three nodes whose triangle is thinner than this, beside its longest side, are on a line. */
#define ON_A_LINE 1e-6

bool uz_is_rigid(const uz_body_model *model, int64_t node)
{
    return model->rigid_of && model->rigid_of[node] > 0;
}

const uz_rigid_group *uz_rigid_group_of(const uz_body_model *model, int64_t node)
{
    return uz_is_rigid(model, node) ? &model->rigid[model->rigid_of[node] - 1] : NULL;
}

int64_t uz_carriers(const int64_t **node, const double **share, const uz_body_model *model, int64_t a)
{
    const uz_followers *f = &model->follow;
    if (!f->first || f->first[a] == f->first[a + 1])
        return 0;
    *node = f->node + f->first[a];
    *share = f->share + f->first[a] * model->mesh.dim * model->mesh.dim;
    return f->first[a + 1] - f->first[a];
}

void uz_followers_clear(uz_followers *follow)
{
    uz_free_all(follow->first, follow->node, follow->share);
    *follow = (uz_followers){.first = NULL};
}

/* ---- numbering */

static void place_of(double x[3], const uz_mesh *mesh, int64_t node)
{
    for (int c = 0; c < 3; c++)
        x[c] = c < mesh->dim ? mesh->xyz[node * mesh->dim + c] : 0;
}

/* Twice the area of the triangle of a, b and a third point. */
static double twice_area(const double a[3], const double b[3], const double third[3])
{
    double one[3], other[3], across[3];
    for (int c = 0; c < 3; c++) {
        one[c] = b[c] - a[c];
        other[c] = third[c] - a[c];
    }
    uz_cross3(across, one, other);
    return sqrt(uz_dot3(across, across));
}

/* Nodes that tell the motion: the first of the group, the farthest from it, and in space the farthest from the line
 * through both. False: there are no such nodes. */
static bool choose_anchors(uz_rigid_group *to, const uz_mesh *mesh, const uz_group *group, uz_model kind)
{
    double x[3][3], far = 0, wide = 0;
    to->anchor[0] = to->anchor[1] = to->anchor[2] = -1;
    for (int turn = 0; turn < 3; turn++)
        for (int64_t i = 0; i < uz_group_node_count(mesh, group); i++) {
            const int64_t node = uz_group_node_at(group, i);
            double at[3];
            if (uz_mesh_hangs(mesh, node) || (turn > 0 && to->anchor[0] < 0))
                continue;
            place_of(at, mesh, node);
            const double away = turn == 1 ? sqrt(uz_distance2(at, x[0], 3)) : 0,
                         across = turn == 2 && to->anchor[1] >= 0 ? twice_area(x[0], x[1], at) : 0;
            if (!(turn == 0 ? to->anchor[0] < 0 : turn == 1 ? away > far : across > wide))
                continue;
            far = fmax(far, away);
            wide = fmax(wide, across);
            to->anchor[turn] = node;
            memcpy(x[turn], at, sizeof at);
        }
    to->size = far;
    if (kind == UZ_AXISYMMETRIC)
        return to->anchor[0] >= 0;
    return to->anchor[1] >= 0 && (mesh->dim == 2 || (to->anchor[2] >= 0 && wide > ON_A_LINE * far * far));
}

static uz_status number_group(uz_body_model *model, const uz_scene *scene, int64_t k, uz_rigid_group *to, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const uz_support *support = &scene->supports[k];
    const int dim = mesh->dim, turns = dim == 2 ? 1 : 3;
    const uz_group *group = uz_mesh_group(mesh, support->on, "/supports", err);
    if (!group)
        return UZ_ERR_SCENE;
    *to = (uz_rigid_group){.support = k};
    memcpy(to->point, support->about, sizeof to->point);
    const char *where = UZ_PLACE("supports", k, "on");
    if (!choose_anchors(to, mesh, group, model->kind))
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "\"%.63s\" cannot be turned as a rigid group: it needs %s; hold it by ux, uy%s", support->on,
                       dim == 2 ? "two nodes" : "three nodes that are not on a line", dim == 2 ? "" : ", uz");
    for (int64_t i = 0; i < uz_group_node_count(mesh, group); i++) {
        const int64_t node = uz_group_node_at(group, i);
        const uz_rigid_group *other = uz_rigid_group_of(model, node);
        if (other)
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "node %lld of \"%.63s\" is of the rigid group \"%.63s\", too: make one group of both, or "
                           "leave the node out of one",
                           (long long)node, support->on, scene->supports[other->support].on);
        model->rigid_of[node] = (int32_t)(to - model->rigid) + 1;
        for (int c = 0; c < dim; c++)
            model->dof[node * dim + c] = UZ_NO_DOF;
    }
    if (model->kind == UZ_AXISYMMETRIC) {
        model->dof[to->anchor[0] * dim + 1] = isnan(support->u[1]) ? 0 : -1;
        return UZ_OK;
    }
    for (int c = 0; c < dim; c++)
        model->dof[to->anchor[0] * dim + c] = isnan(support->u[c]) ? 0 : -1;
    for (int c = 0; c < turns; c++)
        model->dof[to->anchor[1] * dim + c] = isnan(support->turn[dim == 2 ? 2 : c]) ? 0 : -1;
    return UZ_OK;
}

uz_status uz_number_rigid(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = UZ_OK;
    int64_t count = 0;
    for (int64_t k = 0; k < scene->n_supports; k++)
        count += scene->supports[k].kind == UZ_SUPPORT_RIGID;
    if (count == 0)
        return UZ_OK;
    model->rigid = uz_alloc_zero(count, sizeof *model->rigid);
    model->rigid_of = uz_alloc_zero(model->mesh.n_nodes, sizeof *model->rigid_of);
    if (!model->rigid || !model->rigid_of)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rigid groups", (long long)count);
    for (int64_t k = 0; k < scene->n_supports && status == UZ_OK; k++)
        if (scene->supports[k].kind == UZ_SUPPORT_RIGID)
            status = number_group(model, scene, k, &model->rigid[model->n_rigid++], err);
    return status;
}

void uz_rigid_values(double *value, const uz_body_model *model, const uz_scene *scene)
{
    const int dim = model->mesh.dim;
    for (int64_t g = 0; g < model->n_rigid; g++) {
        const uz_rigid_group *group = &model->rigid[g];
        const uz_support *support = &scene->supports[group->support];
        for (int c = 0; c < 2 * dim; c++) {
            const int64_t node = group->anchor[c / dim], dof = node < 0 ? UZ_NO_DOF : model->dof[node * dim + c % dim];
            if (dof < 0 && dof != UZ_NO_DOF)
                value[-1 - dof] = c < dim ? support->u[c] : group->size * support->turn[dim == 2 ? 2 : c - dim];
        }
    }
}

/* ---- who follows whom */

void uz_rigid_arms(double *share, const double arm[3], int dim)
{
    if (dim == 2) {
        share[0] = -arm[1];
        share[2] = arm[0];
        return;
    }
    for (int c = 0; c < 3; c++) { /* e_c x arm */
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        share[3 * a + c] = -arm[b];
        share[3 * b + c] = arm[a];
    }
}

/* share: u of a node of the group from the dofs of its anchors, dim x dim each. Returns how many anchors. u: as of
 * uz_find_followers. */
static int rigid_shares(double share[2][9], const uz_body_model *model, const uz_rigid_group *group, int64_t node,
                        const double *u)
{
    const int dim = model->mesh.dim;
    double x[3], r[3], t[3] = {0}, R[9];
    memset(share[0], 0, 2 * sizeof share[0]);
    if (model->kind == UZ_AXISYMMETRIC) {
        share[0][3] = 1;
        return 1;
    }
    place_of(x, &model->mesh, node);
    if (u)
        uz_rigid_place(t, R, model, group, u);
    for (int c = 0; c < dim && u; c++)
        x[c] += u[node * dim + c];
    for (int c = 0; c < 3; c++)
        r[c] = (x[c] - group->point[c] - t[c]) / group->size;
    for (int c = 0; c < dim; c++)
        share[0][c * dim + c] = 1;
    uz_rigid_arms(share[1], r, dim);
    return 2;
}

/* Carriers of a node that is no hanging one, as they are appended. */
static int own_carriers(int64_t node[2], double share[2][9], const uz_body_model *model, int64_t a, const double *u)
{
    const int dim = model->mesh.dim;
    const uz_rigid_group *group = uz_rigid_group_of(model, a);
    const double *Q = uz_node_frame(model, a);
    if (group) {
        node[0] = group->anchor[0];
        node[1] = group->anchor[1];
        return rigid_shares(share, model, group, a, u);
    }
    node[0] = a;
    for (int i = 0; i < dim; i++) /* Q', from its dofs to the axes */
        for (int j = 0; j < dim; j++)
            share[0][i * dim + j] = Q ? Q[j * dim + i] : i == j;
    return 1;
}

/* Adds to the carriers from `start` on of node a, each once. */
static void append(uz_followers *f, int64_t start, int64_t *n, int dim, int64_t node, const double *share, double times)
{
    int64_t at = start;
    while (at < *n && f->node[at] != node)
        at++;
    if (at == *n) {
        f->node[(*n)++] = node;
        memset(f->share + at * dim * dim, 0, (size_t)(dim * dim) * sizeof *share);
    }
    for (int i = 0; i < dim * dim; i++)
        f->share[at * dim * dim + i] += times * share[i];
}

/* A slave of a tie: the carriers of its masters, and itself for what supports hold of it. */
static void append_tied(uz_followers *f, int64_t *n, const uz_body_model *model, int64_t a, const double *u)
{
    const uz_csc *tied = &model->tied.share;
    const int dim = model->mesh.dim;
    double own[2][9], held[9] = {0};
    int64_t node[2];
    bool any = false;
    for (int64_t q = tied->ptr[a]; q < tied->ptr[a + 1]; q++) {
        const int carriers = own_carriers(node, own, model, tied->idx[q], u);
        for (int k = 0; k < carriers; k++) {
            for (int j = 0; j < dim; j++) {
                double column[3] = {0};
                for (int i = 0; i < dim; i++)
                    column[i] = own[k][i * dim + j];
                uz_tied_part(column, model, a);
                for (int i = 0; i < dim; i++)
                    own[k][i * dim + j] = column[i];
            }
            append(f, f->first[a], n, dim, node[k], own[k], tied->val[q]);
        }
    }
    for (int c = 0; c < dim; c++) {
        double along[3] = {c == 0, c == 1, c == 2};
        const bool is_held = model->dof[a * dim + c] != UZ_NO_DOF;
        uz_from_frame(along, model, a);
        for (int i = 0; i < dim && is_held; i++)
            held[i * dim + c] = along[i];
        any = any || is_held;
    }
    if (any)
        append(f, f->first[a], n, dim, a, held, 1);
}

/* Nodes of rigid groups and tied ones, and hanging ones, which may lie amid such. */
uz_status uz_find_followers(uz_body_model *model, const double *u, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    uz_followers *f = &model->follow;
    int64_t most = 0, n = 0, node[2];
    double own[2][9];
    if (model->n_rigid == 0 && !model->tied.share.ptr)
        return UZ_OK;
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        const int64_t *from;
        const double *share;
        most += 2 * (uz_mesh_hangs(mesh, a) ? uz_mesh_amid(&from, &share, mesh, a) : uz_is_rigid(model, a));
        most += uz_is_tied(model, a) ? 2 * (model->tied.share.ptr[a + 1] - model->tied.share.ptr[a]) + 1 : 0;
    }
    f->first = uz_alloc_zero(mesh->n_nodes + 1, sizeof *f->first);
    f->node = uz_alloc(most, sizeof *f->node);
    f->share = uz_alloc(most * dim * dim, sizeof *f->share);
    if (!f->first || !f->node || !f->share)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the nodes of rigid groups");
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        const int64_t *from = &a;
        const double whole = 1, *amid = &whole;
        const bool hangs = uz_mesh_hangs(mesh, a);
        const int parents = hangs ? uz_mesh_amid(&from, &amid, mesh, a) : uz_is_rigid(model, a);
        f->first[a] = n;
        if (uz_is_tied(model, a))
            append_tied(f, &n, model, a, u);
        for (int p = 0; p < parents; p++) {
            const int carriers = own_carriers(node, own, model, from[p], u);
            for (int k = 0; k < carriers; k++)
                append(f, f->first[a], &n, dim, node[k], own[k], amid[p]);
        }
    }
    f->first[mesh->n_nodes] = n;
    return UZ_OK;
}

/* ---- stiffness */

bool uz_have_carriers(const uz_body_model *model, const int64_t *node, int count)
{
    bool any = false;
    for (int a = 0; model->follow.first && a < count; a++)
        any = any || model->follow.first[node[a]] < model->follow.first[node[a] + 1];
    return any;
}

/* Nodes that carry a, itself among them where it has dofs of its own. */
static int64_t carriers_or_self(const int64_t **node, const double **share, double turned[9],
                                const uz_body_model *model, const int64_t *a)
{
    const int64_t count = uz_carriers(node, share, model, *a);
    int64_t self[2];
    double own[2][9];
    if (count > 0)
        return count;
    own_carriers(self, own, model, *a, NULL);
    memcpy(turned, own[0], sizeof own[0]);
    *node = a;
    *share = turned;
    return 1;
}

/* out = P' block Q, block of the rows of a stiffness with `line` entries each. */
static void carry_block(double out[9], const double *block, int line, const double *P, const double *Q, int dim)
{
    double half[9] = {0};
    memset(out, 0, 9 * sizeof *out);
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            for (int k = 0; k < dim; k++)
                half[i * dim + j] += block[i * line + k] * Q[k * dim + j];
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            for (int k = 0; k < dim; k++)
                out[i * dim + j] += P[k * dim + i] * half[k * dim + j];
}

/* The lower triangle of K, and the free rows of K_fixed. */
void uz_add_dof_block(uz_body_model *model, int64_t at, int64_t other, const double block[9])
{
    const int dim = model->mesh.dim;
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++) {
            const int64_t row = model->dof[at * dim + i], column = model->dof[other * dim + j];
            uz_csc *to = column < 0 ? &model->K_fixed : &model->K;
            if (row < 0 || column == UZ_NO_DOF || row < column || block[i * dim + j] == 0)
                continue;
            const int64_t place = uz_csc_find(to, row, column < 0 ? -1 - column : column);
            to->val[place] += block[i * dim + j];
        }
}

bool uz_is_unstrained(const uz_body_model *model, const int64_t *node, int count)
{
    bool unstrained = model->n_rigid > 0;
    for (int a = 0; a < count && unstrained; a++)
        unstrained = uz_is_rigid(model, node[a]) && model->rigid_of[node[a]] == model->rigid_of[node[0]];
    return unstrained;
}

void uz_add_carried_block(uz_entries *to, const uz_body_model *model, int64_t i, int64_t j, const double B[9])
{
    const int dim = model->mesh.dim;
    const int64_t *p, *q;
    const double *P, *Q;
    double turned[2][9], block[9];
    const int64_t ps = carriers_or_self(&p, &P, turned[0], model, &i),
                  qs = carriers_or_self(&q, &Q, turned[1], model, &j);
    for (int64_t k = 0; k < ps * qs; k++) {
        carry_block(block, B, dim, P + k / qs * dim * dim, Q + k % qs * dim * dim, dim);
        for (int c = 0; c < dim * dim; c++) {
            const int64_t row = model->dof[p[k / qs] * dim + c / dim], column = model->dof[q[k % qs] * dim + c % dim];
            if (row >= 0 && column >= 0 && block[c] != 0)
                uz_entries_add(to, row, column, block[c]);
        }
    }
}

void uz_add_carried_row(uz_entries *to, int64_t row, const uz_body_model *model, int64_t j, const double slope[3])
{
    const int dim = model->mesh.dim;
    const int64_t *node;
    const double *share;
    double turned[9];
    const int64_t count = carriers_or_self(&node, &share, turned, model, &j);
    for (int64_t i = 0; i < count * dim; i++) {
        const int64_t dof = model->dof[node[i / dim] * dim + i % dim];
        double along = 0;
        for (int c = 0; c < dim; c++)
            along += share[(i / dim * dim + c) * dim + i % dim] * slope[c];
        if (dof >= 0 && along != 0)
            uz_entries_add(to, row, dof, along);
    }
}

void uz_add_carried(uz_body_model *model, const double *ke, const int64_t *node, int count)
{
    const int dim = model->mesh.dim, n = count * dim;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < count; b++) {
            const int64_t *p, *q;
            const double *P, *Q;
            double turned[2][9], block[9];
            const int64_t ps = carriers_or_self(&p, &P, turned[0], model, &node[a]),
                          qs = carriers_or_self(&q, &Q, turned[1], model, &node[b]);
            for (int64_t i = 0; i < ps; i++)
                for (int64_t j = 0; j < qs; j++) {
                    carry_block(block, ke + a * dim * n + b * dim, n, P + i * dim * dim, Q + j * dim * dim, dim);
                    uz_add_dof_block(model, p[i], q[j], block);
                }
        }
}

/* ---- displacements */

void uz_carried(double u[3], const uz_body_model *model, int64_t a, const double *free, const double *prescribed)
{
    const int dim = model->mesh.dim;
    const int64_t *node;
    const double *share;
    const int64_t count = uz_carriers(&node, &share, model, a);
    memset(u, 0, 3 * sizeof *u);
    for (int64_t k = 0; k < count; k++)
        for (int c = 0; c < dim; c++) {
            const int64_t dof = model->dof[node[k] * dim + c];
            const double v = dof >= 0                         ? (free ? free[dof] : 0)
                             : prescribed && dof != UZ_NO_DOF ? prescribed[-1 - dof]
                                                              : 0;
            for (int i = 0; i < dim; i++)
                u[i] += share[(k * dim + i) * dim + c] * v;
        }
}

/* The rotation that fits three displacements best: J w = sum r x u about their centre; J inverted by its adjugate. */
static void fit_turn(double w[3], const double x[3][3], const double u[3][3])
{
    double J[3][3] = {{0}}, b[3] = {0}, rows[3][3], det;
    for (int a = 0; a < 3; a++) {
        double r[3], d[3], moment[3];
        for (int c = 0; c < 3; c++) {
            r[c] = x[a][c] - (x[0][c] + x[1][c] + x[2][c]) / 3;
            d[c] = u[a][c] - (u[0][c] + u[1][c] + u[2][c]) / 3;
        }
        uz_cross3(moment, r, d);
        for (int i = 0; i < 3; i++) {
            b[i] += moment[i];
            for (int j = 0; j < 3; j++)
                J[i][j] += (i == j ? uz_dot3(r, r) : 0) - r[i] * r[j];
        }
    }
    for (int i = 0; i < 3; i++)
        uz_cross3(rows[i], J[(i + 1) % 3], J[(i + 2) % 3]);
    det = uz_dot3(J[0], rows[0]);
    for (int i = 0; i < 3; i++)
        w[i] = (rows[0][i] * b[0] + rows[1][i] * b[1] + rows[2][i] * b[2]) / det;
}

void uz_rigid_motion(double t[3], double w[3], const uz_body_model *model, const uz_rigid_group *group,
                     const double *from, const double *nodal)
{
    const int dim = model->mesh.dim;
    double x[3][3] = {{0}}, u[3][3] = {{0}}, arm[3], turned[3], moved[3] = {0}, R[9];
    memset(w, 0, 3 * sizeof *w);
    for (int a = 0; a < 3 && group->anchor[a] >= 0; a++) {
        place_of(x[a], &model->mesh, group->anchor[a]);
        memcpy(u[a], nodal + group->anchor[a] * dim, (size_t)dim * sizeof **u);
        for (int c = 0; c < dim && from; c++) {
            x[a][c] += from[group->anchor[a] * dim + c];
            u[a][c] -= from[group->anchor[a] * dim + c];
        }
    }
    if (from)
        uz_rigid_place(moved, R, model, group, from);
    if (model->kind == UZ_AXISYMMETRIC) {
        memcpy(t, (double[3]){0, u[0][1], 0}, 3 * sizeof *t);
        return;
    }
    if (dim == 2) {
        const double r[2] = {x[1][0] - x[0][0], x[1][1] - x[0][1]}, d[2] = {u[1][0] - u[0][0], u[1][1] - u[0][1]};
        w[2] = uz_cross2(r, d) / uz_dot2(r, r);
    } else {
        fit_turn(w, x, u);
    }
    for (int c = 0; c < 3; c++)
        arm[c] = group->point[c] + moved[c] - x[0][c];
    uz_cross3(turned, w, arm);
    for (int c = 0; c < 3; c++)
        t[c] = u[0][c] + turned[c];
}

void uz_set_motion(double *u, const uz_body_model *model, const uz_rigid_group *group, const double t[3],
                   const double w[3])
{
    const int dim = model->mesh.dim;
    for (int c = 0; c < 2 * dim; c++) {
        const int64_t node = group->anchor[c / dim], dof = node < 0 ? UZ_NO_DOF : model->dof[node * dim + c % dim];
        if (dof >= 0)
            u[dof] = c < dim ? t[c] : group->size * w[dim == 2 ? 2 : c - dim];
    }
}

double uz_carried_error(const uz_body_model *model, int64_t a, const double *nodal)
{
    const uz_rigid_group *group = uz_rigid_group_of(model, a);
    double t[3], w[3], x[3];
    uz_rigid_motion(t, w, model, group, NULL, nodal);
    place_of(x, &model->mesh, a);
    const double away = sqrt(uz_distance2(x, group->point, 3)) + group->size;
    return 32 * DBL_EPSILON * (sqrt(uz_dot3(t, t)) + sqrt(uz_dot3(w, w)) * away);
}
