#include "codec/codec.h"
#include "codec/encode_trade.h"
#include "codec/text.h"

#include <math.h>

/* A named number inside an object. */
typedef struct {
    const char *key;
    double value;
} named;

static void put_named(text *t, const named *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        text_key(t, list[i].key);
        text_number(t, list[i].value);
    }
}

static void put_object(text *t, const char *key, const named *list, size_t count)
{
    text_key(t, key);
    text_open(t, '{');
    put_named(t, list, count);
    text_close(t, '}');
}

static void put_count(text *t, const char *key, int64_t value)
{
    text_key(t, key);
    text_integer(t, value);
}

static void put_word(text *t, const char *key, const char *value)
{
    text_key(t, key);
    text_string(t, value);
}

static void put_residual(text *t, const char *key, const uz_residual *e)
{
    put_object(t, key, (named[]){{"total", e->total}, {"e1", e->e1}, {"e2", e->e2}, {"e3", e->e3}, {"e4", e->e4}}, 5);
}

static void put_peak(text *t, const uz_evaluation *e, int dim)
{
    put_named(t, (named[]){{"area", e->contact_area}}, 1);
    text_key(t, "max_pressure_at");
    if (e->peak_node < 0) {
        text_raw(t, NULL);
        return;
    }
    text_open(t, '{');
    put_count(t, "node", e->peak_node);
    text_key(t, "x");
    text_numbers(t, e->peak_at, dim);
    text_close(t, '}');
}

static void put_resultant(text *t, const uz_resultant *r, int dim)
{
    text_open(t, '{');
    if (r->on[0])
        put_word(t, "on", r->on);
    text_key(t, "force");
    text_numbers(t, r->force, dim);
    text_key(t, "moment");
    text_numbers(t, dim == 2 ? r->moment + 2 : r->moment, dim == 2 ? 1 : 3);
    text_close(t, '}');
}

static void put_resultants(text *t, const char *key, const uz_resultant *list, int64_t count, int dim)
{
    text_key(t, key);
    text_open(t, '[');
    for (int64_t i = 0; i < count; i++)
        put_resultant(t, &list[i], dim);
    text_close(t, ']');
}

/* Scenes: what acts on the body, and what makes the answer doubtful. */
static void put_evaluation(text *t, const uz_evaluation *e, int dim)
{
    text_key(t, "resultants");
    text_open(t, '{');
    put_resultants(t, "contacts", e->contacts, e->n_contacts, dim);
    put_resultants(t, "supports", e->supports, e->n_supports, dim);
    text_key(t, "loads");
    put_resultant(t, &e->loads, dim);
    put_named(t, (named[]){{"imbalance", e->imbalance}}, 1);
    text_close(t, '}');
    text_key(t, "warnings");
    text_open(t, '[');
    for (int i = 0; i < e->n_warnings; i++) {
        text_open(t, '{');
        put_word(t, "code", e->warnings[i].code);
        put_word(t, "message", e->warnings[i].message);
        put_named(t, (named[]){{"value", e->warnings[i].value}}, 1);
        text_close(t, '}');
    }
    text_close(t, ']');
}

static void put_contact(text *t, const uz_summary *s, bool scene)
{
    text_key(t, "contact");
    text_open(t, '{');
    put_count(t, "candidates", s->m);
    put_count(t, "kept", s->kept);
    put_count(t, "added", s->added);
    put_count(t, "rounds", s->rounds);
    put_count(t, "active", s->active);
    put_named(t, (named[]){{"reaction_sum", s->reaction_sum}, {"max_penetration", s->max_penetration}}, 2);
    if (scene) {
        text_key(t, "force");
        text_numbers(t, s->force, s->dim);
        put_named(t, (named[]){{"max_pressure", s->max_pressure}}, 1);
        if (s->evaluation)
            put_peak(t, s->evaluation, s->dim);
    }
    text_close(t, '}');
}

/* The primal one bounds the minimum from above only where a feasible displacement was found, so with a finite gap. */
static void put_energy(text *t, const uz_certificate *c, const uz_evaluation *e)
{
    double primal = isfinite(c->gap) ? c->energy_primal : INFINITY;
    const named list[] = {{"primal", primal}, {"dual", c->energy_dual}, {"strain", e ? e->strain_energy : NAN}};
    put_object(t, "energy", list, e ? 3 : 2);
}

static void put_certificate(text *t, const uz_certificate *c)
{
    text_key(t, "certificate");
    text_open(t, '{');
    put_named(
        t, (named[]){{"relative_error", c->relative_error}, {"absolute_error", c->absolute_error}, {"gap", c->gap}}, 3);
    put_residual(t, "residual", &c->residual);
    put_residual(t, "relative_residual", &c->relative_residual);
    text_close(t, '}');
}

static void put_flag(text *t, const char *key, bool value)
{
    text_key(t, key);
    text_bool(t, value);
}

static void put_reused(text *t, const uz_reuse *reused)
{
    text_key(t, "reused");
    text_open(t, '{');
    put_flag(t, "assembly", reused->assembly);
    put_flag(t, "ordering", reused->ordering);
    put_flag(t, "factor", reused->factor);
    put_flag(t, "operator", reused->op);
    text_close(t, '}');
}

static void put_factor(text *t, const uz_summary *s)
{
    text_key(t, "factor");
    text_open(t, '{');
    put_flag(t, "cached", s->factor_cached);
    put_reused(t, &s->reused);
    put_word(t, "ordering", uz_ordering_name(s->ordering));
    text_key(t, "contact_last");
    text_bool(t, s->contact_last);
    put_count(t, "nnz", s->factor_nnz);
    put_count(t, "bytes", (int64_t)s->factor_bytes);
    put_named(t, (named[]){{"flops", s->factor_flops}, {"rcond", s->rcond}}, 2);
    text_close(t, '}');
}

/* Of a body that only the obstacle holds. */
static void put_semicoercive(text *t, const uz_semicoercive *s)
{
    const int64_t most = (int64_t)(sizeof s->held_by / sizeof s->held_by[0]);
    text_key(t, "semicoercive");
    text_open(t, '{');
    put_count(t, "free_modes", s->free_modes);
    put_count(t, "rounds", s->rounds);
    put_count(t, "held", s->held);
    text_key(t, "held_by_rows");
    text_open(t, '[');
    for (int64_t i = 0; i < s->held && i < most; i++)
        text_integer(t, s->held_by[i]);
    text_close(t, ']');
    text_close(t, '}');
}

static void put_timings(text *t, const uz_timings *s)
{
    const named list[] = {{"queue", s->queue},     {"parse", s->parse},     {"assemble", s->assemble},
                          {"order", s->order},     {"factor", s->factor},   {"condense", s->condense},
                          {"iterate", s->iterate}, {"certify", s->certify}, {"total", s->total}};
    put_object(t, "timings_s", list, sizeof list / sizeof list[0]);
}

static void put_cost(text *t, const uz_cost *c)
{
    text_key(t, "cost");
    text_open(t, '{');
    put_object(t, "predicted", (named[]){{"seconds", c->seconds}, {"bytes", c->bytes}, {"flops", c->flops}}, 3);
    put_object(t, "actual", (named[]){{"seconds", c->actual_seconds}, {"bytes", c->actual_bytes}}, 2);
    text_key(t, "considered");
    text_open(t, '[');
    for (int k = 0; k < c->n_considered; k++) {
        const uz_cost_option *form = &c->considered[k];
        text_open(t, '{');
        put_word(t, "operator", uz_operator_name(form->op));
        put_named(t, (named[]){{"seconds", form->seconds}, {"bytes", form->bytes}}, 2);
        text_key(t, "fits");
        text_bool(t, form->fits);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_close(t, '}');
}

static void put_problem(text *t, const uz_summary *s, bool scene)
{
    text_key(t, "problem");
    text_open(t, '{');
    put_word(t, "kind", scene ? "scene" : "matrices");
    put_count(t, "d", s->d);
    put_count(t, "m", s->m);
    text_close(t, '}');
}

/* cells: as many as the box has directions. */
static void put_cells(text *t, const int64_t *cells, int dim)
{
    text_key(t, "cells");
    text_open(t, '[');
    for (int axis = 0; axis < dim; axis++)
        text_integer(t, cells[axis]);
    text_close(t, ']');
}

/* A box whose cells were chosen: the grids that were tried for it. */
static void put_ladder(text *t, const uz_ladder *ladder)
{
    text_key(t, "mesh");
    text_open(t, '{');
    put_cells(t, ladder->cells, ladder->dim);
    text_key(t, "ladder");
    text_open(t, '[');
    for (int i = 0; i < ladder->count; i++) {
        const uz_rung *rung = &ladder->rung[i];
        text_open(t, '{');
        put_cells(t, rung->cells, ladder->dim);
        put_count(t, "d", rung->d);
        put_count(t, "iterations", rung->iterations);
        put_named(t,
                  (named[]){{"discretization_error", rung->discretization_error},
                            {"certified_error", rung->certified_error},
                            {"seconds", rung->seconds}},
                  3);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_close(t, '}');
}

static void put_cases(text *t, const codec_cases *cases)
{
    text_key(t, "cases");
    text_open(t, '{');
    put_count(t, "count", cases->count);
    put_word(t, "worst", cases->worst);
    for (int i = 0; i < CODEC_OUTCOMES; i++)
        if (cases->outcomes[i] > 0 || i == UZ_CONVERGED)
            put_count(t, uz_outcome_name((uz_outcome)i), cases->outcomes[i]);
    text_close(t, '}');
}

char *codec_encode_summary(const uz_summary *summary, uz_problem_kind kind)
{
    return codec_encode_run(summary, kind, &(codec_run){.cases = NULL});
}

char *codec_encode_run(const uz_summary *summary, uz_problem_kind kind, const codec_run *run)
{
    text t = {0};
    bool scene = kind == UZ_PROBLEM_SCENE;
    text_open(&t, '{');
    put_word(&t, "outcome", uz_outcome_name(summary->outcome));
    put_word(&t, "message", summary->message);
    put_word(&t, "method", uz_method_name(summary->method));
    put_word(&t, "operator", uz_operator_name(summary->op));
    put_count(&t, "iterations", summary->iterations);
    put_count(&t, "restarts", summary->restarts);
    put_count(&t, "refinements", summary->refinements);
    if (run->started_from)
        put_word(&t, "started_from", run->started_from);
    if (run->cases)
        put_cases(&t, run->cases);
    put_problem(&t, summary, scene);
    put_contact(&t, summary, scene);
    put_energy(&t, &summary->certificate, summary->evaluation);
    put_certificate(&t, &summary->certificate);
    if (summary->evaluation)
        put_evaluation(&t, summary->evaluation, summary->dim);
    put_named(&t,
              (named[]){{"requested_error", summary->requested_error},
                        {"discretization_error", summary->discretization_error},
                        {"alpha", summary->alpha},
                        {"lambda_max", summary->lambda_max}},
              4);
    if (summary->suggestion.any) {
        text_key(&t, "suggestion");
        put_suggestion(&t, &summary->suggestion);
    }
    if (summary->ladder) {
        put_named(&t, (named[]){{"total_error", summary->total_error}}, 1);
        put_ladder(&t, summary->ladder);
    }
    if (summary->outcome == UZ_INFEASIBLE)
        put_named(&t, (named[]){{"infeasible_radius", summary->infeasible_radius}}, 1);
    if (summary->semicoercive.free_modes > 0)
        put_semicoercive(&t, &summary->semicoercive);
    put_factor(&t, summary);
    put_cost(&t, &summary->cost);
    put_timings(&t, &summary->timings);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}
