/* cost.c: predicted seconds and bytes, and the choice that follows. */
#include "run/cost.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/clock.h"
#include "core/error.h"
#include "dual/dual.h"
#include "amg/krylov.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

/* ----------------------------------------------------------------- the machine */

enum { DENSE = 192, SPARSE = 60000, BAND = 10, REPEATS = 4 };

/* What is assumed where there is no memory to measure: a core of 2020. */
static const uz_cost_rates ASSUMED = {3e-11, 1e-9};

static double time_dense(double *Z, double *C)
{
    double best = INFINITY;
    for (int k = 0; k < REPEATS; k++) {
        double start = uz_thread_seconds();
        uz_syrk_lower_t_while(DENSE, DENSE, Z, C, NULL);
        best = fmin(best, uz_thread_seconds() - start);
    }
    return best / ((double)DENSE * DENSE * DENSE);
}

/* A lower triangle with BAND entries in a column, far enough apart to be read as those of a mesh are. */
static bool make_sparse(uz_csc *A)
{
    uz_error ignored = {0};
    if (uz_csc_init(A, SPARSE, SPARSE, (int64_t)SPARSE * BAND, &ignored) != UZ_OK)
        return false;
    int64_t at = 0;
    for (int64_t j = 0; j < SPARSE; j++) {
        A->ptr[j] = at;
        for (int64_t k = 0; k < BAND && j + k / 4 * 200 + k < SPARSE; k++) {
            A->idx[at] = j + k / 4 * 200 + k;
            A->val[at++] = 1.0;
        }
    }
    A->ptr[SPARSE] = at;
    return true;
}

static double time_sparse(const uz_csc *A, const double *x, double *y)
{
    double best = INFINITY;
    for (int k = 0; k < REPEATS; k++) {
        double start = uz_thread_seconds();
        uz_csc_symv(y, A, 1.0, x);
        best = fmin(best, uz_thread_seconds() - start);
    }
    return best / (double)A->ptr[A->cols];
}

static uz_cost_rates measured; /* written once, under the guard */

static void measure(void)
{
    uz_csc A = {0};
    double *room = uz_alloc_zero(2 * (DENSE * DENSE + SPARSE), sizeof *room);
    measured = ASSUMED;
    if (room) {
        for (int64_t i = 0; i < DENSE * DENSE; i++)
            room[i] = 1.0 / (double)(1 + i % 7);
        measured.flop_s = time_dense(room, room + DENSE * DENSE);
        if (make_sparse(&A))
            measured.entry_s = time_sparse(&A, room, room + 2 * DENSE * DENSE);
    }
    uz_csc_clear(&A);
    free(room);
}

/* A property of the machine, not of any call: the only thing here that outlives one. */
uz_cost_rates uz_cost_measure_rates(void)
{
    static pthread_once_t guard = PTHREAD_ONCE_INIT;
    pthread_once(&guard, measure);
    return measured;
}

/* -------------------------------------------------------------------- the model */

/* Putting the contact last costs a tenth more entries of L and half as many flops again (plane bodies, AMD). */
#define LAST_ENTRIES 1.1
#define LAST_FLOPS   1.5

/* CHOLMOD's supernodes reach 1 / 1.3 of a dense kernel's rate, and each entry of L costs assembling and page faults as
 * much as ten passes; a substitution 1.3. Measured on plane bodies with 15,000 to 540,000 dofs. */
#define FACTOR_FLOPS  1.3
#define FACTOR_PASSES 10.0
#define SOLVE_PASSES  1.3
/* While it is made: supernodes are updated through room of their own, a fifth of the factor of a solid body. */
#define FACTOR_PEAK 1.25
/* Vectors of dofs: passes of K that a certificate and a load take, and of single numbers. */
#define CASE_PASSES  14.0
#define CASE_NUMBERS 120.0

/* Substitutions of a load with a dense D: forwards, backwards, and the certificate's. */
#define CONDENSED_SOLVES 4.0
/* Steps of the active set, those that refactor, and the iterations that are needed where rows have several entries. */
#define DENSE_STEPS 6.0
#define BOUND_STEPS 4.0
#define ITERATIONS  330.0
/* Each refactorization is analysed anew: passes of K. */
#define ANALYSIS_PASSES 60.0

/* A cycle and a product: 5 passes of K and what the coarse levels add. The other numbers are cycles: making a
 * multigrid, bounding the spectrum, solving once, a step of the active set (with a multigrid of its own), an iteration
 * that starts at the last one's answer. Plane bodies and obstacles. */
#define CYCLE_PASSES    6.5
#define CREATE_CYCLES   16.0
#define SPECTRUM_CYCLES 55.0
#define SOLVE_CYCLES    22.0
#define FREE_STEPS      6.0
#define STEP_CYCLES     30.0
#define CHANGE_CYCLES   6.0

/* Vectors of d numbers that are alive together at the most crowded moment of a load, and with conjugate gradients. */
#define DIRECT_VECTORS 36.0
#define FREE_VECTORS   52.0

static double matrix_bytes(const uz_cost_size *s)
{
    return 16.0 * (double)s->k_entries + 8.0 * (double)s->d + 48.0 * (double)s->n_entries;
}

static double cube(double x)
{
    return x * x * x;
}

static void estimate_condensed(uz_cost_estimate *out, const uz_cost_size *s, const uz_factor_info *L,
                               const uz_cost_rates *rates)
{
    double n_b = (double)s->n_b, m = (double)s->m, entries = (double)L->nnz;
    double dense = cube(fmax(n_b, m)), step = cube(m) / 3.0;
    out->flops += dense + DENSE_STEPS * step + 2.0 * CONDENSED_SOLVES * entries;
    out->setup_s += dense * rates->flop_s;
    out->case_s += DENSE_STEPS * step * rates->flop_s + CONDENSED_SOLVES * SOLVE_PASSES * entries * rates->entry_s;
    out->bytes += 8.0 * (n_b * n_b + 2.0 * m * m + n_b * m);
}

static void estimate_factored(uz_cost_estimate *out, const uz_cost_size *s, const uz_factor_info *L,
                              const uz_cost_rates *rates)
{
    double entries = (double)L->nnz, solve = 2.0 * SOLVE_PASSES * entries * rates->entry_s;
    double share = 1.0 - 0.5 * (double)s->n_b / (double)s->d; /* of the dofs that are free, about */
    if (!s->bounds) {
        out->case_s += ITERATIONS * solve;
        out->flops += 4.0 * ITERATIONS * entries;
        return;
    }
    double again = share * share * FACTOR_FLOPS * L->flops * rates->flop_s +
                   (share * FACTOR_PASSES * entries + ANALYSIS_PASSES * (double)s->k_entries) * rates->entry_s;
    out->case_s += 2.0 * solve + BOUND_STEPS * (again + 2.0 * share * solve);
    out->flops += BOUND_STEPS * share * share * L->flops + 8.0 * (1.0 + BOUND_STEPS) * entries;
    out->bytes +=
        share * (double)L->bytes + 16.0 * (double)s->k_entries; /* the factor and the matrix of the free dofs */
}

uz_cost_estimate uz_cost_direct(uz_operator op, const uz_cost_size *size, const uz_factor_info *predicted,
                                uz_operator of, const uz_cost_rates *rates)
{
    uz_factor_info L = *predicted;
    double entries = op == of ? 1.0 : op == UZ_OPERATOR_CONDENSED ? LAST_ENTRIES : 1.0 / LAST_ENTRIES;
    L.flops *= op == of ? 1.0 : op == UZ_OPERATOR_CONDENSED ? LAST_FLOPS : 1.0 / LAST_FLOPS;
    L.nnz = (int64_t)((double)L.nnz * entries);
    L.bytes = (size_t)((double)L.bytes * entries);
    uz_cost_estimate out = {.op = op};
    out.flops = L.flops;
    out.bytes = matrix_bytes(size) + FACTOR_PEAK * (double)L.bytes + 8.0 * DIRECT_VECTORS * (double)size->d;
    out.setup_s = L.order_s + FACTOR_FLOPS * L.flops * rates->flop_s + FACTOR_PASSES * (double)L.nnz * rates->entry_s;
    out.case_s = (CASE_PASSES * (double)size->k_entries + CASE_NUMBERS * (double)size->d) * rates->entry_s;
    if (op == UZ_OPERATOR_CONDENSED)
        estimate_condensed(&out, size, &L, rates);
    else
        estimate_factored(&out, size, &L, rates);
    return out;
}

uz_cost_estimate uz_cost_free(const uz_cost_size *size, const uz_cost_rates *rates)
{
    double cycle = CYCLE_PASSES * (double)size->k_entries * rates->entry_s;
    double setup = CREATE_CYCLES + SPECTRUM_CYCLES;
    double load = SOLVE_CYCLES + (size->m == 0   ? 0.0
                                  : size->bounds ? FREE_STEPS * STEP_CYCLES
                                                 : ITERATIONS * CHANGE_CYCLES);
    double levels = uz_krylov_predict_bytes(size->d, size->k_entries, size->modes);
    uz_cost_estimate out = {.op = UZ_OPERATOR_MATRIX_FREE};
    out.setup_s = setup * cycle;
    out.case_s =
        load * cycle + (CASE_PASSES * (double)size->k_entries + CASE_NUMBERS * (double)size->d) * rates->entry_s;
    out.flops = (setup + load) * CYCLE_PASSES * 4.0 * (double)size->k_entries;
    out.bytes = matrix_bytes(size) + (size->bounds ? 2.0 : 1.0) * levels + 8.0 * FREE_VECTORS * (double)size->d;
    return out;
}

/* The pattern both ways with room for elimination, and vectors of integers. */
double uz_cost_analysis_bytes(const uz_cost_size *size)
{
    return matrix_bytes(size) + 20.0 * (double)size->k_entries + 130.0 * (double)size->d;
}

bool uz_cost_bounds(const uz_csc *N, const uz_settings *settings)
{
    const bool by_auto = settings->method == UZ_METHOD_AUTO && settings->stopping == UZ_STOP_CERTIFIED;
    return (by_auto || settings->method == UZ_METHOD_ACTIVE_SET) && uz_dual_bounds_dofs(N);
}

/* ------------------------------------------------------------------- the choice */

/* The model is trusted to this factor where it speaks against the form that measurements have chosen, and asked only
 * where there are seconds to win. */
#define MUCH_CHEAPER 4.0
#define WORTH_S      5.0

static double total(const uz_cost_estimate *e, const uz_cost_size *size)
{
    return e->setup_s + (double)(size->cases > 0 ? size->cases : 1) * e->case_s;
}

static bool is_better(const uz_cost_estimate *a, const uz_cost_estimate *b, const uz_cost_size *size)
{
    if (!b->fits)
        return a->fits;
    return a->fits && a->op == UZ_OPERATOR_MATRIX_FREE && total(b, size) > WORTH_S &&
           MUCH_CHEAPER * total(a, size) < total(b, size);
}

void uz_cost_decide(uz_cost_plan *plan, const uz_cost_size *size, const uz_factor_info *factor, uz_operator direct,
                    uz_operator asked, size_t memory_limit)
{
    uz_cost_rates rates = uz_cost_measure_rates();
    uz_operator other = direct == UZ_OPERATOR_CONDENSED ? UZ_OPERATOR_FACTORED : UZ_OPERATOR_CONDENSED;
    plan->count = 0;
    if (factor) {
        plan->form[plan->count++] = uz_cost_direct(direct, size, factor, direct, &rates);
        plan->form[plan->count++] = uz_cost_direct(other, size, factor, direct, &rates);
    }
    plan->form[plan->count++] = uz_cost_free(size, &rates);
    plan->chosen = -1;
    for (int k = 0; k < plan->count; k++) {
        uz_cost_estimate *form = &plan->form[k];
        form->fits = memory_limit == 0 || form->bytes <= (double)memory_limit;
        bool allowed = asked == UZ_OPERATOR_AUTO || form->op == asked;
        if (allowed && form->fits && (plan->chosen < 0 || is_better(form, &plan->form[plan->chosen], size)))
            plan->chosen = k;
    }
}

static double bytes_of(const uz_cost_plan *plan, uz_operator op)
{
    for (int k = 0; k < plan->count; k++)
        if (plan->form[k].op == op)
            return plan->form[k].bytes;
    return INFINITY;
}

uz_status uz_cost_refuse(const uz_cost_plan *plan, uz_operator asked, size_t memory_limit, uz_error *err)
{
    double free = bytes_of(plan, UZ_OPERATOR_MATRIX_FREE);
    double direct = fmin(bytes_of(plan, UZ_OPERATOR_CONDENSED), bytes_of(plan, UZ_OPERATOR_FACTORED));
    char with_factor[80] = "the symbolic analysis of a factor alone passes it";
    if (asked != UZ_OPERATOR_AUTO && asked != UZ_OPERATOR_MATRIX_FREE)
        direct = bytes_of(plan, asked);
    if (isfinite(direct))
        snprintf(with_factor, sizeof with_factor, "with a factor the solve would take %.0f bytes", direct);
    if (asked == UZ_OPERATOR_MATRIX_FREE)
        return uz_fail(err, UZ_ERR_LIMIT, "K", "the solve would take %.0f bytes and the limit is %zu: raise the limit",
                       free, memory_limit);
    return uz_fail(err, UZ_ERR_LIMIT, "K", "%s, as matrix_free %.0f bytes, and the limit is %zu: %s", with_factor, free,
                   memory_limit,
                   asked != UZ_OPERATOR_AUTO && free <= (double)memory_limit
                       ? "ask for the operator matrix_free or auto"
                       : "raise the limit");
}
