/* mortar_space.c: two surfaces in space, integrated over together.
 *
 * Each slave face has a plane through its centre, across its normal there. Both faces are projected on it, cut with
 * each other, and the convex pieces are split into triangles with Gauss points; each point is carried back along the
 * plane's normal to both faces (M. Puso, T. Laursen, "A mortar segment-to-segment contact method for large deformation
 * solid mechanics", Comput. Methods Appl. Mech. Engrg. 193 (2004) 601-629). Faces with nodes amid their edges are cut
 * as the pieces between these nodes.
 *
 * Faces that go on into each other make a patch; where its nodes lie on a sphere, a cylinder, a cone or a torus, the
 * gap is that of the facets plus what the shape is off them, as in the plane. Other linear facets stand for a surface
 * that is a quadric about each of their nodes; faces with middles have a shape of their own. */
#include "assembly/mortar.h"

#include "core/alloc.h"
#include "core/order.h"
#include "core/vector3.h"
#include "linalg/linalg.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A corner that is no farther from a line than this part of the sizes is on it. */
#define ON_LINE 1e-12

enum { MOST_CORNERS = 12, MOST_PIECES = 5, ENOUGH_ABOUT = 25, MOST_ABOUT = 60 };

/* Of quadrics about places: how far they may be off faces, in lengths of these times the angle by which they turn, and
 * their normals off the means of the faces', in such angles. */
#define MOST_SAGITTA 1.0
#define MOST_TILT    3.0
/* ... and the least discriminant that they may have on their faces: on a sphere, 60 degrees from the node. */
#define LEAST_DISCRIMINANT 0.25
#define ROUNDING           1e-9

/* A piece smaller than this part of the slave face is what rounding leaves. */
#define LEAST_PIECE 1e-12

typedef struct {
    double x[MOST_CORNERS][2];
    int n;
} polygon;

/* A plane: centre, tangents, normal. */
typedef struct {
    double x[3], t[2][3], n[3];
} plane;

static int corners_of(const uz_mortar_side *side)
{
    return side->nodes % 3 == 0 ? 3 : 4;
}

static const double *centre_of(const uz_mortar_side *side)
{
    static const double CENTRE[2][2] = {{1. / 3, 1. / 3}, {0, 0}};
    return CENTRE[corners_of(side) - 3];
}

/* ---- patches */

/* Places of one patch are joined by their faces; each patch is looked at by itself. */
static bool recognise(uz_mortar_surface *surface, const uz_mesh *mesh)
{
    const int64_t n = surface->n_places;
    int64_t *part = uz_alloc(n, sizeof *part), (*key)[2] = uz_alloc(n, sizeof *key);
    uz_smooth_shape *shape = uz_alloc_zero(n, sizeof *shape);
    double *xyz = uz_alloc(n, 3 * sizeof *xyz), *normal = uz_alloc(n, 3 * sizeof *normal);
    const bool room = part && key && shape && xyz && normal;
    if (room)
        uz_mortar_find_parts(part, surface);
    for (int64_t p = 0; p < n && room; p++) {
        key[p][0] = part[p];
        key[p][1] = p;
    }
    if (room)
        qsort(key, (size_t)n, sizeof *key, uz_ascending_pairs);
    for (int64_t first = 0, end; first < n && room; first = end) {
        for (end = first; end < n && key[end][0] == key[first][0]; end++) {
            memcpy(xyz + 3 * (end - first), mesh->xyz + 3 * surface->node[key[end][1]], 3 * sizeof *xyz);
            memcpy(normal + 3 * (end - first), surface->normal + 3 * key[end][1], 3 * sizeof *normal);
        }
        shape[key[first][0]] = uz_smooth_shape_of(xyz, normal, end - first);
    }
    for (int64_t i = 0; i < surface->n && room; i++)
        surface->side[i].shape = shape[part[surface->side[i].place[0]]];
    for (int64_t p = 0; p < n && room; p++) { /* normals of the shape itself, out of the body */
        double *mine = surface->normal + 3 * p, exact[3], off[3];
        memcpy(exact, mine, sizeof exact);
        uz_smooth_nearest(off, exact, &shape[part[p]], mesh->xyz + 3 * surface->node[p]);
        const double side = uz_dot3(exact, mine) < 0 ? -1 : 1;
        for (int c = 0; c < 3; c++)
            mine[c] = side * exact[c];
    }
    uz_free_all(part, key, shape, xyz, normal);
    return room;
}

/* The places about place p by rings of faces until there are enough for a quadric; returns how many. sides: those
 * around each place. */
static int list_about(int64_t about[MOST_ABOUT], const uz_mortar_surface *surface, int64_t p, const uz_csc *sides,
                      int64_t *seen)
{
    int n = 0, ring = 0;
    about[n++] = p;
    seen[p] = p + 1;
    while (ring < n && n < ENOUGH_ABOUT) {
        const int end = n;
        for (; ring < end; ring++)
            for (int64_t k = sides->ptr[about[ring]]; k < sides->ptr[about[ring] + 1]; k++)
                for (int a = 0; a < surface->side[sides->idx[k]].nodes && n < MOST_ABOUT; a++) {
                    const int64_t other = surface->side[sides->idx[k]].place[a];
                    if (seen[other] == p + 1)
                        continue;
                    seen[other] = p + 1;
                    about[n++] = other;
                }
    }
    return n;
}

/* The least that the discriminant of a quadric can be on a face of three or four nodes: a quadratic in the place, or in
 * each of its two coordinates, is no less than its least Bernstein coefficient. */
static double least_discriminant(const uz_smooth_patch *patch, const uz_mortar_side *side)
{
    double middle[3] = {0}, corner[4], edges = 0, corners = 0, least = INFINITY;
    const int n = side->nodes;
    for (int a = 0; a < n; a++) {
        corner[a] = uz_smooth_patch_discriminant(patch, side->xyz + 3 * a);
        corners += corner[a];
        for (int c = 0; c < 3; c++)
            middle[c] += side->xyz[3 * a + c] / n;
    }
    for (int a = 0; a < n; a++) {
        const int b = (a + 1) % n;
        double x[3];
        for (int c = 0; c < 3; c++)
            x[c] = 0.5 * (side->xyz[3 * a + c] + side->xyz[3 * b + c]);
        const double edge = 2 * uz_smooth_patch_discriminant(patch, x) - 0.5 * (corner[a] + corner[b]);
        edges += edge;
        least = fmin(least, fmin(edge, corner[a]));
    }
    return n == 3 ? least : fmin(least, 4 * uz_smooth_patch_discriminant(patch, middle) - 0.25 * corners - 0.5 * edges);
}

/* Leaves out quadrics that are not what the faces around their places stand for: where a surface bends from one node to
 * the next, as from the arm of a clip into its bend, the one through all nodes may be anywhere between them. A face of
 * length l that turns by a from each of its ends to the middle has a sagitta of l a / 4. False: no memory. */
static bool drop_wild_patches(bool *known, const uz_mortar_surface *surface)
{
    enum { POINTS = 5 };
    static const double AT[2][POINTS][2] = {{{1. / 3, 1. / 3}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}, {1. / 3, 1. / 3}},
                                            {{0, 0}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}}};
    double *turn = uz_alloc_zero(surface->n_places, sizeof *turn);
    const bool room = turn != NULL;
    for (int64_t k = 0; k < 2 * surface->n && room; k++) { /* all turns first */
        const uz_mortar_side *side = &surface->side[k % surface->n];
        const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
        double size = 0, most = 0;
        for (int a = 0; a < side->nodes && side->fitted; a++) {
            double normal[3];
            uz_side_area_vector(normal, &shape, uz_side_local_nodes(&shape)[a]);
            uz_unit3(normal);
            double *own = &turn[side->place[a]];
            *own = fmax(*own, sqrt(uz_distance2(normal, surface->normal + 3 * side->place[a], 3)));
            most = fmax(most, *own);
            for (int b = 0; b < a; b++)
                size = fmax(size, sqrt(uz_distance2(side->xyz + 3 * a, side->xyz + 3 * b, 3)));
        }
        for (int q = 0; q < POINTS * side->nodes && side->fitted && k >= surface->n; q++) {
            const int64_t place = side->place[q % side->nodes];
            double N[UZ_FACE_NODES], x[3] = {0}, normal[3], here[3];
            uz_side_shape(N, &shape, AT[side->nodes == 4][q / side->nodes]);
            for (int i = 0; i < 3 * side->nodes; i++)
                x[i % 3] += N[i / 3] * side->xyz[i];
            if (!known[place])
                continue;
            if (q < side->nodes && least_discriminant(&surface->patch[place], side) < LEAST_DISCRIMINANT) {
                known[place] = false;
                continue;
            }
            const double height = uz_smooth_patch_height(normal, &surface->patch[place], x);
            uz_smooth_patch_height(here, &surface->patch[place], surface->patch[place].at);
            known[place] = fabs(height) <= MOST_SAGITTA * most * size + ROUNDING * size &&
                           sqrt(uz_distance2(here, surface->normal + 3 * place, 3)) <= MOST_TILT * most + ROUNDING;
        }
    }
    free(turn);
    return room;
}

/* Linear faces that lie on no known shape get the quadrics about their places, and these the quadrics' normals. Faces
 * with middles have a shape of their own. */
static bool fit_patches(uz_mortar_surface *surface, const uz_mesh *mesh)
{
    const int64_t n = surface->n_places;
    int64_t fitted = 0;
    uz_entries all = {.n = 0};
    uz_csc sides = {0};
    for (int64_t i = 0; i < surface->n; i++) {
        uz_mortar_side *side = &surface->side[i];
        side->fitted = side->shape.kind == UZ_SMOOTH_NONE && side->nodes <= 4;
        fitted += side->fitted;
    }
    if (fitted == 0)
        return true;
    int64_t *seen = uz_alloc_zero(n, sizeof *seen);
    bool *known = uz_alloc_zero(n, sizeof *known);
    surface->patch = uz_alloc_zero(n, sizeof *surface->patch);
    for (int64_t i = 0; i < surface->n; i++)
        for (int a = 0; a < surface->side[i].nodes; a++)
            uz_entries_add(&all, i, surface->side[i].place[a], 0);
    bool room = uz_csc_from_entries(&sides, surface->n, n, &all, NULL) == UZ_OK && seen && known && surface->patch;
    for (int64_t p = 0; p < n && room; p++) {
        int64_t about[MOST_ABOUT];
        double xyz[3 * MOST_ABOUT];
        bool wanted = false;
        for (int64_t k = sides.ptr[p]; k < sides.ptr[p + 1]; k++)
            wanted = wanted || surface->side[sides.idx[k]].fitted;
        const int count = wanted ? list_about(about, surface, p, &sides, seen) : 0;
        for (int k = 0; k < count; k++)
            memcpy(xyz + 3 * k, mesh->xyz + 3 * surface->node[about[k]], 3 * sizeof *xyz);
        known[p] = wanted && uz_smooth_patch_fit(&surface->patch[p], xyz, surface->normal + 3 * p, xyz + 3, count - 1);
    }
    room = room && drop_wild_patches(known, surface);
    for (int64_t i = 0; i < surface->n && room; i++)
        for (int a = 0; a < surface->side[i].nodes; a++)
            surface->side[i].fitted = surface->side[i].fitted && known[surface->side[i].place[a]];
    for (int64_t p = 0; p < n && room; p++)
        if (known[p])
            uz_smooth_patch_height(surface->normal + 3 * p, &surface->patch[p], surface->patch[p].at);
    uz_csc_clear(&sides);
    free(seen);
    free(known);
    return room;
}

/* From x, where the side's shape functions are N, to the smooth surface that it stands for. Between the places of a
 * side the quadrics about them are blended: through all nodes and without a step from face to face. */
static void smooth_offset(double offset[3], const uz_mortar_surface *surface, const uz_mortar_side *side,
                          const double *N, const double x[3])
{
    uz_smooth_nearest(offset, NULL, &side->shape, x);
    for (int a = 0; a < side->nodes && side->fitted; a++) {
        const uz_smooth_patch *patch = &surface->patch[side->place[a]];
        double normal[3];
        const double height = uz_smooth_patch_height(normal, patch, x);
        for (int c = 0; c < 3; c++)
            offset[c] += N[a] * height * patch->n[c];
    }
}

/* ---- places */

/* A face joins a place of its node whose normal so far is within the feature angle, else it begins one. */
static bool places(uz_mortar_surface *surface, const uz_contact_input *in)
{
    const double least = uz_mortar_least_cosine(in);
    int64_t most = 0, n = 0;
    for (int64_t i = 0; i < surface->n; i++)
        most += surface->side[i].nodes;
    int64_t(*key)[2] = uz_alloc(most, sizeof *key); /* node; UZ_FACE_NODES * face + which of its nodes */
    surface->node = uz_alloc(most, sizeof *surface->node);
    surface->normal = uz_alloc(3 * most, sizeof *surface->normal);
    const bool room = key && surface->node && surface->normal;
    for (int64_t i = 0; i < surface->n && room; i++)
        for (int a = 0; a < surface->side[i].nodes; a++) {
            key[n][0] = surface->side[i].node[a];
            key[n++][1] = UZ_FACE_NODES * i + a;
        }
    if (room)
        qsort(key, (size_t)n, sizeof *key, uz_ascending_pairs);
    int64_t first = 0;
    for (int64_t k = 0; k < n; k++) {
        uz_mortar_side *side = &surface->side[key[k][1] / UZ_FACE_NODES];
        const int a = (int)(key[k][1] % UZ_FACE_NODES);
        const uz_side shape = uz_mortar_side_of(side, in->model);
        double normal[3];
        int64_t place = surface->n_places;
        uz_side_area_vector(normal, &shape, uz_side_local_nodes(&shape)[a]);
        uz_unit3(normal);
        if (k > 0 && key[k][0] != key[k - 1][0])
            first = surface->n_places;
        for (int64_t p = surface->n_places - 1; p >= first; p--) {
            double mean[3];
            memcpy(mean, surface->normal + 3 * p, sizeof mean);
            uz_unit3(mean);
            if (uz_dot3(mean, normal) > least)
                place = p;
        }
        if (place == surface->n_places) {
            memset(surface->normal + 3 * place, 0, 3 * sizeof(double));
            surface->node[surface->n_places++] = key[k][0];
        }
        for (int c = 0; c < 3; c++)
            surface->normal[3 * place + c] += normal[c];
        side->place[a] = place;
    }
    for (int64_t p = 0; p < surface->n_places; p++)
        uz_unit3(surface->normal + 3 * p);
    free(key);
    return room && (in->contact->faceted || in->rest ||
                    (recognise(surface, &in->model->mesh) && fit_patches(surface, &in->model->mesh)));
}

/* ---- polygons */

/* Twice the area, positive counter-clockwise. */
static double twice_area(const polygon *p)
{
    double sum = 0;
    for (int i = 1; i + 1 < p->n; i++)
        sum += (p->x[i][0] - p->x[0][0]) * (p->x[i + 1][1] - p->x[0][1]) -
               (p->x[i][1] - p->x[0][1]) * (p->x[i + 1][0] - p->x[0][0]);
    return sum;
}

/* What of a is on the left of all sides of b, both convex and counter-clockwise (I. Sutherland, G. Hodgman, "Reentrant
 * polygon clipping", Comm. ACM 17 (1974) 32-42). */
static void clip(polygon *a, const polygon *b)
{
    for (int e = 0; e < b->n && a->n > 0; e++) {
        const double *from = b->x[e], *to = b->x[(e + 1) % b->n];
        const double along[2] = {to[0] - from[0], to[1] - from[1]};
        double off[MOST_CORNERS];
        polygon out = {.n = 0};
        for (int i = 0; i < a->n; i++) { /* on the line but for rounding: where on it would it be cut? */
            const double d[2] = {a->x[i][0] - from[0], a->x[i][1] - from[1]};
            const double squares = along[0] * along[0] + along[1] * along[1] + d[0] * d[0] + d[1] * d[1];
            off[i] = along[0] * d[1] - along[1] * d[0];
            off[i] = fabs(off[i]) <= ON_LINE * squares ? 0 : off[i];
        }
        for (int i = 0; i < a->n; i++) {
            const int j = (i + 1) % a->n;
            if (off[i] >= 0 && out.n < MOST_CORNERS)
                memcpy(out.x[out.n++], a->x[i], sizeof out.x[0]);
            if ((off[i] > 0 && off[j] < 0) || (off[i] < 0 && off[j] > 0)) {
                const double s = off[i] / (off[i] - off[j]);
                for (int c = 0; c < 2 && out.n < MOST_CORNERS; c++)
                    out.x[out.n][c] = a->x[i][c] + s * (a->x[j][c] - a->x[i][c]);
                out.n += out.n < MOST_CORNERS;
            }
        }
        *a = out;
    }
}

/* A face on the plane: itself, or the pieces between its corners and middles. Returns how many. */
static int project(polygon piece[MOST_PIECES], const uz_mortar_side *side, const plane *on)
{
    static const int SIX[4][4] = {{0, 3, 5, -1}, {1, 4, 3, -1}, {2, 5, 4, -1}, {3, 4, 5, -1}};
    static const int EIGHT[5][4] = {{0, 4, 7, -1}, {1, 5, 4, -1}, {2, 6, 5, -1}, {3, 7, 6, -1}, {4, 5, 6, 7}};
    static const int ALL[1][4] = {{0, 1, 2, 3}};
    const int(*nodes)[4] = side->nodes == 6 ? SIX : side->nodes == 8 ? EIGHT : ALL;
    const int count = side->nodes == 6 ? 4 : side->nodes == 8 ? 5 : 1;
    for (int k = 0; k < count; k++) {
        piece[k].n = 0;
        for (int a = 0; a < 4 && nodes[k][a] >= 0 && nodes[k][a] < side->nodes; a++) {
            const double *x = side->xyz + 3 * nodes[k][a];
            const double off[3] = {x[0] - on->x[0], x[1] - on->x[1], x[2] - on->x[2]};
            piece[k].x[piece[k].n][0] = uz_dot3(off, on->t[0]);
            piece[k].x[piece[k].n++][1] = uz_dot3(off, on->t[1]);
        }
    }
    return count;
}

static void turn_over(polygon *p)
{
    for (int i = 0; i < p->n / 2; i++) {
        double x[2];
        memcpy(x, p->x[i], sizeof x);
        memcpy(p->x[i], p->x[p->n - 1 - i], sizeof x);
        memcpy(p->x[p->n - 1 - i], x, sizeof x);
    }
}

/* ---- points */

/* Where on a face the last point was: its place there and on the plane, and how the one follows the other. All zero but
 * for `local` before the first. */
typedef struct {
    double local[2], y[2], follows[2][2];
} foot;

/* So small a step is the last one: what it changes is linear in it to rounding, and of the area's direction nothing. */
#define LAST_STEP 1e-9

/* The point of a face above y on the plane, by Newton's method from where `at` leads to: shape functions, area vector
 * per reference area, height over the plane. False: there is none. */
static bool lift(double *N, double area[3], double *height, foot *at, const uz_mortar_side *side, const uz_side *shape,
                 const plane *on, const double y[2])
{
    double *local = at->local;
    double step[2];
    for (int c = 0; c < 2; c++)
        step[c] = at->follows[c][0] * (at->y[0] - y[0]) + at->follows[c][1] * (at->y[1] - y[1]);
    memcpy(at->y, y, sizeof at->y);
    for (int k = 0; k < 30; k++) {
        double slope[UZ_FACE_NODES][3], x[3] = {0}, T[2][3] = {{0}};
        for (int c = 0; c < 2; c++)
            local[c] = fmin(fmax(local[c] - step[c], -4), 4);
        uz_side_gradients(N, slope, shape, local);
        for (int c = 0; c < 3; c++) {
            for (int a = 0; a < side->nodes; a++)
                x[c] += N[a] * (side->xyz[3 * a + c] - on->x[c]);
            for (int a = 1; a < side->nodes; a++)
                for (int i = 0; i < 2; i++)
                    T[i][c] += slope[a][i] * (side->xyz[3 * a + c] - side->xyz[c]);
        }
        const double f[2] = {uz_dot3(x, on->t[0]) - y[0], uz_dot3(x, on->t[1]) - y[1]};
        const double J[2][2] = {{uz_dot3(T[0], on->t[0]), uz_dot3(T[1], on->t[0])},
                                {uz_dot3(T[0], on->t[1]), uz_dot3(T[1], on->t[1])}};
        const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
        for (int c = 0; c < 2; c++) {
            at->follows[c][c] = J[1 - c][1 - c] / det;
            at->follows[c][1 - c] = -J[c][1 - c] / det;
        }
        for (int c = 0; c < 2; c++)
            step[c] = at->follows[c][0] * f[0] + at->follows[c][1] * f[1];
        *height = uz_dot3(x, on->n);
        uz_cross3(area, T[0], T[1]);
        if (!isfinite(step[0] + step[1])) {
            memset(at->follows, 0, sizeof at->follows);
            return false;
        }
        if (fabs(step[0]) + fabs(step[1]) > LAST_STEP)
            continue;
        for (int a = 0; a < side->nodes; a++)
            N[a] -= slope[a][0] * step[0] + slope[a][1] * step[1];
        *height -= uz_dot3(T[0], on->n) * step[0] + uz_dot3(T[1], on->n) * step[1];
        return true;
    }
    return true; /* as near as rounding lets it come */
}

/* Points of a line of the Gauss rule with n points on [0, 1] (M. Abramowitz, I. Stegun, table 25.4). */
static void gauss_line(double *at, double *weight, int n)
{
    static const double X3[] = {0, 0.77459666924148337704}, W3[] = {8. / 9, 5. / 9};
    static const double X4[] = {0.33998104358485626480, 0.86113631159405257522},
                        W4[] = {0.65214515486254614263, 0.34785484513745385737};
    static const double X5[] = {0, 0.53846931010568309104, 0.90617984593866399280},
                        W5[] = {0.56888888888888888889, 0.47862867049936646804, 0.23692688505618908751};
    const double *x = n == 3 ? X3 : n == 4 ? X4 : X5, *w = n == 3 ? W3 : n == 4 ? W4 : W5;
    for (int g = 0; g < n; g++) {
        const int from_middle = 2 * g - (n - 1), k = n % 2 ? abs(from_middle) / 2 : (abs(from_middle) - 1) / 2;
        at[g] = 0.5 + (from_middle < 0 ? -0.5 : 0.5) * x[k];
        weight[g] = 0.5 * w[k];
    }
}

/* Are corners those of a parallelogram or triangle and middles amid? Then shape functions are polynomials of the place.
 */
static bool is_affine(const uz_mortar_side *side)
{
    const int corners = corners_of(side);
    double off = 0, size = 0;
    for (int c = 0; c < 3; c++) {
        const double *x = side->xyz + c;
        size = fmax(size, fabs(x[3] - x[0]) + fabs(x[6] - x[0]));
        if (corners == 4)
            off = fmax(off, fabs(x[0] - x[3] + x[6] - x[9]));
        for (int j = 0; j < side->nodes - corners; j++)
            off = fmax(off, fabs(x[3 * (corners + j)] - 0.5 * (x[3 * j] + x[3 * ((j + 1) % corners)])));
    }
    return off <= 1e-9 * size;
}

/* What leads from y on face i to face j, where that is behind it; height: of the two over the plane. */
static uz_way way_to(uz_mortar_pair *pair, int64_t i, int64_t j, const plane *on, const double y[2],
                     const double height[2])
{
    double x[2][3];
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            x[k][c] = on->x[c] + y[0] * on->t[0][c] + y[1] * on->t[1][c] + height[k] * on->n[c];
    return height[1] < height[0] ? uz_mortar_way(pair, i, j, x[0], x[1]) : UZ_WAY_OVERLAP;
}

/* Is there another face at y, nearer to face i than face j is? Where there are no layers that can only be the back of
 * what i is on, beyond which nothing is looked for. */
static bool is_covered(uz_mortar_pair *pair, int64_t i, int64_t j, const plane *on, const double y[2],
                       const double height[2])
{
    const bool behind = height[1] < height[0];
    for (int64_t k = 0; k < pair->n_near && (pair->layered || (pair->own && behind)); k++) {
        const uz_mortar_side *other = &pair->surface.side[pair->near[k]];
        const uz_side shape = uz_mortar_side_of(other, pair->in->model);
        polygon piece[MOST_PIECES];
        bool within = false;
        const int count = pair->near[k] == j ? 0 : project(piece, other, on);
        for (int q = 0; q < count && !within; q++) {
            turn_over(&piece[q]);
            within = twice_area(&piece[q]) > 0;
            for (int a = 0; a < piece[q].n && within; a++) {
                const double *from = piece[q].x[a], *to = piece[q].x[(a + 1) % piece[q].n];
                within = (to[0] - from[0]) * (y[1] - from[1]) >= (to[1] - from[1]) * (y[0] - from[0]);
            }
        }
        double N[UZ_FACE_NODES], area[3], there[2] = {height[0], 0};
        foot at = {.y = {0}};
        memcpy(at.local, centre_of(other), sizeof at.local);
        if (!within || !lift(N, area, &there[1], &at, other, &shape, on, y) ||
            !(fabs(there[1] - there[0]) < (1 - 1e-9) * fabs(height[1] - height[0])))
            continue;
        const uz_way way = way_to(pair, i, pair->near[k], on, y, there);
        if ((way == UZ_WAY_BACK && behind) || (way == UZ_WAY_OVERLAP && pair->layered))
            return true;
    }
    return false;
}

/* One convex piece that both faces cover, as a fan of triangles with n x n points each: those of a square, one side of
 * which falls together in a corner, exact to degree 2 n - 2. */
static bool add_piece(uz_mortar_pair *pair, const polygon *piece, int64_t i_side, int64_t master, const plane *on,
                      int n)
{
    const uz_contact_input *in = pair->in;
    const uz_mortar_surface *surface = &pair->surface;
    const uz_mortar_side *side = &surface->side[i_side], *other = &surface->side[master];
    const uz_side mine = uz_mortar_side_of(side, in->model), its = uz_mortar_side_of(other, in->model);
    double at[5], weight[5];
    foot feet[2] = {{.y = {0}}, {.y = {0}}};
    bool room = true;
    memcpy(feet[0].local, centre_of(side), sizeof feet[0].local);
    memcpy(feet[1].local, centre_of(other), sizeof feet[1].local);
    gauss_line(at, weight, n);
    for (int i = 1; i + 1 < piece->n; i++) {
        const polygon triangle = {.x = {{piece->x[0][0], piece->x[0][1]},
                                        {piece->x[i][0], piece->x[i][1]},
                                        {piece->x[i + 1][0], piece->x[i + 1][1]}},
                                  .n = 3};
        const double twice = twice_area(&triangle);
        for (int g = 0; g < n * n && room; g++) {
            const double r = at[g / n], s = at[g % n] * (1 - r);
            uz_mortar_point p = {.master = master, .weight = twice * weight[g / n] * weight[g % n] * (1 - r)};
            double y[2], area[3], ignored[3], height[2], normal[3] = {0};
            for (int c = 0; c < 2; c++)
                y[c] = (1 - r - s) * triangle.x[0][c] + r * triangle.x[1][c] + s * triangle.x[2][c];
            if (!lift(p.N, area, &height[0], &feet[0], side, &mine, on, y) ||
                !lift(p.M, ignored, &height[1], &feet[1], other, &its, on, y) ||
                way_to(pair, i_side, master, on, y, height) != UZ_WAY_OVERLAP ||
                is_covered(pair, i_side, master, on, y, height))
                continue;
            for (int a = 0; a < side->nodes; a++)
                for (int c = 0; c < 3; c++)
                    normal[c] += p.N[a] * surface->normal[3 * side->place[a] + c];
            uz_unit3(normal);
            memcpy(p.local, feet[1].local, sizeof p.local);
            p.weight *= sqrt(uz_dot3(area, area)) / uz_dot3(area, on->n);
            p.gap = (height[1] - height[0]) * uz_dot3(normal, on->n);
            for (int k = 0; k < 2; k++) { /* from either face, as it was before anything moved, to its shape */
                const uz_mortar_side *rest = uz_mortar_rest(surface, k == 0 ? side : other);
                double x[3], off[3];
                for (int c = 0; c < 3; c++) {
                    x[c] = on->x[c] + y[0] * on->t[0][c] + y[1] * on->t[1][c] + height[k] * on->n[c];
                    for (int a = 0; a < rest->nodes && in->rest; a++)
                        x[c] = (a == 0 ? 0 : x[c]) + (k == 0 ? p.N : p.M)[a] * rest->xyz[3 * a + c];
                }
                smooth_offset(off, surface->rest ? surface->rest : surface, rest, k == 0 ? p.N : p.M, x);
                p.gap += (k == 0 ? -1 : 1) * uz_dot3(off, normal);
            }
            if (isfinite(p.gap) && p.weight > 0)
                room = uz_mortar_add_point(&pair->points, &p);
        }
    }
    return room;
}

static bool points(uz_mortar_pair *pair, int64_t i)
{
    const uz_mortar_side *side = &pair->surface.side[i];
    const uz_side shape = uz_mortar_side_of(side, pair->in->model);
    plane on = {.x = {0}};
    polygon mine[MOST_PIECES], its[MOST_PIECES];
    bool room = true;
    uz_side_area_vector(on.n, &shape, centre_of(side));
    uz_unit3(on.n);
    for (int c = 0; c < 3; c++) {
        for (int a = 0; a < corners_of(side); a++)
            on.x[c] += side->xyz[3 * a + c] / corners_of(side);
        on.t[0][c] = side->xyz[3 + c] - side->xyz[c];
    }
    const double along = uz_dot3(on.t[0], on.n);
    for (int c = 0; c < 3; c++)
        on.t[0][c] -= along * on.n[c];
    uz_unit3(on.t[0]);
    uz_cross3(on.t[1], on.n, on.t[0]);
    const int n_mine = project(mine, side, &on);
    for (int64_t k = 0; k < pair->n_near && room; k++) {
        const uz_mortar_side *other = &pair->surface.side[pair->near[k]];
        const bool affine = is_affine(side) && is_affine(other);
        const int n_its = project(its, other, &on);
        const int rule = pair->rough ? 3 : !affine ? 5 : side->nodes > 4 || other->nodes > 4 ? 4 : 3;
        for (int q = 0; q < n_its && room; q++) {
            turn_over(&its[q]); /* it looks at the slave: from there it runs clockwise */
            if (twice_area(&its[q]) <= 0)
                continue;
            for (int p = 0; p < n_mine && room; p++) {
                polygon piece = mine[p];
                clip(&piece, &its[q]);
                if (piece.n >= 3 && twice_area(&piece) > LEAST_PIECE * side->area)
                    room = add_piece(pair, &piece, i, pair->near[k], &on, rule);
            }
        }
    }
    return room;
}

static void offset(double offset[3], const uz_mortar_surface *surface, const uz_mortar_side *side, const double *local,
                   const double x[3])
{
    const uz_side shape = {.dim = 3, .nodes = side->nodes, .xyz = side->xyz};
    double N[UZ_FACE_NODES];
    uz_side_shape(N, &shape, local);
    smooth_offset(offset, surface, side, N, x);
}

const uz_mortar_geometry uz_mortar_space = {places, points, offset};
