#include "work/answers.h"
#include "core/alloc.h"
#include "work/judge.h"
#include "work/overall.h"
#include "work/state.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- vectors */

static void add_vector(answer_parts *to, const char *name, const double *data, int64_t count)
{
    if (!data)
        return;
    store_vector *v = &to->vectors[to->n_vectors++];
    snprintf(v->name, sizeof v->name, "%s", name);
    v->data = data;
    v->count = count;
}

static bool add_contact_nodes(answer_parts *to, const uz_result *result)
{
    to->contact_nodes = calloc((size_t)result->m + 1, sizeof *to->contact_nodes);
    for (int64_t i = 0; i < result->m && to->contact_nodes; i++)
        to->contact_nodes[i] = (double)result->mesh.contact_node[i];
    add_vector(to, "contact_nodes", to->contact_nodes, result->m);
    return to->contact_nodes != NULL;
}

/* The mesh is the same for all cases: dim, nodes, contact_nodes; where it was chosen also what the request does not
 * say, cells and what was bisected. */
static bool add_places(answers *a, answer_parts *to, const uz_result *result, bool is_scene)
{
    a->dim = is_scene ? result->mesh.dim : 0;
    add_vector(to, "dim", &a->dim, 1);
    if (!is_scene)
        return true;
    add_vector(to, "nodes", result->mesh.xyz, result->mesh.n_nodes * result->mesh.dim);
    for (int i = 0; result->grids && i < 3; i++)
        a->cells[i] = (double)result->grids->cells[i];
    add_vector(to, "cells", result->grids ? a->cells : NULL, 3);
    if (result->grids && result->grids->refined) {
        const int64_t n = result->grids->n_bisected;
        a->bisected = calloc((size_t)n + 1, sizeof *a->bisected);
        for (int64_t i = 0; a->bisected && i < n; i++)
            a->bisected[i] = (double)result->grids->bisected[i];
        add_vector(to, "bisected", a->bisected, n);
        if (!a->bisected)
            return false;
    }
    return !result->mesh.contact_node || add_contact_nodes(to, result);
}

/* ---- history */

/* Seconds count from the first iteration of the first run; the time between the runs is left out. */
static bool add_history(answer_parts *to, const uz_history *history, const double *earlier, int64_t earlier_rows)
{
    /* Rows of the run that was continued up to where the new ones begin. */
    int64_t kept = 0;
    double first = history->count > 0 ? (double)history->rows[0].iteration : 1e300;
    while (kept < earlier_rows && earlier[kept * CODEC_HISTORY_COLUMNS] < first)
        kept++;
    double spent = earlier_rows > 0 ? earlier[(earlier_rows - 1) * CODEC_HISTORY_COLUMNS + 1] : 0.0;
    to->history = calloc((size_t)(kept + history->count) + 1, CODEC_HISTORY_COLUMNS * sizeof *to->history);
    if (!to->history)
        return false;
    if (kept > 0)
        memcpy(to->history, earlier, (size_t)kept * CODEC_HISTORY_COLUMNS * sizeof *earlier);
    for (int64_t i = 0; i < history->count; i++) {
        double *row = to->history + (kept + i) * CODEC_HISTORY_COLUMNS;
        codec_history_row(row, &history->rows[i]);
        row[1] += spent;
    }
    to->history_rows = kept + history->count;
    return true;
}

/* ---- one answer, all answers */

/* What the solver made of the start that it was given, which may be less than what the request asked for. */
static const char *const ORIGINS[] = {
    [UZ_FROM_ZERO] = "zero", [UZ_FROM_REACTIONS] = "warm", [UZ_FROM_STATE] = "continued"};

static bool build_one(answers *a, int64_t i, uz_result *const *results, const codec_request *request,
                      const starts *from)
{
    const uz_result *result = results[i], *first = results[0];
    bool is_scene = request->problem.kind == UZ_PROBLEM_SCENE;
    bool has_earlier = from->histories != NULL && result->summary.origin == UZ_FROM_STATE;
    answer_parts *parts = &a->parts[i];
    codec_run run = {.started_from = request->answer.u ? NULL : ORIGINS[result->summary.origin],
                     .units = &request->problem.scene.units};
    parts->summary = codec_encode_summary(&result->summary, request->problem.kind, &run);
    add_vector(parts, "reactions", result->r, result->m);
    add_vector(parts, "gaps", result->g, result->m);
    add_vector(parts, "ray", result->ray, result->m);
    add_vector(parts, "displacements", result->u, is_scene ? result->mesh.n_nodes * result->mesh.dim : result->d);
    add_vector(parts, "place", result->place, result->mesh.n_nodes * result->mesh.dim);
    add_vector(parts, "free_strain", result->free_strain, result->n_free_strain);
    add_vector(parts, "pressure", result->pressure, result->m);
    if (result->state) { /* without memory for it the run can't be continued, and that is all */
        int64_t count = 0;
        parts->state = state_pack(result->state, &count);
        add_vector(parts, STATE_VECTOR, parts->state, count);
    }
    if (!has_earlier || from->trades[i].total_s > 0.0) { /* else nothing can be told of the whole */
        uz_trade trade = result->trade;
        if (has_earlier)
            trade_join(&trade, &from->trades[i]);
        add_vector(parts, TRADE_VECTOR, parts->trade, trade_pack(parts->trade, &trade));
    }
    /* Of cases whose contacts move, each may have rows of its own. */
    const size_t size = (size_t)first->m * sizeof *first->mesh.contact_node;
    const bool own_rows =
        result->place &&
        (result->m != first->m || (size > 0 && memcmp(result->mesh.contact_node, first->mesh.contact_node, size) != 0));
    if (own_rows && !add_contact_nodes(parts, result))
        return false;
    const char *name = request->problem.n_cases > 0 ? request->problem.cases[i].name : NULL;
    return parts->summary && judge(&parts->summary, request, name, false, a->findings) &&
           add_history(parts, &result->history, has_earlier ? from->histories[i] : NULL,
                       has_earlier ? from->rows[i] : 0);
}

static store_answer as_stored(const answer_parts *parts, const char *name)
{
    return (store_answer){.name = name,
                          .summary = parts->summary,
                          .vectors = parts->vectors,
                          .n_vectors = parts->n_vectors,
                          .history = parts->history,
                          .history_rows = parts->history_rows,
                          .history_columns = CODEC_HISTORY_COLUMNS};
}

static void add_waiting(uz_timings *t, double queue_s, double parse_s)
{
    t->queue = queue_s;
    t->parse = parse_s;
    t->total += queue_s + parse_s;
}

bool answers_build(answers *out, store_outcome *outcome, uz_result *const *results, const codec_request *request,
                   const starts *from, double queue_s, double parse_s)
{
    bool has_cases = request->problem.n_cases > 0, is_scene = request->problem.kind == UZ_PROBLEM_SCENE, ok = true;
    *out = (answers){.n = has_cases ? request->problem.n_cases : 1};
    out->parts = calloc((size_t)out->n, sizeof *out->parts);
    out->findings = calloc((size_t)request->n_assertions + 1, sizeof *out->findings);
    if (!out->parts || !out->findings)
        return false;
    if (!has_cases)
        add_waiting(&results[0]->summary.timings, queue_s, parse_s);
    for (int64_t i = 0; ok && i < out->n; i++)
        ok = build_one(out, i, results, request, from);
    if (!has_cases) {
        ok = ok && add_places(out, &out->parts[0], results[0], is_scene);
        outcome->whole = as_stored(&out->parts[0], NULL);
        return ok;
    }
    /* All cases together: their summary, what they share, and the list of them. */
    codec_cases counts;
    uz_summary overall;
    int64_t first = 0; /* of those that did not begin at zero */
    while (first + 1 < out->n && results[first]->summary.origin == UZ_FROM_ZERO)
        first++;
    out->cases = ok ? calloc((size_t)out->n, sizeof *out->cases) : NULL;
    if (!out->cases)
        return false;
    overall_summary(&overall, &counts, results, &request->problem);
    add_waiting(&overall.timings, queue_s, parse_s);
    codec_run run = {.started_from = ORIGINS[results[first]->summary.origin],
                     .units = &request->problem.scene.units,
                     .cases = &counts};
    out->shared.summary = codec_encode_summary(&overall, request->problem.kind, &run);
    if (!out->shared.summary || !judge(&out->shared.summary, request, NULL, true, out->findings) ||
        !add_places(out, &out->shared, results[0], is_scene))
        return false;
    for (int64_t i = 0; i < out->n; i++)
        out->cases[i] = as_stored(&out->parts[i], request->problem.cases[i].name);
    outcome->cases = out->cases;
    outcome->n_cases = (size_t)out->n;
    outcome->whole = as_stored(&out->shared, NULL);
    return true;
}

void answers_clear(answers *a)
{
    for (int64_t i = a->parts ? 0 : a->n; i <= a->n; i++) {
        answer_parts *one = i < a->n ? &a->parts[i] : &a->shared;
        uz_free_all(one->summary, one->history, one->state, one->contact_nodes);
    }
    uz_free_all(a->parts, a->cases, a->findings, a->bisected);
    *a = (answers){.n = 0};
}
