/* blocks.c: a symmetric matrix as blocks, of which those left of the diagonal are stored. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"
#include "core/order.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void uz_blocks_clear(uz_blocks *A)
{
    uz_free_all(A->ptr, A->idx, A->off, A->diag);
    memset(A, 0, sizeof *A);
}

int64_t uz_blocks_find(const uz_blocks *A, int64_t row, int32_t column)
{
    int64_t low = A->ptr[row], high = A->ptr[row + 1] - 1;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (A->idx[middle] < column)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

bool uz_below_init(uz_below *below, const uz_blocks *A)
{
    const int64_t count = A->ptr[A->nodes];
    *below = (uz_below){uz_alloc_zero(A->nodes + 2, sizeof *below->ptr), uz_alloc(count, sizeof *below->node),
                        uz_alloc(count, sizeof *below->at)};
    if (!below->ptr || !below->node || !below->at)
        return false;
    for (int64_t e = 0; e < count; e++)
        below->ptr[A->idx[e] + 2]++;
    for (int64_t j = 0; j < A->nodes; j++)
        below->ptr[j + 2] += below->ptr[j + 1];
    for (int64_t i = 0; i < A->nodes; i++)
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
            const int64_t place = below->ptr[A->idx[e] + 1]++;
            below->node[place] = (int32_t)i;
            below->at[place] = e;
        }
    return true;
}

void uz_below_clear(uz_below *below)
{
    uz_free_all(below->ptr, below->node, below->at);
    memset(below, 0, sizeof *below);
}

/* ------------------------------------------------------------------ from a matrix */

/* Nodes of a part at least: some 0.2 ms of a sweep. A rest that is more of all nodes is not worth it. */
#define PART_LEAST 8192
#define MOST_REST  0.2

/* K as the threads that look for parts see it: of groups, what number they have in the order of first dofs, and their
 * parts, which are ranges of that; whoever has a neighbour in an earlier range is of the rest. */
typedef struct {
    const uz_csc *K;
    const int32_t *node;   /* the group of each dof */
    const int32_t *number; /* -1: none */
    const int8_t *part;
    bool *rest;
    int pieces;
    int32_t reach[UZ_ASIDE_MOST]; /* how far apart neighbours are in the order, at most */
} division;

static void find_rest(void *ctx, int piece)
{
    division *x = ctx;
    const uz_csc *K = x->K;
    const int64_t end = K->cols * (piece + 1) / x->pieces;
    int32_t reach = 0;
    for (int64_t j = K->cols * piece / x->pieces; j < end; j++) {
        const int32_t J = x->node[j], at = x->number[J];
        const int8_t part = x->part[J];
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++) {
            const int32_t I = x->node[K->idx[q]], apart = abs(x->number[I] - at);
            reach = apart > reach ? apart : reach;
            if (x->part[I] != part) /* others may find the same */
                __atomic_store_n(x->rest + (x->part[I] > part ? I : J), true, __ATOMIC_RELAXED);
        }
    }
    x->reach[piece] = reach;
}

/* Numbers the nodes by parts, where there are enough of them. false: no memory. */
static bool number_by_parts(uz_blocks *A, int32_t *node_of_group, const uz_csc *K, const uz_modes *modes)
{
    const int64_t nodes = A->nodes, most = nodes / PART_LEAST;
    const int parts = most < UZ_PARTS_MOST ? (int)most : UZ_PARTS_MOST;
    if (parts < 2)
        return true;
    int8_t *part = uz_alloc(modes->n_nodes, sizeof *part);
    bool *rest = uz_alloc_zero(modes->n_nodes, sizeof *rest);
    int32_t *group = uz_alloc(nodes, sizeof *group), reach = 0; /* by number */
    const bool ok = part && group && rest;
    if (ok) {
        division x = {K, modes->node, node_of_group, part, rest, uz_aside_threads(), {0}};
        int64_t left = 0;
        for (int64_t g = 0; g < modes->n_nodes; g++) {
            part[g] = (int8_t)(node_of_group[g] < 0 ? 0 : node_of_group[g] * (int64_t)parts / nodes);
            if (node_of_group[g] >= 0)
                group[node_of_group[g]] = (int32_t)g;
        }
        uz_aside_share(find_rest, &x, x.pieces);
        for (int piece = 0; piece < x.pieces; piece++)
            reach = x.reach[piece] > reach ? x.reach[piece] : reach;
        for (int64_t g = 0; g < modes->n_nodes; g++)
            left += rest[g];
        A->parts = (double)left <= MOST_REST * (double)nodes ? parts : 0;
    }
    int32_t next = 0;
    for (int p = 0; ok && A->parts > 0 && p < 2 * parts; p++) {
        *(p < parts ? A->part + p : A->seam + p - parts) = next;
        for (int64_t i = 0; i < nodes; i++)
            if (part[group[i]] == p % parts && rest[group[i]] == (p >= parts))
                node_of_group[group[i]] = next++;
    }
    A->part[parts] = A->seam[0];
    A->seam[parts] = nodes;
    A->seams = A->parts > 0 && nodes / parts >= 3 * (int64_t)reach ? parts : 0;
    uz_free_all(part, rest, group);
    return ok;
}

/* The nodes that have dofs, in the order of their first ones or by parts, and the place of each dof. false: no memory.
 */
static bool number_slots(uz_aggregates *mg, int32_t *node_of_group, const uz_csc *K, const uz_modes *modes, bool parted)
{
    uz_blocks *A = &mg->level[0].A;
    int32_t *places = uz_alloc_zero(modes->n_nodes, sizeof *places);
    if (!places)
        return false;
    for (int64_t g = 0; g < modes->n_nodes; g++)
        node_of_group[g] = -1;
    for (int64_t j = 0; j < mg->base.n; j++) {
        const int32_t group = modes->node[j];
        node_of_group[group] = places[group] == 0 ? (int32_t)A->nodes++ : node_of_group[group];
        mg->slot[j] = places[group]++;
        A->b = places[group] > A->b ? places[group] : A->b;
    }
    const bool ok = !parted || number_by_parts(A, node_of_group, K, modes);
    mg->shift = uz_width(A->b) == 8 ? 3 : 2;
    for (int64_t j = 0; ok && j < mg->base.n; j++)
        mg->slot[j] += (int64_t)node_of_group[modes->node[j]] << mg->shift;
    free(places);
    return ok;
}

/* Pairs of nodes that columns of K know, as the threads that share the columns see that: counted, then listed. */
typedef struct {
    const uz_aggregates *mg;
    const uz_csc *K;
    int parts;
    int64_t *place[UZ_PARTS_MOST]; /* nodes: how many pairs a part has of each row, then where the next one goes */
    int32_t *seen[UZ_PARTS_MOST];
    int32_t *idx; /* NULL: they are counted */
} pairing;

static void find_pairs(void *ctx, int part)
{
    const pairing *x = ctx;
    const uz_csc *K = x->K;
    const int64_t *slot = x->mg->slot;
    int64_t *place = x->place[part];
    int32_t *seen = x->seen[part];
    for (int64_t i = 0; i < x->mg->level[0].A.nodes; i++)
        seen[i] = -1;
    for (int64_t j = K->cols * part / x->parts; j < K->cols * (part + 1) / x->parts; j++) {
        const int32_t J = (int32_t)uz_slot_node(x->mg, slot[j]);
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++) {
            const int32_t I = (int32_t)uz_slot_node(x->mg, slot[K->idx[q]]);
            if (I == J || seen[I] == J)
                continue;
            seen[I] = J;
            if (x->idx)
                x->idx[place[I > J ? I : J]] = I > J ? J : I;
            place[I > J ? I : J]++;
        }
    }
}

/* Each row sorted, and each once. */
static void sort_rows(uz_blocks *A)
{
    int64_t count = 0, from = 0;
    for (int64_t i = 0; i < A->nodes; i++) {
        const int64_t to = A->ptr[i + 1];
        bool ascends = true;
        for (int64_t e = from + 1; e < to; e++)
            ascends = ascends && A->idx[e] > A->idx[e - 1];
        if (!ascends)
            qsort(A->idx + from, (size_t)(to - from), sizeof *A->idx, uz_ascending_32);
        A->ptr[i] = count;
        for (int64_t e = from; e < to; e++)
            if (e == from || A->idx[e] != A->idx[e - 1])
                A->idx[count++] = A->idx[e];
        from = to;
    }
    A->ptr[A->nodes] = count;
}

/* A->ptr and idx. */
static bool find_pattern(uz_aggregates *mg, const uz_csc *K)
{
    uz_blocks *A = &mg->level[0].A;
    const int threads = A->nodes < PART_LEAST ? 1 : uz_aside_threads();
    pairing x = {.mg = mg, .K = K, .parts = threads < UZ_PARTS_MOST ? threads : UZ_PARTS_MOST};
    bool ok = (A->ptr = uz_alloc_zero(A->nodes + 1, sizeof *A->ptr)) != NULL;
    for (int part = 0; part < x.parts; part++) {
        x.place[part] = uz_alloc_zero(A->nodes, sizeof *x.place[part]);
        x.seen[part] = uz_alloc(A->nodes, sizeof *x.seen[part]);
        ok = ok && x.place[part] && x.seen[part];
    }
    if (ok) {
        uz_aside_share(find_pairs, &x, x.parts);
        int64_t count = 0;
        for (int64_t i = 0; i < A->nodes; A->ptr[++i] = count)
            for (int part = 0; part < x.parts; part++) {
                const int64_t own = x.place[part][i];
                x.place[part][i] = count;
                count += own;
            }
        ok = (x.idx = A->idx = uz_alloc(count, sizeof *A->idx)) != NULL;
    }
    if (ok) {
        uz_aside_share(find_pairs, &x, x.parts);
        sort_rows(A);
    }
    for (int part = 0; part < x.parts; part++) {
        free(x.place[part]);
        free(x.seen[part]);
    }
    return ok;
}

static uz_status fail_diagonal(int64_t j, uz_error *err)
{
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is not positive definite: its diagonal entry of dof %lld (numbered from 0) is not positive. "
                   "Support the body so that it can't move freely, or check the signs of K.",
                   (long long)j);
}

/* Of a diagonal entry; 0 where it is not positive. */
static double scale_of(double own)
{
    return own > 0.0 ? ldexp(1.0, -ilogb(own) / 2) : 0.0;
}

/* S: the diagonal becomes 1/2 to 4. */
typedef struct {
    double *scale;
    const uz_csc *K;
} scaling;

static void find_scales(void *ctx, int64_t begin, int64_t end)
{
    const scaling *x = ctx;
    const uz_csc *K = x->K;
    for (int64_t j = begin; j < end; j++) {
        const int64_t q = K->ptr[j];
        x->scale[j] = q < K->ptr[j + 1] && K->idx[q] == j ? scale_of(K->val[q]) : 0.0;
    }
}

static uz_status find_scale(uz_aggregates *mg, const uz_csc *K, uz_error *err)
{
    uz_by_pieces(find_scales, &(scaling){mg->scale, K}, K->cols);
    for (int64_t j = 0; j < K->cols; j++)
        if (mg->scale[j] == 0.0)
            return fail_diagonal(j, err);
    return UZ_OK;
}

/* Entries of a positive definite matrix are smaller than the diagonal's: 4, scaled. */
#define ENTRY_MOST 4.0

static uz_status fail_entry(int64_t i, int64_t j, uz_error *err)
{
    return uz_fail(err, UZ_ERR_NOT_SPD, "K",
                   "K is not positive definite: its entry of the dofs %lld and %lld (numbered from 0) is larger than "
                   "their diagonal entries allow. Check the signs and units of K.",
                   (long long)i, (long long)j);
}

/* Columns of K as the threads that share them see that: each entry has a place of its own. */
typedef struct {
    uz_aggregates *mg;
    const uz_csc *K;
    int parts;
    int64_t bad[UZ_ASIDE_MOST][2]; /* of each part: an entry that is too large, -1: there is none */
} filling;

static void fill_part(void *ctx, int part)
{
    filling *x = ctx;
    const uz_aggregates *mg = x->mg;
    const uz_csc *K = x->K;
    const uz_blocks *A = &mg->level[0].A;
    const int b = A->b;
    const int64_t end = K->cols * (part + 1) / x->parts;
    x->bad[part][0] = -1;
    for (int64_t j = K->cols * part / x->parts; j < end; j++) {
        const int64_t J = uz_slot_node(mg, mg->slot[j]), c = uz_slot_place(mg, mg->slot[j]);
        int64_t known = -1, at = 0; /* the place of the block of the last row */
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++) {
            const int64_t i = K->idx[q], I = uz_slot_node(mg, mg->slot[i]), r = uz_slot_place(mg, mg->slot[i]);
            const double value = mg->scale[i] * K->val[q] * mg->scale[j];
            if (!(fabs(value) <= ENTRY_MOST)) {
                x->bad[part][0] = i;
                x->bad[part][1] = j;
                return;
            }
            if (I == J) {
                A->diag[(I * b + r) * b + c] = A->diag[(I * b + c) * b + r] = value;
                continue;
            }
            if (I != known)
                at = I > J ? uz_blocks_find(A, I, (int32_t)J) : uz_blocks_find(A, J, (int32_t)I);
            known = I;
            A->off[at * b * b + (I > J ? r * b + c : c * b + r)] = value;
        }
    }
}

static uz_status fill(uz_aggregates *mg, const uz_csc *K, uz_error *err)
{
    filling x = {.mg = mg, .K = K, .parts = K->cols < 2 * PART_LEAST ? 1 : uz_aside_threads()};
    uz_aside_share(fill_part, &x, x.parts);
    for (int part = 0; part < x.parts; part++)
        if (x.bad[part][0] >= 0)
            return fail_entry(x.bad[part][0], x.bad[part][1], err);
    return UZ_OK;
}

uz_status uz_blocks_of_matrix(uz_aggregates *mg, int32_t *node_of_group, const uz_csc *K, const uz_modes *modes,
                              bool parted, uz_error *err)
{
    uz_blocks *A = &mg->level[0].A;
    mg->slot = uz_alloc(K->cols, sizeof *mg->slot);
    mg->scale = uz_alloc(K->cols, sizeof *mg->scale);
    bool ok = mg->slot && mg->scale && number_slots(mg, node_of_group, K, modes, parted) && find_pattern(mg, K);
    if (ok) {
        const int64_t size = (int64_t)A->b * A->b;
        A->off = uz_alloc_zero(A->ptr[A->nodes] * size + 4, sizeof *A->off);
        A->diag = uz_alloc_zero(A->nodes * size + 4, sizeof *A->diag);
        ok = A->off && A->diag;
    }
    if (!ok)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a multigrid on %lld dofs", (long long)K->cols);
    const uz_status status = find_scale(mg, K, err);
    return status == UZ_OK ? fill(mg, K, err) : status;
}

/* ---------------------------------------------------------------- from blocks, and back */

/* Of the dofs of two nodes: their block becomes S times it times S, or that of the unit matrix. */
static bool scale_block(double *block, const uz_aggregates *mg, const float *there, int64_t i, int64_t j, int b)
{
    bool good = true;
    for (int r = 0; r < b; r++)
        for (int c = 0; c < b; c++) {
            const int64_t row = i * b + r, column = j * b + c;
            double *value = &block[r * b + c];
            if (there[row] > 0.0F && there[column] > 0.0F)
                *value *= mg->scale[row] * mg->scale[column];
            else
                *value = row == column ? 1.0 : 0.0;
            good = good && fabs(*value) <= ENTRY_MOST;
        }
    return good;
}

uz_status uz_blocks_take(uz_aggregates *mg, uz_blocks *from, const float *there, uz_error *err)
{
    const int b = from->b;
    const int64_t nodes = from->nodes, size = (int64_t)b * b, count = from->ptr[nodes];
    uz_blocks *A = &mg->level[0].A;
    *A = (uz_blocks){.nodes = nodes,
                     .b = b,
                     .ptr = uz_alloc(nodes + 1, sizeof *A->ptr),
                     .idx = uz_alloc(count, sizeof *A->idx),
                     .off = from->off,
                     .diag = uz_alloc(nodes * size + 4, sizeof *A->diag)};
    from->off = NULL;
    mg->shift = uz_width(b) == 8 ? 3 : 2;
    mg->slot = uz_alloc(nodes * b, sizeof *mg->slot);
    mg->scale = uz_alloc(nodes * b, sizeof *mg->scale);
    if (!A->ptr || !A->idx || !A->diag || !mg->slot || !mg->scale)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a multigrid on %lld dofs", (long long)(nodes * b));
    memcpy(A->ptr, from->ptr, (size_t)(nodes + 1) * sizeof *A->ptr);
    memcpy(A->idx, from->idx, (size_t)count * sizeof *A->idx);
    memcpy(A->diag, from->diag, (size_t)(nodes * size) * sizeof *A->diag);
    memset(A->diag + nodes * size, 0, 4 * sizeof *A->diag);
    for (int64_t j = 0; j < nodes * b; j++) {
        mg->slot[j] = (j / b << mg->shift) + j % b;
        mg->scale[j] = there[j] > 0.0F ? scale_of(A->diag[j / b * size + j % b * b + j % b]) : 1.0;
        if (mg->scale[j] == 0.0)
            return fail_diagonal(j, err);
    }
    for (int64_t i = 0; i < nodes; i++) {
        double *own = A->diag + i * size;
        for (int r = 0; r < b; r++) /* as sums of both triangles are rounded, these differ */
            for (int c = 0; c < r; c++)
                own[c * b + r] = own[r * b + c];
        if (!scale_block(own, mg, there, i, i, b))
            return fail_entry(i * b, i * b, err);
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++)
            if (!scale_block(A->off + e * size, mg, there, i, A->idx[e], b))
                return fail_entry(i * b, A->idx[e] * (int64_t)b, err);
    }
    return UZ_OK;
}

uz_status uz_blocks_give_back(uz_blocks *to, const uz_aggregates *mg, uz_error *err)
{
    const uz_level *level = &mg->level[0];
    const int b = to->b;
    const int64_t size = (int64_t)b * b;
    double room[UZ_MODES_MOST * UZ_MODES_MOST];
    to->off = uz_alloc_zero(to->ptr[to->nodes] * size + 4, sizeof *to->off);
    if (!to->off)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a multigrid on %lld dofs", (long long)(to->nodes * b));
    for (int64_t i = 0; i < to->nodes; i++)
        for (int64_t e = to->ptr[i]; e < to->ptr[i + 1]; e++) {
            const double *block = uz_level_block(room, level, false, e, size);
            for (int64_t q = 0; q < size; q++)
                to->off[e * size + q] = block[q] / (mg->scale[i * b + q / b] * mg->scale[to->idx[e] * b + q % b]);
        }
    return UZ_OK;
}

/* -------------------------------------------------------------------- to a matrix */

uz_status uz_blocks_to_columns(uz_csc *out, const uz_blocks *A, const float *inverse, uz_error *err)
{
    const int b = A->b;
    const int64_t size = (int64_t)b * b;
    uz_below below;
    int64_t at = 0;
    uz_status status =
        uz_below_init(&below, A) ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory for a coarse matrix");
    if (status == UZ_OK)
        status = uz_csc_init(out, A->nodes * b, A->nodes * b, A->nodes * (size + b) / 2 + A->ptr[A->nodes] * size, err);
    for (int64_t j = 0; status == UZ_OK && j < A->nodes; j++)
        for (int c = 0; c < b; c++) {
            for (int r = c; r < b; r++) {
                const bool there = inverse[j * b + c] > 0.0F && inverse[j * b + r] > 0.0F;
                out->idx[at] = (int32_t)(j * b + r);
                out->val[at++] = there ? A->diag[j * size + r * b + c] : r == c ? 1.0 : 0.0;
            }
            for (int64_t e = below.ptr[j]; e < below.ptr[j + 1]; e++)
                for (int r = 0; r < b; r++) {
                    const int64_t i = below.node[e] * (int64_t)b + r;
                    const bool there = inverse[j * b + c] > 0.0F && inverse[i] > 0.0F;
                    out->idx[at] = (int32_t)i;
                    out->val[at++] = there ? A->off[below.at[e] * size + r * b + c] : 0.0;
                }
            out->ptr[j * b + c + 1] = at;
        }
    uz_below_clear(&below);
    return status;
}

/* ------------------------------------------------------------------- product */

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef float four_floats __attribute__((vector_size(16), aligned(4), may_alias));
typedef int32_t four_rests __attribute__((vector_size(16), aligned(4), may_alias));

/* Numbers of A, whole or in two parts. */
typedef struct {
    const double *whole;
    const float *single;
    uz_rests rest;
} numbers;

static inline __attribute__((always_inline)) void read_row(four *row, const numbers *of, int64_t at, bool parted)
{
    if (parted)
        *row = __builtin_convertvector(*(const four_floats *)(of->single + at), four) +
               of->rest.unit * __builtin_convertvector(*(const four_rests *)(of->rest.value + at), four);
    else
        *row = *(const four *)(of->whole + at);
}

/* y = A x: places of A, its numbers in `off` and `diag`. */
typedef struct product {
    double *y;
    const uz_blocks *A;
    numbers off, diag;
    const double *x;
    int lanes;
    void (*multiply)(const struct product *p, int64_t first, int64_t end);
} product;

/* Each block is read once, for both triangles and all lanes. Rows of a block are read as four numbers: what follows
 * them counts for nothing, as the fourth number of a node is 0. */
static inline __attribute__((always_inline)) void multiply(const product *p, int64_t first, int64_t end, int b,
                                                           int lanes, bool parted)
{
    const uz_blocks *A = p->A;
    const double *x = p->x;
    double *y = p->y;
    for (int64_t i = first; i < end; i++) {
        four mine[UZ_LANES_MOST], sum[UZ_LANES_MOST][3];
        for (int l = 0; l < lanes; l++) {
            mine[l] = *(const four *)(x + 4 * (i * lanes + l));
            for (int r = 0; r < b; r++) {
                read_row(&sum[l][r], &p->diag, (i * b + r) * b, parted && !p->diag.whole);
                sum[l][r] *= mine[l];
            }
        }
        for (int64_t e = A->ptr[i]; e < A->ptr[i + 1]; e++) {
            const double *from = x + 4 * lanes * (int64_t)A->idx[e];
            double *to = y + 4 * lanes * (int64_t)A->idx[e];
            four row[3];
            for (int r = 0; r < b; r++)
                read_row(&row[r], &p->off, (e * b + r) * b, parted);
            for (int l = 0; l < lanes; l++) {
                const four other = *(const four *)(from + 4 * l);
                four value = *(const four *)(to + 4 * l);
                for (int r = 0; r < b; r++) {
                    sum[l][r] += row[r] * other;
                    value += row[r] * mine[l][r];
                }
                *(four *)(to + 4 * l) = value;
            }
        }
        for (int l = 0; l < lanes; l++) {
            four back = {0};
            for (int r = 0; r < b; r++)
                back[r] = (sum[l][r][0] + sum[l][r][1]) + (sum[l][r][2] + sum[l][r][3]);
            *(four *)(y + 4 * (i * lanes + l)) = back;
        }
    }
}

/* What the nodes from `first` to `end` know of A x, after those that they have blocks with. */
static inline __attribute__((always_inline)) void multiply_any(const product *p, int64_t first, int64_t end, int lanes,
                                                               bool parted)
{
    if (p->A->b == 3)
        multiply(p, first, end, 3, lanes, parted);
    else if (p->A->b == 2)
        multiply(p, first, end, 2, lanes, parted);
    else
        multiply(p, first, end, 1, lanes, parted);
}

UZ_AVX2_FMA static void multiply_fused(const product *p, int64_t first, int64_t end)
{
    if (p->off.rest.value && p->lanes == 1)
        multiply_any(p, first, end, 1, true);
    else if (p->off.rest.value)
        multiply_any(p, first, end, UZ_LANES_MOST, true);
    else if (p->lanes == 1)
        multiply_any(p, first, end, 1, false);
    else
        multiply_any(p, first, end, UZ_LANES_MOST, false);
}

static void multiply_plain(const product *p, int64_t first, int64_t end)
{
    multiply_any(p, first, end, p->lanes, p->off.rest.value != NULL);
}

static void multiply_part(void *ctx, int part)
{
    const product *p = ctx;
    p->multiply(p, p->A->part[part], p->A->part[part + 1]);
}

static void multiply_seam(void *ctx, int seam)
{
    const product *p = ctx;
    p->multiply(p, p->A->seam[seam], p->A->seam[seam + 1]);
}

static void multiply_all(product *p)
{
    const uz_blocks *A = p->A;
    p->multiply = uz_cpu_has_avx2_fma() ? multiply_fused : multiply_plain;
    if (A->parts > 0)
        uz_aside_share(multiply_part, p, A->parts);
    if (A->seams > 0)
        uz_aside_share(multiply_seam, p, A->seams);
    else
        p->multiply(p, A->parts > 0 ? A->part[A->parts] : 0, A->nodes);
}

void uz_blocks_multiply(double *y, const uz_blocks *A, const double *x, int lanes)
{
    product p = {.y = y, .A = A, .off.whole = A->off, .diag.whole = A->diag, .x = x, .lanes = lanes};
    multiply_all(&p);
}

void uz_level_multiply_parts(double *y, const uz_level *level, const double *x, int lanes)
{
    product p = {.y = y,
                 .A = &level->A,
                 .off = {.single = level->off, .rest = level->off_rest},
                 .diag = {.whole = level->A.diag, .single = level->diag, .rest = level->diag_rest},
                 .x = x,
                 .lanes = lanes};
    multiply_all(&p);
}

/* Rests that are made at once. */
enum { AT_ONCE = 1024 };
/* Added and taken off again, it leaves the nearest whole number of what is smaller than 2^51. */
#define ROUNDER 0x1.8p52

static inline __attribute__((always_inline)) void find_rests(int32_t *rest, const double *whole, const float *single,
                                                             int64_t count, double per_unit)
{
    for (int64_t e = 0; e < count; e++) {
        const double value = (whole[e] - (double)single[e]) * per_unit, nearest = (value + ROUNDER) - ROUNDER;
        rest[e] = (int32_t)(nearest < INT32_MAX ? nearest : INT32_MAX);
    }
}

UZ_AVX2_FMA static void find_rests_wide(int32_t *rest, const double *whole, const float *single, int64_t count,
                                        double per_unit)
{
    find_rests(rest, whole, single, count, per_unit);
}

static void find_rests_narrow(int32_t *rest, const double *whole, const float *single, int64_t count, double per_unit)
{
    find_rests(rest, whole, single, count, per_unit);
}

/* Numbers as the threads that share them see that: `first` is that of the first piece. */
typedef struct {
    double *whole;
    const float *single;
    double per_unit;
    int64_t first;
} leaving;

static void leave_some(void *ctx, int64_t begin, int64_t end)
{
    const leaving *x = ctx;
    const bool wide = uz_cpu_has_avx2_fma();
    int32_t rest[AT_ONCE] = {0};
    for (int64_t e = x->first + begin; e < x->first + end; e += AT_ONCE) {
        const int64_t left = x->first + end - e, some = left < AT_ONCE ? left : AT_ONCE;
        (wide ? find_rests_wide : find_rests_narrow)(rest, x->whole + e, x->single + e, some, x->per_unit);
        memcpy((char *)x->whole + e * (int64_t)sizeof *rest, rest, (size_t)some * sizeof *rest);
    }
}

/* In their own place: a rest is half as long, so that those of as many numbers as came before take what these have
 * left. Rows are read as four of them. */
static uz_rests leave_rests(double **whole, const float *single, int64_t count)
{
    const double most = uz_long_max(count, *whole),
                 unit = ldexp(1.0, (most > 0.0 ? ilogb(most) : 0) - FLT_MANT_DIG - 31);
    leaving x = {.whole = *whole, .single = single, .per_unit = 1.0 / unit};
    for (int64_t end = AT_ONCE; x.first < count; x.first = end, end *= 2)
        uz_by_pieces(leave_some, &x, (end < count ? end : count) - x.first);
    memset((char *)*whole + count * (int64_t)sizeof(int32_t), 0, 4 * sizeof(int32_t));
    int32_t *rests = uz_realloc(*whole, count + 4, sizeof *rests);
    rests = rests ? rests : (int32_t *)(void *)*whole;
    *whole = NULL;
    return (uz_rests){rests, unit};
}

void uz_level_part_off(uz_level *level)
{
    uz_blocks *A = &level->A;
    level->off_rest = leave_rests(&A->off, level->off, A->ptr[A->nodes] * A->b * A->b);
}

void uz_level_part(uz_level *level)
{
    uz_blocks *A = &level->A;
    uz_level_part_off(level);
    level->diag_rest = leave_rests(&A->diag, level->diag, A->nodes * A->b * A->b);
}
