/* sweep.c: products on a grid, with what follows each plane of nodes done while it is in the cache.
 *
 * Once both layers of cells beside a plane of nodes are through, K x is known there, and x there is not read again: a
 * step of the smoother can change it on the spot. */
#include "brick/levels.h"

#include "core/cpu.h"

#include <string.h>

#define REAL float
#include "brick/line.inc"

static inline __attribute__((always_inline)) void layer(const uz_brick_level *level, const float *x,
                                                        const uz_brick_planes *room, float *const planes[2], int64_t k)
{
    for (int64_t j = 0; j < level->cells[1]; j++) {
        const float *in[COMPONENTS * LINES];
        float *out[COMPONENTS * LINES];
        for (int m = 0; m < COMPONENTS; m++)
            for (int q = 0; q < LINES; q++) {
                in[m * LINES + q] = x + m * level->size + (k + q / 2) * level->plane + (j + q % 2) * level->stride;
                out[m * LINES + q] = planes[q / 2] + m * level->plane + (j + q % 2) * level->stride;
            }
        cells_of_line(room->sums, in, level->cells[0], level->stride, level->block);
        nodes_of_line(out, room->sums, level->stride);
    }
}

typedef enum { STEP, RESIDUAL } task;

/* Numbers of a plane of one component. */
static inline __attribute__((always_inline)) void finish(const uz_brick_vectors *v, int64_t at, int64_t n,
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
}

static inline __attribute__((always_inline)) void sweep(const uz_brick_level *level, const uz_brick_vectors *v,
                                                        const uz_brick_planes *room, task what, float p, float q)
{
    const size_t bytes = (size_t)(3 * level->plane) * sizeof(float);
    float *planes[2] = {room->plane[0], room->plane[1]};
    memset(planes[0], 0, bytes);
    for (int64_t k = 0; k <= level->cells[2]; k++) {
        memset(planes[1], 0, bytes);
        if (k < level->cells[2])
            layer(level, v->x, room, planes, k);
        for (int m = 0; m < COMPONENTS; m++)
            finish(v, m * level->size + k * level->plane, level->plane, planes[0] + m * level->plane, what, p, q);
        float *const done = planes[0];
        planes[0] = planes[1];
        planes[1] = done;
    }
}

UZ_AVX2_FMA static void sweep_wide(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room,
                                   task what, float p, float q)
{
    sweep(level, v, room, what, p, q);
}

static void sweep_narrow(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room, task what,
                         float p, float q)
{
    sweep(level, v, room, what, p, q);
}

void uz_brick_step(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room, float p,
                   float q)
{
    (uz_cpu_has_avx2_fma() ? sweep_wide : sweep_narrow)(level, v, room, STEP, p, q);
}

void uz_brick_residual(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room)
{
    (uz_cpu_has_avx2_fma() ? sweep_wide : sweep_narrow)(level, v, room, RESIDUAL, 0.0F, 0.0F);
}
