/* Planes, spheres, cylinders, cones and tori are found by nodes on them and rough normals, and nothing else is. */
#include "harness.h"
#include "obstacle/smooth_shape.h"

#include <math.h>
#include <string.h>

enum { ALONG = 5, AROUND = 9, N = ALONG * AROUND };

typedef struct {
    double xyz[3 * N], normal[3 * N];
} cloud;

/* Any rotation, and then a translation by much more than the size. */
static void place(double out[3], const double x[3], double far)
{
    static const double R[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
    for (int c = 0; c < 3; c++)
        out[c] = R[c][0] * x[0] + R[c][1] * x[1] + R[c][2] * x[2] + far;
}

/* radius(z), on an arc; normals are off by `rough`, in directions that change. side: 1 out, -1 into the shape. */
static cloud points_of(uz_smooth_kind kind, double radius, double slope, double arc, double rough, double side,
                       double far)
{
    cloud made = {{0}, {0}};
    for (int i = 0; i < N; i++) {
        const int row = i / AROUND;
        const double phi = arc * (i % AROUND) / (AROUND - 1) + 0.01 * (i % 3), z = 0.3 * radius * row;
        double x[3], n[3];
        if (kind == UZ_SMOOTH_SPHERE) {
            const double up = z / (2 * radius);
            const double at[3] = {cos(phi) * cos(up), sin(phi) * cos(up), sin(up)};
            for (int c = 0; c < 3; c++) {
                x[c] = radius * at[c];
                n[c] = at[c];
            }
        } else if (kind == UZ_SMOOTH_TORUS) { /* its tube has half the radius */
            const double up = 0.8 * z / radius - 0.3;
            const double at[3] = {cos(phi) * cos(up), sin(phi) * cos(up), sin(up)};
            memcpy(
                x,
                (double[3]){radius * (cos(phi) + 0.5 * at[0]), radius * (sin(phi) + 0.5 * at[1]), 0.5 * radius * at[2]},
                sizeof x);
            memcpy(n, at, sizeof n);
        } else {
            const double r = radius + slope * z, k = kind == UZ_SMOOTH_CONE ? slope : 0;
            const double at[3] = {cos(phi), sin(phi), -k};
            memcpy(x,
                   (double[3]){(kind == UZ_SMOOTH_CONE ? r : radius) * at[0],
                               (kind == UZ_SMOOTH_CONE ? r : radius) * at[1], z},
                   sizeof x);
            for (int c = 0; c < 3; c++)
                n[c] = at[c] / sqrt(1 + k * k);
        }
        for (int c = 0; c < 3; c++)
            n[c] = side * n[c] + rough * sin(7.3 * i + 2.1 * c);
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int c = 0; c < 3; c++)
            n[c] /= length;
        place(made.xyz + 3 * i, x, far);
        place(made.normal + 3 * i, n, 0);
    }
    return made;
}

TEST(shapes_are_found)
{
    static const uz_smooth_kind kinds[] = {UZ_SMOOTH_SPHERE, UZ_SMOOTH_CYLINDER, UZ_SMOOTH_CONE, UZ_SMOOTH_TORUS};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 24; i++) {
            const double radius = pow(10, i % 4 - 1), arc = i % 3 == 0 ? 6 : i % 3 == 1 ? 1.5 : 0.7;
            const double far = i % 2 ? 0 : 30 * radius, side = i % 5 ? 1 : -1;
            const cloud of = points_of(kinds[k], radius, 0.2, arc, i % 6 < 3 ? 0 : 0.02, side, far);
            const uz_smooth_shape s = uz_smooth_shape_of(of.xyz, of.normal, N);
            CHECK_MSG(s.kind == kinds[k], "shape %d case %d: found %d", k, i, (int)s.kind);
            CHECK_MSG(s.kind == UZ_SMOOTH_CONE || fabs(s.radius / radius - 1) < 1e-9, "%d %d: %g", k, i, s.radius);
            for (int j = 0; j < N; j++) { /* a point off the shape comes back to it */
                double off[3], x[3], size = 0;
                for (int c = 0; c < 3; c++)
                    x[c] = of.xyz[3 * j + c];
                uz_smooth_nearest(off, NULL, &s, x);
                for (int c = 0; c < 3; c++)
                    size = fmax(size, fabs(off[c]));
                CHECK_MSG(size < 1e-9 * radius, "%d %d: node %d is off by %g", k, i, j, size);
            }
        }
}

/* One layer of elements: two circles are on a sphere, on a cone and on cylinders. */
TEST(two_circles_are_told_by_their_normals)
{
    static const uz_smooth_kind kinds[] = {UZ_SMOOTH_SPHERE, UZ_SMOOTH_CYLINDER, UZ_SMOOTH_CONE};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 12; i++) {
            const cloud of = points_of(kinds[k], pow(10, i % 4 - 1), 0.2, i < 6 ? 1.5 : 0.7, i < 4 ? 0.02 : 0, 1, 0);
            const uz_smooth_shape s = uz_smooth_shape_of(of.xyz, of.normal, 2 * AROUND);
            CHECK_MSG(s.kind == kinds[k], "shape %d case %d: found %d", k, i, (int)s.kind);
        }
}

/* Two faces around and four along: only normals of facets, of which those at the ends are turned by half a face. */
TEST(few_faces_of_a_cone_are_enough)
{
    enum { COLUMNS = 3, ROWS = 5 };
    static const double AT[COLUMNS] = {0, 0.1647, 0.3491}, NORMAL[COLUMNS] = {0.0823, 0.1745, 0.2569};
    static const double Z[ROWS] = {0, 1.5, 2.5, 3.6, 5.6}, SLOPE = -0.27;
    double xyz[3 * COLUMNS * ROWS], normal[3 * COLUMNS * ROWS], off[3];
    for (int i = 0; i < COLUMNS * ROWS; i++) {
        const double a = AT[i % COLUMNS], b = NORMAL[i % COLUMNS], z = Z[i / COLUMNS], r = 12 + SLOPE * z;
        const double length = sqrt(1 + SLOPE * SLOPE);
        memcpy(xyz + 3 * i, (double[3]){r * cos(a), r * sin(a), z}, sizeof off);
        memcpy(normal + 3 * i, (double[3]){cos(b) / length, sin(b) / length, -SLOPE / length}, sizeof off);
    }
    const uz_smooth_shape s = uz_smooth_shape_of(xyz, normal, COLUMNS * ROWS);
    CHECK_INT(s.kind, UZ_SMOOTH_CONE);
    CHECK_MSG(fabs(fabs(s.slope) + SLOPE) < 1e-12 && fabs(fabs(s.axis[2]) - 1) < 1e-12, "%g", s.slope);
    for (int i = 0; i < COLUMNS * ROWS; i++) {
        uz_smooth_nearest(off, NULL, &s, xyz + 3 * i);
        CHECK_MSG(fabs(off[0]) + fabs(off[1]) + fabs(off[2]) < 1e-12, "point %d is off by %g", i, off[0]);
    }
}

/* Three nodes by four on a part that turns by little, whichever of them is the first: a larger radius is all but a
 * shift there, and a larger slope a tilt. */
TEST(flat_parts_are_found_in_any_numbering)
{
    enum { COLUMNS = 3, ROWS = 4, ALL = COLUMNS * ROWS };
    static const uz_smooth_kind kinds[] = {UZ_SMOOTH_SPHERE, UZ_SMOOTH_CYLINDER, UZ_SMOOTH_CONE};
    static const double ARC[] = {0.01, 0.03, 0.1}, AT[COLUMNS] = {0, 0.55, 1}, SLOPE = 0.4;
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3 * ALL; j++) {
            const double arc = ARC[j / ALL];
            double xyz[3 * ALL], normal[3 * ALL];
            for (int i = 0; i < ALL; i++) {
                const int node = (i + j) % ALL, row = node / COLUMNS;
                const double a = arc * AT[node % COLUMNS], z = 0.5 * arc * row,
                             up = kinds[k] == UZ_SMOOTH_SPHERE ? z : 0;
                const double slope = kinds[k] == UZ_SMOOTH_CONE ? SLOPE : 0, r = 1 - slope * z;
                const double out[3] = {cos(a) * cos(up), sin(a) * cos(up), slope + sin(up)};
                const double at[3] = {r * out[0], r * out[1], kinds[k] == UZ_SMOOTH_SPHERE ? sin(up) : z};
                double rough[3];
                for (int c = 0; c < 3; c++) /* as means of facets are */
                    rough[c] = out[c] / sqrt(1 + slope * slope) + 0.1 * arc * sin(7.3 * node + 2.1 * c);
                place(xyz + 3 * i, at, 1);
                place(normal + 3 * i, rough, 0);
            }
            const uz_smooth_shape s = uz_smooth_shape_of(xyz, normal, ALL);
            CHECK_MSG(s.kind == kinds[k], "shape %d, arc %g, from node %d: found %d", k, arc, j % ALL, (int)s.kind);
        }
}

/* What is a sphere to all but the last of the digits that count is one in any numbering, or in none. */
TEST(what_is_nearly_a_shape_is_one_in_any_numbering)
{
    enum { COLUMNS = 5, ROWS = 4, ALL = COLUMNS * ROWS };
    int some = 0;
    for (int k = 0; k < 40; k++) { /* paraboloids, which are farther and farther from a sphere */
        const double bend = 0.002 + 0.0002 * k;
        int found = 0;
        for (int j = 0; j < ALL; j++) {
            double xyz[3 * ALL], normal[3 * ALL];
            for (int i = 0; i < ALL; i++) {
                const int node = (i + j) % ALL, row = node / COLUMNS;
                const double x = node % COLUMNS - 1.8, y = 0.9 * row - 1, slope[2] = {2 * bend * x, 2 * bend * y};
                const double at[3] = {x, y, -bend * (x * x + y * y)},
                             steep = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
                for (int c = 0; c < 3; c++) {
                    xyz[3 * i + c] = at[c];
                    normal[3 * i + c] = (c == 2 ? 1 : slope[c]) / steep;
                }
            }
            found += uz_smooth_shape_of(xyz, normal, ALL).kind == UZ_SMOOTH_SPHERE;
        }
        CHECK_MSG(found == 0 || found == ALL, "bend %g: %d of %d", bend, found, ALL);
        some += found;
    }
    CHECK(some > 0 && some < 40 * ALL);
}

TEST(offsets_lead_to_the_nearest_point)
{
    const uz_smooth_shape cone = {UZ_SMOOTH_CONE, {0, 0, 0}, {0, 0, 1}, 2, 0.75, 0};
    const uz_smooth_shape torus = {UZ_SMOOTH_TORUS, {0, 0, 0}, {0, 0, 1}, 5, 0, 2};
    const uz_smooth_shape ball = {.kind = UZ_SMOOTH_SPHERE, .point = {1, 0, 0}, .radius = 2};
    double off[3], normal[3];
    uz_smooth_nearest(off, normal, &cone, (double[3]){2 + 0.8, 0, -0.6}); /* by 1 along (0.8, -0.6) from (2, 0) */
    CHECK(fabs(off[0] + 0.8) < 1e-14 && fabs(off[1]) < 1e-14 && fabs(off[2] - 0.6) < 1e-14);
    CHECK(fabs(normal[0] - 0.8) < 1e-14 && fabs(normal[1]) < 1e-14 && fabs(normal[2] + 0.6) < 1e-14);
    uz_smooth_nearest(off, normal, &torus, (double[3]){0, 5 + 3, 4}); /* 5 from the section's centre */
    CHECK(fabs(off[0]) < 1e-14 && fabs(off[1] + 1.8) < 1e-14 && fabs(off[2] + 2.4) < 1e-14);
    CHECK(fabs(normal[0]) < 1e-14 && fabs(normal[1] - 0.6) < 1e-14 && fabs(normal[2] - 0.8) < 1e-14);
    uz_smooth_nearest(off, normal, &ball, (double[3]){1, 3, 0});
    CHECK(fabs(off[0]) < 1e-14 && fabs(off[1] + 1) < 1e-14 && fabs(off[2]) < 1e-14);
    CHECK(fabs(normal[0]) < 1e-14 && fabs(normal[1] - 1) < 1e-14 && fabs(normal[2]) < 1e-14);
}

/* A quadric is found as such, also at the end of the surface, and whatever rough normal it begins with. */
TEST(patches_lie_on_an_ellipsoid)
{
    static const double R[3] = {3, 4, 5};
    double xyz[3 * N], at[3], normal[3], exact[3], rough[3], x[3];
    for (int i = 0; i < N; i++) {
        const int column = i % AROUND, row = i / AROUND;
        const double a = 0.1 * column + 0.02 * sin(3.0 * i), b = 0.1 * row + 0.02 * cos(5.0 * i);
        const double from[3] = {R[0] * cos(a) * cos(b), R[1] * sin(a) * cos(b), R[2] * sin(b)};
        place(xyz + 3 * i, from, 7);
    }
    for (int i = 0; i < N; i += 11) {
        const int column = i % AROUND, row = i / AROUND;
        const double a = 0.1 * column + 0.02 * sin(3.0 * i), b = 0.1 * row + 0.02 * cos(5.0 * i);
        const double n[3] = {cos(a) * cos(b) / R[0], sin(a) * cos(b) / R[1], sin(b) / R[2]};
        double others[3 * N];
        uz_smooth_patch patch;
        memcpy(at, xyz + 3 * i, sizeof at);
        memcpy(others, xyz, sizeof others);
        memcpy(others + 3 * i, xyz + 3 * (N - 1), sizeof at); /* all but itself */
        place(exact, n, 0);
        for (int c = 0; c < 3; c++)
            rough[c] = exact[c] + 0.01 * sin(2.0 * c);
        const double length = sqrt(exact[0] * exact[0] + exact[1] * exact[1] + exact[2] * exact[2]);
        const double off = sqrt(rough[0] * rough[0] + rough[1] * rough[1] + rough[2] * rough[2]);
        for (int c = 0; c < 3; c++)
            rough[c] /= off;
        CHECK(uz_smooth_patch_fit(&patch, at, rough, others, N - 1));
        CHECK(fabs(uz_smooth_patch_height(normal, &patch, at)) < 1e-14);
        for (int c = 0; c < 3; c++)
            CHECK_MSG(fabs(normal[c] - exact[c] / length) < 1e-5, "node %d: %g", i, normal[c] - exact[c] / length);
        const double from[3] = {R[0] * cos(a + 0.1) * cos(b), R[1] * sin(a + 0.1) * cos(b), R[2] * sin(b)};
        place(x, from, 7);
        for (int c = 0; c < 3; c++)
            x[c] -= 0.02 * patch.n[c]; /* as far off as a facet is */
        const double height = uz_smooth_patch_height(normal, &patch, x);
        CHECK_MSG(fabs(height - 0.02) < 2e-6, "node %d: %g", i, height - 0.02);
    }
    uz_smooth_patch patch;
    CHECK(!uz_smooth_patch_fit(&patch, xyz, exact, xyz + 3, 4));
}

/* Five columns of nodes on a wave are on a quadric of two sheets. What is above a face between them is the one that
 * goes through the node, which leads from node to node without a leap. */
TEST(a_patch_stays_on_its_sheet)
{
    enum { COLUMNS = 5, ROWS = 3, POINTS = 40 };
    static const double X[COLUMNS] = {-1.9205, -0.8581, 0.2042, 1.2666, 2.329},
                        Z[COLUMNS] = {2.6614, 2.5909, 2.7567, 2.8508, 2.6982}, UP[3] = {0, 0, 1};
    for (int of = 0; of < COLUMNS; of++) {
        double at[3] = {X[of], 0, Z[of]}, others[3 * (COLUMNS * ROWS - 1)], normal[3], before = 0;
        int n = 0;
        uz_smooth_patch patch;
        for (int i = 0; i < COLUMNS * ROWS; i++) {
            const int row = i / COLUMNS;
            const double x[3] = {X[i % COLUMNS], 0.6074 * (row - 1), Z[i % COLUMNS]};
            if (i != COLUMNS + of)
                memcpy(others + 3 * n++, x, sizeof x);
        }
        CHECK(uz_smooth_patch_fit(&patch, at, UP, others, n));
        for (int k = 0; k <= 2 * POINTS; k++) { /* over the facets on both sides */
            const int left = k < POINTS ? of - 1 : of;
            const double s = (double)(k % POINTS) / POINTS;
            if (left < 0 || left + 1 >= COLUMNS)
                continue;
            const double x[3] = {(1 - s) * X[left] + s * X[left + 1], 0.1, (1 - s) * Z[left] + s * Z[left + 1]};
            const double height = uz_smooth_patch_height(normal, &patch, x);
            CHECK_MSG(fabs(height) < 0.25 && (k % POINTS == 0 || fabs(height - before) < 0.04), "column %d at %g: %g",
                      of, x[0], height);
            CHECK(uz_smooth_patch_discriminant(&patch, x) > 0.2);
            before = height;
        }
    }
}

/* Two rows tell nothing of how a surface bends from one to the other: it is not what rounding makes of it, which
 * depends on the order of the nodes. */
TEST(rounding_bends_no_patch)
{
    enum { NODES = 7 };
    static const double X[NODES + 1][3] = {{0.31, 0, 0.02},    {-1.02, 0, 0.05},    {1.27, 0, 0.09},
                                           {2.21, 0, 0.31},    {-1.02, 0.83, 0.05}, {0.31, 0.83, 0.02},
                                           {1.27, 0.83, 0.09}, {2.21, 0.83, 0.31}};
    static const double UP[3] = {0, 0, 1}, BETWEEN[3] = {0.7, 0.4, 0.06};
    double first = NAN;
    for (int turn = 0; turn < NODES; turn++) {
        double others[3 * NODES], normal[3];
        uz_smooth_patch patch;
        for (int i = 0; i < NODES; i++)
            memcpy(others + 3 * i, X[1 + (i + turn) % NODES], sizeof X[0]);
        CHECK(uz_smooth_patch_fit(&patch, X[0], UP, others, NODES));
        const double height = uz_smooth_patch_height(normal, &patch, BETWEEN);
        first = turn == 0 ? height : first;
        CHECK_MSG(fabs(height - first) < 1e-6, "%g: %g", height, height - first);
    }
}

/* ... nor what the axes make of it: a patch that has turned with its nodes is above the same places as before. */
TEST(axes_bend_no_patch)
{
    enum { COLUMNS = 4, ROWS = 2, NODES = COLUMNS * ROWS };
    double first = NAN;
    for (int turn = 0; turn < 8; turn++) {
        const double a = 0.3 * turn, axes[3][3] = {{cos(a), sin(a), 0}, {-sin(a), cos(a), 0}, {0, 0, 1}};
        double xyz[3 * NODES], between[3] = {0}, normal[3];
        uz_smooth_patch patch;
        for (int i = 0; i < NODES; i++) {
            const int row = i / COLUMNS;
            const double x = i % COLUMNS - 1 + 0.4 * row, y = 0.8 * row;
            const double at[3] = {x, y, 0.1 * x * x + 0.2 * x * y};
            for (int c = 0; c < 3; c++)
                xyz[3 * i + c] = at[0] * axes[0][c] + at[1] * axes[1][c] + at[2] * axes[2][c];
        }
        for (int k = 0; k < 3 * 4; k++) /* in the middle of the face at the first node */
            between[k % 3] += 0.25 * xyz[3 * (k / 6 * COLUMNS + k / 3 % 2) + k % 3];
        CHECK(uz_smooth_patch_fit(&patch, xyz, axes[2], xyz + 3, NODES - 1));
        const double height = uz_smooth_patch_height(normal, &patch, between);
        first = turn == 0 ? height : first;
        CHECK_MSG(fabs(height - first) < 1e-6, "%g: %g", height, height - first);
    }
}

/* Cones have six parameters: any six points are on one, whose normals may be anywhere. */
TEST(six_nodes_tell_no_cone)
{
    for (int i = 0; i < 20; i++) {
        double xyz[18], normal[18];
        for (int k = 0; k < 6; k++) {
            const double x = k / 3 ? 1 : -1, y = k % 3 - 1 + 0.1 * sin(3.0 * i + k), bend = 0.1 + 0.02 * i;
            const double slope[2] = {bend * (x + y), bend * (x - y)},
                         length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
            memcpy(xyz + 3 * k, (double[3]){x, y, 0.5 * bend * (x * x + 2 * x * y - y * y)}, 3 * sizeof x);
            memcpy(normal + 3 * k, (double[3]){-slope[0] / length, -slope[1] / length, 1 / length}, 3 * sizeof x);
        }
        const uz_smooth_shape s = uz_smooth_shape_of(xyz, normal, 6);
        CHECK_MSG(s.kind == UZ_SMOOTH_NONE, "surface %d: found %d", i, (int)s.kind);
    }
}

TEST(other_surfaces_are_none)
{
    cloud plane, saddle, bent = points_of(UZ_SMOOTH_CYLINDER, 1, 0, 2, 0, 1, 0);
    for (int i = 0; i < N; i++) {
        const int row = i / AROUND;
        const double x = 0.1 * (i % AROUND), y = 0.1 * row;
        memcpy(plane.xyz + 3 * i, (double[3]){x, y, 0}, 3 * sizeof x);
        memcpy(plane.normal + 3 * i, (double[3]){0, 0, 1}, 3 * sizeof x);
        memcpy(saddle.xyz + 3 * i, (double[3]){x, y, x * y}, 3 * sizeof x);
        const double length = sqrt(1 + x * x + y * y);
        memcpy(saddle.normal + 3 * i, (double[3]){-y / length, -x / length, 1 / length}, 3 * sizeof x);
    }
    bent.xyz[3 * 20] += 1e-4; /* one node is not on it */
    CHECK_INT(uz_smooth_shape_of(plane.xyz, plane.normal, N).kind, UZ_SMOOTH_PLANE);
    CHECK_INT(uz_smooth_shape_of(saddle.xyz, saddle.normal, N).kind, UZ_SMOOTH_NONE);
    CHECK_INT(uz_smooth_shape_of(bent.xyz, bent.normal, N).kind, UZ_SMOOTH_NONE);
    CHECK_INT(uz_smooth_shape_of(bent.xyz, bent.normal, 3).kind, UZ_SMOOTH_NONE);
}
