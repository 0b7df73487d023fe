/* refined_surfaces.c: nodes that bisection has put on the facets of a surface go to the smooth surface that the facets
 * stand for. A contact between two surfaces takes that for the shape of the body; nodes that stayed on the facets would
 * make those the shape, the more the finer the mesh. Before an obstacle facets are what they are, unless their nodes
 * are on a circle, a sphere, a cylinder, a cone or a torus: no fine mesh of a polygon has the contact of a roller. New
 * nodes within the body follow those that they lie amid. */
#include "assembly/mortar.h"
#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An element that keeps less than this part of its size is not left so. */
#define LEAST_SIZE 0.3

/* Nodes that are no farther from a circle than this part of its radius are on it; fewer are on many. */
#define ON_CIRCLE 1e-6
enum { FEWEST = 6 };

/* Offsets below this part of the mesh's size are rounding. */
#define ROUNDING 1e-13

/* A node on a side of a surface as it was given, where on it, and the node's next side; -1: no more. */
typedef struct {
    int64_t surface, side, next;
    double local[2];
} entry;

typedef struct {
    const uz_mesh *mesh;        /* refined */
    uz_body_model given;        /* its mesh as it was given */
    uz_mortar_surface *surface; /* 2 n_contacts: of each that is smooth those of `on` and `with` */
    int64_t *last;              /* n_nodes: the entry of each node that was added last, -1: none */
    entry *item;
    int64_t n, room;
    double *way;    /* n_nodes x dim: where nodes go */
    bool *on_facet; /* n_nodes: stays where the nodes go that it lies amid */
} refined;

static bool put(refined *x, int64_t node, int64_t surface, int64_t side, const double local[2])
{
    if (!uz_grow(&x->item, x->n, 1, &x->room, sizeof *x->item))
        return false;
    x->item[x->n] = (entry){surface, side, x->last[node], {local[0], local[1]}};
    x->last[node] = x->n++;
    return true;
}

static const entry *find_entry(const refined *x, int64_t node, const entry *of)
{
    for (int64_t k = x->last[node]; k >= 0; k = x->item[k].next)
        if (x->item[k].surface == of->surface && x->item[k].side == of->side)
            return &x->item[k];
    return NULL;
}

/* Which parts of a surface in the plane are circles. round: n_places, by uz_mortar_find_parts. */
static void find_circles(bool *round, const int64_t *part, const uz_mortar_surface *surface, const uz_mesh *mesh)
{
    for (int64_t first = 0; first < surface->n_places; first++) {
        const double *at[3] = {mesh->xyz + 2 * surface->node[first], NULL, NULL};
        double far[2] = {0, 0}, most = 0;
        int64_t count = 0;
        if (part[first] != first)
            continue;
        /* the one farthest from the first, then the one farthest from the line between these two */
        for (int turn = 0; turn < 2; turn++)
            for (int64_t p = 0; p < surface->n_places; p++) {
                const double *x = mesh->xyz + 2 * surface->node[p];
                const double off[2] = {x[0] - at[0][0], x[1] - at[0][1]};
                const double size = turn == 0 ? uz_dot2(off, off)
                                    : at[1] ? fabs(uz_cross2(off, (double[]){at[1][0] - at[0][0], at[1][1] - at[0][1]}))
                                            : 0;
                if (part[p] != first || !(size > far[turn]))
                    continue;
                far[turn] = size;
                at[turn + 1] = x;
            }
        if (!at[2])
            continue;
        const double b[2] = {at[1][0] - at[0][0], at[1][1] - at[0][1]},
                     c[2] = {at[2][0] - at[0][0], at[2][1] - at[0][1]};
        const double twice = 2 * uz_cross2(b, c), bb = uz_dot2(b, b), cc = uz_dot2(c, c);
        const double centre[2] = {(c[1] * bb - b[1] * cc) / twice, (b[0] * cc - c[0] * bb) / twice};
        const double radius = hypot(centre[0], centre[1]);
        for (int64_t p = 0; p < surface->n_places; p++) {
            const double *x = mesh->xyz + 2 * surface->node[p];
            if (part[p] != first)
                continue;
            most = fmax(most, fabs(hypot(x[0] - at[0][0] - centre[0], x[1] - at[0][1] - centre[1]) - radius));
            count++;
        }
        round[first] = count >= FEWEST && most <= ON_CIRCLE * radius && radius < sqrt(far[0]) / sqrt(ON_CIRCLE);
    }
}

/* Leaves those sides of a surface before an obstacle that are on no round shape as they are: without nodes. */
static bool keep_round(uz_mortar_surface *surface, const uz_mesh *mesh)
{
    int64_t *part = uz_alloc(surface->n_places, sizeof *part);
    bool *round = uz_alloc_zero(surface->n_places, sizeof *round);
    const bool room = part && round;
    if (room)
        uz_mortar_find_parts(part, surface);
    if (room && mesh->dim == 2)
        find_circles(round, part, surface, mesh);
    for (int64_t i = 0; i < surface->n && room; i++) {
        uz_mortar_side *side = &surface->side[i];
        const uz_smooth_kind kind = side->shape.kind;
        const bool kept =
            mesh->dim == 2 ? round[part[side->place[0]]] : kind != UZ_SMOOTH_NONE && kind != UZ_SMOOTH_PLANE;
        side->nodes = kept ? side->nodes : 0;
    }
    free(part);
    free(round);
    return room;
}

/* Which nodes are on which sides: those of the sides, then, in their order, those that lie amid such of one side only.
 * False: no memory. */
static bool list_nodes(refined *x, int64_t surfaces)
{
    const uz_mesh *mesh = x->mesh;
    bool room = true;
    for (int64_t k = 0; k < surfaces; k++)
        for (int64_t i = 0; i < x->surface[k].n; i++) {
            const uz_mortar_side *side = &x->surface[k].side[i];
            const uz_side shape = {.dim = mesh->dim, .nodes = side->nodes};
            for (int a = 0; a < side->nodes && room; a++)
                room = put(x, side->node[a], k, i, uz_side_local_nodes(&shape)[a]);
        }
    for (int64_t i = mesh->n_given; i < mesh->n_nodes && room; i++) {
        const int64_t *from;
        const double *share;
        const int count = uz_mesh_amid(&from, &share, mesh, i);
        for (int64_t k = x->last[from[0]]; k >= 0 && room; k = x->item[k].next) {
            const entry first = x->item[k];
            double local[2] = {0, 0};
            bool here = true;
            for (int p = 0; p < count && here; p++) {
                const entry *its = find_entry(x, from[p], &first);
                here = its != NULL;
                for (int c = 0; c < 2 && here; c++)
                    local[c] += share[p] * its->local[c];
            }
            room = !here || put(x, i, first.surface, first.side, local);
        }
    }
    return room;
}

/* The way of each new node, after those that it lies amid: to the mean of what its sides stand for, or theirs. */
static void find_ways(refined *x)
{
    const uz_mesh *mesh = x->mesh;
    const int dim = mesh->dim;
    for (int64_t i = mesh->n_given; i < mesh->n_nodes; i++) {
        double sum[3] = {0}, at[3] = {0};
        int count = 0;
        memcpy(at, mesh->xyz + i * dim, (size_t)dim * sizeof *at);
        const bool follows = x->on_facet[i] || uz_mesh_hangs(mesh, i); /* those that it lies amid */
        for (int64_t k = follows ? -1 : x->last[i]; k >= 0; k = x->item[k].next, count++) {
            const uz_mortar_surface *surface = &x->surface[x->item[k].surface];
            double offset[3];
            uz_mortar_geometry_of(dim)->offset(offset, surface, &surface->side[x->item[k].side], x->item[k].local, at);
            for (int c = 0; c < dim; c++)
                sum[c] += offset[c];
        }
        for (int c = 0; c < dim; c++) {
            const double way = count > 0 ? sum[c] / count : uz_mesh_value_amid(mesh, i, x->way + c, dim);
            x->way[i * dim + c] = fabs(way) > ROUNDING * mesh->extent ? way : 0;
        }
    }
}

/* What the corner a of an element spans with its neighbours: twice an area, six times a volume; moved or as it is. */
static double span_at(const refined *x, int64_t e, int a, bool moved)
{
    const uz_mesh *mesh = x->mesh;
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
    const int dim = mesh->dim, n = type->corners;
    const int64_t *node = mesh->node + mesh->first[e];
    double edge[3][3] = {{0}}, across[3];
    for (int k = 0; k < dim; k++) {
        const int other = n == dim + 1 ? (a + 1 + k) % n
                          : dim == 2   ? (a + (k == 0 ? 1 : n - 1)) % n
                                       : uz_element_type_of(type->linear)->next[a][k];
        for (int c = 0; c < dim; c++) {
            const int64_t from = node[a] * dim + c, to = node[other] * dim + c;
            edge[k][c] = mesh->xyz[to] - mesh->xyz[from] + (moved ? x->way[to] - x->way[from] : 0);
        }
    }
    if (dim == 2)
        return uz_cross2(edge[0], edge[1]);
    uz_cross3(across, edge[0], edge[1]);
    return uz_dot3(across, edge[2]);
}

/* Elements that would lose most of their size keep their nodes on the facets; false: there are none any more. */
static bool hold_elements(refined *x)
{
    const uz_mesh *mesh = x->mesh;
    bool more = false;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        bool moves = false, bad = false;
        for (int k = 0; k < type->corners * mesh->dim && !moves; k++)
            moves = x->way[node[k / mesh->dim] * mesh->dim + k % mesh->dim] != 0;
        for (int a = 0; a < type->corners && moves && !bad; a++)
            bad = !(span_at(x, e, a, true) / span_at(x, e, a, false) >= LEAST_SIZE);
        for (int k = 0; k < type->nodes && bad; k++) {
            more = more || (node[k] >= mesh->n_given && x->last[node[k]] >= 0 && !x->on_facet[node[k]]);
            x->on_facet[node[k]] = true;
        }
    }
    return more;
}

/* Nodes against faces take facets as they are. */
static bool is_smooth(const uz_contact *contact)
{
    return uz_discretization_of(contact) != &uz_node_to_face && !contact->faceted;
}

uz_status uz_smooth_refined(uz_mesh *mesh, const uz_scene *scene, uz_error *err)
{
    refined x = {.mesh = mesh, .given = {.kind = UZ_PLANE_STRAIN, .thickness = 1}};
    uz_scene whole = *scene;
    bool wanted = false;
    for (int64_t k = 0; k < scene->n_contacts; k++)
        wanted = wanted || is_smooth(&scene->contacts[k]);
    if (!wanted || scene->n_bisected == 0 || mesh->n_nodes == mesh->n_given)
        return UZ_OK;
    whole.n_bisected = 0;
    x.surface = uz_alloc_zero(2 * scene->n_contacts, sizeof *x.surface);
    x.last = uz_alloc(mesh->n_nodes, sizeof *x.last);
    x.way = uz_alloc_zero(mesh->n_nodes * mesh->dim, sizeof *x.way);
    x.on_facet = uz_alloc_zero(mesh->n_nodes, sizeof *x.on_facet);
    uz_status status = UZ_OK;
    if (!x.surface || !x.last || !x.way || !x.on_facet)
        status = uz_no_memory(err, "the surfaces of a refined mesh");
    if (status == UZ_OK)
        status = uz_mesh_from_scene(&x.given.mesh, &whole, err);
    for (int64_t k = 0; k < 2 * scene->n_contacts && status == UZ_OK; k++) {
        uz_contact_input in;
        const uz_contact *contact = &scene->contacts[k / 2];
        const bool obstacle = contact->kind != UZ_OBSTACLE_BODY;
        if (!is_smooth(contact) || (obstacle && k % 2))
            continue;
        status = uz_contact_input_of(&in, &x.given, scene, k / 2, err);
        if (status == UZ_OK && in.on->n_faces == 0)
            continue;
        if (status == UZ_OK)
            status = uz_mortar_surface_make(&x.surface[k], &in, k % 2 ? in.with : in.on, err);
        if (status == UZ_OK && obstacle && !keep_round(&x.surface[k], &x.given.mesh))
            status = uz_no_memory(err, "the surfaces of a refined mesh");
    }
    if (status == UZ_OK) {
        for (int64_t i = 0; i < mesh->n_nodes; i++)
            x.last[i] = -1;
        if (!list_nodes(&x, 2 * scene->n_contacts))
            status = uz_no_memory(err, "the surfaces of a refined mesh");
    }
    if (status == UZ_OK) {
        do
            find_ways(&x);
        while (hold_elements(&x));
        for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++)
            mesh->xyz[i] += x.way[i];
    }
    for (int64_t k = 0; x.surface && k < 2 * scene->n_contacts; k++)
        uz_mortar_surface_clear(&x.surface[k]);
    uz_mesh_clear(&x.given.mesh);
    uz_free_all(x.surface, x.last, x.item, x.way, x.on_facet);
    return status;
}
