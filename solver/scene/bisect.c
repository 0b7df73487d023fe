/* bisect.c: local refinement of triangles, quadrilaterals and tetrahedra by bisection.
 *
 * Each element has one edge that is halved next. In the plane it is the edge opposite the newest node (Mitchell, ACM
 * Trans. Math. Softw. 15 (1989) 326-347), in space that of Arnold, Mukherjee and Pouly, "Locally adapted tetrahedral
 * meshes using bisection", SIAM J. Sci. Comput. 22 (2000) 431-448: each face has a marked edge, inherited by what is
 * left of the face, and the marks say which edge comes next. Elements as they are given begin with the longest edge of
 * each face, the lesser node numbers where two are as long, so that neighbours agree. Both ways give elements of
 * finitely many shapes for each one that was given, and both end when they are repeated until no element has a node
 * amid one of its edges that is not its own.
 *
 * A quadrilateral is cut along its shorter diagonal into two triangles first, where it is marked or an edge of it was
 * halved; others stay.
 *
 * Elements with nodes amid their edges are refined as what their corners are; the node amid a halved edge becomes a
 * corner, and new nodes lie where the element's own map puts the middles of the halves. */
#include "scene/bisect.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/corner_table.h"

#include <stdlib.h>
#include <string.h>

enum { CORNERS = 4, FROM = UZ_BISECT_FROM };

/* A part of an element that was given, its root: the whole of it at first. Sets of corners are bits. */
typedef struct {
    int64_t corner[CORNERS], root;
    int corners;
    bool quadratic;              /* its root has nodes amid its edges */
    unsigned char split;         /* ends of the edge that is halved next */
    unsigned char mark[CORNERS]; /* in space: ends of the marked edge of the face opposite each corner */
    bool flag;                   /* in space: of Arnold, Mukherjee and Pouly */
    signed char side[CORNERS];   /* side of the root that the side opposite each corner is part of, -1: none; of
                                  * quadrilaterals the sides themselves */
    unsigned char due;           /* bisections that are still to be made */
} piece;

typedef struct {
    int64_t low, high; /* nodes */
    int64_t middle;    /* node amid it, -1: none */
    int64_t users;     /* last entry of the list of elements that have or had it, -1: none */
    bool split;
} edge;

typedef struct {
    int64_t element, before;
} user;

typedef struct {
    uz_mesh *mesh; /* as it was */
    int dim;
    piece *part;
    edge *edges;
    user *users;
    double *xyz;
    int64_t *from;  /* FROM for each new node */
    int64_t *waits; /* elements that may have a halved edge */
    int64_t *table; /* by hash of their ends: 1 + number of an edge, 0: none */
    int64_t parts, n_edges, n_users, nodes, n_waits, slots;
    int64_t room_parts, room_edges, room_users, room_nodes, room_waits;
    bool failed, too_many; /* no memory; more unknowns than a scene may have */
} bisection;

static bool begin(bisection *x, uz_mesh *mesh);
static void cut(bisection *x, int64_t e);
static void bisect(bisection *x, int64_t e);
static void conform(bisection *x);
static uz_status publish(bisection *x, uz_error *err);

uz_status uz_mesh_check_bisection(const uz_mesh *mesh, uz_error *err)
{
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        if (type->dim == 3 && type->corners != 4)
            return uz_fail(err, UZ_ERR_SCENE, "/mesh/refine",
                           "%s elements can't be bisected; mesh the body with %s, or leave out \"refine\"", type->name,
                           type->nodes > type->corners ? "tet10" : "tet4 or tet10");
    }
    return UZ_OK;
}

uz_status uz_mesh_bisect(uz_mesh *mesh, const int64_t *marked, int64_t n, uz_error *err)
{
    bisection x = {.mesh = mesh, .dim = mesh->dim};
    uz_status status = uz_mesh_check_bisection(mesh, err);
    if (status != UZ_OK || n == 0)
        return status;
    bool listed = true;
    x.failed = !begin(&x, mesh);
    for (int64_t i = 0; i < n && listed && !x.failed && !x.too_many; i += 1 + marked[i]) {
        listed = marked[i] >= 0 && marked[i] < n - i;
        for (int64_t k = i + 1; listed && k <= i + marked[i]; k++) {
            listed = marked[k] >= 0 && marked[k] < x.parts;
            if (!listed)
                break;
            x.part[marked[k]].due = (unsigned char)x.dim;
            if (x.part[marked[k]].corners > x.dim + 1)
                cut(&x, marked[k]);
        }
        for (int due = x.dim; listed && due > 0; due--) {
            const int64_t parts = x.parts;
            for (int64_t e = 0; e < parts && !x.failed && !x.too_many; e++)
                if (x.part[e].due >= due)
                    bisect(&x, e);
            conform(&x);
        }
    }
    if (!listed)
        status = uz_fail(err, UZ_ERR_ARGUMENT, "/mesh/refine",
                         "a list of elements to be bisected names one that is "
                         "not there");
    else if (x.too_many)
        status =
            uz_fail(err, UZ_ERR_LIMIT, "/mesh/refine", "a refined mesh has more than %d unknowns", UZ_SCENE_MAX_DOFS);
    else
        status = publish(&x, err);
    if (x.failed)
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory to refine a mesh of %lld elements", (long long)mesh->n_elements);
    free(x.part);
    free(x.edges);
    free(x.users);
    free(x.xyz);
    free(x.from);
    free(x.waits);
    free(x.table);
    return status;
}

double uz_bisected_value(const int64_t *of, const double *value, int stride)
{
    /* Halves of an edge: of the line through its ends, of the parabola through ends and middle at a quarter. The line
     * from an edge's middle to the opposite corner: the quadratic function of the side halfway along it. The middle of
     * a quadrilateral: that of its map. */
    static const double WEIGHT[FROM + 1][FROM] = {[2] = {0.5, 0.5},
                                                  [3] = {0.375, -0.125, 0.75},
                                                  [5] = {-0.125, -0.125, 0.25, 0.5, 0.5},
                                                  [8] = {-0.25, -0.25, -0.25, -0.25, 0.5, 0.5, 0.5, 0.5}};
    int count = 0;
    double sum = 0;
    while (count < FROM && of[count] >= 0)
        count++;
    for (int k = 0; k < count; k++)
        sum += WEIGHT[count][k] * value[of[k] * stride];
    return sum;
}

/* ---- nodes and edges */

/* Room for one more of `count` items; false: none. */
static bool grow(void *array, int64_t *room, int64_t count, size_t size)
{
    void *items;
    if (count < *room)
        return true;
    const int64_t more = *room + *room / 2 + 64;
    memcpy(&items, array, sizeof items); /* a pointer to whatever it has */
    items = uz_realloc(items, more, size);
    if (!items)
        return false;
    memcpy(array, &items, sizeof items);
    *room = more;
    return true;
}

/* A node amid others, of which -1 are none. */
static int64_t add_node(bisection *x, const int64_t from[FROM])
{
    const int64_t new = x->nodes - x->mesh->n_nodes, room = x->room_nodes;
    if (x->nodes >= UZ_SCENE_MAX_DOFS / x->dim)
        x->too_many = true;
    if (x->too_many || x->failed)
        return 0;
    if (x->nodes >= room) {
        x->room_nodes = room + room / 2 + 64;
        double *xyz = uz_realloc(x->xyz, x->room_nodes * x->dim, sizeof *xyz);
        x->xyz = xyz ? xyz : x->xyz;
        int64_t *all = uz_realloc(x->from, (x->room_nodes - x->mesh->n_nodes) * FROM, sizeof *all);
        x->from = all ? all : x->from;
        x->failed = !xyz || !all;
        if (x->failed)
            return 0;
    }
    memcpy(x->from + new *FROM, from, FROM * sizeof *from);
    for (int c = 0; c < x->dim; c++)
        x->xyz[x->nodes * x->dim + c] = uz_bisected_value(from, x->xyz + c, x->dim);
    return x->nodes++;
}

/* Of the mixer of Steele, Lea and Flood, OOPSLA 2014. */
static uint64_t hash_of(int64_t low, int64_t high)
{
    uint64_t z = (uint64_t)low * 0x9e3779b97f4a7c15u + (uint64_t)high;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

/* The edge between two nodes, made where it is not there; number 0 where there is no memory. */
static int64_t edge_of(bisection *x, int64_t a, int64_t b)
{
    const int64_t low = a < b ? a : b, high = a < b ? b : a;
    if (2 * (x->n_edges + 1) > x->slots) {
        const int64_t slots = x->slots > 0 ? 2 * x->slots : 1024;
        int64_t *table = uz_alloc_zero(slots, sizeof *table);
        for (int64_t i = 0; table && i < x->n_edges; i++) {
            uint64_t at = hash_of(x->edges[i].low, x->edges[i].high);
            while (table[at & (uint64_t)(slots - 1)])
                at++;
            table[at & (uint64_t)(slots - 1)] = i + 1;
        }
        x->failed = x->failed || !table;
        if (!table)
            return 0;
        free(x->table);
        x->table = table;
        x->slots = slots;
    }
    for (uint64_t at = hash_of(low, high);; at++) {
        int64_t *slot = &x->table[at & (uint64_t)(x->slots - 1)];
        if (*slot && x->edges[*slot - 1].low == low && x->edges[*slot - 1].high == high)
            return *slot - 1;
        if (*slot)
            continue;
        if (!grow(&x->edges, &x->room_edges, x->n_edges, sizeof *x->edges)) {
            x->failed = true;
            return 0;
        }
        x->edges[x->n_edges] = (edge){low, high, -1, -1, false};
        *slot = ++x->n_edges;
        return x->n_edges - 1;
    }
}

/* Is there an edge between two corners, i > j? */
static bool has_edge(const bisection *x, const piece *part, int i, int j)
{
    return part->corners == x->dim + 1 || i == j + 1 || (i == 3 && j == 0);
}

static void await(bisection *x, int64_t e)
{
    if (grow(&x->waits, &x->room_waits, x->n_waits, sizeof *x->waits))
        x->waits[x->n_waits++] = e;
    else
        x->failed = true;
}

/* Lists an element with those of its edges that have a corner of the set; it waits, as some may be halved. */
static void list_edges(bisection *x, int64_t e, int with)
{
    await(x, e);
    for (int i = 0; i < x->part[e].corners; i++)
        for (int j = 0; j < i; j++) {
            if (!((1 << i | 1 << j) & with) || !has_edge(x, &x->part[e], i, j))
                continue;
            const int64_t at = edge_of(x, x->part[e].corner[i], x->part[e].corner[j]);
            if (x->failed || !grow(&x->users, &x->room_users, x->n_users, sizeof *x->users)) {
                x->failed = true;
                return;
            }
            x->users[x->n_users] = (user){e, x->edges[at].users};
            x->edges[at].users = x->n_users++;
        }
}

/* ---- elements as they are given */

/* The longest edge among corners of the set, as a set. */
static unsigned char longest(const bisection *x, const piece *part, int among)
{
    int best = 0;
    double most = -1;
    int64_t low = 0, high = 0;
    for (int i = 0; i < part->corners; i++)
        for (int j = 0; j < i; j++) {
            const int64_t a = part->corner[i] < part->corner[j] ? part->corner[i] : part->corner[j],
                          b = part->corner[i] + part->corner[j] - a;
            double length = 0;
            if ((1 << i | 1 << j) & ~among)
                continue;
            for (int c = 0; c < x->dim; c++) {
                const double way = x->xyz[a * x->dim + c] - x->xyz[b * x->dim + c];
                length += way * way;
            }
            if (length < most || (length <= most && (a > low || (a == low && b > high))))
                continue;
            most = length;
            low = a;
            high = b;
            best = 1 << i | 1 << j;
        }
    return (unsigned char)best;
}

static bool begin(bisection *x, uz_mesh *mesh)
{
    const int all = (1 << (x->dim + 1)) - 1;
    x->nodes = x->room_nodes = mesh->n_nodes;
    x->parts = x->room_parts = mesh->n_elements;
    x->xyz = uz_alloc(mesh->n_nodes * x->dim, sizeof *x->xyz);
    x->part = uz_alloc(x->parts, sizeof *x->part);
    if (!x->xyz || !x->part)
        return false;
    memcpy(x->xyz, mesh->xyz, (size_t)(mesh->n_nodes * x->dim) * sizeof *x->xyz);
    for (int64_t e = 0; e < x->parts && !x->failed; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        piece *part = &x->part[e];
        *part = (piece){.root = e, .corners = type->corners, .quadratic = type->nodes > type->corners};
        memcpy(part->corner, node, (size_t)type->corners * sizeof *node);
        for (int s = 0; s < type->sides; s++) {
            int opposite = type->corners > x->dim + 1 ? 1 << s : all;
            for (int k = 0; k < type->side[s].corners && type->corners == x->dim + 1; k++)
                opposite &= ~(1 << type->side[s].node[k]);
            for (int i = 0; i < type->corners; i++)
                if (opposite == 1 << i)
                    part->side[i] = (signed char)s;
        }
        part->split = longest(x, part, type->corners == x->dim + 1 ? all : 0);
        for (int i = 0; i <= x->dim && x->dim == 3; i++)
            part->mark[i] = longest(x, part, all & ~(1 << i));
        list_edges(x, e, (1 << type->corners) - 1);
        for (int k = type->corners; k < type->nodes && !x->failed; k++) {
            const int *ends = type->edge[k - type->corners];
            const int64_t at = edge_of(x, node[ends[0]], node[ends[1]]);
            if (!x->failed)
                x->edges[at].middle = node[k];
        }
    }
    return !x->failed;
}

/* ---- one bisection */

/* A quadrilateral becomes two triangles, both as due as it was. */
static void cut(bisection *x, int64_t e)
{
    const piece whole = x->part[e];
    double length[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < x->dim; c++) {
            const double way = x->xyz[whole.corner[k] * x->dim + c] - x->xyz[whole.corner[k + 2] * x->dim + c];
            length[k] += way * way;
        }
    const int i = length[1] < length[0] ? 1 : 0;
    const int64_t at = edge_of(x, whole.corner[i], whole.corner[i + 2]);
    if (!x->failed && whole.quadratic && x->edges[at].middle < 0) {
        int64_t from[FROM];
        for (int k = 0; k < 4; k++) {
            from[k] = whole.corner[k];
            from[4 + k] = x->edges[edge_of(x, whole.corner[k], whole.corner[(k + 1) % 4])].middle;
        }
        x->edges[at].middle = add_node(x, from);
    }
    if (x->failed || x->too_many || !grow(&x->part, &x->room_parts, x->parts, sizeof *x->part)) {
        x->failed = x->failed || !x->too_many;
        return;
    }
    for (int k = 0; k < 2; k++) { /* from corner i on, over the next two */
        piece *half = &x->part[k == 0 ? e : x->parts];
        const int next = (i + 1 + k) % 4, last = (i + 2 + k) % 4;
        *half = (piece){.root = whole.root, .corners = 3, .quadratic = whole.quadratic, .due = whole.due};
        half->corner[0] = whole.corner[i];
        half->corner[1] = whole.corner[next];
        half->corner[2] = whole.corner[last];
        half->side[0] = whole.side[next];
        half->side[1] = k == 0 ? (signed char)-1 : whole.side[last];
        half->side[2] = k == 0 ? whole.side[i] : (signed char)-1;
        half->split = longest(x, half, 7);
    }
    list_edges(x, e, 7);
    list_edges(x, x->parts++, 7);
}

/* Halves an edge: its number. Its elements wait to be looked at. */
static int64_t halve(bisection *x, int64_t a, int64_t b, bool quadratic)
{
    const int64_t at = edge_of(x, a, b);
    if (x->failed)
        return 0;
    if (x->edges[at].middle < 0)
        x->edges[at].middle = add_node(x, (int64_t[FROM]){a, b, -1});
    const int64_t middle = x->edges[at].middle, ends[2] = {a, b};
    for (int k = 0; k < 2 && quadratic && !x->failed && !x->too_many; k++) {
        const int64_t half = edge_of(x, ends[k], middle);
        if (!x->failed && x->edges[half].middle < 0)
            x->edges[half].middle = add_node(x, (int64_t[FROM]){ends[k], ends[1 - k], middle, -1});
    }
    if (x->failed || x->edges[at].split)
        return at;
    x->edges[at].split = true;
    for (int64_t u = x->edges[at].users; u >= 0; u = x->users[u].before)
        await(x, x->users[u].element);
    return at;
}

/* The edges that halves are halved at next: `one` has the new node in the place of corner b, `two` in that of a. In the
 * plane those opposite it. In space faces keep their marks, cut ones are marked opposite the new node, and so is the
 * face between the halves, but where the marks of the element are in one plane and it has its flag. */
static void mark_halves(piece *one, piece *two, const piece *whole, int a, int b, int dim)
{
    const int A = 1 << a, B = 1 << b, rest = ((1 << (dim + 1)) - 1) & ~(A | B);
    if (dim == 2) {
        one->split = (unsigned char)(A | rest);
        two->split = (unsigned char)(B | rest);
        return;
    }
    const int mark_a = whole->mark[a], mark_b = whole->mark[b], common = mark_a & ~B;
    const bool planar = (mark_a & B) && (mark_b & A) && common == (mark_b & ~A), turned = planar && whole->flag;
    one->split = one->mark[b] = (unsigned char)mark_b;
    two->split = two->mark[a] = (unsigned char)mark_a;
    one->mark[a] = (unsigned char)(turned ? common | B : rest);
    two->mark[b] = (unsigned char)(turned ? common | A : rest);
    for (int c = 0; c <= dim; c++)
        if (rest >> c & 1) {
            one->mark[c] = (unsigned char)(A | (rest & ~(1 << c)));
            two->mark[c] = (unsigned char)(B | (rest & ~(1 << c)));
        }
    one->flag = two->flag = planar && !whole->flag;
}

static void bisect(bisection *x, int64_t e)
{
    const piece whole = x->part[e];
    int a = 0, b = x->dim;
    while (!(whole.split >> a & 1))
        a++;
    while (!(whole.split >> b & 1))
        b--;
    const int64_t na = whole.corner[a], nb = whole.corner[b], at = halve(x, na, nb, whole.quadratic);
    if (x->failed || x->too_many || !grow(&x->part, &x->room_parts, x->parts, sizeof *x->part)) {
        x->failed = x->failed || !x->too_many;
        return;
    }
    const int64_t middle = x->edges[at].middle;
    for (int c = 0; c <= x->dim && whole.quadratic && !x->failed; c++) {
        const int64_t nc = whole.corner[c];
        if (c == a || c == b)
            continue;
        const int64_t across = edge_of(x, middle, nc), far = edge_of(x, nb, nc), near = edge_of(x, na, nc);
        if (!x->failed && x->edges[across].middle < 0) {
            const int64_t node =
                add_node(x, (int64_t[FROM]){na, nb, middle, x->edges[far].middle, x->edges[near].middle, -1});
            x->edges[across].middle = node;
        }
    }
    piece *one = &x->part[e], *two = &x->part[x->parts++];
    *two = whole;
    one->due = two->due = (unsigned char)(whole.due > 0 ? whole.due - 1 : 0);
    one->corner[b] = two->corner[a] = middle;
    one->side[a] = two->side[b] = -1;
    mark_halves(one, two, &whole, a, b, x->dim);
    list_edges(x, e, 1 << b);
    list_edges(x, x->parts - 1, (1 << (x->dim + 1)) - 1);
}

/* Bisects until no element has a halved edge. */
static void conform(bisection *x)
{
    while (x->n_waits > 0 && !x->failed && !x->too_many) {
        const int64_t e = x->waits[--x->n_waits];
        const piece *part = &x->part[e];
        bool hangs = false;
        for (int i = 0; i < part->corners && !hangs; i++)
            for (int j = 0; j < i && !hangs; j++)
                hangs = has_edge(x, part, i, j) && x->edges[edge_of(x, part->corner[i], part->corner[j])].split;
        if (hangs && part->corners > x->dim + 1)
            cut(x, e);
        else if (hangs)
            bisect(x, e);
    }
}

/* ---- the refined mesh */

/* What the parts of the given elements take over from a group of their sides, or of themselves. has: room for a byte
 * for each given element. in: nodes of these are marked. */
static bool refine_items(uz_group *out, const bisection *x, const uz_mesh *fine, const uz_group *group,
                         unsigned char *has, unsigned char *in)
{
    int64_t room_faces = 0, room_elements = 0;
    memset(has, 0, (size_t)x->mesh->n_elements);
    for (int64_t i = 0; i < group->n_faces; i++)
        has[group->face[i].element] |= (unsigned char)(1 << group->face[i].side);
    for (int64_t i = 0; i < group->n_elements; i++)
        has[group->element[i]] = 1;
    for (int64_t e = 0; e < fine->n_elements; e++) {
        const piece *part = &x->part[e];
        const uz_element_type *type = uz_element_type_of((uz_element_kind)fine->kind[e]);
        const int64_t *node = fine->node + fine->first[e];
        const bool whole = group->kind == UZ_GROUP_ELEMENTS && has[part->root];
        if (whole && !grow(&out->element, &room_elements, out->n_elements, sizeof *out->element))
            return false;
        if (whole)
            out->element[out->n_elements++] = e;
        for (int k = 0; k < type->nodes && whole; k++)
            in[node[k]] = 1;
        for (int s = 0; s < type->sides && group->kind == UZ_GROUP_FACES && has[part->root]; s++) {
            const uz_element_side *side = &type->side[s];
            int opposite = type->dim == 2 ? 3 : 6; /* the sum of all corners, of which the side has all but one */
            for (int k = 0; k < side->corners; k++)
                opposite -= side->node[k];
            opposite = part->corners == type->dim + 1 ? opposite : s;
            if (part->side[opposite] < 0 || !(has[part->root] >> part->side[opposite] & 1))
                continue;
            if (!grow(&out->face, &room_faces, out->n_faces, sizeof *out->face))
                return false;
            out->face[out->n_faces++] = (uz_face){e, s};
            for (int k = 0; k < side->nodes; k++)
                in[node[side->node[k]]] = 1;
        }
    }
    return true;
}

/* Nodes of the refined mesh that lie amid nodes of a group of nodes join it. An edge through the body from one side to
 * another is none of a group that has whole sides of the boundary: its middle joins only where an end lies inside.
 * outer: nodes of the boundary. */
static bool refine_group(uz_group *group, const bisection *x, const uz_mesh *fine, unsigned char *has,
                         const uz_corner_table *sides, const unsigned char *outer)
{
    unsigned char *in = uz_alloc_zero(fine->n_nodes, 1); /* nodes of the group */
    uz_group out = {.kind = group->kind, .n_inner = group->n_inner};
    memcpy(out.name, group->name, sizeof out.name);
    const int64_t old = x->mesh->n_nodes;
    bool room = in != NULL, whole = false;
    for (int64_t i = 0; i < group->n_nodes && room; i++)
        in[group->node[i]] = 1;
    if (room && group->kind != UZ_GROUP_NODES)
        room = refine_items(&out, x, fine, group, has, in);
    for (int pass = 0; room && group->kind == UZ_GROUP_NODES && pass < 1 + whole; pass++) {
        for (int64_t i = old; i < fine->n_nodes; i++) {
            const int64_t *from = x->from + (i - old) * FROM;
            in[i] = pass == 0 || outer[i] || !outer[from[0]] || !outer[from[1]];
            for (int k = 0; k < FROM && from[k] >= 0; k++)
                in[i] = in[i] && in[from[k]];
        }
        for (int64_t i = 0; i < sides->count && !whole; i++) {
            int64_t node[UZ_FACE_NODES];
            whole = !sides->same[i] && !sides->same[i + 1];
            for (int k = whole ? uz_mesh_face(node, fine, sides->item[i]) : 0; k > 0; k--)
                whole = whole && in[node[k - 1]];
        }
    }
    for (int64_t i = 0; i < fine->n_nodes && room; i++)
        out.n_nodes += in[i];
    out.node = room ? uz_alloc(out.n_nodes, sizeof *out.node) : NULL;
    for (int64_t i = 0, k = 0; i < fine->n_nodes && out.node; i++)
        if (in[i])
            out.node[k++] = i;
    free(in);
    free(group->node);
    free(group->face);
    free(group->element);
    *group = out;
    return out.node != NULL;
}

static bool refine_groups(bisection *x, const uz_mesh *fine)
{
    uz_mesh *mesh = x->mesh;
    uz_corner_table sides = {.count = 0};
    unsigned char *has = uz_alloc(mesh->n_elements, 1), *outer = uz_alloc_zero(fine->n_nodes, 1);
    bool room = has && outer, nodes = false;
    for (int64_t k = 0; k < mesh->n_groups; k++)
        nodes = nodes || mesh->groups[k].kind == UZ_GROUP_NODES;
    if (nodes && room)
        room = uz_corner_table_build(&sides, fine, true, NULL) == UZ_OK;
    for (int64_t i = 0; i < sides.count && room; i++) {
        int64_t node[UZ_FACE_NODES];
        const int count = sides.same[i] || sides.same[i + 1] ? 0 : uz_mesh_face(node, fine, sides.item[i]);
        for (int k = 0; k < count; k++)
            outer[node[k]] = 1;
    }
    for (int64_t k = 0; k < mesh->n_groups && room; k++)
        room = mesh->groups[k].everything || refine_group(&mesh->groups[k], x, fine, has, &sides, outer);
    uz_corner_table_clear(&sides);
    free(has);
    free(outer);
    return room;
}

/* How many faces of its groups lie between two elements. */
static uz_status count_inner(uz_mesh *fine, uz_error *err)
{
    uz_corner_table table = {.count = 0};
    int64_t corner[UZ_MOST_CORNERS];
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < fine->n_groups && status == UZ_OK; k++) {
        uz_group *group = &fine->groups[k];
        if (group->n_inner == 0)
            continue;
        if (!table.start)
            status = uz_corner_table_build(&table, fine, true, err);
        group->n_inner = 0;
        for (int64_t i = 0; i < group->n_faces && status == UZ_OK; i++) {
            const uz_face face = group->face[i];
            const uz_element_type *type = uz_element_type_of((uz_element_kind)fine->kind[face.element]);
            for (int c = 0; c < type->side[face.side].corners; c++)
                corner[c] = fine->node[fine->first[face.element] + type->side[face.side].node[c]];
            const int64_t place = uz_corner_table_find(&table, fine, corner, type->side[face.side].corners);
            group->n_inner += place >= 0 && table.same[place + 1];
        }
    }
    uz_corner_table_clear(&table);
    return status;
}

static uz_status publish(bisection *x, uz_error *err)
{
    uz_mesh *mesh = x->mesh, fine = *mesh;
    const int64_t most = x->parts * uz_element_node_count(x->dim == 2 ? UZ_QUAD8 : UZ_TET10);
    if (x->failed)
        return UZ_OK; /* to be told by the caller */
    fine.n_nodes = x->nodes;
    fine.n_elements = x->parts;
    fine.uniform = false;
    fine.kind = uz_alloc(x->parts, sizeof *fine.kind);
    fine.first = uz_alloc(x->parts + 1, sizeof *fine.first);
    fine.node = uz_alloc(most, sizeof *fine.node);
    x->failed = !fine.kind || !fine.first || !fine.node;
    for (int64_t e = 0, q = 0; e < x->parts && !x->failed; e++) {
        const piece *part = &x->part[e];
        const uz_element_kind root = (uz_element_kind)mesh->kind[part->root];
        const uz_element_kind kind = part->corners == uz_element_type_of(root)->corners ? root
                                     : part->quadratic                                  ? UZ_TRI6
                                                                                        : UZ_TRI3;
        const uz_element_type *type = uz_element_type_of(kind);
        fine.kind[e] = (unsigned char)kind;
        fine.first[e] = q;
        for (int k = 0; k < type->corners; k++)
            fine.node[q++] = part->corner[k];
        for (int k = type->corners; k < type->nodes; k++) {
            const int *ends = type->edge[k - type->corners];
            fine.node[q++] = x->edges[edge_of(x, part->corner[ends[0]], part->corner[ends[1]])].middle;
        }
        fine.first[e + 1] = q;
    }
    x->failed = x->failed || !refine_groups(x, &fine);
    if (x->failed) {
        free(fine.kind);
        free(fine.first);
        free(fine.node);
        return UZ_OK;
    }
    free(mesh->xyz);
    free(mesh->kind);
    free(mesh->first);
    free(mesh->node);
    fine.n_given = mesh->n_nodes;
    fine.xyz = x->xyz;
    fine.from = x->from;
    x->xyz = NULL;
    x->from = NULL;
    *mesh = fine;
    return count_inner(mesh, err);
}
