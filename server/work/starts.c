#include "work/starts.h"
#include "core/alloc.h"
#include "work/state.h"
#include "work/trade.h"

#include <math.h>
#include <stdlib.h>

/* ---- reading */

store_status starts_reactions(store *s, const char *id, int64_t number, double **r, int64_t *count)
{
    store_status status = store_get_vector(s, id, number, "reactions", r, count);
    bool finite = true;
    for (int64_t i = 0; i < *count && finite; i++)
        finite = isfinite((*r)[i]);
    if (!finite) {
        free(*r);
        *r = NULL;
    }
    return status;
}

/* The state that the job left, or its reactions; *out NULL: neither. */
static store_status load_state(uz_state **out, store *s, const char *id, int64_t number, bool continued)
{
    double *x = NULL;
    int64_t count = 0;
    store_status status = STORE_NOT_FOUND;
    *out = NULL;
    if (continued)
        status = store_get_vector(s, id, number, STATE_VECTOR, &x, &count);
    if (status == STORE_OK)
        *out = state_unpack(x, count);
    free(x);
    if (*out || (status != STORE_OK && status != STORE_NOT_FOUND))
        return status;
    status = starts_reactions(s, id, number, &x, &count);
    if (x)
        *out = state_from_reactions(x, count);
    free(x);
    return status == STORE_NOT_FOUND ? STORE_OK : status;
}

store_status starts_load(starts *out, store *s, const codec_request *request)
{
    const codec_start *start = &request->start;
    *out = (starts){.n = 0};
    if (!start->job[0] && !start->reactions)
        return STORE_OK;
    out->n = request->problem.n_cases > 0 ? request->problem.n_cases : 1;
    out->states = calloc((size_t)out->n, sizeof *out->states);
    out->histories = calloc((size_t)out->n, sizeof *out->histories);
    out->rows = calloc((size_t)out->n, sizeof *out->rows);
    out->trades = calloc((size_t)out->n, sizeof *out->trades);
    for (int64_t i = 0; out->trades && i < out->n; i++)
        uz_trade_clear(&out->trades[i]);
    if (!out->states || !out->histories || !out->rows || !out->trades) {
        starts_clear(out);
        return STORE_OK; /* without the memory for it the run begins at zero */
    }
    store_status status = STORE_OK;
    if (!start->continued) { /* every case from the same reactions */
        uz_state *first = NULL;
        store_case *found = NULL;
        size_t count = 0;
        if (start->reactions)
            first = state_from_reactions(start->reactions, start->n_reactions);
        else if (start->case_name[0])
            status = store_get_cases(s, start->job, start->case_name, &found, &count);
        const int64_t number = count > 0 ? found[0].number : 0; /* of the case that it names; 0: the job has none */
        store_cases_free(found, count);
        if (!start->reactions && status == STORE_OK)
            status = load_state(&first, s, start->job, number, false);
        for (int64_t i = 0; first && i < out->n; i++)
            out->states[i] = i == 0 ? first : state_from_reactions(first->r, first->m);
        return status;
    }
    for (int64_t i = 0; i < out->n; i++) {
        const int64_t number = request->problem.n_cases > 0 ? i + 1 : 0;
        int64_t columns = 0, count = 0;
        double *trade = NULL;
        status = load_state(&out->states[i], s, start->job, number, true);
        if (status == STORE_OK && (!out->states[i] || !out->states[i]->rho))
            continue; /* reactions alone: nothing goes on from there */
        if (status == STORE_OK)
            status = store_get_history(s, start->job, number, -1, &out->histories[i], &out->rows[i], &columns);
        if (status != STORE_OK && status != STORE_NOT_FOUND)
            return status;
        if (status == STORE_OK && columns != CODEC_HISTORY_COLUMNS)
            out->rows[i] = 0; /* written by another version: left out */
        /* What accuracy took that run; nothing where it was not recorded, or is damaged: an answer does not need it. */
        status = store_get_vector(s, start->job, number, TRADE_VECTOR, &trade, &count);
        trade_unpack(&out->trades[i], trade, status == STORE_OK ? count : 0);
        free(trade);
        if (status != STORE_OK && status != STORE_NOT_FOUND && status != STORE_DAMAGED)
            return status;
    }
    return STORE_OK;
}

void starts_clear(starts *s)
{
    for (int64_t i = 0; i < s->n; i++) {
        if (s->states)
            uz_state_free(s->states[i]);
        if (s->histories)
            free(s->histories[i]);
    }
    uz_free_all(s->states, s->histories, s->rows, s->trades);
    *s = (starts){.n = 0};
}
