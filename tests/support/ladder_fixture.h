/* ladder_fixture.h: boxes whose cells are chosen, for the tests of ladders. */
#ifndef TESTS_LADDER_FIXTURE_H
#define TESTS_LADDER_FIXTURE_H

#include "scene/grids.h"
#include "body_fixture.h"

/* The body of the paper's example, its cells to be chosen. */
static inline uz_scene paper(double scale)
{
    const double size[3] = {60 * scale, 20 * scale, 0};
    const int64_t cells[3] = {0};
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", size, cells);
    s.thickness = 5 * scale;
    s.materials[0].young = 200e3 / scale / scale; /* force stays, length scales */
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.05 / scale / scale, 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", 0.5 / scale / scale, 0, 0);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    s.box.automatic = true;
    return s;
}

/* A column under its own weight on a smooth floor, its left side on a smooth wall: nowhere singular. */
static inline uz_scene column(uz_model model, const char *element)
{
    const double size[3] = {1, 2, 1.5};
    const int64_t cells[3] = {0};
    uz_scene s = body_scene(model, element, size, cells);
    s.materials[0].density = 7.8e-3;
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    if (model == UZ_SOLID)
        body_hold(&s, "back", NAN, NAN, 0);
    body_load(&s, UZ_LOAD_GRAVITY, "all", 0, -9.81, 0);
    s.loads[0].value = 0;
    s.box.automatic = true;
    return s;
}

static inline uz_problem problem_of_scene(const uz_scene *scene)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = *scene};
}

static inline uz_settings asking(double error)
{
    uz_settings settings = uz_settings_default();
    settings.relative_error = error;
    return settings;
}

static inline uz_result *solve(const uz_scene *scene, const uz_settings *settings)
{
    const uz_problem problem = problem_of_scene(scene);
    uz_result *result = NULL;
    uz_error err = {0};
    uz_status status = uz_solve(&result, &problem, settings, NULL, NULL, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (!result)
        exit(1);
    return result;
}

static inline uz_box grid_of(const uz_scene *scene, int64_t n)
{
    const uz_grids grids = uz_grids_of_box(&scene->box, 0);
    return uz_grid(&grids, n);
}

#endif
