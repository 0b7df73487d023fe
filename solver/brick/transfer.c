/* transfer.c: linear interpolation between a grid and the next coarser one, and its transpose, axis by axis. */
#include "brick/levels.h"

#include "core/alloc.h"
#include "core/cpu.h"

#include <stdlib.h>
#include <string.h>

bool uz_brick_axis_init(uz_brick_axis *axis, int64_t fine, int64_t coarse)
{
    axis->fine = fine;
    axis->coarse = coarse;
    axis->halves = fine == 2 * coarse;
    axis->below = uz_alloc_zero(fine + 1, sizeof *axis->below);
    axis->beyond = uz_alloc_zero(fine + 1, sizeof *axis->beyond);
    axis->first = uz_alloc_zero(coarse + 1, sizeof *axis->first);
    axis->share = uz_alloc_zero((coarse + 1) * UZ_BRICK_SHARES, sizeof *axis->share);
    if (!axis->below || !axis->beyond || !axis->first || !axis->share)
        return false;
    /* stands at i coarse / fine, in coarse cells; of an axis that is not there its one node is the coarse one */
    for (int64_t i = 0; fine > 0 && i <= fine; i++) {
        const int64_t below = i == fine ? coarse - 1 : i * coarse / fine, rest = i * coarse - below * fine;
        axis->below[i] = (int32_t)below;
        axis->beyond[i] = (float)rest / (float)fine;
    }
    for (int64_t c = 0; c <= coarse; c++)
        axis->first[c] = -1;
    for (int64_t i = 0; i <= fine; i++)
        for (int side = 0; side < 2; side++) {
            const int64_t c = axis->below[i] + side;
            const float share = side ? axis->beyond[i] : 1.0F - axis->beyond[i];
            if (share <= 0.0F)
                continue;
            if (axis->first[c] < 0)
                axis->first[c] = (int32_t)i;
            axis->share[c * UZ_BRICK_SHARES + (i - axis->first[c])] = share;
        }
    return true;
}

void uz_brick_axis_clear(uz_brick_axis *axis)
{
    uz_free_all(axis->below, axis->beyond, axis->first, axis->share);
    memset(axis, 0, sizeof *axis);
}

/* out += share line. */
static inline __attribute__((always_inline)) void add_line(float *restrict out, const float *restrict line, float share,
                                                           int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        out[i] += share * line[i];
}

/* out (coarse) = shares of line (fine), which goes on with zeros. */
static inline __attribute__((always_inline)) void gather(float *restrict out, const uz_brick_axis *x,
                                                         const float *restrict line)
{
    if (x->fine == x->coarse) {
        memcpy(out, line, (size_t)(x->fine + 1) * sizeof *out);
    } else if (x->halves) {
        out[0] = line[0] + 0.5F * line[1];
        for (int64_t i = 1; i <= x->coarse; i++)
            out[i] = line[2 * i] + 0.5F * (line[2 * i - 1] + line[2 * i + 1]);
    } else {
        for (int64_t i = 0; i <= x->coarse; i++) {
            const float *share = x->share + i * UZ_BRICK_SHARES, *from = line + x->first[i];
            out[i] = (share[0] * from[0] + share[1] * from[1]) + (share[2] * from[2] + share[3] * from[3]);
        }
    }
}

/* From a grid to the next coarser one or back, as the threads that share it see it. */
typedef struct {
    const uz_brick_level *f, *c;
    const uz_brick_vectors *v, *coarse;
    const uz_brick_planes *room;
    int slabs;
} transfer;

/* Of the coarse planes from `first` to `end`. */
static inline __attribute__((always_inline)) void restrict_all(const transfer *t, float *line, int64_t first,
                                                               int64_t end)
{
    const uz_brick_level *f = t->f, *c = t->c;
    const uz_brick_vectors *v = t->v, *coarse = t->coarse;
    const uz_brick_axis *to = f->to;
    for (int m = 0; m < f->axes; m++)
        for (int64_t K = first; K < end; K++)
            for (int64_t J = 0; J <= c->cells[1]; J++) {
                const int64_t at = m * c->size + K * c->plane + J * c->stride;
                const float *inverse = coarse->inverse + at;
                float *out = coarse->b + at;
                memset(line, 0, (size_t)(f->stride + UZ_BRICK_PAD) * sizeof *line);
                for (int k = 0; k < UZ_BRICK_SHARES; k++)
                    for (int j = 0; j < UZ_BRICK_SHARES; j++) {
                        const float share = to[2].share[K * UZ_BRICK_SHARES + k] * to[1].share[J * UZ_BRICK_SHARES + j];
                        if (share != 0.0F)
                            add_line(line,
                                     v->t + m * f->size + (to[2].first[K] + k) * f->plane +
                                         (to[1].first[J] + j) * f->stride,
                                     share, f->stride);
                    }
                gather(out, &to[0], line);
                for (int64_t i = 0; i <= c->cells[0]; i++)
                    out[i] = inverse[i] != 0.0F ? out[i] : 0.0F;
            }
}

/* out (fine) = what stands between the numbers of line (coarse). */
static inline __attribute__((always_inline)) void spread(float *restrict out, const uz_brick_axis *x,
                                                         const float *restrict line)
{
    if (x->fine == x->coarse) {
        memcpy(out, line, (size_t)(x->fine + 1) * sizeof *out);
    } else if (x->halves) {
        for (int64_t i = 0; i < x->coarse; i++) {
            out[2 * i] = line[i];
            out[2 * i + 1] = 0.5F * (line[i] + line[i + 1]);
        }
        out[x->fine] = line[x->coarse];
    } else {
        for (int64_t i = 0; i <= x->fine; i++)
            out[i] = line[x->below[i]] + x->beyond[i] * (line[x->below[i] + 1] - line[x->below[i]]);
    }
}

/* To plane k of the fine grid, x there, whose components begin so many numbers apart. */
static inline __attribute__((always_inline)) void prolong_any(const uz_brick_level *f, const uz_brick_level *c,
                                                              const float *inverse, const float *coarse, float *line,
                                                              int64_t k, float *plane, int64_t apart)
{
    const uz_brick_axis *to = f->to;
    float *const out = line + f->stride + UZ_BRICK_PAD;
    for (int m = 0; m < f->axes; m++)
        for (int64_t j = 0; j <= f->cells[1]; j++) {
            const float *restrict free = inverse + m * f->size + k * f->plane + j * f->stride, z = to[2].beyond[k],
                                  y = to[1].beyond[j];
            const float share[4] = {(1.0F - y) * (1.0F - z), y * (1.0F - z), (1.0F - y) * z, y * z};
            float *restrict x = plane + m * apart + j * f->stride;
            memset(line, 0, (size_t)c->stride * sizeof *line);
            for (int q = 0; q < 4; q++)
                if (share[q] != 0.0F)
                    add_line(line,
                             coarse + m * c->size + (to[2].below[k] + q / 2) * c->plane +
                                 (to[1].below[j] + q % 2) * c->stride,
                             share[q], c->stride);
            spread(out, &to[0], line);
            for (int64_t i = 0; i <= f->cells[0]; i++)
                x[i] += free[i] != 0.0F ? out[i] : 0.0F;
        }
}

UZ_AVX2_FMA static void restrict_wide(const transfer *t, float *line, int64_t first, int64_t end)
{
    restrict_all(t, line, first, end);
}

__attribute__((noinline)) UZ_AVX2_FMA static void prolong_wide(const uz_brick_level *f, const uz_brick_level *c,
                                                               const float *inverse, const float *coarse, float *line,
                                                               int64_t k, float *plane, int64_t apart)
{
    prolong_any(f, c, inverse, coarse, line, k, plane, apart);
}

__attribute__((noinline)) static void prolong_narrow(const uz_brick_level *f, const uz_brick_level *c,
                                                     const float *inverse, const float *coarse, float *line, int64_t k,
                                                     float *plane, int64_t apart)
{
    prolong_any(f, c, inverse, coarse, line, k, plane, apart);
}

void uz_brick_prolong_plane(const uz_brick_level *level, const uz_brick_level *next, const float *inverse,
                            const float *coarse, float *line, int64_t k, float *plane, int64_t apart)
{
    (uz_cpu_has_avx2_fma() ? prolong_wide : prolong_narrow)(level, next, inverse, coarse, line, k, plane, apart);
}

static void restrict_slab(void *ctx, int slab)
{
    const transfer *t = ctx;
    const int64_t planes = t->c->cells[2] + 1;
    (uz_cpu_has_avx2_fma() ? restrict_wide : restrict_all)(
        t, t->room->of[slab].line, uz_brick_slab(planes, slab, t->slabs), uz_brick_slab(planes, slab + 1, t->slabs));
}

static void prolong_slab(void *ctx, int slab)
{
    const transfer *t = ctx;
    const int64_t planes = t->f->cells[2] + 1, end = uz_brick_slab(planes, slab + 1, t->slabs);
    for (int64_t k = uz_brick_slab(planes, slab, t->slabs); k < end; k++) {
        float *const x = t->v->x + k * t->f->plane;
        for (int m = 0; m < t->f->axes; m++)
            memset(x + m * t->f->size, 0, (size_t)t->f->plane * sizeof *x);
        uz_brick_prolong_plane(t->f, t->c, t->v->inverse, t->coarse->x, t->room->of[slab].line, k, x, t->f->size);
    }
}

void uz_brick_restrict(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                       const uz_brick_vectors *coarse, const uz_brick_planes *room)
{
    transfer t = {level, next, v, coarse, room, uz_brick_slabs(next->cells[2] + 1, level->size, room->most)};
    uz_aside_share(restrict_slab, &t, t.slabs);
}

void uz_brick_prolong(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                      const uz_brick_vectors *coarse, const uz_brick_planes *room)
{
    transfer t = {level, next, v, coarse, room, uz_brick_slabs(level->cells[2] + 1, level->size, room->most)};
    uz_aside_share(prolong_slab, &t, t.slabs);
}
