/* rough.c: conjugate gradients in single precision on the first grid, for what they tell of the spectrum. A step passes
 * through a fifth of the bytes of one on dofs in double precision, and through no number of a dof. */
#include "brick/grids.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdlib.h>

/* The vectors of the first grid: z = M^-1 r in x, r in b, and q = K p in t where the cycle has its directions; the
 * direction p of the steps. */
typedef struct {
    const uz_brick_vectors *v;
    float *direction;
    float factor;
} rough;

static void reduce_residual(void *ctx, int64_t begin, int64_t end)
{
    const rough *s = ctx;
    const float alpha = s->factor, *restrict q = s->v->t;
    float *restrict r = s->v->b;
    for (int64_t i = begin; i < end; i++)
        r[i] -= alpha * q[i];
}

typedef struct {
    float *direction;
    const float *z;
    float beta;
} turning;

static void turn(void *ctx, int64_t begin, int64_t end)
{
    const turning *x = ctx;
    const float beta = x->beta, *restrict z = x->z;
    float *restrict p = x->direction;
    for (int64_t i = begin; i < end; i++)
        p[i] = z[i] + beta * p[i];
}

void uz_brick_turn(float *direction, const float *z, float beta, int64_t n)
{
    uz_by_pieces(turn, &(turning){direction, z, beta}, n);
}

/* Steps from room->v[0].b on; unit: of r'M^-1 r. */
static void take_steps(rough *s, const uz_brick_grids *mg, const uz_multigrid_room *room, double unit,
                       uz_cg_visit visit, void *ctx)
{
    const uz_brick_level *level = &mg->level[0];
    const uz_brick_vectors product = {.x = s->direction, .t = s->v->t, .inverse = s->v->inverse};
    const int64_t n = level->axes * level->size;
    uz_brick_cycle(mg, room, 0);
    double square = uz_long_dot_single(n, s->v->b, s->v->x);
    uz_brick_turn(s->direction, s->v->x, 0.0F, n); /* from 0 */
    for (bool go_on = true; go_on && square > 0.0;) {
        const double curvature = uz_brick_curvature(level, &product, &room->planes), before = square,
                     along = curvature > 0.0 ? before / curvature : 0.0;
        if (!(along > 0.0) || isinf(along)) /* rounding lets no step be made, or K: double precision tells */
            return;
        s->factor = (float)along;
        uz_by_pieces(reduce_residual, s, n);
        uz_brick_cycle(mg, room, 0);
        square = uz_long_dot_single(n, s->v->b, s->v->x);
        go_on = visit(ctx, along, unit * before, unit * square);
        uz_brick_turn(s->direction, s->v->x, (float)(square / before), n);
    }
}

uz_status uz_brick_step_roughly(const uz_multigrid *base, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                                void *ctx, uz_error *err)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    if (base->levels == 1)
        return UZ_OK;
    rough s = {.v = &room->v[0], .direction = uz_alloc_zero(uz_brick_numbers(&mg->level[0]), sizeof(float))};
    if (!s.direction)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to bound the spectrum of %lld dofs", (long long)base->n);
    const double down = uz_brick_read(mg, room, r);
    if (down > 0.0)
        take_steps(&s, mg, room, 1.0 / (down * down * mg->unit), visit, ctx);
    free(s.direction);
    return UZ_OK;
}
