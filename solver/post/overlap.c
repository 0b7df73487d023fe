/* overlap.c: how deep do the deformed surfaces stand in each other?
 *
 * Rows of a contact keep nodes, or means over the surface, from overlapping; what is between them nobody asked. Here
 * points of either surface, at fixed places of its sides, are projected on the closest point of the other one, or of
 * the obstacle. What is smoothed by the contact (assembly/mortar.h) is measured as smooth: a point is moved by its
 * offset from the facet, and so is its foot.
 *
 * A projection counts where it means something:
 *   - not beyond the border of the other surface (obstacle/projection.h);
 *   - the two surfaces face each other there: what is behind a surface that looks the same way is the far side of a
 * body around it;
 *   - an overlap that is deeper than a side, was there before anything moved, and of which the motion took less than
 *     half, is between surfaces that the contact did not mean, as of a body's own far side. */
#include "post/overlap.h"

#include "assembly/mortar.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "obstacle/face_point.h"
#include "obstacle/obstacle.h"
#include "obstacle/projection.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cosine between the normals of two surfaces from which on they face each other. */
#define FACING (-0.1)

/* A side of the contact. */
typedef struct {
    uz_mortar_surface still, moved; /* before and after the displacement; moved: of two bodies only */
    uz_faces *faces;                /* where it is now, for the other side's points */
} flank;

typedef struct {
    const uz_body_model *model;
    const double *u;
    const uz_mortar_geometry *geometry;
    bool smooth;           /* are offsets part of the contact? */
    bool plane;            /* is the obstacle one? Then straight sides are deepest at their nodes */
    uz_obstacle *obstacle; /* NULL: two bodies */
    uz_own_body *own;      /* where it is now; NULL: no part of it may touch itself */
    double reach;          /* how deep an overlap may be that means something, but for the point's own side */
    flank flank[2];
    uz_overlap *out;
} work;

/* A point of side i of flank k. */
typedef struct {
    int k;
    int64_t i;
    double size;  /* of the side: from its middle to the farthest corner */
    double reach; /* how far away something is looked for */
    double gap;   /* INFINITY: faces nothing */
    double foot[3];
} place;

/* The gap between smooth surfaces where facets have this foot: along the smooth normal of the point's own side, as the
 * directions of facets are off by half their turn. d: from the foot to the point. */
static double smooth_gap(const work *w, const place *p, const uz_contact_pair *foot, const double d[3],
                         const double off[3], const double normal[3], double gap)
{
    const int dim = w->model->mesh.dim;
    const uz_mortar_surface *across = &w->flank[!p->k].still;
    const uz_mortar_side *other = &across->side[foot->number];
    double X[3] = {0}, other_off[3], along = 0, any = 0;
    for (int a = 0; a < foot->count; a++)
        for (int c = 0; c < dim; c++)
            X[c] += foot->weight[a] * other->xyz[dim * a + c];
    w->geometry->offset(other_off, across, other, foot->local, X);
    for (int c = 0; c < dim; c++) {
        any += fabs(off[c]) + fabs(other_off[c]);
        along -= (d[c] + off[c] - other_off[c]) * normal[c];
    }
    return any > 0 ? along : gap;
}

/* Looks at the point of the side with these reference coordinates: p->gap and ->foot, and what it adds to w->out. */
static void look(work *w, place *p, const double *local)
{
    const int dim = w->model->mesh.dim;
    const flank *mine = &w->flank[p->k];
    const uz_mortar_side *side = &mine->still.side[p->i];
    const uz_mortar_surface *now = w->obstacle ? &mine->still : &mine->moved;
    const uz_side shape = uz_mortar_side_of(side, w->model);
    double N[UZ_FACE_NODES], X[3] = {0}, u[3] = {0}, x[3] = {0}, off[3] = {0}, out[3] = {0}, normal[3], along = 0;
    double size = p->size, motion = 0, facing = 0;
    p->gap = INFINITY;
    memset(p->foot, 0, sizeof p->foot);
    uz_side_shape(N, &shape, local);
    for (int a = 0; a < side->nodes; a++)
        for (int c = 0; c < dim; c++) {
            X[c] += N[a] * side->xyz[dim * a + c];
            u[c] += N[a] * w->u[side->node[a] * dim + c];
            out[c] += N[a] * now->normal[now->side[p->i].place[a] * dim + c];
        }
    uz_unit3(out);
    if (w->smooth)
        w->geometry->offset(off, &mine->still, side, local, X);
    for (int c = 0; c < dim; c++)
        x[c] = X[c] + u[c] + (w->obstacle ? off[c] : 0);
    if (w->obstacle) {
        uz_gap there;
        if (uz_obstacle_gap(&there, w->obstacle, x, NULL) != UZ_OK)
            return;
        p->gap = there.gap;
        memcpy(p->foot, there.foot, sizeof p->foot);
        memcpy(normal, there.normal, sizeof normal);
        along = uz_dot3(normal, u);
    } else {
        uz_contact_pair foot;
        double d[3] = {0}, back[3] = {0};
        const double outward[1][3] = {{out[0], out[1], out[2]}};
        const uz_own_place own = {.own = w->own,
                                  .element = side->face.element,
                                  .nodes = side->nodes,
                                  .normals = 1,
                                  .node = side->node,
                                  .normal = outward,
                                  .farthest = p->reach};
        const bool found = uz_faces_closest(&foot, w->flank[!p->k].faces, x, &own);
        p->gap = foot.gap;
        if (!found)
            return;
        for (int c = 0; c < dim; c++) {
            for (int a = 0; a < foot.count; a++) {
                const int64_t i = foot.master[a] * dim + c;
                back[c] += foot.weight[a] * w->u[i];
                p->foot[c] += foot.weight[a] * (w->model->mesh.xyz[i] + w->u[i]);
            }
            d[c] = x[c] - p->foot[c];
        }
        memcpy(normal, foot.normal, sizeof normal);
        along = uz_dot3(normal, u) - uz_dot3(normal, back);
        motion = sqrt(uz_dot3(back, back));
        size = fmax(size, foot.size);
        if (w->smooth)
            p->gap = smooth_gap(w, p, &foot, d, off, out, p->gap);
    }
    for (int c = 0; c < dim; c++)
        facing += out[c] * normal[c];
    const double began = p->gap - along;
    if (facing > FACING || (!w->obstacle && began < -size && p->gap < 0.5 * began)) {
        p->gap = fabs(p->gap);
        return;
    }
    w->out->motion = fmax(w->out->motion, motion + sqrt(uz_dot3(u, u)));
    if (-p->gap > w->out->depth) {
        w->out->depth = -p->gap;
        w->out->side = 2 * p->size;
        memcpy(w->out->at, x, sizeof x);
    }
}

/* How far the facet is from the smooth surface that it stands for, at most; *known: does an offset say so? Where none
 * does, the kinks between the facet's normals at its corners and those of the places there tell: a facet of length l
 * between two kinks of angle a has a sagitta of l a / 4, of half of that where a middle node is on the surface too. */
static double sagitta(bool *known, const work *w, const place *p)
{
    static const double AT[3][3][2] = {
        {{0, 0}, {-0.5, 0}, {0.5, 0}}, {{1. / 3, 1. / 3}, {0.5, 0.5}, {0.5, 0}}, {{0, 0}, {0.5, 0}, {0, 0.5}}};
    const int dim = w->model->mesh.dim;
    const uz_mortar_surface *surface = &w->flank[p->k].still;
    const uz_mortar_side *side = &surface->side[p->i];
    const uz_side shape = uz_mortar_side_of(side, w->model);
    const int kind = dim == 2 ? 0 : side->nodes % 3 == 0 ? 1 : 2, corners = uz_face_corners(dim, side->nodes);
    double most = 0, kink = 0;
    for (int q = 0; q < 3; q++) {
        double N[UZ_FACE_NODES], X[3] = {0}, off[3];
        uz_side_shape(N, &shape, AT[kind][q]);
        for (int a = 0; a < side->nodes; a++)
            for (int c = 0; c < dim; c++)
                X[c] += N[a] * side->xyz[dim * a + c];
        w->geometry->offset(off, surface, side, AT[kind][q], X);
        most = fmax(most, sqrt(uz_dot3(off, off)));
    }
    *known = dim == 2 || most > 0;
    for (int a = 0; a < corners && !*known; a++) {
        double normal[3], turn[3];
        uz_side_area_vector(normal, &shape, uz_side_local_nodes(&shape)[a]);
        uz_unit3(normal);
        uz_cross3(turn, normal, surface->normal + 3 * side->place[a]);
        kink = fmax(kink, sqrt(uz_dot3(turn, turn)));
    }
    return *known ? most : p->size * kink / (side->nodes > corners ? 4 : 2);
}

/* From a point of a side on, whose gap is p->gap, in steps along its coordinates, of faces also along the third edge of
 * a triangle or both diagonals: obstacles may be smaller than the distance of the points that are looked at. */
static void search(work *w, place *p, double local[2])
{
    static const double WAY[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}, {1, 1}, {-1, -1}};
    const int dim = w->model->mesh.dim;
    const bool triangle = dim == 3 && w->flank[p->k].still.side[p->i].nodes % 3 == 0;
    double best = p->gap;
    for (double step = 0.25; step > 0.003; step *= 0.5)
        for (int way = 0; way < (dim == 2 ? 2 : triangle ? 6 : 8); way++) {
            const double a = local[0] + step * WAY[way][0], b = local[1] + step * WAY[way][1];
            if (triangle ? fmin(a, b) < 0 || a + b > 1 : fmax(fabs(a), fabs(b)) > 1)
                continue;
            look(w, p, (double[2]){a, b});
            if (!(p->gap < best))
                continue;
            best = p->gap;
            local[0] = a;
            local[1] = b;
        }
}

/* All points of a side; seen: of the places, whose nodes are looked at once. */
static void look_at_side(work *w, int k, int64_t i, unsigned char *seen)
{
    static const double EDGE[7][2] = {{0}, {-0.25}, {0.25}, {-0.5}, {0.5}, {-0.75}, {0.75}};
    static const double TRIANGLE[4][2] = {{1. / 3, 1. / 3}, {1. / 6, 1. / 6}, {2. / 3, 1. / 6}, {1. / 6, 2. / 3}};
    static const double QUAD[5][2] = {{0, 0}, {-0.6, -0.6}, {0.6, -0.6}, {0.6, 0.6}, {-0.6, 0.6}};
    const int dim = w->model->mesh.dim;
    const uz_mortar_side *side = &w->flank[k].still.side[i];
    const uz_side shape = uz_mortar_side_of(side, w->model);
    const int corners = uz_face_corners(dim, side->nodes), count = dim == 2 ? 7 : corners == 4 ? 5 : 4;
    const double(*at)[2] = dim == 2 ? EDGE : corners == 3 ? TRIANGLE : QUAD;
    place p = {.k = k, .i = i};
    double N[UZ_FACE_NODES], middle[3] = {0}, moved[3 * UZ_FACE_NODES], best, deepest[2];
    bool known;
    uz_side_shape(N, &shape, at[0]);
    for (int a = 0; a < side->nodes; a++)
        for (int c = 0; c < dim; c++) {
            moved[dim * a + c] = side->xyz[dim * a + c] + w->u[side->node[a] * dim + c];
            middle[c] += N[a] * moved[dim * a + c];
        }
    for (int a = 0; a < side->nodes; a++)
        p.size = fmax(p.size, sqrt(uz_distance2(middle, moved + dim * a, dim)));
    const double off = sagitta(&known, w, &p);
    p.reach = p.size + 2 * off + w->reach;
    look(w, &p, at[0]);
    if (!(p.gap <= p.size + 2 * off)) /* gaps change by no more than places do */
        return;
    if (p.gap <= 2 * off || p.gap <= 0) {
        w->out->facets = fmax(w->out->facets, off);
        if (!w->smooth || !known)
            w->out->facets_left = fmax(w->out->facets_left, off);
    }
    best = p.gap;
    memcpy(deepest, at[0], sizeof deepest);
    const bool nodes_only = w->plane && side->nodes == corners && !(w->smooth && off > 0);
    if (w->obstacle &&
        !nodes_only) { /* the point of the side that is closest to where the obstacle is closest to its middle */
        uz_foot foot;
        for (int a = 0; a < side->nodes; a++)
            for (int c = 0; c < dim; c++)
                moved[dim * a + c] -= p.foot[c];
        uz_face_closest(&foot, dim, side->nodes, moved);
        look(w, &p, foot.local);
        if (p.gap < best) {
            best = p.gap;
            memcpy(deepest, foot.local, sizeof deepest);
        }
    }
    for (int q = nodes_only ? count : 1; q < count + side->nodes; q++) {
        const double *local = q < count ? at[q] : uz_side_local_nodes(&shape)[q - count];
        if (q >= count && seen[side->place[q - count]]++)
            continue;
        look(w, &p, local);
        if (p.gap < best) {
            best = p.gap;
            memcpy(deepest, local, sizeof deepest);
        }
    }
    if (!w->obstacle || nodes_only || !(best < 0.25 * p.size))
        return;
    p.gap = best;
    search(w, &p, deepest);
    /* Nodes in contact have all the same gap; what is deepest in a face need not be beside the first of them. */
    for (int q = 0; q < count + side->nodes && dim == 3; q++) {
        memcpy(deepest, q < count ? at[q] : uz_side_local_nodes(&shape)[q - count], sizeof deepest);
        look(w, &p, deepest);
        search(w, &p, deepest);
    }
}

/* ---- contacts */

/* An overlap counts that is not deeper than a side, or that the motion of both surfaces made. */
static double find_reach(const work *w, int flanks)
{
    const int dim = w->model->mesh.dim;
    double longest = 0, motion = 0;
    for (int j = 0; j < flanks; j++)
        for (int64_t i = 0; i < w->flank[j].still.n; i++) {
            const uz_mortar_side *side = &w->flank[j].still.side[i];
            for (int a = 0; a < side->nodes; a++) {
                const double *u = w->u + side->node[a] * dim;
                motion = fmax(motion, uz_distance2(u, (double[3]){0}, dim));
                for (int b = 0; b < a; b++)
                    longest = fmax(longest, uz_distance2(side->xyz + dim * a, side->xyz + dim * b, dim));
            }
        }
    return sqrt(longest) + 4 * sqrt(motion);
}

/* Both flanks of contact k; moved: the body where it is now. */
static uz_status look_at_contact(uz_overlap *out, const uz_body_model *moved, const uz_body_model *model,
                                 const uz_scene *scene, int64_t k, const double *u, uz_error *err)
{
    const uz_contact *contact = &scene->contacts[k];
    const bool pair = contact->kind == UZ_OBSTACLE_BODY;
    uz_contact whole = *contact;
    uz_contact_input in = {.model = model, .contact = &whole, .index = k}, then = in;
    work w = {.model = model, .u = u, .geometry = uz_mortar_geometry_of(model->mesh.dim), .out = out};
    unsigned char *seen = NULL;
    uz_status status = UZ_OK;
    *out = (uz_overlap){.depth = NAN};
    whole.faceted = false; /* what facets stand for is wanted in every case, of the deformed ones in none */
    w.plane = contact->kind == UZ_OBSTACLE_PLANE;
    w.smooth = !contact->faceted && (!pair || contact->between == UZ_CONTACT_SURFACES);
    uz_contact faceted = *contact;
    faceted.faceted = true;
    then.model = moved;
    then.contact = &faceted;
    const uz_group *group[2] = {uz_mesh_group(&model->mesh, contact->on, "", NULL),
                                pair ? uz_mesh_group(&model->mesh, contact->with, "", NULL) : NULL};
    const int flanks = pair ? 2 : 1;
    for (int j = 0; j < flanks; j++)
        if (!group[j] || group[j]->kind != UZ_GROUP_FACES || group[j]->n_faces < 1)
            return UZ_OK;
    if (!pair)
        status = uz_obstacle_new(&w.obstacle, contact, k, model->kind, NULL);
    for (int j = 0; j < flanks && status == UZ_OK; j++) {
        status = uz_mortar_surface_make(&w.flank[j].still, &in, group[j], NULL);
        if (status == UZ_OK && pair)
            status = uz_mortar_surface_make(&w.flank[j].moved, &then, group[j], NULL);
        if (status == UZ_OK && pair)
            status = uz_faces_new(&w.flank[j].faces, &moved->mesh, group[j], NULL);
    }
    if (status == UZ_OK && pair)
        status = uz_own_body_new(&w.own, &moved->mesh, group[0], group[1], NULL);
    if (status == UZ_OK && w.own)
        w.reach = find_reach(&w, flanks);
    for (int j = 0; j < flanks && status == UZ_OK; j++) {
        free(seen);
        seen = uz_alloc_zero(w.flank[j].still.n_places, 1);
        status = seen ? UZ_OK : UZ_ERR_MEMORY;
        if (status == UZ_OK && j == 0)
            out->depth = 0;
        for (int64_t i = 0; i < group[j]->n_faces && status == UZ_OK; i++)
            look_at_side(&w, j, i, seen);
    }
    free(seen);
    uz_obstacle_free(w.obstacle);
    uz_own_body_free(w.own);
    for (int j = 0; j < flanks; j++) {
        uz_mortar_surface_clear(&w.flank[j].still);
        uz_mortar_surface_clear(&w.flank[j].moved);
        uz_faces_free(w.flank[j].faces);
    }
    if (status == UZ_ERR_MEMORY)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the overlap of contact %lld", (long long)k);
    return UZ_OK; /* a side that is deformed to nothing, or an obstacle out of range: nothing was measured */
}

uz_status uz_measure_overlap(uz_overlap *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                             uz_error *err)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    uz_body_model moved = *model;
    double *xyz = NULL;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < scene->n_contacts && status == UZ_OK; k++) {
        if (scene->contacts[k].kind == UZ_OBSTACLE_BODY && !xyz) {
            if (!(xyz = uz_alloc(n, sizeof *xyz)))
                return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld deformed nodes",
                               (long long)model->mesh.n_nodes);
            for (int64_t i = 0; i < n; i++)
                xyz[i] = model->mesh.xyz[i] + u[i];
            moved.mesh.xyz = xyz;
        }
        status = look_at_contact(&out[k], &moved, model, scene, k, u, err);
    }
    free(xyz);
    return status;
}

double uz_contact_approach(double strain_energy, double force, const uz_overlap *overlap, int64_t n_contacts)
{
    double motion = 0;
    for (int64_t k = 0; k < n_contacts; k++)
        motion = fmax(motion, overlap[k].motion);
    return force > 0 ? fmin(2 * strain_energy / force, motion) : 0;
}
