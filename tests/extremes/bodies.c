/* bodies.c: elements, obstacles and second bodies where they hurt: nearly incompressible, thin, far away, tiny, hard.
 */
#include "extremes.h"

#include "random_scene.h"

/* A box of these cells, held at its top and pressed and pulled there and aside; room for more of everything. */
static random_scene block(uz_model model, const char *element, const double size[3], const int64_t cells[3])
{
    random_scene s = {.rng = {5}, .bodies = 1};
    uz_box box = {.dim = model == UZ_SOLID ? 3 : 2};
    scene_make_room(&s.scene, model);
    memcpy(box.size, size, sizeof box.size);
    memcpy(box.cells, cells, sizeof box.cells);
    snprintf(box.element, sizeof box.element, "%s", element);
    append_box(&s, &box, "a", 0, 0);
    s.scene.materials[s.scene.n_materials++] = (uz_material){.on = "all", .young = 1000, .poisson = 0.3};
    for (int c = 0; c < box.dim; c++)
        hold(&s, "atop", c, c == 1 ? -1e-4 * size[1] : 0);
    memcpy(new_load(&s, UZ_LOAD_TRACTION, "aright")->v, (double[3]){0.5, 0.1, 0.2}, sizeof(double[3]));
    return s;
}

static uz_contact *floor_under(random_scene *s, double gap)
{
    uz_contact *x = new_contact(s, UZ_OBSTACLE_PLANE, "abottom");
    x->normal[1] = 1;
    x->point[1] = -gap;
    return x;
}

static void run_incompressible(suite *all)
{
    static const struct {
        uz_model model;
        const char *element;
    } kinds[] = {{UZ_PLANE_STRAIN, "quad4"}, {UZ_AXISYMMETRIC, "quad4"}, {UZ_SOLID, "hex8"},
                 {UZ_PLANE_STRAIN, "tri6"},  {UZ_PLANE_STRAIN, "quad8"}, {UZ_SOLID, "tet10"}};
    static const double poisson[] = {0.4999, 0.4999999, 0.4999999999};
    char name[64];
    for (size_t k = 0; k < sizeof kinds / sizeof kinds[0]; k++)
        for (int i = 0; i < 3; i++) {
            random_scene s = block(kinds[k].model, kinds[k].element, (double[3]){3, 1, 1},
                                   kinds[k].model == UZ_SOLID ? (int64_t[3]){2, 1, 1} : (int64_t[3]){4, 2, 0});
            s.scene.materials[0].poisson = poisson[i];
            if (kinds[k].model == UZ_AXISYMMETRIC)
                s.scene.supports[0].u[0] = 0;
            floor_under(&s, 0);
            run_scene(all, "scene elements", name_of(name, sizeof name, "%s %.10g", kinds[k].element, poisson[i]),
                      s.scene, i < 2 ? OWED_ANSWER : OWED_TRUTH);
        }
}

/* Cells far from cubes: thin hex8 with and without incompatible modes, tetrahedra likewise. */
static void run_thin(suite *all)
{
    static const char *const elements[] = {"hex8", "hex8", "tet4", "tet10"};
    static const double thin[] = {1e-1, 1e-2, 1e-3, 1e-4};
    char name[64];
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 4; i++) {
            const int64_t cells[3] = {k == 3 ? 1 : 3, 1, 2};
            random_scene s = block(UZ_SOLID, elements[k], (double[3]){3, thin[i], 2}, cells);
            s.scene.n_supports = 0;
            for (int c = 0; c < 3; c++)
                hold(&s, "aleft", c, 0);
            s.scene.formulation = k == 1 ? UZ_FORMULATION_INCOMPATIBLE : UZ_FORMULATION_AUTO;
            s.scene.loads[0].v[1] = 0;
            memcpy(new_load(&s, UZ_LOAD_TRACTION, "atop")->v, (double[3]){0, -thin[i] * thin[i], 0}, sizeof(double[3]));
            floor_under(&s, 0.01 * thin[i]);
            run_scene(all, "scene elements",
                      name_of(name, sizeof name, "%s%s, %g thin", elements[k], k == 1 ? " incompatible" : "", thin[i]),
                      s.scene, i < 3 ? OWED_ANSWER : OWED_TRUTH /* condition 1e16 */);
        }
}

static void run_round(suite *all)
{
    static const double radii[] = {1e-9, 1e-3, 1, 1e3, 1e6, 1e9};
    char name[64];
    for (int dim = 2; dim <= 3; dim++)
        for (int i = 0; i < 12; i++) {
            random_scene s = block(dim == 3 ? UZ_SOLID : UZ_PLANE_STRESS, dim == 3 ? "hex8" : "quad4",
                                   (double[3]){3, 1, 1}, dim == 3 ? (int64_t[3]){3, 1, 1} : (int64_t[3]){6, 2, 0});
            uz_contact *x = floor_under(&s, 0);
            x->kind = UZ_OBSTACLE_ROUND;
            x->radius = radii[i % 6];
            x->point[0] = 1.5;
            x->point[2] = 0.5;
            x->point[1] = i < 6 ? -x->radius : -1e9 - x->radius; /* touching, and far away */
            run_scene(all, "scene obstacles",
                      name_of(name, sizeof name, "%dD, radius %g, gap %g", dim, x->radius, i < 6 ? 0 : 1e9), s.scene,
                      OWED_ANSWER);
        }
    for (int i = 2; i < 6; i++) { /* a hole that the body stands in */
        random_scene s = block(UZ_PLANE_STRAIN, "quad8", (double[3]){3, 1, 0}, (int64_t[3]){3, 1, 0});
        uz_contact *x = floor_under(&s, 0);
        x->kind = UZ_OBSTACLE_ROUND;
        x->inside = true;
        x->radius = 10 * radii[i];
        x->point[0] = 1.5;
        x->point[1] = x->radius;
        run_scene(all, "scene obstacles", name_of(name, sizeof name, "inside radius %g", x->radius), s.scene,
                  OWED_ANSWER);
    }
}

/* Segments of a line from 1 down to 1e-14 of the body. */
static void run_polyline(suite *all)
{
    static const double lengths[] = {1, 1e-3, 1e-6, 1e-9, 1e-12, 1e-14};
    char name[64];
    for (int i = 0; i < 6; i++) {
        random_scene s = block(UZ_PLANE_STRESS, "quad4", (double[3]){3, 1, 0}, (int64_t[3]){6, 2, 0});
        uz_contact *x = floor_under(&s, 0);
        x->kind = UZ_OBSTACLE_POLYLINE;
        x->n_x = 7;
        x->x = scene_room(x->n_x, sizeof *x->x);
        x->y = scene_room(x->n_x, sizeof *x->y);
        for (int k = 0; k < 7; k++) {
            x->x[k] = 1.5 + (3 - k) * lengths[i];
            x->y[k] = -0.1 * lengths[i] * (k % 2) - 0.01 * lengths[i];
        }
        run_scene(all, "scene obstacles", name_of(name, sizeof name, "segments of %g", lengths[i]), s.scene,
                  OWED_TRUTH);
    }
}

static void run_pairs(suite *all)
{
    static const double ratios[] = {1e-8, 1e-4, 1, 1e4, 1e8};
    static const double gaps[] = {0, 1e-12, 1e-6, 1e9};
    char name[64];
    for (int dim = 2; dim <= 3; dim++)
        for (int i = 0; i < 5; i++)
            for (int g = 0; g < 4; g++) {
                random_scene s = block(dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN, dim == 3 ? "hex8" : "quad4",
                                       (double[3]){3, 1, 1}, dim == 3 ? (int64_t[3]){2, 1, 1} : (int64_t[3]){4, 2, 0});
                uz_box box = {
                    .dim = dim, .size = {3.5, 1, 1.5}, .cells = {3, 1, 1}, .origin = {-0.2, -1 - gaps[g], -0.2}};
                snprintf(box.element, sizeof box.element, "%s", dim == 3 ? "tet4" : "tri3");
                append_box(&s, &box, "b", 0, 0);
                snprintf(s.scene.materials[0].on, sizeof s.scene.materials[0].on, "a");
                s.scene.materials[1] = s.scene.materials[0];
                snprintf(s.scene.materials[s.scene.n_materials++].on, sizeof s.scene.materials[0].on, "b");
                s.scene.materials[1].young *= ratios[i];
                for (int c = 0; c < dim; c++)
                    hold(&s, "bbottom", c, 0);
                uz_contact *x = new_contact(&s, UZ_OBSTACLE_BODY, "abottom");
                snprintf(x->with, sizeof x->with, "btop");
                run_scene(all, "scene bodies",
                          name_of(name, sizeof name, "%dD, stiffness ratio %g, gap %g", dim, ratios[i], gaps[g]),
                          s.scene, OWED_ANSWER);
            }
}

void run_bodies(suite *all)
{
    run_incompressible(all);
    run_thin(all);
    run_round(all);
    run_polyline(all);
    run_pairs(all);
}
