/* files.c: an answer as a file for other programs and for people: /v1/jobs/{id}/result.vtu, deformed.svg, surface. */
#include "codec/codec.h"
#include "http/jobs.h"
#include "http/results.h"

#include <string.h>

static const unsigned IN_VTU = (STORED | COMPUTED | UZ_FIELD_MATERIALS) & ~(unsigned)UZ_FIELD_STRESS_GAUSS;
static const unsigned VTU_BY_DEFAULT = UZ_FIELD_DISPLACEMENTS | UZ_FIELD_STRESS | UZ_FIELD_VON_MISES |
                                       UZ_FIELD_PRESSURE | UZ_FIELD_GAPS | UZ_FIELD_CONTACT_STATUS | UZ_FIELD_MATERIALS;

static void find_and_reply(api *context, http_request *rq, field_output *wanted, const char *type, http_reply *reply)
{
    job j = {0};
    results_place at = {.number = 0};
    if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !results_known(rq, &j, reply) &&
        results_one(&at, context, rq, &j, "a file", reply)) {
        field_reader reader;
        wanted->how.title = wanted->case_name = at.name;
        if (fields_open(&reader, context, rq, &j, reply) && fields_make(wanted, &reader, at.number, reply))
            reply_text(reply, 200, type, wanted->text, wanted->len);
        fields_close(&reader);
    }
    results_place_clear(&at);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}

void results_get_vtu(api *context, http_request *rq, http_reply *reply)
{
    field_list fields;
    problem_details problem;
    if (!results_fields(rq, &fields, VTU_BY_DEFAULT, IN_VTU, &problem))
        reply_problem(reply, &problem);
    else
        find_and_reply(context, rq, &(field_output){.kind = OUTPUT_VTU, .which = fields.which}, "application/xml",
                       reply);
}

static const unsigned IN_SURFACE = UZ_FIELD_DISPLACEMENTS | UZ_FIELD_VON_MISES | UZ_FIELD_PRESSURE;

void results_get_surface(api *context, http_request *rq, http_reply *reply)
{
    field_list fields;
    problem_details problem;
    if (!results_fields(rq, &fields, IN_SURFACE, IN_SURFACE, &problem))
        reply_problem(reply, &problem);
    else
        find_and_reply(context, rq, &(field_output){.kind = OUTPUT_SURFACE, .which = fields.which}, "model/gltf-binary",
                       reply);
}

/* The colour: "displacements" or "von_mises". */
static bool read_colour(const http_request *rq, uz_field *out, problem_details *problem)
{
    const char *text = target_value(&rq->target, "colour");
    *out = UZ_FIELD_VON_MISES;
    if (!text || strcmp(text, "von_mises") == 0)
        return true;
    *out = UZ_FIELD_DISPLACEMENTS;
    return strcmp(text, "displacements") == 0 ||
           http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                        "colour is displacements or von_mises, not \"%.60s\"", text);
}

static bool read_factor(const http_request *rq, double *out, problem_details *problem)
{
    const char *text = target_value(&rq->target, "factor");
    *out = 0;
    if (!text)
        return true;
    const size_t used = uz_parse_double(out, text, strlen(text));
    return (used > 0 && text[used] == '\0' && *out >= 0 && *out <= 1e12) ||
           http_problem(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                        "factor is a number from 0 (chosen by the service) to 1e12, not \"%.60s\"", text);
}

void results_get_picture(api *context, http_request *rq, http_reply *reply)
{
    problem_details problem;
    int64_t width = 900;
    field_output wanted = {.kind = OUTPUT_PICTURE};
    if (!read_colour(rq, &wanted.how.colour, &problem) || !read_factor(rq, &wanted.how.factor, &problem) ||
        !request_integer(rq, "width", 200, 4000, &width, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    wanted.how.width = (int)width;
    find_and_reply(context, rq, &wanted, "image/svg+xml", reply);
}
