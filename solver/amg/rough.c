/* rough.c: conjugate gradients in single precision, in vectors of the first level, for changes of a displacement whose
 * residual is computed in double precision afterwards, and for what they tell of the spectrum. They read half as many
 * bytes of K, and no vector of dofs.
 *
 * They read K no more often than the cycle does, after Eisenstat, SIAM J. Sci. Stat. Comput. 2 (1981): with
 * A = D + L + L' the cycle begins with a sweep down, so that of the residual r only what that makes of it is kept,
 * s = (D + L)^-1 r. With w = L'p, a step along p takes from s
 *
 *     (D + L)^-1 A p = p + (D + L)^-1 w,   and   p'A p = p'D p + 2 p'w,
 *
 * which is another right-hand side for the sweep that would have been made anyway. From the coarse correction c the
 * sweep up makes z = (D + L')^-1 (r - L (s + c)) = (D + L')^-1 (D s - L c), with L'z on the way, and
 * r'z = s'(D z + L'z).
 *
 * What each step hides of a change delta is rounding of the entries of K, of FLT_EPSILON ||delta|| in the norm of
 * diag(K), which in that of K^-1 comes to FLT_EPSILON ||delta||_K / sqrt(lambda_min(diag(K)^-1 K)) at most: `drift`
 * times the first residual. */
#include "amg/multigrid_private.h"

#include "linalg/pieces.h"

#include <math.h>
#include <string.h>

/* Vectors of level 0, in the room that a product in double precision has and in that of its step, and what is done to
 * pieces of them. At held dofs s, p, z and D are 0, and so is all at the surplus numbers of a node. */
typedef struct {
    const uz_aggregates *mg;
    uz_multigrid_room *room;
    uz_level level; /* 0, as it is in this room */
    uz_level_step step;
    float *x, *p, *w, *s;
    float *z, *t, *d;          /* of the room: z, L'z and D */
    int64_t n;                 /* numbers of each */
    double square, curvature;  /* r'z and p'K p */
    float along, beta;         /* x lacks p so many times; that of the next p */
    double unit;               /* of them all */
    double *whole_x, *whole_r; /* of dofs */
    const bool *held;
} rough;

/* ------------------------------------------------------------- steps */

/* D, where dofs take part. */
static void find_diagonal(void *ctx, int64_t begin, int64_t end)
{
    const rough *v = ctx;
    const int b = v->level.A.b;
    for (int64_t i = begin; i < end; i++)
        for (int r = 0; r < b; r++)
            v->d[4 * i + r] = v->step.inverse[i * b + r] > 0.0F ? v->level.diag[i * b * b + r * b + r] : 0.0F;
}

/* From s and t = -L's: z, L'z and r'z. */
static uz_status precondition(rough *v, uz_error *err)
{
    uz_level_take_step(&v->step, UZ_STEP_RESTRICT);
    const uz_status status = uz_cycle_below(v->mg, v->room, 1, 1, err);
    uz_level_step up = v->step;
    up.coarse = v->room->x[1];
    up.product = &v->square;
    uz_level_take_step(&up, UZ_STEP_PLACE | UZ_STEP_RISE);
    return status;
}

typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four __attribute__((vector_size(32)));

/* x takes the last step, if it is wanted; p = z + beta p, w = L'z + beta w; p'(D p + 2 w). */
UZ_INLINE double turn_piece(const rough *v, int64_t begin, int64_t end, bool moves)
{
    const float along = v->along, beta = v->beta;
    four sum = {0.0};
    for (int64_t j = begin; j < end; j += 4) {
        const four_floats d = *(const four_floats *)(v->d + j), z = *(const four_floats *)(v->z + j),
                          t = *(const four_floats *)(v->t + j);
        four_floats *p = (four_floats *)(v->p + j), *w = (four_floats *)(v->w + j);
        if (moves)
            *(four_floats *)(v->x + j) += along * *p;
        const four_floats next = z + beta * *p, image = t + beta * *w;
        *p = next;
        *w = image;
        sum += __builtin_convertvector(next, four) * __builtin_convertvector(d * next + 2.0F * image, four);
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

static double turn_nodes(void *ctx, int64_t begin, int64_t end)
{
    const rough *v = ctx;
    return v->along > 0.0F ? turn_piece(v, 4 * begin, 4 * end, true) : turn_piece(v, 4 * begin, 4 * end, false);
}

static void turn_direction(rough *v)
{
    v->curvature = uz_sum_by_pieces(turn_nodes, v, v->n / 4);
    v->along = 0.0F;
}

/* Another step along p, which x lacks then. *along 0: rounding lets none be made, or K: double precision tells. */
static uz_status take_step(rough *v, double *along, uz_error *err)
{
    const double last = v->square;
    *along = v->curvature > 0.0 ? last / v->curvature : 0.0;
    if (!(*along > 0.0) || isinf(*along))
        return UZ_OK;
    uz_level_step down = v->step;
    down.b = v->w;
    down.along = v->p;
    down.share[0] = (float)*along;
    uz_level_take_step(&down, UZ_STEP_REDUCE);
    const uz_status status = precondition(v, err);
    v->beta = (float)(v->square / last);
    return status;
}

/* The first residual r (n) and its direction. False: it is 0, or no number. */
static uz_status begin(rough *v, bool *begun, const uz_aggregates *mg, uz_multigrid_room *room, const double *r,
                       uz_error *err)
{
    const int64_t n = 4 * mg->level[0].A.nodes;
    void *const to = room->to, *const from = room->from; /* room for 2 n numbers each */
    float *first = to, *second = from;
    *v = (rough){.mg = mg,
                 .room = room,
                 .p = first,
                 .w = first + n,
                 .x = second,
                 .s = second + n,
                 .z = room->x[0],
                 .t = room->t[0],
                 .d = room->d,
                 .n = n,
                 .unit = uz_read_dofs(room->b[0], mg, r),
                 .held = room->held};
    *begun = v->unit > 0.0 && !isinf(v->unit);
    if (!*begun)
        return UZ_OK;
    v->step = uz_step_of(&v->level, mg, room, 0);
    v->step.swept = v->s;
    uz_by_pieces(find_diagonal, v, mg->level[0].A.nodes);
    uz_level_take_step(&v->step, UZ_STEP_SWEEP_DOWN);
    memcpy(v->s, v->z, (size_t)n * sizeof *v->s);
    const uz_status status = precondition(v, err);
    memset(first, 0, 2 * (size_t)n * sizeof *first);
    memset(v->x, 0, (size_t)n * sizeof *v->x);
    turn_direction(v);
    return status;
}

/* A product counts on surplus numbers there. */
static void end(const rough *v)
{
    const size_t bytes = 2 * (size_t)v->n * sizeof(float);
    memset(v->room->to, 0, bytes);
    memset(v->room->from, 0, bytes);
}

/* ------------------------------------------------------------- solves */

static void move_on(void *ctx, int64_t begin, int64_t end)
{
    const rough *v = ctx;
    const float alpha = v->along, *restrict p = v->p;
    float *restrict x = v->x;
    for (int64_t j = begin; j < end; j++)
        x[j] += alpha * p[j];
}

static void leave(void *ctx, int64_t begin, int64_t end)
{
    const rough *v = ctx;
    const double *restrict scale = v->mg->scale, unit = v->unit;
    const int64_t *restrict slot = v->mg->slot;
    for (int64_t j = begin; j < end; j++) {
        v->whole_x[j] += scale[j] * (double)v->x[slot[j]] * unit;
        v->whole_r[j] = v->held && v->held[j] ? 0.0 : (double)v->z[slot[j]] * unit / scale[j];
    }
}

/* Until the square is not above the goal's. */
static uz_status iterate(rough *v, uz_cg_info *info, double goal, const uz_cg_stop *stop, uz_error *err)
{
    uz_status status = UZ_OK;
    while (status == UZ_OK && v->square > goal * goal && !uz_cg_should_stop(info, stop)) {
        double along;
        status = take_step(v, &along, err);
        if (!(along > 0.0))
            break;
        v->along = (float)along;
        info->iterations++;
        if (v->square > goal * goal)
            turn_direction(v);
    }
    if (v->along > 0.0F)
        uz_by_pieces(move_on, v, v->n);
    return status;
}

uz_status uz_solve_roughly(const uz_multigrid *base, uz_multigrid_room *room, uz_cg_info *info, double *x, double *r,
                           const uz_cg_stop *stop, uz_error *err)
{
    rough v;
    bool begun = false;
    memset(info, 0, sizeof *info);
    if (base->levels == 1 || !(base->drift > 0.0) ||
        (!(stop->absolute > 0.0) && stop->relative * UZ_HIDDEN < base->drift))
        return UZ_OK;
    uz_status status = begin(&v, &begun, (const uz_aggregates *)base, room, r, err);
    if (status != UZ_OK || !begun)
        return status;
    info->first = info->last = v.unit * uz_root(v.square);
    const double goal = fmax(stop->absolute, stop->relative * info->first);
    info->met = info->first <= goal;
    if (!info->met && goal * UZ_HIDDEN >= base->drift * info->first) {
        v.whole_x = x;
        v.whole_r = r;
        status = iterate(&v, info, goal / v.unit, stop, err);
        info->last = v.unit * uz_root(v.square);
        info->met = info->last <= goal;
        if (info->iterations > 0) { /* else r is as it was, in double precision */
            uz_level_take_step(&v.step, UZ_STEP_RAISE);
            uz_by_pieces(leave, &v, base->n);
        }
    }
    end(&v);
    return status;
}

uz_status uz_step_roughly(const uz_multigrid *base, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                          void *ctx, uz_error *err)
{
    rough v;
    bool go_on = false;
    if (base->levels == 1)
        return UZ_OK;
    uz_status status = begin(&v, &go_on, (const uz_aggregates *)base, room, r, err);
    if (status != UZ_OK || !go_on)
        return status;
    for (bool moves = true; status == UZ_OK && go_on && moves && v.square > 0.0;) {
        const double before = v.square, unit = v.unit * v.unit;
        double along;
        status = take_step(&v, &along, err);
        moves = along > 0.0;
        go_on = moves && status == UZ_OK && visit(ctx, along, unit * before, unit * v.square);
        turn_direction(&v);
    }
    end(&v);
    return status;
}
