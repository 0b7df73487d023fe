/* brick.c: the stiffness of a cell, its even and odd parts, and K times a vector. */
#include "brick/private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define REAL double
#include "brick/line.inc"

const int uz_brick_corner[UZ_BRICK_NODES][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

/* --------------------------------------------------------------- one cell */

bool uz_brick_stiffness(double *ke, const uz_brick *brick, const double size[3])
{
    double xyz[3 * UZ_BRICK_NODES];
    const int axes = brick->axes, dofs = uz_brick_dofs(axes);
    for (int i = 0; i < dofs; i++)
        xyz[i] = uz_brick_corner[i / axes][i % axes] ? size[uz_brick_axis_of(axes, i % axes)] : 0.0;
    uz_element element = brick->element;
    element.xyz = xyz;
    bool good = uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD;
    for (int i = 0; i < dofs * dofs; i++)
        good = good && fabs(ke[i]) < DBL_MAX / 1024;
    for (int i = 0; i < dofs; i++)
        good = good && ke[(dofs + 1) * i] > DBL_MIN * 1024;
    return good;
}

/* The sign of a corner in the part of this parity: odd along the axes of the components whose bits it has. */
static double sign_of(int corner, int parity)
{
    const int *at = uz_brick_corner[corner], odd = (at[0] & parity) ^ (at[1] & parity >> 1) ^ (at[2] & parity >> 2);
    return odd ? -1.0 : 1.0;
}

double uz_brick_blocks(double block[9 * UZ_BRICK_PARITIES], int axes, const double *ke, double unit)
{
    const int dofs = uz_brick_dofs(axes), corners = uz_brick_corners(axes);
    double off = 0.0, most = 0.0;
    memset(block, 0, 9 * UZ_BRICK_PARITIES * sizeof *block);
    for (int row = 0; row < dofs; row++)
        for (int column = 0; column < dofs; column++) {
            const int m = row % axes, l = column % axes, p = row / axes, q = column / axes;
            double sum = 0.0;
            for (int a = 0; a < corners; a++)
                for (int b = 0; b < corners; b++)
                    sum += sign_of(a, p) * sign_of(b, q) * (ke[(axes * a + m) * dofs + axes * b + l] / unit);
            sum /= corners * corners;
            most = fmax(most, fabs(sum));
            if ((p ^ (1 << m)) != (q ^ (1 << l)) || p == 0 || q == 0)
                off = fmax(off, fabs(sum));
            if ((p ^ (1 << m)) == (q ^ (1 << l)) && m <= l) /* what all corners do alike meets no resistance */
                block[9 * (p ^ (1 << m)) + 3 * m + l] = block[9 * (p ^ (1 << m)) + 3 * l + m] =
                    p == 0 || q == 0 ? 0.0 : sum;
        }
    return off / most;
}

/* Off the blocks there is rounding only. */
#define REFLECTED 1e-12

bool uz_brick_init(uz_brick *brick)
{
    double block[9 * UZ_BRICK_PARITIES];
    return uz_brick_stiffness(brick->ke, brick, brick->cell) &&
           uz_brick_blocks(block, brick->axes, brick->ke, 1.0) <= REFLECTED;
}

/* -------------------------------------------------------------- the diagonal */

/* Where a node is along an axis. */
enum { FIRST, BETWEEN, LAST, PLACES };

/* Planes of nodes as the threads that share them see that. */
typedef struct {
    uz_csc *to;
    const uz_brick *brick;
    double sum[PLACES][PLACES][PLACES][3]; /* by z, y and x: what the cells around a node have for it */
    int parts;
} diagonal;

static int place_of(int64_t at, int64_t cells)
{
    return at == 0 ? FIRST : at < cells ? BETWEEN : LAST;
}

static void sum_diagonals(diagonal *x)
{
    const int axes = x->brick->axes, dofs = uz_brick_dofs(axes);
    for (int k = 0; k < PLACES; k++)
        for (int j = 0; j < PLACES; j++)
            for (int i = 0; i < PLACES; i++)
                for (int a = 0; a < uz_brick_corners(axes); a++) { /* the cell whose corner a is this node */
                    const int *corner = uz_brick_corner[a], at[3] = {i, j, k};
                    bool there = true;
                    for (int c = 0; c < axes; c++)
                        there = there && at[uz_brick_axis_of(axes, c)] != (corner[c] ? FIRST : LAST);
                    for (int c = 0; there && c < axes; c++)
                        x->sum[k][j][i][c] += x->brick->ke[(dofs + 1) * (axes * a + c)];
                }
}

static void fill_diagonals(void *ctx, int part)
{
    const diagonal *x = ctx;
    const int axes = x->brick->axes;
    const int64_t *n = x->brick->cells, planes = n[2] + 1, first = planes * part / x->parts,
                  end = planes * (part + 1) / x->parts, d = x->brick->d;
    for (int64_t j = d * part / x->parts; j < d * (part + 1) / x->parts; j++) {
        x->to->ptr[j + 1] = j + 1;
        x->to->idx[j] = (int32_t)j;
    }
    const int64_t *dof = x->brick->dof + axes * first * (n[0] + 1) * (n[1] + 1);
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j <= n[1]; j++)
            for (int64_t i = 0; i <= n[0]; i++, dof += axes)
                for (int c = 0; c < axes; c++)
                    if (dof[c] >= 0)
                        x->to->val[dof[c]] = x->sum[place_of(k, n[2])][place_of(j, n[1])][place_of(i, n[0])][c];
}

uz_status uz_brick_diagonal(uz_csc *out, const uz_brick *brick, uz_error *err)
{
    enum { PARTS_MOST = 64 };
    const uz_status status = uz_csc_init(out, brick->d, brick->d, brick->d, err);
    if (status != UZ_OK)
        return status;
    diagonal x = {
        .to = out, .brick = brick, .parts = brick->cells[2] < PARTS_MOST ? (int)brick->cells[2] + 1 : PARTS_MOST};
    sum_diagonals(&x);
    uz_aside_share(fill_diagonals, &x, x.parts);
    return UZ_OK;
}

/* --------------------------------------------------------------- the product */

/* Numbers of all planes of a slab, at least: some 20 microseconds. */
enum { SLAB_LEAST = 8192, PLANES_LEAST = 4 };

int uz_brick_slabs(int64_t planes, int64_t numbers, int most)
{
    if (most < 2 || planes < 2 * PLANES_LEAST || numbers < 2 * SLAB_LEAST)
        return 1;
    const int threads = uz_aside_threads();
    most = threads < most ? threads : most;
    most = numbers / SLAB_LEAST < most ? (int)(numbers / SLAB_LEAST) : most;
    return planes / PLANES_LEAST < most ? (int)(planes / PLANES_LEAST) : most;
}

bool uz_brick_product_init(uz_brick_product *room, const uz_brick *brick)
{
    room->stride = uz_brick_stride(brick->cells[0]);
    room->plane = room->stride * (brick->cells[1] + 1);
    room->most = uz_aside_count();
    const int64_t n = brick->axes * room->plane + 2 * UZ_BRICK_PAD;
    bool ok = (room->of_plane = uz_alloc_zero(brick->cells[2] + 1, sizeof(double)));
    for (int part = 0; part < room->most; part++) {
        struct uz_brick_product_room *of = &room->of[part];
        for (int k = 0; k < 2; k++) {
            of->in[k] = uz_alloc_zero(n, sizeof(double));
            of->out[k] = uz_alloc_zero(n, sizeof(double));
            ok = ok && of->in[k] && of->out[k];
        }
        of->sums = uz_alloc_zero(fields_of(brick->axes) * line_room(room->stride), sizeof(double));
        ok = ok && of->sums;
    }
    return ok;
}

void uz_brick_product_clear(uz_brick_product *room)
{
    for (int part = 0; part < room->most; part++) {
        for (int k = 0; k < 2; k++) {
            free(room->of[part].in[k]);
            free(room->of[part].out[k]);
        }
        free(room->of[part].sums);
    }
    free(room->of_plane);
    memset(room, 0, sizeof *room);
}

/* A product as the threads that share it see it. */
typedef struct {
    double *y;
    const uz_brick *brick;
    const double *block, *x, *value;
    const double *nodal; /* the displacement by node, in place of x and value */
    uz_brick_product *room;
    int slabs;
    bool sums; /* x'y is wanted */
    void (*layer)(const uz_brick_product *, struct uz_brick_product_room *, const uz_brick *, const double *);
} product;

/* Nodes `begin` to end - 1 of a line, by component, of the dofs. */
static void unpack_nodes(double *to, const product *p, const int64_t *dof, int64_t begin, int64_t end)
{
    const int axes = p->brick->axes;
    for (int64_t i = begin; i < end; i++)
        for (int c = 0; c < axes; c++) {
            const int64_t own = dof[axes * i + c];
            to[c * p->room->plane + i] = own >= 0 ? (p->x ? p->x[own] : 0.0) : p->value ? p->value[-1 - own] : 0.0;
        }
}

/* A plane of nodes by component, of the dofs. */
static void unpack(double *plane, const product *p, int64_t k)
{
    const int axes = p->brick->axes;
    const int64_t line = p->brick->cells[0] + 1, lines = p->brick->cells[1] + 1, apart = p->room->plane;
    for (int64_t j = 0; j < lines; j++) {
        const int64_t first = axes * line * (lines * k + j), *dof = p->brick->dof + first;
        double *to = plane + j * p->room->stride;
        int64_t begin = 0, end = p->nodal ? line : 0;
        if (p->x)
            uz_brick_run(&begin, &end, dof, line, axes);
        if (!p->nodal) {
            unpack_nodes(to, p, dof, 0, begin);
            unpack_nodes(to, p, dof, end, line);
        }
        if (begin == end)
            continue;
        const double *restrict from = p->nodal ? p->nodal + first : p->x + dof[axes * begin];
        double *restrict x = to + begin, *restrict y = x + apart, *restrict z = y + (axes == 3 ? apart : 0);
        for (int64_t i = 0; axes == 2 && i < end - begin; i++) {
            x[i] = from[2 * i];
            y[i] = from[2 * i + 1];
        }
        for (int64_t i = 0; axes == 3 && i < end - begin; i++) {
            x[i] = from[3 * i];
            y[i] = from[3 * i + 1];
            z[i] = from[3 * i + 2];
        }
    }
}

static void pack_nodes(const product *p, const int64_t *dof, const double *from, int64_t begin, int64_t end)
{
    const int axes = p->brick->axes;
    for (int64_t i = begin; i < end; i++)
        for (int c = 0; c < axes; c++)
            if (dof[axes * i + c] >= 0)
                p->y[dof[axes * i + c]] = from[c * p->room->plane + i];
}

/* The free dofs of a plane. */
static void pack(const product *p, int64_t k, const double *plane)
{
    const int axes = p->brick->axes;
    const int64_t line = p->brick->cells[0] + 1, lines = p->brick->cells[1] + 1, apart = p->room->plane;
    const int64_t *dof = p->brick->dof + axes * line * lines * k;
    for (int64_t j = 0; j < lines; j++, dof += axes * line) {
        const double *from = plane + j * p->room->stride;
        int64_t begin, end;
        uz_brick_run(&begin, &end, dof, line, axes);
        pack_nodes(p, dof, from, 0, begin);
        pack_nodes(p, dof, from, end, line);
        if (begin == end)
            continue;
        const double *restrict x = from + begin, *restrict y = x + apart, *restrict z = y + (axes == 3 ? apart : 0);
        double *restrict to = p->y + dof[axes * begin];
        for (int64_t i = 0; axes == 2 && i < end - begin; i++) {
            to[2 * i] = x[i];
            to[2 * i + 1] = y[i];
        }
        for (int64_t i = 0; axes == 3 && i < end - begin; i++) {
            to[3 * i] = x[i];
            to[3 * i + 1] = y[i];
            to[3 * i + 2] = z[i];
        }
    }
}

/* The rows of cells between two planes of nodes. */
static inline __attribute__((always_inline)) void layer(const uz_brick_product *room, struct uz_brick_product_room *of,
                                                        const uz_brick *brick, const double *block, const int axes)
{
    const int lines = lines_of(axes), near = lines / 2; /* lines of the plane below */
    for (int64_t j = 0; j < rows_of(brick->cells, axes); j++) {
        const double *in[COMPONENTS * LINES];
        double *out[COMPONENTS * LINES];
        for (int m = 0; m < axes; m++)
            for (int q = 0; q < lines; q++) {
                const int64_t at = m * room->plane + (j + q % near) * room->stride;
                in[m * lines + q] = of->in[q / near] + at;
                out[m * lines + q] = of->out[q / near] + at;
            }
        cells_of_line(of->sums, in, brick->cells[0], room->stride, block, axes);
        nodes_of_line(out, of->sums, room->stride, j == 0, axes);
    }
}

#define OF_AXES(NAME, AXES, FOR_PROCESSOR)                                                                             \
    FOR_PROCESSOR static void NAME(const uz_brick_product *room, struct uz_brick_product_room *of,                     \
                                   const uz_brick *brick, const double *block)                                         \
    {                                                                                                                  \
        layer(room, of, brick, block, AXES);                                                                           \
    }
OF_AXES(solid_wide, 3, UZ_AVX2_FMA)
OF_AXES(solid_narrow, 3, )
OF_AXES(plane_wide, 2, UZ_AVX2_FMA)
OF_AXES(plane_narrow, 2, )

/* What a plane adds to x'y, where dofs that are supported and do not move count for nothing. */
static double along_plane(const struct uz_brick_product_room *of, int64_t n)
{
    lanes sum[2] = {{0.0}};
    for (int64_t i = 0; i < n; i += 2 * WIDTH)
        for (int s = 0; s < 2; s++)
            sum[s] += *(const lanes *)(of->in[0] + i + WIDTH * s) * *(const lanes *)(of->out[0] + i + WIDTH * s);
    const lanes all = sum[0] + sum[1];
    return (all[0] + all[1]) + (all[2] + all[3]);
}

/* The next plane becomes the present one. */
static void go_up(struct uz_brick_product_room *of)
{
    double *const in = of->in[0], *const out = of->out[0];
    of->in[0] = of->in[1];
    of->in[1] = in;
    of->out[0] = of->out[1];
    of->out[1] = out;
}

static void multiply_slab(void *ctx, int slab)
{
    const product *p = ctx;
    const int64_t cells = p->brick->cells[2], first = uz_brick_slab(cells + 1, slab, p->slabs),
                  end = uz_brick_slab(cells + 1, slab + 1, p->slabs);
    struct uz_brick_product_room *of = &p->room->of[slab];
    const int64_t numbers = p->brick->axes * p->room->plane;
    memset(of->out[0], 0, (size_t)numbers * sizeof(double));
    for (int64_t k = first > 0 ? first - 1 : 0; k < end; k++) {
        if (k == 0 || k + 1 == first)
            unpack(of->in[0], p, k);
        if (k < cells) {
            unpack(of->in[1], p, k + 1);
            p->layer(p->room, of, p->brick, p->block);
        }
        if (k >= first && p->y)
            pack(p, k, of->out[0]);
        if (k >= first && p->sums)
            p->room->of_plane[k] = along_plane(of, numbers);
        go_up(of);
    }
}

static void share(product *p)
{
    const int64_t planes = p->brick->cells[2] + 1;
    p->slabs = uz_brick_slabs(planes, planes * p->room->plane, p->room->most);
    if (p->brick->axes == 2)
        p->layer = uz_cpu_has_avx2_fma() ? plane_wide : plane_narrow;
    else
        p->layer = uz_cpu_has_avx2_fma() ? solid_wide : solid_narrow;
    uz_aside_share(multiply_slab, p, p->slabs);
}

void uz_brick_multiply(double *y, const uz_brick *brick, const double *block, uz_brick_product *room, const double *x,
                       const double *value)
{
    share(&(product){.y = y, .brick = brick, .block = block, .x = x, .value = value, .room = room});
}

/* The sum of what all planes have. */
static double share_sum(product *p)
{
    double sum = 0.0;
    p->sums = true;
    share(p);
    for (int64_t k = 0; k <= p->brick->cells[2]; k++)
        sum += p->room->of_plane[k];
    return sum;
}

double uz_brick_curve(double *y, const uz_brick *brick, const double *block, uz_brick_product *room, const double *x)
{
    return share_sum(&(product){.y = y, .brick = brick, .block = block, .x = x, .room = room});
}

uz_status uz_brick_energy(double *twice, const uz_brick *brick, const double *nodal, uz_error *err)
{
    uz_brick_product room = {.stride = 0};
    double block[9 * UZ_BRICK_PARITIES];
    const bool ok = uz_brick_product_init(&room, brick);
    (void)uz_brick_blocks(block, brick->axes, brick->ke, 1.0);
    *twice = ok ? share_sum(&(product){.brick = brick, .block = block, .nodal = nodal, .room = &room}) : 0.0;
    uz_brick_product_clear(&room);
    return ok ? UZ_OK
              : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the energy of %lld nodes", (long long)brick->n_nodes);
}

uz_status uz_brick_subtract_moved(double *p, const uz_brick *brick, const double *value, uz_error *err)
{
    uz_brick_product room = {.stride = 0};
    double block[9 * UZ_BRICK_PARITIES], *y = uz_alloc(brick->d, sizeof *y);
    const bool ok = uz_brick_product_init(&room, brick) && y;
    if (ok) {
        (void)uz_brick_blocks(block, brick->axes, brick->ke, 1.0);
        uz_brick_multiply(y, brick, block, &room, NULL, value);
        for (int64_t j = 0; j < brick->d; j++)
            p[j] -= y[j];
    }
    uz_brick_product_clear(&room);
    free(y);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld dofs", (long long)brick->d);
}
