/* finite_passing.c: bodies go around obstacles and each other, not through them.
 *
 * What has gone through a round obstacle, or another body, has no rows behind it that would bring it back, and looks
 * like any equilibrium from there. So the straight ways from where a part of the load begins to where it ends are held
 * against both. Where sides slide around what they touch it takes smaller parts, whose ways are near those that they
 * go. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "obstacle/obstacle.h"
#include "scene/mesh_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A way to where places are is looked at from this many points of it at least. */
#define WAY_POINTS 64
/* Points of a way past moving sides, between which it crosses each of them once. */
enum { LOOKED_AT = 4, HALVINGS = 40, MOST_CROSSINGS = 64 };
/* What begins as far behind a side as this part of its length touches it. */
#define TOUCHES 0.05
#define SLACK   1e-9
/* Cosines of the normals where a way goes out to that where it goes in: less is behind, and more the same side. */
#define BEHIND (-0.5)
#define ALIKE  0.5

/* ---- round obstacles */

bool uz_finite_may_go(const uz_obstacle *obstacle, const double *x, const double *way)
{
    const double length = sqrt(uz_dot3(way, way));
    double entry[3] = {0}, done = 0;
    bool outside = true; /* all the way since the last point */
    while (true) {
        uz_gap gap;
        double at[3];
        for (int c = 0; c < 3; c++)
            at[c] = x[c] + way[c] * (done / length);
        if (uz_obstacle_gap(&gap, obstacle, at, NULL) != UZ_OK || (!outside && !(uz_dot3(entry, gap.normal) > 0)))
            return false;
        if (outside)
            memcpy(entry, gap.normal, sizeof entry);
        if (done >= length)
            return true;
        const double step = fmax(gap.gap, length / WAY_POINTS);
        outside = step <= gap.gap;
        done = fmin(length, done + step);
    }
}

/* May all of a side go straight from one displacement to another (n each), past a round obstacle? Between points by
 * which it is looked at there is a quarter of the radius, or, of very small ones, a sixty-fourth of the side. What goes
 * less than the radius stays in front of it, or grazes it. */
static bool side_may_go(const uz_mesh *mesh, uz_face face, const uz_obstacle *obstacle, double radius,
                        const double *from, const double *to)
{
    int64_t node[UZ_FACE_NODES];
    const int dim = mesh->dim, count = uz_mesh_face(node, mesh, face);
    const int corners = dim == 2 ? 2 : count % 3 == 0 ? 3 : 4;
    double x[4][3] = {{0}}, way[4][3] = {{0}}, longest = 0, length = 0;
    for (int a = 0; a < corners; a++) {
        for (int c = 0; c < dim; c++) {
            x[a][c] = mesh->xyz[dim * node[a] + c] + from[dim * node[a] + c];
            way[a][c] = to[dim * node[a] + c] - from[dim * node[a] + c];
        }
        longest = fmax(longest, sqrt(uz_dot3(way[a], way[a])));
        length = fmax(length, sqrt(uz_distance2(x[a], x[0], 3)));
    }
    if (longest < radius)
        return true;
    const int n = (int)fmin(WAY_POINTS, ceil(4 * length / radius));
    for (int i = 0; i <= n; i++)
        for (int j = 0; j <= (dim == 2 ? 0 : corners == 3 ? n - i : n); j++) {
            const double s = (double)i / n, t = (double)j / n;
            const double share[4] = {corners == 4 ? (1 - s) * (1 - t) : 1 - s - t, corners == 4 ? s * (1 - t) : s,
                                     corners == 4 ? s * t : t, (1 - s) * t};
            double at[3] = {0}, along[3] = {0};
            for (int a = 0; a < corners; a++)
                for (int c = 0; c < dim; c++) {
                    at[c] += share[a] * x[a][c];
                    along[c] += share[a] * way[a][c];
                }
            if (uz_dot3(along, along) > 0 && !uz_finite_may_go(obstacle, at, along))
                return false;
        }
    return true;
}

/* May those of contact k, past its round obstacle? */
static uz_status sides_may_go(bool *may, const uz_finite_run *run, int64_t k, const double *from, const double *to,
                              uz_error *err)
{
    const uz_contact *contact = &run->scene.contacts[k];
    uz_obstacle *obstacle = NULL;
    const uz_group *on = uz_mesh_group(&run->base.mesh, contact->on, "", err);
    const uz_status status = on ? uz_obstacle_new(&obstacle, contact, k, run->scene.model, err) : UZ_ERR_SCENE;
    for (int64_t i = 0; status == UZ_OK && i < on->n_faces && *may; i++)
        *may = side_may_go(&run->base.mesh, on->face[i], obstacle, contact->radius, from, to);
    uz_obstacle_free(obstacle);
    return status;
}

/* ---- sides of other bodies */

/* An edge, or a triangle of a face, on a straight way. */
typedef struct {
    int dim;
    double from[3][3], way[3][3];
} piece;

typedef struct {
    double t, normal[3];
    bool in;
} crossing;

typedef struct {
    int n;
    crossing at[MOST_CROSSINGS];
} crossings;

/* How far x is in front of the piece at t, and its normal; *within: is that above the piece? */
static double height(double normal[3], bool *within, double *length, const piece *f, double t, const double x[3])
{
    double a[3][3] = {{0}}, side[2][3] = {{0}}, off[3] = {0};
    for (int k = 0; k < f->dim; k++)
        for (int c = 0; c < f->dim; c++)
            a[k][c] = f->from[k][c] + t * f->way[k][c];
    for (int c = 0; c < f->dim; c++) {
        side[0][c] = a[1][c] - a[0][c];
        side[1][c] = f->dim == 3 ? a[2][c] - a[0][c] : 0;
        off[c] = x[c] - a[0][c];
    }
    if (f->dim == 2)
        side[1][2] = 1; /* across the plane */
    uz_cross3(normal, side[0], side[1]);
    *length = sqrt(fmax(uz_dot3(side[0], side[0]), f->dim == 3 ? uz_dot3(side[1], side[1]) : 0));
    double first[3], second[3];
    uz_cross3(first, off, side[1]);
    uz_cross3(second, side[0], off);
    const double square = uz_dot3(normal, normal);
    const double s = uz_dot3(first, normal) / square, r = f->dim == 3 ? uz_dot3(second, normal) / square : 0;
    *within = s >= -SLACK && r >= -SLACK && s + r <= 1 + SLACK;
    uz_unit3(normal);
    return uz_dot3(off, normal);
}

static void point_at(double x[3], const double *from, const double *way, double t)
{
    for (int c = 0; c < 3; c++)
        x[c] = from[c] + t * way[c];
}

static void add_crossing(crossings *list, double t, const double normal[3], bool in)
{
    if (list->n == MOST_CROSSINGS)
        return;
    crossing *to = &list->at[list->n++];
    *to = (crossing){.t = t, .in = in};
    memcpy(to->normal, normal, sizeof to->normal);
}

/* Where a point crosses a piece: into the body only through sides that it may touch. */
static void cross_piece(crossings *list, const piece *f, const double *from, const double *way, bool touched)
{
    double x[3], normal[3], length;
    bool within;
    point_at(x, from, way, 0);
    double before = height(normal, &within, &length, f, 0, x);
    if (touched && within && before <= 0 && before > -TOUCHES * length)
        add_crossing(list, 0, normal, true);
    for (int k = 1; k <= LOOKED_AT; k++) {
        double low = (k - 1.0) / LOOKED_AT, high = (double)k / LOOKED_AT;
        point_at(x, from, way, high);
        const double after = height(normal, &within, &length, f, high, x);
        const bool in = before > 0;
        const bool crosses = in != (after > 0) && (touched || !in);
        for (int q = 0; q < HALVINGS && crosses; q++) {
            const double t = 0.5 * (low + high);
            point_at(x, from, way, t);
            *((height(normal, &within, &length, f, t, x) > 0) == in ? &low : &high) = t;
        }
        if (crosses && within)
            add_crossing(list, high, normal, in);
        before = after;
    }
}

static int by_time(const void *a, const void *b)
{
    const crossing *x = a, *y = b;
    return (x->t > y->t) - (x->t < y->t);
}

/* Has a way that crosses these gone in on one side, and out behind, or `beside`? */
static bool has_gone_through(crossings *list, bool beside)
{
    const crossing *in = NULL;
    qsort(list->at, (size_t)list->n, sizeof *list->at, by_time);
    for (int k = 0; k < list->n; k++) {
        const crossing *now = &list->at[k];
        const double cosine = in ? uz_dot3(in->normal, now->normal) : 1;
        if (now->in) {
            in = in ? in : now;
            continue;
        }
        if (cosine < (beside ? ALIKE : BEHIND))
            return true;
        in = NULL;
    }
    return false;
}

/* Pieces of sides of the mesh, each between two displacements. */
typedef struct {
    const uz_mesh *mesh;
    const double *from, *to;
    int64_t n;
    struct moving_piece {
        piece of;
        int64_t node[3];
        bool touched;  /* the contact is with it */
        double box[6]; /* of all of its way */
    } * piece;
} skin;

static void start_box(double box[6])
{
    for (int c = 0; c < 3; c++) {
        box[c] = INFINITY;
        box[3 + c] = -INFINITY;
    }
}

/* A node's place and way; the box grows around both ends. */
static void node_way(double from[3], double way[3], double box[6], const skin *s, int64_t node)
{
    const int dim = s->mesh->dim;
    for (int c = 0; c < 3; c++) {
        const int64_t i = dim * node + c;
        from[c] = c < dim ? s->mesh->xyz[i] + s->from[i] : 0;
        way[c] = c < dim ? s->to[i] - s->from[i] : 0;
        box[c] = fmin(box[c], from[c] + fmin(0, way[c]));
        box[3 + c] = fmax(box[3 + c], from[c] + fmax(0, way[c]));
    }
}

static void add_piece(skin *s, int64_t a, int64_t b, int64_t c, bool touched)
{
    struct moving_piece *p = &s->piece[s->n++];
    *p = (struct moving_piece){.of = {.dim = s->mesh->dim}, .node = {a, b, c}, .touched = touched};
    start_box(p->box);
    for (int k = 0; k < s->mesh->dim; k++)
        node_way(p->of.from[k], p->of.way[k], p->box, s, p->node[k]);
}

/* Edges of three nodes are two pieces, faces with four corners two triangles. */
static void add_face(skin *s, uz_face face, bool touched)
{
    int64_t node[UZ_FACE_NODES];
    const int count = uz_mesh_face(node, s->mesh, face);
    if (s->mesh->dim == 2 && count == 3) {
        add_piece(s, node[0], node[2], -1, touched);
        add_piece(s, node[2], node[1], -1, touched);
    } else if (s->mesh->dim == 2) {
        add_piece(s, node[0], node[1], -1, touched);
    } else {
        add_piece(s, node[0], node[1], node[2], touched);
        if (count % 3 != 0 || count == 8)
            add_piece(s, node[0], node[2], node[3], touched);
    }
}

/* The sides of the group, and all of the bodies that it is of. part: of each node (uz_mesh_number_parts). */
static bool make_skin(skin *s, const uz_group *group, const uz_group *all, const int64_t *part)
{
    bool *of = uz_alloc_zero(s->mesh->n_nodes, sizeof *of); /* by part */
    s->piece = uz_alloc(2 * (group->n_faces + all->n_faces), sizeof *s->piece);
    for (int64_t i = 0; i < group->n_faces && of && s->piece; i++) {
        add_face(s, group->face[i], true);
        of[part[s->mesh->node[s->mesh->first[group->face[i].element]]]] = true;
    }
    for (int64_t i = 0; i < all->n_faces && of && s->piece; i++)
        if (of[part[s->mesh->node[s->mesh->first[all->face[i].element]]]])
            add_face(s, all->face[i], false);
    const bool room = of && s->piece;
    free(of);
    return room;
}

/* May a node go straight past all of it? */
static bool node_may_go(const skin *s, int64_t node, bool beside)
{
    double from[3], way[3], box[6];
    crossings list = {.n = 0};
    start_box(box);
    node_way(from, way, box, s, node);
    for (int64_t i = 0; i < s->n; i++) {
        const struct moving_piece *p = &s->piece[i];
        bool apart = p->node[0] == node || p->node[1] == node || p->node[2] == node;
        for (int c = 0; c < 3; c++)
            apart = apart || p->box[c] > box[3 + c] || p->box[3 + c] < box[c];
        if (!apart)
            cross_piece(&list, &p->of, from, way, p->touched);
    }
    return !has_gone_through(&list, beside);
}

/* May two surfaces go straight on, nodes of either past sides of the other one? */
static uz_status pair_may_go(bool *may, const uz_finite_run *run, const uz_contact *contact, const int64_t *part,
                             const double *from, const double *to, bool beside, uz_error *err)
{
    const uz_mesh *mesh = &run->base.mesh;
    const uz_group *group[2] = {uz_mesh_group(mesh, contact->on, "", err), uz_mesh_group(mesh, contact->with, "", err)};
    if (!group[0] || !group[1])
        return UZ_ERR_SCENE;
    for (int k = 0; k < 2 && *may && (k == 0 || group[0] != group[1]); k++) {
        skin s = {.mesh = mesh, .from = from, .to = to};
        const bool room = make_skin(&s, group[!k], &run->outer, part);
        for (int64_t i = 0; i < uz_group_node_count(mesh, group[k]) && room && *may; i++)
            *may = node_may_go(&s, uz_group_node_at(group[k], i), beside);
        free(s.piece);
        if (!room)
            return uz_no_memory(err, "the sides of two bodies");
    }
    return UZ_OK;
}

/* ---- the whole */

uz_status uz_finite_may_pass(bool *may, const uz_finite_run *run, const double *from, const double *to, bool beside,
                             uz_error *err)
{
    const uz_mesh *mesh = &run->base.mesh;
    int64_t *part = run->pairs ? uz_alloc(mesh->n_nodes, sizeof *part) : NULL;
    uz_status status = UZ_OK;
    *may = true;
    if (run->pairs && (!part || uz_mesh_number_parts(part, mesh) < 0))
        status = uz_no_memory(err, "the parts of a body");
    for (int64_t k = 0; k < run->scene.n_contacts && status == UZ_OK && *may; k++) {
        const uz_contact *contact = &run->scene.contacts[k];
        if (contact->kind == UZ_OBSTACLE_BODY)
            status = pair_may_go(may, run, contact, part, from, to, beside, err);
        else if (contact->kind == UZ_OBSTACLE_ROUND && !contact->inside)
            status = sides_may_go(may, run, k, from, to, err);
    }
    free(part);
    return status;
}
