/* list.c: GET /v1/jobs. */
#include "http/jobs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static bool refuse(problem_details *problem, const char *text)
{
    return problem_fill(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed", "%s", text);
}

/* ---- times */

/* A time of RFC 3339, "2026-01-31T12:00:00.5Z", as Unix seconds. */
static bool parse_time(const char *text, double *out)
{
    static const char FORM[] = "dddd-dd-ddTdd:dd:dd";
    struct tm t = {0}, back;
    double fraction = 0;
    for (size_t i = 0; FORM[i]; i++)
        if (FORM[i] == 'd' ? text[i] < '0' || text[i] > '9' : (text[i] & ~0x20) != (FORM[i] & ~0x20))
            return false;
    sscanf(text, "%4d-%2d-%2d%*c%2d:%2d:%2d", &t.tm_year, &t.tm_mon, &t.tm_mday, &t.tm_hour, &t.tm_min, &t.tm_sec);
    const char *at = text + sizeof FORM - 1;
    size_t digits = *at == '.' ? strspn(at + 1, "0123456789") : 0;
    for (size_t i = digits; i > 0; i--)
        fraction = (fraction + (at[i] - '0')) / 10;
    if (*at == '.' && digits == 0)
        return false;
    at += digits ? digits + 1 : 0;
    t.tm_year -= 1900;
    t.tm_mon -= 1;
    struct tm asked = t;
    time_t seconds = timegm(&t);
    bool exists = gmtime_r(&seconds, &back) && back.tm_mon == asked.tm_mon && back.tm_mday == asked.tm_mday &&
                  back.tm_hour == asked.tm_hour && back.tm_min == asked.tm_min &&
                  asked.tm_sec < 61; /* no 30th of February */
    if (!exists)
        return false;
    /* the zone: "Z", "+hh:mm" or "-hh:mm" east of Greenwich; a '+' that was not escaped arrives as a space */
    int hours = 0, minutes = 0, used = 0;
    if (strcmp(at, "Z") != 0 && strcmp(at, "z") != 0 &&
        (!strchr("+- ", at[0]) || strspn(at + 1, "0123456789:") != 5 ||
         sscanf(at + 1, "%2d:%2d%n", &hours, &minutes, &used) != 2 || at[1 + used] || hours > 23 || minutes > 59))
        return false;
    const int zone = (at[0] == '-' ? -1 : 1) * (hours * 3600 + minutes * 60);
    *out = (double)seconds + fraction - zone;
    return true;
}

static bool read_time(const http_request *rq, const char *key, double *out, problem_details *problem)
{
    char text[160];
    const char *value = target_value(&rq->target, key);
    if (!value || parse_time(value, out)) {
        if (value) /* 0 in a query is no bound, and no job is as old as 1970 */
            *out = fmax(*out, 1e-3);
        return true;
    }
    snprintf(text, sizeof text, "%s must be a time of RFC 3339 such as 2026-01-31T12:00:00Z", key);
    return refuse(problem, text);
}

/* ---- the query */

static bool read_query(const http_request *rq, store_query *query, problem_details *problem)
{
    int64_t limit = 50;
    const char *status = target_value(&rq->target, "status"), *order = target_value(&rq->target, "order");
    memset(query, 0, sizeof *query);
    query->before = target_value(&rq->target, "cursor");
    query->by_status = status != NULL;
    query->ascending = order && strcmp(order, "asc") == 0;
    if (status && !job_status_parse(&query->status, status))
        return refuse(problem, "status must be accepted, running, successful, failed or dismissed");
    if (query->before && !(strlen(query->before) == 32 && strspn(query->before, "0123456789abcdef") == 32))
        return refuse(problem, "cursor must be the \"next\" of an earlier page");
    if (order && !query->ascending && strcmp(order, "desc") != 0)
        return refuse(problem, "order must be desc (newest first) or asc");
    if (!request_integer(rq, "limit", 1, 1000, &limit, problem))
        return false;
    query->limit = (int)limit;
    if (!read_time(rq, "since", &query->since, problem) || !read_time(rq, "until", &query->until, problem))
        return false;
    for (size_t i = 0, count = 0; i < rq->target.count; i++) {
        if (strcmp(rq->target.parameters[i].key, "tag") != 0)
            continue;
        if (count > STORE_MORE_TAGS)
            return refuse(problem, "at most 4 tags may be asked for");
        *(count == 0 ? &query->tag : &query->more[count - 1]) = rq->target.parameters[i].value;
        count++;
    }
    return true;
}

void jobs_list(api *context, http_request *rq, http_reply *reply)
{
    store_query query;
    problem_details problem;
    job *jobs = NULL;
    size_t count = 0;
    bool more = false;
    if (!read_query(rq, &query, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    store_status status = store_list(context->store, &query, &jobs, &count, &more);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    for (size_t i = 0; i < count; i++)
        jobs_freshen(context, &jobs[i]);
    reply->tag_by_body = true;
    reply_json(reply, 200, codec_encode_jobs(jobs, count, more));
    for (size_t i = 0; i < count; i++)
        job_clear(&jobs[i]);
    free(jobs);
}
