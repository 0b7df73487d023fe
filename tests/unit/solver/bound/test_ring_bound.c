/* The guaranteed bound on the whole error of bodies of revolution: elements, and what it proves. */
#include "bound/bound.h"
#include "bound/walk.h"
#include "bound_scenes.h"
#include "linalg/blas.h"
#include "sanitized.h"
#include "scene_fixture.h"

enum { RINGS = 12 };
#define PI 3.14159265358979323846

static qp_random shuffled = {1};

/* Rules of n points: exact for polynomials of degree 2n - 1, and for no more; points within, weights positive. */
TEST(gauss_rules)
{
    for (int n = 1; n <= UZ_GAUSS_MOST; n++) {
        double at[UZ_GAUSS_MOST], weight[UZ_GAUSS_MOST];
        uz_gauss(at, weight, n);
        for (int degree = 0; degree <= 2 * n; degree++) {
            double sum = 0;
            for (int i = 0; i < n; i++)
                sum += weight[i] * pow(at[i], degree);
            const double off = fabs(sum - (degree % 2 ? 0 : 2. / (degree + 1)));
            CHECK_MSG(degree == 2 * n ? n > 20 || off > 1e-14 : off < 1e-15, "%d points, x^%d: %g", n, degree, off);
        }
        for (int i = 0; i < n; i++)
            CHECK(fabs(at[i]) < 1 && weight[i] > 0 && (i == 0 || at[i] < at[i - 1]));
    }
    CHECK_INT(uz_gauss_points(3, 20, 1e-300, 1e-15), 4);
    CHECK_INT(uz_gauss_points(4, 64, 1, 1e-15), UZ_GAUSS_MOST);
    for (int n = uz_gauss_points(3, 64, 0.1, 1e-15), k = 0; k < 2; k++)
        CHECK((64 * pow(0.1, 2 * (n - k) - 6) <= 1e-15) == (k == 0));
}

/* A ring of the radii `inner` to `inner` + 1, one high, of n x n cells. */
static uz_scene ring_scene(double inner, int64_t n, const char *element)
{
    uz_scene scene = box_scene(1, 1, n, n);
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    scene.box.origin[0] = inner;
    scene.model = UZ_AXISYMMETRIC;
    scene.materials[0].young = 1000;
    scene.materials[0].poisson = 0.3;
    return scene;
}

/* Moves corners within a ring of a hole of 0 or 1 by up to a fifth of a cell of 1 / 6. */
static void shuffle(double *x)
{
    const double r = x[0] - floor(x[0]);
    const bool inside = r > 0.01 && r < 0.99 && x[1] > 0.01 && x[1] < 0.99;
    for (int c = 0; c < 2 && inside; c++)
        x[c] += 0.06 * (random_unit(&shuffled) - 0.5);
}

/* But for the one along the axis no motion is without stiffness, wherever the element is; tractions at the axis are
 * none, and no unknowns. */
TEST(elements_leave_no_moment_without_stiffness)
{
    static const struct {
        int corners, at_axis; /* moments there, of degree 1 */
        double xy[8];
    } SHAPES[] = {{3, 0, {2, 0, 3, .2, 2.3, .9}},          {3, 4, {0, 0, 1, .2, 0, .9}},
                  {3, 2, {0, 0, 1, .2, .8, .9}},           {3, 2, {1, 0, 2, 0, 0, 1}},
                  {4, 0, {2, 0, 3, 0, 3, 1, 2, 1}},        {4, 0, {2, 0, 3, 0, 3.1, 1.3, 2.2, .8}},
                  {4, 4, {0, 0, 1, 0, 1, 1, 0, 1}},        {4, 4, {0, 0, 1, 0, 1.2, 1.1, 0, 1}},
                  {4, 2, {0, 0, 1, -.5, 1.5, .5, .5, .8}}, {4, 0, {1000, 0, 1001, 0, 1001, 1, 1000, 1}}};
    for (size_t shape = 0; shape < sizeof SHAPES / sizeof *SHAPES; shape++)
        for (int degree = 1; degree <= 2; degree++) {
            const int corners = SHAPES[shape].corners, at_axis = SHAPES[shape].at_axis;
            const int64_t axis = at_axis == 4 ? 2 * (degree + 3) : 2 * at_axis;
            check_element_alone(UZ_AXISYMMETRIC, SHAPES[shape].xy, corners, degree, 2 * corners * (degree + 1) - axis,
                                1);
        }
}

/* A rod that is pulled, one that gets warm where it is pulled, and one of no contraction that stands: polynomials of
 * the spaces, with a hole and without one. */
TEST(nothing_is_lost_where_the_answer_is_exact)
{
    for (int k = 0; k < 24; k += step_of_cases()) {
        const int state = k / 8;
        uz_scene scene = ring_scene(k / 4 % 2, 6, BOUND_ELEMENTS[k % 4]);
        if (state < 2 || k % 4 == 2) /* a distorted quad8 has no polynomials of degree 2 */
            body_give_mesh(&scene, shuffle);
        else
            body_give_mesh(&scene, NULL);
        body_straighten(&scene);
        add_support(&scene, "bottom", NAN, 0);
        if (state == 0)
            add_load(&scene, "top", 0, 3);
        if (state == 1) {
            scene.materials[0].expansion = 1e-3;
            add_support(&scene, "top", NAN, 0.02);
            bound_load(&scene, UZ_LOAD_TEMPERATURE, "all", 10, 0);
        }
        if (state == 2) {
            scene.materials[0].poisson = 0;
            bound_load(&scene, UZ_LOAD_BODY_FORCE, "all", 0, -2);
        }
        const uz_guarantee g = bound_of(&scene);
        if (state == 2 && k % 4 < 2) /* of degree 1 the answer, but not the stress, which is exact */
            CHECK_MSG(g.proved && fabs(g.dual + 2. * 2 * (k / 4 % 2 ? 3 : 1) * PI / 6000) < 1e-9, "%g %s", g.dual,
                      g.why);
        else
            CHECK_MSG(g.proved && g.relative < 3e-6, "%s, %d: %g %s", scene.box.element, k, g.relative, g.why);
        uz_scene_clear(&scene);
    }
}

/* Lame's thick tube, between smooth plates: the energy is half of what the pressure works. */
TEST(thick_tube)
{
    for (int k = 0; k < 8; k++) {
        const double a = 1, b = 2, p = 10, E = 1000, nu = 0.3;
        const double C = p * a * a / (b * b - a * a), moved = (1 + nu) / E * C * ((1 - 2 * nu) * a + b * b / a);
        const double least = -0.5 * p * moved * 2 * PI * a;
        uz_scene scene = ring_scene(1, k < 4 ? 4 : 8, BOUND_ELEMENTS[k % 4]);
        if (k < 4) {
            body_give_mesh(&scene, shuffle);
            body_straighten(&scene);
        }
        add_support(&scene, "bottom", NAN, 0);
        add_support(&scene, "top", NAN, 0);
        bound_load(&scene, UZ_LOAD_PRESSURE, "left", p, 0);
        const uz_guarantee g = bound_of(&scene);
        const double error = sqrt(2 * (g.primal - least));
        CHECK_MSG(g.proved && g.dual <= least && least <= g.primal, "%.12g %.12g %.12g %s", g.dual, least, g.primal,
                  g.why);
        CHECK_MSG(g.bound >= error && g.bound < 1.09 * error, "%s: %g of %g", scene.box.element, g.bound, error);
        uz_scene_clear(&scene);
    }
}

/* A disc and a ring, pressed on a plane from which the rim of a body with a slope on its bottom lifts. The least energy
 * is that of a mesh many times finer. */
TEST(pressed_on_a_plane)
{
    for (int k = 0; k < 4; k += SANITIZED ? 3 : 1) {
        uz_guarantee g[5];
        for (int i = 0; i < 5; i++) {
            uz_scene scene = ring_scene(k % 2, i == 4 ? 32 : 6, BOUND_ELEMENTS[i == 4 ? 3 : i]);
            add_support(&scene, "top", k < 2 ? 0 : NAN, -0.02);
            if (k >= 2)
                bound_load(&scene, UZ_LOAD_TRACTION, "right", 20, 10);
            add_plane(&scene, "bottom", k % 2, 0, 0.01, 1);
            g[i] = bound_of(&scene);
            CHECK_MSG(g[i].proved, "%d %d: %s", k, i, g[i].why);
            uz_scene_clear(&scene);
        }
        for (int i = 0; i < 4; i++) {
            const double error = sqrt(2 * (g[i].primal - g[4].primal)), least = sqrt(2 * (g[i].primal - g[4].dual));
            CHECK_MSG(g[i].dual <= g[4].primal && g[i].bound >= error && g[i].bound < 1.5 * least,
                      "%d %d: %g of %g .. %g", k, i, g[i].bound, error, least);
        }
    }
}

/* A ring of a large radius is a strip of that circumference; its hoop stress is of one degree less than the others. */
TEST(a_large_ring_is_a_strip)
{
    for (int k = 0; k < 4; k++) {
        uz_guarantee g[2];
        for (int i = 0; i < 2; i++) {
            const double radius = 1e5;
            uz_scene scene = ring_scene(radius, 4, BOUND_ELEMENTS[k]);
            scene.model = i == 0 ? UZ_PLANE_STRAIN : UZ_AXISYMMETRIC;
            scene.thickness = 2 * PI * radius;
            add_support(&scene, "left", 0, NAN);
            add_support(&scene, "top", NAN, -0.01);
            add_load(&scene, "right", 3, 1);
            add_plane(&scene, "bottom", radius, 0, 0.01, 1);
            g[i] = bound_of(&scene);
            CHECK_MSG(g[i].proved, "%s", g[i].why);
            uz_scene_clear(&scene);
        }
        CHECK_REL(g[1].bound, g[0].bound, 3e-2);
        CHECK_REL(g[1].dual, g[0].dual, 2e-3);
    }
}

static void lean(double *x)
{
    x[0] += 0.5 * x[1];
}

static void lean_and_shuffle(double *x)
{
    shuffle(x);
    lean(x);
}

/* With a corner on the axis alone, where a quadrilateral's energy has a pole that no coordinate takes out, two sums
 * over all elements still agree to rounding. */
TEST(a_corner_on_the_axis)
{
    for (int k = 0; k < 8; k += step_of_cases()) {
        double lowest = INFINITY, highest = -INFINITY;
        for (int n = 1; n <= 8; n *= 2) {
            uz_scene scene = ring_scene(0, n, BOUND_ELEMENTS[k % 4]);
            body_give_mesh(&scene, k < 4 ? lean : lean_and_shuffle);
            body_straighten(&scene);
            add_support(&scene, "top", NAN, 0);
            add_load(&scene, "right", 1, 1);
            add_load(&scene, "bottom", 0.5, 2);
            const uz_guarantee g = bound_of(&scene);
            CHECK_MSG(g.proved, "%d %d: %s", k, n, g.why);
            lowest = fmin(lowest, g.primal);
            highest = fmax(highest, g.dual);
            uz_scene_clear(&scene);
        }
        CHECK_MSG(highest <= lowest && highest > 1.02 * lowest, "%d: %.12g %.12g", k, highest, lowest);
    }
}

/* Some of the rings that `make extremes FILTER=guaranteed` goes through. */
TEST(never_below_the_truth)
{
    double least = INFINITY, sum[2] = {0};
    int count[2] = {0};
    for (uint64_t seed = 1; seed <= RINGS; seed += (uint64_t)step_of_cases()) {
        const bound_sweep x = sweep_bounds(seed, BOUND_RINGS, 2, 8);
        CHECK_MSG(x.answers == 9 && x.proved == 9, "seed %d: %d of %d %s", (int)seed, x.proved, x.answers, x.why);
        CHECK_MSG(x.highest <= x.lowest + 1e-12 * x.size, "seed %d: %.10e above %.10e", (int)seed, x.highest, x.lowest);
        for (int k = 0; k < 2; k++)
            for (int i = 0; i < x.count[k]; i++) {
                least = fmin(least, x.effect[k][i]);
                sum[k] += log(x.effect[k][i]);
                count[k]++;
            }
    }
    CHECK_MSG(least >= 1, "%g", least);
    for (int k = 0; k < 2; k++)
        CHECK_MSG(count[k] > 40 / step_of_cases() && exp(sum[k] / count[k]) < (k == 0 ? 1.15 : 1.3), "%d: %g", count[k],
                  exp(sum[k] / count[k]));
}

/* Balls, rings of round section, polylines and tables below rings, with a hole and without, with axial forces in them
 * (stresses of degree 2 on linear elements) and without. */
TEST(never_below_the_truth_before_what_turns)
{
    int count = 0;
    for (uint64_t seed = 1; seed <= 6; seed += (uint64_t)step_of_cases()) {
        const bound_sweep x = sweep_differences(seed, seed % 2 ? BOUND_RINGS_ROUND : BOUND_RINGS_LINES, 2, 8);
        CHECK_MSG(x.answers == 10 && x.proved == 10, "seed %d: %d of %d %s", (int)seed, x.proved, x.answers, x.why);
        CHECK_MSG(x.highest <= x.lowest + 1e-12 * x.size, "seed %d: %.10e above %.10e", (int)seed, x.highest, x.lowest);
        CHECK_MSG(x.least >= 1, "seed %d: %g", (int)seed, x.least);
        count += x.count[0] + x.count[1];
    }
    CHECK_INT(count, (SANITIZED ? 2 : 6) * 8);
}
