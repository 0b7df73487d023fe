/* intervals.c: guaranteed intervals for quantities, from pairs of a displacement and a stress (bound/interval.h).
 *
 *     functional -> w of the answer's own K, v of the dual problem's K, both on factors that are there
 *     first with rows that press held, others free: |d|, and from it the share m = |d| / 2 sqrt(H)
 *     then w_n within m s_h of where it is to be, tau's pressure within m r_h, by active sets
 *     what the pair proves (bound/interval.c) and how far its equilibrium is off, as of the answer
 *
 * Nothing depends on these solves but how wide the interval is. */
#include "run/guarantee.h"

#include "bound/interval.h"
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"
#include "post/functional.h"
#include "run/interval_share.h"
#include "run/setup_cache.h"
#include "semicoercive/augment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STEPS = 40, MOST_LIFTS = 5 };

/* What takes an answer out of an obstacle goes a little farther than it stands in there, at points. */
#define DEEPER 1.02

/* Motions have a largest entry of 1: what a row tells of one is no less. */
#define LEAST_TOLD 0.02

/* Of the largest displacement: what an answer is in an obstacle by rounding of its gaps, and is not taken out of it
 * for.
 */
#define TOUCHING 1e-13

/* Of solves that are not exact: what they leave of x, in the energy norm. */
#define SOLVED 1e-6

/* Before an obstacle what is no wider open, of the widest, is closed: rounding. */
#define CLOSED 1e-10

/* min 1/2 x'Kx - p'x with conditions on y = N x, which are active sets of one dual operator. */
typedef struct {
    uz_setup *setup;
    uz_problem problem; /* what the setup is of */
    const uz_csc *K, *N;
    const uz_stop *stop;
    int64_t d, m;
    double *p, *load, *x, *y, *r; /* d, d, d, m, m: r reactions of K x = p + N'r */
    double *target, *width;       /* where y is to be; how far it may be off, or how much r may be at most */
    double *h, *reaction, *gap;
    int *state;
    bool *held;
} rows_problem;

/* The answer's rows. Those of the middles of quadratic edges before obstacles are not of nodes but of coefficients of
 * Bernstein polynomials, which bound all along an edge:  2 g_i - (g_a + g_b) / 2. */
typedef struct {
    uz_setup *setup; /* of the scene */
    const uz_body_model *model;
    int64_t m;
    int64_t *row;        /* m: of the model's */
    int64_t *ends;       /* m x 2: rows of a and b; -1: the row is a node's */
    const uz_csc *nodal; /* all of nodes */
    uz_csc N;            /* as they are; empty where all are */
    bool any;            /* coefficients */
    /* Of a body that only obstacles hold, which has no setup: its model, and a K that is regular by the stiffness of
     * `pinned` rows, which tell its motions apart and press. */
    uz_body_model held;
    uz_problem regular;
    int64_t pinned[UZ_BOUND_LOOSE];
    int n_pinned;
} contact_rows;

typedef struct {
    uz_result *result;
    const uz_guaranteed *g;
    contact_rows own;
    rows_problem primal, dual;
    uz_bound_body adjoint;
    double *w, *stress;           /* n_nodes x 2; as uz_bound_stress */
    double *best_w, *best_stress; /* the same of the narrowest pair, its share, and half its interval */
    double best_share, best;
    double *wanted, *open; /* n_contacts; n_nodes (uz_bound_openings) */
    double ball, widest;   /* sqrt(H); the largest of `open` that is finite */
    double *share;         /* what elements have of the interval of the first quantity */
} proving;

/* By nodes -> as the rows are. */
static void to_coefficients(double *out, const contact_rows *rows, const double *by_node)
{
    for (int64_t k = 0; k < rows->m; k++) {
        const int64_t *ends = rows->ends + 2 * k;
        out[k] = ends[0] < 0 ? by_node[k] : 2 * by_node[k] - (by_node[ends[0]] + by_node[ends[1]]) / 2;
    }
}

/* Which rows are of coefficients: of middles that have one row, as both ends have, of the same contact. */
static uz_status find_coefficients(contact_rows *x, const uz_bound_body *body, uz_error *err)
{
    enum { NONE = -1, SEVERAL = -2 };
    const uz_mesh_info *info = &x->model->info;
    const int64_t n = body->model->mesh.n_nodes;
    int64_t *row_of = uz_alloc(n, sizeof *row_of);
    if (!row_of)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the rows of %lld nodes", (long long)n);
    for (int64_t i = 0; i < n; i++)
        row_of[i] = NONE;
    for (int64_t k = 0; k < x->m; k++) {
        int64_t *at = &row_of[info->contact_node[x->row[k]]];
        *at = *at == NONE && !uz_row_inner(x->model, x->row[k]) ? k : SEVERAL;
        x->ends[2 * k] = x->ends[2 * k + 1] = -1;
    }
    for (int64_t i = 0; i < body->n_edges; i++) {
        const uz_bound_edge *edge = &body->edge[i];
        int64_t at[3];
        bool all = edge->contact >= 0 && edge->node[2] >= 0;
        for (int a = 0; a < 3 && all; a++) {
            at[a] = row_of[edge->node[a]];
            all = at[a] >= 0 && info->contact_of[x->row[at[a]]] == edge->contact;
        }
        for (int a = 0; a < 2 && all; a++)
            x->ends[2 * at[2] + a] = at[a];
        x->any = x->any || all;
    }
    free(row_of);
    return UZ_OK;
}

/* N of these rows. */
static uz_status make_coefficients(contact_rows *x, const uz_csc *N, uz_error *err)
{
    int64_t *followers = uz_alloc(2 * x->m, sizeof *followers);
    uz_entries all = {.n = 0};
    if (!followers)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)x->m);
    for (int64_t k = 0; k < 2 * x->m; k++)
        followers[k] = -1;
    for (int64_t k = 0; k < x->m; k++)
        for (int a = 0; a < 2 && x->ends[2 * k] >= 0; a++) {
            int64_t *at = followers + 2 * x->ends[2 * k + a];
            at[at[0] >= 0] = k; /* an end has two edges at most */
        }
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
            const int64_t k = N->idx[q], *more = followers + 2 * k;
            uz_entries_add(&all, k, j, N->val[q] * (x->ends[2 * k] >= 0 ? 2 : 1));
            for (int a = 0; a < 2; a++)
                if (more[a] >= 0)
                    uz_entries_add(&all, more[a], j, -0.5 * N->val[q]);
        }
    free(followers);
    return uz_csc_from_entries(&x->N, x->m, N->cols, &all, err);
}

static void end_contact_rows(contact_rows *x, uz_cache *cache)
{
    uz_csc_clear(&x->N);
    uz_free_all(x->row, x->ends);
    uz_augmented_clear(&x->regular);
    uz_body_model_clear(&x->held);
    uz_setup_release(cache, x->setup);
}

static uz_status take_rows(contact_rows *x, const uz_candidates *some, const uz_bound_body *body, uz_error *err)
{
    x->m = x->nodal->rows;
    x->row = uz_alloc(x->m, sizeof *x->row);
    x->ends = uz_alloc(2 * x->m, sizeof *x->ends);
    if (!x->row || !x->ends)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)x->m);
    for (int64_t i = 0, k = 0; i < x->model->m; i++)
        if (!some || some->in[i])
            x->row[k++] = i;
    const uz_status status = find_coefficients(x, body, err);
    return status == UZ_OK && x->any ? make_coefficients(x, x->nodal, err) : status;
}

static uz_status begin_contact_rows(contact_rows *x, const uz_guaranteed *g, uz_error *err)
{
    uz_reuse reused;
    uz_problem problem = *g->problem;
    problem.n_cases = 0;
    uz_status status = uz_setup_acquire(&x->setup, &reused, g->cache, &problem, NULL, g->settings, &g->hooks, err);
    if (status != UZ_OK)
        return status;
    x->nodal = uz_setup_N(x->setup, &problem);
    x->model = &x->setup->model;
    return take_rows(x, x->setup->rows.in ? &x->setup->rows : NULL, &g->body, err);
}

static uz_status begin_rows(rows_problem *x, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                            const uz_hooks *hooks, const uz_stop *stop, uz_error *err)
{
    uz_reuse reused;
    x->problem = *problem;
    x->problem.n_cases = 0;
    x->stop = stop;
    uz_status status = uz_setup_acquire(&x->setup, &reused, cache, &x->problem, NULL, settings, hooks, err);
    if (status != UZ_OK)
        return status;
    x->K = uz_setup_K(x->setup, &x->problem);
    x->N = uz_setup_N(x->setup, &x->problem);
    x->d = x->K->cols;
    x->m = x->N->rows;
    double **vectors[] = {&x->p, &x->load, &x->x},
           **by_row[] = {&x->y, &x->r, &x->target, &x->width, &x->h, &x->reaction, &x->gap};
    bool room = true;
    for (size_t k = 0; k < sizeof vectors / sizeof vectors[0]; k++)
        room = (*vectors[k] = uz_alloc_zero(x->d, sizeof(double))) != NULL && room;
    for (size_t k = 0; k < sizeof by_row / sizeof by_row[0]; k++)
        room = (*by_row[k] = uz_alloc_zero(x->m, sizeof(double))) != NULL && room;
    x->state = uz_alloc_zero(x->m, sizeof *x->state);
    x->held = uz_alloc_zero(x->m, sizeof *x->held);
    return room && x->state && x->held
               ? UZ_OK
               : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the quantities of %lld unknowns", (long long)x->d);
}

/* The rows that hold a loose body, those that press hardest and tell its motions apart, as of edges (bound/loose.c).
 * pressing: m. Are there as many as motions? */
static bool pin(contact_rows *x, const uz_csc *Nt, const double *pressing)
{
    const uz_body_model *model = x->model;
    double chosen[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE];
    for (x->n_pinned = 0; x->n_pinned < model->n_modes; x->n_pinned++) {
        double best = 0, by[UZ_BOUND_LOOSE], *of = chosen[x->n_pinned];
        for (int64_t i = 0; i < x->m; i++) {
            double size = 0;
            for (int k = 0; k < model->n_modes && pressing[i] > 0; k++) {
                by[k] = 0;
                for (int64_t q = Nt->ptr[i]; q < Nt->ptr[i + 1]; q++)
                    by[k] += Nt->val[q] * model->modes[k * model->d + Nt->idx[q]];
            }
            for (int j = 0; j < x->n_pinned && pressing[i] > 0; j++) {
                double along = 0;
                for (int k = 0; k < model->n_modes; k++)
                    along += by[k] * chosen[j][k];
                for (int k = 0; k < model->n_modes; k++)
                    by[k] -= along * chosen[j][k];
            }
            for (int k = 0; k < model->n_modes && pressing[i] > 0; k++)
                size += by[k] * by[k];
            if (sqrt(size) > LEAST_TOLD && sqrt(pressing[i] * size) > best) {
                best = sqrt(pressing[i] * size);
                x->pinned[x->n_pinned] = i;
                for (int k = 0; k < model->n_modes; k++)
                    of[k] = by[k] / sqrt(size);
            }
        }
        if (!(best > 0))
            return false;
    }
    return true;
}

static void look_at_row(double *r, double *gap, const contact_rows *own, const uz_standing *answer, int64_t row);

/* The same of a body that only obstacles hold. *any: its K could be made regular. */
static uz_status begin_held_rows(contact_rows *x, bool *any, const uz_guaranteed *g, const uz_standing *answer,
                                 uz_error *err)
{
    uz_csc Nt = {0};
    double *room = NULL, *weight, none;
    *any = false;
    uz_status status = uz_body_model_build(&x->held, &g->problem->scene, UZ_BODY_HELD, err);
    x->model = &x->held;
    x->nodal = &x->held.N;
    if (status == UZ_OK)
        status = take_rows(x, NULL, &g->body, err);
    const uz_csc *N = x->any ? &x->N : x->nodal;
    const int64_t d = x->held.d;
    if (status == UZ_OK)
        status = uz_csc_transpose(&Nt, N, err);
    if (status == UZ_OK && !(room = uz_alloc_zero(2 * d + 3 * x->m, sizeof *room)))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)x->m);
    if (status == UZ_OK) {
        double *stiffness = room + 2 * d, *pressing = stiffness + x->m;
        weight = pressing + x->m;
        for (int64_t k = 0; k < x->m; k++) {
            look_at_row(&pressing[k], &none, x, answer, x->row[k]);
            pressing[k] = -pressing[k];
        }
        *any = pin(x, &Nt, pressing);
        uz_row_stiffness(stiffness, room, &x->held.K, &Nt);
        for (int k = 0; k < x->n_pinned; k++)
            weight[x->pinned[k]] = stiffness[x->pinned[k]];
        const uz_singular of = {&x->held.K, N, room + d, stiffness};
        if (*any)
            status = uz_augment(&x->regular, &of, &Nt, weight, pressing, err);
    }
    uz_csc_clear(&Nt);
    free(room);
    return status;
}

/* Of the answer's K and rows. */
static uz_status begin_own(rows_problem *x, const contact_rows *own, const uz_guaranteed *g, uz_error *err)
{
    const uz_settings settings = uz_guarantee_settings(g, uz_seconds());
    const bool pinned = own->n_pinned > 0;
    const uz_csc *K = pinned ? &own->regular.qp.K : uz_setup_K(own->setup, g->problem);
    const uz_problem matrices = {.kind = UZ_PROBLEM_MATRICES, .qp = {.K = *K, .N = own->any ? own->N : *own->nodal}};
    return own->any || pinned ? begin_rows(x, &matrices, &settings, g->cache, &g->hooks, &g->stop, err)
                              : begin_rows(x, g->problem, g->settings, g->cache, &g->hooks, &g->stop, err);
}

static void end_rows(rows_problem *x, uz_cache *cache)
{
    uz_free_all(x->p, x->load, x->x, x->y, x->r, x->target, x->width, x->h, x->reaction, x->gap, x->state, x->held);
    uz_setup_release(cache, x->setup);
}

/* x, y, r with the rows `held` at h and the others under x->reaction. *solved false: it can't be told. */
static uz_status solve_held(rows_problem *x, bool *solved, uz_error *err)
{
    const uz_dual *dual = x->setup->dual;
    uz_dual_load *load = NULL;
    uz_active_end ended = UZ_ACTIVE_SOLVED;
    bool any = false, *held = uz_alloc(x->m, sizeof *held);
    *solved = false;
    if (!held)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)x->m);
    for (int64_t i = 0; i < x->m; i++) {
        held[i] = x->held[i];
        any = any || held[i];
        x->r[i] = 0;
    }
    memcpy(x->load, x->p, (size_t)x->d * sizeof *x->load);
    uz_csc_gaxpy_t(x->load, x->N, 1, x->reaction);
    uz_status status = uz_dual_load_create(&load, dual, x->K, x->load, x->h, err);
    if (status == UZ_OK) {
        load->equations = true;
        status = uz_dual_load_aim(load, SOLVED, x->stop, err);
    }
    if (status == UZ_OK && any)
        status = uz_dual_load_solve_active(load, &ended, x->r, x->gap, held, err);
    if (status == UZ_OK && ended == UZ_ACTIVE_SOLVED)
        status = uz_dual_load_recover(load, x->x, x->r, false, err);
    *solved = status == UZ_OK && ended == UZ_ACTIVE_SOLVED;
    for (int64_t i = 0; i < x->m && *solved; i++) {
        x->r[i] *= dual->row_scale[i];
        x->y[i] = 0;
    }
    if (*solved)
        uz_csc_gaxpy(x->y, x->N, 1, x->x);
    uz_dual_load_free(load);
    free(held);
    return status;
}

/* With rows whose width is zero held at their target, others free; or the other way round. */
static uz_status solve_open(rows_problem *x, bool *solved, bool held_where_zero, uz_error *err)
{
    for (int64_t i = 0; i < x->m; i++) {
        x->held[i] = (x->width[i] > 0) != held_where_zero;
        x->h[i] = x->held[i] ? x->target[i] : (double)INFINITY;
        x->reaction[i] = 0;
        x->state[i] = 0;
    }
    return solve_held(x, solved, err);
}

/* |y - target| <= times width. */
static uz_status solve_within(rows_problem *x, bool *solved, double times, uz_error *err)
{
    uz_status status = UZ_OK;
    bool changed = true;
    *solved = true;
    for (int64_t i = 0; i < x->m; i++)
        x->reaction[i] = 0;
    for (int step = 0; step < MOST_STEPS && changed && *solved && status == UZ_OK; step++) {
        changed = false;
        for (int64_t i = 0; i < x->m; i++) {
            const double most = times * x->width[i], off = x->y[i] - x->target[i];
            int next = x->state[i];
            if (!(most > 0))
                next = 1;
            else if (next == 0)
                next = off > most ? 1 : off < -most ? -1 : 0;
            else if (x->r[i] * next > 0) /* it would have to be pushed outward */
                next = 0;
            changed = changed || next != x->state[i] || step == 0;
            x->state[i] = next;
            x->held[i] = next != 0;
            x->h[i] = next != 0 ? x->target[i] + next * most : (double)INFINITY;
        }
        if (changed)
            status = solve_held(x, solved, err);
    }
    return status;
}

/* |r| <= times width, and y off its target only where r is as large as it may be, against it. */
static uz_status solve_sliding(rows_problem *x, bool *solved, double times, uz_error *err)
{
    uz_status status = UZ_OK;
    bool changed = true;
    *solved = true;
    for (int step = 0; step < MOST_STEPS && changed && *solved && status == UZ_OK; step++) {
        changed = false;
        for (int64_t i = 0; i < x->m; i++) {
            const double most = times * x->width[i];
            int next = x->state[i];
            if (!(most > 0))
                next = 1;
            else if (next == 0)
                next = x->r[i] < -most ? 1 : x->r[i] > most ? -1 : 0;
            else if ((x->y[i] - x->target[i]) * next < 0)
                next = 0;
            changed = changed || next != x->state[i] || step == 0;
            x->state[i] = next;
            x->held[i] = next == 0;
            x->h[i] = next == 0 ? x->target[i] : (double)INFINITY;
            x->reaction[i] = -next * most;
        }
        if (changed)
            status = solve_held(x, solved, err);
    }
    return status;
}

/* ---- what is asked for */

static bool is_asked_of(const uz_quantity *quantity, const char *on)
{
    return !*quantity->on || strcmp(quantity->on, on) == 0;
}

/* The quantity's load on edges and elements of the adjoint body; or why there is none. */
static const char *take_load(proving *v, const uz_quantity *quantity, uz_error *err)
{
    const uz_bound_body *body = &v->g->body;
    const uz_scene *own = &v->g->problem->scene;
    uz_load load = {.kind = UZ_LOAD_FORCE};
    uz_scene scene = *own;
    uz_bound_body loaded;
    memcpy(load.on, quantity->on, sizeof load.on);
    memcpy(load.v, quantity->direction, sizeof load.v);
    scene.loads = &load;
    scene.n_loads = 1;
    if (uz_bound_body_make(&loaded, body->model, &scene, err) != UZ_OK)
        return "its load could not be made";
    const char *why = *loaded.why                    ? "the continuum has no mean of single nodes"
                      : loaded.degree > body->degree ? "forces along the axis of rings need quadratic elements"
                                                     : NULL;
    for (int64_t i = 0; i < body->n_edges && !why; i++)
        memcpy(v->adjoint.edge[i].traction, loaded.edge[i].traction, sizeof loaded.edge[i].traction);
    for (int64_t i = 0; i < 2 * body->model->mesh.n_elements && !why; i++)
        v->adjoint.force[i] = loaded.force[i];
    uz_bound_body_clear(&loaded);
    return why;
}

/* The force of springs on the body along a direction: minus k times a displacement. */
static bool take_springs(proving *v, const uz_quantity *quantity)
{
    const uz_scene *scene = &v->g->problem->scene;
    bool any = false, others = false;
    for (int64_t k = 0; k < scene->n_supports; k++) {
        const bool asked = strcmp(scene->supports[k].on, quantity->on) == 0;
        any = any || (asked && scene->supports[k].kind == UZ_SUPPORT_SPRING);
        others = others || (!asked && scene->supports[k].kind == UZ_SUPPORT_SPRING);
    }
    for (int64_t i = 0; i < v->adjoint.n_edges && any && !others; i++)
        for (int c = 0; c < 2; c++)
            v->adjoint.edge[i].traction[c] = -v->adjoint.edge[i].spring[c] * quantity->direction[c];
    return !any || !others;
}

/* The adjoint body: edges as they are, but for loads, and values at supports as z has them, gaps as w is wanted. */
static const char *make_adjoint(proving *v, const uz_quantity *quantity, const double *z, uz_error *err)
{
    const uz_bound_body *body = &v->g->body;
    uz_bound_body *to = &v->adjoint;
    for (int64_t k = 0; k < v->g->problem->scene.n_contacts; k++)
        v->wanted[k] =
            quantity->kind == UZ_QUANTITY_CONTACT_FORCE && is_asked_of(quantity, v->g->problem->scene.contacts[k].on);
    memcpy(to->edge, body->edge, (size_t)body->n_edges * sizeof *to->edge);
    if (body->before.n > 0)
        memcpy(to->before.at, body->before.at, (size_t)body->before.n * sizeof *to->before.at);
    memset(to->force, 0, (size_t)(2 * body->model->mesh.n_elements) * sizeof *to->force);
    for (int64_t i = 0; i < body->n_edges; i++) {
        uz_bound_edge *edge = &to->edge[i];
        for (int c = 0; c < 2; c++) {
            const double *at = z + 2 * edge->node[0];
            edge->traction[c] = 0;
            edge->value[c] = edge->held[c] ? edge->axis[c][0] * at[0] + edge->axis[c][1] * at[1] : 0;
        }
        for (int c = 0; c < 2 && edge->contact >= 0 && !edge->turns; c++) /* of a line: for uz_bound_dual_load */
            to->before.at[edge->before].gap[c] = v->wanted[edge->contact];
    }
    if (quantity->kind == UZ_QUANTITY_STRAIN_ENERGY) { /* the loads' own work */
        for (int64_t i = 0; i < body->n_edges; i++)
            memcpy(to->edge[i].traction, body->edge[i].traction, sizeof body->edge[i].traction);
        memcpy(to->force, body->force, (size_t)(2 * body->model->mesh.n_elements) * sizeof *to->force);
    }
    if (quantity->kind == UZ_QUANTITY_DISPLACEMENT)
        return take_load(v, quantity, err);
    if (quantity->kind == UZ_QUANTITY_REACTION && !take_springs(v, quantity))
        return "other springs hold the body, too";
    return NULL;
}

/* Rows of the dual problem: where they are to be, and the pressure that the answer's stress has there. */
static uz_status make_dual_rows(proving *v, uz_error *err)
{
    const uz_bound_body *body = &v->adjoint;
    const int moments = body->degree + 1;
    uz_qp qp = {.p = NULL};
    int64_t *dof = NULL;
    uz_status status = uz_bound_dual_load(&qp, &dof, body, &v->g->stop, err);
    if (status == UZ_OK)
        memcpy(v->dual.p, qp.p, (size_t)v->dual.d * sizeof *qp.p);
    int64_t row = 0;
    for (int64_t i = 0; i < body->n_edges && status == UZ_OK; i++)
        for (int a = 0; a < moments; a++)
            if (uz_bound_has_row(body, dof, i, a)) {
                v->dual.target[row] = body->edge[i].turns
                                          ? v->wanted[body->edge[i].contact] * uz_bound_mean_along(body, i, a)
                                          : qp.h[row];
                v->dual.width[row++] = fmax(0, v->g->shown->pressure[i * moments + a]);
            }
    for (int64_t k = 0; k < body->n_segments && status == UZ_OK; k++) {
        const uz_bound_segment *segment = &body->segment[k];
        const bool first = k == 0 || body->segment[k - 1].slave != segment->slave;
        for (int a = 0; a < moments && first && body->edge[segment->slave].facing == UZ_BOUND_SLAVE; a++) {
            v->dual.target[row] = v->wanted[segment->contact];
            v->dual.width[row++] = fmax(0, v->g->shown->pressure[segment->slave * moments + a]);
        }
    }
    uz_qp_clear(&qp);
    free(dof);
    return status;
}

/* ---- pairs */

static void take_displacement(proving *v, const uz_functional *of)
{
    const uz_body_model *model = &v->own.setup->model;
    uz_recover_nodal(v->w, model, v->primal.x, of->held);
    for (int64_t i = 0; i < 2 * model->mesh.n_nodes; i++)
        v->w[i] *= of->times;
}

static uz_status take_stress(proving *v, uz_error *err)
{
    return uz_bound_stress(v->stress, &v->adjoint, v->g->dof, v->dual.x, &v->g->stop, err);
}

/* Why there is no proof. */
static void say(uz_quantity_found *out, const char *why)
{
    snprintf(out->unproved, sizeof out->unproved, "%s", why);
}

/* Half the interval that the pair at hand would prove, but for rounding; INFINITY: none, and out->unproved says why.
 * Of the narrowest one so far the pair is kept. */
static uz_status look_at_pair(proving *v, uz_quantity_found *out, double *half, double *apart, double share,
                              uz_error *err)
{
    const uz_guaranteed *g = v->g;
    uz_bound_interval interval;
    const uz_bound_pair pair = {&v->adjoint, v->w, v->stress, v->wanted, share};
    const uz_status status = uz_bound_width(&interval, &pair, &g->body, g->shown, err);
    *apart = interval.apart;
    *half = status == UZ_OK ? uz_bound_half(&interval, g->shown, g->rho, 0) : (double)INFINITY;
    if (!isfinite(*half))
        say(out, interval.fault);
    free(interval.local);
    if (*half < v->best) {
        double *const w = v->w, *const stress = v->stress;
        v->w = v->best_w;
        v->best_w = w;
        v->stress = v->best_stress;
        v->best_stress = stress;
        v->best_share = share;
        v->best = *half;
    }
    return status;
}

/* What the narrowest pair proves. It is not stopped, as that is one solve on a factor that is there, and all that was
 * tried for the pair would be lost. */
static uz_status weigh(proving *v, uz_quantity_found *out, uz_error *err)
{
    const uz_guaranteed *g = v->g;
    uz_guaranteed unstopped = *g;
    uz_bound_interval interval;
    double own = INFINITY;
    const uz_bound_pair pair = {&v->adjoint, v->best_w, v->best_stress, v->wanted, v->best_share};
    unstopped.hooks = (uz_hooks){.ctx = NULL};
    unstopped.stop = (uz_stop){NULL, INFINITY};
    uz_status status = uz_bound_weigh(&interval, &pair, &g->body, &g->problem->scene, g->dof, g->qp.K.cols,
                                      g->admissible ? g->admissible : v->result->u, g->stress, g->shown, err);
    if (status == UZ_OK)
        status = uz_measure_residual(&own, &unstopped, interval.residual, err);
    const double half = status == UZ_OK ? uz_bound_half(&interval, g->shown, g->rho, own) : (double)INFINITY;
    if (isfinite(half)) {
        out->value = interval.middle;
        out->low = interval.middle - half;
        out->high = interval.middle + half;
        out->mesh = half;
        out->equations = 0;
        out->guaranteed = true;
        out->why[0] = '\0';
        out->unproved[0] = '\0'; /* by one share, whatever another one could not */
    } else {
        say(out, *interval.fault ? interval.fault : "what the stress lacks of equilibrium could not be bounded");
    }
    if (out->guaranteed && out == v->result->evaluation->quantities) {
        v->share = interval.local;
        interval.local = NULL;
    }
    uz_free_all(interval.residual, interval.local);
    return status;
}

static uz_status prove_one(proving *v, uz_quantity_found *out, const uz_quantity *quantity, const uz_functional *of,
                           uz_error *err)
{
    rows_problem *primal = &v->primal, *dual = &v->dual;
    const contact_rows *own = &v->own;
    const uz_body_model *model = own->model;
    bool solved = true;
    double apart = 0;
    memset(primal->x, 0, (size_t)primal->d * sizeof *primal->x);
    take_displacement(v, of);
    const char *why = make_adjoint(v, quantity, v->w, err);
    if (why) {
        say(out, why);
        return UZ_OK;
    }
    uz_status status = make_dual_rows(v, err);
    for (int64_t k = 0; k < own->m; k++)
        primal->reaction[k] = of->gap[own->row[k]]; /* room */
    to_coefficients(primal->target, own, primal->reaction);
    for (int64_t k = 0; k < own->m; k++) {
        const int64_t i = own->row[k];
        const double open = v->open[model->info.contact_node[i]];
        primal->width[k] = v->g->admissible || own->ends[2 * k] >= 0 ? open
                           : v->result->r[i] < 0                     ? 0
                                                                     : fmin(fmax(0, v->result->g[i]), open);
        primal->width[k] = primal->width[k] > CLOSED * v->widest ? primal->width[k] : 0;
    }
    uz_gather_nodal(primal->p, model, of->load);
    uz_csc_gaxpy(primal->p, &model->K_fixed, -1, of->held);
    if (status == UZ_OK)
        status = solve_open(primal, &solved, true, err);
    if (status == UZ_OK && solved)
        status = solve_open(dual, &solved, false, err);
    if (status == UZ_OK && solved)
        status = take_stress(v, err);
    if (status != UZ_OK || !solved) {
        say(out, "the rows in contact could not be held for its adjoint problem");
        return status;
    }
    take_displacement(v, of);
    status = uz_bound_apart(&apart, &(uz_bound_pair){&v->adjoint, v->w, v->stress, v->wanted, 1}, err);
    uz_attempts tried = {.n = 0};
    double share = apart > 0 && v->ball > 0 ? apart / (2 * v->ball) : 1;
    v->best = INFINITY;
    while (share > 0 && status == UZ_OK && solved) {
        double half = INFINITY;
        status = solve_within(primal, &solved, share, err);
        if (status == UZ_OK && solved)
            status = solve_sliding(dual, &solved, share, err);
        if (status == UZ_OK && solved)
            status = take_stress(v, err);
        if (status != UZ_OK || !solved)
            break;
        take_displacement(v, of);
        status = look_at_pair(v, out, &half, &apart, share, err);
        uz_attempts_add(&tried, share, apart, half);
        share = primal->m == 0 ? 0 : uz_attempts_next(&tried, share, v->ball);
    }
    if (isfinite(v->best) && (status == UZ_OK || status == UZ_ERR_CANCELLED)) {
        const uz_status weighed = weigh(v, out, err);
        status = status == UZ_OK ? weighed : status;
    }
    return status;
}

/* The strain energy is the potential energy, which two energies enclose, and the work f(u) of the loads. */
static void prove_energy(uz_quantity_found *out, const uz_guarantee *energies, double kept)
{
    out->low += energies->dual + kept;
    out->high += energies->primal + kept;
    out->value = (out->low + out->high) / 2;
    out->mesh = (out->high - out->low) / 2;
}

/* The loads but temperature as a functional. */
static uz_status take_work(uz_functional *of, const proving *v, uz_error *err)
{
    const uz_body_model *model = &v->own.setup->model;
    *of = (uz_functional){.times = 1};
    of->load = uz_alloc_zero(model->mesh.n_nodes * model->mesh.dim, sizeof *of->load);
    of->held = uz_alloc_zero(model->n_fixed, sizeof *of->held);
    of->gap = uz_alloc_zero(model->m, sizeof *of->gap);
    if (!of->load || !of->held || !of->gap)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the work of loads on %lld nodes",
                       (long long)model->mesh.n_nodes);
    return uz_bound_loads(of->load, model, &v->g->problem->scene, err);
}

static uz_status begin(proving *v, uz_error *err)
{
    const uz_guaranteed *g = v->g;
    const uz_bound_body *body = &g->body;
    const uz_mesh *mesh = &body->model->mesh;
    const uz_settings settings = uz_guarantee_settings(g, uz_seconds());
    const uz_problem matrices = {.kind = UZ_PROBLEM_MATRICES, .qp = g->qp};
    v->adjoint = *body;
    v->adjoint.free_strain = NULL;
    v->adjoint.motion = NULL;
    v->adjoint.edge = uz_alloc(body->n_edges, sizeof *body->edge);
    v->adjoint.before.at = uz_alloc(body->before.n, sizeof *body->before.at);
    v->adjoint.force = uz_alloc(2 * mesh->n_elements, sizeof *body->force);
    v->w = uz_alloc_zero(2 * mesh->n_nodes, sizeof *v->w);
    v->wanted = uz_alloc_zero(g->problem->scene.n_contacts, sizeof *v->wanted);
    v->best_w = uz_alloc_zero(2 * mesh->n_nodes, sizeof *v->w);
    v->stress = uz_alloc(mesh->n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, sizeof *v->stress);
    v->best_stress = uz_alloc(mesh->n_elements * UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3, sizeof *v->stress);
    v->open = uz_alloc(mesh->n_nodes, sizeof *v->open);
    v->ball = sqrt(uz_bound_ball(g->shown, g->rho));
    if (!v->adjoint.edge || !v->adjoint.before.at || !v->adjoint.force || !v->w || !v->wanted || !v->open ||
        !v->stress || !v->best_w || !v->best_stress)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the quantities of %lld nodes", (long long)mesh->n_nodes);
    uz_bound_openings(v->open, body, g->shown);
    for (int64_t i = 0; i < mesh->n_nodes; i++)
        v->widest = isfinite(v->open[i]) ? fmax(v->widest, v->open[i]) : v->widest;
    uz_status status = begin_contact_rows(&v->own, g, err);
    if (status == UZ_OK)
        status = begin_own(&v->primal, &v->own, g, err);
    if (status == UZ_OK)
        status = begin_rows(&v->dual, &matrices, &settings, g->cache, &g->hooks, &g->stop, err);
    return status;
}

double uz_depth_along(const uz_bound_body *body, int64_t i, const double *u)
{
    enum { POINTS = 16 };
    const uz_bound_edge *edge = &body->edge[i];
    double deepest = -INFINITY, from = 0;
    for (int64_t piece = edge->before; piece < edge->before + edge->pieces; piece++) {
        const double part = body->before.at[piece].end - from;
        const int points = (int)fmax(1, ceil(POINTS * part));
        for (int k = 0; k <= points; k++) {
            const double q = from + part * k / points, p = 1 - q;
            const double shape[3] = {edge->node[2] < 0 ? p : p * (1 - 2 * q), edge->node[2] < 0 ? q : q * (2 * q - 1),
                                     4 * p * q};
            double n[2], s = uz_bound_piece_gap(n, body, i, piece, q);
            for (int a = 0; a < 3 && edge->node[a] >= 0; a++)
                s -= shape[a] * (n[0] * u[2 * edge->node[a]] + n[1] * u[2 * edge->node[a] + 1]);
            deepest = fmax(deepest, -s);
        }
        from = body->before.at[piece].end;
    }
    return deepest;
}

/* What nodes have to be taken out by: more where u + lift stands in the obstacle. Does it? */
static bool look_for_depth(double *depth, double *more, double *at, const uz_bound_body *body, const double *u,
                           const double *lift)
{
    const int64_t n = body->model->mesh.n_nodes;
    double farthest = 0;
    bool any = false;
    for (int64_t i = 0; i < n; i++) {
        more[i] = 0;
        for (int c = 0; c < 2; c++) {
            at[2 * i + c] = u[2 * i + c] + lift[2 * i + c];
            farthest = fmax(farthest, fabs(at[2 * i + c]));
        }
    }
    for (int64_t i = 0; i < body->n_edges; i++) {
        const double in_it = body->edge[i].contact >= 0 ? uz_depth_along(body, i, at) : 0;
        const double deep = in_it > TOUCHING * farthest ? DEEPER * in_it : 0;
        any = any || deep > 0;
        for (int a = 0; a < 3 && body->edge[i].node[a] >= 0; a++)
            more[body->edge[i].node[a]] = fmax(more[body->edge[i].node[a]], deep);
    }
    for (int64_t i = 0; i < n; i++)
        depth[i] += more[i];
    return any;
}

/* With the rows `held` at their h, and which are: y -> nodes. */
static uz_status take_lift(double *lift, rows_problem *x, const contact_rows *own, bool *solved, uz_error *err)
{
    const uz_status status = solve_held(x, solved, err);
    if (status == UZ_OK && *solved)
        uz_recover_nodal(lift, own->model, x->x, NULL);
    return status;
}

/* The displacement of least norm that takes nodes out by their depth. */
static uz_status lift_least(double *lift, rows_problem *x, const contact_rows *own, const uz_standing *answer,
                            const double *depth, bool *solved, uz_error *err)
{
    (void)answer;
    for (int64_t k = 0; k < x->m; k++) {
        const double deep = depth[own->model->info.contact_node[own->row[k]]];
        x->held[k] = deep > 0 && !uz_row_inner(own->model, own->row[k]);
        x->h[k] = x->held[k] ? -deep : (double)INFINITY;
    }
    return take_lift(lift, x, own, solved, err);
}

/* The reaction of a row, and its gap. */
static void look_at_row(double *r, double *gap, const contact_rows *own, const uz_standing *answer, int64_t row)
{
    const uz_mesh_info *info = &own->model->info;
    const int64_t node = info->contact_node[row];
    if (answer->r) {
        *r = answer->r[row];
        *gap = answer->gap[row];
        return;
    }
    *r = -fmax(0, answer->push[2 * node] * info->contact_normal[2 * row] +
                      answer->push[2 * node + 1] * info->contact_normal[2 * row + 1]);
    *gap = answer->open[node];
}

static bool is_pinned(const contact_rows *own, int64_t k)
{
    bool is = false;
    for (int j = 0; j < own->n_pinned; j++)
        is = is || own->pinned[j] == k;
    return is;
}

/* What makes of the answer the displacement of least energy with its nodes, and coefficients, by their depth out of
 * obstacles: the answer's reactions are taken off it, and others found by active sets. Where what presses is that of a
 * stress, it is the w of least |w|^2 / 2 + int r_h w_n, which the bound has (check.c). */
static uz_status lift_cheaply(double *lift, rows_problem *x, const contact_rows *own, const uz_standing *answer,
                              const double *depth, bool *solved, uz_error *err)
{
    uz_status status = UZ_OK;
    bool changed = true;
    for (int64_t k = 0; k < x->m; k++) {
        look_at_row(&x->y[k], &x->width[k], own, answer, own->row[k]);
        x->held[k] = x->y[k] < 0;
    }
    memset(x->p, 0, (size_t)x->d * sizeof *x->p);
    uz_csc_gaxpy_t(x->p, own->nodal, -1, x->y);
    to_coefficients(x->target, own, x->width);
    for (int64_t k = 0; k < x->m; k++)
        if (!uz_row_inner(own->model, own->row[k]))
            x->target[k] -= depth[own->model->info.contact_node[own->row[k]]];
    *solved = true;
    for (int step = 0; step < MOST_STEPS && changed && *solved && status == UZ_OK; step++) {
        for (int64_t k = 0; k < x->m; k++)
            x->h[k] = x->held[k] ? x->target[k] : (double)INFINITY;
        status = take_lift(lift, x, own, solved, err);
        changed = false;
        for (int64_t k = 0; k < x->m && *solved; k++) {
            const bool next = x->held[k] ? x->r[k] < 0 || is_pinned(own, k) : x->y[k] > x->target[k];
            changed = changed || next != x->held[k];
            x->held[k] = next;
        }
    }
    return status;
}

/* Lifts by greater and greater depths until the answer is out of obstacles. depth: 4 n_nodes, room. */
static uz_status lift_out(double **out, double *depth, uz_guaranteed *g, rows_problem *x, const contact_rows *own,
                          const uz_standing *answer, bool cheaply, uz_error *err)
{
    const int64_t n = g->body.model->mesh.n_nodes;
    double *lift = uz_alloc_zero(2 * n, sizeof *lift);
    uz_status status = lift ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to take %lld nodes out", (long long)n);
    bool solved = lift != NULL;
    int steps = 0;
    memset(depth, 0, (size_t)n * sizeof *depth);
    for (; steps < MOST_LIFTS && solved && status == UZ_OK &&
           (look_for_depth(depth, depth + n, depth + 2 * n, &g->body, answer->u, lift) ||
            (steps == 0 && cheaply && answer->stands_off));
         steps++) {
        if (steps == 0 && cheaply) /* rows take it out, but for what is between them */
            memset(depth, 0, (size_t)n * sizeof *depth);
        status = (cheaply ? lift_cheaply : lift_least)(lift, x, own, answer, depth, &solved, err);
    }
    if (status == UZ_OK && steps > 0 && solved)
        *out = lift;
    else
        free(lift);
    return status;
}

uz_status uz_lift_out(uz_guaranteed *g, const uz_standing *answer, uz_error *err)
{
    const int64_t n = g->body.model->mesh.n_nodes;
    double *depth = uz_alloc_zero(6 * n, sizeof *depth);
    contact_rows own = {.setup = NULL};
    rows_problem x = {.setup = NULL};
    uz_status status =
        depth ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to take %lld nodes out", (long long)n);
    bool any = depth && (answer->stands_off ||
                         look_for_depth(depth, depth + n, depth + 2 * n, &g->body, answer->u, depth + 4 * n));
    const bool loose = g->body.n_loose > 0;
    if (any && loose) /* the least norm would be a motion's, which costs what presses */
        status = begin_held_rows(&own, &any, g, answer, err);
    else if (any)
        status = begin_contact_rows(&own, g, err);
    if (any && status == UZ_OK)
        status = begin_own(&x, &own, g, err);
    if (any && status == UZ_OK && !loose)
        status = lift_out(&g->lift, depth, g, &x, &own, answer, false, err);
    if (any && status == UZ_OK)
        status = lift_out(&g->cheap, depth, g, &x, &own, answer, true, err);
    end_rows(&x, g->cache);
    end_contact_rows(&own, g->cache);
    free(depth);
    return status;
}

uz_status uz_prove_quantities(uz_result *result, const uz_guaranteed *g, uz_error *err)
{
    uz_evaluation *e = result->evaluation;
    proving v = {.result = result, .g = g};
    const char *all = g->body.n_loose > 0 ? "only obstacles hold the body" : NULL;
    bool any = false;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < e->n_quantities; i++)
        any = any || g->problem->quantities[i].kind != UZ_QUANTITY_MEAN_PRESSURE;
    if (any && !all)
        status = begin(&v, err);
    for (int64_t i = 0; i < e->n_quantities && status == UZ_OK; i++) {
        const uz_quantity *asked = &g->problem->quantities[i];
        uz_quantity_found *out = &e->quantities[i];
        const char *why = all;
        if (asked->kind == UZ_QUANTITY_MEAN_PRESSURE)
            why = "no displacement leaps at the ends of a window";
        if (!why) {
            uz_functional of = {.found = 0};
            char where[UZ_QUANTITY_POINTER];
            uz_quantity_place(where, g->problem, i, "on");
            status = asked->kind == UZ_QUANTITY_STRAIN_ENERGY
                         ? take_work(&of, &v, err)
                         : uz_functional_make(&of, asked, where, &v.own.setup->model, &g->problem->scene, result, NULL,
                                              NULL, NULL, err);
            why = of.why[0] ? "supports of both kinds, springs and others, hold this group" : NULL;
            if (status == UZ_OK && !why)
                status = prove_one(&v, out, asked, &of, err);
            if (out->guaranteed && asked->kind == UZ_QUANTITY_STRAIN_ENERGY)
                prove_energy(out, &result->summary.guarantee, e->kept_energy);
            uz_functional_clear(&of);
        }
        if (!out->guaranteed && !why && uz_stop_is_due(&g->stop)) /* whatever half a solve has said */
            say(out, "it was stopped before it was proved");
        else if (!out->guaranteed && (why || !*out->unproved))
            say(out, why ? why : "its interval could not be made");
    }
    end_rows(&v.primal, g->cache);
    end_rows(&v.dual, g->cache);
    end_contact_rows(&v.own, g->cache);
    if (v.share && e->asked > 0)
        uz_add_share(e, g->body.model->mesh.n_elements, v.share);
    uz_free_all(v.share, v.open, v.w, v.best_w, v.stress, v.best_stress, v.wanted, v.adjoint.edge, v.adjoint.before.at,
                v.adjoint.force);
    return status;
}
