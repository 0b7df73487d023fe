#include "picture/skin.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "scene/corner_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -------------------------------------------------------------------- cells */

/* Appends one cell whose nodes come corners first. Room is there. */
static void add_cell(uz_skin *skin, const int64_t *node, int corners, int count)
{
    int64_t *out = skin->point + skin->first[skin->n_cells];
    const bool quadratic = count > corners;
    for (int i = 0; i < corners; i++) {
        out[quadratic ? 2 * i : i] = node[i];
        if (quadratic)
            out[2 * i + 1] = node[corners + i];
    }
    skin->first[skin->n_cells + 1] = skin->first[skin->n_cells] + (quadratic ? 2 * corners : corners);
    skin->n_cells++;
}

uz_status uz_skin_build(uz_skin *out, const uz_mesh *mesh, const uz_hooks *hooks, uz_error *err)
{
    const bool solid = mesh->dim == 3;
    uz_group outer = {.n_faces = 0};
    memset(out, 0, sizeof *out);
    uz_status status = solid ? uz_outer_sides(&outer, mesh, err) : UZ_OK;
    const int64_t cells = solid ? outer.n_faces : mesh->n_elements;
    if (status == UZ_OK && solid && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the surface was found");
    if (status == UZ_OK) {
        out->first = uz_alloc_zero(cells + 1, sizeof *out->first);
        out->point = uz_alloc(solid ? UZ_CELL_POINTS * cells : mesh->first[cells], sizeof *out->point);
        if (!out->first || !out->point)
            status = uz_no_memory(err, UZ_OF_SKIN);
    }
    for (int64_t e = 0; status == UZ_OK && !solid && e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        add_cell(out, node, uz_element_type_of((uz_element_kind)mesh->kind[e])->corners, count);
    }
    for (int64_t i = 0; status == UZ_OK && i < outer.n_faces; i++) {
        int64_t node[UZ_FACE_NODES];
        const uz_face side = outer.face[i];
        const int count = uz_mesh_face(node, mesh, side);
        add_cell(out, node, uz_element_type_of((uz_element_kind)mesh->kind[side.element])->side[side.side].corners,
                 count);
    }
    free(outer.face);
    if (status != UZ_OK)
        uz_skin_clear(out);
    return status;
}

void uz_skin_clear(uz_skin *skin)
{
    uz_free_all(skin->first, skin->point);
    memset(skin, 0, sizeof *skin);
}

int uz_cell_triangles(const int (**triangle)[3], int points)
{
    static const int TRI[][3] = {{0, 1, 2}}, QUAD[][3] = {{0, 1, 2}, {0, 2, 3}};
    static const int TRI_MIDDLES[][3] = {{0, 1, 5}, {1, 2, 3}, {5, 3, 4}, {1, 3, 5}};
    static const int QUAD_MIDDLES[][3] = {{0, 1, 7}, {1, 2, 3}, {3, 4, 5}, {5, 6, 7}, {1, 3, 5}, {1, 5, 7}};
    *triangle = points == 3 ? TRI : points == 4 ? QUAD : points == 6 ? TRI_MIDDLES : QUAD_MIDDLES;
    return points == 3 ? 1 : points == 4 ? 2 : points == 6 ? 4 : 6;
}

/* -------------------------------------------------------------------- edges */

/* An edge as one cell has it, in the bucket of its lower corner. */
typedef struct {
    int64_t high, middle, cell; /* middle: -1 where there is none */
} half_edge;

typedef struct {
    const uz_skin *skin;
    int64_t *start;  /* n_nodes + 1: bucket of node i is half[start[i]..start[i + 1]) */
    half_edge *half; /* count */
    int64_t count;
    double *normal; /* solids: n_cells x 3, of unit length */
} edge_work;

/* Counts the edges into start[low + 1], or, if `place`, puts them where start[low] says. */
static void walk_edges(edge_work *w, bool place)
{
    for (int64_t i = 0; i < w->skin->n_cells; i++) {
        const int64_t *point = w->skin->point + w->skin->first[i];
        const int n = (int)(w->skin->first[i + 1] - w->skin->first[i]), step = n > 4 ? 2 : 1;
        for (int k = 0; k < n; k += step) {
            const int64_t a = point[k], b = point[(k + step) % n];
            const int64_t low = a < b ? a : b;
            if (place)
                w->half[w->start[low]++] = (half_edge){a < b ? b : a, step == 2 ? point[k + 1] : -1, i};
            else
                w->start[low + 1]++;
        }
    }
}

static int compare_halves(const void *a, const void *b)
{
    const half_edge *x = a, *y = b;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return (x->cell > y->cell) - (x->cell < y->cell);
}

static uz_status prepare_edges(edge_work *w, const uz_mesh *mesh, uz_error *err)
{
    enum { FEW = 16 };
    w->start = uz_alloc_zero(mesh->n_nodes + 1, sizeof *w->start);
    if (!w->start)
        return uz_no_memory(err, UZ_OF_SKIN);
    walk_edges(w, false);
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        w->start[i + 1] += w->start[i];
    w->count = w->start[mesh->n_nodes];
    w->half = uz_alloc(w->count, sizeof *w->half);
    w->normal = mesh->dim == 3 ? uz_alloc(3 * w->skin->n_cells, sizeof *w->normal) : NULL;
    if (!w->half || (mesh->dim == 3 && !w->normal))
        return uz_no_memory(err, UZ_OF_SKIN);
    walk_edges(w, true);
    memmove(w->start + 1, w->start, (size_t)mesh->n_nodes * sizeof *w->start); /* placing moved each on */
    w->start[0] = 0;
    /* Few edges begin at a node of a regular mesh; at the hub of a wheel all of them may. */
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        half_edge *half = w->half + w->start[a];
        const int64_t count = w->start[a + 1] - w->start[a];
        if (count > FEW)
            qsort(half, (size_t)count, sizeof *half, compare_halves);
        for (int64_t i = 1; count <= FEW && i < count; i++) {
            const half_edge moved = half[i];
            int64_t j = i;
            for (; j > 0 && compare_halves(&half[j - 1], &moved) > 0; j--)
                half[j] = half[j - 1];
            half[j] = moved;
        }
    }
    /* Normals of cells by Newell's sum over their corners (I. Sutherland et al., ACM Computing Surveys 6 (1974) 1). */
    for (int64_t i = 0; w->normal && i < w->skin->n_cells; i++) {
        const int64_t *point = w->skin->point + w->skin->first[i], n = w->skin->first[i + 1] - w->skin->first[i];
        double *normal = memset(w->normal + 3 * i, 0, 3 * sizeof *normal), length = 0;
        for (int64_t k = 0, step = n > 4 ? 2 : 1; k < n; k += step) {
            const double *o = mesh->xyz + 3 * point[0], *p = mesh->xyz + 3 * point[k],
                         *q = mesh->xyz + 3 * point[(k + step) % n];
            for (int c = 0; c < 3; c++) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                normal[c] += (p[d] - o[d]) * (q[e] - o[e]) - (p[e] - o[e]) * (q[d] - o[d]);
            }
        }
        for (int c = 0; c < 3; c++)
            length = hypot(length, normal[c]);
        for (int c = 0; c < 3 && length > 0; c++)
            normal[c] /= length;
    }
    return UZ_OK;
}

/* line NULL: only counts. */
static int64_t put_edge(int64_t *line, int64_t n, int64_t low, const half_edge *edge)
{
    const int64_t path[3] = {low, edge->middle >= 0 ? edge->middle : edge->high, edge->high};
    const int pieces = edge->middle >= 0 ? 2 : 1;
    for (int i = 0; line && i < pieces; i++) {
        line[2 * (n + i)] = path[i];
        line[2 * (n + i) + 1] = path[i + 1];
    }
    return n + pieces;
}

static void collect_edges(uz_skin_edges *out, const edge_work *w, int64_t n_nodes)
{
    static const double COSINE = 0.8; /* of 37 degrees */
    out->n_lines = out->n_outline = 0;
    for (int64_t low = 0; low < n_nodes; low++)
        for (int64_t i = w->start[low], next; i < w->start[low + 1]; i = next) {
            for (next = i + 1; next < w->start[low + 1] && w->half[next].high == w->half[i].high;)
                next++;
            out->n_lines = put_edge(out->line, out->n_lines, low, &w->half[i]);
            /* Does the edge that these cells share belong to the outline? */
            bool border = next - i != 2;
            if (w->normal && !border) {
                const double *a = w->normal + 3 * w->half[i].cell, *b = w->normal + 3 * w->half[i + 1].cell;
                border = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < COSINE;
            }
            if (border)
                out->n_outline = put_edge(out->outline, out->n_outline, low, &w->half[i]);
        }
}

uz_status uz_skin_edges_build(uz_skin_edges *out, const uz_skin *skin, const uz_mesh *mesh, uz_error *err)
{
    edge_work w = {.skin = skin};
    memset(out, 0, sizeof *out);
    uz_status status = prepare_edges(&w, mesh, err);
    if (status == UZ_OK) {
        collect_edges(out, &w, mesh->n_nodes); /* counts */
        out->line = uz_alloc(2 * out->n_lines, sizeof *out->line);
        out->outline = uz_alloc(2 * out->n_outline, sizeof *out->outline);
        if (!out->line || !out->outline)
            status = uz_no_memory(err, UZ_OF_SKIN);
        else
            collect_edges(out, &w, mesh->n_nodes);
    }
    uz_free_all(w.start, w.half, w.normal);
    if (status != UZ_OK)
        uz_skin_edges_clear(out);
    return status;
}

void uz_skin_edges_clear(uz_skin_edges *edges)
{
    uz_free_all(edges->line, edges->outline);
    memset(edges, 0, sizeof *edges);
}
