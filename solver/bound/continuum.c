/* continuum.c: a scene without its discretization: edges, and what supports, loads and obstacles do along them. */
#include "bound/bound.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Relative to the body's extent: how far a middle may be off the middle of its side. */
#define ROUNDING 1e-13
/* Relative to its side: so far off its middle a node may be straightened. Files have six digits or more. */
#define NEARLY 1e-5
#define PI     3.14159265358979323846

const double uz_bound_product_inverse[2][UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS] = {{{4, -2}, {-2, 4}},
                                                                                {{9, -9, 3}, {-9, 21, -9}, {3, -9, 9}}};

typedef struct {
    uz_bound_body *body;
    const uz_mesh *mesh;
    const uz_scene *scene;
    unsigned char *marked; /* n_nodes: of the group at hand 1, on one of its edges 2 */
    int64_t *found;        /* n_edges: those of the group */
    int64_t n_found;
} survey;

static uz_status find_edges(survey *x, uz_error *err);
static bool has_straight_sides(const survey *x);
static void take_supports(survey *x);
static uz_status take_contacts(survey *x, uz_error *err);
static void take_springs(survey *x);
static void take_loads(survey *x);
static void raise_degree(uz_bound_body *body);
static void look_at_rings(uz_bound_body *body);

/* The first reason stays. */
static void refuse(uz_bound_body *body, const char *why, const char *name)
{
    if (!*body->why)
        snprintf(body->why, sizeof body->why, why, name);
}

uz_status uz_bound_body_make(uz_bound_body *out, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    survey x = {.body = out, .mesh = mesh, .scene = scene};
    *out = (uz_bound_body){.model = model, .degree = 1, .rings = model->kind == UZ_AXISYMMETRIC};
    out->depth = out->rings ? 2 * PI : model->thickness;
    if (model->kind == UZ_SOLID)
        refuse(out, "in three dimensions there are no equilibrium elements here", "");
    for (int64_t k = 0; k < model->n_materials; k++)
        if (model->materials[k].lame.general)
            refuse(out, "of orthotropic materials no energy is bounded here", "");
    if (model->tied.share.ptr)
        refuse(out, "parts are tied, which the continuum here is not", "");
    for (int64_t e = 0; e < mesh->n_elements && !*out->why; e++)
        if (uz_element_type_of((uz_element_kind)mesh->kind[e])->nodes >
            uz_element_type_of((uz_element_kind)mesh->kind[e])->corners)
            out->degree = 2;
    if (*out->why)
        return UZ_OK;
    x.marked = uz_alloc_zero(mesh->n_nodes, sizeof *x.marked);
    out->force = uz_alloc_zero(2 * mesh->n_elements, sizeof *out->force);
    uz_status status = x.marked && out->force ? find_edges(&x, err)
                                              : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the marks of %lld nodes",
                                                        (long long)mesh->n_nodes);
    if (status == UZ_OK && has_straight_sides(&x)) {
        take_supports(&x);
        take_loads(&x);
        raise_degree(out);
        status = take_contacts(&x, err);
        take_springs(&x);
        look_at_rings(out);
        if (status == UZ_OK)
            status = uz_free_strains(&out->free_strain, model, scene, err);
        if (status == UZ_OK)
            status = uz_bound_loose_motions(out, err);
    }
    uz_free_all(x.marked, x.found);
    if (status != UZ_OK)
        uz_bound_body_clear(out);
    return status;
}

void uz_bound_body_clear(uz_bound_body *body)
{
    uz_free_all(body->edge, body->edge_of, body->segment, body->before.at, body->force, body->free_strain, body->motion,
                body->map, body->map_at);
    *body = (uz_bound_body){.model = NULL};
}

/* ---- edges */

typedef struct {
    int64_t low, high, element;
    int side;
} half_edge;

static int compare_halves(const void *one, const void *other)
{
    const half_edge *a = one, *b = other;
    if (a->low != b->low)
        return a->low < b->low ? -1 : 1;
    if (a->high != b->high)
        return a->high < b->high ? -1 : 1;
    return a->element < b->element ? -1 : a->element > b->element;
}

static uz_status find_edges(survey *x, uz_error *err)
{
    const uz_mesh *mesh = x->mesh;
    uz_bound_body *body = x->body;
    int64_t count = 0, node[UZ_FACE_NODES];
    half_edge *half = uz_alloc(4 * mesh->n_elements, sizeof *half);
    body->edge = uz_alloc_zero(4 * mesh->n_elements, sizeof *body->edge);
    body->edge_of = uz_alloc_zero(4 * mesh->n_elements, sizeof *body->edge_of);
    x->found = uz_alloc(4 * mesh->n_elements, sizeof *x->found);
    if (!half || !body->edge || !body->edge_of || !x->found) {
        free(half);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the edges of %lld elements", (long long)mesh->n_elements);
    }
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int s = 0; s < uz_element_type_of((uz_element_kind)mesh->kind[e])->sides; s++) {
            uz_mesh_face(node, mesh, (uz_face){e, s});
            half[count++] =
                (half_edge){node[0] < node[1] ? node[0] : node[1], node[0] < node[1] ? node[1] : node[0], e, s};
        }
    qsort(half, (size_t)count, sizeof *half, compare_halves);
    for (int64_t i = 0; i < count; i++) {
        const bool second = i > 0 && half[i].low == half[i - 1].low && half[i].high == half[i - 1].high;
        uz_bound_edge *edge = &body->edge[body->n_edges - (second ? 1 : 0)];
        if (second && edge->element[1] >= 0)
            refuse(body, "more than two elements have a side in common", "");
        edge->element[second] = half[i].element;
        edge->side[second] = half[i].side;
        body->edge_of[4 * half[i].element + half[i].side] = edge - body->edge;
        if (second)
            continue;
        const int nodes = uz_mesh_face(node, mesh, (uz_face){half[i].element, half[i].side});
        *edge = (uz_bound_edge){.node = {node[0], node[1], nodes > 2 ? node[2] : -1},
                                .element = {half[i].element, -1},
                                .side = {half[i].side, -1},
                                .axis = {{1, 0}, {0, 1}},
                                .contact = -1,
                                .weight = {1, 1}};
        for (int a = 0; a < 2 && body->rings; a++) {
            double at[2];
            uz_bound_place(at, body, node[a]);
            edge->weight[a] = at[0];
        }
        body->n_edges++;
    }
    free(half);
    return UZ_OK;
}

double uz_bound_straighten(uz_mesh *mesh)
{
    double farthest = 0;
    for (int64_t e = 0; e < mesh->n_elements && mesh->dim == 2; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        for (int k = corners; k < count; k++) {
            const double *a = mesh->xyz + 2 * node[k - corners], *b = mesh->xyz + 2 * node[(k - corners + 1) % corners];
            const double middle[2] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
            double *at = mesh->xyz + 2 * node[k];
            const double off = hypot(at[0] - middle[0], at[1] - middle[1]), length = hypot(b[0] - a[0], b[1] - a[1]);
            if (!(off > ROUNDING * mesh->extent) || !(off <= NEARLY * length))
                continue;
            memcpy(at, middle, sizeof middle);
            farthest = fmax(farthest, off / length);
        }
    }
    return farthest;
}

static bool has_straight_sides(const survey *x)
{
    for (int64_t i = 0; i < x->body->n_edges && !*x->body->why; i++) {
        const int64_t *node = x->body->edge[i].node;
        for (int c = 0; c < 2 && node[2] >= 0; c++) {
            const double *xyz = x->mesh->xyz + c;
            if (fabs(xyz[2 * node[2]] - (xyz[2 * node[0]] + xyz[2 * node[1]]) / 2) > ROUNDING * x->mesh->extent)
                refuse(x->body, "quadratic elements have curved sides, or nodes off the middles of sides", "");
        }
    }
    return !*x->body->why;
}

/* The edges of a group -> found: of a group of edges those that it names. Its nodes determine more: all edges between
 * them, of which those within the body are taken only where the border alone does not reach all of them. A diagonal
 * that cuts off a corner between two sides is no part of these, and what is held by less is bounded all the same. Are
 * the edges all of it? A node alone is nothing to the continuum. */
static bool find_group(survey *x, const char *name)
{
    const uz_bound_body *body = x->body;
    const uz_group *group = uz_mesh_group(x->mesh, name, "", NULL);
    bool all = false;
    x->n_found = 0;
    if (!group)
        return false;
    const int64_t count = uz_group_node_count(x->mesh, group);
    for (int64_t i = 0; i < count; i++)
        x->marked[uz_group_node_at(group, i)] = 1;
    for (int64_t i = 0; i < group->n_faces && group->kind == UZ_GROUP_FACES; i++)
        x->found[x->n_found++] = body->edge_of[4 * group->face[i].element + group->face[i].side];
    for (int inner = 0; inner < 2 && !all; inner++) {
        for (int64_t i = 0; i < body->n_edges && group->kind != UZ_GROUP_FACES; i++) {
            const int64_t *node = body->edge[i].node;
            if ((body->edge[i].element[1] >= 0) == (inner == 1) && x->marked[node[0]] && x->marked[node[1]] &&
                (node[2] < 0 || x->marked[node[2]]))
                x->found[x->n_found++] = i;
        }
        for (int64_t i = 0; i < x->n_found; i++)
            for (int a = 0; a < 3; a++)
                if (body->edge[x->found[i]].node[a] >= 0)
                    x->marked[body->edge[x->found[i]].node[a]] = 2;
        all = true;
        for (int64_t i = 0; i < count; i++)
            all = all && x->marked[uz_group_node_at(group, i)] == 2;
    }
    for (int64_t i = 0; i < count; i++)
        x->marked[uz_group_node_at(group, i)] = 0;
    return all && x->n_found > 0;
}

/* ---- what is there */

/* u . n = value along the edge. Of several supports what the first two independent ones say is all there is. */
static void hold(uz_bound_edge *edge, const double n[2], double value)
{
    const double along[2] = {n[0] * edge->axis[0][0] + n[1] * edge->axis[0][1],
                             n[0] * edge->axis[1][0] + n[1] * edge->axis[1][1]};
    if (!edge->held[0]) {
        edge->axis[0][0] = n[0];
        edge->axis[0][1] = n[1];
        edge->axis[1][0] = -n[1];
        edge->axis[1][1] = n[0];
        edge->held[0] = true;
        edge->value[0] = value;
    } else if (!edge->held[1] && fabs(along[1]) > 1e-9) {
        edge->held[1] = true;
        edge->value[1] = (value - along[0] * edge->value[0]) / along[1];
    }
}

static void take_supports(survey *x)
{
    static const double AXIS[2][3] = {{1, 0, 0}, {0, 1, 0}};
    for (int64_t k = 0; k < x->scene->n_supports; k++) {
        const uz_support *support = &x->scene->supports[k];
        if (support->kind == UZ_SUPPORT_RIGID)
            refuse(x->body, "\"%s\" is a rigid group, whose forces are not bounded here", support->on);
        if (uz_support_turns(support))
            refuse(x->body, "the support on \"%s\" rotates, and edges here are moved without turning", support->on);
        if (!find_group(x, support->on))
            refuse(x->body, "the support on \"%s\" holds single nodes, which the continuum does not feel", support->on);
        for (int64_t i = 0; i < x->n_found; i++) {
            double n[3];
            uz_bound_edge *edge = &x->body->edge[x->found[i]];
            for (int c = 0; c < 2 && support->kind == UZ_SUPPORT_COMPONENTS; c++)
                if (!isnan(support->u[c]))
                    hold(edge, AXIS[c], support->u[c]);
            if (support->kind == UZ_SUPPORT_NORMAL && uz_unit_normal(n, support->normal, 2))
                hold(edge, n, support->value);
        }
    }
}

static uz_status take_contacts(survey *x, uz_error *err)
{
    const uz_bound_body *body = x->body;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < x->scene->n_contacts && status == UZ_OK; k++) {
        const uz_contact *contact = &x->scene->contacts[k];
        const uz_group *group = uz_mesh_group(x->mesh, contact->on, "", NULL);
        uz_obstacle *obstacle = NULL;
        if (contact->kind == UZ_OBSTACLE_BODY) {
            status = uz_bound_take_pair(x->body, x->scene, k, err);
            if (*x->body->why)
                break;
            continue;
        }
        if (!group || group->kind != UZ_GROUP_FACES || group->n_inner > 0 || !find_group(x, contact->on))
            refuse(x->body, "the contact's group \"%s\" is not made of edges of the border", contact->on);
        if (*x->body->why)
            break;
        status = uz_obstacle_new(&obstacle, contact, k, body->model->kind, err);
        for (int64_t i = 0; i < x->n_found && status == UZ_OK && !*body->why; i++) {
            if (body->edge[x->found[i]].contact >= 0 || body->edge[x->found[i]].facing != UZ_BOUND_ALONE)
                refuse(x->body, "an edge of \"%s\" has two obstacles before it", contact->on);
            body->edge[x->found[i]].contact = k;
            status = uz_bound_take_obstacle(x->body, x->found[i], obstacle, contact->on, err);
        }
        uz_obstacle_free(obstacle);
    }
    return status;
}

static double area_of(const uz_bound_body *body, int64_t edge)
{
    return uz_bound_measure(body, edge) * (body->edge[edge].weight[0] + body->edge[edge].weight[1]) / 2;
}

/* The stiffness of a group is its total. */
static void take_springs(survey *x)
{
    for (int64_t k = 0; k < x->scene->n_supports && !*x->body->why; k++) {
        const uz_support *support = &x->scene->supports[k];
        double area = 0;
        if (support->kind != UZ_SUPPORT_SPRING)
            continue;
        const uz_group *group = uz_mesh_group(x->mesh, support->on, "", NULL);
        if (!group || group->kind != UZ_GROUP_FACES || !find_group(x, support->on))
            refuse(x->body, "the springs on \"%s\" hold single nodes, which the continuum does not feel", support->on);
        for (int pass = 0; pass < 2; pass++)
            for (int64_t i = 0; i < x->n_found && !*x->body->why; i++) {
                uz_bound_edge *edge = &x->body->edge[x->found[i]];
                if (edge->held[0] || edge->contact >= 0 || edge->facing != UZ_BOUND_ALONE)
                    refuse(x->body, "supports or obstacles hold edges of \"%s\", which springs hold too", support->on);
                area += pass == 0 ? area_of(x->body, x->found[i]) : 0;
                for (int c = 0; c < 2 && pass == 1; c++)
                    edge->spring[c] += fmax(0, support->spring[c]) / area;
            }
    }
}

static double volume_of(const uz_body_model *model, int64_t e)
{
    uz_element element;
    double xyz[3 * UZ_ELEMENT_NODES];
    uz_body_element(&element, xyz, model, e);
    return uz_element_volume(&element);
}

static void take_loads(survey *x)
{
    uz_bound_body *body = x->body;
    for (int64_t k = 0; k < x->scene->n_loads; k++) {
        const uz_load *load = &x->scene->loads[k];
        const uz_group *group = load->kind == UZ_LOAD_NODE_FORCE ? NULL : uz_mesh_group(x->mesh, load->on, "", NULL);
        const bool in_elements = load->kind == UZ_LOAD_FORCE && group && group->kind == UZ_GROUP_ELEMENTS;
        const bool on_edges = load->kind == UZ_LOAD_TRACTION || load->kind == UZ_LOAD_PRESSURE ||
                              (load->kind == UZ_LOAD_FORCE && !in_elements);
        double area = 0, volume = 0;
        if (load->has_point)
            refuse(body, "the force on \"%s\" is at a point, and forces here are spread evenly", load->on);
        if (load->kind == UZ_LOAD_NODE_FORCE || (on_edges && (!group || group->kind != UZ_GROUP_FACES))) {
            refuse(body, "a force on single nodes does infinite work in the continuum", "");
            return;
        }
        if (on_edges)
            find_group(x, load->on);
        for (int pass = load->kind == UZ_LOAD_FORCE ? 0 : 1; pass < 2; pass++) /* the area first */
            for (int64_t i = 0; i < (on_edges ? x->n_found : 0); i++) {
                uz_bound_edge *edge = &body->edge[x->found[i]];
                const double *from = x->mesh->xyz + 2 * edge->node[0], *to = x->mesh->xyz + 2 * edge->node[1];
                const double length = hypot(to[0] - from[0], to[1] - from[1]);
                const double n[2] = {(to[1] - from[1]) / length, (from[0] - to[0]) / length};
                if (pass == 0)
                    area += area_of(body, x->found[i]);
                for (int c = 0; c < 2 && pass == 1; c++)
                    edge->traction[c] += load->kind == UZ_LOAD_TRACTION   ? load->v[c]
                                         : load->kind == UZ_LOAD_PRESSURE ? -load->value * n[c]
                                                                          : load->v[c] / area;
            }
        for (int64_t i = 0; in_elements && i < uz_group_element_count(x->mesh, group); i++)
            volume += volume_of(body->model, uz_group_element_at(group, i));
        for (int64_t i = 0;
             !on_edges && load->kind != UZ_LOAD_TEMPERATURE && i < uz_group_element_count(x->mesh, group); i++) {
            const int64_t e = uz_group_element_at(group, i);
            const double times = in_elements                     ? 1 / volume
                                 : load->kind == UZ_LOAD_GRAVITY ? uz_element_material(body->model, e)->density
                                                                 : 1;
            for (int c = 0; c < 2; c++)
                body->force[2 * e + c] += times * load->v[c];
        }
    }
}

/* The radius times an axial force is balanced by stresses of degree 2. */
static void raise_degree(uz_bound_body *body)
{
    for (int64_t e = 0; e < body->model->mesh.n_elements && body->rings; e++)
        if (fabs(body->force[2 * e + 1]) > 0)
            body->degree = 2;
}

/* The axis is no side, but for the radial support that it is anyway. */
static void look_at_rings(uz_bound_body *body)
{
    for (int64_t i = 0; i < body->n_edges && body->rings; i++) {
        uz_bound_edge *edge = &body->edge[i];
        const bool held = edge->held[1] || (edge->held[0] && (fabs(edge->axis[0][1]) > 0 || fabs(edge->value[0]) > 0));
        if (edge->facing != UZ_BOUND_ALONE)
            refuse(body, "parts of a body of revolution press on each other", "");
        if (edge->turns && !(fmin(edge->weight[0], edge->weight[1]) > 0)) /* check_turning.c */
            edge->presses = false;
        if (!(edge->weight[0] + edge->weight[1] > 0) &&
            (held || edge->contact >= 0 || edge->spring[0] > 0 || edge->spring[1] > 0))
            refuse(body, "something holds the axis of revolution, which the continuum does not feel", "");
    }
}

double uz_bound_weight(const uz_bound_body *body, int64_t edge, int a)
{
    const double *weight = body->edge[edge].weight;
    return weight[0] + (weight[1] - weight[0]) * a / body->degree;
}

double uz_bound_measure(const uz_bound_body *body, int64_t edge)
{
    const int64_t *node = body->edge[edge].node;
    const double *from = body->model->mesh.xyz + 2 * node[0], *to = body->model->mesh.xyz + 2 * node[1];
    return hypot(to[0] - from[0], to[1] - from[1]) * body->depth;
}

void uz_bound_place(double at[2], const uz_bound_body *body, int64_t node)
{
    memcpy(at, body->model->mesh.xyz + 2 * node, 2 * sizeof *at);
    if (body->rings && uz_is_on_axis(body->model, node))
        at[0] = 0;
}

void uz_bound_bernstein(double phi[UZ_BOUND_MOMENTS], int moments, double q)
{
    const double p = 1 - q;
    phi[0] = moments == 2 ? p : p * p;
    phi[1] = moments == 2 ? q : 2 * p * q;
    phi[2] = moments == 2 ? 0 : q * q;
}

void uz_bound_centre(double centre[2], const uz_bound_body *body, int64_t element)
{
    int count;
    const uz_mesh *mesh = &body->model->mesh;
    const int64_t *node = uz_mesh_element(mesh, element, &count);
    const int corners = uz_element_type_of((uz_element_kind)mesh->kind[element])->corners;
    const double *first = mesh->xyz + 2 * node[0];
    const double *p[4] = {first, mesh->xyz + 2 * node[1], mesh->xyz + 2 * node[2], mesh->xyz + 2 * node[corners - 1]};
    if (corners == 3) {
        for (int c = 0; c < 2; c++)
            centre[c] = first[c] + ((p[1][c] - first[c]) + (p[2][c] - first[c])) / 3;
        return;
    }
    const double a[2] = {p[2][0] - first[0], p[2][1] - first[1]}, b[2] = {p[3][0] - p[1][0], p[3][1] - p[1][1]};
    const double from[2] = {p[1][0] - first[0], p[1][1] - first[1]};
    const double part = (from[0] * b[1] - from[1] * b[0]) / (a[0] * b[1] - a[1] * b[0]);
    for (int c = 0; c < 2; c++)
        centre[c] = first[c] + part * a[c];
}
