/* sweep.c: products on a grid, with what follows each plane of nodes done while it is in the cache.
 *
 * Once both layers of cells beside a plane of nodes are through, K x is known there, and x there is not read again: a
 * step of the smoother can change it on the spot. Threads share a sweep in slabs of planes. */
#include "brick/levels.h"

#include "core/alloc.h"
#include "core/cpu.h"

#include <stdlib.h>
#include <string.h>

#define REAL float
#include "brick/line.inc"

bool uz_brick_planes_init(uz_brick_planes *room, const uz_brick_level *level, size_t *bytes)
{
    const int64_t plane = 3 * level->plane + 2 * UZ_BRICK_PAD, sums = FIELDS * line_room(level->stride),
                  line = 2 * (level->stride + UZ_BRICK_PAD);
    bool ok = (room->of_plane = uz_alloc_zero(level->cells[2] + 1, sizeof(double)));
    *bytes += 8 * (size_t)(level->cells[2] + 1);
    room->most = uz_aside_count();
    for (int part = 0; part < room->most; part++) {
        struct uz_brick_room *of = &room->of[part];
        ok = (of->plane[0] = uz_alloc_zero(plane, sizeof(float))) && ok;
        ok = (of->plane[1] = uz_alloc_zero(plane, sizeof(float))) && ok;
        ok = (of->sums = uz_alloc_zero(sums, sizeof(float))) && ok;
        ok = (of->line = uz_alloc_zero(line, sizeof(float))) && ok;
        ok = (room->most < 2 || (of->edge = uz_alloc_zero(plane, sizeof(float)))) && ok;
        *bytes += 4 * (size_t)((room->most < 2 ? 2 : 3) * plane + sums + line);
    }
    return ok;
}

void uz_brick_planes_clear(uz_brick_planes *room)
{
    for (int part = 0; part < room->most; part++) {
        struct uz_brick_room *of = &room->of[part];
        float *all[] = {of->plane[0], of->plane[1], of->sums, of->line, of->edge};
        for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
            free(all[k]);
    }
    free(room->of_plane);
    memset(room, 0, sizeof *room);
}

/* What a layer of cells lies between: a plane of nodes and the next one, whose components begin so many numbers apart.
 */
typedef struct {
    const float *near, *far;
    int64_t apart_near, apart_far;
} nodes;

/* What the cells of a layer do to the nodes is added to near, and is all that far has. */
static inline __attribute__((always_inline)) void layer(const uz_brick_level *level, float *sums, const nodes *x,
                                                        float *near, float *far)
{
    for (int64_t j = 0; j < level->cells[1]; j++) {
        const float *in[COMPONENTS * LINES];
        float *out[COMPONENTS * LINES];
        for (int m = 0; m < COMPONENTS; m++)
            for (int q = 0; q < LINES; q++) {
                const int64_t line = (j + q % 2) * level->stride;
                in[m * LINES + q] = q < 2 ? x->near + m * x->apart_near + line : x->far + m * x->apart_far + line;
                out[m * LINES + q] = (q < 2 ? near : far) + m * level->plane + line;
            }
        cells_of_line(sums, in, level->cells[0], level->stride, level->block);
        nodes_of_line(out, sums, level->stride, j == 0);
    }
}

/* Functions of their own: a slab has to compute what the one below it has to the last bit. */
__attribute__((noinline)) UZ_AVX2_FMA static void layer_wide(const uz_brick_level *level, float *sums, const nodes *x,
                                                             float *near, float *far)
{
    layer(level, sums, x, near, far);
}

__attribute__((noinline)) static void layer_narrow(const uz_brick_level *level, float *sums, const nodes *x,
                                                   float *near, float *far)
{
    layer(level, sums, x, near, far);
}

typedef enum { STEP, RESIDUAL, CURVATURE } task;

typedef double wide_lanes __attribute__((vector_size(WIDTH * sizeof(double))));

/* Numbers of a plane of one component, registers of them. Returns what they add to a sum. */
static inline __attribute__((always_inline)) double finish(const uz_brick_vectors *v, int64_t at, int64_t n,
                                                           const float *Kx, task what, float p, float q)
{
    float *restrict x = v->x + at, *restrict d = v->d + at, *restrict t = v->t + at;
    const float *restrict b = v->b + at, *restrict inverse = v->inverse + at;
    for (int64_t i = 0; what == STEP && i < n; i++) {
        d[i] = p * d[i] + q * inverse[i] * (b[i] - Kx[i]);
        x[i] += d[i];
    }
    for (int64_t i = 0; what == RESIDUAL && i < n; i++)
        t[i] = inverse[i] != 0.0F ? b[i] - Kx[i] : 0.0F;
    if (what != CURVATURE)
        return 0.0;
    for (int64_t i = 0; i < n; i++)
        t[i] = inverse[i] != 0.0F ? Kx[i] : 0.0F;
    wide_lanes sums = {0.0};
    for (int64_t i = 0; i < n; i += WIDTH)
        sums += __builtin_convertvector(*(const lanes *)(x + i), wide_lanes) *
                __builtin_convertvector(*(const lanes *)(t + i), wide_lanes);
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

UZ_AVX2_FMA static double finish_wide(const uz_brick_vectors *v, int64_t at, int64_t n, const float *Kx, task what,
                                      float p, float q)
{
    return finish(v, at, n, Kx, what, p, q);
}

static double finish_narrow(const uz_brick_vectors *v, int64_t at, int64_t n, const float *Kx, task what, float p,
                            float q)
{
    return finish(v, at, n, Kx, what, p, q);
}

/* A sweep as the threads that share it see it. */
typedef struct {
    const uz_brick_level *level;
    const uz_brick_vectors *v;
    const uz_brick_planes *room;
    task what;
    float p, q;
    int slabs;
} sweep;

/* The layer of cells above plane k. edge: the plane above it as it was; NULL: it is so in x. */
static void add_layer(const sweep *s, const struct uz_brick_room *room, int64_t k, const float *edge, float *near,
                      float *far)
{
    const uz_brick_level *level = s->level;
    const float *x = s->v->x + k * level->plane;
    const nodes of = {x, edge ? edge : x + level->plane, level->size, edge ? level->plane : level->size};
    (uz_cpu_has_avx2_fma() ? layer_wide : layer_narrow)(level, room->sums, &of, near, far);
}

/* The first plane's sums from the layer below it, which a step of the slab there is about to change; what that slab
 * reads of this one. */
static void begin_slab(void *ctx, int slab)
{
    const sweep *s = ctx;
    const uz_brick_level *level = s->level;
    const struct uz_brick_room *room = &s->room->of[slab];
    const int64_t first = uz_brick_slab(level->cells[2] + 1, slab, s->slabs);
    if (first == 0) {
        memset(room->plane[0], 0, (size_t)(3 * level->plane) * sizeof(float));
        return;
    }
    add_layer(s, room, first - 1, NULL, room->plane[1], room->plane[0]);
    for (int m = 0; s->what == STEP && m < COMPONENTS; m++)
        memcpy(room->edge + m * level->plane, s->v->x + m * level->size + first * level->plane,
               (size_t)level->plane * sizeof(float));
}

static void sweep_slab(void *ctx, int slab)
{
    const sweep *s = ctx;
    const uz_brick_level *level = s->level;
    const struct uz_brick_room *room = &s->room->of[slab];
    const int64_t first = uz_brick_slab(level->cells[2] + 1, slab, s->slabs),
                  end = uz_brick_slab(level->cells[2] + 1, slab + 1, s->slabs);
    const float *above = s->what == STEP && slab + 1 < s->slabs ? s->room->of[slab + 1].edge : NULL;
    float *planes[2] = {room->plane[0], room->plane[1]};
    if (s->what != STEP)
        begin_slab(ctx, slab);
    for (int64_t k = first; k < end; k++) {
        if (k < level->cells[2])
            add_layer(s, room, k, k + 1 == end ? above : NULL, planes[0], planes[1]);
        double sum = 0.0;
        for (int m = 0; m < COMPONENTS; m++)
            sum += (uz_cpu_has_avx2_fma() ? finish_wide : finish_narrow)(s->v, m * level->size + k * level->plane,
                                                                         level->plane, planes[0] + m * level->plane,
                                                                         s->what, s->p, s->q);
        s->room->of_plane[k] = sum;
        float *const done = planes[0];
        planes[0] = planes[1];
        planes[1] = done;
    }
}

void uz_brick_step(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room, float p,
                   float q)
{
    sweep s = {level, v, room, STEP, p, q, uz_brick_slabs(level->cells[2] + 1, level->size, room->most)};
    uz_aside_share(begin_slab, &s, s.slabs);
    uz_aside_share(sweep_slab, &s, s.slabs);
}

void uz_brick_residual(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    sweep s = {level, v, room, RESIDUAL, 0.0F, 0.0F, uz_brick_slabs(level->cells[2] + 1, level->size, room->most)};
    uz_aside_share(sweep_slab, &s, s.slabs);
}

double uz_brick_curvature(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    sweep s = {level, v, room, CURVATURE, 0.0F, 0.0F, uz_brick_slabs(level->cells[2] + 1, level->size, room->most)};
    double sum = 0.0;
    uz_aside_share(sweep_slab, &s, s.slabs);
    for (int64_t k = 0; k <= level->cells[2]; k++)
        sum += room->of_plane[k];
    return sum;
}
