/* theory.h: bodies whose stress or contact pressure is known, at any fineness of the mesh.
 *
 * Sources: Johnson, "Contact Mechanics" (1985), 2.8 (flat punch) and 4.2 (Hertz); Timoshenko and Goodier, "Theory of
 * Elasticity", 28 (thick tube), 21 (beam). Hertz's bodies are half spaces with a parabolic rise: so is the block here,
 * of 20 contact radii, whose sides are planes of symmetry. */
#ifndef TESTS_THEORY_H
#define TESTS_THEORY_H

#include "body_fixture.h"
#include "core/alloc.h"

typedef struct {
    char name[80], quantity[24];
    double computed, theory;
} theory_row;

enum { THEORY_ROWS = 120 };
typedef struct {
    theory_row row[THEORY_ROWS];
    int count;
} theory_table;

static inline void theory_add(theory_table *t, const char *name, const char *quantity, double computed, double theory)
{
    theory_row *row = &t->row[t->count < THEORY_ROWS ? t->count++ : THEORY_ROWS - 1];
    snprintf(row->name, sizeof row->name, "%s", name);
    snprintf(row->quantity, sizeof row->quantity, "%s", quantity);
    row->computed = computed;
    row->theory = theory;
}

static inline double theory_error(const theory_row *row)
{
    return fabs(row->computed / row->theory - 1);
}

/* ---- meshes: a box counted in cells, its nodes then put where they belong */

/* Grid lines from 0: `fine` cells of size h up to `fine` h, then each larger by `ratio`, to the length at the end. */
typedef struct {
    int cells;
    double x[400];
} theory_lines;

static inline theory_lines theory_graded(int fine, double h, double ratio, double length)
{
    theory_lines lines = {.cells = 0};
    double step = h;
    while (lines.cells < 399 && lines.x[lines.cells] < length * (1 - 1e-9)) {
        if (lines.cells >= fine)
            step *= ratio;
        const double next = lines.x[lines.cells] + step;
        const bool last = lines.cells >= fine && next + 0.6 * step * ratio > length;
        lines.cells++;
        lines.x[lines.cells] = last ? length : next;
    }
    return lines;
}

static inline double theory_line(const theory_lines *lines, double s)
{
    int i = (int)floor(s + 1e-9);
    if (i >= lines->cells)
        i = lines->cells - 1;
    return lines->x[i] + (s - i) * (lines->x[i + 1] - lines->x[i]);
}

/* E so that E / (1 - nu^2) is 1. */
static inline uz_scene theory_scene(uz_model model, const char *element, int nx, int ny, int nz)
{
    uz_scene s = body_scene(model, element, (double[3]){nx, ny, nz}, (int64_t[3]){nx, ny, nz});
    s.materials[0].young = 0.91;
    return s;
}

/* Stress at the node closest to (x, y, z); NaN where it failed. */
static inline void theory_stress_at(double stress[6], const uz_scene *scene, const uz_result *result, const double x[3])
{
    uz_fields fields;
    const uz_field_source source = {result->u, result->r, result->g, result->n_nodes * result->mesh.dim, result->m};
    const int dim = result->mesh.dim;
    int64_t best = 0;
    double least = INFINITY;
    uz_error err = {0};
    CHECK_MSG(uz_fields_compute(&fields, scene, &source, UZ_FIELD_STRESS, NULL, &err) == UZ_OK, "%s", err.message);
    for (int64_t a = 0; a < result->n_nodes; a++) {
        double distance = 0;
        for (int c = 0; c < dim; c++)
            distance += pow(result->mesh.xyz[a * dim + c] - x[c], 2);
        if (distance < least) {
            least = distance;
            best = a;
        }
    }
    for (int c = 0; c < 6; c++)
        stress[c] = fields.stress && c < fields.components ? fields.stress[best * fields.components + c] : NAN;
    uz_fields_clear(&fields);
}

static inline void theory_clear(uz_scene *scene, uz_result *result)
{
    uz_result_free(result);
    uz_scene_clear(scene);
}

/* ---- Hertz: contact radius 1, radius of curvature 100, E / (1 - nu^2) = 1 */

#define THEORY_CURVATURE 0.01
#define THEORY_BLOCK     20.0

/* The half width or radius whose Hertz pressure has the second moment of the reactions about x = 0 (and z = 0): the
 * mean of x^2 is a^2 / 4 under the half ellipse, 2 a^2 / 5 under the half ellipsoid. No cell is counted whole in it. */
static inline double theory_width(const uz_result *result, bool line)
{
    const uz_mesh_info *mesh = &result->mesh;
    double sum = 0, moment = 0;
    for (int64_t i = 0; i < result->m; i++) {
        const double *x = mesh->xyz + mesh->contact_node[i] * mesh->dim;
        sum -= result->r[i];
        moment -= result->r[i] * (x[0] * x[0] + (mesh->dim == 3 ? x[2] * x[2] : 0));
    }
    return sqrt((line ? 4 : 2.5) * moment / sum);
}

/* `per_radius` cells in the contact radius; 0 < growth of those beyond. *peak (may be NULL): Hertz's pressure. */
static inline uz_scene theory_hertz_scene(uz_model model, const char *element, int per_radius, double growth,
                                          double *peak)
{
    const bool solid = model == UZ_SOLID, line = model == UZ_PLANE_STRAIN;
    const double length = solid ? 10 : THEORY_BLOCK;
    theory_lines lines = theory_graded(per_radius + (per_radius + 1) / 2, 1.0 / per_radius, growth, length);
    const int n = lines.cells;
    uz_scene s = theory_scene(model, element, n, n, n);
    body_give_mesh(&s, NULL);
    for (int64_t a = 0; a < s.given.n_nodes; a++) {
        double *x = s.given.xyz + a * s.given.dim, away = 0;
        for (int c = 0; c < s.given.dim; c++) {
            x[c] = theory_line(&lines, x[c]);
            away += c == 1 ? 0 : x[c] * x[c];
        }
        x[1] += 0.5 * THEORY_CURVATURE * away * (1 - x[1] / length); /* the top stays flat */
    }
    /* of the half or quarter that is there */
    const double force = line ? M_PI / 8 * THEORY_CURVATURE : (solid ? 1.0 / 3 : 4.0 / 3) * THEORY_CURVATURE;
    const double area = line ? length : solid ? length * length : M_PI * length * length;
    if (peak)
        *peak = line ? 0.5 * THEORY_CURVATURE : 2 / M_PI * THEORY_CURVATURE;
    if (model != UZ_AXISYMMETRIC)
        body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "right", 0, NAN, NAN);
    if (solid) {
        body_hold(&s, "back", NAN, NAN, 0);
        body_hold(&s, "front", NAN, NAN, 0);
    }
    body_load(&s, UZ_LOAD_PRESSURE, "top", force / area, 0, 0);
    body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 1, 0});
    return s;
}

static inline void theory_hertz(theory_table *t, uz_model model, const char *element, int per_radius, double growth)
{
    const bool solid = model == UZ_SOLID, line = model == UZ_PLANE_STRAIN;
    double peak;
    uz_scene s = theory_hertz_scene(model, element, per_radius, growth, &peak);
    uz_result *result = body_solve(&s, 1e-7);
    char name[80];
    snprintf(name, sizeof name, "Hertz, %s, %s, %d cells in the radius",
             line    ? "line (plane strain)"
             : solid ? "point (solid)"
                     : "point (axisymmetric)",
             element, per_radius);
    const double touching = result->evaluation->contact_area;
    theory_add(t, name, "p0", result->summary.max_pressure, peak);
    theory_add(t, name, "a, by area", line ? touching : sqrt((solid ? 4 : 1) * touching / M_PI), 1);
    theory_add(t, name, "a, by moment", theory_width(result, line), 1);
    theory_clear(&s, result);
}

/* ---- a flat punch of half width 1 without friction on a half space */

static inline void theory_punch(theory_table *t, const char *element, int cells)
{
    theory_lines lines = theory_graded(2 * cells, 1.0 / cells, 1.15, THEORY_BLOCK);
    const int n = lines.cells;
    uz_scene s = theory_scene(UZ_PLANE_STRAIN, element, n, n, 0);
    body_give_mesh(&s, NULL);
    for (int64_t i = 0; i < 2 * s.given.n_nodes; i++)
        s.given.xyz[i] = theory_line(&lines, s.given.xyz[i]);
    for (int64_t i = 0; i < s.given.n_groups; i++) { /* of the bottom only what is under the punch */
        uz_given_group *group = &s.given.groups[i];
        if (strcmp(group->name, "bottom") == 0)
            group->n_faces = cells;
    }
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "right", 0, NAN, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "top", 0.5 / THEORY_BLOCK, 0, 0); /* P = 1 on the whole punch */
    body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 1, 0});
    uz_result *result = body_solve(&s, 1e-7);
    char name[80];
    snprintf(name, sizeof name, "flat punch, %s, %d cells in the half width", element, cells);
    for (int64_t i = 0; i < result->m; i++) {
        const double x = result->mesh.xyz[2 * result->mesh.contact_node[i]];
        if (x == 0 || fabs(x - 0.5) < 1e-9)
            theory_add(t, name, x == 0 ? "p(0)" : "p(b/2)", result->pressure[i], 1 / (M_PI * sqrt(1 - x * x)));
    }
    theory_clear(&s, result);
}

/* ---- a thick tube of radii 1 and 2 under inner pressure 3 */

static inline void theory_tube(theory_table *t, uz_model model, const char *element, int cells)
{
    const bool ring = model == UZ_AXISYMMETRIC;
    uz_scene s = theory_scene(model, element, cells, ring ? 2 : 2 * cells, 0);
    body_give_mesh(&s, NULL);
    for (int64_t a = 0; a < s.given.n_nodes; a++) {
        double *x = s.given.xyz + 2 * a;
        const double r = 1 + x[0] / cells, angle = ring ? 0 : 0.5 * M_PI * x[1] / (2 * cells);
        x[1] = ring ? 0.1 * x[1] : r * sin(angle);
        x[0] = r * cos(angle);
    }
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_hold(&s, "top", ring ? NAN : 0, ring ? 0 : NAN, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "left", 3, 0, 0);
    uz_result *result = body_solve(&s, 1e-8);
    double stress[6];
    char name[80];
    theory_stress_at(stress, &s, result, (double[3]){1, 0, 0});
    snprintf(name, sizeof name, "thick tube, %s, %s, %d cells across", ring ? "axisymmetric" : "plane strain", element,
             cells);
    theory_add(t, name, "hoop", stress[ring ? 2 : 1], 5);
    theory_add(t, name, "radial", stress[0], -3);
    theory_clear(&s, result);
}

/* ---- a cantilever of length 10 and height 1 with a force at its end: the fibre halfway */

static inline void theory_beam(theory_table *t, const char *element, uz_formulation formulation, int cells)
{
    uz_scene s = theory_scene(UZ_PLANE_STRESS, element, 10 * cells, cells, 0);
    for (int c = 0; c < 2; c++)
        s.box.size[c] /= cells;
    s.formulation = formulation;
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, -1e-4, 0);
    uz_result *result = body_solve(&s, 1e-8);
    double stress[6];
    char name[80];
    theory_stress_at(stress, &s, result, (double[3]){5, 1, 0});
    snprintf(name, sizeof name, "bent beam, %s%s, %d cells high", element,
             formulation == UZ_FORMULATION_INCOMPATIBLE ? " (incompatible modes)" : "", cells);
    theory_add(t, name, "bending stress", stress[0], 5e-4 * 6);
    theory_clear(&s, result);
}

/* ---- a cylinder of steel, R = 50, pressed by 35 kN/mm on a block of aluminium: NAFEMS, "Benchmark tests for finite
 * element modelling of contact", 2D roller (mm, N, MPa). Half of the lower half of the cylinder, up to its centre. */

/* Adds the mesh of `from` to that of `to`; its groups come with `prefix` before their names, as do those of `to` with
 * `own`. */
static inline void theory_join(uz_scene *to, const char *own, uz_scene *from, const char *prefix)
{
    uz_given_mesh *a = &to->given, *b = &from->given;
    const int64_t nodes = a->n_nodes, elements = a->n_elements, ends = a->first[elements],
                  more = b->first[b->n_elements];
    const int64_t n_groups = a->n_groups + b->n_groups;
    a->xyz = realloc(a->xyz, (size_t)((nodes + b->n_nodes) * a->dim) * sizeof *a->xyz);
    a->kind = realloc(a->kind, (size_t)(elements + b->n_elements));
    a->first = realloc(a->first, (size_t)(elements + b->n_elements + 1) * sizeof *a->first);
    a->node = realloc(a->node, (size_t)(ends + more) * sizeof *a->node);
    a->groups = realloc(a->groups, (size_t)n_groups * sizeof *a->groups);
    if (!a->xyz || !a->kind || !a->first || !a->node || !a->groups)
        abort();
    memcpy(a->xyz + nodes * a->dim, b->xyz, (size_t)(b->n_nodes * a->dim) * sizeof *a->xyz);
    memcpy(a->kind + elements, b->kind, (size_t)b->n_elements);
    for (int64_t e = 0; e <= b->n_elements; e++)
        a->first[elements + e] = ends + b->first[e];
    for (int64_t i = 0; i < more; i++)
        a->node[ends + i] = nodes + b->node[i];
    for (int64_t i = 0; i < n_groups; i++) {
        const bool mine = i < a->n_groups;
        char name[64];
        uz_given_group *group = &a->groups[i];
        if (!mine)
            *group = b->groups[i - a->n_groups];
        snprintf(name, sizeof name, "%s_%.40s", mine ? own : prefix, group->name);
        memcpy(group->name, name, sizeof name);
        for (int64_t k = 0; !mine && k < group->n_elements; k++)
            group->element[k] += elements;
        for (int64_t k = 0; !mine && group->n_faces > 0 && k < group->face_first[group->n_faces]; k++)
            group->face_node[k] += nodes;
    }
    a->n_groups = n_groups;
    a->n_nodes += b->n_nodes;
    a->n_elements += b->n_elements;
    uz_free_all(b->xyz, b->kind, b->first, b->node, b->groups);
    *b = (uz_given_mesh){.dim = a->dim};
    uz_scene_clear(from);
}

/* The lower quarter: from the arc, that far along it, to the level of the centre. */
static inline uz_scene theory_cylinder(const char *element, int per_radius, double a, double growth)
{
    const double R = 50, reach = 80 * M_PI / 180;
    const theory_lines along = theory_graded(per_radius + per_radius / 2, a / per_radius, growth, R * reach);
    const theory_lines up = theory_graded(per_radius + per_radius / 2, a / per_radius, growth, R);
    uz_scene s = theory_scene(UZ_PLANE_STRAIN, element, along.cells, up.cells, 0);
    body_give_mesh(&s, NULL);
    for (int64_t i = 0; i < s.given.n_nodes; i++) {
        double *x = s.given.xyz + 2 * i;
        const double angle = theory_line(&along, x[0]) / R, t = theory_line(&up, x[1]) / R;
        x[0] = (1 - t) * R * sin(angle) + t * R * angle / reach;
        x[1] = (1 - t) * R * (1 - cos(angle)) + t * R;
    }
    return s;
}

static inline void theory_roller(theory_table *t, const char *element, int per_radius, double growth)
{
    const double a = 6.215, force = 35e3;
    const theory_lines x = theory_graded(per_radius + per_radius / 2, a / per_radius, growth, 100);
    const theory_lines y = theory_graded(per_radius + per_radius / 2, a / per_radius, growth, 200);
    uz_scene s = theory_scene(UZ_PLANE_STRAIN, element, x.cells, y.cells, 0);
    uz_scene roller = theory_cylinder(element, per_radius, a, growth);
    body_give_mesh(&s, NULL);
    for (int64_t i = 0; i < s.given.n_nodes; i++) {
        s.given.xyz[2 * i] = theory_line(&x, s.given.xyz[2 * i]);
        s.given.xyz[2 * i + 1] = -theory_line(&y, y.cells - s.given.xyz[2 * i + 1]);
    }
    theory_join(&s, "block", &roller, "roller");
    s.materials[0] = (uz_material){.on = "block_all", .young = 70e3, .poisson = 0.3};
    s.materials[s.n_materials++] = (uz_material){.on = "roller_all", .young = 210e3, .poisson = 0.3};
    body_hold(&s, "block_left", 0, NAN, NAN);
    body_hold(&s, "block_bottom", NAN, 0, NAN);
    body_hold(&s, "roller_left", 0, NAN, NAN);
    body_load(&s, UZ_LOAD_FORCE, "roller_top", 0, -0.5 * force, 0);
    uz_contact *contact = body_plane(&s, "roller_bottom", (double[3]){0}, (double[3]){0, 1, 0});
    contact->kind = UZ_OBSTACLE_BODY;
    snprintf(contact->with, sizeof contact->with, "block_top");
    uz_result *result = body_solve(&s, 1e-5);
    char name[80];
    snprintf(name, sizeof name, "NAFEMS roller, %s, %d cells in the half width", element, per_radius);
    theory_add(t, name, "p0", result->summary.max_pressure, 3585);
    theory_add(t, name, "a, by area", result->evaluation->contact_area, a);
    theory_add(t, name, "a, by moment", theory_width(result, true), a);
    CHECK(fabs(result->evaluation->contacts[0].force[1] / (0.5 * force) - 1) < 1e-4);
    CHECK(result->evaluation->imbalance < 1e-5);
    theory_clear(&s, result);
}

#endif
