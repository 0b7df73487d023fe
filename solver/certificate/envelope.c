#include "certificate/envelope.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
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
    free(g.first);
    free(g.next);
    free(order);
    free(mark);
    return room;
}

static bool make_room(uz_envelope *f, const uz_csc *A)
{
    const int64_t n = f->n;
    for (int64_t i = 0; i < n; i++)
        f->first[i] = i;
    for (int64_t j = 0; j < n; j++)
        for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++) {
            const int64_t a = f->place[A->idx[q]], b = f->place[j], row = a > b ? a : b, column = a > b ? b : a;
            f->first[row] = column < f->first[row] ? column : f->first[row];
        }
    f->start[0] = 0;
    for (int64_t i = 0; i < n; i++)
        f->start[i + 1] = f->start[i] + i - f->first[i] + 1;
    f->L = uz_alloc_zero(f->start[n], sizeof *f->L);
    return f->L != NULL;
}

/* Row i of L, from those above it. */
static double eliminate(uz_envelope *f, int64_t i)
{
    double *row = f->L + f->start[i] - f->first[i];
    for (int64_t j = f->first[i]; j < i; j++) {
        const double *other = f->L + f->start[j] - f->first[j];
        const int64_t from = f->first[i] > f->first[j] ? f->first[i] : f->first[j];
        row[j] = (row[j] - uz_dot(j - from, row + from, other + from)) / other[j];
    }
    const double *own = row + f->first[i];
    return row[i] - uz_dot(i - f->first[i], own, own);
}

uz_status uz_envelope_factor(uz_envelope *out, bool *definite, const uz_csc *A, const double *size, double least,
                             uz_error *err)
{
    const int64_t n = A->cols;
    *definite = false;
    *out = (uz_envelope){.n = n};
    out->place = uz_alloc(n, sizeof *out->place);
    out->first = uz_alloc(n, sizeof *out->first);
    out->start = uz_alloc(n + 1, sizeof *out->start);
    double *own = uz_alloc(n, sizeof *own);
    const bool room = out->place && out->first && out->start && own && order_dofs(out->place, A) && make_room(out, A);
    for (int64_t j = 0; j < n && room; j++) {
        own[out->place[j]] = size[j];
        for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++) {
            const int64_t a = out->place[A->idx[q]], b = out->place[j], row = a > b ? a : b, column = a > b ? b : a;
            out->L[out->start[row] + column - out->first[row]] = A->val[q];
        }
    }
    bool good = room;
    for (int64_t i = 0; i < n && good; i++) {
        const double pivot = eliminate(out, i);
        good = pivot > least * own[i];
        out->L[out->start[i + 1] - 1] = good ? sqrt(pivot) : NAN;
    }
    free(own);
    *definite = good;
    return room ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the factor of %lld dofs", (long long)n);
}

void uz_envelope_forward(double *x, const uz_envelope *f, double *room)
{
    for (int64_t j = 0; j < f->n; j++)
        room[f->place[j]] = x[j];
    for (int64_t i = 0; i < f->n; i++) {
        const double *row = f->L + f->start[i] - f->first[i];
        room[i] -= uz_dot(i - f->first[i], row + f->first[i], room + f->first[i]);
        room[i] /= row[i];
    }
    memcpy(x, room, (size_t)f->n * sizeof *x);
}

void uz_envelope_clear(uz_envelope *factor)
{
    free(factor->place);
    free(factor->first);
    free(factor->start);
    free(factor->L);
    memset(factor, 0, sizeof *factor);
}
