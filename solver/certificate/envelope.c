#include "certificate/envelope.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <stdlib.h>
#include <string.h>

/* Neighbours of each dof, both triangles. */
typedef struct {
    int64_t *first, *next; /* n + 1; */
} graph;

static bool graph_of(graph *g, const uz_csc *A)
{
    const int64_t n = A->cols;
    g->first = uz_alloc_zero(n + 2, sizeof *g->first);
    g->next = uz_alloc(2 * A->ptr[n], sizeof *g->next);
    if (!g->first || !g->next)
        return false;
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t j = 0; j < n; j++)
            for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++) {
                const int64_t i = A->idx[q];
                if (i == j)
                    continue;
                if (pass == 0) {
                    g->first[i + 2]++;
                    g->first[j + 2]++;
                } else {
                    g->next[g->first[i + 1]++] = j;
                    g->next[g->first[j + 1]++] = i;
                }
            }
        for (int64_t i = 0; i < n && pass == 0; i++)
            g->first[i + 2] += g->first[i + 1];
    }
    return true;
}

static int64_t degree(const graph *g, int64_t i)
{
    return g->first[i + 1] - g->first[i];
}

/* Breadth first from `from`, dofs of few neighbours first; order gets them from `at` on. Returns the end. */
static int64_t walk(int64_t *order, int64_t at, int64_t *mark, int64_t label, const graph *g, int64_t from)
{
    int64_t end = at;
    order[end++] = from;
    mark[from] = label;
    for (int64_t k = at; k < end; k++) {
        const int64_t begin = end;
        for (int64_t q = g->first[order[k]]; q < g->first[order[k] + 1]; q++) {
            const int64_t j = g->next[q];
            if (mark[j] == label)
                continue;
            mark[j] = label;
            int64_t to = end++;
            for (; to > begin && degree(g, order[to - 1]) > degree(g, j); to--)
                order[to] = order[to - 1];
            order[to] = j;
        }
    }
    return end;
}

/* place: n. Each part begins at a dof that is far from others: the last of a walk from anywhere, twice. */
static bool order_dofs(int64_t *place, const uz_csc *A)
{
    const int64_t n = A->cols;
    graph g = {NULL, NULL};
    int64_t *order = uz_alloc(n, sizeof *order), *mark = uz_alloc_zero(n, sizeof *mark), label = 0, end = 0;
    const bool room = order && mark && graph_of(&g, A);
    for (int64_t seed = 0; seed < n && room; seed++) {
        int64_t from = seed;
        if (mark[seed] != 0)
            continue;
        for (int pass = 0; pass < 2; pass++)
            from = order[walk(order, end, mark, ++label, &g, from) - 1];
        end = walk(order, end, mark, ++label, &g, from);
    }
    for (int64_t k = 0; k < n && room; k++)
        place[order[k]] = n - 1 - k;
    uz_free_all(g.first, g.next, order, mark);
    return room;
}

static int64_t columns(const uz_envelope *f, int64_t block)
{
    const int64_t first = block * UZ_ENVELOPE_BLOCK;
    return first + UZ_ENVELOPE_BLOCK < f->n ? UZ_ENVELOPE_BLOCK : f->n - first;
}

/* Where the envelope ends below each block, and where that begins in L. */
static void find_envelope(uz_envelope *f, const uz_csc *A)
{
    for (int64_t b = 0; b < f->blocks; b++)
        f->end[b] = b * UZ_ENVELOPE_BLOCK + columns(f, b);
    for (int64_t j = 0; j < f->n; j++)
        for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++) {
            const int64_t a = f->place[A->idx[q]], b = f->place[j], row = a > b ? a : b, column = a > b ? b : a;
            int64_t *end = &f->end[column / UZ_ENVELOPE_BLOCK];
            *end = row + 1 > *end ? row + 1 : *end;
        }
    f->start[0] = 0;
    for (int64_t b = 0; b < f->blocks; b++) { /* a row goes on to the diagonal from where it begins */
        if (b > 0 && f->end[b] < f->end[b - 1])
            f->end[b] = f->end[b - 1];
        f->start[b + 1] = f->start[b] + columns(f, b) * (f->end[b] - b * UZ_ENVELOPE_BLOCK);
    }
}

static void fill(uz_envelope *f, const uz_csc *A)
{
    for (int64_t j = 0; j < f->n; j++)
        for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++) {
            const int64_t a = f->place[A->idx[q]], b = f->place[j], row = a > b ? a : b, column = a > b ? b : a;
            const int64_t block = column / UZ_ENVELOPE_BLOCK, first = block * UZ_ENVELOPE_BLOCK;
            f->L[f->start[block] + (column - first) * (f->end[block] - first) + row - first] = A->val[q];
        }
}

/* A block less what those before it make of it, divided by its own factor. own (n): what pivots are compared with. */
static bool eliminate(uz_envelope *f, int64_t block, const double *own, double least)
{
    const int64_t first = block * UZ_ENVELOPE_BLOCK, rows = f->end[block] - first, n = columns(f, block);
    double *L = f->L + f->start[block];
    for (int64_t b = block - 1; b >= 0 && f->end[b] > first; b--) {
        const int64_t before = b * UZ_ENVELOPE_BLOCK, ld = f->end[b] - before, below = f->end[b] - first;
        const uz_outer outer = {.rows = below,
                                .n = below < n ? below : n,
                                .k = UZ_ENVELOPE_BLOCK,
                                .A = f->L + f->start[b] + first - before,
                                .ld = ld,
                                .C = L,
                                .ldc = rows,
                                .subtract = true};
        uz_block_outer(&outer);
    }
    bool good = uz_block_factor(n, rows - n, L, rows) == n;
    for (int64_t i = 0; i < n && good; i++)
        good = L[i * rows + i] * L[i * rows + i] > least * own[first + i];
    return good;
}

/* All but L. */
static bool order(uz_envelope *out, const uz_csc *A)
{
    const int64_t n = A->cols;
    *out = (uz_envelope){.n = n, .blocks = (n + UZ_ENVELOPE_BLOCK - 1) / UZ_ENVELOPE_BLOCK};
    out->place = uz_alloc(n, sizeof *out->place);
    out->end = uz_alloc(out->blocks, sizeof *out->end);
    out->start = uz_alloc(out->blocks + 1, sizeof *out->start);
    if (!out->place || !out->end || !out->start || !order_dofs(out->place, A))
        return false;
    find_envelope(out, A);
    return true;
}

double uz_envelope_bytes(const uz_envelope *f)
{
    return f->start ? 8.0 * (double)(2 * f->n + 2 * f->blocks + f->start[f->blocks]) : 0;
}

double uz_envelope_predict(const uz_csc *A)
{
    uz_envelope f;
    const double bytes = order(&f, A) ? uz_envelope_bytes(&f) : 0;
    uz_envelope_clear(&f);
    return bytes;
}

uz_status uz_envelope_factor(uz_envelope *out, bool *definite, const uz_csc *A, const double *size, double least,
                             const uz_stop *stop, uz_error *err)
{
    const int64_t n = A->cols;
    *definite = false;
    const bool ordered = order(out, A);
    double *own = ordered ? uz_alloc(n, sizeof *own) : NULL;
    out->L = own ? uz_alloc_zero(out->start[out->blocks], sizeof *out->L) : NULL;
    const bool room = out->L != NULL;
    if (room)
        fill(out, A);
    for (int64_t j = 0; j < n && room; j++)
        own[out->place[j]] = size[j];
    bool good = room;
    for (int64_t b = 0; b < out->blocks && good; b++)
        good = !uz_stop_is_due(stop) && eliminate(out, b, own, least);
    free(own);
    *definite = good;
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the factor of %lld dofs", (long long)n);
}

void uz_envelope_forward(double *x, const uz_envelope *f, double *room)
{
    for (int64_t j = 0; j < f->n; j++)
        room[f->place[j]] = x[j];
    for (int64_t b = 0; b < f->blocks; b++) {
        const int64_t first = b * UZ_ENVELOPE_BLOCK, rows = f->end[b] - first, n = columns(f, b);
        const double *L = f->L + f->start[b];
        uz_trsv_lower(n, L, rows, room + first, false);
        uz_block_gemv(rows - n, n, L + n, rows, room + first, room + first + n, false);
    }
    memcpy(x, room, (size_t)f->n * sizeof *x);
}

void uz_envelope_clear(uz_envelope *factor)
{
    uz_free_all(factor->place, factor->end, factor->start, factor->L);
    memset(factor, 0, sizeof *factor);
}
