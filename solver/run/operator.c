/* operator.c: which form of the operator a setup gets, and the making of it: a factor, or a multigrid in its place. */
#include "run/setup.h"
#include "brick/brick.h"
#include "dual/form.h"
#include "element/element_type.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "group/group.h"
#include "linalg/linalg.h"

#include <math.h>
#include <stdlib.h>

/* The modes of a rigid group's own motion, in units of the others: rotations by one over the body's longest side. */
static void take_rigid(uz_modes *modes, const uz_body_model *model, const uz_rigid_group *group)
{
    const int dim = model->mesh.dim;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0.0, r[3];
    for (int64_t i = 0; i < model->mesh.n_nodes * dim; i++) {
        low[i % dim] = fmin(low[i % dim], model->info.xyz[i]);
        high[i % dim] = fmax(high[i % dim], model->info.xyz[i]);
    }
    for (int axis = 0; axis < dim; axis++)
        size = fmax(size, high[axis] - low[axis]);
    for (int axis = 0; axis < 3; axis++)
        r[axis] = axis < dim ? (group->point[axis] - 0.5 * (low[axis] + high[axis])) / size : 0.0;
    for (int c = 0; c < 2 * dim; c++) {
        const int64_t node = group->anchor[c / dim], dof = node < 0 ? UZ_NO_DOF : model->dof[node * dim + c % dim];
        const int axis = c % dim;
        float *value = modes->value + dof * modes->count;
        for (int k = 0; k < modes->count && dof >= 0; k++) {
            const int turn = dim == 2 ? 2 : k - 3, a = (turn + 1) % 3, b = (turn + 2) % 3;
            if (k < dim)
                value[k] = c < dim && axis == k ? 1.0F : 0.0F;
            else if (c < dim)
                value[k] = (float)(axis == a ? -r[b] : axis == b ? r[a] : 0.0);
            else
                value[k] = dim == 2 || axis == turn ? (float)(group->size / size) : 0.0F;
        }
    }
}

/* The near-null space: rigid-body modes where the mesh is known. At a node whose dofs are along its normal and tangents
 * they are turned there from the axes: numbered for this are all dofs of a rotated node, also those that are held. */
static uz_status find_modes(uz_modes *modes, const uz_setup *setup, const uz_csc *K, uz_error *err)
{
    const uz_body_model *model = &setup->model;
    const int dim = model->mesh.dim;
    const int64_t total = model->mesh.n_nodes * dim, n_rotated = model->info.n_rotated;
    if (!setup->is_scene)
        return uz_modes_of_matrix(modes, K, err);
    uz_status status = uz_modes_of_body(modes, model->info.xyz, model->dof, model->mesh.n_nodes, dim, model->d, err);
    for (int64_t g = 0; status == UZ_OK && g < model->n_rigid; g++)
        take_rigid(modes, model, &model->rigid[g]);
    if (status != UZ_OK || n_rotated == 0)
        return status;
    uz_modes axes = {0};
    int64_t *number = uz_alloc(total, sizeof *number);
    for (int64_t i = 0; number && i < total; i++)
        number[i] = -1;
    for (int64_t t = 0; number && t < n_rotated; t++)
        for (int c = 0; c < dim; c++)
            number[model->info.rotated_node[t] * dim + c] = t * dim + c;
    status = number ? uz_modes_of_body(&axes, model->info.xyz, number, model->mesh.n_nodes, dim, n_rotated * dim, err)
                    : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the modes of %lld dofs", (long long)total);
    free(number);
    for (int64_t t = 0; status == UZ_OK && t < n_rotated; t++) {
        const int64_t *dof = model->dof + model->info.rotated_node[t] * dim;
        const double *Q = model->info.frame + t * dim * dim;
        for (int c = 0; c < dim; c++)
            for (int k = 0; k < modes->count && dof[c] >= 0; k++) {
                double turned = 0.0;
                for (int axis = 0; axis < dim; axis++)
                    turned += Q[c * dim + axis] * (double)axes.value[(t * dim + axis) * modes->count + k];
                modes->value[dof[c] * modes->count + k] = (float)turned;
            }
    }
    uz_modes_clear(status == UZ_OK ? &axes : modes);
    return status;
}

/* The ends of the edges that nodes are the middles of, as uz_modes has them; *out NULL where no element has middles. */
static uz_status find_ends(int32_t **out, const uz_mesh *mesh, uz_error *err)
{
    int32_t *ends = NULL;
    *out = NULL;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        if (type->nodes == type->corners)
            continue;
        if (!ends && !(ends = uz_alloc(2 * mesh->n_nodes, sizeof *ends)))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the edges of %lld nodes", (long long)mesh->n_nodes);
        for (int64_t i = 0; !*out && i < 2 * mesh->n_nodes; i++)
            ends[i] = -1;
        *out = ends;
        for (int m = type->corners; m < type->nodes; m++)
            for (int side = 0; side < 2; side++)
                ends[2 * node[m] + side] = (int32_t)node[type->edge[m - type->corners][side]];
    }
    /* what is a corner of any element is no middle: beside a divided element the middle of an edge is one, too */
    for (int64_t e = 0; *out && e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        for (int k = 0; k < type->corners; k++)
            ends[2 * mesh->node[mesh->first[e] + k]] = ends[2 * mesh->node[mesh->first[e] + k] + 1] = -1;
    }
    return UZ_OK;
}

/* What the operator is made of. */
typedef struct {
    uz_setup *setup;
    const uz_csc *K, *N;
    uz_cost_size size;
    const uz_settings *settings;
    const uz_hooks *hooks;
    uz_operator direct; /* the form that a factor is analysed for */
    uz_operator asked;  /* the settings', until conjugate gradients have failed where a factor may fit */
    bool dear, fails;   /* they have: they would take many times as long; there is no multigrid for them */
} making;

static uz_status make_dual(making *m, uz_operator op, uz_error *err)
{
    uz_setup *setup = m->setup;
    const uz_dual_source source = {
        .op = op, .N = m->N, .lasts = setup->is_scene, .factor = setup->factor, .amg = setup->amg};
    double start = uz_seconds();
    uz_status status = uz_dual_create(&setup->dual, &source, m->hooks, err);
    setup->condense_s = uz_seconds() - start;
    return status;
}

static bool is_chosen(const uz_cost_plan *plan, uz_operator form)
{
    return plan->chosen >= 0 && plan->form[plan->chosen].op == form;
}

/* Between analysis and factorization: is this still the form to take? An error that says nothing means no. */
static uz_status accept_factor(void *ctx, const uz_factor_info *predicted, uz_error *err)
{
    making *m = ctx;
    uz_cost_plan *plan = &m->setup->plan;
    (void)err;
    uz_cost_decide(plan, &m->size, predicted, m->direct, m->asked, m->settings->memory_limit);
    return is_chosen(plan, m->direct) ? UZ_OK : UZ_ERR_LIMIT;
}

/* Below this conjugate gradients take ten times the iterations that the plan has counted on. */
#define LAMBDA_LEAST 1e-3
#define DEAR         10.0

/* A multigrid that a group of processes holds. */
static uz_status spread(making *m, uz_error *err)
{
    const double start = uz_seconds();
    uz_modes modes = {0};
    char why[256] = "this program has no group of processes to solve with";
    const bool may = m->hooks && m->hooks->group;
    uz_process_group *group = may ? m->hooks->group(m->hooks->ctx, why, sizeof why) : NULL;
    uz_multigrid *mg = NULL;
    uz_amg_trials *trials = NULL;
    double rounding = 0.0;
    if (!group)
        return uz_fail(err, UZ_ERR_UNSUPPORTED, "operator", "operator distributed: %s", why);
    uz_group_expect(group, m->K);
    uz_status status = find_modes(&modes, m->setup, m->K, err);
    if (status == UZ_OK)
        status = uz_group_multigrid(&mg, group, m->K, &modes, err);
    uz_modes_clear(&modes);
    if (status == UZ_OK) {
        status = uz_amg_rounding(&rounding, m->K, err); /* while the group is at work */
        if (status == UZ_OK && !(trials = uz_amg_draw(m->K)))
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to check solves of %lld dofs", (long long)m->K->cols);
        const uz_status awaited = uz_group_await(mg, status == UZ_OK ? err : NULL);
        status = status == UZ_OK ? awaited : status;
        if (status != UZ_OK)
            uz_multigrid_free(mg);
    }
    const double made = uz_seconds();
    if (status == UZ_OK)
        status = m->setup->is_scene ? uz_amg_of_definite(&m->setup->amg, mg, err)
                                    : uz_amg_of(&m->setup->amg, mg, m->K, 0, m->hooks, err);
    if (status == UZ_OK) {
        m->setup->amg->info.create_s = made - start;
        status = uz_amg_probe(m->setup->amg, trials, rounding, m->hooks, err);
    }
    uz_amg_trials_free(trials);
    return status;
}

/* A multigrid that is here. */
static uz_status aggregate(making *m, uz_modes *modes, size_t budget, int patience, uz_error *err)
{
    int32_t *ends = NULL;
    const uz_status status = m->setup->is_scene ? find_ends(&ends, &m->setup->model.mesh, err) : UZ_OK;
    modes->ends = ends;
    if (status != UZ_OK)
        uz_modes_clear(modes);
    const uz_status made =
        status == UZ_OK ? uz_amg_create(&m->setup->amg, m->K, modes, budget, patience, m->hooks, err) : status;
    free(ends);
    return made;
}

/* A multigrid in the factor's place, and what it may take so that the whole stays within the limit. *regretted: nothing
 * was made, as the plan took matrix_free for its price only, and the matrix is one of those that it is not cheap for,
 * or that tell more to a factorization. */
static uz_status precondition(making *m, bool *regretted, uz_error *err)
{
    uz_setup *setup = m->setup;
    const uz_cost_plan *plan = &setup->plan;
    const bool choice = m->asked == UZ_OPERATOR_AUTO && (setup->model.brick || (plan->count > 1 && plan->form[0].fits));
    double limit = (double)m->settings->memory_limit, budget = 0.0;
    uz_modes modes;
    if (m->settings->memory_limit > 0)
        budget = uz_amg_predict_bytes(m->size.d, m->size.k_entries, m->size.modes) +
                 fmax(0.0, limit - plan->form[plan->chosen].bytes);
    uz_status status = UZ_OK;
    uz_factor_expect_none((size_t)plan->form[plan->chosen].bytes);
    if (setup->model.brick) {
        uz_multigrid *mg = NULL;
        status = uz_brick_multigrid(&mg, setup->model.brick, (size_t)budget, err);
        if (status == UZ_OK)
            status = uz_amg_of(&setup->amg, mg, m->K, 0, m->hooks, err);
    } else if (plan->form[plan->chosen].op == UZ_OPERATOR_DISTRIBUTED) {
        status = spread(m, err);
    } else {
        status = find_modes(&modes, setup, m->K, err);
        if (status == UZ_OK)
            status = aggregate(m, &modes, (size_t)budget, choice ? uz_cost_patience(plan, &m->size) : 0, err);
    }
    if (status == UZ_OK)
        status = make_dual(m, plan->form[plan->chosen].op, err);
    *regretted =
        choice && (status == UZ_OK ? setup->amg->info.lambda < LAMBDA_LEAST
                                   : status == UZ_ERR_NOT_SPD || (status == UZ_ERR_LIMIT && !setup->model.brick));
    if (!*regretted)
        return status;
    m->dear = true;
    m->fails = status != UZ_OK;
    uz_dual_free(setup->dual);
    uz_amg_free(setup->amg);
    setup->dual = NULL;
    setup->amg = NULL;
    uz_error_reset(err);
    return setup->model.brick ? uz_body_model_assemble(&setup->model, err) : UZ_OK;
}

/* Conjugate gradients have been regretted, and the form that was to take their place does not fit: the cheapest of the
 * others that do, with a factor or, where they are only dear, without one. */
static bool ask_for_another(making *m)
{
    const uz_cost_plan *plan = &m->setup->plan;
    const uz_operator refused = m->asked;
    double least = INFINITY;
    for (int k = 0; m->dear && k < plan->count; k++) {
        const uz_cost_estimate *form = &plan->form[k];
        const bool by_factor = uz_dual_form_of(form->op)->can.needs_factor;
        const double loads_s = uz_cost_seconds(form, m->size.cases) - form->setup_s,
                     seconds = form->setup_s + (by_factor ? 1.0 : DEAR) * loads_s;
        if (!form->fits || form->op == refused || (!by_factor && m->fails) || !(seconds < least))
            continue;
        least = seconds;
        m->asked = form->op;
    }
    return isfinite(least);
}

static void decide_without_factor(making *m)
{
    uz_cost_plan *plan = &m->setup->plan;
    uz_cost_decide(plan, &m->size, NULL, m->direct, m->settings->op, m->settings->memory_limit);
    for (int k = 0; m->dear && k < plan->count; k++) {
        plan->form[k].case_s *= DEAR;
        plan->form[k].next_s *= DEAR;
    }
}

enum { TRIES = 6 };

uz_status uz_setup_share_operator(uz_setup *setup, const uz_problem *problem, const uz_settings *settings,
                                  const uz_hooks *hooks, uz_error *err)
{
    const uz_setup *base = setup->base;
    making m = {.setup = setup, .K = uz_setup_K(setup, problem), .N = uz_setup_N(setup, problem), .hooks = hooks};
    int64_t *dofs = NULL, n_b = 0;
    uz_status status = uz_dual_contact_dofs(&dofs, &n_b, m.N, err);
    setup->factor = base->factor;
    setup->amg = base->amg;
    setup->plan = base->plan;
    uz_factor_info there;
    if (status == UZ_OK && setup->factor)
        status = uz_factor_describe_for(&there, setup->factor, dofs, n_b,
                                        uz_cost_is_one_to_one(m.N, n_b) ? 0 : m.N->rows, err);
    free(dofs);
    if (status != UZ_OK)
        return status;
    if (!setup->factor)
        return make_dual(&m, base->dual->can->op, err);
    m.size = uz_cost_size_of(m.K, m.N, setup->is_scene ? &setup->model : NULL, &problem->scene, n_b, 0, settings);
    const uz_operator direct = uz_dual_choose(m.N, n_b, settings->op);
    uz_cost_decide(&setup->plan, &m.size, &there, direct, settings->op, settings->memory_limit);
    const int chosen = setup->plan.chosen;
    if (chosen < 0)
        return uz_cost_refuse(&setup->plan, settings->op, settings->memory_limit, err);
    /* the factor is there: where only a form without one seems to fit, the one that needs least beside it does */
    const uz_operator op = setup->plan.form[chosen].op;
    return make_dual(&m, uz_dual_form_of(op)->can.needs_factor ? op : UZ_OPERATOR_FACTORED, err);
}

/* The form that was asked for, or the one that the plan chooses once the analysis of a factor has shown its size. */
uz_status uz_setup_make_operator(uz_setup *setup, const uz_problem *problem, uz_matrix_key *key,
                                 const uz_settings *settings, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    uz_cost_plan *plan = &setup->plan;
    const size_t limit = settings->memory_limit;
    making m = {.setup = setup,
                .K = uz_setup_K(setup, problem),
                .N = uz_setup_N(setup, problem),
                .settings = settings,
                .hooks = hooks,
                .asked = settings->op};
    int64_t *dofs = NULL, n_b = 0;
    uz_status status = uz_dual_contact_dofs(&dofs, &n_b, m.N, err);
    if (status != UZ_OK)
        return status;
    m.size = uz_cost_size_of(m.K, m.N, setup->is_scene ? &setup->model : NULL, &problem->scene, n_b, problem->n_cases,
                             settings);
    const bool free_asked = settings->op != UZ_OPERATOR_AUTO && !uz_dual_form_of(settings->op)->can.needs_factor;
    bool no_factor = free_asked || setup->model.brick || (limit > 0 && uz_cost_analysis_bytes(&m.size) > (double)limit);
    m.direct = uz_dual_choose(m.N, n_b, free_asked ? UZ_OPERATOR_AUTO : settings->op);
    const bool surely_free = !no_factor && setup->is_scene &&
                             uz_cost_is_surely_free(plan, &m.size, &setup->model.mesh, m.direct, m.asked, limit);
    bool done = false;
    for (int k = 0; status == UZ_OK && !done && k < TRIES; k++) {
        if (no_factor) {
            decide_without_factor(&m);
        } else if (k > 0 || !surely_free) { /* else nobody needs the order of a factor */
            plan->chosen = -1;
            int64_t n_dofs = uz_dual_form_of(m.direct)->can.contact_last ? n_b : 0;
            int64_t rows = uz_cost_is_one_to_one(m.N, n_dofs) ? 0 : m.N->rows;
            if (cache && !key->values[0]) /* of a scene; it reads all of K */
                status = uz_matrix_digest(key, cache, m.K, err);
            if (status == UZ_OK)
                status = uz_shared_factor_get(&setup->shared, cache, key, m.K, dofs, n_dofs, rows, settings->ordering,
                                              settings->step, accept_factor, &m, hooks, err);
            done = status != UZ_ERR_LIMIT || is_chosen(plan, m.direct);
            if (!done)
                status = UZ_OK; /* the plan speaks for another form now, or for none */
            setup->factor = setup->shared.factor;
            if (done && status == UZ_OK)
                status = make_dual(&m, m.direct, err);
        }
        if (status != UZ_OK || done)
            break;
        if (plan->chosen < 0) {
            if (!ask_for_another(&m))
                break;
            no_factor = !uz_dual_form_of(m.asked)->can.needs_factor;
            m.direct = no_factor ? m.direct : m.asked;
        } else if (!uz_dual_form_of(plan->form[plan->chosen].op)->can.needs_factor) {
            bool regretted;
            status = precondition(&m, &regretted, err);
            done = !regretted;
            m.asked = regretted ? m.direct : m.asked;
            if (regretted && m.size.by_cells > 0.0) { /* K is there now */
                m.size = uz_cost_size_of(m.K, m.N, &setup->model, &problem->scene, n_b, problem->n_cases, settings);
                no_factor = limit > 0 && uz_cost_analysis_bytes(&m.size) > (double)limit;
            }
        } else {
            m.direct = plan->form[plan->chosen].op;
        }
    }
    if (status == UZ_OK && !done)
        status = uz_cost_refuse(plan, settings->op, limit, err);
    free(dofs);
    if (status != UZ_OK)
        return status;
    const size_t form = setup->amg ? setup->amg->info.bytes : uz_factor_describe(setup->factor).bytes;
    setup->bytes = sizeof *setup + (setup->shared.item ? 0 : form) + setup->dual->bytes;
    if (setup->is_scene)
        setup->bytes += uz_body_model_bytes(&setup->model);
    if (setup->rows.in)
        setup->bytes += (size_t)setup->rows.m + uz_csc_bytes(&setup->N_in);
    setup->reused.ordering = setup->shared.analysis_reused;
    setup->reused.factor = setup->shared.factor_reused;
    return UZ_OK;
}
