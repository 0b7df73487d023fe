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
#include "scene/refinement.h"

#include <string.h>

enum { CORNERS = 4, FROM = 8 };
/* Squares of diagonals that differ by less, as those of a rectangle do by rounding, are as long. */
#define ALIKE 1e-9

/* A part of an element that was given, its root: the whole of it at first. Sets of corners are bits. */
typedef struct {
    int64_t corner[CORNERS], root, part_of; /* part_of: of the elements before this round */
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
    uz_refinement all;
    uz_mesh *mesh; /* as it was */
    int dim;
    piece *part;
    int64_t *waits; /* elements that may have a halved edge */
    int64_t parts, n_waits, room_parts, room_waits;
} bisection;

static bool begin(bisection *x, uz_mesh *mesh);
static void cut(bisection *x, int64_t e);
static void bisect(bisection *x, int64_t e);
static void conform(bisection *x);
static void publish(bisection *x);

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
    x.all.failed = !begin(&x, mesh);
    for (int64_t i = 0; i < n && listed && !x.all.failed && !x.all.too_many; i += 1 + marked[i]) {
        const bool once = marked[i] == UZ_HALVED_ONCE && i + 1 < n;
        i += once;
        listed = marked[i] >= 0 && marked[i] < n - i;
        for (int64_t e = 0; e < x.parts; e++)
            x.part[e].part_of = e;
        for (int64_t k = i + 1; listed && k <= i + marked[i]; k++) {
            listed = marked[k] >= 0 && marked[k] < x.parts;
            if (!listed)
                break;
            x.part[marked[k]].due = (unsigned char)(once ? 1 : x.dim);
            if (x.part[marked[k]].corners > x.dim + 1)
                cut(&x, marked[k]);
        }
        for (int due = x.dim; listed && due > 0; due--) {
            const int64_t parts = x.parts;
            for (int64_t e = 0; e < parts && !x.all.failed && !x.all.too_many; e++)
                if (x.part[e].due >= due)
                    bisect(&x, e);
            conform(&x);
        }
    }
    if (listed && !x.all.too_many)
        publish(&x);
    status = uz_refinement_end(&x.all, listed, err);
    uz_free_all(x.part, x.waits);
    return status;
}

/* ---- nodes and edges */

/* A node amid others, of which -1 are none. */
static int64_t add_node(bisection *x, const int64_t from[FROM])
{
    /* Halves of an edge: of the line through its ends, of the parabola through ends and middle at a quarter. The line
     * from an edge's middle to the opposite corner: the quadratic function of the side halfway along it. The middle of
     * a quadrilateral: that of its map. */
    static const double SHARE[FROM + 1][FROM] = {[2] = {0.5, 0.5},
                                                 [3] = {0.375, -0.125, 0.75},
                                                 [5] = {-0.125, -0.125, 0.25, 0.5, 0.5},
                                                 [8] = {-0.25, -0.25, -0.25, -0.25, 0.5, 0.5, 0.5, 0.5}};
    int count = 0;
    while (count < FROM && from[count] >= 0)
        count++;
    return uz_refinement_node(&x->all, from, SHARE[count], count);
}

static int64_t edge_of(bisection *x, int64_t a, int64_t b)
{
    return uz_refinement_link(&x->all, (int64_t[2]){a, b}, 2);
}

/* Is there an edge between two corners, i > j? */
static bool has_edge(const bisection *x, const piece *part, int i, int j)
{
    return part->corners == x->dim + 1 || i == j + 1 || (i == 3 && j == 0);
}

static void await(bisection *x, int64_t e)
{
    if (uz_grow(&x->waits, x->n_waits, 1, &x->room_waits, sizeof *x->waits))
        x->waits[x->n_waits++] = e;
    else
        x->all.failed = true;
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
            if (!x->all.failed)
                uz_refinement_use(&x->all, at, e);
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
                const double way = x->all.xyz[a * x->dim + c] - x->all.xyz[b * x->dim + c];
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
    x->parts = x->room_parts = mesh->n_elements;
    x->part = uz_alloc(x->parts, sizeof *x->part);
    if (!uz_refinement_begin(&x->all, mesh) || !x->part)
        return false;
    for (int64_t e = 0; e < x->parts && !x->all.failed; e++) {
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
        for (int k = type->corners; k < type->nodes && !x->all.failed; k++) {
            const int *ends = type->edge[k - type->corners];
            const int64_t at = edge_of(x, node[ends[0]], node[ends[1]]);
            if (!x->all.failed)
                x->all.links[at].middle = node[k];
        }
    }
    return !x->all.failed;
}

/* ---- one bisection */

/* A quadrilateral becomes two triangles, both as due as it was. */
static void cut(bisection *x, int64_t e)
{
    const piece whole = x->part[e];
    double length[2] = {0, 0};
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < x->dim; c++) {
            const double way = x->all.xyz[whole.corner[k] * x->dim + c] - x->all.xyz[whole.corner[k + 2] * x->dim + c];
            length[k] += way * way;
        }
    const int i = length[1] < (1 - ALIKE) * length[0] ? 1 : 0;
    const int64_t at = edge_of(x, whole.corner[i], whole.corner[i + 2]);
    if (!x->all.failed && whole.quadratic && x->all.links[at].middle < 0) {
        int64_t from[FROM];
        for (int k = 0; k < 4; k++) {
            from[k] = whole.corner[k];
            from[4 + k] = x->all.links[edge_of(x, whole.corner[k], whole.corner[(k + 1) % 4])].middle;
        }
        x->all.links[at].middle = add_node(x, from);
    }
    if (x->all.failed || x->all.too_many || !uz_grow(&x->part, x->parts, 1, &x->room_parts, sizeof *x->part)) {
        x->all.failed = x->all.failed || !x->all.too_many;
        return;
    }
    for (int k = 0; k < 2; k++) { /* from corner i on, over the next two */
        piece *half = &x->part[k == 0 ? e : x->parts];
        const int next = (i + 1 + k) % 4, last = (i + 2 + k) % 4;
        *half = (piece){
            .root = whole.root, .part_of = whole.part_of, .corners = 3, .quadratic = whole.quadratic, .due = whole.due};
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
    if (x->all.failed)
        return 0;
    if (x->all.links[at].middle < 0)
        x->all.links[at].middle = add_node(x, (int64_t[FROM]){a, b, -1});
    const int64_t middle = x->all.links[at].middle, ends[2] = {a, b};
    for (int k = 0; k < 2 && quadratic && !x->all.failed && !x->all.too_many; k++) {
        const int64_t half = edge_of(x, ends[k], middle);
        if (!x->all.failed && x->all.links[half].middle < 0)
            x->all.links[half].middle = add_node(x, (int64_t[FROM]){ends[k], ends[1 - k], middle, -1});
    }
    if (x->all.failed || x->all.links[at].split)
        return at;
    x->all.links[at].split = true;
    for (int64_t u = x->all.links[at].users; u >= 0; u = x->all.users[u].before)
        await(x, x->all.users[u].element);
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
    if (x->all.failed || x->all.too_many || !uz_grow(&x->part, x->parts, 1, &x->room_parts, sizeof *x->part)) {
        x->all.failed = x->all.failed || !x->all.too_many;
        return;
    }
    const int64_t middle = x->all.links[at].middle;
    for (int c = 0; c <= x->dim && whole.quadratic && !x->all.failed; c++) {
        const int64_t nc = whole.corner[c];
        if (c == a || c == b)
            continue;
        const int64_t across = edge_of(x, middle, nc), far = edge_of(x, nb, nc), near = edge_of(x, na, nc);
        if (!x->all.failed && x->all.links[across].middle < 0) {
            const int64_t node =
                add_node(x, (int64_t[FROM]){na, nb, middle, x->all.links[far].middle, x->all.links[near].middle, -1});
            x->all.links[across].middle = node;
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
    while (x->n_waits > 0 && !x->all.failed && !x->all.too_many) {
        const int64_t e = x->waits[--x->n_waits];
        const piece *part = &x->part[e];
        bool hangs = false;
        for (int i = 0; i < part->corners && !hangs; i++)
            for (int j = 0; j < i && !hangs; j++)
                hangs = has_edge(x, part, i, j) && x->all.links[edge_of(x, part->corner[i], part->corner[j])].split;
        if (hangs && part->corners > x->dim + 1)
            cut(x, e);
        else if (hangs)
            bisect(x, e);
    }
}

/* ---- the refined mesh */

static void publish(bisection *x)
{
    const uz_mesh *mesh = x->mesh;
    const int64_t most = x->parts * uz_element_node_count(x->dim == 2 ? UZ_QUAD8 : UZ_TET10);
    uz_mesh fine = {.n_elements = x->parts,
                    .kind = uz_alloc(x->parts, sizeof *fine.kind),
                    .first = uz_alloc(x->parts + 1, sizeof *fine.first),
                    .node = uz_alloc(most, sizeof *fine.node),
                    .part_of = uz_alloc(x->parts, sizeof *fine.part_of)};
    int64_t *root = uz_alloc(x->parts, sizeof *root), q = 0;
    signed char *side_of = uz_alloc(x->parts * UZ_ELEMENT_SIDES, 1);
    x->all.failed = x->all.failed || !fine.kind || !fine.first || !fine.node || !fine.part_of || !root || !side_of;
    for (int64_t e = 0; e < x->parts && !x->all.failed; e++) {
        const piece *part = &x->part[e];
        const uz_element_kind whole = (uz_element_kind)mesh->kind[part->root];
        const uz_element_kind kind = part->corners == uz_element_type_of(whole)->corners ? whole
                                     : part->quadratic                                   ? UZ_TRI6
                                                                                         : UZ_TRI3;
        const uz_element_type *type = uz_element_type_of(kind);
        fine.kind[e] = (unsigned char)kind;
        fine.first[e] = q;
        for (int k = 0; k < type->corners; k++)
            fine.node[q++] = part->corner[k];
        for (int k = type->corners; k < type->nodes; k++) {
            const int *ends = type->edge[k - type->corners];
            fine.node[q++] = x->all.links[edge_of(x, part->corner[ends[0]], part->corner[ends[1]])].middle;
        }
        fine.first[e + 1] = q;
        root[e] = part->root;
        fine.part_of[e] = part->part_of;
        for (int s = 0; s < type->sides; s++) {
            int opposite = type->dim == 2 ? 3 : 6; /* the sum of all corners, of which the side has all but one */
            for (int k = 0; k < type->side[s].corners; k++)
                opposite -= type->side[s].node[k];
            side_of[e * UZ_ELEMENT_SIDES + s] = part->side[part->corners == type->dim + 1 ? opposite : s];
        }
    }
    uz_refinement_publish(&x->all, &fine, root, side_of);
    uz_free_all(root, side_of);
}
