/* projection.c: the nodes of one body on the faces of the other. */
#include "obstacle/projection.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "obstacle/box_tree.h"
#include "obstacle/face_point.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Closer to an edge or a corner of the master than this part of the face's size, a node is on it: the direction between
 * them would be rounding. */
#define ON_BORDER 1e-6

/* Cosine between the normals of two faces that surely do not face each other, which has them opposite. */
#define SAME_WAY 0.1

/* The faces of a group, where they are, and which of them meet at a node. Coordinates are the mesh's times a power of
 * two near one over its extent. */
typedef struct uz_faces {
    const uz_mesh *mesh;
    const uz_group *group;
    double scale;
    uz_box_tree tree;
    uz_csc around; /* by columns: the faces that have each node for a corner */
} master;

static void master_clear(master *m)
{
    uz_box_tree_clear(&m->tree);
    uz_csc_clear(&m->around);
}

/* The face's nodes as seen from x, scaled; returns how many. */
static int gather(double *xyz, int64_t node[UZ_FACE_NODES], const master *m, int64_t face, const double *x)
{
    const int dim = m->mesh->dim, count = uz_mesh_face(node, m->mesh, m->group->face[face]);
    for (int i = 0; i < count; i++)
        for (int c = 0; c < dim; c++)
            xyz[i * dim + c] = m->mesh->xyz[node[i] * dim + c] * m->scale - x[c];
    return count;
}

static int closest_on(uz_foot *foot, const master *m, int64_t face, const double *x)
{
    double xyz[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    const int count = gather(xyz, node, m, face, x);
    uz_face_closest(foot, m->mesh->dim, count, xyz);
    return count;
}

/* A face lies within the box of its Bezier points: its corners, and for each middle twice it less the mean of its
 * edge's ends (Farin, "Curves and Surfaces for CAGD", convex hull property). A bilinear face within that of its
 * corners; one of eight nodes, as a biquadratic, has one more point: the sum of its middles less 3/4 that of its
 * corners. */
static void box_of(double *box, const double *xyz, int dim, int count)
{
    const int corners = uz_face_corners(dim, count);
    for (int c = 0; c < dim; c++) {
        box[c] = INFINITY;
        box[dim + c] = -INFINITY;
        for (int i = 0; i < count; i++) {
            const double *x = xyz + c;
            const int a = i - corners, b = (a + 1) % corners;
            const double v = i < corners ? x[i * dim] : 2 * x[i * dim] - 0.5 * (x[a * dim] + x[b * dim]);
            box[c] = fmin(box[c], v);
            box[dim + c] = fmax(box[dim + c], v);
        }
        double inner = 0;
        for (int i = 0; i < count && count == 8; i++)
            inner += (i < corners ? -0.75 : 1) * xyz[i * dim + c];
        if (count == 8) {
            box[c] = fmin(box[c], inner);
            box[dim + c] = fmax(box[dim + c], inner);
        }
    }
}

static double face_size(const double *xyz, int dim, int corners)
{
    double most = 0;
    for (int i = 0; i < corners; i++) {
        const int j = (i + 1) % corners;
        most = fmax(most, sqrt(uz_distance2(xyz + j * dim, xyz + i * dim, dim)));
    }
    return most;
}

/* A point that looks for what it meets. */
typedef struct {
    const master *m;
    const uz_own_place *own;
    double *back; /* the squared distance of the nearest side that is the back of its own body */
} seeker;

/* May the point x meet this face, whose closest point is the foot? */
static bool may_meet(const seeker *s, int64_t face, const int64_t *node, int nodes, double size, const double *x,
                     const uz_foot *foot)
{
    const uz_own_place *own = s->own;
    const master *m = s->m;
    const int64_t element = m->group->face[face].element;
    const bool may = !own->may || own->may(own->ctx, own->node[0], face);
    double from[3] = {0}, to[3] = {0}, along = 0;
    bool seen = false;
    if (!uz_own_body_same(own->own, own->element, element))
        return may;
    for (int a = 0; a < nodes; a++)
        for (int b = 0; b < own->nodes; b++)
            if (node[a] == own->node[b])
                return false;
    for (int c = 0; c < m->mesh->dim; c++) {
        from[c] = x[c] / m->scale;
        to[c] = (x[c] + foot->point[c]) / m->scale;
        along -= foot->point[c] * foot->normal[c];
    }
    for (int k = 0; k < own->normals && !seen; k++) { /* the two look at each other, or both are behind each other */
        double cosine = 0, ahead = 0;
        for (int c = 0; c < 3; c++) {
            cosine += own->normal[k][c] * foot->normal[c];
            ahead += own->normal[k][c] * foot->point[c];
        }
        ahead = foot->distance2 > ON_BORDER * ON_BORDER * size * size ? (along < 0 ? -ahead : ahead) : size;
        seen = cosine < -SAME_WAY && ahead > SAME_WAY * sqrt(foot->distance2);
    }
    if (!seen)
        return false;
    const uz_way way = along < 0 ? uz_own_body_way(own->own, own->element, from, element, to) : UZ_WAY_OVERLAP;
    if (way == UZ_WAY_BACK)
        *s->back = fmin(*s->back, foot->distance2);
    return may && way == UZ_WAY_OVERLAP;
}

static double distance_to(const void *ctx, int64_t item, const double *x, double best)
{
    static const double ORIGIN[3] = {0};
    const seeker *s = ctx;
    const master *m = s->m;
    const int dim = m->mesh->dim;
    double xyz[3 * UZ_FACE_NODES], box[6];
    int64_t node[UZ_FACE_NODES];
    uz_foot foot;
    const int count = gather(xyz, node, m, item, x);
    box_of(box, xyz, dim, count);
    if (uz_box_distance(box, dim, ORIGIN) > best)
        return INFINITY;
    uz_face_closest(&foot, dim, count, xyz);
    return s->own && !may_meet(s, item, node, count, face_size(xyz, dim, uz_face_corners(dim, count)), x, &foot)
               ? INFINITY
               : foot.distance2;
}

#define OF_BODIES "contact between two bodies"

/* ---------------------------------------------------------------- the border */

/* The place of a node among a face's corners; -1: not there. */
static int corner_of(const master *m, int64_t face, int64_t node)
{
    int64_t of[UZ_FACE_NODES];
    const int corners = uz_face_corners(m->mesh->dim, uz_mesh_face(of, m->mesh, m->group->face[face]));
    for (int i = 0; i < corners; i++)
        if (of[i] == node)
            return i;
    return -1;
}

static int64_t faces_with_edge(const master *m, int64_t a, int64_t b)
{
    int64_t count = 0;
    for (int64_t q = m->around.ptr[a]; q < m->around.ptr[a + 1]; q++)
        count += corner_of(m, m->around.idx[q], b) >= 0;
    return count;
}

/* Does the master end at this node? In 2D where one face has it, in 3D where one of its edges has one face. */
static bool ends_at(const master *m, int64_t node)
{
    if (m->mesh->dim == 2)
        return m->around.ptr[node + 1] - m->around.ptr[node] < 2;
    for (int64_t q = m->around.ptr[node]; q < m->around.ptr[node + 1]; q++) {
        int64_t of[UZ_FACE_NODES];
        const int corners = uz_face_corners(3, uz_mesh_face(of, m->mesh, m->group->face[m->around.idx[q]]));
        const int at = corner_of(m, m->around.idx[q], node);
        if (faces_with_edge(m, node, of[(at + 1) % corners]) < 2)
            return true;
        if (faces_with_edge(m, node, of[(at + corners - 1) % corners]) < 2)
            return true;
    }
    return false;
}

/* ---------------------------------------------------------------- normals */

/* The angle of a face at one of its corners; edges in 2D count alike. */
static double angle_at(const master *m, int64_t face, int64_t node)
{
    static const double ORIGIN[3] = {0};
    double xyz[3 * UZ_FACE_NODES], a[3], b[3], aa = 0, bb = 0, ab = 0;
    int64_t of[UZ_FACE_NODES];
    if (m->mesh->dim == 2)
        return 1;
    const int corners = uz_face_corners(3, gather(xyz, of, m, face, ORIGIN)), at = corner_of(m, face, node);
    for (int c = 0; c < 3; c++) {
        a[c] = xyz[3 * ((at + 1) % corners) + c] - xyz[3 * at + c];
        b[c] = xyz[3 * ((at + corners - 1) % corners) + c] - xyz[3 * at + c];
        aa += a[c] * a[c];
        bb += b[c] * b[c];
        ab += a[c] * b[c];
    }
    return acos(fmin(fmax(ab / sqrt(aa * bb), -1), 1));
}

/* ------------------------------------------------------------------ rows */

/* The normal where the foot is on an edge or a corner of its face. off: x_s - x_m. False: the node is beyond the border
 * of the master. */
static bool normal_between(double normal[3], const master *m, const uz_contact_pair *row, const uz_foot *foot,
                           double size, const double *x, const double off[3])
{
    const int dim = m->mesh->dim, corners = uz_face_corners(dim, row->count);
    const int64_t a = row->master[foot->which];
    const int64_t b = foot->place == UZ_FACE_EDGE ? row->master[(foot->which + 1) % corners] : -1;
    double place[3] = {0}, sum[3] = {0}, one[3] = {0}, apart = 0, along = 0;
    for (int c = 0; c < dim; c++)
        place[c] = x[c] + foot->point[c];
    /* the mean of the faces around corner a, or of those that have the edge a, b (b >= 0) */
    for (int64_t q = m->around.ptr[a]; q < m->around.ptr[a + 1]; q++) {
        uz_foot there;
        const int64_t face = m->around.idx[q];
        if (b >= 0 && corner_of(m, face, b) < 0)
            continue;
        closest_on(&there, m, face, place);
        const double weight = b >= 0 ? 1 : angle_at(m, face, a);
        if (one[0] == 0 && one[1] == 0 && one[2] == 0)
            memcpy(one, there.normal, sizeof one);
        for (int c = 0; c < 3; c++) {
            sum[c] += weight * there.normal[c];
            apart = fmax(apart, fabs(there.normal[c] - one[c]));
        }
    }
    uz_unit_normal(normal, sum, 3);
    for (int c = 0; c < 3; c++)
        along += off[c] * normal[c];
    if (b >= 0 ? faces_with_edge(m, a, b) < 2 : ends_at(m, a)) { /* the master ends there */
        const double beyond = sqrt(fmax(foot->distance2 - along * along, 0));
        return beyond <= UZ_OVERHANG * size;
    }
    if (apart > 1e-12 && foot->distance2 > ON_BORDER * ON_BORDER * size * size)
        for (int c = 0; c < 3; c++)
            normal[c] = along < 0 ? -off[c] : off[c];
    return true;
}

/* Fills all of a row but its node for a point x, scaled; *found false: it faces no part of the master. Returns false
 * where the face has no normal: *row tells which. */
static bool place_on(bool *found, uz_contact_pair *row, const master *m, const double x[3], const uz_own_place *own)
{
    const int dim = m->mesh->dim;
    double off[3], normal[3], xyz[3 * UZ_FACE_NODES], along = 0, back = INFINITY;
    uz_foot foot;
    *found = false;
    memset(row, 0, sizeof *row);
    const double farthest = own && own->farthest > 0 ? own->farthest * m->scale : INFINITY;
    const int64_t nearest =
        uz_box_tree_nearest(&m->tree, x, farthest * farthest, distance_to, &(seeker){m, own, &back});
    if (nearest < 0 && own) {
        row->gap = INFINITY;
        return true;
    }
    row->number = nearest < 0 ? 0 : nearest;
    row->face = m->group->face[row->number];
    row->count = gather(xyz, row->master, m, row->number, x);
    uz_face_closest(&foot, dim, row->count, xyz);
    if (!isfinite(foot.normal[0] + foot.normal[1] + foot.normal[2]))
        return false;
    for (int c = 0; c < 3; c++)
        off[c] = -foot.point[c];
    memcpy(normal, foot.normal, sizeof normal);
    const double size = face_size(xyz, dim, uz_face_corners(dim, row->count));
    row->gap = sqrt(foot.distance2) / m->scale;
    for (int c = 0; c < dim; c++)
        along += off[c] * foot.normal[c];
    if (along < 0 && foot.distance2 > back)
        return true;
    along = 0;
    if (foot.place != UZ_FACE_WITHIN && !normal_between(normal, m, row, &foot, size, x, off))
        return true;
    if (!uz_unit_normal(row->normal, normal, dim))
        return false;
    for (int c = 0; c < dim; c++)
        along += off[c] * row->normal[c];
    row->gap = along / m->scale;
    memcpy(row->local, foot.local, sizeof row->local);
    memcpy(row->weight, foot.weight, sizeof row->weight);
    row->size = size / m->scale;
    *found = true;
    return true;
}

/* Fills the row of one node; *found false: it faces no part of the master. */
static uz_status make_row(bool *found, uz_contact_pair *row, const master *m, const master *slave, int64_t node,
                          int64_t index, const uz_own_place *own, uz_error *err)
{
    enum { MOST_AROUND = 48 };
    double x[3] = {0}, normal[MOST_AROUND][3];
    uz_own_place at = *own;
    for (int c = 0; c < m->mesh->dim; c++)
        x[c] = m->mesh->xyz[node * m->mesh->dim + c] * m->scale;
    at.node = &node;
    at.nodes = 1;
    at.normal = (const double(*)[3])normal;
    const int64_t first = slave->around.ptr[node], end = slave->around.ptr[node + 1];
    const int32_t *around = slave->around.idx;
    for (int64_t q = first; own->own && q < end && at.normals < MOST_AROUND; q++) {
        uz_foot foot;
        closest_on(&foot, slave, around[q], x);
        memcpy(normal[at.normals++], foot.normal, sizeof foot.normal);
        at.element = slave->group->face[around[q]].element;
    }
    if (!place_on(found, row, m, x, own->own ? &at : NULL)) {
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", index, "with"),
                       "the face at node %lld of \"%.63s\" has no area, and so no normal", (long long)row->master[0],
                       m->group->name);
    }
    row->node = node;
    /* Where all faces of the slave around its node look the way the master does, what is behind the master there is
     * the far side of the slave, as of a clamp around a plate, and did not come through it. */
    bool away = *found && row->gap < -ON_BORDER * row->size && end > first;
    for (int64_t q = first; q < end && away; q++) {
        uz_foot foot;
        closest_on(&foot, slave, around[q], x);
        away = uz_dot3(foot.normal, row->normal) > SAME_WAY;
    }
    *found = *found && !away;
    return UZ_OK;
}

uz_status uz_contact_pair_check(const uz_mesh *mesh, const uz_group *on, const uz_group *with, int64_t index,
                                uz_error *err)
{
    if (with->kind != UZ_GROUP_FACES || with->n_faces < 1)
        return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", index, "with"),
                       "\"%.63s\" has no faces; the other body is given by the %s that can be touched", with->name,
                       "edges or faces");
    if (on == with)
        return UZ_OK;
    /* Bodies that have nodes in common hang together there, unless the surface is to touch itself. */
    unsigned char *of_master = uz_alloc_zero(mesh->n_nodes, 1);
    uz_status status = of_master ? UZ_OK : uz_no_memory(err, OF_BODIES);
    for (int64_t f = 0; f < with->n_faces && status == UZ_OK; f++) {
        int64_t node[UZ_FACE_NODES];
        const int count = uz_mesh_face(node, mesh, with->face[f]);
        for (int i = 0; i < count; i++)
            of_master[node[i]] = 1;
    }
    int itself = -1;
    for (int64_t i = 0; i < uz_group_node_count(mesh, on) && status == UZ_OK && itself != 1; i++) {
        if (!of_master[uz_group_node_at(on, i)])
            continue;
        itself = uz_groups_share_face(mesh, on, with);
        if (itself < 0)
            status = uz_no_memory(err, OF_BODIES);
        else if (itself == 0)
            status = uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", index, "on"),
                             "node %lld is in \"%.63s\" and on the faces of \"%.63s\"; the two bodies must have nodes "
                             "of their own where they touch",
                             (long long)uz_group_node_at(on, i), on->name, with->name);
    }
    free(of_master);
    return status;
}

/* middles: also the faces that a node is a middle of; tree: of a master. */
static uz_status prepare(master *m, const uz_mesh *mesh, const uz_group *group, bool middles, bool tree, uz_error *err)
{
    int exponent;
    frexp(mesh->extent, &exponent);
    *m = (master){.mesh = mesh,
                  .group = group,
                  .scale = ldexp(1, exponent < -1000  ? 1000
                                    : exponent > 1000 ? -1000
                                                      : -exponent)};
    int64_t node[UZ_FACE_NODES];
    uz_status status = UZ_OK;
    if (tree) {
        double xyz[3 * UZ_FACE_NODES], *box = uz_alloc(group->n_faces, 6 * sizeof *box);
        for (int64_t i = 0; box && i < group->n_faces; i++)
            box_of(box + 2 * mesh->dim * i, xyz, mesh->dim, gather(xyz, node, m, i, (const double[3]){0}));
        status = box ? uz_box_tree_init(&m->tree, group->n_faces, mesh->dim, box, err) : uz_no_memory(err, OF_BODIES);
        free(box);
    }
    uz_entries all = {.n = 0};
    for (int64_t f = 0; f < group->n_faces; f++) {
        const int nodes = uz_mesh_face(node, mesh, group->face[f]);
        for (int i = 0; i < (middles ? nodes : uz_face_corners(mesh->dim, nodes)); i++)
            uz_entries_add(&all, f, node[i], 0);
    }
    if (status == UZ_OK)
        status = uz_csc_from_entries(&m->around, group->n_faces, mesh->n_nodes, &all, err);
    uz_entries_clear(&all);
    return status;
}

uz_status uz_contact_pairs(uz_contact_pair **out, int64_t *count, const uz_mesh *mesh, const uz_group *on,
                           const uz_group *with, int64_t index, const uz_own_place *own, bool may_miss, uz_error *err)
{
    master m = {.mesh = NULL}, slave = {.mesh = NULL};
    uz_contact_pair *row = NULL;
    *out = NULL;
    *count = 0;
    uz_status status = uz_contact_pair_check(mesh, on, with, index, err);
    if (status != UZ_OK)
        return status;
    row = uz_alloc(uz_group_node_count(mesh, on), sizeof *row);
    status = row ? prepare(&m, mesh, with, false, true, err) : uz_no_memory(err, OF_BODIES);
    if (status == UZ_OK)
        status = prepare(&slave, mesh, on, true, false, err);
    if (status == UZ_OK)
        for (int64_t i = 0; i < uz_group_node_count(mesh, on) && status == UZ_OK; i++) {
            bool found = false;
            status = make_row(&found, &row[*count], &m, &slave, uz_group_node_at(on, i), index, own, err);
            *count += found;
        }
    if (status == UZ_OK && *count == 0 && !may_miss) {
        status =
            uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("contacts", index, "on"),
                    "no node of \"%.63s\" faces \"%.63s\": all of them lie beyond its border", on->name, with->name);
    }
    if (status == UZ_OK)
        *out = row;
    else
        *count = 0;
    if (status != UZ_OK)
        free(row);
    master_clear(&m);
    master_clear(&slave);
    return status;
}

/* ---------------------------------------------------------------- any point */

uz_status uz_faces_new(uz_faces **out, const uz_mesh *mesh, const uz_group *group, uz_error *err)
{
    uz_faces *faces = uz_alloc_zero(1, sizeof *faces);
    *out = NULL;
    const uz_status status = faces ? prepare(faces, mesh, group, false, true, err) : uz_no_memory(err, OF_BODIES);
    if (status == UZ_OK)
        *out = faces;
    else
        uz_faces_free(faces);
    return status;
}

void uz_faces_free(uz_faces *faces)
{
    if (faces)
        master_clear(faces);
    free(faces);
}

bool uz_faces_closest(uz_contact_pair *row, const uz_faces *faces, const double *x, const uz_own_place *own)
{
    bool found;
    double at[3] = {0};
    for (int c = 0; c < faces->mesh->dim; c++)
        at[c] = x[c] * faces->scale;
    return place_on(&found, row, faces, at, own->own ? own : NULL) && found;
}
