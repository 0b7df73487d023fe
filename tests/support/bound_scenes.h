/* bound_scenes.h: generated plane bodies before obstacles, and what is proved of their whole error on some
 * meshes against each other: all that is below a body's energy is below all that is above it. */
#ifndef TESTS_BOUND_SCENES_H
#define TESTS_BOUND_SCENES_H

#include "assembly/assembly.h"
#include "body_fixture.h"
#include "bound/bound.h"
#include "generated.h"
#include "linalg/blas.h"
#include "scene_fixture.h"

static const char *const BOUND_ELEMENTS[] = {"tri3", "quad4", "tri6", "quad8"};

static inline uz_result *bound_answer(const uz_problem *problem, bool guaranteed)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.guaranteed = guaranteed;
    const uz_status status = uz_solve(&result, problem, &settings, NULL, NULL, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return result;
}

static inline uz_guarantee bound_of(const uz_scene *scene)
{
    uz_result *result = bound_answer(&(uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = *scene}, true);
    const uz_guarantee g = result->summary.guarantee;
    uz_result_free(result);
    return g;
}

/* The dual problem of an element alone, of straight sides between corners xy (of 8 numbers), has so many unknowns, and
 * so many motions without stiffness. */
static inline void check_element_alone(uz_model kind, const double *xy, int corners, int degree, int64_t unknowns,
                                       int motions)
{
    double xyz[16], A[24 * 24] = {0};
    int64_t first[] = {0, degree * corners}, node[] = {0, 1, 2, 3, 4, 5, 6, 7}, pivot[24], *dof;
    unsigned char kinds[] = {
        (unsigned char)(degree == 1 ? (corners == 3 ? UZ_TRI3 : UZ_QUAD4) : (corners == 3 ? UZ_TRI6 : UZ_QUAD8))};
    uz_material material = {.on = "all", .young = 1, .poisson = 0.3};
    uz_body_material own = {.lame = uz_lame_of(kind, 1, 0.3)};
    const uz_scene scene = {
        .model = kind, .thickness = 1, .source = UZ_MESH_GIVEN, .n_materials = 1, .materials = &material};
    uz_body_model model = {.kind = kind, .thickness = 1, .materials = &own};
    uz_bound_body body;
    uz_qp qp;
    uz_error err = {0};
    memcpy(xyz, xy, 8 * sizeof *xyz);
    for (int k = 0; k < corners; k++)
        for (int c = 0; c < 2; c++)
            xyz[2 * (corners + k) + c] = (xy[2 * k + c] + xy[2 * ((k + 1) % corners) + c]) / 2;
    model.mesh = (uz_mesh){.dim = 2, .n_nodes = degree * corners, .n_elements = 1, .extent = 10};
    model.mesh.xyz = xyz;
    model.mesh.kind = kinds;
    model.mesh.first = first;
    model.mesh.node = node;
    CHECK(uz_bound_body_make(&body, &model, &scene, &err) == UZ_OK);
    CHECK_STR(body.why, "");
    CHECK_MSG(uz_bound_dual_problem(&qp, &dof, &body, NULL, &err) == UZ_OK, "%s", err.message);
    const int64_t n = qp.K.cols;
    CHECK_INT(n, unknowns);
    for (int64_t j = 0; j < n; j++)
        for (int64_t k = qp.K.ptr[j]; k < qp.K.ptr[j + 1]; k++)
            A[qp.K.idx[k] + n * j] = qp.K.val[k];
    CHECK_INT(uz_pstrf_lower_while(n, A, pivot, 1e-11, NULL), n - motions);
    uz_qp_clear(&qp);
    free(dof);
    uz_bound_body_clear(&body);
}

typedef struct {
    int answers, proved;
    double highest, lowest; /* of the energies that are below and above the body's; apart: nothing is wrong */
    double size;            /* of an energy */
    int count[2];           /* of linear and of quadratic elements: bounds */
    double least;           /* what may not be below 1, of sweep_differences */
    /* and what they are of the error by energies, sqrt(2 (J(u_h) - J)), of the answer or what is out of obstacles: at
     * most, were the lowest energy found the body's, and at least, were the highest bound below it; of differences,
     * were the finer answer exact, and were its bound its error, as errors of nested answers are about orthogonal */
    double effect[2][8], less[2][8];
    char why[160]; /* where one was not proved */
} bound_sweep;

static double bound_cell[2], bound_low[2], bound_high[2]; /* what the map that follows is about */
static qp_random bound_random;

/* Moves corners within the body by up to a fifth of a cell. */
static inline void bound_shuffle(double *x)
{
    for (int c = 0; c < 2; c++) {
        const double margin = 1e-6 * (bound_high[c] - bound_low[c]);
        if (x[c] < bound_low[c] + margin || x[c] > bound_high[c] - margin)
            return;
    }
    for (int c = 0; c < 2; c++)
        x[c] += 0.4 * bound_cell[c] * (random_unit(&bound_random) - 0.5);
}

static inline uz_load *bound_load(uz_scene *scene, uz_load_kind kind, const char *on, double x, double y)
{
    add_load(scene, on, x, y);
    scene->loads[scene->n_loads - 1].kind = kind;
    scene->loads[scene->n_loads - 1].value = x;
    return &scene->loads[scene->n_loads - 1];
}

typedef enum {
    BOUND_STRAIGHT,
    BOUND_ROUND,
    BOUND_RESTING,
    BOUND_SPRINGS,
    BOUND_RINGS,
    BOUND_LINES,
    BOUND_RINGS_ROUND,
    BOUND_RINGS_LINES,
    BOUND_PERCHED
} bound_kind;

/* A polyline or a table below the bottom, `gap` away: flat, a hill or a hollow, with teeth or without, of few pieces or
 * many. */
static inline void bound_lines(uz_scene *scene, double gap, qp_random *rng)
{
    enum { MOST = 60 };
    uz_contact *c = &scene->contacts[0];
    const double *x = scene->box.origin, width = scene->box.size[0];
    const int shape = (int)random_int(rng, -1, 2), n = (int)random_power(rng, 0.7, 1.7);
    const bool table = random_chance(rng, 0.4);
    const double bend = shape * random_power(rng, -1.5, -0.5), middle = 0.1 + 0.8 * random_unit(rng);
    const double teeth = random_chance(rng, 0.5) ? random_power(rng, -3, 0) / n : 0;
    double highest = -INFINITY;
    free(c->x);
    *c = (uz_contact){.kind = table ? UZ_OBSTACLE_HEIGHT : UZ_OBSTACLE_POLYLINE, .on = "bottom", .n_x = n};
    c->x = malloc(MOST * sizeof *c->x);
    double *y = malloc(MOST * sizeof *y);
    for (int i = 0; i < n; i++) {
        const double at = -0.3 + 1.6 * (i + 0.6 * (random_unit(rng) - 0.5)) / (n - 1);
        c->x[i] = x[0] + width * at;
        y[i] = width * (bend * (at - middle) * (at - middle) + teeth * (random_unit(rng) - 0.5));
    }
    for (int i = 0; i < n; i++) /* of what is below the body, at its ends and corners */
        for (int k = 0; k < 3; k++) {
            const double end = k < 2 ? x[0] + k * width : c->x[i];
            const int j = i + 1 < n ? i : i - 1;
            if (end >= x[0] && end <= x[0] + width && (k == 2 || (end >= c->x[j] && end <= c->x[j + 1])))
                highest =
                    fmax(highest, k == 2 ? y[i] : y[j] + (end - c->x[j]) / (c->x[j + 1] - c->x[j]) * (y[j + 1] - y[j]));
        }
    for (int i = 0; i < n; i++)
        y[i] += x[1] - gap - highest;
    *(table ? &c->z : &c->y) = y;
}

/* On a disc, and at a wall that its weight, inclined, turns it against about the disc's centre. */
static inline void bound_perched(uz_scene *scene, double gap, double stress, qp_random *rng)
{
    const double *x = scene->box.origin, width = scene->box.size[0], height = scene->box.size[1];
    const double weight = stress / height * (1 + random_unit(rng)), place = 0.3 + 0.4 * random_unit(rng);
    uz_contact *c = &scene->contacts[0];
    scene->n_supports = 0;
    scene->n_loads = 1;
    *c = (uz_contact){
        .kind = UZ_OBSTACLE_ROUND, .on = "bottom", .radius = (width + height) * random_power(rng, -0.3, 1)};
    c->point[0] = x[0] + width * place;
    c->point[1] = x[1] - gap - c->radius;
    add_plane(scene, "left", x[0] - gap * random_unit(rng), x[1], 1, 0);
    const double arm = (0.5 * width - width * place) / (0.5 * height + c->radius);
    bound_load(scene, UZ_LOAD_BODY_FORCE, "all", -weight * (fmax(0, arm) + 0.1 + 0.3 * random_unit(rng)), -weight);
    bound_load(scene, UZ_LOAD_PRESSURE, "top", 0.3 * stress * random_unit(rng), 0);
    scene->loads[0].v[0] = 0;
    scene->loads[0].v[1] = -0.3 * fabs(scene->loads[0].v[1]);
}

/* Makes the scene before a plane one of its kind. */
static inline void bound_change(uz_scene *scene, bound_kind kind, double gap, double stress, qp_random *rng)
{
    const double *x = scene->box.origin, width = scene->box.size[0], height = scene->box.size[1];
    const bool turns = kind == BOUND_RINGS_ROUND || kind == BOUND_RINGS_LINES;
    if (kind == BOUND_RESTING) { /* on the bottom, and at another plane or along a slide; what presses is the most */
        const bool corner = random_chance(rng, 0.5);
        scene->n_supports = 0;
        scene->n_loads = 1;
        if (corner)
            add_plane(scene, "left", x[0] - gap, x[1], 1, 0);
        else
            add_support(scene, "left", 0, NAN);
        bound_load(scene, UZ_LOAD_BODY_FORCE, "all", corner ? -stress / height : 0,
                   -stress / height * (1 + random_unit(rng)));
        bound_load(scene, UZ_LOAD_PRESSURE, "top", 2 * stress * random_unit(rng), 0);
        scene->loads[0].v[0] *= 0.3;
        scene->loads[0].v[1] = -0.3 * fabs(scene->loads[0].v[1]);
    }
    if (kind == BOUND_SPRINGS) { /* all over the top; the left slides, or has none */
        const double k = scene->materials[0].young * scene->thickness * width / height * random_power(rng, -1.5, 1.5);
        const bool slides = random_chance(rng, 0.5);
        scene->n_supports = 0;
        if (slides)
            add_support(scene, "left", 0, NAN);
        scene->supports[scene->n_supports++] =
            (uz_support){.kind = UZ_SUPPORT_SPRING, .on = "top", .spring = {slides ? 0 : k * random_unit(rng), k}};
    }
    if (kind == BOUND_RINGS || turns) { /* held or pressed on top, on springs, or resting; around a hole or not */
        const int64_t how = random_int(rng, 0, turns ? 3 : 4); /* it rests on planes alone */
        const bool hole = random_chance(rng, 0.6);
        const double k = scene->materials[0].young / height * random_power(rng, -1.5, 1.5);
        scene->model = UZ_AXISYMMETRIC;
        scene->box.origin[0] = hole ? height * random_power(rng, -1.5, 1) : 0;
        scene->n_supports = 0;
        if (scene->loads[0].kind == UZ_LOAD_TRACTION && how == 3)
            scene->loads[0].v[1] = -fabs(scene->loads[0].v[1]);
        if (how == 0)
            add_support(scene, "top", NAN, -1e-3 * height * random_unit(rng));
        if (how == 1)
            add_support(scene, "top", 1e-3 * height * random_unit(rng) * (hole ? 1 : 0),
                        -1e-3 * height * random_unit(rng));
        if (how == 2)
            scene->supports[scene->n_supports++] =
                (uz_support){.kind = UZ_SUPPORT_SPRING,
                             .on = "top",
                             .spring = {random_chance(rng, 0.5) ? k : 0, k * 3 * width * width}};
        if (how == 3) {
            bound_load(scene, UZ_LOAD_PRESSURE, "top", stress * (0.5 + random_unit(rng)), 0);
            scene->contacts[0].point[1] = x[1] - gap;
            scene->contacts[0].normal[0] = 0;
        }
        if (hole && random_chance(rng, 0.5))
            bound_load(scene, UZ_LOAD_PRESSURE, "left", stress * random_unit(rng), 0);
    }
    if (kind == BOUND_LINES || kind == BOUND_RINGS_LINES)
        bound_lines(scene, gap, rng);
    if (kind == BOUND_PERCHED)
        bound_perched(scene, gap, stress, rng);
    if (kind == BOUND_ROUND ||
        kind == BOUND_RINGS_ROUND) { /* a disc below the bottom, or a hole in which its corners stand */
        uz_contact *c = &scene->contacts[0];
        c->kind = UZ_OBSTACLE_ROUND;
        c->radius = (width + height) * random_power(rng, 0.3, 2.5);
        c->inside = random_chance(rng, 0.3);
        c->point[0] = x[0] + width * (0.1 + 0.8 * random_unit(rng));
        if (kind == BOUND_RINGS_ROUND && random_chance(rng, 0.5)) /* a ball, and no ring of its section */
            c->point[0] = 0;
        c->point[1] = x[1] - gap - c->radius;
        if (c->inside)
            c->point[1] =
                x[1] - gap +
                sqrt(c->radius * c->radius - fmax(pow(c->point[0] - x[0], 2), pow(x[0] + width - c->point[0], 2)));
    }
}

/* n: cells along the shorter side. Lengths are of the order of `unit`, displacements a thousandth of that. */
static inline uz_scene bound_scene(uint64_t seed, bound_kind kind, const char *element, int64_t n)
{
    qp_random rng = {seed};
    const double unit = random_power(&rng, -3, 3), young = random_power(&rng, 0, 11), stress = 1e-3 * young;
    const double width = unit * (1 + 2 * random_unit(&rng)), height = unit, step = 1e-3 * unit;
    const int64_t nx = (int64_t)((double)n * width / height + 0.5);
    const bool far = random_chance(&rng, 0.2);
    uz_scene scene = box_scene(width, height, nx, n);
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    scene.box.origin[0] = far ? 20 * unit : 0;
    scene.box.origin[1] = far ? -7.3 * unit : 0;
    scene.box.grading[0] = random_power(&rng, -0.7, 0.7);
    scene.model = random_chance(&rng, 0.5) ? UZ_PLANE_STRESS : UZ_PLANE_STRAIN;
    scene.formulation = (uz_formulation)random_int(&rng, 0, UZ_FORMULATIONS);
    if (strcmp(element, "quad4") != 0)
        scene.formulation = UZ_FORMULATION_AUTO;
    scene.thickness = random_power(&rng, -2, 2);
    scene.materials[0] = (uz_material){.on = "all", .young = young, .density = 1e-3, .expansion = 1e-5};
    scene.materials[0].poisson = random_chance(&rng, 0.15) ? 0.499 : 0.47 * random_unit(&rng);
    const double place = random_unit(&rng), turn = random_unit(&rng);
    switch (random_int(&rng, 0, 4)) {
    case 0:
        add_support(&scene, "left", step * place, 0);
        break;
    case 1:
        add_support(&scene, "left", 0, NAN);
        add_support(&scene, "top", NAN, -step * place);
        break;
    case 2: /* a slide that is inclined to the body */
        add_support(&scene, "top", NAN, NAN);
        scene.supports[0].kind = UZ_SUPPORT_NORMAL;
        scene.supports[0].normal[0] = 0.3 * turn;
        scene.supports[0].normal[1] = 1;
        scene.supports[0].value = -step * place;
        add_support(&scene, "left", 0, NAN);
        break;
    default:
        add_support(&scene, "top", step * turn, -step * place);
    }
    bound_load(&scene, UZ_LOAD_TRACTION, "right", stress * (random_unit(&rng) - 0.5),
               stress * (random_unit(&rng) - 0.5));
    if (random_chance(&rng, 0.5))
        bound_load(&scene, UZ_LOAD_PRESSURE, "right", stress * random_unit(&rng), 0);
    if (random_chance(&rng, 0.5))
        bound_load(&scene, UZ_LOAD_BODY_FORCE, "all", stress / unit * random_unit(&rng),
                   -stress / unit * random_unit(&rng));
    if (random_chance(&rng, 0.25))
        bound_load(&scene, UZ_LOAD_TEMPERATURE, "all", 100 * (random_unit(&rng) - 0.3), 0);
    const double tilt = random_chance(&rng, 0.4) ? 2e-3 * (random_unit(&rng) - 0.5) : 0;
    const double gap = random_chance(&rng, 0.5) ? 0.5 * step * random_unit(&rng) : 0;
    const double least = fmin(0, fmin(-tilt * width, 0)); /* the corner that is deepest is at the gap */
    const double *x = scene.box.origin;
    add_plane(&scene, "bottom", x[0], x[1] - gap + least - fabs(tilt) * width, tilt, 1);
    bound_change(&scene, kind, gap, stress, &rng);
    return scene;
}

/* As bound_scene; corners within every other body's coarsest meshes are moved. */
static inline uz_scene bound_moved_scene(uint64_t seed, int kind, const char *element, int64_t n, bool coarsest)
{
    uz_scene scene = bound_scene(seed, (bound_kind)kind, element, n);
    if (!coarsest || seed % 2 != 0)
        return scene;
    bound_random = (qp_random){seed + 1000};
    for (int c = 0; c < 2; c++) {
        bound_low[c] = scene.box.origin[c];
        bound_high[c] = scene.box.origin[c] + scene.box.size[c];
        bound_cell[c] = scene.box.size[c] / (double)scene.box.cells[c];
    }
    bound_cell[0] *= 0.2; /* cells are graded */
    body_give_mesh(&scene, bound_shuffle);
    body_straighten(&scene);
    return scene;
}

static inline void take_bound(bound_sweep *x, const uz_guarantee *g, const uz_evaluation *evaluation)
{
    x->answers++;
    x->proved += g->proved;
    if (g->proved) {
        x->lowest = fmin(x->lowest, g->primal);
        x->highest = fmax(x->highest, g->dual);
        x->size = fmax(x->size, fmax(fabs(g->primal), evaluation->strain_energy));
    } else {
        snprintf(x->why, sizeof x->why, "%.158s", g->why);
    }
}

/* A body on meshes of all elements, the last, finer one to compare with. */
typedef uz_scene (*bound_maker)(uint64_t seed, int kind, const char *element, int64_t n, bool coarsest);
static inline bound_sweep sweep_meshes(bound_maker make, uint64_t seed, int kind, int64_t coarsest, int64_t finest)
{
    bound_sweep x = {.highest = -INFINITY, .lowest = INFINITY};
    double primal[16], bound[16];
    int linear[16], n = 0;
    for (int k = 0; k < 9; k++) {
        const bool last = k == 8;
        uz_scene scene = make(seed, kind, last ? "quad8" : BOUND_ELEMENTS[k % 4],
                              last    ? finest
                              : k < 4 ? coarsest
                                      : 2 * coarsest,
                              k < 4);
        uz_problem problem;
        uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        settings.guaranteed = true;
        problem = (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = scene};
        if (uz_solve(&result, &problem, &settings, NULL, NULL, &err) != UZ_OK) {
            snprintf(x.why, sizeof x.why, "%.100s", err.message);
        } else {
            const uz_guarantee g = result->summary.guarantee;
            take_bound(&x, &g, result->summary.evaluation);
            if (g.proved && !last) {
                linear[n] = k % 4 < 2 ? 0 : 1;
                primal[n] = g.primal;
                /* not by the energies: of the answer itself, and `primal` is of what was taken out of the obstacle */
                if (g.bound * g.bound < 2 * (1 - 1e-9) * (g.primal - g.dual))
                    primal[n] = fmin(primal[n], result->summary.evaluation->potential_energy);
                bound[n++] = g.bound;
            }
        }
        uz_result_free(result);
        uz_scene_clear(&scene);
    }
    for (int i = 0; i < n; i++) {
        const double error = sqrt(2 * fmax(0, primal[i] - x.lowest)), more = sqrt(2 * fmax(0, primal[i] - x.highest));
        if (primal[i] - x.lowest <= 1e-9 * x.size)
            continue;
        x.less[linear[i]][x.count[linear[i]]] = bound[i] / more;
        x.effect[linear[i]][x.count[linear[i]]++] = bound[i] / error;
    }
    return x;
}

static inline bound_sweep sweep_bounds(uint64_t seed, bound_kind kind, int64_t coarsest, int64_t finest)
{
    return sweep_meshes(bound_moved_scene, seed, (int)kind, coarsest, finest);
}

/* ---- where answers enter the obstacle, energies say nothing of their error */

/* The displacement of a coarser answer at the nodes of a finer one; elements are triangles or upright rectangles. */
static inline void bound_interpolate(double *out, const uz_body_model *coarse, const double *u,
                                     const uz_body_model *fine)
{
    for (int64_t a = 0; a < fine->mesh.n_nodes; a++) {
        const double *x = fine->mesh.xyz + 2 * a;
        double best = INFINITY;
        for (int64_t e = 0; e < coarse->mesh.n_elements; e++) {
            int count;
            const int64_t *node = uz_mesh_element(&coarse->mesh, e, &count);
            const uz_element_kind kind = (uz_element_kind)coarse->mesh.kind[e];
            const int corners = uz_element_type_of(kind)->corners;
            const double *p = coarse->mesh.xyz + 2 * node[0], *q = coarse->mesh.xyz + 2 * node[1],
                         *r = coarse->mesh.xyz + 2 * node[corners - 1];
            const double det = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            double at[3] = {((x[0] - p[0]) * (r[1] - p[1]) - (x[1] - p[1]) * (r[0] - p[0])) / det,
                            ((q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0])) / det},
                   N[UZ_ELEMENT_NODES];
            const double outside = corners == 3 ? fmax(fmax(-at[0], -at[1]), at[0] + at[1] - 1)
                                                : fmax(fmax(-at[0], -at[1]), fmax(at[0], at[1]) - 1);
            if (!(outside < best))
                continue;
            best = outside;
            for (int c = 0; c < 2 && corners == 4; c++)
                at[c] = 2 * at[c] - 1;
            uz_element_shape(N, kind, at);
            for (int c = 0; c < 2; c++) {
                out[2 * a + c] = 0;
                for (int i = 0; i < count; i++)
                    out[2 * a + c] += N[i] * u[2 * node[i] + c];
            }
        }
    }
}

/* A body on nested meshes of all elements, against answers on finer ones of the same family: effect is the bound over
 * the norm of the difference; low: no bound may be below that less the bound of the finer answer. */
static inline bound_sweep sweep_differences(uint64_t seed, bound_kind kind, int64_t coarsest, int64_t finest)
{
    bound_sweep x = {.highest = -INFINITY, .lowest = INFINITY, .least = INFINITY};
    for (int shape = 0; shape < 2; shape++) {
        uz_body_model fine = {.d = 0};
        uz_result *reference = NULL;
        for (int k = 0; k < 5; k++) {
            const int64_t n = k == 0 ? finest : k <= 2 ? coarsest : 2 * coarsest;
            const bool quadratic = k == 0 || k % 2 == 0;
            uz_scene scene = bound_scene(seed, kind, BOUND_ELEMENTS[shape + (quadratic ? 2 : 0)], n);
            uz_settings settings = uz_settings_default();
            uz_result *result = NULL;
            uz_body_model model = {.d = 0};
            uz_error err = {0};
            scene.box.grading[0] = 1;
            scene.box.cells[0] = n * (int64_t)(scene.box.size[0] / scene.box.size[1] + 0.5);
            scene.formulation = k == 0 ? UZ_FORMULATION_STANDARD : scene.formulation;
            scene.kinematics = UZ_KINEMATICS_FIXED;
            settings.guaranteed = true;
            const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
            if (uz_solve(&result, &problem, &settings, NULL, NULL, &err) != UZ_OK ||
                uz_body_model_build(&model, &scene, UZ_BODY_OUTLINE, &err) != UZ_OK) {
                snprintf(x.why, sizeof x.why, "%.100s", err.message);
                uz_result_free(result);
                uz_scene_clear(&scene);
                continue;
            }
            const uz_guarantee g = result->summary.guarantee;
            take_bound(&x, &g, result->summary.evaluation);
            if (k == 0) {
                reference = result;
                fine = model;
                uz_scene_clear(&scene);
                continue;
            }
            if (g.proved && reference && reference->summary.guarantee.proved) {
                double energy = NAN, *apart = malloc((size_t)(2 * fine.mesh.n_nodes) * sizeof *apart);
                bound_interpolate(apart, &model, result->u, &fine);
                for (int64_t i = 0; i < 2 * fine.mesh.n_nodes; i++)
                    apart[i] -= reference->u[i];
                if (uz_strain_energy(&energy, &fine, apart, true, &err) == UZ_OK) {
                    const double difference = sqrt(2 * energy), off = reference->summary.guarantee.bound;
                    if (difference > 1e-6 * reference->summary.certificate.energy_norm) {
                        x.less[quadratic][x.count[quadratic]] = g.bound / hypot(difference, off);
                        x.effect[quadratic][x.count[quadratic]++] = g.bound / difference;
                        x.least = fmin(x.least, (g.bound + off) / difference);
                    }
                }
                free(apart);
            }
            uz_result_free(result);
            uz_body_model_clear(&model);
            uz_scene_clear(&scene);
        }
        uz_result_free(reference);
        uz_body_model_clear(&fine);
    }
    return x;
}

#endif
