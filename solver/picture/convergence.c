/* convergence.c: how a run converged, as a diagram: Kanno's Figure 2, with the certified bound and the contacts. */
#include "core/error.h"
#include "picture/plot.h"

#include <math.h>

/* Pixels: around the panels, above each, and their heights. */
enum { LEFT = 66, RIGHT = 24, HEAD = 34, LINE = 17, ABOVE = 28, TALL = 165, LOW = 75, FOOT = 42 };

typedef enum { DUAL, RESIDUAL, BOUND, CONTACTS, PANELS } quantity;

static const struct {
    const char *name;
    int height;
    bool log, marks;
} PANEL[PANELS] = {{"dual objective: what is missing to the best bound, \u03c8* \u2212 \u03c8", TALL, true, true},
                   {"total residual", TALL, true, true},
                   {"certified bound on the error, energy norm", TALL, true, false},
                   {"rows in contact", LOW, false, false}};

static uz_curve_of curve_of(const uz_curve *c, quantity q, uz_plot_x x)
{
    const double *y = q == DUAL       ? c->dual_objective
                      : q == RESIDUAL ? c->residual
                      : q == BOUND    ? c->error_bound
                                      : c->contacts;
    /* The largest lower bound that is known: a run ends at the last of its own. */
    double best = isfinite(c->dual) ? c->dual : -INFINITY;
    for (int64_t i = 0; q == DUAL && i < c->count; i++) {
        const double psi = c->dual_objective[i * c->stride];
        best = isfinite(psi) ? fmax(best, psi) : best;
    }
    return (uz_curve_of){.x = {x == UZ_PLOT_SECONDS ? c->seconds : c->iteration, c->count, c->stride},
                         .y = {y, c->count, c->stride},
                         .minuend = q == DUAL ? best : (double)NAN};
}

static void put_panel(uz_buffer *svg, const uz_curve *curves, int n, quantity q, const uz_plot *how, double top)
{
    uz_range x = {0.0, 0.0}, y = UZ_RANGE_NONE;
    for (int k = 0; k < n; k++) {
        const uz_curve_of of = curve_of(&curves[k], q, how->x);
        for (int64_t i = 0; i < curves[k].count; i++) {
            uz_range_take(&x, uz_column_at(of.x, i), false);
            uz_range_take(&y, uz_curve_value(&of, i), PANEL[q].log);
        }
    }
    const uz_panel panel = uz_panel_make(LEFT, top, how->width - LEFT - RIGHT, PANEL[q].height, x, y, PANEL[q].log);
    uz_buffer_print(svg, "<g id=\"panel%d\">\n", (int)q);
    uz_panel_put_axes(svg, &panel, PANEL[q].name, q == PANELS - 1);
    for (int k = 0; k < n; k++) {
        const uz_curve_of of = curve_of(&curves[k], q, how->x);
        uz_panel_put_curve(svg, &panel, &of, k);
        if (PANEL[q].marks)
            uz_panel_put_marks(svg, &panel, &of, (uz_column){curves[k].restart, curves[k].count, curves[k].stride}, k);
    }
    uz_buffer_print(svg, "</g>\n");
}

static void put_legend(uz_buffer *svg, const uz_curve *curves, int n)
{
    for (int k = 0; k < n; k++) { /* a line for each curve */
        const int y = HEAD + k * LINE + 6;
        uz_buffer_print(svg, "<path class=\"curve c%d\" d=\"M%d %dh22\"/><text x=\"%d\" y=\"%d\">", k, LEFT, y,
                        LEFT + 30, y + 4);
        uz_buffer_put_escaped(svg, curves[k].name ? curves[k].name : "");
        uz_buffer_print(svg, "</text>\n");
    }
}

uz_status uz_picture_convergence(char **svg, size_t *len, const uz_curve *curves, int n, const uz_plot *how,
                                 uz_error *err)
{
    uz_plot plot = *how;
    uz_buffer text = {0};
    uz_error_reset(err);
    *svg = NULL;
    *len = 0;
    if (uz_plot_width(&plot.width, how, err) != UZ_OK)
        return UZ_ERR_ARGUMENT;
    if (n < 1 || n > UZ_CURVES)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a diagram has 1 to %d curves, not %d", (int)UZ_CURVES, n);
    for (int k = 0; k < n; k++)
        if (curves[k].count < 0 || curves[k].stride < 1)
            return uz_fail(err, UZ_ERR_ARGUMENT, "", "curve %d has no rows that could be read", k);
    plot.title = how->title ? how->title : "convergence";
    const int first = HEAD + n * LINE;
    int height = first + FOOT;
    for (int q = 0; q < PANELS; q++)
        height += ABOVE + PANEL[q].height;
    uz_plot_put_head(&text, &plot, height);
    put_legend(&text, curves, n);
    double top = first;
    for (int q = 0; q < PANELS; q++) {
        put_panel(&text, curves, n, (quantity)q, &plot, top + ABOVE);
        top += ABOVE + PANEL[q].height;
    }
    /* The foot: what x is, and what a mark means. */
    const double foot = height - 10;
    bool empty = true, restart = false;
    for (int k = 0; k < n; k++) {
        empty = empty && curves[k].count == 0;
        for (int64_t i = 0; i < curves[k].count && !restart; i++)
            restart = curves[k].restart[i * curves[k].stride] > 0.0;
    }
    uz_buffer_print(&text, "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", plot.width - RIGHT, foot,
                    how->x == UZ_PLOT_SECONDS ? "seconds since the first iteration" : "iterations");
    if (empty)
        uz_buffer_print(&text, "<text x=\"%d\" y=\"%.1f\">no iterations yet</text>\n", LEFT, foot);
    else if (restart)
        uz_buffer_print(&text,
                        "<path class=\"restart c0\" d=\"M%d %.1fl-3.5 -7h7z\"/><text x=\"%d\" y=\"%.1f\">momentum "
                        "dropped (restart)</text>\n",
                        LEFT + 4, foot, LEFT + 14, foot);
    uz_buffer_print(&text, "</svg>\n");
    const uz_status status = uz_buffer_finish(svg, len, &text, err);
    uz_buffer_drop(&text);
    return status;
}
