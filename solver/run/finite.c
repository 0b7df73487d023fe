/* finite.c: the load put on in parts.
 *
 * The whole of it at once, loads, prescribed displacements, and what obstacles overlap before anything moves. A part
 * that does not lead to a certified stable equilibrium is halved, one that needed few contact problems doubled. Where
 * parts become small without one, the load cannot be borne beyond, or the body is led to turn inside out: the answer is
 * then that of the last part which has an equilibrium, and is not called converged. */
#include "run/finite.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/vector3.h"
#include "run/problem.h"
#include "run/results.h"
#include "run/semicoercive.h"
#include "run/settings.h"
#include "run/solve.h"
#include "scene/check.h"
#include "scene/corner_table.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (180 / 3.14159265358979323846)

/* Parts are doubled after at most FEW contact problems. */
enum { FEW = 4, MOST_PARTS = 200 };
#define LEAST_PART (1.0 / 1024)
/* Orderings and factors of tangents that are kept. */
#define CACHE_BYTES ((size_t)256 << 20)
/* Contact problems, which are those of all of u, of which most may be rotation, are solved to the first, and the answer
 * to no less than the second. */
#define STEP_ERROR  1e-10
#define LEAST_ERROR 1e-12
/* What a turn by one radian may strain tied surfaces by. */
#define MOST_TIED 0.01

bool uz_is_finite(const uz_problem *problem)
{
    return problem->kind == UZ_PROBLEM_SCENE && problem->scene.kinematics == UZ_KINEMATICS_FINITE;
}

/* ---- what is refused */

uz_status uz_check_finite_settings(const uz_settings *settings, uz_error *err)
{
    if (settings->guaranteed)
        return uz_fail(err, UZ_ERR_SCENE, "/solver/accuracy",
                       "where kinematics are finite the error of the mesh is told by estimate, but not bounded: leave "
                       "guaranteed out");
    if (settings->stopping == UZ_STOP_PAPER)
        return uz_fail(err, UZ_ERR_SCENE, "/solver/stopping",
                       "finite kinematics end by their certificate; leave stopping out");
    return UZ_OK;
}

void uz_judge_finite(uz_result *result, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks)
{
    uz_judge_whole_error(result, problem, settings, NULL, hooks, 0);
    uz_judge_quantity(result);
}

/* ---- parts of the load */

static void scale_load(uz_load *out, const uz_load *from, double factor)
{
    for (int c = 0; c < 3; c++)
        out->v[c] = factor * from->v[c];
    for (int c = 0; c < 3; c++)
        out->moment[c] = factor * from->moment[c];
    out->value = factor * from->value;
}

/* The temperatures of run->scene's loads. */
static uz_status warm(uz_finite_run *run, uz_error *err)
{
    free(run->free_strain);
    run->scene.free_strain = NULL;
    const uz_status status = uz_free_strains(&run->free_strain, &run->base, &run->scene, err);
    for (int64_t e = 0; e < run->base.mesh.n_elements && run->free_strain; e++)
        if (!(run->free_strain[e] > -1))
            return uz_fail(err, UZ_ERR_SCENE, "/loads",
                           "temperature shrinks element %lld to nothing: expansion times temperature is %.3g, and must "
                           "be above -1",
                           (long long)e, run->free_strain[e]);
    run->scene.free_strain = run->free_strain;
    run->scene.n_free_strain = run->base.mesh.n_elements;
    return status;
}

/* Supports and loads become those of a part t of the way from run->from to run->part of the whole. */
static uz_status put_on(uz_finite_run *run, double t, uz_error *err)
{
    const uz_scene *whole = &run->problem->scene;
    const double moved = (1 - t) * (run->from ? run->from->part : 0) + t * run->part;
    run->load = t;
    for (int64_t i = 0; i < whole->n_supports; i++) {
        for (int c = 0; c < 3; c++) {
            run->scene.supports[i].u[c] = moved * whole->supports[i].u[c]; /* NaN where free */
            run->scene.supports[i].turn[c] = moved * whole->supports[i].turn[c];
        }
        run->scene.supports[i].value = moved * whole->supports[i].value;
    }
    for (int64_t i = 0; i < run->scene.n_loads; i++) /* its own, and then those that it goes away from */
        if (i < whole->n_loads)
            scale_load(&run->scene.loads[i], &whole->loads[i], t * run->part);
        else
            scale_load(&run->scene.loads[i], &run->from->loads[i - whole->n_loads], 1 - t);
    uz_status status = uz_nodal_loads(run->loads, &run->base, &run->scene, err);
    if (status == UZ_OK)
        status = warm(run, err);
    return status == UZ_OK ? uz_prescribed_values(run->prescribed, &run->base, &run->scene, err) : status;
}

/* A copy of the lists that a part changes, with the loads of where it begins (NULL: at rest). */
static bool copy_lists(uz_scene *scene, const uz_scene *from, const uz_finite_point *begins)
{
    const int64_t more = begins ? begins->n_loads : 0;
    scene->supports = uz_alloc(from->n_supports, sizeof *scene->supports);
    scene->loads = uz_alloc(from->n_loads + more, sizeof *scene->loads);
    scene->n_loads = from->n_loads + more;
    if (!scene->supports || !scene->loads)
        return false;
    if (from->n_supports > 0)
        memcpy(scene->supports, from->supports, (size_t)from->n_supports * sizeof *scene->supports);
    if (from->n_loads > 0)
        memcpy(scene->loads, from->loads, (size_t)from->n_loads * sizeof *scene->loads);
    if (more > 0)
        memcpy(scene->loads + from->n_loads, begins->loads, (size_t)more * sizeof *scene->loads);
    return true;
}

/* How far a slave of a tie is from where its masters' places have it. */
static void find_offset(double off[3], const uz_body_model *base, int64_t a)
{
    const int dim = base->mesh.dim;
    for (int c = 0; c < dim; c++)
        off[c] = base->mesh.xyz[dim * a + c] - uz_tied_value(base, a, base->mesh.xyz + c, dim);
}

/* A tie has the slave's displacement from its masters', so that what lies between them stays as it was when the body
 * turns: where it is not the same along the surface, a turn strains it. */
static uz_status check_tie(const uz_body_model *base, const uz_group *group, int64_t tie, uz_error *err)
{
    const int dim = base->mesh.dim;
    for (int64_t f = 0; f < group->n_faces; f++) {
        int64_t node[UZ_FACE_NODES];
        const int count = uz_mesh_face(node, &base->mesh, group->face[f]);
        for (int a = 0; a < count; a++)
            for (int b = 0; b < a && uz_is_tied(base, node[a]); b++) {
                double off[2][3], square = 0;
                if (!uz_is_tied(base, node[b]))
                    continue;
                find_offset(off[0], base, node[a]);
                find_offset(off[1], base, node[b]);
                for (int c = 0; c < dim; c++)
                    square += (off[0][c] - off[1][c]) * (off[0][c] - off[1][c]);
                const double strain =
                    sqrt(square / uz_distance2(base->mesh.xyz + dim * node[a], base->mesh.xyz + dim * node[b], dim));
                if (strain > MOST_TIED)
                    return uz_fail(err, UZ_ERR_SCENE, UZ_PLACE("ties", tie, NULL),
                                   "the tied surfaces do not lie on each other: near node %lld turning would strain "
                                   "them by %.2g; finite kinematics need less than %.2g: use finer meshes along the "
                                   "tie, quad8, tri6, hex20 or tet10 where it is curved, or the kinematics \"moving\"",
                                   (long long)node[a], strain, MOST_TIED);
            }
    }
    return UZ_OK;
}

static uz_status check_ties(const uz_body_model *base, const uz_scene *scene, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < 2 * scene->n_ties && status == UZ_OK; k++) {
        const uz_tie *tie = &scene->ties[k / 2];
        const uz_group *group = uz_mesh_group(&base->mesh, k % 2 ? tie->to : tie->on, "/ties", err);
        status = group ? check_tie(base, group, k / 2, err) : UZ_ERR_SCENE;
    }
    return status;
}

static uz_status begin_load(uz_finite_run *run, uz_error *err)
{
    const uz_mesh *mesh = &run->base.mesh;
    run->pairs = uz_has_pairs(&run->scene);
    run->follows = uz_has_followers(&run->scene);
    run->n = mesh->dim * mesh->n_nodes;
    run->d = run->base.d;
    for (int64_t j = 0; j < run->d; j++)
        run->stiffest = fmax(run->stiffest, run->base.K.val[run->base.K.ptr[j]]);
    run->grain = 1e-14 * run->stiffest * mesh->extent * mesh->extent;
    run->loads = uz_alloc(run->n, sizeof *run->loads);
    run->prescribed = uz_alloc(run->base.n_fixed, sizeof *run->prescribed);
    run->overlap = uz_alloc_zero(run->scene.n_contacts, sizeof *run->overlap);
    run->p = uz_alloc(run->d, sizeof *run->p);
    run->v = uz_alloc(run->d, sizeof *run->v);
    run->Kv = uz_alloc(run->d, sizeof *run->Kv);
    run->step = uz_alloc(run->n, sizeof *run->step);
    double *h = uz_alloc(run->base.m, sizeof *h);
    uz_status status = UZ_OK;
    if (!run->loads || !run->prescribed || !run->overlap || !run->p || !run->v || !run->Kv || !run->step || !h)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the load of %lld dofs", (long long)run->d);
    if (status == UZ_OK) /* checks what it reads */
        status = uz_body_model_load(run->p, h, run->prescribed, &run->base, &run->scene, err);
    free(h);
    return status;
}

/* From one point of a path to the next a group goes the shorter way round. */
static uz_status check_turns(const uz_finite_run *run, uz_error *err)
{
    const double part = run->part - (run->from ? run->from->part : 0);
    for (int64_t i = 0; i < run->scene.n_supports; i++) {
        const uz_support *support = &run->scene.supports[i];
        const double angle = support->kind == UZ_SUPPORT_RIGID ? fabs(part) * uz_support_angle(support) : 0;
        if (angle > UZ_MOST_TURN)
            return uz_fail(
                err, UZ_ERR_SCENE, "/cases",
                "\"%.63s\" is turned by %g degrees from one point of the path to the next, and a rotation by "
                "more than half a turn is another one: put points between",
                support->on, angle * DEGREE);
    }
    return UZ_OK;
}

static uz_status begin(uz_finite_run *run, const uz_problem *one, const uz_settings *settings, const uz_hooks *hooks,
                       double deadline, const uz_finite_path *path, uz_error *err)
{
    *run = (uz_finite_run){.problem = one, .settings = *settings, .scene = one->scene, .deadline = deadline};
    run->from = path ? path->from : NULL;
    run->near = path && !path->from ? path->near : NULL;
    run->part = path ? path->part : 1;
    run->effort = path ? path->effort : (uz_finite_effort){0};
    run->effort.least = run->effort.least > 0 ? run->effort.least : LEAST_PART;
    const double start = uz_seconds();
    run->hooks = hooks ? *hooks : (uz_hooks){.ctx = NULL};
    run->hooks.begins = NULL;
    run->hooks.progress = NULL; /* steps of contact problems, and there are many of these */
    run->requested = fmax(LEAST_ERROR, uz_requested_error(settings));
    run->balanced = settings->balanced;
    run->settings.balanced = false;
    run->settings.relative_error = fmin(STEP_ERROR, run->requested);
    run->settings.semidefinite = false;
    const bool copied = copy_lists(&run->scene, &one->scene, run->from);
    run->cache = uz_cache_new(CACHE_BYTES);
    if (!copied || !run->cache)
        return uz_no_memory(err, "the parts of a load");
    uz_status status = uz_body_model_build(&run->base, &run->scene, UZ_BODY_HELD, err);
    if (status == UZ_OK)
        status = check_ties(&run->base, &run->scene, err);
    if (status == UZ_OK)
        status = uz_outer_sides(&run->outer, &run->base.mesh, err);
    if (status == UZ_OK)
        status = check_turns(run, err);
    if (status == UZ_OK)
        status = begin_load(run, err);
    if (status == UZ_OK)
        status = uz_finite_tangent_of(&run->tangent, &run->base, err);
    if (status == UZ_OK)
        status = uz_finite_place_init(&run->at, run, err);
    if (status == UZ_OK)
        status = uz_finite_place_init(&run->trial, run, err);
    run->spent.assemble = uz_seconds() - start;
    return status;
}

static void end(uz_finite_run *run)
{
    uz_finite_place_clear(&run->at);
    uz_finite_place_clear(&run->trial);
    uz_finite_tangent_clear(&run->tangent);
    uz_body_model_clear(&run->base);
    uz_csc_clear(&run->wide);
    uz_csc_clear(&run->skew);
    uz_row_turn_clear(&run->turn);
    uz_cache_free(run->cache);
    uz_result_free(run->last);
    uz_free_all(run->scene.supports, run->scene.loads, run->outer.face, run->free_strain, run->loads, run->prescribed,
                run->overlap, run->r);
    uz_candidates_clear(&run->kept);
    uz_free_all(run->p, run->v, run->Kv, run->step);
}

/* What is gone back to. */
typedef struct {
    double *u, *r;
    int64_t n_r;
    uz_finite_certificate certificate;
} settled;

static bool keep(settled *to, const uz_finite_run *run)
{
    double *r = uz_alloc(run->n_r, sizeof *r);
    if (!r)
        return false;
    free(to->r);
    to->r = r;
    to->n_r = run->n_r;
    to->certificate = run->certificate;
    memcpy(to->u, run->at.u, (size_t)run->n * sizeof *to->u);
    if (run->n_r > 0)
        memcpy(r, run->r, (size_t)run->n_r * sizeof *r);
    return true;
}

static uz_status go_back(uz_finite_run *run, const settled *to, double t, uz_error *err)
{
    bool fits;
    double *r = uz_alloc(to->n_r, sizeof *r);
    if (!r)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)to->n_r);
    if (to->n_r > 0)
        memcpy(r, to->r, (size_t)to->n_r * sizeof *r);
    free(run->r);
    run->r = r;
    run->n_r = to->n_r;
    run->certificate = to->certificate;
    memcpy(run->at.u, to->u, (size_t)run->n * sizeof *to->u);
    const uz_status status = put_on(run, t, err);
    return status == UZ_OK ? uz_finite_place_find(&fits, &run->at, run, err) : status;
}

/* Of the body at rest, where run->at is. */
static void measure_overlap(uz_finite_run *run)
{
    for (int64_t i = 0; i < run->at.rows.m; i++) {
        double *most = &run->overlap[run->at.rows.info.contact_of[i]];
        *most = fmax(*most, -run->at.gap[i]);
    }
}

/* The load that is borne is known to run->effort.least: a part that fails may be twice the smallest. */
static double least_part(const uz_finite_run *run)
{
    return run->effort.least * (run->found.load > 0 ? 0.5 * run->found.load : 1);
}

/* The way begins at rest, or where another case has come to. */
static bool start_at(settled *to, const uz_finite_point *from)
{
    if (!from)
        return true;
    to->r = uz_alloc(from->n_r, sizeof *to->r);
    if (!to->r)
        return false;
    memcpy(to->u, from->u, (size_t)from->n * sizeof *to->u);
    if (from->n_r > 0)
        memcpy(to->r, from->r, (size_t)from->n_r * sizeof *to->r);
    to->n_r = from->n_r;
    to->certificate = from->certificate;
    return true;
}

/* run->at becomes the place that is near the answer, with supports where the whole load has them. */
static uz_status begin_near(uz_finite_run *run, uz_error *err)
{
    bool fits = true;
    uz_status status = put_on(run, 1, err);
    if (status != UZ_OK)
        return status;
    if (run->base.n_rigid == 0) {
        uz_restrict_nodal(run->v, &run->base, run->near);
        uz_recover_nodal(run->at.u, &run->base, run->v, run->prescribed);
        return UZ_OK;
    }
    memcpy(run->at.u, run->near, (size_t)run->n * sizeof *run->near);
    status = uz_finite_place_find(&fits, &run->at, run, err);
    if (status == UZ_OK && fits) { /* what is left of the way of supports and groups */
        uz_finite_restrict(run->v, &run->at);
        uz_finite_lead(run->trial.u, &run->at, run->v);
        uz_rigid_step(run->trial.u, &run->base, run->at.u, false);
        memcpy(run->at.u, run->trial.u, (size_t)run->n * sizeof *run->near);
    }
    return status;
}

/* Equilibria on the way count as the last one does. */
static uz_status look_for_passing(uz_finite_run *run, double t, uz_error *err)
{
    uz_interpenetration now;
    const uz_status status = uz_find_interpenetration(&now, &run->base, &run->scene, &run->outer, run->at.u, err);
    if (status == UZ_OK && now.depth > run->passed.depth) {
        run->passed = now;
        run->passed_under = t;
    }
    return status;
}

/* Until the whole load is on, or no further part of it holds. Of a way that begins where another one has ended before
 * its whole load nothing is put on. */
static uz_status put_on_all(uz_part *why, double *tried, uz_finite_run *run, uz_error *err)
{
    settled last = {.u = uz_alloc_zero(run->n, sizeof *last.u)};
    uz_finite *found = &run->found;
    double step = 1;
    const uz_finite_point *from = run->from;
    uz_status status = last.u && start_at(&last, from) ? UZ_OK : uz_no_memory(err, "the parts of a load");
    *why = UZ_PART_SETTLED;
    if (status == UZ_OK && from)
        status = go_back(run, &last, 0, err);
    if (status == UZ_OK && from && !from->whole) {
        *why = from->why;
        *tried = from->tried;
        run->stopped = from->stopped;
        step = 0;
    }
    while (status == UZ_OK && found->load < 1 && step >= least_part(run) && found->steps + found->failed < MOST_PARTS) {
        uz_part part = UZ_PART_UNSETTLED;
        const double t = fmin(1.0, found->load + step);
        status = run->near ? begin_near(run, err) : put_on(run, t, err);
        if (status == UZ_OK)
            status = uz_finite_settle(&part, run, err);
        if (status != UZ_OK)
            break;
        if (part == UZ_PART_SETTLED) {
            found->load = t;
            found->steps++;
            found->least_det = run->certificate.least_det;
            found->most = run->step_qps > found->most ? run->step_qps : found->most;
            step *= run->step_qps <= FEW ? 2 : 1;
            status = keep(&last, run) ? UZ_OK : uz_no_memory(err, "the parts of a load");
            if (status == UZ_OK && t < 1)
                status = look_for_passing(run, t, err);
            continue;
        }
        *why = part;
        *tried = t;
        const bool near = run->near; /* then from rest, as if it were not known */
        run->near = NULL;
        found->failed += !near;
        step *= near ? 1 : 0.5;
        status = go_back(run, &last, found->load, err);
        if (status == UZ_OK && found->failed == 1 && found->load == 0 && !from)
            measure_overlap(run);
        if (part == UZ_PART_STOPPED)
            break;
    }
    uz_free_all(last.u, last.r);
    return status;
}

void uz_finite_point_free(uz_finite_point *point)
{
    if (!point)
        return;
    uz_free_all(point->u, point->r, point->loads, point);
}

/* Where run->at is. */
static uz_status take_point(uz_finite_point **out, const uz_finite_run *run, uz_part why, double tried, uz_error *err)
{
    const int64_t own = run->problem->scene.n_loads;
    const bool whole = run->found.load >= 1;
    const double before = run->from ? run->from->part : 0;
    uz_finite_point *point = uz_alloc_zero(1, sizeof *point);
    *out = point;
    if (point) {
        *point = (uz_finite_point){.n = run->n, .n_r = run->n_r, .whole = whole, .why = why, .tried = tried};
        point->n_loads = whole ? own : run->scene.n_loads;
        point->u = uz_alloc(run->n, sizeof *point->u);
        point->r = uz_alloc(run->n_r, sizeof *point->r);
        point->loads = uz_alloc(point->n_loads, sizeof *point->loads);
    }
    if (!point || !point->u || !point->r || !point->loads)
        return uz_no_memory(err, "a point of a path");
    point->part = before + run->found.load * (run->part - before);
    point->certificate = run->certificate;
    if (run->last || run->from)
        point->last = run->last ? run->last->summary : run->from->last;
    point->stopped = run->stopped;
    memcpy(point->u, run->at.u, (size_t)run->n * sizeof *point->u);
    if (run->n_r > 0)
        memcpy(point->r, run->r, (size_t)run->n_r * sizeof *point->r);
    if (point->n_loads > 0)
        memcpy(point->loads, run->scene.loads, (size_t)point->n_loads * sizeof *point->loads);
    return UZ_OK;
}

/* Is the whole load one that presses a body on its obstacles that supports leave free? *out: of one that does not, with
 * UZ_ERR_FREE_BODY, what is told of it beside other cases. */
static uz_status look_for_hold(uz_result **out, uz_finite_run *run, double start, uz_error *err)
{
    uz_error own = {0};
    uz_problem under = *run->problem;
    uz_status status = put_on(run, 1, err);
    if (status == UZ_OK)
        status = uz_finite_check_pressed(run, &own);
    if (status == UZ_OK)
        return UZ_OK;
    if (status == UZ_ERR_FREE_BODY) {
        under.scene = run->scene;
        under.n_quantities = 0;
        const uz_error why = own;
        const uz_status told = uz_tell_unheld(out, &under, &run->settings, &why, start, &own);
        status = told == UZ_OK ? status : told;
        own = told == UZ_OK ? why : own;
    }
    if (err)
        *err = own;
    return status;
}

uz_status uz_solve_finite_load(uz_result **out, const uz_problem *one, const uz_settings *settings,
                               const uz_hooks *hooks, double deadline, const uz_result *small,
                               const uz_finite_path *path, uz_error *err)
{
    uz_finite_run run;
    uz_part why = UZ_PART_SETTLED;
    const double start = uz_seconds();
    double tried = 0;
    uz_status status = begin(&run, one, settings, hooks, deadline, path, err);
    if (status == UZ_OK && run.base.n_modes > 0)
        status = look_for_hold(out, &run, start, err);
    const bool unheld = status == UZ_ERR_FREE_BODY && *out;
    if (status == UZ_OK)
        status = put_on_all(&why, &tried, &run, err);
    if (status == UZ_OK) {
        run.spent.total = uz_seconds() - start;
        status = uz_finite_report(out, &run, why, tried, err);
    }
    if ((status == UZ_OK || unheld) && path && path->to) {
        const uz_status taken = take_point(path->to, &run, why, tried, err);
        status = taken == UZ_OK ? status : taken;
    }
    if (status == UZ_OK && small)
        status = uz_finite_compare(&(*out)->summary.small, &run, *out, small, err);
    end(&run);
    return status;
}

/* The last case that is after case i; 0: none. */
static int64_t last_after(const uz_problem *problem, int64_t i)
{
    int64_t last = problem->n_cases - 1;
    while (last > i && (!problem->cases[last].after[0] || uz_case_before(problem, last) != i))
        last--;
    return last > i ? last : 0;
}

/* points: n_cases, those that later cases need. */
static uz_status solve_case(uz_result **out, uz_finite_point **points, const uz_problem *problem, int64_t i,
                            const double *near, const uz_finite_effort *effort, const uz_settings *settings,
                            const uz_hooks *hooks, double deadline, uz_error *err)
{
    const uz_problem one = uz_problem_of_case(problem, i);
    uz_finite_path path = {.part = 1, .near = near, .effort = effort ? *effort : (uz_finite_effort){0}};
    if (problem->n_cases == 0)
        return uz_solve_finite_load(out, &one, settings, hooks, deadline, NULL, &path, err);
    const uz_load_case *own = &problem->cases[i];
    const int64_t before = own->after[0] ? uz_case_before(problem, i) : -1;
    path.part = own->has_part ? own->part : 1;
    path.from = before >= 0 ? points[before] : NULL;
    path.to = last_after(problem, i) > 0 ? &points[i] : NULL;
    const uz_status status = uz_solve_finite_load(out, &one, settings, hooks, deadline, NULL, &path, err);
    if (status != UZ_OK)
        uz_error_name_case(err, problem, i);
    if (status == UZ_OK && (own->has_part || before >= 0)) {
        const double from = before >= 0 ? points[before]->part : 0;
        (*out)->summary.finite.part = from + (*out)->summary.finite.load * (path.part - from);
    }
    if (before >= 0 && last_after(problem, before) <= i) {
        uz_finite_point_free(points[before]);
        points[before] = NULL;
    }
    return status;
}

uz_status uz_solve_finite(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    (void)starts; /* where small deformation has got to says nothing of it */
    (void)cache;  /* tangents are those of one answer */
    const double started = uz_seconds();
    uz_status status = uz_check_settings(settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(problem, err);
    if (status == UZ_OK)
        status = uz_check_finite_settings(settings, err);
    if (status == UZ_OK)
        status = uz_solve_finite_near(results, problem, settings, NULL, NULL, hooks, err);
    if (status == UZ_OK)
        status = uz_look_at_few_elements(results, problem, settings, NULL, hooks, started, err);
    for (int64_t i = 0; i < (problem->n_cases > 0 ? problem->n_cases : 1) && status == UZ_OK; i++)
        uz_judge_finite(results[i], problem, settings, hooks);
    return status;
}

uz_status uz_solve_finite_near(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                               double *const *near, const uz_finite_effort *effort, const uz_hooks *hooks,
                               uz_error *err)
{
    const int64_t n = problem->n_cases > 0 ? problem->n_cases : 1;
    const double deadline = uz_seconds() + settings->time_limit_s;
    uz_finite_point **points = uz_alloc_zero(n, sizeof *points);
    int64_t unheld = 0;
    uz_error first = {0};
    uz_status status = points ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld load cases", (long long)n);
    for (int64_t i = 0; i < n && status == UZ_OK; i++) {
        if (uz_cancelled(hooks)) {
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before it began");
            break;
        }
        if (hooks && hooks->begins)
            hooks->begins(hooks->ctx, i);
        status =
            solve_case(&results[i], points, problem, i, near ? near[i] : NULL, effort, settings, hooks, deadline, err);
        uz_pass_unheld(&status, &unheld, &first, results[i], n, err);
    }
    for (int64_t i = 0; i < n && points; i++)
        uz_finite_point_free(points[i]);
    free(points);
    return status;
}
