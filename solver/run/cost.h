/* cost.h: what a solve will take, before it is begun: seconds and bytes of each form of the operator.
 *
 * The model counts the work that dominates: flops of the factorization, entries of K and L that are passed through,
 * what a cycle of multigrid reads. Its constants are numbers of these, measured on plane and solid bodies and on
 * obstacle problems; its rates are measured on the machine by the kernels that do the work, in a few milliseconds each,
 * when they are first asked for. */
#ifndef UZ_COST_H
#define UZ_COST_H

#include "assembly/assembly.h"
#include "brick/brick.h"
#include "dual/choice.h"
#include "dual/cost.h"
#include "scene/mesh.h"
#include "uzawa.h"

typedef struct {
    uz_cost_estimate form[UZ_DUAL_FORMS]; /* those considered */
    int count, chosen;
} uz_cost_plan;

/* The rates of this machine; measured when they are asked for first. */
const uz_cost_rates *uz_cost_machine(void);
/* All that is measured of it but for what is of a matrix. */
void uz_cost_measure(void);

/* Of K (of a brick it is not read) and of N, whose rows touch n_b dofs, for so many load cases. model, scene: NULL of
 * matrices. An active set solves with the free dofs only where each row has one entry, unless gradient steps were asked
 * for, which take hundreds of solves. */
uz_cost_size uz_cost_size_of(const uz_csc *K, const uz_csc *N, const uz_body_model *model, const uz_scene *scene,
                             int64_t n_b, int64_t cases, const uz_settings *settings);

/* Whether each of n_b contact dofs has a row of its own: the trailing block of a factor with these dofs last is then
 * all of the operator. Otherwise the contact may stand anywhere in it, whichever is cheaper. */
bool uz_cost_is_one_to_one(const uz_csc *N, int64_t n_b);

/* Bytes that ordering and symbolic analysis take beside K, at most. */
double uz_cost_analysis_bytes(const uz_cost_size *size);

/* All forms, `direct` being the one the factor was analysed for, and the cheapest that fits the limit (0: none):
 * `direct` unless it does not fit or another is much cheaper, of several load cases cheaper. asked: AUTO, or the one
 * form that may be chosen. chosen is -1 where none fits. factor NULL: its analysis did not fit, so that no form with a
 * factor does. */
void uz_cost_decide(uz_cost_plan *plan, const uz_cost_size *size, const uz_factor_info *factor, uz_operator direct,
                    uz_operator asked, size_t memory_limit);

/* Decides so for a solid by counts, without the analysis of a factor: does matrix_free win even over the least that a
 * factor of a body of this breadth (uz_mesh_breadth) takes, with its order, which nobody else needs? false: it has to
 * be analysed, or there is no choice. */
bool uz_cost_is_surely_free(uz_cost_plan *plan, const uz_cost_size *size, const uz_mesh *mesh, uz_operator direct,
                            uz_operator asked, size_t memory_limit);

/* Steps that a bound on the spectrum may take before the chosen form, which has no factor, is dearer than one that has
 * and fits, as conjugate gradients then take longer in proportion; 0: there is none that fits. */
int uz_cost_patience(const uz_cost_plan *plan, const uz_cost_size *size);

/* Seconds of the body and so many loads on it (0: one). */
double uz_cost_seconds(const uz_cost_estimate *form, int64_t cases);

/* What is left of the seconds of one thread for a body and for loads on it, on a brick, or NULL: none, where so many
 * share what they can of them. The plan is that of one: which form is taken does not depend on who else computes. */
double uz_cost_shared(double setup_s, double loads_s, uz_operator op, const uz_brick *brick, int threads);

/* The refusal where nothing fits: UZ_ERR_LIMIT with the predicted bytes. */
uz_status uz_cost_refuse(const uz_cost_plan *plan, uz_operator asked, size_t memory_limit, uz_error *err);

#endif
