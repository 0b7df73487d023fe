/* guarantee.c: what a guaranteed bound on the whole error takes, and with it the interval of a quantity, in units of
 * the solve whose answer it is about, on the same mesh: of the processor's time, all threads. */
#include "bench/bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { RUNS = 5, CELLS = 40, FEWER = 29 /* of the part that faces the other one */ };

/* By what the body touches. */
static const char *const KINDS[] = {"plane", "disc", "lines", "ball", "parts"};
static const char *const ELEMENTS[] = {"quad4", "tri3", "quad8", "tri6"};
enum { N_KINDS = sizeof KINDS / sizeof KINDS[0], N_ELEMENTS = sizeof ELEMENTS / sizeof ELEMENTS[0] };

const char *bench_guarantee_name(char name[64], int which)
{
    if (which >= N_KINDS * N_ELEMENTS)
        return NULL;
    snprintf(name, 64, "guarantee_%s_%s", KINDS[which / N_ELEMENTS], ELEMENTS[which % N_ELEMENTS]);
    return name;
}

static double processor_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---- two blocks in numbers, the upper one narrower and with other cells */

typedef struct {
    uz_given_mesh mesh;
    const char *element;
} weaver;

static void add_side(uz_given_mesh *mesh, const char *name, const int64_t *face, int64_t n, int per)
{
    uz_given_group *group = &mesh->groups[mesh->n_groups++];
    *group = (uz_given_group){.n_faces = n,
                              .face_first = calloc((size_t)n + 1, sizeof(int64_t)),
                              .face_node = calloc((size_t)(n * per), sizeof(int64_t))};
    snprintf(group->name, sizeof group->name, "%s", name);
    memcpy(group->face_node, face, (size_t)(n * per) * sizeof *face);
    for (int64_t i = 0; i <= n; i++)
        group->face_first[i] = i * per;
}

static int64_t node_at(const int64_t *number, int64_t columns, int64_t i, int64_t j)
{
    return number[j * columns + i];
}

/* Cells of a block; its bottom and top are groups. */
static void add_block(weaver *w, const double low[2], const double high[2], const int64_t n[2], const char *bottom,
                      const char *top)
{
    uz_given_mesh *mesh = &w->mesh;
    const bool quadratic = strcmp(w->element, "quad8") == 0 || strcmp(w->element, "tri6") == 0;
    const bool triangles = w->element[0] == 't';
    const int step = quadratic ? 2 : 1, per = quadratic ? 3 : 2;
    const int64_t columns = n[0] * step + 1, rows = n[1] * step + 1;
    int64_t *number = malloc((size_t)(columns * rows) * sizeof *number);
    int64_t *face = malloc((size_t)(n[0] * per) * sizeof *face);
    for (int64_t j = 0; j < rows; j++)
        for (int64_t i = 0; i < columns; i++) {
            const bool inner = quadratic && !triangles && i % 2 == 1 && j % 2 == 1;
            number[j * columns + i] = inner ? -1 : mesh->n_nodes;
            if (inner)
                continue;
            mesh->xyz[2 * mesh->n_nodes] = low[0] + (high[0] - low[0]) * (double)i / (double)(columns - 1);
            mesh->xyz[2 * mesh->n_nodes++ + 1] = low[1] + (high[1] - low[1]) * (double)j / (double)(rows - 1);
        }
    static const int CORNERS[3][4] = {{0, 1, 2, 3}, {0, 1, 2, 0}, {0, 2, 3, 0}};
    for (int64_t j = 0; j < n[1]; j++)
        for (int64_t i = 0; i < n[0]; i++)
            for (int t = triangles ? 1 : 0; t < (triangles ? 3 : 1); t++) {
                const int corners = triangles ? 3 : 4;
                int64_t at[4][2], *to = mesh->node + mesh->first[mesh->n_elements];
                for (int k = 0; k < corners; k++) {
                    at[k][0] = (i + (CORNERS[t][k] % 3 > 0)) * step;
                    at[k][1] = (j + CORNERS[t][k] / 2) * step;
                    to[k] = node_at(number, columns, at[k][0], at[k][1]);
                }
                for (int k = 0; k < corners && quadratic; k++) {
                    const int64_t *a = at[k], *b = at[(k + 1) % corners];
                    to[corners + k] = node_at(number, columns, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
                }
                uz_element_kind kind = UZ_QUAD4;
                uz_element_parse(&kind, w->element);
                mesh->kind[mesh->n_elements++] = (unsigned char)kind;
                mesh->first[mesh->n_elements] = mesh->first[mesh->n_elements - 1] + uz_element_node_count(kind);
            }
    for (int side = 0; side < 2; side++) {
        for (int64_t i = 0; i < n[0]; i++)
            for (int k = 0; k < per; k++) { /* ends first */
                const int64_t along = k < 2 ? (i + (side == 0 ? k : 1 - k)) * step : i * step + 1;
                face[i * per + k] = node_at(number, columns, along, side == 0 ? 0 : rows - 1);
            }
        add_side(mesh, side == 0 ? bottom : top, face, n[0], per);
    }
    free(face);
    free(number);
}

static uz_given_mesh two_blocks(const char *element)
{
    enum { MOST = 8 * CELLS * CELLS * 4 };
    weaver w = {.element = element};
    w.mesh = (uz_given_mesh){.dim = 2,
                             .xyz = malloc(2 * MOST * sizeof(double)),
                             .kind = malloc(MOST),
                             .first = calloc(MOST, sizeof(int64_t)),
                             .node = malloc((size_t)8 * MOST * sizeof(int64_t)),
                             .groups = calloc(4, sizeof(uz_given_group))};
    add_block(&w, (double[2]){0, 0}, (double[2]){60, 20}, (int64_t[2]){3 * CELLS / 2, CELLS / 2}, "foot", "floor");
    add_block(&w, (double[2]){11, 20}, (double[2]){41, 40}, (int64_t[2]){FEWER, FEWER * 2 / 3}, "sole", "head");
    return w.mesh;
}

/* ---- the scenes */

static void hold(uz_scene *s, const char *on, double ux, double uy)
{
    uz_support *support = &s->supports[s->n_supports++];
    *support = (uz_support){.u = {ux, uy, NAN}};
    snprintf(support->on, sizeof support->on, "%s", on);
}

/* A block pressed on what is below it. */
static uz_scene scene_of(int kind, const char *element)
{
    static const double X[] = {-10, 12, 25, 37, 70}, Y[] = {-0.03, -0.01, 0, -0.004, -0.05};
    uz_scene s = bench_paper_scene(3 * CELLS);
    uz_contact *c = &s.contacts[0];
    snprintf(s.box.element, sizeof s.box.element, "%s", element);
    s.kinematics = UZ_KINEMATICS_FIXED;
    if (kind == 0)
        return s;
    free(s.supports);
    s.supports = calloc(2, sizeof *s.supports);
    s.n_supports = s.n_loads = 0;
    hold(&s, "top", kind == 3 ? NAN : 0, -0.02);
    if (kind == 1 || kind == 3) {
        c->kind = UZ_OBSTACLE_ROUND;
        c->radius = 3000;
        c->point[0] = kind == 1 ? 27 : 0;
        c->point[1] = -c->radius;
    }
    if (kind == 2) {
        c->kind = UZ_OBSTACLE_POLYLINE;
        c->n_x = sizeof X / sizeof X[0];
        c->x = memcpy(malloc(sizeof X), X, sizeof X);
        c->y = memcpy(malloc(sizeof Y), Y, sizeof Y);
    }
    if (kind == 3)
        s.model = UZ_AXISYMMETRIC;
    if (kind == 4) {
        s.source = UZ_MESH_GIVEN;
        s.given = two_blocks(element);
        snprintf(s.supports[0].on, sizeof s.supports[0].on, "head");
        hold(&s, "foot", 0, 0);
        c->kind = UZ_OBSTACLE_BODY;
        snprintf(c->on, sizeof c->on, "sole");
        snprintf(c->with, sizeof c->with, "floor");
    }
    return s;
}

/* ---- what it takes */

/* Seconds of the processor; NAN: no answer, or no proof. *whole: is the interval of the quantity proved, too? */
static double seconds_of(const uz_problem *problem, bool guaranteed, double *bound, bool *whole)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    settings.guaranteed = guaranteed;
    const double start = processor_seconds();
    const uz_status status = uz_solve(&result, problem, &settings, NULL, NULL, NULL);
    double seconds = processor_seconds() - start;
    if (status != UZ_OK || result->summary.outcome != UZ_CONVERGED || (guaranteed && !result->summary.guarantee.proved))
        seconds = NAN;
    if (status == UZ_OK && guaranteed)
        *bound = result->summary.guarantee.bound;
    if (status == UZ_OK && problem->n_quantities > 0)
        *whole = result->evaluation->quantities[0].guaranteed;
    uz_result_free(result);
    return seconds;
}

bool bench_guarantee(bench_guarantee_row *row, int which)
{
    const int kind = which / N_ELEMENTS;
    uz_quantity force = {.kind = kind == 0 ? UZ_QUANTITY_DISPLACEMENT : UZ_QUANTITY_CONTACT_FORCE,
                         .name = "asked",
                         .direction = {1, 0, 0}};
    uz_problem plain = {.kind = UZ_PROBLEM_SCENE, .scene = scene_of(kind, ELEMENTS[which % N_ELEMENTS])};
    uz_problem with = plain;
    double error[RUNS], quantity[RUNS], solve[RUNS], none;
    bool ok = true;
    snprintf(force.on, sizeof force.on, "%s", kind == 0 ? "right" : "");
    with.quantities = &force;
    with.n_quantities = 1;
    for (int k = -1; ok && k < RUNS; k++) { /* the first pays for memory that the others find */
        const double alone = seconds_of(&plain, false, &none, NULL),
                     bound = seconds_of(&plain, true, &row->bound, NULL),
                     asked = seconds_of(&with, true, &none, &row->proved);
        ok = isfinite(alone + bound + asked);
        if (k < 0)
            continue;
        solve[k] = 1e3 * alone;
        error[k] = bound / alone - 1;
        quantity[k] = asked / alone - 1;
    }
    if (ok) {
        row->error = bench_summarise(error, RUNS);
        row->quantity = bench_summarise(quantity, RUNS);
        row->solve_ms = bench_summarise(solve, RUNS);
    }
    uz_scene_clear(&plain.scene);
    return ok;
}
