/* Any bytes as a surface of triangles, in each format. What is accepted has finite corners, and either is an obstacle
 * whose gaps can be told, or is refused with a reason; what is refused must say why. */
#include "obstacle/obstacle.h"
#include "uzawa.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MEMORY = 1 << 22 };

static void demand(bool condition)
{
    if (!condition)
        abort();
}

static void demand_gaps(const uz_triangles *t)
{
    const uz_contact contact = {.kind = UZ_OBSTACLE_SURFACE, .n_x = 3 * t->n, .x = t->x, .y = t->y, .z = t->z};
    uz_obstacle *obstacle;
    uz_error err = {0};
    if (uz_obstacle_new(&obstacle, &contact, 0, UZ_SOLID, &err) != UZ_OK) {
        demand(err.message[0] && !obstacle);
        return;
    }
    for (int64_t i = 0; i < 3 * t->n && i < 30; i++) {
        const double at[3] = {t->x[i] * 1.25, t->y[i] - t->x[i], t->z[i]};
        uz_gap gap;
        if (uz_obstacle_gap(&gap, obstacle, at, NULL) == UZ_OK)
            demand(isfinite(gap.gap) && fabs(hypot(hypot(gap.normal[0], gap.normal[1]), gap.normal[2]) - 1) < 1e-9);
    }
    uz_obstacle_free(obstacle);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const FORMATS[] = {"stl", "obj"};
    for (int k = 0; k < 2; k++) {
        uz_triangles t;
        uz_error err = {0};
        if (uz_triangles_read(&t, FORMATS[k], (const char *)data, size, MEMORY, &err) != UZ_OK) {
            demand(err.message[0] && t.n == 0 && !t.x);
            continue;
        }
        for (int64_t i = 0; i < 3 * t.n; i++)
            demand(isfinite(t.x[i]) && isfinite(t.y[i]) && isfinite(t.z[i]));
        demand_gaps(&t);
        uz_triangles_clear(&t);
    }
    return 0;
}
