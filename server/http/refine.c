/* refine.c: POST /v1/jobs/{id}/refine: a job that goes on where another one stopped. */
#include "http/jobs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* False with a 409: a job whose only answer is that there is none can't be refined. */
static bool has_reactions(api *context, const job *j, http_reply *reply)
{
    double *r = NULL;
    int64_t count = 0;
    bool finite = true;
    store_status status = store_get_vector(context->store, j->id, 0, "reactions", &r, &count);
    for (int64_t i = 0; status == STORE_OK && finite && i < count; i++)
        finite = isfinite(r[i]);
    free(r);
    if (status != STORE_OK && status != STORE_NOT_FOUND) /* with cases the job itself has none */
        reply_store_failure(context, status, reply);
    else if (!finite)
        reply_refuse(reply, 409, "no_result", "The job has no result",
                     "the problem is infeasible or out of reach: no accuracy makes it feasible");
    else
        return true;
    return false;
}

/* The body of the new job and what the store keeps beside it, checked as any other; NULL in *body: refused. */
static void make_request(api *context, const http_request *rq, const job *old, const char *old_body, size_t old_len,
                         char **body, size_t *len, codec_request *request, http_reply *reply)
{
    static const char SOLVER[] = "/solver";
    const size_t skip = sizeof SOLVER - 1;
    problem_details problem = {0};
    *body = codec_refine(old_body, old_len, old->id, rq->body ? rq->body : "", rq->body_len, len, &problem);
    if (*body && codec_decode(request, CODEC_SOLVE, *body, *len, context->store, &problem)) {
        codec_request_strip(request);
        return;
    }
    /* pointers of the made request, seen from the one that it was made from */
    if (strncmp(problem.pointer, SOLVER, skip) == 0) {
        memmove(problem.pointer, problem.pointer + skip, strlen(problem.pointer + skip) + 1);
        if (strncmp(problem.detail, SOLVER, skip) == 0)
            memmove(problem.detail, problem.detail + skip, strlen(problem.detail + skip) + 1);
    }
    reply_problem(reply, &problem);
    free(*body);
    *body = NULL;
}

void jobs_refine(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem = {0};
    job old = {0};
    char *key = NULL;
    if (!jobs_read_key(rq, &key, &problem))
        reply_problem(reply, &problem);
    else if (jobs_load(context, rq, &old, reply) && results_exist(&old, reply) && has_reactions(context, &old, reply)) {
        char *old_body = NULL, *body = NULL;
        codec_request made = {0};
        size_t old_len = 0, len = 0;
        double *cells = NULL;
        int64_t n_cells = 0;
        store_status status = store_get_body(context->store, old.id, &old_body, &old_len);
        if (status != STORE_OK) {
            reply_store_failure(context, status, reply);
        } else if (codec_is_verify(old_body, old_len)) {
            reply_refuse(reply, 409, "not_solved_here", "The job solved nothing",
                         "it certified an answer that was given to it, and there is no run to continue");
        } else if (store_get_vector(context->store, old.id, 0, "cells", &cells, &n_cells) == STORE_OK) {
            /* A run on a grid that nobody gave can't go on: another accuracy asks for another grid. */
            reply_refuse(
                reply, 409, "mesh_is_chosen", "The job chose its mesh",
                "the cells of its box were chosen for its accuracy: send the problem again with another accuracy, or "
                "with the cells of this job's summary");
        } else {
            make_request(context, rq, &old, old_body, old_len, &body, &len, &made, reply);
            free(old_body); /* as large as the new one: not kept while the client waits */
            old_body = NULL;
            store_request request = jobs_request(&made, body, len, key);
            request.refines = old.id;
            if (body)
                jobs_store_and_wait(context, rq, &request, reply);
        }
        free(cells);
        free(old_body);
        free(body);
        codec_request_clear(&made);
    }
    job_clear(&old);
    free(key);
}
