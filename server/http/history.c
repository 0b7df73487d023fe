/* history.c: how jobs went: the rows of their histories, /v1/jobs/{id}/convergence.svg and
 * /v1/jobs/{id}/work-precision.
 */
#include "codec/quantity.h"
#include "http/jobs.h"
#include "http/results.h"
#include "work/trade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The rows of a running job are with its worker, those of an ended one in the store; a job may end in between, and one
 * that waits has none. While a job with cases runs, the rows are those of the case that runs; another of its cases has
 * none to show. False with a reply. */
bool history_rows(api *context, const job *j, const char *name, int64_t after, found_rows *out, http_reply *reply)
{
    work_history live;
    if (j->status == JOB_ACCEPTED)
        return true;
    if (j->status == JOB_RUNNING && work_live(context->work, j->id, NULL, name, after, &live)) {
        problem_details problem;
        out->rows = live.rows;
        out->count = live.count;
        snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : live.case_name);
        if (!name || live.is_case)
            return true;
        problem_fill(&problem, 404, "case_not_found", "Not found", "the job has no case \"%.63s\".", name);
        cases_list(&problem, name, NULL, 0);
        reply_problem(reply, &problem);
        return false;
    }
    results_place at;
    int64_t columns = 0;
    const bool found = results_one(&at, context, j, name, "a history", reply);
    const int64_t number = at.number;
    store_cases_free(at.cases, at.count);
    if (!found)
        return false;
    snprintf(out->case_name, sizeof out->case_name, "%s", name ? name : "");
    store_status status = store_get_history(context->store, j->id, number, after, &out->rows, &out->count, &columns);
    if (status == STORE_OK && out->count > 0 && columns != CODEC_HISTORY_COLUMNS)
        status = STORE_ERROR;
    if (status == STORE_OK || status == STORE_NOT_FOUND)
        return true;
    reply_store_failure(context, status, reply);
    return false;
}

/* ---- histories as a picture */

enum {
    COLUMN_ITERATION,
    COLUMN_SECONDS,
    COLUMN_DUAL,
    COLUMN_RESIDUAL,
    COLUMN_BOUND = 9,
    COLUMN_CONTACTS,
    COLUMN_RESTART
};

/* The curves of one picture, the first of which is the job's own. */
typedef struct {
    char text[160];
} curve_name;
typedef struct {
    uz_curve curves[UZ_CURVES];
    found_rows rows[UZ_CURVES];
    curve_name names[UZ_CURVES];
    int n;
} curve_list;

static bool add_job(curve_list *list, api *context, const job *j, const char *case_name, http_reply *reply)
{
    found_rows *found = &list->rows[list->n];
    *found = (found_rows){.rows = NULL};
    list->n++;
    if (!history_rows(context, j, case_name, -1, found, reply))
        return false;
    /* The end of an id tells jobs of one minute apart; the beginning is the time. */
    json_tree summary = {.root = NULL};
    if (j->summary)
        codec_summary_read(&summary, j->summary);
    const char *method = codec_summary_text(summary.root, "method"), *op = codec_summary_text(summary.root, "operator");
    curve_name named;
    snprintf(named.text, sizeof named.text, "%s%s%s%s%s, job \u2026%s", found->case_name,
             found->case_name[0] ? ": " : "", method[0] ? method : job_status_name(j->status), op[0] ? ", " : "", op,
             j->id + 24);
    json_clear(&summary);
    list->names[list->n - 1] = named;
    static const double NOTHING[CODEC_HISTORY_COLUMNS];
    const double *rows = found->rows ? found->rows : NOTHING;
    list->curves[list->n - 1] = (uz_curve){.name = list->names[list->n - 1].text,
                                           .iteration = rows + COLUMN_ITERATION,
                                           .seconds = rows + COLUMN_SECONDS,
                                           .dual_objective = rows + COLUMN_DUAL,
                                           .residual = rows + COLUMN_RESIDUAL,
                                           .error_bound = rows + COLUMN_BOUND,
                                           .contacts = rows + COLUMN_CONTACTS,
                                           .restart = rows + COLUMN_RESTART,
                                           .count = found->count,
                                           .stride = CODEC_HISTORY_COLUMNS,
                                           .dual = NAN};
    return true;
}

static bool refuse_with(http_reply *reply, int status, const char *code, const char *detail, const char *id, size_t len)
{
    problem_details problem;
    problem_fill(&problem, status, code, "The list of other jobs can't be used", detail, (int)(len < 60 ? len : 60), id,
                 (int)UZ_CURVES - 1);
    reply_problem(reply, &problem);
    return false;
}

/* with=ID,ID:CASE: other jobs over this one. False with a reply. */
static bool add_others(curve_list *list, api *context, const http_request *rq, const char *text, http_reply *reply)
{
    for (size_t len; text; text = text[len] ? text + len + 1 : NULL) {
        char id[33], case_name[64] = "";
        job other = {0};
        len = strcspn(text, ",");
        if (list->n == UZ_CURVES)
            return refuse_with(reply, 400, "bad_parameter", "\"%.*s\" is one too many: with names up to %d", text, len);
        if (len < 32 || strspn(text, "0123456789abcdef") < 32 || (len > 32 && text[32] != ':') ||
            len >= 33 + sizeof case_name)
            return refuse_with(reply, 400, "bad_parameter",
                               "\"%.*s\" is not ID or ID:CASE; with names up to %d of them", text, len);
        snprintf(id, sizeof id, "%.32s", text);
        if (len > 33)
            snprintf(case_name, sizeof case_name, "%.*s", (int)(len - 33), text + 33);
        const char *own = reply->job;
        store_status status = api_get_job(context, rq, id, &other);
        if (status == STORE_OK && other.damaged)
            status = STORE_DAMAGED;
        reply->job = id; /* a failure is about this one, and told at once */
        const bool done = status == STORE_OK && add_job(list, context, &other, case_name[0] ? case_name : NULL, reply);
        job_clear(&other);
        if (status == STORE_NOT_FOUND)
            refuse_with(reply, 404, "job_not_found", "there is no job %.*s; with names up to %d of them", text, len);
        else if (status != STORE_OK)
            reply_store_failure(context, status, reply);
        reply->job = own;
        if (!done)
            return false;
    }
    return true;
}

/* One of two or three words; *out is its number. */
static bool read_choice(const http_request *rq, const char *key, const char *const *words, int count, int *out,
                        problem_details *problem)
{
    const char *text = target_value(&rq->target, key);
    char list[80] = "";
    *out = 0;
    for (int i = 0; text && i < count; i++) {
        if (strcmp(text, words[i]) == 0) {
            *out = i;
            return true;
        }
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i ? ", " : "", words[i]);
    }
    return !text || REFUSE_PARAMETER(problem, "%s is one of %s, not \"%.60s\"", key, list, text);
}

bool plot_read(uz_plot *out, const http_request *rq, problem_details *problem)
{
    static const char *const X[] = {"iterations", "seconds"}, *const THEMES[] = {"auto", "light", "dark"};
    int64_t width = 900;
    int x, theme;
    const bool good = read_choice(rq, "x", X, 2, &x, problem) && read_choice(rq, "theme", THEMES, 3, &theme, problem) &&
                      request_integer(rq, "width", 300, 4000, &width, problem);
    if (good)
        *out = (uz_plot){.width = (int)width, .x = (uz_plot_x)x, .theme = (uz_theme)theme};
    return good;
}

void convergence_get(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem;
    curve_list list = {.n = 0};
    job j = {0};
    char title[96];
    uz_plot how;
    if (!plot_read(&how, rq, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    reply->tag_by_body = true;
    if (jobs_load(context, rq, &j, reply) && add_job(&list, context, &j, target_value(&rq->target, "case"), reply) &&
        add_others(&list, context, rq, target_value(&rq->target, "with"), reply)) {
        snprintf(title, sizeof title, "Convergence of job %s", j.id);
        how.title = title;
        char *svg = NULL;
        size_t len = 0;
        uz_error err = {0};
        if (uz_picture_convergence(&svg, &len, list.curves, list.n, &how, &err) == UZ_OK)
            reply_text(reply, 200, "image/svg+xml", svg, len);
        else
            reply_no_memory(reply); /* arguments were checked */
    }
    for (int k = 0; k < list.n; k++)
        free(list.rows[k].rows);
    list.n = 0;
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}

/* ---- what accuracy took */

void trade_get(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    double *x = NULL;
    int64_t count = 0;
    results_place at = {.cases = NULL};
    json_tree summary = {.root = NULL};
    codec_trade of = {.job_id = j.id};
    if (!jobs_load(context, rq, &j, reply) || !results_exist(&j, reply) || results_known(rq, &j, reply) ||
        !results_one(&at, context, &j, target_value(&rq->target, "case"), "a record", reply))
        goto done;
    of.case_name = at.name;
    const store_status status = store_get_vector(context->store, j.id, at.number, TRADE_VECTOR, &x, &count);
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        reply_store_failure(context, status, reply);
    } else if (status == STORE_NOT_FOUND || !trade_unpack(&of.trade, x, count)) {
        reply_refuse(reply, 409, "not_recorded", "What accuracy took was not recorded",
                     "the job ran under another version of the service: its history has the bounds of its iterations");
    } else if (!codec_summary_read(&summary, at.summary)) {
        reply_no_memory(reply);
    } else {
        quantity_read(&of.mesh_error, summary.root, "discretization_error");
        quantity_read(&of.solver_error, summary.root, "certificate.relative_error");
        size_t len = 0;
        char *text = codec_encode_trade(&of, &len);
        reply_text(reply, 200, "application/json", text, len);
    }
done:
    free(x);
    json_clear(&summary);
    store_cases_free(at.cases, at.count);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}
