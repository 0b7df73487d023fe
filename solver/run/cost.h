/* cost.h: what a solve will take, before it is begun: seconds and bytes of each form of the operator.
 *
 * The model counts the work that dominates: flops of the factorization, entries of K and L that are passed through. Its
 * constants are numbers of such passes, measured on plane and solid bodies and on obstacle problems; its two rates are
 * measured on the machine, in a few milliseconds, when they are first asked for. */
#ifndef UZ_COST_H
#define UZ_COST_H

#include "factor/factor.h"
#include "uzawa.h"

typedef struct {
    int64_t d, m, n_b; /* dofs, rows, dofs that rows touch */
    int64_t k_entries; /* of K's lower triangle */
    int64_t n_entries; /* of N */
    int modes;         /* of the near-null space */
    bool bounds;       /* uz_cost_bounds */
    int64_t cases;     /* loads on the body */
} uz_cost_size;

typedef struct {
    uz_operator op;
    double setup_s, case_s; /* once for the body, and for each load */
    double bytes;           /* K and N included */
    double flops;           /* of the setup and one load */
    bool fits;
} uz_cost_estimate;

enum { UZ_COST_FORMS = 3 };

typedef struct {
    uz_cost_estimate form[UZ_COST_FORMS]; /* those considered */
    int count, chosen;
} uz_cost_plan;

typedef struct {
    double flop_s;  /* seconds for each flop of a dense kernel */
    double entry_s; /* for each stored entry of a sparse symmetric matrix, times a vector */
} uz_cost_rates;
/* Measured once for the process. */
uz_cost_rates uz_cost_measure_rates(void);

/* One of CONDENSED or FACTORED, with a factor that is `predicted` (nnz, flops, bytes, order_s) for the form `of`: the
 * other form's factor differs by what ordering the contact last costs. */
uz_cost_estimate uz_cost_direct(uz_operator op, const uz_cost_size *size, const uz_factor_info *predicted,
                                uz_operator of, const uz_cost_rates *rates);
uz_cost_estimate uz_cost_free(const uz_cost_size *size, const uz_cost_rates *rates);

/* Is the active set to solve with the free dofs only? Where each row has one entry, unless gradient steps were asked
 * for, which take hundreds of solves. */
bool uz_cost_bounds(const uz_csc *N, const uz_settings *settings);

/* Bytes that ordering and symbolic analysis take beside K, at most. */
double uz_cost_analysis_bytes(const uz_cost_size *size);

/* All three forms, `direct` being the one the factor was analysed for, and the cheapest that fits the limit (0: none):
 * `direct` unless another is much cheaper or it does not fit. asked: AUTO, or the one form that may be chosen. chosen
 * is -1 where none fits. factor NULL: its analysis did not fit, so that no form with a factor does. */
void uz_cost_decide(uz_cost_plan *plan, const uz_cost_size *size, const uz_factor_info *factor, uz_operator direct,
                    uz_operator asked, size_t memory_limit);

/* The refusal where nothing fits: UZ_ERR_LIMIT with the predicted bytes. */
uz_status uz_cost_refuse(const uz_cost_plan *plan, uz_operator asked, size_t memory_limit, uz_error *err);

#endif
