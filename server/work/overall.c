#include "work/overall.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* How much an outcome leaves to be wished, 0: nothing. */
static int badness(uz_outcome outcome)
{
    switch (outcome) {
    case UZ_CONVERGED:
    case UZ_VERIFIED:
        return 0;
    case UZ_PRECISION_LIMIT:
        return 1;
    case UZ_MESH_LIMIT:
        return 2;
    case UZ_PAPER_RULE:
        return 3;
    case UZ_ITERATION_LIMIT:
        return 4;
    case UZ_NOT_VERIFIED:
        return 5;
    case UZ_TIME_LIMIT:
        return 6;
    case UZ_DISMISSED:
        return 7;
    case UZ_INFEASIBLE:
        break;
    }
    return 8;
}

/* A bound that is not known counts as the largest. */
static double bound_of(const uz_result *result)
{
    double bound = result->summary.certificate.relative_error;
    return isnan(bound) ? (double)INFINITY : bound;
}

/* Where the cells were chosen it is the total error that was asked for. */
static double error_of(const uz_result *result)
{
    return result->summary.grids ? result->summary.total_error : bound_of(result);
}

static bool is_worse(const uz_result *a, const uz_result *b)
{
    int x = badness(a->summary.outcome), y = badness(b->summary.outcome);
    return x != y ? x > y : error_of(a) > error_of(b);
}

/* The first case paid for the factor, or found it; its cost has the setup. */
static void take_factor(uz_summary *out, const uz_summary *first)
{
    out->factor_cached = first->factor_cached;
    out->reused = first->reused;
    out->cost = first->cost;
    out->factor_flops = first->factor_flops;
    out->factor_nnz = first->factor_nnz;
    out->factor_bytes = first->factor_bytes;
    out->rcond = first->rcond;
}

static void set_message(uz_summary *out, const codec_cases *counts)
{
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

void overall_summary(uz_summary *out, codec_cases *counts, uz_result *const *results, const uz_problem *problem)
{
    int64_t worst = 0;
    uz_timings times = {0};
    double bound = 0.0;
    *counts = (codec_cases){.count = problem->n_cases};
    for (int64_t i = 0; i < problem->n_cases; i++) {
        counts->outcomes[results[i]->summary.outcome]++;
        worst = is_worse(results[i], results[worst]) ? i : worst;
        bound = fmax(bound, bound_of(results[i]));
        uz_timings_add(&times, &results[i]->summary.timings);
    }
    *out = results[worst]->summary;
    counts->worst = problem->cases[worst].name;
    out->certificate.relative_error = bound;
    out->timings = times;
    out->iterations = out->restarts = out->refinements = 0;
    for (int64_t i = 0; i < problem->n_cases; i++) {
        out->iterations += results[i]->summary.iterations;
        out->restarts += results[i]->summary.restarts;
        out->refinements += results[i]->summary.refinements;
    }
    take_factor(out, &results[0]->summary);
    set_message(out, counts);
}
