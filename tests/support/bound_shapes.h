/* bound_shapes.h: generated bodies of any outline: patches that are left out, stretched and bent, of several materials,
 * in one part or two that face each other, with all that holds and loads them, on meshes of every plane element. */
#ifndef TESTS_BOUND_SHAPES_H
#define TESTS_BOUND_SHAPES_H

#include "bound_scenes.h"

enum { SHAPE_MOST = 3, SHAPE_SIDES = 4, SHAPE_MATERIALS = 3, SHAPE_ROOM = 64 };
static const char *const SHAPE_SIDE[SHAPE_SIDES] = {"bottom", "right", "top", "left"};

/* Sides are numbered as in SHAPE_SIDE; patches by row and column. */
typedef struct {
    int wide, high, cut; /* patches; the row above which the second part begins, 0: one part */
    bool there[SHAPE_MOST][SHAPE_MOST];
    int material[SHAPE_MOST][SHAPE_MOST];
    double corner[2][SHAPE_MOST + 1][SHAPE_MOST + 1][2]; /* by part, row and column */
    double finer;                                        /* cells of the second part over the first's */
    bool shuffled, rings;
} bound_shape;

static inline bool shape_has(const bound_shape *s, int row, int column)
{
    return row >= 0 && row < s->high && column >= 0 && column < s->wide && s->there[row][column];
}

/* Is a patch's side on the border: that of the body, or of its part? */
static inline bool shape_ends(const bound_shape *s, int row, int column, int side)
{
    static const int STEP[SHAPE_SIDES][2] = {{-1, 0}, {0, 1}, {1, 0}, {0, -1}};
    const int to = row + STEP[side][0];
    return !shape_has(s, to, column + STEP[side][1]) || (s->cut > 0 && (row < s->cut) != (to < s->cut));
}

/* Patches are left out as long as what is there hangs together by whole sides. */
static inline bool shape_hangs_together(const bound_shape *s)
{
    int label[SHAPE_MOST][SHAPE_MOST] = {{0}}, parts = 0;
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++)
            label[row][column] = s->there[row][column] ? ++parts : 0;
    for (int pass = 0; pass < SHAPE_MOST * SHAPE_MOST; pass++)
        for (int row = 0; row < s->high; row++)
            for (int column = 0; column < s->wide; column++) {
                if (column + 1 < s->wide && label[row][column] && label[row][column + 1])
                    label[row][column] = label[row][column + 1] =
                        label[row][column] < label[row][column + 1] ? label[row][column] : label[row][column + 1];
                if (row + 1 < s->high && label[row][column] && label[row + 1][column])
                    label[row][column] = label[row + 1][column] =
                        label[row][column] < label[row + 1][column] ? label[row][column] : label[row + 1][column];
            }
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++)
            if (s->there[row][column] && label[row][column] != 1)
                return false;
    /* no two patches that have a corner alone in common */
    for (int row = 0; row + 1 < s->high; row++)
        for (int column = 0; column + 1 < s->wide; column++)
            if (s->there[row][column] == s->there[row + 1][column + 1] &&
                s->there[row][column + 1] == s->there[row + 1][column] &&
                s->there[row][column] != s->there[row][column + 1])
                return false;
    return s->there[0][0];
}

static inline void shape_cut_out(bound_shape *s, qp_random *rng)
{
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++)
            s->there[row][column] = true;
    for (int tries = (int)random_int(rng, 0, 4); tries > 0; tries--) {
        bool *which = &s->there[random_int(rng, 0, s->high)][random_int(rng, 0, s->wide)];
        *which = false;
        if (!shape_hangs_together(s))
            *which = true;
    }
}

/* Do the two parts face each other anywhere? */
static inline bool shape_faces(const bound_shape *s)
{
    for (int column = 0; column < s->wide && s->cut > 0; column++)
        if (s->there[s->cut - 1][column] && s->there[s->cut][column])
            return true;
    return false;
}

/* unit: what lengths are about; lopsided: exponent of the ratio of their largest and least. */
static inline void shape_place(bound_shape *s, qp_random *rng, double unit, double lopsided, const double origin[2])
{
    double line[2][SHAPE_MOST + 1] = {{0}}, least[2] = {INFINITY, INFINITY};
    const int count[2] = {s->wide, s->high};
    const double bend = random_chance(rng, 0.5) ? 0.25 : 0;
    for (int c = 0; c < 2; c++)
        for (int i = 0; i < count[c]; i++) {
            const double step = unit * random_power(rng, -lopsided, lopsided);
            line[c][i + 1] = line[c][i] + step;
            least[c] = fmin(least[c], step);
        }
    for (int part = 0; part < 2; part++)
        for (int row = 0; row <= s->high; row++)
            for (int column = 0; column <= s->wide; column++) {
                double *x = s->corner[part][row][column];
                x[0] = origin[0] + line[0][column] + bend * least[0] * random_signed(rng);
                x[1] = origin[1] + line[1][row] + bend * least[1] * random_signed(rng);
                if (s->rings && column == 0)
                    x[0] = fmax(0, origin[0]);
                if (s->cut > 0 && row == s->cut) /* straight, and where the other part has it */
                    x[1] = origin[1] + line[1][row];
                if (part == 1 && (s->cut == 0 || row != s->cut))
                    memcpy(x, s->corner[0][row][column], 2 * sizeof *x);
            }
}

static inline void shape_point(double x[2], const bound_shape *s, int row, int column, double across, double up)
{
    const int part = s->cut > 0 && row >= s->cut;
    for (int c = 0; c < 2; c++)
        x[c] =
            (1 - up) * ((1 - across) * s->corner[part][row][column][c] + across * s->corner[part][row][column + 1][c]) +
            up *
                ((1 - across) * s->corner[part][row + 1][column][c] + across * s->corner[part][row + 1][column + 1][c]);
}

/* ---- its mesh */

typedef struct {
    uz_given_mesh *mesh;
    int64_t *number; /* by part and place on its lattice; -1: not yet */
    int64_t lattice;
    int n[2], step;
} shape_weaver;

static inline int64_t shape_node(shape_weaver *w, const bound_shape *s, int row, int column, int i, int j)
{
    const int part = s->cut > 0 && row >= s->cut, cells = w->n[part] * w->step;
    int64_t *number = &w->number[(part * w->lattice + row * cells + j) * w->lattice + column * cells + i];
    if (*number < 0) {
        *number = w->mesh->n_nodes++;
        shape_point(w->mesh->xyz + 2 * *number, s, row, column, (double)i / cells, (double)j / cells);
    }
    return *number;
}

static inline uz_given_group *shape_group(uz_given_mesh *mesh, const char *name)
{
    for (int64_t k = 0; k < mesh->n_groups; k++)
        if (strcmp(mesh->groups[k].name, name) == 0)
            return &mesh->groups[k];
    uz_given_group *group = &mesh->groups[mesh->n_groups++];
    snprintf(group->name, sizeof group->name, "%s", name);
    group->face_first = body_room(4000, sizeof *group->face_first);
    group->face_node = body_room(12000, sizeof *group->face_node);
    group->element = body_room(4000, sizeof *group->element);
    return group;
}

static inline void shape_add_edge(uz_given_mesh *mesh, const char *name, int64_t a, int64_t b, int64_t middle)
{
    uz_given_group *group = shape_group(mesh, name);
    int64_t *at = &group->face_first[group->n_faces++];
    const int64_t node[3] = {a, b, middle};
    const int count = middle < 0 ? 2 : 3;
    memcpy(group->face_node + *at, node, (size_t)count * sizeof *node);
    at[1] = at[0] + count;
}

static inline void shape_add_element(uz_given_mesh *mesh, const bound_shape *s, int row, int column,
                                     uz_element_kind kind, const int64_t *node)
{
    char name[16];
    const int count = uz_element_type_of(kind)->nodes;
    const int64_t e = mesh->n_elements++;
    mesh->kind[e] = (unsigned char)kind;
    memcpy(mesh->node + mesh->first[e], node, (size_t)count * sizeof *node);
    mesh->first[e + 1] = mesh->first[e] + count;
    snprintf(name, sizeof name, "m%d", s->material[row][column]);
    uz_given_group *group = shape_group(mesh, name);
    group->element[group->n_elements++] = e;
}

/* The cells of a patch, and the groups of its sides. */
static inline void shape_weave(shape_weaver *w, const bound_shape *s, int row, int column, const char *element)
{
    static const int DIAGONAL[2][2][3] = {{{0, 1, 2}, {0, 2, 3}}, {{0, 1, 3}, {1, 2, 3}}};
    const bool triangles = element[0] == 't', quadratic = w->step == 2;
    const int n = w->n[s->cut > 0 && row >= s->cut], h = w->step;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            const int at[4][2] = {{h * i, h * j}, {h * i + h, h * j}, {h * i + h, h * j + h}, {h * i, h * j + h}};
            int64_t node[8];
            for (int k = 0; k < 4; k++) {
                node[k] = shape_node(w, s, row, column, at[k][0], at[k][1]);
                if (quadratic)
                    node[4 + k] = shape_node(w, s, row, column, (at[k][0] + at[(k + 1) % 4][0]) / 2,
                                             (at[k][1] + at[(k + 1) % 4][1]) / 2);
            }
            if (!triangles)
                shape_add_element(w->mesh, s, row, column, quadratic ? UZ_QUAD8 : UZ_QUAD4, node);
            for (int t = 0; t < (triangles ? 2 : 0); t++) {
                const int *corner = DIAGONAL[(i + j + row) % 2][t];
                int64_t own[6];
                for (int k = 0; k < 3; k++) {
                    const int a = corner[k], b = corner[(k + 1) % 3], apart = (b - a + 4) % 4;
                    own[k] = node[a];
                    if (quadratic)
                        own[3 + k] = apart == 1   ? node[4 + a]
                                     : apart == 3 ? node[4 + b]
                                                  : shape_node(w, s, row, column, h * i + 1, h * j + 1);
                }
                shape_add_element(w->mesh, s, row, column, quadratic ? UZ_TRI6 : UZ_TRI3, own);
            }
            const bool outer[SHAPE_SIDES] = {j == 0, i == n - 1, j == n - 1, i == 0};
            for (int k = 0; k < SHAPE_SIDES; k++) {
                if (!outer[k] || !shape_ends(s, row, column, k))
                    continue;
                const bool line = s->cut > 0 && ((k == 0 && row == s->cut) || (k == 2 && row + 1 == s->cut));
                char name[16];
                snprintf(name, sizeof name, "%c%d%d", SHAPE_SIDE[k][0], row, column);
                shape_add_edge(w->mesh, line ? (k == 0 ? "foot" : "floor") : SHAPE_SIDE[k], node[k], node[(k + 1) % 4],
                               quadratic ? node[4 + k] : -1);
                if (!line)
                    shape_add_edge(w->mesh, name, node[k], node[(k + 1) % 4], quadratic ? node[4 + k] : -1);
            }
        }
}

/* Corners within patches are moved by up to a fifth of their cell. */
static inline void shape_shuffle(shape_weaver *w, const bound_shape *s, uint64_t seed)
{
    qp_random rng = {seed};
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++) {
            const int part = s->cut > 0 && row >= s->cut, n = w->n[part], cells = n * w->step;
            for (int j = w->step; s->there[row][column] && j < cells; j += w->step)
                for (int i = w->step; i < cells; i += w->step)
                    shape_point(w->mesh->xyz + 2 * shape_node(w, s, row, column, i, j), s, row, column,
                                (double)i / cells + 0.2 * random_signed(&rng) / n,
                                (double)j / cells + 0.2 * random_signed(&rng) / n);
        }
}

static inline void shape_mesh(uz_scene *scene, const bound_shape *s, const char *element, int n, uint64_t seed)
{
    uz_given_mesh *mesh = &scene->given;
    shape_weaver w = {.mesh = mesh, .n = {n, (int)fmax(1, floor(n * s->finer + 0.5))}};
    w.step = strcmp(element, "tri6") == 0 || strcmp(element, "quad8") == 0 ? 2 : 1;
    const int most = w.n[0] > w.n[1] ? w.n[0] : w.n[1];
    w.lattice = SHAPE_MOST * most * w.step + 1;
    const int64_t places = 2 * w.lattice * w.lattice, elements = 2 * SHAPE_MOST * SHAPE_MOST * most * most;
    w.number = body_room(places, sizeof *w.number);
    for (int64_t i = 0; i < places; i++)
        w.number[i] = -1;
    *mesh = (uz_given_mesh){.dim = 2};
    mesh->xyz = body_room(2 * places, sizeof *mesh->xyz);
    mesh->kind = body_room(elements, 1);
    mesh->first = body_room(elements + 1, sizeof *mesh->first);
    mesh->node = body_room(8 * elements, sizeof *mesh->node);
    mesh->groups = body_room(SHAPE_ROOM, sizeof *mesh->groups);
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++)
            if (s->there[row][column])
                shape_weave(&w, s, row, column, element);
    if (s->shuffled)
        shape_shuffle(&w, s, seed);
    body_straighten(scene);
    free(w.number);
    scene->source = UZ_MESH_GIVEN;
}

/* ---- what happens to it */

/* A side that ends the body, at random: its name, and whether there is one. */
static inline bool shape_side(char name[16], double edge[2][2], const bound_shape *s, qp_random *rng)
{
    for (int tries = 0; tries < 40; tries++) {
        const int row = (int)random_int(rng, 0, s->high), column = (int)random_int(rng, 0, s->wide);
        const int side = (int)random_int(rng, 0, SHAPE_SIDES);
        if (!s->there[row][column] || !shape_ends(s, row, column, side) || (s->rings && column == 0 && side == 3) ||
            (s->cut > 0 && ((side == 0 && row == s->cut) || (side == 2 && row + 1 == s->cut))))
            continue;
        snprintf(name, 16, "%c%d%d", SHAPE_SIDE[side][0], row, column);
        shape_point(edge[0], s, row, column, side == 1 || side == 2, side >= 2);
        shape_point(edge[1], s, row, column, side == 0 || side == 1, side == 1 || side == 2);
        return true;
    }
    return false;
}

/* A plane that just leaves `gap` below the sides of the body that look down, or aside. */
static inline void shape_stand(uz_scene *scene, const bound_shape *s, int side, double gap, double tilt)
{
    static const double INTO[SHAPE_SIDES][2] = {{0, 1}, {-1, 0}, {0, -1}, {1, 0}};
    const double n[2] = {INTO[side][0] * cos(tilt) - INTO[side][1] * sin(tilt),
                         INTO[side][0] * sin(tilt) + INTO[side][1] * cos(tilt)};
    double least = INFINITY, at[2];
    for (int row = 0; row < s->high; row++)
        for (int column = 0; column < s->wide; column++)
            for (int k = 0; s->there[row][column] && shape_ends(s, row, column, side) && k < 2; k++) {
                shape_point(at, s, row, column, side == 1 || (side % 2 == 0 && k), side == 2 || (side % 2 == 1 && k));
                least = fmin(least, n[0] * at[0] + n[1] * at[1]);
            }
    add_plane(scene, SHAPE_SIDE[side], n[0] * (least - gap), n[1] * (least - gap), n[0], n[1]);
}

static inline void shape_hold(uz_scene *scene, const bound_shape *s, double step, qp_random *rng)
{
    char name[16];
    double edge[2][2];
    const int how = (int)random_int(rng, 0, 6);
    if (s->rings)
        add_support(scene, SHAPE_SIDE[2],
                    random_chance(rng, 0.3) ? step * random_unit(rng) * (s->corner[0][0][0][0] > 0) : NAN,
                    -step * random_unit(rng));
    else if (how == 0)
        add_support(scene, "left", step * random_unit(rng), 0);
    else if (how == 1) {
        add_support(scene, "left", 0, NAN);
        add_support(scene, "top", NAN, -step * random_unit(rng));
    } else if (how == 2)
        add_support(scene, "top", step * random_unit(rng), -step * random_unit(rng));
    else if (how == 3 && shape_side(name, edge, s, rng)) { /* a slide along an oblique side, and a clamp */
        add_support(scene, "top", NAN, 0);
        add_support(scene, name, NAN, NAN);
        scene->supports[1].kind = UZ_SUPPORT_NORMAL;
        scene->supports[1].normal[0] = edge[1][1] - edge[0][1];
        scene->supports[1].normal[1] = edge[0][0] - edge[1][0];
        scene->supports[1].value = -0.3 * step * random_unit(rng);
        add_support(scene, "left", 0, NAN);
    } else if (how == 4 && shape_side(name, edge, s, rng)) /* one side of a patch */
        add_support(scene, name, 0, 0);
    else { /* on springs */
        const double k = scene->materials[0].young * scene->thickness * random_power(rng, -2, 2);
        scene->supports[scene->n_supports++] =
            (uz_support){.kind = UZ_SUPPORT_SPRING, .on = "top", .spring = {k * random_unit(rng), k}};
    }
    if (s->cut > 0) {
        scene->n_supports = 0;
        add_support(scene, "top", random_chance(rng, 0.5) ? 0 : NAN, -step * random_unit(rng));
        add_support(scene, "bottom", s->rings ? NAN : 0, 0);
        if (isnan(scene->supports[0].u[0]) && !s->rings)
            add_support(scene, "left", 0, NAN);
    }
}

static inline void shape_load(uz_scene *scene, const bound_shape *s, double stress, double unit, qp_random *rng)
{
    char name[16];
    double edge[2][2];
    for (int tries = (int)random_int(rng, 0, 3); tries > 0; tries--)
        if (shape_side(name, edge, s, rng)) {
            if (random_chance(rng, 0.4))
                bound_load(scene, UZ_LOAD_PRESSURE, name, stress * random_signed(rng), 0);
            else
                bound_load(scene, UZ_LOAD_TRACTION, name, stress * random_signed(rng), stress * random_signed(rng));
        }
    if (random_chance(rng, 0.3))
        bound_load(scene, UZ_LOAD_BODY_FORCE, "all", s->rings ? 0 : stress / unit * random_signed(rng),
                   -stress / unit * random_unit(rng));
    if (random_chance(rng, 0.2))
        bound_load(scene, UZ_LOAD_GRAVITY, "all", 0, -stress / unit / 1e-3 * random_unit(rng));
    if (random_chance(rng, 0.2) && shape_side(name, edge, s, rng)) {
        const double area = unit * (s->rings ? 6 * fmax(edge[0][0], edge[1][0]) : scene->thickness);
        bound_load(scene, UZ_LOAD_FORCE, name, stress * area * random_signed(rng), stress * area * random_signed(rng));
    }
    if (random_chance(rng, 0.3))
        bound_load(scene, UZ_LOAD_TEMPERATURE, random_chance(rng, 0.5) ? "m0" : "all", 100 * random_signed(rng), 0);
}

static inline void shape_meet(uz_scene *scene, const bound_shape *s, double step, qp_random *rng)
{
    const double tilt = random_chance(rng, 0.5) ? 0 : (s->rings ? 0.002 : 0.05) * random_signed(rng);
    const double gap = random_chance(rng, 0.5) ? 0 : 0.3 * step * random_unit(rng);
    if (s->cut > 0) {
        scene->contacts[scene->n_contacts++] = (uz_contact){.kind = UZ_OBSTACLE_BODY, .on = "foot", .with = "floor"};
        return;
    }
    if (random_chance(rng, 0.1))
        return;
    shape_stand(scene, s, 0, gap, tilt);
    if (random_chance(rng, 0.3))
        shape_stand(scene, s, 1, gap * random_unit(rng), tilt);
    const uz_support *first = &scene->supports[0];
    const bool slides = !(fabs(first->u[0]) > 0) && first->kind != UZ_SUPPORT_NORMAL;
    if (random_chance(rng, 0.1) && !s->rings && slides) /* held along the obstacle */
        add_support(scene, "bottom", 0, NAN);
}

/* n: cells along each side of a patch. */
static inline uz_scene shape_scene(uint64_t seed, int kind, const char *element, int64_t n, bool coarsest)
{
    static const double POISSON[] = {0, 0.3, 0.45, 0.499, 0.4999};
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 17};
    bound_shape s = {.wide = (int)random_int(&rng, 1, SHAPE_MOST + 1),
                     .high = (int)random_int(&rng, 1, SHAPE_MOST + 1)};
    const double unit = random_power(&rng, -3, 3), young = random_power(&rng, 0, 11), stress = 1e-3 * young;
    const double step = 2e-3 * unit;
    uz_scene scene = box_scene(1, 1, 1, 1);
    scene.model = (uz_model)random_int(&rng, 0, 3);
    s.rings = scene.model == UZ_AXISYMMETRIC;
    scene.formulation = (uz_formulation)random_int(&rng, 0, UZ_FORMULATIONS);
    if (strcmp(element, "quad4") != 0)
        scene.formulation = UZ_FORMULATION_AUTO;
    scene.kinematics = UZ_KINEMATICS_FIXED;
    scene.thickness = s.rings ? 1 : random_power(&rng, -2, 2);
    s.finer = 1;
    if (!s.rings && s.high > 1 && random_chance(&rng, 0.3)) {
        s.cut = (int)random_int(&rng, 1, s.high);
        s.finer = random_chance(&rng, 0.4) ? 1 : random_power(&rng, -0.3, 0.3);
    }
    shape_cut_out(&s, &rng);
    s.cut = shape_faces(&s) ? s.cut : 0;
    const double far = random_chance(&rng, 0.2) ? 20 * unit : 0;
    const double origin[2] = {s.rings ? (random_chance(&rng, 0.5) ? 0 : unit * random_power(&rng, -1.5, 1)) : far,
                              -far};
    shape_place(&s, &rng, unit, random_chance(&rng, 0.6) ? 0.15 : 0.7, origin);
    s.shuffled = random_chance(&rng, 0.4);
    scene.n_materials = 0;
    const int kinds = (int)random_int(&rng, 1, SHAPE_MATERIALS + 1);
    const double contrast = random_power(&rng, 0, 3);
    for (int k = 0; k < kinds; k++) {
        scene.materials[k] = (uz_material){
            .young = young * pow(contrast, k - 1), .density = 1e-3 * (k + 1), .expansion = 1e-5 * (k + 1)};
        scene.materials[k].poisson = POISSON[random_int(&rng, 0, 5)];
        snprintf(scene.materials[k].on, sizeof scene.materials[k].on, "m%d", k);
    }
    bool used[SHAPE_MATERIALS] = {false};
    for (int row = 0; row < s.high; row++)
        for (int column = 0; column < s.wide; column++) {
            s.material[row][column] = row + column == 0 ? 0 : (int)random_int(&rng, 0, kinds);
            used[s.material[row][column]] = used[s.material[row][column]] || s.there[row][column];
        }
    shape_hold(&scene, &s, step, &rng);
    shape_load(&scene, &s, stress, unit, &rng);
    shape_meet(&scene, &s, step, &rng);
    (void)kind;
    s.shuffled = s.shuffled && coarsest;
    shape_mesh(&scene, &s, element, (int)n, seed);
    for (int k = 0; k < kinds; k++)
        if (used[k])
            scene.materials[scene.n_materials++] = scene.materials[k];
    return scene;
}

#endif
