#include "work/overall.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* How much an outcome leaves to be wished, 0: nothing. */
static const int BADNESS[] = {
    [UZ_CONVERGED] = 0,   [UZ_VERIFIED] = 0,        [UZ_PRECISION_LIMIT] = 1, [UZ_MESH_LIMIT] = 2,
    [UZ_PAPER_RULE] = 3,  [UZ_ITERATION_LIMIT] = 4, [UZ_MOVING_GEOMETRY] = 5, [UZ_NOT_VERIFIED] = 6,
    [UZ_TIME_LIMIT] = 7,  [UZ_DISMISSED] = 8,       [UZ_LOOSE] = 9,           [UZ_OUT_OF_REACH] = 10,
    [UZ_INFEASIBLE] = 11, [UZ_INVERTED] = 12,       [UZ_UNSTABLE] = 13,       [UZ_UNHELD] = 14};
_Static_assert(sizeof BADNESS / sizeof BADNESS[0] == CODEC_OUTCOMES, "each outcome has its place");

void overall_summary(uz_summary *out, codec_cases *counts, uz_result *const *results, const uz_problem *problem)
{
    int64_t worst = 0, unproved = 0, widest = 0;
    bool proved = true;
    uz_timings times = {0};
    double bound = 0.0, worst_error = 0.0, mesh = 0.0;
    *counts = (codec_cases){.count = problem->n_cases};
    for (int64_t i = 0; i < problem->n_cases; i++) {
        const uz_summary *one = &results[i]->summary;
        const double relative = one->certificate.relative_error, known = isnan(relative) ? (double)INFINITY : relative;
        const double error =
            one->grids ? uz_asked_error(one) : known; /* where the cells were chosen it was asked for */
        const int badness = BADNESS[one->outcome], so_far = BADNESS[results[worst]->summary.outcome];
        if (i == 0 || badness > so_far || (badness == so_far && error > worst_error)) {
            worst = i;
            worst_error = error;
        }
        counts->outcomes[one->outcome]++;
        if (one->guarantee.asked && !one->guarantee.proved && proved)
            unproved = i;
        proved = proved && (one->guarantee.proved || !one->guarantee.asked);
        if (one->guarantee.relative > results[widest]->summary.guarantee.relative)
            widest = i;
        bound = fmax(bound, known); /* one that is not known counts as the largest */
        mesh = isnan(mesh) || isnan(one->discretization_error) ? (double)NAN : fmax(mesh, one->discretization_error);
        uz_timings_add(&times, &one->timings);
    }
    *out = results[worst]->summary;
    counts->worst = problem->cases[worst].name;
    out->certificate.relative_error = bound;
    out->discretization_error = mesh;
    out->guarantee = results[proved ? widest : unproved]->summary.guarantee; /* of all, as far as there is one */
    out->timings = times;
    out->iterations = out->restarts = out->refinements = 0;
    for (int64_t i = 0; i < problem->n_cases; i++) {
        out->iterations += results[i]->summary.iterations;
        out->restarts += results[i]->summary.restarts;
        out->refinements += results[i]->summary.refinements;
    }
    /* The first case paid for the factor, or found it; its cost has the setup. */
    const uz_summary *first = &results[0]->summary;
    out->factor_cached = first->factor_cached;
    out->reused = first->reused;
    out->cost = first->cost;
    out->factor_flops = first->factor_flops;
    out->factor_nnz = first->factor_nnz;
    out->factor_bytes = first->factor_bytes;
    out->rcond = first->rcond;
    char own[sizeof out->message];
    int64_t good = counts->outcomes[UZ_CONVERGED];
    memcpy(own, out->message, sizeof own);
    if (good == counts->count)
        out->message[0] = '\0';
    else
        snprintf(out->message, sizeof out->message,
                 "%" PRId64 " of %" PRId64 " cases converged. The worst is %s%s%.120s", good, counts->count,
                 counts->worst, own[0] ? ": " : ".", own);
}
