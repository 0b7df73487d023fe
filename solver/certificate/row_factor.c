#include "certificate/row_factor.h"

#include "certificate/row_move.h"
#include "core/alloc.h"

#include <suitesparse/camd.h>

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A pivot below this part of the row's own compliance is computed from the vector. */
#define SMALL_PIVOT 1e-6

/* Rounding of n_q - N_A'w, in units of the machine precision of its terms. */
#define ROUNDING (8.0 * DBL_EPSILON)

enum { CORRECTIONS = 2, MAX_FILL = 40000000 };

bool uz_row_factor_init(uz_row_factor *f, const uz_csc *Nt, const double *weight)
{
    const int64_t m = Nt->cols, d = Nt->rows;
    memset(f, 0, sizeof *f);
    f->Nt = Nt;
    f->weight = weight;
    f->column = uz_alloc_zero(m, sizeof *f->column);
    f->row = uz_alloc(m, sizeof *f->row);
    f->place = uz_alloc(m, sizeof *f->place);
    f->l_place = uz_alloc(m, sizeof *f->l_place);
    f->stack = uz_alloc(m, sizeof *f->stack);
    f->at = uz_alloc(d, sizeof *f->at);
    f->seen = uz_alloc_zero(m, sizeof *f->seen);
    f->marked = uz_alloc_zero(d, sizeof *f->marked);
    f->left = uz_alloc_zero(d, sizeof *f->left);
    f->size = uz_alloc(m, sizeof *f->size);
    f->w = uz_alloc_zero(m, sizeof *f->w);
    f->l = uz_alloc(m, sizeof *f->l);
    f->x = uz_alloc_zero(m, sizeof *f->x);
    if (!f->column || !f->row || !f->place || !f->l_place || !f->stack || !f->at || !f->seen || !f->marked ||
        !f->left || !f->size || !f->w || !f->l || !f->x || uz_csc_transpose(&f->N, Nt, NULL) != UZ_OK)
        return false;
    for (int64_t i = 0; i < m; i++) {
        f->place[i] = -1;
        f->size[i] = uz_row_compliance(Nt, i, weight);
    }
    return true;
}

void uz_row_factor_clear(uz_row_factor *f)
{
    for (int64_t k = 0; f->column && f->Nt && k < f->Nt->cols; k++)
        free(f->column[k].below);
    uz_free_all(f->column, f->row, f->place, f->l_place, f->stack, f->at, f->seen, f->marked, f->left, f->size, f->w,
                f->l, f->x);
    uz_csc_clear(&f->N);
    memset(f, 0, sizeof *f);
}

void uz_row_factor_order(uz_row_factor *f, int64_t *rows, int64_t n)
{
    const uz_csc *Nt = f->Nt;
    int64_t *number = f->stack, *ptr = uz_alloc(n + 1, sizeof *ptr), *idx = NULL, *order = uz_alloc(n, sizeof *order);
    for (int64_t i = 0; i < Nt->cols; i++)
        number[i] = -1;
    for (int64_t k = 0; k < n; k++)
        number[rows[k]] = k;
    /* the pattern of N_A W N_A', counted first */
    for (int fill = 0; ptr && order && fill < 2; fill++) {
        int64_t count = 0;
        for (int64_t k = 0; k < n && count <= MAX_FILL; k++) {
            ptr[k] = count;
            int64_t found = 0;
            for (int64_t e = Nt->ptr[rows[k]]; e < Nt->ptr[rows[k] + 1]; e++)
                for (int64_t s = f->N.ptr[Nt->idx[e]]; s < f->N.ptr[Nt->idx[e] + 1]; s++) {
                    int64_t other = number[f->N.idx[s]];
                    if (other < 0 || f->seen[other])
                        continue;
                    f->seen[other] = true;
                    f->l_place[found++] = other;
                    if (fill)
                        idx[count] = other;
                    count++;
                }
            for (int64_t s = 0; s < found; s++)
                f->seen[f->l_place[s]] = false;
        }
        ptr[n] = count;
        if (count > MAX_FILL || (!fill && !(idx = uz_alloc(count, sizeof *idx))))
            break;
        if (fill && camd_l_order(n, ptr, idx, order, NULL, NULL, NULL) >= CAMD_OK) {
            for (int64_t k = 0; k < n; k++)
                order[k] = rows[order[k]];
            memcpy(rows, order, (size_t)n * sizeof *rows);
        }
    }
    uz_free_all(ptr, idx, order);
}

static void backward(uz_row_factor *f, double *x)
{
    for (int64_t k = f->count - 1; k >= 0; k--) {
        const uz_row_column *c = &f->column[k];
        double sum = x[k];
        for (int64_t e = 0; e < c->count; e++)
            sum -= c->below[e].value * x[c->below[e].row];
        x[k] = sum / c->diagonal;
        f->work += (double)c->count;
    }
}

void uz_row_factor_solve(uz_row_factor *f, double *x)
{
    for (int64_t k = 0; k < f->count; k++) {
        const uz_row_column *c = &f->column[k];
        x[k] /= c->diagonal;
        for (int64_t e = 0; x[k] != 0.0 && e < c->count; e++)
            x[c->below[e].row] -= c->below[e].value * x[k];
        f->work += (double)c->count;
    }
    backward(f, x);
}

/* left += factor * n_i */
static void add_row(uz_row_factor *f, int64_t i, double factor)
{
    for (int64_t e = f->Nt->ptr[i]; e < f->Nt->ptr[i + 1]; e++) {
        const int64_t j = f->Nt->idx[e];
        if (!f->marked[j])
            f->at[f->n_left++] = j;
        f->marked[j] = true;
        f->left[j] += factor * f->Nt->val[e];
    }
    f->work += (double)(f->Nt->ptr[i + 1] - f->Nt->ptr[i]);
}

/* w from l, and left, corrected; the compliance from left. */
static void resolve(uz_row_factor *f, int64_t q)
{
    memset(f->w, 0, (size_t)f->count * sizeof *f->w);
    for (int64_t k = 0; k < f->n_l; k++)
        f->w[f->l_place[k]] = f->l[k];
    backward(f, f->w);
    for (int pass = 0;; pass++) {
        for (int64_t s = 0; s < f->n_left; s++) {
            f->left[f->at[s]] = 0.0;
            f->marked[f->at[s]] = false;
        }
        f->n_left = 0;
        add_row(f, q, 1.0);
        for (int64_t k = 0; k < f->count; k++)
            if (f->w[k] != 0.0)
                add_row(f, f->row[k], -f->w[k]);
        if (pass == CORRECTIONS)
            break;
        for (int64_t k = 0; k < f->count; k++) {
            double sum = 0.0;
            for (int64_t e = f->Nt->ptr[f->row[k]]; e < f->Nt->ptr[f->row[k] + 1]; e++)
                sum += f->Nt->val[e] * f->weight[f->Nt->idx[e]] * f->left[f->Nt->idx[e]];
            f->x[k] = sum;
        }
        uz_row_factor_solve(f, f->x);
        for (int64_t k = 0; k < f->count; k++) {
            f->w[k] += f->x[k];
            f->x[k] = 0.0;
        }
    }
    f->compliance = 0.0;
    for (int64_t s = 0; s < f->n_left; s++)
        f->compliance += f->left[f->at[s]] * f->weight[f->at[s]] * f->left[f->at[s]];
    double size = sqrt(f->size[q]);
    for (int64_t k = 0; k < f->count; k++)
        size += fabs(f->w[k]) * sqrt(f->size[f->row[k]]);
    f->dependent = !(f->compliance > ROUNDING * ROUNDING * size * size);
}

void uz_row_factor_press(uz_row_factor *f, int64_t q, bool in_full)
{
    /* x = N_A W n_q, and in l_place, from `top` on, where L^-1 x will not be zero: the paths of the elimination tree
     * from its entries, each place behind those that it needs */
    int64_t top = f->Nt->cols;
    for (int64_t e = f->Nt->ptr[q]; e < f->Nt->ptr[q + 1]; e++) {
        const int64_t j = f->Nt->idx[e];
        const double factor = f->Nt->val[e] * f->weight[j];
        f->work += (double)(f->N.ptr[j + 1] - f->N.ptr[j]);
        for (int64_t s = f->N.ptr[j]; s < f->N.ptr[j + 1]; s++) {
            int64_t k = f->place[f->N.idx[s]], length = 0;
            if (k < 0)
                continue;
            f->x[k] += factor * f->N.val[s];
            for (; k < f->count && !f->seen[k]; k = f->column[k].count > 0 ? f->column[k].below[0].row : f->count) {
                f->seen[k] = true;
                f->stack[length++] = k;
            }
            while (length > 0)
                f->l_place[--top] = f->stack[--length];
        }
    }
    f->n_l = 0;
    f->compliance = f->size[q];
    for (int64_t s = top; s < f->Nt->cols; s++) {
        const int64_t k = f->l_place[s];
        const uz_row_column *c = &f->column[k];
        const double value = f->x[k] / c->diagonal;
        f->x[k] = 0.0;
        f->seen[k] = false;
        for (int64_t e = 0; e < c->count; e++)
            f->x[c->below[e].row] -= c->below[e].value * value;
        f->work += (double)c->count;
        f->compliance -= value * value;
        f->l_place[f->n_l] = k;
        f->l[f->n_l++] = value;
    }
    f->dependent = !(f->compliance > SMALL_PIVOT * f->size[q]);
    if (f->size[q] > 0.0 && (in_full || f->dependent))
        resolve(f, q);
}

bool uz_row_factor_join(uz_row_factor *f, int64_t q)
{
    for (int64_t s = 0; s < f->n_l; s++) {
        uz_row_column *c = &f->column[f->l_place[s]];
        if (c->count == c->room) {
            const int64_t room = c->room ? 2 * c->room : 4;
            uz_row_entry *below = uz_realloc(c->below, room, sizeof *below);
            if (!below)
                return uz_row_factor_keep(f, f->count), false;
            c->below = below;
            c->room = room;
        }
        c->below[c->count++] = (uz_row_entry){f->count, f->l[s]};
    }
    f->column[f->count].count = 0;
    f->column[f->count].diagonal = sqrt(f->compliance);
    f->row[f->count] = q;
    f->place[q] = f->count++;
    return true;
}

void uz_row_factor_keep(uz_row_factor *f, int64_t count)
{
    while (f->count > count)
        f->place[f->row[--f->count]] = -1;
    for (int64_t k = 0; k < count; k++)
        while (f->column[k].count > 0 && f->column[k].below[f->column[k].count - 1].row >= count)
            f->column[k].count--;
}
