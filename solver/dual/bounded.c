/* bounded.c: rows that bound a single dof each, as in obstacle problems: what is known of them, what holding some of
 * them as equations takes, and a guess of those that touch. */
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/error.h"
#include "law/sign.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* The rows that bound a dof, ascending: of column j of N those whose entry is not 0. */
static bool is_bound(const uz_bounds *bounds, const uz_csc *N, int64_t k, int64_t j)
{
    return N->val[k] != 0.0 && bounds->dof[N->idx[k]] == j;
}

static bool list_dofs(uz_bounded *box, const uz_dual *dual)
{
    const uz_csc *N = &dual->N;
    box->dof = uz_alloc(dual->m < dual->d ? dual->m : dual->d, sizeof *box->dof);
    for (int64_t j = 0; box->dof && j < dual->d; j++) {
        bool bound = false;
        for (int64_t k = N->ptr[j]; !bound && k < N->ptr[j + 1]; k++)
            bound = is_bound(box->bounds, N, k, j);
        if (bound)
            box->dof[box->n++] = j;
    }
    return box->dof != NULL;
}

/* The tightest row of each dof on either side. A bound that overflows holds nothing, or nothing can meet it. */
static void find_tightest(uz_bounded *box, const uz_dual_load *load)
{
    const uz_bounds *bounds = box->bounds;
    const uz_csc *N = &load->dual->N;
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t j = box->dof[b];
        box->upper[b] = box->lower[b] = -1;
        box->top[b] = INFINITY;
        box->bottom[b] = -INFINITY;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            const int64_t i = N->idx[k];
            if (!is_bound(bounds, N, k, j))
                continue;
            const double value = load->h[i] / bounds->scale[i];
            if (bounds->scale[i] > 0.0 && value < box->top[b]) {
                box->top[b] = value;
                box->upper[b] = i;
            } else if (bounds->scale[i] < 0.0 && value > box->bottom[b]) {
                box->bottom[b] = value;
                box->lower[b] = i;
            }
        }
        box->contradictory =
            box->contradictory || box->bottom[b] > box->top[b] || isinf(box->top[b]) < 0 || isinf(box->bottom[b]) > 0;
    }
}

uz_status uz_bounded_create(uz_sparse_load *x, const uz_bounds *bounds, uz_error *err)
{
    const uz_dual *dual = x->load.dual;
    const bool sized = uz_sparse_has_entries(dual);
    const int64_t d = dual->d, m = dual->m;
    uz_bounded *box = x->box = uz_alloc_zero(1, sizeof *box);
    if (!box)
        return uz_no_memory(err, "a load");
    box->bounds = bounds;
    bool ok = list_dofs(box, dual);
    double **room[] = {&box->top, &box->bottom, &box->u, &box->size};
    const int64_t count[] = {box->n, box->n, d, d};
    for (size_t k = 0; k < (sized ? 4 : 3); k++)
        ok = (*room[k] = uz_alloc(count[k], sizeof(double))) && ok;
    int64_t **rows[] = {&box->upper, &box->lower, &box->holder};
    for (size_t k = 0; k < sizeof rows / sizeof rows[0]; k++)
        ok = (*rows[k] = uz_alloc(box->n, sizeof(int64_t))) && ok;
    box->r = uz_alloc(m, sizeof(double));
    box->fixed = uz_alloc_zero(d, sizeof(bool));
    if (!ok || !box->r || !box->fixed)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for bounds on %lld dofs", (long long)d);
    box->p = x->p;
    box->force = x->work2;
    box->point_energy = INFINITY;
    find_tightest(box, &x->load);
    uz_long_copy(d, box->u, x->base);
    x->load.bytes += 8 * (size_t)((sized ? 2 : 1) * d + 6 * box->n + m) + (size_t)d;
    return UZ_OK;
}

/* Which row holds each dof. Of several rows on a dof the tightest counts; a dof is not held from both sides. */
bool uz_bounded_hold(uz_sparse_load *x, const bool *active, bool keep)
{
    uz_bounded *box = x->box;
    const uz_bounds *bounds = box->bounds;
    const uz_csc *N = &x->load.dual->N;
    if (box->contradictory)
        return false;
    x->known_u = x->known_r = NULL;
    if (!keep) {
        memset(box->u, 0, (size_t)x->load.dual->d * sizeof *box->u);
        box->balanced = false;
    }
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t j = box->dof[b];
        int64_t holder = -1;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            const int64_t i = N->idx[k];
            if (!active[i] || !is_bound(bounds, N, k, j))
                continue;
            if (bounds->scale[i] > 0.0)
                holder = box->upper[b];
            else if (holder < 0)
                holder = box->lower[b];
        }
        box->holder[b] = holder;
        box->fixed[j] = holder >= 0;
        if (holder < 0)
            continue;
        const double held = bounds->scale[holder] > 0.0 ? box->top[b] : box->bottom[b];
        box->balanced = box->balanced && box->u[j] == held;
        box->u[j] = held;
    }
    return true;
}

/* Of the magnitudes of a row of K the largest share that its diagonal has not: an element of three dimensions has four
 * times its diagonal. */
#define ROW_SUM 4.0

static void subtract_load(void *ctx, int64_t begin, int64_t end)
{
    const uz_bounded *box = ctx;
    for (int64_t j = begin; j < end; j++)
        box->force[j] -= box->p[j];
}

/* Where K has its diagonal only, or roughly does: the force by its product, and for size what a row of a mesh of equal
 * cells may add up to with the largest displacement that there is. */
static void balance_by_product(const uz_sparse_load *x)
{
    uz_bounded *box = x->box;
    uz_sparse_multiply(&x->load, box->force, box->u);
    box->largest = uz_long_max(x->load.K->cols, box->u);
    uz_by_pieces(subtract_load, box, x->load.K->cols);
}

static double size_of(const uz_bounded *box, const uz_csc *K, int64_t j)
{
    return box->largest < 0.0 ? box->size[j] : fabs(box->p[j]) + ROW_SUM * K->val[K->ptr[j]] * box->largest;
}

/* Is there a reaction that may be rounding, so that it matters how large that is? */
static bool has_doubts(const uz_bounded *box)
{
    bool doubts = false;
    for (int64_t b = 0; b < box->n && !doubts; b++) {
        const int64_t row = box->holder[b];
        doubts = row >= 0 && uz_reaction_pulls(box->force[box->dof[b]] / box->bounds->scale[row]);
    }
    return doubts;
}

/* What columns add to the sizes of held dofs. */
static void add_sizes(void *ctx, int64_t begin, int64_t end)
{
    const uz_sparse_load *x = ctx;
    const uz_csc *K = x->load.K;
    const bool *held = x->box->fixed;
    const double *u = x->box->u;
    double *size = x->box->size;
    for (int64_t j = begin; j < end; j++) {
        for (int64_t k = K->ptr[j]; held[j] && k < K->ptr[j + 1]; k++)
            size[j] += fabs(K->val[k] * u[K->idx[k]]);
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            if (held[K->idx[k]] && K->idx[k] != j)
                size[K->idx[k]] += fabs(K->val[k] * u[j]);
    }
}

/* size = |K| |u| + |p| of held dofs, which alone are asked for it. */
static void find_sizes(const uz_sparse_load *x)
{
    const uz_bounded *box = x->box;
    for (int64_t b = 0; b < box->n; b++)
        box->size[box->dof[b]] = fabs(box->p[box->dof[b]]);
    uz_by_columns(add_sizes, (void *)(uintptr_t)x, x->load.K);
}

/* force, and size of all dofs. */
static void balance_by_entries(const uz_sparse_load *x)
{
    uz_bounded *box = x->box;
    const uz_csc *K = x->load.K;
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

/* force = K u - p, and size of held dofs, what its rounding is in proportion to; roughly: by an estimate of it, which
 * also has to do where a product alone is faster and shows no row that pulls. */
void uz_bounded_balance(const uz_sparse_load *x, bool roughly)
{
    uz_bounded *box = x->box;
    const bool entries = uz_sparse_has_entries(x->load.dual);
    if (roughly || x->room || !entries)
        balance_by_product(x);
    box->balanced = true;
    if (roughly || !entries || (x->room && !has_doubts(box)))
        return;
    box->largest = -1.0;
    if (x->room)
        find_sizes(x);
    else
        balance_by_entries(x);
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
    const int64_t m = x->load.dual->m;
    memset(box->r, 0, (size_t)m * sizeof *box->r);
    memset(active, 0, (size_t)m * sizeof *active);
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t j = box->dof[b];
        int64_t row = box->holder[b];
        if (row < 0)
            continue;
        if (box->top[b] <= box->bottom[b])
            row = box->force[j] > 0.0 ? box->lower[b] : box->upper[b];
        active[row] = true;
        box->r[row] = box->force[j] / bounds->scale[row];
        if (uz_reaction_pulls(box->r[row]) && fabs(box->force[j]) <= NOISE * size_of(box, x->load.K, j))
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
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t upper = box->upper[b], lower = box->lower[b];
        if (upper < 0 || lower < 0 || !(box->bottom[b] > box->top[b]))
            continue;
        memset(y, 0, (size_t)x->load.dual->m * sizeof *y);
        y[upper] = bounds->scale[lower];
        y[lower] = -bounds->scale[upper];
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
 * (1971)). Sweeps move the border of the contact by many dofs, where an exact step moves it by one, and far from the
 * border there is little to do where the point is that of the exact step: then they go over the dofs within so many
 * links of it. There are more of them while they still move it. */
#define OVERRELAXATION 1.9
enum { LINKS = 24, MOST_LINKS = 1000, SHARE = 6, LEAST_SWEEPS = 6, MOST_SWEEPS = 60, HALVINGS = 6 };

/* The point goes towards the last exact displacement, along a path that is cut to the bounds, by the first of the
 * lengths 1, 1/2, 1/4, ... that lowers the energy (Bertsekas, SIAM J. Control Optim. 20 (1982)). From 0, where it
 * begins, by the best of them: what overshoots its bounds by far would begin with far too many held. Where K is no
 * M-matrix, as that of a plate, exact steps by themselves go round in circles. chosen (d): room. false: it does not get
 * there. */
static bool approach(uz_bounded *box, const uz_csc *K, const double *exact, double *chosen)
{
    const bool begins = isinf(box->point_energy);
    double length = 1.0, *trial = box->size;
    bool fell = false, there = false;
    for (int64_t j = 0; begins && j < K->cols; j++)
        box->point[j] = clip(0.0, box->least[j], box->most[j]);
    if (begins)
        box->point_energy = energy(box, K, box->point);
    for (int k = 0; k < HALVINGS; k++, length *= 0.5) {
        for (int64_t j = 0; j < K->cols; j++)
            trial[j] = clip(box->point[j] + length * (exact[j] - box->point[j]), box->least[j], box->most[j]);
        const double reached = energy(box, K, trial);
        if (reached < box->point_energy) {
            memcpy(chosen, trial, (size_t)K->cols * sizeof *trial);
            box->point_energy = reached;
            fell = true;
            there = k == 0;
        }
        if (fell && !(begins && reached == box->point_energy)) /* it rises again, or any will do */
            break;
    }
    if (fell)
        memcpy(box->point, chosen, (size_t)K->cols * sizeof *chosen);
    return there;
}

/* The dofs that are swept, in a row, with their part of K. */
typedef struct {
    int64_t n, held;       /* held: at their bounds */
    int32_t *links, most;  /* d: to the border; those of the farthest in the region */
    int64_t *place;        /* d: in the region, -1: elsewhere */
    int64_t *dof;          /* n */
    int64_t *ptr, *idx;    /* n + 1, ptr[n]: the others that each is coupled with */
    double *val, *inverse; /* ptr[n]; n: of the diagonal */
    double *pull, *u;      /* n: p less what dofs elsewhere take; displacements */
} region;

static bool is_held(const uz_bounded *box, int64_t j)
{
    return box->point[j] >= box->most[j] || box->point[j] <= box->least[j];
}

/* Links from each dof to the next one at the border of the contact, or that pulls at its bound; force = p - K point.
 * Passes down and up the columns: exact where dofs are numbered along a mesh, else rather too many. */
static void count_links(region *x, const uz_bounded *box, const uz_csc *K)
{
    for (int64_t j = 0; j < K->cols; j++) {
        const bool pulls = (box->point[j] >= box->most[j] && box->force[j] < 0.0) ||
                           (box->point[j] <= box->least[j] && box->force[j] > 0.0);
        x->links[j] = pulls ? 0 : MOST_LINKS + 1;
    }
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++)
            if (is_held(box, j) != is_held(box, K->idx[k]))
                x->links[j] = x->links[K->idx[k]] = 0;
    for (int64_t pass = 0; pass < 4; pass++)
        for (int64_t q = 0; q < K->cols; q++) {
            const int64_t j = pass % 2 ? K->cols - 1 - q : q;
            int32_t own = x->links[j];
            for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++)
                own = x->links[K->idx[k]] + 1 < own ? x->links[K->idx[k]] + 1 : own;
            x->links[j] = own;
            for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++)
                if (own + 1 < x->links[K->idx[k]])
                    x->links[K->idx[k]] = own + 1;
        }
    int64_t count[MOST_LINKS + 2] = {0}, within = 0;
    for (int64_t j = 0; j < K->cols; j++)
        count[x->links[j]]++;
    for (x->most = 0; x->most < MOST_LINKS; x->most++) {
        within += count[x->most];
        if (x->most >= LINKS && SHARE * (within + count[x->most + 1]) > K->cols)
            break;
    }
}

/* box->force = p - K point at entry; whole: all dofs; false: no memory, and no sweeps. */
static bool enter_region(region *x, const uz_bounded *box, const uz_csc *K, bool whole)
{
    *x = (region){.links = uz_alloc(K->cols, sizeof *x->links), .place = uz_alloc(K->cols, sizeof *x->place)};
    if (!x->links || !x->place)
        return false;
    if (!whole)
        count_links(x, box, K);
    for (int64_t j = 0; j < K->cols; j++)
        x->place[j] = whole || x->links[j] <= x->most ? x->n++ : -1;
    x->dof = uz_alloc(x->n, sizeof *x->dof);
    x->ptr = uz_alloc_zero(x->n + 2, sizeof *x->ptr);
    x->inverse = uz_alloc(x->n, sizeof *x->inverse);
    x->pull = uz_alloc(x->n, sizeof *x->pull);
    x->u = uz_alloc(x->n, sizeof *x->u);
    if (!x->dof || !x->ptr || !x->inverse || !x->pull || !x->u)
        return false;
    int64_t *next = x->ptr + 1; /* of each dof's entries: their number, then where the next one goes */
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j] + 1; x->place[j] >= 0 && k < K->ptr[j + 1]; k++)
            if (x->place[K->idx[k]] >= 0) {
                next[x->place[j] + 1]++;
                next[x->place[K->idx[k]] + 1]++;
            }
    for (int64_t a = 0; a < x->n; a++)
        next[a + 1] += next[a];
    x->idx = uz_alloc(next[x->n], sizeof *x->idx);
    x->val = uz_alloc(next[x->n], sizeof *x->val);
    if (!x->idx || !x->val)
        return false;
    for (int64_t j = 0; j < K->cols; j++) {
        const int64_t a = x->place[j];
        if (a < 0)
            continue;
        x->dof[a] = j;
        x->u[a] = box->point[j];
        x->inverse[a] = 1.0 / K->val[K->ptr[j]];
        x->pull[a] = box->force[j] + K->val[K->ptr[j]] * box->point[j];
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            const int64_t b = x->place[K->idx[k]];
            if (b < 0)
                continue;
            x->idx[next[a]] = b;
            x->val[next[a]++] = K->val[k];
            x->idx[next[b]] = a;
            x->val[next[b]++] = K->val[k];
        }
    }
    for (int64_t a = 0; a < x->n; a++)
        for (int64_t k = x->ptr[a]; k < x->ptr[a + 1]; k++)
            x->pull[a] += x->val[k] * x->u[x->idx[k]];
    return true;
}

/* Dof after dof, on the way down or up. */
static void sweep(region *x, const uz_bounded *box, bool backwards)
{
    x->held = 0;
    for (int64_t q = 0; q < x->n; q++) {
        const int64_t a = backwards ? x->n - 1 - q : q, j = x->dof[a];
        double pull = x->pull[a] - x->u[a] / x->inverse[a];
        for (int64_t k = x->ptr[a]; k < x->ptr[a + 1]; k++)
            pull -= x->val[k] * x->u[x->idx[k]];
        x->u[a] = clip(x->u[a] + OVERRELAXATION * pull * x->inverse[a], box->least[j], box->most[j]);
        x->held += x->u[a] >= box->most[j] || x->u[a] <= box->least[j];
    }
}

/* What sweeps need besides, at the first of them. */
static bool make_point(uz_sparse_load *x)
{
    uz_bounded *box = x->box;
    const int64_t d = x->load.dual->d;
    if (box->point)
        return true;
    if (!(box->point = uz_alloc(3 * d, sizeof *box->point)))
        return false;
    box->most = box->point + d;
    box->least = box->most + d;
    for (int64_t j = 0; j < d; j++) {
        box->most[j] = INFINITY;
        box->least[j] = -INFINITY;
    }
    for (int64_t b = 0; b < box->n; b++) {
        box->most[box->dof[b]] = box->top[b];
        box->least[box->dof[b]] = box->bottom[b];
    }
    x->load.bytes += 3 * sizeof *box->point * (size_t)d;
    return true;
}

bool uz_sparse_guess_active(uz_dual_load *load, bool *active)
{
    uz_sparse_load *x = (uz_sparse_load *)load;
    const uz_csc *K = load->K;
    uz_bounded *box = x->box;
    region near;
    if (!box || box->contradictory || !uz_sparse_has_entries(load->dual) ||
        !make_point(x)) /* sweeps go by entries of K */
        return false;
    box->balanced = false;
    /* The energy only falls, so the points converge to the solution whatever the exact steps do. */
    const bool there = approach(box, K, x->known_u ? box->u : x->base, x->work);
    (void)energy(box, K, box->point);
    const bool room = enter_region(&near, box, K, !there);
    int64_t before = -1;
    for (int k = 0; room && k < MOST_SWEEPS && (k < LEAST_SWEEPS || near.held != before); k += 2) {
        before = near.held;
        sweep(&near, box, false);
        sweep(&near, box, true);
    }
    box->swept_bytes = 12 * (size_t)K->cols + (room ? 40 * (size_t)near.n + 16 * (size_t)near.ptr[near.n] : 0);
    for (int64_t a = 0; room && a < near.n; a++)
        box->point[near.dof[a]] = near.u[a];
    uz_free_all(near.links, near.place, near.dof, near.ptr, near.idx, near.val, near.inverse, near.pull, near.u);
    box->point_energy = energy(box, K, box->point);
    memset(active, 0, (size_t)load->dual->m * sizeof *active);
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t j = box->dof[b];
        if (box->point[j] >= box->top[b] && box->force[j] > 0.0)
            active[box->upper[b]] = true;
        else if (box->point[j] <= box->bottom[b] && box->force[j] < 0.0)
            active[box->lower[b]] = true;
    }
    return true;
}
