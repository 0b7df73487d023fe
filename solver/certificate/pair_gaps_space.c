/* pair_gaps_space.c: points of either surface against the other one as triangles.
 *
 * A face with straight edges that make a triangle or a parallelogram is one, or two; any other one is a grid of PIECES,
 * which are off it by less than a fiftieth of its sagitta. The gap of a point is its distance from the nearest
 * triangle, negative behind it; where the nearest is an edge or a corner the triangles that meet there decide together,
 * by their angles (Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal", IEEE
 * TVCG 11 (2005) 243-253). Where it is on the border of the surface, beyond which it does not go on, the point faces
 * nothing. */
#include "certificate/pair_gaps.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>

enum { PIECES = 8, PLACES = (PIECES + 1) * (PIECES + 1) };

/* Distances that differ by less, in parts of an edge, are those of one corner. */
#define SAME 1e-9
/* Middles and corners are those of a parallelogram but for this part of its size. */
#define STRAIGHT 1e-12

typedef struct {
    double at[PLACES][3];         /* of the grid: (k, l) is k (PIECES + 1) + l */
    unsigned char border[PLACES]; /* bits: of its edges that are the surface's border, those that the place is on */
    int pieces, corners, nodes;
    double x[3 * UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    double middle[3], reach, length; /* all of it is within `reach` of `middle` */
} sheet;

typedef struct {
    int64_t ends[2], edge; /* nodes, ascending; UZ_FACE_NODES * face + which of its edges */
} face_edge;

/* ---- the faces */

static void place_at(double x[3], const sheet *s, double k, double l)
{
    const uz_side side = {.dim = 3, .nodes = s->nodes, .xyz = s->x};
    const double point[2] = {s->corners == 3 ? k : 2 * k - 1, s->corners == 3 ? l : 2 * l - 1};
    double N[UZ_FACE_NODES];
    uz_side_shape(N, &side, point);
    for (int c = 0; c < 3; c++) {
        x[c] = 0;
        for (int a = 0; a < s->nodes; a++)
            x[c] += N[a] * s->x[3 * a + c];
    }
}

static bool is_straight(const sheet *s)
{
    double off = 0;
    for (int c = 0; c < 3; c++) {
        const double *x = s->x + c;
        if (s->corners == 4)
            off = fmax(off, fabs(x[0] - x[3] + x[6] - x[9]));
        for (int j = 0; j < s->nodes - s->corners; j++)
            off = fmax(off, fabs(x[3 * (s->corners + j)] - 0.5 * (x[3 * j] + x[3 * ((j + 1) % s->corners)])));
    }
    return off <= STRAIGHT * s->length;
}

/* Edges of a triangle: l = 0, k + l = 1, k = 0; of a quadrilateral l = 0, k = 1, l = 1, k = 0. */
static unsigned edges_at(const sheet *s, int k, int l)
{
    const int n = s->pieces;
    if (s->corners == 3)
        return (l == 0 ? 1U : 0) | (k + l == n ? 2U : 0) | (k == 0 ? 4U : 0);
    return (l == 0 ? 1U : 0) | (k == n ? 2U : 0) | (l == n ? 4U : 0) | (k == 0 ? 8U : 0);
}

/* border: bits of the face's edges. */
static void make_sheet(sheet *s, const uz_body_model *model, uz_face face, const double *u, unsigned border)
{
    s->nodes = uz_mesh_face(s->node, &model->mesh, face);
    s->corners = s->nodes % 3 == 0 ? 3 : 4;
    s->length = s->reach = 0;
    for (int i = 0; i < 3 * s->nodes; i++)
        s->x[i] = model->mesh.xyz[3 * s->node[i / 3] + i % 3] + u[3 * s->node[i / 3] + i % 3];
    for (int a = 0; a < s->nodes; a++)
        for (int b = 0; b < a; b++)
            s->length = fmax(s->length, sqrt(uz_distance2(s->x + 3 * a, s->x + 3 * b, 3)));
    const double centre = s->corners == 3 ? 1.0 / 3 : 0.5;
    place_at(s->middle, s, centre, centre);
    s->pieces = is_straight(s) ? 1 : PIECES;
    for (int k = 0; k <= s->pieces; k++)
        for (int l = 0; l <= (s->corners == 3 ? s->pieces - k : s->pieces); l++) {
            const int p = k * (PIECES + 1) + l;
            place_at(s->at[p], s, (double)k / s->pieces, (double)l / s->pieces);
            s->border[p] = (unsigned char)(edges_at(s, k, l) & border);
            s->reach = fmax(s->reach, sqrt(uz_distance2(s->at[p], s->middle, 3)));
        }
}

static int by_ends(const void *a, const void *b)
{
    const face_edge *x = a, *y = b;
    const int k = x->ends[0] == y->ends[0];
    return (x->ends[k] > y->ends[k]) - (x->ends[k] < y->ends[k]);
}

/* border (n_faces): of each face bits of the edges that are of no other face of the group. False: no memory. */
static bool find_border(unsigned *border, const uz_mesh *mesh, const uz_group *group)
{
    face_edge *edges = uz_alloc(4 * group->n_faces, sizeof *edges);
    int64_t n = 0;
    for (int64_t i = 0; i < group->n_faces && edges; i++) {
        int64_t node[UZ_FACE_NODES];
        const int corners = uz_mesh_face(node, mesh, group->face[i]) % 3 == 0 ? 3 : 4;
        border[i] = 0;
        for (int j = 0; j < corners; j++) {
            const int64_t a = node[j], b = node[(j + 1) % corners];
            edges[n++] = (face_edge){{a < b ? a : b, a < b ? b : a}, UZ_FACE_NODES * i + j};
        }
    }
    if (edges)
        qsort(edges, (size_t)n, sizeof *edges, by_ends);
    for (int64_t i = 0; i < n; i++) {
        const bool shared =
            (i > 0 && by_ends(&edges[i - 1], &edges[i]) == 0) || (i + 1 < n && by_ends(&edges[i], &edges[i + 1]) == 0);
        border[edges[i].edge / UZ_FACE_NODES] |= shared ? 0 : 1U << edges[i].edge % UZ_FACE_NODES;
    }
    free(edges);
    return n > 0 || group->n_faces == 0;
}

static sheet *make_sheets(const uz_body_model *model, const uz_group *group, const double *u)
{
    sheet *out = uz_alloc(group->n_faces, sizeof *out);
    unsigned *border = uz_alloc(group->n_faces, sizeof *border);
    const bool room = out && border && find_border(border, &model->mesh, group);
    for (int64_t i = 0; i < group->n_faces && room; i++)
        make_sheet(&out[i], model, group->face[i], u, border[i]);
    free(border);
    if (room)
        return out;
    free(out);
    return NULL;
}

/* ---- the nearest place */

typedef struct {
    double distance, normal[3], off[3], length; /* normal: the sum of those that are as near, by their angles */
    bool border, before;                        /* it is on the border; the point is before a triangle for all that */
} nearest;

/* s (3): the shares of the corners in the point of a triangle that is nearest to x (C. Ericson, "Real-Time Collision
 * Detection", 2005, ch. 5.1.5). before: it is the foot of the perpendicular. */
static void nearest_shares(double s[3], bool *before, const double *x, const double *const at[3])
{
    double ab[3], ac[3], ax[3];
    for (int c = 0; c < 3; c++) {
        ab[c] = at[1][c] - at[0][c];
        ac[c] = at[2][c] - at[0][c];
        ax[c] = x[c] - at[0][c];
    }
    const double bb = uz_dot3(ab, ab), bc = uz_dot3(ab, ac), cc = uz_dot3(ac, ac), bx = uz_dot3(ab, ax),
                 cx = uz_dot3(ac, ax), det = bb * cc - bc * bc;
    const double v = (cc * bx - bc * cx) / det, w = (bb * cx - bc * bx) / det;
    double least = INFINITY;
    *before = v > -SAME && w > -SAME && v + w < 1 + SAME;
    s[0] = 1 - v - w;
    s[1] = v;
    s[2] = w;
    if (v >= 0 && w >= 0 && v + w <= 1)
        return;
    for (int e = 0; e < 3; e++) { /* of its edges the nearest */
        const double *a = at[e], *b = at[(e + 1) % 3];
        const double along[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                     from[3] = {x[0] - a[0], x[1] - a[1], x[2] - a[2]};
        const double t = fmin(1, fmax(0, uz_dot3(from, along) / uz_dot3(along, along)));
        const double off[3] = {from[0] - t * along[0], from[1] - t * along[1], from[2] - t * along[2]};
        const double square = uz_dot3(off, off);
        if (square >= least)
            continue;
        least = square;
        s[e] = 1 - t;
        s[(e + 1) % 3] = t;
        s[(e + 2) % 3] = 0;
    }
}

/* The angle of a triangle at the place with these shares: whole within it, half on an edge. */
static double angle_at(const double s[3], const double *const at[3])
{
    int corner = -1, zero = 0;
    for (int a = 0; a < 3; a++) {
        corner = s[a] > 1 - SAME ? a : corner;
        zero += s[a] < SAME;
    }
    if (corner < 0)
        return zero > 0 ? 1 : 2;
    double b[3], c[3];
    for (int i = 0; i < 3; i++) {
        b[i] = at[(corner + 1) % 3][i] - at[corner][i];
        c[i] = at[(corner + 2) % 3][i] - at[corner][i];
    }
    return acos(fmin(1, fmax(-1, uz_dot3(b, c) / sqrt(uz_dot3(b, b) * uz_dot3(c, c))))) / acos(-1);
}

/* looks: where the point is; NULL: on another body. */
static void look_at_triangle(nearest *to, const double x[3], const uz_own_look *looks, const sheet *s,
                             const int place[3])
{
    const double *const at[3] = {s->at[place[0]], s->at[place[1]], s->at[place[2]]};
    double share[3], off[3], ab[3], ac[3], normal[3];
    bool before;
    unsigned on = ~0U;
    for (int c = 0; c < 3; c++) {
        ab[c] = at[1][c] - at[0][c];
        ac[c] = at[2][c] - at[0][c];
    }
    const double size = s->length / s->pieces, reach = sqrt(fmax(uz_dot3(ab, ab), uz_dot3(ac, ac)));
    if (sqrt(uz_distance2(x, at[0], 3)) - reach > to->distance + SAME * size)
        return;
    nearest_shares(share, &before, x, at);
    for (int c = 0; c < 3; c++)
        off[c] = x[c] - share[0] * at[0][c] - share[1] * at[1][c] - share[2] * at[2][c];
    const double distance = sqrt(uz_dot3(off, off));
    uz_cross3(normal, ab, ac);
    if (!(uz_unit3(normal) > 0) || distance > to->distance + SAME * size || (looks && !uz_own_may_meet(looks, normal)))
        return;
    if (distance < to->distance - SAME * size)
        *to = (nearest){.distance = distance, .length = s->length};
    for (int a = 0; a < 3; a++)
        on &= share[a] < SAME ? ~0U : s->border[place[a]];
    to->distance = fmin(to->distance, distance);
    to->length = fmax(to->length, s->length);
    to->border = to->border || on != 0;
    to->before = to->before || before;
    const double angle = angle_at(share, at);
    for (int c = 0; c < 3; c++) {
        to->off[c] = off[c];
        to->normal[c] += angle * normal[c];
    }
}

static void look_at_sheet(nearest *to, const double x[3], const uz_own_look *looks, const sheet *s)
{
    enum { ROW = PIECES + 1 };
    for (int k = 0; k < s->pieces; k++)
        for (int l = 0; l < (s->corners == 3 ? s->pieces - k : s->pieces); l++) {
            const int p = k * ROW + l;
            look_at_triangle(to, x, looks, s, (const int[3]){p, p + ROW, p + 1});
            if (s->corners == 4 || k + l + 1 < s->pieces)
                look_at_triangle(to, x, looks, s, (const int[3]){p + ROW, p + ROW + 1, p + 1});
        }
}

/* The outward normal of a face, of any length. */
static void normal_at(double normal[3], const sheet *s, double k, double l)
{
    const uz_side side = {.dim = 3, .nodes = s->nodes, .xyz = s->x};
    const double point[2] = {s->corners == 3 ? k : 2 * k - 1, s->corners == 3 ? l : 2 * l - 1};
    double N[UZ_FACE_NODES], slope[UZ_FACE_NODES][3], along[2][3] = {{0}};
    uz_side_gradients(N, slope, &side, point);
    for (int a = 0; a < s->nodes; a++)
        for (int c = 0; c < 6; c++)
            along[c / 3][c % 3] += slope[a][c / 3] * s->x[3 * a + c % 3];
    uz_cross3(normal, along[0], along[1]);
}

/* From the point (k, l) of a face. */
static void look_from(double *least, double *part, const sheet *own, double k, double l, const sheet *other, int64_t n,
                      const uz_own_elements *elements)
{
    nearest at = {.distance = INFINITY};
    const bool itself = elements->xyz;
    double x[3];
    place_at(x, own, k, l);
    uz_own_look looks = {.held = itself && uz_own_elements_hold(elements, x)};
    if (itself)
        normal_at(looks.normal, own, k, l);
    /* first the one that may be the nearest, as beside it there is little to look at in most of the others */
    int64_t first = -1;
    double least_far = INFINITY;
    for (int64_t i = 0; i < n; i++) {
        const double far = sqrt(uz_distance2(x, other[i].middle, 3)) - other[i].reach;
        if (far < least_far && !(itself && uz_own_adjoin(own->node, own->nodes, other[i].node, other[i].nodes))) {
            least_far = far;
            first = i;
        }
    }
    for (int64_t q = 0; q < n && first >= 0; q++) {
        const int64_t i = q == 0 ? first : q <= first ? q - 1 : q;
        if (sqrt(uz_distance2(x, other[i].middle, 3)) - other[i].reach <= at.distance + SAME * other[i].length &&
            !(itself && uz_own_adjoin(own->node, own->nodes, other[i].node, other[i].nodes)))
            look_at_sheet(&at, x, itself ? &looks : NULL, &other[i]);
    }
    if (!isfinite(at.distance) || (at.border && !at.before && !looks.held))
        return;
    const double gap = looks.held || uz_dot3(at.normal, at.off) < 0 ? -at.distance : at.distance;
    if (itself && !looks.held && gap < -UZ_OWN_TOUCHES * at.length)
        return;
    *least = fmin(*least, gap);
    *part = fmin(*part, gap / fmax(own->length, at.length));
}

uz_status uz_pair_gaps_space(double *least, double *part, const uz_body_model *model, const uz_group *const group[2],
                             const double *u, int steps, uz_own_elements *own, uz_error *err)
{
    sheet *sheets[2] = {make_sheets(model, group[0], u), make_sheets(model, group[1], u)};
    const bool room = sheets[0] && sheets[1];
    for (int j = 0; j < (group[0] == group[1] ? 1 : 2) && room; j++)
        for (int64_t i = 0; i < group[j]->n_faces; i++) {
            const sheet *s = &sheets[j][i];
            if (own->xyz)
                uz_own_elements_near(own, s->middle, s->reach);
            for (int k = 0; k <= steps; k++)
                for (int l = 0; l <= (s->corners == 3 ? steps - k : steps); l++)
                    look_from(least, part, s, (double)k / steps, (double)l / steps, sheets[!j], group[!j]->n_faces,
                              own);
        }
    uz_free_all(sheets[0], sheets[1]);
    return room ? UZ_OK : uz_no_memory(err, "the surfaces of a contact");
}
