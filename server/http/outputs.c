/* outputs.c: what can be had of a job: the table, the writers, and how a row is answered. */
#include "codec/codec.h"
#include "http/jobs.h"
#include "http/output.h"
#include "http/results.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- writers */

#define MOST_BYTES ((size_t)256000000) /* 413 above it; openapi.json says so */

static uz_status write_history(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    (void)hooks;
    (void)err;
    *file = codec_encode_history(of->case_name, of->rows, of->n_rows, len);
    return *file ? UZ_OK : UZ_ERR_MEMORY;
}

static uz_status write_history_csv(char **file, size_t *len, const output_source *of, const uz_hooks *hooks,
                                   uz_error *err)
{
    (void)hooks;
    (void)err;
    *file = codec_encode_history_csv(of->rows, of->n_rows, len);
    return *file ? UZ_OK : UZ_ERR_MEMORY;
}

static uz_status write_vtu(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    return uz_vtu_write(file, len, of->scene, of->answer, of->options->fields, hooks, err);
}

/* Clears the surface. */
static uz_status encode_surface(char **file, size_t *len, uz_surface *surface, const output_source *of,
                                uz_status status)
{
    *file = NULL;
    if (status == UZ_OK) {
        const codec_surface what = {surface, of->scene, of->job_id, of->case_name};
        *file = codec_encode_surface(&what, len);
        status = *file ? UZ_OK : UZ_ERR_MEMORY;
    }
    uz_surface_clear(surface);
    return status;
}

static uz_status write_surface(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_surface surface;
    const uz_status status =
        uz_surface_compute(&surface, of->scene, of->answer, of->options->fields, MOST_BYTES, hooks, err);
    return encode_surface(file, len, &surface, of, status);
}

static uz_status write_section(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_surface surface;
    const uz_status status = uz_section_compute(&surface, of->scene, of->answer, &of->options->plane,
                                                of->options->fields, MOST_BYTES, hooks, err);
    return encode_surface(file, len, &surface, of, status);
}

static uz_status write_picture(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_picture how = of->options->picture;
    how.title = of->case_name;
    return uz_picture_deformed(file, len, of->scene, of->answer, &how, hooks, err);
}

/* From where a solid is seen, and what of it is upwards. */
static bool read_view(uz_picture *to, const http_request *rq, problem_details *problem)
{
    const char *view = target_value(&rq->target, "view"), *up = target_value(&rq->target, "up");
    if (view && !uz_view_parse(&to->view, view))
        return REFUSE_PARAMETER(problem,
                                "view is corner, below, front, back, left, right, top or bottom, not \"%.60s\"", view);
    if (up && strcmp(up, "y") != 0 && strcmp(up, "z") != 0)
        return REFUSE_PARAMETER(problem, "up is y or z, not \"%.60s\"", up);
    to->z_up = up && *up == 'z';
    return true;
}

/* The colour, the factor of the displacements, the width and the view. */
static bool read_picture(output_options *out, const http_request *rq, problem_details *problem)
{
    const char *colour = target_value(&rq->target, "colour"), *factor = target_value(&rq->target, "factor");
    uz_picture *to = &out->picture;
    int64_t width = 900;
    to->colour = UZ_FIELD_VON_MISES;
    if (colour && (!uz_field_parse(&to->colour, colour, strlen(colour)) ||
                   !(to->colour & (UZ_FIELD_DISPLACEMENTS | UZ_FIELD_VON_MISES | UZ_FIELD_PRESSURE))))
        return REFUSE_PARAMETER(problem, "colour is von_mises, displacements or pressure, not \"%.60s\"", colour);
    to->factor = 0;
    const size_t used = factor ? uz_parse_double(&to->factor, factor, strlen(factor)) : 0;
    if (factor && (used == 0 || factor[used] != '\0' || !(to->factor >= 0 && to->factor <= 1e12)))
        return REFUSE_PARAMETER(problem, "factor is a number from 0 (chosen by the service) to 1e12, not \"%.60s\"",
                                factor);
    if (!request_integer(rq, "width", 200, 4000, &width, problem))
        return false;
    to->width = (int)width;
    return read_view(to, rq, problem);
}

static uz_status follow_path(uz_path *path, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    const uz_path_line *line = &of->options->path;
    const bool flat = uz_scene_dim(of->scene) == 2;
    *path = (uz_path){.point = NULL};
    if (flat ? !isnan(line->from[2]) || !isnan(line->to[2]) : isnan(line->from[2]) || isnan(line->to[2])) {
        snprintf(err->message, sizeof err->message, "from and to are points of %d numbers: the model is %s",
                 flat ? 2 : 3, flat ? "one in the plane" : "solid");
        return err->status = UZ_ERR_SCENE;
    }
    return uz_path_compute(path, of->scene, of->answer, line, hooks, err);
}

static uz_status write_path(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_path path;
    const uz_status status = follow_path(&path, of, hooks, err);
    *file = status == UZ_OK ? codec_encode_path(&path, of->job_id, of->case_name, len) : NULL;
    uz_path_clear(&path);
    return status == UZ_OK && !*file ? UZ_ERR_MEMORY : status;
}

static uz_status write_path_csv(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_path path;
    const uz_status status = follow_path(&path, of, hooks, err);
    *file = status == UZ_OK ? codec_encode_path_csv(&path, len) : NULL;
    uz_path_clear(&path);
    return status == UZ_OK && !*file ? UZ_ERR_MEMORY : status;
}

/* "0,20" or "0,20,5"; the third NaN where there is none. */
static bool read_point(double out[3], const char *text)
{
    int n = 0;
    out[2] = (double)NAN;
    while (text && n < 3) {
        const size_t used = uz_parse_double(&out[n], text, strlen(text));
        if (used == 0 || !isfinite(out[n++]) || (text[used] != ',' && text[used] != '\0'))
            return false;
        if (text[used] == '\0')
            return n >= 2;
        text += used + 1;
    }
    return false;
}

/* A point of the plane and its normal. */
static bool read_plane(output_options *out, const http_request *rq, problem_details *problem)
{
    static const char *const KEYS[] = {"point", "normal"};
    double *const to[] = {out->plane.point, out->plane.normal};
    for (int i = 0; i < 2; i++)
        if (!read_point(to[i], target_value(&rq->target, KEYS[i])) || isnan(to[i][2]))
            return REFUSE_PARAMETER(problem, "%s is three numbers with commas between: point=0,0,5&normal=0,0,1",
                                    KEYS[i]);
    const double *n = out->plane.normal, length = hypot(hypot(n[0], n[1]), n[2]);
    if (!(length > 0 && isfinite(length)))
        return REFUSE_PARAMETER(problem, "normal is the direction across the plane, and 0,0,0 is none");
    return true;
}

/* Both ends of the line and how many points it has. */
static bool read_path(output_options *out, const http_request *rq, problem_details *problem)
{
    static const char *const ENDS[] = {"from", "to"};
    double *const to[] = {out->path.from, out->path.to};
    bool apart = false;
    for (int i = 0; i < 2; i++)
        if (!read_point(to[i], target_value(&rq->target, ENDS[i])))
            return REFUSE_PARAMETER(
                problem, "%s is a point, two numbers or three with commas between: from=0,0&to=60,20", ENDS[i]);
    for (int c = 0; c < 3; c++)
        apart = apart || out->path.from[c] < out->path.to[c] || out->path.from[c] > out->path.to[c];
    if (!apart)
        return REFUSE_PARAMETER(problem, "from and to are the same point: a path leads from one to another");
    out->path.count = 101;
    return request_integer(rq, "count", 2, 10000, &out->path.count, problem);
}

/* ---- the table */

#define IN_VTU ((STORED | COMPUTED | (unsigned)UZ_FIELD_MATERIALS) & ~(unsigned)UZ_FIELD_STRESS_GAUSS)
#define VTU_BY_DEFAULT                                                                                                 \
    ((unsigned)(UZ_FIELD_DISPLACEMENTS | UZ_FIELD_STRESS | UZ_FIELD_VON_MISES | UZ_FIELD_PRESSURE | UZ_FIELD_GAPS |    \
                UZ_FIELD_CONTACT_STATUS | UZ_FIELD_MATERIALS))
#define IN_SECTION ((unsigned)(UZ_FIELD_DISPLACEMENTS | UZ_FIELD_VON_MISES))
#define IN_SURFACE ((unsigned)(UZ_FIELD_DISPLACEMENTS | UZ_FIELD_VON_MISES | UZ_FIELD_PRESSURE))

static const char *const RESULT[] = {"fields", "case", "from", "count", NULL};
static const char *const FILE_OF[] = {"fields", "case", NULL};
static const char *const PICTURE[] = {"colour", "factor", "width", "view", "up", "case", NULL};
static const char *const SECTION[] = {"point", "normal", "fields", "case", NULL};
static const char *const PATH[] = {"from", "to", "count", "case", NULL};
static const char *const HISTORY[] = {"after", "case", NULL};
static const char *const OF_CASE[] = {"case", NULL};
static const char *const CURVES[] = {"case", "x", "with", "theme", "width", NULL};
static const char *const ERRORS[] = {"case", "theme", "width", NULL};

#define OUTPUT(suffix, parameters, handler)                                                                            \
    {                                                                                                                  \
        "GET", "/v1/jobs/{id}/" suffix, parameters, handler, false                                                     \
    }

const output OUTPUTS[] = {
    {OUTPUT("result", RESULT, results_get), "application/json", OUTPUT_OWN, NULL, 0, 0, NULL, false},
    {OUTPUT("result.npz", RESULT, results_get_arrays), "application/zip", OUTPUT_OWN, NULL, 0, 0, NULL, false},
    {OUTPUT("result.vtu", FILE_OF, output_get), "application/xml", OUTPUT_OF_ANSWER, write_vtu, VTU_BY_DEFAULT, IN_VTU,
     NULL, false},
    {OUTPUT("surface", FILE_OF, output_get), "model/gltf-binary", OUTPUT_OF_ANSWER, write_surface, IN_SURFACE,
     IN_SURFACE, NULL, false},
    {OUTPUT("section", SECTION, output_get), "model/gltf-binary", OUTPUT_OF_ANSWER, write_section, IN_SECTION,
     IN_SECTION, read_plane, false},
    {OUTPUT("deformed.svg", PICTURE, output_get), "image/svg+xml", OUTPUT_OF_ANSWER, write_picture, 0, 0, read_picture,
     false},
    {OUTPUT("path", PATH, output_get), "application/json", OUTPUT_OF_ANSWER, write_path, 0, 0, read_path, true},
    {OUTPUT("path.csv", PATH, output_get), "text/csv; charset=utf-8; header=present", OUTPUT_OF_ANSWER, write_path_csv,
     0, 0, read_path, false},
    {OUTPUT("history", HISTORY, output_get), "application/json", OUTPUT_OF_HISTORY, write_history, 0, 0, NULL, true},
    {OUTPUT("history.csv", HISTORY, output_get), "text/csv; charset=utf-8; header=present", OUTPUT_OF_HISTORY,
     write_history_csv, 0, 0, NULL, false},
    {OUTPUT("work-precision", OF_CASE, trade_get), "application/json", OUTPUT_OWN, NULL, 0, 0, NULL, false},
    {OUTPUT("convergence.svg", CURVES, convergence_get), "image/svg+xml", OUTPUT_OWN, NULL, 0, 0, NULL, false},
    {OUTPUT("whole-error.svg", ERRORS, whole_error_get), "image/svg+xml", OUTPUT_OWN, NULL, 0, 0, NULL, false},
    {.type = NULL},
};

/* ---- of a case of a scene */

/* A file on its way through fields_compute. */
typedef struct {
    const output *row;
    output_source of;
    char *file;
    size_t len;
} writing;

static uz_status write_answer(void *ctx, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                              const uz_hooks *hooks, uz_error *err)
{
    writing *w = ctx;
    (void)which;
    w->of.scene = scene;
    w->of.answer = answer;
    return w->row->write(&w->file, &w->len, &w->of, hooks, err);
}

/* ---- of a history */

static void reply_history(api *context, http_request *rq, writing *w, http_reply *reply)
{
    int64_t after = -1;
    found_rows found = {.rows = NULL};
    uz_error err = {0};
    problem_details problem;
    job j = {0};
    if (!request_integer(rq, "after", -1, INT64_MAX, &after, &problem)) {
        reply_problem(reply, &problem);
        return;
    }
    reply->tag_by_body = true;
    if (jobs_load(context, rq, &j, reply) &&
        history_rows(context, &j, target_value(&rq->target, "case"), after, &found, reply)) {
        w->of.case_name = found.case_name[0] ? found.case_name : NULL;
        w->of.rows = found.rows;
        w->of.n_rows = found.count;
        w->row->write(&w->file, &w->len, &w->of, NULL, &err); /* fails for want of memory, which reply_text says */
        reply_text(reply, 200, w->row->type, w->file, w->len);
    }
    reply->takes_ranges = reply->status == 200 && jobs_ended(&j); /* while it runs every reply is another one */
    jobs_check_still_there(context, &j, reply);
    free(found.rows);
    job_clear(&j);
}

void output_get(api *context, http_request *rq, http_reply *reply)
{
    const output *row = (const output *)(const void *)rq->route;
    output_options options = {.fields = 0};
    field_list fields = {.which = 0};
    problem_details problem;
    if (row->negotiated) {
        char type[64] = ""; /* without its parameters */
        strncat(type, row[1].type, strcspn(row[1].type, ";"));
        reply->varies_by_type = true;
        row += request_accepts(rq, type);
    }
    if ((row->allowed &&
         !fields_parse(&fields, target_value(&rq->target, "fields"), row->by_default, row->allowed, &problem)) ||
        (row->read && !row->read(&options, rq, &problem))) {
        reply_problem(reply, &problem);
        return;
    }
    options.fields = fields.which;
    writing w = {.row = row, .of = {.options = &options}};
    if (row->kind == OUTPUT_OF_HISTORY)
        reply_history(context, rq, &w, reply);
    else {
        job j = {0};
        results_place at = {.cases = NULL};
        field_reader reader;
        if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !results_known(rq, &j, reply) &&
            results_one(&at, context, &j, target_value(&rq->target, "case"), "a file", reply)) {
            w.of.job_id = j.id;
            w.of.case_name = at.name;
            if (fields_open(&reader, context, rq, &j, reply) &&
                fields_compute(&w, write_answer, &reader, at.number, w.of.options->fields, reply))
                reply_text(reply, 200, w.row->type, w.file, w.len);
            fields_close(&reader);
        }
        store_cases_free(at.cases, at.count);
        jobs_check_still_there(context, &j, reply);
        job_clear(&j);
    }
}
