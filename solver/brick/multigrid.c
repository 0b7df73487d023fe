/* multigrid.c: the grids of a brick, its V-cycle, and what the rest of the program sees of it. */
#include "brick/grids.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cells that are this much longer than the shortest are not made longer. */
#define SHORT 1.6
/* A grid of so few dofs is the last. */
enum { FEW_DOFS = 200 };

/* -------------------------------------------------------------- the grids */

/* ke of two cells beside each other along the axis of a component as one, between whose corners displacements are
 * linear. */
static void join_cells(double ke[UZ_BRICK_DOFS * UZ_BRICK_DOFS], int axes, int axis)
{
    const int corners = uz_brick_corners(axes), n = uz_brick_dofs(axes);
    double joined[UZ_BRICK_DOFS * UZ_BRICK_DOFS] = {0.0};
    for (int half = 0; half < 2; half++) {
        double share[UZ_BRICK_NODES][UZ_BRICK_NODES]; /* of the whole's corners in those of the half */
        for (int a = 0; a < corners; a++)
            for (int of = 0; of < corners; of++) {
                const int *at = uz_brick_corner[a], *corner = uz_brick_corner[of];
                const double along = 0.5 * (half + at[axis]);
                share[a][of] = corner[axis] ? along : 1.0 - along;
                for (int c = 0; c < axes; c++)
                    if (c != axis && at[c] != corner[c])
                        share[a][of] = 0.0;
            }
        for (int a = 0; a < n; a++)
            for (int b = 0; b < n; b++)
                for (int p = 0; p < corners; p++)
                    for (int q = 0; q < corners; q++)
                        joined[(axes * p + a % axes) * n + axes * q + b % axes] +=
                            share[a / axes][p] * share[b / axes][q] * ke[a * n + b];
    }
    memcpy(ke, joined, sizeof joined);
}

/* Galerkin's: a cell of a coarser grid is as stiff as the cells of the finest in it are where displacements are linear
 * between its corners. Of mean dilatation one large cell would resist far less: what the finest one has to take back
 * then. Where halves do not come out even it is made of as many of a size that does. */
static bool stiffness_of(double *ke, const uz_brick *brick, const uz_brick_level *level)
{
    double size[3];
    for (int c = 0; c < 3; c++)
        size[c] = ldexp(level->cell[c], -level->halvings[c]);
    if (!uz_brick_stiffness(ke, brick, size))
        return false;
    for (int c = 0; c < level->axes; c++)
        for (int k = 0; k < level->halvings[uz_brick_axis_of(level->axes, c)]; k++)
            join_cells(ke, level->axes, c);
    return true;
}

/* ke: of its cells. */
static bool init_level(uz_brick_level *level, double *ke, const uz_brick *brick, double unit, const bool coarser[3])
{
    double block[9 * UZ_BRICK_PARITIES];
    level->stride = uz_brick_stride(level->cells[0]);
    /* what is read beyond its last line, and counts for nothing, is not of the next plane, which another thread may
     * have */
    level->plane = level->stride * (level->cells[1] + 1) + UZ_BRICK_PAD;
    level->size = level->plane * (level->cells[2] + 1);
    if (!stiffness_of(ke, brick, level))
        return false;
    (void)uz_brick_blocks(block, level->axes, ke, unit);
    for (int i = 0; i < 9 * UZ_BRICK_PARITIES; i++)
        level->block[i] = (float)block[i];
    for (int c = 0; c < level->axes; c++)
        level->diagonal[c] = (float)(ke[(uz_brick_dofs(level->axes) + 1) * c] / unit);
    uz_brick_smoother_init(&level->smoother, level->axes, level->cells, ke, unit, coarser);
    return true;
}

static int64_t node_count(const int64_t cells[3])
{
    return (cells[0] + 1) * (cells[1] + 1) * (cells[2] + 1);
}

/* The cells of the next grid and how large they are; false: there is none. */
static bool coarsen(int64_t next[3], double size[3], int axes, const int64_t cells[3], const double cell[3])
{
    double least = INFINITY;
    for (int c = 0; c < 3; c++)
        if (cells[c] > 1)
            least = fmin(least, cell[c]);
    for (int c = 0; c < 3; c++) {
        next[c] = cells[c] > 1 && cell[c] < SHORT * least ? (cells[c] + 1) / 2 : cells[c];
        size[c] = next[c] > 0 ? cell[c] * ((double)cells[c] / (double)next[c]) : 0.0;
    }
    return axes * node_count(cells) > FEW_DOFS && node_count(next) < node_count(cells);
}

static bool make_levels(uz_brick_grids *mg, bool *sound)
{
    const uz_brick *brick = mg->brick;
    int l = 0;
    *sound = true;
    memcpy(mg->level[0].cells, brick->cells, sizeof brick->cells);
    memcpy(mg->level[0].cell, brick->cell, sizeof brick->cell);
    for (;; l++) {
        uz_brick_level *level = &mg->level[l];
        int64_t next[3];
        double size[3];
        level->axes = brick->axes;
        const bool last = !coarsen(next, size, level->axes, level->cells, level->cell) || l + 1 == UZ_BRICK_LEVELS_MOST;
        const bool coarser[3] = {next[0] < level->cells[0], next[1] < level->cells[1], next[2] < level->cells[2]};
        *sound = *sound && init_level(level, mg->ke, brick, mg->unit, coarser);
        mg->base.levels = l + 1;
        if (!*sound || last)
            return true;
        for (int c = 0; c < 3; c++) {
            mg->level[l + 1].cells[c] = next[c];
            mg->level[l + 1].halvings[c] = level->halvings[c] + (next[c] < level->cells[c] ? 1 : 0);
            mg->level[l + 1].cell[c] = size[c];
            if (!uz_brick_axis_init(&level->to[c], level->cells[c], next[c]))
                return false;
        }
    }
}

/* Of the first grid. What rounding of the blocks does, E, comes with the sums w of a cell's corners, of which
 * x'diag(ke)x is an eighth of the diagonal's, to at most the norm of 8 D^-1/2 E D^-1/2 times x'diag(K)x; in the plane
 * with 4 corners likewise. What products round on the way goes up and down from node to node, where M^-1 leaves little
 * of it: as much as half of FLT_EPSILON of x before and after is allowed for. */
static double rounding_of(const uz_brick_grids *mg)
{
    const uz_brick_level *level = &mg->level[0];
    double most = 0.0;
    for (int p = 0; p < uz_brick_corners(level->axes); p++) {
        double square = 0.0;
        for (int m = 0; m < level->axes; m++)
            for (int l = 0; l < level->axes; l++) {
                const int at = 9 * p + 3 * m + l;
                const double off =
                    uz_brick_corners(level->axes) * (mg->block[at] / mg->unit - (double)level->block[at]);
                square += off * off / ((double)level->diagonal[m] * (double)level->diagonal[l]);
            }
        most = fmax(most, square);
    }
    return sqrt(most) + FLT_EPSILON;
}

/* ----------------------------------------------------------- what is held */

/* The first grid as the threads that hold its dofs see it. */
typedef struct {
    float *inverse;
    const uz_brick_grids *mg;
    const bool *held;
    int slabs;
} holding;

static void hold_slab(void *ctx, int slab)
{
    const holding *x = ctx;
    const uz_brick_level *level = &x->mg->level[0];
    const int axes = level->axes;
    const int64_t *n = level->cells, first = uz_brick_slab(n[2] + 1, slab, x->slabs),
                  end = uz_brick_slab(n[2] + 1, slab + 1, x->slabs);
    const int64_t *dof = x->mg->brick->dof + axes * (n[0] + 1) * (n[1] + 1) * first;
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j <= n[1]; j++) {
            const int cells = (j > 0 && j < n[1] ? 2 : 1) * (k > 0 && k < n[2] ? 2 : 1);
            float *to = x->inverse + k * level->plane + j * level->stride;
            float outer[3], inner[3]; /* at the ends of a line, and between them */
            for (int c = 0; c < axes; c++) {
                outer[c] = 1.0F / ((float)cells * level->diagonal[c]);
                inner[c] = 1.0F / ((float)(2 * cells) * level->diagonal[c]);
            }
            for (int64_t i = 0; i <= n[0]; i++, dof += axes)
                for (int c = 0; c < axes; c++)
                    to[c * level->size + i] = dof[c] < 0 || (x->held && x->held[dof[c]]) ? 0.0F
                                              : i > 0 && i < n[0]                        ? inner[c]
                                                                                         : outer[c];
        }
}

/* inverse of the first grid: 0 at supported dofs, those of `held` (d, NULL: none), and in the padding. */
static void first_inverse(float *inverse, const uz_brick_grids *mg, const bool *held)
{
    const uz_brick_level *level = &mg->level[0];
    holding x = {inverse, mg, held, uz_brick_slabs(level->cells[2] + 1, level->size, UZ_ASIDE_MOST)};
    uz_aside_share(hold_slab, &x, x.slabs);
}

int64_t uz_brick_nearest(const uz_brick_level *level, const uz_brick_level *finer, int64_t i, int64_t j, int64_t k)
{
    const int64_t *n = level->cells, *f = finer->cells, y = n[1] > 0 ? (j * f[1] + n[1] / 2) / n[1] : 0;
    return (k * f[2] + n[2] / 2) / n[2] * finer->plane + y * finer->stride + (i * f[0] + n[0] / 2) / n[0];
}

/* A coarser grid likewise. */
typedef struct {
    float *inverse;
    const uz_brick_level *level, *finer;
    const float *above;
    int slabs;
} next_holding;

static void hold_next_slab(void *ctx, int slab)
{
    const next_holding *x = ctx;
    const uz_brick_level *level = x->level, *finer = x->finer;
    const int64_t *n = level->cells, end = uz_brick_slab(n[2] + 1, slab + 1, x->slabs);
    for (int64_t k = uz_brick_slab(n[2] + 1, slab, x->slabs); k < end; k++)
        for (int64_t j = 0; j <= n[1]; j++)
            for (int64_t i = 0; i <= n[0]; i++) {
                const int cells =
                    (i > 0 && i < n[0] ? 2 : 1) * (j > 0 && j < n[1] ? 2 : 1) * (k > 0 && k < n[2] ? 2 : 1);
                const int64_t there = uz_brick_nearest(level, finer, i, j, k);
                for (int c = 0; c < level->axes; c++)
                    x->inverse[c * level->size + k * level->plane + j * level->stride + i] =
                        x->above[c * finer->size + there] != 0.0F ? 1.0F / ((float)cells * level->diagonal[c]) : 0.0F;
            }
}

/* A node of a coarser grid is held where the node of the finer one that stands there, or nearest to it, is. */
void uz_brick_next_inverse(float *inverse, const uz_brick_level *level, const uz_brick_level *finer, const float *above)
{
    next_holding x = {inverse, level, finer, above, uz_brick_slabs(level->cells[2] + 1, level->size, UZ_ASIDE_MOST)};
    uz_aside_share(hold_next_slab, &x, x.slabs);
}

/* Where the dofs of the last grid stand in its vectors, by the order of these; returns how many. */
static int64_t list_coarsest(int64_t *place, const uz_brick_level *level)
{
    int64_t n = 0;
    for (int c = 0; c < level->axes; c++)
        for (int64_t k = 0; k <= level->cells[2]; k++)
            for (int64_t j = 0; j <= level->cells[1]; j++)
                for (int64_t i = 0; i <= level->cells[0]; i++, n++)
                    if (place)
                        place[n] = c * level->size + k * level->plane + j * level->stride + i;
    return n;
}

/* From the first corner of a cell to another one, in a grid of so many nodes along x and y. */
static int64_t step_to(int corner, int axes, int64_t nx, int64_t ny)
{
    const int *at = uz_brick_corner[corner];
    return at[0] + (axes == 2 ? at[1] * nx * ny : at[1] * nx + at[2] * nx * ny);
}

/* The factor of the last grid's K, held dofs being rows of the unit matrix. */
uz_status uz_brick_factor_coarsest(double **out, const uz_brick_grids *mg, const float *inverse, const uz_stop *stop,
                                   uz_error *err)
{
    const uz_brick_level *level = &mg->level[mg->base.levels - 1];
    const int axes = level->axes, dofs = uz_brick_dofs(axes);
    const int64_t n = mg->n_coarsest, nx = level->cells[0] + 1, ny = level->cells[1] + 1, nodes = n / axes;
    int64_t *place = uz_alloc(n, sizeof *place);
    double *A = uz_alloc_zero(n * n, sizeof *A);
    uz_status status = UZ_OK;
    *out = NULL;
    if (!place || !A) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid");
        goto done;
    }
    list_coarsest(place, level);
    for (int64_t k = 0; k < level->cells[2]; k++)
        for (int64_t j = 0; j < (axes == 2 ? 1 : level->cells[1]); j++)
            for (int64_t i = 0; i < level->cells[0]; i++)
                for (int row = 0; row < dofs; row++)
                    for (int column = 0; column < dofs; column++) {
                        const int64_t first = (k * ny + j) * nx + i,
                                      at = row % axes * nodes + first + step_to(row / axes, axes, nx, ny),
                                      from = column % axes * nodes + first + step_to(column / axes, axes, nx, ny);
                        if (inverse[place[at]] != 0.0F && inverse[place[from]] != 0.0F)
                            A[from * n + at] += mg->ke[row * dofs + column] / mg->unit;
                    }
    for (int64_t i = 0; i < n; i++)
        if (inverse[place[i]] == 0.0F)
            A[i * n + i] = 1.0;
    if (!uz_potrf_lower_while(n, A, stop))
        status = uz_stop_is_due(stop)
                     ? uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration")
                     : uz_fail(err, UZ_ERR_NOT_SPD, "K",
                               "K is not positive definite: the body can move freely. Support it so that it can't");
    if (status == UZ_OK) {
        *out = A;
        A = NULL;
    }
done:
    free(place);
    free(A);
    return status;
}

/* -------------------------------------------------------------- the cycle */

static void solve_coarsest(const uz_brick_grids *mg, const uz_multigrid_room *room)
{
    const int last = mg->base.levels - 1;
    const uz_brick_level *level = &mg->level[last];
    const uz_brick_vectors *v = &room->v[last];
    const double *L = room->held_coarsest ? room->held_coarsest : mg->coarsest;
    double *x = room->coarse;
    int64_t n = 0;
    for (int c = 0; c < level->axes; c++)
        for (int64_t k = 0; k <= level->cells[2]; k++)
            for (int64_t j = 0; j <= level->cells[1]; j++)
                for (int64_t i = 0; i <= level->cells[0]; i++)
                    x[n++] = (double)v->b[c * level->size + k * level->plane + j * level->stride + i];
    uz_potrs_lower(n, L, n, x);
    n = 0;
    for (int c = 0; c < level->axes; c++)
        for (int64_t k = 0; k <= level->cells[2]; k++)
            for (int64_t j = 0; j <= level->cells[1]; j++)
                for (int64_t i = 0; i <= level->cells[0]; i++) {
                    const int64_t at = c * level->size + k * level->plane + j * level->stride + i;
                    v->x[at] = v->inverse[at] != 0.0F ? (float)x[n] : 0.0F;
                    n++;
                }
}

void uz_brick_cycle(const uz_brick_grids *mg, const uz_multigrid_room *room, int first)
{
    const int last = mg->base.levels - 1;
    const uz_brick_level *level = mg->level;
    const uz_brick_vectors *v = room->v;
    for (int l = first; l < last; l++) {
        uz_brick_smooth_down(&level[l], &v[l], &room->planes);
        uz_brick_restrict(&level[l], &level[l + 1], &v[l], &v[l + 1], &room->planes);
    }
    solve_coarsest(mg, room);
    for (int l = last - 1; l >= first; l--)
        uz_brick_smooth_up(&level[l], &level[l + 1], &v[l], v[l + 1].x, &room->planes);
}

/* A vector of dofs on its way to the first grid, or back. */
typedef struct {
    const uz_brick_grids *mg;
    const uz_brick_vectors *v;
    double factor;
    const double *r;
    double *z;
    int slabs;
} passage;

/* Each line of nodes of a slab's planes, by its dofs and where its first number stands. */
static void pass_lines(const passage *p, int slab,
                       void (*pass)(const passage *p, const int64_t *dof, int64_t at, int64_t nodes))
{
    const uz_brick_level *level = &p->mg->level[0];
    const int64_t nodes = level->cells[0] + 1, lines = level->cells[1] + 1, planes = level->cells[2] + 1;
    const int64_t first = uz_brick_slab(planes, slab, p->slabs), end = uz_brick_slab(planes, slab + 1, p->slabs);
    const int64_t numbers = level->axes * nodes, *dof = p->mg->brick->dof + numbers * lines * first;
    for (int64_t k = first; k < end; k++)
        for (int64_t j = 0; j < lines; j++, dof += numbers)
            pass(p, dof, k * level->plane + j * level->stride, nodes);
}

/* Nodes `begin` to end - 1 of a line, whose first number stands at `at`. */
static void read_nodes(const passage *p, const int64_t *dof, int64_t at, int64_t begin, int64_t end)
{
    const int axes = p->mg->level[0].axes;
    const int64_t size = p->mg->level[0].size;
    for (int64_t i = begin; i < end; i++)
        for (int c = 0; c < axes; c++) {
            const int64_t own = c * size + at + i;
            p->v->b[own] = p->v->inverse[own] != 0.0F ? (float)(p->factor * p->r[dof[axes * i + c]]) : 0.0F;
        }
}

static void read_line(const passage *p, const int64_t *dof, int64_t at, int64_t nodes)
{
    const double factor = p->factor;
    const int axes = p->mg->level[0].axes;
    const int64_t size = p->mg->level[0].size;
    int64_t begin, end;
    uz_brick_run(&begin, &end, dof, nodes, axes);
    read_nodes(p, dof, at, 0, begin);
    read_nodes(p, dof, at, end, nodes);
    if (begin == end)
        return;
    const double *restrict r = p->r + dof[axes * begin];
    const float *x_free = p->v->inverse + at + begin, *y_free = x_free + size,
                *z_free = y_free + (axes == 3 ? size : 0);
    float *restrict x = p->v->b + at + begin, *restrict y = x + size, *restrict z = y + (axes == 3 ? size : 0);
    for (int64_t i = 0; axes == 2 && i < end - begin; i++) {
        x[i] = x_free[i] != 0.0F ? (float)(factor * r[2 * i]) : 0.0F;
        y[i] = y_free[i] != 0.0F ? (float)(factor * r[2 * i + 1]) : 0.0F;
    }
    for (int64_t i = 0; axes == 3 && i < end - begin; i++) {
        x[i] = x_free[i] != 0.0F ? (float)(factor * r[3 * i]) : 0.0F;
        y[i] = y_free[i] != 0.0F ? (float)(factor * r[3 * i + 1]) : 0.0F;
        z[i] = z_free[i] != 0.0F ? (float)(factor * r[3 * i + 2]) : 0.0F;
    }
}

static void read_slab(void *ctx, int slab)
{
    pass_lines(ctx, slab, read_line);
}

static void write_nodes(const passage *p, const int64_t *dof, int64_t at, int64_t begin, int64_t end)
{
    const int axes = p->mg->level[0].axes;
    for (int64_t i = begin; i < end; i++)
        for (int c = 0; c < axes; c++)
            if (dof[axes * i + c] >= 0)
                p->z[dof[axes * i + c]] = p->factor * (double)p->v->x[c * p->mg->level[0].size + at + i];
}

static void write_line(const passage *p, const int64_t *dof, int64_t at, int64_t nodes)
{
    const double factor = p->factor;
    const int axes = p->mg->level[0].axes;
    const int64_t size = p->mg->level[0].size;
    int64_t begin, end;
    uz_brick_run(&begin, &end, dof, nodes, axes);
    write_nodes(p, dof, at, 0, begin);
    write_nodes(p, dof, at, end, nodes);
    if (begin == end)
        return;
    const float *restrict x = p->v->x + at + begin, *restrict y = x + size, *restrict z = y + (axes == 3 ? size : 0);
    double *restrict to = p->z + dof[axes * begin];
    for (int64_t i = 0; axes == 2 && i < end - begin; i++) {
        to[2 * i] = factor * (double)x[i];
        to[2 * i + 1] = factor * (double)y[i];
    }
    for (int64_t i = 0; axes == 3 && i < end - begin; i++) {
        to[3 * i] = factor * (double)x[i];
        to[3 * i + 1] = factor * (double)y[i];
        to[3 * i + 2] = factor * (double)z[i];
    }
}

static void write_slab(void *ctx, int slab)
{
    pass_lines(ctx, slab, write_line);
}

double uz_brick_read(const uz_brick_grids *mg, const uz_multigrid_room *room, const double *r)
{
    const uz_brick_level *level = &mg->level[0];
    const double most = uz_long_max(mg->base.n, r),
                 down = most > 0.0 && isfinite(most) ? ldexp(1.0, -ilogb(most)) : 0.0;
    passage p = {.mg = mg,
                 .v = &room->v[0],
                 .factor = down > 0.0 ? down : 1.0,
                 .r = r,
                 .slabs = uz_brick_slabs(level->cells[2] + 1, level->size, room->planes.most)};
    uz_aside_share(read_slab, &p, p.slabs);
    return down;
}

static uz_status apply(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    const uz_brick_level *level = &mg->level[0];
    const double down = uz_brick_read(mg, room, r);
    (void)K;
    (void)err;
    uz_brick_cycle(mg, room, 0);
    passage p = {.mg = mg,
                 .v = &room->v[0],
                 .factor = 1.0 / ((down > 0.0 ? down : 1.0) * mg->unit),
                 .z = z,
                 .slabs = uz_brick_slabs(level->cells[2] + 1, level->size, room->planes.most)};
    uz_aside_share(write_slab, &p, p.slabs);
    return UZ_OK;
}

static void multiply(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, double *y, const double *x)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    (void)K;
    uz_brick_multiply(y, mg->brick, mg->block, &room->product, x, NULL);
}

static double curve(const uz_multigrid *base, uz_multigrid_room *room, double *y, const double *x)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    return uz_brick_curve(y, mg->brick, mg->block, &room->product, x);
}

/* -------------------------------------------------------------- the room */

static void free_room(uz_multigrid_room *room)
{
    if (!room)
        return;
    for (int l = 0; l < room->levels; l++) {
        uz_free_all(room->v[l].x, room->v[l].b, room->v[l].t, room->held[l]);
    }
    free(room->held_coarsest);
    uz_brick_planes_clear(&room->planes);
    free(room->coarse);
    uz_brick_product_clear(&room->product);
    free(room);
}

static uz_multigrid_room *make_room(const uz_multigrid *base, size_t *bytes)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    uz_multigrid_room *room = uz_alloc_zero(1, sizeof *room);
    if (!room)
        return NULL;
    *bytes = sizeof *room;
    bool ok = uz_brick_product_init(&room->product, mg->brick);
    *bytes += 32 * (size_t)(mg->brick->axes * room->product.plane * room->product.most) +
              8 * (size_t)(mg->brick->cells[2] + 1);
    room->levels = base->levels;
    for (int l = 0; l < base->levels; l++) {
        uz_brick_vectors *v = &room->v[l];
        const int64_t n = uz_brick_numbers(&mg->level[l]);
        float **all[] = {&v->x, &v->b, &v->t};
        for (int k = 0; k < 3; k++)
            ok = (*all[k] = uz_alloc_zero(n, sizeof(float))) && ok;
        v->d = v->t; /* a smoother's direction is of no use to the next one, nor a residual to what follows */
        v->inverse = mg->inverse[l];
        *bytes += 12 * (size_t)n;
    }
    ok = uz_brick_planes_init(&room->planes, &mg->level[0], bytes) && ok;
    room->coarse = uz_alloc(mg->n_coarsest, sizeof(double));
    *bytes += 8 * (size_t)mg->n_coarsest;
    ok = ok && room->coarse;
    if (ok)
        return room;
    free_room(room);
    return NULL;
}

static uz_status hold(const uz_multigrid *base, const uz_csc *K, uz_multigrid_room *room, const bool *held,
                      size_t *bytes, const uz_stop *stop, uz_error *err)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)base;
    const int last = base->levels - 1;
    (void)K;
    free(room->held_coarsest);
    room->held_coarsest = NULL;
    *bytes = 0;
    for (int l = 0; l < base->levels; l++) {
        const int64_t n = uz_brick_numbers(&mg->level[l]);
        room->v[l].inverse = mg->inverse[l];
        if (!held)
            continue;
        if (!room->held[l] && !(room->held[l] = uz_alloc_zero(n, sizeof(float))))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to hold dofs of %lld", (long long)base->n);
        if (l == 0)
            first_inverse(room->held[0], mg, held);
        else
            uz_brick_next_inverse(room->held[l], &mg->level[l], &mg->level[l - 1], room->held[l - 1]);
        room->v[l].inverse = room->held[l];
        *bytes += 4 * (size_t)n;
    }
    if (!held)
        return UZ_OK;
    *bytes += 8 * (size_t)(mg->n_coarsest * mg->n_coarsest);
    return uz_brick_factor_coarsest(&room->held_coarsest, mg, room->held[last], stop, err);
}

/* --------------------------------------------------------------- the whole */

static void free_multigrid(uz_multigrid *base)
{
    uz_brick_grids *mg = (uz_brick_grids *)base;
    if (!mg)
        return;
    for (int l = 0; l < UZ_BRICK_LEVELS_MOST; l++) {
        for (int c = 0; c < 3; c++)
            uz_brick_axis_clear(&mg->level[l].to[c]);
        free(mg->inverse[l]);
    }
    free(mg->coarsest);
    free(mg);
}

static const uz_multigrid_kind KIND = {.apply = apply,
                                       .multiply = multiply,
                                       .curve = curve,
                                       .step_roughly = uz_brick_step_roughly,
                                       .room = make_room,
                                       .free_room = free_room,
                                       .hold = hold,
                                       .start = uz_brick_start,
                                       .free = free_multigrid};

/* A room in single precision, four numbers a dof of all grids; the factor of the last; with dofs held both again; and
 * for threads their planes, whose lines in the plane are padded twice and have sums of their size. */
double uz_brick_predict_bytes(const uz_brick *brick)
{
    const bool plane = brick->axes == 2;
    int64_t cells[3] = {brick->cells[0], brick->cells[1], brick->cells[2]};
    double cell[3] = {brick->cell[0], brick->cell[1], brick->cell[2]}, bytes = 16.0 * FEW_DOFS * FEW_DOFS;
    bool more = true;
    for (int l = 0; more && l < UZ_BRICK_LEVELS_MOST; l++) {
        int64_t next[3];
        double size[3];
        const double stride = (double)uz_brick_stride(cells[0]) + (plane ? UZ_BRICK_PAD : 0),
                     line = brick->axes * stride * (double)(cells[1] + 1);
        bytes += 4.0 * 5.0 * line * (double)(cells[2] + 1) + (l > 0 ? 0.0 : plane ? 400.0 : 192.0) * line;
        more = coarsen(next, size, brick->axes, cells, cell);
        memcpy(cells, next, sizeof cells);
        memcpy(cell, size, sizeof cell);
    }
    return bytes;
}

uz_status uz_brick_multigrid(uz_multigrid **out, const uz_brick *brick, size_t memory_limit, uz_error *err)
{
    *out = NULL;
    const double bytes = uz_brick_predict_bytes(brick);
    if (memory_limit > 0 && bytes > (double)memory_limit)
        return uz_fail(err, UZ_ERR_LIMIT, "K", "a multigrid takes %.0f bytes, and the limit is %zu: raise the limit",
                       bytes, memory_limit);
    uz_brick_grids *mg = uz_alloc_zero(1, sizeof *mg);
    if (!mg)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid");
    mg->base.kind = &KIND;
    mg->base.n = brick->d;
    mg->base.knows_K = true;
    mg->brick = brick;
    double most = 0.0;
    for (int i = 0; i < uz_brick_dofs(brick->axes); i++)
        most = fmax(most, brick->ke[(uz_brick_dofs(brick->axes) + 1) * i]);
    mg->unit = ldexp(1.0, ilogb(most));
    (void)uz_brick_blocks(mg->block, brick->axes, brick->ke, 1.0);
    bool sound = true, ok = make_levels(mg, &sound);
    for (int l = 0; ok && sound && l < mg->base.levels; l++) {
        ok = (mg->inverse[l] = uz_alloc_zero(uz_brick_numbers(&mg->level[l]), sizeof(float)));
        mg->base.bytes += 4 * (size_t)uz_brick_numbers(&mg->level[l]);
        if (ok && l == 0)
            first_inverse(mg->inverse[0], mg, NULL);
        else if (ok)
            uz_brick_next_inverse(mg->inverse[l], &mg->level[l], &mg->level[l - 1], mg->inverse[l - 1]);
    }
    uz_status status = UZ_OK;
    if (!ok)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a multigrid on %lld dofs", (long long)brick->d);
    else if (!sound)
        status =
            uz_fail(err, UZ_ERR_NOT_FINITE, "/materials", "the stiffness of larger cells overflows; use other units");
    if (status == UZ_OK) {
        mg->n_coarsest = list_coarsest(NULL, &mg->level[mg->base.levels - 1]);
        mg->base.most = uz_brick_bound_on_cycle(&mg->level[0].smoother);
        mg->base.rough = rounding_of(mg);
        mg->base.bytes += sizeof *mg + 8 * (size_t)(mg->n_coarsest * mg->n_coarsest);
        status = uz_brick_factor_coarsest(&mg->coarsest, mg, mg->inverse[mg->base.levels - 1], NULL, err);
    }
    if (status == UZ_OK)
        *out = &mg->base;
    else
        free_multigrid(&mg->base);
    return status;
}
