/* closer.c: the mesh of an answer, refined where it presses on obstacles, to prove its error on.
 *
 * Where an obstacle is curved or has corners, and where surfaces face each other whose nodes do not meet, most of what
 * a bound is too wide by is of the sides there: a polynomial on each presses, and a displacement on each stays out of
 * the obstacle. An answer is one on each refined mesh as well, so that both may be found on finer sides, at the price
 * of the elements there alone. */
#include "run/guarantee.h"

#include "core/alloc.h"
#include "core/error.h"
#include "run/transfer.h"
#include "scene/mesh.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sides that touch are halved so often; and where they are few, as at a corner that presses on no more than a point,
 * more often: what presses there is narrow, and each time costs some elements. */
enum { ROUNDS = 2, MOST_ROUNDS = 8, FEW = 6 };

/* Relative to the largest displacement: what touches. */
#define TOUCHES 1e-9

/* Relative to the body's extent: how far a new node may be from where those that it is amid say. */
#define AMID 1e-13
/* The same of nodes that are the answer's own, some of which were straightened. */
#define NEAR 1e-5

/* Of edges that face others: how much of each is covered -> covered, n_edges; 1 of all others. */
static void look_at_pairs(double *covered, const uz_bound_body *body)
{
    for (int64_t i = 0; i < body->n_edges; i++)
        covered[i] = body->edge[i].facing == UZ_BOUND_ALONE ? 1 : 0;
    for (int64_t k = 0; k < body->n_segments; k++) {
        const uz_bound_segment *s = &body->segment[k];
        covered[s->slave] += fabs(s->part[1] - s->part[0]);
        covered[s->master] += fabs(s->on[1] - s->on[0]);
    }
}

/* Appends a round: elements whose sides touch obstacles or face other sides, `few` only those that are covered in part.
 * marked, covered: room. Returns how many. */
static int64_t add_round(int64_t *list, int64_t *n, const uz_bound_body *body, const double *u, bool few, bool *marked,
                         double *covered)
{
    const uz_mesh *mesh = &body->model->mesh;
    const int64_t at = (*n)++;
    double farthest = 0;
    for (int64_t i = 0; i < 2 * mesh->n_nodes; i++)
        farthest = fmax(farthest, fabs(u[i]));
    look_at_pairs(covered, body);
    list[at] = 0;
    for (int64_t i = 0; i < body->n_edges; i++) {
        const uz_bound_edge *edge = &body->edge[i];
        const bool touches = edge->contact >= 0 && uz_depth_along(body, i, u) > -TOUCHES * farthest;
        const bool faces = few ? covered[i] > 0 && covered[i] < 1 - TOUCHES : edge->facing != UZ_BOUND_ALONE;
        if (marked[edge->element[0]] || !(touches || faces))
            continue;
        marked[edge->element[0]] = true;
        list[(*n)++] = edge->element[0];
        list[at]++;
    }
    return list[at];
}

/* Lists one more round for the mesh that there is, out->model; *count: of how many elements. */
static uz_status list_round(uz_closer *out, int64_t *n, int64_t *count, const uz_bound_body *body, const double *u,
                            bool few, uz_error *err)
{
    const int64_t n_elements = body->model->mesh.n_elements;
    const uz_scene *scene = &out->problem.scene;
    int64_t *list = uz_alloc(*n + 1 + n_elements, sizeof *list);
    bool *marked = uz_alloc_zero(n_elements, sizeof *marked);
    double *covered = uz_alloc(body->n_edges, sizeof *covered);
    const bool room = list && marked && covered;
    if (room) {
        if (*n > 0)
            memcpy(list, scene->bisected, (size_t)*n * sizeof *list);
        *count = add_round(list, n, body, u, few, marked, covered);
        free(out->bisected);
        out->bisected = list;
    } else {
        free(list);
    }
    uz_free_all(marked, covered);
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to refine %lld elements", (long long)n_elements);
}

/* Has it the nodes of the answer's mesh? They go where those are, which may have been straightened. */
static bool is_within(uz_mesh *mesh, const uz_mesh *own)
{
    bool within = true;
    for (int64_t i = 0; i < 2 * own->n_nodes; i++)
        within = within && fabs(mesh->xyz[i] - own->xyz[i]) <= NEAR * own->extent;
    memcpy(mesh->xyz, own->xyz, (size_t)(2 * own->n_nodes) * sizeof *mesh->xyz);
    return within;
}

/* The two meshes have all sides in common: new nodes are amid those of the answer's, also where refinement has moved
 * them onto what facets stand for. The middle of what parts a quadrilateral is that of its map, which need not be amid
 * its ends: what the answer is within elements that are cut is taken for nothing. */
static void straighten(uz_mesh *mesh, int64_t n_nodes)
{
    for (int64_t i = n_nodes; i < mesh->n_nodes; i++)
        for (int c = 0; c < 2; c++) {
            const double amid = uz_mesh_value_amid(mesh, i, mesh->xyz + c, 2);
            if (fabs(mesh->xyz[2 * i + c] - amid) > AMID * mesh->extent)
                mesh->xyz[2 * i + c] = amid;
        }
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        for (int k = corners; k < count; k++)
            for (int c = 0; c < 2 && node[k] >= n_nodes; c++)
                mesh->xyz[2 * node[k] + c] =
                    (mesh->xyz[2 * node[k - corners] + c] + mesh->xyz[2 * node[(k - corners + 1) % corners] + c]) / 2;
    }
}

/* The model of a longer list, and what the answer is on it. */
static uz_status take_mesh(uz_closer *out, int64_t n, const uz_result *result, const uz_mesh *own, bool *within,
                           uz_error *err)
{
    uz_body_model_clear(&out->model);
    free(out->u);
    out->u = NULL;
    out->problem.scene.bisected = out->bisected;
    out->problem.scene.n_bisected = n;
    const uz_status status = uz_body_model_build(&out->model, &out->problem.scene, UZ_BODY_OUTLINE, err);
    if (status != UZ_OK)
        return status;
    out->u = uz_carry_nodal(&out->model.mesh, result->u, own->n_nodes, 2);
    *within = *within && is_within(&out->model.mesh, own);
    straighten(&out->model.mesh, own->n_nodes);
    return out->u ? UZ_OK
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacement of %lld nodes",
                            (long long)out->model.mesh.n_nodes);
}

static bool are_triangles(const uz_mesh *mesh)
{
    bool all = true;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        all = all && uz_element_type_of((uz_element_kind)mesh->kind[e])->corners == 3;
    return all;
}

uz_status uz_closer_make(uz_closer *out, bool *any, const uz_guaranteed *g, const uz_result *result, uz_error *err)
{
    const uz_scene *scene = &g->problem->scene;
    const uz_mesh *own = &g->body.model->mesh;
    int64_t n = scene->n_bisected, count = 1;
    bool within = true;
    uz_status status = UZ_OK;
    *out = (uz_closer){.problem = *g->problem, .triangles = are_triangles(own)};
    *any = false;
    if (n > 0 && scene->bisected[0] == UZ_SUBDIVIDED)
        return UZ_OK;
    for (int round = 0; round < MOST_ROUNDS && count > 0 && status == UZ_OK; round++) {
        uz_bound_body body = {.model = NULL};
        const int64_t before = n;
        if (round > 0)
            status = uz_bound_body_make(&body, &out->model, &out->problem.scene, err);
        if (status == UZ_OK && !*body.why)
            status = list_round(out, &n, &count, round > 0 ? &body : &g->body, round > 0 ? out->u : result->u,
                                round >= ROUNDS, err);
        count = *body.why || (round >= ROUNDS && count > FEW) ? 0 : count;
        uz_bound_body_clear(&body);
        if (status == UZ_OK && count > 0)
            status = take_mesh(out, n, result, own, &within, err);
        n = count > 0 ? n : before;
        *any = *any || (status == UZ_OK && count > 0);
        out->problem.scene.n_bisected = n;
        out->problem.scene.bisected = out->bisected;
    }
    *any = *any && status == UZ_OK && within;
    return status;
}

void uz_closer_clear(uz_closer *closer)
{
    uz_free_all(closer->bisected, closer->u);
    uz_body_model_clear(&closer->model);
}
