/* Guaranteed intervals of quantities: what any pair of displacement and stress proves of them. */
#include "bound/interval.h"
#include "bound_scenes.h"
#include "core/alloc.h"
#include "linalg/blas.h"
#include "run/guarantee.h"
#include "sanitized.h"
#include "scene_fixture.h"

enum { STRESSES = UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, QUANTITIES = 4 };

/* A block that a support presses on what is below it: flat, round, a hollow, or flat and a cylinder. */
typedef enum { FLAT, ROUND, HOLLOW, RING, OBSTACLES } obstacle;

static uz_scene block(const char *element, int cells, obstacle below)
{
    uz_scene scene = box_scene(1, 1, cells, cells);
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    scene.materials[0].young = 1000;
    add_support(&scene, "left", 0, NAN);
    add_support(&scene, "top", below == FLAT || below == RING ? 0 : NAN, -0.01);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    uz_contact *contact = &scene.contacts[0];
    scene.model = below == RING ? UZ_AXISYMMETRIC : scene.model;
    if (below == ROUND || below == HOLLOW) {
        *contact = (uz_contact){.kind = UZ_OBSTACLE_ROUND, .on = "bottom", .radius = 5, .inside = below == HOLLOW};
        contact->point[0] = below == ROUND ? 0 : 0.5;
        contact->point[1] = below == ROUND ? -5 : sqrt(25 - 0.25);
    }
    return scene;
}

static void ask(uz_quantity q[QUANTITIES])
{
    memset(q, 0, QUANTITIES * sizeof *q);
    q[0] = (uz_quantity){.kind = UZ_QUANTITY_CONTACT_FORCE, .name = "force", .on = "bottom"};
    q[1] = (uz_quantity){.kind = UZ_QUANTITY_REACTION, .name = "top", .on = "top", .direction = {0, 1}};
    q[2] = (uz_quantity){.kind = UZ_QUANTITY_DISPLACEMENT, .name = "right", .on = "right", .direction = {1, 0}};
    q[3] = (uz_quantity){.kind = UZ_QUANTITY_STRAIN_ENERGY, .name = "energy"};
}

static uz_result *answer(const uz_scene *scene, bool guaranteed)
{
    uz_quantity quantities[QUANTITIES];
    ask(quantities);
    return bound_answer(
        &(uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = *scene, .quantities = quantities, .n_quantities = QUANTITIES},
        guaranteed);
}

/* Constant stress: both spaces have the answer, and that of every quantity. */
TEST(what_is_exact_is_known)
{
    for (int k = 0; k < 4; k++) {
        uz_scene scene = block(BOUND_ELEMENTS[k], 4, FLAT);
        scene.model = UZ_PLANE_STRESS;
        scene.supports[1].u[0] = NAN;
        uz_result *result = answer(&scene, true);
        const uz_quantity_found *q = result->evaluation->quantities;
        const double exact[QUANTITIES] = {50, -50, 0.003, 0.25};
        for (int i = 0; i < QUANTITIES; i++) {
            CHECK_MSG(q[i].guaranteed, "%s: %s", q[i].name, q[i].unproved);
            CHECK_MSG(q[i].low <= exact[i] + 1e-9 && q[i].high >= exact[i] - 1e-9, "%s: %g .. %g", q[i].name, q[i].low,
                      q[i].high);
            CHECK(q[i].high - q[i].low < 1e-6 * fabs(exact[i]));
        }
        uz_result_free(result);
        uz_scene_clear(&scene);
    }
}

/* On coarse and fine grids intervals have something in common, and those of fine ones are of second order narrower. */
TEST(intervals_of_all_grids_have_something_in_common)
{
    for (int k = 0; k < 4 * OBSTACLES; k += step_of_cases()) {
        double low[QUANTITIES], high[QUANTITIES], before[QUANTITIES] = {0};
        for (int i = 0; i < QUANTITIES; i++) {
            low[i] = -INFINITY;
            high[i] = INFINITY;
        }
        for (int cells = 5; cells <= 20; cells *= 2) {
            uz_scene scene = block(BOUND_ELEMENTS[k % 4], cells, (obstacle)(k / 4));
            uz_result *result = answer(&scene, true);
            for (int i = 0; i < QUANTITIES; i++) {
                const uz_quantity_found *q = &result->evaluation->quantities[i];
                CHECK_MSG(q->guaranteed, "%s: %s", q->name, q->unproved);
                low[i] = fmax(low[i], q->low);
                high[i] = fmin(high[i], q->high);
                CHECK_MSG(low[i] <= high[i], "%d %d %s: %g > %g", k, cells, q->name, low[i], high[i]);
                CHECK_MSG(cells < 20 || q->high - q->low < 0.5 * before[i], "%d %d %s: %g after %g", k, cells, q->name,
                          q->high - q->low, before[i]);
                before[i] = cells == 5 ? q->high - q->low : before[i];
            }
            uz_result_free(result);
            uz_scene_clear(&scene);
        }
    }
}

typedef struct {
    int64_t asked, stop_at;
} patience;

static bool is_over(void *ctx)
{
    patience *p = ctx;
    return p->asked++ >= p->stop_at;
}

/* A run that is stopped while shares are tried for a quantity keeps the narrowest interval so far. */
TEST(what_a_stopped_search_found_stays)
{
    enum { STOPS = 30 };
    uz_quantity quantities[QUANTITIES];
    uz_scene scene = block("tri6", 6, ROUND);
    scene.kinematics = UZ_KINEMATICS_FIXED; /* the search comes last then */
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene, .quantities = quantities, .n_quantities = 1};
    uz_settings settings = uz_settings_default();
    uz_error err = {0};
    patience p = {.stop_at = INT64_MAX};
    const uz_hooks hooks = {.ctx = &p, .cancelled = is_over};
    uz_result *whole, *stopped;
    int kept = 0, wider = 0, without = 0;
    ask(quantities);
    settings.guaranteed = true;
    CHECK(uz_solve(&whole, &problem, &settings, NULL, &hooks, &err) == UZ_OK);
    const uz_quantity_found *best = whole->evaluation->quantities;
    CHECK_MSG(best->guaranteed, "%s", best->unproved);
    const int64_t all = p.asked;
    for (int k = 1; k <= STOPS; k++) {
        p = (patience){.stop_at = all - k};
        if (uz_solve(&stopped, &problem, &settings, NULL, &hooks, &err) != UZ_OK)
            continue;
        const uz_quantity_found *q = stopped->evaluation->quantities;
        if (q->guaranteed) {
            const double narrower = best->high - best->low, now = q->high - q->low;
            CHECK_MSG(stopped->summary.guarantee.proved, "%s", stopped->summary.guarantee.why);
            CHECK_MSG(q->low <= best->high && q->high >= best->low && now >= (1 - 1e-9) * narrower,
                      "%g .. %g, %g .. %g", q->low, q->high, best->low, best->high);
            CHECK_MSG(without == 0, "stopped later it was lost"); /* stops come earlier and earlier */
            kept++;
            wider += now > (1 + 1e-6) * narrower;
        } else {
            CHECK_STR(q->unproved, "it was stopped before it was proved");
            without++;
        }
        uz_result_free(stopped);
    }
    CHECK_MSG(kept > 0 && wider > 0 && without > 0, "%d kept, %d of them wider, %d without one", kept, wider, without);
    uz_result_free(whole);
    uz_scene_clear(&scene);
}

/* What a mesh of a body is asked and answered with. */
typedef struct {
    uz_scene scene;
    uz_problem problem;
    uz_settings settings;
    uz_result *result;
    uz_body_model model;
    uz_guaranteed g;
    uz_bound_body adjoint;
} lab;

static void open_lab(lab *l, const char *element, int cells, obstacle below)
{
    uz_error err = {0};
    memset(l, 0, sizeof *l);
    l->scene = block(element, cells, below);
    l->problem = (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = l->scene};
    l->settings = uz_settings_default();
    l->g = (uz_guaranteed){.problem = &l->problem, .settings = &l->settings};
    l->g.stop = (uz_stop){&l->g.hooks, INFINITY};
    l->result = answer(&l->scene, false);
    CHECK(uz_body_model_build(&l->model, &l->scene, UZ_BODY_OUTLINE, &err) == UZ_OK);
    CHECK(uz_bound_body_make(&l->g.body, &l->model, &l->scene, &err) == UZ_OK);
    CHECK(uz_bound_dual_problem(&l->g.qp, &l->g.dof, &l->g.body, NULL, &err) == UZ_OK);
    const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = l->g.qp};
    uz_result *dual;
    l->g.stress = zeros(l->model.mesh.n_elements * STRESSES);
    CHECK(uz_solve(&dual, &problem, &l->settings, NULL, NULL, &err) == UZ_OK);
    CHECK(uz_bound_stress(l->g.stress, &l->g.body, l->g.dof, dual->u, NULL, &err) == UZ_OK);
    uz_result_free(dual);
    CHECK(uz_bound_check(&l->g.checked, &l->g.body, &l->scene, l->g.dof, l->g.qp.K.cols, l->result->u, NULL,
                         l->g.stress, &err) == UZ_OK);
    CHECK_STR(l->g.checked.fault, "");
    double parts = 0;
    for (int64_t e = 0; e < l->model.mesh.n_elements; e++)
        parts += l->g.checked.local[e];
    CHECK(parts > 0 && (l->g.checked.lift > 0 || parts >= (1 - 1e-6) * l->g.checked.gap)); /* all is somewhere */
    CHECK(uz_measure_residual(&l->g.rho, &l->g, l->g.checked.residual, &err) == UZ_OK);
    l->g.shown = &l->g.checked;
    l->adjoint = l->g.body;
    l->adjoint.edge = malloc((size_t)l->g.body.n_edges * sizeof *l->adjoint.edge);
    l->adjoint.force = zeros(2 * l->model.mesh.n_elements);
}

static void close_lab(lab *l)
{
    free(l->adjoint.edge);
    free(l->adjoint.force);
    uz_bound_check_clear(&l->g.checked);
    free(l->g.stress);
    free(l->g.dof);
    uz_qp_clear(&l->g.qp);
    uz_bound_body_clear(&l->g.body);
    uz_body_model_clear(&l->model);
    uz_result_free(l->result);
    uz_scene_clear(&l->scene);
}

/* The adjoint body of a quantity: 0 the force, 1 the reaction, 2 the displacement. */
static void take_adjoint(lab *l, int quantity)
{
    memcpy(l->adjoint.edge, l->g.body.edge, (size_t)l->g.body.n_edges * sizeof *l->adjoint.edge);
    for (int64_t i = 0; i < l->adjoint.n_edges; i++) {
        uz_bound_edge *edge = &l->adjoint.edge[i];
        const double *a = l->model.mesh.xyz + 2 * edge->node[0], *b = l->model.mesh.xyz + 2 * edge->node[1];
        const bool top = a[1] > 0.99 && b[1] > 0.99, right = a[0] > 0.99 && b[0] > 0.99;
        for (int k = 0; k < 2; k++) {
            edge->value[k] = edge->held[k] && top && quantity == 1 ? -edge->axis[k][1] : 0;
            edge->traction[k] = k == 0 && right && quantity == 2
                                    ? 1 / (l->g.body.rings ? 2 * 3.14159265358979323846 : l->scene.thickness)
                                    : 0;
        }
    }
}

/* Displacements and stresses that have nothing to do with any quantity prove wide intervals, and none that is false. */
TEST(pairs_are_trusted_in_nothing)
{
    qp_random random = {7};
    uz_error err = {0};
    for (int k = 0; k < 4 * OBSTACLES; k += step_of_cases()) {
        uz_scene fine = block(BOUND_ELEMENTS[2 + k % 2], 16, (obstacle)(k / 4));
        uz_result *reference = answer(&fine, true);
        lab l;
        open_lab(&l, BOUND_ELEMENTS[k % 4], 5, (obstacle)(k / 4));
        const int64_t n = l.model.mesh.n_nodes, d = l.g.qp.K.cols;
        double *w = zeros(2 * n), *v = zeros(d), *stress = zeros(l.model.mesh.n_elements * STRESSES);
        for (int trial = 0; trial < 9; trial++) {
            const int quantity = trial % 3;
            const double wanted = quantity == 0, noise = pow(10, -4 * random_unit(&random)),
                         share = pow(10, 4 * random_unit(&random) - 1);
            uz_bound_interval interval;
            double own, half;
            take_adjoint(&l, quantity);
            for (int64_t a = 0; a < n; a++) { /* 1 along the normal into what is below, or minus 1 at the top */
                const double *at = l.model.mesh.xyz + 2 * a;
                w[2 * a] = at[0] > 1e-9 && (k / 4 == ROUND || k / 4 == HOLLOW || at[1] < 0.999)
                               ? noise * (random_unit(&random) - 0.5)
                               : 0;
                w[2 * a + 1] = quantity == 0 ? -wanted * (1 - at[1]) : quantity == 1 ? -at[1] : 0;
                w[2 * a + 1] += at[1] < 0.999 ? noise * (random_unit(&random) - 0.5) : 0;
            }
            for (int64_t i = 0; i < d; i++)
                v[i] = noise * (random_unit(&random) - 0.5);
            CHECK(uz_bound_stress(stress, &l.adjoint, l.g.dof, v, NULL, &err) == UZ_OK);
            const uz_bound_pair pair = {&l.adjoint, w, stress, &wanted, share};
            CHECK(uz_bound_weigh(&interval, &pair, &l.g.body, &l.scene, l.g.dof, d, l.result->u, l.g.stress,
                                 &l.g.checked, &err) == UZ_OK);
            CHECK_STR(interval.fault, "");
            CHECK(uz_measure_residual(&own, &l.g, interval.residual, &err) == UZ_OK);
            half = uz_bound_half(&interval, &l.g.checked, l.g.rho, own);
            const uz_quantity_found *q = &reference->evaluation->quantities[quantity];
            CHECK_MSG(interval.middle - half <= q->high && interval.middle + half >= q->low,
                      "%d %d %s: %g +- %g, it is %g .. %g", k, trial, q->name, interval.middle, half, q->low, q->high);
            double parts = 0;
            for (int64_t e = 0; e < l.model.mesh.n_elements; e++)
                parts += 2 * interval.local[e];
            CHECK(interval.apart > 0 && fabs(sqrt(parts) / interval.apart - 1) < 1e-6);
            free(interval.residual);
            free(interval.local);
        }
        uz_free_all(w, v, stress);
        close_lab(&l);
        uz_result_free(reference);
        uz_scene_clear(&fine);
    }
}

/* Stresses by what was kept of the elements, and loads without a matrix, are those of the elements themselves. */
TEST(what_is_kept_of_elements_changes_nothing)
{
    qp_random random = {3};
    uz_error err = {0};
    for (int k = 0; k < 4 * OBSTACLES; k += step_of_cases()) {
        lab l;
        open_lab(&l, BOUND_ELEMENTS[k % 4], 3, (obstacle)(k / 4));
        const int64_t d = l.g.qp.K.cols, n = l.model.mesh.n_elements * STRESSES;
        double *v = zeros(d), *own = zeros(n), *kept = zeros(n), most = 0;
        for (int64_t i = 0; i < d; i++)
            v[i] = random_unit(&random) - 0.5;
        for (int quantity = 0; quantity < 3; quantity++) { /* of the second one supports have values */
            int64_t *dof[2];
            uz_qp whole, load;
            take_adjoint(&l, quantity);
            l.adjoint.force[2] = quantity == 2 ? 1 : 0;
            l.adjoint.map = NULL;
            CHECK(uz_bound_stress(own, &l.adjoint, l.g.dof, v, NULL, &err) == UZ_OK);
            if (!l.g.body.map)
                CHECK(uz_bound_keep_maps(&l.g.body, NULL, &err) == UZ_OK);
            l.adjoint.map = l.g.body.map;
            l.adjoint.map_at = l.g.body.map_at;
            CHECK(l.adjoint.map != NULL);
            CHECK(uz_bound_stress(kept, &l.adjoint, l.g.dof, v, NULL, &err) == UZ_OK);
            for (int64_t i = 0; i < n; i++)
                most = fmax(most, fabs(own[i]));
            for (int64_t i = 0; i < n; i++)
                CHECK_MSG(fabs(own[i] - kept[i]) <= 1e-11 * most, "%d: %g, %g", k, own[i], kept[i]);
            CHECK(uz_bound_dual_problem(&whole, &dof[0], &l.adjoint, NULL, &err) == UZ_OK);
            CHECK(uz_bound_dual_load(&load, &dof[1], &l.adjoint, NULL, &err) == UZ_OK);
            CHECK_INT(load.K.ptr[load.K.cols], 0);
            const double size = uz_norm(d, whole.p);
            for (int64_t i = 0; i < d; i++) /* elements that are alike are made from the first of them */
                CHECK_MSG(fabs(whole.p[i] - load.p[i]) <= 1e-13 * size, "%d %d: %g, %g", k, quantity, whole.p[i],
                          load.p[i]);
            CHECK(memcmp(whole.h, load.h, (size_t)whole.N.rows * sizeof *load.h) == 0);
            uz_qp_clear(&whole);
            uz_qp_clear(&load);
            free(dof[0]);
            free(dof[1]);
        }
        uz_free_all(v, own, kept);
        close_lab(&l);
    }
}

/* A displacement that is not what it is to be at supports is told. */
TEST(a_displacement_off_its_supports_is_told)
{
    lab l;
    uz_error err = {0};
    open_lab(&l, "quad4", 4, FLAT);
    double *w = zeros(2 * l.model.mesh.n_nodes), *stress = zeros(l.model.mesh.n_elements * STRESSES), wanted = 0;
    uz_bound_interval interval;
    take_adjoint(&l, 2);
    for (int wrong = 0; wrong < 2; wrong++) {
        for (int64_t a = 0; a < l.model.mesh.n_nodes; a++)
            w[2 * a] = l.model.mesh.xyz[2 * a + 1] > 0.999 ? 0 : l.model.mesh.xyz[2 * a] + (wrong ? 1e-3 : 0);
        CHECK(uz_bound_weigh(&interval, &(uz_bound_pair){&l.adjoint, w, stress, &wanted, 1}, &l.g.body, &l.scene,
                             l.g.dof, l.g.qp.K.cols, l.result->u, l.g.stress, &l.g.checked, &err) == UZ_OK);
        CHECK((*interval.fault != '\0') == (wrong == 1));
        CHECK(isinf(uz_bound_half(&interval, &l.g.checked, 0, 0)) == (wrong == 1));
        free(interval.residual);
        free(interval.local);
    }
    free(w);
    free(stress);
    close_lab(&l);
}
