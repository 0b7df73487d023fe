/* sparse.c: what the forms without a dense operator share. */
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/error.h"
#include "law/sign.h"
#include "linalg/pieces.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* dual->touched. */
static bool leave_out_zeros(uz_dual *dual)
{
    uz_csc *out = &((uz_sparse *)dual)->touched;
    const uz_csc *N = &dual->N;
    const int64_t entries = N->ptr[N->cols], most = entries < N->cols ? entries : N->cols;
    *out = (uz_csc){.rows = N->rows, .idx = N->idx, .val = N->val, .ptr = uz_alloc(most + 1, sizeof *out->ptr)};
    if (!out->ptr)
        return false;
    out->ptr[0] = 0;
    for (int64_t j = 0; j < N->cols; j++)
        if (N->ptr[j + 1] > N->ptr[j])
            out->ptr[++out->cols] = N->ptr[j + 1];
    dual->touched = out;
    dual->bytes += 8 * (size_t)(most + 1);
    return true;
}

static void clear_bounds(uz_bounds *bounds)
{
    uz_free_all(bounds->dof, bounds->scale);
    memset(bounds, 0, sizeof *bounds);
}

uz_status uz_sparse_create(uz_dual *dual, const uz_stop *stop, uz_error *err)
{
    (void)stop;
    uz_bounds *bounds = &((uz_sparse *)dual)->bounds;
    const uz_csc *Nt = &dual->Nt;
    const int64_t m = dual->m;
    bool single = true; /* nonzero entry in each row */
    bounds->dof = uz_alloc(m, sizeof *bounds->dof);
    bounds->scale = uz_alloc(m, sizeof *bounds->scale);
    if (!leave_out_zeros(dual) || !bounds->dof || !bounds->scale)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)m);
    for (int64_t i = 0; single && i < m; i++) {
        bounds->scale[i] = 0.0;
        for (int64_t k = Nt->ptr[i]; single && k < Nt->ptr[i + 1]; k++) {
            if (Nt->val[k] == 0.0)
                continue;
            single = bounds->scale[i] == 0.0;
            bounds->dof[i] = Nt->idx[k];
            bounds->scale[i] = Nt->val[k];
        }
        single = single && bounds->scale[i] != 0.0;
    }
    if (!single)
        clear_bounds(bounds);
    else
        dual->bytes += 16 * (size_t)m;
    dual->rows_may_depend = dual->can->exact && !bounds->dof;
    return UZ_OK;
}

void uz_sparse_clear(uz_dual *dual)
{
    uz_sparse *own = (uz_sparse *)dual;
    clear_bounds(&own->bounds);
    free(own->touched.ptr);
    own->touched.ptr = NULL;
}

uz_status uz_sparse_load_begin(uz_sparse_load *x, uz_error *err)
{
    uz_dual_load *load = &x->load;
    int64_t d = load->dual->d, room = load->dual->m > d ? load->dual->m : d;
    x->base = uz_alloc_zero(d, sizeof(double));     /* iterations begin there, */
    x->response = uz_alloc_zero(d, sizeof(double)); /* and there */
    x->work = uz_alloc_zero(room, sizeof(double));
    x->work2 = uz_alloc_zero(room, sizeof(double));
    load->correction = uz_alloc_zero(d, sizeof(double));
    load->kept = uz_alloc_zero(d, sizeof(double));
    load->bytes = 8 * (6 * (size_t)d + 2 * (size_t)load->dual->m);
    if (x->base && x->response && x->work && x->work2 && load->correction && load->kept)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)d);
}

uz_status uz_sparse_load_end(uz_sparse_load *x, const double *p, bool solved, uz_error *err)
{
    uz_dual_load *load = &x->load;
    const uz_dual *dual = load->dual;
    const uz_bounds *bounds = &((const uz_sparse *)dual)->bounds;
    load->psi0 = 0.0;
    for (int64_t j = 0; solved && j < dual->d; j++)
        load->psi0 -= 0.5 * p[j] * x->base[j];
    memcpy(load->g0, load->h, (size_t)dual->m * sizeof *load->g0);
    if (solved)
        uz_csc_gaxpy(load->g0, &dual->N, -1.0, x->base);
    if (!bounds->dof)
        return UZ_OK;
    if (!x->p) {
        if (!(x->p = uz_alloc(dual->d, sizeof *x->p)))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)dual->d);
        uz_long_copy(dual->d, x->p, p);
        load->bytes += 8 * (size_t)dual->d;
    }
    return uz_bounded_create(x, bounds, err);
}

void uz_sparse_unload(uz_sparse_load *x)
{
    uz_bounded *box = x->box;
    uz_free_all(x->p, x->base, x->response, x->work, x->work2);
    if (!box)
        return;
    uz_free_all(box->dof, box->top, box->bottom, box->u, box->size, box->point, box->r, box->upper, box->lower,
                box->holder, box->fixed);
    free(box);
}

void uz_sparse_multiply(const uz_dual_load *load, double *y, const double *x)
{
    uz_multigrid_room *room = ((const uz_sparse_load *)load)->room;
    if (room) {
        const uz_multigrid *mg = load->dual->amg->mg;
        mg->kind->multiply(mg, load->K, room, y, x);
        return;
    }
    memset(y, 0, (size_t)load->dual->d * sizeof *y);
    uz_csc_symv(y, load->K, 1.0, x);
}

/* c'K c, where few entries of c (d) are not 0; room (d). */
static double correction_energy(const uz_dual_load *load, const double *c, double *room)
{
    const uz_csc *K = load->K, *Nt = &load->dual->Nt;
    double square = 0.0;
    bool any = false;
    for (int64_t q = 0; q < Nt->ptr[Nt->cols] && !any; q++) /* it is 0 elsewhere */
        any = c[Nt->idx[q]] != 0.0;
    if (any && !uz_sparse_has_entries(load->dual)) {
        uz_sparse_multiply(load, room, c);
        square = uz_long_dot(K->cols, c, room);
    }
    for (int64_t j = 0; j < K->cols && any && uz_sparse_has_entries(load->dual); j++)
        for (int64_t k = K->ptr[j]; c[j] != 0.0 && k < K->ptr[j + 1]; k++)
            square += (K->idx[k] == j ? 1.0 : 2.0) * K->val[k] * c[K->idx[k]] * c[j];
    return square;
}

enum { MAX_SWEEPS = 60 };

static double column_dot(const uz_csc *Nt, int64_t i, const double *x)
{
    double sum = 0.0;
    for (int64_t k = Nt->ptr[i]; k < Nt->ptr[i + 1]; k++)
        sum += Nt->val[k] * x[Nt->idx[k]];
    return sum;
}

/* Finds c with (N c)_i = g_i on rows to close and (N c)_i <= g_i on the others, by sweeps over the rows that move along
 * W n_i (Kaczmarz 1937, with inequalities as Hildreth 1957); no bound where rows are left that penetrate by more than
 * rounding. */
uz_status uz_sparse_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close)
{
    uz_sparse_load *x = (uz_sparse_load *)load;
    const uz_dual *dual = x->load.dual;
    const uz_csc *Nt = &dual->Nt;
    double *c = x->load.correction, *Nc = x->work, complementarity = 0.0, scale = 0.0;
    if (isinf(x->slack))
        return UZ_OK;
    for (int64_t q = 0; q < Nt->ptr[Nt->cols]; q++) /* others never get anything */
        c[Nt->idx[q]] = 0.0;
    for (int64_t i = 0; i < dual->m; i++)
        if (close[i] || uz_gap_penetrates(g[i]))
            scale = fmax(scale, fabs(g[i]));
    const double small = 8.0 * DBL_EPSILON * scale;
    double moved = scale;
    for (int k = 0; k < MAX_SWEEPS && moved > small; k++) {
        const bool only_lift = k >= MAX_SWEEPS / 2;
        moved = 0.0;
        for (int64_t i = 0; i < Nt->cols; i++) {
            bool closing = close[i] && !only_lift;
            double miss = g[i] - column_dot(Nt, i, c);
            double weighted = 0.0; /* n_i'W n_i */
            for (int64_t q = Nt->ptr[i]; q < Nt->ptr[i + 1]; q++)
                weighted += Nt->val[q] * Nt->val[q] * uz_sparse_weight(load->K, Nt->idx[q]);
            if (weighted <= 0.0 || (!closing && uz_gap_is_open(miss)))
                continue;
            for (int64_t q = Nt->ptr[i]; q < Nt->ptr[i + 1]; q++)
                c[Nt->idx[q]] += miss / weighted * uz_sparse_weight(load->K, Nt->idx[q]) * Nt->val[q];
            moved = fmax(moved, fabs(miss));
        }
    }
    for (int64_t i = 0; i < dual->m; i++) {
        Nc[i] = column_dot(Nt, i, c);
        if (uz_gap_penetration(g[i] - Nc[i]) > 4.0 * small)
            return UZ_OK;
    }
    for (int64_t i = 0; i < dual->m; i++)
        complementarity -= r[i] * fmax(0.0, g[i] - Nc[i]);
    /* not in work2, which has the forces that the next guess begins with */
    double distance = sqrt(fmax(0.0, correction_energy(load, c, x->work))) + x->slack;
    *bound2 = distance * distance + 2.0 * complementarity;
    return UZ_OK;
}

typedef struct {
    const uz_sparse_load *x;
    double *u;
} recovery;

static void add_response(void *ctx, int64_t begin, int64_t end)
{
    const recovery *to = ctx;
    for (int64_t j = begin; j < end; j++)
        to->u[j] = to->x->base[j] + to->x->response[j];
}

static void add_kept(void *ctx, int64_t begin, int64_t end)
{
    const recovery *to = ctx;
    for (int64_t j = begin; j < end; j++)
        to->u[j] += to->x->load.kept[j];
}

uz_status uz_sparse_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    uz_sparse_load *x = (uz_sparse_load *)load;
    int64_t d = load->dual->d;
    uz_status status = UZ_OK;
    /* The displacement of the last guess if r is its answer: no error of K^-1 on the whole body is in it. */
    bool guessed = x->known_u != NULL;
    for (int64_t i = 0; guessed && i < load->dual->m; i++)
        guessed = r[i] == x->known_r[i];
    if (guessed) {
        uz_long_copy(d, u, x->known_u);
    } else {
        status = load->dual->form->apply(load, x->work, r, err);
        uz_by_pieces(add_response, &(recovery){x, u}, d);
    }
    if (corrected)
        uz_by_pieces(add_kept, &(recovery){x, u}, d);
    return status;
}
