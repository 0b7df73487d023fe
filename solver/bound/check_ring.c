/* check_ring.c: sums over elements of rings, where stresses are times the radius.
 *
 * The hoop stress is what equilibrium along the radius makes of T = r sigma: d_r T_rr + d_z T_rz + r f_r. Integrals
 * have the radius below the line, T : C^-1 : T / r and u_r^2 / r, and are finite where both vanish at the axis, as is
 * looked at first. Over triangles they are sums of known accuracy (walk.h). Quadrilaterals are cut until the radius
 * doubles nowhere in a piece, nor does det J; of r = (1 + xi) rho(eta) at a side on the axis only rho counts, as u_r
 * has that factor, too. About a corner that is on the axis alone pieces get smaller and smaller: the last one, 2^-16 of
 * the element's sides, has what little it has a hundred times in the margin, more than twice the ratio by which r there
 * differs from a sum of the two coordinates in any element that is not refused for its shape. */
#include "bound/check.h"

#include <math.h>
#include <string.h>

#define SMALLEST (1. / 65536)

bool uz_is_finite_at_axis(const examination *x, const double *u, const double *stress, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(x->mesh, e, &count);
    const int parts = uz_element_type_of((uz_element_kind)x->mesh->kind[e])->corners;
    bool on_axis[UZ_ELEMENT_NODES] = {false}, finite = true;
    for (int i = 0; i < count; i++) {
        on_axis[i] = uz_is_on_axis(x->body->model, node[i]);
        finite = finite && !(on_axis[i] && fabs(u[2 * node[i]]) > 0);
    }
    for (int k = 0; k < parts; k++) {
        const int next = (k + 1) % parts;
        const bool at[UZ_BOUND_POINTS] = {on_axis[k], on_axis[next], false, on_axis[k] && on_axis[next]};
        for (int i = 0; i < 3 * (x->moments == 2 ? 3 : UZ_BOUND_POINTS); i++)
            finite = finite && !(at[i / 3] && fabs(stress[k * UZ_BOUND_POINTS * 3 + i]) > 0);
    }
    return finite;
}

/* T and its derivatives of a part at a place, from its values at the points; the hoop stress is last. */
static void stress_at(double s[4], const examination *x, double corner[3][2], double slope[3][2], const double *values,
                      const double at[2], int64_t e)
{
    double l[3], rr_by_r = 0, rz_by_z = 0;
    s[0] = s[1] = s[2] = 0;
    for (int i = 0; i < 3; i++)
        l[i] = 1. / 3;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 2; c++)
                l[i] += slope[i][c] * (at[c] - corner[k][c]) / 3;
    for (int i = 0; i < 3 * (x->moments - 1); i++) {
        const int a = i % 3, b = (i + 1) % 3;
        const bool linear = x->moments == 2;
        const double *v = values + 3 * i;
        const double N = linear ? l[a] : i < 3 ? l[a] * (2 * l[a] - 1) : 4 * l[a] * l[b];
        double grad[2];
        for (int c = 0; c < 2; c++)
            grad[c] = linear  ? slope[a][c]
                      : i < 3 ? (4 * l[a] - 1) * slope[a][c]
                              : 4 * (l[a] * slope[b][c] + l[b] * slope[a][c]);
        for (int c = 0; c < 3; c++)
            s[c] += N * v[c];
        rr_by_r += grad[0] * v[0];
        rz_by_z += grad[1] * v[2];
    }
    s[3] = rr_by_r + rz_by_z + at[0] * x->body->force[2 * e];
}

static double examine_part(double lacks[3][2], double *margin, const examination *x, double corner[3][2],
                           const double *values, int64_t e)
{
    const uz_lame lame = uz_element_material(x->body->model, e)->lame;
    double sum = 0, slope[3][2], at[2], weight, s[4];
    uz_triangle_slopes(slope, corner);
    for (uz_walk walk = uz_walk_begin(corner, true, x->body->degree); uz_walk_next(&walk, at, &weight);) {
        stress_at(s, x, corner, slope, values, at, e);
        const double rr = s[0] / at[0], zz = s[1] / at[0], rz = s[2] / at[0], trace = rr + zz + s[3];
        sum += weight * x->body->depth * at[0] *
               (rr * rr + zz * zz + s[3] * s[3] + 2 * rz * rz -
                lame.lambda / (3 * lame.lambda + 2 * lame.mu) * trace * trace) /
               (4 * lame.mu);
    }
    *margin += UZ_WALK_MARGIN * sum;
    for (int a = 0; a < 3; a++) {
        const bool linear = x->moments == 2;
        lacks[a][0] = 0;
        lacks[a][1] = corner[a][0] * x->body->force[2 * e + 1];
        for (int i = 0; i < 3 * (x->moments - 1); i++) {
            const int b = (i + 1) % 3;
            for (int c = 0; c < 2; c++) {
                const double grad = linear  ? slope[i][c]
                                    : i < 3 ? (i == a ? 3 : -1) * slope[i][c]
                                            : 4 * ((a == i - 3 ? slope[b][c] : 0) + (a == b ? slope[i - 3][c] : 0));
                lacks[a][1] += grad * values[3 * i + (c == 0 ? 2 : 1)];
            }
        }
    }
    return sum;
}

static double expand_part(const examination *x, double corner[3][2], const double *values, double free_strain,
                          int64_t e)
{
    double sum = 0, slope[3][2], at[2], weight, s[4];
    uz_triangle_slopes(slope, corner);
    for (uz_walk walk = uz_walk_begin(corner, true, x->body->degree); uz_walk_next(&walk, at, &weight);) {
        stress_at(s, x, corner, slope, values, at, e);
        sum += weight * x->body->depth * free_strain * (s[0] + s[1] + at[0] * s[3]);
    }
    return sum;
}

static void less_motion(double v[2 * UZ_ELEMENT_NODES], const uz_element *element, int nodes)
{
    const double first = v[1];
    (void)element;
    for (int a = 0; a < nodes; a++)
        v[2 * a + 1] -= first;
}

/* ---- the strain energy */

typedef struct {
    uz_element element;
    double xyz[3 * UZ_ELEMENT_NODES], u[2 * UZ_ELEMENT_NODES], free_strain;
    int nodes;
} moved;

/* Of the energy the density at a local point, per area of the reference element. */
static double density(const moved *m, const double point[3])
{
    double grad[UZ_ELEMENT_NODES][3], N[UZ_ELEMENT_NODES], radius = 0, out = 0, e[4] = {0};
    const uz_lame lame = m->element.lame;
    const double det = uz_element_gradients(grad, &m->element, point);
    uz_element_shape(N, m->element.kind, point);
    for (int a = 0; a < m->nodes; a++) {
        const double ur = m->u[2 * a], uz = m->u[2 * a + 1] - m->u[1];
        radius += N[a] * m->xyz[2 * a];
        out += N[a] * ur;
        e[0] += grad[a][0] * (ur - m->u[0]);
        e[1] += grad[a][1] * uz;
        e[2] += grad[a][1] * (ur - m->u[0]) + grad[a][0] * uz;
    }
    e[3] = out / radius;
    for (int k = 0; k < 4; k++)
        e[k] -= k == 2 ? 0 : m->free_strain;
    const double trace = e[0] + e[1] + e[3];
    return det * radius *
           (lame.lambda * trace * trace / 2 + lame.mu * (e[0] * e[0] + e[1] * e[1] + e[3] * e[3] + e[2] * e[2] / 2));
}

static double triangle_energy(double *margin, const moved *m)
{
    double corner[3][2], slope[3][2], at[2], weight, sum = 0;
    memcpy(corner, m->xyz, sizeof corner);
    uz_triangle_slopes(slope, corner);
    for (uz_walk walk = uz_walk_begin(corner, true, 2); uz_walk_next(&walk, at, &weight);) {
        double point[3] = {0};
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 2; c++)
                point[k] += slope[k + 1][c] * (at[c] - corner[0][c]);
        sum += weight / uz_twice_area(corner) * density(m, point);
    }
    *margin += UZ_WALK_MARGIN * sum;
    return sum;
}

/* Where the pole of what is 1 over a positive bilinear function, by its values at a cell's corners, is along lines in
 * both directions, the cell from -1 to 1. */
static void nearest_pole(double z[2], const double v[4])
{
    static const int SIDE[2][2][2] = {{{0, 1}, {3, 2}}, {{0, 3}, {1, 2}}};
    for (int c = 0; c < 2; c++)
        for (int k = 0; k < 2; k++) {
            const double a = v[SIDE[c][k][0]], b = v[SIDE[c][k][1]];
            z[c] = fmin(z[c], a + b > 0 ? (a + b) / fmax(fabs(a - b), 1e-300 * (a + b)) : 1);
        }
}

/* The values that matter to poles at the corners of an element: what is said above of the radius, and det J. */
static void poles_of(double radius[4], double det[4], const moved *m)
{
    static const double CORNER[4][3] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (int k = 0; k < 4; k++) {
        double grad[UZ_ELEMENT_NODES][3];
        const double own = m->xyz[2 * k], next = m->xyz[2 * ((k + 1) % 4)], before = m->xyz[2 * ((k + 3) % 4)];
        const bool on_side = !(next > 0) || !(before > 0);
        radius[k] = own > 0 ? own : on_side ? fmax(next, before) : 0;
        det[k] = uz_element_gradients(grad, &m->element, CORNER[k]);
    }
}

/* z: where the poles along both directions are. Each has points of its own, and what they may be off by. */
static double cell_energy(double *margin, const moved *m, const double low[2], const double high[2], const double z[2],
                          bool smallest)
{
    double at[2][UZ_GAUSS_MOST], weight[2][UZ_GAUSS_MOST], off = 0, sum = 0;
    int n[2];
    for (int c = 0; c < 2; c++) {
        const double q = 1 / (z[c] + sqrt(fmax(0, z[c] * z[c] - 1)));
        n[c] = uz_gauss_points(m->nodes > 4 ? 4 : 3, 64, q, 1e-15);
        off += 64 * pow(q, 2 * n[c] - 6);
        uz_gauss(at[c], weight[c], n[c]);
    }
    for (int g = 0; g < n[0] * n[1]; g++) {
        const int i = g % n[0], j = g / n[0];
        const double point[3] = {low[0] + (high[0] - low[0]) * (1 + at[0][i]) / 2,
                                 low[1] + (high[1] - low[1]) * (1 + at[1][j]) / 2};
        sum += weight[0][i] * weight[1][j] / 4 * (high[0] - low[0]) * (high[1] - low[1]) * density(m, point);
    }
    *margin += (smallest ? 100 : off) * sum;
    return sum;
}

/* By halves, along the direction in which a pole is nearer. */
static double quadrilateral_energy(double *margin, const moved *m)
{
    enum { MOST = 128 };
    struct {
        double low[2], high[2];
    } cell[MOST] = {{{-1, -1}, {1, 1}}};
    double radius[4], det[4], sum = 0;
    poles_of(radius, det, m);
    for (int n = 1; n > 0;) {
        double low[2], high[2], z[2] = {INFINITY, INFINITY}, r[4], d[4];
        memcpy(low, cell[n - 1].low, sizeof low);
        memcpy(high, cell[n - 1].high, sizeof high);
        n--;
        for (int k = 0; k < 4; k++) {
            const double x = (1 + (k == 1 || k == 2 ? high[0] : low[0])) / 2, y = (1 + (k > 1 ? high[1] : low[1])) / 2;
            const double N[4] = {(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y};
            r[k] = N[0] * radius[0] + N[1] * radius[1] + N[2] * radius[2] + N[3] * radius[3];
            d[k] = N[0] * det[0] + N[1] * det[1] + N[2] * det[2] + N[3] * det[3];
        }
        nearest_pole(z, r);
        nearest_pole(z, d);
        const bool alike = fabs(z[0] - z[1]) < 1e-6 * z[0];
        const int c = alike ? (high[0] - low[0] < high[1] - low[1]) : z[1] < z[0];
        const bool smallest = high[c] - low[c] <= 2 * SMALLEST;
        if (z[c] >= 3 || smallest || n + 2 > MOST) {
            sum += cell_energy(margin, m, low, high, z, z[c] < 3);
            continue;
        }
        const double middle = (low[c] + high[c]) / 2;
        for (int half = 0; half < 2; half++, n++) {
            memcpy(cell[n].low, low, sizeof low);
            memcpy(cell[n].high, high, sizeof high);
            (half == 0 ? cell[n].low : cell[n].high)[c] = middle;
        }
    }
    return sum;
}

static double energy_of(double *margin, const examination *x, const double *u, double free_strain, int64_t e)
{
    moved m = {.free_strain = free_strain};
    double off = 0;
    const int64_t *node = uz_mesh_element(x->mesh, e, &m.nodes);
    uz_take_element(&m.element, m.xyz, x, e);
    for (int i = 0; i < 2 * m.nodes; i++)
        m.u[i] = u[2 * node[i / 2] + i % 2];
    const bool triangle = uz_element_type_of(m.element.kind)->corners == 3;
    const double sum = triangle ? triangle_energy(&off, &m) : quadrilateral_energy(&off, &m);
    *margin += x->body->depth * off;
    return x->body->depth * sum;
}

const uz_check_of uz_check_of_rings = {examine_part, expand_part, energy_of, less_motion};
