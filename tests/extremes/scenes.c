/* scenes.c: one quantity of a small scene at a time, then several at once. */
#include "extremes.h"

#include "qp_fixture.h"
#include "scene_fixture.h"

enum { NX = 12, NY = 4 };

/* The paper's body on 12 x 4 cells. */
static uz_scene body(void)
{
    return paper_scene(NX, NY);
}

/* A block held at its top and pulled to the right, that can move along its bottom. */
static uz_scene hanging_block(double gap)
{
    uz_scene s = box_scene(60, 20, NX, NY);
    add_support(&s, "top", 0, 0);
    add_load(&s, "right", 0.5, 0);
    add_plane(&s, "bottom", 0, -gap, 0, 1);
    return s;
}

static void scale_loads(uz_scene *s, double factor)
{
    for (int64_t k = 0; k < s->n_loads; k++)
        for (int c = 0; c < 2; c++)
            s->loads[k].v[c] *= factor;
}

static void run_young(suite *all)
{
    static const double values[] = {1e-6, 1e-3, 1, 1e3, 1e6, 1e9, 1e12, 1e15};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        s.materials[0].young = values[k];
        run_scene(all, "young", name_of(name, sizeof name, "young %.0e", values[k]), s, OWED_ANSWER);
    }
}

static void run_poisson(suite *all)
{
    static const struct {
        uz_model model;
        double poisson;
    } values[] = {{UZ_PLANE_STRAIN, 0},      {UZ_PLANE_STRAIN, 0.3},      {UZ_PLANE_STRAIN, 0.49},
                  {UZ_PLANE_STRAIN, 0.4999}, {UZ_PLANE_STRAIN, 0.499999}, {UZ_PLANE_STRAIN, -0.99},
                  {UZ_PLANE_STRESS, -0.99},  {UZ_PLANE_STRESS, 0.5}};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        s.model = values[k].model;
        s.materials[0].poisson = values[k].poisson;
        run_scene(
            all, "poisson",
            name_of(name, sizeof name, "%s %g", s.model == UZ_PLANE_STRAIN ? "strain" : "stress", values[k].poisson), s,
            OWED_ANSWER);
    }
}

static void run_thickness(suite *all)
{
    static const double values[] = {1e-9, 1e-6, 1e-3, 1, 1e3};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        s.thickness = values[k];
        run_scene(all, "thickness", name_of(name, sizeof name, "thickness %.0e", values[k]), s, OWED_ANSWER);
    }
}

/* Elements `aspect` times as long as they are high, clamped at one end, or standing on their bottom. */
static void run_aspect(suite *all)
{
    static const double values[] = {1e-4, 1e-3, 1e-2, 10, 1e2, 1e3, 1e4};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        double aspect = values[k];
        uz_scene s = body();
        s.box.size[0] = 5.0 * NX * aspect;
        run_scene(all, "aspect", name_of(name, sizeof name, "clamped, aspect %g", aspect), s,
                  aspect <= 1e2 ? OWED_ANSWER : OWED_TRUTH);
        s = hanging_block(0);
        s.box.size[0] = 5.0 * NX * aspect;
        run_scene(all, "aspect", name_of(name, sizeof name, "hanging, aspect %g", aspect), s,
                  aspect >= 1e-2 ? OWED_ANSWER : OWED_TRUTH);
    }
}

static void run_length(suite *all)
{
    static const double values[] = {1e-9, 1e-6, 1e-3, 1, 1e3, 1e6};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        s.box.size[0] = 3 * values[k];
        s.box.size[1] = values[k];
        run_scene(all, "length", name_of(name, sizeof name, "height %.0e", values[k]), s, OWED_ANSWER);
    }
}

static void run_load(suite *all)
{
    static const double values[] = {0, 1e-12, 1e-6, 1, 1e6, 1e12};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        scale_loads(&s, values[k]);
        run_scene(all, "load", name_of(name, sizeof name, "load %g", values[k]), s, OWED_ANSWER);
    }
}

static void run_gap(suite *all)
{
    static const double values[] = {0, 1e-12, 1e-6, 1e-3, 1, 1e9, -1e-12, -1e-6, -1e-3, -1, -1e3};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++)
        run_scene(all, "gap", name_of(name, sizeof name, "hanging, gap %g", values[k]), hanging_block(values[k]),
                  OWED_ANSWER);
    for (size_t k = 0; k < 6; k++) {
        uz_scene s = body();
        s.contacts[0].point[1] = -values[k];
        run_scene(all, "gap", name_of(name, sizeof name, "clamped, gap %g", values[k]), s, OWED_ANSWER);
    }
    uz_scene s = body();
    s.contacts[0].point[1] = 1e-3;
    run_scene(all, "gap", "clamped corner inside the obstacle", s, OWED_ERROR);
    s = hanging_block(0);
    add_plane(&s, "right", 60 + 1e9, 0, -1, 0);
    run_scene(all, "gap", "a near and a far obstacle", s, OWED_ANSWER);
}

static void run_fraction(suite *all)
{
    uz_scene s = hanging_block(0);
    s.supports[0].u[1] = 1e-3;
    run_scene(all, "fraction", "lifted: no node touches", s, OWED_ANSWER);
    s = hanging_block(0);
    s.contacts[0].normal[0] = -1e-3;
    s.contacts[0].point[0] = 60;
    s.supports[0].u[1] = -1e-3;
    run_scene(all, "fraction", "tilted obstacle: one node touches", s, OWED_ANSWER);
    s = hanging_block(0);
    s.supports[0].u[1] = -1;
    run_scene(all, "fraction", "pressed: all nodes touch", s, OWED_ANSWER);
    s = hanging_block(0);
    s.loads[0].v[0] = 0;
    run_scene(all, "fraction", "no load: all gaps are zero", s, OWED_ANSWER);
    s = body();
    s.n_contacts = 0;
    run_scene(all, "fraction", "no candidates", s, OWED_ANSWER);
    s = body();
    add_plane(&s, "bottom", 0, 0, 0, 1);
    run_scene(all, "fraction", "every row twice", s, OWED_ANSWER);
    s = box_scene(60, 20, NX, NY);
    add_support(&s, "left", 0, NAN);
    add_plane(&s, "bottom", 0, 0, 0, 1);
    run_scene(all, "fraction", "held by the obstacle alone", s, OWED_ERROR);
    s = body();
    add_plane(&s, "top", 0, 19, 0, -1);
    run_scene(all, "fraction", "wedged: the top must go down", s, OWED_ERROR);
    s = hanging_block(0);
    s.n_supports = 0;
    add_support(&s, "right", 0, 0);
    s.n_loads = 0;
    add_load(&s, "top", 0, -1e6);
    run_scene(all, "fraction", "crushed", s, OWED_ANSWER);
}

static void run_motion(suite *all)
{
    static const double values[] = {-1e-12, -1e-6, -1e-3, -1, -1e6};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = hanging_block(0);
        s.supports[0].u[1] = values[k];
        run_scene(all, "motion", name_of(name, sizeof name, "top moves by %g", values[k]), s, OWED_ANSWER);
    }
}

static void run_cells(suite *all)
{
    static const int64_t values[][2] = {{1, 1}, {1, 8}, {2, 1}, {30, 1}};
    char name[64];
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        uz_scene s = body();
        s.box.cells[0] = values[k][0];
        s.box.cells[1] = values[k][1];
        run_scene(all, "cells", name_of(name, sizeof name, "%d x %d cells", (int)values[k][0], (int)values[k][1]), s,
                  OWED_ANSWER);
    }
}

void run_scenes(suite *all)
{
    run_young(all);
    run_poisson(all);
    run_thickness(all);
    run_aspect(all);
    run_length(all);
    run_load(all);
    run_gap(all);
    run_fraction(all);
    run_motion(all);
    run_cells(all);
}

static double power(qp_random *rng, double low, double high)
{
    return pow(10, low + (high - low) * random_unit(rng));
}

/* Every quantity at once, each from its whole range. */
static uz_scene mixture(qp_random *rng)
{
    double height = power(rng, -9, 6), aspect = power(rng, -3, 3), strain = power(rng, -9, 0);
    uz_scene s = box_scene(height * 3 * aspect, height, random_int(rng, 2, 9), random_int(rng, 1, 5));
    s.materials[0].young = power(rng, -6, 15);
    s.model = random_unit(rng) < 0.5 ? UZ_PLANE_STRAIN : UZ_PLANE_STRESS;
    s.materials[0].poisson = random_unit(rng) < 0.3 ? 0.4999 : -0.9 + 1.3 * random_unit(rng);
    s.thickness = power(rng, -9, 3);
    add_support(&s, random_unit(rng) < 0.5 ? "left" : "top", 0, 0);
    double push = strain * s.materials[0].young;
    add_load(&s, "right", push * random_signed(rng), push * random_signed(rng));
    add_plane(&s, "bottom", 0, random_unit(rng) < 0.5 ? 0 : -strain * height * random_unit(rng), 0, 1);
    return s;
}

void run_scene_mixtures(suite *all)
{
    enum { SCENES = 40 };
    char name[64];
    qp_random rng = {2024};
    for (int k = 0; k < SCENES; k++)
        run_scene(all, "mixture", name_of(name, sizeof name, "scene %d", k), mixture(&rng), OWED_TRUTH);
}
