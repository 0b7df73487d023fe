/* moving.c: contact where the answer itself moves the surfaces to.
 *
 * A pass finds gaps, normals and what faces what where the body has been displaced by x_k, and solves the contact
 * problem that is linear about this place: u_k = T(x_k), a convex problem in all of u, on the same K and its factor.
 * An answer that stays where its contacts were found, x = T(x), has the gaps of the deformed body exactly. Material and
 * strains stay linear. The first place is that of the answer before anything moved, then x_k+1 = x_k + w (u_k - x_k).
 *
 * What is left. Steps get smaller by c = ||x_k+1 - x_k|| / ||x_k - x_k-1||, so that those to come sum up to c / (1 - c)
 * times the last. w = 1 unless they do not get smaller, or steadily by little: a node that a pass sends from one face
 * to another and back is caught by shorter steps, and what creeps by longer ones, as long as the last two differences
 * T(x) - x say (Irons and Tuck, IJNME 1 (1969) 275-277:
 * Aitken's rule for vectors, here in the inner product of K). Errors are in the energy norm. */
#include "run/moving.h"

#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "linalg/blas.h"
#include "methods/milestones.h"
#include "post/balance.h"
#include "run/results.h"
#include "run/setup_cache.h"
#include "run/solve.h"
#include "run/transfer.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_PASSES = 30 };

/* `auto` looks at what another pass would change where gaps or normals are off by more than the first of these, and
 * goes on where that is more than the second. Of answers that need no further pass it is 1 % and less, of those that
 * are wrong without them 27 % and more. */
#define TRIED     0.02
#define TOLERABLE UZ_MOST_SLIDING

/* Steps are no longer whole ones where differences do not get smaller than SLOW times the last, or twice by the same
 * factor, but for a part STEADY of it, that is more than CREEPING. */
#define SLOW       0.9
#define CREEPING   0.5
#define STEADY     0.05
#define LEAST_STEP 0.05
#define MOST_STEP  4.0

typedef struct {
    uz_problem problem; /* at `place` */
    uz_settings settings;
    uz_cache *cache, *own_cache;
    uz_hooks hooks;
    double deadline;
    uz_setup *base; /* at no place: K */
    double *place;  /* n: where the pass finds its contacts */
    double *v, *Kv; /* d: what the last pass changed, T(x) - x, and K times it */
    double *before; /* d: the v before */
    int64_t n, passes;
    double norm;                   /* of the answer before, by its certificate */
    double step, change, ratio[2]; /* w; what the last pass changed; the last two ratios of these, 0: unknown */
} moving;

/* Is there anything to do? Obstacles that are planes are the same everywhere. */
static bool is_asked(const uz_result *result, const uz_problem *problem)
{
    const uz_scene *scene = &problem->scene;
    const uz_summary *s = &result->summary;
    bool changes = false;
    if (problem->kind != UZ_PROBLEM_SCENE || scene->kinematics == UZ_KINEMATICS_FIXED || s->outcome != UZ_CONVERGED ||
        s->semicoercive.free_modes > 0 || uz_has_finite_law(scene)) /* which have another way (weigh.c) */
        return false;
    for (int64_t k = 0; k < scene->n_contacts; k++)
        changes = changes || scene->contacts[k].kind != UZ_OBSTACLE_PLANE;
    return changes && (scene->kinematics == UZ_KINEMATICS_MOVING || s->geometry.sliding > TRIED);
}

static uz_status prepare(moving *m, const uz_result *first, const uz_problem *problem, const uz_settings *settings,
                         uz_cache *cache, uz_error *err)
{
    uz_reuse ignored;
    m->problem = *problem;
    m->settings = *settings;
    m->cache = cache;
    m->passes = 1;
    m->step = 1;
    m->norm = first->summary.certificate.energy_norm;
    m->n = first->n_nodes * first->mesh.dim;
    if (!cache && !(m->cache = m->own_cache = uz_cache_new(SIZE_MAX)))
        return uz_no_memory(err, "a cache");
    uz_status status = uz_setup_acquire(&m->base, &ignored, m->cache, problem, NULL, settings, &m->hooks, err);
    if (status != UZ_OK)
        return status;
    m->place = uz_alloc(m->n, sizeof *m->place);
    m->v = uz_alloc(m->base->model.d, sizeof *m->v);
    m->Kv = uz_alloc(m->base->model.d, sizeof *m->Kv);
    m->before = uz_alloc_zero(m->base->model.d, sizeof *m->before);
    if (!m->place || !m->v || !m->Kv || !m->before)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the place of %lld nodes", (long long)first->n_nodes);
    memcpy(m->place, first->u, (size_t)m->n * sizeof *m->place);
    m->problem.scene.place = m->place;
    return UZ_OK;
}

/* ||u - place||_K by the norm of the certificate, or by that of the answer before: of one that only supports carry, and
 * nothing deforms, it is the way that they go. Both answers have what supports prescribe. */
static double change_by(moving *m, const uz_result *result)
{
    const uz_csc *K = &m->base->model.K;
    double *nodal = uz_alloc(m->n, sizeof *nodal);
    if (!nodal)
        return NAN;
    for (int64_t i = 0; i < m->n; i++)
        nodal[i] = result->u[i] - m->place[i];
    uz_restrict_nodal(m->v, &m->base->model, nodal);
    free(nodal);
    memset(m->Kv, 0, (size_t)K->cols * sizeof *m->Kv);
    uz_csc_symv(m->Kv, K, 1.0, m->v);
    const double square = fmax(0.0, uz_dot(K->cols, m->v, m->Kv)), before = m->norm;
    m->norm = result->summary.certificate.energy_norm;
    const double least = fmin(before, m->norm);
    return square > 0.0 ? sqrt(square) / (least > 0.0 ? least : fmax(before, m->norm)) : 0.0;
}

/* The next answer takes the place of the last, with the time that both took. Whoever goes on from it begins where
 * nothing has moved, with the rows that there are; without memory for their reactions nobody can. */
static void replace(uz_result **result, uz_result *next, const moving *m)
{
    uz_result *last = *result;
    uz_timings_add(&next->summary.timings, &last->summary.timings);
    uz_trade_shift(&next->trade, last->summary.timings.total);
    next->summary.reused = last->summary.reused; /* of the body, which the first solve made */
    next->summary.factor_cached = last->summary.factor_cached;
    next->summary.origin = last->summary.origin == UZ_FROM_ZERO ? UZ_FROM_ZERO : UZ_FROM_REACTIONS; /* the caller's */
    next->summary.geometry.kind = UZ_KINEMATICS_MOVING;
    next->summary.geometry.passes = m->passes;
    uz_state_free(next->state);
    next->state = NULL;
    (void)uz_carry_start(&next->state, next, &m->base->model.info, m->base->model.m, true, NULL);
    uz_result_free(last);
    *result = next;
}

/* How the pass that led to *result leaves the place, and where the next one finds its contacts. */
static uz_status judge(bool *settled, moving *m, uz_result *result, uz_error *err)
{
    uz_summary *s = &result->summary;
    const double change = change_by(m, result), before = m->change;
    if (isnan(change))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the place of %lld nodes", (long long)result->n_nodes);
    result->place = uz_alloc(m->n, sizeof *result->place);
    if (!result->place)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the place of %lld nodes", (long long)result->n_nodes);
    memcpy(result->place, m->place, (size_t)m->n * sizeof *m->place);
    m->change = change;
    m->ratio[1] = m->ratio[0];
    m->ratio[0] = before > 0.0 ? change / before : 0.0;
    /* One ratio may be small by chance; before there is one, steps that halve are assumed. */
    const double c = m->ratio[0] > 0.0 ? fmax(m->ratio[0], m->ratio[1]) : 0.5;
    const double left = c < 1.0 ? (fabs(1.0 - m->step) + m->step * c / (1.0 - c)) * change : (double)INFINITY;
    /* changes of the size of what the passes themselves leave say nothing */
    const double noise = 4.0 * s->certificate.relative_error;
    s->geometry.change = change;
    s->geometry.left = change > 0.0 ? left : 0.0;
    *settled = !(s->geometry.left > s->requested_error) || change <= noise;
    const bool creeps = m->ratio[0] > CREEPING && fabs(m->ratio[0] - m->ratio[1]) < STEADY * m->ratio[0];
    if (m->ratio[0] >= SLOW || creeps || m->step != 1.0) {
        /* w that would have brought the last difference to zero, were all of them along one line; Kv: K times the last.
         * before' K (v - before) and |v - before|^2 in K's product; K before takes the place of K v. */
        const int64_t d = m->base->model.d;
        double along = uz_dot(d, m->before, m->Kv), square = uz_dot(d, m->v, m->Kv) - 2.0 * along;
        memset(m->Kv, 0, (size_t)d * sizeof *m->Kv);
        uz_csc_symv(m->Kv, &m->base->model.K, 1.0, m->before);
        const double own = uz_dot(d, m->before, m->Kv);
        along -= own;
        square += own;
        m->step = square > 0.0 ? fmin(MOST_STEP, fmax(LEAST_STEP, -m->step * along / square)) : m->step;
    }
    memcpy(m->before, m->v, (size_t)m->base->model.d * sizeof *m->v);
    for (int64_t i = 0; i < m->n; i++)
        m->place[i] += m->step * (result->u[i] - m->place[i]);
    return UZ_OK;
}

/* Ends without an answer at its own place. */
static void give_up(uz_result *result, const moving *m, uz_outcome outcome)
{
    uz_summary *s = &result->summary;
    s->outcome = outcome;
    if (outcome != UZ_MOVING_GEOMETRY)
        uz_explain_outcome(result, UZ_END_TARGET);
    else
        snprintf(s->message, sizeof s->message,
                 "gaps and normals taken where the answer moves the surfaces to do not settle: pass %d still changed "
                 "it by %.3g, about %.3g is left, asked for %.3g. Move in smaller parts, or use a finer mesh",
                 (int)m->passes, s->geometry.change, s->geometry.left, s->requested_error);
}

uz_status uz_solve_moving(uz_result **result, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                          const uz_hooks *hooks, double started, uz_error *err)
{
    const bool is_auto = problem->scene.kinematics == UZ_KINEMATICS_AUTO;
    const uz_stop stop = {hooks, started + settings->time_limit_s};
    moving m = {.hooks = hooks ? *hooks : (uz_hooks){.ctx = NULL}, .deadline = stop.deadline};
    uz_error own = {0};
    bool settled = false, answered = true;
    if (!is_asked(*result, problem))
        return UZ_OK;
    m.hooks.begins = NULL; /* it has begun */
    uz_status status = prepare(&m, *result, problem, settings, cache, &own);
    while (status == UZ_OK && answered && !settled && m.passes < MOST_PASSES && !uz_stop_is_due(&stop)) {
        uz_result *next = NULL; /* at m.place */
        m.settings.time_limit_s = fmax(0.0, m.deadline - uz_seconds());
        m.passes++;
        status = uz_solve_rounds(&next, &m.problem, &m.settings, NULL, *result, m.cache, &m.hooks, &own);
        answered = status == UZ_OK && next->summary.outcome == UZ_CONVERGED;
        if (answered)
            status = judge(&settled, &m, next, &own);
        const bool first = m.passes == 2,
                   keep = is_auto && first && next && (!answered || next->summary.geometry.change < TOLERABLE);
        if (status != UZ_OK || keep) { /* the answer before anything moved is as good */
            if (status == UZ_OK && answered) {
                (*result)->summary.geometry.change = next->summary.geometry.change;
                uz_drop_sliding((*result)->evaluation, &m.base->model, &problem->scene);
            }
            if (status == UZ_OK)
                uz_timings_add(&(*result)->summary.timings, &next->summary.timings);
            uz_result_free(next);
            settled = answered;
            break;
        }
        replace(result, next, &m);
    }
    uz_setup_release(m.cache, m.base);
    uz_cache_free(m.own_cache);
    uz_free_all(m.place, m.v, m.Kv, m.before);
    const bool lasting = status == UZ_ERR_MEMORY || status == UZ_ERR_INTERNAL || !is_auto;
    if (status == UZ_ERR_CANCELLED || (status == UZ_OK && answered && !settled && uz_stop_is_due(&stop))) {
        give_up(*result, &m, uz_cancelled(hooks) ? UZ_DISMISSED : UZ_TIME_LIMIT);
        return UZ_OK;
    }
    if (status != UZ_OK && lasting) {
        if (err)
            *err = own;
        return status;
    }
    if (status == UZ_OK && answered && !settled)
        give_up(*result, &m, UZ_MOVING_GEOMETRY);
    return UZ_OK;
}
