/* brick_product.c: four cells of a row at a time, one in each lane. What the cells do to a node is added up in a plane
 * of nodes, as pairs; a plane is written out once both layers of cells beside it are through. */
#include "certificate/brick_product.h"

#include "certificate/double_double.h"
#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t bits __attribute__((vector_size(32), aligned(8), may_alias));

/* TOGETHER: rows of ke at a time, which do not wait for each other. DOFS: of a cell, at most. */
enum { LANES = 4, TOGETHER = 8, NODES = UZ_BRICK_NODES, DOFS = UZ_BRICK_DOFS };

/* In the order of ke, along the axes of a body; in the plane the first four. */
static const int CORNER[NODES][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

/* Planes of nodes, component by component, lines padded to whole lanes and one more; a room for each thread. */
typedef struct {
    double *x[2], *hi[2], *lo[2]; /* of the nodes below and above a layer of cells */
} planes;

typedef struct {
    const uz_brick *brick;
    int64_t stride, plane;
    const double *x;
    double *hi, *lo, *y;            /* y: 0 at first */
    double size[DOFS], begin[DOFS]; /* of multiply */
    int64_t place[DOFS];            /* of a cell's dofs in its planes, from its first corner, */
    int above[DOFS];                /* and in which of these */
    int slabs;
    planes of[UZ_ASIDE_MOST];
} whole;

/* Planes of a slab at least: what lies below it is computed once more. Slabs for each thread that there is, as one of
 * them may have a task when the others begin: by two threads both end within half a slab of each other. */
enum { SLAB_LEAST = 4, SLABS_OF_THREAD = 2 };

static bool make(whole *w, const uz_brick *brick)
{
    const int64_t most = (brick->cells[2] + 1) / SLAB_LEAST;
    const int threads = uz_aside_count(), wanted = threads < 2 ? 1 : SLABS_OF_THREAD * threads,
              slabs = wanted < UZ_ASIDE_MOST ? wanted : UZ_ASIDE_MOST;
    *w = (whole){.brick = brick, .stride = (brick->cells[0] / LANES + 2) * LANES};
    w->plane = w->stride * (brick->cells[1] + 1);
    for (int row = 0; row < brick->axes << brick->axes; row++) {
        const int *corner = CORNER[row / brick->axes];
        w->place[row] = row % brick->axes * w->plane + (brick->axes == 2 ? 0 : corner[1]) * w->stride + corner[0];
        w->above[row] = corner[brick->axes - 1];
    }
    w->slabs = slabs < most ? slabs : most < 2 ? 1 : (int)most;
    bool ok = true;
    for (int slab = 0; slab < w->slabs; slab++)
        for (int k = 0; k < 2; k++) {
            planes *of = &w->of[slab];
            double **all[] = {&of->x[k], &of->hi[k], &of->lo[k]};
            for (int i = 0; i < 3; i++)
                ok = (*all[i] = uz_alloc_zero(brick->axes * w->plane + LANES, sizeof(double))) && ok;
        }
    return ok;
}

static void clear(whole *w)
{
    for (int slab = 0; slab < w->slabs; slab++)
        for (int k = 0; k < 2; k++) {
            uz_free_all(w->of[slab].x[k], w->of[slab].hi[k], w->of[slab].lo[k]);
        }
}

/* From the first corner of a cell to another one, where lines and planes of nodes are so far apart. */
static int64_t step_to(int corner, int axes, int64_t line, int64_t plane)
{
    const int *at = CORNER[corner];
    return at[0] + (axes == 2 ? at[1] * plane : at[1] * line + at[2] * plane);
}

/* Sums of a cell's row begin at a number that is at least BEYOND times each product: they stay between half of it and
 * twice as much, whatever the signs, so that what an addition rounds off is known from the sum before and after it
 * (docs/theory.md, rounding of sums). */
#define BEYOND 64.0

/* The products of a row are at most begin / BEYOND times the largest of the displacements, each times its size. */
static void find_begins(whole *w)
{
    const int n = w->brick->axes << w->brick->axes;
    for (int j = 0; j < n; j++)
        w->size[j] = sqrt(w->brick->ke[(n + 1) * j]);
    for (int i = 0; i < n; i++) {
        double most = 0.0;
        for (int j = 0; j < n; j++)
            most = fmax(most, fabs(w->brick->ke[n * i + j]) / w->size[j]);
        w->begin[i] = BEYOND * most;
    }
}

/* The largest of the displacements, each times its size. */
UZ_INLINE void find_largest(four *largest, const whole *w, const four *v, const int axes)
{
    four most = {0.0};
    for (int column = 0; column < axes << axes; column++) {
        const four size = (four)((bits)v[column] & INT64_MAX) * w->size[column];
        const bits more = size > most;
        most = (four)(((bits)size & more) | ((bits)most & ~more));
    }
    *largest = most;
}

/* Row by row, hi + lo = ke v for four cells; of these `count` are cells. */
UZ_INLINE void multiply(four *hi, four *lo, const whole *w, const four *v, int count, int fused, const int axes)
{
    const int dofs = axes << axes;
    four most;
    find_largest(&most, w, v, axes);
    for (int row = 0; row < dofs; row += TOGETHER) {
        four sum[TOGETHER], rest[TOGETHER] = {{0}};
#pragma GCC unroll 8
        for (int r = 0; r < TOGETHER; r++)
            sum[r] = w->begin[row + r] * most;
        for (int column = 0; column < dofs; column++) {
#pragma GCC unroll 8
            for (int r = 0; r < TOGETHER; r++) {
                const double factor = w->brick->ke[(row + r) * dofs + column];
                const four product = factor * v[column];
                four next = sum[r] + product, error = {0.0};
                for (int l = 0; fused && l < LANES; l++)
                    next[l] = __builtin_fma(factor, v[column][l], sum[r][l]);
                const four added = next - sum[r];
                for (int l = 0; l < LANES; l++)
                    error[l] = fused ? __builtin_fma(factor, v[column][l], -added[l])
                                     : (product[l] - added[l]) + product_error_split(factor, v[column][l], product[l]);
                rest[r] += error;
                sum[r] = next;
            }
        }
#pragma GCC unroll 8
        for (int r = 0; r < TOGETHER; r++) {
            sum[r] -= w->begin[row + r] * most;
            for (int l = count; l < LANES; l++)
                sum[r][l] = rest[r][l] = 0.0;
            hi[row + r] = sum[r];
            lo[row + r] = rest[r];
        }
    }
}

UZ_INLINE void layer(const whole *w, const planes *p, int fused, const int axes)
{
    const int64_t *cells = w->brick->cells, rows = axes == 2 ? 1 : cells[1];
    const int dofs = axes << axes;
    for (int64_t j = 0; j < rows; j++)
        for (int64_t i = 0; i < cells[0]; i += LANES) {
            four v[DOFS], hi[DOFS], lo[DOFS];
            for (int row = 0; row < dofs; row++)
                v[row] = *(const four *)(p->x[w->above[row]] + w->place[row] + j * w->stride + i);
            multiply(hi, lo, w, v, cells[0] - i < LANES ? (int)(cells[0] - i) : LANES, fused, axes);
            for (int row = 0; row < dofs; row++) {
                const int64_t at = w->place[row] + j * w->stride + i;
                four *to = (four *)(p->hi[w->above[row]] + at), *low = (four *)(p->lo[w->above[row]] + at);
                const four before = *to, sum = before + hi[row], back = sum - before;
                *low += ((before - (sum - back)) + (hi[row] - back)) + lo[row];
                *to = sum;
            }
        }
}

UZ_AVX2_FMA static void solid_fused(const whole *w, const planes *p)
{
    layer(w, p, 1, 3);
}

static void solid_split(const whole *w, const planes *p)
{
    layer(w, p, 0, 3);
}

UZ_AVX2_FMA static void plane_fused(const whole *w, const planes *p)
{
    layer(w, p, 1, 2);
}

static void plane_split(const whole *w, const planes *p)
{
    layer(w, p, 0, 2);
}

static void read_plane(const whole *w, double *plane, int64_t k)
{
    const int axes = w->brick->axes;
    const int64_t line = w->brick->cells[0] + 1, lines = w->brick->cells[1] + 1;
    const int64_t *dof = w->brick->dof + axes * line * lines * k;
    for (int64_t j = 0; j < lines; j++)
        for (int64_t i = 0; i < line; i++, dof += axes)
            for (int c = 0; c < axes; c++)
                plane[c * w->plane + j * w->stride + i] = dof[c] >= 0 ? w->x[dof[c]] : 0.0;
}

/* The plane's sums go to the dofs. */
static void write_plane(const whole *w, const planes *p, int64_t k)
{
    const int axes = w->brick->axes;
    const int64_t line = w->brick->cells[0] + 1, lines = w->brick->cells[1] + 1;
    const int64_t *dof = w->brick->dof + axes * line * lines * k;
    for (int64_t j = 0; j < lines; j++)
        for (int64_t i = 0; i < line; i++, dof += axes)
            for (int c = 0; c < axes; c++) {
                const int64_t at = c * w->plane + j * w->stride + i;
                if (dof[c] < 0)
                    continue;
                w->hi[dof[c]] = p->hi[0][at];
                w->lo[dof[c]] = p->lo[0][at];
                w->y[dof[c]] = 0.0;
            }
}

static void swap(double *pair[2])
{
    double *const first = pair[0];
    pair[0] = pair[1];
    pair[1] = first;
}

/* The next plane becomes the present one, and the one after it begins anew. */
static void go_up(const whole *w, planes *p)
{
    swap(p->x);
    swap(p->hi);
    swap(p->lo);
    memset(p->hi[1], 0, (size_t)(w->brick->axes * w->plane) * sizeof(double));
    memset(p->lo[1], 0, (size_t)(w->brick->axes * w->plane) * sizeof(double));
}

/* Threads share the planes of nodes in slabs. */
static void multiply_slab(void *ctx, int slab)
{
    whole *w = ctx;
    void (*const of_solid)(const whole *, const planes *) = uz_cpu_has_avx2_fma() ? solid_fused : solid_split;
    void (*const of_plane)(const whole *, const planes *) = uz_cpu_has_avx2_fma() ? plane_fused : plane_split;
    void (*const of_layer)(const whole *, const planes *) = w->brick->axes == 2 ? of_plane : of_solid;
    const int64_t cells = w->brick->cells[2], first = (cells + 1) * slab / w->slabs,
                  end = (cells + 1) * (slab + 1) / w->slabs;
    planes *p = &w->of[slab];
    for (int64_t k = first > 0 ? first - 1 : 0; k < end; k++) {
        if (k == 0 || k + 1 == first)
            read_plane(w, p->x[0], k);
        if (k < cells) {
            read_plane(w, p->x[1], k + 1);
            of_layer(w, p);
        }
        if (k >= first)
            write_plane(w, p, k);
        go_up(w, p);
    }
}

/* Lines of nodes along x where c is not zero. */
static bool find_lines(bool *some, const uz_brick *brick, const double *c)
{
    const int64_t *n = brick->cells, numbers = brick->axes * (n[0] + 1), lines = (n[1] + 1) * (n[2] + 1),
                  *dof = brick->dof;
    bool any = false;
    for (int64_t line = 0; line < lines; line++, dof += numbers) {
        some[line] = false;
        for (int64_t i = 0; i < numbers && !some[line]; i++)
            some[line] = dof[i] >= 0 && c[dof[i]] != 0.0;
        any = any || some[line];
    }
    return any;
}

/* y += K c, of the cells where c is not zero. */
static void add_sparse(double *y, const uz_brick *brick, const double *c, const bool *some)
{
    const int axes = brick->axes, dofs = axes << axes;
    const int64_t *n = brick->cells, line = n[0] + 1, lines = n[1] + 1, plane = line * lines,
                  rows = axes == 2 ? 1 : n[1], beside = rows < lines ? 1 : 0; /* lines to the one across a row */
    for (int64_t k = 0; k < n[2]; k++)
        for (int64_t j = 0; j < rows; j++) {
            const bool *below = some + k * lines + j, *above = below + lines;
            for (int64_t i = 0; (below[0] || below[beside] || above[0] || above[beside]) && i < n[0]; i++) {
                const int64_t *dof[DOFS];
                double v[DOFS];
                bool any = false;
                for (int row = 0; row < dofs; row++) {
                    const int64_t node = k * plane + j * line + i + step_to(row / axes, axes, line, plane);
                    dof[row] = brick->dof + axes * node + row % axes;
                    v[row] = *dof[row] >= 0 ? c[*dof[row]] : 0.0;
                    any = any || v[row] != 0.0;
                }
                for (int row = 0; any && row < dofs; row++) {
                    double sum = 0.0;
                    for (int column = 0; column < dofs; column++)
                        sum += brick->ke[row * dofs + column] * v[column];
                    if (*dof[row] >= 0)
                        y[*dof[row]] += sum;
                }
            }
        }
}

uz_status uz_brick_precise_product(double *hi, double *lo, double *y, const uz_brick *brick, const double *x,
                                   const double *c, uz_error *err)
{
    whole w;
    bool *some = uz_alloc((brick->cells[1] + 1) * (brick->cells[2] + 1), sizeof *some);
    const bool ok = make(&w, brick) && some;
    w.x = x;
    w.hi = hi;
    w.lo = lo;
    w.y = y;
    find_begins(&w);
    if (ok)
        uz_aside_share(multiply_slab, &w, w.slabs);
    clear(&w);
    if (ok && find_lines(some, brick, c))
        add_sparse(y, brick, c, some);
    free(some);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a residual of %lld dofs", (long long)brick->d);
}
