/* bounded.c: rows that bound a single dof each, as in obstacle problems: what is known of them, what holding some of
 * them as equations takes, and a guess of those that touch. */
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/error.h"
#include "law/sign.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_bounded_create(uz_sparse_load *x, const uz_bounds *bounds, const double *p, uz_error *err)
{
    int64_t d = x->load.dual->d, m = x->load.dual->m;
    uz_bounded *box = x->box = uz_alloc_zero(1, sizeof *box);
    if (!box)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load");
    double **room[] = {&box->p, &box->top, &box->bottom, &box->u, &box->force, &box->size, &box->point};
    bool ok = true;
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        ok = (*room[k] = uz_alloc(d, sizeof(double))) && ok;
    int64_t **rows[] = {&box->upper, &box->lower, &box->holder};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++)
        ok = (*rows[k] = uz_alloc(d, sizeof(int64_t))) && ok;
    box->r = uz_alloc(m, sizeof(double));
    box->fixed = uz_alloc(d, sizeof(bool));
    if (!ok || !box->r || !box->fixed)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for bounds on %lld dofs", (long long)d);
    memcpy(box->p, p, (size_t)d * sizeof *p);
    box->point_energy = INFINITY;
    box->bounds = bounds;
    /* The tightest row of each dof on either side. A bound that overflows holds nothing, or nothing can meet it. */
    for (int64_t j = 0; j < d; j++) {
        box->upper[j] = box->lower[j] = -1;
        box->top[j] = INFINITY;
        box->bottom[j] = -INFINITY;
    }
    for (int64_t i = 0; i < m; i++) {
        const int64_t j = bounds->dof[i];
        const double value = x->load.h[i] / bounds->scale[i];
        if (bounds->scale[i] > 0.0 && value < box->top[j]) {
            box->top[j] = value;
            box->upper[j] = i;
        } else if (bounds->scale[i] < 0.0 && value > box->bottom[j]) {
            box->bottom[j] = value;
            box->lower[j] = i;
        }
    }
    for (int64_t j = 0; j < d; j++)
        box->contradictory =
            box->contradictory || box->bottom[j] > box->top[j] || isinf(box->top[j]) < 0 || isinf(box->bottom[j]) > 0;
    memcpy(box->u, x->base, (size_t)d * sizeof *box->u);
    x->load.bytes += 8 * (10 * (size_t)d + (size_t)m);
    return UZ_OK;
}

void uz_bounded_free(uz_bounded *box)
{
    if (!box)
        return;
    double *room[] = {box->p, box->top, box->bottom, box->u, box->force, box->size, box->point, box->r};
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        free(room[k]);
    free(box->upper);
    free(box->lower);
    free(box->holder);
    free(box->fixed);
    free(box);
}

/* Which row holds each dof. Of several rows on a dof the tightest counts; a dof is not held from both sides. */
bool uz_bounded_hold(uz_sparse_load *x, const bool *active, bool keep)
{
    uz_bounded *box = x->box;
    const uz_bounds *bounds = box->bounds;
    const int64_t d = x->load.dual->d, m = x->load.dual->m;
    if (box->contradictory)
        return false;
    box->has_exact = false;
    for (int64_t j = 0; j < d; j++)
        box->holder[j] = -1;
    for (int64_t i = 0; i < m; i++) {
        int64_t j = bounds->dof[i];
        if (!active[i])
            continue;
        if (bounds->scale[i] > 0.0)
            box->holder[j] = box->upper[j];
        else if (box->holder[j] < 0)
            box->holder[j] = box->lower[j];
    }
    for (int64_t j = 0; j < d; j++) {
        box->fixed[j] = box->holder[j] >= 0;
        double free = keep ? box->u[j] : 0.0;
        box->u[j] = !box->fixed[j] ? free : bounds->scale[box->holder[j]] > 0.0 ? box->top[j] : box->bottom[j];
    }
    return true;
}

/* force = K u - p, and size = |K| |u| + |p|, what its rounding is in proportion to. */
void uz_bounded_balance(uz_bounded *box, const uz_csc *K)
{
    for (int64_t j = 0; j < K->cols; j++) {
        box->force[j] = -box->p[j];
        box->size[j] = fabs(box->p[j]);
    }
    for (int64_t j = 0; j < K->cols; j++) {
        /* Rows above have added their terms; the diagonal comes first in a sorted column. */
        double u = box->u[j], own = K->val[K->ptr[j]] * u, force = box->force[j] + own, size = box->size[j] + fabs(own);
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            int64_t i = K->idx[k];
            double below = K->val[k] * u, across = K->val[k] * box->u[i];
            box->force[i] += below;
            box->size[i] += fabs(below);
            force += across;
            size += fabs(across);
        }
        box->force[j] = force;
        box->size[j] = size;
    }
}

/* Signs below this, relative to the terms of a sum, are rounding: weakly active rows must not make the steps chatter.
 */
#define NOISE (64.0 * DBL_EPSILON)

/* r from what holds the dofs; `active` becomes the rows that do. A dof whose bounds meet is held from the side that it
 * leans on. */
void uz_bounded_react(const uz_sparse_load *x, double *g, bool *active)
{
    uz_bounded *box = x->box;
    const uz_bounds *bounds = box->bounds;
    const double *h = x->load.h;
    const int64_t d = x->load.dual->d, m = x->load.dual->m;
    memset(box->r, 0, (size_t)m * sizeof *box->r);
    memset(active, 0, (size_t)m * sizeof *active);
    for (int64_t j = 0; j < d; j++) {
        int64_t row = box->holder[j];
        if (row < 0)
            continue;
        if (box->top[j] <= box->bottom[j])
            row = box->force[j] > 0.0 ? box->lower[j] : box->upper[j];
        active[row] = true;
        box->r[row] = box->force[j] / bounds->scale[row];
        if (uz_reaction_pulls(box->r[row]) && fabs(box->force[j]) <= NOISE * box->size[j])
            box->r[row] = 0.0;
    }
    for (int64_t i = 0; i < m; i++) {
        double reach = bounds->scale[i] * box->u[bounds->dof[i]];
        g[i] = h[i] - reach;
        if (active[i] || (uz_gap_penetrates(g[i]) && -g[i] <= NOISE * (fabs(h[i]) + fabs(reach))))
            g[i] = 0.0;
    }
}

/* a u <= h_a and b u <= h_b with a > 0 > b: y = (b, -a) has N'y = a b - b a = 0 exactly. */
bool uz_bounded_crossed(const uz_sparse_load *x, double *y)
{
    const uz_bounded *box = x->box;
    const uz_bounds *bounds = box->bounds;
    for (int64_t j = 0; j < x->load.dual->d; j++) {
        int64_t a = box->upper[j], b = box->lower[j];
        if (a < 0 || b < 0 || !(box->bottom[j] > box->top[j]))
            continue;
        memset(y, 0, (size_t)x->load.dual->m * sizeof *y);
        y[a] = bounds->scale[b];
        y[b] = -bounds->scale[a];
        return true;
    }
    return false;
}

static double clip(double x, double least, double most)
{
    return fmin(most, fmax(least, x));
}

/* pi(u), and force = p - K u in passing. */
static double energy(uz_bounded *box, const uz_csc *K, const double *u)
{
    double sum = 0.0;
    memcpy(box->force, box->p, (size_t)K->cols * sizeof *box->p);
    uz_csc_symv(box->force, K, -1.0, u);
    for (int64_t j = 0; j < K->cols; j++)
        sum -= 0.5 * u[j] * (box->p[j] + box->force[j]);
    return sum;
}

/* Projected successive overrelaxation lowers the energy in each sweep for any factor below 2 (Cryer, SIAM J. Control 9
 * (1971)). Sweeps cost a fraction of a factorization and move the border of the contact by many dofs, where an exact
 * step moves it by one. There are more of them while they still move it. */
#define OVERRELAXATION 1.9
enum { LEAST_SWEEPS = 6, MOST_SWEEPS = 60, HALVINGS = 6 };

/* x += (K without its diagonal)_ij times u_j for i > j */
static void add_below(double *x, const uz_csc *K, int64_t j, double u)
{
    for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++)
        x[K->idx[k]] += K->val[k] * u;
}

/* Dof after dof, each by the row of K that its column of the lower triangle holds one part of; above (d) adds up the
 * other part: of the new values on the way down, of the old ones on the way up. */
static void sweep(uz_bounded *box, const uz_csc *K, bool backwards)
{
    double *u = box->point, *above = box->size;
    memset(above, 0, (size_t)K->cols * sizeof *above);
    for (int64_t j = 0; backwards && j < K->cols; j++)
        add_below(above, K, j, u[j]);
    for (int64_t k = 0; k < K->cols; k++) {
        int64_t j = backwards ? K->cols - 1 - k : k;
        double pull = box->p[j] - above[j];
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            pull -= K->val[q] * u[K->idx[q]];
        u[j] = clip(u[j] + OVERRELAXATION * pull / K->val[K->ptr[j]], box->bottom[j], box->top[j]);
        if (!backwards)
            add_below(above, K, j, u[j]);
    }
}

/* The point goes towards the last exact displacement, along a path that is cut to the bounds, by the first of the
 * lengths 1, 1/2, 1/4, ... that lowers the energy (Bertsekas, SIAM J. Control Optim. 20 (1982)). From 0, where it
 * begins, by the best of them: what overshoots its bounds by far would begin with far too many held. Where K is no
 * M-matrix, as that of a plate, exact steps by themselves go round in circles. chosen (d): room. */
static void approach(uz_bounded *box, const uz_csc *K, const double *exact, double *chosen)
{
    const bool begins = isinf(box->point_energy);
    double length = 1.0, *trial = box->size;
    bool fell = false;
    for (int64_t j = 0; begins && j < K->cols; j++)
        box->point[j] = clip(0.0, box->bottom[j], box->top[j]);
    if (begins)
        box->point_energy = energy(box, K, box->point);
    for (int k = 0; k < HALVINGS; k++, length *= 0.5) {
        for (int64_t j = 0; j < K->cols; j++)
            trial[j] = clip(box->point[j] + length * (exact[j] - box->point[j]), box->bottom[j], box->top[j]);
        const double reached = energy(box, K, trial);
        if (reached < box->point_energy) {
            memcpy(chosen, trial, (size_t)K->cols * sizeof *trial);
            box->point_energy = reached;
            fell = true;
        }
        if (fell && !(begins && reached == box->point_energy)) /* it rises again, or any will do */
            break;
    }
    if (fell)
        memcpy(box->point, chosen, (size_t)K->cols * sizeof *chosen);
}

/* How many dofs the point has at their bounds. */
static int64_t count_held(const uz_bounded *box, int64_t d)
{
    int64_t count = 0;
    for (int64_t j = 0; j < d; j++)
        count += box->point[j] >= box->top[j] || box->point[j] <= box->bottom[j];
    return count;
}

bool uz_sparse_guess_active(uz_dual_load *load, bool *active)
{
    const uz_sparse_load *x = (const uz_sparse_load *)load;
    uz_bounded *box = x->box;
    if (!box || box->contradictory)
        return false;
    /* The energy only falls, so the points converge to the solution whatever the exact steps do. */
    approach(box, load->K, box->has_exact ? box->u : x->base, x->work);
    int64_t before = -1, held = count_held(box, load->K->cols);
    for (int k = 0; k < MOST_SWEEPS && (k < LEAST_SWEEPS || held != before); k += 2) {
        sweep(box, load->K, false);
        sweep(box, load->K, true);
        before = held;
        held = count_held(box, load->K->cols);
    }
    box->point_energy = energy(box, load->K, box->point);
    memset(active, 0, (size_t)load->dual->m * sizeof *active);
    for (int64_t j = 0; j < load->K->cols; j++) {
        if (box->point[j] >= box->top[j] && box->force[j] > 0.0)
            active[box->upper[j]] = true;
        else if (box->point[j] <= box->bottom[j] && box->force[j] < 0.0)
            active[box->lower[j]] = true;
    }
    return true;
}
