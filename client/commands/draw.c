/* draw.c: drawings with characters: a convergence history, what each digit took, and a path of loads. */
#include "commands/fetch.h"
#include "show/plot.h"
#include "show/progress.h"
#include "show/report.h"

#include <langinfo.h>
#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define PLOT_WIDTH  72
#define PLOT_LEAST  24
#define PLOT_HEIGHT 20

/* As asked for, else as wide as the terminal allows, in what characters and colours it has. */
static client_plot_style style_of(const client_session *s)
{
    const client_options *o = s->options;
    const int columns = o->output ? PLOT_WIDTH : client_columns(s->out, PLOT_WIDTH);
    const int width = columns < PLOT_LEAST ? PLOT_LEAST : columns < PLOT_WIDTH ? columns : PLOT_WIDTH;
    setlocale(LC_CTYPE, "");
    return (client_plot_style){.width = o->width >= 0 ? o->width : width,
                               .height = o->height < 0 ? PLOT_HEIGHT : o->height,
                               .ascii = o->ascii || strcmp(nl_langinfo(CODESET), "UTF-8") != 0,
                               .colour = !o->output && isatty(fileno(s->out)) == 1 && !getenv("NO_COLOR")};
}

client_exit client_draw_history(client_session *s, const char *csv)
{
    char message[512], *text = NULL;
    size_t len = 0;
    client_series series;
    const client_plot_style style = style_of(s);
    if (!client_series_read(&series, csv, message, sizeof message))
        return client_complain(s, CLIENT_SERVER_ERROR, message);
    FILE *drawing = open_memstream(&text, &len);
    bool drawn = drawing && client_plot_print(drawing, &series, &style);
    bool ok = drawing && fclose(drawing) == 0;
    client_exit code = CLIENT_OK;
    if (!ok)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    else if (!drawn)
        client_complain(s, CLIENT_OK, "the history has no iteration to draw");
    else
        code = client_deliver(s, text, len);
    free(text);
    client_series_clear(&series);
    return code;
}

/* ------------------------------------------------------- what digits took */

void client_draw_trade(client_session *s, const json_t *trade)
{
    const json_t *decades = json_object_get(trade, "decades");
    const client_plot_style style = style_of(s);
    const int cells = style.width - 27;
    /* The least and the largest time that is there, as powers of ten. */
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < json_array_size(decades); i++) {
        const double seconds = client_json_number(json_array_get(decades, i), "seconds");
        low = seconds > 0 ? fmin(low, log10(seconds)) : low;
        high = seconds > 0 ? fmax(high, log10(seconds)) : high;
    }
    low -= 0.1; /* so that the shortest has a bar as well */
    fprintf(s->out, "%5s  %9s  %7s%s\n", "error", "certified", "steps",
            high > -INFINITY && cells >= 17 ? "  time, logarithmic" : "");
    for (size_t i = 0; i < json_array_size(decades); i++) {
        const json_t *decade = json_array_get(decades, i);
        char time[16] = "never", steps[24] = "";
        const double seconds = client_json_number(decade, "seconds");
        const double iterations = client_json_number(decade, "iterations");
        if (seconds >= 0)
            client_format_seconds(time, sizeof time, seconds);
        if (isfinite(iterations))
            snprintf(steps, sizeof steps, "%.0f", iterations);
        fprintf(s->out, "%5.0e  %9s  %7s", client_json_number(decade, "relative_error"), time, steps);
        if (seconds > 0 && cells > 0) {
            fputs("  ", s->out);
            /* A bar whose length is the logarithm of the time. */
            const int full = (int)lround((log10(seconds) - low) / (high - low) * cells);
            for (int k = 0; k < full; k++)
                fputs(style.ascii ? "#" : "\u2588", s->out);
        }
        fputc('\n', s->out);
    }
    const double mesh = client_json_number(trade, "mesh_error");
    if (isfinite(mesh))
        fprintf(s->out, "the mesh itself is off by about %.2g\n", mesh);
}

/* ------------------------------------------------ force over displacement */

/* A component of a force of contacts (support < 0) or of a support. */
typedef struct {
    int support, axis;
} force_place;

static double force_at(const json_t *summary, force_place place)
{
    const json_t *support = json_array_get(client_json_at(summary, "resultants.supports"), (size_t)place.support),
                 *force =
                     place.support < 0 ? client_json_at(summary, "contact.force") : json_object_get(support, "force"),
                 *value = json_array_get(force, (size_t)place.axis);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

/* The one that changes most along the path, with where that begins, at rest. force: count. */
static force_place choose_force(double *force, const json_t *cases, size_t count)
{
    force_place chosen = {-1, 0};
    double most = -1;
    const json_t *supports = client_json_at(json_array_get(cases, 0), "summary.resultants.supports");
    for (int support = -1; support < (int)json_array_size(supports); support++)
        for (int axis = 0; axis < 3; axis++) {
            double low = 0, high = 0;
            for (size_t i = 0; i < count; i++) {
                const double f =
                    force_at(json_object_get(json_array_get(cases, i), "summary"), (force_place){support, axis});
                low = fmin(low, f);
                high = fmax(high, f);
            }
            if (high - low > most) {
                most = high - low;
                chosen = (force_place){support, axis};
            }
        }
    for (size_t i = 0; i < count; i++)
        force[i] = force_at(json_object_get(json_array_get(cases, i), "summary"), chosen);
    return chosen;
}

static client_exit print_path(client_session *s, const json_t *cases, const double *displacement, const double *force,
                              const char *name)
{
    json_t *points = json_array();
    for (size_t i = 0; i < json_array_size(cases); i++)
        json_array_append_new(points,
                              json_pack("{s:s, s:f, s:f}", "case", client_json_text(json_array_get(cases, i), "name"),
                                        "displacement", displacement[i], "force", force[i]));
    json_t *all = json_pack("{s:s, s:o}", "force", name, "points", points);
    const client_exit code = client_print_json(s, all);
    json_decref(all);
    return code;
}

client_exit client_draw_path(client_session *s, const json_t *result)
{
    const json_t *cases = json_object_get(result, "cases");
    const size_t count = json_array_size(cases);
    const client_plot_style style = style_of(s);
    char name[64] = "contacts", names[128];
    bool any = false;
    double *displacement = calloc(2 * count + 1, sizeof *displacement);
    client_exit code = CLIENT_OK;
    if (!displacement)
        return client_complain(s, CLIENT_LOCAL, "no memory");
    double *force = displacement + count;
    for (size_t i = 0; i < count; i++) {
        displacement[i] = client_json_number(json_array_get(cases, i), "summary.finite.displacement");
        any = any || isfinite(displacement[i]);
    }
    const force_place chosen = choose_force(force, cases, count);
    if (chosen.support >= 0)
        snprintf(name, sizeof name, "support %d", chosen.support);
    snprintf(names, sizeof names, "force of %s along %c, over the largest displacement", name, "xyz"[chosen.axis]);
    if (!any)
        code = client_complain(s, CLIENT_LOCAL,
                               "the job has no load cases of large deformation: give it a case with \"steps\"");
    else if (s->options->json)
        code = print_path(s, cases, displacement, force, name);
    else if (!client_plot_curve(s->out, displacement, force, count, names, &style))
        code = client_complain(s, CLIENT_LOCAL, "the path has no forces to draw");
    free(displacement);
    return code;
}
