#include "work/state.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The rule for changing this layout: another one gets another STATE_VERSION, and one that is not known is not read.
 * Numbers come first, in the order of state_pack, then r, rho, Dr, Drho, best_r and anchor, m each. Counts are below
 * 2^53, so that a double holds them. */
enum { STATE_VERSION = 1, STATE_NUMBERS = 16, STATE_VECTORS = 6 };

/* The numbers that methods have in stored states are their places here; new ones are added at the end. */
static const uz_method METHODS[] = {
    UZ_METHOD_AUTO,       UZ_METHOD_UZAWA,     UZ_METHOD_ACCELERATED,    UZ_METHOD_ACCELERATED_RESTART,
    UZ_METHOD_ACTIVE_SET, UZ_METHOD_CONJUGATE, UZ_METHOD_DUAL_ACTIVE_SET};
enum { N_METHODS = sizeof METHODS / sizeof METHODS[0] };

static double method_number(uz_method method)
{
    for (int i = 0; i < N_METHODS; i++)
        if (METHODS[i] == method)
            return i;
    return -1.0;
}

static void list_vectors(uz_state *s, double **list[STATE_VECTORS])
{
    double **const all[STATE_VECTORS] = {&s->r, &s->rho, &s->Dr, &s->Drho, &s->best_r, &s->anchor};
    memcpy(list, all, sizeof all);
}

double *state_pack(const uz_state *state, int64_t *count)
{
    uz_state s = *state;
    double **vectors[STATE_VECTORS];
    *count = STATE_NUMBERS + STATE_VECTORS * s.m;
    double *x = calloc((size_t)*count, sizeof *x);
    if (!x)
        return NULL;
    const double all[STATE_NUMBERS] = {STATE_VERSION,
                                       (double)state->m,
                                       method_number(state->method),
                                       method_number(state->made_by),
                                       state->phase,
                                       (double)state->phase_end,
                                       (double)state->iteration,
                                       (double)state->restarts,
                                       (double)state->next_check,
                                       (double)state->best_iteration,
                                       state->alpha,
                                       state->tau,
                                       state->step_norm,
                                       state->best_bound,
                                       state->best_relative,
                                       state->as_given ? 1.0 : 0.0};
    memcpy(x, all, sizeof all);
    list_vectors(&s, vectors);
    for (int k = 0; k < STATE_VECTORS; k++)
        if (*vectors[k] && s.m > 0)
            memcpy(x + STATE_NUMBERS + k * s.m, *vectors[k], (size_t)s.m * sizeof *x);
    return x;
}

/* The number as a count; false if it is none. */
static bool take_count(int64_t *out, double x)
{
    if (!(x >= 0.0) || x > 9007199254740992.0 || x != floor(x))
        return false;
    *out = (int64_t)x;
    return true;
}

uz_state *state_unpack(const double *x, int64_t count)
{
    double **vectors[STATE_VECTORS];
    int64_t m = 0, phase = 0, method = 0, made_by = 0;
    if (count < STATE_NUMBERS || !take_count(&m, x[1]) || m > (count - STATE_NUMBERS) / STATE_VECTORS ||
        STATE_NUMBERS + STATE_VECTORS * m != count)
        return NULL;
    uz_state *s = calloc(1, sizeof *s);
    if (!s)
        return NULL;
    s->m = m;
    bool ok = x[0] == STATE_VERSION && take_count(&method, x[2]) && method < N_METHODS && take_count(&made_by, x[3]) &&
              made_by < N_METHODS && take_count(&phase, x[4]) && take_count(&s->phase_end, x[5]) &&
              take_count(&s->iteration, x[6]) && take_count(&s->restarts, x[7]) && take_count(&s->next_check, x[8]) &&
              take_count(&s->best_iteration, x[9]) && phase <= INT32_MAX;
    s->method = METHODS[ok ? method : 0];
    s->made_by = METHODS[ok ? made_by : 0];
    s->phase = (int32_t)phase;
    s->alpha = x[10];
    s->tau = x[11];
    s->step_norm = x[12];
    s->best_bound = x[13];
    s->best_relative = x[14];
    s->as_given = x[15] == 1.0;
    list_vectors(s, vectors);
    x += STATE_NUMBERS;
    for (int k = 0; ok && k < STATE_VECTORS; k++, x += m) {
        *vectors[k] = malloc(m > 0 ? (size_t)m * sizeof *x : 1);
        ok = *vectors[k] != NULL;
        if (ok && m > 0)
            memcpy(*vectors[k], x, (size_t)m * sizeof *x);
    }
    if (ok)
        return s;
    uz_state_free(s);
    return NULL;
}

uz_state *state_from_reactions(const double *r, int64_t m)
{
    uz_state *s = calloc(1, sizeof *s);
    double *copy = malloc(m > 0 ? (size_t)m * sizeof *copy : 1);
    if (!s || !copy) {
        free(s);
        free(copy);
        return NULL;
    }
    if (m > 0)
        memcpy(copy, r, (size_t)m * sizeof *copy);
    s->m = m;
    s->r = copy;
    return s;
}
