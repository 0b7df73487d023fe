/* smooth_shape.c: planes, spheres, cylinders, cones and tori through the nodes of a surface. */
#include "obstacle/smooth_shape.h"

#include "core/vector3.h"

#include <math.h>
#include <string.h>

/* Points are on a shape when they are no farther from it than this part of its radius. */
#define ON_SHAPE 1e-6

/* A radius of more than so many times the size of the surface says nothing. */
#define FLAT 1e4

/* What tells shapes of one kind apart: the place by two directions across the axis and the one along it, the axis by
 * its tilt towards the first two, radius, slope, tube. */
enum { TILT = 3, RADIUS = 5, SLOPE, TUBE, PARAMETERS };

static const unsigned char VARIES[][PARAMETERS] = {
    [UZ_SMOOTH_PLANE] = {0, 0, 1, 1, 1, 0, 0, 0},    [UZ_SMOOTH_SPHERE] = {1, 1, 1, 0, 0, 1, 0, 0},
    [UZ_SMOOTH_CYLINDER] = {1, 1, 0, 1, 1, 1, 0, 0}, [UZ_SMOOTH_CONE] = {1, 1, 0, 1, 1, 1, 1, 0},
    [UZ_SMOOTH_TORUS] = {1, 1, 1, 1, 1, 1, 0, 1},
};

/* ---- distances */

/* How far x is outside the shape; out: unit normal of the shape at its nearest point; radial: unit, away from the axis
 * or centre; off: x less `point`; along: the axis. */
static double distance_from(double out[3], double radial[3], double off[3], double *along, const uz_smooth_shape *s,
                            const double x[3])
{
    const double k = s->slope;
    for (int c = 0; c < 3; c++)
        radial[c] = off[c] = x[c] - s->point[c];
    *along = s->kind == UZ_SMOOTH_SPHERE ? 0 : uz_dot3(off, s->axis);
    for (int c = 0; c < 3; c++)
        radial[c] -= *along * s->axis[c];
    const double across = uz_unit3(radial);
    memcpy(out, s->kind == UZ_SMOOTH_PLANE ? s->axis : radial, 3 * sizeof *out);
    switch (s->kind) {
    case UZ_SMOOTH_PLANE:
        return *along;
    case UZ_SMOOTH_CONE:
        for (int c = 0; c < 3; c++)
            out[c] = (radial[c] - k * s->axis[c]) / sqrt(1 + k * k);
        return (across - s->radius - k * *along) / sqrt(1 + k * k);
    case UZ_SMOOTH_TORUS:
        for (int c = 0; c < 3; c++)
            out[c] = (across - s->radius) * radial[c] + *along * s->axis[c];
        return uz_unit3(out) - s->tube;
    default:
        return across - s->radius;
    }
}

void uz_smooth_nearest(double offset[3], double normal[3], const uz_smooth_shape *shape, const double x[3])
{
    double out[3], radial[3], off[3], along;
    memset(offset, 0, 3 * sizeof *offset);
    if (shape->kind == UZ_SMOOTH_NONE)
        return;
    const double distance = distance_from(out, radial, off, &along, shape, x);
    for (int c = 0; c < 3; c++)
        offset[c] = -distance * out[c];
    if (normal)
        memcpy(normal, out, sizeof out);
}

/* ---- Gauss and Newton's method */

/* Solves A x = b, A positive semidefinite, b becomes x; columns that are nothing new get 0. */
static void solve(double A[PARAMETERS][PARAMETERS], double b[PARAMETERS])
{
    double scale[PARAMETERS];
    for (int j = 0; j < PARAMETERS; j++)
        scale[j] = A[j][j];
    for (int j = 0; j < PARAMETERS; j++) {
        if (!(A[j][j] > 1e-13 * scale[j])) {
            for (int i = 0; i < PARAMETERS; i++)
                A[j][i] = A[i][j] = 0;
            A[j][j] = 1;
            b[j] = 0;
        }
        for (int i = j + 1; i < PARAMETERS; i++) {
            const double f = A[i][j] / A[j][j];
            for (int k = j; k < PARAMETERS; k++)
                A[i][k] -= f * A[j][k];
            b[i] -= f * b[j];
        }
    }
    for (int j = PARAMETERS - 1; j >= 0; j--) {
        for (int k = j + 1; k < PARAMETERS; k++)
            b[j] -= A[j][k] * b[k];
        b[j] /= A[j][j];
    }
}

/* The directions in which a shape's parameters move it: away from the axis, or the centre, to one of the points, across
 * that, and along the axis. Returns which point. */
static int64_t set_frame(double e[3][3], const uz_smooth_shape *s, const double *xyz, int64_t n)
{
    const bool round = s->kind == UZ_SMOOTH_SPHERE;
    double most = 0;
    int64_t which = 0;
    memset(e, 0, 9 * sizeof e[0][0]);
    for (int64_t i = 0; i < n; i += 1 + n / 16) {
        const double off[3] = {xyz[3 * i] - s->point[0], xyz[3 * i + 1] - s->point[1], xyz[3 * i + 2] - s->point[2]};
        double arm[3];
        uz_cross3(arm, s->axis, off);
        const double size = round ? uz_dot3(off, off) : uz_dot3(arm, arm);
        if (!(size > 1.01 * most))
            continue;
        most = size;
        which = i;
        memcpy(e[0], off, sizeof off);
    }
    if (round)
        uz_unit3(e[0]);
    const double *known = round ? e[0] : s->axis;
    const double other[3] = {fabs(known[0]) < 0.6, fabs(known[0]) >= 0.6, 0};
    uz_cross3(e[1], known, !round && most > 0 ? e[0] : other);
    uz_unit3(e[1]);
    if (round) {
        uz_cross3(e[2], e[0], e[1]);
        return which;
    }
    uz_cross3(e[0], e[1], s->axis);
    memcpy(e[2], s->axis, sizeof e[2]);
    return which;
}

/* One damped step towards the least squares of the distances: a point's changes by -out . (what the shape moves there).
 * Of the points `some` are looked at; returns the sum of their squares before. */
static double step_towards(uz_smooth_shape *s, const double *xyz, int64_t n, int64_t some, double damping)
{
    double squares = 0;
    double A[PARAMETERS][PARAMETERS] = {{0}}, b[PARAMETERS] = {0};
    const bool torus = s->kind == UZ_SMOOTH_TORUS;
    const double cosine = 1 / sqrt(1 + s->slope * s->slope), foot = s->radius * cosine;
    double e[3][3], turn[2][3], m[3], out[3], radial[3], off[3], along;
    const int64_t which = set_frame(e, s, xyz, n);
    distance_from(m, radial, off, &along, s, xyz + 3 * which);
    const double *grows = torus ? e[0] : m;
    for (int k = 0; k < 2; k++)
        uz_cross3(turn[k], e[2], e[k]);
    for (int64_t k = 0; k < some; k++) {
        const int64_t i = some < n ? (int64_t)((uint64_t)k * 2654435761U % (uint64_t)n) : k; /* no grid's rhythm */
        double J[PARAMETERS], moved[3];
        const double distance = distance_from(out, radial, off, &along, s, xyz + 3 * i);
        for (int c = 0; c < 3; c++)
            J[c] = -uz_dot3(out, e[c]);
        for (int c = 0; c < 2; c++) {
            uz_cross3(moved, turn[c], off);
            J[TILT + c] = -uz_dot3(out, moved);
        }
        /* A larger radius shifts the part that the points are on, and a larger slope tilts it; on a flat part that is
         * all but a small share. So these two keep the shape's place and normal at one of the points: the parameters
         * are far from being each other's double, and the way to a cone's is not along a bent valley. */
        J[RADIUS] = uz_dot3(out, grows) - (torus ? uz_dot3(out, radial) : 1);
        J[SLOPE] = -J[TILT] - along / cosine - s->slope * foot;
        J[TUBE] = -1;
        for (int j = 0; j < PARAMETERS; j++) {
            J[j] *= VARIES[s->kind][j];
            for (int q = 0; q <= j; q++)
                A[j][q] = A[q][j] += J[j] * J[q];
            b[j] -= J[j] * distance;
        }
        squares += distance * distance;
    }
    for (int j = 0; j < PARAMETERS; j++)
        A[j][j] *= 1 + damping;
    solve(A, b);
    const double before = atan(s->slope),
                 angle = fmin(fmax(before + b[SLOPE], fmax(before - 0.5, -1.57)), fmin(before + 0.5, 1.57));
    for (int c = 0; c < 3; c++) {
        s->point[c] += b[0] * e[0][c] - b[RADIUS] * grows[c] + b[1] * e[1][c] + b[2] * e[2][c];
        s->axis[c] += (b[TILT] - tan(angle - before)) * e[0][c] + b[TILT + 1] * e[1][c];
    }
    uz_unit3(s->axis);
    s->slope = tan(angle);
    s->radius = (foot + b[RADIUS]) / cos(angle);
    s->tube += b[TUBE];
    return squares;
}

/* Do all points lie on the shape that steps lead to from here (K. Levenberg, Quart. Appl. Math. 2 (1944) 164-168; D.
 * Marquardt, J. SIAM 11 (1963) 431-441)? size: of the surface. Of many points some are stepped with, all looked at. */
static bool fits(uz_smooth_shape *s, const double *xyz, int64_t n, double size)
{
    enum { STEPS = 400, SOME = 300 }; /* small parts of tori lie at the end of a long bent valley */
    double most = 0, least = INFINITY, damping = 1e-3;
    uz_smooth_shape next = *s;
    const int64_t some = n < SOME ? n : SOME;
    for (int k = 0; k < STEPS && damping < 1e6; k++) {
        const uz_smooth_shape here = next;
        const double squares = step_towards(&next, xyz, n, some, damping);
        if (squares < least) {
            const bool still = squares > (1 - 1e-6) * least;
            damping = fmax(0.1 * damping, 1e-12);
            least = squares;
            *s = here;
            if (still)
                break;
        } else {
            damping *= 100;
            next = *s;
            step_towards(&next, xyz, n, some, damping);
        }
    }
    step_towards(s, xyz, n, n, 0);
    for (int64_t i = 0; i < n; i++) {
        double offset[3];
        uz_smooth_nearest(offset, NULL, s, xyz + 3 * i);
        const double off = sqrt(uz_dot3(offset, offset));
        most = off <= most ? most : off; /* not a number stays */
    }
    const double largest = s->kind == UZ_SMOOTH_TORUS   ? fabs(s->tube)
                           : s->kind == UZ_SMOOTH_PLANE ? size
                                                        : fabs(s->radius) + fabs(s->slope) * size;
    return isfinite(s->radius) && most <= ON_SHAPE * fmin(largest, size) && fabs(s->radius) < FLAT * size &&
           largest < FLAT * size;
}

/* Takes s where the normals of the points are nearer to its own than to those of the shape found so far: two circles,
 * as of one layer of elements, are on a sphere and on a cone as well. What facets turn along the circles is many times
 * what tells these two apart, and is off both alike: the difference of the squares has none of it. It is the squared
 * angle between the shapes where the points have the normals of s, and less that where they have the other's. */
static void take_if_nearer(uz_smooth_shape *found, const uz_smooth_shape *s, const double *xyz, const double *normal,
                           int64_t n)
{
    double nearer = 0, between = 0;
    for (int64_t i = 0; i < n && found->kind != UZ_SMOOTH_NONE; i++) {
        double offset[3], mine[3], its[3], off[3][3];
        uz_smooth_nearest(offset, mine, s, xyz + 3 * i);
        uz_smooth_nearest(offset, its, found, xyz + 3 * i);
        uz_cross3(off[0], its, normal + 3 * i);
        uz_cross3(off[1], mine, normal + 3 * i);
        uz_cross3(off[2], mine, its);
        nearer += (uz_dot3(off[0], off[0]) - uz_dot3(off[1], off[1])) / (double)n;
        between += uz_dot3(off[2], off[2]) / (double)n;
    }
    if (found->kind == UZ_SMOOTH_NONE || nearer > 0.5 * between + 1e-9)
        *found = *s;
}

/* ---- what normals say */

/* All normals of a surface of revolution meet its axis, the line of direction a and moment m: n . m + (x x n) . a = 0.
 * Those of a torus all but meet a second line, too, along its tube. So from the two smallest eigenvectors (a, m) of the
 * least squares, by inverse iteration, those two mixtures are tried that are lines, a . m = 0; then the section's
 * circle through the points turned into one half-plane, by linear least squares (H. Pottmann, J. Wallner,
 * "Computational line geometry", 2001, sections 2.1 and 4.3). */
static bool find_torus(uz_smooth_shape *s, const double *xyz, const double *normal, int64_t n, const double mean[3],
                       double size)
{
    double M[PARAMETERS][PARAMETERS] = {{0}}, A[PARAMETERS][PARAMETERS], v[2][PARAMETERS], trace = 0, q[3] = {0};
    for (int64_t i = 0; i < n; i++) {
        double at[3], row[6];
        for (int c = 0; c < 3; c++) {
            at[c] = (xyz[3 * i + c] - mean[c]) / size;
            row[c] = normal[3 * i + c];
        }
        uz_cross3(row + 3, at, row);
        for (int j = 0; j < 6; j++)
            for (int k = 0; k < 6; k++)
                M[j][k] += row[j] * row[k];
    }
    for (int j = 0; j < 6; j++)
        trace += M[j][j];
    for (int j = 0; j < PARAMETERS; j++) {
        v[0][j] = j < 6;
        v[1][j] = j < 6 ? j - 2 : 0;
    }
    for (int k = 0; k < 40; k++) {
        double along = 0, length = 0;
        memcpy(A, M, sizeof A);
        for (int j = 0; j < 6; j++)
            A[j][j] += 1e-10 * trace;
        solve(A, v[k % 2]);
        for (int j = 0; j < 6; j++)
            along += k % 2 ? v[0][j] * v[1][j] : 0;
        for (int j = 0; j < 6; j++)
            v[k % 2][j] -= along * v[0][j];
        for (int j = 0; j < 6; j++)
            length = hypot(length, v[k % 2][j]);
        for (int j = 0; j < 6; j++)
            v[k % 2][j] /= length;
    }
    for (int c = 0; c < 3; c++) { /* a . m of v0 cos + v1 sin: q0 cos^2 + 2 q1 cos sin + q2 sin^2 */
        q[0] += v[0][c] * v[0][3 + c];
        q[1] += 0.5 * (v[0][c] * v[1][3 + c] + v[1][c] * v[0][3 + c]);
        q[2] += v[1][c] * v[1][3 + c];
    }
    const double middle = atan2(2 * q[1], q[0] - q[2]), most = hypot(q[1], 0.5 * (q[0] - q[2]));
    const double aside = acos(fmin(fmax(-0.5 * (q[0] + q[2]) / most, -1), 1));
    for (int k = 0; k < 2; k++) {
        const double angle = 0.5 * (k == 0 ? middle + aside : middle - aside);
        double line[6], b[PARAMETERS] = {0};
        for (int j = 0; j < 6; j++)
            line[j] = cos(angle) * v[0][j] + sin(angle) * v[1][j];
        *s = (uz_smooth_shape){.kind = UZ_SMOOTH_TORUS, .axis = {line[3], line[4], line[5]}};
        const double share = uz_unit3(s->axis);
        uz_cross3(s->point, s->axis, line);
        for (int c = 0; c < 3; c++)
            s->point[c] = mean[c] + size * s->point[c] / share;
        memset(A, 0, sizeof A);
        for (int64_t i = 0; i < n; i++) { /* across^2 + along^2 = 2 R across + 2 h along + (r^2 - R^2 - h^2) */
            double out[3], radial[3], off[3], along;
            distance_from(out, radial, off, &along, s, xyz + 3 * i);
            const double across = uz_dot3(radial, off), row[3] = {2 * across, 2 * along, 1};
            for (int j = 0; j < 9; j++)
                A[j / 3][j % 3] += row[j / 3] * row[j % 3];
            for (int j = 0; j < 3; j++)
                b[j] += row[j] * (across * across + along * along);
        }
        solve(A, b);
        s->radius = b[0];
        s->tube = sqrt(b[2] + b[0] * b[0] + b[1] * b[1]);
        for (int c = 0; c < 3; c++)
            s->point[c] += b[1] * s->axis[c];
        if (isfinite(s->tube) && fits(s, xyz, n, size) && s->radius > 0)
            return true;
    }
    return false;
}

uz_smooth_shape uz_smooth_shape_of(const double *xyz, const double *normal, int64_t n)
{
    enum { FEW = 6, ENOUGH_FOR_A_CONE = 7, ENOUGH_FOR_A_TORUS = 12 }; /* all six points are on a cone */
    double size = 0, turn = 0, best = 0, mean[3] = {0}, axis[2][3] = {{0}};
    int64_t far = 0;
    for (int64_t i = 0; i < 3 * n; i++)
        mean[i % 3] += xyz[i] / (double)n;
    for (int64_t i = 0; i < n; i++) {
        double d[3], t[3];
        for (int c = 0; c < 3; c++) {
            d[c] = xyz[3 * i + c] - mean[c];
            t[c] = normal[3 * i + c] - normal[c];
        }
        size = fmax(size, 2 * sqrt(uz_dot3(d, d))); /* whichever node is the first */
        if (sqrt(uz_dot3(t, t)) > turn) {
            turn = sqrt(uz_dot3(t, t));
            far = i;
        }
    }
    uz_smooth_shape s = {.kind = UZ_SMOOTH_PLANE, .axis = {normal[0], normal[1], normal[2]}};
    memcpy(s.point, mean, sizeof mean);
    if (turn < 1e-3 && fits(&s, xyz, n, size))
        return s;
    if (n < FEW || turn < 1e-3)
        return (uz_smooth_shape){.kind = UZ_SMOOTH_NONE};
    /* A sphere: normals differ as points do. */
    double d[3], t[3];
    for (int c = 0; c < 3; c++) {
        d[c] = xyz[3 * far + c] - xyz[c];
        t[c] = normal[3 * far + c] - normal[c];
    }
    const double radius = uz_dot3(d, t) / uz_dot3(t, t);
    uz_smooth_shape found = {.kind = UZ_SMOOTH_NONE};
    s = (uz_smooth_shape){.kind = UZ_SMOOTH_SPHERE, .radius = fabs(radius)};
    for (int c = 0; c < 3; c++)
        s.point[c] = xyz[c] - radius * normal[c];
    if (fits(&s, xyz, n, size))
        take_if_nearer(&found, &s, xyz, normal, n);
    /* The axis is across all normals of a cylinder, and across the differences of those of a cone; to a slender or flat
     * one with few faces the cylinder through the points is nearer, as means of the faces' normals differ at random. */
    uz_smooth_shape cylinder = {.kind = UZ_SMOOTH_NONE};
    for (int k = 0; k < (n < ENOUGH_FOR_A_CONE ? 1 : 2); k++) {
        best = 0;
        for (int64_t i = 0; i < n; i++) {
            double other[3], at[3];
            for (int c = 0; c < 3; c++)
                other[c] = k == 0 ? normal[3 * i + c] : normal[3 * i + c] - normal[c];
            uz_cross3(at, k == 0 ? normal : t, other);
            const double length = sqrt(uz_dot3(at, at));
            if (length > best) {
                best = length;
                memcpy(axis[k], at, sizeof at);
            }
        }
        s = (uz_smooth_shape){.kind = k == 0 ? UZ_SMOOTH_CYLINDER : UZ_SMOOTH_CONE, .radius = fabs(radius)};
        if (!(uz_unit3(axis[k]) > 0))
            continue;
        memcpy(s.axis, axis[k], sizeof s.axis);
        for (int c = 0; c < 3; c++) /* opposite the normal, at the height of the points' mean */
            s.point[c] = xyz[c] - radius * normal[c];
        double up = 0;
        for (int c = 0; c < 3; c++)
            up += (mean[c] - s.point[c]) * s.axis[c];
        for (int c = 0; c < 3; c++)
            s.point[c] += up * s.axis[c];
        if (fits(&s, xyz, n, size))
            take_if_nearer(&found, &s, xyz, normal, n);
        cylinder = k == 0 ? s : cylinder;
    }
    s = cylinder;
    s.kind = UZ_SMOOTH_CONE;
    if (n >= ENOUGH_FOR_A_CONE && cylinder.kind != UZ_SMOOTH_NONE && fits(&s, xyz, n, size))
        take_if_nearer(&found, &s, xyz, normal, n);
    if (found.kind == UZ_SMOOTH_NONE && n >= ENOUGH_FOR_A_TORUS && find_torus(&s, xyz, normal, n, mean, size))
        return s;
    return found;
}

/* ---- a quadric near a node */

/* The eight terms that are not the height itself, in a patch's coordinates. */
static void terms_at(double term[PARAMETERS], double x, double y, double z)
{
    const double at[PARAMETERS] = {x, y, x * x, x * y, y * y, x * z, y * z, z * z};
    memcpy(term, at, sizeof at);
}

bool uz_smooth_patch_fit(uz_smooth_patch *out, const double at[3], const double normal[3], const double *xyz, int n)
{
    enum { TURNS = 2, FEWEST = 5 };
    /* Of several that fit the one of the least sum of squares: with xy as two entries of the Hessian, half of its
     * coefficient each, no turn of t about n changes that sum. */
    static const double SHARE[PARAMETERS] = {1, 1, 1, 0.5, 1, 1, 1, 1};
    uz_smooth_patch p = {.size = 0};
    memcpy(p.at, at, sizeof p.at);
    memcpy(p.n, normal, sizeof p.n);
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            p.size += (xyz[3 * i + c] - at[c]) * (xyz[3 * i + c] - at[c]) / n;
    p.size = sqrt(p.size);
    for (int turn = 0; turn < TURNS && n >= FEWEST && p.size > 0; turn++) {
        const double e[3] = {fabs(p.n[0]) < 0.6, fabs(p.n[0]) >= 0.6, 0};
        double A[PARAMETERS][PARAMETERS] = {{0}}, weights = 0;
        uz_cross3(p.t[1], p.n, e);
        uz_unit3(p.t[1]);
        uz_cross3(p.t[0], p.t[1], p.n);
        memset(p.c, 0, sizeof p.c);
        for (int i = 0; i < n; i++) {
            double off[3], term[PARAMETERS];
            for (int c = 0; c < 3; c++)
                off[c] = (xyz[3 * i + c] - at[c]) / p.size;
            const double z = uz_dot3(off, p.n), weight = 1 / pow(uz_dot3(off, off), 2);
            terms_at(term, uz_dot3(off, p.t[0]), uz_dot3(off, p.t[1]), z);
            for (int j = 0; j < PARAMETERS; j++) {
                for (int k = 0; k < PARAMETERS; k++)
                    A[j][k] += weight * term[j] * term[k];
                p.c[j] += weight * term[j] * z;
            }
            weights += weight;
        }
        for (int j = 0; j < PARAMETERS; j++) /* what few or flat nodes do not tell is 0, but for 1e-6 of rounding */
            A[j][j] += 1e-10 * SHARE[j] * weights;
        solve(A, p.c);
        for (int c = 0; c < 3 && turn + 1 < TURNS; c++)
            p.n[c] -= p.c[0] * p.t[0][c] + p.c[1] * p.t[1][c];
        uz_unit3(p.n);
    }
    *out = p;
    return n >= FEWEST && p.size > 0 && isfinite(p.c[0] + p.c[2] + p.c[7]);
}

/* The quadric above x: c_7 z^2 - line z + graph = 0 for its height z over the patch's plane, with these. */
typedef struct {
    double along[2], from, line, graph, discriminant;
} above;

static above look_above(const uz_smooth_patch *p, const double x[3])
{
    double off[3], term[PARAMETERS];
    above a = {.graph = 0};
    for (int c = 0; c < 3; c++)
        off[c] = (x[c] - p->at[c]) / p->size;
    a.along[0] = uz_dot3(off, p->t[0]);
    a.along[1] = uz_dot3(off, p->t[1]);
    a.from = uz_dot3(off, p->n);
    terms_at(term, a.along[0], a.along[1], 0);
    for (int j = 0; j < PARAMETERS; j++)
        a.graph += p->c[j] * term[j];
    a.line = 1 - p->c[5] * a.along[0] - p->c[6] * a.along[1];
    a.discriminant = a.line * a.line - 4 * p->c[7] * a.graph;
    return a;
}

double uz_smooth_patch_discriminant(const uz_smooth_patch *p, const double x[3])
{
    return look_above(p, x).discriminant;
}

double uz_smooth_patch_height(double normal[3], const uz_smooth_patch *p, const double x[3])
{
    const above a = look_above(p, x);
    const double steep = sqrt(fmax(0, a.discriminant)), z = 2 * a.graph / (a.line + steep); /* the root next to 0 */
    const double slope[2] = {p->c[0] + 2 * p->c[2] * a.along[0] + p->c[3] * a.along[1] + p->c[5] * z,
                             p->c[1] + p->c[3] * a.along[0] + 2 * p->c[4] * a.along[1] + p->c[6] * z};
    for (int c = 0; c < 3; c++)
        normal[c] = p->n[c] - (slope[0] * p->t[0][c] + slope[1] * p->t[1][c]) / steep;
    uz_unit3(normal);
    return p->size * (z - a.from);
}
