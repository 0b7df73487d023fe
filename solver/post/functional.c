/* functional.c: quantities as functionals of the answer.
 *
 * With a(u, v) the internal work, f the loads and A the rows in contact, held as equations, u_h is the answer of
 * a(u, v) = f(v) for v that supports and contacts leave alone. Let e_u = u - u_h, and e_z the same of another problem
 * of this kind, z. Where both meet supports and contacts exactly, a(e_u, e_z) tells (Becker and Rannacher, Acta
 * Numerica 10 (2001) 1-102, and by Green's formula for forces):
 *
 *     displacement l(u)   K z = l,                    z = 0 at supports and contacts      l(u) - l(u_h) =  a(e_u, e_z)
 *     force R = a(u, z) - f(z)       K z = 0, z = 1 along the force where it acts, 0 at others   R - R_h = -a(e_u, e_z)
 *     strain energy W     z = u/2 - w, w with u's values at supports and contacts and the forces of the temperature
 *                                                                                            W - W_h =  a(e_u, e_z)
 *
 * The last line follows from u = w + v with a(w, v) = f_T(v) for all v that vanish at supports and contacts. That the
 * rows in contact may change with the mesh is of second order, as gaps and reactions vanish at the ends of a contact.
 */
#include "post/functional.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/obstacle.h"
#include "post/parts.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIM = 3 };

/* Cells in which the part of a side inside a window is looked for, along each direction. */
enum { EDGE_CELLS = 512, FACE_CELLS = 24 };

/* Of the force of a node that counts in part, s (1 - s) times: what a pressure that changes over its sides may make of
 * it. */
#define OF_BLUR 0.25

/* Areas are differentiated over this part of a side's size. */
#define STEP 1e-5

typedef struct {
    uz_functional *out;
    const uz_quantity *quantity;
    const uz_body_model *model;
    const uz_scene *scene;
    const uz_result *answer;
    const uz_functional_place *at;
    int dim;
    const char *where;
} making;

static bool is_of(const making *k, const uz_contact *contact)
{
    return !k->quantity->on[0] || strcmp(k->quantity->on, contact->on) == 0;
}

/* ---- contacts */

static bool is_inside(const making *k, const double *x)
{
    for (int c = 0; c < k->dim; c++)
        if (!(x[c] >= k->quantity->low[c] && x[c] <= k->quantity->high[c]))
            return false;
    return true;
}

/* *inside, *area: of a side, that in the window and the whole. Sides that the window's border goes through are cut into
 * cells. */
static void measure_side(double *inside, double *area, const making *k, const uz_side *side)
{
    const int dim = k->dim, n = dim == 2 ? EDGE_CELLS : FACE_CELLS;
    const bool triangle = dim == 3 && side->nodes % 4 != 0;
    double low[DIM] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[DIM] = {-DBL_MAX, -DBL_MAX, -DBL_MAX}, sum = 0;
    bool apart = false;
    for (int i = 0; i < side->nodes * dim; i++) {
        low[i % dim] = fmin(low[i % dim], side->xyz[i]);
        high[i % dim] = fmax(high[i % dim], side->xyz[i]);
    }
    for (int c = 0; c < dim; c++)
        apart = apart || high[c] < k->quantity->low[c] || low[c] > k->quantity->high[c];
    *area = fabs(uz_side_area(side));
    *inside = !apart && is_inside(k, low) && is_inside(k, high) ? *area : 0;
    if (apart || *inside > 0)
        return;
    for (int i = 0; i < (dim == 2 ? n : n * n); i++) {
        double N[UZ_FACE_NODES], vector[DIM] = {0}, x[DIM] = {0};
        const int row = i / n;
        double point[2] = {(i % n + 0.5) / n, (row + 0.5) / n}, weight = 1;
        if (triangle) {
            weight = 1 - point[0];
            point[1] *= weight;
        } else {
            point[0] = 2 * point[0] - 1;
            point[1] = 2 * point[1] - 1;
        }
        uz_side_shape(N, side, point);
        uz_side_area_vector(vector, side, point);
        for (int a = 0; a < side->nodes * dim; a++)
            x[a % dim] += N[a / dim] * side->xyz[a];
        weight *= sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
        sum += weight;
        *inside += is_inside(k, x) ? weight : 0;
    }
    *inside *= sum > 0 ? *area / sum : 0;
}

/* grown (n_nodes x dim) += part times the derivative of the side's area, where the body is. */
static void add_growth(double *grown, const uz_side *side, const int64_t *node, double part)
{
    double xyz[3 * UZ_FACE_NODES], size = 0;
    uz_side at = *side;
    const int n = side->nodes * side->dim;
    memcpy(xyz, side->xyz, (size_t)n * sizeof *xyz);
    at.xyz = xyz;
    for (int i = side->dim; i < n; i++)
        size = fmax(size, fabs(xyz[i] - xyz[i % side->dim]));
    for (int i = 0; i < n; i++) {
        const double x = xyz[i], step = STEP * size;
        double area[2];
        for (int way = 0; way < 2; way++) {
            xyz[i] = x + (way == 0 ? step : -step);
            area[way] = fabs(uz_side_area(&at));
        }
        xyz[i] = x;
        grown[node[i / side->dim] * side->dim + i % side->dim] += part * (area[0] - area[1]) / (2 * step);
    }
}

/* share (n_nodes): the part of the sides around each node that is in the window, before anything moves; returns the
 * area of `on` there, of large deformation that which the sides have now, whose derivative is then added to grown. */
static double find_window(double *share, double *whole, double *grown, const making *k, uz_error *err)
{
    const uz_mesh *mesh = &k->model->mesh;
    double window = 0;
    memset(share, 0, (size_t)mesh->n_nodes * sizeof *share);
    memset(whole, 0, (size_t)mesh->n_nodes * sizeof *whole);
    for (int64_t i = 0; i < 2 * k->scene->n_contacts; i++) {
        const uz_contact *contact = &k->scene->contacts[i / 2];
        const bool other = i % 2;
        if (!is_of(k, contact) || (other && contact->kind != UZ_OBSTACLE_BODY))
            continue;
        const uz_group *group = uz_mesh_group(mesh, other ? contact->with : contact->on, "/contacts", err);
        for (int64_t f = 0; group && f < group->n_faces; f++) {
            uz_side side;
            double xyz[3 * UZ_FACE_NODES], inside, area;
            int64_t node[UZ_FACE_NODES];
            uz_body_side(&side, xyz, node, k->model, group->face[f]);
            measure_side(&inside, &area, k, &side);
            for (int a = 0; a < side.nodes; a++) {
                share[node[a]] += inside;
                whole[node[a]] += area;
            }
            if (k->at && !other && inside > 0) {
                uz_side moved;
                uz_body_side(&moved, xyz, node, k->at->displaced, group->face[f]);
                add_growth(grown, &moved, node, inside / area);
                inside *= fabs(uz_side_area(&moved)) / area;
            }
            window += other ? 0 : inside;
        }
    }
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        share[a] = whole[a] > 0 ? share[a] / whole[a] : 0;
    return window;
}

/* Force of contacts, or its part in a window over that part's area. */
static uz_status take_contacts(const making *k, uz_error *err)
{
    const uz_body_model *model = k->model;
    const bool windowed = k->quantity->kind == UZ_QUANTITY_MEAN_PRESSURE;
    double *share = uz_alloc(model->mesh.n_nodes, sizeof *share), *whole = uz_alloc(model->mesh.n_nodes, sizeof *whole),
           *force = uz_alloc(model->m, sizeof *force), area = 1;
    uz_status status = UZ_OK;
    if (!share || !whole || !force)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld contact rows", (long long)model->m);
    if (status == UZ_OK && windowed && !((area = find_window(share, whole, k->out->load, k, err)) > 0))
        status = uz_fail(err, UZ_ERR_SCENE, k->where,
                         "no side of the contact is in this window: give one that its edges or faces are in");
    if (status == UZ_OK)
        uz_row_forces(force, model, k->answer->r);
    for (int64_t i = 0; i < model->m && status == UZ_OK; i++) {
        const uz_inner_place *inner = uz_row_inner(model, i);
        double part = is_of(k, &k->scene->contacts[model->info.contact_of[i]]);
        if (windowed && part > 0) {
            part = inner ? 0 : share[model->info.contact_node[i]];
            for (int a = 0; inner && a < inner->nodes; a++)
                part += inner->share[a] * share[inner->node[a]];
        }
        k->out->found -= part / area * force[i];
        k->out->blur += windowed ? OF_BLUR * part * (1 - part) / area * fabs(force[i]) : 0;
        k->out->gap[i] = -part / area;
    }
    if (status == UZ_OK)
        uz_blend_rows(k->out->gap, model);
    for (int64_t i = 0; i < model->mesh.n_nodes * k->dim && k->at; i++) /* the same force on a larger side */
        k->out->load[i] *= k->out->found / area;
    k->out->times = -1;
    uz_free_all(share, whole, force);
    return status;
}

/* The mean over the side of how deep the obstacle stands in it, by gaps as rows take them, linear in u. */
static double mean_depth(const uz_side *side, const int64_t *node, const uz_body_model *model,
                         const uz_obstacle *obstacle, const double *u)
{
    const int dim = model->mesh.dim;
    double sum = 0, area = 0;
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        double N[UZ_FACE_NODES], vector[DIM] = {0}, x[DIM] = {0}, way[DIM] = {0}, point[2], weight;
        uz_gap gap;
        weight = uz_side_gauss(point, side, g);
        uz_side_shape(N, side, point);
        uz_side_area_vector(vector, side, point);
        for (int i = 0; i < side->nodes * dim; i++) {
            const int64_t at = node[i / dim] * dim + i % dim;
            const double from = model->place ? model->place[at] : 0;
            x[i % dim] += N[i / dim] * (side->xyz[i] + from);
            way[i % dim] += N[i / dim] * (u[at] - from);
        }
        if (uz_obstacle_gap(&gap, obstacle, x, NULL) != UZ_OK)
            continue;
        weight *= sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
        for (int c = 0; c < dim; c++)
            gap.gap += gap.normal[c] * way[c];
        sum -= weight * gap.gap;
        area += weight;
    }
    return area > 0 ? sum / area : 0;
}

/* How far the smooth surface whose nodes a side of corners alone joins stands out of it, in the mean: of an edge that
 * turns by the difference of its ends' normals 2/3 of the middle's height, of a face what its edges' parabolas come to.
 * normal: n_nodes x dim, any length. Where the surface has an edge of its own, by more than twenty degrees, it is what
 * the side is. */
static double mean_bulge(const uz_side *side, const int64_t *node, const double *normal)
{
    const int dim = side->dim, edges = dim == 2 ? 1 : side->nodes;
    double unit[UZ_FACE_NODES][DIM] = {{0}}, own[DIM], point[2], sum = 0, size = 0;
    if (side->nodes > (dim == 2 ? 2 : 4))
        return 0;
    uz_side_gauss(point, side, 0);
    uz_side_area_vector(own, side, point);
    for (int c = 0; c < dim; c++)
        size = hypot(size, own[c]);
    for (int a = 0; a < side->nodes; a++) {
        double length = 0, along = 0;
        for (int c = 0; c < dim; c++) {
            length = hypot(length, normal[node[a] * dim + c]);
            along += normal[node[a] * dim + c] * own[c];
        }
        const bool smooth = along > cos(acos(-1) / 9) * length * size;
        for (int c = 0; c < dim && size > 0; c++)
            unit[a][c] = smooth ? normal[node[a] * dim + c] / length : own[c] / size;
    }
    for (int a = 0; a < edges; a++)
        for (int c = 0, b = (a + 1) % side->nodes; c < dim; c++)
            sum += (unit[b][c] - unit[a][c]) * (side->xyz[b * dim + c] - side->xyz[a * dim + c]) / 8;
    return sum * (dim == 2 ? 2 : 1) / 3;
}

/* The group's area vectors around its nodes. */
static void find_normals(double *normal, const uz_body_model *model, const uz_group *group)
{
    const int dim = model->mesh.dim;
    memset(normal, 0, (size_t)(model->mesh.n_nodes * dim) * sizeof *normal);
    for (int64_t f = 0; f < group->n_faces; f++) {
        uz_side side;
        double xyz[3 * UZ_FACE_NODES], vector[DIM], point[2];
        int64_t node[UZ_FACE_NODES];
        uz_body_side(&side, xyz, node, model, group->face[f]);
        uz_side_gauss(point, &side, 0);
        uz_side_area_vector(vector, &side, point);
        for (int a = 0; a < side.nodes * dim; a++)
            normal[node[a / dim] * dim + a % dim] += vector[a % dim];
    }
}

uz_status uz_contact_depth(double *depth, double *bulge, const uz_body_model *model, const uz_scene *scene,
                           const double *u, const double *r, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    double *sum = uz_alloc(3 * mesh->n_nodes, sizeof *sum),
           *normal = uz_alloc(mesh->n_nodes * mesh->dim, sizeof *normal);
    bool *presses = uz_alloc(mesh->n_nodes, sizeof *presses);
    uz_status status = UZ_OK;
    memset(depth, 0, (size_t)model->m * sizeof *depth);
    memset(bulge, 0, (size_t)model->m * sizeof *bulge);
    if (!sum || !normal || !presses)
        status = uz_no_memory(err, "the sides of contacts");
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        const uz_contact *contact = &scene->contacts[k];
        uz_obstacle *obstacle = NULL;
        const uz_group *group = uz_mesh_group(mesh, contact->on, "/contacts", err);
        if (contact->kind == UZ_OBSTACLE_BODY || contact->kind == UZ_OBSTACLE_PLANE || !group)
            continue;
        status = uz_obstacle_new(&obstacle, contact, k, model->kind, err);
        memset(sum, 0, (size_t)(3 * mesh->n_nodes) * sizeof *sum);
        memset(presses, 0, (size_t)mesh->n_nodes * sizeof *presses);
        find_normals(normal, model, group);
        for (int64_t i = 0; i < model->m; i++)
            presses[model->info.contact_node[i]] =
                presses[model->info.contact_node[i]] ||
                (model->info.contact_of[i] == k && r[i] < 0 && !uz_row_inner(model, i));
        for (int64_t a = mesh->n_given; a < mesh->n_nodes && mesh->hangs; a++) { /* nodes without rows */
            const int64_t *from;
            const double *share;
            const int amid = mesh->hangs[a] ? uz_mesh_amid(&from, &share, mesh, a) : 0;
            presses[a] = presses[a] || amid > 0;
            for (int j = 0; j < amid; j++)
                presses[a] = presses[a] && presses[from[j]];
        }
        for (int64_t f = 0; f < group->n_faces && status == UZ_OK; f++) {
            uz_side side;
            double xyz[3 * UZ_FACE_NODES];
            int64_t node[UZ_FACE_NODES];
            uz_body_side(&side, xyz, node, model, group->face[f]);
            const double size = fabs(uz_side_area(&side));
            bool all = true;
            for (int a = 0; a < side.nodes; a++)
                all = all && presses[node[a]];
            const double mean = all ? mean_depth(&side, node, model, obstacle, u) : 0,
                         out = all ? mean_bulge(&side, node, normal) : 0;
            for (int a = 0; a < side.nodes; a++) {
                sum[3 * node[a]] += size;
                sum[3 * node[a] + 1] += size * (mean + out);
                sum[3 * node[a] + 2] += size * out;
            }
        }
        for (int64_t i = 0; i < model->m; i++) {
            const double *at = sum + 3 * model->info.contact_node[i];
            if (model->info.contact_of[i] == k && !uz_row_inner(model, i) && at[0] > 0) {
                depth[i] = at[1] / at[0];
                bulge[i] = at[2] / at[0];
            }
        }
        uz_obstacle_free(obstacle);
    }
    if (status == UZ_OK) {
        uz_blend_rows(depth, model);
        uz_blend_rows(bulge, model);
    }
    uz_free_all(sum, normal, presses);
    return status;
}

/* ---- supports */

/* The same of a rigid group: its force goes with the translation. */
static void take_translation(const making *k, const uz_support *support)
{
    const uz_body_model *model = k->model;
    for (int64_t g = 0; g < model->n_rigid; g++)
        for (int c = 0; c < k->dim; c++) {
            const int64_t dof = model->dof[model->rigid[g].anchor[0] * k->dim + c];
            if (&k->scene->supports[model->rigid[g].support] == support && dof < 0 && dof != UZ_NO_DOF)
                k->out->held[-1 - dof] = k->quantity->direction[c];
        }
}

static bool is_asked(const making *k, int64_t support)
{
    return strcmp(k->scene->supports[support].on, k->quantity->on) == 0;
}

/* held becomes, on the dofs of a node that supports hold, what the force there has in the one that is asked for. */
static void take_share(const making *k, const uz_csc *supports, int64_t node)
{
    const int64_t first = supports->ptr[node], count = supports->ptr[node + 1] - first;
    double sum[DIM] = {0}, part[DIM];
    if (uz_is_rigid(k->model, node))
        return;
    for (int64_t i = first; i < first + count; i++) {
        if (!is_asked(k, supports->idx[i]))
            continue;
        uz_held_part(part, &k->scene->supports[supports->idx[i]], k->dim, k->quantity->direction);
        for (int c = 0; c < DIM; c++)
            sum[c] += part[c];
    }
    uz_held_share(sum, k->scene, k->dim, supports->idx + first, count, sum);
    for (int c = 0; c < k->dim; c++) {
        const int64_t dof = k->model->dof[node * k->dim + c];
        if (dof < 0 && dof != UZ_NO_DOF)
            k->out->held[-1 - dof] = uz_along_dof(k->model, node, c, sum);
    }
}

/* The way that rows go with supported nodes is taken back by the free ones: contacts stay where they are. */
static uz_status keep_contacts(const making *k, uz_error *err)
{
    const uz_body_model *model = k->model;
    const int dim = k->dim;
    double *zero = uz_alloc_zero(model->d, sizeof *zero), *way = uz_alloc(model->mesh.n_nodes * dim, sizeof *way);
    if (zero && way)
        uz_recover_nodal(way, model, zero, k->out->held);
    for (int64_t i = 0; i < model->m && zero && way; i++) {
        const uz_contact_sites *sites = model->sites ? &model->sites[model->info.contact_of[i]] : NULL;
        const uz_inner_place *inner = uz_row_inner(model, i);
        const double *n = model->info.contact_normal + i * dim;
        const int64_t place = model->row_place[i];
        for (int c = 0; c < dim; c++) {
            for (int a = 0; a < (inner ? inner->nodes : 1); a++)
                k->out->gap[i] += n[c] * (inner ? inner->share[a] * way[inner->node[a] * dim + c]
                                                : way[model->info.contact_node[i] * dim + c]);
            for (int64_t j = sites && sites->first ? sites->first[place] : 0;
                 sites && sites->first && j < sites->first[place + 1]; j++)
                k->out->gap[i] -= n[c] * sites->weight[j] * way[sites->node[j] * dim + c];
        }
    }
    const bool room = zero && way;
    uz_free_all(zero, way);
    if (!room)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacements of %lld nodes",
                       (long long)model->mesh.n_nodes);
    uz_blend_rows(k->out->gap, model);
    return UZ_OK;
}

static uz_status take_reaction(const making *k, uz_error *err)
{
    const uz_scene *scene = k->scene;
    const uz_evaluation *known = k->answer->evaluation;
    const int64_t n_nodes = k->model->mesh.n_nodes;
    bool springs = false, holds = false;
    uz_csc supports = {.ptr = NULL};
    double *share = uz_alloc(n_nodes, sizeof *share);
    uz_status status =
        share ? uz_list_held(&supports, &k->model->mesh, scene, err) : uz_no_memory(err, "the forces of supports");
    for (int64_t a = 0; a < n_nodes && status == UZ_OK; a++)
        take_share(k, &supports, a);
    for (int64_t s = 0; s < scene->n_supports && status == UZ_OK; s++) {
        const uz_support *support = &scene->supports[s];
        const bool spring = support->kind == UZ_SUPPORT_SPRING;
        const uz_group *group = uz_mesh_group(&k->model->mesh, support->on, "/supports", err);
        if (!group)
            status = UZ_ERR_SCENE;
        if (!group || !is_asked(k, s))
            continue;
        if (support->kind == UZ_SUPPORT_RIGID)
            take_translation(k, support);
        if (spring) { /* their forces are displacements */
            memset(share, 0, (size_t)n_nodes * sizeof *share);
            status = uz_spread_over_group(share, k->model, group, true, k->where, err);
            for (int64_t i = 0; i < n_nodes * k->dim && status == UZ_OK; i++) {
                const int c = (int)(i % k->dim);
                if (support->spring[c] > 0)
                    k->out->load[i] -= fmax(0, share[i / k->dim]) * support->spring[c] * k->quantity->direction[c];
            }
        }
        springs = springs || spring;
        holds = holds || !spring;
        for (int c = 0; c < k->dim; c++)
            k->out->found += known->supports[s].force[c] * k->quantity->direction[c];
    }
    if (status == UZ_OK && springs && holds)
        snprintf(k->out->why, sizeof k->out->why, "supports of both kinds, springs and others, hold this group");
    if (status == UZ_OK && holds)
        status = keep_contacts(k, err);
    k->out->times = springs ? 1 : -1;
    uz_csc_clear(&supports);
    free(share);
    return status;
}

/* ---- displacements and energy */

static uz_status take_displacement(const making *k, uz_error *err)
{
    const uz_mesh *mesh = &k->model->mesh;
    const uz_group *group = uz_mesh_group(mesh, k->quantity->on, k->where, err);
    double *share = group ? uz_alloc_zero(mesh->n_nodes, sizeof *share) : NULL;
    uz_status status = UZ_OK;
    if (!group)
        return UZ_ERR_SCENE;
    if (!share)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a mean over %lld nodes", (long long)mesh->n_nodes);
    status = uz_spread_over_group(share, k->model, group, false, k->where, err);
    for (int64_t i = 0; i < mesh->n_nodes * k->dim && status == UZ_OK; i++) {
        k->out->load[i] = share[i / k->dim] * k->quantity->direction[i % k->dim];
        k->out->found += k->out->load[i] * k->answer->u[i];
    }
    k->out->times = 1;
    free(share);
    return status;
}

/* Of large deformation: W(u) - W(u_h) is f(e) - a(e, e) / 2 but for terms of third order, f the loads where the body
 * is, of which z = w - u/2 tells with K w = f, w = 0 at supports and contacts. */
static uz_status take_energy_there(const making *k)
{
    memcpy(k->out->load, k->at->load, (size_t)(k->model->mesh.n_nodes * k->dim) * sizeof *k->out->load);
    k->out->found = k->answer->evaluation->strain_energy;
    k->out->own = -0.5;
    k->out->times = 1;
    return UZ_OK;
}

static uz_status take_energy(const making *k, const double *h, const double *prescribed, uz_error *err)
{
    const uz_scene *scene = k->scene;
    uz_scene warm = *scene; /* the forces of its temperatures alone */
    uz_status status = UZ_OK;
    warm.loads = uz_alloc(scene->n_loads, sizeof *warm.loads);
    warm.n_loads = 0;
    if (!warm.loads)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld loads", (long long)scene->n_loads);
    for (int64_t i = 0; i < scene->n_loads; i++)
        if (scene->loads[i].kind == UZ_LOAD_TEMPERATURE)
            warm.loads[warm.n_loads++] = scene->loads[i];
    status = uz_nodal_loads(k->out->load, k->model, &warm, err);
    free(warm.loads);
    if (k->model->m > 0)
        memcpy(k->out->gap, h, (size_t)k->model->m * sizeof *h);
    if (k->model->n_fixed > 0)
        memcpy(k->out->held, prescribed, (size_t)k->model->n_fixed * sizeof *prescribed);
    k->out->found = k->answer->evaluation->strain_energy + k->answer->evaluation->kept_energy;
    k->out->own = 0.5;
    k->out->times = -1;
    return status;
}

/* ---- all of them */

uz_status uz_functional_make(uz_functional *out, const uz_quantity *quantity, const char *where,
                             const uz_body_model *model, const uz_scene *scene, const uz_result *answer,
                             const double *h, const double *prescribed, const uz_functional_place *at, uz_error *err)
{
    const making k = {out, quantity, model, scene, answer, at, model->mesh.dim, where};
    memset(out, 0, sizeof *out);
    out->load = uz_alloc_zero(model->mesh.n_nodes * k.dim, sizeof *out->load);
    out->held = uz_alloc_zero(model->n_fixed, sizeof *out->held);
    out->gap = uz_alloc_zero(model->m, sizeof *out->gap);
    if (!out->load || !out->held || !out->gap)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a quantity of %lld nodes",
                       (long long)model->mesh.n_nodes);
    switch (quantity->kind) {
    case UZ_QUANTITY_REACTION:
        return take_reaction(&k, err);
    case UZ_QUANTITY_DISPLACEMENT:
        return take_displacement(&k, err);
    case UZ_QUANTITY_STRAIN_ENERGY:
        return at ? take_energy_there(&k) : take_energy(&k, h, prescribed, err);
    default:
        return take_contacts(&k, err);
    }
}

void uz_functional_clear(uz_functional *functional)
{
    uz_free_all(functional->load, functional->held, functional->gap);
    memset(functional, 0, sizeof *functional);
}
