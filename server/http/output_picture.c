/* output_picture.c: /v1/jobs/{id}/deformed.svg: the deformed body. */
#include "http/output.h"

#include <string.h>

uz_status output_picture(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_picture how = of->options->picture;
    how.title = of->case_name;
    return uz_picture_deformed(file, len, of->scene, of->answer, &how, hooks, err);
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
           problem_fill(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
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
           problem_fill(problem, 400, "bad_parameter", "A query parameter has a value that is not allowed",
                        "factor is a number from 0 (chosen by the service) to 1e12, not \"%.60s\"", text);
}

bool output_picture_read(output_options *out, const http_request *rq, problem_details *problem)
{
    int64_t width = 900;
    if (!read_colour(rq, &out->picture.colour, problem) || !read_factor(rq, &out->picture.factor, problem) ||
        !request_integer(rq, "width", 200, 4000, &width, problem))
        return false;
    out->picture.width = (int)width;
    return true;
}
