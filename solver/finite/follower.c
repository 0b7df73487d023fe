#include "finite/follower.h"

#include "assembly/parts.h"
#include "core/error.h"
#include "core/vector3.h"
#include "finite/point_load.h"
#include "linalg/linalg.h"
#include "scene/check.h"

#include <math.h>

/* Entries of the skew part that are less than this part of the largest entry of a side are rounding. */
#define ROUNDING 1e-12

enum { SIDE_DOFS = 3 * UZ_FACE_NODES };

/* A loaded side where it is. */
typedef struct {
    uz_side side; /* its xyz is that below once it is bound */
    double xyz[SIDE_DOFS], pressure[UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
} loaded;

static void find_side(loaded *x, const uz_body_model *model, uz_face face, double pressure, const double *u)
{
    const int dim = model->mesh.dim;
    uz_body_side(&x->side, x->xyz, x->node, model, face);
    for (int i = 0; i < dim * x->side.nodes; i++)
        x->xyz[i] += u[dim * x->node[i / dim] + i % dim];
    for (int a = 0; a < x->side.nodes; a++)
        x->pressure[a] = pressure;
}

/* The derivative of the forces of a side, ke[of][by]: they are polynomials of degree two in the places of its nodes,
 * whose central differences are exact for any step. */
static void differentiate(double *ke, double *largest, loaded *x)
{
    const int dim = x->side.dim, n = dim * x->side.nodes;
    double step = 0;
    for (int a = 1; a < x->side.nodes; a++)
        step = fmax(step, sqrt(uz_distance2(x->xyz + dim * a, x->xyz, dim)));
    for (int q = 0; q < n && step > 0; q++) {
        const double at = x->xyz[q];
        double ahead[SIDE_DOFS] = {0}, behind[SIDE_DOFS] = {0};
        x->xyz[q] = at + step;
        uz_side_add_pressure(ahead, &x->side, x->pressure);
        x->xyz[q] = at - step;
        uz_side_add_pressure(behind, &x->side, x->pressure);
        x->xyz[q] = at;
        for (int p = 0; p < n; p++) {
            ke[p * n + q] = (ahead[p] - behind[p]) / (2 * step);
            *largest = fmax(*largest, fabs(ke[p * n + q]));
        }
    }
}

bool uz_has_followers(const uz_scene *scene)
{
    bool has = false;
    for (int64_t i = 0; i < scene->n_loads && !has; i++)
        has = scene->loads[i].kind == UZ_LOAD_PRESSURE || scene->loads[i].has_point;
    return has;
}

/* The sides that load i acts on; NULL: *err. */
static const uz_group *sides_of(const uz_body_model *model, const uz_scene *scene, int64_t i, uz_error *err)
{
    return uz_mesh_group(&model->mesh, scene->loads[i].on, UZ_PLACE("loads", i, "on"), err);
}

uz_status uz_follower_loads(double *f, const uz_body_model *model, const uz_scene *scene, const double *u,
                            uz_error *err)
{
    const int dim = model->mesh.dim;
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const uz_status status = scene->loads[i].has_point ? uz_point_load(f, model, scene, i, u, err) : UZ_OK;
        if (status != UZ_OK)
            return status;
        if (scene->loads[i].kind != UZ_LOAD_PRESSURE)
            continue;
        const uz_group *group = sides_of(model, scene, i, err);
        if (!group)
            return UZ_ERR_SCENE;
        for (int64_t k = 0; k < group->n_faces; k++) {
            double own[SIDE_DOFS] = {0};
            loaded x;
            find_side(&x, model, group->face[k], scene->loads[i].value, u);
            uz_side_add_pressure(own, &x.side, x.pressure);
            for (int p = 0; p < dim * x.side.nodes; p++)
                f[dim * x.node[p / dim] + p % dim] += own[p];
        }
    }
    return UZ_OK;
}

static bool add_skew(uz_entries *out, const double *ke, const loaded *x)
{
    const int dim = x->side.dim, n = dim * x->side.nodes;
    bool room = true;
    for (int p = 0; p < n; p++)
        for (int q = 0; q < n && room; q++)
            if (p != q)
                room = uz_entries_add(out, dim * x->node[p / dim] + p % dim, dim * x->node[q / dim] + q % dim,
                                      0.5 * (ke[p * n + q] - ke[q * n + p]));
    return room;
}

/* What is left of the sides' skew parts, which cancel between neighbours; of dofs that are held nothing counts. */
static uz_status gather_skew(uz_csc *out, const uz_body_model *model, const uz_entries *from, double largest,
                             uz_error *err)
{
    const int64_t n = model->mesh.dim * model->mesh.n_nodes;
    const uz_status status = uz_csc_from_triplets(out, n, n, from->n, from->row, from->col, from->val, err);
    bool any = false;
    if (status != UZ_OK)
        return status;
    for (int64_t j = 0; j < n; j++)
        for (int64_t q = out->ptr[j]; q < out->ptr[j + 1]; q++) {
            const bool held = !model->frame_of && (model->dof[j] < 0 || model->dof[out->idx[q]] < 0) &&
                              model->dof[j] != UZ_NO_DOF && model->dof[out->idx[q]] != UZ_NO_DOF;
            if (held || fabs(out->val[q]) <= ROUNDING * largest)
                out->val[q] = 0;
            any = any || out->val[q] != 0;
        }
    if (!any)
        uz_csc_clear(out);
    return UZ_OK;
}

uz_status uz_follower_tangent(uz_body_model *tangent, uz_csc *skew, const uz_scene *scene, const double *u,
                              uz_error *err)
{
    uz_entries all = {.n = 0};
    double ke[SIDE_DOFS * SIDE_DOFS] = {0}, sum[SIDE_DOFS * SIDE_DOFS], largest = 0;
    uz_status status = UZ_OK;
    uz_csc_clear(skew);
    for (int64_t i = 0; i < scene->n_loads && status == UZ_OK; i++) {
        if (scene->loads[i].has_point)
            status = uz_point_tangent(tangent, scene, i, u, err);
        if (status != UZ_OK || scene->loads[i].kind != UZ_LOAD_PRESSURE)
            continue;
        const uz_group *group = sides_of(tangent, scene, i, err);
        status = group ? UZ_OK : UZ_ERR_SCENE;
        for (int64_t k = 0; status == UZ_OK && k < group->n_faces; k++) {
            loaded x;
            find_side(&x, tangent, group->face[k], scene->loads[i].value, u);
            const int n = x.side.dim * x.side.nodes;
            differentiate(ke, &largest, &x);
            for (int p = 0; p < n; p++)
                for (int q = 0; q < n; q++)
                    sum[p * n + q] = -0.5 * (ke[p * n + q] + ke[q * n + p]);
            uz_add_stiffness(tangent, sum, x.node, x.side.nodes);
            if (!add_skew(&all, ke, &x))
                status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld sides",
                                 (long long)group->n_faces);
        }
    }
    if (status == UZ_OK && all.n > 0)
        status = gather_skew(skew, tangent, &all, largest, err);
    uz_entries_clear(&all);
    return status;
}
