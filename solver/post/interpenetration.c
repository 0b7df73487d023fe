/* interpenetration.c: where does the boundary of a deformed body lie inside of the body?
 *
 * Each element has det F > 0, so that a body is mapped one to one where its boundary does not pass through itself (J.
 * Ball, "Global invertibility of Sobolev functions and the interpenetration of matter", Proc. Roy. Soc. Edinburgh A 88
 * (1981) 315-328), and several are apart where besides none is inside of another one. If two sides pass through each
 * other an edge of one (in the plane the side itself) goes through the other one, and what is beyond lies in an
 * element: edges are looked at in their nodes, and midway between places where they go through sides and a few others,
 * so that neither coarse sides nor thin bodies hide anything. Of points within an element the depth is the distance
 * from the nearest side that has them behind it. */
#include "post/interpenetration.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "core/vector3.h"
#include "element/element.h"
#include "obstacle/box_tree.h"
#include "obstacle/face_point.h"
#include "scene/mesh_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What counts, in parts of the shorter one of two sides; and what contacts and ties leave between theirs, of the longer
 * one (run/finite_report.c, theory: what an answer that has converged may have). */
#define PASSED 1e-3
#define LEFT   0.03
/* Cosine between the normals of two sides of one part, from which on one is not what the other has passed through. */
#define ALIKE 0.5
/* In local coordinates: less deep in an element a point is on its side, and may be of it. */
#define ON_SIDE 1e-6
/* Points of edges in space are looked at so far from there to the middle of the side: of what is symmetric, edges meet
 * sides between two elements, on which a point is in neither. */
#define INWARD 1e-3

enum { QUARTERS = 4, MOST_CROSSINGS = 32 };

/* The body at rest, or displaced. */
typedef struct {
    const double *xyz; /* NULL: not made yet */
    uz_box_tree elements, sides;
} shape;

typedef struct {
    const uz_body_model *model;
    const uz_group *outer;
    int64_t *part;        /* of each node */
    unsigned char *joins; /* pairs x n_nodes: bits of the two groups of a contact or a tie that have the node */
    int64_t pairs;
    double *moved;
    shape now, rest;
    uz_interpenetration *out;
} work;

/* A point of the boundary. */
typedef struct {
    int64_t side, node; /* -1: between nodes */
    double local[2], x[3], normal[3], length;
} place;

static const char *const NO_MEMORY = "no memory to look for a body that passes through itself";

/* ---- sides and elements of a shape */

/* Nodes of an outer side; returns how many. */
static int gather(double *xyz, int64_t node[UZ_FACE_NODES], const work *w, const shape *s, int64_t side)
{
    const int dim = w->model->mesh.dim, count = uz_mesh_face(node, &w->model->mesh, w->outer->face[side]);
    for (int a = 0; a < count; a++)
        memcpy(xyz + dim * a, s->xyz + dim * node[a], (size_t)dim * sizeof *xyz);
    return count;
}

/* In the plane a quadratic edge is within the triangle of its ends and the place where its tangents there meet, as a
 * curve of Bezier: xyz gets these places for its middles. */
static void put_hull(double *xyz, int count, int corners, int dim)
{
    for (int a = corners; a < count && dim == 2; a++)
        for (int c = 0; c < dim; c++)
            xyz[dim * a + c] = 2 * xyz[dim * a + c] -
                               0.5 * (xyz[dim * (a - corners) + c] + xyz[dim * ((a - corners + 1) % corners) + c]);
}

/* A box of all of a side or an element, of which xyz is left the hull; in space there is room for faces that bulge. */
static void enclose(double *box, double *xyz, int count, int corners, int dim)
{
    put_hull(xyz, count, corners, dim);
    for (int c = 0; c < dim; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int a = 0; a < count; a++) {
            const double x = xyz[dim * a + c];
            low = x < low ? x : low;
            high = x > high ? x : high;
        }
        const double room = (count > corners && dim == 3 ? 0.25 : 1e-9) * (high - low);
        box[c] = low - room;
        box[dim + c] = high + room;
    }
}

/* Is all of the element to one side of the point, along the normal of one of its sides? False: that does not tell. */
static bool is_beside(const uz_element_type *type, const double *xyz, const double *x)
{
    const int dim = type->dim;
    double hull[3 * UZ_ELEMENT_NODES];
    if (dim == 3 && type->nodes > type->corners)
        return false;
    memcpy(hull, xyz, (size_t)(dim * type->nodes) * sizeof *hull);
    put_hull(hull, type->nodes, type->corners, dim);
    for (int k = 0; k < type->sides; k++) {
        const uz_element_side *side = &type->side[k];
        const double *from = hull + dim * side->node[0], *to = hull + dim * side->node[1],
                     *last = hull + dim * side->node[side->corners - 1];
        double normal[3] = {to[1] - from[1], from[0] - to[0], 0}, low = INFINITY, high = -INFINITY;
        if (dim == 3)
            uz_cross3(normal, (double[]){to[0] - from[0], to[1] - from[1], to[2] - from[2]},
                      (double[]){last[0] - from[0], last[1] - from[1], last[2] - from[2]});
        for (int a = 0; a < type->nodes; a++) {
            double along = 0;
            for (int c = 0; c < dim; c++)
                along += normal[c] * (hull[dim * a + c] - x[c]);
            low = along < low ? along : low;
            high = along > high ? along : high;
        }
        if (low > -1e-9 * (high - low) || high < 1e-9 * (high - low))
            return true;
    }
    return false;
}

static double length_of(const double *xyz, int count, int dim)
{
    double most = 0;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < a; b++)
            most = fmax(most, uz_distance2(xyz + dim * a, xyz + dim * b, dim));
    return sqrt(most);
}

static int gather_element(double *xyz, const work *w, const shape *s, int64_t e)
{
    const int dim = w->model->mesh.dim;
    int count;
    const int64_t *node = uz_mesh_element(&w->model->mesh, e, &count);
    for (int a = 0; a < count; a++)
        memcpy(xyz + dim * a, s->xyz + dim * node[a], (size_t)dim * sizeof *xyz);
    return count;
}

/* The trees of a shape whose nodes are there. */
static uz_status make_shape(shape *s, const work *w, uz_error *err)
{
    const uz_mesh *mesh = &w->model->mesh;
    const int dim = mesh->dim;
    double *box = uz_alloc(mesh->n_elements + w->outer->n_faces, 6 * sizeof *box), xyz[3 * UZ_ELEMENT_NODES];
    if (!box)
        return uz_fail(err, UZ_ERR_MEMORY, "", "%s", NO_MEMORY);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const int count = gather_element(xyz, w, s, e);
        enclose(box + 2 * dim * e, xyz, count, uz_element_type_of((uz_element_kind)mesh->kind[e])->corners, dim);
    }
    uz_status status = uz_box_tree_init(&s->elements, mesh->n_elements, dim, box, err);
    for (int64_t i = 0; i < w->outer->n_faces; i++) {
        int64_t node[UZ_FACE_NODES];
        const int count = gather(xyz, node, w, s, i);
        enclose(box + 2 * dim * i, xyz, count, uz_face_corners(dim, count), dim);
    }
    if (status == UZ_OK)
        status = uz_box_tree_init(&s->sides, w->outer->n_faces, dim, box, err);
    free(box);
    return status;
}

/* ---- a point */

typedef struct {
    const work *w;
    const shape *s;
    const place *p;
    int64_t element;
} question;

/* Is the point one of the element's boundary, as of the side's own? */
static bool is_of(const work *w, const place *p, int64_t e)
{
    const uz_mesh *mesh = &w->model->mesh;
    bool own = p->node < 0 && w->outer->face[p->side].element == e;
    for (int64_t k = mesh->first[e]; p->node >= 0 && k < mesh->first[e + 1]; k++)
        own = own || mesh->node[k] == p->node;
    return own;
}

/* Is the point within this element? */
static bool is_within(void *ctx, int64_t e)
{
    question *q = ctx;
    const uz_mesh *mesh = &q->w->model->mesh;
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
    double xyz[3 * UZ_ELEMENT_NODES], N[UZ_ELEMENT_NODES], point[3], off[3] = {0};
    if (is_of(q->w, q->p, e))
        return false;
    const int count = gather_element(xyz, q->w, q->s, e);
    if (is_beside(type, xyz, q->p->x) || !uz_element_find(point, type, xyz, mesh->extent, q->p->x) ||
        !(uz_element_depth(type, point) > ON_SIDE))
        return false;
    type->shape(type, N, NULL, point);
    for (int i = 0; i < mesh->dim * count; i++)
        off[i % mesh->dim] += N[i / mesh->dim] * (xyz[i] - q->p->x[i % mesh->dim]);
    if (!(sqrt(uz_dot3(off, off)) < ON_SIDE * length_of(xyz, count, mesh->dim))) /* it was not found */
        return false;
    q->element = e;
    return true;
}

/* From the point to a side that it may have passed. */
static double distance_to(const void *ctx, int64_t item, const double *x, double best)
{
    const question *q = ctx;
    const uz_mesh *mesh = &q->w->model->mesh;
    const int dim = mesh->dim;
    int64_t node[UZ_FACE_NODES], own[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    uz_foot foot;
    const int count = gather(xyz, node, q->w, q->s, item);
    const int64_t *part = q->w->part, there = part[mesh->node[mesh->first[q->element]]];
    const int mine = uz_mesh_face(own, mesh, q->w->outer->face[q->p->side]);
    if (part[node[0]] != there)
        return INFINITY;
    for (int a = 0; a < count; a++)
        for (int b = 0; b < mine; b++)
            if (node[a] == own[b])
                return INFINITY;
    for (int i = 0; i < dim * count; i++)
        xyz[i] -= x[i % dim];
    uz_face_closest(&foot, dim, count, xyz);
    const double ahead = uz_dot3(foot.point, foot.normal), alike = uz_dot3(foot.normal, q->p->normal);
    return foot.distance2 < best && ahead >= 0 && (part[own[0]] != there || alike < ALIKE) ? foot.distance2 : INFINITY;
}

/* How deep the point is in another part, or in another place of its own; *passed: the nearest side there, -1: none. */
static double depth_of(int64_t *passed, const work *w, const shape *s, const place *p)
{
    const int dim = w->model->mesh.dim;
    question q = {.w = w, .s = s, .p = p};
    double box[6];
    *passed = -1;
    memcpy(box, p->x, (size_t)dim * sizeof *box);
    memcpy(box + dim, p->x, (size_t)dim * sizeof *box);
    if (!uz_box_tree_meet(&s->elements, box, is_within, &q))
        return 0;
    *passed = uz_box_tree_nearest(&s->sides, p->x, INFINITY, distance_to, &q);
    if (*passed < 0)
        return 0;
    double xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    uz_foot foot;
    const int count = gather(xyz, node, w, s, *passed);
    for (int i = 0; i < dim * count; i++)
        xyz[i] -= p->x[i % dim];
    uz_face_closest(&foot, dim, count, xyz);
    return sqrt(foot.distance2);
}

/* Are sides with these nodes, or next to each, joined by a contact or a tie? */
static bool are_joined(const work *w, const int64_t *one, int n, const int64_t *other, int m)
{
    for (int64_t k = 0; k < w->pairs; k++) {
        const unsigned char *joins = w->joins + k * w->model->mesh.n_nodes;
        unsigned char here = 0, there = 0;
        for (int a = 0; a < n; a++)
            here |= joins[one[a]];
        for (int a = 0; a < m; a++)
            there |= joins[other[a]];
        if ((here & 1 && there & 2) || (here & 2 && there & 1))
            return true;
    }
    return false;
}

/* Place, normal and length of the point on a shape. */
static void put(place *p, const work *w, const shape *s)
{
    const int dim = w->model->mesh.dim;
    double N[UZ_FACE_NODES], xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    uz_side side;
    uz_body_side(&side, xyz, node, w->model, w->outer->face[p->side]);
    gather(xyz, node, w, s, p->side);
    side.xyz = xyz;
    uz_side_shape(N, &side, p->local);
    memset(p->x, 0, sizeof p->x);
    memset(p->normal, 0, sizeof p->normal);
    for (int a = 0; a < side.nodes; a++)
        for (int c = 0; c < dim; c++)
            p->x[c] += N[a] * xyz[dim * a + c];
    side.model = dim == 2 ? UZ_PLANE_STRAIN : side.model; /* rings have no area on their axis */
    uz_side_area_vector(p->normal, &side, p->local);
    uz_unit3(p->normal);
    p->length = length_of(xyz, side.nodes, dim);
}

/* node: -1, or the one that is there. */
static uz_status look(work *w, int64_t side, int64_t node, const double local[2], uz_error *err)
{
    place p = {.side = side, .node = node, .local = {local[0], local[1]}};
    int64_t passed, before;
    put(&p, w, &w->now);
    double depth = depth_of(&passed, w, &w->now, &p);
    if (!(depth > w->out->depth))
        return UZ_OK;
    const uz_mesh *mesh = &w->model->mesh;
    int64_t own[UZ_FACE_NODES], its[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    const int mine = uz_mesh_face(own, mesh, w->outer->face[side]), count = gather(xyz, its, w, &w->now, passed);
    const double length = length_of(xyz, count, mesh->dim);
    if (!(depth > PASSED * fmin(p.length, length)) ||
        (are_joined(w, own, mine, its, count) && !(depth > LEFT * fmax(p.length, length))))
        return UZ_OK;
    if (!w->rest.xyz) {
        w->rest.xyz = mesh->xyz;
        const uz_status status = make_shape(&w->rest, w, err);
        if (status != UZ_OK)
            return status;
    }
    place still = p;
    put(&still, w, &w->rest);
    depth -= depth_of(&before, w, &w->rest, &still);
    if (depth > PASSED * fmin(p.length, length) && depth > w->out->depth) {
        w->out->depth = depth;
        w->out->part = depth / p.length;
        memcpy(w->out->at, p.x, sizeof p.x);
    }
    return UZ_OK;
}

/* ---- where an edge goes through sides */

typedef struct {
    const work *w;
    const int64_t *end;      /* its corners */
    double from[3], to[3];   /* a straight piece of it, */
    double first, step, *at; /* whose place along the edge this is; at: where it goes through a side */
    int n;
} passage;

/* Does the piece go through the triangle (in the plane: the line) of these corners? *t: where along it. */
static bool goes_through(double *t, const passage *p, const double *const corner[3], int dim)
{
    double side[2][3] = {{0}}, way[3] = {0}, off[3] = {0}, normal[3], across[3];
    for (int c = 0; c < dim; c++) {
        side[0][c] = corner[1][c] - corner[0][c];
        side[1][c] = dim == 3 ? corner[2][c] - corner[0][c] : 0;
        way[c] = p->to[c] - p->from[c];
        off[c] = p->from[c] - corner[0][c];
    }
    if (dim == 2)
        side[1][2] = 1;
    uz_cross3(normal, side[0], side[1]);
    const double along = uz_dot3(way, normal);
    if (along == 0)
        return false;
    *t = -uz_dot3(off, normal) / along;
    for (int c = 0; c < 3; c++)
        off[c] += *t * way[c];
    const double square = uz_dot3(normal, normal);
    uz_cross3(across, off, side[1]);
    const double a = uz_dot3(across, normal) / square;
    uz_cross3(across, side[0], off);
    const double b = dim == 3 ? uz_dot3(across, normal) / square : 0;
    return *t > 0 && *t < 1 && a >= 0 && b >= 0 && a + b <= 1;
}

/* A side as lines or triangles between its nodes; returns how many. */
static int pieces_of(const int (**piece)[3], int dim, int count)
{
    static const int LINE[][3] = {{0, 1, 1}}, BENT[][3] = {{0, 2, 2}, {2, 1, 1}}, TRIANGLE[][3] = {{0, 1, 2}},
                     QUAD[][3] = {{0, 1, 2}, {0, 2, 3}}, TRIANGLE6[][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}},
                     QUAD8[][3] = {{0, 4, 7}, {4, 1, 5}, {5, 2, 6}, {6, 3, 7}, {4, 5, 6}, {4, 6, 7}};
    if (dim == 2) {
        *piece = count == 2 ? LINE : BENT;
        return count - 1;
    }
    *piece = count == 3 ? TRIANGLE : count == 4 ? QUAD : count == 6 ? TRIANGLE6 : QUAD8;
    return count == 3 ? 1 : count == 4 ? 2 : count == 6 ? 4 : 6;
}

static bool meet_side(void *ctx, int64_t item)
{
    passage *p = ctx;
    const int dim = p->w->model->mesh.dim;
    double xyz[3 * UZ_FACE_NODES], t;
    int64_t node[UZ_FACE_NODES];
    const int(*piece)[3];
    const int count = gather(xyz, node, p->w, &p->w->now, item), pieces = pieces_of(&piece, dim, count);
    for (int a = 0; a < count; a++)
        if (node[a] == p->end[0] || node[a] == p->end[1])
            return false;
    for (int k = 0; k < pieces && p->n < MOST_CROSSINGS; k++) {
        const double *const corner[3] = {xyz + dim * piece[k][0], xyz + dim * piece[k][1], xyz + dim * piece[k][2]};
        if (goes_through(&t, p, corner, dim))
            p->at[p->n++] = p->first + t * p->step;
    }
    return p->n == MOST_CROSSINGS;
}

/* Looks along the edge of an outer side between its corners a and b; middle: its place among the side's nodes, -1:
 * there is none. */
static uz_status look_along(work *w, int64_t side, int a, int b, int middle, const uz_side *of, const int64_t *node,
                            uz_error *err)
{
    const int dim = w->model->mesh.dim, pieces = middle < 0 ? 1 : 2, chain[3] = {a, middle < 0 ? b : middle, b};
    const double(*local)[3] = uz_side_local_nodes(of);
    const int64_t end[2] = {node[a], node[b]};
    double at[MOST_CROSSINGS + QUARTERS + 1];
    passage p = {.w = w, .end = end, .at = at, .step = 1.0 / pieces};
    uz_status status = UZ_OK;
    for (int k = 0; k < pieces; k++) {
        double box[6];
        for (int c = 0; c < dim; c++) {
            p.from[c] = w->now.xyz[dim * node[chain[k]] + c];
            p.to[c] = w->now.xyz[dim * node[chain[k + 1]] + c];
            box[c] = fmin(p.from[c], p.to[c]);
            box[dim + c] = fmax(p.from[c], p.to[c]);
        }
        p.first = k * p.step;
        uz_box_tree_meet(&w->now.sides, box, meet_side, &p);
    }
    for (int k = 0; k <= QUARTERS; k++)
        at[p.n++] = (double)k / QUARTERS;
    qsort(at, (size_t)p.n, sizeof *at, uz_ascending_real);
    for (int k = 1; k < p.n && status == UZ_OK; k++) {
        const double t = 0.5 * (at[k - 1] + at[k]);
        double point[2] = {(1 - t) * local[a][0] + t * local[b][0], (1 - t) * local[a][1] + t * local[b][1]};
        for (int c = 0; c < 2 && dim == 3; c++)
            point[c] += INWARD * ((uz_face_corners(dim, of->nodes) == 3 ? 1.0 / 3 : 0) - point[c]);
        if (at[k] > at[k - 1])
            status = look(w, side, -1, point, err);
    }
    return status;
}

/* seen: of the nodes, those that have been looked at. Edges of faces are those of two: they are the one's whose corners
 * ascend. */
static uz_status look_at_side(work *w, int64_t i, unsigned char *seen, uz_error *err)
{
    uz_side side;
    double xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    uz_body_side(&side, xyz, node, w->model, w->outer->face[i]);
    const int dim = side.dim, corners = uz_face_corners(dim, side.nodes);
    const double(*local)[3] = uz_side_local_nodes(&side);
    const double middle[2] = {dim == 2 ? 0 : corners == 3 ? 1.0 / 3 : 0, dim == 3 && corners == 3 ? 1.0 / 3 : 0};
    uz_status status = dim == 3 ? look(w, i, -1, middle, err) : UZ_OK;
    for (int a = 0; a < side.nodes && status == UZ_OK; a++)
        if (!seen[node[a]]++)
            status = look(w, i, node[a], local[a], err);
    for (int a = 0; a < (dim == 2 ? 1 : corners) && status == UZ_OK; a++) {
        const int b = (a + 1) % corners;
        if (dim == 2 || node[a] < node[b])
            status = look_along(w, i, a, b, side.nodes > corners ? corners + a : -1, &side, node, err);
    }
    return status;
}

/* ---- the whole */

/* Which nodes contacts between bodies and ties join. */
static void mark_joins(work *w, const uz_scene *scene)
{
    const uz_mesh *mesh = &w->model->mesh;
    int64_t at = 0;
    for (int64_t k = 0; k < scene->n_contacts + scene->n_ties; k++) {
        const uz_contact *contact = k < scene->n_contacts ? &scene->contacts[k] : NULL;
        const uz_tie *tie = contact ? NULL : &scene->ties[k - scene->n_contacts];
        if (contact && contact->kind != UZ_OBSTACLE_BODY)
            continue;
        const uz_group *group[2] = {uz_mesh_group(mesh, contact ? contact->on : tie->on, "", NULL),
                                    uz_mesh_group(mesh, contact ? contact->with : tie->to, "", NULL)};
        for (int side = 0; side < 2; side++)
            for (int64_t i = 0; group[side] && i < uz_group_node_count(mesh, group[side]); i++)
                w->joins[at * mesh->n_nodes + uz_group_node_at(group[side], i)] |= (unsigned char)(1u << side);
        at++;
    }
}

uz_status uz_find_interpenetration(uz_interpenetration *out, const uz_body_model *model, const uz_scene *scene,
                                   const uz_group *outer, const double *u, uz_error *err)
{
    const uz_mesh *mesh = &model->mesh;
    work w = {.model = model, .outer = outer, .pairs = scene->n_ties, .out = out};
    *out = (uz_interpenetration){.depth = 0};
    for (int64_t k = 0; k < scene->n_contacts; k++)
        w.pairs += scene->contacts[k].kind == UZ_OBSTACLE_BODY;
    unsigned char *seen = uz_alloc_zero(mesh->n_nodes, sizeof *seen);
    w.part = uz_alloc(mesh->n_nodes, sizeof *w.part);
    w.joins = uz_alloc_zero(w.pairs * mesh->n_nodes, sizeof *w.joins);
    w.moved = uz_alloc(mesh->n_nodes * mesh->dim, sizeof *w.moved);
    uz_status status = UZ_OK;
    if (!seen || !w.part || !w.joins || !w.moved || uz_mesh_number_parts(w.part, mesh) < 0)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "%s", NO_MEMORY);
    if (status == UZ_OK) {
        mark_joins(&w, scene);
        for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++)
            w.moved[i] = mesh->xyz[i] + u[i];
        w.now.xyz = w.moved;
        status = make_shape(&w.now, &w, err);
    }
    for (int64_t i = 0; i < w.outer->n_faces && status == UZ_OK; i++)
        status = look_at_side(&w, i, seen, err);
    uz_box_tree_clear(&w.now.elements);
    uz_box_tree_clear(&w.now.sides);
    uz_box_tree_clear(&w.rest.elements);
    uz_box_tree_clear(&w.rest.sides);
    uz_free_all(seen, w.part, w.joins, w.moved);
    return status;
}
