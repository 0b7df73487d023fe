/* active_set.c: exact solution on the contact by guessing which rows touch.
 *
 * Primal-dual active set steps (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003)): solve D_AA r_A = g0_A, then
 * drop rows that pull and add rows that penetrate, all at once. For a general positive definite D these steps may
 * cycle, so the number of wrong rows is watched: when it has not come down for a few steps, one row at a time is
 * exchanged, the last wrong one (Murty 1974), until it does: block principal pivoting (Judice and Pires, Comput. Oper.
 * Res. 21 (1994)), which terminates. Where a guess holds rows that depend on each other, or only single exchanges
 * are left, exchange.h solves from that guess, if it can. */
#include "methods/iterate.h"

#include "core/alloc.h"
#include "core/error.h"
#include "dual/interior.h"
#include "methods/exchange.h"

#include <math.h>
#include <string.h>

/* Where steps are small they go on to the exact answer after the target is met: there the certificate of a cached body
 * is cheaper by half a linear solve, which is more than the steps cost. */
enum {
    PATIENCE = 3,
    CIRCLES = 4,
    NEARLY = 2,
    MAX_STEPS = 400,
    EXTRA_STEPS = 12,
    FEW_ROWS = 1024,
    GUESSES = 8,
    MANY_GUESSES = 32
};

/* What an exchange of all wrong rows is expected to leave of them, before it was tried. */
#define FAIR_RATE 0.5

typedef enum { GUESS, EXCHANGE, N_MOVES } move;

typedef struct {
    bool *active;  /* m: the current guess */
    bool *held;    /* m: the last one, as its solution left it */
    bool *refuted; /* m: rows whose part of it is wrong */
    uz_active_end solved;
    double *r;                             /* m: its solution, signs unchecked */
    double *g;                             /* m: its gaps */
    int64_t wrong, fewest, patience, idle; /* idle: steps since there were `fewest` */
    move move;                             /* the last one */
    double rate[N_MOVES];                  /* wrong rows after the last move of each kind over those before */
    int64_t before;                        /* wrong rows before it, 0: there was none */
    bool from_inside;                      /* an interior point was asked */
    uint64_t tried[MAX_STEPS];             /* digests of the guesses so far, n_tried of them */
    int n_tried;
    bool circles; /* the operator came back to a guess that was wrong already */
} pivoting;

/* From the start: the operator's own guess, where it has one. Else the rows that a projected gradient step would leave
 * in contact; of those without a reaction all that penetrate, as there may be no step size yet. */
static void guess(pivoting *p, const uz_iterate *it, uz_dual_load *load)
{
    const uz_law *law = it->law;
    const double *g0 = load->g0;
    if (it->iteration == 0 && !it->warm && uz_dual_load_guess_active(load, p->active))
        return;
    for (int64_t i = 0; i < it->m; i++)
        p->g[i] = g0[i] - it->Dr[i];
    law->kind->active(law, p->active, it->r, it->m);
    law->kind->predict(law, it->close, it->r, p->g, it->step, it->m);
    law->kind->penetration(law, p->r, p->g, it->m);
    for (int64_t i = 0; i < it->m; i++)
        p->active[i] = p->active[i] ? it->close[i] : p->r[i] > 0.0;
}

/* Which rows a guess has (FNV-1a). Two that are taken for one cost time, and no more. */
static uint64_t digest(const bool *active, int64_t m)
{
    uint64_t value = 0xcbf29ce484222325u;
    for (int64_t i = 0; i < m; i++)
        value = (value ^ (active[i] ? (uint64_t)i + 1 : 0)) * 0x100000001b3u;
    return value;
}

static void flip(bool *active, const bool *refuted, int64_t m)
{
    for (int64_t i = 0; i < m; i++)
        active[i] = active[i] != refuted[i];
}

static bool was_tried(const pivoting *p, uint64_t guess)
{
    bool tried = false;
    for (int k = 0; k < p->n_tried; k++)
        tried = tried || guess == p->tried[k];
    return tried;
}

/* The next guess: all wrong rows change places, or the operator makes a guess of its own, whichever has done better.
 * Where only single exchanges are left, the operator's guesses come first, and one exchange after each that was in
 * vain, as is the guess that has just been found wrong. Where a step takes a linear solve, so many single ones are
 * never worth it while exchanges of all do not come back to a guess: on slender bodies the number of wrong rows goes up
 * and down on the way. */
static void exchange(pivoting *p, uz_dual_load *load, int64_t m)
{
    bool better = p->wrong < p->fewest, all = better || p->patience > 0;
    if (p->before > 0) /* how far the last move brought the number of wrong rows down */
        p->rate[p->move] = (double)p->wrong / (double)p->before;
    p->before = p->wrong;
    p->patience = better ? PATIENCE : p->patience - 1;
    p->idle = better ? 0 : p->idle + 1;
    const bool ask = all ? p->rate[GUESS] <= p->rate[EXCHANGE] : p->move != GUESS || p->rate[GUESS] < 1.0;
    p->move = EXCHANGE;
    if (better)
        p->fewest = p->wrong;
    if (ask)
        memcpy(p->held, p->active, (size_t)m * sizeof *p->held);
    if (ask && uz_dual_load_guess_active(load, p->active)) {
        const uint64_t guessed = digest(p->active, m);
        if (guessed != p->tried[p->n_tried - 1]) {
            p->circles = was_tried(p, guessed);
            p->move = GUESS;
            return;
        }
        memcpy(p->active, p->held, (size_t)m * sizeof *p->held);
        p->rate[GUESS] = 1.0;
    }
    flip(p->active, p->refuted, m);
    if (all || (!load->dual->can->cheap_steps && !was_tried(p, digest(p->active, m))))
        return;
    flip(p->active, p->refuted, m);
    int64_t last = m - 1;
    while (last > 0 && !p->refuted[last])
        last--;
    p->active[last] = p->active[last] != p->refuted[last];
}

/* Only single exchanges are left. Each costs a factorization here, and a small part of one where factors are updated.
 */
static bool is_stuck(const pivoting *p)
{
    return p->wrong >= p->fewest && p->patience == 0;
}

/* Where each row that joins costs a linear solve, and they are not few, the iterations do better. */
static bool may_exchange(const uz_iterate *it, const uz_dual_load *load)
{
    return load->dual->rows_may_depend && (load->dual->can->cheap_steps || it->m <= FEW_ROWS);
}

/* A wrong row or two among bounds are weakly active ones, whose signs rounding makes: the answer is handed over to be
 * certified, which takes less than an interior point, and mostly ends it. */
static bool is_nearly_right(const pivoting *p, const uz_dual_load *load, const uz_method_options *options)
{
    return options->yields && p->fewest <= NEARLY && !load->dual->rows_may_depend;
}

/* Once, where guesses lead no further: the rows that an interior point finds, if its steps take less than to exchange
 * the rows one by one. Of rows that depend on each other it finds all that touch, where exchanges need a part that is
 * independent and presses. */
static uz_status look_from_inside(pivoting *p, bool *found, const uz_iterate *it, uz_dual_load *load, uz_error *err)
{
    const double m = (double)it->m, exchanges = load->dual->can->cheap_steps ? m * m * m / 8.0 : INFINITY;
    *found = false;
    if (p->from_inside || (load->dual->can->cheap_steps && load->dual->rows_may_depend))
        return UZ_OK;
    p->from_inside = true;
    uz_status status = uz_dual_load_interior(load, found, p->active, exchanges, err);
    if (*found) {
        p->fewest = it->m + 1;
        p->patience = PATIENCE;
        p->idle = 0;
        p->before = 0;
        p->move = EXCHANGE;
    }
    return status;
}

/* Solves exactly from the guess, whatever rows depend on each other. */
static uz_status solve_by_exchange(pivoting *p, uz_end *end, uz_iterate *it, uz_dual_load *load,
                                   const uz_method_options *options, uz_history *history, uz_error *err)
{
    static const uz_end ends[] = {[UZ_EXCHANGE_SOLVED] = UZ_END_SOLVED,
                                  [UZ_EXCHANGE_UNDECIDED] = UZ_END_UNDECIDED,
                                  [UZ_EXCHANGE_RAY] = UZ_END_RAY,
                                  [UZ_EXCHANGE_STOPPED] = UZ_END_STALLED};
    uz_stop stop = {options->hooks, options->deadline};
    uz_exchange_end exchanged;
    int64_t n = options->max_iterations - it->iteration;
    uz_status status = uz_exchange_run(&exchanged, &n, p->r, p->g, it->ray, p->active, NULL, it->law, load, &stop, err);
    if (status != UZ_OK)
        return status;
    *end = ends[exchanged];
    it->iteration += n > 0 ? n - 1 : 0; /* uz_iterate_take counts one */
    if (exchanged == UZ_EXCHANGE_STOPPED && uz_should_stop(end, it, options))
        return UZ_OK;
    status = uz_iterate_take(it, p->r, p->g, load, UZ_METHOD_ACTIVE_SET, err);
    if (status == UZ_OK)
        status = uz_iterate_record(it, load, options, history, 0.0, false, err);
    return status;
}

/* The answer, or where whoever goes on begins, is what is bounded: operators leave guesses unbounded that are seen to
 * be wrong on the way or pull, of which the last one is at an end, without what pulls. */
static uz_status bound_last(uz_iterate *it, uz_dual_load *load, uz_error *err)
{
    if (load->dual->can->exact || (isfinite(it->best_bound) && it->best_iteration == it->iteration))
        return UZ_OK;
    const uz_status status = uz_dual_load_apply(load, it->Dr, it->r, err);
    if (status != UZ_OK) /* also where there is no time for it */
        return status == UZ_ERR_CANCELLED ? UZ_OK : status;
    return uz_iterate_bound(it, load, UZ_METHOD_ACTIVE_SET, err);
}

/* Steps: the answer of the guess, and the next guess, until a wrong guess is not left or none can be solved. */
static uz_status run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                     uz_history *history, uz_error *err)
{
    const int64_t m = it->m;
    pivoting p = {.active = uz_alloc_zero(m, sizeof(bool)),
                  .held = uz_alloc_zero(m, sizeof(bool)),
                  .refuted = uz_alloc_zero(m, sizeof(bool)),
                  .r = uz_alloc_zero(m, sizeof(double)),
                  .g = uz_alloc_zero(m, sizeof(double)),
                  .fewest = m + 1,
                  .patience = PATIENCE,
                  .rate[EXCHANGE] = FAIR_RATE};
    int extra = load->dual->can->cheap_steps ? EXTRA_STEPS : 0;
    bool over = false; /* no guess can be solved; too little time is found by whoever goes on */
    load->begins = true;
    uz_status status = it->begun ? UZ_OK : uz_iterate_begin(it, load, options, history, err);
    load->begins = false;
    if (!p.active || !p.held || !p.refuted || !p.r || !p.g)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for an active set of %lld rows", (long long)m);
    if (status != UZ_OK)
        goto done;
    guess(&p, it, load);
    *end = it->best_relative <= options->target && !it->guessed ? UZ_END_TARGET : UZ_END_STALLED;
    if (*end == UZ_END_TARGET)
        goto done;
    for (int k = 0; k < MAX_STEPS && !over; k++) {
        bool found = false;
        if (uz_should_stop(end, it, options))
            goto done;
        if (p.circles && !is_nearly_right(&p, load, options))
            status = look_from_inside(&p, &found, it, load, err);
        p.circles = found = false;
        p.tried[p.n_tried++] = digest(p.active, m);
        if (status == UZ_OK)
            status = uz_dual_load_solve_active(load, &p.solved, p.r, p.g, p.active, err);
        over = p.solved != UZ_ACTIVE_SOLVED;
        if (status == UZ_OK && !over) {
            p.wrong = it->law->kind->refute(it->law, p.refuted, p.active, p.r, p.g, it->m);
            status = uz_iterate_take(it, p.r, p.g, load, UZ_METHOD_ACTIVE_SET, err);
            if (status == UZ_OK)
                status = uz_iterate_record(it, load, options, history, 0.0, false, err);
            if (p.wrong == 0)
                *end = UZ_END_SOLVED;
            else if (it->best_relative <= options->target)
                *end = UZ_END_TARGET;
        }
        if (status != UZ_OK || *end == UZ_END_SOLVED || (*end == UZ_END_TARGET && (over || extra-- == 0)))
            goto done;
        if ((over && !uz_should_stop(end, it, options)) ||
            (!over && is_stuck(&p) && (p.move != GUESS || p.idle >= CIRCLES) && !is_nearly_right(&p, load, options)))
            status = look_from_inside(&p, &found, it, load, err);
        if (status != UZ_OK)
            goto done;
        over = over && !found;
        if (found)
            continue;
        if (is_stuck(&p) && may_exchange(it, load)) {
            status = solve_by_exchange(&p, end, it, load, options, history, err);
            goto done;
        }
        if (is_stuck(&p) && options->yields && (p.move != GUESS || p.idle >= GUESSES || k >= MANY_GUESSES)) {
            *end = UZ_END_STALLED;
            goto done;
        }
        if (!over)
            exchange(&p, load, it->m);
    }
    if (uz_should_stop(end, it, options))
        goto done;
    *end = over && p.solved == UZ_ACTIVE_RAY ? UZ_END_RAY : over ? UZ_END_UNSOLVED : UZ_END_STALLED;
    if (*end == UZ_END_RAY)
        memcpy(it->ray, p.r, (size_t)it->m * sizeof *it->ray);
    else if (may_exchange(it, load))
        status = solve_by_exchange(&p, end, it, load, options, history, err);
done:
    if (status == UZ_OK && p.before > 0 && !over && *end != UZ_END_SOLVED && *end != UZ_END_TARGET)
        status = bound_last(it, load, err);
    uz_free_all(p.active, p.held, p.refuted, p.r, p.g);
    return status;
}

const uz_method_kind uz_method_active_set = {
    .method = UZ_METHOD_ACTIVE_SET, .name = "active_set", .one_sided = true, .run = run};
