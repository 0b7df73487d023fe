/* candidates.c: bodies whose whole surface may touch: solved with the rows that start near an obstacle, and with all.
 */
#include "bench/bench.h"
#include "core/alloc.h"
#include "core/clock.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 3, ITEMS = 8 };

static void make_lists(uz_scene *s)
{
    s->materials = uz_alloc_zero(ITEMS, sizeof *s->materials);
    s->supports = uz_alloc_zero(ITEMS, sizeof *s->supports);
    s->loads = uz_alloc_zero(ITEMS, sizeof *s->loads);
    s->contacts = uz_alloc_zero(ITEMS, sizeof *s->contacts);
    if (!s->materials || !s->supports || !s->loads || !s->contacts)
        abort();
    s->materials[s->n_materials++] = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3};
}

/* n x n x n bricks of eight nodes with a group "top"; the mesh gives them "boundary". */
static void cube_mesh(uz_given_mesh *mesh, int64_t n)
{
    const int64_t side = n + 1, nodes = side * side * side, elements = n * n * n;
    uz_given_group *top = uz_alloc_zero(1, sizeof *top);
    *mesh = (uz_given_mesh){.dim = 3, .n_nodes = nodes, .n_elements = elements, .groups = top, .n_groups = 1};
    mesh->xyz = uz_alloc(3 * nodes, sizeof *mesh->xyz);
    mesh->kind = uz_alloc(elements, sizeof *mesh->kind);
    mesh->first = uz_alloc(elements + 1, sizeof *mesh->first);
    mesh->node = uz_alloc(8 * elements, sizeof *mesh->node);
    if (!top || !mesh->xyz || !mesh->kind || !mesh->first || !mesh->node || !(top->node = uz_alloc(side * side, 8)))
        abort();
    memcpy(top->name, "top", 4);
    for (int64_t i = 0; i < nodes; i++)
        for (int64_t axis = 0, k = i; axis < 3; axis++, k /= side)
            mesh->xyz[3 * i + axis] = (double)(k % side) / (double)n;
    for (int64_t i = 0; i < side * side; i++)
        top->node[top->n_nodes++] = nodes - side * side + i;
    for (int64_t e = 0; e <= elements; e++)
        mesh->first[e] = 8 * e;
    for (int64_t e = 0; e < elements; e++) {
        const int64_t corner = e % n + side * (e / n % n) + side * side * (e / n / n);
        const int64_t ring[] = {0, 1, 1 + side, side};
        mesh->kind[e] = UZ_HEX8;
        for (int a = 0; a < 8; a++)
            mesh->node[8 * e + a] = corner + ring[a % 4] + side * side * (a / 4);
    }
}

/* Pushed down on a sphere that it just touches; every face is a candidate. */
static uz_scene cube_on_sphere(int64_t n)
{
    uz_scene s = {.model = UZ_SOLID, .thickness = 1, .source = UZ_MESH_GIVEN};
    make_lists(&s);
    cube_mesh(&s.given, n);
    s.supports[s.n_supports++] = (uz_support){.on = "top", .u = {0, 0, -0.005}};
    s.contacts[s.n_contacts++] =
        (uz_contact){.on = "boundary", .kind = UZ_OBSTACLE_ROUND, .point = {0.5, 0.5, -1}, .radius = 1};
    return s;
}

/* The paper's body between four walls: on its floor, and a tenth of its length from the others. */
static uz_scene body_in_box(int64_t nx)
{
    uz_scene s = bench_paper_scene(nx);
    const double wall[][4] = {{-6, 0, 1, 0}, {66, 0, -1, 0}, {0, 26, 0, -1}};
    static const char *const sides[] = {"left", "right", "top"};
    s.contacts = realloc(s.contacts, 4 * sizeof *s.contacts);
    if (!s.contacts)
        abort();
    for (int k = 0; k < 3; k++) {
        uz_contact *c = &s.contacts[s.n_contacts++];
        *c = (uz_contact){.point = {wall[k][0], wall[k][1]}, .normal = {wall[k][2], wall[k][3]}};
        snprintf(c->on, sizeof c->on, "%s", sides[k]);
    }
    return s;
}

static bool solve(bench_value *seconds, bench_candidates *out, const uz_problem *problem, double *bytes)
{
    double samples[RUNS];
    for (int k = 0; k < RUNS; k++) {
        uz_settings settings = uz_settings_default();
        uz_result *result = NULL;
        uz_error err = {0};
        const double start = uz_seconds();
        const bool ok =
            uz_solve(&result, problem, &settings, NULL, NULL, &err) == UZ_OK && result->summary.outcome == UZ_CONVERGED;
        samples[k] = uz_seconds() - start;
        if (ok) {
            *bytes = result->summary.cost.actual_bytes;
            out->given = result->summary.m;
            out->kept = result->summary.kept;
            out->rounds = result->summary.rounds;
        }
        uz_result_free(result);
        if (!ok)
            return false;
    }
    *seconds = bench_summarise(samples, RUNS);
    return true;
}

bool bench_candidates_left_out(bench_candidates *out, int64_t n, bool solid)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = solid ? cube_on_sphere(n) : body_in_box(n)};
    problem.scene.all_candidates = true;
    bool ok = solve(&out->all_seconds, out, &problem, &out->all_bytes);
    problem.scene.all_candidates = false;
    ok = ok && solve(&out->seconds, out, &problem, &out->bytes);
    uz_problem_clear(&problem);
    return ok;
}
