#include "scene/mesh_parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "element/element_type.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct uz_own_body {
    const uz_mesh *mesh;
    int64_t *part;           /* of each node */
    int64_t *first, *around; /* elements around each node */
    int64_t *seen;           /* n_elements: the last question in which it was on the way */
    int64_t *queue;          /* n_elements */
    int64_t questions;
};

int64_t uz_join_root(int64_t *of, int64_t a)
{
    while (of[a] != a)
        a = of[a] = of[of[a]]; /* halves the path on its way */
    return a;
}

void uz_join(int64_t *of, int64_t a, int64_t b)
{
    a = uz_join_root(of, a);
    b = uz_join_root(of, b);
    of[a > b ? a : b] = a > b ? b : a;
}

int64_t uz_mesh_number_parts(int64_t *part, const uz_mesh *mesh)
{
    int64_t count = 0, *parent = NULL;
    if (mesh->uniform) { /* a box */
        memset(part, 0, (size_t)mesh->n_nodes * sizeof *part);
        return mesh->n_nodes > 0;
    }
    if (!(parent = uz_alloc(mesh->n_nodes, sizeof *parent)))
        return -1;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        parent[a] = a;
    for (int64_t e = 0; e < mesh->n_elements; e++)
        for (int64_t i = mesh->first[e] + 1; i < mesh->first[e + 1]; i++)
            uz_join(parent, mesh->node[i], mesh->node[mesh->first[e]]);
    for (int64_t a = 0; a < mesh->n_nodes; a++) /* a root is met before its followers */
        part[a] = parent[a] == a ? count++ : part[uz_join_root(parent, a)];
    free(parent);
    return count;
}

uz_status uz_own_body_new(uz_own_body **out, const uz_mesh *mesh, const uz_group *one, const uz_group *other,
                          uz_error *err)
{
    uz_own_body *own = uz_alloc_zero(1, sizeof *own);
    *out = NULL;
    if (own)
        own->part = uz_alloc(mesh->n_nodes, sizeof *own->part);
    const int64_t parts = own && own->part ? uz_mesh_number_parts(own->part, mesh) : -1;
    unsigned char *has = parts >= 0 ? uz_alloc_zero(parts, 1) : NULL; /* a face of `one` */
    const bool room = has != NULL;
    bool shared = false;
    for (int64_t i = 0; i < one->n_faces && room; i++)
        has[own->part[mesh->node[mesh->first[one->face[i].element]]]] = 1;
    for (int64_t i = 0; i < other->n_faces && room && !shared; i++)
        shared = has[own->part[mesh->node[mesh->first[other->face[i].element]]]];
    free(has);
    if (room && !shared) {
        uz_own_body_free(own);
        return UZ_OK;
    }
    if (room) {
        own->mesh = mesh;
        own->first = uz_alloc(mesh->n_nodes + 1, sizeof *own->first);
        own->around = uz_alloc(mesh->first[mesh->n_elements], sizeof *own->around);
        own->seen = uz_alloc_zero(mesh->n_elements, sizeof *own->seen);
        own->queue = uz_alloc(mesh->n_elements, sizeof *own->queue);
    }
    if (!room || !own->first || !own->around || !own->seen || !own->queue) {
        uz_own_body_free(own);
        return uz_no_memory(err, "contact of a body with itself");
    }
    uz_mesh_list_around(own->first, own->around, mesh);
    *out = own;
    return UZ_OK;
}

void uz_own_body_free(uz_own_body *own)
{
    if (!own)
        return;
    uz_free_all(own->part, own->first, own->around, own->seen, own->queue, own);
}

/* Does the straight way from x to y meet the box around an element? Curved edges leave the box of the nodes by no more
 * than middles are off their chords, faces between four such edges by no more than four times that: the hull of their
 * Bezier points. */
static bool is_on_way(const uz_mesh *mesh, int64_t element, const double *x, const double *y)
{
    int count;
    const int64_t *node = uz_mesh_element(mesh, element, &count);
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[element]);
    double from = 0, to = 1;
    for (int c = 0; c < mesh->dim; c++) {
        const double *at = mesh->xyz + c;
        double low = INFINITY, high = -INFINITY, bulge = 0;
        for (int a = 0; a < count; a++) {
            const int *end = a < type->corners ? NULL : type->edge[a - type->corners];
            const double t = at[node[a] * mesh->dim];
            low = fmin(low, t);
            high = fmax(high, t);
            if (end)
                bulge = fmax(bulge, fabs(t - 0.5 * (at[node[end[0]] * mesh->dim] + at[node[end[1]] * mesh->dim])));
        }
        const double margin = 1e-6 * (high - low) + (mesh->dim == 3 ? 4 : 1) * bulge, way = y[c] - x[c];
        low -= margin + x[c];
        high += margin - x[c];
        if (fabs(way) <= margin) { /* along the box */
            if (low > fmax(way, 0) || high < fmin(way, 0))
                return false;
            continue;
        }
        from = fmax(from, fmin(low / way, high / way));
        to = fmin(to, fmax(low / way, high / way));
    }
    return from <= to;
}

bool uz_own_body_same(const uz_own_body *own, int64_t from, int64_t to)
{
    return own &&
           own->part[own->mesh->node[own->mesh->first[from]]] == own->part[own->mesh->node[own->mesh->first[to]]];
}

/* Goes from element to element on the way from x to y. Returns whether it meets `to`; *reached: is there an element
 * around y? */
static bool walk(bool *reached, uz_own_body *own, int64_t from, const double *x, int64_t to, const double *y)
{
    const uz_mesh *mesh = own->mesh;
    int64_t n = 0, next = 0;
    *reached = false;
    own->queue[n++] = from;
    own->seen[from] = ++own->questions;
    for (; next < n && own->queue[next] != to; next++) {
        *reached = *reached || is_on_way(mesh, own->queue[next], y, y);
        for (int64_t q = mesh->first[own->queue[next]]; q < mesh->first[own->queue[next] + 1]; q++)
            for (int64_t k = own->first[mesh->node[q]]; k < own->first[mesh->node[q] + 1]; k++) {
                const int64_t e = own->around[k];
                if (own->seen[e] == own->questions)
                    continue;
                own->seen[e] = own->questions;
                if (is_on_way(mesh, e, x, y))
                    own->queue[n++] = e;
            }
    }
    return next < n;
}

uz_way uz_own_body_way(uz_own_body *own, int64_t from, const double *x, int64_t to, const double *y)
{
    bool there, back;
    if (!uz_own_body_same(own, from, to))
        return UZ_WAY_OVERLAP;
    if (walk(&there, own, from, x, to, y))
        return UZ_WAY_BACK;
    walk(&back, own, to, y, from, x);
    return there && back ? UZ_WAY_OVERLAP : UZ_WAY_APART;
}
