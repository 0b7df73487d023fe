/* Gaps to rigid obstacles: exact distances, the normal as the gradient, corners, brute force, units, refusals. */
#include "core/random.h"
#include "harness.h"
#include "obstacle/obstacle.h"

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * uz_uniform(seed);
}

static uz_obstacle *made(const uz_contact *contact, uz_model model)
{
    uz_obstacle *obstacle;
    uz_error err = {0};
    const uz_status status = uz_obstacle_new(&obstacle, contact, 0, model, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return obstacle;
}

static uz_gap gap_of(const uz_obstacle *obstacle, double x, double y, double z)
{
    uz_gap gap;
    uz_error err = {0};
    const double at[3] = {x, y, z};
    const uz_status status = uz_obstacle_gap(&gap, obstacle, at, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    return gap;
}

static void near(double got, double want, double tolerance, const char *what)
{
    CHECK_MSG(fabs(got - want) <= tolerance, "%s: got %.17g, want %.17g", what, got, want);
}

static void is_gap(const uz_gap *got, double gap, double nx, double ny, double nz)
{
    near(got->gap, gap, 1e-14, "gap");
    near(got->normal[0], nx, 1e-14, "normal x");
    near(got->normal[1], ny, 1e-14, "normal y");
    near(got->normal[2], nz, 1e-14, "normal z");
}

static uz_contact polyline(double *x, double *y, int64_t n)
{
    return (uz_contact){.kind = UZ_OBSTACLE_POLYLINE, .n_x = n, .x = x, .y = y};
}

/* The gap's normal is of unit length, its gradient by central differences, and points along foot to x. */
static void check_gradient(const uz_obstacle *obstacle, const double x[3], int dim)
{
    const uz_gap here = gap_of(obstacle, x[0], x[1], x[2]);
    const double step = 1e-6;
    double length = 0;
    for (int c = 0; c < 3; c++) {
        double ahead[3] = {x[0], x[1], x[2]}, behind[3] = {x[0], x[1], x[2]};
        length += here.normal[c] * here.normal[c];
        near(x[c] - here.foot[c], here.gap * here.normal[c], 1e-12, "foot");
        if (c >= dim)
            continue;
        ahead[c] += step;
        behind[c] -= step;
        const double slope = (gap_of(obstacle, ahead[0], ahead[1], ahead[2]).gap -
                              gap_of(obstacle, behind[0], behind[1], behind[2]).gap) /
                             (2 * step);
        near(here.normal[c], slope, 1e-5, "gradient");
    }
    near(length, 1, 1e-14, "length");
}

TEST(plane)
{
    const uz_contact contact = {.kind = UZ_OBSTACLE_PLANE, .point = {1, 2}, .normal = {3e200, 4e200}};
    uz_obstacle *o = made(&contact, UZ_PLANE_STRAIN);
    uz_gap gap = gap_of(o, 4, 6, 0);
    is_gap(&gap, 5, 0.6, 0.8, 0);
    gap = gap_of(o, 1 - 0.6, 2 - 0.8, 0);
    is_gap(&gap, -1, 0.6, 0.8, 0);
    CHECK(gap.curvature == 0);
    uz_obstacle_free(o);
}

TEST(circle_and_sphere_from_both_sides)
{
    uz_contact contact = {.kind = UZ_OBSTACLE_ROUND, .point = {1, 2, 3}, .radius = 2};
    uz_obstacle *out = made(&contact, UZ_SOLID);
    uz_gap gap = gap_of(out, 1, 2, 8);
    is_gap(&gap, 3, 0, 0, 1);
    near(gap.curvature, 0.2, 1e-15, "curvature");
    contact.inside = true;
    uz_obstacle *in = made(&contact, UZ_PLANE_STRESS);
    gap = gap_of(in, 1.5, 2, 0);
    is_gap(&gap, 1.5, -1, 0, 0);
    near(gap.curvature, -2, 1e-14, "curvature");
    gap = gap_of(in, 1, -1, 0);
    is_gap(&gap, -1, 0, 1, 0);
    uz_obstacle_free(in);
    uz_obstacle_free(out);
}

TEST(cylinder_has_any_axis)
{
    const uz_contact contact = {.kind = UZ_OBSTACLE_CYLINDER, .point = {5, -1, 2}, .normal = {0, 30, 40}, .radius = 2};
    uz_obstacle *o = made(&contact, UZ_SOLID);
    for (double along = -100; along <= 100; along += 50) {
        const uz_gap gap = gap_of(o, 5 - 3, -1 + 0.6 * along, 2 + 0.8 * along);
        near(gap.gap, 1, 1e-13, "gap");
        near(gap.normal[0], -1, 1e-13, "normal");
    }
    uz_obstacle_free(o);
}

TEST(centre_has_no_normal)
{
    const struct {
        uz_contact contact;
        uz_model model;
        const char *where;
    } all[] = {
        {{.kind = UZ_OBSTACLE_ROUND, .point = {0.1, 0.7}, .radius = 1e-3}, UZ_AXISYMMETRIC, "circle/center"},
        {{.kind = UZ_OBSTACLE_ROUND, .point = {0.1, 0.7, 9}, .radius = 3, .inside = true}, UZ_SOLID, "sphere/center"},
        {{.kind = UZ_OBSTACLE_CYLINDER, .point = {0.1, 0.7, 2}, .normal = {0, 0, 1}, .radius = 3},
         UZ_SOLID,
         "cylinder/point"},
    };
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
        uz_obstacle *o = made(&all[k].contact, all[k].model);
        const double x[3] = {0.1, 0.7, 9};
        uz_gap gap;
        uz_error err = {0};
        CHECK_INT(uz_obstacle_gap(&gap, o, x, &err), UZ_ERR_SCENE);
        CHECK_MSG(strstr(err.where, all[k].where) != NULL, "%s", err.where);
        CHECK(gap.gap == 0 && gap.normal[0] == 0);
        uz_obstacle_free(o);
    }
}

/* Up to a corner that juts out at (1, 1), down, and up again: a groove at (2, 0). The obstacle is below. */
TEST(polyline_corners_and_ends)
{
    double x[] = {0, 1, 2, 3}, y[] = {0, 1, 0, 1};
    const uz_contact contact = polyline(x, y, 4);
    const double s = sqrt(0.5);
    uz_obstacle *o = made(&contact, UZ_PLANE_STRAIN);
    uz_gap gap = gap_of(o, 0, 1, 0);
    is_gap(&gap, s, -s, s, 0);
    gap = gap_of(o, 1, 3, 0); /* over the corner: from corner to point */
    is_gap(&gap, 2, 0, 1, 0);
    near(gap.curvature, 0.5, 1e-15, "curvature");
    gap = gap_of(o, 1.5, 3, 0);
    is_gap(&gap, sqrt(4.25), 0.5 / sqrt(4.25), 2 / sqrt(4.25), 0);
    gap = gap_of(o, 1, 1, 0); /* on it: the mean */
    is_gap(&gap, 0, 0, 1, 0);
    CHECK(gap.curvature == (double)INFINITY);
    gap = gap_of(o, 2, 0, 0);
    is_gap(&gap, 0, 0, 1, 0);
    CHECK(gap.curvature == (double)-INFINITY);
    gap = gap_of(o, 2, 0.5, 0); /* in the groove: the first of two */
    is_gap(&gap, 0.5 * s, s, s, 0);
    gap = gap_of(o, 2, -1, 0); /* below the groove the obstacle's own corner */
    is_gap(&gap, -1, 0, 1, 0);
    gap = gap_of(o, 1, 0.5, 0);
    is_gap(&gap, -0.5 * s, -s, s, 0);
    gap = gap_of(o, -7, -7, 0); /* the ends go on */
    is_gap(&gap, 0, -s, s, 0);
    gap = gap_of(o, 10, 9, 0);
    is_gap(&gap, s, -s, s, 0);
    uz_obstacle_free(o);
}

TEST(closed_polyline_is_a_polygon_or_a_hole)
{
    double x[] = {0, 0, 1, 1, 0}, y[] = {0, 1, 1, 0, 0}, back_x[5], back_y[5];
    for (int i = 0; i < 5; i++) {
        back_x[i] = x[4 - i];
        back_y[i] = y[4 - i];
    }
    const uz_contact solid = polyline(x, y, 5), hole = polyline(back_x, back_y, 5);
    uz_obstacle *in = made(&solid, UZ_PLANE_STRAIN), *out = made(&hole, UZ_PLANE_STRAIN);
    uz_gap gap = gap_of(in, -3, -4, 0);
    is_gap(&gap, 5, -0.6, -0.8, 0);
    gap = gap_of(in, 0.5, 0.75, 0);
    is_gap(&gap, -0.25, 0, 1, 0);
    gap = gap_of(out, 0.5, 0.75, 0);
    is_gap(&gap, 0.25, 0, -1, 0);
    gap = gap_of(out, -3, -4, 0);
    is_gap(&gap, -5, 0.6, 0.8, 0);
    uz_obstacle_free(in);
    uz_obstacle_free(out);
}

/* A long line against a look at every segment. */
TEST(polyline_against_all_segments)
{
    enum { N = 400 };
    double x[N], y[N];
    uint64_t seed = 7;
    for (int i = 0; i < N; i++) {
        x[i] = i + between(&seed, 0, 0.9);
        y[i] = between(&seed, -3, 3);
    }
    const uz_contact contact = polyline(x, y, N);
    uz_obstacle *o = made(&contact, UZ_PLANE_STRAIN);
    for (int k = 0; k < 3000; k++) {
        const double q[2] = {between(&seed, x[0], x[N - 1]), between(&seed, -6, 6)};
        double best = INFINITY, side = 0;
        for (int i = 1; i < N; i++) {
            const double dx = x[i] - x[i - 1], dy = y[i] - y[i - 1];
            double t = ((q[0] - x[i - 1]) * dx + (q[1] - y[i - 1]) * dy) / (dx * dx + dy * dy);
            t = fmin(fmax(t, i == 1 ? -INFINITY : 0), i == N - 1 ? INFINITY : 1);
            best = fmin(best, hypot(q[0] - x[i - 1] - t * dx, q[1] - y[i - 1] - t * dy));
            if (q[0] >= x[i - 1] && q[0] <= x[i])
                side = (q[1] - y[i - 1]) * dx >= (q[0] - x[i - 1]) * dy ? 1 : -1;
        }
        near(gap_of(o, q[0], q[1], 0).gap, side * best, 1e-12, "gap");
    }
    uz_obstacle_free(o);
}

/* The table of a smooth hill, rough by noise. */
enum { NX = 7, NY = 5 };
typedef struct {
    double x[NX], y[NY], z[NX * NY];
    uz_contact contact;
} hill;

static void make_hill(hill *h, uint64_t *seed, double noise)
{
    for (int i = 0; i < NX; i++)
        h->x[i] = i + between(seed, 0, 0.5);
    for (int j = 0; j < NY; j++)
        h->y[j] = j + between(seed, 0, 0.5);
    for (int k = 0; k < NX * NY; k++)
        h->z[k] = sin(h->x[k % NX]) * cos(h->y[k / NX]) + between(seed, -noise, noise);
    h->contact = (uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = NX, .n_y = NY, .x = h->x, .y = h->y, .z = h->z};
}

static double height_of(const hill *h, double x, double y)
{
    const double cx = fmin(fmax(x, h->x[0]), h->x[NX - 1]), cy = fmin(fmax(y, h->y[0]), h->y[NY - 1]);
    int i = 0, j = 0;
    while (i < NX - 2 && cx > h->x[i + 1])
        i++;
    while (j < NY - 2 && cy > h->y[j + 1])
        j++;
    const double s = (cx - h->x[i]) / (h->x[i + 1] - h->x[i]), t = (cy - h->y[j]) / (h->y[j + 1] - h->y[j]);
    const double *z = h->z + j * NX + i;
    return (1 - t) * ((1 - s) * z[0] + s * z[1]) + t * ((1 - s) * z[NX] + s * z[NX + 1]);
}

/* Least distance over a lattice around q, then over ever finer ones around the best place. */
static double sampled_distance(const hill *h, const double q[3])
{
    double at[2] = {q[0], q[1]}, best = fabs(height_of(h, q[0], q[1]) - q[2]), width = best;
    for (int pass = 0; pass < 14; pass++) {
        const int n = pass == 0 ? 150 : 10;
        const double from[2] = {at[0], at[1]};
        for (int i = -n; i <= n; i++)
            for (int j = -n; j <= n; j++) {
                const double x = from[0] + width * i / n, y = from[1] + width * j / n, dz = height_of(h, x, y) - q[2];
                const double d = sqrt((x - q[0]) * (x - q[0]) + (y - q[1]) * (y - q[1]) + dz * dz);
                if (d < best) {
                    best = d;
                    at[0] = x;
                    at[1] = y;
                }
            }
        width *= pass == 0 ? 0.02 : 0.3;
    }
    return best;
}

TEST(heights_against_samples)
{
    uint64_t seed = 11;
    hill h;
    for (int trial = 0; trial < 4; trial++) {
        make_hill(&h, &seed, trial);
        uz_obstacle *o = made(&h.contact, UZ_SOLID);
        for (int k = 0; k < 25; k++) {
            const double q[3] = {between(&seed, -3, NX + 3), between(&seed, -3, NY + 3), between(&seed, -4, 4)};
            const double side = q[2] >= height_of(&h, q[0], q[1]) ? 1 : -1, want = side * sampled_distance(&h, q);
            const uz_gap gap = gap_of(o, q[0], q[1], q[2]);
            near(gap.gap, want, 1e-5, "gap");
            CHECK(fabs(gap.gap) <= fabs(want) + 1e-14);
            near(gap.foot[2], height_of(&h, gap.foot[0], gap.foot[1]), 1e-13, "foot");
        }
        uz_obstacle_free(o);
    }
}

TEST(normals_are_gradients)
{
    uint64_t seed = 5;
    hill h;
    double lx[] = {0, 2, 3, 5, 6}, ly[] = {0, 1, -1, 0, 0.5};
    make_hill(&h, &seed, 0.2);
    uz_contact over_x = {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 5, .x = lx, .z = ly};
    const struct {
        uz_contact contact;
        uz_model model;
    } all[] = {{{.kind = UZ_OBSTACLE_PLANE, .point = {1, 1, 1}, .normal = {1, 2, -2}}, UZ_SOLID},
               {{.kind = UZ_OBSTACLE_ROUND, .point = {3, 9, 1}, .radius = 2}, UZ_SOLID},
               {{.kind = UZ_OBSTACLE_ROUND, .point = {3, 9}, .radius = 2, .inside = true}, UZ_AXISYMMETRIC},
               {{.kind = UZ_OBSTACLE_CYLINDER, .point = {9, 9, 9}, .normal = {1, 2, 3}, .radius = 2}, UZ_SOLID},
               {polyline(lx, ly, 5), UZ_PLANE_STRESS},
               {over_x, UZ_PLANE_STRAIN},
               {h.contact, UZ_SOLID}};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
        const int dim = all[k].model == UZ_SOLID ? 3 : 2;
        uz_obstacle *o = made(&all[k].contact, all[k].model);
        for (int i = 0; i < 40; i++) {
            const double x[3] = {between(&seed, 0, 6), between(&seed, -1, 4), dim == 3 ? between(&seed, -2, 2) : 0};
            check_gradient(o, x, dim);
        }
        uz_obstacle_free(o);
    }
}

/* The curvature is what the gap does beyond its row: half of it times the square of the sliding. */
TEST(curvature_is_the_second_derivative)
{
    uint64_t seed = 3;
    hill h;
    make_hill(&h, &seed, 0);
    uz_obstacle *o = made(&h.contact, UZ_SOLID);
    int seen = 0;
    for (int i = 0; i < 200; i++) {
        const double x = between(&seed, 1, 5), y = between(&seed, 1, 4), step = 1e-4;
        const uz_gap here = gap_of(o, x, y, height_of(&h, x, y) + 0.01);
        const double z = height_of(&h, x, y) + 0.01;
        double largest = 0;
        for (int k = 0; k < 180; k++) { /* tangents all around */
            const double angle = k * 3.14159265358979 / 180, *n = here.normal;
            double t[3] = {cos(angle), sin(angle), 0};
            t[2] = -(t[0] * n[0] + t[1] * n[1]) / n[2];
            const double length = sqrt(1 + t[2] * t[2]), s = step / length;
            const double ahead = gap_of(o, x + s * t[0], y + s * t[1], z + s * t[2]).gap;
            const double behind = gap_of(o, x - s * t[0], y - s * t[1], z - s * t[2]).gap;
            const double second = (ahead - 2 * here.gap + behind) / (step * step);
            largest = fabs(second) > fabs(largest) ? second : largest;
        }
        if (fabs(largest) > 2)
            continue; /* a crease lies between the points */
        seen++;
        near(fabs(here.curvature), fabs(largest), 2e-3 + 1e-2 * fabs(largest), "curvature");
    }
    CHECK(seen > 150);
    uz_obstacle_free(o);
}

/* On a ridge and in a valley of a table, and at places where its cells are one plane. */
TEST(creases_of_a_table)
{
    double x[] = {0, 1, 2}, y[] = {0, 1}, z[] = {0, 1, 0, 0, 1, 0};
    uz_contact contact = {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 3, .n_y = 2, .x = x, .y = y, .z = z};
    const double s = sqrt(0.5);
    uz_obstacle *o = made(&contact, UZ_SOLID);
    uz_gap gap = gap_of(o, 1, 0.5, 3);
    is_gap(&gap, 2, 0, 0, 1);
    near(gap.curvature, 0.5, 1e-15, "curvature");
    gap = gap_of(o, 1, 0.5, 1);
    is_gap(&gap, 0, 0, 0, 1);
    CHECK(gap.curvature == (double)INFINITY);
    gap = gap_of(o, 0.5, 1, 0.5 + s); /* at the edge of the table, which goes on as it is */
    is_gap(&gap, s * s, -s, 0, s);
    CHECK(gap.curvature == 0);
    gap = gap_of(o, -5, -7, 2);
    is_gap(&gap, 2, 0, 0, 1);
    gap = gap_of(o, 0, 0.5, 0);
    CHECK(gap.curvature == (double)-INFINITY);
    uz_obstacle_free(o);
}

/* A point of a body's surface in a ridge: whatever rounding says of the flanks, its row is the same, that of the crest;
 * away from it a flank's. In a block, near its flank, the way to the top is too long. */
TEST(rows_on_a_ridge)
{
    double x[] = {-10, 0, 10}, z[] = {-9, 1, -9}, block_x[] = {0, 0, 1, 1}, block_y[] = {0, 5, 5, 0};
    const uz_contact ridge = {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 3, .x = x, .z = z};
    const uz_contact block = {.kind = UZ_OBSTACLE_POLYLINE, .n_x = 4, .x = block_x, .y = block_y};
    const double down[2] = {0, -1}, s = sqrt(0.5);
    uz_obstacle *o = made(&ridge, UZ_PLANE_STRAIN), *b = made(&block, UZ_PLANE_STRAIN);
    uz_gap gap;
    for (int k = -1; k <= 1; k++)
        for (int deep = 0; deep < 3; deep++) { /* in it, on it, over it by less than is clear */
            const double at[2] = {1e-15 * k, 1 - 0.2 * (deep - 1)};
            CHECK(uz_obstacle_row_gap(&gap, NULL, o, at, down, 0.3, 0.075, NULL) == UZ_OK);
            near(gap.gap, -0.2 * (deep - 1), 1e-12, "gap");
            near(gap.normal[0], 0, 1e-12, "normal");
            near(gap.normal[1], 1, 1e-12, "normal");
        }
    for (int k = -1; k <= 1; k += 2) { /* beside the crest the plane turns, and further on it is the flank's */
        const double before[2] = {0.002 * k, 0.8}, near_it[2] = {0.02 * k, 0.8}, far_off[2] = {k, -0.2};
        CHECK(uz_obstacle_row_gap(&gap, NULL, o, before, down, 0.01, 0.0025, NULL) == UZ_OK);
        near(gap.normal[0], 0, 1e-12, "normal");
        near(gap.gap, -0.2, 1e-12, "gap");
        CHECK(uz_obstacle_row_gap(&gap, NULL, o, near_it, down, 0.01, 0.0025, NULL) == UZ_OK);
        CHECK(k * gap.normal[0] > 0.01 && k * gap.normal[0] < 0.2 && gap.gap > -0.21 && gap.gap < -0.19);
        CHECK(uz_obstacle_row_gap(&gap, NULL, o, far_off, down, 0.01, 0.0025, NULL) == UZ_OK);
        near(gap.normal[0], k * s, 1e-12, "normal");
        near(gap.gap, -0.2 * s, 1e-12, "gap");
    }
    const double beside[2] = {0.1, 0}, none[2] = {0, 0}, amid[2] = {0, 0.5};
    CHECK(uz_obstacle_row_gap(&gap, NULL, b, beside, down, 0.01, 0.0025, NULL) == UZ_OK);
    near(gap.normal[0], -1, 1e-12, "normal");
    near(gap.gap, -0.1, 1e-12, "gap");
    CHECK(uz_obstacle_row_gap(&gap, NULL, o, amid, none, 0.01, 0.0025, NULL) == UZ_OK); /* of a node of no side */
    near(gap.gap, -0.5 * s, 1e-12, "gap");
    uz_obstacle_free(o);
    uz_obstacle_free(b);
}

/* A power of two changes exponents only, other units no more than roundings. */
/* Nodes that more than one flank of a groove holds, and those that are held by one. */
TEST(flanks_of_grooves)
{
    double x[] = {-3, 0, 3}, groove[] = {3, 0, 3}, ridge[] = {-3, 0, -3}, y[] = {-1, 1}, z[] = {3, 0, 3, 3, 0, 3};
    double tooth_x[] = {-3, 0.1, 0.3, 0.5, 3}, tooth[] = {0, 0, 0.4, 0, 0}, fine_x[61], fine[61];
    const double way[3] = {0.5, 0, 0};
    double taken[3];
    const double root = sqrt(0.5);
    uz_contact c = polyline(x, groove, 3);
    uz_gap first, out[3];
    for (int form = 0; form < 2; form++) {
        uz_obstacle *o = made(&c, form ? UZ_SOLID : UZ_PLANE_STRAIN);
        const double up[3] = {0, form ? 0 : 1, form};
        CHECK(uz_obstacle_has_edges(o));
        /* amid, closer to one, in the obstacle, and on its bottom, where the point has the mean of both */
        for (int k = 0; k < 5; k++) {
            const double off = (double[]){0, 0.1, -0.1, 0, 0}[k], high = (double[]){0.2, 0.2, 0.2, -0.2, 0}[k];
            const double at[3] = {off, form ? 0.1 : high, high}, down[3] = {0, -up[1], -up[2]};
            CHECK_INT(uz_obstacle_row_gap(&first, taken, o, at, down, 0.25, 0.0625, NULL), UZ_OK);
            const int found = uz_obstacle_flanks(out, 0, 3, o, at, taken, &first, way);
            bool seen[2] = {false};
            for (int j = -1; j < found; j++) {
                const uz_gap *plane = j < 0 ? &first : &out[j];
                const int side = plane->normal[0] < 0;
                if (fabs(plane->normal[0]) < 0.5) /* the mean */
                    continue;
                seen[side] = true;
                near(fabs(plane->normal[0]), root, 1e-12, "flank");
                near(plane->gap, root * (high + (side ? -off : off)), 1e-12, "gap");
            }
            CHECK_MSG(seen[0] && seen[1] && found < 3, "form %d, point %d: %d flanks", form, k, found);
        }
        /* too far away, and out of sight of the other flank */
        const double far[3] = {2, form ? 0.1 : 2.1, 2.1};
        CHECK_INT(uz_obstacle_gap(&first, o, far, NULL), UZ_OK);
        CHECK_INT(uz_obstacle_flanks(out, 0, 3, o, far, far, &first, way), 0);
        uz_obstacle_free(o);
        c = (uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = 3, .n_y = 2, .x = x, .y = y, .z = z};
    }
    /* not over a ridge, nor on the pieces of a curve; beside a tooth the flank that it may run into */
    for (int k = 0; k < 61; k++) {
        fine_x[k] = 0.1 * (k - 30);
        fine[k] = 0.02 * fine_x[k] * fine_x[k];
    }
    const uz_contact none[] = {polyline(x, ridge, 3), polyline(tooth_x, tooth, 5), polyline(fine_x, fine, 61)};
    const double at[][2] = {{0, -0.1}, {0.7, 0}, {0.03, 0.05}};
    for (int k = 0; k < 3; k++) {
        uz_obstacle *o = made(&none[k], UZ_PLANE_STRAIN);
        CHECK_INT(uz_obstacle_row_gap(&first, taken, o, at[k], (double[]){0, -1}, 0.25, 0.0625, NULL), UZ_OK);
        const int found = uz_obstacle_flanks(out, 0, 3, o, at[k], taken, &first, way);
        CHECK_MSG(found == (k == 1), "obstacle %d: %d flanks", k, found);
        uz_obstacle_free(o);
    }
}

TEST(units_do_not_matter)
{
    uint64_t seed = 23;
    const double factors[] = {0x1p10, 0x1p-300, 0x1p300, 1000};
    for (size_t k = 0; k < 4; k++) {
        hill h, other;
        make_hill(&h, &seed, 0.3);
        other = h;
        other.contact.x = other.x;
        other.contact.y = other.y;
        other.contact.z = other.z;
        for (int i = 0; i < NX * NY; i++) {
            other.x[i % NX] = h.x[i % NX] * factors[k];
            other.y[i % NY] = h.y[i % NY] * factors[k];
            other.z[i] = h.z[i] * factors[k];
        }
        uz_obstacle *a = made(&h.contact, UZ_SOLID), *b = made(&other.contact, UZ_SOLID);
        for (int i = 0; i < 50; i++) {
            const double q[3] = {between(&seed, -1, 8), between(&seed, -1, 6), between(&seed, -2, 2)}, f = factors[k];
            const uz_gap mm = gap_of(a, q[0], q[1], q[2]), m = gap_of(b, q[0] * f, q[1] * f, q[2] * f);
            near(m.gap / f, mm.gap, k < 3 ? 0 : 1e-13, "gap");
            near(m.normal[0], mm.normal[0], k < 3 ? 0 : 1e-12, "normal");
        }
        uz_obstacle_free(a);
        uz_obstacle_free(b);
    }
}

static void refused(const uz_contact *contact, uz_model model, uz_status status, const char *where,
                    const char *fragment)
{
    uz_obstacle *o;
    uz_error err = {0};
    CHECK_INT(uz_obstacle_new(&o, contact, 4, model, &err), status);
    CHECK(!o);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, fragment) != NULL, "\"%s\" lacks \"%s\"", err.message, fragment);
}

TEST(what_is_no_obstacle_is_refused)
{
    double x[] = {0, 1, 1, 2}, y[] = {0, 0, 0, 1}, z[4] = {0};
    uz_contact c = {.kind = UZ_OBSTACLE_ROUND, .radius = 0};
    refused(&c, UZ_PLANE_STRAIN, UZ_ERR_SCENE, "/contacts/4/obstacle/circle/radius", "positive");
    c.radius = (double)NAN;
    refused(&c, UZ_SOLID, UZ_ERR_NOT_FINITE, "/contacts/4/obstacle/sphere/radius", "finite");
    c = (uz_contact){.kind = UZ_OBSTACLE_ROUND, .radius = 1, .point = {0, 0, (double)INFINITY}};
    refused(&c, UZ_SOLID, UZ_ERR_NOT_FINITE, "/contacts/4/obstacle/sphere/center/2", "finite");
    c = (uz_contact){.kind = UZ_OBSTACLE_PLANE};
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/plane/normal", "towards the body");
    c = (uz_contact){.kind = UZ_OBSTACLE_CYLINDER, .radius = 1};
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/cylinder/axis", "direction");
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/cylinder", "circle");
    c = polyline(x, y, 1);
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline/points", "two points");
    c = polyline(x, y, 4);
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline/points/2", "repeats");
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline", "height");
    c = (uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = 4, .x = x, .z = z};
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/height/x/2", "ascend");
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/height", "need y");
    c.n_x = 1;
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/height/x", "two places");
    z[3] = (double)NAN;
    c = (uz_contact){.kind = UZ_OBSTACLE_HEIGHT, .n_x = 2, .n_y = 2, .x = x, .y = x, .z = z};
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/height/y", "leave y out");
    refused(&c, UZ_SOLID, UZ_ERR_NOT_FINITE, "/contacts/4/obstacle/height/z/1/1", "finite");
    z[3] = 0;
    z[1] = 2e6;
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/height/z/0/1", "as good as a step");
    z[1] = 0;
    z[2] = z[3] = -2e6;
    refused(&c, UZ_SOLID, UZ_ERR_SCENE, "/contacts/4/obstacle/height/z/1/0", "as good as a step");
    z[0] = 2e6;
    c.n_y = 0;
    refused(&c, UZ_PLANE_STRAIN, UZ_ERR_SCENE, "/contacts/4/obstacle/height/z/1", "polyline");
    c = (uz_contact){.kind = UZ_OBSTACLE_BODY};
    refused(&c, UZ_SOLID, UZ_ERR_ARGUMENT, "", "body");
}

TEST(lines_that_meet_themselves_are_refused)
{
    double bow_x[] = {0, 2, 0, 2}, bow_y[] = {0, 1, 1, 0}, back_x[] = {0, 2, 1}, back_y[] = {0, 0, 0};
    double cup_x[] = {-1, -2, 2, 1}, cup_y[] = {1, 0, 0, 1}, ok_x[] = {0, 1, 1, 2}, ok_y[] = {0, 0, 1, 1};
    uz_contact c = polyline(bow_x, bow_y, 4);
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline/points", "meets itself");
    c = polyline(back_x, back_y, 3);
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline/points", "beyond point 2");
    c = polyline(cup_x, cup_y, 4); /* its ends meet where they go on */
    refused(&c, UZ_PLANE_STRESS, UZ_ERR_SCENE, "/contacts/4/obstacle/polyline/points", "half line beyond point 0");
    c = polyline(ok_x, ok_y, 4);
    uz_obstacle_free(made(&c, UZ_PLANE_STRESS));
}

TEST(gaps_that_are_no_numbers_are_refused)
{
    double x[] = {0, 1}, y[] = {0, 1}, z[] = {0, 0, 0, 1};
    const uz_contact all[] = {{.kind = UZ_OBSTACLE_PLANE, .normal = {0, 0, 1}},
                              {.kind = UZ_OBSTACLE_ROUND, .radius = 1},
                              {.kind = UZ_OBSTACLE_HEIGHT, .n_x = 2, .n_y = 2, .x = x, .y = y, .z = z}};
    const double at[3] = {(double)NAN, (double)NAN, (double)NAN}, far[3] = {-1e200, 3e200, 1e200};
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
        uz_obstacle *o = made(&all[k], UZ_SOLID);
        uz_gap gap;
        uz_error err = {0}, again = {0};
        CHECK_INT(uz_obstacle_gap(&gap, o, at, &err), UZ_ERR_NOT_FINITE);
        const uz_status status = uz_obstacle_gap(&gap, o, far, &again);
        CHECK(status == UZ_ERR_NOT_FINITE || (k < 2 && status == UZ_OK && gap.gap >= 1e200));
        uz_obstacle_free(o);
    }
    const uz_contact line = polyline(x, y, 2);
    uz_obstacle *o = made(&line, UZ_PLANE_STRAIN);
    uz_gap gap;
    uz_error err = {0};
    CHECK_INT(uz_obstacle_gap(&gap, o, (double[]){1e300, -1e300}, &err), UZ_ERR_NOT_FINITE);
    uz_obstacle_free(o);
}
