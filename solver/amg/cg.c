/* cg.c: preconditioned conjugate gradients (Hestenes and Stiefel 1952). */
#include "amg/amg.h"

#include "core/alloc.h"
#include "linalg/pieces.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RESTARTS_MOST = 4 };

uz_status uz_cg_init(uz_cg *cg, const uz_multigrid *mg, uz_error *err)
{
    double **vectors[] = {&cg->r, &cg->z, &cg->p};
    *cg = (uz_cg){.mg = mg, .n = mg->n};
    cg->room = mg->kind->room(mg, &cg->bytes);
    bool ok = cg->room != NULL;
    for (int k = 0; k < 3; k++)
        ok = (*vectors[k] = uz_alloc(mg->n, sizeof(double))) && ok;
    cg->bytes += 24 * (size_t)mg->n;
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to solve for %lld dofs", (long long)mg->n);
}

uz_status uz_cg_hold(uz_cg *cg, const uz_csc *K, const bool *held, const uz_stop *stop, uz_error *err)
{
    cg->held = held;
    return cg->mg->kind->hold(cg->mg, K, cg->room, held, &cg->grown, stop, err);
}

uz_status uz_cg_fail_direction(uz_error *err)
{
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is not positive definite: conjugate gradients met a direction that it does not resist. Support "
                   "the body so that it can't move freely, or check the signs of K.");
}

void uz_cg_clear(uz_cg *cg)
{
    if (cg->mg)
        cg->mg->kind->free_room(cg->room);
    uz_free_all(cg->r, cg->z, cg->p);
    memset(cg, 0, sizeof *cg);
}

/* What a step does to vectors, in pieces that threads share. */
typedef struct {
    uz_cg *cg;
    double *x;
    const double *b;
    double factor;
} update;

static void clear_piece(void *ctx, int64_t begin, int64_t end)
{
    const update *u = ctx;
    for (int64_t j = begin; j < end; j++)
        u->x[j] = u->cg->held[j] ? 0.0 : u->x[j];
}

static void clear_held(double *x, uz_cg *cg)
{
    if (cg->held)
        uz_by_pieces(clear_piece, &(update){.cg = cg, .x = x}, cg->n);
}

static void find_residual(void *ctx, int64_t begin, int64_t end)
{
    const update *u = ctx;
    const double *restrict b = u->b, *restrict q = u->cg->z;
    double *restrict r = u->cg->r;
    for (int64_t j = begin; j < end; j++)
        r[j] = b[j] - q[j];
}

static void take_step(void *ctx, int64_t begin, int64_t end)
{
    const update *u = ctx;
    const bool *held = u->cg->held;
    const double alpha = u->factor, *restrict p = u->cg->p, *restrict q = u->cg->z;
    double *restrict x = u->x, *restrict r = u->cg->r;
    for (int64_t j = begin; j < end; j++) {
        x[j] += held && held[j] ? 0.0 : alpha * p[j];
        r[j] -= alpha * q[j];
    }
}

/* cg->z = K cg->p; returns p'z. told: as uz_cg_solve has it. */
static double find_curvature(uz_cg *cg, const uz_csc *K, bool told)
{
    const uz_multigrid_kind *kind = cg->mg->kind;
    double curvature = 0.0;
    if (kind->curve)
        curvature = kind->curve(cg->mg, cg->room, cg->z, cg->p);
    else
        kind->multiply(cg->mg, K, cg->room, cg->z, cg->p);
    if (!told)
        clear_held(cg->z, cg);
    return kind->curve ? curvature : uz_long_dot(cg->n, cg->p, cg->z);
}

static void turn_direction(void *ctx, int64_t begin, int64_t end)
{
    const update *u = ctx;
    const double beta = u->factor, *restrict z = u->cg->z;
    double *restrict p = u->cg->p;
    for (int64_t j = begin; j < end; j++)
        p[j] = z[j] + beta * p[j];
}

void uz_cg_turn(uz_cg *cg, double beta)
{
    update u = {.cg = cg, .factor = beta};
    uz_by_pieces(turn_direction, &u, cg->n);
}

static void add_direction(void *ctx, int64_t begin, int64_t end)
{
    const update *u = ctx;
    for (int64_t j = begin; j < end; j++)
        u->x[j] += u->cg->p[j];
}

/* What x lacks is solved for where the residual is known: then less has to be told, and no product made. Else, as x at
 * held dofs counts as 0 there, its part goes to the right-hand side. */
static uz_status solve_elsewhere(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b,
                                 const uz_cg_stop *stop, uz_error *err)
{
    const uz_multigrid_kind *kind = cg->mg->kind;
    bool moved = false; /* not where all touches from the beginning */
    if (stop->begun) {
        memset(cg->p, 0, (size_t)cg->n * sizeof *cg->p);
        uz_long_copy(cg->n, cg->z, cg->r);
        const uz_status status = kind->solve(cg->mg, K, cg->room, info, cg->p, cg->r, cg->z, 1, stop, err);
        uz_by_pieces(add_direction, &(update){.cg = cg, .x = x}, cg->n);
        return status;
    }
    for (int64_t j = 0; cg->held && j < cg->n; j++) {
        cg->p[j] = cg->held[j] ? x[j] : 0.0;
        moved = moved || cg->p[j] != 0.0;
    }
    if (moved)
        kind->multiply(cg->mg, K, cg->room, cg->z, cg->p);
    for (int64_t j = 0; moved && j < cg->n; j++)
        cg->p[j] = b[j] - cg->z[j];
    return kind->solve(cg->mg, K, cg->room, info, x, cg->r, moved ? cg->p : b, 1, stop, err);
}

bool uz_cg_should_stop(const uz_cg_info *info, const uz_cg_stop *stop)
{
    return info->iterations >= stop->max_iterations || uz_cancelled(stop->hooks) || uz_seconds() >= stop->deadline;
}

/* Asks stop->look where it is due, once; `goal` is what it says. */
static void look(double *goal, uz_cg_info *info, uz_cg_stop *stop, double norm)
{
    if (!stop->look || norm > fmax(*goal, fmax(stop->look_absolute, stop->look_relative * info->first)))
        return;
    *goal = stop->absolute = stop->look(stop->ctx);
    stop->relative = 0.0;
    stop->look = NULL;
    info->looked = true;
    info->ended = isinf(*goal);
}

/* As far as single precision carries. Where that is not far enough *stop is told what is left to do. */
static uz_status solve_roughly(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b,
                               uz_cg_stop *stop, uz_error *err)
{
    const uz_multigrid_kind *kind = cg->mg->kind;
    update u = {.cg = cg, .x = x, .b = b};
    if (!stop->begun) {
        kind->multiply(cg->mg, K, cg->room, cg->z, x);
        uz_by_pieces(find_residual, &u, cg->n);
    }
    clear_held(cg->r, cg);
    const uz_status status = kind->solve_roughly(cg->mg, cg->room, info, x, cg->r, stop, err);
    stop->begun = info->iterations == 0;
    if (!stop->begun) {
        stop->absolute = fmax(stop->absolute, stop->relative * info->first);
        stop->relative = 0.0;
    }
    return status;
}

/* The recurrence drifts from the true residual by rounding (Greenbaum 1997): it is begun again from the true one until
 * that meets the goal too, or gains nothing more. cg->z holds q = K p until the residual has it, then z = M^-1 r. */
uz_status uz_cg_solve(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b, const uz_cg_stop *asked,
                      uz_error *err)
{
    const int64_t n = cg->n;
    double goal = 0.0, before = INFINITY;
    update u = {.cg = cg, .x = x, .b = b};
    memset(info, 0, sizeof *info);
    if (cg->mg->kind->solve)
        return solve_elsewhere(info, x, cg, K, b, asked, err);
    const bool told = asked->look != NULL; /* what the residual is at held dofs, where z and p are 0 */
    uz_cg_stop left = *asked, *stop = &left;
    if (stop->unchecked && !told && cg->mg->kind->solve_roughly) {
        const uz_status status = solve_roughly(info, x, cg, K, b, stop, err);
        if (status != UZ_OK || info->met)
            return status;
    }
    for (int k = 0;; k++) {
        /* r = b - K x on the free dofs, z = M^-1 r */
        if (k > 0 || !stop->begun) {
            cg->mg->kind->multiply(cg->mg, K, cg->room, cg->z, x);
            uz_by_pieces(find_residual, &u, n);
        }
        if (!told)
            clear_held(cg->r, cg);
        uz_status status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
        double square = uz_long_dot(n, cg->r, cg->z);
        info->last = uz_root(square);
        if (k == 0) {
            info->first = info->last;
            goal = fmax(stop->absolute, stop->relative * info->first);
        }
        info->met = info->last <= goal;
        if (status != UZ_OK || (k > 0 && uz_cg_should_stop(info, stop)) || k == RESTARTS_MOST || !(info->last > goal) ||
            !(info->last < 0.5 * before))
            return status;
        before = info->last;
        uz_long_copy(n, cg->p, cg->z);
        while (square > goal * goal && !uz_cg_should_stop(info, stop)) {
            look(&goal, info, stop, uz_root(square));
            if (info->ended || square <= goal * goal)
                break;
            const double curvature = find_curvature(cg, K, told), alpha = square / curvature, last = square;
            if (fabs(curvature) < DBL_MIN) /* underflow: there is no more to gain */
                break;
            if (!(curvature > 0.0))
                return uz_cg_fail_direction(err);
            u.factor = alpha;
            uz_by_pieces(take_step, &u, n);
            status = uz_multigrid_apply(cg->mg, K, cg->room, cg->z, cg->r, err);
            if (status != UZ_OK)
                return status;
            square = uz_long_dot(n, cg->r, cg->z);
            u.factor = square / last;
            uz_by_pieces(turn_direction, &u, n);
            info->iterations++;
        }
        if (info->ended || (stop->unchecked && square <= goal * goal)) {
            info->last = uz_root(square);
            info->met = !info->ended;
            return UZ_OK;
        }
    }
}
