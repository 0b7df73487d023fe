/* given_check.c: is every element of a given mesh one that can be computed with? */
#include "scene/given.h"

#include "core/error.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- who is meant */

void uz_given_element_place(char where[UZ_POINTER], const uz_given_mesh *given, int64_t element)
{
    int64_t before = 0;
    if (given->from_file) {
        snprintf(where, UZ_POINTER, "/mesh/gmsh");
        return;
    }
    for (int64_t e = 0; e < element; e++)
        before += given->kind[e] == given->kind[element];
    snprintf(where, UZ_POINTER, "/mesh/elements/%s/%lld", uz_element_name((uz_element_kind)given->kind[element]),
             (long long)before);
}

void uz_given_element_text(char text[UZ_ELEMENT_TEXT], const uz_given_mesh *given, int64_t element)
{
    int used = snprintf(text, UZ_ELEMENT_TEXT, "element %lld (%s with nodes", (long long)element,
                        uz_element_name((uz_element_kind)given->kind[element]));
    for (int64_t q = given->first[element]; q < given->first[element + 1]; q++)
        if (used >= 0 && used < UZ_ELEMENT_TEXT)
            used += snprintf(text + used, (size_t)(UZ_ELEMENT_TEXT - used), "%s %lld",
                             q > given->first[element] ? "," : "", (long long)given->node[q]);
    if (used >= 0 && used < UZ_ELEMENT_TEXT - 1)
        snprintf(text + used, (size_t)(UZ_ELEMENT_TEXT - used), ")");
}

static uz_status refuse_element(const uz_given_mesh *given, int64_t element, const char *what, const char *remedy,
                                uz_error *err)
{
    char where[UZ_POINTER], text[UZ_ELEMENT_TEXT];
    uz_given_element_place(where, given, element);
    uz_given_element_text(text, given, element);
    return uz_fail(err, UZ_ERR_SCENE, where, "%s %s; %s", text, what, remedy);
}

/* ---- numbers */

static uz_status check_coordinates(const uz_given_mesh *given, uz_error *err)
{
    char where[UZ_POINTER];
    for (int64_t i = 0; i < given->n_nodes * given->dim; i++) {
        if (isfinite(given->xyz[i]))
            continue;
        snprintf(where, sizeof where, "/mesh/nodes/%lld/%d", (long long)(i / given->dim), (int)(i % given->dim));
        return uz_fail(err, UZ_ERR_NOT_FINITE, given->from_file ? "/mesh/gmsh" : where,
                       "a coordinate of node %lld is not a finite number", (long long)(i / given->dim));
    }
    return UZ_OK;
}

static uz_status check_nodes(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    const int64_t *node = given->node + given->first[e];
    const int count = (int)(given->first[e + 1] - given->first[e]);
    char what[96];
    for (int i = 0; i < count; i++) {
        if (node[i] < 0 || node[i] >= given->n_nodes) {
            snprintf(what, sizeof what, "asks for node %lld, but there are only 0 to %lld", (long long)node[i],
                     (long long)given->n_nodes - 1);
            return refuse_element(given, e, what, "nodes are numbered from 0", err);
        }
        for (int j = 0; j < i; j++)
            if (node[i] == node[j])
                return refuse_element(given, e, "has one node twice",
                                      "an element whose corners fall together is another kind of element", err);
    }
    return UZ_OK;
}

static uz_status check_kind(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    char where[UZ_POINTER];
    const uz_element_kind kind = (uz_element_kind)given->kind[e];
    if (kind >= UZ_ELEMENT_KINDS || given->first[e + 1] - given->first[e] != uz_element_node_count(kind))
        return uz_fail(err, UZ_ERR_ARGUMENT, "/mesh/elements", "element %lld has no kind, or not the nodes of its kind",
                       (long long)e);
    if (uz_element_dim(kind) == given->dim)
        return UZ_OK;
    snprintf(where, sizeof where, "/mesh/elements/%s", uz_element_name(kind));
    return uz_fail(err, UZ_ERR_SCENE, where,
                   "%s is an element of bodies in %d dimensions, but the nodes of this mesh have %d coordinates",
                   uz_element_name(kind), uz_element_dim(kind), given->dim);
}

/* ---- shapes: the Jacobian of the map from the reference element, at each corner
 *
 * Its columns are the tangents of the edges at the corner: the differences of the ends, or, with a node in the middle
 * of the edge, 4 middle - 3 corner - other end, the derivative of the quadratic through the three. A volume is
 * positive where the tangents, in the order below, are right-handed. */

/* The node in the middle of the edge between two corners; -1: none. */
static int middle_node(const uz_element_type *type, int a, int b)
{
    for (int m = type->corners; m < type->nodes; m++) {
        const int *end = type->edge[m - type->corners];
        if ((end[0] == a && end[1] == b) || (end[0] == b && end[1] == a))
            return m;
    }
    return -1;
}

/* The tangent of the edge from a to b at a. */
static double tangent(double out[3], const uz_given_mesh *given, int64_t e, int a, int b)
{
    const int64_t *node = given->node + given->first[e];
    const int dim = given->dim, m = middle_node(uz_element_type_of((uz_element_kind)given->kind[e]), a, b);
    const double *from = given->xyz + node[a] * dim, *to = given->xyz + node[b] * dim;
    const double *mid = m < 0 ? NULL : given->xyz + node[m] * dim;
    double chord[3] = {0, 0, 0};
    for (int c = 0; c < dim; c++) {
        chord[c] = to[c] - from[c];
        out[c] = mid ? 4 * (mid[c] - from[c]) - chord[c] : chord[c];
    }
    return hypot(hypot(chord[0], chord[1]), dim == 3 ? chord[2] : 0);
}

static double determinant(double t[3][3], int dim)
{
    if (dim == 2)
        return t[0][0] * t[1][1] - t[0][1] * t[1][0];
    return t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
           t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
}

/* 1, -1, or 0 where the volume at the corner is none but for rounding: small against that of its edges. */
static int corner_sign(const uz_given_mesh *given, int64_t e, int corner)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)given->kind[e]);
    const int *next = uz_element_type_of(type->linear)->next[corner];
    double t[3][3] = {{0}};
    for (int k = 0; k < given->dim; k++) {
        const double length = tangent(t[k], given, e, corner, next[k]);
        if (!(length > 0) || !isfinite(length))
            return 0;
        for (int c = 0; c < given->dim; c++)
            t[k][c] /= length;
    }
    const double volume = determinant(t, given->dim);
    return volume > 1e-12 ? 1 : volume < -1e-12 ? -1 : 0;
}

static uz_status check_shape(const uz_given_mesh *given, int64_t e, uz_error *err)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)given->kind[e]);
    const int corners = type->corners;
    int negative = 0, worst = -1;
    char what[96];
    for (int i = 0; i < corners; i++) {
        const int sign = corner_sign(given, e, i);
        negative += sign < 0;
        if (sign == 0) {
            snprintf(what, sizeof what, "has no %s at its node %lld", given->dim == 2 ? "area" : "volume",
                     (long long)given->node[given->first[e] + i]);
            return refuse_element(given, e, what, "move its nodes apart, or leave it out", err);
        }
        worst = sign < 0 && worst < 0 ? i : worst;
    }
    if (negative == corners && !given->from_file)
        return refuse_element(given, e, "is inverted", uz_element_type_of(type->linear)->mirrored, err);
    if (negative == corners)
        return refuse_element(given, e, "is inverted",
                              given->dim == 2
                                  ? "its nodes run clockwise: turn the surface over (ReverseMesh Surface in Gmsh)"
                                  : "its nodes are those of its mirror image: orient the volume anew in Gmsh",
                              err);
    if (negative == 0)
        return UZ_OK;
    snprintf(what, sizeof what, "is concave or twisted at its node %lld",
             (long long)given->node[given->first[e] + worst]);
    return refuse_element(given, e, what, "its nodes are in a wrong order, or it must be split", err);
}

uz_status uz_given_check(const uz_given_mesh *given, uz_error *err)
{
    uz_status status = check_coordinates(given, err);
    for (int64_t e = 0; e < given->n_elements && status == UZ_OK; e++) {
        status = check_kind(given, e, err);
        if (status == UZ_OK)
            status = check_nodes(given, e, err);
        if (status == UZ_OK)
            status = check_shape(given, e, err);
    }
    return status;
}
