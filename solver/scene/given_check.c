/* given_check.c: is every element of a given mesh one that can be computed with? */
#include "scene/given.h"

#include "core/error.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdatomic.h>
#include <stdio.h>

uz_status uz_given_refuse(const uz_given_mesh *given, int64_t element, const char *what, const char *remedy,
                          uz_error *err)
{
    char where[UZ_POINTER], nodes[UZ_ELEMENT_TEXT];
    const char *name = uz_element_name((uz_element_kind)given->kind[element]);
    int64_t before = 0;
    int used = snprintf(nodes, sizeof nodes, "element %lld (%s with nodes", (long long)element, name);
    for (int64_t q = given->first[element]; q < given->first[element + 1]; q++)
        if (used >= 0 && used < UZ_ELEMENT_TEXT)
            used += snprintf(nodes + used, (size_t)(UZ_ELEMENT_TEXT - used), "%s %lld",
                             q > given->first[element] ? "," : "", (long long)given->node[q]);
    if (used >= 0 && used < UZ_ELEMENT_TEXT - 1)
        snprintf(nodes + used, (size_t)(UZ_ELEMENT_TEXT - used), ")");
    for (int64_t e = 0; e < element; e++)
        before += given->kind[e] == given->kind[element];
    snprintf(where, sizeof where, "/mesh/elements/%s/%lld", name, (long long)before);
    return uz_fail(err, UZ_ERR_SCENE, given->from_file ? given->from_file : where, "%s %s; %s", nodes, what, remedy);
}

/* Its kind and its nodes. */
static uz_status check_element(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    const int64_t *node = given->node + given->first[e];
    const int64_t count = given->first[e + 1] - given->first[e];
    const uz_element_kind kind = (uz_element_kind)given->kind[e];
    char text[96];
    if (kind >= UZ_ELEMENT_KINDS || count != uz_element_node_count(kind))
        return uz_fail(err, UZ_ERR_ARGUMENT, "/mesh/elements", "element %lld has no kind, or not the nodes of its kind",
                       (long long)e);
    if (uz_element_type_of(kind)->dim != given->dim) {
        snprintf(text, sizeof text, "/mesh/elements/%s", uz_element_name(kind));
        return uz_fail(err, UZ_ERR_SCENE, text,
                       "%s is an element of bodies in %d dimensions, but the nodes of this mesh have %d coordinates",
                       uz_element_name(kind), uz_element_type_of(kind)->dim, given->dim);
    }
    for (int64_t i = 0; i < count; i++) {
        if (node[i] < 0 || node[i] >= given->n_nodes) {
            snprintf(text, sizeof text, "asks for node %lld, but there are only 0 to %lld", (long long)node[i],
                     (long long)given->n_nodes - 1);
            return uz_given_refuse(given, e, text, "nodes are numbered from 0", err);
        }
        for (int64_t j = 0; j < i; j++)
            if (node[i] == node[j])
                return uz_given_refuse(given, e, "has one node twice",
                                       "an element whose corners fall together is another kind of element", err);
    }
    return UZ_OK;
}

/* As hypot, in a tenth of its time where squares neither overflow nor vanish. */
static double length_of(const double v[3])
{
    const double square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    return square > 1e-200 && square < 1e200 ? sqrt(square) : hypot(hypot(v[0], v[1]), v[2]);
}

/* The determinant of dim tangents. */
static double volume_of(double t[3][3], int dim)
{
    return dim == 2
               ? t[0][0] * t[1][1] - t[0][1] * t[1][0]
               : t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
                     t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
}

/* The sign of the Jacobian of the map from the reference element at a corner; 0 where the volume there is none but for
 * rounding: small against that of its edges.
 *
 * The columns of the Jacobian are the tangents of the edges at the corner: the differences of the ends, or, with a node
 * in the middle of the edge, 4 middle - 3 corner - other end, the derivative of the quadratic through the three. A
 * volume is positive where the tangents, in the order of `next`, are right-handed. */
static int corner_sign(const uz_given_mesh *given, int64_t e, int corner)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)given->kind[e]);
    const int64_t *node = given->node + given->first[e];
    const int dim = given->dim;
    const double *from = given->xyz + node[corner] * dim;
    double t[3][3] = {{0}};
    for (int k = 0; k < dim; k++) {
        const int other = uz_element_type_of(type->linear)->next[corner][k];
        const double *to = given->xyz + node[other] * dim, *mid = NULL;
        double chord[3] = {0, 0, 0};
        for (int m = type->corners; m < type->nodes && !mid; m++) {
            const int *end = type->edge[m - type->corners];
            if ((end[0] == corner && end[1] == other) || (end[0] == other && end[1] == corner))
                mid = given->xyz + node[m] * dim;
        }
        for (int c = 0; c < dim; c++) {
            chord[c] = to[c] - from[c];
            t[k][c] = mid ? 4 * (mid[c] - from[c]) - chord[c] : chord[c];
        }
        const double length = length_of(chord);
        if (!(length > 0) || !isfinite(length))
            return 0;
        for (int c = 0; c < dim; c++)
            t[k][c] /= length;
    }
    const double volume = volume_of(t, dim);
    return volume > 1e-12 ? 1 : volume < -1e-12 ? -1 : 0;
}

/* Is the shape good, as of nearly all it is? Of simplices with straight sides, whose volume is the same at all corners:
 * so far above what corner_sign takes for none that rounding is no matter, by edges of at most twice the longest of
 * those at the first corner. False: it is to be looked at. */
static bool is_plainly_good(const uz_given_mesh *given, int64_t e, const uz_element_type *type)
{
    const int64_t *node = given->node + given->first[e];
    const double *x = given->xyz, *from = x + node[0] * given->dim;
    double t[3][3] = {{0}}, longest = 0;
    if (type->jacobian != UZ_JACOBIAN_CONSTANT)
        return false;
    for (int k = 0; k < given->dim; k++) {
        for (int c = 0; c < given->dim; c++)
            t[k][c] = x[node[k + 1] * given->dim + c] - from[c];
        const double square = t[k][0] * t[k][0] + t[k][1] * t[k][1] + t[k][2] * t[k][2];
        longest = square > longest ? square : longest;
    }
    const double volume = volume_of(t, given->dim), most = 4 * longest * (given->dim == 2 ? 1 : 2 * sqrt(longest));
    return longest > 1e-90 && longest < 1e90 && volume > 1e-9 * most;
}

static uz_status check_shape(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)given->kind[e]);
    const int corners = type->corners;
    if (is_plainly_good(given, e, type))
        return UZ_OK;
    int negative = 0, worst = -1;
    char what[96];
    for (int i = 0; i < corners; i++) {
        const int sign = corner_sign(given, e, i);
        negative += sign < 0;
        if (sign == 0) {
            snprintf(what, sizeof what, "has no %s at its node %lld", given->dim == 2 ? "area" : "volume",
                     (long long)given->node[given->first[e] + i]);
            return uz_given_refuse(given, e, what, "move its nodes apart, or leave it out", err);
        }
        worst = sign < 0 && worst < 0 ? i : worst;
    }
    if (negative == corners && !given->from_file)
        return uz_given_refuse(given, e, "is inverted", uz_element_type_of(type->linear)->mirrored, err);
    if (negative == corners)
        return uz_given_refuse(given, e, "is inverted",
                               given->dim == 2
                                   ? "its nodes run clockwise: turn the surface over (ReverseMesh Surface in Gmsh)"
                                   : "its nodes are those of its mirror image: orient the volume anew in Gmsh",
                               err);
    if (negative == 0)
        return UZ_OK;
    snprintf(what, sizeof what, "is concave or twisted at its node %lld",
             (long long)given->node[given->first[e] + worst]);
    return uz_given_refuse(given, e, what, "its nodes are in a wrong order, or it must be split", err);
}

/* Elements as the threads that check them see them. */
typedef struct {
    const uz_given_mesh *given;
    atomic_int_fast64_t first; /* that is none, so far */
} checking;

static uz_status check(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    const uz_status status = check_element(given, e, err);
    return status == UZ_OK ? check_shape(given, e, err) : status;
}

static void look_for_first(void *ctx, int64_t begin, int64_t end)
{
    checking *x = ctx;
    for (int64_t e = begin; e < end; e++) {
        int_fast64_t first = atomic_load_explicit(&x->first, memory_order_relaxed);
        if (e >= first)
            return;
        if (check(x->given, e, NULL) == UZ_OK)
            continue;
        while (e < first && !atomic_compare_exchange_weak(&x->first, &first, e))
            ;
        return;
    }
}

uz_status uz_given_check(const uz_given_mesh *given, int dim, uz_error *err)
{
    char where[UZ_POINTER];
    const char *nodes = given->from_file ? given->from_file : "/mesh/nodes";
    if (given->dim != dim)
        return uz_fail(err, UZ_ERR_SCENE, nodes, "this is a mesh in %d dimensions; its model is %s", given->dim,
                       given->dim == 3 ? "solid" : "plane_stress, plane_strain or axisymmetric");
    if (given->n_nodes < 1 || given->n_elements < 1)
        return uz_fail(err, UZ_ERR_SCENE, given->from_file ? nodes : "/mesh/elements", "the mesh has no element");
    if (given->n_nodes > UZ_SCENE_MAX_DOFS / dim)
        return uz_fail(err, UZ_ERR_SCENE, nodes, "%lld nodes are more than %d unknowns; use a coarser mesh",
                       (long long)given->n_nodes, UZ_SCENE_MAX_DOFS);
    for (int64_t i = 0; i < given->n_nodes * dim; i++)
        if (!isfinite(given->xyz[i])) {
            snprintf(where, sizeof where, "/mesh/nodes/%lld/%d", (long long)(i / dim), (int)(i % dim));
            return uz_fail(err, UZ_ERR_NOT_FINITE, given->from_file ? given->from_file : where,
                           "a coordinate of node %lld is not a finite number", (long long)(i / dim));
        }
    checking x = {.given = given, .first = given->n_elements};
    uz_by_pieces(look_for_first, &x, given->n_elements);
    return x.first < given->n_elements ? check(given, x.first, err) : UZ_OK;
}
