/* problems.c: what work is measured on. */
#include "figures/figures.h"
#include "obstacle.h"
#include "qp_fixture.h"
#include "scene_fixture.h"
#include "theory.h"

static uz_problem scene_problem(uz_scene scene)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = scene};
}

/* The paper's body as a bar of 60 x 20 x 20, held and pulled at its ends, pressed from above. */
static uz_scene block_scene(void)
{
    const double size[3] = {60, 20, 20};
    const int64_t cells[3] = {36, 12, 12};
    uz_scene s = body_scene(UZ_SOLID, "hex8", size, cells);
    body_hold(&s, "left", 0, 0, 0);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -0.05, 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", 0.5, 0, 0);
    body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 1, 0});
    return s;
}

static bool made(uz_status status, const uz_error *err)
{
    if (status != UZ_OK)
        fprintf(stderr, "%s: %s\n", err->where, err->message);
    return status == UZ_OK;
}

/* The obstacle and the load of OBSTCLAE, n x n, as a membrane that is held at its edges: CUTE's own matrix counts the
 * differences across an edge by half, as no discretization does, and its obstacle rises above the edges in a corner,
 * where finer and finer meshes would tear the membrane. */
static bool obstacle_make(uz_problem *out, int64_t n)
{
    uz_error err = {0};
    *out = (uz_problem){.kind = UZ_PROBLEM_MATRICES};
    if (!made(obstacle_qp(&out->qp, n, &err), &err))
        return false;
    for (int64_t j = 0; j < n * n; j++)
        out->qp.K.val[out->qp.K.ptr[j]] = 4.0;
    for (int64_t j = 0; j < n * n; j++)
        out->qp.h[n * n + j] += 0.05;
    return true;
}

static bool file_make(uz_problem *out, const char **why)
{
    const char *cases = test_cases_dir();
    char folder[128];
    *out = (uz_problem){.kind = UZ_PROBLEM_MATRICES};
    if (!cases) {
        *why = "../shared/cases is not there";
        return false;
    }
    snprintf(folder, sizeof folder, "%s/qp/SEMI_bcsstk16", cases);
    return read_case(&out->qp, folder);
}

static uz_result *obstacle_solve(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = 1e-10;
    if (!made(uz_solve(&result, problem, &settings, NULL, NULL, &err), &err))
        exit(1);
    return result;
}

/* u (n x n, zero around) at point (x, y) of the grid with half the cells, its corners being (0, 0): linear on
 * triangles whose long sides rise to the right. */
static double obstacle_between(const double *u, int64_t n, int64_t x, int64_t y)
{
    double sum = 0;
    for (int end = 0; end < 2; end++) {
        const int64_t i = (x + (end ? 1 : 0)) / 2, j = (y + (end ? 1 : 0)) / 2;
        if (i > 0 && j > 0 && i <= n && j <= n)
            sum += 0.5 * u[(j - 1) * n + i - 1];
    }
    return sum;
}

/* These matrices are those of linear triangles, whose error halves with the cell. So of the distance to the answer on
 * half the cells, which is the side of a right triangle with the errors of both (Strang and Fix, "An analysis of the
 * finite element method", 1973, 1.6), the error is 2 / sqrt(3). */
static double mesh_error_of_obstacle(int64_t n)
{
    const int64_t fine = 2 * n + 1;
    uz_problem coarse, half;
    if (!obstacle_make(&coarse, n) || !obstacle_make(&half, fine))
        exit(1);
    uz_result *u = obstacle_solve(&coarse), *v = obstacle_solve(&half);
    double *e = calloc((size_t)(fine * fine), sizeof *e);
    if (!e)
        abort();
    for (int64_t k = 0; k < fine * fine; k++)
        e[k] = v->u[k] - obstacle_between(u->u, n, k % fine + 1, k / fine + 1);
    const double error = 2 / sqrt(3.0) * reference_norm(&half.qp.K, e) / u->summary.certificate.energy_norm;
    free(e);
    uz_result_free(u);
    uz_result_free(v);
    uz_problem_clear(&coarse);
    uz_problem_clear(&half);
    return error;
}

/* The estimate of Zienkiewicz and Zhu, as the service gives it. */
static double mesh_error_of_scene(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    double error = NAN;
    settings.balanced = true;
    if (made(uz_solve(&result, problem, &settings, NULL, NULL, &err), &err))
        error = result->summary.discretization_error;
    uz_result_free(result);
    return error;
}

static bool finish_scene(figure_problem *out)
{
    uz_body_model model;
    uz_error err = {0};
    if (!made(uz_scene_to_qp(&out->qp, NULL, &out->problem.scene, &err), &err) ||
        !made(uz_body_model_build(&model, &out->problem.scene, UZ_BODY_OUTLINE, &err), &err))
        return false;
    out->places = model.mesh.n_nodes * model.mesh.dim;
    out->dof = calloc((size_t)out->places + 1, sizeof *out->dof);
    if (out->dof)
        memcpy(out->dof, model.dof, (size_t)out->places * sizeof *out->dof);
    uz_body_model_clear(&model);
    out->mesh_error = mesh_error_of_scene(&out->problem);
    out->mesh_how = "estimated from the recovered stress (Zienkiewicz and Zhu)";
    return out->dof != NULL;
}

/* The line contact of tests/theory.h pressed by a displacement of its top, that which the load there gives it, so that
 * its supports hold it: a body that only the obstacle holds has fewer methods. */
static uz_problem hertz_problem(void)
{
    uz_problem problem = scene_problem(theory_hertz_scene(UZ_PLANE_STRAIN, "quad4", 32, 1.2, NULL));
    uz_scene *s = &problem.scene;
    uz_result *result = body_solve(s, 1e-6);
    double down = 0, count = 0;
    for (int64_t a = 0; a < result->n_nodes; a++)
        if (result->mesh.xyz[2 * a + 1] > THEORY_BLOCK * (1 - 1e-9)) {
            down += result->u[2 * a + 1];
            count++;
        }
    body_hold(s, "top", NAN, down / count, NAN);
    s->n_loads = 0;
    uz_result_free(result);
    return problem;
}

static const struct {
    const char *name, *title;
    int64_t nx; /* the paper's body */
} rows[FIGURE_PROBLEMS] = {
    {"paper_30", "the paper's body, 30 x 10 quad4", 30},
    {"paper_120", "the paper's body, 120 x 40 quad4", 120},
    {"paper_300", "the paper's body, 300 x 100 quad4", 300},
    {"paper_600", "the paper's body, 600 x 200 quad4", 600},
    {"hertz", "Hertz's line contact, graded quad4, 32 cells in the half width", 0},
    {"block", "a block of 36 x 12 x 12 hex8 on a plane", 0},
    {"obstacle", "a membrane over an obstacle (after CUTE's OBSTCLAE, 98 x 98)", 0},
    {"bcsstk16", "a real stiffness matrix with bounds (Harwell-Boeing BCSSTK16)", 0},
};

const char *figure_problem_name(int which)
{
    return rows[which].name;
}

bool figure_problem_make(figure_problem *out, int which, const char **why)
{
    bool ok = true;
    *out = (figure_problem){.name = rows[which].name, .title = rows[which].title, .mesh_error = NAN};
    out->mesh_how = "";
    out->whole = rows[which].nx < 600;
    *why = "it could not be made";
    if (rows[which].nx > 0)
        out->problem = scene_problem(paper_scene(rows[which].nx, rows[which].nx / 3));
    else if (strcmp(out->name, "hertz") == 0)
        out->problem = hertz_problem();
    else if (strcmp(out->name, "block") == 0)
        out->problem = scene_problem(block_scene());
    else
        ok = strcmp(out->name, "obstacle") == 0 ? obstacle_make(&out->problem, 98) : file_make(&out->problem, why);
    if (ok && out->problem.kind == UZ_PROBLEM_SCENE)
        return finish_scene(out);
    out->qp = out->problem.qp;
    if (ok && strcmp(out->name, "obstacle") == 0) {
        out->mesh_error = mesh_error_of_obstacle(98);
        out->mesh_how = "from the answer on a grid of half the cells";
    }
    return ok;
}

void figure_problem_clear(figure_problem *problem)
{
    if (problem->problem.kind == UZ_PROBLEM_SCENE)
        uz_qp_clear(&problem->qp);
    uz_problem_clear(&problem->problem);
    free(problem->dof);
}

double *figure_displacements(const figure_problem *problem, const uz_result *result)
{
    const int64_t d = problem->qp.K.cols;
    double *u = calloc((size_t)d + 1, sizeof *u);
    if (!u)
        abort();
    for (int64_t k = 0; problem->dof && k < problem->places; k++)
        if (problem->dof[k] >= 0)
            u[problem->dof[k]] = result->u[k];
    if (!problem->dof)
        memcpy(u, result->u, (size_t)d * sizeof *u);
    return u;
}

uz_problem figure_paper_matrices(int64_t nx)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES};
    uz_scene scene = paper_scene(nx, nx / 3);
    uz_error err = {0};
    if (!made(uz_scene_to_qp(&problem.qp, NULL, &scene, &err), &err))
        exit(1);
    uz_scene_clear(&scene);
    return problem;
}
