/* dual_active_set.c: the exact solution by one exchange after the other, with a factor that is updated: what is left
 * where all wrong rows cannot change places at once, as on long beams and wide plates, where a row that is let go
 * moves the body far away from it.
 *
 * From no contact the steps are as many as rows touch, and some; from contact everywhere as many as do not
 * (exchange.h). Which is less is not known before: both go on by turns until one is there, and none gets far ahead of
 * the other in work. A turn is twice as long as the one before, so that all of it takes at most some four times what
 * the shorter way takes alone. What is counted is work, not time: the answer does not depend on the machine. */
#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/error.h"
#include "methods/exchange.h"

#include <math.h>

/* The first turn: so many columns of D. */
#define FIRST_TURN 64.0

typedef struct {
    uz_exchange *way[2]; /* by side; NULL: there is none, or it led nowhere */
    uz_exchange_side side;
    bool *active;  /* m */
    double *r, *g; /* m */
    uz_exchange_end end;
} race;

/* The answer of the side that is there first; false: that of the gaps can't be solved with. */
static uz_status finish(bool *there, race *x, uz_dual_load *load, uz_error *err)
{
    *there = true;
    uz_exchange_read(x->r, x->g, x->active, x->way[x->side]);
    if (x->side == UZ_EXCHANGE_REACTIONS)
        return UZ_OK;
    uz_active_end end;
    uz_status status = uz_dual_load_solve_active(load, &end, x->r, x->g, x->active, err);
    *there = end == UZ_ACTIVE_SOLVED;
    return status;
}

/* Turns until one side is there, all have led nowhere, or the limits are met. */
static uz_status run_race(bool *there, race *x, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                          uz_error *err)
{
    const uz_stop stop = {options->hooks, options->deadline};
    const double most = options->work > 0.0 ? options->work : INFINITY;
    const int64_t steps = options->max_iterations - it->iteration;
    uz_status status = UZ_OK;
    *there = false;
    /* A column of no rows is no work. */
    for (double turn = FIRST_TURN * fmax(uz_dual_load_column_work(load), 1.0);
         status == UZ_OK && (x->way[0] || x->way[1]); x->side = !x->side) {
        uz_exchange *way = x->way[x->side];
        if (!way)
            continue;
        int64_t made;
        if (uz_exchange_work(way, &made) >= most)
            break;
        status = uz_exchange_continue(&x->end, way, steps, fmin(turn, most), it->ray, err);
        const double work = uz_exchange_work(way, &made);
        if (status != UZ_OK || uz_stop_is_due(&stop) || made >= steps)
            break;
        if (x->end != UZ_EXCHANGE_STOPPED)
            status = finish(there, x, load, err);
        if (*there)
            break;
        if (x->end != UZ_EXCHANGE_STOPPED || work < fmin(turn, most)) { /* round in circles */
            uz_exchange_free(way);
            x->way[x->side] = NULL;
        }
        if (x->side == UZ_EXCHANGE_GAPS || !x->way[UZ_EXCHANGE_GAPS])
            turn *= 2.0;
    }
    return status;
}

static uz_status run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                     uz_history *history, uz_error *err)
{
    static const uz_end ends[] = {[UZ_EXCHANGE_SOLVED] = UZ_END_SOLVED,
                                  [UZ_EXCHANGE_UNDECIDED] = UZ_END_UNDECIDED,
                                  [UZ_EXCHANGE_RAY] = UZ_END_RAY};
    const uz_stop stop = {options->hooks, options->deadline};
    const int64_t m = it->m;
    race x = {.active = uz_alloc_zero(m, sizeof(bool)),
              .r = uz_alloc_zero(m, sizeof(double)),
              .g = uz_alloc_zero(m, sizeof(double))};
    bool there = false;
    uz_status status = it->begun ? UZ_OK : uz_iterate_begin(it, load, options, history, err);
    if (!x.active || !x.r || !x.g)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for an active set of %lld rows", (long long)m);
    *end = it->best_relative <= options->target ? UZ_END_TARGET : UZ_END_STALLED;
    if (status != UZ_OK || *end == UZ_END_TARGET || uz_should_stop(end, it, options))
        goto done;
    it->law->kind->active(it->law, x.active, it->r, m);
    status = uz_exchange_create(&x.way[UZ_EXCHANGE_REACTIONS], UZ_EXCHANGE_REACTIONS, it->warm ? x.active : NULL, NULL,
                                it->law, load, &stop, err);
    if (status == UZ_OK)
        status = uz_exchange_create(&x.way[UZ_EXCHANGE_GAPS], UZ_EXCHANGE_GAPS, NULL, NULL, it->law, load, &stop, err);
    if (status == UZ_OK)
        status = run_race(&there, &x, it, load, options, err);
    if (status != UZ_OK || (!there && options->yields))
        goto done;
    int64_t steps = 0;
    if (there) {
        *end = ends[x.end];
        (void)uz_exchange_work(x.way[x.side], &steps);
        it->iteration += steps > 0 ? steps - 1 : 0;
    } else if (x.way[UZ_EXCHANGE_REACTIONS]) { /* the reactions so far, which bound the energy from below */
        x.side = UZ_EXCHANGE_REACTIONS;
        status = finish(&there, &x, load, err);
        (void)uz_exchange_work(x.way[x.side], &steps);
        it->iteration += steps;
        (void)uz_should_stop(end, it, options);
    }
    if (status == UZ_OK)
        status = uz_iterate_take(it, x.r, x.g, load, UZ_METHOD_DUAL_ACTIVE_SET, err);
    if (status == UZ_OK)
        status = uz_iterate_record(it, load, options, history, 0.0, false, err);
done:
    uz_exchange_free(x.way[0]);
    uz_exchange_free(x.way[1]);
    uz_free_all(x.active, x.r, x.g);
    return status;
}

const uz_method_kind uz_method_dual_active_set = {
    .method = UZ_METHOD_DUAL_ACTIVE_SET, .name = "dual_active_set", .one_sided = true, .exact = true, .run = run};
