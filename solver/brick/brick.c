/* brick.c: the stiffness of a cell, its even and odd parts, and K times a vector. */
#include "brick/private.h"

#include "core/alloc.h"
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
    for (int a = 0; a < UZ_BRICK_NODES; a++)
        for (int c = 0; c < 3; c++)
            xyz[3 * a + c] = uz_brick_corner[a][c] ? size[c] : 0.0;
    uz_element element = brick->element;
    element.xyz = xyz;
    bool good = uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD;
    for (int i = 0; i < UZ_BRICK_DOFS * UZ_BRICK_DOFS; i++)
        good = good && fabs(ke[i]) < DBL_MAX / 1024;
    for (int i = 0; i < UZ_BRICK_DOFS; i++)
        good = good && ke[(UZ_BRICK_DOFS + 1) * i] > DBL_MIN * 1024;
    return good;
}

/* The sign of a corner in the part of this parity: odd along the axes whose bits it has. */
static double sign_of(int corner, int parity)
{
    const int *at = uz_brick_corner[corner], odd = (at[0] & parity) ^ (at[1] & parity >> 1) ^ (at[2] & parity >> 2);
    return odd ? -1.0 : 1.0;
}

double uz_brick_blocks(double block[9 * UZ_BRICK_PARITIES], const double *ke, double unit)
{
    double off = 0.0, most = 0.0;
    for (int row = 0; row < 3 * UZ_BRICK_PARITIES; row++)
        for (int column = 0; column < 3 * UZ_BRICK_PARITIES; column++) {
            const int m = row % 3, l = column % 3, p = row / 3, q = column / 3;
            double sum = 0.0;
            for (int a = 0; a < UZ_BRICK_NODES; a++)
                for (int b = 0; b < UZ_BRICK_NODES; b++)
                    sum += sign_of(a, p) * sign_of(b, q) * (ke[(3 * a + m) * UZ_BRICK_DOFS + 3 * b + l] / unit);
            sum /= UZ_BRICK_NODES * UZ_BRICK_NODES;
            most = fmax(most, fabs(sum));
            if ((p ^ (1 << m)) == (q ^ (1 << l)))
                block[9 * (p ^ (1 << m)) + 3 * m + l] = sum;
            else
                off = fmax(off, fabs(sum));
        }
    return off / most;
}

/* Off the blocks there is rounding only. */
#define REFLECTED 1e-12

bool uz_brick_init(uz_brick *brick)
{
    double block[9 * UZ_BRICK_PARITIES];
    return uz_brick_stiffness(brick->ke, brick, brick->cell) && uz_brick_blocks(block, brick->ke, 1.0) <= REFLECTED;
}

/* -------------------------------------------------------------- the diagonal */

uz_status uz_brick_diagonal(uz_csc *out, const uz_brick *brick, uz_error *err)
{
    uz_status status = uz_csc_init(out, brick->d, brick->d, brick->d, err);
    if (status != UZ_OK)
        return status;
    int64_t node = 0;
    for (int64_t k = 0; k <= brick->cells[2]; k++)
        for (int64_t j = 0; j <= brick->cells[1]; j++)
            for (int64_t i = 0; i <= brick->cells[0]; i++, node++)
                for (int a = 0; a < UZ_BRICK_NODES; a++) { /* the cell whose corner a is this node */
                    const int *corner = uz_brick_corner[a];
                    const int64_t x = i - corner[0], y = j - corner[1], z = k - corner[2];
                    if (x < 0 || y < 0 || z < 0 || x >= brick->cells[0] || y >= brick->cells[1] || z >= brick->cells[2])
                        continue;
                    for (int c = 0; c < 3; c++) {
                        const int64_t dof = brick->dof[3 * node + c];
                        if (dof >= 0)
                            out->val[dof] += brick->ke[(UZ_BRICK_DOFS + 1) * (3 * a + c)];
                    }
                }
    for (int64_t j = 0; j <= brick->d; j++)
        out->ptr[j] = j;
    for (int64_t j = 0; j < brick->d; j++)
        out->idx[j] = j;
    return UZ_OK;
}

/* --------------------------------------------------------------- the product */

bool uz_brick_product_init(uz_brick_product *room, const uz_brick *brick)
{
    room->stride = uz_brick_stride(brick->cells[0]);
    room->plane = room->stride * (brick->cells[1] + 1);
    const int64_t n = 3 * room->plane + 2 * UZ_BRICK_PAD;
    for (int k = 0; k < 2; k++) {
        room->in[k] = uz_alloc_zero(n, sizeof(double));
        room->out[k] = uz_alloc_zero(n, sizeof(double));
    }
    room->sums = uz_alloc_zero(FIELDS * line_room(room->stride), sizeof(double));
    return room->in[0] && room->in[1] && room->out[0] && room->out[1] && room->sums;
}

void uz_brick_product_clear(uz_brick_product *room)
{
    for (int k = 0; k < 2; k++) {
        free(room->in[k]);
        free(room->out[k]);
    }
    free(room->sums);
    memset(room, 0, sizeof *room);
}

/* A plane of nodes by component, of the dofs. */
static void unpack(double *plane, const uz_brick *brick, const uz_brick_product *room, int64_t k, const double *x,
                   const double *value)
{
    const int64_t line = brick->cells[0] + 1, lines = brick->cells[1] + 1;
    const int64_t *dof = brick->dof + 3 * line * lines * k;
    for (int64_t j = 0; j < lines; j++) {
        double *to = plane + j * room->stride;
        for (int64_t i = 0; i < line; i++, dof += 3)
            for (int c = 0; c < 3; c++)
                to[c * room->plane + i] = dof[c] >= 0 ? (x ? x[dof[c]] : 0.0) : value ? value[-1 - dof[c]] : 0.0;
    }
}

/* The free dofs of a plane, which is cleared. */
static void pack(double *y, const uz_brick *brick, const uz_brick_product *room, int64_t k, double *plane)
{
    const int64_t line = brick->cells[0] + 1, lines = brick->cells[1] + 1;
    const int64_t *dof = brick->dof + 3 * line * lines * k;
    for (int64_t j = 0; j < lines; j++) {
        const double *from = plane + j * room->stride;
        for (int64_t i = 0; i < line; i++, dof += 3)
            for (int c = 0; c < 3; c++)
                if (dof[c] >= 0)
                    y[dof[c]] = from[c * room->plane + i];
    }
    memset(plane, 0, (size_t)(3 * room->plane) * sizeof *plane);
}

/* The rows of cells between two planes of nodes. */
static inline __attribute__((always_inline)) void layer(uz_brick_product *room, const uz_brick *brick,
                                                        const double *block)
{
    for (int64_t j = 0; j < brick->cells[1]; j++) {
        const double *in[COMPONENTS * LINES];
        double *out[COMPONENTS * LINES];
        for (int m = 0; m < COMPONENTS; m++)
            for (int q = 0; q < LINES; q++) {
                const int64_t at = m * room->plane + (j + q % 2) * room->stride;
                in[m * LINES + q] = room->in[q / 2] + at;
                out[m * LINES + q] = room->out[q / 2] + at;
            }
        cells_of_line(room->sums, in, brick->cells[0], room->stride, block);
        nodes_of_line(out, room->sums, room->stride);
    }
}

UZ_AVX2_FMA static void layer_wide(uz_brick_product *room, const uz_brick *brick, const double *block)
{
    layer(room, brick, block);
}

static void layer_narrow(uz_brick_product *room, const uz_brick *brick, const double *block)
{
    layer(room, brick, block);
}

static void swap(double *pair[2])
{
    double *const first = pair[0];
    pair[0] = pair[1];
    pair[1] = first;
}

void uz_brick_multiply(double *y, const uz_brick *brick, const double *block, uz_brick_product *room, const double *x,
                       const double *value)
{
    void (*const of_layer)(uz_brick_product *, const uz_brick *, const double *) =
        uz_cpu_has_avx2_fma() ? layer_wide : layer_narrow;
    unpack(room->in[0], brick, room, 0, x, value);
    for (int64_t k = 0; k < brick->cells[2]; k++) {
        unpack(room->in[1], brick, room, k + 1, x, value);
        of_layer(room, brick, block);
        pack(y, brick, room, k, room->out[0]);
        swap(room->in);
        swap(room->out);
    }
    pack(y, brick, room, brick->cells[2], room->out[0]);
}

uz_status uz_brick_subtract_moved(double *p, const uz_brick *brick, const double *value, uz_error *err)
{
    uz_brick_product room = {.stride = 0};
    double block[9 * UZ_BRICK_PARITIES], *y = uz_alloc(brick->d, sizeof *y);
    const bool ok = uz_brick_product_init(&room, brick) && y;
    if (ok) {
        (void)uz_brick_blocks(block, brick->ke, 1.0);
        uz_brick_multiply(y, brick, block, &room, NULL, value);
        for (int64_t j = 0; j < brick->d; j++)
            p[j] -= y[j];
    }
    uz_brick_product_clear(&room);
    free(y);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld dofs", (long long)brick->d);
}
