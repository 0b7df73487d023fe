/* all_rows.c: from an answer with some of the contact rows to one with all of them.
 *
 * Rows that were left out have no reaction and the gap that u leaves; what is certified is the full problem, on its own
 * K, N, p and h (obstacle/candidates.h says why that bound is one). Where it misses the request although that of the
 * rows kept met it, or a gap left out is negative, the run says which rows another round has to have. */
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "run/rows.h"
#include "run/run.h"

#include <math.h>
#include <stdlib.h>

/* The rows of another round: those of this one, those that are penetrated, and those that would be next. */
static uz_status want_rows(uz_run *run, bool suspect, uz_error *err)
{
    const uz_candidates *rows = &run->asked->setup->rows;
    const uz_csc *N = uz_setup_all_rows(run->asked->setup, run->asked->problem);
    const uz_law *law = run->work.it.law;
    const double *g = run->answer.g;
    double nearest = INFINITY;
    uz_candidates wants = {0};
    double *size = uz_alloc(rows->m, sizeof *size);
    uz_status status =
        size ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contacts", (long long)rows->m);
    if (status == UZ_OK)
        status = uz_candidates_add(&wants, rows, err);
    if (status == UZ_OK) {
        uz_gap_sizes(size, run->load.h_all, N, run->answer.u);
        const int64_t added = uz_candidates_extend(&wants, law, g, size, UZ_GAP_ROUNDING);
        /* no gap left out is negative at u, but some may be at the feasible displacement: what stays nearest */
        for (int64_t i = 0; added == 0 && suspect && i < wants.m; i++) {
            double depth;
            law->kind->penetration(law, &depth, &g[i], 1);
            nearest = wants.in[i] ? nearest : fmin(nearest, depth > 0.0 ? 0.0 : g[i]);
        }
        for (int64_t i = 0; added == 0 && suspect && i < wants.m; i++)
            if (!wants.in[i] && !(g[i] > 2.0 * nearest)) {
                wants.in[i] = 1;
                wants.count++;
            }
    }
    free(size);
    if (status == UZ_OK && wants.count > rows->count)
        run->wants = wants;
    else
        uz_candidates_clear(&wants);
    return status;
}

uz_status uz_run_certify_all_rows(uz_run *run, uz_error *err)
{
    const uz_candidates *rows = &run->asked->setup->rows;
    uz_certificate *certificate = &run->result->summary.certificate;
    if (!rows->in)
        return UZ_OK;
    double start = uz_seconds();
    bool met = certificate->relative_error <= run->work.requested;
    double **of_rows[] = {&run->answer.r, &run->answer.g, &run->result->ray}; /* zero on those left out */
    for (int k = 0; k < 3; k++) {
        double *all = *of_rows[k] ? uz_alloc(rows->m, sizeof *all) : NULL;
        if (*of_rows[k] && !all)
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contacts", (long long)rows->m);
        if (all)
            uz_candidates_scatter(all, *of_rows[k], rows);
        free(*of_rows[k]);
        *of_rows[k] = all;
    }
    uz_status status = UZ_OK;
    run->answer.m = run->all;
    if (!run->result->ray)
        status = uz_run_certify_answer(run, &run->answer, err);
    if (status == UZ_OK && !run->result->ray)
        *certificate = run->answer.certificate;
    if (status == UZ_OK && !run->result->ray && certificate->relative_error > run->work.requested)
        status = want_rows(run, met, err);
    run->result->summary.timings.certify += uz_seconds() - start;
    uz_milestones_resume(&run->work.milestones, uz_run_time(run));
    uz_milestones_note(&run->work.milestones, UZ_MILESTONE_OF_ALL_ROWS, certificate->relative_error,
                       run->work.it.iteration, run->work.dual->applications);
    return status;
}
