/* rough.c: conjugate gradients in single precision, in vectors of the first level, for changes of a displacement whose
 * residual is computed in double precision afterwards. They read half as many bytes of K, and no vector of dofs.
 *
 * What each product with K hides of a change delta is rounding of its entries, of FLT_EPSILON ||delta|| in the norm of
 * diag(K), which in that of K^-1 comes to FLT_EPSILON ||delta||_K / sqrt(lambda_min(diag(K)^-1 K)) at most: `drift`
 * times the first residual. */
#include "amg/multigrid_private.h"

#include "linalg/pieces.h"

#include <math.h>
#include <string.h>

/* Of a tolerance the most that rounding may hide. */
#define HIDDEN 0.1

/* Vectors of level 0, in the room that a product in double precision has, and what a step does to pieces of them. */
typedef struct {
    const uz_aggregates *mg;
    float *x, *p, *q, *r;
    const float *z;
    float factor;
    double unit;               /* of them all */
    double *whole_x, *whole_r; /* of dofs */
    const bool *held;
} rough;

static void take_step(void *ctx, int64_t begin, int64_t end)
{
    const rough *s = ctx;
    const float alpha = s->factor, *restrict p = s->p, *restrict q = s->q;
    float *restrict x = s->x, *restrict r = s->r;
    for (int64_t j = begin; j < end; j++) {
        x[j] += alpha * p[j];
        r[j] -= alpha * q[j];
    }
}

static void turn_direction(void *ctx, int64_t begin, int64_t end)
{
    const rough *s = ctx;
    const float beta = s->factor, *restrict z = s->z;
    float *restrict p = s->p;
    for (int64_t j = begin; j < end; j++)
        p[j] = z[j] + beta * p[j];
}

static void leave(void *ctx, int64_t begin, int64_t end)
{
    const rough *s = ctx;
    const double *restrict scale = s->mg->scale, unit = s->unit;
    const int64_t *restrict slot = s->mg->slot;
    for (int64_t j = begin; j < end; j++) {
        s->whole_x[j] += scale[j] * (double)s->x[slot[j]] * unit;
        s->whole_r[j] = s->held && s->held[j] ? 0.0 : (double)s->r[slot[j]] * unit / scale[j];
    }
}

/* Until the square is not above the goal's. Of held dofs, and of the surplus numbers of a node, z and p are 0, so that
 * nothing reads what r and q have there. */
static uz_status iterate(rough *s, uz_multigrid_room *room, uz_cg_info *info, double *square, double goal,
                         const uz_cg_stop *stop, uz_error *err)
{
    const int64_t n = 4 * s->mg->level[0].A.nodes;
    uz_status status = UZ_OK;
    while (status == UZ_OK && *square > goal * goal && !uz_cg_should_stop(info, stop)) {
        uz_level_multiply(s->q, &s->mg->level[0], s->p);
        const double curvature = uz_long_dot_single(n, s->p, s->q), last = *square;
        if (!(curvature > 0.0)) /* rounding, or K: double precision tells */
            break;
        s->factor = (float)(last / curvature);
        uz_by_pieces(take_step, s, n);
        status = uz_cycle_below(s->mg, room, 0, 1, err);
        *square = uz_long_dot_single(n, s->r, s->z);
        s->factor = (float)(*square / last);
        uz_by_pieces(turn_direction, s, n);
        info->iterations++;
    }
    return status;
}

uz_status uz_solve_roughly(const uz_multigrid *base, uz_multigrid_room *room, uz_cg_info *info, double *x, double *r,
                           const uz_cg_stop *stop, uz_error *err)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    memset(info, 0, sizeof *info);
    if (base->levels == 1 || !(base->drift > 0.0) || (!(stop->absolute > 0.0) && stop->relative * HIDDEN < base->drift))
        return UZ_OK;
    const int64_t n = 4 * mg->level[0].A.nodes;
    void *const to = room->to, *const from = room->from; /* room for 2 n numbers each */
    float *first = to, *second = from;
    rough s = {.mg = mg,
               .p = first,
               .q = first + n,
               .x = second,
               .r = room->b[0],
               .z = room->x[0],
               .unit = uz_read_dofs(room->b[0], mg, r),
               .whole_x = x,
               .whole_r = r,
               .held = room->held};
    if (!(s.unit > 0.0) || isinf(s.unit))
        return UZ_OK;
    uz_status status = uz_cycle_below(mg, room, 0, 1, err);
    double square = uz_long_dot_single(n, s.r, s.z);
    info->first = info->last = s.unit * uz_root(square);
    const double goal = fmax(stop->absolute, stop->relative * info->first);
    info->met = info->first <= goal;
    if (status != UZ_OK || info->met || goal * HIDDEN < base->drift * info->first)
        return status;
    memset(s.x, 0, (size_t)n * sizeof *s.x);
    memcpy(s.p, s.z, (size_t)n * sizeof *s.p);
    status = iterate(&s, room, info, &square, goal / s.unit, stop, err);
    if (info->iterations > 0) /* else r is as it was, in double precision */
        uz_by_pieces(leave, &s, base->n);
    memset(second, 0, (size_t)n * sizeof *second); /* a product counts on surplus numbers there */
    info->last = s.unit * uz_root(square);
    info->met = info->last <= goal;
    return status;
}
