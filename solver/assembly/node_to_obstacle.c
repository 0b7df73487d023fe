/* node_to_obstacle.c: contact of a surface with a rigid obstacle: a row for each node, along the obstacle's normal, and
 * at most one more inside a side, where rows at its nodes would let the obstacle in.
 *
 * Nodes alone see nothing that is smaller than a side: a circle between two of them meets no resistance. Gaps in the
 * mean, as between two bodies, would see it, but on curved obstacles they are off by as much as the facets are. So rows
 * stay at nodes, and a side gets one at the place where the obstacle would stand deepest in it once its own nodes have
 * given way: with d the signed distance from the obstacle, x_a the nodes and N_a their shape functions, where
 *
 *     w(x) = d(x) - s + sum_a N_a(x) max(0, s - d(x_a))
 *
 * is least, if that is below -SLACK times the side's size. Nodes in the obstacle are pushed out to its surface, the
 * others stay, as do those whose way out is along the side; s is 0 where the side is in it by SINK times its size
 * already, else what it has yet to approach for that, as loads that bring it there are not known here. A side that
 * follows the obstacle, a plane or one whose radius is more than 12 sides, gets none: w is -L / 8R of its length L
 * there. The place is one of the material and stays.
 *
 * Amid a ridge the nearest way out is through a flank, whose normal says nothing of the crest that stands in the side:
 * there d is that of the side set back along its normal until it is clear of the obstacle, less the way. Rows of nodes
 * amid ridges are found alike (uz_obstacle_row_gap).
 *
 * Straight sides of a hole stand for a curve that lies behind them, and a pin that fits would cut into each. There d is
 * that of the curve: x is set back by sum_a N_a(x) (x - x_a) . n_a / 2 with the means n_a of the normals around nodes,
 * which is the parabola of their tangents. */
#include "assembly/discretization.h"
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "obstacle/obstacle.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* In sizes of a side: what rows at nodes may leave, and how far a side is taken to enter the obstacle at least. */
#define SLACK 0.01
#define SINK  0.02
/* The side is set back until it is so far from the obstacle. */
#define CLEAR 0.1
/* To rows the obstacle's edges are as if rounded with this part of the distance between nodes: of a node that settles
 * on an edge the direction from it would be rounding. */
#define EDGE 0.5

/* A row inside has a normal that is against the side's, and nodes that can give way along it, by more than this. */
#define LEAST_SHARE 0.1

/* Cosine of the angle between a side and the mean around a node from which on the node is a corner. */
#define LEAST_COSINE 0.94

/* A normal that is another so far on, in the unit square of a side, jumps. */
#define JUMP 1e-5

/* Of a row inside a side: its part of the side's area. The nodes have the rest. */
#define INNER_AREA 0.5

/* Sides are halved so many times in search of the least w: in the plane, in space. */
enum { HALVINGS = 5, HALVINGS_IN_SPACE = 3 };

/* ---- the deepest place of a side */

typedef struct {
    const uz_obstacle *obstacle;
    uz_side side;
    int64_t node[UZ_FACE_NODES];
    double xyz[3 * UZ_FACE_NODES];
    double length, size;          /* the longest distance between its nodes; the same, halved on quadratic sides */
    double normal[3];             /* of the side, unit, out of the body */
    double around[4][3];          /* of straight sides: mean normals around the corners */
    bool curved;                  /* do they differ from the side's? */
    double back;                  /* by which the side is set back along its normal */
    double pushed[UZ_FACE_NODES]; /* of the nodes: out of the obstacle */
    double steep, enough;         /* bound on the slope of w; what is above `enough` is not looked for */
    double least, at[2];          /* found: over the unit square, see local_point() */
} deepest;

/* The unit square over the side, triangles with one edge of it in a corner. */
static void local_point(double local[2], const uz_side *side, const double at[2])
{
    const bool triangle = side->dim == 3 && side->nodes % 3 == 0;
    local[0] = triangle ? at[0] * (1 - at[1]) : 2 * at[0] - 1;
    local[1] = triangle ? at[1] : 2 * at[1] - 1;
}

/* The place with these shape functions, of a hole on the curve behind its straight sides, set back. */
static void place_of(double x[3], const deepest *of, const double *N)
{
    const int dim = of->side.dim;
    double back = 0;
    memset(x, 0, 3 * sizeof *x);
    for (int a = 0; a < of->side.nodes; a++)
        for (int c = 0; c < dim; c++)
            x[c] += N[a] * of->xyz[dim * a + c];
    for (int a = 0; a < of->side.nodes && of->curved; a++)
        for (int c = 0; c < dim; c++)
            back += 0.5 * N[a] * (x[c] - of->xyz[dim * a + c]) * of->around[a][c];
    for (int c = 0; c < dim; c++)
        x[c] -= (fmax(0, back) + of->back) * of->normal[c];
}

/* w there, but for s; NAN where the obstacle has no normal, as the centre of a circle. */
static double depth_at(const deepest *of, const double at[2])
{
    double local[2], N[UZ_FACE_NODES], x[3], pushed = 0;
    uz_gap gap;
    local_point(local, &of->side, at);
    uz_side_shape(N, &of->side, local);
    place_of(x, of, N);
    for (int a = 0; a < of->side.nodes; a++)
        pushed += N[a] * of->pushed[a];
    return uz_obstacle_gap(&gap, of->obstacle, x, NULL) == UZ_OK ? gap.gap - of->back + pushed : (double)NAN;
}

static bool improve(deepest *of, double a, double b, double *value)
{
    const double at[2] = {a, b};
    *value = depth_at(of, at);
    if (!(*value < of->least - 1e-12 * of->length))
        return false;
    of->least = *value;
    memcpy(of->at, at, sizeof at);
    return true;
}

/* Branch and bound: a signed distance grows by no more than one is away. */
static void search(deepest *of, double a, double b, double half, int halvings)
{
    double value;
    const int dim = of->side.dim;
    improve(of, a, b, &value);
    if (halvings == 0 || value - of->steep * 2 * half * of->length > fmin(of->least, of->enough))
        return;
    for (int k = 0; k < 2 * (dim - 1); k++)
        search(of, a + (k % 2 ? 0.5 : -0.5) * half, dim == 3 ? b + (k / 2 ? 0.5 : -0.5) * half : b, 0.5 * half,
               halvings - 1);
}

/* Steps from the best place found, ever shorter. */
static void refine(deepest *of, double step)
{
    double value;
    for (; step > 1e-7; step *= 0.5)
        for (bool moved = true; moved;) {
            moved = false;
            for (int k = 0; k < 2 * (of->side.dim - 1); k++) {
                const double a = of->at[0] + (k / 2 ? 0 : k % 2 ? step : -step);
                const double b = of->at[1] + (k / 2 ? k % 2 ? step : -step : 0);
                moved = (a >= 0 && a <= 1 && b >= 0 && b <= 1 && improve(of, a, b, &value)) || moved;
            }
        }
}

/* Does the way out of the obstacle lead a node into the body? On the flank of a block it leads along the side: its row
 * leaves the block where it stands. */
static bool leads_in(const deepest *of, int a)
{
    double N[UZ_FACE_NODES], x[3], along = 0;
    uz_gap gap;
    uz_side_shape(N, &of->side, uz_side_local_nodes(&of->side)[a]);
    place_of(x, of, N);
    if (uz_obstacle_row_gap(&gap, of->obstacle, x, of->normal, EDGE * of->size, NULL) != UZ_OK)
        return true;
    for (int c = 0; c < of->side.dim; c++)
        along -= gap.normal[c] * of->normal[c];
    return along > LEAST_SHARE;
}

/* The place of the least w, where the nodes' gaps are `gap`. False: nothing is below the slack. */
static bool find_below(deepest *of, const double *gap)
{
    const int halvings = of->side.dim == 2 ? HALVINGS : HALVINGS_IN_SPACE;
    const double middle = of->side.dim == 2 ? 0 : 0.5;
    double lowest = INFINITY, highest = -INFINITY;
    for (int a = 0; a < of->side.nodes; a++) {
        lowest = fmin(lowest, gap[a]);
        highest = fmax(highest, gap[a]);
    }
    memset(of->pushed, 0, sizeof of->pushed);
    of->least = lowest;
    of->at[0] = of->at[1] = NAN;
    of->steep = 1;
    of->enough = INFINITY;
    search(of, 0.5, middle, 0.5, halvings);
    const double s = fmax(0, of->least + SINK * of->size);
    bool again = isnan(of->at[0]);
    for (int a = 0; a < of->side.nodes; a++) {
        again = again || s > gap[a];
        of->pushed[a] = s > gap[a] && leads_in(of, a) ? s - gap[a] : 0;
    }
    if (again) {
        of->least = of->enough = s - SLACK * of->size;
        of->at[0] = of->at[1] = NAN;
        of->steep = 1 + fmin(1, (highest - lowest) / of->size);
        search(of, 0.5, middle, 0.5, halvings);
    }
    if (isnan(of->at[0]) || of->least >= s - SLACK * of->size)
        return false;
    refine(of, ldexp(0.5, -halvings));
    return true;
}

/* Does the obstacle's normal jump at the place, or not lead into the body? */
static bool is_amid(const deepest *of)
{
    double normal[2][3] = {{0}}, along = 0;
    for (int k = 0; k < 2 * (of->side.dim - 1); k++) {
        double local[2], N[UZ_FACE_NODES], x[3], at[2] = {of->at[0], of->at[1]}, chord = 0;
        uz_gap gap;
        at[k / 2] = fmin(1, fmax(0, at[k / 2] + (k % 2 ? JUMP : -JUMP)));
        local_point(local, &of->side, at);
        uz_side_shape(N, &of->side, local);
        place_of(x, of, N);
        if (uz_obstacle_gap(&gap, of->obstacle, x, NULL) != UZ_OK)
            return true;
        memcpy(normal[k % 2], gap.normal, sizeof normal[0]);
        for (int c = 0; c < 3; c++) {
            chord = hypot(chord, k % 2 ? normal[1][c] - normal[0][c] : 0);
            along -= gap.normal[c] * of->normal[c];
        }
        if (chord > LEAST_SHARE)
            return true;
    }
    return along <= 2 * (of->side.dim - 1) * LEAST_SHARE;
}

/* Sets the side back until it is clear of the obstacle; gap: of its nodes there. False: it cannot be. */
static bool set_back(deepest *of, double *gap)
{
    enum { STEPS = 60 };
    const int halvings = of->side.dim == 2 ? HALVINGS : HALVINGS_IN_SPACE;
    memset(of->pushed, 0, sizeof of->pushed);
    of->steep = 1;
    of->enough = INFINITY;
    for (int k = 0; k < STEPS && of->back <= 2 * of->length; k++) {
        of->least = INFINITY;
        search(of, 0.5, of->side.dim == 2 ? 0 : 0.5, 0.5, halvings);
        for (int a = 0; a < of->side.nodes; a++) {
            double N[UZ_FACE_NODES], x[3];
            uz_gap there;
            uz_side_shape(N, &of->side, uz_side_local_nodes(&of->side)[a]);
            place_of(x, of, N);
            if (uz_obstacle_gap(&there, of->obstacle, x, NULL) != UZ_OK)
                return false;
            gap[a] = there.gap - of->back;
            of->least = fmin(of->least, gap[a]);
        }
        const double lacking = CLEAR * of->size - (of->least + of->back);
        if (lacking <= 0.01 * CLEAR * of->size)
            return true;
        of->back += lacking;
    }
    return false;
}

/* Is there a place where the rows of the nodes, whose gaps are `gap`, leave more than the slack? */
static bool find_deepest(deepest *of, double *gap)
{
    double lowest = INFINITY;
    for (int a = 0; a < of->side.nodes; a++)
        lowest = fmin(lowest, gap[a]);
    /* A distance d bends the gap along a side of length l by l^2 / 8d in the plane. */
    if (lowest > of->length && of->length * of->length < 4 * (lowest - of->length) * SLACK * of->size)
        return false;
    if (!find_below(of, gap))
        return false;
    const deepest plain = *of;
    if (is_amid(of) && !(set_back(of, gap) && find_below(of, gap)))
        *of = plain;
    return true;
}

/* ---- sites */

/* The unit normal of a side in its middle. */
static void normal_of(double normal[3], const uz_side *side)
{
    const bool triangle = side->dim == 3 && side->nodes % 3 == 0;
    const double middle[2] = {triangle ? 1.0 / 3 : 0, triangle ? 1.0 / 3 : 0};
    double size = 0;
    normal[2] = 0;
    uz_side_area_vector(normal, side, middle);
    for (int c = 0; c < side->dim; c++)
        size = hypot(size, normal[c]);
    for (int c = 0; c < side->dim && size > 0; c++)
        normal[c] /= size;
}

/* normals (n_nodes x dim): sums of the sides' normals. At an end of the group the others are mirrored. */
static void set_curve(deepest *of, const double *normals, int corners)
{
    const int dim = of->side.dim;
    bool own[4];
    normal_of(of->normal, &of->side);
    of->curved = false;
    for (int a = 0; a < corners && of->side.nodes == corners; a++) {
        const double *sum = normals + dim * of->node[a];
        double size = 0, along = 0;
        for (int c = 0; c < dim; c++) {
            size = hypot(size, sum[c]);
            along += sum[c] * of->normal[c];
        }
        own[a] = !(along < (1 - 1e-9) * size) || along < LEAST_COSINE * size;
        of->curved = of->curved || !own[a];
        for (int c = 0; c < dim; c++)
            of->around[a][c] = own[a] ? of->normal[c] : sum[c] / size;
    }
    for (int a = 0; a < corners && of->curved; a++) {
        double others[3] = {0}, size = 0, along = 0;
        for (int b = 0; b < corners && own[a]; b++)
            for (int c = 0; c < dim && !own[b]; c++)
                others[c] += of->around[b][c];
        for (int c = 0; c < dim; c++) {
            size = hypot(size, others[c]);
            along += others[c] * of->normal[c];
        }
        for (int c = 0; c < dim && size > 0; c++)
            of->around[a][c] = (2 * along * of->normal[c] - others[c]) / size;
    }
}

/* Fills the place that was found. Has it a row? Not where its nodes cannot give way, nor where the obstacle's normal
 * leads out of the body: its middle is past the side then, and no row tells how to leave it. */
static bool describe(uz_inner_place *out, const deepest *of, const uz_body_model *model, uz_face face)
{
    const int dim = of->side.dim, corners = dim == 2 ? 2 : of->side.nodes % 4 == 0 ? 4 : 3;
    uz_side straight = of->side;
    double local[2], along = 0, most = 0;
    uz_gap gap;
    straight.nodes = corners;
    local_point(local, &of->side, of->at);
    *out = (uz_inner_place){.face = face, .nodes = of->side.nodes, .corners = corners, .size = of->size};
    memcpy(out->node, of->node, sizeof out->node);
    uz_side_shape(out->share, &of->side, local);
    uz_side_shape(out->linear, &straight, local);
    place_of(out->x, of, out->share);
    if (uz_obstacle_row_gap(&gap, of->obstacle, out->x, of->normal, EDGE * of->size, NULL) != UZ_OK)
        return false;
    out->back = of->back;
    for (int c = 0; c < dim; c++) {
        double on = 0;
        for (int a = 0; a < out->nodes; a++)
            on += out->share[a] * of->xyz[dim * a + c];
        out->curve += (on - out->x[c]) * of->normal[c];
    }
    out->curve -= out->back;
    out->gap = gap.gap - of->back;
    uz_unit_normal(out->normal, gap.normal, dim);
    for (int c = 0; c < dim; c++)
        along -= of->normal[c] * out->normal[c];
    for (int a = 0; a < out->nodes; a++) {
        double share[3];
        uz_free_shares(share, model, out->node[a], out->normal);
        for (int c = 0; c < dim; c++)
            most = fmax(most, fabs(out->share[a] * share[c]));
    }
    return along > LEAST_SHARE && most > LEAST_SHARE;
}

/* Room for `count` places inside sides beside those of `nodes` nodes. */
static uz_status reserve_inner(uz_contact_sites *sites, int64_t nodes, int64_t count, int dim, uz_error *err)
{
    uz_inner_place *inner = uz_realloc(sites->inner, count, sizeof *inner);
    sites->inner = inner ? inner : sites->inner;
    double *gap = inner ? uz_realloc(sites->gap, nodes + count, sizeof *gap) : NULL;
    sites->gap = gap ? gap : sites->gap;
    double *normal = gap ? uz_realloc(sites->normal, (nodes + count) * dim, sizeof *normal) : NULL;
    sites->normal = normal ? normal : sites->normal;
    return normal ? UZ_OK
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for contact inside %lld sides", (long long)count);
}

/* The places that were found before anything moved, where they have come to. */
static uz_status move_inner(uz_contact_sites *sites, const uz_contact_input *in, const uz_obstacle *obstacle,
                            uz_error *err)
{
    const uz_contact_sites *before = &in->rest->sites[in->index];
    const int dim = in->model->mesh.dim;
    const int64_t nodes = sites->n;
    uz_status status = before->n_inner > 0 ? reserve_inner(sites, nodes, before->n_inner, dim, err) : UZ_OK;
    for (int64_t i = 0; i < before->n_inner && status == UZ_OK; i++) {
        uz_inner_place *place = &sites->inner[i];
        deepest of = {.obstacle = obstacle, .back = before->inner[i].back + before->inner[i].curve};
        uz_gap gap;
        *place = before->inner[i];
        uz_body_side(&of.side, of.xyz, of.node, in->model, place->face);
        normal_of(of.normal, &of.side);
        place_of(place->x, &of, place->share);
        status = uz_obstacle_row_gap(&gap, obstacle, place->x, of.normal, EDGE * place->size, err);
        if (status != UZ_OK)
            break;
        place->gap = gap.gap - place->back;
        uz_unit_normal(place->normal, gap.normal, dim);
        sites->gap[nodes + i] = isfinite(before->gap[nodes + i]) ? place->gap : INFINITY;
        memcpy(sites->normal + dim * (nodes + i), place->normal, (size_t)dim * sizeof *place->normal);
        sites->n++;
        sites->n_inner++;
    }
    return status;
}

/* Appends the places inside sides to those of the nodes. gaps (n_nodes): of the nodes; normals (n_nodes x dim): sums of
 * the sides' normals. */
static uz_status find_inner(uz_contact_sites *sites, const uz_contact_input *in, const uz_obstacle *obstacle,
                            const double *gaps, const double *normals, uz_error *err)
{
    const int dim = in->model->mesh.dim;
    const int64_t nodes = sites->n;
    int64_t room = 0;
    if (in->rest)
        return move_inner(sites, in, obstacle, err);
    for (int64_t f = 0; f < in->on->n_faces; f++) {
        deepest of = {.obstacle = obstacle};
        double gap[UZ_FACE_NODES];
        uz_body_side(&of.side, of.xyz, of.node, in->model, in->on->face[f]);
        const int count = of.side.nodes, corners = dim == 2 ? 2 : count % 4 == 0 ? 4 : 3;
        for (int a = 0; a < count; a++) {
            gap[a] = gaps[of.node[a]];
            for (int b = 0; b < a; b++) {
                double distance = 0;
                for (int c = 0; c < dim; c++)
                    distance = hypot(distance, of.xyz[dim * a + c] - of.xyz[dim * b + c]);
                of.length = fmax(of.length, distance);
            }
        }
        of.size = of.length / (count > corners ? 2 : 1);
        set_curve(&of, normals, corners);
        if (!find_deepest(&of, gap))
            continue;
        if (sites->n - nodes == room) {
            room = 2 * room + 16;
            const uz_status status = reserve_inner(sites, nodes, room, dim, err);
            if (status != UZ_OK)
                return status;
        }
        uz_inner_place *place = &sites->inner[sites->n_inner++];
        const bool row = describe(place, &of, in->model, in->on->face[f]) && in->contact->between != UZ_CONTACT_NODES;
        sites->gap[sites->n] = row ? place->gap : INFINITY;
        memcpy(sites->normal + dim * sites->n++, place->normal, (size_t)dim * sizeof *place->normal);
    }
    return UZ_OK;
}

/* By node: sums of the normals of its sides (x dim), and the shortest distance to another node of them. */
static void look_around(double *normals, double *near, const uz_contact_input *in)
{
    const int dim = in->model->mesh.dim;
    for (int64_t f = 0; f < in->on->n_faces; f++) {
        deepest of;
        uz_body_side(&of.side, of.xyz, of.node, in->model, in->on->face[f]);
        normal_of(of.normal, &of.side);
        for (int a = 0; a < of.side.nodes; a++) {
            double *own = near + of.node[a];
            for (int c = 0; c < dim; c++)
                normals[dim * of.node[a] + c] += of.normal[c];
            for (int b = 0; b < of.side.nodes; b++) {
                double distance = 0;
                for (int c = 0; c < dim; c++)
                    distance = hypot(distance, of.xyz[dim * a + c] - of.xyz[dim * b + c]);
                *own = a != b && !(*own > 0 && *own < distance) ? distance : *own;
            }
        }
    }
}

/* A plane has no sites: where it is belongs to the load. */
static uz_status find(uz_contact_sites *sites, const uz_contact_input *in, uz_error *err)
{
    const uz_mesh *mesh = &in->model->mesh;
    uz_obstacle *obstacle = NULL;
    double *gaps = NULL, *normals = NULL, *near = NULL; /* by node */
    if (in->contact->kind == UZ_OBSTACLE_PLANE)
        return UZ_OK;
    uz_status status = uz_sites_of_nodes(sites, in, err);
    if (status == UZ_OK)
        status = uz_obstacle_new(&obstacle, in->contact, in->index, in->model->kind, err);
    if (status == UZ_OK) {
        gaps = uz_alloc(mesh->n_nodes, sizeof *gaps);
        normals = uz_alloc_zero(mesh->n_nodes * mesh->dim, sizeof *normals);
        near = uz_alloc_zero(mesh->n_nodes, sizeof *near);
    }
    if (status == UZ_OK && !(gaps && normals && near))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the gaps of %lld nodes", (long long)mesh->n_nodes);
    if (status == UZ_OK)
        look_around(normals, near, in);
    for (int64_t i = 0; i < sites->n && status == UZ_OK; i++) {
        const int64_t node = uz_group_node_at(in->on, i);
        double outward[3] = {0};
        uz_gap at;
        uz_unit_normal(outward, normals + node * mesh->dim, mesh->dim);
        status = uz_obstacle_row_gap(&at, obstacle, mesh->xyz + node * mesh->dim, outward, EDGE * near[node], err);
        if (status != UZ_OK)
            break;
        sites->gap[i] = gaps[node] = at.gap;
        uz_put_normal(sites, i, at.normal, mesh->dim);
    }
    if (status == UZ_OK)
        status = find_inner(sites, in, obstacle, gaps, normals, err);
    free(gaps);
    free(normals);
    free(near);
    uz_obstacle_free(obstacle);
    return status;
}

/* ---- the discretization */

static int64_t places(const uz_contact_input *in)
{
    const int64_t n = in->model->sites[in->index].n;
    return n > 0 ? n : uz_places_of_nodes(in);
}

static bool row(uz_contact_row *row, const uz_contact_input *in, const uz_contact_sites *sites, int64_t place)
{
    static const double whole = 1;
    const uz_mesh *mesh = &in->model->mesh;
    if (sites->n > 0 && place >= sites->n - sites->n_inner) {
        const uz_inner_place *inner = &sites->inner[place - (sites->n - sites->n_inner)];
        int most = 0;
        for (int a = 1; a < inner->nodes; a++)
            most = inner->share[a] > inner->share[most] ? a : most;
        *row = (uz_contact_row){.node = inner->node[most],
                                .gap = sites->gap[place],
                                .slaves = inner->nodes,
                                .slave = inner->node,
                                .slave_share = inner->share};
        memcpy(row->normal, inner->normal, sizeof row->normal);
        return isfinite(row->gap);
    }
    *row = (uz_contact_row){.node = uz_group_node_at(in->on, place), .slaves = 1, .slave_share = &whole};
    row->slave = &row->node;
    if (sites->n > 0) {
        row->gap = sites->gap[place];
        memcpy(row->normal, sites->normal + place * mesh->dim, (size_t)mesh->dim * sizeof *row->normal);
        return isfinite(row->gap);
    }
    for (int c = 0; c < mesh->dim; c++) {
        row->from[c] = in->contact->point[c];
        row->offset[c] = mesh->xyz[row->node * mesh->dim + c] - row->from[c];
    }
    return uz_unit_normal(row->normal, in->contact->normal, mesh->dim);
}

/* What a row inside a side has, its nodes have no more. */
static void areas(double *area, const uz_contact_input *in)
{
    const uz_contact_sites *sites = &in->model->sites[in->index];
    const int64_t nodes = uz_places_of_nodes(in);
    uz_areas_of_nodes(area, in);
    for (int64_t i = 0; i < sites->n_inner; i++) {
        uz_side side;
        int64_t node[UZ_FACE_NODES];
        double xyz[3 * UZ_FACE_NODES], w[UZ_FACE_NODES];
        const bool row = isfinite(sites->gap[nodes + i]);
        uz_body_side(&side, xyz, node, in->model, sites->inner[i].face);
        uz_side_positive_weights(w, &side);
        area[nodes + i] = row ? INNER_AREA * uz_side_area(&side) : 0;
        for (int a = 0; a < side.nodes && row; a++)
            in->room[node[a]] += INNER_AREA * w[a];
    }
    for (int64_t i = 0; i < nodes && sites->n_inner > 0; i++) {
        const int64_t node = uz_group_node_at(in->on, i);
        area[i] = fmax(0, area[i] - in->room[node]);
        in->room[node] = 0;
    }
}

const uz_contact_discretization uz_node_to_obstacle = {
    .name = "node to obstacle", .places = places, .find = find, .row = row, .areas = areas};
