/* check_ring.c: sums over elements of rings, where stresses are times the radius.
 *
 * The hoop stress is what equilibrium along the radius makes of T = r sigma: d_r T_rr + d_z T_rz + r f_r. Integrals
 * have the radius below the line, T : C^-1 : T / r and u_r^2 / r, and are finite where both vanish at the axis, as is
 * looked at first. Over triangles they are sums of known accuracy (walk.h). Quadrilaterals are cut until what is
 * below the line, the radius or det J, doubles nowhere in a piece; of r = (1 + xi) rho(eta) at a side on the axis only
 * rho counts, as u_r has that factor, too. About a corner that is on the axis alone pieces get smaller and smaller: the
 * last one, 2^-16 of the element's sides, has what little it has a hundred times in the margin, more than twice the
 * ratio by which r there differs from a sum of the two coordinates in any element that is not refused for its shape. */
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

/* The stress at the points of a part, of polynomials of degree 1 at its corners, of degree 2 in the middles of its
 * sides, too: deviator and trace, the hoop stress times the radius as well. Returns how many points these are: with a
 * force along the radius that hoop stress is of degree 2. */
static int stress_at_points(double dev[UZ_BOUND_POINTS][4], double trace[UZ_BOUND_POINTS], const examination *x,
                            double corner[3][2], double slope[3][2], const double *values, int64_t e)
{
    const bool linear = x->moments == 2;
    const int points = linear && !(fabs(x->body->force[2 * e]) > 0) ? 3 : UZ_BOUND_POINTS;
    for (int i = 0; i < points; i++) {
        const double *a = corner[i % 3], *b = corner[i < 3 ? i : (i + 1) % 3];
        const double at[2] = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
        stress_at(dev[i], x, corner, slope, values, at, e);
        dev[i][3] *= at[0];
        trace[i] = dev[i][0] + dev[i][1] + dev[i][3];
        for (int c = 0; c < 4; c++)
            dev[i][c] -= c == 2 ? 0 : trace[i] / 3;
    }
    return points;
}

/* Integrals over the radius of the products of the polynomials that are 1 at a point each: the lower triangle. */
static void weigh_products(double M[UZ_BOUND_POINTS][UZ_BOUND_POINTS], int points, double corner[3][2],
                           double slope[3][2], int degree)
{
    double at[2], weight;
    memset(M, 0, UZ_BOUND_POINTS * sizeof M[0]);
    for (uz_walk walk = uz_walk_begin(corner, true, degree); uz_walk_next(&walk, at, &weight);) {
        double l[3], N[UZ_BOUND_POINTS];
        for (int i = 1; i < 3; i++)
            l[i] = slope[i][0] * (at[0] - corner[0][0]) + slope[i][1] * (at[1] - corner[0][1]);
        l[0] = 1 - l[1] - l[2];
        for (int i = 0; i < 3; i++) {
            N[i] = points == 3 ? l[i] : l[i] * (2 * l[i] - 1);
            N[3 + i] = 4 * l[i] * l[(i + 1) % 3];
        }
        weight /= at[0];
        for (int i = 0; i < points; i++)
            for (int j = 0; j <= i; j++)
                M[i][j] += weight * N[i] * N[j];
    }
}

static double examine_part(double lacks[3][2], double *margin, const examination *x, double corner[3][2],
                           const double *values, int64_t e)
{
    const uz_lame lame = uz_element_material(x->body->model, e)->lame;
    double sum = 0, slope[3][2], dev[UZ_BOUND_POINTS][4], trace[UZ_BOUND_POINTS], M[UZ_BOUND_POINTS][UZ_BOUND_POINTS];
    uz_triangle_slopes(slope, corner);
    const int points = stress_at_points(dev, trace, x, corner, slope, values, e);
    weigh_products(M, points, corner, slope, x->body->degree);
    for (int i = 0; i < points; i++)
        for (int j = 0; j <= i; j++) {
            const double *s = dev[i], *t = dev[j];
            sum += (i == j ? 1 : 2) * M[i][j] *
                   ((s[0] * t[0] + s[1] * t[1] + s[3] * t[3] + 2 * s[2] * t[2]) / (4 * lame.mu) +
                    trace[i] * trace[j] / (6 * (3 * lame.lambda + 2 * lame.mu)));
        }
    sum *= x->body->depth;
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

/* ---- the strain energy
 *
 * With a the strain along the radius and the axis together, h = u_r / r the hoop strain, H what it is in the middle and
 * v = u_r - H r, the trace is b + v / r, b = a + H, and the density times the radius
 *
 *     r (mu (e_rr^2 + e_zz^2 + 2 e_rz^2) + lambda b^2 / 2) + lambda b v + (lambda v^2 / 2 + mu u_r^2) / r.
 *
 * The first part has det J alone below the line; the second, whatever its sign, is a polynomial, as b det J is; only
 * the last one needs many points, and no derivatives. Free expansion is taken off h, and its work off u_r. */

typedef struct {
    uz_element element;
    double xyz[3 * UZ_ELEMENT_NODES], u[2 * UZ_ELEMENT_NODES], free_strain, hoop; /* H */
    double det[4]; /* J at the corners of a quadrilateral */
    int nodes;
} moved;

/* The radius, and u_r less free expansion. */
static void look_at_radius(double *radius, double *out, const moved *m, const double point[3])
{
    double N[UZ_ELEMENT_NODES];
    *radius = *out = 0;
    uz_element_shape(N, m->element.kind, point);
    for (int a = 0; a < m->nodes; a++) {
        *radius += N[a] * m->xyz[2 * a];
        *out += N[a] * m->u[2 * a];
    }
    *out -= m->free_strain * *radius;
}

/* At a local point, per area of the reference element: the first part, and the second -> *mixed. */
static double density(double *mixed, const moved *m, const double point[3])
{
    const uz_lame lame = m->element.lame;
    double grad[UZ_ELEMENT_NODES][3], radius, out, e[3] = {-m->free_strain, -m->free_strain, 0};
    const double det = uz_element_gradients(grad, &m->element, point);
    look_at_radius(&radius, &out, m, point);
    for (int a = 0; a < m->nodes; a++) {
        const double ur = m->u[2 * a] - m->u[0], uz = m->u[2 * a + 1] - m->u[1];
        e[0] += grad[a][0] * ur;
        e[1] += grad[a][1] * uz;
        e[2] += grad[a][1] * ur + grad[a][0] * uz;
    }
    const double b = e[0] + e[1] + m->hoop;
    *mixed = det * lame.lambda * b * (out - m->hoop * radius);
    return det * radius * (lame.mu * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] / 2) + lame.lambda / 2 * b * b);
}

/* The last part, per area. */
static double hoop_density(const moved *m, const double point[3])
{
    double radius, out;
    look_at_radius(&radius, &out, m, point);
    const double v = out - m->hoop * radius;
    return (m->element.lame.lambda / 2 * v * v + m->element.lame.mu * out * out) / radius;
}

/* The same at a point of a quadrilateral, per area of the reference element. */
static double hoop_density_there(double *mixed, const moved *m, const double point[3])
{
    const double x = point[0], y = point[1], *d = m->det;
    const double det = ((1 - x) * ((1 - y) * d[0] + (1 + y) * d[3]) + (1 + x) * ((1 - y) * d[1] + (1 + y) * d[2])) / 4;
    *mixed = 0;
    return det * hoop_density(m, point);
}

static double triangle_energy(double *margin, const moved *m)
{
    const uz_element_type *type = uz_element_type_of(UZ_TRI6);
    const uz_gauss_rule rule = m->nodes == 3 ? type->rule : type->energy; /* of degree 2 and 4 */
    double corner[3][2], slope[3][2], at[2], weight, sum = 0, hoop = 0, crossed = 0;
    memcpy(corner, m->xyz, sizeof corner);
    uz_triangle_slopes(slope, corner);
    for (uz_walk walk = uz_walk_begin(corner, true, m->nodes == 3 ? 1 : 2); uz_walk_next(&walk, at, &weight);) {
        double point[3] = {0};
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 2; c++)
                point[k] += slope[k + 1][c] * (at[c] - corner[0][c]);
        hoop += weight * hoop_density(m, point);
    }
    for (int g = 0; g < rule.count; g++) {
        double mixed;
        sum += rule.point[g].weight * density(&mixed, m, rule.point[g].at);
        crossed += rule.point[g].weight * mixed;
    }
    *margin += UZ_WALK_MARGIN * hoop + UZ_SUM_ROUNDING * fabs(crossed);
    return sum + crossed + hoop;
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

/* Of an integrand over a positive bilinear function, all of degree 3, with quadratic elements 5, along each direction:
 * the points along one in which its pole is at z, and what they may be off by, as a part of what is nowhere negative.
 * Over what is nearly constant it is nearly a polynomial. */
static int points_for(double *off, const moved *m, double z)
{
    const int exact = m->nodes > 4 ? 3 : 2;
    const double q = 1 / (z + sqrt(fmax(0, z * z - 1)));
    if (16 * q <= UZ_WALK_MARGIN) {
        *off += 16 * q;
        return exact;
    }
    const int n = uz_gauss_points(exact + 1, 64, q, 1e-15);
    *off += 64 * pow(q, 2 * n - 6);
    return n;
}

/* At a local point, per area of the reference element: what is nowhere negative, and a polynomial -> *mixed. */
typedef double (*part_of_density)(double *mixed, const moved *m, const double point[3]);

/* z: where the poles along both directions are. Each has points of its own, and what they may be off by. */
static double cell_energy(double *margin, const moved *m, part_of_density part, const double low[2],
                          const double high[2], const double z[2], bool smallest)
{
    double at[2][UZ_GAUSS_MOST], weight[2][UZ_GAUSS_MOST], off = 0, sum = 0, crossed = 0;
    int n[2];
    for (int c = 0; c < 2; c++) {
        n[c] = points_for(&off, m, z[c]);
        uz_gauss(at[c], weight[c], n[c]);
    }
    for (int g = 0; g < n[0] * n[1]; g++) {
        const int i = g % n[0], j = g / n[0];
        const double point[3] = {low[0] + (high[0] - low[0]) * (1 + at[0][i]) / 2,
                                 low[1] + (high[1] - low[1]) * (1 + at[1][j]) / 2};
        const double w = weight[0][i] * weight[1][j] / 4 * (high[0] - low[0]) * (high[1] - low[1]);
        double mixed;
        sum += w * part(&mixed, m, point);
        crossed += w * mixed;
    }
    *margin += (smallest ? 100 : off) * sum + UZ_SUM_ROUNDING * fabs(crossed);
    return sum + crossed;
}

/* By halves, along the direction in which a pole is nearer. below: what is below the line, at the corners. */
static double sum_over_cells(double *margin, const moved *m, part_of_density part, const double below[4])
{
    enum { MOST = 128 };
    struct {
        double low[2], high[2];
    } cell[MOST] = {{{-1, -1}, {1, 1}}};
    double sum = 0;
    for (int n = 1; n > 0;) {
        double low[2], high[2], z[2] = {INFINITY, INFINITY}, v[4];
        memcpy(low, cell[n - 1].low, sizeof low);
        memcpy(high, cell[n - 1].high, sizeof high);
        n--;
        for (int k = 0; k < 4; k++) {
            const double x = (1 + (k == 1 || k == 2 ? high[0] : low[0])) / 2, y = (1 + (k > 1 ? high[1] : low[1])) / 2;
            v[k] = (1 - x) * (1 - y) * below[0] + x * (1 - y) * below[1] + x * y * below[2] + (1 - x) * y * below[3];
        }
        nearest_pole(z, v);
        const bool alike = fabs(z[0] - z[1]) < 1e-6 * z[0];
        const int c = alike ? (high[0] - low[0] < high[1] - low[1]) : z[1] < z[0];
        const bool smallest = high[c] - low[c] <= 2 * SMALLEST;
        if (z[c] >= 3 || smallest || n + 2 > MOST) {
            sum += cell_energy(margin, m, part, low, high, z, z[c] < 3);
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

static double quadrilateral_energy(double *margin, moved *m)
{
    double radius[4];
    poles_of(radius, m->det, m);
    return sum_over_cells(margin, m, density, m->det) + sum_over_cells(margin, m, hoop_density_there, radius);
}

static double energy_of(double *margin, const examination *x, const double *u, double free_strain, int64_t e)
{
    static const double MIDDLE[2][3] = {{0}, {1. / 3, 1. / 3}};
    moved m = {.free_strain = free_strain};
    double off = 0, radius, out;
    const int64_t *node = uz_mesh_element(x->mesh, e, &m.nodes);
    uz_take_element(&m.element, m.xyz, x, e);
    for (int i = 0; i < 2 * m.nodes; i++)
        m.u[i] = u[2 * node[i / 2] + i % 2];
    const bool triangle = uz_element_type_of(m.element.kind)->corners == 3;
    look_at_radius(&radius, &out, &m, MIDDLE[triangle]);
    m.hoop = out / radius;
    const double sum = triangle ? triangle_energy(&off, &m) : quadrilateral_energy(&off, &m);
    *margin += x->body->depth * off;
    return x->body->depth * sum;
}

const uz_check_of uz_check_of_rings = {examine_part, expand_part, energy_of, less_motion};
