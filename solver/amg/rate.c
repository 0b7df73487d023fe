/* rate.c: how fast sweeps are here. */
#include "amg/multigrid_private.h"

#include "core/clock.h"

#include <sys/mman.h>

/* Nodes of a cube that hexahedra couple with their neighbours: 4 MB, more than most cores have for themselves. */
enum { SIDE = 20, NODES = SIDE * SIDE * SIDE, ROWS = 3, BEFORE = 13, WIDTH = 4, REPEATS = 10 };

#define ENOUGH_S 0.003
/* What is assumed where there is no memory: a core of 2022. */
#define ASSUMED_S 6e-10

typedef struct {
    int64_t ptr[NODES + 1];
    int32_t idx[NODES * BEFORE];
    float off[NODES * BEFORE * ROWS * ROWS + WIDTH], diag[NODES * ROWS * ROWS + WIDTH], inverse[NODES * ROWS];
    float b[NODES * WIDTH], x[NODES * WIDTH], t[NODES * WIDTH];
} sample;

static void couple(sample *s)
{
    int64_t e = 0;
    for (int32_t i = 0; i < NODES; i++) {
        const int at[3] = {i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE};
        for (int k = 0; k < BEFORE; k++) {
            const int to[3] = {at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1};
            if (to[0] >= 0 && to[0] < SIDE && to[1] >= 0 && to[1] < SIDE && to[2] >= 0)
                s->idx[e++] = to[0] + SIDE * (to[1] + SIDE * to[2]);
        }
        s->ptr[i + 1] = e;
    }
}

static void sweep(void *ctx)
{
    uz_level_take_step(ctx, UZ_STEP_SWEEP_DOWN | UZ_STEP_SWEEP_UP);
}

double uz_amg_rate(void)
{
    sample *s = mmap(NULL, sizeof *s, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (s == MAP_FAILED)
        return ASSUMED_S;
    couple(s);
    /* small enough that sweeps keep what they start from */
    const int64_t numbers = s->ptr[NODES] * ROWS * ROWS;
    for (int64_t k = 0; k < numbers; k++)
        s->off[k] = -0.01F;
    for (int k = 0; k < NODES * ROWS * ROWS; k++)
        s->diag[k] = 0.01F;
    for (int k = 0; k < NODES * ROWS; k++)
        s->inverse[k] = 1.0F;
    for (int k = 0; k < NODES * WIDTH; k++)
        s->b[k] = k % WIDTH < ROWS ? 1.0F : 0.0F;
    const uz_level level = {
        .A = {.nodes = NODES, .b = ROWS, .ptr = s->ptr, .idx = s->idx}, .off = s->off, .diag = s->diag};
    uz_level_step step = {
        .level = &level, .inverse = s->inverse, .b = s->b, .x = s->x, .t = s->t, .k = UZ_MODES_MOST, .lanes = 1};
    const double least = uz_least_seconds(sweep, &step, 2, REPEATS, ENOUGH_S);
    munmap(s, sizeof *s);
    const int64_t diagonal = (int64_t)NODES * ROWS * (ROWS + 1) / 2;
    return least / (double)(numbers + diagonal);
}
