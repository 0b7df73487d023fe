/* auto.c: which methods run, and in which order, where none was asked for.
 *
 * The active set comes first: on the reference problems it ends in 1 to 10 steps from no contact at all, where
 * conjugate steps need 30 to 100, and in the scaled and bounded forms without ever forming D. Where it fails (only
 * single exchanges are left, dependent rows in the guess, a form that can't) its last answer is handed over to be
 * certified, and then the others follow, each within the work that it is expected to need: exchanges with an updated
 * factor, conjugate steps, which hand the active set a better guess once. From then on these two go on by turns, each
 * turn several times as long as the last, until one is there: which is the faster is not known before, and so all of it
 * takes at most a small multiple of what that one takes.
 *
 * Where D is applied by inner iterations accelerated steps take the place of both: with rows that depend on each other
 * a direction's curvature is less than what the inner iterations leave, and conjugate steps go astray. */
#include "methods/iterate.h"
#include "methods/kinds.h"
#include "methods/turns.h"

#include <math.h>

enum { WARM_UP = 32 };

/* Where auto stands: kept in the iterate, so that a run can go on from there. From TURNS on each second phase is of
 * exchanges, those between of iterations. */
enum { FIRST_GUESS, WARMING_UP, SECOND_GUESS, ITERATING, FIRST_EXCHANGE, TURNS };

/* The first turns: iterations, twice as many as most problems need, and for exchanges the work of as many applications
 * of D. Later ones are so many times as long; exchanges get more where the iterations have not bounded anything yet. */
#define FIRST_TURN 660.0
#define LONGER     4.0
#define UNBOUNDED  16.0

typedef struct {
    bool guess, exchange; /* else it iterates, */
    bool limited;         /* up to it->phase_end */
    double length;        /* FIRST_TURN at first, longer with each turn of both */
    int32_t next;
} phase_kind;

static phase_kind kind_of(int32_t phase, bool exchanges)
{
    const int32_t turns = phase < TURNS ? 0 : (phase - TURNS) / 2 + 1;
    const bool guess = phase == FIRST_GUESS || phase == SECOND_GUESS,
               exchange = phase == FIRST_EXCHANGE || (phase >= TURNS && (phase - TURNS) % 2 == 0);
    const int32_t after[] = {[FIRST_GUESS] = exchanges ? FIRST_EXCHANGE : WARMING_UP,
                             [WARMING_UP] = SECOND_GUESS,
                             [SECOND_GUESS] = ITERATING,
                             [ITERATING] = TURNS,
                             [FIRST_EXCHANGE] = WARMING_UP};
    return (phase_kind){.guess = guess,
                        .exchange = exchange,
                        .limited = !guess && !exchange && (phase == WARMING_UP || exchanges),
                        .length = FIRST_TURN * pow(LONGER, turns),
                        .next = phase < TURNS ? after[phase] : phase + 1};
}

static void begin_phase(uz_iterate *it, int32_t phase, bool exchanges)
{
    const phase_kind kind = kind_of(phase, exchanges);
    const double most = phase == WARMING_UP ? WARM_UP : fmin(kind.length, (double)(INT64_MAX / 4));
    it->phase = phase;
    if (!kind.guess && !kind.exchange)
        it->phase_end = it->iteration + (int64_t)most;
}

bool uz_method_next(uz_method_turn *turn, uz_end *end, uz_iterate *it, const uz_dual_load *load,
                    const uz_method_kind *asked, const uz_method_options *options)
{
    const bool first = !turn->kind, exchanges = load->dual->can->exact,
               several = !asked->run && options->stopping == UZ_STOP_CERTIFIED && it->law->kind->one_sided;
    if (first) {
        const bool conjugate = several && (exchanges || !uz_method_conjugate.exact);
        turn->kind = asked->run ? asked : conjugate ? &uz_method_conjugate : &uz_method_accelerated_restart;
        turn->options = *options;
        turn->options.method = turn->kind->method;
        turn->options.yields = several && exchanges;
    }
    if (!several)
        return first;
    if (first && options->again) {
        begin_phase(it, WARMING_UP, exchanges);
    } else if (first && it->phase == FIRST_EXCHANGE) { /* what was handed over was not good enough */
        uz_iterate_go_back(it);
    } else if (!first) {
        const int32_t over = it->phase;
        const phase_kind ran = kind_of(over, exchanges);
        const bool gave_up = *end == UZ_END_STALLED || *end == UZ_END_UNSOLVED,
                   at_limit = *end == UZ_END_ITERATIONS && it->iteration < options->max_iterations;
        if (turn->last || !(at_limit || (gave_up && (ran.guess || ran.exchange || (ran.limited && over > WARMING_UP)))))
            return false;
        turn->last = gave_up && !ran.guess && !ran.exchange; /* iterations do no better: only exchanges are left */
        begin_phase(it, ran.next, exchanges);
        if (over == FIRST_GUESS && exchanges && it->iteration > 0 && *end == UZ_END_STALLED) {
            *end = UZ_END_NEXT;
            return false;
        }
        if (ran.guess) /* guesses that came to nothing leave r at the best that was found */
            uz_iterate_go_back(it);
    }
    const phase_kind kind = kind_of(it->phase, exchanges);
    const double unbounded = it->phase >= TURNS && isinf(it->best_relative) ? UNBOUNDED : 1.0;
    turn->kind = kind.guess      ? &uz_method_active_set
                 : kind.exchange ? &uz_method_dual_active_set
                                 : uz_method_kind_of(turn->options.method);
    turn->options.max_iterations =
        kind.limited && it->phase_end < options->max_iterations ? it->phase_end : options->max_iterations;
    turn->options.work = unbounded * kind.length * uz_dual_load_column_work(load);
    return true;
}

const uz_method_kind uz_method_auto = {.method = UZ_METHOD_AUTO, .name = "auto"};
