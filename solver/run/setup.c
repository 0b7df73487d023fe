#include "run/setup.h"

#include "certificate/bound.h"
#include "certificate/distrust.h"
#include "certificate/residual.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/digest.h"
#include "core/error.h"
#include "core/lock.h"
#include "dual/form.h"
#include "linalg/linalg.h"
#include "run/rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cubes of this many dofs are solved by their cells in the time that a factor of them takes, and larger ones in less.
 */
#define MANY_DOFS 2e4
/* The same of plane bodies, whose factors are cheaper, and where it pays even with what a factor spares later loads:
 * for so many of them, of bodies that are no longer, and where the grids do as well as of other materials. Of few cells
 * across a factor is a narrow band: with 5 by 8000 it takes half the time of the grids, and a tenth for later loads,
 * with 20 by 1000 more time, but for ten loads less. */
#define MANY_PLANE_DOFS 4e4
#define ACROSS          16
#define ACROSS_OF_LOADS 64
#define FEW_LOADS       10
#define LONG_PLANE      20.0
#define SOFT_PLANE      0.45

static bool is_along_axis(const double n[3])
{
    return (n[0] != 0.0) + (n[1] != 0.0) + (n[2] != 0.0) == 1;
}

/* A box of equal hex8, or in the plane quad4, whose supports and obstacles are along the axes, as far as the scene
 * itself tells. */
static bool has_cells(const uz_scene *scene)
{
    const uz_box *box = &scene->box;
    const char *element = scene->model == UZ_SOLID ? "hex8" : "quad4";
    bool has = scene->source == UZ_MESH_BOX && scene->model != UZ_AXISYMMETRIC && scene->n_materials == 1 &&
               !scene->place && !box->automatic && strncmp(box->element, element, sizeof box->element) == 0;
    for (int c = 0; has && c < box->dim; c++)
        has = box->grading[c] == 0.0 || box->grading[c] == 1.0;
    for (int64_t i = 0; has && i < scene->n_supports; i++)
        has = scene->supports[i].kind == UZ_SUPPORT_COMPONENTS ||
              (scene->supports[i].kind == UZ_SUPPORT_NORMAL && is_along_axis(scene->supports[i].normal));
    for (int64_t k = 0; has && k < scene->n_contacts; k++)
        has = scene->contacts[k].kind == UZ_OBSTACLE_PLANE && is_along_axis(scene->contacts[k].normal);
    return has;
}

/* Are cells the better choice? */
static bool are_worth_it(const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    const uz_box *box = &scene->box;
    double dofs = box->dim;
    for (int c = 0; c < box->dim; c++)
        dofs *= (double)box->cells[c] + 1.0;
    if (box->dim == 3)
        return dofs >= MANY_DOFS;
    const double longer = fmax(box->size[0], box->size[1]), shorter = fmin(box->size[0], box->size[1]);
    const int64_t across = box->cells[0] < box->cells[1] ? box->cells[0] : box->cells[1];
    return dofs >= MANY_PLANE_DOFS && across >= (problem->n_cases > 1 ? ACROSS_OF_LOADS : ACROSS) &&
           problem->n_cases <= FEW_LOADS && longer <= LONG_PLANE * shorter &&
           (scene->model == UZ_PLANE_STRESS || scene->materials[0].poisson <= SOFT_PLANE);
}

uz_body_extent uz_setup_extent(const uz_problem *problem, const uz_settings *settings)
{
    const uz_scene *scene = &problem->scene;
    const bool free_asked = settings->op == UZ_OPERATOR_MATRIX_FREE, /* a group has rows of K */
        by_auto = settings->op == UZ_OPERATOR_AUTO && settings->method == UZ_METHOD_AUTO &&
                  settings->stopping == UZ_STOP_CERTIFIED;
    if (!(free_asked || by_auto) || problem->kind != UZ_PROBLEM_SCENE || problem->n_quantities > 0 ||
        scene->kinematics == UZ_KINEMATICS_MOVING || !has_cells(scene))
        return UZ_BODY_SUPPORTED;
    return free_asked || are_worth_it(problem) ? UZ_BODY_CELLS : UZ_BODY_SUPPORTED;
}

uz_status uz_setup_digest(uz_setup_key *key, const uz_problem *problem, const uz_candidates *wanted,
                          const uz_settings *settings, uz_cache *cache, uz_error *err)
{
    memset(key, 0, sizeof *key);
    uz_digest *state = uz_digest_new();
    if (!state)
        return uz_no_memory(err, "a digest");
    const int choices[] = {(int)problem->kind, (int)settings->op, (int)settings->ordering,
                           (int)uz_setup_extent(problem, settings)};
    uz_status status = UZ_OK;
    uz_digest_add(state, choices, sizeof choices);
    uz_digest_add(state, &settings->memory_limit, sizeof settings->memory_limit);
    if (problem->kind == UZ_PROBLEM_SCENE) {
        unsigned char *body = NULL;
        size_t len = 0;
        status = uz_scene_body_key(&body, &len, &problem->scene, err);
        if (status == UZ_OK)
            uz_digest_add(state, body, len);
        free(body);
        /* Where the choice of rows begins: initial gaps follow from the places of planes and the values of supports,
         * which the key of the model leaves out. */
        const uz_scene *scene = &problem->scene;
        const bool omits = uz_may_omit_rows(problem);
        for (int64_t k = 0; omits && k < scene->n_contacts; k++)
            uz_digest_add(state, scene->contacts[k].point, sizeof scene->contacts[k].point);
        for (int64_t i = 0; omits && i < scene->n_supports; i++) {
            uz_digest_add(state, scene->supports[i].u, sizeof scene->supports[i].u);
            uz_digest_add(state, &scene->supports[i].value, sizeof scene->supports[i].value);
            uz_digest_add(state, scene->supports[i].about, sizeof scene->supports[i].about);
            uz_digest_add(state, scene->supports[i].turn, sizeof scene->supports[i].turn);
        }
        if (omits && wanted && wanted->in)
            uz_digest_add(state, wanted->in, (size_t)wanted->m);
    } else {
        uz_matrix_key N = {.values = ""}; /* without rows it may be a zeroed struct */
        status = uz_matrix_digest(&key->K, cache, &problem->qp.K, err);
        if (status == UZ_OK && problem->qp.N.ptr)
            status = uz_matrix_digest(&N, cache, &problem->qp.N, err);
        uz_digest_add(state, key->K.values, sizeof key->K.values);
        uz_digest_add(state, N.values, sizeof N.values);
    }
    if (!uz_digest_end(state, key->digest) && status == UZ_OK)
        status = uz_fail(err, UZ_ERR_INTERNAL, "", "hashing failed");
    return status;
}

const uz_csc *uz_setup_K(const uz_setup *setup, const uz_problem *problem)
{
    return setup->is_scene ? &setup->model.K : &problem->qp.K;
}

const uz_csc *uz_setup_N(const uz_setup *setup, const uz_problem *problem)
{
    return setup->rows.in ? &setup->N_in : uz_setup_all_rows(setup, problem);
}

const uz_csc *uz_setup_all_rows(const uz_setup *setup, const uz_problem *problem)
{
    if (setup->no_rows.ptr)
        return &setup->no_rows;
    return setup->is_scene ? &setup->model.N : &problem->qp.N;
}

/* The fewest bytes that a box of this many cells can be solved with: told before the mesh is made. */
static uz_status refuse_large_box(const uz_problem *problem, const uz_settings *settings, uz_error *err)
{
    const uz_box *box = &problem->scene.box;
    double nodes = 1.0, entries = 1.0;
    if (settings->memory_limit == 0 || problem->kind != UZ_PROBLEM_SCENE)
        return UZ_OK;
    for (int axis = 0; axis < box->dim; axis++) {
        nodes *= (double)box->cells[axis] + 1.0;
        entries *= 3.0; /* a node and its neighbours in a row */
    }
    const bool by_cells = uz_setup_extent(problem, settings) == UZ_BODY_CELLS;
    double dofs = nodes * box->dim, least = dofs * (by_cells ? 250.0 : 8.0 * (entries * box->dim) + 200.0);
    if (least <= (double)settings->memory_limit)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_LIMIT, "/mesh",
                   "%.0f nodes take at least %.3g bytes, and the limit is %zu: use a coarser "
                   "mesh or raise the limit",
                   nodes, least, settings->memory_limit);
}

/* The rows to solve with. The initial gaps of a scene follow from its supports; of its loads there may be several
 * lists. */
static uz_status choose_rows(uz_setup *setup, const uz_scene *scene, const uz_candidates *wanted, uz_error *err)
{
    const uz_body_model *model = &setup->model;
    double *p = model->place ? uz_alloc(model->d, sizeof *p) : NULL, *h = uz_alloc(model->m, sizeof *h);
    uz_error refusal = {0};
    uz_status status = UZ_ERR_MEMORY;
    if (h && (p || !model->place))
        status = uz_body_model_gaps(h, model, scene, &refusal);
    if (status == UZ_OK && model->place) { /* the gaps there */
        uz_restrict_nodal(p, model, model->place);
        uz_csc_gaxpy(h, &model->N, -1, p);
    }
    if (status == UZ_OK)
        status = uz_choose_rows(&setup->rows, h, model->m, &model->info, scene, wanted, err);
    else if (status == UZ_ERR_MEMORY)
        status = uz_fail(err, status, "", "no memory for the gaps of %lld contacts", (long long)model->m);
    else
        status = UZ_OK; /* the load will tell what is wrong with it */
    uz_free_all(p, h);
    if (status == UZ_OK && setup->rows.in)
        status = uz_candidates_reduce(&setup->N_in, &model->N, &setup->rows, err);
    return status;
}

uz_status uz_setup_create(uz_setup **out, const uz_problem *problem, const uz_candidates *wanted,
                          const uz_settings *settings, uz_error *err)
{
    const double start = uz_seconds();
    uz_status status = UZ_OK;
    *out = NULL;
    uz_setup *setup = uz_alloc_zero(1, sizeof *setup);
    if (!setup)
        return uz_no_memory(err, "a body");
    pthread_mutex_init(&setup->mutex, NULL);
    setup->doubt = NAN;
    setup->is_scene = problem->kind == UZ_PROBLEM_SCENE;
    if (setup->is_scene)
        status = refuse_large_box(problem, settings, err);
    if (status == UZ_OK && setup->is_scene)
        status = uz_body_model_build(&setup->model, &problem->scene, uz_setup_extent(problem, settings), err);
    else if (status == UZ_OK && problem->qp.N.rows == 0) /* N may come as a zeroed struct */
        status = uz_csc_init(&setup->no_rows, 0, problem->qp.K.cols, 0, err);
    setup->law = setup->is_scene ? setup->model.law : &uz_law_frictionless;
    if (status == UZ_OK && !settings->step) /* which has no certificate, as a rule: else it counts them itself */
        setup->terms = uz_most_terms(uz_setup_K(setup, problem), setup->model.brick, uz_setup_all_rows(setup, problem));
    setup->assemble_s = uz_seconds() - start;
    if (status == UZ_OK && setup->is_scene && uz_may_omit_rows(problem))
        status = choose_rows(setup, &problem->scene, wanted, err);
    if (status == UZ_OK)
        *out = setup;
    else
        uz_setup_free(setup);
    return status;
}

uz_status uz_setup_move(uz_setup **out, uz_setup *base, const uz_problem *problem, const uz_candidates *wanted,
                        const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    const double start = uz_seconds();
    *out = NULL;
    uz_setup *setup = uz_alloc_zero(1, sizeof *setup);
    if (!setup)
        return uz_no_memory(err, "a body");
    pthread_mutex_init(&setup->mutex, NULL);
    setup->base = base;
    setup->is_scene = true;
    pthread_mutex_lock(&base->mutex); /* what is known of K */
    setup->doubt = base->doubt;
    pthread_mutex_unlock(&base->mutex);
    uz_status status = uz_body_model_move(&setup->model, &base->model, &problem->scene, err);
    setup->law = setup->is_scene ? setup->model.law : &uz_law_frictionless;
    if (status == UZ_OK)
        setup->terms = uz_most_terms(uz_setup_K(setup, problem), setup->model.brick, uz_setup_all_rows(setup, problem));
    setup->assemble_s = uz_seconds() - start;
    if (status == UZ_OK && uz_may_omit_rows(problem))
        status = choose_rows(setup, &problem->scene, wanted, err);
    if (status == UZ_OK)
        status = uz_setup_share_operator(setup, problem, settings, hooks, err);
    if (status != UZ_OK) {
        uz_setup_free(setup);
        return status;
    }
    setup->bytes = sizeof *setup + base->bytes + setup->dual->bytes + uz_body_model_bytes(&setup->model);
    setup->bytes += base->shared.item ? uz_factor_describe(base->factor).bytes : 0;
    if (setup->rows.in)
        setup->bytes += (size_t)setup->rows.m + uz_csc_bytes(&setup->N_in);
    setup->reused = (uz_reuse){.assembly = true, .ordering = true, .factor = true};
    *out = setup;
    return UZ_OK;
}

/* What a half solve needs. */
typedef struct {
    const uz_factor *factor;
    int64_t d;
    double *room; /* d x UZ_LANES */
} half_solver;

/* S^-1 = L^-1 P, S^-T = P'L'^-1. */
static uz_status half_solve(void *ctx, double *X, int64_t columns, bool transposed, uz_error *err)
{
    const half_solver *s = ctx;
    const int64_t d = s->d, *position = uz_factor_describe(s->factor).position;
    uz_status status = UZ_OK;
    for (int64_t first = 0; status == UZ_OK && first < columns; first += UZ_LANES) {
        const int64_t lanes = columns - first < UZ_LANES ? columns - first : UZ_LANES;
        double *x = X + first * d;
        for (int64_t l = 0; l < lanes; l++)
            for (int64_t i = 0; i < d; i++)
                s->room[(transposed ? i : position[i]) * UZ_LANES + l] = x[i + l * d];
        status = uz_factor_solve_lanes(s->factor, s->room, 1, !transposed, err);
        for (int64_t l = 0; l < lanes; l++)
            for (int64_t i = 0; i < d; i++)
                x[i + l * d] = s->room[(transposed ? position[i] : i) * UZ_LANES + l];
    }
    return status;
}

uz_status uz_setup_doubt(uz_setup *setup, double *doubt, const uz_csc *K, const uz_stop *stop, uz_error *err)
{
    uz_status status = UZ_OK;
    *doubt = INFINITY;
    if (!uz_lock_while(&setup->mutex, stop))
        return UZ_OK; /* who asks finds that it has to stop */
    if (isnan(setup->doubt)) {
        half_solver solver = {setup->factor, K->cols, uz_alloc_zero(K->cols * UZ_LANES, sizeof(double))};
        double norm = NAN;
        status = solver.room ? uz_distrust(&norm, K, half_solve, &solver, stop, err)
                             : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)K->cols);
        if (status == UZ_OK)
            setup->doubt = norm;
        free(solver.room);
    }
    if (status == UZ_OK)
        *doubt = setup->doubt;
    pthread_mutex_unlock(&setup->mutex);
    return status == UZ_ERR_CANCELLED ? UZ_OK : status;
}

double uz_setup_inverse_bound(uz_setup *setup, const uz_csc *K)
{
    const double bound = setup->factor ? uz_factor_describe(setup->factor).inverse_bound : INFINITY;
    double doubt = uz_bound_doubt(bound, K->cols);
    uz_error ignored = {0};
    if (isfinite(bound) && doubt > UZ_BOUND_HARMLESS && uz_setup_doubt(setup, &doubt, K, NULL, &ignored) != UZ_OK)
        doubt = INFINITY;
    return doubt < 1.0 ? bound / (1.0 - doubt) : INFINITY;
}

void uz_setup_free(uz_setup *setup)
{
    if (!setup)
        return;
    pthread_mutex_destroy(&setup->mutex);
    uz_dual_free(setup->dual);
    uz_shared_factor_release(&setup->shared);
    if (!setup->base)
        uz_amg_free(setup->amg);
    if (setup->is_scene)
        uz_body_model_clear(&setup->model);
    uz_csc_clear(&setup->no_rows);
    uz_csc_clear(&setup->N_in);
    uz_candidates_clear(&setup->rows);
    free(setup);
}
