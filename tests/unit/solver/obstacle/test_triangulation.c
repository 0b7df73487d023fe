/* Surfaces of triangles as obstacles: the signed distance of a box, known exactly, on faces, edges and corners; rims;
 * what is refused; the files that they come from. */
#include "core/random.h"
#include "harness.h"
#include "obstacle/obstacle.h"

#include <stdlib.h>

/* The unit cube by corners (bits x, y, z), normals outwards. */
static const int CUBE[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

typedef struct {
    uz_contact contact;
    double x[36], y[36], z[36];
} cube;

/* The first `triangles` of the cube, times `size`; turned: normals inwards. */
static void make_cube(cube *out, int triangles, double size, bool turned)
{
    for (int i = 0; i < 3 * triangles; i++) {
        const int corner = CUBE[i / 3][turned ? 2 - i % 3 : i % 3];
        out->x[i] = size * (corner & 1);
        out->y[i] = size * (corner >> 1 & 1);
        out->z[i] = size * (corner >> 2 & 1);
    }
    out->contact = (uz_contact){
        .kind = UZ_OBSTACLE_SURFACE, .n_x = 3 * triangles, .x = out->x, .y = out->y, .z = out->z, .inside = false};
}

static uz_obstacle *made(const uz_contact *contact)
{
    uz_obstacle *obstacle = NULL;
    uz_error err = {0};
    const uz_status status = uz_obstacle_new(&obstacle, contact, 0, UZ_SOLID, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return obstacle;
}

static uz_gap gap_of(const uz_obstacle *obstacle, const double x[3])
{
    uz_gap gap;
    uz_error err = {0};
    CHECK_MSG(uz_obstacle_gap(&gap, obstacle, x, &err) == UZ_OK, "%s", err.message);
    return gap;
}

/* The distance of a box 0..1. */
static double box_distance(const double x[3])
{
    double outside = 0, within = -INFINITY;
    for (int c = 0; c < 3; c++) {
        const double off = fabs(x[c] - 0.5) - 0.5;
        within = fmax(within, off);
        outside += fmax(off, 0) * fmax(off, 0);
    }
    return within > 0 ? sqrt(outside) : within;
}

static void check_points(const uz_obstacle *o, double size, double sign)
{
    uint64_t seed = 7;
    for (int i = 0; i < 4000; i++) {
        double x[3], unit[3], length = 0;
        for (int c = 0; c < 3; c++) { /* also exactly above edges, corners and diagonals */
            unit[c] = i % 3 == 0 ? (int)(9 * uz_uniform(&seed)) / 4.0 - 0.5 : 2 * uz_uniform(&seed) - 0.5;
            x[c] = size * unit[c];
        }
        const double want = sign * box_distance(unit);
        const uz_gap gap = gap_of(o, x);
        CHECK_MSG(fabs(gap.gap / size - want) < 1e-12, "(%g, %g, %g): %g, not %g", unit[0], unit[1], unit[2],
                  gap.gap / size, want);
        for (int c = 0; c < 3; c++) {
            length += gap.normal[c] * gap.normal[c];
            CHECK(fabs(x[c] - gap.foot[c] - gap.gap * gap.normal[c]) < 1e-12 * size);
        }
        CHECK(fabs(length - 1) < 1e-14);
    }
}

TEST(the_distance_of_a_box_from_both_sides)
{
    static const double SIZES[] = {1, 1e-150, 1e150};
    for (int i = 0; i < 3; i++) {
        cube c;
        make_cube(&c, 12, SIZES[i], false);
        uz_obstacle *o = made(&c.contact);
        check_points(o, SIZES[i], 1);
        uz_obstacle_free(o);
        for (int turned = 0; turned < 2; turned++) { /* a hole: normals either way */
            make_cube(&c, 12, SIZES[i], turned);
            c.contact.inside = true;
            o = made(&c.contact);
            check_points(o, SIZES[i], -1);
            uz_obstacle_free(o);
        }
    }
}

TEST(edges_and_corners_jut_out_or_in)
{
    cube c;
    make_cube(&c, 12, 1, false);
    uz_obstacle *o = made(&c.contact);
    uz_gap gap = gap_of(o, (const double[3]){2, 0.5, 2});
    CHECK(fabs(gap.normal[0] - sqrt(0.5)) < 1e-15 && fabs(gap.curvature - sqrt(0.5)) < 1e-15);
    gap = gap_of(o, (const double[3]){1, 1, 1}); /* on a corner the mean of its three planes */
    for (int k = 0; k < 3; k++)
        CHECK(fabs(gap.normal[k] - sqrt(1. / 3)) < 1e-15);
    CHECK(gap.gap == 0 && gap.curvature == (double)INFINITY);
    gap = gap_of(o, (const double[3]){0.25, 0.25, 1.5}); /* on the diagonal of a face: flat */
    CHECK(gap.curvature == 0 && gap.normal[2] == 1 && gap.facets == 0);
    uz_obstacle_free(o);
    c.contact.inside = true;
    o = made(&c.contact);
    gap = gap_of(o, (const double[3]){1, 0.5, 1});
    CHECK(gap.gap == 0 && gap.curvature == -(double)INFINITY && fabs(gap.normal[0] + sqrt(0.5)) < 1e-15);
    uz_obstacle_free(o);
}

TEST(beyond_its_rim_a_surface_is_not_there)
{
    cube c;
    make_cube(&c, 2, 1, true); /* the floor z = 0, seen from above */
    uz_obstacle *o = made(&c.contact);
    static const double AT[5][4] = {
        {0.5, 0.2, 0.5, 0.5}, {0.5, 0.2, -0.5, -0.5}, {1.3, 0.5, 0.4, 0.5}, {1.3, 0.5, -0.4, 0.5}, {1.3, 1.4, 0, 0.5}};
    for (int i = 0; i < 5; i++)
        CHECK_MSG(fabs(gap_of(o, AT[i]).gap - AT[i][3]) < 1e-15, "%d: %g", i, gap_of(o, AT[i]).gap);
    CHECK(fabs(gap_of(o, AT[4]).normal[0] - 0.6) < 1e-15);
    uz_obstacle_free(o);
}

static void refuse(const uz_contact *contact, const char *says)
{
    uz_obstacle *obstacle;
    uz_error err = {0};
    CHECK(uz_obstacle_new(&obstacle, contact, 3, UZ_SOLID, &err) == UZ_ERR_SCENE && !obstacle);
    CHECK_MSG(strstr(err.message, says) && strcmp(err.where, "/contacts/3/obstacle/surface") == 0, "%s: %s", err.where,
              err.message);
}

TEST(what_is_no_obstacle)
{
    cube c;
    make_cube(&c, 12, 1, true);
    refuse(&c.contact, "point inwards");
    make_cube(&c, 10, 1, false);
    c.contact.inside = true;
    refuse(&c.contact, "is open at triangle 1 ");
    make_cube(&c, 12, 1, false);
    for (int k = 0; k < 2; k++) { /* one triangle turned, then one twice */
        const double first = c.x[33], second = c.y[33], third = c.z[33];
        c.x[33] = k ? c.x[0] : c.x[34];
        c.y[33] = k ? c.y[0] : c.y[34];
        c.z[33] = k ? c.z[0] : c.z[34];
        c.x[34] = k ? c.x[1] : first;
        c.y[34] = k ? c.y[1] : second;
        c.z[34] = k ? c.z[1] : third;
        c.x[35] = k ? c.x[2] : c.x[35];
        c.y[35] = k ? c.y[2] : c.y[35];
        c.z[35] = k ? c.z[2] : c.z[35];
        refuse(&c.contact, "the same way");
    }
    uz_obstacle *obstacle;
    uz_error err = {0};
    CHECK(uz_obstacle_new(&obstacle, &c.contact, 0, UZ_PLANE_STRAIN, &err) == UZ_ERR_SCENE);
    CHECK(strstr(err.message, "polyline"));
}

TEST(facets_of_a_cylinder_are_told_by_their_sagitta)
{
    enum { SIDES = 32 };
    double x[6 * SIDES], y[6 * SIDES], z[6 * SIDES];
    const double R = 3, angle = 2 * 3.14159265358979323846 / SIDES;
    for (int i = 0; i < 6 * SIDES; i++) { /* two triangles a side */
        static const int ALONG[6] = {0, 1, 1, 0, 1, 0}, UP[6] = {0, 0, 1, 0, 1, 1};
        const int j = (i / 6 + ALONG[i % 6]) % SIDES;
        x[i] = R * cos(angle * j);
        y[i] = R * sin(angle * j);
        z[i] = 10 * UP[i % 6];
    }
    const uz_contact contact = {.kind = UZ_OBSTACLE_SURFACE, .n_x = 6 * SIDES, .x = x, .y = y, .z = z};
    uz_obstacle *o = made(&contact);
    const double facets = gap_of(o, (const double[3]){5, 0.1, 5}).facets, want = R * (1 - cos(angle / 2));
    CHECK_MSG(fabs(facets / want - 1) < 0.02, "%g, not %g", facets, want);
    uz_obstacle_free(o);
}

/* ---- files */

TEST(corners_that_are_rounded_apart_are_one)
{
    static const char *const FILE_TEXT = "solid\n"
                                         "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 0 10 0\n"
                                         "endloop\nendfacet\n"
                                         "facet normal 0 0 1\nouter loop\nvertex 10.000001 0 0\nvertex 10 10 0\n"
                                         "vertex -1e-9 9.999999 0\nendloop\nendfacet\n"
                                         "facet\nouter loop\nvertex 0 0 0\nvertex 10 0 0\nvertex 10.000001 0 0\n"
                                         "endloop\nendfacet\nendsolid\n";
    uz_triangles t;
    uz_error err = {0};
    const uz_status status = uz_triangles_read(&t, "stl", FILE_TEXT, strlen(FILE_TEXT), 0, &err);
    CHECK_MSG(status == UZ_OK, "%s", err.message);
    CHECK(t.n == 2 && t.left_out == 1 && t.x[1] == t.x[3] && t.x[2] == t.x[5] && t.y[2] == t.y[5]);
    CHECK(uz_triangles_check(&t, false, &err) == UZ_OK);
    uz_triangles_clear(&t);
}

TEST(memory_is_bounded_and_every_beginning_of_a_file_read_or_refused)
{
    static const char *const FILE_TEXT = "# a\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0\nf 1/1 2/2/2 3//3 -1\n";
    uz_triangles t;
    uz_error err = {0};
    for (size_t len = 0; len <= strlen(FILE_TEXT); len++) {
        const uz_status status = uz_triangles_read(&t, "obj", FILE_TEXT, len, 0, &err);
        CHECK(status == UZ_OK ? t.n > 0 : t.n == 0 && !t.x && err.message[0]);
        uz_triangles_clear(&t);
    }
    CHECK(uz_triangles_read(&t, "obj", FILE_TEXT, strlen(FILE_TEXT), 0, &err) == UZ_OK && t.n == 2);
    uz_triangles_clear(&t);
    CHECK(uz_triangles_read(&t, "obj", FILE_TEXT, strlen(FILE_TEXT), 100, &err) == UZ_ERR_LIMIT && err.line == 6);
}

/* A square written with two corners swapped is two triangles, one the other way round: found by the fuzzer. */
TEST(the_fold_of_a_sheet_has_a_direction)
{
    static const char FOLDED[] = "v 10 0 0\nv 1 1 0\nv 0 1 0\nv 0.2 0 0\nf 1 2 4 3\n";
    static const double ON[3][3] = {{10, 0, 0}, {5, 0, 0}, {0.2, 0, 0}};
    uz_triangles t;
    uz_error err = {0};
    const uz_status status = uz_triangles_read(&t, "obj", FOLDED, sizeof FOLDED - 1, 0, &err);
    CHECK_MSG(status == UZ_OK && t.n == 2, "%s", err.message);
    uz_obstacle *o = made(&(uz_contact){.kind = UZ_OBSTACLE_SURFACE, .n_x = 3 * t.n, .x = t.x, .y = t.y, .z = t.z});
    for (int i = 0; i < 3; i++) {
        const uz_gap gap = gap_of(o, ON[i]);
        const double *n = gap.normal;
        CHECK_MSG(gap.gap == 0 && fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-14, "%d: %g", i, gap.gap);
    }
    CHECK(fabs(gap_of(o, (double[3]){5, -2, 0}).gap - 2) < 1e-14);
    uz_obstacle_free(o);
    uz_triangles_clear(&t);
}
