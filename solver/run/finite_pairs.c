/* finite_pairs.c: steps of two bodies that touch, and of others whose tangent is not symmetric.
 *
 * Rows of two surfaces are those where the bodies are, with forces N(u)' r that turn and go over from node to node as
 * they slide (assembly/row_turn.h). With T the derivative of these forces and E what the gaps' own derivative is off -N
 * a step is the contact problem
 *
 *     (K - T) v = f + N' r,   h - N (u + v) + E v >= 0,   r <= 0,
 *
 * which is not that of an energy, as T is not symmetric. It is solved by contact problems on the symmetric part of
 * K - T, to which the skew part and E are added at the last v: few, as both are small where the surfaces lie on each
 * other, and each a back-substitution, as the matrix stays. Their v are mixed so that what the problem changes about
 * them is least (D. Anderson, "Iterative procedures for nonlinear integral equations", J. ACM 12 (1965) 547-560), as
 * what is skew would turn them about the answer for long; differences of the steps before tell of it, too. What is
 * added is told by the rows a little further along v, so that the whole derivative counts whatever row_turn.h leaves
 * out of its entries. The skew part of pressures that follow the body (finite/follower.h) is added like that of T. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Contact problems of a step, how many are mixed, and what may be left of a step: no more than a part of what Newton's
 * method leaves of it, which is about what the step before was in the energy's norm (S. Eisenstat and H. Walker,
 * "Choosing the forcing terms in an inexact Newton method", SIAM J. Sci. Comput. 17 (1996) 16-32). */
enum { MOST_CORRECTIONS = 12, MIXED = 6 };
#define CORRECTED 1e-3
#define ROUGHLY   0.1
#define PART_LEFT 0.3
/* What differences of other steps may be off, squared. */
#define OF_OTHERS 1e-4
/* What rounding may change, in parts of the displacement. */
#define ROUNDING 1e-12

uz_status uz_finite_widen(uz_finite_run *run, bool hold, uz_error *err)
{
    const bool known = run->n_r == run->at.rows.m;
    uz_csc_clear(&run->wide);
    run->K = &run->wide;
    return uz_widen_by_rows(&run->wide, &run->tangent.K, &run->at.rows.N, hold && known ? run->r : NULL, 0, &run->turn,
                            err);
}

uz_status uz_finite_carry_reactions(uz_finite_run *run, const uz_body_model *from, uz_error *err)
{
    const uz_body_model *to = &run->at.rows;
    int64_t next = 0;
    double *r = uz_alloc_zero(to->m, sizeof *r);
    if (!r)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld reactions", (long long)to->m);
    for (int64_t i = 0; i < to->m; i++) {
        const int64_t row = uz_next_row(&next, from, to->info.contact_of[i], to->row_place[i]);
        if (row >= 0)
            r[i] = run->r[row];
    }
    free(run->r);
    run->r = r;
    run->n_r = to->m;
    return UZ_OK;
}

/* ---- the step */

/* Differences of changes (came - v) and of what came, from one v to the next, of this step and of those before, whose
 * problem changed v much alike: d each, by turns, in run->mixed. */
static double *difference(const uz_finite_run *run, int i, bool of_came)
{
    return run->mixed + (2 * (i % MIXED) + of_came) * run->d;
}

/* weight (k): the combination of the differences of changes that is nearest to `change`, by the normal equations of
 * unit vectors. */
static void nearest_combination(double weight[MIXED], const uz_finite_run *run, int k, const double *change)
{
    double A[MIXED][MIXED + 1] = {{0}}, size[MIXED] = {0};
    for (int i = 0; i < k; i++)
        size[i] = uz_norm(run->d, difference(run, i, false));
    for (int i = 0; i < k; i++) {
        const double *a = difference(run, i, false);
        for (int j = 0; j < k; j++)
            A[i][j] = size[i] * size[j] > 0 ? uz_dot(run->d, a, difference(run, j, false)) / (size[i] * size[j]) : 0;
        A[i][i] += OF_OTHERS;
        A[i][k] = size[i] > 0 ? uz_dot(run->d, a, change) / size[i] : 0;
    }
    for (int c = 0; c < k; c++)
        for (int i = c + 1; i < k; i++) {
            const double factor = A[i][c] / A[c][c];
            for (int j = c; j <= k; j++)
                A[i][j] -= factor * A[c][j];
        }
    for (int i = k - 1; i >= 0; i--) {
        for (int j = i + 1; j < k; j++)
            A[i][k] -= A[i][j] * weight[j];
        weight[i] = A[i][k] / A[i][i];
    }
    for (int i = 0; i < k; i++)
        weight[i] = size[i] > 0 ? weight[i] / size[i] : 0;
}

/* v becomes what is asked next, after `came` came of it, and of the v before it what `before` and its change say, which
 * become those of this one. */
static void mix(uz_finite_run *run, double *v, double *before, double *change_before, const double *came)
{
    double weight[MIXED] = {0};
    double *change = difference(run, run->n_mixed, false), *later = difference(run, run->n_mixed, true);
    for (int64_t j = 0; j < run->d; j++) {
        const double own = came[j] - v[j];
        change[j] = own - change_before[j];
        later[j] = came[j] - before[j];
        change_before[j] = own;
        before[j] = v[j] = came[j];
    }
    run->n_mixed++;
    const int k = run->n_mixed < MIXED ? run->n_mixed : MIXED;
    nearest_combination(weight, run, k, change_before);
    for (int i = 0; i < k; i++) {
        const double *by = difference(run, i, true);
        for (int64_t j = 0; j < run->d; j++)
            v[j] -= weight[i] * by[j];
    }
}

/* What the skew part of loads that follow makes of v. nodal: 2 n. */
static void add_followers(uz_finite_run *run, const double *v, double *nodal)
{
    if (!run->skew.ptr)
        return;
    double *f = nodal + run->n;
    memset(f, 0, (size_t)run->n * sizeof *f);
    uz_recover_nodal(nodal, &run->at.turned, v, NULL);
    uz_csc_gaxpy(f, &run->skew, 1, nodal);
    uz_gather_nodal(nodal, &run->at.turned, f);
    for (int64_t j = 0; j < run->d; j++)
        run->p[j] += nodal[j];
}

/* What the derivatives of rows along v add to what the matrix has of them; where they cannot be told those that the
 * matrix was made with. */
static uz_status add_turn(uz_finite_run *run, const double *v, uz_error *err)
{
    const uz_row_turn *turn = &run->turn;
    bool known = false;
    if (turn->force.n == 0)
        return UZ_OK;
    const uz_status status =
        uz_row_turn_along(&known, run->p, run->at.h, &run->base, &run->at.rows, &run->scene, run->r, v, err);
    uz_add_entries(run->p, &turn->force, v, true);
    if (!known)
        uz_add_entries(run->at.h, &turn->gap, v, false);
    for (int64_t k = 0; k < turn->force.n && known; k++)
        run->p[turn->force.row[k]] -= turn->force.val[k] * v[turn->force.col[k]];
    return status;
}

/* room: 6 d + m + 2 n. p and h are those of the symmetric part. */
static uz_status iterate(uz_finite_run *run, double *room, uz_error *err)
{
    const int64_t d = run->d, m = run->at.rows.m;
    double *p = room, *from = p + d, *v = from + d, *came = v + d, *before = came + d, *change = before + d,
           *h = change + d, *nodal = h + m;
    /* of the first step the norm is infinite, or not known; nor more than the answer is asked for, as far as this step
     * goes */
    const double now = uz_finite_step_norm(run), enough = now > 0 ? PART_LEFT * run->requested / now : ROUGHLY;
    const double left = run->norm > 0 ? fmin(ROUGHLY, fmax(fmax(CORRECTED, enough), PART_LEFT * run->norm)) : ROUGHLY;
    uz_status status = UZ_OK;
    uz_finite_restrict(from, &run->at);
    for (int64_t j = 0; j < d; j++) { /* it came of none */
        p[j] = run->p[j];
        v[j] = before[j] = change[j] = run->last->u[j] - from[j];
    }
    for (int64_t i = 0; i < m; i++)
        h[i] = run->at.h[i];
    for (int k = 0; k < MOST_CORRECTIONS && status == UZ_OK; k++) {
        double off = 0;
        for (int64_t j = 0; j < d; j++)
            run->p[j] = p[j];
        for (int64_t i = 0; i < m; i++)
            run->at.h[i] = h[i];
        status = add_turn(run, v, err);
        add_followers(run, v, nodal);
        if (status == UZ_OK)
            status = uz_finite_solve_qp(run, err);
        if (status != UZ_OK ||
            (run->last->summary.outcome != UZ_CONVERGED && run->last->summary.outcome != UZ_PRECISION_LIMIT))
            break;
        for (int64_t j = 0; j < d; j++) {
            came[j] = run->last->u[j] - from[j];
            off = hypot(off, came[j] - v[j]);
        }
        if (off <= left * uz_norm(d, came) || off <= ROUNDING * uz_norm(d, run->last->u))
            break;
        mix(run, v, before, change, came);
    }
    for (int64_t i = 0; i < m; i++)
        run->at.h[i] = h[i];
    return status;
}

uz_status uz_finite_correct(uz_finite_run *run, uz_error *err)
{
    const int64_t d = run->d;
    double *room = uz_alloc(6 * d + run->at.rows.m + 2 * run->n, sizeof *room);
    if (!run->mixed)
        run->mixed = uz_alloc(2 * MIXED * d, sizeof *run->mixed);
    const uz_status status = room && run->mixed
                                 ? iterate(run, room, err)
                                 : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a step of %lld dofs", (long long)d);
    free(room);
    return status;
}
