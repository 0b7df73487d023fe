/* both.c: conjugate gradients from two residuals at once, in vectors of the first level in double precision: what each
 * of them tells of the spectrum. Matrices are read once for both, so that a step of two takes a third more than one of
 * one. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "core/random.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BOTH = UZ_LANES_MOST, PIECES = 16 };

/* Vectors of the first level; 0 at the surplus numbers of a node. */
typedef struct {
    const uz_aggregates *mg;
    uz_multigrid_room *room;
    int64_t nodes;
    double *r, *p, *q; /* nodes x BOTH x 4 */
    double along[BOTH], beta[BOTH];
    double unit;              /* of the residual that a cycle reads, and of what it makes of it */
    double sum[PIECES][BOTH]; /* of products */
    const double *x, *y;      /* whose products; NULL: what the last cycle made in place of y */
    uint64_t seed[BOTH];
} both;

typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));

static void multiply_piece(void *ctx, int piece)
{
    both *v = ctx;
    const float *z = v->room->x[0];
    four sum[BOTH] = {{0.0}};
    for (int64_t i = v->nodes * piece / PIECES; i < v->nodes * (piece + 1) / PIECES; i++)
        for (int l = 0; l < BOTH; l++) {
            const int64_t at = 4 * (BOTH * i + l);
            sum[l] +=
                *(const four *)(v->x + at) *
                (v->y ? *(const four *)(v->y + at) : __builtin_convertvector(*(const four_floats *)(z + at), four));
        }
    for (int l = 0; l < BOTH; l++)
        v->sum[piece][l] = (sum[l][0] + sum[l][1]) + (sum[l][2] + sum[l][3]);
}

/* x'y of each; in pieces that do not depend on how many threads there are. */
static void multiply_both(double product[BOTH], both *v, const double *x, const double *y, double unit)
{
    v->x = x;
    v->y = y;
    uz_aside_share(multiply_piece, v, PIECES);
    for (int l = 0; l < BOTH; l++) {
        product[l] = 0.0;
        for (int piece = 0; piece < PIECES; piece++)
            product[l] += v->sum[piece][l];
        product[l] *= unit;
    }
}

/* r -= along q, and what of it a cycle reads. */
static void reduce(void *ctx, int64_t begin, int64_t end)
{
    const both *v = ctx;
    float *b = v->room->b[0];
    const double per_unit = 1.0 / v->unit;
    for (int64_t i = begin; i < end; i++)
        for (int l = 0; l < BOTH; l++) {
            const int64_t at = 4 * (BOTH * i + l);
            four *r = (four *)(v->r + at);
            *r -= v->along[l] * *(const four *)(v->q + at);
            *(four_floats *)(b + at) = __builtin_convertvector(*r * per_unit, four_floats);
        }
}

/* p = z + beta p. */
static void turn(void *ctx, int64_t begin, int64_t end)
{
    const both *v = ctx;
    const float *z = v->room->x[0];
    for (int64_t i = begin; i < end; i++)
        for (int l = 0; l < BOTH; l++) {
            const int64_t at = 4 * (BOTH * i + l);
            four *p = (four *)(v->p + at);
            *p = v->unit * __builtin_convertvector(*(const four_floats *)(z + at), four) + v->beta[l] * *p;
        }
}

/* A power of two about ||r||_M^-1, which entries of r do not exceed by more than the root of the bound on M. */
static double unit_of(const double square[BOTH])
{
    const double most = fmax(square[0], square[1]);
    return most > 0.0 && isfinite(most) ? ldexp(1.0, ilogb(most) / 2) : 1.0;
}

/* square = r'M^-1 r, of r less `along` times q. */
static uz_status precondition(double square[BOTH], both *v, uz_error *err)
{
    uz_by_pieces(reduce, v, v->nodes);
    const uz_status status = uz_cycle_below(v->mg, v->room, 0, BOTH, err);
    multiply_both(square, v, v->r, NULL, v->unit);
    return status;
}

/* q = D^-1/2 s, s standard normal. */
static void draw(void *ctx, int64_t begin, int64_t end)
{
    const both *v = ctx;
    const uz_level *level = &v->mg->level[0];
    const int b = level->A.b;
    for (int l = 0; l < BOTH; l++) {
        uint64_t state = uz_random_after(v->seed[l], 2 * (uint64_t)(begin * b));
        for (int64_t i = begin; i < end; i++)
            for (int r = 0; r < b; r++)
                v->q[4 * (BOTH * i + l) + r] = sqrt((double)level->inverse[i * b + r]) * uz_normal(&state);
    }
}

/* r = (D + L) q, so that r r' is (D + L) D^-1 (D + L') on an average: M of the sweeps alone, which coarse corrections
 * only lessen. */
static void raise(void *ctx, int64_t begin, int64_t end)
{
    const both *v = ctx;
    const uz_level *level = &v->mg->level[0];
    const uz_blocks *A = &level->A;
    const int b = A->b;
    for (int64_t i = begin; i < end; i++)
        for (int64_t e = A->ptr[i]; e <= A->ptr[i + 1]; e++) {
            const bool own = e == A->ptr[i + 1];
            const float *block = own ? level->diag + i * b * b : level->off + e * b * b;
            const double *q = v->q + 4 * BOTH * (own ? i : A->idx[e]);
            for (int l = 0; l < BOTH; l++)
                for (int r = 0; r < b; r++)
                    for (int c = 0; c < (own ? r + 1 : b); c++)
                        v->r[4 * (BOTH * i + l) + r] += (double)block[r * b + c] * q[4 * l + c];
        }
}

static uz_status take_steps(both *v, uz_cg_visit visit, void *const ctx[BOTH], uz_error *err)
{
    double square[BOTH], curvature[BOTH];
    bool goes_on[BOTH] = {true, true};
    uz_status status = precondition(square, v, err);
    while (status == UZ_OK && (goes_on[0] || goes_on[1])) {
        uz_by_pieces(turn, v, v->nodes);
        uz_level_multiply_parts(v->q, &v->mg->level[0], v->p, BOTH);
        multiply_both(curvature, v, v->p, v->q, 1.0);
        for (int l = 0; l < BOTH; l++) {
            if (goes_on[l] && !(curvature[l] > 0.0))
                return uz_cg_fail_direction(err);
            v->along[l] = curvature[l] > 0.0 ? square[l] / curvature[l] : 0.0;
        }
        const double before[BOTH] = {square[0], square[1]};
        v->unit = unit_of(before);
        status = precondition(square, v, err);
        for (int l = 0; status == UZ_OK && l < BOTH; l++) {
            v->beta[l] = before[l] > 0.0 ? square[l] / before[l] : 0.0;
            goes_on[l] = goes_on[l] && visit(ctx[l], v->along[l], before[l], square[l]);
        }
    }
    return status;
}

uz_status uz_step_both(const uz_multigrid *base, uz_multigrid_room *room, const uint64_t seed[2], uz_cg_visit visit,
                       void *const ctx[2], uz_error *err)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const int64_t nodes = mg->level[0].A.nodes, n = nodes * BOTH * 4;
    both v = {.mg = mg,
              .room = room,
              .nodes = nodes,
              .seed = {seed[0], seed[1]},
              .unit = 1.0, /* of the numbers that the scaled diagonal has */
              .r = uz_alloc_zero(n, sizeof *v.r),
              .p = uz_alloc_zero(n, sizeof *v.p),
              .q = uz_alloc_zero(n, sizeof *v.q)};
    uz_status status =
        v.r && v.p && v.q && uz_room_for_lanes(room, base)
            ? UZ_OK
            : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to bound the spectrum of %lld dofs", (long long)base->n);
    if (status == UZ_OK) {
        uz_by_pieces(draw, &v, nodes);
        uz_by_pieces(raise, &v, nodes);
        status = take_steps(&v, visit, ctx, err);
    }
    uz_free_all(v.r, v.p, v.q);
    return status;
}
