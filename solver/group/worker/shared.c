/* shared.c: a cycle of the multigrid that each process has whole, with the sweeps of its finest level divided: they are
 * half of what a process would do for itself in a cycle. Nodes are divided evenly in the order of their numbers, in
 * which those of a process follow each other. Sweeps are those of steps.c, over the own rows, with the sums of what
 * couples them with others' on the diagonal; so the cycle is as symmetric and positive definite as that one. What is
 * coarser all processes find alike, from a sum. */
#include "worker.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A level, and what it has lost in some of its rows; NULL: nothing. */
typedef struct {
    const uz_level *level;
    const uz_blocks *loss;
    const bool *lost;
} reduced;

/* Block e, of row i. */
static void take_block(float *to, const reduced *of, int64_t i, int64_t e, bool transposed)
{
    const int b = of->level->A.b;
    const float *whole = of->level->off + e * b * b;
    const double *lost = of->lost && of->lost[i] ? of->loss->off + e * b * b : NULL;
    for (int r = 0; r < b; r++)
        for (int c = 0; c < b; c++)
            to[transposed ? c * b + r : r * b + c] =
                lost ? (float)((double)whole[r * b + c] - lost[r * b + c]) : whole[r * b + c];
}

/* Blocks (i, j) of the own nodes i with others' nodes j, whichever triangle they stand in: two passes, the first of
 * which counts. */
static void list_outside(shared_level *own, const reduced *of, bool fill)
{
    const uz_blocks *A = &of->level->A;
    const int b = A->b;
    int64_t *next = new_zeros(own->end - own->begin + 1, sizeof *next);
    for (int64_t i = 0; fill && i < own->end - own->begin; i++)
        next[i] = own->outside_ptr[i];
    for (int64_t i = own->begin; i < A->nodes; i++)
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
            const int64_t j = A->idx[e];
            const bool has_i = i < own->end, has_j = j >= own->begin && j < own->end;
            if (has_i == has_j)
                continue;
            const int64_t row = (has_i ? i : j) - own->begin;
            if (!fill) {
                own->outside_ptr[row + 1]++;
                continue;
            }
            const int64_t at = next[row]++;
            own->outside_idx[at] = (int32_t)(has_i ? j : i);
            take_block(own->outside + at * b * b, of, i, e, !has_i);
        }
    free(next);
}

static void copy_own_rows(shared_level *own, const reduced *of)
{
    const uz_blocks *A = &of->level->A;
    uz_level *to = &own->level;
    const int64_t nodes = own->end - own->begin, size = (int64_t)A->b * A->b;
    int64_t count = 0;
    to->A = (uz_blocks){.nodes = nodes, .b = A->b, .ptr = new_zeros(nodes + 1, sizeof *to->A.ptr)};
    for (int64_t i = 0; i < nodes; i++) {
        for (int64_t e = A->ptr[own->begin + i]; e < A->ptr[own->begin + i + 1]; e++)
            count += A->idx[e] >= own->begin;
        to->A.ptr[i + 1] = count;
    }
    to->A.idx = new_zeros(count, sizeof *to->A.idx);
    to->off = new_zeros(count * size + 8, sizeof *to->off);
    to->diag = new_zeros(nodes * size + 8, sizeof *to->diag);
    memcpy(to->diag, of->level->diag + own->begin * size, (size_t)(nodes * size) * sizeof *to->diag);
    count = 0;
    for (int64_t i = own->begin; i < own->end; i++)
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            if (A->idx[e] >= own->begin) {
                to->A.idx[count] = (int32_t)(A->idx[e] - own->begin);
                take_block(to->off + count++ * size, of, i, e, false);
            }
}

/* Dofs that are not there stay so. */
static void add_sums(shared_level *own, const float *inverse)
{
    const int b = own->level.A.b;
    const int64_t nodes = own->end - own->begin;
    own->sum = new_zeros(nodes * b, sizeof *own->sum);
    own->level.inverse = new_zeros(nodes * b, sizeof *own->level.inverse);
    for (int64_t i = 0; i < nodes; i++)
        for (int r = 0; r < b; r++) {
            float *diagonal = &own->level.diag[(i * b + r) * b + r];
            for (int64_t e = own->outside_ptr[i]; e < own->outside_ptr[i + 1]; e++)
                for (int c = 0; c < b; c++)
                    own->sum[i * b + r] += fabsf(own->outside[(e * b + r) * b + c]);
            *diagonal += own->sum[i * b + r];
            own->level.inverse[i * b + r] = inverse[(own->begin + i) * b + r] > 0.0F ? 1.0F / *diagonal : 0.0F;
        }
}

void shared_init(shared_level *own, const uz_multigrid *base, const uz_multigrid_room *room, const neighbours *near,
                 const uz_blocks *loss, const bool *lost)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    *own = (shared_level){.size = near->size};
    if (near->size == 1 || base->levels == 1)
        return;
    uz_level level = mg->level[0];
    const reduced of = {&level, loss, lost};
    if (lost) {
        level.diag = room->own[0].diag;
        level.inverse = room->own[0].inverse;
    }
    const int b = level.A.b, width = uz_width(b);
    for (int l = 0; l < LANES; l++) {
        own->count[l] = new_zeros(near->size, sizeof *own->count[l]);
        own->first[l] = new_zeros(near->size, sizeof *own->first[l]);
        for (int p = 0; p < near->size; p++) {
            own->first[l][p] = (int)(level.A.nodes * p / near->size) * width * (l + 1);
            own->count[l][p] = (int)(level.A.nodes * (p + 1) / near->size) * width * (l + 1) - own->first[l][p];
        }
    }
    own->begin = own->first[0][near->rank] / width;
    own->end = own->begin + own->count[0][near->rank] / width;
    own->outside_ptr = new_zeros(own->end - own->begin + 1, sizeof *own->outside_ptr);
    list_outside(own, &of, false);
    for (int64_t i = 0; i < own->end - own->begin; i++)
        own->outside_ptr[i + 1] += own->outside_ptr[i];
    const int64_t blocks = own->outside_ptr[own->end - own->begin];
    own->outside_idx = new_zeros(blocks, sizeof *own->outside_idx);
    own->outside = new_zeros(blocks * b * b, sizeof *own->outside);
    list_outside(own, &of, true);
    copy_own_rows(own, &of);
    add_sums(own, level.inverse);
    own->level.ptr = level.ptr + own->begin; /* borrowed, as are the next two */
    own->level.block = level.block;
    own->level.value = level.value;
    own->level.aggregates = level.aggregates;
    own->divided = true;
}

void shared_clear(shared_level *own)
{
    void *made[] = {own->count[0],    own->count[1],   own->first[0],     own->first[1],    own->outside_ptr,
                    own->outside_idx, own->outside,    own->sum,          own->level.A.ptr, own->level.A.idx,
                    own->level.off,   own->level.diag, own->level.inverse};
    for (size_t k = 0; k < sizeof made / sizeof made[0]; k++)
        free(made[k]);
    *own = (shared_level){0};
}

/* All processes' numbers of x, and to (of the own nodes) += (D' - D) x - O x: see steps.c. */
static void meet(const shared_level *own, float *x, float *to, int lanes)
{
    const int b = own->level.A.b, width = uz_width(b);
    MPI_Request request;
    MPI_Iallgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, x, own->count[lanes - 1], own->first[lanes - 1], MPI_FLOAT,
                    MPI_COMM_WORLD, &request);
    wait_for(1, &request);
    for (int64_t i = 0; to && i < own->end - own->begin; i++)
        for (int l = 0; l < lanes && own->outside_ptr[i] < own->outside_ptr[i + 1]; l++) {
            const float *here = x + ((own->begin + i) * lanes + l) * width;
            float *sum = to + (i * lanes + l) * width;
            for (int r = 0; r < b; r++)
                sum[r] += own->sum[i * b + r] * here[r];
            for (int64_t e = own->outside_ptr[i]; e < own->outside_ptr[i + 1]; e++) {
                const float *block = own->outside + e * b * b,
                            *there = x + ((int64_t)own->outside_idx[e] * lanes + l) * width;
                for (int r = 0; r < b; r++)
                    for (int c = 0; c < b; c++)
                        sum[r] -= block[r * b + c] * there[c];
            }
        }
}

void shared_apply(const shared_level *own, const uz_multigrid *base, uz_multigrid_room *room, float *z, int lanes)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const uz_level *level = &mg->level[0];
    const int b = level->A.b, width = uz_width(b), k = mg->level[1].A.b;
    const int64_t from = own->begin * lanes * width, fours = level->A.nodes * lanes;
    uz_error err = {0};
    for (int64_t i = 0; i < fours; i++) /* dofs are numbered as they stand there */
        for (int r = 0; r < b; r++)
            room->b[0][i * width + r] = (float)mg->scale[i / lanes * b + r] * z[i * width + r];
    uz_level_step step = {.level = &own->level,
                          .inverse = own->level.inverse,
                          .b = room->b[0] + from,
                          .x = room->x[0] + from,
                          .t = room->t[0] + from,
                          .coarse = room->b[1],
                          .k = k,
                          .lanes = lanes};
    uz_level_take_step(&step, UZ_STEP_SWEEP_DOWN);
    meet(own, room->x[0], room->t[0] + from, lanes);
    uz_level_take_step(&step, UZ_STEP_RESTRICT);
    combine_all(room->b[1], (int)(level->aggregates * lanes * uz_width(k)), MPI_FLOAT, MPI_SUM);
    if (uz_cycle_below(mg, room, 1, lanes, &err) != UZ_OK)
        end_group(err.message);
    step.coarse = room->x[1];
    uz_level_take_step(&step, UZ_STEP_PROLONG);
    meet(own, room->x[0], room->b[0] + from, lanes);
    uz_level_take_step(&step, UZ_STEP_SWEEP_UP);
    meet(own, room->x[0], NULL, lanes);
    for (int64_t i = 0; i < fours; i++)
        for (int r = 0; r < width; r++)
            z[i * width + r] = r < b ? (float)mg->scale[i / lanes * b + r] * room->x[0][i * width + r] : 0.0F;
}
