/* subdivide.c: local refinement of quadrilaterals and hexahedra into 4 or 8 of their kind; of wedges into 8, all of
 * them at once.
 *
 * Beside a divided element an undivided one keeps its whole edges and faces, and the nodes that lie amid them hang:
 * what the whole one's shape functions say there is where they go, which keeps displacements continuous. An element is
 * divided only once no edge or face of it is half, or a quarter, of one that another element still has whole; else that
 * one is divided first. So no edge or face meets less than its half or quarter, and the nodes that a hanging one lies
 * amid are corners or middles of an element whose neighbours around them are no coarser than that: they do not hang
 * themselves (docs/theory.md). Rheinboldt and Mesztenyi, ACM Trans. Math. Softw. 6 (1980) 166-187, have the rule in the
 * plane.
 *
 * New nodes lie where the element's own map puts them, by its shape functions, and elements with curved edges go on
 * with the halves of those curves. */
#include "scene/subdivide.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/refinement.h"

#include <stdlib.h>
#include <string.h>

enum { NODES = UZ_ELEMENT_NODES, SIDES = UZ_ELEMENT_SIDES, WEDGE = 6 };

/* A part of an element that was given, its root: the whole of it at first; and of one before this round. */
typedef struct {
    int64_t node[NODES], root, part_of;
    signed char side[SIDES]; /* the root's that each of its own is part of, -1: none */
    bool due;
} cell;

typedef struct {
    uz_refinement all;
    const uz_element_type *type;
    const int (*edge)[2]; /* of the type: its ends */
    int edges;
    cell *cells;
    int64_t count, room;
} subdivision;

static bool begin(subdivision *x, uz_mesh *mesh);
static void divide(subdivision *x, int64_t e);
static void publish(subdivision *x);

static bool is_of_one(const uz_mesh *mesh, int corners)
{
    bool one = uz_element_type_of((uz_element_kind)mesh->kind[0])->corners == corners;
    for (int64_t e = 1; e < mesh->n_elements && one; e++)
        one = mesh->kind[e] == mesh->kind[0];
    return one;
}

bool uz_mesh_can_subdivide(const uz_mesh *mesh)
{
    return is_of_one(mesh, 1 << mesh->dim);
}

bool uz_mesh_can_subdivide_all(const uz_mesh *mesh)
{
    return uz_mesh_can_subdivide(mesh) || is_of_one(mesh, WEDGE);
}

uz_status uz_mesh_subdivide(uz_mesh *mesh, const int64_t *marked, int64_t n, uz_error *err)
{
    subdivision x = {.count = 0};
    if (!uz_mesh_can_subdivide_all(mesh))
        return uz_fail(err, UZ_ERR_SCENE, "/mesh/refine",
                       "only meshes of quadrilaterals, hexahedra or wedges of one type can be subdivided");
    bool listed = n > 0 && marked[0] == UZ_SUBDIVIDED;
    x.all.failed = !begin(&x, mesh);
    for (int64_t i = 1; i < n && listed && !x.all.failed && !x.all.too_many; i += 1 + marked[i]) {
        listed = marked[i] >= 0 && marked[i] < n - i && (x.type->corners != WEDGE || marked[i] == x.count);
        for (int64_t e = 0; e < x.count; e++)
            x.cells[e].part_of = e;
        for (int64_t k = i + 1; listed && k <= i + marked[i]; k++) {
            listed = marked[k] >= 0 && marked[k] < x.count;
            if (listed)
                x.cells[marked[k]].due = true;
        }
        for (int64_t k = i + 1; listed && k <= i + marked[i] && !x.all.failed && !x.all.too_many; k++)
            if (x.cells[marked[k]].due) /* else it was divided before another one */
                divide(&x, marked[k]);
    }
    if (listed && !x.all.too_many)
        publish(&x);
    free(x.cells);
    return uz_refinement_end(&x.all, listed, err);
}

/* ---- edges and faces */

static int64_t edge_of(subdivision *x, const int64_t *node, int k)
{
    return uz_refinement_link(&x->all, (int64_t[2]){node[x->edge[k][0]], node[x->edge[k][1]]}, 2);
}

/* Of a hexahedron or a wedge. */
static int64_t face_of(subdivision *x, const int64_t *node, int s)
{
    const uz_element_side *side = &x->type->side[s];
    int64_t corner[UZ_LINK_NODES];
    for (int k = 0; k < side->corners; k++)
        corner[k] = node[side->node[k]];
    return uz_refinement_link(&x->all, corner, side->corners);
}

static int faces(const subdivision *x)
{
    return x->type->dim == 3 ? x->type->sides : 0;
}

/* Has an element that had it an edge or a face still? */
static bool has_link(subdivision *x, int64_t e, int64_t link)
{
    bool has = false;
    for (int k = 0; k < x->edges && !has; k++)
        has = edge_of(x, x->cells[e].node, k) == link;
    for (int s = 0; s < faces(x) && !has; s++)
        has = face_of(x, x->cells[e].node, s) == link;
    return has;
}

/* Lists an element with its edges and faces, of which quadratic types have middles of edges. */
static void list_links(subdivision *x, int64_t e)
{
    const int64_t *node = x->cells[e].node;
    const int corners = x->type->corners;
    for (int k = 0; k < x->edges && !x->all.failed; k++) {
        const int64_t at = edge_of(x, node, k);
        if (!x->all.failed && x->type->nodes > corners)
            x->all.links[at].middle = node[corners + k];
        if (!x->all.failed)
            uz_refinement_use(&x->all, at, e);
    }
    for (int s = 0; s < faces(x) && !x->all.failed; s++) {
        const int64_t at = face_of(x, node, s);
        if (!x->all.failed)
            uz_refinement_use(&x->all, at, e);
    }
}

static bool begin(subdivision *x, uz_mesh *mesh)
{
    x->type = uz_element_type_of((uz_element_kind)mesh->kind[0]);
    const uz_element_type *edged = uz_element_type_of(mesh->dim == 2              ? UZ_QUAD8
                                                      : x->type->corners == WEDGE ? UZ_WEDGE15
                                                                                  : UZ_HEX20);
    x->edge = edged->edge;
    x->edges = edged->nodes - edged->corners;
    x->count = x->room = mesh->n_elements;
    x->cells = uz_alloc(x->count, sizeof *x->cells);
    if (!uz_refinement_begin(&x->all, mesh) || !x->cells)
        return false;
    for (int64_t e = 0; e < x->count; e++) {
        cell *own = &x->cells[e];
        *own = (cell){.root = e};
        memcpy(own->node, mesh->node + mesh->first[e], (size_t)x->type->nodes * sizeof *own->node);
        for (int s = 0; s < x->type->sides; s++)
            own->side[s] = (signed char)s;
        list_links(x, e);
    }
    return !x->all.failed;
}

/* ---- one division */

/* Divides the elements that have the whole of which a link is a part. */
static void divide_whole(subdivision *x, int64_t link)
{
    const int64_t whole = x->all.failed ? -1 : x->all.links[link].whole;
    for (int64_t u = whole < 0 ? -1 : x->all.links[whole].users; u >= 0; u = x->all.users[u].before) {
        const int64_t e = x->all.users[u].element;
        if (has_link(x, e, whole) && !x->all.failed && !x->all.too_many)
            divide(x, e);
    }
}

/* The parts of an element are one at each corner, half as large, in its order, and of a wedge one between those at the
 * corners of either triangle, turned by half a turn. The first corner of the element on the side where a part is: */
static int beside(const uz_element_type *type, int part)
{
    return part < type->corners ? part : 3 * (part - type->corners);
}

/* Does the side of a part lie in the same side of the element? */
static bool is_in_side(const uz_element_type *type, int part, int s)
{
    const int at = beside(type, part);
    bool in = false;
    for (int k = 0; k < type->side[s].corners; k++)
        in = in || type->side[s].node[k] == at;
    return in && (part < type->corners || type->side[s].corners == 3);
}

/* The node at the place of a local node of a part of an element. `part` has those before it; *centre: the node amid the
 * element, -1: not made yet. */
static int64_t node_of_part(subdivision *x, const int64_t *node, int which, int local, const int64_t *part,
                            int64_t *centre)
{
    const uz_element_type *type = x->type;
    double point[3] = {0}, N[NODES], share[NODES];
    int64_t from[NODES], *known = NULL, made;
    int count = 0, corners = 0;
    for (int c = 0; c < type->dim; c++)
        point[c] = which < type->corners || c == 2 ? 0.5 * (type->local[local][c] + type->local[beside(type, which)][c])
                                                   : 0.5 * (1 - type->local[local][c]);
    type->shape(type, N, NULL, point);
    for (int a = 0; a < type->nodes; a++) { /* all of these are sums of powers of 2: zeros are exact */
        if (N[a] == 0)
            continue;
        share[count] = N[a];
        from[count++] = node[a];
        corners += a < type->corners;
    }
    if (count == 1)
        return from[0];
    if (local < type->corners && corners == type->corners) { /* the element itself */
        known = centre;
    } else {
        const int *ends = local < type->corners ? NULL : x->edge[local - type->corners];
        const int64_t link = ends ? uz_refinement_link(&x->all, (int64_t[2]){part[ends[0]], part[ends[1]]}, 2)
                                  : uz_refinement_link(&x->all, from, corners);
        known = x->all.failed ? NULL : &x->all.links[link].middle;
    }
    if (!known || *known >= 0)
        return known ? *known : 0;
    made = uz_refinement_node(&x->all, from, share, count);
    *known = made;
    return made;
}

static void divide(subdivision *x, int64_t e)
{
    const uz_element_type *type = x->type;
    const cell whole = x->cells[e];
    int64_t edge[12], face[SIDES], centre = -1;
    for (int k = 0; k < x->edges; k++)
        divide_whole(x, edge[k] = edge_of(x, whole.node, k));
    for (int s = 0; s < faces(x); s++)
        divide_whole(x, face[s] = face_of(x, whole.node, s));
    for (int p = 0; p < 1 << type->dim && !x->all.failed && !x->all.too_many; p++) {
        const int64_t at = p == 0 ? e : x->count;
        cell part = {.root = whole.root, .part_of = whole.part_of};
        for (int k = 0; k < type->nodes; k++)
            part.node[k] = node_of_part(x, whole.node, p, k, part.node, &centre);
        for (int s = 0; s < type->sides; s++) {
            const bool on = is_in_side(type, p, s);
            part.side[s] = on ? whole.side[s] : (signed char)-1;
            const int64_t link = on && type->dim == 3 ? face_of(x, part.node, s) : -1;
            if (link >= 0 && !x->all.failed)
                x->all.links[link].whole = face[s];
        }
        for (int k = 0; k < x->edges; k++) {
            const bool on = x->edge[k][0] == p || x->edge[k][1] == p; /* of parts amid others none is */
            const int64_t link = on ? edge_of(x, part.node, k) : -1;
            if (link >= 0 && !x->all.failed)
                x->all.links[link].whole = edge[k];
        }
        if (at == x->count && !uz_grow(&x->cells, x->count, 1, &x->room, sizeof *x->cells))
            x->all.failed = true;
        if (x->all.failed || x->all.too_many)
            return;
        x->cells[at] = part;
        x->count += at == x->count;
        list_links(x, at);
    }
    for (int k = 0; k < x->edges && !x->all.failed; k++)
        x->all.links[edge[k]].split = true;
    for (int s = 0; s < faces(x) && !x->all.failed; s++)
        x->all.links[face[s]].split = true;
}

/* ---- the refined mesh */

/* The middle of the edge between two nodes hangs. */
static void hang(subdivision *x, unsigned char *hangs, int64_t a, int64_t b)
{
    const int64_t at = uz_refinement_link(&x->all, (int64_t[2]){a, b}, 2);
    if (!x->all.failed)
        hangs[x->all.links[at].middle] = 1;
}

/* What lies amid the edges and faces that elements have whole, and others in parts. */
static bool mark_hanging(subdivision *x, unsigned char *hangs)
{
    const bool quadratic = x->type->nodes > x->type->corners;
    bool any = false;
    for (int64_t e = 0; e < x->count; e++) {
        const int64_t *node = x->cells[e].node;
        for (int k = 0; k < x->edges; k++) {
            const uz_link *link = &x->all.links[edge_of(x, node, k)];
            const int64_t middle = link->middle;
            if (!link->split || x->all.failed)
                continue;
            any = true;
            if (!quadratic)
                hangs[middle] = 1;
            for (int end = 0; end < 2 && quadratic; end++)
                hang(x, hangs, node[x->edge[k][end]], middle);
        }
        for (int s = 0; s < faces(x); s++) {
            const uz_element_side *side = &x->type->side[s];
            const uz_link *link = &x->all.links[face_of(x, node, s)];
            const int64_t middle = link->middle;
            if (!link->split || x->all.failed)
                continue;
            any = true;
            hangs[middle] = 1;
            for (int k = side->corners; k < side->nodes; k++)
                hang(x, hangs, node[side->node[k]], middle);
        }
    }
    return any;
}

static void publish(subdivision *x)
{
    const int nodes = x->type->nodes;
    uz_mesh fine = {.n_elements = x->count,
                    .kind = uz_alloc(x->count, sizeof *fine.kind),
                    .first = uz_alloc(x->count + 1, sizeof *fine.first),
                    .node = uz_alloc(x->count * nodes, sizeof *fine.node),
                    .part_of = uz_alloc(x->count, sizeof *fine.part_of),
                    .hangs = uz_alloc_zero(x->all.nodes, sizeof *fine.hangs)};
    int64_t *root = uz_alloc(x->count, sizeof *root);
    signed char *side = uz_alloc(x->count * SIDES, sizeof *side);
    x->all.failed =
        x->all.failed || !fine.kind || !fine.first || !fine.node || !fine.hangs || !fine.part_of || !root || !side;
    for (int64_t e = 0; e < x->count && !x->all.failed; e++) {
        fine.kind[e] = x->all.mesh->kind[0];
        fine.first[e] = e * nodes;
        memcpy(fine.node + e * nodes, x->cells[e].node, (size_t)nodes * sizeof *fine.node);
        fine.first[e + 1] = (e + 1) * nodes;
        root[e] = x->cells[e].root;
        fine.part_of[e] = x->cells[e].part_of;
        memcpy(side + e * SIDES, x->cells[e].side, SIDES);
    }
    if (!x->all.failed && !mark_hanging(x, fine.hangs)) {
        free(fine.hangs);
        fine.hangs = NULL;
    }
    uz_refinement_publish(&x->all, &fine, root, side);
    uz_free_all(root, side);
}
