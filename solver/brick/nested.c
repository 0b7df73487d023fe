/* nested.c: where a contact problem on a brick begins: its solution on coarser grids, from grid to grid.
 *
 * On each grid the rows that touch are guessed and corrected as on the finest one (Hintermueller, Ito, Kunisch, SIAM J.
 * Optim. 13 (2003)), with the load and the bounds of the finest grid there, and conjugate gradients in single precision
 * that stop as soon as they are as good as the grid. The border of the contact then moves by about a node from one grid
 * to the next. Nothing that is proved of an answer follows from this. */
#include "brick/grids.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "core/hooks.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Grids below the finest that are solved on; steps on each; conjugate gradients of a step. */
enum { GRIDS = 3, STEPS_MOST = 12, ITERATIONS_MOST = 30 };
/* In the energy norm, relative to that of the load's response. Of a plane body, whose grids cost next to nothing, more
 * digits spare the finest one steps. */
#define AS_GOOD_AS_A_GRID  3e-3
#define AS_GOOD_IN_A_PLANE 5e-5
/* A node between nodes of the coarser grid touches where so much of these does. */
#define MOSTLY 0.6F

/* Of one grid; touches: 1 at its upper bound, -1 at its lower one, 0: free. */
typedef struct {
    float *p, *bottom, *top, *u, *touches;
} grid_problem;

typedef struct {
    const uz_brick_grids *mg;
    uz_multigrid_room *room;
    grid_problem grid[GRIDS + 1]; /* of the first, which is the finest one, only p and bounds; not owned */
    float *r, *direction, *q, *zero;
    double energy; /* norm of the response on the coarsest of them */
} nested;

static bool allocate(nested *x, int last)
{
    bool ok = true;
    for (int l = 0; l <= last; l++) {
        grid_problem *g = &x->grid[l];
        float **all[] = {&g->p, &g->bottom, &g->top, &g->u, &g->touches};
        for (int k = 0; k < (l == 0 ? 3 : 5); k++)
            ok = (*all[k] = uz_alloc_zero(uz_brick_numbers(&x->mg->level[l]), sizeof(float))) && ok;
    }
    float **all[] = {&x->r, &x->direction, &x->q, &x->zero};
    for (int k = 0; k < 4; k++)
        ok = (*all[k] = uz_alloc_zero(uz_brick_numbers(&x->mg->level[1]), sizeof(float))) && ok;
    for (int l = 0; l < x->mg->base.levels; l++)
        if (!x->room->held[l])
            ok = (x->room->held[l] = uz_alloc_zero(uz_brick_numbers(&x->mg->level[l]), sizeof(float))) && ok;
    return ok;
}

static void clear(nested *x)
{
    for (int l = 0; l <= GRIDS; l++) {
        grid_problem *g = &x->grid[l];
        float *all[] = {g->p, g->bottom, g->top, g->u, g->touches};
        for (int k = 0; k < 5; k++)
            free(all[k]);
    }
    uz_free_all(x->r, x->direction, x->q, x->zero);
}

/* Load and bounds of a coarser grid: bounds are those of the node that stands there, or nearest to it. */
static void restrict_problem(nested *x, int l)
{
    const uz_brick_level *fine = &x->mg->level[l - 1], *level = &x->mg->level[l];
    const grid_problem *from = &x->grid[l - 1], *to = &x->grid[l];
    const uz_brick_vectors above = {.t = from->p}, below = {.b = to->p, .inverse = x->mg->inverse[l]};
    const int64_t *n = level->cells;
    uz_brick_restrict(fine, level, &above, &below, &x->room->planes);
    for (int64_t k = 0; k <= n[2]; k++)
        for (int64_t j = 0; j <= n[1]; j++)
            for (int64_t i = 0; i <= n[0]; i++) {
                const int64_t there = uz_brick_nearest(level, fine, i, j, k);
                for (int c = 0; c < level->axes; c++) {
                    const int64_t at = c * level->size + k * level->plane + j * level->stride + i;
                    to->bottom[at] = from->bottom[c * fine->size + there];
                    to->top[at] = from->top[c * fine->size + there];
                }
            }
}

/* u of a grid and what touches, from those of the next coarser one. touches becomes numbers between. */
static void prolong_problem(const nested *x, int l, float *u, float *touches)
{
    const uz_brick_level *level = &x->mg->level[l];
    const grid_problem *from = &x->grid[l + 1];
    float *const to[] = {u, touches}, *const of[] = {from->u, from->touches};
    for (int k = 0; k < 2; k++) {
        const uz_brick_vectors v = {.x = to[k], .inverse = x->mg->inverse[l]}, coarse = {.x = of[k]};
        uz_brick_prolong(level, level + 1, &v, &coarse, &x->room->planes);
    }
}

/* From what was interpolated: touches where most of the nodes around it do, or where u is beyond its bound. */
static float decide(float *u, float touches, float bottom, float top)
{
    const bool up = isfinite(top) && (touches > MOSTLY || *u > top),
               down = !up && isfinite(bottom) && (touches < -MOSTLY || *u < bottom);
    *u = up ? top : down ? bottom : *u;
    return up ? 1.0F : down ? -1.0F : 0.0F;
}

/* Holds what touches on the grid and on all coarser ones. */
static uz_status hold(nested *x, int l, const uz_stop *stop, uz_error *err)
{
    const uz_brick_grids *mg = x->mg;
    uz_multigrid_room *room = x->room;
    const int last = mg->base.levels - 1;
    const int64_t n = mg->level[l].axes * mg->level[l].size;
    for (int64_t i = 0; i < n; i++)
        room->held[l][i] = x->grid[l].touches[i] != 0.0F ? 0.0F : mg->inverse[l][i];
    for (int k = l; k <= last; k++) {
        if (k > l)
            uz_brick_next_inverse(room->held[k], &mg->level[k], &mg->level[k - 1], room->held[k - 1]);
        room->v[k].inverse = room->held[k];
    }
    free(room->held_coarsest);
    return uz_brick_factor_coarsest(&room->held_coarsest, mg, room->held[last], stop, err);
}

/* r = p - K u, at held dofs too. */
static void residual(const nested *x, int l)
{
    const grid_problem *g = &x->grid[l];
    const uz_brick_vectors v = {.x = g->u, .b = g->p, .t = x->r, .d = x->r, .inverse = x->mg->inverse[l]};
    uz_brick_residual(&x->mg->level[l], &v, &x->room->planes);
}

/* z = M^-1 r in room->v[l].x; sqrt(r'z). */
static double precondition(const nested *x, int l)
{
    const int64_t n = x->mg->level[l].axes * x->mg->level[l].size;
    memcpy(x->room->v[l].b, x->r, (size_t)n * sizeof(float));
    uz_brick_cycle(x->mg, x->room, l);
    return uz_long_dot_single(n, x->r, x->room->v[l].x);
}

/* A step on a grid as the threads that share its vectors see it. */
typedef struct {
    float *u, *r;
    const float *direction, *q;
    float factor;
} steps;

static void step(void *ctx, int64_t begin, int64_t end)
{
    const steps *s = ctx;
    const float alpha = s->factor, *restrict direction = s->direction, *restrict q = s->q;
    float *restrict u = s->u, *restrict r = s->r;
    for (int64_t i = begin; i < end; i++) {
        u[i] += alpha * direction[i];
        r[i] += alpha * q[i];
    }
}

/* Conjugate gradients on the dofs that are not held; r: the residual there. */
static void iterate(nested *x, int l)
{
    const int64_t n = x->mg->level[l].axes * x->mg->level[l].size;
    const float *inverse = x->room->held[l], *z = x->room->v[l].x;
    steps s = {x->grid[l].u, x->r, x->direction, x->q, 0.0F};
    const uz_brick_vectors v = {.x = x->direction, .b = x->zero, .t = x->q, .d = x->q, .inverse = inverse};
    for (int64_t i = 0; i < n; i++)
        x->r[i] = inverse[i] != 0.0F ? x->r[i] : 0.0F;
    double square = precondition(x, l);
    x->energy = fmax(x->energy, sqrt(fmax(0.0, square)));
    const double goal = (x->mg->level[l].axes == 2 ? AS_GOOD_IN_A_PLANE : AS_GOOD_AS_A_GRID) * x->energy;
    memcpy(x->direction, z, (size_t)n * sizeof(float));
    for (int k = 0; k < ITERATIONS_MOST && square > goal * goal; k++) {
        uz_brick_residual(&x->mg->level[l], &v, &x->room->planes); /* q = -K direction */
        const double curvature = -uz_long_dot_single(n, x->direction, x->q), before = square;
        if (!(curvature > 0.0))
            return;
        s.factor = (float)(square / curvature);
        uz_by_pieces(step, &s, n);
        square = precondition(x, l);
        uz_brick_turn(x->direction, z, (float)(square / before), n);
    }
}

/* All that touches wrongly changes; r: p - K u. Returns how many did. */
static int64_t exchange(const nested *x, int l)
{
    const grid_problem *g = &x->grid[l];
    int64_t changed = 0;
    for (int64_t i = 0; i < x->mg->level[l].axes * x->mg->level[l].size; i++) {
        const float before = g->touches[i], pull = x->r[i] * before;
        if (before != 0.0F && pull < 0.0F) {
            g->touches[i] = 0.0F;
            changed++;
        } else if (before == 0.0F && x->mg->inverse[l][i] != 0.0F && (g->u[i] > g->top[i] || g->u[i] < g->bottom[i])) {
            g->touches[i] = decide(&g->u[i], 0.0F, g->bottom[i], g->top[i]);
            changed++;
        }
    }
    return changed;
}

static uz_status solve_grid(nested *x, int l, const uz_stop *stop, uz_error *err)
{
    uz_status status = UZ_OK;
    for (int step = 0; step < STEPS_MOST && status == UZ_OK && !uz_stop_is_due(stop); step++) {
        status = hold(x, l, stop, err);
        if (status != UZ_OK)
            break;
        residual(x, l);
        iterate(x, l);
        residual(x, l);
        if (exchange(x, l) == 0)
            break;
    }
    return status;
}

static double larger(double most, double size)
{
    return size > most && isfinite(size) ? size : most;
}

/* The place of a dof among the limits, -1: it has none; asked for in ascending order. */
static int64_t limit_of(const uz_limits *limits, int64_t *next, int64_t dof)
{
    if (*next == limits->n || dof != (limits->dof ? limits->dof[*next] : *next))
        return -1;
    return (*next)++;
}

/* The finest grid as the threads that share its planes see it. */
typedef struct {
    const nested *x;
    const uz_limits *limits;
    double down; /* into units in which single precision holds load and bounds */
    const double *p;
    double *u;
    bool *held;
    int parts;
} finest;

enum { PARTS_MOST = 16 };

static int64_t first_plane(const finest *f, int part)
{
    return (f->x->mg->level[0].cells[2] + 1) * part / f->parts;
}

/* Of the limits the first that is on a node of this plane, or on a later one. */
static int64_t first_limit(const finest *f, int64_t plane)
{
    const uz_brick *brick = f->x->mg->brick;
    const int64_t *dof = brick->dof + brick->axes * plane * (brick->cells[0] + 1) * (brick->cells[1] + 1),
                  *end = brick->dof + brick->axes * brick->n_nodes;
    while (dof < end && *dof < 0)
        dof++;
    int64_t low = 0, high = dof < end ? f->limits->n : 0;
    while (low < high) {
        const int64_t middle = (low + high) / 2;
        if ((f->limits->dof ? f->limits->dof[middle] : middle) < *dof)
            low = middle + 1;
        else
            high = middle;
    }
    return dof < end ? low : f->limits->n;
}

static void read_part(void *ctx, int part)
{
    const finest *f = ctx;
    const nested *x = f->x;
    const uz_brick_level *level = &x->mg->level[0];
    const grid_problem *g = &x->grid[0];
    const int64_t first = first_plane(f, part), end = first_plane(f, part + 1);
    const int64_t *dof = x->mg->brick->dof + level->axes * first * (level->cells[0] + 1) * (level->cells[1] + 1);
    int64_t next = first_limit(f, first);
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j <= level->cells[1]; j++)
            for (int64_t i = 0; i <= level->cells[0]; i++, dof += level->axes)
                for (int c = 0; c < level->axes; c++) {
                    const int64_t at = c * level->size + k * level->plane + j * level->stride + i;
                    const int64_t b = limit_of(f->limits, &next, dof[c]);
                    g->p[at] = dof[c] >= 0 ? (float)(f->down * (f->p[dof[c]] / x->mg->unit)) : 0.0F;
                    g->bottom[at] = b >= 0 ? (float)(f->down * f->limits->bottom[b]) : -INFINITY;
                    g->top[at] = b >= 0 ? (float)(f->down * f->limits->top[b]) : INFINITY;
                }
}

/* Load and bounds of the finest grid; f->down. */
static void read_finest(finest *f)
{
    const uz_limits *limits = f->limits;
    double most = larger(0.0, uz_long_max(f->x->mg->base.n, f->p) / f->x->mg->unit);
    for (int64_t b = 0; b < limits->n; b++) /* of bounds those that 0 is beyond */
        most = larger(larger(most, limits->bottom[b]), -limits->top[b]);
    f->down = most > 0.0 && isfinite(most) ? ldexp(1.0, -ilogb(most)) : 1.0;
    uz_aside_share(read_part, f, f->parts);
}

static void write_part(void *ctx, int part)
{
    const finest *f = ctx;
    const nested *x = f->x;
    const uz_brick_level *level = &x->mg->level[0];
    const uz_brick_vectors *v = &x->room->v[0];
    const int64_t first = first_plane(f, part), end = first_plane(f, part + 1);
    const int64_t *dof = x->mg->brick->dof + level->axes * first * (level->cells[0] + 1) * (level->cells[1] + 1);
    int64_t next = first_limit(f, first);
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j <= level->cells[1]; j++)
            for (int64_t i = 0; i <= level->cells[0]; i++, dof += level->axes)
                for (int c = 0; c < level->axes; c++) {
                    const int64_t at = c * level->size + k * level->plane + j * level->stride + i, own = dof[c];
                    if (own < 0)
                        continue;
                    const int64_t b = limit_of(f->limits, &next, own);
                    const float touches =
                        b >= 0 ? decide(&v->x[at], v->d[at], x->grid[0].bottom[at], x->grid[0].top[at]) : 0.0F;
                    if (b >= 0)
                        f->held[b] = touches != 0.0F;
                    f->u[own] = touches > 0.0F   ? f->limits->top[b]
                                : touches < 0.0F ? f->limits->bottom[b]
                                                 : (double)v->x[at] / f->down;
                }
}

/* u of the finest grid and what it holds, from the next coarser one. */
static void write_finest(finest *f)
{
    prolong_problem(f->x, 0, f->x->room->v[0].x, f->x->room->v[0].d);
    uz_aside_share(write_part, f, f->parts);
}

uz_status uz_brick_start(const uz_multigrid *base, uz_multigrid_room *room, bool *found, double *u, bool *held,
                         const double *p, const uz_limits *limits, const uz_stop *stop, uz_error *err)
{
    nested x = {.mg = (const uz_brick_grids *)base, .room = room};
    const int last = base->levels - 1 < GRIDS ? base->levels - 1 : GRIDS;
    uz_status status = UZ_OK;
    *found = false;
    if (last < 1)
        return UZ_OK;
    if (!allocate(&x, last))
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory to begin on coarser grids of %lld dofs", (long long)base->n);
    const int64_t planes = x.mg->level[0].cells[2] + 1;
    finest f = {&x, limits, 1.0, p, u, held, planes < PARTS_MOST ? (int)planes : PARTS_MOST};
    if (status == UZ_OK)
        read_finest(&f);
    for (int l = 1; status == UZ_OK && l <= last; l++)
        restrict_problem(&x, l);
    for (int l = last; status == UZ_OK && l >= 1; l--) {
        const grid_problem *g = &x.grid[l];
        if (l < last)
            prolong_problem(&x, l, g->u, g->touches);
        for (int64_t i = 0; i < x.mg->level[l].axes * x.mg->level[l].size; i++)
            g->touches[i] =
                x.mg->inverse[l][i] != 0.0F ? decide(&g->u[i], g->touches[i], g->bottom[i], g->top[i]) : 0.0F;
        status = solve_grid(&x, l, stop, err);
    }
    if (status == UZ_OK && !uz_stop_is_due(stop)) {
        write_finest(&f);
        *found = true;
    }
    clear(&x);
    for (int l = 0; l < base->levels; l++)
        room->v[l].inverse = x.mg->inverse[l];
    free(room->held_coarsest);
    room->held_coarsest = NULL;
    return status;
}
