/* rigid_groups.c: rigid groups of an answer of large deformation, in extended precision. */
#include "certificate/rigid_groups.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where a group is: by its anchors, whose places are two or three of a triangle's. */
typedef struct {
    const uz_rigid_group *group;
    long double t[3], R[9]; /* u(x) = t + (R - I) (x - point) */
} group_at;

static void normalize(long double v[3])
{
    const long double size = sqrtl(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int c = 0; c < 3; c++)
        v[c] /= size;
}

/* e: along the first side of the anchors' triangle, across it, and their product. */
static void axes_of(long double e[3][3], long double x[3][3], int dim)
{
    const long double flat[3] = {0, 0, 1};
    long double side[3];
    for (int c = 0; c < 3; c++) {
        e[0][c] = x[1][c] - x[0][c];
        side[c] = x[2][c] - x[0][c];
    }
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        e[1][c] = dim == 2 ? flat[c] : e[0][a] * side[b] - e[0][b] * side[a];
    }
    normalize(e[0]);
    normalize(e[1]);
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        e[2][c] = e[0][a] * e[1][b] - e[0][b] * e[1][a];
    }
}

static void find_group(group_at *out, const uz_finite_answer *of, const uz_rigid_group *group)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim, anchors = model->kind == UZ_AXISYMMETRIC ? 1 : dim;
    long double x[3][3] = {{0}}, y[3][3] = {{0}}, from[3][3], to[3][3];
    *out = (group_at){.group = group, .R = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    for (int a = 0; a < anchors; a++)
        for (int c = 0; c < dim; c++) {
            x[a][c] = model->mesh.xyz[dim * group->anchor[a] + c];
            y[a][c] = x[a][c] + of->u[dim * group->anchor[a] + c];
        }
    if (anchors > 1) {
        axes_of(from, x, dim);
        axes_of(to, y, dim);
    }
    for (int i = 0; i < 9 && anchors > 1; i++) {
        out->R[i] = 0;
        for (int k = 0; k < 3; k++)
            out->R[i] += to[k][i / 3] * from[k][i % 3];
    }
    for (int i = 0; i < 3; i++) {
        out->t[i] = y[0][i] - x[0][i];
        for (int j = 0; j < 3; j++)
            out->t[i] -= (out->R[3 * i + j] - (i == j)) * (x[0][j] - group->point[j]);
    }
}

/* How far one of its nodes is from where the motion of its anchors has it. */
static double off_shape(const group_at *at, const uz_finite_answer *of)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    double most = 0;
    for (int64_t a = 0; a < model->mesh.n_nodes; a++)
        for (int i = 0; i < dim && uz_rigid_group_of(model, a) == at->group; i++) {
            long double u = at->t[i];
            for (int j = 0; j < 3; j++)
                u += (at->R[3 * i + j] - (i == j)) *
                     ((j < dim ? model->mesh.xyz[dim * a + j] : 0) - at->group->point[j]);
            if (i > 0 || model->kind != UZ_AXISYMMETRIC)
                most = fmax(most, fabs((double)(of->u[dim * a + i] - u)));
        }
    return most;
}

/* What of its motion is prescribed: of rotations by what they do to the axes, e + sin (n x e) + (1 - cos) n x (n x e).
 * Two that are held at 0 keep the third's axis. */
static double off_motion(const group_at *at, const uz_finite_answer *of)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    const int64_t *dof = model->dof + dim * at->group->anchor[0];
    double most = 0, n[3] = {0}, angle = 0;
    int held = 0, free = 2;
    for (int c = 0; c < dim; c++)
        if (dof[c] < 0 && dof[c] != UZ_NO_DOF)
            most = fmax(most, fabs((double)(at->t[c] - of->prescribed[-1 - dof[c]])));
    if (model->kind == UZ_AXISYMMETRIC)
        return most;
    dof = model->dof + dim * at->group->anchor[1];
    for (int c = 0; c < (dim == 2 ? 1 : 3); c++) {
        held += dof[c] < 0;
        free = dof[c] < 0 ? free : c;
        n[dim == 2 ? 2 : c] = dof[c] < 0 ? of->prescribed[-1 - dof[c]] / at->group->size : 0;
    }
    for (int c = 0; c < 3; c++)
        angle = hypot(angle, n[c]);
    for (int k = 0; k < 3 && held > 0; k++) {
        double e[3] = {k == 0, k == 1, k == 2}, once[3], twice[3];
        uz_cross3(once, n, e);
        uz_cross3(twice, n, once);
        for (int c = 0; c < 3 && (held != 2 || k == free); c++) {
            const double by = angle > 0 ? sin(angle) / angle : 1,
                         more = angle > 0 ? (1 - cos(angle)) / (angle * angle) : 0.5;
            const double there = e[c] + by * once[c] + more * twice[c];
            most = fmax(most, at->group->size * fabs((double)(at->R[3 * c + k] - there)));
        }
    }
    return most;
}

/* Forces that are left over on its nodes as it turns: the way of a node bends by w x (w x r), and f times that is
 * (w r) (w f) - (f r) w w. f: n_nodes x dim, the gradient of the Lagrangian. */
static void add_bend(uz_body_model *tangent, const group_at *at, const uz_finite_answer *of, const double *f)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    double H[9] = {0}, block[9] = {0};
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        double r[3] = {0}, own[3] = {0}, along = 0;
        if (uz_rigid_group_of(model, a) != at->group)
            continue;
        for (int c = 0; c < 3; c++) {
            r[c] = (c < dim ? model->mesh.xyz[dim * a + c] + of->u[dim * a + c] : 0) -
                   (double)(at->group->point[c] + at->t[c]);
            own[c] = c < dim ? f[dim * a + c] : 0;
            along += r[c] * own[c];
        }
        for (int i = 0; i < 9; i++)
            H[i] += (own[i / 3] * r[i % 3] + own[i % 3] * r[i / 3]) / 2 - (i % 4 == 0 ? along : 0);
    }
    for (int i = 0; i < dim * dim; i++)
        block[i] = (dim == 3 ? H[i] : i == 0 ? H[8] : 0) / (at->group->size * at->group->size);
    uz_add_dof_block(tangent, at->group->anchor[1], at->group->anchor[1], block);
}

double uz_rigid_groups_off(const uz_finite_answer *of)
{
    double most = 0;
    for (int64_t k = 0; k < of->model->n_rigid; k++) {
        group_at at;
        find_group(&at, of, &of->model->rigid[k]);
        most = fmax(most, fmax(off_shape(&at, of), off_motion(&at, of)));
    }
    return most;
}

/* What a row between bodies presses its masters with: `force` on its slave, their shares of it on them. */
static void add_masters(double *nodal, const uz_body_model *model, int64_t row, double force)
{
    const int dim = model->mesh.dim;
    const int64_t place = model->row_place[row];
    const uz_contact_sites *sites = &model->sites[model->info.contact_of[row]];
    if (model->info.contact_face[2 * row] < 0)
        return;
    for (int64_t q = sites->first[place]; q < sites->first[place + 1]; q++)
        for (int c = 0; c < dim; c++)
            nodal[dim * sites->node[q] + c] -= sites->weight[q] * force * model->info.contact_normal[dim * row + c];
}

/* Forces on nodes that hang amid others, or are tied to them, are forces on these. */
static void let_go(double *nodal, const uz_body_model *model)
{
    const int dim = model->mesh.dim;
    const uz_csc *tied = &model->tied.share;
    for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
        double *own = nodal + dim * a, part[3] = {0};
        memcpy(part, own, (size_t)dim * sizeof *part);
        if (uz_is_tied(model, a))
            uz_tied_part(part, model, a);
        for (int c = 0; c < dim; c++) {
            if (uz_mesh_hangs(&model->mesh, a)) {
                const int64_t *node;
                const double *share;
                for (int k = uz_mesh_amid(&node, &share, &model->mesh, a); k-- > 0;)
                    nodal[dim * node[k] + c] += share[k] * part[c];
                own[c] = 0;
            } else if (uz_is_tied(model, a)) {
                for (int64_t q = tied->ptr[a]; q < tied->ptr[a + 1]; q++)
                    nodal[(int64_t)dim * tied->idx[q] + c] += tied->val[q] * part[c];
                own[c] -= part[c];
            }
        }
    }
}

uz_status uz_rigid_groups_bend(uz_body_model *tangent, double *nodal, const uz_finite_answer *of, uz_error *err)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    double *force = uz_alloc(model->m, sizeof *force);
    if (!force)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)model->m);
    uz_row_forces(force, model, of->r);
    for (int64_t i = 0; i < dim * model->mesh.n_nodes; i++)
        nodal[i] = -nodal[i];
    for (int64_t row = 0; row < model->m; row++) {
        const uz_inner_place *inner = uz_row_inner(model, row);
        const double *normal = model->info.contact_normal + dim * row;
        for (int p = 0; p < dim * (inner ? inner->nodes : 1); p++) {
            const int64_t node = inner ? inner->node[p / dim] : model->info.contact_node[row];
            nodal[dim * node + p % dim] += (inner ? inner->share[p / dim] : 1) * force[row] * normal[p % dim];
        }
        add_masters(nodal, model, row, force[row]);
    }
    free(force);
    let_go(nodal, model);
    for (int64_t k = 0; k < model->n_rigid && model->kind != UZ_AXISYMMETRIC; k++) {
        group_at at;
        find_group(&at, of, &model->rigid[k]);
        add_bend(tangent, &at, of, nodal);
    }
    return UZ_OK;
}
