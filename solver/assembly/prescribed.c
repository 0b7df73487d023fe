/* prescribed.c: what supported dofs are given.
 *
 * A support along n says n . u = v. At a node of several supports the held dofs are an orthonormal basis of what their
 * normals span (dofs.c), made in this order, so that each n has a share in the dofs before and in one that is its own,
 * whose value follows; or in those before only, and then v must be what they make of it. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double AGREE = 1e-9; /* values that differ less, beside what they are made of, are the same */

typedef struct {
    const uz_body_model *model;
    const uz_scene *scene;
    double *value;   /* n_fixed */
    int64_t *source; /* n_fixed: 1 + the support that gave it, 0: none yet */
} prescription;

/* What a support's turn does at x: a x r of small deformation, r = x - about; exactly, with the unit axis e and the
 * angle t, sin t (e x r) - (1 - cos t) (r - (e . r) e) (Rodrigues). */
static void turned(double out[3], const uz_support *support, const double *x, int dim, bool exactly)
{
    const double *a = support->turn, angle = hypot(hypot(a[0], a[1]), a[2]);
    double r[3] = {0}, along = 0;
    for (int c = 0; c < dim; c++) {
        r[c] = x[c] - support->about[c];
        along += angle > 0 ? r[c] * a[c] / angle : 0;
    }
    const double sine = exactly && angle > 0 ? sin(angle) / angle : 1, half = sin(angle / 2);
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        out[c] = sine * (a[d] * r[e] - a[e] * r[d]);
        if (exactly && angle > 0)
            out[c] -= 2 * half * half * (r[c] - along * a[c] / angle);
    }
}

#define OTHER_BODY "the scene's supports are not those of this body"

/* Does a group that turns, or may, take the node along n? With large rotations that is another way than the shares of
 * the group's motion say, which are those of the first step from rest, and another one under each part of the load. A
 * turn about one of the axes takes nothing along that. */
static bool is_turned(const prescription *p, const uz_rigid_group *group, int64_t node, const double n[3])
{
    const int dim = p->model->mesh.dim;
    const double *turn = p->scene->supports[group->support].turn;
    double arm[3] = {0}, way = 0, across = INFINITY;
    int axes = 0;
    for (int c = 0; c < dim; c++)
        arm[c] = p->model->mesh.xyz[node * dim + c] - group->point[c];
    for (int c = dim == 2 ? 2 : 0; c < 3; c++) {
        const int d = (c + 1) % 3, e = (c + 2) % 3;
        if (turn[c] == 0) /* NaN: it is free */
            continue;
        way = fmax(way, fmax(fabs(arm[d]), fabs(arm[e])));
        across = axes++ == 0 ? fmax(fabs(n[d]), fabs(n[e])) : INFINITY;
    }
    return p->model->kind != UZ_AXISYMMETRIC && way > AGREE * p->model->mesh.extent && across > AGREE;
}

/* A node of a rigid group has what the group's motion makes of n . u: what another support gives it, too, has to be
 * that, and nothing of it may be free. */
static uz_status agree_with_group(const prescription *p, int64_t support, int64_t node, const double n[3], double value,
                                  uz_error *err)
{
    const uz_body_model *model = p->model;
    const int dim = model->mesh.dim;
    const uz_rigid_group *group = uz_rigid_group_of(model, node);
    const int64_t *from;
    const double *share;
    const int64_t count = uz_carriers(&from, &share, model, node);
    double u[3], along = 0, size = fabs(value);
    const bool turns = uz_is_finite_answer(p->scene) && is_turned(p, group, node, n);
    bool moves = false;
    for (int64_t k = 0; k < count; k++)
        for (int c = 0; c < dim; c++) {
            double part = 0;
            for (int i = 0; i < dim; i++)
                part += n[i] * share[(k * dim + i) * dim + c];
            moves = moves || (model->dof[from[k] * dim + c] >= 0 && fabs(part) > AGREE);
        }
    uz_carried(u, model, node, NULL, p->value);
    for (int c = 0; c < dim; c++) {
        along += n[c] * u[c];
        size += fabs(n[c] * u[c]);
    }
    if (!moves && !turns && fabs(along - value) <= AGREE * size)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", support, "on"),
                   "node %lld of \"%.63s\" is of the rigid group \"%.63s\", which %s: prescribe that motion of the "
                   "group, or leave the node out of one of them",
                   (long long)node, p->scene->supports[support].on, p->scene->supports[group->support].on,
                   moves   ? "is free to move it along what is held here"
                   : turns ? "turns it by a large rotation, which is not compared with what is held here"
                           : "moves it otherwise");
}

static uz_status prescribe(prescription *p, int64_t support, int64_t node, int c, double value, uz_error *err)
{
    const int64_t dof = p->model->dof[node * p->model->mesh.dim + c];
    const double along[3] = {c == 0, c == 1, c == 2};
    if (uz_is_rigid(p->model, node))
        return agree_with_group(p, support, node, along, value, err);
    if (dof == UZ_NO_DOF)
        return UZ_OK;
    if (dof >= 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/supports", OTHER_BODY);
    const int64_t fixed = -1 - dof;
    if (c == 0 && value != 0 && uz_is_on_axis(p->model, node))
        return uz_fail(err, UZ_ERR_SCENE, "/supports",
                       "node %lld of \"%.63s\" is on the axis of rotation and cannot leave it: ux = %g must be 0",
                       (long long)node, p->scene->supports[support].on, value);
    const uz_support *own = &p->scene->supports[support];
    /* turns about different points may do the same, to rounding */
    const double rounding =
        uz_support_turns(own)
            ? AGREE * (fabs(value) + p->model->mesh.extent * fabs(own->turn[0] + own->turn[1] + own->turn[2]))
            : 0;
    if (p->source[fixed] && fabs(p->value[fixed] - value) > rounding) {
        char where[96];
        const char axis = "xyz"[c];
        const int64_t earlier = p->source[fixed] - 1;
        const bool normal = p->scene->supports[support].kind == UZ_SUPPORT_NORMAL;
        snprintf(where, sizeof where, normal ? "/supports/%lld/u" : "/supports/%lld/u%c", (long long)support, axis);
        return uz_fail(err, UZ_ERR_SCENE, where,
                       "node %lld, where \"%.63s\" meets \"%.63s\", is given u%c = %g here and %g by support %lld; "
                       "leave one of them out or make them agree",
                       (long long)node, p->scene->supports[support].on, p->scene->supports[earlier].on, axis, value,
                       p->value[fixed], (long long)earlier);
    }
    p->value[fixed] = value;
    if (!p->source[fixed])
        p->source[fixed] = support + 1;
    return UZ_OK;
}

static uz_status prescribe_along(prescription *p, int64_t support, int64_t node, const double n[3], uz_error *err)
{
    const double value = p->scene->supports[support].value;
    const int64_t *dof = p->model->dof + node * p->model->mesh.dim;
    double known = 0, size = 0, share[3]; /* what the dofs given so far make of n . u */
    int own = -1;                         /* the held dof that n has its own share in */
    if (uz_is_rigid(p->model, node))
        return agree_with_group(p, support, node, n, value, err);
    if (uz_mesh_hangs(&p->model->mesh, node))
        return UZ_OK;
    uz_to_frame(share, p->model, node, n);
    for (int c = 0; c < p->model->mesh.dim; c++) {
        if (dof[c] == UZ_NO_DOF) /* what follows a tie has no part in what is held */
            continue;
        if (dof[c] < 0 && (p->source[-1 - dof[c]] || (c == 0 && uz_is_on_axis(p->model, node)))) {
            known += share[c] * p->value[-1 - dof[c]];
            size += fabs(p->value[-1 - dof[c]]); /* also of one that n is across but for rounding */
        } else if (fabs(share[c]) > UZ_DEPENDENT && (own < 0 || fabs(share[c]) > fabs(share[own]))) {
            own = c;
        }
    }
    if (own >= 0) {
        if (dof[own] >= 0)
            return uz_fail(err, UZ_ERR_ARGUMENT, "/supports", OTHER_BODY);
        p->value[-1 - dof[own]] = (value - known) / share[own];
        p->source[-1 - dof[own]] = support + 1;
        return UZ_OK;
    }
    if (fabs(value - known) <= AGREE * (fabs(value) + size))
        return UZ_OK;
    return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("supports", support, "u"),
                   "node %lld of \"%.63s\" is given %g along this normal and %g by its other supports; leave one of "
                   "them out or make them agree",
                   (long long)node, p->scene->supports[support].on, value, known);
}

uz_status uz_prescribed_values(double *value, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    uz_status status = UZ_OK;
    prescription p = {model, scene, value, uz_alloc_zero(model->n_fixed, sizeof *p.source)};
    if (!p.source)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld supported dofs", (long long)model->n_fixed);
    memset(value, 0, (size_t)model->n_fixed * sizeof *value);
    uz_rigid_values(value, model, scene);
    for (int64_t turn = 0; turn < 2 * scene->n_supports && status == UZ_OK; turn++) { /* axes first */
        const int64_t k = turn % scene->n_supports;
        const bool inclined = turn >= scene->n_supports;
        const uz_support *support = &scene->supports[k];
        const uz_group *group = uz_mesh_group(mesh, support->on, "/supports", err);
        const int64_t count = group ? uz_group_node_count(mesh, group) : 0;
        double n[3], u[3];
        status = group ? UZ_OK : UZ_ERR_SCENE;
        uz_support_values(u, support, mesh->dim);
        for (int c = 0; c < mesh->dim && !inclined; c++)
            for (int64_t i = 0; i < count && status == UZ_OK && !isnan(u[c]); i++) {
                const int64_t node = uz_group_node_at(group, i);
                double moved[3] = {0};
                if (uz_support_turns(support))
                    turned(moved, support, mesh->xyz + node * mesh->dim, mesh->dim, uz_is_finite_answer(scene));
                status = prescribe(&p, k, node, c, u[c] + moved[c], err);
            }
        const bool along = inclined && uz_support_is_inclined(n, support, mesh->dim);
        for (int64_t i = 0; along && i < count && status == UZ_OK; i++)
            status = prescribe_along(&p, k, uz_group_node_at(group, i), n, err);
    }
    free(p.source);
    return status;
}
