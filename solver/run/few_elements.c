/* few_elements.c: what a mesh of a few elements hides of its error.
 *
 * Of a few elements the averages at nodes are hardly other than the stress itself, so that the estimate, and what
 * quantities have of it, may be worth nothing: a block of one element differs from no average at all. Where they are so
 * few, the same scene is solved with all of them divided once along each direction, which costs little, and the answer
 * is told no less than what both differ by:
 *
 *     |u_h/2 - u_h|^2 = integral of (eps(u_h/2) - eps(u_h))' C (eps(u_h/2) - eps(u_h)), and what springs have of it
 *
 * Meshes of the standard formulation are nested, so that this is what the square of the error falls by (Galerkin
 * orthogonality), and what it falls to the finer mesh's estimate tells: that is looked at likewise while it has few
 * elements itself. Strains of other formulations are compared as they are. Of large deformation the finer mesh begins
 * at the answer, and the distance is what the change of internal forces does along the way (finite/mesh_error.h). */
#include "run/solve.h"

#include "assembly/assembly.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/vector3.h"
#include "element/element.h"
#include "finite/mesh_error.h"
#include "post/balance.h"
#include "run/finite.h"
#include "run/results.h"
#include "run/transfer.h"
#include "scene/bisect.h"
#include "scene/subdivide.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Quadratic elements have a slope of their own to compare, and more nodes: so many in all, each element's counted
 * apart, which is 66 of tri6, 50 of quad8, 40 of tet10 and 20 of hex20. */
enum { FEW_LINEAR = 64, FEW_NODES = 400 };

/* Of large deformation, where a look takes more than the answer did, a given mesh may have half as many: of 300
 * generated boxes of one to three cells across one cell hid errors, and two in one interval of 34. */
enum { OF_LARGE = 2 };

/* Of linear elements of the standard formulation, which are too stiff where they bend: the square of the error in parts
 * of that of the distance, as beside singular corners; likewise of quantities, of which errors are products of two. Of
 * others it is what the finer mesh leaves by its own estimate. */
#define OF_LINEAR 2.0

/* Elements longer than so many times their least edge count for less, as what goes on at the ends of a strip is no
 * longer than the strip is thick; but of no more nodes a finer mesh is solved for, in the plane and in space. */
#define LONG 2.0
enum { MOST_PLANE = 512, MOST_SOLID = 160 };

/* Displacements that differ by less, in parts of the largest, may have lost digits that count. */
#define ALIKE 1e-6

/* Of large deformation: where the finer mesh does not go on from the answer under the whole load, that is put on in
 * parts from rest, but how much of it is borne in the end is not looked for: answers of the finer mesh are not told. */
#define LEAST_PART (1.0 / 16)
/* ... and so many contact problems besides as many as the answer took are enough: of 130 generated scenes those that
 * had an answer took 1 to 31, and those that had none up to 173. */
enum { ENOUGH_QPS = 40 };

/* A mesh of the answers, and the other one with all elements divided. */
typedef struct {
    uz_body_model coarse, fine;
    uz_problem problem; /* on the other one */
    uz_settings settings;
    uz_hooks hooks; /* whether to go on, and nothing else */
    int64_t *list;
    bool linear; /* some elements are, of the standard formulation */
} finer;

/* An element with the strain of its nodes' displacements. */
typedef struct {
    uz_element element;
    uz_element_motion motion;
    double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS];
    int nodes;
} strained;

/* Where its nodes are, as elements of equal ones all have the places of the first. */
static int take_places(double *xyz, const uz_mesh *mesh, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(mesh, e, &count);
    for (int i = 0; i < count * mesh->dim; i++)
        xyz[i] = mesh->xyz[node[i / mesh->dim] * mesh->dim + i % mesh->dim];
    return count;
}

static void take_element(strained *out, const uz_body_model *model, const double *nodal, int64_t e)
{
    const int dim = model->mesh.dim;
    const int64_t *node = model->mesh.node + model->mesh.first[e];
    uz_body_element(&out->element, out->xyz, model, e);
    out->nodes = take_places(out->xyz, &model->mesh, e);
    for (int i = 0; i < out->nodes * dim; i++)
        out->u[i] = nodal[node[i / dim] * dim + i % dim];
    uz_element_move(&out->motion, &out->element, out->u);
}

/* The energy of what both strains differ by in a part of an element, twice. */
static double distance2_in(const finer *f, const strained *part, const strained *whole)
{
    const uz_element_type *type = uz_element_type_of(part->element.kind),
                          *around = uz_element_type_of(whole->element.kind);
    const uz_gauss_rule *rule =
        type->energy.count > 0 ? &type->energy : uz_element_rule(part->element.kind, part->element.model);
    const int dim = type->dim, n = uz_stress_count(part->element.model);
    double sum = 0;
    for (int g = 0; g < rule->count; g++) {
        double N[UZ_ELEMENT_NODES], grad[UZ_ELEMENT_NODES][3], ring[UZ_ELEMENT_NODES], x[3] = {0}, point[3];
        double strain[UZ_ELEMENT_STRESSES], other[UZ_ELEMENT_STRESSES], stress[UZ_ELEMENT_STRESSES];
        const double *at = rule->point[g].at;
        const double det = uz_element_gradients(grad, &part->element, at);
        const double volume = rule->point[g].weight * det * uz_element_around(ring, &part->element, grad, at);
        uz_element_shape(N, part->element.kind, at);
        for (int i = 0; i < part->nodes * dim; i++)
            x[i % dim] += N[i / dim] * part->xyz[i];
        if (!uz_element_find(point, around, whole->xyz, f->coarse.mesh.extent, x))
            return NAN;
        uz_element_strain(strain, &part->motion, at);
        uz_element_strain(other, &whole->motion, point);
        for (int c = 0; c < n; c++)
            strain[c] -= other[c];
        uz_elastic_stress(stress, part->element.model, part->element.lame, strain);
        for (int c = 0; c < n; c++)
            sum += volume * strain[c] * stress[c];
    }
    return sum;
}

/* The square of the distance of two answers of small deformation, the coarser one also as carried to the nodes of the
 * finer mesh; NaN where a place of a part is not found in the whole. */
static double distance2(const finer *f, const double *u, const double *carried, const double *finer_u)
{
    const uz_mesh *mesh = &f->fine.mesh;
    double square = 0;
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim && f->fine.spring; i++)
        square += f->fine.spring[i] * (finer_u[i] - carried[i]) * (finer_u[i] - carried[i]);
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        strained part, whole;
        take_element(&part, &f->fine, finer_u, e);
        take_element(&whole, &f->coarse, u, mesh->part_of[e]);
        square += distance2_in(f, &part, &whole);
    }
    return square;
}

/* *square: of the distance of the two answers in the energy norm; NaN: it is not known. */
static uz_status measure_distance(double *square, const finer *f, const uz_result *here, const uz_result *on_finer,
                                  uz_error *err)
{
    const uz_mesh *mesh = &f->fine.mesh;
    double *carried = uz_carry_nodal(mesh, here->u, f->coarse.mesh.n_nodes, mesh->dim);
    if (!carried)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to compare the answers of two meshes");
    uz_status status = UZ_OK;
    if (uz_is_finite(&f->problem)) {
        status = uz_finite_distance(square, &f->fine, on_finer->free_strain, carried, on_finer->u, err);
        *square *= 2;
    } else {
        *square = distance2(f, here->u, carried, on_finer->u);
    }
    free(carried);
    return status;
}

/* The interval of a quantity has what the finer mesh has, and where the value goes from one to the other. */
static void widen(uz_quantity_found *q, const uz_quantity_found *on_finer, double times)
{
    const double ends[] = {q->found + times * (on_finer->found - q->found), on_finer->low, on_finer->high};
    double low = q->low, high = q->high;
    if (isnan(low) || isnan(on_finer->low))
        return;
    for (size_t k = 0; k < sizeof ends / sizeof ends[0]; k++) {
        low = fmin(low, ends[k]);
        high = fmax(high, ends[k]);
    }
    if (!(low < q->low || high > q->high) || !isfinite(high - low))
        return;
    q->low = low;
    q->high = high;
    q->value = 0.5 * (low + high);
    q->mesh = fmax(q->mesh, 0.5 * (high - low) - q->equations);
}

static bool is_large(const uz_summary *s)
{
    return s->geometry.kind == UZ_KINEMATICS_FINITE;
}

/* Is it under the whole load? */
static bool is_whole(const uz_summary *s)
{
    return !is_large(s) || s->finite.load >= 1;
}

/* No answer of the finer mesh under the whole load is known: nothing of this one is more than a number of its mesh. */
static void take_unborne(uz_result *result)
{
    uz_evaluation *e = result->evaluation;
    result->summary.discretization_error = 1;
    uz_doubt_unborne(e);
    for (int64_t i = 0; i < e->n_quantities; i++) {
        uz_quantity_found *q = &e->quantities[i];
        q->value = q->found;
        q->low = q->high = q->mesh = q->equations = NAN;
        snprintf(q->why, sizeof q->why, "with all elements divided no answer under the whole load is known");
    }
}

/* Of large deformation: it was looked at, and no answer under the whole load was found, or of its own divided elements
 * none. */
static bool is_unborne(const uz_summary *s)
{
    return is_large(s) && (s->outcome == UZ_UNSTABLE || s->outcome == UZ_ITERATION_LIMIT || s->outcome == UZ_INVERTED ||
                           s->discretization_error >= 1 || (s->outcome == UZ_MESH_LIMIT && !is_whole(s)));
}

static uz_status take_case(uz_result *result, const uz_result *on_finer, const finer *f, uz_error *err)
{
    uz_summary *s = &result->summary;
    const uz_evaluation *e = result->evaluation, *there = on_finer->evaluation;
    const bool cut = on_finer->summary.outcome == UZ_MESH_LIMIT && is_large(s); /* by an obstacle, between rows */
    double square = 0;
    if (is_unborne(&on_finer->summary)) {
        take_unborne(result);
        return UZ_OK;
    }
    if ((on_finer->summary.outcome != UZ_CONVERGED && !cut) || !there || on_finer->n_nodes != f->fine.mesh.n_nodes)
        return UZ_OK;
    if (s->discretization_error == 0 && on_finer->summary.discretization_error == 0) /* nothing strains that one */
        return UZ_OK;
    const uz_status status = measure_distance(&square, f, result, on_finer, err);
    if (status != UZ_OK || !isfinite(square))
        return status;
    const double energy = 2 * e->strain_energy, told = fmin(1, on_finer->summary.discretization_error);
    const double left = 2 * there->strain_energy * told * told / (1 - told * told),
                 equations = is_large(s) ? s->finite.residual * sqrt(energy) : s->certificate.absolute_error;
    square = fmax(0, square - equations * equations); /* which is told apart */
    square = fmax(square + left, f->linear ? OF_LINEAR * square : 0);
    if (!isfinite(square) || !(energy + square > 0))
        return UZ_OK;
    s->discretization_error = fmax(s->discretization_error, sqrt(square / (energy + square)));
    uz_doubt_coarse_mesh(result->evaluation, s->discretization_error);
    for (int64_t i = 0; i < e->n_quantities && i < there->n_quantities; i++)
        widen(&result->evaluation->quantities[i], &there->quantities[i], f->linear ? OF_LINEAR : 1);
    return UZ_OK;
}

/* Is it an answer with an error by estimate? What has none is carried along, or expands freely; of what is carried far,
 * and strained little, rounding is part of the distance. A mesh that is given may only be carried, exactly, for want of
 * nodes that a load could move; what is refined is divided before that is believed (grid_sequence.c). */
static bool is_estimated(const uz_result *result, const uz_scene *scene)
{
    const uz_summary *s = &result->summary;
    const int dim = result->mesh.dim;
    double way = 0, apart = 0;
    if (!result->evaluation || !result->u || uz_has_no_answer(s) || !isfinite(s->discretization_error) || !is_whole(s))
        return false;
    for (int64_t i = 0; i < result->n_nodes * dim; i++) {
        const double own = fabs(result->u[i]), other = fabs(result->u[i] - result->u[i % dim]);
        way = own > way ? own : way;
        apart = other > apart ? other : apart;
    }
    return apart > ALIKE * way ? s->discretization_error > 0 : apart == 0 && !scene->refine;
}

static uz_status divide_all(finer *f, const uz_problem *problem, uz_error *err)
{
    const int64_t n = f->coarse.mesh.n_elements;
    int64_t at = problem->scene.n_bisected;
    f->list = uz_alloc(at + n + 2, sizeof *f->list);
    if (!f->list)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to divide %lld elements", (long long)n);
    if (at > 0)
        memcpy(f->list, problem->scene.bisected, (size_t)at * sizeof *f->list);
    else if (uz_mesh_can_subdivide_all(&f->coarse.mesh))
        f->list[at++] = UZ_SUBDIVIDED;
    f->list[at++] = n;
    for (int64_t e = 0; e < n; e++)
        f->list[at++] = e;
    f->problem = *problem;
    f->problem.scene.bisected = f->list;
    f->problem.scene.n_bisected = at;
    f->problem.scene.refine = false;
    return uz_body_model_build(&f->fine, &f->problem.scene, UZ_BODY_OUTLINE, err);
}

/* Of all elements none is divided beside a whole one, so that no node hangs, beside ties or a surface that touches. */
static bool are_few(const uz_mesh *mesh, bool large)
{
    const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[0]);
    const int few = (type->nodes > type->corners ? FEW_NODES / type->nodes : FEW_LINEAR) / (large ? OF_LARGE : 1);
    double count = 0;
    for (int64_t e = 0; e < mesh->n_elements && count < few; e++) {
        const int corners = uz_element_type_of((uz_element_kind)mesh->kind[e])->corners;
        const int64_t *node = mesh->node + mesh->first[e];
        double least = INFINITY, most = 0;
        for (int a = 0; a < corners; a++)
            for (int b = 0; b < a; b++) {
                const double d =
                    uz_distance2(mesh->xyz + node[a] * mesh->dim, mesh->xyz + node[b] * mesh->dim, mesh->dim);
                least = d < least ? d : least;
                most = d > most ? d : most;
            }
        const double wide = LONG * sqrt(least / most);
        count += wide < 1 ? wide : 1;
    }
    return mesh->n_nodes <= (mesh->dim == 2 ? MOST_PLANE : MOST_SOLID) && count < few &&
           (uz_mesh_can_subdivide_all(mesh) || uz_mesh_check_bisection(mesh, NULL) == UZ_OK);
}

/* Of large deformation, from where the answers are. */
static uz_status solve_large(uz_result **there, const finer *f, uz_result *const *results, double started,
                             uz_error *err)
{
    const uz_mesh *mesh = &f->fine.mesh;
    const int64_t n = f->problem.n_cases > 0 ? f->problem.n_cases : 1;
    double **near = uz_alloc_zero(n, sizeof *near);
    uz_finite_effort effort = {.least = LEAST_PART, .qps = ENOUGH_QPS};
    bool room = near;
    for (int64_t i = 0; i < n; i++)
        effort.qps += results[i]->summary.finite.qps;
    for (int64_t i = 0; i < n && room; i++)
        if (is_estimated(results[i], &f->problem.scene))
            room = (near[i] = uz_carry_nodal(mesh, results[i]->u, results[i]->n_nodes, mesh->dim));
    uz_status status = room ? uz_solve_finite_near(there, &f->problem, &f->settings, near, &effort, &f->hooks, err)
                            : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to start from the coarser mesh");
    if (status == UZ_OK)
        status = uz_look_at_few_elements(there, &f->problem, &f->settings, NULL, &f->hooks, started, err);
    for (int64_t i = 0; i < n && near; i++)
        free(near[i]);
    free(near);
    return status;
}

static void dismiss(uz_summary *s)
{
    s->outcome = UZ_DISMISSED;
    snprintf(s->message, sizeof s->message,
             "stopped by request: the equations are solved, but what so few elements hide of their error is not known");
}

/* Answers stay as they are where the finer mesh has none: only a lack of memory ends the call; who cancels it gets them
 * as dismissed. */
static uz_status look_closer(uz_result **results, finer *f, const uz_problem *problem, uz_cache *cache, uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    const double started = uz_seconds();
    uz_result **there = uz_alloc_zero(n, sizeof *there);
    uz_status status =
        there ? divide_all(f, problem, err) : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld cases", (long long)n);
    if (status == UZ_OK && uz_is_finite(problem))
        status = solve_large(there, f, results, started, err);
    else if (status == UZ_OK) {
        status = uz_solve_rounds(there, &f->problem, &f->settings, NULL, NULL, cache, &f->hooks, err);
        status = uz_settle_cases(there, status, &f->problem, &f->settings, NULL, cache, &f->hooks, started, err);
    }
    const double spent = (uz_seconds() - started) / (double)n;
    for (int64_t i = 0; there && i < n && status == UZ_OK; i++)
        if (is_estimated(results[i], &problem->scene)) {
            status = take_case(results[i], there[i], f, err);
            results[i]->summary.timings.total += spent;
            results[i]->summary.timings.certify += spent;
            results[i]->trade.total_s += spent;
        }
    bool stopped = status == UZ_ERR_CANCELLED;
    for (int64_t i = 0; there && i < n && status == UZ_OK; i++)
        stopped = stopped || (there[i] && there[i]->summary.outcome == UZ_DISMISSED);
    for (int64_t i = 0; i < n && stopped; i++)
        if (!uz_has_no_answer(&results[i]->summary) && is_whole(&results[i]->summary))
            dismiss(&results[i]->summary);
    uz_results_free(there, there ? n : 0);
    if (status != UZ_OK && status != UZ_ERR_MEMORY) {
        uz_error_reset(err);
        status = UZ_OK;
    }
    return status;
}

uz_status uz_look_at_few_elements(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                                  uz_cache *cache, const uz_hooks *hooks, double started, uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    const uz_scene *scene = &problem->scene;
    bool any = false;
    if (problem->kind != UZ_PROBLEM_SCENE)
        return UZ_OK;
    for (int64_t i = 0; i < n; i++)
        any = any || (results[i]->n_nodes <= MOST_PLANE && is_estimated(results[i], &problem->scene));
    if (!any)
        return UZ_OK;
    finer f = {.settings = uz_settings_default()};
    f.settings.memory_limit = settings->memory_limit;
    f.settings.time_limit_s = fmax(0, started + settings->time_limit_s - uz_seconds());
    f.hooks.ctx = hooks ? hooks->ctx : NULL;
    f.hooks.cancelled = hooks ? hooks->cancelled : NULL;
    uz_mesh mesh;
    uz_status status = uz_mesh_from_scene(&mesh, scene, err);
    if (status != UZ_OK)
        return status;
    const bool few = are_few(&mesh, uz_is_finite(problem) && scene->n_bisected == 0);
    uz_mesh_clear(&mesh);
    if (!few)
        return UZ_OK;
    status = uz_body_model_build(&f.coarse, scene, UZ_BODY_OUTLINE, err);
    for (int64_t e = 0; status == UZ_OK && e < f.coarse.mesh.n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)f.coarse.mesh.kind[e]);
        f.linear = f.linear ||
                   (type->nodes == type->corners && uz_element_formulation(&f.coarse, e) == UZ_FORMULATION_STANDARD);
    }
    if (status == UZ_OK)
        status = look_closer(results, &f, problem, cache, err);
    uz_body_model_clear(&f.coarse);
    uz_body_model_clear(&f.fine);
    free(f.list);
    return status;
}
