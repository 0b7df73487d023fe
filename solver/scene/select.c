/* select.c: named parts of a mesh by where they are: ranges, planes, round surfaces, directions, the nearest node. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/order.h"
#include "core/vector3.h"
#include "scene/corner_table.h"
#include "scene/mesh.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A coordinate of a file has six digits or more. */
static const double TOLERANCE = 1e-6;

/* One selection at work. */
typedef struct {
    const uz_mesh *mesh;
    const uz_selection *s;
    double plane_normal[3], axis[3], facing[3]; /* unit vectors, as far as `by` asks for them */
    double tolerance, cosine;
    const uz_corner_table *sides;
    uz_error *err;
} selecting;

static uz_status begin(selecting *w, const uz_mesh *mesh, const uz_selection *s, uz_error *err)
{
    const struct {
        unsigned by;
        const double *given;
        double *unit;
        const char *what;
    } DIRECTIONS[] = {{UZ_SELECT_PLANE, s->plane_normal, w->plane_normal, "the normal of the plane"},
                      {UZ_SELECT_CYLINDER, s->axis, w->axis, "the axis of the cylinder"},
                      {UZ_SELECT_FACING, s->facing, w->facing, "the direction of the normal"}};
    w->mesh = mesh;
    w->s = s;
    w->err = err;
    w->tolerance = s->tolerance > 0 ? s->tolerance : TOLERANCE * mesh->extent;
    w->cosine = cos(s->within * acos(-1.0) / 180.0);
    for (size_t i = 0; i < sizeof DIRECTIONS / sizeof DIRECTIONS[0]; i++)
        if ((s->by & DIRECTIONS[i].by) && !uz_unit_normal(DIRECTIONS[i].unit, DIRECTIONS[i].given, mesh->dim))
            return uz_fail(err, UZ_ERR_SCENE, s->place, "%s must be a direction, not zero", DIRECTIONS[i].what);
    return UZ_OK;
}

/* ---- how far a point is from where the selection is */

static double from_range(const selecting *w, const double *x)
{
    double far = 0;
    for (int c = 0; c < w->mesh->dim; c++)
        far = fmax(far, fmax(w->s->low[c] - x[c], x[c] - w->s->high[c]));
    return far;
}

static double from_plane(const selecting *w, const double *x)
{
    double along = 0;
    for (int c = 0; c < w->mesh->dim; c++)
        along += (x[c] - w->s->plane_point[c]) * w->plane_normal[c];
    return fabs(along);
}

static double from_round(const selecting *w, const double *x)
{
    double length = 0;
    for (int c = 0; c < w->mesh->dim; c++)
        length = hypot(length, x[c] - w->s->centre[c]);
    return fabs(length - w->s->radius);
}

static double from_cylinder(const selecting *w, const double *x)
{
    double arm[3], across[3];
    for (int c = 0; c < 3; c++)
        arm[c] = x[c] - w->s->axis_point[c];
    uz_cross3(across, w->axis, arm);
    return fabs(sqrt(uz_dot3(across, across)) - w->s->axis_radius);
}

static double distance(const selecting *w, const double *x)
{
    static const struct {
        unsigned by;
        double (*from)(const selecting *w, const double *x);
    } CONDITIONS[] = {{UZ_SELECT_RANGE, from_range},
                      {UZ_SELECT_PLANE, from_plane},
                      {UZ_SELECT_ROUND, from_round},
                      {UZ_SELECT_CYLINDER, from_cylinder}};
    double far = 0;
    for (size_t i = 0; i < sizeof CONDITIONS / sizeof CONDITIONS[0]; i++)
        if (w->s->by & CONDITIONS[i].by)
            far = fmax(far, CONDITIONS[i].from(w, x));
    return far;
}

static bool is_there(const selecting *w, int64_t node)
{
    return distance(w, w->mesh->xyz + node * w->mesh->dim) <= w->tolerance;
}

/* ---- sides */

/* Does the side look where it shall? From its corners: an edge has the body on its left, a face's normal by the right
 * hand is outward. */
static bool faces_there(const selecting *w, const int64_t *node, int corners)
{
    const double *x[4] = {NULL};
    double one[3] = {0}, other[3] = {0}, normal[3];
    if (!(w->s->by & UZ_SELECT_FACING))
        return true;
    for (int i = 0; i < corners; i++)
        x[i] = w->mesh->xyz + node[i] * w->mesh->dim;
    if (w->mesh->dim == 2) {
        normal[0] = x[1][1] - x[0][1];
        normal[1] = x[0][0] - x[1][0];
        normal[2] = 0;
    } else {
        for (int c = 0; c < 3; c++) {
            one[c] = x[corners == 4 ? 2 : 1][c] - x[0][c]; /* of four corners the diagonals */
            other[c] = x[corners - 1][c] - x[corners == 4 ? 1 : 0][c];
        }
        uz_cross3(normal, one, other);
    }
    uz_unit3(normal);
    return uz_dot3(normal, w->facing) >= w->cosine - 1e-12;
}

/* A middle node of a straight side is not on what is round, so that the corners alone tell. */
static bool side_is_there(const selecting *w, uz_face face)
{
    int64_t node[UZ_FACE_NODES];
    const int nodes = uz_mesh_face(node, w->mesh, face);
    const int corners = uz_element_type_of((uz_element_kind)w->mesh->kind[face.element])->side[face.side].corners;
    const int asked = w->s->by & (UZ_SELECT_ROUND | UZ_SELECT_CYLINDER) ? corners : nodes;
    for (int i = 0; i < asked; i++)
        if (!is_there(w, node[i]))
            return false;
    return faces_there(w, node, corners);
}

/* Outer sides: those of one element only. */
static uz_status select_sides(uz_group *out, const selecting *w)
{
    const uz_corner_table *sides = w->sides;
    int64_t faces = 0, places = 0; /* room for them */
    for (int64_t i = 0; i < sides->count; i++) {
        const uz_face side = uz_corner_table_item(sides, i);
        int64_t node[UZ_FACE_NODES];
        if (sides->same[i] || sides->same[i + 1] || !side_is_there(w, side))
            continue;
        const int n = uz_mesh_face(node, w->mesh, side);
        if (!uz_grow(&out->face, out->n_faces, 1, &faces, sizeof *out->face) ||
            !uz_grow(&out->node, out->n_nodes, n, &places, sizeof *out->node))
            return uz_no_memory(w->err, "the groups of a scene");
        out->face[out->n_faces++] = side;
        memcpy(out->node + out->n_nodes, node, (size_t)n * sizeof *node);
        out->n_nodes += n;
    }
    if (out->n_faces == 0)
        return UZ_OK;
    out->kind = UZ_GROUP_FACES;
    qsort(out->face, (size_t)out->n_faces, sizeof *out->face, uz_face_order);
    out->n_nodes = uz_sort_unique(out->node, out->n_nodes);
    return UZ_OK;
}

/* ---- nodes and elements */

static uz_status select_nodes(uz_group *out, const selecting *w)
{
    const uz_mesh *mesh = w->mesh;
    double best = INFINITY;
    out->node = uz_alloc(mesh->n_nodes, sizeof *out->node);
    if (!out->node)
        return uz_no_memory(w->err, "the groups of a scene");
    out->kind = UZ_GROUP_NODES;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        double far = 0;
        if (!is_there(w, i))
            continue;
        for (int c = 0; c < mesh->dim && (w->s->by & UZ_SELECT_NEAREST); c++)
            far = hypot(far, mesh->xyz[i * mesh->dim + c] - w->s->nearest[c]);
        if (!(w->s->by & UZ_SELECT_NEAREST) || far < best) {
            best = far;
            out->n_nodes = w->s->by & UZ_SELECT_NEAREST ? 0 : out->n_nodes;
            out->node[out->n_nodes++] = i;
        }
    }
    return UZ_OK;
}

static uz_status select_elements(uz_group *out, const selecting *w)
{
    const uz_mesh *mesh = w->mesh;
    int64_t places = 0; /* room for them */
    out->element = uz_alloc(mesh->n_elements, sizeof *out->element);
    if (!out->element)
        return uz_no_memory(w->err, "the groups of a scene");
    out->kind = UZ_GROUP_ELEMENTS;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        double middle[3] = {0};
        for (int k = 0; k < corners; k++)
            for (int c = 0; c < mesh->dim; c++)
                middle[c] += mesh->xyz[mesh->node[mesh->first[e] + k] * mesh->dim + c] / corners;
        if (!(distance(w, middle) <= w->tolerance))
            continue;
        const int64_t *node = mesh->node + mesh->first[e], n = mesh->first[e + 1] - mesh->first[e];
        if (!uz_grow(&out->node, out->n_nodes, n, &places, sizeof *out->node))
            return uz_no_memory(w->err, "the groups of a scene");
        out->element[out->n_elements++] = e;
        memcpy(out->node + out->n_nodes, node, (size_t)n * sizeof *node);
        out->n_nodes += n;
    }
    out->n_nodes = uz_sort_unique(out->node, out->n_nodes);
    return UZ_OK;
}

/* ---- the whole */

/* "(1, 2, 3)" */
static void print_point(char out[96], const double *x, int dim)
{
    size_t used = 0;
    for (int c = 0; c < dim; c++)
        used += (size_t)snprintf(out + used, 96 - used, "%s%.9g", c ? ", " : "(", x[c]);
    snprintf(out + used, 96 - used, ")");
}

/* Nothing is there: says how far off the nearest node is, and where the body is. */
static uz_status refuse_nothing(const selecting *w)
{
    static const char *const WHAT[][2] = {{"no node", "no node"},
                                          {"no outer edge", "no outer face"},
                                          {"no node", "no node"},
                                          {"no middle of an element", "no middle of an element"}};
    const uz_mesh *mesh = w->mesh;
    const bool elements = w->s->kind == UZ_SELECT_ELEMENTS;
    const int dim = mesh->dim;
    double low[3], high[3], far = INFINITY;
    char at[96], from[96], to[96];
    int64_t nearest = 0;
    for (int64_t i = 0; i < mesh->n_nodes; i++) {
        const double *x = mesh->xyz + i * dim, d = distance(w, x);
        for (int c = 0; c < dim; c++) {
            low[c] = i == 0 ? x[c] : fmin(low[c], x[c]);
            high[c] = i == 0 ? x[c] : fmax(high[c], x[c]);
        }
        if (d < far) {
            far = d;
            nearest = i;
        }
    }
    const char *what = WHAT[w->s->by & UZ_SELECT_FACING ? UZ_SELECT_SIDES : w->s->kind][dim - 2];
    print_point(at, mesh->xyz + nearest * dim, dim);
    print_point(from, low, dim);
    print_point(to, high, dim);
    if (far <= w->tolerance)
        return uz_fail(w->err, UZ_ERR_SCENE, w->s->place, "%s lies there%s, though nodes do, such as %lld at %s; %s",
                       what,
                       w->s->by & UZ_SELECT_FACING ? " and looks that way"
                       : elements                  ? ""
                                                   : " whole",
                       (long long)nearest, at, elements ? "widen it" : "ask for \"of\": \"nodes\", or widen it");
    return uz_fail(
        w->err, UZ_ERR_SCENE, w->s->place,
        "%s lies there: the nearest node, %lld at %s, is %.3g away (the tolerance is %.3g); the body reaches "
        "from %s to %s",
        what, (long long)nearest, at, far, w->tolerance, from, to);
}

static uz_status select_one(uz_group *out, const selecting *w)
{
    const uz_selection *s = w->s;
    const bool nodes_only = s->kind == UZ_SELECT_NODES || (s->by & UZ_SELECT_NEAREST);
    uz_status status = UZ_OK;
    memcpy(out->name, s->name, sizeof out->name);
    if (s->kind == UZ_SELECT_ELEMENTS)
        status = select_elements(out, w);
    else if (!nodes_only)
        status = select_sides(out, w);
    if (status == UZ_OK && out->n_nodes == 0 && !(s->by & UZ_SELECT_FACING) &&
        (nodes_only || s->kind == UZ_SELECT_WHAT_IS_THERE))
        status = select_nodes(out, w);
    return status == UZ_OK && out->n_nodes == 0 ? refuse_nothing(w) : status;
}

uz_status uz_mesh_select(uz_mesh *mesh, const uz_scene *scene, uz_error *err)
{
    uz_corner_table sides = {.count = 0};
    uz_group *groups = uz_realloc(mesh->groups, mesh->n_groups + scene->n_selections, sizeof *groups);
    if (!groups)
        return uz_no_memory(err, "the groups of a scene");
    mesh->groups = groups;
    uz_status status = uz_corner_table_build(&sides, mesh, true, err);
    for (int64_t i = 0; i < scene->n_selections && status == UZ_OK; i++) {
        const uz_selection *s = &scene->selections[i];
        selecting w = {.sides = &sides};
        if (uz_mesh_group(mesh, s->name, "", NULL)) {
            status = uz_fail(err, UZ_ERR_SCENE, s->place,
                             "the mesh has a group \"%.63s\" already; give this one another name", s->name);
            break;
        }
        uz_group *out = &mesh->groups[mesh->n_groups];
        *out = (uz_group){.n_nodes = 0};
        status = begin(&w, mesh, s, err);
        if (status == UZ_OK)
            status = select_one(out, &w);
        mesh->n_groups++;
    }
    uz_corner_table_clear(&sides);
    return status;
}
