/* whole_error.c: /v1/jobs/{id}/whole-error.svg: what the whole error of an answer cost.
 *
 * Where the mesh was chosen, its grids are in the summary. On one mesh the error is that of the equations, whose bounds
 * are recorded with the seconds at which each was first met (uz_trade), and what the mesh loses beside it. */
#include "http/jobs.h"
#include "http/results.h"
#include "work/trade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_POINTS = 64 };
_Static_assert((int)MOST_POINTS >= (int)UZ_GRID_LEVELS && (int)MOST_POINTS >= (int)UZ_TRADE_STEPS, "all have room");

typedef struct {
    double unknowns[MOST_POINTS], seconds[MOST_POINTS], error[MOST_POINTS];
} curve_points;

static double number_at(const json_value *object, const char *key)
{
    return json_number(json_get(object, key), NAN);
}

/* One point for each grid. */
static int64_t take_grids(curve_points *out, const json_value *ladder)
{
    double seconds = 0.0;
    int64_t n = 0;
    for (size_t i = 0; i < json_size(ladder) && n < MOST_POINTS; i++, n++) {
        json_value room;
        const json_value *grid = json_item(ladder, i, &room);
        const double whole = number_at(grid, "error");
        seconds += number_at(grid, "seconds");
        out->unknowns[n] = number_at(grid, "d");
        out->seconds[n] = seconds;
        /* of an answer of an older version */
        out->error[n] =
            isnan(whole) ? hypot(number_at(grid, "discretization_error"), number_at(grid, "certified_error")) : whole;
    }
    return n;
}

/* One point for each bound that was met. */
static int64_t take_bounds(curve_points *out, const uz_trade *trade, double mesh)
{
    int64_t n = 0;
    for (int k = 0; k < UZ_TRADE_STEPS && !isnan(trade->step[k].seconds); k++, n++) {
        out->seconds[n] = trade->step[k].seconds;
        out->error[n] = hypot(uz_trade_error(k), mesh > 0.0 ? mesh : 0.0);
    }
    return n;
}

static void draw(http_reply *reply, const job *j, const results_place *at, const json_value *summary,
                 const uz_trade *trade, uz_plot how)
{
    curve_points points;
    char title[160], *svg = NULL;
    size_t len = 0;
    uz_error err = {0};
    const json_value *ladder = json_get(json_get(summary, "mesh"), "ladder"), *error = json_get(summary, "error");
    const double mesh = number_at(error, "mesh");
    uz_error_curve curve = {.unknowns = points.unknowns,
                            .seconds = points.seconds,
                            .error = points.error,
                            .asked = ladder ? number_at(summary, "requested_error") : (double)NAN,
                            .mesh = ladder ? (double)NAN : mesh,
                            .grids = ladder != NULL,
                            .guaranteed = strcmp(codec_summary_text(error, "kind"), "guaranteed") == 0};
    curve.count = ladder ? take_grids(&points, ladder) : take_bounds(&points, trade, mesh);
    snprintf(title, sizeof title, "Whole error of job %s%s%s", j->id, at->name ? ", " : "", at->name ? at->name : "");
    how.title = title;
    if (uz_picture_whole_error(&svg, &len, &curve, &how, &err) == UZ_OK)
        reply_text(reply, 200, "image/svg+xml", svg, len);
    else
        reply_no_memory(reply); /* arguments were checked */
}

void whole_error_get(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem;
    job j = {0};
    double *x = NULL;
    int64_t count = 0;
    results_place at = {.cases = NULL};
    json_tree summary = {.root = NULL};
    uz_trade trade;
    uz_plot how;
    if (!plot_read(&how, rq, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    if (!jobs_load(context, rq, &j, reply) || !results_exist(&j, reply) || results_known(rq, &j, reply) ||
        !results_one(&at, context, &j, target_value(&rq->target, "case"), "a picture", reply))
        goto done;
    const store_status status = store_get_vector(context->store, j.id, at.number, TRADE_VECTOR, &x, &count);
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        reply_store_failure(context, status, reply);
    } else if (!codec_summary_read(&summary, at.summary)) {
        reply_no_memory(reply);
    } else {
        if (status == STORE_OK)
            trade_unpack(&trade, x, count); /* nothing is recorded where it is of another version */
        else
            uz_trade_clear(&trade);
        draw(reply, &j, &at, summary.root, &trade, how);
    }
done:
    free(x);
    json_clear(&summary);
    store_cases_free(at.cases, at.count);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}
