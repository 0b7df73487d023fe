/* finite_newton.c: equilibrium under one part of the load.
 *
 * Each step solves the contact problem of the tangent at the place u_k, in all of the free displacements u:
 *
 *     minimize 1/2 u'K u - (f + K u_k)'u   subject to   h - N u >= 0,        f = loads - internal forces at u_k,
 *
 * K the second derivatives of the energy and of r times the gaps, h and N the gaps and normals where the body is:
 * Newton's method on the conditions of equilibrium with contact, sequential quadratic programming (Nocedal and Wright,
 * "Numerical Optimization", ch. 18). A K that is not positive definite gets stiffness along the pressed rows added,
 * which changes nothing where they stay closed. Where that is not enough, or the step before was so large that its
 * reactions say little, what r times second derivatives of gaps adds is left out, then stiffness of the undeformed
 * body is added: both cost steps; along a path from another case the part is given up there, as the equilibrium
 * beyond may be another one. Where all supports move alike, the body is carried along before the first one.
 * Steps that turn slender parts lead to where these have their length (finite_turn.c).
 * Bodies that only obstacles hold: finite_free.c.
 * After a large step that turns parts K first has the stress that the step was made for (finite_element.c), which takes
 * half of the steps where slender ones do; where it is not positive definite with that the body's own comes next, after
 * other large steps at once, with stiffness along the pressed rows. Steps are
 * shortened until no element turns inside out and the potential energy, with a penalty on negative gaps that exceeds
 * the reactions (ibid., ch. 18.3), is less than it was at one of the last places; but that which moves the supports,
 * whose place has no energy to compare, and those under pressures that follow the body without one: their tangent has
 * a skew part, and steps as in finite_pairs.c. The end is the certificate's to say, and must not be behind an obstacle
 * that the part began in front of. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/blas.h"
#include "linalg/linalg.h"
#include "assembly/parts.h"
#include "cache/parts.h"
#include "obstacle/obstacle.h"
#include "run/setup_cache.h"
#include "run/solve.h"
#include "scene/mesh_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Contact problems of one part, and how often a step is halved. A part is given up after MOST_SHIFTED in a row that
 * stiffness of the undeformed body had to be added to: their steps get smaller slowly (a ring of rubber took all 20 for
 * the whole, the half and the quarter of its load). */
enum { MOST_QPS = 20, MOST_HALVINGS = 6, REMEMBERED = 3, MOST_SHIFTED = 4 };
/* The certificate is asked once steps are less than this part of the energy's norm. */
#define ASKED_FROM 1e-3
/* The certificate was seen to find 1.39 to 170 times what single dofs tell of the forces left over. */
#define LEFT_AT_LEAST 1.3
/* A determinant of F that is next to none. */
#define NEARLY_FLAT 0.2
/* Stiffness along pressed rows, in those of the stiffest dof: from little on, as rows that have to open are held by it,
 * and with much of it open one after the other, a few from step to step. Of 3,900 tangents of generated scenes that
 * were not definite without, a third was so with 0.01, most others with 1, few with 100, and 3 of 1,250 with more. */
#define LEAST_HOLD  1e-2
#define MORE_HOLD   100.0
#define MOST_HOLD   1e2
#define TURNED_HOLD 1e-4 /* of a body that has just turned, whose rows open more often */
/* Stiffness of the undeformed body that is added first, by how much more each time, and less in the next step. */
#define FIRST_SHIFT 0.01
#define MORE_SHIFT  4.0
#define LESS_SHIFT  16.0
#define MOST_SHIFT  1e4
/* Between bodies, whose rows are no derivatives of one energy, steps that are less
 * than this are not measured by it. */
#define NEAR 1e-2
/* Steps that are more than this in the energy's norm may turn slender parts: it is looked at what they do, */
#define TURNING_STEP 0.1
/* and from here on the tangent after them has the stress that they were made for. */
#define LARGE_STEP 0.3
/* Ways of supports that differ by less than this part of the body's extent are the same. */
#define CARRIED 1e-12
/* Chords come after a contact problem whose step was less than this in the energy's norm, and no more than take the
 * next one's time; then the certificate, where their rate leaves less than a part of what is asked for. */
#define CHORD_STEP   0.03
#define CHORD_LEAVES 0.3
enum { MOST_CHORDS = 3 };
/* Along a path: how far its end may be from where the first tangent leads to, in ways there. */
#define MOST_LEAP 1.0

/* ---- one contact problem */

/* Where a row stands: shares of nodes. */
typedef struct {
    int n;
    int64_t node[UZ_FACE_NODES];
    double share[UZ_FACE_NODES], at[3]; /* at: the place */
} row_place;
enum { PLACE_DOFS = 3 * UZ_FACE_NODES };

static row_place place_of_row(const uz_finite_place *place, int64_t row)
{
    const uz_body_model *rows = &place->rows;
    const uz_inner_place *inner = uz_row_inner(rows, row);
    const int dim = rows->mesh.dim;
    row_place out = {.n = inner ? inner->nodes : 1};
    for (int a = 0; a < out.n; a++) {
        out.node[a] = inner ? inner->node[a] : rows->info.contact_node[row];
        out.share[a] = inner ? inner->share[a] : 1;
        for (int c = 0; c < dim; c++)
            out.at[c] += out.share[a] * (rows->mesh.xyz[dim * out.node[a] + c] + place->u[dim * out.node[a] + c]);
    }
    return out;
}

/* Second derivatives of the gap at a place, in displacements of its nodes, times `force`: the normal n turns as the
 * place moves along the obstacle, but along the axis of a cylinder. A place inside a side is one of the material
 * (node_to_obstacle.c), and stays there. */
static void gap_curvature(double ke[PLACE_DOFS * PLACE_DOFS], const row_place *p, const double *n, const uz_gap *gap,
                          double force, int dim)
{
    double turn[3][3];
    for (int i = 0; i < dim; i++)
        for (int j = 0; j < dim; j++)
            turn[i][j] = force * gap->curvature * ((i == j) - n[i] * n[j] - gap->along[i] * gap->along[j]);
    for (int i = 0; i < dim * p->n; i++)
        for (int j = 0; j < dim * p->n; j++)
            ke[i * dim * p->n + j] = p->share[i / dim] * p->share[j / dim] * turn[i % dim][j % dim];
}

/* r g: what curved obstacles add to the tangent. Of middles of eight-node faces a reaction is one of several nodes. */
static uz_status add_curvature(uz_finite_run *run, uz_error *err)
{
    const uz_body_model *rows = &run->at.rows;
    const int dim = rows->mesh.dim;
    uz_status status = UZ_OK;
    double *force = run->n_r == rows->m ? uz_alloc(rows->m, sizeof *force) : NULL;
    if (run->n_r != rows->m)
        return UZ_OK;
    if (!force)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)rows->m);
    uz_row_forces(force, rows, run->r);
    for (int64_t k = 0; k < run->scene.n_contacts && status == UZ_OK; k++) {
        uz_obstacle *obstacle = NULL;
        if (rows->sites[k].n == 0 || run->scene.contacts[k].kind == UZ_OBSTACLE_BODY) /* which turn: row_turn.h */
            continue;
        status = uz_obstacle_new(&obstacle, &run->scene.contacts[k], k, run->scene.model, err);
        for (int64_t i = 0; status == UZ_OK && i < rows->m && !uz_obstacle_has_edges(obstacle); i++) {
            double ke[PLACE_DOFS * PLACE_DOFS];
            uz_gap gap;
            if (rows->info.contact_of[i] != k || force[i] == 0)
                continue;
            const row_place place = place_of_row(&run->at, i);
            if (uz_obstacle_gap(&gap, obstacle, place.at, NULL) != UZ_OK)
                continue;
            gap_curvature(ke, &place, rows->info.contact_normal + dim * i, &gap, force[i], dim);
            uz_add_stiffness(&run->tangent, ke, place.node, place.n);
        }
        uz_obstacle_free(obstacle);
    }
    free(force);
    return status;
}

void uz_finite_move_supports(bool *moved, uz_finite_run *run, const uz_finite_place *at)
{
    const uz_body_model *model = &run->base;
    const int dim = model->mesh.dim;
    *moved = false;
    for (int64_t i = 0; i < run->n; i++) {
        const int64_t dof = model->dof[i];
        if (dof >= 0 || dof == UZ_NO_DOF)
            continue;
        const double *u = at->u + dim * (i / dim);
        const double here = uz_is_rigid(model, i / dim) ? 0 : uz_along_dof(model, i / dim, (int)(i % dim), u);
        const double way = at->given[-1 - dof] - here;
        const uz_csc *fixed = &run->tangent.K_fixed;
        const uz_rigid_group *group = uz_is_rigid(model, i / dim) ? uz_rigid_group_of(model, i / dim) : NULL;
        const double arm = group ? sqrt(uz_distance2(model->mesh.xyz + group->anchor[0] * dim, group->point, dim)) : 0;
        const double rounding = 1e-15 * (fabs(run->prescribed[-1 - dof]) + model->mesh.extent + arm);
        *moved = *moved || fabs(way) > rounding;
        for (int64_t q = fixed->ptr[-1 - dof]; q < fixed->ptr[-dof]; q++)
            run->p[fixed->idx[q]] -= fixed->val[q] * way;
    }
}

/* p: what free dofs are loaded with in the contact problem of all of u. *moved: do supports still have to move? */
static void load_step(bool *moved, uz_finite_run *run)
{
    const uz_finite_place *at = &run->at;
    const uz_body_model *model = &at->turned;
    double *rest = run->trial.force; /* it is free until the next place is looked at */
    for (int64_t i = 0; i < run->n; i++)
        rest[i] = at->loads[i] - at->force[i];
    uz_gather_nodal(run->p, model, rest);
    uz_finite_move_supports(moved, run, at);
    uz_finite_restrict(run->v, at);
    uz_csc_symv(run->p, run->K, 1, run->v);
}

/* A matrix comes once: by its number it need not be read to be known. In a cache of its own its pattern needs a name
 * only, but between bodies, where it changes. */
static uz_status name_matrix(uz_finite_run *run, const uz_csc *K, uz_error *err)
{
    uz_status status = UZ_OK;
    if (run->pairs)
        status = uz_pattern_digest(run->name.pattern, K, err);
    else
        snprintf(run->name.pattern, sizeof run->name.pattern, "tangent");
    snprintf(run->name.values, sizeof run->name.values, "%lld", (long long)run->tangents);
    uz_table_name(run->cache, K, &run->name);
    return status;
}

uz_status uz_finite_acquire(uz_setup **out, uz_finite_run *run, const uz_finite_place *place, uz_error *err)
{
    uz_csc N = {0};
    uz_reuse reused;
    *out = NULL;
    uz_status status = name_matrix(run, run->K, err);
    if (status == UZ_OK)
        status = uz_finite_reduce(&N, run, &place->rows, err);
    if (status == UZ_OK) {
        const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = {*run->K, N, run->p, place->h}};
        status = uz_setup_acquire(out, &reused, run->cache, &problem, NULL, &run->settings, &run->hooks, err);
    }
    uz_csc_clear(&N);
    return status;
}

uz_status uz_finite_solve(uz_result **out, uz_finite_run *run, const uz_qp *qp, double *r, int64_t n_r, uz_error *err)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = *qp};
    const uz_result near = {.m = n_r, .r = r};
    run->settings.time_limit_s = fmax(0.0, run->deadline - uz_seconds());
    uz_status status = name_matrix(run, &qp->K, err);
    if (status == UZ_OK)
        status =
            uz_solve_rounds(out, &problem, &run->settings, NULL, n_r > 0 ? &near : NULL, run->cache, &run->hooks, err);
    if (status == UZ_OK)
        uz_timings_add(&run->spent, &(*out)->summary.timings);
    return status;
}

/* Stiffness `factor` along the rows that were pressed, about their being closed: where they stay closed the answer is
 * the same. Dofs of a row are of one node, or of the nodes of one side, so that K has room for it; between bodies it
 * has been widened. */
static uz_status hold_rows(uz_finite_run *run, double factor, uz_error *err)
{
    uz_csc *K = run->pairs ? &run->wide : &run->tangent.K, rows = {0};
    const uz_body_model *model = &run->at.rows;
    uz_status status = UZ_OK;
    if (run->n_r != model->m || factor == 0)
        return UZ_OK;
    status = uz_csc_transpose(&rows, &model->N, err);
    for (int64_t i = 0; i < model->m && status == UZ_OK; i++)
        for (int64_t p = rows.ptr[i]; p < rows.ptr[i + 1] && run->r[i] < 0; p++)
            for (int64_t q = rows.ptr[i]; q <= p; q++)
                K->val[uz_csc_find(K, rows.idx[p], rows.idx[q])] += factor * rows.val[p] * rows.val[q];
    uz_csc_clear(&rows);
    return status;
}

/* The same in p, whose part K u_k has it at the gaps that there are. */
static void load_rows(uz_finite_run *run, double factor)
{
    const uz_body_model *model = &run->at.rows;
    if (run->n_r != model->m || factor == 0)
        return;
    const uz_csc *N = &model->N;
    for (int64_t j = 0; j < run->d; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            if (run->r[N->idx[q]] < 0)
                run->p[j] += factor * N->val[q] * run->at.gap[N->idx[q]];
}

typedef struct {
    double hold, shift;
    bool straight;
} addition;

/* What a tangent that is not positive definite gets, from nothing on: first stiffness along the pressed rows, as
 * contact may be all that keeps the body stable; then what reactions times the curvature of gaps add is left out of it,
 * which takes most where reactions are too large; then stiffness of the undeformed body, of which what is left from the
 * tangent before is no beginning: with it rows are not held yet. pressed: are there such rows? roughly: their reactions
 * are hardly known, and are not worth being held for. */
static void add_more(addition *add, bool pressed, bool roughly)
{
    if (!pressed || add->straight)
        add->shift = fmax(FIRST_SHIFT, MORE_SHIFT * add->shift);
    else if (roughly || add->hold == MOST_HOLD)
        *add = (addition){.straight = true};
    else
        *add = (addition){.hold = fmin(MOST_HOLD, fmax(LEAST_HOLD, MORE_HOLD * add->hold))};
}

void uz_finite_forget_factors(uz_finite_run *run)
{
    run->tangents++;
    uz_table_forget(run->cache, UZ_ITEM_SETUP); /* which use factors */
    uz_table_forget(run->cache, UZ_ITEM_FACTOR);
}

/* What forces on the nodes of rigid groups do as these turn: of elements less those of loads and of contact. */
static uz_status add_turning(uz_finite_run *run, uz_error *err)
{
    const uz_finite_place *at = &run->at;
    const uz_body_model *rows = &at->rows;
    double *f = uz_alloc(run->n, sizeof *f), *force = uz_alloc(rows->m, sizeof *force);
    if (f && force) {
        for (int64_t i = 0; i < run->n; i++)
            f[i] = at->force[i] - at->loads[i];
        if (run->n_r == rows->m) {
            uz_row_forces(force, rows, run->r);
            uz_push_nodes(f, rows, force);
        }
        uz_rigid_turn_stiffness(&run->tangent, &run->base, at->u, f);
    }
    const bool room = f && force;
    uz_free_all(f, force);
    return room ? UZ_OK : uz_no_memory(err, "the forces on rigid groups");
}

/* At run->at, with nothing added; straight: what gaps bend left out. */
static uz_status find_tangent(uz_finite_run *run, const double *step, bool straight, uz_error *err)
{
    run->tangent.follow = run->at.turned.follow;
    uz_finite_body(&run->at.body, NULL, &run->tangent, &run->base, run->free_strain, run->at.u, step);
    uz_status status = straight ? UZ_OK : add_curvature(run, err);
    if (status == UZ_OK && run->base.n_rigid > 0)
        status = add_turning(run, err);
    return status == UZ_OK && run->follows ? uz_follower_tangent(&run->tangent, &run->skew, &run->scene, run->at.u, err)
                                           : status;
}

uz_status uz_finite_hold_tangent(uz_finite_run *run, double hold, uz_error *err)
{
    const uz_stop stop = {&run->hooks, run->deadline};
    uz_status status = UZ_OK;
    uz_row_turn_clear(&run->turn);
    run->K = &run->tangent.K;
    uz_finite_forget_factors(run);
    if (run->pairs && run->n_r == run->at.rows.m)
        status = uz_row_turn_find(&run->turn, &run->base, &run->at.rows, &run->scene, run->r, 0, &stop, err);
    if (status == UZ_OK)
        status = find_tangent(run, NULL, false, err);
    if (status == UZ_OK && run->pairs)
        status = uz_finite_widen(run, hold > 0, err);
    return status == UZ_OK ? hold_rows(run, hold, err) : status;
}

/* Or not known. */
static bool is_more(double norm, double than)
{
    return !(norm > 0) || norm > than;
}

/* Was the step to run->at large? While supports move, by what it has changed the root of the energy by. */
static bool was_large(const uz_finite_run *run)
{
    const double here = sqrt(run->at.body.energy), before = sqrt(run->trial.body.energy);
    return run->step_qps > 0 && (isinf(run->norm) ? fabs(here - before) > LARGE_STEP * here : run->norm > LARGE_STEP);
}

/* Stiffness along pressed rows without which more than half of the tangents are not positive definite, each of which
 * would take a factorization to be seen. Between bodies K would have to be widened for it. Bodies that only obstacles
 * hold (finite_free.c) are not stable without. */
static double hold_at_once(const uz_finite_run *run, bool as_stepped)
{
    if (run->turned)
        return TURNED_HOLD;
    const bool may_do = as_stepped || run->pairs || !is_more(run->norm, LARGE_STEP);
    return may_do && run->base.n_modes == 0 ? 0 : LEAST_HOLD;
}

static uz_status solve_definite(bool *moved, uz_finite_run *run, uz_error *err)
{
    uz_csc *K = &run->tangent.K;
    const uz_stop stop = {&run->hooks, run->deadline};
    uz_error own = {0};
    uz_status status = UZ_ERR_NOT_SPD;
    uz_status found = UZ_OK;
    uz_row_turn_clear(&run->turn);
    if (run->pairs && run->n_r == run->at.rows.m)
        found = uz_row_turn_find(&run->turn, &run->base, &run->at.rows, &run->scene, run->r, 0, &stop, err);
    run->K = K;
    if (found != UZ_OK)
        return found;
    /* from there on each digit counts; of the step from a place without energy the norm is not known */
    run->settings.step = !(run->norm < CHORD_STEP) || (run->step_qps == 1 && run->norm == 0);
    const double stiffest = run->stiffest;
    const bool leans = run->base.n_modes > 0; /* on rows, which have to hold it, however hard they are pressed */
    const bool at_rest = leans && run->step_qps == 0 && run->n_r == 0 && !run->near;
    const bool roughly = !leans && was_large(run);
    addition add = {.hold = roughly ? 0 : run->hold, .shift = run->shift / LESS_SHIFT};
    add.shift = add.shift < FIRST_SHIFT ? 0 : add.shift;
    double held = 0, shifted = 0; /* what the tangent has of them */
    bool pressed = false, more = true, fresh = true;
    double *step =
        run->step_qps > 0 && add.shift == 0 && is_more(run->norm, LARGE_STEP) && !run->turned && !run->unturned
            ? run->step
            : NULL; /* run->trial is the place before */
    for (int64_t i = 0; i < run->n && step; i++)
        step[i] = run->at.u[i] - run->trial.u[i];
    for (int64_t i = 0; i < run->n_r && run->n_r == run->at.rows.m; i++)
        pressed = pressed || run->r[i] < 0;
    if (pressed && !roughly && add.hold == 0 && (add.shift == 0 || leans))
        add.hold = hold_at_once(run, step != NULL);
    while (more && (status == UZ_ERR_NOT_SPD || status == UZ_ERR_FREE_BODY)) {
        const double start = uz_seconds();
        uz_finite_forget_factors(run);
        uz_error_reset(&own);
        status = fresh ? find_tangent(run, step, add.straight, &own) : UZ_OK;
        if (fresh)
            held = shifted = 0;
        if (fresh && at_rest)
            uz_finite_begin_free(run);
        for (int64_t q = 0; q < K->ptr[K->cols] && add.shift > shifted; q++)
            K->val[q] += (add.shift - shifted) * run->base.K.val[q];
        if (fresh)
            uz_finite_hold_free(run, NULL);
        if (status == UZ_OK && run->pairs)
            status = uz_finite_widen(run, add.hold > 0, &own);
        if (status == UZ_OK)
            status = hold_rows(run, (run->pairs ? add.hold : add.hold - held) * stiffest, &own);
        run->spent.assemble += uz_seconds() - start;
        if (status != UZ_OK)
            break;
        run->hold = held = add.hold; /* before corrections, which need it */
        run->shift = shifted = add.shift;
        load_step(moved, run);
        load_rows(run, add.hold * stiffest);
        status = uz_finite_solve_qp(run, &own);
        run->step_qps += status == UZ_OK;
        if (status == UZ_OK && (run->turn.force.n > 0 || run->skew.ptr))
            status = uz_finite_correct(run, &own);
        const bool was_straight = add.straight;
        if (!step)
            add_more(&add, pressed, roughly);
        fresh = step || add.straight != was_straight;
        if (add.straight)
            uz_row_turn_clear(&run->turn);
        /* a path goes from one stable equilibrium to the next one */
        more = add.shift <= (run->from ? 0 : MOST_SHIFT) && !(run->from && add.straight);
        step = NULL;
    }
    if (status == UZ_OK) {
        run->found.held += run->hold > 0 && run->shift == 0;
        run->found.shifted += run->shift > 0;
    } else if (err) {
        *err = own;
    }
    return status;
}

/* ---- the step */

static double merit(const uz_finite_run *run, const uz_finite_place *place)
{
    double work = place->work;
    for (int64_t i = 0; i < run->n && !run->follows; i++)
        work += run->loads[i] * place->u[i];
    return place->body.energy - work + run->penalty * place->violation;
}

/* Of loads that follow, on the straight way from `at`, by their mean. */
static void find_work(uz_finite_run *run)
{
    uz_finite_place *to = &run->trial;
    const uz_finite_place *from = &run->at;
    to->work = from->work;
    for (int64_t i = 0; i < run->n && run->follows; i++)
        to->work += 0.5 * (from->loads[i] + to->loads[i]) * (to->u[i] - from->u[i]);
}

/* trial becomes `part` of the step from `at` to `to`, turned where it has to be. */
static uz_status find_part(bool *fits, uz_finite_run *run, const double *to, double part, uz_error *err)
{
    uz_status status = UZ_OK;
    run->turned = !run->pairs && !run->base.spring && is_more(run->norm, TURNING_STEP);
    run->unturned = false;
    bool again = true;
    *fits = false;
    while (status == UZ_OK && again) {
        for (int64_t i = 0; i < run->n; i++)
            run->trial.u[i] = part == 1 ? to[i] : run->at.u[i] + part * (to[i] - run->at.u[i]);
        if (run->turned)
            status = uz_finite_turn(&run->turned, run, err);
        if (!run->turned)
            uz_rigid_step(run->trial.u, &run->base, run->at.u, false);
        if (status == UZ_OK)
            status = uz_finite_place_find(fits, &run->trial, run, err);
        again = run->turned && !*fits; /* straight on, then */
        run->turned = run->turned && *fits;
    }
    return status;
}

/* trial becomes a part of the way from `at` to `to`, the largest that is let. before: merits of the last places, of
 * which one must be above; NULL: any will do. */
static uz_status step_towards(bool *found, bool *inverted, uz_finite_run *run, const double *to, const double *before,
                              int remembered, uz_error *err)
{
    uz_status status = UZ_OK;
    double most = -INFINITY, part = 1;
    *found = *inverted = false;
    for (int k = 0; k < remembered && before; k++)
        most = fmax(most, before[k]);
    for (int k = 0; k <= (before ? MOST_HALVINGS : 0) && status == UZ_OK && !*found; k++, part *= 0.5) {
        status = find_part(found, run, to, part, err);
        *inverted = status == UZ_OK && !*found;
        find_work(run);
        if (status == UZ_OK && *found && before)
            *found = merit(run, &run->trial) <= most + 1e-10 * (fabs(most) + run->trial.body.energy) + run->grain;
    }
    return status;
}

/* Has the new place the rows of the problem that led to it? */
static bool same_rows(const uz_body_model *a, const uz_body_model *b)
{
    const size_t bytes = (size_t)a->m * sizeof(int64_t);
    return a->m == b->m && memcmp(a->info.contact_node, b->info.contact_node, bytes) == 0 &&
           memcmp(a->info.contact_of, b->info.contact_of, bytes) == 0;
}

static void take_trial(uz_finite_run *run)
{
    const uz_finite_place old = run->at;
    run->at = run->trial;
    run->trial = old;
}

/* About the least that the certificate may find of forces left over at run->at, by the last tangent K: (f'x)^2 / x'K x
 * <= f'K^-1 f for every x, here that of each dof by itself with those of pressed rows held. 0: not known. */
static double least_left(uz_finite_run *run)
{
    const uz_finite_place *at = &run->at;
    const uz_csc *N = &at->rows.N;
    double *rest = run->trial.force, *f = run->p, *x = run->v; /* free until the next step */
    if (at->body.energy <= 10 * run->grain)
        return 0;
    for (int64_t i = 0; i < run->n; i++)
        rest[i] = at->loads[i] - at->force[i];
    uz_gather_nodal(f, &at->turned, rest);
    uz_csc_gaxpy_t(f, N, 1, run->r);
    for (int64_t j = 0; j < run->d; j++) {
        x[j] = f[j] / run->K->val[run->K->ptr[j]];
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            x[j] = run->r[N->idx[q]] < 0 ? 0 : x[j];
    }
    memset(run->Kv, 0, (size_t)run->d * sizeof *run->Kv);
    uz_csc_symv(run->Kv, run->K, 1, x);
    const double square = uz_dot(run->d, x, run->Kv), work = uz_dot(run->d, f, x);
    return square > 0 ? work / sqrt(2 * square * at->body.energy) : 0;
}

/* Is the certificate worth its time? Not while steps become smaller, and forces are left that it would not pass.
 * before: the norm of the step before the last one. */
static bool may_be_settled(uz_finite_run *run, double before)
{
    if (!(run->norm < ASKED_FROM) || run->turned)
        return false;
    const bool approaches = run->norm == 0 || run->norm < 0.5 * before;
    return !approaches || run->step_qps == MOST_QPS || LEFT_AT_LEAST * least_left(run) <= run->requested;
}

/* What the certificate says of run->at. *done: it is not to be iterated further. */
static uz_status ask_certificate(bool *done, uz_part *out, uz_finite_run *run, uz_error *err)
{
    const uz_finite_answer answer = {&run->at.rows, &run->base,  &run->scene,     run->at.u,
                                     run->r,        run->at.gap, run->prescribed, run->free_strain};
    uz_finite_certificate *c = &run->certificate;
    const double start = uz_seconds();
    const uz_stop stop = {&run->hooks, run->deadline};
    uz_finite_forget_factors(run); /* its own takes more */
    const uz_status status = uz_certify_finite(c, &answer, &stop, err);
    run->spent.certify += uz_seconds() - start;
    const double length = 1e-9 * run->base.mesh.extent;
    *done = true;
    if (status != UZ_OK)
        return status;
    if (c->stopped) {
        run->stopped = uz_cancelled(&run->hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT;
        *out = UZ_PART_STOPPED;
    } else if (!(c->least_det > 0))
        *out = UZ_PART_INVERTED;
    else if (c->swallows)
        *out = UZ_PART_SWALLOWED;
    else if (!c->definite)
        *out = UZ_PART_INDEFINITE;
    else if (!(c->residual <= fmax(run->requested, c->rounding)) || c->worst_support > length ||
             c->least_at_rows < -length || (run->load >= 1 && c->least_at_nodes < -length) || c->worst_reaction > 0)
        *done = false;
    else
        *out = UZ_PART_SETTLED;
    return status;
}

static uz_part why_stopped(uz_finite_run *run)
{
    switch (run->last->summary.outcome) {
    case UZ_CONVERGED:
    case UZ_PRECISION_LIMIT:
        return UZ_PART_SETTLED;
    case UZ_INFEASIBLE:
    case UZ_OUT_OF_REACH:
        return UZ_PART_CONTRADICTORY;
    default:
        run->stopped = run->last->summary.outcome;
        return UZ_PART_STOPPED;
    }
}

/* Before a contact problem; run->stopped says why. */
static bool has_to_stop(uz_finite_run *run)
{
    const bool enough = run->effort.qps > 0 && run->found.qps >= run->effort.qps;
    const uz_stop stop = {&run->hooks, run->deadline};
    if (!enough && !uz_stop_is_due(&stop))
        return false;
    run->stopped = enough ? UZ_ITERATION_LIMIT : uz_cancelled(&run->hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT;
    return true;
}

static uz_status keep_reactions(uz_finite_run *run, uz_error *err)
{
    const int64_t m = run->last->m;
    free(run->r);
    run->r = uz_alloc(m, sizeof *run->r);
    run->n_r = run->r ? m : 0;
    if (!run->r)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)m);
    for (int64_t i = 0; i < m; i++) {
        run->r[i] = run->last->r[i];
        run->penalty = fmax(run->penalty, -1.5 * run->r[i]);
    }
    return UZ_OK;
}

double uz_finite_step_norm(uz_finite_run *run)
{
    uz_finite_restrict(run->v, &run->at);
    for (int64_t j = 0; j < run->d; j++)
        run->v[j] = run->last->u[j] - run->v[j];
    return uz_finite_norm(run);
}

double uz_finite_norm(uz_finite_run *run)
{
    memset(run->Kv, 0, (size_t)run->d * sizeof *run->Kv);
    uz_csc_symv(run->Kv, run->K, 1, run->v);
    const double square = fmax(0, uz_dot(run->d, run->v, run->Kv));
    return square == 0 || run->at.body.energy <= 10 * run->grain ? 0 : sqrt(square / (2 * run->at.body.energy));
}

/* What passes a point where it is not stable may well turn inside out behind it, and is to be called unstable; but not
 * where elements had become flat before. */
static bool is_nearly_flat(const uz_finite_run *run)
{
    return run->found.steps > 0 && run->found.least_det < NEARLY_FLAT;
}

/* A path that goes over a limit load leaps: much farther than the tangent of where it was led. begun, led: n. */
static bool leaps(const uz_finite_run *run, const double *begun, const double *led)
{
    double off = 0, way = 0;
    for (int64_t i = 0; i < run->n && run->from; i++) {
        off += (run->at.u[i] - led[i]) * (run->at.u[i] - led[i]);
        way += (led[i] - begun[i]) * (led[i] - begun[i]);
    }
    return off > MOST_LEAP * MOST_LEAP * way + run->base.mesh.extent * run->base.mesh.extent * 1e-16;
}

/* The axis that a node's dof is along, or against it (*sign); -1: none. */
static int axis_of(double *sign, const uz_body_model *model, int64_t node, int c)
{
    const int dim = model->mesh.dim;
    const double *frame = uz_node_frame(model, node);
    int axis = frame ? -1 : c;
    *sign = 1;
    for (int k = 0; frame && k < dim; k++)
        if (fabs(frame[dim * c + k]) > 1 - CARRIED) {
            axis = k;
            *sign = copysign(1, frame[dim * c + k]);
        }
    return axis;
}

/* Where all supports of a part of the mesh still have to go the same way, it is carried along before anything else:
 * contact is where it comes to, and the first problem would otherwise be that of where it was. Not after a part of the
 * load that failed, which may have been led through an obstacle so, nor of rings, which have no way but along their
 * axis. to (n): run->at with that; *carried: is there any? */
static uz_status find_carried(bool *carried, double *to, const uz_finite_run *run, uz_error *err)
{
    const uz_body_model *model = &run->base;
    const uz_mesh *mesh = &model->mesh;
    const int dim = mesh->dim;
    int64_t *part = uz_alloc(mesh->n_nodes, sizeof *part);
    int64_t parts = part ? uz_mesh_number_parts(part, mesh) : -1;
    double *way = parts < 0 ? NULL : uz_alloc(3 * parts, sizeof *way); /* along each axis; NaN: not known */
    bool *alike = way ? uz_alloc(parts, sizeof *alike) : NULL;
    *carried = false;
    if (alike && model->tied.share.ptr) { /* what is tied goes together */
        memset(part, 0, (size_t)mesh->n_nodes * sizeof *part);
        parts = 1;
    }
    for (int64_t i = 0; i < 3 * parts && alike; i++) {
        way[i] = NAN;
        alike[i / 3] = true;
    }
    for (int64_t i = 0; i < run->n && alike; i++) {
        const int64_t dof = model->dof[i], node = i / dim;
        const int c = (int)(i % dim);
        double sign;
        if (dof >= 0 || dof == UZ_NO_DOF || !alike[part[node]])
            continue;
        const int axis = axis_of(&sign, model, node, c);
        alike[part[node]] = axis >= 0;
        if (axis < 0)
            continue;
        double *known = &way[3 * part[node] + axis];
        const double own = sign * (run->prescribed[-1 - dof] - uz_along_dof(model, node, c, run->at.u + dim * node));
        *known = isnan(*known) ? own : *known;
        alike[part[node]] = fabs(own - *known) <= CARRIED * mesh->extent;
    }
    for (int64_t i = 0; i < run->n && alike; i++) {
        const int64_t dof = model->dof[i], of = part[i / dim];
        const double own = way[3 * of + i % dim];
        const bool goes = alike[of] && fabs(own) > 0;
        const bool exact = dof < 0 && dof != UZ_NO_DOF && !uz_node_frame(model, i / dim);
        to[i] = !goes ? run->at.u[i] : exact ? run->prescribed[-1 - dof] : run->at.u[i] + own;
        *carried = *carried || goes;
    }
    const bool room = alike;
    uz_free_all(part, way, alike);
    return room ? UZ_OK : uz_no_memory(err, "the parts of a body");
}

/* May all places of rows at run->at go straight to `to`, past rigid obstacles? */
static uz_status may_be_carried(bool *may, uz_finite_run *run, const double *to, uz_error *err)
{
    const uz_body_model *rows = &run->at.rows;
    const int dim = rows->mesh.dim;
    uz_status status = UZ_OK;
    for (int64_t k = 0; k < run->scene.n_contacts && status == UZ_OK && *may; k++) {
        uz_obstacle *obstacle = NULL;
        const uz_obstacle_kind kind = run->scene.contacts[k].kind;
        if (kind == UZ_OBSTACLE_BODY || kind == UZ_OBSTACLE_PLANE) /* nothing is behind a plane */
            continue;
        status = uz_obstacle_new(&obstacle, &run->scene.contacts[k], k, run->scene.model, err);
        for (int64_t i = 0; status == UZ_OK && i < rows->m && *may; i++) {
            const row_place place = place_of_row(&run->at, i);
            double way[3] = {0};
            for (int a = 0; a < place.n; a++)
                for (int c = 0; c < dim; c++)
                    way[c] += place.share[a] * (to[dim * place.node[a] + c] - run->at.u[dim * place.node[a] + c]);
            *may =
                rows->info.contact_of[i] != k || !(uz_dot3(way, way) > 0) || uz_finite_may_go(obstacle, place.at, way);
        }
        uz_obstacle_free(obstacle);
    }
    return status;
}

/* From run->at, which is `begun` and whose rows are known. *fits: as of uz_finite_place_find. to: n, room. What comes
 * out beside another body, past its corner, is carried only where something is still in the way. */
static uz_status carry(bool *fits, uz_finite_run *run, const double *begun, double *to, uz_error *err)
{
    bool carried = false, clear = true;
    if (run->found.failed > 0 || run->base.n_rigid > 0 || run->base.kind == UZ_AXISYMMETRIC)
        return UZ_OK;
    uz_status status = find_carried(&carried, to, run, err);
    if (status == UZ_OK && carried)
        status = may_be_carried(&carried, run, to, err);
    if (status == UZ_OK && carried && run->pairs)
        status = uz_finite_may_pass(&carried, run, begun, to, false, err);
    if (status != UZ_OK || !carried)
        return status;
    memcpy(run->at.u, to, (size_t)run->n * sizeof *to);
    status = uz_finite_place_find(fits, &run->at, run, err);
    if (status == UZ_OK && *fits && run->pairs && run->at.violation == 0)
        status = uz_finite_may_pass(&clear, run, begun, to, true, err);
    if (status != UZ_OK || (*fits && clear))
        return status;
    memcpy(run->at.u, begun, (size_t)run->n * sizeof *begun);
    return uz_finite_place_find(fits, &run->at, run, err);
}

/* Of a part that has settled: it is unsettled where it may not have gone there. */
static uz_status look_back(uz_part *out, const uz_finite_run *run, const double *begun, const double *led,
                           uz_error *err)
{
    bool may = true;
    const uz_status status = uz_finite_may_pass(&may, run, begun, run->at.u, false, err);
    if (!may || leaps(run, begun, led))
        *out = UZ_PART_UNSETTLED;
    return status;
}

/* From where a contact problem has led to, by chords (finite_chord.c), unless their rate says that they don't get to
 * what is asked for; *done as of ask_certificate. That of the first one is no rate yet. to (n): room. */
static uz_status follow_chords(bool *done, uz_part *out, uz_finite_run *run, double *to, uz_error *err)
{
    const bool plain = !run->pairs && !run->skew.ptr && run->shift == 0 && !run->turned;
    uz_setup *setup = NULL;
    bool goes_on = plain && run->norm > 0 && run->norm < CHORD_STEP, asked = false;
    if (!goes_on)
        return UZ_OK;
    double *r = uz_alloc(run->n_r, sizeof *r);
    uz_status status = r ? uz_finite_acquire(&setup, run, &run->trial, err)
                         : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)run->n_r);
    if (status == UZ_OK && run->settings.step && setup->factor) /* that of the last contact problem is told */
        status = uz_factor_estimate_rcond(&run->last->summary.rcond, setup->factor, run->K, err);
    for (int k = MOST_CHORDS; status == UZ_OK && goes_on && k > 0; k--) {
        double now;
        status = uz_finite_chord(&goes_on, &now, to, r, run, setup, err);
        const double rate = now / run->norm;
        if (status != UZ_OK || !goes_on)
            break;
        goes_on = rate < 1 && now * pow(rate, k) <= run->requested;
        if (goes_on)
            status = find_part(&goes_on, run, to, 1, err);
        if (status != UZ_OK || !goes_on || !same_rows(&run->at.rows, &run->trial.rows))
            break;
        take_trial(run);
        run->norm = now;
        for (int64_t i = 0; i < run->n_r; i++)
            run->r[i] = r[i];
        asked = k < MOST_CHORDS && now * rate <= CHORD_LEAVES * run->requested;
        goes_on = !asked;
    }
    uz_setup_release(run->cache, setup); /* before the certificate, which takes its memory */
    free(r);
    return status == UZ_OK && asked ? ask_certificate(done, out, run, err) : status;
}

uz_status uz_finite_settle(uz_part *out, uz_finite_run *run, uz_error *err)
{
    double before[REMEMBERED] = {0};
    int remembered = 0, in_a_row = 0;
    double *to = uz_alloc(run->n, sizeof *to), *begun = uz_alloc(run->n, sizeof *begun),
           *led = uz_alloc(run->n, sizeof *led);
    uz_status status = to && begun && led ? UZ_OK
                                          : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a step of %lld nodes",
                                                    (long long)run->base.mesh.n_nodes);
    bool done = false, fits = true;
    const int64_t shifted = run->found.shifted;
    *out = UZ_PART_UNSETTLED;
    run->penalty = run->hold = run->shift = 0;
    run->norm = INFINITY;
    run->step_qps = 0;
    run->turned = false;
    run->at.work = 0;
    uz_candidates_clear(&run->kept);
    if (status == UZ_OK)
        memcpy(begun, run->at.u, (size_t)run->n * sizeof *begun);
    if (status == UZ_OK) {
        status = uz_finite_place_find(&fits, &run->at, run, err); /* supports have moved */
        if (status == UZ_OK && fits)
            status = carry(&fits, run, begun, to, err);
    }
    while (status == UZ_OK && fits && !done && run->step_qps < MOST_QPS) {
        bool moved = false, found = false, inverted = false;
        if (has_to_stop(run)) {
            *out = UZ_PART_STOPPED;
            break;
        }
        status = solve_definite(&moved, run, err);
        if (status == UZ_ERR_NOT_SPD || status == UZ_ERR_FREE_BODY) { /* whatever is added */
            status = UZ_OK;
            break;
        }
        if (status != UZ_OK)
            break;
        const uz_part ended = why_stopped(run);
        if (ended != UZ_PART_SETTLED) {
            *out = ended;
            break;
        }
        status = keep_reactions(run, err);
        in_a_row = run->shift > 0 ? in_a_row + 1 : 0;
        if (status != UZ_OK || in_a_row == MOST_SHIFTED)
            break;
        const double last_norm = run->norm, norm = run->norm = moved ? (double)INFINITY : uz_finite_step_norm(run);
        uz_finite_lead(to, &run->at, run->last->u);
        if (run->step_qps == 1)
            memcpy(led, to, (size_t)run->n * sizeof *led);
        const bool free_step = moved || run->step_qps == 1 || run->skew.ptr || (run->pairs && norm < NEAR);
        if (!free_step) {
            memmove(before + 1, before, (REMEMBERED - 1) * sizeof *before);
            before[0] = merit(run, &run->at);
            remembered = remembered < REMEMBERED ? remembered + 1 : REMEMBERED;
        }
        status = step_towards(&found, &inverted, run, to, free_step ? NULL : before, remembered, err);
        if (status != UZ_OK || !found) {
            *out = inverted && (run->found.shifted == shifted || is_nearly_flat(run)) ? UZ_PART_INVERTED
                                                                                      : UZ_PART_UNSETTLED;
            break;
        }
        bool comparable = same_rows(&run->at.rows, &run->trial.rows);
        take_trial(run);
        if (!comparable && run->pairs) {
            status = uz_finite_carry_reactions(run, &run->trial.rows, err);
            comparable = status == UZ_OK;
        }
        if (status == UZ_OK && comparable && may_be_settled(run, last_norm))
            status = ask_certificate(&done, out, run, err);
        else if (status == UZ_OK && comparable)
            status = follow_chords(&done, out, run, to, err);
    }
    if (status == UZ_OK && *out == UZ_PART_SETTLED)
        status = look_back(out, run, begun, led, err);
    uz_free_all(to, begun, led);
    return status;
}
