/* cycle.c: one V-cycle on smoothed aggregates, with some dofs held.
 *
 * A sweep of Gauss-Seidel forwards before the coarse correction and one backwards after it: so the cycle is symmetric,
 * and positive definite whatever the matrices are, as long as their diagonals are positive. Each sweep reads the blocks
 * left of the diagonal once. On the way down a node takes what those before it have left of its right-hand side, and
 * the residual of those before it takes what the node, now known, exerts on them. On the way up a node takes the same
 * from those before it, as they are, and has been told by those after it what they exert, as they have become. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/sanitized.h"
#include "linalg/pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef float four __attribute__((vector_size(16), aligned(4), may_alias));
typedef float eight __attribute__((vector_size(32), aligned(4), may_alias));

/* Rows of blocks are read four or eight numbers at a time. What is read beyond them counts for nothing, as the surplus
 * numbers of a node are 0 in x, and are not read in b and t. */
enum { ROWS_MOST = 6 };

static inline __attribute__((always_inline)) float sum_four(const four *x)
{
    return ((*x)[0] + (*x)[1]) + ((*x)[2] + (*x)[3]);
}

static inline __attribute__((always_inline)) float sum_eight(const eight *x)
{
    const four all = __builtin_shufflevector(*x, *x, 0, 1, 2, 3) + __builtin_shufflevector(*x, *x, 4, 5, 6, 7);
    return sum_four(&all);
}

/* s = b - t - (blocks left of the diagonal) x. The blocks are gone through as the nodes are: against that order memory
 * is not read ahead, which made a sweep up take 1.3 to 1.8 times as long as one down. */
static inline __attribute__((always_inline)) void gather(float s[UZ_LANES_MOST][ROWS_MOST], const uz_level *level,
                                                         const float *x, int64_t i, bool upwards, int b, int lanes)
{
    const int parts = b > 4 ? 2 : 1;
    const int64_t first = level->A.ptr[i], end = level->A.ptr[i + 1], size = upwards ? -(int64_t)b * b : (int64_t)b * b;
    const int32_t *column = level->A.idx + (upwards ? end - 1 : first);
    const float *block = level->off + (upwards ? end - 1 : first) * b * b;
    four sum[UZ_LANES_MOST][ROWS_MOST] = {{{0}}};
    eight wide[UZ_LANES_MOST][ROWS_MOST] = {{{0}}};
    for (int64_t e = first; e < end; e++, block += size, column += upwards ? -1 : 1) {
        const float *of = x + (int64_t)*column * 4 * parts * lanes;
        for (int l = 0; l < lanes; l++)
            for (int r = 0; r < b; r++)
                if (parts > 1)
                    wide[l][r] += *(const eight *)(block + r * b) * *(const eight *)(of + 8 * l);
                else
                    sum[l][r] += *(const four *)(block + r * b) * *(const four *)(of + 4 * l);
    }
    for (int l = 0; l < lanes; l++)
        for (int r = 0; r < b; r++)
            s[l][r] -= parts > 1 ? sum_eight(&wide[l][r]) : sum_four(&sum[l][r]);
}

/* t += (the same blocks)' value. */
static inline __attribute__((always_inline)) void
scatter(float *t, const uz_level *level, float value[UZ_LANES_MOST][ROWS_MOST], int64_t i, int b, int lanes)
{
    const int parts = b > 4 ? 2 : 1;
    const int64_t first = level->A.ptr[i], count = level->A.ptr[i + 1] - first;
    const int32_t *column = level->A.idx + first, *end = column + count;
    const float *block = level->off + first * b * b;
    for (; column < end; column++, block += (int64_t)b * b) {
        float *to = t + (int64_t)*column * 4 * parts * lanes;
        for (int l = 0; l < lanes; l++)
            if (parts > 1) {
                eight sum = *(eight *)(to + 8 * l);
                for (int r = 0; r < b; r++)
                    sum += *(const eight *)(block + r * b) * value[l][r];
                *(eight *)(to + 8 * l) = sum;
            } else {
                four sum = *(four *)(to + 4 * l);
                for (int r = 0; r < b; r++)
                    sum += *(const four *)(block + r * b) * value[l][r];
                *(four *)(to + 4 * l) = sum;
            }
    }
}

/* A node's numbers and the surplus ones: four at a time, as what follows soon reads them so and would else wait until
 * each number had got to the cache. */
static inline __attribute__((always_inline)) void store(float *to, const float *value, int b)
{
    for (int q = 0; q < uz_width(b); q += 4) {
        four all = {0};
        for (int r = q; r < b && r < q + 4; r++)
            all[r - q] = value[r];
        *(four *)(to + q) = all;
    }
}

/* Nodes, or aggregates where a step is one to these: what of it is to be done. */
typedef struct {
    int64_t first, end;
    double *product; /* lanes: what these have of it */
    /* Others that have nothing to do with them are gone through by turns: a node waits for the one before it, which it
     * mostly has a block with, and half as long where that is of the others. */
    int64_t also_first, also_end; /* equal: none */
    double *also_product;
} range;

/* The nodes of both, on their way up or down. */
typedef struct {
    int64_t first[2], end[2];
    int of; /* which it is that comes next */
} turns;

static inline __attribute__((always_inline)) bool next_node(int64_t *node, int *of, turns *left, bool upwards)
{
    if (left->first[left->of] == left->end[left->of])
        left->of ^= 1;
    *of = left->of;
    if (left->first[*of] == left->end[*of])
        return false;
    *node = upwards ? --left->end[*of] : left->first[*of]++;
    left->of ^= 1;
    return true;
}

/* x = (D + L)^-1 b, t = b - A x, of which L'x alone is not 0; of nodes whose blocks are among themselves, or with those
 * that are done. reduces: afterwards swept -= share (along + x), t = -L'swept. */
static inline __attribute__((always_inline)) void sweep_down(const uz_level_step *step, range of, bool reduces, int b,
                                                             int lanes)
{
    const uz_level *level = step->level;
    const int width = uz_width(b);
    turns both = {{of.first, of.also_first}, {of.end, of.also_end}, 0};
    int64_t i;
    int which;
    while (next_node(&i, &which, &both, false)) {
        const float *own = level->diag + i * b * b, *inverse = step->inverse + i * b;
        float s[UZ_LANES_MOST][ROWS_MOST] = {{0}}, value[UZ_LANES_MOST][ROWS_MOST] = {{0}};
        for (int l = 0; l < lanes; l++)
            for (int r = 0; r < b; r++)
                s[l][r] = step->b[(i * lanes + l) * width + r];
        gather(s, level, step->x, i, false, b, lanes);
        for (int l = 0; l < lanes; l++) {
            float *x = step->x + (i * lanes + l) * width, *t = step->t + (i * lanes + l) * width;
            float left[ROWS_MOST] = {0};
            for (int r = 0; r < b; r++) {
                for (int c = 0; c < r; c++)
                    s[l][r] -= own[r * b + c] * value[l][c];
                value[l][r] = inverse[r] * s[l][r];
            }
            store(x, value[l], b);
            for (int r = 0; reduces && r < b; r++) {
                const int64_t at = (i * lanes + l) * width + r;
                value[l][r] = step->swept[at] -= step->share[l] * (step->along[at] + value[l][r]);
            }
            for (int r = 0; r < b; r++) {
                left[r] = 0.0F;
                for (int c = r + 1; c < b; c++)
                    left[r] -= own[r * b + c] * value[l][c];
            }
            store(t, left, b);
            for (int r = 0; r < b; r++)
                value[l][r] = -value[l][r];
        }
        scatter(step->t, level, value, i, b, lanes);
    }
}

/* x = (D + L')^-1 (b - L x), likewise, those after them being done. t: zeros before the first of all. rises: b is
 * D swept, and product = swept'(D x + t). */
static inline __attribute__((always_inline)) void sweep_up(const uz_level_step *step, range of, bool rises, int b,
                                                           int lanes)
{
    const uz_level *level = step->level;
    const int width = uz_width(b);
    double product[2][UZ_LANES_MOST] = {{0.0}};
    turns both = {{of.first, of.also_first}, {of.end, of.also_end}, 0};
    int64_t i;
    int which;
    while (next_node(&i, &which, &both, true)) {
        const float *own = level->diag + i * b * b, *inverse = step->inverse + i * b;
        float s[UZ_LANES_MOST][ROWS_MOST] = {{0}}, value[UZ_LANES_MOST][ROWS_MOST] = {{0}};
        for (int l = 0; l < lanes; l++)
            for (int r = 0; r < b; r++) {
                const int64_t at = (i * lanes + l) * width + r;
                s[l][r] = (rises ? own[r * b + r] * step->swept[at] : step->b[at]) - step->t[at];
                value[l][r] = step->x[at];
            }
        gather(s, level, step->x, i, true, b, lanes);
        for (int l = 0; l < lanes; l++) {
            float *x = step->x + (i * lanes + l) * width;
            for (int r = b - 1; r >= 0; r--) {
                for (int c = 0; c < b; c++)
                    s[l][r] -= c == r ? 0.0F : own[r * b + c] * value[l][c];
                value[l][r] = inverse[r] * s[l][r];
            }
            for (int r = 0; r < b; r++) {
                float above = 0.0F;
                for (int c = r + 1; c < b; c++)
                    above += own[r * b + c] * value[l][c];
                const int64_t at = (i * lanes + l) * width + r;
                above = step->t[at] += above;
                x[r] = value[l][r];
                if (rises)
                    product[which][l] += (double)step->swept[at] * (double)(own[r * b + r] * value[l][r] + above);
            }
        }
        scatter(step->t, level, value, i, b, lanes);
    }
    for (int l = 0; rises && l < lanes; l++) {
        of.product[l] = product[0][l];
        if (of.also_product)
            of.also_product[l] = product[1][l];
    }
}

/* x = (D + L) swept. */
static inline __attribute__((always_inline)) void raise_swept(const uz_level_step *step, range of, int b, int lanes)
{
    const uz_level *level = step->level;
    const int width = uz_width(b);
    for (int64_t i = of.first; i < of.end; i++) {
        const float *own = level->diag + i * b * b;
        float s[UZ_LANES_MOST][ROWS_MOST] = {{0}};
        gather(s, level, step->swept, i, false, b, lanes);
        for (int l = 0; l < lanes; l++)
            for (int r = 0; r < b; r++) {
                const float *swept = step->swept + (i * lanes + l) * width;
                float sum = -s[l][r];
                for (int c = 0; c <= r; c++)
                    sum += own[r * b + c] * swept[c];
                step->x[(i * lanes + l) * width + r] = sum;
            }
    }
}

/* coarse = P't, but for rows of held dofs; of these aggregates, whose nodes are looked for among all. */
static inline __attribute__((always_inline)) void restrict_to(const uz_level_step *step, range of, int b, int k,
                                                              int lanes)
{
    const uz_level *level = step->level;
    const int width = uz_width(b), parts = k > 4 ? 2 : 1, wide = 4 * parts * lanes;
    const int64_t *ptr = level->ptr;
    const int32_t *block = level->block;
    float *coarse = step->coarse;
    memset(coarse + of.first * wide, 0, (size_t)((of.end - of.first) * wide) * sizeof *coarse);
    for (int64_t i = 0; i < level->A.nodes; i++) {
        const int64_t end = ptr[i + 1];
        int64_t e = ptr[i];
        while (e < end && block[e] < of.first)
            e++;
        if (e == end || block[e] >= of.end)
            continue;
        float t[UZ_LANES_MOST][ROWS_MOST] = {{0}};
        for (int l = 0; l < lanes; l++)
            for (int r = 0; r < b; r++)
                t[l][r] = step->inverse[i * b + r] > 0.0F ? step->t[(i * lanes + l) * width + r] : 0.0F;
        const float *P = level->value + e * b * k;
        for (; e < end && block[e] < of.end; e++, P += (int64_t)b * k)
            for (int l = 0; l < lanes; l++) {
                float *to = coarse + ((int64_t)block[e] * lanes + l) * 4 * parts;
                eight all = {0};
                four sum = {0};
                for (int r = 0; r < b; r++)
                    if (parts > 1)
                        all += *(const eight *)(P + r * k) * t[l][r];
                    else
                        sum += *(const four *)(P + r * k) * t[l][r];
                if (parts > 1)
                    *(eight *)to += all;
                else
                    *(four *)to += sum;
            }
    }
}

/* x += P coarse, but at held dofs; places: x = P coarse, 0 there, and t = 0. */
static inline __attribute__((always_inline)) void prolong_from(const uz_level_step *step, range of, bool places, int b,
                                                               int k, int lanes)
{
    const uz_level *level = step->level;
    const int width = uz_width(b), parts = k > 4 ? 2 : 1;
    for (int64_t i = of.first; i < of.end; i++) {
        four sum[UZ_LANES_MOST][ROWS_MOST] = {{{0}}};
        eight wide[UZ_LANES_MOST][ROWS_MOST] = {{{0}}};
        for (int64_t e = level->ptr[i]; e < level->ptr[i + 1]; e++) {
            const float *P = level->value + e * b * k;
            for (int l = 0; l < lanes; l++) {
                const float *from = step->coarse + ((int64_t)level->block[e] * lanes + l) * 4 * parts;
                for (int r = 0; r < b; r++)
                    if (parts > 1)
                        wide[l][r] += *(const eight *)(P + r * k) * *(const eight *)from;
                    else
                        sum[l][r] += *(const four *)(P + r * k) * *(const four *)from;
            }
        }
        for (int l = 0; l < lanes; l++) {
            float *x = step->x + (i * lanes + l) * width, value[ROWS_MOST] = {0}, zero[ROWS_MOST] = {0};
            for (int r = 0; r < b; r++)
                if (step->inverse[i * b + r] > 0.0F)
                    value[r] = parts > 1 ? sum_eight(&wide[l][r]) : sum_four(&sum[l][r]);
            for (int r = 0; !places && r < b; r++)
                value[r] += x[r];
            store(x, value, b);
            if (places)
                store(step->t + (i * lanes + l) * width, zero, b);
        }
    }
}

static inline __attribute__((always_inline)) void take_part(const uz_level_step *s, int what, range of, int b, int k,
                                                            int lanes)
{
    if (what == UZ_STEP_SWEEP_DOWN)
        sweep_down(s, of, false, b, lanes);
    if (what == UZ_STEP_REDUCE)
        sweep_down(s, of, true, b, lanes);
    if (what == UZ_STEP_RAISE)
        raise_swept(s, of, b, lanes);
    if (what == UZ_STEP_RESTRICT)
        restrict_to(s, of, b, k, lanes);
    if (what == UZ_STEP_PROLONG)
        prolong_from(s, of, false, b, k, lanes);
    if (what == UZ_STEP_PLACE)
        prolong_from(s, of, true, b, k, lanes);
    if (what == UZ_STEP_SWEEP_UP)
        sweep_up(s, of, false, b, lanes);
    if (what == UZ_STEP_RISE)
        sweep_up(s, of, true, b, lanes);
}

/* For each size of blocks its own loops; with a sanitizer the same ones for all, as its checks in every copy take five
 * times as long to compile. */
static inline __attribute__((always_inline)) void take_any(const uz_level_step *s, int what, range of, int lanes)
{
    const int b = s->level->A.b, k = s->k;
    if (SANITIZED)
        take_part(s, what, of, b, k, lanes);
    else if (b == 3 && k == 6)
        take_part(s, what, of, 3, 6, lanes);
    else if (b == 6)
        take_part(s, what, of, 6, 6, lanes);
    else if (b == 2 && k == 3)
        take_part(s, what, of, 2, 3, lanes);
    else if (b == 3 && k == 3)
        take_part(s, what, of, 3, 3, lanes);
    else if (b == 2 && k == 2)
        take_part(s, what, of, 2, 2, lanes);
    else
        take_part(s, what, of, b, k, lanes);
}

UZ_AVX2_FMA static void take_fused(const uz_level_step *s, int what, range of)
{
    take_any(s, what, of, 1);
}

UZ_AVX2_FMA static void take_both_fused(const uz_level_step *s, int what, range of)
{
    take_any(s, what, of, UZ_LANES_MOST);
}

static void take_plain(const uz_level_step *s, int what, range of)
{
    take_any(s, what, of, s->lanes);
}

/* A step as the threads that share it see it: parts of the matrix, or as many ranges. */
typedef struct {
    const uz_level_step *step;
    void (*take)(const uz_level_step *s, int what, range of);
    int what, ranges;
    double product[2][UZ_PARTS_MOST][UZ_LANES_MOST]; /* of the parts and of the rest */
} sharing;

static void take_matrix_part(void *ctx, int part)
{
    sharing *x = ctx;
    const int64_t *first = x->step->level->A.part + part;
    x->take(x->step, x->what, (range){.first = first[0], .end = first[1], .product = x->product[0][part]});
}

/* Two parts, each with the one half of all parts behind it. */
static void take_matrix_parts(void *ctx, int part)
{
    sharing *x = ctx;
    const uz_blocks *A = &x->step->level->A;
    const int64_t *first = A->part + part, *also = first + A->parts / 2;
    x->take(x->step, x->what,
            (range){first[0], first[1], x->product[0][part], also[0], also[1], x->product[0][part + A->parts / 2]});
}

static void take_seam(void *ctx, int seam)
{
    sharing *x = ctx;
    const int64_t *first = x->step->level->A.seam + seam;
    x->take(x->step, x->what, (range){.first = first[0], .end = first[1], .product = x->product[1][seam]});
}

/* What is in no part. */
static void take_rest(sharing *x)
{
    const uz_blocks *A = &x->step->level->A;
    if (A->seams > 0)
        uz_aside_share(take_seam, x, A->seams);
    else
        x->take(x->step, x->what,
                (range){.first = A->parts > 0 ? A->part[A->parts] : 0, .end = A->nodes, .product = x->product[1][0]});
}

static void take_range(void *ctx, int part)
{
    const sharing *x = ctx;
    const uz_level *level = x->step->level;
    const int64_t n = x->what == UZ_STEP_RESTRICT ? level->aggregates : level->A.nodes;
    x->take(x->step, x->what, (range){.first = n * part / x->ranges, .end = n * (part + 1) / x->ranges});
}

static void take_step(sharing *x, int what)
{
    const uz_blocks *A = &x->step->level->A;
    x->what = what;
    x->ranges = A->parts > 0 ? uz_aside_threads() : 1;
    if (what == UZ_STEP_SWEEP_UP || what == UZ_STEP_RISE)
        take_rest(x);
    if (what == UZ_STEP_RESTRICT || what == UZ_STEP_PROLONG || what == UZ_STEP_PLACE)
        uz_aside_share(take_range, x, x->ranges);
    else if (what != UZ_STEP_RAISE && A->parts % 2 == 0 && uz_aside_threads() <= A->parts / 2)
        uz_aside_share(take_matrix_parts, x, A->parts / 2);
    else if (A->parts > 0)
        uz_aside_share(take_matrix_part, x, A->parts);
    if (what == UZ_STEP_SWEEP_DOWN || what == UZ_STEP_REDUCE || what == UZ_STEP_RAISE)
        take_rest(x);
}

static void clear(void *ctx, int64_t begin, int64_t end)
{
    memset((float *)ctx + begin, 0, (size_t)(end - begin) * sizeof(float));
}

void uz_level_take_step(const uz_level_step *s, int parts)
{
    sharing x = {.step = s, .take = !uz_cpu_has_avx2_fma() ? take_plain : s->lanes == 1 ? take_fused : take_both_fused};
    for (int what = UZ_STEP_SWEEP_DOWN; what <= UZ_STEP_RISE; what <<= 1) {
        if (!(parts & what))
            continue;
        if (what == UZ_STEP_SWEEP_UP)
            uz_by_pieces(clear, s->t, s->level->A.nodes * s->lanes * uz_width(s->level->A.b));
        take_step(&x, what);
    }
    for (int l = 0; (parts & UZ_STEP_RISE) && l < s->lanes; l++) {
        s->product[l] = 0.0;
        for (int p = 0; p < 2 * UZ_PARTS_MOST; p++)
            s->product[l] += x.product[p / UZ_PARTS_MOST][p % UZ_PARTS_MOST][l];
    }
}

/* x, b: of one lane of so many. */
static uz_status solve_coarsest(const uz_aggregates *mg, uz_multigrid_room *room, float *x, const float *b, int lanes,
                                uz_error *err)
{
    const int last = mg->base.levels - 1;
    const uz_level *level = &mg->level[last];
    const uz_factor *factor = room->coarsest ? room->coarsest : mg->coarsest;
    const float *inverse = room->coarsest ? room->own[last].inverse : level->inverse;
    const int of_node = level->A.b, width = uz_width(of_node), apart = width * lanes;
    for (int64_t i = 0; i < level->A.nodes; i++)
        for (int r = 0; r < of_node; r++)
            room->coarse[i * of_node + r] = inverse[i * of_node + r] > 0.0F ? (double)b[i * apart + r] : 0.0;
    uz_factor_permute(factor, room->permuted, room->coarse);
    uz_status status = uz_factor_solve_one(factor, room->ws, room->permuted, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(factor, room->ws, room->permuted, false, err);
    uz_factor_unpermute(factor, room->coarse, room->permuted);
    for (int64_t i = 0; i < level->A.nodes; i++)
        for (int r = 0; r < width; r++)
            x[i * apart + r] = r < of_node ? (float)room->coarse[i * of_node + r] : 0.0F;
    return status;
}

uz_level_step uz_step_of(uz_level *now, const uz_aggregates *mg, const uz_multigrid_room *room, int l)
{
    *now = mg->level[l];
    if (room->own[l].inverse)
        now->inverse = room->own[l].inverse;
    if (room->own[l].off) {
        now->off = room->own[l].off;
        now->diag = room->own[l].diag;
    }
    return (uz_level_step){.level = now,
                           .inverse = now->inverse,
                           .b = room->b[l],
                           .x = room->x[l],
                           .t = room->t[l],
                           .coarse = room->b[l + 1],
                           .k = mg->level[l + 1].A.b,
                           .lanes = 1};
}

uz_status uz_cycle_below(const uz_aggregates *mg, uz_multigrid_room *room, int from, int lanes, uz_error *err)
{
    const int last = mg->base.levels - 1, apart = uz_width(mg->level[last].A.b);
    uz_level_step at[UZ_LEVELS_MOST];
    uz_level now[UZ_LEVELS_MOST];
    uz_status status = UZ_OK;
    for (int l = from; l < last; l++) {
        at[l] = uz_step_of(&now[l], mg, room, l);
        at[l].lanes = lanes;
        uz_level_take_step(&at[l], UZ_STEP_SWEEP_DOWN | UZ_STEP_RESTRICT);
    }
    for (int lane = 0; status == UZ_OK && lane < lanes; lane++)
        status = solve_coarsest(mg, room, room->x[last] + lane * apart, room->b[last] + lane * apart, lanes, err);
    for (int l = last - 1; l >= from; l--) {
        at[l].coarse = room->x[l + 1];
        uz_level_take_step(&at[l], UZ_STEP_PROLONG | UZ_STEP_SWEEP_UP);
    }
    return status;
}

static uz_status apply_alone(const uz_aggregates *mg, uz_multigrid_room *room, double *z, const double *r,
                             uz_error *err)
{
    const uz_factor *factor = room->coarsest ? room->coarsest : mg->coarsest;
    uz_factor_permute(factor, room->permuted, r);
    uz_status status = uz_factor_solve_one(factor, room->ws, room->permuted, true, err);
    if (status == UZ_OK)
        status = uz_factor_solve_one(factor, room->ws, room->permuted, false, err);
    uz_factor_unpermute(factor, z, room->permuted);
    for (int64_t j = 0; room->held && j < mg->base.n; j++)
        z[j] = room->held[j] ? 0.0 : z[j];
    return status;
}

/* A vector of dofs on its way to the first level, or back. */
typedef struct {
    const uz_aggregates *mg;
    double unit;
    const double *from;
    float *level;
    double *to;
} passage;

static void read_dofs(void *ctx, int64_t begin, int64_t end)
{
    const passage *p = ctx;
    const double *restrict scale = p->mg->scale, *restrict from = p->from, unit = p->unit;
    const int64_t *restrict slot = p->mg->slot;
    float *restrict level = p->level;
    for (int64_t j = begin; j < end; j++)
        level[slot[j]] = (float)(scale[j] * from[j] / unit);
}

static void write_dofs(void *ctx, int64_t begin, int64_t end)
{
    const passage *p = ctx;
    const double *restrict scale = p->mg->scale, unit = p->unit;
    const int64_t *restrict slot = p->mg->slot;
    const float *restrict level = p->level;
    double *restrict to = p->to;
    for (int64_t j = begin; j < end; j++)
        to[j] = scale[j] * (double)level[slot[j]] * unit;
}

double uz_read_dofs(float *level, const uz_aggregates *mg, const double *r)
{
    const double largest = uz_long_max_product(mg->base.n, mg->scale, r);
    if (!(largest > 0.0) || isinf(largest))
        return largest;
    int exponent;
    (void)frexp(largest, &exponent);
    passage p = {.mg = mg, .unit = ldexp(1.0, exponent), .from = r, .level = level};
    uz_by_pieces(read_dofs, &p, mg->base.n);
    return p.unit;
}

static uz_status apply(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const int last = base->levels - 1;
    (void)K;
    if (last == 0)
        return apply_alone(mg, room, z, r, err);
    passage p = {.mg = mg, .unit = uz_read_dofs(room->b[0], mg, r), .to = z};
    if (!(p.unit > 0.0) || isinf(p.unit)) {
        for (int64_t j = 0; j < base->n; j++)
            z[j] = p.unit > 0.0 ? NAN : 0.0;
        return UZ_OK;
    }
    const uz_status status = uz_cycle_below(mg, room, 0, 1, err);
    p.level = room->x[0];
    uz_by_pieces(write_dofs, &p, base->n);
    return status;
}

uz_status uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                             const double *r, uz_error *err)
{
    return mg->kind->apply(mg, K, room, z, r, err);
}

/* A product with level 0. */
typedef struct {
    const uz_aggregates *mg;
    uz_multigrid_room *room;
    double *y;
    const double *x;
} product;

static void enter_product(void *ctx, int64_t begin, int64_t end)
{
    const product *p = ctx;
    const double *restrict scale = p->mg->scale, *restrict x = p->x;
    const int64_t *restrict slot = p->mg->slot;
    double *restrict from = p->room->from;
    for (int64_t j = begin; j < end; j++)
        from[slot[j]] = x[j] / scale[j];
}

static void leave_product(void *ctx, int64_t begin, int64_t end)
{
    const product *p = ctx;
    const double *restrict scale = p->mg->scale, *restrict to = p->room->to;
    const int64_t *restrict slot = p->mg->slot;
    double *restrict y = p->y;
    for (int64_t j = begin; j < end; j++)
        y[j] = to[slot[j]] / scale[j];
}

/* K x = S^-1 (S K S) S^-1 x: powers of two. */
static void multiply(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, double *y, const double *x)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    if (base->levels == 1) {
        memset(y, 0, (size_t)base->n * sizeof *y);
        uz_csc_symv(y, K, 1.0, x);
        return;
    }
    product p = {mg, room, y, x};
    uz_by_pieces(enter_product, &p, base->n);
    uz_level_multiply_parts(room->to, &mg->level[0], room->from, 1);
    uz_by_pieces(leave_product, &p, base->n);
}

static void free_room(uz_multigrid_room *room)
{
    if (!room)
        return;
    uz_factor_workspace_free(room->ws);
    for (int l = 0; l < UZ_LEVELS_MOST; l++) {
        uz_free_all(room->t[l], room->x[l], room->b[l]);
    }
    void *rest[] = {room->coarse, room->permuted, room->to, room->from, room->d};
    for (size_t k = 0; k < sizeof rest / sizeof rest[0]; k++)
        free(rest[k]);
    uz_release_levels(room);
    free(room);
}

static bool make_vectors(uz_multigrid_room *room, const uz_aggregates *mg, int lanes)
{
    bool ok = true;
    for (int l = 0; ok && mg->base.levels > 1 && l < mg->base.levels; l++) {
        float **vector[] = {&room->t[l], &room->x[l], &room->b[l]};
        for (size_t v = 0; ok && v < sizeof vector / sizeof vector[0]; v++) {
            free(*vector[v]);
            *vector[v] = uz_alloc_zero(mg->level[l].A.nodes * lanes * uz_width(mg->level[l].A.b), sizeof(float));
            ok = *vector[v] != NULL;
        }
    }
    return ok;
}

bool uz_room_for_lanes(uz_multigrid_room *room, const uz_multigrid *base)
{
    return make_vectors(room, (const uz_aggregates *)base, UZ_LANES_MOST);
}

static uz_multigrid_room *make_room(const uz_multigrid *base, size_t *bytes)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const uz_level *last = &mg->level[base->levels - 1];
    const int64_t coarsest = base->levels == 1 ? base->n : last->A.nodes * last->A.b, finest = mg->level[0].A.nodes * 4;
    uz_multigrid_room *room = uz_alloc_zero(1, sizeof *room);
    bool ok = room && (room->ws = uz_factor_workspace_new()) && (room->coarse = uz_alloc(coarsest, sizeof(double))) &&
              (room->permuted = uz_alloc(coarsest, sizeof(double))) &&
              (room->to = uz_alloc_zero(finest, sizeof(double))) &&
              (room->from = uz_alloc_zero(finest, sizeof(double))) && (room->d = uz_alloc_zero(finest, sizeof(float)));
    if (room)
        room->levels = base->levels;
    *bytes = sizeof *room + 16 * (size_t)coarsest + 20 * (size_t)finest;
    for (int l = 0; ok && base->levels > 1 && l < base->levels; l++)
        *bytes += 12 * (size_t)(mg->level[l].A.nodes * uz_width(mg->level[l].A.b));
    if (ok && make_vectors(room, mg, 1))
        return room;
    free_room(room);
    return NULL;
}

/* Where K itself is the coarsest matrix: held dofs become rows of the unit matrix. */
static uz_status hold_alone(uz_multigrid_room *room, const uz_csc *K, const bool *held, const uz_stop *stop,
                            uz_error *err)
{
    uz_csc alone = {0};
    uz_status status = uz_csc_copy(&alone, K, err);
    for (int64_t j = 0; status == UZ_OK && j < K->cols; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            if (held[j] || held[K->idx[q]])
                alone.val[q] = K->idx[q] == j ? 1.0 : 0.0;
    if (status == UZ_OK)
        status = uz_factor_coarsest(&room->coarsest, &alone, 0, stop ? stop->hooks : NULL, err);
    uz_csc_clear(&alone);
    return status;
}

static uz_status hold(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, const bool *held,
                      size_t *bytes, const uz_stop *stop, uz_error *err)
{
    uz_release_levels(room);
    room->held = held;
    *bytes = 0;
    if (!held)
        return UZ_OK;
    if (base->levels > 1)
        return uz_hold_levels(room, (const uz_aggregates *)base, held, bytes, stop, err);
    const uz_status status = hold_alone(room, K, held, stop, err);
    *bytes = status == UZ_OK ? uz_factor_describe(room->coarsest).bytes : 0;
    return status;
}

static void free_aggregates(uz_multigrid *base)
{
    uz_aggregates *mg = (uz_aggregates *)base;
    for (int l = 0; l < UZ_LEVELS_MOST; l++) {
        uz_level *level = &mg->level[l];
        void *own[] = {level->off,     level->diag, level->off_rest.value, level->diag_rest.value,
                       level->inverse, level->ptr,  level->block,          level->value};
        uz_blocks_clear(&level->A);
        for (size_t k = 0; k < sizeof own / sizeof own[0]; k++)
            free(own[k]);
    }
    uz_factor_free(mg->coarsest);
    uz_free_all(mg->slot, mg->scale, mg);
}

const uz_multigrid_kind uz_aggregates_kind = {.apply = apply,
                                              .multiply = multiply,
                                              .solve_roughly = uz_solve_roughly,
                                              .step_roughly = uz_step_roughly,
                                              .step_both = uz_step_both,
                                              .room = make_room,
                                              .free_room = free_room,
                                              .hold = hold,
                                              .free = free_aggregates};
