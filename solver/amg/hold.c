/* hold.c: dofs that are held in a multigrid that was made without them.
 *
 * The prolongation loses its rows of held dofs: P_F = P - P_H. Every coarse matrix is to be P_F'A P_F again, or the
 * correction would count on displacements of held dofs, which are not made. It differs from P'A P by what held dofs
 * take part in, and only that is computed, at the price of their share of the body:
 *
 *     P'A P - P_F'A P_F = G + G',  G = P_H'A (P - P_H / 2),
 *
 * and on the levels below by P'(that) P. Truncated basis functions as in Kornhuber and Krause, Comput. Vis. Sci. 4
 * (2001). */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/error.h"
#include "core/hooks.h"
#include "linalg/pieces.h"

#include <stdlib.h>
#include <string.h>

enum { SIZE_MOST = 6 };

/* A function on held dofs but for so much of its energy is left out. */
#define LOST 1e-5

static uz_status fail_memory(int64_t n, uz_error *err)
{
    return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to hold dofs of %lld", (long long)n);
}

static void clear_row(uz_blocks *to, int64_t row)
{
    const int64_t size = (int64_t)to->b * to->b, first = to->ptr[row];
    memset(to->off + first * size, 0, (size_t)((to->ptr[row + 1] - first) * size) * sizeof *to->off);
    memset(to->diag + row * size, 0, (size_t)size * sizeof *to->diag);
}

/* to += G + G', G one block at (a, c), k x k. touched: which rows of `to` have numbers yet; NULL: all. */
static inline __attribute__((always_inline)) void add_symmetric(uz_blocks *to, bool *touched, int32_t a, int32_t c,
                                                                const double *G, int k)
{
    const int32_t row = a > c ? a : c;
    if (touched && !touched[row]) {
        clear_row(to, row);
        touched[row] = true;
    }
    double *block =
        a == c ? to->diag + (int64_t)a * k * k : to->off + uz_blocks_find(to, a > c ? a : c, a > c ? c : a) * k * k;
    for (int p = 0; p < k; p++)
        for (int q = 0; q < k; q++) {
            if (a >= c)
                block[p * k + q] += G[p * k + q];
            if (a <= c)
                block[q * k + p] += G[p * k + q];
        }
}

/* One block of the finer level, the rows and columns that count. */
typedef struct {
    const double *A; /* b x b */
    bool transposed;
    int64_t i, j;               /* its nodes */
    const double *left, *right; /* b: weights of its rows and columns */
    int32_t first, end;         /* of the coarse matrix it is added to these rows alone: below its diagonal */
    bool *touched;              /* see add_symmetric */
} coupling;

/* Are there rows to add to where these columns, ascending, meet one another? */
static inline bool meets(const coupling *x, int32_t a_first, int32_t a_last, int32_t c_first, int32_t c_last)
{
    return (a_last > c_last ? a_last : c_last) >= x->first && (a_first > c_first ? a_first : c_first) < x->end;
}

/* to += G + G', G = P_i' left A right P_j, row by row of those that count: of held dofs one in three does. */
static inline __attribute__((always_inline)) void add_blocks(uz_blocks *to, const uz_level *fine, const coupling *x,
                                                             int b, int k)
{
    int rows = 0, row[SIZE_MOST];
    const int64_t begin = fine->ptr[x->i], end = fine->ptr[x->i + 1];
    for (int r = 0; r < b; r++)
        if (x->left[r] > 0.0)
            row[rows++] = r;
    for (int64_t e = fine->ptr[x->j]; begin < end && e < fine->ptr[x->j + 1]; e++) {
        const float *P = fine->value + e * b * k;
        const int32_t column = fine->block[e];
        if (!meets(x, fine->block[begin], fine->block[end - 1], column, column))
            continue;
        double AP[SIZE_MOST * SIZE_MOST] = {0};
        for (int q = 0; q < rows; q++)
            for (int s = 0; s < b; s++) {
                const int r = row[q];
                const double factor = x->left[r] * x->right[s] * (x->transposed ? x->A[s * b + r] : x->A[r * b + s]);
                for (int c = 0; c < k; c++)
                    AP[q * k + c] += factor * (double)P[s * k + c];
            }
        for (int64_t f = begin; f < end; f++) {
            const float *of_row = fine->value + f * b * k;
            if (!meets(x, fine->block[f], fine->block[f], column, column))
                continue;
            double G[SIZE_MOST * SIZE_MOST] = {0};
            for (int q = 0; q < rows; q++)
                for (int p = 0; p < k; p++)
                    for (int c = 0; c < k; c++)
                        G[p * k + c] += (double)of_row[row[q] * k + p] * AP[q * k + c];
            add_symmetric(to, x->touched, fine->block[f], column, G, k);
        }
    }
}

/* For each size of blocks of solids its own loops. */
static void add_coupling(uz_blocks *to, const uz_level *fine, const coupling *x)
{
    const int b = fine->A.b, k = to->b;
    if (b == 3 && k == 6)
        add_blocks(to, fine, x, 3, 6);
    else if (b == 6 && k == 6)
        add_blocks(to, fine, x, 6, 6);
    else
        add_blocks(to, fine, x, b, k);
}

static bool is_any_held(const float *inverse, const float *free, int b)
{
    bool any = false;
    for (int r = 0; r < b; r++)
        any = any || (free[r] > 0.0F && !(inverse[r] > 0.0F));
    return any;
}

/* The weights of a node's dofs: in P_H, and in P - P_H / 2. */
static void weigh(double *held, double *rest, const float *inverse, int b)
{
    for (int r = 0; r < b; r++) {
        held[r] = inverse[r] > 0.0F ? 0.0 : 1.0;
        rest[r] = inverse[r] > 0.0F ? 1.0 : 0.5;
    }
}

/* What a level loses, as the threads that share it see that: each adds to some rows of the coarse matrix, in the order
 * of the nodes, and goes through all of these. */
typedef struct {
    uz_blocks *loss;
    const uz_level *fine;
    const float *inverse;
    const uz_blocks *from; /* loss of the finer level that it is P'(that) P of; NULL: it comes of held dofs */
    bool *any;             /* nodes: has it held dofs, or lost something itself? */
    bool *touched;         /* of `loss`: which rows have numbers; NULL: all */
    int32_t first[UZ_ASIDE_MOST + 1];
} losing;

static void lose_part(void *ctx, int part)
{
    const losing *x = ctx;
    const uz_level *fine = x->fine;
    const uz_blocks *A = &fine->A;
    const int b = A->b;
    const int32_t first = x->first[part], end = x->first[part + 1];
    double room[SIZE_MOST * SIZE_MOST], held_i[SIZE_MOST], rest_i[SIZE_MOST], held_j[SIZE_MOST], rest_j[SIZE_MOST];
    for (int64_t i = 0; i < A->nodes; i++) {
        const bool own = x->any[i];
        weigh(held_i, rest_i, x->inverse + i * b, b);
        if (own)
            add_coupling(x->loss, fine,
                         &(coupling){uz_level_block(room, fine, true, i, b * b), false, i, i, held_i, rest_i, first,
                                     end, x->touched});
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
            const int64_t j = A->idx[e];
            const bool other = x->any[j];
            if (!own && !other)
                continue;
            const double *block = uz_level_block(room, fine, false, e, b * b);
            weigh(held_j, rest_j, x->inverse + j * b, b);
            if (own)
                add_coupling(x->loss, fine, &(coupling){block, false, i, j, held_i, rest_j, first, end, x->touched});
            if (other)
                add_coupling(x->loss, fine, &(coupling){block, true, j, i, held_j, rest_i, first, end, x->touched});
        }
    }
}

/* Rows of each part, so that as many blocks of held dofs' rows of P are of each. */
static bool share_out(losing *x, int parts)
{
    const uz_level *fine = x->fine;
    int32_t *count = uz_alloc_zero(x->loss->nodes, sizeof *count);
    int64_t all = 0, so_far = 0;
    int part = 0;
    if (!count)
        return false;
    for (int64_t i = 0; i < fine->A.nodes; i++)
        for (int64_t e = fine->ptr[i]; x->any[i] && e < fine->ptr[i + 1]; e++, all++)
            count[fine->block[e]]++;
    for (int64_t a = 0; a < x->loss->nodes; so_far += count[a++])
        while (part + 1 < parts && so_far * parts >= all * (part + 1))
            x->first[++part] = (int32_t)a;
    while (part < parts)
        x->first[++part] = (int32_t)x->loss->nodes;
    free(count);
    return true;
}

/* Nodes of a part, at least. */
enum { PART_LEAST = 4096 };

/* Whatever `any` says, lost by threads. false: no memory. */
static bool lose_by_parts(losing *x, void (*run)(void *ctx, int part))
{
    const int64_t most = x->fine->A.nodes / PART_LEAST;
    const int threads = most < 2 ? 1 : uz_aside_threads(), parts = threads < most || most < 2 ? threads : (int)most;
    const bool ok = share_out(x, parts);
    if (ok)
        uz_aside_share(run, x, parts);
    return ok;
}

static void look_for_held(void *ctx, int64_t begin, int64_t end)
{
    const losing *x = ctx;
    const int b = x->fine->A.b;
    for (int64_t i = begin; i < end; i++)
        x->any[i] = is_any_held(x->inverse + i * b, x->fine->inverse + i * b, b);
}

static bool lose_held(uz_blocks *loss, bool *touched, const uz_level *fine, const float *inverse)
{
    const int64_t nodes = fine->A.nodes;
    losing x = {
        .loss = loss, .fine = fine, .inverse = inverse, .any = uz_alloc(nodes, sizeof *x.any), .touched = touched};
    if (x.any)
        uz_by_pieces(look_for_held, &x, nodes);
    const bool ok = x.any && lose_by_parts(&x, lose_part);
    free(x.any);
    return ok;
}

bool uz_level_loss(uz_blocks *loss, const uz_level *fine, const float *inverse)
{
    return lose_held(loss, NULL, fine, inverse);
}

static bool is_zero(const double *block, int64_t size)
{
    int64_t k = 0;
    while (k < size && block[k] == 0.0)
        k++;
    return k == size;
}

static void look_for_losses(void *ctx, int part)
{
    const losing *x = ctx;
    const uz_blocks *from = x->from;
    const int64_t size = (int64_t)from->b * from->b;
    for (int64_t i = x->first[part]; i < x->first[part + 1]; i++)
        x->any[i] = !is_zero(from->diag + i * size, size) ||
                    !is_zero(from->off + from->ptr[i] * size, (from->ptr[i + 1] - from->ptr[i]) * size);
}

static void pass_part(void *ctx, int part)
{
    static const double all[SIZE_MOST] = {1, 1, 1, 1, 1, 1}, half[SIZE_MOST] = {.5, .5, .5, .5, .5, .5};
    const losing *x = ctx;
    const uz_blocks *from = x->from;
    const int64_t size = (int64_t)from->b * from->b;
    const int32_t first = x->first[part], end = x->first[part + 1];
    for (int64_t i = 0; i < from->nodes; i++) {
        if (!x->any[i])
            continue;
        if (!is_zero(from->diag + i * size, size))
            add_coupling(x->loss, x->fine,
                         &(coupling){from->diag + i * size, false, i, i, all, half, first, end, x->touched});
        for (int64_t e = from->ptr[i]; e < from->ptr[i + 1]; e++)
            if (!is_zero(from->off + e * size, size))
                add_coupling(
                    x->loss, x->fine,
                    &(coupling){from->off + e * size, false, i, from->idx[e], all, all, first, end, x->touched});
    }
}

/* What the next level loses: P'(loss) P. lost: rows of `loss` that have numbers; NULL: all; touched: likewise of next.
 * false: no memory. */
static bool pass_on(uz_blocks *next, bool *touched, const uz_blocks *loss, const bool *lost, const uz_level *level,
                    const uz_team *team)
{
    const int64_t begin = uz_team_first(team, 0, loss->nodes), end = uz_team_first(team, 1, loss->nodes);
    const int parts = end - begin < 2 * PART_LEAST ? 1 : uz_aside_threads();
    losing x = {.loss = next,
                .fine = level,
                .from = loss,
                .any = uz_alloc_zero(loss->nodes, sizeof *x.any),
                .touched = touched};
    for (int part = 0; part <= parts; part++)
        x.first[part] = (int32_t)(begin + (end - begin) * part / parts);
    if (x.any && lost)
        memcpy(x.any + begin, lost + begin, (size_t)(end - begin) * sizeof *x.any);
    else if (x.any)
        uz_aside_share(look_for_losses, &x, parts);
    x.first[0] = 0; /* what is lost is shared out by all rows of the next level */
    const bool ok = x.any && lose_by_parts(&x, pass_part);
    free(x.any);
    uz_team_sum(team, next);
    return ok;
}

typedef struct {
    float *to;
    const float *from;
    const double *loss;
} difference;

static void subtract_numbers(void *ctx, int64_t begin, int64_t end)
{
    const difference *x = ctx;
    for (int64_t e = begin; e < end; e++)
        x->to[e] = (float)((double)x->from[e] - x->loss[e]);
}

/* The level without what it loses, in arrays of its own. lost (nodes): rows of `loss` that are not 0; NULL: any. */
static bool subtract_off(uz_level *own, const uz_level *level, const uz_blocks *loss, const bool *lost)
{
    const int64_t size = (int64_t)level->A.b * level->A.b, off = level->A.ptr[level->A.nodes] * size;
    own->off = uz_alloc(off + 8, sizeof *own->off);
    if (!own->off)
        return false;
    if (!lost) {
        uz_by_pieces(subtract_numbers, &(difference){own->off, level->off, loss->off}, off);
    } else {
        memcpy(own->off, level->off, (size_t)off * sizeof *own->off);
        for (int64_t i = 0; i < level->A.nodes; i++)
            if (lost[i])
                subtract_numbers(&(difference){own->off, level->off, loss->off}, level->A.ptr[i] * size,
                                 level->A.ptr[i + 1] * size);
    }
    memset(own->off + off, 0, 8 * sizeof *own->off);
    return true;
}

static bool subtract_diag(uz_level *own, const uz_level *level, const uz_blocks *loss, const bool *lost)
{
    const int b = level->A.b;
    const int64_t size = (int64_t)b * b, n = level->A.nodes * b, diag = level->A.nodes * size;
    own->diag = uz_alloc(diag + 8, sizeof *own->diag);
    own->inverse = uz_alloc(n, sizeof *own->inverse);
    if (!own->diag || !own->inverse)
        return false;
    difference numbers = {own->diag, level->diag, loss->diag};
    if (lost)
        memcpy(own->diag, level->diag, (size_t)diag * sizeof *own->diag);
    for (int64_t i = 0; lost && i < level->A.nodes; i++)
        if (lost[i])
            subtract_numbers(&numbers, i * size, (i + 1) * size);
    if (!lost)
        uz_by_pieces(subtract_numbers, &numbers, diag);
    memset(own->diag + diag, 0, 8 * sizeof *own->diag);
    for (int64_t i = 0; i < n; i++) {
        const int64_t at = i / b * size + i % b * b + i % b;
        own->inverse[i] = own->diag[at] > (float)LOST * level->diag[at] ? 1.0F / own->diag[at] : 0.0F;
    }
    return true;
}

/* The coarsest level's factor. Where rounding has made it indefinite that of the whole body does. */
static uz_status factor(uz_multigrid_room *room, const uz_level *last, const uz_blocks *loss, const bool *lost,
                        const uz_hooks *hooks, uz_error *err)
{
    const int64_t size = (int64_t)loss->b * loss->b;
    uz_blocks A = *loss;
    uz_csc columns = {0};
    uz_error inner = {0};
    for (int64_t i = 0; i < A.nodes; i++) {
        if (lost && !lost[i])
            clear_row(&A, i);
        for (int64_t e = A.ptr[i] * size; e < A.ptr[i + 1] * size; e++)
            A.off[e] = last->A.off[e] - A.off[e];
        for (int64_t e = i * size; e < (i + 1) * size; e++)
            A.diag[e] = last->A.diag[e] - A.diag[e];
    }
    uz_status status = uz_blocks_to_columns(&columns, &A, room->own[room->levels - 1].inverse, err);
    if (status == UZ_OK) {
        status = uz_factor_coarsest(&room->coarsest, &columns, 0, hooks, &inner);
        if (status == UZ_ERR_NOT_SPD)
            status = UZ_OK;
        else if (status != UZ_OK)
            uz_fail(err, status, inner.where, "%s", inner.message);
    }
    uz_csc_clear(&columns);
    return status;
}

static void clear_numbers(void *ctx, int64_t begin, int64_t end)
{
    memset((double *)ctx + begin, 0, (size_t)(end - begin) * sizeof(double));
}

/* Zeros; or *touched, which is to be freed, says that there are no numbers yet. */
static bool init_loss(uz_blocks *loss, bool **touched, const uz_level *level)
{
    const int64_t size = (int64_t)level->A.b * level->A.b;
    *loss = level->A; /* whose places it shares */
    const int64_t off = level->A.ptr[level->A.nodes] * size, diag = level->A.nodes * size;
    loss->off = uz_alloc(off, sizeof *loss->off);
    loss->diag = uz_alloc(diag, sizeof *loss->diag);
    if (!loss->off || !loss->diag)
        return false;
    if (touched)
        return (*touched = uz_alloc_zero(level->A.nodes, sizeof **touched)) != NULL;
    uz_by_pieces(clear_numbers, loss->off, off);
    uz_by_pieces(clear_numbers, loss->diag, diag);
    return true;
}

void uz_release_levels(uz_multigrid_room *room)
{
    for (int l = 0; l < room->levels; l++) {
        uz_free_all(room->own[l].off, room->own[l].diag, room->own[l].inverse);
    }
    memset(room->own, 0, sizeof room->own);
    uz_factor_free(room->coarsest);
    room->coarsest = NULL;
}

static size_t own_bytes(const uz_level *level)
{
    const size_t b = (size_t)level->A.b, nodes = (size_t)level->A.nodes, blocks = (size_t)level->A.ptr[nodes];
    return 4 * (b * b * (blocks + nodes) + b * nodes);
}

/* room->own from level `from` on, not the last, whose loss stands in `first`; lost: see subtract_off. apart: the blocks
 * that this level has left are the caller's affair. */
static uz_status lose(uz_multigrid_room *room, const uz_aggregates *mg, int from, const uz_blocks *first,
                      const bool *lost, bool apart, size_t *bytes, const uz_team *team, const uz_stop *stop,
                      uz_error *err)
{
    uz_blocks loss = *first;
    bool *made = NULL; /* of the loss: rows that have numbers; team sums need them all */
    uz_status status = UZ_OK;
    for (int l = from; status == UZ_OK && l < mg->base.levels; l++) {
        uz_blocks next = {0};
        bool *touched = NULL;
        if (l > from && !init_loss(&next, team ? NULL : &touched, &mg->level[l]))
            status = fail_memory(mg->base.n, err);
        else if (uz_stop_is_due(stop))
            status = uz_fail_stopped(err);
        else if (l > from && !pass_on(&next, touched, &loss, lost, &mg->level[l - 1], team))
            status = fail_memory(mg->base.n, err);
        if (l > from) {
            if (loss.off != first->off) {
                free(loss.off);
                free(loss.diag);
            }
            free(made);
            loss = next;
            lost = made = touched;
        }
        if (status == UZ_OK && !(l == from && apart) && !subtract_off(&room->own[l], &mg->level[l], &loss, lost))
            status = fail_memory(mg->base.n, err);
        if (status == UZ_OK && !subtract_diag(&room->own[l], &mg->level[l], &loss, lost))
            status = fail_memory(mg->base.n, err);
        *bytes += own_bytes(&mg->level[l]);
    }
    if (status == UZ_OK)
        status = factor(room, &mg->level[mg->base.levels - 1], &loss, lost, stop ? stop->hooks : NULL, err);
    if (status == UZ_OK && room->coarsest)
        *bytes += uz_factor_describe(room->coarsest).bytes;
    if (loss.off != first->off) {
        free(loss.off);
        free(loss.diag);
    }
    free(made);
    return status;
}

uz_status uz_hold_loss(uz_multigrid_room *room, const uz_multigrid *base, uz_blocks *loss, const bool *lost, bool apart,
                       const uz_team *team, uz_error *err)
{
    const uz_aggregates *mg = (const uz_aggregates *)base;
    const uz_level *level = &mg->level[0];
    const int b = level->A.b;
    size_t bytes = 0;
    for (int64_t j = 0; j < base->n; j++) { /* slots are numbered as dofs are: see there */
        const int64_t i = uz_slot_node(mg, mg->slot[j]);
        for (int64_t e = level->A.ptr[i] - 1; (!lost || lost[i]) && e < level->A.ptr[i + 1]; e++) {
            const int64_t c = e < level->A.ptr[i] ? i : level->A.idx[e];
            double *row =
                (c == i ? loss->diag + i * b * b : loss->off + e * b * b) + uz_slot_place(mg, mg->slot[j]) * b;
            for (int q = 0; q < b; q++)
                row[q] *= mg->scale[j] * mg->scale[c * b + q];
        }
    }
    uz_release_levels(room);
    return lose(room, mg, 0, loss, lost, apart, &bytes, team, NULL, err);
}

uz_status uz_hold_levels(uz_multigrid_room *room, const uz_aggregates *mg, const bool *held, size_t *bytes,
                         const uz_stop *stop, uz_error *err)
{
    const uz_level *finest = &mg->level[0];
    const int64_t slots = finest->A.nodes * finest->A.b;
    uz_blocks loss = {0};
    bool *touched = NULL;
    float *inverse = room->own[0].inverse = uz_alloc(slots, sizeof *inverse);
    uz_status status = inverse ? UZ_OK : fail_memory(mg->base.n, err);
    if (inverse)
        memcpy(inverse, finest->inverse, (size_t)slots * sizeof *inverse);
    for (int64_t j = 0; inverse && j < mg->base.n; j++)
        if (held[j])
            inverse[uz_slot_number(mg, mg->slot[j])] = 0.0F;
    *bytes += 4 * (size_t)slots;
    if (status == UZ_OK && (!init_loss(&loss, &touched, &mg->level[1]) || !lose_held(&loss, touched, finest, inverse)))
        status = fail_memory(mg->base.n, err);
    if (status == UZ_OK)
        status = lose(room, mg, 1, &loss, touched, false, bytes, NULL, stop, err);
    free(touched);
    free(loss.off);
    free(loss.diag);
    return status;
}
