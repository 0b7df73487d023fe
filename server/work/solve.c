/* solve.c: a job's text is decoded, solved or verified, and what came of it is put into the store's form. */
#include "work/solve.h"
#include "base/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the library can't know: who may do something about it, and how. */
static void add_remedy(uz_error *err, const char *remedy)
{
    size_t used = strlen(err->message);
    snprintf(err->message + used, sizeof err->message - used, "%s", remedy);
}

static uz_status verify(solution *s, const solve_with *with, uz_error *err)
{
    const codec_answer *given = &s->request.answer;
    s->n = 1;
    s->results = calloc(1, sizeof(uz_result *));
    if (!s->results)
        return err->status = UZ_ERR_MEMORY;
    uz_status status = uz_verify(&s->results[0], &s->request.problem, given->u, given->r, &s->request.settings,
                                 with->cache, with->hooks, err);
    if (strcmp(err->where, "u") == 0)
        strcpy(err->where, "/answer/displacements");
    else if (strcmp(err->where, "r") == 0)
        strcpy(err->where, "/answer/reactions");
    /* A free body may have an answer, and one that this service itself found. */
    const uz_problem *problem = &s->request.problem;
    bool touches = problem->kind == UZ_PROBLEM_SCENE ? problem->scene.n_contacts > 0 : problem->qp.N.rows > 0;
    if (touches && (err->status == UZ_ERR_FREE_BODY || err->status == UZ_ERR_NOT_SPD))
        add_remedy(err, ". An answer is verified only where the supports alone hold the body; one that the obstacle "
                        "holds can be solved here: its summary has a certificate");
    return status;
}

/* Does one price stand for all that it took? It is that of one setup and one load: of a setup all that was cached is
 * left out, of parts of one nothing. */
static bool is_priced(const uz_summary *s)
{
    const bool whole = s->reused.op || (!s->reused.factor && !s->reused.ordering);
    return whole && s->outcome == UZ_CONVERGED && s->rounds == 1 && !s->grids && s->semicoercive.rounds == 0 &&
           s->geometry.kind == UZ_KINEMATICS_FIXED;
}

/* Phases and cache: of the first case, which paid for the body; iterating and certifying of all. */
void solve_count(solve_figures *f, uz_result *const *results, int64_t n)
{
    f->cases = n;
    if (!results || !results[0])
        return;
    const uz_summary *first = &results[0]->summary;
    bool priced = true;
    f->has_answer = true;
    f->outcome = first->outcome;
    f->cached = first->reused.factor;
    f->assemble = first->timings.assemble;
    f->order = first->timings.order;
    f->factor = first->timings.factor;
    f->condense = first->timings.condense;
    for (int64_t i = 0; i < n && results[i]; i++) {
        f->iterations += results[i]->summary.iterations;
        f->iterate += results[i]->summary.timings.iterate;
        f->certify += results[i]->summary.timings.certify;
        f->said_s += results[i]->summary.cost.seconds;
        f->took_s += results[i]->summary.cost.actual_seconds;
        priced = priced && is_priced(&results[i]->summary);
    }
    f->op = priced ? first->op : UZ_OPERATOR_AUTO;
}

/* What the summaries say was predicted. */
static void set_pace(uz_result **results, int64_t n, const double *pace)
{
    for (int64_t i = 0; i < n && results[i]; i++) {
        uz_cost *cost = &results[i]->summary.cost;
        cost->seconds *= pace[results[i]->summary.op];
        for (int k = 0; k < cost->n_considered; k++)
            cost->considered[k].seconds *= pace[cost->considered[k].op];
    }
}

void solve_job(solution *out, const solve_with *with, const char *id, char *body, size_t body_len)
{
    problem_details problem = {0};
    uz_error err = {0};
    double start = clock_seconds(CLOCK_MONOTONIC);
    *out = (solution){.n = 0};
    bool good =
        body && codec_decode_kept(&out->request, CODEC_STORED, body, body_len, with->source, with->cache, &problem);
    if (!body)
        codec_problem_damaged(&problem, id);
    free(body);
    out->figures.parse = clock_seconds(CLOCK_MONOTONIC) - start;
    if (!good) {
        solution_fail(out, codec_encode_problem(&problem));
        return;
    }
    uz_settings *settings = &out->request.settings;
    if (with->max_solve_s > 0.0 && settings->time_limit_s > with->max_solve_s)
        settings->time_limit_s = with->max_solve_s;
    settings->memory_limit = with->memory_limit;
    if (with->read)
        with->read(with->hooks->ctx, &out->request);
    uz_status status;
    if (out->request.answer.u) {
        status = verify(out, with, &err);
    } else {
        const uz_problem *of = &out->request.problem;
        /* A store that fails now may work when the result is kept: the run begins at zero, and says so. */
        out->start_lost = starts_load(&out->starts, with->source, &out->request) != STORE_OK;
        out->n = of->n_cases > 0 ? of->n_cases : 1;
        status = uz_solve_cases(&out->results, of, settings, (const uz_state *const *)out->starts.states, with->cache,
                                with->hooks, &err);
        if (strstr(err.where, "start")) /* the library's name for what the request calls warm_start */
            strcpy(err.where, "/solver/warm_start");
    }
    if (strcmp(err.where, "operator") == 0)
        strcpy(err.where, "/solver/operator");
    if (status == UZ_ERR_MEMORY) {
        err.status = UZ_ERR_LIMIT;
        add_remedy(&err, ": the process that solves may take no more than it has");
    }
    if (status == UZ_ERR_LIMIT)
        add_remedy(&err, " (the limit is the daemon's option --memory)");
    out->stopped = status == UZ_ERR_CANCELLED;
    for (int64_t i = 0; status == UZ_OK && out->results && i < out->n; i++)
        out->stopped = out->stopped || out->results[i]->summary.outcome == UZ_DISMISSED;
    solve_count(&out->figures, out->results, out->n);
    if (with->pace && out->results)
        set_pace(out->results, out->n, with->pace);
    if (status == UZ_OK) {
        out->outcome.status = out->stopped ? JOB_DISMISSED : JOB_SUCCESSFUL;
        if (!answers_build(&out->answers, &out->outcome, out->results, &out->request, &out->starts, with->queue_s,
                           out->figures.parse))
            solution_fail(out, NULL);
    } else if (status == UZ_ERR_CANCELLED) {
        out->outcome = (store_outcome){.status = JOB_DISMISSED};
    } else {
        codec_problem_from_error(&problem, &err, out->request.problem.kind);
        solution_fail(out, codec_encode_problem(&problem));
    }
}

bool solve_predict(uz_prediction *out, const solve_with *with, char *body, size_t body_len)
{
    codec_request request = {0};
    problem_details ignored = {0};
    uz_error err = {.status = UZ_OK};
    bool known = codec_decode_kept(&request, CODEC_STORED, body, body_len, with->source, with->cache, &ignored);
    free(body);
    request.settings.memory_limit = with->memory_limit;
    known = known && !request.settings.semidefinite && !request.problem.scene.refine &&
            uz_predict(out, &request.problem, &request.settings, with->hooks, &err) == UZ_OK;
    codec_request_clear(&request);
    return known;
}

static const char *const NO_MEMORY_JSON = "{\"type\": \"about:blank\", \"title\": \"Out of memory\", \"status\": 500,"
                                          " \"detail\": \"There was not enough memory for the answer.\","
                                          " \"code\": \"memory_limit\"}";

void solution_fail(solution *s, char *encoded)
{
    free(s->error);
    s->error = encoded;
    s->outcome = (store_outcome){.status = JOB_FAILED, .error = encoded ? encoded : NO_MEMORY_JSON};
}

void solution_clear(solution *s)
{
    codec_request_clear(&s->request);
    uz_results_free(s->results, s->n);
    starts_clear(&s->starts);
    answers_clear(&s->answers);
    free(s->error);
    *s = (solution){.n = 0};
}
