/* rigid_place.c: rigid groups under large rotations.
 *
 * A group at P + t, turned by R, has its nodes at u(x) = t + (R - I) (x - P). Its dofs are then those of the next step
 * from there, d = dt + w x (R (x - P)), linear as in rigid.c about where the group is; the step leads to t + dt and
 * exp(w) R, so that distances are kept whatever its size. The second derivative of that way, w x (w x r), makes of
 * forces f on the nodes a stiffness of the rotation, w' sum (sym(f r') - f'r I) w (J. Simo and L. Vu-Quoc, "A
 * three-dimensional finite-strain rod model. Part II", Comput. Methods Appl. Mech. Engrg. 58 (1986) 79-116). */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

static void multiply(double out[9], const double A[9], const double B[9])
{
    double product[9] = {0};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                product[3 * i + j] += A[3 * i + k] * B[3 * k + j];
    memcpy(out, product, sizeof product);
}

void uz_rotation(double R[9], const double w[3])
{
    const double angle = sqrt(uz_dot3(w, w)), half = sin(angle / 2);
    const double sine = angle > 0 ? sin(angle) / angle : 1, rest = angle > 0 ? 2 * half * half / (angle * angle) : 0.5;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            R[3 * i + j] = (i == j ? cos(angle) : 0) + rest * w[i] * w[j];
    for (int c = 0; c < 3; c++) {
        const int i = (c + 1) % 3, j = (c + 2) % 3;
        R[3 * j + i] += sine * w[c];
        R[3 * i + j] -= sine * w[c];
    }
}

/* By the quaternion whose largest component is found first (S. Shepperd, J. Guid. Control 1 (1978) 223-224). */
void uz_rotation_vector(double w[3], const double R[9])
{
    const double trace = R[0] + R[4] + R[8];
    double q[4], square[4] = {1 + trace, 1 + 2 * R[0] - trace, 1 + 2 * R[4] - trace, 1 + 2 * R[8] - trace};
    const double skew[4] = {0, R[7] - R[5], R[2] - R[6], R[3] - R[1]};
    int most = 0;
    for (int k = 1; k < 4; k++)
        most = square[k] > square[most] ? k : most;
    const double own = sqrt(square[most]) / 2;
    for (int k = 0; k < 4; k++)
        q[k] = k == most             ? own
               : most == 0 || k == 0 ? skew[most + k] / (4 * own)
                                     : (R[3 * most + k - 4] + R[3 * k + most - 4]) / (4 * own);
    double axis[3] = {q[1], q[2], q[3]};
    if (q[0] < 0)
        for (int c = 0; c < 3; c++)
            axis[c] = -axis[c];
    const double sine = uz_unit3(axis), angle = 2 * atan2(sine, fabs(q[0]));
    for (int c = 0; c < 3; c++)
        w[c] = angle * axis[c];
}

static void place_of(double x[3], const uz_body_model *model, int64_t node, const double *u)
{
    const int dim = model->mesh.dim;
    for (int c = 0; c < 3; c++)
        x[c] = c < dim ? model->mesh.xyz[node * dim + c] + (u ? u[node * dim + c] : 0) : 0;
}

/* Q: an orthonormal basis that goes with the group's anchors, in its columns. Differences of places and of
 * displacements apart, so that how far the body is from the origin has no part in their rounding. */
static void basis(double Q[9], const uz_body_model *model, const uz_rigid_group *group, const double *u)
{
    const int dim = model->mesh.dim;
    const double *xyz = model->mesh.xyz;
    const int64_t from = group->anchor[0] * dim;
    double side[2][3] = {{0}}, e[3][3] = {{0}};
    for (int a = 0; a < (dim == 2 ? 1 : 2); a++)
        for (int c = 0; c < dim; c++) {
            const int64_t to = group->anchor[a + 1] * dim;
            side[a][c] = (xyz[to + c] - xyz[from + c]) + (u ? u[to + c] - u[from + c] : 0);
        }
    memcpy(e[0], side[0], sizeof e[0]);
    uz_unit3(e[0]);
    if (dim == 2) {
        e[2][2] = 1;
    } else {
        uz_cross3(e[2], e[0], side[1]);
        uz_unit3(e[2]);
    }
    uz_cross3(e[1], e[2], e[0]);
    for (int i = 0; i < 9; i++)
        Q[i] = e[i % 3][i / 3];
}

void uz_rigid_place(double t[3], double R[9], const uz_body_model *model, const uz_rigid_group *group, const double *u)
{
    const double *own = u + group->anchor[0] * model->mesh.dim;
    double from[9], to[9], x[3];
    memset(R, 0, 9 * sizeof *R);
    R[0] = R[4] = R[8] = 1;
    memset(t, 0, 3 * sizeof *t);
    memcpy(t, own, (size_t)model->mesh.dim * sizeof *t);
    if (model->kind == UZ_AXISYMMETRIC)
        return;
    basis(from, model, group, NULL);
    basis(to, model, group, u);
    for (int i = 0; i < 9; i++) {
        R[i] = 0;
        for (int k = 0; k < 3; k++)
            R[i] += to[3 * (i / 3) + k] * from[3 * (i % 3) + k];
    }
    place_of(x, model, group->anchor[0], NULL);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            t[i] -= (R[3 * i + j] - (i == j)) * (x[j] - group->point[j]);
}

/* u of a node of the group. */
static void displacement(double *u, const uz_body_model *model, const uz_rigid_group *group, int64_t node,
                         const double t[3], const double R[9])
{
    double x[3];
    place_of(x, model, node, NULL);
    for (int i = 0; i < model->mesh.dim; i++) {
        u[i] = t[i];
        for (int j = 0; j < 3; j++)
            u[i] += (R[3 * i + j] - (i == j)) * (x[j] - group->point[j]);
    }
}

static void add_bend(double G[9], const double f[3], const double r[3])
{
    for (int i = 0; i < 9; i++)
        G[i] += 0.5 * (f[i / 3] * r[i % 3] + r[i / 3] * f[i % 3]) - (i % 4 == 0 ? uz_dot3(f, r) : 0);
}

static void add_turn_block(uz_body_model *to, const uz_rigid_group *group, const double G[9])
{
    const int dim = to->mesh.dim;
    double block[9] = {0};
    for (int i = 0; i < (dim == 2 ? 1 : 9); i++)
        block[i] = (dim == 2 ? G[8] : G[i]) / (group->size * group->size);
    uz_add_dof_block(to, group->anchor[1], group->anchor[1], block);
}

uz_status uz_body_turned(uz_body_model *out, const uz_body_model *model, const double *u, uz_error *err)
{
    *out = *model;
    if (model->n_rigid == 0)
        return UZ_OK;
    memset(&out->follow, 0, sizeof out->follow);
    const uz_status status = uz_find_followers(out, u, err);
    out->turned = status == UZ_OK;
    if (status != UZ_OK) {
        uz_followers_clear(&out->follow);
        out->follow = model->follow;
    }
    return status;
}

void uz_body_turned_clear(uz_body_model *turned)
{
    if (turned->turned)
        uz_followers_clear(&turned->follow);
    memset(turned, 0, sizeof *turned);
}

void uz_rigid_ways(double *given, const uz_body_model *model, const double *prescribed, const double *u)
{
    const int dim = model->mesh.dim, turns = dim == 2 ? 1 : 3;
    for (int64_t k = 0; k < model->n_rigid; k++) {
        const uz_rigid_group *group = &model->rigid[k];
        const int64_t *dof = model->dof + group->anchor[0] * dim;
        double t[3], R[9], to[3] = {0}, way[3];
        bool whole = true;
        uz_rigid_place(t, R, model, group, u);
        for (int c = 0; c < dim; c++)
            if (dof[c] < 0 && dof[c] != UZ_NO_DOF)
                given[-1 - dof[c]] = prescribed[-1 - dof[c]] - t[c];
        if (model->kind == UZ_AXISYMMETRIC)
            continue;
        dof = model->dof + group->anchor[1] * dim;
        for (int c = 0; c < turns; c++) {
            whole = whole && dof[c] < 0;
            to[dim == 2 ? 2 : c] = dof[c] < 0 ? prescribed[-1 - dof[c]] / group->size : 0;
        }
        memset(way, 0, sizeof way);
        if (whole && dim == 3) {
            double back[9], turn[9];
            for (int i = 0; i < 9; i++)
                back[i] = R[3 * (i % 3) + i / 3];
            uz_rotation(turn, to);
            multiply(turn, turn, back);
            uz_rotation_vector(way, turn);
        } else if (whole) {
            way[2] = remainder(to[2] - atan2(R[3], R[0]), 2 * PI); /* R knows no whole turns */
        }
        for (int c = 0; c < turns; c++) /* others turn about an axis that is free, and stay */
            if (dof[c] < 0)
                given[-1 - dof[c]] = group->size * way[dim == 2 ? 2 : c];
    }
}

void uz_rigid_part(double at[3], const uz_body_model *model, int64_t a, const double *u)
{
    const int dim = model->mesh.dim;
    const uz_csc *tied = &model->tied.share;
    memset(at, 0, 3 * sizeof *at);
    if (model->n_rigid == 0)
        return;
    if (uz_is_tied(model, a)) {
        for (int64_t q = tied->ptr[a]; q < tied->ptr[a + 1]; q++)
            for (int c = 0; c < dim && uz_is_rigid(model, tied->idx[q]); c++)
                at[c] += tied->val[q] * u[(int64_t)tied->idx[q] * dim + c];
        uz_tied_part(at, model, a);
        return;
    }
    const int64_t *from = &a;
    const double whole = 1, *share = &whole;
    const int count = uz_mesh_hangs(&model->mesh, a) ? uz_mesh_amid(&from, &share, &model->mesh, a) : 1;
    for (int k = 0; k < count; k++)
        for (int c = 0; c < dim && uz_is_rigid(model, from[k]); c++)
            at[c] += share[k] * u[from[k] * dim + c];
}

/* u of a tied node: where its masters are, but for what supports hold of it. */
static void follow_masters(double *u, const uz_body_model *model, int64_t a)
{
    const int dim = model->mesh.dim;
    double way[3] = {0}, there[3], own[3];
    for (int c = 0; c < dim; c++)
        way[c] = uz_tied_value(model, a, u + c, dim);
    uz_to_frame(there, model, a, way);
    uz_to_frame(own, model, a, u + a * dim);
    for (int c = 0; c < dim; c++)
        own[c] = model->dof[a * dim + c] == UZ_NO_DOF ? there[c] : own[c];
    uz_from_frame(own, model, a);
    memcpy(u + a * dim, own, (size_t)dim * sizeof *u);
}

/* What hangs amid others, or is tied to them, where it may follow rigid groups. */
static void follow_others(double *u, const uz_body_model *model)
{
    const int dim = model->mesh.dim;
    for (int64_t a = 0; a < model->mesh.n_nodes && model->n_rigid > 0; a++) {
        for (int c = 0; c < dim && uz_mesh_hangs(&model->mesh, a); c++)
            u[a * dim + c] = uz_mesh_value_amid(&model->mesh, a, u + c, dim);
        if (uz_is_tied(model, a))
            follow_masters(u, model, a);
    }
}

/* Is all of a group's rotation prescribed? */
static bool turn_is_given(const uz_body_model *model, const uz_rigid_group *group)
{
    const int dim = model->mesh.dim;
    bool given = true;
    for (int c = 0; c < (dim == 2 ? 1 : 3); c++)
        given = given && model->dof[group->anchor[1] * dim + c] < 0;
    return given;
}

void uz_rigid_step(double *u, const uz_body_model *model, const double *from, bool polar)
{
    const int dim = model->mesh.dim;
    for (int64_t k = 0; k < model->n_rigid; k++) {
        const uz_rigid_group *group = &model->rigid[k];
        double t[3], R[9], dt[3], w[3], turn[9];
        uz_rigid_place(t, R, model, group, from);
        uz_rigid_motion(dt, w, model, group, from, u);
        const double tangent = sqrt(uz_dot3(w, w));
        for (int c = 0; c < 3 && polar && tangent > 0 && !turn_is_given(model, group); c++)
            w[c] *= atan(tangent) / tangent;
        uz_rotation(turn, w);
        multiply(turn, turn, R);
        for (int c = 0; c < 3; c++)
            t[c] += dt[c];
        for (int64_t a = 0; a < model->mesh.n_nodes; a++)
            if (uz_rigid_group_of(model, a) == group && model->kind != UZ_AXISYMMETRIC)
                displacement(u + a * dim, model, group, a, t, turn);
            else if (uz_rigid_group_of(model, a) == group)
                u[a * dim + 1] = from[a * dim + 1] + dt[1];
    }
    follow_others(u, model);
}

/* Forces on what follows others go to these. f: n_nodes x dim. */
static void leave_followers(double *f, const uz_body_model *model)
{
    const int dim = model->mesh.dim;
    const uz_csc *tied = &model->tied.share;
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        const int64_t *from;
        const double *share;
        const int count = uz_mesh_hangs(&model->mesh, a) ? uz_mesh_amid(&from, &share, &model->mesh, a) : 0;
        double left[3] = {0};
        memcpy(left, f + a * dim, (size_t)dim * sizeof *left);
        if (uz_is_tied(model, a))
            uz_tied_part(left, model, a);
        else if (count == 0)
            continue;
        for (int c = 0; c < dim; c++) {
            for (int k = 0; k < count; k++)
                f[from[k] * dim + c] += share[k] * left[c];
            for (int64_t q = uz_is_tied(model, a) ? tied->ptr[a] : 0; uz_is_tied(model, a) && q < tied->ptr[a + 1]; q++)
                f[(int64_t)tied->idx[q] * dim + c] += tied->val[q] * left[c];
            f[a * dim + c] -= left[c];
        }
    }
}

void uz_rigid_turn_stiffness(uz_body_model *to, const uz_body_model *model, const double *u, double *f)
{
    const int dim = model->mesh.dim;
    leave_followers(f, model);
    for (int64_t k = 0; k < model->n_rigid && model->kind != UZ_AXISYMMETRIC; k++) {
        const uz_rigid_group *group = &model->rigid[k];
        double t[3], R[9], G[9] = {0};
        uz_rigid_place(t, R, model, group, u);
        for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
            double r[3], force[3] = {0};
            if (uz_rigid_group_of(model, a) != group)
                continue;
            place_of(r, model, a, u);
            for (int c = 0; c < 3; c++)
                r[c] -= group->point[c] + t[c];
            memcpy(force, f + a * dim, (size_t)dim * sizeof *force);
            add_bend(G, force, r);
        }
        add_turn_block(to, group, G);
    }
}
