/* output_picture.c: /v1/jobs/{id}/deformed.svg: the deformed body. */
#include "http/output.h"

#include <string.h>

uz_status output_picture(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_picture how = of->options->picture;
    how.title = of->case_name;
    return uz_picture_deformed(file, len, of->scene, of->answer, &how, hooks, err);
}

/* The colour ("displacements" or "von_mises"), the factor of the displacements and the width. */
bool output_picture_read(output_options *out, const http_request *rq, problem_details *problem)
{
    static const char TITLE[] = "A query parameter has a value that is not allowed";
    const char *colour = target_value(&rq->target, "colour"), *factor = target_value(&rq->target, "factor");
    uz_picture *to = &out->picture;
    int64_t width = 900;
    const bool moved = colour && strcmp(colour, "displacements") == 0;
    to->colour = moved ? UZ_FIELD_DISPLACEMENTS : UZ_FIELD_VON_MISES;
    if (colour && !moved && strcmp(colour, "von_mises") != 0)
        return problem_fill(problem, 400, "bad_parameter", TITLE, "colour is displacements or von_mises, not \"%.60s\"",
                            colour);
    to->factor = 0;
    const size_t used = factor ? uz_parse_double(&to->factor, factor, strlen(factor)) : 0;
    if (factor && (used == 0 || factor[used] != '\0' || !(to->factor >= 0 && to->factor <= 1e12)))
        return problem_fill(problem, 400, "bad_parameter", TITLE,
                            "factor is a number from 0 (chosen by the service) to 1e12, not \"%.60s\"", factor);
    if (!request_integer(rq, "width", 200, 4000, &width, problem))
        return false;
    to->width = (int)width;
    return true;
}
