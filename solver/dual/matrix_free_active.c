/* matrix_free_active.c: the contact problem with given rows as equations where each row bounds a single dof, by
 * conjugate gradients on the dofs that are free, with a multigrid of their own. */
#include "dual/dual_private.h"

#include "linalg/blas.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

/* A guess is first judged at a tolerance of 1e-2, the next one at 1e-3, and so on: an early guess is wrong in many
 * rows, which shows at once, and each digit that a step adds is taken over by the next. */
#define FIRST_TOLERANCE 1e-2
#define NEXT_TOLERANCE  0.1
/* Of the aim: below this a solve is as good as exact. */
#define FLOOR 0.02
enum { STEPS_MOST = 5000 };

/* right = p - K u of the dofs that are held, and no others. */
static void load_free(uz_dual_load *load)
{
    uz_inexact *x = load->inexact;
    double *held = x->cg.p;
    for (int64_t j = 0; j < load->K->cols; j++)
        held[j] = load->box->fixed[j] ? load->box->u[j] : 0.0;
    memcpy(x->right, x->p, (size_t)load->K->cols * sizeof *x->right);
    uz_csc_symv(x->right, load->K, -1.0, held);
}

/* What u misses of K u = p + N'r, in the norm of K^-1: the forces on free dofs, and on held ones what no row bears. */
static uz_status measure_slack(uz_dual_load *load, uz_error *err)
{
    uz_inexact *x = load->inexact;
    const uz_bounded *box = load->box;
    const uz_bounds *bounds = &load->dual->bounds;
    double *e = x->cg.r;
    memcpy(e, box->force, (size_t)load->K->cols * sizeof *e);
    for (int64_t i = 0; i < load->dual->info.m; i++)
        e[bounds->dof[i]] -= bounds->scale[i] * box->r[i];
    uz_status status = uz_multigrid_apply(x->cg.mg, load->K, x->cg.room, x->cg.z, e, err);
    double square = uz_dot(load->K->cols, e, x->cg.z);
    x->slack = uz_root(square / uz_krylov_describe(load->dual->krylov).lambda);
    return status;
}

static double energy_norm(const uz_bounded *box, int64_t d)
{
    double square = 0.0;
    for (int64_t j = 0; j < d; j++)
        square += box->u[j] * (box->force[j] + box->p[j]);
    return uz_root(square);
}

static bool looks_wrong(const double *r, const double *g, const bool *active, int64_t m)
{
    for (int64_t i = 0; i < m; i++)
        if (active[i] ? r[i] > 0.0 : g[i] < 0.0)
            return true;
    return false;
}

/* u, r, g and active at this tolerance of the energy norm. */
static uz_status solve_to(uz_dual_load *load, uz_cg *cg, double tolerance, double *g, bool *active, bool *met,
                          uz_error *err)
{
    uz_inexact *x = load->inexact;
    uz_bounded *box = load->box;
    const uz_dual *dual = load->dual;
    double root = sqrt(uz_krylov_describe(dual->krylov).lambda), most = uz_root(-2.0 * load->psi0), norm;
    uz_bounded_balance(box, load->K);
    norm = fmin(energy_norm(box, dual->info.d), most > 0.0 ? most : INFINITY);
    uz_cg_stop stop = {.absolute = tolerance * norm * root,
                       .relative = 0.0,
                       .max_iterations = STEPS_MOST,
                       .hooks = x->hooks,
                       .deadline = x->deadline};
    uz_cg_info info;
    uz_status status = uz_cg_solve(&info, box->u, cg, load->K, x->right, &stop, err);
    if (status != UZ_OK)
        return status;
    *met = info.met;
    uz_bounded_balance(box, load->K);
    uz_bounded_react(box, active, &dual->bounds, dual->info.d, dual->info.m);
    uz_bounded_measure_gaps(g, load, active);
    return UZ_OK;
}

static uz_status solve_stepwise(uz_dual_load *load, uz_cg *cg, double *r, double *g, bool *active, uz_error *err)
{
    uz_inexact *x = load->inexact;
    double least = FLOOR * x->aim, tolerance = fmax(least, x->coarse);
    bool met = true;
    uz_status status = UZ_OK;
    load_free(load);
    do {
        status = solve_to(load, cg, tolerance, g, active, &met, err);
        if (status != UZ_OK || !met || tolerance <= least || looks_wrong(load->box->r, g, active, load->dual->info.m))
            break;
        tolerance = least;
    } while (true);
    memcpy(r, load->box->r, (size_t)load->dual->info.m * sizeof *r);
    x->coarse = fmax(least, NEXT_TOLERANCE * x->coarse);
    return status == UZ_OK ? measure_slack(load, err) : status;
}

uz_status uz_inexact_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, bool *active, uz_error *err)
{
    uz_inexact *x = load->inexact;
    const uz_bounded *box = load->box;
    uz_multigrid *mg = NULL;
    uz_cg cg = {0};
    if (x->coarse <= 0.0)
        x->coarse = FIRST_TOLERANCE;
    uz_stop stop = {x->hooks, x->deadline};
    uz_status status =
        uz_multigrid_create(&mg, load->K, uz_krylov_modes(load->dual->krylov), box->fixed, 0, &stop, err);
    if (status == UZ_OK)
        status = uz_cg_init(&cg, mg, box->fixed, load->dual->info.d, err);
    if (status == UZ_OK)
        status = solve_stepwise(load, &cg, r, g, active, err);
    uz_cg_clear(&cg);
    uz_multigrid_free(mg);
    *solved = status == UZ_OK;
    return status == UZ_ERR_CANCELLED ? UZ_OK : status;
}
