/* springs.c: elastic ground. The stiffness of a group is its total, spread over its faces by area. Forces
 * are spread likewise, over elements by volume, and over the nodes that were given equally: a finer mesh has the same.
 */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Springs at the nodes of linear sides are at most three times as stiff as those along them are. */
#define BOUND 2

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

/* k u along z at a place amid these nodes, with their shape functions there. */
static double product(const double *k, const double *u, const double *z, int dim, const int64_t *node, const double *N,
                      int nodes)
{
    double sum = 0;
    for (int c = 0; c < dim; c++) {
        double here = 0, along = 0;
        for (int a = 0; a < nodes; a++) {
            here += N[a] * u[node[a] * dim + c];
            along += N[a] * z[node[a] * dim + c];
        }
        sum += k[c] * here * along;
    }
    return sum;
}

static double excess_of_group(double *part, const uz_body_model *model, const uz_group *group, const double *k,
                              const double *u, const double *z)
{
    static const double ONE = 1;
    const int dim = model->mesh.dim;
    double sum = 0, area = 0;
    for (int pass = 0; pass < 2; pass++) /* the area first: all of it has k */
        for (int64_t f = 0; f < group->n_faces; f++) {
            double xyz[3 * UZ_FACE_NODES], N[UZ_FACE_NODES], weight[UZ_FACE_NODES], n[3] = {0}, point[2], own = 0;
            int64_t node[UZ_FACE_NODES];
            uz_side side;
            uz_body_side(&side, xyz, node, model, group->face[f]);
            uz_side_positive_weights(weight, &side);
            for (int a = 0; a < side.nodes && pass == 0; a++)
                area += weight[a];
            for (int a = 0; a < side.nodes && pass == 1; a++)
                own += weight[a] * product(k, u, z, dim, node + a, &ONE, 1);
            for (int g = 0; g < uz_side_gauss_count(&side) && pass == 1; g++) {
                const double of = uz_side_gauss(point, &side, g);
                uz_side_shape(N, &side, point);
                uz_side_area_vector(n, &side, point);
                own -= of * uz_norm(3, n) * product(k, u, z, dim, node, N, side.nodes);
            }
            if (pass == 1 && part)
                part[group->face[f].element] += own / area;
            sum += pass == 1 ? own / area : 0;
        }
    return sum;
}

double uz_spring_excess(double *part, const uz_body_model *model, const uz_scene *scene, const double *u,
                        const double *z)
{
    double sum = 0;
    for (int64_t k = 0; k < scene->n_supports && model->spring; k++) {
        const uz_support *support = &scene->supports[k];
        const bool spring = support->kind == UZ_SUPPORT_SPRING;
        const uz_group *group = spring ? uz_mesh_group(&model->mesh, support->on, "", NULL) : NULL;
        if (group && group->kind == UZ_GROUP_FACES)
            sum += excess_of_group(part, model, group, support->spring, u, z);
    }
    return sum;
}

/* May it be translated along an axis, as far as is known without its rows? */
static bool is_free_along(const uz_body_model *model, int c)
{
    const int dim = model->mesh.dim;
    bool is_free = model->m == 0 && (c > 0 || model->kind != UZ_AXISYMMETRIC);
    for (int64_t a = 0; a < model->mesh.n_nodes && is_free; a++)
        is_free = (model->dof[a * dim + c] >= 0 || model->dof[a * dim + c] == UZ_NO_DOF) && !uz_node_frame(model, a) &&
                  !uz_is_rigid(model, a);
    return is_free;
}

double uz_spring_error(double *eta2, double *stored, const uz_body_model *model, const uz_scene *scene, const double *u,
                       double strain)
{
    const int64_t n = model->mesh.n_nodes, dim = model->mesh.dim;
    double square = strain, positive = 0;
    *stored = 0;
    if (!model->spring)
        return 0;
    for (int64_t c = 0; c < dim; c++) {
        double k = 0, ku = 0, kuu = 0;
        for (int64_t a = 0; a < n; a++) {
            const double own = model->spring[a * dim + c], way = u[a * dim + c];
            k += own;
            ku += own * way;
            kuu += own * way * way;
        }
        *stored += kuu;
        square += k > 0 && is_free_along(model, (int)c) ? fmax(0, kuu - ku * ku / k) : kuu;
    }
    double *part = scene && eta2 ? uz_alloc_zero(model->mesh.n_elements, sizeof *part) : NULL;
    if (scene && eta2 && !part)
        return NAN;
    const double excess = scene ? uz_spring_excess(part, model, scene, u, u) : 0, rest = square - excess;
    const double error = rest > 0 ? fmin(excess * excess / rest, BOUND * fabs(excess)) : 0;
    for (int64_t e = 0; e < model->mesh.n_elements && part; e++)
        positive += fmax(0, part[e]);
    for (int64_t e = 0; e < model->mesh.n_elements && positive > 0; e++)
        eta2[e] += error * fmax(0, part[e]) / positive;
    free(part);
    return error;
}
