/* encode_result.c: results, histories and what accuracy took (/v1/jobs/{id}/work-precision): long texts, written
 * straight from the numbers. */
#include "codec/codec.h"
#include "codec/text.h"

#include <math.h>
#include <string.h>

/* Numbers, or points of `dim` numbers each; nothing for a vector that was not asked for. */
static void put_vector(text *t, const char *key, const double *x, int64_t n, int dim)
{
    if (!x)
        return;
    text_key(t, key);
    if (dim < 2) {
        text_numbers(t, NULL, x, n);
        return;
    }
    text_open(t, NULL, '[');
    for (int64_t i = 0; i + dim <= n && !t->failed; i += dim)
        text_numbers(t, NULL, x + i, dim);
    text_close(t, ']');
}

/* The names of what stresses and strains are made of, where they were computed. */
static void put_components(text *t, const uz_fields *f)
{
    if (!f || !(f->stress || f->strain || f->gauss_stress))
        return;
    text_open(t, "components", '[');
    for (int c = 0; c < f->components; c++)
        text_string(t, NULL, uz_field_components(f->dim)[c]);
    text_close(t, ']');
}

/* What each case has of its own. */
static void put_fields(text *t, const codec_result *result)
{
    const uz_fields *f = result->fields;
    put_vector(t, "reactions", result->reactions, result->m, 0);
    put_vector(t, "gaps", result->gaps, result->m, 0);
    put_vector(t, "pressure", result->pressure, result->m, 0);
    put_vector(t, "ray", result->ray, result->m, 0);
    put_vector(t, "displacements", result->displacements, result->n_u, result->dim);
    put_components(t, f);
    if (!f)
        return;
    put_vector(t, "contact_status", f->contact_status, f->m, 0);
    put_vector(t, "stress", f->stress, f->n_nodes * f->components, f->components);
    put_vector(t, "principal", f->principal, f->n_nodes * 3, 3);
    put_vector(t, "von_mises", f->von_mises, f->n_nodes, 0);
    put_vector(t, "strain", f->strain, f->n_nodes * f->components, f->components);
    if (f->gauss_stress) {
        text_open(t, "stress_gauss", '{');
        put_vector(t, "elements", f->gauss_element, f->n_points, 0);
        put_vector(t, "points", f->gauss_point, f->n_points * f->dim, f->dim);
        put_vector(t, "stress", f->gauss_stress, f->n_points * f->components, f->components);
        text_close(t, '}');
    }
}

void codec_put_places(text *t, const codec_result *result)
{
    if (result->part)
        text_integer(t, "from", result->from);
    put_vector(t, "nodes", result->nodes, result->n_nodes, result->dim);
    put_vector(t, "contact_nodes", result->contact_nodes, result->m, 0);
}

static void open_result(text *t, const codec_result *result)
{
    text_open(t, NULL, '{');
    text_string(t, "job", result->job_id);
    if (result->case_name)
        text_string(t, "case", result->case_name);
    text_raw(t, "summary", result->summary);
}

char *codec_encode_result_head(const codec_result *result)
{
    text t = {0};
    open_result(&t, result);
    put_components(&t, result->fields);
    if (result->part)
        text_integer(&t, "from", result->from);
    text_close(&t, '}');
    return text_finish(&t, NULL);
}

char *codec_encode_result(const codec_result *result, size_t *len)
{
    text t = {0};
    open_result(&t, result);
    put_fields(&t, result);
    codec_put_places(&t, result);
    text_close(&t, '}');
    return text_finish(&t, len);
}

void codec_put_case(text *t, const codec_result *one)
{
    text_open(t, NULL, '{');
    text_string(t, "name", one->case_name);
    text_raw(t, "summary", one->summary);
    put_fields(t, one);
    if (one->own_rows)
        put_vector(t, "contact_nodes", one->contact_nodes, one->m, 0);
    text_close(t, '}');
}

const char *const CODEC_HISTORY_NAMES[CODEC_HISTORY_COLUMNS] = {
    "iteration", "seconds", "dual_objective", "residual_total", "e1",       "e2",
    "e3",        "e4",      "step_norm",      "error_bound",    "contacts", "restart"};

void codec_history_row(double out[CODEC_HISTORY_COLUMNS], const uz_history_row *row)
{
    const uz_residual *e = &row->residual;
    memcpy(out,
           (const double[CODEC_HISTORY_COLUMNS]){(double)row->iteration, row->seconds, row->dual_objective, e->total,
                                                 e->e1, e->e2, e->e3, e->e4, row->step_norm, row->error_bound,
                                                 (double)row->contacts, row->restart ? 1.0 : 0.0},
           CODEC_HISTORY_COLUMNS * sizeof *out);
}

char *codec_encode_history(const char *case_name, const double *rows, int64_t count, size_t *len)
{
    text t = {0};
    text_open(&t, NULL, '{');
    if (case_name)
        text_string(&t, "case", case_name);
    text_open(&t, "columns", '[');
    for (int i = 0; i < CODEC_HISTORY_COLUMNS; i++)
        text_string(&t, NULL, CODEC_HISTORY_NAMES[i]);
    text_close(&t, ']');
    text_open(&t, "rows", '[');
    for (int64_t i = 0; i < count && !t.failed; i++)
        text_numbers(&t, NULL, rows + i * CODEC_HISTORY_COLUMNS, CODEC_HISTORY_COLUMNS);
    text_close(&t, ']');
    text_close(&t, '}');
    return text_finish(&t, len);
}

/* CSV has no null: what is not finite is written as inf, -inf or nan, which every reader of numbers understands. */
static void put_cell(text *t, double x)
{
    char digits[UZ_DOUBLE_ROOM];
    if (isfinite(x))
        text_bytes(t, digits, uz_format_double(digits, x));
    else
        text_put(t, isnan(x) ? "nan" : x < 0 ? "-inf" : "inf");
}

/* From the first point of a path. */
static double path_distance(const uz_path *path, int64_t i)
{
    double sum = 0;
    for (int c = 0; c < path->dim; c++)
        sum = hypot(sum, path->point[i * path->dim + c] - path->point[c]);
    return sum;
}

char *codec_encode_history_csv(const double *rows, int64_t count, size_t *len)
{
    text t = {0};
    for (int i = 0; i < CODEC_HISTORY_COLUMNS; i++) {
        text_put(&t, i ? "," : "");
        text_put(&t, CODEC_HISTORY_NAMES[i]);
    }
    text_put(&t, "\n");
    for (int64_t i = 0; i < count && !t.failed; i++)
        for (int j = 0; j < CODEC_HISTORY_COLUMNS; j++) {
            text_put(&t, j ? "," : "");
            put_cell(&t, rows[i * CODEC_HISTORY_COLUMNS + j]);
            text_put(&t, j + 1 < CODEC_HISTORY_COLUMNS ? "" : "\n");
        }
    return text_finish(&t, len);
}

/* ---- along a path */

char *codec_encode_path(const uz_path *path, const char *job_id, const char *case_name, size_t *len)
{
    const char *const *component = uz_field_components(path->dim);
    text t = {0};
    text_open(&t, NULL, '{');
    text_string(&t, "job", job_id);
    if (case_name)
        text_string(&t, "case", case_name);
    text_open(&t, "components", '[');
    for (int i = 0; i < path->components; i++)
        text_string(&t, NULL, component[i]);
    text_close(&t, ']');
    text_open(&t, "distance", '[');
    for (int64_t i = 0; i < path->count; i++)
        text_number(&t, NULL, path_distance(path, i));
    text_close(&t, ']');
    put_vector(&t, "points", path->point, path->count * path->dim, path->dim);
    put_vector(&t, "displacements", path->u, path->count * path->dim, path->dim);
    put_vector(&t, "stress", path->stress, path->count * path->components, path->components);
    put_vector(&t, "von_mises", path->von_mises, path->count, 0);
    text_close(&t, '}');
    return text_finish(&t, len);
}

char *codec_encode_path_csv(const uz_path *path, size_t *len)
{
    static const char *const AXES[] = {"x", "y", "z"};
    const char *const *component = uz_field_components(path->dim);
    text t = {0};
    text_put(&t, "distance");
    for (int c = 0; c < path->dim; c++)
        text_format(&t, ",%s", AXES[c]);
    for (int c = 0; c < path->dim; c++)
        text_format(&t, ",u%s", AXES[c]);
    for (int c = 0; c < path->components; c++)
        text_format(&t, ",stress_%s", component[c]);
    text_put(&t, ",von_mises\n");
    for (int64_t i = 0; i < path->count && !t.failed; i++) {
        put_cell(&t, path_distance(path, i));
        const struct {
            const double *values;
            int count;
        } PARTS[] = {
            {path->point, path->dim}, {path->u, path->dim}, {path->stress, path->components}, {path->von_mises, 1}};
        for (size_t k = 0; k < sizeof PARTS / sizeof PARTS[0]; k++)
            for (int c = 0; c < PARTS[k].count; c++) {
                text_put(&t, ",");
                put_cell(&t, PARTS[k].values[i * PARTS[k].count + c]);
            }
        text_put(&t, "\n");
    }
    return text_finish(&t, len);
}

/* ---- what accuracy took */

enum { DECADES = 10 };

/* What a relative error took; level NULL: none has it as its aim. seconds: when the bound was established, or what the
 * whole solve would have taken. */
static void put_reached(text *t, const char *level, double relative_error, const uz_trade *trade)
{
    const uz_trade_step *step = isfinite(relative_error) ? uz_trade_reach(trade, relative_error) : NULL;
    text_open(t, NULL, '{');
    if (level)
        text_string(t, "level", level);
    text_number(t, "relative_error", relative_error);
    text_number(t, "seconds", !step ? (double)NAN : level ? uz_trade_cost(trade, step) : step->seconds);
    if (step) {
        text_integer(t, "iterations", step->iterations);
        text_integer(t, "applications", step->applications);
    } else {
        text_raw(t, "iterations", NULL);
        text_raw(t, "applications", NULL);
    }
    text_string(t, "by", !step ? NULL : step->by_certificate ? "certificate" : "iteration");
    text_close(t, '}');
}

char *codec_encode_trade(const codec_trade *of, size_t *len)
{
    text t = {0};
    const uz_trade *trade = &of->trade;
    static const double DECADE[DECADES] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
    text_open(&t, NULL, '{');
    text_string(&t, "job", of->job_id);
    if (of->case_name)
        text_string(&t, "case", of->case_name);
    text_open(&t, "decades", '[');
    for (int k = 0; k < DECADES; k++)
        put_reached(&t, NULL, DECADE[k], trade);
    text_close(&t, ']');
    text_open(&t, "levels", '[');
    put_reached(&t, "quick", 1e-2, trade);
    put_reached(&t, "balanced", of->mesh_error > 0.0 ? fmin(1.0, 0.1 * of->mesh_error) : (double)NAN, trade);
    put_reached(&t, "precise", 1e-8, trade);
    put_reached(&t, "exact", 1e-12, trade);
    text_close(&t, ']');
    text_number(&t, "iterated_s", trade->iterated_s);
    text_number(&t, "total_s", trade->total_s);
    text_number(&t, "solver_error", of->solver_error);
    text_number(&t, "mesh_error", of->mesh_error);
    text_close(&t, '}');
    return text_finish(&t, len);
}
