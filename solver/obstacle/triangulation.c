/* triangulation.c: a surface of triangles: how they hang together, and the closest point.
 *
 * Sources: closest point of a triangle by the regions of its plane: Ericson, "Real-Time Collision Detection" (2005),
 * 5.1.5. Normals of points by angles: Baerentzen and Aanaes, "Signed distance computation using the angle weighted
 * pseudonormal", IEEE Trans. Visualization and Computer Graphics 11 (2005) 243: with them the side of a point follows
 * from its closest point, be it on a face, an edge or a corner. */
#include "obstacle/triangulation.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"
#include "obstacle/pieces.h"

#include <math.h>
#include <string.h>

/* Triangles with a height below this part of their longest edge have no normal: it would be rounding. */
#define NO_HEIGHT 1e-9
/* Edges that turn by less stand for a curve: the feature angle of contacts between bodies. */
#define FEATURE (40 * 3.14159265358979 / 180)

void uz_triangulation_clear(uz_triangulation *t)
{
    uz_free_all(t->point, t->corner, t->beside, t->normal, t->point_normal, t->sagitta);
    uz_box_tree_clear(&t->tree);
    memset(t, 0, sizeof *t);
}

/* ---- who is whose neighbour */

static uint64_t mixed(uint64_t hash, uint64_t value)
{
    hash = (hash ^ value) * 0x9E3779B97F4A7C15u;
    return hash ^ (hash >> 29);
}

static int64_t slots_for(int64_t n)
{
    int64_t slots = 1;
    while (slots < 2 * n)
        slots *= 2;
    return slots;
}

/* Corners of the same place are one point. slot: room for slots_for(3 n), all -1. */
static void number_points(uz_triangulation *t, const double *x, const double *y, const double *z, double scale,
                          int64_t *slot)
{
    const int64_t mask = slots_for(3 * t->n) - 1;
    for (int64_t i = 0; i < 3 * t->n; i++) {
        const double at[3] = {x[i] * scale + 0.0, y[i] * scale + 0.0, z[i] * scale + 0.0}; /* no -0 */
        uint64_t hash = 0;
        for (int c = 0; c < 3; c++) {
            uint64_t bits;
            memcpy(&bits, &at[c], sizeof bits);
            hash = mixed(hash, bits);
        }
        int64_t k = (int64_t)(hash & (uint64_t)mask);
        while (slot[k] >= 0 && memcmp(t->point + 3 * slot[k], at, sizeof at) != 0)
            k = (k + 1) & mask;
        if (slot[k] < 0) {
            slot[k] = t->n_points++;
            memcpy(t->point + 3 * slot[k], at, sizeof at);
        }
        t->corner[i] = slot[k];
    }
}

/* The way i (edge i % 3 of triangle i / 3) from one point to another. */
static int64_t way_from(const uz_triangulation *t, int64_t i)
{
    return t->corner[i];
}

static int64_t way_to(const uz_triangulation *t, int64_t i)
{
    return t->corner[i % 3 == 2 ? i - 2 : i + 1];
}

/* The way from one point to another, in the table or the free place for it. */
static int64_t find_way(const uz_triangulation *t, const int64_t *slot, int64_t mask, int64_t from, int64_t to)
{
    int64_t k = (int64_t)(mixed(mixed(0, (uint64_t)from), (uint64_t)to) & (uint64_t)mask);
    while (slot[k] >= 0 && (way_from(t, slot[k]) != from || way_to(t, slot[k]) != to))
        k = (k + 1) & mask;
    return k;
}

static uz_status join(uz_triangulation *t, int64_t *slot, double scale, const char *where, uz_error *err)
{
    const int64_t mask = slots_for(3 * t->n) - 1;
    for (int64_t i = 0; i < 3 * t->n; i++) {
        const int64_t k = find_way(t, slot, mask, way_from(t, i), way_to(t, i));
        if (slot[k] >= 0) {
            const double *a = t->point + 3 * way_from(t, i), *b = t->point + 3 * way_to(t, i);
            return uz_fail(err, UZ_ERR_SCENE, where,
                           "triangles %lld and %lld (counted from 1) pass their edge from (%g, %g, %g) to (%g, %g, %g) "
                           "the same way: their normals point to different sides, or more than two triangles meet "
                           "there; mend the surface in the program that made it",
                           (long long)slot[k] / 3 + 1, (long long)i / 3 + 1, a[0] / scale, a[1] / scale, a[2] / scale,
                           b[0] / scale, b[1] / scale, b[2] / scale);
        }
        slot[k] = i;
    }
    for (int64_t i = 0; i < 3 * t->n; i++) {
        const int64_t back = slot[find_way(t, slot, mask, way_to(t, i), way_from(t, i))];
        t->beside[i] = back < 0 ? -1 : back / 3;
        t->open = t->open || back < 0;
    }
    return UZ_OK;
}

/* ---- which side is which */

static const double *corner_of(const uz_triangulation *t, int64_t triangle, int k)
{
    return t->point + 3 * t->corner[3 * triangle + k % 3];
}

/* Six times the volume between a triangle and a point. */
static double volume_under(const uz_triangulation *t, int64_t triangle, const double from[3])
{
    double edge[3][3], n[3];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            edge[k][c] = corner_of(t, triangle, k)[c] - from[c];
    uz_cross3(n, edge[0], edge[1]);
    return uz_dot3(n, edge[2]);
}

static void turn_all(uz_triangulation *t)
{
    for (int64_t i = 0; i < t->n; i++) {
        const int64_t second = t->corner[3 * i + 1], first = t->beside[3 * i];
        t->corner[3 * i + 1] = t->corner[3 * i + 2];
        t->corner[3 * i + 2] = second;
        t->beside[3 * i] = t->beside[3 * i + 2];
        t->beside[3 * i + 2] = first;
    }
}

/* The triangles that hang together with the first on the list (seen already). Returns how many there are; *open: do
 * they have a rim? *volume: what they enclose, six times. */
static int64_t gather_part(bool *open, double *volume, const uz_triangulation *t, int64_t *list, bool *seen)
{
    int64_t count = 1;
    const double *from = corner_of(t, list[0], 0);
    *open = false;
    *volume = 0;
    for (int64_t i = 0; i < count; i++) {
        *volume += volume_under(t, list[i], from);
        for (int k = 0; k < 3; k++) {
            const int64_t next = t->beside[3 * list[i] + k];
            *open = *open || next < 0;
            if (next >= 0 && !seen[next]) {
                seen[next] = true;
                list[count++] = next;
            }
        }
    }
    return count;
}

static uz_status check_sides(uz_triangulation *t, bool inside, const char *where, uz_error *err)
{
    bool *seen = uz_alloc_zero(t->n, sizeof *seen), turn = false;
    int64_t *list = uz_alloc(t->n, sizeof *list), outwards = -1, inwards = -1;
    uz_status status = seen && list ? UZ_OK : uz_no_memory(err, "the parts of a surface");
    for (int64_t i = 0; i < t->n && status == UZ_OK; i++) {
        bool open;
        double volume;
        if (seen[i])
            continue;
        seen[i] = true;
        list[0] = i;
        gather_part(&open, &volume, t, list, seen);
        if (open && inside)
            status = uz_fail(err, UZ_ERR_SCENE, where,
                             "the surface is open at triangle %lld (counted from 1) and encloses nothing to be inside "
                             "of: leave \"inside\" out; the obstacle is behind the normals, and \"flip\" turns them",
                             (long long)i + 1);
        if (!open && volume > 0 && outwards < 0)
            outwards = i;
        if (!open && !(volume > 0) && inwards < 0)
            inwards = i;
    }
    if (status == UZ_OK && outwards >= 0 && inwards >= 0)
        status = uz_fail(err, UZ_ERR_SCENE, where,
                         "the closed part with triangle %lld (counted from 1) has its normals outwards, that with "
                         "triangle %lld inwards: what is the obstacle, and what is free, is not known; leave one out",
                         (long long)outwards + 1, (long long)inwards + 1);
    else if (status == UZ_OK && inwards >= 0 && !inside)
        status = uz_fail(err, UZ_ERR_SCENE, where,
                         "the surface is closed and its normals point inwards: of a body that lies within it say "
                         "\"inside\": true; of an obstacle whose file was mirrored say \"flip\": true");
    turn = inside && outwards >= 0;
    uz_free_all(seen, list);
    if (status == UZ_OK && turn)
        turn_all(t);
    return status;
}

/* ---- normals */

static void make_normals(uz_triangulation *t)
{
    for (int64_t i = 0; i < t->n; i++) {
        double edge[3][3], longest = 0, *n = t->normal + 3 * i;
        for (int k = 0; k < 3; k++) {
            for (int c = 0; c < 3; c++)
                edge[k][c] = corner_of(t, i, k + 1)[c] - corner_of(t, i, k)[c];
            longest = fmax(longest, uz_dot3(edge[k], edge[k]));
        }
        uz_cross3(n, edge[0], edge[1]);
        if (uz_unit3(n) <= NO_HEIGHT * longest) {
            memset(n, 0, 3 * sizeof *n);
            continue;
        }
        for (int k = 0; k < 3; k++) { /* by the angle at each corner */
            double across[3], back[3];
            for (int c = 0; c < 3; c++)
                back[c] = -edge[(k + 2) % 3][c];
            uz_cross3(across, edge[k], back);
            const double angle = atan2(sqrt(uz_dot3(across, across)), uz_dot3(edge[k], back));
            for (int c = 0; c < 3; c++)
                t->point_normal[3 * t->corner[3 * i + k] + c] += angle * n[c];
        }
    }
    for (int64_t i = 0; i < t->n_points; i++)
        if (uz_unit3(t->point_normal + 3 * i) < UZ_SAME_DIRECTION) /* the corner of a sheet folded onto itself */
            memset(t->point_normal + 3 * i, 0, 3 * sizeof *t->point_normal);
    for (int64_t i = 0; i < 3 * t->n; i++)
        if (t->beside[i] < 0) {
            memset(t->point_normal + 3 * way_from(t, i), 0, 3 * sizeof *t->point_normal);
            memset(t->point_normal + 3 * way_to(t, i), 0, 3 * sizeof *t->point_normal);
        }
}

/* The height of a triangle over its edge k. */
static double height_over(const uz_triangulation *t, int64_t triangle, int k)
{
    double along[3], up[3], across[3];
    for (int c = 0; c < 3; c++) {
        along[c] = corner_of(t, triangle, k + 1)[c] - corner_of(t, triangle, k)[c];
        up[c] = corner_of(t, triangle, k + 2)[c] - corner_of(t, triangle, k)[c];
    }
    uz_cross3(across, along, up);
    return sqrt(uz_dot3(across, across) / uz_dot3(along, along));
}

/* Two chords of length h that meet at an angle w are on a circle of radius R = h / w, which is h^2 / 8 R = h w / 8 off
 * in their middles; h: the mean height of two triangles over their edge. */
static void estimate_sagittas(uz_triangulation *t)
{
    for (int64_t i = 0; i < 3 * t->n; i++) {
        const int64_t here = i / 3, there = t->beside[i];
        double across[3];
        if (there < 0)
            continue;
        int back = 0;
        while (back < 2 && t->corner[3 * there + back] != way_to(t, i))
            back++;
        uz_cross3(across, t->normal + 3 * here, t->normal + 3 * there);
        const double turn = asin(fmin(1, sqrt(uz_dot3(across, across))));
        const bool curve = turn < FEATURE && uz_dot3(t->normal + 3 * here, t->normal + 3 * there) > 0;
        const double h = 0.5 * (height_over(t, here, (int)(i % 3)) + height_over(t, there, back));
        t->sagitta[here] = fmax(t->sagitta[here], curve ? turn * h / 8 : 0);
    }
}

/* ---- all of it */

uz_status uz_triangulation_init(uz_triangulation *out, int64_t n, const double *x, const double *y, const double *z,
                                double scale, bool inside, const char *where, uz_error *err)
{
    const int64_t slots = slots_for(3 * n);
    uz_triangulation *t = out;
    memset(t, 0, sizeof *t);
    t->n = n;
    int64_t *slot = uz_alloc(slots, sizeof *slot);
    double *box = uz_alloc(6 * n, sizeof *box);
    t->point = uz_alloc(9 * n, sizeof *t->point);
    t->corner = uz_alloc(3 * n, sizeof *t->corner);
    t->beside = uz_alloc(3 * n, sizeof *t->beside);
    t->normal = uz_alloc_zero(3 * n, sizeof *t->normal);
    t->sagitta = uz_alloc_zero(n, sizeof *t->sagitta);
    const bool room = slot && box && t->point && t->corner && t->beside && t->normal && t->sagitta;
    uz_status status = room ? UZ_OK : uz_no_memory(err, "the triangles of an obstacle");
    if (status == UZ_OK) {
        memset(slot, -1, (size_t)slots * sizeof *slot);
        number_points(t, x, y, z, scale, slot);
        memset(slot, -1, (size_t)slots * sizeof *slot);
        t->point_normal = uz_alloc_zero(3 * t->n_points, sizeof *t->point_normal);
        status = t->point_normal ? join(t, slot, scale, where, err) : uz_no_memory(err, "the triangles of an obstacle");
    }
    if (status == UZ_OK)
        status = check_sides(t, inside, where, err);
    if (status == UZ_OK) {
        make_normals(t);
        estimate_sagittas(t);
        for (int64_t i = 0; i < n; i++)
            for (int c = 0; c < 3; c++) {
                const double a = corner_of(t, i, 0)[c], b = corner_of(t, i, 1)[c], d = corner_of(t, i, 2)[c];
                box[6 * i + c] = fmin(fmin(a, b), d);
                box[6 * i + 3 + c] = fmax(fmax(a, b), d);
            }
        status = uz_box_tree_init(&t->tree, n, 3, box, err);
    }
    uz_free_all(slot, box);
    if (status != UZ_OK)
        uz_triangulation_clear(t);
    return status;
}

/* ---- the closest point */

/* The closest point of a triangle; edge and corner as in uz_triangle_place. Returns the squared distance. */
static double closest(double foot[3], int *edge, int *corner, const uz_triangulation *t, int64_t triangle,
                      const double x[3])
{
    const double *a = corner_of(t, triangle, 0), *b = corner_of(t, triangle, 1), *c = corner_of(t, triangle, 2);
    double ab[3], ac[3], ax[3], bx[3], cx[3], part[3] = {0};
    for (int i = 0; i < 3; i++) {
        ab[i] = b[i] - a[i];
        ac[i] = c[i] - a[i];
        ax[i] = x[i] - a[i];
        bx[i] = x[i] - b[i];
        cx[i] = x[i] - c[i];
    }
    const double d1 = uz_dot3(ab, ax), d2 = uz_dot3(ac, ax), d3 = uz_dot3(ab, bx), d4 = uz_dot3(ac, bx);
    const double d5 = uz_dot3(ab, cx), d6 = uz_dot3(ac, cx);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    *edge = *corner = -1;
    if (d1 <= 0 && d2 <= 0) {
        *corner = 0;
    } else if (d3 >= 0 && d4 <= d3) {
        *corner = 1;
    } else if (d6 >= 0 && d5 <= d6) {
        *corner = 2;
    } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        *edge = 0;
        part[1] = d1 / (d1 - d3);
    } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        *edge = 2;
        part[2] = d2 / (d2 - d6);
    } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        *edge = 1;
        part[2] = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        part[1] = 1 - part[2];
    } else {
        part[1] = vb / (va + vb + vc);
        part[2] = vc / (va + vb + vc);
    }
    if (*corner >= 0)
        memcpy(foot, corner_of(t, triangle, *corner), 3 * sizeof *foot);
    for (int i = 0; i < 3 && *corner < 0; i++)
        foot[i] = *edge == 1 ? b[i] + part[2] * (c[i] - b[i]) : a[i] + part[1] * ab[i] + part[2] * ac[i];
    return uz_distance2(x, foot, 3);
}

static double distance_to(const void *ctx, int64_t item, const double *x, double best)
{
    const uz_triangulation *t = ctx;
    const double *n = t->normal + 3 * item;
    double foot[3], off[3];
    int edge, corner;
    for (int c = 0; c < 3; c++)
        off[c] = x[c] - corner_of(t, item, 0)[c];
    const double above = uz_dot3(n, off);
    if ((n[0] == 0 && n[1] == 0 && n[2] == 0) || above * above * (1 - 1e-12) > best)
        return INFINITY; /* of its plane even */
    return closest(foot, &edge, &corner, t, item, x);
}

bool uz_triangulation_nearest(uz_triangle_place *out, const uz_triangulation *t, const double x[3])
{
    out->triangle = uz_box_tree_nearest(&t->tree, x, INFINITY, distance_to, t);
    if (out->triangle < 0)
        return false;
    closest(out->foot, &out->edge, &out->corner, t, out->triangle, x);
    return true;
}
