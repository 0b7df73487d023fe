/* predict.c: what a solve will take, from the pattern of its matrices: nothing is factored. */
#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "dual/form.h"
#include "certificate/envelope.h"
#include "run/cost.h"
#include "run/finite.h"
#include "factor/factor.h"
#include "run/rows.h"
#include "run/settings.h"
#include "run/setup.h"
#include "scene/box.h"
#include "uzawa.h"

#include <stdlib.h>

/* The form and what it takes, of K and N (model NULL: of matrices); the analysis of a factor where there is to be one.
 */
static uz_status predict(uz_prediction *out, const uz_csc *K, const uz_csc *N, const uz_body_model *model,
                         const uz_scene *scene, int64_t cases, const uz_settings *settings, const uz_hooks *hooks,
                         uz_error *err)
{
    const uz_brick *brick = model ? model->brick : NULL;
    const size_t limit = settings->memory_limit;
    const bool free_asked = settings->op != UZ_OPERATOR_AUTO && !uz_dual_form_of(settings->op)->can.needs_factor;
    uz_cost_plan plan = {.chosen = -1};
    uz_analysis *analysis = NULL;
    int64_t *dofs = NULL, n_b = 0;
    uz_status status = uz_dual_contact_dofs(&dofs, &n_b, N, err);
    if (status != UZ_OK)
        return status;
    const uz_cost_size size = uz_cost_size_of(K, N, model, scene, n_b, cases, settings);
    const bool no_factor = free_asked || brick || (limit > 0 && uz_cost_analysis_bytes(&size) > (double)limit);
    const uz_operator form = uz_dual_choose(N, n_b, no_factor ? UZ_OPERATOR_AUTO : settings->op);
    if (no_factor) {
        uz_cost_decide(&plan, &size, NULL, form, settings->op, limit);
    } else if (!model || !uz_cost_is_surely_free(&plan, &size, &model->mesh, form, settings->op, limit)) {
        int64_t last = uz_dual_form_of(form)->can.contact_last ? n_b : 0;
        int64_t rows = uz_cost_is_one_to_one(N, last) ? 0 : N->rows;
        status = uz_analysis_create(&analysis, K, dofs, last, rows, settings->ordering, hooks, err);
        if (status == UZ_OK) {
            uz_factor_info info = uz_analysis_describe(analysis);
            out->factor_nnz = info.nnz;
            uz_cost_decide(&plan, &size, &info, form, settings->op, limit);
        }
        uz_analysis_free(analysis);
    }
    free(dofs);
    if (status != UZ_OK)
        return status;
    const uz_cost_estimate *e = &plan.form[plan.chosen >= 0 ? plan.chosen : 0];
    out->fits = plan.chosen >= 0;
    out->op = e->op;
    out->bytes = e->bytes;
    out->seconds = uz_cost_shared(e->setup_s, uz_cost_seconds(e, cases) - e->setup_s, e->op, brick, uz_aside_threads());
    if (!uz_dual_form_of(out->op)->can.needs_factor)
        out->factor_nnz = 0;
    return UZ_OK;
}

/* Of matrices that have to be assembled, or analysed: about so many bytes for each dof, and up to so many dofs, beyond
 * which it takes minutes. */
#define ASSEMBLY_BYTES 1000.0
#define MOST_ASSEMBLED 4e6
/* Of cells, which are predicted by formulas, and of which a comparison alone would have to be analysed: in a second. */
#define MOST_ANALYSED 1e5

static bool may_be_assembled(double dofs, const uz_settings *settings)
{
    return dofs < MOST_ASSEMBLED &&
           (settings->memory_limit == 0 || dofs * ASSEMBLY_BYTES < (double)settings->memory_limit);
}

/* *out: the case whose points couple most; its loads are none where no case has any. False: none may be compared. */
static bool find_coupled(uz_scene *out, const uz_problem *problem, const uz_body_model *model)
{
    bool found = false;
    double most = 0;
    for (int64_t i = 0; i < (problem->n_cases > 0 ? problem->n_cases : 1); i++) {
        const uz_scene scene = problem->n_cases > 0 ? uz_scene_of_case(problem, i) : problem->scene;
        double coupled = 0;
        if (!uz_may_be_compared(&scene, model))
            continue;
        for (int64_t k = 0; k < scene.n_loads; k++) {
            const uz_group *group =
                scene.loads[k].has_point ? uz_mesh_group(&model->mesh, scene.loads[k].on, "", NULL) : NULL;
            const double nodes = group ? (double)uz_group_node_count(&model->mesh, group) : 0;
            coupled += nodes * nodes;
        }
        if (!found || coupled > most)
            *out = scene;
        most = fmax(most, coupled);
        found = true;
    }
    out->n_loads = most > 0 ? out->n_loads : 0;
    return found;
}

/* What large deformation takes: the largest of its contact problems, about as that of small deformation but for what
 * forces at points couple, and of its certificate. */
static uz_status predict_finite(uz_prediction *out, const uz_body_model *model, const uz_csc *N,
                                const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                                uz_error *err)
{
    const bool finite = problem->scene.kinematics == UZ_KINEMATICS_FINITE;
    uz_scene scene = problem->scene;
    uz_body_model large = *model;
    uz_prediction of_large = *out;
    uz_status status = UZ_OK;
    if ((model->brick && ((double)model->d > MOST_ANALYSED || !may_be_assembled((double)model->d, settings))) ||
        !find_coupled(&scene, problem, model))
        return UZ_OK;
    /* and the model does not yet, or has no matrix */
    const bool couples = model->brick || (scene.n_loads > 0 && (!finite || problem->n_cases > 0));
    scene.kinematics = UZ_KINEMATICS_FINITE;
    if (couples) {
        large.K = large.K_fixed = (uz_csc){0};
        large.brick = NULL;
        status = uz_build_pattern(&large, &scene, err);
        if (status == UZ_OK)
            status = predict(&of_large, &large.K, N, &large, &scene, problem->n_cases, settings, hooks, err);
    }
    if (status == UZ_OK) {
        const double certificate = uz_envelope_predict(&large.K) + uz_finite_certificate_bytes(&large, &large.K);
        of_large.bytes = uz_finite_bytes(&large, NULL, uz_has_pairs(&scene)) + fmax(of_large.bytes, certificate);
        out->compared_bytes = finite ? 0 : out->bytes + of_large.bytes;
        *out = finite ? of_large : *out;
    }
    if (couples) {
        uz_csc_clear(&large.K);
        uz_csc_clear(&large.K_fixed);
    }
    return status;
}

/* N of a scene with the rows that its solve begins with; *all: how many there are. */
static uz_status find_rows(uz_csc *N, int64_t *all, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_candidates rows = {0};
    double *h = uz_alloc(model->m, sizeof *h);
    uz_status status = h ? uz_body_model_gaps(h, model, scene, err)
                         : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)model->m);
    *all = model->m;
    if (status == UZ_OK)
        status = uz_choose_rows(&rows, h, model->m, &model->info, scene, NULL, err);
    if (status == UZ_OK)
        status = rows.in ? uz_candidates_reduce(N, &model->N, &rows, err) : uz_csc_copy(N, &model->N, err);
    uz_candidates_clear(&rows);
    free(h);
    return status;
}

static uz_status refuse_large(const uz_problem *problem, const uz_settings *settings, uz_error *err)
{
    const uz_scene *scene = &problem->scene;
    const bool is_box = scene->source == UZ_MESH_BOX;
    double dofs = (double)problem->qp.K.cols;
    if (problem->kind == UZ_PROBLEM_SCENE) {
        if (uz_setup_extent(problem, settings) == UZ_BODY_CELLS)
            return UZ_OK;
        dofs = uz_scene_dim(scene) * (is_box ? uz_box_node_count(&scene->box) : (double)scene->given.n_nodes);
    }
    return may_be_assembled(dofs, settings)
               ? UZ_OK
               : uz_fail(err, UZ_ERR_LIMIT, "", "%.0f unknowns are too many for a prediction", dofs);
}

uz_status uz_predict(uz_prediction *out, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                     uz_error *err)
{
    const bool scene = problem->kind == UZ_PROBLEM_SCENE;
    *out = (uz_prediction){.d = 0};
    uz_status status = uz_check_settings(settings, err);
    if (status == UZ_OK)
        status = refuse_large(problem, settings, err);
    if (status == UZ_OK && scene) {
        uz_body_model model;
        uz_csc N = {0};
        int64_t m = 0;
        uz_error_reset(err);
        const uz_body_extent extent = uz_setup_extent(problem, settings);
        status = uz_body_model_build(&model, &problem->scene, extent == UZ_BODY_CELLS ? UZ_BODY_COUNTED : extent, err);
        if (status == UZ_OK)
            status = find_rows(&N, &m, &model, &problem->scene, err);
        if (status == UZ_OK) {
            out->d = model.d;
            out->m = m;
            status = predict(out, &model.K, &N, &model, &problem->scene, problem->n_cases, settings, hooks, err);
        }
        if (status == UZ_OK)
            status = predict_finite(out, &model, &N, problem, settings, hooks, err);
        uz_csc_clear(&N);
        uz_body_model_clear(&model);
    } else if (status == UZ_OK) {
        out->d = problem->qp.K.cols;
        out->m = problem->qp.N.rows;
        status = predict(out, &problem->qp.K, &problem->qp.N, NULL, NULL, problem->n_cases, settings, hooks, err);
    }
    return status;
}
