/* mortar_plane.c: two surfaces in the plane, or two of revolution, integrated over together.
 *
 * Facets stand for a smooth curve unless they turn by more than the feature angle. The gap is that of the facets plus
 * what the smooth curves are off them, both taken before anything moves:
 *
 *     g = g_facets + ((x_smooth - x_facet)_master - (x_smooth - x_facet)_slave) . n
 *
 * The curve is a cubic Bezier one on each edge, with handles of 2 L / (3 (1 + cos phi)) along the tangents at its ends
 * (phi: between tangent and chord; exact to fourth order on arcs). The tangent at a node is that of its two edges,
 * weighted by their inverse lengths, which is the circle's through the three nodes to second order; at a free end it is
 * the inner one mirrored at the chord's bisector, as a circle has it. Edges of three nodes are two such halves. */
#include "assembly/mortar.h"

#include "core/alloc.h"
#include "core/order.h"
#include "core/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* Less than this part of an edge is no segment: it is what rounding leaves between two nodes that face each other. */
#define LEAST_SEGMENT 1e-9

/* to - from as a unit vector; returns the length. */
static double direction(double out[2], const double from[2], const double to[2])
{
    const double length = hypot(to[0] - from[0], to[1] - from[1]);
    for (int c = 0; c < 2; c++)
        out[c] = length > 0 ? (to[c] - from[c]) / length : 0;
    return length;
}

/* Out of the body, which is on the left. */
static void turn_outward(double n[2], const double tangent[2])
{
    n[0] = tangent[1];
    n[1] = -tangent[0];
}

/* Shape functions of an edge at s in [-1, 1]. */
static void shape_at(double *N, int nodes, double s)
{
    N[0] = nodes == 2 ? 0.5 * (1 - s) : -0.5 * s * (1 - s);
    N[1] = nodes == 2 ? 0.5 * (1 + s) : 0.5 * s * (1 + s);
    N[2] = nodes == 2 ? 0 : (1 - s) * (1 + s);
}

/* The edge's point at s, and dx/ds where it is not NULL. */
static void edge_at(double x[2], double slope[2], const uz_mortar_side *e, double s)
{
    double N[3];
    const double D[3] = {e->nodes == 2 ? -0.5 : s - 0.5, e->nodes == 2 ? 0.5 : s + 0.5, e->nodes == 2 ? 0 : -2 * s};
    shape_at(N, e->nodes, s);
    for (int c = 0; c < 2; c++) {
        x[c] = 0;
        for (int a = 0; a < e->nodes; a++)
            x[c] += N[a] * e->xyz[2 * a + c];
        if (!slope)
            continue;
        slope[c] = 0;
        for (int a = 1; a < e->nodes; a++)
            slope[c] += D[a] * (e->xyz[2 * a + c] - e->xyz[c]);
    }
}

/* Tangent at a node between two edges, from the directions and lengths to and from it: that of the circle through the
 * three to second order. */
static void tangent_between(double out[2], const double before[2], double first, const double after[2], double second)
{
    static const double ORIGIN[2] = {0};
    const double t[2] = {before[0] / first + after[0] / second, before[1] / first + after[1] / second};
    direction(out, ORIGIN, t);
}

/* The smooth curve less the edge at s, along n, which need not be quite normal to either: where the line through the
 * edge's point meets the curve. Nodes amid an edge may be off its middle, and then s runs along both at other speeds.
 */
static double offset_along(const double n[2], const uz_mortar_side *e, double s)
{
    const double *A = e->xyz, *B = e->xyz + 2, *middle = e->xyz + 4;
    double t = 0.5 * (1 + s), T[2][2], x[2], chord[2], along[2], off[2] = {0, 0};
    memcpy(T, e->tangent, sizeof T);
    if (e->nodes == 3) {
        const int first = s < 0;
        double halves[2][2], inner[2];
        const double before = direction(halves[0], A, middle), after = direction(halves[1], middle, B);
        tangent_between(inner, halves[0], before, halves[1], after);
        memcpy(T[first], inner, sizeof inner);
        t = first ? 1 + s : s;
        *(first ? &B : &A) = middle;
        memcpy(chord, halves[!first], sizeof chord);
        for (int c = 0; c < 2 && !e->joined[!first]; c++)
            T[!first][c] = 2 * uz_dot2(inner, chord) * chord[c] - inner[c];
    }
    const double length = direction(chord, A, B);
    for (int k = 0; k < 2; k++)
        along[k] = 2 * length / (3 * (1 + uz_dot2(T[k], chord)));
    edge_at(x, NULL, e, s);
    for (int k = 0; k < 8; k++) {
        double slope[2];
        for (int c = 0; c < 2; c++) {
            const double P[2] = {A[c] + along[0] * T[0][c], B[c] - along[1] * T[1][c]};
            off[c] =
                (1 - t) * (1 - t) * ((1 - t) * A[c] + 3 * t * P[0]) + t * t * (3 * (1 - t) * P[1] + t * B[c]) - x[c];
            slope[c] =
                3 * ((1 - t) * (1 - t) * (P[0] - A[c]) + 2 * t * (1 - t) * (P[1] - P[0]) + t * t * (B[c] - P[1]));
        }
        const double change = uz_cross2(off, n) / uz_cross2(slope, n);
        if (!(fabs(change) > 1e-13))
            break;
        t = fmin(fmax(t - change, -0.5), 1.5);
    }
    return uz_dot2(off, n);
}

/* ---- a surface */

/* Tangents at the ends of all edges, and which edges go on into each other. */
static void find_tangents(uz_mortar_surface *surface, const int64_t *at, double least_cosine)
{
    for (int64_t i = 0; i < surface->n; i++)
        for (int k = 0; k < 2; k++) {
            double x[2], slope[2];
            static const double ORIGIN[2] = {0};
            edge_at(x, slope, &surface->side[i], k ? 1 : -1);
            direction(surface->side[i].tangent[k], ORIGIN, slope);
        }
    for (int64_t i = 0; i < surface->n; i++) {
        uz_mortar_side *e = &surface->side[i];
        const int64_t next = at[2 * e->node[1]] - 1;
        if (at[2 * e->node[1] + 1] != 1 + i || next < 0)
            continue;
        uz_mortar_side *f = &surface->side[next];
        double t[2][2];
        if (uz_dot2(e->tangent[1], f->tangent[0]) <= least_cosine)
            continue;
        const double *last = e->xyz + (e->nodes == 3 ? 4 : 0), *following = f->xyz + (f->nodes == 3 ? 4 : 2);
        const double first = direction(t[0], last, e->xyz + 2), second = direction(t[1], f->xyz, following);
        tangent_between(e->tangent[1], t[0], first, t[1], second);
        memcpy(f->tangent[0], e->tangent[1], sizeof f->tangent[0]);
        e->joined[1] = f->joined[0] = true;
    }
    for (int64_t i = 0; i < surface->n; i++) {
        uz_mortar_side *e = &surface->side[i];
        double chord[2];
        direction(chord, e->xyz, e->xyz + 2);
        for (int k = 0; k < 2 && e->nodes == 2; k++)
            for (int c = 0; c < 2 && !e->joined[k] && e->joined[!k]; c++)
                e->tangent[k][c] = 2 * uz_dot2(e->tangent[!k], chord) * chord[c] - e->tangent[!k][c];
    }
}

/* Places in the order of their nodes: one for each end of an edge, but where it goes on into the next. */
static bool places(uz_mortar_surface *surface, const uz_contact_input *in)
{
    int64_t(*key)[2] = uz_alloc(3 * surface->n, sizeof *key), n = 0; /* node; 3 * edge + which of its nodes */
    int64_t *at = uz_alloc_zero(2 * in->model->mesh.n_nodes, sizeof *at);
    surface->node = uz_alloc(3 * surface->n, sizeof *surface->node);
    surface->normal = uz_alloc(6 * surface->n, sizeof *surface->normal);
    const bool room = key && at && surface->node && surface->normal;
    if (!room)
        goto done;
    /* The edges that begin and end at each node: 1 + their number, 0: none, -1: several. */
    for (int64_t i = 0; i < surface->n; i++)
        for (int k = 0; k < 2; k++) {
            int64_t *there = at + 2 * surface->side[i].node[k] + k;
            *there = *there == 0 ? 1 + i : -1;
        }
    find_tangents(surface, at, uz_mortar_least_cosine(in));
    for (int64_t i = 0; i < surface->n; i++)
        for (int a = 0; a < surface->side[i].nodes; a++)
            if (a != 0 || !surface->side[i].joined[0]) {
                key[n][0] = surface->side[i].node[a];
                key[n++][1] = 3 * i + a;
            }
    qsort(key, (size_t)n, sizeof *key, uz_ascending_pairs);
    for (int64_t p = 0; p < n; p++) {
        uz_mortar_side *e = &surface->side[key[p][1] / 3];
        const int a = (int)(key[p][1] % 3);
        double x[2], slope[2];
        static const double ORIGIN[2] = {0};
        edge_at(x, slope, e, 0);
        direction(slope, ORIGIN, slope);
        surface->node[p] = key[p][0];
        turn_outward(surface->normal + 2 * p, a == 2 ? slope : e->tangent[a]);
        e->place[a] = p;
        if (a == 1 && e->joined[1])
            surface->side[at[2 * e->node[1]] - 1].place[0] = p;
    }
    surface->n_places = n;
done:
    free(key);
    free(at);
    return room;
}

/* ---- points */

/* The slave's normal at s: between those of its nodes. */
static void normal_at(double n[2], const uz_mortar_surface *slave, const uz_mortar_side *e, double s)
{
    static const double ORIGIN[2] = {0};
    double N[3], sum[2] = {0, 0};
    shape_at(N, e->nodes, s);
    for (int a = 0; a < e->nodes; a++)
        for (int c = 0; c < 2; c++)
            sum[c] += N[a] * slave->normal[2 * e->place[a] + c];
    direction(n, ORIGIN, sum);
}

/* Where x lies on the edge as seen along its normals: Newton's method from the chord. */
static double project_on_slave(const uz_mortar_surface *slave, const uz_mortar_side *e, const double x[2])
{
    double chord[2], off[2] = {x[0] - e->xyz[0], x[1] - e->xyz[1]};
    const double length = direction(chord, e->xyz, e->xyz + 2), step = 1e-6;
    double s = fmin(fmax(2 * uz_dot2(off, chord) / length - 1, -3), 3);
    for (int k = 0; k < 20; k++) {
        double f[3];
        for (int i = 0; i < 3; i++) {
            double at[2], n[2], to[2];
            edge_at(at, NULL, e, s + (i - 1) * step);
            normal_at(n, slave, e, s + (i - 1) * step);
            for (int c = 0; c < 2; c++)
                to[c] = x[c] - at[c];
            f[i] = uz_cross2(to, n);
        }
        const double change = f[1] / ((f[2] - f[0]) / (2 * step));
        if (!isfinite(change))
            break;
        s = fmin(fmax(s - fmin(fmax(change, -0.6), 0.6), -3), 3);
        if (fabs(change) < 1e-14)
            break;
    }
    return s;
}

/* Where the line from x along n meets an edge; returns the distance along n, INFINITY where it does not meet the curve
 * that the edge is a part of: a parabola ends, and Newton's method then stops anywhere. */
static double project_on_master(double *s, const uz_mortar_side *e, const double x[2], const double n[2])
{
    double at[2], slope[2];
    for (int k = 0; k < 30; k++) {
        edge_at(at, slope, e, *s);
        const double off[2] = {at[0] - x[0], at[1] - x[1]};
        const double change = uz_cross2(off, n) / uz_cross2(slope, n);
        if (!isfinite(change))
            return INFINITY;
        *s = fmin(fmax(*s - change, -4), 4);
        if (fabs(change) < 1e-15)
            break;
    }
    edge_at(at, slope, e, *s);
    const double off[2] = {at[0] - x[0], at[1] - x[1]};
    return fabs(uz_cross2(off, n)) <= 1e-9 * (fabs(slope[0]) + fabs(slope[1]) + hypot(off[0], off[1])) ? uz_dot2(off, n)
                                                                                                       : INFINITY;
}

/* The nearest of some edges that the line through x on edge i along n meets from outside; -1: none. Behind x that ends
 * at the back of what x is on. */
static int64_t edge_across(uz_mortar_pair *pair, int64_t i, const double x[2], const double n[2])
{
    int64_t front = -1, behind = -1;
    double to_front = INFINITY, to_behind = INFINITY, to_back = INFINITY;
    for (int64_t k = 0; k < pair->n_near; k++) {
        const uz_mortar_side *e = &pair->surface.side[pair->near[k]];
        double chord[2], outward[2], s = 0;
        direction(chord, e->xyz, e->xyz + 2);
        turn_outward(outward, chord);
        if (uz_dot2(outward, n) >= 0)
            continue;
        const double distance = project_on_master(&s, e, x, n);
        const double y[2] = {x[0] + distance * n[0], x[1] + distance * n[1]};
        if (!(fabs(s) <= 1 + 2e-9 && fabs(distance) < (distance < 0 ? fmin(to_behind, to_back) : to_front)))
            continue;
        const uz_way way = distance < 0 ? uz_mortar_way(pair, i, pair->near[k], x, y) : UZ_WAY_OVERLAP;
        if (way == UZ_WAY_BACK) {
            to_back = -distance;
        } else if (way == UZ_WAY_OVERLAP) {
            *(distance < 0 ? &to_behind : &to_front) = fabs(distance);
            *(distance < 0 ? &behind : &front) = pair->near[k];
        }
    }
    return behind >= 0 && to_behind < fmin(to_front, to_back) ? behind : front;
}

/* Is an edge straight, with a node amid in the middle? Its shape functions are then polynomials of the place, and so
 * along another edge. */
static bool is_affine(const uz_mortar_side *e)
{
    double off = 0, size = 0;
    for (int c = 0; c < 2 && e->nodes == 3; c++) {
        off = fmax(off, fabs(e->xyz[4 + c] - 0.5 * (e->xyz[c] + e->xyz[2 + c])));
        size = fmax(size, fabs(e->xyz[2 + c] - e->xyz[c]));
    }
    return off <= 1e-9 * size;
}

/* The Gauss points between a and b of edge i, which has edge k across: four for polynomials, else ten, which leave
 * rounding unless a middle is nearly where the edge turns back. */
static bool add_segment(uz_mortar_pair *pair, int64_t i, int64_t k, double a, double b)
{
    static const double AT[2][5] = {{0.33998104358485626480, 0.86113631159405257522},
                                    {0.14887433898163121088, 0.43339539412924719080, 0.67940956829902440623,
                                     0.86506336668898451073, 0.97390652851717172008}};
    static const double WEIGHT[2][5] = {{0.65214515486254614263, 0.34785484513745385737},
                                        {0.29552422471475287017, 0.26926671930999635509, 0.21908636251598204400,
                                         0.14945134915058059315, 0.06667134430868813759}};
    const uz_contact_input *in = pair->in;
    const uz_mortar_surface *surface = &pair->surface;
    const uz_mortar_side *e = &surface->side[i], *f = &surface->side[k];
    const int fine = !is_affine(e) || !is_affine(f), half = fine ? 5 : 2;
    bool room = true;
    for (int g = 0; g < 2 * half && room; g++) {
        uz_mortar_point p = {.master = k};
        double x[2], slope[2], n[2], t = 0;
        const int q = g < half ? half - 1 - g : g - half;
        const double s = 0.5 * (a + b) + 0.5 * (b - a) * (g < half ? -AT[fine][q] : AT[fine][q]);
        edge_at(x, slope, e, s);
        normal_at(n, surface, e, s);
        p.gap = project_on_master(&t, f, x, n);
        p.weight = 0.5 * (b - a) * WEIGHT[fine][q] * hypot(slope[0], slope[1]);
        p.weight *= in->model->kind == UZ_AXISYMMETRIC ? 2 * PI * x[0] : in->model->thickness;
        shape_at(p.N, e->nodes, s);
        shape_at(p.M, f->nodes, t);
        if (!in->contact->faceted)
            p.gap += offset_along(n, uz_mortar_rest(surface, f), t) - offset_along(n, uz_mortar_rest(surface, e), s);
        room = !isfinite(p.gap) || uz_mortar_add_point(&pair->points, &p);
    }
    return room;
}

/* Segments between the master's nodes, projected along the slave's field of normals. */
static bool points(uz_mortar_pair *pair, int64_t i)
{
    const uz_mortar_surface *surface = &pair->surface;
    const uz_mortar_side *e = &surface->side[i];
    int64_t n_cuts = 0;
    double *cut = uz_alloc(2 * pair->n_near + 2, sizeof *cut), chord[2];
    bool room = cut != NULL;
    const double length = direction(chord, e->xyz, e->xyz + 2);
    for (int64_t k = 0; k < 2 * pair->n_near && room; k++) {
        const double *x = surface->side[pair->near[k / 2]].xyz + 2 * (k % 2);
        const double along = ((x[0] - e->xyz[0]) * chord[0] + (x[1] - e->xyz[1]) * chord[1]) / length;
        const double s = along > -0.9 && along < 1.9 ? project_on_slave(surface, e, x) : 2;
        if (fabs(s) < 1)
            cut[n_cuts++] = s;
    }
    if (room) {
        cut[n_cuts++] = -1;
        cut[n_cuts++] = 1;
        qsort(cut, (size_t)n_cuts, sizeof *cut, uz_ascending_real);
    }
    for (int64_t k = 0; k + 1 < n_cuts && room; k++) {
        double x[2], n[2];
        const double middle = 0.5 * (cut[k] + cut[k + 1]);
        if (cut[k + 1] - cut[k] < LEAST_SEGMENT)
            continue;
        edge_at(x, NULL, e, middle);
        normal_at(n, surface, e, middle);
        const int64_t across = edge_across(pair, i, x, n);
        if (across >= 0)
            room = add_segment(pair, i, across, cut[k], cut[k + 1]);
    }
    free(cut);
    return room;
}

static void offset(double offset[3], const uz_mortar_surface *surface, const uz_mortar_side *side, const double *local,
                   const double x[3])
{
    (void)surface;
    static const double ORIGIN[2] = {0};
    double at[2], slope[2], n[2];
    (void)x;
    edge_at(at, slope, side, local[0]);
    direction(slope, ORIGIN, slope);
    turn_outward(n, slope);
    const double along = offset_along(n, side, local[0]);
    for (int c = 0; c < 3; c++)
        offset[c] = c < 2 ? along * n[c] : 0;
}

const uz_mortar_geometry uz_mortar_plane = {places, points, offset};
