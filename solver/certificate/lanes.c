#include "certificate/lanes.h"

#include "certificate/bound.h"
#include "certificate/certificate.h"
#include "certificate/feasible.h"
#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/double_double.h"
#include "core/alloc.h"
#include "core/cpu.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

/* Half of a row of lanes: what a register holds. */
typedef double lanes __attribute__((vector_size(32), aligned(8)));
typedef int64_t lane_bits __attribute__((vector_size(32), aligned(8)));
enum { WIDTH = UZ_CERTIFY_LANES, HALVES = WIDTH / 4 };

/* Sums over the dofs, for each lane. */
typedef struct {
    lanes stiffness, load, load_low, load_size, work, work_size, change, change_size, correction_energy;
    lanes e_square, weighted, noise, force, sizes, residuals;
    lanes largest; /* not a sum: of |u_j| */
} sums;

struct uz_lane_certifier {
    uz_certify_input in;
    uz_inverse_norms inverse_norms;
    const uz_csc *K, *N;
    double steepest;      /* the largest |N_ij| */
    double *weight;       /* d */
    int64_t n_b;          /* dofs that N touches */
    int64_t *dof;         /* n_b */
    int64_t *place;       /* d: of a dof among them, -1: it is not */
    double *weight_b;     /* n_b */
    uz_csc Nt_b;          /* n_b x m */
    uz_csc K_b;           /* d x n_b: the columns of K at these dofs, both triangles */
    uz_feasible feasible; /* on n_b dofs */
    double *u_b;          /* n_b */
    double *c;            /* n_b x WIDTH: corrections */
    double *Kc;           /* d x WIDTH; rows that no contact dof couples to stay 0 */
    double *r;            /* m x WIDTH */
    double *hi, *lo;      /* d x WIDTH: zero between calls */
    double *E;            /* d x WIDTH: residuals; NULL where no solve asks for them */
    sums sum[HALVES];
};

/* What the contact couples: its dofs, N' on them and the columns of K. */
static uz_status compress(uz_lane_certifier *c, uz_error *err)
{
    uz_status status = uz_touched_dofs(&c->Nt_b, &c->dof, c->N, err);
    if (status != UZ_OK)
        return status;
    c->n_b = c->Nt_b.rows;
    for (int64_t j = 0; j < c->K->cols; j++)
        c->place[j] = -1;
    for (int64_t b = 0; b < c->n_b; b++) {
        c->place[c->dof[b]] = b;
        c->weight_b[b] = c->weight[c->dof[b]];
    }
    /* the entries of K in the columns of contact dofs: counted, then listed */
    const uz_csc *K = c->K;
    int64_t count = 0, *row = NULL, *column = NULL;
    double *value = NULL;
    for (int pass = 0; status == UZ_OK && pass < 2; pass++) {
        int64_t at = 0;
        for (int64_t j = 0; j < K->cols; j++)
            for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
                const int64_t i = K->idx[k], ends[2][2] = {{i, c->place[j]}, {j, i == j ? -1 : c->place[i]}};
                for (int side = 0; side < 2; side++) {
                    if (ends[side][1] < 0)
                        continue;
                    if (pass == 1) {
                        row[at] = ends[side][0];
                        column[at] = ends[side][1];
                        value[at] = K->val[k];
                    }
                    at++;
                }
            }
        count = at;
        if (pass == 0 && !((row = uz_alloc(count, sizeof *row)) && (column = uz_alloc(count, sizeof *column)) &&
                           (value = uz_alloc(count, sizeof *value))))
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)K->cols);
    }
    if (status == UZ_OK)
        status = uz_csc_from_triplets(&c->K_b, K->cols, c->n_b, count, row, column, value, err);
    uz_free_all(row, column, value);
    return status;
}

uz_status uz_lane_certifier_create(uz_lane_certifier **out, const uz_certify_input *in, uz_inverse_norms inverse_norms,
                                   uz_error *err)
{
    const uz_csc *K = in->K, *N = in->N;
    const int64_t d = K->cols;
    *out = NULL;
    uz_lane_certifier *c = uz_alloc_zero(1, sizeof *c);
    if (!c)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify");
    c->in = *in;
    c->inverse_norms = inverse_norms;
    c->K = K;
    c->N = N;
    c->weight = uz_alloc(d, sizeof(double));
    c->place = uz_alloc(d, sizeof(int64_t));
    c->weight_b = uz_alloc(d, sizeof(double));
    c->u_b = uz_alloc(d, sizeof(double));
    c->r = uz_alloc_zero(N->rows, WIDTH * sizeof(double));
    c->Kc = uz_alloc_zero(d, WIDTH * sizeof(double));
    c->hi = uz_alloc_zero(d, WIDTH * sizeof(double));
    c->lo = uz_alloc_zero(d, WIDTH * sizeof(double));
    c->E = in->spares ? NULL : uz_alloc(d, WIDTH * sizeof(double));
    bool ok = c->weight && c->place && c->weight_b && c->u_b && c->r && c->Kc && c->hi && c->lo && (c->E || in->spares);
    uz_status status = UZ_OK;
    if (ok) {
        for (int64_t j = 0; j < d; j++)
            c->weight[j] = uz_dof_weight(K, j);
        c->in.terms = in->terms > 0 ? in->terms : uz_most_terms(K, NULL, N);
        ok = c->in.terms > 0;
        c->steepest = N->rows > 0 ? uz_bound_largest(N->val, N->ptr[N->cols]) : 0.0;
        status = compress(c, err);
    }
    if (ok && status == UZ_OK) {
        c->c = uz_alloc_zero(c->n_b, WIDTH * sizeof(double));
        ok = uz_feasible_init(&c->feasible, &c->Nt_b, c->weight_b) && c->c;
    }
    if (status == UZ_OK && !ok)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)d);
    if (status == UZ_OK)
        *out = c;
    else
        uz_lane_certifier_free(c);
    return status;
}

void uz_lane_certifier_free(uz_lane_certifier *c)
{
    if (!c)
        return;
    uz_feasible_clear(&c->feasible);
    uz_csc_clear(&c->Nt_b);
    uz_csc_clear(&c->K_b);
    uz_free_all(c->weight, c->dof, c->place, c->weight_b, c->u_b, c->c, c->Kc, c->r, c->hi, c->lo, c->E, c);
}

/* hi + lo += a x, lane by lane: dd_add_product of double_double.h. */
UZ_INLINE void add_product(lanes *hi, lanes *lo, double a, const lanes *x, int fused)
{
    const lanes product = a * *x;
    lanes error = {0.0};
    for (int l = 0; l < 4; l++)
        error[l] = fused ? __builtin_fma(a, (*x)[l], -product[l]) : product_error_split(a, (*x)[l], product[l]);
    const lanes sum = *hi + product;
    const lanes back = sum - *hi;
    const lanes kept = sum - back;
    *lo += ((*hi - kept) + (product - back)) + error;
    *hi = sum;
}

/* sum += |x| */
UZ_INLINE void add_magnitude(lanes *sum, const lanes *x)
{
    *sum += (lanes)((lane_bits)*x & INT64_MAX);
}

/* Row j is complete: what it adds to the sums. hi + lo: (K u)_j, lost. */
UZ_INLINE void finish_row(uz_lane_certifier *c, int half, int64_t j, lanes *hi, lanes *lo, const lanes *u,
                          const lanes *p, int fused)
{
    sums *s = &c->sum[half];
    const uz_csc *N = c->N;
    const int64_t b = c->place[j];
    const double weight = c->weight[j], stiff = 1.0 / weight;
    const lanes Ku = *hi + *lo, Kc = ((const lanes *)c->Kc)[j * HALVES + half];
    lanes forces = {0.0};
    add_magnitude(&forces, &Ku);
    add_magnitude(&forces, p);
    const lanes rest = *hi - *p, back_p = rest - *hi, kept = rest - back_p; /* hi + lo -= p */
    *lo += (*hi - kept) + (-*p - back_p);
    *hi = rest;
    if (b >= 0) {
        const lanes moved = ((const lanes *)c->c)[b * HALVES + half];
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            add_product(hi, lo, -N->val[k], (const lanes *)c->r + (int64_t)N->idx[k] * HALVES + half, fused);
        s->change += moved * (Ku - *p + 0.5 * Kc);
        s->change_size += (lanes)((lane_bits)moved & INT64_MAX) * (forces + (lanes)((lane_bits)Kc & INT64_MAX));
        s->correction_energy += moved * Kc;
        add_magnitude(&s->sizes, &moved);
    }
    const lanes e_u = *hi + *lo;
    const lanes e = e_u + Kc;
    if (c->E)
        ((lanes *)c->E)[j * HALVES + half] = e;
    s->stiffness += *u * Ku;
    const lanes load = *u * *p, work = *u * e_u, sum = s->load + load, back = sum - s->load;
    lanes error = {0.0};
    for (int l = 0; l < 4; l++)
        error[l] = fused ? __builtin_fma((*u)[l], (*p)[l], -load[l]) : product_error_split((*u)[l], (*p)[l], load[l]);
    s->load_low += ((s->load - (sum - back)) + (load - back)) + error;
    s->load = sum;
    add_magnitude(&s->load_size, &load);
    s->work += work;
    add_magnitude(&s->work_size, &work);
    s->force += *p * *p;
    s->e_square += e_u * e_u;
    s->weighted += weight * e * e;
    s->noise += stiff * *u * *u + weight * forces * forces;
    add_magnitude(&s->sizes, u);
    const lane_bits magnitude = (lane_bits)*u & INT64_MAX, more = (lanes)magnitude > s->largest;
    s->largest = (lanes)((magnitude & more) | ((lane_bits)s->largest & ~more));
    add_magnitude(&s->sizes, &e_u);
    add_magnitude(&s->residuals, &e_u);
}

/* One pass over the lower triangle. When column j is done so is row j: the columns before it have added their part. */
UZ_INLINE void pass(uz_lane_certifier *c, const double *U, const double *P, int fused)
{
    const uz_csc *K = c->K;
    const lanes *u = (const lanes *)U, *p = (const lanes *)P, zero = {0.0};
    lanes *hi = (lanes *)c->hi, *lo = (lanes *)c->lo;
    for (int64_t j = 0; j < K->cols; j++) {
        const int64_t at = j * HALVES;
        const lanes u0 = u[at], u1 = u[at + 1];
        lanes hi0 = hi[at], lo0 = lo[at], hi1 = hi[at + 1], lo1 = lo[at + 1];
        int64_t k = K->ptr[j];
        if (k < K->ptr[j + 1] && K->idx[k] == j) {
            add_product(&hi0, &lo0, K->val[k], &u0, fused);
            add_product(&hi1, &lo1, K->val[k++], &u1, fused);
        }
        for (; k < K->ptr[j + 1]; k++) {
            const int64_t i = (int64_t)K->idx[k] * HALVES;
            const double a = K->val[k];
            add_product(&hi0, &lo0, a, u + i, fused);
            add_product(&hi1, &lo1, a, u + i + 1, fused);
            add_product(hi + i, lo + i, a, &u0, fused);
            add_product(hi + i + 1, lo + i + 1, a, &u1, fused);
        }
        hi[at] = hi[at + 1] = lo[at] = lo[at + 1] = zero;
        finish_row(c, 0, j, &hi0, &lo0, &u0, p + at, fused);
        finish_row(c, 1, j, &hi1, &lo1, &u1, p + at + 1, fused);
    }
}

UZ_AVX2_FMA static void pass_fused(uz_lane_certifier *c, const double *U, const double *P)
{
    pass(c, U, P, 1);
}

/* What a lane's answer has to do with the contact: gaps, correction, reactions; their part of the terms. */
static bool prepare_lane(uz_lane_certifier *c, int lane, const uz_lane_answer *a, const double *U,
                         uz_energy_sums *energies, uz_bound_terms *terms)
{
    const uz_csc *N = c->N;
    uz_feasible *f = &c->feasible;
    const uz_csc *K_b = &c->K_b;
    for (int64_t b = 0; b < c->n_b; b++)
        c->u_b[b] = U[c->dof[b] * WIDTH + lane];
    for (int64_t i = 0; i < f->m; i++) {
        a->g[i] = uz_gap_of_row(&c->Nt_b, i, a->h, c->u_b, NULL);
        c->r[i * WIDTH + lane] = a->r[i];
    }
    f->u = c->u_b;
    f->h = a->h;
    bool feasible = uz_make_feasible(f, a->r) && !f->pushed; /* what pushes say of r is for uz_certify */
    for (int64_t b = 0; b < c->n_b; b++) {
        double force = 0.0;
        for (int64_t k = N->ptr[c->dof[b]]; k < N->ptr[c->dof[b] + 1]; k++)
            force += fabs(N->val[k] * a->r[N->idx[k]]);
        energies->rows += force * c->weight_b[b] * force;
        energies->correction += f->correction[b] / c->weight_b[b] * f->correction[b];
        c->c[b * WIDTH + lane] = f->correction[b];
    }
    /* Kc is zero but for the rows that contact dofs couple to */
    for (int64_t k = 0; k < K_b->ptr[K_b->cols]; k++)
        c->Kc[(int64_t)K_b->idx[k] * WIDTH + lane] = 0.0;
    for (int64_t b = 0; b < K_b->cols; b++)
        for (int64_t k = K_b->ptr[b]; k < K_b->ptr[b + 1]; k++)
            c->Kc[(int64_t)K_b->idx[k] * WIDTH + lane] += K_b->val[k] * c->c[b * WIDTH + lane];
    for (int64_t i = 0; i < f->m; i++)
        energies->pressed -= a->r[i] * f->size[i];
    terms->complementarity = uz_feasible_complementarity(f, a->r, feasible);
    terms->settled = feasible ? f->exact.length : 0.0;
    terms->pressed = terms->settled > 0.0 ? uz_feasible_complementarity(f, a->r, false) : 0.0;
    return feasible;
}

/* What uz_certify_distance asks of a lane: squares of the lanes come from one solve. */
typedef struct {
    const uz_lane_certifier *c;
    double square; /* INFINITY: unknown */
} lane_solve;

static uz_status lane_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    (void)e, (void)enough, (void)err;
    *value = ((lane_solve *)ctx)->square;
    return *value < INFINITY ? UZ_OK : UZ_ERR_CANCELLED;
}

static uz_status lane_doubt(void *ctx, double *doubt, uz_error *err)
{
    const uz_certify_input *in = &((lane_solve *)ctx)->c->in;
    return in->measure_doubt(in->ctx, doubt, err);
}

static void conclude_lane(const uz_lane_certifier *c, int lane, uz_lane_answer *a, bool feasible, double solved,
                          uz_energy_sums *energies, uz_bound_terms *terms)
{
    const sums *s = &c->sum[lane / 4];
    const int l = lane % 4;
    lane_solve solve = {c, solved};
    bool spared;
    uz_certify_input in = c->in;
    in.inverse_norm = lane_norm;
    in.measure_doubt = lane_doubt;
    in.ctx = &solve;
    in.sharp = a->sharp;
    in.moved = a->moved;
    in.acting = a->acting;
    in.whole_norm = a->whole_norm;
    energies->load = s->load[l];
    energies->load_low = s->load_low[l];
    energies->load_size = s->load_size[l];
    energies->work = s->work[l];
    energies->work_size = s->work_size[l];
    energies->noise = s->noise[l];
    energies->change_size = s->change_size[l];
    /* where squares leave the range of double, uz_certify, which scales them, has the word */
    const double residuals = s->residuals[l], force = s->force[l];
    const bool plain = s->sizes[l] < 1e130 && (residuals == 0.0 || (residuals > 1e-130 && residuals < 1e130)) &&
                       (force == 0.0 || (force > 1e-260 && force < 1e260));
    if (!feasible || !plain ||
        uz_certify_distance(&terms->square, &spared, &in, NULL, c->K->cols, s->weighted[l], s->stiffness[l], energies,
                            NULL) != UZ_OK)
        return;
    terms->moved = a->moved;
    terms->acting = a->acting;
    terms->whole_norm = a->whole_norm;
    terms->stiffness = s->stiffness[l];
    terms->change = s->change[l];
    terms->correction_energy = s->correction_energy[l] + uz_bound_rounding(energies, c->K->cols);
    uz_bound_energy(terms, energies, a->r, a->g, a->h, c->K->cols, c->feasible.m);
    terms->e1 = sqrt(s->e_square[l]);
    terms->force = sqrt(s->force[l]);
    terms->span = c->steepest * s->largest[l];
    terms->anything = s->sizes[l] > 0.0;
    memset(&a->certificate, 0, sizeof a->certificate);
    uz_bound_conclude(&a->certificate, terms, feasible, a->r, a->g, a->h, c->feasible.m);
    a->certified = !spared || !uz_bound_blames_distance(&a->certificate, terms->square, 2.0 * a->sharp);
}

void uz_certify_lanes(uz_lane_certifier *c, uz_lane_answer *answers, int count, const double *U, const double *P)
{
    uz_bound_terms terms[WIDTH] = {{0}};
    bool feasible[WIDTH] = {false};
    uz_energy_sums energies[WIDTH] = {{0}};
    double squares[WIDTH];
    for (int l = 0; l < count; l++) {
        energies[l].terms = c->in.terms;
        terms[l].positive_part = uz_cut_reactions(answers[l].r, c->feasible.m);
        answers[l].certified = false;
        feasible[l] = prepare_lane(c, l, &answers[l], U, &energies[l], &terms[l]);
    }
    memset(c->sum, 0, sizeof c->sum);
    if (uz_cpu_has_avx2_fma())
        pass_fused(c, U, P);
    else
        pass(c, U, P, 0);
    const bool solved = c->E && c->inverse_norms(c->in.ctx, squares, c->E, NULL) == UZ_OK;
    for (int l = 0; l < count; l++)
        conclude_lane(c, l, &answers[l], feasible[l], solved ? squares[l] : INFINITY, &energies[l], &terms[l]);
}
