/* grid_sequence.c: grid after grid until the total error is what was asked for.
 *
 *     grid -> solve, started from the contact pressure of the best grid so far
 *          -> estimated discretization error and certified algebraic error: the total error
 *          -> the next grid: of a box whose cells are chosen another number of cells, from the rate at which the error
 *             was seen to fall; of a mesh that is refined its elements where the error is, bisected
 *
 * Of finite kinematics the next grid starts from the displacement of the best one so far. Where a load is not borne on
 * a grid that is its answer, as a finer one bears no more; where elements turn inside out, or an obstacle stands
 * between nodes, the next grid is to tell.
 *
 * A few elements have an estimate that may be worth nothing: the averages that it compares the stress with are hardly
 * other than the stress. On so few the sequence does not end before all of them were divided, and the energy that this
 * released left the estimate standing.
 *
 * The algebraic part is asked for a tenth of the total, so that it takes half a percent of it and the estimate, which
 * needs an answer to look at, is one of the mesh alone. */
#include "run/solve.h"

#include "assembly/assembly.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "finite/mesh_error.h"
#include "methods/milestones.h"
#include "post/balance.h"
#include "post/trend.h"
#include "run/finite.h"
#include "run/marking.h"
#include "run/problem.h"
#include "run/results.h"
#include "run/settings.h"
#include "run/transfer.h"
#include "scene/grids.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ALGEBRAIC_SHARE 0.1

/* A quantity without an interval, as on grids that do not see a contact, is this far off, relative, and what is under a
 * part of the load alone further still: the next grid is finer. */
#define UNKNOWN 2.0
/* Where a finer grid does not bear so much more of the load, others are not looked at. */
#define MORE_LOAD 0.01

/* Beyond these unknowns a solve takes minutes, and estimates of where it ends are worth little. */
#define MOST_DOFS 4e6

/* An estimate of fewer elements is looked at on a finer grid before the mesh is called fine enough. Quadratic ones have
 * a slope of their own to compare, and as many nodes as four times as many linear ones in the plane. */
enum { FEW_LINEAR = 64, FEW_QUADRATIC = 16 };

/* What is released when all elements are divided is less than the square of the error. At singular stress estimates
 * are two thirds of the error and it halves: so many squares of the estimate are released by one that is worth having.
 */
#define MOST_RELEASED 2.0

/* What grids released is held against an estimate that fell to this part of its square by then; of two grids that are
 * hardly different it is noise. An estimate that hides more than it does beside corners (docs/theory.md) is one of
 * another answer, as where the coarser grid had not seen a contact. */
#define FALLEN      0.75
#define MOST_HIDDEN 2.25
/* Of large deformation: a finer grid whose estimated square is so many times that of the best one has gone to another
 * equilibrium, or to one without a limit. */
#define ANOTHER 4

/* Why no further grid was tried. */
typedef enum {
    STOP_NOT,
    STOP_MET,
    STOP_GRID, /* a finer grid is not allowed, or could not be solved: `reason` */
    STOP_TIME,
    STOP_CANCELLED,
    STOP_ALGEBRA /* the equations of the grid could not be solved well enough: a finer one would be no better */
} stop_kind;

/* One grid. */
typedef struct {
    uz_box box;
    int64_t n;          /* cells chosen: which grid of the family */
    int64_t n_bisected; /* refined: how much of the search's list */
    double dofs;        /* displacements of its nodes */
} grid;

/* The answers of one grid. */
typedef struct {
    uz_result **results; /* n_cases; NULL: none */
    grid on;
    double error; /* the largest total error of all cases that have an answer */
    bool doubted; /* refined: that is an estimate of few elements, and no finer grid has confirmed it */
    int number;   /* of the grid, from 0 */
} answers;

/* What one grid has of numbers that nothing bounds, of one case. */
typedef struct {
    double max_pressure, contact_area;
    double peak_size, mean_size; /* of sides at the peak, and of all that touch; 0: nothing does */
    uz_trend_point von_mises, used;
    double potential;    /* energy of the answer */
    double missed, left; /* half the squares of what the mesh and the equations are off by, by estimate */
    double moved;        /* the same of the distance from the answer of the coarser grid `from` */
    int from;            /* -1: none */
    double low, high;    /* of the quantity that is asked for, if one is */
} seen;

/* The search for the grid. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    uz_cache *cache;
    const uz_hooks *hooks;
    int64_t n_cases;
    double requested, deadline;
    bool refines;
    uz_grids grids; /* cells chosen */
    int order;
    int64_t *bisected, n_bisected; /* refined: of the finest grid so far */
    answers best;
    uz_tried tried[UZ_GRID_LEVELS];
    double tried_dofs;
    uz_grid_sequence sequence;
    uz_timings *spent; /* n_cases: of the answers that are dropped */
    seen *seen;        /* n_cases x UZ_GRID_LEVELS */
    stop_kind stop;
    char reason[160];
} search;

static uz_status check(const search *g, const uz_state *const *starts, uz_error *err);
static uz_status try_grid(search *g, grid on, uz_error *err);
static void choose_next(grid *next, search *g);
static bool choose_between(grid *next, const search *g);
static void offer(search *g);
static uz_status publish(search *g, uz_error *err);

uz_status uz_solve_grid_sequence(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                                 const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    const uz_scene *scene = &problem->scene;
    const bool chosen = scene->source == UZ_MESH_BOX && scene->box.automatic;
    search g = {.problem = problem,
                .settings = settings,
                .cache = cache,
                .hooks = hooks,
                .n_cases = problem->n_cases > 0 ? problem->n_cases : 1,
                .requested = settings->quantity_error > 0.0 ? settings->quantity_error
                             : settings->balanced           ? UZ_BALANCED_TOTAL_ERROR
                                                            : uz_requested_error(settings),
                .deadline = uz_seconds() + settings->time_limit_s,
                .refines = scene->refine,
                .grids = {.most_dofs = MOST_DOFS},
                .sequence = {.dim = uz_scene_dim(scene), .refined = scene->refine}};
    grid next = {.box = scene->box};
    uz_status status = check(&g, starts, err);
    if (status == UZ_OK && chosen) {
        g.grids = uz_grids_of_scene(scene, MOST_DOFS);
        g.grids.order *= settings->quantity_error > 0.0 ? 2 : 1; /* of a product of two errors in the energy norm */
        next = (grid){.box = uz_grid(&g.grids, g.grids.first), .n = g.grids.first};
    }
    g.spent = uz_alloc_zero(g.n_cases, sizeof *g.spent);
    g.seen = uz_alloc(g.n_cases, UZ_GRID_LEVELS * sizeof *g.seen);
    if (status == UZ_OK && (!g.spent || !g.seen))
        status = uz_fail(err, UZ_ERR_MEMORY, "/cases", "no memory for the results of %lld cases", (long long)g.n_cases);
    while (status == UZ_OK && g.stop == STOP_NOT) {
        status = try_grid(&g, next, err);
        if (status == UZ_OK && g.stop == STOP_NOT)
            choose_next(&next, &g);
    }
    if (status == UZ_OK && choose_between(&next, &g)) {
        status = try_grid(&g, next, err);
        g.stop = STOP_MET; /* whatever became of it */
    }
    if (status == UZ_OK)
        status = publish(&g, err);
    uz_free_all(g.spent, g.seen, g.bisected);
    for (int64_t i = 0; g.best.results && i < g.n_cases; i++)
        results[i] = g.best.results[i];
    free(g.best.results);
    return status;
}

static uz_status check(const search *g, const uz_state *const *starts, uz_error *err)
{
    uz_status status = uz_check_settings(g->settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(g->problem, err);
    if (status == UZ_OK && uz_is_finite(g->problem))
        status = uz_check_finite_settings(g->settings, err);
    if (status == UZ_OK && g->settings->stopping == UZ_STOP_PAPER)
        status = uz_fail(err, UZ_ERR_ARGUMENT, "", "the paper's rule bounds no error that a mesh could be chosen by");
    for (int64_t i = 0; status == UZ_OK && starts && i < g->n_cases; i++)
        if (starts[i])
            status =
                uz_fail(err, UZ_ERR_ARGUMENT, "start", "a start belongs to a mesh, and this one is not chosen yet");
    return status;
}

/* ---- how far it is, and where to go */

/* Where on the way from the first grid's error to the one asked for. */
static double share_done(const search *g, double error)
{
    const double whole = g->sequence.count > 0 ? log(g->tried[0].error / g->requested) : 0.0;
    return whole > 0.0 && error > 0.0 ? fmin(1.0, fmax(0.0, log(g->tried[0].error / error) / whole)) : 0.0;
}

/* What the next grid is to the rate of convergence (uz_tried). */
static double number_of(const search *g, const grid *on)
{
    return g->refines ? pow(on->dofs, 1.0 / g->sequence.dim) : (double)on->n;
}

/* Factoring takes d^1.5 operations in the plane and d^2 in space (George and Liu, Computer Solution of Large Sparse
 * Positive Definite Systems, 1981, chapter 8). */
static bool has_time(const search *g, double dofs)
{
    const int last = g->sequence.count - 1;
    const double expected =
        g->sequence.level[last].seconds * pow(dofs / g->tried_dofs, g->sequence.dim == 3 ? 2.0 : 1.5);
    return uz_seconds() + expected <= g->deadline;
}

/* Seconds until the request is met, if grids go on as the last three went: the error by its observed power of the
 * unknowns, the seconds of a grid by theirs, each grid as much larger as the last ones were. NaN: they do not tell. */
static double seconds_left(const search *g, double dofs)
{
    const int last = g->sequence.count - 1;
    if (last < 2)
        return NAN;
    const uz_grid_level *now = &g->sequence.level[last], *before = &g->sequence.level[last - 2];
    const double growth = (double)now->d / (double)before->d;
    const double rate = log(before->error / now->error) / log(growth);
    const double price = fmin(3.0, fmax(0.0, log(now->seconds / before->seconds) / log(growth)));
    if (!(growth > 1.1) || !(rate > 0.1) || !(now->seconds > 0.0) || isnan(price))
        return NAN;
    const double enough = pow(now->error / g->requested, 1.0 / rate); /* in unknowns of the last grid */
    double times = dofs / g->tried_dofs, sum = 0.0;
    for (int k = last + 1; k < UZ_GRID_LEVELS; k++, times *= sqrt(growth)) {
        sum += now->seconds * pow(times, price);
        if (times >= enough)
            return fmin(sum, fmax(0.0, g->deadline - uz_seconds()));
    }
    return NAN; /* by then no more grids are tried */
}

/* The next grid to try, or a reason to stop. */
static void choose_next(grid *next, search *g)
{
    const int count = g->sequence.count;
    bool in_vain = false;
    if (g->refines) {
        /* at best the error falls with the order of the elements, as it does once all of the mesh is fine enough: from
         * the best grid, as a bound may be wide for what a few elements add to it */
        double wanted = INFINITY;
        for (int k = 0; k < count; k++)
            wanted = fmin(wanted, (double)g->sequence.level[k].d *
                                      pow(g->tried[k].error / g->requested, (double)g->sequence.dim / g->order));
        in_vain = next->n_bisected == g->n_bisected;
        next->n_bisected = g->n_bisected;
        g->stop = count == UZ_GRID_LEVELS || in_vain || (count > 2 && wanted > 2 * MOST_DOFS) ? STOP_GRID : STOP_NOT;
    } else {
        const int64_t n = count < UZ_GRID_LEVELS ? uz_next_grid(&g->grids, g->tried, count, g->requested) : 0;
        if (n > 0)
            *next = (grid){.box = uz_grid(&g->grids, n), .n = n, .dofs = uz_grid_dofs(&g->grids, n)};
        g->stop = n > 0 ? STOP_NOT : STOP_GRID;
    }
    if (g->stop == STOP_GRID && count == UZ_GRID_LEVELS)
        snprintf(g->reason, sizeof g->reason, "%d grids were tried", count);
    else if (in_vain)
        snprintf(g->reason, sizeof g->reason, "nothing that bisecting elements makes smaller is left of the error");
    else if (g->stop == STOP_GRID)
        snprintf(g->reason, sizeof g->reason, "a grid that meets it is expected to have more than %.0f unknowns",
                 g->grids.most_dofs);
    else if (uz_cancelled(g->hooks))
        g->stop = STOP_CANCELLED;
    else if (!g->refines && !has_time(g, next->dofs))
        g->stop = STOP_TIME;
}

/* One grid between the last that failed and the first that met the request, where that is expected to pay. */
static bool choose_between(grid *next, const search *g)
{
    const int count = g->sequence.count;
    if (g->refines || g->stop != STOP_MET || count < 2 || count >= UZ_GRID_LEVELS)
        return false;
    const int64_t n = uz_grid_between(&g->grids, &g->tried[count - 2], &g->tried[count - 1], g->requested);
    *next = (grid){.box = uz_grid(&g->grids, n), .n = n, .dofs = uz_grid_dofs(&g->grids, n)};
    return n > 0 && !uz_cancelled(g->hooks) && has_time(g, next->dofs);
}

/* What the equations of a grid may leave. */
static double equations_asked(const search *g)
{
    return g->settings->quantity_error > 0.0 ? uz_settings_default().relative_error : ALGEBRAIC_SHARE * g->requested;
}

static bool is_large(const uz_summary *s)
{
    return s->geometry.kind == UZ_KINEMATICS_FINITE;
}

static seen seen_of(const search *g, const uz_summary *s)
{
    const uz_evaluation *e = s->evaluation;
    const double mesh = fmin(1.0, s->discretization_error * s->discretization_error), left = equations_asked(g);
    const bool asked = e->asked > 0.0 && e->n_quantities > 0, part = is_large(s) && s->finite.load < 1;
    return (seen){.max_pressure = s->max_pressure,
                  .contact_area = e->contact_area,
                  .peak_size = e->peak_size,
                  .mean_size = s->active > 0 ? pow(e->contact_area / (double)s->active, 1.0 / (s->dim - 1)) : 0.0,
                  .von_mises = {e->von_mises.size, e->von_mises.value},
                  .used = {e->used.size, e->used.value},
                  .potential = part ? (double)NAN : e->potential_energy,
                  .missed = part ? (double)NAN : e->strain_energy * mesh / (1.0 - mesh),
                  .left = e->strain_energy * left * left,
                  .from = -1,
                  .low = asked ? e->quantities[0].low : -INFINITY,
                  .high = asked ? e->quantities[0].high : (double)INFINITY};
}

/* ---- what answers are worth */

/* Is there an answer, and one of the scene as it is asked for? */
static bool is_answered(const uz_summary *s)
{
    return !uz_has_no_answer(s) && s->outcome != UZ_UNSTABLE;
}

/* Is the answer under a part of the load, or an obstacle in it that a finer grid may keep out, or pressed from afar? */
static bool wants_finer(const uz_summary *s)
{
    return uz_is_pressed_apart(s) || (is_large(s) && (s->finite.load < 1 || s->outcome == UZ_MESH_LIMIT));
}

static double error_of(const search *g, const uz_summary *s)
{
    const double error = uz_asked_error(s);
    if (is_large(s) && s->finite.load < 1)
        return UNKNOWN + 1 - s->finite.load;
    return g->settings->quantity_error > 0.0 ? fmin(error, UNKNOWN) : error;
}

/* What the equations are off by. */
static double left_of(const uz_summary *s)
{
    return is_large(s) ? s->finite.residual : s->certificate.relative_error;
}

/* Does the next grid, of all elements divided, say that the estimate of this one was too small? */
static bool refuted(const seen *of, const seen *finer)
{
    return of->potential - finer->potential > MOST_RELEASED * of->missed + of->left || finer->low > of->high ||
           finer->high < of->low;
}

/* How much of the square of an error the estimate hides. Answers are projections on what their grids can do, each of
 * which the next one can: the squares of their distances sum up, and are what the square of the error fell by. now: of
 * the last grid. 1 where nothing is hidden, or nothing is known. */
static double hidden_by(const seen *all, const seen *now)
{
    double fell = 0;
    const seen *at = now;
    while (at->from >= 0 && !(now->missed <= FALLEN * at->missed)) {
        fell += at->moved;
        at = all + at->from;
    }
    const double hidden = now->missed <= FALLEN * at->missed ? fell / (at->missed - now->missed) : 1;
    return hidden > 1 ? fmin(hidden, MOST_HIDDEN) : 1;
}

/* Is what a grid can do part of what the next one can? Not of elements whose strain is not that of the displacement. */
static bool is_nested(const uz_body_model *body)
{
    bool nested = true;
    for (int64_t e = 0; e < body->mesh.n_elements && nested; e++)
        nested = uz_element_formulation(body, e) == UZ_FORMULATION_STANDARD;
    return nested;
}

/* Half the square of the distance of an answer from that of a coarser grid. */
static uz_status measure_move(double *moved, const uz_result *here, const uz_result *coarse, const uz_body_model *body,
                              uz_error *err)
{
    const int64_t n = body->mesh.n_nodes * body->mesh.dim;
    double *from = uz_carry_nodal(&body->mesh, coarse->u, coarse->n_nodes, body->mesh.dim), *z = uz_alloc(n, sizeof *z);
    uz_status status =
        from && z ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to compare the answers of two grids");
    for (int64_t i = 0; i < n && status == UZ_OK; i++)
        z[i] = here->u[i] - from[i];
    if (status == UZ_OK)
        status = is_large(&here->summary) ? uz_finite_distance(moved, body, here->free_strain, from, here->u, err)
                                          : uz_strain_energy(moved, body, z, false, err);
    uz_free_all(from, z);
    return status;
}

/* No less than what this is half the square of. */
static void raise_error(uz_result *result, double square)
{
    uz_summary *s = &result->summary;
    const double least = sqrt(square / (s->evaluation->strain_energy + square));
    if (s->guarantee.proved || !(least > s->discretization_error))
        return;
    s->discretization_error = least;
    uz_doubt_coarse_mesh(result->evaluation, least);
}

/* The estimate of a case becomes what the distances from coarser grids make of it, and that of the best of these is no
 * less than its distance. */
static uz_status take_hidden(uz_result *result, search *g, int64_t i, const uz_body_model *body, uz_error *err)
{
    seen *all = &g->seen[i * UZ_GRID_LEVELS], *now = &all[g->sequence.count];
    if (!g->refines || !g->best.results || isnan(now->missed) || isnan(all[g->best.number].missed) || !is_nested(body))
        return UZ_OK;
    uz_result *best = g->best.results[i];
    const uz_status status = measure_move(&now->moved, result, best, body, err);
    if (status != UZ_OK)
        return status;
    now->from = g->best.number;
    raise_error(result, hidden_by(all, now) * now->missed);
    raise_error(best, now->moved);
    g->best.error = fmax(g->best.error, error_of(g, &best->summary));
    return UZ_OK;
}

/* Has the answer of a case left those of coarser grids? */
static bool is_another(const seen *all, const seen *now, const uz_summary *s)
{
    return is_large(s) && now->from >= 0 && now->missed > ANOTHER * all[now->from].missed;
}

/* Whether an error that is small enough is still to be looked at: it is an estimate, and either there are few elements
 * and it is the first of them that is small enough, or the last one was, and was wrong. Without an energy, as under
 * pressures that follow the body, it is looked at while there are few. */
static bool is_doubted(const search *g, const answers *x, int64_t n_elements, int64_t few)
{
    const int count = g->sequence.count;
    const bool again = count > 0 && g->best.doubted;
    bool estimated = false, wrong = false, finer = false;
    for (int64_t i = 0; i < g->n_cases; i++) {
        const uz_summary *s = &x->results[i]->summary;
        const seen *now = &g->seen[i * UZ_GRID_LEVELS + count];
        if (!is_answered(s))
            continue;
        estimated = estimated || !s->guarantee.proved;
        const bool strained = s->discretization_error != 0; /* else energies are rounding */
        wrong = wrong || (again && strained && (isnan(now->potential) ? n_elements < few : refuted(now - 1, now)));
        finer = finer || wants_finer(s);
    }
    return g->refines && x->error <= g->requested && (finer || (estimated && (again ? wrong : n_elements < few)));
}

/* ---- one grid */

/* Do all cases have the error that is asked for, as far as they are answered? */
static bool meets(const search *g, uz_result *const *results)
{
    bool met = true;
    for (int64_t i = 0; i < g->n_cases; i++)
        met = met && (!is_answered(&results[i]->summary) || error_of(g, &results[i]->summary) <= g->requested);
    return met;
}

/* Of small deformation, from the pressure of the best answers so far. started: uz_seconds(). */
static uz_status solve_small(uz_result **results, const search *g, const uz_problem *problem,
                             const uz_settings *settings, const uz_body_model *outline, double started, uz_error *err)
{
    uz_state **starts = uz_alloc_zero(g->n_cases, sizeof *starts);
    uz_status status = starts ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from the coarser grid");
    for (int64_t i = 0; status == UZ_OK && g->best.results && i < g->n_cases; i++)
        status = uz_transfer_start(&starts[i], g->best.results[i], g->refines ? NULL : &g->best.on.box, outline, err);
    const uz_state *const *from = (const uz_state *const *)starts;
    if (status == UZ_OK) {
        status = uz_solve_rounds(results, problem, settings, from, NULL, g->cache, g->hooks, err);
        status = uz_settle_cases(results, status, problem, settings, from, g->cache, g->hooks, started, err);
    }
    for (int64_t i = 0; starts && i < g->n_cases; i++)
        uz_state_free(starts[i]);
    free(starts);
    return status;
}

/* Of large deformation, from the displacements of the best answers so far. */
static uz_status solve_large(uz_result **results, const search *g, const uz_problem *problem,
                             const uz_settings *settings, const uz_body_model *body, uz_error *err)
{
    const uz_mesh *mesh = &body->mesh;
    double **near = uz_alloc_zero(g->n_cases, sizeof *near);
    bool room = near;
    for (int64_t i = 0; room && g->best.results && i < g->n_cases; i++) {
        const uz_result *best = g->best.results[i];
        if (best->summary.finite.load >= 1)
            room = (near[i] = g->refines ? uz_carry_nodal(mesh, best->u, best->n_nodes, mesh->dim)
                                         : uz_carry_box(mesh, &g->best.on.box, best->u));
    }
    uz_status status = room ? uz_solve_finite_near(results, problem, settings, near, NULL, g->hooks, err)
                            : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from the coarser grid");
    for (int64_t i = 0; i < g->n_cases && status == UZ_OK; i++) { /* on one mesh an answer stays without its estimate */
        double *error = &results[i]->summary.discretization_error;
        const uz_scene one = uz_scene_of_case(problem, i);
        if (results[i]->summary.finite.load > 0 && isnan(*error))
            status = uz_finite_mesh_error(error, NULL, body, &one, results[i]->free_strain, results[i]->u, err);
    }
    for (int64_t i = 0; near && i < g->n_cases; i++)
        free(near[i]);
    free(near);
    return status;
}

/* Solves the cases of a problem on a grid. */
static uz_status solve_cases(answers *x, uz_grid_level *level, search *g, const uz_problem *problem,
                             const uz_body_model *outline, uz_error *err)
{
    uz_settings settings = *g->settings;
    settings.balanced = false;
    settings.relative_error = equations_asked(g);
    const double started = uz_seconds();
    settings.time_limit_s = fmax(0.0, g->deadline - started);
    if (!(x->results = uz_alloc_zero(g->n_cases, sizeof(uz_result *))))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the results of %lld cases", (long long)g->n_cases);
    uz_status status = uz_is_finite(problem) ? solve_large(x->results, g, problem, &settings, outline, err)
                                             : solve_small(x->results, g, problem, &settings, outline, started, err);
    if (status == UZ_OK && g->refines && !settings.guaranteed && meets(g, x->results))
        status = uz_look_at_few_elements(x->results, problem, &settings, g->cache, g->hooks, started, err);
    for (int64_t i = 0; status == UZ_OK && i < g->n_cases; i++) {
        const uz_summary *s = &x->results[i]->summary;
        seen *known = &g->seen[i * UZ_GRID_LEVELS + g->sequence.count];
        level->iterations += s->iterations;
        level->d = s->d;
        *known = (seen){.max_pressure = NAN,
                        .contact_area = NAN,
                        .von_mises.value = NAN,
                        .used.value = NAN,
                        .potential = NAN,
                        .missed = NAN,
                        .left = NAN,
                        .from = -1,
                        .low = -INFINITY,
                        .high = INFINITY};
        if (!is_answered(s))
            continue;
        if (s->evaluation) {
            *known = seen_of(g, s);
            status = take_hidden(x->results[i], g, i, outline, err);
        }
        x->error = fmax(x->error, error_of(g, s));
        level->discretization_error = fmax(level->discretization_error, s->discretization_error);
        level->certified_error = fmax(level->certified_error, left_of(s));
    }
    return status;
}

/* Solves on a grid unless that would take too long, and chooses what to bisect. x has no results on failure, and where
 * there is no time. */
static uz_status solve_on_grid(answers *x, uz_grid_level *level, search *g, const grid *on, uz_error *err)
{
    uz_problem problem = *g->problem;
    uz_body_model outline;
    const double start = uz_seconds();
    *x = (answers){.on = *on, .number = g->sequence.count};
    *level = (uz_grid_level){.d = 0};
    if (on->n > 0 && !g->refines)
        memcpy(level->cells, on->box.cells, sizeof level->cells);
    problem.scene.box = on->box;
    problem.scene.bisected = g->bisected;
    problem.scene.n_bisected = on->n_bisected;
    uz_status status = uz_body_model_build(&outline, &problem.scene, UZ_BODY_OUTLINE, err);
    if (status != UZ_OK)
        return status;
    const uz_element_type *type = uz_element_type_of((uz_element_kind)outline.mesh.kind[0]);
    g->order = (type->nodes > type->corners ? 2 : 1) * (g->settings->quantity_error > 0.0 ? 2 : 1);
    level->n_elements = outline.mesh.n_elements;
    const int64_t few = type->nodes > type->corners ? FEW_QUADRATIC : FEW_LINEAR;
    x->on.dofs = (double)(outline.mesh.n_nodes * outline.mesh.dim);
    if (x->on.dofs > MOST_DOFS && g->sequence.count > 0)
        status =
            uz_fail(err, UZ_ERR_LIMIT, "", "it has %.0f unknowns, and at most %.0f are tried", x->on.dofs, MOST_DOFS);
    const bool late = status == UZ_OK && g->sequence.count > 0 && !has_time(g, x->on.dofs);
    if (late)
        g->stop = STOP_TIME;
    if (status == UZ_OK && !late) {
        double from = 0.0, to = 0.2; /* what the grid is of the way to the error asked for */
        if (g->sequence.count > 0) {
            const uz_tried *last = &g->tried[g->sequence.count - 1];
            const double rate = g->sequence.count > 1 ? uz_observed_rate(last - 1, last, g->order) : g->order;
            from = share_done(g, last->error);
            to = share_done(g, last->error * pow(last->n / number_of(g, &x->on), rate));
        }
        const int count = g->sequence.count;
        const uz_grid_start begins = {.from = from,
                                      .to = fmax(from, to),
                                      .number = count + 1,
                                      .unknowns = x->on.dofs,
                                      .error = count > 0 ? g->sequence.level[count - 1].error : (double)NAN,
                                      .asked = g->requested,
                                      .seconds_left = seconds_left(g, x->on.dofs)};
        if (g->hooks && g->hooks->grid)
            g->hooks->grid(g->hooks->ctx, &begins);
        if (g->hooks && g->hooks->keep && g->best.results && isfinite(g->deadline))
            offer(g);
        status = solve_cases(x, level, g, &problem, &outline, err);
    }
    x->doubted = status == UZ_OK && x->results && is_doubted(g, x, level->n_elements, few);
    if (status == UZ_OK && x->results && g->refines && (x->error > g->requested || x->doubted))
        status = uz_mark_elements(&g->bisected, &g->n_bisected, &outline, &problem, x->results, g->requested / x->error,
                                  uz_mesh_can_subdivide(&outline.mesh) && !g->settings->guaranteed, err);
    uz_body_model_clear(&outline);
    level->seconds = uz_seconds() - start;
    if (status != UZ_OK) {
        uz_results_free(x->results, x->results ? g->n_cases : 0);
        x->results = NULL;
    }
    return status;
}

/* The coarsest grid that meets the request and is not doubted; until there is one, that of the smallest error. An
 * error that is doubted is less worth than that of any finer grid. */
static void keep_better(search *g, answers *x)
{
    const bool meets = x->error <= g->requested, met = g->best.results && g->best.error <= g->requested;
    const bool better = !g->best.results || g->best.doubted ||
                        (met ? meets && x->on.dofs < g->best.on.dofs : meets || x->error < g->best.error);
    answers *worse = better ? &g->best : x;
    for (int64_t i = 0; worse->results && i < g->n_cases; i++)
        uz_timings_add(&g->spent[i], &worse->results[i]->summary.timings);
    uz_results_free(worse->results, worse->results ? g->n_cases : 0);
    worse->results = NULL;
    if (better) {
        g->best = *x;
        g->sequence.n_elements = g->sequence.level[g->sequence.count - 1].n_elements;
        if (x->on.n > 0)
            memcpy(g->sequence.cells, x->on.box.cells, sizeof g->sequence.cells);
    }
}

/* A grid that could not be solved ends the sequence where another one was; only lasting faults end the call. */
static uz_status try_grid(search *g, grid on, uz_error *err)
{
    answers x;
    uz_error failure = {0};
    uz_status status = solve_on_grid(&x, &g->sequence.level[g->sequence.count], g, &on, &failure);
    if (status == UZ_OK && !x.results)
        return UZ_OK; /* no time */
    if (status == UZ_OK) {
        g->sequence.level[g->sequence.count].error = x.error;
        g->tried[g->sequence.count++] = (uz_tried){number_of(g, &x.on), x.error};
        g->tried_dofs = x.on.dofs;
        g->stop = x.error <= g->requested && !x.doubted ? STOP_MET : STOP_NOT;
        /* what the ends of the cases' solves say about going on */
        for (int64_t i = 0; g->stop != STOP_MET && g->stop != STOP_CANCELLED && i < g->n_cases; i++) {
            const uz_summary *s = &x.results[i]->summary;
            if (s->outcome == UZ_DISMISSED)
                g->stop = STOP_CANCELLED;
            else if (s->outcome == UZ_TIME_LIMIT)
                g->stop = STOP_TIME;
            else if (is_answered(s) && !(left_of(s) < g->requested) && g->stop == STOP_NOT)
                g->stop = STOP_ALGEBRA;
            const seen *all = &g->seen[i * UZ_GRID_LEVELS], *now = &all[g->sequence.count - 1];
            if (g->stop == STOP_NOT && is_large(s) && s->finite.load < 1 && s->outcome != UZ_MESH_LIMIT &&
                g->best.results && s->finite.load < g->best.results[i]->summary.finite.load + MORE_LOAD) {
                g->stop = STOP_GRID;
                snprintf(g->reason, sizeof g->reason, "the next grid bears %.3g of the load alone: %.20s",
                         s->finite.load, uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome));
            } else if (g->stop == STOP_NOT && x.error > g->best.error && is_another(all, now, s)) {
                g->stop = STOP_GRID;
                snprintf(g->reason, sizeof g->reason,
                         "a finer grid has another equilibrium, with an error of %.3g: a bifurcation, or strain "
                         "without limit",
                         s->discretization_error);
            }
        }
        keep_better(g, &x);
        return UZ_OK;
    }
    const bool lasting = status == UZ_ERR_MEMORY || status == UZ_ERR_ARGUMENT || status == UZ_ERR_INTERNAL;
    if (g->best.results && !lasting) {
        g->stop = status != UZ_ERR_CANCELLED ? STOP_GRID : uz_cancelled(g->hooks) ? STOP_CANCELLED : STOP_TIME;
        snprintf(g->reason, sizeof g->reason, "the next grid was refused: %.120s", failure.message);
        return UZ_OK;
    }
    if (err)
        *err = failure;
    return status;
}

/* ---- what is told of it */

/* How it ended, in the summary of a case. */
static void conclude(const search *g, uz_summary *s)
{
    s->requested_error = g->requested;
    if (!is_answered(s) || s->outcome == UZ_LOOSE || s->outcome == UZ_MOVING_GEOMETRY || wants_finer(s))
        return; /* it has told */
    const double total = uz_asked_error(s);
    if (total <= g->requested && s->outcome == UZ_MESH_LIMIT && uz_is_unproved(s))
        return; /* a bound was asked for, and an estimate is none */
    if (total <= g->requested && !g->best.doubted) {
        s->outcome = UZ_CONVERGED;
        s->message[0] = '\0';
        return;
    }
    if (g->stop == STOP_TIME)
        s->outcome = UZ_TIME_LIMIT;
    else if (g->stop == STOP_CANCELLED)
        s->outcome = UZ_DISMISSED;
    else if (g->stop == STOP_GRID || s->outcome == UZ_CONVERGED)
        s->outcome = UZ_MESH_LIMIT;
    const char *why = s->outcome == UZ_MESH_LIMIT   ? g->reason
                      : s->outcome == UZ_TIME_LIMIT ? "the time allowed was used up: raise time_limit_s"
                      : s->outcome == UZ_DISMISSED  ? "stopped by request"
                                                    : "the equations of this grid could not be solved better";
    if (total <= g->requested)
        snprintf(s->message, sizeof s->message,
                 "%s. The error of %lld elements is estimated as %.3g, and no finer grid has confirmed that.", why,
                 (long long)g->sequence.n_elements, total);
    else if (s->evaluation && s->evaluation->asked > 0.0 && s->evaluation->n_quantities > 0)
        snprintf(s->message, sizeof s->message, "%.120s. %.40s is known within %.3g of itself, asked for %.3g.", why,
                 s->evaluation->quantities[0].name, total, g->requested);
    else
        snprintf(s->message, sizeof s->message,
                 "%s. Total error about %.3g (mesh %.3g, certified %.3g), asked for %.3g.", why, total,
                 s->discretization_error, left_of(s), g->requested);
}

/* What the grids tell of the largest pressure, of the area of a case's contact and of the largest stress. The area ends
 * within an element: of a line at two ends, of a surface around it. A grid that does not see the contact tells nothing
 * of it. */
static void tell_trends(const search *g, uz_result *result, const seen *of)
{
    uz_trend_point peak[UZ_GRID_LEVELS], area[UZ_GRID_LEVELS], von_mises[UZ_GRID_LEVELS], used[UZ_GRID_LEVELS];
    uz_evaluation *e = result->evaluation;
    const int count = g->sequence.count, dim = g->sequence.dim;
    for (int i = 0; i < count; i++) {
        uz_grid_level *level = &result->grids->level[i];
        level->max_pressure = of[i].max_pressure;
        level->contact_area = of[i].contact_area;
        peak[i] = (uz_trend_point){of[i].peak_size, of[i].max_pressure};
        area[i] = (uz_trend_point){of[i].mean_size, of[i].contact_area};
        von_mises[i] = of[i].von_mises;
        used[i] = of[i].used;
    }
    const double active = (double)result->summary.active, pi = acos(-1.0);
    const double grain = active > 0 ? e->contact_area / active * (dim == 2 ? 1.0 : sqrt(pi * active)) : 0.0;
    uz_trend_fit(&e->peak, peak, count, result->summary.max_pressure, 0.0);
    uz_trend_fit(&e->area, area, count, e->contact_area, grain);
    if (e->stressed) {
        uz_trend_fit(&e->von_mises.trend, von_mises, count, e->von_mises.value, 0.0);
        uz_trend_fit(&e->used.trend, used, count, e->used.value, 0.0);
    }
}

/* What the search knows beside the answer of a case. */
static uz_status complete(const search *g, uz_result *result, int64_t i, uz_error *err)
{
    result->grids = uz_alloc(1, sizeof *result->grids);
    if (!result->grids)
        return uz_no_memory(err, "the grids that were tried");
    *result->grids = g->sequence;
    result->summary.grids = result->grids;
    if (result->evaluation && is_answered(&result->summary))
        tell_trends(g, result, g->seen + i * UZ_GRID_LEVELS);
    if (g->refines) { /* may be shorter than the search's list: of a grid that was tried later */
        const int64_t n = result->grids->n_bisected = g->best.on.n_bisected;
        int64_t *list = result->grids->bisected = uz_alloc(n, sizeof *list);
        if (!list)
            return uz_no_memory(err, "the elements that were bisected");
        if (n > 0)
            memcpy(list, g->bisected, (size_t)n * sizeof *list);
    }
    uz_timings_add(&result->summary.timings, &g->spent[i]);
    uz_trade_shift(&result->trade, g->spent[i].total);
    conclude(g, &result->summary);
    return UZ_OK;
}

/* The best answers so far, as if the time were over: a process whose next grid takes too long is ended, and has nothing
 * else to tell. They stay as they are: what is completed are copies, but for what the search does not change. Without
 * memory for that there is nothing to offer. */
static void offer(search *g)
{
    const stop_kind stop = g->stop;
    uz_result **shown = uz_alloc_zero(g->n_cases, sizeof *shown), *copy = uz_alloc_zero(g->n_cases, sizeof *copy);
    uz_evaluation *evaluation = uz_alloc_zero(g->n_cases, sizeof *evaluation);
    bool whole = shown && copy && evaluation;
    g->stop = STOP_TIME;
    for (int64_t i = 0; i < g->n_cases && whole; i++) {
        const uz_result *result = g->best.results[i];
        shown[i] = &copy[i];
        copy[i] = *result;
        if (result->evaluation) {
            evaluation[i] = *result->evaluation;
            copy[i].summary.evaluation = copy[i].evaluation = &evaluation[i];
        }
        whole = complete(g, &copy[i], i, NULL) == UZ_OK;
    }
    g->stop = stop;
    if (whole)
        g->hooks->keep(g->hooks->ctx, shown, g->n_cases);
    for (int64_t i = 0; copy && i < g->n_cases; i++) {
        if (copy[i].grids)
            free(copy[i].grids->bisected);
        free(copy[i].grids);
    }
    uz_free_all(shown, copy, evaluation);
}

static uz_status publish(search *g, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < g->n_cases && status == UZ_OK; i++)
        status = complete(g, g->best.results[i], i, err);
    return status;
}
