/* matrix_free.c: the dual operator by conjugate gradients: no factor of K.
 *
 * Every solve stops at a tolerance, and what it leaves is bounded: with the residual s of K u = p + N'r and lambda from
 * uz_amg_info, ||u - u(r)||_K^2 = s'K^-1 s <= s'M^-1 s / lambda. That slack is part of the bound on the answer,
 * so that a tolerance decides about time and never about what is certified.
 *
 * Rule for the tolerance of D r: an error in u(r) of delta in the energy norm changes the dual gradient by N delta, and
 * (N delta)'(r - r*) <= ||delta||_K ||u(r) - u*||_K, so the iteration comes as near as delta, and no step of it should
 * be falsified by more than a share of its own size (Schmidt, Le Roux, Bach, NIPS 2011, for proximal gradients with
 * decreasing errors). Each solve starts at the last response and reduces the residual, which is the size of the change,
 * by CHANGE_KEPT, unless a FLOOR of the aim is reached before. Where the iterations are to be those of the exact
 * operator (an aim of 0) the share is EXACT_CHANGE, which no test of a step or its direction can tell from 0.
 *
 * Given rows as equations, where each row bounds a single dof: conjugate gradients on the dofs that are free, with the
 * others held in the multigrid of the whole body; other rows: on the displacements that obey them (projected.h). */
#include "dual/multigrid_cost.h"
#include "dual/projected.h"
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/digest.h"
#include "core/error.h"
#include "law/sign.h"
#include "linalg/blas.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FLOOR 1e-3
/* The base may be far larger than the answer: a body without its obstacle sags much further. */
#define BASE_FLOOR 1e-5
/* Where rows are bounds an answer of the active set does not come from the base, which begins it: until D is applied it
 * stays as rough as that. So it is before anybody has said what it is for. */
#define BASE_ROUGH 1e-3
/* The same where few of the dofs have bounds: the first guess of the rows is worse than this anyway. */
#define BASE_ROUGHER 0.1
#define FIRST_AIM    1e-10
/* Share of a change of the response that an application of D may leave unsolved. */
#define CHANGE_KEPT 0.01
/* The same where the response is carried along from step to step: conjugate steps take 51 iterations for 808 on the
 * paper's body of 60 x 20 cells. */
#define CARRIED_KEPT 1e-4
/* The same where the iterations are to be those of the exact operator, and an aim for the floor. */
#define EXACT_CHANGE 1e-6
#define EXACT_AIM    1e-11
/* As far the residual of conjugate gradients is that of their answer, which is looked at afterwards anyway. */
#define NO_DRIFT 1e-8
enum { STEPS_MOST = 5000 };

/* Parts of a vector that have digests of their own, for as many threads. */
enum { DIGESTS = 4 };

/* How well the equations of a load are solved. Slacks are bounds in the energy norm. */
typedef struct {
    uz_sparse_load sparse;
    uz_cg cg;   /* of the whole body */
    double aim; /* relative */
    uz_stop stop;
    double base_slack; /* of base = K^-1 p, */
    double base_aim;   /* and what it was solved for; INFINITY: not at all, it is 0 */
    double held_slack; /* of known_u, while it is there */
    double wanted;     /* what that was to be, had the body no other way to move than those that are left to it */
    double share;      /* of tolerances that are as good as exact: of a guess whose slack was far more than that */
    bool unmeasured;   /* and while nobody has asked for it: its guess was seen to be wrong on the way, or pulls */
    bool cut;          /* known_r is without what pulled: known_u is the answer for it, but not to begin at */
    int refused;       /* guesses that were left to steps of the active set */
    bool near;         /* box->u and box->r are near the answer, and nobody has begun there yet */
    bool started;      /* on coarser grids */
    double tight;      /* relative accuracy of a change of the response, */
    double probed;     /* and while probing */
    bool probing;      /* r is a vector of any size: the answer's says nothing about how accurate D r must be */
    double coarse;     /* accuracy at which the next guess of the active rows is judged */
    double *right;     /* d: a right-hand side, or what solves one to bound a norm */
    double *u, *r;     /* d, m: the last answer of rows of many entries; NULL: none was asked for */
    int guesses;       /* of these rows so far, most of which were wrong */
    char bounded[DIGESTS][65]; /* digests of the parts of the e whose e'K^-1 e was bounded last, "" before, */
    double bound;              /* and that bound */
    double enough;             /* which is sharp, or not above this */
} free_load;

/* Guesses of rows of many entries that are solved for before iterations do better. */
enum { GUESSES_MOST = 40 };

/* Have the rows an active set, so that answers need not come from the base? */
static bool may_hold(const free_load *x)
{
    return x->sparse.box || (!x->cg.mg->kind->solve && !x->cg.mg->knows_K && x->guesses < GUESSES_MOST);
}

enum { REFUSED_MOST = 20 };

static uz_cg_stop stop_at(const free_load *x, double relative, double absolute)
{
    return (uz_cg_stop){.relative = relative,
                        .absolute = absolute,
                        .max_iterations = STEPS_MOST,
                        .hooks = x->stop.hooks,
                        .deadline = x->stop.deadline};
}

/* base = K^-1 p to the aim, from where it stands, unless it is there; psi0 and g0 with it. */
static uz_status solve_base(free_load *x, double aim, uz_error *err)
{
    if (aim >= x->base_aim)
        return UZ_OK;
    uz_dual_load *load = &x->sparse.load;
    double *base = x->sparse.base;
    int64_t d = load->dual->d;
    uz_cg_info info;
    double root = sqrt(load->dual->amg->info.lambda), norm = uz_root(uz_long_dot(d, x->sparse.p, base));
    /* From 0 the first residual has the size of the solution. */
    uz_cg_stop stop = stop_at(x, norm > 0.0 ? 0.0 : aim * root, aim * norm * root);
    stop.unchecked = aim >= NO_DRIFT;
    uz_status status = uz_cg_solve(&info, base, &x->cg, load->K, x->sparse.p, &stop, err);
    if (status != UZ_OK)
        return status;
    x->base_aim = aim;
    x->base_slack = info.last / root;
    x->sparse.slack = x->base_slack;
    load->psi0 = -0.5 * uz_long_dot(d, x->sparse.p, base);
    memcpy(load->g0, load->h, (size_t)load->dual->m * sizeof *load->g0);
    uz_csc_gaxpy(load->g0, &load->dual->N, -1.0, base);
    return UZ_OK;
}

static uz_status make_load(uz_dual_load *load, const double *p, uz_error *err)
{
    free_load *x = (free_load *)load;
    int64_t d = load->dual->d;
    uz_status status = uz_sparse_load_begin(&x->sparse, err);
    if (status != UZ_OK)
        return status;
    x->aim = FIRST_AIM;
    x->stop.deadline = INFINITY;
    x->tight = CHANGE_KEPT;
    x->share = 1.0;
    x->base_aim = INFINITY;
    x->sparse.p = uz_alloc(d, sizeof *x->sparse.p);
    x->right = uz_alloc(d, sizeof *x->right);
    status = x->sparse.p && x->right
                 ? uz_cg_init(&x->cg, load->dual->amg->mg, err)
                 : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)d);
    if (status != UZ_OK)
        return status;
    load->bytes += 16 * (size_t)d + x->cg.bytes;
    x->sparse.room = x->cg.room;
    uz_long_copy(d, x->sparse.p, p);
    x->base_slack = INFINITY;
    /* Where coarser grids or an answer nearby tell which rows touch nothing needs a base until D is applied. */
    const bool told =
        (x->cg.mg->kind->start || load->near_u) && load->dual->m > 0 && ((const uz_sparse *)load->dual)->bounds.dof;
    if (!told)
        status =
            solve_base(x, load->dual->m > 0 && uz_bounds_are_few(load->dual->m, d) ? BASE_ROUGHER : BASE_ROUGH, err);
    if (status == UZ_OK)
        status = uz_sparse_load_end(&x->sparse, p, !told, err);
    x->near = status == UZ_OK && told && load->near_u;
    if (x->near) {
        uz_long_copy(d, x->sparse.box->u, load->near_u);
        memcpy(x->sparse.box->r, load->near_r, (size_t)load->dual->m * sizeof *x->sparse.box->r);
    }
    return status;
}

static void unload(uz_dual_load *load)
{
    free_load *x = (free_load *)load;
    uz_cg_clear(&x->cg);
    uz_free_all(x->right, x->u, x->r);
    uz_sparse_unload(&x->sparse);
}

static uz_status aim_at(uz_dual_load *load, double relative_error, uz_error *err)
{
    free_load *x = (free_load *)load;
    x->tight = relative_error > 0.0 ? CHANGE_KEPT : EXACT_CHANGE;
    x->aim = relative_error > 0.0 ? relative_error : EXACT_AIM;
    x->stop = load->stop;
    return may_hold(x) ? UZ_OK : solve_base(x, BASE_FLOOR * x->aim, err);
}

static void probe(uz_dual_load *load, bool begin, double accuracy)
{
    free_load *x = (free_load *)load;
    x->probing = begin;
    x->probed = accuracy > 0.0 ? accuracy : FLOOR * x->aim;
    /* Of another size than what comes: no start for it. */
    memset(x->sparse.response, 0, (size_t)load->dual->d * sizeof *x->sparse.response);
}

/* Nobody bounds an answer by rows that pull: what it misses is left at INFINITY. */
static bool may_bound(free_load *x, const double *r)
{
    bool pulls = false;
    for (int64_t i = 0; i < x->sparse.load.dual->m; i++)
        pulls = pulls || uz_reaction_pulls(r[i]);
    x->sparse.slack = x->held_slack = INFINITY;
    return !pulls;
}

/* What u misses of K u = p + N'r, in the norm of K^-1; e (d): force - N'r. */
static uz_status measure_slack(free_load *x, const double *e, uz_error *err)
{
    const uz_dual *dual = x->sparse.load.dual;
    const uz_status status = uz_multigrid_apply(x->cg.mg, x->sparse.load.K, x->cg.room, x->cg.p, e, err);
    x->sparse.slack = x->held_slack = uz_root(uz_long_dot(dual->d, e, x->cg.p) / dual->amg->info.lambda);
    return status;
}

/* The same of bounds and r (m), which becomes theirs: e is the forces on free dofs, and on held ones what r does not
 * bear. */
static uz_status measure_held(free_load *x, const double *r, uz_error *err)
{
    uz_bounded *box = x->sparse.box;
    const uz_bounds *bounds = box->bounds;
    const int64_t m = x->sparse.load.dual->m;
    double *e = x->cg.r;
    x->unmeasured = false;
    for (int64_t i = 0; i < m; i++) {
        x->cut = x->cut || r[i] != box->r[i];
        box->r[i] = r[i];
    }
    uz_long_copy(x->cg.n, e, box->force);
    for (int64_t i = 0; i < m; i++)
        e[bounds->dof[i]] -= bounds->scale[i] * box->r[i];
    return measure_slack(x, e, err);
}

/* Is r the answer of the last guess of the active rows? While that is unmeasured, be it without what pulls. */
static bool is_guessed(const free_load *x, const double *r)
{
    const double *known = x->sparse.known_r;
    bool guessed = !x->probing && x->sparse.known_u && !x->cut;
    for (int64_t i = 0; i < x->sparse.load.dual->m && guessed; i++)
        guessed = r[i] == known[i] || (x->unmeasured && r[i] == 0.0 && uz_reaction_pulls(known[i]));
    return guessed;
}

/* Without a solve: r is 0, or that answer, whose displacement is there. */
static bool apply_known(free_load *x, double *Dr, const double *r, uz_status *status, uz_error *err)
{
    uz_dual_load *load = &x->sparse.load;
    const double *u = x->sparse.known_u;
    const int64_t d = load->dual->d, m = load->dual->m;
    const bool guessed = is_guessed(x, r);
    bool zero = !x->probing;
    for (int64_t i = 0; i < m && zero; i++)
        zero = r[i] == 0.0;
    if (!zero && !guessed)
        return false;
    if (guessed && x->unmeasured)
        *status = measure_held(x, r, err);
    memset(Dr, 0, (size_t)m * sizeof *Dr);
    if (guessed) {
        for (int64_t j = 0; j < d; j++)
            x->sparse.response[j] = u[j] - x->sparse.base[j];
        uz_csc_gaxpy(Dr, &load->dual->N, 1.0, x->sparse.response);
    } else {
        memset(x->sparse.response, 0, (size_t)d * sizeof *x->sparse.response);
    }
    x->sparse.slack = guessed ? x->held_slack : x->base_slack;
    load->left = guessed ? x->held_slack + x->base_slack : 0.0;
    return true;
}

static uz_status apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    free_load *x = (free_load *)load;
    const uz_dual *dual = load->dual;
    bool begins = load->begins && !x->probing; /* at r = 0 */
    for (int64_t i = 0; i < dual->m && begins; i++)
        begins = r[i] == 0.0;
    /* a guess that is to be bounded at an end has its displacement, and there may be no time for another */
    const bool needless = begins || (x->unmeasured && is_guessed(x, r));
    uz_status status = isinf(x->base_aim) && !needless ? solve_base(x, BASE_ROUGH, err) : UZ_OK;
    if (status != UZ_OK || apply_known(x, Dr, r, &status, err))
        return status;
    const bool bounds = x->sparse.box != NULL;
    status = bounds ? UZ_OK : solve_base(x, BASE_FLOOR * x->aim, err);
    if (status != UZ_OK)
        return status;
    const double root = sqrt(load->dual->amg->info.lambda), base = uz_root(-2.0 * load->psi0);
    double psi, norm2;
    uz_cg_info info;
    memset(Dr, 0, (size_t)dual->m * sizeof *Dr);
    uz_csc_gaxpy(Dr, &dual->N, 1.0, x->sparse.response);
    uz_dual_load_energies(load, &psi, &norm2, r, Dr);
    const double norm = fmax(1e-3 * base, fmin(base, sqrt(norm2))); /* ||u(r)||_K about, with the last response */
    const double tight = load->carried ? fmin(x->tight, CARRIED_KEPT) : x->tight;
    uz_cg_stop stop = x->probing ? stop_at(x, x->probed, 0.0) : stop_at(x, tight, FLOOR * x->aim * norm * root);
    memset(x->right, 0, (size_t)dual->d * sizeof *x->right);
    uz_csc_gaxpy_t(x->right, &dual->N, 1.0, r);
    status = uz_cg_solve(&info, x->sparse.response, &x->cg, load->K, x->right, &stop, err);
    memset(Dr, 0, (size_t)dual->m * sizeof *Dr);
    if (status != UZ_OK)
        return status;
    uz_csc_gaxpy(Dr, &dual->N, 1.0, x->sparse.response);
    load->left = info.last / root;
    if (bounds && base > 0.0) /* as well as the response */
        status = solve_base(x, fmax(BASE_FLOOR * x->aim, 0.5 * load->left / base), err);
    x->sparse.slack = x->base_slack + load->left;
    return status;
}

/* The residual's share of the value that is sharp enough, as a share of its root. */
#define SHARP 0.1
/* The same of what is left of what is enough, where nothing of M is believed. */
#define UNSOLVED 0.9
enum { NORM_STEPS_MOST = 400 };

/* s'K^-1 s at most, s = e - K w, by what does not depend on M, with all that rounding may hide in s. */
static double bound_remainder(const free_load *x, const double *e, const double *w)
{
    const uz_csc *K = x->sparse.load.K;
    const uz_amg_info *info = &x->sparse.load.dual->amg->info;
    double left = 0.0, size = 0.0, reach = 0.0;
    for (int64_t j = 0; j < x->cg.n; j++) {
        const double own = K->val[K->ptr[j]];
        left += x->cg.r[j] * x->cg.r[j] / own;
        size += e[j] * e[j] / own;
        reach += w[j] * w[j] * own;
    }
    const double norm = sqrt(left) + info->rounding * sqrt(reach) + DBL_EPSILON * sqrt(size);
    return isnan(norm) ? INFINITY : norm * norm / info->least;
}

/* w'(e + s), the larger by what rounding may hide in s. */
static double first_part(const free_load *x, const double *e, const double *w)
{
    const double rounding = x->sparse.load.dual->amg->info.rounding;
    const uz_csc *K = x->sparse.load.K;
    double sum = 0.0, reach = 0.0;
    for (int64_t j = 0; j < x->cg.n; j++) {
        sum += w[j] * (e[j] + x->cg.r[j]);
        reach += w[j] * w[j] * K->val[K->ptr[j]];
    }
    return isnan(sum) ? INFINITY : fmax(0.0, sum) + rounding * reach;
}

enum { SHARPENED_MOST = 4 };

/* The same value by solves of which nothing is believed: better ones, until it is small enough, or what they leave is
 * small whatever M is. */
static uz_status sharpen(free_load *x, double *value, double *w, const double *e, double first, double enough,
                         uz_error *err)
{
    double part = first_part(x, e, w), left = bound_remainder(x, e, w), last = first;
    uz_status status = UZ_OK;
    *value = part + left;
    for (int k = 0; status == UZ_OK && k < SHARPENED_MOST && isfinite(left); k++) {
        const double harmless = fmax(SHARP * SHARP * part, UNSOLVED * (enough - part));
        if (!(left > harmless) || *value <= enough)
            break;
        const uz_cg_stop stop = {.absolute = 0.5 * last * sqrt(harmless / left),
                                 .max_iterations = NORM_STEPS_MOST,
                                 .hooks = x->stop.hooks,
                                 .deadline = x->stop.deadline};
        const double before = left;
        uz_cg_info info;
        status = uz_cg_solve(&info, w, &x->cg, x->sparse.load.K, e, &stop, err);
        part = first_part(x, e, w);
        left = bound_remainder(x, e, w);
        last = info.last;
        *value = fmin(*value, part + left); /* each is a bound */
        if (!(left < 0.5 * before))
            break;
    }
    return status;
}

typedef struct {
    const double *e, *w, *s;
} remaining;

static double find_product(void *ctx, int64_t begin, int64_t end)
{
    const remaining *x = ctx;
    double sum = 0.0;
    for (int64_t j = begin; j < end; j++)
        sum += x->w[j] * (x->e[j] + x->s[j]);
    return sum;
}

/* w'(e + s) + s'M^-1 s / lambda, where w has left `last`. */
static double bound_by_cycle(const free_load *x, const double *e, const double *w, double last)
{
    const double sum = uz_sum_by_pieces(find_product, &(remaining){e, w, x->cg.r}, x->cg.n);
    return (isnan(sum) ? INFINITY : fmax(0.0, sum)) + last * last / x->sparse.load.dual->amg->info.lambda;
}

/* A residual on its way into the range in which its squares are. */
typedef struct {
    double *e, *r;
    double unit;
} scaling;

static void scale(void *ctx, int64_t begin, int64_t end)
{
    const scaling *x = ctx;
    for (int64_t j = begin; j < end; j++)
        x->r[j] = x->e[j] /= x->unit;
}

/* With w from conjugate gradients that begin at 0, s = e - K w: e'K^-1 e = w'(e + s) + s'K^-1 s. enough: of the value:
 * a cycle alone, at w = 0, often tells. What is not small enough once that much is left to M is to be sharp. */
static uz_status bound_inverse_norm(free_load *x, double *value, double *e, double enough, uz_error *err)
{
    const uz_amg_info *known = &x->sparse.load.dual->amg->info;
    const int64_t n = x->cg.n;
    double *w = x->right;
    uz_cg_stop stop = {.relative = SHARP * sqrt(known->lambda),
                       .max_iterations = NORM_STEPS_MOST,
                       .hooks = x->stop.hooks,
                       .deadline = x->stop.deadline,
                       .begun = true};
    uz_cg_info info;
    *value = INFINITY;
    memset(w, 0, (size_t)n * sizeof *w);
    const double largest = uz_long_max(n, e);
    /* By the power of two below the largest: squares of forces stay in range; what is left is exact. */
    const double unit = largest > 0.0 && !isinf(largest) ? ldexp(1.0, ilogb(largest)) : 1.0;
    uz_by_pieces(scale, &(scaling){e, x->cg.r, unit}, n);
    enough = enough / unit / unit;
    if (known->least > 0.0) { /* what sharpen would ask for, at once; lambda is a guess */
        stop.absolute = 0.5 * sqrt(UNSOLVED * enough * known->least);
        stop.relative = 0.25 * SHARP * sqrt(known->least);
    } else {
        stop.absolute = sqrt(known->lambda * enough);
    }
    uz_status status = uz_cg_solve(&info, w, &x->cg, x->sparse.load.K, e, &stop, err);
    double scaled = bound_by_cycle(x, e, w, info.last);
    const bool told = !(known->least > 0.0) && stop.absolute > 0.0;
    if (status == UZ_OK && told && scaled > enough && info.last > stop.relative * info.first) {
        stop.absolute = stop.relative * info.first;
        stop.relative = 0.0;
        status = uz_cg_solve(&info, w, &x->cg, x->sparse.load.K, e, &stop, err);
        scaled = fmin(scaled, bound_by_cycle(x, e, w, info.last));
    }
    if (status == UZ_OK && known->least > 0.0)
        status = sharpen(x, &scaled, w, e, info.last, enough, err);
    if (status == UZ_OK)
        *value = scaled * unit * unit;
    return status;
}

/* A vector as the threads that share its digests see it. */
typedef struct {
    const double *e;
    int64_t n;
    char hex[DIGESTS][65];
} digesting;

static void digest_part(void *ctx, int part)
{
    digesting *x = ctx;
    const int64_t begin = x->n * part / DIGESTS, end = x->n * (part + 1) / DIGESTS;
    uz_digest *digest = uz_digest_new();
    memset(x->hex[part], 0, sizeof x->hex[part]);
    if (digest) {
        uz_digest_add(digest, x->e + begin, (size_t)(end - begin) * sizeof *x->e);
        uz_digest_end(digest, x->hex[part]);
    }
}

/* An answer is certified again with rows that touch nothing, or from the same reactions: its e is the same then. */
static uz_status inverse_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    free_load *x = ctx;
    digesting own = {.e = e, .n = x->cg.n};
    uz_aside_share(digest_part, &own, DIGESTS);
    bool known = true, same = true;
    for (int part = 0; part < DIGESTS; part++) {
        known = known && own.hex[part][0] != 0;
        same = same && strcmp(own.hex[part], x->bounded[part]) == 0;
    }
    if (known && same && (x->bound <= enough || x->enough <= enough)) {
        *value = x->bound;
        return UZ_OK;
    }
    const uz_status status = bound_inverse_norm(x, value, e, enough, err);
    if (status == UZ_OK && known) {
        memcpy(x->bounded, own.hex, sizeof own.hex);
        x->bound = *value;
        x->enough = enough;
    }
    return status;
}

/* ------------------------------------------------------------- given rows as equations */

/* A guess is first judged at a tolerance of 1e-2, the next one at 1e-3, and so on: an early guess is wrong in many
 * rows, which shows at once, and each digit that a step adds is taken over by the next. */
#define FIRST_TOLERANCE 1e-2
/* A guess by coarser grids is wrong in few rows. */
#define STARTED_TOLERANCE 1e-3
#define NEXT_TOLERANCE    0.1
/* Where solves are elsewhere, looking at a guess on the way costs as much as some steps: what is to be solved within
 * this many times the last tolerance, so that the next guess would be for that, is solved for it at once. */
#define AT_ONCE 10.0
#define SOON    4.0
/* Nor better, where few dofs have bounds, than to this share of what the guess changes: the next one would change more
 * than that. Plane bodies take more guesses above this share, solids none of 0.2. */
#define GUESS_KEPT 0.05
/* The same where solves are in single precision, and begin again for what is left: a guess that is seen to be wrong
 * half solved makes the next one worse, and another costs more than the step that this takes. Cubes of 64 cells a side
 * of hex8 and tet4 take 4 and 6 guesses, at ten times as much 7 and 9. */
#define GUESS_LEFT 0.01
/* A body that overlaps a smooth obstacle touches it where it does so by half of the most, if it is as soft everywhere:
 * of spheres exactly (Hertz). From there on guesses grow or shrink a little, where from all that overlaps they shrink
 * step by step. */
#define DEEP 0.5
/* Of the aim: below this a solve is as good as exact; where M is not to be trusted, so that lambda is a guess and each
 * certificate takes as many steps as five digits do. The aim is relative to u'K u, which exceeds the energy of what
 * supports move (by 70 times, a ring that is pressed together), and the certificate to that. */
#define ACTIVE_FLOOR  0.5
#define GUESSED_FLOOR 0.02

/* What is left of a body that is held is bounded by how far it moves the body that is not, which gives way the more,
 * the more slender it is: beyond so many times what it was to be it is solved for again, to half of that, or to this
 * share of it, as certificates of such bodies have a sharper bound. Of cubes it is twice as much, of bars ten times as
 * long as thick 5 to 19 times. */
#define SPREAD        8.0
#define SHARE_AT_ONCE 0.2

/* A guess of the rows on its way to its answer. */
typedef struct {
    free_load *x;
    double *g;
    bool *active;
    double least; /* a relative tolerance that is as good as exact */
} stepwise;

/* Is no row seen to be wrong? */
static bool looks_right(const stepwise *s)
{
    const uz_bounded *box = s->x->sparse.box;
    bool right = true;
    uz_bounded_react(&s->x->sparse, s->g, s->active);
    for (int64_t i = 0; right && i < s->x->sparse.load.dual->m; i++)
        right = !(s->active[i] ? uz_reaction_pulls(box->r[i]) : uz_gap_penetrates(s->g[i]));
    return right;
}

/* What sqrt(r'M^-1 r) may be; square: u'K u. */
static double goal_of(const free_load *x, double tolerance, double square)
{
    const double most = uz_root(-2.0 * x->sparse.load.psi0);
    return tolerance * fmin(uz_root(square), most > 0.0 ? most : INFINITY) *
           sqrt(x->sparse.load.dual->amg->info.lambda);
}

/* A long vector that another one goes to, turned round: what is missing of equilibrium in cg->r is what is left over in
 * force. */
typedef struct {
    double *to;
    const double *from;
} turning;

/* cg->r becomes p - K u of K u, or where that is known of force = K u - p. Returns u'K u. */
static double leave_residual(void *ctx, int64_t begin, int64_t end)
{
    enum { IN_CACHE = 2048 }; /* numbers, which stay in the cache */
    const free_load *x = ctx;
    const uz_bounded *box = x->sparse.box;
    const double *u = box->u, *p = x->sparse.p, *force = box->balanced ? box->force : NULL;
    double *r = x->cg.r, sum = 0.0;
    for (int64_t from = begin; from < end; from += IN_CACHE) {
        const int64_t to = end - from < IN_CACHE ? end : from + IN_CACHE;
        for (int64_t j = from; force && j < to; j++)
            r[j] = force[j] + p[j];
        sum += uz_dot(to - from, u + from, r + from);
        for (int64_t j = from; j < to; j++)
            r[j] = p[j] - r[j];
    }
    return sum;
}

static void negate(void *ctx, int64_t begin, int64_t end)
{
    const turning *x = ctx;
    for (int64_t j = begin; j < end; j++)
        x->to[j] = -x->from[j];
}

/* As uz_cg_stop has it, with p - K u in cg->r: a guess that looks right is solved for, another one is not. */
static double look(void *ctx)
{
    const stepwise *s = ctx;
    free_load *x = s->x;
    uz_bounded *box = x->sparse.box;
    box->largest = uz_long_max(x->cg.n, box->u);
    uz_by_pieces(negate, &(turning){box->force, x->cg.r}, x->cg.n);
    if (!looks_right(s))
        return INFINITY;
    return goal_of(x, s->least, uz_long_dot(x->cg.n, box->u, box->force) + uz_long_dot(x->cg.n, box->u, box->p));
}

/* u, r, g and active: at the coarse tolerance of the energy norm, and, while the guess still looks right, at the one
 * that is as good as exact. */
static uz_status solve_stepwise(free_load *x, double *r, double *g, bool *active, uz_error *err)
{
    uz_cg *cg = &x->cg;
    uz_dual_load *load = &x->sparse.load;
    const int64_t d = load->dual->d, m = load->dual->m;
    uz_bounded *box = x->sparse.box;
    const double least = (load->dual->amg->info.least > 0.0 ? GUESSED_FLOOR : ACTIVE_FLOOR) * x->aim * x->share,
                 root = sqrt(load->dual->amg->info.lambda);
    stepwise on_way = {x, g, active, least};
    const uz_multigrid_kind *kind = cg->mg->kind;
    const bool at_once = x->coarse < (kind->solve ? AT_ONCE : SOON) * least, few = uz_bounds_are_few(m, d);
    double tolerance = at_once ? least : fmax(least, x->coarse);
    bool ended = false;
    uz_status status = uz_cg_hold(cg, load->K, box->fixed, &x->stop, err);
    if (!box->balanced)
        uz_sparse_multiply(load, cg->r, box->u);
    double square = uz_sum_by_pieces(leave_residual, x, d); /* u'K u */
    for (bool go_on = true; status == UZ_OK && go_on;) {
        const double goal = goal_of(x, tolerance, square);
        /* from 0 the first residual has the size of the solution */
        uz_cg_stop stop = stop_at(x, goal > 0.0 ? 0.0 : tolerance * root, goal);
        uz_cg_info info;
        stop.unchecked = tolerance >= NO_DRIFT;
        if (tolerance > least && few)
            stop.relative = fmax(stop.relative, kind->solve_roughly ? GUESS_LEFT : GUESS_KEPT);
        if (tolerance > least && !kind->solve && !kind->solve_roughly) {
            stop.look = look;
            stop.ctx = &on_way;
            stop.look_absolute = stop.absolute;
            stop.look_relative = stop.relative;
            stop.absolute = goal_of(x, least, square);
            stop.relative = goal > 0.0 ? 0.0 : least * root;
            stop.unchecked = least >= NO_DRIFT;
        }
        stop.begun = true;
        x->wanted = goal / root;
        box->balanced = false;
        status = uz_cg_solve(&info, box->u, cg, load->K, x->sparse.p, &stop, err);
        if (status != UZ_OK)
            break;
        ended = info.ended;
        if (ended) /* and has told why: a row is wrong, by the force that the residual left */
            break;
        const bool roughly = tolerance > least && !stop.look;
        uz_bounded_balance(&x->sparse, roughly);
        square = uz_long_dot(d, box->u, box->force) + uz_long_dot(d, box->u, box->p);
        go_on = looks_right(&on_way) && roughly && info.met;
        tolerance = least;
        if (go_on)
            uz_by_pieces(negate, &(turning){cg->r, box->force}, d);
    }
    memcpy(r, box->r, (size_t)m * sizeof *r);
    x->coarse = fmax(least, NEXT_TOLERANCE * x->coarse);
    load->most = cg->grown > load->most ? cg->grown : load->most;
    load->most = box->swept_bytes > load->most ? box->swept_bytes : load->most; /* not at the same time */
    const uz_status freed = uz_cg_hold(cg, load->K, NULL, NULL, status == UZ_OK ? err : NULL);
    status = status == UZ_OK ? freed : status;
    if (status != UZ_OK)
        return status;
    x->cut = false;
    x->unmeasured = !may_bound(x, box->r) || ended; /* the next guess is as near, and is bounded in its place */
    if (!x->unmeasured)
        status = measure_held(x, box->r, err);
    /* psi(r) by u where no base tells it: -u'K u / 2 + r'h, u'K u = u'p + r'(h - g) */
    if (isinf(x->base_aim))
        load->psi0 =
            0.5 * (uz_dot(m, box->r, load->h) - uz_dot(m, box->r, load->g0) - uz_long_dot(d, box->u, x->sparse.p));
    return status;
}

/* Reactions that pull by less than this of the largest, times the tolerance, are what the solve has left. */
#define WEAK 0.1
/* Rows that penetrate by less than this of their scale touch: they depend on rows that are held, or nearly so. */
#define TOUCHES 1e-14

/* From x->u, which obeys the rows, to K u = p + N'r on them: u, r, g, and e = K u - p - N'r in cg->z. *right: no row is
 * seen to be wrong; *agree false: rows contradict each other. */
static uz_status solve_projected(free_load *x, uz_projected *part, bool *right, bool *agree, double *g,
                                 const bool *active, double tolerance, bool guessed, double norm, uz_error *err)
{
    uz_dual_load *load = &x->sparse.load;
    const uz_dual *dual = load->dual;
    const double root = sqrt(dual->amg->info.lambda);
    uz_cg cg = x->cg;
    uz_cg_stop stop = stop_at(x, norm > 0.0 ? 0.0 : tolerance * root, tolerance * norm * root);
    uz_cg_info info;
    double largest = 0.0, *e = x->cg.z;
    cg.mg = uz_projected_multigrid(part);
    stop.unchecked = tolerance >= NO_DRIFT;
    if (guessed)
        stop.relative = fmax(stop.relative, GUESS_KEPT);
    memcpy(x->right, x->sparse.p, (size_t)dual->d * sizeof *x->sparse.p);
    uz_csc_gaxpy_t(x->right, &dual->N, 1.0, x->r); /* what the rows are known to bear is no residual */
    uz_status status = uz_cg_solve(&info, x->u, &cg, load->K, x->right, &stop, err);
    if (status == UZ_OK)
        status = uz_projected_close(part, x->u, load->h, err);
    if (status != UZ_OK)
        return status;
    uz_sparse_multiply(load, e, x->u);
    uz_axpy(dual->d, -1.0, x->sparse.p, e);
    status = uz_projected_react(part, x->r, e, err);
    for (int64_t i = 0; i < dual->m; i++)
        largest = fmax(largest, fabs(x->r[i]));
    memcpy(g, load->h, (size_t)dual->m * sizeof *g);
    uz_csc_gaxpy(g, &dual->N, -1.0, x->u);
    *right = info.met;
    for (int64_t i = 0; i < dual->m; i++)
        if (uz_reaction_pulls(x->r[i]) && fabs(x->r[i]) <= WEAK * tolerance * largest)
            x->r[i] = 0.0;
    *agree = uz_projected_release(part, load->equations ? NULL : x->r, load->h, x->u, g); /* these bear anything */
    for (int64_t i = 0; i < dual->m; i++) {
        const bool overlaps = !active[i] && uz_gap_penetrates(g[i]);
        if (active[i] || (overlaps && -g[i] <= TOUCHES * uz_projected_scale(part, i, load->h, x->u)))
            g[i] = 0.0;
        *right = *right && !(active[i] ? uz_reaction_pulls(x->r[i]) : uz_gap_penetrates(g[i]));
    }
    uz_csc_gaxpy_t(e, &dual->N, -1.0, x->r);
    return status;
}

/* Rows of many entries. *solved false: they contradict each other, or there were too many guesses. */
static uz_status solve_rows(free_load *x, bool *solved, double *g, const bool *active, uz_error *err)
{
    uz_dual_load *load = &x->sparse.load;
    const uz_dual *dual = load->dual;
    const double least = ACTIVE_FLOOR * x->aim, most = uz_root(-2.0 * load->psi0);
    double tolerance = fmax(least, x->coarse);
    uz_projected *part = NULL;
    bool agree = true;
    *solved = false;
    if (!x->u) {
        x->u = uz_alloc(dual->d, sizeof *x->u);
        x->r = uz_alloc_zero(dual->m, sizeof *x->r);
        if (!x->u || !x->r)
            return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)dual->m);
        memcpy(x->u, x->sparse.base, (size_t)dual->d * sizeof *x->u);
    }
    uz_status status = uz_projected_create(&part, x->cg.mg, dual, load->K, active, x->stop.hooks, err);
    if (!part)
        return status;
    for (int64_t i = 0; i < dual->m; i++)
        x->r[i] = active[i] ? x->r[i] : 0.0;
    status = uz_projected_close(part, x->u, load->h, err);
    for (bool right = true; status == UZ_OK && right; tolerance = least) {
        uz_sparse_multiply(load, x->cg.z, x->u);
        const double norm = fmin(uz_root(uz_long_dot(dual->d, x->u, x->cg.z)), most > 0.0 ? most : INFINITY);
        status = solve_projected(x, part, &right, &agree, g, active, tolerance, tolerance > least, norm, err);
        right = right && tolerance > least;
    }
    if (status == UZ_OK && agree && may_bound(x, x->r))
        status = measure_slack(x, x->cg.z, err);
    x->coarse = fmax(least, NEXT_TOLERANCE * x->coarse);
    const size_t bytes = uz_projected_bytes(part) + 8 * (size_t)(dual->d + dual->m);
    load->most = bytes > load->most ? bytes : load->most;
    uz_projected_free(part);
    *solved = status == UZ_OK && agree;
    return status;
}

static uz_status solve_active_rows(free_load *x, uz_active_end *end, double *r, double *g, const bool *active,
                                   uz_error *err)
{
    bool solved = false;
    uz_status status = UZ_OK;
    x->sparse.known_u = x->sparse.known_r = NULL;
    if (may_hold(x)) {
        x->guesses++;
        status = solve_rows(x, &solved, g, active, err);
    }
    if (!solved) {
        x->guesses = GUESSES_MOST; /* from here on it iterates, from a base that is good enough for that */
        return status == UZ_ERR_CANCELLED || status == UZ_OK ? solve_base(x, BASE_FLOOR * x->aim, err) : status;
    }
    memcpy(r, x->r, (size_t)x->sparse.load.dual->m * sizeof *r);
    x->sparse.known_u = x->u;
    x->sparse.known_r = x->r;
    *end = UZ_ACTIVE_SOLVED;
    return UZ_OK;
}

/* Has a guess that is right left so much more than was wanted that it is to be solved for again? x->share is what that
 * takes, which is never less than rounding leaves: a body that hardly anything holds has no slack as small as that. */
static bool may_spread(free_load *x, const double *g, const bool *active)
{
    const double most = SPREAD * x->wanted, part = fmax(SHARE_AT_ONCE, 0.5 * most / x->held_slack),
                 share = fmax(x->share * part, DBL_EPSILON / x->aim);
    bool right = x->cg.mg->kind->solve_roughly && !x->unmeasured && isfinite(x->held_slack) && x->wanted > 0.0 &&
                 x->held_slack > most && share < x->share;
    for (int64_t i = 0; right && i < x->sparse.load.dual->m; i++)
        right = active[i] || !uz_gap_penetrates(g[i]);
    x->share = right ? share : x->share;
    return right;
}

static uz_status solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active, uz_error *err)
{
    free_load *x = (free_load *)load;
    uz_bounded *box = x->sparse.box;
    if (load->equations)
        x->coarse = DBL_MIN;
    else if (x->coarse <= 0.0)
        x->coarse = FIRST_TOLERANCE;
    if (!box)
        return solve_active_rows(x, end, r, g, active, err);
    if (!uz_bounded_hold(&x->sparse, active, true)) {
        *end = uz_bounded_crossed(&x->sparse, r) ? UZ_ACTIVE_RAY : UZ_ACTIVE_UNSOLVED;
        return UZ_OK;
    }
    uz_status status = solve_stepwise(x, r, g, active, err);
    if (status == UZ_OK && may_spread(x, g, active)) {
        x->coarse = DBL_MIN;
        status = solve_stepwise(x, r, g, active, err);
    }
    x->sparse.known_u = status == UZ_OK ? box->u : NULL;
    x->sparse.known_r = status == UZ_OK ? box->r : NULL;
    *end = status == UZ_OK ? UZ_ACTIVE_SOLVED : UZ_ACTIVE_UNSOLVED;
    return status == UZ_ERR_CANCELLED ? UZ_OK : status;
}

/* The first guess is that of coarser grids, with the displacement that it begins at; there is no other. */
static bool start_on_grids(free_load *x, bool *active)
{
    uz_dual_load *load = &x->sparse.load;
    uz_bounded *box = x->sparse.box;
    const uz_multigrid *mg = load->dual->amg->mg;
    bool found = false, *held = NULL;
    uz_error ignored = {0};
    if (!box || x->started)
        return false;
    x->started = true;
    box->balanced = false;
    const uz_limits limits = {box->n, box->dof, box->bottom, box->top};
    if (!box->contradictory && (held = uz_alloc(box->n, sizeof *held)))
        (void)mg->kind->start(mg, x->cg.room, &found, box->u, held, x->sparse.p, &limits, &x->stop, &ignored);
    if (!found) { /* gaps of the body without reactions are what is left to guess by */
        (void)solve_base(x, BASE_ROUGH, &ignored);
        memcpy(box->u, x->sparse.base, (size_t)load->dual->d * sizeof *box->u);
        free(held);
        return false;
    }
    memset(active, 0, (size_t)load->dual->m * sizeof *active);
    for (int64_t b = 0; b < box->n; b++)
        if (held[b])
            active[box->u[box->dof[b]] >= box->top[b] ? box->upper[b] : box->lower[b]] = true;
    free(held);
    x->coarse = STARTED_TOLERANCE;
    return true;
}

/* Rows that press, or that a step of the size of the dof's own compliance would leave beyond their bounds. */
static void start_near(free_load *x, bool *active)
{
    const uz_dual_load *load = &x->sparse.load;
    const uz_bounded *box = x->sparse.box;
    x->near = false;
    x->started = true;
    x->coarse = STARTED_TOLERANCE;
    memset(active, 0, (size_t)load->dual->m * sizeof *active);
    for (int64_t b = 0; b < box->n; b++) {
        const int64_t j = box->dof[b], upper = box->upper[b], lower = box->lower[b];
        const double weight = uz_sparse_weight(load->K, j),
                     above = upper >= 0 ? -weight * box->bounds->scale[upper] * box->r[upper] : 0.0,
                     below = lower >= 0 ? -weight * box->bounds->scale[lower] * box->r[lower] : 0.0;
        if (upper >= 0 && box->u[j] + above > box->top[b])
            active[upper] = true;
        else if (lower >= 0 && box->u[j] + below < box->bottom[b])
            active[lower] = true;
    }
}

/* The first guess: rows that the body overlaps deeply by itself. */
static void start_deep(const free_load *x, bool *active)
{
    const uz_dual_load *load = &x->sparse.load;
    const double *scale = x->sparse.box->bounds->scale;
    double deepest = 0.0;
    for (int64_t i = 0; i < load->dual->m; i++)
        deepest = fmin(deepest, load->g0[i] / fabs(scale[i]));
    for (int64_t i = 0; i < load->dual->m; i++)
        active[i] = uz_gap_penetrates(load->g0[i]) && load->g0[i] / fabs(scale[i]) <= DEEP * deepest;
}

static bool guess_active(uz_dual_load *load, bool *active)
{
    free_load *x = (free_load *)load;
    const bool few = x->sparse.box && uz_bounds_are_few(load->dual->m, load->dual->d), first = x->coarse <= 0.0;
    if (x->near && !x->sparse.box->contradictory) {
        start_near(x, active);
        return true;
    }
    if (x->cg.mg->kind->start)
        return start_on_grids(x, active);
    if (few && first && isfinite(x->base_aim)) {
        start_deep(x, active);
        return true;
    }
    if (few && uz_sparse_has_entries(load->dual) && x->sparse.known_r == x->sparse.box->r &&
        uz_bounded_shrink(&x->sparse, active)) {
        x->coarse *= NEXT_TOLERANCE;
        return true;
    }
    if (few && x->refused++ < REFUSED_MOST)
        return false;
    return uz_sparse_guess_active(load, active);
}

/* What both forms do: solves by the multigrid of their setup, whose kind is all that differs: one that is here, or one
 * that a group of processes holds (group/group.h). */
#define BY_MULTIGRID                                                                                                   \
    .dual_size = sizeof(uz_sparse), .load_size = sizeof(free_load), .create = uz_sparse_create,                        \
    .clear = uz_sparse_clear, .load = make_load, .unload = unload, .aim = aim_at, .probe = probe, .apply = apply,      \
    .correct = uz_sparse_correct, .recover = uz_sparse_recover, .solve_active = solve_active,                          \
    .guess_active = guess_active, .inverse_norm = inverse_norm

const uz_dual_form uz_dual_matrix_free = {
    .can = {.op = UZ_OPERATOR_MATRIX_FREE, .begin_near = true}, .add_cost = uz_cost_of_multigrid, BY_MULTIGRID};

const uz_dual_form uz_dual_distributed = {.can = {.op = UZ_OPERATOR_DISTRIBUTED, .asked_for = true, .begin_near = true},
                                          .add_cost = uz_cost_of_group,
                                          BY_MULTIGRID};
