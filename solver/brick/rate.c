/* rate.c: how fast the smoother is here. */
#include "brick/levels.h"

#include "core/clock.h"

#include <sys/mman.h>

/* Cells along each side of a cube, or a square, the vectors of which are more than most cores have for themselves. */
enum { CELLS = 24, PLANE_CELLS = 128, REPEATS = 40, DEGREE = 2 };

#define ENOUGH_S 0.002
/* What is assumed where there is no memory: a core of 2022. */
#define ASSUMED_S 2.2e-9

typedef struct {
    const uz_brick_level *level;
    uz_brick_vectors v;
    uz_brick_planes *planes;
} smoothing;

static void smooth(void *ctx)
{
    const smoothing *x = ctx;
    uz_brick_smooth_down(x->level, &x->v, x->planes);
}

static double time_step(const uz_brick_level *level, uz_brick_planes *planes, float *room)
{
    const int64_t n = uz_brick_numbers(level);
    smoothing x = {level, {room, room + n, room + 2 * n, room + 2 * n, room + 3 * n}, planes};
    const int most = planes->most;
    for (int64_t i = 0; i < n; i++) {
        x.v.b[i] = 1.0F;
        room[3 * n + i] = 0.01F;
    }
    planes->most = 1; /* seconds are those of this thread */
    const double least = uz_least_seconds(smooth, &x, 2, REPEATS, ENOUGH_S);
    planes->most = most;
    const double nodes = (double)((level->cells[0] + 1) * (level->cells[1] + 1) * (level->cells[2] + 1));
    return least / (DEGREE * level->axes * nodes);
}

double uz_brick_rate(int axes)
{
    const int64_t side = axes == 2 ? PLANE_CELLS : CELLS, across = axes == 2 ? 0 : side, stride = uz_brick_stride(side),
                  plane = stride * (across + 1) + UZ_BRICK_PAD;
    uz_brick_level level = {.axes = axes,
                            .cells = {side, across, side},
                            .stride = stride,
                            .plane = plane,
                            .size = plane * (side + 1),
                            .smoother = {.degree = DEGREE, .p = {0.0F, 0.1F}, .q = {0.1F, 0.1F}}};
    const size_t bytes = 4 * (size_t)uz_brick_numbers(&level) * sizeof(float);
    double rate = ASSUMED_S;
    size_t ignored = 0;
    uz_brick_planes planes = {.most = 0};
    for (int k = 0; k < 9 * UZ_BRICK_PARITIES; k++) /* small enough that steps change little */
        level.block[k] = 0.01F;
    float *room = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (room != MAP_FAILED && uz_brick_planes_init(&planes, &level, &ignored))
        rate = time_step(&level, &planes, room);
    uz_brick_planes_clear(&planes);
    if (room != MAP_FAILED)
        munmap(room, bytes);
    return rate;
}
