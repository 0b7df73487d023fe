/* encode_summary.c: the summary of an answer, and what became of assertions about it. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A named number inside an object. */
typedef struct {
    const char *key;
    double value;
} named;

/* In an object under this key; NULL: in the one that is open. */
static void put_named(text *t, const char *key, const named *list, size_t count)
{
    if (key)
        text_open(t, key, '{');
    for (size_t i = 0; i < count; i++)
        text_number(t, list[i].key, list[i].value);
    if (key)
        text_close(t, '}');
}

/* total: how it presses, of a contact. */
static void put_resultant(text *t, const char *key, const uz_resultant *r, const uz_contact_total *total, int dim)
{
    text_open(t, key, '{');
    if (r->on[0])
        text_string(t, "on", r->on);
    text_numbers(t, "force", r->force, dim);
    text_numbers(t, "moment", dim == 2 ? r->moment + 2 : r->moment, dim == 2 ? 1 : 3);
    if (total) {
        put_named(t, NULL,
                  (named[]){{"normal_force", total->normal_force},
                            {"area", total->area},
                            {"mean_pressure", total->mean_pressure},
                            {"max_pressure", total->max_pressure}},
                  4);
        text_numbers(t, "center", total->center, dim);
    }
    if (r->rigid) {
        double turned[3]; /* degrees */
        for (int c = 0; c < 3; c++)
            turned[c] = r->turned[c] * (180 / 3.14159265358979323846);
        text_open(t, "rigid", '{');
        text_numbers(t, "point", r->point, dim);
        text_numbers(t, "displacement", r->moved, dim);
        text_numbers(t, "rotation", dim == 2 ? turned + 2 : turned, dim == 2 ? 1 : 3);
        text_numbers(t, "moment", dim == 2 ? r->about + 2 : r->about, dim == 2 ? 1 : 3);
        text_close(t, '}');
    }
    text_close(t, '}');
}

/* How deep the deformed surfaces stand in each other, of all contacts and of each; what their sides are taken for. */
static void put_surfaces(text *t, const uz_evaluation *e, int dim)
{
    double depth = 0;
    for (int64_t k = 0; k < e->n_contacts; k++)
        depth = e->overlap[k].depth > depth ? e->overlap[k].depth : depth; /* not those that are no number */
    put_named(t, NULL, (named[]){{"geometric_penetration", depth}, {"approach", e->approach}}, 2);
    text_open(t, "penetrations", '[');
    for (int64_t k = 0; k < e->n_contacts; k++) {
        const uz_overlap *o = &e->overlap[k];
        text_open(t, NULL, '{');
        put_named(t, NULL, (named[]){{"geometric_penetration", o->depth}, {"sagitta", o->facets}}, 2);
        if (o->depth > 0)
            text_numbers(t, "at", o->at, dim);
        text_close(t, '}');
    }
    text_close(t, ']');
    if (e->n_surfaces == 0)
        return;
    text_open(t, "surfaces", '[');
    for (int64_t i = 0; i < e->n_surfaces; i++) {
        const uz_contact_surface *s = &e->surfaces[i];
        const bool cone = strcmp(s->shape, "cone") == 0;
        text_open(t, NULL, '{');
        text_integer(t, "contact", s->contact);
        text_string(t, "group", s->group);
        text_bool(t, "slave", s->slave);
        text_string(t, "shape", s->shape);
        text_integer(t, "parts", s->parts);
        if (s->dim > 0)
            text_numbers(t, "point", s->point, s->dim);
        if (s->dim > 0 && strcmp(s->shape, "sphere") != 0)
            text_numbers(t, "axis", s->axis, s->dim);
        put_named(t, NULL, (named[]){{"radius", s->radius}}, s->radius > 0);
        put_named(t, NULL, (named[]){{"tube", s->tube}}, s->tube > 0);
        put_named(t, NULL, (named[]){{"slope", s->slope}}, cone);
        put_named(t, NULL, (named[]){{"largest_offset", s->largest_offset}, {"largest_turn", s->largest_turn}}, 2);
        text_close(t, '}');
    }
    text_close(t, ']');
}

/* Scenes: what acts on the body, what makes the answer doubtful, and numbers that were asked for, as intervals. */
static void put_evaluation(text *t, const uz_evaluation *e, int dim)
{
    text_open(t, "resultants", '{');
    text_open(t, "contacts", '[');
    for (int64_t i = 0; i < e->n_contacts; i++)
        put_resultant(t, NULL, &e->contacts[i], &e->totals[i], dim);
    text_close(t, ']');
    text_open(t, "supports", '[');
    for (int64_t i = 0; i < e->n_supports; i++)
        put_resultant(t, NULL, &e->supports[i], NULL, dim);
    text_close(t, ']');
    put_resultant(t, "loads", &e->loads, NULL, dim);
    text_number(t, "imbalance", e->imbalance);
    text_close(t, '}');
    text_open(t, "warnings", '[');
    for (int i = 0; i < e->n_warnings; i++) {
        text_open(t, NULL, '{');
        text_string(t, "code", e->warnings[i].code);
        text_string(t, "message", e->warnings[i].message);
        text_number(t, "value", e->warnings[i].value);
        text_close(t, '}');
    }
    text_close(t, ']');
    if (e->n_quantities == 0)
        return;
    text_open(t, "quantities", '[');
    for (int64_t i = 0; i < e->n_quantities; i++) {
        const uz_quantity_found *q = &e->quantities[i];
        text_open(t, NULL, '{');
        text_string(t, "name", q->name);
        text_string(t, "quantity", uz_choice_name(UZ_CHOICE_QUANTITY, q->kind));
        put_named(t, NULL,
                  (named[]){{"low", q->low},
                            {"high", q->high},
                            {"value", q->value},
                            {"on_this_mesh", q->found},
                            {"mesh", q->mesh},
                            {"equations", q->equations}},
                  6);
        text_string(t, "kind", q->guaranteed ? "guaranteed" : "estimated");
        if (q->why[0] || q->unproved[0])
            text_string(t, "why", q->why[0] ? q->why : q->unproved);
        text_close(t, '}');
    }
    text_close(t, ']');
}

/* Numbers of the contact that nothing bounds, as the grids tell them. */
static void put_trend(text *t, const char *key, const uz_trend *of)
{
    text_open(t, key, '{');
    put_named(t, NULL, (named[]){{"value", of->value}, {"low", of->low}, {"high", of->high}, {"order", of->order}}, 4);
    text_integer(t, "grids", of->grids);
    text_string(t, "kind", "estimated");
    if (of->why[0])
        text_string(t, "why", of->why);
    text_close(t, '}');
}

static void put_place(text *t, const char *key, int64_t node, const double *x, int dim)
{
    text_open(t, key, '{');
    text_integer(t, "node", node);
    text_numbers(t, "x", x, dim);
    text_close(t, '}');
}

static void put_contact(text *t, const uz_summary *s, bool scene)
{
    const uz_evaluation *e = s->evaluation;
    text_open(t, "contact", '{');
    text_integer(t, "candidates", s->m);
    text_integer(t, "kept", s->kept);
    text_integer(t, "added", s->added);
    text_integer(t, "rounds", s->rounds);
    text_integer(t, "active", s->active);
    put_named(t, NULL, (named[]){{"reaction_sum", s->reaction_sum}, {"max_penetration", s->max_penetration}}, 2);
    if (scene) {
        text_numbers(t, "force", s->force, s->dim);
        text_number(t, "max_pressure", s->max_pressure);
        if (e) {
            text_number(t, "area", e->contact_area);
            put_surfaces(t, e, s->dim);
        }
        if (e && e->peak_node < 0)
            text_raw(t, "max_pressure_at", NULL);
        else if (e)
            put_place(t, "max_pressure_at", e->peak_node, e->peak_at, s->dim);
        if (e && e->n_contacts > 0) {
            text_open(t, "estimates", '{');
            put_trend(t, "max_pressure", &e->peak);
            put_trend(t, "area", &e->area);
            text_close(t, '}');
            const uz_geometry *g = &s->geometry;
            const bool moving = g->kind == UZ_KINEMATICS_MOVING;
            text_open(t, "geometry", '{');
            text_string(t, "kinematics", uz_choice_name(UZ_CHOICE_KINEMATICS, g->kind));
            text_integer(t, "passes", g->passes);
            put_named(
                t, NULL,
                (named[]){{"change", g->change}, moving ? (named){"left", g->left} : (named){"sliding", g->sliding}},
                2);
            text_close(t, '}');
        }
    }
    text_close(t, '}');
}

/* Of a number of which that of the body is the inverse: a safety factor. */
static uz_trend inverse_of(const uz_trend *t)
{
    uz_trend out = *t;
    out.value = 1.0 / t->value;
    out.low = isinf(t->high) ? 0.0 : 1.0 / t->high;
    out.high = t->low > 0.0 ? 1.0 / t->low : (double)INFINITY;
    if (isnan(t->low))
        out.low = out.high = NAN;
    return out;
}

/* Where the body is stressed most, where that is asked for. */
static void put_stress(text *t, const uz_evaluation *e, int dim)
{
    if (!e->stressed || e->von_mises.node < 0)
        return;
    const uz_trend safety = inverse_of(&e->used.trend);
    text_open(t, "stress", '{');
    text_number(t, "von_mises", e->von_mises.value);
    put_place(t, "at", e->von_mises.node, e->von_mises.at, dim);
    if (e->used.node >= 0) {
        text_number(t, "safety", 1.0 / e->used.value);
        put_place(t, "weakest_at", e->used.node, e->used.at, dim);
    }
    text_open(t, "estimates", '{');
    put_trend(t, "von_mises", &e->von_mises.trend);
    if (e->used.node >= 0)
        put_trend(t, "safety", &safety);
    text_close(t, '}');
    text_close(t, '}');
}

/* Of finite kinematics. */
static void put_finite(text *t, const uz_finite *f)
{
    const struct {
        const char *key;
        int64_t value;
    } COUNTS[] = {{"steps", f->steps}, {"failed", f->failed}, {"qps", f->qps},
                  {"most", f->most},   {"held", f->held},     {"shifted", f->shifted}};
    text_open(t, "finite", '{');
    for (size_t k = 0; k < sizeof COUNTS / sizeof *COUNTS; k++)
        text_integer(t, COUNTS[k].key, COUNTS[k].value);
    put_named(t, NULL,
              (named[]){{"load", f->load},
                        {"displacement", f->displacement},
                        {"least_det", f->least_det},
                        {"residual", f->residual},
                        {"least_gap", f->least_gap}},
              5);
    if (!isnan(f->part))
        put_named(t, NULL, (named[]){{"part", f->part}}, 1);
    text_bool(t, "definite", f->definite);
    text_close(t, '}');
}

/* Of the body's energies, what no displacement changes. */
static double kept_energy(const uz_summary *s)
{
    return s->evaluation ? s->evaluation->kept_energy : 0.0;
}

/* The energies, and how far the answer may be off. */
static void put_certificate(text *t, const uz_summary *s, bool scene)
{
    const uz_certificate *c = &s->certificate;
    const uz_residual *const residuals[] = {&c->residual, &c->relative_residual};
    /* the primal one bounds the minimum from above only where a feasible displacement was found, so with a finite gap
     */
    put_named(t, "energy",
              (named[]){{"primal", isfinite(c->gap) ? c->energy_primal : (double)INFINITY},
                        {"dual", c->energy_dual},
                        {"strain", s->evaluation ? s->evaluation->strain_energy + kept_energy(s) : (double)NAN},
                        {"potential", s->evaluation ? s->evaluation->potential_energy + kept_energy(s) : (double)NAN}},
              s->evaluation ? 4 : 2);
    text_open(t, "certificate", '{');
    put_named(t, NULL,
              (named[]){{"relative_error", c->relative_error}, {"absolute_error", c->absolute_error}, {"gap", c->gap}},
              3);
    for (int i = 0; i < 2; i++) {
        const uz_residual *e = residuals[i];
        put_named(t, i == 0 ? "residual" : "relative_residual",
                  (named[]){{"total", e->total}, {"e1", e->e1}, {"e2", e->e2}, {"e3", e->e3}, {"e4", e->e4}}, 5);
    }
    text_close(t, '}');
    double equations;
    const double total = uz_total_error(&equations, s);
    text_open(t, "error", '{');
    const uz_guarantee *g = &s->guarantee;
    /* what is proved of the answer holds of the mesh's own one but for what the equations left */
    put_named(t, NULL,
              (named[]){{"equations", equations},
                        {"mesh", g->proved ? g->relative + equations : s->discretization_error},
                        {"total", total}},
              3);
    text_string(t, "kind", scene && !g->proved ? "estimated" : "guaranteed");
    if (g->asked && !g->proved)
        text_string(t, "why", g->why);
    if (g->proved) {
        put_named(t, NULL,
                  (named[]){{"estimated_mesh", s->discretization_error},
                            {"bound", g->bound},
                            {"energy_low", g->dual + kept_energy(s)},
                            {"energy_high", g->primal + kept_energy(s)},
                            {"seconds", g->seconds}},
                  5);
        text_integer(t, "dual_unknowns", g->unknowns);
        if (g->straightened > 0)
            text_number(t, "straightened", g->straightened);
    }
    text_close(t, '}');
}

/* Cells that were chosen, elements that were bisected: the grids that were tried. */
static void put_grids(text *t, const uz_grid_sequence *grids)
{
    text_open(t, "mesh", '{');
    if (grids->cells[0] > 0)
        text_integers(t, "cells", grids->cells, grids->dim);
    text_integer(t, "elements", grids->n_elements);
    text_bool(t, "refined", grids->refined);
    text_open(t, "ladder", '[');
    for (int i = 0; i < grids->count; i++) {
        const uz_grid_level *level = &grids->level[i];
        text_open(t, NULL, '{');
        if (level->cells[0] > 0)
            text_integers(t, "cells", level->cells, grids->dim);
        text_integer(t, "elements", level->n_elements);
        text_integer(t, "d", level->d);
        text_integer(t, "iterations", level->iterations);
        put_named(t, NULL,
                  (named[]){{"discretization_error", level->discretization_error},
                            {"certified_error", level->certified_error},
                            {"error", level->error},
                            {"seconds", level->seconds},
                            {"max_pressure", level->max_pressure},
                            {"contact_area", level->contact_area}},
                  6);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_close(t, '}');
}

/* What the answer took: the factor, predicted and actual cost, times. */
static void put_effort(text *t, const uz_summary *s)
{
    const uz_cost *c = &s->cost;
    const uz_timings *spent = &s->timings;
    text_open(t, "factor", '{');
    text_bool(t, "cached", s->factor_cached);
    text_open(t, "reused", '{');
    text_bool(t, "assembly", s->reused.assembly);
    text_bool(t, "ordering", s->reused.ordering);
    text_bool(t, "factor", s->reused.factor);
    text_bool(t, "operator", s->reused.op);
    text_close(t, '}');
    text_string(t, "ordering", uz_choice_name(UZ_CHOICE_ORDERING, s->ordering));
    text_bool(t, "contact_last", s->contact_last);
    text_integer(t, "nnz", s->factor_nnz);
    text_integer(t, "bytes", (int64_t)s->factor_bytes);
    put_named(t, NULL, (named[]){{"flops", s->factor_flops}, {"rcond", s->rcond}}, 2);
    text_close(t, '}');
    text_open(t, "cost", '{');
    put_named(t, "predicted", (named[]){{"seconds", c->seconds}, {"bytes", c->bytes}, {"flops", c->flops}}, 3);
    put_named(
        t, "actual",
        (named[]){{"seconds", c->actual_seconds}, {"bytes", c->actual_bytes}, {"threads", (double)c->actual_threads}},
        3);
    text_open(t, "considered", '[');
    for (int k = 0; k < c->n_considered; k++) {
        const uz_cost_option *form = &c->considered[k];
        text_open(t, NULL, '{');
        text_string(t, "operator", uz_choice_name(UZ_CHOICE_OPERATOR, form->op));
        put_named(t, NULL, (named[]){{"seconds", form->seconds}, {"bytes", form->bytes}}, 2);
        text_bool(t, "fits", form->fits);
        text_close(t, '}');
    }
    text_close(t, ']');
    text_close(t, '}');
    put_named(t, "timings_s",
              (named[]){{"queue", spent->queue},
                        {"parse", spent->parse},
                        {"assemble", spent->assemble},
                        {"order", spent->order},
                        {"factor", spent->factor},
                        {"condense", spent->condense},
                        {"iterate", spent->iterate},
                        {"certify", spent->certify},
                        {"total", spent->total}},
              9);
}

char *codec_encode_summary(const uz_summary *summary, uz_problem_kind kind, const codec_run *run)
{
    text t = {0};
    const bool scene = kind == UZ_PROBLEM_SCENE;
    const uz_semicoercive *held = &summary->semicoercive;
    const codec_cases *cases = run ? run->cases : NULL;
    text_open(&t, NULL, '{');
    text_string(&t, "outcome", uz_choice_name(UZ_CHOICE_OUTCOME, summary->outcome));
    text_string(&t, "message", summary->message);
    text_string(&t, "method", uz_method_name(summary->method));
    text_string(&t, "operator", uz_choice_name(UZ_CHOICE_OPERATOR, summary->op));
    text_integer(&t, "iterations", summary->iterations);
    text_integer(&t, "restarts", summary->restarts);
    text_integer(&t, "refinements", summary->refinements);
    text_string(&t, "row_scaling", uz_choice_name(UZ_CHOICE_ROW_SCALING, summary->row_scaling));
    if (run && run->started_from)
        text_string(&t, "started_from", run->started_from);
    if (cases) {
        text_open(&t, "cases", '{');
        text_integer(&t, "count", cases->count);
        text_string(&t, "worst", cases->worst);
        for (int i = 0; i < CODEC_OUTCOMES; i++)
            if (cases->outcomes[i] > 0 || i == UZ_CONVERGED)
                text_integer(&t, uz_choice_name(UZ_CHOICE_OUTCOME, (uz_outcome)i), cases->outcomes[i]);
        text_close(&t, '}');
    }
    text_open(&t, "problem", '{');
    text_string(&t, "kind", scene ? "scene" : "matrices");
    text_integer(&t, "d", summary->d);
    text_integer(&t, "m", summary->m);
    if (run && run->units && run->units->length[0]) {
        text_open(&t, "units", '{');
        text_string(&t, "length", run->units->length);
        text_string(&t, "force", run->units->force);
        text_string(&t, "stress", run->units->stress);
        text_close(&t, '}');
    }
    text_close(&t, '}');
    put_contact(&t, summary, scene);
    if (summary->evaluation)
        put_stress(&t, summary->evaluation, summary->dim);
    if (scene && summary->geometry.kind == UZ_KINEMATICS_FINITE)
        put_finite(&t, &summary->finite);
    if (summary->small.compared) {
        text_open(&t, "small_deformation", '{');
        put_named(&t, NULL, (named[]){{"error", summary->small.error}, {"load", summary->small.load}}, 2);
        if (isfinite(summary->small.error))
            text_string(&t, "in", summary->small.in);
        text_close(&t, '}');
    }
    put_certificate(&t, summary, scene);
    if (summary->evaluation)
        put_evaluation(&t, summary->evaluation, summary->dim);
    put_named(&t, NULL,
              (named[]){{"requested_error", summary->requested_error},
                        {"discretization_error", summary->discretization_error},
                        {"alpha", summary->alpha},
                        {"lambda_max", summary->lambda_max}},
              4);
    if (summary->grids) {
        if (!(summary->evaluation && summary->evaluation->asked > 0.0)) /* else a quantity chose the mesh */
            text_number(&t, "total_error", uz_total_error(NULL, summary));
        put_grids(&t, summary->grids);
    }
    if (summary->outcome == UZ_INFEASIBLE || summary->outcome == UZ_OUT_OF_REACH)
        text_number(&t, "infeasible_radius", summary->infeasible_radius);
    if (held->free_modes > 0) { /* a body that only the obstacle holds */
        const int64_t most = (int64_t)(sizeof held->held_by / sizeof held->held_by[0]);
        text_open(&t, "semicoercive", '{');
        text_integer(&t, "free_modes", held->free_modes);
        text_integer(&t, "rounds", held->rounds);
        text_integer(&t, "held", held->held);
        text_integers(&t, "held_by_rows", held->held_by, held->held < most ? held->held : most);
        text_close(&t, '}');
    }
    put_effort(&t, summary);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

/* ---- assertions */

bool codec_add_findings(char **summary, const codec_judged *list, int64_t n)
{
    static const char *const WORDS[CODEC_VERDICTS] = {"pass", "uncertain", "fail"};
    text t = {0};
    bool passed = true;
    text_bytes(&t, *summary, strlen(*summary) - 1); /* but the closing brace */
    text_open(&t, "assertions", '[');
    for (int64_t i = 0; i < n; i++) {
        const codec_assertion *a = list[i].of;
        const codec_finding *f = &list[i].found;
        const struct {
            const char *key, *word; /* a number where there is no word */
            double value;
        } MEMBERS[] = {{"name", a->name, 0},
                       {"quantity", a->quantity, 0},
                       {"case", f->case_name, 0},
                       {"min", NULL, a->least},
                       {"max", NULL, a->most},
                       {"near", NULL, a->near},
                       {"absolute", NULL, a->absolute},
                       {"relative", NULL, a->relative}};
        passed = passed && f->verdict == CODEC_PASS;
        text_open(&t, NULL, '{');
        for (size_t k = 0; k < sizeof MEMBERS / sizeof MEMBERS[0]; k++)
            if (MEMBERS[k].word && MEMBERS[k].word[0])
                text_string(&t, MEMBERS[k].key, MEMBERS[k].word);
            else if (!MEMBERS[k].word && !isnan(MEMBERS[k].value))
                text_number(&t, MEMBERS[k].key, MEMBERS[k].value);
        text_number(&t, "value", f->value);
        text_number(&t, "error", f->error);
        text_string(&t, "result", WORDS[f->verdict]);
        if (f->reason[0])
            text_string(&t, "reason", f->reason);
        if (list[i].of_cases) {
            text_open(&t, "cases", '{');
            for (int k = 0; k < CODEC_VERDICTS; k++)
                text_integer(&t, WORDS[k], f->counts[k]);
            text_close(&t, '}');
        }
        text_close(&t, '}');
    }
    text_close(&t, ']');
    text_bool(&t, "assertions_passed", passed);
    text_close(&t, '}');
    char *longer = text_finish(&t, NULL);
    if (!longer)
        return false;
    free(*summary);
    *summary = longer;
    return true;
}
