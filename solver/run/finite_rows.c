/* finite_rows.c: contact problems of the rows that may press.
 *
 * A problem has a dense part of all rows that it is made with, also of those that stay far from any obstacle: of a side
 * that is a candidate as a whole most of the factor and of the search. It is made with those that are within reach
 * where the body is, and is that of all rows if none of the others is penetrated by its answer; else these are added,
 * and it is solved again (obstacle/candidates.h says why that is exact). A choice stays for the problems that follow,
 * as the ordering of their factor depends on it, unless far fewer rows are within reach. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "law/law.h"

#include <stdlib.h>
#include <string.h>

/* With fewer rows there is nothing to save, nor where more than this part of them stays; and an ordering is found anew
 * where it has less than this part of the rows of the one before. */
enum { FEW_ROWS = 32 };
#define MOST_KEPT 0.75
#define FAR_FEWER 0.6
/* What is within reach of an answer of the same part, in parts of the body's extent: of a ring between plates that is
 * pressed to half of its height, and rollers that a body is pressed on, rows that pressed next had 0.0064 at most. */
#define NEXT_REACH 0.01

static void take_all(uz_finite_run *run)
{
    uz_candidates_clear(&run->kept);
    run->kept.m = run->kept.count = run->at.rows.m;
}

/* Of the rows within reach by the gaps of the last answer, or at run->at, with those that pressed. */
static uz_status choose_rows(uz_finite_run *run, uz_error *err)
{
    const uz_body_model *rows = &run->at.rows;
    uz_candidates near, *kept = &run->kept;
    const bool all = run->pairs || run->follows || rows->m <= FEW_ROWS; /* uz_finite_correct is about all rows */
    if (all || kept->m != rows->m)
        take_all(run);
    if (all)
        return UZ_OK;
    const bool next = run->step_qps > 0 && run->last->m == rows->m;
    const uz_status status =
        uz_candidates_first(&near, next ? run->last->g : run->at.gap, rows->m,
                            (next ? NEXT_REACH : UZ_CANDIDATES_REACH) * run->base.mesh.extent, err);
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < rows->m && run->n_r == rows->m; i++) {
        const bool presses = run->r[i] < 0;
        near.count += presses && !near.in[i];
        near.in[i] = near.in[i] || presses;
        if (kept->in && presses) {
            kept->count += !kept->in[i];
            kept->in[i] = 1;
        }
    }
    const double most = kept->in ? FAR_FEWER : MOST_KEPT;
    if ((double)near.count <= most * (double)kept->count) {
        uz_candidates_clear(kept);
        *kept = near;
    } else {
        uz_candidates_clear(&near);
    }
    return UZ_OK;
}

uz_status uz_finite_reduce(uz_csc *N, const uz_finite_run *run, const uz_body_model *rows, uz_error *err)
{
    return run->kept.in ? uz_candidates_reduce(N, &rows->N, &run->kept, err) : uz_csc_copy(N, &rows->N, err);
}

void uz_finite_gather(double *out, const uz_finite_run *run, const double *all)
{
    if (run->kept.in)
        uz_candidates_gather(out, all, &run->kept);
    else if (run->at.rows.m > 0)
        memcpy(out, all, (size_t)run->at.rows.m * sizeof *out);
}

/* The contact problem of the rows kept, from r (n_r, of all rows where it is known). */
static uz_status solve_kept(uz_result **out, uz_finite_run *run, double *r, int64_t n_r, uz_error *err)
{
    const uz_qp whole = {*run->K, run->at.rows.N, run->p, run->at.h};
    const int64_t m = run->at.rows.m, count = run->kept.count;
    if (!run->kept.in)
        return uz_finite_solve(out, run, &whole, r, n_r, err);
    uz_csc N = {0};
    double *h = uz_alloc(2 * count, sizeof *h);
    uz_status status = h ? uz_candidates_reduce(&N, &whole.N, &run->kept, err)
                         : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)count);
    if (status == UZ_OK) {
        const uz_qp qp = {whole.K, N, whole.p, h};
        uz_candidates_gather(h, whole.h, &run->kept);
        if (n_r == m)
            uz_candidates_gather(h + count, r, &run->kept);
        status = uz_finite_solve(out, run, &qp, h + count, n_r == m ? count : 0, err);
    }
    uz_csc_clear(&N);
    free(h);
    return status;
}

/* run->last, of the rows kept, becomes that of all; *again: some of the others are penetrated, and kept from now on. */
static uz_status look_at_rest(bool *again, uz_finite_run *run, uz_error *err)
{
    uz_result *last = run->last;
    const uz_csc *N = &run->at.rows.N;
    const int64_t m = N->rows;
    double *r = uz_alloc(m, sizeof *r), *g = uz_alloc(m, sizeof *g), *size = uz_alloc(m, sizeof *size);
    *again = false;
    if (!r || !g || !size) {
        uz_free_all(r, g, size);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld rows", (long long)m);
    }
    uz_candidates_scatter(r, last->r, &run->kept);
    memcpy(g, run->at.h, (size_t)m * sizeof *g);
    uz_csc_gaxpy(g, N, -1, last->u);
    uz_gap_sizes(size, run->at.h, N, last->u);
    *again = uz_candidates_extend(&run->kept, &uz_law_frictionless, g, size, UZ_GAP_ROUNDING) > 0;
    uz_free_all(size, last->r, last->g);
    last->r = r;
    last->g = g;
    last->m = m;
    if ((double)run->kept.count > MOST_KEPT * (double)m)
        take_all(run);
    return UZ_OK;
}

bool uz_finite_is_solved(const uz_result *problem)
{
    return problem->summary.outcome == UZ_CONVERGED || problem->summary.outcome == UZ_PRECISION_LIMIT;
}

uz_status uz_finite_solve_qp(uz_finite_run *run, uz_error *err)
{
    uz_status status = choose_rows(run, err);
    bool again = status == UZ_OK, before = false;
    while (again) {
        uz_result *next = NULL;
        const bool all = !run->kept.in;
        status = solve_kept(&next, run, before ? run->last->r : run->r, before ? run->last->m : run->n_r, err);
        if (status != UZ_OK)
            return status;
        run->found.qps++;
        uz_result_free(run->last);
        run->last = next;
        again = !all && uz_finite_is_solved(next);
        if (again)
            status = look_at_rest(&again, run, err);
        again = again && status == UZ_OK;
        before = true;
    }
    return status;
}
