/* suggest.c: whether a cheaper level would have served: digits beyond a tenth of what the mesh loses describe the mesh,
 * not the body. */
#include "assembly/assembly.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "run/solve.h"

#include <math.h>
#include <stdlib.h>

/* What `balanced` leaves of the mesh's error, and the part of the time that is worth a word. */
#define OF_MESH    0.1
#define LEAST_GAIN 0.2

/* Where the mesh's error is estimated for this alone: seconds for each node of an element, from above (0.013e-6 for
 * quad4, 0.07e-6 for hex8 with incompatible modes on a machine of 2.5 GHz), and what it may take of the whole solve. */
#define ESTIMATE_S   1e-7
#define MOST_OF_TIME 0.02

uz_suggestion uz_trade_suggest(const uz_trade *trade, double mesh_error, double solver_error, double extra_s)
{
    uz_suggestion s = {.relative_error = fmin(1.0, OF_MESH * mesh_error),
                       .mesh_error = mesh_error,
                       .solver_error = solver_error,
                       .total_s = trade->total_s};
    const uz_trade_step *step = mesh_error > 0.0 ? uz_trade_reach(trade, s.relative_error) : NULL;
    if (!step || !(solver_error < s.relative_error))
        return (uz_suggestion){0};
    s.seconds = uz_trade_cost(trade, step) + extra_s;
    s.share = s.seconds / s.total_s;
    s.iterations = step->iterations;
    s.any = s.share <= 1.0 - LEAST_GAIN;
    return s.any ? s : (uz_suggestion){0};
}

/* Runs that were asked for an error, and could have stopped earlier. */
static bool may_save(const uz_run *run)
{
    const uz_trade *trade = &run->result->trade;
    const uz_trade_step *coarsest = uz_trade_reach(trade, OF_MESH);
    return run->body->is_scene && run->all > 0 && run->result->summary.outcome == UZ_CONVERGED &&
           run->settings->stopping == UZ_STOP_CERTIFIED && !run->settings->balanced && run->it.origin == UZ_FROM_ZERO &&
           coarsest && uz_trade_cost(trade, coarsest) <= (1.0 - LEAST_GAIN) * trade->total_s;
}

static bool is_cheap(const uz_run *run)
{
    const uz_mesh *mesh = &run->body->model.mesh;
    return ESTIMATE_S * (double)mesh->first[mesh->n_elements] <= MOST_OF_TIME * run->result->trade.total_s;
}

void uz_run_suggest(uz_run *run)
{
    uz_summary *summary = &run->result->summary;
    uz_trade *trade = &run->result->trade;
    if (!may_save(run) || !is_cheap(run))
        return;
    double start = uz_seconds();
    const uz_scene scene = uz_run_scene(run);
    double mesh_error = uz_estimate_mesh_error(&run->body->model, &scene, run->result->u);
    double estimate_s = uz_seconds() - start;
    trade->total_s += estimate_s;
    /* what followed the iterations has an estimate now, as with `balanced`, which certifies twice where it asks for
     * less than it begins with */
    summary->suggestion =
        uz_trade_suggest(trade, mesh_error, summary->certificate.relative_error, summary->timings.certify);
}
