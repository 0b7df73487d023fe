/* multigrid_cost.h: the price of the forms that solve by a multigrid, as the `add_cost` of a uz_dual_form has it. */
#ifndef UZ_DUAL_MULTIGRID_COST_H
#define UZ_DUAL_MULTIGRID_COST_H

#include "dual/form.h"

/* Where few of the d dofs have bounds a step of the active set costs no more than sweeps over them all. */
static inline bool uz_bounds_are_few(int64_t m, int64_t d)
{
    return (double)m < 0.125 * (double)d;
}

/* Of a multigrid that is here, and of one that a group of processes holds. factor is not read. */
void uz_cost_of_multigrid(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                          const uz_cost_rates *rates);
void uz_cost_of_group(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                      const uz_cost_rates *rates);

#endif
