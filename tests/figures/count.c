/* count.c: how many back-substitutions a solve makes. The linker puts these functions between the solver and its own
 * (ld's --wrap), so that nothing in the solver has to count. Passes are counted by the entries of the factor that they
 * go over: the coarsest grid of a multigrid has one of its own. A pass along the paths of a few dofs counts as a whole
 * one, and a solve with the free dofs' factor as one with the body's: both are upper bounds. */
#include "factor/factor.h"
#include "figures/figures.h"
#include "amg/amg.h"

static figure_work counted;

void figure_count_from_zero(void)
{
    counted = (figure_work){0};
}

figure_work figure_counted(void)
{
    return counted;
}

static void count_passes(const uz_factor *factor, int64_t columns)
{
    counted.entries += (double)columns * (double)uz_factor_describe(factor).nnz;
}

/* The names that ld gives to what is wrapped. */
uz_status __real_uz_factor_solve_one(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward,
                                     uz_error *err);
uz_status __wrap_uz_factor_solve_one(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward,
                                     uz_error *err);
uz_status __wrap_uz_factor_solve_one(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward,
                                     uz_error *err)
{
    count_passes(factor, 1);
    return __real_uz_factor_solve_one(factor, ws, x, forward, err);
}

uz_status __real_uz_factor_solve_lanes(const uz_factor *factor, double *X, int64_t blocks, bool forward, uz_error *err);
uz_status __wrap_uz_factor_solve_lanes(const uz_factor *factor, double *X, int64_t blocks, bool forward, uz_error *err);
uz_status __wrap_uz_factor_solve_lanes(const uz_factor *factor, double *X, int64_t blocks, bool forward, uz_error *err)
{
    count_passes(factor, blocks * UZ_LANES);
    return __real_uz_factor_solve_lanes(factor, X, blocks, forward, err);
}

uz_status __real_uz_principal_solve(double *x, uz_principal *part, uz_error *err);
uz_status __wrap_uz_principal_solve(double *x, uz_principal *part, uz_error *err);
uz_status __wrap_uz_principal_solve(double *x, uz_principal *part, uz_error *err)
{
    counted.solves++;
    return __real_uz_principal_solve(x, part, err);
}

uz_status __real_uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                                    const double *r, uz_error *err);
uz_status __wrap_uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                                    const double *r, uz_error *err);
uz_status __wrap_uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                                    const double *r, uz_error *err)
{
    counted.cycles++;
    return __real_uz_multigrid_apply(mg, K, room, z, r, err);
}
